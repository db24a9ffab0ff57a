//! Virtual tap tests with a known answer: what a laboratory would record of a described structure.
//!
//! ```text
//! Specimen -> SeenStructure    modes as sensors, hammer and joint see them; what lies beyond as springs
//!          -> Motion           their exact motion in time; a non-linear joint solved for beside it
//!          -> Session          hammer, sensors, recorder: one sample of every channel after the other
//! ```
//!
//! What the diagnosis must not see stays here: the truth is an argument and an output of its own,
//! never a part of the recording.

mod chain;
mod collocation;
mod filters;
mod hammer;
mod joint_moment;
mod joint_motion;
mod laboratory;
mod motion;
mod pulse;
mod reduced;
mod tap_test;

pub use chain::Signal;
pub use hammer::{Tap, TapKind, TapPlan};
pub use joint_moment::{JointMoment, Slider};
pub use laboratory::{
    AntiAlias, Damping, HammerSettings, Laboratory, RecorderSettings, SensorSettings,
    SpecimenSettings, Tip,
};
pub use motion::{Motion, Strike};
pub use pulse::{Pulse, PulseShape};
pub use reduced::{ReducedMode, ReducedStructure, Sensed, StruckPlace};
pub use tap_test::{SimulatedMode, TapTest, TapTestSettings, seen_modes, simulate_tap_test};
