//! Tables and sentences for a terminal of 80 columns.

use std::collections::BTreeSet;

use super::format::MISSING;
use super::short_names::ways;
use super::tables::{Column, Kind, Place, Table};

/// Width of the terminal (characters).
pub const WIDTH: usize = 80;

/// Space between columns (characters).
const GAP: usize = 2;
/// Narrowest a column of words is cut to (characters).
const NARROWEST: usize = 8;
/// A column of words this wide reads well (characters): names of files give way for no more.
const READABLE: usize = 24;
/// So many ways to shorten names leave out only what all of them share: these come before a column goes.
const GENTLE: usize = 3;
/// Most rows printed: a terminal is no place for a thousand taps.
const MOST_ROWS: usize = 40;

/// What of a table is printed.
struct Layout {
    table: Table,
    shown: Vec<usize>,
    heads: Vec<Vec<String>>,
    widths: Vec<usize>,
}

/// A table with its caption, in 80 columns. Heads go to two lines where one has no room, names of files
/// are shortened so that they stay apart, columns that can be had elsewhere are left out, then words that do
/// not fit go on below, and at last columns do. Numbers are never cut.
pub fn render_table(table: &Table) -> String {
    let layout = layout(table);
    let mut text = wrapped(&layout.table.caption, 0);
    for part in parts(&layout) {
        text.push_str(&render_part(&part));
    }
    let more = table.rows.len().saturating_sub(MOST_ROWS);
    if more > 0 {
        text.push_str(&format!("... and {more} more\n"));
    }
    text
}

fn render_part(layout: &Layout) -> String {
    let mut text = row(layout, &layout.heads);
    text.push_str(&"-".repeat(total(&layout.widths).min(WIDTH)));
    text.push('\n');
    for cells in layout.table.rows.iter().take(MOST_ROWS) {
        let cells: Vec<Vec<String>> = cells.iter().map(|cell| vec![cell.clone()]).collect();
        text.push_str(&row(layout, &cells));
    }
    text
}

/// Width of columns with the space between them.
fn total(widths: &[usize]) -> usize {
    widths.iter().sum::<usize>() + GAP * widths.len().saturating_sub(1)
}

/// The columns in as many parts as have room side by side, each with the first column, which says what a row is.
fn parts(layout: &Layout) -> Vec<Layout> {
    let mut parts: Vec<(Vec<usize>, Vec<usize>)> = Vec::new();
    for (index, width) in layout.shown.iter().zip(&layout.widths) {
        match parts.last_mut() {
            Some((shown, widths)) if total(widths) + GAP + width <= WIDTH => {
                shown.push(*index);
                widths.push(*width);
            }
            None => parts.push((vec![*index], vec![*width])),
            Some(_) => parts.push((
                vec![layout.shown[0], *index],
                vec![layout.widths[0], *width],
            )),
        }
    }
    let part = |(shown, widths)| Layout {
        table: layout.table.clone(),
        shown,
        heads: layout.heads.clone(),
        widths,
    };
    parts.into_iter().map(part).collect()
}

/// The first layout that has room, in the order of what it costs.
fn layout(table: &Table) -> Layout {
    let named = with_short_names(table);
    let last = named.last().cloned().unwrap_or_else(|| table.clone());
    let spacious = [Place::Everywhere, Place::Spacious];
    let tries = named
        .iter()
        .take(GENTLE)
        .map(|table| (table, &spacious[..]));
    let tries = tries.chain(named.iter().map(|table| (table, &spacious[..1])));
    for (table, places) in tries {
        let shown = shown(table, places);
        for heads in heads(table) {
            let widths = natural_widths(table, &shown, &heads);
            if has_room(table, &shown, &widths) {
                let widths = fitted_widths(table, &shown, widths);
                let table = table.clone();
                return Layout {
                    table,
                    shown,
                    heads,
                    widths,
                };
            }
        }
    }
    let shown = shown(&last, &[Place::Everywhere]);
    let heads = narrow_heads(&last);
    let widths = natural_widths(&last, &shown, &heads);
    let widths = fitted_widths(&last, &shown, widths);
    Layout {
        table: last,
        shown,
        heads,
        widths,
    }
}

