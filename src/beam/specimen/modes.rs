//! The modes of a specimen, and what they say of changes to it.

use super::model::{Energies, HELD, Model, Motion, Run};
use super::{Mesh, Specimen};
use crate::StructureError;
use crate::eigen::{Pairs, dot, lowest_pairs};
use nalgebra::{DMatrix, SymmetricEigen};
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

// Modes of a specimen that differs little from one that is solved.

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

// What holds a loose specimen beside its joint: a soft suspension, springs to the ground; and what
// the joint's spring gives by all modes that were not computed.
//
// A suspension that gives a free specimen its two rigid motions R (of unit modal mass) the
// frequencies Omega, and leaves everything else as it is, has the stiffness `M R Omega^2 R^T M`. In
// the coordinates of the specimen's own modes, which cables may have bent and tilted, that is
// `B Omega^2 B^T` with `B = Phi^T M R`, so that all modes follow from one small matrix. Of a free
// specimen B is the identity for the rigid motions and 0 for the elastic ones, which then stay.

/// Turns of the eigenvalue iteration for each row; two or three are usual.
const MOST_TURNS: usize = 60;

impl SpecimenModes {
    /// These modes, preceded by the motions that are rigid but for springs to the ground, the axial
    /// force and the suspension, and the number of those. `suspension`: frequencies (Hz), up and down
    /// and rocking, that it would give the specimen with nothing else to hold it; `None` where there
    /// is none. What nothing withstands is left out.
    ///
    /// # Errors
    /// [`StructureError`] where the modes do not settle.
    pub fn hung(&self, suspension: Option<[f64; 2]>) -> Result<(Self, usize), StructureError> {
        let supported = self.model.is_supported();
        if self.loose.is_empty() || !(supported || suspension.is_some()) {
            return Ok((self.clone(), 0));
        }
        // Where nothing else holds it the suspension does not reach the elastic modes.
        let reached = if supported { self.modes.len() } else { 0 };
        let (reached, others) = self.modes.split_at(reached);
        let basis: Vec<&Mode> = self.loose.iter().chain(reached).collect();
        let matrix = self.stiffness_among(&basis, suspension);
        let turns = MOST_TURNS * basis.len();
        let pairs = SymmetricEigen::try_new(matrix, f64::EPSILON, turns).ok_or_else(|| {
            StructureError::FiniteElements {
                reason: "its modes on the suspension do not settle".to_owned(),
            }
        })?;
        let mut order: Vec<usize> = (0..basis.len()).collect();
        order.sort_by(|&a, &b| pairs.eigenvalues[a].total_cmp(&pairs.eigenvalues[b]));
        // Rounding among rigid motions alone is relative to the suspension.
        let nothing = if supported {
            NO_STIFFNESS
        } else {
            1e-14 * pairs.eigenvalues.amax()
        };
        let free = order[..self.loose.len()].iter();
        let free = free.filter(|&&i| pairs.eigenvalues[i] < nothing).count();
        let hung = order[free..].iter().map(|&index| {
            let shares = pairs.eigenvectors.column(index);
            self.mixed(&basis, pairs.eigenvalues[index], shares.as_slice())
        });
        let modes: Vec<Mode> = hung.chain(others.iter().cloned()).collect();
        let frequencies = modes.iter().map(|mode| self.model.frequency(mode.square));
        let hung = Self {
            frequencies: frequencies.collect(),
            model: self.model.clone(),
            mesh: self.mesh,
            suspension: Vec::new(),
            loose: Vec::new(),
            modes,
        };
        Ok((hung, self.loose.len() - free))
    }

