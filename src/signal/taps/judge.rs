//! Accepting and rejecting taps: each by itself, and those whose records are too short beside the others'.

use super::double_hit::{SecondHit, least_candidate, second_hit};
use super::pulse::Pulse;
use super::search::Force;
use super::{Event, Found, Overload, Rejection, Tap, TapSettings, TapSource};
use crate::recording::{Extremes, Recording, RecordingError};
use std::ops::Range;
use tapjoint_numerics::stats::median;

/// A record shorter than this share of the median one is not worth shortening all others for.
pub(super) const SHORT_OF_MEDIAN: f64 = 0.5;
/// A second hit is looked for so long after the first (s): longer than records usually last, and a bound
/// on memory.
const SEARCHED: f64 = 10.0;
/// The last record may be cut to this share of the shortest other one.
pub(super) const CUT_OF_SHORTEST: f64 = 0.8;

/// What is measured of one event, before it is judged.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Facts {
    /// Frame in which the force pulse has died away; `None` without a hammer.
    pulse_end: Option<u64>,
    pulse: Option<Pulse>,
    second_hit: Option<SecondHit>,
    overload: Option<Overload>,
    /// Swing of each response in the first half of the record (its unit); empty of a short record.
    swings: Vec<f64>,
}

/// Frames of an event's record. It ends with the pre-trigger of the next tap, or with the file.
pub(super) fn record_of(
    recording: &Recording,
    found: &Found,
    index: usize,
    weakest: f64,
    settings: &TapSettings,
) -> Range<u64> {
    let events = &found.events;
    let before = ((settings.pre_trigger * recording.sample_rate()) as u64).max(16);
    let mut later = events.iter().skip(index + 1);
    let next = later.find(|next| next.is_hit(weakest));
    // Taps that the hammer does not show end a record, too.
    let next = next.map(|next| next.trigger).or(found.unheard);
    let end = next.map_or(recording.frames(), |next| next.saturating_sub(before));
    let start = events[index].trigger.saturating_sub(before);
    start..end.max(start)
}

/// Measures one event in its record.
pub(super) fn facts(
    recording: &Recording,
    source: &TapSource,
    found: &Found,
    index: usize,
    record: &Range<u64>,
    settings: &TapSettings,
) -> Result<Facts, RecordingError> {
    let event = &found.events[index];
    let least = settings.least_distance_in(recording);
    let mut facts = Facts {
        pulse_end: None,
        pulse: None,
        second_hit: None,
        overload: overload(recording, source, record)?,
        swings: Vec::new(),
    };
    // The second half may hold a glitch of a dead sensor. A short record ends before the sensors answer.
    let first_half = record.start..record.start.midpoint(record.end);
    if first_half.end >= event.trigger + (ANSWERED_WITHIN * recording.sample_rate()) as u64 {
        for &channel in source.responses() {
            facts
                .swings
                .push(swing(recording, channel, first_half.clone())?);
        }
    }
    if let Some(force) = force_of(recording, source, found, index, record, settings)? {
        let own = force.index(record.end.min(event.trigger + least));
        let end = force.pulse_end(event, own);
        let start = force.index(record.start);
        let about = start..force.index(end).max(start);
        facts.pulse = Pulse::of(&force.samples[about], force.noise, recording.sample_rate());
        facts.pulse_end = Some(end);
        facts.second_hit = second_hit(&force, event, own, settings);
    }
    Ok(facts)
}

/// Swing of a channel that answers taps, in its smallest steps. 64: a tap of a tenth of the usual peak still moves it by several.
const LEAST_SWING: f64 = 64.0;

/// Time after the trigger by which a sensor answers (s). 50 ms: sound passes 15 m of air in it.
const ANSWERED_WITHIN: f64 = 0.05;

/// Returns which responses answer taps in a recording. The others were not connected, or hear nothing. `facts` are those of
/// the events that are answered.
pub(super) fn answering<'a>(
    recording: &Recording,
    source: &TapSource,
    facts: impl Iterator<Item = &'a Facts>,
) -> Vec<usize> {
    let responses = source.responses();
    let mut largest = vec![0.0; responses.len()];
    for own in facts {
        for (largest, swing) in largest.iter_mut().zip(&own.swings) {
            *largest = f64::max(*largest, *swing);
        }
    }
    let mut answering = Vec::new();
    for (&channel, swing) in responses.iter().zip(largest) {
        let info = recording.channels().get(channel);
        if info.is_some_and(|info| swing >= LEAST_SWING * info.health.step) {
            answering.push(channel);
        }
    }
    answering
}

