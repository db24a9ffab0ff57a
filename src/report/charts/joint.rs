//! The estimated joint: errors of the predicted frequencies, and the estimates under changed frequencies.

use super::super::chart::axis::{Axis, extent, padded};
use super::super::chart::{Block, Chart, Color, Mark, Panel, Series};
use super::super::document::{Document, EstimateSection, PredictionSection};
use super::super::format::{rounded_to, signed, signed_percent, significant};
use super::super::tables::reading_bound;

/// Most modes whose frequencies fit under the picture side by side, and with their words.
const MOST_WITH_NUMBERS: usize = 10;
const MOST_WITH_WORDS: usize = 6;
/// Most modes whose errors fit beside each other.
const MOST_LABELS: usize = 14;
/// The axis reaches at least this far to either side of zero (%): differences of thousandths of a percent mean
/// nothing in practice, and magnified they would mislead.
const LEAST_SPAN: f64 = 0.02;
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
    let names = names.map(|(at, error)| (at as f64, tick_words(error.prediction, count)));
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

/// The number of a mode, and as far as there is room what was measured and predicted.
fn tick_words(prediction: &PredictionSection, modes: usize) -> String {
    let mut words = prediction.mode.to_string();
    if modes > MOST_WITH_NUMBERS {
        return words;
    }
    let rows = [
        ("measured ", prediction.measured),
        ("predicted ", prediction.predicted),
    ];
    for (name, value) in rows {
        let name = if modes <= MOST_WITH_WORDS { name } else { "" };
        let value = value.map_or(String::new(), |value| significant(value, 5));
        words.push_str(&format!("\n{name}{value} Hz"));
    }
    words
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
        series.words.push(frequency_words(error.prediction));
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

/// "mode 1, measured 16.5524 Hz, predicted 16.7220 Hz".
fn frequency_words(prediction: &PredictionSection) -> String {
    let mut words = format!("mode {}", prediction.mode);
    for (name, value) in [
        ("measured", prediction.measured),
        ("predicted", prediction.predicted),
    ] {
        if let Some(value) = value {
            words.push_str(&format!(", {name} {} Hz", significant(value, 6)));
        }
    }
    words
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
}

/// The estimates under changed frequencies, a panel for each method; `None` where there are none.
pub fn cloud(document: &Document) -> Option<Chart> {
    let methods = [
        ("consistent", "Consistent estimate"),
        ("pairs", "Pair regression"),
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
            "every mode at one end of its reading's bound or the other: {} sign patterns",
            span.patterns
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
    fn of(document: &Document, method: &str) -> Cloud {
        let spans = document.resolution_span.iter().flatten();
        let spans = spans.filter(|span| span.method.name() == method);
        let random = document.monte_carlo.iter().flatten();
        let random = random.filter(|found| found.method.name() == method);
        let rows = document.perturbation.iter().flatten();
        let rows = rows.filter(|row| row.percent != 0.0 && row.method.name() == method);
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
            cloud.estimate = estimate_by(estimate, method);
            if estimate.method.name() == method {
                let covariance = cloud.estimate.zip(estimate.log_covariance);
                let region = covariance.map(|((kx, ky), covariance)| ellipse(kx, ky, covariance));
                cloud.ellipse = region.unwrap_or_default();
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
        let patterns = "every mode at an end of its bound";
        let ellipse = "95 % ellipse (covariance)";
        let (x, y) = (
            x.of("Kx = Kt L\u{b3}/(EI)", "1"),
            y.of("Ky = Kr L/(EI)", "1"),
        );
        Panel::new(440.0, x, y).with([
            Series::points("random errors", Color::Data, Mark::Dot(1.7), self.random),
            Series::points(patterns, Color::Sky, Mark::Dot(3.2), self.patterns),
            Series::points(ellipse, Color::Vermilion, Mark::Line(2.0), self.ellipse),
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

/// The estimate by this method.
fn estimate_by(estimate: &EstimateSection, method: &str) -> Option<(f64, f64)> {
    let place = match &estimate.pairs {
        Some(pairs) if method == "pairs" => (pairs.kx?, pairs.ky?),
        _ if estimate.method.name() == method => {
            (estimate.kx.as_ref()?.value, estimate.ky.as_ref()?.value)
        }
        _ => return None,
    };
    is_finite(&place).then_some(place)
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
