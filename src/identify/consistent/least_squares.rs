//! Levenberg's and Marquardt's damped least squares for a handful of unknowns (Madsen, Nielsen &
//! Tingleff 2004).
//!
//! Each step solves the linearised problem by Householder's reflections, never by its normal
//! equations, which would square the condition number: stiffnesses that the frequencies hardly
//! feel are what this is for.

use super::model::{FrequencyModel, PARAMETERS, Parameter, Point, log_nondimensional};

/// Why an estimate stopped where it did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The next step would not move any parameter noticeably.
    SmallStep,
    /// No step can lower the misfit noticeably.
    Minimum,
    /// Rounding lets no step lower the misfit any more.
    Rounding,
    /// The steps ran out: the result is the best so far.
    StepLimit,
    /// Nothing was free to be estimated.
    NothingFree,
}

impl StopReason {
    /// Whether it is a minimum.
    pub fn converged(self) -> bool {
        self != Self::StepLimit
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::SmallStep => "the last step moved nothing noticeably",
            Self::Minimum => "no step lowers the misfit noticeably",
            Self::Rounding => "rounding lets no step lower the misfit",
            Self::StepLimit => "the steps ran out",
            Self::NothingFree => "nothing was free to be estimated",
        }
    }
}

/// How exact a minimum is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Accuracy {
    /// Steps smaller than this end the search (1, in logarithms).
    pub(super) step: f64,
    /// So does a predicted relative gain smaller than this.
    pub(super) gain: f64,
    /// At most so many steps.
    pub(super) limit: usize,
}

impl Accuracy {
    /// To the last digits.
    pub(super) const FULL: Self = Self {
        step: 1e-11,
        gain: 1e-15,
        limit: 200,
    };
    /// Where only the size of the misfit is wanted: its error is the gain.
    pub(super) const MISFIT: Self = Self {
        step: 1e-6,
        gain: 1e-8,
        limit: 60,
    };
    /// To tell the valleys apart.
    pub(super) const ROUGH: Self = Self {
        step: 1e-2,
        gain: 1e-3,
        limit: 25,
    };
}

/// Where a search ended.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Minimum {
    pub(super) at: Evaluation,
    pub(super) stop: StopReason,
}

/// Stiffnesses beyond these differ from none and from rigid in no frequency (logarithms of Kx and
/// Ky); beyond the last the coupling is 1 to nine digits.
pub(super) const LOG_STIFFNESS: (f64, f64) = (-16.0, 21.0);
const COUPLING_LIMIT: f64 = 10.5;
/// No step moves a parameter by more than this factor e^2, wherever a linear model points.
const LONGEST_STEP: f64 = 2.0;

/// The nearest minimum downhill of a place, along these directions.
pub(super) fn descend(
    problem: &Problem<'_>,
    start: Evaluation,
    directions: &[Point],
    accuracy: Accuracy,
) -> Minimum {
    let mut at = start;
    if directions.is_empty() {
        let stop = StopReason::NothingFree;
        return Minimum { at, stop };
    }
    let mut search = Search::new(directions.len());
    for _ in 0..accuracy.limit {
        search.linearise(&at, directions);
        loop {
            let step = search.damped_step();
            let gain = search.predicted_gain(&step);
            if !gain.is_finite() || gain <= accuracy.gain * at.cost || at.cost == 0.0 {
                let stop = StopReason::Minimum;
                return Minimum { at, stop };
            }
            let (point, longest) = moved(problem, &at.point, directions, &step);
            let trial = problem.evaluate(&point, &at.lambdas);
            let ratio = (at.cost - trial.cost) / gain;
            search.adjust(ratio);
            if trial.cost < at.cost {
                at = trial;
                if longest < accuracy.step {
                    let stop = StopReason::SmallStep;
                    return Minimum { at, stop };
                }
                break;
            }
            if longest < accuracy.step || search.damping > 1e15 {
                let stop = StopReason::Rounding;
                return Minimum { at, stop };
            }
        }
    }
    let stop = StopReason::StepLimit;
    Minimum { at, stop }
}

/// The point one step on, within bounds, and the longest change of a parameter.
fn moved(problem: &Problem<'_>, from: &Point, directions: &[Point], step: &[f64]) -> (Point, f64) {
    let mut change = [0.0; PARAMETERS];
    for (direction, length) in directions.iter().zip(step) {
        for (change, part) in change.iter_mut().zip(direction) {
            *change += length * part;
        }
    }
    let longest = change.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    let factor = (LONGEST_STEP / longest).min(1.0);
    let mut point = *from;
    for (coordinate, change) in point.iter_mut().zip(change) {
        *coordinate += factor * change;
    }
    (problem.within_bounds(point), factor * longest)
}

/// Keeps a stiffness between none and rigid, and the coupling from its limits.
pub(super) fn bounded(mut point: Point, log_units: [f64; 2]) -> Point {
    let (low, high) = LOG_STIFFNESS;
    for (coordinate, unit) in point.iter_mut().zip(log_units) {
        if coordinate.is_finite() {
            *coordinate = coordinate.clamp(low + unit, high + unit);
        }
    }
    point[2] = point[2].clamp(-COUPLING_LIMIT, COUPLING_LIMIT);
    point
}

