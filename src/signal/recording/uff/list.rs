//! Datasets of a universal file, found without reading their values.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use memchr::memchr;
use memchr::memmem::Finder;

use super::{
    Abscissa, Function, HEADER_LINES, Precision, TypeLine, UffCoding, UnitSystem, parse_header,
    parse_type_line,
};
use crate::recording::error::{RecordingError, RecordingWarning, unreadable};
use crate::recording::read_fully;
use crate::recording::text::parse_line;

/// More datasets than any file has; the limit keeps a file of nothing but marks out of memory.
const MAX_DATASETS: usize = 1_000_000;
/// Columns 1 to 6 of the line that opens and of the line that closes a dataset.
pub(super) const MARK: &[u8] = b"    -1";

/// The mark behind text, where it begins a line of its own.
const LINE_MARK: &[u8] = b"\n    -1";

/// A longer line is none; the limit keeps a file without line ends out of memory.
pub(super) const MAX_LINE_BYTES: usize = 1 << 20;

/// Bytes read at a time when values are jumped over: large, since nothing else is done.
const SCAN_BYTES: usize = 1 << 20;

/// Bytes behind a mark that tell whether its line is blank otherwise: to column 80 and the line's end.
const TAIL_BYTES: usize = 76;

/// One dataset of a universal file.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// Its place in the file, 1-based, all datasets counted.
    pub number: usize,
    /// Its type: 58 function, 151 header, 164 units, 15 and 2411 nodes, 82 lines, 55 mode shapes.
    pub kind: u32,
    /// Its header, where it is a function.
    pub function: Option<Function>,
    /// Bytes of the values, or of everything behind the type's line.
    pub bytes: u64,
    /// Place of the values.
    pub(super) place: DataPlace,
}

/// Place and layout of the values of a dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct DataPlace {
    /// First byte.
    pub start: u64,
    /// Byte behind the last.
    pub end: u64,
    /// Bytes of a stored abscissa in binary data.
    pub abscissa_bytes: u64,
    /// `true` where no mark follows: the file was cut here.
    pub cut: bool,
}

/// Contents of a universal file.
#[derive(Debug, Clone, PartialEq)]
pub struct UniversalFile {
    /// The file as the caller named it.
    pub name: String,
    /// Its datasets in order.
    pub datasets: Vec<Dataset>,
    /// Number of the dataset within whose header the file ends, which is left out.
    pub cut_header: Option<usize>,
    pub(super) path: PathBuf,
    pub(in crate::recording) units: Option<UnitSystem>,
}

/// A function and the dataset that holds it.
pub(in crate::recording) type Entry<'a> = (&'a Dataset, &'a Function);

impl UniversalFile {
    /// The functions with their datasets.
    pub fn functions(&self) -> impl Iterator<Item = (&Dataset, &Function)> {
        let datasets = self.datasets.iter();
        datasets.filter_map(|dataset| Some((dataset, dataset.function.as_ref()?)))
    }

    /// Returns `true` where any dataset holds data at nodes.
    pub(in crate::recording) fn has_data_at_nodes(&self) -> bool {
        self.datasets.iter().any(|dataset| dataset.kind == 55)
    }

    /// The doubt about a file that ends within a header.
    pub(in crate::recording) fn cut_header_doubt(&self) -> Option<RecordingWarning> {
        let dataset = self.cut_header?;
        let message = format!(
            "the file ends within the header of dataset {dataset}, which is left out; a copy was probably interrupted; export or copy it again"
        );
        Some(RecordingWarning::new("header-cut", message))
    }

    /// Contents in words: "2 x coherence, 1 x units (dataset 164)".
    pub fn contents(&self) -> String {
        let mut kinds: Vec<(String, usize)> = Vec::new();
        for dataset in &self.datasets {
            let kind = dataset.kind_name();
            match kinds.iter_mut().find(|(name, _)| *name == kind) {
                Some((_, count)) => *count += 1,
                None => kinds.push((kind, 1)),
            }
        }
        if kinds.is_empty() {
            return "an incomplete dataset".to_owned();
        }
        let words = kinds
            .iter()
            .map(|(name, count)| format!("{count} x {name}"));
        words.collect::<Vec<_>>().join(", ")
    }
}

