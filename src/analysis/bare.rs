//! A file about which nothing is described: a recording, or frequency response functions.

use super::function_file::{FunctionSettings, measure_functions_watched};
use super::measurement::MeasureSettings;
use super::recording_result::RecordingResult;
use super::stages::{Stage, Watch, Work};
use super::wiring::{PipelineError, measure_bare_watched};
use std::path::Path;
use tapjoint_description::{ChannelRef, ReadBy, TapSelection, WindowKind};
use tapjoint_signal::recording::{
    ReadSettings, Recording, RecordingError, open_frequency_responses,
};
use tapjoint_signal::taps::TapsByHand;

/// Settings for a file without a description.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BareSettings {
    /// Channel of the hammer; `None` = all channels are responses.
    pub hammer: Option<ChannelRef>,
    /// Settings of the readers.
    pub read: ReadSettings,
    /// True to keep the decay of clipped taps; `None` = not stated, they are rejected.
    pub keep_overload: Option<bool>,
    /// Taps that are accepted or rejected by hand.
    pub by_hand: TapsByHand,
    /// Block size (samples); `None` = the longest that fits the shortest tap.
    pub block: Option<usize>,
    /// Band (Hz); `None` = from 0 to sample rate/2.56.
    pub band: Option<(f64, f64)>,
    /// Window; `None` = by the decay of the taps.
    pub window: Option<WindowKind>,
    /// Way of reading the frequencies.
    pub reading: ReadBy,
    /// Choice among the taps that count; `None` = not stated, all of them.
    pub select: Option<TapSelection>,
}

/// Reasons for which a file without a description cannot be analysed.
#[derive(Debug, thiserror::Error)]
pub enum BareError {
    /// The file cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recording or its functions cannot be measured.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
    /// The file holds functions, and a setting is for samples in time.
    #[error(
        "{file}: holds frequency response functions, and {option} is for samples in time; leave it out"
    )]
    NotForFunctions {
        /// The file.
        file: String,
        /// Option of the command line that the setting belongs to.
        option: &'static str,
    },
}

impl BareSettings {
    /// Opens a recording that has the hammer's channel. Tables call it by the name of its file alone.
    ///
    /// # Errors
    /// The file cannot be read, or has no such channel.
    pub fn open(&self, path: &Path) -> Result<Recording, RecordingError> {
        let recording = Recording::open(path, &self.read)?;
        if let Some(hammer) = &self.hammer {
            channel_of(&recording, "--hammer", hammer)?;
        }
        Ok(recording.renamed(name_of(path)))
    }

    pub(super) fn adjust(&self, measure: &mut MeasureSettings) {
        measure.block = self.block;
        measure.band = self.band;
        measure.window = self.window;
        measure.taps.keep_overload = self.keep_overload.unwrap_or(false);
        measure.taps.by_hand = self.by_hand.clone();
        measure.reading = self.reading;
        measure.select = self.select.unwrap_or_default();
    }

    /// Refuses settings that do not apply to functions.
    fn check_for_functions(&self, path: &Path) -> Result<(), BareError> {
        let time_options = [
            ("--hammer", self.hammer.is_some()),
            ("--sample-rate", self.read.sample_rate.is_some()),
            ("--time-unit", self.read.time_unit.is_some()),
            ("--overload", self.keep_overload.is_some()),
            ("--accept-taps", !self.by_hand.accept.is_empty()),
            ("--reject-taps", !self.by_hand.reject.is_empty()),
            ("--block", self.block.is_some()),
            ("--window", self.window.is_some()),
            ("--select", self.select.is_some()),
        ];
        refuse_for_functions(path, &time_options)
    }
}

/// Measures a recording, or the frequency response functions of a file without samples in time. The stages are
/// announced to `watch`.
///
/// # Errors
/// The file cannot be read, a setting does not apply to functions, or the analysis is not possible.
pub fn measure_bare_file(
    path: &Path,
    settings: &BareSettings,
    watch: &dyn Watch,
) -> Result<RecordingResult, BareError> {
    let work = Work::begin(watch, Stage::Taps);
    let problem = match settings.open(path) {
        Ok(opened) => {
            drop(work);
            let hammer = settings.hammer.as_ref();
            let adjust = |measure: &mut MeasureSettings| settings.adjust(measure);
            return Ok(measure_bare_watched(opened, hammer, adjust, watch)?);
        }
        Err(problem) => problem,
    };
    // Only a file that is recognised as no time series is read again.
    if !is_no_time_series(&problem) {
        return Err(problem.into());
    }
    let mut functions = match (problem, open_frequency_responses(path, &settings.read)) {
        (_, Ok(functions)) => functions,
        // A universal file without samples may hold neither.
        (problem @ RecordingError::NoTimeSeries { .. }, Err(_)) => return Err(problem.into()),
        (_, Err(problem)) => return Err(problem.into()),
    };
    settings.check_for_functions(path)?;
    drop(work);
    functions.file = name_of(path);
    let settings = FunctionSettings {
        band: settings.band,
        reading: settings.reading,
        ..FunctionSettings::default()
    };
    let measured = measure_functions_watched(&functions, &settings, watch);
    Ok(measured.map_err(PipelineError::from)?)
}

/// Refuses the first of these options that was given: they do not apply to functions.
///
/// # Errors
/// One of them was given.
pub fn refuse_for_functions(
    path: &Path,
    options: &[(&'static str, bool)],
) -> Result<(), BareError> {
    match options.iter().find(|(_, given)| *given) {
        Some((option, _)) => Err(BareError::NotForFunctions {
            file: path.display().to_string(),
            option,
        }),
        None => Ok(()),
    }
}

/// Returns true if a file was recognised and holds no samples in time.
pub fn is_no_time_series(problem: &RecordingError) -> bool {
    matches!(
        problem,
        RecordingError::FrequencyColumn { .. }
            | RecordingError::Functions { .. }
            | RecordingError::NoTimeSeries { .. }
    )
}

/// Returns the channel (0-based) that an option names.
///
/// # Errors
/// No such channel, or several of that name. The message names the option.
pub fn channel_of(
    recording: &Recording,
    option: &str,
    channel: &ChannelRef,
) -> Result<usize, RecordingError> {
    let found = match channel {
        ChannelRef::Number(number) => recording.channel_by_number(*number),
        ChannelRef::Name(name) => recording.channel_by_name(name),
    };
    found.map_err(|problem| RecordingError::Unusable {
        place: option.to_owned(),
        problem: problem.to_string(),
    })
}

/// Returns the file's name without its folder.
fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
