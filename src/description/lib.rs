//! The test description, `test.toml`: one file describes one tested structure.
//!
//! [`TestDescription::parse`] takes text (the caller reads the file) and returns validated data in
//! SI units, or a [`DescriptionError`] that names the line, the key, what is allowed and the
//! nearest known key. It opens no files.

mod analysis;
pub mod described;
mod error;
mod keys;
mod parse;
mod reader;
mod recordings;
mod sensors;
mod structure;
mod template;

pub use analysis::{AnalysisDescription, FitParameter, Weights, WindowKind};
pub use error::{DescriptionError, DescriptionProblem, DescriptionWarning, Doubt, Suggestion};
pub use parse::ChannelRefError;
use schemars::JsonSchema;
use serde::Serialize;
pub use tapjoint_beam::BeamTheory;
pub use tapjoint_signal::modal::ReadBy;
pub use template::{runnable_template, template, template_of};

use std::collections::BTreeMap;
use std::path::PathBuf;

/// A tested structure, how it was instrumented, and which recordings belong to it.
#[derive(Debug, Clone, PartialEq)]
pub struct TestDescription {
    /// What the test is called.
    pub name: String,
    /// The beam.
    pub beam: BeamDescription,
    /// The joint that holds it.
    pub joint: JointDescription,
    /// The hammer's channel; `None` for response-only tests.
    pub hammer: Option<HammerDescription>,
    /// The sensors, in the order of the file.
    pub sensors: Vec<SensorDescription>,
    /// Where the natural frequencies come from.
    pub recordings: Vec<RecordingDescription>,
    /// Frequencies read elsewhere, instead of recordings.
    pub measured: Option<MeasuredFrequencies>,
    /// How to analyse.
    pub analysis: AnalysisDescription,
    /// What the model has besides: to predict and to simulate with.
    pub effects: Vec<EffectDescription>,
    /// What is odd but usable, in the order of reading.
    pub warnings: Vec<DescriptionWarning>,
}

/// An effect of a model that was brought up to date.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectDescription {
    /// Its name.
    pub id: String,
    /// Its parameters (SI) by name; the others are typical.
    pub values: BTreeMap<String, f64>,
    /// Line of its table.
    pub line: usize,
}

/// A uniform beam of rectangular cross-section, bending in the direction of its thickness.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamDescription {
    /// Length (m); of a lap joint: both halves together.
    pub length: f64,
    /// Width (m).
    pub width: f64,
    /// Thickness (m), in the direction of vibration.
    pub thickness: f64,
    /// Young's modulus (Pa).
    pub modulus: f64,
    /// Density (kg/m3).
    pub density: f64,
    /// Poisson's ratio; `None` when the file is silent (0.3 is then assumed).
    pub poisson: Option<f64>,
    /// Standard uncertainties of the above.
    pub tolerance: BeamTolerance,
}

/// Standard uncertainties of a beam's properties, where stated. Absolute, SI.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BeamTolerance {
    /// Of the length (m).
    pub length: Option<f64>,
    /// Of the width (m).
    pub width: Option<f64>,
    /// Of the thickness (m).
    pub thickness: Option<f64>,
    /// Of Young's modulus (Pa).
    pub modulus: Option<f64>,
    /// Of the density (kg/m3).
    pub density: Option<f64>,
}

/// What kind of structure it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// A beam held at one end.
    Cantilever,
    /// Two beams joined end to end by a lap joint, free otherwise.
    Lap,
    /// A free beam: no joint.
    Free,
}

/// How many stiffnesses describe the joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub enum JointModel {
    /// Translation and rotation.
    #[serde(rename = "2p")]
    TwoParameter,
    /// Translation, rotation and their coupling.
    #[serde(rename = "3p")]
    ThreeParameter,
}

/// A joint stiffness that is known and compared instead of fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KnownStiffness {
    /// A finite value (N/m, N m/rad or N/rad).
    Value(f64),
    /// Held without give.
    Rigid,
}

/// The joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointDescription {
    /// Cantilever, lap joint or free beam.
    pub kind: JointKind,
    /// Two or three stiffnesses; of no meaning for a free beam.
    pub model: JointModel,
    /// Translational stiffness (N/m), when known.
    pub kt: Option<KnownStiffness>,
    /// Rotational stiffness (N m/rad), when known.
    pub kr: Option<KnownStiffness>,
    /// Cross-coupling stiffness (N/rad), when known.
    pub ktr: Option<KnownStiffness>,
    /// Beam theory of the predicting model.
    pub beam: BeamTheory,
    /// Lap joint: where it sits (m from the left end); `None` = the middle.
    pub position: Option<f64>,
    /// Lap joint: overlapping piece.
    pub overlap: Option<Overlap>,
    /// Lap joint: properties of the right half where they differ.
    pub right: Option<RightHalf>,
}

