//! `tapjoint identify`: joint stiffness from natural frequencies alone.

use super::Outcome;
use super::arguments::{Numbers, frequencies, half_lines};
use super::choices::method;
use super::input::{TestFile, read_test};
use super::run::outcome;
use super::terminal::Terminal;
use anyhow::bail;
use clap::Args;
use std::path::PathBuf;
use tapjoint::description::MeasuredFrequencies;
use tapjoint::pipeline::{EstimateMethod, IdentifySettings};
use tapjoint::report::{document_of, render_text};

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
        let count = measured.frequencies.len();
        measured.half_line = match half_lines.as_slice() {
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

pub(super) fn run(arguments: &IdentifyArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let file = resolve(&arguments.test, &arguments.frequencies, &terminal)?;
    let analysis = file.analyse(&IdentifySettings {
        method: arguments.method,
        ..IdentifySettings::unperturbed()
    })?;
    let document = document_of(&analysis);
    terminal.say(&render_text(&document))?;
    terminal.write_document(&document)?;
    Ok(outcome(&analysis))
}
