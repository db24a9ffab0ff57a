//! `tapjoint watch`: a test is run again when one of its files changes.

use super::Outcome;
use super::input::check_file;
use super::output::{State, state_of};
use super::overwrite::{described, files_of};
use super::place::{FolderContents, is_description};
use super::run::RunArguments;
use super::staging::ledger;
use super::terminal::print_error;
use anyhow::bail;
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

/// Run a test again whenever one of its files changes.
///
/// Runs as `tapjoint run` does. Runs again when the description or a recording changes, or a new recording appears in
/// the folder. Files are read once they have not changed for one interval, because a recorder may still be writing. The page
/// report.html reloads itself in the browser. A run that fails prints its error, and the command goes on. Ctrl-C ends it.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint watch test.toml\n  tapjoint watch recordings --hammer 1 --interval 2"
)]
pub(super) struct WatchArguments {
    #[command(flatten)]
    pub(super) run: RunArguments,
    /// Time between two looks at the files, 0.1 to 3600 (s)
    #[arg(long, value_name = "S", default_value = "0.5", value_parser = interval)]
    interval: Duration,
    /// End after so many runs, with the exit code of the last; default: go on
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<u64>::new().range(1..=MOST_RUNS))]
    runs: Option<u64>,
}

const MOST_RUNS: u64 = 1_000_000;

/// Parses the time between two looks (s).
fn interval(text: &str) -> Result<Duration, String> {
    let seconds: Option<f64> = text.trim().parse().ok();
    match seconds.filter(|seconds| (0.1..=3600.0).contains(seconds)) {
        Some(seconds) => Ok(Duration::from_secs_f64(seconds)),
        None => Err(format!(
            "\"{}\" is no time between two looks; give 0.1 to 3600 (s)",
            text.trim()
        )),
    }
}

/// Length and time of each file; `None` for one that is missing.
type Look = BTreeMap<PathBuf, Option<State>>;

/// Runs a test `once` and again, until the program is stopped or has run often enough.
///
/// # Errors
/// There is no such file or folder at the beginning; the error of the last run.
pub(super) fn run(
    arguments: &WatchArguments,
    quiet: bool,
    once: impl Fn() -> anyhow::Result<Outcome>,
) -> anyhow::Result<Outcome> {
    let path = &arguments.run.file;
    if !path.is_dir() {
        check_file(path)?;
        if !path.is_file() {
            let shown = path.display();
            bail!(
                "{shown}: is neither a file nor a folder, and does not show its changes; name a file"
            );
        }
    }
    let mut runs = 0;
    let mut done: Option<Look> = None;
    let mut before = look(path, &Look::new());
    loop {
        thread::sleep(arguments.interval);
        let now = look(path, &before);
        if now != before || done.as_ref() == Some(&now) {
            before = now;
            continue;
        }
        runs += 1;
        if !quiet {
            let reason = match &done {
                Some(done) => changes(done, &now),
                None => format!("{} files are watched; Ctrl-C ends", now.len()),
            };
            // Where it cannot be written there is no way to say so.
            let _ = writeln!(io::stderr(), "run {runs}: {reason}");
        }
        // Each run reports its own results.
        ledger().written.clear();
        let outcome = once();
        if arguments.runs == Some(runs) {
            return outcome;
        }
        if let Err(error) = outcome {
            print_error(&error);
        }
        done = Some(now);
    }
}

/// Looks at all files that a run may depend on. Those that were known before stay known while a description has an error.
fn look(path: &Path, before: &Look) -> Look {
    let mut files = vec![path.to_owned()];
    if path.is_dir() {
        // A folder that cannot be read now may be readable later.
        let found = FolderContents::of(path).unwrap_or_default();
        files = [found.descriptions, found.recordings].concat();
    }
    let descriptions: Vec<PathBuf> = files
        .iter()
        .filter(|file| is_description(file))
        .cloned()
        .collect();
    for file in descriptions {
        match described(&file) {
            Some(test) => files.extend(files_of(&file, &test)),
            None => files.extend(before.keys().cloned()),
        }
    }
    files
        .into_iter()
        .map(|file| (file.clone(), state_of(&file)))
        .collect()
}

/// Returns which files changed between two looks: "low.wav is new".
fn changes(before: &Look, now: &Look) -> String {
    let all = before
        .keys()
        .chain(now.keys().filter(|file| !before.contains_key(*file)));
    let mut changes = Vec::new();
    for file in all {
        let [was, is] = [before, now].map(|look| look.get(file).copied().flatten());
        let word = match (was, is) {
            (was, is) if was == is => continue,
            (None, _) => "is new",
            (_, None) => "is gone",
            _ => "has changed",
        };
        changes.push(format!("{} {word}", file.display()));
    }
    match &changes[..] {
        [] => "other files are named".to_owned(),
        [only] => only.clone(),
        [first, others @ ..] => format!("{first}, and {} more", others.len()),
    }
}
