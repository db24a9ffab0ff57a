//! One mode's band of every response: mixed down, low-pass filtered, thinned out.
//!
//! Several sensors as one: the sum of best signal to noise.

use std::f64::consts::{PI, TAU};

use nalgebra::DMatrix;
use num_complex::Complex64;
use tapjoint_numerics::bessel_i0;
use tapjoint_numerics::stats::median;

use super::{Decay, FILTER, KnownMode, LONGEST_FILTER};
use crate::modal::Subspace;
use crate::spectral::kaiser_beta;

/// Attenuation of the stop band (dB): a neighbour a hundred times as strong is left at 3 %.
const ATTENUATION: f64 = 70.0;
/// Edge of the pass band over the edge of the stop band; between them the filter falls off.
const PASS: f64 = 0.3;
/// Parts of the record that a decay time is limited to: a lightly damped mode needs segments too.
const PARTS: f64 = 4.0;
/// Decay times that are followed: 104 dB.
const REACH: f64 = 12.0;
/// Least remainder of a neighbour beside those before it, relative: nearer ones are one.
pub(super) const DISTINCT: f64 = 1e-5;
/// Least damping ratio: no structure with a joint has less.
const LEAST_DAMPING: f64 = 1e-6;
/// Neighbours are kept this far beyond the stop edge.
const MARGIN: f64 = 0.95;
/// Share of the distance to 0 Hz and to half the sample rate that the stop edge leaves: beyond them
/// lies the mode's mirror image, and at 0 Hz the sensors' drift.
const FROM_ENDS: f64 = 0.8;

/// A mode's band after one tap.
pub(super) struct Band {
    /// Which decay.
    pub tap: usize,
    /// Frequency it was mixed down from (rad/s).
    pub omega: f64,
    /// Rough pole relative to it: its decay (1/s), negative.
    pub decay: f64,
    /// Time scale of the cut: the decay time, or a part of the record (s).
    pub scale: f64,
    /// Time of the first value after the tap (s).
    pub first: f64,
    /// Step of the values (s).
    pub step: f64,
    /// Length of the filter (s).
    pub filter: f64,
    /// Length of the decay (s).
    pub length: f64,
    /// Noise density at the band's middle over the mean density of the values.
    pub noise_ratio: f64,
    /// Filter taps and their rate (Hz), for the gain at a pole.
    pub taps: Vec<f64>,
    pub sample_rate: f64,
    /// Complex amplitude (peak, unit of the sensor) of every sensor.
    pub sensors: Vec<Vec<Complex64>>,
    /// Listed modes inside the band: poles relative to `omega` (rad/s).
    pub neighbours: Vec<Complex64>,
}

impl Band {
    /// Returns the gain of the filter at a pole relative to the band's middle:
    /// sum h(m) e^{p (m - (M-1)/2)/rate}.
    ///
    /// The filter is symmetric about its middle, so the sum is h_0 + P(z) + P(1/z) with z = e^{p/rate} and
    /// P(z) = h_1 z + h_2 z^2 + ..., both by Horner's scheme.
    pub fn gain(&self, pole: Complex64) -> Complex64 {
        let Some((middle, side)) = self.taps[self.taps.len() / 2..].split_first() else {
            return Complex64::ZERO;
        };
        let step = pole / self.sample_rate;
        let (ahead, back) = (step.exp(), (-step).exp());
        let (mut after, mut before) = (Complex64::ZERO, Complex64::ZERO);
        for h in side.iter().rev() {
            after = (after + h) * ahead;
            before = (before + h) * back;
        }
        after + before + middle
    }

    /// Returns the undamped frequency (Hz) of a pole relative to the middle.
    pub fn frequency(&self, pole: Complex64) -> f64 {
        Complex64::new(pole.re, self.omega + pole.im).norm() / TAU
    }

    /// Distance from the middle (Hz) beyond which nothing passes.
    pub fn stop_edge(&self) -> f64 {
        KAISER_LENGTH / (1.0 - PASS) / self.filter
    }

    /// Number of values in the first decay time, at least six.
    fn early(&self) -> usize {
        ((self.scale / self.step) as usize).max(6)
    }

    /// Returns the early values of every sensor (columns) without what the neighbours in the band can make of them.
    ///
    /// The mode is the same function of time at every sensor. What is left of it keeps the sensors' ratios, and a
    /// stronger neighbour does not stand for the mode.
    fn early_values(&self) -> DMatrix<Complex64> {
        let count = self.sensors.iter().map(Vec::len).min().unwrap_or(0);
        let rows = self.early().min(count);
        let values = DMatrix::from_fn(rows, self.sensors.len(), |n, sensor| {
            self.sensors[sensor][n]
        });
        let neighbours = DMatrix::from_fn(rows, self.neighbours.len(), |n, place| {
            (self.neighbours[place] * (n as f64 * self.step)).exp()
        });
        // Fewer values than unknowns tell nothing apart.
        match rows > 2 * self.neighbours.len() {
            true => Subspace::new(&neighbours, DISTINCT).complement(values),
            false => values,
        }
    }
}

