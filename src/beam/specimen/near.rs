//! Modes of a specimen that differs little from one that is solved.

use super::Specimen;
use super::lanczos::dot;
use super::model::Model;
use super::modes::{Mode, SpecimenModes};
use crate::StructureError;

impl SpecimenModes {
    /// The modes of another specimen that differs little, in the order of these: one step of Rayleigh quotient
    /// iteration from each. A shape that is off by a small e is off by about e^3 afterwards (Parlett 1998, 4.7), so
    /// that differences over small steps are those of exact modes, for less than their price.
    ///
    /// `None` where the other has other motions (rigid springs, a base) or where some are loose: there
    /// [`Specimen::modes`] has to solve anew. Of [`SpecimenModes::hung`] modes the suspension is lost.
    ///
    /// # Errors
    /// As [`Specimen::modes`].
    pub fn near(&self, other: &Specimen) -> Result<Option<Self>, StructureError> {
        let model = Model::new(other, self.mesh)?;
        if model.numbering != self.model.numbering || !self.loose.is_empty() {
            return Ok(None);
        }
        let (stiffness, mass) = model.matrices();
        let modes: Option<Vec<Mode>> = (self.modes.iter())
            .map(|mode| {
                let vector = self.model.vector(&mode.motion);
                let pulled = mass.times(&vector);
                let square = dot(&stiffness.times(&vector), &vector) / dot(&pulled, &vector);
                let shifted = stiffness.plus(-square, &mass).indefinite();
                let moved = shifted.solve(pulled.clone());
                let along = dot(&moved, &pulled);
                (along.is_finite() && along != 0.0).then(|| {
                    // As long as the matrix is near to singular, and of either sign.
                    let shape: Vec<f64> = moved.iter().map(|value| value / along).collect();
                    Mode::new(&model, &shape)
                })
            })
            .collect();
        Ok(modes.map(|modes| Self {
            suspension: Vec::new(),
            frequencies: modes
                .iter()
                .map(|mode| model.frequency(mode.square))
                .collect(),
            loose: Vec::new(),
            modes,
            mesh: self.mesh,
            model,
        }))
    }
}
