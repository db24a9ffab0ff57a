//! Beam, joint and effects of the model.

use super::error::{DescriptionError, Doubt, with_unit};
use super::reader::{Entry, Limits, Table};
use super::{
    Assembly, BeamDescription, BeamTheory, BeamTolerance, EffectDescription, JointDescription,
    JointModel, LapOverlap, RightHalf, keys,
};
use std::collections::BTreeMap;
use std::ops::Bound;
use tapjoint_numerics::quantity::Dimension;

/// A property of a beam with its limits and its usual range.
struct Property {
    key: &'static str,
    /// Words for a missing property.
    wanted: &'static str,
    example: &'static str,
    dimension: Dimension,
    limits: Limits,
    /// Lowest and highest usual value.
    usual: [f64; 2],
    /// Question about an unusual value.
    question: &'static str,
}

// The limits are physical (no solid is denser than 1e5 kg/m3 or stiffer than 1e13 Pa) or beyond the reach
// of a hammer. The usual ranges are those of beams that people tap.
const LENGTH: Property = Property {
    key: "length",
    wanted: "a length (m)",
    example: "length = \"423 mm\"",
    dimension: Dimension::Length,
    limits: Limits::positive(
        1e4,
        "give the free length in m, or with its unit: \"423 mm\"",
    ),
    usual: [5e-3, 20.0],
    question: "did you mean mm? Write \"423 mm\"",
};
const WIDTH: Property = Property {
    key: "width",
    wanted: "a width (m)",
    example: "width = \"50 mm\"",
    dimension: Dimension::Length,
    limits: Limits::positive(1e3, "give the width in m, or with its unit: \"50 mm\""),
    usual: [1e-4, 2.0],
    question: "did you mean mm? Write \"50 mm\"",
};
const THICKNESS: Property = Property {
    key: "thickness",
    wanted: "a thickness (m)",
    example: "thickness = \"5 mm\"",
    dimension: Dimension::Length,
    limits: Limits::positive(1e3, "give the thickness in m, or with its unit: \"5 mm\""),
    usual: [1e-5, 0.5],
    question: "did you mean mm? Write \"5 mm\"",
};
const MODULUS: Property = Property {
    key: "modulus",
    wanted: "Young's modulus (Pa)",
    example: "modulus = \"207 GPa\"",
    dimension: Dimension::Pressure,
    limits: Limits::positive(
        1e13,
        "give Young's modulus in Pa, or with its unit: \"207 GPa\"",
    ),
    usual: [1e6, 2e12],
    question: "did you mean GPa? Write \"207 GPa\"",
};
const DENSITY: Property = Property {
    key: "density",
    wanted: "a density (kg/m3)",
    example: "density = 7850",
    dimension: Dimension::Density,
    limits: Limits::positive(
        1e5,
        "give the density in kg/m3, or with its unit: \"7.85 g/cm3\"",
    ),
    usual: [10.0, 25e3],
    question: "did you mean g/cm3? Write \"7.85 g/cm3\"",
};
/// An isotropic solid is stable only within these limits.
const POISSON: Limits = Limits {
    low: Bound::Excluded(-1.0),
    high: Bound::Included(0.5),
    remedy: "metals have 0.25 to 0.35; leave it out for 0.3",
};
/// Smallest length of a slender beam, in thicknesses.
const STOCKY: f64 = 3.0;
/// No property of a beam is known better than this (relative).
const INCREDIBLY_EXACT: f64 = 1e-7;

/// Reads `[beam]` without its right half.
pub(super) fn read_beam(table: &Table<'_>) -> Result<BeamDescription, DescriptionError> {
    let mut beam = BeamDescription {
        length: needed(table, &LENGTH)?,
        width: needed(table, &WIDTH)?,
        thickness: needed(table, &THICKNESS)?,
        modulus: needed(table, &MODULUS)?,
        density: needed(table, &DENSITY)?,
        poisson: read_poisson(table)?,
        tolerance: BeamTolerance::default(),
    };
    let stocky = beam.length < STOCKY * beam.thickness;
    if let Some(entry) = table.get("thickness").filter(|_| stocky) {
        entry.warn(Doubt::Implausible {
            value: beam.thickness,
            unit: "m",
            usual: format!(
                "less than a third of the length, {}",
                with_unit(beam.length, "m")
            ),
            question: "did you swap thickness and length, or mix units?",
        });
    }
    if let Some(entry) = table.get("tolerance") {
        let table = entry.table(&keys::TOLERANCE)?;
        beam.tolerance = BeamTolerance {
            length: tolerance(&table, &LENGTH, beam.length)?,
            width: tolerance(&table, &WIDTH, beam.width)?,
            thickness: tolerance(&table, &THICKNESS, beam.thickness)?,
            modulus: tolerance(&table, &MODULUS, beam.modulus)?,
            density: tolerance(&table, &DENSITY, beam.density)?,
        };
    }
    Ok(beam)
}

