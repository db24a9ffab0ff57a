//! Reading recordings: time series (WAV, CSV, universal files) and frequency response functions
//! (universal files, text) as physical quantities.
//!
//! [`Recording::open`] recognises the format by the first bytes, reads the file once in blocks,
//! checks it and gathers the health of every channel. The [`Recording`] is a handle: samples are
//! read from the file when they are asked for, so an hour of recording need not fit into memory.
//! Values are in file units (integer WAV: full scale = 1) times the channel's
//! [`scale`](ChannelInfo::scale).
//!
//! Important conventions: channel indices are 0-based and do not count a time column; the channel
//! numbers that users write and messages show are 1-based. Sample positions are 0-based.
//!
//! This stage knows nothing of taps, spectra or beams, and repairs no samples.

use schemars::JsonSchema;
use serde::Serialize;
use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

mod csv;
mod error;
mod health;
mod responses;
mod spacing;
mod text;
mod uff;
mod units;
mod warning;
mod wav;
mod write;

pub use error::{RecordingError, ResponseError, UffError, WavError};
pub use health::{ChannelHealth, Dropout, FlatTop};
pub use responses::{FrequencyResponse, FrequencyResponses, open_frequency_responses};
pub use text::Separator;
pub use uff::{
    Abscissa, Axis, Dataset, Function, FunctionType, FunctionValues, Ordinate, Point, Precision,
    UffCoding, UniversalFile, list_datasets, read_function,
};
pub use units::{ResponseForm, STANDARD_GRAVITY, channel_unit};
pub use warning::{ChannelLabel, RecordingWarning, ResponseWarning};
pub use write::{
    UffFormat, WavFormat, WavLayout, WavStream, encode_frequency_responses_uff, encode_wav,
    write_wav,
};

use csv::{CsvCursor, CsvSource};
use health::{HealthMeter, check_rate, check_samples};
use uff::{UffCursor, UffSource};
use wav::{WavCursor, WavSource};

/// More channels than this are taken for a damaged header; the largest front ends have hundreds.
const MAX_CHANNELS: usize = 4096;

/// Two sample rates nearer than this, relatively, are the same.
const SAME_RATE: f64 = 1e-3;

/// Relative difference to a header's factor below which a scale states the same unit: a rounded 9.81 is another.
const SAME_SCALE: f64 = 1e-6;

/// Facts about a file that the file itself may not contain.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ReadSettings {
    /// Sample rate (Hz) of a CSV file without a time column. A file's own rate wins, with a
    /// warning where they differ. Default: none, because a guessed rate scales every frequency.
    pub sample_rate: Option<f64>,
}

impl ReadSettings {
    /// Returns the doubt about a given sample rate where the file has another one (Hz), which is used.
    fn ignored_rate(&self, used: f64) -> Option<RecordingWarning> {
        let given = self.sample_rate?;
        let differs = (given - used).abs() > SAME_RATE * used;
        differs.then_some(RecordingWarning::SampleRateIgnored { given, used })
    }
}

/// Format of an opened recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// WAV with integer samples of so many valid bits; full scale = 1.
    WavInteger {
        /// Valid bits.
        bits: u16,
    },
    /// WAV with floating-point samples of so many bits.
    WavFloat {
        /// 32 or 64.
        bits: u16,
    },
    /// Text.
    Csv {
        /// Separator of the columns.
        separator: Separator,
        /// Decimal mark, `.` where no number shows one.
        decimal: char,
        /// Source of the sample rate.
        timed: Timing,
    },
    /// Universal file, datasets 58 or 58b.
    Uff58 {
        /// Text or binary, of the first channel.
        coding: UffCoding,
    },
    /// Frequency response functions, in text or a universal file.
    FrequencyResponses,
    /// Samples in memory.
    Memory,
}

/// Source of a text file's sample rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Timing {
    /// From its time column.
    TimeColumn,
    /// From the caller.
    Given,
}

/// Name, unit, scale and quality of one channel.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ChannelInfo {
    /// Name without the unit, where the file gives one.
    pub name: Option<String>,
    /// The unit that values have: SI where the header's unit is known, the header's text where it
    /// is not; null without a unit and after a scale was set.
    pub unit: Option<String>,
    /// The unit as the header has it.
    #[serde(skip)]
    pub header_unit: Option<String>,
    /// Factor on file units: the scale set, else the header unit's factor to SI, else 1.
    pub scale: f64,
    /// Quality of the samples, in the unit that values have.
    #[serde(flatten)]
    pub health: ChannelHealth,
}

