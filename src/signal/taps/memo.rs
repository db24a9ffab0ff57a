//! What was found of a growing recording before, so that a look at it costs little.

use super::answered::is_answered;
use super::judge::{Facts, facts, judge, record_of, stopped, swing};
use super::search::{SurveyedPiece, find_pulses, find_rises};
use super::{Found, Tap, TapRemark, TapSettings, TapSource};
use crate::recording::{Recording, RecordingError};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Bound::{Excluded, Unbounded};
use std::ops::Range;
use std::sync::Arc;

/// What was measured of a tap holds while the channel's noise is the same within this share. 10 %: a second hit is judged
/// by limits of 4 and 10 % of the peak, far above the noise of a tap that counts.
const SAME_NOISE: f64 = 0.1;

/// What was found of a recording before.
#[derive(Debug, Default)]
pub struct TapMemo {
    parts: Vec<PartMemo>,
}

impl TapMemo {
    /// What was found of each file.
    pub(super) fn parts(&self) -> &[PartMemo] {
        &self.parts
    }

    /// Returns what was found of a file (0-based).
    pub(super) fn part(&mut self, number: usize) -> &mut PartMemo {
        if self.parts.len() <= number {
            self.parts.resize_with(number + 1, PartMemo::default);
        }
        &mut self.parts[number]
    }
}

/// What was found of one file.
#[derive(Debug, Default)]
pub(super) struct PartMemo {
    /// Frames of the file and its events; a file that has not grown has the same.
    found: Option<(u64, Arc<Found>)>,
    /// Pieces of the force channel, by their numbers.
    pieces: BTreeMap<u64, SurveyedPiece>,
    /// Whether a sensor answers the event at a frame.
    answered: BTreeMap<u64, bool>,
    /// What was measured of events, and the conditions that it holds for.
    facts: BTreeMap<Place, Facts>,
    conditions: Option<Conditions>,
}

/// Frames of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    trigger: u64,
    /// Trigger of the event before.
    before: Option<u64>,
    /// Its record.
    start: u64,
    end: u64,
}

impl Place {
    fn record(self) -> Range<u64> {
        self.start..self.end
    }
}

/// What the measurements of all events depend on.
#[derive(Debug, Clone, PartialEq)]
struct Conditions {
    noise: f64,
    is_inverted: bool,
    /// Levels at which channels are cut off.
    rails: Vec<[Option<f64>; 2]>,
}

impl Conditions {
    fn of(recording: &Recording, found: &Found) -> Self {
        let channels = recording.channels().iter();
        Self {
            noise: found.noise,
            is_inverted: found
                .survey
                .as_ref()
                .is_some_and(|survey| survey.is_inverted()),
            rails: channels.map(|info| info.health.rails).collect(),
        }
    }

    fn hold_for(&self, other: &Self) -> bool {
        let difference = (self.noise - other.noise).abs();
        difference <= SAME_NOISE * self.noise
            && (self.is_inverted, &self.rails) == (other.is_inverted, &other.rails)
    }
}

/// Rises of the responses without a signal of the hammer that show a broken cable. 2: one may be a knock.
const LEAST_UNHEARD: usize = 2;

/// Time before a tap in which a hammer without noise shows no change (s). 0.1 s: half the least time between two taps.
const RESTS: f64 = 0.1;

/// Looks for taps after the hammer has stopped giving a signal.
fn add_unheard(
    recording: &Recording,
    hammer: usize,
    responses: &[usize],
    settings: &TapSettings,
    found: &mut Found,
) -> Result<(), RecordingError> {
    let info = recording.channels().get(hammer);
    let Some(stopped) = info.and_then(|info| info.health.stopped) else {
        return Ok(());
    };
    // A hammer without noise has no change before its pulse either.
    let rate = recording.sample_rate();
    let frames = |seconds: f64| (seconds * rate) as u64;
    let Some(last) = found.events.last() else {
        return Ok(());
    };
    let before = last.trigger.saturating_sub(frames(RESTS)).max(1)
        ..last
            .trigger
            .saturating_sub(frames(settings.pre_trigger))
            .max(1);
    if swing(recording, hammer, before)? == 0.0 {
        return Ok(());
    }
    let after = stopped.start + settings.least_distance_in(recording);
    let rises = find_rises(recording, responses, settings)?.events;
    let unheard = rises.iter().filter(|event| event.trigger > after);
    let count = unheard.clone().count();
    if count >= LEAST_UNHEARD {
        found.unheard = unheard.map(|event| event.trigger).next();
        found.remarks.push(TapRemark::SilentHammer {
            time: stopped.start as f64 / rate,
            rises: count,
        });
    }
    Ok(())
}

