//! Weighted least squares with priors, bounds and Student t data: Gauss-Newton with step control.

use crate::dataset::Datum;
use crate::parameters::Prior;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Predictions of all data at a point, and their slopes.
#[derive(Debug, Clone)]
pub struct Linearised {
    /// Prediction of each datum.
    pub predicted: Vec<f64>,
    /// Derivative of each datum (row) with respect to each parameter (column).
    pub slopes: DMatrix<f64>,
}

/// Model that predicts at many points and gives slopes, which cost more, at few of them.
pub trait Model {
    /// Intermediate results of a prediction, for the slopes at the same point.
    type Rest;
    /// Returns the predictions at a point; `None` where there is no such structure.
    fn predict(&self, parameters: &[f64]) -> Option<(Vec<f64>, Self::Rest)>;
    /// Returns predictions with the slopes with respect to all parameters that are not held.
    fn complete(
        &self,
        parameters: &[f64],
        priors: &[Prior],
        predicted: Vec<f64>,
        rest: Self::Rest,
    ) -> Option<Linearised>;

    /// Returns predictions and slopes at a point.
    fn linearise(&self, parameters: &[f64], priors: &[Prior]) -> Option<Linearised> {
        let (predicted, rest) = self.predict(parameters)?;
        self.complete(parameters, priors, predicted, rest)
    }
}

/// End of a search.
#[derive(Debug, Clone)]
pub struct Optimum {
    /// All parameters.
    pub parameters: Vec<f64>,
    /// Prediction and slopes there.
    pub model: Linearised,
    /// -ln(likelihood x prior), without constants of the data.
    pub objective: f64,
    /// Curvature of the objective (all parameters; held ones have unit rows).
    pub curvature: DMatrix<f64>,
    /// Slope of the objective (0 for all that are neither held nor at a bound).
    pub gradient: DVector<f64>,
}

/// Steps of Gauss-Newton: from starts within the valley five suffice, along bent valleys (a location and a
/// size that trade against each other) thirty.
const MOST_STEPS: usize = 30;
/// The search ends when a step can gain no more than this in log probability.
const LEAST_GAIN: f64 = 1e-4;
/// It also ends after two steps that lower the objective by less than this share of it.
const IDLE_SHARE: f64 = 1e-3;
/// Dampings of the step, as shares of the curvature's diagonal (Levenberg & Marquardt): they shorten it
/// and turn it towards the steepest descent.
const DAMPINGS: [f64; 7] = [0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0];
/// Share of the promised gain from which on the next step may be damped less.
const KEPT_PROMISE: f64 = 0.75;

/// Returns the parameters that maximise likelihood times prior; `None` where there is no structure at the start.
pub fn maximise(
    data: &[Datum],
    priors: &[Prior],
    start: &[f64],
    model: &impl Model,
) -> Option<Optimum> {
    let parameters: Vec<f64> = start
        .iter()
        .zip(priors)
        .map(|(&value, prior)| value.clamp(prior.low, prior.high))
        .collect();
    let first = model.linearise(&parameters, priors)?;
    let mut optimum = optimum_at(data, priors, parameters, first);
    let mut damping = 0;
    let mut idle = 0;
    for _ in 0..MOST_STEPS {
        // Half the gradient along the full step is the gain that the quadratic model promises.
        let step = bounded_step(&optimum, priors, 0.0);
        if step.is_none_or(|step| -0.5 * step.dot(&optimum.gradient) < LEAST_GAIN) {
            break;
        }
        let Some((better, next)) = advance(data, priors, &optimum, damping, model) else {
            break;
        };
        // A search that hardly moves far from any agreement finds no explanation; it need not be exact.
        let moves = optimum.objective - better.objective > IDLE_SHARE * better.objective;
        idle = if moves { 0 } else { idle + 1 };
        optimum = better;
        damping = next;
        if idle > 1 {
            break;
        }
    }
    Some(optimum)
}

/// Linear model: at `origin` it predicts `there`.
pub struct LinearModel<'a> {
    /// Parameters at which it was linearised.
    pub origin: &'a [f64],
    /// Predictions there.
    pub there: &'a [f64],
    /// Slopes.
    pub slopes: &'a DMatrix<f64>,
}

impl Model for LinearModel<'_> {
    type Rest = ();

    fn predict(&self, parameters: &[f64]) -> Option<(Vec<f64>, ())> {
        let steps = parameters.iter().zip(self.origin);
        let steps = DVector::from_iterator(parameters.len(), steps.map(|(new, old)| new - old));
        let moved = self.slopes * steps;
        let predicted = self.there.iter().zip(moved.iter());
        Some((predicted.map(|(at, by)| at + by).collect(), ()))
    }

    fn complete(&self, _: &[f64], _: &[Prior], predicted: Vec<f64>, (): ()) -> Option<Linearised> {
        Some(Linearised {
            predicted,
            slopes: self.slopes.clone(),
        })
    }
}

