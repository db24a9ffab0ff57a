//! How probable the data are under a hypothesis: Laplace's method for all that is well determined, and
//! quadrature for an effect's size, whose prior has a peak at zero and an end there.

use super::catalogue::Size;
use super::forward::{Forward, Layout};
use super::frame::Frame;
use super::knowledge::with_drift;
use super::least_squares::{
    Knowledge, Model, Optimum, factor_of, log_determinant, maximise, maximise_linear, objective_at,
    optimum_at,
};
use super::noise::{self, Reading};
use super::small_unknowns::Small;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

/// A hypothesis fitted from one start.
#[derive(Debug, Clone)]
pub(super) struct Branch {
    /// The best parameters, at the most probable drift.
    pub(super) optimum: Optimum,
    /// What was known of each parameter there.
    pub(super) knowledge: Vec<Knowledge>,
    /// Logarithm of the evidence.
    pub(super) log_evidence: f64,
    /// The spreads of the drift that it was averaged over, each with the logarithm of its own evidence.
    pub(super) drifts: Vec<(f64, f64)>,
}

/// Fits a hypothesis from a start and integrates over everything, the drift's spread included.
pub(super) fn evaluate(
    forward: &Forward<'_>,
    known: &[Knowledge],
    start: &[f64],
    drifts: &[f64],
) -> Option<Branch> {
    let frame = forward.frame;
    let middle = drifts[drifts.len() / 2];
    let known = with_drift(frame, &forward.layout, known, middle);
    let readings = &frame.readings;
    let mut optimum = maximise(readings, &known, start, forward)?;
    let mut branch = over_drifts(frame, &forward.layout, &known, optimum.clone(), drifts);
    // Another drift moves the optimum by the linearised model; where the true one does not follow, it
    // is sought again with that drift.
    for _ in 0..RETURNS {
        let own = branch.knowledge.clone();
        let there = &branch.optimum.parameters;
        let (predicted, _) = forward.predict(there)?;
        let truly = objective_at(readings, &own, (there, &predicted));
        if (truly - branch.optimum.objective).abs() < FOLLOWED {
            return Some(branch);
        }
        optimum = maximise(readings, &own, there, forward)?;
        branch = over_drifts(frame, &forward.layout, &own, optimum.clone(), drifts);
    }
    // What does not settle is worth what the true model says of it, without other drifts.
    let own = with_drift(frame, &forward.layout, &branch.knowledge, middle);
    let there = forward.linearise(&optimum.parameters, &own)?;
    let optimum = optimum_at(readings, &own, optimum.parameters, there);
    let log_evidence = log_evidence(readings, &forward.layout, &own, &optimum);
    Some(Branch {
        optimum,
        knowledge: own,
        log_evidence,
        drifts: vec![(middle, log_evidence)],
    })
}

/// How often the optimum is sought again with the drift that suits it.
const RETURNS: usize = 2;
/// Difference of log probability up to which the linearised model counts as true.
const FOLLOWED: f64 = 0.3;

/// Evidence at an optimum, averaged over the drift's spreads by the model linearised there.
pub(super) fn over_drifts(
    frame: &Frame,
    layout: &Layout,
    known: &[Knowledge],
    optimum: Optimum,
    drifts: &[f64],
) -> Branch {
    let has_drift = frame
        .smalls
        .iter()
        .any(|small| matches!(small, Small::Drift { .. }));
    let drifts = if has_drift { drifts } else { &drifts[..1] };
    let mut best: Option<Branch> = None;
    let mut all = Vec::new();
    for &drift in drifts {
        let own = with_drift(frame, layout, known, drift);
        let moved = moved_optimum(&frame.readings, layout, (&own, &optimum));
        let log_evidence = log_evidence(&frame.readings, layout, &own, &moved);
        all.push((drift, log_evidence));
        if best
            .as_ref()
            .is_none_or(|best| log_evidence > best.log_evidence)
        {
            best = Some(Branch {
                optimum: moved,
                knowledge: own,
                log_evidence,
                drifts: Vec::new(),
            });
        }
    }
    let mut best = best.unwrap_or(Branch {
        optimum,
        knowledge: known.to_vec(),
        log_evidence: f64::NEG_INFINITY,
        drifts: Vec::new(),
    });
    let logs: Vec<f64> = all.iter().map(|one| one.1).collect();
    best.log_evidence = log_mean(&logs);
    best.drifts = all;
    best
}

/// The optimum of the model as it was linearised at another one.
pub(super) fn linear_optimum(
    readings: &[Reading],
    known: &[Knowledge],
    at: &Optimum,
) -> Option<Optimum> {
    maximise_linear(
        readings,
        known,
        (&at.parameters, &at.model.predicted),
        &at.model.slopes,
    )
}

