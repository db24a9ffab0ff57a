//! Accepting and rejecting taps, each with its reason.

use std::ops::Range;

use super::double_hit::second_hit;
use super::hammer::Force;
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
    mut found: Found,
    settings: &TapSettings,
) -> Result<Taps, RecordingError> {
    if let TapSource::Hammer { responses, .. } = source {
        for event in &mut found.events {
            event.answered = is_answered(recording, responses, event)?;
        }
    }
    let real = found.events.iter().filter(|event| event.answered);
    let mut peaks: Vec<f64> = real.map(|event| event.peak).collect();
    let weakest = settings.weak * median(&mut peaks);
    let mut taps = Vec::with_capacity(found.events.len());
    for index in 0..found.events.len() {
        taps.push(tap(recording, source, &found, index, weakest, settings)?);
    }
    reject_short(&mut taps, recording.sample_rate(), settings.wanted);
    Ok(Taps {
        taps,
        noise: found.noise,
        remarks: found.remarks,
    })
}

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
    // The record ends with the pre-trigger of the next tap, or with the file. What moves no sensor, or stays below a
    // tenth of the usual tap, disturbs a record no more than is tolerated of a second excursion, and does not end it.
    let before = ((settings.pre_trigger * rate) as u64).max(16);
    let mut later = found.events.iter().skip(index + 1);
    let next = later.find(|next| next.answered && next.peak >= weakest);
    let end = next.map_or(recording.frames(), |next| {
        next.trigger.saturating_sub(before)
    });
    let start = event.trigger.saturating_sub(before);
    let record = start..end.max(start);
    // Least distance of two taps (frames).
    let least = (settings.least_distance * rate) as u64;
    let (mut pulse_end, mut second) = (None, None);
    if let Some(force) = force_of(recording, source, found, index, &record, least)? {
        let own = force.index(record.end.min(event.trigger + least));
        pulse_end = Some(force.pulse_end(event, own));
        second = second_hit(&force, event, own, settings);
    }
    let rejection = match second.filter(|second| second.ratio >= settings.double_hit) {
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
        None => overload(recording, source, &record)?,
    };
    Ok(Tap {
        time: event.trigger as f64 / rate,
        peak: event.peak,
        pulse_end,
        record,
        second_hit: second,
        rejection,
    })
}

/// The force over an event's record and ahead of it, as far as that belongs to no other event; `None`
/// without a hammer. `least` is the least distance of two taps (frames). Pulses that no sensor answers are taken out:
/// they are no hits of the structure.
fn force_of(
    recording: &Recording,
    source: &TapSource,
    found: &Found,
    index: usize,
    record: &Range<u64>,
    least: u64,
) -> Result<Option<Force>, RecordingError> {
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
    let frames = first..end.min(trigger + longest);
    let mut force = Force::read(recording, *channel, survey, frames)?;
    for (other, event) in events.iter().enumerate() {
        if other != index && !event.answered {
            let start = force.index(event.trigger.saturating_sub(least / 100));
            let end = force.index(event.trigger + least);
            force.samples[start..end].fill(0.0);
        }
    }
    Ok(Some(force))
}

/// Samples at a channel's limit: at the integer format's full scale, or at the level of its flat
/// tops.
fn overload(
    recording: &Recording,
    source: &TapSource,
    record: &Range<u64>,
) -> Result<Option<Rejection>, RecordingError> {
    for channel in source.channels() {
        let Some(info) = recording.channels().get(channel) else {
            continue;
        };
        let health = &info.health;
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
        if low.is_infinite() && high.is_infinite() {
            continue;
        }
        // A hair inside, so that rescaling by a unit cannot make a flat top slip through.
        let hair = 1e-9 * health.peak;
        let (low, high) = (low + hair, high - hair);
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
    for (index, tap) in taps.iter_mut().enumerate() {
        let available = tap.frames() as f64 / rate;
        // Equal only where there is nothing at all: taps nearer than the pre-trigger of a slow file.
        if tap.accepted() && available <= SHORT_OF_MEDIAN * needed {
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
    if let Some(tap) = taps.last_mut().filter(|tap| tap.accepted()) {
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

/// Returns `true` where any response rises when the force does. A hammer laid down, a swinging hammer and an
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
    let before = event.trigger - gap - stretch..event.trigger - gap;
    let after = event.trigger..event.trigger + stretch;
    for &response in responses {
        let quiet = recording.read(response, before.clone())?;
        let loud = recording.read(response, after.clone())?;
        if rms_about_mean(&loud) > RISE * rms_about_mean(&quiet)
            || rms_of_change(&loud) > RISE * rms_of_change(&quiet)
        {
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
