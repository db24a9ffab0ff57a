//! From tap records to spectra and frequency response functions on a stated frequency axis.
//!
//! A spectrum carries its [`Lines`]: the frequencies at which it was computed and, separately, the
//! length of signal it was computed from. Resolution is 1/(length of signal); zooming or zero
//! padding adds lines, never resolution.

mod average;
mod thinning;
mod transform;
mod window;

pub use average::{
    AveragedSpectra, FrfEstimator, LinePowers, LineQuality, SpectralAverager, TapRecord,
    average_records, random_error,
};
pub use thinning::Thinning;
pub(crate) use transform::kaiser_beta;
pub use transform::{BandLimiter, Transformer, Workspace, transform_block};
pub(crate) use window::line_amplitudes;
pub use window::{
    DecayCheck, RUNG_DOWN, Window, apply_force_window, choose_window, exponential_to,
    line_and_noise, measure_decay, noise_power,
};

/// Reason why a spectrum is impossible.
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
        "the band {low} to {high} Hz is too narrow: {seconds:.3} s of signal resolve {resolution:.3} Hz; give a band of at least {least_width:.3} Hz, or leave more time between taps"
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
    /// The block is much longer than the signal.
    #[error(
        "a block of {block} samples spans {wanted:.3} s of the band, but the signal lasts {seconds:.3} s: the rest would be zeros, which add lines and no resolution; give at most {most} samples ({MOST_PADDING} times the signal)"
    )]
    Padded {
        /// Block size as given (samples).
        block: usize,
        /// Time that it spans (s).
        wanted: f64,
        /// Length of signal (s).
        seconds: f64,
        /// Largest possible block.
        most: usize,
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
/// Largest block (samples): a bound on time and memory, 20 s at 51.2 kHz. A zoom band takes longer signals.
pub const MOST_BLOCK: usize = 1 << 20;
/// Largest block in lengths of the signal. Zeros beyond cost time and memory, and show nothing more.
pub const MOST_PADDING: usize = 16;

/// Ratio of sample rate to displayed bandwidth: analysers show N/2.56 lines of a block of N.
pub const DISPLAY_RATIO: f64 = 2.56;

/// Equally spaced spectral lines over a band, with the length of signal behind them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lines {
    /// Frequency of the first line (Hz).
    pub low: f64,
    /// End of the displayed band (Hz).
    pub high: f64,
    /// Distance between lines (Hz): 2.56 (high - low)/block.
    pub spacing: f64,
    /// Block size (real samples at the zoomed rate 2.56 (high - low)).
    pub block: usize,
    /// Length of signal actually used, T (s); at most block/(2.56 (high - low)).
    pub duration: f64,
}

impl Lines {
    /// Lines of a zoom band, low and high end (Hz), with `block` real samples at the zoomed rate.
    ///
    /// Without zoom the band is 0 to rate/2.56. `available` is the length of signal at hand (s).
    ///
    /// # Errors
    /// [`SpectralError::Band`] where the band is empty or passes half the sample rate,
    /// [`SpectralError::Block`] for a block outside [`LEAST_BLOCK`] to [`MOST_BLOCK`] samples,
    /// [`SpectralError::TooNarrow`] where the signal resolves fewer than six lines of the band,
    /// [`SpectralError::Padded`] for a block longer than [`MOST_PADDING`] times the signal.
    pub fn zoom(
        band: (f64, f64),
        sample_rate: f64,
        block: usize,
        available: f64,
    ) -> Result<Lines, SpectralError> {
        let (low, high) = band;
        let limit = sample_rate / 2.0;
        if !(low >= 0.0 && low < high && high <= limit) {
            return Err(SpectralError::Band {
                low,
                high,
                sample_rate,
                limit,
            });
        }
        if !(LEAST_BLOCK..=MOST_BLOCK).contains(&block) {
            return Err(SpectralError::Block {
                block,
                least: LEAST_BLOCK,
                most: MOST_BLOCK,
            });
        }
        let zoomed_rate = DISPLAY_RATIO * (high - low);
        // The zoom's filter grows as the band narrows; below a few resolution widths it would be
        // longer than the signal, and show nothing.
        if zoomed_rate * available < LEAST_BLOCK as f64 {
            return Err(SpectralError::TooNarrow {
                low,
                high,
                seconds: available,
                resolution: 1.0 / available,
                least_width: LEAST_BLOCK as f64 / (DISPLAY_RATIO * available),
            });
        }
        let most = (MOST_PADDING as f64 * zoomed_rate * available) as usize;
        if block > most {
            return Err(SpectralError::Padded {
                block,
                wanted: block as f64 / zoomed_rate,
                seconds: available,
                most,
            });
        }
        Ok(Lines {
            low,
            high,
            spacing: zoomed_rate / block as f64,
            block,
            duration: available.min(block as f64 / zoomed_rate),
        })
    }

    /// Number of displayed lines, block/2.56; the axis has one point more, its lower end.
    pub fn displayed(&self) -> usize {
        // A hair more than exact, so that 800 lines of 2048 are not 799 by rounding.
        (self.block as f64 / DISPLAY_RATIO * (1.0 + 1e-12)) as usize
    }

    /// Number of points on the axis.
    pub fn points(&self) -> usize {
        self.displayed() + 1
    }

    /// Frequency of point `index` (Hz).
    pub fn frequency(&self, index: usize) -> f64 {
        self.low + index as f64 * self.spacing
    }

    /// Index of the line nearest to a frequency (Hz).
    pub fn nearest(&self, frequency: f64) -> usize {
        let index = ((frequency - self.low) / self.spacing).round().max(0.0) as usize;
        index.min(self.points() - 1)
    }

    /// All frequencies (Hz).
    pub fn frequencies(&self) -> Vec<f64> {
        (0..self.points())
            .map(|index| self.frequency(index))
            .collect()
    }

    /// Resolution of the signal, 1/T (Hz).
    pub fn resolution(&self) -> f64 {
        1.0 / self.duration
    }

    /// Bound of a frequency read on a line (Hz): half of the larger of line spacing and resolution.
    pub fn half_line(&self) -> f64 {
        0.5 * self.spacing.max(self.resolution())
    }
}

/// The largest even number 2^a 3^b 5^c not above `most`, or `None` below 2.
///
/// A block of that form transforms several times faster than one with a large prime factor, and at
/// most a few percent of the signal is given away.
pub fn largest_smooth_block(most: usize) -> Option<usize> {
    (2..=most).rev().find(|&n| n % 2 == 0 && is_smooth(n))
}

/// The smallest number 2^a 3^b 5^c not below `least` (1 for 0).
pub fn smallest_smooth_block(least: usize) -> usize {
    (least.max(1)..).find(|&n| is_smooth(n)).unwrap_or(least)
}

fn is_smooth(mut n: usize) -> bool {
    for factor in [2, 3, 5] {
        while n.is_multiple_of(factor) {
            n /= factor;
        }
    }
    n == 1
}
