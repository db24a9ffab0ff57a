//! What goes to standard output and standard error, and to `--json`.

use super::arguments::{CommonArguments, JsonDestination};
use super::output::OutputFile;
use super::overwrite::Files;
use serde_json::json;
use std::io::{self, IsTerminal, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{JoinHandle, spawn};
use std::time::{Duration, Instant};
use tapjoint::report::text::wrapped;
use tapjoint::report::{document::Document, render_json, render_readings, render_stages};

/// Where a command's words go.
#[derive(Debug)]
pub(super) struct Terminal {
    files: Files,
    json: Option<Json>,
    quiet: bool,
    verbose: u8,
}

/// Where the JSON document goes; a file is opened before any work.
#[derive(Debug)]
enum Json {
    StandardOutput,
    File(OutputFile),
}

impl Terminal {
    /// Opens what `--json` names, so that a folder without write permission is found out before
    /// any work.
    pub(super) fn new(common: &CommonArguments, files: Files) -> anyhow::Result<Self> {
        let json = match &common.json {
            None => None,
            Some(JsonDestination::StandardOutput) => Some(Json::StandardOutput),
            Some(JsonDestination::File(path)) => Some(Json::File(OutputFile::prepare(path)?)),
        };
        Ok(Self {
            files,
            json,
            quiet: common.quiet,
            verbose: common.verbose,
        })
    }

    /// The files that the command reads and writes.
    pub(super) fn files(&self) -> &Files {
        &self.files
    }

    /// Prints an answer, unless it was asked to be quiet or standard output belongs to JSON.
    pub(super) fn say(&self, text: &str) -> io::Result<()> {
        if self.quiet || matches!(self.json, Some(Json::StandardOutput)) {
            return Ok(());
        }
        if io::stdout().is_terminal() && colours_wanted() {
            return print(&coloured(text));
        }
        print(text)
    }

    /// Prints what has to be said before the work begins, or else was not said: on standard error where standard output
    /// belongs to JSON or is to stay quiet.
    pub(super) fn seal(&self, text: &str) -> io::Result<()> {
        if self.quiet || matches!(self.json, Some(Json::StandardOutput)) {
            let _ = writeln!(io::stderr(), "{text}");
        }
        self.say(text)
    }

    /// Shows on standard error that work goes on, if that is a terminal; until the answer is dropped.
    pub(super) fn progress(&self, doing: &'static str) -> Option<Progress> {
        (!self.quiet && io::stderr().is_terminal()).then(|| Progress::start(doing))
    }

    /// Prints a warning on standard error, unless it was asked to be quiet. A standard error that
    /// cannot be written to is nothing that could be reported.
    pub(super) fn warn(&self, text: &str) {
        if self.quiet {
            return;
        }
        let whole = format!("warning: {text}\n");
        let mut error = io::stderr();
        // A file of messages keeps each on its line.
        let shown = if error.is_terminal() {
            wrapped(&whole, 2)
        } else {
            whole
        };
        let _ = write!(error, "{shown}");
    }

    /// Shows how far a long task is, on a terminal only; of a thousand steps every tenth.
    pub(super) fn count(&self, doing: &str, done: usize, of: usize) {
        let mut error = io::stderr();
        let percent = |done: usize| 100 * done / of.max(1);
        let same = percent(done) == percent(done.saturating_sub(1));
        if self.quiet || same || !error.is_terminal() {
            return;
        }
        let end = if done == of { "\n" } else { "" };
        let _ = write!(error, "\r{done} of {of} {doing}{end}");
    }

    /// Tells on standard error what each stage used, and twice asked also every tap and peak.
    fn tell(&self, document: &Document) {
        if self.quiet {
            return;
        }
        let mut error = io::stderr();
        if self.verbose > 0 {
            let _ = write!(error, "{}", render_stages(document));
        }
        if self.verbose > 1 {
            let _ = write!(error, "{}", render_readings(document));
        }
    }

    /// Writes a report's document to where `--json` says, if it says anything. Call it last.
    pub(super) fn write_document(self, document: &Document) -> anyhow::Result<()> {
        self.tell(document);
        if self.json.is_none() {
            return Ok(());
        }
        // The very text of report.json: reading numbers back could move their last digit.
        self.write_text(&render_json(document)?)
    }

    /// Writes what is no report's document to where `--json` says, if it says anything, with the keys that all
    /// documents have. Call it last.
    pub(super) fn write_json(self, document: &serde_json::Value) -> anyhow::Result<()> {
        let mut whole = document.clone();
        if let Some(keys) = whole.as_object_mut() {
            for (key, value) in [("version", json!(1)), ("warnings", json!([]))] {
                keys.entry(key).or_insert(value);
            }
        }
        let mut text = serde_json::to_string_pretty(&whole)?;
        text.push('\n');
        self.write_text(&text)
    }

    fn write_text(self, text: &str) -> anyhow::Result<()> {
        match self.json {
            None => Ok(()),
            Some(Json::StandardOutput) => Ok(print(text)?),
            Some(Json::File(file)) => Ok(file.write(text.as_bytes())?),
        }
    }
}

/// Whether colours are welcome: NO_COLOR (no-color.org) set to anything says no, and so does a
/// terminal that calls itself dumb.
fn colours_wanted() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// The text with its headings bold and its warnings yellow.
fn coloured(text: &str) -> String {
    const BOLD: &str = "\u{1b}[1m";
    const YELLOW: &str = "\u{1b}[33m";
    const PLAIN: &str = "\u{1b}[0m";
    let mut warning = false;
    let mut after_gap = true;
    let lines = text.lines().map(|line| {
        // A warning goes on in the lines that are indented below it.
        warning = line.starts_with("warning (") || warning && line.starts_with("  ");
        let heading = after_gap && !line.is_empty() && !warning;
        after_gap = line.is_empty();
        match (warning, heading) {
            (true, _) => format!("{YELLOW}{line}{PLAIN}\n"),
            (_, true) => format!("{BOLD}{line}{PLAIN}\n"),
            _ => format!("{line}\n"),
        }
    });
    lines.collect()
}

fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    if !text.ends_with('\n') {
        out.write_all(b"\n")?;
    }
    out.flush()
}

/// Prints `error: ...` on standard error, with those causes that the message does not already
/// tell.
pub(super) fn print_error(error: &anyhow::Error) {
    let mut text = error.to_string();
    for cause in error.chain().skip(1) {
        let cause = cause.to_string();
        if !text.contains(&cause) {
            text.push_str(": ");
            text.push_str(&cause);
        }
    }
    let _ = writeln!(io::stderr(), "error: {text}");
}

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
    fn start(doing: &'static str) -> Self {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_colours_change_no_word() {
        let text = "Modes\nMode  Hz\n----\n   1  17\n\nwarning (misfit): a\n  b\n\nWhat was found\nTaps  3\n";
        let shown = coloured(text);
        assert!(shown.contains("\u{1b}[33m  b"), "{shown:?}");
        assert!(shown.starts_with("\u{1b}[1mModes"), "{shown:?}");
        let plain = ["\u{1b}[1m", "\u{1b}[33m", "\u{1b}[0m"];
        let stripped = plain
            .iter()
            .fold(shown, |text, code| text.replace(code, ""));
        assert_eq!(stripped, text);
    }
}