/// The linearised problem: rows of slopes along the directions with the residual last.
struct Search {
    unknowns: usize,
    rows: Vec<f64>,
    triangle: Vec<f64>,
    scales: Vec<f64>,
    damping: f64,
    growth: f64,
    work: Vec<f64>,
}

impl Search {
    fn new(unknowns: usize) -> Self {
        Self {
            unknowns,
            rows: Vec::new(),
            triangle: Vec::new(),
            scales: vec![0.0; unknowns],
            damping: 1e-3,
            growth: 2.0,
            work: Vec::new(),
        }
    }

    /// Triangle of the linearised problem at a place.
    fn linearise(&mut self, at: &Evaluation, directions: &[Point]) {
        let width = self.unknowns + 1;
        self.rows.clear();
        for (residual, slopes) in at.residuals.iter().zip(&at.jacobian) {
            self.rows
                .extend(directions.iter().map(|direction| dot(slopes, direction)));
            self.rows.push(-residual);
        }
        for column in 0..self.unknowns {
            let squares = self.rows.iter().skip(column).step_by(width);
            let norm = squares.map(|x| x * x).sum::<f64>().sqrt();
            // A parameter that nothing feels here keeps the scale it had elsewhere.
            self.scales[column] = self.scales[column].max(norm);
        }
        triangularise(&mut self.rows, width);
        self.triangle.clone_from(&self.rows);
        self.triangle.resize(width * width, 0.0);
    }

    /// min |R d - b|^2 + damping |D d|^2, D the largest column norms so far.
    fn damped_step(&mut self) -> Vec<f64> {
        let (n, width) = (self.unknowns, self.unknowns + 1);
        let largest = self.scales.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
        self.work.clear();
        self.work.extend_from_slice(&self.triangle[..n * width]);
        for (column, scale) in self.scales.iter().enumerate() {
            let weight = self.damping.sqrt() * scale.max(1e-12 * largest);
            let start = self.work.len();
            self.work.resize(start + width, 0.0);
            self.work[start + column] = weight;
        }
        triangularise(&mut self.work, width);
        back_substitute(&self.work, n)
    }

    /// Loss of squares that the linear model promises, |b|^2 - |R d - b|^2.
    fn predicted_gain(&self, step: &[f64]) -> f64 {
        let width = self.unknowns + 1;
        let mut gain = 0.0;
        for row in self.triangle.chunks(width).take(self.unknowns) {
            let moved: f64 = row.iter().zip(step).map(|(a, b)| a * b).sum();
            let right = row[self.unknowns];
            gain += moved * (2.0 * right - moved);
        }
        gain
    }

    /// Nielsen's rule: a good step lowers the damping by up to 3, a bad one raises it ever faster.
    fn adjust(&mut self, ratio: f64) {
        if ratio > 0.0 {
            self.damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(0.1, 2.0);
            self.growth = 2.0;
        } else {
            self.damping *= self.growth;
            self.growth *= 2.0;
        }
        self.damping = self.damping.max(1e-18);
    }
}

/// Inner product of a row of slopes and a direction.
pub(super) fn dot(slopes: &Point, direction: &Point) -> f64 {
    slopes.iter().zip(direction).map(|(a, b)| a * b).sum()
}

/// Upper triangle of a matrix of rows of this width by Householder's reflections; what falls below
/// the last row of the triangle is the residual.
pub(super) fn triangularise(rows: &mut [f64], width: usize) {
    let count = rows.len() / width;
    for column in 0..width.min(count) {
        let norm = (column..count)
            .map(|row| rows[row * width + column].powi(2))
            .sum::<f64>()
            .sqrt();
        if norm == 0.0 {
            continue;
        }
        let pivot = rows[column * width + column];
        let diagonal = if pivot > 0.0 { -norm } else { norm };
        let head = pivot - diagonal;
        for other in column + 1..width {
            let mut product = head * rows[column * width + other];
            for row in column + 1..count {
                product += rows[row * width + column] * rows[row * width + other];
            }
            // 2/(v.v) = 1/(norm (norm + |pivot|)) = -1/(diagonal head).
            let factor = product / (diagonal * head);
            rows[column * width + other] += factor * head;
            for row in column + 1..count {
                rows[row * width + other] += factor * rows[row * width + column];
            }
        }
        rows[column * width + column] = diagonal;
        for row in column + 1..count {
            rows[row * width + column] = 0.0;
        }
    }
}

/// Solves the triangle of `n` unknowns whose last column is the right-hand side.
fn back_substitute(triangle: &[f64], n: usize) -> Vec<f64> {
    let width = n + 1;
    let mut solution = vec![0.0; n];
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n)
            .map(|column| triangle[row * width + column] * solution[column])
            .sum();
        let pivot = triangle[row * width + row];
        let rest = triangle[row * width + n] - known;
        solution[row] = if pivot == 0.0 { 0.0 } else { rest / pivot };
    }
    solution
}

