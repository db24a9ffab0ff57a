//! A change of the joint: translation, rotation and coupling at once.
//!
//! Often only one of them changes: then the others do not pay for being free. The evidence is the mean of that of each
//! stiffness alone and that of all together. Sizes are those of all together, which is the wider answer.
//!
//! The most probable change is searched by least squares. The posterior is summed over a grid about it, which is fine near
//! the centre and reaches to the largest changes.

use crate::cause::SizePrior;
use crate::likelihood::{Data, Likelihood, log_sum};
use crate::model::{PairModel, Predicted};
use crate::search::{Point, Posterior, normalised};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;
use std::f64::consts::PI;
use tapjoint_numerics::least_squares::{Linearised, Problem, Settings as SearchSettings, minimise};

/// Half width of the prior of a stiffness (logarithm), of the coupling, and of the compliance of a rigid joint (1, beams):
/// half of all changes are smaller.
const STIFFNESS: f64 = 0.1;
const COUPLING: f64 = 0.05;
const COMPLIANCE: f64 = 0.01;
/// Largest change of each: a factor of 20, the whole coupling, a joint as soft as the beam.
const MOST: [f64; 3] = [3.0, 0.5, 1.0];
/// Points on either side of the most probable change along each axis, for one, two and three directions.
const POINTS: [i32; 3] = [20, 12, 5];
/// Their distance near the centre, in standard deviations.
const POINT_STEP: f64 = 0.5;
/// Most searches, and the change of the prediction (1, standard deviations) at which they end.
const MOST_TURNS: usize = 6;
const SETTLED: f64 = 0.1;
/// Step of differences.
const STEP: f64 = 0.01;

/// Directions of a joint, and what is known of their changes.
pub(crate) struct JointChange {
    /// Directions: 0 translation, 1 rotation, 2 coupling.
    pub(crate) directions: Vec<usize>,
    half_widths: Vec<f64>,
    most: Vec<f64>,
}

impl JointChange {
    /// Returns the directions that may change; `None` where there is no joint.
    pub(crate) fn new(pairs: &[PairModel]) -> Option<Self> {
        let mut directions = pairs[0].joint_directions();
        directions.retain(|one| {
            pairs
                .iter()
                .all(|pair| pair.joint_directions().contains(one))
        });
        // A direction that is rigid in one description and elastic in another has no common size of its change.
        let all = pairs.iter().filter_map(PairModel::joints);
        let all: Vec<[f64; 2]> = all.flatten().map(|joint| [joint.kt, joint.kr]).collect();
        let stiffnesses = *all.first()?;
        directions.retain(|&one| {
            let mut others = all.iter();
            one > 1
                || others.all(|other| other[one].is_infinite() == stiffnesses[one].is_infinite())
        });
        let (mut half_widths, mut most) = (Vec::new(), Vec::new());
        for &direction in &directions {
            let is_rigid = direction < 2 && stiffnesses[direction].is_infinite();
            let kind = match direction {
                2 => 1,
                _ if is_rigid => 2,
                _ => 0,
            };
            half_widths.push([STIFFNESS, COUPLING, COMPLIANCE][kind]);
            most.push(MOST[kind]);
        }
        (!directions.is_empty()).then_some(Self {
            directions,
            half_widths,
            most,
        })
    }

