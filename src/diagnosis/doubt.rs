//! What the readings say against an explanation as such, whatever the others are worth.

use super::frame::Frame;
use super::pairs::SECOND;
use super::posterior::{Entry, lower, raise_unknown};
use super::result::Hypothesis;
use super::search::Competition;
use super::trial::Trial;

/// Weighs what the readings say against the best explanation as such, and not beside the others.
///
/// A misfit of probability p speaks against an explanation with odds of 1 to -e p ln p at most (Sellke, Bayarri &
/// Berger 2001). Such odds count against every explanation that is about as probable as the best: evidence compares
/// how well explanations fit under the noise that is assumed, and one that this noise refutes is no explanation
/// while another stands; where none does, the noise is in doubt, and with it what evidence says. What is still held against the one that is left is evidence for something unknown, which
/// has no misfit of its own. A best explanation that stands is left alone: what refutes its rivals makes it no
/// better.
pub(super) fn doubt(competition: &mut Competition) {
    let Competition { frame, entries, .. } = competition;
    let Some(best) = best(entries) else { return };
    let odds = odds_against(frame, &entries[best]);
    if odds <= 1.0 {
        return;
    }
    let mut all: Vec<Option<f64>> = vec![None; entries.len()];
    all[best] = Some(odds);
    // Down to what explains as well as the best, and then as well as the best that is not refuted.
    let mut least = entries[best].probability * (-SECOND).exp();
    let mut stands = false;
    for k in best + 1..entries.len() {
        if entries[k].hypothesis == Hypothesis::Unknown || entries[k].probability < least {
            continue;
        }
        all[k] = Some(odds_against(frame, &entries[k]));
        if !stands && all[k] == Some(1.0) {
            stands = true;
            least = entries[k].probability * (-SECOND).exp();
        }
    }
    let probabilities: Vec<f64> = entries.iter().map(|entry| entry.probability).collect();
    let Some((left, relative)) = left(&probabilities, &all) else {
        return;
    };
    let name = entries[left].hypothesis.clone();
    lower(entries, &relative);
    let left_now = entries.iter().position(|entry| entry.hypothesis == name);
    if let Some((left_now, odds)) = left_now.zip(all[left].filter(|odds| *odds > 1.0)) {
        raise_unknown(entries, left_now, odds);
    }
}

/// The odds against one explanation; infinite where its fit has no uncertainty to be tested with.
fn odds_against(frame: &Frame, entry: &Entry) -> f64 {
    let Some(trial) = Trial::new(frame, &entry.fit) else {
        return f64::INFINITY;
    };
    let refuting = trial.with_withheld(frame, &entry.fit).refuting();
    refuting.map_or(1.0, most_against)
}

/// Which of the explanations that were looked at is left, the first of equal ones, and the odds against every
/// other of them over those against it; `None` where none was looked at or all have infinite odds against them.
fn left(probabilities: &[f64], odds: &[Option<f64>]) -> Option<(usize, Vec<Option<f64>>)> {
    let weight = |k: usize| odds[k].map(|odds| (k, probabilities[k] / odds, odds));
    let looked_at = (0..odds.len()).filter_map(weight);
    let finite = looked_at.filter(|one| one.2.is_finite());
    let (left, _, own) =
        finite.reduce(|first, other| if other.1 > first.1 { other } else { first })?;
    let over = |odds: &Option<f64>| Some((*odds)? / own);
    Some((left, odds.iter().map(over).collect()))
}

/// Highest odds against an explanation whose misfit has the probability `p`.
pub(super) fn most_against(p: f64) -> f64 {
    use std::f64::consts::E;
    let p = p.clamp(SMALLEST_MISFIT, 1.0 / E);
    -1.0 / (E * p * p.ln())
}

/// Probability of a misfit below which its logarithm decides nothing any more: 1e-12 is certainty in all
/// that is shown, and odds from it stay finite.
const SMALLEST_MISFIT: f64 = 1e-12;

/// The best explanation that can be shown: what is unknown has no residual.
pub(super) fn best(entries: &[Entry]) -> Option<usize> {
    let known = |entry: &Entry| entry.hypothesis != Hypothesis::Unknown;
    entries.iter().position(known)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At p = 1/e and above a misfit says nothing; below, the odds grow and stay finite down to zero.
    #[test]
    fn limit_odds_from_a_misfit_are_even_at_best_and_finite_at_worst() {
        assert!((most_against(1.0) - 1.0).abs() < 1e-15);
        assert!((most_against((-1.0_f64).exp()) - 1.0).abs() < 1e-15);
        assert!(most_against(0.0).is_finite());
        assert!(most_against(0.0) > most_against(1e-6));
    }

    /// Sellke, Bayarri & Berger (2001), table 1: at least 0.407 at p = 0.05 and 0.125 at p = 0.01, to the
    /// digits printed there.
    #[test]
    fn val_odds_from_a_misfit_are_those_of_sellke() {
        for (p, bound) in [(0.05, 0.407), (0.01, 0.125)] {
            assert!((1.0 / most_against(p) - bound).abs() < 5e-4, "{p}");
        }
    }

    /// Equal odds against two change nothing between them, and of equal weights the first is left.
    #[test]
    fn limit_equal_odds_keep_the_order() {
        let (first, relative) = left(&[0.4, 0.4, 0.2], &[Some(9.0), Some(9.0), None]).unwrap();
        assert_eq!(first, 0);
        assert_eq!(relative, [Some(1.0), Some(1.0), None]);
    }

    /// A rival against which less speaks takes the place; what was not looked at keeps its odds to it.
    #[test]
    fn regress_an_explanation_that_stands_takes_the_place_of_a_refuted_one() {
        let (first, relative) = left(&[0.8, 0.15, 0.05], &[Some(40.0), Some(4.0), None]).unwrap();
        assert_eq!(first, 1);
        assert_eq!(relative, [Some(10.0), Some(1.0), None]);
    }

    #[test]
    fn limit_infinite_odds_against_all_leave_nothing_to_choose() {
        let infinite = Some(f64::INFINITY);
        assert_eq!(left(&[0.5, 0.5], &[infinite, infinite]), None);
        let (first, relative) = left(&[0.9, 0.1], &[infinite, Some(2.0)]).unwrap();
        assert_eq!((first, relative), (1, vec![infinite, Some(1.0)]));
    }
}
