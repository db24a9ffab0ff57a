//! Drawings as files: PNG, SVG, and SVG inside an HTML page.
//!
//! plotters' bitmap backend blends pixels and fills rectangles and polygons. The share of a pixel that a
//! line or circle covers is computed here, since the backend smooths only lines of one pixel on whole
//! coordinates.
//!
//! Inside a page an SVG has text in the reader's fonts. A file of its own has letters that are outlines of the
//! embedded font, and so needs none.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write;

use ab_glyph::{Font, OutlineCurve};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use plotters::prelude::{BitMapBackend, DrawingBackend};
use plotters::style::RGBAColor;

use super::drawing::{
    Align, BASELINE, Direction, Drawing, Point, Rgb, Shape, Stroke, Text, WHITE, Weight,
    check_font, face, ring_hole,
};
use crate::ReportError;

/// The picture as the bytes of a PNG file.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn or encoded.
pub fn render_png(drawing: &Drawing) -> Result<Vec<u8>, ReportError> {
    check_font()?;
    let size = (drawing.width, drawing.height);
    let mut pixels = vec![255; 3 * drawing.width as usize * drawing.height as usize];
    let drawn = {
        let mut canvas = Canvas(BitMapBackend::with_buffer(&mut pixels, size));
        let mut shapes = drawing.shapes.iter();
        shapes.try_for_each(|shape| canvas.shape(shape))
    };
    let encoded = drawn.and_then(|()| encode(drawing, &pixels).map_err(|error| error.to_string()));
    encoded.map_err(|problem| ReportError::Picture {
        picture: drawing.description.clone(),
        problem,
    })
}

/// Effort of the compression, 0 to 9: the first level takes a fifth of the usual sixth's time, which was
/// the largest part of a report's, for files a fifth larger.
const EFFORT: u32 = 1;

fn encode(drawing: &Drawing, pixels: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    // Each line as its difference from the line above ("up", filter 2): flat colours compress best so.
    let length = 3 * drawing.width as usize;
    let mut deflated = ZlibEncoder::new(Vec::new(), Compression::new(EFFORT));
    let mut above = vec![0; length];
    for line in pixels.chunks_exact(length) {
        let differences = line.iter().zip(&above);
        let differences = differences.map(|(here, over)| here.wrapping_sub(*over));
        let filtered: Vec<u8> = std::iter::once(2).chain(differences).collect();
        deflated.write_all(&filtered)?;
        above.copy_from_slice(line);
    }
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, drawing.width, drawing.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_chunk(png::chunk::IDAT, &deflated.finish()?)?;
    writer.finish()?;
    Ok(bytes)
}

fn ink(color: Rgb, opacity: f64) -> RGBAColor {
    RGBAColor(color.0, color.1, color.2, opacity.min(1.0))
}

fn pixel(at: Point) -> (i32, i32) {
    (at.0.round() as i32, at.1.round() as i32)
}

struct Canvas<'a>(BitMapBackend<'a>);

