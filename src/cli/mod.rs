//! The command line: arguments, commands, exit codes.
//!
//! Each command turns its clap arguments into library types, calls the library, prints and
//! writes. Exit codes: 0 = answered, 1 = these data give no answer, 2 = wrong usage or bad input.

mod arguments;
mod error_text;
mod input;
mod laboratory;
mod output;
mod overwrite;
mod place;
mod program;
mod progress;
mod publication;
mod staging;
mod terminal;
mod timings;

mod batch;
mod blind_check;
mod blind_tests;
mod change_check;
mod compare;
mod diagnose;
mod embedded;
mod export;
mod frf;
mod identify;
mod listen;
mod plan;
mod predict;
mod recording;
mod resolution;
mod run;
mod simulate;
mod watch;

pub use embedded::{Answer, CallError, Host, call};

use crate::description::TestDescription;
use crate::pipeline::Analysis;
use crate::report::render_timings;
use arguments::CommonArguments;
use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, Subcommand};
use embedded::Session;
use overwrite::{Expanded, Files, described};
use place::is_description;
use std::ffi::OsString;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;
use terminal::Terminal;
use timings::{Stopwatch, TimingsArguments};

/// From hammer taps to joint stiffness.
///
/// Finds the natural frequencies of a beam in recordings of hammer taps, with their resolution bounds.
/// Estimates the stiffness of the joint that holds the beam, and diagnoses the effects that the model
/// lacks. Natural frequencies measured elsewhere can replace the recordings.
#[derive(Debug, Parser)]
#[command(
    name = "tapjoint",
    version,
    after_help = "Start with `tapjoint init > test.toml`. Edit this file, then run `tapjoint run test.toml`.\n\
                  Exit codes: 0 = answered, 1 = these data give no answer, 2 = wrong usage or bad input."
)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: CommonArguments,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(run::RunArguments),
    Watch(watch::WatchArguments),
    Listen(listen::ListenArguments),
    Init(program::InitArguments),
    Inspect(recording::InspectArguments),
    Spectrum(recording::SpectrumArguments),
    Frf(frf::FrfArguments),
    Identify(identify::IdentifyArguments),
    Predict(predict::PredictArguments),
    Perturb(identify::PerturbArguments),
    Plan(plan::PlanArguments),
    Diagnose(diagnose::DiagnoseArguments),
    Compare(compare::CompareArguments),
    Batch(batch::BatchArguments),
    BlindCheck(blind_check::BlindCheckArguments),
    Resolution(resolution::ResolutionArguments),
    Reproduce(program::ReproduceArguments),
    Export(export::ExportArguments),
    Completions(program::CompletionsArguments),
    Man(program::ManArguments),
    Simulate(Box<simulate::SimulateArguments>),
}

/// Outcome of a command that ran without an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    /// The question was answered: exit code 0.
    Answered,
    /// The question has no answer, and the findings have been written: exit code 1.
    NoAnswer,
}

impl Outcome {
    fn of(answered: bool) -> Outcome {
        match answered {
            true => Outcome::Answered,
            false => Outcome::NoAnswer,
        }
    }

    fn of_analysis(analysis: &Analysis) -> Outcome {
        Outcome::of(analysis.is_answered())
    }
}

/// Reads the arguments, the program's name first, runs the command, reports errors, and returns the exit code.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let (line, matches) = match parse(arguments) {
        Ok(parsed) => parsed,
        Err(usage) => {
            terminal::print_usage(&usage);
            return u8::try_from(usage.exit_code()).unwrap_or(2);
        }
    };
    let ready = staging::watch_signals().map_err(Into::into);
    let ready = ready.and_then(|()| line.common.set_threads());
    let outcome = ready.and_then(|()| match &line.command {
        Command::Watch(arguments) => {
            watch::run(arguments, line.common.quiet, || timed(&line, &matches))
        }
        Command::Listen(arguments) => {
            // What the run would refuse is refused before anybody taps.
            checked_files(&line, &matches, None)?;
            listen::run(arguments, &line.common, || timed(&line, &matches))
        }
        _ => timed(&line, &matches),
    });
    match outcome {
        Ok(Outcome::Answered) => 0,
        Ok(Outcome::NoAnswer) => 1,
        Err(error) => {
            terminal::print_error(&error);
            2
        }
    }
}

/// Reads the arguments, the program's name first.
///
/// # Errors
/// They make no command, or ask for help.
fn parse(
    arguments: impl IntoIterator<Item = OsString>,
) -> Result<(CommandLine, ArgMatches), clap::Error> {
    program::grouped::<CommandLine>()
        .try_get_matches_from(arguments)
        .and_then(|matches| Ok((CommandLine::from_arg_matches(&matches)?, matches)))
        .map_err(|usage| program::with_suggestion(usage, &CommandLine::command()))
}

