//! Probabilities of the hypotheses, and which of them the data cannot separate.

use crate::dataset::Dataset;
use crate::evidence::{Fit, log_sum};
use crate::goodness_of_fit::GoodnessOfFit;
use crate::result::{Hypothesis, LocationProbabilities};
use crate::thresholds::{NO_GAP_PRIOR, SECOND_EFFECT, SEPARATE, SMALLEST_P_VALUE};
use std::f64::consts::E;
use tapjoint_beam::effects::{EffectId, Group, Place};

/// Hypothesis that takes part in the comparison, with its fit.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The hypothesis.
    pub hypothesis: Hypothesis,
    /// Its fit.
    pub fit: Fit,
    /// Probability (1).
    pub probability: f64,
    /// Prior probability, in units of one group of effects (1).
    pub prior: f64,
    /// Standard deviation of the joint's drift, where that is the hypothesis.
    pub drift: Option<f64>,
}

impl Candidate {
    /// Returns a candidate that has no probability yet.
    pub fn new(hypothesis: Hypothesis, fit: Fit) -> Self {
        Candidate {
            hypothesis,
            fit,
            probability: 0.0,
            prior: 1.0,
            drift: None,
        }
    }

    /// Logarithm of evidence times prior.
    pub fn log_weight(&self) -> f64 {
        self.fit.log_evidence + self.prior.ln()
    }

    /// Its effects; none for `none` and `unknown`.
    pub fn effects(&self) -> &[EffectId] {
        match &self.hypothesis {
            Hypothesis::Effects(effects) => effects,
            _ => &[],
        }
    }

    /// Groups of its effects, in order.
    pub fn groups(&self) -> Vec<Group> {
        self.effects().iter().map(|effect| effect.group()).collect()
    }

    /// Returns whether it is something outside the catalogue.
    pub fn is_unknown(&self) -> bool {
        self.hypothesis == Hypothesis::Unknown
    }

    /// Standard deviations of all parameters.
    pub fn stds(&self) -> Vec<f64> {
        match self.fit.best.covariance() {
            Some(covariance) => {
                let variances = covariance.diagonal();
                variances.iter().map(|v| v.max(0.0).sqrt()).collect()
            }
            None => vec![f64::INFINITY; self.fit.best.priors.len()],
        }
    }
}

/// Returns the candidate of the nominal model.
pub fn none_of(candidates: &[Candidate]) -> Option<&Candidate> {
    let mut all = candidates.iter();
    all.find(|one| one.hypothesis == Hypothesis::None)
}

/// Gives every group the same prior probability, split evenly inside; `unknown` is a group, `none`
/// has [`NO_GAP_PRIOR`] of them. The pairs that were `tried` share one unit among themselves, the accepted
/// and the others. Sorts the most probable first.
pub fn set_probabilities(candidates: &mut [Candidate], tried: usize) {
    for k in 0..candidates.len() {
        let one = &candidates[k];
        candidates[k].prior = if one.effects().len() > 1 {
            1.0 / tried.max(1) as f64
        } else {
            let same = candidates.iter().filter(|other| {
                let is_single = one.effects().len() == 1 && other.effects().len() == 1;
                is_single && other.groups() == one.groups() || one.hypothesis == other.hypothesis
            });
            let weight = match one.hypothesis {
                Hypothesis::None => NO_GAP_PRIOR,
                _ => 1.0,
            };
            weight / same.count() as f64
        };
    }
    let logs: Vec<f64> = candidates.iter().map(Candidate::log_weight).collect();
    let total = log_sum(&logs);
    for (candidate, log) in candidates.iter_mut().zip(&logs) {
        candidate.probability = (log - total).exp();
    }
    sort(candidates);
}

fn sort(candidates: &mut [Candidate]) {
    candidates.sort_by(|a, b| b.probability.total_cmp(&a.probability));
}

/// Returns the best explanation that can be shown: `unknown` has no residual.
pub fn best_known(candidates: &[Candidate]) -> Option<usize> {
    candidates.iter().position(|one| !one.is_unknown())
}

