//! Variable projection: least squares that is nonlinear in the poles alone.
//!
//! Model of the columns Y: Y = Phi(q) B, Phi two real columns for each pole, B free for every column.
//! With Phi = Q R the best B is R^-1 Q' Y, and what remains, Y - Q Q' Y, depends on the poles alone
//! (Golub & Pereyra 1973). Its derivative is taken as -(I - Q Q') (dPhi/dq) B (Kaufman 1975), which is
//! also the Jacobian whose Gauss-Newton matrix is the information on the poles when all amplitudes
//! are unknown. Columns of a fixed part (neighbours, background) are projected out beforehand.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::function::Lines;

/// Why the search for the poles ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The next step was a thousandth of a standard deviation or less.
    Converged,
    /// No step makes the residual smaller.
    NoBetterStep,
    /// The limit of steps was reached before that.
    StepLimit,
}

/// Orthonormal columns of the fixed part.
#[derive(Debug, Clone)]
pub(super) struct Fixed {
    columns: DMatrix<f64>,
}

/// What must remain of a fixed column beside the columns before it, relative to its length, for it
/// to count: below that its contribution is in them already.
const DISTINCT: f64 = 1e-5;

impl Fixed {
    /// Gram and Schmidt, twice; columns that depend on earlier ones are left out.
    pub fn new(raw: &DMatrix<f64>) -> Self {
        let mut kept: Vec<DVector<f64>> = Vec::new();
        for column in raw.column_iter() {
            let length = column.norm();
            if length.is_nan() || length <= 0.0 {
                continue;
            }
            let mut rest = column / length;
            for _ in 0..2 {
                for other in &kept {
                    let share = other.dot(&rest);
                    rest.axpy(-share, other, 1.0);
                }
            }
            let remains = rest.norm();
            if remains > DISTINCT && kept.len() + 1 < raw.nrows() {
                kept.push(rest / remains);
            }
        }
        let columns = DMatrix::from_fn(raw.nrows(), kept.len(), |row, column| kept[column][row]);
        Fixed { columns }
    }

    /// Number of independent columns.
    pub fn rank(&self) -> usize {
        self.columns.ncols()
    }

    /// Takes the fixed part out.
    pub fn project(&self, matrix: &mut DMatrix<f64>) {
        if self.rank() > 0 {
            let shares = self.columns.tr_mul(matrix);
            matrix.gemm(-1.0, &self.columns, &shares, 1.0);
        }
    }
}

/// One problem: the lines, the fixed part, and the columns with the fixed part taken out.
pub(super) struct Problem<'a> {
    pub lines: &'a Lines,
    pub fixed: &'a Fixed,
    pub columns: DMatrix<f64>,
}

/// The problem at given poles.
#[derive(Debug, Clone)]
pub(super) struct Evaluation {
    pub poles: Vec<Complex64>,
    /// Sum of the squares of the residual.
    pub square_sum: f64,
    /// What the model leaves, a column for each of the data.
    pub residual: DMatrix<f64>,
    /// Amplitudes: rows b1, b2 of each pole.
    pub amplitudes: DMatrix<f64>,
    /// Inverse of R.
    pub inverse: DMatrix<f64>,
    orthonormal: DMatrix<f64>,
}

/// Slopes of the residual, folded: everything the search and the covariance need.
#[derive(Debug, Clone)]
pub(super) struct Slopes {
    /// Gauss-Newton matrix; the order is position, decay of each pole.
    pub information: DMatrix<f64>,
    /// J' r.
    pub gradient: DVector<f64>,
    /// Change of the amplitudes with the poles (rows b1, b2 of each pole; columns of the data), for
    /// each parameter.
    pub amplitude_slopes: Vec<DMatrix<f64>>,
}

