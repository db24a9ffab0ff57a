//! Quality of a channel's samples, gathered in one pass, and the checks that samples and rates must pass.

use super::error::{RecordingError, short};
use super::outline::{Extremes, Outline};
use super::text::LARGEST;
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;

/// Longest list of places kept for one channel and one fault; beyond it only the count grows.
const PLACES_KEPT: usize = 32;

/// Shortest run of equal samples at the extreme level that counts as a flat top. Two equal samples
/// around a crest are common, three need a limit (or coarse quantisation, see `MIN_DROP_QUANTA`).
const MIN_FLAT_TOP: u64 = 3;

/// A flat top must fall off at one side by more than this many quantisation steps between
/// neighbouring samples. The rounded crest of a slow signal holds k >= 3 equal samples within one
/// step and falls by at most (1 + 2/k)^2 < 2.8 steps plus one of rounding to the next sample.
const MIN_DROP_QUANTA: f64 = 4.0;

/// Part of the peak by which a flat top must fall off besides, because a printed number of few
/// digits has coarser steps near its peak than near zero.
const MIN_DROP_OF_PEAK: f64 = 1e-4;

/// Part of the channel's peak that a level must reach to be taken for a limit: the noise floor on
/// the idle side of a hammer signal is none.
const MIN_LEVEL_OF_PEAK: f64 = 0.5;

/// An extreme this near to the peak (part of it) is the other end of the same integer format.
const FULL: f64 = 0.99;

/// Samples this far below the extreme level are near it (part of the level).
const NEAR_LEVEL: f64 = 0.01;

/// Fewest separate runs at the extreme level that make a rail of it where values are coarse: by chance two crests may
/// be equal.
const LEAST_HITS: u64 = 4;

/// Steps of the values coarser than this part of the level say nothing about single samples on it.
const QUANTUM_OF_PEAK: f64 = 1e-3;

/// With steps finer than this part of the level two neighbours at the extreme are equal by a limit alone.
const FINE_QUANTUM: f64 = 1e-6;

/// Part of the peak by which the steps to both sides of a crest must differ, or the crest is that of a computed tone.
const LOPSIDED_OF_PEAK: f64 = 1e-6;

/// A peak beyond this multiple of the rms is no steady tone, which repeats its crest exactly.
const PEAK_OF_TONE: f64 = 3.0;

/// Shortest run of equal samples that counts as dropped. Recorders lose whole buffers, of 32
/// samples at least; a moving signal does not repeat a value that often by chance.
const MIN_DROPOUT: u64 = 32;

/// Shortest run that counts as dropped where the signal moves strongly before and after it. 8: shorter ones do little harm.
const LEAST_DROPOUT: u64 = 8;

/// Logarithm of the chance that a moving signal repeats a value so often, below which samples count as dropped. A signal that
/// moves by n quantisation steps repeats a value with a chance of about 1/n. One in 10^12: 15 samples at 8 steps, 8 from 52 on.
const MOST_CHANCE: f64 = -12.0 * std::f64::consts::LN_10;

/// Before a dropout the signal must have moved by more than this many quantisation steps from
/// sample to sample: a signal that fades into silence repeats its value without any loss.
const MIN_ACTIVITY_QUANTA: f64 = 8.0;

/// A signal that moved by more than this many quantisation steps before it came to rest has not faded into silence: the last
/// steps of a decay are single ones, with pauses between them.
const MIN_STOP_QUANTA: f64 = 1.0;

/// Shortest run of equal samples at the end that counts as a stop. 128: noise of a few quantisation steps repeats a value with a
/// chance of a half at most.
const MIN_STOP: u64 = 128;

/// Weight of the newest step in the running mean of steps: a memory of about 16 samples. The mean before a run is used, so
/// the length of the run does not count.
const ACTIVITY_WEIGHT: f64 = 1.0 / 16.0;

