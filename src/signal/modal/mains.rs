//! Mains hum: multiples of the grid's frequency, steady and there before the tap, as a line over the noise.
//!
//! Large grids keep to 50 or 60 Hz within 0.2 Hz, and n times that at the n-th multiple. The samples before a tap tell
//! where the grid was: from each multiple that stands over the noise the next ones are known better.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::ModeReading;
use super::fit::{ModeFit, SteadyLine};
use crate::spectral::{line_amplitudes, line_and_noise};

/// Frequencies of the grids of the world (Hz).
pub const GRIDS: [f64; 2] = [50.0, 60.0];

/// Settings of the recognition of mains lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MainsSettings {
    /// Largest distance from a multiple, relative, where the samples before the tap show no grid: 0.2 %.
    pub tolerance: f64,
    /// Largest distance of a grid from 50 or 60 Hz (Hz): 0.2. The grids of Europe have kept to it for decades.
    pub deviation: f64,
    /// Least share of the line's amplitude in the record that was there before the tap: 0.5. A
    /// resonance that happens to lie at 50 Hz is still before the tap.
    pub share_before: f64,
    /// Least height of the line over the noise beside it before the tap, in amplitude: 4. Noise alone is as
    /// high in one line of some ten thousand: the noise is that of twelve lines, and itself uncertain.
    /// Multiples of 50 and 60 Hz are so close at high orders that every other peak lies near one, and a peak
    /// of mere noise was there before the tap as well.
    pub over_noise: f64,
}

impl Default for MainsSettings {
    fn default() -> Self {
        MainsSettings {
            tolerance: 0.002,
            deviation: 0.2,
            share_before: 0.5,
            over_noise: 4.0,
        }
    }
}

/// Multiples up to this one are looked for over the whole range of the grid; higher ones only beside a known place.
/// Rectifiers hum at every second one, motors at the third.
const SOUGHT: usize = 7;
/// Highest multiple that improves the grid's frequency, or is hum without a quiet stretch.
const HIGHEST: usize = 20;
/// Most samples that are searched: some seconds. Each multiple passes over all of them.
const MOST_SAMPLES: usize = 1 << 16;
/// Distance of the places of a search, over the resolution 1/T.
const STEP: f64 = 0.25;
/// Change of a grid's frequency within some minutes (Hz). 0.02: what the control of a large grid lets pass.
const WANDER: f64 = 0.02;

/// The frequency of a grid while a recording was made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridFrequency {
    /// 50 or 60 (Hz).
    pub nominal: f64,
    /// Best frequency (Hz).
    pub frequency: f64,
    /// How far from it the grid may be (Hz).
    pub bound: f64,
    /// True where the samples before a tap show a line of it.
    pub is_seen: bool,
}

impl GridFrequency {
    /// Returns a grid of which nothing was seen.
    pub fn unseen(nominal: f64, settings: &MainsSettings) -> Self {
        GridFrequency {
            nominal,
            frequency: nominal,
            bound: settings.tolerance * nominal,
            is_seen: false,
        }
    }

    /// Reads the grid's frequency from samples of all responses in which nothing but noise and hum is.
    pub fn read(
        nominal: f64,
        responses: &[Vec<f64>],
        sample_rate: f64,
        settings: &MainsSettings,
    ) -> Self {
        let responses: Vec<Vec<f64>> = responses.iter().map(|one| windowed(one)).collect();
        let samples = responses.iter().map(Vec::len).max().unwrap_or(0);
        let duration = samples as f64 / sample_rate;
        let mut known: Option<(f64, f64)> = None;
        for number in 1..=HIGHEST {
            let times = number as f64;
            if times * (nominal + settings.deviation) > 0.4 * sample_rate {
                break;
            }
            let (centre, reach) = match known {
                Some((frequency, variance)) => (frequency, 4.0 * variance.sqrt()),
                None if number <= SOUGHT && !is_of_both(times * nominal) => {
                    (nominal, settings.deviation)
                }
                None if number <= SOUGHT => continue,
                None => break,
            };
            let Some(line) = strongest(&responses, sample_rate, times * centre, times * reach)
            else {
                continue;
            };
            let (own, height) = line;
            let off = (own / times - nominal).abs();
            if height < settings.over_noise || off > settings.deviation {
                continue;
            }
            // Least standard deviation of a line's frequency under a Hann window, and what other lines leak.
            let std = (0.7 / height).hypot(0.002) / (duration * times);
            let (own, variance) = (own / times, std * std);
            known = Some(match known {
                None => (own, variance),
                Some((frequency, before)) => {
                    let share = before / (before + variance);
                    let mean = frequency + share * (own - frequency);
                    (mean, before * variance / (before + variance))
                }
            });
        }
        match known {
            None => Self::unseen(nominal, settings),
            Some((frequency, variance)) => GridFrequency {
                nominal,
                frequency,
                bound: WANDER.hypot(4.0 * variance.sqrt()),
                is_seen: true,
            },
        }
    }