impl Dataset {
    /// Kind in words: the function's type, or what datasets of this type hold.
    pub fn kind_name(&self) -> String {
        if let Some(function) = &self.function {
            return function.function_type.name().to_owned();
        }
        let name = match self.kind {
            15 | 2411 => "nodes",
            18 | 2420 => "coordinate systems",
            55 | 2414 => "data at nodes",
            58 => "function",
            82 | 2431 => "trace lines",
            151 => "header",
            161 => "data identification",
            164 => "units",
            2412 => "elements",
            _ => return format!("dataset {}", self.kind),
        };
        format!("{name} (dataset {})", self.kind)
    }
}

/// A dataset as messages name it: its number, place and description.
pub(in crate::recording) fn describe(function: &Function) -> String {
    let place = function.response.to_string();
    match &function.id_lines[0] {
        Some(words) if place == "-" => format!("\"{words}\""),
        Some(words) => format!("{place}, \"{words}\""),
        None => place,
    }
}

/// Lists the datasets of a universal file. Headers are read; values are jumped over, in binary
/// datasets by their count of bytes, in text by looking for the next mark.
///
/// # Errors
/// A file that cannot be read; a header that makes no sense.
pub fn list_datasets(path: &Path) -> Result<UniversalFile, RecordingError> {
    let mut found = UniversalFile {
        name: path.display().to_string(),
        datasets: Vec::new(),
        cut_header: None,
        path: path.to_owned(),
        units: None,
    };
    let mut scanner = Scanner::new(path, &found.name)?;
    while found.datasets.len() < MAX_DATASETS {
        // Up to the next mark, and past marks that follow it directly.
        let mut behind_mark = false;
        let (line_start, line) = loop {
            let start = scanner.position();
            match scanner.line()? {
                None => return Ok(found),
                Some(line) if is_mark(&line) => behind_mark = true,
                Some(line) if behind_mark => break (start, line),
                Some(_) => {}
            }
        };
        // A mark that closed a dataset has no type behind it.
        if let Some(kind) = parse_type_line(&line)
            && !read_dataset(&mut scanner, &mut found, kind, line_start)?
        {
            break;
        }
    }
    Ok(found)
}

/// Reads one dataset up to and with its closing mark; false at the end of the file.
fn read_dataset(
    scanner: &mut Scanner,
    found: &mut UniversalFile,
    kind: TypeLine,
    line_start: u64,
) -> Result<bool, RecordingError> {
    let number = found.datasets.len() + 1;
    let mut function = None;
    if kind.number == 58 {
        let mut lines: [Vec<u8>; HEADER_LINES] = Default::default();
        for line in &mut lines {
            match scanner.line()? {
                Some(read) if !is_mark(&read) => *line = read,
                _ => {
                    found.cut_header = Some(number);
                    return Ok(false);
                }
            }
        }
        let read = parse_header(&lines, kind.coding).map_err(|(record, problem)| {
            let line = line_number(&found.path, line_start) + record as u64;
            let problem = format!(
                "record {record} of dataset {number} (type 58) has {problem}; export the file again"
            );
            RecordingError::at_line(&found.name, line, problem)
        });
        function = Some(read?);
    }
    let start = scanner.position();
    if kind.number == 164 {
        // A line of words, then factors of length and force in columns of 25.
        let (words, factors) = (scanner.line()?, scanner.line()?);
        if let (Some(words), Some(factors)) = (words, factors)
            && !is_mark(&words)
        {
            let mut numbers = Vec::new();
            let read = parse_line(&factors, &[25; 3], 3, &mut numbers);
            if let (Ok(()), [length, force, ..]) = (read, numbers.as_slice()) {
                let (length, force) = (*length, *force);
                let usable = [length, force].iter().all(|x| (1e-12..1e12).contains(x));
                found.units = usable.then_some(UnitSystem { length, force });
            }
        }
        // Back, so that a mark among these lines is found where it is.
        scanner.jump(start.saturating_sub(1))?;
    }
    let place = match (&function, kind.coding) {
        (Some(function), UffCoding::Binary { .. }) => {
            binary_place(scanner, function, start, kind.bytes)?
        }
        _ => {
            let mark = scanner.find(LINE_MARK)?;
            DataPlace {
                start,
                end: mark.unwrap_or(scanner.length),
                abscissa_bytes: 0,
                cut: mark.is_none(),
            }
        }
    };
    found.datasets.push(Dataset {
        number,
        kind: kind.number,
        function,
        bytes: place.end.saturating_sub(place.start),
        place,
    });
    // The closing mark.
    scanner.line().map(|line| line.is_some())
}

