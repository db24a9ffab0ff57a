//! Fits of one hypothesis: starts, signs, locations, and the sum over its local optima.

use crate::amplitude::best_law;
use crate::dataset::Dataset;
use crate::evidence::{
    Fit, LocalOptimum, evaluate, linear_fit, linear_optimum, log_likelihood, log_mean, log_sum,
    over_drifts, profile_correction, start_with,
};
use crate::fixture::{log_unread, with_peaks};
use crate::forward::Forward;
use crate::optimum::Optimum;
use crate::parameters::{CandidateEffect, LocationKind, LocationRange, Prior};
use crate::structure::COUPLING;
use crate::thresholds::{LOCATED, SIZE_DETECTED};

/// Fits the nominal model with its joint free.
pub fn fit_nominal(dataset: &Dataset) -> Option<Fit> {
    let forward = Forward::new(dataset, &[]);
    let drift = dataset.settings.drift_stds[0];
    let priors = dataset.with_drift(&forward.layout, &forward.priors(), drift);
    let mut start: Vec<f64> = priors.iter().map(|prior| prior.centre).collect();
    for (parameter, (direction, value)) in start.iter_mut().zip(dataset.nominal.joint_parameters())
    {
        if direction == COUPLING {
            *parameter = value;
        }
    }
    Fit::of_variants(vec![evaluate(&forward, &priors, &start)?])
}

/// Nodes of a location at which the true model is fitted.
const CORRECTED: usize = 6;

/// Search for one effect, or a second beside a first one, from the optimum of the model without it.
#[derive(Clone, Copy)]
pub struct Search<'a> {
    /// The data.
    pub dataset: &'a Dataset,
    /// Fit without the effect.
    pub without: &'a Fit,
}

