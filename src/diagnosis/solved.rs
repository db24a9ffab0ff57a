//! The structure of each configuration under a hypothesis, and its modes.

use super::forward::Forward;
use super::frame::Row;
use super::joint_path::Changes;
use std::sync::Arc;
use tapjoint_beam::effects::{Circumstances, Seen, apply};
use tapjoint_beam::specimen::{BeamModes, Specimen, SpecimenModes};

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
            // A kink that moves takes the shape with it.
            let kinks = |one: &Specimen| -> Vec<f64> {
                one.hinges.iter().map(|hinge| hinge.position).collect()
            };
            let shape_holds = kinks(specimen) == kinks(&known.seen.specimen);
            if frequencies_alone
                && shape_holds
                && let Ok(all) = known.modes().rayleigh_frequencies(specimen)
            {
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

#[cfg(test)]
mod tests {
    use super::super::catalogue::{Candidate, Scales, candidate};
    use super::super::example::{plan, strip};
    use super::super::frame::Frame;
    use super::super::hypothesis::fit_nominal;
    use super::super::knowledge::knowledge;
    use super::super::least_squares::Model;
    use super::super::settings::GapSettings;
    use super::super::synthetic::{TestPlan, observe};
    use super::*;
    use tapjoint_beam::effects::EffectId;

    /// A strip seen in two recordings with or without its shapes.
    fn frame(shape_std: Option<f64>) -> Frame {
        let plan = TestPlan {
            shape_std,
            ..plan(&[0.34, 0.19])
        };
        let nominal = strip(0.004);
        let observations = observe(&plan, &nominal, &[], 3).unwrap();
        Frame::new(&observations, &nominal, &GapSettings::default())
    }

    /// Slopes with respect to size and place of an effect that is there, beside central differences of
    /// predictions that are solved anew: the largest difference in a column over its largest entry.
    fn worst(frame: &Frame, effect: Candidate, (share, place): (f64, f64)) -> f64 {
        let settings = GapSettings::default();
        let forward = Forward::new(frame, &[effect]);
        let known = knowledge(frame, &forward.layout, &settings);
        let none = fit_nominal(frame, &settings).unwrap();
        let mut here = none.branch.optimum.parameters;
        let at = forward.layout.size(0);
        let mut unknowns = vec![(at, 1e-3 * effect.size.scale)];
        let size = effect.size.nothing + share * effect.size.scale;
        here.insert(at, size.min(0.9 * effect.size.high));
        if let Some(range) = effect.place {
            let (low, high) = (range.inward(range.low), range.inward(range.high));
            here.insert(at + 1, low + place * (high - low));
            unknowns.push((at + 1, 1e-4 * (high - low)));
        }
        let slopes = forward.linearise(&here, &known).unwrap().slopes;
        let differ = |&(column, step): &(usize, f64)| {
            let [above, below] = [step, -step].map(|step| {
                let mut moved = here.clone();
                moved[column] += step;
                forward.predict(&moved).unwrap().0
            });
            let exact = above
                .iter()
                .zip(&below)
                .map(|(a, b)| (a - b) / (2.0 * step));
            let exact: Vec<f64> = exact.collect();
            let most = exact.iter().fold(0.0_f64, |most, one| most.max(one.abs()));
            assert!(slopes.column(column).iter().all(|slope| slope.is_finite()));
            let own = |row: usize| (exact[row] - slopes[(row, column)]).abs();
            let off = (0..exact.len()).map(own).fold(0.0_f64, f64::max);
            if most > 0.0 { off / most } else { off }
        };
        unknowns.iter().map(differ).fold(0.0, f64::max)
    }

    /// From frequencies alone and with shapes, for every effect, wherever it sits.
    #[test]
    fn limit_slopes_near_a_solution_are_those_of_new_solutions() {
        // One-sided steps of 1e-4 of the size bend by a few times that, and a kink by more; what calibration
        // does to a shape, 1 % here, is left out of its slopes.
        for (frame, most) in [(frame(None), 0.005), (frame(Some(0.01)), 0.02)] {
            let scales = Scales::of(&frame.nominal.specimen);
            for effect in EffectId::ALL {
                let Some(candidate) = candidate(effect, &scales) else {
                    continue;
                };
                for (share, place) in [(1.0, 0.12), (1.0, 0.499_98), (5.0, 0.305), (5.0, 0.8)] {
                    let worst = worst(&frame, candidate, (share, place));
                    assert!(worst < most, "{effect:?} at {place}: {worst}");
                }
            }
        }
    }
}
