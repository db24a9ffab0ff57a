//! `tapjoint inspect`: what is in a recording.

use super::Outcome;
use super::arguments::RecordingArguments;
use super::input::check_file;
use super::terminal::Terminal;
use anyhow::bail;
use clap::Args;
use std::path::PathBuf;

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

pub(super) fn run(arguments: &InspectArguments, _terminal: Terminal) -> anyhow::Result<Outcome> {
    arguments
        .files
        .iter()
        .try_for_each(|file| check_file(file))?;
    bail!("`inspect` is not connected to the library yet")
}
