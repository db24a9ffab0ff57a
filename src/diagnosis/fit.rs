//! Fits of one hypothesis: starts, signs, locations, and the sum over its local optima; and the multi-start search for
//! large effects.

use crate::amplitude::best_law;
use crate::dataset::{Dataset, Datum};
use crate::evidence::{
    BETTER, Fit, LocalOptimum, evaluate, linear_fit, log_likelihood, log_mean, log_sum,
    over_drifts, profile_correction, start_with,
};
use crate::fixture::with_peaks;
use crate::forward::Forward;
use crate::modal_model::ModalModel;
use crate::optimum::{Model, Optimum, linear_optimum, maximise, objective_at};
use crate::parameters::{
    CandidateEffect, Cause, LocationKind, LocationRange, NuisanceParameter, Prior,
};
use crate::structure::COUPLING;
use crate::thresholds::Thresholds;
use tapjoint_numerics::stats::root_mean_square;

/// Fits the nominal model with its joint free.
pub fn fit_nominal(dataset: &Dataset) -> Option<Fit> {
    let forward = Forward::new(dataset, &[]);
    let priors = forward.priors();
    let mut start: Vec<f64> = priors.iter().map(|prior| prior.centre).collect();
    for (parameter, (direction, value)) in start.iter_mut().zip(dataset.nominal.joint_parameters())
    {
        if direction == COUPLING {
            *parameter = value;
        }
    }
    nominal_from(&forward, &start)
}

/// Fits the nominal model from one start. `None` if the fit fails.
fn nominal_from(forward: &Forward<'_>, start: &[f64]) -> Option<Fit> {
    let found = evaluate(forward, &forward.priors(), start)?;
    let best = from_other_places(forward, &found).unwrap_or(found);
    Some(Fit {
        effects: Vec::new(),
        log_evidence: best.log_evidence,
        best,
    })
}

/// Largest size from which a search begins, over its scale.
const LARGEST_STEP: f64 = 10.0;
/// Smallest size of an error of the set-up that is tried, over its scale: 0.5 mm, or 1 %.
const SMALLEST_ERROR: f64 = 0.1;
const ERROR_RATIO: f64 = 1.4;
const SET_UP_STEPS: i32 = 21;

/// Error of the set-up with everything else held.
struct Screened {
    candidate: CandidateEffect,
    /// Best size.
    size: f64,
    log_evidence: f64,
}

/// Fits the nominal model to the frequencies alone; `None` where there is nothing else.
pub fn fit_frequencies(dataset: &Dataset) -> Option<Fit> {
    let mut alone = dataset.clone();
    let kept: Vec<bool> = dataset
        .observables
        .iter()
        .map(|one| !one.is_shape())
        .collect();
    if kept.iter().all(|kept| *kept) {
        return None;
    }
    let mut keep = kept.iter();
    alone
        .observables
        .retain(|_| keep.next().is_some_and(|kept| *kept));
    let mut keep = kept.iter();
    alone.data.retain(|_| keep.next().is_some_and(|kept| *kept));
    alone.shape_slopes = None;
    fit_nominal(&alone)
}

/// Fits the nominal model from where an effect was fitted: that search may have led further. `None` if the fit fails.
pub fn refit_nominal(dataset: &Dataset, with: &Fit) -> Option<Fit> {
    nominal_from(
        &Forward::new(dataset, &[]),
        &start_without(dataset, with, 0),
    )
}

/// Returns the parameters of a fit without those of one of its effects.
pub fn start_without(dataset: &Dataset, with: &Fit, effect: usize) -> Vec<f64> {
    let layout = dataset.layout(&with.effects);
    let own = 1 + usize::from(layout.location(effect).is_some());
    let mut start = with.parameters().to_vec();
    start.drain(layout.size(effect)..layout.size(effect) + own);
    start
}

