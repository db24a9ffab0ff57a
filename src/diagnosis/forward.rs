//! What a hypothesis predicts: all readings, with their slopes.

use super::catalogue::{Candidate, PlaceKind};
use super::frame::{Frame, Row};
use super::joint_energy::joint_slopes;
use super::least_squares::{Knowledge, Linearised, Model};
use super::nominal::COUPLING;
use super::solved::Solved;
use nalgebra::DMatrix;
use std::sync::Arc;
use tapjoint_beam::effects::Effect;
use tapjoint_beam::specimen::{Specimen, SpecimenJoint};

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
    pub(super) fn with_joint(&self, specimen: &Specimen, parameters: &[f64]) -> Specimen {
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
                let other = self.rows_of(&self.solve_near(&moved, &solved)?, &moved)?;
                for (row, (new, old)) in other.iter().zip(&base).enumerate() {
                    slopes[(row, column)] = (new - old) / step;
                }
            }
        }
        if self.softening(parameters).is_some() {
            self.amplitude_slopes(parameters, (&solved, &base), &mut slopes);
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
                let at = |x: f64| one.modes().displacement(index, x);
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
                    one.modes()
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

    /// What the joint's stiffnesses do to every row: see [`joint_slopes`]; to shapes, what they do at the nominal
    /// optimum.
    fn joint_slopes(&self, solved: &[Solved], slopes: &mut DMatrix<f64>) {
        let mut all: Vec<Vec<Vec<f64>>> = Vec::with_capacity(solved.len());
        for one in solved {
            let mut before = solved[..all.len()].iter();
            let known = before.position(|other| Arc::ptr_eq(&other.own, &one.own));
            let directions = self.layout.joint.iter();
            all.push(match known {
                Some(other) => all[other].clone(),
                None => directions.map(|k| joint_slopes(one, *k)).collect(),
            });
        }
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
            for (column, own) in all[configuration].iter().enumerate() {
                slopes[(row, column)] = own[index] * offset_factor(one, index);
            }
        }
    }
}

/// A constant bias does not move with the structure: d ln(s f + b)/d ln f = s f/(s f + b).
fn offset_factor(one: &Solved, index: usize) -> f64 {
    let own = one.modes().frequencies()[index] * one.seen.frequency_scale;
    own / (own + one.seen.frequency_offset)
}