/// Returns the optimum of the full step or a damped one, whichever first lowers the objective, and the damping that the
/// next one should begin with; dampings before `first` are not tried.
fn advance(
    data: &[Datum],
    priors: &[Prior],
    from: &Optimum,
    first: usize,
    model: &impl Model,
) -> Option<(Optimum, usize)> {
    for (used, damping) in DAMPINGS.iter().enumerate().skip(first) {
        let step = bounded_step(from, priors, *damping)?;
        // The quadratic model promises less for a shorter step, and less still for the next one.
        let promised = -step.dot(&from.gradient) - 0.5 * step.dot(&(&from.curvature * &step));
        if promised < LEAST_GAIN {
            return None;
        }
        let parameters: Vec<f64> = from
            .parameters
            .iter()
            .zip(step.iter())
            .zip(priors)
            .map(|((value, step), prior)| (value + step).clamp(prior.low, prior.high))
            .collect();
        let Some((predicted, rest)) = model.predict(&parameters) else {
            continue;
        };
        if objective_at(data, priors, &parameters, &predicted) >= from.objective {
            continue;
        }
        if let Some(linearised) = model.complete(&parameters, priors, predicted, rest) {
            let better = optimum_at(data, priors, parameters, linearised);
            let kept = from.objective - better.objective > KEPT_PROMISE * promised;
            return Some((better, used.saturating_sub(usize::from(kept))));
        }
    }
    None
}

/// Returns -ln(likelihood x prior) at a point from the predictions there, without constants of the data.
pub fn objective_at(
    data: &[Datum],
    priors: &[Prior],
    parameters: &[f64],
    predicted: &[f64],
) -> f64 {
    let mut objective = 0.0;
    for (datum, predicted) in data.iter().zip(predicted) {
        objective -= datum.log_density_drop(datum.residual(*predicted));
    }
    for (prior, parameter) in priors.iter().zip(parameters) {
        if !prior.is_held() && prior.std.is_finite() {
            let away = (parameter - prior.centre) / prior.std;
            objective += 0.5 * away * away;
        }
    }
    objective
}

/// Returns objective, curvature and gradient at a point.
pub fn optimum_at(
    data: &[Datum],
    priors: &[Prior],
    parameters: Vec<f64>,
    model: Linearised,
) -> Optimum {
    let objective = objective_at(data, priors, &parameters, &model.predicted);
    let mut weighted = model.slopes.clone();
    let mut pulled = DVector::zeros(data.len());
    for (row, datum) in data.iter().enumerate() {
        let weight = datum.weight(datum.residual(model.predicted[row]));
        let precision = weight / (datum.std * datum.std);
        pulled[row] = precision * (datum.value - model.predicted[row]);
        weighted.row_mut(row).scale_mut(precision);
    }
    let mut curvature = model.slopes.tr_mul(&weighted);
    let mut gradient = -model.slopes.tr_mul(&pulled);
    for (k, prior) in priors.iter().enumerate() {
        if prior.is_held() {
            curvature.row_mut(k).fill(0.0);
            curvature.column_mut(k).fill(0.0);
            curvature[(k, k)] = 1.0;
            gradient[k] = 0.0;
        } else if prior.std.is_finite() {
            let away = (parameters[k] - prior.centre) / prior.std;
            curvature[(k, k)] += prior.std.powi(-2);
            gradient[k] += away / prior.std;
        }
    }
    Optimum {
        parameters,
        model,
        objective,
        curvature,
        gradient,
    }
}

/// Returns Newton's step on the parameters that are not pressed against a bound, the curvature's diagonal
/// raised by the share `damping`; `None` where no parameter is free.
fn bounded_step(optimum: &Optimum, priors: &[Prior], damping: f64) -> Option<DVector<f64>> {
    let count = optimum.parameters.len();
    let mut curvature = optimum.curvature.clone();
    for k in 0..count {
        curvature[(k, k)] *= 1.0 + damping;
    }
    let mut free: Vec<usize> = (0..count).filter(|&k| !priors[k].is_held()).collect();
    loop {
        if free.is_empty() {
            return None;
        }
        let gradient = free.iter().map(|&k| optimum.gradient[k]);
        let gradient = DVector::from_iterator(free.len(), gradient);
        let mut step = DVector::zeros(count);
        let solution = factor_of(&curvature, &free)?.solve(&-gradient);
        for (&k, &value) in free.iter().zip(solution.iter()) {
            step[k] = value;
        }
        let before = free.len();
        free.retain(|&k| {
            let value = optimum.parameters[k];
            !(value <= priors[k].low && step[k] < 0.0 || value >= priors[k].high && step[k] > 0.0)
        });
        if free.len() == before {
            return Some(step);
        }
    }
}

/// Returns ln det A of A = L L'.
pub fn log_determinant(factor: &Cholesky<f64, Dyn>) -> f64 {
    let diagonal = factor.l_dirty().diagonal();
    2.0 * diagonal.iter().map(|x| x.ln()).sum::<f64>()
}

/// Returns the Cholesky factor of the rows and columns `kept` of a matrix.
pub fn factor_of(matrix: &DMatrix<f64>, kept: &[usize]) -> Option<Cholesky<f64, Dyn>> {
    Cholesky::new(matrix.select_rows(kept).select_columns(kept))
}

/// Returns the covariance of the parameters at an optimum; held ones have none.
pub fn covariance(priors: &[Prior], optimum: &Optimum) -> Option<DMatrix<f64>> {
    let free = free_parameters(priors);
    let inverse = factor_of(&optimum.curvature, &free)?.inverse();
    let mut full = DMatrix::zeros(priors.len(), priors.len());
    for (i, &a) in free.iter().enumerate() {
        for (j, &b) in free.iter().enumerate() {
            full[(a, b)] = inverse[(i, j)];
        }
    }
    Some(full)
}

/// Returns the indices of the parameters that are not held.
pub fn free_parameters(priors: &[Prior]) -> Vec<usize> {
    (0..priors.len())
        .filter(|&k| !priors[k].is_held())
        .collect()
}
