//! The estimated joint.
//!
//! Charts of the errors of predicted frequencies, of estimates under changed frequencies, and of mode shapes with the
//! places of sensors and taps.

use std::collections::BTreeMap;

use crate::document::{Document, EstimateMethod, PredictionSection, Uncertain};
use crate::format::{rounded_to, signed, signed_percent, significant};
use crate::picture::{Axis, Block, Chart, Color, Mark, Panel, Series, extent, padded};
use crate::tables::{patterns_in_words, reading_bound};
use tapjoint_analysis::{MeasuredShape, SampledShape, ShapeAgreement, ShapeBy};
use tapjoint_beam::Assembly;

/// Most modes whose frequencies fit under the picture side by side, and with their words.
const MOST_WITH_NUMBERS: usize = 10;
const MOST_WITH_WORDS: usize = 6;
/// Most modes whose errors fit beside each other.
const MOST_LABELS: usize = 14;
/// The axis reaches at least this far to either side of zero (%): differences of thousandths of a percent mean
/// nothing in practice, and magnified they would mislead.
const LEAST_SPAN: f64 = 0.02;
/// Share of an axis within which points count as one place.
const CROWDED: f64 = 0.05;
/// Ratio of the largest to the smallest stiffness above which an axis is logarithmic.
const WIDE: f64 = 20.0;
/// chi-squared with two degrees of freedom is below this with 95 % probability.
const ELLIPSE_95: f64 = 5.991_465;
/// Corners of the polygon that is drawn for an ellipse.
const CORNERS: usize = 120;

/// One mode's error and the bound of its reading (%).
struct FrequencyError<'a> {
    prediction: &'a PredictionSection,
    percent: f64,
    bound: Option<f64>,
}

/// Errors of the predicted frequencies; `None` where nothing was predicted for a measured mode.
pub fn frequencies(document: &Document) -> Option<Chart> {
    let mut errors = Vec::new();
    for prediction in document.prediction.as_deref().unwrap_or_default() {
        let Some(percent) = prediction.error_percent.filter(|error| error.is_finite()) else {
            continue;
        };
        let measured = prediction
            .measured
            .zip(reading_bound(document, prediction.mode));
        errors.push(FrequencyError {
            prediction,
            percent,
            bound: measured.map(|(measured, bound)| 100.0 * bound / measured),
        });
    }
    let count = errors.len();
    let names = errors.iter().enumerate();
    let names = names.map(|(at, error)| {
        // The number of a mode, and as far as there is room what was measured and predicted.
        let mut words = error.prediction.mode.to_string();
        let rows = [
            ("measured ", error.prediction.measured),
            ("predicted ", error.prediction.predicted),
        ];
        for (name, value) in rows.iter().filter(|_| count <= MOST_WITH_NUMBERS) {
            let name = if count <= MOST_WITH_WORDS { name } else { "" };
            let value = value.map_or(String::new(), |value| significant(value, 5));
            words.push_str(&format!("\n{name}{value} Hz"));
        }
        (at as f64, words)
    });
    let x = Axis::linear(-0.5, count as f64 - 0.5)
        .of("mode", "")
        .named(names);
    let ends = errors.iter().flat_map(|error| {
        let bound = error.bound.unwrap_or(0.0);
        [error.percent - bound, error.percent + bound]
    });
    let (low, high) = extent(ends)?;
    let y = padded((low.min(-LEAST_SPAN), high.max(LEAST_SPAN)), 0.14).of("error", "%");
    let mut series = Vec::new();
    for used in [true, false] {
        // Bars are drawn where all points of a series have one.
        for bounded in [true, false] {
            series.push(error_series(&errors, used, bounded));
        }
    }
    Some(Chart {
        kind: "frequencies",
        title: "Predicted against measured frequencies".to_owned(),
        subtitle: "error = 100 (predicted \u{2212} measured) / measured; bar: bound of the reading"
            .to_owned(),
        caption: "Errors of the predicted frequencies. A bar that passes zero means that the \
                  reading alone explains the error."
            .to_owned(),
        blocks: vec![Block::new(
            1,
            vec![Panel::new(300.0, x, y).with_zero().with(series)],
        )],
        ..Chart::default()
    })
}

