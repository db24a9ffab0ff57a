//! Results of the chain: plain data, for the report and for callers.

use super::amplitude::AmplitudeChange;
use super::measure::{MeasureError, Measurement};
use super::structure::TestedStructure;
use super::warning::Warning;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;
use tapjoint_beam::specimen::{PointMass, Specimen};
use tapjoint_beam::{Beam, JointStiffness};
use tapjoint_identify::consistent::ConsistentEstimate;
use tapjoint_identify::observation::UNPAIRED;
use tapjoint_identify::{FreeBeamEstimate, JointEstimate, PredictedMode, Uncertain};
use tapjoint_signal::modal::ModeReading;
use tapjoint_signal::quality::Verdict;
use tapjoint_signal::recording::{ChannelInfo, Format, RecordingError};
use tapjoint_signal::spectral::SpectralError;

/// A finished analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    /// Name of the test.
    pub name: String,
    /// The structure; `None` for a bare recording.
    pub structure: Option<TestedStructure>,
    /// The recordings, in the order of the description.
    pub recordings: Vec<RecordingResult>,
    /// Difference of each recording from the first, "8.8 times its tap level", for which modes and estimate leave
    /// it out; `None` where they do not.
    pub aside: Vec<Option<String>>,
    /// Resonances of the reference configuration, ascending: the first recording and all others
    /// with its sensor positions and tap level.
    pub modes: Vec<ModeResult>,
    /// The joint or the material by the modes; `None` for a bare recording.
    pub identification: Option<Identification>,
    /// Quality of the test: good practice, check by check.
    pub verdicts: Vec<Verdict>,
    /// Everything that a reader of the results has to know.
    pub warnings: Vec<Warning>,
}

/// Method by which a joint or a beam is estimated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EstimateMethod {
    /// Least squares on the frequencies themselves, the closed form beside it.
    #[default]
    Consistent,
    /// The closed form alone: the regression over pairs of modes, or a free beam's.
    Pairs,
    /// The closed form of a free beam, which stands in results where a joint has the pair regression.
    FreeBeam,
}

impl EstimateMethod {
    /// The methods that can be asked for.
    pub const ALL: [Self; 2] = [Self::Consistent, Self::Pairs];

    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Consistent => "consistent",
            Self::Pairs => "pairs",
            Self::FreeBeam => "free-beam",
        }
    }
}

/// One recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingResult {
    /// File as the description names it.
    pub file: String,
    /// Kind of file.
    pub format: Format,
    /// Sample rate (Hz); `None` of frequency response functions from a file.
    pub sample_rate: Option<f64>,
    /// Length (s); `None` of frequency response functions from a file.
    pub seconds: Option<f64>,
    /// Every channel in the file.
    pub channels: Vec<ChannelInfo>,
    /// True if there is a hammer channel.
    pub has_hammer: bool,
    /// Unit of the taps' peaks: the hammer's, or without one that of all responses; `None` where
    /// they are not known or differ.
    pub tap_unit: Option<String>,
    /// The responses analysed.
    pub responses: Vec<Response>,
    /// The analysed zoom band (Hz), where one was asked for.
    pub band: Option<(f64, f64)>,
    /// Circumstances as described; empty for a bare recording.
    pub conditions: Conditions,
    /// Taps, spectra, readings.
    pub measurement: Measurement,
    /// Numbers of the modes that this recording's readings belong to, one for each reading.
    pub mode_numbers: Vec<Option<usize>>,
    /// The channel on which taps were found, over time; `None` of frequency response functions from a
    /// file.
    pub overview: Option<Overview>,
}

/// Circumstances of a recording that are carried to the outputs as described.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Conditions {
    /// Position of the taps (m).
    pub tap: Option<f64>,
    /// Position of each sensor (m); that in this recording of a sensor that was moved.
    pub sensor_positions: BTreeMap<String, f64>,
    /// Mass of each sensor (kg) whose mass is stated.
    pub sensor_masses: BTreeMap<String, f64>,
    /// Known masses that are fastened to the beam.
    pub masses: Vec<PointMass>,
    /// Tightening torque (N m).
    pub torque: Option<f64>,
    /// Temperature (degrees Celsius).
    pub temperature: Option<f64>,
    /// Date.
    pub date: Option<String>,
}

