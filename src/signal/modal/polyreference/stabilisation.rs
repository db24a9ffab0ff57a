//! Poles of every order, compared with those of the order before.
//!
//! They follow from the reduced normal equations of the denominator, set up for all orders at once.
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
//!
//! `roots` finds the roots of the matrix polynomial A.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, Dyn};
use num_complex::Complex64;
use rustfft::FftPlanner;

use super::roots::inverse_roots;
use super::{
    LEAST_ORDER, MOST_DAMPING, PolyreferenceError, PolyreferenceSettings, ResponseMatrix,
    least_lines,
};
use crate::spectral::smallest_smooth_block;

/// Agreement of a pole with the nearest one of the order before, in the classes of the usual diagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PoleStability {
    /// Nothing near it.
    New,
    /// The frequency.
    Frequency,
    /// Frequency and participation vector; not given for a single input, whose vectors are all
    /// alike.
    FrequencyAndVector,
    /// Frequency and damping; with several inputs, not the participation vector.
    FrequencyAndDamping,
    /// Frequency, damping and, with several inputs, the participation vector.
    All,
}

/// A pole of the stabilisation diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct StabilisationPole {
    /// Order of the denominator it was found at.
    pub order: usize,
    /// The pole (1/s), imaginary part positive, decay of an exponential window taken out.
    pub pole: Complex64,
    /// Natural frequency (Hz), |p|/(2 pi).
    pub frequency: f64,
    /// Damping ratio, -Re p/|p|.
    pub damping_ratio: f64,
    /// Participation of each input, of unit length, its largest entry real; (1) for one input.
    pub participation: Vec<Complex64>,
    /// Agreement with the order before.
    pub stability: PoleStability,
}

/// Poles of all orders from 2 to the highest, ascending in order and frequency.
///
/// Shown are poles within the band that decay, with a damping ratio below [`MOST_DAMPING`]: with the
/// lowest coefficient fixed the others belong to no structure (see the text of `polyreference`).
///
/// # Errors
/// [`PolyreferenceError::TooFewLines`] where the band holds fewer lines than unknowns,
/// [`PolyreferenceError::Singular`] where the responses are all zero.
pub fn stabilise_poles(
    matrix: &ResponseMatrix,
    settings: &PolyreferenceSettings,
) -> Result<Vec<StabilisationPole>, PolyreferenceError> {
    // Each column of unknowns meets outputs times lines equations.
    let least = least_lines(matrix, settings.order);
    if matrix.points() < least || settings.order == 0 {
        return Err(PolyreferenceError::TooFewLines {
            lines: matrix.points(),
            order: settings.order,
            least,
        });
    }
    let map = CircleMap::new(matrix);
    let (low, high) = matrix.ends();
    let singular = PolyreferenceError::Singular { low, high };
    let denominators = Denominators::new(matrix, &map, settings.order).ok_or(singular)?;
    let mut diagram: Vec<StabilisationPole> = Vec::new();
    let mut before: Vec<StabilisationPole> = Vec::new();
    let mut roots: Vec<Complex64> = Vec::new();
    for order in LEAST_ORDER..=settings.order {
        let Some(coefficients) = denominators.coefficients(order) else {
            (before, roots) = (Vec::new(), Vec::new());
            continue;
        };
        roots = inverse_roots(&coefficients, &roots);
        let mut poles = poles_of_order(matrix, &map, &coefficients, &roots, settings);
        for pole in &mut poles {
            pole.stability = stability(pole, &before, matrix.spacing);
        }
        diagram.extend(poles.iter().cloned());
        before = poles;
    }
    Ok(diagram)
}

fn poles_of_order(
    matrix: &ResponseMatrix,
    map: &CircleMap,
    coefficients: &DMatrix<Complex64>,
    roots: &[Complex64],
    settings: &PolyreferenceSettings,
) -> Vec<StabilisationPole> {
    let order = coefficients.nrows() / matrix.inputs;
    let (low, high) = matrix.ends();
    let mut poles: Vec<StabilisationPole> = (roots.iter())
        .filter(|root| root.norm_sqr() > 0.0)
        .filter_map(|&root| {
            let seen = map.pole(root);
            let pole = seen + settings.added_decay;
            let frequency = pole.norm() / TAU;
            let damping_ratio = -pole.re / pole.norm();
            let inside = (low..=high).contains(&(pole.im / TAU));
            let physical = pole.re < 0.0 && pole.im > 0.0 && damping_ratio < MOST_DAMPING;
            (inside && physical).then(|| StabilisationPole {
                order,
                pole,
                frequency,
                damping_ratio,
                participation: participation(coefficients, map.inverse_root(seen)),
                stability: PoleStability::New,
            })
        })
        .collect();
    poles.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    poles
}

/// The left null vector of A(z) at a pole: near it H = B A^{-1} is (B v) w^H/(s - p) with A v = 0 and
/// w^H A = 0, so that conj(w) says how much each input takes part.
fn participation(coefficients: &DMatrix<Complex64>, inverse_root: Complex64) -> Vec<Complex64> {
    let (size, inputs) = coefficients.shape();
    if inputs == 1 {
        return vec![Complex64::ONE];
    }
    // A(z) w^n = I w^n + A_1 w^{n-1} + ... + A_n, by Horner.
    let mut value = DMatrix::<Complex64>::identity(inputs, inputs);
    for block in 0..size / inputs {
        value *= inverse_root;
        value += coefficients.rows(block * inputs, inputs);
    }
    let svd = value.svd(true, false);
    let smallest = svd.singular_values.imin();
    let vector: Vec<Complex64> = svd.u.map_or_else(Vec::new, |u| {
        u.column(smallest).iter().map(Complex64::conj).collect()
    });
    // Turned so that the largest entry is real and positive.
    let mut largest = Complex64::ZERO;
    for value in &vector {
        if value.norm() > largest.norm() {
            largest = *value;
        }
    }
    let phase = largest.conj() / largest.norm().max(f64::MIN_POSITIVE);
    vector.into_iter().map(|value| value * phase).collect()
}

