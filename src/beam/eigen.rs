//! Eigenpairs of K x = lambda M x for banded matrices.
//!
//! With L L^T = K the matrix L^-1 M L^-T has the eigenvalues 1/lambda: the lowest modes are its
//! largest and most exact. The lowest pairs come from Lanczos's method with full orthogonalisation
//! (Golub & Van Loan, "Matrix Computations", 10.1). They are counted afterwards, so that none is
//! missed. A beam's low modes are far apart in 1/lambda, so that a few steps more than modes
//! suffice, each of them two solutions with the banded factor. All pairs come from the dense matrix, whose
//! time grows with the cube of its size: small ones only.
//!
//! The matrices are symmetric and of a fixed half-bandwidth, which lets the compiler unroll every inner loop: 3 for slender beams,
//! 5 for beams that their width stiffens, 6 where a resonator has a motion between two nodes.

use crate::StructureError;
use nalgebra::{DMatrix, SymmetricEigen};

/// Eigenvalues, ascending, and their vectors of unit modal mass.
pub(crate) struct Eigenpairs {
    pub(crate) values: Vec<f64>,
    pub(crate) vectors: Vec<Vec<f64>>,
}

impl Eigenpairs {
    fn sorted(self) -> Self {
        let order = descending(&self.values).into_iter().rev();
        let (mut values, mut vectors) = (Vec::new(), Vec::new());
        for index in order {
            values.push(self.values[index]);
            vectors.push(self.vectors[index].clone());
        }
        Self { values, vectors }
    }
}

/// Largest distance of a Ritz vector from an eigenvector (1). A frequency formed from the vector is
/// exact to about its square.
const RESIDUAL: f64 = 1e-8;

/// Returns the lowest `count` pairs.
///
/// With rigid motions K is singular and `shift` M is added to it. `highest` is the magnitude of the
/// highest eigenvalue, by which rounding is judged. `locked` are rigid motions known beforehand,
/// whose equal eigenvalues the method would confuse.
///
/// # Errors
/// [`StructureError::FiniteElements`] where K is not positive definite or too small.
pub(crate) fn lowest_pairs<const N: usize>(
    stiffness: &BandedMatrix<N>,
    mass: &BandedMatrix<N>,
    shift: f64,
    highest: f64,
    locked: &[Vec<f64>],
    count: usize,
) -> Result<Eigenpairs, StructureError> {
    if count > stiffness.size() {
        return Err(failure("more modes than degrees of freedom; divide finer"));
    }
    let shifted = stiffness.plus(shift, mass);
    let factor = shifted
        .cholesky()
        .ok_or_else(|| failure("it is not stable: the axial force buckles it"))?;
    let mut known = locked.to_vec();
    // Of equal eigenvalues, as those of two equal beams side by side, every turn finds one.
    for _ in 0..2 {
        let number = known.len() + count - locked.len().min(count);
        let Some(mut pairs) = Lanczos::new(&factor, mass, &known).lowest(number) else {
            break;
        };
        if known.len() > locked.len() {
            pairs = pairs.sorted();
        }
        let top = pairs.values.iter().take(count).next_back();
        let top = top.copied().unwrap_or(0.0);
        // Two eigenvalues nearer than that are one: rounding moves each by some parts in 1e16 of
        // the highest.
        let limit = top + 1e-7 * top + 1e-15 * highest;
        let below = pairs.values.iter().filter(|value| **value <= limit).count();
        if shifted.plus(-limit, mass).negative_eigenvalues() == Some(below) {
            pairs.values.truncate(count);
            pairs.vectors.truncate(count);
            pairs.values.iter_mut().for_each(|value| *value -= shift);
            return Ok(pairs);
        }
        known = pairs.vectors;
    }
    let mut pairs = all_pairs(stiffness, mass, shift)?;
    pairs.values.truncate(count);
    pairs.vectors.truncate(count);
    Ok(pairs)
}

/// Motions for each force that stand for all modes beyond some. The error of the answer is the eighth power of
/// omega^2 over the square of the lowest mode left out.
const MOTIONS: usize = 4;

