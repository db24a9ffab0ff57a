//! What the chain leaves: plain data, for the report and for callers.

use super::amplitude::AmplitudeChange;
use super::measure::{MeasureError, Measurement};
use super::structure::TestedStructure;
use super::warning::Warning;
use serde::Serialize;
use std::collections::BTreeMap;
use tapjoint_beam::specimen::{PointMass, Specimen};
use tapjoint_beam::{Beam, JointStiffness};
use tapjoint_identify::consistent::ConsistentEstimate;
use tapjoint_identify::observation::UNPAIRED;
use tapjoint_identify::perturbation::{ModeSensitivity, SignPatternSpans, UniformPerturbation};
use tapjoint_identify::{FreeBeamEstimate, JointEstimate, MonteCarlo, PredictedMode, Stiffnesses};
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
    /// Of each recording how it differs from the first, "8.8 times its tap level", so that modes and estimate leave
    /// it out; `None` where they do not.
    pub aside: Vec<Option<String>>,
    /// Resonances of the reference configuration, ascending: the first recording and all others
    /// with its sensor positions and tap level.
    pub modes: Vec<ModeResult>,
    /// What the modes say about the joint; `None` for a bare recording.
    pub identification: Option<Identification>,
    /// How well the test was made: good practice, check by check.
    pub verdicts: Vec<Verdict>,
    /// What a reader has to know.
    pub warnings: Vec<Warning>,
}

/// Which estimate is the main one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EstimateMethod {
    /// Least squares on the frequencies themselves, the closed form beside it.
    #[default]
    Consistent,
    /// The closed form alone: the pair regression, or of a free beam its modulus.
    Pairs,
}

impl EstimateMethod {
    /// Both methods.
    pub const ALL: [Self; 2] = [Self::Consistent, Self::Pairs];

    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Consistent => "consistent",
            Self::Pairs => "pairs",
        }
    }
}

/// One recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingResult {
    /// File as the description names it.
    pub file: String,
    /// What kind of file it is.
    pub format: Format,
    /// Sample rate (Hz); `None` of frequency response functions from a file.
    pub sample_rate: Option<f64>,
    /// Length (s); `None` of frequency response functions from a file.
    pub seconds: Option<f64>,
    /// Every channel in the file.
    pub channels: Vec<ChannelInfo>,
    /// Whether there is a hammer channel.
    pub has_hammer: bool,
    /// Unit of the taps' peaks: the hammer's, or without one that of all responses; `None` where
    /// nobody said or they differ.
    pub tap_unit: Option<String>,
    /// The responses analysed.
    pub responses: Vec<Response>,
    /// The analysed zoom band (Hz), where one was asked for.
    pub band: Option<(f64, f64)>,
    /// What the description says of this recording; empty for a bare one.
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
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Conditions {
    /// Where the hammer strikes (m).
    pub tap: Option<f64>,
    /// Where each sensor sits (m), moved ones at their place in this recording.
    pub sensor_positions: BTreeMap<String, f64>,
    /// What each sensor weighs (kg), of those whose mass is stated.
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
    /// What it senses; `None` where nobody said.
    pub kind: Option<tapjoint_description::SensorKind>,
    /// The unit of its values; `None` where nobody said.
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
    /// How far it scatters between the recordings that were merged; `None` of one recording.
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
    /// Whether there is an estimate by any method.
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

    /// Whether predictions take in what is fastened to the beam and a lap joint's unequal halves: a
    /// closed form that was estimated without them has their effect in its stiffnesses already.
    pub fn predicts_with_details(&self, structure: &TestedStructure) -> bool {
        self.consistent.is_some() || structure.known.over(None).is_some()
    }
}

/// What the modes say about joint or material.
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
    /// How errors in the frequencies move the estimate, by each method that has one.
    pub perturbations: Vec<Perturbation>,
}

/// An estimate in closed form.
#[derive(Debug, Clone, PartialEq)]
pub enum Estimate {
    /// A joint, by the pair regression.
    Joint(Box<JointEstimate>),
    /// A free beam's material.
    FreeBeam(FreeBeamEstimate),
}

/// How errors in the frequencies move the joint's estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Perturbation {
    /// By which method it was estimated.
    pub method: EstimateMethod,
    /// All frequencies up and down by a percentage.
    pub uniform: Vec<UniformPerturbation>,
    /// Average errors of the percentages as Ingole & Chatterjee state them.
    pub averages: Vec<tapjoint_identify::perturbation::AverageError>,
    /// Under each mode's own bound; `None` where no bounds are known.
    pub bounds: Option<BoundPerturbation>,
    /// Under random errors; `None` where no standard deviations are known, or none was asked for.
    pub random: Option<MonteCarlo>,
}

/// The estimate under the bounds of the readings.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundPerturbation {
    /// Mode numbers.
    pub modes: Vec<usize>,
    /// Bound of each (Hz).
    pub bounds: Vec<f64>,
    /// Spans over all sign patterns; `None` for more modes than can be tried.
    pub spans: Option<SignPatternSpans>,
    /// All estimates over the patterns.
    pub cloud: Vec<Stiffnesses>,
    /// Which mode drives which parameter.
    pub sensitivities: Vec<ModeSensitivity>,
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
    /// What the readings' own standard uncertainties make of that, over the same (1).
    pub own: f64,
    /// Recordings less one.
    pub freedom: usize,
}

impl RecordingResult {
    /// Its own readings of resonances, ascending; none without spectra.
    pub fn readings(&self) -> &[ModeReading] {
        let spectra = self.measurement.spectra.as_ref();
        spectra.map_or(&[], |spectra| &spectra.readings)
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

/// What stops an analysis.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// A recording could not be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A recording could not be measured.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// A band that does not fit a file of frequency response functions.
    #[error("{file}: {problem}")]
    Functions {
        /// The recording.
        file: String,
        /// What does not fit.
        problem: SpectralError,
    },
    /// A band or block of the description that does not fit its recording.
    #[error("{file}:{line}: {recording}: {problem}")]
    Setting {
        /// The description.
        file: String,
        /// Its line.
        line: usize,
        /// The recording.
        recording: String,
        /// What does not fit.
        problem: SpectralError,
    },
    /// A channel of the description that its recording does not have, or cannot be told from others, or
    /// cannot be scaled.
    #[error("{file}:{line}: `{key}`: {problem}")]
    Channel {
        /// The description.
        file: String,
        /// Its line.
        line: usize,
        /// The key: `sensor[2].channel`.
        key: String,
        /// What the recording has instead.
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
