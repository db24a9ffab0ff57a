//! Finding taps: a tap is a view into the recording, accepted or rejected with a reason.
//!
//! With a hammer channel, taps are pulses of force above its noise ([`find_taps`] with
//! [`TapSource::Hammer`]); without one they are sudden rises of the responses. Both scan the
//! recording block by block. A tap's record begins a little before the trigger and ends where the
//! next tap comes.

mod answered;
mod by_hand;
mod double_hit;
mod judge;
mod memo;
mod pulse;
mod search;

pub use by_hand::{REACH, TapsByHand};
pub use double_hit::SecondHit;
pub use memo::TapMemo;
pub use pulse::{FORCE_OVER_NOISE, Pulse};

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use crate::recording::{Recording, RecordingError};
use judge::{CUT_OF_SHORTEST, SHORT_OF_MEDIAN, answering, reject_short};
use search::Survey;
use tapjoint_numerics::stats::median;

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
    /// The channels of the responses.
    pub fn responses(&self) -> &[usize] {
        let (TapSource::Hammer { responses, .. } | TapSource::Responses(responses)) = self;
        responses
    }

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

impl TapSettings {
    /// Least distance of two taps (frames).
    fn least_distance_in(&self, recording: &Recording) -> u64 {
        (self.least_distance * recording.sample_rate()) as u64
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
        let unit = if *samples == 1 { "sample" } else { "samples" };
        write!(f, "channel {channel} is at its limit for {samples} {unit}")
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
    /// A sensor gives no signal, which it gives elsewhere, while another one answers.
    Stopped {
        /// Its channel, 1-based.
        channel: usize,
    },
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
        /// Least length (s).
        needed: f64,
    },
    /// The next tap comes before the record is long enough.
    NextTooSoon {
        /// Length recorded (s).
        available: f64,
        /// Least length (s).
        needed: f64,
    },
    /// Its response departs from that of the other taps.
    Inconsistent {
        /// Departure from the median of the others, relative to the response (1).
        departure: f64,
        /// Median departure of the others (1).
        others: f64,
        /// Limit of the departure (1).
        limit: f64,
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
            Rejection::Stopped { channel } => {
                write!(
                    f,
                    "channel {channel} gives no signal: its samples do not change"
                )
            }
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
            Rejection::Inconsistent {
                departure,
                others,
                limit,
            } => write!(
                f,
                "inconsistent: its response differs by {:.0} % from that of the other taps, which differ by {:.0} % \
                 (limit {:.0} %)",
                100.0 * departure,
                100.0 * others,
                100.0 * limit
            ),
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
    /// The hammer gives no signal any more, and the responses show more taps.
    SilentHammer {
        /// Time of its last change (s).
        time: f64,
        /// Number of rises of the responses after that.
        rises: usize,
    },
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
            TapRemark::SilentHammer { time, rises } => write!(
                f,
                "the hammer gives no signal from {time:.2} s of its file on. The responses rise {rises} times after that. These may be \
                 taps that it does not show. Check the hammer and its cable, and record again"
            ),
            TapRemark::LongExcursion { count } => write!(
                f,
                "the force stayed up for more than 50 ms {count} time(s), longer than any hammer pulse; \
                 that was left out: a moved cable, a hand on the hammer, or the wrong channel"
            ),
            TapRemark::OverloadKept { count } => write!(
                f,
                "taps that drove a channel to its limit: {count}; their decays are used after the last sample that was cut off; \
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
    /// Length of record (s) from which on the tap at this place counts if the recording ends with it, by those before it; 0 of
    /// the first one. `rate` is the sample rate (Hz), and `wanted` what the block needs (s), where one is given. The judge
    /// may ask for less: its median holds the tap itself.
    pub fn needed_of_last(&self, place: usize, rate: f64, wanted: Option<f64>) -> f64 {
        let pairs = self.taps.iter().zip(self.taps.iter().skip(1)).take(place);
        let accepted = pairs.filter(|(tap, _)| tap.accepted());
        // The last one of a file may be cut off.
        let (mut all, mut shortest) = (Vec::new(), f64::INFINITY);
        for (tap, next) in accepted {
            let length = tap.frames() as f64 / rate;
            all.push(length);
            if tap.file == next.file {
                shortest = shortest.min(length);
            }
        }
        if all.is_empty() {
            return 0.0;
        }
        let wanted = wanted.unwrap_or(f64::INFINITY);
        let by_median = SHORT_OF_MEDIAN * wanted.min(median(&mut all));
        match shortest.is_finite() {
            true => by_median.max(CUT_OF_SHORTEST * wanted.min(shortest)),
            false => by_median,
        }
    }

    /// Those that enter the averages.
    pub fn accepted(&self) -> impl Iterator<Item = &Tap> {
        self.taps.iter().filter(|tap| tap.accepted())
    }

    /// Number of double hits and of taps that no sensor answers. Many of them come of a wrong hammer channel.
    pub fn odd(&self) -> usize {
        use Rejection::{DoubleHit, NoResponse};
        let is_odd = |tap: &&Tap| matches!(tap.rejection, Some(DoubleHit { .. } | NoResponse));
        self.taps.iter().filter(is_odd).count()
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
#[derive(Debug, Clone)]
struct Found {
    events: Vec<Event>,
    noise: f64,
    /// Survey of the force channel, where there is one.
    survey: Option<Survey>,
    /// Frame at which the responses rise first once the hammer gives no signal; `None` where it gives one to the end.
    unheard: Option<u64>,
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
    find_taps_again(recording, source, settings, &mut TapMemo::default())
}

/// Finds the taps of a recording that has grown since the last call, as [`find_taps`] does. `memo` holds what was
/// found before, of the same recording by the same settings. What was measured of a tap then is not measured again, although
/// the noise about it may have become a little other since; a call with a new memo measures all of it.
///
/// # Errors
/// Those of [`find_taps`].
pub fn find_taps_again(
    recording: &Recording,
    source: &TapSource,
    settings: &TapSettings,
    memo: &mut TapMemo,
) -> Result<Taps, RecordingError> {
    let parts: Vec<(u64, &Recording)> = recording.parts().collect();
    let joined = !parts.is_empty();
    let parts = if joined { parts } else { vec![(0, recording)] };
    let mut searched = Vec::new();
    let last = parts.len() - 1;
    for (number, (start, file)) in parts.into_iter().enumerate() {
        let found = memo.part(number).search(file, source, settings)?;
        if number < last {
            memo.part(number).has_ended();
        }
        searched.push((start, file, found));
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
    let mut remarks = Vec::new();
    if !settings.by_hand.accept.is_empty() {
        let found = searched.iter_mut();
        let mut files: Vec<&mut [Event]> = found
            .map(|(.., found)| &mut Arc::make_mut(found).events[..])
            .collect();
        remarks = settings.by_hand.mark(&mut files, &starts, rate);
    }
    for (number, (_, file, found)) in searched.iter().enumerate() {
        memo.part(number)
            .measure(file, source, found, weakest, settings)?;
    }
    let numbered = searched.iter().zip(memo.parts());
    let measured = numbered.flat_map(|((.., found), part)| part.answered_facts(found));
    let answering = answering(recording, source, measured);
    let mut taps = Vec::with_capacity(peaks.len());
    // Last tap of each file.
    let mut lasts = Vec::new();
    let mut quiet = 0..0;
    for (number, (start, file, found)) in searched.iter().enumerate() {
        let before = taps.len();
        let judged = memo
            .part(number)
            .judge(file, source, found, &answering, weakest, settings);
        for mut tap in judged {
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
    // A record does not go on in the next file.
    let last_file = searched.last().map_or(0, |(start, ..)| *start);
    let last = taps.len().checked_sub(1).filter(|_| settings.is_growing);
    let going_on = last.filter(|last| taps[*last].record.end > last_file);
    reject_short(&mut taps, &lasts, going_on, rate, settings.wanted);
    remarks.extend(settings.by_hand.still_rejected(&taps));
    let mut noise = 0.0_f64;
    for (_, file, found) in searched {
        noise = noise.max(found.noise);
        for remark in &found.remarks {
            if !remarks.contains(remark) {
                remarks.push(remark.clone());
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
}
