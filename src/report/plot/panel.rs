//! A rectangle with axes in which curves are drawn.

use super::axis::{Axis, Tick};
use super::decimate::decimate;
use super::drawing::{Align, Drawing, Point, Stroke, Text};
use super::font::{Weight, fitted, fitted_before_end};
use super::palette::{Color, GRID, INK, SOFT};

/// Size of tick labels (pixels per em).
pub const TICK_SIZE: f64 = 13.0;
/// Least distance of labels on a horizontal axis (pixels).
pub const X_SPACING: f64 = 90.0;
/// Size of axis titles (pixels per em).
pub const LABEL_SIZE: f64 = 14.0;

/// Two axes; `y.from` is the lower edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel {
    /// Horizontal.
    pub x: Axis,
    /// Vertical.
    pub y: Axis,
}

impl Panel {
    /// Pixel of a pair of values.
    pub fn place(&self, x: f64, y: f64) -> Point {
        (self.x.place(x), self.y.place(y))
    }

    /// Grid lines, ticks with labels, and the frame.
    pub fn draw_axes(&self, drawing: &mut Drawing) {
        self.draw_x_ticks(drawing, &self.x.ticks(X_SPACING));
        self.draw_y_ticks(drawing, &self.y.ticks(46.0));
        self.draw_frame(drawing);
    }

    /// Grid and labels of the horizontal axis.
    pub fn draw_x_ticks(&self, drawing: &mut Drawing, ticks: &[Tick]) {
        for tick in ticks {
            let x = crisp(self.x.place(tick.value));
            if let Some(label) = &tick.label {
                self.draw_grid_line(drawing, (x, self.y.from), (x, self.y.to));
                drawing.text(
                    Text::new(label.as_str(), (x, self.y.from + 15.0), TICK_SIZE)
                        .aligned(Align::Middle),
                );
            }
        }
    }

    /// Grid and labels of the vertical axis.
    pub fn draw_y_ticks(&self, drawing: &mut Drawing, ticks: &[Tick]) {
        for tick in ticks {
            let y = crisp(self.y.place(tick.value));
            match &tick.label {
                Some(label) => {
                    self.draw_grid_line(drawing, (self.x.from, y), (self.x.to, y));
                    drawing.text(
                        Text::new(label.as_str(), (self.x.from - 8.0, y), TICK_SIZE)
                            .aligned(Align::End),
                    );
                }
                None => drawing.line(
                    vec![(self.x.from, y), (self.x.from + 4.0, y)],
                    Stroke::new(SOFT, 1.0),
                ),
            }
        }
    }

    fn draw_grid_line(&self, drawing: &mut Drawing, from: Point, to: Point) {
        drawing.line(vec![from, to], Stroke::new(GRID, 1.0));
    }

    /// The frame.
    pub fn draw_frame(&self, drawing: &mut Drawing) {
        let (left, right) = (crisp(self.x.from), crisp(self.x.to));
        let (bottom, top) = (crisp(self.y.from), crisp(self.y.to));
        let corners = vec![
            (left, top),
            (right, top),
            (right, bottom),
            (left, bottom),
            (left, top),
        ];
        drawing.line(corners, Stroke::new(SOFT, 1.0));
    }

    /// Title of the horizontal axis.
    pub fn draw_x_title(&self, drawing: &mut Drawing, title: &str) {
        let at = (0.5 * (self.x.from + self.x.to), self.y.from + 36.0);
        drawing.text(Text::new(title, at, LABEL_SIZE).aligned(Align::Middle));
    }

    /// Title of the vertical axis, read upwards in the left margin.
    pub fn draw_y_title(&self, drawing: &mut Drawing, title: &str) {
        let at = (16.0, 0.5 * (self.y.from + self.y.to));
        drawing.text(
            Text::new(title, at, LABEL_SIZE)
                .aligned(Align::Middle)
                .upwards(),
        );
    }

    /// A curve through values, cut at the panel's sides and reduced to what pixels can show.
    pub fn draw_curve(
        &self,
        drawing: &mut Drawing,
        values: impl IntoIterator<Item = (f64, f64)>,
        stroke: Stroke,
    ) {
        let visible = values
            .into_iter()
            .filter(|(x, y)| self.x.holds(*x) && y.is_finite())
            .map(|(x, y)| self.place(x, y));
        drawing.line(decimate(visible), stroke);
    }

    /// A translucent band between two values, at least one pixel wide.
    pub fn draw_band(&self, drawing: &mut Drawing, (low, high): (f64, f64), color: Color) {
        if high < self.x.low || low > self.x.high {
            return;
        }
        let (left, right) = (self.x.place(low), self.x.place(high));
        let widen = (1.0 - (right - left)).max(0.0) / 2.0;
        drawing.rectangle(
            (left - widen, self.y.to),
            (right + widen, self.y.from),
            color,
            0.25,
        );
    }
}

/// The middle of the pixel, where a line of one pixel is sharp.
pub fn crisp(position: f64) -> f64 {
    position.floor() + 0.5
}

/// A picture's title and the line beneath it, shortened where they are too long for it. A title ends in the name
/// of a file, whose own end often tells it from others: that is kept.
pub fn draw_title(drawing: &mut Drawing, title: &str, below: &str) {
    let room = f64::from(drawing.width) - 40.0;
    let title = fitted_before_end(title, (18.0, Weight::Bold), room);
    let below = fitted(below, LABEL_SIZE, room);
    drawing.text(Text::new(title, (20.0, 24.0), 18.0).bold());
    drawing.text(Text::new(below, (20.0, 48.0), LABEL_SIZE).colored(SOFT));
}

/// How an entry of a legend looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sample {
    /// A line.
    Line(Color),
    /// A broken line.
    Dashed(Color),
    /// A shaded band.
    Band(Color),
    /// A filled circle.
    Dot(Color),
    /// A ring.
    Ring(Color),
    /// A diagonal cross.
    Cross(Color),
}

/// A legend in one row, from `at` to the right; entries that would pass `end` are left out.
pub fn draw_legend(drawing: &mut Drawing, at: Point, end: f64, entries: &[(Sample, String)]) {
    let (mut x, y) = at;
    for (sample, words) in entries {
        let text = Text::new(words.as_str(), (x + 30.0, y), TICK_SIZE).colored(INK);
        let next = x + 30.0 + text.width() + 24.0;
        if next - 24.0 > end {
            return;
        }
        draw_sample(drawing, *sample, (x, y));
        drawing.text(text);
        x = next;
    }
}

fn draw_sample(drawing: &mut Drawing, sample: Sample, (x, y): Point) {
    let middle = (x + 11.0, y);
    match sample {
        Sample::Line(color) => {
            drawing.line(vec![(x, y), (x + 22.0, y)], Stroke::new(color, 2.5));
        }
        Sample::Dashed(color) => {
            let stroke = Stroke::new(color, 1.5);
            drawing.dashed((x, y), (x + 22.0, y), (5.0, 3.0), stroke);
        }
        Sample::Band(color) => {
            drawing.rectangle((x + 3.0, y - 7.0), (x + 19.0, y + 7.0), color, 0.25);
        }
        Sample::Dot(color) => drawing.dot(middle, 5.0, color),
        Sample::Ring(color) => drawing.ring(middle, 5.0, color),
        Sample::Cross(color) => drawing.cross(middle, 5.0, Stroke::new(color, 2.2)),
    }
}
