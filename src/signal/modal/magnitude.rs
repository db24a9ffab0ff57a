//! Reading resonances of spectra without a phase: frequency and damping from the squared magnitude alone.
//!
//! Near a resonance a response is r/(u - q) + b, with u the distance from the peak, q the complex pole, a residue r and
//! a background b. Its squared magnitude is exactly a quotient of two quadratic polynomials,
//! (n0 + n1 u + n2 u^2)/(u^2 + c1 u + c0), with the pole's |q|^2 = c0 and Re q = -c1/2. The half-power width follows
//! from the pole as in any other way of reading it, and does not suffer from the background.

use super::peaks::{CompositeLevel, Peak};
use super::reading::{Interpolation, ModeReading, NoInterpolation, PeakLabel, reading};
use crate::spectral::Lines;
use nalgebra::{DMatrix, DVector};
use tapjoint_numerics::stats::student;

/// Unknowns of the quotient.
const UNKNOWNS: usize = 5;
/// Least lines to each side: seven values stand against five unknowns.
const LEAST_REACH: usize = 3;
/// So many lines to either side take part at most; of a wider resonance every second, third, ... one.
const MOST_LINES: usize = 60;
/// Iterations of the weights; they settle in three.
const REWEIGHTINGS: usize = 4;
/// From this prominence on (dB), noise does not make peaks any more.
const CLEAR: f64 = 20.0;

/// Reads all `peaks` of spectra without a phase. A peak that no damped resonance explains beyond doubt is labelled.
pub fn read_magnitude_peaks(level: &CompositeLevel, peaks: &[Peak]) -> Vec<ModeReading> {
    let lines = &level.lines;
    let power: Vec<f64> = level
        .level_db
        .iter()
        .map(|db| 10_f64.powf(db / 10.0))
        .collect();
    let mut readings = Vec::with_capacity(peaks.len());
    for peak in peaks {
        // Half of the way to the nearest neighbour are the peak's own lines.
        let others = peaks.iter().filter(|other| other.index != peak.index);
        let nearest = others.map(|other| other.index.abs_diff(peak.index)).min();
        let room = nearest.map_or(usize::MAX, |distance| distance / 2);
        // As of complex spectra: two standard deviations where the peak is clear of noise, five where it is not.
        let clear = peak.prominence_db >= CLEAR;
        let deviations = if clear { 2.0 } else { 5.0 };
        let found = interpolate_magnitude(lines, &power, peak.index, room);
        let (between, label) = match found {
            Ok(found) => {
                let ratio = found.damping_ratio.unwrap_or(0.0);
                let is_resonance = ratio > deviations * found.damping_std;
                (
                    Some(found).filter(|_| is_resonance),
                    (!is_resonance && !clear).then_some(PeakLabel::NoResonance),
                )
            }
            Err(NoInterpolation::TooFewLines) => (None, None),
            Err(NoInterpolation::PoleElsewhere) => {
                (None, (!clear).then_some(PeakLabel::NoResonance))
            }
        };
        readings.push(reading(level, peak, between, label));
    }
    readings
}

/// Reads the resonance about a peak of a power spectrum. `room` is how many lines to either side belong to it alone.
///
/// The bound is the larger of two standard deviations, by the scatter of the lines about the fitted quotient, and of
/// the change between all lines and the nearer half of them.
///
/// # Errors
/// [`NoInterpolation`]: too few lines, or a pole farther from the peak than a line and the half-power width.
pub fn interpolate_magnitude(
    lines: &Lines,
    power: &[f64],
    peak: usize,
    room: usize,
) -> Result<Interpolation, NoInterpolation> {
    let at = *power.get(peak).ok_or(NoInterpolation::TooFewLines)?;
    let falls = |side: usize| {
        let near = |distance: &usize| {
            let line = match side {
                0 => peak.checked_sub(*distance),
                _ => Some(peak + distance),
            };
            let level = line.and_then(|line| power.get(line));
            level.is_none_or(|level| *level < 0.5 * at)
        };
        (1..power.len()).find(near).unwrap_or(power.len())
    };
    let half_width = falls(0).min(falls(1));
    // Three half widths: there the resonance is 10 dB lower, and the background shows.
    let reach = (3 * half_width)
        .max(6)
        .min(room)
        .min(peak)
        .min(power.len() - 1 - peak);
    if reach < LEAST_REACH || at <= 0.0 {
        return Err(NoInterpolation::TooFewLines);
    }
    let all = fit(power, peak, reach).ok_or(NoInterpolation::PoleElsewhere)?;
    if all.place.abs() > 1.0 + half_width as f64 {
        return Err(NoInterpolation::PoleElsewhere);
    }
    let near = fit(power, peak, (reach / 2).max(LEAST_REACH)).unwrap_or(all);
    let change = (near.place - all.place).abs();
    let spacing = lines.spacing;
    let bound = spacing * change.max(2.0 * all.place_std);
    let (real, width) = (
        lines.frequency(peak) + spacing * all.place,
        spacing * all.width,
    );
    let frequency = real.hypot(width);
    let width_std = spacing * all.width_std.max(0.5 * (near.width - all.width).abs());
    Ok(Interpolation {
        frequency,
        bound,
        std: 0.5 * bound,
        damping_ratio: Some(width / frequency),
        damping_std: width_std / frequency,
        // Decay over the record of length 1/resolution.
        decay_in_record: std::f64::consts::TAU * width / lines.resolution(),
    })
}

