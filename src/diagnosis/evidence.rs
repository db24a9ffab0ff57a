//! Evidence of a hypothesis: Laplace's method for all that is well determined, and
//! quadrature for an effect's size, whose prior has a peak at zero and an end there.

use crate::dataset::{Dataset, Datum};
use crate::forward::Forward;
use crate::optimum::{Model, Optimum, linear_optimum, maximise, objective_at, search};
use crate::parameters::{CandidateEffect, Layout, Prior, Size};
use nalgebra::DMatrix;
use std::f64::consts::PI;
use tapjoint_numerics::cholesky::Cholesky;

/// Local optimum of a hypothesis, fitted from one start.
#[derive(Debug, Clone)]
pub struct LocalOptimum {
    /// Best parameters, at the most probable drift.
    pub optimum: Optimum,
    /// Priors of the parameters there. That of a size far beyond its scale is wider than stated: it only guides the search.
    pub priors: Vec<Prior>,
    /// Logarithm of the evidence.
    pub log_evidence: f64,
    /// Spreads of the drift over which it was averaged, each with the logarithm of its own evidence.
    pub drifts: Vec<(f64, f64)>,
}

impl LocalOptimum {
    /// Returns the standard deviation of one parameter; 0 of a held one.
    pub fn std(&self, parameter: usize) -> Option<f64> {
        if self.priors[parameter].is_held() {
            return Some(0.0);
        }
        let factor = Cholesky::new(&self.optimum.curvature)?;
        Some(factor.variance(parameter).sqrt())
    }

    /// Returns the covariance of the parameters.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        self.optimum.covariance(&self.priors)
    }
}

/// Hypothesis with its best fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Effects that it adds; none for the nominal model and for what is unknown.
    pub effects: Vec<CandidateEffect>,
    /// Best of its local optima.
    pub best: LocalOptimum,
    /// Logarithm of the evidence of all local optima together.
    pub log_evidence: f64,
}

impl Fit {
    /// Returns the fit without effects of some equally probable variants of the nominal model; `None` without any.
    pub fn of_variants(found: Vec<LocalOptimum>) -> Option<Self> {
        let all: Vec<f64> = found.iter().map(|one| one.log_evidence).collect();
        let best = found
            .into_iter()
            .max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
        Some(Fit {
            effects: Vec::new(),
            best,
            log_evidence: log_mean(&all),
        })
    }

    /// Replaces this fit by another one of the same effects, if that explains the data better. Returns whether it does.
    pub fn replace_by_better(&mut self, other: Fit) -> bool {
        let is_better = other.best.optimum.objective < self.best.optimum.objective - BETTER;
        if is_better {
            // The worse optimum may be a part of the same valley: both together would count it twice.
            let log_evidence = self.log_evidence.max(other.log_evidence);
            *self = Fit {
                log_evidence,
                ..other
            };
        }
        is_better
    }

    /// Best parameters.
    pub fn parameters(&self) -> &[f64] {
        &self.best.optimum.parameters
    }
}

/// Decrease of the objective from which on an optimum is better than another one: one standard deviation.
pub const BETTER: f64 = 0.5;
/// Searches with the drift that suits the optimum.
const RETURNS: usize = 2;
/// Searches with a wider prior of a size.
const WIDENINGS: usize = 2;
/// Width of the wider prior, over the size found so far: it then pulls by next to nothing.
const WIDER: f64 = 4.0;
/// Difference of log probability up to which the linearised model counts as true.
const LINEAR_ENOUGH: f64 = 0.3;

