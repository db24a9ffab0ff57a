//! `tapjoint completions`: scripts that let a shell complete commands and options.

use super::Outcome;
use super::terminal::Terminal;
use clap::{Args, Command};
use clap_complete::{Shell, generate};

/// Print the completion script of a shell.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  tapjoint completions bash > ~/.local/share/bash-completion/completions/tapjoint"
)]
pub(super) struct CompletionsArguments {
    /// Shell
    #[arg(value_enum)]
    shell: Shell,
}

pub(super) fn run(
    arguments: &CompletionsArguments,
    mut command: Command,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    generate(arguments.shell, &mut command, "tapjoint", &mut script);
    let script = String::from_utf8(script)?;
    terminal.say(&script)?;
    terminal.write_json(&serde_json::json!({ "script": script }))?;
    Ok(Outcome::Answered)
}