/// Returns `true` for a line that holds -1 in columns 5 and 6 and nothing else.
fn is_mark(line: &[u8]) -> bool {
    line.trim_ascii_end() == MARK
}

/// Finds binary values. The promised number of points decides where it fits; else the promised
/// number of bytes; else the place of the next mark. Writers have got each of the first two wrong,
/// and some store the uneven abscissa of double precision values in double precision.
fn binary_place(
    scanner: &mut Scanner,
    function: &Function,
    start: u64,
    bytes: Option<u64>,
) -> Result<DataPlace, RecordingError> {
    // The standard width of a stored abscissa (bytes) first.
    let abscissa_widths: &[u64] = match (function.abscissa, function.precision) {
        (Abscissa::Uneven, Precision::Double) => &[4, 8],
        _ => &[4],
    };
    let mut proposals: Vec<(Option<u64>, u64)> = abscissa_widths
        .iter()
        .map(|width| {
            (
                function.points.checked_mul(function.point_bytes(*width)),
                *width,
            )
        })
        .collect();
    proposals.push((bytes, 4));
    let mut place = DataPlace {
        start,
        end: scanner.length,
        abscissa_bytes: 4,
        cut: false,
    };
    for (bytes, abscissa_bytes) in proposals {
        if let Some(end) = bytes.and_then(|bytes| start.checked_add(bytes))
            && scanner.ends_at(end)?
        {
            (place.end, place.abscissa_bytes) = (end, abscissa_bytes);
            return Ok(place);
        }
    }
    scanner.jump(start)?;
    place.end = scanner.find(MARK)?.unwrap_or(place.end);
    Ok(place)
}

/// A file with a place in it; lines are read through a buffer, which a jump throws away.
pub(super) struct Scanner {
    file: File,
    /// The file's name in errors.
    name: String,
    length: u64,
    buffer: Vec<u8>,
    /// Place of the buffer in the file.
    base: u64,
    /// Place in the buffer.
    at: usize,
}

impl Scanner {
    pub(super) fn new(path: &Path, name: &str) -> Result<Self, RecordingError> {
        let opened = File::open(path).and_then(|file| Ok((file.metadata()?.len(), file)));
        let (length, file) = opened.map_err(|source| unreadable(name, source))?;
        Ok(Self {
            file,
            name: name.to_owned(),
            length,
            buffer: Vec::new(),
            base: 0,
            at: 0,
        })
    }

    /// Place of the next line (bytes).
    pub(super) fn position(&self) -> u64 {
        self.base + self.at as u64
    }

    /// Goes on at byte `place`.
    pub(super) fn jump(&mut self, place: u64) -> Result<(), RecordingError> {
        let in_buffer = place
            .checked_sub(self.base)
            .filter(|at| *at <= self.buffer.len() as u64);
        if let Some(at) = in_buffer {
            self.buffer.drain(..at as usize);
            (self.base, self.at) = (place, 0);
            return Ok(());
        }
        self.buffer.clear();
        self.at = 0;
        let done = self.file.seek(SeekFrom::Start(place));
        self.base = done.map_err(|source| unreadable(&self.name, source))?;
        Ok(())
    }

    /// The next line without its end, or the first [`MAX_LINE_BYTES`] of it; `None` at the end of
    /// the file.
    pub(super) fn line(&mut self) -> Result<Option<Vec<u8>>, RecordingError> {
        loop {
            let rest = &self.buffer[self.at..];
            let end = memchr(b'\n', rest);
            if let Some(end) = end.or((rest.len() >= MAX_LINE_BYTES).then_some(rest.len())) {
                let line = &rest[..end];
                let line = line.strip_suffix(b"\r").unwrap_or(line).to_vec();
                self.at = (self.at + end + 1).min(self.buffer.len());
                return Ok(Some(line));
            }
            if self.fill(1 << 13)? == 0 {
                let last = self.buffer[self.at..].to_vec();
                self.at = self.buffer.len();
                return Ok((!last.is_empty()).then_some(last));
            }
        }
    }

