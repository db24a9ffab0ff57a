//! Variable projection: a least-squares fit that is nonlinear in the poles alone.
//!
//! # Function of one pole
//! Inside the fit a line stands at m (its frequency over the line spacing df), and a pole at
//! q = p/(2 pi df) = -decay + j position. With kappa = 2 pi/M, the transform of a decay
//! x(n) = Re(a z^n), z = e^{kappa q}, over its M samples (times 1/rate) is on the line m
//!
//! ```text
//! X(m) = b phi(m; q) + conj(b) phi(m; conj q),     phi(m; q) = kappa/(1 - e^{kappa (q - j m)}),
//! a = 2 b (2 pi df)/(1 - e^{2 pi q}),
//! ```
//!
//! because e^{-j kappa m M} = 1 on every line: the truncation is a factor of the amplitude and causes no
//! error. For a frequency response function phi = 1/(j m - q), and its residue is R = b (2 pi df).
//!
//! # Least squares
//! The model of the columns Y is Y = Phi(q) B. Phi has two real columns for each pole, B is free for every
//! column. With Phi = Q R the best B is R^-1 Q' Y. The residual Y - Q Q' Y depends on the poles alone
//! (Golub & Pereyra 1973). Its derivative is taken as -(I - Q Q') (dPhi/dq) B (Kaufman 1975). That is also
//! the Jacobian whose Gauss-Newton matrix is the information on the poles when all amplitudes are
//! unknown. Columns of a fixed part (neighbours, background) are projected out beforehand.

use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use tapjoint_numerics::least_squares::{Linearised, Problem, Settings, StopReason, minimise};

use super::{Basis, ModalData};
use crate::modal::{ROWS_AT_ONCE, Subspace, products};

/// Effective half width of a pole (lines): its decay, and half a line where that is less.
pub(super) fn half_width(pole: Complex64) -> f64 {
    pole.re.hypot(0.5)
}

/// Decay (lines) of a steady line: none, but not a pole on the axis, where its transform has no value.
pub(super) const STEADY: f64 = 1e-6;

/// Lines of one band.
#[derive(Debug, Clone)]
pub(super) struct Lines {
    /// Index of the band's first line in the data.
    pub first: usize,
    /// Step from one line to the next: 1 takes all, 2 every other one.
    pub stride: usize,
    /// Positions (lines).
    pub positions: Vec<f64>,
    /// 2 pi/M for free decays; `None` for frequency response functions.
    kappa: Option<f64>,
    /// Sine and cosine of kappa m/2 on every line m of decays.
    turns: Vec<(f64, f64)>,
}

impl Lines {
    /// Takes the lines of an index range, evenly thinned to `most` at most.
    pub fn new(data: &ModalData, range: Range<usize>, most: usize) -> Self {
        let stride = range.len().div_ceil(most).max(1);
        let frequencies = data.frequencies()[range.clone()].iter().step_by(stride);
        let positions: Vec<f64> = frequencies.map(|f| f / data.spacing()).collect();
        let kappa = match data.basis() {
            Basis::FreeDecay { samples, .. } => Some(TAU / samples as f64),
            Basis::FrequencyResponse { .. } => None,
        };
        // Functions have no turns.
        let turns = data.half_turns.get(range.clone()).unwrap_or_default();
        Lines {
            first: range.start,
            stride,
            turns: turns.iter().step_by(stride).copied().collect(),
            positions,
            kappa,
        }
    }

    /// Number of lines.
    pub fn count(&self) -> usize {
        self.positions.len()
    }

    /// Returns the real columns of the model, two for each pole.
    ///
    /// With b = b1 + j b2 the model is b1 (phi + image) + b2 j (phi - image), where `image` is phi of the
    /// conjugate pole. Rows are the real parts of all lines, then the imaginary parts.
    pub fn model(&self, poles: &[Complex64]) -> DMatrix<f64> {
        self.columns::<0>(poles)
    }

