//! Symmetric matrices of half-bandwidth 3, as beams have them, and their factors.
//!
//! The fixed band lets the compiler unroll every inner loop.

use nalgebra::DMatrix;

/// Half-bandwidth of a beam's matrices. Nodes have two motions, so that an element reaches three
/// equations to the left.
const HALF_BAND: usize = 3;

/// One row: the entries left of the diagonal (nearest last), and the diagonal at the end.
type Row = [f64; HALF_BAND + 1];

/// A symmetric banded matrix.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BandedMatrix {
    rows: Vec<Row>,
}

/// Lower Cholesky factor of a positive definite matrix. The diagonal holds reciprocals.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CholeskyFactor {
    rows: Vec<Row>,
}

/// Factor L D L^T of any symmetric matrix: L D left of the diagonal, 1/D on it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LdlFactor {
    rows: Vec<Row>,
}

impl BandedMatrix {
    /// The zero matrix of `size` rows.
    pub(crate) fn zeros(size: usize) -> Self {
        Self {
            rows: vec![[0.0; HALF_BAND + 1]; size],
        }
    }

    /// Number of rows.
    pub(crate) fn size(&self) -> usize {
        self.rows.len()
    }

    /// Adds to one entry of the lower triangle. Entries of the upper one follow by symmetry and are
    /// ignored.
    pub(crate) fn add(&mut self, row: usize, column: usize, value: f64) {
        if column <= row {
            self.rows[row][HALF_BAND + column - row] += value;
        }
    }

    /// Returns self + factor other.
    pub(crate) fn plus(&self, factor: f64, other: &Self) -> Self {
        let mut sum = self.clone();
        for (row, other) in sum.rows.iter_mut().zip(&other.rows) {
            *row = std::array::from_fn(|i| row[i] + factor * other[i]);
        }
        sum
    }

    /// Returns the product with a vector.
    pub(crate) fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; x.len()];
        for (row, entries) in self.rows.iter().enumerate() {
            let mut sum = entries[HALF_BAND] * x[row];
            for back in 1..=HALF_BAND.min(row) {
                let entry = entries[HALF_BAND - back];
                sum += entry * x[row - back];
                product[row - back] += entry * x[row];
            }
            product[row] += sum;
        }
        product
    }

    /// Returns the matrix with all its zeros.
    pub(crate) fn dense(&self) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.size(), self.size());
        for (row, entries) in self.rows.iter().enumerate() {
            for back in 0..=HALF_BAND.min(row) {
                dense[(row, row - back)] = entries[HALF_BAND - back];
                dense[(row - back, row)] = entries[HALF_BAND - back];
            }
        }
        dense
    }

    /// Returns the Cholesky factor, `None` where the matrix is not positive definite.
    pub(crate) fn cholesky(&self) -> Option<CholeskyFactor> {
        let mut rows = self.rows.clone();
        for row in 0..rows.len() {
            let mut own = rows[row];
            for back in (1..=HALF_BAND.min(row)).rev() {
                let other = &rows[row - back];
                let mut rest = own[HALF_BAND - back];
                for further in back + 1..=HALF_BAND.min(row) {
                    rest -= own[HALF_BAND - further] * other[HALF_BAND + back - further];
                }
                own[HALF_BAND - back] = rest * other[HALF_BAND];
            }
            let squares: f64 = own[..HALF_BAND].iter().map(|entry| entry * entry).sum();
            let rest = own[HALF_BAND] - squares;
            // A NaN is no positive pivot either.
            if rest.is_nan() || rest <= 0.0 {
                return None;
            }
            own[HALF_BAND] = 1.0 / rest.sqrt();
            rows[row] = own;
        }
        Some(CholeskyFactor { rows })
    }

    /// Returns the factor L D L^T without exchange of rows, which a pivot of zero by chance makes
    /// infinite.
    pub(crate) fn ldl(&self) -> LdlFactor {
        let mut rows = self.rows.clone();
        for row in 0..rows.len() {
            let mut own = rows[row];
            for back in (1..=HALF_BAND.min(row)).rev() {
                for further in back + 1..=HALF_BAND.min(row) {
                    let other = rows[row - back][HALF_BAND + back - further];
                    let inverse = rows[row - further][HALF_BAND];
                    own[HALF_BAND - back] -= own[HALF_BAND - further] * other * inverse;
                }
            }
            for back in 1..=HALF_BAND.min(row) {
                let entry = own[HALF_BAND - back];
                own[HALF_BAND] -= entry * entry * rows[row - back][HALF_BAND];
            }
            own[HALF_BAND] = 1.0 / own[HALF_BAND];
            rows[row] = own;
        }
        LdlFactor { rows }
    }

    /// Number of negative eigenvalues, which is that of the negative pivots (Sylvester's law of
    /// inertia). `None` where a pivot of zero leaves it open.
    pub(crate) fn negative_eigenvalues(&self) -> Option<usize> {
        let mut count = 0;
        for row in self.ldl().rows {
            // After a pivot of zero the next one is infinite, and its inverse a zero with a sign.
            let inverse = row[HALF_BAND];
            if inverse.is_nan() {
                return None;
            }
            count += usize::from(inverse.is_sign_negative());
        }
        Some(count)
    }
}

impl LdlFactor {
    /// Returns the solution x of L D L^T x = b.
    pub(crate) fn solve(&self, mut x: Vec<f64>) -> Vec<f64> {
        // D y = L^-1 b: the rows' own entries are those of L D.
        for row in 0..x.len() {
            let entries = &self.rows[row];
            for back in 1..=HALF_BAND.min(row) {
                x[row] -= entries[HALF_BAND - back] * x[row - back];
            }
            x[row] *= entries[HALF_BAND];
        }
        for row in (0..x.len()).rev() {
            let (entries, value) = (&self.rows[row], x[row]);
            for back in 1..=HALF_BAND.min(row) {
                x[row - back] -=
                    entries[HALF_BAND - back] * self.rows[row - back][HALF_BAND] * value;
            }
        }
        x
    }
}

impl CholeskyFactor {
    /// Solves L x = b in place.
    pub(crate) fn solve_lower(&self, x: &mut [f64]) {
        for row in 0..x.len() {
            let entries = &self.rows[row];
            let mut rest = x[row];
            for back in (1..=HALF_BAND.min(row)).rev() {
                rest -= entries[HALF_BAND - back] * x[row - back];
            }
            x[row] = rest * entries[HALF_BAND];
        }
    }

    /// Solves L^T x = b in place.
    pub(crate) fn solve_upper(&self, x: &mut [f64]) {
        for row in (0..x.len()).rev() {
            let entries = &self.rows[row];
            let value = x[row] * entries[HALF_BAND];
            x[row] = value;
            for back in 1..=HALF_BAND.min(row) {
                x[row - back] -= entries[HALF_BAND - back] * value;
            }
        }
    }

    /// Returns L^T x.
    pub(crate) fn transpose_times(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; x.len()];
        for (row, entries) in self.rows.iter().enumerate() {
            product[row] += x[row] / entries[HALF_BAND];
            for back in 1..=HALF_BAND.min(row) {
                product[row - back] += entries[HALF_BAND - back] * x[row];
            }
        }
        product
    }
}
