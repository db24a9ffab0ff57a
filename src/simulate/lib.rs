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

mod believed;
mod chain;
mod check;
mod collocation;
mod error;
mod filters;
mod hammer;
mod joint_moment;
mod joint_motion;
mod laboratory;
mod motion;
mod nominal;
mod plan;
mod pulse;
mod reduced;
mod seen;
mod take;
mod tap_test;
mod trial;
mod truth;

pub use believed::believed_description;
pub use chain::Signal;
pub use error::SimulateError;
pub use hammer::{Tap, TapKind, TapPlan};
pub use joint_moment::{JointMoment, Slider};
pub use laboratory::{
    AntiAlias, Damping, HammerSettings, Laboratory, RecorderSettings, SensorSettings,
    SpecimenSettings, Tip,
};
pub use motion::{Motion, Strike};
pub use nominal::GivenJoint;
pub use plan::{TestPlan, VirtualRecording, VirtualTest, plan_test, wav_name};
pub use pulse::{Pulse, PulseShape};
pub use reduced::{ReducedMode, ReducedStructure, Sensed, StruckPlace};
pub use seen::SeenStructure;
pub use take::{Take, TakePlan};
pub use tap_test::{SimulatedMode, TapTest, TapTestSettings, seen_modes, simulate_tap_test};
pub use truth::{JointTruth, LawTruth, ModeTruth, PlantedEffect, RecordingTruth, Truth, truth_of};
