//! A picture as a list of shapes in pixels, and the embedded font in which its words are set.
//!
//! Letters are placed here and not by plotters: its text leaves out the space before a letter and
//! rounds every letter to whole pixels, which small axis labels show.

use std::sync::OnceLock;

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};

use crate::ReportError;

/// A position in the picture (pixels from the upper left corner).
pub type Point = (f64, f64);

/// A colour: red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rgb(pub u8, pub u8, pub u8);

/// The paper.
pub const WHITE: Rgb = Rgb(255, 255, 255);

/// A finished picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// Words for readers who cannot see the picture.
    pub description: String,
    /// Width (pixels).
    pub width: u32,
    /// Height (pixels).
    pub height: u32,
    /// Shapes in the order in which they cover each other.
    pub shapes: Vec<Shape>,
    /// Words that a browser shows at a place; later ones cover earlier ones.
    pub notes: Vec<Note>,
}

/// Words that a browser shows while the pointer is inside a rectangle.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// Upper left corner.
    pub from: Point,
    /// Lower right corner.
    pub to: Point,
    /// The words.
    pub words: String,
}

/// One thing in a picture.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A line through points.
    Line {
        /// The points.
        points: Vec<Point>,
        /// Its look.
        stroke: Stroke,
    },
    /// A filled polygon.
    Area {
        /// The corners.
        points: Vec<Point>,
        /// Fill.
        color: Rgb,
        /// 0 to 1.
        opacity: f64,
    },
    /// A filled rectangle.
    Rectangle {
        /// Upper left corner.
        from: Point,
        /// Lower right corner.
        to: Point,
        /// Fill.
        color: Rgb,
        /// 0 to 1.
        opacity: f64,
    },
    /// A filled circle.
    Dot {
        /// Centre.
        center: Point,
        /// Radius (pixels).
        radius: f64,
        /// Fill.
        color: Rgb,
    },
    /// A circle with paper inside; its line is two pixels wide.
    Ring {
        /// Centre.
        center: Point,
        /// Outer radius (pixels).
        radius: f64,
        /// Colour of the line.
        color: Rgb,
    },
    /// Text.
    Text(Text),
}

/// Inner radius of a ring (pixels).
pub(super) fn ring_hole(radius: f64) -> f64 {
    (radius - 2.0).max(1.0)
}

/// Look of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Colour.
    pub color: Rgb,
    /// Width (pixels).
    pub width: f64,
    /// 0 to 1.
    pub opacity: f64,
}

impl Stroke {
    /// An opaque line.
    pub fn new(color: Rgb, width: f64) -> Stroke {
        Stroke {
            color,
            width,
            opacity: 1.0,
        }
    }

    /// The line with another opacity.
    pub fn faint(self, opacity: f64) -> Stroke {
        Stroke { opacity, ..self }
    }
}

/// A piece of text, its middle line on `at`.
#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    /// The words.
    pub text: String,
    /// Its place.
    pub at: Point,
    /// The end of the text that lies at `at`.
    pub align: Align,
    /// Size of the letters (pixels per em).
    pub size: f64,
    /// Weight.
    pub weight: Weight,
    /// Colour.
    pub color: Rgb,
    /// Reading direction.
    pub direction: Direction,
}

/// The end of a text that lies at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// The text begins there.
    Start,
    /// It is centred there.
    Middle,
    /// It ends there.
    End,
}

/// Reading direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Left to right.
    Across,
    /// From the bottom to the top.
    Upwards,
}

/// Weight of letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// Regular.
    Regular,
    /// Bold.
    Bold,
}

impl Text {
    /// Regular text that begins at `at`.
    pub fn new(text: impl Into<String>, at: Point, size: f64, color: Rgb) -> Text {
        Text {
            text: text.into(),
            at,
            align: Align::Start,
            size,
            weight: Weight::Regular,
            color,
            direction: Direction::Across,
        }
    }

    /// The text with another end at its position.
    pub fn aligned(mut self, align: Align) -> Text {
        self.align = align;
        self
    }

    /// The text in bold.
    pub fn bold(mut self) -> Text {
        self.weight = Weight::Bold;
        self
    }

    /// The text read upwards.
    pub fn upwards(mut self) -> Text {
        self.direction = Direction::Upwards;
        self
    }