/// Lowers the probability of the best explanation by what its own misfit says against it.
///
/// A misfit of probability p speaks against an explanation with odds of 1 to -e p ln p at most (Sellke, Bayarri &
/// Berger 2001). Such odds count against every explanation that is about as probable as the best. Evidence compares
/// how well explanations fit under the assumed noise; one that this noise refutes is no explanation
/// while another stands. If none stands, the noise is in doubt, and with it the evidence. The odds that remain against
/// the one that is left are evidence for something unknown, which
/// has no misfit of its own. A best explanation that stands is left alone: what refutes its rivals makes it no
/// better.
pub fn calibrate_by_p_value(dataset: &Dataset, candidates: &mut [Candidate]) {
    let Some(best) = best_known(candidates) else {
        return;
    };
    let odds = odds_against(dataset, &candidates[best]);
    if odds <= 1.0 {
        return;
    }
    let mut all: Vec<Option<f64>> = vec![None; candidates.len()];
    all[best] = Some(odds);
    // Down to explanations as good as the best, and then as good as the best that is not refuted.
    let mut least = candidates[best].probability * (-SECOND_EFFECT).exp();
    let mut stands = false;
    for (k, candidate) in candidates.iter().enumerate().skip(best + 1) {
        if candidate.is_unknown() || candidate.probability < least {
            continue;
        }
        all[k] = Some(odds_against(dataset, candidate));
        if !stands && all[k] == Some(1.0) {
            stands = true;
            least = candidate.probability * (-SECOND_EFFECT).exp();
        }
    }
    let probabilities: Vec<f64> = candidates.iter().map(|one| one.probability).collect();
    let Some((left, relative)) = relative_odds(&probabilities, &all) else {
        return;
    };
    let name = candidates[left].hypothesis.clone();
    let lowered = divided(&probabilities, &relative);
    for (candidate, probability) in candidates.iter_mut().zip(lowered) {
        candidate.probability = probability;
    }
    sort(candidates);
    let left_now = candidates.iter().position(|one| one.hypothesis == name);
    if let Some((left_now, odds)) = left_now.zip(all[left].filter(|odds| *odds > 1.0)) {
        raise_unknown(candidates, left_now, odds);
    }
}

/// Returns the odds against one explanation; infinite where its fit has no covariance to be tested with.
fn odds_against(dataset: &Dataset, candidate: &Candidate) -> f64 {
    let Some(goodness) = GoodnessOfFit::new(dataset, &candidate.fit) else {
        return f64::INFINITY;
    };
    goodness.refuting_p_value().map_or(1.0, odds_by_p_value)
}

/// Returns the highest odds against an explanation whose misfit has the probability `p`.
pub fn odds_by_p_value(p: f64) -> f64 {
    let p = p.clamp(SMALLEST_P_VALUE, 1.0 / E);
    -1.0 / (E * p * p.ln())
}

/// Returns which of the tested explanations is left, the first of equal ones, and the odds against every
/// other of them over those against it; `None` where none was tested or all have infinite odds against them.
fn relative_odds(probabilities: &[f64], odds: &[Option<f64>]) -> Option<(usize, Vec<Option<f64>>)> {
    let mut left: Option<(usize, f64)> = None;
    for (k, odds) in odds.iter().enumerate() {
        if let Some(odds) = odds.filter(|odds| odds.is_finite()) {
            let weight = probabilities[k] / odds;
            if left.is_none_or(|(_, most)| weight > most) {
                left = Some((k, weight));
            }
        }
    }
    let (left, _) = left?;
    let own = odds[left]?;
    let relative = odds.iter().map(|odds| Some((*odds)? / own));
    Some((left, relative.collect()))
}

/// Returns probabilities divided by odds, with the sum 1.
fn divided(probabilities: &[f64], odds: &[Option<f64>]) -> Vec<f64> {
    let each = probabilities.iter().zip(odds);
    let each: Vec<f64> = each.map(|(p, odds)| p / odds.unwrap_or(1.0)).collect();
    let total: f64 = each.iter().sum();
    each.into_iter().map(|p| p / total).collect()
}

/// Gives `unknown` odds of at least `bayes_factor` times the prior ones against the hypothesis
/// `refuted`; all others keep theirs among each other.
fn raise_unknown(candidates: &mut [Candidate], refuted: usize, bayes_factor: f64) {
    let Some(unknown) = candidates.iter().position(Candidate::is_unknown) else {
        return;
    };
    let odds = bayes_factor * candidates[unknown].prior / candidates[refuted].prior;
    let weight = odds * candidates[refuted].probability;
    if weight <= candidates[unknown].probability {
        return;
    }
    let total = 1.0 - candidates[unknown].probability + weight;
    candidates[unknown].probability = weight;
    for candidate in candidates.iter_mut() {
        candidate.probability /= total;
    }
    sort(candidates);
}

/// Candidates of one group of effects; pairs, `none` and `unknown` are groups of their own.
pub struct CandidateGroup {
    /// Indices of the candidates, the most probable first.
    pub members: Vec<usize>,
    /// Probability of the group (1).
    pub probability: f64,
}

/// Returns all groups, the most probable first.
pub fn by_group(candidates: &[Candidate]) -> Vec<CandidateGroup> {
    let mut groups: Vec<CandidateGroup> = Vec::new();
    for (index, candidate) in candidates.iter().enumerate() {
        let same = groups.iter_mut().find(|group| {
            let other = &candidates[group.members[0]];
            other.effects().len() == candidate.effects().len()
                && match candidate.effects().len() {
                    0 => other.hypothesis == candidate.hypothesis,
                    _ => other.groups() == candidate.groups(),
                }
        });
        match same {
            Some(group) => {
                group.members.push(index);
                group.probability += candidate.probability;
            }
            None => groups.push(CandidateGroup {
                members: vec![index],
                probability: candidate.probability,
            }),
        }
    }
    groups.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    groups
}