/// Samples that are added together where nothing about them is remarkable.
const PIECE: usize = 64;

/// Part of the recording that may stand still before standing still is taken for the channel's
/// rest (a gated or noise-free channel) instead of lost samples.
const MAX_STILL_PART: f64 = 0.5;

/// A mean beyond this part of the peak is reported: a tenth shifts thresholds noticeably.
const OFFSET_OF_PEAK: f64 = 0.1;

/// Sample rates that are taken (Hz). Nothing that is tapped needs more or does with less; beyond lie
/// damaged time columns, whose lengths in samples no longer fit a number.
const RATES: std::ops::RangeInclusive<f64> = 1e-3..=1e9;

/// Checks that a sample rate (Hz) is one that a recording can have.
pub(super) fn check_rate(file: &str, value: f64) -> Result<(), RecordingError> {
    match RATES.contains(&value) {
        true => Ok(()),
        false => Err(RecordingError::new(
            file,
            format!(
                "sample rate {value} Hz; allowed: 0.001 to 1e9 Hz; correct it or the time column"
            ),
        )),
    }
}

/// Returns the index of the first value that is not finite or absurdly large.
pub(super) fn first_unusable(values: impl IntoIterator<Item = f64>) -> Option<usize> {
    // NaN is in no range.
    values
        .into_iter()
        .position(|value| !(-LARGEST..=LARGEST).contains(&value))
}

/// Checks that samples of a channel (0-based), the first of them at `start`, are finite and not absurd.
pub(super) fn check_finite(
    name: &str,
    sample_rate: f64,
    channel: usize,
    start: u64,
    samples: &[f64],
) -> Result<(), RecordingError> {
    let Some(at) = first_unusable(samples.iter().copied()) else {
        return Ok(());
    };
    let frame = start + at as u64;
    let problem = format!(
        "channel {}, sample {frame} ({} s) is {}; allowed: finite numbers of magnitude up to 1e100; remove the damaged part and export it again, or record again and check the form of the samples",
        channel + 1,
        short(frame as f64 / sample_rate),
        samples[at]
    );
    Err(RecordingError::new(name, problem))
}

/// Checks channels in memory and returns their common length.
pub(super) fn check_samples<'a>(
    name: &str,
    sample_rate: f64,
    channels: impl IntoIterator<Item = &'a [f64]>,
) -> Result<usize, RecordingError> {
    let mut frames = 0;
    for (at, samples) in channels.into_iter().enumerate() {
        if at == 0 {
            frames = samples.len();
        }
        if frames == 0 {
            break;
        }
        if samples.len() != frames {
            let problem = format!(
                "channel {} has {} samples, channel 1 has {frames}; allowed: equal lengths",
                at + 1,
                samples.len()
            );
            return Err(RecordingError::new(name, problem));
        }
        check_finite(name, sample_rate, at, 0, samples)?;
    }
    match frames {
        0 => Err(RecordingError::no_samples(name)),
        frames => Ok(frames),
    }
}

/// A run of equal samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EqualRun {
    /// First sample (0-based).
    pub start: u64,
    /// Samples.
    pub len: u64,
    /// Their value (the channel's unit).
    pub value: f64,
}

