//! `[joint]`: what kind of structure it is, and what is known of its stiffness.

use super::beam::{read_right_half, refuse_right_half};
use super::error::{DescriptionError, DescriptionProblem, DescriptionWarning, Doubt};
use super::keys;
use super::limits::Limits;
use super::reader::{Entry, Table};
use super::{
    BeamTheory, JointDescription, JointKind, JointModel, KnownStiffness, Overlap, RightHalf,
};
use std::ops::Bound;
use tapjoint_numerics::quantity::Dimension;

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
            let limit = super::error::with_unit((kt * kr).sqrt(), "N/rad");
            let reason =
                format!("a passive joint needs ktr^2 > kt kr, here a size of more than {limit}");
            conflict(reason, "check the three stiffnesses and their units")
        }
        _ => Ok(()),
    }
}
