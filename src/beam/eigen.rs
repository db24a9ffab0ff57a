//! The lowest eigenpairs of K x = lambda M x by Lanczos's method on L^-1 M L^-T, L L^T = K, with full
//! orthogonalisation (Golub & Van Loan, "Matrix Computations", 10.1), counted afterwards so that
//! none is missed.
//!
//! The low modes of a beam are far apart in 1/lambda, so that a few steps more than modes suffice,
//! each of them two solutions with the banded factor.

use super::banded::{Band, BandedSymmetric, Factor, HALF_BAND, lowest_eigenvectors};
use crate::StructureError;

/// Eigenvalues ascending, and their vectors of unit modal mass.
pub(super) struct Pairs {
    pub(super) values: Vec<f64>,
    pub(super) vectors: Vec<Vec<f64>>,
}

/// How far a Ritz vector may be from an eigenvector. A frequency formed from the vector is exact to
/// about the square.
const RESIDUAL: f64 = 1e-8;

/// The lowest `count` pairs. With rigid motions K is singular and `shift` M is added to it;
/// `highest` is the magnitude of the highest eigenvalue, which says how far rounding goes; `locked` are rigid motions known beforehand, whose equal eigenvalues the method would confuse.
pub(super) fn lowest_pairs(
    stiffness: &Band,
    mass: &Band,
    (shift, highest): (f64, f64),
    locked: &[Vec<f64>],
    count: usize,
) -> Result<Pairs, StructureError> {
    // Two eigenvalues nearer than that are one: rounding moves each by some parts in 1e16 of the
    // highest.
    let apart = |value: f64| 1e-7 * value + 1e-15 * highest;
    if count > stiffness.size() {
        return Err(failure("more modes than degrees of freedom; divide finer"));
    }
    let shifted = stiffness.plus(shift, mass);
    let factor = shifted
        .cholesky()
        .ok_or_else(|| failure("it is not stable: the axial force buckles it"))?;
    let found = Krylov::new(&factor, mass, locked).lowest(count);
    if let Some(pairs) = found {
        let top = pairs.values.last().copied().unwrap_or(0.0);
        let trial = shifted.plus(-top - apart(top), mass);
        if trial.negative_eigenvalues() == Some(count) {
            return Ok(unshifted(pairs, shift));
        }
    }
    let pairs = by_subspace(&shifted, mass, count, apart)?;
    Ok(unshifted(pairs, shift))
}

fn failure(reason: &str) -> StructureError {
    StructureError::FiniteElements {
        reason: reason.to_owned(),
    }
}

fn unshifted(mut pairs: Pairs, shift: f64) -> Pairs {
    for value in &mut pairs.values {
        *value -= shift;
    }
    pairs
}

/// The growing subspace.
struct Krylov<'a> {
    factor: &'a Factor,
    mass: &'a Band,
    locked: usize,
    /// Orthonormal: the locked vectors, then those of the recursion.
    basis: Vec<Vec<f64>>,
    diagonal: Vec<f64>,
    beside: Vec<f64>,
}

impl<'a> Krylov<'a> {
    fn new(factor: &'a Factor, mass: &'a Band, locked: &[Vec<f64>]) -> Self {
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
        let locked = basis.len();
        basis.push(start);
        Self {
            factor,
            mass,
            locked,
            basis,
            diagonal: Vec::new(),
            beside: Vec::new(),
        }
    }

    /// `None` where the subspace ends before all are found.
    fn lowest(mut self, count: usize) -> Option<Pairs> {
        let wanted = count.saturating_sub(self.locked);
        let most = self.mass.size() - self.locked;
        // A beam's modes settle after about twice as many steps, with what is fastened to it some more.
        let first_look = (2 * wanted + 2).min(most);
        while self.diagonal.len() < most {
            let goes_on = self.step();
            let steps = self.diagonal.len();
            let looks = steps >= first_look && (steps - first_look).is_multiple_of(2);
            if !(looks || steps == most || !goes_on) {
                continue;
            }
            if let Some(pairs) = self.converged(wanted) {
                return Some(pairs);
            }
            if !goes_on {
                return None;
            }
        }
        None
    }