/// Runs the command, and prints what it took where that was asked for.
fn timed(line: &CommandLine, matches: &ArgMatches) -> anyhow::Result<Outcome> {
    let start = Instant::now();
    let timings = line.command.timings();
    let stopwatch = timings
        .is_some_and(|given| given.timings)
        .then(|| Arc::new(Stopwatch::start()));
    let outcome = run_command(line, matches, stopwatch.clone(), None);
    if let Some(stopwatch) = stopwatch.filter(|_| outcome.is_ok() && !line.common.quiet) {
        let _ = write!(
            io::stderr(),
            "{}",
            render_timings(&stopwatch.timings(), terminal::screen())
        );
    }
    if line.common.tells_more() {
        let seconds = start.elapsed().as_secs_f64();
        let threads = rayon::current_num_threads();
        let _ = writeln!(
            io::stderr(),
            "time: {seconds:.1} s, up to {threads} threads; seed {}",
            line.common.seed
        );
    }
    outcome
}

/// Returns the files that the command reads and writes, from its arguments and its test description.
///
/// # Errors
/// It would replace a file that it must not replace.
fn checked_files(
    line: &CommandLine,
    matches: &ArgMatches,
    session: Option<&Session>,
) -> anyhow::Result<Files> {
    let mut files = Files::default();
    if let Some((_, own)) = matches.subcommand() {
        let [test, file] = ["test", "file"].map(|id| own.try_get_one::<PathBuf>(id).ok().flatten());
        let mut named: Vec<PathBuf> = test.or(file).into_iter().cloned().collect();
        if let Command::Run(arguments)
        | Command::Watch(watch::WatchArguments { run: arguments, .. })
        | Command::Listen(listen::ListenArguments { run: arguments, .. }) = &line.command
        {
            named = arguments.subject()?.files().to_vec();
        }
        let description = named.first().map(PathBuf::as_path);
        let description = description.filter(|path| test.is_some() || is_description(path));
        let given = session.zip(description);
        let given = given.and_then(|(session, path)| session.described(path));
        let test = given.or_else(|| description.and_then(described));
        let expanded = line.command.expanded(test.as_ref());
        // `simulate` writes the recordings that the description names.
        let read = description.zip(test.as_ref());
        let read = read.filter(|_| !matches!(line.command, Command::Simulate(_)));
        files = Files::of(own, read, expanded);
        files.add_inputs(&named);
    }
    for folder in files.folders() {
        publication::end_begun(folder, &files)?;
    }
    // A batch checks its inputs once it has listed its tests.
    match line.command {
        Command::Batch(_) => files.check_distinct()?,
        _ => files.check()?,
    }
    Ok(files)
}

/// Runs the command; `session` is the program that it runs in, if that is another one.
fn run_command(
    line: &CommandLine,
    matches: &ArgMatches,
    stopwatch: Option<Arc<Stopwatch>>,
    session: Option<Arc<Session>>,
) -> anyhow::Result<Outcome> {
    let files = checked_files(line, matches, session.as_deref())?;
    let terminal = Terminal::new(&line.common, files, stopwatch, session)?;
    let seed = line.common.seed;
    match &line.command {
        Command::Run(arguments) => run::run(arguments, false, seed, terminal),
        Command::Watch(arguments) => run::run(&arguments.run, true, seed, terminal),
        Command::Listen(arguments) => run::run(&arguments.run, false, seed, terminal),
        Command::Init(arguments) => program::print_template(arguments, terminal),
        Command::Inspect(arguments) => recording::inspect(arguments, terminal),
        Command::Spectrum(arguments) => recording::spectrum(arguments, terminal),
        Command::Frf(arguments) => frf::run(arguments, terminal),
        Command::Identify(arguments) => identify::identify(arguments, terminal),
        Command::Predict(arguments) => predict::run(arguments, terminal),
        Command::Perturb(arguments) => identify::perturb(arguments, seed, terminal),
        Command::Plan(arguments) => plan::run(arguments, seed, terminal),
        Command::Diagnose(arguments) => diagnose::run(arguments, seed, terminal),
        Command::Compare(arguments) => compare::run(arguments, terminal),
        Command::Batch(arguments) => batch::run(arguments, seed, terminal),
        Command::BlindCheck(arguments) if arguments.compare => {
            change_check::run(arguments, seed, terminal)
        }
        Command::BlindCheck(arguments) => blind_check::run(arguments, seed, terminal),
        Command::Resolution(arguments) => resolution::run(arguments, seed, terminal),
        Command::Reproduce(_) => program::print_reproduction(terminal),
        Command::Simulate(arguments) => simulate::run(arguments, seed, terminal),
        Command::Export(arguments) => export::run(arguments, terminal),
        Command::Completions(arguments) => {
            program::print_completions(arguments, CommandLine::command(), terminal)
        }
        Command::Man(arguments) => program::man(arguments, CommandLine::command(), terminal),
    }
}

