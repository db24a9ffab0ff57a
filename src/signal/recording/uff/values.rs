//! Stored numbers of a function, block by block: abscissa (where uneven), then ordinate.

use std::fs::File;
use std::io::{Seek, SeekFrom};
use std::path::PathBuf;

use memchr::memchr;

use super::list::{DataPlace, Entry, MAX_LINE_BYTES, UniversalFile, line_number};
use super::{Abscissa, Function, Ordinate, Precision, UffCoding};
use crate::recording::error::{RecordingError, unreadable};
use crate::recording::read_fully;
use crate::recording::text::{parse_line, shown, without_last_number};

/// Bytes read at a time: large enough for speed, small against any memory.
const BLOCK_BYTES: usize = 1 << 16;

/// The values of a function in file units.
#[derive(Debug, Clone, PartialEq)]
pub struct FunctionValues {
    /// The stored abscissa; `None` where it is even and only its start and step are stored.
    pub abscissa: Option<Vec<f64>>,
    /// The ordinate, its real part where it is complex.
    pub real: Vec<f64>,
    /// Its imaginary part; `None` where it is real.
    pub imaginary: Option<Vec<f64>>,
}

/// Reads the values of the dataset at place `number` (1-based): as many points as the header
/// promises, or as many as there are. Meant for functions that fit into memory; long time series
/// are read in blocks by [`Recording`](crate::recording::Recording).
///
/// # Errors
/// No function at that place; text where a number is needed; a file that can no longer be read.
pub fn read_function(
    file: &UniversalFile,
    number: usize,
) -> Result<FunctionValues, RecordingError> {
    let entry = number.checked_sub(1).and_then(|at| {
        let dataset = file.datasets.get(at)?;
        Some((dataset, dataset.function.as_ref()?))
    });
    let entry = entry.ok_or_else(|| {
        let problem =
            format!("there is no function (dataset 58) at place {number}; list the datasets");
        RecordingError::new(&file.name, problem)
    })?;
    let values = Values::new(file, entry)?;
    let mut opened = values.open()?;
    let mut reader = values.reader(0, &mut opened)?;
    let ordinate = values.function.abscissa_numbers();
    let mut read = FunctionValues {
        abscissa: (ordinate > 0).then(Vec::new),
        real: Vec::new(),
        imaginary: (values.function.ordinate == Ordinate::Complex).then(Vec::new),
    };
    loop {
        let points = reader.next(&mut opened, u64::MAX)?;
        if points.is_empty() {
            return Ok(read);
        }
        for point in points.chunks_exact(values.function.numbers_per_point()) {
            if let Some(abscissa) = &mut read.abscissa {
                abscissa.push(point[0]);
            }
            read.real.push(point[ordinate]);
            if let Some(imaginary) = &mut read.imaginary {
                imaginary.push(point[ordinate + 1]);
            }
        }
    }
}

/// A place in text values that reading can start from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Checkpoint {
    /// First byte of a line.
    pub offset: u64,
    /// Numbers before it.
    pub numbers: u64,
}

/// A function in a file, ready to be read.
#[derive(Debug)]
pub(super) struct Values {
    path: PathBuf,
    /// The file's name in errors.
    pub file: String,
    dataset: usize,
    pub function: Function,
    place: DataPlace,
    /// Places in text from which reading can start; one at least.
    pub checkpoints: Vec<Checkpoint>,
    /// Samples of a text channel that is kept in memory, all of them.
    pub kept: Option<Vec<f64>>,
}

impl Values {
    /// The values of a function.
    pub(super) fn new(file: &UniversalFile, entry: Entry<'_>) -> Result<Self, RecordingError> {
        let (dataset, function) = entry;
        if let UffCoding::Binary { order, format } = function.coding
            && !matches!((order, format), (1 | 2, 2))
        {
            let problem = format!(
                "dataset {} (58b) has byte order {order} and floating-point format {format}; allowed: byte order 1 (little endian) or 2 (big endian) and format 2 (IEEE 754); export as ASCII or IEEE",
                dataset.number
            );
            return Err(RecordingError::new(&file.name, problem));
        }
        Ok(Self {
            path: file.path.clone(),
            file: file.name.clone(),
            dataset: dataset.number,
            function: function.clone(),
            place: dataset.place,
            checkpoints: vec![Checkpoint {
                offset: dataset.place.start,
                numbers: 0,
            }],
            kept: None,
        })
    }

    /// Opens the file; readers of several functions share it.
    pub(super) fn open(&self) -> Result<File, RecordingError> {
        File::open(&self.path).map_err(|source| unreadable(&self.file, source))
    }

