//! A line on standard error that tells that work goes on.
//!
//! How long a fit takes is not known beforehand, so that no bar is drawn that would have to guess: what
//! is done and for how long is said instead, after the first second.

use std::io::{self, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{JoinHandle, spawn};
use std::time::{Duration, Instant};

/// Nothing is said of what is done by then.
const PATIENCE: Duration = Duration::from_secs(1);
/// Time between two pictures of the line.
const BEAT: Duration = Duration::from_millis(120);
const TURN: [char; 10] = ['⠋', '⠙', '⠹', '⠸', '⠼', '⠴', '⠦', '⠧', '⠇', '⠏'];

/// The line; it vanishes when this is dropped.
#[derive(Debug)]
pub(super) struct Progress {
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Progress {
    /// Begins to watch the clock.
    pub(super) fn start(doing: &'static str) -> Self {
        let (end, ended) = channel();
        Self {
            end: Some(end),
            thread: Some(spawn(move || show(doing, &ended))),
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        // The channel's other end hears that this one is gone.
        self.end.take();
        if let Some(thread) = self.thread.take() {
            // A line that could not be drawn is no reason to fail.
            let _ = thread.join();
        }
    }
}

fn show(doing: &str, ended: &Receiver<()>) {
    let start = Instant::now();
    let goes_on = |time| ended.recv_timeout(time) == Err(RecvTimeoutError::Timeout);
    if !goes_on(PATIENCE) {
        return;
    }
    let mut beat = 0;
    loop {
        let sign = TURN[beat % TURN.len()];
        let _ = write!(
            io::stderr(),
            "\r{sign} {doing}, {} s",
            start.elapsed().as_secs()
        );
        let _ = io::stderr().flush();
        beat += 1;
        if !goes_on(BEAT) {
            break;
        }
    }
    let _ = write!(io::stderr(), "\r\u{1b}[K");
}