    /// Returns the columns u = phi' + image' and v = j (phi' - image') of each pole, phi' = d phi/dq.
    ///
    /// ```text
    /// d model/d position = b1 v - b2 u,     d model/d decay = -(b1 u + b2 v)
    /// ```
    pub fn slopes(&self, poles: &[Complex64]) -> DMatrix<f64> {
        self.columns::<1>(poles)
    }

    /// Returns the columns of the first three derivatives of a pole's function: about all that a second pole nearby adds.
    pub fn derivatives(&self, pole: Complex64) -> [DMatrix<f64>; 3] {
        [
            self.columns::<1>(&[pole]),
            self.columns::<2>(&[pole]),
            self.columns::<3>(&[pole]),
        ]
    }

    /// Returns sum and turned difference of each pole's function and its image, or of their derivatives.
    fn columns<const DERIVATIVE: usize>(&self, poles: &[Complex64]) -> DMatrix<f64> {
        let count = self.count();
        let mut columns = DMatrix::zeros(2 * count, 2 * poles.len());
        let of_poles = columns.as_mut_slice().chunks_exact_mut(4 * count);
        for (pole, columns) in poles.iter().zip(of_poles) {
            match self.kappa {
                Some(kappa) => self.fill_decay::<DERIVATIVE>(kappa, *pole, columns),
                None => self.fill_function::<DERIVATIVE>(*pole, columns),
            }
        }
        columns
    }

    /// Fills the two columns of a pole of decays.
    ///
    /// With u = kappa (q - j m) = x + j y and phi = kappa/(1 - e^u), coth(u/2) = (sinh x - j sin y)/(cosh x - cos y) gives
    /// phi = (kappa/2) (1 - coth(u/2)). The difference of cosines loses its digits near the pole, and the sum
    /// cosh x - cos y = 2 sinh^2(x/2) + 2 sin^2(y/2) keeps them.
    fn fill_decay<const DERIVATIVE: usize>(
        &self,
        kappa: f64,
        pole: Complex64,
        columns: &mut [f64],
    ) {
        let half = 0.5 * kappa;
        let (grown, versed) = ((kappa * pole.re).sinh(), (half * pole.re).sinh().powi(2));
        let (sine, cosine) = (half * pole.im).sin_cos();
        let function = |half_sin: f64, half_cos: f64| {
            let part = half / (2.0 * (versed + half_sin * half_sin));
            let value = Complex64::new(half - part * grown, 2.0 * part * half_sin * half_cos);
            derivative::<DERIVATIVE>(value, kappa)
        };
        let (own_real, rest) = columns.split_at_mut(self.count());
        let (own_imaginary, rest) = rest.split_at_mut(self.count());
        let (turned_real, turned_imaginary) = rest.split_at_mut(self.count());
        for (line, (&m, &(s, c))) in self.positions.iter().zip(&self.turns).enumerate() {
            let angle = half * (pole.im - m);
            // Near the pole the difference of two turns has few digits.
            let (half_sin, half_cos) = match angle.abs() <= EIGHTH {
                true => small_sin_cos(angle),
                false => (sine * c - cosine * s, cosine * c + sine * s),
            };
            let own = function(half_sin, half_cos);
            // The angles add up on the side of the image, kappa (-position - m)/2.
            let image = function(-(sine * c + cosine * s), cosine * c - sine * s);
            own_real[line] = own.re + image.re;
            own_imaginary[line] = own.im + image.im;
            turned_real[line] = image.im - own.im;
            turned_imaginary[line] = own.re - image.re;
        }
    }

    /// Fills the two columns of a pole of frequency response functions: phi = 1/(j m - q).
    fn fill_function<const DERIVATIVE: usize>(&self, pole: Complex64, columns: &mut [f64]) {
        let function = |distance: Complex64| derivative::<DERIVATIVE>(distance.inv(), 0.0);
        let count = self.count();
        for (line, &m) in self.positions.iter().enumerate() {
            let m = Complex64::new(0.0, m);
            let (own, image) = (function(m - pole), function(m - pole.conj()));
            let turned = Complex64::i() * (own - image);
            columns[line] = (own + image).re;
            columns[line + count] = (own + image).im;
            columns[line + 2 * count] = turned.re;
            columns[line + 3 * count] = turned.im;
        }
    }

