//! The modes of a specimen, of specimens that differ little from it, and of one on a suspension.

use super::model::{Energies, Model, Place};
use super::numbering::Motion;
use super::{Mesh, Specimen};
use crate::StructureError;
use crate::eigen::{
    BEAM_ROW, BandedMatrix, Eigenpairs, RESONATOR_ROW, SLENDER_ROW, dot, lowest_pairs,
};
use crate::rayleigh::{lowest_from, moved};

use nalgebra::{DMatrix, SymmetricEigen};
use std::f64::consts::PI;

/// Added to a singular stiffness matrix, in units of mass: about the first elastic eigenvalue of a
/// free beam, lambda^4 = 500.
pub(crate) const SHIFT: f64 = 500.0;

/// Added where the joint is so weak that rounding would spoil what it leaves of the stiffness matrix: its motions have
/// eigenvalues below this one.
const SMALL_SHIFT: f64 = 1.0;

/// Below this eigenvalue (the first elastic one of a free beam is 500) nothing withstands a motion.
const NO_STIFFNESS: f64 = 1e-6;

/// Turns of the eigenvalue iteration for each row; two or three are usual.
const MOST_TURNS: usize = 60;

/// The lowest elastic modes of a specimen. Modes count from 0; positions run from the left end (m).
/// Shapes are mass-normalised: their modal mass is 1 kg.
#[derive(Debug, Clone)]
pub struct SpecimenModes {
    model: Model,
    mesh: Mesh,
    suspension: Vec<f64>,
    frequencies: Vec<f64>,
    /// Motions that are rigid but for springs to the ground and the axial force.
    loose: Vec<Mode>,
    modes: Vec<Mode>,
}

/// Motion of a mode at one place.
#[derive(Debug, Clone, Copy)]
pub struct PlaceMotion {
    /// Displacement (1/sqrt(kg)), the mean over the width.
    pub displacement: f64,
    /// Displacement (1/sqrt(kg)) on the middle line of the beam, where sensors sit and hammers strike: w - a b^2/24, with w
    /// the mean over the width b and a the curvature across it.
    pub middle: f64,
    /// Rotation of the cross-section (rad/m per sqrt(kg)): dw/dx without shear.
    pub slope: f64,
}

/// A mode in the model's units.
#[derive(Debug, Clone)]
struct Mode {
    /// omega^2.
    square: f64,
    /// Of unit modal mass.
    motion: Motion,
    /// The same by the equations.
    vector: Vec<f64>,
    energies: Energies,
}

impl Mode {
    fn new(model: &Model, mut vector: Vec<f64>) -> Self {
        let motion = model.numbering.motion(&vector);
        let energies = model.energies(&motion);
        let square = energies.quotient();
        let factor = energies.modal_mass(square).sqrt().recip();
        vector.iter_mut().for_each(|value| *value *= factor);
        Self {
            square,
            motion: motion.scaled(factor),
            vector,
            energies: energies.scaled(factor * factor),
        }
    }
}

/// Corrects the motions of a weak joint. One inverse iteration removes the rest of elastic motions, whose energy would
/// hide that of the joint. Ritz's method then separates the motions from each other. Where either step fails, nothing
/// is changed.
fn refine<const N: usize>(
    model: &Model,
    [stiffness, mass]: [&BandedMatrix<N>; 2],
    vectors: &mut [Vec<f64>],
) {
    if vectors.is_empty() {
        return;
    }
    let Some(factor) = stiffness.plus(SMALL_SHIFT, mass).cholesky() else {
        return;
    };
    let mut motions = Vec::with_capacity(vectors.len());
    for vector in vectors.iter() {
        let mut answer = mass.times(vector);
        factor.solve_lower(&mut answer);
        factor.solve_upper(&mut answer);
        motions.push(model.numbering.motion(&answer));
    }
    let count = motions.len();
    let (mut strain, mut kinetic) = (DMatrix::zeros(count, count), DMatrix::zeros(count, count));
    for (row, a) in motions.iter().enumerate() {
        for (column, b) in motions.iter().enumerate() {
            [strain[(row, column)], kinetic[(row, column)]] = model.products(a, b);
        }
    }
    let lower = kinetic.cholesky().map(|factor| factor.l());
    let Some(inverse) = lower.and_then(|lower| lower.try_inverse()) else {
        return;
    };
    let reduced = &inverse * strain * inverse.transpose();
    let Some(eigen) = SymmetricEigen::try_new(reduced, f64::EPSILON, 1000) else {
        return;
    };
    let shapes = inverse.transpose() * eigen.eigenvectors;
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    for (vector, column) in vectors.iter_mut().zip(order) {
        let mut sum = motions[0].clone().scaled(shapes[(0, column)]);
        for (row, motion) in motions.iter().enumerate().skip(1) {
            sum = sum.plus(shapes[(row, column)], motion);
        }
        *vector = model.numbering.vector(&sum);
    }
}

