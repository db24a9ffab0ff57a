//! Fit of poles to free decays or frequency response functions, all taps and sensors together.
//!
//! After the force pulse each response is a sum of decaying oscillations. Its transform over any number of
//! samples is exactly rational on its own lines, even of a truncated record. White noise is independent
//! between those lines. Poles common to all taps and sensors, with a free amplitude in each, are therefore
//! fitted by plain least squares, the maximum of the likelihood. Neither noise of the force nor the ringing
//! from the tap before can bias it.
//!
//! [`fit_modes`] fits mode by mode over a band about each (modes near each other jointly). The standard
//! deviation comes from the noise that remains, or from the scatter of the taps where that is larger. Columns come from a [`FreeDecayCollector`], or are frequency response functions.

mod data;
mod extra_mode;
mod group;
mod modal_constant;
mod mode_fit;
mod sweep;
mod variable_projection;

pub use data::{Basis, Column, FreeDecayCollector, ModalData};
pub use extra_mode::{Accepted, ExtraMode, ExtraVerdict};
pub use group::bands_for;
pub use modal_constant::{ModalConstant, TapForce, modal_constants, modal_constants_of_frf};
pub use mode_fit::{
    ColumnAmplitude, FittedValue, ModeFit, TapFit, UncertaintySource, fit_modes,
    scatter_about_mean, weighted_mean,
};
pub use variable_projection::StopReason;

/// Start of the search for a mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoleStart {
    /// Natural frequency (Hz), within a line or half a half-power width.
    pub frequency: f64,
    /// Damping ratio without a window's own decay; `None` where it is not known.
    pub damping_ratio: Option<f64>,
}

/// Settings of a fit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FitSettings {
    /// Decay that an exponential window added to what is fitted (1/s). 0: free decays are fitted
    /// without a window.
    pub added_decay: f64,
    /// Frequencies of steady lines, mains hum (Hz), to be fitted as such. None.
    pub steady_lines: Vec<f64>,
}

/// Reason why data cannot be fitted at all.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Nothing to fit.
    #[error(
        "a fit needs one column and two lines at least; there are {columns} columns of {lines} lines: add taps, or widen the band"
    )]
    Empty {
        /// Columns.
        columns: usize,
        /// Lines.
        lines: usize,
    },
    /// A column does not fit the axis.
    #[error("column {column} has {values} values for {lines} lines: give one value for each line")]
    Length {
        /// Number of the column, from 0.
        column: usize,
        /// Its values.
        values: usize,
        /// Lines of the axis.
        lines: usize,
    },
    /// A value is no number.
    #[error("column {column} has no finite value on line {line}: leave the tap or the line out")]
    NotFinite {
        /// Number of the column, from 0.
        column: usize,
        /// Index of the line, from 0.
        line: usize,
    },
    /// The axis is none.
    #[error(
        "the lines of a fit must have positive, ascending frequencies and a positive resolution"
    )]
    Axis,
    /// A line of a decay is no multiple of the line spacing.
    #[error(
        "{frequency} Hz is no line of the decays: give multiples of {spacing} Hz below half the sample rate"
    )]
    OffGrid {
        /// Frequency of the line (Hz).
        frequency: f64,
        /// Sample rate over samples (Hz).
        spacing: f64,
    },
    /// A response is shorter than the decays to be transformed.
    #[error(
        "tap {tap}, sensor {sensor}: {samples} samples of decay, {least} are needed: use fewer samples of every decay"
    )]
    Short {
        /// Number of the tap, from 0.
        tap: usize,
        /// Number of the sensor, from 0.
        sensor: usize,
        /// Samples there are.
        samples: usize,
        /// Samples needed.
        least: usize,
    },
}

/// Reason why a start did not become a mode.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unfit {
    /// The start is no possible natural frequency.
    #[error("the start lies outside the frequencies that were measured")]
    OutsideBand,
    /// Fewer lines in the band than the unknowns need.
    #[error("{lines} lines lie in its band, {least} are needed: use longer records")]
    TooFewLines {
        /// Lines in the band.
        lines: usize,
        /// Lines needed.
        least: usize,
    },
    /// Every column is zero in the band.
    #[error("no column holds anything in its band")]
    NoSignal,
    /// Poles or their neighbours cannot be told from each other.
    #[error("it cannot be told from another mode")]
    NotIndependent,
    /// The pole went elsewhere.
    #[error(
        "the pole went to {frequency:.4} Hz, {distance:.4} Hz from its start: no resonance is there"
    )]
    LeftStart {
        /// Frequency of the pole (Hz).
        frequency: f64,
        /// Distance from the start (Hz).
        distance: f64,
    },
    /// The pole grows instead of decaying.
    #[error("the oscillation does not decay")]
    NoDecay,
    /// The standard deviation is as large as a line and the half-power width.
    #[error("its frequency is known to {std:.3} Hz only, less than its line and its width tell")]
    Undetermined {
        /// Standard deviation (Hz).
        std: f64,
    },
    /// The exponential window's decay leaves nothing certain of the mode's own.
    #[error(
        "the window's decay hides its damping: {remaining:.2e} \u{b1} {std:.2e} is left of it; use a longer record and no window"
    )]
    WindowDominates {
        /// Damping ratio that is left.
        remaining: f64,
        /// Its standard deviation.
        std: f64,
    },
}