    /// Returns the names of its values, by the joint of a pair.
    pub(crate) fn names(&self, pair: &PairModel) -> Vec<&'static str> {
        let stiffnesses = pair.structure().joint_stiffnesses();
        let names = self.directions.iter();
        names
            .map(|&direction| match direction {
                2 => "coupling",
                one if stiffnesses[one].is_infinite() => ["kt_compliance", "kr_compliance"][one],
                one => ["kt", "kr"][one],
            })
            .collect()
    }

    /// Returns the logarithm of the prior density.
    fn log_prior(&self, steps: &[f64]) -> f64 {
        let pairs = steps.iter().zip(&self.half_widths);
        pairs
            .map(|(step, half_width)| {
                SizePrior::Cauchy {
                    half_width: *half_width,
                    below: 0.5,
                }
                .log_density(*step)
            })
            .sum()
    }

    fn predict(&self, data: &Data<'_>, steps: &[f64]) -> Option<Vec<Predicted>> {
        let pairs = data.pairs.iter();
        pairs
            .map(|pair| pair.predict_joint(&self.directions, steps))
            .collect()
    }

    /// Returns the most probable change by searches from these starts; `None` where they fail.
    ///
    /// Its covariance depends on the change itself. So each turn takes that of the last turn's answer.
    fn peak<'a>(&self, data: &'a Data<'a>, starts: &[Vec<f64>]) -> Option<Peak<'a>> {
        let limits = SearchSettings {
            gain: 1e-4,
            polish: false,
            ..SearchSettings::default()
        };
        let mut reference: Vec<Predicted> = data.pairs.iter().map(Predicted::nothing).collect();
        let mut starts = starts.to_vec();
        for turn in 1.. {
            let likelihood = data.about(&reference)?;
            let search = Search {
                change: self,
                data,
                scatter: likelihood.favoured(&reference),
                likelihood: &likelihood,
                bounds: self.most.iter().map(|most| [-most, *most]).collect(),
            };
            let mut best: Option<(f64, Vec<f64>)> = None;
            for start in &starts {
                let Some(found) = minimise(&search, start, &limits) else {
                    continue;
                };
                let cost = search.cost(&found.state);
                if best.as_ref().is_none_or(|one| cost < one.0) {
                    best = Some((cost, found.parameters));
                }
            }
            let (_, centre) = best?;
            let state = search.evaluate(&centre, None)?;
            let predicted = self.predict(data, &centre)?;
            let moved = likelihood.distance(search.scatter, &reference, &predicted)?;
            if moved < SETTLED || turn == MOST_TURNS {
                let slopes = search.slopes(&centre, &state)?;
                let curvature = slopes.transpose() * slopes;
                return Some(Peak {
                    centre,
                    predicted,
                    curvature,
                    likelihood,
                });
            }
            reference = predicted;
            starts = vec![centre];
        }
        None
    }

    /// Returns the logarithm of the evidence by the parabola at its peak.
    fn log_evidence_at(&self, peak: &Peak<'_>) -> Option<f64> {
        let log_determinant = peak.curvature.clone().cholesky()?.determinant().ln();
        let half_count = 0.5 * peak.centre.len() as f64;
        let log = peak.likelihood.log_density(&peak.predicted) + self.log_prior(&peak.centre);
        Some(log + half_count * (2.0 * PI).ln() - 0.5 * log_determinant)
    }

    /// Returns the change of one stiffness alone.
    fn alone(&self, index: usize) -> Self {
        Self {
            directions: vec![self.directions[index]],
            half_widths: vec![self.half_widths[index]],
            most: vec![self.most[index]],
        }
    }

    /// Returns the number of ways in which the joint may change: each stiffness alone, and all together.
    fn ways(&self) -> f64 {
        match self.directions.len() {
            1 => 1.0,
            _ => self.directions.iter().filter(|one| **one < 2).count() as f64 + 1.0,
        }
    }

    /// Returns the logarithm of the evidence of a change of one stiffness, near this size.
    pub(crate) fn log_evidence_alone(
        &self,
        data: &Data<'_>,
        index: usize,
        size: f64,
    ) -> Option<f64> {
        let alone = self.alone(index);
        let peak = alone.peak(data, &[vec![size]])?;
        Some(alone.log_evidence_at(&peak)? - self.ways().ln())
    }

    /// Returns the posterior of a change; `None` where the search fails.
    pub(crate) fn posterior(&self, data: &Data<'_>) -> Option<Posterior> {
        let mut found = self.posterior_of_all(data)?;
        if self.directions.len() > 1 {
            let single = (0..self.directions.len()).filter(|index| self.directions[*index] < 2);
            let alone = single.filter_map(|index| self.alone(index).posterior_of_all(data));
            let mut logs: Vec<f64> = alone.map(|one| one.log_evidence).collect();
            logs.push(found.log_evidence);
            found.log_evidence = log_sum(logs.into_iter()) - self.ways().ln();
        }
        Some(found)
    }

    fn posterior_of_all(&self, data: &Data<'_>) -> Option<Posterior> {
        // The prior's long tails may leave two optima: one near no change, and one beyond.
        let starts = [0.0, 1.0, -1.0].map(|share| {
            let widths = self.half_widths.iter();
            widths.map(|width| share * width).collect()
        });
        let peak = self.peak(data, &starts)?;
        // Where the joint does not explain the changes, its sizes are less sure.
        let excess = peak
            .likelihood
            .excess(&peak.predicted, self.directions.len());
        let axes = SymmetricEigen::new(peak.curvature.clone());
        let count = self.directions.len();
        let each = POINTS[count - 1];
        let mut grids = Vec::with_capacity(count);
        for (value, axis) in axes.eigenvalues.iter().zip(axes.eigenvectors.column_iter()) {
            let shares = axis
                .iter()
                .zip(&self.most)
                .map(|(along, most)| most / along.abs());
            let reach = shares.fold(f64::INFINITY, f64::min) * 1.2;
            grids.push(stretched(each, (excess / value).sqrt(), reach));
        }
        let steps_each = (2 * each + 1) as usize;
        let indices: Vec<usize> = (0..steps_each.pow(count as u32)).collect();
        let points: Vec<Point> = indices
            .into_par_iter()
            .filter_map(|index| {
                let mut moved = DVector::from_column_slice(&peak.centre);
                let (mut rest, mut log_volume) = (index, 0.0);
                for (axis, grid) in grids.iter().enumerate() {
                    let (away, volume) = grid[rest % steps_each];
                    rest /= steps_each;
                    log_volume += volume.ln();
                    moved += axes.eigenvectors.column(axis) * away;
                }
                let mut sizes = moved.iter().zip(&self.most);
                if sizes.any(|(one, most)| one.abs() > *most) {
                    return None;
                }
                let predicted = self.predict(data, moved.as_slice())?;
                let log_prior = self.log_prior(moved.as_slice());
                let log_density = peak.likelihood.log_density(&predicted);
                Some(Point {
                    log_weight: log_density / excess + log_prior + log_volume,
                    log_prior,
                    log_density,
                    values: moved.as_slice().to_vec(),
                })
            })
            .collect();
        let mut found = normalised(points, |values| self.predict(data, values))?;
        if excess > 1.0 {
            found.log_evidence = self.log_evidence_at(&peak)?;
        }
        Some(found)
    }
}