/// Returns the lowest pairs of a model, with matrices of so many entries in a row.
fn pairs_of<const N: usize>(model: &Model, count: usize) -> Result<Eigenpairs, StructureError> {
    let (stiffness, mass) = model.matrices::<N>();
    let shift = match model.rigid_motions() {
        0 if model.is_weakly_held() => SMALL_SHIFT,
        0 => 0.0,
        _ => SHIFT,
    };
    let (highest, locked) = (model.highest_square(), model.locked_motions());
    let mut pairs = lowest_pairs(&stiffness, &mass, shift, highest, &locked, count)?;
    if shift == SMALL_SHIFT {
        let soft = pairs.values.partition_point(|value| *value < shift);
        refine(model, [&stiffness, &mass], &mut pairs.vectors[..soft]);
    }
    Ok(pairs)
}

/// Which modes of a specimen next to another one are sought.
#[derive(Clone, Copy)]
enum From {
    /// The lowest ones, exactly.
    Lowest,
    /// Those that continue each mode, by one step.
    Each,
}

/// Returns the modes of another model from those of a specimen next to it, with matrices of so many entries in a row.
/// `None` where they are not found.
fn modes_from<const N: usize>(
    near: &SpecimenModes,
    model: &Model,
    what: From,
) -> Option<Vec<Mode>> {
    let (stiffness, mass) = model.matrices::<N>();
    let matrices = [&stiffness, &mass];
    let vectors: Vec<Vec<f64>> = near.modes.iter().map(|mode| mode.vector.clone()).collect();
    let found = match what {
        From::Lowest => lowest_from(matrices, vectors)?,
        From::Each => {
            let moved = moved(matrices, &vectors)?.into_iter();
            moved.map(|one| one.vector).collect()
        }
    };
    let found = found.into_iter();
    Some(found.map(|vector| Mode::new(model, vector)).collect())
}

impl SpecimenModes {
    /// Returns the lowest `count` modes. Those of a specimen next to it are where the search begins.
    pub(super) fn new(
        specimen: &Specimen,
        count: usize,
        mesh: Mesh,
        near: Option<&Self>,
    ) -> Result<Self, StructureError> {
        let model = Model::new(specimen, &mesh.divide(&specimen.body))?;
        let near = near.filter(|near| near.mesh == mesh && near.len() == count);
        if let Some(near) = near
            && model.rigid_motions() == 0
            && !model.is_weakly_held()
            && let Some(modes) = near.moved_to(model.clone(), From::Lowest)
        {
            return Ok(modes);
        }
        let rigid = model.rigid_motions();
        let pairs = match model.row() {
            SLENDER_ROW => pairs_of::<SLENDER_ROW>(&model, count + rigid)?,
            BEAM_ROW => pairs_of::<BEAM_ROW>(&model, count + rigid)?,
            _ => pairs_of::<RESONATOR_ROW>(&model, count + rigid)?,
        };
        let Eigenpairs { values, vectors } = pairs;
        // Rounding moves each value by some parts in 1e16 of the highest one.
        let rounding = NO_STIFFNESS + 1e-7 * SHIFT + 1e-15 * model.highest_square();
        let slow = &values[..rigid];
        if slow.iter().any(|value| *value < -rounding) {
            return Err(StructureError::FiniteElements {
                reason: "it is not stable: the axial force buckles it".to_owned(),
            });
        }
        let held = slow.iter().filter(|value| **value >= NO_STIFFNESS);
        let suspension = held.map(|square| model.frequency(*square)).collect();
        let vectors = vectors.into_iter();
        let mut loose: Vec<Mode> = vectors.map(|vector| Mode::new(&model, vector)).collect();
        let modes = loose.split_off(rigid);
        Ok(Self {
            suspension,
            loose,
            ..Self::elastic(model, mesh, modes)
        })
    }