    /// Stiffness of specimen and suspension in the coordinates of its motions.
    fn stiffness_among(&self, basis: &[&Mode], suspension: Option<[f64; 2]>) -> DMatrix<f64> {
        let loose = self.loose.len();
        let mut matrix = DMatrix::zeros(basis.len(), basis.len());
        for (index, mode) in basis.iter().enumerate() {
            matrix[(index, index)] = mode.square;
        }
        // Loose motions lie so close together that the method that found them mixes them.
        for i in 0..loose {
            for j in 0..i {
                let [strain, _] = self.model.products(&basis[i].motion, &basis[j].motion);
                matrix[(i, j)] = strain;
                matrix[(j, i)] = strain;
            }
        }
        let Some(frequencies) = suspension else {
            return matrix;
        };
        for (rigid, frequency) in self.model.rigid_pair().iter().zip(frequencies) {
            let square = (2.0 * PI * frequency / self.model.units.omega).powi(2);
            let of = |mode: &&Mode| self.model.products(&mode.motion, rigid)[1];
            let shares: Vec<f64> = basis.iter().map(of).collect();
            for (i, a) in shares.iter().enumerate() {
                for (j, b) in shares.iter().enumerate() {
                    matrix[(i, j)] += square * a * b;
                }
            }
        }
        matrix
    }

    /// The basis is orthonormal, so that a mode has unit modal mass where its shares do.
    fn mixed(&self, basis: &[&Mode], square: f64, shares: &[f64]) -> Mode {
        let none = basis[0].motion.clone().scaled(0.0);
        let parts = basis.iter().zip(shares);
        let motion = parts.fold(none, |sum, (mode, share)| sum.plus(*share, &mode.motion));
        Mode {
            square,
            energies: self.model.energies(&motion),
            motion,
        }
    }

    /// Rotation of the joint's spring per moment on both its ends (rad/(N m)) by all modes beyond
    /// these: the sum of psi^2/omega^2, which falls too slowly to be added up. It is the static
    /// compliance less that of the modes here. A suspension does not change it, but the modes
    /// of [`Self::hung`] no longer say which motions are loose: ask the modes before.
    pub fn joint_compliance_beyond(&self) -> f64 {
        // Loose motions make K singular, and s M is added: sum psi^2/(omega^2 + s).
        let shift = if self.loose.is_empty() { 0.0 } else { SHIFT };
        let (stiffness, mass) = self.model.matrices();
        let Some(factor) = stiffness.plus(shift, &mass).cholesky() else {
            return 0.0;
        };
        let moment = self.model.joint_moment();
        let mut answer = moment.clone();
        factor.solve_lower(&mut answer);
        factor.solve_upper(&mut answer);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let mut sum = dot(&moment, &answer);
        let mut squares = dot(&answer, &mass.times(&answer));
        for mode in self.loose.iter().chain(&self.modes) {
            let psi = self.model.joint_motion(&mode.motion)[1];
            sum -= psi * psi / (mode.square + shift);
            squares -= (psi / (mode.square + shift)).powi(2);
        }
        // 1/omega^2 = 1/(omega^2 + s) + s/(omega^2 + s)^2 up to (s/omega^2)^2, 1e-8 beyond ten modes.
        let units = &self.model.units;
        let compliance = (sum + shift * squares) / (units.stiffness() * units.length.powi(2));
        compliance.max(0.0)
    }
}

impl Model {
    /// Twice the strain and the kinetic energy that two motions have in common.
    fn products(&self, a: &Motion, b: &Motion) -> [f64; 2] {
        let [with, without] = [1.0, -1.0].map(|sign| self.energies(&a.plus(sign, b)));
        [
            0.25 * (with.strain - without.strain),
            0.25 * (with.kinetic - without.kinetic),
        ]
    }

    /// Up and down, and rocking about the centre of mass, both of unit modal mass.
    fn rigid_pair(&self) -> [Motion; 2] {
        let [up, turn] = [0, 1].map(|kind| self.motion(&self.rigid_vector(kind, 0)));
        let size = |motion: &Motion| self.energies(motion).kinetic.sqrt();
        let [_, first] = self.products(&up, &turn);
        let centre = first / self.energies(&up).kinetic;
        let rock = turn.plus(-centre, &up);
        [&up, &rock].map(|motion| motion.clone().scaled(size(motion).recip()))
    }

    /// A unit moment on the beam's end, and its opposite on what the joint fastens it to.
    fn joint_moment(&self) -> Vec<f64> {
        let mut load = vec![0.0; self.numbering.size];
        for (row, component, sign) in self.joint_ends() {
            if component == 1 && row != HELD {
                load[row] += sign;
            }
        }
        load
    }
}

// The beam's own modes on a fixture that gives: the fixture's mode has no number.

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
