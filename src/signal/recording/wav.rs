//! WAV files: the chunks, the coding of the samples, and the samples as numbers (full scale = 1 for integers).
//!
//! Files from recorders break rules that the crate hound insists on: odd chunks without or with their pad byte,
//! 64-bit sizes (RF64, BW64), sizes that a crash left at 0, 0xFFFFFFFF or beyond the end of the file, 64-bit float,
//! integers that do not fill their containers. No size is believed without comparing it with the file.

use std::fs::File;
use std::io::{Cursor as BytesCursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::error::{RecordingError, RecordingWarning, check_channel_count, unreadable};
use super::health::{HealthMeter, check_finite};
use super::kept::KeptSamples;
use super::{ChannelInfo, Cursor, Format, ReadSettings, Recording, Source, read_fully};

/// More chunks than this are taken for garbage: real files have a dozen.
const MAX_CHUNKS: usize = 10_000;

/// Chunk names that tell a real chunk from samples or from a missing pad byte.
const KNOWN_CHUNKS: [&[u8; 4]; 16] = [
    b"fmt ", b"data", b"fact", b"LIST", b"JUNK", b"junk", b"PAD ", b"bext", b"iXML", b"cue ",
    b"smpl", b"inst", b"id3 ", b"axml", b"chna", b"ds64",
];
/// Bytes read at a time: large enough for speed, small against any memory.
const BLOCK_BYTES: u64 = 1 << 19;

/// Samples looked at to find out which end of a container is used: silence decides nothing.
const ALIGNMENT_FRAMES: u64 = 1 << 20;

/// Samples handled at a time when a WAV file is checked, over all channels.
const PASS_SAMPLES: usize = 1 << 17;

/// Opens a WAV file as a recording.
pub(super) fn open_wav(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<Recording, RecordingError> {
    let mut warnings = Vec::new();
    let mut source = WavSource::open(path, &file, &mut warnings)?;
    source.frames = settings.frames.unwrap_or(u64::MAX).min(source.frames);
    let (sample_rate, frames) = (f64::from(source.sample_rate), source.frames);
    warnings.extend(settings.ignored_rate(sample_rate));
    let format = source.format();
    let all: Vec<usize> = (0..source.channels).collect();
    let mut meters = source.meters();
    let per_block = source.frames_of_a_pass();
    let mut kept = KeptSamples::new(source.channels);
    let mut cursor = source.reader(0)?;
    let mut block = vec![Vec::new(); all.len()];
    let mut next = block.clone();
    let mut start = 0;
    cursor.read(&all, per_block, &mut block)?;
    while start < frames {
        let mut judge = || {
            for ((channel, samples), meter) in block.iter().enumerate().zip(&mut meters) {
                check_finite(&file, sample_rate, channel, start, samples)?;
                meter.add(samples);
                kept.add(channel, samples);
            }
            Ok(())
        };
        let end = cursor.at;
        if end < frames {
            // The next block is read meanwhile.
            let read = || {
                next.iter_mut().for_each(Vec::clear);
                cursor.read(&all, per_block, &mut next)
            };
            let (judged, read) = rayon::join(judge, read);
            judged.and(read)?;
        } else {
            judge()?;
        }
        std::mem::swap(&mut block, &mut next);
        start = end;
    }
    drop(cursor);
    let channels = meters.into_iter();
    Ok(Recording {
        name: file,
        format,
        sample_rate,
        frames,
        channels: channels
            .map(|meter| ChannelInfo::unscaled(None, None, meter))
            .collect(),
        warnings,
        source: kept.or_file(source),
        parts: Vec::new(),
    })
}

/// A WAV file whose header has been understood and checked against the file.
#[derive(Debug, Clone)]
pub(super) struct WavSource {
    path: PathBuf,
    file: String,
    pub(super) sample_rate: u32,
    pub(super) channels: usize,
    coding: Coding,
    /// Bytes of one sample of all channels.
    frame_bytes: u64,
    /// First byte of the samples in the file.
    data_start: u64,
    /// Complete samples per channel that are in the file.
    pub(super) frames: u64,
}

impl Source for WavSource {
    fn cursor(&self, frame: u64) -> Result<Box<dyn Cursor + '_>, RecordingError> {
        Ok(Box::new(self.reader(frame)?))
    }
}

impl WavSource {
    pub(super) fn format(&self) -> Format {
        match self.coding {
            Coding::Integer { valid, .. } => Format::WavInteger { bits: valid },
            Coding::Float { bits } => Format::WavFloat { bits },
        }
    }

    /// Returns a meter for each channel.
    pub(super) fn meters(&self) -> Vec<HealthMeter> {
        vec![HealthMeter::new(self.coding.full_scale()); self.channels]
    }

    /// Returns the frames that are handled at a time when the samples are checked.
    pub(super) fn frames_of_a_pass(&self) -> u64 {
        (PASS_SAMPLES / self.channels).max(1) as u64
    }

    /// Takes all complete frames that the file holds by now, whatever its header says.
    pub(super) fn take_all(&mut self) -> Result<(), RecordingError> {
        let found =
            std::fs::metadata(&self.path).map_err(|source| unreadable(&self.file, source))?;
        let bytes = found.len().saturating_sub(self.data_start);
        self.frames = bytes / self.frame_bytes;
        Ok(())
    }

    /// Walks the chunks up to the samples, from the first one behind "RIFF", a size and "WAVE".
    pub(super) fn open(
        path: &Path,
        file: &str,
        warnings: &mut Vec<RecordingWarning>,
    ) -> Result<Self, RecordingError> {
        let mut reader = File::open(path).map_err(|source| unreadable(file, source))?;
        let length = reader.seek(SeekFrom::End(0));
        let mut walker = ChunkWalker {
            reader,
            file,
            length: length.map_err(|source| unreadable(file, source))?,
        };
        let (mut at, mut format, mut long_size) = (12, None, None);
        for _ in 0..MAX_CHUNKS {
            let Some((name, size)) = walker.chunk_header(at)? else {
                break;
            };
            let content = at + 8;
            match (&name, format) {
                (b"fmt ", _) => format = Some(walker.read_format(content, size)?),
                (b"ds64", _) => {
                    // The data size stands after the 64-bit RIFF size.
                    let mut bytes = [0_u8; 8];
                    let got = walker.read_at(content + 8, &mut bytes)?;
                    long_size = (got == 8).then(|| u64::from_le_bytes(bytes));
                }
                (b"data", None) => return Err(walker.missing("fmt ", " before the samples")),
                (b"data", Some(format)) => {
                    let channels = usize::from(format.channels);
                    check_channel_count(file, channels)?;
                    let promised = long_size.filter(|_| size == u32::MAX);
                    let promised = promised.unwrap_or(u64::from(size));
                    let frame_bytes = u64::from(format.channels) * format.coding.bytes();
                    let (frames, doubt) = walker.count_frames(content, promised, frame_bytes)?;
                    warnings.extend(doubt);
                    let mut source = Self {
                        path: path.to_owned(),
                        file: file.to_owned(),
                        sample_rate: format.sample_rate,
                        channels,
                        coding: format.coding,
                        frame_bytes,
                        data_start: content,
                        frames,
                    };
                    warnings.extend(source.settle_alignment()?);
                    return Ok(source);
                }
                _ => {}
            }
            at = walker.after_chunk(content, u64::from(size))?;
        }
        Err(walker.missing(if format.is_some() { "data" } else { "fmt " }, ""))
    }

    /// Positions a reader at `frame`.
    pub(super) fn reader(&self, frame: u64) -> Result<WavCursor<'_>, RecordingError> {
        let at = frame.min(self.frames);
        let start = SeekFrom::Start(self.data_start + at * self.frame_bytes);
        let opened = File::open(&self.path).and_then(|mut reader| {
            reader.seek(start)?;
            Ok(reader)
        });
        Ok(WavCursor {
            source: self,
            reader: opened.map_err(|source| unreadable(&self.file, source))?,
            at,
            bytes: Vec::new(),
        })
    }

    /// Finds out which end of wide containers the valid bits sit at.
    ///
    /// At the high end the low bits are all zero. When they are not, and every value fits into the
    /// valid bits, the writer used the low end; when neither holds, all bits are taken as valid.
    fn settle_alignment(&mut self) -> Result<Option<RecordingWarning>, RecordingError> {
        let Coding::Integer { bits, valid, .. } = self.coding else {
            return Ok(None);
        };
        if bits == valid {
            return Ok(None);
        }
        let limit = 2_f64.powi(-i32::from(bits - valid));
        let (mut low_bits_zero, mut fits) = (true, true);
        let mut cursor = self.reader(0)?;
        while cursor.at < ALIGNMENT_FRAMES {
            if cursor.next_bytes(ALIGNMENT_FRAMES - cursor.at)? == 0 {
                break;
            }
            let mut values = Vec::new();
            (0..self.channels).for_each(|channel| cursor.decode(channel, &mut values));
            for value in &values {
                let steps = value * 2_f64.powi(i32::from(valid) - 1);
                low_bits_zero &= steps == steps.trunc();
                fits &= (-limit..limit).contains(value);
            }
        }
        if low_bits_zero || !fits {
            return Ok(None);
        }
        let full = valid;
        self.coding = Coding::Integer { bits, valid, full };
        let message = format!(
            "{valid}-bit samples sit at the low end of their {bits}-bit containers, not at the high end as the format demands; full scale is taken as {valid} bits; check the levels"
        );
        Ok(Some(RecordingWarning::new("right-aligned", message)))
    }
}

