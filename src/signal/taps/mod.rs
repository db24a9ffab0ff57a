//! Finding taps: a tap is a view into the recording, accepted or rejected with a reason.
//!
//! With a hammer channel, taps are pulses of force above its noise ([`find_taps`] with
//! [`TapSource::Hammer`]); without one they are sudden rises of the responses. Both scan the
//! recording block by block. A tap's record begins a little before the trigger and ends where the
//! next tap comes.

mod by_hand;
mod double_hit;
mod pulse;
mod search;

pub use by_hand::{REACH, TapsByHand};
pub use double_hit::SecondHit;
pub use pulse::{FORCE_OVER_NOISE, Pulse};

use std::fmt;
use std::ops::Range;

use crate::recording::{Recording, RecordingError};
use double_hit::{least_candidate, second_hit};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use search::{Force, Survey, find_pulses, find_rises};
use tapjoint_numerics::stats::{median, root_mean_square};

/// Channels on which taps are looked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TapSource {
    /// The force on this channel (0-based); its responses follow, for the overload check.
    Hammer {
        /// Channel of the force.
        channel: usize,
        /// Channels of the responses.
        responses: Vec<usize>,
    },
    /// Sudden rises on any of these channels (0-based).
    Responses(Vec<usize>),
}

impl TapSource {
    /// All channels involved.
    pub fn channels(&self) -> Vec<usize> {
        match self {
            TapSource::Hammer { channel, responses } => std::iter::once(*channel)
                .chain(responses.iter().copied())
                .collect(),
            TapSource::Responses(channels) => channels.clone(),
        }
    }
}

/// Limits by which taps are found and judged.
#[derive(Debug, Clone, PartialEq)]
pub struct TapSettings {
    /// Signal kept before the trigger (s). 10 ms, enough for a filter's ringing ahead of the pulse;
    /// at least 16 samples.
    pub pre_trigger: f64,
    /// Two excursions nearer than this belong to one tap (s). 0.2 s: no hand taps five times a
    /// second, while a bouncing hammer comes back within 100 ms.
    pub least_distance: f64,
    /// Threshold over the noise's standard deviation. 10: noise alone reaches 5 in a million
    /// samples.
    pub over_noise: f64,
    /// Threshold as a share of the largest excursion. 3 %: below lies the handling of the hammer.
    pub of_largest: f64,
    /// A tap below this share of the median peak is too weak. 10 %.
    pub weak: f64,
    /// A second hit above this share of the peak rejects the tap. 10 % (no false alarm in 5,000 clean
    /// pulses, every second hit of 12 % found: `examples/double_hits.rs`).
    pub double_hit: f64,
    /// A second hit above this share of the peak is reported and its tap kept. 4 %, so that one of 5 % is
    /// found whatever its noise and width: it leaves a ripple of 0.9 dB in the force spectrum.
    pub double_hit_warning: f64,
    /// The force must have fallen below this share of the peak before a second excursion counts. 5 %.
    pub rearm: f64,
    /// Length of signal that the wanted block needs (s), where a block is given.
    pub wanted: Option<f64>,
    /// True to accept taps that drove a channel to its limit. Their decays are used from where they are whole.
    pub keep_overload: bool,
    /// Taps that are accepted or rejected by hand.
    pub by_hand: TapsByHand,
    /// True while the recording goes on: its end then cuts off no record.
    pub is_growing: bool,
}

impl Default for TapSettings {
    fn default() -> Self {
        TapSettings {
            pre_trigger: 0.01,
            least_distance: 0.2,
            over_noise: 10.0,
            of_largest: 0.03,
            weak: 0.1,
            double_hit: 0.10,
            double_hit_warning: 0.04,
            rearm: 0.05,
            wanted: None,
            keep_overload: false,
            by_hand: TapsByHand::default(),
            is_growing: false,
        }
    }
}

/// One tap.
#[derive(Debug, Clone, PartialEq)]
pub struct Tap {
    /// Its file, where the recording has several.
    pub file: Option<String>,
    /// Time of the trigger (s from the start of the recording; files follow one another).
    pub time: f64,
    /// Peak of the force (N), or of the response on which the tap was found (its unit).
    pub peak: f64,
    /// Frame in which the force pulse, its ringing included, has died away; `None` without a hammer.
    pub pulse_end: Option<u64>,
    /// Its force pulse in numbers; `None` without a hammer.
    pub pulse: Option<Pulse>,
    /// Frames of its record: a little before the trigger to where the next tap comes.
    pub record: Range<u64>,
    /// A second hit within the record, from [`TapSettings::double_hit_warning`] of the peak up; `None`
    /// without one, and without a hammer, where it cannot be told from two modes that beat.
    pub second_hit: Option<SecondHit>,
    /// Samples of its record at the limit of a channel; `None` without any, and of a tap that is rejected for another
    /// reason.
    pub overload: Option<Overload>,
    /// Reason why it does not enter the averages; `None` = accepted.
    pub rejection: Option<Rejection>,
    /// Reason for which it would have been rejected, had it not been accepted by hand; never an overload, of which only the
    /// decay is used.
    pub overruled: Option<Rejection>,
}

