//! Accepting and rejecting taps, each with its reason.

use std::ops::Range;

use super::answer::is_answered;
use super::hammer::Survey;
use super::{Event, Found, Rejection, Tap, TapSettings, TapSource, Taps};
use crate::recording::{Recording, RecordingError};
use crate::stats::median;

/// A record shorter than this share of the median one is not worth shortening all others for.
const SHORT_OF_MEDIAN: f64 = 0.5;
/// The last record may be cut to this share of the shortest other one.
const CUT_OF_SHORTEST: f64 = 0.8;

/// Judges the events found.
pub(super) fn judge(
    recording: &Recording,
    source: &TapSource,
    found: Found,
    settings: &TapSettings,
) -> Result<Taps, RecordingError> {
    let answered = answers(recording, source, &found.events)?;
    let real = |(event, answered): (&Event, &bool)| answered.then_some(event.peak);
    let mut peaks: Vec<f64> = found
        .events
        .iter()
        .zip(&answered)
        .filter_map(real)
        .collect();
    let weakest = settings.weak * median(&mut peaks);
    let counts: Vec<bool> = found
        .events
        .iter()
        .zip(&answered)
        .map(|(event, &answered)| answered && event.peak >= weakest)
        .collect();
    let records = records(recording, (&found.events, &counts), settings);
    let mut taps = Vec::with_capacity(found.events.len());
    for ((event, record), answered) in found.events.iter().zip(records).zip(answered) {
        let force = force_about(recording, source, &found, event, settings)?;
        let weak = Rejection::TooWeak {
            peak: event.peak,
            limit: weakest,
        };
        let rejection = if !answered {
            Some(Rejection::NoResponse)
        } else if event.peak < weakest {
            Some(weak)
        } else if let Some(double) = force.as_ref().and_then(|f| f.double_hit(event, settings)) {
            Some(double)
        } else {
            overload(recording, source, &record)?
        };
        taps.push(Tap {
            time: event.trigger as f64 / recording.sample_rate(),
            peak: event.peak,
            pulse_end: force.map(|force| force.pulse_end(event)),
            record,
            rejection,
        });
    }
    reject_short(&mut taps, recording.sample_rate(), settings.wanted);
    Ok(Taps {
        taps,
        noise: found.noise,
        remarks: found.remarks,
    })
}

/// Whether a sensor answers each event; without a hammer the answer is the event.
fn answers(
    recording: &Recording,
    source: &TapSource,
    events: &[Event],
) -> Result<Vec<bool>, RecordingError> {
    match source {
        TapSource::Hammer { responses, .. } => events
            .iter()
            .map(|event| is_answered(recording, responses, event))
            .collect(),
        TapSource::Responses(_) => Ok(vec![true; events.len()]),
    }
}

/// The force about an event; `None` without a hammer.
fn force_about(
    recording: &Recording,
    source: &TapSource,
    found: &Found,
    event: &Event,
    settings: &TapSettings,
) -> Result<Option<Force>, RecordingError> {
    let (TapSource::Hammer { channel, .. }, Some(survey)) = (source, &found.survey) else {
        return Ok(None);
    };
    let hammer = Hammer {
        recording,
        channel: *channel,
        survey,
    };
    hammer.force(event, settings).map(Some)
}

/// Each event's record: from the pre-trigger to that of the next event that `counts`, or the file's
/// end. What moves no sensor, or stays below a tenth of the usual tap, disturbs a record no more than
/// is tolerated of a second excursion, and does not end it.
fn records(
    recording: &Recording,
    (events, counts): (&[Event], &[bool]),
    settings: &TapSettings,
) -> Vec<Range<u64>> {
    let before = ((settings.pre_trigger * recording.sample_rate()) as u64).max(16);
    let start = |event: &Event| event.trigger.saturating_sub(before);
    let record = |(index, event): (usize, &Event)| {
        let mut later = events.iter().zip(counts).skip(index + 1);
        let next = later.find(|(_, counts)| **counts);
        let end = next.map_or(recording.frames(), |(next, _)| start(next));
        start(event)..end.max(start(event))
    };
    events.iter().enumerate().map(record).collect()
}

/// One excursion of the force above the double-hit limit.
struct Excursion {
    frame: usize,
    peak: f64,
}

/// The hammer channel, with its drift and noise.
struct Hammer<'a> {
    recording: &'a Recording,
    channel: usize,
    survey: &'a Survey,
}

impl Hammer<'_> {
    /// The force about an event, drift taken out, pulses upwards: from a little before the trigger
    /// to the least distance of the next tap.
    fn force(&self, event: &Event, settings: &TapSettings) -> Result<Force, RecordingError> {
        let rate = self.recording.sample_rate();
        let first = event.trigger.saturating_sub((2e-3 * rate) as u64 + 8);
        let last = event.trigger + (settings.least_distance * rate) as u64;
        let samples = self.recording.read(self.channel, first..last)?;
        let drift = |frame: usize| self.survey.baseline.at(first + frame as u64);
        let samples = samples
            .iter()
            .enumerate()
            .map(|(i, x)| self.survey.polarity * (x - drift(i)))
            .collect();
        Ok(Force {
            first,
            samples,
            noise: self.survey.noise,
            rate,
        })
    }
}

/// The force about one event.
struct Force {
    /// Frame of the first sample.
    first: u64,
    samples: Vec<f64>,
    noise: f64,
    rate: f64,
}

