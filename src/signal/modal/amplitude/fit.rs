//! Least squares of complex exponentials by Levenberg and Marquardt.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::exponentials::Exponentials;

/// A parameter known beforehand: index, value, and 1/variance (of both parts together).
#[derive(Debug, Clone, Copy)]
pub(super) struct Prior {
    pub parameter: usize,
    pub value: Complex64,
    pub weight: f64,
}

/// A fit.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub model: Exponentials,
    /// Sum of the squared residuals.
    pub squares: f64,
    /// (J^H J + priors)^-1; times the noise variance, the parameters' covariance.
    pub inverse: DMatrix<Complex64>,
    pub residuals: Vec<Complex64>,
}

const ITERATIONS: usize = 25;
/// Change of the sum of squares at which a fit has settled, relative.
const SETTLED: f64 = 1e-7;
/// Values beyond this are no amplitude any more.
const LARGEST: f64 = 1e100;

/// Fits a model to values at times; `None` when the unknowns cannot be told apart at all.
///
/// Priors take the noise variance as 1: scale their weights by it.
pub(super) fn fit_exponentials(
    times: &[f64],
    values: &[Complex64],
    start: Exponentials,
    priors: &[Prior],
) -> Option<Fit> {
    let mut model = start;
    let mut state = normal_equations(times, values, &model, priors)?;
    let mut damping = 1e-3;
    for _ in 0..ITERATIONS {
        let mut left = state.left.clone();
        for index in 0..left.nrows() {
            left[(index, index)] += damping * state.left[(index, index)].re + f64::MIN_POSITIVE;
        }
        let step = left.lu().solve(&state.right)?;
        let trial = model.moved(step.as_slice());
        let next = normal_equations(times, values, &trial, priors);
        match next.filter(|next| next.cost <= state.cost) {
            Some(next) => {
                let settled = state.cost - next.cost <= SETTLED * state.cost;
                model = trial;
                state = next;
                damping = (damping * 0.1).max(1e-12);
                if settled {
                    break;
                }
            }
            None if damping > 1e6 => break,
            None => damping *= 10.0,
        }
    }
    finish(model, state)
}

fn finish(model: Exponentials, state: State) -> Option<Fit> {
    // Scaled to a unit diagonal: amplitudes and poles differ by orders of magnitude.
    let size = state.left.nrows();
    let scale: Vec<f64> = (0..size)
        .map(|k| state.left[(k, k)].re.max(f64::MIN_POSITIVE).sqrt())
        .collect();
    let scaled = DMatrix::from_fn(size, size, |i, k| {
        state.left[(i, k)] / (scale[i] * scale[k])
    });
    let inverse = scaled.try_inverse()?;
    let inverse = DMatrix::from_fn(size, size, |i, k| inverse[(i, k)] / (scale[i] * scale[k]));
    Some(Fit {
        model,
        squares: state.residuals.iter().map(Complex64::norm_sqr).sum(),
        inverse,
        residuals: state.residuals,
    })
}

struct State {
    left: DMatrix<Complex64>,
    right: DVector<Complex64>,
    cost: f64,
    residuals: Vec<Complex64>,
}

fn normal_equations(
    times: &[f64],
    values: &[Complex64],
    model: &Exponentials,
    priors: &[Prior],
) -> Option<State> {
    let size = model.parameters();
    let mut products = vec![Complex64::ZERO; size * size];
    let mut right = DVector::zeros(size);
    let mut cost = 0.0;
    let mut row = Vec::with_capacity(size);
    let mut residuals = Vec::with_capacity(times.len());
    for (t, value) in times.iter().zip(values) {
        let residual = value - model.value(*t, &mut row);
        cost += residual.norm_sqr();
        residuals.push(residual);
        for ((i, a), sums) in row.iter().enumerate().zip(products.chunks_mut(size)) {
            let a = a.conj();
            right[i] += a * residual;
            for (sum, b) in sums.iter_mut().zip(&row[..=i]) {
                *sum += a * b;
            }
        }
    }
    // Only the lower triangle was summed; the matrix is Hermitian.
    let mut left = DMatrix::from_fn(size, size, |i, k| {
        if k <= i {
            products[i * size + k]
        } else {
            products[k * size + i].conj()
        }
    });
    let current = flat(model);
    for prior in priors {
        let away = prior.value - current[prior.parameter];
        left[(prior.parameter, prior.parameter)] += prior.weight;
        right[prior.parameter] += away * prior.weight;
        cost += away.norm_sqr() * prior.weight;
    }
    (cost < LARGEST).then_some(State {
        left,
        right,
        cost,
        residuals,
    })
}

fn flat(model: &Exponentials) -> Vec<Complex64> {
    let mut all = vec![model.amplitude];
    all.extend(&model.exponents);
    all.extend(model.others.iter().flat_map(|(c, p)| [*c, *p]));
    all
}
