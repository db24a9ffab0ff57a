//! What a hypothesis predicts: all readings, with their slopes.

use super::catalogue::{Candidate, PlaceKind};
use super::frame::{Frame, Row};
use super::joint_energy::{joint_shares, stiffened_slope};
use super::joint_path::Changes;
use super::least_squares::{Knowledge, Linearised, Model};
use super::nominal::COUPLING;
use crate::effects::{Circumstances, Effect, Seen, apply};
use crate::structure::specimen::{Specimen, SpecimenJoint, SpecimenModes};
use nalgebra::DMatrix;
use std::sync::Arc;

/// Parameters of a hypothesis in their order: joint, effects (size and place of each), small unknowns.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    /// What is sought of the joint: 0 translation, 1 rotation, 2 coupling.
    pub(super) joint: Vec<usize>,
    /// The effects.
    pub(super) effects: Vec<Candidate>,
}

impl Layout {
    pub(super) fn new(frame: &Frame, effects: &[Candidate]) -> Self {
        let sought = frame.nominal.sought();
        Layout {
            joint: sought.iter().map(|(direction, _)| *direction).collect(),
            effects: effects.to_vec(),
        }
    }

    /// Index of the size of an effect.
    pub(super) fn size(&self, effect: usize) -> usize {
        let before = self.effects[..effect].iter();
        self.joint.len()
            + before
                .map(|one| 1 + usize::from(one.place.is_some()))
                .sum::<usize>()
    }

    /// Index of the place of an effect, if it has one.
    pub(super) fn place(&self, effect: usize) -> Option<usize> {
        self.effects[effect].place.map(|_| self.size(effect) + 1)
    }

    /// Index of the first small unknown.
    pub(super) fn smalls(&self) -> usize {
        self.size(self.effects.len())
    }

    /// The effects with the values that the parameters give them.
    pub(super) fn effects_at(&self, parameters: &[f64]) -> Option<Vec<Effect>> {
        (0..self.effects.len())
            .map(|index| {
                let candidate = &self.effects[index];
                let size = parameters[self.size(index)];
                let place = self.place(index).map(|place| parameters[place]);
                effect_of(candidate, size, place)
            })
            .collect()
    }

    /// The nominal structure with the joint that the parameters give it.
    fn with_joint(&self, specimen: &Specimen, parameters: &[f64]) -> Specimen {
        let mut specimen = specimen.clone();
        if let SpecimenJoint::Springs { kt, kr, coupling } = &mut specimen.joint {
            for (direction, value) in self.joint.iter().zip(parameters) {
                match *direction {
                    0 => *kt = value.exp(),
                    COUPLING => *coupling = *value,
                    _ => *kr = value.exp(),
                }
            }
        }
        specimen
    }
}

/// The effect with its size and its place as it is searched for.
pub(super) fn effect_of(candidate: &Candidate, size: f64, place: Option<f64>) -> Option<Effect> {
    let mut pairs = vec![(candidate.size.name, size)];
    if let (Some(range), Some(searched)) = (&candidate.place, place) {
        let value = range.outward(searched);
        pairs.push(match range.kind {
            PlaceKind::Position => ("position", value),
            PlaceKind::FixtureFrequency => ("frequency", value),
            PlaceKind::Exponent => ("exponent", value),
            PlaceKind::Gyration => ("inertia", size * value * value),
        });
    }
    Effect::from_pairs(candidate.effect, &pairs).ok()
}

/// A configuration's structure under a hypothesis, and its modes.
#[derive(Clone)]
pub(super) struct Solved {
    pub(super) seen: Seen,
    pub(super) modes: Arc<SpecimenModes>,
    /// Which of the modes is the model's mode 1, 2, ...: that of a fixture is left out.
    numbers: Vec<usize>,
    /// What its modes feel of a joint whose stiffness depends on the amplitude.
    pub(super) changes: Option<Changes>,
}

impl Solved {
    /// Index of the mode with this number (1 = lowest).
    pub(super) fn index(&self, mode: usize) -> Option<usize> {
        self.numbers.get(mode - 1).copied()
    }

    /// Index of the fixture's own mode: the one that is nobody's.
    pub(super) fn base(&self) -> Option<usize> {
        let based = self.seen.specimen.base.is_some_and(|base| base.ratio > 0.0);
        (0..self.modes.len()).find(|index| based && !self.numbers.contains(index))
    }

