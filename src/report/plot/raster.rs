//! Pictures as PNG.
//!
//! plotters' bitmap backend blends the pixels; how much of a pixel a line or circle covers is
//! computed here, since the backend smooths only lines of one pixel on whole coordinates.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use plotters::prelude::{BitMapBackend, DrawingBackend};
use plotters::style::{Color as _, RGBAColor};

use super::super::ReportError;
use super::drawing::{Drawing, Point, Shape, Stroke, ring_hole};
use super::font;
use super::palette::{Color, WHITE};

/// The picture as the bytes of a PNG file.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn or encoded.
pub fn render_png(drawing: &Drawing) -> Result<Vec<u8>, ReportError> {
    font::check()?;
    let pixels = render_pixels(drawing)?;
    encode(drawing, &pixels).map_err(|error| ReportError::Picture {
        picture: drawing.description.clone(),
        problem: error.to_string(),
    })
}

/// Effort of the compression, 0 to 9: the first level takes a fifth of the usual sixth's time, which was
/// the largest part of a report's, for files a fifth larger.
const EFFORT: u32 = 1;

fn encode(drawing: &Drawing, pixels: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, drawing.width, drawing.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_chunk(png::chunk::IDAT, &compressed(drawing.width, pixels)?)?;
    writer.finish()?;
    Ok(bytes)
}

/// The image data of a PNG file: each line as its difference from the line above ("up", filter 2), for flat
/// colours compress best so.
fn compressed(width: u32, pixels: &[u8]) -> std::io::Result<Vec<u8>> {
    let length = 3 * width as usize;
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(EFFORT));
    let mut above = vec![0; length];
    let mut filtered = vec![2; length + 1];
    for line in pixels.chunks_exact(length) {
        let differences = filtered.iter_mut().skip(1).zip(line.iter().zip(&above));
        differences.for_each(|(out, (here, over))| *out = here.wrapping_sub(*over));
        encoder.write_all(&filtered)?;
        above.copy_from_slice(line);
    }
    encoder.finish()
}

/// Red, green and blue of every pixel, line by line.
fn render_pixels(drawing: &Drawing) -> Result<Vec<u8>, ReportError> {
    let size = (drawing.width, drawing.height);
    let mut pixels = vec![255; 3 * drawing.width as usize * drawing.height as usize];
    let failed = |problem: String| ReportError::Picture {
        picture: drawing.description.clone(),
        problem,
    };
    {
        let mut canvas = Canvas {
            backend: BitMapBackend::with_buffer(&mut pixels, size),
            failure: None,
        };
        for shape in &drawing.shapes {
            canvas.shape(shape);
        }
        if let Err(error) = canvas.backend.present() {
            return Err(failed(error.to_string()));
        }
        if let Some(problem) = canvas.failure {
            return Err(failed(problem));
        }
    }
    Ok(pixels)
}

struct Canvas<'a> {
    backend: BitMapBackend<'a>,
    failure: Option<String>,
}

impl Canvas<'_> {
    fn shape(&mut self, shape: &Shape) {
        match shape {
            Shape::Line { points, stroke } => self.stroke(points, *stroke),
            Shape::Rectangle {
                from,
                to,
                color,
                opacity,
            } => self.rectangle(*from, *to, *color, *opacity),
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
                self.dot(*center, *radius, *color);
                self.dot(*center, ring_hole(*radius), WHITE);
            }
            Shape::Text(text) => {
                font::cover(text, |x, y, coverage| {
                    self.blend(x, y, text.color, coverage)
                });
            }
        }
    }

    fn blend(&mut self, x: i32, y: i32, color: Color, alpha: f64) {
        if alpha <= 0.003 {
            return;
        }
        let color = RGBAColor(color.0, color.1, color.2, alpha.min(1.0));
        let pixel = color.to_backend_color();
        if let Err(error) = self.backend.draw_pixel((x, y), pixel) {
            self.failure = Some(error.to_string());
        }
    }

    fn rectangle(&mut self, from: Point, to: Point, color: Color, opacity: f64) {
        let corner = |point: Point| (point.0.round() as i32, point.1.round() as i32);
        let (upper, lower) = (corner(from), corner(to));
        if lower.0 <= upper.0 || lower.1 <= upper.1 {
            return;
        }
        let style = RGBAColor(color.0, color.1, color.2, opacity);
        let last = (lower.0 - 1, lower.1 - 1);
        if let Err(error) = self.backend.draw_rect(upper, last, &style, true) {
            self.failure = Some(error.to_string());
        }
    }

    fn dot(&mut self, center: Point, radius: f64, color: Color) {
        let reach = radius + 1.0;
        let range = |middle: f64| (middle - reach).floor() as i32..=(middle + reach).ceil() as i32;
        for y in range(center.1) {
            for x in range(center.0) {
                let distance = length(f64::from(x) + 0.5 - center.0, f64::from(y) + 0.5 - center.1);
                self.blend(x, y, color, (radius + 0.5 - distance).clamp(0.0, 1.0));
            }
        }
    }

    /// Draws a line. Coverage is collected over all of its pieces first, so that the joints of a
    /// translucent line are not drawn twice.
    fn stroke(&mut self, points: &[Point], stroke: Stroke) {
        let Some(mut mask) = Mask::around(points, stroke.width, self.backend.get_size()) else {
            return;
        };
        for pair in points.windows(2) {
            if let [from, to] = pair {
                mask.segment(*from, *to, stroke.width / 2.0);
            }
        }
        for y in 0..mask.height {
            for x in 0..mask.width {
                let coverage = mask.coverage[(y * mask.width + x) as usize];
                if coverage > 0 {
                    let alpha = f64::from(coverage) / FULL * stroke.opacity;
                    self.blend(mask.left + x, mask.top + y, stroke.color, alpha);
                }
            }
        }
    }
}