/// Samples of a tap's record at the limit of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overload {
    /// The first such channel, 1-based.
    pub channel: usize,
    /// Its samples at the limit.
    pub samples: usize,
    /// Frame from which no response is cut off any more.
    pub whole_from: u64,
    /// True where the force is cut off as well: its peak and its pulse are not known.
    pub is_force: bool,
}

impl fmt::Display for Overload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Overload {
            channel, samples, ..
        } = self;
        write!(f, "channel {channel} is at its limit for {samples} samples")
    }
}

impl Tap {
    /// Returns `true` for a tap that enters the averages.
    pub fn accepted(&self) -> bool {
        self.rejection.is_none()
    }

    /// Counts its frames and its time from a start that lies so many frames earlier.
    fn move_by(&mut self, frames: u64, rate: f64) {
        self.time += frames as f64 / rate;
        self.record = self.record.start + frames..self.record.end + frames;
        self.pulse_end = self.pulse_end.map(|end| end + frames);
        if let Some(overload) = &mut self.overload {
            overload.whole_from += frames;
        }
    }

    /// First frame that is used of its record: an overloaded tap has only its decay, from where that is whole.
    pub fn usable_from(&self) -> u64 {
        let whole = self.overload.map(|overload| overload.whole_from);
        whole.unwrap_or(self.record.start).min(self.record.end)
    }

    /// Length of what is used of its record (frames).
    pub fn frames(&self) -> u64 {
        self.record.end - self.usable_from()
    }

    /// Returns `true` where its whole record may enter averages: no sample of force or response was cut off.
    pub fn is_whole(&self) -> bool {
        self.overload.is_none()
    }
}

/// Reason why a tap is rejected.
#[derive(Debug, Clone, PartialEq)]
pub enum Rejection {
    /// The hammer hit twice.
    DoubleHit {
        /// Time between the two (s).
        delay: f64,
        /// [`SecondHit::ratio`].
        ratio: f64,
        /// Limit of that ratio.
        limit: f64,
    },
    /// A channel was driven to its limit.
    Overload(Overload),
    /// No sensor moved.
    NoResponse,
    /// Too weak beside the others.
    TooWeak {
        /// Its peak.
        peak: f64,
        /// Least accepted peak (same unit).
        limit: f64,
    },
    /// The file ends before the record is long enough.
    CutOff {
        /// Length recorded (s).
        available: f64,
        /// Length of the others (s).
        needed: f64,
    },
    /// The next tap comes before the record is long enough.
    NextTooSoon {
        /// Length recorded (s).
        available: f64,
        /// Length of the others (s).
        needed: f64,
    },
    /// It was rejected by hand.
    ByHand,
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Rejection::DoubleHit {
                delay,
                ratio,
                limit,
            } => write!(
                f,
                "double hit: a second excursion of {:.0} % after {:.1} ms (limit {:.0} %)",
                100.0 * ratio,
                1e3 * delay,
                100.0 * limit
            ),
            Rejection::Overload(overload) => write!(f, "overload: {overload}"),
            Rejection::NoResponse => f.write_str(
                "no sensor answers it: the hammer was moved or laid down, or a disturbance",
            ),
            Rejection::TooWeak { peak, limit } => {
                write!(
                    f,
                    "too weak: a peak of {peak:.3} where {limit:.3} is the least"
                )
            }
            Rejection::CutOff { available, needed } => write!(
                f,
                "cut off by the end of the file: {available:.2} s recorded, {needed:.2} s needed"
            ),
            Rejection::NextTooSoon { available, needed } => {
                write!(
                    f,
                    "the next tap comes after {available:.2} s, {needed:.2} s are needed"
                )
            }
            Rejection::ByHand => f.write_str("rejected by hand"),
        }
    }
}