    /// Width of the words (pixels).
    pub fn width(&self) -> f64 {
        text_width(&self.text, self.size, self.weight)
    }

    /// Distance from the position to where the text begins (pixels, 0 or less).
    fn start(&self) -> f64 {
        match self.align {
            Align::Start => 0.0,
            Align::Middle => -0.5 * self.width(),
            Align::End => -self.width(),
        }
    }

    /// Calls `paint(x, y, coverage)` for every pixel of the text.
    pub(super) fn cover(&self, mut paint: impl FnMut(i32, i32, f64)) {
        let Some(face) = face(self.weight) else {
            return;
        };
        let scale = scale(face, self.size);
        let scaled = face.as_scaled(scale);
        let baseline = BASELINE * self.size;
        // Across, letters sit where they belong and the baseline on a whole pixel, which keeps the
        // horizontal strokes crisp; upwards, the same after the turn.
        let (origin, along) = match self.direction {
            Direction::Across => (self.at.1 + baseline, self.at.0 + self.start()),
            Direction::Upwards => (self.at.0 + baseline, -self.at.1 + self.start()),
        };
        let mut pen = along as f32;
        let mut previous = None;
        for letter in self.text.chars() {
            let id = face.glyph_id(letter);
            pen += previous.map_or(0.0, |last| scaled.kern(last, id));
            previous = Some(id);
            let glyph = id.with_scale_and_position(scale, point(pen, origin.round() as f32));
            if let Some(outline) = face.outline_glyph(glyph) {
                let corner = outline.px_bounds().min;
                outline.draw(|x, y, coverage| {
                    let (x, y) = (corner.x as i32 + x as i32, corner.y as i32 + y as i32);
                    match self.direction {
                        Direction::Across => paint(x, y, f64::from(coverage)),
                        Direction::Upwards => paint(y, -x - 1, f64::from(coverage)),
                    }
                });
            }
            pen += scaled.h_advance(id);
        }
    }
}

impl Drawing {
    /// An empty white picture, whose height is not known yet.
    pub fn new(description: &str, width: u32) -> Drawing {
        Drawing {
            description: description.to_owned(),
            width,
            height: 0,
            shapes: vec![Shape::Rectangle {
                from: (0.0, 0.0),
                to: (f64::from(width), 0.0),
                color: WHITE,
                opacity: 1.0,
            }],
            notes: Vec::new(),
        }
    }

    /// Ends the picture and its paper at a height (pixels).
    pub fn end_at(&mut self, bottom: f64) {
        self.height = bottom.ceil() as u32;
        if let Some(Shape::Rectangle { to, .. }) = self.shapes.first_mut() {
            to.1 = f64::from(self.height);
        }
    }

    /// Adds a line; one with fewer than two points is left out.
    pub fn line(&mut self, points: Vec<Point>, stroke: Stroke) {
        if points.len() > 1 {
            self.shapes.push(Shape::Line { points, stroke });
        }
    }

    /// Adds a broken line of dashes and gaps (pixels) from one point to another.
    pub fn dashed(&mut self, from: Point, to: Point, dash: f64, gap: f64, stroke: Stroke) {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy);
        let mut start = 0.0;
        while start < length {
            let ends = [start, start + dash].map(|distance| {
                let share = (distance / length).min(1.0);
                (from.0 + share * dx, from.1 + share * dy)
            });
            self.line(ends.to_vec(), stroke);
            start += dash + gap;
        }
    }

    /// Adds a filled rectangle.
    pub fn rectangle(&mut self, from: Point, to: Point, color: Rgb, opacity: f64) {
        self.shapes.push(Shape::Rectangle {
            from,
            to,
            color,
            opacity,
        });
    }

    /// Adds a filled circle.
    pub fn dot(&mut self, center: Point, radius: f64, color: Rgb) {
        self.shapes.push(Shape::Dot {
            center,
            radius,
            color,
        });
    }

    /// Adds a diagonal cross.
    pub fn cross(&mut self, center: Point, radius: f64, stroke: Stroke) {
        let (x, y) = center;
        for rise in [-radius, radius] {
            let ends = vec![(x - radius, y + rise), (x + radius, y - rise)];
            self.line(ends, stroke);
        }
    }

    /// Adds text.
    pub fn text(&mut self, text: Text) {
        self.shapes.push(Shape::Text(text));
    }

    /// Adds text, aligned in the middle, on a patch of paper that hides the lines behind it.
    pub fn text_on_paper(&mut self, text: Text) {
        let (x, y) = text.at;
        let (reach, rise) = (text.width() / 2.0 + 3.0, 0.6 * text.size);
        self.rectangle((x - reach, y - rise), (x + reach, y + rise), WHITE, 0.9);
        self.text(text.aligned(Align::Middle));
    }

    /// All words of the picture, for tests.
    pub fn words(&self) -> Vec<&str> {
        let words = self.shapes.iter().filter_map(|shape| match shape {
            Shape::Text(text) => Some(text.text.as_str()),
            _ => None,
        });
        words.collect()
    }
}

