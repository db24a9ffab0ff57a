//! Eigenpairs of K x = lambda M x that start from the vectors of a problem next to it, by Rayleigh quotient iteration:
//!
//! ```text
//! (K - s M) x' = M x,   s = x^T K x / x^T M x
//! ```
//!
//! The error e of a vector becomes about e^3 in each step (Parlett 1998, "The Symmetric Eigenvalue Problem", 4.6 and 4.7).
//! The number of negative pivots of K - s M is that of the eigenvalues below s, so that no pair is missed or found twice.
//!
//! Rows of a banded matrix wait for each other. Several vectors are moved side by side, in lanes, which costs hardly more
//! than one.

use crate::eigen::BandedMatrix;

/// Most vectors that are moved side by side.
const MOST_LANES: usize = 8;

/// Largest distance of a vector from an eigenvector (1): that of [`crate::eigen::lowest_pairs`].
const DISTANCE: f64 = 1e-8;

/// Steps after which vectors that have not settled are given up.
const MOST_STEPS: usize = 5;

/// A vector after one step of the iteration.
pub(crate) struct Moved {
    /// The vector, of unit x^T M x.
    pub(crate) vector: Vec<f64>,
    /// The quotient s of the vector before.
    shift: f64,
    /// Sine of the angle between the vector before and this one.
    turned: f64,
    /// Largest distance of an eigenvalue from s.
    distance: f64,
    /// Number of eigenvalues below s.
    below: usize,
    /// Whether the eigenvalue of the vector lies below s.
    is_below: bool,
}

/// Returns each vector after one step, in the order of the vectors. `None` where a step fails.
pub(crate) fn moved<const N: usize>(
    matrices: [&BandedMatrix<N>; 2],
    vectors: &[Vec<f64>],
) -> Option<Vec<Moved>> {
    let mut all = Vec::with_capacity(vectors.len());
    for some in vectors.chunks(MOST_LANES) {
        match some.len() {
            ..=2 => moved_in_lanes::<N, 2>(matrices, some, &mut all)?,
            3..=4 => moved_in_lanes::<N, 4>(matrices, some, &mut all)?,
            5..=6 => moved_in_lanes::<N, 6>(matrices, some, &mut all)?,
            _ => moved_in_lanes::<N, MOST_LANES>(matrices, some, &mut all)?,
        }
    }
    Some(all)
}

/// Adds each vector after one step, a lane for each. Lanes without a vector repeat the last one.
fn moved_in_lanes<const N: usize, const LANES: usize>(
    [stiffness, mass]: [&BandedMatrix<N>; 2],
    vectors: &[Vec<f64>],
    all: &mut Vec<Moved>,
) -> Option<()> {
    let lane = |index: usize| &vectors[index.min(vectors.len() - 1)];
    let mut before = vec![[0.0; LANES]; N - 1];
    before.extend((0..mass.size()).map(|row| std::array::from_fn(|index| lane(index)[row])));
    let (pulled, strain) = product_and_square([stiffness, mass], &before);
    let kinetic = inner(&before, &pulled);
    let shifts = std::array::from_fn(|index| strain[index] / kinetic[index]);
    let (after, below) = solution([stiffness, mass], &shifts, &pulled);
    let (squares, along) = (square(mass, &after), inner(&after, &pulled));
    for index in 0..vectors.len() {
        let (size, along) = (squares[index].sqrt(), along[index]);
        if !size.is_finite() || size == 0.0 || along == 0.0 {
            return None;
        }
        let unit = kinetic[index].sqrt();
        let cosine = along / (size * unit);
        all.push(Moved {
            // Along the vector before: the matrix is near to singular, and of either sign.
            vector: after[N - 1..]
                .iter()
                .map(|x| x[index] / size.copysign(along))
                .collect(),
            shift: shifts[index],
            turned: (1.0 - cosine * cosine).max(f64::EPSILON).sqrt(),
            distance: unit / size,
            below: below[index],
            is_below: along < 0.0,
        });
    }
    Some(())
}

/// Returns the vectors of the lowest pairs, in ascending order, from vectors next to them. `None` where they do not
/// settle, or where others turn out to lie among them.
pub(crate) fn lowest_from<const N: usize>(
    matrices: [&BandedMatrix<N>; 2],
    mut vectors: Vec<Vec<f64>>,
) -> Option<Vec<Vec<f64>>> {
    for _ in 0..MOST_STEPS {
        let mut steps = moved(matrices, &vectors)?;
        steps.sort_by(|a, b| a.shift.total_cmp(&b.shift));
        let settled = have_settled(&steps)?;
        vectors = steps.into_iter().map(|one| one.vector).collect();
        if settled {
            return Some(vectors);
        }
    }
    None
}