impl Canvas<'_> {
    fn shape(&mut self, shape: &Shape) -> Result<(), String> {
        match shape {
            Shape::Line { points, stroke } => self.stroke(points, *stroke),
            Shape::Area {
                points,
                color,
                opacity,
            } => {
                let corners: Vec<(i32, i32)> = points.iter().copied().map(pixel).collect();
                let filled = self.0.fill_polygon(corners, &ink(*color, *opacity));
                filled.map_err(|error| error.to_string())
            }
            Shape::Rectangle {
                from,
                to,
                color,
                opacity,
            } => {
                let ((left, top), (right, bottom)) = (pixel(*from), pixel(*to));
                if right <= left || bottom <= top {
                    return Ok(());
                }
                let last = (right - 1, bottom - 1);
                let style = ink(*color, *opacity);
                let filled = self.0.draw_rect((left, top), last, &style, true);
                filled.map_err(|error| error.to_string())
            }
            Shape::Dot {
                center,
                radius,
                color,
            } => self.dot(*center, *radius, *color),
            Shape::Ring {
                center,
                radius,
                color,
            } => {
                self.dot(*center, *radius, *color)?;
                self.dot(*center, ring_hole(*radius), WHITE)
            }
            Shape::Text(text) => {
                let mut drawn = Ok(());
                text.cover(|x, y, coverage| {
                    if drawn.is_ok() {
                        drawn = self.blend(x, y, text.color, coverage);
                    }
                });
                drawn
            }
        }
    }

    fn blend(&mut self, x: i32, y: i32, color: Rgb, alpha: f64) -> Result<(), String> {
        if alpha <= 0.003 {
            return Ok(());
        }
        let style = plotters::style::Color::to_backend_color(&ink(color, alpha));
        let drawn = self.0.draw_pixel((x, y), style);
        drawn.map_err(|error| error.to_string())
    }

    fn dot(&mut self, center: Point, radius: f64, color: Rgb) -> Result<(), String> {
        let reach = radius + 1.0;
        let [columns, rows] = [center.0, center.1]
            .map(|middle| (middle - reach).floor() as i32..=(middle + reach).ceil() as i32);
        for y in rows {
            for x in columns.clone() {
                let distance = length(f64::from(x) + 0.5 - center.0, f64::from(y) + 0.5 - center.1);
                self.blend(x, y, color, (radius + 0.5 - distance).clamp(0.0, 1.0))?;
            }
        }
        Ok(())
    }

    /// Draws a line. Coverage is collected over all of its pieces first, so that the joints of a
    /// translucent line are not drawn twice.
    fn stroke(&mut self, points: &[Point], stroke: Stroke) -> Result<(), String> {
        let reach = stroke.width / 2.0 + 1.0;
        let (width, height) = self.0.get_size();
        let columns = pixels(points.iter().map(|point| point.0), reach, width);
        let rows = pixels(points.iter().map(|point| point.1), reach, height);
        let Some((columns, rows)) = columns.zip(rows) else {
            return Ok(());
        };
        let (width, height) = (columns.1 - columns.0, rows.1 - rows.0);
        let mut mask = Mask {
            left: columns.0,
            top: rows.0,
            width,
            height,
            coverage: vec![0; width as usize * height as usize],
        };
        for pair in points.windows(2) {
            mask.segment(pair[0], pair[1], stroke.width / 2.0);
        }
        for (y, line) in (mask.top..).zip(mask.coverage.chunks_exact(width as usize)) {
            for (x, &coverage) in (mask.left..).zip(line) {
                if coverage > 0 {
                    let alpha = f64::from(coverage) / FULL * stroke.opacity;
                    self.blend(x, y, stroke.color, alpha)?;
                }
            }
        }
        Ok(())
    }
}

/// A pixel that is covered wholly, in the steps that a colour has.
const FULL: f64 = 255.0;

/// Coverage of each pixel in a rectangle by a line, 0 to [`FULL`].
struct Mask {
    left: i32,
    top: i32,
    width: i32,
    height: i32,
    coverage: Vec<u8>,
}

