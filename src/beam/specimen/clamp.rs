//! How a rigid clamp, which keeps the slope across the width, differs from springs that are spread over it.

use super::{Mesh, Specimen};
use crate::{StructureError, WidthStiffening};

/// What a clamp that keeps the slope across the width adds to each frequency, over what holding the end flat adds.
///
/// Near the clamp the section has more ways to move than `a`, and the clamp holds them all. Fitted to
/// `scripts/plate_width.py` for Poisson's ratios from 0.2 to 0.45, to 1 % of the correction.
fn clamp_factor(poisson: f64) -> f64 {
    1.15 + 0.47 * poisson
}

impl Specimen {
    /// Returns how much higher (1, relative) the lowest `count` frequencies are in a rigid clamp than on springs spread
    /// over the width. The clamp keeps displacement and slope equal across the width.
    ///
    /// How a joint holds the width is rarely known. A joint that grips the whole width lies between 0 and these numbers.
    /// A free beam has 0. In a lap joint both halves curl alike at the joint.
    ///
    /// # Errors
    /// As [`Specimen::modes`].
    pub fn clamp_differences(&self, count: usize, mesh: Mesh) -> Result<Vec<f64>, StructureError> {
        if self.width_stiffening == WidthStiffening::Ignored || self.joint.is_none() {
            return Ok(vec![0.0; count]);
        }
        let with = |width_stiffening| {
            let other = Self {
                width_stiffening,
                ..self.clone()
            };
            other.modes(count, mesh)
        };
        let nominal = self.modes(count, mesh)?;
        let free = with(WidthStiffening::FreeAtJoint)?;
        let held = with(WidthStiffening::HeldAtJoint)?;
        let factor = clamp_factor(self.body.beams()[0].poisson);
        let frequencies = nominal.frequencies().iter();
        let others = free.frequencies().iter().zip(held.frequencies());
        Ok(frequencies
            .zip(others)
            .map(|(nominal, (free, held))| (free + factor * (held - free)) / nominal - 1.0)
            .collect())
    }
}
