//! Natural frequency and damping against amplitude: a pair of panels for every mode.

use tapjoint_signal::modal::amplitude::{AmplitudeCurve, AmplitudeVerdict, Trend};

use super::super::chart::axis::{Axis, extent, padded};
use super::super::chart::{Block, Chart, Color, Mark, Panel, Places, Series};
use super::super::figures::AmplitudeFigure;
use super::super::format::significant;
use super::taps::split_unit;

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

/// Frequency and damping against amplitude; `None` where no mode has a curve.
pub fn amplitude(figure: &AmplitudeFigure) -> Option<Chart> {
    let with_curve = figure
        .modes
        .iter()
        .filter(|(_, curve)| curve.frequency.is_some());
    let mut blocks = Vec::new();
    for (number, curve) in with_curve {
        let panels = [Quantity::Frequency, Quantity::Damping];
        let panels = panels
            .iter()
            .filter_map(|quantity| quantity.panel(figure, curve));
        let block = Block::new(2, panels.collect());
        blocks.push(Block {
            name: format!("mode {number}"),
            aside: verdict(curve),
            drawn: if blocks.len() < MOST { block.drawn } else { 0 },
            ..block
        });
    }
    if blocks.is_empty() {
        return None;
    }
    let shown = if blocks.len() > MOST {
        format!(" \u{b7} the first {MOST} of {} modes", blocks.len())
    } else {
        String::new()
    };
    let file = &figure.file;
    Some(Chart {
        kind: "amplitude",
        title: format!("Frequency and damping against amplitude, {file}"),
        subtitle: format!(
            "every point a piece of a decay, none used twice \u{b7} bars and band 95 %{shown}"
        ),
        caption: format!("Frequency and damping of the modes of {file} against amplitude."),
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

    fn panel(self, figure: &AmplitudeFigure, curve: &AmplitudeCurve) -> Option<Panel> {
        let trend = self.trend(curve)?;
        let sizes = curve.points.iter().map(|point| point.amplitude);
        let (low, high) = extent(sizes).unwrap_or((1.0, 10.0));
        let (label, unit) = split_unit(&figure.amplitude);
        // Amplitudes rise to the right as on every axis: a decay runs from right to left.
        let x = Axis::logarithmic(low / 1.12, high * 1.12).of(label, unit);
        let mut bound = Series::band(
            "95 % bound",
            Color::Blue,
            Places::Each(Vec::new()),
            Vec::new(),
            Vec::new(),
        );
        let (mut places, mut values) = (Vec::new(), Vec::new());
        for index in 0..CURVE_POINTS {
            let share = index as f64 / (CURVE_POINTS - 1) as f64;
            let amplitude = low * (share * (high / low).ln()).exp();
            if let Some((value, half)) = trend.at_amplitude(amplitude) {
                let (value, half) = (self.factor() * value, self.factor() * half);
                places.push(amplitude);
                values.push(value);
                bound.low.push(value - half);
                bound.high.push(value + half);
            }
        }
        bound.x = Places::Each(places.clone());
        let line = places.into_iter().zip(values);
        let line = Series::points("curve through them", Color::Ink, Mark::Line(1.5), line);
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
            let mut set = Series::points(&name, Color::curve(group), Mark::Dot(3.3), []);
            let mut places = Vec::new();
            for (point, (value, std)) in curve.points.iter().zip(&values) {
                if groups == 1 || point.tap == group {
                    places.push(point.amplitude);
                    set.y.push(*value);
                    set.low.push(value - BAR * std);
                    set.high.push(value + BAR * std);
                    set.extra.push(point.time);
                }
            }
            set.x = Places::Each(places);
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
        let (low, high) = extent(telling.flat_map(bar)).unwrap_or((0.0, 1.0));
        let distant = values
            .iter()
            .filter(|(value, std)| value + DISTANT * std < low || value - DISTANT * std > high);
        let ends = extent(distant.flat_map(bar).chain([low, high]));
        padded(ends.unwrap_or((low, high)), 0.12).of(self.name(), self.unit())
    }
}

fn bar((value, std): &(f64, f64)) -> [f64; 2] {
    [value - BAR * std, value + BAR * std]
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
        AmplitudeVerdict::Changes => format!("at half the amplitude: {}", slopes(curve)),
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

/// By the slopes of the straight lines, for a halved amplitude, with 95 % bounds (normal distribution: a line
/// leaves many degrees of freedom).
fn slopes(curve: &AmplitudeCurve) -> String {
    let half = 0.5f64.ln();
    both(curve, |trend| {
        (half * trend.slope, 1.96 * half.abs() * trend.slope_std)
    })
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