/// A pixel that is covered wholly, in the steps that a colour has.
const FULL: f64 = 255.0;

/// How much of each pixel in a rectangle a line covers, 0 to [`FULL`].
struct Mask {
    left: i32,
    top: i32,
    width: i32,
    height: i32,
    coverage: Vec<u8>,
}

impl Mask {
    /// An empty mask around points, cut to the picture; `None` where nothing of it is visible.
    fn around(points: &[Point], line_width: f64, size: (u32, u32)) -> Option<Mask> {
        let reach = line_width / 2.0 + 1.0;
        let bounds = |pick: fn(&Point) -> f64, limit: u32| {
            let low = points.iter().map(pick).fold(f64::INFINITY, f64::min) - reach;
            let high = points.iter().map(pick).fold(f64::NEG_INFINITY, f64::max) + reach;
            let limit = f64::from(limit);
            let finite = low.is_finite() && high.is_finite();
            let (low, high) = (low.floor().clamp(0.0, limit), high.ceil().clamp(0.0, limit));
            (finite && low < high).then_some((low as i32, high as i32))
        };
        let (left, right) = bounds(|point| point.0, size.0)?;
        let (top, bottom) = bounds(|point| point.1, size.1)?;
        let (width, height) = (right - left, bottom - top);
        Some(Mask {
            left,
            top,
            width,
            height,
            coverage: vec![0; width as usize * height as usize],
        })
    }

    /// Adds a straight piece with round ends, walking along its longer direction.
    fn segment(&mut self, from: Point, to: Point, half_width: f64) {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length2 = dx * dx + dy * dy;
        let steep = dy.abs() > dx.abs();
        let (major, minor) = if steep { (dy, dx) } else { (dx, dy) };
        let (major_start, minor_start) = if steep {
            (from.1, from.0)
        } else {
            (from.0, from.1)
        };
        let slope = if major == 0.0 { 0.0 } else { minor / major };
        let reach = (half_width + 0.5) * (1.0 + slope * slope).sqrt() + 1.0;
        let ends = (
            major_start.min(major_start + major),
            major_start.max(major_start + major),
        );
        let first = (ends.0 - half_width - 1.0).floor() as i32;
        let last = (ends.1 + half_width + 1.0).ceil() as i32;
        for step in first..=last {
            let along = (f64::from(step) + 0.5).clamp(ends.0, ends.1);
            let middle = minor_start + (along - major_start) * slope;
            for side in (middle - reach).floor() as i32..=(middle + reach).floor() as i32 {
                let (x, y) = if steep { (side, step) } else { (step, side) };
                let (px, py) = (f64::from(x) + 0.5 - from.0, f64::from(y) + 0.5 - from.1);
                let share = if length2 > 0.0 {
                    ((px * dx + py * dy) / length2).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let distance = length(px - share * dx, py - share * dy);
                self.raise(x, y, (half_width + 0.5 - distance).clamp(0.0, 1.0));
            }
        }
    }

    fn raise(&mut self, x: i32, y: i32, coverage: f64) {
        let (x, y) = (x - self.left, y - self.top);
        if (0..self.width).contains(&x) && (0..self.height).contains(&y) {
            let cell = &mut self.coverage[(y * self.width + x) as usize];
            *cell = (*cell).max((FULL * coverage).round() as u8);
        }
    }
}

/// Length of a difference of places: pixels are far from where squares overflow, which `hypot` guards
/// against at four times the price.
fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}
