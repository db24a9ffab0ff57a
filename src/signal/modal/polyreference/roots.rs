//! Roots of the denominator.
//!
//! For one input the denominator is a scalar polynomial. Its roots follow from those of the order before by the
//! simultaneous iteration of Aberth and Ehrlich (Aberth 1973, Bini 1996). Its sweeps cost n^2 operations, where the
//! eigenvalues of a companion matrix cost n^3.
//!
//! The eigenvalues serve matrix polynomials, the first order, and the rare polynomial where the iteration does not
//! converge or finds a root twice.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;

/// Sweeps allowed; five to ten are usual.
const MOST_SWEEPS: usize = 40;
/// Last step over the distance to the nearest root: its square is below the rounding.
const SETTLED: f64 = 1e-8;
/// Largest error of the sum of the roots, relative to the sum of their moduli. A root found twice exceeds it.
const SUM_TOLERANCE: f64 = 1e-8;

/// Returns the inverse roots w = 1/z of I + A_1 z + ... + A_n z^n, `coefficients` being A_1 ... A_n one below the
/// other. `before` are those of the order before.
pub(super) fn inverse_roots(
    coefficients: &DMatrix<Complex64>,
    before: &[Complex64],
) -> Vec<Complex64> {
    let (size, inputs) = coefficients.shape();
    let simultaneous = (inputs == 1 && before.len() + 1 == size)
        .then(|| simultaneous_roots(coefficients.as_slice(), before))
        .flatten();
    simultaneous.unwrap_or_else(|| companion_roots(coefficients))
}

/// Returns the roots of w^n + a_1 w^{n-1} + ... + a_n; `None` where the iteration does not converge.
///
/// A step takes N/(1 - N S) from the root w_i. N = p(w_i)/p'(w_i) is Newton's step, and S = sum over k other than i of
/// 1/(w_i - w_k) takes the other roots out of p. A root is found where |p| is within the rounding of Horner's scheme, or
/// where the step is so small that what it leaves, its square at most, is rounding. The roots sum to -a_1, which shows a
/// root that was found twice.
fn simultaneous_roots(coefficients: &[Complex64], before: &[Complex64]) -> Option<Vec<Complex64>> {
    let mut roots = before.to_vec();
    roots.push(in_widest_gap(before));
    let moduli: Vec<f64> = coefficients.iter().map(|a| a.norm()).collect();
    let mut open: Vec<usize> = (0..roots.len()).collect();
    for _ in 0..MOST_SWEEPS {
        open.retain(|&index| {
            let root = roots[index];
            let (mut value, mut slope) = (Complex64::ONE, Complex64::ZERO);
            let (mut size, radius) = (1.0, root.norm());
            for (a, modulus) in coefficients.iter().zip(&moduli) {
                slope = slope * root + value;
                value = value * root + a;
                size = size * radius + modulus;
            }
            if value.norm() <= f64::EPSILON * size {
                return false;
            }
            let (mut re, mut im, mut nearest) = (0.0, 0.0, f64::INFINITY);
            let (left, right) = roots.split_at(index);
            for other in left.iter().chain(&right[1..]) {
                let away = root - other;
                let square = away.norm_sqr();
                nearest = square.min(nearest);
                let inverse = 1.0 / square;
                re += away.re * inverse;
                im -= away.im * inverse;
            }
            // N/(1 - N S) = p/(p' - p S), which no p' of 0 disturbs.
            let step = value / (slope - value * Complex64::new(re, im));
            roots[index] = root - step;
            // A step that is no number stays open.
            !(step.norm_sqr() <= SETTLED * SETTLED * nearest.min(radius * radius))
        });
        if open.is_empty() {
            break;
        }
    }
    let sum: Complex64 = roots.iter().sum();
    let size: f64 = roots.iter().map(|root| root.norm()).sum();
    let is_whole = (sum + coefficients[0]).norm() <= SUM_TOLERANCE * size;
    (open.is_empty() && is_whole).then_some(roots)
}