/// The quality of one channel over the whole recording, in the channel's unit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct ChannelHealth {
    /// Mean value, the DC offset (the channel's unit).
    pub mean: f64,
    /// Root mean square about the mean (the channel's unit).
    pub rms: f64,
    /// Largest magnitude (the channel's unit).
    pub peak: f64,
    /// Lowest value (the channel's unit).
    #[serde(skip)]
    pub minimum: f64,
    /// Highest value (the channel's unit).
    #[serde(skip)]
    pub maximum: f64,
    /// Samples at the largest or smallest number of an integer format; 0 for other formats.
    pub full_scale_samples: u64,
    /// The first of them (0-based).
    #[serde(skip)]
    pub first_full_scale: Option<u64>,
    /// Runs of at least 3 equal samples at the channel's highest or lowest level, the first 32 of
    /// each side.
    #[serde(skip)]
    pub flat_tops: Vec<EqualRun>,
    /// Number of flat tops, beyond the list too.
    #[serde(rename = "flat_tops")]
    pub flat_top_count: u64,
    /// Lower and upper rail (the channel's unit): the level at which samples were cut off, singly or in runs; `None`
    /// where none was.
    #[serde(skip)]
    pub rails: [Option<f64>; 2],
    /// Runs of at least 8 repeated samples inside the moving signal, the first 32.
    #[serde(skip)]
    pub dropped: Vec<EqualRun>,
    /// Number of dropouts, beyond the list too.
    #[serde(skip)]
    pub dropout_count: u64,
    /// Samples in all of them together.
    pub dropped_samples: u64,
    /// The equal samples with which the recording ends, 128 at least, where the signal moved before them.
    #[serde(skip)]
    pub stopped: Option<EqualRun>,
    /// Smallest step between two samples (the channel's unit); infinite without any.
    #[serde(skip)]
    pub step: f64,
    /// All samples are equal: nothing was connected, or nothing was recorded.
    #[serde(skip)]
    pub constant: bool,
    /// Extremes piece by piece, in the units of the file; none of joined files.
    #[serde(skip)]
    pub outline: Arc<Outline>,
}