/// Returns whether all vectors, by ascending quotients, are those of the lowest pairs. `None` where they have settled on
/// other ones.
///
/// A step leaves of each error the share |lambda - s|/|other lambda - s|, which is at most that of the distance and the gap.
fn have_settled(steps: &[Moved]) -> Option<bool> {
    // All eigenvalues are positive.
    let mut gap = steps.first()?.shift;
    for (index, one) in steps.iter().enumerate() {
        let next = steps.get(index + 1);
        let above = next.map_or(f64::INFINITY, |next| next.shift - next.distance - one.shift);
        let least = gap.min(above);
        // A NaN has not settled either.
        if !(one.distance < least && one.turned * one.distance < DISTANCE * least) {
            return Some(false);
        }
        gap = next.map_or(gap, |next| next.shift - one.shift - one.distance);
    }
    let mut all = steps.iter().enumerate();
    all.all(|(index, one)| one.below == index + usize::from(one.is_below))
        .then_some(true)
}

/// Returns M x and x^T K x. Rows of zeros stand before the first of x and of M x.
fn product_and_square<const N: usize, const LANES: usize>(
    [stiffness, mass]: [&BandedMatrix<N>; 2],
    x: &[[f64; LANES]],
) -> (Vec<[f64; LANES]>, [f64; LANES]) {
    let band = N - 1;
    let (mut product, mut square) = (vec![[0.0; LANES]; x.len()], [0.0; LANES]);
    for (row, (k, m)) in stiffness.rows.iter().zip(&mass.rows).enumerate() {
        let own = x[row + band];
        let mut pulled = own.map(|value| m[band] * value);
        let mut strained = own.map(|value| 0.5 * k[band] * value);
        for column in 0..band {
            let (other, there) = (x[row + column], &mut product[row + column]);
            for index in 0..LANES {
                pulled[index] += m[column] * other[index];
                strained[index] += k[column] * other[index];
                there[index] += m[column] * own[index];
            }
        }
        for index in 0..LANES {
            product[row + band][index] += pulled[index];
            square[index] += 2.0 * strained[index] * own[index];
        }
    }
    (product, square)
}

/// Returns x^T A x. Rows of zeros stand before the first of x.
fn square<const N: usize, const LANES: usize>(
    matrix: &BandedMatrix<N>,
    x: &[[f64; LANES]],
) -> [f64; LANES] {
    let band = N - 1;
    let mut square = [0.0; LANES];
    for (row, entries) in matrix.rows.iter().enumerate() {
        let own = x[row + band];
        let mut sum = own.map(|value| 0.5 * entries[band] * value);
        for column in 0..band {
            for index in 0..LANES {
                sum[index] += entries[column] * x[row + column][index];
            }
        }
        for index in 0..LANES {
            square[index] += 2.0 * sum[index] * own[index];
        }
    }
    square
}

/// Returns x^T y.
fn inner<const LANES: usize>(x: &[[f64; LANES]], y: &[[f64; LANES]]) -> [f64; LANES] {
    let mut inner = [0.0; LANES];
    for (a, b) in x.iter().zip(y) {
        for index in 0..LANES {
            inner[index] += a[index] * b[index];
        }
    }
    inner
}