/// Distance of the letters' baseline below the middle line (em): half the height of capitals, 0.73 em in
/// this font.
pub(super) const BASELINE: f64 = 0.365;

static REGULAR: &[u8] = include_bytes!("../assets/DejaVuSans-sub.ttf");
static BOLD: &[u8] = include_bytes!("../assets/DejaVuSans-Bold-sub.ttf");

/// The embedded font, a subset of DejaVu Sans, read once.
pub(super) fn face(weight: Weight) -> Option<&'static FontRef<'static>> {
    static FACES: OnceLock<[Option<FontRef<'static>>; 2]> = OnceLock::new();
    let [regular, bold] =
        FACES.get_or_init(|| [REGULAR, BOLD].map(|bytes| FontRef::try_from_slice(bytes).ok()));
    match weight {
        Weight::Regular => regular.as_ref(),
        Weight::Bold => bold.as_ref(),
    }
}

/// Checks that the embedded fonts can be read.
///
/// # Errors
/// [`ReportError::Font`] if not.
pub(super) fn check_font() -> Result<(), ReportError> {
    match (face(Weight::Regular), face(Weight::Bold)) {
        (Some(_), Some(_)) => Ok(()),
        _ => Err(ReportError::Font),
    }
}

/// The font's own scale for letters of `size` pixels per em.
fn scale(face: &FontRef<'static>, size: f64) -> PxScale {
    let em = face.units_per_em().unwrap_or(1000.0);
    PxScale::from(size as f32 * face.height_unscaled() / em)
}

/// Width of a text (pixels); `size` in pixels per em.
pub fn text_width(text: &str, size: f64, weight: Weight) -> f64 {
    let Some(face) = face(weight) else {
        return 0.6 * size * text.chars().count() as f64;
    };
    let scaled = face.as_scaled(scale(face, size));
    let mut previous = None;
    let mut width = 0.0;
    for letter in text.chars() {
        let glyph = face.glyph_id(letter);
        width += scaled.h_advance(glyph) + previous.map_or(0.0, |last| scaled.kern(last, glyph));
        previous = Some(glyph);
    }
    f64::from(width)
}

/// Shortens a text with "…" before its last `kept` letters until it fits `room` (pixels).
pub fn fitted(text: &str, size: f64, weight: Weight, kept: usize, room: f64) -> String {
    let letters: Vec<char> = text.chars().collect();
    if text_width(text, size, weight) <= room || letters.len() <= kept {
        return text.to_owned();
    }
    let (head, tail) = letters.split_at(letters.len() - kept);
    let tail: String = tail.iter().collect();
    for count in (0..head.len()).rev() {
        let head: String = head[..count].iter().collect();
        let shortened = format!("{}\u{2026}{tail}", head.trim_end());
        if text_width(&shortened, size, weight) <= room {
            return shortened;
        }
    }
    tail
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_title_that_is_too_long_keeps_its_beginning_and_its_end() {
        let fitted = |title: &str| fitted(title, 18.0, Weight::Bold, 16, 1160.0);
        let title = |folders: usize| {
            let path = "measurements of the year/".repeat(folders);
            format!("Frequency and damping against amplitude, {path}visit-11.wav")
        };
        assert_eq!(fitted(&title(1)), title(1));
        let short = fitted(&title(9));
        assert!(text_width(&short, 18.0, Weight::Bold) <= 1160.0, "{short}");
        assert!(short.starts_with("Frequency and damping against amplitude, meas"));
        assert!(short.ends_with("\u{2026}ear/visit-11.wav"), "{short}");
        // As much is kept as fits.
        assert!(text_width(&short, 18.0, Weight::Bold) > 1130.0, "{short}");
    }
}
