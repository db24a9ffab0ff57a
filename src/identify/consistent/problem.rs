//! The weighted residuals and their derivatives at a point.

use super::least_squares::bounded;
use super::model::{FrequencyModel, PARAMETERS, Parameter, Point, log_nondimensional};

/// How large misfits count.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Loss {
    /// By their square: right for normally distributed errors.
    #[default]
    Squares,
    /// Huber's: by their square up to so many standard deviations, linearly beyond. 1.345 keeps
    /// 95 % of the efficiency where errors are normal.
    Huber(f64),
    /// That of Student's t with so many degrees of freedom: a wild frequency hardly counts. 4 is
    /// usual.
    StudentT(f64),
}

impl Loss {
    /// Contribution of one standardised residual, and the weight of its square in the linearised
    /// problem.
    fn of(self, residual: f64) -> (f64, f64) {
        let square = residual * residual;
        match self {
            Self::Squares => (square, 1.0),
            Self::Huber(limit) if residual.abs() > limit => {
                let size = residual.abs();
                (limit * (2.0 * size - limit), limit / size)
            }
            Self::Huber(_) => (square, 1.0),
            Self::StudentT(freedom) => {
                let weight = (freedom + 1.0) / (freedom + square);
                ((freedom + 1.0) * (square / freedom).ln_1p(), weight)
            }
        }
    }
}

/// One measured frequency with the standard deviation (Hz) by which its residual is divided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Datum {
    pub(super) mode: usize,
    pub(super) frequency: f64,
    pub(super) std: f64,
}

/// What is known beforehand: a linear function of the point with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prior {
    pub(super) gradient: Point,
    pub(super) value: f64,
    pub(super) std: f64,
}

/// What is to be made small.
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
    /// lambda of every mode.
    pub(super) lambdas: Vec<f64>,
    /// Predicted frequencies (Hz).
    pub(super) frequencies: Vec<f64>,
}

impl Problem<'_> {
    /// Roots are looked for from `guesses` (lambda of every mode) on.
    pub(super) fn evaluate(&self, point: &Point, guesses: &[f64]) -> Evaluation {
        let rows = self.data.len() + self.priors.len();
        let mut result = Evaluation {
            point: *point,
            cost: 0.0,
            residuals: Vec::with_capacity(rows),
            jacobian: Vec::with_capacity(rows),
            lambdas: Vec::with_capacity(self.data.len()),
            frequencies: Vec::with_capacity(self.data.len()),
        };
        let model = self.model.at(point, self.last_step);
        for (datum, guess) in self.data.iter().zip(guesses) {
            let response = model.response(datum.mode, *guess);
            let residual = (response.frequency - datum.frequency) / datum.std;
            let (cost, weight) = self.loss.of(residual);
            let (root, scale) = (weight.sqrt(), response.frequency / datum.std);
            result.cost += cost;
            result.residuals.push(root * residual);
            result
                .jacobian
                .push(response.sensitivity.map(|slope| root * scale * slope));
            result.lambdas.push(response.lambda);
            result.frequencies.push(response.frequency);
        }
        for prior in &self.priors {
            // A rigid joint has no part in any prior: 0 times infinity is nothing here.
            let terms = prior.gradient.iter().zip(point);
            let value: f64 = terms.filter(|(g, _)| **g != 0.0).map(|(g, x)| g * x).sum();
            let residual = (value - prior.value) / prior.std;
            result.cost += residual * residual;
            result.residuals.push(residual);
            result.jacobian.push(prior.gradient.map(|g| g / prior.std));
        }
        result
    }

    /// The measured frequencies as lambda of the beam at a point: where the roots are to be.
    pub(super) fn measured_lambdas(&self, point: &Point) -> Vec<f64> {
        let at = |parameter: Parameter| point[parameter.index()].exp();
        let length = at(Parameter::Length);
        // f = lambda^2 h/(2 pi L^2) sqrt(E/(12 rho)).
        let unit = at(Parameter::Thickness) / (2.0 * std::f64::consts::PI * length * length)
            * (at(Parameter::Modulus) / (12.0 * at(Parameter::Density))).sqrt();
        let lambda = |datum: &Datum| (datum.frequency / unit).sqrt();
        self.data.iter().map(lambda).collect()
    }

    pub(super) fn within_bounds(&self, point: Point) -> Point {
        // ln Kt less ln Kx: what one unit of Kx is worth at this point.
        let [log_kx, log_ky] = log_nondimensional(&point);
        let units = [point[0] - log_kx, point[1] - log_ky];
        if units.iter().all(|unit| unit.is_finite()) {
            return bounded(point, units);
        }
        let finite = units.map(|unit| if unit.is_finite() { unit } else { 0.0 });
        bounded(point, finite)
    }
}

/// A direction along one parameter alone.
pub(super) fn along(parameter: Parameter) -> Point {
    let mut direction = [0.0; PARAMETERS];
    direction[parameter.index()] = 1.0;
    direction
}
