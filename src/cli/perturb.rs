//! `tapjoint perturb`: how frequency errors move the estimate.

use super::Outcome;
use super::arguments::PercentList;
use super::choices::MethodArgument;
use super::identify::{FrequencyArguments, resolve};
use super::terminal::Terminal;
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::PathBuf;
use tapjoint::pipeline::{EstimateMethod, IdentifySettings};
use tapjoint::report::{document_of, render_text};

/// Show how the estimate moves when the frequencies are wrong.
///
/// All frequencies by a percentage up and down, every mode by its own resolution bound (all sign
/// patterns), and at random (Monte Carlo).
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint perturb test.toml --percent 0.05,0.1\n  tapjoint perturb test.toml --frequencies 17,118,335.6,628.8 --half-line 0.125 --seed 7"
)]
pub(super) struct PerturbArguments {
    /// A test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    /// Changes of all frequencies, up and down (%)
    #[arg(long, value_name = "P,P,...", default_value = "0.05,0.1")]
    percent: PercentList,
    #[command(flatten)]
    frequencies: FrequencyArguments,
    /// How to estimate
    #[arg(long, value_enum, default_value_t)]
    method: MethodArgument,
    /// Monte Carlo samples
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = RangedU64ValueParser::<usize>::new().range(10..=10_000_000))]
    samples: usize,
}

pub(super) fn run(
    arguments: &PerturbArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let file = resolve(&arguments.test, &arguments.frequencies, &terminal)?;
    let settings = IdentifySettings {
        // What is perturbed is the pair regression.
        method: EstimateMethod::Pairs,
        percents: arguments.percent.0.clone(),
        monte_carlo: Some((arguments.samples, seed)),
        ..Default::default()
    };
    let analysis = file.analyse(&settings)?;
    let document = document_of(&analysis);
    terminal.say(&render_text(&document))?;
    terminal.write_document(&document)?;
    let perturbed = analysis
        .identification
        .is_some_and(|found| found.perturbation.is_some());
    Ok(if perturbed {
        Outcome::Answered
    } else {
        Outcome::NoAnswer
    })
}
