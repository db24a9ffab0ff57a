//! Natural frequency and damping against amplitude: a pair of panels for every mode.

use tapjoint_analysis::{RecordingResult, Response};
use tapjoint_signal::modal::amplitude::{AmplitudeCurve, AmplitudeVerdict, Trend};

use super::super::chart::axis::{Axis, extent, padded};
use super::super::chart::{Block, Chart, Color, Mark, Panel, Series};
use super::super::format::significant;
use super::unit_of;

/// Most modes in the picture; the page and the tables have them all.
const MOST: usize = 8;
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
    curves(name, &amplitude_axis(recording, &modes), &modes)
}

/// Returns what the amplitude is: that of one sensor, or of the strongest sensor where the modes differ in it.
fn amplitude_axis(recording: &RecordingResult, modes: &[(usize, &AmplitudeCurve)]) -> [String; 2] {
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
    [label, unit]
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
        let quantities = [Quantity::Frequency, Quantity::Damping].iter();
        let panels = quantities.filter_map(|quantity| quantity.panel(amplitude, curve));
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
#[derive(Clone, Copy, PartialEq)]
enum Quantity {
    Frequency,
    Damping,
}

impl Quantity {
    fn trend(self, curve: &AmplitudeCurve) -> Option<&Trend> {
        match self {
            Quantity::Frequency => curve.frequency.as_ref(),
            Quantity::Damping => curve.damping.as_ref(),
        }
    }

    /// Unit drawn over the trend's unit: damping is drawn in percent.
    fn factor(self) -> f64 {
        match self {
            Quantity::Frequency => 1.0,
            Quantity::Damping => 100.0,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Quantity::Frequency => "frequency",
            Quantity::Damping => "damping ratio",
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Quantity::Frequency => "Hz",
            Quantity::Damping => "%",
        }
    }

    /// Value and standard uncertainty of every point, in the unit drawn.
    fn values(self, curve: &AmplitudeCurve) -> Vec<(f64, f64)> {
        let points = curve.points.iter().map(|point| match self {
            Quantity::Frequency => (point.frequency, point.frequency_std),
            Quantity::Damping => (100.0 * point.damping_ratio, 100.0 * point.damping_std),
        });
        points.collect()
    }

    fn panel(self, amplitude: &[String; 2], curve: &AmplitudeCurve) -> Option<Panel> {
        let trend = self.trend(curve)?;
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
            if let Some((value, half)) = trend.at_amplitude(amplitude) {
                let (value, half) = (self.factor() * value, self.factor() * half);
                line.push(amplitude, value);
                bound.low.push(value - half);
                bound.high.push(value + half);
            }
        }
        bound.x = line.x.clone();
        let mut panel = Panel::new(160.0, x, self.axis(curve)).with([bound, line]);
        panel.extra = Some(["time after the tap", "s"]);
        Some(panel.with(self.dots(curve)))
    }

    /// The points in a colour for each tap, as long as there are few taps.
    fn dots(self, curve: &AmplitudeCurve) -> Vec<Series> {
        let taps = curve.points.iter().map(|point| point.tap + 1);
        let taps = taps.max().unwrap_or(0);
        let values = self.values(curve);
        let groups = if taps <= MOST_COLOURS { taps } else { 1 };
        let mut dots = Vec::new();
        for group in 0..groups {
            let name = match taps {
                1 => "piece of the decay".to_owned(),
                2..=MOST_COLOURS => format!("tap {}", group + 1),
                _ => format!("pieces of the decays of {taps} taps"),
            };
            let mut set = Series::new(&name, Color::curve(group), Mark::Dot(3.3));
            for (point, (value, std)) in curve.points.iter().zip(&values) {
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

    /// Values of the points that are known well enough to tell something, and of those that differ from them
    /// by far more than their own uncertainty, with some room.
    fn axis(self, curve: &AmplitudeCurve) -> Axis {
        let values = self.values(curve);
        let mut stds: Vec<f64> = values.iter().map(|(_, std)| *std).collect();
        stds.sort_by(f64::total_cmp);
        let limit = TELLING * stds.get(stds.len() / 2).copied().unwrap_or(0.0);
        let telling = values.iter().filter(|(_, std)| *std <= limit);
        let bars = telling.flat_map(|(value, std)| [value - BAR * std, value + BAR * std]);
        let (low, high) = extent(bars).unwrap_or((0.0, 1.0));
        let mut ends = vec![low, high];
        for (value, std) in &values {
            if value + DISTANT * std < low || value - DISTANT * std > high {
                ends.extend([value - BAR * std, value + BAR * std]);
            }
        }
        padded(extent(ends).unwrap_or((low, high)), 0.12).of(self.name(), self.unit())
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
    for quantity in [Quantity::Frequency, Quantity::Damping] {
        let Some(trend) = quantity.trend(curve) else {
            continue;
        };
        let (change, bound) = of(trend);
        let (change, bound) = (quantity.factor() * change, quantity.factor() * bound);
        // As many decimals as the bound's two leading digits have.
        let decimals = (1.0 - bound.abs().max(1e-12).log10().floor()).clamp(0.0, 8.0) as usize;
        let unit_of_last = 10f64.powi(decimals as i32);
        // Adding zero turns -0 into 0.
        let change = (change * unit_of_last).round() / unit_of_last + 0.0;
        let change = format!("{change:+.decimals$}").replace('-', "\u{2212}");
        let bound = significant(bound, 2);
        parts.push(format!(
            "{} {change} \u{b1} {bound} {}",
            quantity.name(),
            quantity.unit()
        ));
    }
    parts.join(", ")
}
