//! Probabilities of the hypotheses, and which of them the readings cannot tell apart.

use super::evidence::{covariance, log_sum};
use super::frame::Frame;
use super::hypothesis::Fit;
use super::result::{Hypothesis, PlaceProbabilities};
use tapjoint_beam::effects::{EffectId, Group, Place};

/// A fitted hypothesis in the competition.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub(super) hypothesis: Hypothesis,
    pub(super) fit: Fit,
    /// Its probability (1).
    pub(super) probability: f64,
    /// What it had beforehand, in units of one group of effects (1).
    pub(super) prior: f64,
    /// Standard deviation of the joint's drift, where that is the hypothesis.
    pub(super) drift: Option<f64>,
}

impl Entry {
    pub(super) fn new(hypothesis: Hypothesis, fit: Fit) -> Self {
        Entry {
            hypothesis,
            fit,
            probability: 0.0,
            prior: 1.0,
            drift: None,
        }
    }

    /// Logarithm of evidence times prior.
    pub(super) fn log_weight(&self) -> f64 {
        self.fit.log_evidence + self.prior.ln()
    }

    /// Its effects; none of `none` and `unknown`.
    pub(super) fn effects(&self) -> &[EffectId] {
        match &self.hypothesis {
            Hypothesis::Effects(effects) => effects,
            _ => &[],
        }
    }

    /// The groups of its effects, in order.
    pub(super) fn groups(&self) -> Vec<Group> {
        self.effects().iter().map(|effect| effect.group()).collect()
    }
}

/// Probability beforehand that there is no gap, over that of one group of effects. The priors of all
/// sizes reach zero, and an effect too small to be noticed is as good as none; and of a dozen things that
/// may be wrong with a test mostly none is.
const NONE_SHARE: f64 = 4.0;

/// Gives every group the same probability beforehand, split evenly inside; `unknown` is a group, `none`
/// has [`NONE_SHARE`] of them. The pairs that were `tried` share one unit among themselves, the accepted
/// and the others. Sorts the most probable first.
pub(super) fn set_probabilities(entries: &mut [Entry], tried: usize) {
    let prior = |entry: &Entry| -> f64 {
        if entry.effects().len() > 1 {
            return 1.0 / tried.max(1) as f64;
        }
        let same = |other: &&Entry| match (&entry.hypothesis, &other.hypothesis) {
            (Hypothesis::Effects(_), Hypothesis::Effects(others)) => {
                others.len() == 1 && other.groups() == entry.groups()
            }
            (own, other) => own == other,
        };
        let weight = match entry.hypothesis {
            Hypothesis::None => NONE_SHARE,
            _ => 1.0,
        };
        weight / entries.iter().filter(same).count() as f64
    };
    let priors: Vec<f64> = entries.iter().map(prior).collect();
    for (entry, prior) in entries.iter_mut().zip(priors) {
        entry.prior = prior;
    }
    let logs: Vec<f64> = entries.iter().map(Entry::log_weight).collect();
    let total = log_sum(&logs);
    for (entry, log) in entries.iter_mut().zip(&logs) {
        entry.probability = (log - total).exp();
    }
    entries.sort_by(|a, b| b.probability.total_cmp(&a.probability));
}

/// Gives what is unknown odds of at least `bayes_factor` times those beforehand against the hypothesis
/// `refuted`; all others keep theirs among each other.
pub(super) fn raise_unknown(entries: &mut [Entry], refuted: usize, bayes_factor: f64) {
    let is_unknown = |entry: &Entry| entry.hypothesis == Hypothesis::Unknown;
    let Some(unknown) = entries.iter().position(is_unknown) else {
        return;
    };
    let odds = bayes_factor * entries[unknown].prior / entries[refuted].prior;
    let weight = odds * entries[refuted].probability;
    if weight <= entries[unknown].probability {
        return;
    }
    let total = 1.0 - entries[unknown].probability + weight;
    entries[unknown].probability = weight;
    for entry in entries.iter_mut() {
        entry.probability /= total;
    }
    entries.sort_by(|a, b| b.probability.total_cmp(&a.probability));
}

/// Divides the probability of every entry against which there are odds by these.
pub(super) fn lower(entries: &mut [Entry], odds: &[Option<f64>]) {
    let before: Vec<f64> = entries.iter().map(|entry| entry.probability).collect();
    for (entry, probability) in entries.iter_mut().zip(divided(&before, odds)) {
        entry.probability = probability;
    }
    entries.sort_by(|a, b| b.probability.total_cmp(&a.probability));
}

