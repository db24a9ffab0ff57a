//! One level of the taps for all tests, and changes of how frequencies depend on it.
//!
//! A joint that slips is softer at higher levels. Two tests at different levels then differ although nothing changed. Decays tell
//! the frequency over the amplitude. By this curve each frequency is taken at the amplitude of the first test. A change of the mean
//! slope of the curve is often the first sign of a bolt that works loose.

use crate::likelihood::{Factored, NO_FIT};
use crate::result::{LevelResult, ModeLevel};
use crate::test::{MeasuredMode, Pair, Test};
use crate::value_change::{UsualScatter, ValueChanges};
use nalgebra::DVector;
use tapjoint_numerics::stats::fisher_tail;

/// Amplitudes that differ by less than this factor are alike: slopes of a joint that slips grow with the level.
const ALIKE: f64 = 1.5;
/// Scatter of a slope, at least 0.01 % per factor of ten: other modes in the decay pull it.
const USUAL: UsualScatter = UsualScatter {
    share: 0.25,
    least_size: 4e-4,
};

/// Change of a frequency by taking it at another level.
pub(crate) struct Moved {
    /// Number of the mode.
    pub(crate) mode: usize,
    /// Change of the after tests' mean less that of the before tests' (logarithm).
    pub(crate) change: f64,
}

/// Takes the modes of all tests of a pair at the amplitudes of the first one. Returns what this changes.
pub(crate) fn take_one_level(pair: &mut Pair) -> Vec<Moved> {
    let mut moved: Vec<Moved> = Vec::new();
    let Some(first) = pair.before.first().cloned() else {
        return moved;
    };
    let shares = [pair.before.len(), pair.after.len()].map(|count| 1.0 / count as f64);
    let sides = [(&mut pair.before, -shares[0]), (&mut pair.after, shares[1])];
    for (tests, share) in sides {
        for mode in tests.iter_mut().flat_map(|test| &mut test.modes) {
            let Some(change) = first
                .mode(mode.mode)
                .and_then(|own| take_level_of(own, mode))
            else {
                continue;
            };
            match moved.iter_mut().find(|one| one.mode == mode.mode) {
                Some(one) => one.change += share * change,
                None => moved.push(Moved {
                    mode: mode.mode,
                    change: share * change,
                }),
            }
        }
    }
    moved
}

/// Takes a mode at the amplitude of the same mode in the first test. Returns the change of its frequency (logarithm); `None` where
/// the decays do not show it at this amplitude.
fn take_level_of(first: &MeasuredMode, mode: &mut MeasuredMode) -> Option<f64> {
    let (target, own) = first.level.as_ref().zip(mode.level.as_ref())?;
    if target.of != own.of {
        return None;
    }
    let there = own.at(target.amplitude)?;
    mode.frequency *= there.frequency.value.exp();
    mode.moved.frequency = there.frequency.std * mode.frequency;
    if let Some(damping) = &mut mode.damping {
        damping.value += there.damping.value;
        mode.moved.damping = there.damping.std;
    }
    Some(there.frequency.value)
}

/// Returns the change of the frequencies' dependence on the level, for modes that all tests read at about one amplitude; `None`
/// where there are none.
pub(crate) fn levels(pairs: &[Pair], modes: &[Vec<usize>]) -> Option<LevelResult> {
    let slope = |first: &Test, mode: &MeasuredMode| {
        let own = mode.level.as_ref()?;
        let first = first.mode(mode.mode)?.level.as_ref()?;
        let ratio = own.amplitude / first.amplitude;
        let is_alike = first.of == own.of && ratio < ALIKE && ratio > 1.0 / ALIKE;
        is_alike.then_some(own.frequency_slope)
    };
    let found = ValueChanges::new(pairs, modes, &USUAL, slope, |_| 0.0);
    if found.all.is_empty() {
        return None;
    }
    let covariance = found.covariance();
    let stds: Vec<f64> = covariance.diagonal().iter().map(|one| one.sqrt()).collect();
    let changes = found.all.iter().map(|one| one.after - one.before);
    let changes = DVector::from_iterator(found.all.len(), changes);
    let squares = Factored::new(covariance)?.product(&changes, &changes);
    let count = found.all.len() as f64;
    let no_change_goodness = fisher_tail(squares / count, count, found.freedom);
    let modes = found.all.iter().zip(stds).map(|(one, std)| ModeLevel {
        pair: one.pair,
        mode: one.mode,
        before_percent: 100.0 * one.before,
        after_percent: 100.0 * one.after,
        std_percent: 100.0 * std,
    });
    Some(LevelResult {
        modes: modes.collect(),
        has_changed: no_change_goodness < NO_FIT,
        no_change_goodness,
    })
}

#[cfg(test)]
mod tests;
