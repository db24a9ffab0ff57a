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
//! `roots` finds the roots of the matrix polynomial A that decay.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use nalgebra::{Cholesky, ComplexField, DMatrix, Dyn};
use num_complex::Complex64;
use rustfft::{Fft, FftPlanner};

use super::roots::decaying_roots;
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
    stabilise_on(&mut Circles::new(), matrix, settings)
}

/// As [`stabilise_poles`], with what bands of the same number of lines share.
pub(super) fn stabilise_on(
    circles: &mut Circles,
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
    let (low, high) = matrix.ends();
    let singular = PolyreferenceError::Singular { low, high };
    let circle = circles.on(matrix.points(), settings.order);
    let circle = circle.ok_or(singular.clone())?;
    let map = CircleMap::new(matrix, circle);
    let denominators = Denominators::new(matrix, circle, settings.order).ok_or(singular)?;
    let mut diagram: Vec<StabilisationPole> = Vec::new();
    let mut before: Vec<StabilisationPole> = Vec::new();
    let mut roots: Vec<Complex64> = Vec::new();
    for order in LEAST_ORDER..=settings.order {
        let Some(coefficients) = denominators.coefficients(order) else {
            (before, roots) = (Vec::new(), Vec::new());
            continue;
        };
        roots = decaying_roots(&coefficients, &roots);
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
    // The left null vector is that of the smallest eigenvalue of A A^H.
    let eigen = (&value * value.adjoint()).symmetric_eigen();
    let smallest = eigen.eigenvalues.imin();
    let vector: Vec<Complex64> = (eigen.eigenvectors.column(smallest).iter())
        .map(Complex64::conj)
        .collect();
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

/// Map of the band onto the unit circle: line k is at z_k = e^{j step (k - (K - 1)/2)}, K being the number of lines.
#[derive(Debug, Clone, Copy)]
struct CircleMap {
    /// Frequency in the middle of the band (Hz), at z = 1.
    middle: f64,
    /// Sampling time T_a of the discrete-time model (s): step/(2 pi spacing).
    time: f64,
}

impl CircleMap {
    fn new(matrix: &ResponseMatrix, circle: &Circle) -> Self {
        let (low, high) = matrix.ends();
        CircleMap {
            middle: 0.5 * (low + high),
            time: 1.0 / (circle.transform.len() as f64 * matrix.spacing),
        }
    }

    /// Pole (1/s) of the root w = 1/z: p = j 2 pi f_middle - ln(w)/T_a.
    fn pole(&self, inverse_root: Complex64) -> Complex64 {
        Complex64::new(0.0, TAU * self.middle) - inverse_root.ln() / self.time
    }

    /// Inverse root w = 1/z of a pole, e^{-(p - j 2 pi f_middle) T_a}.
    fn inverse_root(&self, pole: Complex64) -> Complex64 {
        (-(pole - Complex64::new(0.0, TAU * self.middle)) * self.time).exp()
    }
}

/// Denominator coefficients of every order, from one factorisation.
struct Denominators {
    inputs: usize,
    /// L of M = L L^H without the rows of A_0.
    factor: DMatrix<Complex64>,
    /// L^{-1} times the negative columns of A_0.
    reduced: DMatrix<Complex64>,
}

impl Denominators {
    /// `None` where the responses are all zero or the equations cannot be solved.
    fn new(matrix: &ResponseMatrix, circle: &mut Circle, order: usize) -> Option<Self> {
        let inputs = matrix.inputs;
        let reduced = reduced_matrix(matrix, circle, order)?;
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
    fn coefficients(&self, order: usize) -> Option<DMatrix<Complex64>> {
        let unknowns = order * self.inputs;
        let factor = self.factor.view((0, 0), (unknowns, unknowns));
        let mut solution = self.reduced.rows(0, unknowns).into_owned();
        factor
            .ad_solve_lower_triangular_mut(&mut solution)
            .then_some(solution)
    }
}

/// Cholesky factor with the smallest ridge that allows one. Only the lower triangle is read.
fn factorise<T: ComplexField<RealField = f64>>(matrix: &DMatrix<T>) -> Option<Cholesky<T, Dyn>> {
    let trace = matrix.trace().real();
    if !(trace.is_finite() && trace > 0.0) {
        return None;
    }
    (0..=RIDGE_STEPS).find_map(|step| {
        let mut raised = matrix.clone();
        let ridge = T::from_real(RIDGE * 100f64.powi(step) * trace);
        for index in 0..raised.nrows() {
            raised[(index, index)] += ridge.clone();
        }
        Cholesky::new(raised)
    })
}

/// Returns the lower triangle of M for the highest order, unknown (power j, input i) at j * inputs + i.
fn reduced_matrix(
    matrix: &ResponseMatrix,
    circle: &mut Circle,
    order: usize,
) -> Option<DMatrix<Complex64>> {
    let inputs = matrix.inputs;
    let columns = (order + 1) * inputs;
    let powers = circle.powers();
    let mut reduced = DMatrix::zeros(columns, columns);
    // Y = L^{-1} S, so that Y^H Y is S^H R^{-1} S, of all outputs: its real part, and Re(Y)' Im(Y).
    let mut real = DMatrix::zeros(columns, columns);
    let mut cross = DMatrix::zeros(columns, columns);
    for output in 0..matrix.outputs {
        let row: Vec<&[Complex64]> = (0..inputs).map(|i| matrix.entry(output, i)).collect();
        // T of this output.
        for (i, left) in row.iter().enumerate() {
            for (k, right) in row.iter().enumerate() {
                let lags = circle.sums(|line| left[line].conj() * right[line]);
                for q in 0..=order {
                    for p in q..=order {
                        let entry = lags[powers - 1 + q - p];
                        reduced[(p * inputs + i, q * inputs + k)] += entry;
                    }
                }
            }
        }
        let [mut mixed_real, mut mixed_imaginary] =
            [(); 2].map(|()| DMatrix::zeros(powers, columns));
        for (input, entry) in row.iter().enumerate() {
            let lags = circle.sums(|line| entry[line]);
            for power in 0..=order {
                // Row j stands for the numerator's power j - e.
                let lags = &lags[power + EXTRA_POWERS..][..powers];
                for (j, lag) in lags.iter().rev().enumerate() {
                    mixed_real[(j, power * inputs + input)] = lag.re;
                    mixed_imaginary[(j, power * inputs + input)] = lag.im;
                }
            }
        }
        for mixed in [&mut mixed_real, &mut mixed_imaginary] {
            let numerator = &circle.numerator;
            numerator.solve_lower_triangular_mut(mixed).then_some(())?;
        }
        let turned = mixed_real.transpose();
        real.gemm(1.0, &turned, &mixed_real, 1.0);
        real.gemm(1.0, &mixed_imaginary.transpose(), &mixed_imaginary, 1.0);
        cross.gemm(1.0, &turned, &mixed_imaginary, 1.0);
    }
    for q in 0..columns {
        for p in q..columns {
            let imaginary = cross[(p, q)] - cross[(q, p)];
            reduced[(p, q)] -= Complex64::new(real[(p, q)], imaginary);
        }
    }
    Some(reduced)
}

/// What follows from the number of lines and the order alone: bands between the peaks share it.
pub(super) struct Circle {
    points: usize,
    transform: Arc<dyn Fft<f64>>,
    scratch: Vec<Complex64>,
    /// z^lag of the first line, for all lags from 0 on.
    first: Vec<Complex64>,
    /// Cholesky factor of R.
    numerator: DMatrix<f64>,
}

/// The circles in use, and the plans of their transforms.
pub(super) struct Circles {
    all: Vec<Circle>,
    plans: FftPlanner<f64>,
}

impl Circles {
    pub(super) fn new() -> Self {
        Circles {
            all: Vec::new(),
            plans: FftPlanner::new(),
        }
    }

    /// Returns that of a band; `None` where its equations cannot be solved.
    fn on(&mut self, points: usize, order: usize) -> Option<&mut Circle> {
        let powers = order + 1 + 2 * EXTRA_POWERS;
        let mut known = self.all.iter();
        let known = known.position(|one| one.points == points && one.powers() == powers);
        let place = match known {
            Some(place) => place,
            None => {
                self.all.push(Circle::new(points, powers, &mut self.plans)?);
                self.all.len() - 1
            }
        };
        self.all.get_mut(place)
    }
}

impl Circle {
    fn new(points: usize, powers: usize, plans: &mut FftPlanner<f64>) -> Option<Self> {
        // Steps of the whole circle.
        let length = smallest_smooth_block((points as f64 / SHARE_OF_CIRCLE).ceil() as usize);
        let transform = plans.plan_fft_inverse(length);
        let half_step = PI / length as f64;
        let first = (0..powers).map(|lag| {
            let angle = points.saturating_sub(1) as f64 * lag as f64 * half_step;
            Complex64::from_polar(1.0, -angle)
        });
        // The lines lie about z = 1, so that R is real: sum_k z_k^lag = sin(K x)/sin(x) with x = lag step/2.
        let lags = (0..powers).map(|lag| match lag {
            0 => points as f64,
            _ => {
                let x = lag as f64 * half_step;
                (points as f64 * x).sin() / x.sin()
            }
        });
        let lags: Vec<f64> = lags.collect();
        let numerator = DMatrix::from_fn(powers, powers, |j, k| lags[j.abs_diff(k)]);
        Some(Circle {
            points,
            first: first.collect(),
            scratch: vec![Complex64::ZERO; transform.get_inplace_scratch_len()],
            transform,
            numerator: factorise(&numerator)?.unpack(),
        })
    }

    /// Number of powers of the numerator.
    fn powers(&self) -> usize {
        self.first.len()
    }

    /// Returns the sums over the lines of x_k z_k^lag, from minus the largest lag to the largest, as one inverse
    /// transform.
    fn sums(&mut self, value: impl Fn(usize) -> Complex64) -> Vec<Complex64> {
        let mut buffer = vec![Complex64::ZERO; self.transform.len()];
        for (line, place) in buffer[..self.points].iter_mut().enumerate() {
            *place = value(line);
        }
        self.transform
            .process_with_scratch(&mut buffer, &mut self.scratch);
        // Negative lags stand at the end of a transform.
        let negative = (1..self.first.len()).rev();
        let negative = negative.map(|lag| self.first[lag].conj() * buffer[buffer.len() - lag]);
        let positive = self.first.iter().zip(&buffer);
        let positive = positive.map(|(first, sum)| first * sum);
        negative.chain(positive).collect()
    }
}
