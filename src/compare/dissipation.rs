//! Changes of the dampings, which no frequency shows.
//!
//! A joint that dissipates more damps each mode by its share of the joint's strain energy, which is the slope of the
//! frequency with respect to the stiffness (Rayleigh's quotient):
//!
//! d zeta_n = 1/2 d eta (strain energy of the joint/strain energy)_n = d eta (d ln f_n/d ln K)
//!
//! Scatter between tests is a share of the damping itself. A usual share counts for some degrees of freedom beside the repeats.

use crate::likelihood::NO_FIT;
use crate::model::PairModel;
use crate::result::{DampingResult, DampingVerdict, Interval, ModeDamping};
use crate::test::{MeasuredMode, Pair, Reading, Test};
use tapjoint_numerics::stats::{fisher_tail, student};

/// Standard deviation of the difference of a damping between two tests of one state, over the damping. Of a real clamped beam,
/// one small mass apart, it is 0.16 to 0.34 for the first four modes.
const USUAL_SCATTER: f64 = 0.2;
/// Degrees of freedom that the usual scatter counts for.
const USUAL_FREEDOM: f64 = 4.0;
/// Step of the stiffnesses (logarithm).
const STEP: f64 = 0.01;

/// One value before and after.
pub(super) struct Change {
    pub(super) pair: usize,
    pub(super) mode: usize,
    pub(super) before: f64,
    pub(super) after: f64,
    /// Variance by readings.
    pub(super) reading: f64,
    /// Variance by scatter over the squared scatter.
    pub(super) scatter: f64,
}

/// Values of all modes that all tests of a pair have.
pub(super) struct Changes {
    pub(super) all: Vec<Change>,
    /// Sum of squared differences of repeats to their mean, over the size; and its degrees of freedom.
    squares: f64,
    freedom: f64,
}

impl Changes {
    /// Takes a value of each mode; sizes below the least one scatter as much as this.
    pub(super) fn new(
        pairs: &[Pair],
        models: &[PairModel],
        least_size: f64,
        value: impl Fn(&MeasuredMode) -> Option<Reading>,
    ) -> Self {
        let (mut all, mut squares, mut freedom) = (Vec::new(), 0.0, 0.0);
        for (index, (pair, model)) in pairs.iter().zip(models).enumerate() {
            for &mode in &model.modes {
                let of_side = |tests: &[Test]| -> Option<Vec<Reading>> {
                    let modes = tests.iter().map(|test| test.mode(mode).and_then(&value));
                    modes.collect()
                };
                let Some((before, after)) = of_side(&pair.before).zip(of_side(&pair.after)) else {
                    continue;
                };
                let mean = |side: &[Reading]| {
                    side.iter().map(|one| one.value).sum::<f64>() / side.len() as f64
                };
                let means = [mean(&before), mean(&after)];
                let size = (0.5 * (means[0].abs() + means[1].abs())).max(least_size);
                let (mut reading, mut share) = (0.0, 0.0);
                for (side, mean) in [&before, &after].into_iter().zip(means) {
                    let count = side.len() as f64;
                    for one in side {
                        reading += (one.std / count).powi(2);
                        // The difference of two tests has twice the variance of one.
                        squares += 2.0 * ((one.value - mean) / size).powi(2);
                    }
                    freedom += count - 1.0;
                    share += 0.5 / count;
                }
                all.push(Change {
                    pair: index,
                    mode,
                    before: means[0],
                    after: means[1],
                    reading,
                    scatter: share * size * size,
                });
            }
        }
        Self {
            all,
            squares,
            freedom,
        }
    }

    /// Returns the squared scatter with its degrees of freedom, about a usual one.
    pub(super) fn scatter(&self, usual: f64) -> (f64, f64) {
        let freedom = USUAL_FREEDOM + self.freedom;
        let squares = USUAL_FREEDOM * usual * usual + self.squares;
        (squares / freedom, freedom)
    }
}

/// Returns the change of the dampings; `None` where the tests have none in common.
pub(crate) fn dampings(pairs: &[Pair], models: &[PairModel]) -> Option<DampingResult> {
    let positive = |mode: &MeasuredMode| mode.damping.filter(|one| one.value > 0.0);
    let found = Changes::new(pairs, models, f64::MIN_POSITIVE, positive);
    if found.all.is_empty() {
        return None;
    }
    let (scatter, freedom) = found.scatter(USUAL_SCATTER);
    let sensitivities = joint_sensitivities(models);
    let mut modes = Vec::new();
    let (mut squares, mut product, mut sensitivity_squares) = (0.0, 0.0, 0.0);
    for one in &found.all {
        let variance = one.reading + scatter * one.scatter;
        let change = one.after - one.before;
        squares += change * change / variance;
        if let Some(sensitivities) = &sensitivities {
            let position = models[one.pair]
                .modes
                .iter()
                .position(|mode| *mode == one.mode);
            let sensitivity = position.map_or(0.0, |position| sensitivities[one.pair][position]);
            product += sensitivity * change / variance;
            sensitivity_squares += sensitivity * sensitivity / variance;
        }
        modes.push(ModeDamping {
            pair: one.pair,
            mode: one.mode,
            before: one.before,
            after: one.after,
            std: variance.sqrt(),
        });
    }
    let count = modes.len() as f64;
    let no_change_goodness = fisher_tail(squares / count, count, freedom);
    let (mut loss_factor, mut joint_goodness) = (None, None);
    if sensitivity_squares > 0.0 && modes.len() > 1 {
        let value = product / sensitivity_squares;
        let left = (squares - value * product).max(0.0) / (count - 1.0);
        let goodness = fisher_tail(left, count - 1.0, freedom);
        joint_goodness = Some(goodness);
        // What the fit leaves tells of the scatter, too.
        let both = freedom + count - 1.0;
        let share = (freedom + (count - 1.0) * left) / both;
        let std = (share / sensitivity_squares).sqrt();
        let reach = student::quantile(0.05, both) * std;
        loss_factor = Some(Interval {
            value,
            std,
            low: value - reach,
            high: value + reach,
        });
    }
    let is_clear = loss_factor.is_some_and(|one| one.low * one.high > 0.0);
    let verdict = match joint_goodness {
        _ if no_change_goodness >= NO_FIT => DampingVerdict::NoChange,
        Some(goodness) if goodness >= NO_FIT && is_clear => DampingVerdict::JointDamping,
        _ => DampingVerdict::Other,
    };
    Some(DampingResult {
        modes,
        verdict,
        loss_factor,
        no_change_goodness,
        joint_goodness,
        scatter_percent: 100.0 * scatter.sqrt(),
    })
}

/// Returns d ln f/d ln K of each mode of each pair, all elastic stiffnesses of the joint together; `None` where there are none.
fn joint_sensitivities(models: &[PairModel]) -> Option<Vec<Vec<f64>>> {
    let mut all = Vec::with_capacity(models.len());
    for model in models {
        let joint = model.structure().joint?;
        let stiffnesses = [joint.kt, joint.kr];
        let mut directions = model.joint_directions();
        directions.retain(|one| stiffnesses.get(*one).is_some_and(|k| k.is_finite()));
        if directions.is_empty() {
            return None;
        }
        let sides = [STEP, -STEP].map(|step| {
            let steps = vec![step; directions.len()];
            model.joint_change(&directions, &steps)
        });
        let [above, below] = sides;
        let both = above?.into_iter().zip(below?);
        all.push(both.map(|(a, b)| (a - b) / (2.0 * STEP)).collect());
    }
    Some(all)
}

#[cfg(test)]
mod tests;