/// A channel held in memory.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Channel {
    /// Its name.
    pub name: Option<String>,
    /// The unit of its samples.
    pub unit: Option<String>,
    /// The samples.
    pub samples: Vec<f64>,
}

/// Samples of some channels from one place of the recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// First sample (0-based).
    pub start: u64,
    /// Samples of the wanted channels, in the order asked for.
    pub samples: Vec<Vec<f64>>,
}

/// A recording: uniformly sampled channels, read from their file when asked for.
#[derive(Debug, Clone)]
pub struct Recording {
    name: String,
    path: Option<PathBuf>,
    format: Format,
    sample_rate: f64,
    frames: u64,
    channels: Vec<ChannelInfo>,
    warnings: Vec<RecordingWarning>,
    source: Source,
}

impl Recording {
    /// Opens a file: one pass checks every sample and gathers the channels' health.
    ///
    /// # Errors
    /// Files that cannot be read or understood: see [`RecordingError`]; merely poor data are
    /// [`warnings`](Self::warnings).
    pub fn open(path: &Path, settings: &ReadSettings) -> Result<Self, RecordingError> {
        let file = path.display().to_string();
        if let Some(value) = settings.sample_rate {
            check_rate(&file, value)?;
        }
        match recognise(path, &file)? {
            FileType::Wav => wav::open_wav(path, file, settings),
            FileType::Text => csv::open_csv(path, file, settings),
            FileType::Universal => uff::open_uff(path, file, settings),
        }
    }

    /// A recording in memory, for simulated signals and tests. `sample_rate` in Hz.
    ///
    /// # Errors
    /// No channels, no samples, unequal lengths, samples that are not finite, a sample rate that is
    /// not positive.
    pub fn from_samples(
        name: impl Into<String>,
        sample_rate: f64,
        channels: Vec<Channel>,
    ) -> Result<Self, RecordingError> {
        let name = name.into();
        check_rate(&name, sample_rate)?;
        let slices = channels.iter().map(|channel| channel.samples.as_slice());
        let frames = check_samples(&name, sample_rate, slices)? as u64;
        let mut infos = Vec::with_capacity(channels.len());
        let mut samples = Vec::with_capacity(channels.len());
        for channel in channels {
            let mut meter = HealthMeter::new(None);
            meter.add(&channel.samples);
            infos.push(ChannelInfo {
                name: channel.name,
                unit: channel.unit,
                header_unit: None,
                scale: 1.0,
                health: meter.finish(),
            });
            samples.push(channel.samples);
        }
        Ok(Self {
            name,
            path: None,
            format: Format::Memory,
            sample_rate,
            frames,
            channels: infos,
            warnings: Vec::new(),
            source: Source::Memory(Arc::new(samples)),
        })
    }

    /// The file as the caller named it, or the name of a recording in memory.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The file; `None` for a recording in memory.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Format of the file.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Samples per second (Hz).
    pub fn sample_rate(&self) -> f64 {
        self.sample_rate
    }

    /// Samples per channel.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Length (s): samples per channel over sample rate.
    pub fn duration(&self) -> f64 {
        self.frames as f64 / self.sample_rate
    }

    /// The channels, in the order of the file, without the time column.
    pub fn channels(&self) -> &[ChannelInfo] {
        &self.channels
    }

