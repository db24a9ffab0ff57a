//! Stored numbers of a function, block by block: abscissa (where uneven), then ordinate.

use std::fs::File;
use std::io::{Seek, SeekFrom};
use std::path::PathBuf;
use std::sync::Arc;

use memchr::memchr;

use super::list::{DataPlace, Dataset, MAX_LINE_BYTES, UniversalFile, line_number};
use super::numbers;
use super::{Function, Ordinate, UffCoding};
use crate::recording::error::{RecordingError, UffError};
use crate::recording::text::shown;
use crate::recording::{read_fully, unreadable};

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
    /// Points that the header promises; there may be fewer in a truncated file.
    pub promised: u64,
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
    let found = file
        .functions()
        .find(|(dataset, _)| dataset.number == number);
    let (dataset, function) = found.ok_or_else(|| UffError::NotAFunction {
        file: file.name.clone(),
        dataset: number,
    })?;
    read_values(file, dataset, function)
}

/// Reads all values of a function.
pub(in crate::recording) fn read_values(
    file: &UniversalFile,
    dataset: &Dataset,
    function: &Function,
) -> Result<FunctionValues, RecordingError> {
    let values = Values::new(file, dataset, function)?;
    let mut opened = values.open()?;
    let mut reader = values.reader(0, &mut opened)?;
    let (mut abscissa, mut real, mut imaginary) = (Vec::new(), Vec::new(), Vec::new());
    let uneven = values.ordinate > 0;
    let complex = function.ordinate == Ordinate::Complex;
    loop {
        let points = reader.next(&mut opened, u64::MAX)?;
        if points.is_empty() {
            break;
        }
        for point in points.chunks_exact(values.numbers) {
            if uneven {
                abscissa.extend(point.first());
            }
            real.extend(point.get(values.ordinate));
            if complex {
                imaginary.extend(point.get(values.ordinate + 1));
            }
        }
    }
    Ok(FunctionValues {
        abscissa: uneven.then_some(abscissa),
        real,
        imaginary: complex.then_some(imaginary),
        promised: function.points,
    })
}

/// A place in text values that reading can start from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Checkpoint {
    /// First byte of a line.
    pub offset: u64,
    /// Numbers before it.
    pub numbers: u64,
}

/// Storage of the numbers of a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    Ascii {
        widths: &'static [usize],
    },
    Binary {
        big_endian: bool,
        abscissa_bytes: usize,
        ordinate_bytes: usize,
    },
}

/// A function in a file, ready to be read.
#[derive(Debug, Clone)]
pub(super) struct Values {
    path: PathBuf,
    pub file: String,
    dataset: usize,
    place: DataPlace,
    layout: Layout,
    /// Numbers of one point.
    pub numbers: usize,
    /// Place of the (real part of the) ordinate among them.
    pub ordinate: usize,
    /// Points that the header promises.
    promised: u64,
    /// Bytes of a point in binary data.
    point_bytes: u64,
    /// Places in text from which reading can start; one at least.
    pub checkpoints: Arc<Vec<Checkpoint>>,
    /// Samples of a text channel that is kept in memory, all of them.
    pub kept: Option<Arc<Vec<f64>>>,
}

impl Values {
    /// The values of a dataset that has a function.
    pub(super) fn new(
        file: &UniversalFile,
        dataset: &Dataset,
        function: &Function,
    ) -> Result<Self, UffError> {
        let place = dataset.place;
        let layout = match function.coding {
            UffCoding::Ascii => Layout::Ascii {
                widths: function.column_widths(),
            },
            UffCoding::Binary {
                order: order @ (1 | 2),
                format: 2,
            } => Layout::Binary {
                big_endian: order == 2,
                abscissa_bytes: place.abscissa_bytes as usize,
                ordinate_bytes: function.ordinate_bytes(),
            },
            UffCoding::Binary { order, format } => {
                return Err(UffError::FloatFormat {
                    file: file.name.clone(),
                    dataset: dataset.number,
                    order,
                    format,
                });
            }
        };
        Ok(Self {
            path: file.path.clone(),
            file: file.name.clone(),
            dataset: dataset.number,
            place,
            layout,
            numbers: function.numbers(),
            ordinate: function.abscissa_numbers(),
            promised: function.points,
            point_bytes: function.point_bytes(place.abscissa_bytes).max(1),
            checkpoints: Arc::new(vec![Checkpoint {
                offset: place.start,
                numbers: 0,
            }]),
            kept: None,
        })
    }

    /// Returns `true` for text, which is slow to read twice.
    pub(super) fn is_text(&self) -> bool {
        matches!(self.layout, Layout::Ascii { .. })
    }

    /// Opens the file; readers of several functions share it.
    pub(super) fn open(&self) -> Result<File, RecordingError> {
        File::open(&self.path).map_err(|source| unreadable(&self.file, source))
    }