    /// Returns the columns of these terms of a complex polynomial over the band: its powers of the frequency.
    ///
    /// It stands for everything that lies outside the band.
    pub fn polynomial(&self, terms: Range<usize>) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(2 * self.count(), 2 * terms.len());
        let low = self.positions.first().copied().unwrap_or(0.0);
        let high = self.positions.last().copied().unwrap_or(1.0);
        for (line, m) in self.positions.iter().enumerate() {
            let place = (2.0 * m - low - high) / (high - low).max(f64::MIN_POSITIVE);
            for (column, term) in terms.clone().enumerate() {
                let value = place.powi(term as i32);
                columns[(line, 2 * column)] = value;
                columns[(line + self.count(), 2 * column + 1)] = value;
            }
        }
        columns
    }
}

/// Returns a derivative of phi with respect to q, up to the third. Its first is e^u phi^2 = phi (phi - kappa) of decays, and
/// phi^2 of functions, for which `kappa` is 0.
fn derivative<const ORDER: usize>(phi: Complex64, kappa: f64) -> Complex64 {
    if ORDER == 0 {
        return phi;
    }
    let first = phi * (phi - kappa);
    let second = (2.0 * phi - kappa) * first;
    match ORDER {
        1 => first,
        2 => second,
        _ => 2.0 * first * first + (2.0 * phi - kappa) * second,
    }
}

/// Angle (rad) up to which [`small_sin_cos`] is exact to rounding.
const EIGHTH: f64 = 0.125;

/// Returns sine and cosine of an angle up to [`EIGHTH`] by the first terms of their series, as exact as the functions. The
/// next terms are angle^11/11! and angle^12/12!: 3e-18 and 3e-20.
fn small_sin_cos(angle: f64) -> (f64, f64) {
    let square = angle * angle;
    let sine = 1.0 / 5040.0 - square * (1.0 / 362_880.0);
    let sine = 1.0 / 6.0 - square * (1.0 / 120.0 - square * sine);
    let cosine = 1.0 / 40_320.0 - square * (1.0 / 3_628_800.0);
    let cosine = 0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0 - square * cosine));
    (angle - angle * square * sine, 1.0 - square * cosine)
}

/// Least remainder of a fixed column beside the columns before it, relative to its length. A column with
/// less is left out: the others contain it already.
const DISTINCT: f64 = 1e-5;

/// Lines, fixed part (neighbours and background), and the columns of the data without the fixed part.
#[derive(Debug, Clone)]
pub(super) struct PoleProblem {
    pub lines: Arc<Lines>,
    pub fixed: Subspace<f64>,
    pub columns: DMatrix<f64>,
}

/// Solution for the amplitudes at given poles.
#[derive(Debug, Clone)]
pub(super) struct Evaluation {
    pub poles: Vec<Complex64>,
    /// Sum of the squares of the residual over all columns.
    pub square_sum: f64,
    /// Sum of the squares of the residual of each column.
    pub column_squares: Vec<f64>,
    /// Amplitudes: rows b1, b2 of each pole.
    pub amplitudes: DMatrix<f64>,
    /// Inverse of R.
    pub inverse: DMatrix<f64>,
    /// Q.
    orthonormal: DMatrix<f64>,
}

/// Slopes of the residual, contracted to what the search and the covariance need.
#[derive(Debug, Clone)]
pub(super) struct Slopes {
    /// Gauss-Newton matrix J'J; the order is position, decay of each pole.
    pub information: DMatrix<f64>,
    /// J'r.
    gradient: DVector<f64>,
    /// Change of the amplitudes with each parameter (rows b1, b2 of each pole; columns of the data).
    pub amplitude_slopes: Vec<DMatrix<f64>>,
}

