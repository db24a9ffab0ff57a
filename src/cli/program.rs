//! The program itself: its help, and the commands that print what it knows.
//!
//! These commands are `init`, `reproduce`, `completions` and `man`.

use super::Outcome;
use super::arguments::assembly;
use super::overwrite::Expanded;
use super::publication::OutputFolder;
use super::terminal::Terminal;
use crate::description::{Assembly, FoundContent, runnable_template, template_of};
use crate::pipeline::look_at;
use crate::report::document::VERSION;
use crate::report::render_reproduction;
use crate::study::publication::reproduce;
use anyhow::bail;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, Command, CommandFactory};
use clap_complete::{Shell, generate};
use clap_mangen::Man;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Tasks and their commands. A test makes sure that every command has its task; one that had none would stand under the last.
const TASKS: &[(&str, &[&str])] = &[
    (
        "A test from recordings to report",
        &["init", "listen", "run", "watch", "inspect"],
    ),
    ("Spectra", &["spectrum", "frf"]),
    (
        "The joint",
        &["identify", "predict", "perturb", "resolution", "export"],
    ),
    ("Effects that the model lacks", &["plan", "diagnose"]),
    ("Several tests", &["compare", "batch"]),
    ("Virtual tests", &["simulate", "blind-check", "reproduce"]),
    (OTHER, &["completions", "man", "help"]),
];
const OTHER: &str = "The program itself";

/// The parts of the help before and after the command list.
const PARTS: (&str, &str) = (
    "{about-with-newline}\n{usage-heading} {usage}\n",
    "\nOptions:\n{options}{after-help}",
);

/// Returns the command line with its commands listed by task.
pub(super) fn grouped<C: CommandFactory>() -> Command {
    const ROOM: usize = 64;
    let mut command = C::command();
    // Building adds `help` to the commands.
    command.build();
    let named: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
    let width = named.iter().map(|name| name.len()).max().unwrap_or(0);
    let (mut template, tail) = (PARTS.0.to_owned(), PARTS.1);
    for (task, members) in TASKS {
        let mut listed: Vec<&str> = members.to_vec();
        if *task == OTHER {
            let with_task: Vec<&str> = TASKS.iter().flat_map(|(_, names)| names.to_vec()).collect();
            listed.extend(named.iter().filter(|name| !with_task.contains(name)));
        }
        let known = listed
            .iter()
            .filter_map(|name| command.find_subcommand(name));
        let lines: Vec<String> = known
            .map(|found| {
                // The first sentence of its description, cut to 80 columns.
                let about = found
                    .get_about()
                    .map(ToString::to_string)
                    .unwrap_or_default();
                let mut about = about.trim_end_matches('.').to_owned();
                if about.chars().count() > ROOM {
                    let kept: String = about.chars().take(ROOM - 4).collect();
                    let end = kept.rfind([' ', ',', ':']).unwrap_or(kept.len());
                    about = format!("{} ...", kept[..end].trim_end_matches([',', ':']));
                }
                format!("  {:width$}  {about}\n", found.get_name())
            })
            .collect();
        if !lines.is_empty() {
            template.push_str(&format!("\n{task}:\n{}", lines.concat()));
        }
    }
    template.push_str(tail);
    C::command().help_template(template)
}

/// Adds a suggestion to the error of a wrong command line where clap has none.
pub(super) fn with_suggestion(mut error: clap::Error, command: &Command) -> clap::Error {
    const MOST_CHANGES: usize = 2;
    if let Some(ContextValue::String(name)) = error.get(ContextKind::InvalidArg)
        && error.kind() == ErrorKind::UnknownArgument
        && std::path::Path::new(name).is_file()
    {
        // Commands take one file, and `*.wav` gives many: a description takes them all.
        let tip = "give one file; for several recordings of one test write a description, \
                   which `tapjoint init *.wav > test.toml` begins";
        let tip = ContextValue::StyledStrs(vec![tip.into()]);
        error.insert(ContextKind::Suggested, tip);
    } else if let Some(ContextValue::String(wanted)) = error.get(ContextKind::InvalidSubcommand)
        && error.kind() == ErrorKind::InvalidSubcommand
        && error.get(ContextKind::SuggestedSubcommand).is_none()
    {
        // Two exchanged letters are the most frequent typing error, and count as one change here.
        let names = command.get_subcommands().map(Command::get_name);
        let nearest = names
            .map(|name| (strsim::damerau_levenshtein(wanted, name), name))
            .min();
        if let Some((_, name)) = nearest.filter(|(changes, _)| *changes <= MOST_CHANGES) {
            let suggestion = ContextValue::Strings(vec![name.to_owned()]);
            error.insert(ContextKind::SuggestedSubcommand, suggestion);
        }
    }
    error
}

/// Print a commented test.toml with every key, unit and default.
///
/// Each RECORDING is opened and gets its own table; channels, names, units, forms and the hammer are written as found.
/// Beam and positions stay examples. Without recordings the file holds example frequencies, so that it runs unchanged.
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

pub(super) fn print_template(
    arguments: &InitArguments,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let mut found = Vec::with_capacity(arguments.recordings.len());
    for name in &arguments.recordings {
        let file = look_at(Path::new(name), name);
        if let FoundContent::Unread(problem) = &file.content {
            terminal.warn(problem);
        }
        found.push(file);
    }
    let text = match found.as_slice() {
        [] => runnable_template(arguments.kind),
        files => template_of(arguments.kind, files),
    };
    terminal.say(&text)?;
    terminal.write_json(&json!({ "template": text }))?;
    Ok(Outcome::Answered)
}

/// Print the tables of the paper beside tapjoint's numbers.
///
/// The paper is that of Ingole & Chatterjee. Numbers that differ are marked, with the reason.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tapjoint reproduce")]
pub(super) struct ReproduceArguments {}

pub(super) fn print_reproduction(terminal: Terminal) -> anyhow::Result<Outcome> {
    let reproduction = reproduce()?;
    terminal.say(&render_reproduction(&reproduction, terminal.screen()))?;
    terminal.write_json(&json!({
        "version": VERSION,
        "reproduction": reproduction,
        "warnings": [],
    }))?;
    Ok(Outcome::Answered)
}

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

pub(super) fn print_completions(
    arguments: &CompletionsArguments,
    mut command: Command,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    generate(arguments.shell, &mut command, "tapjoint", &mut script);
    let script = String::from_utf8(script)?;
    terminal.say(&script)?;
    terminal.write_json(&json!({ "script": script }))?;
    Ok(Outcome::Answered)
}

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

pub(super) fn man(
    arguments: &ManArguments,
    mut command: Command,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    command.build();
    let written = match &arguments.out {
        Some(folder) => {
            let output = OutputFolder::prepare(folder, terminal.files())?;
            let mut names = Vec::new();
            for found in with_pages(&command) {
                let name = file_name(found);
                output.add(&name, &page(found)?)?;
                names.push(name);
            }
            let folder = output.publish()?;
            terminal.say(&format!("{} pages in {}", names.len(), folder.display()))?;
            json!({ "pages": names })
        }
        None => {
            let page = String::from_utf8(page(chosen(&command, arguments.command.as_deref())?)?)?;
            terminal.say(&page)?;
            json!({ "page": page })
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