fn error_series(errors: &[FrequencyError<'_>], used: bool, bounded: bool) -> Series {
    let (name, color, mark) = if used {
        ("mode used in the estimate", Color::Blue, Mark::Dot(5.0))
    } else {
        (
            "mode not used: a true prediction",
            Color::Vermilion,
            Mark::Ring(5.0),
        )
    };
    let mut series = Series::new(name, color, mark);
    for (at, error) in errors.iter().enumerate() {
        if error.prediction.used != used || error.bound.is_some() != bounded {
            continue;
        }
        series.push(at as f64, error.percent);
        if let Some(bound) = error.bound {
            series.low.push(error.percent - bound);
            series.high.push(error.percent + bound);
        }
        // "mode 1, measured 16.5524 Hz, predicted 16.7220 Hz".
        let mut words = format!("mode {}", error.prediction.mode);
        for (name, value) in [
            ("measured", error.prediction.measured),
            ("predicted", error.prediction.predicted),
        ] {
            if let Some(value) = value {
                words.push_str(&format!(", {name} {} Hz", significant(value, 6)));
            }
        }
        series.words.push(words);
        // Thousandths of a percent.
        let said = rounded_to(error.percent, error.bound, -3).joined();
        series.said.push(said + " %");
        if errors.len() <= MOST_LABELS {
            let label = format!("{} %", signed_percent(Some(error.percent)));
            series.labels.push(label);
        }
    }
    series
}

/// The estimates of one method, as pairs of Kx and Ky.
#[derive(Default)]
struct Cloud {
    /// At all ends of the bounds.
    patterns: Vec<(f64, f64)>,
    /// Under random errors.
    random: Vec<(f64, f64)>,
    /// With all frequencies changed alike: percent and place.
    shifted: Vec<(f64, (f64, f64))>,
    /// The estimate itself.
    estimate: Option<(f64, f64)>,
    /// The 95 % region by the covariance; empty where there is none.
    ellipse: Vec<(f64, f64)>,
    /// Stated 95 % limits of Kx and of Ky, as lines through the estimate; empty where there are none.
    limits: Vec<[(f64, f64); 2]>,
    /// True if the ellipse holds the scatter of the joint between recordings, which the random errors do not.
    of_set_ups: bool,
}

/// The estimates under changed frequencies, a panel for each method; `None` where there are none.
pub fn cloud(document: &Document) -> Option<Chart> {
    let methods = [
        (EstimateMethod::Consistent, "Consistent estimate"),
        (EstimateMethod::Pairs, "Pair regression"),
    ];
    let mut panels = Vec::new();
    let mut drawn = 0;
    for (method, title) in methods {
        let cloud = Cloud::of(document, method);
        if cloud.patterns.len() + cloud.shifted.len() + cloud.random.len() > 1 {
            drawn = drawn.max(cloud.random.len());
            panels.push(cloud.panel().titled(title));
        }
    }
    match panels.as_mut_slice() {
        [] => return None,
        [only] => only.title.clear(),
        _ => {}
    }
    Some(Chart {
        kind: "cloud",
        title: "Joint stiffness under changed frequencies".to_owned(),
        subtitle: trials(document, drawn),
        caption: "Estimates when the frequencies are changed within what their readings allow."
            .to_owned(),
        blocks: vec![Block::new(panels.len(), panels)],
        ..Chart::default()
    })
}

/// "every mode at one end of its reading's bound or the other: 16 sign patterns".
fn trials(document: &Document, drawn: usize) -> String {
    let mut parts = Vec::new();
    let spans = document.resolution_span.as_deref().unwrap_or_default();
    if let Some(span) = spans.first() {
        parts.push(format!(
            "every mode at one end of its reading's bound or the other: {}",
            patterns_in_words(span).trim_end_matches(',')
        ));
    }
    let failed: usize = spans.iter().map(|span| span.failed).sum();
    if failed > 0 {
        parts.push(format!("{failed} of them leave no estimate"));
    }
    if drawn > 0 {
        parts.push(format!("{drawn} random draws shown"));
    }
    if parts.is_empty() {
        return "all frequencies changed by the same percentage".to_owned();
    }
    parts.join(" \u{b7} ")
}

impl Cloud {
    fn of(document: &Document, method: EstimateMethod) -> Cloud {
        let spans = document.resolution_span.iter().flatten();
        let spans = spans.filter(|span| span.method == method);
        let random = document.monte_carlo.iter().flatten();
        let random = random.filter(|found| found.method == method);
        let rows = document.perturbation.iter().flatten();
        let rows = rows.filter(|row| row.percent != 0.0 && row.method == method);
        let shifted = rows.filter_map(|row| Some((row.percent, (row.kx?, row.ky?))));
        let mut cloud = Cloud {
            patterns: finite(spans.flat_map(|span| &span.cloud)),
            random: finite(random.flat_map(|found| &found.cloud)),
            shifted: shifted.filter(|(_, place)| is_finite(place)).collect(),
            ..Cloud::default()
        };
        // The largest changes first: they show which way the estimate moves.
        cloud
            .shifted
            .sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
        if let Some(estimate) = document.estimate.as_ref().and_then(Option::as_ref) {
            let place = match &estimate.pairs {
                Some(pairs) if method == EstimateMethod::Pairs => pairs.kx.zip(pairs.ky),
                _ if estimate.method == method => estimate
                    .kx
                    .as_ref()
                    .zip(estimate.ky.as_ref())
                    .map(|(kx, ky)| (kx.uncertain.value, ky.uncertain.value)),
                _ => None,
            };
            cloud.estimate = place.filter(is_finite);
            if estimate.method == method {
                let covariance = cloud.estimate.zip(estimate.log_covariance);
                let region = covariance.map(|((kx, ky), covariance)| ellipse(kx, ky, covariance));
                cloud.ellipse = region.unwrap_or_default();
                cloud.of_set_ups = estimate.set_ups.is_some();
                if let (Some((x, y)), Some(kx), Some(ky)) =
                    (cloud.estimate, &estimate.kx, &estimate.ky)
                {
                    let ends = |one: &Uncertain| Some([one.low?, one.high?]);
                    let across = ends(&kx.uncertain).map(|ends| ends.map(|end| (end, y)));
                    let upright = ends(&ky.uncertain).map(|ends| ends.map(|end| (x, end)));
                    cloud.limits.extend([across, upright].into_iter().flatten());
                }
            }
        }
        cloud
    }

    fn panel(self) -> Panel {
        let shifted = self.shifted.iter().map(|(_, place)| place);
        let shown = self
            .patterns
            .iter()
            .chain(&self.estimate)
            .chain(&self.ellipse)
            .chain(self.limits.iter().flatten())
            .chain(shifted);
        let shown: Vec<(f64, f64)> = shown.copied().collect();
        let random_x = inner(self.random.iter().map(|place| place.0));
        let random_y = inner(self.random.iter().map(|place| place.1));
        let x = stiffness_axis(shown.iter().map(|place| place.0).chain(random_x));
        let y = stiffness_axis(shown.iter().map(|place| place.1).chain(random_y));
        let mut alike = Series::new(
            "all frequencies changed alike",
            Color::Orange,
            Mark::Cross(6.0),
        );
        for (percent, (kx, ky)) in &self.shifted {
            alike.push(*kx, *ky);
            let words = format!("{} %", signed(*percent));
            alike.words.push(words.clone());
            alike.labels.push(words);
        }
        // Words about points that lie on the estimate would hide it.
        let crowd = |values: Vec<f64>, axis: &Axis| {
            let (low, high) = extent(values).unwrap_or((0.0, 0.0));
            high - low < CROWDED * (axis.high - axis.low)
        };
        let [across, upright] = [|place: &(f64, f64)| place.0, |place: &(f64, f64)| place.1]
            .map(|of| self.shifted.iter().map(|(_, place)| of(place)).collect());
        if crowd(across, &x) && crowd(upright, &y) {
            alike.labels.clear();
        }
        let patterns = "every mode at an end of its bound";
        let ellipse = match self.of_set_ups {
            true => "95 % ellipse (covariance, with the scatter of the joint)",
            false => "95 % ellipse (covariance)",
        };
        let (x, y) = (
            x.of("Kx = Kt L\u{b3}/(EI)", "1"),
            y.of("Ky = Kr L/(EI)", "1"),
        );
        let limits = self.limits.into_iter();
        let limits = limits
            .map(|ends| Series::points("stated 95 % limits", Color::Blue, Mark::Line(2.0), ends));
        let panel = Panel::new(440.0, x, y).with([
            Series::points("random errors", Color::Data, Mark::Dot(1.7), self.random),
            Series::points(patterns, Color::Sky, Mark::Dot(3.2), self.patterns),
            Series::points(ellipse, Color::Vermilion, Mark::Line(2.0), self.ellipse),
        ]);
        let panel = panel.with(limits);
        panel.with([
            alike,
            Series::points("estimate", Color::Blue, Mark::Dot(5.5), self.estimate),
        ])
    }
}

fn is_finite(place: &(f64, f64)) -> bool {
    place.0.is_finite() && place.1.is_finite()
}

fn finite<'a>(places: impl Iterator<Item = &'a [f64; 2]>) -> Vec<(f64, f64)> {
    let places = places.map(|[kx, ky]| (*kx, *ky));
    places.filter(is_finite).collect()
}