/// Oddity of the search itself.
#[derive(Debug, Clone, PartialEq)]
pub enum TapRemark {
    /// The force pulses point downwards.
    InvertedForce,
    /// The recording begins after the tap, or in its pulse.
    StartsWithinTap,
    /// The force stayed up for longer than any hammer pulse.
    LongExcursion {
        /// Number of times.
        count: usize,
    },
    /// Taps that drove a channel to its limit were accepted, as asked.
    OverloadKept {
        /// Number of taps.
        count: usize,
    },
    /// Of several files this one has no tap that is accepted.
    FileWithoutTap {
        /// The file.
        file: String,
    },
    /// No tap is left but overloaded ones, and these are rejected.
    AllOverloaded {
        /// Number of taps.
        count: usize,
    },
    /// No tap is where one was to be accepted or rejected by hand.
    NoTapThere {
        /// Where (s from the start of the recording).
        time: f64,
        /// True where it was to be accepted.
        accept: bool,
        /// The nearest tap (s); `None` without any.
        nearest: Option<f64>,
    },
    /// A tap that was to be accepted by hand has no record that could be used.
    StillRejected {
        /// Time of its trigger (s from the start of the recording).
        time: f64,
        /// Reason why.
        rejection: Rejection,
    },
}

impl fmt::Display for TapRemark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TapRemark::InvertedForce => f.write_str(
                "the force pulses point downwards; they were taken as taps all the same, but the phase \
                 of every frequency response is turned by 180 degrees: give the hammer a negative scale",
            ),
            TapRemark::StartsWithinTap => f.write_str(
                "the recording begins within a tap: the start of its pulse is lost, so that its \
                 frequency response is doubtful (its frequencies are not); start the recorder earlier \
                 or use its pre-trigger",
            ),
            TapRemark::LongExcursion { count } => write!(
                f,
                "the force stayed up for more than 50 ms {count} time(s), longer than any hammer pulse; \
                 that was left out: a moved cable, a hand on the hammer, or the wrong channel"
            ),
            TapRemark::OverloadKept { count } => write!(
                f,
                "{count} tap(s) drove a channel to its limit; their decays are used after the last sample that was cut off; \
                 they give frequencies and damping, and enter no frequency response function; lower the gain or tap \
                 more softly"
            ),
            TapRemark::FileWithoutTap { file } => {
                write!(f, "{file}: no tap of this file is accepted; the other files are used")
            }
            TapRemark::AllOverloaded { count } => write!(
                f,
                "no tap is accepted; {count} drove a channel to its limit; lower the gain or tap more softly; \
                 overload = \"keep\" in [[recording]], or --overload keep, uses their decays after the last sample \
                 that was cut off"
            ),
            TapRemark::NoTapThere {
                time,
                accept,
                nearest,
            } => {
                let key = if *accept { "accept_taps" } else { "reject_taps" };
                let reach = 1e3 * REACH;
                write!(
                    f,
                    "{key} names {time:.3} s, and no tap lies within {reach:.0} ms of it; correct the time"
                )?;
                match nearest {
                    Some(nearest) => write!(f, ": the nearest tap is at {nearest:.3} s"),
                    None => Ok(()),
                }
            }
            TapRemark::StillRejected { time, rejection } => {
                write!(
                    f,
                    "the tap at {time:.3} s cannot be accepted by hand: {rejection}"
                )
            }
        }
    }
}

/// All taps of a recording, in order of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Taps {
    /// The taps.
    pub taps: Vec<Tap>,
    /// Standard deviation of the noise on which they were looked for (unit of the channel); on
    /// several responses that of the first.
    pub noise: f64,
    /// Frames before the first tap: noise, hum, and perhaps the hammer being picked up. Of several files those of the
    /// longest such stretch.
    pub quiet: Range<u64>,
    /// Oddities.
    pub remarks: Vec<TapRemark>,
}

impl Taps {
    /// Those that enter the averages.
    pub fn accepted(&self) -> impl Iterator<Item = &Tap> {
        self.taps.iter().filter(|tap| tap.accepted())
    }

    /// Length of the shortest accepted record (frames).
    pub fn shortest(&self) -> Option<u64> {
        self.accepted().map(Tap::frames).min()
    }

    /// The force pulse in the mean of the accepted taps; `None` without a hammer, or where every pulse was cut off.
    pub fn mean_pulse(&self) -> Option<Pulse> {
        let pulses: Vec<Pulse> = self.accepted().filter_map(|tap| tap.pulse).collect();
        Pulse::mean(&pulses)
    }
}