/// A reader somewhere in the samples.
#[derive(Debug)]
pub(super) struct WavCursor<'a> {
    source: &'a WavSource,
    reader: File,
    /// The next frame.
    at: u64,
    /// Bytes that were read last.
    bytes: Vec<u8>,
}

impl Cursor for WavCursor<'_> {
    fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
        into: &mut [Vec<f64>],
    ) -> Result<(), RecordingError> {
        let end = self.source.frames.min(self.at.saturating_add(limit));
        while self.at < end {
            self.next_bytes(end - self.at)?;
            for (channel, samples) in channels.iter().zip(into.iter_mut()) {
                self.decode(*channel, samples);
            }
        }
        Ok(())
    }
}

impl WavCursor<'_> {
    /// Reads the bytes of the next frames, at most `limit` and at most one block; returns the number of frames.
    fn next_bytes(&mut self, limit: u64) -> Result<u64, RecordingError> {
        let source = self.source;
        let per_block = (BLOCK_BYTES / source.frame_bytes).max(1);
        let frames = limit.min(per_block).min(source.frames - self.at);
        self.bytes.resize((frames * source.frame_bytes) as usize, 0);
        let got = read_fully(&mut self.reader, &mut self.bytes)
            .map_err(|error| unreadable(&source.file, error))?;
        if got < self.bytes.len() {
            let lost = self.at + got as u64 / source.frame_bytes;
            return Err(RecordingError::changed(&source.file, lost));
        }
        self.at += frames;
        Ok(frames)
    }

    /// Appends the samples of a channel in the bytes that were read last; integers with full scale 1.
    fn decode(&self, channel: usize, into: &mut Vec<f64>) {
        let coding = self.source.coding;
        let first = channel * coding.bytes() as usize;
        let frames = self.bytes.chunks_exact(self.source.frame_bytes as usize);
        let samples = frames.map(|frame| &frame[first..]);
        match coding {
            Coding::Float { bits: 32 } => into.extend(samples.map(|x| {
                let bytes = x.first_chunk::<4>().copied().unwrap_or_default();
                f64::from(f32::from_le_bytes(bytes))
            })),
            Coding::Float { .. } => into.extend(samples.map(|x| {
                let bytes = x.first_chunk::<8>().copied().unwrap_or_default();
                f64::from_le_bytes(bytes)
            })),
            Coding::Integer { bits: 8, .. } => {
                into.extend(samples.map(|x| (f64::from(x[0]) - 128.0) / 128.0));
            }
            Coding::Integer { bits, full, .. } => {
                // Filled from the high end, so that the sign extends itself.
                let scale = 2_f64.powi(i32::from(bits) - i32::from(full) - 31);
                match bits {
                    16 => into.extend(samples.map(|x| from_high_end::<2>(x) * scale)),
                    24 => into.extend(samples.map(|x| from_high_end::<3>(x) * scale)),
                    _ => into.extend(samples.map(|x| from_high_end::<4>(x) * scale)),
                }
            }
        }
    }
}

