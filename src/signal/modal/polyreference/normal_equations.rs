//! The reduced normal equations of the denominator, for all orders at once.
//!
//! Model (right matrix fraction): row o of H is B_o(z) A(z)^{-1}, with the denominator
//! A(z) = sum_{j=0}^{n} A_j z^j (inputs by inputs) and the numerator
//! B_o(z) = sum_{j=-e}^{N+e} B_oj z^j. Minimised is sum over outputs and lines of
//! |B_o(z_k) - H_o(z_k) A(z_k)|^2, linear in the coefficients; the numerators are eliminated first:
//! M = sum_o w_o (T_o - S_o^H R^{-1} S_o), with
//! R = sum_k z_k^{j'-j}, S_o = sum_k H_o z_k^{j'-j}, T_o = sum_k H_o^H H_o z_k^{j'-j}
//! (Guillaume et al. 2003). All three are Toeplitz, so that two transforms a line of the matrix
//! replace sums of lines times order squared.
//!
//! The numerator keeps its highest order N for every order n of the denominator: the background of
//! modes outside the band is then modelled equally well at every order, and M of a lower order is a
//! leading part of M of the highest, so that one factorisation serves the whole diagram.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, Dyn};
use num_complex::Complex64;
use rustfft::FftPlanner;

use super::ResponseMatrix;
use crate::modal::projection::conjugate_product;
use crate::spectral::smallest_smooth_block;

/// Share of the unit circle that the band covers. On a full circle the numerator would have to join
/// the band's two ends, which differ, and the Gibbs ripple of that disturbs the poles; on a smaller
/// arc powers of z become dependent. On noise-free modes four fifths read poles to 1e-8 from order
/// 16 on, the full circle to 1e-5.
const SHARE_OF_CIRCLE: f64 = 0.8;
/// Powers that the numerator has beyond those of the denominator, at either end: modes outside the
/// band are smooth within it, and five powers more take a digit or two off what they leave.
pub(super) const EXTRA_POWERS: usize = 5;
/// Smallest ridge, relative to the trace: the rounding of the sums.
const RIDGE: f64 = 1e-15;
/// How often the ridge is raised a hundredfold before the equations are given up.
const RIDGE_STEPS: i32 = 4;

/// How the band lies on the unit circle: line k is at z_k = e^{j k step}.
#[derive(Debug, Clone, Copy)]
pub(super) struct CircleMap {
    /// Frequency of the first line (Hz), at z = 1.
    first: f64,
    /// Sampling time T_a of the discrete-time model (s): step/(2 pi spacing).
    time: f64,
    /// Angle of the gap's middle, where the circle is cut.
    cut: f64,
    transform: usize,
}

impl CircleMap {
    pub(super) fn new(matrix: &ResponseMatrix) -> Self {
        let points = matrix.points();
        let transform = smallest_smooth_block((points as f64 / SHARE_OF_CIRCLE).ceil() as usize);
        let arc = (points.max(1) - 1) as f64 / transform as f64 * TAU;
        CircleMap {
            first: matrix.frequency(0),
            time: 1.0 / (transform as f64 * matrix.spacing()),
            cut: 0.5 * (arc + TAU),
            transform,
        }
    }

    /// Pole (1/s) of the root w = 1/z: p = j 2 pi f_first - ln(w)/T_a.
    pub(super) fn pole(&self, inverse_root: Complex64) -> Complex64 {
        let angle = -inverse_root.arg();
        // Angles from the gap's middle downwards by a turn belong to the band.
        let lower = self.cut - TAU;
        let angle = lower + (angle - lower).rem_euclid(TAU);
        Complex64::new(
            -inverse_root.norm().ln() / self.time,
            TAU * self.first + angle / self.time,
        )
    }

    /// z of a pole, e^{(p - j 2 pi f_first) T_a}.
    pub(super) fn inverse_root(&self, pole: Complex64) -> Complex64 {
        (-(pole - Complex64::new(0.0, TAU * self.first)) * self.time).exp()
    }
}

/// Denominator coefficients of every order, from one factorisation.
pub(super) struct Denominators {
    inputs: usize,
    /// L of M = L L^H without the rows of A_0.
    factor: DMatrix<Complex64>,
    /// L^{-1} times the negative columns of A_0.
    reduced: DMatrix<Complex64>,
}

impl Denominators {
    /// `None` where the responses are all zero or the equations cannot be solved.
    pub(super) fn new(
        matrix: &ResponseMatrix,
        map: &CircleMap,
        order: usize,
        weights: &[f64],
    ) -> Option<Self> {
        let inputs = matrix.inputs();
        let reduced = reduced_matrix(matrix, map, order, weights)?;
        let unknowns = order * inputs;
        let block = reduced.view((inputs, inputs), (unknowns, unknowns));
        let factor = factorise(&block.into_owned())?.unpack();
        let mut right = -reduced.view((inputs, 0), (unknowns, inputs)).into_owned();
        factor
            .solve_lower_triangular_mut(&mut right)
            .then_some(())?;
        Some(Denominators {
            inputs,
            factor,
            reduced: right,
        })
    }

