//! The joint of an earlier report as the source of a deck.

use super::{DeckSource, MOST_FREQUENCIES};
use crate::document_of;
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;
use tapjoint_analysis::{
    Analysis, TestedStructure, frequencies_of, jointed_structure, structure_details,
    tested_structure,
};
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{Assembly, Beam, JointStiffness, StructureError};
use tapjoint_description::TestDescription;
use tapjoint_identify::IdentifyError;
use tapjoint_identify::consistent::JointedStructure;

/// Most bytes of a report: a hundred times what a long test makes.
pub const LONGEST_REPORT: u64 = 1 << 26;

/// Number of predicted frequencies at the head of a deck, if the report predicts none.
pub const USUAL_FREQUENCIES: usize = 6;

/// Beginning of a sentence on the misfit.
const MISSES: &str = "the model misses";

/// Reasons for which a report gives no joint.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// Too many bytes.
    #[error(
        "has more than {} MB; allowed: a report.json of `tapjoint run`",
        LONGEST_REPORT >> 20
    )]
    TooLong,
    /// No JSON, or other JSON.
    #[error("is no report; give a report.json of `tapjoint run`")]
    Shape {
        /// The parser's message, with line and column.
        source: serde_json::Error,
    },
    /// A value that no report has.
    #[error("`{key}` is {value}; allowed: {allowed}; give a report.json of `tapjoint run`")]
    Value {
        /// Path of the key, such as `estimate.kt.value`.
        key: String,
        /// The value, or its beginning.
        value: String,
        /// Values that are taken.
        allowed: &'static str,
    },
    /// Neither the report nor the description has a joint.
    #[error("has no estimate of the joint; give a report with one, or leave --report out")]
    NoJoint,
    /// The joint cannot exist.
    #[error("its joint is not physical")]
    NotPhysical(#[source] StructureError),
    /// No mode can be found.
    #[error("no frequencies follow from its joint")]
    NoFrequencies(#[source] IdentifyError),
    /// A frequency is beyond all numbers.
    #[error(
        "mode {mode} of its joint has the frequency {frequency} Hz; allowed: positive finite frequencies; check the beam of report and description"
    )]
    Frequency {
        /// The mode.
        mode: usize,
        /// Its frequency (Hz).
        frequency: f64,
    },
}

/// Keys of a report that a deck needs.
#[derive(Debug, Default, Deserialize)]
struct ReportFile {
    #[serde(default)]
    estimate: Value,
    #[serde(default)]
    prediction: Option<Vec<IgnoredAny>>,
    #[serde(default)]
    warnings: Option<Vec<Warning>>,
}

/// A warning of a report.
#[derive(Debug, Deserialize)]
struct Warning {
    #[serde(default)]
    code: String,
    #[serde(default)]
    text: String,
}

/// Reads the text of a report, and returns its joint with the beam that belongs to it. `name` is the file's, `test`
/// the description that the report was made of.
///
/// # Errors
/// [`ReportError`] where the text is no report or gives no joint.
pub fn source_in_report(
    text: &str,
    name: &str,
    test: &TestDescription,
) -> Result<DeckSource, ReportError> {
    if text.len() as u64 > LONGEST_REPORT {
        return Err(ReportError::TooLong);
    }
    let report: ReportFile =
        serde_json::from_str(text).map_err(|source| ReportError::Shape { source })?;
    let estimate = &report.estimate;
    let structure = tested_structure(test);
    let beam = reported_beam(estimate, &structure.beam)?;
    let joint = reported_joint(estimate, &structure, &beam)?.ok_or(ReportError::NoJoint)?;
    joint.check().map_err(ReportError::NotPhysical)?;
    // A closed form was estimated without masses and unequal halves, so it contains their effect.
    let whole = estimate["method"] == "consistent" || structure.known.over(None).is_some();
    let details = structure_details(test, &structure.beam);
    let structure = match whole {
        true => jointed_structure(&structure, &details).with_beam(&beam),
        false => JointedStructure::new(structure.theory, beam, structure.assembly),
    };
    let count = report
        .prediction
        .as_ref()
        .map_or(USUAL_FREQUENCIES, Vec::len);
    if count > MOST_FREQUENCIES {
        return Err(ReportError::Value {
            key: "prediction".to_owned(),
            value: format!("a list of {count}"),
            allowed: "up to 40 modes",
        });
    }
    let frequencies =
        frequencies_of(&structure, &joint, count).map_err(ReportError::NoFrequencies)?;
    let odd = frequencies
        .iter()
        .position(|frequency| !(frequency.is_finite() && *frequency > 0.0));
    if let Some(at) = odd {
        let (mode, frequency) = (at + 1, frequencies[at]);
        return Err(ReportError::Frequency { mode, frequency });
    }
    Ok(DeckSource {
        frequencies,
        structure,
        joint,
        origin: format!("from {name}"),
        doubts: report.doubts(),
    })
}

/// Returns the misfit of an analysis, if it has one, and the limits of its joint, in the words of its report.
pub fn doubts_of(analysis: &Analysis) -> Vec<String> {
    let document = serde_json::to_value(document_of(analysis));
    let report = document.and_then(serde_json::from_value::<ReportFile>);
    report.unwrap_or_default().doubts()
}

impl DeckSource {
    /// Returns true where the model misses the frequencies, so that the springs are no better known than that.
    pub fn misses(&self) -> bool {
        self.doubts.iter().any(|doubt| doubt.starts_with(MISSES))
    }
}