/// Returns the lowest `count` pairs, followed by pairs that stand for all higher ones in the answer to `forces`.
/// The other arguments are those of [`lowest_pairs`].
///
/// The modes miss a part of the static answer to a force. This part is a motion of its own, and so is what they
/// miss of the answer to its inertia, and so on (Krylov's sequence; MacNeal 1971, Rubin 1975).
///
/// # Errors
/// As [`lowest_pairs`].
pub(crate) fn pairs_for_forces<const N: usize>(
    [stiffness, mass]: [&BandedMatrix<N>; 2],
    shift: f64,
    highest: f64,
    locked: &[Vec<f64>],
    count: usize,
    forces: &[Vec<f64>],
) -> Result<Eigenpairs, StructureError> {
    if count + MOTIONS * forces.len() >= stiffness.size() {
        return all_pairs(stiffness, mass, shift);
    }
    let mut pairs = lowest_pairs(stiffness, mass, shift, highest, locked, count)?;
    let motions = motions_beyond(&pairs, [&stiffness.plus(shift, mass), mass], forces);
    let among = DMatrix::from_fn(motions.len(), motions.len(), |row, column| {
        dot(&stiffness.times(&motions[row]), &motions[column])
    });
    if motions.is_empty() || !among.iter().all(|entry| entry.is_finite()) {
        return all_pairs(stiffness, mass, shift);
    }
    let eigen = SymmetricEigen::try_new(among, f64::EPSILON, 10_000)
        .ok_or_else(|| failure("its eigenvalues did not settle"))?;
    for i in descending(eigen.eigenvalues.as_slice()).into_iter().rev() {
        let mut vector = vec![0.0; mass.size()];
        for (motion, weight) in motions.iter().zip(eigen.eigenvectors.column(i).iter()) {
            add_multiple(&mut vector, *weight, motion);
        }
        pairs.values.push(eigen.eigenvalues[i]);
        pairs.vectors.push(vector);
    }
    Ok(pairs)
}

/// Returns motions of unit modal mass, orthogonal to each other and to the modes by their mass: the static answers to
/// the forces, and the answers to their inertia. Empty where nothing withstands the forces.
fn motions_beyond<const N: usize>(
    modes: &Eigenpairs,
    [stiffness, mass]: [&BandedMatrix<N>; 2],
    forces: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    let Some(factor) = stiffness.cholesky() else {
        return Vec::new();
    };
    let mut motions: Vec<Vec<f64>> = Vec::new();
    let mut loads = forces.to_vec();
    for _ in 0..MOTIONS {
        for load in &mut loads {
            factor.solve_lower(load);
            factor.solve_upper(load);
            // Twice, for the first time leaves its own rounding.
            for _ in 0..2 {
                let pulled = mass.times(load);
                for other in modes.vectors.iter().chain(&motions) {
                    add_multiple(load, -dot(&pulled, other), other);
                }
            }
            let size = dot(load, &mass.times(load)).sqrt();
            load.iter_mut().for_each(|value| *value /= size);
            motions.push(load.clone());
            *load = mass.times(load);
        }
    }
    motions
}

/// Returns all pairs. `shift` M is added to K where K is singular, and taken off again.
///
/// # Errors
/// [`StructureError::FiniteElements`] where K + shift M is not positive definite.
fn all_pairs<const N: usize>(
    stiffness: &BandedMatrix<N>,
    mass: &BandedMatrix<N>,
    shift: f64,
) -> Result<Eigenpairs, StructureError> {
    let factor = stiffness
        .plus(shift, mass)
        .cholesky()
        .ok_or_else(|| failure("the stiffness matrix is not positive definite"))?;
    let mut inverse = mass.dense();
    for _ in 0..2 {
        let columns = inverse.column_iter_mut();
        columns.for_each(|mut column| factor.solve_lower(column.as_mut_slice()));
        inverse = inverse.transpose();
    }
    if !inverse.iter().all(|entry| entry.is_finite()) {
        return Err(failure("the stiffness matrix is nearly singular"));
    }
    let inverse = 0.5 * (&inverse + inverse.transpose());
    let eigen = SymmetricEigen::try_new(inverse, f64::EPSILON, 10_000)
        .ok_or_else(|| failure("its eigenvalues did not settle"))?;
    let mut pairs = Eigenpairs {
        values: Vec::new(),
        vectors: Vec::new(),
    };
    for i in descending(eigen.eigenvalues.as_slice()) {
        let value = eigen.eigenvalues[i];
        if value <= 0.0 {
            break;
        }
        let mut vector = eigen.eigenvectors.column(i).as_slice().to_vec();
        factor.solve_upper(&mut vector);
        // y^T M' y = 1/lambda for a unit vector y of M' = L^-1 M L^-T, and x = L^-T y.
        vector.iter_mut().for_each(|entry| *entry /= value.sqrt());
        pairs.values.push(1.0 / value - shift);
        pairs.vectors.push(vector);
    }
    Ok(pairs)
}

