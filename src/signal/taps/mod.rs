//! Finding taps: a tap is a view into the recording, accepted or rejected with a reason.
//!
//! With a hammer channel, taps are pulses of force above its noise ([`find_taps`] with
//! [`TapSource::Hammer`]); without one they are sudden rises of the responses. Both scan the
//! recording block by block. A tap's record begins a little before the trigger and ends where the
//! next tap comes.

mod double_hit;
mod hammer;
mod judge;
mod response;

pub use double_hit::SecondHit;

use std::fmt;
use std::ops::Range;

use crate::recording::{Recording, RecordingError};

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
#[derive(Debug, Clone, Copy, PartialEq)]
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
        }
    }
}

/// One tap.
#[derive(Debug, Clone, PartialEq)]
pub struct Tap {
    /// Time of the trigger (s from the start of the recording).
    pub time: f64,
    /// Peak of the force (N), or of the response on which the tap was found (its unit).
    pub peak: f64,
    /// Frame in which the force pulse, its ringing included, has died away; `None` without a hammer.
    pub pulse_end: Option<u64>,
    /// Frames of its record: a little before the trigger to where the next tap comes.
    pub record: Range<u64>,
    /// A second hit within the record, from [`TapSettings::double_hit_warning`] of the peak up; `None`
    /// without one, and without a hammer, where it cannot be told from two modes that beat.
    pub second_hit: Option<SecondHit>,
    /// Reason why it does not enter the averages; `None` = accepted.
    pub rejection: Option<Rejection>,
}

impl Tap {
    /// Returns `true` for a tap that enters the averages.
    pub fn accepted(&self) -> bool {
        self.rejection.is_none()
    }

    /// Length of its record (frames).
    pub fn frames(&self) -> u64 {
        self.record.end - self.record.start
    }
}

/// Reason why a tap is rejected.
#[derive(Debug, Clone, PartialEq)]
pub enum Rejection {
    /// The hammer hit twice.
    DoubleHit {
        /// Time between the two (s).
        delay: f64,
        /// The smaller peak over the larger.
        ratio: f64,
        /// Limit of that ratio.
        limit: f64,
    },
    /// A channel was driven to its limit.
    Overload {
        /// Channel, 1-based.
        channel: usize,
        /// Samples at the limit.
        samples: usize,
    },
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
            Rejection::Overload { channel, samples } => {
                write!(
                    f,
                    "overload: channel {channel} is at its limit for {samples} samples"
                )
            }
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
        }
    }
}

/// Oddity of the search itself.
#[derive(Debug, Clone, Copy, PartialEq)]
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

    /// Frames before the first tap: noise, hum, and perhaps the hammer being picked up.
    pub fn quiet(&self) -> Range<u64> {
        0..self.taps.first().map_or(0, |tap| tap.record.start)
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
}

/// Finds the taps of a recording.
///
/// # Errors
/// Those of reading the recording.
pub fn find_taps(
    recording: &Recording,
    source: &TapSource,
    settings: &TapSettings,
) -> Result<Taps, RecordingError> {
    let found = match source {
        TapSource::Hammer { channel, .. } => hammer::find(recording, *channel, settings)?,
        TapSource::Responses(channels) => response::find(recording, channels, settings)?,
    };
    judge::judge(recording, source, found, settings)
}

/// Result of a search, before it is judged.
struct Found {
    events: Vec<Event>,
    noise: f64,
    /// Survey of the force channel, where there is one.
    survey: Option<hammer::Survey>,
    remarks: Vec<TapRemark>,
}
