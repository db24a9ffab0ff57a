//! `tapjoint identify`: joint stiffness from natural frequencies alone. `tapjoint perturb`: how frequency errors move it.

use super::Outcome;
use super::arguments::{
    FullAnswer, Numbers, frequencies, half_lines, method, percents, perturbed_by, perturbed_methods,
};
use super::input::{TestFile, read_test};
use super::output::OutputFile;
use super::terminal::Terminal;
use super::timings::TimingsArguments;
use crate::description::MeasuredFrequencies;
use crate::pipeline::{EstimateMethod, IdentifySettings, Stage, Work};
use crate::report::{document_of, render_cloud_picture, render_perturbation_csv};
use anyhow::bail;
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::PathBuf;

/// Estimate joint stiffness from natural frequencies alone.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint identify test.toml\n  tapjoint identify test.toml --frequencies 17,118,335.6,628.8,994.5 --half-line 0.125"
)]
pub(super) struct IdentifyArguments {
    /// Test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    #[command(flatten)]
    frequencies: FrequencyArguments,
    /// Method of the estimate
    #[arg(long, default_value = "consistent", value_parser = method())]
    method: EstimateMethod,
    #[command(flatten)]
    full: FullAnswer,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
}

/// Frequencies on the command line.
#[derive(Debug, Args)]
pub(super) struct FrequencyArguments {
    /// Natural frequencies of modes 1, 2, ... (Hz). They replace the data of TEST and their bounds
    #[arg(long, value_name = "HZ,HZ,...", allow_negative_numbers = true, value_parser = frequencies)]
    frequencies: Option<Numbers>,
    /// Half of the line spacing (Hz): one number, or one for each frequency
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = half_lines)]
    half_line: Option<Numbers>,
}

impl FrequencyArguments {
    /// Replaces the description's frequencies and bounds by those of the command line.
    ///
    /// # Errors
    /// Half lines without frequencies, or neither one nor as many half lines as frequencies.
    pub(super) fn apply(&self, file: &mut TestFile) -> anyhow::Result<()> {
        if let Some(frequencies) = &self.frequencies {
            file.test.recordings.clear();
            file.test.measured = Some(MeasuredFrequencies {
                file: None,
                frequencies: frequencies.clone(),
                modes: (1..=frequencies.len()).collect(),
                half_line: None,
                std: None,
                scatter: None,
            });
        }
        let Some(half_lines) = &self.half_line else {
            return Ok(());
        };
        let Some(measured) = &mut file.test.measured else {
            bail!(
                "--half-line needs frequencies that were read elsewhere; give --frequencies, or [measured] in {}",
                file.name
            );
        };
        if let Some(modes) = &mut measured.file {
            modes.key_lines.remove("half_line");
        }
        let count = measured.frequencies.len();
        measured.half_line = match half_lines.as_slice() {
            // The number of modes of a file is not known before it is read.
            list if measured.file.is_some() => Some(list.to_vec()),
            [one] => Some(vec![*one; count]),
            list if list.len() == count => Some(list.to_vec()),
            list => bail!(
                "--half-line has {} values for {count} frequencies; give one, or one for each",
                list.len()
            ),
        };
        measured.std = None;
        Ok(())
    }
}

/// Reads the description, puts the command line's frequencies into it, and checks that there is
/// something to analyse.
pub(super) fn resolve(
    test: &std::path::Path,
    frequencies: &FrequencyArguments,
    terminal: &Terminal,
) -> anyhow::Result<TestFile> {
    let mut file = read_test(test, terminal)?;
    frequencies.apply(&mut file)?;
    file.test.check_has_data(&file.name)?;
    file.check_recordings()?;
    Ok(file)
}

pub(super) fn identify(
    arguments: &IdentifyArguments,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let file = resolve(&arguments.test, &arguments.frequencies, &terminal)?;
    let analysis = file.analyse(
        &IdentifySettings {
            method: arguments.method,
            ..IdentifySettings::unperturbed()
        },
        &terminal.measuring(file.test.recordings.len()),
    )?;
    let document = document_of(&analysis);
    terminal.keep(&analysis);
    terminal.answer(&document, None, &arguments.full)?;
    terminal.write_document(&document)?;
    Ok(Outcome::of_analysis(&analysis))
}

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
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
}

pub(super) fn perturb(
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
    let analysis = file.analyse(&settings, &terminal.measuring(file.test.recordings.len()))?;
    let document = document_of(&analysis);
    let mut work = Work::begin(terminal.watch(), Stage::Pictures);
    if let Some(file) = png {
        match render_cloud_picture(&document, file.picture_format())? {
            Some(bytes) => file.write(&bytes)?,
            None => terminal.warn("there are no estimates of Kx and Ky to draw"),
        }
    }
    work.go_on(Stage::Files);
    if let Some(file) = csv {
        file.write(render_perturbation_csv(&document)?.as_bytes())?;
    }
    drop(work);
    terminal.tables(&document)?;
    let perturbed = analysis
        .identification
        .is_some_and(|found| !found.perturbations.is_empty());
    Ok(Outcome::of(perturbed))
}
