//! `tapjoint man`: manual pages.

use super::Outcome;
use super::output::OutputFolder;
use super::overwrite::Expanded;
use super::terminal::Terminal;
use anyhow::bail;
use clap::{Args, Command};
use clap_mangen::Man;
use std::path::PathBuf;

/// Print a manual page, or write all manual pages into a folder.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  tapjoint man run > tapjoint-run.1\n  tapjoint man --out man1")]
pub(super) struct ManArguments {
    /// Command; default: the program itself
    #[arg(value_name = "COMMAND")]
    command: Option<String>,
    /// Write all pages into this folder
    #[arg(long, value_name = "DIR", conflicts_with = "command")]
    out: Option<PathBuf>,
}

impl ManArguments {
    /// Returns the pages of `--out`.
    pub(super) fn expanded(&self, command: &mut Command) -> Vec<Expanded> {
        let Some(folder) = &self.out else {
            return Vec::new();
        };
        command.build();
        let pages = with_pages(command).map(|page| folder.join(file_name(page)));
        vec![("out", pages.collect())]
    }
}

pub(super) fn run(
    arguments: &ManArguments,
    mut command: Command,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    command.build();
    let written = match &arguments.out {
        Some(folder) => {
            let output = OutputFolder::prepare(folder)?;
            let mut names = Vec::new();
            for found in with_pages(&command) {
                let name = file_name(found);
                output.add(&name, &page(found)?)?;
                names.push(name);
            }
            let folder = output.publish(terminal.files())?;
            terminal.say(&format!("{} pages in {}", names.len(), folder.display()))?;
            serde_json::json!({ "pages": names })
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

/// Returns the program and all its commands.
fn with_pages(command: &Command) -> impl Iterator<Item = &Command> {
    let commands = command
        .get_subcommands()
        .filter(|found| found.get_name() != "help");
    std::iter::once(command).chain(commands)
}

fn page(command: &Command) -> anyhow::Result<Vec<u8>> {
    let mut text = Vec::new();
    Man::new(command.clone()).render(&mut text)?;
    Ok(text)
}

/// Returns the name of a page, such as "tapjoint-run.1" for the command `run`.
fn file_name(command: &Command) -> String {
    let name = command.get_display_name().unwrap_or(command.get_name());
    format!("{name}.1")
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
