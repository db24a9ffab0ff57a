//! The next test: the one with the most expected information per cost about which hypothesis is true.
//!
//! Every probable hypothesis predicts each possible test from its optimum and the uncertainty
//! of its parameters. The further apart these predictions lie, in standard
//! deviations of the data, the more the test decides. Tests that keep the joint untouched gain
//! by comparison with the existing data; all planned set-ups have a drift of the joint of their own.

mod predicted_data;
mod proposals;

use crate::compare::ModelComparison;
use crate::result::{NextTest, Proposal, Verdict};
use crate::thresholds::Thresholds;
use crate::verdict::{Candidate, shown_probability};
use nalgebra::DMatrix;
use predicted_data::{Posterior, PredictedData, distances, expected_information};
use proposals::{PlannedTests, TestedStructure, sentence};
use rayon::prelude::*;
use std::collections::BTreeSet;
use tapjoint_numerics::quantity::STANDARD_GRAVITY;

/// Returns the tests that would decide between hypotheses, those with most information per cost first; and last how a
/// named cause can be seen directly, where none of these shows it as well.
pub fn next_tests(comparison: &ModelComparison, verdict: &Verdict) -> Vec<NextTest> {
    let mut tests = deciding(comparison, verdict);
    if let Verdict::Named(effects) = verdict {
        let most = comparison.dataset.settings.thresholds.most_proposed;
        tests.truncate(most.saturating_sub(effects.len()));
        for &effect in effects {
            // It brings no information about the existing hypotheses.
            let proposal = Proposal::Confirm { effect };
            let action = sentence(&proposal);
            if tests.iter().all(|test| test.action != action) {
                tests.push(NextTest {
                    effort: proposal.effort(),
                    proposal,
                    action,
                    separates: vec![effect.name().to_owned()],
                    unpredicted: Vec::new(),
                    expected_information: 0.0,
                });
            }
        }
    }
    tests
}

/// Returns the tests that separate hypotheses, those with most information per cost first.
fn deciding(comparison: &ModelComparison, verdict: &Verdict) -> Vec<NextTest> {
    let dataset = &comparison.dataset;
    let thresholds = &dataset.settings.thresholds;
    let compared = Compared::new(&comparison.candidates, verdict, thresholds);
    if compared.candidates.len() < 2 {
        return Vec::new();
    }
    let weight = STANDARD_GRAVITY * dataset.nominal.beam_mass();
    let posteriors: Vec<Option<Posterior>> = compared
        .candidates
        .iter()
        .map(|candidate| Posterior::new(dataset, candidate, weight))
        .collect();
    let planned = PlannedTests::new(dataset);
    let predictions: Vec<Option<Predictions>> = posteriors
        .par_iter()
        .map(|posterior| Some(Predictions::new(posterior.as_ref()?, &planned)))
        .collect();
    let mut tests = Vec::new();
    for (k, test) in planned.all.iter().enumerate() {
        let of_test = posteriors.iter().zip(&predictions);
        let of_test = of_test.map(|(posterior, predictions)| {
            let direct = posterior.as_ref()?.predict_direct(dataset, &test.proposal);
            direct.or_else(|| predictions.as_ref()?.of_test(&planned, k))
        });
        tests.extend(compared.judge(&test.proposal, of_test.collect()));
    }
    tests.retain(|test| test.expected_information >= thresholds.least_information);
    tests.sort_by(|a, b| b.worth().total_cmp(&a.worth()));
    // The best test of each kind.
    let mut kinds = BTreeSet::new();
    tests.retain(|test| kinds.insert(test.proposal.id()));
    tests.truncate(thresholds.most_proposed);
    tests
}

/// Hypotheses that are compared.
struct Compared<'a> {
    candidates: Vec<&'a Candidate>,
    names: Vec<String>,
    /// Probabilities, which sum to 1.
    probabilities: Vec<f64>,
    thresholds: &'a Thresholds,
}

impl<'a> Compared<'a> {
    /// Takes the probable hypotheses. If none explains the data, their ranking means little: all count alike.
    fn new(all: &'a [Candidate], verdict: &Verdict, thresholds: &'a Thresholds) -> Self {
        let most = thresholds.most_compared;
        let mut candidates: Vec<&Candidate> = all.iter().take(most).collect();
        let mut probabilities = vec![1.0; candidates.len()];
        if *verdict != Verdict::Unknown {
            // A second cause that does not show is no reason for a test.
            candidates
                .retain(|one| shown_probability(one, all, thresholds) > thresholds.least_compared);
            let shown = candidates.iter();
            let shown = shown.map(|one| shown_probability(one, all, thresholds));
            probabilities = shown.collect();
        }
        let total: f64 = probabilities.iter().sum();
        for p in &mut probabilities {
            *p /= total;
        }
        Compared {
            names: candidates.iter().map(|one| one.hypothesis.name()).collect(),
            probabilities,
            candidates,
            thresholds,
        }
    }