/// Fits a hypothesis from a start and integrates over all parameters, the drift's spread included.
pub fn evaluate(forward: &Forward<'_>, priors: &[Prior], start: &[f64]) -> Option<LocalOptimum> {
    let (dataset, layout) = (forward.dataset, &forward.layout);
    let drifts = &dataset.settings.drift_stds;
    let middle = drifts[drifts.len() / 2];
    let mut priors = dataset.with_drift(layout, priors, middle);
    let (mut optimum, mut solution) = search(&dataset.data, &priors, start, forward, None)?;
    // The search's normal prior would hold back a size far beyond its scale, which Cauchy's does not.
    for _ in 0..WIDENINGS {
        if !widen(layout, &mut priors, &optimum) {
            break;
        }
        let known = Some((&optimum, &solution));
        (optimum, solution) = search(&dataset.data, &priors, &optimum.parameters, forward, known)?;
    }
    let mut found = over_drifts(dataset, layout, &priors, &optimum, drifts);
    // Another drift moves the optimum by the linearised model; where the true one does not follow, it
    // is searched again with that drift.
    for _ in 0..RETURNS {
        let own = found.priors.clone();
        let there = &found.optimum.parameters;
        if *there == optimum.parameters {
            return Some(found);
        }
        // The linearised step may leave what the model allows.
        let predicted = forward.predict(there, Some(&solution));
        let truly = predicted.map_or(f64::INFINITY, |(predicted, _)| {
            objective_at(&dataset.data, &own, there, &predicted)
        });
        if (truly - found.optimum.objective).abs() < LINEAR_ENOUGH {
            return Some(found);
        }
        let before = &optimum.model.predicted;
        let kept = objective_at(&dataset.data, &own, &optimum.parameters, before);
        // The linearised step leaves a bent valley, and promises less than the linearised model may err. The optimum that was
        // searched stands then. It may be off by three quarters of a standard deviation.
        if (kept - found.optimum.objective).abs() < LINEAR_ENOUGH {
            found.optimum = optimum.under(&dataset.data, &own);
            return Some(found);
        }
        // It may have crossed to another valley, as where a tap moves off the end of a beam.
        let start = if kept < truly {
            &optimum.parameters
        } else {
            there
        };
        let known = Some((&optimum, &solution));
        (optimum, solution) = search(&dataset.data, &own, start, forward, known)?;
        found = over_drifts(dataset, layout, &own, &optimum, drifts);
    }
    // A search that does not settle counts with the true model, without other drifts.
    let own = dataset.with_drift(layout, &found.priors, middle);
    let there = forward.linearise(&optimum.parameters, &own)?;
    let optimum = Optimum::new(&dataset.data, &own, optimum.parameters, there);
    let log_evidence = log_evidence(&dataset.data, layout, &own, &optimum);
    Some(LocalOptimum {
        optimum,
        priors: own,
        log_evidence,
        drifts: vec![(middle, log_evidence)],
    })
}

/// Widens the normal prior of each size that lies beyond its standard deviation. Returns whether there is one.
fn widen(layout: &Layout, priors: &mut [Prior], optimum: &Optimum) -> bool {
    let mut is_wider = false;
    for effect in 0..layout.effects.len() {
        let size = layout.size(effect);
        let prior = &mut priors[size];
        let away = (optimum.parameters[size] - prior.centre).abs();
        if !prior.is_held() && away > prior.std {
            prior.std = WIDER * away;
            is_wider = true;
        }
    }
    is_wider
}

/// Averages the evidence at an optimum over the drift's spreads, by the model linearised there.
pub fn over_drifts(
    dataset: &Dataset,
    layout: &Layout,
    priors: &[Prior],
    optimum: &Optimum,
    drifts: &[f64],
) -> LocalOptimum {
    let drifts = match dataset.first_drift() {
        Some(_) => drifts,
        None => &drifts[..1],
    };
    let mut best = LocalOptimum {
        optimum: optimum.clone(),
        priors: priors.to_vec(),
        log_evidence: f64::NEG_INFINITY,
        drifts: Vec::new(),
    };
    for (k, &drift) in drifts.iter().enumerate() {
        let own = dataset.with_drift(layout, priors, drift);
        // The linearised optimum with the effects kept as they are. The other parameters are so nearly linear that
        // another spread of the drift moves them as the linearised model predicts; sizes and locations are not.
        let mut held = own.clone();
        let effects = layout.joint.len()..layout.first_nuisance();
        let values = &optimum.parameters[effects.clone()];
        for (prior, value) in held[effects].iter_mut().zip(values) {
            *prior = Prior::held(*value);
        }
        let moved = linear_optimum(&dataset.data, &held, optimum)
            .map_or_else(|| optimum.clone(), |moved| moved.under(&dataset.data, &own));
        let log_evidence = log_evidence(&dataset.data, layout, &own, &moved);
        best.drifts.push((drift, log_evidence));
        if k == 0 || log_evidence > best.log_evidence {
            best.optimum = moved;
            best.priors = own;
            best.log_evidence = log_evidence;
        }
    }
    let logs: Vec<f64> = best.drifts.iter().map(|one| one.1).collect();
    best.log_evidence = log_mean(&logs);
    best
}

