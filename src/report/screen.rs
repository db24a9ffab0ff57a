//! Tables and sentences for a terminal of some width, without colours.

use crate::format::MISSING;
use crate::short_names::ways;
use crate::tables::{Column, Place, Table};
use std::collections::BTreeSet;

/// A terminal, or a file of text in its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Screen {
    /// Characters of a line.
    columns: usize,
}

/// Columns of a terminal that does not tell its width.
const USUAL_COLUMNS: usize = 80;
/// Fewest columns: below, words would be cut.
const LEAST_COLUMNS: usize = 40;
/// Most columns: longer lines are hard to follow.
const MOST_COLUMNS: usize = 200;

impl Default for Screen {
    fn default() -> Self {
        Screen::of(USUAL_COLUMNS)
    }
}

/// Space between columns (characters).
const GAP: usize = 2;
/// Narrowest a column of words is cut to (characters).
const NARROWEST: usize = 8;
/// A column of words this wide reads well (characters): names of files give way for no more.
const READABLE: usize = 24;
/// So many ways to shorten names leave out only what all of them share: these come before a column goes.
const GENTLE: usize = 3;
/// Units that stay in the line of their number.
const UNITS: &str =
    "% Hz kHz s ms min h m mm \u{b5}m m/s2 m/s\u{b2} N kN N/m MN/m g kg dB GPa kB MB GB bit";
/// Signs that stay in the line of the numbers on both sides.
const SIGNS: [&str; 2] = ["\u{b1}", "\u{d7}"];
/// Most rows printed: a terminal is no place for a thousand taps.
const MOST_ROWS: usize = 40;

/// A table as it is printed.
struct Layout {
    table: Table,
    /// Lines of each column's head.
    heads: Vec<Vec<String>>,
    shown: Vec<Shown>,
}

/// A column that is printed.
#[derive(Clone, Copy)]
struct Shown {
    index: usize,
    /// Characters.
    width: usize,
}

impl Screen {
    /// A screen of so many columns, within sensible limits.
    pub fn of(columns: usize) -> Self {
        Screen {
            columns: columns.clamp(LEAST_COLUMNS, MOST_COLUMNS),
        }
    }

    /// Characters of a line.
    pub fn columns(self) -> usize {
        self.columns
    }

    /// Returns a table with its caption, and a rule below its heads; one without caption has no rule.
    ///
    /// Where it has no room, these steps follow each other until it fits:
    /// 1. Heads go to two lines.
    /// 2. Names of files are shortened, and still differ from each other.
    /// 3. Columns that other outputs show are left out.
    /// 4. Words go on below.
    /// 5. Columns go on below.
    ///
    /// Numbers are never cut.
    pub fn table(self, table: &Table) -> String {
        let Layout {
            table,
            heads,
            shown,
        } = self.layout(table);
        let mut text = match table.caption.is_empty() {
            true => String::new(),
            false => self.wrapped(&table.caption, 0),
        };
        for part in self.parts(&shown) {
            text.push_str(&row(&table, &part, &heads));
            // A table of an answer has neither caption nor rule.
            if !table.caption.is_empty() {
                text.push_str(&"-".repeat(total(&part).min(self.columns)));
                text.push('\n');
            }
            for cells in table.rows.iter().take(MOST_ROWS) {
                let cells: Vec<Vec<String>> = cells.iter().map(|cell| vec![cell.clone()]).collect();
                text.push_str(&row(&table, &part, &cells));
            }
        }
        let more = table.rows.len().saturating_sub(MOST_ROWS);
        if more > 0 {
            text.push_str(&format!("... and {more} more\n"));
        }
        text
    }

    /// A table without what its columns mean; empty without one.
    pub(super) fn plain(self, table: Option<Table>) -> String {
        table.map_or_else(String::new, |table| self.table(&table))
    }

