//! Text files of numbers: rows checked line by line, with a sparse index for jumping.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::{RecordingError, RecordingWarning, check_channel_count, unreadable};
use super::health::{HealthMeter, check_rate};
use super::kept::KeptSamples;
use super::resample::resample;
use super::text::{
    Cell, CellProblem, LARGEST, TimeCheck, is_comment, parse_number, shown, split_cells,
};
use super::{
    ChannelInfo, Cursor, Format, ReadSettings, Recording, SAME_RATE, Source, Timing, read_head,
};

mod layout;

pub(super) use layout::Column;
use layout::{CsvLayout, HEAD_BYTES, Head};
pub(super) use layout::{joined_brackets, split_texts};

/// Rows between two entries of the index: some 40 kB of text, read in a tenth of a millisecond.
const INDEX_ROWS: u64 = 1024;

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
    let mut kept: Option<KeptSamples> = None;
    let source = CsvSource::open(path, &file, Some(settings), |block| {
        meters.resize(block.len(), HealthMeter::new(None));
        let kept = kept.get_or_insert_with(|| KeptSamples::new(block.len()));
        for ((channel, samples), meter) in block.iter().enumerate().zip(&mut meters) {
            meter.add(samples);
            kept.add(channel, samples);
        }
    })?;
    if source.frames == 0 {
        return Err(RecordingError::no_samples(&file));
    }
    let mut warnings = Vec::new();
    let sample_rate = source.sample_rate(settings, &mut warnings)?;
    let layout = &source.layout;
    let format = Format::Csv {
        separator: layout.separator,
        decimal: char::from(layout.decimal.unwrap_or(b'.')),
        timed: match layout.time {
            Some(_) => Timing::TimeColumn,
            None => Timing::Given,
        },
    };
    let columns = layout.channel_columns();
    let headers: Vec<Column> = columns
        .iter()
        .map(|at| layout.columns[*at].clone())
        .collect();
    if let Some(deviation) = source.uneven {
        let (times, samples) = source.times_and_samples(source.seconds_per_unit(sample_rate))?;
        let even = resample(&times, &samples, deviation);
        warnings.push(even.warning());
        let columns = headers.into_iter().zip(even.samples).collect();
        return Recording::in_memory(file, format, even.sample_rate, columns, warnings);
    }
    let mut channels = Vec::with_capacity(meters.len());
    for ((number, header), meter) in (1..).zip(headers).zip(meters) {
        channels.push(ChannelInfo::with_header(
            number,
            header,
            meter,
            &mut warnings,
        ));
    }
    Ok(Recording {
        name: file,
        format,
        sample_rate,
        frames: source.frames,
        channels,
        warnings,
        source: match kept {
            Some(kept) => kept.or_file(source),
            None => Arc::new(source),
        },
        parts: Vec::new(),
    })
}

/// A text file that has been read once.
#[derive(Debug)]
pub(super) struct CsvSource {
    path: PathBuf,
    pub file: String,
    pub layout: CsvLayout,
    frames: u64,
    /// Place of every 1024th row.
    index: Vec<RowPlace>,
    /// What a unit of the time column is by heading or statement (s).
    time_factor: f64,
    /// Sample rate by the time column: from first and last time, and the one to use (Hz).
    rate: Option<(f64, f64)>,
    /// Largest deviation of a step of time, as a part of it, where samples must be resampled.
    uneven: Option<f64>,
}

