//! Windows over a tap record, chosen by how far it rings down; and the noise of a channel, line by line, from a quiet
//! stretch before the taps.

use std::f64::consts::TAU;

use num_complex::Complex64;
use tapjoint_numerics::stats::{Sorted, median};

use super::Lines;
use super::transform::Transformer;

/// A window as applied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Window {
    /// None: right for a record that rings down by itself.
    Rectangular,
    /// Hann, 1 - cos; for steady signals.
    Hann,
    /// e^{-decay t} from the start of the record, on force and response alike. It moves every pole
    /// by exactly `decay` to the left, which the reading of a damping must take back.
    Exponential {
        /// Decay a (1/s).
        decay: f64,
    },
}

impl Window {
    /// Decay the window adds to every pole (1/s); 0 for windows that add none.
    pub fn added_decay(self) -> f64 {
        match self {
            Window::Exponential { decay } => decay,
            Window::Rectangular | Window::Hann => 0.0,
        }
    }

    /// Applies the window in place. The Hann window is scaled to mean 1, so that the amplitude of a
    /// steady line stays what it is.
    pub fn apply(self, samples: &mut [f64], sample_rate: f64) {
        match self {
            Window::Rectangular => {}
            Window::Hann => {
                let step = TAU / samples.len().max(1) as f64;
                for (n, x) in samples.iter_mut().enumerate() {
                    *x *= 1.0 - (step * n as f64).cos();
                }
            }
            Window::Exponential { decay } => {
                let step = -decay / sample_rate;
                for (n, x) in samples.iter_mut().enumerate() {
                    *x *= (step * n as f64).exp();
                }
            }
        }
    }

    /// The window's name as written in a description and a report.
    pub fn name(self) -> &'static str {
        match self {
            Window::Rectangular => "rectangular",
            Window::Hann => "hann",
            Window::Exponential { .. } => "exponential",
        }
    }
}

/// The force window: unity over the first `unity` samples (pre-trigger, pulse and the filter's
/// ringing), a half-cosine taper over `taper` samples, exact zero after. It takes the noise of a
/// whole record out of a force that lasts a millisecond; a second hit must have been looked for
/// before.
pub fn apply_force_window(samples: &mut [f64], unity: usize, taper: usize) {
    let unity = unity.min(samples.len());
    let (_, rest) = samples.split_at_mut(unity);
    let (tapered, zero) = rest.split_at_mut(taper.min(rest.len()));
    for (n, x) in tapered.iter_mut().enumerate() {
        let share = (n + 1) as f64 / (taper + 1) as f64;
        *x *= 0.5 * (1.0 + (std::f64::consts::PI * share).cos());
    }
    zero.fill(0.0);
}

/// Level at a record's end that counts as rung down: 1 % (field practice after ISO 7626-5).
pub const RUNG_DOWN: f64 = 0.01;

/// The end of a record judged against its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayCheck {
    /// rms over the last twentieth of the record over the largest rms of any twentieth, the
    /// noise power taken out of both.
    pub remaining: f64,
    /// Noise alone, on the same scale: a smaller `remaining` is not known.
    pub noise: f64,
}

impl DecayCheck {
    /// Result for a record that never rises above its noise.
    pub const NOTHING: Self = Self {
        remaining: 0.0,
        noise: 1.0,
    };
}

/// Measures how far `samples` (a tap record without window, its mean taken out) rings down.
///
/// `noise_rms` is the rms of the noise before the taps (same unit as the samples).
pub fn measure_decay(samples: &[f64], noise_rms: f64) -> DecayCheck {
    let piece = (samples.len() / 20).max(1);
    let powers: Vec<f64> = samples
        .chunks_exact(piece)
        .map(|chunk| chunk.iter().map(|x| x * x).sum::<f64>() / piece as f64)
        .collect();
    let noise_power = noise_rms * noise_rms;
    let largest = powers.iter().copied().fold(0.0, f64::max) - noise_power;
    if largest <= 0.0 {
        return DecayCheck::NOTHING;
    }
    let last = (powers.last().copied().unwrap_or(0.0) - noise_power).max(0.0);
    DecayCheck {
        remaining: (last / largest).sqrt(),
        noise: noise_rms / largest.sqrt(),
    }
}

/// Rectangular where the slowest response rings down to 1 % in the record (or into its noise), else
/// the exponential window that takes it there: e^{-aT} = 1 %/remaining.
///
/// `duration` is the record's length T (s).
pub fn choose_window(checks: &[DecayCheck], duration: f64) -> Window {
    let remaining = checks
        .iter()
        .filter(|check| check.remaining > check.noise)
        .map(|check| check.remaining)
        .fold(0.0, f64::max);
    if remaining <= RUNG_DOWN {
        Window::Rectangular
    } else {
        Window::Exponential {
            decay: (remaining / RUNG_DOWN).ln() / duration,
        }
    }
}

