//! Taps that only the responses show: a sudden rise after quiet or decay.

use super::{Event, Found, TapRemark, TapSettings};
use crate::recording::{Recording, RecordingError};

/// Length of the pieces whose largest value makes the envelope (s).
const PIECE: f64 = 1e-3;
/// The rise is judged against the envelope before this many pieces: a microphone's response takes
/// some milliseconds to build up.
const BUILD_UP: usize = 6;
/// ... and back to this many pieces.
const LOOK_BACK: usize = 30;
/// A tap raises the envelope over the last `LOOK_BACK` pieces by this factor at least.
const RISE: f64 = 3.0;
/// While a structure rings, beats between modes rise and fall; only what exceeds the level of the
/// last `MEMORY` pieces is a new tap.
const MEMORY: usize = 200;

/// Largest distance of a channel from its mean, piece by piece.
struct Envelope {
    channel: usize,
    mean: f64,
    pieces: Vec<f64>,
    /// Noise level: the 10 % point of the pieces, or a millionth of the peak in digital silence.
    floor: f64,
}

/// Finds sudden rises of the envelope over all `channels`.
pub(super) fn find(
    recording: &Recording,
    channels: &[usize],
    settings: &TapSettings,
) -> Result<Found, RecordingError> {
    let frames = ((PIECE * recording.sample_rate()).round() as usize).max(4);
    let envelopes = envelopes(recording, channels, frames)?;
    // The largest ratio to its own floor over the channels, piece by piece.
    let pieces = envelopes.iter().map(|envelope| envelope.pieces.len()).min();
    let mut combined = vec![0.0; pieces.unwrap_or(0)];
    for envelope in &envelopes {
        for (most, piece) in combined.iter_mut().zip(&envelope.pieces) {
            *most = f64::max(*most, piece / envelope.floor);
        }
    }
    let highest = largest(&combined, 0, combined.len());
    // The floor is the 10 % point of the pieces' peaks; noise peaks reach some two times that.
    let threshold = (0.6 * settings.over_noise).max(settings.of_largest * highest);
    let distance = (settings.least_distance * recording.sample_rate()) as u64;
    let (mut triggers, mut remarks) = (Vec::new(), Vec::new());
    if combined
        .first()
        .is_some_and(|&first| first > threshold && first > 0.3 * highest)
    {
        remarks.push(TapRemark::StartsWithinTap);
        triggers.push(0);
    }
    for index in 0..combined.len() {
        let trigger = (index * frames) as u64;
        if is_rise(&combined, index, threshold)
            && triggers
                .last()
                .is_none_or(|last| trigger - last >= distance)
        {
            triggers.push(trigger);
        }
    }
    let mut events = Vec::with_capacity(triggers.len());
    for trigger in triggers {
        events.push(refined(recording, &envelopes, frames, trigger)?);
    }
    // At a few samples per piece two rises may begin with the same sample.
    events.dedup_by(|later, earlier| later.trigger <= earlier.trigger);
    Ok(Found {
        events,
        noise: envelopes.first().map_or(0.0, |first| first.floor) / 2.0,
        survey: None,
        remarks,
    })
}

/// Reads the envelopes of all `channels` in pieces of `frames` samples.
fn envelopes(
    recording: &Recording,
    channels: &[usize],
    frames: usize,
) -> Result<Vec<Envelope>, RecordingError> {
    let mut envelopes = Vec::with_capacity(channels.len());
    for &channel in channels {
        envelopes.push(Envelope {
            channel,
            mean: recording.mean(channel),
            pieces: Vec::new(),
            floor: 0.0,
        });
    }
    for block in recording.blocks(channels, frames * 64) {
        for (envelope, samples) in envelopes.iter_mut().zip(block?.samples) {
            for piece in samples.chunks(frames) {
                let distances = piece.iter().map(|x| (x - envelope.mean).abs());
                envelope.pieces.push(distances.fold(0.0, f64::max));
            }
        }
    }
    for envelope in &mut envelopes {
        let mut sorted = envelope.pieces.clone();
        sorted.sort_by(f64::total_cmp);
        let most = sorted.last().copied().unwrap_or(0.0);
        let tenth = sorted.get(sorted.len() / 10).copied().unwrap_or(0.0);
        envelope.floor = tenth.max(1e-6 * most).max(f64::MIN_POSITIVE);
    }
    Ok(envelopes)
}

/// Largest of some pieces; 0 of none.
fn largest(pieces: &[f64], from: usize, to: usize) -> f64 {
    let some = pieces.get(from..to.min(pieces.len())).unwrap_or_default();
    some.iter().copied().fold(0.0, f64::max)
}

fn is_rise(envelope: &[f64], index: usize, threshold: f64) -> bool {
    let Some(before_end) = index.checked_sub(BUILD_UP) else {
        // Too near the start to look back: the first thing there decides.
        let first = largest(envelope, 0, index.min(1));
        return envelope[index] > threshold && envelope[index] > RISE * first;
    };
    let recent = largest(envelope, index.saturating_sub(LOOK_BACK), before_end.max(1));
    let memory = largest(envelope, index.saturating_sub(MEMORY), before_end.max(1));
    let ahead = largest(envelope, index, index + BUILD_UP);
    envelope[index] > threshold && envelope[index] > RISE * recent && ahead > 1.2 * memory
}

/// Moves a trigger to the first sample that stands out, and reads its peak on the channel that
/// stands out most.
fn refined(
    recording: &Recording,
    envelopes: &[Envelope],
    frames: usize,
    trigger: u64,
) -> Result<Event, RecordingError> {
    let mut event = Event {
        trigger,
        peak: 0.0,
        answered: true,
    };
    let piece = trigger as usize / frames;
    let peaks = envelopes.iter().map(|envelope| {
        let peak = largest(&envelope.pieces, piece, piece + 4 * BUILD_UP);
        (envelope, peak)
    });
    let highest = peaks.max_by(|a, b| (a.1 / a.0.floor).total_cmp(&(b.1 / b.0.floor)));
    if let Some((best, peak)) = highest {
        event.peak = peak;
        let first = trigger.saturating_sub((BUILD_UP * frames) as u64);
        let samples = recording.read(best.channel, first..trigger + frames as u64)?;
        let limit = (3.0 * best.floor).max(0.05 * peak);
        if let Some(offset) = samples.iter().position(|x| (x - best.mean).abs() > limit) {
            event.trigger = first + offset as u64;
        }
    }
    Ok(event)
}