/// A response channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// The sensor's name, or the channel's.
    pub name: String,
    /// Kind of sensor; `None` where it is not known.
    pub kind: Option<tapjoint_description::SensorKind>,
    /// Unit of its values; `None` where it is not known.
    pub unit: Option<String>,
}

/// Smallest and largest value in equal pieces of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Overview {
    /// Length of a piece (s).
    pub step: f64,
    /// Smallest value of each piece (unit of the channel, its mean taken out).
    pub low: Vec<f64>,
    /// Largest value of each piece.
    pub high: Vec<f64>,
    /// The samples about each tap.
    pub close_ups: Vec<CloseUp>,
}

/// One resonance.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeResult {
    /// The model's number; `None` for a peak that belongs to no mode.
    pub mode: Option<usize>,
    /// Best frequency (Hz).
    pub frequency: f64,
    /// Bound of a line reading (Hz), where known.
    pub half_line: Option<f64>,
    /// Standard uncertainty of the best frequency (Hz), where known.
    pub std: Option<f64>,
    /// Scatter between the recordings that were merged; `None` with one recording.
    pub between: Option<BetweenRecordings>,
    /// The reading behind it; `None` for frequencies read elsewhere.
    pub reading: Option<ModeReading>,
    /// File of the recording it was read from.
    pub recording: Option<String>,
    /// Non-dimensional frequency of an Euler beam (1), where there is a beam.
    pub lambda: Option<f64>,
}

impl ModeResult {
    /// A resonance as this recording reads it, without a number.
    pub(super) fn of(reading: ModeReading, recording: &str) -> Self {
        ModeResult {
            mode: None,
            frequency: reading.frequency,
            half_line: Some(reading.half_line),
            std: reading.std,
            between: None,
            recording: Some(recording.to_owned()),
            lambda: None,
            reading: Some(reading),
        }
    }

    /// Returns true unless its reading says that it is no mode.
    pub(super) fn may_be_mode(&self) -> bool {
        let reading = self.reading.as_ref();
        reading.is_none_or(|reading| reading.label.is_none())
    }

    /// Returns true for a resonance that got no number.
    pub(super) fn is_unpaired(&self) -> bool {
        self.mode.is_none() && self.may_be_mode()
    }

    /// Words for a peak that is no mode: "mains 50 Hz", "unpaired"; `None` for a mode.
    pub fn label(&self) -> Option<String> {
        let label = self.reading.as_ref().and_then(|reading| reading.label);
        match self.mode {
            Some(_) => None,
            None => Some(label.map_or(UNPAIRED.to_owned(), |label| label.to_string())),
        }
    }
}

impl Identification {
    /// The method that estimate and prediction go by, if `wanted` is asked for: the consistent estimate where there is
    /// one, or where all stiffnesses are known.
    pub(super) fn method(
        &self,
        structure: &TestedStructure,
        wanted: EstimateMethod,
    ) -> EstimateMethod {
        if wanted == EstimateMethod::Consistent && self.predicts_with_details(structure) {
            EstimateMethod::Consistent
        } else {
            EstimateMethod::Pairs
        }
    }

    /// Returns true if there is an estimate by any method.
    pub fn is_answered(&self) -> bool {
        self.consistent.is_some() || self.estimate.is_some()
    }

    /// The beam and the joint (non-dimensional by that beam) that predictions are made with: those of
    /// the main estimate, else of the closed form with known stiffnesses in the place of its own, else
    /// the known ones; `None` where no joint is known.
    pub fn beam_and_joint(&self, structure: &TestedStructure) -> Option<(Beam, JointStiffness)> {
        match (&self.consistent, &self.estimate) {
            (Some(found), _) => Some((found.beam, found.joint)),
            (None, Some(Estimate::FreeBeam(found))) => {
                let modulus = found.modulus.value;
                let beam = Beam {
                    modulus,
                    ..structure.beam
                };
                Some((beam, JointStiffness::FREE))
            }
            (None, Some(Estimate::Joint(found))) => {
                let joint = structure.known.over(found.pairs.joint())?;
                Some((structure.beam, joint))
            }
            (None, None) => Some((structure.beam, structure.known.over(None)?)),
        }
    }

    /// Returns true if predictions take in what is fastened to the beam and a lap joint's unequal halves: a
    /// closed form that was estimated without them has their effect in its stiffnesses already.
    pub fn predicts_with_details(&self, structure: &TestedStructure) -> bool {
        self.consistent.is_some() || structure.known.over(None).is_some()
    }
}