impl ReportFile {
    /// Returns the misfit of the model, if it has one, and the limits of its joint.
    fn doubts(&self) -> Vec<String> {
        let warnings = self.warnings.iter().flatten();
        let texts = warnings.filter(|warning| warning.code == "misfit");
        // The text goes on with limits of non-dimensional stiffnesses.
        let misfit = texts.filter_map(|warning| warning.text.split(';').next());
        let misfit = misfit.filter(|text| text.starts_with(MISSES));
        let limits = all_limits(&self.estimate);
        misfit.map(str::to_owned).chain(limits).collect()
    }
}

/// Returns the limits of all stiffnesses.
fn all_limits(estimate: &Value) -> Option<String> {
    let mut limits = Vec::new();
    for (key, unit) in [("kt", "N/m"), ("kr", "N m/rad"), ("ktr", "N/rad")] {
        let found = &estimate[key];
        let words = match (found["low"].as_f64(), found["high"].as_f64()) {
            (Some(low), Some(high)) => format!("{low:.3e} to {high:.3e}"),
            (Some(low), None) => format!("above {low:.3e}"),
            (None, Some(high)) => format!("below {high:.3e}"),
            (None, None) => continue,
        };
        limits.push(format!("{key} {words} {unit}"));
    }
    (!limits.is_empty()).then(|| format!("95 % limits: {}", limits.join(", ")))
}

/// Returns the described beam with the properties that the report estimates.
fn reported_beam(estimate: &Value, described: &Beam) -> Result<Beam, ReportError> {
    let mut beam = *described;
    if let Some(modulus) = beam_value(estimate, "modulus.value", described.modulus)? {
        beam.modulus = modulus;
    }
    // A free beam's closed form gives its modulus, or else its density, never both.
    if let Some(density) = beam_value(estimate, "density.value", described.density)?
        && estimate["method"] != "free-beam"
    {
        beam.density = density;
    }
    for (path, property) in [
        ("beam.length", &mut beam.length),
        ("beam.width", &mut beam.width),
        ("beam.thickness", &mut beam.thickness),
        ("beam.modulus", &mut beam.modulus),
        ("beam.density", &mut beam.density),
    ] {
        if let Some(value) = beam_value(estimate, path, *property)? {
            *property = value;
        }
    }
    Ok(beam)
}

/// Returns a property of the reported beam. A beam much unlike the described one is another structure, and numbers near
/// the end of their range have no natural frequencies.
fn beam_value(estimate: &Value, path: &str, described: f64) -> Result<Option<f64>, ReportError> {
    let allowed = "a hundredth to a hundred times what the description says";
    let near = 0.01 * described..=100.0 * described;
    number(estimate, path, allowed, |x| near.contains(&x))
}

/// Returns the joint of a report, non-dimensional by its beam; `None` where a stiffness is unknown.
fn reported_joint(
    estimate: &Value,
    structure: &TestedStructure,
    beam: &Beam,
) -> Result<Option<JointStiffness>, ReportError> {
    if structure.assembly == Assembly::Free {
        return Ok(Some(JointStiffness::FREE));
    }
    let units = StiffnessUnits::of(beam);
    let described = StiffnessUnits::of(&structure.beam);
    let known = &structure.known;
    let kt = reported_stiffness(estimate, "kt")?.or(known.kx.map(|kx| kx * described.kt));
    let kr = reported_stiffness(estimate, "kr")?.or(known.ky.map(|ky| ky * described.kr));
    let ktr = reported_stiffness(estimate, "ktr")?;
    let ktr = ktr.or(known.cross_compliance.map(|c| described.ktr / c));
    Ok(kt.zip(kr).map(|(kt, kr)| JointStiffness {
        kx: kt / units.kt,
        ky: kr / units.kr,
        cross_compliance: ktr.map_or(0.0, |ktr| units.ktr / ktr),
    }))
}

/// Returns a stiffness of a report. A value of null is a rigid joint, a quantity of null an unknown one.
fn reported_stiffness(estimate: &Value, key: &str) -> Result<Option<f64>, ReportError> {
    let stated = estimate[key].get("value");
    match stated {
        None => Ok(None),
        Some(Value::Null) => Ok(Some(f64::INFINITY)),
        // Coupling has a sign, and is never 0.
        Some(_) if key == "ktr" => number(estimate, "ktr.value", "a number but 0", |x| x != 0.0),
        Some(_) => {
            let path = format!("{key}.value");
            number(estimate, &path, "a number from 0 on", |x| x >= 0.0)
        }
    }
}

/// Returns the number at a path of keys below the estimate; `None` where it is missing or null.
fn number(
    estimate: &Value,
    path: &str,
    allowed: &'static str,
    is_allowed: impl Fn(f64) -> bool,
) -> Result<Option<f64>, ReportError> {
    // Characters of a value that a message shows.
    const SHOWN: usize = 40;
    let mut keys = path.split('.');
    let found = keys.try_fold(estimate, |within, key| within.get(key));
    let Some(found) = found.filter(|found| !found.is_null()) else {
        return Ok(None);
    };
    match found
        .as_f64()
        .filter(|value| value.is_finite() && is_allowed(*value))
    {
        Some(value) => Ok(Some(value)),
        None => Err(ReportError::Value {
            key: format!("estimate.{path}"),
            value: found.to_string().chars().take(SHOWN).collect(),
            allowed,
        }),
    }
}
