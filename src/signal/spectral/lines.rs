//! The frequency axis of a spectrum, and what it can resolve.
//!
//! Block sizes that transform fast.

use super::{LEAST_BLOCK, MOST_BLOCK, SpectralError};

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
    /// Lines of a block without a zoom band: 0 to rate/2.56, spacing rate/block.
    ///
    /// `available` is the length of signal at hand (s).
    ///
    /// # Errors
    /// [`SpectralError::Block`] for a block outside [`LEAST_BLOCK`] to [`MOST_BLOCK`] samples,
    /// [`SpectralError::TooNarrow`] where the signal resolves fewer than six lines of the band.
    pub fn baseband(
        sample_rate: f64,
        block: usize,
        available: f64,
    ) -> Result<Lines, SpectralError> {
        Self::zoom(
            (0.0, sample_rate / DISPLAY_RATIO),
            sample_rate,
            block,
            available,
        )
    }

    /// Lines of a zoom band `(low, high)` (Hz) with `block` real samples at the zoomed rate.
    ///
    /// # Errors
    /// [`SpectralError::Band`] where the band is empty or passes half the sample rate,
    /// [`SpectralError::Block`] for a block outside [`LEAST_BLOCK`] to [`MOST_BLOCK`] samples,
    /// [`SpectralError::TooNarrow`] where the signal resolves fewer than six lines of the band.
    pub fn zoom(
        (low, high): (f64, f64),
        sample_rate: f64,
        block: usize,
        available: f64,
    ) -> Result<Lines, SpectralError> {
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

    /// What the signal can resolve, 1/T (Hz).
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
