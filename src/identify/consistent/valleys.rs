//! From frequencies to the point of least misfit, and to every other valley there is.

use super::estimator::ConsistentEstimator;
use super::least_squares::{Accuracy, Minimum, descend};
use super::model::{FrequencyModel, Parameter, Point};
use super::problem::{Evaluation, Loss, Problem};
use super::settings::{ConsistentSettings, ResidualWeights};
use super::starts::{everywhere, promising};
use crate::pairs::{ModeLambda, PairsModel, estimate_pairs};
use tapjoint_beam::Assembly;
use tapjoint_beam::joint::StiffnessUnits;

/// Two valleys nearer than this in every estimated coordinate (1, logarithms) are one.
const SAME_VALLEY: f64 = 0.05;
/// The attached masses' share is followed to first order; this many renewals make it exact.
const RENEWALS: usize = 6;

impl ConsistentEstimator {
    /// All valleys, the deepest first, and the model renewed where the beam has moved far.
    pub(super) fn solve(&self, frequencies: &[f64]) -> (Option<FrequencyModel>, Vec<Minimum>) {
        let mut problem = self.problem(&self.model, frequencies);
        let starts = self.starts(&problem);
        self.rescale(&mut problem, &starts);
        let mut minima = self.valleys(&problem, &starts);
        if !self.is_good(&problem, &minima) {
            // A bad fit may be the wrong valley: now no effort is spared.
            let mut all = everywhere(&self.base, &self.settings.fit);
            all.extend(minima.iter().map(|minimum| minimum.at.point));
            minima = self.valleys(&problem, &all);
        }
        self.renew(&self.model, frequencies, minima)
    }

    /// Follows the beam where the deepest valley has moved it far from the one that the model was
    /// built for: the model built anew, if it was, and the valleys by it.
    pub(super) fn renew(
        &self,
        model: &FrequencyModel,
        frequencies: &[f64],
        mut minima: Vec<Minimum>,
    ) -> (Option<FrequencyModel>, Vec<Minimum>) {
        let mut renewed = None;
        for _ in 0..RENEWALS {
            let Some(best) = minima.first().map(|best| best.at.point) else {
                break;
            };
            if !renewed.as_ref().unwrap_or(model).is_far(&best) {
                break;
            }
            let highest = self.modes.iter().map(|mode| mode.mode).max().unwrap_or(0) + 1;
            let Ok(built) = self.model.rebuilt(&best, highest) else {
                break;
            };
            let starts: Vec<Point> = minima.iter().map(|minimum| minimum.at.point).collect();
            minima = self.refit_in(&built, frequencies, &starts);
            renewed = Some(built);
        }
        (renewed, minima)
    }

    /// Whether the misfit is so small that no other valley can matter: below three times what it
    /// should be, or, without stated uncertainties, below what any reading achieves.
    fn is_good(&self, problem: &Problem<'_>, minima: &[Minimum]) -> bool {
        const READING: f64 = 1e-4;
        let Some(best) = minima.first() else {
            return false;
        };
        let allowed = match self.settings.weights {
            ResidualWeights::Measured => 9.0,
            ResidualWeights::Relative => READING * READING,
        };
        best.at.cost < allowed * problem.data.len() as f64
    }

    fn starts(&self, problem: &Problem<'_>) -> Vec<Point> {
        let mut starts = promising(problem, &self.base, &self.settings.fit);
        starts.extend(self.pairs_start(problem));
        starts
    }

    /// The pair regression's estimate, where it applies and is a joint.
    fn pairs_start(&self, problem: &Problem<'_>) -> Option<Point> {
        let structure = self.model.structure();
        let halves = structure.lap.position.is_none() && structure.lap.right.is_none();
        let model = match (structure.assembly, &self.settings.fit[..]) {
            (Assembly::Lap, [Parameter::Kt, Parameter::Kr]) if halves => PairsModel::Lap,
            (Assembly::Cantilever, [Parameter::Kt, Parameter::Kr]) => PairsModel::TwoParameter,
            (Assembly::Cantilever, [Parameter::Kt, Parameter::Kr, Parameter::Coupling]) => {
                PairsModel::ThreeParameter
            }
            _ => return None,
        };
        let modes = problem
            .data
            .iter()
            .map(|datum| datum.mode)
            .zip(problem.measured_lambdas(&self.base));
        let modes: Vec<ModeLambda> = modes
            .map(|(mode, lambda)| ModeLambda { mode, lambda })
            .collect();
        let joint = estimate_pairs(model, &modes).ok()?.joint()?;
        joint.check().ok()?;
        let units = StiffnessUnits::of(&structure.beam);
        let mut start = self.base;
        start[Parameter::Kt.index()] = (joint.kx * units.kt).ln();
        start[Parameter::Kr.index()] = (joint.ky * units.kr).ln();
        start[Parameter::Coupling.index()] = joint.coupling().atanh();
        let usable = start[..3].iter().all(|coordinate| coordinate.is_finite());
        usable.then(|| problem.within_bounds(start))
    }

