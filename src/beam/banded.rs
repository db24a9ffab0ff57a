//! Symmetric matrices of half-bandwidth 3, as beams have them, and their factors.
//!
//! The fixed band lets every inner loop be unrolled; the general one is in `structure::banded`.

use super::StructureError;
use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

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

// Banded symmetric matrices and their lowest eigenvalues by subspace iteration.

/// A symmetric matrix whose entries vanish beyond `half_band` from the diagonal.
#[derive(Debug, Clone)]
pub(super) struct BandedSymmetric {
    size: usize,
    half_band: usize,
    /// Row by row the entries left of the diagonal, and the diagonal last.
    entries: Vec<f64>,
}

impl BandedSymmetric {
    pub(super) fn zeros(size: usize, half_band: usize) -> Self {
        Self {
            size,
            half_band,
            entries: vec![0.0; size * (half_band + 1)],
        }
    }

    pub(super) fn size(&self) -> usize {
        self.size
    }

    /// Place of an entry with column <= row <= column + half_band.
    fn place(&self, row: usize, column: usize) -> usize {
        row * (self.half_band + 1) + self.half_band - (row - column)
    }

    fn get(&self, row: usize, column: usize) -> f64 {
        self.entries[self.place(row, column)]
    }

    /// Adds to one entry of the lower triangle; those of the upper one follow by symmetry.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        if column <= row {
            let place = self.place(row, column);
            self.entries[place] += value;
        }
    }

    /// self + factor other, for matrices of the same shape.
    pub(super) fn plus(&self, factor: f64, other: &Self) -> Self {
        let mut sum = self.clone();
        for (entry, other) in sum.entries.iter_mut().zip(&other.entries) {
            *entry += factor * other;
        }
        sum
    }

    /// With all its zeros.
    fn dense(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.size, self.size, |row, column| {
            let (row, column) = (row.max(column), row.min(column));
            if row - column > self.half_band {
                0.0
            } else {
                self.get(row, column)
            }
        })
    }

    fn first_column(&self, row: usize) -> usize {
        row.saturating_sub(self.half_band)
    }

    /// Product with each column of a matrix.
    pub(super) fn times(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let mut product = DMatrix::zeros(columns.nrows(), columns.ncols());
        for (mut target, source) in product.column_iter_mut().zip(columns.column_iter()) {
            for row in 0..self.size {
                target[row] += self.get(row, row) * source[row];
                for column in self.first_column(row)..row {
                    let entry = self.get(row, column);
                    target[row] += entry * source[column];
                    target[column] += entry * source[row];
                }
            }
        }
        product
    }

    /// Lower Cholesky factor of the same band, `None` where the matrix is not positive definite.
    fn cholesky(&self) -> Option<Self> {
        let mut factor = self.clone();
        for row in 0..self.size {
            for column in self.first_column(row)..=row {
                let from = self.first_column(row);
                let sum: f64 = (from..column)
                    .map(|k| factor.get(row, k) * factor.get(column, k))
                    .sum();
                let rest = factor.get(row, column) - sum;
                let place = factor.place(row, column);
                factor.entries[place] = if column < row {
                    rest / factor.get(column, column)
                } else if rest > 0.0 {
                    rest.sqrt()
                } else {
                    return None;
                };
            }
        }
        Some(factor)
    }

    /// Solves (factor factor^T) x = b in place, for each column, self being the factor.
    fn solve_in_place(&self, columns: &mut DMatrix<f64>) {
        self.solve_lower(columns);
        self.solve_upper(columns);
    }

    /// Solves factor x = b in place, for each column, self being the factor.
    fn solve_lower(&self, columns: &mut DMatrix<f64>) {
        for mut x in columns.column_iter_mut() {
            for row in 0..self.size {
                let sum: f64 = (self.first_column(row)..row)
                    .map(|k| self.get(row, k) * x[k])
                    .sum();
                x[row] = (x[row] - sum) / self.get(row, row);
            }
        }
    }

    /// Solves factor^T x = b in place, for each column, self being the factor.
    fn solve_upper(&self, columns: &mut DMatrix<f64>) {
        for mut x in columns.column_iter_mut() {
            for row in (0..self.size).rev() {
                x[row] /= self.get(row, row);
                let value = x[row];
                for k in self.first_column(row)..row {
                    x[k] -= self.get(row, k) * value;
                }
            }
        }
    }
}

