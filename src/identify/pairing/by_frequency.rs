//! Which measured frequency is which mode.

/// Numbers the measured frequencies (Hz, ascending) of a structure whose natural frequencies are
/// predicted (Hz, ascending): each mode gets the measured frequency nearest to it, within `tolerance`
/// (relative to the predicted one) and nearer to it than to any other mode; frequencies left over
/// have no number.
pub fn pair_by_frequency(
    measured: &[f64],
    predicted: &[f64],
    tolerance: f64,
) -> Vec<Option<usize>> {
    let distance = |f: f64, mode: usize| ((f - predicted[mode]) / predicted[mode]).abs();
    let nearest_mode =
        |f: f64| (0..predicted.len()).min_by(|&a, &b| distance(f, a).total_cmp(&distance(f, b)));
    let mut numbers = vec![None; measured.len()];
    for mode in 0..predicted.len() {
        let best = (0..measured.len())
            .filter(|&i| nearest_mode(measured[i]) == Some(mode))
            .filter(|&i| distance(measured[i], mode) <= tolerance)
            .min_by(|&a, &b| distance(measured[a], mode).total_cmp(&distance(measured[b], mode)));
        if let Some(best) = best {
            numbers[best] = Some(mode + 1);
        }
    }
    numbers
}

/// A measured peak: where it is and how much it stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightedPeak {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Weight, such as its height over the noise (dB).
    pub weight: f64,
}

/// Numbers the peaks of a structure whose natural frequencies are known but for one common factor
/// near 1 (a free beam of uncertain modulus): the factor is the one under which the peaks that match
/// within `tolerance` weigh most, among factors that differ from 1 by at most `range`; of equals the
/// one nearest 1.
pub fn pair_by_ratio(
    peaks: &[WeightedPeak],
    predicted: &[f64],
    (range, tolerance): (f64, f64),
) -> Vec<Option<usize>> {
    let measured: Vec<f64> = peaks.iter().map(|peak| peak.frequency).collect();
    let pairing = |factor: f64| {
        let scaled: Vec<f64> = predicted.iter().map(|f| factor * f).collect();
        pair_by_frequency(&measured, &scaled, tolerance)
    };
    let weight = |numbers: &[Option<usize>]| -> f64 {
        peaks
            .iter()
            .zip(numbers)
            .filter(|(_, n)| n.is_some())
            .map(|(peak, _)| peak.weight)
            .sum()
    };
    let factors = measured
        .iter()
        .flat_map(|f| predicted.iter().map(move |p| f / p));
    factors
        .filter(|factor| (factor - 1.0).abs() <= range)
        .map(|factor| (factor, pairing(factor)))
        .max_by(|a, b| {
            let nearer = (b.0 - 1.0).abs().total_cmp(&(a.0 - 1.0).abs());
            weight(&a.1).total_cmp(&weight(&b.1)).then(nearer)
        })
        .map_or(vec![None; peaks.len()], |(_, numbers)| numbers)
}
