//! The test description, `test.toml`: one file describes one tested structure.
//!
//! [`TestDescription::parse`] takes text and returns validated data in SI units. It opens no files: the caller reads
//! them. A [`DescriptionError`] names the line, the key, the allowed values and the nearest known key.

mod fastened;
mod free_test;
mod keys;
mod parse;
mod property;
mod reader;
mod recordings;
mod sheet;
mod structure;
mod template;
mod tolerance;

pub use free_test::FreeTestFile;
pub use parse::{ChannelRefError, READINGS, SELECTIONS, WINDOWS};
pub use reader::DescriptionError;
pub use recordings::{FORMS, OVERLOADS, SENSOR_KINDS};
use schemars::JsonSchema;
use serde::Serialize;
pub use sheet::SheetDescription;
pub use structure::{ASSEMBLIES, coupling, described_beam, described_specimen, lap_layout};
pub use tapjoint_beam::specimen::{LapOverlap, PointMass};
pub use tapjoint_beam::{Assembly, BeamTheory};
pub use tapjoint_signal::modal::ReadBy;
pub use tapjoint_signal::recording::{ResponseForm, ValueColumns, VariableRole, Variables};
pub use tapjoint_signal::taps::TapsByHand;
pub use template::{
    FoundChannel, FoundContent, FoundRecording, runnable_template, template, template_of,
};
pub use tolerance::{BeamTolerance, FreeFrequencies, StandardUncertainty, WeighedMass};

use std::collections::BTreeMap;
use std::path::PathBuf;

/// A tested structure, how it was instrumented, and which recordings belong to it.
#[derive(Debug, Clone, PartialEq)]
pub struct TestDescription {
    /// Name of the test.
    pub name: String,
    /// The beam.
    pub beam: BeamDescription,
    /// The joint that holds it.
    pub joint: JointDescription,
    /// The hammer; `None` for a test that measures responses alone.
    pub hammer: Option<HammerDescription>,
    /// The sensors, in the order of the file.
    pub sensors: Vec<SensorDescription>,
    /// Recordings that give the natural frequencies.
    pub recordings: Vec<RecordingDescription>,
    /// Natural frequencies read elsewhere, instead of recordings.
    pub measured: Option<MeasuredFrequencies>,
    /// Settings of the analysis.
    pub analysis: AnalysisDescription,
    /// Effects of the model, for predictions and virtual tests.
    pub effects: Vec<EffectDescription>,
    /// What is filed with the test.
    pub sheet: SheetDescription,
    /// Doubtful values that can still be used, in the order of reading.
    pub warnings: Vec<DescriptionError>,
}

impl TestDescription {
    /// Returns the free lengths (m) of the recordings where the clamp was moved, in the order of the file.
    pub fn moved_lengths(&self) -> Vec<f64> {
        let mut lengths = Vec::new();
        for length in self.recordings.iter().filter_map(|one| one.length) {
            if !lengths.contains(&length) {
                lengths.push(length);
            }
        }
        lengths
    }

    /// Returns the test with the recordings of one free length (m); `None` is that of the beam. This is the beam's own
    /// length there.
    #[must_use]
    pub fn of_length(&self, length: Option<f64>) -> Self {
        let mut own = self.clone();
        own.beam.length = length.unwrap_or(self.beam.length);
        own.recordings
            .retain(|recording| recording.length == length);
        for recording in &mut own.recordings {
            recording.length = None;
        }
        own
    }

    /// Returns the first recording in which the clamp was not moved.
    pub fn reference_recording(&self) -> Option<&RecordingDescription> {
        self.recordings.iter().find(|one| one.length.is_none())
    }
}

/// An effect of an updated model.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectDescription {
    /// Name of the effect.
    pub id: String,
    /// Parameters (SI) by name; the others keep their typical values.
    pub values: BTreeMap<String, f64>,
    /// Line of the table.
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
    /// Standard uncertainties of these properties.
    pub tolerance: BeamTolerance,
    /// Length (m) of the whole bar as weighed and tested free, a clamped part included; `None` = `length`.
    pub bar_length: Option<f64>,
    /// The bare bar on a balance; `None` when the file is silent.
    pub weighed: Option<WeighedMass>,
    /// False where the density follows from the weight alone.
    pub density_stated: bool,
    /// Frequencies of the whole bar without its joint; `None` when the file is silent.
    pub free: Option<FreeFrequencies>,
    /// The description of the whole bar's test without its joint; `None` when the file is silent.
    pub free_test: Option<FreeTestFile>,
}

