//! Text files of numbers: rows checked line by line, with a sparse index for jumping.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::{RecordingError, ResponseError};
use super::health::{HealthMeter, check_rate};
use super::spacing::{TimeCheck, UnevenStep};
use super::text::{Cell, CellProblem, is_comment, parse_number, shown, split_cells};
use super::units::channel_unit;
use super::warning::{ChannelLabel, RecordingWarning};
use super::{ChannelInfo, Format, MAX_CHANNELS, ReadSettings, Recording, Source, Timing};
use super::{read_head, unreadable};

mod layout;

pub(super) use layout::split_texts;
use layout::{Column, CsvLayout, FlatTime, HEAD_BYTES, Head};

/// Rows between two entries of the index: some 100 kB of text, read in under a millisecond.
const INDEX_ROWS: u64 = 4096;

/// A longer line is not a row of numbers; the limit keeps a file without line ends out of memory.
const MAX_LINE_BYTES: usize = 1 << 20;

/// Least relative difference of a mean rate and the whole number used instead that is mentioned.
const MENTIONED_ROUNDING: f64 = 1e-6;

/// Opens a text file as a recording.
pub(super) fn open_csv(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<Recording, RecordingError> {
    let mut meters: Vec<HealthMeter> = Vec::new();
    let (source, rates) = CsvSource::open(path, &file, |block| {
        meters.resize(block.len(), HealthMeter::new(None));
        for (samples, meter) in block.iter().zip(&mut meters) {
            meter.add(samples);
        }
    })?;
    if source.frames == 0 {
        return Err(RecordingError::NoSamples { file });
    }
    source.refuse_frequencies()?;
    let mut warnings = Vec::new();
    let sample_rate = source.sample_rate(&rates, settings, &mut warnings)?;
    let layout = &source.layout;
    let mut channels = Vec::with_capacity(meters.len());
    for (column, meter) in layout.channel_columns().into_iter().zip(meters) {
        let header = layout.columns.get(column).cloned().unwrap_or_default();
        let number = channels.len() + 1;
        channels.push(csv_channel(number, header, meter, &mut warnings));
    }
    Ok(Recording {
        name: file,
        path: Some(path.to_owned()),
        format: Format::Csv {
            separator: layout.separator,
            decimal: char::from(layout.decimal.unwrap_or(b'.')),
            timed: match layout.time {
                Some(_) => Timing::TimeColumn,
                None => Timing::Given,
            },
        },
        sample_rate,
        frames: source.frames,
        channels,
        warnings,
        source: Source::Csv(Box::new(source)),
    })
}

/// A channel of a text file, its values in SI where the header's unit is known.
fn csv_channel(
    number: usize,
    header: Column,
    meter: HealthMeter,
    warnings: &mut Vec<RecordingWarning>,
) -> ChannelInfo {
    let known = header.unit.as_deref().and_then(channel_unit);
    if let (Some(unit), None) = (&header.unit, known) {
        let name = header.name.clone();
        warnings.push(RecordingWarning::UnknownUnit {
            channel: ChannelLabel { number, name },
            unit: unit.clone(),
        });
    }
    let scale = known.map_or(1.0, |(factor, _)| factor);
    ChannelInfo {
        name: header.name,
        unit: known.map_or_else(|| header.unit.clone(), |(_, si)| Some(si.to_owned())),
        header_unit: header.unit,
        scale,
        health: meter.finish().scaled(scale),
    }
}

/// A text file that has been read once.
#[derive(Debug, Clone)]
pub(super) struct CsvSource {
    pub path: PathBuf,
    pub file: String,
    pub layout: CsvLayout,
    pub frames: u64,
    /// Place of every 4096th row.
    index: Arc<Vec<RowPlace>>,
}

/// Sample rates and time columns that the opening pass finds beside the samples.
pub(super) struct CsvRates {
    /// By the time column: from first and last time, and the one to use (Hz).
    by_time: Option<(f64, f64)>,
    /// A column that rises evenly though it is not named as time, 0-based.
    unnamed_time: Option<usize>,
    /// A column that is named as time though it does not rise.
    flat_time: Option<FlatTime>,
}

impl CsvSource {
    /// Reads the whole file once, hands every block of channel values to `sink`, and remembers
    /// where rows begin.
    pub(super) fn open(
        path: &Path,
        file: &str,
        mut sink: impl FnMut(&[Vec<f64>]),
    ) -> Result<(Self, CsvRates), RecordingError> {
        let head = read_head(path, file, HEAD_BYTES)?;
        let head = Head::new(&head);
        let mut source = Self {
            path: path.to_owned(),
            file: file.to_owned(),
            layout: head.layout(file)?,
            frames: 0,
            index: Arc::new(Vec::new()),
        };
        source.check_columns()?;
        let time_factor = source.time_factor()?;
        let layout = &source.layout;
        let mut time = layout.time.map(|column| {
            let numbers = head.numbers(layout, column);
            TimeCheck::new(numbers.iter().map(|number| (number.value, number.text)))
        });
        let mut rows = source.rows(source.first_row())?;
        let (index, frames) = read_all(&mut rows, time.as_mut(), time_factor, &mut sink)?;
        let decimal = rows.decimal;
        let untimed = layout.time.is_none();
        let rates = CsvRates {
            by_time: time.and_then(|time| time.sample_rate(time_factor)),
            unnamed_time: untimed.then(|| head.evenly_rising_column(layout)).flatten(),
            flat_time: untimed.then(|| head.flat_time(layout)).flatten(),
        };
        source.layout.decimal = decimal;
        source.frames = frames;
        source.index = Arc::new(index);
        Ok((source, rates))
    }

    /// Checks that there are channels, and not too many.
    fn check_columns(&self) -> Result<(), RecordingError> {
        let channels = self.layout.channel_columns().len();
        if channels > MAX_CHANNELS {
            return Err(RecordingError::TooManyChannels {
                file: self.file.clone(),
                channels,
                limit: MAX_CHANNELS,
            });
        }
        match self.layout.time {
            Some(time) if channels == 0 => Err(RecordingError::OnlyTime {
                file: self.file.clone(),
                line: self.layout.lines_before + 1,
                column: time + 1,
            }),
            _ => Ok(()),
        }
    }

    /// Refuses a first column of frequencies, which means a frequency response function.
    fn refuse_frequencies(&self) -> Result<(), ResponseError> {
        let layout = &self.layout;
        let Some(first) = layout.columns.first().filter(|_| layout.time.is_none()) else {
            return Ok(());
        };
        let name = first.name.as_deref().unwrap_or_default();
        let unit = first.unit.as_deref().unwrap_or_default();
        let named = [name, unit].map(str::to_lowercase);
        let in_hertz = named.iter().any(|text| text == "hz" || text == "khz");
        if !in_hertz && !named[0].starts_with("freq") {
            return Ok(());
        }
        Err(ResponseError::NotTimeSeries {
            file: self.file.clone(),
            line: layout.lines_before + 1,
            column: [name, unit].join(" ").trim().to_owned(),
        })
    }

    /// Settles the sample rate (Hz), by the time column or as given, and adds doubts about it.
    fn sample_rate(
        &self,
        rates: &CsvRates,
        settings: &ReadSettings,
        warnings: &mut Vec<RecordingWarning>,
    ) -> Result<f64, RecordingError> {
        let (file, layout) = (&self.file, &self.layout);
        if let Some((mean, used)) = rates.by_time {
            check_rate(file, used)?;
            if (mean - used).abs() > MENTIONED_ROUNDING * used {
                warnings.push(RecordingWarning::RateRounded { mean, used });
            }
            warnings.extend(settings.ignored_rate(used));
            return Ok(used);
        }
        if let Some(given) = settings.sample_rate {
            return Ok(given);
        }
        if let Some(flat) = rates.flat_time {
            return Err(RecordingError::RepeatedTime {
                file: file.clone(),
                line: flat.line,
                column: format!("{}{}", flat.column + 1, layout.shown_name(flat.column)),
                times: flat.values,
            });
        }
        let hint = match (layout.time, rates.unnamed_time) {
            (Some(_), _) => " (a single row has no step)".to_owned(),
            (None, Some(column)) => {
                format!(" (column {} rises evenly: is it the time?)", column + 1)
            }
            (None, None) => String::new(),
        };
        Err(RecordingError::NoSampleRate {
            file: file.clone(),
            line: layout.lines_before + 1,
            hint,
        })
    }

    /// Returns the factor from the time column's unit to seconds.
    ///
    /// The unit stands in brackets, or at the end of the name ("t_ms"); without one it is seconds.
    fn time_factor(&self) -> Result<f64, RecordingError> {
        let column = self.layout.time.and_then(|at| self.layout.columns.get(at));
        let Some(column) = column else {
            return Ok(1.0);
        };
        let name = column.name.as_deref().unwrap_or_default();
        let suffix = name.rsplit('_').next().unwrap_or_default();
        let unit = channel_unit(column.unit.as_deref().unwrap_or(suffix));
        match (unit, &column.unit) {
            (Some((factor, "s")), _) => Ok(factor),
            (_, None) => Ok(1.0),
            (_, Some(unit)) => Err(RecordingError::TimeUnit {
                file: self.file.clone(),
                line: self.layout.lines_before + 1,
                unit: unit.clone(),
            }),
        }
    }

    fn first_row(&self) -> RowPlace {
        RowPlace {
            offset: self.layout.start,
            lines_before: self.layout.lines_before,
        }
    }

    fn rows(&self, place: RowPlace) -> Result<RowReader<'_>, RecordingError> {
        let mut file = File::open(&self.path).map_err(|source| unreadable(&self.file, source))?;
        file.seek(SeekFrom::Start(place.offset))
            .map_err(|source| unreadable(&self.file, source))?;
        Ok(RowReader {
            source: self,
            reader: BufReader::with_capacity(1 << 17, file),
            line: Vec::new(),
            next: place,
            place,
            decimal: self.layout.decimal,
            cells: Vec::new(),
            values: Vec::new(),
        })
    }

    /// Positions a reader at row `frame`.
    pub(super) fn cursor(&self, frame: u64) -> Result<CsvCursor<'_>, RecordingError> {
        let at = frame.min(self.frames);
        let slot = usize::try_from(at / INDEX_ROWS).unwrap_or(usize::MAX);
        let slot = slot.min(self.index.len().saturating_sub(1));
        let entry = self.index.get(slot).copied();
        let mut rows = self.rows(entry.unwrap_or_else(|| self.first_row()))?;
        for _ in slot as u64 * INDEX_ROWS..at {
            rows.next_row(&[])?;
        }
        Ok(CsvCursor {
            columns: self.layout.channel_columns(),
            rows,
            at,
        })
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

/// Reads all rows: parses every cell, checks every step of time, and hands blocks of channel values to `sink`.
/// Returns the index of rows and their number.
fn read_all(
    rows: &mut RowReader<'_>,
    mut time: Option<&mut TimeCheck>,
    time_factor: f64,
    sink: &mut impl FnMut(&[Vec<f64>]),
) -> Result<(Vec<RowPlace>, u64), RecordingError> {
    let layout = &rows.source.layout;
    let columns: Vec<usize> = (0..layout.columns.len()).collect();
    let mut block = vec![Vec::new(); layout.channel_columns().len()];
    let (mut index, mut frames) = (Vec::new(), 0_u64);
    while rows.next_row(&columns)? {
        if frames.is_multiple_of(INDEX_ROWS) {
            index.push(rows.place);
            sink(&block);
            block.iter_mut().for_each(Vec::clear);
        }
        frames += 1;
        let mut channels = block.iter_mut();
        for (column, value) in rows.values.iter().enumerate() {
            match &mut time {
                Some(check) if Some(column) == layout.time => {
                    let line = rows.place.lines_before + 1;
                    check
                        .add(*value, rows.cell(column), line)
                        .map_err(|step| uneven_error(rows.source, step, check, time_factor))?;
                }
                _ => {
                    if let Some(channel) = channels.next() {
                        channel.push(*value);
                    }
                }
            }
        }
    }
    sink(&block);
    Ok((index, frames))
}

fn uneven_error(
    source: &CsvSource,
    uneven: UnevenStep,
    check: &TimeCheck,
    factor: f64,
) -> RecordingError {
    let expected = check.reference();
    let steps = uneven.step / expected;
    let whole = steps.round();
    let mut lost = String::new();
    // A gap within a tenth of a whole number of steps is one of lost rows.
    if (2.0..1e9).contains(&whole) && (steps - whole).abs() <= 0.1 {
        let plural = if whole > 2.0 { "s" } else { "" };
        lost = format!(" (as if {} row{plural} were missing)", whole - 1.0);
    }
    RecordingError::UnevenSampling {
        file: source.file.clone(),
        line: uneven.line,
        time: uneven.time * factor,
        step: uneven.step * factor,
        expected: expected * factor,
        lost,
    }
}

/// Place of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct RowPlace {
    offset: u64,
    lines_before: u64,
}