    /// Returns these modes, without any motions that are nearly rigid.
    fn elastic(model: Model, mesh: Mesh, modes: Vec<Mode>) -> Self {
        let frequencies = modes.iter().map(|mode| model.frequency(mode.square));
        Self {
            frequencies: frequencies.collect(),
            suspension: Vec::new(),
            loose: Vec::new(),
            modes,
            mesh,
            model,
        }
    }

    /// Returns natural frequencies (Hz), ascending; of [`SpecimenModes::perturbed`] in the order of the modes they
    /// came from.
    pub fn frequencies(&self) -> &[f64] {
        &self.frequencies
    }

    /// Returns frequencies (Hz) of the motions that only springs to the ground or the axial force keep from
    /// being rigid: a free beam's suspension. Empty where there are none, and after
    /// [`SpecimenModes::on_suspension`], which counts them among the modes.
    pub fn suspension_frequencies(&self) -> &[f64] {
        &self.suspension
    }

    /// Returns the number of modes.
    pub fn len(&self) -> usize {
        self.frequencies.len()
    }

    /// Returns true where no mode was asked for.
    pub fn is_empty(&self) -> bool {
        self.frequencies.is_empty()
    }

    /// Returns the displacement (1/sqrt(kg)), the mean over the width, at a position (m).
    pub fn displacement(&self, mode: usize, position: f64) -> f64 {
        self.motion_at(mode, position).displacement
    }

    /// Returns the displacement (1/sqrt(kg)) on the middle line of the beam at a position (m): see [`PlaceMotion::middle`].
    pub fn middle_displacement(&self, mode: usize, position: f64) -> f64 {
        self.motion_at(mode, position).middle
    }

    /// Returns the rotation of the cross-section (rad/m per sqrt(kg)) at a position (m): dw/dx without shear.
    pub fn slope(&self, mode: usize, position: f64) -> f64 {
        self.motion_at(mode, position).slope
    }

    /// Returns the motion of a mode at a position (m).
    pub fn motion_at(&self, mode: usize, position: f64) -> PlaceMotion {
        self.motion_in(mode, &self.model.place(position))
    }

    /// Returns the motion of every mode at a position (m).
    pub fn motions_at(&self, position: f64) -> Vec<PlaceMotion> {
        let place = self.model.place(position);
        (0..self.len())
            .map(|mode| self.motion_in(mode, &place))
            .collect()
    }

    fn motion_in(&self, mode: usize, place: &Place) -> PlaceMotion {
        let Mode { square, motion, .. } = &self.modes[mode];
        let ends = motion.ends(place.node);
        let unit = self.model.units.mass.sqrt();
        let displacement = (place.displacement(&ends) + square * dot(&place.inner, &ends)) / unit;
        PlaceMotion {
            displacement,
            middle: displacement - self.model.curvature_across(motion, place) / unit,
            slope: place.rotation(&ends) / self.rotation_unit(),
        }
    }

    fn rotation_unit(&self) -> f64 {
        self.model.units.mass.sqrt() * self.model.units.length
    }

