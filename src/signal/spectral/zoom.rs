//! Zooming into a band as an analyser does: mix, low-pass, decimate.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::chirp::phase;
use super::lines::DISPLAY_RATIO;

/// Stop-band attenuation of the zoom's low-pass filter (dB): below the 24-bit noise of good
/// recorders once the decimated lines add up.
const STOP_BAND_DB: f64 = 100.0;

/// Kaiser's relation between attenuation (dB) and the shape parameter beta, above 50 dB
/// (Oppenheim & Schafer).
fn kaiser_beta(attenuation: f64) -> f64 {
    0.1102 * (attenuation - 8.7)
}

/// Modified Bessel function I0, by its power series: converges for every argument used here.
fn bessel_i0(x: f64) -> f64 {
    let quarter = x * x / 4.0;
    let (mut term, mut sum, mut k) = (1.0, 1.0, 1.0);
    while term > sum * 1e-17 {
        term *= quarter / (k * k);
        sum += term;
        k += 1.0;
    }
    sum
}

/// Low-pass with pass band up to `pass` and stop band from `stop` (both Hz), unity at 0 Hz, odd
/// length, symmetric.
fn low_pass(pass: f64, stop: f64, sample_rate: f64) -> Vec<f64> {
    let transition = TAU * (stop - pass) / sample_rate;
    // Kaiser's length: (A - 7.95)/(2.285 transition).
    let half = ((STOP_BAND_DB - 7.95) / (2.285 * transition) / 2.0).ceil() as i64;
    let cut_off = PI * (pass + stop) / sample_rate;
    let beta = kaiser_beta(STOP_BAND_DB);
    let taps: Vec<f64> = (-half..=half)
        .map(|n| {
            let sinc = if n == 0 {
                cut_off / PI
            } else {
                (cut_off * n as f64).sin() / (PI * n as f64)
            };
            let edge = n as f64 / (half as f64 + 1.0);
            sinc * bessel_i0(beta * (1.0 - edge * edge).sqrt()) / bessel_i0(beta)
        })
        .collect();
    let sum: f64 = taps.iter().sum();
    taps.iter().map(|tap| tap / sum).collect()
}

/// By how much a band of this width (Hz) can be decimated: to the next whole divisor above the complex
/// rate of 1.28 widths that an analyser would use.
pub(super) fn decimation_factor(sample_rate: f64, width: f64) -> usize {
    (sample_rate / (DISPLAY_RATIO / 2.0 * width)).floor() as usize
}

/// Mixing, filtering and decimating as an analyser's zoom does it: what every record shares. Output m
/// is at time (m * factor - delay)/sample_rate from the record's start.
#[derive(Debug)]
pub(crate) struct Decimator {
    /// e^{-j 2 pi centre t} at every sample.
    oscillator: Vec<Complex64>,
    filter: Vec<f64>,
    factor: usize,
}

impl Decimator {
    /// Mixes records of at most `length` samples down by `centre` (Hz) and decimates by `factor`, so
    /// that `width` (Hz) around it survives.
    pub(crate) fn new(
        sample_rate: f64,
        (centre, width): (f64, f64),
        factor: usize,
        length: usize,
    ) -> Self {
        let rate = sample_rate / factor as f64;
        let turn = |n| Complex64::from_polar(1.0, phase(centre / sample_rate, n as f64));
        Decimator {
            oscillator: (0..length).map(turn).collect(),
            filter: low_pass(width / 2.0, rate - width / 2.0, sample_rate),
            factor,
        }
    }

    /// Samples by which the first output lies before the record's start.
    pub(crate) fn delay(&self) -> usize {
        self.filter.len() / 2
    }

    /// Outputs of a record of `length` samples.
    pub(super) fn outputs(&self, length: usize) -> usize {
        (length + 2 * self.delay()).div_ceil(self.factor)
    }

    /// The record decimated.
    ///
    /// It is taken as zero outside its ends and the filter's tails are kept, so that the result has
    /// exactly the spectrum of the record times the filter's pass band.
    pub(crate) fn run(&self, samples: &[f64]) -> Vec<Complex64> {
        let mixed: Vec<Complex64> = samples
            .iter()
            .zip(&self.oscillator)
            .map(|(&x, turn)| turn * x)
            .collect();
        (0..self.outputs(mixed.len()))
            .map(|m| {
                let centre_index = (m * self.factor) as i64 - self.delay() as i64;
                filtered(&mixed, &self.filter, centre_index)
            })
            .collect()
    }
}

/// Magnitude over time of what `samples` have between `low` and `high` (Hz): mixed down, filtered and
/// decimated, the filter's tails cut off; the samples themselves where the band is most of what
/// there is.
pub fn band_limited(samples: &[f64], sample_rate: f64, (low, high): (f64, f64)) -> Vec<f64> {
    let factor = decimation_factor(sample_rate, high - low);
    if factor < 3 {
        return samples.to_vec();
    }
    let band = (0.5 * (low + high), high - low);
    let decimator = Decimator::new(sample_rate, band, factor, samples.len());
    let skip = decimator.delay() / factor;
    let keep = samples.len() / factor;
    // A real oscillation of amplitude a leaves a magnitude of a/2.
    decimator
        .run(samples)
        .iter()
        .skip(skip)
        .take(keep)
        .map(|z| 2.0 * z.norm())
        .collect()
}

/// One output of the symmetric filter, centred on `index`.
fn filtered(mixed: &[Complex64], filter: &[f64], index: i64) -> Complex64 {
    let half = (filter.len() / 2) as i64;
    let first = (index - half).max(0);
    let last = (index + half).min(mixed.len() as i64 - 1);
    if last < first {
        return Complex64::ZERO;
    }
    let samples = &mixed[first as usize..=last as usize];
    let weights = &filter[(first - index + half) as usize..];
    // Four sums side by side: one would wait for each addition before the next.
    let mut sums = [Complex64::ZERO; 4];
    let mut quarters = samples.chunks_exact(4).zip(weights.chunks_exact(4));
    for (samples, weights) in &mut quarters {
        for ((sum, x), weight) in sums.iter_mut().zip(samples).zip(weights) {
            *sum += x * weight;
        }
    }
    let done = samples.len() / 4 * 4;
    let rest = samples[done..].iter().zip(&weights[done..]);
    sums.iter().sum::<Complex64>() + rest.map(|(x, weight)| x * weight).sum::<Complex64>()
}
