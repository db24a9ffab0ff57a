//! Weighted least squares with priors, bounds and Student t readings: Gauss-Newton with step control.

use super::noise::{self, Reading};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// What a model says at a point: predictions of all readings, and their slopes.
#[derive(Debug, Clone)]
pub(super) struct Linearised {
    /// Prediction of each reading.
    pub(super) predicted: Vec<f64>,
    /// Derivative of each reading (row) with respect to each parameter (column).
    pub(super) slopes: DMatrix<f64>,
}

/// A model that is asked for predictions at many points and for slopes, which cost more, at those that count.
pub(super) trait Model {
    /// What a prediction leaves behind for the slopes at the same point.
    type Rest;
    /// Predictions at a point; `None` where there is no such structure.
    fn predict(&self, parameters: &[f64]) -> Option<(Vec<f64>, Self::Rest)>;
    /// The same with the slopes with respect to all parameters that are not held.
    fn complete(
        &self,
        parameters: &[f64],
        known: &[Knowledge],
        predicted: (Vec<f64>, Self::Rest),
    ) -> Option<Linearised>;

    /// Prediction and slopes at a point.
    fn linearise(&self, parameters: &[f64], known: &[Knowledge]) -> Option<Linearised> {
        self.complete(parameters, known, self.predict(parameters)?)
    }
}

/// What is known of a parameter before the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Knowledge {
    /// Centre of the normal distribution.
    pub(super) centre: f64,
    /// Its standard deviation; infinite for none.
    pub(super) std: f64,
    /// Lowest value.
    pub(super) low: f64,
    /// Highest value.
    pub(super) high: f64,
}

impl Knowledge {
    /// Normal, unbounded.
    pub(super) fn normal(centre: f64, std: f64) -> Self {
        Knowledge {
            centre,
            std,
            low: f64::NEG_INFINITY,
            high: f64::INFINITY,
        }
    }

    /// Held at a value: its density is left to the caller.
    pub(super) fn held(value: f64) -> Self {
        Knowledge {
            centre: value,
            std: f64::INFINITY,
            low: value,
            high: value,
        }
    }

    /// Whether it is no unknown.
    pub(super) fn is_held(&self) -> bool {
        self.low >= self.high
    }
}

/// Where the search ended.
#[derive(Debug, Clone)]
pub(super) struct Optimum {
    /// All parameters.
    pub(super) parameters: Vec<f64>,
    /// Prediction and slopes there.
    pub(super) model: Linearised,
    /// -ln(likelihood x prior), without constants of the data.
    pub(super) objective: f64,
    /// Curvature of the objective (all parameters; held ones have unit rows).
    pub(super) curvature: DMatrix<f64>,
    /// Slope of the objective (0 for all that are neither held nor at a bound).
    pub(super) gradient: DVector<f64>,
}

/// Steps of Gauss-Newton: from starts within the valley five suffice, along bent valleys (a place and a
/// size that trade against each other) thirty.
const STEPS: usize = 30;
/// The search ends when a step can gain no more than this in log probability.
const GAIN: f64 = 1e-4;
/// It also ends after two steps that lower the objective by less than this share of it.
const IDLE: f64 = 1e-3;

/// The parameters that maximise likelihood times prior; `None` where there is no structure at the start.
pub(super) fn maximise(
    readings: &[Reading],
    knowledge: &[Knowledge],
    start: &[f64],
    model: &impl Model,
) -> Option<Optimum> {
    let parameters: Vec<f64> = start
        .iter()
        .zip(knowledge)
        .map(|(&value, known)| value.clamp(known.low, known.high))
        .collect();
    let first = model.linearise(&parameters, knowledge)?;
    let mut optimum = optimum_at(readings, knowledge, parameters, first);
    let mut damping = 0;
    let mut idle = 0;
    for _ in 0..STEPS {
        if promised_gain(&optimum, knowledge).is_none_or(|gain| gain < GAIN) {
            break;
        }
        let Some((better, next)) = advance(readings, knowledge, (&optimum, damping), model) else {
            break;
        };
        // What hardly moves far from any agreement is no explanation; it need not be exact.
        let moves = optimum.objective - better.objective > IDLE * better.objective;
        idle = if moves { 0 } else { idle + 1 };
        optimum = better;
        damping = next;
        if idle > 1 {
            break;
        }
    }
    Some(optimum)
}