/// Heads on one line, and on two.
fn heads(table: &Table) -> Vec<Vec<Vec<String>>> {
    let single = table.columns.iter().map(|c| vec![c.name.clone()]);
    let double = table.columns.iter().map(|c| two_lines(&c.name));
    vec![single.collect(), double.collect()]
}

/// Heads no wider than the cells below them, as far as their words allow, all on as many lines.
fn narrow_heads(table: &Table) -> Vec<Vec<String>> {
    let narrow = |(index, column): (usize, &Column)| {
        let cells = table.rows.iter().filter_map(|row| row.get(index));
        let words = column.name.split(' ').map(length);
        let width = cells.map(|cell| length(cell)).chain(words).max();
        broken(&column.name, width.unwrap_or(0))
    };
    let mut heads: Vec<Vec<String>> = table.columns.iter().enumerate().map(narrow).collect();
    let lines = heads.iter().map(Vec::len).max().unwrap_or(0);
    for head in &mut heads {
        head.splice(..0, vec![String::new(); lines - head.len()]);
    }
    heads
}

fn shown(table: &Table, places: &[Place]) -> Vec<usize> {
    let columns = table.columns.iter().enumerate();
    let shown = columns.filter(|(_, column)| places.contains(&column.place));
    shown.map(|(index, _)| index).collect()
}

/// Whether all columns fit when those of long words shrink to what still reads well.
fn has_room(table: &Table, shown: &[usize], widths: &[usize]) -> bool {
    let least = shown.iter().zip(widths).map(|(index, width)| {
        let shrinks = is_words(table, *index) && !is_name(table, *index);
        if shrinks {
            (*width).min(READABLE)
        } else {
            *width
        }
    });
    least.sum::<usize>() <= room(widths.len())
}

/// The table with its names of files as they are, then shorter and shorter.
fn with_short_names(table: &Table) -> Vec<Table> {
    let Some(index) = (0..table.columns.len()).find(|index| is_name(table, *index)) else {
        return vec![table.clone()];
    };
    let cells = table.rows.iter().filter_map(|row| row.get(index));
    let names: BTreeSet<&String> = cells.filter(|c| !c.is_empty() && *c != MISSING).collect();
    let names: Vec<String> = names.into_iter().cloned().collect();
    let shorter = |way: &Vec<String>| {
        let mut table = table.clone();
        for cell in table.rows.iter_mut().filter_map(|row| row.get_mut(index)) {
            let place = names.iter().position(|name| name == cell);
            if let Some(short) = place.and_then(|place| way.get(place)) {
                cell.clone_from(short);
            }
        }
        if *way != names
            && let Some(column) = table.columns.get_mut(index)
        {
            column.name = "File".to_owned();
        }
        table
    };
    ways(&names).iter().map(shorter).collect()
}

/// A head on two lines: its unit below its name, or its last word.
fn two_lines(name: &str) -> Vec<String> {
    let place = name.rfind(" (").or_else(|| name.rfind(' '));
    match place.map(|place| name.split_at(place)) {
        Some((first, second)) => vec![first.to_owned(), second.trim_start().to_owned()],
        None => vec![String::new(), name.to_owned()],
    }
}

/// Characters that columns share.
fn room(columns: usize) -> usize {
    WIDTH.saturating_sub(GAP * columns.saturating_sub(1))
}

fn length(text: &str) -> usize {
    text.chars().count()
}

/// Widths that hold every head and cell on one line.
fn natural_widths(table: &Table, shown: &[usize], heads: &[Vec<String>]) -> Vec<usize> {
    let width = |index: &usize| {
        let head = heads.get(*index).into_iter().flatten();
        let rows = table.rows.iter().take(MOST_ROWS);
        let cells = rows.filter_map(|row| row.get(*index));
        head.chain(cells)
            .map(|text| length(text))
            .max()
            .unwrap_or(0)
    };
    shown.iter().map(width).collect()
}

