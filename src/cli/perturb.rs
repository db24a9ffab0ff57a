//! `tapjoint perturb`: how frequency errors move the estimate.

use super::Outcome;
use super::arguments::{Numbers, percents};
use super::choices::{perturbed_by, perturbed_methods};
use super::identify::{FrequencyArguments, resolve};
use super::output::OutputFile;
use super::terminal::Terminal;
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::PathBuf;
use tapjoint::pipeline::{EstimateMethod, IdentifySettings};
use tapjoint::report::{document_of, render_cloud_picture, render_perturbation_csv, render_text};

/// Monte Carlo samples that give 95 % limits to a tenth of their distance.
const SAMPLES: usize = 2000;

/// Show how the estimate changes when the frequencies are wrong.
///
/// Changes all frequencies by a percentage, up and down. Changes every mode by its resolution bound,
/// alone and in all combinations of signs. Draws random errors by the standard deviations (Monte Carlo).
/// Shows the pair regression and the consistent estimate side by side.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint perturb test.toml --percent 0.05,0.1\n  tapjoint perturb test.toml --frequencies 17,118,335.6,628.8 --half-line 0.125 --seed 7"
)]
pub(super) struct PerturbArguments {
    /// Test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    /// Changes of all frequencies, up and down (%)
    #[arg(long, value_name = "P,P,...", default_value = "0.05,0.1", value_parser = percents)]
    percent: Numbers,
    #[command(flatten)]
    frequencies: FrequencyArguments,
    /// Estimate to perturb
    #[arg(long, value_name = "M", default_value = "both", value_parser = perturbed_methods())]
    method: &'static [EstimateMethod],
    /// Number of Monte Carlo samples
    #[arg(long, value_name = "N", default_value_t = SAMPLES, value_parser = RangedU64ValueParser::<usize>::new().range(10..=1_000_000))]
    samples: usize,
    /// Draw the estimates, Kx against Ky, into this file (PNG, or SVG if its name ends in .svg)
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Write all numbers as comma separated values into this file
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

pub(super) fn run(
    arguments: &PerturbArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let file = resolve(&arguments.test, &arguments.frequencies, &terminal)?;
    let png = OutputFile::prepare_optional(arguments.png.as_deref())?;
    let csv = OutputFile::prepare_optional(arguments.csv.as_deref())?;
    let settings = IdentifySettings {
        percents: arguments.percent.clone(),
        monte_carlo: Some((arguments.samples, seed)),
        ..perturbed_by(arguments.method)
    };
    let analysis = file.analyse(&settings)?;
    let document = document_of(&analysis);
    if let Some(file) = png {
        match render_cloud_picture(&document, file.picture_format())? {
            Some(bytes) => file.write(&bytes)?,
            None => terminal.warn("there are no estimates of Kx and Ky to draw"),
        }
    }
    if let Some(file) = csv {
        file.write(render_perturbation_csv(&document)?.as_bytes())?;
    }
    terminal.say(&render_text(&document))?;
    terminal.write_document(&document)?;
    let perturbed = analysis
        .identification
        .is_some_and(|found| !found.perturbations.is_empty());
    Ok(if perturbed {
        Outcome::Answered
    } else {
        Outcome::NoAnswer
    })
}
