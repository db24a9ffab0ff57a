//! The three tables of a batch: a row for each test, for each mode and for each hypothesis.
//!
//! One list of columns serves all formats. The head of a column ends with its unit: `frequency_Hz`.

use crate::record::{
    BatchRecord, Estimated, HypothesisRow, ModeRow, ParameterRow, Parameters, TestRow,
};
use std::io::{self, Write};
use tapjoint_report::data_files::{cell, number};

/// A table of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableKind {
    /// A row for each test.
    Tests,
    /// A row for each mode, and for each peak that belongs to no mode.
    Modes,
    /// A row for each hypothesis of each diagnosis.
    Hypotheses,
}

/// All tables.
pub const TABLES: [TableKind; 3] = [TableKind::Tests, TableKind::Modes, TableKind::Hypotheses];

/// A column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Head: the name, and the unit where there is one.
    pub head: String,
    /// Unit; "1" for a ratio, empty for texts and counts.
    pub unit: &'static str,
    /// What its cells hold.
    pub kind: CellKind,
}

/// What the cells of a column hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellKind {
    /// Text.
    Text,
    /// Real numbers.
    Number,
    /// Whole numbers from 0.
    Count,
}

/// A cell. What does not exist is `None`.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A text.
    Text(Option<String>),
    /// A real number, in the unit of its column.
    Number(Option<f64>),
    /// A whole number.
    Count(Option<u64>),
}

impl Cell {
    /// Returns the cell as text; empty where it does not exist.
    fn text(self) -> String {
        match self {
            Self::Text(text) => cell(text.unwrap_or_default()),
            Self::Number(value) => number(value),
            Self::Count(count) => count.map(|count| count.to_string()).unwrap_or_default(),
        }
    }
}

/// Heads and units of an estimated value: each has a value, a standard deviation and two limits.
const PARAMETERS: [(&str, &str, &str); 9] = [
    ("kt", "_N_per_m", "N/m"),
    ("kr", "_N_m_per_rad", "N m/rad"),
    ("ktr", "_N_per_rad", "N/rad"),
    ("kx", "", "1"),
    ("ky", "", "1"),
    ("kz", "", "1"),
    ("coupling", "", "1"),
    ("modulus", "_Pa", "Pa"),
    ("density", "_kg_per_m3", "kg/m3"),
];

impl Parameters {
    /// Returns the values in the order of the columns.
    fn all(&self) -> [&Option<Estimated>; 9] {
        [
            &self.kt,
            &self.kr,
            &self.ktr,
            &self.kx,
            &self.ky,
            &self.kz,
            &self.coupling,
            &self.modulus,
            &self.density,
        ]
    }
}

