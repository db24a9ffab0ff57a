//! Joint and effects of the model, and the structure that they describe with the beam.

use super::property::{DENSITY, MODULUS, POISSON, THICKNESS, WIDTH, optional};
use super::reader::{DescriptionError, Entry, Limits, Table, with_unit};
use super::{
    Assembly, BeamTheory, EffectDescription, JointDescription, JointModel, LapOverlap, RightHalf,
    TestDescription, keys,
};
use std::collections::BTreeMap;
use tapjoint_beam::Beam;
use tapjoint_beam::beam::DEFAULT_POISSON;
use tapjoint_beam::specimen::{Joint, LapLayout, Specimen};
use tapjoint_numerics::quantity::Dimension;

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
    right: Option<Entry<'_>>,
    length: f64,
) -> Result<JointDescription, DescriptionError> {
    let kind = table
        .need("kind", "the kind of structure", "kind = \"cantilever\"")?
        .choice(&ASSEMBLIES)?;
    let stiffness = ["kt", "kr", "ktr"].iter().find_map(|key| table.get(key));
    if let Some(entry) = stiffness.filter(|_| kind == Assembly::Free) {
        return Err(entry.error(
            "a free beam has no joint and so no joint stiffness; remove it, or set `kind` to \"cantilever\" or \"lap\"",
        ));
    }
    let model = read_model(table, kind)?;
    let beam = table.choice("beam", &THEORIES)?;
    let (mut position, mut overlap) = (None, None);
    if kind == Assembly::Lap {
        (position, overlap) = read_lap(table, length)?;
    } else if let Some(entry) = table.get("position").or_else(|| table.get("overlap")) {
        return Err(
            entry.error("only a lap joint sits along the beam; remove it, or set `kind = \"lap\"`")
        );
    }
    let mut joint = JointDescription {
        kind,
        model,
        kt: read_stiffness(table, "kt", Dimension::TranslationalStiffness, &STIFFNESS)?,
        kr: read_stiffness(table, "kr", Dimension::RotationalStiffness, &STIFFNESS)?,
        ktr: read_stiffness(table, "ktr", Dimension::CouplingStiffness, &COUPLING)?,
        beam: beam.unwrap_or(BeamTheory::Timoshenko),
        position,
        overlap,
        right: None,
    };
    if let Some(entry) = right {
        if kind != Assembly::Lap {
            return Err(entry.error(
                "only a lap joint has a right half; remove [beam.right], or set `kind = \"lap\"` in [joint]",
            ));
        }
        let table = entry.table(&keys::RIGHT)?;
        joint.right = Some(RightHalf {
            width: optional(&table, &WIDTH)?,
            thickness: optional(&table, &THICKNESS)?,
            modulus: optional(&table, &MODULUS)?,
            density: optional(&table, &DENSITY)?,
            poisson: table.within("poisson", Dimension::Ratio, &POISSON)?,
        });
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
        (Some(JointModel::ThreeParameter), Assembly::Lap) => Err(entry.error(
            "a lap joint has two stiffnesses, \"2p\" is allowed; the third cancels by symmetry; write `model = \"2p\"`, \
             or leave it out",
        )),
        (Some(JointModel::ThreeParameter), Assembly::Free) => {
            Err(entry.error("a free beam has no joint to model; remove `model`"))
        }
        (None, Assembly::Cantilever | Assembly::Lap) => Err(entry.error(
            "only a free beam has no joint model; write `model = \"2p\"` or \"3p\"",
        )),
        (Some(JointModel::TwoParameter), Assembly::Free) => {
            entry.warn("has no effect; a free beam has no joint to model; remove `model`");
            Ok(JointModel::TwoParameter)
        }
        (model, _) => Ok(model.unwrap_or(JointModel::TwoParameter)),
    }
}

