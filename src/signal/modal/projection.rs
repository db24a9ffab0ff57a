//! Projection of complex columns on each other, for the linear least squares of pole fits.

use num_complex::Complex64;

/// sum conj(a) b.
pub(super) fn conjugate_product(a: &[Complex64], b: &[Complex64]) -> Complex64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        re += a.re * b.re + a.im * b.im;
        im += a.re * b.im - a.im * b.re;
    }
    Complex64::new(re, im)
}

/// Orthonormal columns, by Gram and Schmidt.
#[derive(Clone)]
pub(super) struct Basis {
    pub(super) columns: Vec<Vec<Complex64>>,
    /// Number of projections: a second one removes the rounding of nearly dependent columns.
    passes: usize,
}

impl Basis {
    /// Begins without columns. `passes` is 1 for well separated columns, 2 for nearly dependent ones.
    pub(super) fn new(passes: usize) -> Self {
        Basis {
            columns: Vec::new(),
            passes,
        }
    }

    /// Returns a vector without its projection on the columns.
    pub(super) fn rest(&self, mut vector: Vec<Complex64>) -> Vec<Complex64> {
        for _ in 0..self.passes {
            for column in &self.columns {
                let share = conjugate_product(column, &vector);
                for (value, basis) in vector.iter_mut().zip(column) {
                    *value -= share * basis;
                }
            }
        }
        vector
    }

    /// Adds a column, unless it depends on the columns before it.
    pub(super) fn add(&mut self, column: Vec<Complex64>) {
        let whole = norm(&column);
        let rest = self.rest(column);
        let length = norm(&rest);
        if length > 1e-9 * whole {
            self.columns
                .push(rest.into_iter().map(|value| value / length).collect());
        }
    }
}

/// Root of the sum of squares.
pub(super) fn norm(values: &[Complex64]) -> f64 {
    values.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt()
}