/// All places (ln Kx, ln Ky) with d^T C^-1 d = 5.99 about the estimate: with L L^T = C they are
/// L (cos t, sin t) times the root of that. Empty where they do not exist.
fn ellipse(kx: f64, ky: f64, covariance: [[f64; 2]; 2]) -> Vec<(f64, f64)> {
    let [[xx, xy], [_, yy]] = covariance;
    let first = xx.sqrt();
    let (cross, rest) = (xy / first, (yy - xy * xy / xx).max(0.0).sqrt());
    let mut corners = Vec::new();
    for index in 0..=CORNERS {
        let angle = std::f64::consts::TAU * index as f64 / CORNERS as f64;
        let (sin, cos) = (
            ELLIPSE_95.sqrt() * angle.sin(),
            ELLIPSE_95.sqrt() * angle.cos(),
        );
        let corner = (
            kx * (first * cos).exp(),
            ky * (cross * cos + rest * sin).exp(),
        );
        if !(kx > 0.0 && ky > 0.0 && is_finite(&corner)) {
            return Vec::new();
        }
        corners.push(corner);
    }
    corners
}

/// The smallest and the largest value but for one in a hundred at either end.
fn inner(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let cut = sorted.len() / 100;
    let last = sorted.len().wrapping_sub(cut + 1);
    let ends = [sorted.get(cut), sorted.get(last)];
    ends.into_iter().flatten().copied().collect()
}