/// Largest relative change of the frequency from one order to the next at which a pole is stable. 1 %, as usual
/// in the field.
const FREQUENCY_TOLERANCE: f64 = 0.01;
/// Largest such change in half-power widths; the narrower of both limits holds. 0.25: at 0.1 % damping 1 % is five
/// half-power widths, within which another mode has room.
const HALF_POWER_TOLERANCE: f64 = 0.25;
/// Largest relative change of the damping ratio. 5 %, as usual in the field.
const DAMPING_TOLERANCE: f64 = 0.05;
/// Largest 1 - MAC of the participation vectors. 2 %, as usual in the field.
const PARTICIPATION_TOLERANCE: f64 = 0.02;
/// Least frequency tolerance (lines): what noise moves a pole narrower than a line.
const LEAST_TOLERANCE: f64 = 0.1;

fn stability(
    pole: &StabilisationPole,
    before: &[StabilisationPole],
    spacing: f64,
) -> PoleStability {
    let others = before.iter();
    let by_distance = others.map(|other| ((other.pole - pole.pole).norm(), other));
    let Some((_, nearest)) = by_distance.min_by(|a, b| a.0.total_cmp(&b.0)) else {
        return PoleStability::New;
    };
    let half_power = 2.0 * pole.damping_ratio * pole.frequency;
    let allowed = (FREQUENCY_TOLERANCE * pole.frequency)
        .min((HALF_POWER_TOLERANCE * half_power).max(LEAST_TOLERANCE * spacing));
    if (pole.frequency - nearest.frequency).abs() > allowed {
        return PoleStability::New;
    }
    let change = (pole.damping_ratio - nearest.damping_ratio).abs();
    let damping = change <= DAMPING_TOLERANCE * pole.damping_ratio;
    // 1 - MAC of the participation vectors, both of unit length.
    let entries = pole.participation.iter().zip(&nearest.participation);
    let product: Complex64 = entries.map(|(a, b)| a.conj() * b).sum();
    let vector = 1.0 - product.norm_sqr() <= PARTICIPATION_TOLERANCE;
    let several = pole.participation.len() > 1;
    match (damping, vector) {
        (true, true) => PoleStability::All,
        (true, false) => PoleStability::FrequencyAndDamping,
        (false, true) if several => PoleStability::FrequencyAndVector,
        (false, _) => PoleStability::Frequency,
    }
}

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
/// Number of times that the ridge is raised a hundredfold before the equations are given up.
const RIDGE_STEPS: i32 = 4;

/// Map of the band onto the unit circle: line k is at z_k = e^{j k step}.
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
            time: 1.0 / (transform as f64 * matrix.spacing),
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

    /// Inverse root w = 1/z of a pole, e^{-(p - j 2 pi f_first) T_a}.
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
    pub(super) fn new(matrix: &ResponseMatrix, map: &CircleMap, order: usize) -> Option<Self> {
        let inputs = matrix.inputs;
        let reduced = reduced_matrix(matrix, map, order)?;
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

/// Returns M for the highest order, unknown (power j, input i) at j * inputs + i.
fn reduced_matrix(
    matrix: &ResponseMatrix,
    map: &CircleMap,
    order: usize,
) -> Option<DMatrix<Complex64>> {
    let inputs = matrix.inputs;
    let columns = (order + 1) * inputs;
    let powers = order + 1 + 2 * EXTRA_POWERS;
    let mut sums = Sums::new(map.transform);
    let ones = vec![Complex64::ONE; matrix.points()];
    let lags = sums.at(&ones);
    // Hermitian Toeplitz matrix R, entry (j, k) at lag k - j.
    let numerator = DMatrix::from_fn(powers, powers, |j, k| at_lag(&lags, k as i64 - j as i64));
    let numerator = factorise(&numerator)?.unpack();
    let mut reduced = DMatrix::zeros(columns, columns);
    for output in 0..matrix.outputs {
        let row: Vec<&[Complex64]> = (0..inputs).map(|i| matrix.entry(output, i)).collect();
        // T of this output.
        for (i, left) in row.iter().enumerate() {
            for (k, right) in row.iter().enumerate() {
                let pairs = left.iter().zip(*right);
                let product: Vec<Complex64> = pairs.map(|(a, b)| a.conj() * b).collect();
                let lags = sums.at(&product);
                for q in 0..=order {
                    for p in 0..=order {
                        let entry = at_lag(&lags, q as i64 - p as i64);
                        reduced[(p * inputs + i, q * inputs + k)] += entry;
                    }
                }
            }
        }
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
        // Y^H Y with Y = L^{-1} S is S^H R^{-1} S; one side of the diagonal gives the other.
        let left: Vec<&[Complex64]> = mixed.as_slice().chunks_exact(powers).collect();
        for q in 0..columns {
            for p in 0..=q {
                let pairs = left[p].iter().zip(left[q]);
                let product: Complex64 = pairs.map(|(a, b)| a.conj() * b).sum();
                reduced[(p, q)] -= product;
                if p != q {
                    reduced[(q, p)] -= product.conj();
                }
            }
        }
    }
    Some(reduced)
}

/// Negative lags stand at the end of a transform.
fn at_lag(lags: &[Complex64], lag: i64) -> Complex64 {
    let place = if lag < 0 {
        lag + lags.len() as i64
    } else {
        lag
    };
    lags[place as usize]
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
