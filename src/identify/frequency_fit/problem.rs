//! The misfit of a joint's frequencies: initial guesses, residuals and their derivatives at a point, the way to
//! the nearest minimum, and the first-order uncertainty there.
//!
//! The search solves its linearised problem by reflections, never by the normal equations, which would
//! square the condition number: it is for stiffnesses that the frequencies hardly feel.

use super::model::{
    FrequencyModel, ModeResponse, ModelAt, PARAMETERS, Parameter, Point, log_nondimensional,
};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{LN_10, PI};
use tapjoint_beam::Beam;
use tapjoint_beam::interface::{InterfaceFunctions, JointWeights};
use tapjoint_numerics::least_squares::{self, Linearised, Settings, minimise};

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

/// Settings of repetitions, which start beside their end: a dozen steps do. More lead along a valley without a floor,
/// and such a repetition counts as one without an answer.
pub(super) const REPEATED: Settings = Settings { steps: 50, ..FULL };

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
    /// Index of its structure among the models of the problem.
    pub(super) structure: usize,
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
    /// The structure as described, then those whose clamp was moved.
    pub(super) models: &'a [FrequencyModel],
    pub(super) data: Vec<Datum>,
    /// Turns standardised residuals that errors in common correlate into independent ones; `None` where they are.
    pub(super) whitening: Option<DMatrix<f64>>,
    pub(super) priors: Vec<Prior>,
    /// Relative step of lambda that ends the search for a root.
    pub(super) last_step: f64,
}

/// Residuals at a point: first those of the modes, then those of the priors.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Evaluation {
    pub(super) point: Point,
    /// Sum of the squares of all residuals.
    pub(super) cost: f64,
    /// Standardised, independent residuals.
    pub(super) residuals: Vec<f64>,
    /// Their derivatives with the point.
    pub(super) jacobian: Vec<Point>,
    /// Prediction for every mode.
    pub(super) responses: Vec<ModeResponse>,
    /// Coordinate of the length of every mode's structure.
    lengths: Vec<Parameter>,
}