impl<'a> Search<'a> {
    /// Returns the model with these effects beside those of the fit without them.
    fn model_with(&self, added: &[CandidateEffect]) -> Forward<'a> {
        Forward::new(self.dataset, &[&self.without.effects[..], added].concat())
    }

    /// Fits the effect beside those of the fit without it.
    pub fn add(&self, candidate: CandidateEffect) -> Option<Fit> {
        let forward = self.model_with(&[candidate]);
        match candidate.location {
            None => self.without_location(&forward),
            Some(range) => self.with_location(&forward, range),
        }
    }

    /// Returns the objective of the fit without the effect, with the drift that the search begins with.
    pub fn objective_without(&self) -> Option<f64> {
        let priors = self.model_with(&[]).priors();
        let at = &self.without.best.optimum;
        Some(linear_optimum(&self.dataset.data, &priors, at)?.objective)
    }

    /// Returns the least objective that the model linearised without the effect promises, over its locations.
    pub fn linear_screen(&self, candidate: CandidateEffect) -> Option<f64> {
        let forward = self.model_with(&[candidate]);
        let Some(range) = candidate.location else {
            return Some(linear_fit(&forward, self.without, &forward.priors(), None)?.objective);
        };
        let (low, high) = range.searched_bounds();
        let nodes = (0..range.nodes)
            .map(|node| low + (high - low) * (node as f64 + 0.5) / range.nodes as f64);
        let peaks = match range.kind {
            LocationKind::FixtureFrequency => &self.dataset.peaks.all[..],
            _ => &[],
        };
        nodes
            .chain(peaks.iter().map(|peak| peak.log))
            .filter_map(|location| Some(self.linear_at(&forward, location)?.0.objective))
            .min_by(f64::total_cmp)
    }

    /// Returns the linearised optimum with the effect held at a location, and the priors.
    fn linear_at(&self, forward: &Forward<'_>, location: f64) -> Option<(Optimum, Vec<Prior>)> {
        let mut held = forward.priors();
        held[forward.layout.last_size() + 1] = Prior::held(location);
        let optimum = linear_fit(forward, self.without, &held, Some(location))?;
        Some((optimum, held))
    }

    /// Fits both effects from where the second has its own optimum and the first is next to nothing: two effects explain
    /// no less than each of them.
    pub fn add_from(&self, alone: &Fit) -> Option<Fit> {
        let forward = self.model_with(&alone.effects);
        let joint = forward.layout.joint.len();
        let own = joint..self.dataset.layout(&self.without.effects).first_nuisance();
        let mut start = alone.parameters().to_vec();
        start.splice(joint..joint, self.without.parameters()[own].iter().copied());
        let size = &forward.layout.effects[0].size;
        start[joint] = size.neutral + 0.02 * size.scale;
        self.fit_from(&forward, &start)
    }

    /// Fits the effects of a model from one start.
    pub fn fit_from(&self, forward: &Forward<'_>, start: &[f64]) -> Option<Fit> {
        let best = evaluate(forward, &forward.priors(), start)?;
        let evidence = evidence_of(forward, &best);
        Some(self.finish(forward, best, evidence))
    }

    /// Returns the fit with what the size's profile and a fixture's peak add to its evidence.
    fn finish(&self, forward: &Forward<'_>, best: LocalOptimum, log_evidence: f64) -> Fit {
        let correction = profile_correction(forward, &best);
        let most = log_likelihood(&self.dataset.data, &best.optimum);
        let fit = Fit {
            effects: forward.layout.effects.clone(),
            best,
            log_evidence: (log_evidence + correction).min(most),
        };
        with_peaks(forward, fit, self.without)
    }

    fn without_location(&self, forward: &Forward<'_>) -> Option<Fit> {
        let (size, priors) = (forward.layout.last_size(), forward.priors());
        let mut found: Vec<LocalOptimum> = Vec::new();
        for value in self.sizes(forward) {
            let start = start_with(self.without, &forward.layout, value, None);
            if let Some(one) = evaluate(forward, &priors, &start) {
                keep(forward, &mut found, one, &[size]);
            }
        }
        let best = best_of(forward, &found)?.clone();
        Some(self.finish(forward, best, log_sum(&evidences_of(forward, &found))))
    }

    /// Returns sizes from which the search begins: that of the model linearised without the effect, and
    /// the other sign or a size well inside the range.
    fn sizes(&self, forward: &Forward<'_>) -> Vec<f64> {
        let at = forward.layout.last_size();
        let size = &forward.layout.effects[forward.layout.effects.len() - 1].size;
        // One step of Gauss-Newton from nothing of it, not stopped by a bound.
        let mut priors = forward.priors();
        (priors[at].low, priors[at].high) = (f64::NEG_INFINITY, f64::INFINITY);
        let linear = linear_fit(forward, self.without, &priors, None);
        let asked = linear.map_or(size.neutral, |optimum| optimum.parameters[at]);
        let asked = asked.clamp(
            (size.neutral - 2.0 * size.scale).max(size.low),
            (size.neutral + 2.0 * size.scale).min(size.high),
        );
        let away = asked - size.neutral;
        let other = (size.neutral - 0.5 * away).clamp(size.low, size.high);
        if away.abs() < 1e-3 * size.scale {
            vec![size.small()]
        } else if (other - size.neutral).abs() < 1e-3 * size.scale {
            vec![asked]
        } else {
            vec![asked, other]
        }
    }

    /// Fits the linearised model at every node of the location's range; then the true one, free, from the best.
    fn with_location(&self, forward: &Forward<'_>, range: LocationRange) -> Option<Fit> {
        let (low, high) = range.searched_bounds();
        let spacing = (high - low) / range.nodes as f64;
        let mut nodes: Vec<LocalOptimum> = Vec::new();
        for node in 0..range.nodes {
            let location = low + spacing * (node as f64 + 0.5);
            if let Some((optimum, held)) = self.linear_at(forward, location) {
                let drifts = &self.dataset.settings.drift_stds;
                let layout = &forward.layout;
                nodes.push(over_drifts(self.dataset, layout, &held, &optimum, drifts));
            }
        }
        self.correct(forward, &mut nodes);
        self.refine(forward, spacing, &nodes)
    }

    /// Replaces the linearised model by the true one at the most promising nodes: a fixture near
    /// a mode's frequency promises more than it holds. The others count at most as much as these.
    fn correct(&self, forward: &Forward<'_>, nodes: &mut [LocalOptimum]) {
        let mut order: Vec<usize> = (0..nodes.len()).collect();
        order.sort_by(|&a, &b| nodes[b].log_evidence.total_cmp(&nodes[a].log_evidence));
        let (first, others) = order.split_at(CORRECTED.min(nodes.len()));
        let mut least = f64::INFINITY;
        for &node in first {
            let linear = &nodes[node];
            let start = &linear.optimum.parameters;
            match evaluate(forward, &linear.priors, start) {
                Some(found) => nodes[node] = found,
                None => nodes[node].log_evidence = f64::NEG_INFINITY,
            }
            least = least.min(nodes[node].log_evidence);
        }
        for &node in others {
            nodes[node].log_evidence = nodes[node].log_evidence.min(least);
        }
    }

    /// Frees the location from the best nodes. If the data fix it within the nodes' spacing, the
    /// maxima are summed; if they do not, the effect is so small that the linearised nodes hold.
    fn refine(&self, forward: &Forward<'_>, spacing: f64, nodes: &[LocalOptimum]) -> Option<Fit> {
        let at = forward.layout.last_size();
        let evidence: Vec<f64> = nodes.iter().map(|node| node.log_evidence).collect();
        let mut starts: Vec<Vec<f64>> = local_maxima(&evidence)
            .into_iter()
            .map(|node| nodes[node].optimum.parameters.clone())
            .collect();
        starts.extend(self.start_by_law(forward, nodes));
        let mut found: Vec<LocalOptimum> = Vec::new();
        descend(forward, &starts, &mut found);
        // A search along a bent valley may stop short of its end: search again from either side of it. Between
        // nodes that are far apart for the resolution of the data a deeper one may lie: search again from these.
        if let Some(best) = best_of(forward, &found)
            && is_located(best, at, spacing)
        {
            let parameters = &best.optimum.parameters;
            let mut starts = neighbours(parameters, nodes, at + 1, spacing);
            for aside in [-0.4 * spacing, 0.4 * spacing] {
                let mut from = parameters.clone();
                from[at + 1] += aside;
                starts.push(from);
            }
            descend(forward, &starts, &mut found);
        }
        let best = best_of(forward, &found)?.clone();
        let total = if is_located(&best, at, spacing) {
            log_sum(&evidences_of(forward, &found))
        } else {
            log_mean(&evidences_of(forward, nodes))
        };
        Some(self.finish(forward, best, total))
    }

    /// Returns the best node with the size and the exponent of the law that the changes along the decays call for, for a
    /// joint whose stiffness depends on the amplitude.
    fn start_by_law(&self, forward: &Forward<'_>, nodes: &[LocalOptimum]) -> Option<Vec<f64>> {
        let last = forward.layout.effects.last()?;
        last.location
            .filter(|range| range.kind == LocationKind::Exponent)?;
        let law = best_law(self.dataset, self.without)?.law;
        let best = nodes
            .iter()
            .max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
        let mut start = best.optimum.parameters.clone();
        let at = forward.layout.last_size();
        start[at] = law.ratio;
        start[at + 1] = law.exponent;
        Some(start)
    }
}