fn needed(table: &Table<'_>, property: &Property) -> Result<f64, DescriptionError> {
    let entry = table.need(property.key, property.wanted, property.example)?;
    read_property(&entry, property)
}

fn optional(table: &Table<'_>, property: &Property) -> Result<Option<f64>, DescriptionError> {
    table.optional(property.key, |entry| read_property(entry, property))
}

fn read_property(entry: &Entry<'_>, property: &Property) -> Result<f64, DescriptionError> {
    let value = entry.within(property.dimension, &property.limits)?;
    let [low, high] = property.usual;
    if !(low..=high).contains(&value) {
        let unit = property.dimension.si_unit();
        entry.warn(Doubt::Implausible {
            value,
            unit,
            usual: format!("{} to {}", with_unit(low, ""), with_unit(high, unit)),
            question: property.question,
        });
    }
    Ok(value)
}

fn read_poisson(table: &Table<'_>) -> Result<Option<f64>, DescriptionError> {
    table.optional("poisson", |entry| entry.within(Dimension::Ratio, &POISSON))
}

/// Reads the standard uncertainty of a property: absolute ("1 mm") or a share of its `value` ("2 %").
fn tolerance(
    table: &Table<'_>,
    property: &Property,
    value: f64,
) -> Result<Option<f64>, DescriptionError> {
    let Some(entry) = table.get(property.key) else {
        return Ok(None);
    };
    let relative = entry.as_text().is_some_and(|text| {
        let text = text.trim_end();
        text.ends_with('%') || text.ends_with("ppm")
    });
    let limits = Limits {
        low: Bound::Excluded(0.0),
        high: Bound::Excluded(if relative { 1.0 } else { value }),
        remedy: "give one standard deviation, absolute (\"1 mm\") or relative (\"2 %\")",
    };
    let std = if relative {
        value * entry.within(Dimension::Ratio, &limits)?
    } else {
        entry.within(property.dimension, &limits)?
    };
    if std < INCREDIBLY_EXACT * value {
        entry.warn(Doubt::Implausible {
            value: std,
            unit: property.dimension.si_unit(),
            usual: "0.01 % to 10 % of the value".to_owned(),
            question: "did you mean percent? Write \"2 %\"",
        });
    }
    Ok(Some(std))
}

/// Returns the limits of a position along the beam (m).
pub(super) fn along(length: f64) -> Limits {
    let remedy = "this is outside the beam: positions run along it from the joint (lap joint, free beam: from the left end)";
    Limits::between(0.0, length, remedy)
}

/// Words of `kind` in `[joint]`.
pub const ASSEMBLIES: [(&str, Assembly); 3] = [
    ("cantilever", Assembly::Cantilever),
    ("lap", Assembly::Lap),
    ("free", Assembly::Free),
];
const THEORIES: [(&str, BeamTheory); 2] = [
    ("timoshenko", BeamTheory::Timoshenko),
    ("euler", BeamTheory::Euler),
];
const MODELS: [(&str, Option<JointModel>); 3] = [
    ("2p", Some(JointModel::TwoParameter)),
    ("3p", Some(JointModel::ThreeParameter)),
    ("none", None),
];

/// In double precision a stiffer joint equals a rigid one.
const STIFFNESS_LIMIT: f64 = 1e18;
const STIFFNESS: Limits = Limits::between(
    0.0,
    STIFFNESS_LIMIT,
    "write \"rigid\" for a joint without give, or leave it out to have it fitted",
);
const COUPLING: Limits = Limits::between(
    -STIFFNESS_LIMIT,
    STIFFNESS_LIMIT,
    "write \"rigid\" for no coupling, or leave it out to have it fitted",
);
const OVERLAP_MASS: Limits = Limits::between(
    0.0,
    1e6,
    "give the added mass of overlap and bolts in kg, 0 for none",
);