    /// Follows every start down roughly, keeps different valleys, and finishes each.
    pub(super) fn valleys(&self, problem: &Problem<'_>, starts: &[Point]) -> Vec<Minimum> {
        let directions = self.directions();
        // A last step of 1e-4 leaves 1e-8: enough to tell valleys apart, and half the work.
        let rough = Problem {
            last_step: 1e-4,
            ..problem.clone()
        };
        let mut found: Vec<Evaluation> = Vec::new();
        for start in starts {
            let guesses = problem.measured_lambdas(start);
            let at = rough.evaluate(&problem.within_bounds(*start), &guesses);
            let end = descend(&rough, at, &directions, Accuracy::ROUGH).at;
            if end.cost.is_finite() && !found.iter().any(|other| same(other, &end, &directions)) {
                found.push(end);
            }
        }
        let mut minima: Vec<Minimum> = Vec::new();
        for end in found {
            let exact = problem.evaluate(&end.point, &end.lambdas);
            let end = descend(problem, exact, &directions, ConsistentSettings::ACCURACY);
            let known = minima
                .iter_mut()
                .find(|other| same(&other.at, &end.at, &directions));
            match known {
                Some(other) if end.at.cost < other.at.cost => *other = end,
                Some(_) => {}
                None => minima.push(end),
            }
        }
        for minimum in &mut minima {
            self.follow_to_the_limit(problem, minimum);
        }
        minima.sort_by(|a, b| a.at.cost.total_cmp(&b.at.cost));
        minima
    }

    /// A stiffness that no frequency feels any more ends wherever the search lost interest; where
    /// the limit itself is no worse, the estimate is there.
    fn follow_to_the_limit(&self, problem: &Problem<'_>, minimum: &mut Minimum) {
        // Relative change of every frequency per relative change of the stiffness.
        const UNFELT: f64 = 1e-4;
        for parameter in [Parameter::Kt, Parameter::Kr] {
            let index = parameter.index();
            let data = problem.data.iter().zip(&minimum.at.jacobian);
            let felt = data
                .map(|(datum, row)| (row[index] * datum.std / datum.frequency).abs())
                .fold(0.0, f64::max);
            if felt > UNFELT || !self.settings.fit.contains(&parameter) {
                continue;
            }
            let free = self.directions();
            let others: Vec<Point> = free.into_iter().filter(|d| d[index] == 0.0).collect();
            for end in [-1e3, 1e3] {
                let mut point = minimum.at.point;
                point[index] += end;
                let at = problem.evaluate(&problem.within_bounds(point), &minimum.at.lambdas);
                let there = descend(problem, at, &others, Accuracy::MISFIT);
                if there.at.cost <= minimum.at.cost {
                    *minimum = there;
                }
            }
        }
    }

    /// With relative weights a robust loss needs to know what a usual misfit is: that of the least
    /// squares, by its median, for as many misfits as there is freedom.
    pub(super) fn rescale(&self, problem: &mut Problem<'_>, starts: &[Point]) {
        let relative = self.settings.weights == ResidualWeights::Relative;
        if !relative || problem.loss == Loss::Squares {
            return;
        }
        let loss = std::mem::take(&mut problem.loss);
        let (data, free) = (problem.data.len(), self.settings.fit.len());
        if let Some(best) = self.valleys(problem, starts).first() {
            let mut sizes: Vec<f64> = best.at.residuals.iter().map(|r| r.abs()).collect();
            sizes.sort_by(f64::total_cmp);
            let median = sizes[(data - 1) / 2];
            let share = (data as f64 / (data.saturating_sub(free)).max(1) as f64).sqrt();
            // 1.4826 median = standard deviation of a normal distribution. Exact frequencies have
            // no usual misfit; rounding is the least there is.
            let scale = (1.4826 * median * share).max(1e-12);
            for datum in &mut problem.data {
                datum.std = scale * datum.frequency;
            }
        }
        problem.loss = loss;
    }
}

fn same(first: &Evaluation, second: &Evaluation, directions: &[Point]) -> bool {
    directions.iter().all(|direction| {
        let free = first.point.iter().zip(&second.point).zip(direction);
        free.filter(|(_, part)| **part != 0.0)
            .all(|((a, b), _)| (a - b).abs() < SAME_VALLEY)
    })
}