impl ChannelHealth {
    /// Returns this health in another unit: every value multiplied by `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let (low, high) = (self.minimum * factor, self.maximum * factor);
        let mut scaled = self.clone();
        scaled.mean *= factor;
        scaled.rms *= factor.abs();
        scaled.peak *= factor.abs();
        scaled.step *= factor.abs();
        (scaled.minimum, scaled.maximum) = (low.min(high), low.max(high));
        scaled.rails = self.rails.map(|rail| rail.map(|level| level * factor));
        if factor < 0.0 {
            scaled.rails.reverse();
        }
        let runs = scaled.flat_tops.iter_mut().chain(&mut scaled.dropped);
        for run in runs.chain(&mut scaled.stopped) {
            run.value *= factor;
        }
        scaled
    }

    /// Returns the health of samples, `frames` of them, that are followed by `others` of another file.
    pub(super) fn followed_by(&self, frames: u64, other: &Self, others: u64) -> Self {
        let mut both = self.clone();
        both.outline = Arc::default();
        let (own, more) = (frames as f64, others as f64);
        let total = own + more;
        let difference = other.mean - self.mean;
        both.mean += difference * more / total;
        // As for the blocks of one file, see [`HealthMeter::add`].
        let squares = own * self.rms.powi(2) + more * other.rms.powi(2);
        both.rms = ((squares + difference.powi(2) * own * more / total) / total).sqrt();
        both.peak = self.peak.max(other.peak);
        both.minimum = self.minimum.min(other.minimum);
        both.maximum = self.maximum.max(other.maximum);
        both.step = self.step.min(other.step);
        both.full_scale_samples += other.full_scale_samples;
        let later = other.first_full_scale.map(|first| first + frames);
        both.first_full_scale = self.first_full_scale.or(later);
        both.flat_top_count += other.flat_top_count;
        both.dropout_count += other.dropout_count;
        both.dropped_samples += other.dropped_samples;
        for (runs, more) in [
            (&mut both.flat_tops, &other.flat_tops),
            (&mut both.dropped, &other.dropped),
        ] {
            let moved = more.iter().map(|run| EqualRun {
                start: run.start + frames,
                ..*run
            });
            runs.extend(moved);
            runs.truncate(2 * PLACES_KEPT);
        }
        both.stopped = other.stopped.map(|run| EqualRun {
            start: run.start + frames,
            ..run
        });
        // The nearer rail is the limit wherever both were reached.
        let [low, high] =
            [0, 1].map(|side| [self.rails[side], other.rails[side]].into_iter().flatten());
        both.rails = [low.reduce(f64::max), high.reduce(f64::min)];
        both.constant = both.minimum == both.maximum;
        both
    }

    /// Returns the doubts that this health gives rise to: their codes and what is wrong.
    pub(super) fn doubts(&self, sample_rate: f64) -> Vec<(&'static str, String)> {
        let (mean, peak) = (self.mean, self.peak);
        if self.constant {
            let problem = format!(
                "every sample is {}; probably nothing was connected; check the cable and the channel numbers",
                short(mean)
            );
            return vec![("constant-channel", problem)];
        }
        let mut doubts = Vec::new();
        if let Some(first) = self.first_full_scale {
            let problem = format!(
                "samples at full scale: {}, the first at {:.6} s; the input was probably overloaded; lower the gain or tap more softly",
                self.full_scale_samples,
                first as f64 / sample_rate
            );
            doubts.push(("full-scale", problem));
        }
        if let Some(EqualRun { start, len, value }) = self.flat_tops.first() {
            let problem = format!(
                "flat tops at its extreme level: {}, the first at {:.6} s ({len} equal samples at {}); an amplifier or sensor was probably overloaded; lower the gain or tap more softly",
                self.flat_top_count,
                *start as f64 / sample_rate,
                short(*value)
            );
            doubts.push(("flat-tops", problem));
        }
        let rails: Vec<String> = self
            .rails
            .iter()
            .flatten()
            .map(|rail| short(*rail).to_string())
            .collect();
        if self.flat_tops.is_empty() && self.first_full_scale.is_none() && !rails.is_empty() {
            let problem = format!(
                "many of its extreme samples are exactly {}; an amplifier or sensor was probably overloaded; lower the gain or tap more softly",
                rails.join(" and ")
            );
            doubts.push(("flat-tops", problem));
        }
        if let Some(EqualRun { start, len, value }) = self.dropped.first() {
            let problem = format!(
                "runs of repeated samples inside the moving signal: {}; samples in them: {}, the first at {:.6} s ({len} samples of {}); the recorder probably lost data; leave these taps out or record again",
                self.dropout_count,
                self.dropped_samples,
                *start as f64 / sample_rate,
                short(*value)
            );
            doubts.push(("dropped-samples", problem));
        }
        if mean.abs() > OFFSET_OF_PEAK * peak {
            let problem = format!(
                "mean {mean:.4e} where the peak is {peak:.4e}; the sensor's supply or the amplifier's zero probably shifts it; couple it AC, or ignore this where the mean is removed"
            );
            doubts.push(("offset", problem));
        }
        doubts
    }
}

/// Gathers [`ChannelHealth`] sample by sample, in memory that does not grow with the recording.
#[derive(Debug, Clone)]
pub(super) struct HealthMeter {
    full_scale: Option<f64>,
    sum_of_squares: f64,
    /// Samples so far.
    count: u64,
    last: f64,
    run: Run,
    /// Smallest step between two samples.
    quantum: f64,
    /// Running mean of the steps.
    activity: f64,
    high: Side,
    low: Side,
    /// Samples in all runs that are long enough for a dropout.
    still_samples: u64,
    outline: Outline,
    /// Weights of the steps of a piece in the running mean at its end.
    weights: [f64; PIECE],
    /// The result as far as it is known; its values at the extremes come at the end.
    health: ChannelHealth,
}

/// The run of equal samples that is going on.
#[derive(Debug, Clone, Copy, Default)]
struct Run {
    start: u64,
    len: u64,
    /// Magnitude of the step that led into it.
    entry: f64,
    /// Mean step before it.
    activity: f64,
}

