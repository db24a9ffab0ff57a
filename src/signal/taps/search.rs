//! The two searches: pulses of force, by a threshold over noise and drift, with hysteresis; and without a hammer
//! sudden rises of the responses after quiet or decay. And the force about one tap, drift taken out, pulses upwards.

use std::ops::Range;

use super::{Event, Found, TapRemark, TapSettings};
use crate::recording::{Recording, RecordingError};
use tapjoint_numerics::stats::{median, root_mean_square};

// ---- Pulses of force.

/// Length of the pieces in which drift and noise are surveyed (s). A pulse of a few milliseconds
/// does not move the median of 0.1 s.
const PIECE: f64 = 0.1;
/// Fewest pieces that show a usual one: a recording that is shorter is cut finer for its noise,
/// so that its only pulse is not taken for what goes on all the time.
const FEWEST_PIECES: usize = 20;
/// An excursion longer than this is no hammer pulse but a moving cable or hand (s).
const LONGEST_PULSE: f64 = 0.05;

/// The channel's drift, piece by piece, interpolated between their middles.
struct Baseline {
    medians: Vec<f64>,
    frames: f64,
}

impl Baseline {
    fn at(&self, frame: u64) -> f64 {
        let position = frame as f64 / self.frames - 0.5;
        let index = position.floor().max(0.0);
        let share = (position - index).clamp(0.0, 1.0);
        let [before, after] = [index as usize, index as usize + 1].map(|piece| {
            let median = self.medians.get(piece).or(self.medians.last());
            median.copied().unwrap_or(0.0)
        });
        before * (1.0 - share) + after * share
    }
}

/// Survey of the force channel.
pub(super) struct Survey {
    baseline: Baseline,
    noise: f64,
    /// Reach of a usual piece: between taps, noise and hum.
    usual: f64,
    polarity: f64,
    /// Largest excursion from the baseline, in the pulses' direction.
    largest: f64,
}

/// Surveys drift, noise and direction of the force channel.
fn survey(recording: &Recording, channel: usize) -> Result<Survey, RecordingError> {
    let frames = ((PIECE * recording.sample_rate()) as usize).max(32);
    let (mut medians, mut deviations) = (Vec::new(), Vec::new());
    let (mut roots, mut reached) = (Vec::new(), Vec::new());
    // Largest excursions from the medians to either side.
    let (mut up, mut down) = (0.0_f64, 0.0_f64);
    for block in recording.blocks(&[channel], frames) {
        for mut samples in block?.samples {
            let low = samples.iter().copied().fold(f64::INFINITY, f64::min);
            let high = samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let centre = median(&mut samples);
            samples.iter_mut().for_each(|x| *x = (*x - centre).abs());
            roots.push(root_mean_square(&samples));
            deviations.push(median(&mut samples));
            medians.push(centre);
            reached.push((high - centre).max(centre - low));
            (up, down) = (up.max(high - centre), down.max(centre - low));
        }
    }
    let baseline = Baseline {
        medians,
        frames: frames as f64,
    };
    if reached.len() < FEWEST_PIECES {
        // From finer pieces, so that the only pulse is not taken for what goes on all the time. They are measured from
        // the baseline, so that drift counts.
        let mut samples = recording.read(channel, 0..recording.frames())?;
        for (frame, x) in samples.iter_mut().enumerate() {
            *x -= baseline.at(frame as u64);
        }
        let pieces = samples.chunks((samples.len() / FEWEST_PIECES).max(32));
        roots = pieces.clone().map(root_mean_square).collect();
        reached = pieces
            .map(|piece| piece.iter().fold(0.0, |most, x| x.abs().max(most)))
            .collect();
    }
    // 1.4826 turns a median deviation into a standard deviation of normal noise. Coarsely quantised
    // noise has a median deviation of zero: the rms of a usual piece and a third of a quantum (what
    // rounding alone leaves) hold it up.
    let noise = (1.4826 * median(&mut deviations))
        .max(median(&mut roots))
        .max(0.3 * recording.quantum(channel));
    // A filter's ringing swings to the other side by up to a quarter: only a clear excess inverts.
    let polarity = if down > 1.5 * up { -1.0 } else { 1.0 };
    Ok(Survey {
        baseline,
        noise,
        usual: median(&mut reached),
        polarity,
        largest: if polarity > 0.0 { up } else { down },
    })
}

/// A stretch of force above the threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Excursion {
    start: u64,
    end: u64,
    peak: f64,
}

