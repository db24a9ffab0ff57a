//! `tapjoint reproduce`: the tables of the paper beside the program's numbers.

use super::Outcome;
use super::terminal::Terminal;
use clap::Args;
use tapjoint::report::document::VERSION;
use tapjoint::report::render_reproduction;
use tapjoint::study::publication::reproduce;

/// Print the tables of the paper beside tapjoint's numbers.
///
/// The paper is that of Ingole & Chatterjee. Numbers that differ are marked, with the reason.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tapjoint reproduce")]
pub(super) struct ReproduceArguments {}

pub(super) fn run(_arguments: &ReproduceArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let reproduction = reproduce()?;
    terminal.say(&render_reproduction(&reproduction))?;
    terminal.write_json(&serde_json::json!({
        "version": VERSION,
        "reproduction": reproduction,
        "warnings": [],
    }))?;
    Ok(Outcome::Answered)
}
