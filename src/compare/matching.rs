//! One numbering of the modes for both tests.
//!
//! A beam often has a peak of another kind close to a bending mode. Each test numbers its peaks alone, and where two lie
//! close together, two tests may choose differently. Seen side by side, a peak without a number that lies much nearer is the
//! same mode.

use crate::model::log_frequencies;
use crate::result::MatchedMode;
use crate::test::{MeasuredMode, Pair, Test};

/// Change of a frequency from which on another peak may be meant (logarithm).
const LARGE: f64 = 0.01;
/// The other peak lies nearer by this factor.
const NEARER: f64 = 3.0;

/// Returns the frequency nearest to another among those without a number, and how far it is (logarithm).
fn nearest(test: &Test, frequency: f64) -> Option<(f64, f64)> {
    let peaks = test.unnumbered.iter();
    peaks
        .map(|peak| (*peak, (peak / frequency).ln().abs()))
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Returns the factor on the frequency of each mode from one description to another, with the joint of the first; empty where
/// there is none.
fn described_changes(first: &Test, test: &Test) -> Vec<f64> {
    let mut other = test.structure.clone();
    other.joint = first.structure.joint;
    if other == first.structure {
        return Vec::new();
    }
    let highest = first.modes.iter().map(|one| one.mode).max().unwrap_or(0);
    let modes: Vec<usize> = (1..=highest).collect();
    let both = [&first.structure, &other].map(|structure| log_frequencies(structure, &modes));
    let [Ok(before), Ok(after)] = both else {
        return Vec::new();
    };
    before
        .iter()
        .zip(after)
        .map(|(before, after)| (after - before).exp())
        .collect()
}

/// Gives the modes of all tests of a pair the numbers of the first one. Where two tests may both be right, the mode is left
/// out. Returns what was changed.
pub(crate) fn match_modes(pair: &mut Pair, index: usize) -> Vec<MatchedMode> {
    let mut changed: Vec<MatchedMode> = Vec::new();
    let Some((first, others)) = pair.before.split_first_mut() else {
        return changed;
    };
    let tests = others.iter_mut().chain(&mut pair.after);
    for (number, test) in tests.enumerate() {
        let modes = first.modes.clone();
        // What the descriptions tell is no sign of another peak.
        let described = described_changes(first, test);
        for own in &modes {
            let Some(position) = test.modes.iter().position(|one| one.mode == own.mode) else {
                continue;
            };
            let there = test.modes[position].clone();
            let ratio = own
                .mode
                .checked_sub(1)
                .and_then(|index| described.get(index))
                .copied()
                .unwrap_or(1.0);
            let expected = own.frequency * ratio;
            let apart = (there.frequency / expected).ln().abs();
            if apart < LARGE {
                continue;
            }
            let is_nearer = |found: &(f64, f64)| found.1 * NEARER < apart;
            let in_test = nearest(test, expected).filter(is_nearer);
            let in_first = nearest(first, there.frequency / ratio).filter(is_nearer);
            let taken = match (in_test, in_first) {
                (None, None) => continue,
                (Some((peak, _)), None) => {
                    // Nothing else is known of this peak.
                    test.modes[position] = MeasuredMode::of_frequency(own.mode, peak, there.std);
                    test.unnumbered.retain(|one| *one != peak);
                    test.unnumbered.push(there.frequency);
                    Some(peak)
                }
                (None, Some(_)) | (Some(_), Some(_)) => {
                    test.modes.remove(position);
                    None
                }
            };
            changed.push(MatchedMode {
                pair: index,
                mode: own.mode,
                test: number + 1,
                first: own.frequency,
                other: there.frequency,
                taken,
            });
        }
    }
    changed
}
