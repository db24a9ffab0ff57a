//! A chart as a picture: panels below and beside each other, in pixels.

use std::collections::HashSet;

use super::drawing::{
    Align, Drawing, Note, Point, Shape, Stroke, Text, WHITE, Weight, fitted, text_width,
};
use super::labels::{LEFT, LINE, Legend, Patch, WORDS, draw_mark, ink, spread};
use super::page::decimate;
use super::{Block, Chart, Color, Mark, Panel, Places, Rule, Series, Tick};
use crate::format::trimmed;

/// Width of a picture that fills a page (pixels).
const WIDTH: u32 = 1200;
/// Space right of the panels (pixels): the last tick label needs it.
const RIGHT: f64 = 36.0;
/// Sizes of the title, and of headings and axis titles (pixels per em).
const TITLE: f64 = 18.0;
const HEADING: f64 = 14.0;
/// Middle of the first row of legend (pixels).
const LEGEND: f64 = 76.0;
/// Space between panels that share an axis (pixels).
const BETWEEN: f64 = 18.0;
/// Height of the strip that names of rules and their leaders need (pixels).
const STRIP: f64 = 62.0;
/// Farthest a name stands from its rule (pixels): beyond it the leaders run almost flat.
const FARTHEST: f64 = 140.0;
/// Least space between two names (pixels).
const APART: f64 = 14.0;
/// Letters of a title that stay at its end: it ends in the name of a file, whose end often tells it from others.
const KEPT: usize = 16;
/// From this many points on those that would cover each other are drawn once.
const MANY: usize = 300;
/// Places of a curve that answer the pointer, at most.
const MOST_NOTES: usize = 24;

impl Chart {
    /// The picture.
    pub fn draw(&self) -> Drawing {
        let width = if self.width > 0 { self.width } else { WIDTH };
        let mut drawing = Drawing::new(&self.title, width);
        let right = f64::from(width) - RIGHT;
        let room = f64::from(width) - 40.0;
        let title = fitted(&self.title, TITLE, Weight::Bold, KEPT, room);
        let below = fitted(&self.subtitle, HEADING, Weight::Regular, 0, room);
        drawing.text(ink(title, (20.0, 24.0), TITLE).bold());
        drawing.text(soft(below, (20.0, 48.0), HEADING));
        let mut y = LEGEND;
        let mut legend = Legend::default();
        let blocks: Vec<&Block> = self.blocks.iter().filter(|one| one.drawn > 0).collect();
        // The first panels of all blocks stand in one line.
        let left = blocks.iter().map(|block| margins(block)[0]);
        let left = left.fold(LEFT, f64::max);
        for (index, block) in blocks.into_iter().enumerate() {
            let layout = Layout::of(block, left, right);
            let mut x = LEFT;
            if index == 0 {
                y = legend.draw(&mut drawing, block, layout.unnamed, (x, y), right);
            }
            if !block.name.is_empty() {
                y += if index == 0 { 28.0 } else { 10.0 };
                let heading = ink(&block.name, (LEFT, y), HEADING).bold();
                x += heading.width() + 14.0;
                drawing.text(heading);
                let aside = fitted(&block.aside, WORDS, Weight::Regular, 0, right - x);
                let aside = ink(aside, (x, y), WORDS);
                x += aside.width() + 10.0;
                drawing.text(aside);
            }
            if index > 0 {
                y = legend.draw(&mut drawing, block, layout.unnamed, (x, y), right);
            }
            y = layout.draw(&mut drawing, y + 14.0);
        }
        for words in &self.footnotes {
            let words = fitted(words, WORDS, Weight::Regular, 0, right - LEFT);
            let color = Color::Vermilion.rgb();
            drawing.text(Text::new(words, (LEFT, y + 10.0), WORDS, color));
            y += LINE;
        }
        drawing.end_at(y + 10.0);
        drawing
    }
}

fn soft(text: impl Into<String>, at: Point, size: f64) -> Text {
    Text::new(text, at, size, Color::Soft.rgb())
}