    /// A table with what its columns mean; empty without one.
    pub(super) fn noted(self, table: Option<Table>) -> String {
        table.map_or_else(String::new, |table| {
            self.table(&table) + &self.wrapped(&table.note, 0)
        })
    }

    /// Returns the columns in as many parts as have room side by side, each with the first column, which names the rows.
    fn parts(self, shown: &[Shown]) -> Vec<Vec<Shown>> {
        let mut parts: Vec<Vec<Shown>> = Vec::new();
        for &column in shown {
            match parts.last_mut() {
                Some(part) if total(part) + GAP + column.width <= self.columns => part.push(column),
                None => parts.push(vec![column]),
                Some(_) => parts.push(vec![shown[0], column]),
            }
        }
        parts
    }

    /// Returns the first layout that has room, in the order of what it costs.
    fn layout(self, table: &Table) -> Layout {
        let mut named = with_short_names(table);
        let spacious = named.iter().take(GENTLE).map(|table| (table, true));
        for (table, spacious) in spacious.chain(named.iter().map(|table| (table, false))) {
            let names = table.columns.iter().map(|column| column.name.as_str());
            let one_line = names.clone().map(|name| vec![name.to_owned()]);
            // On two lines: its unit below its name, or its last word.
            let two_lines = names.map(|name| {
                let place = name.rfind(" (").or_else(|| name.rfind(' '));
                let (first, second) = name.split_at(place.unwrap_or(0));
                vec![first.to_owned(), second.trim_start().to_owned()]
            });
            for heads in [one_line.collect(), two_lines.collect::<Vec<_>>()] {
                let mut shown = natural_widths(table, &heads, spacious);
                let least = shown.iter().map(|column| {
                    let head = &table.columns[column.index];
                    match head.is_number || is_name(head) {
                        true => column.width,
                        false => column.width.min(READABLE),
                    }
                });
                if least.sum::<usize>() <= self.room(shown.len()) {
                    self.shrink(table, &mut shown);
                    let table = table.clone();
                    return Layout {
                        table,
                        heads,
                        shown,
                    };
                }
            }
        }
        let table = named.pop().unwrap_or_else(|| table.clone());
        // Heads no wider than the cells below them, as far as their words allow, all on as many lines.
        let mut heads = Vec::new();
        for (index, column) in table.columns.iter().enumerate() {
            let cells = table.rows.iter().filter_map(|row| row.get(index));
            let words = column.name.split(' ').map(length);
            let width = cells.map(|cell| length(cell)).chain(words).max();
            heads.push(broken(&column.name, width.unwrap_or(0)));
        }
        let lines = heads.iter().map(Vec::len).max().unwrap_or(0);
        for head in &mut heads {
            head.splice(..0, vec![String::new(); lines - head.len()]);
        }
        let mut shown = natural_widths(&table, &heads, false);
        self.shrink(&table, &mut shown);
        Layout {
            table,
            heads,
            shown,
        }
    }

    /// Returns the characters that columns share.
    fn room(self, columns: usize) -> usize {
        self.columns.saturating_sub(GAP * columns.saturating_sub(1))
    }

    /// Shrinks columns of words where they pass the terminal's width, names of files last.
    fn shrink(self, table: &Table, shown: &mut [Shown]) {
        let room = self.room(shown.len());
        while shown.iter().map(|column| column.width).sum::<usize>() > room {
            let words = shown.iter_mut().filter(|column| {
                !table.columns[column.index].is_number && column.width > NARROWEST
            });
            let widest =
                words.max_by_key(|column| (!is_name(&table.columns[column.index]), column.width));
            match widest {
                Some(column) => column.width -= 1,
                None => break,
            }
        }
    }

    /// Returns a text broken into lines no longer than the screen; lines after the first are indented.
    pub fn wrapped(self, text: &str, indent: usize) -> String {
        let lines = lines_of(text, self.columns, indent);
        // No-break spaces have kept words together; a terminal, and who searches it, wants plain ones.
        lines.join("\n").replace('\u{a0}', " ") + "\n"
    }
}

