//! The picture of all estimates that the resolution of the readings allows: Kx against Ky.

use std::collections::HashSet;

use super::super::document::{Document, EstimateSection};
use super::super::format::signed;
use super::axis::{Axis, extent, padded};
use super::drawing::{Align, Drawing, Point, Stroke, Text};
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
    for at in distinct(cloud.iter().map(|(x, y)| panel.place(*x, *y))) {
        drawing.dot(at, 3.2, SKY);
    }
    draw_shifted(&mut drawing, &panel, &shifted);
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
    let estimate: &EstimateSection = document.estimate.as_ref()?.as_ref()?;
    let point = (estimate.kx.as_ref()?.value, estimate.ky.as_ref()?.value);
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

fn draw_shifted(drawing: &mut Drawing, panel: &Panel, shifted: &[(f64, Point)]) {
    let mut taken: Vec<Point> = Vec::new();
    for (percent, (x, y)) in shifted {
        let at = panel.place(*x, *y);
        drawing.cross(at, 6.0, Stroke::new(ORANGE, 2.5));
        let words = format!("{} %", signed(*percent));
        // To the left where the right has no room.
        let (end, align) = if at.0 > panel.x.to - 90.0 {
            (at.0 - 11.0, Align::End)
        } else {
            (at.0 + 11.0, Align::Start)
        };
        // Labels of neighbouring crosses step aside instead of covering each other.
        let mut place = (end, at.1);
        while taken
            .iter()
            .any(|other| (other.1 - place.1).abs() < 15.0 && (other.0 - place.0).abs() < 75.0)
        {
            place.1 += 15.0;
        }
        taken.push(place);
        drawing.text(
            Text::new(words, place, TICK_SIZE)
                .colored(INK)
                .aligned(align),
        );
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
