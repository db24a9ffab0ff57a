//! Beam, joint and effects of the model, and the structure that they describe.

use super::reader::{DescriptionError, Entry, Limits, Table, number, with_unit};
use super::tolerance::{Described, read_free, read_weighed};
use super::{
    Assembly, BeamDescription, BeamTheory, BeamTolerance, EffectDescription, JointDescription,
    JointModel, LapOverlap, RightHalf, TestDescription, keys,
};
use std::collections::BTreeMap;
use tapjoint_beam::Beam;
use tapjoint_beam::beam::DEFAULT_POISSON;
use tapjoint_beam::specimen::{Joint, LapLayout, Specimen};
use tapjoint_numerics::quantity::Dimension;

/// A property of a beam with its limits and its usual range.
pub(super) struct Property {
    pub(super) key: &'static str,
    /// Words for a missing property.
    wanted: &'static str,
    example: &'static str,
    pub(super) dimension: Dimension,
    limits: Limits,
    /// Lowest and highest usual value.
    usual: [f64; 2],
    /// Question about an unusual value.
    question: &'static str,
}

// The limits are physical (no solid is denser than 1e5 kg/m3 or stiffer than 1e13 Pa) or beyond the reach
// of a hammer. Within them no frequency leaves the range of numbers. The usual ranges are those of beams that
// people tap.
pub(super) const LENGTH: Property = Property {
    key: "length",
    wanted: "a length (m)",
    example: "length = \"423 mm\"",
    dimension: Dimension::Length,
    limits: Limits::between(
        1e-3,
        1e3,
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
    limits: Limits::between(
        1e-6,
        1e3,
        "give the width in m, or with its unit: \"50 mm\"",
    ),
    usual: [1e-4, 2.0],
    question: "did you mean mm? Write \"50 mm\"",
};
const THICKNESS: Property = Property {
    key: "thickness",
    wanted: "a thickness (m)",
    example: "thickness = \"5 mm\"",
    dimension: Dimension::Length,
    limits: Limits::between(
        1e-6,
        1e3,
        "give the thickness in m, or with its unit: \"5 mm\"",
    ),
    usual: [1e-5, 0.5],
    question: "did you mean mm? Write \"5 mm\"",
};
const MODULUS: Property = Property {
    key: "modulus",
    wanted: "Young's modulus (Pa)",
    example: "modulus = \"207 GPa\"",
    dimension: Dimension::Pressure,
    limits: Limits::between(
        1.0,
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
    limits: Limits::between(
        1e-3,
        1e5,
        "give the density in kg/m3, or with its unit: \"7.85 g/cm3\"",
    ),
    usual: [10.0, 25e3],
    question: "did you mean g/cm3? Write \"7.85 g/cm3\"",
};
/// An isotropic solid is stable only within these limits.
const POISSON: Limits = Limits::above(-1.0, 0.5, "metals have 0.25 to 0.35; leave it out for 0.3");
/// Smallest length of a slender beam, in thicknesses.
const STOCKY: f64 = 3.0;

/// Reads `[beam]` without its right half.
pub(super) fn read_beam(table: &Table<'_>) -> Result<BeamDescription, DescriptionError> {
    let length = needed(table, &LENGTH)?;
    let width = needed(table, &WIDTH)?;
    let thickness = needed(table, &THICKNESS)?;
    let modulus = needed(table, &MODULUS)?;
    let weighed = read_weighed(table)?;
    let bar_length = table.optional("bar_length", read_free_length)?;
    if let Some(entry) = table.get("bar_length")
        && bar_length < Some(length)
    {
        return Err(entry.error(
            "the whole bar is shorter than its free `length`; measure it from end to end, clamped part included",
        ));
    }
    let density = match (optional(table, &DENSITY)?, weighed) {
        (Some(density), _) => density,
        // The weight says it: nothing else is known of it.
        (None, Some(weighed)) if table.get("right").is_none() => {
            weighed.mass / (bar_length.unwrap_or(length) * width * thickness)
        }
        (None, _) => needed(table, &DENSITY)?,
    };
    let described = [
        (&LENGTH, length),
        (&WIDTH, width),
        (&THICKNESS, thickness),
        (&MODULUS, modulus),
        (&DENSITY, density),
    ];
    let described = described.map(|(property, value)| Described { property, value });
    let beam = BeamDescription {
        length,
        width,
        thickness,
        modulus,
        density,
        poisson: table.within("poisson", Dimension::Ratio, &POISSON)?,
        tolerance: BeamTolerance::read(table, described)?,
        weighed,
        density_stated: table.get("density").is_some(),
        free: read_free(table)?,
        bar_length,
    };
    let stocky = beam.length < STOCKY * beam.thickness;
    if let Some(entry) = table.get("thickness").filter(|_| stocky) {
        let length = with_unit(beam.length, "m");
        let usual = format!("less than a third of the length, {length}");
        let question = "did you swap thickness and length, or mix units?";
        entry.unusual(beam.thickness, "m", &usual, question);
    }
    Ok(beam)
}

/// Reads a length (m) of the beam: the free one in a recording, or that of the whole bar.
pub(super) fn read_free_length(entry: &Entry<'_>) -> Result<f64, DescriptionError> {
    read_property(entry, &LENGTH)
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
        let usual = format!("{} to {}", number(low), with_unit(high, unit));
        entry.unusual(value, unit, &usual, property.question);
    }
    Ok(value)
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
