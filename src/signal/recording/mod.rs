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

use std::ops::Range;
use std::path::{Path, PathBuf};

mod blocks;
mod channels;
mod coding;
mod csv;
mod error;
mod header;
mod health;
mod layout;
mod open;
mod responses;
mod riff;
mod rows;
mod sniff;
mod source;
mod text;
mod time;
mod time_column;
mod uff;
mod units;
mod warning;
mod wav;
mod wav_error;
mod wav_stream;
mod write;

pub use blocks::Blocks;
pub use error::RecordingError;
pub use health::{ChannelHealth, Dropout, FlatTop};
pub use responses::{
    FrequencyResponse, FrequencyResponses, ResponseError, ResponseForm, ResponseWarning,
    open_frequency_responses,
};
pub use text::Separator;
pub use uff::{
    Abscissa, Axis, Dataset, Function, FunctionType, FunctionValues, Ordinate, Point, Precision,
    UffCoding, UffError, UffFormat, UniversalFile, encode_frequency_responses_uff,
    is_universal_file, list_datasets, read_function,
};
pub use units::{STANDARD_GRAVITY, channel_unit};
pub use warning::{ChannelLabel, RecordingWarning};
pub use wav_error::WavError;
pub use wav_stream::{WavLayout, WavStream};
pub use write::{WavFormat, encode_wav, write_wav};

use health::HealthMeter;
use source::Source;
use warning::health_warnings;

/// Relative difference to a header's factor below which a scale states the same unit: a rounded 9.81 is another.
const SAME_SCALE: f64 = 1e-6;

/// What the caller knows about a file that the file may not say.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ReadSettings {
    /// Sample rate (Hz) of a CSV file without a time column. A file's own rate wins, with a
    /// warning where they differ. Default: none, because a guessed rate scales every frequency.
    pub sample_rate: Option<f64>,
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
        /// What separates the columns.
        separator: Separator,
        /// Decimal mark, `.` where no number shows one.
        decimal: char,
        /// Whether the sample rate comes from a time column.
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

/// Where a text file's sample rate comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Timing {
    /// From its time column.
    TimeColumn,
    /// From the caller.
    Given,
}

/// What is known about one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelInfo {
    /// Name without the unit, where the file gives one.
    pub name: Option<String>,
    /// The unit that values have: SI where the header's unit is known, the header's text where it
    /// is not; `None` without a unit and after a scale was set.
    pub unit: Option<String>,
    /// The unit as the header has it.
    pub header_unit: Option<String>,
    /// What file units are multiplied by: the scale set, else the header unit's factor to SI, else 1.
    pub scale: f64,
    /// Quality of the samples, in the unit that values have.
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
        open::open(path, settings)
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
        open::from_samples(name.into(), sample_rate, channels)
    }

    /// The file as the caller named it, or the name of a recording in memory.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The file; `None` for a recording in memory.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// What kind of file it is.
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

    /// The same recording under another name, the one its description uses.
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
            warnings.extend(health_warnings(&label, &channel.health, self.sample_rate));
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
        Blocks::new(self, channels, block)
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
        let overruled = |warning: &RecordingWarning| match warning {
            RecordingWarning::ScaleOverUnit { channel: label, .. }
            | RecordingWarning::UnknownUnit { channel: label, .. }
            | RecordingWarning::UnitsDisagree { channel: label, .. } => label.number == channel + 1,
            _ => false,
        };
        self.warnings.retain(|warning| !overruled(warning));
        // A scale says what a volt means; whether per millivolt or per volt, nobody knows.
        let agrees = |unit: &String| {
            channel_unit(unit).is_some_and(|(factor, si)| match si {
                "V" => factor == 1.0,
                _ => (scale.abs() / factor - 1.0).abs() <= SAME_SCALE,
            })
        };
        let overrules = |unit: &&String| !agrees(unit);
        if let Some(unit) = info.header_unit.as_ref().filter(overrules) {
            self.warnings.push(RecordingWarning::ScaleOverUnit {
                channel: channel_label(channel, info),
                scale,
                unit: unit.clone(),
            });
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
}

fn channel_label(at: usize, channel: &ChannelInfo) -> ChannelLabel {
    ChannelLabel {
        number: at + 1,
        name: channel.name.clone(),
    }
}
