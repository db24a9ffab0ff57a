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

pub mod description;
pub mod quantity;
pub mod stats;

pub mod modal;
pub mod quality;
pub mod recording;
pub mod spectral;
pub mod taps;

pub mod identify;
pub mod structure;

pub mod effects;
pub mod gap;

pub mod described;
pub mod pipeline;
pub mod report;
pub mod simulate;
pub mod study;

/// The README's code, compiled so that it stays true.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