    /// Returns the deformation of the joint's springs: displacement (1/sqrt(kg)) and rotation (1/(m sqrt(kg))).
    /// Of a lap joint right minus left; with a base, against the base.
    pub fn joint_motion(&self, mode: usize) -> [f64; 2] {
        let [w, theta] = self.model.joint_motion(&self.modes[mode].motion);
        [
            w / self.model.units.mass.sqrt(),
            theta / self.rotation_unit(),
        ]
    }

    /// Returns the share of the joint's springs in the strain energy (1).
    pub fn joint_energy_share(&self, mode: usize) -> f64 {
        // Of unit modal mass, omega^2 is twice the whole strain energy.
        self.model.joint_energy(&self.modes[mode].motion) / self.modes[mode].square
    }

    /// Returns the share of the base in the kinetic energy (1): near 1 where the mode is the base's own.
    pub fn base_participation(&self, mode: usize) -> f64 {
        let turn = self.modes[mode].motion.base.unwrap_or(0.0);
        let inertia = self.model.base.map_or(0.0, |base| base.inertia);
        inertia * turn * turn / self.modes[mode].energies.kinetic
    }

    /// Returns the share of a resonator in the kinetic energy (1). Over all modes of a structure the shares add up to 1.
    fn resonator_participation(&self, mode: usize, resonator: usize) -> f64 {
        let Mode {
            motion, energies, ..
        } = &self.modes[mode];
        let mass = self.model.resonators[resonator].mass;
        mass * motion.resonators[resonator].powi(2) / energies.kinetic
    }

    /// Returns frequencies (Hz) that Rayleigh's quotient gives for another specimen with these modes' shapes.
    ///
    /// The quotient is stationary at a mode: of another specimen that differs by a small d it is the
    /// other's frequency up to d^2, and its derivative with any parameter is the frequency's.
    ///
    /// # Errors
    /// As [`Specimen::modes`], and where the other specimen has other beams, rigid springs or resonators.
    pub fn rayleigh_frequencies(&self, other: &Specimen) -> Result<Vec<f64>, StructureError> {
        let model = self.model_of(other)?;
        let same_runs = model.runs.len() == self.model.runs.len()
            && (model.runs.iter().zip(&self.model.runs)).all(|(a, b)| a.elements == b.elements);
        let same_springs =
            (0..2).all(|i| model.joint[i][i].is_infinite() == self.model.joint[i][i].is_infinite());
        let same_resonators = model.resonators.len() == self.model.resonators.len();
        if !same_runs || !same_springs || !same_resonators {
            return Err(StructureError::FiniteElements {
                reason:
                    "a shape serves specimens of the same beams, rigid springs and resonators only"
                        .to_owned(),
            });
        }
        let quotients = self.modes.iter().map(|mode| {
            let motion = &mode.motion;
            let energies = match (&model.base, motion.base) {
                // The base that the other has moves as the joint's moment turns it.
                (Some(base), None) => {
                    let [w, theta, _] = motion.nodes[0];
                    let moment = model.joint[1][0] * w + model.joint[1][1] * theta;
                    let dynamic = base.stiffness + model.joint[1][1] - mode.square * base.inertia;
                    model.energies(&Motion {
                        base: Some(moment / dynamic),
                        ..motion.clone()
                    })
                }
                _ => model.energies(motion),
            };
            model.frequency(energies.quotient())
        });
        Ok(quotients.collect())
    }

    fn model_of(&self, other: &Specimen) -> Result<Model, StructureError> {
        Model::new(other, &self.mesh.divide(&other.body))
    }

    /// Returns the modes of another specimen that differs little, in the order of these: one step of Rayleigh
    /// quotient iteration from each. A shape that is off by a small e is off by about e^3 afterwards
    /// (Parlett 1998, 4.7), so that differences over small steps are those of exact modes, for less
    /// than their price.
    ///
    /// `None` where the other has other motions (rigid springs, a base), where some are loose, or where a hinge moved
    /// to another element: there [`Specimen::modes`] has to solve anew. Modes after [`SpecimenModes::on_suspension`] lose the suspension.
    ///
    /// # Errors
    /// As [`Specimen::modes`].
    pub fn perturbed(&self, other: &Specimen) -> Result<Option<Self>, StructureError> {
        let model = self.model_of(other)?;
        match model.has_hinges_in_same_elements(&self.model) {
            true => Ok(self.moved_to(model, From::Each)),
            false => Ok(None),
        }
    }

