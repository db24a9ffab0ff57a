//! Noise of a channel, line by line, from a quiet stretch before the taps.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::lines::Lines;
use super::transform::transform_block;
use super::window::Window;
use tapjoint_numerics::stats::median;

/// Lines over which the noise is smoothed, to either side.
const REACH: usize = 8;
/// A quiet stretch shorter than this tells nothing (samples).
const LEAST_QUIET: usize = 64;

/// Power |X|^2 that noise alone would leave on each line of a record, divided by the window's energy
/// (the sum of its squared values).
///
/// `quiet` is a stretch without taps, its mean taken out. The median over neighbouring lines keeps
/// mains lines from counting as noise; a median of exponentially distributed powers is ln 2 of their
/// mean. `None` when the stretch is shorter than 64 samples.
pub fn noise_power(mut quiet: Vec<f64>, sample_rate: f64, lines: &Lines) -> Option<Vec<f64>> {
    if quiet.len() < LEAST_QUIET {
        return None;
    }
    Window::Hann.apply(&mut quiet, sample_rate);
    // The Hann window scaled to mean 1 has the energy 3/2 per sample.
    let energy = 1.5 * quiet.len() as f64;
    let powers: Vec<f64> = transform_block(&quiet, sample_rate, lines)
        .iter()
        .map(|x| x.norm_sqr() / energy)
        .collect();
    // A short stretch is interpolated onto dense lines: neighbours within its resolution are one.
    let width = (sample_rate / quiet.len() as f64 / lines.spacing).ceil() as usize;
    Some(smooth(&powers, REACH * width.max(1)))
}

/// Median over `reach` lines to either side, taken on at most 17 of them.
fn smooth(powers: &[f64], reach: usize) -> Vec<f64> {
    let stride = (reach / REACH).max(1);
    (0..powers.len())
        .map(|index| {
            let first = index.saturating_sub(reach);
            let last = (index + reach).min(powers.len() - 1);
            let mut around: Vec<f64> = (first..=last).step_by(stride).map(|i| powers[i]).collect();
            let half = around.len() / 2;
            *around.select_nth_unstable_by(half, f64::total_cmp).1 / std::f64::consts::LN_2
        })
        .collect()
}

/// Amplitude of a steady line at `frequency` (Hz) in `samples`, 2 |sum x e^{-j omega t}|/n; `None`
/// when they hold fewer than three periods.
pub fn line_amplitude(samples: &[f64], sample_rate: f64, frequency: f64) -> Option<f64> {
    if (samples.len() as f64) < 3.0 * sample_rate / frequency {
        return None;
    }
    let step = Complex64::from_polar(1.0, -TAU * frequency / sample_rate);
    let mut turn = Complex64::ONE;
    let mut sum = Complex64::ZERO;
    for &x in samples {
        sum += turn * x;
        turn *= step;
    }
    Some(2.0 * sum.norm() / samples.len() as f64)
}

/// Root mean square of the amplitudes that noise has beside `frequency` (Hz), as [`line_amplitude`] gives
/// them; `None` where it gives none.
///
/// From the median over 3 to 8 resolutions 1/T to either side: nearer ones hold the line itself, and
/// another line among them does not count. Powers of noise are exponentially distributed, so that their
/// median is ln 2 of their mean.
pub fn noise_beside(samples: &[f64], sample_rate: f64, frequency: f64) -> Option<f64> {
    let resolution = sample_rate / samples.len() as f64;
    let places = (3..=8).flat_map(|k| [-1.0, 1.0].map(|side| side * f64::from(k) * resolution));
    let mut amplitudes: Vec<f64> = places
        .map(|offset| frequency + offset)
        .filter(|place| *place > 0.0)
        .filter_map(|place| line_amplitude(samples, sample_rate, place))
        .collect();
    let half_power = std::f64::consts::LN_2.sqrt();
    (!amplitudes.is_empty()).then(|| median(&mut amplitudes) / half_power)
}
