//! Changes of a value that each mode has beside its frequency, and how much they scatter.
//!
//! Scatter between tests is a share of the value itself. A usual share counts for some degrees of freedom beside the repeats. The
//! scatter of two modes is correlated as that of their frequencies.

use crate::likelihood::SCATTER_CORRELATION;
use crate::test::{MeasuredMode, Pair, Reading, Test};
use nalgebra::DMatrix;

/// Degrees of freedom that the usual scatter counts for.
const USUAL_FREEDOM: f64 = 4.0;

/// A value before and after.
pub(crate) struct ValueChange {
    /// Index of the pair.
    pub(crate) pair: usize,
    /// Number of the mode.
    pub(crate) mode: usize,
    /// Mean of the tests before.
    pub(crate) before: f64,
    /// Mean of the tests after.
    pub(crate) after: f64,
    /// Variance of the change by readings.
    reading: f64,
    /// Variance of the change by taking modes to another level.
    moved: f64,
    /// Standard deviation of the change by a scatter of 1.
    unit: f64,
}

/// Values of all modes that all tests of a pair have.
pub(crate) struct ValueChanges {
    /// The changes, pair by pair.
    pub(crate) all: Vec<ValueChange>,
    /// Standard deviation of the difference of two tests of one state, over the size of the value (1).
    pub(crate) scatter: f64,
    /// Degrees of freedom of this scatter.
    pub(crate) freedom: f64,
    /// True where repeats tell the scatter, which then holds the readings' own noise.
    has_repeats: bool,
}

/// What scatters usually.
pub(crate) struct UsualScatter {
    /// Standard deviation of the difference of two tests of one state, over the size of the value (1).
    pub(crate) share: f64,
    /// Smaller values scatter as if they had this size.
    pub(crate) least_size: f64,
}

impl ValueChanges {
    /// Takes a value of each of the modes of each pair. `value` gets the first test and the mode of another. `moved_std` returns the
    /// standard uncertainty that taking the mode to another level adds to the value.
    pub(crate) fn new(
        pairs: &[Pair],
        modes: &[Vec<usize>],
        usual: &UsualScatter,
        value: impl Fn(&Test, &MeasuredMode) -> Option<Reading>,
        moved_std: impl Fn(&MeasuredMode) -> f64,
    ) -> Self {
        let (mut all, mut squares, mut freedom) = (Vec::new(), 0.0, 0.0);
        for (index, (pair, modes)) in pairs.iter().zip(modes).enumerate() {
            let first = &pair.before[0];
            let known = all.len();
            let (mut own_squares, mut own_freedom) = (0.0, 0.0);
            for &mode in modes {
                let mut moved = 0.0;
                let mut of_side = |tests: &[Test]| -> Option<Vec<Reading>> {
                    let values = tests.iter().map(|test| {
                        let own = test.mode(mode)?;
                        let found = value(first, own)?;
                        moved += (moved_std(own) / tests.len() as f64).powi(2);
                        (found.value.is_finite() && found.std.is_finite()).then_some(found)
                    });
                    values.collect()
                };
                let Some((before, after)) = of_side(&pair.before).zip(of_side(&pair.after)) else {
                    continue;
                };
                let means = [&before, &after]
                    .map(|side| side.iter().map(|one| one.value).sum::<f64>() / side.len() as f64);
                let size = (0.5 * (means[0].abs() + means[1].abs())).max(usual.least_size);
                let (mut reading, mut share) = (0.0, 0.0);
                for (side, mean) in [&before, &after].into_iter().zip(means) {
                    let count = side.len() as f64;
                    for one in side {
                        reading += (one.std / count).powi(2);
                        // The difference of two tests has twice the variance of one.
                        own_squares += 2.0 * ((one.value - mean) / size).powi(2);
                    }
                    own_freedom += count - 1.0;
                    share += 0.5 / count;
                }
                all.push(ValueChange {
                    pair: index,
                    mode,
                    before: means[0],
                    after: means[1],
                    reading,
                    moved,
                    unit: size * share.sqrt(),
                });
            }
            // Correlated modes tell less of their scatter: m of them as much as m/(1 + (m - 1) c^2).
            let others = (all.len() - known).saturating_sub(1) as f64;
            let repeated = 1.0 + others * SCATTER_CORRELATION * SCATTER_CORRELATION;
            squares += own_squares / repeated;
            freedom += own_freedom / repeated;
        }
        let both = USUAL_FREEDOM + freedom;
        let scatter = (USUAL_FREEDOM * usual.share * usual.share + squares) / both;
        Self {
            all,
            scatter: scatter.sqrt(),
            freedom: both,
            has_repeats: freedom > 0.0,
        }
    }

    /// Returns the covariance of all changes if nothing changed.
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.all.len(), self.all.len(), |row, column| {
            let [one, other] = [&self.all[row], &self.all[column]];
            let scatter = self.scatter * self.scatter * one.unit * other.unit;
            if row != column {
                let correlation = if one.pair == other.pair {
                    SCATTER_CORRELATION
                } else {
                    0.0
                };
                return correlation * scatter;
            }
            let at_own_level = match self.has_repeats {
                true => scatter.max(one.reading),
                false => scatter + one.reading,
            };
            at_own_level + one.moved
        })
    }
}
