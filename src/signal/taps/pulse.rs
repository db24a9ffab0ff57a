//! The force pulse of a tap in numbers: its width, and how far its spectrum reaches.

use realfft::RealFftPlanner;
use schemars::JsonSchema;
use serde::Serialize;

use super::search::half_width;

/// Width of a force pulse and the band that it excites.
///
/// Levels are those of the Fourier transform of the pulse over its largest value at a lower frequency. A half sine of
/// width w at half height (length 1.5 w) has fallen by 10 dB at 0.68/w and by 20 dB at 0.87/w.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Pulse {
    /// Width at half of its height (s).
    #[serde(rename = "pulse_width")]
    pub width: f64,
    /// Lowest frequency at which the spectrum has fallen by 10 dB (Hz); null beyond half the sample rate.
    pub fall_10_db: Option<f64>,
    /// Lowest frequency at which it has fallen by 20 dB (Hz); null beyond half the sample rate.
    pub fall_20_db: Option<f64>,
    /// End of the band that the pulse excites well (Hz): the fall by 20 dB, or the frequency at which the spectrum comes
    /// within 10 dB of the channel's noise, whichever is lower.
    pub usable_to: f64,
}

/// Force over its noise below which the noise shows in H1 (dB). 10: noise in the force makes H1 too
/// small by the share of its power, here a tenth.
pub const FORCE_OVER_NOISE: f64 = 10.0;
/// Share of its height at which a pulse begins and ends.
const FOOT: f64 = 0.02;
/// Lines of the transform to each sample of the pulse: its main lobe then has some eight.
const PADDING: usize = 4;
/// Fewest lines of the transform.
const LEAST_LINES: usize = 2048;

impl Pulse {
    /// Reads a pulse, upwards on a baseline of zero. `noise` is the channel's standard deviation (its unit), `rate` the
    /// sample rate (Hz). `None` of samples without a positive one.
    pub(super) fn of(samples: &[f64], noise: f64, rate: f64) -> Option<Pulse> {
        let numbered = samples.iter().enumerate();
        let (crest, _) = numbered
            .max_by(|a, b| a.1.total_cmp(b.1))
            .filter(|(_, height)| **height > 0.0)?;
        // The pulse alone: what comes before and after is noise and drift of the channel.
        let width = half_width(samples, crest) / rate;
        let limit = FOOT * samples[crest];
        let before = samples[..crest].iter().rposition(|x| *x <= limit);
        let after = samples[crest..].iter().position(|x| *x <= limit);
        let start = before.map_or(0, |place| place + 1);
        let samples = &samples[start..after.map_or(samples.len(), |place| crest + place)];
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
        let (mut largest, mut before) = (0.0, 0.0);
        let (mut falls, mut sinks) = ([None, None], None);
        for (line, value) in spectrum.iter().enumerate() {
            let power = value.norm_sqr();
            let frequency = line as f64 * rate / size as f64;
            largest = f64::max(largest, power);
            // 10 and 20 dB are a tenth and a hundredth of the power.
            for (fall, share) in falls.iter_mut().zip([0.1, 0.01]) {
                let level = share * largest;
                if fall.is_none() && power < level {
                    // Between the line before, which was above the level, and this one.
                    let beyond = (level / power).ln() / f64::ln(before / power);
                    *fall = Some(frequency - beyond * rate / size as f64);
                }
            }
            before = power;
            if sinks.is_none() && power < sunk {
                sinks = Some(frequency);
            }
        }
        let ends = [falls[1], sinks].into_iter().flatten();
        Some(Pulse {
            width,
            fall_10_db: falls[0],
            fall_20_db: falls[1],
            usable_to: ends.fold(0.5 * rate, f64::min),
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

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use std::f64::consts::PI;

    /// |F(f)| of a half sine of length L is cos(pi f L)/(1 - (2 f L)^2) over its value at 0.
    #[test]
    fn val_a_half_sine_falls_as_its_transform() {
        let (rate, length) = (200_000.0, 1.5e-3);
        let samples: Vec<f64> = (0..400)
            .map(|n| n as f64 / rate)
            .map(|t| {
                if t < length {
                    (PI * t / length).sin()
                } else {
                    0.0
                }
            })
            .collect();
        let pulse = Pulse::of(&samples, 0.0, rate).unwrap();
        // A sine is above one half over two thirds of its arch. The samples are 5 us apart.
        assert_relative_eq!(pulse.width, length / 1.5, max_relative = 1e-3);
        let level = |f: f64| {
            let x = f * length;
            20.0 * ((PI * x).cos() / (1.0 - 4.0 * x * x)).abs().log10()
        };
        // Lines lie 49 Hz apart. Between them the level bends by less than 0.2 dB.
        assert!((level(pulse.fall_10_db.unwrap()) + 10.0).abs() < 0.2);
        assert!((level(pulse.fall_20_db.unwrap()) + 20.0).abs() < 0.2);
        let widths = [pulse.fall_10_db, pulse.fall_20_db].map(|f| f.unwrap() * pulse.width);
        assert!((widths[0] - 0.68).abs() < 0.01 && (widths[1] - 0.87).abs() < 0.01);
        assert_eq!(Some(pulse.usable_to), pulse.fall_20_db);
        // Noise ends the band before the spectrum has fallen by 20 dB.
        let noisy = Pulse::of(&samples, 3.0, rate).unwrap();
        assert!(noisy.usable_to < pulse.usable_to, "{noisy:?}");
    }

    #[test]
    fn limit_nothing_is_no_pulse() {
        assert_eq!(Pulse::of(&[], 0.0, 1.0), None);
        assert_eq!(Pulse::of(&[0.0, -1.0], 0.0, 1.0), None);
        assert_eq!(Pulse::mean(&[]), None);
        // One sample reaches to half the sample rate undiminished.
        let click = Pulse::of(&[0.0, 1.0, 0.0], 0.0, 1000.0).unwrap();
        assert_eq!((click.fall_10_db, click.usable_to), (None, 500.0));
    }
}
