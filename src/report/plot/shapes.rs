//! The picture of mode shapes with the places of sensors and taps.

use std::collections::BTreeMap;

use super::super::document::Document;
use super::super::format::significant;
use super::axis::Axis;
use super::drawing::{Align, Drawing, Stroke, Text};
use super::palette::{BLUE, GRID, INK, ORANGE, SOFT, VERMILION, WHITE};
use super::panel::{Panel, Sample, TICK_SIZE, draw_legend, draw_title};
use super::spectrum::{LEFT, RIGHT, WIDTH};
use tapjoint_analysis::SampledShape;

/// Panels in a row.
const ACROSS: usize = 3;
/// Most modes drawn: a dozen fits a page.
const MOST: usize = 12;
/// Height of a panel with its title (pixels).
const HEIGHT: f64 = 150.0;
/// Space between panels (pixels).
const SPACE: f64 = 36.0;
/// Top of the first row (pixels).
const TOP: f64 = 104.0;

/// Pieces of a beam that each say what the mode does there.
const PIECES: usize = 24;

/// What stands on the beam: name and place (m), each place once.
pub struct Places {
    /// Sensors.
    pub sensors: BTreeMap<String, Vec<f64>>,
    /// Taps.
    pub taps: Vec<f64>,
}

/// The modes that are drawn.
pub fn shown(document: &Document) -> &[SampledShape] {
    let shapes = document.mode_shapes.as_deref().unwrap_or_default();
    &shapes[..shapes.len().min(MOST)]
}

/// Shapes of the predicted modes; `None` without any.
pub fn draw_shapes(document: &Document) -> Option<Drawing> {
    let shown = shown(document);
    if shown.is_empty() {
        return None;
    }
    let rows = shown.len().div_ceil(ACROSS);
    let height = TOP + rows as f64 * (HEIGHT + SPACE) + 10.0;
    let mut drawing = Drawing::new("Mode shapes with sensors and taps", WIDTH, height as u32);
    let below = "displacement over the position along the beam, each relative to its largest";
    draw_title(&mut drawing, "Mode shapes", below);
    let places = places(document);
    let kind = document.test.as_ref().and_then(|test| test.kind.as_deref());
    for (index, shape) in shown.iter().enumerate() {
        let (column, row) = (index % ACROSS, index / ACROSS);
        let panel = panel(shape, column, TOP + row as f64 * (HEIGHT + SPACE));
        draw_ground(&mut drawing, &panel, kind, joint_of(shape));
        draw_shape(&mut drawing, &panel, shape, &places);
    }
    draw_legend(&mut drawing, (LEFT, 76.0), RIGHT, &legend(&places));
    Some(drawing)
}

fn panel(shape: &SampledShape, column: usize, top: f64) -> Panel {
    let width = (RIGHT - LEFT - SPACE * (ACROSS - 1) as f64) / ACROSS as f64;
    let left = LEFT + column as f64 * (width + SPACE);
    let end = shape.positions.last().copied().unwrap_or(1.0);
    Panel {
        x: Axis::linear((0.0, end), (left, left + width)),
        y: Axis::linear((-1.15, 1.15), (top + HEIGHT, top + 22.0)),
    }
}

/// The beam at rest, and what holds it.
fn draw_ground(drawing: &mut Drawing, panel: &Panel, kind: Option<&str>, lap: Option<f64>) {
    let y = panel.y.place(0.0);
    drawing.line(
        vec![(panel.x.from, y), (panel.x.to, y)],
        Stroke::new(GRID, 2.0),
    );
    if let Some(joint) = lap.map(|joint| panel.x.place(joint)) {
        let (from, to) = ((joint - 3.0, y - 12.0), (joint + 3.0, y + 12.0));
        drawing.rectangle(from, to, SOFT, 0.8);
    }
    if kind == Some("cantilever") {
        drawing.rectangle(
            (panel.x.from - 9.0, y - 24.0),
            (panel.x.from - 2.0, y + 24.0),
            SOFT,
            0.8,
        );
    }
}

