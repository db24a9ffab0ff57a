//! The force pulse of a tap in numbers: its width, and how far its spectrum reaches.

use realfft::RealFftPlanner;
use schemars::JsonSchema;
use serde::Serialize;
use std::f64::consts::PI;

use crate::spectral::DISPLAY_RATIO;

/// Width of a force pulse and the band that it excites.
///
/// A fall (dB) is that of the magnitude of the Fourier transform, relative to its largest value at lower frequencies. A
/// half sine of length L has the transform cos(pi f L)/(1 - (2 f L)^2) over its value at 0 Hz. Its width at half
/// height is w = L/1.5, and it falls by 10 dB at 0.68/w and by 20 dB at 0.87/w.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Pulse {
    /// Width at half of its height (s). The curve between the samples is the band-limited one: a pulse of two samples has
    /// the same width wherever they fall.
    pub width: f64,
    /// Lowest frequency at which the spectrum has fallen by 10 dB (Hz); null where it has not at half the sample rate.
    pub fall_10_db: Option<f64>,
    /// Lowest frequency at which it has fallen by 20 dB (Hz); null where it has not at half the sample rate.
    pub fall_20_db: Option<f64>,
    /// End of the band that the pulse excites well (Hz): the fall by 20 dB, the frequency at which the spectrum comes
    /// within 10 dB of the channel's noise, or sample rate/2.56, whichever is lowest.
    pub usable_to: f64,
}

/// Force over its noise below which the noise shows in H1 (dB). 10: noise in the force makes H1 too
/// small by the share of its power, here a tenth.
pub const FORCE_OVER_NOISE: f64 = 10.0;
/// Lines of the transform to each sample of the pulse: its main lobe then has many.
const PADDING: usize = 8;
/// Fewest lines of the transform.
const LEAST_LINES: usize = 4096;
/// Halvings of an interval of one sample in which a place is looked for.
const HALVINGS: usize = 30;

impl Pulse {
    /// Reads a positive pulse on a baseline of zero. At the end of the samples it has died away. `noise` is the channel's
    /// standard deviation (its unit), `rate` the sample rate (Hz). `None` of samples without a positive one.
    pub(super) fn of(samples: &[f64], noise: f64, rate: f64) -> Option<Pulse> {
        let numbered = samples.iter().enumerate();
        let (crest, _) = numbered
            .max_by(|a, b| a.1.total_cmp(b.1))
            .filter(|(_, height)| **height > 0.0)?;
        // As much before the crest as after it: an anti-alias filter may ring on either side, and what comes before that
        // is noise and drift of the channel.
        let start = crest.saturating_sub(samples.len() - crest);
        let (samples, crest) = (&samples[start..], crest - start);
        let size = (PADDING * samples.len())
            .max(2 * LEAST_LINES)
            .next_power_of_two();
        let transform = RealFftPlanner::<f64>::new().plan_fft_forward(size);
        let mut input = transform.make_input_vec();
        input[..samples.len()].copy_from_slice(samples);
        let mut spectrum = transform.make_output_vec();
        transform.process(&mut input, &mut spectrum).ok()?;
        // White noise of variance s^2 leaves N s^2 in the power of every line of N samples.
        let floor = noise * noise * samples.len() as f64;
        let sunk = 10f64.powf(FORCE_OVER_NOISE / 10.0) * floor;
        let spacing = rate / size as f64;
        let (mut largest, mut before) = (0.0, 0.0);
        let (mut falls, mut sinks) = ([None, None], None);
        for (line, value) in spectrum.iter().enumerate() {
            let power = value.norm_sqr();
            let frequency = line as f64 * spacing;
            largest = f64::max(largest, power);
            // 10 and 20 dB are a tenth and a hundredth of the power.
            for (fall, share) in falls.iter_mut().zip([0.1, 0.01]) {
                let level = share * largest;
                if fall.is_none() && power < level {
                    // Between the line before, which was above the level, and this one.
                    let power = power.max(f64::MIN_POSITIVE);
                    let beyond = (level / power).ln() / f64::ln(before / power);
                    *fall = Some(frequency - beyond * spacing);
                }
            }
            before = power;
            if sinks.is_none() && power < sunk {
                sinks = Some(frequency);
            }
        }
        let ends = [falls[1], sinks].into_iter().flatten();
        Some(Pulse {
            width: half_height_width(samples, crest) / rate,
            fall_10_db: falls[0],
            fall_20_db: falls[1],
            usable_to: ends.fold(rate / DISPLAY_RATIO, f64::min),
        })
    }

