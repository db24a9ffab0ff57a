//! The stabilisation diagram: poles of every order over frequency, the level behind them, and the modes.

use tapjoint_analysis::{Frf, MeasuredSpectra, RecordingResult};
use tapjoint_signal::modal::polyreference::{BandSearch, PoleStability};

use super::super::chart::{Axis, Block, Chart, Color, InPage, Mark, Panel, Rule, Series};
use super::super::format::trimmed;
use super::spectra::{frequency_axis, magnitude_axis, magnitudes, rules};

/// Most narrow bands drawn in the picture.
const MOST: usize = 8;
/// Narrow bands side by side.
const COLUMNS: usize = 4;
/// Share of a panel's height that the level behind fills.
const LEVEL_SHARE: f64 = 0.96;

/// Classes of poles from the worst to the best, which lies on top, with their looks.
const CLASSES: [(PoleStability, &str, Color, Mark); 5] = [
    (PoleStability::New, "new", Color::Soft, Mark::Cross(2.4)),
    (
        PoleStability::Frequency,
        "frequency only",
        Color::Orange,
        Mark::Ring(3.2),
    ),
    (
        PoleStability::FrequencyAndVector,
        "frequency and vector",
        Color::Purple,
        Mark::Ring(3.2),
    ),
    (
        PoleStability::FrequencyAndDamping,
        "frequency and damping, not vector",
        Color::Sky,
        Mark::Ring(3.2),
    ),
    (
        PoleStability::All,
        "stable: frequency and damping",
        Color::Green,
        Mark::Dot(3.2),
    ),
];

/// Returns the stabilisation diagram of a recording: the whole band, then the bands about groups of peaks. The level
/// behind it is that of the frequency response functions, or without any that of the responses. `None` where no pole
/// was found.
pub fn stabilisation(recording: &RecordingResult, name: &str, frfs: &[Frf]) -> Option<Chart> {
    let spectra = recording.measurement.spectra.as_ref()?;
    let searches = &spectra.stabilisation.searches;
    let (whole, narrow) = searches.split_first()?;
    let poles: usize = searches.iter().map(|search| search.diagram.len()).sum();
    if poles == 0 {
        return None;
    }
    let level = level(spectra, frfs);
    let mut rules = rules(recording, spectra);
    for rule in &mut rules {
        // Lines and their bounds are the spectra's matter.
        rule.half = 0.0;
    }
    let whole_panel = panel(spectra, &level, whole, frequency_axis(spectra), &rules);
    let mut blocks = vec![Block {
        name: "whole band".to_owned(),
        ..Block::new(1, vec![whole_panel])
    }];
    let mut panels = Vec::new();
    for search in narrow {
        let (low, high) = search.band.core;
        let x = Axis::linear(low, high).of("frequency", "Hz");
        let within = spectra.readings.iter().zip(&recording.mode_numbers);
        let within = within.filter(|(reading, _)| (low..=high).contains(&reading.frequency));
        let numbers = within.filter_map(|(_, mode)| Some(mode.as_ref()?.to_string()));
        let numbers: Vec<String> = numbers.collect();
        let modes = match numbers.len() {
            0 => String::new(),
            1 => format!("mode {} \u{b7} ", numbers.concat()),
            _ => format!("modes {} \u{b7} ", numbers.join(", ")),
        };
        let title = format!("{modes}{} to {} Hz", trimmed(low, 4), trimmed(high, 4));
        let mut narrow = panel(spectra, &level, search, x, &rules).titled(title);
        narrow.height = 150.0;
        panels.push(narrow);
    }
    if !panels.is_empty() {
        let drawn = panels.len().min(MOST);
        let name = if drawn < panels.len() {
            format!(
                "Bands about groups of peaks, the first {drawn} of {}",
                panels.len()
            )
        } else {
            "Bands about groups of peaks, each fitted by itself".to_owned()
        };
        blocks.push(Block {
            name,
            drawn,
            in_page: InPage::Apart,
            ..Block::new(COLUMNS, panels)
        });
    }
    Some(Chart {
        kind: "stabilisation",
        title: format!("Stabilisation diagram, {name}"),
        subtitle: format!(
            "{poles} poles of the polyreference fit, orders up to {} \u{b7} a mode returns at the same frequency and \
             damping at order after order; poles of noise scatter",
            whole.order
        ),
        caption: format!(
            "Stabilisation diagram of {name}: poles that the fit finds at each order, marked by \
             what they share with a pole of the order before."
        ),
        blocks,
        ..Chart::default()
    })
}