/// The joint, or the material of a free beam, by the modes.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// The main estimate: the joint whose frequencies are nearest; `None` where it was not asked for
    /// or could not be had.
    pub consistent: Option<Box<ConsistentEstimate>>,
    /// The estimate in closed form, which stands beside the main one or in its place.
    pub estimate: Option<Estimate>,
    /// Why there is no estimate, or not the one that was asked for.
    pub reason: Option<String>,
    /// Predicted beside measured frequencies; empty where no joint can be predicted with.
    pub prediction: Vec<PredictedMode>,
    /// The structure that the prediction is of; `None` without a joint to predict with.
    pub predicted: Option<Specimen>,
    /// Estimates under errors of the frequencies, by each method that has one.
    pub perturbations: Perturbations,
}

/// An estimate in closed form.
#[derive(Debug, Clone, PartialEq)]
pub enum Estimate {
    /// A joint, by the pair regression.
    Joint(Box<JointEstimate>),
    /// A free beam's material.
    FreeBeam(Box<FreeBeamEstimate>),
}

/// Estimates under changed frequencies, by each method that has one: first the pair regression, then the consistent
/// estimate.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Perturbations {
    /// All frequencies up and down by a percentage.
    pub uniform: Vec<PerturbationSection>,
    /// Average errors of the percentages.
    pub averages: Vec<AverageSection>,
    /// Under random errors; empty where no standard deviations are known, or none was asked for.
    pub random: Vec<MonteCarloSection>,
    /// Under each mode's own bound; empty where no bounds are known.
    pub spans: Vec<ResolutionSpanSection>,
}

impl Perturbations {
    /// Returns true if no estimate was perturbed.
    pub fn is_empty(&self) -> bool {
        self.uniform.is_empty() && self.random.is_empty() && self.spans.is_empty()
    }
}

/// An estimate from frequencies changed by the same percentage.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct PerturbationSection {
    /// Change of all frequencies (%), signed.
    pub percent: f64,
    /// "pairs" or "consistent".
    pub method: EstimateMethod,
    /// Kx.
    pub kx: Option<f64>,
    /// Ky.
    pub ky: Option<f64>,
    /// Kz.
    pub kz: Option<f64>,
}

/// Average errors of +percent and -percent: the mean of their magnitudes, as in table 9 of Ingole &
/// Chatterjee, and the error of their mean, as in table 14.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct AverageSection {
    /// "pairs" or "consistent".
    pub method: EstimateMethod,
    /// Change of all frequencies (%), its size.
    pub percent: f64,
    /// Mean of the magnitudes, of Kx (%).
    pub kx_percent: Option<f64>,
    /// Mean of the magnitudes, of Ky (%).
    pub ky_percent: Option<f64>,
    /// Mean of the magnitudes, of Kz (%).
    pub kz_percent: Option<f64>,
    /// Magnitude of the error of the two estimates' mean (%), as in table 14: smaller, because
    /// opposite errors cancel. Of Kx.
    pub kx_of_mean_percent: Option<f64>,
    /// Magnitude of the error of the mean of Ky (%).
    pub ky_of_mean_percent: Option<f64>,
    /// Magnitude of the error of the mean of Kz (%).
    pub kz_of_mean_percent: Option<f64>,
}

/// Estimates under random errors of the frequencies: median and 95 % interval.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct MonteCarloSection {
    /// "pairs" or "consistent".
    pub method: EstimateMethod,
    /// Repetitions.
    pub samples: usize,
    /// Number of repetitions without an estimate.
    pub failed: usize,
    /// Kx.
    pub kx: Option<Uncertain>,
    /// Ky.
    pub ky: Option<Uncertain>,
    /// Kz.
    pub kz: Option<Uncertain>,
    /// The first repetitions' estimates, for a picture: (Kx, Ky).
    #[serde(skip)]
    pub cloud: Vec<[f64; 2]>,
}