impl Evaluation {
    /// Returns where the roots (lambda) are at another point, to first order.
    pub(super) fn guesses_at(&self, point: &Point) -> Vec<f64> {
        // Beyond that (1, relative) a root is not followed.
        const FARTHEST: f64 = 0.1;
        let [here, there] = [&self.point, point].map(log_nondimensional);
        let changes = Parameter::ALL.map(|one| point[one.index()] - self.point[one.index()]);
        let responses = self.responses.iter().zip(&self.lengths);
        let responses = responses.map(|(response, length)| {
            // Kx grows as the cube of the length, Ky as the length.
            let further = changes[length.index()] - changes[Parameter::Length.index()];
            let moved = [
                there[0] - here[0] + 3.0 * further,
                there[1] - here[1] + further,
                changes[Parameter::Coupling.index()],
            ];
            // lambda changes with the joint alone, half as much as the frequency. A rigid joint stays.
            let changes = response.sensitivity.iter().zip(moved).map(|(s, m)| s * m);
            let change: f64 = changes.filter(|change| change.is_finite()).sum();
            response.lambda * (1.0 + (0.5 * change).clamp(-FARTHEST, FARTHEST))
        });
        responses.collect()
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
            lengths: Vec::with_capacity(self.data.len()),
        };
        let models = self.models.iter();
        let models: Vec<ModelAt<'_>> = models.map(|one| one.at(point, self.last_step)).collect();
        for (datum, guess) in self.data.iter().zip(guesses) {
            let response = models[datum.structure].response(datum.mode, *guess);
            let length = self.models[datum.structure].length;
            let residual = (response.frequency - datum.frequency) / datum.std;
            let scale = response.frequency / datum.std;
            result.residuals.push(residual);
            let slopes = response.sensitivity.map(|slope| scale * slope);
            result.jacobian.push(slopes);
            result.responses.push(response);
            result.lengths.push(length);
        }
        if let Some(whitening) = &self.whitening {
            (result.residuals, result.jacobian) =
                whitened(whitening, &result.residuals, &result.jacobian);
        }
        for prior in &self.priors {
            let residual = (value_along(&prior.gradient, point) - prior.value) / prior.std;
            result.residuals.push(residual);
            result
                .jacobian
                .push(prior.gradient.map(|slope| slope / prior.std));
        }
        result.cost = result.residuals.iter().map(|r| r * r).sum();
        result
    }

    /// Returns the measured frequencies as lambda of the beam at a point: where the roots are to be.
    pub(super) fn measured_lambdas(&self, point: &Point) -> Vec<f64> {
        let beams: Vec<Beam> = self.models.iter().map(|one| one.beam_at(point)).collect();
        let data = self.data.iter();
        data.map(|datum| beams[datum.structure].lambda_of(datum.frequency))
            .collect()
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

/// Returns the product of a triangle with residuals and with their slopes.
pub(super) fn whitened(
    triangle: &DMatrix<f64>,
    residuals: &[f64],
    slopes: &[Point],
) -> (Vec<f64>, Vec<Point>) {
    let (mut independent, mut turned) = (Vec::new(), Vec::new());
    for row in 0..residuals.len() {
        let mut sum = 0.0;
        let mut slope = [0.0; PARAMETERS];
        for column in 0..=row {
            let weight = triangle[(row, column)];
            sum += weight * residuals[column];
            for (total, part) in slope.iter_mut().zip(&slopes[column]) {
                *total += weight * part;
            }
        }
        independent.push(sum);
        turned.push(slope);
    }
    (independent, turned)
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
        let jacobian = DMatrix::from_fn(rows, columns, |row, column| {
            dot(&at.jacobian[row], &self.directions[column])
        });
        Some(Linearised::of_rows(jacobian, &at.residuals))
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

    /// Returns the standard deviation of a linear function of the point; `None` where nothing is known of
    /// it.
    pub(super) fn std(&self, gradient: &Point) -> Option<f64> {
        Some(self.between(gradient, gradient).sqrt()).filter(|std| *std < NOTHING_KNOWN)
    }
}

// Initial guesses: every joint of a grid where the frequency equation nearly holds.
//
// With the body's functions at the measured frequencies in hand, one Newton step tells about how
// far each predicted frequency would be from its measured one, for the price of a few products.
// A grid over all joints is cheaper that way than one exact prediction.

/// Decades of Kx and Ky tried: below the first a joint is hardly one, above the last hardly one
/// mode feels that it gives.
const TRANSLATION_DECADES: [f64; 6] = [0.5, 1.5, 2.5, 3.5, 4.5, 6.0];
const ROTATION_DECADES: [f64; 6] = [-1.0, 0.0, 1.0, 2.0, 3.0, 4.5];
/// Couplings tried, as atanh: tanh 1 is 0.76.
const COUPLINGS: [f64; 3] = [-1.0, 0.0, 1.0];
/// Factors of the stiffness or mass of the beam where one of them is estimated.
const BEAM_FACTORS: [f64; 3] = [1.0, 0.75, 1.33];
/// So many of the most promising joints are followed down.
pub(super) const FOLLOWED: usize = 4;

/// Joints that are tried on one beam.
struct Grid {
    beam: Point,
    /// Coordinates of Kt, Kr and the coupling: one alone where it is held.
    axes: [Vec<f64>; 3],
}

impl Grid {
    fn new(beam: &Point, fit: &[Parameter]) -> Self {
        let [log_kx, log_ky] = log_nondimensional(beam);
        let units = [beam[0] - log_kx, beam[1] - log_ky];
        let mut axes = [
            TRANSLATION_DECADES.map(|d| d * LN_10 + units[0]).to_vec(),
            ROTATION_DECADES.map(|d| d * LN_10 + units[1]).to_vec(),
            COUPLINGS.to_vec(),
        ];
        for (axis, parameter) in axes.iter_mut().zip(Parameter::JOINT) {
            if !fit.contains(&parameter) {
                *axis = vec![beam[parameter.index()]];
            }
        }
        Self { beam: *beam, axes }
    }

    /// Returns the indices of all joints, the last axis changing fastest.
    fn indices(&self) -> impl Iterator<Item = [usize; 3]> {
        let [x, y, z] = [0, 1, 2].map(|axis| self.axes[axis].len());
        (0..x * y * z).map(move |n| [n / (y * z), n / z % y, n % z])
    }

    fn point(&self, index: [usize; 3]) -> Point {
        let mut point = self.beam;
        for (axis, values) in self.axes.iter().enumerate() {
            point[axis] = values[index[axis]];
        }
        point
    }

    /// Returns the joints of which no neighbour has a smaller misfit, with their approximate misfit.
    fn minima(&self, problem: &Problem<'_>) -> Vec<(f64, Point)> {
        let lambdas = problem.measured_lambdas(&self.beam);
        let functions: Vec<InterfaceFunctions> = lambdas
            .iter()
            .zip(&problem.data)
            .map(|(lambda, datum)| problem.models[datum.structure].body.functions(*lambda))
            .collect();
        let points: Vec<Point> = self.indices().map(|index| self.point(index)).collect();
        let costs: Vec<f64> = points
            .iter()
            .map(|point| approximate_cost(problem, &functions, point))
            .collect();
        let mut strides = [1; 3];
        for axis in [1, 0] {
            strides[axis] = strides[axis + 1] * self.axes[axis + 1].len();
        }
        let mut minima = Vec::new();
        for (n, index) in self.indices().enumerate() {
            let is_minimum = (0..3).all(|axis| {
                let is_first = index[axis] == 0;
                let is_last = index[axis] + 1 == self.axes[axis].len();
                (is_first || costs[n] <= costs[n - strides[axis]])
                    && (is_last || costs[n] <= costs[n + strides[axis]])
            });
            if is_minimum {
                minima.push((costs[n], points[n]));
            }
        }
        minima
    }
}

/// Returns a guess for every minimum there may be: every second joint of the grid.
pub(super) fn everywhere(nominal: &Point, fit: &[Parameter]) -> Vec<Point> {
    let grid = Grid::new(nominal, fit);
    let few = grid.axes[0].len() * grid.axes[1].len() < 10;
    let indices = grid.indices().filter(|[i, j, _]| few || (i + j) % 2 == 0);
    indices.map(|index| grid.point(index)).collect()
}

/// Returns the most promising joints of the grid, the best first; no two of them are neighbours.
pub(super) fn promising(problem: &Problem<'_>, nominal: &Point, fit: &[Parameter]) -> Vec<Point> {
    if !fit.iter().any(|fitted| Parameter::JOINT.contains(fitted)) {
        return vec![*nominal];
    }
    let beam = [Parameter::Modulus, Parameter::Density];
    let fitted = beam.into_iter().find(|parameter| fit.contains(parameter));
    let mut found = Vec::new();
    for factor in BEAM_FACTORS {
        let mut at = *nominal;
        match fitted {
            Some(parameter) => at[parameter.index()] += factor.ln(),
            None if factor != 1.0 => continue,
            None => {}
        }
        found.extend(Grid::new(&at, fit).minima(problem));
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.truncate(FOLLOWED);
    found.into_iter().map(|(_, point)| point).collect()
}

/// Returns the sum of squared misfits of a joint, by one Newton step from each measured frequency.
fn approximate_cost(problem: &Problem<'_>, functions: &[InterfaceFunctions], point: &Point) -> f64 {
    let models = problem.models.iter();
    let joints: Vec<JointWeights> = models
        .map(|model| JointWeights::from_compliances(model.compliances(point)))
        .collect();
    let mut cost = 0.0;
    for (datum, at) in problem.data.iter().zip(functions) {
        let joint = &joints[datum.structure];
        let uncounted = problem.models[datum.structure].body.uncounted();
        let (value, slope) = at.equation(joint);
        // Neighbouring roots are about pi apart in lambda; f grows as its square.
        let spacing = 2.0 * PI / at.lambda;
        let (number, count) = (datum.mode + uncounted, at.count(joint, value));
        let modes_off = if count >= number {
            count - number
        } else {
            number - 1 - count
        };
        let newton = 2.0 * (at.newton_step(value, slope) / at.lambda).abs();
        let miss = newton.min(0.5 * spacing) + modes_off as f64 * spacing;
        cost += (miss * datum.frequency / datum.std).powi(2);
    }
    cost
}
