//! What is fastened to the beam: masses and support springs anywhere on an element.

use super::{FiniteElementModel, scatter};
use crate::StructureError;

/// The equations and displacements that one place on the beam consists of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) equations: [Option<usize>; 4],
    pub(super) shape: [f64; 4],
}

impl FiniteElementModel {
    /// Adds a mass (kg) at a position (m) from the joint or the left end, anywhere on an element.
    /// Of a lap joint, the joint's own place belongs to the right half.
    ///
    /// # Errors
    /// [`StructureError::OffBeam`] for a position outside, [`StructureError::NotPositive`] for a
    /// negative mass.
    pub fn with_point_mass(mut self, position: f64, mass: f64) -> Result<Self, StructureError> {
        let place = self.place(position)?;
        check_not_negative("point mass", mass)?;
        let mass = mass / self.units.mass;
        let shape = place.shape;
        let matrix = std::array::from_fn(|i| std::array::from_fn(|j| mass * shape[i] * shape[j]));
        scatter(&mut self.mass, &place.equations, &matrix);
        Ok(self)
    }

    /// Adds a spring (N/m) between the ground and a position (m), measured as that of a mass.
    /// Motions that were rigid without the spring stay uncounted: a free beam on a soft suspension
    /// begins with its first bending mode.
    ///
    /// # Errors
    /// [`StructureError::OffBeam`] for a position outside, [`StructureError::NotPositive`] for a
    /// negative stiffness.
    pub fn with_support_spring(
        mut self,
        position: f64,
        stiffness: f64,
    ) -> Result<Self, StructureError> {
        let place = self.place(position)?;
        check_not_negative("support spring", stiffness)?;
        // The unit of stiffness is that of mass times that of omega squared.
        let unit = self.units.mass * self.units.omega.powi(2);
        let spring = [[stiffness / unit, 0.0], [0.0, 0.0]];
        let ends: Vec<_> = place
            .equations
            .into_iter()
            .zip(place.shape)
            .map(|(equation, weight)| (equation, 0, weight))
            .collect();
        self.add_joint(&spring, &ends);
        Ok(self)
    }

    /// Where on which element a position (m) lies.
    pub(super) fn place(&self, position: f64) -> Result<Place, StructureError> {
        let off = StructureError::OffBeam {
            position,
            length: self.units.length,
        };
        let along = position / self.units.length;
        // A sensor at the very end may have been rounded beyond it.
        if !(0.0..=1.0 + 1e-9).contains(&along) {
            return Err(off);
        }
        let piece = self.pieces.iter().rev().find(|piece| piece.start <= along);
        let piece = piece.copied().ok_or(off)?;
        let within = (along - piece.start) / piece.element.length;
        let index = (within.max(0.0) as usize).min(piece.elements - 1);
        Ok(Place {
            equations: self.element_equations(&piece, index),
            shape: piece.element.displacement(within - index as f64),
        })
    }
}

fn check_not_negative(quantity: &'static str, value: f64) -> Result<(), StructureError> {
    if value >= 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(StructureError::NotPositive { quantity, value })
    }
}
