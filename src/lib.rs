//! tapjoint: from hammer taps to joint stiffness.
//!
//! ```text
//!   measurement                                   theory
//!   recording -> taps -> spectral -> modal        structure (beam, joint, finite elements), effects
//!                                      \            /
//!                                       identify  (pairs regression, perturbation)
//!                                          |
//!                                       pipeline -> report
//! ```
//!
//! Each stage is a folder or file of that name, takes plain data and returns plain data.
//! Measurement and theory never import each other; they meet in [`identify`].
//! Symbols and sign conventions: [`notation`]. Sources: [`references`].

pub mod notation;
pub mod references;

pub use tapjoint_analysis as pipeline;
pub use tapjoint_beam as structure;
pub use tapjoint_beam::effects;
pub use tapjoint_description as description;
pub use tapjoint_description::described;
pub use tapjoint_diagnosis as gap;
pub use tapjoint_identify as identify;
pub use tapjoint_numerics::{quantity, stats};
pub use tapjoint_report as report;
pub use tapjoint_signal::{modal, quality, recording, spectral, taps};
pub use tapjoint_simulate as simulate;
pub use tapjoint_study as study;

/// The README's code, compiled so that it stays true.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
