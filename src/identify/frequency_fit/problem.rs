//! The misfit of a joint's frequencies: residuals and their derivatives at a point, the way to the nearest
//! minimum, and the first-order uncertainty there.
//!
//! The search solves its linearised problem by reflections, never by the normal equations, which would
//! square the condition number: it is for stiffnesses that the frequencies hardly feel.

use super::model::{
    FrequencyModel, ModeResponse, PARAMETERS, Parameter, Point, beam_at, log_nondimensional,
};
use nalgebra::{DMatrix, DVector};
use tapjoint_numerics::least_squares::{self, Linearised, Loss, Settings, minimise};

/// End of a search.
pub(super) type Minimum = least_squares::Minimum<Evaluation>;

/// Settings of a search to the last digits. Misfits are relative: without stated uncertainties they may
/// be of any size.
pub(super) const FULL: Settings = Settings {
    first_damping: 0.0,
    steps: 200,
    gain: 0.0,
    relative_gain: 1e-15,
    step: 1e-11,
    idle_steps: usize::MAX,
    idle: 0.0,
    damping: 1e15,
    polish: false,
};

/// Settings where only the size of the misfit is wanted: its error is the gain.
pub(super) const MISFIT: Settings = Settings {
    steps: 60,
    relative_gain: 1e-8,
    step: 1e-6,
    ..FULL
};

/// Settings to tell minima apart.
pub(super) const ROUGH: Settings = Settings {
    steps: 25,
    relative_gain: 1e-3,
    step: 1e-2,
    ..FULL
};

/// Stiffnesses beyond these differ from none and from rigid in no frequency (logarithms of Kx and
/// Ky); beyond the last the coupling is 1 to nine digits.
pub(super) const LOG_STIFFNESS: (f64, f64) = (-16.0, 21.0);
const COUPLING_LIMIT: f64 = 10.5;
/// No step moves a parameter by more than this factor e^2, wherever a linear model points.
const LONGEST_STEP: f64 = 2.0;

/// One measured frequency with the standard deviation (Hz) by which its residual is divided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Datum {
    pub(super) mode: usize,
    pub(super) frequency: f64,
    pub(super) std: f64,
}

/// A linear function of the point that is known beforehand, with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prior {
    pub(super) gradient: Point,
    pub(super) value: f64,
    pub(super) std: f64,
}

/// The misfit as a function of the point.
#[derive(Debug, Clone)]
pub(super) struct Problem<'a> {
    pub(super) model: &'a FrequencyModel,
    pub(super) data: Vec<Datum>,
    pub(super) priors: Vec<Prior>,
    pub(super) loss: Loss,
    /// Relative step of lambda that ends the search for a root.
    pub(super) last_step: f64,
}

/// Residuals at a point: first those of the modes, then those of the priors.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Evaluation {
    pub(super) point: Point,
    /// Sum of the loss over all residuals.
    pub(super) cost: f64,
    /// Standardised residuals, times the root of their weight.
    pub(super) residuals: Vec<f64>,
    /// Their derivatives with the point, times the same.
    pub(super) jacobian: Vec<Point>,
    /// Prediction for every mode.
    pub(super) responses: Vec<ModeResponse>,
}

impl Evaluation {
    /// Returns where the roots (lambda) are at another point, to first order.
    pub(super) fn guesses_at(&self, point: &Point) -> Vec<f64> {
        // Beyond that (1, relative) a root is not followed.
        const FARTHEST: f64 = 0.1;
        let [here, there] = [&self.point, point].map(log_nondimensional);
        let moved = [
            there[0] - here[0],
            there[1] - here[1],
            point[2] - self.point[2],
        ];
        let mut guesses = Vec::with_capacity(self.responses.len());
        for response in &self.responses {
            // lambda changes with the joint alone, half as much as the frequency. A rigid joint stays.
            let changes = response
                .sensitivity
                .iter()
                .zip(moved)
                .map(|(s, moved)| s * moved);
            let change: f64 = changes.filter(|change| change.is_finite()).sum();
            guesses.push(response.lambda * (1.0 + (0.5 * change).clamp(-FARTHEST, FARTHEST)));
        }
        guesses
    }
}

