//! The modes of a specimen, and what they say of changes to it.

use super::lanczos::{Pairs, lowest_pairs};
use super::model::{Energies, Model, Motion, Run};
use super::{Mesh, Specimen};
use crate::StructureError;
use std::f64::consts::PI;

/// Added to a singular stiffness matrix, in units of mass: about the first elastic eigenvalue of a
/// free beam, lambda^4 = 500.
pub(super) const SHIFT: f64 = 500.0;

/// Below this eigenvalue (the first elastic one of a free beam is 500) nothing withstands a motion.
pub(super) const NO_STIFFNESS: f64 = 1e-6;

/// The lowest elastic modes of a specimen. Modes count from 0; positions run from the left end (m).
/// Shapes are mass-normalised: their modal mass is 1 kg.
#[derive(Debug, Clone)]
pub struct SpecimenModes {
    pub(super) model: Model,
    pub(super) mesh: Mesh,
    pub(super) suspension: Vec<f64>,
    pub(super) frequencies: Vec<f64>,
    /// Motions that are rigid but for springs to the ground and the axial force.
    pub(super) loose: Vec<Mode>,
    pub(super) modes: Vec<Mode>,
}

/// A mode in the model's units.
#[derive(Debug, Clone)]
pub(super) struct Mode {
    /// omega^2.
    pub(super) square: f64,
    /// Of unit modal mass.
    pub(super) motion: Motion,
    pub(super) energies: Energies,
}

impl Mode {
    pub(super) fn new(model: &Model, vector: &[f64]) -> Self {
        let motion = model.motion(vector);
        let energies = model.energies(&motion);
        let square = energies.quotient();
        let factor = energies.modal_mass(square).sqrt().recip();
        Self {
            square,
            motion: motion.scaled(factor),
            energies: energies.scaled(factor * factor),
        }
    }
}

impl SpecimenModes {
    pub(super) fn new(
        specimen: &Specimen,
        count: usize,
        mesh: Mesh,
    ) -> Result<Self, StructureError> {
        let model = Model::new(specimen, mesh)?;
        let (stiffness, mass) = model.matrices();
        let loose = model.rigid_motions();
        let singular = loose > 0 && !model.is_supported();
        let shift = if loose > 0 { SHIFT } else { 0.0 };
        let bounds = (shift, model.highest_square());
        let locked = if singular {
            model.rigid_vectors()
        } else {
            Vec::new()
        };
        let pairs = lowest_pairs(&stiffness, &mass, bounds, &locked, count + loose)?;
        let Pairs { values, vectors } = pairs;
        // Rounding moves each value by some parts in 1e16 of the highest one.
        let rounding = NO_STIFFNESS + 1e-7 * SHIFT + 1e-15 * bounds.1;
        if values[..loose].iter().any(|value| *value < -rounding) {
            return Err(StructureError::FiniteElements {
                reason: "it is not stable: the axial force buckles it".to_owned(),
            });
        }
        let frequency = |square: f64| model.frequency(square);
        let suspension = values[..loose]
            .iter()
            .filter(|value| **value >= NO_STIFFNESS);
        let all: Vec<Mode> = vectors
            .iter()
            .map(|vector| Mode::new(&model, vector))
            .collect();
        let (loose, modes) = all.split_at(loose);
        Ok(Self {
            suspension: suspension.map(|square| frequency(*square)).collect(),
            frequencies: modes.iter().map(|mode| frequency(mode.square)).collect(),
            loose: loose.to_vec(),
            modes: modes.to_vec(),
            model,
            mesh,
        })
    }

    /// Natural frequencies (Hz), ascending; of [`SpecimenModes::near`] in the order of the modes they came from.
    pub fn frequencies(&self) -> &[f64] {
        &self.frequencies
    }

    /// Frequencies (Hz) of the motions that only springs to the ground or the axial force keep from
    /// being rigid: a free beam's suspension. Empty where there are none, and of hung modes, which hold them.
    pub fn suspension_frequencies(&self) -> &[f64] {
        &self.suspension
    }

    /// Number of modes.
    pub fn len(&self) -> usize {
        self.frequencies.len()
    }

    /// Whether no mode was asked for.
    pub fn is_empty(&self) -> bool {
        self.frequencies.is_empty()
    }

    /// Displacement (1/sqrt(kg)) at a position (m).
    pub fn displacement(&self, mode: usize, position: f64) -> f64 {
        let place = self.model.place(position);
        let Mode { square, motion, .. } = &self.modes[mode];
        let ends = motion.ends(place.node);
        let inner: f64 = place.inner.iter().zip(&ends).map(|(a, b)| a * b).sum();
        (place.displacement(&ends) + square * inner) / self.model.units.mass.sqrt()
    }

    /// Rotation of the cross-section (rad/m per sqrt(kg)) at a position (m): dw/dx without shear.
    pub fn slope(&self, mode: usize, position: f64) -> f64 {
        let place = self.model.place(position);
        place.rotation(&self.modes[mode].motion.ends(place.node)) / self.rotation_unit()
    }

    fn rotation_unit(&self) -> f64 {
        self.model.units.mass.sqrt() * self.model.units.length
    }