    /// Returns the modes of a model next to that of these.
    fn moved_to(&self, model: Model, what: From) -> Option<Self> {
        if model.numbering != self.model.numbering || !self.loose.is_empty() {
            return None;
        }
        let modes = match model.row() {
            SLENDER_ROW => modes_from::<SLENDER_ROW>(self, &model, what),
            BEAM_ROW => modes_from::<BEAM_ROW>(self, &model, what),
            _ => modes_from::<RESONATOR_ROW>(self, &model, what),
        };
        Some(Self::elastic(model, self.mesh, modes?))
    }

    /// Returns these modes, preceded by the motions that are rigid but for springs to the ground, the
    /// axial force and the suspension, and the number of those. `suspension`: frequencies (Hz), up and
    /// down and rocking, that it would give the specimen with nothing else to hold it; `None` where
    /// there is none. What nothing withstands is left out.
    ///
    /// A suspension that gives a free specimen its two rigid motions R (of unit modal mass) the
    /// frequencies Omega, and leaves everything else as it is, has the stiffness
    /// `M R Omega^2 R^T M`. In the coordinates of the specimen's own modes, which cables may have bent
    /// and tilted, that is `B Omega^2 B^T` with `B = Phi^T M R`, so that all modes follow from one
    /// small matrix. Of a free specimen B is the identity for the rigid motions and 0 for the elastic
    /// ones, which then stay.
    ///
    /// # Errors
    /// [`StructureError`] where the modes do not settle.
    pub fn on_suspension(
        &self,
        suspension: Option<[f64; 2]>,
    ) -> Result<(Self, usize), StructureError> {
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
        let mut modes = Vec::with_capacity(basis.len() + others.len());
        for &index in &order[free..] {
            // The basis is orthonormal, so that a mode has unit modal mass where its shares do.
            let mut motion = basis[0].motion.clone().scaled(0.0);
            for (mode, share) in basis.iter().zip(pairs.eigenvectors.column(index).iter()) {
                motion = motion.plus(*share, &mode.motion);
            }
            modes.push(Mode {
                square: pairs.eigenvalues[index],
                energies: self.model.energies(&motion),
                vector: self.model.numbering.vector(&motion),
                motion,
            });
        }
        modes.extend(others.iter().cloned());
        let modes = Self::elastic(self.model.clone(), self.mesh, modes);
        Ok((modes, self.loose.len() - free))
    }

    /// Returns the stiffness of specimen and suspension in the coordinates of its motions.
    fn stiffness_among(&self, basis: &[&Mode], suspension: Option<[f64; 2]>) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(basis.len(), basis.len());
        for (index, mode) in basis.iter().enumerate() {
            matrix[(index, index)] = mode.square;
        }
        // Loose motions lie so close together that the method that found them mixes them.
        for i in 0..self.loose.len() {
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
            let shares = basis.iter();
            let shares: Vec<f64> = shares
                .map(|mode| self.model.products(&mode.motion, rigid)[1])
                .collect();
            for (i, a) in shares.iter().enumerate() {
                for (j, b) in shares.iter().enumerate() {
                    matrix[(i, j)] += square * a * b;
                }
            }
        }
        matrix
    }

    /// Returns the rotation of the joint's spring per moment on both its ends (rad/(N m)) by all modes beyond
    /// these: the sum of psi^2/omega^2, which falls too slowly to be added up. It is the static
    /// compliance less that of the modes here. A suspension does not change it, but the modes after
    /// [`Self::on_suspension`] no longer say which motions are loose: ask the modes before.
    pub fn joint_compliance_beyond(&self) -> f64 {
        // Loose motions make K singular, and s M is added: sum psi^2/(omega^2 + s).
        let shift = if self.loose.is_empty() { 0.0 } else { SHIFT };
        let (stiffness, mass) = self.model.matrices::<RESONATOR_ROW>();
        let Some(factor) = stiffness.plus(shift, &mass).cholesky() else {
            return 0.0;
        };
        let moment = self.model.joint_load(1);
        let mut answer = moment.clone();
        factor.solve_lower(&mut answer);
        factor.solve_upper(&mut answer);
        let mut sum = dot(&moment, &answer);
        let mut squares = dot(&answer, &mass.times(&answer));
        for mode in self.loose.iter().chain(&self.modes) {
            let psi = self.model.joint_motion(&mode.motion)[1];
            sum -= psi * psi / (mode.square + shift);
            squares -= (psi / (mode.square + shift)).powi(2);
        }
        // 1/omega^2 = 1/(omega^2 + s) + s/(omega^2 + s)^2 up to (s/omega^2)^2, 1e-8 beyond ten modes.
        let compliance = (sum + shift * squares) / self.model.units.rotational_stiffness();
        compliance.max(0.0)
    }
}