impl Slopes {
    /// Covariance of position and decay of all poles (lines squared) at this noise variance.
    ///
    /// `None` where two poles cannot be separated.
    pub fn covariance(&self, variance: f64) -> Option<DMatrix<f64>> {
        let factor = self.information.clone().cholesky()?;
        Some(factor.inverse() * variance)
    }
}

/// Poles of the least residual.
pub(super) struct BestPoles {
    pub at: Evaluation,
    pub slopes: Slopes,
    pub stop: StopReason,
}

impl PoleProblem {
    /// Solves for the amplitudes; `None` where the poles' columns are not independent.
    pub fn amplitudes_at(&self, poles: &[Complex64]) -> Option<Evaluation> {
        let (orthonormal, upper) = self.orthonormalised(poles)?;
        let count = upper.nrows();
        let inverse = upper.solve_upper_triangular(&DMatrix::identity(count, count))?;
        let (shares, column_squares) = self.shares(&orthonormal);
        let square_sum: f64 = column_squares.iter().sum();
        square_sum.is_finite().then(|| Evaluation {
            poles: poles.to_vec(),
            square_sum,
            column_squares,
            amplitudes: &inverse * shares,
            inverse,
            orthonormal,
        })
    }

    /// Returns the sum of the squares that poles leave of each column; `None` where their columns are not independent.
    pub fn squares_at(&self, poles: &[Complex64]) -> Option<Vec<f64>> {
        let (orthonormal, _) = self.orthonormalised(poles)?;
        Some(self.shares(&orthonormal).1)
    }

