//! One recording that is listened to.

use super::super::input::{TestFile, file_name};
use super::super::staging::ledger;
use super::ListenArguments;
use super::bench::{Action, Progress, precision_words};
use super::decisions::write_by_hand;
use super::log::{Log, line_by_hand, line_of};
use super::recorder::Names;
use super::state::{Question, States, Subject};
use super::stream::{End, Event, Running};
use super::target::{Target, asked_for, described_target};
use super::views::Views;
use crate::listen::{ListenError, ListenSettings, Listener, News, Precision};
use crate::pipeline::RecordingPlan;
use crate::recording::GrowingRecording;
use crate::taps::{REACH, Rejection, TapsByHand};
use anyhow::anyhow;
use std::path::PathBuf;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// Time between two looks at a file that does not grow: short beside the least time to a verdict.
const PAUSE: Duration = Duration::from_millis(10);
/// Time after which keys are read and the bench is shown, while a long stream is judged.
const SLICE: Duration = Duration::from_millis(50);
/// Time for which the last piece of a stream is waited for, once it was stopped.
const LAST_PIECE: Duration = Duration::from_secs(1);

/// What was heard.
pub(super) struct Heard {
    /// Files of the recording.
    pub(super) files: Vec<PathBuf>,
    /// Taps that count.
    pub(super) accepted: usize,
    /// Taps that are accepted or rejected by hand; `None` where that is as before.
    pub(super) by_hand: Option<TapsByHand>,
    /// True where a decision by hand could not be written into the description.
    pub(super) is_unwritten: bool,
    /// Doubts about the stream itself, which its file does not show.
    pub(super) stream_doubts: Vec<String>,
    /// True where taps, or the end, came at another rate than stated.
    pub(super) has_wrong_rate: bool,
    /// True where samples come at another rate at the end.
    pub(super) is_rate_wrong: bool,
    /// How the stream ended.
    pub(super) ended: anyhow::Result<End>,
    /// The recording that follows in the same stream, and its first file.
    pub(super) turned: Option<(Target, PathBuf)>,
}

/// A recording that is listened to.
pub(super) struct Hearing<'a, 'v> {
    pub(super) arguments: &'a ListenArguments,
    pub(super) described: Option<&'a TestFile>,
    pub(super) target: &'a Target,
    pub(super) plan: RecordingPlan<'a>,
    pub(super) settings: ListenSettings,
    /// `None` of a recording that is only played, and once it could not be written.
    pub(super) log: Option<Log>,
    /// `None` where no results are wanted between the taps.
    pub(super) states: Option<States>,
    pub(super) views: &'a mut Views<'v>,
    /// `None` before the first samples.
    listener: Option<Listener<'a>>,
    /// How narrow the intervals are by the last state.
    precision: Option<Precision>,
    /// Times (s) of the taps that counted at the last state.
    result_counting: Vec<f64>,
    /// Times (s) of the taps that do not agree with the others, by the last state.
    apart: Vec<f64>,
    /// Times (s) of all such taps that were named.
    told_apart: Vec<f64>,
    /// True where the taps have changed since the results were last asked for.
    is_stale: bool,
    /// Whole seconds for which the record of the last tap has to go on, or it is cut off in the end.
    waits: u64,
    /// Doubts about the stream itself.
    stream_doubts: Vec<String>,
    /// True where taps, or the last samples, came at another rate than stated.
    has_wrong_rate: bool,
    /// True where samples come at another rate now.
    is_rate_wrong: bool,
    files: Vec<PathBuf>,
    /// Why taps are no longer judged.
    fault: Option<ListenError>,
    /// True once a decision by hand could not be written into the description.
    is_unwritten: bool,
    /// The recording that is to follow.
    turns_to: Option<Target>,
    /// True where results are wanted between the taps.
    wants_states: bool,
    /// True once nothing more comes.
    has_ended: bool,
}

impl<'a, 'v> Hearing<'a, 'v> {
    /// Begins with a recording of which no new sample is there yet.
    pub(super) fn new(
        arguments: &'a ListenArguments,
        described: Option<&'a TestFile>,
        target: &'a Target,
        plan: RecordingPlan<'a>,
        settings: ListenSettings,
        views: &'a mut Views<'v>,
    ) -> Self {
        Self {
            arguments,
            described,
            target,
            plan,
            settings,
            log: None,
            states: None,
            views,
            listener: None,
            precision: None,
            result_counting: Vec::new(),
            apart: Vec::new(),
            told_apart: Vec::new(),
            // Taps of earlier files are there before any news.
            is_stale: true,
            waits: 0,
            stream_doubts: Vec::new(),
            has_wrong_rate: false,
            is_rate_wrong: false,
            files: target.earlier.clone(),
            fault: None,
            is_unwritten: false,
            turns_to: None,
            wants_states: false,
            has_ended: false,
        }
    }

