//! `tapjoint export`: the beam with its joint as input of a finite-element program.

use super::Outcome;
use super::input::{TestFile, effect_at, read_model};
use super::output::OutputFile;
use super::terminal::Terminal;
use super::timings::TimingsArguments;
use crate::description::TestDescription;
use crate::pipeline::{IdentifySettings, tested_structure};
use crate::report::deck::{
    Deck, DeckError, DeckSource, LONGEST_REPORT, USUAL_FREQUENCIES, deck_of, deck_with_effects,
    doubts_of, render_abaqus, render_nastran, source_in_report, source_of,
};
use crate::structure::Assembly;
use crate::study::updated_model::described_structure;
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Write beam and joint as input of a finite-element program.
///
/// The joint is estimated from the test's data, or taken from an earlier report. A joint that TEST gives
/// is written as it is. Springs with cross coupling are the inverse of the joint's compliance. Of a
/// model with effects, masses, springs, dimensions and cracks are written.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint export test.toml --format nastran --out joint.bdf\n  tapjoint export test.toml --report test-report/report.json --format abaqus > joint.inp\n  tapjoint export test-report/updated-model.toml --out model.bdf"
)]
pub(super) struct ExportArguments {
    /// Test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    /// Format of the file
    #[arg(long, value_enum, default_value_t)]
    format: DeckFormat,
    /// Take joint and beam from this report.json instead of estimating them. Recordings are then not
    /// read
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write into this file; default: standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
}

/// Formats of finite-element input.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum DeckFormat {
    /// Bulk data: CBAR and CELAS2
    #[default]
    Nastran,
    /// Input file: B23 (Timoshenko: B21) and SPRING elements
    Abaqus,
}

pub(super) fn run(arguments: &ExportArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let file = read_model(&arguments.test, &terminal)?;
    let output = OutputFile::prepare_optional(arguments.out.as_deref())?;
    let deck = match file.test.effects.is_empty() {
        true => deck_of_test(&file, arguments.report.as_deref(), &terminal)?,
        false => deck_of_model(&file, arguments.report.as_deref())?,
    };
    let deck = match deck {
        Ok(deck) => deck,
        Err(problem) => {
            terminal.warn(&problem.to_string());
            return Ok(Outcome::NoAnswer);
        }
    };
    let text = match arguments.format {
        DeckFormat::Nastran => render_nastran(&deck),
        DeckFormat::Abaqus => render_abaqus(&deck),
    };
    match output {
        Some(output) => {
            output.write(text.as_bytes())?;
            let name = arguments.out.as_deref().unwrap_or(Path::new(""));
            terminal.say(&format!("Deck  {}", name.display()))?;
        }
        None => terminal.say(&text)?,
    }
    terminal.write_json(&serde_json::json!({ "deck": text }))?;
    Ok(Outcome::Answered)
}

/// Returns the deck of a test, whose joint is estimated or reported.
fn deck_of_test(
    file: &TestFile,
    report: Option<&Path>,
    terminal: &Terminal,
) -> anyhow::Result<Result<Deck, DeckError>> {
    let source = match report {
        Some(path) => Ok(reported(path, &file.test)?),
        None => estimated(file, terminal)?,
    };
    if let Ok(source) = &source
        && source.misses()
    {
        terminal.warn(&format!(
            "{}; the springs of the deck are no better known than that",
            source.doubts.join("; ")
        ));
    }
    Ok(source.and_then(|source| deck_of(&file.test.name, &source)))
}

/// Returns the deck of a description with effects, which is a model already: its joint is the described one.
fn deck_of_model(
    file: &TestFile,
    report: Option<&Path>,
) -> anyhow::Result<Result<Deck, DeckError>> {
    let (test, name) = (&file.test, &file.name);
    if let Some((report, effect)) = report.zip(test.effects.first()) {
        bail!(
            "{name}:{}: [[effect]] belongs to models, whose joint is described; leave --report {} out",
            effect.line,
            report.display()
        );
    }
    let structure = tested_structure(test);
    if structure.assembly != Assembly::Free && structure.known.over(None).is_none() {
        return Ok(Err(DeckError::NoJoint {
            reason: "a description with [[effect]] has to state kt and kr in [joint]".to_owned(),
        }));
    }
    let (seen, frequencies) =
        described_structure(test, USUAL_FREQUENCIES).map_err(|error| effect_at(name, &error))?;
    let effects: Vec<&str> = test.effects.iter().map(|one| one.id.as_str()).collect();
    let origin = format!("described, with {}", effects.join(", "));
    Ok(deck_with_effects(
        &test.name,
        &origin,
        &seen.specimen,
        &frequencies,
    ))
}

/// Estimates the joint from the test's own data.
fn estimated(
    file: &TestFile,
    terminal: &Terminal,
) -> anyhow::Result<Result<DeckSource, DeckError>> {
    file.test.check_has_data(&file.name)?;
    file.check_recordings()?;
    let analysis = file.analyse(
        &IdentifySettings::unperturbed(),
        &terminal.measuring(file.test.recordings.len()),
    )?;
    Ok(source_of(&file.test, &analysis).map(|source| DeckSource {
        doubts: doubts_of(&analysis),
        ..source
    }))
}

/// Returns the joint of a report with its beam.
fn reported(path: &Path, test: &TestDescription) -> anyhow::Result<DeckSource> {
    let name = path.display().to_string();
    let mut text = String::new();
    // One byte more than allowed tells that there are more.
    File::open(path)
        .and_then(|file| file.take(LONGEST_REPORT + 1).read_to_string(&mut text))
        .with_context(|| format!("{name}: cannot be read"))?;
    source_in_report(&text, &name, test).with_context(|| name)
}
