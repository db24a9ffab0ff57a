//! `[analysis]`: settings of the analysis.

use super::error::{DescriptionError, DescriptionProblem};
use super::reader::{Entry, Limits, Table};
use super::{Assembly, JointDescription, JointModel};
use tapjoint_signal::modal::ReadBy;

/// Words of `window` in `[analysis]`.
pub const WINDOWS: [(&str, WindowKind); 3] = [
    ("rectangular", WindowKind::Rectangular),
    ("hann", WindowKind::Hann),
    ("exponential", WindowKind::Exponential),
];
/// Words of `reading` in `[analysis]`.
pub const READINGS: [(&str, ReadBy); 3] = [
    ("fit", ReadBy::Fit),
    ("interpolated", ReadBy::Interpolated),
    ("line", ReadBy::Line),
];
const WEIGHTS: [(&str, Weights); 2] = [
    ("measured", Weights::Measured),
    ("relative", Weights::Relative),
];
const PARAMETERS: [(&str, FitParameter); 5] = [
    ("kt", FitParameter::Kt),
    ("kr", FitParameter::Kr),
    ("ktr", FitParameter::Ktr),
    ("modulus", FitParameter::Modulus),
    ("density", FitParameter::Density),
];
const FIT_MODES: Limits = Limits::between(1.0, 1000.0, "leave it out to use all modes");

/// Window over a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WindowKind {
    /// None.
    Rectangular,
    /// Hann; for steady signals, not for taps.
    Hann,
    /// e^{-at} on force and response alike.
    Exponential,
}

/// Weights of the frequencies in an estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weights {
    /// By their measured uncertainty.
    Measured,
    /// Equal relative weights.
    Relative,
}

/// A quantity that an estimate can determine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FitParameter {
    /// Translational stiffness.
    Kt,
    /// Rotational stiffness.
    Kr,
    /// Cross-coupling stiffness.
    Ktr,
    /// Young's modulus.
    Modulus,
    /// Density.
    Density,
}

/// Settings of the analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct AnalysisDescription {
    /// Window; `None` = chosen from the decay in the record.
    pub window: Option<WindowKind>,
    /// Way of reading natural frequencies.
    pub reading: ReadBy,
    /// The first so many modes enter the estimate; `None` = all.
    pub fit_modes: Option<usize>,
    /// Weights of the frequencies; `None` = measured where bounds are known.
    pub weights: Option<Weights>,
    /// The sensors' masses enter the nominal model.
    pub sensor_mass: bool,
    /// Estimated quantities; `None` = the joint model's stiffnesses, of a free beam the modulus.
    pub fit: Option<Vec<FitParameter>>,
}

/// Reads `[analysis]`; an absent table is all defaults.
pub(super) fn read_analysis(
    table: Option<&Table<'_>>,
    joint: &JointDescription,
) -> Result<AnalysisDescription, DescriptionError> {
    let mut analysis = AnalysisDescription {
        window: None,
        reading: ReadBy::default(),
        fit_modes: None,
        weights: None,
        sensor_mass: true,
        fit: None,
    };
    if let Some(table) = table {
        analysis.window = table.optional("window", |entry| entry.choice(&WINDOWS))?;
        analysis.reading = table
            .optional("reading", |entry| entry.choice(&READINGS))?
            .unwrap_or_default();
        analysis.fit_modes = table.optional("fit_modes", |entry| entry.count(&FIT_MODES))?;
        analysis.weights = table.optional("weights", |entry| entry.choice(&WEIGHTS))?;
        analysis.sensor_mass = table
            .optional("sensor_mass", Entry::boolean)?
            .unwrap_or(true);
        analysis.fit = table.optional("fit", |entry| read_fit(entry, joint))?;
    }
    Ok(analysis)
}

fn read_fit(
    entry: &Entry<'_>,
    joint: &JointDescription,
) -> Result<Vec<FitParameter>, DescriptionError> {
    let items = entry.list("a list such as [\"kr\", \"modulus\"]")?;
    if items.is_empty() {
        return Err(entry.error(DescriptionProblem::Count {
            found: 0,
            allowed: "at least 1".to_owned(),
            remedy: "leave `fit` out for the joint's stiffnesses",
        }));
    }
    let mut fit: Vec<FitParameter> = Vec::new();
    for item in &items {
        let parameter = item.choice(&PARAMETERS)?;
        if let Some((reason, remedy)) = objection(parameter, joint) {
            return Err(item.conflict(reason, remedy));
        }
        if fit.contains(&parameter) {
            return Err(item.error(DescriptionProblem::Duplicate {
                value: format!("\"{}\"", item.as_text().unwrap_or_default()),
                first_line: entry.line,
                remedy: "list each parameter once",
            }));
        }
        fit.push(parameter);
    }
    Ok(fit)
}

/// Returns the reason why a parameter cannot be fitted with this joint, and the remedy.
fn objection(
    parameter: FitParameter,
    joint: &JointDescription,
) -> Option<(&'static str, &'static str)> {
    let known = match parameter {
        FitParameter::Kt => joint.kt,
        FitParameter::Kr => joint.kr,
        FitParameter::Ktr => joint.ktr,
        FitParameter::Modulus | FitParameter::Density => return None,
    };
    if joint.kind == Assembly::Free {
        return Some((
            "a free beam has no joint stiffness",
            "fit \"modulus\" or \"density\"",
        ));
    }
    if parameter == FitParameter::Ktr && joint.model == JointModel::TwoParameter {
        return Some((
            "the two-parameter model has no coupling stiffness",
            "write `model = \"3p\"` in [joint], or remove it here",
        ));
    }
    known.map(|_| {
        let reason =
            "this stiffness is stated as known in [joint], and known ones are compared, not fitted";
        (reason, "remove it here or there")
    })
}