/// Places of sensors and taps from which a search begins again, over the standard uncertainty of the stated one.
const OTHER_PLACES: [f64; 6] = [-3.0, -2.0, -1.0, 1.0, 2.0, 3.0];
/// Decrease of the objective from which on the search begins again: three standard deviations.
const WORTH_A_SEARCH: f64 = 4.5;

/// Returns whether the shapes fit: their chi square is below the mean and three standard deviations of its distribution.
fn shapes_fit(dataset: &Dataset, optimum: &Optimum) -> bool {
    let (mut count, mut chi_square) = (0.0, 0.0);
    for (row, observable) in dataset.observables.iter().enumerate() {
        if observable.is_shape() {
            let residual = dataset.data[row].residual(optimum.model.predicted[row]);
            count += 1.0;
            chi_square += residual * residual;
        }
    }
    chi_square <= count + 3.0 * f64::sqrt(2.0 * count)
}

/// Returns the objective of parameters that change the set-up alone, by modes that are already solved. `None` where a mode is
/// missing.
fn set_up_objective(
    forward: &Forward<'_>,
    priors: &[Prior],
    parameters: &[f64],
    solved: &[ModalModel],
) -> Option<f64> {
    let predicted = forward.predict_set_up(parameters, solved)?;
    let data = &forward.dataset.data;
    Some(objective_at(data, priors, parameters, &predicted))
}

/// Returns a better optimum with sensors and taps elsewhere within their tolerances; `None` where there is none. A shape has
/// equal values on both sides of an extreme, so that a search from the stated place may end on the wrong side.
fn from_other_places(forward: &Forward<'_>, found: &LocalOptimum) -> Option<LocalOptimum> {
    use NuisanceParameter::{SensorPosition, TapPosition};
    let (dataset, priors) = (forward.dataset, &found.priors);
    if shapes_fit(dataset, &found.optimum) {
        return None;
    }
    let mut start = found.optimum.parameters.clone();
    let models = forward.solve(&start)?;
    let here = set_up_objective(forward, priors, &start, &models)?;
    let (mut least, mut held) = (here, priors.clone());
    for (nuisance, k) in dataset
        .nuisances
        .iter()
        .zip(forward.layout.first_nuisance()..)
    {
        if !matches!(
            nuisance.parameter,
            SensorPosition { .. } | TapPosition { .. }
        ) {
            continue;
        }
        let mut best = start[k];
        for away in OTHER_PLACES {
            start[k] = nuisance.centre + away * nuisance.std;
            if let Some(own) = set_up_objective(forward, priors, &start, &models)
                && own < least
            {
                (best, least) = (start[k], own);
            }
        }
        start[k] = best;
        held[k] = Prior::held(best);
    }
    if least > here - WORTH_A_SEARCH {
        return None;
    }
    // All else follows the new places first: a moved mass moves the frequencies, which would draw it back.
    let there = maximise(&dataset.data, &held, &start, forward)?;
    let other = evaluate(forward, &forward.priors(), &there.parameters)?;
    if other.optimum.objective > found.optimum.objective - BETTER {
        return None;
    }
    Some(LocalOptimum {
        log_evidence: other.log_evidence.max(found.log_evidence),
        ..other
    })
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
    /// Fit without the effect to the frequencies alone. The search for errors of the set-up begins here, because wrong
    /// shapes would mislead the joint. `None` without shapes.
    pub by_frequencies: Option<&'a Fit>,
}

