//! The listener: reads a growing file in steps, looks when a record has ended, and reports what is new.

use crate::alarm::Alarm;
use crate::news::{JudgedTap, News};
use std::mem::discriminant;
use std::ops::Range;
use tapjoint_analysis::{PipelineError, RecordingPlan, TapsSoFar, taps_so_far};
use tapjoint_numerics::stats::root_mean_square;
use tapjoint_signal::quality::remedy_of;
use tapjoint_signal::recording::{GrowingRecording, Recording, RecordingError};
use tapjoint_signal::spectral::measure_decay;
use tapjoint_signal::taps::{REACH, Rejection, Tap, TapMemo, TapRemark, TapSource};

/// Length of a step (s). A verdict waits for the end of its step.
const STEP: f64 = 0.05;
/// Of a longer record its beginning and its last half second are read for its decay (s): a bound on memory.
const LONGEST_READ: f64 = 10.0;
/// Share of the band that the taps have to excite, or a harder tip is proposed. 80 %: near the end of the band few modes lie.
/// `run` judges the fall of the force itself (`limits::FORCE_FALL`).
const ENOUGH_OF_BAND: f64 = 0.8;
/// Noise before the taps is read over this length (s). 1 s: a thousand samples and more, and a bound on memory.
const QUIET: f64 = 1.0;

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
    memo: TapMemo,
    /// Frame at which the record of the last tap has ended, if no other tap comes first.
    due: Option<u64>,
    reported: Vec<Reported>,
    /// Code and channel of the doubts that were reported.
    doubts: Vec<(&'static str, Option<usize>)>,
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
            watched: Vec::new(),
            alarm: Alarm::default(),
            memo: TapMemo::default(),
            due: None,
            reported: Vec::new(),
            doubts: Vec::new(),
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
        let watched = self.watched.iter();
        let swings: Vec<f64> = watched
            .map(|channel| swings[*channel].high - swings[*channel].low)
            .collect();
        let now = self.growing.frames();
        let hears = self.alarm.hears(&swings);
        let is_over = self.due.is_some_and(|due| due <= now);
        let mut news = Vec::new();
        // The next tap ends the record of the one before.
        if is_over || hears && self.due.is_some() {
            self.due = None;
            news = self.look(true)?;
        }
        if hears {
            self.due = Some(now + self.record_frames());
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
        Ok(news)
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
        self.reported
            .iter()
            .filter(|reported| reported.rejection.is_none())
            .count()
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
        let found = taps_so_far(recording, &self.plan, is_growing, &mut self.memo)?;
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
                None => news.push(News::Tap(judged(&found, tap, has_ended)?)),
                // Numbers in the reason move with every tap.
                Some(before) if before.rejection.is_none() != tap.accepted() => {
                    news.push(News::Revised(judged(&found, tap, has_ended)?));
                }
                Some(_) => {}
            }
            reported.push(tap.into());
        }
        news.extend(earlier.map(|one| News::Gone { time: one.time }));
        if let Some(time) = waiting {
            // Another alarm came just before it.
            let end = time + self.record(&found) - start;
            self.due = Some((end * self.growing.sample_rate()).ceil().max(0.0) as u64);
        }
        self.reported = reported;
        self.latest = Some(found);
        Ok(news)
    }

    /// Returns the doubts about a recording and its taps of a kind that was not reported yet.
    fn new_doubts(&mut self, found: &TapsSoFar, is_growing: bool) -> Vec<News> {
        let mut news = Vec::new();
        let recording = &found.recording;
        let parts = recording.parts().map(|(_, part)| part.warnings());
        for warning in recording.warnings().into_iter().chain(parts.flatten()) {
            // Its numbers move from look to look.
            let kind = (warning.code(), warning.channel());
            if !self.doubts.contains(&kind) {
                news.push(News::Doubt(warning.to_string()));
                self.doubts.push(kind);
            }
        }
        for remark in &found.taps.remarks {
            // What is missing so far may still come.
            let is_early = match remark {
                TapRemark::NoTapThere { time, .. } => *time > found.recording.duration(),
                TapRemark::FileWithoutTap { .. } | TapRemark::AllOverloaded { .. } => true,
                _ => false,
            };
            let is_held_back = is_growing && is_early;
            if !is_held_back && !self.remarks.iter().any(|other| is_same(remark, other)) {
                news.push(News::Doubt(remark.to_string()));
                self.remarks.push(remark.clone());
            }
        }
        news
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
}

/// Returns true for two remarks about the same thing; their numbers move from look to look.
fn is_same(one: &TapRemark, other: &TapRemark) -> bool {
    match (one, other) {
        (TapRemark::NoTapThere { time, .. }, TapRemark::NoTapThere { time: other, .. })
        | (TapRemark::StillRejected { time, .. }, TapRemark::StillRejected { time: other, .. }) => {
            time == other
        }
        (TapRemark::FileWithoutTap { file }, TapRemark::FileWithoutTap { file: other }) => {
            file == other
        }
        _ => discriminant(one) == discriminant(other),
    }
}

