//! How the modes of a recording were found, and how they change.
//!
//! The stabilisation diagram shows the poles of every order, the level behind them, and the modes. A second chart shows
//! natural frequency and damping against amplitude.

use super::spectra::{frequency_axis, magnitude_axis, magnitudes, rules, unit_of};
use crate::format::{significant, trimmed};
use crate::picture::{
    Axis, Block, Chart, Color, InPage, Mark, Panel, Rule, Series, extent, padded,
};
use tapjoint_analysis::{Frf, MeasuredSpectra, RecordingResult, Response};
use tapjoint_signal::modal::amplitude::{AmplitudeCurve, AmplitudeVerdict, Trend};
use tapjoint_signal::modal::polyreference::{BandSearch, PoleStability};

/// Most narrow bands, and most modes, in a picture; the page and the tables have them all.
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
             what they share with a pole of the order before. On the page a click chooses a pole."
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
    // The logarithm of the level fills the panel up to the highest order.
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
    let (first, shares) = (seen.first().map_or(0.0, |(at, _)| *at), shares.collect());
    let mut level = Series::even("level (log)", Color::Data, first, lines.spacing, shares);
    (level.mark, level.opacity) = (Mark::Line(1.2), 0.6);
    let mut series = vec![level];
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

/// Returns on each line the largest level of all frequency response functions, each over its own highest value.
/// Without a hammer the responses take their place.
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

/// Points up to this many times the median uncertainty decide the vertical range; bars of others may
/// leave the panel.
const TELLING: f64 = 4.0;
/// Standard uncertainties by which a point lies apart from the others: chance does not reach that far.
const DISTANT: f64 = 4.0;
/// From this many taps on all points have one colour.
const MOST_COLOURS: usize = 4;
/// Half length of a bar: 95 % of a normal distribution.
const BAR: f64 = 1.96;
/// Places at which the curve and its bound are computed.
const CURVE_POINTS: usize = 80;

/// Returns frequency and damping of a recording's numbered modes against amplitude; `None` where none of them changes
/// enough to matter.
pub fn amplitude(recording: &RecordingResult, name: &str) -> Option<Chart> {
    let spectra = recording.measurement.spectra.as_ref()?;
    let numbered = spectra.readings.iter().zip(&recording.mode_numbers);
    let numbered = numbered.filter_map(|(reading, mode)| Some((reading, (*mode)?)));
    numbered
        .clone()
        .find(|(reading, _)| recording.amplitude_change(reading).is_some())?;
    let modes = numbered.filter_map(|(reading, mode)| {
        let curve = reading.fit.as_ref()?.amplitude.as_ref()?;
        Some((mode, curve))
    });
    let modes: Vec<(usize, &AmplitudeCurve)> = modes.collect();
    // The amplitude is that of one sensor, or of the strongest sensor where the modes differ in it.
    let mut sensors: Vec<usize> = modes.iter().filter_map(|(_, curve)| curve.sensor).collect();
    sensors.sort_unstable();
    sensors.dedup();
    let responses = sensors.iter();
    let responses = responses.filter_map(|sensor| recording.responses.get(*sensor));
    let responses: Vec<&Response> = responses.collect();
    let unit = responses.first().and_then(|first| first.unit.clone());
    let unit = match responses.iter().all(|response| response.unit == unit) {
        true => unit_of(&unit),
        false => "each sensor's unit".to_owned(),
    };
    let label = match responses.as_slice() {
        [one] => format!("peak amplitude of {}", one.name),
        _ => "peak amplitude of the mode's strongest sensor".to_owned(),
    };
    curves(name, &[label, unit], &modes)
}