/// Reads `[joint]`. `right` is the entry `[beam.right]`, `length` that of the whole beam.
pub(super) fn read_joint(
    table: &Table<'_>,
    right: Option<&Entry<'_>>,
    length: f64,
) -> Result<JointDescription, DescriptionError> {
    let kind = table
        .need("kind", "the kind of structure", "kind = \"cantilever\"")?
        .choice(&ASSEMBLIES)?;
    let stiffness = ["kt", "kr", "ktr"].iter().find_map(|key| table.get(key));
    if let Some(entry) = stiffness.filter(|_| kind == Assembly::Free) {
        return Err(entry.conflict(
            "a free beam has no joint and so no joint stiffness",
            "remove it, or set `kind` to \"cantilever\" or \"lap\"",
        ));
    }
    let model = read_model(table, kind)?;
    let beam = table.optional("beam", |entry| entry.choice(&THEORIES))?;
    let mut joint = JointDescription {
        kind,
        model,
        kt: None,
        kr: None,
        ktr: None,
        beam: beam.unwrap_or(BeamTheory::Timoshenko),
        position: None,
        overlap: None,
        right: None,
    };
    match kind {
        Assembly::Lap => read_lap(table, &mut joint, length)?,
        Assembly::Cantilever | Assembly::Free => {
            let stray = ["position", "overlap"]
                .iter()
                .find_map(|key| table.get(key));
            if let Some(entry) = stray {
                return Err(entry.conflict(
                    "only a lap joint sits along the beam",
                    "remove it, or set `kind = \"lap\"`",
                ));
            }
        }
    }
    joint.kt = read_stiffness(table, "kt", Dimension::TranslationalStiffness, &STIFFNESS)?;
    joint.kr = read_stiffness(table, "kr", Dimension::RotationalStiffness, &STIFFNESS)?;
    joint.ktr = read_stiffness(table, "ktr", Dimension::CouplingStiffness, &COUPLING)?;
    if let Some(entry) = right {
        joint.right = Some(read_right(entry, kind)?);
    }
    if let Some((entry, ktr)) = table.get("ktr").zip(joint.ktr) {
        check_coupling(&entry, ktr, &joint)?;
    }
    Ok(joint)
}

fn read_model(table: &Table<'_>, kind: Assembly) -> Result<JointModel, DescriptionError> {
    let Some(entry) = table.get("model") else {
        return Ok(JointModel::TwoParameter);
    };
    match (entry.choice(&MODELS)?, kind) {
        (Some(JointModel::ThreeParameter), Assembly::Lap) => Err(entry.conflict(
            "a lap joint has two stiffnesses, \"2p\" is allowed; the third cancels by symmetry",
            "write `model = \"2p\"`, or leave it out",
        )),
        (Some(JointModel::ThreeParameter), Assembly::Free) => {
            Err(entry.conflict("a free beam has no joint to model", "remove `model`"))
        }
        (None, Assembly::Cantilever | Assembly::Lap) => Err(entry.conflict(
            "only a free beam has no joint model",
            "write `model = \"2p\"` or \"3p\"",
        )),
        (Some(JointModel::TwoParameter), Assembly::Free) => {
            let reason = "a free beam has no joint to model; remove `model`";
            entry.warn(Doubt::NoMeaning { reason });
            Ok(JointModel::TwoParameter)
        }
        (model, _) => Ok(model.unwrap_or(JointModel::TwoParameter)),
    }
}

/// Reads place and overlap of a lap joint.
fn read_lap(
    table: &Table<'_>,
    joint: &mut JointDescription,
    length: f64,
) -> Result<(), DescriptionError> {
    let inside = Limits {
        low: Bound::Excluded(0.0),
        high: Bound::Excluded(length),
        remedy: "measure from the left end of the whole beam; half the length is the default",
    };
    joint.position =
        table.optional("position", |entry| entry.within(Dimension::Length, &inside))?;
    let Some(entry) = table.get("overlap") else {
        return Ok(());
    };
    let overlap = read_overlap(&entry, length)?;
    let place = joint.position.unwrap_or(0.5 * length);
    if 0.5 * overlap.length > place.min(length - place) {
        return Err(entry.conflict(
            "half of the overlap reaches beyond an end of the beam",
            "the overlap lies about the joint's `position`: shorten it, or move the joint",
        ));
    }
    joint.overlap = Some(overlap);
    Ok(())
}