    /// Begins in a stream whose rate is wrong, or is not known to be.
    pub(super) fn begin_at(&mut self, is_rate_wrong: bool) {
        (self.has_wrong_rate, self.is_rate_wrong) = (is_rate_wrong, is_rate_wrong);
    }

    /// Works out results between the taps.
    pub(super) fn with_states(&mut self) {
        self.wants_states = true;
        let bare = self.arguments.run.bare();
        let subject = Subject::of(self.described, self.target, &bare);
        self.states = Some(States::begin(subject, self.plan.by_hand()));
    }

    /// Listens until the stream ends, is stopped, or turns to the next recording. `first` is the first file of a recording that
    /// was turned to.
    pub(super) fn listen(mut self, stream: &Running, first: Option<PathBuf>) -> Heard {
        if let Some(first) = first {
            self.go_on_in(first);
        }
        let next = self.described.zip(self.next());
        self.views.bench.next = next.map(|(file, next)| asked_for(file, &next));
        self.advise();
        let (mut ended, mut is_behind) = (None, false);
        while (ended.is_none() || is_behind) && !stream.is_stopped() {
            let pause = if is_behind { Duration::ZERO } else { PAUSE };
            match stream.events.recv_timeout(pause) {
                Ok(event) => {
                    if let Some(path) = self.heed(event, &mut ended) {
                        return self.turned(path);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    ended.get_or_insert(Ok(End::default()));
                }
            }
            is_behind = self.catch_up(stream);
            // Results meet no fault of the file before the taps do.
            if !is_behind {
                self.report();
            }
            for action in self.views.actions() {
                self.act(action, stream);
            }
            self.views.show();
            // A description that does not fit is to be corrected before the first tap.
            if self.is_refused() {
                stream.stop();
            }
        }
        // A piece that is being written is waited for. One that comes after that is not written.
        while ended.is_none()
            && let Ok(event) = stream.events.recv_timeout(LAST_PIECE)
        {
            if let Some(path) = self.heed(event, &mut ended) {
                return self.turned(path);
            }
        }
        // The next recording may have begun, and nothing more come.
        let begun = self.turns_to.as_ref().map(|next| next.file.clone());
        if let Some(path) = begun.filter(|path| path.exists()) {
            return self.turned(path);
        }
        // The keys of the terminal work again while all taps are judged for good.
        self.views.end_screen();
        ledger().stop = None;
        self.end(ended.unwrap_or(Ok(End::default())), None)
    }

    /// Takes what the stream reports. Returns the first file of the recording that it has turned to.
    fn heed(&mut self, event: Event, ended: &mut Option<anyhow::Result<End>>) -> Option<PathBuf> {
        match event {
            Event::File(path) => self.go_on_in(path),
            Event::Turned(path) => return Some(path),
            Event::NotTurned(words) => {
                self.turns_to = None;
                self.views.warn(&words);
            }
            Event::Doubt(text) => self.doubt_stream(text),
            Event::Rate { text, is_wrong } => {
                self.is_rate_wrong = is_wrong;
                let has_taps = self.listener.as_ref().is_some_and(|own| own.taps() > 0);
                // Taps that were recorded at a wrong rate stay wrong.
                self.has_wrong_rate = is_wrong || self.has_wrong_rate && has_taps;
                match self.has_wrong_rate {
                    // Each of its frequencies is wrong.
                    true => drop(self.end_results()),
                    false if self.wants_states => self.with_states(),
                    false => {}
                }
                self.advise();
                self.doubt_stream(text);
            }
            Event::Ended(how) => *ended = Some(how),
        }
        None
    }

    /// Works out no more results, and shows none. Returns true where there were some to come.
    fn end_results(&mut self) -> bool {
        (self.precision, self.apart) = (None, Vec::new());
        let bench = &mut self.views.bench;
        bench.precision.clear();
        bench.result.clear();
        bench.is_result_old = false;
        bench.first_screen = None;
        self.states.take().is_some()
    }

    fn doubt_stream(&mut self, text: String) {
        self.stream_doubts.push(text.clone());
        self.take(Ok(vec![News::Doubt(text)]));
    }

    /// Ends with this recording, and names the next one.
    fn turned(mut self, path: PathBuf) -> Heard {
        // Samples of this one that were not judged yet are judged in the end.
        let turned = self.turns_to.take().map(|target| (target, path));
        self.end(Ok(End::default()), turned)
    }

    /// Listens to the next file of the recording.
    fn go_on_in(&mut self, path: PathBuf) {
        let opened = GrowingRecording::open(&path);
        self.files.push(path);
        if self.fault.is_some() {
            return;
        }
        // Time and memory of a result grow with the recording.
        if self.listener.is_some() && self.end_results() {
            self.views
                .say("the first file is full: results come at the end from here on\n");
        }
        let news = match (opened, &mut self.listener) {
            (Err(fault), _) => Err(fault.into()),
            (Ok(growing), Some(listener)) => listener.go_on_in(growing),
            (Ok(growing), None) => {
                let settings = self.settings.clone();
                self.listener = Some(Listener::new(growing, self.plan, settings));
                return;
            }
        };
        self.take(news);
    }

    /// Judges what the file holds by now, for a short time at most. Returns true where there is more.
    fn catch_up(&mut self, stream: &Running) -> bool {
        let begin = Instant::now();
        while let Some(listener) = self.listener.as_mut().filter(|_| self.fault.is_none())
            && !stream.is_stopped()
        {
            let Some(news) = listener.step().transpose() else {
                break;
            };
            let (seconds, levels) = (listener.seconds(), listener.levels());
            self.views.bench.hear(seconds, &levels);
            self.take(news);
            self.settle();
            if begin.elapsed() > SLICE {
                return true;
            }
        }
        false
    }

    /// Shows and prints what all taps give so far, where that is ready.
    fn report(&mut self) {
        let Some(ready) = self.states.as_mut().and_then(States::ready) else {
            return;
        };
        let so_far = match ready {
            Ok(so_far) => so_far,
            Err(cause) => return self.views.warn(&format!("no result so far: {cause:#}")),
        };
        let before = self.views.bench.advice.clone();
        let bench = &mut self.views.bench;
        let precision = so_far.precision.as_ref().map(precision_words);
        bench.precision = precision.unwrap_or_default();
        bench.first_screen = so_far.first_screen;
        bench.result.clone_from(&so_far.lines);
        let mut lines = so_far.lines;
        lines.extend(Some(bench.precision.clone()).filter(|words| !words.is_empty()));
        self.precision = so_far.precision;
        self.result_counting = so_far.counting;
        self.tell_apart(so_far.apart);
        self.advise();
        if before != self.views.bench.advice {
            lines.push(self.views.bench.advice.clone());
        }
        let screen = self.views.terminal().screen();
        let lines = lines.iter().map(|line| screen.wrapped(line, 2));
        self.views.say(&lines.collect::<String>());
    }

    /// Names the taps that do not agree with the others, once each.
    fn tell_apart(&mut self, apart: Vec<(f64, Rejection)>) {
        let mut news = Vec::new();
        for (time, why) in &apart {
            let mut told = self.told_apart.iter();
            if !told.any(|other| (other - time).abs() <= REACH) {
                let text = format!("tap at {time:.2} s is left out of the results: {why}");
                news.push(News::Doubt(text));
                self.told_apart.push(*time);
            }
        }
        self.apart = apart.into_iter().map(|(time, _)| time).collect();
        self.take(Ok(news));
    }

    /// Follows the record of the last tap until it would not be cut off in the end, and then asks for results.
    fn settle(&mut self) {
        let Some(listener) = self.listener.as_ref().filter(|_| self.fault.is_none()) else {
            return;
        };
        let settled = listener.settled();
        let waits = settled.missing.ceil() as u64;
        let waited = std::mem::replace(&mut self.waits, waits);
        let asks = self.is_stale && settled.frames.is_some();
        if waits == waited && !asks {
            return;
        }
        let before = self.views.bench.advice.clone();
        self.advise();
        // Lines do not count the seconds.
        if waits == 0 && before != self.views.bench.advice {
            let text = self.advice_in_lines();
            self.views.say(&text);
        }
        if asks {
            self.ask();
        }
    }

    /// Shows, prints and logs what is new. A fault ends the judging, and not the recording.
    fn take(&mut self, news: Result<Vec<News>, ListenError>) {
        let news = match news {
            Ok(news) => news,
            Err(fault) => {
                let words = "taps are not judged any more, and the recording goes on";
                let warning = format!("{fault}; {words}");
                self.fault = Some(fault);
                self.advise();
                // The results would meet the same fault.
                self.states = None;
                if !self.is_refused() {
                    self.views.warn(&warning);
                }
                return;
            }
        };
        let heard = self.listener.as_ref().map_or(0.0, Listener::seconds);
        let screen = self.views.terminal().screen();
        let mut text = String::new();
        for one in &news {
            self.views.bench.take(one);
            text.push_str(&screen.wrapped(&one.to_string(), 2));
            self.note(&line_of(heard, one));
        }
        if news.iter().any(|one| !matches!(one, News::Doubt(_))) {
            self.is_stale = true;
            self.advise();
            text.push_str(&self.advice_in_lines());
        }
        if !text.is_empty() {
            self.views.say(&text);
        }
    }

    /// Notes a line in the log.
    fn note(&mut self, line: &serde_json::Value) {
        if let Some(log) = &mut self.log
            && let Err(cause) = log.note(line)
        {
            self.views
                .warn(&format!("{cause:#}; the recording goes on without a log"));
            self.log = None;
        }
    }

    /// Renews the advice by the taps so far.
    fn advise(&mut self) {
        if let Some(fault) = &self.fault {
            self.views.bench.advice = format!("taps are not judged any more: {fault}");
            self.views.bench.is_enough = false;
            return;
        }
        if self.has_wrong_rate {
            let file = file_name(&self.target.file);
            self.views.bench.advice =
                format!("samples came at a wrong rate: end, remove {file}, and record it again");
            self.views.bench.is_enough = false;
            return;
        }
        let listener = self.listener.as_ref();
        let counting = listener.map_or(Vec::new(), Listener::counting);
        // The trigger of a tap moves a little from look to look.
        let mut pairs = counting.iter().zip(&self.result_counting);
        let is_new = counting.len() == self.result_counting.len()
            && pairs.all(|(one, other)| (one - other).abs() <= REACH);
        self.views.bench.is_result_old = !self.views.bench.result.is_empty() && !is_new;
        // One of them may have been rejected since the last result.
        let is_counted = |time: &&f64| counting.iter().any(|own| (own - **time).abs() <= REACH);
        let progress = Progress {
            accepted: counting.len(),
            apart: self.apart.iter().filter(is_counted).count(),
            missing: listener.map_or(0.0, |listener| listener.settled().missing),
            next: self.views.bench.next.as_deref(),
            wanted: self.arguments.taps,
            accuracy: self.arguments.accuracy,
            has_results: self.states.is_some(),
            precision: self.precision.as_ref(),
        };
        let (is_enough, mut words) = progress.words();
        let next = self.views.bench.next.as_ref();
        match next.filter(|_| self.views.are_live()) {
            _ if !is_enough || self.has_ended => {}
            Some(next) => words.push_str(&format!("; next: {next}")),
            None => words.push_str("; end the recording"),
        }
        if let Some((reach, end)) = listener.and_then(Listener::reach) {
            words.push_str(&format!(
                "; take a harder tip: the taps excite up to {reach:.0} Hz of a band to {end:.0} Hz"
            ));
        }
        self.views.bench.advice = words;
        self.views.bench.is_enough = is_enough;
    }

    fn advice_in_lines(&self) -> String {
        let screen = self.views.terminal().screen();
        screen.wrapped(&self.views.bench.advice, 2)
    }

    /// Asks for the results so far.
    fn ask(&mut self) {
        let Some((listener, frames)) = self
            .listener
            .as_ref()
            .and_then(|listener| Some(listener).zip(listener.settled().frames))
        else {
            return;
        };
        self.is_stale = false;
        if let Some(states) = &mut self.states {
            states.ask(Question {
                files: self.files.clone(),
                frames,
                counting: listener.counting(),
                by_hand: listener.by_hand().clone(),
                wants_page: self.views.shows_report(),
            });
        }
    }

    /// Does what was asked for.
    fn act(&mut self, action: Action, stream: &Running) {
        match action {
            Action::Stop => stream.stop(),
            Action::Next => self.turn(stream),
            decision => self.decide(decision),
        }
    }

    /// Accepts or rejects a tap by hand, or takes the last decision back.
    fn decide(&mut self, decision: Action) {
        let Some(listener) = self.listener.as_mut().filter(|_| self.fault.is_none()) else {
            return;
        };
        let before = listener.by_hand().clone();
        let news = match decision {
            Action::Accept(Some(time)) => listener.decide(time, true),
            Action::Reject(Some(time)) => listener.decide(time, false),
            Action::Undo => listener.undo(),
            _ => Ok(None),
        };
        let (after, heard) = (listener.by_hand().clone(), listener.seconds());
        let (word, time) = match decision {
            Action::Accept(time) => ("accept", time),
            Action::Reject(time) => ("reject", time),
            _ => ("undo", None),
        };
        let words = match (&news, time) {
            (Ok(None), _) if decision == Action::Undo => {
                "there is no decision by hand to take back"
            }
            (Ok(None), Some(_)) => "this tap is gone",
            (Ok(None), None) => "there is no tap yet",
            _ if before == after => "this is decided already",
            _ => "",
        };
        if !words.is_empty() {
            return self.views.bench.note(words);
        }
        self.note(&line_by_hand(heard, word, time));
        self.take(news.map(Option::unwrap_or_default));
        // A tap may have counted before, and not have agreed with the others.
        self.is_stale = true;
        self.settle();
        self.write_decisions(&before, &after);
    }

    /// Writes into the description what was decided by hand.
    fn write_decisions(&mut self, before: &TapsByHand, after: &TapsByHand) {
        let (Some(file), Some(table)) = (self.described, self.target.table) else {
            return;
        };
        let own = file.test.recordings[table].file.display().to_string();
        let written = write_by_hand(&self.arguments.run.file, &own, before, after);
        self.is_unwritten |= written.is_err();
        if let Err(cause) = written {
            let words = format!("the decision is in the log alone: {cause:#}");
            self.views.warn(&words);
        }
    }

    /// Asks the stream for the next recording.
    fn turn(&mut self, stream: &Running) {
        if self.turns_to.is_some() || self.files.len() == self.target.earlier.len() {
            return;
        }
        let Some(next) = self.next() else {
            return self.views.bench.note("no other recording is missing");
        };
        stream.turn_to(Names {
            first: next.file.clone(),
            reserved: next.reserved.clone(),
        });
        self.turns_to = Some(next);
    }

    /// Returns the recording that may follow in the same stream.
    fn next(&self) -> Option<Target> {
        let file = self.described.filter(|_| !self.target.is_played)?;
        described_target(file, None, false, self.target.table).ok()
    }

    /// Returns true where the recording does not fit its description or the options, which its first samples show.
    fn is_refused(&self) -> bool {
        let has_looked = self.listener.as_ref().is_none_or(Listener::has_looked);
        // Files of another rate or with other channels do not follow one another.
        let is_described = match self.fault {
            Some(ListenError::Pipeline(_)) => true,
            Some(ListenError::Recording(_)) => !self.settings.earlier.is_empty(),
            None => false,
        };
        is_described && !has_looked
    }

    /// Judges all taps for good.
    fn end(mut self, ended: anyhow::Result<End>, turned: Option<(Target, PathBuf)>) -> Heard {
        self.states = None;
        self.has_ended = true;
        if self.fault.is_none()
            && let Some(listener) = &mut self.listener
        {
            let news = listener.finish();
            self.take(news);
        }
        let is_refused = self.is_refused();
        if is_refused {
            // The next call is to find the place as this one did.
            for file in &self.files[self.settings.earlier.len()..] {
                let _ = std::fs::remove_file(file);
            }
        }
        let (mut accepted, mut by_hand) = (0, None);
        if let Some(listener) = self.listener.as_ref().filter(|_| !is_refused) {
            accepted = listener.accepted();
            by_hand = Some(listener.by_hand().clone()).filter(|own| *own != self.plan.by_hand());
            let heard = match self.fault {
                Some(_) => "judged up to ",
                None => "",
            };
            let apart = match self.apart.len() {
                0 => String::new(),
                1 => "; 1 of them does not agree with the others".to_owned(),
                more => format!("; {more} of them do not agree with the others"),
            };
            let missing = match (self.arguments.taps + self.apart.len()).saturating_sub(accepted) {
                0 => String::new(),
                1 => "; 1 more was wanted".to_owned(),
                missing => format!("; {missing} more were wanted"),
            };
            self.views.say(&format!(
                "{}: {heard}{:.1} s, taps that count: {accepted} of {}{apart}{missing}\n",
                file_name(&self.target.file),
                listener.seconds(),
                listener.taps(),
            ));
        }
        Heard {
            files: self.files,
            accepted,
            by_hand,
            is_unwritten: self.is_unwritten,
            stream_doubts: self.stream_doubts,
            has_wrong_rate: self.has_wrong_rate,
            is_rate_wrong: self.is_rate_wrong,
            ended: match self.fault {
                Some(fault) if is_refused => Err(fault.into()),
                Some(fault) => Err(anyhow!(
                    "{fault}; the recording is kept: rename or remove its file, and record it again"
                )),
                None => ended,
            },
            turned,
        }
    }
}
