//! From what the description says to what the theory takes.

use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{Assembly, Beam, BeamTheory, JointStiffness};
use tapjoint_description::described::{assembly_of, described_beam, stiffness_of};
use tapjoint_description::{JointKind, JointModel, KnownStiffness, TestDescription};
use tapjoint_identify::PairsModel;

/// The described structure in the theory's terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestedStructure {
    /// The beam.
    pub beam: Beam,
    /// How it is held.
    pub assembly: Assembly,
    /// Beam theory of the prediction.
    pub theory: BeamTheory,
    /// Form of the pair regression; `None` for a free beam.
    pub regression: Option<PairsModel>,
    /// Known stiffnesses (1), which are compared instead of fitted.
    pub known: KnownJoint,
}

/// Stiffnesses that the description gives, non-dimensional; infinite = rigid.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct KnownJoint {
    /// Kx (1).
    pub kx: Option<f64>,
    /// Ky (1).
    pub ky: Option<f64>,
    /// 1/Kz (1).
    pub cross_compliance: Option<f64>,
}

impl KnownJoint {
    /// Whether anything is known.
    pub fn any(&self) -> bool {
        self.kx.is_some() || self.ky.is_some() || self.cross_compliance.is_some()
    }

    /// `joint`, with what is known in the place of its stiffnesses.
    pub fn over(&self, joint: Option<JointStiffness>) -> Option<JointStiffness> {
        Some(JointStiffness {
            kx: self.kx.or(joint.map(|joint| joint.kx))?,
            ky: self.ky.or(joint.map(|joint| joint.ky))?,
            cross_compliance: self
                .cross_compliance
                .or(joint.map(|joint| joint.cross_compliance))
                .unwrap_or(0.0),
        })
    }
}

/// The structure that a test description describes.
pub fn tested_structure(test: &TestDescription) -> TestedStructure {
    let beam = described_beam(test);
    TestedStructure {
        beam,
        assembly: assembly_of(test.joint.kind),
        theory: test.joint.beam,
        regression: match (test.joint.kind, test.joint.model) {
            (JointKind::Free, _) => None,
            (JointKind::Lap, _) => Some(PairsModel::Lap),
            (JointKind::Cantilever, JointModel::TwoParameter) => Some(PairsModel::TwoParameter),
            (JointKind::Cantilever, JointModel::ThreeParameter) => Some(PairsModel::ThreeParameter),
        },
        known: known_joint(test, &beam),
    }
}

fn known_joint(test: &TestDescription, beam: &Beam) -> KnownJoint {
    let units = StiffnessUnits::of(beam);
    let in_units =
        |known: Option<KnownStiffness>, unit: f64| known.map(|known| stiffness_of(known) / unit);
    KnownJoint {
        kx: in_units(test.joint.kt, units.kt),
        ky: in_units(test.joint.kr, units.kr),
        cross_compliance: in_units(test.joint.ktr, units.ktr).map(f64::recip),
    }
}