/// Flat tops at one extreme. `sign` turns the lowest level into a highest one.
#[derive(Debug, Clone)]
struct Side {
    sign: f64,
    level: f64,
    /// Separate runs at the level, of single samples too.
    hits: u64,
    /// Those that fall off at one end as flat tops do, and unequally at both. The crests of a computed tone are
    /// symmetric.
    lopsided: u64,
    /// The lopsided ones of two or more samples.
    pairs: u64,
    /// Separate runs within [`NEAR_LEVEL`] below it.
    near: u64,
    places: Vec<EqualRun>,
    count: u64,
}

impl Side {
    fn new(sign: f64) -> Self {
        Self {
            sign,
            level: f64::NEG_INFINITY,
            hits: 0,
            lopsided: 0,
            pairs: 0,
            near: 0,
            places: Vec::new(),
            count: 0,
        }
    }

    /// Takes the next value that differs from the last; a higher level makes all runs at the old one ordinary.
    fn raise(&mut self, value: f64) {
        let height = value * self.sign;
        if height > self.level {
            self.near = match self.level >= height - NEAR_LEVEL * height.abs() {
                true => self.near + self.hits,
                false => 0,
            };
            (self.level, self.hits) = (height, 1);
            (self.lopsided, self.pairs) = (0, 0);
            self.places.clear();
            self.count = 0;
        } else if height == self.level {
            self.hits += 1;
        } else if height >= self.level - NEAR_LEVEL * self.level.abs() {
            self.near += 1;
        }
    }

    /// Returns the rail of this side: a level with flat tops, or one on which samples pile up. `quantum` is the smallest
    /// step of the values, `rms` their root mean square about the mean.
    ///
    /// Of a smooth signal that is not cut off far more samples lie within 1 % below the highest than exactly on it.
    /// Coarse steps would pile up by themselves, and so do numbers of few digits.
    fn rail(&self, quantum: f64, rms: f64) -> Option<f64> {
        let level = self.level.abs();
        let few_digits = format!("{level:.6e}").parse() == Ok(level);
        let certain = self.pairs > 0 && quantum < FINE_QUANTUM * level && !few_digits;
        let piled = (self.pairs > 0 || self.lopsided > 0 && level > PEAK_OF_TONE * rms)
            && quantum < QUANTUM_OF_PEAK * level
            && self.hits >= LEAST_HITS
            && self.hits > self.near;
        (self.count > 0 || certain || piled).then_some(self.level * self.sign)
    }

    fn holds(&self, value: f64) -> bool {
        value * self.sign == self.level
    }

    /// Returns true where the level lies so far above a value that [`raise`](Self::raise) would not count it.
    fn is_above(&self, value: f64) -> bool {
        value * self.sign < self.level - NEAR_LEVEL * self.level.abs()
    }
}

impl HealthMeter {
    /// Begins; `full_scale` is the magnitude from which on a sample sits at the end of an integer format.
    pub(super) fn new(full_scale: Option<f64>) -> Self {
        Self {
            full_scale,
            sum_of_squares: 0.0,
            count: 0,
            last: 0.0,
            run: Run::default(),
            quantum: f64::INFINITY,
            activity: 0.0,
            high: Side::new(1.0),
            low: Side::new(-1.0),
            still_samples: 0,
            outline: Outline::default(),
            weights: std::array::from_fn(|place| {
                ACTIVITY_WEIGHT * (1.0 - ACTIVITY_WEIGHT).powi((PIECE - 1 - place) as i32)
            }),
            health: ChannelHealth::default(),
        }
    }