/// Number of stiffnesses that describe the joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub enum JointModel {
    /// Translation and rotation.
    #[serde(rename = "2p")]
    TwoParameter,
    /// Translation, rotation and their coupling.
    #[serde(rename = "3p")]
    ThreeParameter,
}

/// The joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointDescription {
    /// Cantilever, lap joint or free beam.
    pub kind: Assembly,
    /// Two or three stiffnesses; ignored for a free beam.
    pub model: JointModel,
    /// Translational stiffness (N/m) when known, which is compared instead of fitted; infinite when rigid.
    pub kt: Option<f64>,
    /// Rotational stiffness (N m/rad) when known; infinite when rigid.
    pub kr: Option<f64>,
    /// Cross-coupling stiffness (N/rad) when known; infinite without coupling.
    pub ktr: Option<f64>,
    /// Beam theory of the predicting model.
    pub beam: BeamTheory,
    /// Place of a lap joint (m from the left end); `None` = the middle.
    pub position: Option<f64>,
    /// Overlapping piece of a lap joint.
    pub overlap: Option<LapOverlap>,
    /// Properties of a lap joint's right half, where they differ.
    pub right: Option<RightHalf>,
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

/// A channel of a recording, by number or by name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChannelRef {
    /// 1-based, not counting a time column.
    Number(usize),
    /// Name of a CSV column, without its unit.
    Name(String),
}

/// Place in the description that names a channel, for messages about recordings without this channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelPlace {
    /// Line, counted from 1.
    pub line: usize,
    /// Key: `sensor[2].channel`, or `sensor[2].name` where the name alone gives the channel.
    pub key: String,
}

/// Factor of a channel's signal.
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
    /// Channel of the force.
    pub channel: ChannelRef,
    /// Place in the description that names the channel.
    pub place: ChannelPlace,
    /// Newtons per unit of the file (integer WAV: full scale = 1); `None` when the file does not
    /// say, so that a unit in a CSV header may decide (else 1).
    pub scale: Option<Scale>,
    /// Make, type and serial number; `None` when not given.
    pub instrument: Option<String>,
}

/// What a file of functions holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FunctionForm {
    /// Frequency response functions of this form.
    Response(ResponseForm),
    /// Spectra: magnitudes without a phase and without a force.
    Spectrum,
}

/// Quantity that a sensor measures.
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
    /// Name of the sensor.
    pub name: String,
    /// Channel of the signal; by default the column with the sensor's name.
    pub channel: ChannelRef,
    /// Place in the description that names the channel.
    pub place: ChannelPlace,
    /// SI units per unit of the file, negative when mounted the other way; `None` when not given.
    pub scale: Option<Scale>,
    /// Position along the beam (m); `None` for a microphone, or when unknown.
    pub position: Option<f64>,
    /// Mass (kg), where the data sheet is known.
    pub mass: Option<f64>,
    /// Quantity that it measures.
    pub kind: SensorKind,
    /// Make, type and serial number; `None` when not given.
    pub instrument: Option<String>,
}