    /// A reader at a point.
    pub(super) fn reader(
        &self,
        point: u64,
        file: &mut File,
    ) -> Result<ValueReader<'_>, RecordingError> {
        let wanted = point.min(self.promised).saturating_mul(self.numbers as u64);
        let block = match self.layout {
            Layout::Binary { .. } => {
                let before = point.saturating_mul(self.point_bytes);
                let offset = self.place.start.saturating_add(before);
                Checkpoint {
                    offset: offset.min(self.place.end),
                    numbers: wanted,
                }
            }
            Layout::Ascii { .. } => {
                let later = self
                    .checkpoints
                    .partition_point(|place| place.numbers <= wanted);
                let place = self.checkpoints.get(later.saturating_sub(1)).copied();
                place.unwrap_or(Checkpoint {
                    offset: self.place.start,
                    numbers: 0,
                })
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
        let mut skipped =
            usize::try_from(wanted.saturating_sub(block.numbers)).unwrap_or(usize::MAX);
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
        let width = self.values.numbers;
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
        Ok(self.parsed.get(from..self.given).unwrap_or_default())
    }

    /// Appends the ordinates of up to `limit` points, real parts of complex ones. Returns their number, 0 at the end.
    pub(super) fn next_ordinates(
        &mut self,
        file: &mut File,
        limit: u64,
        into: &mut Vec<f64>,
    ) -> Result<u64, RecordingError> {
        let (width, ordinate) = (self.values.numbers, self.values.ordinate);
        let points = self.next(file, limit)?;
        match width {
            1 => into.extend_from_slice(points),
            _ => into.extend(points.iter().skip(ordinate).step_by(width)),
        }
        Ok((points.len() / width) as u64)
    }

    /// Numbers that the header promises and that are not decoded.
    fn missing(&self) -> u64 {
        let width = self.values.numbers as u64;
        let promised = self.values.promised.saturating_mul(width);
        promised.saturating_sub(self.decoded)
    }

    /// Drops the numbers handed out and decodes the next block that has numbers; false at the end.
    fn decode_block(&mut self, file: &mut File) -> Result<bool, RecordingError> {
        self.parsed.drain(..self.given);
        self.given = 0;
        let before = self.parsed.len();
        while self.parsed.len() == before && self.missing() > 0 {
            self.block = Checkpoint {
                offset: self.offset - self.bytes.len() as u64,
                numbers: self.decoded,
            };
            let got = self.load(file)?;
            let done = match self.values.layout {
                Layout::Ascii { widths } => self.decode_lines(widths, got == 0)?,
                Layout::Binary {
                    big_endian,
                    abscissa_bytes,
                    ordinate_bytes,
                } => self.decode_points(big_endian, abscissa_bytes, ordinate_bytes),
            };
            self.bytes.drain(..done);
            self.decoded += (self.parsed.len() - before) as u64;
            if got == 0 {
                break;
            }
        }
        Ok(self.parsed.len() > before)
    }

    fn load(&mut self, file: &mut File) -> Result<usize, RecordingError> {
        let left = self.values.place.end.saturating_sub(self.offset);
        let wanted = BLOCK_BYTES.min(usize::try_from(left).unwrap_or(usize::MAX));
        let before = self.bytes.len();
        self.bytes.resize(before + wanted, 0);
        let rest = self.bytes.get_mut(before..).unwrap_or_default();
        let got = file
            .seek(SeekFrom::Start(self.offset))
            .and_then(|_| read_fully(file, rest))
            .map_err(|source| unreadable(&self.values.file, source))?;
        self.bytes.truncate(before + got);
        self.offset += got as u64;
        Ok(got)
    }

    /// Decodes whole lines, and the last one at the end. Returns how many bytes were used.
    fn decode_lines(&mut self, widths: &[usize], at_end: bool) -> Result<usize, RecordingError> {
        let mut room = usize::try_from(self.missing()).unwrap_or(usize::MAX);
        let mut done = 0;
        while room > 0 && done < self.bytes.len() {
            let rest = self.bytes.get(done..).unwrap_or_default();
            let (line, used) = match memchr(b'\n', rest) {
                Some(end) => (rest.get(..end).unwrap_or_default(), end + 1),
                // The last number of a file that was cut may have lost digits.
                None if at_end && self.values.place.cut => {
                    (numbers::without_last_number(rest, widths), rest.len())
                }
                None if at_end => (rest, rest.len()),
                None => break,
            };
            let before = self.parsed.len();
            if let Err(text) = numbers::parse_line(line, widths, room, &mut self.parsed) {
                let place = self.block.offset + done as u64;
                return Err(UffError::NotANumber {
                    file: self.values.file.clone(),
                    line: line_number(&self.values.path, place),
                    dataset: self.values.dataset,
                    value: shown(text),
                }
                .into());
            }
            room -= self.parsed.len() - before;
            done += used;
        }
        if self.bytes.len() - done > MAX_LINE_BYTES {
            return Err(UffError::LineTooLong {
                file: self.values.file.clone(),
                line: line_number(&self.values.path, self.block.offset),
                dataset: self.values.dataset,
                limit: MAX_LINE_BYTES,
            }
            .into());
        }
        Ok(done)
    }

    /// Decodes whole points of binary data. Returns how many bytes were used.
    fn decode_points(
        &mut self,
        big_endian: bool,
        abscissa_bytes: usize,
        ordinate_bytes: usize,
    ) -> usize {
        let point_bytes = self.values.point_bytes as usize;
        let room = usize::try_from(self.missing()).unwrap_or(usize::MAX);
        let points = (self.bytes.len() / point_bytes).min(room / self.values.numbers);
        let used = points * point_bytes;
        let bytes = self.bytes.get(..used).unwrap_or_default();
        if self.values.ordinate == 0 || abscissa_bytes == ordinate_bytes {
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
