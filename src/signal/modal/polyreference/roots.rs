//! Roots of the denominator that decay.
//!
//! A pole decays where its inverse root w lies outside the unit circle. Most roots lie within: the constraint A_0 = I
//! puts the surplus ones there. For one input the denominator is a scalar polynomial, and the test of Schur and Cohn
//! counts the roots outside in n^2/2 operations (Henrici 1974, section 6.8). Where the order before had as many, the
//! simultaneous iteration of Aberth and Ehrlich refines those alone (Aberth 1973, Bini 1996). A root that appears is
//! looked for about the circle.
//!
//! The eigenvalues of a companion matrix cost n^3 operations. They serve matrix polynomials, and orders at which fewer
//! roots are found than counted.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;

/// Least |1 - |k|^2| of a reflection coefficient k: nearer to 1 the rounding of a count is no longer far below it.
const LEAST_REST: f64 = 1e-8;
/// Sweeps allowed; two to four are usual.
const MOST_SWEEPS: usize = 20;
/// Last step over the distance to the nearest root: its square is below the rounding.
const SETTLED: f64 = 1e-8;

/// Returns the inverse roots w = 1/z outside the unit circle of I + A_1 z + ... + A_n z^n, `coefficients` being
/// A_1 ... A_n one below the other. `before` are those of the order before.
pub(super) fn decaying_roots(
    coefficients: &DMatrix<Complex64>,
    before: &[Complex64],
) -> Vec<Complex64> {
    if coefficients.ncols() == 1
        && let Some(count) = count_outside(coefficients.as_slice())
    {
        if count == 0 {
            return Vec::new();
        }
        let coefficients = coefficients.as_slice();
        let mut roots = refined_roots(coefficients, before).unwrap_or_default();
        // A root that appears at this order has no start among those before.
        while roots.len() < count
            && let Some(more) = with_one_more(coefficients, &roots)
        {
            roots = more;
        }
        // Distinct roots, as many as there are, are all of them.
        if roots.len() == count {
            return roots;
        }
    }
    let mut roots = companion_roots(coefficients);
    roots.retain(|root| root.norm_sqr() > 1.0);
    roots
}

/// Points about the unit circle at which a root is looked for. 128: three for each root of the highest order.
const POINTS: usize = 128;
/// Their distance from the origin: a root that appears lies just outside the unit circle.
const POINTS_AT: f64 = 1.03;
/// Most points from which the iteration is tried.
const MOST_TRIES: usize = 8;

/// Returns the `known` roots outside the unit circle with one more; `None` where none is found.
///
/// The iteration begins at the points with the shortest steps p/(p' - p S).
fn with_one_more(coefficients: &[Complex64], known: &[Complex64]) -> Option<Vec<Complex64>> {
    let angles = (0..POINTS).map(|k| k as f64 * TAU / POINTS as f64);
    let points: Vec<Complex64> = angles
        .map(|angle| Complex64::from_polar(POINTS_AT, angle))
        .collect();
    let (mut values, mut slopes) = (vec![Complex64::ONE; POINTS], vec![Complex64::ZERO; POINTS]);
    for a in coefficients {
        for ((value, slope), point) in values.iter_mut().zip(&mut slopes).zip(&points) {
            *slope = *slope * point + *value;
            *value = *value * point + a;
        }
    }
    let all = points.iter().zip(values).zip(slopes);
    let lengths: Vec<f64> = all
        .map(|((point, value), slope)| {
            let inverses: Complex64 = known.iter().map(|root| (point - root).inv()).sum();
            (value / (slope - value * inverses)).norm_sqr()
        })
        .collect();
    let mut starts: Vec<usize> = (0..POINTS)
        .filter(|&k| {
            let sides = [
                lengths[(k + POINTS - 1) % POINTS],
                lengths[(k + 1) % POINTS],
            ];
            sides.iter().all(|side| lengths[k] <= *side)
        })
        .collect();
    starts.sort_by(|a, b| lengths[*a].total_cmp(&lengths[*b]));
    starts.iter().take(MOST_TRIES).find_map(|&start| {
        let mut more = known.to_vec();
        more.push(points[start]);
        refined_roots(coefficients, &more).filter(|roots| roots.len() > known.len())
    })
}

/// Returns the number of roots outside the unit circle of p(w) = w^n + a_1 w^{n-1} + ... + a_n; `None` where rounding
/// leaves it open.
///
/// With k = a_n and p*(w) = w^n conj(p(1/conj w)) the polynomial p - k p* = (1 - |k|^2) w q(w) has a monic q of degree
/// n - 1. On the circle |p| = |p*|. By Rouche's theorem q has as many roots outside as p where |k| < 1, and otherwise
/// as many as p has within.
fn count_outside(coefficients: &[Complex64]) -> Option<usize> {
    let mut p = coefficients.to_vec();
    let mut are_kept = Vec::with_capacity(p.len());
    while let Some(k) = p.pop() {
        let rest = 1.0 - k.norm_sqr();
        // A rest that is no number counts nothing.
        if rest.abs().is_nan() || rest.abs() < LEAST_REST {
            return None;
        }
        are_kept.push(rest > 0.0);
        // q_j = (a_j - k conj(a_{n-j}))/(1 - |k|^2), both ends at once.
        let (scale, turned, last) = (1.0 / rest, k / rest, p.len());
        for j in 0..last.div_ceil(2) {
            let (a, b) = (p[j], p[last - 1 - j]);
            p[j] = a * scale - turned * b.conj();
            p[last - 1 - j] = b * scale - turned * a.conj();
        }
    }
    let by_degree = (1..).zip(are_kept.iter().rev());
    Some(
        by_degree.fold(0, |outside, (degree, is_kept)| match is_kept {
            true => outside,
            false => degree - outside,
        }),
    )
}