    /// Adds the next samples.
    ///
    /// Mean and sum of squares of the block are merged into those of all before. With
    /// d = mean_b - mean_a and n = n_a + n_b: mean = mean_a + d n_b/n and
    /// M = M_a + M_b + d^2 n_a n_b/n (the pairwise update), exact for any block size and
    /// free of the cancellation of sum(x^2) - n mean^2.
    pub(super) fn add(&mut self, samples: &[f64]) {
        if samples.is_empty() {
            return;
        }
        self.outline.add(samples);
        let added = samples.len() as f64;
        let before = self.count as f64;
        let mean = sum_of(samples, |x| x) / added;
        let squares = sum_of(samples, |x| (x - mean) * (x - mean));
        let difference = mean - self.health.mean;
        let total = before + added;
        self.health.mean += difference * added / total;
        self.sum_of_squares += squares + difference * difference * before * added / total;
        let (pieces, rest) = samples.as_chunks::<PIECE>();
        for piece in pieces {
            match self.is_ordinary(piece) {
                true => self.add_ordinary(piece),
                false => piece.iter().for_each(|value| self.add_sample(*value)),
            }
        }
        rest.iter().for_each(|value| self.add_sample(*value));
    }

    fn add_sample(&mut self, value: f64) {
        let at = self.count;
        self.count += 1;
        if self.full_scale.is_some_and(|level| value.abs() >= level) {
            self.health.full_scale_samples += 1;
            self.health.first_full_scale.get_or_insert(at);
        }
        // The first sample has no step; it begins a run.
        let step = if at > 0 {
            (value - self.last).abs()
        } else {
            0.0
        };
        if at > 0 && step == 0.0 {
            self.run.len += 1;
        } else {
            if at > 0 {
                self.quantum = self.quantum.min(step);
                self.end_run(step);
            }
            self.high.raise(value);
            self.low.raise(value);
            self.run = Run {
                start: at,
                len: 1,
                entry: step,
                activity: self.activity,
            };
        }
        self.activity += ACTIVITY_WEIGHT * (step - self.activity);
        self.last = value;
    }

    /// Returns true for samples of which no two neighbours are equal and none comes near an extreme: they only move the
    /// running values.
    fn is_ordinary(&self, piece: &[f64; PIECE]) -> bool {
        let Extremes { low, high } = Extremes::of(piece);
        let full = self.full_scale.unwrap_or(f64::INFINITY);
        let mut repeats = piece[0] == self.last;
        for (before, value) in piece.iter().zip(&piece[1..]) {
            repeats |= before == value;
        }
        self.count > 0
            && !repeats
            && self.high.is_above(high)
            && self.low.is_above(low)
            && high.max(-low) < full
    }

    /// Adds samples as [`add_sample`](Self::add_sample) does, all of them together.
    fn add_ordinary(&mut self, piece: &[f64; PIECE]) {
        let mut steps = [0.0; PIECE];
        steps[0] = (piece[0] - self.last).abs();
        for (step, pair) in steps[1..].iter_mut().zip(piece.windows(2)) {
            *step = (pair[1] - pair[0]).abs();
        }
        self.quantum = self.quantum.min(steps[0]);
        self.end_run(steps[0]);
        let smallest = Extremes::of(&steps).low;
        self.quantum = self.quantum.min(smallest);
        // The running mean a <- (1 - w) a + w s, all steps at once.
        let mut activity = self.activity * (1.0 - ACTIVITY_WEIGHT).powi(PIECE as i32);
        for (step, weight) in steps.iter().zip(&self.weights) {
            activity += weight * step;
        }
        let entry = steps[PIECE - 1];
        let before_entry = (activity - ACTIVITY_WEIGHT * entry) / (1.0 - ACTIVITY_WEIGHT);
        self.activity = activity;
        self.count += PIECE as u64;
        self.last = piece[PIECE - 1];
        self.run = Run {
            start: self.count - 1,
            len: 1,
            entry,
            activity: before_entry,
        };
    }

