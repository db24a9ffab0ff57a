//! From a beam and how it is held to the specimen: the one place where halves of a lap joint are cut.

use super::{Body, LapOverlap, Specimen, SpecimenJoint};
use crate::{Assembly, Beam, BeamTheory};

/// Where a lap joint's halves differ from two equal pieces of one beam.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LapLayout {
    /// The joint's place (m) from the left end; `None` = the middle.
    pub position: Option<f64>,
    /// The right half, where it differs; its `length` is not used.
    pub right: Option<Beam>,
    /// Length (m) of the overlap and the mass (kg) it adds.
    pub overlap: Option<(f64, f64)>,
}

impl Specimen {
    /// A beam (of a lap joint the left half's properties and the total length) on its joint, with nothing
    /// on it but a lap joint's overlap; `lap` is of no meaning for one beam.
    pub fn jointed(
        theory: BeamTheory,
        (beam, assembly): (&Beam, Assembly),
        lap: &LapLayout,
        joint: SpecimenJoint,
    ) -> Self {
        let mut specimen = Self::new(body(beam, assembly, lap), joint);
        specimen.shear_rotary = match theory {
            BeamTheory::Euler => 0.0,
            BeamTheory::Timoshenko => 1.0,
        };
        let overlap = lap.overlap.filter(|_| assembly == Assembly::Lap);
        specimen.overlap = overlap.map(|(length, mass)| LapOverlap { length, mass });
        specimen
    }
}

fn body(beam: &Beam, assembly: Assembly, lap: &LapLayout) -> Body {
    if assembly != Assembly::Lap {
        return Body::One(*beam);
    }
    let position = lap.position.unwrap_or(0.5 * beam.length);
    let piece = |beam: Beam, length: f64| Beam { length, ..beam };
    Body::Joined([
        piece(*beam, position),
        piece(lap.right.unwrap_or(*beam), beam.length - position),
    ])
}