fn stiffness_axis(values: impl Iterator<Item = f64>) -> Axis {
    let (low, high) = extent(values).unwrap_or((0.0, 1.0));
    if low > 0.0 && high / low > WIDE {
        Axis::logarithmic(low / 1.3, high * 1.3)
    } else {
        padded((low, high), 0.1)
    }
}

/// Shapes in a row.
const ACROSS: usize = 3;
/// Height of a row of a matrix (pixels).
const CELL: f64 = 44.0;
/// Most shapes drawn: a dozen fits a page.
const MOST_SHAPES: usize = 12;

/// Shapes of the predicted modes; `None` without any.
pub fn shapes(document: &Document) -> Option<Chart> {
    let shapes = document.mode_shapes.as_deref().unwrap_or_default();
    let (mut sensors, mut taps) = (BTreeMap::<&str, Vec<f64>>::new(), Vec::new());
    for recording in document.recordings.iter().flatten() {
        for (name, place) in &recording.conditions.sensor_positions {
            let places = sensors.entry(name).or_default();
            if !places.contains(place) {
                places.push(*place);
            }
        }
        taps.extend(recording.conditions.tap.filter(|tap| !taps.contains(tap)));
    }
    let kind = document.kind();
    let mut panels = Vec::new();
    for shape in shapes.iter().take(MOST_SHAPES) {
        let measured = document.measured_shapes.iter().flatten();
        let measured = measured.filter(|one| one.mode == shape.mode).collect();
        panels.push(shape_panel(shape, measured, &sensors, &taps, kind));
    }
    let caption = match document.measured_shapes {
        Some(_) => {
            "Shapes of the predicted modes, of the described beam on the estimated joint with what sits on it. Points: \
             measured at sensors, or at taps by reciprocity, and scaled to fit each curve best. Bars: 95 % by noise and the \
             scatter of the taps. Two points cannot tell which of them is wrong. With three or more, a sensor whose points \
             lie off in all modes has another scale, sign or place than described."
        }
        None => {
            "Shapes of the predicted modes, of the described beam on the estimated joint with what sits on it. They are not \
             measured: that takes two sensors, or taps at two places."
        }
    };
    (!panels.is_empty()).then(|| Chart {
        kind: "mode-shapes",
        title: "Mode shapes".to_owned(),
        subtitle: "displacement over the position along the beam, each relative to its largest"
            .to_owned(),
        caption: caption.to_owned(),
        blocks: vec![Block::new(ACROSS, panels)],
        ..Chart::default()
    })
}