/// Reads place (m) and overlap of a lap joint.
fn read_lap(
    table: &Table<'_>,
    length: f64,
) -> Result<(Option<f64>, Option<LapOverlap>), DescriptionError> {
    let remedy = "measure from the left end of the whole beam; half the length is the default";
    let inside = Limits::inside(0.0, length, remedy);
    let position = table.within("position", Dimension::Length, &inside)?;
    let Some(entry) = table.get("overlap") else {
        return Ok((position, None));
    };
    let table = entry.table(&keys::OVERLAP)?;
    let example = "overlap = { length = \"40 mm\", mass = \"50 g\" }";
    let long = table.need("length", "the length of the overlap (m)", example)?;
    let mass = table.need("mass", "the mass added by overlap and bolts (kg)", example)?;
    let shorter = Limits::below(0.0, length, "the overlap is a part of the beam's length");
    let overlap = LapOverlap {
        length: long.within(Dimension::Length, &shorter)?,
        mass: mass.within(Dimension::Mass, &OVERLAP_MASS)?,
    };
    let place = position.unwrap_or(0.5 * length);
    if 0.5 * overlap.length > place.min(length - place) {
        return Err(entry.error(
            "half of the overlap reaches beyond an end of the beam; the overlap lies about the joint's `position`: \
             shorten it, or move the joint",
        ));
    }
    Ok((position, Some(overlap)))
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
        return Err(entry.error(
            "the two-parameter model has no coupling stiffness; write `model = \"3p\"` (cantilever), or remove `ktr`",
        ));
    }
    if ktr == 0.0 {
        return Err(entry.error(
            "a coupling stiffness of 0 N/rad would be an infinite compliance; write \"rigid\" for no coupling",
        ));
    }
    if ktr.is_infinite() {
        return Ok(());
    }
    if joint.kt == Some(f64::INFINITY) || joint.kr == Some(f64::INFINITY) {
        return Err(entry.error(
            "a direction without give cannot be coupled to the other; write `ktr = \"rigid\"`, or a finite `kt` and \
             `kr`",
        ));
    }
    match joint.kt.zip(joint.kr) {
        Some((kt, kr)) if ktr * ktr <= kt * kr => Err(entry.error(format!(
            "a passive joint needs ktr^2 > kt kr, here a size of more than {}; check the three stiffnesses and their \
             units",
            with_unit((kt * kr).sqrt(), "N/rad")
        ))),
        _ => Ok(()),
    }
}

/// Reads one `[[effect]]`. The command that uses the effect checks its name and parameters.
pub(super) fn read_effect(entry: &Entry<'_>) -> Result<EffectDescription, DescriptionError> {
    let table = entry.table(&keys::EFFECT)?;
    let id = table
        .need("id", "the effect's name", "id = \"sensor-mass\"")?
        .text("an effect such as \"sensor-mass\"")?;
    let mut values = BTreeMap::new();
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
        values.insert(key.to_owned(), entry.quantity(dimension)?);
    }
    Ok(EffectDescription {
        id,
        values,
        line: entry.line,
    })
}

/// Returns the beam; for a lap joint the left half's properties and the total length.
pub fn described_beam(test: &TestDescription) -> Beam {
    Beam {
        length: test.beam.length,
        width: test.beam.width,
        thickness: test.beam.thickness,
        modulus: test.beam.modulus,
        density: test.beam.density,
        poisson: test.beam.poisson.unwrap_or(DEFAULT_POISSON),
    }
}

/// Returns the coupling of a joint (1), sqrt(Kt Kr)/Ktr, from stiffnesses and 1/Ktr in one system of units.
/// A rigid Ktr gives 0.
pub fn coupling(kt: f64, kr: f64, cross_compliance: f64) -> f64 {
    if cross_compliance == 0.0 {
        0.0
    } else {
        kt.sqrt() * kr.sqrt() * cross_compliance
    }
}

/// Returns the differences of a lap joint's halves from two equal pieces; of other structures the default.
pub fn lap_layout(test: &TestDescription) -> LapLayout {
    let joint = &test.joint;
    let left = described_beam(test);
    LapLayout {
        position: joint.position,
        right: joint.right.as_ref().map(|right| Beam {
            length: left.length,
            width: right.width.unwrap_or(left.width),
            thickness: right.thickness.unwrap_or(left.thickness),
            modulus: right.modulus.unwrap_or(left.modulus),
            density: right.density.unwrap_or(left.density),
            poisson: right.poisson.unwrap_or(left.poisson),
        }),
        overlap: joint.overlap,
    }
}

/// Returns the specimen on this joint, without sensors and without masses of single recordings.
pub fn described_specimen(test: &TestDescription, joint: Option<Joint>) -> Specimen {
    Specimen::jointed(
        test.joint.beam,
        &described_beam(test),
        test.joint.kind,
        &lap_layout(test),
        joint,
    )
}
