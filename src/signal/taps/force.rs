//! The force about one tap: drift taken out, pulses upwards.

use std::ops::Range;

use super::Event;
use super::hammer::Survey;
use crate::recording::{Recording, RecordingError};

/// The hammer channel, with its drift and noise.
pub(super) struct Hammer<'a> {
    pub recording: &'a Recording,
    pub channel: usize,
    pub survey: &'a Survey,
}

impl Hammer<'_> {
    /// The force in these frames.
    pub(super) fn force(&self, frames: Range<u64>) -> Result<Force, RecordingError> {
        let first = frames.start;
        let samples = self.recording.read(self.channel, frames)?;
        let drift = |frame: usize| self.survey.baseline.at(first + frame as u64);
        let samples = samples
            .iter()
            .enumerate()
            .map(|(i, x)| self.survey.polarity * (x - drift(i)))
            .collect();
        Ok(Force {
            first,
            samples,
            noise: self.survey.noise,
            rate: self.recording.sample_rate(),
        })
    }
}

/// The force about one event.
pub(super) struct Force {
    /// Frame of the first sample.
    pub first: u64,
    /// Drift taken out, pulses upwards.
    pub samples: Vec<f64>,
    /// Standard deviation of the channel's noise, its hum included.
    pub noise: f64,
    /// Sample rate (Hz).
    pub rate: f64,
}

impl Force {
    /// Index of a frame among the samples.
    pub(super) fn index(&self, frame: u64) -> usize {
        (frame.saturating_sub(self.first) as usize).min(self.samples.len())
    }

    /// Frame after which the force stays within its noise, or 1 % of its peak, for a millisecond; the
    /// frame of the sample `own` where it does not come to rest before.
    pub(super) fn pulse_end(&self, event: &Event, own: usize) -> u64 {
        let limit = (4.0 * self.noise).max(0.01 * event.peak);
        let rest = ((1e-3 * self.rate) as usize).max(8);
        let start = self.index(event.trigger);
        let mut calm = 0;
        for (index, force) in self.samples.iter().enumerate().take(own).skip(start) {
            calm = if force.abs() < limit { calm + 1 } else { 0 };
            if calm == rest {
                return self.first + (index + 1 - rest) as u64;
            }
        }
        self.first + own as u64
    }
}

/// Width of the crest at `index` at half its height (samples), the flanks interpolated.
pub(super) fn half_width(samples: &[f64], index: usize) -> f64 {
    let half = 0.5 * samples.get(index).copied().unwrap_or(0.0);
    // Distance at which the flank that steps through `flank` crosses the half: n below, n-1 above.
    let crossing = |flank: &mut dyn Iterator<Item = f64>| {
        let mut above = 2.0 * half;
        let mut distance = 0.0;
        for x in flank {
            if x <= half {
                return distance + (above - half) / (above - x).max(f64::MIN_POSITIVE);
            }
            above = x;
            distance += 1.0;
        }
        distance
    };
    let right = samples.iter().skip(index + 1).copied();
    let left = samples.iter().take(index).rev().copied();
    crossing(&mut { right }) + crossing(&mut { left })
}
