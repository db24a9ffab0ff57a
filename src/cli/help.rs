//! Help that lists the commands by task.

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, CommandFactory};

/// Tasks and their commands; a command that is not named here is listed under the last.
const TASKS: &[(&str, &[&str])] = &[
    (
        "A test from recordings to report",
        &["init", "run", "inspect", "batch", "compare"],
    ),
    ("Spectra", &["spectrum", "frf"]),
    (
        "The joint",
        &["identify", "predict", "perturb", "resolution", "export"],
    ),
    ("Effects that the model lacks", &["plan", "diagnose"]),
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
            .map(|found| format!("  {:width$}  {}\n", found.get_name(), summary(found)))
            .collect();
        if !lines.is_empty() {
            template.push_str(&format!("\n{task}:\n{}", lines.concat()));
        }
    }
    template.push_str(tail);
    C::command().help_template(template)
}

/// Returns the first sentence of a command's description, cut to 80 columns.
fn summary(command: &Command) -> String {
    const ROOM: usize = 64;
    let about = command
        .get_about()
        .map(ToString::to_string)
        .unwrap_or_default();
    let about = about.trim_end_matches('.');
    if about.chars().count() <= ROOM {
        return about.to_owned();
    }
    let kept: String = about.chars().take(ROOM - 4).collect();
    let end = kept.rfind([' ', ',', ':']).unwrap_or(kept.len());
    format!("{} ...", kept[..end].trim_end_matches([',', ':']))
}

/// Adds a suggestion to the error of a wrong command line where clap has none.
///
/// Commands take one file, and `*.wav` gives many: a description takes them all.
pub(super) fn with_suggestion(mut error: clap::Error, command: &Command) -> clap::Error {
    if error.kind() != ErrorKind::UnknownArgument {
        return with_nearest(error, command);
    }
    if let Some(ContextValue::String(name)) = error.get(ContextKind::InvalidArg)
        && std::path::Path::new(name).is_file()
    {
        let tip = "give one file; for several recordings of one test write a description, \
                   which `tapjoint init *.wav > test.toml` begins";
        let tip = ContextValue::StyledStrs(vec![tip.into()]);
        error.insert(ContextKind::Suggested, tip);
    }
    error
}

/// Suggests the nearest command where clap finds none. Two exchanged letters are the most frequent typing
/// error, and count as one change here.
fn with_nearest(mut error: clap::Error, command: &Command) -> clap::Error {
    const MOST_CHANGES: usize = 2;
    let known = error.get(ContextKind::SuggestedSubcommand).is_some();
    let wanted = match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(name)) if error.kind() == ErrorKind::InvalidSubcommand => {
            name.clone()
        }
        _ => return error,
    };
    let names = command.get_subcommands().map(Command::get_name);
    let nearest = names
        .map(|name| (strsim::damerau_levenshtein(&wanted, name), name))
        .min();
    if let Some((_, name)) = nearest.filter(|(changes, _)| !known && *changes <= MOST_CHANGES) {
        let suggestion = ContextValue::Strings(vec![name.to_owned()]);
        error.insert(ContextKind::SuggestedSubcommand, suggestion);
    }
    error
}