/// What the quadratic model promises of a full step, half the gradient along it; `None` where no
/// parameter is free.
fn promised_gain(optimum: &Optimum, knowledge: &[Knowledge]) -> Option<f64> {
    let step = bounded_step(optimum, knowledge, 0.0)?;
    Some(-0.5 * step.dot(&optimum.gradient))
}

/// What the quadratic model promises of any step.
fn promised_by(optimum: &Optimum, step: &DVector<f64>) -> f64 {
    -step.dot(&optimum.gradient) - 0.5 * step.dot(&(&optimum.curvature * step))
}

/// The same of a model that is linear: at `origin` it predicts `there`.
pub(super) fn maximise_linear(
    readings: &[Reading],
    knowledge: &[Knowledge],
    (origin, there): (&[f64], &[f64]),
    slopes: &DMatrix<f64>,
) -> Option<Optimum> {
    let model = Linear {
        origin,
        there,
        slopes,
    };
    maximise(readings, knowledge, origin, &model)
}

/// A model that is linear.
struct Linear<'a> {
    origin: &'a [f64],
    there: &'a [f64],
    slopes: &'a DMatrix<f64>,
}

impl Model for Linear<'_> {
    type Rest = ();

    fn predict(&self, parameters: &[f64]) -> Option<(Vec<f64>, ())> {
        let steps = parameters.iter().zip(self.origin);
        let steps = DVector::from_iterator(parameters.len(), steps.map(|(new, old)| new - old));
        let moved = self.slopes * steps;
        let predicted = self.there.iter().zip(moved.iter());
        Some((predicted.map(|(at, by)| at + by).collect(), ()))
    }

    fn complete(
        &self,
        _: &[f64],
        _: &[Knowledge],
        (predicted, ()): (Vec<f64>, ()),
    ) -> Option<Linearised> {
        Some(Linearised {
            predicted,
            slopes: self.slopes.clone(),
        })
    }
}

/// Dampings of the step, as shares of the curvature's diagonal (Levenberg & Marquardt): they shorten it
/// and turn it towards the steepest descent.
const DAMPINGS: [f64; 7] = [0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0];

/// Share of what was promised from which a step shows that the next one may be damped less.
const KEPT: f64 = 0.75;

/// The full step or a damped one, whichever first lowers the objective, and the damping that the next one
/// should begin with; the weaker ones before `first` are not tried.
fn advance(
    readings: &[Reading],
    knowledge: &[Knowledge],
    (from, first): (&Optimum, usize),
    model: &impl Model,
) -> Option<(Optimum, usize)> {
    for (used, damping) in DAMPINGS.iter().enumerate().skip(first) {
        let step = bounded_step(from, knowledge, *damping)?;
        // Of a shorter step the quadratic model promises less, and of the next one less still.
        let promised = promised_by(from, &step);
        if promised < GAIN {
            return None;
        }
        let parameters: Vec<f64> = from
            .parameters
            .iter()
            .zip(step.iter())
            .zip(knowledge)
            .map(|((value, step), known)| (value + step).clamp(known.low, known.high))
            .collect();
        let Some(found) = model.predict(&parameters) else {
            continue;
        };
        if objective_at(readings, knowledge, (&parameters, &found.0)) >= from.objective {
            continue;
        }
        if let Some(linearised) = model.complete(&parameters, knowledge, found) {
            let better = optimum_at(readings, knowledge, parameters, linearised);
            let kept = from.objective - better.objective > KEPT * promised;
            return Some((better, used.saturating_sub(usize::from(kept))));
        }
    }
    None
}