/// Extracts the band of mode `index` after one tap; `None` of a decay that is too short. The modes `taken` have been
/// subtracted.
pub(super) fn extract_band(
    decay: &Decay,
    tap: usize,
    modes: &[KnownMode],
    index: usize,
    taken: &[usize],
) -> Option<Band> {
    let mode = modes.get(index)?;
    let samples = decay.responses.iter().map(Vec::len).min()?;
    let omega = TAU * mode.frequency;
    let sigma = mode.damping_ratio.max(LEAST_DAMPING) * omega;
    let rate = decay.sample_rate;
    let usable = omega.is_finite() && omega > 0.0 && omega < PI * rate;
    let scale = (1.0 / sigma).min(samples as f64 / rate / PARTS);
    if !usable || samples < 16 {
        return None;
    }
    let stop = stop_edge(modes, index, scale, rate);
    // Half the length of the filter (samples).
    let transition = (1.0 - PASS) * stop;
    let half = (KAISER_LENGTH * rate / transition / 2.0).ceil().max(2.0);
    if half > samples as f64 {
        return None;
    }
    let taps = low_pass(half, 0.5 * (1.0 + PASS) * stop / rate);
    // Stop and pass edge fold onto each other at this rate, so nothing reaches the pass band.
    let stride = (rate / ((1.0 + PASS) * stop)).floor().max(1.0) as usize;
    let wanted = ((REACH * scale + taps.len() as f64 / rate) * rate) as usize;
    let kept = samples.min(wanted);
    let count = kept.checked_sub(taps.len())? / stride + 1;
    let squares: f64 = taps.iter().map(|h| h * h).sum();
    Some(Band {
        tap,
        omega,
        decay: -sigma,
        scale,
        first: decay.start + (taps.len() - 1) as f64 / 2.0 / rate,
        step: stride as f64 / rate,
        filter: taps.len() as f64 / rate,
        length: samples as f64 / rate,
        // White noise of variance s^2 leaves the filter with s^2 sum h^2; white noise that is as dense
        // as it is in the pass band would have s^2 |H(0)|^2/stride, and H(0) = 1.
        noise_ratio: 1.0 / (stride as f64 * squares),
        sensors: mix_down(&decay.responses, &taps, omega / rate, stride, count),
        taps,
        sample_rate: rate,
        neighbours: neighbours(modes, index, stop, taken),
    })
}

/// Returns the edge of the stop band (Hz): as wide as the wanted time resolution needs, narrower where that
/// keeps a neighbour out, but not narrower than the longest filter allows.
fn stop_edge(modes: &[KnownMode], index: usize, scale: f64, rate: f64) -> f64 {
    let frequency = modes[index].frequency;
    let ends = FROM_ENDS * frequency.min(0.5 * rate - frequency);
    // Length of the filter times its stop edge (1), see `low_pass`.
    let product = KAISER_LENGTH / (1.0 - PASS);
    let widest = (product / (FILTER * scale)).min(ends);
    let narrowest = (product / (LONGEST_FILTER * scale)).min(widest);
    let others = modes
        .iter()
        .enumerate()
        .filter(|(other, _)| *other != index);
    others
        .map(|(_, mode)| MARGIN * (mode.frequency - frequency).abs())
        .filter(|distance| *distance >= narrowest)
        .fold(widest, f64::min)
}

/// Length of a Kaiser window's filter times its transition band, (A - 7.95)/14.36 (Oppenheim &
/// Schafer).
const KAISER_LENGTH: f64 = (ATTENUATION - 7.95) / 14.36;

/// Returns a low-pass filter with Kaiser's window, gain 1 at 0 Hz, with so many samples to either side of its
/// middle. The cutoff is in parts of the sample rate.
fn low_pass(half: f64, cutoff: f64) -> Vec<f64> {
    let beta = kaiser_beta(ATTENUATION);
    let taps: Vec<f64> = (0..=2 * half as usize)
        .map(|n| {
            let m = n as f64 - half;
            let sinc = if m == 0.0 {
                2.0 * cutoff
            } else {
                (TAU * cutoff * m).sin() / (PI * m)
            };
            sinc * bessel_i0(beta * (1.0 - (m / half).powi(2)).max(0.0).sqrt())
        })
        .collect();
    let sum: f64 = taps.iter().sum();
    taps.into_iter().map(|h| h / sum).collect()
}

/// Mixes every response down by `theta` (rad a sample), filters it, and keeps one value in `stride`.
fn mix_down(
    responses: &[Vec<f64>],
    taps: &[f64],
    theta: f64,
    stride: usize,
    count: usize,
) -> Vec<Vec<Complex64>> {
    // Filter taps that mix down as well: 2 h(m) e^{-j theta (m - (M-1)/2)}. The factor 2 makes a real
    // oscillation's peak amplitude the modulus of the result.
    let middle = (taps.len() - 1) as f64 / 2.0;
    let carrier: Vec<Complex64> = (taps.iter().enumerate())
        .map(|(m, h)| Complex64::from_polar(2.0 * h, -theta * (m as f64 - middle)))
        .collect();
    let starts = (0..count).map(|n| n * stride);
    let sensors = responses.iter().map(|samples| {
        let values = starts.clone().map(|from| {
            let (mut re, mut im) = (0.0, 0.0);
            for (x, h) in samples[from..].iter().zip(&carrier) {
                re += x * h.re;
                im += x * h.im;
            }
            Complex64::new(re, im) * Complex64::from_polar(1.0, -theta * from as f64)
        });
        values.collect()
    });
    sensors.collect()
}