/// The same with the effects kept as they are: the other parameters are so nearly linear that another
/// spread of the drift moves them as the linearised model says, sizes and places are not.
fn moved_optimum(
    readings: &[Reading],
    layout: &Layout,
    (known, at): (&[Knowledge], &Optimum),
) -> Optimum {
    let mut held = known.to_vec();
    let effects = layout.joint.len()..layout.smalls();
    for (known, value) in held[effects.clone()]
        .iter_mut()
        .zip(&at.parameters[effects])
    {
        *known = Knowledge::held(*value);
    }
    match linear_optimum(readings, &held, at) {
        Some(moved) => optimum_at(readings, known, moved.parameters, moved.model),
        None => at.clone(),
    }
}

/// Logarithm of the mean of exponentials.
pub(super) fn log_mean(logs: &[f64]) -> f64 {
    log_sum(logs) - (logs.len() as f64).ln()
}

/// Logarithm of the sum of exponentials.
pub(super) fn log_sum(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + logs.iter().map(|x| (x - most).exp()).sum::<f64>().ln()
}

/// Parameters that are not held.
fn free(known: &[Knowledge]) -> Vec<usize> {
    (0..known.len())
        .filter(|&k| known[k].low < known[k].high)
        .collect()
}

/// Logarithm of the integral of likelihood times prior about an optimum.
///
/// Laplace: ln Z = -objective + d/2 ln 2 pi - ln det(A)/2 + ln of the priors' constants, A being the
/// objective's curvature. The size of a single effect is integrated apart ([`over_size`]); of two
/// effects, kept only when both stand out, the sizes are Gaussian too.
fn log_evidence(
    readings: &[Reading],
    layout: &Layout,
    known: &[Knowledge],
    optimum: &Optimum,
) -> f64 {
    let free = free(known);
    let places = free_places(layout, known);
    // Next to nothing of an effect may lie anywhere, but not outside the range: as broad a Gaussian at most.
    let mut curvature = optimum.curvature.clone();
    for &(place, range) in &places {
        curvature[(place, place)] += 2.0 * PI / (range * range);
    }
    let Some(factor) = factor_of(&curvature, &free) else {
        return f64::NEG_INFINITY;
    };
    let log_det = log_determinant(&factor);
    let mut log = -optimum.objective;
    log += readings
        .iter()
        .map(|reading| noise::log_density_peak(reading.std, reading.freedom))
        .sum::<f64>();
    log += 0.5 * free.len() as f64 * (2.0 * PI).ln() - 0.5 * log_det;
    let sizes: Vec<usize> = (0..layout.effects.len())
        .map(|effect| layout.size(effect))
        .collect();
    for &k in free.iter().filter(|k| !sizes.contains(k)) {
        if known[k].std.is_finite() {
            log -= 0.5 * (2.0 * PI).ln() + known[k].std.ln();
        }
    }
    log -= places.iter().map(|(_, range)| range.ln()).sum::<f64>();
    for effect in 0..layout.effects.len() {
        let size = layout.size(effect);
        let Some(position) = free.iter().position(|&k| k == size) else {
            continue;
        };
        let mut unit = DVector::zeros(free.len());
        unit[position] = 1.0;
        let variance = factor.solve(&unit)[position];
        // What Laplace's method has put there for this parameter is taken out again.
        log -= 0.5 * (2.0 * PI * variance).ln();
        log += over_size(
            &layout.effects[effect].size,
            &known[size],
            (
                optimum.parameters[size],
                optimum.gradient[size],
                1.0 / variance,
            ),
        );
    }
    log.min(log_likelihood(readings, optimum))
}

/// The parameters that are places and free, each with the length of its range.
fn free_places(layout: &Layout, known: &[Knowledge]) -> Vec<(usize, f64)> {
    let place = |effect: usize| {
        let at = layout
            .place(effect)
            .filter(|&at| known[at].low < known[at].high)?;
        let range = layout.effects[effect].place.as_ref()?;
        Some((at, range.inward(range.high) - range.inward(range.low)))
    };
    (0..layout.effects.len()).filter_map(place).collect()
}

/// Logarithm of the likelihood alone. No average of a likelihood over a prior exceeds its largest value.
pub(super) fn log_likelihood(readings: &[Reading], optimum: &Optimum) -> f64 {
    readings
        .iter()
        .zip(&optimum.model.predicted)
        .map(|(reading, predicted)| {
            let residual = (reading.value - predicted) / reading.std;
            noise::log_density_peak(reading.std, reading.freedom)
                + noise::log_density_drop(residual, reading.freedom)
        })
        .sum()
}

/// Points of the quadrature over a size.
const POINTS: usize = 160;

