//! Words on a picture: the legend, and labels that cover nothing.

use super::drawing::{Drawing, Point, Shape, Stroke, Text, Weight, text_width};
use super::{Block, Color, Mark, Rule};

/// Left edge of panels whose numbers need no more room (pixels).
pub(super) const LEFT: f64 = 84.0;
/// Size of tick labels, legends and all other words but titles (pixels per em).
pub(super) const WORDS: f64 = 13.0;
/// Distance of two lines of words (pixels).
pub(super) const LINE: f64 = 20.0;

/// Words in the colour of text.
pub(super) fn ink(text: impl Into<String>, at: Point, size: f64) -> Text {
    Text::new(text, at, size, Color::Ink.rgb())
}

/// Moves label centres as little as possible so that none overlaps and all stay between `low` and `high`.
///
/// `centers` are ascending wishes and `widths` the labels' widths (pixels), `gap` the least space
/// between two. Minimises the sum of squared moves (isotonic regression by pooling neighbours).
/// Returns `None` when the labels do not fit.
pub fn spread(centers: &[f64], widths: &[f64], gap: f64, low: f64, high: f64) -> Option<Vec<f64>> {
    // Measured from where each label would be if all stood side by side, "no overlap" means "not
    // descending".
    let mut offsets = Vec::new();
    let mut total = 0.0;
    for width in widths.iter().take(centers.len()) {
        offsets.push(total + width / 2.0);
        total += width + gap;
    }
    total -= gap.min(total);
    if total > high - low {
        return None;
    }
    // Neighbours out of order share their mean.
    let mut groups: Vec<(f64, usize)> = Vec::new();
    for (center, offset) in centers.iter().zip(&offsets) {
        let mut group = (center - offset, 1);
        while let Some(before) = groups.pop_if(|before| before.0 > group.0) {
            let count = before.1 + group.1;
            let sum = before.0 * before.1 as f64 + group.0 * group.1 as f64;
            group = (sum / count as f64, count);
        }
        groups.push(group);
    }
    let shifts = groups
        .into_iter()
        .flat_map(|(mean, count)| std::iter::repeat_n(mean, count));
    let places = shifts
        .zip(&offsets)
        .map(|(shift, offset)| shift.clamp(low, high - total) + offset);
    Some(places.collect())
}

/// A rectangle that is taken (pixels).
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) bottom: f64,
}

/// Places of words beside a point: shares of their half width across and of a line down.
const SIDES: [Point; 8] = [
    (0.0, -1.0),
    (1.0, 0.0),
    (-1.0, 0.0),
    (0.0, 1.0),
    (0.8, -1.0),
    (-0.8, -1.0),
    (0.8, 1.0),
    (-0.8, 1.0),
];

impl Patch {
    pub(super) fn around(middle: Point, across: f64, down: f64) -> Patch {
        Patch {
            left: middle.0 - across,
            right: middle.0 + across,
            top: middle.1 - down,
            bottom: middle.1 + down,
        }
    }

    /// The middle of words of this half width beside a point, inside this patch and clear of all others, which
    /// it joins; `None` without such a place.
    pub(super) fn beside(&self, at: Point, half: f64, taken: &mut Vec<Patch>) -> Option<Point> {
        for (across, down) in SIDES {
            let middle = (at.0 + across * (half + 11.0), at.1 + down * 17.0);
            let patch = Patch::around(middle, half + 1.0, 7.0);
            let inside = patch.left > self.left
                && patch.right < self.right
                && patch.top > self.top
                && patch.bottom < self.bottom;
            let covers = taken.iter().any(|other| {
                let across = other.left < patch.right && patch.left < other.right;
                across && other.top < patch.bottom && patch.top < other.bottom
            });
            if inside && !covers {
                taken.push(patch);
                return Some(middle);
            }
        }
        None
    }
}

/// Names in the legend so far: nothing is explained twice.
#[derive(Default)]
pub(super) struct Legend {
    listed: Vec<String>,
}

impl Legend {
    /// Draws what a block adds, in rows from `at` on; returns the middle of the last row.
    pub(super) fn draw(
        &mut self,
        drawing: &mut Drawing,
        block: &Block,
        unnamed: usize,
        at: Point,
        right: f64,
    ) -> f64 {
        let (mut x, mut y) = at;
        for (mark, color, words) in self.entries(block, unnamed) {
            let wide = 30.0 + text_width(&words, WORDS, Weight::Regular);
            if x + wide > right && x > LEFT {
                (x, y) = (LEFT, y + LINE);
            }
            draw_sample(drawing, mark, color, (x, y));
            drawing.text(ink(words, (x + 30.0, y), WORDS));
            x += wide + 24.0;
        }
        y
    }