    /// A_1 ... A_n one below the other, A_0 being the identity.
    pub(super) fn coefficients(&self, order: usize) -> Option<DMatrix<Complex64>> {
        let unknowns = order * self.inputs;
        let factor = self.factor.view((0, 0), (unknowns, unknowns));
        let mut solution = self.reduced.rows(0, unknowns).into_owned();
        factor
            .ad_solve_lower_triangular_mut(&mut solution)
            .then_some(solution)
    }
}

/// Cholesky factor with the smallest ridge that allows one.
fn factorise(matrix: &DMatrix<Complex64>) -> Option<Cholesky<Complex64, Dyn>> {
    let trace = matrix.trace().re;
    if !(trace.is_finite() && trace > 0.0) {
        return None;
    }
    (0..=RIDGE_STEPS).find_map(|step| {
        let mut raised = matrix.clone();
        let ridge = Complex64::from(RIDGE * 100f64.powi(step) * trace);
        for index in 0..raised.nrows() {
            raised[(index, index)] += ridge;
        }
        Cholesky::new(raised)
    })
}

/// M for the highest order, unknown (power j, input i) at j * inputs + i.
fn reduced_matrix(
    matrix: &ResponseMatrix,
    map: &CircleMap,
    order: usize,
    weights: &[f64],
) -> Option<DMatrix<Complex64>> {
    let inputs = matrix.inputs();
    let columns = (order + 1) * inputs;
    let powers = order + 1 + 2 * EXTRA_POWERS;
    let mut sums = Sums::new(map.transform);
    let ones = vec![Complex64::ONE; matrix.points()];
    let numerator = factorise(&toeplitz(&sums.at(&ones), powers))?.unpack();
    let mut reduced = DMatrix::zeros(columns, columns);
    for (output, &weight) in (0..matrix.outputs()).zip(weights) {
        let row: Vec<Vec<Complex64>> = (0..inputs)
            .map(|input| scaled(matrix.entry(output, input), weight.sqrt()))
            .collect();
        add_products(&mut reduced, &mut sums, &row, order);
        let mut mixed = DMatrix::zeros(powers, columns);
        for (input, entry) in row.iter().enumerate() {
            let lags = sums.at(entry);
            // Row j stands for the numerator's power j - e.
            for power in 0..=order {
                for j in 0..powers {
                    let lag = power as i64 - (j as i64 - EXTRA_POWERS as i64);
                    mixed[(j, power * inputs + input)] = at_lag(&lags, lag);
                }
            }
        }
        numerator
            .solve_lower_triangular_mut(&mut mixed)
            .then_some(())?;
        subtract_gram(&mut reduced, &mixed);
    }
    Some(reduced)
}

fn scaled(values: &[Complex64], scale: f64) -> Vec<Complex64> {
    values.iter().map(|value| value * scale).collect()
}

/// Adds T of one output.
fn add_products(
    reduced: &mut DMatrix<Complex64>,
    sums: &mut Sums,
    row: &[Vec<Complex64>],
    order: usize,
) {
    let inputs = row.len();
    for (i, left) in row.iter().enumerate() {
        for (k, right) in row.iter().enumerate() {
            let product: Vec<Complex64> =
                left.iter().zip(right).map(|(a, b)| a.conj() * b).collect();
            let lags = sums.at(&product);
            for q in 0..=order {
                for p in 0..=order {
                    reduced[(p * inputs + i, q * inputs + k)] += at_lag(&lags, q as i64 - p as i64);
                }
            }
        }
    }
}

/// Subtracts Y^H Y, computed on one side of the diagonal only.
fn subtract_gram(reduced: &mut DMatrix<Complex64>, mixed: &DMatrix<Complex64>) {
    let (rows, columns) = mixed.shape();
    let values = mixed.as_slice();
    let column = |index: usize| &values[index * rows..(index + 1) * rows];
    for q in 0..columns {
        for p in 0..=q {
            let product = conjugate_product(column(p), column(q));
            reduced[(p, q)] -= product;
            if p != q {
                reduced[(q, p)] -= product.conj();
            }
        }
    }
}

/// Hermitian Toeplitz matrix with entry (j, k) at lag k - j.
fn toeplitz(lags: &[Complex64], size: usize) -> DMatrix<Complex64> {
    DMatrix::from_fn(size, size, |j, k| at_lag(lags, k as i64 - j as i64))
}

/// Negative lags stand at the end of a transform.
fn at_lag(lags: &[Complex64], lag: i64) -> Complex64 {
    lags[lag.rem_euclid(lags.len() as i64) as usize]
}

/// Sums over the lines of x_k z_k^lag, for all lags, as one inverse transform.
struct Sums {
    transform: std::sync::Arc<dyn rustfft::Fft<f64>>,
    scratch: Vec<Complex64>,
}

impl Sums {
    fn new(length: usize) -> Self {
        let transform = FftPlanner::new().plan_fft_inverse(length);
        let scratch = vec![Complex64::ZERO; transform.get_inplace_scratch_len()];
        Sums { transform, scratch }
    }

    fn at(&mut self, values: &[Complex64]) -> Vec<Complex64> {
        let mut buffer = vec![Complex64::ZERO; self.transform.len()];
        buffer[..values.len()].copy_from_slice(values);
        self.transform
            .process_with_scratch(&mut buffer, &mut self.scratch);
        buffer
    }
}