impl TableKind {
    /// Returns the name of its files, without the ending.
    pub fn stem(self) -> &'static str {
        match self {
            Self::Tests => "tests",
            Self::Modes => "modes",
            Self::Hypotheses => "hypotheses",
        }
    }

    /// Returns its columns. `carried` names the carried columns of the input table, which stand last in the table of tests.
    pub fn columns(self, carried: &[String]) -> Vec<Column> {
        let mut columns = vec![count("number"), text("test")];
        match self {
            Self::Tests => {
                columns.extend([
                    text("outcome"),
                    text("error"),
                    text("name"),
                    text("kind"),
                    count("recordings"),
                    count("taps_accepted"),
                    count("taps_rejected"),
                    count("modes"),
                    text("method"),
                    text("modes_used"),
                ]);
                for (name, suffix, unit) in PARAMETERS {
                    for part in ["", "_std", "_low", "_high"] {
                        columns.push(real(&format!("{name}{part}{suffix}"), unit));
                    }
                }
                columns.extend([
                    real("goodness_of_fit", "1"),
                    real("misfit_percent", "%"),
                    text("headline"),
                ]);
                for (name, suffix, unit) in &PARAMETERS[..2] {
                    for part in ["", "_low", "_high"] {
                        columns.push(real(&format!("headline_{name}{part}{suffix}"), unit));
                    }
                }
                columns.extend([
                    text("verdict"),
                    text("effects"),
                    text("first_hypothesis"),
                    real("first_probability", "1"),
                    count("checks"),
                    text("doubtful_checks"),
                    text("bad_checks"),
                    count("warnings"),
                    text("warning_codes"),
                ]);
                columns.extend(carried.iter().map(|head| text(head)));
            }
            Self::Modes => columns.extend([
                count("mode"),
                text("label"),
                text("recording"),
                text("method"),
                real("frequency_Hz", "Hz"),
                real("std_Hz", "Hz"),
                real("low_Hz", "Hz"),
                real("high_Hz", "Hz"),
                real("half_line_Hz", "Hz"),
                real("damping", "1"),
                real("damping_std", "1"),
                real("damping_low", "1"),
                real("damping_high", "1"),
                real("lambda", "1"),
                real("coherence", "1"),
                real("predicted_Hz", "Hz"),
                real("error_percent", "%"),
                text("used"),
            ]),
            Self::Hypotheses => columns.extend([
                count("rank"),
                text("hypothesis"),
                text("group"),
                real("probability", "1"),
                real("log_bayes_factor", "1"),
                text("confounded_with"),
                text("parameters"),
                real("gap_before_percent", "%"),
                real("gap_after_percent", "%"),
                real("withheld_before_percent", "%"),
                real("withheld_after_percent", "%"),
                real("withheld_closure", "1"),
            ]),
        }
        columns
    }

    /// Returns the rows that a record has in this table. `number` is the place of its test in the batch, from 1: rows of one
    /// file have the same name.
    pub fn rows(self, number: u64, record: &BatchRecord) -> Vec<Vec<Cell>> {
        let rows = match self {
            Self::Tests => vec![test_cells(&record.test)],
            Self::Modes => record.modes.iter().map(mode_cells).collect(),
            Self::Hypotheses => {
                let ranked = (1..).zip(&record.hypotheses);
                ranked
                    .map(|(rank, one)| hypothesis_cells(rank, one))
                    .collect()
            }
        };
        let file = Cell::Text(Some(record.test.file.clone()));
        let first = [Cell::Count(Some(number)), file];
        let whole = rows.into_iter().map(|row| [&first[..], &row].concat());
        whole.collect()
    }
}

fn text(head: &str) -> Column {
    Column {
        head: head.to_owned(),
        unit: "",
        kind: CellKind::Text,
    }
}

fn real(head: &str, unit: &'static str) -> Column {
    Column {
        unit,
        kind: CellKind::Number,
        ..text(head)
    }
}

fn count(head: &str) -> Column {
    Column {
        kind: CellKind::Count,
        ..text(head)
    }
}

/// Returns words or numbers with blanks between them; no cell without any.
fn listed<T: ToString>(items: &[T]) -> Cell {
    let items: Vec<String> = items.iter().map(T::to_string).collect();
    Cell::Text((!items.is_empty()).then(|| items.join(" ")))
}

fn test_cells(row: &TestRow) -> Vec<Cell> {
    use Cell::{Count, Number, Text};
    let mut cells = vec![
        Text(Some(row.outcome.name().to_owned())),
        Text(row.error.clone()),
        Text(Some(row.name.clone())),
        Text(row.kind.clone()),
        Count(Some(row.recordings)),
        Count(Some(row.taps_accepted)),
        Count(Some(row.taps_rejected)),
        Count(Some(row.modes)),
        Text(row.method.clone()),
        listed(&row.modes_used),
    ];
    for value in row.parameters.all() {
        let value = value.unwrap_or_default();
        cells.extend([value.value, value.std, value.low, value.high].map(Number));
    }
    cells.extend([
        Number(row.goodness_of_fit),
        Number(row.misfit_percent),
        Text(row.headline.clone()),
    ]);
    for value in [row.headline_kt, row.headline_kr] {
        let value = value.unwrap_or_default();
        cells.extend([value.value, value.low, value.high].map(Number));
    }
    cells.extend([
        Text(row.verdict.clone()),
        listed(&row.effects),
        Text(row.first_hypothesis.clone()),
        Number(row.first_probability),
        Count(Some(row.checks)),
        listed(&row.doubtful_checks),
        listed(&row.bad_checks),
        Count(Some(row.warnings)),
        listed(&row.warning_codes),
    ]);
    cells.extend(row.carried.iter().map(|one| Text(Some(one.clone()))));
    cells
}