    /// Returns the recording under another name, such as that in a test description.
    pub fn renamed(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// Step between two neighbouring values of a channel (its unit): of integer samples the last bit,
    /// of others 0.
    pub fn quantum(&self, channel: usize) -> f64 {
        let scale = self
            .channels
            .get(channel)
            .map_or(0.0, |info| info.scale.abs());
        match self.format {
            Format::WavInteger { bits } => scale * 2f64.powi(1 - i32::from(bits)),
            Format::WavFloat { .. }
            | Format::Csv { .. }
            | Format::Uff58 { .. }
            | Format::FrequencyResponses
            | Format::Memory => 0.0,
        }
    }

    /// Mean of a channel (its unit): the offset that spectra leave out; 0 for an unknown channel.
    pub fn mean(&self, channel: usize) -> f64 {
        self.channels
            .get(channel)
            .map_or(0.0, |info| info.health.mean)
    }

    /// The doubts about this recording: of the file as a whole, then channel by channel.
    pub fn warnings(&self) -> Vec<RecordingWarning> {
        let mut warnings = self.warnings.clone();
        for (at, channel) in self.channels.iter().enumerate() {
            let label = channel_label(at, channel);
            warnings.extend(channel.health.warnings(&label, self.sample_rate));
        }
        warnings
    }

    /// Samples of one channel. The range is cut to the recording.
    ///
    /// # Errors
    /// An unknown channel; a file that can no longer be read.
    pub fn read(&self, channel: usize, range: Range<u64>) -> Result<Vec<f64>, RecordingError> {
        let mut samples = self.read_channels(&[channel], range)?;
        Ok(samples.pop().unwrap_or_default())
    }

    /// Samples of several channels from the same place, in the order asked for, read in one go.
    ///
    /// # Errors
    /// An unknown channel; a file that can no longer be read.
    pub fn read_channels(
        &self,
        channels: &[usize],
        range: Range<u64>,
    ) -> Result<Vec<Vec<f64>>, RecordingError> {
        self.check_channels(channels)?;
        let end = range.end.min(self.frames);
        let start = range.start.min(end);
        if start == end {
            return Ok(vec![Vec::new(); channels.len()]);
        }
        let samples = self.source.cursor(start)?.read(channels, end - start)?;
        Ok(self.scaled(channels, samples))
    }

    /// The whole recording in blocks of `block` samples (at least 1), the last one shorter. After
    /// an error the iteration ends.
    pub fn blocks(&self, channels: &[usize], block: usize) -> Blocks<'_> {
        Blocks {
            recording: self,
            channels: channels.to_vec(),
            block: block.max(1) as u64,
            at: 0,
            cursor: None,
        }
    }

    /// Sets what file units of a channel (0-based) are multiplied by: SI units per file unit,
    /// negative when the sensor was mounted the other way. It replaces the factor of a unit in the
    /// header, with a warning where it is another one but for the sign, volts apart, of which it says what they mean.
    ///
    /// # Errors
    /// An unknown channel; a scale that is 0 or not finite.
    pub fn set_scale(&mut self, channel: usize, scale: f64) -> Result<(), RecordingError> {
        self.check_channels(&[channel])?;
        if !scale.is_finite() || scale == 0.0 {
            return Err(RecordingError::BadScale {
                file: self.name.clone(),
                channel: channel + 1,
                value: scale,
            });
        }
        let Some(info) = self.channels.get_mut(channel) else {
            return Ok(());
        };
        self.warnings.retain(|warning| match warning {
            RecordingWarning::ScaleOverUnit { channel: label, .. }
            | RecordingWarning::UnknownUnit { channel: label, .. }
            | RecordingWarning::UnitsDisagree { channel: label, .. } => label.number != channel + 1,
            _ => true,
        });
        if let Some(unit) = &info.header_unit {
            let agrees = match channel_unit(unit) {
                // A scale says what a volt means, but not whether it is per volt or per millivolt.
                Some((factor, "V")) => factor == 1.0,
                Some((factor, _)) => (scale.abs() / factor - 1.0).abs() <= SAME_SCALE,
                None => false,
            };
            if !agrees {
                self.warnings.push(RecordingWarning::ScaleOverUnit {
                    channel: channel_label(channel, info),
                    scale,
                    unit: unit.clone(),
                });
            }
        }
        info.health = info.health.scaled(scale / info.scale);
        info.scale = scale;
        info.unit = None;
        Ok(())
    }

    /// [`set_scale`](Self::set_scale) by value.
    ///
    /// # Errors
    /// Those of [`set_scale`](Self::set_scale).
    pub fn with_scale(mut self, channel: usize, scale: f64) -> Result<Self, RecordingError> {
        self.set_scale(channel, scale)?;
        Ok(self)
    }

    fn check_channels(&self, channels: &[usize]) -> Result<(), RecordingError> {
        channels
            .iter()
            .try_for_each(|channel| self.channel_by_number(channel.saturating_add(1)).map(drop))
    }

    fn scaled(&self, channels: &[usize], mut samples: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        for (channel, samples) in channels.iter().zip(&mut samples) {
            let scale = self.channels.get(*channel).map_or(1.0, |info| info.scale);
            if scale != 1.0 {
                samples.iter_mut().for_each(|sample| *sample *= scale);
            }
        }
        samples
    }

