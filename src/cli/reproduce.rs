//! `tapjoint reproduce`: the paper's tables beside ours.

use super::Outcome;
use super::terminal::Terminal;
use anyhow::bail;
use clap::Args;

/// Print every table of the paper (Ingole & Chatterjee) beside our numbers, and mark what does
/// not reproduce and why.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tapjoint reproduce")]
pub(super) struct ReproduceArguments {}

pub(super) fn run(_arguments: &ReproduceArguments, _terminal: Terminal) -> anyhow::Result<Outcome> {
    bail!("`reproduce` is not connected to the library yet")
}
