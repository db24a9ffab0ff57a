//! Optimum of likelihood times prior: where it is, and how the objective bends there.

use crate::dataset::Datum;
use crate::parameters::Prior;
use nalgebra::{Cholesky as Dense, DMatrix, DVector, Dyn};
use std::sync::Arc;
use tapjoint_numerics::cholesky::Cholesky;
use tapjoint_numerics::least_squares::{self, Problem, Settings, minimise};

/// Predictions of all data at a point, and their slopes.
#[derive(Debug, Clone)]
pub struct Linearised {
    /// Prediction of each datum.
    pub predicted: Vec<f64>,
    /// Derivative of each datum (row) with respect to each parameter (column).
    pub slopes: Arc<DMatrix<f64>>,
}

/// Model that predicts at many points and gives slopes, which cost more, at few of them.
pub trait Model {
    /// Intermediate results of a prediction, for the slopes at the same point and for predictions next to it.
    type Solution;
    /// Returns the predictions at a point; `None` where there is no such structure. `near` is the solution at a point next
    /// to it, which shortens the way and changes nothing.
    fn predict(
        &self,
        parameters: &[f64],
        near: Option<&Self::Solution>,
    ) -> Option<(Vec<f64>, Self::Solution)>;
    /// Returns the slopes at a solved point with respect to all parameters that are not held.
    fn slopes(
        &self,
        parameters: &[f64],
        priors: &[Prior],
        solution: &Self::Solution,
    ) -> Option<Arc<DMatrix<f64>>>;

    /// Returns predictions and slopes at a point.
    fn linearise(&self, parameters: &[f64], priors: &[Prior]) -> Option<Linearised> {
        let (predicted, solution) = self.predict(parameters, None)?;
        let slopes = self.slopes(parameters, priors, &solution)?;
        Some(Linearised { predicted, slopes })
    }
}

/// The model as it was linearised at a point.
struct LinearModel<'a>(&'a Optimum);

impl Model for LinearModel<'_> {
    type Solution = ();

    fn predict(&self, parameters: &[f64], _: Option<&()>) -> Option<(Vec<f64>, ())> {
        let Linearised { predicted, slopes } = &self.0.model;
        let steps = parameters.iter().zip(&self.0.parameters);
        let steps = DVector::from_iterator(parameters.len(), steps.map(|(new, old)| new - old));
        let moved = &**slopes * steps;
        let predicted = predicted.iter().zip(moved.iter());
        Some((predicted.map(|(at, by)| at + by).collect(), ()))
    }

    fn slopes(&self, _: &[f64], _: &[Prior], _: &()) -> Option<Arc<DMatrix<f64>>> {
        Some(self.0.model.slopes.clone())
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
    /// Curvature and slope of the likelihood alone.
    likelihood: Arc<(DMatrix<f64>, DVector<f64>)>,
}

/// Limits of a search. From starts within the valley five steps suffice, along bent valleys (a location and a size that
/// trade against each other) thirty. A search that hardly moves far from any agreement finds no explanation; it
/// need not be exact.
const SEARCH: Settings = Settings {
    first_damping: 0.0,
    steps: 30,
    gain: 1e-4,
    relative_gain: 0.0,
    step: 0.0,
    idle_steps: 2,
    idle: 1e-3,
    damping: 100.0,
    polish: false,
};

/// Search for the parameters that maximise likelihood times prior.
struct Maximisation<'a, M: Model> {
    data: &'a [Datum],
    priors: &'a [Prior],
    model: &'a M,
    /// A point that is solved and linearised already, near the start.
    known: Option<(&'a Optimum, &'a M::Solution)>,
    bounds: Vec<[f64; 2]>,
}

/// Point of a search: its predictions, and more once it is accepted.
struct Point<S> {
    objective: f64,
    predicted: Vec<f64>,
    solution: S,
    optimum: Option<Optimum>,
}

impl<M: Model> Problem for Maximisation<'_, M> {
    type State = Point<M::Solution>;

    fn evaluate(&self, parameters: &[f64], from: Option<&Self::State>) -> Option<Self::State> {
        let near = from.map(|from| &from.solution);
        let near = near.or(self.known.map(|known| known.1));
        let (predicted, solution) = self.model.predict(parameters, near)?;
        Some(Point {
            objective: objective_at(self.data, self.priors, parameters, &predicted),
            predicted,
            solution,
            optimum: None,
        })
    }

    fn cost(&self, point: &Self::State) -> f64 {
        point.objective
    }

    fn linearise(
        &self,
        parameters: &[f64],
        point: &mut Self::State,
    ) -> Option<least_squares::Linearised> {
        let optimum = match self.known.filter(|known| known.0.parameters == parameters) {
            Some((known, _)) => known.under(self.data, self.priors),
            None => {
                let slopes = self
                    .model
                    .slopes(parameters, self.priors, &point.solution)?;
                let predicted = std::mem::take(&mut point.predicted);
                let model = Linearised { predicted, slopes };
                Optimum::new(self.data, self.priors, parameters.to_vec(), model)
            }
        };
        let linearised = least_squares::Linearised::Normal {
            curvature: optimum.curvature.clone(),
            gradient: optimum.gradient.clone(),
        };
        point.optimum = Some(optimum);
        Some(linearised)
    }

    fn linearise_by(
        &self,
        at: &Self::State,
        parameters: &[f64],
        point: &Self::State,
    ) -> Option<least_squares::Linearised> {
        let model = Linearised {
            predicted: point.predicted.clone(),
            slopes: at.optimum.as_ref()?.model.slopes.clone(),
        };
        let there = Optimum::new(self.data, self.priors, parameters.to_vec(), model);
        Some(least_squares::Linearised::Normal {
            curvature: there.curvature,
            gradient: there.gradient,
        })
    }

    fn bounds(&self) -> &[[f64; 2]] {
        &self.bounds
    }
}