    /// Bytes of a point in binary data.
    fn point_bytes(&self) -> u64 {
        self.function.point_bytes(self.place.abscissa_bytes).max(1)
    }

    /// A reader at a point.
    pub(super) fn reader(
        &self,
        point: u64,
        file: &mut File,
    ) -> Result<ValueReader<'_>, RecordingError> {
        let width = self.function.numbers_per_point() as u64;
        let wanted = point.min(self.function.points).saturating_mul(width);
        let block = match self.function.coding {
            UffCoding::Binary { .. } => {
                let before = point.saturating_mul(self.point_bytes());
                let offset = self.place.start.saturating_add(before);
                Checkpoint {
                    offset: offset.min(self.place.end),
                    numbers: wanted,
                }
            }
            // The first place has no numbers before it.
            UffCoding::Ascii => {
                let places = &self.checkpoints;
                places[places.partition_point(|place| place.numbers <= wanted) - 1]
            }
        };
        let mut reader = ValueReader {
            values: self,
            offset: block.offset,
            bytes: Vec::new(),
            parsed: Vec::new(),
            given: 0,
            decoded: block.numbers,
            at: point,
            block,
        };
        // Numbers between the place to start from and the point.
        let mut skipped = usize::try_from(wanted - block.numbers).unwrap_or(usize::MAX);
        while skipped > 0 && reader.decode_block(file)? {
            reader.given = skipped.min(reader.parsed.len());
            skipped -= reader.given;
        }
        Ok(reader)
    }
}

/// A place in the values of a function.
#[derive(Debug)]
pub(super) struct ValueReader<'a> {
    values: &'a Values,
    /// First byte that is not in `bytes`.
    offset: u64,
    /// Bytes of the last block that are not decoded: the beginning of a line or point.
    bytes: Vec<u8>,
    /// Numbers decoded, of which `given` are handed out.
    parsed: Vec<f64>,
    given: usize,
    /// Numbers decoded since the first of the dataset.
    decoded: u64,
    /// Points handed out since the first of the dataset.
    pub at: u64,
    /// Beginning of the block decoded last.
    pub block: Checkpoint,
}

