//! Roots of a matrix polynomial: eigenvalues of its block companion matrix.

use nalgebra::DMatrix;
use num_complex::Complex64;

/// Steps allowed for each eigenvalue; two or three are usual.
const MOST_STEPS: usize = 60;

/// Inverse roots w = 1/z of I + A_1 z + ... + A_n z^n, `coefficients` being A_1 ... A_n one below the
/// other.
///
/// With A_0 = I the polynomial in w, I w^n + A_1 w^{n-1} + ... + A_n, is monic; its block companion
/// matrix has -A_1 ... -A_n as first row of blocks and identities below the diagonal.
pub(super) fn inverse_roots(coefficients: &DMatrix<Complex64>) -> Vec<Complex64> {
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
/// Only eigenvalues are wanted, so that each step turns the active block alone, and a companion matrix
/// needs no reduction first: that is what the speed rests on.
fn hessenberg_eigenvalues(mut h: DMatrix<Complex64>) -> Vec<Complex64> {
    let mut found = Vec::with_capacity(h.nrows());
    let mut end = h.nrows();
    let mut steps = 0;
    while end > 0 {
        let start = active_start(&h, end);
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

/// First row of the block that ends before `end` and has no negligible subdiagonal.
fn active_start(h: &DMatrix<Complex64>, end: usize) -> usize {
    (1..end)
        .rev()
        .find(|&k| {
            let scale = h[(k, k)].l1_norm() + h[(k - 1, k - 1)].l1_norm();
            h[(k, k - 1)].l1_norm() <= f64::EPSILON * scale
        })
        .unwrap_or(0)
}

/// Eigenvalue of the last two by two block that is nearer to its last entry.
fn wilkinson_shift(h: &DMatrix<Complex64>, end: usize) -> Complex64 {
    let (a, b) = (h[(end - 2, end - 2)], h[(end - 2, end - 1)]);
    let (c, d) = (h[(end - 1, end - 2)], h[(end - 1, end - 1)]);
    // d - bc/(t + sign sqrt(t^2 + bc)), t = (a - d)/2.
    let half = (a - d) * 0.5;
    let product = b * c;
    let root = (half * half + product).sqrt();
    let sum = if (half.conj() * root).re >= 0.0 {
        half + root
    } else {
        half - root
    };
    if sum.norm_sqr() == 0.0 {
        d
    } else {
        d - product / sum
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
        let (c, s) = rotation(values[place], values[place + 1]);
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

/// Cosine (real) and sine of the rotation [c s; -conj(s) c] that takes (a, b) to (r, 0).
fn rotation(a: Complex64, b: Complex64) -> (f64, Complex64) {
    let length = (a.norm_sqr() + b.norm_sqr()).sqrt();
    // Companion matrices of a fit are of order one: no overflow to guard against.
    let size = a.norm_sqr().sqrt();
    if length == 0.0 {
        (1.0, Complex64::ZERO)
    } else if size == 0.0 {
        (0.0, b.conj() / length)
    } else {
        (size / length, a / size * b.conj() / length)
    }
}