    /// Returns the test with its information, from the predictions of all hypotheses; `None` where fewer than two
    /// predict it.
    ///
    /// Hypotheses with a prediction hold the share P of all probability. Knowing whether the truth is among them cannot
    /// hurt, so that the information about all hypotheses is P times that about them at least.
    fn judge(
        &self,
        proposal: &Proposal,
        predictions: Vec<Option<PredictedData>>,
    ) -> Option<NextTest> {
        let mut unpredicted = Vec::new();
        let (mut names, mut probabilities, mut data) = (Vec::new(), Vec::new(), Vec::new());
        for (k, prediction) in predictions.into_iter().enumerate() {
            match prediction {
                Some(prediction) => {
                    names.push(self.names[k].clone());
                    probabilities.push(self.probabilities[k]);
                    data.push(prediction);
                }
                None => unpredicted.push(self.names[k].clone()),
            }
        }
        if data.len() < 2 {
            return None;
        }
        let share: f64 = probabilities.iter().sum();
        for p in &mut probabilities {
            *p /= share;
        }
        let apart = distances(&data)?;
        Some(NextTest {
            proposal: proposal.clone(),
            effort: proposal.effort(),
            action: sentence(proposal),
            separates: separated(&probabilities, &names, &apart, self.thresholds),
            unpredicted,
            expected_information: share * expected_information(&probabilities, &apart),
        })
    }
}

/// Returns the hypotheses that a test separates: members of the pairs that contribute most.
fn separated(
    probabilities: &[f64],
    names: &[String],
    apart: &DMatrix<f64>,
    thresholds: &Thresholds,
) -> Vec<String> {
    let (share, most) = (thresholds.listed_information, thresholds.most_listed);
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for i in 0..names.len() {
        for j in 0..i {
            let gain = probabilities[i] * probabilities[j] * (1.0 - (-apart[(i, j)]).exp());
            pairs.push((gain, j, i));
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let total: f64 = pairs.iter().map(|pair| pair.0).sum();
    let mut held = 0.0;
    let mut separated: Vec<String> = Vec::new();
    for (gain, i, j) in pairs {
        if held >= share * total || separated.len() >= most {
            break;
        }
        held += gain;
        for name in [&names[i], &names[j]] {
            if !separated.contains(name) && separated.len() < most {
                separated.push(name.clone());
            }
        }
    }
    separated
}

/// Predictions of one hypothesis for all planned frequencies, by tested structure.
struct Predictions([Option<PredictedData>; 3]);

impl Predictions {
    fn new(posterior: &Posterior, planned: &PlannedTests) -> Self {
        Predictions(TestedStructure::ALL.map(|wanted| {
            let tests = planned.all.iter();
            let all = tests.flat_map(|test| test.frequencies_of(wanted));
            let observables: Vec<_> = all.map(|(observable, _)| *observable).collect();
            if observables.is_empty() {
                return None;
            }
            posterior.predict(planned, wanted, &observables)
        }))
    }

    /// Returns the predicted data of the k-th test.
    fn of_test(&self, planned: &PlannedTests, k: usize) -> Option<PredictedData> {
        let test = &planned.all[k];
        if test.frequencies.is_empty() {
            return None;
        }
        let before = planned.all[..k].iter();
        let from = before
            .map(|one| one.frequencies_of(test.structure).len())
            .sum();
        let stds: Vec<f64> = test.frequencies.iter().map(|(_, std)| *std).collect();
        let prediction = self.0[test.structure as usize].as_ref()?;
        Some(prediction.in_units_of(from, &stds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    fn prediction(mean: f64) -> Option<PredictedData> {
        Some(PredictedData {
            mean: DVector::from_element(1, mean),
            covariance: DMatrix::identity(1, 1),
        })
    }

    fn judged(predictions: [Option<PredictedData>; 3]) -> Option<NextTest> {
        let compared = Compared {
            thresholds: &Thresholds::DEFAULT,
            candidates: Vec::new(),
            names: ["none", "sensor-mass", "modulus"]
                .map(str::to_owned)
                .to_vec(),
            probabilities: vec![0.5, 0.25, 0.25],
        };
        compared.judge(&Proposal::Retighten, predictions.to_vec())
    }

    #[test]
    fn regress_a_hypothesis_without_prediction_is_listed_and_the_others_are_separated() {
        let all = judged([prediction(0.0), prediction(100.0), prediction(-100.0)]).unwrap();
        assert!(all.unpredicted.is_empty());
        // Three that lie far apart: the whole entropy of 1/2, 1/4, 1/4.
        let bits = all.expected_information;
        assert!((bits - 1.5).abs() < 1e-9, "{bits}");
        let two = judged([prediction(0.0), prediction(100.0), None]).unwrap();
        assert_eq!(two.unpredicted, ["modulus"]);
        assert_eq!(two.separates, ["none", "sensor-mass"]);
        // Three quarters of the entropy of 2/3 and 1/3.
        let entropy =
            -(2.0 / 3.0_f64) * (2.0 / 3.0_f64).log2() - (1.0 / 3.0_f64) * (1.0 / 3.0_f64).log2();
        assert!((two.expected_information - 0.75 * entropy).abs() < 1e-9);
        assert!(two.expected_information < bits);
    }

    #[test]
    fn limit_one_hypothesis_alone_is_not_judged() {
        assert!(judged([prediction(0.0), None, None]).is_none());
        assert!(judged([None, None, None]).is_none());
    }
}