/// The overlapping piece of a lap joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// Length of the overlap (m).
    pub length: f64,
    /// Mass added by overlap and bolts (kg).
    pub mass: f64,
}

/// Properties of a lap joint's right half that differ from the left one's.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RightHalf {
    /// Width (m).
    pub width: Option<f64>,
    /// Thickness (m).
    pub thickness: Option<f64>,
    /// Young's modulus (Pa).
    pub modulus: Option<f64>,
    /// Density (kg/m3).
    pub density: Option<f64>,
    /// Poisson's ratio.
    pub poisson: Option<f64>,
}

/// Which channel of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChannelRef {
    /// 1-based, not counting a time column.
    Number(usize),
    /// Name of a CSV column, without its unit.
    Name(String),
}

/// Where a description names a channel, for messages about recordings that do not have it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelPlace {
    /// Its line, counted from 1.
    pub line: usize,
    /// Its key: `sensor[2].channel`; `sensor[2].name` where the name alone says it.
    pub key: String,
}

/// What a channel's signal is multiplied by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// SI units per unit of the file, whatever unit a header names.
    PerUnit(f64),
    /// SI units per volt, from a sensitivity: a header's mV still count as millivolts.
    PerVolt(f64),
}

/// The impact hammer.
#[derive(Debug, Clone, PartialEq)]
pub struct HammerDescription {
    /// Where its signal is.
    pub channel: ChannelRef,
    /// Where that is said.
    pub place: ChannelPlace,
    /// Newtons per unit of the file (integer WAV: full scale = 1); `None` when the file does not
    /// say, so that a unit in a CSV header may decide (else 1).
    pub scale: Option<Scale>,
}

/// What a sensor senses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorKind {
    /// Acceleration (m/s2).
    Acceleration,
    /// Velocity (m/s).
    Velocity,
    /// Displacement (m).
    Displacement,
    /// Sound pressure (Pa).
    Sound,
}

/// A response sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorDescription {
    /// Its name.
    pub name: String,
    /// Where its signal is; when the file is silent, the column of the sensor's name.
    pub channel: ChannelRef,
    /// Where that is said.
    pub place: ChannelPlace,
    /// SI units per unit of the file, negative when mounted the other way; `None` when not given.
    pub scale: Option<Scale>,
    /// Where it sits (m); `None` for a microphone, or when unknown (it then has no mass either).
    pub position: Option<f64>,
    /// Its mass (kg), where the data sheet is known.
    pub mass: Option<f64>,
    /// What it senses.
    pub kind: SensorKind,
}

/// Form of a frequency response function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrfForm {
    /// Acceleration per force.
    Accelerance,
    /// Velocity per force.
    Mobility,
    /// Displacement per force.
    Receptance,
}

/// A known mass that is fastened to the beam for one recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FastenedMass {
    /// Where it sits (m).
    pub position: f64,
    /// What it weighs (kg).
    pub mass: f64,
}

/// One recording of the test.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingDescription {
    /// File as written in the description, relative to it.
    pub file: PathBuf,
    /// Line of the description that names the file.
    pub line: usize,
    /// Where the hammer strikes (m).
    pub tap: Option<f64>,
    /// How hard it is struck, relative to the test's other recordings (1): the simulator follows it, the
    /// analysis measures it.
    pub level: Option<f64>,
    /// Zoom band (Hz).
    pub band: Option<(f64, f64)>,
    /// Block size (samples).
    pub block: Option<usize>,
    /// Sensors moved for this recording: name to position (m).
    pub at: BTreeMap<String, f64>,
    /// Known masses fastened to the beam for this recording, in the order of the file.
    pub masses: Vec<FastenedMass>,
    /// Sample rate (Hz) of a CSV file without a time column.
    pub sample_rate: Option<f64>,
    /// Given when the file holds frequency response functions instead of time series.
    pub form: Option<FrfForm>,
    /// The sensor such a file belongs to.
    pub sensor: Option<String>,
    /// Carried to the outputs: tightening torque (N m).
    pub torque: Option<f64>,
    /// Carried to the outputs: temperature (degrees Celsius).
    pub temperature: Option<f64>,
    /// Carried to the outputs.
    pub date: Option<String>,
}

/// Natural frequencies read elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredFrequencies {
    /// Natural frequencies (Hz), ascending.
    pub frequencies: Vec<f64>,
    /// Mode numbers of these frequencies, ascending.
    pub modes: Vec<usize>,
    /// Half-line bounds (Hz), one for each frequency.
    pub half_line: Option<Vec<f64>>,
    /// Standard deviations (Hz), one for each frequency.
    pub std: Option<Vec<f64>>,
    /// Repeatability, relative: std^2 = half_line^2/3 + (scatter f)^2.
    pub scatter: Option<f64>,
}