    /// Returns Q and R of the poles' columns without the fixed part; `None` where they are not independent.
    fn orthonormalised(&self, poles: &[Complex64]) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let mut model = self.fixed.complement(self.lines.model(poles));
        let count = model.ncols();
        if model.nrows() < count {
            return None;
        }
        let mut upper = DMatrix::zeros(count, count);
        for column in 0..count {
            let length = model.column(column).norm();
            // The second pass removes the rounding of nearly dependent columns.
            for _ in 0..2 {
                for other in 0..column {
                    let (before, mut own) = model.columns_range_pair_mut(other, column);
                    let share = before.dot(&own);
                    own.axpy(-share, &before, 1.0);
                    upper[(other, column)] += share;
                }
            }
            let remains = model.column(column).norm();
            if !(length.is_finite() && remains > 1e-9 * length) {
                return None;
            }
            model.column_mut(column).scale_mut(remains.recip());
            upper[(column, column)] = remains;
        }
        Some((model, upper))
    }

    /// Returns Q'Y, and the sum of the squares of each column of Y - Q Q'Y.
    fn shares(&self, orthonormal: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
        let shares = products(orthonormal, &self.columns);
        let mut squares = vec![0.0; self.columns.ncols()];
        let mut rest = DVector::zeros(ROWS_AT_ONCE.min(self.columns.nrows()));
        for first in (0..self.columns.nrows()).step_by(ROWS_AT_ONCE) {
            let rows = ROWS_AT_ONCE.min(self.columns.nrows() - first);
            let (directions, columns) = (
                orthonormal.rows(first, rows),
                self.columns.rows(first, rows),
            );
            let mut rest = rest.rows_mut(0, rows);
            let pairs = columns.column_iter().zip(shares.column_iter());
            for (square, (column, shares)) in squares.iter_mut().zip(pairs) {
                rest.copy_from(&column);
                for (direction, share) in directions.column_iter().zip(shares.iter()) {
                    rest.axpy(-share, &direction, 1.0);
                }
                *square += rest.norm_squared();
            }
        }
        (shares, squares)
    }

    /// Returns the residual at an evaluation, a column for each of the data.
    pub fn residual(&self, at: &Evaluation) -> DMatrix<f64> {
        let mut residual = self.columns.clone();
        let shares = products(&at.orthonormal, &self.columns);
        residual.gemm(-1.0, &at.orthonormal, &shares, 1.0);
        residual
    }

    /// Returns the problem with more columns in its fixed part.
    pub fn beside(&self, more: &DMatrix<f64>) -> PoleProblem {
        let added = self.fixed.added(more, DISTINCT);
        PoleProblem {
            lines: Arc::clone(&self.lines),
            columns: added.complement(self.columns.clone()),
            fixed: self.fixed.with(&added),
        }
    }

    /// Returns the slopes at an evaluation, and their products with the residual of `data`.
    ///
    /// The slope columns are orthogonal to Q and to the fixed part. So their products with the data are those with the
    /// residual, even where the data hold a fixed part.
    fn slopes(&self, at: &Evaluation, data: &DMatrix<f64>) -> Slopes {
        let mut raw = self.fixed.complement(self.lines.slopes(&at.poles));
        let along = at.orthonormal.tr_mul(&raw);
        raw.gemm(-1.0, &at.orthonormal, &along, 1.0);
        let squares = raw.tr_mul(&raw);
        let with_data = products(&raw, data);
        let mixes = mixes(&at.amplitudes);
        let parameters = mixes.len();
        let mut information = DMatrix::zeros(parameters, parameters);
        let mut gradient = DVector::zeros(parameters);
        for (a, left) in mixes.iter().enumerate() {
            let rows = with_data.rows(2 * (a / 2), 2);
            // The residual is data less model: its derivatives are those of the model, negative.
            gradient[a] = -rows.component_mul(left).sum();
            for (b, right) in mixes.iter().enumerate().take(a + 1) {
                let weights = left * right.transpose();
                let block = squares.view((2 * (a / 2), 2 * (b / 2)), (2, 2));
                let value = block.component_mul(&weights).sum();
                information[(a, b)] = value;
                information[(b, a)] = value;
            }
        }
        let back = &at.inverse * along;
        let amplitude_slopes = mixes
            .iter()
            .enumerate()
            .map(|(a, mix)| -(back.columns(2 * (a / 2), 2) * mix))
            .collect();
        Slopes {
            information,
            gradient,
            amplitude_slopes,
        }
    }

    /// Returns the part of its first amplitude at which a mode whose frequency changes a little, in proportion to its
    /// amplitude, has the frequency that the fit finds; `None` of functions, and where no part between 0 and 1 fits.
    ///
    /// A frequency that is higher by d s e^{-s t} turns the phase by d (1 - e^{-s t}): to first order the decay gains
    /// j d a (e^{p t} - e^{(p - s) t}). Gauss and Newton's step to these data moves the pole by the part times d s.
    pub fn amplitude_part(&self, best: &Evaluation, place: usize) -> Option<f64> {
        self.lines.kappa?;
        let pole = best.poles[place];
        let faster = Complex64::new(2.0 * pole.re, pole.im);
        // Both begin with one amplitude; see the factor of the truncation above.
        let ratio = (1.0 - (TAU * faster).exp()) / (1.0 - (TAU * pole).exp());
        let amplitudes = DMatrix::from_fn(4, self.columns.ncols(), |row, column| {
            let b = Complex64::new(
                best.amplitudes[(2 * place, column)],
                best.amplitudes[(2 * place + 1, column)],
            );
            let turned = Complex64::i() * b;
            let value = if row < 2 { turned } else { -turned * ratio };
            if row % 2 == 0 { value.re } else { value.im }
        });
        let gained = self.lines.model(&[pole, faster]) * amplitudes;
        let slopes = self.slopes(best, &gained);
        let step = slopes.information.cholesky()?.solve(&-slopes.gradient);
        let part = step[2 * place] / -pole.re;
        (part > 0.0 && part < 1.0).then_some(part)
    }

    /// Minimises the residual from `start` with at most `steps` steps.
    ///
    /// `freedom` are the degrees of freedom of the residual. `None` where the poles' columns or their
    /// slopes are not independent.
    pub fn search(&self, start: &[Complex64], freedom: f64, steps: usize) -> Option<BestPoles> {
        // A step of x standard deviations, sqrt(s^2 (J'J)^-1) with s^2 = 2 cost/freedom, lowers the cost by
        // x^2 cost/freedom. The last step is one of a thousandth.
        let settings = Settings {
            steps,
            gain: 0.5e-24 * self.columns.norm_squared(),
            relative_gain: 1e-6 / freedom.max(1.0),
            // An undamped first step is too long where two poles begin at one resonance.
            first_damping: 1e-4,
            ..Settings::default()
        };
        let start: Vec<f64> = start.iter().flat_map(|pole| [pole.im, -pole.re]).collect();
        let end = minimise(self, &start, &settings)?;
        let (at, slopes) = end.state;
        let slopes = slopes.filter(|slopes| slopes.covariance(1.0).is_some())?;
        Some(BestPoles {
            at,
            slopes,
            stop: end.stop,
        })
    }
}