/// Widths of the shown columns; where they pass the terminal's, columns of words shrink, and names last.
fn fitted_widths(table: &Table, shown: &[usize], natural: Vec<usize>) -> Vec<usize> {
    let mut widths = natural;
    let room = room(widths.len());
    while widths.iter().sum::<usize>() > room {
        let can_shrink = |place: &usize| widths[*place] > NARROWEST;
        let words = (0..shown.len()).filter(|place| is_words(table, shown[*place]));
        let widest = words
            .filter(can_shrink)
            .max_by_key(|place| (!is_name(table, shown[*place]), widths[*place]));
        match widest.and_then(|place| widths.get_mut(place)) {
            Some(width) => *width -= 1,
            None => break,
        }
    }
    widths
}

fn is_words(table: &Table, index: usize) -> bool {
    let column = table.columns.get(index);
    column.is_some_and(|column| column.kind == Kind::Words)
}

/// Whether a column holds names of files, which are shortened before they are broken.
fn is_name(table: &Table, index: usize) -> bool {
    let column = table.columns.get(index);
    column.is_some_and(|column| matches!(column.name.as_str(), "Recording" | "File"))
}

/// One row, on as many lines as its longest cell of words needs.
fn row(layout: &Layout, cells: &[Vec<String>]) -> String {
    let Layout {
        table,
        shown,
        widths,
        ..
    } = layout;
    let columns: Vec<Vec<String>> = shown
        .iter()
        .zip(widths)
        .map(|(index, width)| {
            let cell = cells.get(*index).into_iter().flatten();
            if is_words(table, *index) {
                cell.flat_map(|text| broken(text, *width)).collect()
            } else {
                cell.cloned().collect()
            }
        })
        .collect();
    let lines = columns.iter().map(Vec::len).max().unwrap_or(0);
    (0..lines)
        .map(|line| {
            let padded: Vec<String> = columns
                .iter()
                .zip(shown.iter().zip(widths))
                .map(|(column, (index, width))| {
                    let text = column.get(line).map_or("", String::as_str);
                    let text = text.replace('\u{a0}', " ");
                    if is_words(table, *index) {
                        format!("{text:<width$}")
                    } else {
                        format!("{text:>width$}")
                    }
                })
                .collect();
            padded.join("  ").trim_end().to_owned() + "\n"
        })
        .collect()
}

/// A text in lines of at most `width` characters, broken between words where that is possible.
fn broken(text: &str, width: usize) -> Vec<String> {
    // A number stays with its unit: "mains 50 Hz".
    let text = text.replace(" Hz", "\u{a0}Hz");
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
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

/// A text of at most `width` characters; "…" stands for what is missing.
pub(super) fn cut(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    let kept: String = text.chars().take(width.saturating_sub(1)).collect();
    kept + "\u{2026}"
}

/// Whether a line may be broken here.
fn is_gap(c: char) -> bool {
    c.is_whitespace() && c != '\u{a0}'
}

/// A text broken into lines of at most 80 characters; lines after the first are indented.
pub fn wrapped(text: &str, indent: usize) -> String {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split(is_gap).filter(|word| !word.is_empty()) {
        let word = cut(word, WIDTH - indent);
        let length = |line: &str| line.chars().count();
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(&word),
            Some(line) if length(line) + 1 + length(&word) <= WIDTH => {
                line.push(' ');
                line.push_str(&word);
            }
            _ => lines.push(" ".repeat(indent) + &word),
        }
    }
    // No-break spaces have kept words together; a terminal, and who searches it, wants plain ones.
    lines.join("\n").replace('\u{a0}', " ") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_numbers_are_never_cut() {
        let column = |index: usize| Column {
            name: format!("0\u{2013}10000 Hz: spacing {index} (Hz)"),
            kind: Kind::Number,
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
            let text = render_table(&table);
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