impl Force {
    /// Looks for a second excursion above `double_hit` of the peak after the force has fallen below
    /// `rearm` of it.
    fn double_hit(&self, event: &Event, settings: &TapSettings) -> Option<Rejection> {
        let limit = (settings.double_hit * event.peak).max(6.0 * self.noise);
        let rearm = (settings.rearm * event.peak).max(3.0 * self.noise);
        let excursions = excursions(&self.samples, limit, rearm);
        let main = excursions.iter().max_by(|a, b| a.peak.total_cmp(&b.peak))?;
        excursions
            .iter()
            .filter(|other| other.frame != main.frame && !is_ringing(&self.samples, main, other))
            .max_by(|a, b| a.peak.total_cmp(&b.peak))
            .map(|second| Rejection::DoubleHit {
                delay: main.frame.abs_diff(second.frame) as f64 / self.rate,
                ratio: second.peak / main.peak,
                limit: settings.double_hit,
            })
    }

    /// Frame after which the force stays within its noise, or 1 % of its peak, for a millisecond.
    fn pulse_end(&self, event: &Event) -> u64 {
        let limit = (4.0 * self.noise).max(0.01 * event.peak);
        let rest = ((1e-3 * self.rate) as usize).max(8);
        let start = (event.trigger - self.first.min(event.trigger)) as usize;
        let mut calm = 0;
        for (index, force) in self.samples.iter().enumerate().skip(start) {
            calm = if force.abs() < limit { calm + 1 } else { 0 };
            if calm == rest {
                return self.first + (index + 1 - rest) as u64;
            }
        }
        self.first + self.samples.len() as u64
    }
}

fn excursions(force: &[f64], limit: f64, rearm: f64) -> Vec<Excursion> {
    let mut found: Vec<Excursion> = Vec::new();
    let mut armed = true;
    for (frame, &x) in force.iter().enumerate() {
        if armed && x > limit {
            found.push(Excursion { frame, peak: x });
            armed = false;
        } else if !armed && x < rearm {
            armed = true;
        } else if let Some(open) = found.last_mut().filter(|open| !armed && x > open.peak) {
            *open = Excursion { frame, peak: x };
        }
    }
    found
}

/// An anti-alias filter rings around a short pulse, swinging as far down as up; a hammer never
/// pulls. An excursion right beside a comparable downward swing is such ringing: within twice its own
/// width, or three samples, on the side of the pulse.
fn is_ringing(force: &[f64], main: &Excursion, other: &Excursion) -> bool {
    let above = |frame: &usize| force.get(*frame).is_some_and(|&x| x > 0.5 * other.peak);
    let width = (other.frame..).take_while(above).count()
        + (0..other.frame).rev().take_while(above).count();
    let reach = (2 * width).max(3).min(main.frame.abs_diff(other.frame));
    let beside = if main.frame < other.frame {
        other.frame - reach..other.frame
    } else {
        other.frame..other.frame + reach
    };
    let lowest = force
        .get(beside)
        .into_iter()
        .flatten()
        .copied()
        .fold(0.0, f64::min);
    -lowest > 0.5 * other.peak
}

/// Samples at a channel's limit: at the integer format's full scale, or at the level of its flat
/// tops.
fn overload(
    recording: &Recording,
    source: &TapSource,
    record: &Range<u64>,
) -> Result<Option<Rejection>, RecordingError> {
    for channel in source.channels() {
        let Some((low, high)) = limits(recording, channel) else {
            continue;
        };
        let samples = recording.read(channel, record.clone())?;
        let count = samples.iter().filter(|&&x| x >= high || x <= low).count();
        if count > 0 {
            return Ok(Some(Rejection::Overload {
                channel: channel + 1,
                samples: count,
            }));
        }
    }
    Ok(None)
}

/// The levels at which a channel is cut off; `None` where it never was.
fn limits(recording: &Recording, channel: usize) -> Option<(f64, f64)> {
    let health = &recording.channels().get(channel)?.health;
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for top in &health.flat_tops {
        if top.value > health.mean {
            high = high.min(top.value);
        } else {
            low = low.max(top.value);
        }
    }
    if health.full_scale_samples > 0 {
        high = high.min(health.peak);
        low = low.max(-health.peak);
    }
    // A hair inside, so that rescaling by a unit cannot make a flat top slip through.
    let hair = 1e-9 * health.peak;
    (high.is_finite() || low.is_finite()).then_some((low + hair, high - hair))
}

/// Rejects records much shorter than the others: all averages share one block, and the shortest
/// record sets its length.
fn reject_short(taps: &mut [Tap], rate: f64, wanted: Option<f64>) {
    let last = taps.len().saturating_sub(1);
    let mut lengths: Vec<f64> = taps
        .iter()
        .filter(|tap| tap.accepted())
        .map(|tap| tap.frames() as f64 / rate)
        .collect();
    let typical = median(&mut lengths);
    let needed = wanted.map_or(typical, |wanted| wanted.min(typical));
    for (index, tap) in taps
        .iter_mut()
        .enumerate()
        .filter(|(_, tap)| tap.rejection.is_none())
    {
        let available = tap.frames() as f64 / rate;
        // Equal only where there is nothing at all: taps nearer than the pre-trigger of a slow file.
        if available <= SHORT_OF_MEDIAN * needed {
            tap.rejection = Some(if index == last {
                Rejection::CutOff { available, needed }
            } else {
                Rejection::NextTooSoon { available, needed }
            });
        }
    }
    let shortest = taps[..last]
        .iter()
        .filter(|tap| tap.accepted())
        .map(|tap| tap.frames() as f64 / rate)
        .fold(f64::INFINITY, f64::min);
    let needed = wanted.map_or(shortest, |wanted| wanted.min(shortest));
    if let Some(tap) = taps.last_mut().filter(|tap| tap.rejection.is_none()) {
        let available = tap.frames() as f64 / rate;
        if needed.is_finite() && available < CUT_OF_SHORTEST * needed {
            tap.rejection = Some(Rejection::CutOff { available, needed });
        }
    }
}
