//! The free decays after the accepted taps of one recording, as fits read them.

use num_complex::Complex64;

use super::force::{pulse_window, remove_offset};
use super::stage::{MOST_KEPT, Stage};
use tapjoint_signal::modal::amplitude::Decay;
use tapjoint_signal::modal::fit::{Column, FitError, FreeDecayCollector, ModalData, TapForce};
use tapjoint_signal::recording::RecordingError;
use tapjoint_signal::spectral::largest_smooth_block;
use tapjoint_signal::taps::Tap;

/// Without a hammer a decay begins this long after its trigger (s): hammer pulses are shorter.
const AFTER_TRIGGER: f64 = 5e-3;
/// Fewest samples of a decay that is worth a fit: some 16 lines for a mode and what surrounds it.
const LEAST_SAMPLES: u64 = 64;

/// Decays of all taps, and what of them is fitted.
pub(super) struct FreeDecays {
    /// Transforms of every tap and sensor on the lines of the band.
    pub data: ModalData,
    /// Force of each tap; empty without a hammer.
    pub forces: Vec<TapForce>,
    /// Samples of each tap.
    pub decays: Vec<Decay>,
    /// Transforms of the forces, time zero at the decays' first sample; empty without a hammer.
    force_columns: Vec<Column>,
}

impl FreeDecays {
    /// Reads the decays; `None` where they are too short for a fit.
    pub fn read(stage: &Stage<'_>) -> Result<Option<Self>, RecordingError> {
        let taps: Vec<&Tap> = stage.taps.accepted().collect();
        let left = |tap: &&Tap| (tap.record.start + stage.gate).saturating_sub(stage.begin(tap));
        let shortest = taps.iter().map(left).min().unwrap_or(0);
        let samples = match largest_smooth_block(shortest as usize) {
            Some(samples) if samples as u64 >= LEAST_SAMPLES => samples,
            _ => return Ok(None),
        };
        let most = MOST_KEPT / (samples * stage.responses()).max(1);
        let mut decays = Vec::new();
        let mut forces = Vec::new();
        for (number, tap) in taps.into_iter().take(most.max(1)).enumerate() {
            let (decay, force) = stage.decay(tap, samples)?;
            decays.push(decay);
            forces.extend(force.map(|samples| stage.tap_force(number, samples)));
        }
        Ok(transformed(stage, samples, decays, forces).ok())
    }

    /// What the polyreference fit reads, each column on the same lines: with a hammer the response of
    /// every sensor to the force, H = sum conj(F) X/sum |F|^2 over the taps; without one every tap's
    /// transforms.
    pub fn functions(&self) -> Vec<Vec<Complex64>> {
        let columns = self.data.columns();
        if self.force_columns.is_empty() {
            return columns.iter().map(|column| column.values.clone()).collect();
        }
        let sensors = columns.iter().map(|column| column.sensor + 1).max();
        let lines = self.data.frequencies().len();
        let mut power = vec![0.0; lines];
        for force in &self.force_columns {
            let values = power.iter_mut().zip(&force.values);
            values.for_each(|(sum, f)| *sum += f.norm_sqr());
        }
        let mut sums = vec![vec![Complex64::ZERO; lines]; sensors.unwrap_or(0)];
        for column in columns {
            let Some(force) = self.force_columns.get(column.tap) else {
                continue;
            };
            let pairs = force.values.iter().zip(&column.values);
            let sum = &mut sums[column.sensor];
            sum.iter_mut()
                .zip(pairs)
                .for_each(|(sum, (f, x))| *sum += f.conj() * x);
        }
        for sum in &mut sums {
            for (value, &power) in sum.iter_mut().zip(&power) {
                *value /= power.max(f64::MIN_POSITIVE);
            }
        }
        sums
    }
}

fn transformed(
    stage: &Stage<'_>,
    samples: usize,
    decays: Vec<Decay>,
    forces: Vec<TapForce>,
) -> Result<FreeDecays, FitError> {
    let rate = stage.recording.sample_rate();
    let band = [(stage.lines.low, stage.lines.high)];
    let mut responses = FreeDecayCollector::new(rate, samples, &band)?;
    for decay in &decays {
        responses.add_tap(&decay.responses)?;
    }
    let mut pulses = FreeDecayCollector::new(rate, samples, &band)?;
    for force in &forces {
        pulses.add_tap(&[wrapped(&force.samples, samples)])?;
    }
    let force_columns = if forces.is_empty() {
        Vec::new()
    } else {
        pulses.finish()?.columns().to_vec()
    };
    Ok(FreeDecays {
        data: responses.finish()?,
        forces,
        decays,
        force_columns,
    })
}

/// What came before time zero, at the end of the block: on multiples of rate/block a transform cannot
/// tell a time from one a block later.
fn wrapped(before: &[f64], block: usize) -> Vec<f64> {
    let kept = before.len().min(block);
    let mut samples = vec![0.0; block];
    samples[block - kept..].copy_from_slice(&before[before.len() - kept..]);
    samples
}

impl Stage<'_> {
    /// First frame of the decay after a tap.
    fn begin(&self, tap: &Tap) -> u64 {
        let after = (AFTER_TRIGGER * self.recording.sample_rate()).ceil();
        let trigger = (tap.time * self.recording.sample_rate()).round();
        tap.pulse_end.unwrap_or((trigger + after) as u64)
    }

    fn responses(&self) -> usize {
        self.channels.len() - usize::from(self.has_force)
    }

    /// The decay after a tap, and the force before it.
    fn decay(
        &self,
        tap: &Tap,
        samples: usize,
    ) -> Result<(Decay, Option<Vec<f64>>), RecordingError> {
        let rate = self.recording.sample_rate();
        let begin = self.begin(tap);
        let mut channels = self.read(tap.record.start..begin + samples as u64)?;
        let before = (begin - tap.record.start) as usize;
        let responses = channels.split_off(usize::from(self.has_force));
        let force = channels.pop().map(|mut force| {
            remove_offset(&mut force, rate);
            if let Some(window) = pulse_window(tap, rate) {
                window.apply(&mut force);
            }
            force.truncate(before);
            force
        });
        let decay = Decay {
            start: begin as f64 / rate - tap.time,
            sample_rate: rate,
            responses: responses
                .into_iter()
                .map(|x| x[before.min(x.len())..].to_vec())
                .collect(),
        };
        Ok((decay, force))
    }

    fn tap_force(&self, tap: usize, samples: Vec<f64>) -> TapForce {
        let sample_rate = self.recording.sample_rate();
        TapForce {
            tap,
            start: -(samples.len() as f64) / sample_rate,
            samples,
            sample_rate,
        }
    }
}