impl CsvSource {
    /// Reads the whole file once, hands every block of channel values to `sink`, and remembers
    /// where rows begin. Every cell is parsed, and every step of time checked. `series` are the settings for a time
    /// series; without them the columns are functions of frequency, and none is taken for the time unless it is named.
    pub(super) fn open(
        path: &Path,
        file: &str,
        series: Option<&ReadSettings>,
        mut sink: impl FnMut(&[Vec<f64>]),
    ) -> Result<Self, RecordingError> {
        let head = read_head(path, file, HEAD_BYTES)?;
        let head = Head::new(&head);
        let layout = head.layout(file, series.is_some())?;
        if layout.time_is_inferred && head.says_frequency(&layout) {
            return Err(RecordingError::Functions {
                place: format!("{file}:{}", layout.lines_before + 1),
                found: "the text above the rows names frequencies".to_owned(),
            });
        }
        let mut source = Self {
            path: path.to_owned(),
            file: file.to_owned(),
            layout,
            frames: 0,
            index: Vec::new(),
            time_factor: 1.0,
            rate: None,
            uneven: None,
        };
        let layout = &source.layout;
        let channels = layout.channel_columns();
        check_channel_count(file, channels.len())?;
        if let Some(time) = layout.time.filter(|_| channels.is_empty()) {
            let problem = format!(
                "column {} is time and there is no other; allowed: at least one channel beside the time",
                time + 1
            );
            return Err(source.error(problem));
        }
        let factor = layout.time_factor(file, series.and_then(|settings| settings.time_unit))?;
        let mut time = layout.time.map(|column| {
            let numbers = head.numbers(layout, column);
            let numbers = numbers.iter().map(|number| (number.value, number.text));
            TimeCheck::new(numbers).for_resampling()
        });
        let (mut index, mut frames) = (Vec::new(), 0_u64);
        let mut block = vec![Vec::new(); channels.len()];
        let mut rows = source.rows(source.first_row())?;
        let columns: Vec<usize> = (0..layout.columns.len()).collect();
        while rows.next_row(&columns)? {
            if frames.is_multiple_of(INDEX_ROWS) {
                index.push(rows.place);
                sink(&block);
                block.iter_mut().for_each(Vec::clear);
            }
            frames += 1;
            if let (Some(check), Some(column)) = (&mut time, layout.time) {
                let (cell, line) = (rows.cell(column), rows.line_number());
                check.add(rows.values[column], cell, line).map_err(|uneven| {
                    let problem = format!(
                        "uneven sampling: time {}{}; allowed: 2 % of the step, or what rounding of the printed time explains; export without gaps or resample evenly",
                        uneven.words(factor, "s", "row"),
                        uneven.lost_rows()
                    );
                    RecordingError::at_line(file, uneven.line, problem)
                })?;
            }
            for (channel, column) in block.iter_mut().zip(&channels) {
                channel.push(rows.values[*column]);
            }
        }
        sink(&block);
        let decimal = rows.decimal;
        source.uneven = time.as_ref().and_then(TimeCheck::uneven);
        source.rate = time.and_then(|time| time.sample_rate(factor));
        source.time_factor = factor;
        source.layout.decimal = decimal;
        (source.index, source.frames) = (index, frames);
        Ok(source)
    }

    /// An error of the file as its first row shows it.
    pub(super) fn error(&self, problem: impl Into<String>) -> RecordingError {
        RecordingError::at_line(&self.file, self.layout.lines_before + 1, problem)
    }

    /// Settles the sample rate (Hz), by the time column or as given, and adds doubts about it.
    ///
    /// A first column of frequencies is refused: it means a frequency response function.
    fn sample_rate(
        &self,
        settings: &ReadSettings,
        warnings: &mut Vec<RecordingWarning>,
    ) -> Result<f64, RecordingError> {
        let (file, layout) = (&self.file, &self.layout);
        if let Some(first) = layout.columns.first().filter(|_| layout.time.is_none()) {
            let name = first.name.as_deref().unwrap_or_default();
            let unit = first.unit.as_deref().unwrap_or_default();
            let named = [name, unit].map(str::to_lowercase);
            let in_hertz = named.iter().any(|text| text == "hz" || text == "khz");
            if in_hertz || named[0].starts_with("freq") {
                return Err(RecordingError::FrequencyColumn {
                    place: format!("{file}:{}", layout.lines_before + 1),
                    column: [name, unit].join(" ").trim().to_owned(),
                });
            }
        }
        if let Some((_, used)) = self.rate.filter(|_| layout.time_is_inferred) {
            check_rate(file, used)?;
            return self.inferred_rate(used, settings, warnings);
        }
        if let Some((mean, used)) = self.rate {
            check_rate(file, used)?;
            if (mean - used).abs() > MENTIONED_ROUNDING * used {
                let message = format!(
                    "the time column's mean step gives {mean:.4} Hz; its steps scatter enough for {used} Hz, which is used; the time was probably summed or printed with few digits"
                );
                warnings.push(RecordingWarning::new("rate-rounded", message));
            }
            warnings.extend(settings.ignored_rate(used));
            return Ok(used);
        }
        if let Some(given) = settings.sample_rate {
            return Ok(given);
        }
        let head = read_head(&self.path, file, HEAD_BYTES)?;
        Err(Head::new(&head).no_sample_rate(layout, file))
    }

