//! Virtual tap tests with a known answer: what a laboratory would record of a described structure.
//!
//! ```text
//! Specimen -> SeenStructure    modes as sensors, hammer and joint see them; what lies beyond as springs
//!          -> Motion           their exact motion in time; a non-linear joint solved for beside it
//!          -> Take          hammer, sensors, recorder: one sample of every channel after the other
//! ```
//!
//! What the diagnosis must not see stays here: the truth is an argument and an output of its own,
//! never a part of the recording.

mod chain;
mod hammer;
mod joint_moment;
mod laboratory;
mod motion;
mod observed_structure;
mod plan;
mod recording_run;
mod truth;

pub use chain::Signal;
pub use hammer::{HammerSettings, Tap, TapKind, TapPlan, Tip};
pub use hammer::{Pulse, PulseShape};
pub use joint_moment::{JointMoment, Slider};
pub use laboratory::SimulateError;
pub use laboratory::{
    AntiAlias, Damping, Laboratory, RecorderSettings, SensorSettings, SpecimenSettings,
};
pub use motion::{Motion, Strike};
pub use observed_structure::GivenJoint;
pub use observed_structure::SeenStructure;
pub use observed_structure::{ReducedMode, ReducedStructure, Sensed, StruckPlace};
pub use plan::{TestPlan, VirtualRecording, VirtualTest, plan_test, wav_name};
pub use recording_run::{SimulatedMode, TapTest, TapTestSettings, seen_modes, simulate_tap_test};
pub use recording_run::{Take, TakePlan};
pub use truth::believed_description;
pub use truth::{JointTruth, LawTruth, ModeTruth, PlantedEffect, RecordingTruth, Truth, truth_of};
