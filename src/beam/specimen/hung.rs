//! What holds a loose specimen beside its joint: a soft suspension, springs to the ground; and what
//! the joint's spring gives by all modes that were not computed.
//!
//! A suspension that gives a free specimen its two rigid motions R (of unit modal mass) the
//! frequencies Omega, and leaves everything else as it is, has the stiffness `M R Omega^2 R^T M`. In
//! the coordinates of the specimen's own modes, which cables may have bent and tilted, that is
//! `B Omega^2 B^T` with `B = Phi^T M R`, so that all modes follow from one small matrix. Of a free
//! specimen B is the identity for the rigid motions and 0 for the elastic ones, which then stay.

use nalgebra::{DMatrix, SymmetricEigen};
use std::f64::consts::PI;

use super::model::{Model, Motion};
use super::modes::{Mode, NO_STIFFNESS, SHIFT, SpecimenModes};
use super::numbering::HELD;
use crate::StructureError;

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
