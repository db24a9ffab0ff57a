//! The beam's own modes on a fixture that gives: the fixture's mode has no number.

use super::{Mesh, Specimen, SpecimenModes};
use crate::StructureError;

/// All modes up to some of the beam's own.
#[derive(Debug, Clone)]
pub struct BeamModes {
    /// All modes.
    pub modes: SpecimenModes,
    /// Which of them is the beam's first, second, and so on (from 0).
    pub numbers: Vec<usize>,
    /// Which of them is the fixture's own; `None` on a fixture that does not give.
    pub fixture: Option<usize>,
}

impl BeamModes {
    /// Those of another specimen that differs little, by [`SpecimenModes::near`]: every mode keeps its number.
    ///
    /// # Errors
    /// As [`Specimen::modes`].
    pub fn near(&self, other: &Specimen) -> Result<Option<Self>, StructureError> {
        let near = self.modes.near(other)?;
        Ok(near.map(|modes| BeamModes {
            modes,
            numbers: self.numbers.clone(),
            fixture: self.fixture,
        }))
    }
}

impl Specimen {
    /// The lowest `count` modes of the beam. On a fixture that gives, the mode in which it moves most is its
    /// own; the others keep the beam's numbers.
    ///
    /// # Errors
    /// As [`Specimen::modes`].
    pub fn beam_modes(&self, count: usize, mesh: Mesh) -> Result<BeamModes, StructureError> {
        let based = self.base.is_some_and(|base| base.ratio > 0.0);
        let all = count + usize::from(based);
        let modes = self.modes(all, mesh)?;
        let moving = |mode: &usize| modes.base_participation(*mode);
        let fixture = (0..all)
            .filter(|_| based)
            .max_by(|a, b| moving(a).total_cmp(&moving(b)));
        let own = (0..all).filter(|mode| Some(*mode) != fixture);
        Ok(BeamModes {
            numbers: own.collect(),
            modes,
            fixture,
        })
    }
}
