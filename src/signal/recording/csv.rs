//! Rows of a text file as numbers, checked line by line, with a sparse index for jumping.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::RecordingError;
use super::layout::{self, CsvLayout, HeadExtent};
use super::riff::{MAX_CHANNELS, read_fully, unreadable};
use super::rows::{RowPlace, RowReader};
use super::time::{TimeCheck, UnevenStep};
use super::time_column::{FlatTime, flat_time};
use super::units::channel_unit;

/// Bytes from which the layout is decided: thousands of ordinary rows.
const HEAD_BYTES: usize = 1 << 18;

/// Rows between two entries of the index: some 100 kB of text, read in under a millisecond.
const INDEX_ROWS: u64 = 4096;

/// A text file that has been read once.
#[derive(Debug, Clone)]
pub(super) struct CsvSource {
    pub path: PathBuf,
    pub file: String,
    pub layout: CsvLayout,
    pub frames: u64,
    /// Where every 4096th row begins.
    index: Arc<Vec<RowPlace>>,
}

/// What the opening pass finds beside the samples.
pub(super) struct CsvRates {
    /// By the time column: from first and last time, and the one to use (Hz).
    pub by_time: Option<(f64, f64)>,
    /// A column that rises evenly though it is not named as time, 0-based.
    pub unnamed_time: Option<usize>,
    /// A column that is named as time though it does not rise.
    pub flat_time: Option<FlatTime>,
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
            flat_time: match source.layout.time {
                Some(_) => None,
                None => flat_time(&head, extent(&head), &source.layout),
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
        let entry = entry.unwrap_or(RowPlace {
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

/// The first reading: every cell is parsed, every step of time checked.
struct OpeningPass<'a> {
    rows: RowReader<'a>,
    time: Option<TimeCheck>,
    index: Vec<RowPlace>,
    frames: u64,
}

impl<'a> OpeningPass<'a> {
    fn new(source: &'a CsvSource, head: &[u8]) -> Result<Self, RecordingError> {
        let start = RowPlace {
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
    let lost = (2.0..1e9).contains(&whole) && (steps - whole).abs() <= 0.1;
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
