//! The listener: reads a growing file in steps, looks when a record has ended, and reports what is new.

mod by_hand;
mod doubts;

use crate::alarm::Alarm;
use crate::news::{JudgedTap, News};
use crate::silence::Silence;
use std::ops::Range;
use tapjoint_analysis::{PipelineError, RecordingPlan, TapsSoFar, taps_so_far};
use tapjoint_numerics::stats::root_mean_square;
use tapjoint_signal::quality::remedy_of;
use tapjoint_signal::recording::{GrowingRecording, Recording, RecordingError};
use tapjoint_signal::spectral::{DISPLAY_RATIO, measure_decay};
use tapjoint_signal::taps::{REACH, Rejection, Tap, TapMemo, TapRemark, TapSource, TapsByHand};

/// Length of a step (s). A verdict waits for the end of its step.
const STEP: f64 = 0.05;
/// Of a longer record its beginning and its last half second are read for its decay (s): a bound on memory.
const LONGEST_READ: f64 = 10.0;
/// Share of the band that the taps have to excite, or a harder tip is proposed. 80 %: near the end of the band few modes lie.
/// `run` judges the fall of the force itself (`limits::FORCE_FALL`).
const ENOUGH_OF_BAND: f64 = 0.8;
/// Noise before the taps is read over this length (s). 1 s: a thousand samples and more, and a bound on memory.
const QUIET: f64 = 1.0;

/// A tap raises the swing of a step by this factor at least. 1.5, chosen: beyond the scatter of noise, and a false alarm costs
/// little.
const RISE: f64 = 1.5;
/// The same where the hammer shows nothing. 5, chosen: modes that beat rise and fall more slowly.
const CLEAR_RISE: f64 = 5.0;

/// Reasons for which listening ends.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// The file cannot be read, or holds a sample that is no number.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recording does not fit its description.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
}

/// Settings of a listener.
#[derive(Debug, Clone)]
pub struct ListenSettings {
    /// Name of the recording, for messages.
    pub name: String,
    /// A tap is judged so long after its trigger (s), or when the next one comes. A described block that needs more gets
    /// more.
    pub record: f64,
    /// A recording whose channels have the names, units and scales of this one; `None` where the file itself has them.
    pub headers: Option<Recording>,
    /// Files of the same recording that were written before.
    pub earlier: Vec<Recording>,
}

/// What stands of a recording that goes on. It changes where later taps show that earlier ones were too weak or too close.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settled {
    /// Frames of the file that grows in which all taps that count would count if it ended there. `None` while the last one
    /// would be cut off.
    pub frames: Option<u64>,
    /// Time for which the recording has to go on, or the last tap is cut off (s).
    pub missing: f64,
}

/// What a look says of the end of the recording, in frames of the file that grows.
#[derive(Debug, Clone, Copy, Default)]
struct Standing {
    /// If the recording ended before this frame, the last reported tap would not count; 0 where it does not count anyhow.
    last_stands_at: u64,
    /// Frame at which a tap begins that is not reported yet.
    unreported: Option<u64>,
}

/// A tap that was reported.
#[derive(Debug, Clone, PartialEq)]
struct Reported {
    /// Time of its trigger (s).
    time: f64,
    /// Why it does not count; `None` = it counts.
    rejection: Option<Rejection>,
}

impl From<&Tap> for Reported {
    fn from(tap: &Tap) -> Self {
        Self {
            time: tap.time,
            rejection: tap.rejection.clone(),
        }
    }
}

