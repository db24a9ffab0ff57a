//! Accepting and rejecting taps, each with its reason.
//!
//! Whether the structure answers a pulse of the force channel.

use std::ops::Range;

use super::double_hit::{SecondHit, second_hit};
use super::hammer::{Force, Hammer};
use super::{Event, Found, Rejection, Tap, TapSettings, TapSource, Taps};
use crate::recording::{Recording, RecordingError};
use tapjoint_numerics::stats::{median, root_mean_square};

/// A record shorter than this share of the median one is not worth shortening all others for.
const SHORT_OF_MEDIAN: f64 = 0.5;
/// A second hit is looked for so long after the first (s): longer than records usually last, and a bound
/// on memory.
const SEARCHED: f64 = 10.0;
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
    for (index, (event, record)) in found.events.iter().zip(records).enumerate() {
        let place = (index, &record);
        let force = force_of(recording, source, (&found, &answered), place, settings)?;
        let own_end = record.end.min(event.trigger + least(recording, settings));
        let pulse_end = force.as_ref().map(|f| f.pulse_end(event, f.index(own_end)));
        let second = force.and_then(|f| second_hit(&f, (event, f.index(own_end)), settings));
        let rejection = if !answered[index] {
            Some(Rejection::NoResponse)
        } else if event.peak < weakest {
            Some(Rejection::TooWeak {
                peak: event.peak,
                limit: weakest,
            })
        } else if let Some(double) = second.and_then(|second| double(second, settings)) {
            Some(double)
        } else {
            overload(recording, source, &record)?
        };
        taps.push(Tap {
            time: event.trigger as f64 / recording.sample_rate(),
            peak: event.peak,
            pulse_end,
            record,
            second_hit: second,
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

/// Least distance of two taps (frames).
fn least(recording: &Recording, settings: &TapSettings) -> u64 {
    (settings.least_distance * recording.sample_rate()) as u64
}

/// A second hit that is large enough to reject its tap.
fn double(second: SecondHit, settings: &TapSettings) -> Option<Rejection> {
    (second.ratio >= settings.double_hit).then_some(Rejection::DoubleHit {
        delay: second.delay,
        ratio: second.ratio,
        limit: settings.double_hit,
    })
}

/// The force over an event's record and ahead of it, as far as that belongs to no other event; `None`
/// without a hammer. What no sensor answers is taken out: no hit of the structure.
fn force_of(
    recording: &Recording,
    source: &TapSource,
    (found, answered): (&Found, &[bool]),
    (index, record): (usize, &Range<u64>),
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
    let (events, least) = (&found.events, least(recording, settings));
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
    let mut force = hammer.force(first..end.min(trigger + longest))?;
    let others = events.iter().zip(answered).enumerate();
    for (_, (other, _)) in others.filter(|(other, (_, answered))| *other != index && !**answered) {
        let range = force.index(other.trigger.saturating_sub(least / 100))
            ..force.index(other.trigger + least);
        force.samples[range].fill(0.0);
    }
    Ok(Some(force))
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

/// Stretch before and after the trigger that is compared (s): several periods of the lowest modes'
/// higher companions, short beside the time between taps.
const STRETCH: f64 = 0.05;
/// A tap raises the rms of some response by this factor at least; a weaker one rings on top of what
/// is still ringing and is of no use.
const RISE: f64 = 1.5;

/// Whether any response rises when the force does. A hammer laid down, a swinging hammer and an
/// electrical spike move no sensor. Without responses, or at the very start of the recording, the
/// benefit of the doubt is given.
pub(super) fn is_answered(
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
    let before = event.trigger - gap - stretch..event.trigger - gap;
    let after = event.trigger..event.trigger + stretch;
    for &response in responses {
        let quiet = recording.read(response, before.clone())?;
        let loud = recording.read(response, after.clone())?;
        let rises = |measure: fn(&[f64]) -> f64| measure(&loud) > RISE * measure(&quiet);
        if rises(rms_about_mean) || rises(rms_of_change) {
            return Ok(true);
        }
    }
    Ok(false)
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
