//! Measurement: recordings, taps, spectra, modes and their quality. Knows no beam.

pub mod modal;
pub mod quality;
// Recordings are read from files; nothing else below the command line touches them.
#[allow(clippy::disallowed_types, clippy::disallowed_methods)]
pub mod recording;
pub mod spectral;
pub mod taps;