/// ln of the integral of prior(t) exp(-g (t - t0) - h (t - t0)^2/2 + regularisation(t)) dt, where the
/// objective with its normal regularisation has slope g and curvature h at t0.
fn over_size(size: &Size, known: &Knowledge, (at, slope, curvature): (f64, f64, f64)) -> f64 {
    // Only at an end of the range may the optimum have a slope, and only outwards; elsewhere a slope
    // says that the search got stuck, and promises what no structure has.
    let slope = match slope {
        slope if at <= size.low => slope.max(0.0),
        slope if at >= size.high => slope.min(0.0),
        _ => 0.0,
    };
    let log_likelihood = |t: f64| {
        let away = t - at;
        let regular = (t - known.centre) / known.std;
        -slope * away - 0.5 * curvature * away * away + 0.5 * regular * regular
    };
    let std = curvature.powf(-0.5);
    let peak = (at - slope / curvature).clamp(size.low, size.high);
    log_integral(size, (peak - 9.0 * std, peak + 9.0 * std), &log_likelihood)
}

/// ln of the integral of prior times likelihood over a range within the size's bounds, by Simpson's
/// rule on points that crowd at the prior's own peak as well as at the likelihood's.
pub(super) fn log_integral(
    size: &Size,
    (from, to): (f64, f64),
    log_likelihood: &dyn Fn(f64) -> f64,
) -> f64 {
    let (from, to) = (from.max(size.low), to.min(size.high));
    if from >= to {
        return f64::NEG_INFINITY;
    }
    // The prior bends within two fifths of its scale; cut inside, the pieces are smooth.
    let near = 0.2 * size.scale;
    let mut cuts = vec![from];
    for cut in [size.nothing - near, size.nothing, size.nothing + near] {
        if cut > from && cut < to {
            cuts.push(cut);
        }
    }
    cuts.push(to);
    let pieces: Vec<f64> = cuts
        .windows(2)
        .map(|piece| simpson(size, (piece[0], piece[1]), log_likelihood))
        .collect();
    log_sum(&pieces)
}