/// Returns the solution of (K - s M) x = b for each lane, and the number of negative pivots, by L D L^T without exchange
/// of rows. Rows of zeros stand before the first of b and of x.
fn solution<const N: usize, const LANES: usize>(
    [stiffness, mass]: [&BandedMatrix<N>; 2],
    shifts: &[f64; LANES],
    right: &[[f64; LANES]],
) -> (Vec<[f64; LANES]>, [usize; LANES]) {
    let (band, size) = (N - 1, right.len() - (N - 1));
    // L left of the diagonal, 1/D on it. Rows of zeros before the first and behind the last spare the loops their ends.
    let mut factor = vec![[[0.0; LANES]; N]; size + 2 * band];
    let mut x = vec![[0.0; LANES]; size + 2 * band];
    let mut below = [0; LANES];
    for row in 0..size {
        // Left of the diagonal L D.
        let mut own = [[0.0; LANES]; N];
        for (entry, (k, m)) in own
            .iter_mut()
            .zip(stiffness.rows[row].iter().zip(&mass.rows[row]))
        {
            for index in 0..LANES {
                entry[index] = k - shifts[index] * m;
            }
        }
        for column in 1..band {
            let other = &factor[row + column];
            for further in 0..column {
                for index in 0..LANES {
                    own[column][index] -=
                        own[further][index] * other[band - column + further][index];
                }
            }
        }
        let mut value = right[row + band];
        for column in 0..band {
            let (inverse, above) = (factor[row + column][band], x[row + column]);
            for index in 0..LANES {
                let entry = own[column][index] * inverse[index];
                own[band][index] -= own[column][index] * entry;
                value[index] -= entry * above[index];
                own[column][index] = entry;
            }
        }
        for index in 0..LANES {
            // At an eigenvalue, which rounding moves by as much.
            if own[band][index] == 0.0 {
                own[band][index] = f64::EPSILON * stiffness.rows[row][band];
            }
            below[index] += usize::from(own[band][index] < 0.0);
            own[band][index] = 1.0 / own[band][index];
        }
        factor[row + band] = own;
        x[row + band] = value;
    }
    for row in (band..band + size).rev() {
        let mut value = x[row];
        for index in 0..LANES {
            value[index] *= factor[row][band][index];
        }
        for back in (1..=band).rev() {
            let (entry, other) = (factor[row + back][band - back], x[row + back]);
            for index in 0..LANES {
                value[index] -= entry[index] * other[index];
            }
        }
        x[row] = value;
    }
    x.truncate(band + size);
    (x, below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigen::{Eigenpairs, lowest_pairs};

    const SIZE: usize = 40;

    /// A chain of springs and masses whose first spring has the given stiffness.
    fn chain(first: f64) -> [BandedMatrix<3>; 2] {
        let (mut stiffness, mut mass) = (BandedMatrix::zeros(SIZE), BandedMatrix::zeros(SIZE));
        for row in 0..SIZE {
            let before = if row == 0 { first } else { 1.0 };
            stiffness.add(row, row, before + f64::from(u8::from(row + 1 < SIZE)));
            mass.add(row, row, 1.0 + 0.01 * row as f64);
            if row > 0 {
                stiffness.add(row, row - 1, -1.0);
            }
        }
        [stiffness, mass]
    }

    fn lowest([stiffness, mass]: &[BandedMatrix<3>; 2], count: usize) -> Eigenpairs {
        lowest_pairs(stiffness, mass, 0.0, 4.0, &[], count).unwrap()
    }

    fn quotient([stiffness, mass]: &[BandedMatrix<3>; 2], x: &[f64]) -> f64 {
        use crate::eigen::dot;
        dot(x, &stiffness.times(x)) / dot(x, &mass.times(x))
    }

    #[test]
    fn prop_pairs_from_a_neighbour_are_the_lowest_ones() {
        for count in [1, 2, 5, 9] {
            let start = lowest(&chain(1.0), count).vectors;
            for first in [1.0, 1.0 + 1e-6, 1.1, 3.0] {
                let own = chain(first);
                let found = lowest_from([&own[0], &own[1]], start.clone());
                let found = found.unwrap_or_else(|| panic!("{count} {first}"));
                for (vector, value) in found.iter().zip(lowest(&own, count).values) {
                    let error = quotient(&own, vector) / value - 1.0;
                    assert!(error.abs() < 1e-11, "{count} {first}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn limit_other_pairs_than_the_lowest_are_refused() {
        let own = chain(1.0);
        let mut start = lowest(&own, 6).vectors;
        start.remove(2);
        assert!(lowest_from([&own[0], &own[1]], start.clone()).is_none());
        // Two vectors that become one.
        start.truncate(2);
        start.push(start[1].clone());
        assert!(lowest_from([&own[0], &own[1]], start).is_none());
    }

    #[test]
    fn val_the_error_of_a_vector_falls_with_its_third_power() {
        let own = chain(1.0);
        let exact = lowest(&own, 2).vectors;
        let error_after = |error: f64| {
            let start = exact[0].iter().zip(&exact[1]);
            let start: Vec<f64> = start.map(|(a, b)| a + error * b).collect();
            let step = &moved([&own[0], &own[1]], &[start]).unwrap()[0];
            let rest = own[1].times(&step.vector);
            crate::eigen::dot(&exact[1], &rest).abs()
        };
        let ratio = error_after(2e-2) / error_after(1e-2);
        assert!((ratio - 8.0).abs() < 0.1, "{ratio}");
    }
}
