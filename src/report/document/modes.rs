//! Resonances in the document: readings, fits, change with amplitude.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};

use tapjoint_analysis::{AmplitudeChange, ModeResult, RecordingResult};
use tapjoint_signal::modal::amplitude::{AmplitudePoint, AmplitudeVerdict, Trend};
use tapjoint_signal::modal::fit::{ModalConstant, TapFit, UncertaintySource};
use tapjoint_signal::modal::{FittedReading, ModeReading, ReadBy};

/// One resonance.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct ModeSection {
    /// The model's number; null for a peak that belongs to no mode.
    pub mode: Option<usize>,
    /// Best frequency (Hz).
    pub frequency: f64,
    /// "fit", "interpolated" or "line" ("given" when read elsewhere).
    #[serde(serialize_with = "write_method")]
    #[schemars(schema_with = "method_schema")]
    pub method: Option<ReadBy>,
    /// Frequency on the line (Hz).
    pub line_frequency: Option<f64>,
    /// Bound of the line reading (Hz).
    pub half_line: Option<f64>,
    /// Frequency between the lines (Hz).
    pub interpolated_frequency: Option<f64>,
    /// Bound of the frequency between the lines (Hz), about 95 %.
    pub interpolated_bound: Option<f64>,
    /// Standard deviation of the best frequency (Hz).
    pub std: Option<f64>,
    /// Lower end of its interval (Hz): 95 % of a fit, else the bound of the reading.
    pub low: Option<f64>,
    /// Upper end of its interval (Hz).
    pub high: Option<f64>,
    /// Damping ratio.
    pub damping: Option<f64>,
    /// Standard deviation of the damping ratio.
    pub damping_std: Option<f64>,
    /// The fit; null where the mode was not fitted.
    pub fit: Option<FitSection>,
    /// Coherence on the mode's line, of the sensor that knows it best; null below two averages.
    pub coherence: Option<f64>,
    /// Relative random error (standard deviation) of that sensor's frequency response there.
    pub random_error: Option<f64>,
    /// Non-dimensional frequency (Euler).
    pub lambda: Option<f64>,
    /// Prominence of the peak (dB).
    pub prominence_db: Option<f64>,
    /// Height above the noise (dB).
    pub above_noise_db: Option<f64>,
    /// The recording it was read from.
    pub recording: Option<String>,
    /// Name of a peak that is no mode: "mains 50 Hz".
    pub label: Option<String>,
}

/// Name of the way in which a frequency was read; "given" for one that was read elsewhere.
pub fn method_name(method: Option<ReadBy>) -> &'static str {
    method.map_or("given", ReadBy::name)
}

fn write_method<S: Serializer>(method: &Option<ReadBy>, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(method_name(*method))
}

fn method_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": "string", "enum": ["fit", "interpolated", "line", "given"] })
}

/// The fit of one mode.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FitSection {
    /// Lower end of the damping ratio's 95 % interval.
    pub damping_low: f64,
    /// Upper end of the damping ratio's 95 % interval.
    pub damping_high: f64,
    /// Source of the frequency's standard deviation: "residual" (the noise that the fit leaves) or
    /// "taps" (their scatter, where it is more than that noise explains).
    pub uncertainty_from: UncertaintySource,
    /// Degrees of freedom of the frequency's standard deviation.
    pub freedom: f64,
    /// Probability that noise alone makes the taps scatter so; null with a single tap.
    pub scatter_probability: Option<f64>,
    /// Correlation of the residual between neighbouring lines: near 0 for a good fit.
    pub residual_correlation: f64,
    /// Band of the fit (Hz).
    pub band: [f64; 2],
    /// Every tap alone.
    pub taps: Vec<TapFit>,
    /// Modal constants of the sensors.
    pub constants: Vec<ModalConstant>,
    /// Frequency and damping against amplitude.
    pub amplitude: Option<AmplitudeSection>,
}

