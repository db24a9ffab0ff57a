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

/// Steps of Gauss-Newton: from starts within the valley five suffice.
const STEPS: usize = 12;
/// The search ends when a step can gain no more than this in log probability.
const GAIN: f64 = 1e-4;

/// The parameters that maximise likelihood times prior. `model` says what is predicted at a point,
/// `None` where there is no such structure.
pub(super) fn maximise(
    readings: &[Reading],
    knowledge: &[Knowledge],
    start: &[f64],
    model: &mut dyn FnMut(&[f64]) -> Option<Linearised>,
) -> Option<Optimum> {
    let parameters: Vec<f64> = start
        .iter()
        .zip(knowledge)
        .map(|(&value, known)| value.clamp(known.low, known.high))
        .collect();
    let first = model(&parameters)?;
    let mut optimum = optimum_at(readings, knowledge, parameters, first);
    for _ in 0..STEPS {
        let Some(step) = bounded_step(&optimum, knowledge) else {
            break;
        };
        // What the quadratic model promises: half the gradient along the step.
        let promised = -0.5 * step.dot(&optimum.gradient);
        if promised < GAIN {
            break;
        }
        match advance(readings, knowledge, &optimum, &step, model) {
            Some(better) => optimum = better,
            None => break,
        }
    }
    Some(optimum)
}

/// The same of a model that is linear: at `origin` it predicts `there`.
pub(super) fn maximise_linear(
    readings: &[Reading],
    knowledge: &[Knowledge],
    (origin, there): (&[f64], &[f64]),
    slopes: &DMatrix<f64>,
) -> Option<Optimum> {
    let mut model = |parameters: &[f64]| {
        let steps = parameters.iter().zip(origin).map(|(new, old)| new - old);
        let moved = slopes * DVector::from_iterator(origin.len(), steps);
        Some(Linearised {
            predicted: there
                .iter()
                .zip(moved.iter())
                .map(|(at, by)| at + by)
                .collect(),
            slopes: slopes.clone(),
        })
    };
    maximise(readings, knowledge, origin, &mut model)
}

/// The full step or a part of it, whichever first lowers the objective.
fn advance(
    readings: &[Reading],
    knowledge: &[Knowledge],
    from: &Optimum,
    step: &DVector<f64>,
    model: &mut dyn FnMut(&[f64]) -> Option<Linearised>,
) -> Option<Optimum> {
    let mut share = 1.0;
    for _ in 0..6 {
        let parameters: Vec<f64> = from
            .parameters
            .iter()
            .zip(step.iter())
            .zip(knowledge)
            .map(|((value, step), known)| (value + share * step).clamp(known.low, known.high))
            .collect();
        if let Some(linearised) = model(&parameters) {
            let trial = optimum_at(readings, knowledge, parameters, linearised);
            if trial.objective < from.objective {
                return Some(trial);
            }
        }
        share *= 0.3;
    }
    None
}

/// What the readings say of a point.
pub(super) fn optimum_at(
    readings: &[Reading],
    knowledge: &[Knowledge],
    parameters: Vec<f64>,
    model: Linearised,
) -> Optimum {
    let count = parameters.len();
    let mut objective = 0.0;
    let mut weighted = model.slopes.clone();
    let mut pulled = DVector::zeros(readings.len());
    for (row, reading) in readings.iter().enumerate() {
        let residual = (reading.value - model.predicted[row]) / reading.std;
        objective -= noise::log_density_drop(residual, reading.freedom);
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
            objective += 0.5 * away * away;
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

/// Newton's step on the parameters that are not pressed against a bound.
fn bounded_step(optimum: &Optimum, knowledge: &[Knowledge]) -> Option<DVector<f64>> {
    let count = optimum.parameters.len();
    let mut free: Vec<usize> = (0..count).filter(|&k| !knowledge[k].is_held()).collect();
    loop {
        if free.is_empty() {
            return None;
        }
        let solution = factor_of(&optimum.curvature, &free)?.solve(&-DVector::from_iterator(
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

/// Cholesky factor of the rows and columns `kept` of a matrix.
pub(super) fn factor_of(matrix: &DMatrix<f64>, kept: &[usize]) -> Option<Cholesky<f64, Dyn>> {
    Cholesky::new(matrix.select_rows(kept).select_columns(kept))
}
