//! Rows of a text file as numbers, checked line by line, with a sparse index for jumping.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::RecordingError;
use super::layout::{self, CsvLayout, HeadExtent};
use super::riff::{MAX_CHANNELS, read_fully, unreadable};
use super::text::{
    Cell, CellProblem, LineProblem, LineReader, MAX_LINE_BYTES, is_comment, parse_number, shown,
    split_cells,
};
use super::time::{TimeCheck, UnevenStep};
use super::units::channel_unit;

/// Bytes from which the layout is decided: thousands of ordinary rows.
const HEAD_BYTES: usize = 1 << 18;

/// Rows between two entries of the index: some 100 kB of text, read in under a millisecond.
const INDEX_ROWS: u64 = 4096;

/// Where every 4096th row begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct IndexEntry {
    offset: u64,
    lines_before: u64,
}

/// A text file that has been read once.
#[derive(Debug, Clone)]
pub(super) struct CsvSource {
    pub path: PathBuf,
    pub file: String,
    pub layout: CsvLayout,
    pub frames: u64,
    index: Arc<Vec<IndexEntry>>,
}

/// What the opening pass finds beside the samples.
pub(super) struct CsvRates {
    /// By the time column: from first and last time, and the one to use (Hz).
    pub by_time: Option<(f64, f64)>,
    /// A column that rises evenly though it is not named as time, 0-based.
    pub unnamed_time: Option<usize>,
}

impl CsvSource {
    /// Reads the whole file once, hands every block of channel values to `sink`, and remembers
    /// where rows begin.
    pub(super) fn open(
        path: &Path,
        file: &str,
        mut sink: impl FnMut(&[Vec<f64>]),
    ) -> Result<(Self, CsvRates), RecordingError> {
        let head = read_head(path, file)?;
        let layout = layout::detect(&head, extent(&head), file)?;
        check_columns(&layout, file)?;
        let mut source = Self {
            path: path.to_owned(),
            file: file.to_owned(),
            layout,
            frames: 0,
            index: Arc::new(Vec::new()),
        };
        let time_factor = source.time_factor()?;
        let mut pass = OpeningPass::new(&source, &head)?;
        pass.run(&mut sink)?;
        let (decimal, frames) = (pass.rows.decimal, pass.frames);
        let rates = CsvRates {
            by_time: pass.time.and_then(|time| time.sample_rate(time_factor)),
            unnamed_time: match source.layout.time {
                Some(_) => None,
                None => layout::evenly_rising_column(&head, extent(&head), &source.layout),
            },
        };
        let index = pass.index;
        source.layout.decimal = decimal;
        source.frames = frames;
        source.index = Arc::new(index);
        Ok((source, rates))
    }

    /// Positions a reader at row `frame`.
    pub(super) fn cursor(&self, frame: u64) -> Result<CsvCursor<'_>, RecordingError> {
        let at = frame.min(self.frames);
        let slot = usize::try_from(at / INDEX_ROWS).unwrap_or(usize::MAX);
        let last = self.index.len().saturating_sub(1);
        let entry = self.index.get(slot.min(last)).copied();
        let entry = entry.unwrap_or(IndexEntry {
            offset: self.layout.start,
            lines_before: self.layout.lines_before,
        });
        let mut rows = RowReader::open(self, entry)?;
        for _ in slot.min(last) as u64 * INDEX_ROWS..at {
            rows.next_row(&[])?;
        }
        Ok(CsvCursor {
            columns: self.layout.channel_columns(),
            rows,
            at,
        })
    }

    /// Factor from the time column's unit to seconds.
    ///
    /// The unit stands in brackets, or at the end of the name ("t_ms"); without one it is seconds.
    fn time_factor(&self) -> Result<f64, RecordingError> {
        let column = self.layout.time.and_then(|at| self.layout.columns.get(at));
        let Some(column) = column else {
            return Ok(1.0);
        };
        let seconds = |text: &str| channel_unit(text).filter(|(_, si)| *si == "s");
        if let Some(unit) = &column.unit {
            return match seconds(unit) {
                Some((factor, _)) => Ok(factor),
                None => Err(RecordingError::TimeUnit {
                    file: self.file.clone(),
                    line: self.layout.lines_before + 1,
                    unit: unit.clone(),
                }),
            };
        }
        let name = column.name.as_deref().unwrap_or_default();
        let suffix = name.rsplit('_').next().unwrap_or_default();
        Ok(seconds(suffix).map_or(1.0, |(factor, _)| factor))
    }
}

fn read_head(path: &Path, file: &str) -> Result<Vec<u8>, RecordingError> {
    let mut head = vec![0_u8; HEAD_BYTES];
    let got = File::open(path)
        .and_then(|mut opened| read_fully(&mut opened, &mut head))
        .map_err(|source| unreadable(file, source))?;
    head.truncate(got);
    Ok(head)
}

fn extent(head: &[u8]) -> HeadExtent {
    match head.len() < HEAD_BYTES {
        true => HeadExtent::WholeFile,
        false => HeadExtent::Part,
    }
}

