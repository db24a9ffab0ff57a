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
//! The poles are known. R, U and L of each function are those of the least sum of
//!
//! ```text
//! |H measured - H|^2/sqrt(N + |H measured|^2)
//! ```
//!
//! over the lines. A form multiplies a line's equations by s^k: its phase turns real and imaginary part into each other,
//! which changes no sum, and its magnitude is a weight. All forms therefore share their columns, and H/s^k is fitted with the
//! weight |s|^k. N is the noise power of the function about each line ([`noise_of_function`]). A function may span five
//! decades. Without weights the errors at its highest peaks, a few percent of them, hide its low modes. Weights by
//! relative errors let the many lines between the peaks decide, and one mode that is not listed then spoils the peaks
//! of all others. The root lies halfway. U and L are complex: damped modes outside the lines and a delay of the sensor
//! turn their phase.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use super::noise_of_function;
use crate::recording::ResponseForm;

/// Most lines that are factorised at once: a bound on memory. The factors of earlier lines are carried along.
const MOST_LINES: usize = 2048;
/// Least magnitude in a weight, as a share of the largest: that of numbers in single precision.
const LEAST_SHARE: f64 = 1e-7;
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
    /// `forms` are those of the functions. A function without a known form gets the form that fits best. The result
    /// is `None` for a function that is zero or no number on some line, and for all where the lines are too few.
    pub fn synthesise(
        &self,
        functions: &[&[Complex64]],
        forms: &[Option<ResponseForm>],
    ) -> Vec<Option<Synthesis>> {
        let functions = functions.par_iter().enumerate();
        let fitted = functions.map(|(index, function)| {
            let form = forms.get(index).copied().flatten();
            self.of_function(function, form)
        });
        fitted.collect()
    }

    fn of_function(&self, function: &[Complex64], form: Option<ResponseForm>) -> Option<Synthesis> {
        let lines = self.frequencies;
        let is_sound = lines.len() > self.unknowns()
            && lines.iter().all(|line| *line > 0.0)
            && function.len() == lines.len();
        let powers = function.iter().map(Complex64::norm_sqr);
        let largest = powers.clone().fold(0.0, f64::max);
        let all: f64 = powers.clone().sum();
        if !(is_sound && all > 0.0 && all.is_finite()) {
            return None;
        }
        let mut weights = noise_of_function(function);
        for (weight, power) in weights.iter_mut().zip(powers) {
            let square = *weight + power + LEAST_SHARE.powi(2) * largest;
            *weight = 1.0 / square.sqrt();
        }
        let forms = match form {
            Some(ref form) => std::slice::from_ref(form),
            None => &ResponseForm::ALL,
        };
        let solutions = self.solutions(forms, function, &weights);
        let pairs = forms.iter().zip(solutions);
        let sound = pairs.filter_map(|(form, solution)| Some((*form, solution?)));
        let least = sound.min_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost));
        let (form, solution) = least?;
        let found = self.of_solution(form, &solution.unknowns);
        let pairs = function.iter().zip(&found.values);
        let left: f64 = pairs.map(|(value, own)| (value - own).norm_sqr()).sum();
        let left = left / all;
        left.is_finite().then_some(Synthesis { left, ..found })
    }

    /// Number of real unknowns of one function.
    fn unknowns(&self) -> usize {
        2 * self.poles.len() + 4
    }

    /// Largest angular frequency of the lines (rad/s): the unit of s and p inside the fit.
    fn scale(&self) -> f64 {
        TAU * self.frequencies.last().copied().unwrap_or(1.0)
    }

    /// Puts each unknown's part of the receptance on one line into `columns`, in units of [`Self::scale`].
    fn fill_columns(&self, frequency: f64, columns: &mut [Complex64]) {
        let scale = self.scale();
        let s = self.place(frequency);
        let pairs = columns.chunks_exact_mut(2);
        let poles = self.poles.iter().map(|pole| {
            let pole = pole / scale;
            let (own, image) = ((s - pole).inv(), (s - pole.conj()).inv());
            [own + image, Complex64::i() * (own - image)]
        });
        let terms = [Complex64::ONE, s.powi(-2)].map(|term| [term, Complex64::i() * term]);
        for (columns, own) in pairs.zip(poles.chain(terms)) {
            columns.copy_from_slice(&own);
        }
    }

    /// Returns s of a line, in units of [`Self::scale`].
    fn place(&self, frequency: f64) -> Complex64 {
        Complex64::new(self.added_decay, TAU * frequency) / self.scale()
    }

    /// Returns the curve of the unknowns of one form, without the share that is left.
    fn of_solution(&self, form: ResponseForm, unknowns: &DVector<f64>) -> Synthesis {
        let complex: Vec<Complex64> = unknowns
            .as_slice()
            .chunks_exact(2)
            .map(|pair| Complex64::new(pair[0], pair[1]))
            .collect();
        let (residues, terms) = complex.split_at(self.poles.len());
        let (scale, order) = (self.scale(), form.derivatives());
        let mut columns = vec![Complex64::ZERO; self.unknowns()];
        let values = self.frequencies.iter().map(|&frequency| {
            self.fill_columns(frequency, &mut columns);
            let parts = columns.iter().zip(unknowns.iter());
            self.place(frequency).powi(order) * parts.map(|(part, by)| part * by).sum::<Complex64>()
        });
        Synthesis {
            form,
            values: values.collect(),
            residues: residues.iter().map(|r| r * scale.powi(1 - order)).collect(),
            upper: terms[0] * scale.powi(-order),
            lower: terms[1] * scale.powi(2 - order),
            left: 0.0,
        }
    }

    /// Solves for the unknowns of each form; `None` for a form without an answer.
    ///
    /// The weighted columns X = Q R are factorised piece by piece: below the R of all earlier lines stand the next ones.
    fn solutions(
        &self,
        forms: &[ResponseForm],
        function: &[Complex64],
        weights: &[f64],
    ) -> Vec<Option<Solution>> {
        let unknowns = self.unknowns();
        let mut equations = vec![Equations::none(unknowns); forms.len()];
        let mut columns = DMatrix::zeros(unknowns, MOST_LINES.min(function.len()));
        for first in (0..function.len()).step_by(MOST_LINES) {
            let lines = first..function.len().min(first + MOST_LINES);
            for (mut column, line) in columns.column_iter_mut().zip(lines.clone()) {
                self.fill_columns(self.frequencies[line], column.as_mut_slice());
            }
            for (equations, form) in equations.iter_mut().zip(forms) {
                let known = equations.upper.nrows();
                let rows = known + 2 * lines.len();
                let mut model = equations.upper.clone().resize(rows, unknowns, 0.0);
                let mut data = equations.shares.clone().resize_vertically(rows, 0.0);
                for (line, columns) in lines.clone().zip(columns.column_iter()) {
                    let row = known + 2 * (line - first);
                    let power = self.place(self.frequencies[line]).powi(form.derivatives());
                    let root = weights[line].sqrt() * power.norm();
                    let value = function[line] / power * root;
                    data[row] = value.re;
                    data[row + 1] = value.im;
                    for (place, value) in columns.iter().enumerate() {
                        model[(row, place)] = value.re * root;
                        model[(row + 1, place)] = value.im * root;
                    }
                }
                equations.take(model, data);
            }
        }
        equations.into_iter().map(Equations::solved).collect()
    }
}

