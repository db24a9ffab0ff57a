//! `tapjoint init`: a commented test description to begin with.

use super::Outcome;
use super::choices::KindArgument;
use super::terminal::Terminal;
use clap::Args;
use serde_json::json;
use tapjoint::description::template;

/// Print a commented test.toml with every key, its unit and its default.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tapjoint init --kind lap > test.toml")]
pub(super) struct InitArguments {
    /// Kind of structure
    #[arg(long, value_enum, default_value_t = KindArgument::Cantilever)]
    kind: KindArgument,
}

pub(super) fn run(arguments: &InitArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let text = template(arguments.kind.into());
    terminal.say(&text)?;
    terminal.write_json(&json!({ "version": 1, "template": text }))?;
    Ok(Outcome::Answered)
}