fn check_columns(layout: &CsvLayout, file: &str) -> Result<(), RecordingError> {
    let channels = layout.channel_columns().len();
    if channels > MAX_CHANNELS {
        return Err(RecordingError::TooManyChannels {
            file: file.to_owned(),
            channels,
            limit: MAX_CHANNELS,
        });
    }
    match layout.time {
        Some(time) if channels == 0 => Err(RecordingError::OnlyTime {
            file: file.to_owned(),
            line: layout.lines_before + 1,
            column: time + 1,
        }),
        _ => Ok(()),
    }
}

/// A reader somewhere in the rows.
#[derive(Debug)]
pub(super) struct CsvCursor<'a> {
    rows: RowReader<'a>,
    /// Columns that are channels.
    columns: Vec<usize>,
    at: u64,
}

impl CsvCursor<'_> {
    /// Appends up to `limit` rows of the wanted channels to `into`; fewer only at the end.
    pub(super) fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
        into: &mut [Vec<f64>],
    ) -> Result<(), RecordingError> {
        let wanted: Vec<usize> = channels
            .iter()
            .filter_map(|channel| self.columns.get(*channel).copied())
            .collect();
        let end = self.rows.source.frames.min(self.at.saturating_add(limit));
        while self.at < end {
            if !self.rows.next_row(&wanted)? {
                return Err(RecordingError::Changed {
                    file: self.rows.source.file.clone(),
                    frame: self.at,
                });
            }
            for (value, samples) in self.rows.values.iter().zip(into.iter_mut()) {
                samples.push(*value);
            }
            self.at += 1;
        }
        Ok(())
    }
}

/// Reads rows and turns what is wrong with them into errors that name the place.
#[derive(Debug)]
struct RowReader<'a> {
    source: &'a CsvSource,
    lines: LineReader,
    decimal: Option<u8>,
    cells: Vec<Cell>,
    /// The wanted values of the row that was read last.
    values: Vec<f64>,
    /// Bytes of the time cell of that row.
    time_cell: Vec<u8>,
    /// Where that row begins.
    place: IndexEntry,
}

impl<'a> RowReader<'a> {
    fn open(source: &'a CsvSource, at: IndexEntry) -> Result<Self, RecordingError> {
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
    fn next_row(&mut self, wanted: &[usize]) -> Result<bool, RecordingError> {
        let layout = &self.source.layout;
        let mut blank_line = None;
        loop {
            self.place = IndexEntry {
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

/// The first reading: every cell is parsed, every step of time checked.
struct OpeningPass<'a> {
    rows: RowReader<'a>,
    time: Option<TimeCheck>,
    index: Vec<IndexEntry>,
    frames: u64,
}

impl<'a> OpeningPass<'a> {
    fn new(source: &'a CsvSource, head: &[u8]) -> Result<Self, RecordingError> {
        let start = IndexEntry {
            offset: source.layout.start,
            lines_before: source.layout.lines_before,
        };
        let time = source.layout.time.map(|column| {
            let cells = layout::column_cells(head, extent(head), &source.layout, column);
            TimeCheck::new(cells.into_iter())
        });
        Ok(Self {
            rows: RowReader::open(source, start)?,
            time,
            index: Vec::new(),
            frames: 0,
        })
    }

    fn run(&mut self, sink: &mut impl FnMut(&[Vec<f64>])) -> Result<(), RecordingError> {
        let layout = &self.rows.source.layout;
        let columns: Vec<usize> = (0..layout.columns.len()).collect();
        let mut block = vec![Vec::new(); layout.channel_columns().len()];
        while self.rows.next_row(&columns)? {
            if self.frames.is_multiple_of(INDEX_ROWS) {
                self.index.push(self.rows.place);
                sink(&block);
                block.iter_mut().for_each(Vec::clear);
            }
            self.frames += 1;
            let (mut channels, mut time) = (block.iter_mut(), None);
            for (column, value) in self.rows.values.iter().enumerate() {
                if Some(column) == layout.time {
                    time = Some(*value);
                } else if let Some(channel) = channels.next() {
                    channel.push(*value);
                }
            }
            if let Some(time) = time {
                self.check_time(time)?;
            }
        }
        sink(&block);
        Ok(())
    }

    fn check_time(&mut self, time: f64) -> Result<(), RecordingError> {
        let Some(check) = &mut self.time else {
            return Ok(());
        };
        let line = self.rows.place.lines_before + 1;
        match check.add(time, &self.rows.time_cell, line) {
            Ok(()) => Ok(()),
            Err(uneven) => {
                let factor = self.rows.source.time_factor()?;
                let file = self.rows.source.file.clone();
                Err(uneven_error(file, uneven, check.reference(), factor))
            }
        }
    }
}

fn uneven_error(file: String, uneven: UnevenStep, expected: f64, factor: f64) -> RecordingError {
    let steps = uneven.step / expected;
    let whole = steps.round();
    // A gap within a tenth of a whole number of steps is one of lost rows.
    let lost = whole >= 2.0 && (steps - whole).abs() <= 0.1;
    let lost = match lost {
        true => format!(
            " (as if {} row{} were missing)",
            whole - 1.0,
            if whole > 2.0 { "s" } else { "" }
        ),
        false => String::new(),
    };
    RecordingError::UnevenSampling {
        file,
        line: uneven.line,
        time: uneven.time * factor,
        step: uneven.step * factor,
        expected: expected * factor,
        lost,
    }
}
