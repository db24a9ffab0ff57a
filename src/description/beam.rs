//! `[beam]`: geometry, material and their tolerances.

use super::error::{DescriptionError, DescriptionProblem, DescriptionWarning, Doubt, with_unit};
use super::keys;
use super::limits::Limits;
use super::reader::{Entry, Table};
use super::{BeamDescription, BeamTolerance, RightHalf};
use std::ops::Bound;
use tapjoint_numerics::quantity::Dimension;

/// One property of a beam: what it may be, and what it usually is.
struct Property {
    key: &'static str,
    dimension: Dimension,
    limits: Limits,
    usual: (f64, f64),
    question: &'static str,
}

/// The limits are where matter ends (no solid is denser than 1e5 kg/m3 or stiffer than 1e13 Pa)
/// or where no hammer reaches; the usual ranges are those of beams that people tap.
const LENGTH: Property = Property {
    key: "length",
    dimension: Dimension::Length,
    limits: Limits::positive(
        1e4,
        "give the free length in m, or with its unit: \"423 mm\"",
    ),
    usual: (5e-3, 20.0),
    question: "did you mean mm? Write \"423 mm\"",
};
const WIDTH: Property = Property {
    key: "width",
    dimension: Dimension::Length,
    limits: Limits::positive(1e3, "give the width in m, or with its unit: \"50 mm\""),
    usual: (1e-4, 2.0),
    question: "did you mean mm? Write \"50 mm\"",
};
const THICKNESS: Property = Property {
    key: "thickness",
    dimension: Dimension::Length,
    limits: Limits::positive(1e3, "give the thickness in m, or with its unit: \"5 mm\""),
    usual: (1e-5, 0.5),
    question: "did you mean mm? Write \"5 mm\"",
};
const MODULUS: Property = Property {
    key: "modulus",
    dimension: Dimension::Pressure,
    limits: Limits::positive(
        1e13,
        "give Young's modulus in Pa, or with its unit: \"207 GPa\"",
    ),
    usual: (1e6, 2e12),
    question: "did you mean GPa? Write \"207 GPa\"",
};
const DENSITY: Property = Property {
    key: "density",
    dimension: Dimension::Density,
    limits: Limits::positive(
        1e5,
        "give the density in kg/m3, or with its unit: \"7.85 g/cm3\"",
    ),
    usual: (10.0, 25e3),
    question: "did you mean g/cm3? Write \"7.85 g/cm3\"",
};
/// Outside of it no isotropic solid is stable.
const POISSON: Limits = Limits {
    low: Bound::Excluded(-1.0),
    high: Bound::Included(0.5),
    remedy: "metals have 0.25 to 0.35; leave it out for 0.3",
};
/// Fewer thicknesses than this in the length is no beam any more.
const STOCKY: f64 = 3.0;
/// Nobody knows a beam's property better than this (relative).
const INCREDIBLY_EXACT: f64 = 1e-7;

/// Reads `[beam]`, but for its right half.
pub(super) fn read_beam(
    table: &Table<'_>,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<BeamDescription, DescriptionError> {
    let mut beam = BeamDescription {
        length: needed(
            table,
            &LENGTH,
            "a length (m)",
            "length = \"423 mm\"",
            warnings,
        )?,
        width: needed(table, &WIDTH, "a width (m)", "width = \"50 mm\"", warnings)?,
        thickness: needed(
            table,
            &THICKNESS,
            "a thickness (m)",
            "thickness = \"5 mm\"",
            warnings,
        )?,
        modulus: needed(
            table,
            &MODULUS,
            "Young's modulus (Pa)",
            "modulus = \"207 GPa\"",
            warnings,
        )?,
        density: needed(
            table,
            &DENSITY,
            "a density (kg/m3)",
            "density = 7850",
            warnings,
        )?,
        poisson: read_poisson(table)?,
        tolerance: BeamTolerance::default(),
    };
    if let Some(entry) = table
        .get("thickness")
        .filter(|_| beam.length < STOCKY * beam.thickness)
    {
        warnings.push(entry.warning(Doubt::Implausible {
            value: beam.thickness,
            unit: "m",
            usual: format!(
                "less than a third of the length, {}",
                with_unit(beam.length, "m")
            ),
            question: "did you swap thickness and length, or mix units?",
        }));
    }
    if let Some(entry) = table.get("tolerance") {
        beam.tolerance = read_tolerance(&entry.table(&keys::TOLERANCE)?, &beam, warnings)?;
    }
    Ok(beam)
}