pub(crate) fn failure(reason: &str) -> StructureError {
    StructureError::FiniteElements {
        reason: reason.to_owned(),
    }
}

/// Indices of the values, the largest value first.
fn descending(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    order
}

/// Beyond so many vectors their rounding adds up: they stay orthogonal only if each is made so twice.
const EXACT_STEPS: usize = 60;

/// The growing subspace of Lanczos's recursion.
struct Lanczos<'a, const N: usize> {
    factor: &'a CholeskyFactor<N>,
    mass: &'a BandedMatrix<N>,
    locked: usize,
    /// Orthonormal: the locked vectors, then those of the recursion.
    basis: Vec<Vec<f64>>,
    /// The projected matrix, which is tridiagonal.
    diagonal: Vec<f64>,
    beside: Vec<f64>,
}

impl<'a, const N: usize> Lanczos<'a, N> {
    fn new(factor: &'a CholeskyFactor<N>, mass: &'a BandedMatrix<N>, locked: &[Vec<f64>]) -> Self {
        let mut basis: Vec<Vec<f64>> = Vec::new();
        for motion in locked {
            // A vector x of the problem is y = L^T x of this method.
            let mut vector = factor.transpose_times(motion);
            orthogonalise(&mut vector, &basis);
            orthogonalise(&mut vector, &basis);
            normalise(&mut vector);
            basis.push(vector);
        }
        // Multiples of the golden ratio, modulo 1: no mode is orthogonal to them.
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        let mut start: Vec<f64> = (1..=mass.size())
            .map(|i| (i as f64 * golden).fract() - 0.5)
            .collect();
        orthogonalise(&mut start, &basis);
        normalise(&mut start);
        basis.push(start);
        Self {
            factor,
            mass,
            locked: locked.len(),
            basis,
            diagonal: Vec::new(),
            beside: Vec::new(),
        }
    }

    /// The locked pairs and the lowest others, `None` where the subspace ends before all are found.
    fn lowest(mut self, count: usize) -> Option<Eigenpairs> {
        let wanted = count.saturating_sub(self.locked);
        let most = self.mass.size() - self.locked;
        // A beam's modes settle after about twice as many steps; with what is fastened to it some more.
        let first_look = (2 * wanted + 2).min(most);
        // A look decomposes a dense matrix: as many of them for many modes as for few.
        let between = (wanted / 8).max(2);
        while self.diagonal.len() < most {
            let last = &self.basis[self.basis.len() - 1];
            let mut half = last.clone();
            self.factor.solve_upper(&mut half);
            let mut next = self.mass.times(&half);
            self.factor.solve_lower(&mut next);
            self.diagonal.push(dot(&next, last));
            orthogonalise(&mut next, &self.basis);
            if self.basis.len() > EXACT_STEPS {
                orthogonalise(&mut next, &self.basis);
            }
            let length = normalise(&mut next);
            self.beside.push(length);
            self.basis.push(next);
            // Otherwise only rounding was left to add.
            let goes_on = length > 1e-15 * self.diagonal[0].abs();
            let steps = self.diagonal.len();
            let looks = steps >= first_look && (steps - first_look).is_multiple_of(between);
            if looks || steps == most || !goes_on {
                let pairs = self.converged(wanted);
                if pairs.is_some() || !goes_on {
                    return pairs;
                }
            }
        }
        None
    }