/// Returns the width of columns with the space between them.
fn total(shown: &[Shown]) -> usize {
    let widths = shown.iter().map(|column| column.width).sum::<usize>();
    widths + GAP * shown.len().saturating_sub(1)
}

/// Returns the table with its names of files as they are, then shorter and shorter.
fn with_short_names(table: &Table) -> Vec<Table> {
    let Some(index) = table.columns.iter().position(is_name) else {
        return vec![table.clone()];
    };
    let cells = table.rows.iter().filter_map(|row| row.get(index));
    let names: BTreeSet<&String> = cells.filter(|c| !c.is_empty() && *c != MISSING).collect();
    let names: Vec<String> = names.into_iter().cloned().collect();
    let mut tables = Vec::new();
    for way in ways(&names) {
        let mut table = table.clone();
        for cell in table.rows.iter_mut().filter_map(|row| row.get_mut(index)) {
            let place = names.iter().position(|name| name == cell);
            if let Some(short) = place.and_then(|place| way.get(place)) {
                cell.clone_from(short);
            }
        }
        if way != names {
            table.columns[index].name = "File".to_owned();
        }
        tables.push(table);
    }
    tables
}

fn length(text: &str) -> usize {
    text.chars().count()
}

/// Returns the columns with widths that hold every head and cell on one line; with those that are left out where
/// there is no room, or without.
fn natural_widths(table: &Table, heads: &[Vec<String>], spacious: bool) -> Vec<Shown> {
    let mut shown = Vec::new();
    for (index, column) in table.columns.iter().enumerate() {
        if column.place == Place::Everywhere || spacious && column.place == Place::Spacious {
            let head = heads.get(index).into_iter().flatten();
            let rows = table.rows.iter().take(MOST_ROWS);
            let cells = rows.filter_map(|row| row.get(index));
            let width = head.chain(cells).map(|text| length(text)).max();
            let width = width.unwrap_or(0);
            shown.push(Shown { index, width });
        }
    }
    shown
}

/// True for a column of names of files, which are shortened before they are broken.
fn is_name(column: &Column) -> bool {
    matches!(column.name.as_str(), "Recording" | "File")
}

/// Returns one row, on as many lines as its longest cell of words needs.
fn row(table: &Table, shown: &[Shown], cells: &[Vec<String>]) -> String {
    let mut columns: Vec<Vec<String>> = Vec::new();
    for column in shown {
        let cell = cells.get(column.index).into_iter().flatten();
        columns.push(match table.columns[column.index].is_number {
            true => cell.cloned().collect(),
            false => cell.flat_map(|text| broken(text, column.width)).collect(),
        });
    }
    let lines = columns.iter().map(Vec::len).max().unwrap_or(0);
    let mut text = String::new();
    for line in 0..lines {
        let mut padded = Vec::new();
        for (column, pieces) in shown.iter().zip(&columns) {
            let piece = pieces.get(line).map_or("", String::as_str);
            let (piece, width) = (piece.replace('\u{a0}', " "), column.width);
            padded.push(match table.columns[column.index].is_number {
                true => format!("{piece:>width$}"),
                false => format!("{piece:<width$}"),
            });
        }
        text.push_str(padded.join("  ").trim_end());
        text.push('\n');
    }
    text
}

/// Returns a text in lines of at most `width` characters, broken between words where that is possible.
fn broken(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in words(text, width) {
        let mut rest: Vec<char> = word.chars().collect();
        let used = lines.last().map_or(0, |line| length(line));
        if used > 0 && used + 1 + rest.len() <= width {
            if let Some(line) = lines.last_mut() {
                line.push(' ');
                line.extend(rest);
            }
            continue;
        }
        while !rest.is_empty() {
            let piece: String = rest.drain(..rest.len().min(width.max(1))).collect();
            match lines.last_mut() {
                Some(line) if line.is_empty() => line.push_str(&piece),
                _ => lines.push(piece),
            }
        }
    }
    lines
}

