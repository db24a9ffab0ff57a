//! The datasets of a universal file, found without reading their values.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use super::error::UffError;
use super::header::{Abscissa, Function, Precision, UffCoding};
use super::records::{BadField, HEADER_LINES, TypeLine, parse_header, parse_type_line};
use super::scan::{MARK, Scanner};
use super::{UnitSystem, ascii};
use crate::recording::RecordingError;
use crate::recording::riff::unreadable;

/// More datasets than any file has; the limit keeps a file of nothing but marks out of memory.
const MAX_DATASETS: usize = 1_000_000;

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
    /// Where the values are.
    pub(super) place: DataPlace,
}

/// Where the values of a dataset are and how they are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct DataPlace {
    /// First byte.
    pub start: u64,
    /// Byte behind the last.
    pub end: u64,
    /// Bytes of a stored abscissa in binary data.
    pub abscissa_bytes: u64,
    /// Whether no mark follows: the file was cut here.
    pub cut: bool,
}

/// What is in a universal file.
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

impl UniversalFile {
    /// The functions with their datasets.
    pub fn functions(&self) -> impl Iterator<Item = (&Dataset, &Function)> {
        let datasets = self.datasets.iter();
        datasets.filter_map(|dataset| Some((dataset, dataset.function.as_ref()?)))
    }

    /// What the file holds, in words: "2 coherence, 1 units (164)".
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
    /// What it is, in words: the function's type, or what datasets of this type hold.
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
    let file = path.display().to_string();
    let scanner = File::open(path).and_then(Scanner::new);
    let mut listing = Listing {
        scanner: scanner.map_err(|source| unreadable(&file, source))?,
        found: UniversalFile {
            name: file,
            datasets: Vec::new(),
            cut_header: None,
            path: path.to_owned(),
            units: None,
        },
    };
    listing.run()?;
    Ok(listing.found)
}

/// A listing under way.
struct Listing {
    scanner: Scanner,
    found: UniversalFile,
}

/// What follows an opening mark.
enum Next {
    Dataset(TypeLine, u64),
    /// The mark closed a dataset, or the line is no dataset's type.
    Nothing,
    End,
}

impl Listing {
    fn run(&mut self) -> Result<(), RecordingError> {
        while self.found.datasets.len() < MAX_DATASETS && self.pass_mark()? {
            match self.type_line()? {
                Next::End => return Ok(()),
                Next::Nothing => {}
                Next::Dataset(kind, line_start) => {
                    if !self.dataset(kind, line_start)? {
                        return Ok(());
                    }
                }
            }
        }
        Ok(())
    }

    fn io<T>(&self, result: io::Result<T>) -> Result<T, RecordingError> {
        result.map_err(|source| unreadable(&self.found.name, source))
    }

    fn line(&mut self) -> Result<Option<Vec<u8>>, RecordingError> {
        let line = self.scanner.line();
        self.io(line)
    }