    /// Judges the run that ends with a step of magnitude `exit` (0 at the end of the recording).
    fn end_run(&mut self, exit: f64) {
        let Run {
            start,
            len,
            entry,
            activity,
        } = self.run;
        let value = self.last;
        let extreme = self.high.holds(value) || self.low.holds(value);
        if len < MIN_FLAT_TOP && !extreme {
            return;
        }
        let peak = self.high.level.abs().max(self.low.level.abs());
        let smallest_drop = (MIN_DROP_QUANTA * self.quantum).max(MIN_DROP_OF_PEAK * peak);
        let lopsided = (entry - exit).abs() > LOPSIDED_OF_PEAK * peak;
        if extreme && entry.max(exit) > smallest_drop {
            for side in [&mut self.high, &mut self.low] {
                if !side.holds(value) {
                    continue;
                }
                side.lopsided += u64::from(lopsided);
                side.pairs += u64::from(lopsided && len > 1);
                if len >= MIN_FLAT_TOP {
                    side.count += 1;
                    if side.places.len() < PLACES_KEPT {
                        side.places.push(EqualRun { start, len, value });
                    }
                }
            }
        }
        if len < LEAST_DROPOUT {
            return;
        }
        let run = EqualRun { start, len, value };
        let steps = activity / self.quantum;
        if exit == 0.0 && len >= MIN_STOP && steps > MIN_STOP_QUANTA {
            self.health.stopped = Some(run);
        }
        // A long run at a limit is a flat top, whatever else it looks like.
        let at_limit = extreme && value.abs() >= MIN_LEVEL_OF_PEAK * peak;
        let moved = steps > MIN_ACTIVITY_QUANTA && exit > 0.0 && !at_limit;
        // A short one has to interrupt the motion on both sides.
        let interrupts = entry.min(exit) > MIN_ACTIVITY_QUANTA * self.quantum && !extreme;
        let chance = -steps.ln() * (len - 1) as f64;
        let is_dropped = moved && (len >= MIN_DROPOUT || interrupts && chance < MOST_CHANCE);
        if len >= MIN_DROPOUT || is_dropped {
            self.still_samples += len;
        }
        if !is_dropped {
            return;
        }
        self.health.dropout_count += 1;
        self.health.dropped_samples += len;
        if self.health.dropped.len() < PLACES_KEPT {
            self.health.dropped.push(run);
        }
    }

    /// Returns the health of all samples that were added.
    pub(super) fn finish(mut self) -> ChannelHealth {
        if self.count == 0 {
            return ChannelHealth::default();
        }
        self.end_run(0.0);
        let mut health = self.health;
        health.outline = Arc::new(self.outline);
        (health.maximum, health.minimum) = (self.high.level, -self.low.level);
        health.rms = (self.sum_of_squares / self.count as f64).sqrt();
        health.peak = health.maximum.abs().max(health.minimum.abs());
        health.step = self.quantum;
        health.constant = health.maximum == health.minimum;
        for (side, rail) in [self.low, self.high].into_iter().zip(&mut health.rails) {
            if !health.constant && side.level.abs() >= MIN_LEVEL_OF_PEAK * health.peak {
                *rail = side.rail(self.quantum, health.rms);
                health.flat_top_count += side.count;
                health.flat_tops.extend(side.places);
            }
        }
        // An integer format ends at full scale, reached or not by the other side.
        if health.full_scale_samples > 0 {
            let ends = [health.minimum, health.maximum];
            for (rail, end) in health.rails.iter_mut().zip(ends) {
                *rail = rail.or(Some(end).filter(|end| end.abs() >= FULL * health.peak));
            }
        }
        health.flat_tops.sort_by_key(|flat_top| flat_top.start);
        if self.still_samples as f64 > MAX_STILL_PART * self.count as f64 {
            health.dropped.clear();
            health.dropout_count = 0;
            health.dropped_samples = 0;
        }
        health
    }
}

/// Sum of a term over some values. Eight sums run side by side, for each addition waits for the last.
fn sum_of(values: &[f64], term: impl Fn(f64) -> f64) -> f64 {
    let mut sums = [0.0; 8];
    let (lanes, rest) = values.as_chunks::<8>();
    for values in lanes {
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += term(*value);
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|value| term(*value)).sum::<f64>()
}
