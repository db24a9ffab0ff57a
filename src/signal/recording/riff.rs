//! The chunks of a WAV file: where the samples are and how they are coded.
//!
//! Our own walker, because files from recorders break rules that hound insists on: odd chunks
//! without or with their pad byte, 64-bit sizes (RF64, BW64), sizes that a crash left at 0,
//! 0xFFFFFFFF or beyond the end of the file. It believes no size without comparing it with the file.

use std::io::{self, Read, Seek, SeekFrom};

use super::coding::{Coding, FormatFields};
use super::error::RecordingError;
use super::warning::RecordingWarning;
use super::wav_error::WavError;

/// More channels than this are taken for a damaged header; the largest front ends have hundreds.
pub(super) const MAX_CHANNELS: usize = 4096;

/// More chunks than this are taken for garbage: real files have a dozen.
const MAX_CHUNKS: usize = 10_000;

/// Chunk names that tell a real chunk from samples or from a missing pad byte.
const KNOWN_CHUNKS: [&[u8; 4]; 16] = [
    b"fmt ", b"data", b"fact", b"LIST", b"JUNK", b"junk", b"PAD ", b"bext", b"iXML", b"cue ",
    b"smpl", b"inst", b"id3 ", b"axml", b"chna", b"ds64",
];

/// What the header says, checked against the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct WavLayout {
    pub sample_rate: u32,
    pub channels: usize,
    pub coding: Coding,
    /// Bytes of one sample of all channels.
    pub frame_bytes: u64,
    /// Where the samples begin in the file.
    pub data_start: u64,
    /// Complete samples per channel that are in the file.
    pub frames: u64,
    pub warnings: Vec<RecordingWarning>,
}

/// Walks the chunks up to the samples. `file` names the file in errors.
pub(super) fn walk(
    reader: &mut (impl Read + Seek),
    file: &str,
) -> Result<WavLayout, RecordingError> {
    Walker::new(reader, file)?.run()
}

struct Walker<'a, R> {
    reader: &'a mut R,
    file: &'a str,
    length: u64,
    long_data_size: Option<u64>,
    format: Option<WaveFormat>,
}

/// The fields of a "fmt " chunk that are used.
#[derive(Debug, Clone, Copy)]
struct WaveFormat {
    channels: u16,
    sample_rate: u32,
    coding: Coding,
}

impl<'a, R: Read + Seek> Walker<'a, R> {
    fn new(reader: &'a mut R, file: &'a str) -> Result<Self, RecordingError> {
        let length = reader
            .seek(SeekFrom::End(0))
            .map_err(|source| unreadable(file, source))?;
        Ok(Self {
            reader,
            file,
            length,
            long_data_size: None,
            format: None,
        })
    }

    /// The chunks begin after "RIFF", a size and "WAVE".
    fn run(mut self) -> Result<WavLayout, RecordingError> {
        let mut at = 12;
        for _ in 0..MAX_CHUNKS {
            let Some((name, size)) = self.chunk_header(at)? else {
                break;
            };
            match &name {
                b"fmt " => self.format = Some(self.read_format(at + 8, size)?),
                b"ds64" => self.long_data_size = self.read_long_size(at + 8)?,
                b"data" => return self.finish(at + 8, size),
                _ => {}
            }
            at = self.after_chunk(at + 8, u64::from(size))?;
        }
        let (chunk, place) = match self.format {
            Some(_) => ("data", ""),
            None => ("fmt ", ""),
        };
        Err(self.missing(chunk, place))
    }

    /// Name and size of the chunk at `at`; `None` at the end of the file.
    fn chunk_header(&mut self, at: u64) -> Result<Option<([u8; 4], u32)>, RecordingError> {
        let mut header = [0_u8; 8];
        let got = self.read_at(at, &mut header)?;
        let [a, b, c, d, size @ ..] = header;
        Ok((got == 8).then(|| ([a, b, c, d], u32::from_le_bytes(size))))
    }

    /// Where the next chunk begins. Chunks are padded to even length; where a writer forgot the
    /// pad byte, a known name stands right behind the chunk.
    fn after_chunk(&mut self, content: u64, size: u64) -> Result<u64, RecordingError> {
        let end = content.saturating_add(size);
        if size.is_multiple_of(2) {
            return Ok(end);
        }
        let mut name = [0_u8; 4];
        let got = self.read_at(end, &mut name)?;
        let unpadded = got == 4 && KNOWN_CHUNKS.contains(&&name);
        Ok(if unpadded { end } else { end.saturating_add(1) })
    }

    /// The data size in a "ds64" chunk: after the 64-bit RIFF size.
    fn read_long_size(&mut self, at: u64) -> Result<Option<u64>, RecordingError> {
        let mut bytes = [0_u8; 8];
        let got = self.read_at(at.saturating_add(8), &mut bytes)?;
        Ok((got == 8).then(|| u64::from_le_bytes(bytes)))
    }