    /// Returns the mean of several pulses; `None` of none. A fall that one of them lacks has no mean.
    pub fn mean(pulses: &[Pulse]) -> Option<Pulse> {
        let count = pulses.len() as f64;
        let total = |read: fn(&Pulse) -> Option<f64>| pulses.iter().map(read).sum::<Option<f64>>();
        (!pulses.is_empty()).then(|| Pulse {
            width: pulses.iter().map(|pulse| pulse.width).sum::<f64>() / count,
            fall_10_db: total(|pulse| pulse.fall_10_db).map(|sum| sum / count),
            fall_20_db: total(|pulse| pulse.fall_20_db).map(|sum| sum / count),
            usable_to: pulses.iter().map(|pulse| pulse.usable_to).sum::<f64>() / count,
        })
    }
}

/// Width of the crest at half its height (samples), on the band-limited curve through the samples.
fn half_height_width(samples: &[f64], crest: usize) -> f64 {
    let curve = |place: f64| band_limited_value(samples, place);
    // The curve has one crest within a sample of the highest one.
    let (mut low, mut high) = (crest as f64 - 1.0, crest as f64 + 1.0);
    for _ in 0..HALVINGS {
        let [left, right] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
        if curve(left) < curve(right) {
            low = left;
        } else {
            high = right;
        }
    }
    let top = 0.5 * (low + high);
    let half = 0.5 * curve(top);
    let mut width = 0.0;
    for side in [-1.0, 1.0] {
        // The first sample at or below half the height, and the place above it beside.
        let mut above = top;
        let mut below = if side > 0.0 { top.ceil() } else { top.floor() };
        while curve(below) > half && below >= 0.0 && below < samples.len() as f64 {
            above = below;
            below += side;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (above + below);
            if curve(middle) > half {
                above = middle;
            } else {
                below = middle;
            }
        }
        width += (below - top).abs();
    }
    width
}