    /// One more vector; whether there is one.
    fn step(&mut self) -> bool {
        let last = &self.basis[self.basis.len() - 1];
        let mut half = last.clone();
        self.factor.solve_upper(&mut half);
        let mut next = vec![0.0; half.len()];
        self.mass.times_into(&half, &mut next);
        self.factor.solve_lower(&mut next);
        self.diagonal.push(dot(&next, last));
        orthogonalise(&mut next, &self.basis);
        let length = normalise(&mut next);
        self.beside.push(length);
        self.basis.push(next);
        // Below that there is only rounding.
        length > 1e-15 * self.diagonal[0].abs()
    }

    /// The wanted pairs where all of them have settled.
    fn converged(&self, wanted: usize) -> Option<Pairs> {
        let steps = self.diagonal.len();
        let (inverses, rotations) = eigen(&self.diagonal, &self.beside)?;
        let mut order: Vec<usize> = (0..steps).collect();
        order.sort_by(|&a, &b| inverses[b].total_cmp(&inverses[a]));
        order.truncate(wanted);
        let coupling = self.beside[steps - 1];
        // What rounding leaves beside the largest, where it still does no harm.
        let largest = order.first().map_or(0.0, |&i| inverses[i].abs());
        let rounding = 16.0 * f64::EPSILON * largest;
        let settled = |&i: &usize| {
            let residual = coupling * rotations[i][steps - 1].abs();
            let least = rounding.min(1e3 * RESIDUAL * inverses[i]);
            residual <= least.max(RESIDUAL * inverses[i])
        };
        if order.len() < wanted || !order.iter().all(settled) {
            return None;
        }
        let mut pairs = self.locked_pairs();
        for i in order {
            let vector = self.combination(&rotations[i]);
            pairs.values.push(1.0 / inverses[i]);
            pairs.vectors.push(self.physical(vector));
        }
        Some(pairs)
    }

    fn locked_pairs(&self) -> Pairs {
        let vectors: Vec<_> = self.basis[..self.locked]
            .iter()
            .map(|vector| self.physical(vector.clone()))
            .collect();
        let size = |vector: &Vec<f64>| 1.0 / dot(vector, &self.mass.times(vector));
        let values = self.basis[..self.locked].iter().map(|vector| {
            let mut half = vector.clone();
            self.factor.solve_upper(&mut half);
            size(&half)
        });
        Pairs {
            values: values.collect(),
            vectors,
        }
    }

