//! The frequency response functions of a measured recording: all estimators, coherence and random
//! error, in the form asked for.

use num_complex::Complex64;
use schemars::JsonSchema;
use serde::Serialize;

use super::measurement::MeasuredSpectra;
use super::recording_result::{RecordingResult, Response};
use tapjoint_description::SensorKind;
use tapjoint_signal::recording::ResponseForm;
use tapjoint_signal::spectral::{FrfEstimator, LineQuality, Lines, Window, random_error};

/// Form and estimator of frequency response functions.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FrfSettings {
    /// The estimator that is meant where one is shown. H1.
    pub estimator: FrfEstimator,
    /// The form; `None` = as measured.
    pub form: Option<ResponseForm>,
}

/// The frequency response function of one sensor in one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Frf {
    /// File of the recording.
    pub recording: String,
    /// Name of the sensor, or of its channel.
    pub response: String,
    /// Form of the function; `None` for sound and where the units are not those of a form.
    pub form: Option<ResponseForm>,
    /// The form in words: "accelerance", "sound pressure per force", "response per force".
    pub form_words: &'static str,
    /// Unit of the function: "(m/s2)/N"; words where a channel has none but the file's.
    pub unit: String,
    /// The axis.
    pub lines: Lines,
    /// Taps averaged.
    pub averages: usize,
    /// The window; an exponential one has moved every pole, so that this is H(omega - j decay).
    pub window: Window,
    /// The estimator that is meant where one is shown.
    pub estimator: FrfEstimator,
    /// H1 on each line (the unit above); `None` where it does not exist.
    pub h1: Vec<Option<Complex64>>,
    /// H2 on each line.
    pub h2: Vec<Option<Complex64>>,
    /// Hv on each line.
    pub hv: Vec<Option<Complex64>>,
    /// Coherence on each line; `None` below two averages.
    pub coherence: Option<Vec<Option<f64>>>,
    /// Relative random error (standard deviation) of the magnitude on each line.
    pub random_error: Option<Vec<Option<f64>>>,
    /// The recording's resonances on this function.
    pub resonances: Vec<FrfResonance>,
    /// Curve of the recording's fitted modes over H1; `None` without fitted modes.
    pub fitted: Option<FittedCurve>,
}

/// The curve of fitted modes over one frequency response function.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedCurve {
    /// Number of fitted modes.
    pub modes: usize,
    /// Band of the curve (Hz).
    pub band: (f64, f64),
    /// Share of the measured function's power in the band that the curve leaves (1), in the form as measured.
    pub left: f64,
    /// The curve on each line (unit of the function); `None` outside the band.
    pub values: Vec<Option<Complex64>>,
}

/// A resonance on a frequency response function.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FrfResonance {
    /// Number of the mode; null for a peak that belongs to none.
    pub mode: Option<usize>,
    /// Name of a peak that is no mode: "mains 50 Hz".
    pub label: Option<String>,
    /// Best reading of its frequency (Hz).
    pub frequency: f64,
    /// The nearest line (Hz), on which the following stand.
    pub line_frequency: f64,
    /// Magnitude (unit of the function), by the estimator that is meant.
    pub magnitude: Option<f64>,
    /// Phase (degrees).
    pub phase: Option<f64>,
    /// Coherence and random error of the function.
    #[serde(flatten)]
    pub quality: LineQuality,
}

/// Reasons for which there are no frequency response functions.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FrfError {
    /// No force was recorded.
    #[error(
        "{recording}: there is no hammer channel, and without the force no frequency response function; \
         name its channel (--hammer CH, or [hammer] in the description)"
    )]
    NoHammer {
        /// The recording.
        recording: String,
    },
    /// A form is wanted of something that has none.
    #[error(
        "{recording}: {response} is {unit}, which cannot be given as {wanted}: that takes an acceleration, \
         a velocity or a displacement in SI units over a force in N; state the scales \
         (--scale-hammer, --scale-sensor and --sensor-kind, or in the description), or leave the form out"
    )]
    NoForm {
        /// The recording.
        recording: String,
        /// The sensor.
        response: String,
        /// Unit of the measured function.
        unit: String,
        /// The form that was asked for.
        wanted: &'static str,
    },
}

/// The form of what is measured, by its units: `None` unless the response is in m/s2, m/s or m and
/// the force in N.
pub fn form_of(response: &Response, force_unit: Option<&str>) -> Option<ResponseForm> {
    let unit = response
        .unit
        .as_deref()
        .filter(|_| force_unit == Some("N"))?;
    let mut forms = ResponseForm::ALL.into_iter();
    forms.find(|form| form.response_unit() == unit)
}

/// The form of what a sensor senses over a force; `None` for sound.
pub(super) fn form_of_kind(kind: SensorKind) -> Option<ResponseForm> {
    match kind {
        SensorKind::Acceleration => Some(ResponseForm::Accelerance),
        SensorKind::Velocity => Some(ResponseForm::Mobility),
        SensorKind::Displacement => Some(ResponseForm::Receptance),
        SensorKind::Sound => None,
    }
}