    /// The locked pairs and the wanted ones, where all of them have settled.
    fn converged(&self, wanted: usize) -> Option<Eigenpairs> {
        // Two or three turns per eigenvalue are usual.
        const MOST_TURNS: usize = 60;
        let steps = self.diagonal.len();
        let projected = DMatrix::from_fn(steps, steps, |row, column| match row.abs_diff(column) {
            0 => self.diagonal[row],
            1 => self.beside[row.min(column)],
            _ => 0.0,
        });
        let eigen = SymmetricEigen::try_new(projected, f64::EPSILON, MOST_TURNS * steps)?;
        let inverses = &eigen.eigenvalues;
        let mut order = descending(inverses.as_slice());
        order.truncate(wanted);
        let coupling = self.beside[steps - 1];
        // What rounding leaves beside the largest, where it still does no harm.
        let largest = order.first().map_or(0.0, |&i| inverses[i].abs());
        let rounding = 16.0 * f64::EPSILON * largest;
        let settled = order.iter().all(|&i| {
            let residual = coupling * eigen.eigenvectors[(steps - 1, i)].abs();
            let least = rounding.min(1e3 * RESIDUAL * inverses[i]);
            residual <= least.max(RESIDUAL * inverses[i])
        });
        if order.len() < wanted || !settled {
            return None;
        }
        let mut pairs = Eigenpairs {
            values: Vec::new(),
            vectors: Vec::new(),
        };
        for vector in &self.basis[..self.locked] {
            let (vector, modal_mass) = self.physical(vector.clone());
            pairs.values.push(1.0 / modal_mass);
            pairs.vectors.push(vector);
        }
        for i in order {
            let mut vector = vec![0.0; self.mass.size()];
            let weights = eigen.eigenvectors.column(i);
            for (basis, weight) in self.basis[self.locked..].iter().zip(weights.iter()) {
                add_multiple(&mut vector, *weight, basis);
            }
            pairs.values.push(1.0 / inverses[i]);
            pairs.vectors.push(self.physical(vector).0);
        }
        Some(pairs)
    }

    /// x = L^-T y scaled to unit modal mass, and the modal mass before.
    fn physical(&self, mut vector: Vec<f64>) -> (Vec<f64>, f64) {
        self.factor.solve_upper(&mut vector);
        let modal_mass = dot(&vector, &self.mass.times(&vector));
        let size = modal_mass.sqrt();
        vector.iter_mut().for_each(|value| *value /= size);
        (vector, modal_mass)
    }
}

/// Inner product.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums beside each other: one alone would wait for its own last addition.
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest = a4.remainder().iter().zip(b4.remainder());
    let rest: f64 = rest.map(|(x, y)| x * y).sum();
    for (x, y) in a4.zip(b4) {
        for i in 0..4 {
            sums[i] += x[i] * y[i];
        }
    }
    sums.iter().sum::<f64>() + rest
}

fn add_multiple(vector: &mut [f64], factor: f64, other: &[f64]) {
    for (value, part) in vector.iter_mut().zip(other) {
        *value += factor * part;
    }
}

fn orthogonalise(vector: &mut [f64], basis: &[Vec<f64>]) {
    for other in basis {
        let share = dot(vector, other);
        add_multiple(vector, -share, other);
    }
}

/// Scales to length 1 and returns the length before.
fn normalise(vector: &mut [f64]) -> f64 {
    let length = dot(vector, vector).sqrt();
    if length > 0.0 {
        vector.iter_mut().for_each(|value| *value /= length);
    }
    length
}

/// Entries of a row of a beam's matrices, the diagonal included, where nodes have two motions: an element reaches three
/// equations to the left.
pub(crate) const SLENDER_ROW: usize = 4;
/// Entries of a row where nodes have three motions, so that an element reaches five equations to the left.
pub(crate) const BEAM_ROW: usize = 6;
/// Entries of a row where the motion of a resonator lies between those of two nodes.
pub(crate) const RESONATOR_ROW: usize = 7;

/// A symmetric banded matrix. A row has the entries left of the diagonal (nearest last), and the diagonal at the end.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BandedMatrix<const N: usize = BEAM_ROW> {
    pub(crate) rows: Vec<[f64; N]>,
}

/// Lower Cholesky factor of a positive definite matrix. The diagonal holds reciprocals.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CholeskyFactor<const N: usize = BEAM_ROW> {
    rows: Vec<[f64; N]>,
}

/// Factor L D L^T of any symmetric matrix: L D left of the diagonal, 1/D on it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LdlFactor<const N: usize = BEAM_ROW> {
    rows: Vec<[f64; N]>,
}

impl<const N: usize> BandedMatrix<N> {
    const HALF_BAND: usize = N - 1;

