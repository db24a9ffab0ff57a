//! From spectra to natural frequencies, each with the bound of its reading.
//!
//! Peaks are found on a composite level over all sensors ([`find_peaks`]), read between the lines by
//! a pole ([`interpolate_pole`]) and on the line nearest to that, with the half-line bound
//! ([`read_peaks`]); mains lines are recognised, and the readings of several recordings are merged
//! ([`merge_modes`]).
//!
//! [`polyreference`] finds the poles of a whole band from several responses at once, also where two
//! modes show as one peak; [`matrix_pencil`] does so for free decays in the time domain; [`fit`] refines
//! poles to the greatest likelihood and says how well they are known; [`amplitude`] follows frequency and
//! damping along a decay.

pub mod amplitude;
pub mod fit;
pub mod matrix_pencil;
mod mode;
mod peaks;
pub mod polyreference;
mod projection;
mod reading;

pub use mode::{
    BandReadings, FittedReading, MergedMode, ModeReading, PeakLabel, ReadBy, merge_modes,
};
pub use peaks::{
    CompositeLevel, LineAmplitudes, MainsSettings, Peak, PeakSettings, find_peaks, mains_harmonic,
    near_mains,
};
pub use reading::{Interpolation, Unfit, interpolate_parabola, interpolate_pole, read_peaks};

/// Writes a number that counts from 0 as one that counts from 1.
fn from_one<S: serde::Serializer>(index: &usize, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_u64(*index as u64 + 1)
}
