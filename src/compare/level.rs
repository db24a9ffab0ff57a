//! One level of the taps for all tests, and changes of how frequencies depend on it.
//!
//! A joint that slips is softer at higher levels. Two tests at different levels then differ although nothing changed. Where the
//! decays of both tell the slope of a frequency over the logarithm of the amplitude, each is taken at the amplitude of the first
//! test. A change of the slopes is often the first sign of a bolt that works loose.

use crate::dissipation::Changes;
use crate::likelihood::NO_FIT;
use crate::model::PairModel;
use crate::result::{LevelResult, ModeLevel};
use crate::test::Pair;
use tapjoint_numerics::stats::fisher_tail;

/// Farthest that a frequency is moved along its slope (factors of ten in amplitude): about as far as a decay shows it.
const FARTHEST: f64 = 1.0;
/// Standard deviation of the difference of a slope between two tests of one state, over the slope.
const USUAL_SCATTER: f64 = 0.25;
/// Slopes below this scatter as much as this (1 per factor of ten): other modes in the decay pull them.
const LEAST_SLOPE: f64 = 1e-4;

/// Change of a frequency by taking it at another level.
pub(crate) struct Moved {
    /// Number of the mode.
    pub(crate) mode: usize,
    /// Change of the after tests' mean less that of the before tests' (logarithm).
    pub(crate) change: f64,
}

/// Takes the frequencies of all tests of a pair at the amplitudes of the first one. Returns what this changes.
pub(crate) fn take_one_level(pair: &mut Pair) -> Vec<Moved> {
    let mut moved: Vec<Moved> = Vec::new();
    let reference = pair.before[..1].to_vec();
    let shares = [pair.before.len(), pair.after.len()].map(|count| 1.0 / count as f64);
    let sides = [(&mut pair.before, -shares[0]), (&mut pair.after, shares[1])];
    for (tests, share) in sides {
        for mode in tests.iter_mut().flat_map(|test| &mut test.modes) {
            let first = reference.first().and_then(|first| first.mode(mode.mode));
            let Some((first, own)) = first.and_then(|first| first.level).zip(mode.level) else {
                continue;
            };
            let tens = (own.amplitude / first.amplitude).log10();
            // An amplitude of nothing has no logarithm.
            let is_near = tens.abs() <= FARTHEST;
            if first.sensor != own.sensor || !is_near {
                continue;
            }
            let change = -own.slope.value * tens;
            mode.frequency *= change.exp();
            mode.std = mode.std.hypot(own.slope.std * tens * mode.frequency);
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

/// Returns the change of the frequencies' dependence on the level; `None` where the tests have none in common.
pub(crate) fn levels(pairs: &[Pair], models: &[PairModel]) -> Option<LevelResult> {
    let found = Changes::new(pairs, models, LEAST_SLOPE, |mode| {
        mode.level.map(|level| level.slope)
    });
    if found.all.is_empty() {
        return None;
    }
    let (scatter, freedom) = found.scatter(USUAL_SCATTER);
    let mut modes = Vec::new();
    let mut squares = 0.0;
    for one in &found.all {
        let variance = one.reading + scatter * one.scatter;
        squares += (one.after - one.before).powi(2) / variance;
        modes.push(ModeLevel {
            pair: one.pair,
            mode: one.mode,
            before_percent: 100.0 * one.before,
            after_percent: 100.0 * one.after,
            std_percent: 100.0 * variance.sqrt(),
        });
    }
    let count = modes.len() as f64;
    let no_change_goodness = fisher_tail(squares / count, count, freedom);
    Some(LevelResult {
        modes,
        has_changed: no_change_goodness < NO_FIT,
        no_change_goodness,
    })
}

#[cfg(test)]
mod tests;
