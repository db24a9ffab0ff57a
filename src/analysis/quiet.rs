//! The quiet stretch before the first tap: the noise that it predicts, and mains hum.

use num_complex::Complex64;
use tapjoint_signal::modal::fit::SteadyLine;
use tapjoint_signal::modal::{
    GridFrequency, LineAmplitudes, MainsSettings, ModeReading, PeakLabel, near_mains,
};
use tapjoint_signal::spectral::{AveragedSpectra, Lines, Window, line_and_noise, noise_power};

/// Hum is looked for within this many half widths (zeta f) of a resonance plus this many lines: the band of its fit.
const HUM_REACH: (f64, f64) = (10.0, 12.0);
/// Most multiples of one mains frequency that are looked for near a resonance, the nearest ones. A damped one at 5 kHz has
/// more.
const MOST_HARMONICS: f64 = 40.0;
/// Most samples before the taps in which hum is looked for: some seconds. Each harmonic passes over all of them.
const MOST_QUIET: usize = 1 << 17;

/// Samples of a quiet stretch, means taken out, and the block they are compared with.
pub(super) struct PreTriggerNoise {
    /// Force, where there is a hammer.
    pub(super) force: Option<Vec<f64>>,
    /// Responses.
    pub(super) responses: Vec<Vec<f64>>,
    /// Grids that may hum in it.
    pub(super) grids: [GridFrequency; 2],
    /// Sample rate (Hz).
    pub(super) sample_rate: f64,
    /// Length of a block (samples).
    pub(super) block: usize,
    /// Length of the force window (samples), its mean over the taps.
    pub(super) force_window: f64,
}

impl PreTriggerNoise {
    /// Power that noise alone would leave in the averages, per response: of H1 where there is a
    /// hammer, else of the response's transform. `None` where the stretch is too short to tell.
    ///
    /// The response's noise is averaged down by the taps, N_x/(n F^2); the force's counts in full,
    /// |H|^2 N_f/F^2, for it biases H1 as well: where the hammer has no energy, H1 means nothing.
    pub(super) fn noise_powers(
        &self,
        averages: &AveragedSpectra,
        window: Window,
    ) -> Option<Vec<Vec<f64>>> {
        let (_, energy) = self.window_sums(window);
        let lines = &averages.lines;
        let channels = self.force.iter().chain(&self.responses);
        let channels: Vec<&[f64]> = channels.map(Vec::as_slice).collect();
        let mut noise = noise_power(&channels, self.sample_rate, lines)?;
        let of_responses = noise.split_off(usize::from(self.force.is_some()));
        let force_noise = noise.pop();
        let taps = averages.taps as f64;
        let powers = of_responses.iter().enumerate().map(|(response, noise)| {
            let power = noise.iter().enumerate().map(|(line, noise)| {
                let (Some(force), Some(h1)) = (&averages.force, &averages.h1) else {
                    return noise * energy;
                };
                let gain = h1[response].get(line).map_or(0.0, Complex64::norm_sqr);
                let of_force = force_noise.as_ref().map_or(0.0, |noise| noise[line]);
                let force_power = (force[line] * force[line]).max(f64::MIN_POSITIVE);
                (noise * energy / taps + gain * of_force * self.force_window) / force_power
            });
            power.collect()
        });
        Some(powers.collect())
    }

    /// Noise of the force channel in the transforms of its windowed pulses (N s), on
    /// each line; `None` without a hammer, or where the stretch is too short to tell.
    pub(super) fn force_noise(&self, lines: &Lines) -> Option<Vec<f64>> {
        let channel = self.force.as_deref()?;
        let mut noise = noise_power(&[channel], self.sample_rate, lines)?.pop()?;
        for value in &mut noise {
            *value = (*value * self.force_window).sqrt();
        }
        Some(noise)
    }

    /// Returns the multiple of 50 or 60 Hz (Hz) that a peak on line `index` is, judged on the response in which it is
    /// strongest.
    pub(super) fn mains_harmonic(
        &self,
        index: usize,
        averages: &AveragedSpectra,
        window: Window,
        settings: &MainsSettings,
    ) -> Option<f64> {
        let lines = &averages.lines;
        let frequency = lines.frequency(index);
        let (grid, number) = near_mains(frequency, lines.half_line(), &self.grids)?;
        let shares = averages.responses.iter();
        let shares = shares.map(|x| x[index] / x.iter().sum::<f64>()).enumerate();
        let (strongest, _) = shares.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let (sum, _) = self.window_sums(window);
        let within = 2.0 * averages.responses[strongest][index] * self.sample_rate / sum;
        let samples = self.responses.get(strongest)?;
        // Where the grid is known the hum is there, and not on the peak's line.
        let place = match grid.is_seen {
            true => grid.multiple(number),
            false => frequency,
        };
        let (before, noise) = line_and_noise(samples, self.sample_rate, place)?;
        let amplitudes = LineAmplitudes {
            before,
            within,
            noise,
        };
        let harmonic = grid.nominal * number as f64;
        amplitudes.is_steady(settings).then_some(harmonic)
    }

    /// Returns the lines of mains hum near the readings: multiples of the grids that any response shows before the first
    /// tap.
    ///
    /// Under the peak of a resonance hum makes no peak of its own, and has no label. A fit without it would be wrong.
    pub(super) fn hum_beside(
        &self,
        readings: &[ModeReading],
        lines: &Lines,
        settings: &MainsSettings,
    ) -> Vec<SteadyLine> {
        let (mut labelled, mut found) = (Vec::new(), Vec::new());
        for reading in readings {
            if let Some(PeakLabel::Mains(harmonic)) = reading.label {
                let mut grids = self.grids.iter();
                let own = grids.find_map(|grid| {
                    let number = (harmonic / grid.nominal).round();
                    let is_own = number * grid.nominal == harmonic;
                    is_own.then(|| grid.line(number as usize))
                });
                labelled.extend(own);
                continue;
            }
            let width = reading.damping_ratio.unwrap_or(0.0) * reading.frequency;
            let reach = HUM_REACH.0 * width + HUM_REACH.1 * 2.0 * lines.half_line();
            for grid in &self.grids {
                let mains = grid.frequency;
                let reach = reach.min(0.5 * MOST_HARMONICS * mains);
                let first = ((reading.frequency - reach) / mains).ceil().max(1.0) as usize;
                let last = ((reading.frequency + reach) / mains).floor().max(0.0) as usize;
                found.extend((first..=last).map(|number| grid.line(number)));
            }
        }
        // Readings near each other have lines in common.
        found.sort_by(|a: &SteadyLine, b| a.frequency.total_cmp(&b.frequency));
        found.dedup();
        found.retain(|line| {
            self.responses.iter().any(|samples| {
                let samples = &samples[samples.len().saturating_sub(MOST_QUIET)..];
                let found = line_and_noise(samples, self.sample_rate, line.frequency);
                found.is_some_and(|(line, noise)| line > settings.over_noise * noise)
            })
        });
        found.extend(labelled);
        found.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
        // Multiples of both grids lie at 300, 600 Hz and so on: one line.
        let line = 2.0 * lines.half_line();
        found.dedup_by(|a, b| a.frequency - b.frequency < line);
        found
    }

    /// Sum and sum of squares of the window over a block.
    fn window_sums(&self, window: Window) -> (f64, f64) {
        let mut weights = vec![1.0; self.block];
        window.apply(&mut weights, self.sample_rate);
        (weights.iter().sum(), weights.iter().map(|w| w * w).sum())
    }
}
