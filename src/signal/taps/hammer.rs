//! Pulses of force: a threshold over noise and drift, with hysteresis; and the force about one tap, drift taken out
//! and pulses upwards.

use std::ops::Range;

use super::{Event, Found, TapRemark, TapSettings};
use crate::recording::{Recording, RecordingError};
use tapjoint_numerics::stats::{median, root_mean_square};

/// Length of the pieces in which drift and noise are surveyed (s). A pulse of a few milliseconds
/// does not move the median of 0.1 s.
const PIECE: f64 = 0.1;
/// Fewest pieces that show a usual one: a recording that is shorter is cut finer for its noise,
/// so that its only pulse is not taken for what goes on all the time.
const FEWEST_PIECES: usize = 20;
/// An excursion longer than this is no hammer pulse but a moving cable or hand (s).
const LONGEST_PULSE: f64 = 0.05;

/// Median, noise and extremes of one piece of the channel.
struct Piece {
    median: f64,
    deviation: f64,
    rms: f64,
    low: f64,
    high: f64,
}

/// The channel's drift, piece by piece, interpolated between their middles.
pub(super) struct Baseline {
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
    pub baseline: Baseline,
    pub noise: f64,
    /// Reach of a usual piece: between taps, noise and hum.
    pub usual: f64,
    pub polarity: f64,
    /// Largest excursion from the baseline, in the pulses' direction.
    pub largest: f64,
}

/// Surveys drift, noise and direction of the force channel.
pub(super) fn survey(recording: &Recording, channel: usize) -> Result<Survey, RecordingError> {
    let frames = ((PIECE * recording.sample_rate()) as usize).max(32);
    let mut pieces = Vec::new();
    for block in recording.blocks(&[channel], frames) {
        if let Some(samples) = block?.samples.into_iter().next() {
            pieces.extend(piece(samples));
        }
    }
    let mut deviations: Vec<f64> = pieces.iter().map(|piece| piece.deviation).collect();
    let mut roots: Vec<f64> = pieces.iter().map(|piece| piece.rms).collect();
    let mut reached: Vec<f64> = pieces
        .iter()
        .map(|p| (p.high - p.median).max(p.median - p.low))
        .collect();
    let baseline = Baseline {
        medians: pieces.iter().map(|piece| piece.median).collect(),
        frames: frames as f64,
    };
    let (usual, usual_rms) = if pieces.len() < FEWEST_PIECES {
        usual_of_short(recording, channel, &baseline)?
    } else {
        (median(&mut reached), median(&mut roots))
    };
    // 1.4826 turns a median deviation into a standard deviation of normal noise. Coarsely quantised
    // noise has a median deviation of zero: the rms of a usual piece and a third of a quantum (what
    // rounding alone leaves) hold it up.
    let noise = (1.4826 * median(&mut deviations))
        .max(usual_rms)
        .max(0.3 * recording.quantum(channel));
    let up = pieces.iter().map(|p| p.high - p.median).fold(0.0, f64::max);
    let down = pieces.iter().map(|p| p.median - p.low).fold(0.0, f64::max);
    // A filter's ringing swings to the other side by up to a quarter: only a clear excess inverts.
    let polarity = if down > 1.5 * up { -1.0 } else { 1.0 };
    Ok(Survey {
        baseline,
        noise,
        usual,
        polarity,
        largest: if polarity > 0.0 { up } else { down },
    })
}

/// Returns the reach and the rms of a usual piece for a recording of fewer than [`FEWEST_PIECES`] pieces: from finer
/// pieces, so that its only pulse is not taken for what goes on all the time. They are measured from the baseline, so
/// that drift counts.
fn usual_of_short(
    recording: &Recording,
    channel: usize,
    baseline: &Baseline,
) -> Result<(f64, f64), RecordingError> {
    let mut samples = recording.read(channel, 0..recording.frames())?;
    for (frame, x) in samples.iter_mut().enumerate() {
        *x -= baseline.at(frame as u64);
    }
    let length = (samples.len() / FEWEST_PIECES).max(32);
    let mut reached: Vec<f64> = samples
        .chunks(length)
        .map(|piece| piece.iter().fold(0.0, |most, x| x.abs().max(most)))
        .collect();
    let mut roots: Vec<f64> = samples.chunks(length).map(root_mean_square).collect();
    Ok((median(&mut reached), median(&mut roots)))
}

fn piece(mut samples: Vec<f64>) -> Option<Piece> {
    let low = samples.iter().copied().fold(f64::INFINITY, f64::min);
    let high = samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if samples.is_empty() {
        return None;
    }
    let centre = median(&mut samples);
    for x in &mut samples {
        *x = (*x - centre).abs();
    }
    let rms = root_mean_square(&samples);
    Some(Piece {
        median: centre,
        deviation: median(&mut samples),
        rms,
        low,
        high,
    })
}

/// Finds the pulses of force.
pub(super) fn find(
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
    let mut excursions = Vec::new();
    if survey.largest > floor {
        excursions = find_excursions(recording, channel, &survey, threshold)?;
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

/// A stretch of force above the threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Excursion {
    pub start: u64,
    pub end: u64,
    pub peak: f64,
}

/// Excursions above the threshold, each until the force falls below half of it.
fn find_excursions(
    recording: &Recording,
    channel: usize,
    survey: &Survey,
    threshold: f64,
) -> Result<Vec<Excursion>, RecordingError> {
    let mut found: Vec<Excursion> = Vec::new();
    let mut open = false;
    for block in recording.blocks(&[channel], 1 << 16) {
        let block = block?;
        for (index, x) in block.samples.iter().flatten().enumerate() {
            let frame = block.start + index as u64;
            let force = survey.polarity * (x - survey.baseline.at(frame));
            if !open && force > threshold {
                open = true;
                found.push(Excursion {
                    start: frame,
                    end: frame,
                    peak: force,
                });
            }
            if let Some(last) = found.last_mut().filter(|_| open) {
                last.peak = last.peak.max(force);
                last.end = frame;
                open = force >= 0.5 * threshold;
            }
        }
    }
    Ok(found)
}

/// Excursions nearer than `distance` frames to the first of them make one event. It triggers at the
/// first excursion that is a hit: one of at least `hit` times the event's peak. What comes before
/// that is the hammer being moved.
pub(super) fn group(excursions: &[Excursion], distance: u64, hit: f64) -> Vec<Event> {
    let mut events = Vec::new();
    let mut rest = excursions;
    while let Some(first) = rest.first() {
        // At least the first itself, however small the distance.
        let near = rest
            .iter()
            .take_while(|excursion| excursion.start - first.start < distance);
        let (event, later) = rest.split_at(near.count().max(1));
        let peak = event
            .iter()
            .map(|excursion| excursion.peak)
            .fold(0.0, f64::max);
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
