//! `tapjoint diagnose`: the cause of the gap between model and measurement.
//!
//! The model with the diagnosed effects goes into report.json and into a file, here and in `run`.

use super::Outcome;
use super::arguments::FullAnswer;
use super::identify::{FrequencyArguments, resolve};
use super::input::file_name;
use super::output::OutputFile;
use super::terminal::Terminal;
use super::timings::TimingsArguments;
use crate::description::TestDescription;
use crate::gap::{Diagnosis, GapError, GapSettings, Verdict};
use crate::pipeline::{Analysis, IdentifySettings, Stage, Work, diagnose_test};
use crate::report::document::{Document, GapSection, SheetSection, UpdatedModelSection};
use crate::report::{MODEL_FILE, document_of, gap_section};
use crate::study::updated_model::{described_frequencies, updated_model};
use clap::Args;
use std::path::PathBuf;

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
    #[command(flatten)]
    full: FullAnswer,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
}

pub(super) fn run(
    arguments: &DiagnoseArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let file = resolve(&arguments.test, &arguments.frequencies, &terminal)?;
    let output = OutputFile::prepare_optional(arguments.model.as_deref())?;
    let analysis = file.analyse(
        &IdentifySettings::unperturbed(),
        &terminal.measuring(file.test.recordings.len()),
    )?;
    let settings = GapSettings {
        seed,
        ..GapSettings::default()
    };
    let mut work = Work::begin(terminal.watch(), Stage::Diagnosis);
    let diagnosis = diagnose_test(&file.test, &analysis, &settings);
    let mut document = document_of(&analysis);
    let mut gap = gap_section(diagnosis.as_ref());
    let name = arguments.model.as_deref().map(file_name);
    let text = add_model(
        &mut gap,
        &file.test,
        name,
        &analysis,
        diagnosis.as_ref().ok(),
    );
    document.add_gap(gap);
    work.go_on(Stage::Files);
    match (output, text) {
        (None, _) => {}
        (Some(output), Some(text)) => output.write(text.as_bytes())?,
        (Some(_), None) => {
            let reason = match diagnosis.as_ref().map(|found| &found.verdict) {
                Err(_) => "nothing was diagnosed",
                Ok(Verdict::Unknown) => "nothing in the catalogue explains the readings",
                Ok(_) => "what was found cannot be written as a description",
            };
            // An existing file stays, although it belongs to another diagnosis.
            let file = arguments.model.as_ref().filter(|file| file.exists());
            let stays = file.map(|file| format!("; {} is left as it was", file.display()));
            terminal.warn(&format!(
                "there is no model to write: {reason}{}",
                stays.unwrap_or_default()
            ));
        }
    }
    drop(work);
    terminal.keep(&analysis);
    terminal.answer(&document, None, &arguments.full)?;
    terminal.write_document(&document)?;
    Ok(Outcome::of(diagnosis.is_ok()))
}

/// What a report shows of a test.
#[derive(Debug)]
pub(super) struct Reported {
    /// The document.
    pub(super) document: Document,
    /// Text of the model with the diagnosed effects; `None` without such a model.
    pub(super) model: Option<String>,
}

/// Returns what a report shows of an analysed test. `test` is its description; the diagnosis is that of this description.
pub(super) fn reported(
    analysis: &Analysis,
    test: Option<&TestDescription>,
    diagnosis: Option<&Result<Diagnosis, GapError>>,
) -> Reported {
    let mut document = document_of(analysis);
    document.sheet = test.map(SheetSection::of);
    let mut model = None;
    if let (Some(test), Some(diagnosis)) = (test, diagnosis) {
        let mut gap = gap_section(diagnosis.as_ref());
        let name = Some(MODEL_FILE.to_owned());
        model = add_model(&mut gap, test, name, analysis, diagnosis.as_ref().ok());
        document.add_gap(gap);
    }
    Reported { document, model }
}

/// Adds the model with the diagnosed effects to a section of report.json, and returns its text; `None` without
/// such a model. `name` is the name of the file that will hold the text.
fn add_model(
    gap: &mut GapSection,
    test: &TestDescription,
    name: Option<String>,
    analysis: &Analysis,
    diagnosis: Option<&Diagnosis>,
) -> Option<String> {
    let model = updated_model(test, diagnosis?)?;
    let highest = analysis.modes.iter().filter_map(|mode| mode.mode).max()?;
    // The text is read back, so that report.json holds the frequencies of the file.
    let written = TestDescription::parse(&model.text, MODEL_FILE).ok()?;
    let frequencies = described_frequencies(&written, highest).ok()?;
    gap.updated_model = Some(UpdatedModelSection {
        effect: model.hypothesis,
        file: name,
        frequencies,
    });
    Some(model.text)
}