/// An event before it is judged.
#[derive(Debug, Clone, PartialEq)]
struct Event {
    /// Frame of the trigger.
    trigger: u64,
    peak: f64,
    /// A sensor answers it; without a hammer the answer is the event.
    answered: bool,
    /// It is accepted by hand.
    by_hand: bool,
}

impl Event {
    /// Returns `true` for a hit of the structure. It ends the record before it.
    ///
    /// What moves no sensor, or stays below the `weakest` peak, disturbs a record no more than is tolerated of a second
    /// excursion.
    fn is_hit(&self, weakest: f64) -> bool {
        self.by_hand || self.answered && self.peak >= weakest
    }
}

/// Result of a search, before it is judged.
struct Found {
    events: Vec<Event>,
    noise: f64,
    /// Survey of the force channel, where there is one.
    survey: Option<Survey>,
    remarks: Vec<TapRemark>,
}

/// Finds the taps of a recording, and accepts or rejects each with its reason. Of several files each is searched by
/// itself.
///
/// # Errors
/// Those of reading the recording.
pub fn find_taps(
    recording: &Recording,
    source: &TapSource,
    settings: &TapSettings,
) -> Result<Taps, RecordingError> {
    let mut searched = Vec::new();
    for (start, file) in recording.parts() {
        searched.push((start, file, search(file, source, settings)?));
    }
    let joined = !searched.is_empty();
    if !joined {
        searched.push((0, recording, search(recording, source, settings)?));
    }
    let events = searched.iter().flat_map(|(.., found)| &found.events);
    let mut peaks: Vec<f64> = events
        .filter(|event| event.answered)
        .map(|event| event.peak)
        .collect();
    let weakest = settings.weak * median(&mut peaks);
    let rate = recording.sample_rate();
    let starts: Vec<f64> = searched
        .iter()
        .map(|(start, ..)| *start as f64 / rate)
        .collect();
    let found = searched.iter_mut();
    let mut files: Vec<&mut [Event]> = found.map(|(.., found)| &mut found.events[..]).collect();
    let mut remarks = settings.by_hand.mark(&mut files, &starts, rate);
    let mut taps = Vec::with_capacity(peaks.len());
    // Last tap of each file.
    let mut lasts = Vec::new();
    let mut quiet = 0..0;
    for (start, file, found) in &searched {
        let before = taps.len();
        let judged = (0..found.events.len()).into_par_iter();
        let judged = judged.map(|index| tap(file, source, found, index, weakest, settings));
        // Collected in order, so that of several errors the first is reported.
        let judged: Vec<Result<Tap, RecordingError>> = judged.collect();
        for tap in judged {
            let mut tap = tap?;
            tap.file = joined.then(|| file.name().to_owned());
            tap.move_by(*start, rate);
            taps.push(tap);
        }
        if let Some(first) = taps.get(before) {
            lasts.push(taps.len() - 1);
            let own = *start..first.record.start;
            if own.end - own.start > quiet.end - quiet.start || lasts.len() == 1 {
                quiet = own;
            }
        }
    }
    if settings.keep_overload {
        // One that is cut off to its end has no decay.
        for tap in taps.iter_mut().filter(|tap| tap.frames() > 0) {
            if matches!(tap.rejection, Some(Rejection::Overload(_))) {
                tap.rejection = None;
            }
        }
    }
    remarks.extend(settings.by_hand.reject(&mut taps));
    let going_on = taps.len().checked_sub(1).filter(|_| settings.is_growing);
    reject_short(&mut taps, &lasts, going_on, rate, settings.wanted);
    remarks.extend(settings.by_hand.still_rejected(&taps));
    let mut noise = 0.0_f64;
    for (_, file, found) in searched {
        noise = noise.max(found.noise);
        for remark in found.remarks {
            if !remarks.contains(&remark) {
                remarks.push(remark);
            }
        }
        let name = Some(file.name());
        let mut own = taps.iter().filter(|tap| tap.file.as_deref() == name);
        if joined && taps.iter().any(Tap::accepted) && !own.any(Tap::accepted) {
            let file = file.name().to_owned();
            remarks.push(TapRemark::FileWithoutTap { file });
        }
    }
    let kept = taps
        .iter()
        .filter(|tap| tap.accepted() && !tap.is_whole())
        .count();
    if kept > 0 {
        remarks.push(TapRemark::OverloadKept { count: kept });
    }
    let overloaded = taps.iter().filter(|tap| !tap.is_whole()).count();
    if overloaded > 0 && !settings.keep_overload && !taps.iter().any(Tap::accepted) {
        remarks.push(TapRemark::AllOverloaded { count: overloaded });
    }
    Ok(Taps {
        taps,
        noise,
        quiet,
        remarks,
    })
}

