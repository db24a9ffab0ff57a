//! Reading recordings: time series (WAV, FLAC, CSV, universal files) and frequency response functions
//! (universal files, text) as physical quantities.
//!
//! [`Recording::open`] recognises the format by the first bytes, reads the file once in blocks,
//! checks it and gathers the health of every channel. The [`Recording`] is a handle: samples are
//! read from the file when they are asked for, so an hour of recording need not fit into memory.
//! Values are in file units (integer WAV and FLAC: full scale = 1) times the channel's
//! [`scale`](ChannelInfo::scale).
//!
//! Important conventions: channel indices are 0-based and do not count a time column; the channel
//! numbers that users write and messages show are 1-based. Sample positions are 0-based.
//!
//! This stage knows nothing of taps, spectra or beams, and repairs no samples.

use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

mod csv;
mod error;
mod flac;
mod function_text;
mod growing;
mod health;
mod joined;
mod kept;
mod lvm;
mod mat;
mod outline;
mod pcm;
mod resample;
mod response_files;
mod responses;
#[cfg(test)]
mod sweeps;
mod text;
mod uff;
mod units;
mod wav;
mod write;

pub use error::{MAX_CHANNELS, RecordingError, RecordingWarning};
pub use growing::GrowingRecording;
pub use health::{ChannelHealth, EqualRun};
pub use joined::MOST_FILES;
pub use mat::{VariableRole, Variables};
pub use outline::{Extremes, Outline};
pub use pcm::{PcmHead, PcmLayout, SampleForm};
pub use response_files::open_frequency_responses;
pub use responses::{FrequencyResponse, FrequencyResponses, ValueColumns};
pub use text::Separator;
pub use uff::{
    Abscissa, Axis, Dataset, Function, FunctionType, FunctionValues, ModeShapes, NoLine, NodalMode,
    Node, NodeLine, Ordinate, PlacedNode, Point, Precision, ShapeAtNode, UffCoding, UniversalFile,
    list_datasets, read_function, read_mode_shapes,
};
pub use units::{ResponseForm, TIME_UNITS, channel_unit};
pub use write::{
    UffFormat, WavFormat, WavLayout, WavStream, encode_frequency_responses_uff,
    encode_mode_shapes_uff, encode_nodes_uff, encode_wav, write_wav,
};

use error::unreadable;
use health::{HealthMeter, check_rate, check_samples};

/// Two sample rates nearer than this, relatively, are the same.
const SAME_RATE: f64 = 1e-3;

/// Relative difference to a header's factor below which a scale states the same unit: a rounded 9.81 is another.
const SAME_SCALE: f64 = 1e-6;

/// Facts about a file that the file itself may not contain.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadSettings {
    /// Sample rate (Hz) of a CSV file without a time column. A file's own rate wins, with a
    /// warning where they differ. Default: none, because a guessed rate scales every frequency.
    pub sample_rate: Option<f64>,
    /// What a unit of a CSV file's time column is (s), where its heading does not say so. Default: 1 s.
    pub time_unit: Option<f64>,
    /// Columns of a text file of functions. Default: by headings and numbers.
    pub values: Option<ValueColumns>,
    /// Variables of a MATLAB file. Without them opening it is an error that lists what there is.
    pub variables: Variables,
    /// Frames of a WAV file that are read, so that one that goes on growing has an end. Default: all.
    pub frames: Option<u64>,
}

