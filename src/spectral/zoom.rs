//! Zooming into a band as an analyser does: mix, low-pass, decimate, transform.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use rustfft::FftPlanner;

use super::block::smallest_smooth_block;
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

/// A record mixed down by `centre`, filtered and decimated; sample m is at time
/// (m * factor - delay)/sample_rate from the record's start.
pub(crate) struct Decimated {
    pub samples: Vec<Complex64>,
    pub factor: usize,
    pub delay: usize,
}

/// Mixes `samples` down by `centre` (Hz) and decimates so that `width` (Hz) around it survives.
///
/// The record is taken as zero outside its ends and the filter's tails are kept, so that the result
/// has exactly the spectrum of the record times the filter's pass band.
pub(crate) fn mix_and_decimate(
    samples: &[f64],
    sample_rate: f64,
    (centre, width): (f64, f64),
    factor: usize,
) -> Decimated {
    let rate = sample_rate / factor as f64;
    let filter = low_pass(width / 2.0, rate - width / 2.0, sample_rate);
    let half = filter.len() / 2;
    let mixed: Vec<Complex64> = samples
        .iter()
        .enumerate()
        .map(|(n, &x)| Complex64::from_polar(x, phase(centre / sample_rate, n as f64)))
        .collect();
    let outputs = (samples.len() + 2 * half).div_ceil(factor);
    let decimated = (0..outputs)
        .map(|m| {
            let centre_index = (m * factor) as i64 - half as i64;
            filtered(&mixed, &filter, centre_index)
        })
        .collect();
    Decimated {
        samples: decimated,
        factor,
        delay: half,
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
    let zoomed = mix_and_decimate(
        samples,
        sample_rate,
        (0.5 * (low + high), high - low),
        factor,
    );
    let skip = zoomed.delay / factor;
    let keep = samples.len() / factor;
    // A real oscillation of amplitude a leaves a magnitude of a/2.
    zoomed
        .samples
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
    let mut sum = Complex64::ZERO;
    for n in first..=last {
        sum += mixed[n as usize] * filter[(n - index + half) as usize];
    }
    sum
}

/// Phase -2 pi cycles n, reduced to one turn before it is rounded.
fn phase(cycles: f64, n: f64) -> f64 {
    let product = cycles * n;
    // The rounding error of the product, recovered exactly, keeps long records accurate.
    let error = cycles.mul_add(n, -product);
    -TAU * ((product - product.round()) + error)
}

/// Chirp z-transform (Bluestein): sum over n of x(n) e^{-j 2 pi n (start + k step)} for k below
/// `count`, `start` and `step` in cycles per sample.
pub fn chirp_z(samples: &[Complex64], start: f64, step: f64, count: usize) -> Vec<Complex64> {
    let n = samples.len();
    if n == 0 || count == 0 {
        return vec![Complex64::ZERO; count];
    }
    let length = smallest_smooth_block(n + count);
    // e^{-j pi step k^2}: half the chirp, so that nk = (n^2 + k^2 - (k-n)^2)/2.
    let chirp = |k: i64| Complex64::from_polar(1.0, phase(step / 2.0, (k * k) as f64));
    let mut signal: Vec<Complex64> = samples
        .iter()
        .enumerate()
        .map(|(i, x)| x * Complex64::from_polar(1.0, phase(start, i as f64)) * chirp(i as i64))
        .collect();
    signal.resize(length, Complex64::ZERO);
    let mut kernel = vec![Complex64::ZERO; length];
    for (k, value) in kernel.iter_mut().take(count).enumerate() {
        *value = chirp(k as i64).conj();
    }
    for i in 1..n {
        kernel[length - i] = chirp(i as i64).conj();
    }
    let mut planner = FftPlanner::new();
    let forward = planner.plan_fft_forward(length);
    forward.process(&mut signal);
    forward.process(&mut kernel);
    for (x, k) in signal.iter_mut().zip(&kernel) {
        *x *= k;
    }
    planner.plan_fft_inverse(length).process(&mut signal);
    let scale = 1.0 / length as f64;
    (0..count)
        .map(|k| signal[k] * chirp(k as i64) * scale)
        .collect()
}
