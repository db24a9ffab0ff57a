//! Synthesis of frequency response functions: what given poles explain of measured functions.
//!
//! # Equation
//! With s = j omega + a the function of modes at the poles p is
//!
//! ```text
//! H(s) = s^k ( sum (R/(s - p) + conj(R)/(s - conj p)) + U + L/s^2 )
//! ```
//!
//! - k is 0 for a receptance (m/N), 1 for a mobility, 2 for an accelerance.
//! - p is a pole (rad/s), R its residue (unit of the receptance times rad/s).
//! - U stands for modes above the lines, far below whose frequencies they are springs (m/N: the stiffness line).
//! - L stands for modes below the lines, far above whose frequencies they are masses (1/kg: the mass line). A rigid body
//!   has L = 1/m.
//! - a is the decay that an exponential window added to force and response (1/s), 0 without one.
//!
//! # Least squares
//! The poles are known. R, U and L of each function are those of the least sum of |H measured - H|^2 over the lines,
//! without weights. U and L are complex: damped modes outside the lines and a delay of the sensor turn their phase.
//! What the curve leaves is therefore the least that any residues at these poles can leave.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::recording::ResponseForm;

/// Most lines that are factorised at once: a bound on memory. The factors of earlier lines are carried along.
const MOST_LINES: usize = 2048;
/// Least singular value that counts, relative to the largest, with all columns of length 1. Below it two poles are one for
/// these lines, and their residues are the smallest that give the curve.
const DISTINCT: f64 = 1e-10;
/// Steps in which the singular values are found, at most: many more than any finite matrix needs.
const MOST_STEPS: usize = 100_000;

/// Poles and lines of a synthesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SynthesisLines<'a> {
    /// Frequencies of the lines (Hz), positive and ascending.
    pub frequencies: &'a [f64],
    /// Poles (rad/s), negative decay + j angular frequency, without the decay of a window.
    pub poles: &'a [Complex64],
    /// Decay that an exponential window added to force and response (1/s).
    pub added_decay: f64,
}

/// What poles explain of one function.
#[derive(Debug, Clone, PartialEq)]
pub struct Synthesis {
    /// Form of the function, which decides on the terms of modes outside the lines.
    pub form: ResponseForm,
    /// Residue R of each pole (unit of the receptance times rad/s).
    pub residues: Vec<Complex64>,
    /// Term U of the modes above the lines (unit of the receptance).
    pub upper: Complex64,
    /// Term L of the modes below the lines (unit of the receptance times (rad/s)^2).
    pub lower: Complex64,
    /// The curve on each line (unit of the function).
    pub values: Vec<Complex64>,
    /// Share of the function's power on the lines that the curve leaves (1): sum |H measured - H|^2/sum |H measured|^2.
    pub left: f64,
}