impl ReadSettings {
    /// Returns the doubt about a given sample rate where the file has another one (Hz), which is used.
    fn ignored_rate(&self, used: f64) -> Option<RecordingWarning> {
        let given = self.sample_rate?;
        let differs = (given - used).abs() > SAME_RATE * used;
        differs.then(|| {
            let message = format!(
                "the sample rate given ({given} Hz) differs from the file's own ({used} Hz), which is used; drop the one given or correct the file"
            );
            RecordingWarning::new("sample-rate-ignored", message)
        })
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
    /// FLAC with integer samples of so many bits; full scale = 1.
    Flac {
        /// Bits.
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
    /// Text by LabVIEW (.lvm).
    Lvm,
    /// MATLAB file of level 5.
    Mat,
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

impl fmt::Display for Format {
    /// Writes "WAV, 24-bit integer", "CSV, semicolon, decimal comma".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::WavInteger { bits } => write!(f, "WAV, {bits}-bit integer"),
            Self::Flac { bits } => write!(f, "FLAC, {bits}-bit integer"),
            Self::WavFloat { bits } => write!(f, "WAV, {bits}-bit float"),
            Self::Csv {
                separator, decimal, ..
            } => {
                let separator = match separator {
                    Separator::Tab => "tab",
                    Separator::Semicolon => "semicolon",
                    Separator::Comma => "comma",
                    Separator::Blanks => "blanks",
                };
                let decimal = match decimal {
                    ',' => ", decimal comma",
                    _ => "",
                };
                write!(f, "CSV, {separator}{decimal}")
            }
            Self::Uff58 {
                coding: UffCoding::Ascii,
            } => f.write_str("UFF 58, text"),
            Self::Uff58 { .. } => f.write_str("UFF 58b, binary"),
            Self::Lvm => f.write_str("LabVIEW text"),
            Self::Mat => f.write_str("MATLAB 5"),
            Self::FrequencyResponses => f.write_str("frequency response functions"),
            Self::Memory => f.write_str("samples in memory"),
        }
    }
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

impl ChannelInfo {
    /// Channel `number` (1-based) with what a header says about it. Values are in SI where the header's unit is known;
    /// `warnings` takes the doubt where it is not.
    fn with_header(
        number: usize,
        header: csv::Column,
        meter: HealthMeter,
        warnings: &mut Vec<RecordingWarning>,
    ) -> Self {
        let known = header.unit.as_deref().and_then(channel_unit);
        if let (Some(unit), None) = (&header.unit, known) {
            let name = header.name.as_deref();
            warnings.push(RecordingWarning::unknown_unit(number, name, unit));
        }
        let scale = known.map_or(1.0, |(factor, _)| factor);
        Self {
            name: header.name,
            unit: known.map_or_else(|| header.unit.clone(), |(_, si)| Some(si.to_owned())),
            header_unit: header.unit,
            scale,
            health: meter.finish().scaled(scale),
        }
    }

    /// A channel whose file units are its values.
    fn unscaled(name: Option<String>, unit: Option<String>, meter: HealthMeter) -> Self {
        Self {
            name,
            unit,
            header_unit: None,
            scale: 1.0,
            health: meter.finish(),
        }
    }
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
    format: Format,
    sample_rate: f64,
    frames: u64,
    channels: Vec<ChannelInfo>,
    warnings: Vec<RecordingWarning>,
    source: Arc<dyn Source>,
    /// The files of a joined recording, in their order.
    parts: Vec<Recording>,
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
        refuse_pipe(path, &file)?;
        match recognise(path, &file)? {
            FileType::Wav => wav::open_wav(path, file, settings),
            FileType::Flac => flac::open_flac(path, file, settings),
            FileType::Text => csv::open_csv(path, file, settings),
            FileType::Lvm => lvm::open_lvm(path, file, settings),
            FileType::Mat => mat::open_mat(path, file, settings),
            FileType::Universal => uff::open_uff(path, file, settings),
        }
    }

    /// A recording in memory, for simulated signals and tests. `sample_rate` in Hz.
    ///
    /// # Errors
    /// No channels, no samples, unequal lengths, samples that are not finite, a sample rate outside
    /// 0.001 to 1e9 Hz.
    pub fn from_samples(
        name: impl Into<String>,
        sample_rate: f64,
        channels: Vec<Channel>,
    ) -> Result<Self, RecordingError> {
        let name = name.into();
        check_rate(&name, sample_rate)?;
        let slices = channels.iter().map(|channel| channel.samples.as_slice());
        let frames = check_samples(&name, sample_rate, slices)? as u64;
        let channels = channels.into_iter().map(|channel| {
            let mut meter = HealthMeter::new(None);
            meter.add(&channel.samples);
            let info = ChannelInfo::unscaled(channel.name, channel.unit, meter);
            (info, channel.samples)
        });
        let (channels, samples): (_, Vec<Vec<f64>>) = channels.unzip();
        Ok(Self {
            name,
            format: Format::Memory,
            sample_rate,
            frames,
            channels,
            warnings: Vec::new(),
            source: Arc::new(samples),
            parts: Vec::new(),
        })
    }

    /// A file whose samples are all in memory, each channel with what a header says about it.
    fn in_memory(
        name: String,
        format: Format,
        sample_rate: f64,
        columns: Vec<(csv::Column, Vec<f64>)>,
        mut warnings: Vec<RecordingWarning>,
    ) -> Result<Self, RecordingError> {
        check_rate(&name, sample_rate)?;
        let slices = columns.iter().map(|(_, samples)| samples.as_slice());
        let frames = check_samples(&name, sample_rate, slices)? as u64;
        let (mut channels, mut all) = (Vec::new(), Vec::new());
        for (number, (header, samples)) in (1..).zip(columns) {
            let mut meter = HealthMeter::new(None);
            meter.add(&samples);
            channels.push(ChannelInfo::with_header(
                number,
                header,
                meter,
                &mut warnings,
            ));
            all.push(samples);
        }
        Ok(Self {
            name,
            format,
            sample_rate,
            frames,
            channels,
            warnings,
            source: Arc::new(all),
            parts: Vec::new(),
        })
    }

    /// The file as the caller named it, or the name of a recording in memory.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the recording with names, units and scales of the channels of another one with as many channels: its samples
    /// are the same in file units.
    pub fn with_headers_of(mut self, other: &Recording) -> Self {
        for (own, other) in self.channels.iter_mut().zip(&other.channels) {
            own.name.clone_from(&other.name);
            own.unit.clone_from(&other.unit);
            own.header_unit.clone_from(&other.header_unit);
            own.health = own.health.scaled(other.scale / own.scale);
            own.scale = other.scale;
        }
        self
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
        match (self.format, self.channels.get(channel)) {
            (Format::WavInteger { bits } | Format::Flac { bits }, Some(info)) => {
                info.scale.abs() * 2f64.powi(1 - i32::from(bits))
            }
            _ => 0.0,
        }
    }

    /// Mean of a channel (its unit): the offset that spectra leave out; 0 for an unknown channel.
    pub fn mean(&self, channel: usize) -> f64 {
        self.channels
            .get(channel)
            .map_or(0.0, |info| info.health.mean)
    }

    /// Extremes of a channel piece by piece (its unit); `None` for a joined or an unknown channel.
    pub fn outline(&self, channel: usize) -> Option<Outline> {
        let info = self.channels.get(channel)?;
        let outline = &info.health.outline;
        (!outline.pieces.is_empty()).then(|| outline.scaled(info.scale))
    }

    /// The doubts about this recording: of the file as a whole, then channel by channel. Those about a joined recording
    /// are those of its [`parts`](Self::parts).
    pub fn warnings(&self) -> Vec<RecordingWarning> {
        let mut warnings = self.warnings.clone();
        for (at, channel) in self.channels.iter().enumerate() {
            let name = channel.name.as_deref();
            for (code, problem) in channel.health.doubts(self.sample_rate) {
                warnings.push(RecordingWarning::of_channel(code, at + 1, name, problem));
            }
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
        let mut samples = vec![Vec::new(); channels.len()];
        self.read_into(channels, range, &mut samples)?;
        Ok(samples)
    }

    /// [`read_channels`](Self::read_channels) into `samples`, one vector for each channel, whose room is used again.
    ///
    /// # Errors
    /// Those of [`read_channels`](Self::read_channels).
    pub fn read_into(
        &self,
        channels: &[usize],
        range: Range<u64>,
        samples: &mut [Vec<f64>],
    ) -> Result<(), RecordingError> {
        self.check_channels(channels)?;
        let end = range.end.min(self.frames);
        let start = range.start.min(end);
        samples.iter_mut().for_each(Vec::clear);
        if start < end {
            let mut cursor = self.source.cursor(start)?;
            cursor.read(channels, end - start, samples)?;
        }
        self.scale(channels, samples);
        Ok(())
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
    /// header. A warning follows where the two differ in magnitude, and beside an unknown unit. Beside the unit V
    /// there is none: the scale then states the sensor's sensitivity.
    ///
    /// # Errors
    /// An unknown channel; a scale that is 0 or not finite.
    pub fn set_scale(&mut self, channel: usize, scale: f64) -> Result<(), RecordingError> {
        self.check_channels(&[channel])?;
        for part in &mut self.parts {
            part.set_scale(channel, scale)?;
        }
        if !scale.is_finite() || scale == 0.0 {
            let problem = format!(
                "channel {}: scale {scale}; allowed: a finite number other than 0 (negative = mounted the other way)",
                channel + 1
            );
            return Err(RecordingError::new(&self.name, problem));
        }
        let info = &mut self.channels[channel];
        let of_unit = ["scale-over-unit", "unknown-unit", "units-disagree"];
        self.warnings.retain(|warning| {
            warning.channel != Some(channel + 1) || !of_unit.contains(&warning.code())
        });
        if let Some(unit) = &info.header_unit {
            let agrees = match channel_unit(unit) {
                // A scale says what a volt means, but not whether it is per volt or per millivolt.
                Some((factor, "V")) => factor == 1.0,
                Some((factor, _)) => (scale.abs() / factor - 1.0).abs() <= SAME_SCALE,
                None => false,
            };
            if !agrees {
                let (number, name) = (channel + 1, info.name.as_deref());
                let problem = format!(
                    "the scale {scale} is used and the unit \"{unit}\" of the header is not; drop one of them if they say the same"
                );
                let code = "scale-over-unit";
                self.warnings
                    .push(RecordingWarning::of_channel(code, number, name, problem));
            }
        }
        info.health = info.health.scaled(scale / info.scale);
        info.scale = scale;
        info.unit = None;
        Ok(())
    }

    fn check_channels(&self, channels: &[usize]) -> Result<(), RecordingError> {
        channels
            .iter()
            .try_for_each(|channel| self.channel_by_number(channel.saturating_add(1)).map(drop))
    }

    /// Turns file units of these channels into their units.
    fn scale(&self, channels: &[usize], samples: &mut [Vec<f64>]) {
        for (channel, samples) in channels.iter().zip(samples) {
            let scale = self.channels[*channel].scale;
            if scale != 1.0 {
                samples.iter_mut().for_each(|sample| *sample *= scale);
            }
        }
    }

    /// The index (0-based) of the channel with a 1-based number.
    ///
    /// # Errors
    /// No such channel; the message lists what exists.
    pub fn channel_by_number(&self, number: usize) -> Result<usize, RecordingError> {
        match number.checked_sub(1) {
            Some(index) if index < self.channels.len() => Ok(index),
            _ => Err(self.no_channel(&number.to_string())),
        }
    }

    /// The index (0-based) of the channel with a name, without or with its unit; upper and lower
    /// case count only where both occur.
    ///
    /// # Errors
    /// No channel or several channels of that name; the message lists what exists and the nearest.
    pub fn channel_by_name(&self, name: &str) -> Result<usize, RecordingError> {
        // Beyond this similarity (Jaro-Winkler, 1 = equal) a name is worth proposing.
        const NEAR: f64 = 0.7;
        if let Some(index) = self.find_name(name)? {
            return Ok(index);
        }
        let lower = name.trim().to_lowercase();
        let names = self.channels.iter().filter_map(|c| c.name.as_deref());
        let nearest = names
            .map(|name| {
                let name_lower = name.to_lowercase();
                // "force" means "ch1_force_V", however long that is.
                let within = lower.len() > 2 && name_lower.contains(&lower);
                let similarity = strsim::jaro_winkler(&name_lower, &lower);
                (similarity + f64::from(u8::from(within)), name)
            })
            .filter(|(similarity, _)| *similarity >= NEAR)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let number = lower.parse().ok();
        let number = number.filter(|number| (1..=self.channels.len()).contains(number));
        let proposal = match (nearest, number) {
            (Some((_, name)), _) => format!("; did you mean \"{name}\"?"),
            (None, Some(number)) => format!("; did you mean the number, channel = {number}?"),
            (None, None) => String::new(),
        };
        Err(self.no_channel(&format!("named \"{}\"{proposal}", name.trim())))
    }

    /// The index (0-based) of the channel that a user means by a text: a name, else a number.
    ///
    /// # Errors
    /// Those of [`channel_by_name`](Self::channel_by_name) and
    /// [`channel_by_number`](Self::channel_by_number).
    pub fn channel_index(&self, text: &str) -> Result<usize, RecordingError> {
        match (self.find_name(text)?, text.trim().parse()) {
            (Some(index), _) => Ok(index),
            (None, Ok(number)) => self.channel_by_number(number),
            (None, Err(_)) => self.channel_by_name(text),
        }
    }

    /// Finds the channel with a name; several of that name are an error.
    fn find_name(&self, name: &str) -> Result<Option<usize>, RecordingError> {
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
                    0 => Ok(Some(index)),
                    others => Err(RecordingError::new(
                        &self.name,
                        format!(
                            "{} channels are named \"{wanted}\"; use the channel's number: {}",
                            others + 1,
                            self.existing_channels()
                        ),
                    )),
                };
            }
        }
        Ok(None)
    }