/// Returns the parameters without the last effect, and that effect with a size and a location.
pub fn start_with(without: &Fit, layout: &Layout, size: f64, location: Option<f64>) -> Vec<f64> {
    let at = layout.last_size();
    let mut start = without.parameters().to_vec();
    start.insert(at, size);
    if let Some(location) = location {
        start.insert(at + 1, location);
    }
    start
}

/// Returns the optimum of the model linearised where the last effect is next to nothing, beside a fit without it.
pub fn linear_fit(
    forward: &Forward<'_>,
    without: &Fit,
    priors: &[Prior],
    location: Option<f64>,
) -> Option<Optimum> {
    let size = &forward.layout.effects[forward.layout.effects.len() - 1].size;
    let start = start_with(without, &forward.layout, size.small(), location);
    let there = forward.linearise(&start, priors)?;
    let data = &forward.dataset.data;
    let here = Optimum::new(data, priors, start, there);
    linear_optimum(data, priors, &here)
}

/// Returns the logarithm of the mean of exponentials.
pub fn log_mean(logs: &[f64]) -> f64 {
    log_sum(logs) - (logs.len() as f64).ln()
}

/// Returns the logarithm of the sum of exponentials.
pub fn log_sum(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + logs.iter().map(|x| (x - most).exp()).sum::<f64>().ln()
}

/// Returns the logarithm of the integral of likelihood times prior about an optimum.
///
/// Laplace, with the curvature A of the objective:
///
/// ```text
///                    d              1
/// ln Z = -objective + - ln(2 pi)  -  - ln det A  +  ln of the priors' constants
///                    2              2
/// ```
///
/// Sizes are integrated separately ([`over_size`]).
fn log_evidence(data: &[Datum], layout: &Layout, priors: &[Prior], optimum: &Optimum) -> f64 {
    let free: Vec<usize> = (0..priors.len())
        .filter(|k| !priors[*k].is_held())
        .collect();
    // A tiny effect may lie anywhere, but not outside the range: as broad a Gaussian at most.
    let mut curvature = optimum.curvature.clone();
    let mut ranges = Vec::new();
    for (effect, candidate) in layout.effects.iter().enumerate() {
        if let (Some(at), Some(range)) = (layout.location(effect), candidate.location)
            && !priors[at].is_held()
            // A location that a datum states has its own density.
            && !priors[at].std.is_finite()
        {
            let (low, high) = range.searched_bounds();
            ranges.push(high - low);
            curvature[(at, at)] += 2.0 * PI / ((high - low) * (high - low));
        }
    }
    let Some(factor) = Cholesky::new(&curvature) else {
        return f64::NEG_INFINITY;
    };
    let mut log = -optimum.objective;
    log += data.iter().map(Datum::log_density_peak).sum::<f64>();
    log += 0.5 * free.len() as f64 * (2.0 * PI).ln() - 0.5 * factor.log_determinant();
    let sizes = 0..layout.effects.len();
    let sizes: Vec<usize> = sizes.map(|effect| layout.size(effect)).collect();
    for &k in free.iter().filter(|k| !sizes.contains(k)) {
        if priors[k].std.is_finite() {
            log -= 0.5 * (2.0 * PI).ln() + priors[k].std.ln();
        }
    }
    log -= ranges.into_iter().map(f64::ln).sum::<f64>();
    for (effect, &size) in layout.effects.iter().zip(&sizes) {
        if priors[size].is_held() {
            continue;
        }
        let variance = factor.variance(size);
        // Laplace's factor for this parameter is taken out again.
        log -= 0.5 * (2.0 * PI * variance).ln();
        log += over_size(&effect.size, &priors[size], optimum, size, 1.0 / variance);
    }
    log.min(log_likelihood(data, optimum))
}

