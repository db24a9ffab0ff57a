//! `tapjoint export`: the beam with its joint as input of a finite-element program.

use super::Outcome;
use super::input::{TestFile, effect_at, read_model};
use super::output::OutputFile;
use super::terminal::Terminal;
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use serde_json::Value;
use std::path::{Path, PathBuf};
use tapjoint::description::TestDescription;
use tapjoint::identify::consistent::JointedStructure;
use tapjoint::pipeline::{
    IdentifySettings, TestedStructure, frequencies_of, jointed_structure, structure_details,
    tested_structure,
};
use tapjoint::report::deck::{
    Deck, DeckError, DeckSource, deck_of, deck_with_effects, render_abaqus, render_nastran,
    source_of,
};
use tapjoint::report::document_of;
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::{Assembly, Beam, JointStiffness};
use tapjoint::study::updated_model::described_structure;

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
}

/// Number of predicted frequencies at the head of a deck, if the report predicts none.
const USUAL_MODES: usize = 6;

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
    if let Some(doubts) = source.as_ref().ok().map(|source| source.doubts.join("; "))
        && doubts.contains(MISSES)
    {
        terminal.warn(&format!(
            "{doubts}; the springs of the deck are no better known than that"
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
        described_structure(test, USUAL_MODES).map_err(|error| effect_at(name, &error))?;
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
    let progress = terminal.progress("estimating the joint");
    let analysis = file.analyse(&IdentifySettings::unperturbed())?;
    drop(progress);
    let report = serde_json::to_value(document_of(&analysis))?;
    Ok(source_of(&file.test, &analysis).map(|source| DeckSource {
        doubts: doubts_of(&report),
        ..source
    }))
}

/// Beginning of a sentence on the misfit.
const MISSES: &str = "the model misses";

/// Returns the misfit of a report's model, if it has one, and the limits of its joint.
fn doubts_of(report: &Value) -> Vec<String> {
    let warnings = report["warnings"].as_array().into_iter().flatten();
    let texts = warnings
        .filter(|warning| warning["code"] == "misfit")
        .filter_map(|warning| warning["text"].as_str());
    // The text goes on with limits of non-dimensional stiffnesses.
    let misfit = texts.filter_map(|text| text.split(';').next());
    let misfit = misfit.filter(|text| text.starts_with(MISSES));
    let limits = all_limits(&report["estimate"]);
    misfit.map(str::to_owned).chain(limits).collect()
}

/// Returns the limits of all stiffnesses, those that are scaled by the misfit first.
fn all_limits(estimate: &Value) -> Vec<String> {
    let mut lines = Vec::new();
    for (scaled, how, low, high) in [
        (true, " scaled by the misfit", "low_scaled", "high_scaled"),
        (false, "", "low", "high"),
    ] {
        let mut limits = Vec::new();
        for (key, unit) in [("kt", "N/m"), ("kr", "N m/rad"), ("ktr", "N/rad")] {
            let found = &estimate[key];
            if scaled != (found["low_scaled"].is_number() || found["high_scaled"].is_number()) {
                continue;
            }
            let words = match (found[low].as_f64(), found[high].as_f64()) {
                (Some(low), Some(high)) => format!("{low:.3e} to {high:.3e}"),
                (Some(low), None) => format!("above {low:.3e}"),
                (None, Some(high)) => format!("below {high:.3e}"),
                (None, None) => continue,
            };
            limits.push(format!("{key} {words} {unit}"));
        }
        if !limits.is_empty() {
            lines.push(format!("95 % limits{how}: {}", limits.join(", ")));
        }
    }
    lines
}

/// Returns the joint of a report with its beam.
fn reported(path: &Path, test: &TestDescription) -> anyhow::Result<DeckSource> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    let report: Value = serde_json::from_str(&text)
        .with_context(|| format!("{name}: is no report; give a report.json of `tapjoint run`"))?;
    let estimate = &report["estimate"];
    let structure = tested_structure(test);
    // The described beam with the properties that the report estimates.
    let mut beam = structure.beam;
    if let Some(modulus) = estimate["modulus"]["value"].as_f64() {
        beam.modulus = modulus;
    }
    // A free beam's closed form gives its modulus, or else its density, never both.
    if let Some(density) = estimate["density"]["value"].as_f64()
        && estimate["method"] != "free-beam"
    {
        beam.density = density;
    }
    for (key, property) in [
        ("length", &mut beam.length),
        ("width", &mut beam.width),
        ("thickness", &mut beam.thickness),
        ("modulus", &mut beam.modulus),
        ("density", &mut beam.density),
    ] {
        if let Some(value) = estimate["beam"][key].as_f64() {
            *property = value;
        }
    }
    let joint = reported_joint(estimate, &structure, &beam).with_context(|| {
        format!(
            "{name}: has no estimate of the joint; give a report with one, or leave --report out"
        )
    })?;
    let sound = joint.check();
    sound.with_context(|| format!("{name}: its joint is not physical"))?;
    // A closed form was estimated without masses and unequal halves, so it contains their effect.
    let whole = estimate["method"] == "consistent" || structure.known.over(None).is_some();
    let details = structure_details(test, &structure.beam);
    let structure = match whole {
        true => jointed_structure(&structure, &details).with_beam(&beam),
        false => JointedStructure::new(structure.theory, beam, structure.assembly),
    };
    let count = report["prediction"]
        .as_array()
        .map_or(USUAL_MODES, Vec::len);
    Ok(DeckSource {
        frequencies: frequencies_of(&structure, &joint, count)
            .with_context(|| format!("{name}: no frequencies follow from its joint"))?,
        structure,
        joint,
        origin: format!("from {name}"),
        doubts: doubts_of(&report),
    })
}

/// Returns the joint of a report, non-dimensional by its beam.
fn reported_joint(
    estimate: &Value,
    structure: &TestedStructure,
    beam: &Beam,
) -> Option<JointStiffness> {
    if structure.assembly == Assembly::Free {
        return Some(JointStiffness::FREE);
    }
    let units = StiffnessUnits::of(beam);
    let described = StiffnessUnits::of(&structure.beam);
    let known = &structure.known;
    let kt = reported_stiffness(estimate, "kt").or(known.kx.map(|kx| kx * described.kt))?;
    let kr = reported_stiffness(estimate, "kr").or(known.ky.map(|ky| ky * described.kr))?;
    let ktr =
        reported_stiffness(estimate, "ktr").or(known.cross_compliance.map(|c| described.ktr / c));
    Some(JointStiffness {
        kx: kt / units.kt,
        ky: kr / units.kr,
        cross_compliance: ktr.map_or(0.0, |ktr| units.ktr / ktr),
    })
}

/// Returns a stiffness of a report. A value of null is a rigid joint, a quantity of null an unknown one.
fn reported_stiffness(estimate: &Value, key: &str) -> Option<f64> {
    match estimate[key].as_object()?.get("value")? {
        Value::Null => Some(f64::INFINITY),
        value => value.as_f64(),
    }
}
