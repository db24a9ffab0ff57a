//! The two searches: pulses of force, by a threshold over noise and drift, with hysteresis; and without a hammer
//! sudden rises of the responses after quiet or decay. And the force about one tap, drift taken out, pulses upwards.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{Event, Found, TapRemark, TapSettings};
use crate::recording::{Extremes, Outline, Recording, RecordingError};
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

/// Most pieces that are surveyed, evenly spread: more would say no more of noise and drift.
const MOST_SURVEYED: u64 = 1024;

/// The channel's drift, piece by piece, interpolated between their middles.
#[derive(Debug, Clone)]
struct Baseline {
    medians: Vec<f64>,
    /// Length of a piece (samples).
    frames: f64,
    /// Distance of the pieces (pieces).
    stride: f64,
}

impl Baseline {
    /// Place of a sample among the medians.
    fn position(&self, frame: u64) -> f64 {
        (frame as f64 / self.frames - 0.5) / self.stride
    }

    fn median(&self, piece: usize) -> f64 {
        let median = self.medians.get(piece).or(self.medians.last());
        median.copied().unwrap_or(0.0)
    }

    fn at(&self, frame: u64) -> f64 {
        let position = self.position(frame);
        let index = position.max(0.0) as usize;
        let share = (position - index as f64).clamp(0.0, 1.0);
        self.median(index) * (1.0 - share) + self.median(index + 1) * share
    }

    /// Lowest and highest value over some samples.
    fn extremes(&self, frames: Range<u64>) -> Extremes {
        let nodes = [frames.start, frames.end].map(|frame| self.position(frame).max(0.0) as usize);
        let inner = (nodes[0] + 1..=nodes[1]).map(|node| self.median(node));
        let ends = [self.at(frames.start), self.at(frames.end)];
        let all: Vec<f64> = ends.into_iter().chain(inner).collect();
        Extremes::of(&all)
    }
}

/// A piece of the force channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct SurveyedPiece {
    /// Its median.
    centre: f64,
    /// Median and root mean square of the distances from it.
    deviation: f64,
    root: f64,
    /// The largest of them.
    reached: f64,
}

/// Survey of the force channel.
#[derive(Debug, Clone)]
pub(super) struct Survey {
    baseline: Baseline,
    noise: f64,
    /// Reach of a usual piece: between taps, noise and hum.
    usual: f64,
    polarity: f64,
    /// Largest excursion from the baseline, in the pulses' direction.
    largest: f64,
    outline: Outline,
}

impl Survey {
    /// Returns true where the pulses point downwards.
    pub(super) fn is_inverted(&self) -> bool {
        self.polarity < 0.0
    }

    /// Most force that some samples of an outline's piece may have.
    fn most_force(&self, piece: usize) -> f64 {
        let extremes = self.outline.pieces[piece];
        let baseline = self.baseline.extremes(self.outline.samples_of(piece));
        match self.polarity > 0.0 {
            true => extremes.high - baseline.low,
            false => baseline.high - extremes.low,
        }
    }

    /// The last of these samples about which the force may reach `height`; the first of them where it reaches it nowhere.
    pub(super) fn last_reaching(&self, height: f64, frames: Range<u64>) -> u64 {
        let mut pieces = self.outline.pieces_of(frames.clone()).rev();
        let last = pieces.find(|piece| {
            let swing = self.outline.pieces[*piece];
            self.most_force(*piece) >= height || swing.high - swing.low >= height
        });
        let end = last.map(|piece| self.outline.samples_of(piece).end);
        end.unwrap_or(frames.start).min(frames.end)
    }
}

