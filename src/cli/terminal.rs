//! What goes to standard output and standard error, and to `--json`.

use super::arguments::{CommonArguments, JsonDestination};
use super::output::OutputFile;
use std::io::{self, Write};
use tapjoint::report::{document::Document, render_json};

/// Where a command's words go.
#[derive(Debug)]
pub(super) struct Terminal {
    json: Option<Json>,
    quiet: bool,
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
    pub(super) fn new(common: &CommonArguments) -> anyhow::Result<Self> {
        let json = match &common.json {
            None => None,
            Some(JsonDestination::StandardOutput) => Some(Json::StandardOutput),
            Some(JsonDestination::File(path)) => Some(Json::File(OutputFile::prepare(path)?)),
        };
        Ok(Self {
            json,
            quiet: common.quiet,
        })
    }

    /// Whether it was asked to print nothing but errors.
    pub(super) fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Prints an answer, unless it was asked to be quiet or standard output belongs to JSON.
    pub(super) fn say(&self, text: &str) -> io::Result<()> {
        if self.quiet || matches!(self.json, Some(Json::StandardOutput)) {
            return Ok(());
        }
        print(text)
    }

    /// Prints a warning on standard error, unless it was asked to be quiet. A standard error that
    /// cannot be written to is nothing that could be reported.
    pub(super) fn warn(&self, text: &str) {
        if !self.quiet {
            let _ = writeln!(io::stderr(), "warning: {text}");
        }
    }

    /// Writes a report's document to where `--json` says, if it says anything. Call it last.
    pub(super) fn write_document(self, document: &Document) -> anyhow::Result<()> {
        if self.json.is_none() {
            return Ok(());
        }
        // The very text of report.json: reading numbers back could move their last digit.
        self.write_text(&render_json(document)?)
    }

    /// Writes the document to where `--json` says, if it says anything. Call it last.
    pub(super) fn write_json(self, document: &serde_json::Value) -> anyhow::Result<()> {
        let mut text = serde_json::to_string_pretty(document)?;
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