impl Problem for PoleProblem {
    type State = (Evaluation, Option<Slopes>);

    fn evaluate(&self, parameters: &[f64], from: Option<&Self::State>) -> Option<Self::State> {
        // From poles that cannot be separated a damped step would throw one of them away: the search ends.
        let slopes = from.and_then(|(_, slopes)| slopes.as_ref());
        if slopes.is_some_and(|slopes| slopes.covariance(1.0).is_none()) {
            return None;
        }
        let poles: Vec<Complex64> = parameters
            .chunks_exact(2)
            .map(|pole| Complex64::new(-pole[1], pole[0]))
            .collect();
        Some((self.amplitudes_at(&poles)?, None))
    }

    fn cost(&self, state: &Self::State) -> f64 {
        0.5 * state.0.square_sum
    }

    fn linearise(&self, _: &[f64], state: &mut Self::State) -> Option<Linearised> {
        let slopes = state.1.insert(self.slopes(&state.0, &self.columns));
        Some(Linearised::Normal {
            curvature: slopes.information.clone(),
            gradient: slopes.gradient.clone(),
        })
    }

    /// Poles stay in the upper half plane. Those of functions move by no more than their half width in a step: beyond
    /// it the slopes say nothing, and among many modes a pole is thrown out of its resonance.
    fn moved(&self, parameters: &[f64], step: &DVector<f64>) -> Option<Vec<f64>> {
        let moved: Vec<f64> = parameters.iter().zip(step).map(|(x, by)| x + by).collect();
        let allowed = moved.iter().all(|x| x.is_finite())
            && moved.iter().step_by(2).all(|position| *position > 0.0);
        let bounded = self.lines.kappa.is_some()
            || parameters.chunks_exact(2).enumerate().all(|(place, pole)| {
                let step = step[2 * place].hypot(step[2 * place + 1]);
                step <= half_width(Complex64::new(-pole[1], pole[0]))
            });
        (allowed && bounded).then_some(moved)
    }
}