    /// Frequency as it is read (Hz).
    pub(super) fn frequency(&self, mode: usize) -> Option<f64> {
        let own = self.modes.frequencies()[self.index(mode)?];
        Some(self.seen.read(own))
    }
}

/// What a prediction leaves behind for its slopes.
pub(super) struct Solution {
    solved: Vec<Solved>,
    /// All rows without the small unknowns.
    base: Vec<f64>,
    /// Those with respect to the small unknowns.
    slopes: DMatrix<f64>,
}

impl Model for Forward<'_> {
    type Rest = Solution;

    fn predict(&self, parameters: &[f64]) -> Option<(Vec<f64>, Solution)> {
        let solved = self.solve(parameters)?;
        let base = self.rows_of(&solved, parameters)?;
        let mut slopes = DMatrix::zeros(self.rows.len(), parameters.len());
        let predicted = self.add_smalls(&solved, base.clone(), (parameters, &mut slopes));
        let solution = Solution {
            solved,
            base,
            slopes,
        };
        Some((predicted, solution))
    }

    fn complete(
        &self,
        parameters: &[f64],
        known: &[Knowledge],
        (predicted, solution): (Vec<f64>, Solution),
    ) -> Option<Linearised> {
        let Solution {
            solved,
            base,
            mut slopes,
        } = solution;
        self.joint_slopes(&solved, &mut slopes);
        for index in 0..self.layout.effects.len() {
            let steps = self.steps(index, parameters);
            for (column, step) in steps.into_iter().filter(|(k, _)| !known[*k].is_held()) {
                let mut moved = parameters.to_vec();
                moved[column] += step;
                let other = self.rows_of(&self.solve(&moved)?, &moved)?;
                for (row, (new, old)) in other.iter().zip(&base).enumerate() {
                    slopes[(row, column)] = (new - old) / step;
                }
            }
        }
        if self.softening(parameters).is_some() {
            self.amplitude_slopes(parameters, &base, &mut slopes);
        }
        Some(Linearised { predicted, slopes })
    }
}

/// Predicts all rows of a frame under one hypothesis.
pub(super) struct Forward<'a> {
    pub(super) frame: &'a Frame,
    pub(super) layout: Layout,
    /// Rows beyond those of the fit (withheld or planned), if wanted in their place.
    pub(super) rows: &'a [Row],
}

impl<'a> Forward<'a> {
    pub(super) fn new(frame: &'a Frame, effects: &[Candidate]) -> Self {
        Forward {
            frame,
            layout: Layout::new(frame, effects),
            rows: &frame.rows,
        }
    }

    /// Steps of the finite differences of one effect, away from its bounds: small against what readings to
    /// 0.005 % leave open of a large effect (0.1 % of its size, 0.03 % of the length).
    fn steps(&self, index: usize, parameters: &[f64]) -> Vec<(usize, f64)> {
        let candidate = &self.layout.effects[index];
        let column = self.layout.size(index);
        let size = 1e-4 * candidate.size.scale.max(parameters[column].abs());
        let inward =
            |value: f64, step: f64, high: f64| if value + step > high { -step } else { step };
        let mut steps = vec![(
            column,
            inward(parameters[column], size, candidate.size.high),
        )];
        if let (Some(range), Some(place)) = (&candidate.place, self.layout.place(index)) {
            let step = 5e-5 * (range.inward(range.high) - range.inward(range.low));
            steps.push((
                place,
                inward(parameters[place], step, range.inward(range.high)),
            ));
        }
        steps
    }

