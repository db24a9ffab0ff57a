//! Probabilities of all causes, and the answer that follows from them.

use crate::cause::{Cause, CauseKind};
use crate::joint::JointChange;
use crate::likelihood::{Data, NO_FIT, log_sum};
use crate::result::{CauseResult, ChangeVerdict, Interval, VerdictKind};
use crate::search::Posterior;
use std::collections::BTreeMap;
use tapjoint_numerics::stats::NORMAL_95;

/// A cause with its evidence.
pub(crate) struct Candidate {
    pub(crate) kind: CauseKind,
    pub(crate) item: Option<String>,
    /// Logarithm of its evidence.
    pub(crate) log_evidence: f64,
    /// Logarithm of the largest density of the data, at any size and place.
    log_best: f64,
    /// Goodness of fit; `None` for an unknown change.
    pub(crate) goodness: Option<f64>,
    /// Its sizes and its place; empty for no change and an unknown one.
    parameters: BTreeMap<&'static str, Interval>,
    /// What it changes each frequency by (%), in the order of the compared modes.
    explains: Vec<f64>,
    /// One of its sizes is clearly not zero.
    has_clear_size: bool,
}

impl Interval {
    /// Returns the interval with another independent uncertainty.
    fn widened(self, std: f64) -> Self {
        let [below, above] = [self.value - self.low, self.high - self.value];
        Self {
            std: self.std.hypot(std),
            low: self.value - below.hypot(NORMAL_95 * std),
            high: self.value + above.hypot(NORMAL_95 * std),
            ..self
        }
    }
}

/// Probability from which on an answer is given.
const SURE: f64 = 0.9;
/// Probability of no change above which something is not said to have changed.
const PERHAPS_NOTHING: f64 = 0.05;
/// Probability of no change from which on it is the answer.
const PROBABLY_NOTHING: f64 = 0.5;
/// Probability from which on a cause of another kind that fits as well as the first is listed with it, and by how much the
/// logarithm of its density may be lower: two standard deviations.
const LEAST_RIVAL: f64 = 0.001;
const SEPARATE: f64 = 2.0;
/// Standard deviations that a size must be away from zero.
const CLEAR: f64 = 2.0;

/// Returns the probability of each candidate.
pub(crate) fn probabilities(candidates: &[Candidate]) -> Vec<f64> {
    let logs: Vec<f64> = candidates
        .iter()
        .map(|one| {
            // Causes about one item share the prior of their kind.
            let alike = candidates
                .iter()
                .filter(|other| other.kind == one.kind)
                .count();
            one.log_evidence + (one.kind.prior() / alike as f64).ln()
        })
        .collect();
    let total = log_sum(logs.iter().copied());
    logs.iter().map(|log| (log - total).exp()).collect()
}

/// Returns true for a size that is clearly not zero.
fn is_clear(size: Interval) -> bool {
    size.value.abs() > CLEAR * size.std
}

/// Returns the median of a posterior's values with their 95 % interval.
fn interval(posterior: &Posterior, index: usize, transformed: impl Fn(f64) -> f64) -> Interval {
    let mut values: Vec<(f64, f64)> = posterior
        .points
        .iter()
        .map(|point| (transformed(point.values[index]), point.log_weight.exp()))
        .collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|one| one.1).sum();
    let mean = values.iter().map(|one| one.0 * one.1).sum::<f64>() / total;
    let squares = values.iter().map(|one| (one.0 - mean).powi(2) * one.1);
    // The median lies within the interval also where two places are as probable.
    let mut value = mean;
    let [mut low, mut high] = [values[0].0, values[values.len() - 1].0];
    let (mut below, mut before) = (0.0, low);
    for (at, weight) in &values {
        // Half of a point's weight lies on either side of it.
        let share = (below + 0.5 * weight) / total;
        if share <= 0.025 {
            low = *at;
        }
        if share <= 0.5 {
            value = *at;
        }
        if share >= 0.975 {
            high = *at;
            break;
        }
        below += weight;
        before = *at;
    }
    high = high.max(before);
    Interval {
        value,
        std: (squares.sum::<f64>() / total).sqrt(),
        low,
        high,
    }
}

impl Candidate {
    /// A cause without a size.
    pub(crate) fn without_size(kind: CauseKind, log_evidence: f64, goodness: Option<f64>) -> Self {
        Self {
            kind,
            item: None,
            log_evidence,
            log_best: log_evidence,
            goodness,
            parameters: BTreeMap::new(),
            explains: Vec::new(),
            has_clear_size: false,
        }
    }

    /// A change of the joint.
    pub(crate) fn of_joint(data: &Data<'_>, joint: &JointChange, posterior: &Posterior) -> Self {
        let mut candidate = Self::without_size(
            CauseKind::JointChange,
            posterior.log_evidence,
            Some(data.goodness(&posterior.best, joint.directions.len())),
        );
        candidate.explain(posterior);
        for (index, name) in joint.names(&data.pairs[0]).into_iter().enumerate() {
            let step = interval(posterior, index, |step| step);
            candidate.has_clear_size |= is_clear(step);
            let found = match name {
                "kt" | "kr" => interval(posterior, index, f64::exp_m1),
                _ => step,
            };
            candidate.parameters.insert(name, found);
        }
        candidate
    }

