//! Many alike shapes as one SVG path: a stabilisation diagram has thousands of marks.

use super::drawing::{Point, Shape, Stroke, ring_hole};
use super::palette::Color;
use super::vector::UNITS;
use std::fmt::Write;

/// From so many points on a path in steps is shorter than the backend's list of places.
const MANY: usize = 6;

/// Whether a line is a curve, which a path says in less than half the letters.
pub(super) fn is_long(shape: &Shape) -> bool {
    matches!(shape, Shape::Line { points, .. } if points.len() > MANY)
}

/// Whether two shapes can stand in one path. Neighbours only are merged, so that what covers what stays.
pub(super) fn same_style(one: &Shape, other: &Shape) -> bool {
    match (one, other) {
        (Shape::Line { stroke: a, .. }, Shape::Line { stroke: b, .. }) => a == b,
        (
            Shape::Rectangle { color, opacity, .. },
            Shape::Rectangle {
                color: as_color,
                opacity: as_opacity,
                ..
            },
        ) => color == as_color && opacity == as_opacity,
        (
            Shape::Dot { radius, color, .. },
            Shape::Dot {
                radius: as_radius,
                color: as_color,
                ..
            },
        )
        | (
            Shape::Ring { radius, color, .. },
            Shape::Ring {
                radius: as_radius,
                color: as_color,
                ..
            },
        ) => radius == as_radius && color == as_color,
        _ => false,
    }
}

/// Shapes of one style as one element; empty for no shape and for text.
pub(super) fn merged(shapes: &[Shape]) -> String {
    let Some(first) = shapes.first() else {
        return String::new();
    };
    let mut path = String::new();
    for shape in shapes {
        trace(&mut path, shape);
    }
    match first {
        Shape::Line { stroke, .. } => lines(&path, *stroke),
        Shape::Rectangle { color, opacity, .. } => format!(
            "<path d=\"{path}\"{} fill=\"{}\"/>\n",
            faint(*opacity),
            hex(*color)
        ),
        // A line without length and with round ends is a disc.
        Shape::Dot { radius, color, .. } => format!(
            "<path d=\"{path}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\"/>\n",
            hex(*color),
            whole(2.0 * radius)
        ),
        Shape::Ring { radius, color, .. } => format!(
            "<path d=\"{path}\" fill=\"#FFFFFF\" stroke=\"{}\" stroke-width=\"{}\"/>\n",
            hex(*color),
            whole(radius - ring_hole(*radius)).max(1)
        ),
        Shape::Text(_) => String::new(),
    }
}

fn lines(path: &str, stroke: Stroke) -> String {
    format!(
        "<path d=\"{path}\"{} fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"/>\n",
        faint(stroke.opacity),
        hex(stroke.color),
        whole(stroke.width).max(1)
    )
}

/// Appends a shape's outline. Writing into a string cannot fail.
fn trace(path: &mut String, shape: &Shape) {
    let written = match shape {
        Shape::Line { points, .. } => {
            polyline(path, points);
            Ok(())
        }
        Shape::Rectangle { from, to, .. } => {
            let ((left, top), (right, bottom)) = (place(*from), place(*to));
            let (wide, high) = (right - left, bottom - top);
            write!(path, "M{left} {top}h{wide}v{high}h{}z", -wide)
        }
        // Not quite without length: some readers leave out what has none.
        Shape::Dot { center, .. } => {
            let (x, y) = place(*center);
            write!(path, "M{x} {y}h.1")
        }
        Shape::Ring { center, radius, .. } => {
            let middle = whole(0.5 * (radius + ring_hole(*radius)));
            let (x, y) = place(*center);
            let wide = 2 * middle;
            write!(
                path,
                "M{} {y}a{middle} {middle} 0 1 0 {wide} 0a{middle} {middle} 0 1 0-{wide} 0",
                x - middle
            )
        }
        Shape::Text(_) => Ok(()),
    };
    debug_assert!(written.is_ok());
}

/// From the first point on in steps, which are short numbers; a minus sign parts numbers by itself.
fn polyline(path: &mut String, points: &[Point]) {
    let mut last = None;
    for (index, point) in points.iter().enumerate() {
        let (x, y) = place(*point);
        let (before, dx, dy) = match last {
            None => ("M", x, y),
            Some((x0, y0)) if index == 1 => ("l", x - x0, y - y0),
            Some((x0, y0)) => (if x < x0 { "" } else { " " }, x - x0, y - y0),
        };
        let between = if dy < 0 { "" } else { " " };
        path.push_str(&format!("{before}{dx}{between}{dy}"));
        last = Some((x, y));
    }
}

fn place((x, y): Point) -> (i32, i32) {
    (whole(x), whole(y))
}

fn whole(pixels: f64) -> i32 {
    (pixels * UNITS).round() as i32
}

fn hex(Color(red, green, blue): Color) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}

fn faint(opacity: f64) -> String {
    if opacity < 1.0 {
        format!(" opacity=\"{opacity}\"")
    } else {
        String::new()
    }
}
