//! Predicted data of each hypothesis in a planned test, and the information that they would bring.

use super::proposals::{PlannedTests, TestedStructure};
use crate::dataset::{Dataset, Observable};
use crate::description::{PROPERTIES, mass_slope};
use crate::forward::Forward;
use crate::optimum::{Model, Optimum, log_determinant};
use crate::parameters::{CandidateEffect, Layout, Nuisance, NuisanceParameter, Prior};
use crate::result::Proposal;
use crate::verdict::Candidate;
use nalgebra::{DMatrix, DVector};
use tapjoint_beam::effects::EffectId;
use tapjoint_identify::consistent::Parameter;

/// Data that one hypothesis predicts for a test: a normal distribution.
#[derive(Debug, Clone)]
pub struct PredictedData {
    /// Expected data.
    pub mean: DVector<f64>,
    /// Covariance of the prediction, and of the data where they are in units of their own uncertainty.
    pub covariance: DMatrix<f64>,
}

impl PredictedData {
    /// Returns some of the data, from this index on, in units of their standard uncertainties, and with these.
    pub fn in_units_of(&self, from: usize, stds: &[f64]) -> PredictedData {
        let count = stds.len();
        let mean = DVector::from_fn(count, |i, _| self.mean[from + i] / stds[i]);
        let covariance = DMatrix::from_fn(count, count, |i, j| {
            let own = if i == j { 1.0 } else { 0.0 };
            own + self.covariance[(from + i, from + j)] / (stds[i] * stds[j])
        });
        PredictedData { mean, covariance }
    }
}

/// Returns Bhattacharyya's distance of two normal distributions,
///
/// ```text
///     1                                    1          det C
/// D = - (m_i - m_j)' C^-1 (m_i - m_j)  +  - ln ------------------- ,  C = (C_i + C_j)/2
///     8                                    2    sqrt(det C_i det C_j)
/// ```
///
/// The first term is the difference of the expected data (Box & Hill 1967, with the open
/// parameters of each hypothesis in C); the second is the information about an effect whose size is open:
/// a test of the tap level scatters widely if the joint may soften, and hardly if it may not.
fn distance(a: &PredictedData, b: &PredictedData) -> Option<f64> {
    let middle = (0.5 * (&a.covariance + &b.covariance)).cholesky()?;
    let apart = &a.mean - &b.mean;
    let by_mean = apart.dot(&middle.solve(&apart)) / 8.0;
    let own = log_determinant(&a.covariance.clone().cholesky()?)
        + log_determinant(&b.covariance.clone().cholesky()?);
    let by_spread = 0.5 * (log_determinant(&middle) - 0.5 * own);
    Some(by_mean + by_spread.max(0.0))
}

/// Returns all distances between predictions; `None` where one of them is no distribution.
pub fn distances(all: &[PredictedData]) -> Option<DMatrix<f64>> {
    let mut distances = DMatrix::zeros(all.len(), all.len());
    for i in 0..all.len() {
        for j in 0..i {
            let apart = distance(&all[i], &all[j])?;
            distances[(i, j)] = apart;
            distances[(j, i)] = apart;
        }
    }
    Some(distances)
}

/// Returns the least expected information (bit) of data about which hypothesis is true,
/// I >= -sum_i p_i ln sum_j p_j exp(-D_ij) (Kolchinsky & Tracey 2017). It lies between 0 and the entropy of
/// the p, and is never less than Box and Hill's sum_ij p_i p_j (1 - exp(-D_ij)).
pub fn expected_information(probabilities: &[f64], distances: &DMatrix<f64>) -> f64 {
    let mut nats = 0.0;
    for (i, own) in probabilities.iter().enumerate() {
        if *own > 0.0 {
            let terms = probabilities.iter().enumerate();
            let alike: f64 = terms.map(|(j, p)| p * (-distances[(i, j)]).exp()).sum();
            nats += -own * alike.ln();
        }
    }
    (nats / std::f64::consts::LN_2).max(0.0)
}

/// Posterior of a hypothesis, from which planned tests are predicted.
pub struct Posterior {
    effects: Vec<CandidateEffect>,
    parameters: Vec<f64>,
    covariance: DMatrix<f64>,
    priors: Vec<Prior>,
    /// Number of discrepancies, one for each mode.
    discrepancies: usize,
    /// Spread of the discrepancies (1); 0 where there are none.
    discrepancy_std: f64,
    /// Spread of the joint between set-ups (1).
    drift: f64,
    /// Weight of the beam (N), half of which pulls on the average section.
    weight: f64,
}