/// Returns frequency and damping of modes, each with its number, against an amplitude of this name and unit; `None`
/// where no mode has a curve.
pub fn curves(
    name: &str,
    amplitude: &[String; 2],
    modes: &[(usize, &AmplitudeCurve)],
) -> Option<Chart> {
    let mut blocks: Vec<Block> = Vec::new();
    for (number, curve) in modes.iter().filter(|(_, curve)| curve.frequency.is_some()) {
        let panels = quantities(curve).map(|quantity| quantity.panel(amplitude, curve));
        let mut block = Block::new(2, panels.collect());
        block.name = format!("mode {number}");
        block.aside = verdict(curve);
        if blocks.len() >= MOST {
            block.drawn = 0;
        }
        blocks.push(block);
    }
    let shown = match blocks.len() {
        0 => return None,
        count if count > MOST => format!(" \u{b7} the first {MOST} of {count} modes"),
        _ => String::new(),
    };
    Some(Chart {
        kind: "amplitude",
        title: format!("Frequency and damping against amplitude, {name}"),
        subtitle: format!(
            "every point a piece of a decay, none used twice \u{b7} bars and band 95 %{shown}"
        ),
        caption: format!("Frequency and damping of the modes of {name} against amplitude."),
        blocks,
        ..Chart::default()
    })
}

/// One of the two quantities that may depend on amplitude.
struct Quantity<'a> {
    name: &'static str,
    unit: &'static str,
    /// Unit drawn over the trend's unit: damping is drawn in percent.
    factor: f64,
    trend: &'a Trend,
    /// Value and standard uncertainty of every point, in the unit drawn.
    values: Vec<(f64, f64)>,
}

/// Returns frequency and damping ratio, as far as they have a trend.
fn quantities(curve: &AmplitudeCurve) -> impl Iterator<Item = Quantity<'_>> {
    let points = curve.points.iter();
    let frequencies = points
        .clone()
        .map(|point| (point.frequency, point.frequency_std));
    let frequency = curve.frequency.as_ref().map(|trend| Quantity {
        name: "frequency",
        unit: "Hz",
        factor: 1.0,
        trend,
        values: frequencies.collect(),
    });
    let ratios = points.map(|point| (100.0 * point.damping_ratio, 100.0 * point.damping_std));
    let damping = curve.damping.as_ref().map(|trend| Quantity {
        name: "damping ratio",
        unit: "%",
        factor: 100.0,
        trend,
        values: ratios.collect(),
    });
    frequency.into_iter().chain(damping)
}

impl Quantity<'_> {
    fn panel(&self, amplitude: &[String; 2], curve: &AmplitudeCurve) -> Panel {
        let sizes = curve.points.iter().map(|point| point.amplitude);
        let (low, high) = extent(sizes).unwrap_or((1.0, 10.0));
        // Amplitudes rise to the right as on every axis: a decay runs from right to left.
        let [label, unit] = amplitude;
        let x = Axis::logarithmic(low / 1.12, high * 1.12).of(label, unit);
        let mut bound = Series::new("95 % bound", Color::Blue, Mark::Band);
        let mut line = Series::new("curve through them", Color::Ink, Mark::Line(1.5));
        for index in 0..CURVE_POINTS {
            let share = index as f64 / (CURVE_POINTS - 1) as f64;
            let amplitude = low * (share * (high / low).ln()).exp();
            if let Some((value, half)) = self.trend.at_amplitude(amplitude) {
                let (value, half) = (self.factor * value, self.factor * half);
                line.push(amplitude, value);
                bound.low.push(value - half);
                bound.high.push(value + half);
            }
        }
        bound.x = line.x.clone();
        let mut panel = Panel::new(160.0, x, self.axis()).with([bound, line]);
        panel.extra = Some(["time after the tap", "s"]);
        panel.with(self.dots(curve))
    }

    /// The points in a colour for each tap, as long as there are few taps.
    fn dots(&self, curve: &AmplitudeCurve) -> Vec<Series> {
        let taps = curve.points.iter().map(|point| point.tap + 1);
        let taps = taps.max().unwrap_or(0);
        let groups = if taps <= MOST_COLOURS { taps } else { 1 };
        let mut dots = Vec::new();
        for group in 0..groups {
            let name = match taps {
                1 => "piece of the decay".to_owned(),
                2..=MOST_COLOURS => format!("tap {}", group + 1),
                _ => format!("pieces of the decays of {taps} taps"),
            };
            let mut set = Series::new(&name, Color::curve(group), Mark::Dot(3.3));
            for (point, (value, std)) in curve.points.iter().zip(&self.values) {
                if groups == 1 || point.tap == group {
                    set.push(point.amplitude, *value);
                    set.low.push(value - BAR * std);
                    set.high.push(value + BAR * std);
                    set.extra.push(point.time);
                }
            }
            dots.push(set);
        }
        dots
    }

    /// The vertical axis, with some room. It shows the points that are known well, and points that differ from them
    /// by far more than their own uncertainty.
    fn axis(&self) -> Axis {
        let values = &self.values;
        let mut stds: Vec<f64> = values.iter().map(|(_, std)| *std).collect();
        stds.sort_by(f64::total_cmp);
        let limit = TELLING * stds.get(stds.len() / 2).copied().unwrap_or(0.0);
        let telling = values.iter().filter(|(_, std)| *std <= limit);
        let bars = telling.flat_map(|(value, std)| [value - BAR * std, value + BAR * std]);
        let (low, high) = extent(bars).unwrap_or((0.0, 1.0));
        let mut ends = vec![low, high];
        for (value, std) in values {
            if value + DISTANT * std < low || value - DISTANT * std > high {
                ends.extend([value - BAR * std, value + BAR * std]);
            }
        }
        padded(extent(ends).unwrap_or((low, high)), 0.12).of(self.name, self.unit)
    }
}