/// Returns the probability of each location, given that there is a gap.
pub fn location_probabilities(candidates: &[Candidate]) -> LocationProbabilities {
    let mut all = LocationProbabilities::default();
    let gaps = candidates
        .iter()
        .filter(|one| one.hypothesis != Hypothesis::None);
    let total: f64 = gaps.map(|one| one.probability).sum();
    if total <= 0.0 {
        return all;
    }
    for candidate in candidates {
        let probability = candidate.probability / total;
        let share = probability / candidate.effects().len().max(1) as f64;
        if candidate.is_unknown() {
            all.unknown += probability;
        }
        for effect in candidate.effects() {
            *match effect.place() {
                Place::Joint => &mut all.joint,
                Place::Fixture => &mut all.fixture,
                Place::Sensor => &mut all.sensor,
                Place::Body => &mut all.body,
                Place::Acquisition => &mut all.acquisition,
            } += share;
        }
    }
    all
}

/// Returns the squared distance of the predictions of two fits, in standard deviations of the data.
fn separation(dataset: &Dataset, a: &Fit, b: &Fit) -> f64 {
    let a = &a.best.optimum.model.predicted;
    let b = &b.best.optimum.model.predicted;
    let data = dataset.data.iter().enumerate();
    data.map(|(row, datum)| ((a[row] - b[row]) / datum.std).powi(2))
        .sum()
}

/// Returns the chi square by which a rival fits worse, priors included.
pub fn delta_chi_square(best: &Fit, rival: &Fit) -> f64 {
    2.0 * (rival.best.optimum.objective - best.best.optimum.objective)
}

/// Returns the effects whose best fit predicts the same as that of a candidate.
pub fn confounded(dataset: &Dataset, candidates: &[Candidate], index: usize) -> Vec<EffectId> {
    let own = &candidates[index];
    if own.is_unknown() {
        return Vec::new();
    }
    let mut all = Vec::new();
    for (k, other) in candidates.iter().enumerate() {
        if let [effect] = other.effects()
            && k != index
            && separation(dataset, &own.fit, &other.fit) < SEPARATE
            && delta_chi_square(&own.fit, &other.fit).abs() < SEPARATE
            && !own.effects().contains(effect)
        {
            all.push(*effect);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A refuted hypothesis, even against all odds, leaves the others as they were among each other.
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

    /// At p = 1/e and above a misfit does not count; below, the odds grow and stay finite down to zero.
    #[test]
    fn limit_odds_from_a_misfit_are_even_at_best_and_finite_at_worst() {
        assert!((odds_by_p_value(1.0) - 1.0).abs() < 1e-15);
        assert!((odds_by_p_value((-1.0_f64).exp()) - 1.0).abs() < 1e-15);
        assert!(odds_by_p_value(0.0).is_finite());
        assert!(odds_by_p_value(0.0) > odds_by_p_value(1e-6));
    }

    /// Sellke, Bayarri & Berger (2001), table 1: at least 0.407 at p = 0.05 and 0.125 at p = 0.01, to the
    /// digits printed there.
    #[test]
    fn val_odds_from_a_misfit_are_those_of_sellke() {
        for (p, bound) in [(0.05, 0.407), (0.01, 0.125)] {
            assert!((1.0 / odds_by_p_value(p) - bound).abs() < 5e-4, "{p}");
        }
    }

    /// Equal odds against two change nothing between them, and of equal weights the first is left.
    #[test]
    fn limit_equal_odds_keep_the_order() {
        let (first, relative) =
            relative_odds(&[0.4, 0.4, 0.2], &[Some(9.0), Some(9.0), None]).unwrap();
        assert_eq!(first, 0);
        assert_eq!(relative, [Some(1.0), Some(1.0), None]);
    }

    /// A rival against which less speaks takes the place; untested ones keep their odds to it.
    #[test]
    fn regress_an_explanation_that_stands_takes_the_place_of_a_refuted_one() {
        let (first, relative) =
            relative_odds(&[0.8, 0.15, 0.05], &[Some(40.0), Some(4.0), None]).unwrap();
        assert_eq!(first, 1);
        assert_eq!(relative, [Some(10.0), Some(1.0), None]);
    }

    #[test]
    fn limit_infinite_odds_against_all_leave_nothing_to_choose() {
        let infinite = Some(f64::INFINITY);
        assert_eq!(relative_odds(&[0.5, 0.5], &[infinite, infinite]), None);
        let (first, relative) = relative_odds(&[0.9, 0.1], &[infinite, Some(2.0)]).unwrap();
        assert_eq!((first, relative), (1, vec![infinite, Some(1.0)]));
    }
}