impl ValueReader<'_> {
    /// Reads the numbers of up to `limit` points, whole points only; none at the end.
    pub(super) fn next(&mut self, file: &mut File, limit: u64) -> Result<&[f64], RecordingError> {
        let width = self.values.function.numbers_per_point();
        while self.parsed.len() - self.given < width {
            if !self.decode_block(file)? {
                return Ok(&[]);
            }
        }
        let points = (self.parsed.len() - self.given) / width;
        let points = points.min(usize::try_from(limit).unwrap_or(usize::MAX));
        let from = self.given;
        self.given += points * width;
        self.at += points as u64;
        Ok(&self.parsed[from..self.given])
    }

    /// Appends the ordinates of up to `limit` points, real parts of complex ones. Returns their number, 0 at the end.
    pub(super) fn next_ordinates(
        &mut self,
        file: &mut File,
        limit: u64,
        into: &mut Vec<f64>,
    ) -> Result<u64, RecordingError> {
        let function = &self.values.function;
        let (width, ordinate) = (function.numbers_per_point(), function.abscissa_numbers());
        let points = self.next(file, limit)?;
        match width {
            1 => into.extend_from_slice(points),
            _ => into.extend(points.iter().skip(ordinate).step_by(width)),
        }
        Ok((points.len() / width) as u64)
    }

    /// Numbers that the header promises and that are not decoded.
    fn missing(&self) -> u64 {
        let function = &self.values.function;
        let promised = function
            .points
            .saturating_mul(function.numbers_per_point() as u64);
        promised.saturating_sub(self.decoded)
    }

    /// Drops the numbers handed out and decodes the next block that has numbers; false at the end.
    fn decode_block(&mut self, file: &mut File) -> Result<bool, RecordingError> {
        self.parsed.drain(..self.given);
        self.given = 0;
        let values = self.values;
        let before = self.parsed.len();
        while self.parsed.len() == before && self.missing() > 0 {
            let kept = self.bytes.len();
            self.block = Checkpoint {
                offset: self.offset - kept as u64,
                numbers: self.decoded,
            };
            let left = values.place.end.saturating_sub(self.offset);
            let wanted = BLOCK_BYTES.min(usize::try_from(left).unwrap_or(usize::MAX));
            self.bytes.resize(kept + wanted, 0);
            let got = file
                .seek(SeekFrom::Start(self.offset))
                .and_then(|_| read_fully(file, &mut self.bytes[kept..]))
                .map_err(|source| unreadable(&values.file, source))?;
            self.bytes.truncate(kept + got);
            self.offset += got as u64;
            let done = match values.function.coding {
                UffCoding::Ascii => self.decode_lines(got == 0)?,
                UffCoding::Binary { order, .. } => self.decode_points(order == 2),
            };
            self.bytes.drain(..done);
            self.decoded += (self.parsed.len() - before) as u64;
            if got == 0 {
                break;
            }
        }
        Ok(self.parsed.len() > before)
    }

    /// Decodes whole lines, and the last one at the end. Returns how many bytes were used.
    fn decode_lines(&mut self, at_end: bool) -> Result<usize, RecordingError> {
        let values = self.values;
        let function = &values.function;
        // Columns of a line: 6E13.5, 4E20.12, 2(E13.5,E20.12) or E13.5,2E20.12.
        let widths: &[usize] = match (function.precision, function.abscissa, function.ordinate) {
            (Precision::Single, _, _) => &[13; 6],
            (Precision::Double, Abscissa::Even { .. }, _) => &[20; 4],
            (Precision::Double, Abscissa::Uneven, Ordinate::Real) => &[13, 20, 13, 20],
            (Precision::Double, Abscissa::Uneven, Ordinate::Complex) => &[13, 20, 20],
        };
        let mut room = usize::try_from(self.missing()).unwrap_or(usize::MAX);
        let mut done = 0;
        while room > 0 && done < self.bytes.len() {
            let rest = &self.bytes[done..];
            let (line, used) = match memchr(b'\n', rest) {
                Some(end) => (&rest[..end], end + 1),
                // The last number of a file that was cut may have lost digits.
                None if at_end && values.place.cut => {
                    (without_last_number(rest, widths), rest.len())
                }
                None if at_end => (rest, rest.len()),
                None => break,
            };
            let before = self.parsed.len();
            if let Err(text) = parse_line(line, widths, room, &mut self.parsed) {
                let problem = format!(
                    "dataset {} holds \"{}\", which is not a number; allowed: numbers in the columns of dataset 58 or between blanks; export the file again",
                    values.dataset,
                    shown(text)
                );
                let line = line_number(&values.path, self.block.offset + done as u64);
                return Err(RecordingError::at_line(&values.file, line, problem));
            }
            room -= self.parsed.len() - before;
            done += used;
        }
        if self.bytes.len() - done > MAX_LINE_BYTES {
            let problem = format!(
                "this line of dataset {} has more than {MAX_LINE_BYTES} bytes; allowed: one row of numbers per line; is it a binary dataset with a damaged header?",
                values.dataset
            );
            let line = line_number(&values.path, self.block.offset);
            return Err(RecordingError::at_line(&values.file, line, problem));
        }
        Ok(done)
    }

    /// Decodes whole points of binary data. Returns how many bytes were used.
    fn decode_points(&mut self, big_endian: bool) -> usize {
        let values = self.values;
        let point_bytes = values.point_bytes() as usize;
        let abscissa_bytes = values.place.abscissa_bytes as usize;
        let ordinate_bytes = values.function.ordinate_bytes();
        let room = usize::try_from(self.missing()).unwrap_or(usize::MAX);
        let points =
            (self.bytes.len() / point_bytes).min(room / values.function.numbers_per_point());
        let used = points * point_bytes;
        let bytes = &self.bytes[..used];
        if values.function.abscissa_numbers() == 0 || abscissa_bytes == ordinate_bytes {
            decode_equal(bytes, ordinate_bytes, big_endian, &mut self.parsed);
        } else {
            // Single precision abscissa before double precision ordinates (cases 6 and 8).
            for point in bytes.chunks_exact(point_bytes) {
                let (first, rest) = point.split_at(abscissa_bytes);
                decode_equal(first, abscissa_bytes, big_endian, &mut self.parsed);
                decode_equal(rest, ordinate_bytes, big_endian, &mut self.parsed);
            }
        }
        used
    }
}

/// Decodes IEEE numbers of 4 or 8 bytes.
fn decode_equal(bytes: &[u8], width: usize, big_endian: bool, into: &mut Vec<f64>) {
    if width == 4 {
        let (numbers, _) = bytes.as_chunks::<4>();
        match big_endian {
            false => into.extend(numbers.iter().map(|n| f64::from(f32::from_le_bytes(*n)))),
            true => into.extend(numbers.iter().map(|n| f64::from(f32::from_be_bytes(*n)))),
        }
    } else {
        let (numbers, _) = bytes.as_chunks::<8>();
        match big_endian {
            false => into.extend(numbers.iter().map(|n| f64::from_le_bytes(*n))),
            true => into.extend(numbers.iter().map(|n| f64::from_be_bytes(*n))),
        }
    }
}
