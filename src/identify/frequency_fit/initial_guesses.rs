//! Initial guesses: every joint of a grid where the frequency equation nearly holds.
//!
//! With the body's functions at the measured frequencies in hand, one Newton step tells about how
//! far each predicted frequency would be from its measured one, for the price of a few products.
//! A grid over all joints is cheaper that way than one exact prediction.

use super::model::{Parameter, Point, log_nondimensional};
use super::problem::Problem;
use std::f64::consts::{LN_10, PI};
use tapjoint_beam::interface::{InterfaceFunctions, JointWeights};

/// Decades of Kx and Ky tried: below the first a joint is hardly one, above the last hardly one
/// mode feels that it gives.
const TRANSLATION_DECADES: [f64; 6] = [0.5, 1.5, 2.5, 3.5, 4.5, 6.0];
const ROTATION_DECADES: [f64; 6] = [-1.0, 0.0, 1.0, 2.0, 3.0, 4.5];
/// Couplings tried, as atanh: tanh 1 is 0.76.
const COUPLINGS: [f64; 3] = [-1.0, 0.0, 1.0];
/// Factors of the stiffness or mass of the beam where one of them is estimated.
const BEAM_FACTORS: [f64; 3] = [1.0, 0.75, 1.33];
/// So many of the most promising joints are followed down.
const FOLLOWED: usize = 4;

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
            .map(|lambda| problem.model.body.functions(*lambda))
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
    let joint = JointWeights::from_compliances(problem.model.compliances(point));
    let uncounted = problem.model.body.uncounted();
    let mut cost = 0.0;
    for (datum, at) in problem.data.iter().zip(functions) {
        let (value, slope) = at.equation(&joint);
        // Neighbouring roots are about pi apart in lambda; f grows as its square.
        let spacing = 2.0 * PI / at.lambda;
        let (number, count) = (datum.mode + uncounted, at.count(&joint, value));
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
