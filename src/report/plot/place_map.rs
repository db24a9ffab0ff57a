//! The picture of where along the beam the residual calls for a change.

use super::super::document::{Document, PlaceMapSection};
use super::super::format::{rounded, significant};
use super::axis::{Axis, extent, padded};
use super::drawing::{Drawing, Point, Stroke};
use super::palette::{BLUE, INK, VERMILION};
use super::panel::{Panel, Sample, X_SPACING, crisp, draw_legend, draw_title};
use super::spectrum::{LEFT, RIGHT, WIDTH};

/// How far a bar stands beside its point (px).
const BESIDE: f64 = 3.0;

/// Local change of stiffness and mass along the beam; `None` without a map.
pub fn draw_place_map(document: &Document) -> Option<Drawing> {
    let map = document.gap.as_ref()?.map.as_ref()?;
    let curves = [
        (
            &map.stiffness,
            &map.stiffness_std,
            VERMILION,
            "bending stiffness",
        ),
        (&map.mass, &map.mass_std, BLUE, "mass"),
    ];
    let panel = map_panel(map)?;
    let mut drawing = Drawing::new(
        "Where along the beam the gap calls for a change",
        WIDTH,
        440,
    );
    draw_title(
        &mut drawing,
        "Where along the beam",
        &format!(
            "local change that the errors of the described model call for, if stiffness or mass alone \
             changes; smeared over {:.0} mm; bars: one standard deviation",
            1e3 * map.resolution
        ),
    );
    panel.draw_y_ticks(&mut drawing, &panel.y.ticks(36.0));
    panel.draw_x_ticks(&mut drawing, &panel.x.ticks(X_SPACING));
    let zero = crisp(panel.y.place(0.0));
    drawing.line(
        vec![(LEFT + 8.0, zero), (RIGHT, zero)],
        Stroke::new(INK, 1.0),
    );
    panel.draw_frame(&mut drawing);
    for (k, (values, stds, color, _)) in curves.into_iter().enumerate() {
        // Bars of two curves at one place would hide each other.
        let aside = BESIDE * (2.0 * k as f64 - 1.0);
        let points: Vec<Point> = map
            .positions
            .iter()
            .zip(values.iter())
            .map(|(x, value)| panel.place(1e3 * x, 100.0 * value))
            .collect();
        for ((at, value), std) in points.iter().zip(values.iter()).zip(stds.iter()) {
            let ends = [value - std, value + std].map(|end| panel.y.place(100.0 * end));
            drawing.line(
                vec![(at.0 + aside, ends[0]), (at.0 + aside, ends[1])],
                Stroke::new(color, 1.0),
            );
        }
        drawing.line(points, Stroke::new(color, 2.0));
    }
    panel.draw_x_title(&mut drawing, "position from the joint (mm)");
    panel.draw_y_title(&mut drawing, "local change (%)");
    let legend: Vec<(Sample, String)> = curves
        .iter()
        .map(|(.., color, name)| (Sample::Dot(*color), (*name).to_owned()))
        .collect();
    draw_legend(&mut drawing, (LEFT, 86.0), RIGHT, &legend);
    note_places(&mut drawing, &panel, map);
    Some(drawing)
}

/// The axes: the position (mm) and the local change (%); `None` without a value.
pub fn map_panel(map: &PlaceMapSection) -> Option<Panel> {
    let curves = [
        (&map.stiffness, &map.stiffness_std),
        (&map.mass, &map.mass_std),
    ];
    let ends = curves.iter().flat_map(|(values, stds)| {
        let pairs = values.iter().zip(stds.iter());
        pairs.flat_map(|(value, std)| [100.0 * (value - std), 100.0 * (value + std)])
    });
    let (low, high) = extent(ends.chain([0.0]))?;
    let last = *map.positions.last()?;
    Some(Panel {
        x: Axis::linear((0.0, 1e3 * (last + 0.5 * step(map))), (LEFT + 8.0, RIGHT)),
        y: Axis::linear(padded((low, high), 0.08), (366.0, 108.0)),
    })
}

/// Distance of the places (m).
fn step(map: &PlaceMapSection) -> f64 {
    match map.positions.as_slice() {
        [first, second, ..] => second - first,
        [only] => *only,
        [] => 0.0,
    }
}

/// Every place says both changes.
fn note_places(drawing: &mut Drawing, panel: &Panel, map: &PlaceMapSection) {
    let half = 0.5 * step(map);
    for (index, at) in map.positions.iter().enumerate() {
        let change = |values: &[f64], stds: &[f64]| {
            let value = values.get(index).map_or(f64::NAN, |value| 100.0 * value);
            rounded(value, stds.get(index).map(|std| 100.0 * std)).joined()
        };
        let words = format!(
            "at {} mm: bending stiffness {} %, mass {} %",
            significant(1e3 * at, 3),
            change(&map.stiffness, &map.stiffness_std),
            change(&map.mass, &map.mass_std)
        );
        let edge = |place: f64| panel.x.place(1e3 * place);
        drawing.note(
            (edge(at - half), panel.y.to),
            (edge(at + half), panel.y.from),
            words,
        );
    }
}
