//! Frequency and damping against amplitude for the page's script: a view of two panels for every mode.

use super::live_points::{HEIGHT, LivePoints, LiveView, PointAxis, PointPanel, PointSet, rounded};
use super::plot::amplitude::MOST_COLOURS;
use super::plot::amplitude::{
    AmplitudeFigure, BAR, DAMPING, FREQUENCY, Quantity, amplitude_axis, quantity_axis, taps,
};
use tapjoint_signal::modal::amplitude::{AmplitudeCurve, AmplitudePoint, Trend};

/// Places at which the curve and its bound are computed.
const CURVE_POINTS: usize = 80;

/// All modes that have a curve; `None` without any.
pub fn live_amplitude(figure: &AmplitudeFigure) -> Option<LivePoints> {
    let views: Vec<LiveView> = figure
        .modes
        .iter()
        .filter(|(_, curve)| curve.frequency.is_some())
        .map(|(number, curve)| LiveView {
            name: format!("mode {number}"),
            panels: [&FREQUENCY, &DAMPING]
                .into_iter()
                .filter_map(|quantity| panel(figure, curve, quantity))
                .collect(),
        })
        .collect();
    (!views.is_empty()).then_some(LivePoints {
        kind: "points",
        views,
    })
}

fn panel(
    figure: &AmplitudeFigure,
    curve: &AmplitudeCurve,
    quantity: &Quantity,
) -> Option<PointPanel> {
    let trend = (quantity.trend)(curve)?;
    let x = amplitude_axis(curve, (0.0, 1.0));
    let y = quantity_axis(curve, quantity, (0.0, 1.0));
    let mut sets = band(curve, (trend, quantity.factor));
    let count = taps(curve);
    if count <= MOST_COLOURS {
        sets.extend((0..count).map(|tap| {
            let of_tap = curve.points.iter().filter(|point| point.tap == tap);
            let name = format!("tap {}", tap + 1);
            dots(&name, &format!("c{tap}"), quantity, of_tap)
        }));
    } else {
        let name = format!("pieces of the decays of {count} taps");
        sets.push(dots(&name, "c0", quantity, curve.points.iter()));
    }
    let (label, unit) = quantity.words;
    let (amplitude, amplitude_unit) = figure
        .amplitude
        .strip_suffix(')')
        .and_then(|words| words.split_once(" ("))
        .unwrap_or((&figure.amplitude, ""));
    Some(PointPanel {
        title: String::new(),
        height: HEIGHT,
        x: PointAxis::of(&x, amplitude, amplitude_unit),
        y: PointAxis::of(&y, label, unit),
        extra: Some(["time after the tap", "s"]),
        sets: sets.into_iter().filter(|set| !set.x.is_empty()).collect(),
        rules: Vec::new(),
    })
}

/// The 95 % bound of the curve, and the curve.
fn band(curve: &AmplitudeCurve, (trend, factor): (&Trend, f64)) -> Vec<PointSet> {
    let sizes = curve.points.iter().map(|point| point.amplitude);
    let low = sizes.clone().fold(f64::INFINITY, f64::min);
    let high = sizes.fold(0.0, f64::max);
    let found: Vec<(f64, f64, f64)> = (0..CURVE_POINTS)
        .filter_map(|index| {
            let share = index as f64 / (CURVE_POINTS - 1) as f64;
            let amplitude = low * (share * (high / low).ln()).exp();
            let (value, bound) = trend.at_amplitude(amplitude)?;
            Some((amplitude, factor * value, factor * bound))
        })
        .collect();
    let line = found.iter().map(|(at, value, _)| (*at, *value));
    let mut bound = PointSet::new("95 % bound", "c0", ("band", 0.0), line.clone());
    bound.low = found.iter().map(|(_, v, b)| rounded(v - b)).collect();
    bound.high = found.iter().map(|(_, v, b)| rounded(v + b)).collect();
    bound.y = Vec::new();
    vec![bound, PointSet::new("curve", "ink", ("line", 1.5), line)]
}

fn dots<'a>(
    name: &str,
    color: &str,
    quantity: &Quantity,
    points: impl Iterator<Item = &'a AmplitudePoint> + Clone,
) -> PointSet {
    let value = |point: &AmplitudePoint| (quantity.value)(point);
    let places = points
        .clone()
        .map(|point| (point.amplitude, value(point).0));
    let mut set = PointSet::new(name, color, ("dot", 3.2), places);
    let end = |point: &AmplitudePoint, sign: f64| {
        let (value, std) = value(point);
        rounded(value + sign * BAR * std)
    };
    set.low = points.clone().map(|point| end(point, -1.0)).collect();
    set.high = points.clone().map(|point| end(point, 1.0)).collect();
    set.extra = points.map(|point| rounded(point.time)).collect();
    set
}