/// The middle of the pixel, where a line of one pixel is sharp.
fn crisp(position: f64) -> f64 {
    position.floor() + 0.5
}

/// Columns of a block, and the names of its rules.
struct Layout<'a> {
    block: &'a Block,
    /// Left and right edge of each column (pixels).
    columns: Vec<(f64, f64)>,
    /// Rules with names, and the names' centres (pixels).
    names: Vec<(&'a Rule, f64)>,
    /// Number of rules without room for a name.
    unnamed: usize,
}

impl<'a> Layout<'a> {
    fn of(block: &'a Block, left: f64, right: f64) -> Layout<'a> {
        let mut margins = margins(block);
        margins[0] = left;
        let count = margins.len();
        let width = (right - margins.iter().sum::<f64>()) / count as f64;
        let mut columns = Vec::new();
        let mut x = 0.0;
        for margin in margins {
            columns.push((x + margin, x + margin + width));
            x += margin + width;
        }
        let mut layout = Layout {
            block,
            columns,
            names: Vec::new(),
            unnamed: 0,
        };
        if let ([panel, ..], [column]) = (block.panels.as_slice(), layout.columns.as_slice()) {
            let all = panel.rules.iter().filter(|rule| panel.x.holds(rule.at));
            let frame = Frame::of(panel, *column, 0.0);
            layout.names = named(&frame);
            layout.unnamed = all.count() - layout.names.len();
        }
        layout
    }

    /// Draws all panels from `y` on; returns the lower end.
    fn draw(&self, drawing: &mut Drawing, mut y: f64) -> f64 {
        let panels = &self.block.panels[..self.block.drawn];
        let mut rows = panels.chunks(self.columns.len()).peekable();
        let mut first = true;
        while let Some(row) = rows.next() {
            let named = first && !self.names.is_empty();
            let titled = row.iter().any(|panel| !panel.title.is_empty());
            let top = y
                + 8.0
                + if named {
                    STRIP
                } else if titled {
                    24.0
                } else {
                    0.0
                };
            let beneath = rows.peek().copied().unwrap_or_default();
            let shared = row.iter().zip(beneath).all(|(a, b)| a.x == b.x);
            let shared = shared && row.len() <= beneath.len();
            let mut lower = top;
            for (column, panel) in row.iter().enumerate() {
                let frame = Frame::of(panel, self.columns[column], top);
                let like_left = column > 0 && row[column - 1].y == panel.y;
                frame.draw_y_axis(drawing, !like_left, column == 0);
                let below = frame.draw_x_axis(drawing, !shared);
                frame.draw_content(drawing);
                for (rule, center) in self.names.iter().filter(|_| named) {
                    frame.draw_name(drawing, rule, *center);
                }
                lower = lower.max(below);
            }
            y = lower;
            first = false;
        }
        y
    }
}

/// Space that each column of a block needs on its left (pixels), one at least.
fn margins(block: &Block) -> Vec<f64> {
    let mut margins = vec![0.0_f64; block.columns.max(1)];
    for row in block.panels[..block.drawn].chunks(margins.len()) {
        for (column, panel) in row.iter().enumerate() {
            let title = if panel.y.label.is_empty() { 12.0 } else { 30.0 };
            let own = 8.0 + widest(&y_ticks(panel)) + title;
            let margin = match column.checked_sub(1) {
                None => own + 8.0,
                Some(before) if row[before].y == panel.y => BETWEEN,
                Some(_) => own + BETWEEN,
            };
            margins[column] = margins[column].max(margin);
        }
    }
    margins
}

fn y_ticks(panel: &Panel) -> Vec<Tick> {
    let spacing = if panel.height < 180.0 { 32.0 } else { 42.0 };
    panel.y.ticks(panel.height / spacing)
}

/// Width of the widest label (pixels).
fn widest(ticks: &[Tick]) -> f64 {
    let labels = ticks.iter().filter_map(|tick| tick.label.as_deref());
    let widths = labels.map(|label| text_width(label, WORDS, Weight::Regular));
    widths.fold(0.0, f64::max)
}

/// The rules that get a name, and the names' centres (pixels): modes before others, the most prominent first,
/// each kept if all still have room near their rules.
fn named<'a>(frame: &Frame<'a>) -> Vec<(&'a Rule, f64)> {
    let rules = frame.panel.rules.iter();
    let mut candidates: Vec<&Rule> = rules.filter(|rule| frame.panel.x.holds(rule.at)).collect();
    candidates.sort_by(|a, b| {
        let modes_first = b.mode.cmp(&a.mode);
        modes_first.then(b.prominence.total_cmp(&a.prominence))
    });
    let mut best: Vec<(&Rule, f64)> = Vec::new();
    for candidate in candidates {
        let mut rules: Vec<&Rule> = best.iter().map(|(rule, _)| *rule).collect();
        let place = rules.partition_point(|rule| rule.at <= candidate.at);
        rules.insert(place, candidate);
        let wishes: Vec<f64> = rules.iter().map(|rule| frame.x(rule.at)).collect();
        let widths = rules.iter().map(|rule| {
            let name = text_width(&rule.name, WORDS, Weight::Bold);
            name.max(text_width(&rule.words, WORDS, Weight::Regular))
        });
        let widths: Vec<f64> = widths.collect();
        let (low, high) = (frame.left - 40.0, frame.right + 14.0);
        let Some(centers) = spread(&wishes, &widths, APART, low, high) else {
            continue;
        };
        let mut moves = centers.iter().zip(&wishes);
        if moves.all(|(center, wish)| (center - wish).abs() <= FARTHEST) {
            best = rules.into_iter().zip(centers).collect();
        }
    }
    best
}

