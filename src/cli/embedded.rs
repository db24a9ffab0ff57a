//! Commands inside another program: nothing is printed, and the results come back as values.

use super::error_text::{error_text, usage_text};
use super::{Command, Outcome, parse, run_command, staging};
use crate::description::TestDescription;
use crate::pipeline::{RecordingResult, Stage, Watch, Work};
use crate::report::document::Document;
use std::ffi::OsString;
use std::fmt;
use std::mem;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The program that a command runs in, and what it gives to the command.
pub struct Host {
    /// Test descriptions in memory: a path as in the arguments, and the text. No file is read there. Recordings are
    /// looked for in the folder of the path.
    pub descriptions: Vec<(PathBuf, String)>,
    /// Receives the stages of the work. It may unwind to end a command early: nothing is then written.
    pub watch: Arc<dyn Watch + Send + Sync>,
}

/// What a command has found.
#[derive(Debug, Default)]
pub struct Answer {
    /// False where the data give no answer. What was found is there all the same.
    pub is_answered: bool,
    /// What the command prints on a terminal.
    pub text: String,
    /// Its warnings, in their order.
    pub warnings: Vec<String>,
    /// The document of `--json`; `None` of commands with a document of their own.
    pub document: Option<Document>,
    /// A document that is no report's: what `simulate` has planted, for example.
    pub other: Option<serde_json::Value>,
    /// The measured recordings of commands that measure one test; empty of others.
    pub recordings: Vec<RecordingResult>,
}

/// Reasons for which a command has no answer at all.
#[derive(Debug, thiserror::Error)]
pub enum CallError {
    /// The arguments make no command.
    #[error("{0}")]
    Usage(String),
    /// The command has failed.
    #[error("{text}")]
    Failed {
        /// The message of the command line, without "error: ".
        text: String,
        /// The error behind it.
        cause: anyhow::Error,
    },
}

/// Runs a command for another program. `arguments` begin with the command's name, as in `["run", "test.toml"]`.
///
/// Nothing is printed, and signals stay with the caller. `run` writes a report only where `--out` is given. The threads are
/// those of the pool that the caller is in.
///
/// # Errors
/// [`CallError`]: wrong arguments, bad input, or a command that needs a terminal.
pub fn call(
    arguments: impl IntoIterator<Item = OsString>,
    host: Host,
) -> Result<Answer, CallError> {
    let name = OsString::from("tapjoint");
    let (line, matches) = parse([name].into_iter().chain(arguments))
        .map_err(|usage| CallError::Usage(usage_text(&usage)))?;
    let refused = match line.command {
        Command::Watch(_) => Some(
            "`watch` ends with a signal and needs a terminal; call `run` again where a file has changed",
        ),
        Command::Listen(_) => Some(
            "`listen` reads standard input and needs a terminal; start the program, or call `run` on the file recorded",
        ),
        _ => None,
    };
    if let Some(text) = refused {
        return Err(CallError::Usage(text.to_owned()));
    }
    staging::ledger().written.clear();
    let session = Arc::new(Session {
        host,
        answer: Mutex::default(),
    });
    let outcome = run_command(&line, &matches, None, Some(session.clone()));
    let outcome = outcome.map_err(|cause| CallError::Failed {
        text: error_text(&cause),
        cause,
    })?;
    let mut answer = mem::take(&mut *session.answer());
    answer.is_answered = outcome == Outcome::Answered;
    Ok(answer)
}

/// One call of a command.
pub(super) struct Session {
    host: Host,
    answer: Mutex<Answer>,
}

impl fmt::Debug for Session {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Session").finish_non_exhaustive()
    }
}

impl Session {
    /// Returns the answer so far. A panic elsewhere is no reason to lose it.
    pub(super) fn answer(&self) -> MutexGuard<'_, Answer> {
        self.answer.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the receiver of the stages of the work.
    pub(super) fn watch(&self) -> &Arc<dyn Watch + Send + Sync> {
        &self.host.watch
    }

    /// Announces that a long task goes on, so that the caller can end it.
    pub(super) fn goes_on(&self) {
        drop(Work::begin(self.watch().as_ref(), Stage::Files));
    }

    /// Returns the text of a description in memory; `None` for a file.
    pub(super) fn text_of(&self, path: &Path) -> Option<&str> {
        let given = self.host.descriptions.iter();
        let mut given = given.filter(|(known, _)| known == path);
        given.next().map(|(_, text)| text.as_str())
    }

    /// Returns the description in memory; `None` for a file, and where it is not valid.
    pub(super) fn described(&self, path: &Path) -> Option<TestDescription> {
        TestDescription::parse(self.text_of(path)?, &path.display().to_string()).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DESCRIPTION: &str = r#"
name = "Bar"
[beam]
length = "423 mm"
width = "50 mm"
thickness = "5 mm"
modulus = "207 GPa"
density = 7850
[joint]
kind = "cantilever"
[measured]
frequencies = [17.0, 118.0, 335.6, 628.8, 994.5]
half_line = 0.125
"#;

    fn called(arguments: &[&str]) -> Result<Answer, CallError> {
        let host = Host {
            descriptions: vec![("bar.toml".into(), DESCRIPTION.to_owned())],
            watch: Arc::new(()),
        };
        call(arguments.iter().map(OsString::from), host)
    }

    #[test]
    fn recover_a_joint_from_a_description_in_memory() {
        let answer = called(&["identify", "bar.toml"]).unwrap();
        assert!(answer.is_answered);
        let estimate = answer.document.unwrap().estimate.flatten().unwrap();
        assert_eq!(estimate.modes_used, [1, 2, 3, 4, 5]);
        assert!(answer.text.contains("Kr"), "{}", answer.text);
    }

    #[test]
    fn limit_a_report_is_written_only_where_its_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("report");
        let answer = called(&["run", "bar.toml"]).unwrap();
        assert!(answer.is_answered && !Path::new("Bar-report").exists());
        let out_text = out.to_str().unwrap();
        called(&["run", "bar.toml", "--out", out_text]).unwrap();
        assert!(out.join("report.html").is_file());
    }

    #[test]
    fn regress_errors_have_the_words_of_the_command_line() {
        let missing = called(&["identify", "none.toml"]).unwrap_err();
        assert!(
            missing.to_string().starts_with("none.toml: cannot be read"),
            "{missing}"
        );
        let usage = called(&["identify"]).unwrap_err();
        assert!(matches!(usage, CallError::Usage(_)), "{usage}");
        let watched = called(&["watch", "bar.toml"]).unwrap_err();
        assert!(
            watched.to_string().contains("needs a terminal"),
            "{watched}"
        );
    }
}