impl Command {
    /// Returns the option `--timings`; `None` of commands that do not compute from data and do not have it.
    fn timings(&self) -> Option<&TimingsArguments> {
        match self {
            Self::Run(arguments) => Some(&arguments.timings),
            Self::Watch(arguments) => Some(&arguments.run.timings),
            Self::Listen(arguments) => Some(&arguments.run.timings),
            Self::Inspect(arguments) => Some(&arguments.timings),
            Self::Spectrum(arguments) => Some(&arguments.timings),
            Self::Frf(arguments) => Some(&arguments.timings),
            Self::Identify(arguments) => Some(&arguments.timings),
            Self::Perturb(arguments) => Some(&arguments.timings),
            Self::Plan(arguments) => Some(&arguments.timings),
            Self::Diagnose(arguments) => Some(&arguments.timings),
            Self::Compare(arguments) => Some(&arguments.timings),
            Self::Batch(arguments) => Some(&arguments.timings),
            Self::BlindCheck(arguments) => Some(&arguments.timings),
            Self::Resolution(arguments) => Some(&arguments.timings),
            Self::Export(arguments) => Some(&arguments.timings),
            Self::Simulate(arguments) => Some(&arguments.timings),
            Self::Init(_)
            | Self::Predict(_)
            | Self::Reproduce(_)
            | Self::Completions(_)
            | Self::Man(_) => None,
        }
    }

    /// Returns the files of those options that write several files.
    fn expanded(&self, test: Option<&TestDescription>) -> Vec<Expanded> {
        match self {
            Self::Run(arguments) => arguments.expanded(test, false),
            Self::Watch(arguments) => arguments.run.expanded(test, true),
            Self::Listen(arguments) => arguments.run.expanded(test, false),
            Self::Frf(arguments) => arguments.expanded(test),
            Self::BlindCheck(arguments) => arguments.expanded(),
            Self::Compare(arguments) => arguments.expanded(),
            Self::Batch(arguments) => arguments.expanded(),
            Self::Man(arguments) => arguments.expanded(&mut CommandLine::command()),
            Self::Simulate(arguments) => arguments.expanded(test),
            _ => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_every_path_among_the_arguments_is_shown_as_one() {
        use clap::builder::ValueParser;
        let (path, json) = (
            ValueParser::path_buf().type_id(),
            ValueParser::from(clap::value_parser!(arguments::JsonDestination)).type_id(),
        );
        let mut line = CommandLine::command();
        line.build();
        let commands = line.get_subcommands();
        for (command, argument) in commands.flat_map(|c| c.get_arguments().map(move |a| (c, a))) {
            let found = argument.get_value_parser().type_id();
            let names = argument.get_value_names().unwrap_or_default();
            let is_path = names
                .iter()
                .any(|name| ["FILE", "DIR", "TEST", "BEFORE", "AFTER"].contains(&name.as_str()));
            let place = (command.get_name(), argument.get_id());
            assert_eq!(is_path, found == path || found == json, "{place:?}");
        }
    }

    #[test]
    fn limit_every_numeric_argument_stands_in_the_table_of_budgets() {
        use clap::builder::ValueParser;
        use std::collections::BTreeSet;
        let words = [
            ValueParser::path_buf().type_id(),
            ValueParser::string().type_id(),
            ValueParser::from(clap::value_parser!(arguments::JsonDestination)).type_id(),
            ValueParser::new(arguments::variable).type_id(),
        ];
        let mut line = CommandLine::command();
        line.build();
        let mut numeric = BTreeSet::new();
        let commands = line.get_subcommands();
        for (command, argument) in commands.flat_map(|c| c.get_arguments().map(move |a| (c, a))) {
            let is_number = argument.get_action().takes_values()
                && argument.get_possible_values().is_empty()
                && !words.contains(&argument.get_value_parser().type_id());
            if is_number {
                let own = !argument.is_global_set();
                let command = if own { command.get_name() } else { "*" };
                let name = argument.get_long().unwrap_or_default();
                numeric.insert(format!("{command} --{name}"));
            }
        }
        let table = include_str!("../../tests/program/budgets.tsv").lines();
        let rows = table.filter(|line| !line.starts_with('#')).map(|line| {
            let columns: Vec<&str> = line.split('\t').collect();
            assert!(columns.len() == 5 && !columns.contains(&""), "{line}");
            format!("{} {}", columns[0], columns[1])
        });
        assert_eq!(numeric, rows.collect());
    }

    #[test]
    fn regress_clap_finds_no_contradiction_in_the_arguments() {
        CommandLine::command().debug_assert();
    }
}