/// Weights by which a pole's slope columns u and v form the change of the model, for each parameter.
///
/// Rows are u, v; columns those of the data. Position: -b2, b1. Decay: -b1, -b2.
fn mixes(amplitudes: &DMatrix<f64>) -> Vec<DMatrix<f64>> {
    let columns = amplitudes.ncols();
    (0..amplitudes.nrows())
        .map(|parameter| {
            let first = parameter - parameter % 2;
            let (b1, b2) = (amplitudes.row(first), amplitudes.row(first + 1));
            DMatrix::from_fn(2, columns, |row, column| match (parameter % 2, row) {
                (0, 0) => -b2[column],
                (0, _) => b1[column],
                (_, 0) => -b1[column],
                (_, _) => -b2[column],
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modal::fit::Column;

    fn lines(basis: Basis) -> Lines {
        let frequencies: Vec<f64> = (20..40).map(f64::from).collect();
        let values = vec![Complex64::ONE; frequencies.len()];
        let column = Column {
            tap: 0,
            sensor: 0,
            values,
        };
        let data = ModalData::new(basis, frequencies, vec![column]).unwrap();
        Lines::new(&data, 0..20, usize::MAX)
    }

    const DECAY: Basis = Basis::FreeDecay {
        sample_rate: 100.0,
        samples: 100,
    };
    const RESPONSE: Basis = Basis::FrequencyResponse { resolution: 1.0 };

    #[test]
    fn limit_the_model_is_the_transform_of_a_sampled_decay() {
        let (pole, amplitude) = (Complex64::new(-0.2, 30.3), Complex64::new(0.7, -1.1));
        let lines = lines(DECAY);
        // b = a (1 - e^{pT})/(2 2 pi df), all in lines; df = 1 Hz, T = 1 s.
        let b = amplitude * (1.0 - (TAU * pole).exp()) / (2.0 * TAU);
        let model = lines.model(&[pole]);
        for (row, m) in lines.positions.iter().enumerate() {
            let transform: Complex64 = (0..100)
                .map(|n| {
                    let time = f64::from(n) / 100.0;
                    let x = (amplitude * (TAU * pole * time).exp()).re;
                    x * Complex64::from_polar(0.01, -TAU * m * time)
                })
                .sum();
            let imaginary = row + lines.count();
            let fitted = Complex64::new(
                b.re * model[(row, 0)] + b.im * model[(row, 1)],
                b.re * model[(imaginary, 0)] + b.im * model[(imaginary, 1)],
            );
            // Rounding of a sum of a hundred terms.
            assert!((fitted - transform).norm() < 1e-12, "line {m}");
        }
    }

    #[test]
    fn limit_small_angles_have_the_sine_and_cosine_of_all_others() {
        for step in -1250..=1250 {
            let angle = f64::from(step) * 1e-4;
            let ((sine, cosine), exact) = (small_sin_cos(angle), angle.sin_cos());
            assert!((sine - exact.0).abs() <= 2.0 * f64::EPSILON * exact.0.abs());
            assert!((cosine - exact.1).abs() <= f64::EPSILON);
        }
    }

    /// Along the real axis, in which phi is analytic.
    #[test]
    fn prop_each_derivative_is_the_difference_of_the_one_before() {
        let (pole, step) = (Complex64::new(-0.4, 29.6), 1e-5);
        for basis in [DECAY, RESPONSE] {
            let lines = lines(basis);
            let orders = |by: f64| {
                let pole = pole + by;
                let [first, second, third] = lines.derivatives(pole);
                [lines.model(&[pole]), first, second, third]
            };
            let (above, below, here) = (orders(step), orders(-step), orders(0.0));
            for order in 0..3 {
                let difference = (&above[order] - &below[order]) / (2.0 * step);
                let error = (difference - &here[order + 1]).norm() / here[order + 1].norm();
                // Two orders higher over six: 20/6 of (step/distance)^2 at most, and the distance is 0.4 lines or more.
                assert!(error < 1e-8, "{basis:?} {order}: {error:e}");
            }
        }
    }

    #[test]
    fn prop_the_slopes_are_differences_of_the_model() {
        let pole = Complex64::new(-0.4, 29.6);
        let step = 1e-6;
        for basis in [DECAY, RESPONSE] {
            let lines = lines(basis);
            let slopes = lines.slopes(&[pole]);
            let difference = |by: Complex64| {
                (lines.model(&[pole + by]) - lines.model(&[pole - by])) / (2.0 * step)
            };
            let position = difference(Complex64::new(0.0, step));
            let decay = difference(Complex64::new(-step, 0.0));
            let (u, v) = (slopes.column(0), slopes.column(1));
            // Second differences of order one over the step squared: 10^-9 at most.
            for (found, expected) in [
                (position.column(0), v.into_owned()),
                (position.column(1), -u.into_owned()),
                (decay.column(0), -u.into_owned()),
                (decay.column(1), -v.into_owned()),
            ] {
                assert!((found - expected).norm() < 1e-7, "{basis:?}");
            }
        }
    }
}
