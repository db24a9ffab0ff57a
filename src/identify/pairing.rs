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