    /// Goes to the next `mark` that ends its line, [`MARK`] or [`LINE_MARK`], and returns its place, a line end
    /// before it not counted; `None` at the end of the file.
    fn find(&mut self, mark: &[u8]) -> Result<Option<u64>, RecordingError> {
        let finder = Finder::new(mark);
        let skipped = mark.len() - MARK.len();
        // The line end before a mark may be the byte just read; what was read before it can go.
        let kept = self.at.saturating_sub(skipped);
        self.buffer.drain(..kept);
        self.base += kept as u64;
        self.at -= kept;
        let mut from = 0;
        loop {
            let rest = &self.buffer[from..];
            match finder.find(rest) {
                Some(found) => {
                    let mark = from + found + skipped;
                    let behind = mark + MARK.len();
                    while self.buffer.len() < behind + TAIL_BYTES && self.fill(1 << 13)? > 0 {}
                    if is_blank_to_line_end(&self.buffer[behind..]) {
                        self.at = mark;
                        return Ok(Some(self.position()));
                    }
                    from = behind;
                }
                None => {
                    // What may be the beginning of a mark stays.
                    from = from.max(self.buffer.len().saturating_sub(MARK.len()));
                    self.buffer.drain(..from);
                    self.base += from as u64;
                    (from, self.at) = (0, 0);
                    if self.fill(SCAN_BYTES)? == 0 {
                        self.at = self.buffer.len();
                        return Ok(None);
                    }
                }
            }
        }
    }

    /// Returns `true` where a dataset ends at `place`: at the end of the file, or at a mark with at most one line
    /// end before it. The scanner then stands at the mark.
    fn ends_at(&mut self, place: u64) -> Result<bool, RecordingError> {
        if place >= self.length {
            self.jump(self.length)?;
            return Ok(place == self.length);
        }
        self.jump(place)?;
        while self.buffer.len() < MARK.len() + TAIL_BYTES + 2 && self.fill(1 << 13)? > 0 {}
        let line_ends = self.buffer.iter().take(2);
        let line_ends = line_ends.take_while(|byte| b"\r\n".contains(byte)).count();
        let rest = &self.buffer[line_ends..];
        let ended = match rest.strip_prefix(MARK) {
            Some(behind) => is_blank_to_line_end(behind),
            None => {
                rest.trim_ascii().is_empty() && self.base + self.buffer.len() as u64 == self.length
            }
        };
        self.at = line_ends;
        Ok(ended)
    }

    /// Reads more into the buffer, and returns how many bytes it read.
    fn fill(&mut self, bytes: usize) -> Result<usize, RecordingError> {
        if self.at > SCAN_BYTES {
            self.buffer.drain(..self.at);
            self.base += self.at as u64;
            self.at = 0;
        }
        let before = self.buffer.len();
        self.buffer.resize(before + bytes, 0);
        let got = read_fully(&mut self.file, &mut self.buffer[before..])
            .map_err(|source| unreadable(&self.name, source))?;
        self.buffer.truncate(before + got);
        Ok(got)
    }
}

/// Returns `true` where only blanks stand before the end of the line or of the file.
fn is_blank_to_line_end(behind: &[u8]) -> bool {
    let first = behind.iter().find(|byte| **byte != b' ');
    matches!(first, None | Some(b'\r' | b'\n'))
}

/// Number (1-based) of the line that holds byte `place` of a file, counted for a message; 1 where the file cannot be read.
pub(super) fn line_number(path: &Path, place: u64) -> u64 {
    let Ok(file) = File::open(path) else {
        return 1;
    };
    let mut lines = 1;
    let mut block = vec![0_u8; 1 << 16];
    let mut before = file.take(place);
    while let Ok(got @ 1..) = before.read(&mut block) {
        let newlines = block.iter().take(got).filter(|byte| **byte == b'\n');
        lines += newlines.count() as u64;
    }
    lines
}
