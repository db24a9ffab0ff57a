//! Output to standard output, standard error and `--json`.

use super::arguments::{CommonArguments, FullAnswer, JsonDestination};
use super::embedded::Session;
use super::error_text::{error_text, shortened};
use super::output::{OutputFile, unless_closed};
use super::overwrite::Files;
use super::progress::{Measuring, time_left};
use super::timings::Stopwatch;
use crate::pipeline::{Analysis, Watch};
use crate::report::document::{Document, TimingsSection};
use crate::report::{
    MOST_LINES, Screen, render_answer, render_json, render_readings, render_stages, render_text,
};
use serde_json::json;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Destinations of a command's output.
#[derive(Debug)]
pub(super) struct Terminal {
    files: Files,
    json: Option<Json>,
    quiet: bool,
    verbose: u8,
    stopwatch: Option<Arc<Stopwatch>>,
    /// The program that the command runs in; it takes what would be printed.
    session: Option<Arc<Session>>,
    start: Instant,
}

/// Destination of the JSON document. A file is opened before any work.
#[derive(Debug)]
enum Json {
    StandardOutput,
    File(OutputFile),
}

impl Terminal {
    /// Opens the file of `--json`, so that a missing permission is found before any work. `stopwatch` is that of `--timings`.
    pub(super) fn new(
        common: &CommonArguments,
        files: Files,
        stopwatch: Option<Arc<Stopwatch>>,
        session: Option<Arc<Session>>,
    ) -> anyhow::Result<Self> {
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
            stopwatch,
            session,
            start: Instant::now(),
        })
    }

    /// Returns the files that the command reads and writes.
    pub(super) fn files(&self) -> &Files {
        &self.files
    }

    /// Returns the receiver of the stages of the work.
    pub(super) fn watch(&self) -> &dyn Watch {
        match (&self.session, &self.stopwatch) {
            (Some(session), _) => session.watch().as_ref(),
            (None, Some(stopwatch)) => stopwatch.as_ref(),
            (None, None) => &(),
        }
    }

    /// Returns the same for threads that may outlive the command.
    pub(super) fn shared_watch(&self) -> Arc<dyn Watch + Send + Sync> {
        match (&self.session, &self.stopwatch) {
            (Some(session), _) => session.watch().clone(),
            (None, Some(stopwatch)) => stopwatch.clone(),
            (None, None) => Arc::new(()),
        }
    }

    /// Returns the program that the command runs in; `None` on a terminal.
    pub(super) fn session(&self) -> Option<&Session> {
        self.session.as_deref()
    }

    /// Returns what the stages took until now; `None` without `--timings`.
    pub(super) fn timings(&self) -> Option<TimingsSection> {
        let stopwatch = self.stopwatch.as_ref()?;
        Some(stopwatch.timings())
    }

    /// Prints an answer, unless `--quiet` is given or JSON goes to standard output.
    pub(super) fn say(&self, text: &str) -> io::Result<()> {
        if let Some(session) = &self.session {
            session.answer().text.push_str(text);
            return Ok(());
        }
        if self.quiet || matches!(self.json, Some(Json::StandardOutput)) {
            return Ok(());
        }
        if io::stdout().is_terminal() && has_colours() {
            return print(&coloured(text));
        }
        print(text)
    }

    /// Prints a text that must appear before the work begins: on standard error if `say` would not print it.
    pub(super) fn seal(&self, text: &str) -> io::Result<()> {
        let is_silent = self.session.is_none() && self.quiet;
        if is_silent || matches!(self.json, Some(Json::StandardOutput)) {
            let _ = writeln!(io::stderr(), "{text}");
        }
        self.say(text)
    }

    /// Receives the stages of the recordings that are measured; `recordings` is their number. A terminal shows the time that
    /// is left, until the returned value is dropped.
    pub(super) fn measuring(&self, recordings: usize) -> Measuring<'_> {
        Measuring::begin(
            recordings,
            self.watch(),
            self.quiet || self.session.is_some(),
        )
    }

    /// Prints a warning on standard error, unless `--quiet` is given. If standard error cannot be written
    /// to, there is no way to report it.
    pub(super) fn warn(&self, text: &str) {
        if let Some(session) = &self.session {
            session.answer().warnings.push(text.to_owned());
            return;
        }
        if self.quiet {
            return;
        }
        let whole = format!("warning: {text}\n");
        let mut error = io::stderr();
        // A file of messages keeps each on its line.
        let shown = if error.is_terminal() {
            self.screen().wrapped(&whole, 2)
        } else {
            whole
        };
        let _ = write!(error, "{shown}");
    }

    /// Shows the progress of a long task on a terminal, at every percent, with the time that is left.
    pub(super) fn count(&self, doing: &str, done: usize, of: usize) {
        if let Some(session) = &self.session {
            session.goes_on();
            return;
        }
        let mut error = io::stderr();
        let [now, before] = [done, done.saturating_sub(1)].map(|steps| 100 * steps / of.max(1));
        if self.quiet || now == before || !error.is_terminal() {
            return;
        }
        let elapsed = self.start.elapsed();
        let left = time_left(elapsed, done, of, elapsed);
        let end = if done == of { "\n" } else { "" };
        let _ = write!(error, "\r\u{1b}[K{done} of {of} {doing}{left}{end}");
    }

    /// Returns true where a live screen may fill the terminal.
    #[cfg(feature = "screen")]
    pub(super) fn may_be_filled(&self) -> bool {
        let is_silent = self.quiet || self.session.is_some();
        let is_taken = matches!(self.json, Some(Json::StandardOutput));
        let is_dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        !is_silent && !is_taken && !is_dumb && io::stdout().is_terminal() && is_in_foreground()
    }

    /// Returns the screen that texts are laid out for.
    pub(super) fn screen(&self) -> Screen {
        match self.session {
            Some(_) => Screen::default(),
            None => screen(),
        }
    }

    /// Prints the tables of a report's document, and writes it to the destination of `--json`. Call it last.
    pub(super) fn tables(self, document: &Document) -> anyhow::Result<()> {
        self.say(&render_text(document, self.screen()))?;
        self.write_document(document)
    }

    /// Prints the answer that a report's document holds, with the path of its report, and all tables where they were
    /// asked for.
    pub(super) fn answer(
        &self,
        document: &Document,
        report: Option<&Path>,
        full: &FullAnswer,
    ) -> anyhow::Result<()> {
        let (screen, report) = (self.screen(), report.map(|path| path.display().to_string()));
        let most = if full.full { usize::MAX } else { MOST_LINES };
        let mut text = render_answer(document, report.as_deref(), most, screen);
        if full.full {
            text = format!("{text}\n{}", render_text(document, screen));
        }
        Ok(self.say(&text)?)
    }

    /// Keeps the measured recordings for the program that the command runs in.
    pub(super) fn keep(&self, analysis: &Analysis) {
        if let Some(session) = &self.session {
            session.answer().recordings.clone_from(&analysis.recordings);
        }
    }

    /// Writes a report's document to the destination of `--json`. With `--verbose`, first prints on standard
    /// error what each stage used. Call it last.
    pub(super) fn write_document(self, document: &Document) -> anyhow::Result<()> {
        if let Some(session) = &self.session {
            session.answer().document = Some(document.clone());
        }
        let is_silent = self.quiet || self.session.is_some();
        let verbose = if is_silent { 0 } else { self.verbose };
        let mut error = io::stderr();
        if verbose > 0 {
            let _ = write!(error, "{}", render_stages(document));
        }
        if verbose > 1 {
            let _ = write!(error, "{}", render_readings(document));
        }
        if self.json.is_none() {
            return Ok(());
        }
        // The very text of report.json: reading numbers back could change their last digit.
        let text = match self.timings() {
            None => render_json(document),
            Some(timings) => render_json(&Document {
                timings: Some(timings),
                ..document.clone()
            }),
        };
        self.write_text(&text?)
    }

    /// Writes another document to the destination of `--json`, with the keys that all documents have. Call it
    /// last.
    pub(super) fn write_json(self, document: &serde_json::Value) -> anyhow::Result<()> {
        let mut whole = document.clone();
        let timings = self.timings().map(serde_json::to_value).transpose()?;
        if let Some(keys) = whole.as_object_mut() {
            for (key, value) in [("version", json!(1)), ("warnings", json!([]))] {
                keys.entry(key).or_insert(value);
            }
            keys.extend(timings.map(|timings| ("timings".to_owned(), timings)));
        }
        if let Some(session) = &self.session {
            session.answer().other = Some(whole.clone());
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

/// Returns the screen that texts are laid out for.
///
/// Its width is what COLUMNS says, else that of the terminal, else 80.
pub(super) fn screen() -> Screen {
    let stated = std::env::var("COLUMNS").ok();
    let stated = stated.and_then(|columns| columns.parse().ok());
    let own = terminal_size::terminal_size_of(io::stdout());
    let own = own.map(|(width, _)| usize::from(width.0));
    stated.or(own).map_or_else(Screen::default, Screen::of)
}

/// Returns true of a process that its terminal lets change its screen.
#[cfg(all(feature = "screen", any(target_os = "linux", target_os = "macos")))]
fn is_in_foreground() -> bool {
    let owner = rustix::termios::tcgetpgrp(io::stdout());
    owner.is_ok_and(|owner| owner == rustix::process::getpgrp())
}

#[cfg(all(feature = "screen", not(any(target_os = "linux", target_os = "macos"))))]
fn is_in_foreground() -> bool {
    true
}

/// Returns the text with bold headings and yellow warnings.
fn coloured(text: &str) -> String {
    const BOLD: &str = "\u{1b}[1m";
    const YELLOW: &str = "\u{1b}[33m";
    const PLAIN: &str = "\u{1b}[0m";
    let mut warning = false;
    let mut after_gap = true;
    let lines = text.lines().map(|line| {
        // A warning goes on in the lines that are indented below it.
        let begins = line.starts_with("warning (") || line.starts_with("! ");
        warning = begins || warning && line.starts_with("  ");
        // A caption, or the heads of a table; sentences are longer, or end with a full stop.
        let caption = line.chars().count() < LONGEST_CAPTION && !line.ends_with('.');
        let heading = after_gap && !warning && (line.contains("  ") || caption);
        after_gap = line.is_empty();
        match (warning, heading) {
            (true, _) => format!("{YELLOW}{line}{PLAIN}\n"),
            (_, true) => format!("{BOLD}{line}{PLAIN}\n"),
            _ => format!("{line}\n"),
        }
    });
    lines.collect()
}

/// Longest caption of a table (characters).
const LONGEST_CAPTION: usize = 60;

/// Any value of NO_COLOR (no-color.org) turns colours off, and so does a terminal without them.
fn has_colours() -> bool {
    let unwanted = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    !unwanted && !dumb
}

fn print(text: &str) -> io::Result<()> {
    let end = if text.ends_with('\n') { "" } else { "\n" };
    let mut out = io::stdout().lock();
    let printed = write!(out, "{text}{end}").and_then(|()| out.flush());
    unless_closed(printed)
        .map_err(|cause| io::Error::new(cause.kind(), format!("standard output: {cause}")))
}

/// Prints `error: ...` on standard error.
pub(super) fn print_error(error: &anyhow::Error) {
    let _ = writeln!(io::stderr(), "error: {}", error_text(error));
}

/// Prints the error of a wrong command line, or the help that was asked for.
pub(super) fn print_usage(usage: &clap::Error) {
    if !usage.use_stderr() {
        // Help whose reader stops early (`tapjoint --help | head`) is no error.
        let _ = usage.print();
        return;
    }
    let text = usage.render();
    let text = match io::stderr().is_terminal() && has_colours() {
        true => text.ansi().to_string(),
        false => text.to_string(),
    };
    let _ = write!(io::stderr(), "{}", shortened(&text));
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
