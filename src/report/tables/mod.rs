//! The report's tables as words, for the page and for the terminal.

mod gap;
mod joint;
mod modes;
mod quality;
mod recordings;
mod resolution;
mod uncertainty;

pub use super::words::gap::{gap_in_short, gap_story, place_of};
pub use gap::{hypotheses, next_tests};
pub use joint::{Parameter, correlations, estimated, methods, pairs, parameters};
pub use modes::{
    fitted_to, frfs, mode_details, modes, modes_from, prediction, reading_details, readings,
};
pub use quality::{quality, quality_all, quality_count, quality_doubts};
pub use recordings::{
    channels, conditions, datasets, peak_unit, recordings, rejected_taps, taps, taps_used,
};
pub use resolution::{resolution_frequencies, resolution_lines, resolution_stiffnesses};
pub use uncertainty::{averages, monte_carlo, perturbation, sensitivity, spans};

use super::document::{Document, ModeSection, ReadBy};
use super::format::MISSING;
use tapjoint_identify::observation::UNPAIRED;

/// A table of words.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// What it shows.
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
    /// Whether a narrow terminal shows it.
    pub place: Place,
}

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Numbers.
    Number,
    /// Words.
    Words,
}

impl Kind {
    /// Whether the column holds numbers.
    pub fn is_number(self) -> bool {
        self == Kind::Number
    }
}

/// Where a column is shown.
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
fn number(name: &str) -> Column {
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
    /// The same table without the column of this name.
    fn without_column(mut self, name: &str) -> Table {
        if let Some(index) = self.columns.iter().position(|column| column.name == name) {
            self.columns.remove(index);
            for row in self.rows.iter_mut().filter(|row| index < row.len()) {
                row.remove(index);
            }
        }
        self
    }

    /// The same table without the columns whose names are unwanted.
    fn without_columns(self, unwanted: impl Fn(&str) -> bool) -> Table {
        let names: Vec<String> = self
            .columns
            .iter()
            .map(|column| column.name.clone())
            .collect();
        let names = names.iter().filter(|name| unwanted(name));
        names.fold(self, |table, name| table.without_column(name))
    }

    /// The same table without the columns in which nothing stands.
    fn without_empty_columns(mut self) -> Table {
        let says = |cell: Option<&String>| cell.is_some_and(|c| !c.is_empty() && c != MISSING);
        let kept: Vec<bool> = (0..self.columns.len())
            .map(|index| self.rows.iter().any(|row| says(row.get(index))))
            .collect();
        let mut flags = kept.iter();
        self.columns.retain(|_| flags.next() == Some(&true));
        for row in &mut self.rows {
            let mut flags = kept.iter();
            row.retain(|_| flags.next() == Some(&true));
        }
        self
    }
}

impl Column {
    /// Whether its cells hold sentences or lists, which need several lines.
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

    /// The same column, on the page only.
    fn on_page(mut self) -> Column {
        self.place = Place::Page;
        self
    }

    /// The same column, in a terminal only where there is room.
    fn where_room(mut self) -> Column {
        self.place = Place::Spacious;
        self
    }

    /// The same column, on the page only where a condition holds.
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

/// A coherence in four digits; one that only rounding would make 1 is said to be above 0.9999.
fn coherence(value: Option<f64>) -> String {
    match value {
        None => MISSING.to_owned(),
        Some(value) if value > 0.9999 => ">0.9999".to_owned(),
        Some(value) => format!("{value:.4}"),
    }
}