fn read_overlap(entry: &Entry<'_>, length: f64) -> Result<LapOverlap, DescriptionError> {
    let table = entry.table(&keys::OVERLAP)?;
    let shorter = Limits {
        low: Bound::Included(0.0),
        high: Bound::Excluded(length),
        remedy: "the overlap is a part of the beam's length",
    };
    let example = "overlap = { length = \"40 mm\", mass = \"50 g\" }";
    let length = table.need("length", "the length of the overlap (m)", example)?;
    let mass = table.need("mass", "the mass added by overlap and bolts (kg)", example)?;
    Ok(LapOverlap {
        length: length.within(Dimension::Length, &shorter)?,
        mass: mass.within(Dimension::Mass, &OVERLAP_MASS)?,
    })
}

/// Reads `[beam.right]`: the properties that differ in a lap joint's right half.
fn read_right(entry: &Entry<'_>, kind: Assembly) -> Result<RightHalf, DescriptionError> {
    if kind != Assembly::Lap {
        return Err(entry.conflict(
            "only a lap joint has a right half",
            "remove [beam.right], or set `kind = \"lap\"` in [joint]",
        ));
    }
    let table = entry.table(&keys::RIGHT)?;
    Ok(RightHalf {
        width: optional(&table, &WIDTH)?,
        thickness: optional(&table, &THICKNESS)?,
        modulus: optional(&table, &MODULUS)?,
        density: optional(&table, &DENSITY)?,
        poisson: read_poisson(&table)?,
    })
}

fn read_stiffness(
    table: &Table<'_>,
    key: &str,
    dimension: Dimension,
    limits: &Limits,
) -> Result<Option<f64>, DescriptionError> {
    table.optional(key, |entry| match entry.as_text().map(str::trim) {
        Some("rigid") => Ok(f64::INFINITY),
        _ => entry.within(dimension, limits),
    })
}

/// Refuses a coupling stiffness that no passive joint has.
///
/// The compliance matrix ((1/Kt, -1/Ktr), (-1/Ktr, 1/Kr)) of a passive joint is positive definite:
/// Ktr^2 > Kt Kr (Ingole & Chatterjee's model 2, with 1/Ktr = 0 where there is no coupling).
fn check_coupling(
    entry: &Entry<'_>,
    ktr: f64,
    joint: &JointDescription,
) -> Result<(), DescriptionError> {
    if joint.model == JointModel::TwoParameter {
        return Err(entry.conflict(
            "the two-parameter model has no coupling stiffness",
            "write `model = \"3p\"` (cantilever), or remove `ktr`",
        ));
    }
    if ktr == 0.0 {
        return Err(entry.conflict(
            "a coupling stiffness of 0 N/rad would be an infinite compliance",
            "write \"rigid\" for no coupling",
        ));
    }
    if ktr.is_infinite() {
        return Ok(());
    }
    if joint.kt == Some(f64::INFINITY) || joint.kr == Some(f64::INFINITY) {
        return Err(entry.conflict(
            "a direction without give cannot be coupled to the other",
            "write `ktr = \"rigid\"`, or a finite `kt` and `kr`",
        ));
    }
    match joint.kt.zip(joint.kr) {
        Some((kt, kr)) if ktr * ktr <= kt * kr => {
            let limit = with_unit((kt * kr).sqrt(), "N/rad");
            Err(entry.conflict(
                format!("a passive joint needs ktr^2 > kt kr, here a size of more than {limit}"),
                "check the three stiffnesses and their units",
            ))
        }
        _ => Ok(()),
    }
}

/// Reads one `[[effect]]`. The command that uses the effect checks its name and parameters.
pub(super) fn read_effect(entry: &Entry<'_>) -> Result<EffectDescription, DescriptionError> {
    let table = entry.table(&keys::EFFECT)?;
    let id = table
        .need("id", "the effect's name", "id = \"sensor-mass\"")?
        .text("an effect such as \"sensor-mass\"")?;
    let mut effect = EffectDescription {
        id,
        values: BTreeMap::new(),
        line: entry.line,
    };
    for (key, entry) in table.all().filter(|(key, _)| *key != "id") {
        let dimension = match key {
            "mass" => Dimension::Mass,
            "position" => Dimension::Length,
            "stiffness" => Dimension::TranslationalStiffness,
            "frequency" | "offset" => Dimension::Frequency,
            "force" => Dimension::Force,
            // Inertias too are plain numbers (kg m2).
            _ => Dimension::Ratio,
        };
        let value = entry.quantity(dimension)?;
        effect.values.insert(key.to_owned(), value);
    }
    Ok(effect)
}
