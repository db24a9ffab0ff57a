//! Pictures as SVG that stands inside an HTML page.

use plotters::prelude::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontTransform, RGBColor, ShapeStyle, TextStyle};

use super::super::ReportError;
use super::drawing::{Align, Direction, Drawing, Point, Shape, Text};
use super::font::{self, Weight};
use super::palette::Color;

/// Units of the SVG per pixel: the backend knows whole numbers only, a quarter of a pixel is fine
/// enough for smooth curves.
const UNITS: f64 = 4.0;

/// The backend divides font sizes by this number.
const BACKEND_FONT_RATIO: f64 = 1.24;

/// The picture as an `<svg>` element without fixed size, which fills the width it is given.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn.
pub fn render_svg(drawing: &Drawing) -> Result<String, ReportError> {
    let mut text = String::new();
    let size = (
        (f64::from(drawing.width) * UNITS) as u32,
        (f64::from(drawing.height) * UNITS) as u32,
    );
    {
        let mut backend = SVGBackend::with_string(&mut text, size);
        for shape in &drawing.shapes {
            put(&mut backend, shape).map_err(|problem| ReportError::Picture {
                picture: drawing.description.clone(),
                problem,
            })?;
        }
        backend.present().map_err(|error| ReportError::Picture {
            picture: drawing.description.clone(),
            problem: error.to_string(),
        })?;
    }
    Ok(inline(&text, drawing, size))
}

/// Replaces the element's head: a name space is not needed inside HTML, a fixed size not wanted,
/// a description for screen readers is.
fn inline(svg: &str, drawing: &Drawing, size: (u32, u32)) -> String {
    let body = svg.split_once('>').map_or("", |(_, body)| body);
    // Full opacity is what SVG assumes.
    let body = body.replace(" opacity=\"1\"", "");
    format!(
        "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">{body}",
        size.0,
        size.1,
        escaped(&drawing.description)
    )
}

fn escaped(text: &str) -> String {
    text.chars().fold(String::new(), |mut out, letter| {
        match letter {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '"' => out.push_str("&quot;"),
            other => out.push(other),
        }
        out
    })
}

fn place(point: Point) -> (i32, i32) {
    (
        (point.0 * UNITS).round() as i32,
        (point.1 * UNITS).round() as i32,
    )
}

fn style(color: Color, opacity: f64, width: f64) -> ShapeStyle {
    ShapeStyle {
        color: RGBColor(color.0, color.1, color.2).mix(opacity),
        filled: true,
        stroke_width: (width * UNITS).round() as u32,
    }
}

fn put(backend: &mut SVGBackend<'_>, shape: &Shape) -> Result<(), String> {
    let drawn = match shape {
        Shape::Line { points, stroke } => {
            let style = style(stroke.color, stroke.opacity, stroke.width);
            backend.draw_path(points.iter().map(|point| place(*point)), &style)
        }
        Shape::Rectangle {
            from,
            to,
            color,
            opacity,
        } => backend.draw_rect(
            place(*from),
            place(*to),
            &style(*color, *opacity, 1.0),
            true,
        ),
        Shape::Dot {
            center,
            radius,
            color,
        } => {
            let radius = (radius * UNITS).round() as u32;
            backend.draw_circle(place(*center), radius, &style(*color, 1.0, 1.0), true)
        }
        Shape::Text(text) => return put_text(backend, text),
    };
    drawn.map_err(|error| error.to_string())
}

fn put_text(backend: &mut SVGBackend<'_>, text: &Text) -> Result<(), String> {
    let horizontal = match text.align {
        Align::Start => HPos::Left,
        Align::Middle => HPos::Center,
        Align::End => HPos::Right,
    };
    let weight = match text.weight {
        Weight::Regular => plotters::style::FontStyle::Normal,
        Weight::Bold => plotters::style::FontStyle::Bold,
    };
    let transform = match text.direction {
        Direction::Across => FontTransform::None,
        Direction::Upwards => FontTransform::Rotate270,
    };
    let size = text.size * UNITS * BACKEND_FONT_RATIO;
    let color = RGBColor(text.color.0, text.color.1, text.color.2);
    let style = TextStyle::from((font::FAMILY, size, weight))
        .color(&color)
        .transform(transform)
        .pos(Pos::new(horizontal, VPos::Center));
    backend
        .draw_text(&text.text, &style, place(text.at))
        .map_err(|error| error.to_string())
}