/// Unknowns of a form, and the weighted sum of the squares that they leave.
struct Solution {
    unknowns: DVector<f64>,
    cost: f64,
}

/// Equations of one form: R and Q'Y of all lines so far, and the sum of the squares that no unknowns explain.
#[derive(Clone)]
struct Equations {
    upper: DMatrix<f64>,
    shares: DVector<f64>,
    left: f64,
}

impl Equations {
    fn none(unknowns: usize) -> Self {
        Equations {
            upper: DMatrix::zeros(0, unknowns),
            shares: DVector::zeros(0),
            left: 0.0,
        }
    }

    /// Takes the rows of more lines, which stand below its own.
    fn take(&mut self, model: DMatrix<f64>, mut data: DVector<f64>) {
        let factors = model.qr();
        factors.q_tr_mul(&mut data);
        self.upper = factors.r();
        let known = self.upper.nrows();
        self.left += data.rows(known, data.nrows() - known).norm_squared();
        self.shares = data.resize_vertically(known, 0.0);
    }

    fn solved(mut self) -> Option<Solution> {
        let lengths: Vec<f64> = (self.upper.column_iter())
            .map(|column| column.norm())
            .collect();
        for (mut column, length) in self.upper.column_iter_mut().zip(&lengths) {
            column.unscale_mut(length.max(f64::MIN_POSITIVE));
        }
        let parts = self
            .upper
            .clone()
            .try_svd(true, true, f64::EPSILON, MOST_STEPS)?;
        let least = DISTINCT * parts.singular_values.max();
        let mut unknowns = parts.solve(&self.shares, least).ok()?;
        let cost = self.left + (self.shares - self.upper * &unknowns).norm_squared();
        for (value, length) in unknowns.iter_mut().zip(&lengths) {
            *value /= length.max(f64::MIN_POSITIVE);
        }
        cost.is_finite().then_some(Solution { unknowns, cost })
    }
}