/// Returns the integer of which these are the highest bytes, little end first.
fn from_high_end<const BYTES: usize>(bytes: &[u8]) -> f64 {
    let mut padded = [0_u8; 4];
    padded[4 - BYTES..].copy_from_slice(&bytes[..BYTES]);
    f64::from(i32::from_le_bytes(padded))
}

/// A file whose chunks are read.
struct ChunkWalker<'a, R> {
    reader: R,
    /// The file's name in errors.
    file: &'a str,
    length: u64,
}

/// The fields of a "fmt " chunk that are used.
#[derive(Debug, Clone, Copy)]
struct WaveFormat {
    channels: u16,
    sample_rate: u32,
    coding: Coding,
}

impl<R: Read + Seek> ChunkWalker<'_, R> {
    /// Name and size of the chunk at `at`; `None` at the end of the file.
    fn chunk_header(&mut self, at: u64) -> Result<Option<([u8; 4], u32)>, RecordingError> {
        let mut header = [0_u8; 8];
        let got = self.read_at(at, &mut header)?;
        let [a, b, c, d, size @ ..] = header;
        Ok((got == 8).then(|| ([a, b, c, d], u32::from_le_bytes(size))))
    }

    /// Returns the place of the next chunk. Chunks are padded to even length; where a writer forgot the
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

    /// Reads the "fmt " chunk at `at`.
    fn read_format(&mut self, at: u64, size: u32) -> Result<WaveFormat, RecordingError> {
        let mut bytes = [0_u8; 40];
        let wanted = bytes.len().min(size as usize);
        let got = self.read_at(at, bytes.get_mut(..wanted).unwrap_or_default())?;
        if got < 16 {
            return Err(self.bad_header("bytes in the \"fmt \" chunk", got as u64, "16 or more"));
        }
        let words = bytes.as_chunks::<2>().0;
        let [
            tag,
            channels,
            rate_low,
            rate_high,
            frame_bytes,
            bits,
            valid,
            subformat,
        ] = [0, 1, 2, 3, 6, 7, 9, 12]
            .map(|at| words.get(at).map_or(0, |word| u16::from_le_bytes(*word)));
        let sample_rate = u32::from(rate_low) | u32::from(rate_high) << 16;
        if channels == 0 {
            return Err(self.bad_header("channels", 0, "1 or more"));
        }
        if sample_rate == 0 {
            return Err(self.bad_header("sample rate (Hz)", 0, "1 or more"));
        }
        // In the extensible header valid bits stand at 18 and the real tag begins the subformat.
        let (tag, valid) = match tag == 0xfffe && got >= 26 {
            true => (subformat, valid),
            false => (tag, bits),
        };
        // Writers that leave the valid bits at 0, or above the container, mean all of them.
        let valid = if valid == 0 { bits } else { valid.min(bits) };
        // Bytes of one sample of one channel: from the frame size, or from the bits where that is 0. Only of these
        // two tags is it known how samples lie in a frame.
        let mut bytes = bits.div_ceil(8);
        if matches!(tag, 1 | 3) && frame_bytes > 0 {
            if frame_bytes / channels < bytes || !frame_bytes.is_multiple_of(channels) {
                let allowed = "channels times bytes per sample";
                return Err(self.bad_header("bytes per frame", u64::from(frame_bytes), allowed));
            }
            bytes = frame_bytes / channels;
        }
        let Some(coding) = Coding::new(tag, bits, valid, bytes) else {
            let known = CODINGS.iter().find(|(known, _)| *known == tag);
            let name = known.map_or("of an unknown kind", |(_, name)| *name);
            let problem = format!(
                "WAV coding {name} (format tag 0x{tag:04x}, {bits} bits) is not read; allowed: integer of 8 to 32 bits, float of 32 or 64 bits; export as PCM or float"
            );
            return Err(RecordingError::new(self.file, problem));
        };
        Ok(WaveFormat {
            channels,
            sample_rate,
            coding,
        })
    }

    /// Counts the complete frames that the file holds from `start`, whatever number of bytes is promised.
    fn count_frames(
        &mut self,
        start: u64,
        promised: u64,
        frame_bytes: u64,
    ) -> Result<(u64, Option<RecordingWarning>), RecordingError> {
        let available = self.length.saturating_sub(start);
        // Sizes that writers put in before they know the size.
        let unset = promised == 0 || promised == u64::from(u32::MAX) || promised == u64::MAX;
        // 0 is the truth, and not the mark of a crash, where well-formed, known chunks fill the rest of the file.
        let mut at = start;
        if promised == 0 {
            for _ in 0..MAX_CHUNKS {
                match self.chunk_header(at)? {
                    Some((name, size)) if KNOWN_CHUNKS.contains(&&name) => {
                        at = self.after_chunk(at + 8, u64::from(size))?;
                    }
                    _ => break,
                }
            }
        }
        let bytes = match unset {
            _ if promised == 0 && at >= self.length => 0,
            true => available,
            false => promised.min(available),
        };
        let frames = bytes / frame_bytes;
        if frames == 0 {
            return Err(RecordingError::no_samples(self.file));
        }
        let doubt = if unset {
            let message = format!(
                "the header gives no valid length (data size {promised}); the recorder probably stopped without closing the file; read to the end of the file, {frames} samples per channel"
            );
            Some(RecordingWarning::new("unknown-length", message))
        } else {
            RecordingWarning::truncated(frames, promised / frame_bytes)
        };
        Ok((frames, doubt))
    }

    /// Reads as much of `into` as the file has at `at`.
    fn read_at(&mut self, at: u64, into: &mut [u8]) -> Result<usize, RecordingError> {
        if at >= self.length {
            return Ok(0);
        }
        let read = self
            .reader
            .seek(SeekFrom::Start(at))
            .and_then(|_| read_fully(&mut self.reader, into));
        read.map_err(|source| unreadable(self.file, source))
    }

    fn missing(&self, chunk: &str, place: &str) -> RecordingError {
        let problem = format!(
            "no \"{chunk}\" chunk{place}: not a usable WAV file; record or export it again"
        );
        RecordingError::new(self.file, problem)
    }

    fn bad_header(&self, field: &str, value: u64, allowed: &str) -> RecordingError {
        let problem =
            format!("the WAV header says {field} {value}; allowed: {allowed}; export it again");
        RecordingError::new(self.file, problem)
    }
}