/// Refines roots of w^n + a_1 w^{n-1} + ... + a_n, and returns those outside the unit circle; `None` where the starts do
/// not converge to as many roots.
///
/// A step takes N/(1 - N S) from the root w_i. N = p(w_i)/p'(w_i) is Newton's step, and S = sum over k other than i of
/// 1/(w_i - w_k) takes the other roots out of p. A root is found where |p| is within the rounding of Horner's scheme, or
/// where the step is so small that what it leaves, its square at most, is rounding.
fn refined_roots(coefficients: &[Complex64], starts: &[Complex64]) -> Option<Vec<Complex64>> {
    let mut roots = starts.to_vec();
    let mut open: Vec<usize> = (0..roots.len()).collect();
    for _ in 0..MOST_SWEEPS {
        open.retain(|&index| {
            let root = roots[index];
            let (mut value, mut slope) = (Complex64::ONE, Complex64::ZERO);
            let (mut size, radius) = (1.0, root.norm_sqr().sqrt());
            for a in coefficients {
                slope = slope * root + value;
                value = value * root + a;
                size = size * radius + a.l1_norm();
            }
            let (mut inverses, mut nearest) = (Complex64::ZERO, root.norm_sqr());
            for other in roots[..index].iter().chain(&roots[index + 1..]) {
                let away = root - other;
                let square = away.norm_sqr();
                nearest = square.min(nearest);
                inverses += away.conj() / square;
            }
            // N/(1 - N S) = p/(p' - p S), which no p' of 0 disturbs.
            let step = value / (slope - value * inverses);
            if value.l1_norm() <= f64::EPSILON * size && step.norm_sqr() < nearest {
                return false;
            }
            roots[index] = root - step;
            // A step that is no number stays open.
            let is_settled = step.norm_sqr() <= SETTLED * SETTLED * nearest;
            !is_settled
        });
        if open.is_empty() {
            roots.retain(|root| root.norm_sqr() > 1.0);
            return Some(roots);
        }
    }
    None
}

/// Steps allowed for each eigenvalue; two or three are usual.
const MOST_STEPS: usize = 60;

/// Returns all inverse roots as eigenvalues.
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

    /// Roots near the unit circle at every order, `share` of them outside.
    fn roots_about_the_circle(order: usize, share: f64, random: &mut ChaCha8Rng) -> Vec<Complex64> {
        (1..=order)
            .map(|k| {
                let is_outside = random.random_range(0.0..1.0) < share;
                let away = random.random_range(0.002..0.15);
                let modulus = if is_outside { 1.0 + away } else { 1.0 - away };
                // Turns by the golden angle spread over the circle.
                let angle = 2.4 * k as f64 + random.random_range(-0.03..0.03);
                Complex64::from_polar(modulus, angle)
            })
            .collect()
    }

    #[test]
    fn prop_the_roots_outside_the_circle_are_counted() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        for order in 1..=40 {
            for share in [0.0, 0.1, 0.5, 1.0] {
                let roots = roots_about_the_circle(order, share, &mut random);
                let outside = roots.iter().filter(|root| root.norm() > 1.0).count();
                let counted = count_outside(&polynomial(&roots));
                assert_eq!(counted, Some(outside), "{order}, {share}");
            }
        }
    }

    #[test]
    fn prop_all_ways_find_the_roots_outside_of_every_order() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        for order in 3..=40 {
            let roots = roots_about_the_circle(order, 0.2, &mut random);
            let mut outside = roots.clone();
            outside.retain(|root| root.norm() > 1.0);
            let starts: Vec<Complex64> = outside
                .iter()
                .map(|root| root * Complex64::from_polar(0.99, 0.01))
                .collect();
            let coefficients = polynomial(&roots);
            let refined = refined_roots(&coefficients, &starts).unwrap();
            let column = DMatrix::from_column_slice(order, 1, &coefficients);
            let [found, without_start] =
                [&starts[..], &[]].map(|starts| decaying_roots(&column, starts));
            assert_eq!(found, refined, "{order}");
            assert_eq!(without_start.len(), outside.len(), "{order}");
            let mut eigenvalues = companion_roots(&column);
            eigenvalues.retain(|root| root.norm() > 1.0);
            assert!(distance(&found, &without_start) < 1e-9, "{order}");
            assert!(distance(&found, &eigenvalues) < 1e-9, "{order}");
            assert!(distance(&outside, &found) < 1e-9, "{order}");
        }
    }

    #[test]
    fn limit_roots_on_the_circle_are_not_counted() {
        // w^12 - 1.
        let mut coefficients = vec![Complex64::ZERO; 12];
        coefficients[11] = -Complex64::ONE;
        assert_eq!(count_outside(&coefficients), None);
        coefficients[11] *= 1.1f64.powi(12);
        assert_eq!(count_outside(&coefficients), Some(12));
        let column = DMatrix::from_column_slice(12, 1, &coefficients);
        let exact: Vec<Complex64> = (0..12)
            .map(|k| Complex64::from_polar(1.1, TAU * f64::from(k) / 12.0))
            .collect();
        assert!(distance(&exact, &decaying_roots(&column, &[])) < 1e-13);
    }

    #[test]
    fn limit_a_start_with_equal_roots_falls_back_to_the_eigenvalues() {
        let exact = [0.5, 1.2, 1.4].map(Complex64::from);
        let coefficients = DMatrix::from_column_slice(3, 1, &polynomial(&exact));
        let found = decaying_roots(&coefficients, &[Complex64::from(1.3); 2]);
        assert_eq!(found.len(), 2);
        assert!(distance(&exact[1..], &found) < 1e-12);
    }
}