    /// Structure and modes of each configuration; equal structures are solved once.
    pub(super) fn solve(&self, parameters: &[f64]) -> Option<Vec<Solved>> {
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
            let (modes, numbers) = match known {
                Some(other) => (other.modes.clone(), other.numbers.clone()),
                None => self.modes_of(&seen.specimen)?,
            };
            all.push(Solved {
                seen,
                modes,
                numbers,
                changes,
            });
        }
        Some(all)
    }

    fn modes_of(&self, specimen: &Specimen) -> Option<(Arc<SpecimenModes>, Vec<usize>)> {
        let (modes, numbers) = specimen
            .beam_modes(self.frame.modes, self.frame.mesh)
            .ok()?;
        Some((Arc::new(modes), numbers))
    }

    /// Slopes of all rows with respect to the joint's stiffnesses by finite differences.
    pub(super) fn joint_differences(&self, parameters: &[f64]) -> Option<DMatrix<f64>> {
        const STEP: f64 = 1e-2;
        let base = self.rows_of(&self.solve(parameters)?, parameters)?;
        let mut slopes = DMatrix::zeros(self.rows.len(), self.layout.joint.len());
        for column in 0..self.layout.joint.len() {
            let mut moved = parameters.to_vec();
            moved[column] += STEP;
            let other = self.rows_of(&self.solve(&moved)?, &moved)?;
            for (row, (new, old)) in other.iter().zip(&base).enumerate() {
                slopes[(row, column)] = (new - old) / STEP;
            }
        }
        Some(slopes)
    }

    /// All rows without the small unknowns.
    pub(super) fn rows_of(&self, solved: &[Solved], parameters: &[f64]) -> Option<Vec<f64>> {
        self.rows
            .iter()
            .map(|row| self.row_of(row, solved, parameters))
            .collect()
    }

    fn row_of(&self, row: &Row, solved: &[Solved], parameters: &[f64]) -> Option<f64> {
        match *row {
            Row::Frequency {
                configuration,
                mode,
            } => {
                let one = &solved[configuration];
                let frequency = one.frequency(mode)?;
                let own = Self::own_change(mode, one);
                (frequency > 0.0).then(|| frequency.ln() + own)
            }
            Row::Constant {
                configuration,
                mode,
                sensor,
            } => {
                let one = &solved[configuration];
                let index = one.index(mode)?;
                let setup = &self.frame.setups[configuration];
                let at = |x: f64| one.modes.displacement(index, x);
                Some(at(setup.sensors[sensor].position) * at(setup.tap?))
            }
            Row::Ratio {
                configuration,
                mode,
                sensor,
                reference,
            } => {
                let one = &solved[configuration];
                let index = one.index(mode)?;
                let setup = &self.frame.setups[configuration];
                let at = |sensor: usize| {
                    one.modes
                        .displacement(index, setup.sensors[sensor].position)
                };
                Some(at(sensor) / at(reference))
            }
            Row::Damping { mode } => Some(self.damping(mode, solved, parameters)?.0.ln()),
            Row::Slope {
                configuration,
                mode,
            } => Some(self.slope_along_decay(
                (configuration, mode),
                &solved[configuration],
                parameters,
            )),
        }
    }

    /// d ln f/d ln k = half the strain energy of that spring, as the mode has it, over that of the
    /// structure (Rayleigh's quotient is stationary in the shape).
    fn joint_slopes(&self, solved: &[Solved], slopes: &mut DMatrix<f64>) {
        for (row, kind) in self.rows.iter().enumerate() {
            let Row::Frequency {
                configuration,
                mode,
            } = *kind
            else {
                if let Some(known) = &self.frame.shape_slopes {
                    for column in 0..self.layout.joint.len() {
                        slopes[(row, column)] = known[(row, column)];
                    }
                }
                continue;
            };
            let one = &solved[configuration];
            let Some(index) = one.index(mode) else {
                continue;
            };
            for (column, &direction) in self.layout.joint.iter().enumerate() {
                slopes[(row, column)] =
                    self.joint_slope(one, (index, direction)) * offset_factor(one, index);
            }
        }
    }

    fn joint_slope(&self, one: &Solved, (index, direction): (usize, usize)) -> f64 {
        let based = one.seen.specimen.base.is_some_and(|base| base.ratio > 0.0);
        if based || direction == COUPLING {
            // The base's spring is tied to the joint's by their ratio: both move.
            return stiffened_slope(one, index, direction);
        }
        0.5 * joint_shares(one, index)[direction]
    }
}

/// A constant bias does not move with the structure: d ln(s f + b)/d ln f = s f/(s f + b).
fn offset_factor(one: &Solved, index: usize) -> f64 {
    let own = one.modes.frequencies()[index] * one.seen.frequency_scale;
    own / (own + one.seen.frequency_offset)
}