/// Returns the parameters that maximise likelihood times prior; `None` where there is no structure at the start.
pub fn maximise(
    data: &[Datum],
    priors: &[Prior],
    start: &[f64],
    model: &impl Model,
) -> Option<Optimum> {
    Some(search(data, priors, start, model, None)?.0)
}

/// Returns the optimum of the model as it was linearised at a point, from there.
pub fn linear_optimum(data: &[Datum], priors: &[Prior], at: &Optimum) -> Option<Optimum> {
    Some(
        search(
            data,
            priors,
            &at.parameters,
            &LinearModel(at),
            Some((at, &())),
        )?
        .0,
    )
}

/// Returns the optimum that [`maximise`] returns, and the solution there. A `known` point near the start, under priors that hold
/// the same parameters, shortens the way.
pub fn search<M: Model>(
    data: &[Datum],
    priors: &[Prior],
    start: &[f64],
    model: &M,
    known: Option<(&Optimum, &M::Solution)>,
) -> Option<(Optimum, M::Solution)> {
    let problem = Maximisation {
        data,
        priors,
        model,
        known,
        bounds: priors.iter().map(|prior| [prior.low, prior.high]).collect(),
    };
    let found = minimise(&problem, start, &SEARCH)?.state;
    Some((found.optimum?, found.solution))
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

impl Optimum {
    /// Returns objective, curvature and gradient at a point.
    pub fn new(data: &[Datum], priors: &[Prior], parameters: Vec<f64>, model: Linearised) -> Self {
        let count = parameters.len();
        let mut curvature = DMatrix::zeros(count, count);
        let mut gradient = DVector::zeros(count);
        // Most parameters move few of the data.
        let mut moving: Vec<(usize, f64)> = Vec::with_capacity(count);
        for (row, datum) in data.iter().enumerate() {
            let weight = datum.weight(datum.residual(model.predicted[row]));
            let precision = weight / (datum.std * datum.std);
            let pulled = precision * (datum.value - model.predicted[row]);
            let slopes = model.slopes.row(row);
            moving.clear();
            moving.extend(
                slopes
                    .iter()
                    .copied()
                    .enumerate()
                    .filter(|one| one.1 != 0.0),
            );
            for (index, &(k, slope)) in moving.iter().enumerate() {
                gradient[k] -= slope * pulled;
                for &(other, beside) in &moving[index..] {
                    curvature[(other, k)] += precision * slope * beside;
                }
            }
        }
        curvature.fill_upper_triangle_with_lower_triangle();
        let here = Optimum {
            objective: 0.0,
            curvature: DMatrix::zeros(0, 0),
            gradient: DVector::zeros(0),
            parameters,
            model,
            likelihood: Arc::new((curvature, gradient)),
        };
        here.under(data, priors)
    }

    /// Returns objective, curvature and gradient at the same point under other priors.
    pub fn under(&self, data: &[Datum], priors: &[Prior]) -> Self {
        let objective = objective_at(data, priors, &self.parameters, &self.model.predicted);
        let (mut curvature, mut gradient) = (*self.likelihood).clone();
        for (k, prior) in priors.iter().enumerate() {
            if prior.is_held() {
                curvature.row_mut(k).fill(0.0);
                curvature.column_mut(k).fill(0.0);
                curvature[(k, k)] = 1.0;
                gradient[k] = 0.0;
            } else if prior.std.is_finite() {
                let away = (self.parameters[k] - prior.centre) / prior.std;
                curvature[(k, k)] += prior.std.powi(-2);
                gradient[k] += away / prior.std;
            }
        }
        Optimum {
            objective,
            curvature,
            gradient,
            parameters: self.parameters.clone(),
            model: self.model.clone(),
            likelihood: self.likelihood.clone(),
        }
    }

    /// Returns the covariance of the parameters; held ones have none.
    pub fn covariance(&self, priors: &[Prior]) -> Option<DMatrix<f64>> {
        let mut covariance = Cholesky::new(&self.curvature)?.inverse();
        for (k, _) in priors.iter().enumerate().filter(|one| one.1.is_held()) {
            covariance[(k, k)] = 0.0;
        }
        Some(covariance)
    }
}

/// Returns ln det A of A = L L'.
pub fn log_determinant(factor: &Dense<f64, Dyn>) -> f64 {
    let diagonal = factor.l_dirty().diagonal();
    2.0 * diagonal.iter().map(|x| x.ln()).sum::<f64>()
}