/// A tap in the words of a listener.
fn judged(found: &TapsSoFar, tap: &Tap, has_ended: bool) -> Result<JudgedTap, RecordingError> {
    let remaining = match tap.accepted() {
        true => remaining(found, tap)?,
        false => None,
    };
    Ok(JudgedTap {
        seconds: tap.frames() as f64 / found.recording.sample_rate(),
        has_ended,
        time: tap.time,
        peak: tap.peak,
        unit: found.peak_unit.clone(),
        pulse: tap.pulse,
        remaining,
        rejection: tap.rejection.clone(),
        overruled: tap.overruled.clone(),
        remedy: tap.rejection.as_ref().and_then(remedy_of),
    })
}

/// Amplitude at the end of a tap's record over the largest one (1), of the response that keeps most; `None` where all have
/// sunk into their noise. Of a long record its beginning and its end are read.
fn remaining(found: &TapsSoFar, tap: &Tap) -> Result<Option<f64>, RecordingError> {
    let recording = &found.recording;
    let (TapSource::Hammer {
        responses: channels,
        ..
    }
    | TapSource::Responses(channels)) = &found.source;
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
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};
    use std::path::Path;
    use tapjoint_analysis::BareSettings;
    use tapjoint_description::ChannelRef;
    use tapjoint_signal::recording::{Channel, PcmLayout, ReadSettings, SampleForm};

    const RATE: f64 = 5120.0;

    fn bare(hammer: usize) -> BareSettings {
        BareSettings {
            hammer: Some(ChannelRef::Number(hammer)),
            ..BareSettings::default()
        }
    }

    fn settings() -> ListenSettings {
        ListenSettings {
            name: "taps.wav".to_owned(),
            record: 1.0,
            headers: None,
            earlier: Vec::new(),
        }
    }

    /// A hammer pulse at each time (s) with its peak, and the decay of 118 Hz that it wakes.
    fn samples(seconds: f64, hits: &[(f64, f64)]) -> Vec<[f64; 2]> {
        let mut state = 7_u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            1e-4 * (f64::from(state) / f64::from(u32::MAX) - 0.5)
        };
        let mut samples = Vec::new();
        for n in 0..(seconds * RATE) as usize {
            let mut frame = [noise(), noise()];
            for &(time, peak) in hits {
                let since = n as f64 / RATE - time;
                if (0.0..2e-3).contains(&since) {
                    frame[0] += peak * (PI * since / 2e-3).sin().powi(2);
                }
                if since > 0.0 {
                    frame[1] += peak * (-4.0 * since).exp() * (TAU * 118.0 * since).sin();
                }
            }
            samples.push(frame);
        }
        samples
    }

    /// Writes a file in pieces of so many frames, and listens after each. Returns the news with the seconds at which they
    /// came; those of the end come last.
    #[expect(clippy::disallowed_methods, reason = "the test is the recorder")]
    fn heard(samples: &[[f64; 2]], path: &Path, piece: usize) -> Vec<(f64, News)> {
        let layout = PcmLayout::new(RATE as u32, 2, SampleForm::F64).unwrap();
        let bare = bare(1);
        let mut bytes = layout.wav_head(0);
        let mut listener = None;
        let mut all = Vec::new();
        for some in samples.chunks(piece) {
            for value in some.iter().flatten() {
                SampleForm::F64.write(*value, &mut bytes);
            }
            std::fs::write(path, &bytes).unwrap();
            let listener = listener.get_or_insert_with(|| {
                let growing = GrowingRecording::open(path).unwrap();
                Listener::new(growing, RecordingPlan::Bare(&bare), settings())
            });
            while let Some(news) = listener.step().unwrap() {
                let now = listener.seconds();
                all.extend(news.into_iter().map(|one| (now, one)));
            }
        }
        let news = listener.as_mut().unwrap().finish().unwrap();
        all.extend(news.into_iter().map(|one| (f64::INFINITY, one)));
        let listener = listener.unwrap();
        // The decisions after the last sample are those of the whole chain on the file.
        let opened = Recording::open(path, &ReadSettings::default()).unwrap();
        let whole = taps_so_far(
            opened,
            &RecordingPlan::Bare(&bare),
            false,
            &mut TapMemo::default(),
        )
        .unwrap();
        let whole = whole.taps.taps.iter();
        let whole: Vec<Reported> = whole.map(Reported::from).collect();
        assert_eq!(listener.reported, whole);
        all
    }

    fn rejection(news: &News) -> Option<&Rejection> {
        match news {
            News::Tap(tap) | News::Revised(tap) => tap.rejection.as_ref(),
            _ => None,
        }
    }

    #[test]
    fn prop_a_verdict_comes_when_the_record_has_ended_whatever_the_pieces() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taps.wav");
        // The third comes before the record of the second has ended. The fourth is a double hit.
        let hits = [(0.8, 1.0), (3.0, 1.1), (3.7, 0.9), (6.0, 1.0), (6.05, 0.4)];
        let samples = samples(8.0, &hits);
        let all = heard(&samples, &path, 137);
        let reported: Vec<(f64, f64)> = all
            .iter()
            .map(|(now, news)| match news {
                News::Tap(tap) => (*now, tap.time),
                other => panic!("{other}"),
            })
            .collect();
        for ((now, time), (hit, ended)) in
            reported
                .iter()
                .zip([(0.8, 1.8), (3.0, 3.7), (3.7, 4.7), (6.0, 7.0)])
        {
            assert!((time - hit).abs() < 2e-3, "{time} for {hit}");
            // A step for the alarm, and one for the look.
            assert!(
                (ended..ended + 2.0 * STEP + 1e-9).contains(now),
                "{now} for {ended}"
            );
        }
        assert_eq!(reported.len(), 4);
        assert!(matches!(
            rejection(&all[3].1),
            Some(Rejection::DoubleHit { .. })
        ));
        // The same news, whatever came at once.
        for piece in [1000, 41_000] {
            assert_eq!(heard(&samples, &path, piece), all, "pieces of {piece}");
        }
    }

    #[test]
    fn val_a_long_record_is_read_to_its_end() {
        let rate = 1000.0;
        let samples: Vec<f64> = (0..30_000)
            .map(|n| (-0.1 * f64::from(n) / rate).exp() * (TAU * 118.0 * f64::from(n) / rate).sin())
            .collect();
        let channel = Channel {
            samples: [vec![0.0; 2000], samples].concat(),
            ..Channel::default()
        };
        let recording = Recording::from_samples("taps", rate, vec![channel]).unwrap();
        let plan = RecordingPlan::Bare(&BareSettings::default());
        let mut memo = TapMemo::default();
        let found = taps_so_far(recording, &plan, false, &mut memo).unwrap();
        let decay = remaining(&found, &found.taps.taps[0])
            .unwrap()
            .expect("it rings");
        // From the middle of the first to that of the last half second. 16 ms of the first lie before the trigger: 1.6 %.
        let wanted = (-0.1_f64 * 29.5).exp();
        assert!((decay / wanted - 1.0).abs() < 0.02, "{decay} for {wanted}");
    }

    #[test]
    fn regress_a_small_event_just_before_a_tap_delays_no_verdict() {
        let folder = tempfile::tempdir().unwrap();
        // The hammer moves a little, and the alarm is silent when it strikes.
        let hits = [(0.86, 0.01), (1.0, 1.0), (4.86, 0.01), (5.0, 1.1)];
        let all = heard(&samples(8.0, &hits), &folder.path().join("taps.wav"), 300);
        let words: Vec<String> = all.iter().map(|(_, news)| news.to_string()).collect();
        for (time, ended) in [(1.0, 2.0), (5.0, 6.0)] {
            let first = all.iter().find(|(_, news)| match news {
                News::Tap(tap) => (tap.time - time).abs() < REACH,
                _ => false,
            });
            let (now, _) = first.unwrap_or_else(|| panic!("{words:?}"));
            assert!(
                (ended - 2.0 * STEP..ended + 2.0 * STEP).contains(now),
                "{now}: {words:?}"
            );
        }
    }

    #[test]
    fn prop_a_decision_that_later_taps_change_is_reported_again() {
        let folder = tempfile::tempdir().unwrap();
        // Two soft hits, and then the real ones.
        let hits = [(0.8, 0.05), (3.0, 1.0), (5.0, 1.1), (7.0, 0.9)];
        let all = heard(&samples(9.0, &hits), &folder.path().join("taps.wav"), 500);
        let words: Vec<String> = all.iter().map(|(_, news)| news.to_string()).collect();
        let revised = all
            .iter()
            .find(|(_, news)| matches!(news, News::Revised(_)));
        let (now, news) = revised.unwrap_or_else(|| panic!("{words:?}"));
        assert!(
            matches!(rejection(news), Some(Rejection::TooWeak { .. })),
            "{news}"
        );
        assert!(*now < 9.0, "{words:?}");
        assert!(words[0].starts_with("tap at 0.80 s accepted"), "{words:?}");
    }

    #[test]
    fn limit_silence_gives_no_news_and_a_wrong_channel_is_named_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taps.wav");
        assert_eq!(heard(&samples(3.0, &[]), &path, 400), []);
        let bare = bare(3);
        let growing = GrowingRecording::open(&path).unwrap();
        let mut listener = Listener::new(growing, RecordingPlan::Bare(&bare), settings());
        let problem = listener.step().unwrap_err().to_string();
        assert_eq!(
            problem,
            "--hammer: taps.wav: no channel 3; there are: 1, 2; name one of these"
        );
    }
}