/// End of an exponential window on a record that has rung down already: 10 %, so that what was asked for
/// is there, and the decay it adds stays below that of the record.
const GENTLE: f64 = 0.1;

/// The exponential window where a description asks for it. It brings a response that keeps `remaining` of its
/// level down to 1 %, and falls to 10 % at least.
///
/// `duration` is the record's length T (s).
pub fn exponential_to(remaining: f64, duration: f64) -> Window {
    let fall = (RUNG_DOWN / remaining.max(f64::MIN_POSITIVE)).clamp(RUNG_DOWN, GENTLE);
    Window::Exponential {
        decay: -fall.ln() / duration,
    }
}

/// Lines over which the noise is smoothed, to either side.
const REACH: usize = 8;
/// A quiet stretch shorter than this tells nothing (samples).
const LEAST_QUIET: usize = 64;

/// Power |X|^2 that noise alone would leave on each line of a record, divided by the window's energy
/// (the sum of its squared values).
///
/// `quiet` is a stretch without taps of each channel, equally long, its mean taken out. The median over neighbouring lines keeps
/// mains lines from counting as noise; a median of exponentially distributed powers is ln 2 of their
/// mean. `None` when the stretch is shorter than 64 samples.
pub fn noise_power(quiet: &[&[f64]], sample_rate: f64, lines: &Lines) -> Option<Vec<Vec<f64>>> {
    let length = quiet.first()?.len();
    if length < LEAST_QUIET {
        return None;
    }
    let transformer = Transformer::new(sample_rate, *lines, length);
    // The Hann window scaled to mean 1 has the energy 3/2 per sample.
    let energy = 1.5 * length as f64;
    // A short stretch is interpolated onto dense lines: neighbours within its resolution are one.
    let width = (sample_rate / length as f64 / lines.spacing).ceil() as usize;
    let noise = quiet.iter().map(|samples| {
        let mut samples = samples.to_vec();
        Window::Hann.apply(&mut samples, sample_rate);
        let transformed = transformer.transform(&samples).into_iter();
        let powers: Vec<f64> = transformed.map(|x| x.norm_sqr() / energy).collect();
        smooth(&powers, REACH * width.max(1))
    });
    Some(noise.collect())
}

/// Median over `reach` lines to either side, taken on at most 17 of them.
fn smooth(powers: &[f64], reach: usize) -> Vec<f64> {
    let stride = (reach / REACH).max(1);
    // Every line shares all but one or two values with the one a stride before it.
    let mut windows = vec![Sorted::default(); stride];
    (0..powers.len())
        .map(|index| {
            let window = &mut windows[index % stride];
            if index < reach + stride {
                let around = &powers[index.saturating_sub(reach)..];
                let around = &around[..around.len().min(index.min(reach) + reach + 1)];
                *window = Sorted::of(around.iter().step_by(stride).copied().collect());
            } else {
                window.remove(powers[index - reach - stride]);
                let next = powers.get(index + reach);
                next.into_iter().for_each(|next| window.insert(*next));
            }
            window.median() / std::f64::consts::LN_2
        })
        .collect()
}

/// Samples whose products go side by side: one would wait for the turn of the phase before.
const LANES: usize = 4;

/// Largest turn (rad) of a frequency against the middle of several, within a block of samples that count as one. A
/// twentieth: their sum is then short by (turn/2)^2/6 = 1e-4 of itself, which is put right.
const BLOCK_TURN: f64 = 0.05;

/// Largest turn (rad) of that kind within the smallest block, of [`LANES`] samples. A fifth: its sum is short by
/// (turn/2)^2/6 = 2e-3, which is put right. Stretches of a thousand samples then need no pass for each frequency.
const LANES_TURN: f64 = 0.2;

/// Amplitudes of steady lines at several `frequencies` (Hz) near each other in `samples`, 2 |sum x e^{-j omega t}|/n;
/// `None` where they hold fewer than three periods. The samples are turned by the middle frequency once, and
/// summed in blocks. The blocks are turned by what each frequency differs from the middle.
pub(crate) fn line_amplitudes(
    samples: &[f64],
    sample_rate: f64,
    frequencies: &[f64],
) -> Vec<Option<f64>> {
    let count = samples.len() as f64;
    let lowest = frequencies.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = frequencies
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    let middle = 0.5 * (lowest + highest);
    // Turn from one sample to the next; 0 of a single frequency.
    let widest = TAU * 0.5 * (highest - lowest) / sample_rate;
    let groups = (BLOCK_TURN / widest / LANES as f64) as usize;
    if widest * LANES as f64 > LANES_TURN {
        // Too far apart for blocks.
        let alone = frequencies.chunks(1);
        return alone
            .flat_map(|one| line_amplitudes(samples, sample_rate, one))
            .collect();
    }
    let length = LANES * groups.clamp(1, samples.len().div_ceil(LANES).max(1));
    let sums = sums_of_blocks(samples, -TAU * middle / sample_rate, length);
    let amplitudes = frequencies.iter().map(|frequency| {
        let turn = -TAU * (frequency - middle) / sample_rate;
        let step = Complex64::from_polar(1.0, turn * length as f64);
        let (mut phase, mut sum) = (Complex64::ONE, Complex64::ZERO);
        for block in &sums {
            sum += block * phase;
            phase *= step;
        }
        let half = 0.5 * turn * length as f64;
        let short = if half == 0.0 { 1.0 } else { half.sin() / half };
        let holds_three = count >= 3.0 * sample_rate / frequency;
        holds_three.then(|| 2.0 * sum.norm() / count / short)
    });
    amplitudes.collect()
}