    fn no_channel(&self, which: &str) -> RecordingError {
        let existing = self.existing_channels();
        let problem = format!("no channel {which}; there are: {existing}; name one of these");
        RecordingError::new(&self.name, problem)
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

/// The blocks of a recording, see [`Recording::blocks`].
#[derive(Debug)]
pub struct Blocks<'a> {
    recording: &'a Recording,
    channels: Vec<usize>,
    block: u64,
    at: u64,
    cursor: Option<Box<dyn Cursor + 'a>>,
}

impl Iterator for Blocks<'_> {
    type Item = Result<Block, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        let (recording, start) = (self.recording, self.at);
        if start >= recording.frames {
            return None;
        }
        let end = recording.frames.min(start + self.block);
        let cursor = match self.cursor.take() {
            Some(cursor) => Ok(cursor),
            None => recording
                .check_channels(&self.channels)
                .and_then(|()| recording.source.cursor(start)),
        };
        let mut samples = vec![Vec::new(); self.channels.len()];
        let read = cursor.and_then(|mut cursor| {
            cursor.read(&self.channels, end - start, &mut samples)?;
            recording.scale(&self.channels, &mut samples);
            self.cursor = Some(cursor);
            Ok(Block { start, samples })
        });
        // After an error nothing follows.
        self.at = if read.is_ok() { end } else { recording.frames };
        Some(read)
    }
}