impl Problem<'_> {
    /// Evaluates the misfit. Roots are looked for from `guesses` (lambda of every mode) on.
    pub(super) fn evaluate(&self, point: &Point, guesses: &[f64]) -> Evaluation {
        let rows = self.data.len() + self.priors.len();
        let mut result = Evaluation {
            point: *point,
            cost: 0.0,
            residuals: Vec::with_capacity(rows),
            jacobian: Vec::with_capacity(rows),
            responses: Vec::with_capacity(self.data.len()),
        };
        let model = self.model.at(point, self.last_step);
        for (datum, guess) in self.data.iter().zip(guesses) {
            let response = model.response(datum.mode, *guess);
            let residual = (response.frequency - datum.frequency) / datum.std;
            let root = self.loss.weight(residual).sqrt();
            let scale = root * response.frequency / datum.std;
            result.cost += self.loss.of(residual);
            result.residuals.push(root * residual);
            let slopes = response.sensitivity.map(|slope| scale * slope);
            result.jacobian.push(slopes);
            result.responses.push(response);
        }
        for prior in &self.priors {
            let residual = (value_along(&prior.gradient, point) - prior.value) / prior.std;
            result.cost += residual * residual;
            result.residuals.push(residual);
            result.jacobian.push(prior.gradient.map(|g| g / prior.std));
        }
        result
    }

    /// Returns the measured frequencies as lambda of the beam at a point: where the roots are to be.
    pub(super) fn measured_lambdas(&self, point: &Point) -> Vec<f64> {
        let beam = beam_at(&self.model.structure().beam, point);
        let data = self.data.iter();
        data.map(|datum| beam.lambda_of(datum.frequency)).collect()
    }

    /// Follows the misfit downhill from `start` along these directions; `None` where it is no number at
    /// the start. Roots are looked for from `guesses` on.
    pub(super) fn minimise(
        &self,
        start: &Point,
        guesses: &[f64],
        directions: &[Point],
        settings: &Settings,
    ) -> Option<Minimum> {
        let descent = Descent {
            problem: self,
            guesses,
            directions,
        };
        minimise(&descent, start, settings)
    }
}

/// A problem whose point moves along some directions only.
struct Descent<'a> {
    problem: &'a Problem<'a>,
    guesses: &'a [f64],
    directions: &'a [Point],
}

impl least_squares::Problem for Descent<'_> {
    type State = Evaluation;

    fn evaluate(&self, point: &[f64], from: Option<&Evaluation>) -> Option<Evaluation> {
        let point = point.first_chunk()?;
        let found = match from {
            Some(from) => self.problem.evaluate(point, &from.guesses_at(point)),
            None => self.problem.evaluate(point, self.guesses),
        };
        found.cost.is_finite().then_some(found)
    }

    fn cost(&self, at: &Evaluation) -> f64 {
        0.5 * at.cost
    }

    fn linearise(&self, _: &[f64], at: &mut Evaluation) -> Option<Linearised> {
        let (rows, columns) = (at.jacobian.len(), self.directions.len());
        Some(Linearised::Rows {
            jacobian: DMatrix::from_fn(rows, columns, |row, column| {
                dot(&at.jacobian[row], &self.directions[column])
            }),
            residuals: DVector::from_column_slice(&at.residuals),
        })
    }

    /// Returns the point one step on, within bounds and not too far.
    fn moved(&self, from: &[f64], step: &DVector<f64>) -> Option<Vec<f64>> {
        let mut change = [0.0; PARAMETERS];
        for (direction, length) in self.directions.iter().zip(step.iter()) {
            for (change, part) in change.iter_mut().zip(direction) {
                *change += length * part;
            }
        }
        let longest = change.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let factor = (LONGEST_STEP / longest).min(1.0);
        let mut point = *from.first_chunk()?;
        for (coordinate, change) in point.iter_mut().zip(change) {
            *coordinate += factor * change;
        }
        Some(within_bounds(point).to_vec())
    }
}