/// The frequency response functions of a recording, one for each response; none without an accepted
/// tap that was not overloaded.
///
/// # Errors
/// [`FrfError`]: no hammer, or a form that the sensors do not have.
pub fn frfs_of(recording: &RecordingResult, settings: &FrfSettings) -> Result<Vec<Frf>, FrfError> {
    if !recording.has_hammer {
        return Err(FrfError::NoHammer {
            recording: recording.file.clone(),
        });
    }
    let Some(spectra) = &recording.measurement.spectra else {
        return Ok(Vec::new());
    };
    // Every tap that is used was overloaded.
    if spectra.averages.h1.is_none() {
        return Ok(Vec::new());
    }
    let mut frfs = Vec::with_capacity(recording.responses.len());
    for (index, response) in recording.responses.iter().enumerate() {
        let mut frf = frf(recording, spectra, index, response, settings)?;
        frf.resonances = resonances(&frf, recording);
        frfs.push(frf);
    }
    Ok(frfs)
}

/// The function of one response, without its resonances.
fn frf(
    recording: &RecordingResult,
    spectra: &MeasuredSpectra,
    index: usize,
    response: &Response,
    settings: &FrfSettings,
) -> Result<Frf, FrfError> {
    let force_unit = recording.tap_unit.as_deref();
    // A unit that is not stated is not invented.
    let measured_unit = match (response.unit.as_deref(), force_unit) {
        (Some(unit), Some(force)) if unit.contains('/') => format!("({unit})/{force}"),
        (Some(unit), Some(force)) => format!("{unit}/{force}"),
        (Some(unit), None) => format!("{unit} per unit of the file"),
        (None, Some(force)) => format!("unit of the file per {force}"),
        (None, None) => "per unit of the file".to_string(),
    };
    let measured = form_of(response, force_unit);
    let form = match (measured, settings.form) {
        (None, Some(wanted)) => {
            return Err(FrfError::NoForm {
                recording: recording.file.clone(),
                response: response.name.clone(),
                unit: measured_unit,
                wanted: wanted.name(),
            });
        }
        (measured, wanted) => wanted.or(measured),
    };
    let sound = response.kind == Some(SensorKind::Sound) || response.unit.as_deref() == Some("Pa");
    let averages = &spectra.averages;
    let lines = averages.lines;
    let [h1, h2, hv] = [FrfEstimator::H1, FrfEstimator::H2, FrfEstimator::Hv].map(|estimator| {
        let mut values = averages.frf(index, estimator).unwrap_or_default();
        if let (Some(from), Some(to)) = (measured, form) {
            for (line, value) in values.iter_mut().enumerate() {
                *value = value.and_then(|value| from.convert(to, value, lines.frequency(line)));
            }
        }
        values
    });
    let coherence = averages.coherence(index);
    let errors = coherence.as_ref().map(|lines| {
        let errors = lines.iter().map(|one| random_error((*one)?, averages.taps));
        errors.collect()
    });
    Ok(Frf {
        recording: recording.file.clone(),
        response: response.name.clone(),
        form,
        fitted: fitted_curve(spectra, index, measured.zip(form)),
        form_words: match form {
            Some(form) => form.name(),
            None if sound => "sound pressure per force",
            None => "response per force",
        },
        unit: form.map_or(measured_unit, |form| form.unit().to_string()),
        lines,
        averages: averages.taps,
        window: spectra.window,
        estimator: settings.estimator,
        h1,
        h2,
        hv,
        random_error: errors,
        coherence,
        resonances: Vec::new(),
    })
}

/// The curve of the fitted modes over the function of one response, from the measured form into the one asked for.
fn fitted_curve(
    spectra: &MeasuredSpectra,
    index: usize,
    forms: Option<(ResponseForm, ResponseForm)>,
) -> Option<FittedCurve> {
    let fitted = spectra.fitted.as_ref()?;
    let own = fitted.functions.get(index)?.as_ref()?;
    let lines = &spectra.averages.lines;
    let mut values = vec![None; lines.points()];
    let in_band = values.iter_mut().enumerate().skip(fitted.first);
    for ((line, value), own) in in_band.zip(&own.values) {
        *value = match forms {
            Some((from, to)) => from.convert(to, *own, lines.frequency(line)),
            None => Some(*own),
        };
    }
    Some(FittedCurve {
        modes: fitted.modes,
        band: fitted.band,
        left: own.left,
        values,
    })
}

/// The recording's readings with the values of a function on their lines.
fn resonances(frf: &Frf, recording: &RecordingResult) -> Vec<FrfResonance> {
    let numbered = recording.readings().iter().zip(&recording.mode_numbers);
    let found = numbered.map(|(reading, &mode)| {
        let line = frf.lines.nearest(reading.frequency);
        let value = frf.values().get(line).copied().flatten();
        FrfResonance {
            mode,
            label: reading.label.map(|label| label.to_string()),
            frequency: reading.frequency,
            line_frequency: frf.lines.frequency(line),
            magnitude: value.map(|value| value.norm()),
            phase: value.map(|value| value.arg().to_degrees()),
            quality: LineQuality {
                coherence: frf.coherence.as_ref().and_then(|lines| *lines.get(line)?),
                random_error: frf
                    .random_error
                    .as_ref()
                    .and_then(|lines| *lines.get(line)?),
            },
        }
    });
    found.collect()
}

impl Frf {
    /// The values of one estimator (the function's unit).
    pub fn of(&self, estimator: FrfEstimator) -> &[Option<Complex64>] {
        match estimator {
            FrfEstimator::H1 => &self.h1,
            FrfEstimator::H2 => &self.h2,
            FrfEstimator::Hv => &self.hv,
        }
    }

    /// The values of the estimator that is meant (the function's unit).
    pub fn values(&self) -> &[Option<Complex64>] {
        self.of(self.estimator)
    }
}
