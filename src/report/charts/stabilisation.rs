//! The stabilisation diagram: poles of every order over frequency, the level behind them, and the modes.

use tapjoint_signal::modal::polyreference::PoleStability;

use super::super::chart::{Axis, Block, Chart, Color, InPage, Mark, Panel, Series};
use super::super::figures::{
    RecordingFigure, SpectraFigure, StabilisationBand, StabilisationFigure,
};
use super::super::format::trimmed;
use super::spectra::{frequency_axis, magnitude_axis, over_lines, rules};

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

/// The stabilisation diagram of a recording: the whole band, then the bands about groups of peaks; `None` where
/// no pole was found.
pub fn stabilisation(figure: &RecordingFigure) -> Option<Chart> {
    let spectra = figure.spectra.as_ref()?;
    let found = figure.stabilisation.as_ref()?;
    let (whole, narrow) = found.bands.split_first()?;
    let poles: usize = found.bands.iter().map(|band| band.poles.len()).sum();
    if poles == 0 {
        return None;
    }
    let widest = panel(spectra, found, whole, frequency_axis(spectra), 400.0);
    let mut blocks = vec![Block {
        name: "whole band".to_owned(),
        ..Block::new(1, vec![widest])
    }];
    let mut panels = Vec::new();
    for band in narrow {
        let x = Axis::linear(band.core.0, band.core.1).of("frequency", "Hz");
        panels.push(panel(spectra, found, band, x, 150.0).titled(named(spectra, band)));
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
    let file = &figure.file;
    Some(Chart {
        kind: "stabilisation",
        title: format!("Stabilisation diagram, {file}"),
        subtitle: format!(
            "{poles} poles of the polyreference fit, orders up to {} \u{b7} a mode returns at the same frequency and \
             damping at order after order; poles of noise scatter",
            whole.order
        ),
        caption: format!(
            "Stabilisation diagram of {file}: poles that the fit finds at each order, marked by \
             what of them the order before had."
        ),
        blocks,
        ..Chart::default()
    })
}

fn panel(
    spectra: &SpectraFigure,
    found: &StabilisationFigure,
    band: &StabilisationBand,
    x: Axis,
    height: f64,
) -> Panel {
    let top = band.order as f64 + 1.0;
    let mut series = vec![level(spectra, &x, top)];
    for (class, name, color, mark) in CLASSES {
        let poles = band.poles.iter().filter(|pole| pole.stability == class);
        let poles: Vec<_> = poles.filter(|pole| pole.frequency.is_finite()).collect();
        let places = poles.iter().map(|pole| (pole.frequency, pole.order as f64));
        let mut set = Series::points(name, color, mark, places);
        set.extra = poles
            .iter()
            .map(|pole| 100.0 * pole.damping_ratio)
            .collect();
        series.push(set);
    }
    let selected = found.bands.iter().flat_map(|band| &band.selected);
    let selected = selected.map(|frequency| (*frequency, 0.012 * top));
    let name = "selected (lower edge)";
    series.push(Series::points(
        name,
        Color::Ink,
        Mark::Square(3.0),
        selected,
    ));
    let mut rules = rules(spectra);
    rules.retain(|rule| x.holds(rule.at));
    for rule in &mut rules {
        // Lines and their bounds are the spectra's matter.
        rule.half = 0.0;
    }
    let mut panel = Panel::new(height, x, Axis::linear(0.0, top).of("order", "")).with(series);
    panel.extra = Some(["damping", "%"]);
    panel.rules = rules;
    panel
}

/// "modes 1, 2 · 40 to 60 Hz".
fn named(spectra: &SpectraFigure, band: &StabilisationBand) -> String {
    let (low, high) = band.core;
    let within = spectra
        .peaks
        .iter()
        .filter(|peak| (low..=high).contains(&peak.frequency));
    let numbers = within.filter_map(|peak| Some(peak.mode?.to_string()));
    let numbers: Vec<String> = numbers.collect();
    let modes = match numbers.len() {
        0 => String::new(),
        1 => format!("mode {} \u{b7} ", numbers.concat()),
        _ => format!("modes {} \u{b7} ", numbers.join(", ")),
    };
    format!("{modes}{} to {} Hz", trimmed(low, 4), trimmed(high, 4))
}

/// The largest level of all frequency response functions, or without a hammer of all responses, each
/// over its own highest value: its logarithm fills the panel up to the order `top`.
fn level(spectra: &SpectraFigure, x: &Axis, top: f64) -> Series {
    let curves: Vec<&[f64]> = if spectra.frfs.is_empty() {
        spectra
            .responses
            .iter()
            .map(|curve| curve.values.as_slice())
            .collect()
    } else {
        spectra
            .frfs
            .iter()
            .map(|frf| frf.magnitude.as_slice())
            .collect()
    };
    let count = curves.iter().map(|curve| curve.len()).max().unwrap_or(0);
    let mut values = vec![0.0; count];
    for curve in curves {
        let finite = curve.iter().copied().filter(|value| value.is_finite());
        let highest = finite.fold(0.0, f64::max);
        for (most, value) in values.iter_mut().zip(curve).filter(|_| highest > 0.0) {
            // The larger of the two: f64::max passes over what is no number.
            *most = f64::max(*most, value / highest);
        }
    }
    let curve = over_lines(spectra, "", Color::Data, values);
    let seen: Vec<f64> = curve
        .pairs()
        .filter(|(at, _)| x.holds(*at))
        .map(|(_, value)| value)
        .collect();
    let scale = magnitude_axis([seen.as_slice()].into_iter());
    let first = (0..curve.count()).find(|index| x.holds(curve.at(*index)));
    let shares = seen
        .iter()
        .map(|value| LEVEL_SHARE * top * scale.share(*value));
    let start = first.map_or(0.0, |index| curve.at(index));
    let name = "level (log)";
    let step = spectra.lines.spacing;
    let mut series = Series::even(name, Color::Data, start, step, shares.collect());
    series.mark = Mark::Line(1.2);
    series.opacity = 0.6;
    series
}