/// The most probable change.
struct Peak<'a> {
    centre: Vec<f64>,
    /// What it predicts.
    predicted: Vec<Predicted>,
    /// Curvature of the logarithm of the posterior.
    curvature: DMatrix<f64>,
    /// Probability of the measured changes near it.
    likelihood: Likelihood<'a>,
}

/// Returns points about zero with the piece of the axis that each stands for: [`POINT_STEP`] standard deviations apart near
/// zero, and farther and farther apart up to `reach`: sinh of equal steps.
fn stretched(each: i32, std: f64, reach: f64) -> Vec<(f64, f64)> {
    let step = POINT_STEP * std;
    let (mut low, mut high) = (1e-6, 3.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let end = step * (middle * f64::from(each)).sinh() / middle;
        match end < reach {
            true => low = middle,
            false => high = middle,
        }
    }
    (-each..=each)
        .map(|k| {
            let along = low * f64::from(k);
            (step * along.sinh() / low, step * along.cosh())
        })
        .collect()
}

/// Search for the most probable change of the joint, at one value of the repeatability.
struct Search<'a> {
    change: &'a JointChange,
    data: &'a Data<'a>,
    likelihood: &'a Likelihood<'a>,
    /// Index of the repeatability.
    scatter: usize,
    bounds: Vec<[f64; 2]>,
}

impl Search<'_> {
    fn slopes(&self, parameters: &[f64], state: &[f64]) -> Option<DMatrix<f64>> {
        let mut slopes = DMatrix::zeros(state.len(), parameters.len());
        for column in 0..parameters.len() {
            let mut moved = parameters.to_vec();
            let step = if moved[column] > 0.0 { -STEP } else { STEP };
            moved[column] += step * self.change.half_widths[column] / STIFFNESS;
            let away = moved[column] - parameters[column];
            let state_there = self.evaluate(&moved, None)?;
            for (row, value) in state_there.into_iter().enumerate() {
                slopes[(row, column)] = (value - state[row]) / away;
            }
        }
        Some(slopes)
    }
}

impl Problem for Search<'_> {
    type State = Vec<f64>;

    /// Residuals in standard deviations, and what makes Cauchy's prior a sum of squares.
    fn evaluate(&self, parameters: &[f64], _: Option<&Vec<f64>>) -> Option<Vec<f64>> {
        let predicted = self.change.predict(self.data, parameters)?;
        let mut residuals = self.likelihood.whitened(self.scatter, &predicted)?;
        for (step, half_width) in parameters.iter().zip(&self.change.half_widths) {
            let loss = (2.0 * (1.0 + (step / half_width).powi(2)).ln()).sqrt();
            residuals.push(loss.copysign(*step));
        }
        Some(residuals)
    }

    fn cost(&self, state: &Vec<f64>) -> f64 {
        0.5 * state.iter().map(|one| one * one).sum::<f64>()
    }

    fn linearise(&self, parameters: &[f64], state: &mut Vec<f64>) -> Option<Linearised> {
        Some(Linearised::of_rows(self.slopes(parameters, state)?, state))
    }

    fn bounds(&self) -> &[[f64; 2]] {
        &self.bounds
    }
}