/// Finds the events of one file.
fn search(
    recording: &Recording,
    source: &TapSource,
    settings: &TapSettings,
) -> Result<Found, RecordingError> {
    match source {
        TapSource::Hammer { channel, responses } => {
            let mut found = find_pulses(recording, *channel, settings)?;
            for event in &mut found.events {
                event.answered = is_answered(recording, responses, event)?;
            }
            Ok(found)
        }
        TapSource::Responses(channels) => find_rises(recording, channels, settings),
    }
}

// ---- Accepting and rejecting taps.

/// A record shorter than this share of the median one is not worth shortening all others for.
const SHORT_OF_MEDIAN: f64 = 0.5;
/// A second hit is looked for so long after the first (s): longer than records usually last, and a bound
/// on memory.
const SEARCHED: f64 = 10.0;
/// The last record may be cut to this share of the shortest other one.
const CUT_OF_SHORTEST: f64 = 0.8;

/// Judges one event. Peaks below `weakest` are too weak.
fn tap(
    recording: &Recording,
    source: &TapSource,
    found: &Found,
    index: usize,
    weakest: f64,
    settings: &TapSettings,
) -> Result<Tap, RecordingError> {
    let rate = recording.sample_rate();
    let event = &found.events[index];
    // The record ends with the pre-trigger of the next tap, or with the file.
    let before = ((settings.pre_trigger * rate) as u64).max(16);
    let mut later = found.events.iter().skip(index + 1);
    let next = later.find(|next| next.is_hit(weakest));
    let end = next.map_or(recording.frames(), |next| {
        next.trigger.saturating_sub(before)
    });
    let start = event.trigger.saturating_sub(before);
    let record = start..end.max(start);
    let least = least_distance(recording, settings);
    let (mut pulse_end, mut pulse, mut second) = (None, None, None);
    if let Some(force) = force_of(recording, source, found, index, &record, settings)? {
        let own = force.index(record.end.min(event.trigger + least));
        let end = force.pulse_end(event, own);
        let start = force.index(record.start);
        let about = start..force.index(end).max(start);
        pulse = Pulse::of(&force.samples[about], force.noise, rate);
        pulse_end = Some(end);
        second = second_hit(&force, event, own, settings);
    }
    let double = second.filter(|second| second.ratio >= settings.double_hit);
    let fault = match double {
        _ if !event.answered => Some(Rejection::NoResponse),
        _ if event.peak < weakest => Some(Rejection::TooWeak {
            peak: event.peak,
            limit: weakest,
        }),
        Some(double) => Some(Rejection::DoubleHit {
            delay: double.delay,
            ratio: double.ratio,
            limit: settings.double_hit,
        }),
        None => None,
    };
    let mut overloaded = None;
    if fault.is_none() || event.by_hand {
        overloaded = overload(recording, source, &record)?;
    }
    let (rejection, overruled) = match event.by_hand {
        true => (None, fault),
        false => (fault.or(overloaded.map(Rejection::Overload)), None),
    };
    Ok(Tap {
        file: None,
        time: event.trigger as f64 / rate,
        peak: event.peak,
        pulse_end,
        pulse: pulse.filter(|_| overloaded.is_none_or(|overload| !overload.is_force)),
        record,
        second_hit: second,
        overload: overloaded,
        rejection,
        overruled,
    })
}

/// Least distance of two taps (frames).
fn least_distance(recording: &Recording, settings: &TapSettings) -> u64 {
    (settings.least_distance * recording.sample_rate()) as u64
}

/// Surroundings of a tap whose disturbances are compared with a second hit (least distances of two taps).
const SURROUNDINGS: u64 = 4;

