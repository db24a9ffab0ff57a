//! `tapjoint inspect`: what is in a recording.

use super::Outcome;
use super::arguments::RecordingArguments;
use super::input::check_file;
use super::terminal::Terminal;
use clap::Args;
use std::path::PathBuf;
use tapjoint::pipeline::inspect_bare;
use tapjoint::report::{inspection_of, render_text};

/// Show what is in recordings: channels, rate, length, clipping, DC, taps found, what is wrong
/// with them.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tapjoint inspect taps.wav --hammer 1")]
pub(super) struct InspectArguments {
    /// Recordings (WAV, CSV)
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    recording: RecordingArguments,
}

pub(super) fn run(arguments: &InspectArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    arguments
        .files
        .iter()
        .try_for_each(|file| check_file(file))?;
    let mut recordings = Vec::with_capacity(arguments.files.len());
    for file in &arguments.files {
        let recording = arguments.recording.open(file)?;
        recordings.push(inspect_bare(
            recording,
            arguments.recording.hammer.as_ref(),
        )?);
    }
    let warnings: Vec<_> = recordings
        .iter()
        .flat_map(|found| found.measurement.warnings.clone())
        .collect();
    let found = recordings
        .iter()
        .any(|recording| !recording.measurement.taps.taps.is_empty());
    let document = inspection_of(&recordings, &warnings);
    terminal.say(&render_text(&document))?;
    terminal.write_document(&document)?;
    Ok(if found {
        Outcome::Answered
    } else {
        Outcome::NoAnswer
    })
}