    fn read_format(&mut self, at: u64, size: u32) -> Result<WaveFormat, RecordingError> {
        let mut bytes = [0_u8; 40];
        let wanted = bytes.len().min(size as usize);
        let got = match bytes.get_mut(..wanted) {
            Some(part) => self.read_at(at, part)?,
            None => 0,
        };
        if got < 16 {
            return Err(self.bad_header("bytes in the \"fmt \" chunk", got as u64, "16 or more"));
        }
        let word = |at: usize| match bytes.get(at..at + 2) {
            Some(&[low, high]) => u16::from_le_bytes([low, high]),
            _ => 0,
        };
        let channels = word(2);
        let sample_rate = u32::from(word(4)) | u32::from(word(6)) << 16;
        if channels == 0 {
            return Err(self.bad_header("channels", 0, "1 or more"));
        }
        if sample_rate == 0 {
            return Err(self.bad_header("sample rate (Hz)", 0, "1 or more"));
        }
        // In the extensible header valid bits stand at 18 and the real tag begins the subformat.
        let extensible = word(0) == 0xfffe && got >= 26;
        let (tag, valid) = match extensible {
            true => (word(24), word(18)),
            false => (word(0), word(14)),
        };
        let fields = FormatFields {
            tag,
            channels,
            frame_bytes: word(12),
            bits: word(14),
            valid,
        };
        let coding = fields.coding(self.file)?;
        Ok(WaveFormat {
            channels,
            sample_rate,
            coding,
        })
    }

    fn finish(mut self, start: u64, size: u32) -> Result<WavLayout, RecordingError> {
        let Some(format) = self.format else {
            return Err(self.missing("fmt ", " before the samples"));
        };
        let channels = usize::from(format.channels);
        if channels > MAX_CHANNELS {
            return Err(RecordingError::TooManyChannels {
                file: self.file.to_owned(),
                channels,
                limit: MAX_CHANNELS,
            });
        }
        let frame_bytes = u64::from(format.channels) * format.coding.bytes();
        let (frames, warning) = self.count_frames(start, size, frame_bytes)?;
        Ok(WavLayout {
            sample_rate: format.sample_rate,
            channels,
            coding: format.coding,
            frame_bytes,
            data_start: start,
            frames,
            warnings: warning.into_iter().collect(),
        })
    }

    /// How many complete frames the file holds from `start`, whatever `size` promises.
    fn count_frames(
        &mut self,
        start: u64,
        size: u32,
        frame_bytes: u64,
    ) -> Result<(u64, Option<RecordingWarning>), RecordingError> {
        let available = self.length.saturating_sub(start);
        let promised = match (size, self.long_data_size) {
            (u32::MAX, Some(long)) => long,
            _ => u64::from(size),
        };
        let closed_and_empty = promised == 0 && self.only_chunks_follow(start)?;
        let bytes = match is_unset(promised) {
            _ if closed_and_empty => 0,
            true => available,
            false => promised.min(available),
        };
        let frames = bytes / frame_bytes;
        if frames == 0 {
            return Err(RecordingError::NoSamples {
                file: self.file.to_owned(),
            });
        }
        let warning = if is_unset(promised) {
            Some(RecordingWarning::UnknownLength {
                size: promised,
                present: frames,
            })
        } else if promised / frame_bytes > frames {
            Some(RecordingWarning::Truncated {
                present: frames,
                promised: promised / frame_bytes,
            })
        } else {
            None
        };
        Ok((frames, warning))
    }

    /// Whether well-formed, known chunks fill the file from `at` to its end: then a data size of 0
    /// is the truth and not the mark of a crash.
    fn only_chunks_follow(&mut self, mut at: u64) -> Result<bool, RecordingError> {
        for _ in 0..MAX_CHUNKS {
            if at >= self.length {
                return Ok(true);
            }
            match self.chunk_header(at)? {
                Some((name, size)) if KNOWN_CHUNKS.contains(&&name) => {
                    at = self.after_chunk(at + 8, u64::from(size))?;
                }
                _ => return Ok(false),
            }
        }
        Ok(false)
    }

    /// Reads as much of `into` as the file has at `at`.
    fn read_at(&mut self, at: u64, into: &mut [u8]) -> Result<usize, RecordingError> {
        if at >= self.length {
            return Ok(0);
        }
        let read = self
            .reader
            .seek(SeekFrom::Start(at))
            .and_then(|_| read_fully(self.reader, into));
        read.map_err(|source| unreadable(self.file, source))
    }

    fn missing(&self, chunk: &'static str, place: &'static str) -> RecordingError {
        WavError::MissingChunk {
            file: self.file.to_owned(),
            chunk,
            place,
        }
        .into()
    }

    fn bad_header(&self, field: &'static str, value: u64, allowed: &'static str) -> RecordingError {
        WavError::BadHeader {
            file: self.file.to_owned(),
            field,
            value,
            allowed,
        }
        .into()
    }
}

/// Sizes that writers put in before they know the size.
fn is_unset(size: u64) -> bool {
    size == 0 || size == u64::from(u32::MAX) || size == u64::MAX
}

pub(super) fn unreadable(file: &str, source: io::Error) -> RecordingError {
    RecordingError::Unreadable {
        file: file.to_owned(),
        source,
    }
}

/// Fills `into` as far as the reader goes; how far is the result.
pub(super) fn read_fully(reader: &mut impl Read, into: &mut [u8]) -> io::Result<usize> {
    let mut got = 0;
    while let Some(rest) = into.get_mut(got..).filter(|rest| !rest.is_empty()) {
        match reader.read(rest) {
            Ok(0) => break,
            Ok(more) => got += more,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(got)
}
