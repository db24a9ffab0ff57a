//! Poles from the signal subspace of Hankel matrices, and how many there are.

use nalgebra::{DMatrix, SymmetricEigen};
use num_complex::Complex64;

use super::Demodulated;
use crate::modal::projection::conjugate_product;

/// Most columns of the Hankel matrix; beyond, cost grows and accuracy does not.
const MOST_COLUMNS: usize = 80;
/// Poles from the signal subspace, relative to the band's centre (1/s).
///
/// Rows of the Hankel matrices of all records are sums of (1, z, ..., z^L); the leading eigenvectors of
/// H^H H span their conjugates, and shifting them by one row turns them by conj(z).
pub(super) fn subspace_poles(data: &Demodulated, most: usize) -> Vec<Complex64> {
    let count = data.times.len();
    let size = (count / 3).min(MOST_COLUMNS) + 1;
    let gram = DMatrix::from_fn(size, size, |i, j| {
        let rows = count + 1 - size;
        data.columns
            .iter()
            .map(|column| conjugate_product(&column[i..i + rows], &column[j..j + rows]))
            .sum::<Complex64>()
    });
    let eigen = SymmetricEigen::new(gram);
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let values: Vec<f64> = order.iter().map(|&k| eigen.eigenvalues[k]).collect();
    let rows = data.columns.len() * (count + 1 - size);
    let poles = description_order(&values, rows).min(most).min(size - 2);
    if poles == 0 {
        return Vec::new();
    }
    let basis = DMatrix::from_fn(size, poles, |row, k| eigen.eigenvectors[(row, order[k])]);
    let (upper, lower) = (basis.rows(0, size - 1), basis.rows(1, size - 1));
    let square = upper.ad_mul(&upper);
    let Some(shift) = square.lu().solve(&upper.ad_mul(&lower)) else {
        return Vec::new();
    };
    shift.eigenvalues().map_or_else(Vec::new, |roots| {
        roots.iter().map(|z| z.conj().ln() * data.rate).collect()
    })
}

/// Number of signals k with the least description length
/// -n (m - k) ln(geometric/arithmetic mean of the m - k smallest) + k (2m - k)/2 ln n.
fn description_order(values: &[f64], rows: usize) -> usize {
    let size = values.len();
    // Rounding of the sums stands below all noise.
    let floor = values.first().copied().unwrap_or(0.0) * 1e-15;
    let length = |signals: usize| {
        let rest = &values[signals..];
        let count = rest.len() as f64;
        let mean = rest.iter().map(|v| v.max(floor)).sum::<f64>() / count;
        let logarithm = rest.iter().map(|v| v.max(floor).ln()).sum::<f64>() / count;
        let samples = rows as f64;
        let k = signals as f64;
        samples * count * (mean.ln() - logarithm) + 0.5 * k * (2.0 * size as f64 - k) * samples.ln()
    };
    (0..size - 1)
        .min_by(|&a, &b| length(a).total_cmp(&length(b)))
        .unwrap_or(0)
}