/// Surveys drift, noise and direction of the force channel. `known` holds its whole pieces that were surveyed before.
fn survey(
    recording: &Recording,
    channel: usize,
    known: &mut BTreeMap<u64, SurveyedPiece>,
) -> Result<Survey, RecordingError> {
    let frames = ((PIECE * recording.sample_rate()) as u64).max(32);
    let pieces = recording.frames().div_ceil(frames);
    let stride = pieces.div_ceil(MOST_SURVEYED).max(1);
    let (mut medians, mut deviations) = (Vec::new(), Vec::new());
    let (mut roots, mut reached) = (Vec::new(), Vec::new());
    for piece in (0..pieces).step_by(stride as usize) {
        let own = piece * frames..(piece + 1) * frames;
        let is_whole = own.end <= recording.frames();
        let surveyed = match known.get(&piece) {
            Some(surveyed) => *surveyed,
            None => surveyed(recording, channel, own)?,
        };
        if is_whole {
            known.insert(piece, surveyed);
        }
        roots.push(surveyed.root);
        deviations.push(surveyed.deviation);
        medians.push(surveyed.centre);
        reached.push(surveyed.reached);
    }
    let baseline = Baseline {
        medians,
        frames: frames as f64,
        stride: stride as f64,
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
    // Largest excursions from the baseline to either side.
    let outline = recording.outline(channel).unwrap_or_default();
    let (mut up, mut down) = (0.0_f64, 0.0_f64);
    for (piece, extremes) in outline.pieces.iter().enumerate() {
        let frames = outline.samples_of(piece);
        let centre = baseline.at(frames.start + outline.length as u64 / 2);
        (up, down) = (
            up.max(extremes.high - centre),
            down.max(centre - extremes.low),
        );
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
        outline,
    })
}

/// Surveys a piece of the force channel.
fn surveyed(
    recording: &Recording,
    channel: usize,
    frames: Range<u64>,
) -> Result<SurveyedPiece, RecordingError> {
    let mut samples = recording.read(channel, frames)?;
    let Extremes { low, high } = Extremes::of(&samples);
    let centre = median(&mut samples);
    samples.iter_mut().for_each(|x| *x = (*x - centre).abs());
    Ok(SurveyedPiece {
        centre,
        root: root_mean_square(&samples),
        deviation: median(&mut samples),
        reached: (high - centre).max(centre - low),
    })
}

/// A stretch of force above the threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Excursion {
    start: u64,
    end: u64,
    peak: f64,
}

