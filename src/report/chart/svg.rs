//! Pictures as SVG: inside an HTML page with text in the reader's fonts, or as a file of its own whose
//! letters are outlines of the embedded font and so need none.

use std::collections::BTreeMap;
use std::fmt::Write;

use ab_glyph::{Font, FontRef, GlyphId, OutlineCurve};

use super::drawing::{
    Align, BASELINE, Direction, Drawing, Point, Rgb, Shape, Text, Weight, check_font, face,
    ring_hole,
};
use crate::ReportError;

/// Units of the SVG per pixel: whole numbers are short, a quarter of a pixel is fine enough for smooth curves.
const UNITS: f64 = 4.0;

/// The picture as an `<svg>` element without fixed size, which fills the width it is given. A name
/// space is not needed inside HTML, a description for screen readers is. Its notes are titles, which
/// browsers show without any script.
pub fn render_svg(drawing: &Drawing) -> String {
    let mut body = elements(drawing, &mut None);
    for note in &drawing.notes {
        let ((left, top), (right, bottom)) = (place(note.from), place(note.to));
        body.push_str(&format!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"none\" \
             pointer-events=\"all\"><title>{}</title></rect>\n",
            (right - left).max(0),
            (bottom - top).max(0),
            escaped(&note.words)
        ));
    }
    let (width, height) = place((f64::from(drawing.width), f64::from(drawing.height)));
    let words = escaped(&drawing.description);
    format!(
        "<svg viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" role=\"img\" \
         aria-label=\"{words}\">\n{body}</svg>"
    )
}

/// The picture as an SVG file that looks the same on every machine: no font is asked for.
///
/// # Errors
/// [`ReportError::Font`] without the embedded font.
pub fn render_svg_file(drawing: &Drawing) -> Result<String, ReportError> {
    check_font()?;
    let mut letters = Some(Letters::default());
    let body = elements(drawing, &mut letters);
    let mut outlines = String::new();
    for (name, path) in letters.unwrap_or_default().outlines {
        outlines.push_str(&format!("<path id=\"{name}\" d=\"{path}\"/>\n"));
    }
    let (width, height) = place((f64::from(drawing.width), f64::from(drawing.height)));
    // xlink: readers of SVG 1.1 know no other reference to a definition.
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
         version=\"1.1\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {width} {height}\">\n\
         <title>{}</title>\n<defs>\n{outlines}</defs>\n{body}</svg>\n",
        drawing.width,
        drawing.height,
        escaped(&drawing.description)
    ))
}

/// All shapes in their order; neighbours of one style become one element, for a stabilisation diagram has
/// thousands of marks.
fn elements(drawing: &Drawing, letters: &mut Option<Letters>) -> String {
    let mut all = String::new();
    for group in drawing.shapes.chunk_by(same_style) {
        match (group, letters.as_mut()) {
            ([Shape::Text(text)], Some(letters)) => all.push_str(&letters.element(text)),
            ([Shape::Text(text)], None) => all.push_str(&text_element(text)),
            ([first, ..], _) => {
                let mut path = String::new();
                for shape in group {
                    trace(&mut path, shape);
                }
                all.push_str(&path_element(&path, first));
            }
            ([], _) => {}
        }
    }
    all
}

/// True where two shapes can stand in one path. Neighbours only are merged, so that what covers what stays.
fn same_style(one: &Shape, other: &Shape) -> bool {
    !matches!(one, Shape::Text(_)) && path_element("", one) == path_element("", other)
}

/// A path in the style of a shape; empty for text.
fn path_element(path: &str, shape: &Shape) -> String {
    let style = match shape {
        Shape::Line { stroke, .. } => format!(
            "{} fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"",
            faint(stroke.opacity),
            hex(stroke.color),
            whole(stroke.width).max(1)
        ),
        Shape::Rectangle { color, opacity, .. } | Shape::Area { color, opacity, .. } => {
            format!("{} fill=\"{}\"", faint(*opacity), hex(*color))
        }
        // A line without length and with round ends is a disc.
        Shape::Dot { radius, color, .. } => format!(
            " fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\"",
            hex(*color),
            whole(2.0 * radius)
        ),
        Shape::Ring { radius, color, .. } => format!(
            " fill=\"#FFFFFF\" stroke=\"{}\" stroke-width=\"{}\"",
            hex(*color),
            whole(radius - ring_hole(*radius)).max(1)
        ),
        Shape::Text(_) => return String::new(),
    };
    format!("<path d=\"{path}\"{style}/>\n")
}