/// Place of the samples of a recording.
trait Source: fmt::Debug + Send + Sync {
    /// Positions a reader at `frame`.
    fn cursor(&self, frame: u64) -> Result<Box<dyn Cursor + '_>, RecordingError>;
}

/// A reader somewhere in the samples; one per pass, since it moves.
trait Cursor: fmt::Debug {
    /// Appends up to `limit` samples of the wanted channels to `into`, in file units; fewer only at the end.
    fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
        into: &mut [Vec<f64>],
    ) -> Result<(), RecordingError>;
}

impl Source for Vec<Vec<f64>> {
    fn cursor(&self, frame: u64) -> Result<Box<dyn Cursor + '_>, RecordingError> {
        let rests = self.iter().map(|samples| &samples[frame as usize..]);
        Ok(Box::new(rests.collect::<Vec<&[f64]>>()))
    }
}

/// The rest of every channel that is held in memory.
impl Cursor for Vec<&[f64]> {
    fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
        into: &mut [Vec<f64>],
    ) -> Result<(), RecordingError> {
        let end = limit.min(self.first().map_or(0, |rest| rest.len() as u64)) as usize;
        for (channel, samples) in channels.iter().zip(into) {
            samples.extend_from_slice(&self[*channel][..end]);
        }
        self.iter_mut().for_each(|rest| *rest = &rest[end..]);
        Ok(())
    }
}