/// Usual drift of a joint whose fit has none (1).
const USUAL_DRIFT: f64 = 0.01;

impl Posterior {
    /// Returns the posterior of a candidate; `weight` is that of the beam (N).
    pub fn new(dataset: &Dataset, candidate: &Candidate, weight: f64) -> Option<Self> {
        let best = &candidate.fit.best;
        let layout = dataset.layout(&candidate.fit.effects);
        let first = layout.first_nuisance();
        let own = first + dataset.nuisances.len();
        let (parameters, covariance) = sharpened(&layout, &best.priors, &best.optimum)?;
        let fitted = dataset.first_drift().map(|k| best.priors[first + k].std);
        let discrepancy = best.priors.get(own).filter(|_| candidate.is_unknown());
        Some(Posterior {
            effects: candidate.fit.effects.clone(),
            parameters,
            covariance,
            priors: best.priors.clone(),
            discrepancies: best.priors.len().saturating_sub(own),
            discrepancy_std: discrepancy.map_or(0.0, |prior| prior.std),
            // One set-up alone has its own joint: the next one differs from it by two drifts.
            drift: (candidate.drift.or(fitted)).unwrap_or(std::f64::consts::SQRT_2 * USUAL_DRIFT),
            weight,
        })
    }

    /// Index of the size of one of its effects.
    fn size(&self, dataset: &Dataset, wanted: EffectId) -> Option<usize> {
        let layout = dataset.layout(&self.effects);
        let index = self.effects.iter().position(|one| one.is(wanted))?;
        Some(layout.size(index))
    }

    /// Returns the posterior with the nuisance parameters of the planned tests.
    fn extended(&self, planned: &PlannedTests) -> (Vec<f64>, Vec<Prior>, DMatrix<f64>) {
        let added = &planned.whole.nuisances[planned.first_added..];
        let (old, count) = (self.parameters.len(), self.parameters.len() + added.len());
        let mut parameters = self.parameters.clone();
        parameters.resize(count, 0.0);
        let mut priors = self.priors.clone();
        let mut covariance = self.covariance.clone().resize(count, count, 0.0);
        for (k, nuisance) in added.iter().enumerate() {
            let std = if nuisance.parameter.is_drift() {
                self.drift.max(nuisance.std)
            } else {
                nuisance.std
            };
            priors.push(Prior::normal(0.0, std));
            covariance[(old + k, old + k)] = std * std;
        }
        (parameters, priors, covariance)
    }

    /// Returns the planned data with the nuisance parameters of this hypothesis.
    fn dataset(&self, planned: &PlannedTests, structure: TestedStructure) -> Option<Dataset> {
        let mut dataset = match structure {
            TestedStructure::Bare => planned.bare.clone()?,
            _ => planned.whole.clone(),
        };
        // Those of the planned tests come last.
        let at = planned.first_added;
        let discrepancies = (1..=self.discrepancies).map(|mode| Nuisance {
            parameter: NuisanceParameter::Discrepancy { mode },
            centre: 0.0,
            std: self.discrepancy_std,
        });
        dataset.nuisances.splice(at..at, discrepancies);
        let column = self.size(&planned.whole, EffectId::AxialLoad);
        if let (Some(turned), TestedStructure::Whole, Some(column)) =
            (planned.turned, structure, column)
        {
            let force = self.parameters[column];
            let turned = &mut dataset.arrangements[turned];
            turned.specimen.axial_force += force * self.turning(column) - force;
        }
        Some(dataset)
    }

