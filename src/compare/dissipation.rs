//! Changes of the dampings, which no frequency shows.
//!
//! A joint that dissipates damps each mode in proportion to its share of the strain energy:
//!
//! zeta_n = eta/2 (strain energy of the joint/strain energy)_n
//!
//! Translation and rotation have one loss factor eta. Its change is fitted with the stiffness as it was before.

use crate::likelihood::{Factored, NO_FIT};
use crate::model::PairModel;
use crate::result::{DampingResult, DampingVerdict, Interval, ModeDamping};
use crate::test::{MeasuredMode, Pair, Test};
use crate::value_change::{UsualScatter, ValueChanges};
use nalgebra::DVector;
use tapjoint_numerics::stats::{fisher_tail, student};

/// Of a real clamped beam, one small mass apart, the dampings of the first four modes scatter by 0.16 to 0.34.
const USUAL: UsualScatter = UsualScatter {
    share: 0.2,
    least_size: f64::MIN_POSITIVE,
};

/// Largest loss factor that is told (1). Rubber has about 1, bolted joints have a few hundredths. A larger one only says that
/// the modes hardly feel the joint. Damping is in proportion to the loss factor while it is small.
const MOST_LOSS: f64 = 1.0;

/// Returns the change of the dampings; `None` where the tests have none in common.
pub(crate) fn dampings(pairs: &[Pair], models: &[PairModel]) -> Option<DampingResult> {
    let modes: Vec<Vec<usize>> = models.iter().map(|model| model.modes.clone()).collect();
    let damping = |_: &Test, mode: &MeasuredMode| mode.damping.filter(|one| one.value > 0.0);
    let found = ValueChanges::new(pairs, &modes, &USUAL, damping, |mode| mode.moved.damping);
    if found.all.is_empty() {
        return None;
    }
    let covariance = found.covariance();
    let stds: Vec<f64> = covariance.diagonal().iter().map(|one| one.sqrt()).collect();
    let covariance = Factored::new(covariance)?;
    let count = found.all.len() as f64;
    let changes = found.all.iter().map(|one| one.after - one.before);
    let changes = DVector::from_iterator(found.all.len(), changes);
    let squares = covariance.product(&changes, &changes);
    let mut no_change_goodness = fisher_tail(squares / count, count, found.freedom);
    let joint = JointFit::new(&found, &covariance, &changes, models);
    if let Some(joint) = &joint {
        // Of two tests the better one counts twice (Bonferroni). A test of one pattern sees what few degrees of freedom hide from a
        // test of all.
        no_change_goodness = (2.0 * no_change_goodness.min(joint.no_change_goodness)).min(1.0);
    }
    let verdict = match &joint {
        _ if no_change_goodness >= NO_FIT => DampingVerdict::NoChange,
        Some(joint) if joint.goodness < NO_FIT => DampingVerdict::Other,
        Some(joint) if joint.is_clear() => DampingVerdict::JointDamping,
        _ => DampingVerdict::Undecided,
    };
    let modes = found.all.iter().zip(stds).map(|(one, std)| ModeDamping {
        pair: one.pair,
        mode: one.mode,
        before: one.before,
        after: one.after,
        std,
    });
    Some(DampingResult {
        modes: modes.collect(),
        verdict,
        loss_factor: joint
            .as_ref()
            .map(|joint| joint.loss_factor)
            .filter(|one| one.low >= -MOST_LOSS && one.high <= MOST_LOSS),
        no_change_goodness,
        joint_goodness: joint.map(|joint| joint.goodness),
        scatter_percent: 100.0 * found.scatter,
    })
}

/// Change of the joint's loss factor that fits the changes of the dampings best.
struct JointFit {
    /// The change (1), with the stiffness as it was before.
    loss_factor: Interval,
    /// Goodness of this fit (1).
    goodness: f64,
    /// Probability that chance alone gives a loss factor as large as this (1).
    no_change_goodness: f64,
}

impl JointFit {
    /// Fits the loss factor; `None` where there is no elastic joint, and for one mode.
    fn new(
        found: &ValueChanges,
        covariance: &Factored,
        changes: &DVector<f64>,
        models: &[PairModel],
    ) -> Option<Self> {
        let levers = models.iter().map(PairModel::joint_levers);
        let levers: Vec<Vec<f64>> = levers.collect::<Option<_>>()?;
        let levers = found.all.iter().map(|one| {
            let modes = &models[one.pair].modes;
            let position = modes.iter().position(|mode| *mode == one.mode);
            position.map_or(0.0, |position| levers[one.pair][position])
        });
        let levers = DVector::from_iterator(found.all.len(), levers);
        let information = covariance.product(&levers, &levers);
        let is_felt = information.is_finite() && information > 0.0;
        if !is_felt || found.all.len() < 2 {
            return None;
        }
        let value = covariance.product(&levers, changes) / information;
        let explained = value * value * information;
        let others = found.all.len() as f64 - 1.0;
        let left = (covariance.product(changes, changes) - explained).max(0.0) / others;
        // What the fit leaves tells of the scatter, too.
        let freedom = found.freedom + others;
        let share = (found.freedom + others * left) / freedom;
        let std = (share / information).sqrt();
        let reach = student::quantile(0.05, freedom) * std;
        Some(Self {
            loss_factor: Interval {
                value,
                std,
                low: value - reach,
                high: value + reach,
            },
            goodness: fisher_tail(left, others, found.freedom),
            no_change_goodness: fisher_tail(explained, 1.0, found.freedom),
        })
    }

    /// Returns true where the interval of the loss factor lies on one side of 0.
    fn is_clear(&self) -> bool {
        self.loss_factor.low * self.loss_factor.high > 0.0
    }
}

#[cfg(test)]
mod tests;
