//! A picture as a list of shapes: drawn once, then written as pixels or as SVG.

use super::font::{self, Weight};
use super::palette::{Color, INK, WHITE};

/// A position in the picture (pixels from the upper left corner).
pub type Point = (f64, f64);

/// A finished picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// What the picture shows, for readers who cannot see it.
    pub description: String,
    /// Width (pixels).
    pub width: u32,
    /// Height (pixels).
    pub height: u32,
    /// Shapes in the order in which they cover each other.
    pub shapes: Vec<Shape>,
    /// What places say to a pointer, where the picture stands in a page; later ones cover earlier ones.
    pub notes: Vec<Note>,
}

/// What a place in the picture says.
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
        /// How it is drawn.
        stroke: Stroke,
    },
    /// A filled rectangle.
    Rectangle {
        /// Upper left corner.
        from: Point,
        /// Lower right corner.
        to: Point,
        /// Fill.
        color: Color,
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
        color: Color,
    },
    /// A circle with paper inside.
    Ring {
        /// Centre.
        center: Point,
        /// Outer radius (pixels).
        radius: f64,
        /// Colour of the line.
        color: Color,
    },
    /// Text.
    Text(Text),
}

/// Inner radius of a ring (pixels): its line is two pixels wide.
pub(super) fn ring_hole(radius: f64) -> f64 {
    (radius - 2.0).max(1.0)
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Colour.
    pub color: Color,
    /// Width (pixels).
    pub width: f64,
    /// 0 to 1.
    pub opacity: f64,
}

impl Stroke {
    /// An opaque line.
    pub fn new(color: Color, width: f64) -> Stroke {
        Stroke {
            color,
            width,
            opacity: 1.0,
        }
    }
}

/// A piece of text, its middle line on `at`.
#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    /// The words.
    pub text: String,
    /// Where.
    pub at: Point,
    /// Which end of the text lies at `at`.
    pub align: Align,
    /// Size of the letters (pixels per em).
    pub size: f64,
    /// Weight.
    pub weight: Weight,
    /// Colour.
    pub color: Color,
    /// Reading direction.
    pub direction: Direction,
}

/// Which end of a text lies at its position.
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

impl Text {
    /// Dark regular text that begins at `at`.
    pub fn new(text: impl Into<String>, at: Point, size: f64) -> Text {
        Text {
            text: text.into(),
            at,
            align: Align::Start,
            size,
            weight: Weight::Regular,
            color: INK,
            direction: Direction::Across,
        }
    }

    /// The same, aligned otherwise.
    pub fn aligned(mut self, align: Align) -> Text {
        self.align = align;
        self
    }

    /// The same in another colour.
    pub fn colored(mut self, color: Color) -> Text {
        self.color = color;
        self
    }

    /// The same in bold.
    pub fn bold(mut self) -> Text {
        self.weight = Weight::Bold;
        self
    }

    /// The same, read upwards.
    pub fn upwards(mut self) -> Text {
        self.direction = Direction::Upwards;
        self
    }

    /// Width of the words (pixels).
    pub fn width(&self) -> f64 {
        font::text_width(&self.text, self.size, self.weight)
    }
}

impl Drawing {
    /// An empty white picture.
    pub fn new(description: impl Into<String>, width: u32, height: u32) -> Drawing {
        let paper = Shape::Rectangle {
            from: (0.0, 0.0),
            to: (f64::from(width), f64::from(height)),
            color: WHITE,
            opacity: 1.0,
        };
        Drawing {
            description: description.into(),
            width,
            height,
            shapes: vec![paper],
            notes: Vec::new(),
        }
    }

    /// Adds a line; one with fewer than two points is left out.
    pub fn line(&mut self, points: Vec<Point>, stroke: Stroke) {
        if points.len() > 1 {
            self.shapes.push(Shape::Line { points, stroke });
        }
    }

    /// Adds a broken line of dashes and gaps (pixels) from one point to another.
    pub fn dashed(&mut self, from: Point, to: Point, pattern: (f64, f64), stroke: Stroke) {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy);
        let period = pattern.0 + pattern.1;
        if !(length > 0.0 && period > 1.0) {
            return;
        }
        let at = |distance: f64| {
            let share = (distance / length).min(1.0);
            (from.0 + share * dx, from.1 + share * dy)
        };
        for dash in 0..(length / period).ceil() as usize {
            let start = dash as f64 * period;
            self.line(vec![at(start), at(start + pattern.0)], stroke);
        }
    }

    /// Adds a filled rectangle.
    pub fn rectangle(&mut self, from: Point, to: Point, color: Color, opacity: f64) {
        self.shapes.push(Shape::Rectangle {
            from,
            to,
            color,
            opacity,
        });
    }

    /// Adds a filled circle.
    pub fn dot(&mut self, center: Point, radius: f64, color: Color) {
        self.shapes.push(Shape::Dot {
            center,
            radius,
            color,
        });
    }

    /// Adds a ring: a circle with white inside.
    pub fn ring(&mut self, center: Point, radius: f64, color: Color) {
        self.shapes.push(Shape::Ring {
            center,
            radius,
            color,
        });
    }

    /// Adds a diagonal cross.
    pub fn cross(&mut self, center: Point, radius: f64, stroke: Stroke) {
        let (x, y) = center;
        self.line(
            vec![(x - radius, y - radius), (x + radius, y + radius)],
            stroke,
        );
        self.line(
            vec![(x - radius, y + radius), (x + radius, y - radius)],
            stroke,
        );
    }

    /// Lets a rectangle say something to a pointer.
    pub fn note(&mut self, from: Point, to: Point, words: impl Into<String>) {
        let words = words.into();
        self.notes.push(Note { from, to, words });
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
        self.shapes
            .iter()
            .filter_map(|shape| match shape {
                Shape::Text(text) => Some(text.text.as_str()),
                _ => None,
            })
            .collect()
    }
}
