//! The window of the hammer's pulse, and the noise before the first tap.

use num_complex::Complex64;
use tapjoint_numerics::stats::median;
use tapjoint_signal::modal::{
    LineAmplitudes, MainsSettings, PeakLabel, mains_harmonic, near_mains,
};
use tapjoint_signal::spectral::{
    AveragedSpectra, Lines, Window, apply_force_window, line_amplitude, noise_beside, noise_power,
};
use tapjoint_signal::taps::Tap;

/// Samples of a quiet stretch, means taken out, and the block they are compared with.
pub(super) struct PreTriggerNoise {
    /// Force, where there is a hammer.
    pub force: Option<Vec<f64>>,
    /// Responses.
    pub responses: Vec<Vec<f64>>,
    /// Sample rate (Hz).
    pub sample_rate: f64,
    /// Length of a block (samples).
    pub block: usize,
    /// Length of the force window (samples), its mean over the taps.
    pub force_window: f64,
}

impl PreTriggerNoise {
    /// Power that noise alone would leave in the averages, per response: of H1 where there is a
    /// hammer, else of the response's transform. `None` where the stretch is too short to tell.
    ///
    /// The response's noise is averaged down by the taps, N_x/(n F^2); the force's counts in full,
    /// |H|^2 N_f/F^2, for it biases H1 as well: where the hammer has no energy, H1 means nothing.
    pub fn noise_powers(
        &self,
        averages: &AveragedSpectra,
        window: Window,
    ) -> Option<Vec<Vec<f64>>> {
        let (_, energy) = self.window_sums(window);
        let lines = &averages.lines;
        let force_noise = match &self.force {
            Some(force) => Some(noise_power(force.clone(), self.sample_rate, lines)?),
            None => None,
        };
        let taps = averages.taps as f64;
        self.responses
            .iter()
            .enumerate()
            .map(|(response, samples)| {
                let noise = noise_power(samples.clone(), self.sample_rate, lines)?;
                let power = noise.iter().enumerate().map(|(line, noise)| {
                    let (Some(force), Some(h1)) = (&averages.force, &averages.h1) else {
                        return noise * energy;
                    };
                    let gain = h1[response].get(line).map_or(0.0, Complex64::norm_sqr);
                    let of_force = force_noise.as_ref().map_or(0.0, |noise| noise[line]);
                    let force_power = (force[line] * force[line]).max(f64::MIN_POSITIVE);
                    (noise * energy / taps + gain * of_force * self.force_window) / force_power
                });
                Some(power.collect())
            })
            .collect()
    }

    /// Noise of the force channel in the transforms of its windowed pulses (N s), on
    /// each line; `None` without a hammer, or where the stretch is too short to tell.
    pub fn force_noise(&self, lines: &Lines) -> Option<Vec<f64>> {
        let mut noise = noise_power(self.force.clone()?, self.sample_rate, lines)?;
        for value in &mut noise {
            *value = (*value * self.force_window).sqrt();
        }
        Some(noise)
    }

    /// The label of a peak on line `index` that is hum, judged on the response in which it is
    /// strongest.
    pub fn mains_label(
        &self,
        index: usize,
        averages: &AveragedSpectra,
        window: Window,
        settings: &MainsSettings,
    ) -> Option<PeakLabel> {
        let lines = &averages.lines;
        let frequency = lines.frequency(index);
        near_mains(frequency, lines.half_line(), settings)?;
        let shares = averages.responses.iter();
        let shares = shares.map(|x| x[index] / x.iter().sum::<f64>()).enumerate();
        let (strongest, _) = shares.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let (sum, _) = self.window_sums(window);
        let within = 2.0 * averages.responses[strongest][index] * self.sample_rate / sum;
        let samples = self.responses.get(strongest)?;
        let amplitudes = LineAmplitudes {
            before: line_amplitude(samples, self.sample_rate, frequency)?,
            within,
            noise: noise_beside(samples, self.sample_rate, frequency)?,
        };
        mains_harmonic(frequency, lines.half_line(), amplitudes, settings).map(PeakLabel::Mains)
    }

    /// Sum and sum of squares of the window over a block.
    fn window_sums(&self, window: Window) -> (f64, f64) {
        let mut weights = vec![1.0; self.block];
        window.apply(&mut weights, self.sample_rate);
        (weights.iter().sum(), weights.iter().map(|w| w * w).sum())
    }
}

/// Window about the pulse of a tap in its record (samples): zero before `start`, unity for `length`
/// from there, a taper of the pulse's own length after it.
#[derive(Clone, Copy)]
pub(super) struct PulseWindow {
    start: usize,
    length: usize,
    taper: usize,
}

/// The ringing of a filter ahead of a pulse lasts no longer than this (s), or eight samples.
const AHEAD_OF_PULSE: f64 = 2e-3;

/// The force window of a tap: from just before the trigger to the end of the pulse, and as long again
/// for what the search for its end may have missed. Noise and offset of the hammer before and after
/// would ripple through every quotient. `None` without a hammer.
pub(super) fn pulse_window(tap: &Tap, sample_rate: f64) -> Option<PulseWindow> {
    let trigger = (tap.time * sample_rate).round() as u64;
    let pulse = tap.pulse_end?.saturating_sub(trigger).max(1) as usize;
    let into = trigger.saturating_sub(tap.record.start) as usize;
    let ahead = ((AHEAD_OF_PULSE * sample_rate) as usize).max(8).min(into);
    Some(PulseWindow {
        start: into - ahead,
        length: ahead + 2 * pulse,
        taper: pulse,
    })
}

impl PulseWindow {
    pub(super) fn apply(self, force: &mut [f64]) {
        let start = self.start.min(force.len());
        force[..start].fill(0.0);
        apply_force_window(&mut force[start..], self.length, self.taper);
    }

    /// Energy of the window (samples): a half-cosine taper has 3/8 of its length.
    pub(super) fn energy(self) -> f64 {
        self.length as f64 + 0.375 * self.taper as f64
    }
}

/// Stretch of the force in which its offset is looked for (s): long beside the pulse, so that the
/// median is the level at rest, and short beside the drift of its amplifier.
const OFFSET_STRETCH: f64 = 0.2;

/// Takes out the level at which the force rests about its pulse. The mean of the recording is not
/// that level: the pulses are in it, and over the force window the difference amounts to a percent
/// of a pulse's momentum.
pub(super) fn remove_offset(force: &mut [f64], sample_rate: f64) {
    let stretch = ((OFFSET_STRETCH * sample_rate) as usize).clamp(1, force.len().max(1));
    let mut about: Vec<f64> = force.iter().copied().take(stretch).collect();
    let rest = median(&mut about);
    force.iter_mut().for_each(|x| *x -= rest);
}