/// "change from loud to soft: frequency +0.32 ± 0.01 Hz, damping ratio −0.14 ± 0.01 %".
fn verdict(curve: &AmplitudeCurve) -> String {
    // Where the softest pieces drown in noise a slope may be certain, and the ends are not.
    let trends = [&curve.frequency, &curve.damping];
    let mut trends = trends.into_iter().flatten();
    let seen_at_the_ends = trends.any(|trend| trend.change.abs() > trend.change_bound);
    match curve.verdict {
        AmplitudeVerdict::Changes if seen_at_the_ends => {
            format!("change from loud to soft: {}", changes(curve))
        }
        // By the slopes of the straight lines, with 95 % bounds (normal distribution: a line leaves many degrees of
        // freedom).
        AmplitudeVerdict::Changes => {
            let half = 0.5f64.ln();
            let slopes = both(curve, |trend| {
                (half * trend.slope, 1.96 * half.abs() * trend.slope_std)
            });
            format!("at half the amplitude: {slopes}")
        }
        AmplitudeVerdict::Steady => {
            format!("no change beyond its uncertainty: {}", changes(curve))
        }
        AmplitudeVerdict::Beating { frequency } => {
            format!("beats with a neighbour at {frequency:.2} Hz: no amplitude dependence shown")
        }
        AmplitudeVerdict::Unresolved { frequency } => {
            format!("not to be told from its neighbour at {frequency:.2} Hz")
        }
        AmplitudeVerdict::TooFewPoints => "too few points for a trend".to_owned(),
    }
}

/// From the largest to the smallest amplitude, with its 95 % bound.
fn changes(curve: &AmplitudeCurve) -> String {
    both(curve, |trend| (trend.change, trend.change_bound))
}

/// "frequency +0.32 ± 0.01 Hz, damping ratio −0.14 ± 0.01 %".
fn both(curve: &AmplitudeCurve, of: impl Fn(&Trend) -> (f64, f64)) -> String {
    let mut parts = Vec::new();
    for quantity in quantities(curve) {
        let (change, bound) = of(quantity.trend);
        let (change, bound) = (quantity.factor * change, quantity.factor * bound);
        // As many decimals as the bound's two leading digits have.
        let decimals = (1.0 - bound.abs().max(1e-12).log10().floor()).clamp(0.0, 8.0) as usize;
        let unit_of_last = 10f64.powi(decimals as i32);
        // Adding zero turns -0 into 0.
        let change = (change * unit_of_last).round() / unit_of_last + 0.0;
        let change = format!("{change:+.decimals$}").replace('-', "\u{2212}");
        let bound = significant(bound, 2);
        parts.push(format!(
            "{} {change} \u{b1} {bound} {}",
            quantity.name, quantity.unit
        ));
    }
    parts.join(", ")
}