/// A pole on the axis of lines.
#[derive(Debug, Clone, Copy)]
struct Pole {
    /// Its place from the peak (lines).
    place: f64,
    place_std: f64,
    /// Half of the half-power width (lines).
    width: f64,
    width_std: f64,
}

/// Fits the quotient to the lines within `reach`; `None` where it has no complex pole.
fn fit(power: &[f64], peak: usize, reach: usize) -> Option<Pole> {
    let stride = reach.div_ceil(MOST_LINES);
    let steps = (reach / stride) as i64;
    let scale = power[peak];
    // Distances are parts of the reach: of lines, the unknowns would differ by many powers of ten.
    let unit = reach as f64;
    let mut points = Vec::with_capacity(2 * steps as usize + 1);
    for step in -steps..=steps {
        let u = step as f64 * stride as f64 / unit;
        let line = peak as i64 + step * stride as i64;
        let value = power[usize::try_from(line).ok()?] / scale;
        // A line without power has no level that could weigh.
        points.push((u, value.max(1e-12)));
    }
    if !points.iter().all(|(_, value)| value.is_finite()) {
        return None;
    }
    let (mut c1, mut c0) = (0.0, 1.0 / (unit * unit));
    let mut covariance = DMatrix::zeros(UNKNOWNS, UNKNOWNS);
    for _ in 0..REWEIGHTINGS {
        let rows = points.len();
        let mut matrix = DMatrix::zeros(rows, UNKNOWNS);
        let mut right = DVector::zeros(rows);
        for (row, (u, value)) in points.iter().enumerate() {
            // Noise beside the response: the squared magnitude scatters with its root.
            let weight = 1.0 / ((u * u + c1 * u + c0).abs().max(1e-12) * value.sqrt());
            let terms = [value * u, *value, -1.0, -u, -u * u];
            for (column, term) in terms.into_iter().enumerate() {
                matrix[(row, column)] = weight * term;
            }
            right[row] = -weight * value * u * u;
        }
        let svd = matrix.clone().svd(true, true);
        let solution = svd.solve(&right, 1e-12).ok()?;
        let residual = (&matrix * &solution - &right).norm_squared();
        let variance = residual / (rows - UNKNOWNS) as f64;
        let inverse = (matrix.transpose() * &matrix).pseudo_inverse(1e-14).ok()?;
        covariance = inverse * variance;
        (c1, c0) = (solution[0], solution[1]);
    }
    let place = -0.5 * c1;
    let square = c0 - place * place;
    if square.is_nan() || square <= 0.0 {
        return None;
    }
    let width = square.sqrt();
    // width^2 = c0 - c1^2/4.
    let slopes = [-0.25 * c1 / width, 0.5 / width];
    let mut width_variance = 0.0;
    for (row, a) in slopes.iter().enumerate() {
        for (column, b) in slopes.iter().enumerate() {
            width_variance += a * b * covariance[(row, column)];
        }
    }
    // So many standard deviations are 95 % by Student's distribution where few lines tell the noise; two of many.
    let widened = 0.5 * student::quantile(0.05, (points.len() - UNKNOWNS) as f64);
    Some(Pole {
        place: unit * place,
        place_std: widened * unit * 0.5 * covariance[(0, 0)].max(0.0).sqrt(),
        width: unit * width,
        width_std: widened * unit * width_variance.max(0.0).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;

    /// A pole on a constant background is read exactly, whatever its width and its place between the lines.
    #[test]
    fn limit_a_pole_on_a_background_is_read_exactly() {
        let lines = Lines {
            low: 0.0,
            high: 200.0,
            spacing: 0.5,
            block: 1024,
            duration: 2.0,
        };
        for (frequency, ratio) in [(61.13, 0.004), (60.4, 0.01), (99.87, 0.03)] {
            let pole = Complex64::new(-ratio, (1.0_f64 - ratio * ratio).sqrt()) * frequency;
            let power: Vec<f64> = (0..400)
                .map(|line| {
                    let at = Complex64::new(0.0, 0.5 * f64::from(line));
                    (Complex64::new(0.7, 0.4) / (at - pole) + Complex64::new(0.05, -0.02))
                        .norm_sqr()
                })
                .collect();
            let peak = (0..400)
                .max_by(|a, b| power[*a].total_cmp(&power[*b]))
                .expect("lines");
            let found =
                interpolate_magnitude(&lines, &power, peak, usize::MAX).expect("a resonance");
            let error = (found.frequency - frequency).abs();
            // Exact in exact arithmetic; the rest is the conditioning of the normal equations.
            assert!(error < 1e-4 * frequency, "{frequency}: {found:?}");
            let damping = found.damping_ratio.expect("a damping");
            assert!(
                (damping / ratio - 1.0).abs() < 1e-2,
                "{frequency}: {found:?}"
            );
        }
    }
}