    /// The index (0-based) of the channel with a 1-based number.
    ///
    /// # Errors
    /// No such channel; the message lists what exists.
    pub fn channel_by_number(&self, number: usize) -> Result<usize, RecordingError> {
        match number.checked_sub(1) {
            Some(index) if index < self.channels.len() => Ok(index),
            _ => Err(RecordingError::UnknownChannelNumber {
                file: self.name.clone(),
                number,
                existing: self.existing_channels(),
            }),
        }
    }

    /// The index (0-based) of the channel with a name, without or with its unit; upper and lower
    /// case count only where both occur.
    ///
    /// # Errors
    /// No channel or several channels of that name; the message lists what exists and the nearest.
    pub fn channel_by_name(&self, name: &str) -> Result<usize, RecordingError> {
        let wanted = name.trim();
        let without_unit = units::split_unit(wanted).0;
        let rules: [&dyn Fn(&str) -> bool; 4] = [
            &|name| name == wanted,
            &|name| name == without_unit,
            &|name| name.eq_ignore_ascii_case(wanted),
            &|name| units::split_unit(name).0.eq_ignore_ascii_case(without_unit),
        ];
        for rule in rules {
            let mut found = (0..self.channels.len())
                .filter(|index| self.channels[*index].name.as_deref().is_some_and(rule));
            if let Some(index) = found.next() {
                return match found.count() {
                    0 => Ok(index),
                    others => Err(RecordingError::AmbiguousChannelName {
                        file: self.name.clone(),
                        name: wanted.to_owned(),
                        count: others + 1,
                        existing: self.existing_channels(),
                    }),
                };
            }
        }
        Err(self.unknown_name(wanted))
    }

    /// The index (0-based) of the channel that a user means by a text: a name, else a number.
    ///
    /// # Errors
    /// Those of [`channel_by_name`](Self::channel_by_name) and
    /// [`channel_by_number`](Self::channel_by_number).
    pub fn channel_index(&self, text: &str) -> Result<usize, RecordingError> {
        match (self.channel_by_name(text), text.trim().parse()) {
            (Err(RecordingError::UnknownChannelName { .. }), Ok(number)) => {
                self.channel_by_number(number)
            }
            (by_name, _) => by_name,
        }
    }

    fn unknown_name(&self, wanted: &str) -> RecordingError {
        // Beyond this similarity (Jaro-Winkler, 1 = equal) a name is worth proposing.
        const NEAR: f64 = 0.7;
        let names = self.channels.iter().filter_map(|c| c.name.as_deref());
        let nearest = names
            .map(|name| {
                let (name_lower, wanted) = (name.to_lowercase(), wanted.to_lowercase());
                // "force" means "ch1_force_V", however long that is.
                let within = wanted.len() > 2 && name_lower.contains(&wanted);
                let similarity = strsim::jaro_winkler(&name_lower, &wanted);
                (similarity + f64::from(u8::from(within)), name)
            })
            .filter(|(similarity, _)| *similarity >= NEAR)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        RecordingError::UnknownChannelName {
            file: self.name.clone(),
            name: wanted.to_owned(),
            nearest: nearest.map_or(String::new(), |(_, name)| {
                format!("; did you mean \"{name}\"?")
            }),
            existing: self.existing_channels(),
        }
    }

    /// `1 ("force"), 2 ("response")`, for messages.
    fn existing_channels(&self) -> String {
        // More would hide the message.
        const SHOWN: usize = 12;
        let shown = self.channels.iter().enumerate().take(SHOWN);
        let mut shown: Vec<String> = shown
            .map(|(at, channel)| match &channel.name {
                Some(name) => format!("{} (\"{name}\")", at + 1),
                None => (at + 1).to_string(),
            })
            .collect();
        if self.channels.len() > SHOWN {
            shown.push(format!("... {}", self.channels.len()));
        }
        shown.join(", ")
    }
}

fn channel_label(at: usize, channel: &ChannelInfo) -> ChannelLabel {
    ChannelLabel {
        number: at + 1,
        name: channel.name.clone(),
    }
}

/// The blocks of a recording, see [`Recording::blocks`].
#[derive(Debug)]
pub struct Blocks<'a> {
    recording: &'a Recording,
    channels: Vec<usize>,
    block: u64,
    at: u64,
    cursor: Option<Cursor<'a>>,
}

