//! FLAC files: the header, where every frame begins, and the samples as numbers (full scale = 1).
//!
//! The crate claxon decodes the frames and checks their checksums. Opening a file decodes all of it once and remembers
//! the place of each frame, so that reading may begin anywhere and memory holds one frame at a time.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use claxon::frame::{Block, FrameReader};
use claxon::input::ReadBytes;

use super::error::{RecordingError, RecordingWarning, short, unreadable};
use super::health::{HealthMeter, check_rate};
use super::kept::KeptSamples;
use super::{ChannelInfo, Cursor, Format, ReadSettings, Recording, Source, read_fully};

/// Bytes of the block of metadata that states rate, channels and bits.
const STREAM_INFO: usize = 34;
/// Types of blocks of metadata: the stream's, and the one that is not allowed.
const STREAM_INFO_TYPE: u8 = 0;
const FORBIDDEN_TYPE: u8 = 127;
/// Bits of a sample that are decoded.
const MOST_BITS: u32 = 24;
/// More samples than this, over all channels, are taken for a damaged file: half a day of eight channels at 20 kHz.
/// Silence takes so little room that the size of the file bounds nothing.
const MOST_SAMPLES: u64 = 1 << 33;
/// What helps against a damaged file.
const REMEDY: &str = "the file is damaged; `flac -t` tests it: copy or export it again";