    fn entries(&mut self, block: &Block, unnamed: usize) -> Vec<(Mark, Color, String)> {
        let mut entries = Vec::new();
        let panels = &block.panels[..block.drawn];
        let dashes = Mark::Dashed(1.5);
        for series in panels.iter().flat_map(|panel| &panel.series) {
            let mark = match series.mark {
                Mark::Line(_) | Mark::Curve(_) => Mark::Line(2.5),
                Mark::Dashed(_) => dashes,
                mark => mark,
            };
            entries.push((mark, series.color, series.name.clone()));
        }
        let rules: Vec<&Rule> = panels.iter().flat_map(|panel| &panel.rules).collect();
        if rules.iter().any(|rule| rule.mode) {
            let shaded = rules.iter().any(|rule| rule.half > 0.0);
            let words = if shaded {
                "mode, shaded: line \u{b1} half line"
            } else {
                "mode"
            };
            entries.push((dashes, Color::Blue, words.to_owned()));
        }
        if rules.iter().any(|rule| !rule.mode && rule.half > 0.0) {
            let words = "mains or other, no mode".to_owned();
            entries.push((dashes, Color::Orange, words));
        }
        let mut events = panels.iter().flat_map(|panel| &panel.events);
        if events.clone().any(|event| event.used) {
            entries.push((Mark::Dot(5.0), Color::Blue, "tap used".to_owned()));
        }
        if events.any(|event| !event.used) {
            let words = "tap rejected".to_owned();
            entries.push((Mark::Cross(6.0), Color::Vermilion, words));
        }
        if unnamed > 0 {
            let words = format!("{} more without a label, see the table", unnamed);
            entries.push((dashes, Color::Soft, words));
        }
        let mut looks: Vec<(Mark, Color)> = Vec::new();
        entries.retain(|(mark, color, words)| {
            let named = !words.is_empty() && !self.listed.contains(words);
            let kept = named && !looks.contains(&(*mark, *color));
            if kept {
                self.listed.push(words.clone());
                looks.push((*mark, *color));
            }
            kept
        });
        entries
    }
}

fn draw_sample(drawing: &mut Drawing, mark: Mark, color: Color, at: Point) {
    let (x, y) = at;
    let middle = (x + 11.0, y);
    let rgb = color.rgb();
    match mark {
        Mark::Line(width) | Mark::Curve(width) => {
            drawing.line(vec![(x, y), (x + 22.0, y)], Stroke::new(rgb, width));
        }
        Mark::Dashed(width) => {
            let stroke = Stroke::new(rgb, width);
            drawing.dashed((x, y), (x + 22.0, y), 5.0, 3.0, stroke);
        }
        Mark::Band => drawing.rectangle((x + 3.0, y - 7.0), (x + 19.0, y + 7.0), rgb, 0.25),
        Mark::Bar(_) | Mark::Cell => {
            drawing.rectangle((x + 3.0, y - 5.0), (x + 19.0, y + 5.0), rgb, 1.0);
        }
        Mark::Dot(_) => draw_mark(drawing, Mark::Dot(5.0), middle, Stroke::new(rgb, 2.0)),
        Mark::Ring(_) => draw_mark(drawing, Mark::Ring(5.0), middle, Stroke::new(rgb, 2.0)),
        Mark::Cross(_) => draw_mark(drawing, Mark::Cross(5.0), middle, Stroke::new(rgb, 2.2)),
        Mark::Square(_) => draw_mark(drawing, Mark::Square(5.0), middle, Stroke::new(rgb, 2.0)),
    }
}

/// One point of a series.
pub(super) fn draw_mark(drawing: &mut Drawing, mark: Mark, at: Point, stroke: Stroke) {
    match mark {
        Mark::Dot(radius) => drawing.dot(at, radius, stroke.color),
        Mark::Ring(radius) => drawing.shapes.push(Shape::Ring {
            center: at,
            radius,
            color: stroke.color,
        }),
        Mark::Cross(radius) => drawing.cross(at, radius, stroke),
        Mark::Square(half) => {
            let (from, to) = ((at.0 - half, at.1 - half), (at.0 + half, at.1 + half));
            drawing.rectangle(from, to, stroke.color, stroke.opacity);
        }
        Mark::Line(_)
        | Mark::Dashed(_)
        | Mark::Curve(_)
        | Mark::Band
        | Mark::Bar(_)
        | Mark::Cell => {}
    }
}
