//! `tapjoint export`: the beam with its identified joint for a finite-element program.

use super::Outcome;
use super::input::read_test;
use super::output::OutputFile;
use super::terminal::Terminal;
use anyhow::{Context, anyhow};
use clap::{Args, ValueEnum};
use serde_json::Value;
use std::path::{Path, PathBuf};
use tapjoint::pipeline::{IdentifySettings, TestedStructure, tested_structure};
use tapjoint::report::deck::{deck_of, render_abaqus, render_nastran};
use tapjoint::structure::JointStiffness;
use tapjoint::structure::joint::StiffnessUnits;

/// Write the updated beam with its joint for a finite-element program.
///
/// The joint is estimated from the test's data, or taken from a report that was made of it; where it is
/// known, that is written. Springs with cross coupling are the inverse of the joint's compliance.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint export test.toml --format nastran --out joint.bdf\n  tapjoint export test.toml --report test-report/report.json --format abaqus > joint.inp"
)]
pub(super) struct ExportArguments {
    /// A test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    /// Format
    #[arg(long, value_enum, default_value_t)]
    format: DeckFormat,
    /// Take the joint from this report.json instead of estimating it
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write into this file; default: print
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
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
    let file = read_test(&arguments.test, &terminal)?;
    file.test.check_has_data(&file.name)?;
    file.check_recordings()?;
    let output = arguments
        .out
        .as_deref()
        .map(OutputFile::prepare)
        .transpose()?;
    let structure = tested_structure(&file.test);
    let joint = arguments
        .report
        .as_deref()
        .map(|path| reported_joint(path, &structure))
        .transpose()?;
    let progress = terminal.progress("estimating the joint");
    let analysis = file.analyse(&IdentifySettings::default())?;
    drop(progress);
    let deck = match deck_of(&file.test, &analysis, joint) {
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
        Some(output) => output.write(text.as_bytes())?,
        None => terminal.say(&text)?,
    }
    terminal.write_json(&serde_json::json!({ "version": 1, "deck": text }))?;
    Ok(Outcome::Answered)
}

/// The joint of a report, non-dimensional by the described beam, and where it is from.
fn reported_joint(
    path: &Path,
    structure: &TestedStructure,
) -> anyhow::Result<(JointStiffness, String)> {
    let name = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    let report: Value = serde_json::from_str(&text)
        .with_context(|| format!("{name}: is no report; give a report.json of `tapjoint run`"))?;
    let units = StiffnessUnits::of(&structure.beam);
    // Null instead of a value is a rigid joint, null instead of the quantity an unknown one.
    let stiffness = |key: &str| match &report["estimate"][key] {
        Value::Object(found) => Some(found.get("value")?.as_f64().unwrap_or(f64::INFINITY)),
        _ => None,
    };
    let known = &structure.known;
    let of = |key: &str, unit: f64, known: Option<f64>| {
        stiffness(key).map(|value| value / unit).or(known).ok_or_else(|| {
            anyhow!("{name}: has no estimate.{key}; give a report with an estimate, or leave --report out")
        })
    };
    let cross = stiffness("ktr")
        .map(|ktr| units.ktr / ktr)
        .or(known.cross_compliance);
    let joint = JointStiffness {
        kx: of("kt", units.kt, known.kx)?,
        ky: of("kr", units.kr, known.ky)?,
        cross_compliance: cross.unwrap_or(0.0),
    };
    Ok((joint, format!("from {name}")))
}
