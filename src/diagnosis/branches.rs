//! Several optima of one hypothesis: where searches go on, and which are the same.

use super::evidence::{Branch, covariance};

/// The nodes from which a search goes on: the local maxima, best first, at most three.
pub(super) fn peaks(evidence: &[f64]) -> Vec<usize> {
    let value = |k: Option<usize>| {
        k.and_then(|k| evidence.get(k))
            .copied()
            .unwrap_or(f64::NEG_INFINITY)
    };
    let mut peaks: Vec<usize> = (0..evidence.len())
        .filter(|&k| evidence[k] >= value(k.checked_sub(1)) && evidence[k] >= value(Some(k + 1)))
        .collect();
    peaks.sort_by(|&a, &b| evidence[b].total_cmp(&evidence[a]));
    // A peak 12 below the best has e^-12 of its probability. Where the nodes differ by far more than
    // that, they lie too far apart to say which valley is the deepest.
    let best = value(peaks.first().copied());
    let worst = evidence.iter().copied().filter(|e| e.is_finite());
    let depth = best - worst.fold(best, f64::min);
    peaks.retain(|&k| evidence[k] > best - f64::max(12.0, 0.5 * depth));
    peaks.truncate(3);
    peaks
}

/// Adds a branch unless the same optimum is there already (in the parameters `which`).
pub(super) fn keep(found: &mut Vec<Branch>, branch: Branch, which: &[usize]) {
    let spread = covariance(&branch.knowledge, &branch.optimum);
    let same = |other: &Branch| {
        which.iter().all(|&k| {
            let std = spread.as_ref().map_or(0.0, |c| c[(k, k)].max(0.0).sqrt());
            (other.optimum.parameters[k] - branch.optimum.parameters[k]).abs() < 2.0 * std
        })
    };
    match found.iter().position(same) {
        Some(index) if found[index].optimum.objective > branch.optimum.objective => {
            found[index] = branch;
        }
        Some(_) => {}
        None => found.push(branch),
    }
}
