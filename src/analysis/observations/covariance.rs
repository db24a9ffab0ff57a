//! Covariance of the frequencies of one configuration.

use super::mode::ModeSeen;
use super::repeats::LEAST_TAPS;
use tapjoint_identify::observation::ObservedMode;

/// Least shrinkage of a correlation from so few taps: it keeps the matrix well conditioned where taps
/// are fewer than modes.
const LEAST_SHRINKAGE: f64 = 0.1;

/// Modes that have nothing in common; `None` where one has no uncertainty.
pub(super) fn independent(modes: &[ObservedMode]) -> Option<Vec<Vec<f64>>> {
    let stds: Vec<f64> = modes.iter().map(|mode| mode.std).collect::<Option<_>>()?;
    Some(with_correlation(&stds, |_, _| 0.0))
}

fn with_correlation(stds: &[f64], correlation: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    let entry = |i: usize, j: usize| {
        let r = if i == j { 1.0 } else { correlation(i, j) };
        r * stds[i] * stds[j]
    };
    let row = |i: usize| (0..stds.len()).map(|j| entry(i, j)).collect();
    (0..stds.len()).map(row).collect()
}

/// Variances of the modes' frequencies, and where several scatter from tap to tap more than noise does,
/// the correlation of that scatter. Noise itself is independent between modes.
pub(super) fn of_taps(modes: &[ModeSeen<'_>]) -> Option<Vec<Vec<f64>>> {
    let stds: Vec<f64> = modes.iter().map(|mode| mode.frequency().std).collect();
    if stds.iter().any(|std| !std.is_finite()) {
        return None;
    }
    let scattered: Vec<usize> = (0..modes.len())
        .filter(|&index| modes[index].frequency.scattered)
        .collect();
    let correlation = shrunk_correlation(modes, &scattered);
    Some(with_correlation(&stds, |i, j| {
        let place = |index: usize| scattered.iter().position(|&s| s == index);
        match (&correlation, place(i), place(j)) {
            (Some(correlation), Some(i), Some(j)) => correlation[i][j],
            _ => 0.0,
        }
    }))
}

/// Correlations between the taps' deviations, shrunk towards none as Schaefer & Strimmer 2005 do:
/// lambda = sum var(r)/sum r^2 with var(r) about (1 - r^2)^2/(n - 1); `None` with too few taps that
/// have all these modes.
fn shrunk_correlation(modes: &[ModeSeen<'_>], which: &[usize]) -> Option<Vec<Vec<f64>>> {
    let taps = |&index: &usize| &modes[index].frequency.taps;
    let of = |index: &usize, tap: usize| taps(index).iter().find(|t| t.0 == tap).map(|t| t.1);
    let common: Vec<usize> = taps(which.first()?)
        .iter()
        .map(|tap| tap.0)
        .filter(|&tap| which.iter().all(|index| of(index, tap).is_some()))
        .collect();
    if which.len() < 2 || common.len() < LEAST_TAPS {
        return None;
    }
    let columns: Vec<Vec<f64>> = which
        .iter()
        .map(|index| unit_deviations(common.iter().filter_map(|&tap| of(index, tap)).collect()))
        .collect();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let sample: Vec<Vec<f64>> = columns
        .iter()
        .map(|a| columns.iter().map(|b| product(a, b)).collect())
        .collect();
    let pairs = || (0..which.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let squares: f64 = pairs().map(|(i, j)| sample[i][j].powi(2)).sum();
    let spread = |r: f64| (1.0 - r * r).powi(2) / (common.len() as f64 - 1.0);
    let variances: f64 = pairs().map(|(i, j)| spread(sample[i][j])).sum();
    let shrinkage = (variances / squares.max(f64::MIN_POSITIVE)).clamp(LEAST_SHRINKAGE, 1.0);
    let shrunk = |row: Vec<f64>| row.into_iter().map(|r| (1.0 - shrinkage) * r).collect();
    Some(sample.into_iter().map(shrunk).collect())
}

/// Deviations from the mean, scaled to a unit sum of squares.
fn unit_deviations(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|value| *value -= mean);
    let size = values.iter().map(|x| x * x).sum::<f64>().sqrt();
    let size = size.max(f64::MIN_POSITIVE);
    values.iter_mut().for_each(|value| *value /= size);
    values
}