/// Finds the pulses of force. `known` holds pieces that were surveyed before, and takes new ones.
pub(super) fn find_pulses(
    recording: &Recording,
    channel: usize,
    settings: &TapSettings,
    known: &mut BTreeMap<u64, SurveyedPiece>,
) -> Result<Found, RecordingError> {
    let survey = survey(recording, channel, known)?;
    // Hum reaches 1.4 times its rms and no more, where noise reaches five times: two and a half times
    // what a piece usually reaches is clear of either.
    let floor = (settings.over_noise * survey.noise).min(2.5 * survey.usual.max(survey.noise));
    let threshold = floor.max(settings.of_largest * survey.largest);
    let mut remarks = Vec::new();
    if survey.polarity < 0.0 {
        remarks.push(TapRemark::InvertedForce);
    }
    // Excursions above the threshold, each until the force falls below half of it. Only pieces that reach the threshold
    // are read, and those in which an excursion goes on.
    let mut excursions: Vec<Excursion> = Vec::new();
    let mut open = false;
    let pieces = match survey.largest > floor {
        true => 0..survey.outline.pieces.len(),
        false => 0..0,
    };
    for piece in pieces {
        if !open && survey.most_force(piece) <= threshold {
            continue;
        }
        let frames = survey.outline.samples_of(piece);
        let samples = recording.read(channel, frames.clone())?;
        for (frame, x) in (frames.start..).zip(samples) {
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
    let distance = settings.least_distance_in(recording);
    Ok(Found {
        events: group(&excursions, distance, settings.double_hit),
        noise: survey.noise,
        survey: Some(survey),
        unheard: None,
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
            by_hand: false,
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

/// Pieces read in one go.
const PIECES_AT_ONCE: u64 = 64;
/// Most times that so many pieces are read for the noise level, evenly spread.
const MOST_FLOORS: u64 = 512;

/// A longer stretch is looked at in parts (pieces): a bound on memory.
const LONGEST_STRETCH: u64 = 4096;

/// How far the channels swing from their means, over their noise.
struct Envelope<'a> {
    recording: &'a Recording,
    channels: &'a [usize],
    /// Samples of a piece.
    frames: u64,
    means: Vec<f64>,
    /// Noise level of each channel: the 10 % point of the pieces, or a millionth of the peak in digital silence.
    floors: Vec<f64>,
    outlines: Vec<Outline>,
}

impl<'a> Envelope<'a> {
    fn new(recording: &'a Recording, channels: &'a [usize]) -> Result<Self, RecordingError> {
        let frames = ((ENVELOPE_PIECE * recording.sample_rate()).round() as u64).max(4);
        let mut envelope = Envelope {
            recording,
            channels,
            frames,
            means: channels
                .iter()
                .map(|&channel| recording.mean(channel))
                .collect(),
            floors: vec![1.0; channels.len()],
            outlines: Vec::new(),
        };
        let mut pieces = vec![Vec::new(); channels.len()];
        let blocks = recording.frames().div_ceil(PIECES_AT_ONCE * frames);
        let stride = blocks.div_ceil(MOST_FLOORS).max(1);
        for block in (0..blocks).step_by(stride as usize) {
            let first = block * PIECES_AT_ONCE;
            let levels = envelope.levels(first..first + PIECES_AT_ONCE)?;
            pieces
                .iter_mut()
                .zip(levels)
                .for_each(|(all, more)| all.extend(more));
        }
        for ((mut sorted, &channel), (floor, mean)) in pieces
            .into_iter()
            .zip(channels)
            .zip(envelope.floors.iter_mut().zip(&envelope.means))
        {
            sorted.sort_by(f64::total_cmp);
            let outline = recording.outline(channel).unwrap_or_default();
            let most = outline
                .pieces
                .iter()
                .map(|piece| distance(*piece, *mean))
                .fold(0.0, f64::max);
            let tenth = sorted.get(sorted.len() / 10).copied().unwrap_or(0.0);
            *floor = tenth.max(1e-6 * most).max(f64::MIN_POSITIVE);
            envelope.outlines.push(outline);
        }
        Ok(envelope)
    }

    /// Largest distance of every channel from its mean, in each of these pieces (its unit).
    fn levels(&self, pieces: Range<u64>) -> Result<Vec<Vec<f64>>, RecordingError> {
        let frames = pieces.start * self.frames..pieces.end * self.frames;
        let samples = self.recording.read_channels(self.channels, frames)?;
        let levels = samples.iter().zip(&self.means).map(|(samples, mean)| {
            let pieces = samples.chunks(self.frames as usize);
            pieces
                .map(|piece| distance(Extremes::of(piece), *mean))
                .collect()
        });
        Ok(levels.collect())
    }

    /// The largest ratio to the noise level over the channels, in each of these pieces.
    fn combined(&self, pieces: Range<u64>) -> Result<Vec<f64>, RecordingError> {
        let levels = self.levels(pieces)?;
        let mut combined = vec![0.0; levels.first().map_or(0, Vec::len)];
        for (levels, floor) in levels.iter().zip(&self.floors) {
            for (most, level) in combined.iter_mut().zip(levels) {
                *most = f64::max(*most, level / floor);
            }
        }
        Ok(combined)
    }

    /// The same of a piece of the outlines.
    fn outlined(&self, piece: usize) -> f64 {
        let channels = self.outlines.iter().zip(&self.means).zip(&self.floors);
        let ratios = channels.map(|((outline, mean), floor)| {
            outline
                .pieces
                .get(piece)
                .map_or(0.0, |piece| distance(*piece, *mean) / floor)
        });
        ratios.fold(0.0, f64::max)
    }

    /// Stretches (pieces of the envelope) outside which there is no rise above `threshold`.
    ///
    /// A rise exceeds 1.2 times the level of the memory before it. The memory holds whole pieces of the outline, whose
    /// level is known.
    fn candidates(&self, threshold: f64) -> Vec<Range<u64>> {
        let Some(outline) = self.outlines.first() else {
            return Vec::new();
        };
        let levels: Vec<f64> = (0..outline.pieces.len())
            .map(|piece| self.outlined(piece))
            .collect();
        let (build_up, memory) = (BUILD_UP as u64 * self.frames, MEMORY as u64 * self.frames);
        let mut stretches: Vec<Range<u64>> = Vec::new();
        for piece in 0..levels.len() {
            let own = outline.samples_of(piece);
            // The last level of a rise lies up to so far behind its first.
            let ahead = outline.pieces_of(own.start..own.end + build_up + 2 * self.frames);
            let first = (own.end + self.frames)
                .saturating_sub(memory)
                .div_ceil(outline.length as u64);
            let end = own.start.saturating_sub(build_up + self.frames) / outline.length as u64;
            let before = largest(&levels, first as usize, end as usize);
            let most = largest(&levels, ahead.start, ahead.end);
            if most <= threshold || most <= 1.2 * before {
                continue;
            }
            // Neighbours share a piece of the envelope where its pieces do not fit the outline's.
            let last = stretches.last().map_or(0, |last| last.end);
            let start = last.max(own.start / self.frames);
            let end = own.end.div_ceil(self.frames);
            match stretches.last_mut() {
                Some(last) if last.end == start && end - last.start <= LONGEST_STRETCH => {
                    last.end = end;
                }
                _ if start < end => stretches.push(start..end),
                _ => {}
            }
        }
        stretches
    }

    /// Moves a trigger to the first sample that stands out, and reads its peak on the channel that
    /// stands out most.
    fn refined(&self, trigger: u64) -> Result<Event, RecordingError> {
        let mut event = Event {
            trigger,
            peak: 0.0,
            answered: true,
            by_hand: false,
        };
        let piece = trigger / self.frames;
        let levels = self.levels(piece..piece + 4 * BUILD_UP as u64)?;
        let peaks = levels.iter().map(|levels| largest(levels, 0, levels.len()));
        let peaks = peaks.zip(&self.floors).enumerate();
        let highest = peaks.max_by(|(_, a), (_, b)| (a.0 / a.1).total_cmp(&(b.0 / b.1)));
        if let Some((best, (peak, floor))) = highest {
            event.peak = peak;
            let first = trigger.saturating_sub(BUILD_UP as u64 * self.frames);
            let samples = self
                .recording
                .read(self.channels[best], first..trigger + self.frames)?;
            let limit = (3.0 * floor).max(0.05 * peak);
            if let Some(offset) = samples
                .iter()
                .position(|x| (x - self.means[best]).abs() > limit)
            {
                event.trigger = first + offset as u64;
            }
        }
        Ok(event)
    }
}

/// Largest distance of some values from a mean.
fn distance(values: Extremes, mean: f64) -> f64 {
    (values.high - mean).max(mean - values.low)
}

/// Finds sudden rises of the envelope over all `channels`.
pub(super) fn find_rises(
    recording: &Recording,
    channels: &[usize],
    settings: &TapSettings,
) -> Result<Found, RecordingError> {
    let envelope = Envelope::new(recording, channels)?;
    let outlined = envelope
        .outlines
        .first()
        .map_or(0, |outline| outline.pieces.len());
    let highest = (0..outlined)
        .map(|piece| envelope.outlined(piece))
        .fold(0.0, f64::max);
    // The floor is the 10 % point of the pieces' peaks; noise peaks reach some two times that.
    let threshold = (0.6 * settings.over_noise).max(settings.of_largest * highest);
    let distance = settings.least_distance_in(recording);
    let (mut triggers, mut remarks) = (Vec::new(), Vec::new());
    let first = envelope.combined(0..1)?;
    if first
        .first()
        .is_some_and(|&first| first > threshold && first > 0.3 * highest)
    {
        remarks.push(TapRemark::StartsWithinTap);
        triggers.push(0);
    }
    for stretch in envelope.candidates(threshold) {
        let start = stretch.start.saturating_sub(MEMORY as u64);
        let combined = envelope.combined(start..stretch.end + BUILD_UP as u64)?;
        let own = (stretch.start - start) as usize..(stretch.end - start) as usize;
        for (index, &level) in combined.iter().enumerate().take(own.end).skip(own.start) {
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
            let trigger = (start + index as u64) * envelope.frames;
            let last = triggers.last();
            if level > threshold && is_rise && last.is_none_or(|last| trigger - last >= distance) {
                triggers.push(trigger);
            }
        }
    }
    let mut events = Vec::with_capacity(triggers.len());
    for trigger in triggers {
        events.push(envelope.refined(trigger)?);
    }
    // At a few samples per piece two rises may begin with the same sample.
    events.dedup_by(|later, earlier| later.trigger <= earlier.trigger);
    Ok(Found {
        events,
        noise: envelope.floors.first().map_or(0.0, |first| first / 2.0),
        survey: None,
        unheard: None,
        remarks,
    })
}

/// Largest of some pieces; 0 of none.
fn largest(pieces: &[f64], from: usize, to: usize) -> f64 {
    let some = pieces.get(from..to.min(pieces.len())).unwrap_or_default();
    some.iter().copied().fold(0.0, f64::max)
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