fn mode_cells(row: &ModeRow) -> Vec<Cell> {
    use Cell::{Count, Number, Text};
    vec![
        Count(row.mode),
        Text(row.label.clone()),
        Text(row.recording.clone()),
        Text(Some(row.method.clone())),
        Number(row.frequency),
        Number(row.std),
        Number(row.low),
        Number(row.high),
        Number(row.half_line),
        Number(row.damping),
        Number(row.damping_std),
        Number(row.damping_low),
        Number(row.damping_high),
        Number(row.lambda),
        Number(row.coherence),
        Number(row.predicted),
        Number(row.error_percent),
        Text(row.used.map(|used| used.to_string())),
    ]
}

fn hypothesis_cells(rank: u64, row: &HypothesisRow) -> Vec<Cell> {
    use Cell::{Count, Number, Text};
    let parameters: Vec<String> = row.parameters.iter().map(parameter).collect();
    vec![
        Count(Some(rank)),
        Text(Some(row.effect.clone())),
        Text(row.group.clone()),
        Number(row.probability),
        Number(row.log_bayes_factor),
        listed(&row.confounded_with),
        listed(&parameters),
        Number(row.gap_before),
        Number(row.gap_after),
        Number(row.withheld_before),
        Number(row.withheld_after),
        Number(row.withheld_closure),
    ]
}

/// Returns "sensor-mass.mass=0.0241" or, with a standard uncertainty, "sensor-mass.mass=0.0241+-0.0003".
fn parameter(row: &ParameterRow) -> String {
    let value = format!("{}={}", row.name, number(row.value));
    match row.std {
        Some(std) => format!("{value}+-{}", number(Some(std))),
        None => value,
    }
}

/// Writes one table as comma separated values, record by record.
#[derive(Debug)]
pub struct TableWriter<W: Write> {
    kind: TableKind,
    /// Number of records so far.
    count: u64,
    writer: csv::Writer<W>,
}

impl<W: Write> TableWriter<W> {
    /// Writes the line of heads.
    ///
    /// # Errors
    /// The line cannot be written.
    pub fn new(kind: TableKind, carried: &[String], to: W) -> io::Result<Self> {
        let mut writer = csv::Writer::from_writer(to);
        let columns = kind.columns(carried).into_iter();
        writer.write_record(columns.map(|column| cell(column.head)))?;
        Ok(Self {
            kind,
            count: 0,
            writer,
        })
    }

    /// Writes the rows of the next record.
    ///
    /// # Errors
    /// A row cannot be written.
    pub fn add(&mut self, record: &BatchRecord) -> io::Result<()> {
        self.count += 1;
        for row in self.kind.rows(self.count, record) {
            self.writer.write_record(row.into_iter().map(Cell::text))?;
        }
        Ok(())
    }

    /// Writes what is still held back.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_every_row_has_as_many_cells_as_columns() {
        let record = BatchRecord {
            test: TestRow {
                carried: vec!["7".to_owned()],
                ..TestRow::default()
            },
            modes: vec![ModeRow::default()],
            hypotheses: vec![HypothesisRow::default()],
        };
        for kind in TABLES {
            let columns = kind.columns(&["serial".to_owned()]);
            for row in kind.rows(1, &record) {
                assert_eq!(row.len(), columns.len(), "{kind:?}");
                for (cell, column) in row.iter().zip(&columns) {
                    let kind = match cell {
                        Cell::Text(_) => CellKind::Text,
                        Cell::Number(_) => CellKind::Number,
                        Cell::Count(_) => CellKind::Count,
                    };
                    assert_eq!(kind, column.kind, "{column:?}");
                }
            }
        }
    }

    #[test]
    fn limit_no_carried_cell_is_a_formula() {
        let mut bytes = Vec::new();
        let mut table =
            TableWriter::new(TableKind::Tests, &["=A1".to_owned()], &mut bytes).unwrap();
        table
            .add(&BatchRecord::failed(
                "a.wav",
                &["=B1".to_owned()],
                "bad".to_owned(),
                &[],
            ))
            .unwrap();
        table.finish().unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.lines().all(|line| line.contains(",'=")), "{text}");
    }
}
