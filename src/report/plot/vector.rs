//! Pictures as SVG: inside an HTML page with text in the reader's fonts, or as a file of its own whose
//! letters are outlines of the embedded font and so need none.

use plotters::prelude::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontTransform, RGBColor, ShapeStyle, TextStyle};

use super::super::ReportError;
use super::drawing::{Align, Direction, Drawing, Note, Point, Shape, Text, ring_hole};
use super::font::{self, Weight};
use super::letters::Letters;
use super::palette::{Color, WHITE};
use super::paths::{is_long, merged, same_style};

/// Units of the SVG per pixel: the backend knows whole numbers only, a quarter of a pixel is fine
/// enough for smooth curves.
pub(super) const UNITS: f64 = 4.0;

/// The backend divides font sizes by this number.
const BACKEND_FONT_RATIO: f64 = 1.24;

/// The picture as an `<svg>` element without fixed size, which fills the width it is given. A name
/// space is not needed inside HTML, a description for screen readers is. Its notes are titles, which
/// browsers show without any script.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn.
pub fn render_svg(drawing: &Drawing) -> Result<String, ReportError> {
    let body = elements(drawing, &mut None)?;
    let (width, height) = size(drawing);
    let words = escaped(&drawing.description);
    Ok(format!(
        "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{words}\">{body}{}</svg>",
        notes(drawing)
    ))
}

/// The picture as an SVG file that looks the same on every machine: no font is asked for.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn, [`ReportError::Font`] without the embedded font.
pub fn render_svg_file(drawing: &Drawing) -> Result<String, ReportError> {
    font::check()?;
    let mut letters = Some(Letters::default());
    let body = elements(drawing, &mut letters)?;
    let (width, height) = size(drawing);
    let outlines = letters.map_or_else(String::new, |letters| letters.definitions());
    // xlink: readers of SVG 1.1 know no other reference to a definition.
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
         version=\"1.1\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {width} {height}\">\n\
         <title>{}</title>\n{outlines}{body}</svg>\n",
        drawing.width,
        drawing.height,
        escaped(&drawing.description)
    ))
}

/// Invisible rectangles that say something.
fn notes(drawing: &Drawing) -> String {
    let element = |note: &Note| {
        let ((left, top), (right, bottom)) = (place(note.from), place(note.to));
        format!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"none\" \
             pointer-events=\"all\"><title>{}</title></rect>\n",
            (right - left).max(0),
            (bottom - top).max(0),
            escaped(&note.words)
        )
    };
    drawing.notes.iter().map(element).collect()
}

fn size(drawing: &Drawing) -> (u32, u32) {
    let units = |pixels: u32| (f64::from(pixels) * UNITS) as u32;
    (units(drawing.width), units(drawing.height))
}

/// All shapes in their order; neighbours of one style become one element.
fn elements(drawing: &Drawing, letters: &mut Option<Letters>) -> Result<String, ReportError> {
    let mut all = String::from("\n");
    for group in drawing.shapes.chunk_by(same_style) {
        match (group, letters.as_mut()) {
            ([Shape::Text(text)], Some(letters)) => all.push_str(&letters.element(text)),
            ([one], _) if !is_long(one) => all.push_str(&element(drawing, one)?),
            _ => all.push_str(&merged(group)),
        }
    }
    Ok(all)
}

/// One shape, by the backend.
fn element(drawing: &Drawing, shape: &Shape) -> Result<String, ReportError> {
    let failed = |problem: String| ReportError::Picture {
        picture: drawing.description.clone(),
        problem,
    };
    let mut text = String::new();
    {
        let mut backend = SVGBackend::with_string(&mut text, size(drawing));
        put(&mut backend, shape).map_err(failed)?;
        backend
            .present()
            .map_err(|error| failed(error.to_string()))?;
    }
    let inner = text.split_once(">\n").map_or("", |(_, inner)| inner);
    let inner = inner
        .rsplit_once("</svg>")
        .map_or(inner, |(inner, _)| inner);
    // Full opacity is what SVG assumes.
    Ok(inner.replace(" opacity=\"1\"", ""))
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
        Shape::Ring {
            center,
            radius,
            color,
        } => {
            let paper = Shape::Dot {
                center: *center,
                radius: ring_hole(*radius),
                color: WHITE,
            };
            let disc = Shape::Dot {
                center: *center,
                radius: *radius,
                color: *color,
            };
            return put(backend, &disc).and_then(|()| put(backend, &paper));
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
