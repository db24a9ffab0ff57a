//! Symmetric matrices of half-bandwidth 3, as beams have them, and their factors.
//!
//! The fixed band lets every inner loop be unrolled; the general one is in `structure::banded`.

/// Nodes have two motions, so that an element reaches three equations to the left.
pub(super) const HALF_BAND: usize = 3;

/// Row by row the entries left of the diagonal (nearest last), and the diagonal at the end.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Band {
    rows: Vec<[f64; HALF_BAND + 1]>,
}

/// Lower factor of a positive definite matrix; the diagonal holds reciprocals.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Factor {
    rows: Vec<[f64; HALF_BAND + 1]>,
}

/// L D L^T of any symmetric matrix: L D left of the diagonal, 1/D on it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Indefinite {
    rows: Vec<[f64; HALF_BAND + 1]>,
}

impl Band {
    pub(super) fn zeros(size: usize) -> Self {
        Self {
            rows: vec![[0.0; HALF_BAND + 1]; size],
        }
    }

    pub(super) fn size(&self) -> usize {
        self.rows.len()
    }

    /// Adds to one entry of the lower triangle; those of the upper one follow by symmetry.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        if column <= row {
            self.rows[row][HALF_BAND + column - row] += value;
        }
    }

    /// Calls `visit` with row, column and value of every entry of the lower triangle.
    pub(super) fn for_each(&self, mut visit: impl FnMut(usize, usize, f64)) {
        for (row, entries) in self.rows.iter().enumerate() {
            for back in 0..=HALF_BAND.min(row) {
                visit(row, row - back, entries[HALF_BAND - back]);
            }
        }
    }

    /// self + factor other.
    pub(super) fn plus(&self, factor: f64, other: &Self) -> Self {
        let add = |(a, b): (&[f64; 4], &[f64; 4])| std::array::from_fn(|i| a[i] + factor * b[i]);
        Self {
            rows: self.rows.iter().zip(&other.rows).map(add).collect(),
        }
    }

    pub(super) fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; x.len()];
        self.times_into(x, &mut product);
        product
    }

    pub(super) fn times_into(&self, x: &[f64], product: &mut [f64]) {
        product.fill(0.0);
        for (row, entries) in self.rows.iter().enumerate() {
            let mut sum = entries[HALF_BAND] * x[row];
            for back in 1..=HALF_BAND.min(row) {
                let entry = entries[HALF_BAND - back];
                sum += entry * x[row - back];
                product[row - back] += entry * x[row];
            }
            product[row] += sum;
        }
    }

    /// Cholesky factor; `None` where the matrix is not positive definite.
    pub(super) fn cholesky(&self) -> Option<Factor> {
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
        Some(Factor { rows })
    }

    /// Number of negative eigenvalues: that of the negative pivots (Sylvester's law of inertia); `None` where a pivot
    /// of zero leaves it open.
    pub(super) fn negative_eigenvalues(&self) -> Option<usize> {
        let pivots = self.indefinite();
        // After a pivot of zero the next one is infinite, and its inverse a zero with a sign.
        let inverses = pivots.rows.iter().map(|row| row[HALF_BAND]);
        let known = inverses.clone().all(|inverse| !inverse.is_nan());
        known.then(|| {
            inverses
                .filter(|inverse| inverse.is_sign_negative())
                .count()
        })
    }

    /// Factors without exchange of rows, which a pivot of zero by chance makes infinite.
    pub(super) fn indefinite(&self) -> Indefinite {
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
        Indefinite { rows }
    }
}

impl Indefinite {
    /// The solution x of L D L^T x = b.
    pub(super) fn solve(&self, mut x: Vec<f64>) -> Vec<f64> {
        // D y = L^-1 b: then the rows' own entries are those of L D.
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

impl Factor {
    /// L x = b in place.
    pub(super) fn solve_lower(&self, x: &mut [f64]) {
        for row in 0..x.len() {
            let entries = &self.rows[row];
            let mut rest = x[row];
            for back in (1..=HALF_BAND.min(row)).rev() {
                rest -= entries[HALF_BAND - back] * x[row - back];
            }
            x[row] = rest * entries[HALF_BAND];
        }
    }

    /// L^T x = b in place.
    pub(super) fn solve_upper(&self, x: &mut [f64]) {
        for row in (0..x.len()).rev() {
            let entries = &self.rows[row];
            let value = x[row] * entries[HALF_BAND];
            x[row] = value;
            for back in 1..=HALF_BAND.min(row) {
                x[row - back] -= entries[HALF_BAND - back] * value;
            }
        }
    }

    /// L^T x.
    pub(super) fn transpose_times(&self, x: &[f64]) -> Vec<f64> {
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