    /// Returns the number of the multiple near which a `frequency` lies that is known to `half_line` (both in Hz).
    pub fn number_near(&self, frequency: f64, half_line: f64) -> Option<usize> {
        let number = (frequency / self.frequency).round();
        let near = (frequency - number * self.frequency).abs() <= half_line + number * self.bound;
        (number >= 1.0 && near).then_some(number as usize)
    }

    /// Returns a multiple as a steady line.
    pub fn line(&self, number: usize) -> SteadyLine {
        SteadyLine {
            frequency: self.multiple(number),
            bound: number as f64 * self.bound,
        }
    }

    /// Returns the frequency (Hz) of a multiple.
    pub fn multiple(&self, number: usize) -> f64 {
        number as f64 * self.frequency
    }
}

/// Returns true for a frequency (Hz) that is a multiple of both grids: it does not tell which of them hums.
fn is_of_both(frequency: f64) -> bool {
    GRIDS.iter().all(|grid| frequency % grid == 0.0)
}

/// The last samples under a Hann window whose mean is 1.
fn windowed(samples: &[f64]) -> Vec<f64> {
    let samples = &samples[samples.len().saturating_sub(MOST_SAMPLES)..];
    let step = 2.0 * PI / samples.len().max(1) as f64;
    let weighted = samples.iter().enumerate();
    weighted
        .map(|(index, x)| x * (1.0 - (step * (index as f64 + 0.5)).cos()))
        .collect()
}

/// Returns the strongest line within `reach` of a frequency (all in Hz) with its height over the noise beside it, of the
/// response on which it stands out most; `None` where the samples hold fewer than three periods.
fn strongest(
    responses: &[Vec<f64>],
    sample_rate: f64,
    centre: f64,
    reach: f64,
) -> Option<(f64, f64)> {
    let mut best: Option<(f64, f64)> = None;
    for samples in responses {
        let step = STEP * sample_rate / samples.len().max(1) as f64;
        // One place more on either side, so that a line at the end of the reach has neighbours.
        let places = (reach / step).ceil() as i32 + 1;
        let levels = (-places..=places).map(|place| centre + f64::from(place) * step);
        let levels = line_amplitudes(samples, sample_rate, &levels.collect::<Vec<_>>());
        let levels: Vec<f64> = levels.into_iter().collect::<Option<_>>()?;
        // A line outside of the reach rises towards an end.
        let inner = 1..levels.len() - 1;
        let highest = inner.max_by(|a, b| levels[*a].total_cmp(&levels[*b]))?;
        if levels[highest - 1].max(levels[highest + 1]) > levels[highest] {
            continue;
        }
        let place = centre + (highest as f64 - f64::from(places)) * step;
        // The main lobe of the window is a parabola in logarithms.
        let [left, middle, right] =
            [highest - 1, highest, highest + 1].map(|index| levels[index].max(1e-300).ln());
        let bend = left - 2.0 * middle + right;
        let shift = if bend < 0.0 {
            0.5 * (left - right) / bend
        } else {
            0.0
        };
        let frequency = place + shift.clamp(-1.0, 1.0) * step;
        let (_, noise) = line_and_noise(samples, sample_rate, frequency)?;
        let height = levels[highest] / noise.max(f64::MIN_POSITIVE);
        if best.is_none_or(|(_, most)| height > most) {
            best = Some((frequency, height));
        }
    }
    best
}

