//! The report's tables as words, for the page and for the terminal.

mod answer;
mod comparison;
mod diagnosis;
mod joint;
mod modes;
mod recordings;
mod series;

pub use answer::{
    AnsweredValue, Limited, answered_changes, answered_joint, answered_modes, answered_values,
};
pub use comparison::{changed_dampings, changed_joint, changed_modes, changes, compared_tests};
pub use diagnosis::{hypotheses, next_tests};
pub(crate) use joint::patterns_in_words;
pub use joint::{
    Parameter, averages, budget, correlation_words, correlations, estimated, methods, monte_carlo,
    pairs, parameters, perturbation, sensitivity, set_up_words, spans,
};
pub use modes::{
    fitted_to, free_test, frfs, left_out, lengths, mode_details, modes, modes_from, prediction,
    reading_details, readings,
};
pub use recordings::{
    channels, conditions, datasets, hammer, quality, quality_all, quality_count, quality_doubts,
    recordings, rejected_taps, taps, taps_used,
};
pub use series::{control_charts, tests_of_series};

use crate::document::{Document, ModeSection, ReadBy};
use crate::format::MISSING;
use tapjoint_identify::observation::UNPAIRED;

/// A table of words.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Its heading.
    pub caption: String,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Its rows: as many words as columns.
    pub rows: Vec<Vec<String>>,
    /// A sentence under it; may be empty.
    pub note: String,
}

/// A column's head.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name, with the unit in round brackets.
    pub name: String,
    /// True for numbers, which are aligned right; words are aligned left.
    pub is_number: bool,
    /// Outputs that show it.
    pub place: Place,
}

/// Outputs that show a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Everywhere.
    Everywhere,
    /// On the page, and in a terminal where 80 columns have room for it.
    Spacious,
    /// On the page only: a terminal of 80 columns has no room.
    Page,
}

/// A cell with the head of its column.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    column: Column,
    text: String,
}

/// A cell of a column of numbers shown everywhere.
pub fn number(name: &str, text: impl Into<String>) -> Cell {
    Cell {
        column: Column {
            name: name.to_owned(),
            is_number: true,
            place: Place::Everywhere,
        },
        text: text.into(),
    }
}

/// A cell of a column of words shown everywhere.
pub fn words(name: &str, text: impl Into<String>) -> Cell {
    let mut cell = number(name, text);
    cell.column.is_number = false;
    cell
}

/// A cell of a column of numbers on the page.
fn page_number(name: &str, text: impl Into<String>) -> Cell {
    number(name, text).on_page_if(true)
}

/// A cell of a column of words on the page.
fn page_words(name: &str, text: impl Into<String>) -> Cell {
    words(name, text).on_page_if(true)
}

impl Cell {
    /// Returns the cell, its column on the page only where a condition holds.
    fn on_page_if(mut self, crowded: bool) -> Cell {
        if crowded {
            self.column.place = Place::Page;
        }
        self
    }
}

impl Table {
    /// A table of these rows, whose cells bring their heads along; without rows it has no columns.
    pub fn of<R: IntoIterator<Item = Cell>>(
        caption: impl Into<String>,
        rows: impl IntoIterator<Item = R>,
        note: impl Into<String>,
    ) -> Table {
        let mut table = Table {
            caption: caption.into(),
            note: note.into(),
            ..Table::default()
        };
        for row in rows {
            let cells = row.into_iter().map(|cell| (cell.column, cell.text));
            let (columns, texts) = cells.unzip();
            table.columns = columns;
            table.rows.push(texts);
        }
        table
    }

    /// A table with the heads of these cells, also where it has no rows.
    pub(crate) fn with_heads(
        caption: impl Into<String>,
        heads: impl IntoIterator<Item = Cell>,
        rows: Vec<Vec<String>>,
        note: impl Into<String>,
    ) -> Table {
        Table {
            rows,
            ..Table::of(caption, [heads], note)
        }
    }

    /// Returns the table without the columns of these names.
    fn without_columns(self, unwanted: &[&str]) -> Table {
        let names = self.columns.iter();
        let kept = names.map(|column| !unwanted.contains(&column.name.as_str()));
        let kept = kept.collect();
        self.with_columns(kept)
    }

    /// Returns the table without the columns that are empty in every row.
    fn without_empty_columns(self) -> Table {
        let mut kept = vec![false; self.columns.len()];
        for row in &self.rows {
            for (kept, cell) in kept.iter_mut().zip(row) {
                *kept |= !cell.is_empty() && cell != MISSING;
            }
        }
        self.with_columns(kept)
    }

    /// Returns the table with the columns that are marked.
    fn with_columns(mut self, kept: Vec<bool>) -> Table {
        let mut marks = kept.iter();
        self.columns.retain(|_| marks.next() == Some(&true));
        for row in &mut self.rows {
            let mut marks = kept.iter();
            row.retain(|_| marks.next() == Some(&true));
        }
        self
    }
}

impl Column {
    /// True where its cells hold sentences or lists, which need several lines.
    pub fn is_long(&self) -> bool {
        const LONG: [&str; 8] = [
            "Reason",
            "What happened",
            "Why it might be",
            "What helps",
            "Size",
            "Looks like",
            "Test",
            "Tells apart",
        ];
        LONG.contains(&self.name.as_str())
    }
}

/// Bound of the best reading of a mode (Hz): half the interval of a fit, the bound of a reading between
/// the lines, else the half line, else two standard deviations.
pub fn reading_bound(document: &Document, mode: usize) -> Option<f64> {
    bound_of(mode_of(document, mode)?)
}

/// The resonance that carries a mode number.
fn mode_of(document: &Document, mode: usize) -> Option<&ModeSection> {
    let modes = document.modes.as_deref().unwrap_or_default();
    modes.iter().find(|entry| entry.mode == Some(mode))
}

/// Bound of a resonance's best frequency (Hz).
pub fn bound_of(mode: &ModeSection) -> Option<f64> {
    let half = mode.low.zip(mode.high);
    let half = half.map(|(low, high)| 0.5 * (high - low));
    let own = match mode.method {
        Some(ReadBy::Interpolated) => mode.interpolated_bound,
        // A line that coarser lines show as a resonance has a wider bound than half a line.
        Some(ReadBy::Fit | ReadBy::Line) => half,
        None => None,
    };
    own.or(mode.half_line)
        .or(mode.std.map(|std| 2.0 * std))
        .filter(|bound| bound.is_finite() && *bound > 0.0)
}

/// Returns "1, 2, 5".
pub(crate) fn listed(modes: &[usize]) -> String {
    let modes: Vec<String> = modes.iter().map(usize::to_string).collect();
    modes.join(", ")
}

/// "4", "mains 50 Hz" or "845.7 + 80.5 Hz", from a resonance's number and its label.
fn mode_name(number: Option<usize>, label: Option<&str>) -> String {
    match number {
        Some(number) => number.to_string(),
        None => label.unwrap_or(UNPAIRED).to_owned(),
    }
}

/// A coherence in four digits; one that only rounding would make 1 is written ">0.9999".
fn coherence(value: Option<f64>) -> String {
    match value {
        None => MISSING.to_owned(),
        Some(value) if value > 0.9999 => ">0.9999".to_owned(),
        Some(value) => format!("{value:.4}"),
    }
}