impl Blocks<'_> {
    fn next_block(&mut self) -> Result<Block, RecordingError> {
        let recording = self.recording;
        let cursor = match &mut self.cursor {
            Some(cursor) => cursor,
            none => {
                recording.check_channels(&self.channels)?;
                none.insert(recording.source.cursor(self.at)?)
            }
        };
        let start = self.at;
        let frames = self.block.min(recording.frames - start);
        let samples = cursor.read(&self.channels, frames)?;
        self.at += frames;
        Ok(Block {
            start,
            samples: recording.scaled(&self.channels, samples),
        })
    }
}

impl Iterator for Blocks<'_> {
    type Item = Result<Block, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.at >= self.recording.frames {
            return None;
        }
        let block = self.next_block();
        if block.is_err() {
            self.at = self.recording.frames;
        }
        Some(block)
    }
}

/// Place of the samples of a recording.
#[derive(Debug, Clone)]
enum Source {
    Wav(Box<WavSource>),
    Csv(Box<CsvSource>),
    Uff(Box<UffSource>),
    Memory(Arc<Vec<Vec<f64>>>),
}

impl Source {
    /// Positions a reader at `frame`.
    fn cursor(&self, frame: u64) -> Result<Cursor<'_>, RecordingError> {
        Ok(match self {
            Self::Wav(source) => Cursor::Wav(source.cursor(frame)?),
            Self::Csv(source) => Cursor::Csv(source.cursor(frame)?),
            Self::Uff(source) => Cursor::Uff(source.cursor(frame)),
            Self::Memory(channels) => Cursor::Memory(MemoryCursor {
                channels,
                at: usize::try_from(frame).unwrap_or(usize::MAX),
            }),
        })
    }
}

/// A reader somewhere in the samples; one per pass, since it moves.
#[derive(Debug)]
enum Cursor<'a> {
    Wav(WavCursor<'a>),
    Csv(CsvCursor<'a>),
    Uff(UffCursor<'a>),
    Memory(MemoryCursor<'a>),
}

impl Cursor<'_> {
    /// Up to `limit` samples of the wanted channels, in file units; fewer only at the end.
    fn read(&mut self, channels: &[usize], limit: u64) -> Result<Vec<Vec<f64>>, RecordingError> {
        let mut samples = vec![Vec::new(); channels.len()];
        match self {
            Self::Wav(cursor) => cursor.read(channels, limit, &mut samples)?,
            Self::Csv(cursor) => cursor.read(channels, limit, &mut samples)?,
            Self::Uff(cursor) => cursor.read(channels, limit, &mut samples)?,
            Self::Memory(cursor) => cursor.read(channels, limit, &mut samples),
        }
        Ok(samples)
    }
}

/// A place in samples held in memory.
#[derive(Debug)]
struct MemoryCursor<'a> {
    channels: &'a [Vec<f64>],
    at: usize,
}

impl MemoryCursor<'_> {
    fn read(&mut self, channels: &[usize], limit: u64, into: &mut [Vec<f64>]) {
        let limit = usize::try_from(limit).unwrap_or(usize::MAX);
        let frames = self.channels.first().map_or(0, Vec::len);
        let end = self.at.saturating_add(limit).min(frames);
        for (channel, samples) in channels.iter().zip(into.iter_mut()) {
            let all = self.channels.get(*channel);
            let part = all.and_then(|all| all.get(self.at.min(end)..end));
            samples.extend_from_slice(part.unwrap_or_default());
        }
        self.at = end;
    }
}

// ---- Formats are told apart by the first bytes of a file, never by its name.

/// Formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FileType {
    Wav,
    Text,
    Universal,
}