/// Highest less lowest value of a channel in a stretch (its unit). It is exact where it is 0. Otherwise the ends of the stretch may
/// be left out.
pub(super) fn swing(
    recording: &Recording,
    channel: usize,
    stretch: Range<u64>,
) -> Result<f64, RecordingError> {
    let outline = recording.outline(channel).unwrap_or_default();
    let pieces = outline.pieces_of(stretch.clone());
    // The first and the last piece may hold other samples.
    let inner = pieces.start + 1..pieces.end.saturating_sub(1);
    let inner = outline.pieces.get(inner).unwrap_or_default().iter();
    let inner = inner.fold(Extremes::NONE, |all, piece| all.with(*piece));
    if inner.low < inner.high {
        return Ok(inner.high - inner.low);
    }
    let all = Extremes::of(&recording.read(channel, stretch)?);
    Ok((all.high - all.low).max(0.0))
}

/// Returns the channel (0-based) among those that answer taps that gives no signal in the first half of a tap's record, or
/// stops there and gives none at the `next` tap of the file.
pub(super) fn stopped(
    recording: &Recording,
    source: &TapSource,
    answering: &[usize],
    record: &Range<u64>,
    own: &Facts,
    next: Option<&Facts>,
) -> Option<usize> {
    let still = |facts: &Facts| {
        let swings = source.responses().iter().zip(&facts.swings);
        let still = swings.filter(|(channel, swing)| **swing == 0.0 && answering.contains(channel));
        still.map(|(channel, _)| *channel).collect::<Vec<_>>()
    };
    if let Some(channel) = still(own).first() {
        return Some(*channel);
    }
    let middle = record.start.midpoint(record.end);
    let stops = |channel: &usize| {
        let health = recording.channels().get(*channel).map(|info| &info.health);
        let runs = health
            .into_iter()
            .flat_map(|own| own.dropped.iter().chain(&own.stopped));
        let mut runs = runs.map(|run| run.start..run.start + run.len);
        runs.any(|run| run.start < middle && record.end <= run.end)
    };
    still(next?).into_iter().find(stops)
}

/// Judges one event. `stopped` is a channel (0-based) that gives no signal in its record, if there is one. Peaks below `weakest`
/// are too weak. `rate` is the sample rate (Hz).
pub(super) fn judge(
    event: &Event,
    record: Range<u64>,
    facts: &Facts,
    stopped: Option<usize>,
    weakest: f64,
    rate: f64,
    settings: &TapSettings,
) -> Tap {
    let double = facts.second_hit;
    let fault = match double.filter(|double| double.ratio >= settings.double_hit) {
        _ if !event.answered => Some(Rejection::NoResponse),
        _ if event.peak < weakest => Some(Rejection::TooWeak {
            peak: event.peak,
            limit: weakest,
        }),
        _ if stopped.is_some() => stopped.map(|channel| Rejection::Stopped {
            channel: channel + 1,
        }),
        Some(double) => Some(Rejection::DoubleHit {
            delay: double.delay,
            ratio: double.ratio,
            limit: settings.double_hit,
        }),
        None => None,
    };
    let overload = facts.overload.filter(|_| fault.is_none() || event.by_hand);
    let (rejection, overruled) = match event.by_hand {
        true => (None, fault),
        false => (fault.or(overload.map(Rejection::Overload)), None),
    };
    let is_known = overload.is_none_or(|overload| !overload.is_force);
    Tap {
        file: None,
        time: event.trigger as f64 / rate,
        peak: event.peak,
        pulse_end: facts.pulse_end,
        pulse: facts.pulse.filter(|_| is_known),
        record,
        second_hit: facts.second_hit,
        overload,
        rejection,
        overruled,
    }
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
    let least = settings.least_distance_in(recording);
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
pub(super) fn reject_short(
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
    let needed = SHORT_OF_MEDIAN * wanted.map_or(typical, |wanted| wanted.min(typical));
    for (index, tap) in taps.iter_mut().enumerate() {
        let available = tap.frames() as f64 / rate;
        // Equal only where there is nothing at all: taps nearer than the pre-trigger of a slow file.
        if tap.accepted() && Some(index) != going_on && available <= needed {
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
    let needed = CUT_OF_SHORTEST * wanted.map_or(shortest, |wanted| wanted.min(shortest));
    for &last in lasts.iter().filter(|last| Some(**last) != going_on) {
        let tap = &mut taps[last];
        let available = tap.frames() as f64 / rate;
        if tap.accepted() && tap.is_whole() && needed.is_finite() && available < needed {
            tap.rejection = Some(Rejection::CutOff { available, needed });
        }
    }
}