/// Amplitudes of a steady line at one frequency (same unit).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineAmplitudes {
    /// Before the tap.
    pub before: f64,
    /// In the tap record, as if steady.
    pub within: f64,
    /// Amplitude of noise alone before the tap, root mean square over the frequencies beside the line.
    pub noise: f64,
}

impl LineAmplitudes {
    /// Returns true for a line over the noise that was there before the tap.
    pub fn is_steady(&self, settings: &MainsSettings) -> bool {
        let steady = self.before >= settings.share_before * self.within;
        steady && self.before > settings.over_noise * self.noise
    }
}

/// Returns the grid and the number of the multiple near which `frequency` lies, hum or not. `half_line` is the bound of
/// the reading (both in Hz).
pub fn near_mains(
    frequency: f64,
    half_line: f64,
    grids: &[GridFrequency],
) -> Option<(GridFrequency, usize)> {
    let mut near = grids.iter().filter_map(|grid| {
        let number = grid.number_near(frequency, half_line)?;
        Some((*grid, number))
    });
    // A grid that was seen is the one that hums.
    let first = near.next()?;
    let second = near.find(|(grid, _)| grid.is_seen && !first.0.is_seen);
    Some(second.unwrap_or(first))
}

/// Decay over the record, sigma T, below which a line is steady: it falls by 14 %.
const STEADY_DECAY: f64 = 0.15;
/// Damping ratio that no structure falls short of: a hundredth of a percent, that of a tuning fork.
const LEAST_DAMPING: f64 = 1e-4;
/// Least number of taps whose phases tell hum from a mode.
const LEAST_TAPS: usize = 3;
/// Least length of the mean of a mode's phases, as unit vectors: taps of a hammer begin a mode alike, within 0.3 rad.
const ALIKE: f64 = 0.95;
/// Largest spread of the amplitudes of hum over the taps, from the least to the largest over the mean. A mode that still
/// rings from the tap before begins with any phase, and with any amplitude.
const LARGEST_SPREAD: f64 = 0.2;

/// Labels readings near a multiple of a grid that neither decay nor begin with the taps.
///
/// Without a quiet stretch nothing shows hum before the tap. Three taps or more tell by the phase: hum goes on as the
/// grid has it, and a mode begins with each tap anew. Of fewer taps, or without a fit, the damping must be below that of
/// every structure. `duration` is the length of the record (s).
pub fn label_steady_lines(
    readings: &mut [ModeReading],
    grids: &[GridFrequency],
    duration: f64,
    settings: &MainsSettings,
) {
    let whole: Vec<GridFrequency> = grids
        .iter()
        .map(|grid| match grid.is_seen {
            true => *grid,
            false => GridFrequency {
                bound: settings.deviation,
                ..*grid
            },
        })
        .collect();
    for reading in readings.iter_mut().filter(|one| one.label.is_none()) {
        let Some(ratio) = reading.damping_ratio else {
            continue;
        };
        let frequency = reading.frequency;
        let Some((grid, number)) = near_mains(frequency, reading.std.unwrap_or(0.0), &whole) else {
            continue;
        };
        // Far up the multiples of a grid whose frequency is not known are everywhere.
        if number > HIGHEST || 2.0 * PI * frequency * ratio * duration > STEADY_DECAY {
            continue;
        }
        let fit = reading.fit.as_deref();
        let is_hum = match fit.and_then(|fit| goes_on(&fit.mode)) {
            Some(goes_on) => goes_on,
            None => ratio + 2.0 * reading.damping_std.unwrap_or(0.0) < LEAST_DAMPING,
        };
        if is_hum {
            reading.make_mains(grid.nominal * number as f64);
        }
    }
}

