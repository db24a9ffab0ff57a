//! From a test description to the structure it describes, in the theory's terms: for the pipeline and
//! for virtual tests alike.

use crate::description::{BeamTheory, JointKind, KnownStiffness, RightHalf, TestDescription};
use crate::structure::Beam;
use crate::structure::beam::DEFAULT_POISSON;
use crate::structure::specimen::{Body, LapOverlap, Specimen, SpecimenJoint};

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
pub fn right_half(right: &RightHalf, left: &Beam) -> Beam {
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

/// The specimen on this joint, without sensors.
pub fn described_specimen(test: &TestDescription, joint: SpecimenJoint) -> Specimen {
    let mut specimen = Specimen::new(body(test), joint);
    specimen.shear_rotary = match test.joint.beam {
        BeamTheory::Euler => 0.0,
        BeamTheory::Timoshenko => 1.0,
    };
    specimen.overlap = test.joint.overlap.map(|overlap| LapOverlap {
        length: overlap.length,
        mass: overlap.mass,
    });
    specimen
}

fn body(test: &TestDescription) -> Body {
    let whole = described_beam(test);
    if test.joint.kind != JointKind::Lap {
        return Body::One(whole);
    }
    let position = test.joint.position.unwrap_or(0.5 * whole.length);
    let left = Beam {
        length: position,
        ..whole
    };
    let other = test.joint.right.clone().unwrap_or_default();
    let right = Beam {
        length: whole.length - position,
        ..right_half(&other, &whole)
    };
    Body::Joined([left, right])
}
