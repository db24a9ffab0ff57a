//! `tapjoint init`: a commented test description to begin with.

use super::Outcome;
use super::choices::KindArgument;
use super::terminal::Terminal;
use clap::Args;
use serde_json::json;
use tapjoint::description::{runnable_template, template_of};

/// Print a commented test.toml with every key, its unit and its default.
///
/// Of recordings that are named it makes their tables; without any, frequencies stand in for them, so
/// that what is printed runs as it is.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint init > test.toml && tapjoint run test.toml\n  tapjoint init --kind lap low.wav high.wav > test.toml"
)]
pub(super) struct InitArguments {
    /// Recordings of the test, as seen from the folder of the description
    #[arg(value_name = "RECORDING")]
    recordings: Vec<String>,
    /// Kind of structure
    #[arg(long, value_enum, default_value_t = KindArgument::Cantilever)]
    kind: KindArgument,
}

pub(super) fn run(arguments: &InitArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let kind = arguments.kind.into();
    let text = match arguments.recordings.as_slice() {
        [] => runnable_template(kind),
        files => template_of(kind, files),
    };
    terminal.say(&text)?;
    terminal.write_json(&json!({ "template": text }))?;
    Ok(Outcome::Answered)
}
