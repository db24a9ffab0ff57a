//! The structure of each configuration under a hypothesis, and its modes.

use super::forward::Forward;
use super::frame::Row;
use super::joint_path::Changes;
use crate::effects::{Circumstances, Seen, apply};
use crate::structure::specimen::{BeamModes, Specimen, SpecimenModes};
use std::sync::Arc;

/// A configuration's structure under a hypothesis, and its modes.
#[derive(Clone)]
pub(super) struct Solved {
    pub(super) seen: Seen,
    pub(super) own: Arc<BeamModes>,
    /// Its frequencies (Hz), where these are the modes of a structure next to it.
    frequencies: Option<Vec<f64>>,
    /// What its modes feel of a joint whose stiffness depends on the amplitude.
    pub(super) changes: Option<Changes>,
}

impl Solved {
    /// All its modes, that of a fixture among them.
    pub(super) fn modes(&self) -> &SpecimenModes {
        &self.own.modes
    }

    /// Index of the mode with this number (1 = lowest): that of a fixture has none.
    pub(super) fn index(&self, mode: usize) -> Option<usize> {
        self.own.numbers.get(mode - 1).copied()
    }

    /// Index of the fixture's own mode.
    pub(super) fn base(&self) -> Option<usize> {
        self.own.fixture
    }

    /// Frequency as it is read (Hz).
    pub(super) fn frequency(&self, mode: usize) -> Option<f64> {
        let index = self.index(mode)?;
        let all = self.frequencies.as_deref();
        Some(
            self.seen
                .read(all.unwrap_or(self.modes().frequencies())[index]),
        )
    }
}

impl Forward<'_> {
    /// Structure and modes of each configuration; equal structures are solved once.
    pub(super) fn solve(&self, parameters: &[f64]) -> Option<Vec<Solved>> {
        self.solve_by(parameters, |_, specimen| {
            Some((self.modes_of(specimen)?, None))
        })
    }

    /// The same next to a point that is solved. Where nothing but frequencies is wanted, Rayleigh's quotient says
    /// what becomes of them.
    pub(super) fn solve_near(&self, parameters: &[f64], there: &[Solved]) -> Option<Vec<Solved>> {
        let frequency = |row: &Row| matches!(row, Row::Frequency { .. });
        let frequencies_alone = self.rows.iter().all(frequency);
        self.solve_by(parameters, |configuration, specimen| {
            let known = &there[configuration];
            if known.seen.specimen == *specimen {
                return Some((known.own.clone(), None));
            }
            if frequencies_alone && let Ok(all) = known.modes().rayleigh_frequencies(specimen) {
                return Some((known.own.clone(), Some(all)));
            }
            let near = known.own.near(specimen).ok()?.map(Arc::new);
            Some((near.or_else(|| self.modes_of(specimen))?, None))
        })
    }

    fn solve_by(
        &self,
        parameters: &[f64],
        modes_of: impl Fn(usize, &Specimen) -> Option<(Arc<BeamModes>, Option<Vec<f64>>)>,
    ) -> Option<Vec<Solved>> {
        let effects = self.layout.effects_at(parameters)?;
        let mut all: Vec<Solved> = Vec::with_capacity(self.frame.setups.len());
        for (configuration, setup) in self.frame.setups.iter().enumerate() {
            let nominal = self.layout.with_joint(&setup.specimen, parameters);
            let changes = self.changes(configuration, parameters);
            let circumstances = Circumstances {
                sensors: &setup.carried,
                level: self.level(setup, changes.as_ref(), parameters),
                ..Circumstances::default()
            };
            let seen = apply(&effects, &nominal, &circumstances);
            let known = all
                .iter()
                .find(|other| other.seen.specimen == seen.specimen);
            let (own, frequencies) = match known {
                Some(other) => (other.own.clone(), other.frequencies.clone()),
                None => modes_of(configuration, &seen.specimen)?,
            };
            all.push(Solved {
                seen,
                own,
                frequencies,
                changes,
            });
        }
        Some(all)
    }

    fn modes_of(&self, specimen: &Specimen) -> Option<Arc<BeamModes>> {
        let found = specimen.beam_modes(self.frame.modes, self.frame.mesh);
        Some(Arc::new(found.ok()?))
    }
}