/// What the head of a WAV stream says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct WavHead {
    pub(super) sample_rate: u32,
    pub(super) channels: u16,
    /// Bytes of one sample of all channels.
    pub(super) frame_bytes: u64,
    /// Content of its "fmt " chunk.
    pub(super) format_chunk: Vec<u8>,
    /// Bytes before the samples.
    pub(super) length: usize,
    /// Bytes of samples that it promises.
    pub(super) promised: u32,
}

/// Reads the head of a WAV file that comes as a stream; `None` while bytes are missing. `name` stands for it in errors.
pub(super) fn read_head(name: &str, bytes: &[u8]) -> Result<Option<WavHead>, RecordingError> {
    let mut walker = ChunkWalker {
        reader: BytesCursor::new(bytes),
        file: name,
        length: bytes.len() as u64,
    };
    let (mut at, mut format) = (12, None);
    while let Some((chunk, size)) = walker.chunk_header(at)? {
        let content = at + 8;
        let end = content.saturating_add(u64::from(size));
        match (&chunk, format) {
            (b"data", None) => return Err(walker.missing("fmt ", " before the samples")),
            (
                b"data",
                Some((
                    WaveFormat {
                        channels,
                        sample_rate,
                        coding,
                    },
                    format_chunk,
                )),
            ) => {
                check_channel_count(name, usize::from(channels))?;
                return Ok(Some(WavHead {
                    sample_rate,
                    channels,
                    frame_bytes: u64::from(channels) * coding.bytes(),
                    format_chunk,
                    length: content as usize,
                    promised: size,
                }));
            }
            // A chunk is judged once all of it is there.
            _ if end > bytes.len() as u64 => return Ok(None),
            (b"fmt ", _) => {
                let own = bytes[content as usize..end as usize].to_vec();
                format = Some((walker.read_format(content, size)?, own));
            }
            (_, known) => format = known,
        }
        at = walker.after_chunk(content, u64::from(size))?;
    }
    Ok(None)
}

