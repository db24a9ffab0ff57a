//! The samples about each tap, for pictures: an overview's pieces are longer than a tap's pulse.

use std::ops::Range;
use tapjoint_signal::recording::{Recording, RecordingError};
use tapjoint_signal::taps::{Tap, TapSource, Taps};

/// Shown before a tap's trigger (s).
const BEFORE: f64 = 2e-3;
/// Shown after it (s): the pulse, and how the response sets out.
const AFTER: f64 = 30e-3;
/// Shown after a second hit (s): its pulse.
const AFTER_SECOND: f64 = 10e-3;

/// The samples about a tap.
#[derive(Debug, Clone, PartialEq)]
pub struct CloseUp {
    /// First sample (s from the trigger).
    pub start: f64,
    /// Distance of the samples (s).
    pub step: f64,
    /// The force's samples (N), the channel's mean taken out; `None` without a hammer.
    pub force: Option<Vec<f64>>,
    /// The first response's (its unit).
    pub response: Option<Vec<f64>>,
}

/// One for each tap.
pub(super) fn close_ups(
    recording: &Recording,
    source: &TapSource,
    taps: &Taps,
) -> Result<Vec<CloseUp>, RecordingError> {
    let (force, responses) = match source {
        TapSource::Hammer { channel, responses } => (Some(*channel), responses),
        TapSource::Responses(responses) => (None, responses),
    };
    let channels = (force, responses.first().copied());
    let shown = |tap: &Tap| {
        let second = tap.second_hit.map(|second| second.delay + AFTER_SECOND);
        (tap.time, second.map_or(AFTER, |second| second.max(AFTER)))
    };
    let all = taps.taps.iter().map(shown);
    all.map(|about| close_up(recording, channels, about))
        .collect()
}

fn close_up(
    recording: &Recording,
    (force, response): (Option<usize>, Option<usize>),
    (time, after): (f64, f64),
) -> Result<CloseUp, RecordingError> {
    let rate = recording.sample_rate();
    let first = ((time - BEFORE) * rate).round().max(0.0) as u64;
    let last = ((time + after) * rate).round().max(0.0) as u64;
    let read = |channel| samples(recording, channel, first..last);
    Ok(CloseUp {
        start: first as f64 / rate - time,
        step: 1.0 / rate,
        force: force.map(read).transpose()?,
        response: response.map(read).transpose()?,
    })
}

fn samples(
    recording: &Recording,
    channel: usize,
    frames: Range<u64>,
) -> Result<Vec<f64>, RecordingError> {
    let mean = recording.mean(channel);
    let samples = recording.read(channel, frames)?;
    Ok(samples.into_iter().map(|value| value - mean).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use tapjoint_signal::recording::Channel;
    use tapjoint_signal::taps::SecondHit;

    #[test]
    fn limit_a_close_up_ends_where_the_recording_does() {
        let channel = |from: f64| Channel {
            name: None,
            unit: None,
            samples: (0..100).map(|k| from + f64::from(k)).collect(),
        };
        let channels = vec![channel(0.0), channel(500.0)];
        let recording = Recording::from_samples("taps", 1000.0, channels).expect("samples");
        let found =
            |time: f64| close_up(&recording, (Some(0), Some(1)), (time, AFTER)).expect("samples");
        let lengths = [0.001, 0.050, 0.090].map(|time| found(time).force.map(|force| force.len()));
        assert_eq!(lengths, [Some(31), Some(32), Some(12)]);
        let middle = found(0.050);
        assert!((middle.start + 0.002).abs() < 1e-12, "{}", middle.start);
        // Of both channels the same frames, each less its mean.
        assert_eq!(middle.force, middle.response);
        assert_eq!(middle.force.map(|force| force[0]), Some(48.0 - 49.5));
        // As far as a second hit, which is why a tap is rejected.
        let hit = |second_hit| Tap {
            time: 0.010,
            peak: 1.0,
            pulse_end: None,
            record: 0..100,
            second_hit,
            rejection: None,
        };
        let far = SecondHit {
            delay: 0.035,
            ratio: 0.6,
        };
        let taps = Taps {
            taps: vec![hit(None), hit(Some(far))],
            noise: 0.0,
            remarks: Vec::new(),
        };
        let all = close_ups(&recording, &TapSource::Responses(vec![0]), &taps).expect("samples");
        let lengths: Vec<_> = all
            .iter()
            .map(|one| one.response.as_ref().map(Vec::len))
            .collect();
        assert_eq!(lengths, [Some(32), Some(47)]);
    }
}