/// Returns a start for one more root: in the middle of the widest angle between two roots, at their mean modulus.
fn in_widest_gap(roots: &[Complex64]) -> Complex64 {
    let mut angles: Vec<f64> = roots.iter().map(|root| root.arg()).collect();
    angles.sort_by(f64::total_cmp);
    let first = angles.first().map(|angle| angle + TAU);
    let after = angles.iter().skip(1).copied().chain(first);
    let gaps = angles
        .iter()
        .zip(after)
        .map(|(angle, next)| (next - angle, *angle));
    let widest = gaps.max_by(|a, b| a.0.total_cmp(&b.0));
    let (gap, angle) = widest.unwrap_or_default();
    let modulus = roots.iter().map(|root| root.norm()).sum::<f64>() / roots.len().max(1) as f64;
    Complex64::from_polar(modulus, angle + 0.5 * gap)
}

/// Steps allowed for each eigenvalue; two or three are usual.
const MOST_STEPS: usize = 60;

/// Returns the inverse roots as eigenvalues.
///
/// With A_0 = I the polynomial in w, I w^n + A_1 w^{n-1} + ... + A_n, is monic; its block companion
/// matrix has -A_1 ... -A_n as first row of blocks and identities below the diagonal.
fn companion_roots(coefficients: &DMatrix<Complex64>) -> Vec<Complex64> {
    let (size, inputs) = coefficients.shape();
    let mut companion = DMatrix::zeros(size, size);
    for index in 0..size {
        let block = index / inputs * inputs;
        for row in 0..inputs {
            companion[(row, index)] = -coefficients[(block + row, index % inputs)];
        }
        if index + inputs < size {
            companion[(index + inputs, index)] = Complex64::ONE;
        }
    }
    if inputs > 1 && size > 2 {
        companion = companion.hessenberg().unpack_h();
    }
    hessenberg_eigenvalues(companion)
}

/// Eigenvalues of an upper Hessenberg matrix by the shifted QR algorithm (Golub & Van Loan, 7.5), complex
/// single shifts after Wilkinson. Those that do not converge are left out.
///
/// nalgebra's complex Schur decomposition finds the same eigenvalues as exactly, in about six times the time
/// (`benches/polyreference.rs`). Here each step turns the active block alone, and a companion matrix needs no
/// reduction first.
fn hessenberg_eigenvalues(mut h: DMatrix<Complex64>) -> Vec<Complex64> {
    let mut found = Vec::with_capacity(h.nrows());
    let mut end = h.nrows();
    let mut steps = 0;
    while end > 0 {
        // First row of the block that ends before `end` and has no negligible subdiagonal.
        let mut rows = (1..end).rev();
        let start = rows.find(|&k| {
            let scale = h[(k, k)].l1_norm() + h[(k - 1, k - 1)].l1_norm();
            h[(k, k - 1)].l1_norm() <= f64::EPSILON * scale
        });
        let start = start.unwrap_or(0);
        if start + 1 == end || steps >= MOST_STEPS {
            if start + 1 == end {
                found.push(h[(end - 1, end - 1)]);
            }
            end -= 1;
            steps = 0;
            continue;
        }
        steps += 1;
        let shift = if steps % 10 == 0 {
            // An exceptional shift breaks a cycle.
            h[(end - 1, end - 1)] + h[(end - 1, end - 2)].norm()
        } else {
            wilkinson_shift(&h, end)
        };
        qr_step(&mut h, start, end, shift);
    }
    found
}

/// Eigenvalue of the last two by two block that is nearer to its last entry.
fn wilkinson_shift(h: &DMatrix<Complex64>, end: usize) -> Complex64 {
    let (a, b) = (h[(end - 2, end - 2)], h[(end - 2, end - 1)]);
    let (c, d) = (h[(end - 1, end - 2)], h[(end - 1, end - 1)]);
    // d - bc/(t + sign sqrt(t^2 + bc)), t = (a - d)/2.
    let half = (a - d) * 0.5;
    let product = b * c;
    let root = (half * half + product).sqrt();
    let ahead = (half.conj() * root).re >= 0.0;
    let sum = if ahead { half + root } else { half - root };
    match sum.norm_sqr() == 0.0 {
        true => d,
        false => d - product / sum,
    }
}

