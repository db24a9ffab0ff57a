//! One recording: taps, spectra, peaks and their readings.

use super::fits::Stabilisation;
use super::stage::Stage;
use super::warning::Warning;
use tapjoint_description::{ReadBy, WindowKind};
use tapjoint_signal::modal::{MainsSettings, ModeReading, PeakSettings};
use tapjoint_signal::recording::ResponseForm;
use tapjoint_signal::recording::{Recording, RecordingError};
use tapjoint_signal::spectral::{
    AveragedSpectra, DISPLAY_RATIO, DecayCheck, LEAST_BLOCK, Lines, MOST_BLOCK, SpectralError,
    Window, largest_smooth_block,
};
use tapjoint_signal::taps::{TapSettings, TapSource, Taps, find_taps};

/// How one recording is analysed.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasureSettings {
    /// Where taps are looked for; its response channels are the ones analysed.
    pub source: TapSource,
    /// Zoom band (Hz); `None` = 0 to rate/2.56.
    pub band: Option<(f64, f64)>,
    /// Block size (samples); `None` = the longest that transforms fast and fits the shortest tap.
    pub block: Option<usize>,
    /// Window; `None` = by the decay in the record.
    pub window: Option<WindowKind>,
    /// How natural frequencies are read.
    pub reading: ReadBy,
    /// What each response measures, for modal constants; `None` where nobody said, or it is no motion in
    /// SI units over a force in N.
    pub kinds: Vec<Option<ResponseForm>>,
    /// How taps are judged.
    pub taps: TapSettings,
    /// What counts as a resonance.
    pub peaks: PeakSettings,
    /// What counts as a mains line.
    pub mains: MainsSettings,
}

impl MeasureSettings {
    /// Everything at its default.
    pub fn new(source: TapSource) -> Self {
        MeasureSettings {
            source,
            band: None,
            block: None,
            window: None,
            reading: ReadBy::default(),
            kinds: Vec::new(),
            taps: TapSettings::default(),
            peaks: PeakSettings::default(),
            mains: MainsSettings::default(),
        }
    }
}

/// What one recording tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// The taps, accepted and rejected.
    pub taps: Taps,
    /// Averages over the accepted taps and what was read from them; `None` without an accepted tap.
    pub spectra: Option<MeasuredSpectra>,
    /// What a reader has to know.
    pub warnings: Vec<Warning>,
}

/// Spectra and readings of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredSpectra {
    /// Averages over the accepted taps.
    pub averages: AveragedSpectra,
    /// The window.
    pub window: Window,
    /// The records' decay: the response that keeps most; `None` of functions from a file.
    pub decay: Option<DecayCheck>,
    /// Resonances and mains lines, ascending.
    pub readings: Vec<ModeReading>,
    /// What the noise of the force channel leaves in its windowed transforms, line by line (N s); `None`
    /// without a hammer or a quiet stretch before the first tap.
    pub force_noise: Option<Vec<f64>>,
    /// What the polyreference fit found.
    pub stabilisation: Stabilisation,
}

/// What stops a measurement.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The recording could not be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Band or block do not fit.
    #[error("{file}: {problem}")]
    Spectral {
        /// The recording.
        file: String,
        /// What does not fit.
        problem: SpectralError,
    },
}

/// Finds taps, averages spectra and reads resonances.
///
/// # Errors
/// Unreadable recordings; a band or block that does not fit. No taps are not an error: the answer
/// then has no spectra.
pub fn measure(
    recording: &Recording,
    settings: &MeasureSettings,
) -> Result<Measurement, MeasureError> {
    // The band is judged before anything is read: it is the user's typing, not the data.
    let fits = |problem| MeasureError::Spectral {
        file: recording.name().to_string(),
        problem,
    };
    let trial = lines_for(settings, recording.sample_rate(), recording.duration()).map_err(fits)?;
    let mut tap_settings = settings.taps;
    tap_settings.wanted = settings
        .block
        .map(|_| trial.block as f64 / (DISPLAY_RATIO * (trial.high - trial.low)));
    let taps = find_taps(recording, &settings.source, &tap_settings)?;
    let mut warnings = super::warning::of_recording(recording, &settings.source, &taps);
    let Some(shortest) = taps.shortest() else {
        return Ok(Measurement {
            taps,
            spectra: None,
            warnings,
        });
    };
    let available = shortest as f64 / recording.sample_rate();
    let lines = match lines_for(settings, recording.sample_rate(), available) {
        Ok(lines) => lines,
        // The file would do, but its taps come too soon: data, not typing.
        Err(problem) => {
            let file = recording.name().to_string();
            warnings.push(Warning::TapsTooShort { file, problem });
            return Ok(Measurement {
                taps,
                spectra: None,
                warnings,
            });
        }
    };
    let stage = Stage::new(recording, settings, &taps, lines);
    let spectra = stage.spectra()?;
    warnings.extend(super::warning::of_spectra(recording.name(), &spectra));
    Ok(Measurement {
        taps,
        spectra: Some(spectra),
        warnings,
    })
}

/// The axis: block and band as wanted, or the longest block that fits `available` seconds.
fn lines_for(
    settings: &MeasureSettings,
    rate: f64,
    available: f64,
) -> Result<Lines, SpectralError> {
    let band = settings.band.unwrap_or((0.0, rate / DISPLAY_RATIO));
    let zoomed_rate = DISPLAY_RATIO * (band.1 - band.0);
    // A hair more than exact, so that 2048 samples of 0.4 s are not 2047 by rounding.
    let fitting = (available * zoomed_rate * (1.0 + 1e-12)) as usize;
    let block = settings
        .block
        .or_else(|| largest_smooth_block(fitting.min(MOST_BLOCK)))
        .unwrap_or(fitting)
        .max(LEAST_BLOCK);
    Lines::zoom(band, rate, block, available)
}
