//! The picture of all estimates that the resolution of the readings allows: Kx against Ky.

use std::collections::HashSet;

use super::super::document::{Document, EstimateSection};
use super::super::format::signed;
use super::axis::{Axis, extent, padded};
use super::drawing::{Align, Drawing, Point, Stroke, Text};
use super::font::{Weight, text_width};
use super::palette::{BLUE, INK, ORANGE, SKY};
use super::panel::{Panel, Sample, TICK_SIZE, draw_legend, draw_title};
use super::spectrum::{LEFT, RIGHT, WIDTH};

/// Ratio of the largest to the smallest value above which an axis is logarithmic.
const WIDE: f64 = 20.0;

/// Estimates under changed frequencies; `None` where there are none.
pub fn draw_cloud(document: &Document) -> Option<Drawing> {
    let cloud = cloud(document);
    let shifted = shifted(document);
    if cloud.len() + shifted.len() < 2 {
        return None;
    }
    let mut drawing = Drawing::new("Estimates under changed frequencies", WIDTH, 620);
    let title = "Joint stiffness under changed frequencies";
    draw_title(&mut drawing, title, &below(document, cloud.len()));
    let estimate = estimate(document);
    let points: Vec<Point> = cloud
        .iter()
        .chain(shifted.iter().map(|(_, point)| point))
        .chain(&estimate)
        .copied()
        .collect();
    let panel = Panel {
        x: axis(points.iter().map(|point| point.0), (LEFT + 16.0, RIGHT)),
        y: axis(points.iter().map(|point| point.1), (556.0, 98.0)),
    };
    panel.draw_axes(&mut drawing);
    let mut dots = distinct(cloud.iter().map(|(x, y)| panel.place(*x, *y)));
    for at in &dots {
        drawing.dot(*at, 3.2, SKY);
    }
    dots.extend(estimate.map(|(x, y)| panel.place(x, y)));
    draw_shifted(&mut drawing, &panel, &shifted, &dots);
    if let Some((x, y)) = estimate {
        let at = panel.place(x, y);
        drawing.dot(at, 7.0, super::palette::WHITE);
        drawing.dot(at, 5.5, BLUE);
    }
    panel.draw_x_title(&mut drawing, "Kx = Kt L\u{b3}/(EI) (1)");
    panel.draw_y_title(&mut drawing, "Ky = Kr L/(EI) (1)");
    let entries = legend(&cloud, &shifted, estimate);
    draw_legend(&mut drawing, (LEFT, 76.0), RIGHT, &entries);
    Some(drawing)
}

/// Points without those that would be drawn over another one, two pixels apart at least.
fn distinct(points: impl Iterator<Item = Point>) -> Vec<Point> {
    let mut taken = HashSet::new();
    points
        .filter(|(x, y)| taken.insert(((x / 2.0) as i64, (y / 2.0) as i64)))
        .collect()
}

/// Finite points of the cloud.
fn cloud(document: &Document) -> Vec<Point> {
    let span = document.resolution_span.iter();
    span.flat_map(|span| span.cloud.iter())
        .map(|[kx, ky]| (*kx, *ky))
        .filter(|point| point.0.is_finite() && point.1.is_finite())
        .collect()
}

/// Estimates with all frequencies changed alike: percent and point.
fn shifted(document: &Document) -> Vec<(f64, Point)> {
    let rows = document.perturbation.as_deref().unwrap_or_default();
    rows.iter()
        .filter(|row| row.percent != 0.0)
        .filter_map(|row| Some((row.percent, (row.kx?, row.ky?))))
        .filter(|(_, point)| point.0.is_finite() && point.1.is_finite())
        .collect()
}

fn estimate(document: &Document) -> Option<Point> {
    // The cloud is the pair regression's, and so is its middle.
    let estimate: &EstimateSection = document.estimate.as_ref()?.as_ref()?;
    let point = match &estimate.pairs {
        Some(pairs) => (pairs.kx?, pairs.ky?),
        None => (estimate.kx.as_ref()?.value, estimate.ky.as_ref()?.value),
    };
    (point.0.is_finite() && point.1.is_finite()).then_some(point)
}