/// The force over an event's record and ahead of it, as far as that belongs to no other event; `None`
/// without a hammer. Pulses that no sensor answers are taken out:
/// they are no hits of the structure.
fn force_of(
    recording: &Recording,
    source: &TapSource,
    found: &Found,
    index: usize,
    record: &Range<u64>,
    settings: &TapSettings,
) -> Result<Option<Force>, RecordingError> {
    let least = least_distance(recording, settings);
    let (TapSource::Hammer { channel, .. }, Some(survey)) = (source, &found.survey) else {
        return Ok(None);
    };
    let events = &found.events;
    let trigger = events[index].trigger;
    // Another hit of this event comes less than the least distance ahead, and after all of the last.
    let before = index.checked_sub(1).and_then(|last| events.get(last));
    let first = before.map_or(0, |last| last.trigger + least);
    let first = trigger.saturating_sub(least).max(first).min(record.start);
    // What comes nearer to the next tap than the least distance is the next one's.
    let mut end = record.end;
    if end < recording.frames() {
        end = end.saturating_sub(least).max(end.min(trigger + least));
    }
    let longest = (SEARCHED * recording.sample_rate()) as u64;
    let end = end.min(trigger + longest);
    // Beyond the tap's surroundings only what may be a second hit is read.
    let near = end.min(trigger + SURROUNDINGS * least);
    let end = survey.last_reaching(least_candidate(settings) * events[index].peak, near..end);
    let mut force = Force::read(recording, *channel, survey, first..end)?;
    let inside = events.partition_point(|event| event.trigger + least < first)
        ..events.partition_point(|event| event.trigger < end + least);
    for (event, other) in events[inside.clone()].iter().zip(inside) {
        if other != index && !event.answered && !event.by_hand {
            let start = force.index(event.trigger.saturating_sub(least / 100));
            let end = force.index(event.trigger + least);
            force.samples[start..end].fill(0.0);
        }
    }
    Ok(Some(force))
}

/// Samples after the last one at a limit that are left out as well. 4: the filter ahead of a converter spreads what was
/// cut off over its neighbours.
const RECOVERY: u64 = 4;

/// Samples of a record at a channel's rails, and where the last of any response is over; `None` without any.
fn overload(
    recording: &Recording,
    source: &TapSource,
    record: &Range<u64>,
) -> Result<Option<Overload>, RecordingError> {
    let mut found: Option<Overload> = None;
    for channel in source.channels() {
        let Some(info) = recording.channels().get(channel) else {
            continue;
        };
        let [low, high] = info.health.rails;
        if low.is_none() && high.is_none() {
            continue;
        }
        // A hair inside, so that rescaling by a unit cannot make a sample slip through.
        let hair = 1e-9 * info.health.peak;
        let low = low.map_or(f64::NEG_INFINITY, |low| low + hair);
        let high = high.map_or(f64::INFINITY, |high| high - hair);
        let outline = recording.outline(channel).unwrap_or_default();
        let mut pieces = outline.pieces[outline.pieces_of(record.clone())].iter();
        if !pieces.any(|piece| piece.high >= high || piece.low <= low) {
            continue;
        }
        let samples = recording.read(channel, record.clone())?;
        let cut_off = samples.iter().enumerate();
        let cut_off = cut_off.filter(|(_, x)| **x >= high || **x <= low);
        let (count, last) = cut_off.fold((0, None), |(count, _), (at, _)| (count + 1, Some(at)));
        let Some(last) = last else {
            continue;
        };
        let overload = found.get_or_insert(Overload {
            channel: channel + 1,
            samples: count,
            whole_from: record.start,
            is_force: false,
        });
        // The clipped pulse of a hammer spoils no decay.
        if matches!(source, TapSource::Hammer { channel: force, .. } if *force == channel) {
            overload.is_force = true;
        } else {
            let whole_from = record.start + last as u64 + 1 + RECOVERY;
            overload.whole_from = overload.whole_from.max(whole_from);
        }
    }
    Ok(found)
}

/// Rejects records much shorter than the others: all averages share one block, and the shortest
/// record sets its length. `lasts` are the last taps of the files, which may be cut off. The record of the tap `going_on`
/// has not ended.
fn reject_short(
    taps: &mut [Tap],
    lasts: &[usize],
    going_on: Option<usize>,
    rate: f64,
    wanted: Option<f64>,
) {
    let ended = taps.iter().enumerate();
    let ended = ended.filter(|(index, tap)| tap.accepted() && Some(*index) != going_on);
    let mut lengths: Vec<f64> = ended.map(|(_, tap)| tap.frames() as f64 / rate).collect();
    let typical = median(&mut lengths);
    let needed = wanted.map_or(typical, |wanted| wanted.min(typical));
    for (index, tap) in taps.iter_mut().enumerate() {
        let available = tap.frames() as f64 / rate;
        // Equal only where there is nothing at all: taps nearer than the pre-trigger of a slow file.
        if tap.accepted() && Some(index) != going_on && available <= SHORT_OF_MEDIAN * needed {
            tap.rejection = Some(if let Some(overload) = tap.overload {
                Rejection::Overload(overload)
            } else if lasts.contains(&index) {
                Rejection::CutOff { available, needed }
            } else {
                Rejection::NextTooSoon { available, needed }
            });
        }
    }
    let others = taps
        .iter()
        .enumerate()
        .filter(|(index, tap)| tap.accepted() && !lasts.contains(index));
    let shortest = others
        .map(|(_, tap)| tap.frames() as f64 / rate)
        .fold(f64::INFINITY, f64::min);
    let needed = wanted.map_or(shortest, |wanted| wanted.min(shortest));
    for &last in lasts.iter().filter(|last| Some(**last) != going_on) {
        let tap = &mut taps[last];
        let available = tap.frames() as f64 / rate;
        if tap.accepted()
            && tap.is_whole()
            && needed.is_finite()
            && available < CUT_OF_SHORTEST * needed
        {
            tap.rejection = Some(Rejection::CutOff { available, needed });
        }
    }
}

