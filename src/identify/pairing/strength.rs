//! The price of leaving a peak over, by its strength.
//!
//! Frequencies alone tell modes from other peaks badly where there are many others: some joint suits any four of a dozen
//! peaks. The strengths tell them apart. The amplitude of a bending mode, as a velocity or as a modal constant, is the
//! product of its shapes at sensor and tap. Over random places of both it is about uniform between zero and that of the
//! strongest mode. Torsion, the support, and sums of other frequencies are weaker by any number of decades.

use super::MeasuredPeak;
use statrs::function::beta::ln_beta;

/// Price of a peak left over, whatever its strength: it may lie anywhere over five e-folds of frequency.
const ANYWHERE: f64 = 1.6;
/// The share of peaks that are no modes has a beta distribution with these parameters: one in five on average. A test of
/// a bar has none, a bolted structure more of them than modes.
const OTHERS: [f64; 2] = [0.5, 2.0];
/// Logarithm of the odds of a mode over another peak on the grid: few others, one in twenty, and many, half. The closer look
/// has the share of the assignment itself.
pub(super) const GRID_ODDS: [f64; 2] = [3.0, 0.0];
/// Range of the strengths of other peaks (e-folds of amplitude): four decades, in which all are equally likely.
const RANGE: f64 = 4.0 * std::f64::consts::LN_10;
/// Share of modes that may be weaker than uniform amplitudes make them: 2 %. Two modes in a hundred may be seen worse than
/// their shapes say, by a soft tip or a loose sensor. A strength of zero then has a price, and no infinite one.
const UNEXPECTED: f64 = 0.02;

/// What the strengths of the peaks say of assignments.
pub(super) struct Strengths<'a>(pub &'a [MeasuredPeak]);

impl Strengths<'_> {
    /// Returns the logarithm of the odds that the peak is a mode, by its strength and by the places where others may lie.
    /// [`Self::cost`] adds the share of others.
    pub fn leaving(&self, peak: usize) -> f64 {
        let likelihood = |relative: f64| ((1.0 - UNEXPECTED) * RANGE * relative + UNEXPECTED).ln();
        ANYWHERE + self.0[peak].strength.map_or(0.0, likelihood)
    }

    /// Returns the price of all peaks left over.
    pub fn cost(&self, numbers: &[Option<usize>]) -> f64 {
        let over = (0..numbers.len()).filter(|&peak| numbers[peak].is_none());
        let prices: f64 = over.clone().map(|peak| self.leaving(peak)).sum();
        let (count, all) = (over.count() as f64, numbers.len() as f64);
        let [none, mode] = OTHERS;
        prices - ln_beta(none + count, mode + all - count) + ln_beta(none, mode + all)
    }
}