/// Sums of x e^{j turn n} over each block of samples, whose length is a multiple of [`LANES`].
fn sums_of_blocks(samples: &[f64], turn: f64, block: usize) -> Vec<Complex64> {
    let step = Complex64::from_polar(1.0, turn * LANES as f64);
    let phases: [Complex64; LANES] =
        std::array::from_fn(|lane| Complex64::from_polar(1.0, turn * lane as f64));
    let (mut re, mut im) = (phases.map(|phase| phase.re), phases.map(|phase| phase.im));
    let blocks = samples.chunks(block).map(|block| {
        let (mut sum_re, mut sum_im) = ([0.0; LANES], [0.0; LANES]);
        for some in block.chunks(LANES) {
            let mut x = [0.0; LANES];
            x[..some.len()].copy_from_slice(some);
            for lane in 0..LANES {
                sum_re[lane] += re[lane] * x[lane];
                sum_im[lane] += im[lane] * x[lane];
                let turned = re[lane] * step.re - im[lane] * step.im;
                im[lane] = re[lane] * step.im + im[lane] * step.re;
                re[lane] = turned;
            }
        }
        Complex64::new(sum_re.iter().sum(), sum_im.iter().sum())
    });
    blocks.collect()
}

/// Returns the amplitude of a steady line at `frequency` (Hz) and the root mean square amplitude of the noise beside it, both
/// in the unit of the samples; `None` when they hold fewer than three periods.
///
/// The noise is from the median over 3 to 8 resolutions 1/T to either side: nearer ones hold the line itself, and
/// another line among them does not count. Powers of noise are exponentially distributed, so that their
/// median is ln 2 of their mean.
pub fn line_and_noise(samples: &[f64], sample_rate: f64, frequency: f64) -> Option<(f64, f64)> {
    let resolution = sample_rate / samples.len() as f64;
    let offsets = (3..=8).flat_map(|k| [-1.0, 1.0].map(|side| side * f64::from(k) * resolution));
    let beside = offsets
        .map(|offset| frequency + offset)
        .filter(|place| *place > 0.0);
    let places: Vec<f64> = std::iter::once(frequency).chain(beside).collect();
    let mut amplitudes = line_amplitudes(samples, sample_rate, &places).into_iter();
    let line = amplitudes.next().flatten()?;
    let mut beside: Vec<f64> = amplitudes.flatten().collect();
    let half_power = std::f64::consts::LN_2.sqrt();
    (!beside.is_empty()).then(|| (line, median(&mut beside) / half_power))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_lines_of_blocks_are_those_of_all_samples() {
        let rate = 5000.0;
        for count in [1, 7, 250, 5003] {
            let samples: Vec<f64> = (0..count)
                .map(|n| (0.7 * n as f64).sin() + 0.3 * (0.0001 * (n * n) as f64).cos())
                .collect();
            // One frequency, near ones in blocks, and others that are too far apart for blocks.
            let near: &[f64] = &[-1.5, -0.5, 0.2, 1.5];
            let of_smallest: &[f64] = &[-30.0, 0.0, 30.0];
            for (offsets, allowed) in [
                (&[0.0][..], 4.2e-4),
                (near, 4.2e-4),
                (of_smallest, 4.2e-3),
                (&[-300.0, 700.0], 4.2e-4),
            ] {
                let places: Vec<f64> = offsets.iter().map(|offset| 557.0 + offset).collect();
                let found = line_amplitudes(&samples, rate, &places);
                for (place, found) in places.iter().zip(found) {
                    assert_eq!(found.is_some(), count as f64 >= 3.0 * rate / place);
                    let turned = samples.iter().enumerate().map(|(n, x)| {
                        x * Complex64::from_polar(1.0, -TAU * place * n as f64 / rate)
                    });
                    let plain = 2.0 * turned.sum::<Complex64>().norm() / count as f64;
                    let off = found.unwrap_or(plain) - plain;
                    // A line of size 1 on the other side of the middle turns twice as far: (2 turn/2)^2/6. The turn is
                    // BLOCK_TURN, and 0.15 in the smallest block.
                    assert!(off.abs() < allowed, "{count} {place}: {off:e}");
                }
            }
        }
    }
}