    /// Settles the sample rate (Hz) where the first column is the time and no heading says so; `by_column` is the
    /// column's.
    fn inferred_rate(
        &self,
        by_column: f64,
        settings: &ReadSettings,
        warnings: &mut Vec<RecordingWarning>,
    ) -> Result<f64, RecordingError> {
        // Rows that are counted have steps of exactly 1.
        let counts = settings.time_unit.is_none() && (by_column - 1.0).abs() < 1e-9;
        if let Some(given) = settings.sample_rate {
            let ratio = given / by_column;
            let units = [1.0, 1e3, 1e6, 1e9].map(|unit| (ratio / unit - 1.0).abs() <= SAME_RATE);
            if counts || units.contains(&true) {
                return Ok(given);
            }
            return Err(self.error(format!(
                "the first column rises evenly, as a time of {by_column} Hz, and sample_rate states {given} Hz; allowed: two that agree, in s, ms, us or ns; correct sample_rate, or give the columns headings"
            )));
        }
        if counts {
            return Err(self.error(
                "the first column counts the rows and has no heading: it gives no sample rate; give sample_rate in Hz, or time_unit where it is a time",
            ));
        }
        if settings.time_unit.is_none() {
            let message = format!(
                "no heading names the time: the first column rises evenly and is taken as the time in s, {by_column} Hz; state time_unit = \"ms\" (--time-unit) if it is in another unit"
            );
            warnings.push(RecordingWarning::new("time-assumed", message));
        }
        Ok(by_column)
    }

    /// Returns what a unit of the time column is (s): by its heading, as stated, or by a given sample rate.
    fn seconds_per_unit(&self, sample_rate: f64) -> f64 {
        let by_column = self.rate.map_or(sample_rate, |(_, used)| used);
        self.time_factor * by_column / sample_rate
    }

    /// Reads all times (s) and all samples.
    fn times_and_samples(
        &self,
        seconds_per_unit: f64,
    ) -> Result<(Vec<f64>, Vec<Vec<f64>>), RecordingError> {
        let mut columns = self.layout.channel_columns();
        columns.extend(self.layout.time);
        let mut rows = self.rows(self.first_row())?;
        let mut samples = vec![Vec::new(); columns.len()];
        while rows.next_row(&columns)? {
            for (column, value) in samples.iter_mut().zip(&rows.values) {
                column.push(*value);
            }
        }
        let mut times = samples.pop().unwrap_or_default();
        times.iter_mut().for_each(|time| *time *= seconds_per_unit);
        Ok((times, samples))
    }

    fn first_row(&self) -> RowPlace {
        RowPlace {
            offset: self.layout.start,
            lines_before: self.layout.lines_before,
        }
    }

    fn rows(&self, place: RowPlace) -> Result<RowReader<'_>, RecordingError> {
        let opened = File::open(&self.path).and_then(|mut file| {
            file.seek(SeekFrom::Start(place.offset))?;
            Ok(file)
        });
        let file = opened.map_err(|source| unreadable(&self.file, source))?;
        Ok(RowReader {
            source: self,
            reader: BufReader::with_capacity(1 << 17, file),
            at: 0,
            line: Vec::new(),
            next: place,
            place,
            decimal: self.layout.decimal,
            cells: Vec::new(),
            values: Vec::new(),
        })
    }
}

impl Source for CsvSource {
    fn cursor(&self, frame: u64) -> Result<Box<dyn Cursor + '_>, RecordingError> {
        let frame = frame.min(self.frames);
        let slot = (frame / INDEX_ROWS).min(self.index.len().saturating_sub(1) as u64);
        let place = self.index.get(slot as usize).copied();
        let mut rows = self.rows(place.unwrap_or_else(|| self.first_row()))?;
        rows.at = slot * INDEX_ROWS;
        while rows.at < frame {
            rows.next_row(&[])?;
            rows.at += 1;
        }
        Ok(Box::new(rows))
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
    /// The next row, where samples are read.
    at: u64,
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

impl Cursor for RowReader<'_> {
    fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
        into: &mut [Vec<f64>],
    ) -> Result<(), RecordingError> {
        let columns = self.source.layout.channel_columns();
        let wanted: Vec<usize> = channels.iter().map(|channel| columns[*channel]).collect();
        let end = self.source.frames.min(self.at.saturating_add(limit));
        while self.at < end {
            if !self.next_row(&wanted)? {
                return Err(RecordingError::changed(&self.source.file, self.at));
            }
            for (value, samples) in self.values.iter().zip(into.iter_mut()) {
                samples.push(*value);
            }
            self.at += 1;
        }
        Ok(())
    }
}