/// Keeps a stiffness between none and rigid, and the coupling from its limits.
pub(super) fn within_bounds(mut point: Point) -> Point {
    let (low, high) = LOG_STIFFNESS;
    for (index, log) in log_nondimensional(&point).into_iter().enumerate() {
        // Logarithm of one unit of Kx or Ky at this point; a rigid joint has none.
        let unit = point[index] - log;
        if unit.is_finite() {
            point[index] = point[index].clamp(low + unit, high + unit);
        }
    }
    point[2] = point[2].clamp(-COUPLING_LIMIT, COUPLING_LIMIT);
    point
}

/// Returns the inner product of a row of slopes and a direction.
pub(super) fn dot(slopes: &Point, direction: &Point) -> f64 {
    slopes.iter().zip(direction).map(|(a, b)| a * b).sum()
}

/// Returns a linear function of the point. A coordinate without a part in it may be infinite.
pub(super) fn value_along(gradient: &Point, point: &Point) -> f64 {
    let terms = gradient.iter().zip(point);
    terms.filter(|(g, _)| **g != 0.0).map(|(g, x)| g * x).sum()
}

/// Returns the direction along one parameter alone.
pub(super) fn along(parameter: Parameter) -> Point {
    let mut direction = [0.0; PARAMETERS];
    direction[parameter.index()] = 1.0;
    direction
}

/// Beyond this standard deviation (1, in logarithms) nothing at all is known of a parameter.
pub(super) const NOTHING_KNOWN: f64 = 1e3;

/// Covariance of the free coordinates, spread over all of them (zero for those held).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Covariance {
    /// The covariance is the sum of the products of these with themselves.
    factors: Vec<Point>,
}

impl Covariance {
    /// Returns (J^T J)^-1 along these directions, by way of the triangle of J with its columns scaled to
    /// 1. A column of zeros counts as one of a billionth of the largest: nothing known.
    pub(super) fn new(jacobian: &[Point], directions: &[Point]) -> Self {
        let (rows, columns) = (jacobian.len(), directions.len());
        let slopes = DMatrix::from_fn(rows, columns, |row, column| {
            dot(&jacobian[row], &directions[column])
        });
        let norms: Vec<f64> = slopes.column_iter().map(|column| column.norm()).collect();
        let largest = norms.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
        // Weak knowledge of everything keeps the triangle regular without a visible change.
        let mut scaled = slopes.resize_vertically(rows + columns, 0.0);
        for (column, norm) in norms.iter().enumerate() {
            let scale = norm.max(1e-9 * largest);
            scaled.column_mut(column).unscale_mut(scale);
            scaled[(rows + column, column)] = 1e-10;
        }
        let mut inverse = DMatrix::identity(columns, columns);
        if columns > 0 {
            scaled.qr().r().solve_upper_triangular_mut(&mut inverse);
        }
        let mut factors = vec![[0.0; PARAMETERS]; columns];
        for (column, factor) in factors.iter_mut().enumerate() {
            for (row, direction) in directions.iter().enumerate() {
                let share = inverse[(row, column)] / norms[row].max(1e-9 * largest);
                for (entry, part) in factor.iter_mut().zip(direction) {
                    *entry += share * part;
                }
            }
        }
        Self { factors }
    }

    /// Returns the covariance of two linear functions of the point.
    pub(super) fn between(&self, first: &Point, second: &Point) -> f64 {
        let factors = self.factors.iter();
        factors.map(|f| dot(first, f) * dot(second, f)).sum()
    }

    /// Returns the standard deviation of a linear function of the point, however large it is.
    pub(super) fn std_or_infinite(&self, gradient: &Point) -> f64 {
        self.between(gradient, gradient).sqrt()
    }

    /// Returns the standard deviation of a linear function of the point; `None` where nothing is known of
    /// it.
    pub(super) fn std(&self, gradient: &Point) -> Option<f64> {
        Some(self.std_or_infinite(gradient)).filter(|std| *std < NOTHING_KNOWN)
    }

    /// Returns the variance of `gradient` when one more residual of these slopes is known:
    /// C - C j j^T C/(1 + j^T C j).
    pub(super) fn variance_with(&self, gradient: &Point, slopes: &Point) -> f64 {
        let shared = self.between(gradient, slopes);
        self.between(gradient, gradient) - shared * shared / (1.0 + self.between(slopes, slopes))
    }
}
