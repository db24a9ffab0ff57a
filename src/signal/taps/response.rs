//! Taps seen only by the responses: a sudden rise after quiet or decay.

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

/// Finds sudden rises of the envelope over all `channels`.
pub(super) fn find(
    recording: &Recording,
    channels: &[usize],
    settings: &TapSettings,
) -> Result<Found, RecordingError> {
    let frames = ((PIECE * recording.sample_rate()).round() as usize).max(4);
    let envelopes = envelopes(recording, channels, frames)?;
    let floors: Vec<f64> = envelopes.iter().map(|envelope| floor(envelope)).collect();
    let combined = combine(&envelopes, &floors);
    let largest = combined.iter().copied().fold(0.0, f64::max);
    // The floor is the 10 % point of the pieces' peaks; noise peaks reach some two times that.
    let threshold = (0.6 * settings.over_noise).max(settings.of_largest * largest);
    let mut events = Vec::new();
    let mut remarks = Vec::new();
    if combined
        .first()
        .is_some_and(|&first| first > threshold && first > 0.3 * largest)
    {
        remarks.push(TapRemark::StartsWithinTap);
        events.push(Event {
            trigger: 0,
            peak: 0.0,
        });
    }
    let distance = (settings.least_distance * recording.sample_rate()) as u64;
    for (index, _) in combined
        .iter()
        .enumerate()
        .filter(|&(i, _)| is_rise(&combined, i, threshold))
    {
        let trigger = (index * frames) as u64;
        if events
            .last()
            .is_none_or(|last| trigger - last.trigger >= distance)
        {
            events.push(Event { trigger, peak: 0.0 });
        }
    }
    refine(
        &mut events,
        &envelopes,
        &floors,
        recording,
        channels,
        frames,
    )?;
    // At a few samples per piece two rises may begin with the same sample.
    events.dedup_by(|later, earlier| later.trigger <= earlier.trigger);
    Ok(Found {
        events,
        noise: floors.first().copied().unwrap_or(0.0) / 2.0,
        survey: None,
        remarks,
    })
}

/// Largest distance from the channel's mean in each piece, per channel.
fn envelopes(
    recording: &Recording,
    channels: &[usize],
    frames: usize,
) -> Result<Vec<Vec<f64>>, RecordingError> {
    let mut envelopes = vec![Vec::new(); channels.len()];
    let means: Vec<f64> = channels.iter().map(|&c| recording.mean(c)).collect();
    for block in recording.blocks(channels, frames * 64) {
        for ((envelope, samples), mean) in envelopes.iter_mut().zip(block?.samples).zip(&means) {
            let peaks = samples
                .chunks(frames)
                .map(|piece| piece.iter().map(|x| (x - mean).abs()).fold(0.0, f64::max));
            envelope.extend(peaks);
        }
    }
    Ok(envelopes)
}

/// Noise level of an envelope: its 10 % point, or a millionth of its peak in digital silence.
fn floor(envelope: &[f64]) -> f64 {
    let mut sorted = envelope.to_vec();
    sorted.sort_by(f64::total_cmp);
    let largest = sorted.last().copied().unwrap_or(0.0);
    let tenth = sorted.get(sorted.len() / 10).copied().unwrap_or(0.0);
    tenth.max(1e-6 * largest).max(f64::MIN_POSITIVE)
}

/// The largest ratio to its own floor over the channels, piece by piece.
fn combine(envelopes: &[Vec<f64>], floors: &[f64]) -> Vec<f64> {
    let length = envelopes.iter().map(Vec::len).min().unwrap_or(0);
    (0..length)
        .map(|i| {
            envelopes
                .iter()
                .zip(floors)
                .map(|(e, floor)| e[i] / floor)
                .fold(0.0, f64::max)
        })
        .collect()
}

fn is_rise(envelope: &[f64], index: usize, threshold: f64) -> bool {
    let largest = |from: usize, to: usize| {
        envelope
            .get(from..to.min(envelope.len()))
            .map_or(0.0, |piece| piece.iter().copied().fold(0.0, f64::max))
    };
    let Some(before_end) = index.checked_sub(BUILD_UP) else {
        // Too near the start to look back: the first thing there decides.
        return envelope[index] > threshold && envelope[index] > RISE * largest(0, index.min(1));
    };
    let recent = largest(index.saturating_sub(LOOK_BACK), before_end.max(1));
    let memory = largest(index.saturating_sub(MEMORY), before_end.max(1));
    let ahead = largest(index, index + BUILD_UP);
    envelope[index] > threshold && envelope[index] > RISE * recent && ahead > 1.2 * memory
}

/// Moves each trigger to the first sample that stands out, and reads its peak on the channel that
/// stands out most.
fn refine(
    events: &mut [Event],
    envelopes: &[Vec<f64>],
    floors: &[f64],
    recording: &Recording,
    channels: &[usize],
    frames: usize,
) -> Result<(), RecordingError> {
    for event in events {
        let piece = event.trigger as usize / frames;
        let window = piece..(piece + 4 * BUILD_UP).min(envelopes.first().map_or(0, Vec::len));
        let peak_of = |channel: usize| {
            envelopes[channel][window.clone()]
                .iter()
                .copied()
                .fold(0.0, f64::max)
        };
        let Some(best) = (0..channels.len())
            .max_by(|&a, &b| (peak_of(a) / floors[a]).total_cmp(&(peak_of(b) / floors[b])))
        else {
            continue;
        };
        event.peak = peak_of(best);
        let first = (event.trigger).saturating_sub((BUILD_UP * frames) as u64);
        let samples = recording.read(channels[best], first..event.trigger + frames as u64)?;
        let mean = recording.mean(channels[best]);
        let limit = (3.0 * floors[best]).max(0.05 * event.peak);
        if let Some(offset) = samples.iter().position(|x| (x - mean).abs() > limit) {
            event.trigger = first + offset as u64;
        }
    }
    Ok(())
}
