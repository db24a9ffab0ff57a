//! Tables and findings for a terminal of 80 columns, without colours.

use super::brief::brief;
use super::document::Document;
use super::format::signed_percent;
use super::tables::{self, Kind, Place, Table};

/// Width of the terminal (characters).
pub const WIDTH: usize = 80;
/// Space between columns (characters).
const GAP: usize = 2;
/// Narrowest a column of words is cut to (characters).
const NARROWEST: usize = 8;
/// Most taps listed one by one.
const MOST_TAPS: usize = 10;
/// Most rows printed: a terminal is no place for a thousand taps.
const MOST_ROWS: usize = 40;

/// Everything the document holds.
pub fn render_text(document: &Document) -> String {
    let sections = [
        table_or_nothing(tables::datasets(document)),
        recordings(document),
        taps(document),
        modes(document),
        frfs(document),
        estimate(document),
        prediction(document),
        super::gap_text::gap(document),
        perturbation(document),
        quality(document),
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

/// The recordings, and of recordings that were only looked at their channels; empty without any.
pub fn recordings(document: &Document) -> String {
    let inspected = document.modes.is_none();
    let channels = tables::channels(document).filter(|_| inspected);
    joined(&[tables::recordings(document), channels])
}

/// The taps; empty without any. Of many taps the rejected ones, and how many were used.
pub fn taps(document: &Document) -> String {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let count: usize = recordings
        .iter()
        .map(|recording| recording.taps.len())
        .sum();
    if count > MOST_TAPS {
        joined(&[tables::taps_used(document), tables::rejected_taps(document)])
    } else {
        table_or_nothing(tables::taps(document))
    }
}

/// The modes; empty without any, and where their frequency response functions are listed.
pub fn modes(document: &Document) -> String {
    let listed = document.frfs.as_ref().is_some_and(|frfs| !frfs.is_empty());
    let Some(table) = tables::modes(document).filter(|_| !listed) else {
        return String::new();
    };
    let modes = document.modes.as_deref().unwrap_or_default();
    let fitted = modes.iter().any(|mode| mode.method == "fit");
    let note = if fitted {
        let note = format!(
            "Frequency: fit of {}, \u{b1} half the 95 % interval; line: the highest spectral line \
             \u{b1} half line; damping \u{b1} one standard deviation.",
            tables::fitted_to(document)
        );
        wrapped(&note, 0)
    } else {
        String::new()
    };
    render_table(&table) + &note
}

/// The resonances on the frequency response functions; empty where those were not asked for.
pub fn frfs(document: &Document) -> String {
    noted(tables::frfs(document))
}

/// The estimate and how far its regression closes, or why there is none; empty where it was not
/// asked for.
pub fn estimate(document: &Document) -> String {
    match &document.estimate {
        None => String::new(),
        Some(None) => {
            let reason = document.estimate_reason.as_deref();
            let reason = reason.unwrap_or("no reason was recorded");
            wrapped(&format!("No estimate: {reason}."), 0)
        }
        Some(Some(found)) => {
            let mut text = table_or_nothing(tables::parameters(document));
            if let Some(methods) = tables::methods(document) {
                text.push('\n');
                text.push_str(&render_table(&methods));
            }
            let closure = found.pairs.as_ref().and_then(|pairs| pairs.closure);
            if let Some(closure) = closure {
                let percent = signed_percent(Some(100.0 * closure));
                let words = format!(
                    "From modes {}. The pair regression closes to {percent} % (0: no contradiction).",
                    listed(&found.modes_used)
                );
                text.push_str(&wrapped(&words, 0));
            }
            text
        }
    }
}

fn listed(modes: &[usize]) -> String {
    let modes: Vec<String> = modes.iter().map(usize::to_string).collect();
    modes.join(", ")
}

/// Measured beside predicted frequencies; empty without a prediction.
pub fn prediction(document: &Document) -> String {
    table_or_nothing(tables::prediction(document))
}

/// What changed frequencies do to the estimate; empty where it was not computed.
pub fn perturbation(document: &Document) -> String {
    let texts = [
        table_or_nothing(tables::perturbation(document)),
        table_or_nothing(tables::averages(document)),
        noted(tables::spans(document)),
        noted(tables::sensitivity(document)),
        noted(tables::monte_carlo(document)),
    ];
    let texts: Vec<String> = texts.into_iter().filter(|text| !text.is_empty()).collect();
    texts.join("\n")
}

/// The checks of good practice that leave a doubt; empty without any. The ending counts them all.
pub fn quality(document: &Document) -> String {
    table_or_nothing(tables::quality_doubts(document))
}

/// The warnings; empty without any.
pub fn warnings(document: &Document) -> String {
    document
        .warnings
        .iter()
        .map(|warning| wrapped(&format!("warning ({}): {}", warning.code, warning.text), 2))
        .collect()
}

/// What was found, in five lines at most (longer where a reason has to be told).
pub fn ending(document: &Document) -> String {
    let lines = brief(document);
    if lines.is_empty() {
        return String::new();
    }
    let lines = lines
        .iter()
        .map(|(about, words)| wrapped(&format!("{:\u{a0}<8}{words}", about), 8));
    format!("What was found\n{}", lines.collect::<String>())
}

/// A table with what its columns mean.
pub(super) fn noted(table: Option<Table>) -> String {
    table.map_or(String::new(), |table| {
        render_table(&table) + &wrapped(&table.note, 0)
    })
}

fn table_or_nothing(table: Option<Table>) -> String {
    table.as_ref().map(render_table).unwrap_or_default()
}

fn joined(tables: &[Option<Table>]) -> String {
    let texts: Vec<String> = tables.iter().flatten().map(render_table).collect();
    texts.join("\n")
}

/// A table with its caption, in 80 columns: words that do not fit go on below, and heads go to two
/// lines where one has no room.
pub fn render_table(table: &Table) -> String {
    let shown: Vec<usize> = (0..table.columns.len())
        .filter(|index| {
            let column = table.columns.get(*index);
            column.is_some_and(|column| column.place == Place::Everywhere)
        })
        .collect();
    let single: Vec<Vec<String>> = table.columns.iter().map(|c| vec![c.name.clone()]).collect();
    let double: Vec<Vec<String>> = table.columns.iter().map(|c| two_lines(&c.name)).collect();
    let wide = natural_widths(table, &shown, &single);
    let (heads, natural) = if wide.iter().sum::<usize>() <= room(wide.len()) {
        (single, wide)
    } else {
        let narrow = natural_widths(table, &shown, &double);
        (double, narrow)
    };
    let widths = fitted_widths(table, &shown, natural);
    let mut text = wrapped(&table.caption, 0);
    text.push_str(&row(table, &shown, &widths, &heads));
    let total = widths.iter().sum::<usize>() + GAP * widths.len().saturating_sub(1);
    text.push_str(&"-".repeat(total.min(WIDTH)));
    text.push('\n');
    for cells in table.rows.iter().take(MOST_ROWS) {
        let cells: Vec<Vec<String>> = cells.iter().map(|cell| vec![cell.clone()]).collect();
        text.push_str(&row(table, &shown, &widths, &cells));
    }
    let more = table.rows.len().saturating_sub(MOST_ROWS);
    if more > 0 {
        text.push_str(&format!("... and {more} more\n"));
    }
    text
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

/// Widths of the shown columns; where they pass the terminal's, columns of words shrink.
fn fitted_widths(table: &Table, shown: &[usize], natural: Vec<usize>) -> Vec<usize> {
    let mut widths = natural;
    let room = room(widths.len());
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

/// Whether a column holds names of files, which are shortened rather than broken.
fn is_name(table: &Table, index: usize) -> bool {
    let column = table.columns.get(index);
    column.is_some_and(|column| matches!(column.name.as_str(), "Recording" | "File"))
}

/// A name of at most `width` characters: its middle gives way, for the beginning tells the test and
/// the end the visit.
fn shortened(name: &str, width: usize) -> String {
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= width {
        return name.to_owned();
    }
    // The column's own head is a word, not a name: a shorter word stands for it.
    if name == "Recording" {
        return "File".to_owned();
    }
    let kept = width.saturating_sub(1);
    let (head, tail) = (kept - kept / 2, kept / 2);
    let first = letters.iter().take(head);
    let last = letters.iter().skip(letters.len() - tail);
    first.chain(&['\u{2026}']).chain(last).collect()
}

/// One row, on as many lines as its longest cell of words needs.
fn row(table: &Table, shown: &[usize], widths: &[usize], cells: &[Vec<String>]) -> String {
    let columns: Vec<Vec<String>> = shown
        .iter()
        .zip(widths)
        .map(|(index, width)| {
            let cell = cells.get(*index).into_iter().flatten();
            if is_name(table, *index) {
                cell.map(|text| shortened(text, *width)).collect()
            } else if is_words(table, *index) {
                cell.flat_map(|text| broken(text, *width)).collect()
            } else {
                cell.map(|text| cut(text, *width)).collect()
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
            cut(padded.join("  ").trim_end(), WIDTH) + "\n"
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
fn cut(text: &str, width: usize) -> String {
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
pub(super) fn wrapped(text: &str, indent: usize) -> String {
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