/// First bytes, where they stand, and what they mean. Known so that the message can name them.
const UNREAD: &[(usize, &[u8], &str)] = &[
    (0, b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
    (512, b"\x89HDF\r\n\x1a\n", "a MATLAB 7.3 (HDF5) file"),
    (0, b"MATLAB 5.0", "a MATLAB file"),
    (0, b"MATLAB 7.3", "a MATLAB 7.3 (HDF5) file"),
    (0, b"fLaC", "FLAC audio"),
    (0, b"OggS", "Ogg audio"),
    (0, b"ID3", "MP3 audio"),
    (0, b"\xff\xfb", "MP3 audio"),
    (0, b"\xff\xf3", "MP3 audio"),
    (0, b"\xff\xf2", "MP3 audio"),
    (4, b"ftyp", "MPEG-4 audio"),
    (0, b"riff\x2e\x91\xcf\x11", "Wave64 (W64) audio"),
    (0, b"RIFX", "big-endian WAV (RIFX)"),
    (0, b"FORM", "AIFF audio"),
    (0, b"caff", "Core Audio (CAF)"),
    (0, b".snd", "Sun/NeXT audio (AU)"),
    (0, b"wvpk", "WavPack audio"),
    (0, b"TDSm", "a LabVIEW TDMS file"),
    (0, b"PK\x03\x04", "a zip archive or Excel workbook"),
    (0, b"\xd0\xcf\x11\xe0", "an old Excel workbook"),
    (0, b"\x1f\x8b", "a gzip archive"),
    (0, b"%PDF", "a PDF document"),
    (0, b"PAR1", "a Parquet file"),
    (0, b"RIFF", "a RIFF file without WAVE data"),
    (0, b"RF64", "a RIFF file without WAVE data"),
    (0, b"BW64", "a RIFF file without WAVE data"),
];

/// Number of bytes that decide.
const DECIDING_BYTES: usize = 4096;

/// Recognises the format of the file at `path`.
fn recognise(path: &Path, file: &str) -> Result<FileType, RecordingError> {
    let head = read_head(path, file, DECIDING_BYTES)?;
    if head.is_empty() {
        return Err(RecordingError::EmptyFile {
            file: file.to_owned(),
        });
    }
    // The mark that begins such text in either order of bytes.
    if head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff") {
        return Err(RecordingError::Utf16 {
            file: file.to_owned(),
        });
    }
    let riff = [b"RIFF", b"RF64", b"BW64"]
        .iter()
        .any(|mark| head.starts_with(*mark));
    if riff && stands_at(&head, 8, b"WAVE") {
        return Ok(FileType::Wav);
    }
    let mut unread = UNREAD.iter();
    if let Some((.., format)) = unread.find(|(at, bytes, _)| stands_at(&head, *at, bytes)) {
        return Err(RecordingError::UnsupportedFormat {
            file: file.to_owned(),
            format,
        });
    }
    if begins_with_mark(&head) {
        return Ok(FileType::Universal);
    }
    // Text has no control characters but tabs, line ends and form feeds; latin-1 letters may occur.
    if head
        .iter()
        .all(|byte| matches!(byte, b'\t' | b'\n' | b'\r' | 0x0c | 0x1a | 0x20..))
    {
        return Ok(FileType::Text);
    }
    let first_bytes: Vec<String> = head.iter().take(8).map(|b| format!("{b:02x}")).collect();
    Err(RecordingError::UnknownFormat {
        file: file.to_owned(),
        first_bytes: first_bytes.join(" "),
    })
}

fn stands_at(head: &[u8], at: usize, bytes: &[u8]) -> bool {
    head.get(at..).is_some_and(|rest| rest.starts_with(bytes))
}

/// Returns `true` for a universal file, by its first bytes.
///
/// # Errors
/// A file that cannot be read.
pub fn is_universal_file(path: &Path) -> Result<bool, RecordingError> {
    let head = read_head(path, &path.display().to_string(), DECIDING_BYTES)?;
    Ok(begins_with_mark(&head))
}

/// Returns `true` where the first line that is not empty has -1 in columns 5 and 6, the mark of universal files.
fn begins_with_mark(head: &[u8]) -> bool {
    let mut lines = head
        .split(|byte| *byte == b'\n')
        .map(<[u8]>::trim_ascii_end);
    lines.find(|line| !line.is_empty()) == Some(b"    -1")
}

/// Reads the first `limit` bytes of a file, or as many as there are.
fn read_head(path: &Path, file: &str, limit: usize) -> Result<Vec<u8>, RecordingError> {
    let mut head = vec![0_u8; limit];
    let got = File::open(path)
        .and_then(|mut opened| read_fully(&mut opened, &mut head))
        .map_err(|source| unreadable(file, source))?;
    head.truncate(got);
    Ok(head)
}

/// Fills `into` as far as the reader goes, and returns how many bytes it read.
fn read_fully(reader: &mut impl Read, into: &mut [u8]) -> io::Result<usize> {
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

/// Returns the error of a file that the operating system does not give.
fn unreadable(file: &str, source: io::Error) -> RecordingError {
    RecordingError::Unreadable {
        file: file.to_owned(),
        source,
    }
}
