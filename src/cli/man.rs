//! `tapjoint man`: manual pages.

use super::Outcome;
use super::output::OutputFolder;
use super::terminal::Terminal;
use anyhow::bail;
use clap::{Args, Command};
use clap_mangen::Man;
use std::path::PathBuf;

/// Print the manual page of the program or of a command, or write all pages into a folder.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  tapjoint man run > tapjoint-run.1\n  tapjoint man --out man1")]
pub(super) struct ManArguments {
    /// A command; default: the program
    #[arg(value_name = "COMMAND")]
    command: Option<String>,
    /// Write every page into this folder
    #[arg(long, value_name = "DIR", conflicts_with = "command")]
    out: Option<PathBuf>,
}

pub(super) fn run(
    arguments: &ManArguments,
    mut command: Command,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    command.build();
    let written = match &arguments.out {
        Some(folder) => {
            let pages = pages(&command)?;
            let output = OutputFolder::prepare(folder)?;
            for (name, page) in &pages {
                output.add(name, page)?;
            }
            let folder = output.publish()?;
            terminal.say(&format!("{} pages in {}", pages.len(), folder.display()))?;
            serde_json::json!({ "pages": pages.iter().map(|(name, _)| name).collect::<Vec<_>>() })
        }
        None => {
            let page = String::from_utf8(page(chosen(&command, arguments.command.as_deref())?)?)?;
            terminal.say(&page)?;
            serde_json::json!({ "page": page })
        }
    };
    terminal.write_json(&written)?;
    Ok(Outcome::Answered)
}

/// The page of every command, with its file name; the program's own first.
fn pages(command: &Command) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let own = std::iter::once(command);
    let commands = command
        .get_subcommands()
        .filter(|found| found.get_name() != "help");
    own.chain(commands)
        .map(|found| Ok((format!("{}.1", page_name(found)), page(found)?)))
        .collect()
}

fn page(command: &Command) -> anyhow::Result<Vec<u8>> {
    let mut text = Vec::new();
    Man::new(command.clone()).render(&mut text)?;
    Ok(text)
}

/// "tapjoint-run" for the command `run`.
fn page_name(command: &Command) -> &str {
    command.get_display_name().unwrap_or(command.get_name())
}

fn chosen<'a>(command: &'a Command, name: Option<&str>) -> anyhow::Result<&'a Command> {
    let Some(name) = name else {
        return Ok(command);
    };
    match command.find_subcommand(name) {
        Some(found) => Ok(found),
        None => {
            let names: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
            bail!("there is no command {name}; there are {}", names.join(", "))
        }
    }
}