impl<'a> Search<'a> {
    /// Returns the model with these effects beside those of the fit without them.
    fn model_with(&self, added: &[CandidateEffect]) -> Forward<'a> {
        Forward::new(self.dataset, &[&self.without.effects[..], added].concat())
    }

    /// Fits an effect beside those of the fit without it. Only errors of the set-up have several variants, which are equally
    /// probable.
    pub fn add_any(&self, variants: &[CandidateEffect]) -> Option<Fit> {
        match variants {
            [one] if !one.is_of_set_up() => self.add(*one),
            _ => self.add_set_up_error(variants),
        }
    }

    /// Fits an error of the set-up where that promises most; the others count with all but their size held.
    fn add_set_up_error(&self, variants: &[CandidateEffect]) -> Option<Fit> {
        let from = self.by_frequencies.unwrap_or(self.without);
        let models = self.model_with(&[]).solve(from.parameters())?;
        let screened = variants.iter().map(|one| self.screened(*one, &models));
        let mut screened = screened.collect::<Option<Vec<Screened>>>()?;
        screened.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        let mut logs = Vec::new();
        let mut best: Option<Fit> = None;
        for (rank, one) in screened.iter().enumerate() {
            if rank >= FOLLOWED {
                logs.push(one.log_evidence);
                continue;
            }
            let forward = self.model_with(&[one.candidate]);
            let start = start_with(from, &forward.layout, one.size, None);
            let fit = self.fit_from(&forward, &start);
            logs.push(
                fit.as_ref()
                    .map_or(f64::NEG_INFINITY, |fit| fit.log_evidence),
            );
            if let Some(fit) = fit
                && best
                    .as_ref()
                    .is_none_or(|best| fit.log_evidence > best.log_evidence)
            {
                best = Some(fit);
            }
        }
        Some(Fit {
            log_evidence: log_mean(&logs),
            ..best?
        })
    }

    /// Returns the best size of an error of the set-up, and its evidence, with all other parameters held. `None` if a
    /// prediction fails.
    fn screened(&self, candidate: CandidateEffect, models: &[ModalModel]) -> Option<Screened> {
        let forward = self.model_with(&[candidate]);
        let size = &candidate.size;
        let mut sizes = vec![0.0];
        if size.is_fixed() {
            sizes = vec![size.low];
        } else {
            for step in 0..SET_UP_STEPS {
                let share = SMALLEST_ERROR * ERROR_RATIO.powi(step);
                sizes.extend([-share * size.scale, share * size.scale]);
            }
            sizes.retain(|x| (size.low..=size.high).contains(x));
            sizes.sort_by(f64::total_cmp);
        }
        let from = self.by_frequencies.unwrap_or(self.without);
        let without = &self.without.best.optimum;
        let mut held = self.without.best.priors.clone();
        held.insert(forward.layout.last_size(), Prior::held(0.0));
        let (mut best, mut logs): (Option<[f64; 2]>, Vec<f64>) = (None, Vec::new());
        for &value in &sizes {
            let at = start_with(from, &forward.layout, value, None);
            let gain = without.objective - set_up_objective(&forward, &held, &at, models)?;
            logs.push(gain + size.log_density(value));
            if best.is_none_or(|[most, _]| gain > most) {
                best = Some([gain, value]);
            }
        }
        // By trapezoids; an error that is there or not has no width.
        let widths = (0..sizes.len()).map(|k| {
            let (before, after) = (
                sizes[k.saturating_sub(1)],
                sizes[(k + 1).min(sizes.len() - 1)],
            );
            if size.is_fixed() {
                1.0
            } else {
                0.5 * (after - before)
            }
        });
        let parts: Vec<f64> = logs
            .iter()
            .zip(widths)
            .map(|(log, width)| log + width.ln())
            .collect();
        Some(Screened {
            candidate,
            size: best?[1],
            log_evidence: self.without.log_evidence + log_sum(&parts),
        })
    }

    /// Fits the effect beside those of the fit without it.
    pub fn add(&self, candidate: CandidateEffect) -> Option<Fit> {
        let forward = self.model_with(&[candidate]);
        if let Some(range) = candidate.location {
            return self.with_location(&forward, range);
        }
        let sizes = self.sizes(&forward).into_iter();
        let starts = sizes.map(|size| start_with(self.without, &forward.layout, size, None));
        let mut found = Vec::new();
        descend(&forward, &starts.collect::<Vec<_>>(), &mut found);
        let best = best_of(&found)?.clone();
        Some(self.finish(&forward, best, log_sum(&evidences_of(&found))))
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
        let evidence = best.log_evidence;
        Some(self.finish(forward, best, evidence))
    }

    /// Returns the fit with what the size's profile and a fixture's peak add to its evidence.
    fn finish(&self, forward: &Forward<'_>, mut best: LocalOptimum, mut log_evidence: f64) -> Fit {
        if let Some(other) = from_other_places(forward, &best) {
            log_evidence = log_evidence.max(other.log_evidence);
            best = other;
        }
        let correction = profile_correction(forward, &best);
        let most = log_likelihood(&self.dataset.data, &best.optimum);
        let fit = Fit {
            effects: forward.layout.effects.clone(),
            best,
            log_evidence: (log_evidence + correction).min(most),
        };
        with_peaks(forward, fit, self.without)
    }

    /// Returns sizes from which the search begins: that of the model linearised without the effect, and
    /// the other sign or a size well inside the range.
    fn sizes(&self, forward: &Forward<'_>) -> Vec<f64> {
        let at = forward.layout.last_size();
        let candidate = &forward.layout.effects[forward.layout.effects.len() - 1];
        let size = &candidate.size;
        if size.is_fixed() {
            return vec![size.low];
        }
        // One step of Gauss-Newton from nothing of it, not stopped by a bound.
        let mut priors = forward.priors();
        (priors[at].low, priors[at].high) = (f64::NEG_INFINITY, f64::INFINITY);
        let linear = linear_fit(forward, self.without, &priors, None);
        let asked = linear.map_or(size.neutral, |optimum| optimum.parameters[at]);
        let asked = asked.clamp(
            (size.neutral - LARGEST_STEP * size.scale).max(size.low),
            (size.neutral + LARGEST_STEP * size.scale).min(size.high),
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
        // The true model replaces the linearised one at the most promising nodes: a fixture near a mode's frequency
        // promises more than it holds. The others count at most as much as these.
        let mut order: Vec<usize> = (0..nodes.len()).collect();
        order.sort_by(|&a, &b| nodes[b].log_evidence.total_cmp(&nodes[a].log_evidence));
        let (first, others) = order.split_at(CORRECTED.min(nodes.len()));
        let mut least = f64::INFINITY;
        for &node in first {
            let linear = &nodes[node];
            match evaluate(forward, &linear.priors, &linear.optimum.parameters) {
                Some(found) => nodes[node] = found,
                None => nodes[node].log_evidence = f64::NEG_INFINITY,
            }
            least = least.min(nodes[node].log_evidence);
        }
        for &node in others {
            nodes[node].log_evidence = nodes[node].log_evidence.min(least);
        }
        self.refine(forward, spacing, &nodes)
    }

    /// Frees the location from the best nodes. If the data fix it within the nodes' spacing, the
    /// maxima are summed; if they do not, the effect is so small that the linearised nodes hold.
    fn refine(&self, forward: &Forward<'_>, spacing: f64, nodes: &[LocalOptimum]) -> Option<Fit> {
        let (at, thresholds) = (
            forward.layout.last_size(),
            &self.dataset.settings.thresholds,
        );
        let evidence: Vec<f64> = nodes.iter().map(|node| node.log_evidence).collect();
        let mut starts: Vec<Vec<f64>> = local_maxima(&evidence)
            .into_iter()
            .map(|node| nodes[node].optimum.parameters.clone())
            .collect();
        // A joint whose stiffness depends on the amplitude has one more start: the best node, with size and exponent
        // of the law that the changes along the decays call for.
        let by_evidence = nodes
            .iter()
            .max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence));
        if forward.layout.location_of_kind(LocationKind::Exponent) == Some(at + 1)
            && let Some(law) = best_law(self.dataset, self.without)
            && let Some(best) = by_evidence
        {
            let mut start = best.optimum.parameters.clone();
            start[at..=at + 1].copy_from_slice(&[law.law.ratio, law.law.exponent]);
            starts.push(start);
        }
        let mut found: Vec<LocalOptimum> = Vec::new();
        descend(forward, &starts, &mut found);
        // A search along a bent valley may stop short of its end: search again from either side of it. Between
        // nodes that are far apart for the resolution of the data a deeper one may lie: search again from these.
        if let Some(best) = best_of(&found)
            && is_located(best, at, spacing, thresholds)
        {
            let parameters = &best.optimum.parameters;
            let near = nodes.iter().map(|node| &node.optimum.parameters);
            let near = near.filter(|node| {
                let apart = (node[at + 1] - parameters[at + 1]).abs();
                apart > 0.5 * spacing && apart < 2.0 * spacing
            });
            let mut starts: Vec<Vec<f64>> = near.cloned().collect();
            for aside in [-0.4 * spacing, 0.4 * spacing] {
                let mut from = parameters.clone();
                from[at + 1] += aside;
                starts.push(from);
            }
            descend(forward, &starts, &mut found);
        }
        let best = best_of(&found)?.clone();
        let total = if is_located(&best, at, spacing, thresholds) {
            log_sum(&evidences_of(&found))
        } else {
            // The nodes see an effect that may lie anywhere, and miss a maximum that is narrow for them.
            let narrow = found.iter();
            let narrow = narrow.filter(|one| is_narrow(one, at, spacing, thresholds));
            let narrow: Vec<f64> = narrow.map(|one| one.log_evidence).collect();
            log_mean(&evidence).max(log_sum(&narrow))
        };
        Some(self.finish(forward, best, total))
    }
}