impl RowReader<'_> {
    /// Reads the next row and its `wanted` columns into `values`; false after the last one.
    fn next_row(&mut self, wanted: &[usize]) -> Result<bool, RecordingError> {
        let layout = &self.source.layout;
        let mut blank_line = None;
        loop {
            self.place = self.next;
            self.line.clear();
            let taken = loop {
                // As `read_until` does, whose search for the line end is slower.
                let bytes = match self.reader.fill_buf() {
                    Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                    read => read.map_err(|error| unreadable(&self.source.file, error))?,
                };
                let end = memchr::memchr(layout.line_end, bytes);
                let part = end.map_or(bytes.len(), |end| end + 1);
                self.line.extend_from_slice(&bytes[..part]);
                self.reader.consume(part);
                if part == 0 || end.is_some() || self.line.len() > MAX_LINE_BYTES {
                    break self.line.len();
                }
            };
            if taken > MAX_LINE_BYTES {
                let problem = format!(
                    "this line has more than {MAX_LINE_BYTES} bytes; allowed: one row of numbers per line"
                );
                return Err(self.error_of_line(problem));
            }
            if taken == 0 {
                return Ok(false);
            }
            self.next.offset += taken as u64;
            self.next.lines_before += 1;
            if self.line.trim_ascii().is_empty() || self.line == [0x1a] {
                blank_line.get_or_insert(self.line_number());
            } else if !is_comment(&self.line) {
                break;
            }
        }
        if let (Some(blank), None) = (blank_line, layout.time) {
            let problem = "empty line between rows; without a time column it cannot be told whether a row was lost; remove the line or add a time column";
            return Err(RecordingError::at_line(&self.source.file, blank, problem));
        }
        // What stands behind the last wanted column was checked when the file was read for the first time.
        let columns = layout.columns.len();
        let used = wanted.iter().max().map_or(0, |last| last + 1);
        if self.read_plain(wanted, used).is_some() {
            return Ok(true);
        }
        let most = if used < columns { used } else { usize::MAX };
        split_cells(&self.line, layout.separator, most, &mut self.cells);
        // Too few cells are missing ones; too many must be empty.
        if self.cells.len() < used {
            return Err(self.error_of_cell(self.cells.len(), CellProblem::Missing));
        }
        let surplus = (columns..self.cells.len()).find(|column| !self.cell(*column).is_empty());
        if let Some(column) = surplus {
            let problem = format!(
                "{} cells where the rows have {columns}; the first surplus cell holds \"{}\"; correct this line",
                self.cells.len(),
                shown(self.cell(column))
            );
            return Err(self.error_of_line(problem));
        }
        self.values.clear();
        for column in wanted {
            let mut decimal = self.decimal;
            match parse_number(self.cell(*column), &mut decimal) {
                Ok(value) => self.values.push(value),
                Err(problem) => return Err(self.error_of_cell(*column, problem)),
            }
            self.decimal = decimal;
        }
        Ok(true)
    }

    /// Reads the `wanted` ones of the first `used` cells of a row in one pass, as most rows of a long file allow; `None`
    /// where a cell has blanks, quotes, or anything but a plain number.
    fn read_plain(&mut self, wanted: &[usize], used: usize) -> Option<()> {
        let layout = &self.source.layout;
        let separator = layout.separator.single()?;
        if self.decimal != Some(b'.') || !wanted.is_sorted() {
            return None;
        }
        self.cells.clear();
        self.values.clear();
        let mut places = wanted.iter().peekable();
        let mut at = 0;
        for column in 0..used {
            let rest = self.line.get(at..)?;
            let length = if places.next_if_eq(&&column).is_some() {
                let (value, length) = fast_float2::parse_partial::<f64, _>(rest).ok()?;
                self.values.push(value);
                length
            } else {
                memchr::memchr2(separator, b'"', rest)?
            };
            self.cells.push(at..at + length);
            at += length;
            let is_end = column + 1 == layout.columns.len();
            match self.line.get(at) {
                Some(byte) if *byte == separator && !is_end => at += 1,
                Some(b'\r' | b'\n') | None if is_end => {}
                _ => return None,
            }
        }
        let are_usable = self.values.iter().all(|value| value.abs() <= LARGEST);
        (are_usable && self.values.len() == wanted.len()).then_some(())
    }

    /// Number (1-based) of the line read last.
    fn line_number(&self) -> u64 {
        self.place.lines_before + 1
    }

    /// A cell of the row read last; empty where the row has fewer.
    fn cell(&self, column: usize) -> &[u8] {
        let cell = self.cells.get(column).cloned();
        cell.map_or(&[], |cell| &self.line[cell])
    }

    fn error_of_line(&self, problem: String) -> RecordingError {
        RecordingError::at_line(&self.source.file, self.line_number(), problem)
    }

    /// Returns the error of a cell of the row read last.
    fn error_of_cell(&self, column: usize, problem: CellProblem) -> RecordingError {
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
        let name = self.source.layout.shown_name(column);
        self.error_of_line(format!("column {}{name} {problem}", column + 1))
    }
}
