//! Virtual tap tests with a known answer: what a laboratory would record of a described structure.
//!
//! ```text
//! Specimen -> ObservedStructure   modes at sensors, hammer and joint; the modes beyond as springs
//!          -> Motion              their exact motion in time; a non-linear joint solved for beside it
//!          -> RecordingRun        hammer, sensors, recorder: one sample of every channel after the other
//! ```
//!
//! The truth stays here, out of the diagnosis's sight: it is an argument and an output of its own,
//! never a part of the recording.

mod chain;
mod change;
mod hammer;
mod joint_moment;
mod laboratory;
mod motion;
mod observed_structure;
mod plan;
mod recording_run;
mod truth;

pub use chain::Signal;
pub use change::{Change, ScatterTails, SetUpScatter, moved_sensor};
pub use hammer::{HammerSettings, Pulse, PulseShape, Tap, TapKind, TapPlan, Tip};
pub use joint_moment::{JointMoment, Slider};
pub use laboratory::{
    AntiAlias, Damping, Laboratory, RecorderSettings, SensorSettings, SimulateError,
    SpecimenSettings,
};
pub use motion::{Motion, Strike};
pub use observed_structure::{
    ObservedStructure, ReducedMode, ReducedStructure, Sensed, StruckPlace,
};
pub use plan::{MOST_RATE, TestPlan, VirtualRecording, VirtualTest, plan_test, wav_name};
pub use recording_run::{
    RecordingPlan, RecordingRun, SimulatedMode, TapTest, TapTestSettings, add_noise, below,
    observed_modes, simulate_tap_test,
};
pub use truth::{
    JointTruth, LawTruth, ModeTruth, PlantedEffect, RecordingTruth, Truth, nominal_description,
    truth_of,
};