/// Stretch before and after the trigger that is compared (s): several periods of the lowest modes'
/// higher companions, short beside the time between taps.
const STRETCH: f64 = 0.05;
/// A tap raises the rms of some response by this factor at least, or that of what cannot be predicted of it.
const RISE: f64 = 1.5;

/// Returns `true` where any response rises, or does not ring on as before, when the force rises. A hammer laid down, a swinging hammer and an
/// electrical spike move no sensor. Without responses, or at the very start of the recording, the
/// benefit of the doubt is given.
fn is_answered(
    recording: &Recording,
    responses: &[usize],
    event: &Event,
) -> Result<bool, RecordingError> {
    let stretch = (STRETCH * recording.sample_rate()) as u64;
    // The filter's ringing ahead of the pulse belongs to neither side.
    let gap = stretch / 10;
    if responses.is_empty() || stretch < 8 || event.trigger < 2 * stretch {
        return Ok(true);
    }
    let continued = (CONTINUED * recording.sample_rate()) as u64;
    // Two taps lie no nearer, so that the stretch before the trigger is part of what is read.
    let first = (event.trigger - gap).saturating_sub(continued.max(stretch));
    let samples = recording.read_channels(responses, first..event.trigger + stretch)?;
    let turn = (event.trigger - gap - first) as usize;
    let trigger = (event.trigger - first) as usize;
    let lag = ((LAG * recording.sample_rate()) as usize).max(1);
    for ringing in &samples {
        let quiet = &ringing[turn - stretch as usize..turn];
        let loud = &ringing[trigger.min(ringing.len())..];
        if rms_about_mean(loud) > RISE * rms_about_mean(quiet)
            || rms_of_change(loud) > RISE * rms_of_change(quiet)
        {
            return Ok(true);
        }
        // A hit on a structure that still rings loudly may leave it no louder.
        if let Some((quiet, loud)) = unpredicted(ringing, turn, lag)
            && loud > RISE * quiet
        {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Stretch before the trigger from which the ringing is continued (s): two taps lie no nearer.
const CONTINUED: f64 = 0.2;
/// Distance of the past values from which the next one is predicted (s): a part of a period of the strong low modes,
/// so that noise on neighbouring samples does not hide their curvature.
const LAG: f64 = 1e-3;
/// Number of past values: two for each of eight oscillations.
const LAGS: usize = 16;

/// Root mean squares of what a linear prediction misses before the sample `turn`, from which its weights come, and
/// after it; `None` where there are too few samples.
///
/// A sum of n decaying oscillations is predicted exactly by 2 n equally spaced past values (de Prony 1795), whatever
/// its beats. A new hit breaks the prediction.
fn unpredicted(samples: &[f64], turn: usize, lag: usize) -> Option<(f64, f64)> {
    let reach = LAGS * lag;
    let rows = turn.checked_sub(reach).filter(|rows| *rows >= 4 * LAGS)?;
    let past = |row: usize| (1..=LAGS).map(move |k| samples[row - k * lag]);
    let mut normal = DMatrix::<f64>::zeros(LAGS, LAGS);
    let mut right = DVector::<f64>::zeros(LAGS);
    for (row, &value) in samples.iter().enumerate().take(turn).skip(reach) {
        let values = DVector::from_iterator(LAGS, past(row));
        normal.ger(1.0, &values, &values, 1.0);
        right.axpy(value, &values, 1.0);
    }
    // Fewer oscillations than the weights could follow leave the equations nearly singular.
    let trace = normal.trace();
    for k in 0..LAGS {
        normal[(k, k)] += 1e-12 * trace;
    }
    let weights = normal.cholesky()?.solve(&right);
    let misses = |rows: Range<usize>| -> f64 {
        let errors = rows.map(|row| {
            let predicted: f64 = past(row).zip(&weights).map(|(x, w)| x * w).sum();
            (samples[row] - predicted).powi(2)
        });
        errors.sum()
    };
    let before = misses(reach..turn) / (rows - LAGS) as f64;
    let after = misses(turn..samples.len()) / samples.len().saturating_sub(turn).max(1) as f64;
    Some((before.sqrt(), after.sqrt()))
}

/// rms of the second differences: it weighs high modes, which die first and which a new hit wakes
/// even while the low ones still ring loudly.
fn rms_of_change(samples: &[f64]) -> f64 {
    let change: Vec<f64> = samples
        .windows(3)
        .map(|x| x[2] - 2.0 * x[1] + x[0])
        .collect();
    root_mean_square(&change)
}

/// Root mean square about the mean; 0 of nothing.
fn rms_about_mean(samples: &[f64]) -> f64 {
    let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
    let about: Vec<f64> = samples.iter().map(|x| x - mean).collect();
    root_mean_square(&about)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Channel;
    use std::f64::consts::TAU;

    /// Force pulses of 2 ms at 1 and 2.2 s, and the decays that the `struck` ones wake: 60.4 and 155.4 Hz.
    fn taps(struck: &[f64], noise: f64) -> Taps {
        const RATE: f64 = 2048.0;
        let (mut force, mut response) = (vec![0.0; 8192], vec![0.0; 8192]);
        // A linear congruence is noise enough.
        let mut state = 1u32;
        for n in 0..8192 {
            let time = n as f64 / RATE;
            for hit in [1.0, 2.2] {
                let t = time - hit;
                if (0.0..2e-3).contains(&t) {
                    force[n] += (TAU * t / 4e-3).sin();
                }
                if t > 0.0 && struck.contains(&hit) {
                    for (frequency, damping, amplitude) in [(60.4, 5e-4, 1.0), (155.4, 5e-4, 0.3)] {
                        let omega = TAU * frequency;
                        response[n] += amplitude * (-damping * omega * t).exp() * (omega * t).sin();
                    }
                }
            }
            for samples in [&mut force, &mut response] {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                samples[n] += noise * (f64::from(state) / f64::from(u32::MAX) - 0.5);
            }
        }
        let channels = [force, response].map(|samples| Channel {
            samples,
            ..Channel::default()
        });
        let recording = Recording::from_samples("taps", RATE, channels.into()).unwrap();
        let source = TapSource::Hammer {
            channel: 0,
            responses: vec![1],
        };
        find_taps(&recording, &source, &TapSettings::default()).unwrap()
    }

    #[test]
    fn regress_a_hit_that_leaves_the_ringing_no_louder_is_a_tap() {
        for noise in [1e-3, 3e-2] {
            // After 1.2 s the modes keep 80 and 56 % of their amplitudes, and both are half a cycle off the second hit.
            let found = taps(&[1.0, 2.2], noise);
            let reasons: Vec<_> = found.taps.iter().map(|tap| &tap.rejection).collect();
            assert_eq!(reasons, [&None, &None], "noise {noise}");
            // Its record ends where the second begins, or the fit would take both hits for one decay.
            assert!(found.taps[0].record.end <= found.taps[1].record.start + 1);
            // A hammer laid down while the structure rings moves nothing.
            let found = taps(&[1.0], noise);
            assert_eq!(
                found.taps[1].rejection,
                Some(Rejection::NoResponse),
                "noise {noise}"
            );
        }
    }

    #[test]
    fn limit_oscillations_are_predicted_until_something_new_comes() {
        let rings = |n: usize| -> f64 {
            let waves = [(0.31, 1.0), (0.47, 0.5), (1.13, 0.2)];
            let at = |(omega, amplitude): &(f64, f64)| amplitude * (omega * n as f64).sin();
            (-1e-3 * n as f64).exp() * waves.iter().map(at).sum::<f64>()
        };
        let mut samples: Vec<f64> = (0..400).map(rings).collect();
        let (before, after) = unpredicted(&samples, 300, 2).unwrap();
        // The ridge of 10^-12 leaves some 10^-6 of the amplitude.
        assert!(before < 1e-4 && after < 1e-4, "{before} {after}");
        samples[320] += 0.01;
        let (before, after) = unpredicted(&samples, 300, 2).unwrap();
        assert!(after > 10.0 * before, "{before} {after}");
        assert_eq!(unpredicted(&samples, 90, 2), None);
    }
}