/// Adds the local optima that are reached from some starts.
fn descend(forward: &Forward<'_>, starts: &[Vec<f64>], found: &mut Vec<LocalOptimum>) {
    let (at, priors) = (forward.layout.last_size(), forward.priors());
    for from in starts {
        if let Some(one) = evaluate(forward, &priors, from) {
            keep(forward, found, one, &[at, at + 1]);
        }
    }
}

/// Returns the logarithm of an optimum's evidence, with the probability that no peak states its fixture.
fn evidence_of(forward: &Forward<'_>, one: &LocalOptimum) -> f64 {
    one.log_evidence + log_unread(forward, one)
}

/// Returns the logarithms of the evidence of several optima.
fn evidences_of(forward: &Forward<'_>, all: &[LocalOptimum]) -> Vec<f64> {
    all.iter().map(|one| evidence_of(forward, one)).collect()
}

/// Difference of two objectives below which two optima explain the data equally well (1). Searches end within less.
const EQUAL_OBJECTIVES: f64 = 0.01;

/// Returns whether an optimum explains the data better than another one, or as well and is more probable. An effect of
/// next to no size explains the data equally well wherever it is: rounding must not choose among its locations.
fn is_better(forward: &Forward<'_>, one: &LocalOptimum, other: &LocalOptimum) -> bool {
    let lower = other.optimum.objective - one.optimum.objective;
    if lower.abs() > EQUAL_OBJECTIVES {
        return lower > 0.0;
    }
    evidence_of(forward, one) > evidence_of(forward, other)
}

