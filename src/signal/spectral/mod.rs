//! From tap records to spectra and frequency response functions on a stated frequency axis.
//!
//! A spectrum carries its [`Lines`]: the frequencies at which it was computed and, separately, the
//! length of signal it was computed from. Resolution is 1/(length of signal); zooming or zero
//! padding adds lines, never resolution.

mod average;
mod lines;
mod transform;
mod window;

pub use average::{
    AveragedSpectra, FrfEstimator, LinePowers, LineQuality, SpectralAverager, TapRecord,
    average_records, random_error,
};
pub use lines::{DISPLAY_RATIO, Lines, largest_smooth_block, smallest_smooth_block};
pub(crate) use transform::{Decimator, bessel_i0, kaiser_beta};
pub use transform::{Transformer, Workspace, band_limited, chirp_z, transform_block};
pub use window::{
    DecayCheck, RUNG_DOWN, Window, apply_force_window, choose_window, exponential_to,
    line_amplitude, measure_decay, noise_beside, noise_power,
};

/// What makes a spectrum impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpectralError {
    /// The band does not fit the sample rate.
    #[error(
        "the band {low} to {high} Hz does not fit a sample rate of {sample_rate} Hz: its upper end must lie above its lower end and not above {limit} Hz (half the sample rate)"
    )]
    Band {
        /// Lower end (Hz).
        low: f64,
        /// Upper end (Hz).
        high: f64,
        /// Sample rate (Hz).
        sample_rate: f64,
        /// Highest possible upper end (Hz).
        limit: f64,
    },
    /// The band holds fewer resolution widths than a spectrum needs lines.
    #[error(
        "the band {low} to {high} Hz is too narrow for {seconds:.3} s of signal: what that resolves are lines {resolution:.3} Hz apart; give a band of at least {least_width:.3} Hz, or set the taps farther apart"
    )]
    TooNarrow {
        /// Lower end (Hz).
        low: f64,
        /// Upper end (Hz).
        high: f64,
        /// Length of signal (s).
        seconds: f64,
        /// 1/seconds (Hz).
        resolution: f64,
        /// Least width of a band (Hz).
        least_width: f64,
    },
    /// The block size is unusable.
    #[error("a block of {block} samples is not usable: give {least} to {most} samples")]
    Block {
        /// Block size as given (samples).
        block: usize,
        /// Smallest possible.
        least: usize,
        /// Largest possible.
        most: usize,
    },
}

/// Smallest block (samples): fewer displayed lines than six show no resonance.
pub const LEAST_BLOCK: usize = 16;
/// Largest block (samples): a bound on memory (64 MB a channel), 78 s at 51.2 kHz.
pub const MOST_BLOCK: usize = 4_000_000;