fn draw_shape(drawing: &mut Drawing, panel: &Panel, shape: &SampledShape, places: &Places) {
    let points = shape.positions.iter().zip(&shape.displacements);
    let points: Vec<(f64, f64)> = points.map(|(x, y)| (*x, *y)).collect();
    // A lap joint's halves end at one place and need not meet.
    for beam in points.chunk_by(|before, after| before.0 < after.0) {
        panel.draw_curve(drawing, beam.iter().copied(), Stroke::new(BLUE, 2.5));
    }
    let title = format!("mode {}", shape.mode);
    let at = (panel.x.from, panel.y.to - 8.0);
    drawing.text(Text::new(title, at, TICK_SIZE).bold());
    let words = format!("{} Hz", significant(shape.frequency, 4));
    let at = (panel.x.to, panel.y.to - 8.0);
    drawing.text(
        Text::new(words, at, TICK_SIZE)
            .colored(SOFT)
            .aligned(Align::End),
    );
    note_pieces(drawing, panel, shape);
    for place in &places.taps {
        note_site(drawing, panel, shape, ("tap", *place));
        let at = panel.place(*place, displacement(shape, *place));
        drawing.cross(at, 6.0, Stroke::new(VERMILION, 2.5));
    }
    for (name, sites) in &places.sensors {
        for place in sites {
            note_site(drawing, panel, shape, (&format!("sensor {name}"), *place));
            let at = panel.place(*place, displacement(shape, *place));
            drawing.dot(at, 6.5, WHITE);
            drawing.dot(at, 5.0, ORANGE);
            let above = if at.1 < panel.y.place(0.7) {
                15.0
            } else {
                -15.0
            };
            let text = Text::new(name.as_str(), (at.0, at.1 + above), 12.0).colored(INK);
            drawing.text_on_paper(text);
        }
    }
}

/// "mode 1 at 120 mm: 0.43 of its largest displacement".
fn words_at(shape: &SampledShape, place: f64) -> String {
    let value = significant(displacement(shape, place), 2);
    let place = significant(1e3 * place, 3);
    format!(
        "mode {} at {place} mm: {value} of its largest displacement",
        shape.mode
    )
}

fn note_pieces(drawing: &mut Drawing, panel: &Panel, shape: &SampledShape) {
    let step = (panel.x.high - panel.x.low) / PIECES as f64;
    for piece in 0..PIECES {
        let middle = panel.x.low + (piece as f64 + 0.5) * step;
        let edge = |side: f64| panel.x.place(middle + side * step);
        drawing.note(
            (edge(-0.5), panel.y.to),
            (edge(0.5), panel.y.from),
            words_at(shape, middle),
        );
    }
}

fn note_site(
    drawing: &mut Drawing,
    panel: &Panel,
    shape: &SampledShape,
    (name, place): (&str, f64),
) {
    let (x, y) = panel.place(place, displacement(shape, place));
    let words = format!("{name}: {}", words_at(shape, place));
    drawing.note((x - 8.0, y - 8.0), (x + 8.0, y + 8.0), words);
}

/// Where a lap joint sits (m): its place stands twice.
pub fn joint_of(shape: &SampledShape) -> Option<f64> {
    let mut pairs = shape.positions.windows(2);
    let twice = pairs.find(|pair| pair[0] == pair[1])?;
    twice.first().copied()
}

/// Displacement at a place, between the points next to it.
pub fn displacement(shape: &SampledShape, place: f64) -> f64 {
    let after = shape.positions.partition_point(|x| *x < place);
    let point = |index: usize| {
        Some((
            *shape.positions.get(index)?,
            *shape.displacements.get(index)?,
        ))
    };
    match (after.checked_sub(1).and_then(point), point(after)) {
        (Some((x0, y0)), Some((x1, y1))) if x1 > x0 => y0 + (y1 - y0) * (place - x0) / (x1 - x0),
        (_, Some((_, y))) | (Some((_, y)), None) => y,
        (None, None) => 0.0,
    }
}

/// Where sensors and taps of all recordings are.
pub fn places(document: &Document) -> Places {
    let mut places = Places {
        sensors: BTreeMap::new(),
        taps: Vec::new(),
    };
    for recording in document.recordings.iter().flatten() {
        for (name, place) in &recording.sensor_positions {
            let sites = places.sensors.entry(name.clone()).or_default();
            if !sites.contains(place) {
                sites.push(*place);
            }
        }
        places
            .taps
            .extend(recording.tap.filter(|tap| !places.taps.contains(tap)));
    }
    places
}

fn legend(places: &Places) -> Vec<(Sample, String)> {
    let mut entries = vec![(Sample::Line(BLUE), "mode shape".to_owned())];
    if !places.sensors.is_empty() {
        entries.push((Sample::Dot(ORANGE), "sensor".to_owned()));
    }
    if !places.taps.is_empty() {
        entries.push((Sample::Cross(VERMILION), "tap".to_owned()));
    }
    entries
}