/// Returns true for a line that has one amplitude after all taps and any phase, on its strongest sensor; `None` below
/// [`LEAST_TAPS`] taps.
fn goes_on(mode: &ModeFit) -> Option<bool> {
    let strongest = mode.amplitudes.iter();
    let strongest = strongest.max_by(|a, b| a.value.norm().total_cmp(&b.value.norm()))?;
    let own = mode.amplitudes.iter();
    let own = own.filter(|one| one.sensor == strongest.sensor && one.value.norm() > 0.0);
    let values: Vec<Complex64> = own.map(|one| one.value).collect();
    let (taps, mut sum, mut phases) = (values.len() as f64, 0.0, Complex64::ZERO);
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for value in &values {
        let size = value.norm();
        (least, most) = (least.min(size), most.max(size));
        sum += size;
        phases += value / size;
    }
    let has_one_size = (most - least) * taps < LARGEST_SPREAD * sum;
    (values.len() >= LEAST_TAPS).then_some(has_one_size && phases.norm() < ALIKE * taps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use std::slice::from_ref;

    /// Hum of these multiples (number, amplitude) of a frequency (Hz) in noise of 1e-3.
    fn hum(frequency: f64, lines: &[(f64, f64)], seconds: f64, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut samples = Vec::new();
        for index in 0..(2560.0 * seconds) as usize {
            let phase = 2.0 * PI * frequency * index as f64 / 2560.0;
            let sum = lines
                .iter()
                .map(|(n, size)| size * (n * phase + n + seed as f64).sin());
            let error: f64 = StandardNormal.sample(&mut random);
            samples.push(sum.sum::<f64>() + 1e-3 * error);
        }
        samples
    }

    #[test]
    fn recover_the_grid_from_half_a_second_before_the_tap() {
        let settings = MainsSettings::default();
        let all: &[(f64, f64)] = &[(1.0, 0.05), (3.0, 0.02), (5.0, 0.01), (11.0, 0.01)];
        let rectifier: &[(f64, f64)] = &[(2.0, 0.02), (4.0, 0.01)];
        let weak: &[(f64, f64)] = &[(1.0, 0.002)];
        for (nominal, truth) in [(50.0, 49.94), (50.0, 50.17), (50.0, 49.81), (60.0, 59.95)] {
            for (lines, seconds, allowed) in [
                (all, 0.5, 0.002),
                (rectifier, 0.5, 0.005),
                (weak, 2.0, 0.01),
                (all, 3.0, 2e-4),
            ] {
                for seed in 1..6 {
                    let samples = vec![hum(truth, lines, seconds, seed)];
                    let found = GridFrequency::read(nominal, &samples, 2560.0, &settings);
                    assert!(found.is_seen);
                    let off = (found.frequency - truth).abs();
                    assert!(off < allowed, "{truth}, {seconds} s, {seed}: {found:?}");
                }
            }
        }
    }

    #[test]
    fn limit_noise_and_other_lines_are_no_grid() {
        let settings = MainsSettings::default();
        for seed in 1..40 {
            let other: &[(f64, f64)] = &[(1.0, 0.02), (2.0, 0.02)];
            for samples in [hum(50.0, &[], 1.0, seed), hum(42.0, other, 1.0, seed)] {
                for nominal in GRIDS {
                    let found = GridFrequency::read(nominal, from_ref(&samples), 2560.0, &settings);
                    assert_eq!(found, GridFrequency::unseen(nominal, &settings), "{seed}");
                }
            }
        }
        // 300 Hz is a multiple of both.
        let fifty: &[(f64, f64)] = &[(1.0, 0.02), (6.0, 0.02)];
        let found = GridFrequency::read(60.0, &[hum(49.95, fifty, 1.0, 1)], 2560.0, &settings);
        assert!(!found.is_seen, "{found:?}");
        // Two periods of hum tell nothing, and neither do no samples.
        let short = hum(50.0, &[(1.0, 1.0)], 0.04, 1);
        for samples in [short, Vec::new()] {
            let found = GridFrequency::read(50.0, from_ref(&samples), 2560.0, &settings);
            assert!(!found.is_seen);
        }
    }
}
