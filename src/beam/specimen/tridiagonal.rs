//! Eigenvalues and eigenvectors of a symmetric tridiagonal matrix by the implicitly shifted QL
//! algorithm (Golub & Van Loan, "Matrix Computations", 8.3).

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