/// The vectors of the lowest `count` eigenvalues of K x = mu M x, ascending, by subspace
/// iteration (Bathe, "Finite Element Procedures", 11.6). K must be positive definite.
///
/// K is factored and not M: that keeps the low eigenvalues of a stiff, finely divided beam.
pub(super) fn lowest_eigenvectors(
    stiffness: &BandedSymmetric,
    mass: &BandedSymmetric,
    count: usize,
) -> Result<DMatrix<f64>, StructureError> {
    // Each step gains at least the ratio of the first eigenvalue left out to the last wanted.
    const STEPS: usize = 60;
    // The quotient formed from the vectors afterwards is exact to about its square.
    const RELATIVE_CHANGE: f64 = 1e-11;
    let failure = |reason: &str| StructureError::FiniteElements {
        reason: reason.to_owned(),
    };
    let size = stiffness.size();
    let width = (2 * count).min(count + 8).min(size);
    if count > size {
        return Err(failure("more modes than degrees of freedom; divide finer"));
    }
    let factor = stiffness
        .cholesky()
        .ok_or_else(|| failure("the stiffness matrix is not positive definite"))?;
    let mut vectors = starting_vectors(size, width);
    let mut previous = vec![0.0; width];
    for _ in 0..STEPS {
        let loads = mass.times(&vectors);
        vectors = loads.clone();
        factor.solve_in_place(&mut vectors);
        let (values, rotation) = ritz(&(vectors.transpose() * &loads), &vectors, mass)
            .ok_or_else(|| failure("the subspace lost its independence"))?;
        vectors *= rotation;
        let settled = values
            .iter()
            .zip(&previous)
            .take(count)
            .all(|(new, old)| (new - old).abs() <= RELATIVE_CHANGE * new.abs());
        if settled {
            break;
        }
        previous = values;
    }
    // What still moves in the eleventh digit after all steps is rounding, not convergence.
    Ok(vectors.columns(0, count).into_owned())
}

/// All eigenvalues of (K - shift M) x = mu M x, ascending, and their vectors of unit modal mass;
/// `shifted` is K, positive definite.
///
/// With L L^T = K the matrix L^-1 M L^-T has the eigenvalues 1/(mu + shift): the lowest modes are
/// its largest and most exact.
pub(super) fn all_modes(
    shifted: &BandedSymmetric,
    mass: &BandedSymmetric,
    shift: f64,
) -> Result<(Vec<f64>, DMatrix<f64>), StructureError> {
    let failure = |reason: &str| StructureError::FiniteElements {
        reason: reason.to_owned(),
    };
    let factor = shifted
        .cholesky()
        .ok_or_else(|| failure("the stiffness matrix is not positive definite"))?;
    let mut half = mass.dense();
    factor.solve_lower(&mut half);
    let mut inverse = half.transpose();
    factor.solve_lower(&mut inverse);
    if !inverse.iter().all(|entry| entry.is_finite()) {
        return Err(failure("the stiffness matrix is nearly singular"));
    }
    let inverse = 0.5 * (&inverse + inverse.transpose());
    let eigen = SymmetricEigen::try_new(inverse, f64::EPSILON, 10_000)
        .ok_or_else(|| failure("its eigenvalues did not settle"))?;
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len())
        .filter(|&i| eigen.eigenvalues[i] > 0.0)
        .collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let mut vectors = eigen.eigenvectors.select_columns(order.iter());
    factor.solve_upper(&mut vectors);
    // y^T M' y = 1/(mu + shift) for a unit vector y of M' = L^-1 M L^-T, and x = L^-T y.
    for (mut column, &i) in vectors.column_iter_mut().zip(&order) {
        column /= eigen.eigenvalues[i].sqrt();
    }
    let squares = order
        .iter()
        .map(|&i| 1.0 / eigen.eigenvalues[i] - shift)
        .collect();
    Ok((squares, vectors))
}

/// Waves of growing number: close to the mode shapes of any beam, and independent.
fn starting_vectors(size: usize, width: usize) -> DMatrix<f64> {
    DMatrix::from_fn(size, width, |row, column| {
        let along = (row + 1) as f64 / (size + 1) as f64;
        let wave = (column + 1) as f64 * std::f64::consts::PI * along;
        // Displacements and rotations alternate; a phase tells them apart.
        (wave + row as f64 % 2.0).cos() + along
    })
}

/// Eigenvalues of the problem projected on the subspace, ascending, with the rotation to their
/// vectors; `None` where the projection is singular.
fn ritz(
    projected_stiffness: &DMatrix<f64>,
    vectors: &DMatrix<f64>,
    mass: &BandedSymmetric,
) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let symmetric = 0.5 * (projected_stiffness + projected_stiffness.transpose());
    let projected_mass = vectors.transpose() * mass.times(vectors);
    let lower = Cholesky::new(symmetric)?.l();
    // L^-1 M L^-T has the inverse eigenvalues: the lowest modes are its largest and most exact.
    let half = lower.solve_lower_triangular(&projected_mass)?;
    let inverse = lower.solve_lower_triangular(&half.transpose())?;
    if !inverse.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let inverse = 0.5 * (&inverse + inverse.transpose());
    let eigen = SymmetricEigen::try_new(inverse, f64::EPSILON, 1000)?;
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let values = order.iter().map(|&i| 1.0 / eigen.eigenvalues[i]).collect();
    let sorted = eigen.eigenvectors.select_columns(order.iter());
    let rotation = lower.transpose().solve_upper_triangular(&sorted)?;
    Some((values, rotation))
}