impl SynthesisLines<'_> {
    /// Fits residues and residual terms to measured `functions`, each with a value on every line.
    ///
    /// `forms` are those of the functions. A function without a known form gets the form that leaves least. The result
    /// is `None` for a function that is zero or no number on some line, and for all where the lines are too few.
    pub fn synthesise(
        &self,
        functions: &[&[Complex64]],
        forms: &[Option<ResponseForm>],
    ) -> Vec<Option<Synthesis>> {
        let mut best: Vec<Option<Synthesis>> = vec![None; functions.len()];
        let lines = self.frequencies;
        let is_sound = lines.len() > self.unknowns() && lines.iter().all(|line| *line > 0.0);
        if !is_sound {
            return best;
        }
        for form in ResponseForm::ALL {
            let mut chosen: Vec<usize> = (0..functions.len()).collect();
            chosen.retain(|&index| {
                let own = forms.get(index).copied().flatten();
                let values = functions[index];
                own.is_none_or(|own| own == form)
                    && values.len() == lines.len()
                    && values.iter().all(|value| value.is_finite())
            });
            let columns: Vec<&[Complex64]> = chosen.iter().map(|&at| functions[at]).collect();
            for (index, found) in chosen.into_iter().zip(self.of_form(form, &columns)) {
                let known = best[index].as_ref();
                if found.left.is_finite() && known.is_none_or(|known| found.left < known.left) {
                    best[index] = Some(found);
                }
            }
        }
        best
    }

    /// Number of real unknowns of one function.
    fn unknowns(&self) -> usize {
        2 * self.poles.len() + 4
    }

    /// Largest angular frequency of the lines (rad/s): the unit of s and p inside the fit.
    fn scale(&self) -> f64 {
        TAU * self.frequencies.last().copied().unwrap_or(1.0)
    }

    /// Returns the complex columns of one line: each unknown's part of the function, in units of [`Self::scale`].
    fn columns(&self, form: ResponseForm, frequency: f64) -> Vec<Complex64> {
        let scale = self.scale();
        let s = Complex64::new(self.added_decay, TAU * frequency) / scale;
        let order = form.derivatives();
        let power = s.powi(order);
        let mut columns = Vec::with_capacity(self.unknowns());
        for pole in self.poles {
            let pole = pole / scale;
            let own = power / (s - pole);
            let image = power / (s - pole.conj());
            columns.push(own + image);
            columns.push(Complex64::i() * (own - image));
        }
        for term in [power, s.powi(order - 2)] {
            columns.push(term);
            columns.push(Complex64::i() * term);
        }
        columns
    }

    /// Fits functions of one form.
    fn of_form(&self, form: ResponseForm, functions: &[&[Complex64]]) -> Vec<Synthesis> {
        let Some(solution) = self.solution(form, functions) else {
            return Vec::new();
        };
        let mut found: Vec<Synthesis> = Vec::with_capacity(functions.len());
        let (scale, order) = (self.scale(), form.derivatives());
        for column in solution.column_iter() {
            let complex = |place: usize| Complex64::new(column[2 * place], column[2 * place + 1]);
            let poles = self.poles.len();
            found.push(Synthesis {
                form,
                residues: (0..poles)
                    .map(|pole| complex(pole) * scale.powi(1 - order))
                    .collect(),
                upper: complex(poles) * scale.powi(-order),
                lower: complex(poles + 1) * scale.powi(2 - order),
                values: Vec::with_capacity(self.frequencies.len()),
                left: 0.0,
            });
        }
        for &frequency in self.frequencies {
            let columns = self.columns(form, frequency);
            for (one, unknowns) in found.iter_mut().zip(solution.column_iter()) {
                let parts = columns.iter().zip(unknowns.iter());
                one.values.push(parts.map(|(part, by)| part * by).sum());
            }
        }
        for (one, measured) in found.iter_mut().zip(functions) {
            let pairs = one.values.iter().zip(measured.iter());
            let left: f64 = pairs.map(|(own, value)| (value - own).norm_sqr()).sum();
            let all: f64 = measured.iter().map(Complex64::norm_sqr).sum();
            one.left = left / all;
        }
        found
    }

    /// Solves for the unknowns of every function, a column for each; `None` without an answer.
    ///
    /// The columns X = Q R are factorised piece by piece: below the R of all earlier lines stand the next ones.
    fn solution(&self, form: ResponseForm, functions: &[&[Complex64]]) -> Option<DMatrix<f64>> {
        let unknowns = self.unknowns();
        let mut upper = DMatrix::zeros(0, unknowns);
        let mut shares = DMatrix::zeros(0, functions.len());
        for first in (0..self.frequencies.len()).step_by(MOST_LINES) {
            let lines = &self.frequencies[first..];
            let lines = &lines[..lines.len().min(MOST_LINES)];
            let known = upper.nrows();
            let rows = known + 2 * lines.len();
            let mut model = upper.resize(rows, unknowns, 0.0);
            let mut data = shares.resize(rows, functions.len(), 0.0);
            for (index, &frequency) in lines.iter().enumerate() {
                let row = known + 2 * index;
                for (place, value) in self.columns(form, frequency).into_iter().enumerate() {
                    model[(row, place)] = value.re;
                    model[(row + 1, place)] = value.im;
                }
                for (place, function) in functions.iter().enumerate() {
                    data[(row, place)] = function[first + index].re;
                    data[(row + 1, place)] = function[first + index].im;
                }
            }
            let factors = model.qr();
            factors.q_tr_mul(&mut data);
            upper = factors.r();
            let kept = upper.nrows();
            shares = data.rows(0, kept).into_owned();
        }
        let lengths: DVector<f64> =
            DVector::from_iterator(unknowns, upper.column_iter().map(|column| column.norm()));
        for (mut column, length) in upper.column_iter_mut().zip(lengths.iter()) {
            column.unscale_mut(length.max(f64::MIN_POSITIVE));
        }
        let parts = upper.try_svd(true, true, f64::EPSILON, MOST_STEPS)?;
        let least = DISTINCT * parts.singular_values.max();
        let mut solution = parts.solve(&shares, least).ok()?;
        for (mut row, length) in solution.row_iter_mut().zip(lengths.iter()) {
            row.unscale_mut(length.max(f64::MIN_POSITIVE));
        }
        Some(solution)
    }
}