/// Coding of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Coding {
    /// Integers of `valid` bits in containers of `bits` bits; 8 bits are unsigned.
    Integer {
        bits: u16,
        valid: u16,
        /// Bits of the full scale. The format demands that the valid bits sit at the high end of their containers,
        /// then these are the container's; some writers use the low end, with the sign extended.
        full: u16,
    },
    /// Floating-point numbers of 32 or 64 bits.
    Float { bits: u16 },
}

impl Coding {
    /// Returns the coding of samples in containers of so many bytes; `None` where it is not read.
    fn new(tag: u16, bits: u16, valid: u16, bytes: u16) -> Option<Self> {
        match (tag, bytes) {
            // One byte is unsigned and cannot be shifted about; fewer than 2 bits are no signal.
            (1, 1..=4) if valid == 8 * bytes || (bytes > 1 && valid >= 2) => Some(Self::Integer {
                bits: 8 * bytes,
                valid,
                full: 8 * bytes,
            }),
            (3, 4) if bits == 32 => Some(Self::Float { bits }),
            (3, 8) if bits == 64 => Some(Self::Float { bits }),
            _ => None,
        }
    }

    /// Bytes per sample.
    fn bytes(self) -> u64 {
        let (Self::Integer { bits, .. } | Self::Float { bits }) = self;
        u64::from(bits / 8)
    }

    /// Magnitude from which on a sample sits at the end of the integer range (full scale = 1).
    fn full_scale(self) -> Option<f64> {
        match self {
            // The largest positive integer is 2^(bits-1) - 1.
            Self::Integer { valid, .. } => Some(1.0 - 0.5_f64.powi(i32::from(valid) - 1)),
            Self::Float { .. } => None,
        }
    }
}

/// Names of the codings that occur in WAV files (mmreg.h).
const CODINGS: [(u16, &str); 12] = [
    (0x0001, "integer PCM"),
    (0x0002, "Microsoft ADPCM"),
    (0x0003, "IEEE float"),
    (0x0006, "A-law"),
    (0x0007, "mu-law"),
    (0x0011, "IMA ADPCM"),
    (0x0031, "GSM 6.10"),
    (0x0050, "MPEG"),
    (0x0055, "MP3"),
    (0x00ff, "AAC"),
    (0x0161, "Windows Media Audio"),
    (0xfffe, "extensible without a subformat"),
];
