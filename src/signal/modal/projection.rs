//! Complex columns projected on each other: the least squares that pole fits share.

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

/// Orthonormal columns.
#[derive(Default, Clone)]
pub(super) struct Basis {
    pub(super) columns: Vec<Vec<Complex64>>,
}

impl Basis {
    /// What of a vector the columns leave. Twice, because once leaves rounding behind where the
    /// columns are nearly dependent.
    pub(super) fn rest(&self, mut vector: Vec<Complex64>) -> Vec<Complex64> {
        for _ in 0..2 {
            for column in &self.columns {
                let share = conjugate_product(column, &vector);
                for (value, basis) in vector.iter_mut().zip(column) {
                    *value -= share * basis;
                }
            }
        }
        vector
    }

    /// Adds a column, unless it depends on those that are there.
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