/// Adds the local optima that are reached from some starts. Of two with equal size and location of the last effect
/// the better one stays.
fn descend(forward: &Forward<'_>, starts: &[Vec<f64>], found: &mut Vec<LocalOptimum>) {
    let which = forward.layout.last_size()..forward.layout.first_nuisance();
    for one in starts
        .iter()
        .filter_map(|start| evaluate(forward, &forward.priors(), start))
    {
        let same = found.iter_mut().find(|other| {
            which.clone().all(|k| {
                let apart = other.optimum.parameters[k] - one.optimum.parameters[k];
                apart.abs() < 2.0 * one.std(k).unwrap_or(0.0)
            })
        });
        match same {
            Some(same) if is_better(&one, same) => *same = one,
            Some(_) => {}
            None => found.push(one),
        }
    }
}

/// Returns the logarithms of the evidence of several optima.
fn evidences_of(all: &[LocalOptimum]) -> Vec<f64> {
    all.iter().map(|one| one.log_evidence).collect()
}

/// Difference of two objectives below which two optima explain the data equally well (1). Searches end within less.
const EQUAL_OBJECTIVES: f64 = 0.01;

/// Returns whether an optimum explains the data better than another one, or as well and is more probable. An effect of
/// next to no size explains the data equally well wherever it is: rounding must not choose among its locations.
fn is_better(one: &LocalOptimum, other: &LocalOptimum) -> bool {
    let lower = other.optimum.objective - one.optimum.objective;
    if lower.abs() > EQUAL_OBJECTIVES {
        return lower > 0.0;
    }
    one.log_evidence > other.log_evidence
}

