//! Text by LabVIEW ("Write To Measurement File", .lvm): time series, and functions of frequency alike.
//!
//! A header of the file and one of each segment end with `***End_of_Header***`. A segment's header has a column for each
//! channel: `Y_Unit_Label`, `X_Dimension`, `X0`, `Delta_X`. Below, a line of names begins with `X_Value`. By `X_Columns`
//! the numbers have one column of X, one before each channel ("Multi"), or an empty one ("No").
//! Source: NI, Specification for the LabVIEW Measurement File (.lvm), version 2.0.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use super::csv::Column;
use super::error::{RecordingError, RecordingWarning, check_channel_count, short, unreadable};
use super::function_text::{FunctionTable, is_function_heading};
use super::resample::resample;
use super::responses::{FrequencyResponses, time_series};
use super::text::{
    CellProblem, Printed, Separator, check_even, decode_text, parse_number, shown, split_cells,
};
use super::units::split_unit;
use super::{Format, ReadSettings, Recording, SAME_RATE};

/// A longer line is not a row of numbers; the limit keeps a file without line ends out of memory.
const MAX_LINE_BYTES: usize = 1 << 20;

/// The line that ends a header.
const END: &str = "***End_of_Header***";

/// Opens a file as a recording.
pub(super) fn open_lvm(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<Recording, RecordingError> {
    let mut segments = read_segments(path, &file)?;
    if let Some(name) = segments.iter().find_map(Segment::function_name) {
        return Err(RecordingError::Functions {
            place: format!("{file}:{}", segments[0].first_line()),
            found: format!("\"{name}\" is named here"),
        });
    }
    let mut warnings = Vec::new();
    let mut step: Option<f64> = None;
    let mut joined: Vec<(Column, Vec<f64>)> = Vec::new();
    let count = segments.len();
    let mut jumps = 0_usize;
    let mut end: Option<f64> = None;
    for segment in &mut segments {
        let own = segment.even(&file, &mut warnings)?;
        let wanted = *step.get_or_insert(own.step);
        if (own.step - wanted).abs() > SAME_RATE * wanted {
            let problem = format!(
                "this segment has a step of {} s, the first one {} s; allowed: segments of one sample rate; split the file",
                short(own.step),
                short(wanted)
            );
            return Err(RecordingError::at_line(
                &file,
                segment.first_line(),
                problem,
            ));
        }
        // A segment that goes on starts a step after the last one ended, give or take half a step.
        let goes_on = end.is_none_or(|end| (own.start - end - wanted).abs() <= 0.5 * wanted);
        jumps += usize::from(!goes_on);
        end = Some(own.start + wanted * (segment.rows() as f64 - 1.0));
        let columns = segment.take_columns();
        if joined.is_empty() {
            joined = columns;
        } else if joined.len() == columns.len() {
            for ((_, all), (_, more)) in joined.iter_mut().zip(columns) {
                all.extend(more);
            }
        } else {
            let problem = format!(
                "this segment has {} channels, the first one {}; allowed: segments of the same channels; split the file",
                columns.len(),
                joined.len()
            );
            return Err(RecordingError::at_line(
                &file,
                segment.first_line(),
                problem,
            ));
        }
    }
    if jumps > 0 {
        let message = format!(
            "{count} segments are joined end to end, {jumps} of them start anew: the recording was interrupted there, and a tap that runs over such a place is cut"
        );
        warnings.push(RecordingWarning::new("segments-joined", message));
    }
    let Some(step) = step else {
        return Err(RecordingError::no_samples(&file));
    };
    let sample_rate = settings
        .time_unit
        .map_or(1.0 / step, |unit| 1.0 / (step * unit));
    warnings.extend(settings.ignored_rate(sample_rate));
    Recording::in_memory(file, Format::Lvm, sample_rate, joined, warnings)
}

/// Opens a file as functions of frequency.
pub(super) fn open_functions(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<FrequencyResponses, RecordingError> {
    let segments = read_segments(path, &file)?;
    // A dimension is no proof: spectra are written with "Time", too.
    if settings.values.is_none() && segments.iter().all(|one| one.function_name().is_none()) {
        return Err(time_series(
            &file,
            "a LabVIEW file whose columns are named as signals in time",
        ));
    }
    let count = segments.len();
    let mut all: Option<FrequencyResponses> = None;
    for (number, segment) in (1..).zip(segments) {
        let first_line = segment.first_line();
        let mut read = segment.function_table(&file)?.read(settings)?;
        let Some(all) = &mut all else {
            all = Some(read);
            continue;
        };
        let same = all.lines == read.lines
            && (all.spacing - read.spacing).abs() <= SAME_RATE * all.spacing
            && (all.first_frequency - read.first_frequency).abs() <= SAME_RATE * all.spacing
            && all.has_phase == read.has_phase;
        if !same {
            let problem = format!(
                "segment {number} of {count} has other lines than the first; allowed: segments on the same lines; split the file"
            );
            return Err(RecordingError::at_line(&file, first_line, problem));
        }
        for response in &mut read.responses {
            response.name = format!("{} ({number})", response.name);
        }
        all.responses.append(&mut read.responses);
        all.warnings.append(&mut read.warnings);
    }
    all.ok_or_else(|| RecordingError::no_samples(&file))
}

/// A segment: its header and its numbers.
#[derive(Debug)]
struct Segment {
    /// Cells of its header's lines by their key.
    header: Vec<Vec<String>>,
    /// Names of all columns, the X columns included.
    names: Vec<String>,
    /// Numbers of all columns; an X column may be empty.
    columns: Vec<Vec<f64>>,
    /// Line of each row (1-based).
    lines: Vec<u64>,
    /// Digits of the column of X.
    printed: Printed,
}

/// Even times of a segment (s).
struct EvenTimes {
    start: f64,
    step: f64,
}

impl Segment {
    fn new(header: Vec<Vec<String>>) -> Self {
        Self {
            header,
            names: Vec::new(),
            columns: Vec::new(),
            lines: Vec::new(),
            printed: Printed::Decimals(0),
        }
    }

    fn first_line(&self) -> u64 {
        self.lines.first().copied().unwrap_or(1)
    }

    fn rows(&self) -> usize {
        self.lines.len()
    }

    /// Indices of the columns that are channels.
    fn channels(&self) -> Vec<usize> {
        let all = 0..self.names.len();
        all.filter(|at| !is_x(&self.names[*at])).collect()
    }

    /// The header's cell of a channel (0-based).
    fn property(&self, key: &str, channel: usize) -> Option<&str> {
        let line = self
            .header
            .iter()
            .find(|cells| cells[0].eq_ignore_ascii_case(key))?;
        let cell = line.get(channel + 1)?.trim();
        (!cell.is_empty()).then_some(cell)
    }

    /// A number of the header for the first channel; with a decimal comma or point.
    fn number(&self, key: &str) -> Option<f64> {
        parse_number(self.property(key, 0)?.as_bytes(), &mut None).ok()
    }

    /// The name by which the columns are functions of frequency, where they are.
    fn function_name(&self) -> Option<String> {
        let mut channels = self.channels().into_iter();
        let dimension = self.property("X_Dimension", 0);
        let by_dimension = dimension.filter(|text| text.to_lowercase().contains("freq"));
        let named = channels.find(|at| is_function_heading(&self.names[*at]));
        let name = named.map(|at| self.names[at].clone());
        name.or_else(|| by_dimension.map(|text| format!("X_Dimension {text}")))
    }

    /// Returns the even times, by the column of X or, without one, by `X0` and `Delta_X`; resamples the channels where
    /// the times are slightly uneven.
    fn even(
        &mut self,
        file: &str,
        warnings: &mut Vec<RecordingWarning>,
    ) -> Result<EvenTimes, RecordingError> {
        let stated = self.number("Delta_X").filter(|step| *step > 0.0);
        let x = self
            .columns
            .first()
            .filter(|_| is_x(&self.names[0]))
            .cloned();
        let x = x.filter(|x| x.len() == self.rows() && x.len() > 1);
        let Some(x) = x else {
            let Some(step) = stated else {
                let problem = "there is neither a column of X nor a Delta_X above 0; allowed: one of them; write the file with X_Columns = One";
                return Err(RecordingError::at_line(file, self.first_line(), problem));
            };
            return Ok(EvenTimes {
                start: self.number("X0").unwrap_or(0.0),
                step,
            });
        };
        let check = check_even(&x, self.lines.iter().copied(), self.printed, true).map_err(|uneven| {
            let problem = format!(
                "uneven sampling: X {}{}; allowed: 2 % of the step, or what rounding of the printed X explains; export without gaps",
                uneven.words(1.0, "s", "row"),
                uneven.lost_rows()
            );
            RecordingError::at_line(file, uneven.line, problem)
        })?;
        if let Some(deviation) = check.uneven() {
            let channels = self.channels();
            let samples: Vec<Vec<f64>> = channels
                .iter()
                .map(|at| self.columns[*at].clone())
                .collect();
            let even = resample(&x, &samples, deviation);
            warnings.push(even.warning());
            let step = 1.0 / even.sample_rate;
            for (at, samples) in channels.into_iter().zip(even.samples) {
                self.columns[at] = samples;
            }
            return Ok(EvenTimes { start: x[0], step });
        }
        let (_, rate) = check
            .sample_rate(1.0)
            .ok_or_else(|| RecordingError::no_samples(file))?;
        if let Some(stated) = stated
            && (stated * rate - 1.0).abs() > SAME_RATE
        {
            let message = format!(
                "Delta_X states a step of {stated} s, the column of X has {} s, which is used",
                short(1.0 / rate)
            );
            warnings.push(RecordingWarning::new("sample-rate-ignored", message));
        }
        Ok(EvenTimes {
            start: x[0],
            step: 1.0 / rate,
        })
    }

    /// Takes the channels out, each with its name and unit.
    fn take_columns(&mut self) -> Vec<(Column, Vec<f64>)> {
        let channels = self.channels().into_iter().enumerate();
        let columns = channels.map(|(channel, at)| {
            let (name, in_brackets) = split_unit(&self.names[at]);
            let unit = self.property("Y_Unit_Label", channel).or(in_brackets);
            let header = Column::new(name, unit.unwrap_or_default());
            (header, at)
        });
        let columns: Vec<(Column, usize)> = columns.collect();
        let taken = columns
            .into_iter()
            .map(|(header, at)| (header, std::mem::take(&mut self.columns[at])));
        taken.collect()
    }

    /// Returns the columns as functions of frequency.
    ///
    /// # Errors
    /// Neither a column of frequencies nor a step of them.
    fn function_table(self, file: &str) -> Result<FunctionTable, RecordingError> {
        let channels = self.channels();
        let frequencies = match self.columns.first() {
            Some(x) if is_x(&self.names[0]) && x.len() == self.rows() => x.clone(),
            _ => {
                let first = self.number("X0").unwrap_or(0.0);
                let step = self.number("Delta_X").ok_or_else(|| {
                    let problem = "the segment has neither a column X_Value nor Delta_X: its frequencies are not known; export one of them";
                    RecordingError::at_line(file, self.first_line(), problem.to_owned())
                })?;
                (0..self.rows())
                    .map(|line| first + step * line as f64)
                    .collect()
            }
        };
        let mut headings = vec!["Frequency".to_owned()];
        headings.extend(channels.iter().map(|at| self.names[*at].clone()));
        Ok(FunctionTable {
            file: file.to_owned(),
            frequencies,
            columns: channels
                .iter()
                .map(|at| self.columns[*at].clone())
                .collect(),
            header: vec![headings],
            lines: self.lines,
        })
    }
}

fn is_x(name: &str) -> bool {
    name.eq_ignore_ascii_case("X_Value")
}

/// Separator and decimal mark of a file.
struct Marks {
    separator: Separator,
    decimal: u8,
}

/// Part of the file in which the next line lies.
#[derive(PartialEq)]
enum Part {
    FileHeader,
    SegmentHeader,
    Names,
    Rows,
    Special,
}

/// Reads all segments. Every number is checked.
fn read_segments(path: &Path, file: &str) -> Result<Vec<Segment>, RecordingError> {
    let opened = File::open(path).map_err(|error| unreadable(file, error))?;
    let mut reader = BufReader::new(opened);
    let mut marks = Marks {
        separator: Separator::Tab,
        decimal: b'.',
    };
    let mut segments: Vec<Segment> = Vec::new();
    let mut segment = Segment::new(Vec::new());
    let (mut part, mut after_special) = (Part::FileHeader, Part::FileHeader);
    let mut line = Vec::new();
    for number in 1_u64.. {
        line.clear();
        let mut bytes = reader.by_ref().take(MAX_LINE_BYTES as u64 + 1);
        let taken = bytes
            .read_until(b'\n', &mut line)
            .map_err(|error| unreadable(file, error))?;
        if taken == 0 {
            break;
        }
        if taken > MAX_LINE_BYTES {
            let problem = format!(
                "this line has more than {MAX_LINE_BYTES} bytes; allowed: one row of numbers per line"
            );
            return Err(RecordingError::at_line(file, number, problem));
        }
        let mut places = Vec::new();
        split_cells(&line, marks.separator, usize::MAX, &mut places);
        let cells: Vec<&[u8]> = places.iter().map(|cell| &line[cell.clone()]).collect();
        let first = cells.first().copied().unwrap_or_default();
        let blank = cells.iter().all(|cell| cell.is_empty());
        if first == b"***Start_Special***" {
            after_special = std::mem::replace(&mut part, Part::Special);
            continue;
        }
        match part {
            Part::Special => {
                if first == b"***End_Special***" {
                    part = std::mem::replace(&mut after_special, Part::FileHeader);
                }
            }
            Part::FileHeader if first == END.as_bytes() => part = Part::SegmentHeader,
            Part::FileHeader => marks.take(&line),
            Part::SegmentHeader if first == END.as_bytes() => part = Part::Names,
            Part::SegmentHeader if blank => {}
            Part::SegmentHeader => {
                segment
                    .header
                    .push(cells.iter().map(|cell| decode_text(cell)).collect());
            }
            Part::Names if blank => {}
            Part::Names => {
                segment.take_names(&cells, file, number)?;
                part = Part::Rows;
            }
            Part::Rows if blank => {}
            // Another segment begins.
            Part::Rows if is_key(first) => {
                let header = vec![cells.iter().map(|cell| decode_text(cell)).collect()];
                let next = Segment::new(header);
                segments.push(std::mem::replace(&mut segment, next));
                part = Part::SegmentHeader;
            }
            Part::Rows => segment.take_row(&cells, marks.decimal, file, number)?,
        }
    }
    if matches!(part, Part::FileHeader | Part::SegmentHeader) {
        let problem =
            format!("a header is not ended; expected is a line {END}; write the file again");
        return Err(RecordingError::new(file, problem));
    }
    segments.push(segment);
    segments.retain(|segment| segment.rows() > 0);
    match segments.is_empty() {
        true => Err(RecordingError::no_samples(file)),
        false => Ok(segments),
    }
}

/// Returns true for the first cell of a segment's header: a word and no number.
fn is_key(cell: &[u8]) -> bool {
    cell.first().is_some_and(u8::is_ascii_alphabetic)
        && cell
            .iter()
            .all(|byte| byte.is_ascii_alphanumeric() || *byte == b'_')
        && !cell.eq_ignore_ascii_case(b"nan")
        && !cell.eq_ignore_ascii_case(b"inf")
}

impl Marks {
    /// Takes separator and decimal mark from a line of the file's header.
    fn take(&mut self, line: &[u8]) {
        let text = decode_text(line);
        let mut words = text.trim().splitn(2, ['\t', ',', ';']);
        match (words.next(), words.next().map(str::trim)) {
            (Some("Separator"), Some("Comma")) => self.separator = Separator::Comma,
            (Some("Separator"), Some("Semicolon")) => self.separator = Separator::Semicolon,
            (Some("Decimal_Separator"), Some(mark)) if mark.starts_with(',') => self.decimal = b',',
            _ => {}
        }
    }
}

impl Segment {
    /// Takes the names of the columns. A column of comments at the end is none.
    fn take_names(&mut self, cells: &[&[u8]], file: &str, line: u64) -> Result<(), RecordingError> {
        let mut names: Vec<String> = cells.iter().map(|cell| decode_text(cell)).collect();
        while names
            .last()
            .is_some_and(|name| name.is_empty() || name == "Comment")
        {
            names.pop();
        }
        self.names = names;
        check_channel_count(file, self.names.len())?;
        if !self.names.first().is_some_and(|name| is_x(name)) || self.channels().is_empty() {
            let found = cells.first().map_or(String::new(), |cell| shown(cell));
            let problem = format!(
                "the line of names begins with \"{found}\"; allowed: X_Value and the names of the channels; write the file again"
            );
            return Err(RecordingError::at_line(file, line, problem));
        }
        self.columns = vec![Vec::new(); self.names.len()];
        Ok(())
    }

    /// Notes the digits of an X: the most decimals, or all digits where one has an exponent.
    fn note_digits(&mut self, cell: &[u8], decimal: u8) {
        let mark = cell.iter().position(|byte| *byte == decimal);
        let decimals = mark.map_or(0, |mark| cell.len() - mark - 1);
        self.printed = match self.printed {
            Printed::Decimals(most) if !cell.iter().any(|byte| b"eE".contains(byte)) => {
                Printed::Decimals(most.max(decimals.min(30)))
            }
            _ => Printed::Exact,
        };
    }

    /// Takes a row. X may be empty in every row; a cell behind the columns is a comment.
    fn take_row(
        &mut self,
        cells: &[&[u8]],
        decimal: u8,
        file: &str,
        line: u64,
    ) -> Result<(), RecordingError> {
        for (at, name) in self.names.iter().enumerate() {
            let cell = cells.get(at).copied().unwrap_or_default();
            let problem = match parse_number(cell, &mut Some(decimal)) {
                Ok(value) => {
                    self.columns[at].push(value);
                    continue;
                }
                Err(CellProblem::Missing) if is_x(name) => continue,
                Err(CellProblem::Missing) => "is missing; every row needs a number for each channel: channels of different lengths are not read; export them apart".to_owned(),
                Err(CellProblem::Text) => format!("holds \"{}\", which is not a number; correct or remove this line", shown(cell)),
                Err(CellProblem::NotFinite) => format!("holds \"{}\"; allowed: finite numbers of magnitude up to 1e100; remove the damaged rows", shown(cell)),
                Err(CellProblem::MixedDecimal(mark)) => format!("holds \"{}\"; allowed: \"{}\", the decimal mark of the header", shown(cell), char::from(mark)),
            };
            let problem = format!(
                "column {} (\"{}\") {problem}",
                at + 1,
                shown(name.as_bytes())
            );
            return Err(RecordingError::at_line(file, line, problem));
        }
        self.note_digits(cells.first().copied().unwrap_or_default(), decimal);
        self.lines.push(line);
        Ok(())
    }
}
