//! The command line: arguments, one file per command, exit codes.
//!
//! Each command turns its clap arguments into library types, calls the library, prints and
//! writes. Exit codes: 0 = answered, 1 = these data give no answer, 2 = wrong usage or bad input.

mod arguments;
mod bare;
mod choices;
mod help;
mod input;
mod laboratory;
mod output;
mod overwrite;
mod signature;
mod terminal;
mod updated_model;

mod blind_check;
mod completions;
mod diagnose;
mod export;
mod frf;
mod identify;
mod init;
mod inspect;
mod man;
mod perturb;
mod plan;
mod predict;
mod reproduce;
mod resolution;
mod run;
mod simulate;
mod spectrum;

use arguments::CommonArguments;
use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, Subcommand};
use input::is_description;
use overwrite::{Expanded, Files, described};
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use tapjoint::description::TestDescription;
use terminal::Terminal;

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
    Init(init::InitArguments),
    Inspect(inspect::InspectArguments),
    Spectrum(spectrum::SpectrumArguments),
    Frf(frf::FrfArguments),
    Identify(identify::IdentifyArguments),
    Predict(predict::PredictArguments),
    Perturb(perturb::PerturbArguments),
    Plan(plan::PlanArguments),
    Diagnose(diagnose::DiagnoseArguments),
    BlindCheck(blind_check::BlindCheckArguments),
    Resolution(resolution::ResolutionArguments),
    Reproduce(reproduce::ReproduceArguments),
    Export(export::ExportArguments),
    Completions(completions::CompletionsArguments),
    Man(man::ManArguments),
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

/// Reads the arguments, runs the command, reports errors, and returns the exit code.
pub(super) fn main() -> ExitCode {
    let parsed = help::grouped::<CommandLine>()
        .try_get_matches()
        .and_then(|matches| Ok((CommandLine::from_arg_matches(&matches)?, matches)));
    let (line, matches) = match parsed {
        Ok(parsed) => parsed,
        Err(usage) => {
            let usage = help::with_suggestion(usage, &CommandLine::command());
            // Help whose reader stops early (`tapjoint --help | head`) is no error.
            let _ = usage.print();
            return ExitCode::from(u8::try_from(usage.exit_code()).unwrap_or(2));
        }
    };
    let start = Instant::now();
    let outcome = run_command(&line, &matches);
    if line.common.tells_more() {
        let seconds = start.elapsed().as_secs_f64();
        let threads = rayon::current_num_threads();
        let _ = writeln!(
            io::stderr(),
            "time: {seconds:.1} s, up to {threads} threads; seed {}",
            line.common.seed
        );
    }
    match outcome {
        Ok(Outcome::Answered) => ExitCode::SUCCESS,
        Ok(Outcome::NoAnswer) => ExitCode::from(1),
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            terminal::print_error(&error);
            ExitCode::from(2)
        }
    }
}

fn run_command(line: &CommandLine, matches: &ArgMatches) -> anyhow::Result<Outcome> {
    let files = files_of(line, matches);
    files.check()?;
    line.common.set_threads()?;
    let terminal = Terminal::new(&line.common, files)?;
    match &line.command {
        Command::Run(arguments) => run::run(arguments, line.common.seed, terminal),
        Command::Init(arguments) => init::run(arguments, terminal),
        Command::Inspect(arguments) => inspect::run(arguments, terminal),
        Command::Spectrum(arguments) => spectrum::run(arguments, terminal),
        Command::Frf(arguments) => frf::run(arguments, terminal),
        Command::Identify(arguments) => identify::run(arguments, terminal),
        Command::Predict(arguments) => predict::run(arguments, terminal),
        Command::Perturb(arguments) => perturb::run(arguments, line.common.seed, terminal),
        Command::Plan(arguments) => plan::run(arguments, line.common.seed, terminal),
        Command::Diagnose(arguments) => diagnose::run(arguments, line.common.seed, terminal),
        Command::BlindCheck(arguments) => blind_check::run(arguments, line.common.seed, terminal),
        Command::Resolution(arguments) => resolution::run(arguments, line.common.seed, terminal),
        Command::Reproduce(arguments) => reproduce::run(arguments, terminal),
        Command::Simulate(arguments) => simulate::run(arguments, line.common.seed, terminal),
        Command::Export(arguments) => export::run(arguments, terminal),
        Command::Completions(arguments) => {
            completions::run(arguments, CommandLine::command(), terminal)
        }
        Command::Man(arguments) => man::run(arguments, CommandLine::command(), terminal),
    }
}

/// Collects the files that a command reads and writes, from its arguments and its test description.
fn files_of(line: &CommandLine, matches: &ArgMatches) -> Files {
    let Some((_, own)) = matches.subcommand() else {
        return Files::default();
    };
    let [test, file] = ["test", "file"].map(|id| own.try_get_one::<PathBuf>(id).ok().flatten());
    let description = test.or(file.filter(|path| is_description(path)));
    let test = description.and_then(|path| described(path));
    let expanded = line.command.expanded(test.as_ref());
    // `simulate` writes the recordings that the description names.
    let read = description.map(PathBuf::as_path).zip(test.as_ref());
    let read = read.filter(|_| !matches!(line.command, Command::Simulate(_)));
    Files::of(own, read, expanded)
}

impl Command {
    /// Returns the files of those options that write several files.
    fn expanded(&self, test: Option<&TestDescription>) -> Vec<Expanded> {
        match self {
            Self::Run(arguments) => arguments.expanded(test),
            Self::Frf(arguments) => arguments.expanded(test),
            Self::BlindCheck(arguments) => arguments.expanded(),
            Self::Man(arguments) => arguments.expanded(&mut CommandLine::command()),
            Self::Simulate(arguments) => arguments.expanded(test),
            _ => Vec::new(),
        }
    }
}

/// Returns true if the reader of the output has closed it, as `head` does.
fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause
            .downcast_ref::<std::io::Error>()
            .is_some_and(|io| io.kind() == std::io::ErrorKind::BrokenPipe)
    })
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
                .any(|name| ["FILE", "DIR", "TEST"].contains(&name.as_str()));
            let place = (command.get_name(), argument.get_id());
            assert_eq!(is_path, found == path || found == json, "{place:?}");
        }
    }

    #[test]
    fn regress_clap_finds_no_contradiction_in_the_arguments() {
        CommandLine::command().debug_assert();
    }
}
