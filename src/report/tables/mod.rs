//! The report's tables as words, for the page and for the terminal.

mod gap;
mod joint;
mod modes;
mod quality;
mod recordings;
mod uncertainty;

pub use gap::{hypotheses, next_tests};
pub use joint::{Parameter, correlations, estimated, methods, pairs, parameters};
pub use modes::{
    fitted_to, frfs, mode_details, modes, modes_from, prediction, reading_details, readings,
};
pub use quality::{quality, quality_all, quality_count, quality_doubts};
pub use recordings::{
    channels, conditions, datasets, peak_unit, recordings, rejected_taps, taps, taps_used,
};
pub use uncertainty::{averages, monte_carlo, perturbation, sensitivity, spans};

use super::document::{Document, ModeSection, ReadBy};
use super::format::MISSING;
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
    /// Numbers are aligned right, words left.
    pub kind: Kind,
    /// Outputs that show it.
    pub place: Place,
}

/// Kind of cells of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Numbers.
    Number,
    /// Words.
    Words,
}

impl Kind {
    /// True for a column of numbers.
    pub fn is_number(self) -> bool {
        self == Kind::Number
    }
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

/// A column of numbers shown everywhere.
pub(crate) fn number(name: &str) -> Column {
    Column {
        name: name.to_owned(),
        kind: Kind::Number,
        place: Place::Everywhere,
    }
}

/// A column of words shown everywhere.
fn words(name: &str) -> Column {
    Column {
        name: name.to_owned(),
        kind: Kind::Words,
        place: Place::Everywhere,
    }
}

impl Table {
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

    /// Returns the column, on the page only.
    fn on_page(self) -> Column {
        Column {
            place: Place::Page,
            ..self
        }
    }

    /// Returns the column, on the page only where a condition holds.
    fn on_page_if(self, crowded: bool) -> Column {
        if crowded { self.on_page() } else { self }
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
    let own = match mode.method {
        Some(ReadBy::Interpolated) => mode.interpolated_bound,
        Some(ReadBy::Fit) => mode
            .low
            .zip(mode.high)
            .map(|(low, high)| 0.5 * (high - low)),
        Some(ReadBy::Line) | None => None,
    };
    own.or(mode.half_line)
        .or(mode.std.map(|std| 2.0 * std))
        .filter(|bound| bound.is_finite() && *bound > 0.0)
}

/// "4" or "mains 50 Hz", from a resonance's number and its label.
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