/// Agreement of measured and predicted shapes as a matrix; `None` where no set-up has enough places.
pub fn agreement(document: &Document) -> Option<Chart> {
    let ShapeAgreement {
        recordings,
        by,
        places,
        measured,
        predicted,
        values,
    } = document.shape_agreement.as_ref()?;
    let number = |modes: &[usize], sign: f64| {
        let modes = modes.iter().enumerate();
        modes
            .map(|(at, mode)| (sign * at as f64, mode.to_string()))
            .collect::<Vec<_>>()
    };
    let x = Axis::linear(-0.5, predicted.len() as f64 - 0.5)
        .of("predicted mode", "")
        .named(number(predicted, 1.0));
    let y = Axis::linear(0.5 - measured.len() as f64, 0.5)
        .of("measured mode", "")
        .named(number(measured, -1.0));
    let mut cells = Series::new("", Color::Blue, Mark::Cell);
    for (row, values) in values.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            cells.push(column as f64, -(row as f64));
            cells.low.push(*value);
            cells.labels.push(format!("{value:.2}"));
        }
    }
    let panel = Panel::new(CELL * measured.len() as f64, x, y).with([cells]);
    let what = match by {
        ShapeBy::Sensors => format!("{places} sensors of {}", recordings.join(", ")),
        ShapeBy::Taps => format!("taps at {places} places"),
    };
    Some(Chart {
        kind: "shape-agreement",
        title: "Modal assurance criterion".to_owned(),
        subtitle: format!("measured against predicted shapes \u{b7} {what}"),
        caption: format!(
            "Modal assurance criterion (MAC) of measured and predicted shapes, {what}: 1 for shapes that are alike, 0 for \
             shapes that share nothing. With few places different shapes may look alike."
        ),
        blocks: vec![Block::new(1, vec![panel])],
        ..Chart::default()
    })
}

