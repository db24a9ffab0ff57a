//! Several sensors as one: the sum of best signal to noise.

use num_complex::Complex64;

use super::band::Band;
use super::median_of;

/// Least noise variance over the mean power: 200 dB.
const FLOOR: f64 = 1e-20;

/// The sensor with the largest amplitude at the start of the decays; `None` without any.
pub(super) fn strongest(bands: &[Band]) -> Option<usize> {
    let count = bands.iter().map(|band| band.sensors.len()).min()?;
    (0..count)
        .map(|sensor| (sensor, bands.iter().map(|b| energy(b, sensor)).sum::<f64>()))
        .filter(|(_, energy)| *energy > 0.0)
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(sensor, _)| sensor)
}

/// Values of the first decay time, six at least.
fn early(band: &Band) -> usize {
    ((band.scale / band.step) as usize).max(6)
}

fn energy(band: &Band, sensor: usize) -> f64 {
    let values = band.sensors[sensor].iter().take(early(band));
    values.map(Complex64::norm_sqr).sum()
}

/// The sensors' weighted sum, scaled so that it has the amplitude of the sensor `reference`.
///
/// With the amplitude ratios c(s) to the reference and noise variances v(s), the best weights are
/// conj(c)/v over sum |c|^2/v. They are fixed over the decay, so that an exponential stays one.
pub(super) fn combine(band: &Band, reference: usize) -> Option<Vec<Complex64>> {
    let main = band.sensors.get(reference)?;
    let main_energy = energy(band, reference);
    if main.len() < 6 || main_energy.is_nan() || main_energy <= 0.0 {
        return None;
    }
    let mut sum = vec![Complex64::ZERO; main.len()];
    let mut total = 0.0;
    for values in &band.sensors {
        let products = main.iter().zip(values).take(early(band));
        let ratio = products.map(|(m, y)| m.conj() * y).sum::<Complex64>() / main_energy;
        let noise = noise_variance(values, band);
        if noise.is_nan() || noise <= 0.0 {
            continue;
        }
        total += ratio.norm_sqr() / noise;
        for (at, y) in sum.iter_mut().zip(values) {
            *at += ratio.conj() / noise * y;
        }
    }
    (total > 0.0 && total.is_finite()).then(|| sum.into_iter().map(|y| y / total).collect())
}

/// Noise variance of a sensor's values, from what the neighbours in time do not predict:
/// y(n) - (z y(n-1) + y(n+1)/z)/2 with z = e^{p step} has 1.5 times the variance of white noise, and
/// the median of an exponentially distributed square is ln 2 of its mean. Not below what no converter
/// undercuts, so that simulated signals without noise divide nothing by zero.
pub(super) fn noise_variance(values: &[Complex64], band: &Band) -> f64 {
    let z = (band.decay * band.step).exp();
    let squares = values
        .windows(3)
        .map(|y| (y[1] - 0.5 * (z * y[0] + y[2] / z)).norm_sqr());
    let power = values.iter().map(Complex64::norm_sqr).sum::<f64>() / values.len().max(1) as f64;
    (median_of(squares) / (1.5 * std::f64::consts::LN_2)).max(FLOOR * power)
}