    /// Reads lines up to and with the next one that is a mark.
    fn pass_mark(&mut self) -> Result<bool, RecordingError> {
        while let Some(line) = self.line()? {
            if is_mark(&line) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Reads the line behind a mark; another mark there opens a dataset in its place.
    fn type_line(&mut self) -> Result<Next, RecordingError> {
        loop {
            let start = self.scanner.position();
            match self.line()? {
                None => return Ok(Next::End),
                Some(line) if is_mark(&line) => {}
                Some(line) => {
                    let kind = parse_type_line(&line);
                    return Ok(kind.map_or(Next::Nothing, |kind| Next::Dataset(kind, start)));
                }
            }
        }
    }

    /// Reads one dataset up to and with its closing mark; false at the end of the file.
    fn dataset(&mut self, kind: TypeLine, line_start: u64) -> Result<bool, RecordingError> {
        let number = self.found.datasets.len() + 1;
        let mut dataset = Dataset {
            number,
            kind: kind.number,
            function: None,
            bytes: 0,
            place: DataPlace::default(),
        };
        if kind.number == 58 {
            match self.header(kind, number, line_start)? {
                Some(function) => dataset.function = Some(function),
                None => {
                    self.found.cut_header = Some(number);
                    return Ok(false);
                }
            }
        }
        let start = self.scanner.position();
        if kind.number == 164 {
            self.units()?;
        }
        dataset.place = match (&dataset.function, kind.coding) {
            (Some(function), UffCoding::Binary { .. }) => {
                let place = binary_place(&mut self.scanner, function, start, kind.bytes);
                self.io(place)?
            }
            _ => {
                let mark = self.scanner.find_mark();
                let mark = self.io(mark)?;
                DataPlace {
                    start,
                    end: mark.unwrap_or(self.scanner.length),
                    abscissa_bytes: 0,
                    cut: mark.is_none(),
                }
            }
        };
        dataset.bytes = dataset.place.end.saturating_sub(dataset.place.start);
        self.found.datasets.push(dataset);
        // The closing mark.
        self.line().map(|line| line.is_some())
    }

    /// The header of a function; `None` where the file ends within it.
    fn header(
        &mut self,
        kind: TypeLine,
        number: usize,
        line_start: u64,
    ) -> Result<Option<Function>, RecordingError> {
        let mut lines: [Vec<u8>; HEADER_LINES] = Default::default();
        for line in &mut lines {
            match self.line()? {
                Some(read) if !is_mark(&read) => *line = read,
                _ => return Ok(None),
            }
        }
        match parse_header(&lines, kind.coding) {
            Ok(function) => Ok(Some(function)),
            Err(bad) => Err(self.bad_record(bad, number, line_start)),
        }
    }

    fn bad_record(&self, bad: BadField, dataset: usize, line_start: u64) -> RecordingError {
        let counted = File::open(&self.found.path);
        let counted = counted.and_then(|mut file| super::scan::lines_before(&mut file, line_start));
        UffError::BadRecord {
            file: self.found.name.clone(),
            line: counted.unwrap_or(0) + 1 + bad.record as u64,
            dataset,
            record: bad.record,
            field: bad.field,
            value: bad.value,
            allowed: bad.allowed,
        }
        .into()
    }

    /// Reads dataset 164: a line of words, then factors of length and force in columns of 25.
    fn units(&mut self) -> Result<(), RecordingError> {
        let place = self.scanner.position();
        let (words, factors) = (self.line()?, self.line()?);
        if let Some(factors) = factors.filter(|_| words.is_some_and(|line| !is_mark(&line))) {
            let mut numbers = Vec::new();
            let read = ascii::parse_line(&factors, &[25; 3], 3, &mut numbers);
            if let (Ok(()), [length, force, ..]) = (read, numbers.as_slice()) {
                self.found.units = UnitSystem::new(*length, *force);
            }
        }
        // Back, so that a mark among these lines is found where it is.
        let back = self.scanner.jump(place.saturating_sub(1));
        self.io(back)
    }
}

/// Whether a line holds -1 in columns 5 and 6 and nothing else.
fn is_mark(line: &[u8]) -> bool {
    line.trim_ascii_end() == MARK
}

/// Where binary values are. The promised number of points decides where it fits; else the promised
/// number of bytes; else the place of the next mark. Writers have got each of the first two wrong,
/// and some store the uneven abscissa of double precision values in double precision.
fn binary_place(
    scanner: &mut Scanner,
    function: &Function,
    start: u64,
    bytes: Option<u64>,
) -> io::Result<DataPlace> {
    let place = |end, abscissa_bytes| DataPlace {
        start,
        end,
        abscissa_bytes,
        cut: false,
    };
    let end_of = |abscissa| {
        let bytes = function
            .points
            .checked_mul(point_bytes(function, abscissa))?;
        start.checked_add(bytes)
    };
    for abscissa_bytes in abscissa_widths(function) {
        if let Some(end) = end_of(*abscissa_bytes)
            && scanner.ends_at(end)?
        {
            return Ok(place(end, *abscissa_bytes));
        }
    }
    if let Some(end) = bytes.and_then(|bytes| start.checked_add(bytes))
        && scanner.ends_at(end)?
    {
        return Ok(place(end, 4));
    }
    scanner.jump(start)?;
    let end = scanner.find_mark_behind_data()?.unwrap_or(scanner.length);
    Ok(place(end, 4))
}

/// Widths that a stored abscissa may have (bytes), the standard one first.
fn abscissa_widths(function: &Function) -> &'static [u64] {
    match (function.abscissa, function.precision) {
        (Abscissa::Uneven, Precision::Double) => &[4, 8],
        _ => &[4],
    }
}

/// Bytes of one point of binary data.
pub(super) fn point_bytes(function: &Function, abscissa_bytes: u64) -> u64 {
    let number = match function.precision {
        Precision::Single => 4,
        Precision::Double => 8,
    };
    let ordinates = (function.numbers() - function.abscissa_numbers()) as u64;
    ordinates * number + function.abscissa_numbers() as u64 * abscissa_bytes
}