/// Returns the logarithm of the likelihood alone. No average of a likelihood over a prior exceeds its largest value.
pub fn log_likelihood(data: &[Datum], optimum: &Optimum) -> f64 {
    let pairs = data.iter().zip(&optimum.model.predicted);
    pairs
        .map(|(datum, predicted)| {
            datum.log_density_peak() + datum.log_density_drop(datum.residual(*predicted))
        })
        .sum()
}

/// Points of the quadrature over each piece of a size's range. The logarithm of the integral errs by at most 3e-6. The
/// likelihood may be 0.001 to 10,000 scales of the prior wide.
const POINTS: usize = 64;

/// Returns the negative logarithm of a normal prior without its constant.
fn regularisation(prior: &Prior, value: f64) -> f64 {
    0.5 * ((value - prior.centre) / prior.std).powi(2)
}

/// Returns ln of the integral of prior(t) exp(-g (t - t0) - h (t - t0)^2/2 + regularisation(t)) dt, where the
/// objective with its normal regularisation has slope g and curvature h at t0, the parameter `size` of the optimum.
fn over_size(prior: &Size, normal: &Prior, optimum: &Optimum, size: usize, curvature: f64) -> f64 {
    let at = optimum.parameters[size];
    // Only at an end of the range may the optimum have a slope, and only outwards; elsewhere a slope
    // shows that the search got stuck, and promises a likelihood that no structure has.
    let slope = match optimum.gradient[size] {
        slope if at <= prior.low => slope.max(0.0),
        slope if at >= prior.high => slope.min(0.0),
        _ => 0.0,
    };
    let std = curvature.powf(-0.5);
    let peak = (at - slope / curvature).clamp(prior.low, prior.high);
    log_integral(prior, peak - 9.0 * std, peak + 9.0 * std, |t| {
        let away = t - at;
        -slope * away - 0.5 * curvature * away * away + regularisation(normal, t)
    })
}

