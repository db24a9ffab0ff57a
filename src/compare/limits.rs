//! The smallest change of the joint that would be seen.

use crate::cause::CauseKind;
use crate::joint::JointChange;
use crate::likelihood::Data;
use crate::model::{PairModel, Predicted};
use crate::test::Settings;

/// Chance of a standard normal number to lie above it: one in ten.
const ONE_IN_TEN: f64 = 1.2816;
/// Smallest and largest change that is tried (logarithm): 0.1 % and a factor of 20; and the precision of the answer (1).
const SMALLEST: f64 = 1e-3;
const LARGEST: f64 = 3.0;
const PRECISION: f64 = 1.12;
/// Probability of no change below which a change is seen.
const SEEN: f64 = 0.05;

/// Returns the smallest rise and fall (1, relative) of the stiffness in one direction that would be seen in nine of ten
/// comparisons with these uncertainties. `None` where not even a factor of 20 would be.
///
/// Data with exactly this change are made, less what chance takes away in one case of ten. They are seen where `no change`
/// has at most 5 % beside a change of the joint.
pub(crate) fn seen_from(
    pairs: &[PairModel],
    settings: &Settings,
    change: &JointChange,
    direction: usize,
) -> [Option<f64>; 2] {
    [1.0, -1.0].map(|sign| {
        let is_seen =
            |size: f64| is_seen(pairs, settings, change, direction, sign * size) == Some(true);
        if !is_seen(LARGEST) {
            return None;
        }
        let (mut below, mut above) = (SMALLEST, LARGEST);
        while above > PRECISION * below {
            let middle = (below * above).sqrt();
            match is_seen(middle) {
                true => above = middle,
                false => below = middle,
            }
        }
        Some((sign * above).exp_m1())
    })
}

fn is_seen(
    pairs: &[PairModel],
    settings: &Settings,
    change: &JointChange,
    direction: usize,
    step: f64,
) -> Option<bool> {
    let index = change.directions.iter().position(|one| *one == direction)?;
    let mut steps = vec![0.0; change.directions.len()];
    steps[index] = step;
    let mut planned = pairs.to_vec();
    for pair in &mut planned {
        pair.measured = pair.predict_joint(&change.directions, &steps)?.change;
    }
    // What the repeats showed of the scatter is kept.
    let nothing: Vec<Predicted> = planned.iter().map(Predicted::nothing).collect();
    let visible = Data::new(&planned, settings)
        .mean_chi_square(&nothing)
        .sqrt();
    // Less than this is never seen, and needs no integral.
    if visible < ONE_IN_TEN + 2.0 {
        return Some(false);
    }
    let kept = 1.0 - ONE_IN_TEN / visible;
    for pair in &mut planned {
        pair.measured.iter_mut().for_each(|one| *one *= kept);
    }
    let data = Data::new(&planned, settings);
    let log_nothing = data.log_density(&nothing) + CauseKind::NoChange.prior().ln();
    let log_joint =
        change.log_evidence_alone(&data, index, step)? + CauseKind::JointChange.prior().ln();
    let probability = 1.0 / (1.0 + (log_joint - log_nothing).exp());
    Some(probability <= SEEN)
}
