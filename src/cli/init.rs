//! `tapjoint init`: a commented test description to begin with.

use super::Outcome;
use super::choices::assembly;
use super::terminal::Terminal;
use clap::Args;
use serde_json::json;
use tapjoint::description::{Assembly, runnable_template, template_of};

/// Print a commented test.toml with every key, unit and default.
///
/// Each RECORDING gets its own table. Without recordings the file holds example frequencies, so that it
/// runs unchanged.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint init > test.toml && tapjoint run test.toml\n  tapjoint init --kind lap low.wav high.wav > test.toml"
)]
pub(super) struct InitArguments {
    /// Recordings of the test, relative to the folder of the description
    #[arg(value_name = "RECORDING")]
    recordings: Vec<String>,
    /// Kind of structure
    #[arg(long, default_value = "cantilever", value_parser = assembly())]
    kind: Assembly,
}

pub(super) fn run(arguments: &InitArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let text = match arguments.recordings.as_slice() {
        [] => runnable_template(arguments.kind),
        files => template_of(arguments.kind, files),
    };
    terminal.say(&text)?;
    terminal.write_json(&json!({ "template": text }))?;
    Ok(Outcome::Answered)
}