    fn combination(&self, weights: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.mass.size()];
        for (vector, weight) in self.basis[self.locked..].iter().zip(weights) {
            for (total, value) in sum.iter_mut().zip(vector) {
                *total += weight * value;
            }
        }
        sum
    }

    /// x = L^-T y, of unit modal mass.
    fn physical(&self, mut vector: Vec<f64>) -> Vec<f64> {
        self.factor.solve_upper(&mut vector);
        let size = dot(&vector, &self.mass.times(&vector)).sqrt();
        for value in &mut vector {
            *value /= size;
        }
        vector
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums beside each other: one alone would wait for its own last addition.
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4
        .remainder()
        .iter()
        .zip(b4.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in a4.zip(b4) {
        for i in 0..4 {
            sums[i] += x[i] * y[i];
        }
    }
    sums.iter().sum::<f64>() + rest
}

fn orthogonalise(vector: &mut [f64], basis: &[Vec<f64>]) {
    for other in basis {
        let share = dot(vector, other);
        for (value, part) in vector.iter_mut().zip(other) {
            *value -= share * part;
        }
    }
}

fn normalise(vector: &mut [f64]) -> f64 {
    let length = dot(vector, vector).sqrt();
    if length > 0.0 {
        for value in vector.iter_mut() {
            *value /= length;
        }
    }
    length
}

/// By subspace iteration, which finds equal eigenvalues too, and takes longer.
fn by_subspace(
    shifted: &Band,
    mass: &Band,
    count: usize,
    apart: impl Fn(f64) -> f64,
) -> Result<Pairs, StructureError> {
    // Some more, so that a group of equal ones is not cut in two.
    let width = (count + 4).min(shifted.size());
    let vectors = lowest_eigenvectors(&general(shifted), &general(mass), width)?;
    let mut pairs = Pairs {
        values: Vec::new(),
        vectors: Vec::new(),
    };
    for column in vectors.column_iter() {
        let mut vector: Vec<f64> = column.iter().copied().collect();
        let size = dot(&vector, &mass.times(&vector)).sqrt();
        vector.iter_mut().for_each(|value| *value /= size);
        pairs.values.push(dot(&vector, &shifted.times(&vector)));
        pairs.vectors.push(vector);
    }
    let top = pairs.values[count - 1] + 10.0 * apart(pairs.values[count - 1]);
    let below = pairs.values.iter().filter(|value| **value < top).count();
    if below < width && shifted.plus(-top, mass).negative_eigenvalues() != Some(below) {
        return Err(failure(
            "some of its modes lie too close together to be told apart",
        ));
    }
    pairs.values.truncate(count);
    pairs.vectors.truncate(count);
    Ok(pairs)
}

fn general(band: &Band) -> BandedSymmetric {
    let mut matrix = BandedSymmetric::zeros(band.size(), HALF_BAND);
    band.for_each(|row, column, value| matrix.add(row, column, value));
    matrix
}

// Eigenvalues and eigenvectors of a symmetric tridiagonal matrix by the implicitly shifted QL
// algorithm (Golub & Van Loan, "Matrix Computations", 8.3).

/// All eigenvalues, unordered, and for each its unit eigenvector; `None` where they do not settle.
/// `beside[i]` couples i and i + 1.
pub(super) fn eigen(diagonal: &[f64], beside: &[f64]) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
    // Two or three turns per eigenvalue are usual.
    const MOST_TURNS: usize = 60;
    let size = diagonal.len();
    let mut d = diagonal.to_vec();
    let mut e = beside[..size - 1].to_vec();
    e.push(0.0);
    let mut vectors: Vec<Vec<f64>> = (0..size)
        .map(|i| (0..size).map(|j| f64::from(u8::from(i == j))).collect())
        .collect();
    for first in 0..size {
        for turn in 0.. {
            let negligible =
                |m: &usize| e[*m].abs() <= f64::EPSILON * (d[*m].abs() + d[*m + 1].abs());
            let last = (first..size - 1).find(negligible).unwrap_or(size - 1);
            if last == first {
                break;
            }
            if turn == MOST_TURNS {
                return None;
            }
            chase(&mut d, &mut e, &mut vectors, (first, last));
        }
    }
    Some((d, vectors))
}

/// One turn on the block from `first` to `last`: a rotation that shifts towards the eigenvalue of
/// the leading two by two block, and those that restore the form.
fn chase(d: &mut [f64], e: &mut [f64], vectors: &mut [Vec<f64>], (first, last): (usize, usize)) {
    let half = (d[first + 1] - d[first]) / (2.0 * e[first]);
    let root = half.hypot(1.0).copysign(half);
    let mut g = d[last] - d[first] + e[first] / (half + root);
    let (mut sine, mut cosine, mut moved) = (1.0, 1.0, 0.0);
    for i in (first..last).rev() {
        let (f, b) = (sine * e[i], cosine * e[i]);
        // Inverses of eigenvalues in units of the first: far from overflow, and what underflows is nothing.
        let r = (f * f + g * g).sqrt();
        e[i + 1] = r;
        if r == 0.0 {
            // The block has come apart by itself.
            d[i + 1] -= moved;
            e[last] = 0.0;
            return;
        }
        (sine, cosine) = (f / r, g / r);
        let rest = d[i + 1] - moved;
        let mixed = (d[i] - rest) * sine + 2.0 * cosine * b;
        moved = sine * mixed;
        d[i + 1] = rest + moved;
        g = cosine * mixed - b;
        let (low, high) = vectors.split_at_mut(i + 1);
        for (x, y) in low[i].iter_mut().zip(&mut high[0]) {
            (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
        }
    }
    d[first] -= moved;
    e[first] = g;
    e[last] = 0.0;
}