/// -ln(likelihood x prior) at a point, given what is predicted there; without constants of the data.
pub(super) fn objective_at(
    readings: &[Reading],
    knowledge: &[Knowledge],
    (parameters, predicted): (&[f64], &[f64]),
) -> f64 {
    let mut objective = 0.0;
    for (reading, predicted) in readings.iter().zip(predicted) {
        let residual = (reading.value - predicted) / reading.std;
        objective -= noise::log_density_drop(residual, reading.freedom);
    }
    for (known, parameter) in knowledge.iter().zip(parameters) {
        if !known.is_held() && known.std.is_finite() {
            let away = (parameter - known.centre) / known.std;
            objective += 0.5 * away * away;
        }
    }
    objective
}

/// What the readings say of a point.
pub(super) fn optimum_at(
    readings: &[Reading],
    knowledge: &[Knowledge],
    parameters: Vec<f64>,
    model: Linearised,
) -> Optimum {
    let count = parameters.len();
    let objective = objective_at(readings, knowledge, (&parameters, &model.predicted));
    let mut weighted = model.slopes.clone();
    let mut pulled = DVector::zeros(readings.len());
    for (row, reading) in readings.iter().enumerate() {
        let residual = (reading.value - model.predicted[row]) / reading.std;
        let weight = noise::weight(residual, reading.freedom);
        let precision = weight / (reading.std * reading.std);
        pulled[row] = precision * (reading.value - model.predicted[row]);
        weighted.row_mut(row).scale_mut(precision);
    }
    let mut curvature = model.slopes.tr_mul(&weighted);
    let mut gradient = -model.slopes.tr_mul(&pulled);
    for (k, known) in knowledge.iter().enumerate() {
        if known.is_held() {
            curvature.row_mut(k).fill(0.0);
            curvature.column_mut(k).fill(0.0);
            curvature[(k, k)] = 1.0;
            gradient[k] = 0.0;
        } else if known.std.is_finite() {
            let away = (parameters[k] - known.centre) / known.std;
            curvature[(k, k)] += known.std.powi(-2);
            gradient[k] += away / known.std;
        }
    }
    debug_assert_eq!(curvature.nrows(), count);
    Optimum {
        parameters,
        model,
        objective,
        curvature,
        gradient,
    }
}

/// Newton's step on the parameters that are not pressed against a bound, the curvature's diagonal
/// raised by the share `damping`.
fn bounded_step(optimum: &Optimum, knowledge: &[Knowledge], damping: f64) -> Option<DVector<f64>> {
    let count = optimum.parameters.len();
    let mut curvature = optimum.curvature.clone();
    for k in 0..count {
        curvature[(k, k)] *= 1.0 + damping;
    }
    let mut free: Vec<usize> = (0..count).filter(|&k| !knowledge[k].is_held()).collect();
    loop {
        if free.is_empty() {
            return None;
        }
        let solution = factor_of(&curvature, &free)?.solve(&-DVector::from_iterator(
            free.len(),
            free.iter().map(|&k| optimum.gradient[k]),
        ));
        let pressed: Vec<usize> = free
            .iter()
            .zip(solution.iter())
            .filter(|&(&k, &step)| {
                let value = optimum.parameters[k];
                (value <= knowledge[k].low && step < 0.0)
                    || (value >= knowledge[k].high && step > 0.0)
            })
            .map(|(&k, _)| k)
            .collect();
        if pressed.is_empty() {
            let mut step = DVector::zeros(count);
            for (&k, &value) in free.iter().zip(solution.iter()) {
                step[k] = value;
            }
            return Some(step);
        }
        free.retain(|k| !pressed.contains(k));
    }
}

/// ln det A of A = L L'.
pub(super) fn log_determinant(factor: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * factor
        .l_dirty()
        .diagonal()
        .iter()
        .map(|x| x.ln())
        .sum::<f64>()
}

/// Cholesky factor of the rows and columns `kept` of a matrix.
pub(super) fn factor_of(matrix: &DMatrix<f64>, kept: &[usize]) -> Option<Cholesky<f64, Dyn>> {
    Cholesky::new(matrix.select_rows(kept).select_columns(kept))
}
