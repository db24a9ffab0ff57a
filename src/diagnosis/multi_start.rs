//! Multi-start search: effects so large that the model linearised without them leads nowhere.
//!
//! Far from the optimum exact data make a valley of every mode. So the search begins with frequencies
//! that count as uncertain as they are unexplained, and goes on with the root of that (graduated
//! non-convexity, Blake & Zisserman 1987, "Visual Reconstruction"). The slopes of shapes with respect to the joint are
//! known near the nominal model only: shapes do not count here.
//!
//! How much is tried, here and for pairs of effects, is a matter of time. Twice as many locations, starts, optima and
//! pairs cost half as much again, and change no answer to the 40 virtual tests of two effects or of effects outside the
//! catalogue among those of `blind-check --cases 190 --seed 104` (measured with the constants doubled).

use crate::dataset::{Dataset, Datum};
use crate::evidence::Fit;
use crate::fit::Search;
use crate::forward::Forward;
use crate::optimum::{Model, maximise, objective_at};
use crate::parameters::{CandidateEffect, Layout};
use crate::structure::COUPLING;
use crate::thresholds::FOLLOWED_SHARE;
use tapjoint_beam::effects::EffectId;
use tapjoint_numerics::stats::root_mean_square;

/// Sizes from which the search begins, over the scale of the effect's prior; with either sign for effects that
/// have two.
const START_SIZES: [f64; 2] = [0.5, 1.5];
/// Number of locations from which it begins.
const START_LOCATIONS: usize = 3;
/// Factor by which each stiffness of the joint begins above and below the described or fitted one.
const STIFFER: f64 = 3.0;
/// Number of starts of least misfit that are followed: for a first effect, and for a second.
const TRIED_STARTS: [usize; 2] = [4, 2];
/// Optima of one effect that are followed to the end.
const FOLLOWED: usize = 2;
/// Relative difference of the misfit below which two searches ended at one optimum: they stop within less, and
/// different locations seldom have equal misfits.
const SAME_MISFIT: f64 = 1e-3;
/// Elements of the coarse model: seven frequencies to 1e-4, where the data are widened to more.
const COARSE_ELEMENTS: usize = 24;

/// Model of the frequencies alone, each with a multiple of its uncertainty.
pub struct CoarseModel {
    dataset: Dataset,
}

/// Point at which a search for some effects may begin.
#[derive(Debug, Clone)]
pub struct Start {
    effects: Vec<CandidateEffect>,
    parameters: Vec<f64>,
    /// -ln(likelihood x prior) of the coarse data.
    pub objective: f64,
}

impl Start {
    /// First of its effects.
    pub fn first(&self) -> EffectId {
        self.effects[0].effect
    }

    /// Returns whether another search for the same effects ended at the same optimum.
    pub fn is_like(&self, other: &Self) -> bool {
        (self.objective - other.objective).abs() < SAME_MISFIT * other.objective.abs().max(1.0)
    }
}

/// Returns the root mean square residual of the frequencies in a fit (standard deviations), 1 at least.
pub fn unexplained(dataset: &Dataset, fit: &Fit) -> f64 {
    let predicted = &fit.best.optimum.model.predicted;
    let all: Vec<f64> = dataset
        .frequencies()
        .map(|row| dataset.data[row].residual(predicted[row]))
        .collect();
    root_mean_square(&all).max(1.0)
}

impl CoarseModel {
    /// Returns the model with uncertainties multiplied by a factor.
    pub fn new(dataset: &Dataset, factor: f64) -> Self {
        let mut coarse = dataset.clone();
        coarse.elements = COARSE_ELEMENTS;
        coarse.observables.retain(|one| one.is_frequency());
        coarse.data = dataset
            .frequencies()
            .map(|row| Datum {
                std: factor * dataset.data[row].std,
                freedom: f64::INFINITY,
                ..dataset.data[row]
            })
            .collect();
        CoarseModel { dataset: coarse }
    }

    /// Returns optima of one effect, from sizes and locations of its prior beside a softer or stiffer joint; the best
    /// first.
    pub fn alone(&self, candidate: CandidateEffect) -> Vec<Start> {
        let forward = Forward::new(&self.dataset, &[candidate]);
        let centre: Vec<f64> = forward.priors().iter().map(|prior| prior.centre).collect();
        let mut joints = vec![centre.clone()];
        for (k, direction) in forward.layout.joint.iter().enumerate() {
            if *direction != COUPLING {
                for away in [STIFFER.ln(), -STIFFER.ln()] {
                    let mut joint = centre.clone();
                    joint[k] += away;
                    joints.push(joint);
                }
            }
        }
        self.optima(&forward, &joints, TRIED_STARTS[0])
    }

