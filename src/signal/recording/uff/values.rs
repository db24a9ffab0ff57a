//! The stored numbers of a function, block by block: abscissa (where uneven), then ordinate.

use std::fs::File;
use std::io::{Seek, SeekFrom};
use std::path::PathBuf;
use std::sync::Arc;

use memchr::memchr;

use super::ascii;
use super::error::UffError;
use super::header::{Function, Precision, UffCoding};
use super::list::{DataPlace, Dataset, UniversalFile, point_bytes};
use super::scan::{MAX_LINE_BYTES, lines_before};
use crate::recording::RecordingError;
use crate::recording::riff::{read_fully, unreadable};
use crate::recording::text::shown;

/// Bytes read at a time: large enough for speed, small against any memory.
const BLOCK_BYTES: usize = 1 << 16;

/// A place in text values that reading can start from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Checkpoint {
    /// Where a line begins (bytes).
    pub offset: u64,
    /// Numbers before it.
    pub numbers: u64,
}

/// How the numbers of a function are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    Ascii {
        widths: &'static [usize],
    },
    Binary {
        big_endian: bool,
        precision: Precision,
        abscissa_bytes: usize,
        numbers: usize,
        abscissa: bool,
    },
}

/// A function in a file, ready to be read.
#[derive(Debug, Clone)]
pub(super) struct Values {
    pub path: PathBuf,
    pub file: String,
    pub dataset: usize,
    place: DataPlace,
    layout: Layout,
    /// Numbers of one point.
    pub numbers: usize,
    /// Which of them is the (real part of the) ordinate.
    pub ordinate: usize,
    /// Points that the header promises.
    pub promised: u64,
    point_bytes: u64,
    /// Where reading can start in text; one at least.
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
        let layout = match function.coding {
            UffCoding::Ascii => Layout::Ascii {
                widths: ascii::column_widths(function),
            },
            UffCoding::Binary {
                order: order @ (1 | 2),
                format: 2,
            } => Layout::Binary {
                big_endian: order == 2,
                precision: function.precision,
                abscissa_bytes: dataset.place.abscissa_bytes as usize,
                numbers: function.numbers(),
                abscissa: function.abscissa_numbers() > 0,
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
        let first = Checkpoint {
            offset: dataset.place.start,
            numbers: 0,
        };
        Ok(Self {
            path: file.path.clone(),
            file: file.name.clone(),
            dataset: dataset.number,
            place: dataset.place,
            layout,
            numbers: function.numbers(),
            ordinate: function.abscissa_numbers(),
            promised: function.points,
            point_bytes: point_bytes(function, dataset.place.abscissa_bytes).max(1),
            checkpoints: Arc::new(vec![first]),
            kept: None,
        })
    }

    /// Whether the values are text, which is slow to read twice.
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
        let last = self.promised.saturating_mul(self.numbers as u64);
        let wanted = point.saturating_mul(self.numbers as u64).min(last);
        let (offset, at) = match self.layout {
            Layout::Binary { .. } => {
                let before = point.saturating_mul(self.point_bytes);
                (
                    self.place.start.saturating_add(before).min(self.place.end),
                    wanted,
                )
            }
            Layout::Ascii { .. } => {
                let later = self
                    .checkpoints
                    .partition_point(|place| place.numbers <= wanted);
                let place = self.checkpoints.get(later.saturating_sub(1)).copied();
                let place = place.unwrap_or(Checkpoint {
                    offset: self.place.start,
                    numbers: 0,
                });
                (place.offset, place.numbers)
            }
        };
        let mut reader = ValueReader {
            values: self,
            offset,
            bytes: Vec::new(),
            parsed: Vec::new(),
            given: 0,
            at,
            block: Checkpoint {
                offset,
                numbers: at,
            },
        };
        let mut skipped = Vec::new();
        while reader.at < wanted && reader.next(file, wanted - reader.at, &mut skipped)? > 0 {
            skipped.clear();
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
    /// Numbers handed out since the first of the dataset.
    pub at: u64,
    /// Where the last block decoded began.
    block: Checkpoint,
}

impl ValueReader<'_> {
    /// Appends up to `limit` numbers; how many is the result, 0 at the end.
    pub(super) fn next(
        &mut self,
        file: &mut File,
        limit: u64,
        into: &mut Vec<f64>,
    ) -> Result<u64, RecordingError> {
        if self.given == self.parsed.len() {
            self.decode_block(file)?;
        }
        let rest = self.parsed.get(self.given..).unwrap_or_default();
        let count = rest.len().min(usize::try_from(limit).unwrap_or(usize::MAX));
        into.extend_from_slice(rest.get(..count).unwrap_or_default());
        self.given += count;
        self.at += count as u64;
        Ok(count as u64)
    }

    /// Where the block that the next numbers come from began, once all before are handed out.
    pub(super) fn checkpoint(&self) -> Checkpoint {
        self.block
    }

    /// Numbers that the header promises and that are not decoded.
    fn missing(&self) -> u64 {
        let promised = self
            .values
            .promised
            .saturating_mul(self.values.numbers as u64);
        promised.saturating_sub(self.at)
    }

    /// Decodes the next block that has numbers; `parsed` is empty at the end.
    fn decode_block(&mut self, file: &mut File) -> Result<(), RecordingError> {
        self.parsed.clear();
        self.given = 0;
        while self.parsed.is_empty() && self.missing() > 0 {
            self.block = Checkpoint {
                offset: self.offset - self.bytes.len() as u64,
                numbers: self.at,
            };
            let got = self.load(file)?;
            let done = match self.values.layout {
                Layout::Ascii { widths } => self.decode_lines(widths, got == 0)?,
                Layout::Binary { .. } => self.decode_points(),
            };
            self.bytes.drain(..done);
            if got == 0 {
                break;
            }
        }
        Ok(())
    }

    fn load(&mut self, file: &mut File) -> Result<usize, RecordingError> {
        let left = self.values.place.end.saturating_sub(self.offset);
        let wanted = BLOCK_BYTES.min(usize::try_from(left).unwrap_or(usize::MAX));
        let before = self.bytes.len();
        self.bytes.resize(before + wanted, 0);
        let seek = file.seek(SeekFrom::Start(self.offset));
        let got =
            seek.and_then(|_| read_fully(file, self.bytes.get_mut(before..).unwrap_or_default()));
        let got = got.map_err(|source| unreadable(&self.values.file, source))?;
        self.bytes.truncate(before + got);
        self.offset += got as u64;
        Ok(got)
    }

    /// Decodes whole lines, and the last one at the end; how many bytes were used is the result.
    fn decode_lines(&mut self, widths: &[usize], at_end: bool) -> Result<usize, RecordingError> {
        let mut room = usize::try_from(self.missing()).unwrap_or(usize::MAX);
        let mut done = 0;
        while room > 0 && done < self.bytes.len() {
            let rest = self.bytes.get(done..).unwrap_or_default();
            let (line, used) = match memchr(b'\n', rest) {
                Some(end) => (rest.get(..end).unwrap_or_default(), end + 1),
                // The last number of a file that was cut may have lost digits.
                None if at_end && self.values.place.cut => {
                    (ascii::without_last_number(rest, widths), rest.len())
                }
                None if at_end && !rest.is_empty() => (rest, rest.len()),
                None => break,
            };
            let before = self.parsed.len();
            if let Err(text) = ascii::parse_line(line, widths, room, &mut self.parsed) {
                let value = shown(text);
                return Err(self.not_a_number(done, value));
            }
            room -= self.parsed.len() - before;
            done += used;
        }
        if self.bytes.len() - done > MAX_LINE_BYTES {
            return Err(self.line_too_long());
        }
        Ok(done)
    }

    fn decode_points(&mut self) -> usize {
        let point = self.values.point_bytes as usize;
        let whole = self.bytes.len() / point * point;
        let room = usize::try_from(self.missing()).unwrap_or(usize::MAX);
        let used = whole.min((room / self.values.numbers.max(1)).saturating_mul(point));
        let bytes = self.bytes.get(..used).unwrap_or_default();
        if let Layout::Binary {
            big_endian,
            precision,
            abscissa_bytes,
            numbers,
            abscissa,
        } = self.values.layout
        {
            let ordinate = if precision == Precision::Single { 4 } else { 8 };
            if !abscissa || abscissa_bytes == ordinate {
                decode_equal(bytes, ordinate, big_endian, &mut self.parsed);
            } else {
                // Single precision abscissa before double precision ordinates (cases 6 and 8).
                for point in bytes.chunks_exact(abscissa_bytes + (numbers - 1) * ordinate) {
                    let (first, rest) = point.split_at(abscissa_bytes);
                    decode_equal(first, abscissa_bytes, big_endian, &mut self.parsed);
                    decode_equal(rest, ordinate, big_endian, &mut self.parsed);
                }
            }
        }
        used
    }

    fn line_number(&self, done: usize) -> u64 {
        let place = self.block.offset + done as u64;
        let counted = File::open(&self.values.path);
        let counted = counted.and_then(|mut file| lines_before(&mut file, place));
        counted.unwrap_or(0) + 1
    }

    fn not_a_number(&self, done: usize, value: String) -> RecordingError {
        UffError::NotANumber {
            file: self.values.file.clone(),
            line: self.line_number(done),
            dataset: self.values.dataset,
            value,
        }
        .into()
    }

    fn line_too_long(&self) -> RecordingError {
        UffError::LineTooLong {
            file: self.values.file.clone(),
            line: self.line_number(0),
            dataset: self.values.dataset,
            limit: MAX_LINE_BYTES,
        }
        .into()
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
