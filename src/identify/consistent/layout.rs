//! The tested structure without its joint: beams, what is fastened to them, and by which route its
//! frequencies are computed.

use std::f64::consts::PI;
use tapjoint_beam::finite_elements::PointAttachment;
use tapjoint_beam::specimen::LapLayout;
use tapjoint_beam::{Assembly, Beam, BeamTheory, StructureError};

/// By which route frequencies are computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Route {
    /// In closed form where that exists, else by finite elements.
    #[default]
    Automatic,
    /// By finite elements, so many to each beam.
    FiniteElements(usize),
}

/// The tested structure without its joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointedStructure {
    /// The beam; of a lap joint the left half's properties and the total length.
    pub beam: Beam,
    /// Theory of bending.
    pub theory: BeamTheory,
    /// How it is held.
    pub assembly: Assembly,
    /// Of a lap joint.
    pub lap: LapLayout,
    /// Masses (kg) on the beam: sensors, and what is fastened.
    pub masses: Vec<PointAttachment>,
    /// Springs (N/m) between beam and ground: suspension, cables.
    pub springs: Vec<PointAttachment>,
    /// How frequencies are computed.
    pub route: Route,
}

impl JointedStructure {
    /// A beam with nothing on it; a lap joint in its middle.
    pub fn new(theory: BeamTheory, beam: Beam, assembly: Assembly) -> Self {
        Self {
            beam,
            theory,
            assembly,
            lap: LapLayout::default(),
            masses: Vec::new(),
            springs: Vec::new(),
            route: Route::Automatic,
        }
    }

    /// The same structure of another beam: places and the overlap in proportion to its length, the right
    /// half's section and material by the same factors.
    #[must_use]
    pub fn with_beam(&self, beam: &Beam) -> Self {
        let longer = beam.length / self.beam.length;
        let mut there = self.clone();
        if let Some(right) = &mut there.lap.right {
            right.length = beam.length;
            right.width *= beam.width / self.beam.width;
            right.thickness *= beam.thickness / self.beam.thickness;
            right.modulus *= beam.modulus / self.beam.modulus;
            right.density *= beam.density / self.beam.density;
        }
        there.lap.position = there.lap.position.map(|position| position * longer);
        there.lap.overlap = there
            .lap
            .overlap
            .map(|(length, mass)| (length * longer, mass));
        for attached in there.masses.iter_mut().chain(&mut there.springs) {
            // A point at the end stays on the beam, whatever the last digit of the product.
            attached.position = (attached.position * longer).min(beam.length);
        }
        there.beam = *beam;
        there
    }

    /// The beams between which the joint sits, or the one beam.
    ///
    /// # Errors
    /// [`StructureError`] of a beam that cannot exist, or a joint off the beam.
    pub fn pieces(&self) -> Result<Vec<Beam>, StructureError> {
        self.beam.check()?;
        if self.assembly != Assembly::Lap {
            return Ok(vec![self.beam]);
        }
        let position = self.lap.position.unwrap_or(0.5 * self.beam.length);
        if !(position > 0.0 && position < self.beam.length) {
            return Err(StructureError::OffBeam {
                position,
                length: self.beam.length,
            });
        }
        let left = Beam {
            length: position,
            ..self.beam
        };
        let right = Beam {
            length: self.beam.length - position,
            ..self.lap.right.unwrap_or(self.beam)
        };
        right.check()?;
        Ok(vec![left, right])
    }

    /// Masses on the beam, the overlap's included: two points in either half, where Gauss's rule
    /// puts them, carry a uniform mass as a cubic shape feels it.
    pub fn all_masses(&self) -> Vec<PointAttachment> {
        let mut masses = self.masses.clone();
        if let Some((length, mass)) = self.lap.overlap.filter(|_| self.assembly == Assembly::Lap) {
            let joint = self.lap.position.unwrap_or(0.5 * self.beam.length);
            // Half of the overlap reaches from 0 to 1/2: its points are 1/4 -+ 1/(4 sqrt 3).
            let gauss = 0.25 / 3f64.sqrt();
            for side in [-1.0, 1.0] {
                for point in [0.25 - gauss, 0.25 + gauss] {
                    masses.push(PointAttachment {
                        position: joint + side * point * length,
                        size: 0.25 * mass,
                    });
                }
            }
        }
        masses.retain(|mass| mass.size != 0.0);
        masses
    }
}

/// Elements of each piece for this highest mode, so that its frequency is right to about 1e-6. By
/// Euler's theory the relative error is (k h)^4/1440 for the wave number k and the element length
/// h; with shear and rotary inertia it falls as h^2 only.
pub(super) fn elements_for(theory: BeamTheory, highest: usize, pieces: &[Beam]) -> usize {
    let size = match theory {
        BeamTheory::Euler => 0.18,
        BeamTheory::Timoshenko => 0.09,
    };
    let total: f64 = pieces.iter().map(|piece| piece.length).sum();
    let longest = pieces.iter().map(|piece| piece.length).fold(0.0, f64::max);
    let wave = (highest as f64 + 0.5) * PI * longest / total;
    ((wave / size).ceil() as usize).max(8)
}
