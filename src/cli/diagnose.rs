//! `tapjoint diagnose`: the cause of the gap between model and measurement.

use super::Outcome;
use super::identify::{FrequencyArguments, resolve};
use super::input::file_name;
use super::output::OutputFile;
use super::terminal::Terminal;
use super::updated_model::add_model;
use clap::Args;
use std::path::{Path, PathBuf};
use tapjoint::gap::{Diagnosis, GapSettings, Verdict};
use tapjoint::pipeline::{IdentifySettings, diagnose_test};
use tapjoint::report::{document_of, gap_section, render_gap_text};

/// Find the cause of the gap between model and measurement.
///
/// Reports where the gap lies, which effect causes it, and how much of it this effect explains. The
/// answer can also be that nothing is missing, that an unknown effect is missing, or that these data
/// cannot decide.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint diagnose test.toml\n  tapjoint diagnose test.toml --model updated-model.toml"
)]
pub(super) struct DiagnoseArguments {
    /// Test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    #[command(flatten)]
    frequencies: FrequencyArguments,
    /// Write the model with the diagnosed effect into this file, for `tapjoint predict`. Nothing is written
    /// if no effect explains the readings
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
}

pub(super) fn run(
    arguments: &DiagnoseArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let file = resolve(&arguments.test, &arguments.frequencies, &terminal)?;
    let output = OutputFile::prepare_optional(arguments.model.as_deref())?;
    let analysis = file.analyse(&IdentifySettings::unperturbed())?;
    let settings = GapSettings {
        seed,
        ..GapSettings::default()
    };
    let diagnosis = diagnose_test(&file.test, &analysis, &settings);
    let mut document = document_of(&analysis);
    let mut gap = gap_section(diagnosis.as_ref());
    let name = arguments.model.as_deref().map(file_name);
    let text = add_model(&mut gap, &file, name, &analysis, diagnosis.as_ref().ok());
    document.gap = Some(gap);
    if let Some(output) = output {
        match text {
            Some(text) => output.write(text.as_bytes())?,
            None => terminal.warn(&no_model(
                diagnosis.as_ref().ok(),
                arguments.model.as_deref(),
            )),
        }
    }
    terminal.say(&render_gap_text(&document))?;
    terminal.write_document(&document)?;
    Ok(if diagnosis.is_ok() {
        Outcome::Answered
    } else {
        Outcome::NoAnswer
    })
}

/// Returns the warning that no model is written. An existing file stays, although it belongs to another
/// diagnosis.
fn no_model(diagnosis: Option<&Diagnosis>, file: Option<&Path>) -> String {
    let reason = match diagnosis.map(|found| &found.verdict) {
        None => "nothing was diagnosed",
        Some(Verdict::Unknown) => "nothing in the catalogue explains the readings",
        Some(_) => "what was found cannot be written as a description",
    };
    let mut text = format!("there is no model to write: {reason}");
    if let Some(file) = file.filter(|file| file.exists()) {
        text.push_str(&format!("; {} is left as it was", file.display()));
    }
    text
}
