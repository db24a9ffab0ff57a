//! The picture of where along the beam the residual calls for a change.

use super::super::document::Document;
use super::super::format::{rounded, significant};
use super::axis::{Axis, extent, padded};
use super::drawing::{Drawing, Point, Stroke};
use super::palette::{BLUE, INK, VERMILION};
use super::panel::{Panel, Sample, X_SPACING, crisp, draw_legend, draw_title};
use super::spectrum::{LEFT, RIGHT, WIDTH};
use tapjoint_diagnosis::LocationMap;

/// How far a bar stands beside its point (px).
const BESIDE: f64 = 3.0;

/// What a change at one place alone would explain, and below it the changes of all places together; `None` without
/// a map.
pub fn draw_place_map(document: &Document) -> Option<Drawing> {
    let map = document.gap.as_ref()?.map.as_ref()?;
    let panels = [explained_panel(map)?, map_panel(map)?];
    let mut drawing = Drawing::new(
        "Where along the beam the gap calls for a change",
        WIDTH,
        640,
    );
    draw_title(
        &mut drawing,
        "Where along the beam",
        &format!(
            "above: what one place alone would explain; below: what all places together ask for, smeared over {:.0} mm, \
             bars: one standard deviation",
            1e3 * map.resolution
        ),
    );
    for panel in &panels {
        panel.draw_y_ticks(&mut drawing, &panel.y.ticks(36.0));
        panel.draw_x_ticks(&mut drawing, &panel.x.ticks(X_SPACING));
        let zero = crisp(panel.y.place(0.0));
        drawing.line(
            vec![(LEFT + 8.0, zero), (RIGHT, zero)],
            Stroke::new(INK, 1.0),
        );
        panel.draw_frame(&mut drawing);
    }
    let [explained, changes] = &panels;
    for (values, color) in [
        (&map.stiffness_explains, VERMILION),
        (&map.mass_explains, BLUE),
    ] {
        let line = points(explained, map, values);
        for at in &line {
            drawing.dot(*at, 3.0, color);
        }
        drawing.line(line, Stroke::new(color, 2.0));
    }
    let curves = [
        (&map.stiffness, &map.stiffness_std, VERMILION),
        (&map.mass, &map.mass_std, BLUE),
    ];
    for (k, (values, stds, color)) in curves.into_iter().enumerate() {
        // Bars of two curves at one place would hide each other.
        let aside = BESIDE * (2.0 * k as f64 - 1.0);
        let points = points(changes, map, values);
        for ((at, value), std) in points.iter().zip(values.iter()).zip(stds.iter()) {
            let ends = [value - std, value + std].map(|end| changes.y.place(100.0 * end));
            drawing.line(
                vec![(at.0 + aside, ends[0]), (at.0 + aside, ends[1])],
                Stroke::new(color, 1.0),
            );
        }
        drawing.line(points, Stroke::new(color, 2.0));
    }
    explained.draw_y_title(&mut drawing, "misfit explained (%)");
    changes.draw_x_title(&mut drawing, "position from the joint (mm)");
    changes.draw_y_title(&mut drawing, "local change (%)");
    let legend = [
        (VERMILION, "bending stiffness alone changes"),
        (BLUE, "mass alone changes"),
    ];
    let legend = legend.map(|(color, name)| (Sample::Dot(color), name.to_owned()));
    draw_legend(&mut drawing, (LEFT, 86.0), RIGHT, &legend);
    note_places(&mut drawing, &panels, map);
    Some(drawing)
}

/// One value (1, shown in %) for each place.
fn points(panel: &Panel, map: &LocationMap, values: &[f64]) -> Vec<Point> {
    let places = map.positions.iter().zip(values);
    let point = |(x, value): (&f64, &f64)| panel.place(1e3 * x, 100.0 * value);
    places.map(point).collect()
}

/// The axes: the position (mm) and the share of the misfit (%); `None` without a place.
pub fn explained_panel(map: &LocationMap) -> Option<Panel> {
    Some(Panel {
        x: along(map)?,
        y: Axis::linear((0.0, 105.0), (288.0, 108.0)),
    })
}

/// The axes: the position (mm) and the local change (%); `None` without a value.
pub fn map_panel(map: &LocationMap) -> Option<Panel> {
    let curves = [
        (&map.stiffness, &map.stiffness_std),
        (&map.mass, &map.mass_std),
    ];
    let ends = curves.iter().flat_map(|(values, stds)| {
        let pairs = values.iter().zip(stds.iter());
        pairs.flat_map(|(value, std)| [100.0 * (value - std), 100.0 * (value + std)])
    });
    let (low, high) = extent(ends.chain([0.0]))?;
    Some(Panel {
        x: along(map)?,
        y: Axis::linear(padded((low, high), 0.08), (572.0, 332.0)),
    })
}

fn along(map: &LocationMap) -> Option<Axis> {
    let end = 1e3 * (map.positions.last()? + 0.5 * step(map));
    Some(Axis::linear((0.0, end), (LEFT + 8.0, RIGHT)))
}

/// Distance of the places (m).
fn step(map: &LocationMap) -> f64 {
    match map.positions.as_slice() {
        [first, second, ..] => second - first,
        [only] => *only,
        [] => 0.0,
    }
}

/// Every place says both changes, alone and together.
fn note_places(drawing: &mut Drawing, [explained, panel]: &[Panel; 2], map: &LocationMap) {
    let half = 0.5 * step(map);
    for (index, at) in map.positions.iter().enumerate() {
        let change = |values: &[f64], stds: &[f64]| {
            let value = values.get(index).map_or(f64::NAN, |value| 100.0 * value);
            rounded(value, stds.get(index).map(|std| 100.0 * std)).joined()
        };
        let share = |values: &[f64]| {
            let value = values.get(index).map_or(f64::NAN, |value| 100.0 * value);
            format!("{value:.0}")
        };
        let words = format!(
            "at {} mm: bending stiffness alone explains {} %, mass {} %; together bending stiffness {} %, mass {} %",
            significant(1e3 * at, 3),
            share(&map.stiffness_explains),
            share(&map.mass_explains),
            change(&map.stiffness, &map.stiffness_std),
            change(&map.mass, &map.mass_std)
        );
        let edge = |place: f64| panel.x.place(1e3 * place);
        drawing.note(
            (edge(at - half), explained.y.to),
            (edge(at + half), panel.y.from),
            words,
        );
    }
}
