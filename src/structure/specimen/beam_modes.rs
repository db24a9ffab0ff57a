//! The beam's own modes on a fixture that gives: the fixture's mode has no number.

use super::{Mesh, Specimen, SpecimenModes};
use crate::structure::StructureError;

impl Specimen {
    /// The lowest `count` modes of the beam: all modes up to these, and which of them is the beam's first,
    /// second, and so on. On a fixture that gives, the mode in which it moves most is its own; the
    /// others keep the beam's numbers.
    ///
    /// # Errors
    /// As [`Specimen::modes`].
    pub fn beam_modes(
        &self,
        count: usize,
        mesh: Mesh,
    ) -> Result<(SpecimenModes, Vec<usize>), StructureError> {
        let based = self.base.is_some_and(|base| base.ratio > 0.0);
        let all = count + usize::from(based);
        let modes = self.modes(all, mesh)?;
        let moving = |mode: &usize| modes.base_participation(*mode);
        let fixture = (0..all)
            .filter(|_| based)
            .max_by(|a, b| moving(a).total_cmp(&moving(b)));
        let own = (0..all).filter(|mode| Some(*mode) != fixture);
        let own = own.collect();
        Ok((modes, own))
    }
}