/// All modes up to some of the beam's own, on a fixture that may give and with resonators. The fixture's own mode has no
/// number, nor have those of resonators.
#[derive(Debug, Clone)]
pub struct BeamModes {
    /// All modes.
    pub modes: SpecimenModes,
    /// Indices of the beam's first, second and further modes among all (from 0).
    pub numbers: Vec<usize>,
    /// Index of the fixture's own mode; `None` on a fixture that does not give.
    pub fixture: Option<usize>,
    /// Indices of the resonators' own modes, as far as they lie among these.
    pub resonators: Vec<usize>,
}

impl BeamModes {
    /// Returns the lowest `count` modes of a specimen's beam. On a fixture that gives, the mode in which it
    /// moves most is its own. Modes of a specimen next to it are where the search begins.
    pub(super) fn new(
        specimen: &Specimen,
        count: usize,
        mesh: Mesh,
        near: Option<&Self>,
    ) -> Result<Self, StructureError> {
        let gives = specimen.base.is_some_and(|base| base.ratio > 0.0);
        let others = usize::from(gives) + specimen.resonators.len();
        let near = near.map(|near| &near.modes);
        let modes = SpecimenModes::new(specimen, count + others, mesh, near)?;
        let all = 0..modes.len();
        let shares = all.clone().map(|mode| modes.base_participation(mode));
        let most = all.clone().zip(shares).max_by(|a, b| a.1.total_cmp(&b.1));
        let fixture = most.filter(|_| gives).map(|(mode, _)| mode);
        let mut resonators = Vec::new();
        for resonator in 0..specimen.resonators.len() {
            let free = all.clone().filter(|mode| Some(*mode) != fixture);
            let free = free.filter(|mode| !resonators.contains(mode));
            let shares = free.map(|mode| (mode, modes.resonator_participation(mode, resonator)));
            let shares: Vec<(usize, f64)> = shares.collect();
            // With less than half of its energy here, its own mode lies above.
            let sum: f64 = shares.iter().map(|one| one.1).sum();
            let most = shares.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
            resonators.extend(most.filter(|_| sum > 0.5).map(|(mode, _)| mode));
        }
        let own = all.filter(|mode| Some(*mode) != fixture && !resonators.contains(mode));
        Ok(Self {
            numbers: own.take(count).collect(),
            modes,
            fixture,
            resonators,
        })
    }

    /// Returns the modes of another specimen that differs little, by [`SpecimenModes::perturbed`]. Every mode keeps
    /// its number.
    ///
    /// # Errors
    /// As [`Specimen::modes`].
    pub fn perturbed(&self, other: &Specimen) -> Result<Option<Self>, StructureError> {
        let modes = self.modes.perturbed(other)?;
        Ok(modes.map(|modes| Self {
            modes,
            numbers: self.numbers.clone(),
            fixture: self.fixture,
            resonators: self.resonators.clone(),
        }))
    }
}