/// A panel of one mode: its predicted curve, what was measured of it, and the places of sensors and taps on the axis.
fn shape_panel(
    shape: &SampledShape,
    measured: Vec<&MeasuredShape>,
    sensors: &BTreeMap<&str, Vec<f64>>,
    taps: &[f64],
    kind: Option<Assembly>,
) -> Panel {
    let end = 1e3 * shape.positions.last().copied().unwrap_or(1.0);
    let x = Axis::linear(0.0, end).of("position", "mm");
    let points = measured.iter().flat_map(|one| &one.points);
    let points = points.map(|point| point.displacement);
    let (low, high) = extent(points.chain([-1.0, 1.0])).unwrap_or((-1.0, 1.0));
    let y = Axis::linear(low - 0.2, high + 0.2).of("displacement", "");
    let points = shape.positions.iter().zip(&shape.displacements);
    let points: Vec<(f64, f64)> = points.map(|(at, y)| (1e3 * at, *y)).collect();
    let mut series = Vec::new();
    // A lap joint's halves end at one place and need not meet.
    for half in points.chunk_by(|before, after| before.0 < after.0) {
        let half = half.iter().copied();
        let mut curve = Series::points("mode shape", Color::Blue, Mark::Curve(2.5), half);
        let said = curve.y.iter().map(|value| significant(*value, 2));
        curve.said = said.map(|value| value + " of its largest").collect();
        series.push(curve);
    }
    let lap = points.windows(2).find(|pair| pair[0].0 == pair[1].0);
    let joint = match lap {
        Some(pair) => Some(pair[0].0),
        None => (kind == Some(Assembly::Cantilever)).then_some(0.0),
    };
    let joint = joint.map(|at| (at, 0.0));
    series.push(Series::points(
        "joint",
        Color::Soft,
        Mark::Square(5.0),
        joint,
    ));
    // Both stand on the axis, and say how much of the mode their places see.
    let predicted = |place: f64| format!("{} predicted", significant(shape.at(place), 2));
    let mut tapped = Series::new("tap", Color::Vermilion, Mark::Cross(5.0));
    for place in taps {
        tapped.push(1e3 * place, 0.0);
        tapped.words.push(format!("mode {}", shape.mode));
        tapped.said.push(predicted(*place));
    }
    series.push(tapped);
    for (name, places) in sensors {
        let mut sensed = Series::new("sensor", Color::Orange, Mark::Ring(4.0));
        for place in places {
            sensed.push(1e3 * place, 0.0);
            sensed.words.push(format!("{name}: mode {}", shape.mode));
            sensed.said.push(predicted(*place));
            sensed.labels.push((*name).to_owned());
        }
        series.push(sensed);
    }
    for one in measured {
        series.extend(measured_points(one));
    }
    let title = format!(
        "mode {}, {} Hz",
        shape.mode,
        significant(shape.frequency, 4)
    );
    let panel = Panel::new(128.0, x, y).titled(title);
    panel.with_zero().with(series)
}

/// The points of a measured shape, those with bars apart: a series has bars of all its points or of none.
fn measured_points(shape: &MeasuredShape) -> [Series; 2] {
    let mut sets = [(); 2].map(|()| Series::new("measured", Color::Ink, Mark::Dot(3.6)));
    for point in &shape.points {
        let set = &mut sets[usize::from(point.low.is_some())];
        set.push(1e3 * point.position, point.displacement);
        set.low.extend(point.low);
        set.high.extend(point.high);
        let seen = match shape.by {
            ShapeBy::Sensors => format!("sensor {}", point.sensor),
            ShapeBy::Taps => format!("tap, seen by {}", point.sensor),
        };
        set.words.push(seen);
        let half = point
            .low
            .zip(point.high)
            .map(|(low, high)| 0.5 * (high - low));
        set.said.push(match half {
            Some(_) => rounded_to(point.displacement, half, -3).joined(),
            None => format!(
                "{}, the place that the others are relative to",
                significant(point.displacement, 3)
            ),
        });
    }
    sets
}