/// Returns the poles of one band over a horizontal axis, with the modes selected from all bands.
fn panel(
    spectra: &MeasuredSpectra,
    level: &[f64],
    search: &BandSearch,
    x: Axis,
    rules: &[Rule],
) -> Panel {
    let top = search.order as f64 + 1.0;
    let mut series = vec![level_series(spectra, level, &x, top)];
    for (class, name, color, mark) in CLASSES {
        let mut set = Series::new(name, color, mark);
        let poles = search.diagram.iter();
        for pole in poles.filter(|pole| pole.stability == class && pole.frequency.is_finite()) {
            set.push(pole.frequency, pole.order as f64);
            set.extra.push(100.0 * pole.damping_ratio);
        }
        series.push(set);
    }
    let mut selected = Series::new("selected (lower edge)", Color::Ink, Mark::Square(3.0));
    let searches = spectra.stabilisation.searches.iter();
    for mode in searches.flat_map(|search| &search.modes) {
        selected.push(mode.frequency, 0.012 * top);
    }
    series.push(selected);
    let rules = rules.iter().filter(|rule| x.holds(rule.at));
    Panel {
        extra: Some(["damping", "%"]),
        rules: rules.cloned().collect(),
        ..Panel::new(400.0, x, Axis::linear(0.0, top).of("order", "")).with(series)
    }
}

/// Returns on each line the largest level of all frequency response functions, or without a hammer of all responses,
/// each over its own highest value.
fn level(spectra: &MeasuredSpectra, frfs: &[Frf]) -> Vec<f64> {
    let curves: Vec<Vec<f64>> = match frfs.is_empty() {
        true => spectra.averages.responses.clone(),
        false => frfs.iter().map(|frf| magnitudes(frf.values())).collect(),
    };
    let count = curves.iter().map(Vec::len).max().unwrap_or(0);
    let mut levels = vec![0.0; count];
    for curve in curves {
        let finite = curve.iter().copied().filter(|value| value.is_finite());
        let highest = finite.fold(0.0, f64::max);
        for (most, value) in levels.iter_mut().zip(curve).filter(|_| highest > 0.0) {
            // The larger of the two: f64::max passes over what is no number.
            *most = f64::max(*most, value / highest);
        }
    }
    levels
}

/// Returns the part of the level that lies on an axis: its logarithm fills the panel up to the order `top`.
fn level_series(spectra: &MeasuredSpectra, level: &[f64], x: &Axis, top: f64) -> Series {
    let lines = &spectra.averages.lines;
    let numbered = level.iter().enumerate();
    let places = numbered.map(|(line, value)| {
        let at = lines.frequency(0) + lines.spacing * line as f64;
        (at, *value)
    });
    let seen: Vec<(f64, f64)> = places.filter(|(at, _)| x.holds(*at)).collect();
    let scale = magnitude_axis(seen.iter().map(|(_, value)| *value));
    let shares = seen.iter();
    let shares = shares.map(|(_, value)| LEVEL_SHARE * top * scale.share(*value));
    let first = seen.first().map_or(0.0, |(at, _)| *at);
    Series {
        mark: Mark::Line(1.2),
        opacity: 0.6,
        ..Series::even(
            "level (log)",
            Color::Data,
            first,
            lines.spacing,
            shares.collect(),
        )
    }
}