/// Returns the best of several optima.
fn best_of<'a>(forward: &Forward<'_>, found: &'a [LocalOptimum]) -> Option<&'a LocalOptimum> {
    (found.iter()).reduce(|best, one| {
        if is_better(forward, one, best) {
            one
        } else {
            best
        }
    })
}

/// Returns the parameters of the nodes whose location, the parameter `at`, is next to this one or next but one.
fn neighbours(
    parameters: &[f64],
    nodes: &[LocalOptimum],
    at: usize,
    spacing: f64,
) -> Vec<Vec<f64>> {
    let nodes = nodes.iter().map(|node| &node.optimum.parameters);
    let near = nodes.filter(|node| {
        let apart = (node[at] - parameters[at]).abs();
        apart > 0.5 * spacing && apart < 2.0 * spacing
    });
    near.cloned().collect()
}

/// Returns whether the data fix an effect's location within the nodes' spacing, and its size so far from
/// zero that size and location are Gaussian together.
fn is_located(found: &LocalOptimum, size: usize, spacing: f64) -> bool {
    let Some(covariance) = found.covariance() else {
        return false;
    };
    let [size_std, location_std] = [size, size + 1].map(|k| covariance[(k, k)].max(0.0).sqrt());
    let away = (found.optimum.parameters[size] - found.priors[size].centre).abs();
    location_std < LOCATED * spacing && away > SIZE_DETECTED * size_std
}

/// Returns the nodes from which a search goes on: the local maxima, the best first, at most three.
fn local_maxima(evidence: &[f64]) -> Vec<usize> {
    let mut maxima: Vec<usize> = (0..evidence.len())
        .filter(|&k| {
            let mut beside = evidence[..k].last().into_iter().chain(evidence.get(k + 1));
            beside.all(|other| evidence[k] >= *other)
        })
        .collect();
    maxima.sort_by(|&a, &b| evidence[b].total_cmp(&evidence[a]));
    // A maximum 12 below the best has e^-12 of its probability. If the nodes differ by far more than
    // that, they lie too far apart to show which valley is the deepest.
    let best = maxima.first().map_or(f64::NEG_INFINITY, |&k| evidence[k]);
    let worst = evidence.iter().copied().filter(|e| e.is_finite());
    let depth = best - worst.fold(best, f64::min);
    maxima.retain(|&k| evidence[k] > best - f64::max(12.0, 0.5 * depth));
    maxima.truncate(3);
    maxima
}

/// Adds a local optimum unless the same one is there already (in the parameters `which`).
fn keep(forward: &Forward<'_>, found: &mut Vec<LocalOptimum>, one: LocalOptimum, which: &[usize]) {
    let covariance = one.covariance();
    let same = found.iter().position(|other| {
        which.iter().all(|&k| {
            let variance = covariance.as_ref().map_or(0.0, |c| c[(k, k)]);
            let apart = other.optimum.parameters[k] - one.optimum.parameters[k];
            apart.abs() < 2.0 * variance.max(0.0).sqrt()
        })
    });
    match same {
        Some(index) if is_better(forward, &one, &found[index]) => found[index] = one,
        Some(_) => {}
        None => found.push(one),
    }
}
