//! Where the search starts: everywhere the frequency equation nearly holds.
//!
//! With the body's functions at the measured frequencies in hand, one Newton step tells about how
//! far each predicted frequency would be from its measured one, for the price of a few products.
//! A grid over all joints is cheaper that way than one exact prediction.

use super::least_squares::Problem;
use super::model::{Parameter, Point, log_nondimensional};
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
/// So many of the most promising places are followed down.
const FOLLOWED: usize = 4;

/// A place for every valley there may be: every second of the grid's.
pub(super) fn everywhere(nominal: &Point, fit: &[Parameter]) -> Vec<Point> {
    let axes = axes(nominal, fit);
    let mut found = Vec::new();
    for_each(
        [axes[0].len(), axes[1].len(), axes[2].len()],
        |[i, j, k]| {
            if (i + j) % 2 == 0 || axes[0].len() * axes[1].len() < 10 {
                let mut point = *nominal;
                (point[0], point[1], point[2]) = (axes[0][i], axes[1][j], axes[2][k]);
                found.push(point);
            }
        },
    );
    found
}

/// The most promising places of the grid, the best first; no two of them neighbours.
pub(super) fn promising(problem: &Problem<'_>, nominal: &Point, fit: &[Parameter]) -> Vec<Point> {
    let beam = [Parameter::Modulus, Parameter::Density];
    let joint = [Parameter::Kt, Parameter::Kr, Parameter::Coupling];
    if !fit.iter().any(|parameter| joint.contains(parameter)) {
        return vec![*nominal];
    }
    let mut found = Vec::new();
    for factor in BEAM_FACTORS {
        let mut at = *nominal;
        match beam.into_iter().find(|parameter| fit.contains(parameter)) {
            Some(parameter) => at[parameter.index()] += factor.ln(),
            None if factor != 1.0 => continue,
            None => {}
        }
        found.extend(grid_minima(problem, &at, fit));
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.truncate(FOLLOWED);
    found.into_iter().map(|(_, point)| point).collect()
}

/// Places of the grid of which no neighbour is better, with their approximate misfit.
fn grid_minima(problem: &Problem<'_>, at: &Point, fit: &[Parameter]) -> Vec<(f64, Point)> {
    let lambdas = problem.measured_lambdas(at);
    let functions: Vec<InterfaceFunctions> = lambdas
        .iter()
        .map(|lambda| problem.model.body.functions(*lambda))
        .collect();
    let axes = axes(at, fit);
    let place = |index: [usize; 3]| {
        let mut point = *at;
        for axis in 0..3 {
            point[axis] = axes[axis][index[axis]];
        }
        point
    };
    let sizes = [axes[0].len(), axes[1].len(), axes[2].len()];
    let mut costs = Vec::with_capacity(sizes.iter().product());
    for_each(sizes, |index| {
        costs.push(approximate_cost(problem, &functions, &place(index)));
    });
    let cost = |[i, j, k]: [usize; 3]| costs[(i * sizes[1] + j) * sizes[2] + k];
    let mut minima = Vec::new();
    for_each(sizes, |index| {
        let own = cost(index);
        let best = neighbours(index, sizes).all(|other| own <= cost(other));
        if best {
            minima.push((own, place(index)));
        }
    });
    minima
}

/// Values tried of Kt, Kr and the coupling: one alone where it is held.
fn axes(at: &Point, fit: &[Parameter]) -> [Vec<f64>; 3] {
    let [log_kx, log_ky] = log_nondimensional(at);
    let units = [at[0] - log_kx, at[1] - log_ky];
    [
        (
            Parameter::Kt,
            TRANSLATION_DECADES.map(|d| d * LN_10 + units[0]).to_vec(),
        ),
        (
            Parameter::Kr,
            ROTATION_DECADES.map(|d| d * LN_10 + units[1]).to_vec(),
        ),
        (Parameter::Coupling, COUPLINGS.to_vec()),
    ]
    .map(|(parameter, grid)| {
        if fit.contains(&parameter) {
            grid
        } else {
            vec![at[parameter.index()]]
        }
    })
}

fn for_each(sizes: [usize; 3], mut visit: impl FnMut([usize; 3])) {
    for i in 0..sizes[0] {
        for j in 0..sizes[1] {
            for k in 0..sizes[2] {
                visit([i, j, k]);
            }
        }
    }
}

/// The places one step along one axis away.
fn neighbours(index: [usize; 3], sizes: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..3).flat_map(move |axis| {
        let down = index[axis].checked_sub(1);
        let up = Some(index[axis] + 1).filter(|up| *up < sizes[axis]);
        [down, up].into_iter().flatten().map(move |moved| {
            let mut other = index;
            other[axis] = moved;
            other
        })
    })
}

fn approximate_cost(problem: &Problem<'_>, functions: &[InterfaceFunctions], point: &Point) -> f64 {
    let joint = JointWeights::from(&problem.model.compliance(point));
    let uncounted = problem.model.body.uncounted();
    problem
        .data
        .iter()
        .zip(functions)
        .map(|(datum, at)| {
            let miss = approximate_miss(at, &joint, datum.mode + uncounted);
            (miss * datum.frequency / datum.std).powi(2)
        })
        .sum()
}

/// About how far (1, relative) a predicted frequency is from the place of these functions.
fn approximate_miss(at: &InterfaceFunctions, joint: &JointWeights, number: usize) -> f64 {
    let (value, slope) = at.equation(joint);
    let count = at.count(joint, value);
    // Neighbouring roots are about pi apart in lambda; f grows as its square.
    let spacing = 2.0 * PI / at.lambda;
    let modes_off = if count >= number {
        count - number
    } else {
        number - 1 - count
    };
    let newton = 2.0 * (at.newton_step(value, slope) / at.lambda).abs();
    newton.min(0.5 * spacing) + modes_off as f64 * spacing
}