/// Returns the pieces between which a line may be broken: words, words joined by no-break spaces, and numbers with
/// their sign and unit where these fit into `width` characters.
fn words(text: &str, width: usize) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let pieces = text.split(|c: char| c.is_whitespace() && c != '\u{a0}');
    for piece in pieces.filter(|piece| !piece.is_empty()) {
        let unit = piece.trim_end_matches(['.', ',', ';', ':', ')', '\u{2026}']);
        let follows_number = SIGNS.contains(&piece) || UNITS.split(' ').any(|one| one == unit);
        let joined = words.last_mut().filter(|last| {
            let is_sign = SIGNS.iter().any(|sign| last.ends_with(sign));
            let is_number = last.ends_with(|c: char| c.is_ascii_digit());
            (is_sign || (is_number && follows_number)) && length(last) + 1 + length(piece) <= width
        });
        match joined {
            Some(last) => {
                last.push(' ');
                last.push_str(piece);
            }
            None => words.push(piece.to_owned()),
        }
    }
    words
}

/// Returns a text whose numbers are joined with their signs and units by no-break spaces, for a page.
pub fn joined(text: &str) -> String {
    let words = words(text, usize::MAX).into_iter();
    let joined: Vec<String> = words.map(|word| word.replace(' ', "\u{a0}")).collect();
    joined.join(" ")
}

/// Returns a text in lines of at most `width` characters; lines after the first are indented.
pub(super) fn lines_of(text: &str, width: usize, indent: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    let room = width.saturating_sub(indent);
    for mut word in words(text, room) {
        if length(&word) > room {
            word = word.chars().take(room.saturating_sub(1)).collect();
            word.push('\u{2026}');
        }
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(&word),
            Some(line) if length(line) + 1 + length(&word) <= width => {
                line.push(' ');
                line.push_str(&word);
            }
            _ => lines.push(" ".repeat(indent) + &word),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn prop_a_number_stays_in_the_line_of_its_unit() {
        let text = "tap at 26.04 s accepted: peak 12.5 N, pulse 0.592 ms, still 2.5 \u{b1} 0.1 % (1000 Hz).";
        for width in 24..80 {
            let lines = lines_of(text, width, 2);
            let pieces: Vec<&str> = lines.iter().map(|line| line.trim_start()).collect();
            assert_eq!(pieces.join(" "), text);
            let is_cut = |line: &str| line.ends_with(|c: char| c.is_ascii_digit() || c == '\u{b1}');
            assert!(!lines.iter().any(|line| is_cut(line)), "{lines:?}");
        }
        // Where a number with its unit is too long, it is broken beside the number.
        assert_eq!(
            broken("position 344.7 \u{b1} 6.1 mm", 8),
            ["position", "344.7 \u{b1}", "6.1 mm"]
        );
    }
    #[test]
    fn regress_numbers_are_never_cut() {
        let column = |index: usize| Column {
            name: format!("0\u{2013}10000 Hz: spacing {index} (Hz)"),
            is_number: true,
            place: Place::Everywhere,
        };
        // Few enough for narrow heads, and too many for any.
        for count in [5, 9, 14] {
            let cell = |index: usize| format!("0.123456{index}");
            let table = Table {
                caption: "Wide".into(),
                columns: (10..10 + count).map(column).collect(),
                rows: vec![(10..10 + count).map(cell).collect()],
                note: String::new(),
            };
            let text = Screen::default().table(&table);
            assert!(!text.contains('\u{2026}'), "{text}");
            for index in 10..10 + count {
                assert!(text.contains(&cell(index)), "{index} of {count}:\n{text}");
            }
            for line in text.lines() {
                assert!(line.chars().count() <= 80, "{line}");
            }
        }
    }
}