fn rule_color(rule: &Rule) -> Color {
    if rule.mode {
        Color::Blue
    } else {
        Color::Orange
    }
}

/// A panel at its place in the picture (pixels).
struct Frame<'a> {
    panel: &'a Panel,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl<'a> Frame<'a> {
    /// A panel between the left and the right edge of a column.
    fn of(panel: &'a Panel, column: (f64, f64), top: f64) -> Frame<'a> {
        Frame {
            panel,
            left: column.0,
            right: column.1,
            top,
            bottom: top + panel.height,
        }
    }

    fn x(&self, value: f64) -> f64 {
        self.left + self.panel.x.share(value) * (self.right - self.left)
    }

    fn y(&self, value: f64) -> f64 {
        self.bottom - self.panel.y.share(value) * (self.bottom - self.top)
    }

    fn place(&self, x: f64, y: f64) -> Point {
        (self.x(x), self.y(y))
    }

    fn holds(&self, x: f64, y: f64) -> bool {
        self.panel.x.holds(x) && self.panel.y.holds(y)
    }

    fn draw_y_axis(&self, drawing: &mut Drawing, words: bool, first: bool) {
        let ticks = y_ticks(self.panel);
        for tick in &ticks {
            let y = crisp(self.y(tick.value));
            let Some(label) = &tick.label else {
                let stroke = Stroke::new(Color::Soft.rgb(), 1.0);
                drawing.line(vec![(self.left, y), (self.left + 4.0, y)], stroke);
                continue;
            };
            drawing.line(vec![(self.left, y), (self.right, y)], GRID);
            if words {
                let text = ink(label.as_str(), (self.left - 8.0, y), WORDS);
                drawing.text(text.aligned(Align::End));
            }
        }
        let title = self.panel.y.title();
        if words && !title.is_empty() {
            let x = if first {
                16.0
            } else {
                self.left - widest(&ticks) - 24.0
            };
            let title = fitted(
                &title,
                HEADING,
                Weight::Regular,
                0,
                self.bottom - self.top + 40.0,
            );
            let text = ink(title, (x, 0.5 * (self.top + self.bottom)), HEADING);
            drawing.text(text.aligned(Align::Middle).upwards());
        }
    }

    /// Grid, labels and title of the horizontal axis; returns where they end.
    fn draw_x_axis(&self, drawing: &mut Drawing, words: bool) -> f64 {
        let width = self.right - self.left;
        let spacing = if width > 500.0 { 90.0 } else { 62.0 };
        let ticks = self.panel.x.ticks(width / spacing);
        let named = !self.panel.x.names.is_empty();
        // Names that have no room beside each other are read upwards.
        let places: Vec<f64> = ticks.iter().map(|tick| self.x(tick.value)).collect();
        let slots = places.windows(2).map(|pair| pair[1] - pair[0]);
        let upwards = named && slots.fold(width, f64::min) < widest(&ticks) && ticks.len() > 6;
        let mut end = self.bottom;
        for (tick, x) in ticks.iter().zip(places) {
            let Some(label) = &tick.label else {
                continue;
            };
            drawing.line(vec![(crisp(x), self.bottom), (crisp(x), self.top)], GRID);
            if !words {
                continue;
            }
            let align = match self.panel.x.share(tick.value) {
                0.0 if named => Align::Start,
                1.0 if named => Align::End,
                _ => Align::Middle,
            };
            if upwards {
                let text = ink(label, (x, self.bottom + 8.0), WORDS).aligned(Align::End);
                drawing.text(text.upwards());
                end = end.max(self.bottom + 16.0 + text_width(label, WORDS, Weight::Regular));
                continue;
            }
            for (row, words) in label.lines().enumerate() {
                let at = (x, self.bottom + 15.0 + 17.0 * row as f64);
                let text = if row == 0 {
                    ink(words, at, WORDS)
                } else {
                    soft(words, at, 12.0)
                };
                drawing.text(text.aligned(align));
                end = end.max(at.1 + 10.0);
            }
        }
        let title = self.panel.x.title();
        if words && !title.is_empty() {
            let at = (0.5 * (self.left + self.right), end + 11.0);
            drawing.text(ink(title, at, HEADING).aligned(Align::Middle));
            end += 22.0;
        }
        end + 10.0
    }

    fn draw_content(&self, drawing: &mut Drawing) {
        let rules = self.panel.rules.iter();
        for rule in rules.filter(|rule| self.panel.x.holds(rule.at)) {
            let color = rule_color(rule).rgb();
            // Its half-line band is at least one pixel wide.
            let (left, right) = (self.x(rule.line - rule.half), self.x(rule.line + rule.half));
            if rule.half > 0.0 {
                let widen = (1.0 - (right - left)).max(0.0) / 2.0;
                let (from, to) = ((left - widen, self.top), (right + widen, self.bottom));
                drawing.rectangle(from, to, color, 0.25);
            }
            let x = crisp(self.x(rule.at));
            let dash = if rule.mode { 6.0 } else { 2.0 };
            let stroke = Stroke::new(color, 1.0).faint(0.75);
            drawing.dashed((x, self.top), (x, self.bottom), dash, 4.0, stroke);
        }
        for series in &self.panel.series {
            self.draw_series(drawing, series);
        }
        self.draw_labels(drawing);
        self.draw_events(drawing);
        let (left, right) = (crisp(self.left), crisp(self.right));
        let (top, bottom) = (crisp(self.top), crisp(self.bottom));
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
        let corners = corners.into_iter().chain([(left, top)]).collect();
        drawing.line(corners, Stroke::new(Color::Soft.rgb(), 1.0));
        if !self.panel.title.is_empty() {
            let at = (self.left, self.top - 13.0);
            let room = self.right - self.left;
            let title = fitted(&self.panel.title, WORDS, Weight::Bold, 0, room);
            drawing.text(ink(title, at, WORDS).bold());
        }
    }

    /// The name of a rule above the panel, and a leader to it.
    fn draw_name(&self, drawing: &mut Drawing, rule: &Rule, center: f64) {
        let (wish, top) = (crisp(self.x(rule.at)), self.top);
        let color = rule_color(rule).rgb();
        let name = Text::new(&rule.name, (center, top - 52.0), WORDS, color);
        drawing.text(name.bold().aligned(Align::Middle));
        let at = (center, top - 36.0);
        let words = match rule.mode {
            true => ink(&rule.words, at, WORDS),
            false => soft(&rule.words, at, WORDS),
        };
        drawing.text(words.aligned(Align::Middle));
        let leader = vec![
            (center, top - 26.0),
            (center, top - 22.0),
            (wish, top - 4.0),
            (wish, top),
        ];
        drawing.line(leader, Stroke::new(color, 1.0));
    }

    fn draw_series(&self, drawing: &mut Drawing, series: &Series) {
        match series.mark {
            Mark::Band => self.draw_band(drawing, series),
            Mark::Line(width) | Mark::Curve(width) => {
                self.draw_band(drawing, series);
                for piece in self.pieces(series) {
                    drawing.line(piece, stroke(series, width));
                }
            }
            Mark::Dashed(width) => {
                for piece in self.pieces(series) {
                    for pair in piece.windows(2) {
                        drawing.dashed(pair[0], pair[1], 6.0, 5.0, stroke(series, width));
                    }
                }
            }
            Mark::Bar(half) => {
                for (x, y) in series.pairs() {
                    let (from, to) = (self.place(0.0, y), self.place(x, y));
                    let corner = (to.0.max(from.0 + 1.0), to.1 + half);
                    drawing.rectangle((from.0, from.1 - half), corner, series.color.rgb(), 1.0);
                }
            }
            Mark::Cell => {
                // One unit wide and high, with labels inside.
                for (index, (x, y)) in series.pairs().enumerate() {
                    let (from, to) = (self.place(x - 0.5, y + 0.5), self.place(x + 0.5, y - 0.5));
                    let share = series.low.get(index).copied().unwrap_or(1.0);
                    let shade = 0.15 + 0.85 * share;
                    let (from, to) = ((from.0 + 1.0, from.1 + 1.0), (to.0 - 1.0, to.1 - 1.0));
                    drawing.rectangle(from, to, series.color.rgb(), shade);
                    if let Some(label) = series.labels.get(index) {
                        let color = if share > 0.45 {
                            WHITE
                        } else {
                            Color::Ink.rgb()
                        };
                        let text = Text::new(label, self.place(x, y), HEADING, color);
                        drawing.text(text.aligned(Align::Middle));
                    }
                }
            }
            Mark::Dot(_) | Mark::Ring(_) | Mark::Cross(_) | Mark::Square(_) => {
                self.draw_points(drawing, series);
            }
        }
        self.note(drawing, series);
    }

    /// The curve, cut at the panel's sides and where its values come round, and reduced to what pixels can show.
    fn pieces(&self, series: &Series) -> Vec<Vec<Point>> {
        let mut pieces = vec![Vec::new()];
        let mut last: Option<f64> = None;
        for (x, y) in series.pairs() {
            if !(self.panel.x.holds(x) && y.is_finite()) {
                continue;
            }
            let period = self.panel.y.period.unwrap_or(f64::INFINITY);
            if last.is_some_and(|last| (y - last).abs() > 0.5 * period) {
                pieces.push(Vec::new());
            }
            last = Some(y);
            if let Some(piece) = pieces.last_mut() {
                piece.push(self.place(x, y));
            }
        }
        if matches!(series.x, Places::Even(..)) {
            pieces = pieces.into_iter().map(decimate).collect();
        }
        pieces
    }

    /// The area between the lower and the upper ends, where there are any.
    fn draw_band(&self, drawing: &mut Drawing, series: &Series) {
        let color = series.color.rgb();
        let ends = series.low.iter().zip(&series.high).enumerate();
        let ends = ends.map(|(index, (low, high))| (series.at(index), *low, *high));
        if let Places::Even(..) = series.x {
            // Through the extremes of every piece in turn: where pieces are narrower than a pixel this is
            // the envelope, filled.
            let zigzag = ends.flat_map(|(x, low, high)| [(x, low), (x, high)]);
            let finite = zigzag.filter(|(_, y)| y.is_finite());
            let places = finite.map(|(x, y)| self.place(x, y));
            drawing.line(decimate(places), Stroke::new(color, 1.0));
            return;
        }
        let corners: Vec<(Point, Point)> = ends
            .filter(|(x, low, high)| self.panel.x.holds(*x) && low.is_finite() && high.is_finite())
            .map(|(x, low, high)| (self.place(x, low), self.place(x, high)))
            .collect();
        if corners.len() > 1 {
            let lower = corners.iter().map(|pair| pair.0);
            let upper = corners.iter().rev().map(|pair| pair.1);
            drawing.shapes.push(Shape::Area {
                points: lower.chain(upper).collect(),
                color,
                opacity: 0.25,
            });
        }
    }

    fn draw_points(&self, drawing: &mut Drawing, series: &Series) {
        let shown = series.pairs().enumerate();
        let shown: Vec<(usize, f64, f64)> = shown
            .filter(|(_, (x, y))| self.holds(*x, *y))
            .map(|(index, (x, y))| (index, x, y))
            .collect();
        // All bars, then all points: neighbours of one style are one path in an SVG.
        for (index, x, _) in &shown {
            if let (Some(low), Some(high)) = (series.low.get(*index), series.high.get(*index)) {
                let ends = [self.place(*x, *low), self.place(*x, *high)];
                drawing.line(ends.to_vec(), stroke(series, 1.4));
                let reach = if shown.len() < MOST_NOTES { 6.0 } else { 0.0 };
                for (x, y) in ends.into_iter().filter(|_| reach > 0.0) {
                    drawing.line(vec![(x - reach, y), (x + reach, y)], stroke(series, 1.4));
                }
            }
        }
        let mut taken = HashSet::new();
        for (_, x, y) in &shown {
            let at = self.place(*x, *y);
            let cell = ((at.0 / 2.0) as i64, (at.1 / 2.0) as i64);
            if shown.len() > MANY && !taken.insert(cell) {
                continue;
            }
            match series.mark {
                Mark::Dot(radius) if radius >= 5.0 => drawing.dot(at, radius + 1.5, WHITE),
                _ => {}
            }
            let width = match series.mark {
                Mark::Cross(radius) if radius < 4.0 => 1.0,
                _ => 2.5,
            };
            draw_mark(drawing, series.mark, at, stroke(series, width));
        }
    }

    /// Words beside points, where they cover nothing; words without such a place are left out.
    fn draw_labels(&self, drawing: &mut Drawing) {
        let labelled = self.panel.series.iter();
        let labelled = labelled.filter(|one| !one.labels.is_empty() && one.mark != Mark::Cell);
        let labelled: Vec<&Series> = labelled.collect();
        if labelled.is_empty() {
            return;
        }
        let panel = Patch {
            left: self.left,
            right: self.right,
            top: self.top,
            bottom: self.bottom,
        };
        let mut taken = Vec::new();
        for series in &self.panel.series {
            let point = matches!(
                series.mark,
                Mark::Dot(_) | Mark::Ring(_) | Mark::Cross(_) | Mark::Square(_)
            );
            if point && series.count() <= MANY {
                for (index, (x, y)) in series.pairs().enumerate() {
                    taken.push(Patch::around(self.place(x, y), 7.0, 7.0));
                    if let (Some(low), Some(high)) = (series.low.get(index), series.high.get(index))
                    {
                        let (low, high) = (self.place(x, *low), self.place(x, *high));
                        let middle = (low.0, 0.5 * (low.1 + high.1));
                        taken.push(Patch::around(middle, 7.0, 0.5 * (low.1 - high.1).abs()));
                    }
                }
            }
        }
        for series in labelled {
            for ((x, y), label) in series.pairs().zip(&series.labels) {
                let at = self.place(x, y);
                let half = 0.5 * text_width(label, WORDS, Weight::Regular);
                let shown = self.holds(x, y);
                if let Some(middle) = panel.beside(at, half, &mut taken).filter(|_| shown) {
                    drawing.text_on_paper(ink(label, middle, WORDS));
                }
            }
        }
    }

    /// Taps used as dots, rejected ones as crosses, with their numbers where there is room.
    fn draw_events(&self, drawing: &mut Drawing) {
        let mut free = f64::NEG_INFINITY;
        for (index, event) in self.panel.events.iter().enumerate() {
            let at = self.place(event.at, event.peak);
            let (mark, color) = if event.used {
                (Mark::Dot(5.0), Color::Blue)
            } else {
                (Mark::Cross(6.0), Color::Vermilion)
            };
            draw_mark(drawing, mark, at, Stroke::new(color.rgb(), 2.5));
            let offset = if event.peak < 0.0 { 15.0 } else { -15.0 };
            let number = (index + 1).to_string();
            let text = Text::new(number, (at.0, at.1 + offset), 12.0, color.rgb());
            let half = 0.5 * text.width() + 2.0;
            if at.0 - half >= free {
                free = at.0 + half;
                drawing.text(text.aligned(Align::Middle));
            }
        }
    }

    /// Lets points with words of their own, and curves, answer the pointer.
    fn note(&self, drawing: &mut Drawing, series: &Series) {
        let curve = matches!(series.mark, Mark::Curve(_));
        if !curve && series.words.is_empty() && series.said.is_empty() {
            return;
        }
        let stride = if curve {
            series.count().div_ceil(MOST_NOTES).max(1)
        } else {
            1
        };
        let reach = match series.mark {
            Mark::Curve(_) => {
                0.5 * (self.right - self.left) * stride as f64 / series.count() as f64
            }
            _ => 8.0,
        };
        for (index, (x, y)) in series.pairs().enumerate().step_by(stride) {
            let (across, down) = self.place(x, y);
            let (from, to) = match series.mark {
                Mark::Curve(_) => ((across - reach, self.top), (across + reach, self.bottom)),
                Mark::Bar(half) => ((self.left, down - half), (self.right, down + half)),
                _ => ((across - 8.0, down - 8.0), (across + 8.0, down + 8.0)),
            };
            // As the page's script has them: "sensor, A · position 338 mm · displacement 0.43".
            let mut parts = vec![match series.words.get(index) {
                Some(words) if series.name.is_empty() => words.clone(),
                Some(words) => format!("{}, {words}", series.name),
                None => series.name.clone(),
            }];
            let panel = self.panel;
            if panel.x.names.is_empty() {
                let place = number_with_unit(trimmed(x, 5), &panel.x.unit);
                parts.push(format!("{} {place}", panel.x.label));
            }
            if panel.y.names.is_empty() {
                let said = series.said.get(index).cloned();
                let said = said.unwrap_or_else(|| number_with_unit(trimmed(y, 5), &panel.y.unit));
                parts.push(format!("{} {said}", panel.y.label));
            }
            if let (Some([label, unit]), Some(extra)) = (panel.extra, series.extra.get(index)) {
                let extra = number_with_unit(trimmed(*extra, 4), unit);
                parts.push(format!("{label} {extra}"));
            }
            let words = parts.join(" \u{b7} ");
            drawing.notes.push(Note { from, to, words });
        }
    }
}

/// Returns a line of a series.
fn stroke(series: &Series, width: f64) -> Stroke {
    Stroke::new(series.color.rgb(), width).faint(series.opacity)
}

/// Lines of the grid.
const GRID: Stroke = Stroke {
    color: super::drawing::Rgb(226, 226, 226),
    width: 1.0,
    opacity: 1.0,
};

fn number_with_unit(number: String, unit: &str) -> String {
    match unit {
        "" | "1" => number,
        unit => format!("{number} {unit}"),
    }
}
