//! `tapjoint diagnose`: the gap between model and measurement.

use super::Outcome;
use super::identify::{FrequencyArguments, resolve};
use super::terminal::Terminal;
use clap::Args;
use std::path::PathBuf;
use tapjoint::gap::GapSettings;
use tapjoint::pipeline::{IdentifySettings, diagnose_test};
use tapjoint::report::{document_of, gap_section, render_gap_text};

/// Say where the gap between model and measurement lies, which effect causes it, and how far it
/// closes once that effect is added.
///
/// Answers may also be that nothing is missing, that something unknown is, or that these data cannot
/// tell.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tapjoint diagnose test.toml")]
pub(super) struct DiagnoseArguments {
    /// A test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    #[command(flatten)]
    frequencies: FrequencyArguments,
}

pub(super) fn run(
    arguments: &DiagnoseArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let file = resolve(&arguments.test, &arguments.frequencies, &terminal)?;
    let analysis = file.analyse(&IdentifySettings::default())?;
    let settings = GapSettings {
        seed,
        ..GapSettings::default()
    };
    let diagnosis = diagnose_test(&file.test, &analysis, &settings);
    let mut document = document_of(&analysis);
    document.gap = Some(gap_section(diagnosis.as_ref()));
    terminal.say(&render_gap_text(&document))?;
    terminal.write_document(&document)?;
    Ok(if diagnosis.is_ok() {
        Outcome::Answered
    } else {
        Outcome::NoAnswer
    })
}