/// Returns ln of the integral of prior times likelihood over a range within the size's bounds, by Simpson's
/// rule on points that crowd at the prior's own peak as well as at the likelihood's.
fn log_integral(size: &Size, from: f64, to: f64, log_likelihood: impl Fn(f64) -> f64) -> f64 {
    let (from, to) = (from.max(size.low), to.min(size.high));
    if from >= to {
        return f64::NEG_INFINITY;
    }
    // The prior bends at its scale and falls over decades; cut between, the pieces are smooth.
    let aside = [0.2, 1.0, 4.0, 20.0, 100.0, 500.0, 2500.0].map(|share| share * size.scale);
    let below = aside.iter().rev().map(|away| size.neutral - away);
    let above = aside.iter().map(|away| size.neutral + away);
    let mut cuts = vec![from];
    for cut in below.chain([size.neutral]).chain(above) {
        if cut > from && cut < to {
            cuts.push(cut);
        }
    }
    cuts.push(to);
    let pieces = cuts.windows(2).map(|piece| {
        let step = (piece[1] - piece[0]) / POINTS as f64;
        let logs = (0..=POINTS).map(|k| {
            let t = piece[0] + step * k as f64;
            let weight: f64 = match k {
                0 | POINTS => 1.0,
                k if k % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight.ln() + log_likelihood(t) + size.log_density(t.clamp(size.low, size.high))
        });
        log_sum(&logs.collect::<Vec<_>>()) + (step / 3.0).ln()
    });
    log_sum(&pieces.collect::<Vec<_>>())
}

/// Returns the correction that the likelihood's profile over a single effect's size adds to the log evidence of its
/// parabola. It is computed only for a poorly known size, where the parabola need not hold. Beside another effect, or
/// at a fitted location, it is 0.
pub fn profile_correction(forward: &Forward<'_>, found: &LocalOptimum) -> f64 {
    let [effect] = &forward.layout.effects[..] else {
        return 0.0;
    };
    let std = found.std(forward.layout.last_size());
    let Some(std) = std.filter(|_| effect.location.is_none()) else {
        return 0.0;
    };
    let share = forward.dataset.settings.thresholds.poorly_known_size;
    if std < share * effect.size.scale {
        return 0.0;
    }
    profile_gain(forward, found, &effect.size, std * std).unwrap_or(0.0)
}

/// Sizes over their scale between which the profile is followed: 97 % of the prior.
const PROFILE_REACH: f64 = 20.0;

/// Returns the logarithm of the integral over the profile of the likelihood over that over its parabola.
fn profile_gain(
    forward: &Forward<'_>,
    found: &LocalOptimum,
    size: &Size,
    variance: f64,
) -> Option<f64> {
    const NODES: usize = 9;
    let at = forward.layout.last_size();
    let (here, prior) = (found.optimum.parameters[at], &found.priors[at]);
    let reach = 4.0 * variance.sqrt();
    let from = (here - reach)
        .max(size.low)
        .max(size.neutral - PROFILE_REACH * size.scale);
    let to = (here + reach)
        .min(size.high)
        .min(size.neutral + PROFILE_REACH * size.scale);
    let mut logs = Vec::new();
    // The regularisation of the size is no part of its likelihood; where it is held it has none.
    let base = marginal_log(&found.optimum, at)? + regularisation(prior, here);
    for node in 0..NODES {
        let t = from + (to - from) * node as f64 / (NODES - 1) as f64;
        let mut held = found.priors.clone();
        held[at] = Prior::held(t);
        let mut start = found.optimum.parameters.clone();
        start[at] = t;
        let optimum = maximise(&forward.dataset.data, &held, &start, forward);
        let log = optimum.and_then(|optimum| marginal_log(&optimum, at));
        logs.push((t, log.map_or(f64::NEG_INFINITY, |log| log - base)));
    }
    let slope = found.optimum.gradient[at];
    // On straight lines between the nodes.
    let profile = log_integral(size, from, to, |t| {
        let above = logs
            .partition_point(|point| point.0 < t)
            .clamp(1, NODES - 1);
        let ((t0, y0), (t1, y1)) = (logs[above - 1], logs[above]);
        if y0 == f64::NEG_INFINITY || y1 == f64::NEG_INFINITY {
            return f64::NEG_INFINITY;
        }
        y0 + (y1 - y0) * (t - t0) / (t1 - t0)
    });
    let parabola = log_integral(size, from, to, |t| {
        let away = t - here;
        -slope * away - 0.5 * away * away / variance + regularisation(prior, t)
            - regularisation(prior, here)
    });
    (profile.is_finite() && parabola.is_finite()).then_some(profile - parabola)
}

/// Returns -objective - ln det/2 over all free parameters but the size.
fn marginal_log(optimum: &Optimum, size: usize) -> Option<f64> {
    let mut curvature = optimum.curvature.clone();
    curvature.row_mut(size).fill(0.0);
    curvature.column_mut(size).fill(0.0);
    curvature[(size, size)] = 1.0;
    let factor = Cholesky::new(&curvature)?;
    Some(-optimum.objective - 0.5 * factor.log_determinant())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Cause, LocationKind, LocationRange, Target};
    use std::sync::Arc;
    use tapjoint_beam::effects::EffectId;

    /// One stiffness and one size, with data that need not be linear in either.
    struct TwoParameters {
        data: Vec<Datum>,
        size: Size,
        model: fn(f64, f64) -> Vec<f64>,
    }

    impl Model for TwoParameters {
        type Solution = ();

        fn predict(&self, parameters: &[f64], _: Option<&()>) -> Option<(Vec<f64>, ())> {
            Some(((self.model)(parameters[0], parameters[1]), ()))
        }

        fn slopes(&self, parameters: &[f64], _: &[Prior], _: &()) -> Option<Arc<DMatrix<f64>>> {
            const STEP: f64 = 1e-6;
            let [a, t] = [parameters[0], parameters[1]];
            let here = (self.model)(a, t);
            let columns = [(self.model)(a + STEP, t), (self.model)(a, t + STEP)];
            let slopes = DMatrix::from_fn(here.len(), 2, |row, column| {
                (columns[column][row] - here[row]) / STEP
            });
            Some(Arc::new(slopes))
        }
    }

    impl TwoParameters {
        fn by_laplace(&self) -> f64 {
            let layout = Layout {
                joint: vec![0],
                effects: vec![CandidateEffect {
                    cause: Cause::Effect(EffectId::SensorMass),
                    target: Target::All,
                    size: self.size,
                    location: None,
                    variants: 1,
                }],
            };
            let size = Prior {
                low: self.size.low,
                high: self.size.high,
                ..Prior::normal(0.0, 3.0 * self.size.scale)
            };
            let known = [Prior::normal(0.0, 1.5), size];
            let start = [0.0, 0.1 * self.size.scale];
            let optimum = maximise(&self.data, &known, &start, self).unwrap();
            log_evidence(&self.data, &layout, &known, &optimum)
        }

        /// The integral as a sum over a fine grid.
        fn by_force(&self) -> f64 {
            const STEPS: usize = 700;
            let (low, high) = (
                self.size.low.max(-6.0 * self.size.scale),
                self.size.high.min(6.0 * self.size.scale),
            );
            let width = [12.0 / STEPS as f64, (high - low) / STEPS as f64];
            let mut logs = Vec::with_capacity(STEPS * STEPS);
            for i in 0..STEPS {
                let a = -6.0 + width[0] * (i as f64 + 0.5);
                for j in 0..STEPS {
                    let t = low + width[1] * (j as f64 + 0.5);
                    let likelihood: f64 = (self.model)(a, t)
                        .iter()
                        .zip(&self.data)
                        .map(|(predicted, datum)| {
                            datum.log_density_peak()
                                + datum.log_density_drop(datum.residual(*predicted))
                        })
                        .sum();
                    let prior = -0.5 * (a / 1.5).powi(2) - (1.5 * (2.0 * PI).sqrt()).ln();
                    logs.push(likelihood + prior + self.size.log_density(t));
                }
            }
            log_sum(&logs) + (width[0] * width[1]).ln()
        }
    }

    fn data(values: &[f64], std: f64, freedom: f64) -> Vec<Datum> {
        let datum = |value: &f64| Datum {
            value: *value,
            std,
            freedom,
        };
        values.iter().map(datum).collect()
    }

    fn size(low: f64) -> Size {
        Size {
            name: "mass",
            scale: 1.0,
            neutral: 0.0,
            low,
            high: 8.0,
            known: None,
        }
    }

    fn linear(a: f64, t: f64) -> Vec<f64> {
        vec![a + t, a - t, 0.5 * a + 2.0 * t, 0.3 * t]
    }

    #[test]
    fn val_evidence_of_a_size_that_stands_out_is_the_integral() {
        let case = TwoParameters {
            data: data(&[1.25, -0.55, 1.75, 0.3], 0.2, f64::INFINITY),
            size: size(0.0),
            model: linear,
        };
        // Everything but the prior of the size is Gaussian: what differs is the grid's own error.
        let (laplace, force) = (case.by_laplace(), case.by_force());
        assert!((laplace - force).abs() < 5e-3, "{laplace} {force}");
    }

    #[test]
    fn val_evidence_at_the_end_of_the_range_is_the_integral() {
        // The data ask for a negative size, which there is not.
        let case = TwoParameters {
            data: data(&[0.3, 0.5, 0.1, -0.1], 0.2, f64::INFINITY),
            size: size(0.0),
            model: linear,
        };
        let (laplace, force) = (case.by_laplace(), case.by_force());
        assert!((laplace - force).abs() < 1e-2, "{laplace} {force}");
    }

    #[test]
    fn val_evidence_of_bent_models_with_few_taps_is_nearly_the_integral() {
        let case = TwoParameters {
            data: data(&[0.9, -0.4, 1.2, 0.35, 0.6], 0.15, 8.0),
            size: size(-8.0),
            model: |a, t| {
                let root = (1.0 + 0.3 * t + 0.2 * a).max(1e-3).ln();
                vec![
                    a + t,
                    a - t + 0.1 * t * t,
                    0.5 * a + 1.5 * t,
                    root,
                    0.8 * t + 0.1 * a * t,
                ]
            },
        };
        // Student's t and the bends make the integrand no Gaussian: 0.2 is a factor of 1.2 where
        // evidence is judged by factors of 3 and more.
        let (laplace, force) = (case.by_laplace(), case.by_force());
        assert!((laplace - force).abs() < 0.2, "{laplace} {force}");
    }
    /// Two parameters beside a location that changes next to nothing.
    struct Placed(TwoParameters);

    impl Model for Placed {
        type Solution = ();

        fn predict(&self, parameters: &[f64], _: Option<&()>) -> Option<(Vec<f64>, ())> {
            self.0.predict(parameters, None)
        }

        fn slopes(&self, parameters: &[f64], known: &[Prior], _: &()) -> Option<Arc<DMatrix<f64>>> {
            let own = self.0.slopes(parameters, known, &())?;
            Some(Arc::new((*own).clone().insert_column(2, 1e-5)))
        }
    }

    /// The density integrates to 1, over whatever range. 3e-6: the error of the quadrature.
    #[test]
    fn limit_a_size_that_no_datum_feels_has_evidence_one() {
        for reach in [0.1, 10.0, 3e3, 2e4] {
            for low in [-reach, 0.0] {
                let wide = Size {
                    high: reach,
                    ..size(low)
                };
                let log = log_integral(&wide, low, reach, |_| 0.0);
                assert!(log.abs() < 3e-6, "{low} to {reach}: {log}");
            }
        }
    }

    /// The other route: by t = tan u Cauchy's prior becomes uniform in u, and the integral is a mean. Its steps are a
    /// hundredth of the narrowest likelihood. 1e-5: the errors of both.
    #[test]
    fn val_the_integral_over_a_size_is_the_mean_over_its_angle() {
        const STEPS: usize = 1_000_000;
        let wide = Size {
            high: 2e4,
            ..size(-2e4)
        };
        let end = wide.high.atan();
        for (peak, std) in [
            (0.3, 1e-3),
            (0.02, 0.05),
            (-3.0, 2.0),
            (40.0, 100.0),
            (5.0, 1e4),
        ] {
            let log_likelihood = |t: f64| -0.5 * ((t - peak) / std).powi(2);
            let mean = (0..STEPS).map(|step| {
                let u = end * (2.0 * (step as f64 + 0.5) / STEPS as f64 - 1.0);
                log_likelihood(u.tan()).exp()
            });
            let mean = mean.sum::<f64>() / STEPS as f64;
            let found = log_integral(&wide, peak - 9.0 * std, peak + 9.0 * std, log_likelihood);
            assert!(
                (found - mean.ln()).abs() < 1e-5,
                "{std}: {found} {}",
                mean.ln()
            );
        }
    }

    #[test]
    fn limit_a_place_that_changes_nothing_tells_nothing() {
        let case = TwoParameters {
            data: data(&[0.3, 0.5, 0.1, -0.1], 0.2, f64::INFINITY),
            size: size(0.0),
            model: linear,
        };
        let without = case.by_laplace();
        let placed = Placed(case);
        let layout = Layout {
            joint: vec![0],
            effects: vec![CandidateEffect {
                cause: Cause::Effect(EffectId::AddedMass),
                target: Target::All,
                size: size(0.0),
                location: Some(LocationRange {
                    kind: LocationKind::Position,
                    low: 0.0,
                    high: 0.4,
                    nodes: 5,
                }),
                variants: 1,
            }],
        };
        let size = Prior {
            low: 0.0,
            high: 8.0,
            ..Prior::normal(0.0, 3.0)
        };
        let place = Prior {
            centre: 0.2,
            std: f64::INFINITY,
            low: 0.0,
            high: 0.4,
        };
        let known = [Prior::normal(0.0, 1.5), size, place];
        let data = &placed.0.data;
        let optimum = maximise(data, &known, &[0.0, 0.1, 0.2], &placed).unwrap();
        let with = log_evidence(data, &layout, &known, &optimum);
        // The same integral over size and stiffness; where the effect lies is the prior's affair alone.
        assert!((with - without).abs() < 1e-6, "{with} {without}");
    }
}