    /// Deformation of the joint's springs: displacement (1/sqrt(kg)) and rotation (1/(m sqrt(kg))).
    /// Of a lap joint right minus left; with a base, against the base.
    pub fn joint_motion(&self, mode: usize) -> [f64; 2] {
        let [w, theta] = self.model.joint_motion(&self.modes[mode].motion);
        [
            w / self.model.units.mass.sqrt(),
            theta / self.rotation_unit(),
        ]
    }

    /// Share of the joint's springs in the strain energy (1).
    pub fn joint_energy_share(&self, mode: usize) -> f64 {
        // Of unit modal mass, omega^2 is twice the whole strain energy.
        self.model.joint_energy(&self.modes[mode].motion) / self.modes[mode].square
    }

    /// Share of the base in the kinetic energy (1): near 1 where the mode is the base's own.
    pub fn base_participation(&self, mode: usize) -> f64 {
        let turn = self.modes[mode].motion.base.unwrap_or(0.0);
        let inertia = self.model.base.map_or(0.0, |base| base.inertia);
        inertia * turn * turn / self.modes[mode].energies.kinetic
    }

    /// Frequencies (Hz) that Rayleigh's quotient gives for another specimen with these modes' shapes.
    ///
    /// The quotient is stationary at a mode: of another specimen that differs by a small d it is the
    /// other's frequency up to d^2, and its derivative with any parameter is the frequency's.
    ///
    /// # Errors
    /// As [`Specimen::modes`], and where the other specimen has other beams or other rigid springs.
    pub fn rayleigh_frequencies(&self, other: &Specimen) -> Result<Vec<f64>, StructureError> {
        let model = self.model_of(other)?;
        Ok((0..self.len())
            .map(|mode| self.quotient_frequency(&model, mode))
            .collect())
    }

    fn model_of(&self, other: &Specimen) -> Result<Model, StructureError> {
        let model = Model::new(other, self.mesh)?;
        let rigid = |model: &Model| [0, 1].map(|i| model.joint[i][i].is_infinite());
        let nodes =
            |model: &Model| -> Vec<usize> { model.runs.iter().map(|run| run.elements).collect() };
        if nodes(&model) != nodes(&self.model) || rigid(&model) != rigid(&self.model) {
            return Err(StructureError::FiniteElements {
                reason: "a shape serves specimens of the same beams and rigid springs only"
                    .to_owned(),
            });
        }
        Ok(model)
    }

    fn quotient_frequency(&self, model: &Model, mode: usize) -> f64 {
        let motion = &self.modes[mode].motion;
        let energies = match (&model.base, motion.base) {
            // The base that the other has moves as the joint's moment turns it.
            (Some(base), None) => {
                let [row_w, row_t] = [motion.nodes[0][0], motion.nodes[0][1]];
                let moment = model.joint[1][0] * row_w + model.joint[1][1] * row_t;
                let dynamic =
                    base.stiffness + model.joint[1][1] - self.modes[mode].square * base.inertia;
                model.energies(&Motion {
                    base: Some(moment / dynamic),
                    ..motion.clone()
                })
            }
            _ => model.energies(motion),
        };
        model.frequency(energies.quotient())
    }
}

impl Model {
    /// Frequency (Hz) of an omega^2 in the model's units.
    pub(super) fn frequency(&self, square: f64) -> f64 {
        square.max(0.0).sqrt() * self.units.omega / (2.0 * PI)
    }

    /// Magnitude of the highest omega^2: that of an element's end alone.
    fn highest_square(&self) -> f64 {
        let ratio = |run: &Run| run.section.stiffness[0][0] / run.section.mass[0][0];
        self.runs.iter().map(ratio).fold(0.0, f64::max)
    }

    /// Whether something beside the joint withstands rigid motions.
    pub(super) fn is_supported(&self) -> bool {
        !self.springs.is_empty() || self.runs.iter().any(|run| run.section.axial_force != 0.0)
    }

    /// Unit motions without strain energy where only the joint could withstand them.
    fn rigid_vectors(&self) -> Vec<Vec<f64>> {
        let whole = self.runs.len() > 1;
        let mut motions = Vec::new();
        for kind in 0..2 {
            if whole {
                motions.push(self.rigid_vector(kind, 0));
            }
            if self.joint[kind][kind] == 0.0 {
                motions.push(self.rigid_vector(kind, self.runs.len() - 1));
            }
        }
        motions
    }

    /// Translation (0) or rotation (1) of the runs from `first` on, about the first one's left end.
    pub(super) fn rigid_vector(&self, kind: usize, first: usize) -> Vec<f64> {
        let mut motion = Motion {
            nodes: vec![[0.0; 2]; self.numbering.nodes.len()],
            base: None,
        };
        for run in &self.runs[first..] {
            for index in 0..=run.elements {
                let x = run.start + index as f64 * run.section.element.length;
                motion.nodes[run.first_node + index] = if kind == 0 {
                    [1.0, 0.0]
                } else {
                    [x - self.runs[first].start, 1.0]
                };
            }
        }
        self.vector(&motion)
    }
}