impl PartMemo {
    /// Finds the events of a file.
    pub(super) fn search(
        &mut self,
        recording: &Recording,
        source: &TapSource,
        settings: &TapSettings,
    ) -> Result<Arc<Found>, RecordingError> {
        if let Some((frames, found)) = &self.found
            && *frames == recording.frames()
        {
            return Ok(found.clone());
        }
        let found = match source {
            TapSource::Hammer { channel, responses } => {
                let mut found = find_pulses(recording, *channel, settings, &mut self.pieces)?;
                for event in &mut found.events {
                    let frame = event.trigger;
                    let known = self.answered.get(&frame).copied();
                    event.answered = match known {
                        Some(answered) => answered,
                        None => is_answered(recording, responses, event)?,
                    };
                    // Later samples may still show the answer to the last event.
                    if frame + settings.least_distance_in(recording) <= recording.frames() {
                        self.answered.insert(frame, event.answered);
                    }
                }
                // While a recording goes on, its hammer may be at rest.
                if !settings.is_growing {
                    add_unheard(recording, *channel, responses, settings, &mut found)?;
                }
                found
            }
            TapSource::Responses(channels) => find_rises(recording, channels, settings)?,
        };
        let found = Arc::new(found);
        self.found = Some((recording.frames(), found.clone()));
        Ok(found)
    }

    /// Forgets what only a file that grows needs.
    pub(super) fn has_ended(&mut self) {
        self.pieces.clear();
        self.answered.clear();
    }

    /// Measures the events of a file. Peaks below `weakest` are too weak to end a record.
    pub(super) fn measure(
        &mut self,
        recording: &Recording,
        source: &TapSource,
        found: &Found,
        weakest: f64,
        settings: &TapSettings,
    ) -> Result<(), RecordingError> {
        let now = Conditions::of(recording, found);
        if self
            .conditions
            .as_ref()
            .is_none_or(|earlier| !earlier.hold_for(&now))
        {
            self.facts.clear();
            self.conditions = Some(now);
        }
        let events = &found.events;
        let mut places = Vec::with_capacity(events.len());
        for (index, event) in events.iter().enumerate() {
            let record = record_of(recording, found, index, weakest, settings);
            let before = index.checked_sub(1).map(|before| events[before].trigger);
            let place = Place {
                trigger: event.trigger,
                before,
                start: record.start,
                end: record.end,
            };
            places.push(place);
        }
        let missing: Vec<usize> = (0..events.len())
            .filter(|index| !self.facts.contains_key(&places[*index]))
            .collect();
        let measured = missing.into_par_iter().map(|index| {
            let place = places[index];
            let measured = facts(recording, source, found, index, &place.record(), settings)?;
            Ok((place, measured))
        });
        // Collected in order, so that of several errors the first is reported.
        let measured: Vec<Result<(Place, Facts), RecordingError>> = measured.collect();
        // What belongs to no event any more is forgotten.
        let mut facts = BTreeMap::new();
        for place in &places {
            if let Some(known) = self.facts.remove(place) {
                facts.insert(*place, known);
            }
        }
        for one in measured {
            let (place, measured) = one?;
            facts.insert(place, measured);
        }
        self.facts = facts;
        Ok(())
    }

    /// What was measured of the events that a sensor answers.
    pub(super) fn answered_facts<'a>(
        &'a self,
        found: &'a Found,
    ) -> impl Iterator<Item = &'a Facts> {
        // Both are in order of time.
        let events = found.events.iter().zip(self.facts.values());
        let answered = events.filter(|(event, _)| event.answered);
        answered.map(|(_, facts)| facts)
    }

    /// Judges the events of a file, which were measured. The responses `answering` answer taps somewhere. Peaks below `weakest`
    /// are too weak.
    pub(super) fn judge(
        &self,
        recording: &Recording,
        source: &TapSource,
        found: &Found,
        answering: &[usize],
        weakest: f64,
        settings: &TapSettings,
    ) -> Vec<Tap> {
        let rate = recording.sample_rate();
        let mut taps = Vec::with_capacity(found.events.len());
        // Both are in order of time.
        for (event, (place, own)) in found.events.iter().zip(&self.facts) {
            let next = self.facts.range((Excluded(place), Unbounded)).next();
            let next = next.map(|(_, next)| next);
            let record = place.record();
            let stopped = stopped(recording, source, answering, &record, own, next);
            taps.push(judge(event, record, own, stopped, weakest, rate, settings));
        }
        taps
    }
}
