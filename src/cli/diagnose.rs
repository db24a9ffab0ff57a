//! `tapjoint diagnose`: the gap between model and measurement.

use super::Outcome;
use super::identify::{FrequencyArguments, resolve};
use super::output::OutputFile;
use super::terminal::Terminal;
use super::updated_model::add_model;
use clap::Args;
use std::path::{Path, PathBuf};
use tapjoint::gap::{Diagnosis, GapSettings, Verdict};
use tapjoint::pipeline::{IdentifySettings, diagnose_test};
use tapjoint::report::{document_of, gap_section, render_gap_text};

/// Say where the gap between model and measurement lies, which effect causes it, and how far it
/// closes once that effect is added.
///
/// Answers may also be that nothing is missing, that something unknown is, or that these data cannot
/// tell.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint diagnose test.toml\n  tapjoint diagnose test.toml --model updated-model.toml"
)]
pub(super) struct DiagnoseArguments {
    /// A test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    #[command(flatten)]
    frequencies: FrequencyArguments,
    /// Write the model with what was found, for `tapjoint predict`; none where nothing explains the readings
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
}

pub(super) fn run(
    arguments: &DiagnoseArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let file = resolve(&arguments.test, &arguments.frequencies, &terminal)?;
    let output = arguments
        .model
        .as_deref()
        .map(OutputFile::prepare)
        .transpose()?;
    let analysis = file.analyse(&IdentifySettings::unperturbed())?;
    let settings = GapSettings {
        seed,
        ..GapSettings::default()
    };
    let diagnosis = diagnose_test(&file.test, &analysis, &settings);
    let mut document = document_of(&analysis);
    let mut gap = gap_section(diagnosis.as_ref());
    let name = arguments.model.as_deref().and_then(Path::file_name);
    let name = name.map(|name| name.to_string_lossy().into_owned());
    let text = add_model(&mut gap, (&file, name), (&analysis, diagnosis.as_ref()));
    document.gap = Some(gap);
    match (output, text) {
        (Some(output), Some(text)) => output.write(text.as_bytes())?,
        (Some(_), None) => {
            let left = arguments
                .model
                .as_deref()
                .map_or_else(String::new, left_as_it_was);
            terminal.warn(&format!("{}{left}", no_model(diagnosis.as_ref().ok())));
        }
        (None, _) => {}
    }
    terminal.say(&render_gap_text(&document))?;
    terminal.write_document(&document)?;
    Ok(if diagnosis.is_ok() {
        Outcome::Answered
    } else {
        Outcome::NoAnswer
    })
}

/// That a file of an earlier diagnosis does not belong to this one; empty where there is none.
fn left_as_it_was(model: &Path) -> String {
    match model.exists() {
        true => format!("; {} is left as it was", model.display()),
        false => String::new(),
    }
}

/// Why there is no model to write.
fn no_model(diagnosis: Option<&Diagnosis>) -> &'static str {
    match diagnosis.map(|found| &found.verdict) {
        None => "there is no model to write: nothing was diagnosed",
        Some(Verdict::Unknown) => {
            "there is no model to write: nothing in the catalogue explains the readings"
        }
        Some(_) => "there is no model to write: what was found cannot be written as a description",
    }
}
