//! From a test description to the structure it describes, in the theory's terms: for the pipeline and
//! for virtual tests alike.

use crate::{
    FastenedMass, JointKind, KnownStiffness, RecordingDescription, RightHalf, TestDescription,
};
use tapjoint_beam::beam::DEFAULT_POISSON;
use tapjoint_beam::specimen::{Joint, LapLayout, LapOverlap, PointMass, Specimen};
use tapjoint_beam::{Assembly, Beam};

/// The beam; of a lap joint the left half's properties and the total length.
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

/// The right half of a lap joint: the left one's length and what is not said to differ.
fn right_half(right: &RightHalf, left: &Beam) -> Beam {
    Beam {
        length: left.length,
        width: right.width.unwrap_or(left.width),
        thickness: right.thickness.unwrap_or(left.thickness),
        modulus: right.modulus.unwrap_or(left.modulus),
        density: right.density.unwrap_or(left.density),
        poisson: right.poisson.unwrap_or(left.poisson),
    }
}

/// A described stiffness (N/m, N m/rad or N/rad); infinite where it is rigid.
pub fn stiffness_of(known: KnownStiffness) -> f64 {
    match known {
        KnownStiffness::Value(value) => value,
        KnownStiffness::Rigid => f64::INFINITY,
    }
}

/// Coupling of a joint (1), sqrt(Kt Kr)/Ktr, from stiffnesses and 1/Ktr in one system of units; none where
/// Ktr is rigid.
pub fn coupling(kt: f64, kr: f64, cross_compliance: f64) -> f64 {
    if cross_compliance == 0.0 {
        0.0
    } else {
        kt.sqrt() * kr.sqrt() * cross_compliance
    }
}

/// Where a described lap joint's halves differ from two equal pieces; nothing of one beam.
pub fn lap_layout(test: &TestDescription) -> LapLayout {
    let joint = &test.joint;
    let beam = described_beam(test);
    LapLayout {
        position: joint.position,
        right: joint.right.as_ref().map(|right| right_half(right, &beam)),
        overlap: joint.overlap.as_ref().map(|overlap| LapOverlap {
            length: overlap.length,
            mass: overlap.mass,
        }),
    }
}

/// How the described beam is held.
pub fn assembly_of(kind: JointKind) -> Assembly {
    match kind {
        JointKind::Cantilever => Assembly::Cantilever,
        JointKind::Lap => Assembly::Lap,
        JointKind::Free => Assembly::Free,
    }
}

/// The specimen on this joint, without sensors and what is fastened for single recordings.
pub fn described_specimen(test: &TestDescription, joint: Option<Joint>) -> Specimen {
    let (beam, assembly) = (described_beam(test), assembly_of(test.joint.kind));
    Specimen::jointed(test.joint.beam, &beam, assembly, &lap_layout(test), joint)
}

/// The known masses that are fastened to the beam for a recording.
pub fn fastened_masses(recording: &RecordingDescription) -> Vec<PointMass> {
    let point = |fastened: &FastenedMass| PointMass {
        position: fastened.position,
        mass: fastened.mass,
        inertia: 0.0,
    };
    recording.masses.iter().map(point).collect()
}