    /// Returns an axial force with the set-up turned over, over what it was. As much of it as half the weight may
    /// be gravity; a force that is mostly something else stays.
    fn turning(&self, column: usize) -> f64 {
        let likely = self.parameters[column]
            .abs()
            .max(self.covariance[(column, column)].sqrt());
        1.0 - 2.0 * (0.5 * self.weight / likely.max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// Predicts observables of a structure, one after the other.
    pub fn predict(
        &self,
        planned: &PlannedTests,
        structure: TestedStructure,
        observables: &[Observable],
    ) -> Option<PredictedData> {
        let dataset = self.dataset(planned, structure)?;
        let (parameters, priors, covariance) = self.extended(planned);
        let full = planned.whole.layout(&self.effects);
        let kept: Vec<usize> = (0..self.effects.len())
            .filter(|&k| structure.shows(&self.effects[k]))
            .collect();
        let effects: Vec<CandidateEffect> = kept.iter().map(|&k| self.effects[k]).collect();
        let layout = dataset.layout(&effects);
        // The beam alone has no joint.
        let mut columns: Vec<usize> = (0..layout.joint.len()).collect();
        for k in kept {
            columns.push(full.size(k));
            columns.extend(full.location(k));
        }
        columns.extend(full.first_nuisance()..parameters.len());
        let forward = Forward {
            dataset: &dataset,
            layout,
            observables,
        };
        let own: Vec<f64> = columns.iter().map(|&column| parameters[column]).collect();
        let own_priors: Vec<Prior> = columns.iter().map(|&column| priors[column]).collect();
        let model = forward.linearise(&own, &own_priors)?;
        let mut slopes = DMatrix::zeros(observables.len(), parameters.len());
        for (k, &column) in columns.iter().enumerate() {
            slopes.set_column(column, &model.slopes.column(k));
        }
        let column = self.size(&planned.whole, EffectId::AxialLoad);
        if let (Some(turned), Some(column)) = (planned.turned, column) {
            let factor = self.turning(column);
            for (row, observable) in observables.iter().enumerate() {
                if observable.configuration == turned {
                    slopes[(row, column)] *= factor;
                }
            }
        }
        let mut prediction = PredictedData {
            mean: DVector::from_vec(model.predicted),
            covariance: &slopes * covariance * slopes.transpose(),
        };
        self.add_discrepancies(structure, observables, &mut prediction.covariance);
        if structure == TestedStructure::Bare {
            let missed = dataset.settings.discrepancy.powi(2);
            for row in 0..observables.len() {
                prediction.covariance[(row, row)] += missed;
            }
        }
        Some(prediction)
    }

    /// Adds the discrepancy of an unknown cause in modes that were not observed, or of the beam
    /// alone; and a tenth of it for each datum of its own.
    fn add_discrepancies(
        &self,
        structure: TestedStructure,
        observables: &[Observable],
        covariance: &mut DMatrix<f64>,
    ) {
        let variance = self.discrepancy_std * self.discrepancy_std;
        for (i, one) in observables.iter().enumerate() {
            for (j, other) in observables.iter().enumerate() {
                let is_new = structure == TestedStructure::Bare || one.mode > self.discrepancies;
                if is_new && one.mode == other.mode {
                    covariance[(i, j)] += variance;
                }
            }
            covariance[(i, i)] += 0.01 * variance;
        }
    }

    /// Predicts a test that measures other quantities than frequencies; `None` for all others.
    pub fn predict_direct(&self, dataset: &Dataset, proposal: &Proposal) -> Option<PredictedData> {
        let (nominal, sensor) = (&dataset.nominal, SENSOR_MASS_STD);
        let (expected, stds) = match proposal {
            Proposal::WeighSensor => (
                vec![self.size_or_usual(dataset, EffectId::SensorMass, 1.0, 2.0 * sensor)],
                vec![sensor],
            ),
            Proposal::Calipers => {
                let per_mass = 1.0 / nominal.beam_mass();
                let mass = self.described(
                    dataset,
                    &PROPERTIES.map(|property| (property, mass_slope(property))),
                );
                let thickness = self.described(dataset, &[(Parameter::Thickness, 1.0)]);
                let length = self.described(dataset, &[(Parameter::Length, 1.0)]);
                let beam = &nominal.specimen.body.beams()[0];
                (
                    vec![
                        mass.and(self.size(dataset, EffectId::AddedMass), per_mass, self),
                        thickness,
                        length.and(self.size(dataset, EffectId::Length), 1.0, self),
                    ],
                    vec![
                        BEAM_MASS_STD,
                        CALIPER_STD / beam.thickness,
                        TAPE_STD / nominal.length(),
                    ],
                )
            }
            Proposal::ReferenceTone => (
                vec![self.size_or_usual(dataset, EffectId::Timebase, 1.0, USUAL_CLOCK_ERROR)],
                vec![CLOCK_STD],
            ),
            _ => return None,
        };
        let mut slopes = DMatrix::zeros(expected.len(), self.parameters.len());
        for (row, one) in expected.iter().enumerate() {
            for (column, slope) in &one.slopes {
                slopes[(row, *column)] = *slope;
            }
        }
        let mut covariance = &slopes * &self.covariance * slopes.transpose();
        for (row, one) in expected.iter().enumerate() {
            covariance[(row, row)] += one.std * one.std;
        }
        let mean = DVector::from_iterator(expected.len(), expected.iter().map(|one| one.value));
        Some(PredictedData { mean, covariance }.in_units_of(0, &stds))
    }

    /// Predicts the size of an effect times a factor, or what is usual if the hypothesis does not have it.
    fn size_or_usual(
        &self,
        dataset: &Dataset,
        effect: EffectId,
        factor: f64,
        usual: f64,
    ) -> DirectQuantity {
        match self.size(dataset, effect) {
            Some(column) => DirectQuantity {
                value: factor * self.parameters[column],
                slopes: vec![(column, factor)],
                std: 0.0,
            },
            None => DirectQuantity {
                value: 0.0,
                slopes: Vec::new(),
                std: usual,
            },
        }
    }

    /// Predicts a sum of what differs from the description of the beam, each property with its factor.
    fn described(&self, dataset: &Dataset, sum: &[(Parameter, f64)]) -> DirectQuantity {
        let first = dataset.layout(&self.effects).first_nuisance();
        let mut expected = DirectQuantity::default();
        for &(property, factor) in sum {
            let index = dataset.nuisance_index(NuisanceParameter::Property { property });
            expected = expected.and(index.map(|index| first + index), factor, self);
        }
        expected
    }
}

/// Prediction of one quantity that is measured directly.
#[derive(Default)]
struct DirectQuantity {
    value: f64,
    /// Slopes with respect to the parameters of the hypothesis.
    slopes: Vec<(usize, f64)>,
    /// Standard deviation beside that of the parameters.
    std: f64,
}

impl DirectQuantity {
    /// Returns it with one more parameter of the hypothesis, times a factor; the same where it has no such parameter.
    fn and(mut self, column: Option<usize>, factor: f64, of: &Posterior) -> Self {
        if let Some(column) = column {
            self.value += factor * of.parameters[column];
            self.slopes.push((column, factor));
        }
        self
    }
}

/// Standard uncertainty of a sensor's mass on a kitchen scale with its share of the cable (kg).
const SENSOR_MASS_STD: f64 = 5e-4;
/// Standard uncertainty of the beam's free length by a tape (m).
const TAPE_STD: f64 = 2e-4;
/// Standard uncertainty of the beam's thickness by a caliper (m).
const CALIPER_STD: f64 = 1e-5;
/// Relative standard uncertainty of the beam's mass on a scale (1).
const BEAM_MASS_STD: f64 = 1e-3;
/// Relative standard uncertainty of a clock that is compared with a reference (1).
const CLOCK_STD: f64 = 2e-5;
/// Usual relative error of clocks (1).
const USUAL_CLOCK_ERROR: f64 = 5e-5;

/// Returns the optimum and its covariance with the priors of sizes and locations as Gaussians of the same second
/// moment: the search has only a wide one on sizes, and none on locations.
fn sharpened(
    layout: &Layout,
    priors: &[Prior],
    optimum: &Optimum,
) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let mut better = optimum.clone();
    let mut pull: DVector<f64> = DVector::zeros(priors.len());
    for (k, candidate) in layout.effects.iter().enumerate() {
        let (column, size) = (layout.size(k), &candidate.size);
        if priors[column].is_held() {
            continue;
        }
        let value = optimum.parameters[column];
        // Near zero the prior is as wide as its scale, in its tail as the size itself.
        let width = size.scale.hypot(value - size.neutral);
        let more = width.powi(-2) - priors[column].std.powi(-2);
        better.curvature[(column, column)] += more;
        pull[column] = more * (value - size.neutral);
        // Pressed against its bound the size is spread as exp(-g t): a second moment of 2/g^2.
        if value <= size.low || value >= size.high {
            better.curvature[(column, column)] += 0.5 * optimum.gradient[column].powi(2);
        }
        if let (Some(location), Some(range)) = (layout.location(k), candidate.location) {
            // Uniform over a range r: a variance of r^2/12.
            let (low, high) = range.searched_bounds();
            better.curvature[(location, location)] += 12.0 / ((high - low) * (high - low));
        }
    }
    let covariance = better.covariance(priors)?;
    let step = -&covariance * pull;
    let parameters = optimum.parameters.iter().zip(step.iter()).zip(priors);
    let parameters = parameters
        .map(|((value, step), prior)| (value + step).clamp(prior.low, prior.high))
        .collect();
    Some((parameters, covariance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Predictions of three data from numbers: means, and slopes with respect to two open parameters.
    fn predictions(numbers: &[f64]) -> Vec<PredictedData> {
        numbers
            .chunks_exact(9)
            .map(|n| {
                let slopes = DMatrix::from_column_slice(3, 2, &n[3..9]);
                PredictedData {
                    mean: DVector::from_column_slice(&n[..3]),
                    covariance: DMatrix::identity(3, 3) + &slopes * slopes.transpose(),
                }
            })
            .collect()
    }

    fn normalised(weights: &[f64]) -> Vec<f64> {
        let total: f64 = weights.iter().sum();
        weights.iter().map(|w| w / total).collect()
    }

    fn entropy(probabilities: &[f64]) -> f64 {
        probabilities.iter().map(|p| -p * p.log2()).sum()
    }

    proptest! {
        #[test]
        fn prop_information_lies_between_nothing_and_the_entropy(
            numbers in prop::collection::vec(-5.0..5.0_f64, 36),
            weights in prop::collection::vec(0.01..1.0_f64, 4),
        ) {
            let p = normalised(&weights);
            let all = distances(&predictions(&numbers)).unwrap();
            let bits = expected_information(&p, &all);
            prop_assert!(bits >= 0.0 && bits <= entropy(&p) + 1e-12, "{bits}");
            // Box and Hill's sum is the weaker bound: -ln x >= 1 - x.
            let box_hill: f64 = (0..4)
                .flat_map(|i| (0..4).map(move |j| (i, j)))
                .map(|(i, j)| p[i] * p[j] * (1.0 - (-all[(i, j)]).exp()))
                .sum();
            prop_assert!(bits * std::f64::consts::LN_2 >= box_hill - 1e-12);
        }

        #[test]
        fn prop_information_does_not_depend_on_the_order(
            numbers in prop::collection::vec(-5.0..5.0_f64, 27),
            weights in prop::collection::vec(0.01..1.0_f64, 3),
        ) {
            let (p, forward) = (normalised(&weights), predictions(&numbers));
            let back: Vec<PredictedData> = forward.iter().rev().cloned().collect();
            let q: Vec<f64> = p.iter().rev().copied().collect();
            let one = expected_information(&p, &distances(&forward).unwrap());
            let other = expected_information(&q, &distances(&back).unwrap());
            prop_assert!((one - other).abs() < 1e-12, "{one} {other}");
        }

        #[test]
        fn prop_what_moves_nothing_brings_nothing(
            mean in prop::collection::vec(-5.0..5.0_f64, 9),
            weights in prop::collection::vec(0.01..1.0_f64, 3),
        ) {
            let one = predictions(&mean);
            let same = [one[0].clone(), one[0].clone(), one[0].clone()];
            let bits = expected_information(&normalised(&weights), &distances(&same).unwrap());
            prop_assert!(bits.abs() < 1e-12, "{bits}");
        }
    }

    #[test]
    fn limit_one_hypothesis_leaves_nothing_to_learn() {
        let all = distances(&predictions(&[1.0; 9])).unwrap();
        assert!(expected_information(&[1.0], &all).abs() < 1e-15);
    }

    #[test]
    fn limit_readings_far_apart_bring_the_whole_entropy() {
        let numbers: Vec<f64> = (0..27)
            .map(|k| if k % 9 == 0 { 1e3 * f64::from(k) } else { 0.0 })
            .collect();
        let p = [0.5, 0.3, 0.2];
        let bits = expected_information(&p, &distances(&predictions(&numbers)).unwrap());
        assert!((bits - entropy(&p)).abs() < 1e-9, "{bits}");
    }

    #[test]
    fn limit_infinitely_uncertain_readings_bring_nothing() {
        // In units of their own uncertainty nothing that is expected differs.
        let scale = |prediction: &PredictedData| PredictedData {
            mean: 1e-9 * &prediction.mean,
            covariance: DMatrix::identity(3, 3)
                + 1e-18 * (&prediction.covariance - DMatrix::identity(3, 3)),
        };
        let sharp = predictions(&(0..18).map(f64::from).collect::<Vec<_>>());
        let blurred: Vec<PredictedData> = sharp.iter().map(scale).collect();
        let bits = expected_information(&[0.5, 0.5], &distances(&blurred).unwrap());
        assert!(bits < 1e-12, "{bits}");
    }

    #[test]
    fn val_distance_of_two_normal_distributions() {
        // One reading, means 0 and 2, variances 1 and 4: (2^2/2.5)/8 + ln(2.5/2)/2.
        let one = |mean: f64, variance: f64| PredictedData {
            mean: DVector::from_element(1, mean),
            covariance: DMatrix::from_element(1, 1, variance),
        };
        let expected = 4.0 / 2.5 / 8.0 + 0.5 * 1.25_f64.ln();
        assert!((distance(&one(0.0, 1.0), &one(2.0, 4.0)).unwrap() - expected).abs() < 1e-14);
    }
}
