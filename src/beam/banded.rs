//! Banded symmetric matrices and their lowest eigenvalues by subspace iteration.

use super::StructureError;
use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

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