fn axis(values: impl Iterator<Item = f64>, pixels: (f64, f64)) -> Axis {
    let range = extent(values).unwrap_or((0.0, 1.0));
    if range.0 > 0.0 && range.1 / range.0 > WIDE {
        Axis::logarithmic((range.0 / 1.3, range.1 * 1.3), pixels)
    } else {
        Axis::linear(padded(range, 0.1), pixels)
    }
}

fn below(document: &Document, drawn: usize) -> String {
    let Some(span) = &document.resolution_span else {
        return "all frequencies changed by the same percentage".to_owned();
    };
    let failed = if span.failed > 0 {
        format!(" \u{b7} {} of them leave no estimate", span.failed)
    } else {
        String::new()
    };
    let shown = if drawn > 0 && drawn + span.failed < span.patterns {
        format!(" \u{b7} {drawn} drawn")
    } else {
        String::new()
    };
    format!(
        "every mode at one end of its reading's bound or the other: {} sign patterns{failed}{shown}",
        span.patterns
    )
}

/// Crosses with their percentage, on the side where the words cover nothing; words without such a
/// side are left out, the table has them.
fn draw_shifted(drawing: &mut Drawing, panel: &Panel, shifted: &[(f64, Point)], dots: &[Point]) {
    let crosses: Vec<Point> = shifted
        .iter()
        .map(|(_, (x, y))| panel.place(*x, *y))
        .collect();
    let mut boxes: Vec<Patch> = dots
        .iter()
        .chain(&crosses)
        .map(|at| Patch::around(*at, (7.0, 7.0)))
        .collect();
    // The largest changes first: they say which way the estimate moves.
    let mut order: Vec<usize> = (0..shifted.len()).collect();
    order.sort_by(|a, b| {
        let size = |index: &usize| {
            shifted
                .get(*index)
                .map_or(0.0, |(percent, _)| percent.abs())
        };
        size(b).total_cmp(&size(a))
    });
    for index in order {
        let (Some((percent, _)), Some(at)) = (shifted.get(index), crosses.get(index)) else {
            continue;
        };
        drawing.cross(*at, 6.0, Stroke::new(ORANGE, 2.5));
        let words = format!("{} %", signed(*percent));
        let half = text_width(&words, TICK_SIZE, Weight::Regular) / 2.0;
        let free = SIDES.iter().find_map(|(across, down)| {
            let middle = (at.0 + across * (half + 11.0), at.1 + down * 17.0);
            let place = Patch::around(middle, (half + 1.0, 7.0));
            let inside = place.left > panel.x.from && place.right < panel.x.to;
            let clear = !boxes.iter().any(|taken| taken.overlaps(&place));
            (inside && clear).then_some((middle, place))
        });
        if let Some((middle, place)) = free {
            boxes.push(place);
            let text = Text::new(words, middle, TICK_SIZE).colored(INK);
            drawing.text(text.aligned(Align::Middle));
        }
    }
}

/// Where words may stand beside a cross: shares of their half width across and of a line down.
const SIDES: [Point; 8] = [
    (1.0, 0.0),
    (-1.0, 0.0),
    (0.0, -1.0),
    (0.0, 1.0),
    (0.8, -1.0),
    (-0.8, -1.0),
    (0.8, 1.0),
    (-0.8, 1.0),
];

/// A rectangle that is taken (pixels).
struct Patch {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl Patch {
    fn around(middle: Point, half: Point) -> Patch {
        Patch {
            left: middle.0 - half.0,
            right: middle.0 + half.0,
            top: middle.1 - half.1,
            bottom: middle.1 + half.1,
        }
    }

    fn overlaps(&self, other: &Patch) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }
}

fn legend(
    cloud: &[Point],
    shifted: &[(f64, Point)],
    estimate: Option<Point>,
) -> Vec<(Sample, String)> {
    let mut entries = Vec::new();
    if estimate.is_some() {
        entries.push((Sample::Dot(BLUE), "estimate".to_owned()));
    }
    if !cloud.is_empty() {
        let words = "every mode at an end of its bound".to_owned();
        entries.push((Sample::Dot(SKY), words));
    }
    if !shifted.is_empty() {
        let words = "all frequencies changed alike".to_owned();
        entries.push((Sample::Cross(ORANGE), words));
    }
    entries
}