/// Listens to one recording.
pub struct Listener<'a> {
    plan: RecordingPlan<'a>,
    settings: ListenSettings,
    growing: GrowingRecording,
    /// Frames of a step.
    step: u64,
    /// Channels on which taps are heard (0-based); not known before the first look.
    watched: Vec<usize>,
    alarm: Alarm,
    /// Hears the responses where there is a hammer.
    answers: Alarm,
    silence: Silence,
    memo: TapMemo,
    /// The taps that are accepted or rejected by hand.
    by_hand: TapsByHand,
    /// What was decided by hand before each of the last decisions, the newest last.
    earlier_by_hand: Vec<TapsByHand>,
    /// Swing of each channel in the last step.
    swings: Vec<f64>,
    /// Frame at which the record of the last tap has ended, if no other tap comes first.
    due: Option<u64>,
    /// The record of the newest alarm begins at this frame or later. `None` once a look has found it.
    begun: Option<u64>,
    standing: Standing,
    reported: Vec<Reported>,
    /// Code and channel of the doubts that were reported, and their words.
    doubts: Vec<((&'static str, Option<usize>), String)>,
    /// True once it was said that no tap comes.
    is_silence_said: bool,
    /// Taps at which the channels were checked last.
    checked_taps: usize,
    /// True once it was said that the channels may be mixed up.
    are_mixed: bool,
    /// The remarks that were reported.
    remarks: Vec<TapRemark>,
    /// What the last look has found.
    latest: Option<TapsSoFar>,
}

impl<'a> Listener<'a> {
    /// Begins with a file of which the first samples are there.
    pub fn new(
        growing: GrowingRecording,
        plan: RecordingPlan<'a>,
        settings: ListenSettings,
    ) -> Self {
        let step = ((STEP * growing.sample_rate()) as u64).max(1);
        Self {
            plan,
            settings,
            growing,
            step,
            by_hand: plan.by_hand(),
            earlier_by_hand: Vec::new(),
            swings: Vec::new(),
            watched: Vec::new(),
            alarm: Alarm::new(RISE),
            answers: Alarm::new(CLEAR_RISE),
            silence: Silence::default(),
            memo: TapMemo::default(),
            due: None,
            begun: None,
            standing: Standing::default(),
            reported: Vec::new(),
            doubts: Vec::new(),
            is_silence_said: false,
            checked_taps: 0,
            are_mixed: false,
            remarks: Vec::new(),
            latest: None,
        }
    }

    /// Takes the next step, and looks where a record has ended. Returns what is new; `None` where the file does not hold a
    /// whole step yet.
    ///
    /// # Errors
    /// The file cannot be read, or does not fit its description.
    pub fn step(&mut self) -> Result<Option<Vec<News>>, ListenError> {
        let Some(swings) = self.growing.grow(self.step)? else {
            return Ok(None);
        };
        if self.watched.is_empty() {
            // A wrong channel is found before the first tap.
            let news = self.look(true)?;
            self.watched = match self.latest.as_ref().map(|found| &found.source) {
                Some(TapSource::Hammer { channel, .. }) => vec![*channel],
                Some(TapSource::Responses(channels)) => channels.clone(),
                None => Vec::new(),
            };
            return Ok(Some(news));
        }
        let swings = swings.iter().map(|swing| swing.high - swing.low);
        self.swings = swings.collect();
        self.silence.takes(&self.swings);
        let watched = self.watched.iter();
        let swings: Vec<f64> = watched.map(|channel| self.swings[*channel]).collect();
        let now = self.growing.frames();
        let hears = self.alarm.hears(&swings);
        let is_over = self.due.is_some_and(|due| due <= now);
        let mut news = self.silent_hammer(now);
        news.extend(self.no_tap());
        // The next tap ends the record of the one before.
        if is_over || hears && self.due.is_some() {
            (self.due, self.begun) = (None, None);
            news.extend(self.look(true)?);
        }
        if hears {
            self.due = Some(now + self.record_frames());
            // The alarm comes up to two steps after the trigger; the record begins a little before it.
            self.begun = Some(now.saturating_sub(3 * self.step));
        }
        Ok(Some(news))
    }

    /// Takes what is left of the file, and judges all taps as `run` does. Returns what is new.
    ///
    /// # Errors
    /// Those of [`step`](Self::step).
    pub fn finish(&mut self) -> Result<Vec<News>, ListenError> {
        // The first samples have shown how all lie in their bytes; now all of them show it.
        self.growing = self.growing.reopened()?;
        self.growing.grow_to_end()?;
        self.look(false)
    }

    /// Goes on in the next file of the recording, once the last one is full. Returns what is new of the last one.
    ///
    /// # Errors
    /// Those of [`step`](Self::step).
    pub fn go_on_in(&mut self, next: GrowingRecording) -> Result<Vec<News>, ListenError> {
        let mut news = Vec::new();
        while let Some(more) = self.step()? {
            news.extend(more);
        }
        self.growing.grow_to_end()?;
        let number = self.settings.earlier.len() + 1;
        let name = format!("{} ({number})", self.settings.name);
        let finished = self.with_headers(self.growing.finished());
        self.settings.earlier.push(finished.renamed(name));
        self.growing = next;
        // The record of a tap may end in the next file.
        self.due = self.due.map(|_| self.record_frames());
        self.begun = self.begun.map(|_| 0);
        self.standing = Standing::default();
        Ok(news)
    }

    /// Name of each channel on which something is measured, the hammer first, and its swing (highest less lowest value, unit
    /// of the file) in the last twentieth of a second. Empty before the first look.
    pub fn levels(&self) -> Vec<(&str, f64)> {
        let found = self.latest.iter();
        let names = found.flat_map(|found| &found.names);
        let levels = names.map(|(channel, name)| {
            let swing = self.swings.get(*channel).copied();
            (name.as_str(), swing.unwrap_or_default())
        });
        levels.collect()
    }

    /// Returns how much of the recording stands, even if it ended now.
    pub fn settled(&self) -> Settled {
        let Standing {
            last_stands_at,
            unreported,
        } = self.standing;
        let now = self.growing.frames();
        let begun = [self.begun, unreported].into_iter().flatten();
        let frames = begun.fold(now, u64::min);
        // Where the next tap has ended its record, nothing more comes.
        let missing = match unreported {
            Some(_) => 0,
            None => last_stands_at.saturating_sub(now),
        };
        Settled {
            frames: Some(frames).filter(|frames| last_stands_at <= *frames),
            missing: missing as f64 / self.growing.sample_rate(),
        }
    }

    /// Times of the taps that count (s).
    pub fn counting(&self) -> Vec<f64> {
        let reported = self.reported.iter();
        let accepted = reported.filter(|tap| tap.rejection.is_none());
        accepted.map(|tap| tap.time).collect()
    }

    /// Returns how far the taps excite the structure in the mean, and the end of the stated band (Hz), where they do not reach
    /// four fifths of it. `None` otherwise, and without a hammer.
    pub fn reach(&self) -> Option<(f64, f64)> {
        let found = self.latest.as_ref()?;
        let (pulse, end) = (found.taps.mean_pulse()?, found.band_end?);
        (pulse.usable_to < ENOUGH_OF_BAND * end).then_some((pulse.usable_to, end))
    }

    /// Returns false before the first look, which shows whether the recording fits what is known of it.
    pub fn has_looked(&self) -> bool {
        self.latest.is_some()
    }

    /// Number of taps that were reported.
    pub fn taps(&self) -> usize {
        self.reported.len()
    }

    /// Number of taps that count.
    pub fn accepted(&self) -> usize {
        let reported = self.reported.iter();
        reported.filter(|tap| tap.rejection.is_none()).count()
    }

    /// Length of what was heard, of all files (s).
    pub fn seconds(&self) -> f64 {
        self.start() + self.growing.frames() as f64 / self.growing.sample_rate()
    }

    /// Returns the recording with the names, units and scales that are known from elsewhere.
    fn with_headers(&self, recording: Recording) -> Recording {
        match &self.settings.headers {
            Some(headers) => recording.with_headers_of(headers),
            None => recording,
        }
    }

    /// Finds the taps of the recording so far, and compares them with what was reported.
    fn look(&mut self, is_growing: bool) -> Result<Vec<News>, ListenError> {
        let mut recording = self.with_headers(self.growing.snapshot());
        let name = &self.settings.name;
        recording = match self.settings.earlier.as_slice() {
            [] => recording.renamed(name),
            earlier => {
                let parts = earlier.iter().cloned().chain([recording]);
                Recording::joined(name, parts.collect())?
            }
        };
        if !is_growing {
            // The last decisions are those of a first look.
            self.memo = TapMemo::default();
        }
        let found = taps_so_far(
            recording,
            &self.plan,
            &self.by_hand,
            is_growing,
            &mut self.memo,
        )?;
        let mut news = Vec::new();
        // Before the first tap a channel may rest, and nothing is strange about it.
        if self.latest.is_some() {
            news.extend(self.new_doubts(&found, is_growing));
        }
        let taps = &found.taps.taps;
        let mut reported = Vec::with_capacity(taps.len());
        let start = self.start();
        let mut waiting = None;
        // Both are in order of time.
        let mut earlier = self.reported.iter().peekable();
        for (place, tap) in taps.iter().enumerate() {
            while let Some(gone) = earlier.next_if(|one| one.time < tap.time - REACH) {
                news.push(News::Gone { time: gone.time });
            }
            let before = earlier.next_if(|one| one.time <= tap.time + REACH);
            if self.latest.is_none() && tap.time < start {
                // It was reported when its file was recorded.
                reported.push(tap.into());
                continue;
            }
            let is_last = place + 1 == taps.len() && tap.time >= start;
            // The record of the last one has not ended while it is still waited for.
            if is_growing && is_last && before.is_none() && !self.is_long_enough(&found, tap) {
                waiting = Some(tap.time);
                continue;
            }
            let has_ended = !(is_growing && is_last);
            match before {
                None => news.push(News::Tap(self.judged(&found, tap, has_ended)?)),
                // Numbers in the reason move with every tap.
                Some(before) if before.rejection.is_none() != tap.accepted() => {
                    news.push(News::Revised(self.judged(&found, tap, has_ended)?));
                }
                Some(_) => {}
            }
            reported.push(tap.into());
        }
        news.extend(earlier.map(|one| News::Gone { time: one.time }));
        news.extend(self.mixed_channels(&found));
        if let Some(time) = waiting {
            // Another alarm came just before it.
            let end = time + self.record(&found) - start;
            self.due = Some((end * self.growing.sample_rate()).ceil().max(0.0) as u64);
        }
        self.standing = self.standing(&found, waiting.is_some(), is_growing);
        self.reported = reported;
        self.latest = Some(found);
        Ok(news)
    }

    /// What taps say of the end of the recording. The last one of them may not be reported yet.
    fn standing(&self, found: &TapsSoFar, is_last_unreported: bool, is_growing: bool) -> Standing {
        let rate = self.growing.sample_rate();
        let earlier = self.settings.earlier.iter().map(Recording::frames);
        let first: u64 = earlier.sum();
        let mut judged = found.taps.taps.as_slice();
        let mut standing = Standing::default();
        if let Some((last, before)) = judged.split_last().filter(|_| is_last_unreported) {
            standing.unreported = Some(last.record.start.saturating_sub(first));
            judged = before;
        }
        if let Some(last) = judged.last()
            && is_growing
            && last.accepted()
            && last.record.end > first
        {
            let needed = found
                .taps
                .needed_of_last(judged.len() - 1, rate, found.wanted);
            let stands_at = last.usable_from() + (needed * rate).ceil() as u64;
            standing.last_stands_at = stands_at.saturating_sub(first);
        }
        standing
    }

    /// Length of signal after which a tap is judged (s).
    fn record(&self, found: &TapsSoFar) -> f64 {
        self.settings.record.max(found.wanted.unwrap_or(0.0))
    }

    /// The same in frames, by what the last look has found.
    fn record_frames(&self) -> u64 {
        let record = self.latest.as_ref().map(|found| self.record(found));
        let record = record.unwrap_or(self.settings.record);
        (record * self.growing.sample_rate()) as u64
    }

    /// Time at which the file that grows begins (s).
    fn start(&self) -> f64 {
        self.settings.earlier.iter().map(Recording::duration).sum()
    }

    /// Returns true where so much of a tap's record is there as is waited for.
    fn is_long_enough(&self, found: &TapsSoFar, tap: &Tap) -> bool {
        let record = self.record(found);
        // The alarm comes up to two steps after the trigger.
        found.recording.duration() - tap.time >= record - 2.0 * STEP
    }

    /// A tap in the words of a listener.
    fn judged(
        &self,
        found: &TapsSoFar,
        tap: &Tap,
        has_ended: bool,
    ) -> Result<JudgedTap, RecordingError> {
        let remaining = match tap.accepted() {
            true => remaining(found, tap)?,
            false => None,
        };
        let is_by_hand = tap.accepted() && self.by_hand.accepts(tap);
        let overload = tap.overload.filter(|_| is_by_hand);
        let overruled = tap.overruled.clone();
        let rate = found.recording.sample_rate();
        let whole_band = rate / DISPLAY_RATIO;
        Ok(JudgedTap {
            seconds: tap.frames() as f64 / rate,
            has_ended,
            time: tap.time,
            peak: tap.peak,
            unit: found.peak_unit.clone(),
            pulse: tap.pulse,
            excites_all: tap.pulse.is_some_and(|pulse| pulse.usable_to >= whole_band),
            remaining,
            rejection: tap.rejection.clone(),
            overruled: overruled.or(overload.map(Rejection::Overload)),
            remedy: tap.rejection.as_ref().and_then(remedy_of),
        })
    }
}

/// Amplitude at the end of a tap's record over the largest one (1), of the response that keeps most; `None` where all have
/// sunk into their noise. Of a long record its beginning and its end are read.
fn remaining(found: &TapsSoFar, tap: &Tap) -> Result<Option<f64>, RecordingError> {
    let recording = &found.recording;
    let channels = found.source.responses();
    let frames = |seconds: f64| (seconds * recording.sample_rate()) as u64;
    let quiet = &found.taps.quiet;
    let quiet = quiet.start.max(quiet.end.saturating_sub(frames(QUIET)))..quiet.end;
    let (start, end) = (tap.usable_from(), tap.record.end);
    // The decay is that from the largest to the last of twenty pieces.
    let piece = frames(LONGEST_READ / 20.0);
    let is_long = end - start > 20 * piece;
    let first_end = if is_long { start + 19 * piece } else { end };
    let mut most = None;
    for &channel in channels {
        let noise = root_mean_square(&about_mean(recording, channel, quiet.clone())?);
        let mut samples = about_mean(recording, channel, start..first_end)?;
        if is_long {
            samples.extend(about_mean(recording, channel, end - piece..end)?);
        }
        let decay = measure_decay(&samples, noise);
        if decay.remaining > decay.noise {
            most = Some(decay.remaining.max(most.unwrap_or(0.0)));
        }
    }
    Ok(most)
}

/// Samples of a channel in these frames about its mean.
fn about_mean(
    recording: &Recording,
    channel: usize,
    frames: Range<u64>,
) -> Result<Vec<f64>, RecordingError> {
    let mean = recording.mean_at(channel, frames.start);
    let mut samples = recording.read(channel, frames)?;
    samples.iter_mut().for_each(|sample| *sample -= mean);
    Ok(samples)
}

#[cfg(test)]
mod tests;