/// Appends a shape's outline. Writing into a string cannot fail.
fn trace(path: &mut String, shape: &Shape) {
    let written = match shape {
        Shape::Line { points, .. } => {
            polyline(path, points);
            Ok(())
        }
        Shape::Area { points, .. } => {
            polyline(path, points);
            write!(path, "z")
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

/// Text in the reader's font.
fn text_element(text: &Text) -> String {
    let (x, y) = place(text.at);
    let anchor = match text.align {
        Align::Start => "",
        Align::Middle => " text-anchor=\"middle\"",
        Align::End => " text-anchor=\"end\"",
    };
    let weight = match text.weight {
        Weight::Regular => "",
        Weight::Bold => " font-weight=\"bold\"",
    };
    let turn = match text.direction {
        Direction::Across => String::new(),
        Direction::Upwards => format!(" transform=\"rotate(-90 {x} {y})\""),
    };
    format!(
        "<text x=\"{x}\" y=\"{y}\" dy=\"{BASELINE}em\"{anchor} font-size=\"{}\"{weight} fill=\"{}\"{turn}>{}</text>\n",
        whole(text.size),
        hex(text.color),
        escaped(&text.text)
    )
}

/// The letters that a picture has used: each outline is defined once and used wherever it stands.
#[derive(Debug, Default)]
struct Letters {
    /// Outline by name; those without one (spaces) are not kept.
    outlines: BTreeMap<String, String>,
}

impl Letters {
    /// A text as references to its letters' outlines.
    fn element(&mut self, text: &Text) -> String {
        let Some(face) = face(text.weight) else {
            return String::new();
        };
        let em = f64::from(face.units_per_em().unwrap_or(1000.0));
        let scale = text.size * UNITS / em;
        let (mut uses, mut pen, mut previous) = (String::new(), 0.0, None);
        for letter in text.text.chars() {
            let id = face.glyph_id(letter);
            pen += previous.map_or(0.0, |last| face.kern_unscaled(last, id));
            previous = Some(id);
            if let Some(name) = self.define(face, id, text.weight) {
                uses.push_str(&format!("<use xlink:href=\"#{name}\" x=\"{pen:.0}\"/>"));
            }
            pen += face.h_advance_unscaled(id);
        }
        let width = f64::from(pen);
        let start = match text.align {
            Align::Start => 0.0,
            Align::Middle => -0.5 * width,
            Align::End => -width,
        };
        let turn = match text.direction {
            Direction::Across => "",
            Direction::Upwards => " rotate(-90)",
        };
        let (x, y) = (text.at.0 * UNITS, text.at.1 * UNITS);
        // Font units count upwards, and from the baseline's start.
        format!(
            "<g fill=\"{}\" transform=\"translate({x:.1} {y:.1}){turn} scale({scale:.5}) \
             translate({start:.0} {:.0}) scale(1 -1)\">{uses}</g>\n",
            hex(text.color),
            BASELINE * em
        )
    }

    /// The name of a letter's outline; `None` where there is nothing to draw.
    fn define(&mut self, face: &FontRef<'static>, id: GlyphId, weight: Weight) -> Option<String> {
        let name = match weight {
            Weight::Regular => format!("r{}", id.0),
            Weight::Bold => format!("b{}", id.0),
        };
        if !self.outlines.contains_key(&name) {
            let outline = face.outline(id)?;
            self.outlines
                .insert(name.clone(), outline_path(&outline.curves));
        }
        Some(name)
    }
}

/// Curves as a path in font units; where one does not begin at the end of the one before, a new contour
/// does.
fn outline_path(curves: &[OutlineCurve]) -> String {
    let mut path = String::new();
    let mut last = None;
    for curve in curves {
        let (from, words, to) = match curve {
            OutlineCurve::Line(a, b) => (a, format!("L{} {}", b.x, b.y), b),
            OutlineCurve::Quad(a, b, c) => (a, format!("Q{} {} {} {}", b.x, b.y, c.x, c.y), c),
            OutlineCurve::Cubic(a, b, c, d) => (
                a,
                format!("C{} {} {} {} {} {}", b.x, b.y, c.x, c.y, d.x, d.y),
                d,
            ),
        };
        if last != Some((from.x, from.y)) {
            path.push_str(&format!("M{} {}", from.x, from.y));
        }
        path.push_str(&words);
        last = Some((to.x, to.y));
    }
    path
}

fn place(at: Point) -> (i32, i32) {
    (whole(at.0), whole(at.1))
}

fn whole(pixels: f64) -> i32 {
    (pixels * UNITS).round() as i32
}

fn hex(Rgb(red, green, blue): Rgb) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}

fn faint(opacity: f64) -> String {
    if opacity < 1.0 {
        format!(" opacity=\"{opacity}\"")
    } else {
        String::new()
    }
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('"', "&quot;");
    text.replace('<', "&lt;").replace('>', "&gt;")
}