/// One recording of the test.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingDescription {
    /// File as written in the description, relative to it.
    pub file: PathBuf,
    /// Frequencies (Hz) of the modes that were chosen by hand for this recording, ascending; `None` = those of the analysis.
    pub poles: Option<Vec<f64>>,
    /// Name for tables in place of the files, where a recording is played into others; `None` = that of the files. No key
    /// gives it.
    pub shown_as: Option<String>,
    /// Further files of the same set-up, which follow it.
    pub more_files: Vec<PathBuf>,
    /// Frames of the last file that are read, while it goes on growing; `None` = all. No key gives it.
    pub frames: Option<u64>,
    /// Line of the description that names the file.
    pub line: usize,
    /// Free length (m) of the beam in this recording, where the clamp was moved; `None` where it is that of the beam.
    pub length: Option<f64>,
    /// Position of the hammer's taps (m).
    pub tap: Option<f64>,
    /// Force of the taps, relative to the test's other recordings (1). The simulator follows it. The
    /// analysis measures the force instead.
    pub level: Option<f64>,
    /// Zoom band (Hz).
    pub band: Option<(f64, f64)>,
    /// Block size (samples).
    pub block: Option<usize>,
    /// Sensors moved for this recording: name to position (m).
    pub at: BTreeMap<String, f64>,
    /// Known masses fastened to the beam for this recording, in the order of the file.
    pub masses: Vec<PointMass>,
    /// Names of these masses, in the same order; `None` for one without a name.
    pub mass_names: Vec<Option<String>>,
    /// Sample rate (Hz) of a CSV file without a time column.
    pub sample_rate: Option<f64>,
    /// Unit of the time column (s) where its heading does not name it.
    pub time_unit: Option<f64>,
    /// Given when the file holds functions of frequency instead of time series.
    pub form: Option<FunctionForm>,
    /// Columns of the values of such a file.
    pub values: Option<ValueColumns>,
    /// Variables of a MATLAB file.
    pub variables: Variables,
    /// The sensor of such a file.
    pub sensor: Option<String>,
    /// True if taps that drove a channel to its limit are used from where their decays are whole.
    pub keep_overload: bool,
    /// Taps that are used whatever their faults, and taps that are left out. Times are in order. None of one list is within
    /// 0.1 s of one of the other.
    pub by_hand: TapsByHand,
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
    /// File of modes that gives the frequencies; `None` where the description lists them.
    pub file: Option<ModeFile>,
    /// Natural frequencies (Hz), ascending; empty where a file gives them.
    pub frequencies: Vec<f64>,
    /// Mode numbers of these frequencies, ascending; empty where those of a file are not stated.
    pub modes: Vec<usize>,
    /// Half-line bounds (Hz), one for each frequency; of a file also one for all.
    pub half_line: Option<Vec<f64>>,
    /// Standard deviations (Hz), one for each frequency; of a file also one for all.
    pub std: Option<Vec<f64>>,
    /// Repeatability, relative: std^2 = half_line^2/3 + (scatter f)^2.
    pub scatter: Option<f64>,
}

/// A file of modes.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeFile {
    /// File as written in the description, relative to it.
    pub path: PathBuf,
    /// Line of the description that names the file.
    pub line: usize,
    /// Lines of the keys of `[measured]` that the file is compared with.
    pub key_lines: BTreeMap<&'static str, usize>,
    /// The node that begins the line of nodes, where it is stated.
    pub first_node: Option<FirstNode>,
}

/// The node of a file of modes that is nearest to the joint, or to the left end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstNode {
    /// Number of the node in the file.
    pub number: i64,
    /// Its position along the beam (m).
    pub position: f64,
}

/// Window over a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WindowKind {
    /// None.
    Rectangular,
    /// Hann; for steady signals, not for taps.
    Hann,
    /// e^{-at} on force and response alike.
    Exponential,
}

/// Weights of the frequencies in an estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weights {
    /// By their measured uncertainty.
    Measured,
    /// Equal relative weights.
    Relative,
}

/// A quantity that an estimate can determine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FitParameter {
    /// Translational stiffness.
    Kt,
    /// Rotational stiffness.
    Kr,
    /// Cross-coupling stiffness.
    Ktr,
    /// Young's modulus.
    Modulus,
    /// Density.
    Density,
}

/// Choice among the taps that count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TapSelection {
    /// All of them.
    #[default]
    All,
    /// Those whose responses agree with each other.
    Consistent,
}

/// Settings of the analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct AnalysisDescription {
    /// Window; `None` = chosen from the decay in the record.
    pub window: Option<WindowKind>,
    /// Way of reading natural frequencies.
    pub reading: ReadBy,
    /// Choice among the taps that count.
    pub select: TapSelection,
    /// The first so many modes enter the estimate; `None` = all.
    pub fit_modes: Option<usize>,
    /// Frequencies (Hz) of the modes that were chosen by hand, ascending; empty where the program chooses.
    pub poles: Vec<f64>,
    /// Weights of the frequencies; `None` = measured where bounds are known.
    pub weights: Option<Weights>,
    /// The sensors' masses enter the nominal model.
    pub sensor_mass: bool,
    /// Estimated quantities; `None` = the joint model's stiffnesses, of a free beam the modulus.
    pub fit: Option<Vec<FitParameter>>,
}
