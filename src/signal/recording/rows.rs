//! One row after the other, and errors that name the place.

use super::csv::CsvSource;
use super::error::RecordingError;
use super::riff::unreadable;
use super::text::{
    Cell, CellProblem, LineProblem, LineReader, MAX_LINE_BYTES, is_comment, parse_number, shown,
    split_cells,
};

/// Where a row begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RowPlace {
    pub offset: u64,
    pub lines_before: u64,
}

/// Reads rows and turns what is wrong with them into errors that name the place.
#[derive(Debug)]
pub(super) struct RowReader<'a> {
    pub source: &'a CsvSource,
    lines: LineReader,
    pub decimal: Option<u8>,
    cells: Vec<Cell>,
    /// The wanted values of the row that was read last.
    pub values: Vec<f64>,
    /// Bytes of the time cell of that row.
    pub time_cell: Vec<u8>,
    /// Where that row begins.
    pub place: RowPlace,
}

impl<'a> RowReader<'a> {
    pub(super) fn open(source: &'a CsvSource, at: RowPlace) -> Result<Self, RecordingError> {
        let lines = LineReader::open(
            &source.path,
            source.layout.line_end,
            at.offset,
            at.lines_before,
        );
        Ok(Self {
            source,
            lines: lines.map_err(|error| unreadable(&source.file, error))?,
            decimal: source.layout.decimal,
            cells: Vec::new(),
            values: Vec::new(),
            time_cell: Vec::new(),
            place: at,
        })
    }

    /// Reads the next row and its `wanted` columns into `values`; false after the last one.
    pub(super) fn next_row(&mut self, wanted: &[usize]) -> Result<bool, RecordingError> {
        let layout = &self.source.layout;
        let mut blank_line = None;
        loop {
            self.place = RowPlace {
                offset: self.lines.next_offset,
                lines_before: self.lines.number,
            };
            let line = match self.lines.next_line() {
                Ok(Some(line)) => line,
                Ok(None) => return Ok(false),
                Err(problem) => return Err(self.line_error(problem)),
            };
            if line.trim_ascii().is_empty() || line == [0x1a] {
                blank_line.get_or_insert(self.place.lines_before + 1);
                continue;
            }
            if is_comment(line) {
                continue;
            }
            if let (Some(blank), None) = (blank_line, layout.time) {
                let file = self.source.file.clone();
                return Err(RecordingError::BlankLine { file, line: blank });
            }
            split_cells(line, layout.separator, &mut self.cells);
            let cells = RowCells {
                source: self.source,
                number: self.place.lines_before + 1,
                line,
                cells: &self.cells,
            };
            cells.check_count()?;
            cells.parse(wanted, &mut self.decimal, &mut self.values)?;
            if let Some(time) = layout.time {
                self.time_cell.clear();
                self.time_cell.extend_from_slice(cells.cell(time));
            }
            return Ok(true);
        }
    }

    fn line_error(&self, problem: LineProblem) -> RecordingError {
        let file = self.source.file.clone();
        match problem {
            LineProblem::Io(source) => RecordingError::Unreadable { file, source },
            LineProblem::TooLong => RecordingError::LineTooLong {
                file,
                line: self.place.lines_before + 1,
                limit: MAX_LINE_BYTES,
            },
        }
    }
}

/// One line, split.
struct RowCells<'a> {
    source: &'a CsvSource,
    /// Line number, 1-based.
    number: u64,
    line: &'a [u8],
    cells: &'a [Cell],
}

impl RowCells<'_> {
    fn cell(&self, column: usize) -> &[u8] {
        let cell = self.cells.get(column).cloned();
        cell.and_then(|cell| self.line.get(cell))
            .unwrap_or_default()
    }

    /// Too few cells are missing ones; too many must be empty.
    fn check_count(&self) -> Result<(), RecordingError> {
        let columns = self.source.layout.columns.len();
        if self.cells.len() < columns {
            return Err(self.error(self.cells.len(), CellProblem::Missing));
        }
        let surplus = (columns..self.cells.len()).find(|column| !self.cell(*column).is_empty());
        match surplus {
            None => Ok(()),
            Some(column) => Err(RecordingError::SurplusCells {
                file: self.source.file.clone(),
                line: self.number,
                found: self.cells.len(),
                columns,
                value: shown(self.cell(column)),
            }),
        }
    }

    fn parse(
        &self,
        wanted: &[usize],
        decimal: &mut Option<u8>,
        values: &mut Vec<f64>,
    ) -> Result<(), RecordingError> {
        values.clear();
        for column in wanted {
            match parse_number(self.cell(*column), decimal) {
                Ok(value) => values.push(value),
                Err(problem) => return Err(self.error(*column, problem)),
            }
        }
        Ok(())
    }

    fn error(&self, column: usize, problem: CellProblem) -> RecordingError {
        let file = self.source.file.clone();
        let line = self.number;
        let name = self.source.layout.shown_name(column);
        let value = shown(self.cell(column));
        let column = column + 1;
        match problem {
            CellProblem::Missing => RecordingError::MissingCell {
                file,
                line,
                column,
                name,
                columns: self.source.layout.columns.len(),
            },
            CellProblem::Text => RecordingError::TextInCell {
                file,
                line,
                column,
                name,
                value,
            },
            CellProblem::NotFinite => RecordingError::CellNotFinite {
                file,
                line,
                column,
                name,
                value,
            },
            CellProblem::MixedDecimal(decimal) => RecordingError::MixedDecimal {
                file,
                line,
                column,
                name,
                value,
                decimal: char::from(decimal),
            },
        }
    }
}