/// Reads `[beam.right]`: what differs in a lap joint's right half.
pub(super) fn read_right_half(
    entry: &Entry<'_>,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<RightHalf, DescriptionError> {
    let table = entry.table(&keys::RIGHT)?;
    Ok(RightHalf {
        width: optional(&table, &WIDTH, warnings)?,
        thickness: optional(&table, &THICKNESS, warnings)?,
        modulus: optional(&table, &MODULUS, warnings)?,
        density: optional(&table, &DENSITY, warnings)?,
        poisson: read_poisson(&table)?,
    })
}

fn needed(
    table: &Table<'_>,
    property: &Property,
    wanted: &'static str,
    example: &'static str,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<f64, DescriptionError> {
    read_property(
        &table.need(property.key, wanted, example)?,
        property,
        warnings,
    )
}

fn optional(
    table: &Table<'_>,
    property: &Property,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<Option<f64>, DescriptionError> {
    table.optional(property.key, |entry| {
        read_property(entry, property, warnings)
    })
}

fn read_property(
    entry: &Entry<'_>,
    property: &Property,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<f64, DescriptionError> {
    let value = entry.within(property.dimension, &property.limits)?;
    let (low, high) = property.usual;
    if !(low..=high).contains(&value) {
        let unit = property.dimension.si_unit();
        let usual = format!("{} to {}", with_unit(low, ""), with_unit(high, unit));
        let question = property.question;
        warnings.push(entry.warning(Doubt::Implausible {
            value,
            unit,
            usual,
            question,
        }));
    }
    Ok(value)
}

fn read_poisson(table: &Table<'_>) -> Result<Option<f64>, DescriptionError> {
    table.optional("poisson", |entry| entry.within(Dimension::Ratio, &POISSON))
}

fn read_tolerance(
    table: &Table<'_>,
    beam: &BeamDescription,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<BeamTolerance, DescriptionError> {
    let mut of = |property: &Property, value: f64| {
        table.optional(property.key, |entry| {
            let std = read_std(entry, property.dimension, value)?;
            if std < INCREDIBLY_EXACT * value {
                warnings.push(incredible(entry, std, property.dimension.si_unit()));
            }
            Ok(std)
        })
    };
    Ok(BeamTolerance {
        length: of(&LENGTH, beam.length)?,
        width: of(&WIDTH, beam.width)?,
        thickness: of(&THICKNESS, beam.thickness)?,
        modulus: of(&MODULUS, beam.modulus)?,
        density: of(&DENSITY, beam.density)?,
    })
}

/// A standard uncertainty, absolute ("1 mm") or as a share of the `value` it belongs to ("2 %").
fn read_std(entry: &Entry<'_>, dimension: Dimension, value: f64) -> Result<f64, DescriptionError> {
    let relative = entry.as_text().is_some_and(|text| {
        let text = text.trim_end();
        text.ends_with('%') || text.ends_with("ppm")
    });
    let remedy = "give one standard deviation, absolute (\"1 mm\") or relative (\"2 %\")";
    let limits = |high| Limits {
        low: Bound::Excluded(0.0),
        high: Bound::Excluded(high),
        remedy,
    };
    if relative {
        Ok(value * entry.within(Dimension::Ratio, &limits(1.0))?)
    } else {
        entry.within(dimension, &limits(value))
    }
}

fn incredible(entry: &Entry<'_>, value: f64, unit: &'static str) -> DescriptionWarning {
    let usual = "0.01 % to 10 % of the value".to_owned();
    let question = "did you mean percent? Write \"2 %\"";
    entry.warning(Doubt::Implausible {
        value,
        unit,
        usual,
        question,
    })
}

/// The limits of a position along the beam (m).
pub(super) fn along(length: f64) -> Limits {
    let remedy = "this is outside the beam: positions run along it from the joint (lap joint, free beam: from the left end)";
    Limits::between(0.0, length, remedy)
}

/// Refuses `[beam.right]` where there is no right half.
pub(super) fn refuse_right_half(entry: &Entry<'_>) -> DescriptionError {
    entry.error(DescriptionProblem::Conflict {
        reason: "only a lap joint has a right half".to_owned(),
        remedy: "remove [beam.right], or set `kind = \"lap\"` in [joint]",
    })
}