    /// The zero matrix of `size` rows.
    pub(crate) fn zeros(size: usize) -> Self {
        Self {
            rows: vec![[0.0; N]; size],
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
            self.rows[row][Self::HALF_BAND + column - row] += value;
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
            let mut sum = entries[Self::HALF_BAND] * x[row];
            for back in 1..=Self::HALF_BAND.min(row) {
                let entry = entries[Self::HALF_BAND - back];
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
            for back in 0..=Self::HALF_BAND.min(row) {
                dense[(row, row - back)] = entries[Self::HALF_BAND - back];
                dense[(row - back, row)] = entries[Self::HALF_BAND - back];
            }
        }
        dense
    }

    /// Returns the Cholesky factor, `None` where the matrix is not positive definite.
    pub(crate) fn cholesky(&self) -> Option<CholeskyFactor<N>> {
        let mut rows = self.rows.clone();
        for row in 0..rows.len() {
            let mut own = rows[row];
            for back in (1..=Self::HALF_BAND.min(row)).rev() {
                let other = &rows[row - back];
                let mut rest = own[Self::HALF_BAND - back];
                for further in back + 1..=Self::HALF_BAND.min(row) {
                    rest -=
                        own[Self::HALF_BAND - further] * other[Self::HALF_BAND + back - further];
                }
                own[Self::HALF_BAND - back] = rest * other[Self::HALF_BAND];
            }
            let squares: f64 = own[..Self::HALF_BAND]
                .iter()
                .map(|entry| entry * entry)
                .sum();
            let rest = own[Self::HALF_BAND] - squares;
            // A NaN is no positive pivot either.
            if rest.is_nan() || rest <= 0.0 {
                return None;
            }
            own[Self::HALF_BAND] = 1.0 / rest.sqrt();
            rows[row] = own;
        }
        Some(CholeskyFactor { rows })
    }

    /// Returns the factor L D L^T without exchange of rows, which a pivot of zero by chance makes
    /// infinite.
    pub(crate) fn ldl(&self) -> LdlFactor<N> {
        let mut rows = self.rows.clone();
        for row in 0..rows.len() {
            let mut own = rows[row];
            for back in (1..=Self::HALF_BAND.min(row)).rev() {
                for further in back + 1..=Self::HALF_BAND.min(row) {
                    let other = rows[row - back][Self::HALF_BAND + back - further];
                    let inverse = rows[row - further][Self::HALF_BAND];
                    own[Self::HALF_BAND - back] -= own[Self::HALF_BAND - further] * other * inverse;
                }
            }
            for back in 1..=Self::HALF_BAND.min(row) {
                let entry = own[Self::HALF_BAND - back];
                own[Self::HALF_BAND] -= entry * entry * rows[row - back][Self::HALF_BAND];
            }
            own[Self::HALF_BAND] = 1.0 / own[Self::HALF_BAND];
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
            let inverse = row[Self::HALF_BAND];
            if inverse.is_nan() {
                return None;
            }
            count += usize::from(inverse.is_sign_negative());
        }
        Some(count)
    }
}

impl<const N: usize> CholeskyFactor<N> {
    const HALF_BAND: usize = N - 1;

    /// Solves L x = b in place.
    pub(crate) fn solve_lower(&self, x: &mut [f64]) {
        for row in 0..x.len() {
            let entries = &self.rows[row];
            let mut rest = x[row];
            for back in (1..=Self::HALF_BAND.min(row)).rev() {
                rest -= entries[Self::HALF_BAND - back] * x[row - back];
            }
            x[row] = rest * entries[Self::HALF_BAND];
        }
    }

    /// Solves L^T x = b in place.
    pub(crate) fn solve_upper(&self, x: &mut [f64]) {
        for row in (0..x.len()).rev() {
            let entries = &self.rows[row];
            let value = x[row] * entries[Self::HALF_BAND];
            x[row] = value;
            for back in 1..=Self::HALF_BAND.min(row) {
                x[row - back] -= entries[Self::HALF_BAND - back] * value;
            }
        }
    }

    /// Returns L^T x.
    pub(crate) fn transpose_times(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; x.len()];
        for (row, entries) in self.rows.iter().enumerate() {
            product[row] += x[row] / entries[Self::HALF_BAND];
            for back in 1..=Self::HALF_BAND.min(row) {
                product[row - back] += entries[Self::HALF_BAND - back] * x[row];
            }
        }
        product
    }
}
