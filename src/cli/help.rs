//! Help that lists the commands by what one wants to do.

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
    ("What the model misses", &["plan", "diagnose"]),
    ("Virtual tests", &["simulate", "blind-check", "reproduce"]),
    (OTHER, &["completions", "man", "help"]),
];
const OTHER: &str = "The program itself";

/// Where the command list stands among the other parts of the help.
const PARTS: (&str, &str) = (
    "{about-with-newline}\n{usage-heading} {usage}\n",
    "\nOptions:\n{options}{after-help}",
);

/// The command line with its commands listed by task.
pub(super) fn grouped<C: CommandFactory>() -> Command {
    let mut command = C::command();
    // Building adds `help` to the commands.
    command.build();
    let (head, tail) = PARTS;
    let template = format!("{head}{}{tail}", command_list(&command));
    C::command().help_template(template)
}

/// The commands, a heading for each task.
fn command_list(command: &Command) -> String {
    let named: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
    let width = named.iter().map(|name| name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for (task, members) in TASKS {
        let others = named
            .iter()
            .filter(|name| *task == OTHER && !has_task(name));
        let listed = members
            .iter()
            .filter(|member| named.contains(member))
            .chain(others);
        let lines: Vec<String> = listed
            .filter_map(|name| Some((name, command.find_subcommand(name)?)))
            .map(|(name, found)| format!("  {name:width$}  {}\n", summary(found)))
            .collect();
        if !lines.is_empty() {
            text.push_str(&format!("\n{task}:\n{}", lines.concat()));
        }
    }
    text
}

fn has_task(name: &str) -> bool {
    TASKS.iter().any(|(_, members)| members.contains(&name))
}

/// First sentence of a command's description, as far as 80 columns take it.
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

/// What helps with a wrong command line, where clap knows no better: the nearest command, or how several files are
/// taken together.
pub(super) fn with_suggestion(error: clap::Error, command: &Command) -> clap::Error {
    match error.kind() {
        ErrorKind::UnknownArgument => with_description(error),
        _ => with_nearest(error, command),
    }
}

/// Commands take one file, and `*.wav` gives them many.
fn with_description(mut error: clap::Error) -> clap::Error {
    let is_file = |value: &ContextValue| match value {
        ContextValue::String(name) => std::path::Path::new(name).is_file(),
        _ => false,
    };
    if error.get(ContextKind::InvalidArg).is_some_and(is_file) {
        let tip = "one file at a time; recordings of one test belong in a description, which \
                   `tapjoint init *.wav > test.toml` begins";
        let tip = ContextValue::StyledStrs(vec![tip.into()]);
        error.insert(ContextKind::Suggested, tip);
    }
    error
}

/// Names the nearest command where clap found none near enough: two letters changed places are the
/// commonest slip, and count as one change here.
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