/// Value of the band-limited curve through the samples, sum of x(n) sinc(place - n); zero beyond them.
fn band_limited_value(samples: &[f64], place: f64) -> f64 {
    let nearest = place.round();
    let fraction = place - nearest;
    if fraction.abs() < 1e-9 {
        let inside = nearest >= 0.0 && nearest < samples.len() as f64;
        return if inside {
            samples[nearest as usize]
        } else {
            0.0
        };
    }
    // sin(pi (place - n)) changes its sign from sample to sample only.
    let mut sum = 0.0;
    let mut sign = 1.0 - 2.0 * nearest.rem_euclid(2.0);
    for (n, x) in samples.iter().enumerate() {
        sum += sign * x / (fraction - (n as f64 - nearest));
        sign = -sign;
    }
    (PI * fraction).sin() / PI * sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// A pulse of the given form in its length, begun at `start` (s), over 20 ms.
    fn samples(rate: f64, start: f64, length: f64, form: fn(f64) -> f64) -> Vec<f64> {
        let count = (0.02 * rate) as usize;
        let times = (0..count).map(|n| n as f64 / rate - start);
        let force = |t: f64| match (0.0..length).contains(&t) {
            true => form(PI * t / length),
            false => 0.0,
        };
        times.map(force).collect()
    }

    /// |F(f)| of a half sine of length L is cos(pi f L)/(1 - (2 f L)^2) over its value at 0.
    #[test]
    fn val_a_half_sine_falls_as_its_transform() {
        let (rate, length) = (200_000.0, 1.5e-3);
        let samples = samples(rate, 2e-3, length, f64::sin);
        let pulse = Pulse::of(&samples, 0.0, rate).unwrap();
        // A sine is above one half over two thirds of its arch.
        assert_relative_eq!(pulse.width, length / 1.5, max_relative = 1e-3);
        let level = |f: f64| {
            let x = f * length;
            20.0 * ((PI * x).cos() / (1.0 - 4.0 * x * x)).abs().log10()
        };
        assert!((level(pulse.fall_10_db.unwrap()) + 10.0).abs() < 0.05);
        assert!((level(pulse.fall_20_db.unwrap()) + 20.0).abs() < 0.05);
        let widths = [pulse.fall_10_db, pulse.fall_20_db].map(|f| f.unwrap() * pulse.width);
        assert!((widths[0] - 0.68).abs() < 0.01 && (widths[1] - 0.87).abs() < 0.01);
        assert_eq!(Some(pulse.usable_to), pulse.fall_20_db);
        // Noise ends the band before the spectrum has fallen by 20 dB: 10 dB over sigma sqrt(N).
        let noise = 0.3;
        let noisy = Pulse::of(&samples, noise, rate).unwrap();
        let at_zero = 2.0 / PI * length * rate;
        // From the crest to the end, and as much before it, as far as there are samples.
        let floor = noise * (samples.len() as f64).sqrt();
        let limit = 20.0 * (floor / at_zero).log10() + 10.0;
        assert!((level(noisy.usable_to) - limit).abs() < 0.2, "{noisy:?}");
    }

    /// sin^4 is above one half over 2 acos(2^(-1/4))/pi of its length, 36.4 %, and holds little beyond 3/length.
    #[test]
    fn recover_the_width_of_a_pulse_of_a_few_samples() {
        let (rate, length) = (2560.0, 2.2e-3);
        let width = 2.0 / PI * 0.5f64.powf(0.25).acos() * length;
        for step in 0..10 {
            let start = 5e-3 + f64::from(step) / 10.0 / rate;
            let samples = samples(rate, start, length, |x| x.sin().powi(4));
            let pulse = Pulse::of(&samples, 0.0, rate).unwrap();
            // 2.05 samples wide. Straight lines between the samples would be off by 1 to 12 %.
            assert_relative_eq!(pulse.width, width, max_relative = 0.01);
        }
    }

    #[test]
    fn limit_nothing_is_no_pulse() {
        assert_eq!(Pulse::of(&[], 0.0, 1.0), None);
        assert_eq!(Pulse::of(&[0.0, -1.0], 0.0, 1.0), None);
        assert_eq!(Pulse::mean(&[]), None);
        // One sample reaches to half the sample rate undiminished; sinc(x) is one half at x = 0.6034.
        let click = Pulse::of(&[0.0, 0.0, 1.0, 0.0, 0.0], 0.0, 1000.0).unwrap();
        assert_eq!((click.fall_10_db, click.fall_20_db), (None, None));
        assert_eq!(click.usable_to, 1000.0 / DISPLAY_RATIO);
        assert_relative_eq!(click.width, 1.2067e-3, max_relative = 1e-4);
        // A pulse that the samples cut has no flank there.
        let cut = Pulse::of(&[1.0, 0.5, 0.0], 0.0, 1000.0).unwrap();
        assert!(cut.width > 0.0 && cut.width < 4e-3, "{cut:?}");
    }

    #[test]
    fn prop_the_mean_holds_what_all_have() {
        let one = Pulse {
            width: 1e-3,
            fall_10_db: Some(100.0),
            fall_20_db: Some(200.0),
            usable_to: 200.0,
        };
        let other = Pulse {
            width: 3e-3,
            fall_10_db: Some(300.0),
            fall_20_db: None,
            usable_to: 400.0,
        };
        let mean = Pulse::mean(&[one, other]).unwrap();
        assert_relative_eq!(mean.width, 2e-3);
        assert_eq!((mean.fall_10_db, mean.fall_20_db), (Some(200.0), None));
        assert_eq!(mean.usable_to, 300.0);
    }
}
