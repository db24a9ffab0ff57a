//! The picture of all estimates that the errors of the readings allow: Kx against Ky, a panel for each
//! method.

use std::collections::HashSet;

use super::super::document::Document;
use super::super::format::signed;
use super::cloud_points::{Cloud, clouds};
use super::drawing::{Align, Drawing, Point, Stroke, Text};
use super::font::{Weight, text_width};
use super::palette::{BLUE, DATA, INK, ORANGE, SKY, VERMILION, WHITE};
use super::panel::{LABEL_SIZE, Panel, Sample, TICK_SIZE, draw_legend, draw_title};
use super::spectrum::{LEFT, RIGHT, WIDTH};

/// Upper and lower edge of the panels (pixels).
const TOP: f64 = 98.0;
const BOTTOM: f64 = 556.0;
/// Height of a panel's own title, where there are several (pixels).
const HEAD: f64 = 24.0;
/// Room left of a panel for its numbers and title (pixels).
const MARGIN: f64 = 92.0;

/// Estimates under changed frequencies, the methods side by side; `None` where there are none.
pub fn draw_cloud(document: &Document) -> Option<Drawing> {
    let clouds = clouds(document);
    if clouds.is_empty() {
        return None;
    }
    let mut drawing = Drawing::new("Estimates under changed frequencies", WIDTH, 620);
    let title = "Joint stiffness under changed frequencies";
    draw_title(&mut drawing, title, &below(document, &clouds));
    let width = (RIGHT - LEFT + MARGIN - 16.0) / clouds.len() as f64;
    for (index, cloud) in clouds.iter().enumerate() {
        let left = LEFT + 16.0 + width * index as f64;
        let several = clouds.len() > 1;
        let top = if several { TOP + HEAD } else { TOP };
        let (x, y) = cloud.axes((left, left + width - MARGIN), (BOTTOM, top));
        let panel = Panel { x, y };
        if several {
            let words = method_words(&cloud.method);
            drawing.text(Text::new(words, (left, top - 13.0), LABEL_SIZE).bold());
        }
        draw_panel(&mut drawing, &panel, cloud);
    }
    draw_legend(&mut drawing, (LEFT, 76.0), RIGHT, &legend(&clouds));
    Some(drawing)
}

pub(crate) fn method_words(method: &str) -> &'static str {
    match method {
        "pairs" => "Pair regression",
        _ => "Consistent estimate",
    }
}

fn draw_panel(drawing: &mut Drawing, panel: &Panel, cloud: &Cloud) {
    panel.draw_axes(drawing);
    let visible = |point: &&Point| panel.x.holds(point.0) && panel.y.holds(point.1);
    let random = cloud.random.iter().filter(visible);
    for at in distinct(random.map(|(x, y)| panel.place(*x, *y))) {
        drawing.dot(at, 1.7, DATA);
    }
    let mut dots = distinct(cloud.patterns.iter().map(|(x, y)| panel.place(*x, *y)));
    for at in &dots {
        drawing.dot(*at, 3.2, SKY);
    }
    let corners = cloud.ellipse.iter().map(|(x, y)| panel.place(*x, *y));
    drawing.line(corners.collect(), Stroke::new(VERMILION, 2.0));
    dots.extend(cloud.estimate.map(|(x, y)| panel.place(x, y)));
    draw_shifted(drawing, panel, &cloud.shifted, &dots);
    if let Some((x, y)) = cloud.estimate {
        let at = panel.place(x, y);
        drawing.dot(at, 7.0, WHITE);
        drawing.dot(at, 5.5, BLUE);
    }
    panel.draw_x_title(drawing, "Kx = Kt L\u{b3}/(EI) (1)");
    let middle = 0.5 * (panel.y.from + panel.y.to);
    let title = Text::new(
        "Ky = Kr L/(EI) (1)",
        (panel.x.from - 68.0, middle),
        LABEL_SIZE,
    );
    drawing.text(title.aligned(Align::Middle).upwards());
}

/// Points without those that would be drawn over another one, two pixels apart at least.
fn distinct(points: impl Iterator<Item = Point>) -> Vec<Point> {
    let mut taken = HashSet::new();
    points
        .filter(|(x, y)| taken.insert(((x / 2.0) as i64, (y / 2.0) as i64)))
        .collect()
}

/// What was tried.
fn below(document: &Document, clouds: &[Cloud]) -> String {
    let mut parts = Vec::new();
    let spans = document.resolution_span.as_deref().unwrap_or_default();
    if let Some(span) = spans.first() {
        let patterns = span.patterns;
        parts.push(format!(
            "every mode at one end of its reading's bound or the other: {patterns} sign patterns"
        ));
    }
    let failed: usize = spans.iter().map(|span| span.failed).sum();
    if failed > 0 {
        parts.push(format!("{failed} of them leave no estimate"));
    }
    let drawn = clouds.iter().map(|cloud| cloud.random.len()).max();
    if let Some(drawn) = drawn.filter(|drawn| *drawn > 0) {
        parts.push(format!("{drawn} random draws shown"));
    }
    if parts.is_empty() {
        return "all frequencies changed by the same percentage".to_owned();
    }
    parts.join(" \u{b7} ")
}

/// Crosses with their percentage, on the side where the words cover nothing; words without such a
/// side are left out, the table has them.
fn draw_shifted(drawing: &mut Drawing, panel: &Panel, shifted: &[(f64, Point)], dots: &[Point]) {
    let mut crosses: Vec<(f64, Point)> = shifted
        .iter()
        .map(|(percent, (x, y))| (*percent, panel.place(*x, *y)))
        .collect();
    let mut boxes: Vec<Patch> = dots
        .iter()
        .chain(crosses.iter().map(|(_, at)| at))
        .map(|at| Patch::around(*at, (7.0, 7.0)))
        .collect();
    // The largest changes first: they say which way the estimate moves.
    crosses.sort_by(|(a, _), (b, _)| b.abs().total_cmp(&a.abs()));
    for (percent, at) in crosses {
        drawing.cross(at, 6.0, Stroke::new(ORANGE, 2.5));
        let words = format!("{} %", signed(percent));
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
            drawing.text_on_paper(Text::new(words, middle, TICK_SIZE).colored(INK));
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

fn legend(clouds: &[Cloud]) -> Vec<(Sample, String)> {
    let any = |has: fn(&Cloud) -> bool| clouds.iter().any(has);
    let entries = [
        (
            any(|cloud| cloud.estimate.is_some()),
            Sample::Dot(BLUE),
            "estimate",
        ),
        (
            any(|cloud| !cloud.ellipse.is_empty()),
            Sample::Line(VERMILION),
            "95 % ellipse (covariance)",
        ),
        (
            any(|cloud| !cloud.random.is_empty()),
            Sample::Dot(DATA),
            "random errors",
        ),
        (
            any(|cloud| !cloud.patterns.is_empty()),
            Sample::Dot(SKY),
            "every mode at an end of its bound",
        ),
        (
            any(|cloud| !cloud.shifted.is_empty()),
            Sample::Cross(ORANGE),
            "all frequencies changed alike",
        ),
    ];
    let shown = entries.into_iter().filter(|(there, _, _)| *there);
    shown
        .map(|(_, sample, words)| (sample, words.to_owned()))
        .collect()
}