/// Returns the poles relative to mode `index` (rad/s) of the other modes nearer than `stop` (Hz).
fn neighbours(modes: &[KnownMode], index: usize, stop: f64, taken: &[usize]) -> Vec<Complex64> {
    let frequency = modes[index].frequency;
    let others = modes
        .iter()
        .enumerate()
        .filter(|(other, _)| *other != index && !taken.contains(other));
    others
        .filter(|(_, mode)| (mode.frequency - frequency).abs() < stop)
        .map(|(_, mode)| {
            let sigma = TAU * mode.frequency * mode.damping_ratio.max(LEAST_DAMPING);
            Complex64::new(-sigma, TAU * (mode.frequency - frequency))
        })
        .collect()
}

/// Least noise variance over the mean power: 200 dB.
const FLOOR: f64 = 1e-20;

/// Returns the sensor with the largest amplitude at the start of the decays; `None` without any.
pub(super) fn strongest(bands: &[Band]) -> Option<usize> {
    let count = bands.iter().map(|band| band.sensors.len()).min()?;
    let mut energies = vec![0.0; count];
    for band in bands {
        for (energy, values) in energies.iter_mut().zip(band.early_values().column_iter()) {
            *energy += values.norm_squared();
        }
    }
    let audible = energies
        .iter()
        .enumerate()
        .filter(|(_, energy)| **energy > 0.0);
    let strongest = audible.max_by(|a, b| a.1.total_cmp(b.1));
    strongest.map(|(sensor, _)| sensor)
}

/// Returns the sensors' weighted sum, scaled so that it has the amplitude of the sensor `reference`.
///
/// With the amplitude ratios c(s) to the reference and noise variances v(s), the best weights are
/// conj(c)/v over sum |c|^2/v. They are fixed over the decay, so that an exponential stays one.
pub(super) fn combine(band: &Band, reference: usize) -> Option<Vec<Complex64>> {
    let main = band.sensors.get(reference)?;
    let early = band.early_values();
    let main_energy = early.column(reference).norm_squared();
    if main.len() < 6 || main_energy.is_nan() || main_energy <= 0.0 {
        return None;
    }
    let mut sum = vec![Complex64::ZERO; main.len()];
    let mut total = 0.0;
    for (values, early_values) in band.sensors.iter().zip(early.column_iter()) {
        let ratio = early.column(reference).dotc(&early_values) / main_energy;
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

/// Returns the noise variance of a sensor's values, from what the neighbours in time do not predict:
/// y(n) - (z y(n-1) + y(n+1)/z)/2 with z = e^{p step} has 1.5 times the variance of white noise, and
/// the median of an exponentially distributed square is ln 2 of its mean. Not below what no converter
/// undercuts, so that simulated signals without noise divide nothing by zero.
pub(super) fn noise_variance(values: &[Complex64], band: &Band) -> f64 {
    let z = (band.decay * band.step).exp();
    let mut squares: Vec<f64> = values
        .windows(3)
        .map(|y| (y[1] - 0.5 * (z * y[0] + y[2] / z)).norm_sqr())
        .collect();
    let power = values.iter().map(Complex64::norm_sqr).sum::<f64>() / values.len().max(1) as f64;
    (median(&mut squares) / (1.5 * std::f64::consts::LN_2)).max(FLOOR * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_the_gain_is_the_sum_over_the_filter() {
        let rate = 25600.0;
        let half = 200.0;
        let taps = low_pass(half, 0.01);
        let band = Band {
            tap: 0,
            omega: 0.0,
            decay: -1.0,
            scale: 1.0,
            first: 0.0,
            step: 1.0,
            filter: taps.len() as f64 / rate,
            length: 1.0,
            noise_ratio: 1.0,
            taps: taps.clone(),
            sample_rate: rate,
            sensors: Vec::new(),
            neighbours: Vec::new(),
        };
        assert!((band.gain(Complex64::ZERO) - 1.0).norm() < 1e-14);
        for pole in [(-3.0, 0.0), (-40.0, 90.0), (25.0, -200.0), (-400.0, 5.0)] {
            let pole = Complex64::new(pole.0, pole.1);
            let terms = taps.iter().enumerate();
            let sum: Complex64 = terms
                .map(|(m, h)| (pole * ((m as f64 - half) / rate)).exp() * *h)
                .sum();
            assert!((band.gain(pole) / sum - 1.0).norm() < 1e-12, "{pole}");
        }
    }
}
