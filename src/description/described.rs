//! From a test description to the structure it describes, for the analysis and for virtual tests.

use crate::TestDescription;
use tapjoint_beam::Beam;
use tapjoint_beam::beam::DEFAULT_POISSON;
use tapjoint_beam::specimen::{Joint, LapLayout, LapOverlap, Specimen};

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
        overlap: joint.overlap.as_ref().map(|overlap| LapOverlap {
            length: overlap.length,
            mass: overlap.mass,
        }),
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