/// Returns the best of several optima.
fn best_of(found: &[LocalOptimum]) -> Option<&LocalOptimum> {
    let found = found.iter();
    found.reduce(|best, one| if is_better(one, best) { one } else { best })
}

/// Returns whether the data fix the location of the effect with this size within the nodes' spacing.
fn is_narrow(found: &LocalOptimum, size: usize, spacing: f64, thresholds: &Thresholds) -> bool {
    let std = found.std(size + 1);
    std.is_some_and(|std| std < thresholds.located * spacing)
}

/// Returns whether the data fix an effect's location within the nodes' spacing, and its size so far from
/// zero that size and location are Gaussian together.
fn is_located(found: &LocalOptimum, size: usize, spacing: f64, thresholds: &Thresholds) -> bool {
    let away = (found.optimum.parameters[size] - found.priors[size].centre).abs();
    let std = found.std(size);
    is_narrow(found, size, spacing, thresholds)
        && std.is_some_and(|std| away > thresholds.size_detected * std)
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

// Multi-start search: effects so large that the model linearised without them leads nowhere.
//
// Far from the optimum exact data make a valley of every mode. So the search begins with frequencies
// that count as uncertain as they are unexplained, and goes on with the root of that (graduated
// non-convexity, Blake & Zisserman 1987, "Visual Reconstruction"). The slopes of shapes with respect to the joint are
// known near the nominal model only: shapes do not count here.
//
// How much is tried, here and for pairs of effects, is a matter of time. Twice as many locations, starts, optima and
// pairs cost half as much again and change no answer. This was measured with the constants doubled, on 40 virtual
// tests of `blind-check --cases 190 --seed 104`: those of two effects or of effects outside the catalogue.

/// Sizes from which the search begins, over the scale of the effect's prior; with either sign for effects that
/// have two.
const START_SIZES: [f64; 3] = [0.5, 2.0, 8.0];
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
    pub fn first(&self) -> Cause {
        self.effects[0].cause
    }

    /// Returns this start with the objective of all data, shapes included, as the model linearised there promises it.
    pub fn by_all_data(&self, dataset: &Dataset) -> Option<Self> {
        let forward = Forward::new(dataset, &self.effects);
        let priors = forward.priors();
        let there = forward.linearise(&self.parameters, &priors)?;
        let here = Optimum::new(&dataset.data, &priors, self.parameters.clone(), there);
        Some(Self {
            objective: linear_optimum(&dataset.data, &priors, &here)?.objective,
            ..self.clone()
        })
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
        let (predicted, _) = forward.predict(at, None)?;
        let priors = forward.priors();
        Some(objective_at(&self.dataset.data, &priors, at, &predicted))
    }

    /// Returns optima from the starts of least misfit, the last effect at several sizes and locations; the best first.
    fn optima(&self, forward: &Forward<'_>, bases: &[Vec<f64>], tried: usize) -> Vec<Start> {
        let layout = &forward.layout;
        let candidate = &layout.effects[layout.effects.len() - 1];
        let (at, size) = (layout.last_size(), &candidate.size);
        let sizes = START_SIZES.iter().flat_map(|share| [*share, -share]);
        let sizes = sizes.map(|share| size.neutral + share * size.scale);
        let sizes = sizes.filter(|value| (size.low..=size.high).contains(value));
        let locations = candidate.location.map_or(vec![None], |range| {
            let (low, high) = range.searched_bounds();
            let shares = (0..START_LOCATIONS).map(|k| (high - low) * (k as f64 + 0.5));
            shares
                .map(|share| Some(low + share / START_LOCATIONS as f64))
                .collect()
        });
        let mut starts = Vec::new();
        for base in bases {
            for size in sizes.clone() {
                for location in &locations {
                    let mut parameters = base.clone();
                    parameters[at] = size;
                    if let Some(location) = location {
                        parameters[at + 1] = *location;
                    }
                    if let Some(objective) = self.objective(forward, &parameters) {
                        starts.push(Start {
                            effects: layout.effects.clone(),
                            parameters,
                            objective,
                        });
                    }
                }
            }
        }
        let starts = least(starts, tried);
        let optima = starts.iter().filter_map(|start| self.continued(start));
        least(optima.collect(), tried)
    }
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
    let share = search.dataset.settings.thresholds.followed_share;
    let near: Vec<Start> = starts
        .iter()
        .take(FOLLOWED)
        .filter_map(|start| finer.continued(start))
        .filter(|start| start.objective < share * so_far)
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