/// Opens a FLAC file as a recording.
pub(super) fn open_flac(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<Recording, RecordingError> {
    let opened = File::open(path).map_err(|source| unreadable(&file, source))?;
    let mut bytes = Bytes {
        reader: BufReader::new(opened),
        at: 0,
    };
    let info = StreamInfo::read(&mut bytes, &file)?;
    let sample_rate = f64::from(info.sample_rate);
    check_rate(&file, sample_rate)?;
    let mut source = FlacSource {
        path: path.to_owned(),
        file,
        info,
        places: Vec::new(),
        frames: 0,
    };
    // The positive end of the format; the negative one lies a step farther.
    let full_scale = 1.0 - info.step();
    let mut meters = vec![HealthMeter::new(Some(full_scale)); info.channels];
    let mut kept = KeptSamples::new(info.channels);
    let mut buffer = Vec::new();
    let mut samples = Vec::new();
    let mut cut = false;
    loop {
        let place = (source.frames, bytes.at);
        let block = match source.decode(&mut bytes, source.frames, buffer) {
            Ok(Some(block)) => block,
            // Between two frames nothing was read; within one the file was cut.
            Ok(None) => {
                cut = bytes.at > place.1;
                break;
            }
            // Other data, such as tags, may follow the promised samples.
            Err(_) if info.promised > 0 && source.frames >= info.promised => break,
            Err(problem) => return Err(problem),
        };
        for (channel, meter) in meters.iter_mut().enumerate() {
            samples.clear();
            samples.extend(block.channel(channel as u32).iter().map(|x| info.value(*x)));
            meter.add(&samples);
            kept.add(channel, &samples);
        }
        source.places.push(place);
        source.frames += u64::from(block.duration());
        if source.frames * info.channels as u64 > MOST_SAMPLES {
            let problem = format!(
                "more than {MOST_SAMPLES} samples; cut the recording into several files, or is it damaged?"
            );
            return Err(RecordingError::new(&source.file, problem));
        }
        buffer = block.into_buffer();
    }
    if source.frames == 0 {
        return Err(RecordingError::no_samples(&source.file));
    }
    let mut warnings = Vec::new();
    warnings.extend(settings.ignored_rate(sample_rate));
    warnings.extend(RecordingWarning::truncated(source.frames, info.promised));
    if cut && info.promised == 0 {
        warnings.push(RecordingWarning::ends_within_frame(source.frames));
    }
    if info.promised > 0 && source.frames > info.promised {
        warnings.push(RecordingWarning::more_than_promised(
            source.frames,
            info.promised,
        ));
    }
    let meters = meters.into_iter();
    Ok(Recording {
        name: source.file.clone(),
        format: Format::Flac { bits: info.bits },
        sample_rate,
        frames: source.frames,
        channels: meters
            .map(|meter| ChannelInfo::unscaled(None, None, meter))
            .collect(),
        warnings,
        source: kept.or_file(source),
        parts: Vec::new(),
    })
}

/// What the header states.
#[derive(Debug, Clone, Copy)]
struct StreamInfo {
    sample_rate: u32,
    channels: usize,
    /// Bits of a sample.
    bits: u16,
    /// Samples per channel; 0 where the writer did not know.
    promised: u64,
}

impl StreamInfo {
    /// Reads the metadata, up to the first frame.
    fn read(bytes: &mut Bytes, file: &str) -> Result<Self, RecordingError> {
        let damaged = |problem: String| RecordingError::new(file, format!("{problem}; {REMEDY}"));
        // "fLaC" was seen before.
        bytes.seek(4).map_err(|source| unreadable(file, source))?;
        let mut info = None;
        loop {
            let mut header = [0_u8; 4];
            bytes.fill(&mut header, file)?;
            let [first, rest @ ..] = header;
            let length = rest
                .iter()
                .fold(0, |length, byte| length << 8 | u64::from(*byte));
            let kind = first & 0x7f;
            let problem = match (kind, info) {
                (STREAM_INFO_TYPE, None) if length == STREAM_INFO as u64 => {
                    let mut content = [0_u8; STREAM_INFO];
                    bytes.fill(&mut content, file)?;
                    info = Some(Self::parse(&content, file)?);
                    None
                }
                (STREAM_INFO_TYPE, None) => Some(format!(
                    "its first block of metadata has {length} bytes where {STREAM_INFO} are right"
                )),
                (_, None) => Some("its metadata do not begin with the stream's".to_owned()),
                (STREAM_INFO_TYPE | FORBIDDEN_TYPE, _) => {
                    Some(format!("a block of metadata has the type {kind}"))
                }
                _ => {
                    let next = bytes.at + length;
                    bytes
                        .seek(next)
                        .map_err(|source| unreadable(file, source))?;
                    None
                }
            };
            if let Some(problem) = problem {
                return Err(damaged(problem));
            }
            if let (true, Some(info)) = (first & 0x80 != 0, info) {
                return Ok(info);
            }
        }
    }

    /// The stream's block: sizes of blocks and frames (10 bytes), then 20 bits of rate, 3 of channels less 1, 5 of bits
    /// less 1, and 36 of samples.
    fn parse(content: &[u8; STREAM_INFO], file: &str) -> Result<Self, RecordingError> {
        let packed = content[10..18]
            .iter()
            .fold(0_u64, |packed, byte| packed << 8 | u64::from(*byte));
        let bits = (packed >> 36 & 0x1f) as u32 + 1;
        if !(4..=MOST_BITS).contains(&bits) {
            let problem = format!(
                "{bits} bits a sample; 4 to {MOST_BITS} are read; `flac -d` converts it to WAV, which is read with all its bits"
            );
            return Err(RecordingError::new(file, problem));
        }
        Ok(Self {
            sample_rate: (packed >> 44) as u32,
            channels: (packed >> 41 & 0x7) as usize + 1,
            bits: bits as u16,
            promised: packed & 0xf_ffff_ffff,
        })
    }

    /// A step of the samples where full scale is 1.
    fn step(self) -> f64 {
        2f64.powi(1 - i32::from(self.bits))
    }

    /// A sample where full scale is 1.
    fn value(self, sample: i32) -> f64 {
        f64::from(sample) * self.step()
    }
}

/// A FLAC file of which every frame was decoded once.
#[derive(Debug)]
struct FlacSource {
    path: PathBuf,
    file: String,
    info: StreamInfo,
    /// First sample and first byte of each frame.
    places: Vec<(u64, u64)>,
    /// Samples per channel.
    frames: u64,
}

impl FlacSource {
    /// Decodes the frame that begins with this sample; `None` at the end of the file, also within a frame. `buffer` is
    /// used again.
    fn decode(
        &self,
        bytes: &mut Bytes,
        first: u64,
        buffer: Vec<i32>,
    ) -> Result<Option<Block>, RecordingError> {
        let start = bytes.at;
        let damaged = |problem: &str| {
            let seconds = short(first as f64 / f64::from(self.info.sample_rate));
            let text = format!(
                "{problem}, in the frame at byte {start} (from sample {first}, {seconds} s); {REMEDY}"
            );
            RecordingError::new(&self.file, text)
        };
        let block = match FrameReader::new(bytes).read_next_or_eof(buffer) {
            Ok(Some(block)) => block,
            Ok(None) => return Ok(None),
            Err(claxon::Error::IoError(error)) if error.kind() == io::ErrorKind::UnexpectedEof => {
                return Ok(None);
            }
            Err(claxon::Error::IoError(error)) => return Err(unreadable(&self.file, error)),
            Err(claxon::Error::FormatError(problem) | claxon::Error::Unsupported(problem)) => {
                return Err(damaged(problem));
            }
        };
        // A frame has the number of its first sample, or its own where all but the last are equally long.
        let duration = u64::from(block.duration());
        let number = self.places.partition_point(|(before, _)| *before < first) as u64;
        if block.time() != first && block.time() != number * duration {
            return Err(damaged(
                "frames are missing before the next one, or stand in another order",
            ));
        }
        let channels = self.info.channels;
        if block.channels() as usize != channels {
            let found = block.channels();
            return Err(damaged(&format!(
                "{found} channels where the header has {channels}"
            )));
        }
        let most = 1_i64 << (self.info.bits - 1);
        let allowed = -most..most;
        for channel in 0..block.channels() {
            let samples = block.channel(channel).iter().map(|x| i64::from(*x));
            if let Some(beyond) = samples.into_iter().find(|x| !allowed.contains(x)) {
                let bits = self.info.bits;
                return Err(damaged(&format!(
                    "a sample of {beyond} where {bits} bits are stated"
                )));
            }
        }
        Ok(Some(block))
    }
}

impl Source for FlacSource {
    fn cursor(&self, frame: u64) -> Result<Box<dyn Cursor + '_>, RecordingError> {
        let next = self.places.partition_point(|(first, _)| *first <= frame);
        let place = next.checked_sub(1).and_then(|place| self.places.get(place));
        let (first, byte) = place.copied().unwrap_or_default();
        let opened = File::open(&self.path).map_err(|source| unreadable(&self.file, source))?;
        let mut bytes = Bytes {
            reader: BufReader::new(opened),
            at: 0,
        };
        let sought = bytes.seek(byte);
        sought.map_err(|source| unreadable(&self.file, source))?;
        Ok(Box::new(FlacCursor {
            source: self,
            bytes,
            next: first,
            block: None,
            used: 0,
            skip: frame.saturating_sub(first),
        }))
    }
}