// ---- Formats are told apart by the first bytes of a file, never by its name.

/// Formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FileType {
    Wav,
    Flac,
    Text,
    Lvm,
    Mat,
    Universal,
}

/// First bytes, where they stand, and what they mean. Known so that the message can name them.
const UNREAD: &[(usize, &[u8], &str)] = &[
    (0, b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
    (512, b"\x89HDF\r\n\x1a\n", "a MATLAB 7.3 (HDF5) file"),
    (0, b"MATLAB 7.3", "a MATLAB 7.3 (HDF5) file"),
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

/// Refuses a pipe or a device. Reading starts anew several times, which only a file allows; and a pipe without a writer
/// would wait for ever.
fn refuse_pipe(path: &Path, file: &str) -> Result<(), RecordingError> {
    let kind = std::fs::metadata(path).map(|found| found.file_type());
    if kind.is_ok_and(|kind| !kind.is_file() && !kind.is_dir()) {
        let problem = "is a pipe or a device; save its contents to a file and give that file";
        return Err(RecordingError::new(file, problem));
    }
    Ok(())
}

/// Recognises the format of the file at `path`.
fn recognise(path: &Path, file: &str) -> Result<FileType, RecordingError> {
    let head = read_head(path, file, DECIDING_BYTES)?;
    if head.is_empty() {
        let problem = "the file is empty (0 bytes); record or export it again";
        return Err(RecordingError::new(file, problem));
    }
    // The mark that begins such text in either order of bytes.
    if head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff") {
        let problem = "the text is UTF-16, two bytes a character; save it as UTF-8 (in spreadsheets the type \"CSV UTF-8\")";
        return Err(RecordingError::new(file, problem));
    }
    let riff = [b"RIFF", b"RF64", b"BW64"]
        .iter()
        .any(|mark| head.starts_with(*mark));
    if riff && stands_at(&head, 8, b"WAVE") {
        return Ok(FileType::Wav);
    }
    if head.starts_with(b"fLaC") {
        return Ok(FileType::Flac);
    }
    if head.starts_with(b"MATLAB 5.0") {
        return Ok(FileType::Mat);
    }
    let mut unread = UNREAD.iter();
    if let Some((.., format)) = unread.find(|(at, bytes, _)| stands_at(&head, *at, bytes)) {
        let problem = format!("{format} is not read by this version; export as WAV, CSV or UFF58");
        return Err(RecordingError::new(file, problem));
    }
    if begins_with_mark(&head) {
        return Ok(FileType::Universal);
    }
    if head.starts_with(b"LabVIEW Measurement") {
        return Ok(FileType::Lvm);
    }
    // Text has no control characters but tabs, line ends and form feeds; latin-1 letters may occur.
    if head
        .iter()
        .all(|byte| matches!(byte, b'\t' | b'\n' | b'\r' | 0x0c | 0x1a | 0x20..))
    {
        return Ok(FileType::Text);
    }
    let first_bytes: Vec<String> = head.iter().take(8).map(|b| format!("{b:02x}")).collect();
    let problem = format!(
        "neither a WAV or FLAC file, a universal file nor text (first bytes {}); export as WAV, CSV or UFF58",
        first_bytes.join(" ")
    );
    Err(RecordingError::new(file, problem))
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