fn simpson(size: &Size, (from, to): (f64, f64), log_likelihood: &dyn Fn(f64) -> f64) -> f64 {
    let step = (to - from) / POINTS as f64;
    let logs: Vec<f64> = (0..=POINTS)
        .map(|k| {
            let t = from + step * k as f64;
            let weight: f64 = match k {
                0 | POINTS => 1.0,
                k if k % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight.ln() + log_likelihood(t) + size.log_density(t.clamp(size.low, size.high))
        })
        .collect();
    log_sum(&logs) + (step / 3.0).ln()
}

/// Covariance of the parameters at an optimum; held ones have none.
pub(super) fn covariance(known: &[Knowledge], optimum: &Optimum) -> Option<DMatrix<f64>> {
    let free = free(known);
    let inverse = factor_of(&optimum.curvature, &free)?.inverse();
    let mut full = DMatrix::zeros(known.len(), known.len());
    for (i, &a) in free.iter().enumerate() {
        for (j, &b) in free.iter().enumerate() {
            full[(a, b)] = inverse[(i, j)];
        }
    }
    Some(full)
}

#[cfg(test)]
mod tests {
    use super::super::catalogue::{Candidate, PlaceKind, PlaceRange};
    use super::super::least_squares::Linearised;
    use super::*;
    use tapjoint_beam::effects::EffectId;

    /// One stiffness and one size, with readings that need not be linear in either.
    struct Small {
        readings: Vec<Reading>,
        size: Size,
        model: fn(f64, f64) -> Vec<f64>,
    }

    impl Model for Small {
        type Rest = ();

        fn predict(&self, parameters: &[f64]) -> Option<(Vec<f64>, ())> {
            Some(((self.model)(parameters[0], parameters[1]), ()))
        }

        fn complete(
            &self,
            parameters: &[f64],
            _: &[Knowledge],
            (predicted, ()): (Vec<f64>, ()),
        ) -> Option<Linearised> {
            const STEP: f64 = 1e-6;
            let [a, t] = [parameters[0], parameters[1]];
            let columns = [(self.model)(a + STEP, t), (self.model)(a, t + STEP)];
            let slopes = DMatrix::from_fn(predicted.len(), 2, |row, column| {
                (columns[column][row] - predicted[row]) / STEP
            });
            Some(Linearised { predicted, slopes })
        }
    }

    impl Small {
        fn by_laplace(&self) -> f64 {
            let layout = Layout {
                joint: vec![0],
                effects: vec![Candidate {
                    effect: EffectId::SensorMass,
                    size: self.size,
                    place: None,
                }],
            };
            let size = Knowledge {
                low: self.size.low,
                high: self.size.high,
                ..Knowledge::normal(0.0, 3.0 * self.size.scale)
            };
            let known = [Knowledge::normal(0.0, 1.5), size];
            let start = [0.0, 0.1 * self.size.scale];
            let optimum = maximise(&self.readings, &known, &start, self).unwrap();
            log_evidence(&self.readings, &layout, &known, &optimum)
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
                        .zip(&self.readings)
                        .map(|(predicted, reading)| {
                            noise::log_density_peak(reading.std, reading.freedom)
                                + noise::log_density_drop(
                                    (reading.value - predicted) / reading.std,
                                    reading.freedom,
                                )
                        })
                        .sum();
                    let prior = -0.5 * (a / 1.5).powi(2) - (1.5 * (2.0 * PI).sqrt()).ln();
                    logs.push(likelihood + prior + self.size.log_density(t));
                }
            }
            log_sum(&logs) + (width[0] * width[1]).ln()
        }
    }

    fn readings(values: &[f64], std: f64, freedom: f64) -> Vec<Reading> {
        let reading = |value: &f64| Reading {
            value: *value,
            std,
            freedom,
        };
        values.iter().map(reading).collect()
    }

    fn size(low: f64) -> Size {
        Size {
            name: "mass",
            scale: 1.0,
            nothing: 0.0,
            low,
            high: 8.0,
        }
    }

    fn linear(a: f64, t: f64) -> Vec<f64> {
        vec![a + t, a - t, 0.5 * a + 2.0 * t, 0.3 * t]
    }

    #[test]
    fn val_evidence_of_a_size_that_stands_out_is_the_integral() {
        let case = Small {
            readings: readings(&[1.25, -0.55, 1.75, 0.3], 0.2, f64::INFINITY),
            size: size(0.0),
            model: linear,
        };
        // Everything but the prior of the size is Gaussian: what differs is the grid's own error.
        let (laplace, force) = (case.by_laplace(), case.by_force());
        assert!((laplace - force).abs() < 5e-3, "{laplace} {force}");
    }

    #[test]
    fn val_evidence_at_the_end_of_the_range_is_the_integral() {
        // The readings ask for a negative size, which there is not.
        let case = Small {
            readings: readings(&[0.3, 0.5, 0.1, -0.1], 0.2, f64::INFINITY),
            size: size(0.0),
            model: linear,
        };
        let (laplace, force) = (case.by_laplace(), case.by_force());
        assert!((laplace - force).abs() < 1e-2, "{laplace} {force}");
    }

    #[test]
    fn val_evidence_of_bent_models_with_few_taps_is_nearly_the_integral() {
        let case = Small {
            readings: readings(&[0.9, -0.4, 1.2, 0.35, 0.6], 0.15, 8.0),
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
    /// The same beside a place that changes next to nothing.
    struct Placed(Small);

    impl Model for Placed {
        type Rest = ();

        fn predict(&self, parameters: &[f64]) -> Option<(Vec<f64>, ())> {
            self.0.predict(parameters)
        }

        fn complete(
            &self,
            parameters: &[f64],
            known: &[Knowledge],
            rest: (Vec<f64>, ()),
        ) -> Option<Linearised> {
            let own = self.0.complete(parameters, known, rest)?;
            let slopes = own.slopes.insert_column(2, 1e-5);
            Some(Linearised { slopes, ..own })
        }
    }

    #[test]
    fn limit_a_place_that_changes_nothing_tells_nothing() {
        let case = Small {
            readings: readings(&[0.3, 0.5, 0.1, -0.1], 0.2, f64::INFINITY),
            size: size(0.0),
            model: linear,
        };
        let without = case.by_laplace();
        let placed = Placed(case);
        let layout = Layout {
            joint: vec![0],
            effects: vec![Candidate {
                effect: EffectId::AddedMass,
                size: size(0.0),
                place: Some(PlaceRange {
                    kind: PlaceKind::Position,
                    low: 0.0,
                    high: 0.4,
                    nodes: 5,
                }),
            }],
        };
        let size = Knowledge {
            low: 0.0,
            high: 8.0,
            ..Knowledge::normal(0.0, 3.0)
        };
        let place = Knowledge {
            centre: 0.2,
            std: f64::INFINITY,
            low: 0.0,
            high: 0.4,
        };
        let known = [Knowledge::normal(0.0, 1.5), size, place];
        let readings = &placed.0.readings;
        let optimum = maximise(readings, &known, &[0.0, 0.1, 0.2], &placed).unwrap();
        let with = log_evidence(readings, &layout, &known, &optimum);
        // The same integral over size and stiffness; where the effect lies is the prior's affair alone.
        assert!((with - without).abs() < 1e-6, "{with} {without}");
    }
}