// The weighted residuals and their derivatives at a point.

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
        let [_, _, _, modulus, density, length, _, thickness] = point.map(f64::exp);
        // f = lambda^2 h/(2 pi L^2) sqrt(E/(12 rho)).
        let unit = thickness / (2.0 * std::f64::consts::PI * length * length)
            * (modulus / (12.0 * density)).sqrt();
        let data = self.data.iter();
        data.map(|datum| (datum.frequency / unit).sqrt()).collect()
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

// First-order uncertainty: covariance, leverage and what a direction is worth.

/// Beyond this standard deviation (1, in logarithms) nothing at all is known of a parameter.
pub(super) const NOTHING_KNOWN: f64 = 1e3;

/// Covariance of the free coordinates, spread over all of them (zero for those held).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Covariance {
    /// Rows of R^-1 for each free direction, so that the covariance is their product.
    inverse: Vec<Vec<f64>>,
    directions: Vec<Point>,
}

impl Covariance {
    /// (J^T J)^-1 along these directions, by way of the triangle of J with its columns scaled to
    /// 1. A column of zeros counts as one of a billionth of the largest: nothing known.
    pub(super) fn new(jacobian: &[Point], directions: &[Point]) -> Self {
        let n = directions.len();
        let mut rows = Vec::with_capacity(jacobian.len() * n);
        for slopes in jacobian {
            rows.extend(directions.iter().map(|direction| dot(slopes, direction)));
        }
        let mut norms = Vec::with_capacity(n);
        for column in 0..n {
            let squares = rows.iter().skip(column).step_by(n);
            norms.push(squares.map(|x| x * x).sum::<f64>().sqrt());
        }
        let largest = norms.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
        let scales: Vec<f64> = norms.iter().map(|norm| norm.max(1e-9 * largest)).collect();
        for row in rows.chunks_mut(n.max(1)) {
            for (entry, scale) in row.iter_mut().zip(&scales) {
                *entry /= scale;
            }
        }
        // Weak knowledge of everything keeps the triangle regular without a visible change.
        for column in 0..n {
            let start = rows.len();
            rows.resize(start + n, 0.0);
            rows[start + column] = 1e-10;
        }
        if n > 0 {
            triangularise(&mut rows, n);
        }
        Self {
            inverse: inverse_of_triangle(&rows, &scales),
            directions: directions.to_vec(),
        }
    }

    pub(super) fn of(at: &Evaluation, directions: &[Point]) -> Self {
        Self::new(&at.jacobian, directions)
    }

    /// g^T C for a linear function with gradient g, in the coordinates in which C is 1.
    fn components(&self, gradient: &Point) -> Vec<f64> {
        let n = self.directions.len();
        (0..n)
            .map(|column| {
                self.directions
                    .iter()
                    .zip(&self.inverse)
                    .map(|(direction, row)| dot(gradient, direction) * row[column])
                    .sum()
            })
            .collect()
    }

    /// Covariance of two linear functions of the point.
    pub(super) fn between(&self, first: &Point, second: &Point) -> f64 {
        let (a, b) = (self.components(first), self.components(second));
        a.iter().zip(&b).map(|(a, b)| a * b).sum()
    }

    /// Standard deviation of a linear function of the point; `None` where nothing is known of it.
    pub(super) fn std(&self, gradient: &Point) -> Option<f64> {
        let std = self.between(gradient, gradient).sqrt();
        (std < NOTHING_KNOWN).then_some(std)
    }

    /// The same, however large it is.
    pub(super) fn std_or_infinite(&self, gradient: &Point) -> f64 {
        self.between(gradient, gradient).sqrt()
    }

    /// How much of each residual's freedom the fit takes: the diagonal of J (J^T J)^-1 J^T.
    pub(super) fn leverages(&self, jacobian: &[Point]) -> Vec<f64> {
        jacobian
            .iter()
            .map(|slopes| self.between(slopes, slopes))
            .collect()
    }

    /// Variance of `gradient` when one more residual of these slopes is known:
    /// C - C j j^T C/(1 + j^T C j).
    pub(super) fn variance_with(&self, gradient: &Point, slopes: &Point) -> f64 {
        let shared = self.between(gradient, slopes);
        self.between(gradient, gradient) - shared * shared / (1.0 + self.between(slopes, slopes))
    }
}

/// Rows of D^-1 R^-1 for the scaled triangle R, from the last row up: row i of R^-1 is that of the
/// unit matrix less the rows below it times row i of R, over the diagonal.
fn inverse_of_triangle(rows: &[f64], scales: &[f64]) -> Vec<Vec<f64>> {
    let n = scales.len();
    let mut inverse: Vec<Vec<f64>> = vec![Vec::new(); n];
    for row in (0..n).rev() {
        let mut found = vec![0.0; n];
        found[row] = 1.0;
        for (below, known) in inverse.iter().enumerate().skip(row + 1) {
            let factor = rows[row * n + below];
            for (entry, known) in found.iter_mut().zip(known) {
                *entry -= factor * known;
            }
        }
        for entry in &mut found {
            *entry /= rows[row * n + row];
        }
        inverse[row] = found;
    }
    for (row, scale) in inverse.iter_mut().zip(scales) {
        for entry in row {
            *entry /= scale;
        }
    }
    inverse
}