    /// Returns optima of a second effect beside a first one, the best first.
    pub fn with_second(&self, first: &Start, candidate: CandidateEffect) -> Vec<Start> {
        let effects = [&first.effects[..], &[candidate]].concat();
        let forward = Forward::new(&self.dataset, &effects);
        let at = forward.layout.last_size();
        let mut start = first.parameters.clone();
        let new = forward.layout.first_nuisance() - at;
        start.splice(at..at, std::iter::repeat_n(0.0, new));
        self.optima(&forward, &[start], TRIED_STARTS[1])
    }

    /// Returns the optimum from where another search ended.
    pub fn continued(&self, start: &Start) -> Option<Start> {
        let forward = Forward::new(&self.dataset, &start.effects);
        let priors = forward.priors();
        let found = maximise(&self.dataset.data, &priors, &start.parameters, &forward)?;
        Some(Start {
            effects: start.effects.clone(),
            parameters: found.parameters,
            objective: found.objective,
        })
    }

    fn objective(&self, forward: &Forward<'_>, at: &[f64]) -> Option<f64> {
        let (predicted, _) = forward.predict(at)?;
        let priors = forward.priors();
        Some(objective_at(&self.dataset.data, &priors, at, &predicted))
    }

    /// Returns optima from the starts of least misfit, the last effect at several sizes and locations; the best first.
    fn optima(&self, forward: &Forward<'_>, bases: &[Vec<f64>], tried: usize) -> Vec<Start> {
        let effects = &forward.layout.effects;
        let mut starts = Vec::new();
        for base in bases {
            for parameters in with_last(&forward.layout, base) {
                if let Some(objective) = self.objective(forward, &parameters) {
                    let effects = effects.clone();
                    starts.push(Start {
                        effects,
                        parameters,
                        objective,
                    });
                }
            }
        }
        let starts = least(starts, tried);
        let optima = starts.iter().filter_map(|start| self.continued(start));
        least(optima.collect(), tried)
    }
}

/// Returns the parameters with sizes and locations of the last effect.
fn with_last(layout: &Layout, base: &[f64]) -> Vec<Vec<f64>> {
    let candidate = &layout.effects[layout.effects.len() - 1];
    let (at, size) = (layout.last_size(), &candidate.size);
    let mut starts = Vec::new();
    for share in START_SIZES.iter().flat_map(|share| [*share, -share]) {
        let value = size.neutral + share * size.scale;
        if !(size.low..=size.high).contains(&value) {
            continue;
        }
        let mut start = base.to_vec();
        start[at] = value;
        let Some(range) = candidate.location else {
            starts.push(start);
            continue;
        };
        let (low, high) = range.searched_bounds();
        for k in 0..START_LOCATIONS {
            start[at + 1] = low + (high - low) * (k as f64 + 0.5) / START_LOCATIONS as f64;
            starts.push(start.clone());
        }
    }
    starts
}

/// Fits an effect by multi-start search, where that promises more than the fit `found` so far.
pub fn add_by_multi_start(
    search: &Search<'_>,
    candidate: CandidateEffect,
    found: Option<&Fit>,
) -> Option<Fit> {
    let factor = unexplained(search.dataset, search.without);
    let starts = CoarseModel::new(search.dataset, factor).alone(candidate);
    let finer = CoarseModel::new(search.dataset, factor.sqrt());
    let so_far = found
        .and_then(|fit| {
            let forward = Forward::new(&finer.dataset, &fit.effects);
            finer.objective(&forward, fit.parameters())
        })
        .unwrap_or(f64::INFINITY);
    let near: Vec<Start> = starts
        .iter()
        .take(FOLLOWED)
        .filter_map(|start| finer.continued(start))
        .filter(|start| start.objective < FOLLOWED_SHARE * so_far)
        .collect();
    settle(search, &near)
}

/// Returns the best fit to the data as they are, from any of these starts for the same effects.
pub fn settle(search: &Search<'_>, starts: &[Start]) -> Option<Fit> {
    let fits = starts.iter().filter_map(|start| {
        let forward = Forward::new(search.dataset, &start.effects);
        search.fit_from(&forward, &start.parameters)
    });
    fits.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))
}

/// Returns the starts with the least objective, that one first.
fn least(mut all: Vec<Start>, count: usize) -> Vec<Start> {
    all.sort_by(|a, b| a.objective.total_cmp(&b.objective));
    all.truncate(count);
    all
}
