//! Pictures as PNG.
//!
//! plotters' bitmap backend blends pixels and fills rectangles and polygons. The share of a pixel that a
//! line or circle covers is computed here, since the backend smooths only lines of one pixel on whole
//! coordinates.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use plotters::prelude::{BitMapBackend, DrawingBackend};
use plotters::style::RGBAColor;

use super::drawing::{Drawing, Point, Rgb, Shape, Stroke, WHITE, check_font, ring_hole};
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
        let Some(mut mask) = Mask::around(points, stroke.width, self.0.get_size()) else {
            return Ok(());
        };
        for pair in points.windows(2) {
            mask.segment(pair[0], pair[1], stroke.width / 2.0);
        }
        for y in 0..mask.height {
            for x in 0..mask.width {
                let coverage = mask.coverage[(y * mask.width + x) as usize];
                if coverage > 0 {
                    let alpha = f64::from(coverage) / FULL * stroke.opacity;
                    self.blend(mask.left + x, mask.top + y, stroke.color, alpha)?;
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
    /// An empty mask around points, cut to the picture; `None` where nothing of it is visible.
    fn around(points: &[Point], line_width: f64, size: (u32, u32)) -> Option<Mask> {
        let reach = line_width / 2.0 + 1.0;
        let x = points.iter().map(|point| point.0);
        let y = points.iter().map(|point| point.1);
        let (left, right) = pixels(x, reach, size.0)?;
        let (top, bottom) = pixels(y, reach, size.1)?;
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

/// First and last pixel that a line through these coordinates reaches; `None` outside of the picture.
fn pixels(places: impl Iterator<Item = f64>, reach: f64, size: u32) -> Option<(i32, i32)> {
    let (low, high) = super::axis::extent(places)?;
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
