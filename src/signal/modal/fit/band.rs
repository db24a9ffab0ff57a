//! Which lines belong to a mode, and which modes are fitted together.

use num_complex::Complex64;

use super::data::ModalData;

/// Half of a band in effective half widths. 10: what lies outside would improve the standard deviation
/// by 3 % (computed from the information on the pole on all lines and on those of the band).
const HALF_WIDTHS: f64 = 10.0;
/// Half of a band in lines, at least. 12: the same for resonances narrower than a line, and enough
/// values beside the unknowns.
const LEAST_HALF: f64 = 12.0;
/// Modes nearer than so many of their half widths together, and so many lines, are fitted jointly. 3:
/// two standard deviations then grow by less than 1 % by what the two poles share.
const JOINT: f64 = 3.0;

/// Effective half width (lines): what the decay makes of it, or half a line where that is less.
pub(super) fn half_width(pole: Complex64) -> f64 {
    pole.re.hypot(0.5)
}

/// Half of the band of a pole (lines).
pub(super) fn half_band(pole: Complex64) -> f64 {
    (HALF_WIDTHS * half_width(pole)).max(LEAST_HALF)
}

/// Indices of the poles that are fitted together, ascending in frequency.
pub(super) fn groups(poles: &[(usize, Complex64)]) -> Vec<Vec<usize>> {
    let mut sorted = poles.to_vec();
    sorted.sort_by(|a, b| a.1.im.total_cmp(&b.1.im));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut last: Option<Complex64> = None;
    for (index, pole) in sorted {
        let near = last.is_some_and(|last| {
            pole.im - last.im < JOINT * (half_width(last) + half_width(pole) + 1.0)
        });
        match groups.last_mut().filter(|_| near) {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
        last = Some(pole);
    }
    groups
}

/// Positions (lines) from where to where the band of these poles reaches.
pub(super) fn reach(poles: &[Complex64]) -> (f64, f64) {
    poles
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), pole| {
            let half = half_band(*pole);
            (low.min(pole.im - half), high.max(pole.im + half))
        })
}

/// First index and end of the lines within a band (lines).
pub(super) fn within(data: &ModalData, (low, high): (f64, f64)) -> (usize, usize) {
    let position = |index: usize| data.frequencies()[index] / data.spacing();
    let count = data.frequencies().len();
    let first = (0..count)
        .find(|&index| position(index) >= low)
        .unwrap_or(count);
    let end = (first..count)
        .find(|&index| position(index) > high)
        .unwrap_or(count);
    (first, end)
}

/// Bands (Hz) that a fit from these starts (frequency in Hz, damping ratio) may use: what a collector
/// of decays must keep. `resolution` is 1/T (Hz).
///
/// Twice what the starts ask for, because a fitted mode may turn out wider.
pub fn bands_for(starts: &[(f64, f64)], resolution: f64) -> Vec<(f64, f64)> {
    starts
        .iter()
        .map(|&(frequency, damping_ratio)| {
            let pole = Complex64::new(-damping_ratio * frequency, frequency) / resolution;
            let half = 2.0 * half_band(pole) * resolution;
            (frequency - half, frequency + half)
        })
        .collect()
}
