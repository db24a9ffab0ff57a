//! Beam, joint and effects of the model.

use super::error::{DescriptionError, DescriptionProblem, DescriptionWarning, Doubt, with_unit};
use super::reader::Limits;
use super::reader::{Entry, Table};
use super::{
    BeamDescription, BeamTheory, BeamTolerance, EffectDescription, JointDescription, JointKind,
    JointModel, KnownStiffness, Overlap, RightHalf, keys,
};
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
fn read_right_half(
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
fn refuse_right_half(entry: &Entry<'_>) -> DescriptionError {
    entry.error(DescriptionProblem::Conflict {
        reason: "only a lap joint has a right half".to_owned(),
        remedy: "remove [beam.right], or set `kind = \"lap\"` in [joint]",
    })
}

const KINDS: [(&str, JointKind); 3] = [
    ("cantilever", JointKind::Cantilever),
    ("lap", JointKind::Lap),
    ("free", JointKind::Free),
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

/// Stiffer than any joint that a double can tell from a rigid one.
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

/// Reads `[joint]`; `right` is the entry `[beam.right]`, `length` that of the whole beam.
pub(super) fn read_joint(
    table: &Table<'_>,
    right: Option<&Entry<'_>>,
    length: f64,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<JointDescription, DescriptionError> {
    let wanted = "the kind of structure";
    let kind = table
        .need("kind", wanted, "kind = \"cantilever\"")?
        .choice(&KINDS)?;
    if kind == JointKind::Free {
        refuse_stiffnesses(table)?;
    }
    let model = read_model(table, kind, warnings)?;
    let beam = table.optional("beam", |entry| entry.choice(&THEORIES))?;
    let (position, overlap) = read_lap(table, kind, length)?;
    let joint = JointDescription {
        kind,
        model,
        kt: read_stiffness(table, "kt", Dimension::TranslationalStiffness, &STIFFNESS)?,
        kr: read_stiffness(table, "kr", Dimension::RotationalStiffness, &STIFFNESS)?,
        ktr: read_stiffness(table, "ktr", Dimension::CouplingStiffness, &COUPLING)?,
        beam: beam.unwrap_or(BeamTheory::Timoshenko),
        position,
        overlap,
        right: read_right(right, kind, warnings)?,
    };
    check_coupling(table, &joint)?;
    Ok(joint)
}

fn refuse_stiffnesses(table: &Table<'_>) -> Result<(), DescriptionError> {
    let stray = ["kt", "kr", "ktr"]
        .into_iter()
        .find_map(|key| table.get(key));
    stray.map_or(Ok(()), |entry| {
        Err(entry.error(DescriptionProblem::Conflict {
            reason: "a free beam has no joint and so no joint stiffness".to_owned(),
            remedy: "remove it, or set `kind` to \"cantilever\" or \"lap\"",
        }))
    })
}

fn read_model(
    table: &Table<'_>,
    kind: JointKind,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<JointModel, DescriptionError> {
    let Some(entry) = table.get("model") else {
        return Ok(JointModel::TwoParameter);
    };
    let conflict = |reason: &str, remedy| {
        Err(entry.error(DescriptionProblem::Conflict {
            reason: reason.to_owned(),
            remedy,
        }))
    };
    match (entry.choice(&MODELS)?, kind) {
        (Some(JointModel::ThreeParameter), JointKind::Lap) => conflict(
            "a lap joint has two stiffnesses, \"2p\" is allowed; the third cancels by symmetry",
            "write `model = \"2p\"`, or leave it out",
        ),
        (Some(JointModel::ThreeParameter), JointKind::Free) => {
            conflict("a free beam has no joint to model", "remove `model`")
        }
        (None, JointKind::Cantilever | JointKind::Lap) => conflict(
            "only a free beam has no joint model",
            "write `model = \"2p\"` or \"3p\"",
        ),
        (Some(JointModel::TwoParameter), JointKind::Free) => {
            let reason = "a free beam has no joint to model; remove `model`";
            warnings.push(entry.warning(Doubt::NoMeaning { reason }));
            Ok(JointModel::TwoParameter)
        }
        (model, _) => Ok(model.unwrap_or(JointModel::TwoParameter)),
    }
}

fn read_lap(
    table: &Table<'_>,
    kind: JointKind,
    length: f64,
) -> Result<(Option<f64>, Option<Overlap>), DescriptionError> {
    if kind != JointKind::Lap {
        let stray = ["position", "overlap"]
            .into_iter()
            .find_map(|key| table.get(key));
        return stray.map_or(Ok((None, None)), |entry| {
            Err(entry.error(DescriptionProblem::Conflict {
                reason: "only a lap joint sits along the beam".to_owned(),
                remedy: "remove it, or set `kind = \"lap\"`",
            }))
        });
    }
    let inside = Limits {
        low: Bound::Excluded(0.0),
        high: Bound::Excluded(length),
        remedy: "measure from the left end of the whole beam; half the length is the default",
    };
    let position = table.optional("position", |entry| entry.within(Dimension::Length, &inside))?;
    let overlap = table.optional("overlap", |entry| read_overlap(entry, length))?;
    let place = position.unwrap_or(0.5 * length);
    let reach = place.min(length - place);
    let beyond = |overlap: &Overlap| 0.5 * overlap.length > reach;
    if let Some(entry) = table
        .get("overlap")
        .filter(|_| overlap.as_ref().is_some_and(beyond))
    {
        return Err(entry.error(DescriptionProblem::Conflict {
            reason: "half of the overlap reaches beyond an end of the beam".into(),
            remedy: "the overlap lies about the joint's `position`: shorten it, or move the joint",
        }));
    }
    Ok((position, overlap))
}

fn read_overlap(entry: &Entry<'_>, length: f64) -> Result<Overlap, DescriptionError> {
    let table = entry.table(&keys::OVERLAP)?;
    let shorter = Limits {
        low: Bound::Included(0.0),
        high: Bound::Excluded(length),
        remedy: "the overlap is a part of the beam's length",
    };
    let example = "overlap = { length = \"40 mm\", mass = \"50 g\" }";
    let length = table.need("length", "the length of the overlap (m)", example)?;
    let mass = table.need("mass", "the mass added by overlap and bolts (kg)", example)?;
    Ok(Overlap {
        length: length.within(Dimension::Length, &shorter)?,
        mass: mass.within(Dimension::Mass, &OVERLAP_MASS)?,
    })
}

fn read_right(
    right: Option<&Entry<'_>>,
    kind: JointKind,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<Option<RightHalf>, DescriptionError> {
    match right {
        Some(entry) if kind != JointKind::Lap => Err(refuse_right_half(entry)),
        Some(entry) => read_right_half(entry, warnings).map(Some),
        None => Ok(None),
    }
}

fn read_stiffness(
    table: &Table<'_>,
    key: &str,
    dimension: Dimension,
    limits: &Limits,
) -> Result<Option<KnownStiffness>, DescriptionError> {
    table.optional(key, |entry| {
        if entry.as_text().is_some_and(|text| text.trim() == "rigid") {
            return Ok(KnownStiffness::Rigid);
        }
        entry.within(dimension, limits).map(KnownStiffness::Value)
    })
}

/// The compliance matrix ((1/Kt, -1/Ktr), (-1/Ktr, 1/Kr)) of a passive joint is positive definite:
/// Ktr^2 > Kt Kr (Ingole & Chatterjee's model 2, with 1/Ktr = 0 where there is no coupling).
fn check_coupling(table: &Table<'_>, joint: &JointDescription) -> Result<(), DescriptionError> {
    let Some((entry, stiffness)) = table.get("ktr").zip(joint.ktr) else {
        return Ok(());
    };
    let conflict =
        |reason: String, remedy| Err(entry.error(DescriptionProblem::Conflict { reason, remedy }));
    if joint.model == JointModel::TwoParameter {
        let reason = "the two-parameter model has no coupling stiffness".to_owned();
        return conflict(
            reason,
            "write `model = \"3p\"` (cantilever), or remove `ktr`",
        );
    }
    let KnownStiffness::Value(ktr) = stiffness else {
        return Ok(());
    };
    if ktr == 0.0 {
        let reason = "a coupling stiffness of 0 N/rad would be an infinite compliance".to_owned();
        return conflict(reason, "write \"rigid\" for no coupling");
    }
    match (joint.kt, joint.kr) {
        (Some(KnownStiffness::Rigid), _) | (_, Some(KnownStiffness::Rigid)) => conflict(
            "a direction without give cannot be coupled to the other".to_owned(),
            "write `ktr = \"rigid\"`, or a finite `kt` and `kr`",
        ),
        (Some(KnownStiffness::Value(kt)), Some(KnownStiffness::Value(kr)))
            if ktr * ktr <= kt * kr =>
        {
            let limit = crate::error::with_unit((kt * kr).sqrt(), "N/rad");
            let reason =
                format!("a passive joint needs ktr^2 > kt kr, here a size of more than {limit}");
            conflict(reason, "check the three stiffnesses and their units")
        }
        _ => Ok(()),
    }
}

/// Reads one `[[effect]]`. Whether there is such an effect with such parameters is for whoever uses it to
/// say.
pub(super) fn read_effect(entry: &Entry<'_>) -> Result<EffectDescription, DescriptionError> {
    let table = entry.table(&keys::EFFECT)?;
    let id = table
        .need("id", "the effect's name", "id = \"sensor-mass\"")?
        .text("an effect such as \"sensor-mass\"")?;
    let values = table
        .all()
        .filter(|(key, _)| *key != "id")
        .map(|(key, entry)| Ok((key.to_owned(), entry.quantity(dimension(key))?)))
        .collect::<Result<_, DescriptionError>>()?;
    Ok(EffectDescription {
        id,
        values,
        line: entry.line,
    })
}

fn dimension(key: &str) -> Dimension {
    match key {
        "mass" => Dimension::Mass,
        "position" => Dimension::Length,
        "stiffness" => Dimension::TranslationalStiffness,
        "frequency" | "offset" => Dimension::Frequency,
        "force" => Dimension::Force,
        // Inertias too are plain numbers (kg m2).
        _ => Dimension::Ratio,
    }
}
