//! The frequency response functions of a measured recording: all estimators, coherence and random
//! error, in the form asked for.

use num_complex::Complex64;

use super::analysis::{RecordingResult, Response};
use super::measure::MeasuredSpectra;
use tapjoint_description::SensorKind;
use tapjoint_signal::recording::ResponseForm;
use tapjoint_signal::spectral::{FrfEstimator, LineQuality, Lines, Window, random_error};

/// How frequency response functions are given.
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
    /// Its form; `None` for sound and where the units are not those of a form.
    pub form: Option<ResponseForm>,
    /// The form in words: "accelerance", "sound pressure per force", "response per force".
    pub form_words: &'static str,
    /// Its unit: "(m/s2)/N"; says where a channel has none but the file's.
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
}

/// A resonance on a frequency response function.
#[derive(Debug, Clone, PartialEq)]
pub struct FrfResonance {
    /// Number of the mode; `None` for a peak that belongs to no mode.
    pub mode: Option<usize>,
    /// What a peak that is no mode is.
    pub label: Option<String>,
    /// Best reading of its frequency (Hz).
    pub frequency: f64,
    /// The nearest line (Hz), on which the following stand.
    pub line_frequency: f64,
    /// The function (its unit), by the estimator that is meant.
    pub value: Option<Complex64>,
    /// Coherence and random error.
    pub quality: LineQuality,
}

/// What keeps frequency response functions from being given.
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
        /// What is measured.
        unit: String,
        /// What was asked for.
        wanted: &'static str,
    },
}

/// The form of what is measured, by its units: `None` unless the response is in m/s2, m/s or m and
/// the force in N.
pub fn form_of(response: &Response, force_unit: Option<&str>) -> Option<ResponseForm> {
    let unit = response.unit.as_deref()?;
    let form = |form: &ResponseForm| form.response_unit() == unit && force_unit == Some("N");
    ResponseForm::ALL.into_iter().find(form)
}

/// The frequency response functions of a recording, one for each response; none without an accepted
/// tap.
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
    recording
        .responses
        .iter()
        .enumerate()
        .map(|(index, response)| {
            let conversion = conversion(recording, response, settings.form)?;
            let mut frf = frf(recording, spectra, (index, settings.estimator), &conversion);
            frf.resonances = resonances(&frf, recording, spectra);
            Ok(frf)
        })
        .collect()
}

/// From what is measured to what is given.
struct Conversion {
    measured: Option<ResponseForm>,
    given: Option<ResponseForm>,
    words: &'static str,
    unit: String,
}

fn conversion(
    recording: &RecordingResult,
    response: &Response,
    wanted: Option<ResponseForm>,
) -> Result<Conversion, FrfError> {
    let force_unit = recording.tap_unit.as_deref();
    let measured = form_of(response, force_unit);
    let unit = unit_per_force(response.unit.as_deref(), force_unit);
    match (measured, wanted) {
        (None, Some(wanted)) => Err(FrfError::NoForm {
            recording: recording.file.clone(),
            response: response.name.clone(),
            unit,
            wanted: wanted.name(),
        }),
        (Some(form), wanted) => {
            let given = wanted.unwrap_or(form);
            Ok(Conversion {
                measured,
                given: Some(given),
                words: given.name(),
                unit: given.unit().to_string(),
            })
        }
        (None, None) => Ok(Conversion {
            measured,
            given: None,
            words: words_without_form(response),
            unit,
        }),
    }
}

fn words_without_form(response: &Response) -> &'static str {
    let sound = response.kind == Some(SensorKind::Sound) || response.unit.as_deref() == Some("Pa");
    if sound {
        "sound pressure per force"
    } else {
        "response per force"
    }
}

/// The unit of a quotient; a unit that nobody stated is not invented.
fn unit_per_force(response: Option<&str>, force: Option<&str>) -> String {
    match (response, force) {
        (Some(unit), Some(force)) if unit.contains('/') => format!("({unit})/{force}"),
        (Some(unit), Some(force)) => format!("{unit}/{force}"),
        (Some(unit), None) => format!("{unit} per unit of the file"),
        (None, Some(force)) => format!("unit of the file per {force}"),
        (None, None) => "per unit of the file".to_string(),
    }
}

fn frf(
    recording: &RecordingResult,
    spectra: &MeasuredSpectra,
    (index, estimator): (usize, FrfEstimator),
    conversion: &Conversion,
) -> Frf {
    let averages = &spectra.averages;
    let lines = averages.lines;
    let estimated = |estimator| {
        let values = averages.frf(index, estimator).unwrap_or_default();
        let converted = values.into_iter().enumerate().map(|(line, value)| {
            match (conversion.measured, conversion.given) {
                (Some(from), Some(to)) => from.convert(to, value?, lines.frequency(line)),
                _ => value,
            }
        });
        converted.collect::<Vec<_>>()
    };
    let coherence = averages.coherence(index);
    let error = |g2: &Option<f64>| g2.and_then(|g2| random_error(g2, averages.taps));
    Frf {
        recording: recording.file.clone(),
        response: recording.responses[index].name.clone(),
        form: conversion.given,
        form_words: conversion.words,
        unit: conversion.unit.clone(),
        lines,
        averages: averages.taps,
        window: spectra.window,
        estimator,
        h1: estimated(FrfEstimator::H1),
        h2: estimated(FrfEstimator::H2),
        hv: estimated(FrfEstimator::Hv),
        random_error: coherence.as_ref().map(|g2| g2.iter().map(error).collect()),
        coherence,
        resonances: Vec::new(),
    }
}

fn resonances(
    frf: &Frf,
    recording: &RecordingResult,
    spectra: &MeasuredSpectra,
) -> Vec<FrfResonance> {
    let numbers = recording.mode_numbers.iter();
    let readings = spectra.readings.iter().zip(numbers);
    readings
        .map(|(reading, &mode)| {
            let line = frf.lines.nearest(reading.frequency);
            let on_line = |values: &Option<Vec<Option<f64>>>| {
                values.as_ref().and_then(|values| *values.get(line)?)
            };
            FrfResonance {
                mode,
                label: reading.label.map(|label| label.to_string()),
                frequency: reading.frequency,
                line_frequency: frf.lines.frequency(line),
                value: frf.values().get(line).copied().flatten(),
                quality: LineQuality {
                    coherence: on_line(&frf.coherence),
                    random_error: on_line(&frf.random_error),
                },
            }
        })
        .collect()
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
