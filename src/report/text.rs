//! Tables and findings for a terminal of 80 columns, without colours.

use super::document::Document;
use super::summary::sentences;
use super::tables::{self, Kind, Place, Table};

/// Width of the terminal (characters).
pub const WIDTH: usize = 80;
/// Space between columns (characters).
const GAP: usize = 2;
/// Narrowest a column of words is cut to (characters).
const NARROWEST: usize = 8;
/// Most rows printed: a terminal is no place for a thousand taps.
const MOST_ROWS: usize = 40;

/// Everything the document holds.
pub fn render_text(document: &Document) -> String {
    let sections = [
        recordings(document),
        taps(document),
        modes(document),
        estimate(document),
        prediction(document),
        perturbation(document),
        warnings(document),
        ending(document),
    ];
    let mut text = String::new();
    for section in sections.iter().filter(|section| !section.is_empty()) {
        if !text.is_empty() {
            text.push('\n');
        }
        text.push_str(section);
    }
    text
}

/// The recordings; empty without any.
pub fn recordings(document: &Document) -> String {
    table_or_nothing(tables::recordings(document))
}

/// The taps; empty without any.
pub fn taps(document: &Document) -> String {
    table_or_nothing(tables::taps(document))
}

/// The modes; empty without any.
pub fn modes(document: &Document) -> String {
    table_or_nothing(tables::modes(document))
}

/// The estimate and the pair regression, or why there is none; empty where it was not asked for.
pub fn estimate(document: &Document) -> String {
    match &document.estimate {
        None => String::new(),
        Some(None) => {
            let reason = document.estimate_reason.as_deref();
            let reason = reason.unwrap_or("no reason was recorded");
            wrapped(&format!("No estimate: {reason}."), 0)
        }
        Some(Some(_)) => joined(&[tables::parameters(document), tables::pairs(document)]),
    }
}

/// Measured beside predicted frequencies; empty without a prediction.
pub fn prediction(document: &Document) -> String {
    table_or_nothing(tables::prediction(document))
}

/// What changed frequencies do to the estimate; empty where it was not computed.
pub fn perturbation(document: &Document) -> String {
    joined(&[
        tables::perturbation(document),
        tables::spans(document),
        tables::sensitivity(document),
    ])
}

/// The warnings; empty without any.
pub fn warnings(document: &Document) -> String {
    document
        .warnings
        .iter()
        .map(|warning| wrapped(&format!("warning ({}): {}", warning.code, warning.text), 2))
        .collect()
}

/// What was found: a line or two for each finding.
pub fn ending(document: &Document) -> String {
    let sentences = sentences(document);
    if sentences.is_empty() {
        return String::new();
    }
    let lines = sentences.iter().map(|sentence| wrapped(sentence, 2));
    format!("What was found\n{}", lines.collect::<String>())
}

fn table_or_nothing(table: Option<Table>) -> String {
    table.as_ref().map(render_table).unwrap_or_default()
}

fn joined(tables: &[Option<Table>]) -> String {
    let texts: Vec<String> = tables.iter().flatten().map(render_table).collect();
    texts.join("\n")
}

/// A table with its caption, cut to 80 columns.
pub fn render_table(table: &Table) -> String {
    let shown: Vec<usize> = (0..table.columns.len())
        .filter(|index| {
            let column = table.columns.get(*index);
            column.is_some_and(|column| column.place == Place::Everywhere)
        })
        .collect();
    let widths = widths(table, &shown);
    let mut text = wrapped(&table.caption, 0);
    let heads: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
    text.push_str(&row(table, &shown, &widths, &heads));
    let total = widths.iter().sum::<usize>() + GAP * widths.len().saturating_sub(1);
    text.push_str(&"-".repeat(total.min(WIDTH)));
    text.push('\n');
    for cells in table.rows.iter().take(MOST_ROWS) {
        let cells: Vec<&str> = cells.iter().map(String::as_str).collect();
        text.push_str(&row(table, &shown, &widths, &cells));
    }
    let more = table.rows.len().saturating_sub(MOST_ROWS);
    if more > 0 {
        text.push_str(&format!("... and {more} more\n"));
    }
    text
}

/// Widths of the shown columns; where they pass the terminal's, columns of words shrink.
fn widths(table: &Table, shown: &[usize]) -> Vec<usize> {
    let length = |text: &str| text.chars().count();
    let mut widths: Vec<usize> = shown
        .iter()
        .map(|index| {
            let head = table.columns.get(*index).map_or(0, |c| length(&c.name));
            let rows = table.rows.iter().take(MOST_ROWS);
            let cells = rows.filter_map(|row| row.get(*index)).map(|c| length(c));
            cells.max().unwrap_or(0).max(head)
        })
        .collect();
    let room = WIDTH.saturating_sub(GAP * widths.len().saturating_sub(1));
    while widths.iter().sum::<usize>() > room {
        let widest_words = shown
            .iter()
            .enumerate()
            .filter(|(_, index)| is_words(table, **index))
            .max_by_key(|(place, _)| widths.get(*place))
            .map(|(place, _)| place);
        let width = widest_words.and_then(|place| widths.get_mut(place));
        match width {
            Some(width) if *width > NARROWEST => *width -= 1,
            _ => break,
        }
    }
    widths
}

fn is_words(table: &Table, index: usize) -> bool {
    let column = table.columns.get(index);
    column.is_some_and(|column| column.kind == Kind::Words)
}

fn row(table: &Table, shown: &[usize], widths: &[usize], cells: &[&str]) -> String {
    let padded: Vec<String> = shown
        .iter()
        .zip(widths)
        .map(|(index, width)| {
            let cell = cut(cells.get(*index).copied().unwrap_or(""), *width);
            if is_words(table, *index) {
                format!("{cell:<width$}")
            } else {
                format!("{cell:>width$}")
            }
        })
        .collect();
    let line = cut(padded.join("  ").trim_end(), WIDTH);
    line + "\n"
}

/// A text of at most `width` characters; "…" stands for what is missing.
fn cut(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    let kept: String = text.chars().take(width.saturating_sub(1)).collect();
    kept + "\u{2026}"
}

/// A text broken into lines of at most 80 characters; lines after the first are indented.
fn wrapped(text: &str, indent: usize) -> String {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split_whitespace() {
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
    lines.join("\n") + "\n"
}