/// One step H - s I = Q R, H' = R Q + s I on the rows and columns from `start` to `end`.
///
/// Every inner loop runs over elements that do not depend on each other, so that the processor can
/// overlap them.
fn qr_step(h: &mut DMatrix<Complex64>, start: usize, end: usize, shift: Complex64) {
    let rows = h.nrows();
    let values = h.as_mut_slice();
    for index in start..end {
        values[index * rows + index] -= shift;
    }
    let mut turns: Vec<(f64, Complex64)> = Vec::with_capacity(end - start);
    for k in start..end - 1 {
        let place = k * rows + k;
        // Cosine (real) and sine of the rotation [c s; -conj(s) c] that takes (a, b) to (r, 0).
        let (a, b) = (values[place], values[place + 1]);
        let length = (a.norm_sqr() + b.norm_sqr()).sqrt();
        // Companion matrices of a fit are of order one: no overflow to guard against.
        let size = a.norm_sqr().sqrt();
        let (c, s) = if length == 0.0 {
            (1.0, Complex64::ZERO)
        } else if size == 0.0 {
            (0.0, b.conj() / length)
        } else {
            (size / length, a / size * b.conj() / length)
        };
        for column in values[k * rows..end * rows].chunks_exact_mut(rows) {
            let (x, y) = (column[k], column[k + 1]);
            column[k] = x * c + s * y;
            column[k + 1] = y * c - s.conj() * x;
        }
        turns.push((c, s));
    }
    for (k, &(c, s)) in (start..).zip(&turns) {
        // R Q: columns turn with the conjugate; R is zero below row k + 1 here.
        let (left, right) = values[k * rows..(k + 2) * rows].split_at_mut(rows);
        let (left, right) = (&mut left[start..k + 2], &mut right[start..k + 2]);
        for (a, b) in left.iter_mut().zip(right) {
            let (x, y) = (*a, *b);
            *a = x * c + y * s.conj();
            *b = y * c - x * s;
        }
    }
    for index in start..end {
        values[index * rows + index] += shift;
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Coefficients a_1 ... a_n of the polynomial with these roots.
    fn polynomial(roots: &[Complex64]) -> Vec<Complex64> {
        let mut coefficients = vec![Complex64::ONE];
        for root in roots {
            coefficients.push(Complex64::ZERO);
            for k in (1..coefficients.len()).rev() {
                let lower = coefficients[k - 1];
                coefficients[k] -= root * lower;
            }
        }
        coefficients.split_off(1)
    }

    /// Largest distance from a root of `a` to the nearest of `b`.
    fn distance(a: &[Complex64], b: &[Complex64]) -> f64 {
        let nearest = |x: &Complex64| {
            let distances = b.iter().map(|y| (x - y).norm());
            distances.fold(f64::INFINITY, f64::min)
        };
        a.iter().map(nearest).fold(0.0, f64::max)
    }

    #[test]
    fn prop_both_ways_find_the_roots_of_every_order() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut roots = Vec::new();
        for order in 1..=40 {
            let modulus = random.random_range(0.8..1.05);
            // Turns by the golden angle spread over the circle at every order.
            let angle = 2.4 * f64::from(order) + random.random_range(-0.03..0.03);
            let before = roots.clone();
            roots.push(Complex64::from_polar(modulus, angle));
            let coefficients = polynomial(&roots);
            let size = coefficients.len();
            let eigenvalues = companion_roots(&DMatrix::from_column_slice(size, 1, &coefficients));
            let found = simultaneous_roots(&coefficients, &before).unwrap();
            assert_eq!(found.len(), roots.len());
            assert!(distance(&found, &eigenvalues) < 1e-9, "{order}");
            assert!(distance(&roots, &found) < 1e-9, "{order}");
        }
    }

    #[test]
    fn limit_roots_of_unity_are_found_from_those_of_any_start() {
        // w^n - 1.
        let mut coefficients = vec![Complex64::ZERO; 12];
        coefficients[11] = -Complex64::ONE;
        let before: Vec<Complex64> = (0..11)
            .map(|k| Complex64::from_polar(0.7, 0.4 * f64::from(k)))
            .collect();
        let found = simultaneous_roots(&coefficients, &before).unwrap();
        let exact: Vec<Complex64> = (0..12)
            .map(|k| Complex64::from_polar(1.0, TAU * f64::from(k) / 12.0))
            .collect();
        assert!(distance(&exact, &found) < 1e-14);
    }

    #[test]
    fn limit_a_start_with_equal_roots_falls_back_to_the_eigenvalues() {
        let exact = [0.5, 0.6, 0.9].map(Complex64::from);
        let coefficients = DMatrix::from_column_slice(3, 1, &polynomial(&exact));
        let found = inverse_roots(&coefficients, &[Complex64::from(0.7); 2]);
        assert!(distance(&exact, &found) < 1e-12);
    }
}