/// A reader somewhere in a FLAC file.
struct FlacCursor<'a> {
    source: &'a FlacSource,
    bytes: Bytes,
    /// First sample of the next frame.
    next: u64,
    /// The frame that is being read.
    block: Option<Block>,
    /// Samples of it that were read.
    used: usize,
    /// Samples of the next frame that are left out.
    skip: u64,
}

impl std::fmt::Debug for FlacCursor<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FlacCursor")
            .field("next", &self.next)
            .finish_non_exhaustive()
    }
}

impl Cursor for FlacCursor<'_> {
    fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
        into: &mut [Vec<f64>],
    ) -> Result<(), RecordingError> {
        let source = self.source;
        let mut wanted = limit;
        while wanted > 0 {
            let length = self
                .block
                .as_ref()
                .map_or(0, |block| block.duration() as usize);
            if self.used >= length {
                if self.next >= source.frames {
                    break;
                }
                let buffer = self.block.take().map_or_else(Vec::new, Block::into_buffer);
                let decoded = source.decode(&mut self.bytes, self.next, buffer)?;
                let Some(block) = decoded else {
                    return Err(RecordingError::changed(&source.file, self.next));
                };
                self.next += u64::from(block.duration());
                self.used = self.skip as usize;
                self.skip = 0;
                self.block = Some(block);
                continue;
            }
            let Some(block) = &self.block else { break };
            let end = length.min(self.used.saturating_add(wanted as usize));
            for (channel, samples) in channels.iter().zip(into.iter_mut()) {
                let own = &block.channel(*channel as u32)[self.used..end];
                samples.extend(own.iter().map(|x| source.info.value(*x)));
            }
            wanted -= (end - self.used) as u64;
            self.used = end;
        }
        Ok(())
    }
}

/// Bytes of a file, counted, for the decoder.
struct Bytes {
    reader: BufReader<File>,
    /// Bytes before the next one.
    at: u64,
}

impl Bytes {
    fn seek(&mut self, to: u64) -> io::Result<()> {
        self.reader.seek(SeekFrom::Start(to))?;
        self.at = to;
        Ok(())
    }

    /// Reads metadata, all of it.
    fn fill(&mut self, into: &mut [u8], file: &str) -> Result<(), RecordingError> {
        let got = read_fully(&mut self.reader, into);
        let got = got.map_err(|source| unreadable(file, source))?;
        self.at += got as u64;
        match got == into.len() {
            true => Ok(()),
            false => Err(RecordingError::new(
                file,
                format!("ends at byte {} within its metadata; {REMEDY}", self.at),
            )),
        }
    }
}

impl ReadBytes for Bytes {
    fn read_u8(&mut self) -> io::Result<u8> {
        let byte = self.read_u8_or_eof()?;
        byte.ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
    }

    fn read_u8_or_eof(&mut self) -> io::Result<Option<u8>> {
        let mut byte = [0];
        let got = read_fully(&mut self.reader, &mut byte)?;
        self.at += got as u64;
        Ok((got == 1).then_some(byte[0]))
    }

    fn read_into(&mut self, buffer: &mut [u8]) -> io::Result<()> {
        self.reader.read_exact(buffer)?;
        self.at += buffer.len() as u64;
        Ok(())
    }

    fn skip(&mut self, amount: u32) -> io::Result<()> {
        self.reader.seek_relative(i64::from(amount))?;
        self.at += u64::from(amount);
        Ok(())
    }
}