/// Finds the pulses of force.
pub(super) fn find_pulses(
    recording: &Recording,
    channel: usize,
    settings: &TapSettings,
) -> Result<Found, RecordingError> {
    let survey = survey(recording, channel)?;
    // Hum reaches 1.4 times its rms and no more, where noise reaches five times: two and a half times
    // what a piece usually reaches is clear of either.
    let floor = (settings.over_noise * survey.noise).min(2.5 * survey.usual.max(survey.noise));
    let threshold = floor.max(settings.of_largest * survey.largest);
    let mut remarks = Vec::new();
    if survey.polarity < 0.0 {
        remarks.push(TapRemark::InvertedForce);
    }
    // Excursions above the threshold, each until the force falls below half of it.
    let mut excursions: Vec<Excursion> = Vec::new();
    let mut open = false;
    if survey.largest > floor {
        for block in recording.blocks(&[channel], 1 << 16) {
            let block = block?;
            for (frame, x) in (block.start..).zip(block.samples.iter().flatten()) {
                let force = survey.polarity * (x - survey.baseline.at(frame));
                if !open && force > threshold {
                    open = true;
                    excursions.push(Excursion {
                        start: frame,
                        end: frame,
                        peak: force,
                    });
                }
                if let Some(last) = excursions.last_mut().filter(|_| open) {
                    last.peak = last.peak.max(force);
                    last.end = frame;
                    open = force >= 0.5 * threshold;
                }
            }
        }
    }
    if excursions.first().is_some_and(|first| first.start == 0) {
        remarks.push(TapRemark::StartsWithinTap);
    }
    let longest = (LONGEST_PULSE * recording.sample_rate()).max(8.0) as u64;
    let all = excursions.len();
    excursions.retain(|excursion| excursion.end - excursion.start <= longest);
    if excursions.len() < all {
        remarks.push(TapRemark::LongExcursion {
            count: all - excursions.len(),
        });
    }
    let distance = (settings.least_distance * recording.sample_rate()) as u64;
    Ok(Found {
        events: group(&excursions, distance, settings.double_hit),
        noise: survey.noise,
        survey: Some(survey),
        remarks,
    })
}

/// Excursions nearer than `distance` frames to the first of them make one event. It triggers at the
/// first excursion that is a hit: one of at least `hit` times the event's peak. What comes before
/// that is the hammer being moved.
fn group(excursions: &[Excursion], distance: u64, hit: f64) -> Vec<Event> {
    let mut events = Vec::new();
    let mut rest = excursions;
    while let Some(first) = rest.first() {
        // At least the first itself, however small the distance.
        let near = rest
            .iter()
            .take_while(|excursion| excursion.start - first.start < distance);
        let (event, later) = rest.split_at(near.count().max(1));
        let peaks = event.iter().map(|excursion| excursion.peak);
        let peak = peaks.fold(0.0, f64::max);
        let trigger = event.iter().find(|excursion| excursion.peak >= hit * peak);
        events.push(Event {
            trigger: trigger.unwrap_or(first).start,
            peak,
            answered: true,
        });
        rest = later;
    }
    events
}

// ---- Rises of the responses.

/// Length of the pieces whose largest value makes the envelope (s).
const ENVELOPE_PIECE: f64 = 1e-3;
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
pub(super) fn find_rises(
    recording: &Recording,
    channels: &[usize],
    settings: &TapSettings,
) -> Result<Found, RecordingError> {
    let frames = ((ENVELOPE_PIECE * recording.sample_rate()).round() as usize).max(4);
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
    for (index, &level) in combined.iter().enumerate() {
        let is_rise = match index.checked_sub(BUILD_UP) {
            // Too near the start to look back: the first thing there decides.
            None => level > RISE * largest(&combined, 0, index.min(1)),
            Some(before_end) => {
                let end = before_end.max(1);
                let recent = largest(&combined, index.saturating_sub(LOOK_BACK), end);
                let memory = largest(&combined, index.saturating_sub(MEMORY), end);
                let ahead = largest(&combined, index, index + BUILD_UP);
                level > RISE * recent && ahead > 1.2 * memory
            }
        };
        let trigger = (index * frames) as u64;
        let last = triggers.last();
        if level > threshold && is_rise && last.is_none_or(|last| trigger - last >= distance) {
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

// ---- The force about one tap.

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
    /// Reads the force in these frames.
    pub(super) fn read(
        recording: &Recording,
        channel: usize,
        survey: &Survey,
        frames: Range<u64>,
    ) -> Result<Self, RecordingError> {
        let first = frames.start;
        let mut samples = recording.read(channel, frames)?;
        for (frame, x) in (first..).zip(&mut samples) {
            *x = survey.polarity * (*x - survey.baseline.at(frame));
        }
        Ok(Force {
            first,
            samples,
            noise: survey.noise,
            rate: recording.sample_rate(),
        })
    }

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
    let right = samples.iter().skip(index + 1);
    let left = samples.iter().take(index).rev();
    distance_to(half, right) + distance_to(half, left)
}

/// Distance at which a flank crosses half the height of its crest (samples): n below, n - 1 above.
fn distance_to<'a>(half: f64, flank: impl Iterator<Item = &'a f64>) -> f64 {
    let mut above = 2.0 * half;
    let mut distance = 0.0;
    for &x in flank {
        if x <= half {
            return distance + (above - half) / (above - x).max(f64::MIN_POSITIVE);
        }
        above = x;
        distance += 1.0;
    }
    distance
}
