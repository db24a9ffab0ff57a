//! The line that shows on a terminal that the work goes on, with the time that is left.

use crate::pipeline::{Stage, Watch};
use std::io::{self, IsTerminal, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{JoinHandle, spawn};
use std::time::{Duration, Instant};

/// Time before the line appears: shorter work shows nothing.
const PATIENCE: Duration = Duration::from_secs(1);
/// Time between two pictures of the line.
const BEAT: Duration = Duration::from_millis(120);
const TURN: [char; 10] = ['⠋', '⠙', '⠹', '⠸', '⠼', '⠴', '⠦', '⠧', '⠇', '⠏'];
/// Shares of the stages in the time that a long recording takes (%). Both read all of it; fits take the decays alone.
const SHARES: [(Stage, usize); 3] = [(Stage::Taps, 42), (Stage::Spectra, 53), (Stage::Fits, 5)];

/// The line that shows progress. It disappears when this value is dropped.
#[derive(Debug)]
struct Progress {
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// What is done of the work.
#[derive(Debug, Default)]
struct Done {
    /// Percent of one recording, summed over all.
    share: usize,
    /// That of the whole work.
    of: usize,
    /// Time after the begin at which the last part was done.
    at: Duration,
}

impl Progress {
    /// Begins the line, where standard error is a terminal.
    fn begin(doing: &'static str, done: Arc<Mutex<Done>>) -> Option<Self> {
        if !io::stderr().is_terminal() {
            return None;
        }
        let (end, ended) = channel();
        Some(Self {
            end: Some(end),
            thread: Some(spawn(move || show(doing, &done, &ended))),
        })
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        // The thread ends when the channel is closed.
        self.end.take();
        if let Some(thread) = self.thread.take() {
            // A failure to draw the line does not matter.
            let _ = thread.join();
        }
    }
}

/// Draws the line until the channel is closed.
fn show(doing: &str, done: &Mutex<Done>, ended: &Receiver<()>) {
    let start = Instant::now();
    let mut error = io::stderr();
    let mut signs = TURN.iter().cycle();
    let mut pause = PATIENCE;
    while ended.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
        let sign = signs.next().unwrap_or(&' ');
        let elapsed = start.elapsed();
        let left = {
            let done = done.lock().unwrap_or_else(PoisonError::into_inner);
            time_left(done.at, done.share, done.of, elapsed)
        };
        let _ = write!(
            error,
            "\r\u{1b}[K{sign} {doing}, {} s{left}",
            elapsed.as_secs()
        );
        let _ = error.flush();
        pause = BEAT;
    }
    if pause == BEAT {
        let _ = write!(error, "\r\u{1b}[K");
    }
}

/// Receives the stages of recordings that are measured, and shows the time that is left. It disappears when this value is
/// dropped.
pub(super) struct Measuring<'a> {
    watch: &'a dyn Watch,
    start: Instant,
    done: Arc<Mutex<Done>>,
    _line: Option<Progress>,
}

impl<'a> Measuring<'a> {
    /// Begins with so many recordings; stages go on to `watch`. A quiet one shows nothing.
    pub(super) fn begin(recordings: usize, watch: &'a dyn Watch, quiet: bool) -> Self {
        let done = Arc::new(Mutex::new(Done {
            of: 100 * recordings.max(1),
            ..Done::default()
        }));
        let line = match quiet {
            true => None,
            false => Progress::begin("measuring, fitting and estimating", done.clone()),
        };
        Measuring {
            watch,
            start: Instant::now(),
            done,
            _line: line,
        }
    }
}

impl Watch for Measuring<'_> {
    fn pass(&self, from: Option<Stage>, to: Option<Stage>) {
        self.watch.pass(from, to);
        let share = SHARES.iter().find(|(stage, _)| Some(*stage) == from);
        // A file that is opened to see what it holds ends its first stage without another.
        let is_done = to.is_some() || from == Some(Stage::Fits);
        if let Some((_, share)) = share.filter(|_| is_done) {
            let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
            done.share += share;
            done.at = self.start.elapsed();
        }
    }
}

/// ", 2 min left" after `elapsed`: by what was done `at` a time; empty at the end, and in the first two seconds.
pub(super) fn time_left(at: Duration, done: usize, of: usize, elapsed: Duration) -> String {
    let whole = at.as_secs_f64() * of as f64 / done.max(1) as f64;
    match (whole - elapsed.as_secs_f64()).max(0.0) {
        _ if done == 0 || done >= of || elapsed < Duration::from_secs(2) => String::new(),
        left if left < 90.0 => format!(", {left:.0} s left"),
        left if left < 5400.0 => format!(", {:.0} min left", left / 60.0),
        left => format!(", {:.1} h left", left / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_time_left_follows_from_what_was_done() {
        let left = |seconds: f64, done| {
            let at = Duration::from_secs_f64(seconds);
            time_left(at, done, 100, at)
        };
        assert_eq!(left(40.0, 25), ", 2 min left");
        assert_eq!(left(10.0, 50), ", 10 s left");
        assert_eq!(left(3600.0, 10), ", 9.0 h left");
        assert_eq!(
            (left(1.0, 1), left(9.0, 100)),
            (String::new(), String::new())
        );
        // Half was done after 10 s; 6 s later 4 s are left, and after the estimate none.
        let later = |seconds| {
            time_left(
                Duration::from_secs(10),
                50,
                100,
                Duration::from_secs(seconds),
            )
        };
        assert_eq!(
            (later(16), later(30)),
            (", 4 s left".to_owned(), ", 0 s left".to_owned())
        );
    }

    #[test]
    fn prop_a_measured_recording_is_wholly_done() {
        let stages = [
            (None, Some(Stage::Taps)),
            (Some(Stage::Taps), None),
            (None, Some(Stage::Taps)),
            (Some(Stage::Taps), Some(Stage::Spectra)),
            (Some(Stage::Spectra), Some(Stage::Fits)),
            (Some(Stage::Fits), Some(Stage::Taps)),
            (Some(Stage::Taps), None),
            (None, Some(Stage::Joint)),
            (Some(Stage::Joint), None),
        ];
        let measuring = Measuring::begin(1, &(), true);
        for (from, to) in stages {
            measuring.pass(from, to);
        }
        let done = measuring.done.lock().unwrap();
        assert_eq!((done.share, done.of), (100, 100));
    }
}