impl Problem<'_> {
    /// Solves for the amplitudes; `None` where the poles' columns are not independent.
    pub fn evaluate(&self, poles: &[Complex64]) -> Option<Evaluation> {
        let mut model = self.lines.model(poles);
        self.fixed.project(&mut model);
        let lengths: Vec<f64> = model.column_iter().map(|column| column.norm()).collect();
        let (orthonormal, upper) = model.qr().unpack();
        let sound = lengths
            .iter()
            .enumerate()
            .all(|(i, length)| length.is_finite() && upper[(i, i)].abs() > 1e-9 * length);
        if !sound || upper.nrows() != upper.ncols() {
            return None;
        }
        let inverse =
            upper.solve_upper_triangular(&DMatrix::identity(upper.nrows(), upper.ncols()))?;
        let shares = orthonormal.tr_mul(&self.columns);
        let mut residual = self.columns.clone();
        residual.gemm(-1.0, &orthonormal, &shares, 1.0);
        let square_sum = residual.norm_squared();
        square_sum.is_finite().then(|| Evaluation {
            poles: poles.to_vec(),
            square_sum,
            amplitudes: &inverse * shares,
            residual,
            inverse,
            orthonormal,
        })
    }

    /// Slopes at an evaluation.
    pub fn slopes(&self, at: &Evaluation) -> Slopes {
        let (_, mut raw) = self.lines.columns(&at.poles);
        self.fixed.project(&mut raw);
        let along = at.orthonormal.tr_mul(&raw);
        raw.gemm(-1.0, &at.orthonormal, &along, 1.0);
        let products = raw.tr_mul(&raw);
        let with_residual = raw.tr_mul(&at.residual);
        let mixes = mixes(&at.amplitudes);
        let parameters = mixes.len();
        let mut information = DMatrix::zeros(parameters, parameters);
        let mut gradient = DVector::zeros(parameters);
        for (a, left) in mixes.iter().enumerate() {
            let rows = with_residual.rows(2 * (a / 2), 2);
            gradient[a] = rows.component_mul(left).sum();
            for (b, right) in mixes.iter().enumerate().take(a + 1) {
                let weights = left * right.transpose();
                let block = products.view((2 * (a / 2), 2 * (b / 2)), (2, 2));
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

    /// Levenberg and Marquardt from `start`, at most `most` steps; `freedom` are the degrees of freedom
    /// of the residual.
    pub fn search(
        &self,
        start: &[Complex64],
        freedom: f64,
        most: usize,
    ) -> Option<(Evaluation, StopReason)> {
        let mut at = self.evaluate(start)?;
        let mut damping = 1e-4;
        for _ in 0..most {
            let slopes = self.slopes(&at);
            // Standard deviations are sqrt(s^2 (J'J)^-1): this is the squared step in their unit.
            let variance = at.square_sum / freedom.max(1.0);
            let floor = 1e-24 * self.columns.norm_squared();
            let full = slopes.information.clone().cholesky()?;
            let decrease = slopes.gradient.dot(&full.solve(&slopes.gradient));
            let near = decrease <= 1e-6 * variance || decrease <= floor;
            match self.step(&at, &slopes, &mut damping) {
                Some(next) => at = next,
                None if near => return Some((at, StopReason::Converged)),
                None => return Some((at, StopReason::NoBetterStep)),
            }
            if near {
                return Some((at, StopReason::Converged));
            }
        }
        Some((at, StopReason::StepLimit))
    }

    /// The first step that makes the residual smaller, with ever more damping.
    fn step(&self, at: &Evaluation, slopes: &Slopes, damping: &mut f64) -> Option<Evaluation> {
        const TRIALS: usize = 12;
        for _ in 0..TRIALS {
            let mut matrix = slopes.information.clone();
            for i in 0..matrix.nrows() {
                matrix[(i, i)] *= 1.0 + *damping;
            }
            let step = matrix
                .cholesky()
                .map(|factor| factor.solve(&slopes.gradient));
            let next = step.and_then(|step| self.evaluate(&moved(&at.poles, &step)?));
            if let Some(next) = next.filter(|next| next.square_sum <= at.square_sum) {
                *damping = (*damping * 0.1).max(1e-12);
                return Some(next);
            }
            *damping *= 10.0;
        }
        None
    }
}

/// The poles after a step; `None` where one would leave the upper half plane.
fn moved(poles: &[Complex64], step: &DVector<f64>) -> Option<Vec<Complex64>> {
    poles
        .iter()
        .enumerate()
        .map(|(k, pole)| {
            let next = pole + Complex64::new(-step[2 * k + 1], step[2 * k]);
            (next.is_finite() && next.im > 0.0).then_some(next)
        })
        .collect()
}

/// How the slope columns (u, v) of a pole combine into the change of the model, for each parameter
/// (rows u, v; columns of the data): position -b2, b1; decay -b1, -b2.
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
