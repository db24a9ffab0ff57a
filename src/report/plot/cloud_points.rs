//! What the picture of changed frequencies shows: each method's estimates, one by one.

use super::super::document::{Document, EstimateSection};
use super::axis::{Axis, extent, padded};
use super::drawing::Point;

/// Ratio of the largest to the smallest value above which an axis is logarithmic.
const WIDE: f64 = 20.0;
/// chi-squared with two degrees of freedom is below this with 95 % probability.
const ELLIPSE_95: f64 = 5.991_465;
/// Corners of the polygon that is drawn for an ellipse.
const CORNERS: usize = 120;

/// The estimates of one method, as pairs of Kx and Ky.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Cloud {
    /// "pairs" or "consistent".
    pub(crate) method: String,
    /// At all ends of the bounds.
    pub(crate) patterns: Vec<Point>,
    /// Under random errors.
    pub(crate) random: Vec<Point>,
    /// With all frequencies changed alike: percent and place.
    pub(crate) shifted: Vec<(f64, Point)>,
    /// The estimate itself.
    pub(crate) estimate: Option<Point>,
    /// The 95 % region by the covariance; empty where there is none.
    pub(crate) ellipse: Vec<Point>,
}

/// The clouds of all methods, the consistent estimate's first; one without two points is none.
pub(crate) fn clouds(document: &Document) -> Vec<Cloud> {
    let methods = ["consistent", "pairs"].into_iter();
    methods
        .map(|method| cloud(document, method))
        .filter(|cloud| cloud.patterns.len() + cloud.shifted.len() + cloud.random.len() > 1)
        .collect()
}

fn cloud(document: &Document, method: &str) -> Cloud {
    let spans = document.resolution_span.iter().flatten();
    let spans = spans.filter(|span| span.method.name() == method);
    let random = document.monte_carlo.iter().flatten();
    let random = random.filter(|found| found.method.name() == method);
    let rows = document.perturbation.iter().flatten();
    let rows = rows.filter(|row| row.percent != 0.0 && row.method.name() == method);
    let estimate = document.estimate.as_ref().and_then(Option::as_ref);
    let shifted = rows.filter_map(|row| Some((row.percent, (row.kx?, row.ky?))));
    Cloud {
        method: method.to_owned(),
        patterns: finite(spans.flat_map(|span| &span.cloud)),
        random: finite(random.flat_map(|found| &found.cloud)),
        shifted: shifted.filter(|(_, point)| is_finite(point)).collect(),
        estimate: estimate.and_then(|found| estimate_of(found, method)),
        ellipse: estimate.map_or(Vec::new(), |found| ellipse(found, method)),
    }
}

fn is_finite(point: &Point) -> bool {
    point.0.is_finite() && point.1.is_finite()
}

fn finite<'a>(points: impl Iterator<Item = &'a [f64; 2]>) -> Vec<Point> {
    let points = points.map(|[kx, ky]| (*kx, *ky));
    points.filter(is_finite).collect()
}

/// The estimate by this method.
fn estimate_of(estimate: &EstimateSection, method: &str) -> Option<Point> {
    let own = || Some((estimate.kx.as_ref()?.value, estimate.ky.as_ref()?.value));
    let point = match &estimate.pairs {
        Some(pairs) if method == "pairs" => (pairs.kx?, pairs.ky?),
        _ if estimate.method.name() == method => own()?,
        _ => return None,
    };
    is_finite(&point).then_some(point)
}

/// All places (ln Kx, ln Ky) with d^T C^-1 d = 5.99 about the estimate: with L L^T = C they are
/// L (cos t, sin t) times the root of that.
fn ellipse(estimate: &EstimateSection, method: &str) -> Vec<Point> {
    let own = estimate.method.name() == method;
    let middle = estimate_of(estimate, method).filter(|(x, y)| own && *x > 0.0 && *y > 0.0);
    let Some(((x, y), [[xx, xy], [_, yy]])) = middle.zip(estimate.log_covariance) else {
        return Vec::new();
    };
    let first = xx.sqrt();
    let (cross, rest) = (xy / first, (yy - xy * xy / xx).max(0.0).sqrt());
    let size = ELLIPSE_95.sqrt();
    let corner = |index: usize| {
        let angle = std::f64::consts::TAU * index as f64 / CORNERS as f64;
        let (sin, cos) = (size * angle.sin(), size * angle.cos());
        (
            x * (first * cos).exp(),
            y * (cross * cos + rest * sin).exp(),
        )
    };
    let corners: Vec<Point> = (0..=CORNERS).map(corner).collect();
    if corners.iter().all(is_finite) {
        corners
    } else {
        Vec::new()
    }
}

impl Cloud {
    /// Axes on which all of it can be seen but the outermost of the random ones.
    pub(crate) fn axes(&self, across: (f64, f64), upwards: (f64, f64)) -> (Axis, Axis) {
        let each = |pick: fn(&Point) -> f64| {
            let shifted = self.shifted.iter().map(|(_, point)| point);
            let shown = self.patterns.iter().chain(shifted).chain(&self.estimate);
            let shown = shown.chain(&self.ellipse).map(pick);
            shown.chain(inner(self.random.iter().map(pick))).collect()
        };
        let (x, y): (Vec<f64>, Vec<f64>) = (each(|point| point.0), each(|point| point.1));
        (axis(x, across), axis(y, upwards))
    }
}

/// The smallest and the largest value but for one in a hundred at either end.
fn inner(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let cut = sorted.len() / 100;
    let ends = [
        sorted.get(cut),
        sorted.get(sorted.len().wrapping_sub(cut + 1)),
    ];
    ends.into_iter().flatten().copied().collect()
}

fn axis(values: Vec<f64>, pixels: (f64, f64)) -> Axis {
    let range = extent(values).unwrap_or((0.0, 1.0));
    if range.0 > 0.0 && range.1 / range.0 > WIDE {
        Axis::logarithmic((range.0 / 1.3, range.1 * 1.3), pixels)
    } else {
        Axis::linear(padded(range, 0.1), pixels)
    }
}