/// Frequency and damping of a mode along its decays.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct AmplitudeSection {
    /// "changes", "steady", "beating", "unresolved" or "too-few-points".
    pub verdict: AmplitudeVerdict,
    /// Change of the frequency (Hz); null with too few points.
    pub frequency: Option<Trend>,
    /// Change of the damping ratio; null with too few points.
    pub damping: Option<Trend>,
    /// Response whose amplitude is given, from 1; null without points.
    pub sensor: Option<usize>,
    /// From the largest to the smallest amplitude; null where the change is within its uncertainty or too
    /// small to matter.
    pub ends: Option<AmplitudeChange>,
    /// The points, by tap and time; left out in the merged list of modes, whose recording has them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<AmplitudePoint>,
}

impl ModeSection {
    /// The section of a resonance of the merged list.
    pub(super) fn of(mode: &ModeResult, recordings: &[RecordingResult]) -> Self {
        let mut of_file = recordings.iter();
        let recording = of_file.find(|one| mode.recording.as_ref() == Some(&one.file));
        let reading = mode.reading.as_ref();
        let mut reading = reading.map_or_else(ModeSection::default, |reading| {
            ModeSection::of_reading(reading, recording)
        });
        // The points of the curve against amplitude stand with the recording's own reading.
        let fit = reading.fit.as_mut();
        if let Some(amplitude) = fit.and_then(|fit| fit.amplitude.as_mut()) {
            amplitude.points.clear();
        }
        ModeSection {
            mode: mode.mode,
            frequency: mode.frequency,
            half_line: mode.half_line,
            std: mode.std,
            lambda: mode.lambda,
            recording: mode.recording.clone(),
            label: mode.label(),
            ..reading
        }
    }

    /// The section of one recording's reading, with the quality of its line in that recording.
    pub(super) fn of_reading(reading: &ModeReading, recording: Option<&RecordingResult>) -> Self {
        let spectra = recording.and_then(|recording| recording.measurement.spectra.as_ref());
        let quality = spectra.map(|spectra| spectra.averages.best_quality(reading.frequency));
        let change = recording.and_then(|recording| recording.amplitude_change(reading));
        let fit = reading.fit.as_deref();
        ModeSection {
            mode: None,
            frequency: reading.frequency,
            method: Some(reading.source),
            line_frequency: Some(reading.line_frequency),
            half_line: Some(reading.half_line),
            interpolated_frequency: reading.between.map(|between| between.frequency),
            interpolated_bound: reading.between.map(|between| between.bound),
            std: reading.std,
            low: Some(reading.interval.0),
            high: Some(reading.interval.1),
            damping: reading.damping_ratio,
            damping_std: reading.damping_std,
            fit: fit.map(|fit| FitSection::of(fit, change)),
            coherence: quality.and_then(|quality| quality.coherence),
            random_error: quality.and_then(|quality| quality.random_error),
            lambda: None,
            prominence_db: reading.prominence_db,
            above_noise_db: reading.above_noise_db,
            recording: None,
            label: reading.label.map(|label| label.to_string()),
        }
    }
}

impl FitSection {
    fn of(fit: &FittedReading, change: Option<AmplitudeChange>) -> Self {
        let mode = &fit.mode;
        FitSection {
            damping_low: mode.damping_ratio.low,
            damping_high: mode.damping_ratio.high,
            uncertainty_from: mode.frequency.source,
            freedom: mode.frequency.freedom,
            scatter_probability: mode.frequency.scatter_probability,
            residual_correlation: mode.residual_correlation,
            band: [mode.band.0, mode.band.1],
            taps: mode.taps.clone(),
            constants: fit.constants.clone(),
            amplitude: fit.amplitude.as_ref().map(|curve| AmplitudeSection {
                verdict: curve.verdict,
                frequency: curve.frequency.clone(),
                damping: curve.damping.clone(),
                sensor: curve.sensor.map(|sensor| sensor + 1),
                ends: change,
                points: curve.points.clone(),
            }),
        }
    }
}