/// Spans of the estimate over the bounds of the readings.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct ResolutionSpanSection {
    /// "pairs" or "consistent".
    pub method: EstimateMethod,
    /// Number of sign patterns tried.
    pub patterns: usize,
    /// Patterns that left no estimate.
    pub failed: usize,
    /// Smallest and largest Kx.
    pub kx: Option<[f64; 2]>,
    /// Smallest and largest Ky.
    pub ky: Option<[f64; 2]>,
    /// Smallest and largest Kz.
    pub kz: Option<[f64; 2]>,
    /// All estimates over the patterns, for a picture: (Kx, Ky).
    #[serde(skip)]
    pub cloud: Vec<[f64; 2]>,
    /// Change of each parameter (%) when one mode moves by its own bound.
    pub sensitivity: Vec<SensitivitySection>,
}

/// Change of the estimate by one mode's bound.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct SensitivitySection {
    /// Mode number.
    pub mode: usize,
    /// The bound (Hz).
    pub half_line: f64,
    /// Change of Kx (%).
    pub kx_percent: Option<f64>,
    /// Change of Ky (%).
    pub ky_percent: Option<f64>,
    /// Change of Kz (%).
    pub kz_percent: Option<f64>,
    /// Change of Kx (%) per change of this frequency (%), for small changes.
    pub kx_percent_per_percent: Option<f64>,
    /// Change of Ky (%) per change of this frequency (%).
    pub ky_percent_per_percent: Option<f64>,
    /// Change of Kz (%) per change of this frequency (%).
    pub kz_percent_per_percent: Option<f64>,
}

/// The samples about a tap.
#[derive(Debug, Clone, PartialEq)]
pub struct CloseUp {
    /// First sample (s from the trigger).
    pub start: f64,
    /// Distance of the samples (s).
    pub step: f64,
    /// The force's samples (N), the channel's mean taken out; `None` without a hammer.
    pub force: Option<Vec<f64>>,
    /// The first response's (its unit).
    pub response: Option<Vec<f64>>,
}

/// One mode in the recordings of one configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BetweenRecordings {
    /// Variance of its frequency between the recordings, sum (f - mean)^2/(n - 1), over the mean's square (1).
    pub variance: f64,
    /// Variance by the readings' own standard uncertainties, over the mean's square (1).
    pub own: f64,
    /// Recordings less one.
    pub freedom: usize,
}

impl RecordingResult {
    /// Returns the recording's own readings of resonances, ascending; none without spectra.
    pub fn readings(&self) -> &[ModeReading] {
        let spectra = self.measurement.spectra.as_ref();
        spectra.map_or(&[], |spectra| &spectra.readings)
    }

    /// Peaks of the accepted taps (`tap_unit`).
    pub(super) fn tap_peaks(&self) -> Vec<f64> {
        let taps = self.measurement.taps.accepted();
        taps.map(|tap| tap.peak).collect()
    }

    /// Frequencies (Hz) between which it was searched for resonances; `None` without spectra.
    pub(super) fn looked_at(&self) -> Option<(f64, f64)> {
        let lines = self.measurement.spectra.as_ref()?.averages.lines;
        Some((lines.low, lines.high))
    }

    /// Change of a mode with its amplitude, where it is beyond the uncertainty and large enough to matter.
    pub fn amplitude_change(&self, reading: &ModeReading) -> Option<AmplitudeChange> {
        let curve = reading.fit.as_ref()?.amplitude.as_ref()?;
        let change = AmplitudeChange::of(curve)?;
        let response = curve.sensor.and_then(|sensor| self.responses.get(sensor));
        let unit = response.and_then(|response| response.unit.clone());
        Some(AmplitudeChange { unit, ..change })
    }
}

/// Reasons for which an analysis stops.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// A recording could not be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A recording could not be measured.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// A band or block of the description that does not fit its recording.
    #[error("{file}:{line}: {recording}: {problem}")]
    Setting {
        /// The description.
        file: String,
        /// Line of the description.
        line: usize,
        /// The recording.
        recording: String,
        /// The problem.
        problem: SpectralError,
    },
    /// A channel of the description that its recording does not have, or cannot be told from others, or
    /// cannot be scaled.
    #[error("{file}:{line}: `{key}`: {problem}")]
    Channel {
        /// The description.
        file: String,
        /// Line of the description.
        line: usize,
        /// The key: `sensor[2].channel`.
        key: String,
        /// The problem, with the channels of the recording.
        problem: Box<RecordingError>,
    },
    /// A description without sensors.
    #[error(
        "{file}: the recordings need at least one [[sensor]] with its channel, or there is no response \
         to analyse"
    )]
    NoSensors {
        /// The description.
        file: String,
    },
}