/// Reads rows and turns what is wrong with them into errors that name the place.
#[derive(Debug)]
struct RowReader<'a> {
    source: &'a CsvSource,
    reader: BufReader<File>,
    /// The line read last, with its end.
    line: Vec<u8>,
    /// Place of the next line.
    next: RowPlace,
    /// Place of the row read last.
    place: RowPlace,
    decimal: Option<u8>,
    cells: Vec<Cell>,
    /// The wanted values of the row read last.
    values: Vec<f64>,
}

impl RowReader<'_> {
    /// Reads the next row and its `wanted` columns into `values`; false after the last one.
    fn next_row(&mut self, wanted: &[usize]) -> Result<bool, RecordingError> {
        let layout = &self.source.layout;
        let mut blank_line = None;
        while self.next_line()? {
            if self.line.trim_ascii().is_empty() || self.line == [0x1a] {
                blank_line.get_or_insert(self.place.lines_before + 1);
                continue;
            }
            if is_comment(&self.line) {
                continue;
            }
            if let (Some(blank), None) = (blank_line, layout.time) {
                let file = self.source.file.clone();
                return Err(RecordingError::BlankLine { file, line: blank });
            }
            split_cells(&self.line, layout.separator, &mut self.cells);
            self.check_count()?;
            self.values.clear();
            for column in wanted {
                let mut decimal = self.decimal;
                match parse_number(self.cell(*column), &mut decimal) {
                    Ok(value) => self.values.push(value),
                    Err(problem) => return Err(self.error(*column, problem)),
                }
                self.decimal = decimal;
            }
            return Ok(true);
        }
        Ok(false)
    }

    /// Reads the next line with its end; false after the last one.
    fn next_line(&mut self) -> Result<bool, RecordingError> {
        self.place = self.next;
        self.line.clear();
        let mut bytes = self.reader.by_ref().take(MAX_LINE_BYTES as u64 + 1);
        let taken = bytes
            .read_until(self.source.layout.line_end, &mut self.line)
            .map_err(|error| unreadable(&self.source.file, error))?;
        if taken > MAX_LINE_BYTES {
            return Err(RecordingError::LineTooLong {
                file: self.source.file.clone(),
                line: self.place.lines_before + 1,
                limit: MAX_LINE_BYTES,
            });
        }
        self.next.offset += taken as u64;
        self.next.lines_before += u64::from(taken > 0);
        Ok(taken > 0)
    }

    /// A cell of the row read last; empty where the row has fewer.
    fn cell(&self, column: usize) -> &[u8] {
        let cell = self.cells.get(column).cloned();
        cell.and_then(|cell| self.line.get(cell))
            .unwrap_or_default()
    }

    /// Checks the number of cells: too few are missing ones; too many must be empty.
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
                line: self.place.lines_before + 1,
                found: self.cells.len(),
                columns,
                value: shown(self.cell(column)),
            }),
        }
    }

    /// Returns the error of a cell of the row read last.
    fn error(&self, column: usize, problem: CellProblem) -> RecordingError {
        let value = shown(self.cell(column));
        let problem = match problem {
            CellProblem::Missing => format!(
                "is missing; every row needs {} numbers; fill the cell or remove the column",
                self.source.layout.columns.len()
            ),
            CellProblem::Text => format!(
                "holds \"{value}\", which is not a number; allowed: numbers such as -1.25e-3; correct or remove this line"
            ),
            CellProblem::NotFinite => format!(
                "holds \"{value}\"; allowed: finite numbers of magnitude up to 1e100; remove the damaged rows and take what stays connected"
            ),
            CellProblem::MixedDecimal(decimal) => format!(
                "holds \"{value}\", but the numbers before use \"{}\" as decimal mark; allowed: one decimal mark, no thousands separators",
                char::from(decimal)
            ),
        };
        RecordingError::BadCell {
            file: self.source.file.clone(),
            line: self.place.lines_before + 1,
            column: column + 1,
            name: self.source.layout.shown_name(column),
            problem,
        }
    }
}