    /// A cause of one size, and perhaps with a place. Places and masses of items are those of the first pair.
    pub(crate) fn of_one_size(data: &Data<'_>, cause: &Cause, posterior: &Posterior) -> Self {
        let pair = &data.pairs[0];
        let lost = pair
            .item(cause, 0)
            .filter(|_| cause.kind == CauseKind::LostMass);
        // A stated size was not fitted.
        let fitted = match lost {
            Some(_) => 0,
            None => 1 + usize::from(cause.is_placed),
        };
        let mut candidate = Self::without_size(
            cause.kind,
            posterior.log_evidence,
            Some(data.goodness(&posterior.best, fitted)),
        );
        candidate.item.clone_from(&cause.item);
        candidate.explain(posterior);
        let name = match cause.kind {
            CauseKind::LostMass | CauseKind::AddedMass => "mass",
            CauseKind::LocalCrack => "compliance",
            CauseKind::AxialLoad => "force",
            CauseKind::SensorPosition => "sensor_shift",
            _ => "relative",
        };
        // A lost mass is in masses of its item.
        let unit = lost.map_or(1.0, |item| item.mass);
        let size = interval(posterior, 0, |size| size * unit);
        candidate.has_clear_size = is_clear(size);
        candidate.parameters.insert(name, size);
        if cause.is_placed {
            let length = pair.structure().body.length();
            let place = interval(posterior, 1, |place| place * length);
            let place = place.widened(pair.place_std());
            let within = Interval {
                low: place.low.max(0.0),
                high: place.high.min(length),
                ..place
            };
            candidate.parameters.insert("position", within);
        }
        if let Some(item) = lost {
            let stated = Interval {
                value: item.position,
                std: 0.0,
                low: item.position,
                high: item.position,
            };
            candidate.parameters.insert("position", stated);
        }
        candidate
    }

    fn explain(&mut self, posterior: &Posterior) {
        self.log_best = posterior.log_best;
        let changes = posterior.best.iter().flat_map(|pair| &pair.change);
        self.explains = changes.map(|one| 100.0 * one.exp_m1()).collect();
    }

    /// Returns its result.
    pub(crate) fn result(&self, probability: f64) -> CauseResult {
        CauseResult {
            effect: self.kind,
            item: self.item.clone(),
            probability,
            parameters: self.parameters.clone(),
            goodness_of_fit: self.goodness,
            explains_percent: self.explains.clone(),
        }
    }

    /// Returns true where it explains the changes.
    fn fits(&self) -> bool {
        self.goodness.is_some_and(|goodness| goodness >= NO_FIT)
    }
}

/// Returns the order of the candidates, the most probable first.
pub(crate) fn order(probabilities: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..probabilities.len()).collect();
    order.sort_by(|&a, &b| {
        probabilities[b]
            .total_cmp(&probabilities[a])
            .then(a.cmp(&b))
    });
    order
}

/// Returns the answer.
pub(crate) fn verdict(candidates: &[Candidate], probabilities: &[f64]) -> ChangeVerdict {
    let order = order(probabilities);
    let of_kind = |kind: CauseKind| -> f64 {
        let all = candidates.iter().zip(probabilities);
        all.filter(|one| one.0.kind == kind).map(|one| one.1).sum()
    };
    let nothing = of_kind(CauseKind::NoChange);
    let answer = |kind: VerdictKind, chosen: &[usize], probability: f64| ChangeVerdict {
        kind,
        effects: chosen.iter().map(|index| candidates[*index].kind).collect(),
        items: chosen
            .iter()
            .map(|index| candidates[*index].item.clone())
            .collect(),
        probability,
    };
    if nothing >= PROBABLY_NOTHING {
        return answer(VerdictKind::NoChange, &[], nothing);
    }
    let explained: Vec<usize> = order
        .iter()
        .copied()
        .filter(|index| !candidates[*index].parameters.is_empty())
        .collect();
    if nothing <= PERHAPS_NOTHING {
        let unknown = of_kind(CauseKind::Unknown);
        let first = explained.first().map(|index| &candidates[*index]);
        if unknown >= 0.5 || first.is_none_or(|first| !first.fits()) {
            return answer(VerdictKind::Unknown, &[], 1.0 - nothing);
        }
        if let Some(&index) = explained.first() {
            let own = &candidates[index];
            // A place or a size that is improbable beforehand is no reason to leave out what fits as well.
            let is_rival = |one: usize| {
                !candidates[one].kind.is_like(own.kind)
                    && probabilities[one] >= LEAST_RIVAL
                    && candidates[one].log_best > own.log_best - SEPARATE
            };
            let is_alike = |one: usize| candidates[one].kind.is_like(own.kind);
            let alike = explained.iter().filter(|one| is_alike(**one));
            let together: f64 = alike.map(|one| probabilities[*one]).sum();
            if order[0] == index && together >= SURE && own.has_clear_size {
                // Of those that are alike, enough to be sure.
                let mut chosen = Vec::new();
                let mut sum = 0.0;
                for one in explained {
                    if is_alike(one) && sum < SURE || is_rival(one) {
                        chosen.push(one);
                        sum += probabilities[one];
                    }
                }
                return match chosen.len() {
                    1 => answer(VerdictKind::Named, &chosen, probabilities[index]),
                    _ => answer(VerdictKind::Group, &chosen, sum),
                };
            }
        }
    }
    let mut chosen = Vec::new();
    let mut sum = 0.0;
    for &index in &order {
        chosen.push(index);
        sum += probabilities[index];
        if sum >= SURE {
            break;
        }
    }
    answer(VerdictKind::Set, &chosen, sum)
}