impl Mask {
    /// Adds a straight piece with round ends, walking along its longer direction.
    fn segment(&mut self, from: Point, to: Point, half_width: f64) {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length2 = dx * dx + dy * dy;
        let steep = dy.abs() > dx.abs();
        let (start, end, across, rise) = if steep {
            (from.1, to.1, from.0, dx)
        } else {
            (from.0, to.0, from.1, dy)
        };
        let slope = if start == end {
            0.0
        } else {
            rise / (end - start)
        };
        let reach = (half_width + 0.5) * (1.0 + slope * slope).sqrt() + 1.0;
        let (low, high) = (start.min(end), start.max(end));
        let first = (low - half_width - 1.0).floor() as i32;
        let last = (high + half_width + 1.0).ceil() as i32;
        for step in first..=last {
            let along = (f64::from(step) + 0.5).clamp(low, high);
            let middle = across + (along - start) * slope;
            for side in (middle - reach).floor() as i32..=(middle + reach).floor() as i32 {
                let (x, y) = if steep { (side, step) } else { (step, side) };
                let (px, py) = (f64::from(x) + 0.5 - from.0, f64::from(y) + 0.5 - from.1);
                let share = if length2 > 0.0 {
                    ((px * dx + py * dy) / length2).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let distance = length(px - share * dx, py - share * dy);
                let coverage = (half_width + 0.5 - distance).min(1.0);
                let (x, y) = (x - self.left, y - self.top);
                if coverage > 0.0 && (0..self.width).contains(&x) && (0..self.height).contains(&y) {
                    let cell = &mut self.coverage[(y * self.width + x) as usize];
                    // To the nearest step: without SSE 4.1 `round` is a call.
                    *cell = (*cell).max((FULL * coverage + 0.5) as u8);
                }
            }
        }
    }
}

/// First and last pixel that a line through these coordinates reaches; `None` outside of the picture.
fn pixels(places: impl Iterator<Item = f64>, reach: f64, size: u32) -> Option<(i32, i32)> {
    let (low, high) = super::extent(places)?;
    let limit = f64::from(size);
    let low = (low - reach).floor().clamp(0.0, limit);
    let high = (high + reach).ceil().clamp(0.0, limit);
    (low < high).then_some((low as i32, high as i32))
}

/// Length of a difference of places: pixels are far from where squares overflow, which `hypot` guards
/// against at four times the price.
fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// Units of the SVG per pixel: whole numbers are short, a quarter of a pixel is fine enough for smooth curves.
const UNITS: f64 = 4.0;

/// The picture as an `<svg>` element without fixed size, which fills the width it is given. A name
/// space is not needed inside HTML, a description for screen readers is. Its notes are titles, which
/// browsers show without any script.
pub fn render_svg(drawing: &Drawing) -> String {
    let mut body = elements(drawing, None);
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
    let mut used = BTreeMap::new();
    let body = elements(drawing, Some(&mut used));
    let outlines = used.iter();
    let outlines = outlines.map(|(name, path)| format!("<path id=\"{name}\" d=\"{path}\"/>\n"));
    let outlines: String = outlines.collect();
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
fn elements(drawing: &Drawing, mut outlines: Option<&mut BTreeMap<String, String>>) -> String {
    let mut all = String::new();
    // Neighbours only are merged, so that what covers what stays.
    let groups = (drawing.shapes)
        .chunk_by(|one, other| look(one).is_some_and(|own| look(other) == Some(own)));
    for group in groups {
        match (group, outlines.as_mut()) {
            ([Shape::Text(text)], Some(outlines)) => all.push_str(&outlined(text, outlines)),
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

/// Kind, colour, size and opacity of what may share a path with its like; `None` for text.
fn look(shape: &Shape) -> Option<(&'static str, Rgb, f64, f64)> {
    Some(match shape {
        Shape::Line { stroke, .. } => ("line", stroke.color, stroke.width, stroke.opacity),
        Shape::Rectangle { color, opacity, .. } | Shape::Area { color, opacity, .. } => {
            ("area", *color, 0.0, *opacity)
        }
        Shape::Dot { color, radius, .. } => ("dot", *color, *radius, 1.0),
        Shape::Ring { color, radius, .. } => ("ring", *color, *radius, 1.0),
        Shape::Text(_) => return None,
    })
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

/// Appends a shape's outline.
fn trace(path: &mut String, shape: &Shape) {
    match shape {
        Shape::Line { points, .. } => polyline(path, points),
        Shape::Area { points, .. } => {
            polyline(path, points);
            path.push('z');
        }
        Shape::Rectangle { from, to, .. } => {
            let ((left, top), (right, bottom)) = (place(*from), place(*to));
            let (wide, high) = (right - left, bottom - top);
            path.push_str(&format!("M{left} {top}h{wide}v{high}h{}z", -wide));
        }
        // Not quite without length: some readers leave out what has none.
        Shape::Dot { center, .. } => {
            let (x, y) = place(*center);
            path.push_str(&format!("M{x} {y}h.1"));
        }
        Shape::Ring { center, radius, .. } => {
            let middle = whole(0.5 * (radius + ring_hole(*radius)));
            let (x, y) = place(*center);
            let (left, wide) = (x - middle, 2 * middle);
            path.push_str(&format!(
                "M{left} {y}a{middle} {middle} 0 1 0 {wide} 0a{middle} {middle} 0 1 0-{wide} 0"
            ));
        }
        Shape::Text(_) => {}
    }
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
        // A string takes everything.
        let _ = write!(path, "{before}{dx}{between}{dy}");
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

/// A text as references to its letters' outlines: each is defined once, under a name, and used wherever it stands.
fn outlined(text: &Text, outlines: &mut BTreeMap<String, String>) -> String {
    let Some(face) = face(text.weight) else {
        return String::new();
    };
    let weight = match text.weight {
        Weight::Regular => 'r',
        Weight::Bold => 'b',
    };
    let em = f64::from(face.units_per_em().unwrap_or(1000.0));
    let scale = text.size * UNITS / em;
    let (mut uses, mut pen, mut previous) = (String::new(), 0.0, None);
    for letter in text.text.chars() {
        let id = face.glyph_id(letter);
        pen += previous.map_or(0.0, |last| face.kern_unscaled(last, id));
        previous = Some(id);
        let name = format!("{weight}{}", id.0);
        if !outlines.contains_key(&name)
            && let Some(outline) = face.outline(id)
        {
            outlines.insert(name.clone(), outline_path(&outline.curves));
        }
        // Spaces have no outline.
        if outlines.contains_key(&name) {
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
