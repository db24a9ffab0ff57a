//! What each pole contributes to the responses: residues by least squares on the lines around it,
//! with a background in place of lower and upper residuals.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::ResponseMatrix;
use crate::modal::projection::{Basis, conjugate_product, norm};

/// Half-power widths to either side that take part: beyond, a mode is a background like the others.
const WIDTHS: f64 = 4.0;
/// Lines to either side at least: 25 values stand against a mode, its two neighbours with their
/// corrections, and the background.
const LEAST_REACH: usize = 12;
/// Lines to either side at most; of a wider window every second, third, ... one.
const MOST_REACH: usize = 50;
/// Background terms of each entry: a constant, a slope and a curvature. They stand for the lower and
/// the upper residual, and for everything else that is smooth over the window.
const BACKGROUND: usize = 3;

/// A pole as the responses show it, an exponential window's decay included.
#[derive(Debug, Clone)]
pub(super) struct SeenPole {
    pub(super) pole: Complex64,
    pub(super) participation: Vec<Complex64>,
}

/// What one pole contributes.
#[derive(Debug, Clone)]
pub(super) struct Contribution {
    /// Shape factor of each output: the residue is factor times participation (unit of the response
    /// times 1/s).
    pub(super) shape: Vec<Complex64>,
    /// Sum of squares that the pole explains over the noise variance, mean over the outputs.
    pub(super) above_noise: f64,
    /// Level of the pole at its own peak over the highest level in the window.
    pub(super) share_of_peak: f64,
}

/// The lines around a pole.
struct Window {
    omegas: Vec<f64>,
    lines: Vec<usize>,
}

impl Window {
    fn around(matrix: &ResponseMatrix, pole: Complex64) -> Option<Self> {
        let spacing = matrix.spacing();
        let last = matrix.points().checked_sub(1)?;
        let centre = (pole.im / TAU - matrix.frequency(0)) / spacing;
        let centre = (centre.round().max(0.0) as usize).min(last);
        let width = -pole.re / PI / spacing;
        let reach = ((WIDTHS * width).ceil() as usize).clamp(LEAST_REACH, last.max(LEAST_REACH));
        let stride = reach.div_ceil(MOST_REACH);
        let range = centre.saturating_sub(reach)..=(centre + reach).min(last);
        let lines: Vec<usize> = range.step_by(stride).collect();
        let omegas = lines
            .iter()
            .map(|&line| TAU * matrix.frequency(line))
            .collect();
        Some(Window { omegas, lines })
    }

    /// Whether a pole lies in the window or as near to it as half its length.
    pub(super) fn holds(&self, pole: Complex64) -> bool {
        let (Some(first), Some(last)) = (self.omegas.first(), self.omegas.last()) else {
            return false;
        };
        let margin = 0.5 * (last - first);
        (first - margin..=last + margin).contains(&pole.im)
    }

    /// Column of `participation` 1/(j omega - p)^power, input by input.
    fn pole_column(&self, seen: &SeenPole, power: i32) -> Vec<Complex64> {
        let mut column = Vec::with_capacity(self.omegas.len() * seen.participation.len());
        for factor in &seen.participation {
            column.extend(
                self.omegas
                    .iter()
                    .map(|&omega| factor * (Complex64::new(0.0, omega) - seen.pole).powi(-power)),
            );
        }
        column
    }

    /// Columns of x^degree for one input each, x running from -1 to 1.
    fn background(&self, inputs: usize) -> Vec<Vec<Complex64>> {
        let count = self.omegas.len();
        let mut columns = Vec::new();
        for input in 0..inputs {
            for degree in 0..BACKGROUND {
                let mut column = vec![Complex64::ZERO; count * inputs];
                for (index, value) in column[input * count..(input + 1) * count]
                    .iter_mut()
                    .enumerate()
                {
                    let x = 2.0 * index as f64 / (count.max(2) - 1) as f64 - 1.0;
                    *value = Complex64::from(x.powi(degree as i32));
                }
                columns.push(column);
            }
        }
        columns
    }

    fn values(&self, matrix: &ResponseMatrix, output: usize) -> Vec<Complex64> {
        (0..matrix.inputs())
            .flat_map(|input| {
                let entry = matrix.entry(output, input);
                self.lines.iter().map(|&line| entry[line])
            })
            .collect()
    }
}

/// Contribution of pole `index` among `poles`.
///
/// Around the pole each output is fitted by
/// H_oi = sum_r psi_or L_ri/(s - p_r) + delta_or L_ri/(s - p_r)^2 + background.
/// The second term stands for the error of a neighbouring pole, and is left out for the pole itself:
/// what another pole would explain as well, if it were a little elsewhere, is no mode of its own.
pub(super) fn contribution(
    matrix: &ResponseMatrix,
    poles: &[SeenPole],
    index: usize,
) -> Option<Contribution> {
    let own = poles.get(index)?;
    let window = Window::around(matrix, own.pole)?;
    let mut basis = Basis::default();
    for column in window.background(matrix.inputs()) {
        basis.add(column);
    }
    for (other, seen) in poles.iter().enumerate() {
        if other != index && window.holds(seen.pole) {
            basis.add(window.pole_column(seen, 1));
            basis.add(window.pole_column(seen, 2));
        }
    }
    // The pole's own column stands last: what it explains is what the others do not.
    let column = window.pole_column(own, 1);
    let rest = basis.rest(column.clone());
    let length = norm(&rest);
    let degrees = column.len().checked_sub(basis.columns.len() + 1)?;
    if degrees == 0 || length <= 1e-9 * norm(&column) {
        return None;
    }
    let (mut shape, mut above_noise, mut peak, mut own_peak) = (Vec::new(), 0.0, 0.0, 0.0);
    for output in 0..matrix.outputs() {
        let values = window.values(matrix, output);
        peak += values.iter().map(Complex64::norm_sqr).fold(0.0, f64::max);
        // Rounding stands for the noise where there is none.
        let rounding = (f64::EPSILON * norm(&values)).powi(2) / values.len() as f64;
        let left = basis.rest(values);
        // psi = r^H y/|r|^2, explained sum of squares |r^H y|^2/|r|^2.
        let factor = conjugate_product(&rest, &left) / (length * length);
        let explained = factor.norm_sqr() * length * length;
        let unexplained = (norm(&left).powi(2) - explained).max(0.0);
        let variance = unexplained / degrees as f64;
        above_noise += explained / variance.max(rounding).max(f64::MIN_POSITIVE);
        let strongest = own
            .participation
            .iter()
            .map(|factor| factor.norm())
            .fold(0.0, f64::max);
        own_peak += (factor.norm() * strongest / own.pole.re).powi(2);
        shape.push(factor);
    }
    Some(Contribution {
        shape,
        above_noise: above_noise / matrix.outputs() as f64,
        share_of_peak: (own_peak / peak.max(f64::MIN_POSITIVE)).sqrt(),
    })
}

/// Whether removing `removed` can change the contribution of `kept`.
pub(super) fn near(matrix: &ResponseMatrix, kept: &SeenPole, removed: &SeenPole) -> bool {
    Window::around(matrix, kept.pole).is_some_and(|window| window.holds(removed.pole))
}