/// Probabilities divided by odds, with the sum 1.
fn divided(probabilities: &[f64], odds: &[Option<f64>]) -> Vec<f64> {
    let each = probabilities.iter().zip(odds);
    let each: Vec<f64> = each.map(|(p, odds)| p / odds.unwrap_or(1.0)).collect();
    let total: f64 = each.iter().sum();
    each.into_iter().map(|p| p / total).collect()
}

/// Probability of each group, pairs apart, `none` and `unknown` among them; the most probable first.
pub(super) fn by_group(entries: &[Entry]) -> Vec<(Vec<usize>, f64)> {
    let mut groups: Vec<(Vec<usize>, f64)> = Vec::new();
    for (index, entry) in entries.iter().enumerate() {
        let same = |other: &Entry| {
            other.effects().len() == entry.effects().len()
                && match entry.effects().len() {
                    0 => other.hypothesis == entry.hypothesis,
                    _ => other.groups() == entry.groups(),
                }
        };
        match groups.iter_mut().find(|group| same(&entries[group.0[0]])) {
            Some(group) => {
                group.0.push(index);
                group.1 += entry.probability;
            }
            None => groups.push((vec![index], entry.probability)),
        }
    }
    groups.sort_by(|a, b| b.1.total_cmp(&a.1));
    groups
}

/// Probability of each place, given that there is a gap.
pub(super) fn places(entries: &[Entry]) -> PlaceProbabilities {
    let mut places = PlaceProbabilities::default();
    for entry in entries {
        let share = entry.probability / entry.effects().len().max(1) as f64;
        if entry.hypothesis == Hypothesis::Unknown {
            places.unknown += entry.probability;
        }
        for effect in entry.effects() {
            *match effect.place() {
                Place::Joint => &mut places.joint,
                Place::Fixture => &mut places.fixture,
                Place::Sensor => &mut places.sensor,
                Place::Body => &mut places.body,
                Place::Acquisition => &mut places.acquisition,
            } += share;
        }
    }
    let all = [
        &mut places.joint,
        &mut places.fixture,
        &mut places.sensor,
        &mut places.body,
        &mut places.acquisition,
        &mut places.unknown,
    ];
    let total: f64 = all.iter().map(|place| **place).sum();
    if total > 0.0 {
        for place in all {
            *place /= total;
        }
    }
    places
}

/// Squared distance of what two fits predict, in standard deviations of the readings.
pub(super) fn distance(frame: &Frame, a: &Fit, b: &Fit) -> f64 {
    frame
        .readings
        .iter()
        .zip(&a.branch.optimum.model.predicted)
        .zip(&b.branch.optimum.model.predicted)
        .map(|((reading, a), b)| ((a - b) / reading.std).powi(2))
        .sum()
}

/// Chi square by which a rival fits worse, priors included.
pub(super) fn lead(best: &Fit, rival: &Fit) -> f64 {
    2.0 * (rival.branch.optimum.objective - best.branch.optimum.objective)
}

/// Chi square below which two hypotheses count as one on these readings: three standard deviations.
pub(super) const APART: f64 = 9.0;

/// Effects whose best fit predicts the same as this entry's.
pub(super) fn confounded(frame: &Frame, entries: &[Entry], index: usize) -> Vec<EffectId> {
    let own = &entries[index];
    if own.hypothesis == Hypothesis::Unknown {
        return Vec::new();
    }
    entries
        .iter()
        .enumerate()
        .filter(|(other, entry)| *other != index && entry.effects().len() == 1)
        .filter(|(_, entry)| {
            distance(frame, &own.fit, &entry.fit) < APART
                && lead(&own.fit, &entry.fit).abs() < APART
        })
        .flat_map(|(_, entry)| entry.effects().to_vec())
        .filter(|effect| !own.effects().contains(effect))
        .collect()
}

/// Value and standard uncertainty of every parameter of an entry's effects.
pub(super) fn spreads(entry: &Entry) -> Vec<f64> {
    let branch = &entry.fit.branch;
    match covariance(&branch.knowledge, &branch.optimum) {
        Some(covariance) => covariance
            .diagonal()
            .iter()
            .map(|v| v.max(0.0).sqrt())
            .collect(),
        None => vec![f64::INFINITY; branch.knowledge.len()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is refuted, even beyond all odds, leaves the others as they were among each other.
    #[test]
    fn limit_lowered_probabilities_keep_the_odds_of_all_others() {
        for odds in [8.0, 1e10, f64::INFINITY] {
            let after = divided(&[0.6, 0.3, 0.1], &[Some(odds), None, Some(1.0)]);
            // Rounding of three numbers.
            assert!((after.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            assert!((after[1] / after[2] - 3.0).abs() < 1e-14);
            assert!((after[0] / after[1] - 2.0 / odds).abs() < 1e-15);
        }
    }
}
