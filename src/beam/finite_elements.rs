//! Finite-element models of the same structures: independent of the closed form, and able to
//! carry what it cannot, point masses and support springs.
//!
//! Lengths are in units of the structure's, stiffness and mass in those of its first beam, so that
//! all numbers stay near 1.

use crate::banded::{BandedSymmetric, lowest_eigenvectors};
use crate::specimen::element::Element;
use crate::{Assembly, Beam, BeamTheory, JointStiffness, StructureError};
use nalgebra::DMatrix;
use std::f64::consts::PI;

/// A model ready to be solved.
#[derive(Debug, Clone)]
pub struct FiniteElementModel {
    pub(crate) stiffness: BandedSymmetric,
    pub(crate) mass: BandedSymmetric,
    pub(crate) pieces: Vec<Piece>,
    springs: Vec<JointElement>,
    /// For each node its equations of displacement and rotation, `None` where held.
    pub(crate) equations: Vec<[Option<usize>; 2]>,
    /// Motions at zero frequency.
    pub(crate) rigid_modes: usize,
    /// Length unit (m), mass unit (kg), omega unit (rad/s).
    pub(crate) units: Units,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Units {
    pub(crate) length: f64,
    pub(crate) mass: f64,
    pub(crate) omega: f64,
}

/// A joint between equations, each with its row in the joint's matrix and the sign of its motion.
#[derive(Debug, Clone)]
struct JointElement {
    matrix: [[f64; 2]; 2],
    ends: Vec<(Option<usize>, usize, f64)>,
}

/// A run of equal elements.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece {
    /// Where it starts, and its number of elements.
    start: f64,
    elements: usize,
    pub(crate) first_node: usize,
    pub(crate) element: Element,
}

impl FiniteElementModel {
    /// The given assembly of one uniform beam, divided into `elements` (rounded up to an even
    /// number for a lap joint).
    ///
    /// # Errors
    /// [`StructureError`] where beam or joint cannot exist, or `elements` is 0.
    pub fn new(
        theory: BeamTheory,
        beam: &Beam,
        assembly: Assembly,
        joint: &JointStiffness,
        elements: usize,
    ) -> Result<Self, StructureError> {
        match assembly {
            Assembly::Free => Self::cantilever(theory, beam, &JointStiffness::FREE, elements),
            Assembly::Cantilever => Self::cantilever(theory, beam, joint, elements),
            Assembly::Lap => {
                let half = Beam {
                    length: 0.5 * beam.length,
                    ..*beam
                };
                Self::lap(theory, [&half, &half], joint, elements.div_ceil(2))
            }
        }
    }

    fn cantilever(
        theory: BeamTheory,
        beam: &Beam,
        joint: &JointStiffness,
        elements: usize,
    ) -> Result<Self, StructureError> {
        beam.check()?;
        joint.check()?;
        let units = Units::of(beam, beam.length);
        let piece = Piece::new(theory, beam, &units, elements, (0.0, 0));
        let mut equations = Vec::new();
        let mut next = 0;
        let held = [joint.kx.is_infinite(), joint.ky.is_infinite()];
        number_nodes(&mut equations, &mut next, elements, |dof| {
            if held[dof] { Hold::Held } else { Hold::Own }
        });
        let mut model = Self::assemble(vec![piece], equations, next, units, elements)?;
        let root = model.equations[0];
        model.add_joint(
            &joint_matrix(joint),
            &[(root[0], 0, 1.0), (root[1], 1, 1.0)],
        );
        model.rigid_modes = [joint.kx, joint.ky].iter().filter(|&&k| k == 0.0).count();
        Ok(model)
    }

    /// Two beams joined end to end, each `elements` long; `joint` is non-dimensional by the total
    /// length and the left beam's bending stiffness. The halves may differ in anything.
    ///
    /// # Errors
    /// [`StructureError`] where a beam or the joint cannot exist, the joint has a cross coupling,
    /// or `elements` is 0.
    pub fn lap(
        theory: BeamTheory,
        halves: [&Beam; 2],
        joint: &JointStiffness,
        elements: usize,
    ) -> Result<Self, StructureError> {
        let [left, right] = halves;
        left.check()?;
        right.check()?;
        joint.check()?;
        if joint.cross_compliance != 0.0 {
            return Err(StructureError::NoCoupling {
                assembly: "lap joint",
                cross_compliance: joint.cross_compliance,
            });
        }
        let units = Units::of(left, left.length + right.length);
        let pieces = vec![
            Piece::new(theory, left, &units, elements, (0.0, 0)),
            Piece::new(
                theory,
                right,
                &units,
                elements,
                (left.length / units.length, elements + 1),
            ),
        ];
        let mut equations = Vec::new();
        let mut next = 0;
        number_nodes(&mut equations, &mut next, elements, |_| Hold::Own);
        let end = equations.last().copied().unwrap_or([None; 2]);
        let rigid = [joint.kx.is_infinite(), joint.ky.is_infinite()];
        number_nodes(&mut equations, &mut next, elements, |dof| {
            if rigid[dof] {
                Hold::With(end[dof])
            } else {
                Hold::Own
            }
        });
        let mut model = Self::assemble(pieces, equations, next, units, elements)?;
        let start = model.equations[elements + 1];
        for (dof, stiffness) in [joint.kx, joint.ky].into_iter().enumerate() {
            if stiffness.is_finite() {
                let spring = [[stiffness, 0.0], [0.0, 0.0]];
                model.add_joint(&spring, &[(end[dof], 0, -1.0), (start[dof], 0, 1.0)]);
            }
        }
        let loose = [joint.kx, joint.ky].iter().filter(|&&k| k == 0.0).count();
        model.rigid_modes = 2 + loose;
        Ok(model)
    }

    fn assemble(
        pieces: Vec<Piece>,
        equations: Vec<[Option<usize>; 2]>,
        size: usize,
        units: Units,
        elements: usize,
    ) -> Result<Self, StructureError> {
        if elements == 0 {
            return Err(StructureError::FiniteElements {
                reason: "it needs at least one element".to_owned(),
            });
        }
        // Neighbouring nodes are three equations apart; merged ones at a joint one more.
        const HALF_BAND: usize = 4;
        let mut model = Self {
            stiffness: BandedSymmetric::zeros(size, HALF_BAND),
            mass: BandedSymmetric::zeros(size, HALF_BAND),
            pieces,
            springs: Vec::new(),
            equations,
            rigid_modes: 0,
            units,
        };
        for piece in model.pieces.clone() {
            let (stiffness, mass) = (piece.element.stiffness(), piece.element.mass());
            for index in 0..piece.elements {
                let nodes = model.element_equations(&piece, index);
                scatter(&mut model.stiffness, &nodes, &stiffness);
                scatter(&mut model.mass, &nodes, &mass);
            }
        }
        Ok(model)
    }

    fn element_equations(&self, piece: &Piece, index: usize) -> [Option<usize>; 4] {
        let near = self.equations[piece.first_node + index];
        let far = self.equations[piece.first_node + index + 1];
        [near[0], near[1], far[0], far[1]]
    }

    fn add_joint(&mut self, matrix: &[[f64; 2]; 2], ends: &[(Option<usize>, usize, f64)]) {
        for &(row, i, row_sign) in ends {
            for &(column, j, column_sign) in ends {
                if let (Some(row), Some(column)) = (row, column) {
                    let value = row_sign * column_sign * matrix[i][j];
                    self.stiffness.add(row, column, value);
                }
            }
        }
        self.springs.push(JointElement {
            matrix: *matrix,
            ends: ends.to_vec(),
        });
    }

    /// The lowest `count` natural frequencies (Hz), ascending, without rigid-body motions.
    ///
    /// # Errors
    /// [`StructureError::FiniteElements`] where the model has fewer degrees of freedom.
    pub fn natural_frequencies(&self, count: usize) -> Result<Vec<f64>, StructureError> {
        // A free structure is shifted by about its first elastic eigenvalue, lambda^4 = 500.
        let shift = if self.rigid_modes > 0 { 500.0 } else { 0.0 };
        let stiffness = self.stiffness.plus(shift, &self.mass);
        let vectors = lowest_eigenvectors(&stiffness, &self.mass, count + self.rigid_modes)?;
        let inertia = self.mass.times(&vectors);
        let frequency = |mode: usize| {
            let energy = self.strain_energy(&vectors, mode);
            let quotient = energy / vectors.column(mode).dot(&inertia.column(mode));
            quotient.sqrt() * self.units.omega / (2.0 * PI)
        };
        Ok((self.rigid_modes..self.rigid_modes + count)
            .map(frequency)
            .collect())
    }

    /// Twice the strain energy of one vector, summed over elements and springs from what each is
    /// strained by. The product x K x would be the small difference of numbers that grow with
    /// the fourth power of the division, and lose as many digits.
    fn strain_energy(&self, vectors: &DMatrix<f64>, mode: usize) -> f64 {
        let motion = |equation: Option<usize>| equation.map_or(0.0, |row| vectors[(row, mode)]);
        let elements = self.pieces.iter().flat_map(|piece| {
            (0..piece.elements).map(move |index| {
                let ends = self.element_equations(piece, index).map(motion);
                piece.element.strain_energy(&ends)
            })
        });
        let springs = self.springs.iter().map(|spring| {
            let mut strain = [0.0; 2];
            for &(equation, row, sign) in &spring.ends {
                strain[row] += sign * motion(equation);
            }
            let [w, theta] = strain;
            let [[kww, kwt], [_, ktt]] = spring.matrix;
            // A rigid spring is strained by nothing.
            let term = |stiffness: f64, square: f64| {
                if stiffness.is_finite() {
                    stiffness * square
                } else {
                    0.0
                }
            };
            term(kww, w * w) + 2.0 * term(kwt, w * theta) + term(ktt, theta * theta)
        });
        elements.sum::<f64>() + springs.sum::<f64>()
    }
}

impl Units {
    /// Unit of stiffness, that of mass times that of omega squared: E I/L^3 (N/m).
    pub(crate) fn stiffness(&self) -> f64 {
        self.mass * self.omega * self.omega
    }

    pub(crate) fn of(beam: &Beam, length: f64) -> Self {
        let (stiffness, density) = (beam.bending_stiffness(), beam.mass_per_length());
        Self {
            length,
            mass: density * length,
            omega: (stiffness / density).sqrt() / (length * length),
        }
    }
}

impl Piece {
    /// `elements` elements of a beam, from (place, node) on.
    pub(crate) fn new(
        theory: BeamTheory,
        beam: &Beam,
        units: &Units,
        elements: usize,
        (start, first_node): (f64, usize),
    ) -> Self {
        // The unit of bending stiffness is that in which the unit of omega is 1.
        let mass_unit = units.mass / units.length;
        let stiffness_unit = units.omega.powi(2) * mass_unit * units.length.powi(4);
        let length = beam.length / units.length / elements.max(1) as f64;
        let bending_stiffness = beam.bending_stiffness() / stiffness_unit;
        let mass_per_length = beam.mass_per_length() / mass_unit;
        let slenderness = beam.slenderness(theory);
        let scale = (beam.length / units.length).powi(2);
        let element = Element {
            length,
            bending_stiffness,
            mass_per_length,
            rotary_inertia: mass_per_length * slenderness.rotary * scale,
            shear: 12.0 * slenderness.shear * scale / (length * length),
        };
        Self {
            start,
            elements,
            first_node,
            element,
        }
    }
}

/// How an end's motion is numbered.
enum Hold {
    /// By an equation of its own.
    Own,
    /// Not at all: it does not move.
    Held,
    /// By another node's equation.
    With(Option<usize>),
}

/// Numbers the equations of `elements + 1` nodes; `first` says how the first node is held.
fn number_nodes(
    equations: &mut Vec<[Option<usize>; 2]>,
    next: &mut usize,
    elements: usize,
    first: impl Fn(usize) -> Hold,
) {
    for node in 0..=elements {
        let number = |dof: usize| match first(dof) {
            Hold::Held if node == 0 => None,
            Hold::With(other) if node == 0 => other,
            _ => {
                *next += 1;
                Some(*next - 1)
            }
        };
        equations.push([0, 1].map(number));
    }
}

fn scatter(target: &mut BandedSymmetric, nodes: &[Option<usize>; 4], matrix: &[[f64; 4]; 4]) {
    for (row, values) in nodes.iter().zip(matrix) {
        for (column, value) in nodes.iter().zip(values) {
            if let (Some(row), Some(column)) = (row, column) {
                target.add(*row, *column, *value);
            }
        }
    }
}

/// Stiffness of a joint for (w, theta): the inverse of its compliance
/// `[[1/Kx, -1/Kz], [-1/Kz, 1/Ky]]`, written so that a missing or rigid spring does no harm.
fn joint_matrix(joint: &JointStiffness) -> [[f64; 2]; 2] {
    let (kx, ky, c) = (joint.kx, joint.ky, joint.cross_compliance);
    if c == 0.0 || kx == 0.0 || ky == 0.0 {
        return [[kx, 0.0], [0.0, ky]];
    }
    let rest = 1.0 - c * c * kx * ky;
    let cross = kx * c * ky / rest;
    [[kx / rest, cross], [cross, ky / rest]]
}

// What is fastened to the beam: masses and support springs anywhere on an element.

/// The equations and displacements that one place on the beam consists of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) equations: [Option<usize>; 4],
    pub(crate) shape: [f64; 4],
}

impl FiniteElementModel {
    /// Adds a mass (kg) at a position (m) from the joint or the left end, anywhere on an element.
    /// Of a lap joint, the joint's own place belongs to the right half.
    ///
    /// # Errors
    /// [`StructureError::OffBeam`] for a position outside, [`StructureError::NotPositive`] for a
    /// negative mass.
    pub fn with_point_mass(mut self, position: f64, mass: f64) -> Result<Self, StructureError> {
        let place = self.place(position)?;
        check_not_negative("point mass", mass)?;
        let mass = mass / self.units.mass;
        let shape = place.shape;
        let matrix = std::array::from_fn(|i| std::array::from_fn(|j| mass * shape[i] * shape[j]));
        scatter(&mut self.mass, &place.equations, &matrix);
        Ok(self)
    }

    /// Adds a spring (N/m) between the ground and a position (m), measured as that of a mass.
    /// Motions that were rigid without the spring stay uncounted: a free beam on a soft suspension
    /// begins with its first bending mode.
    ///
    /// # Errors
    /// [`StructureError::OffBeam`] for a position outside, [`StructureError::NotPositive`] for a
    /// negative stiffness.
    pub fn with_support_spring(
        mut self,
        position: f64,
        stiffness: f64,
    ) -> Result<Self, StructureError> {
        let place = self.place(position)?;
        check_not_negative("support spring", stiffness)?;
        // The unit of stiffness is that of mass times that of omega squared.
        let unit = self.units.mass * self.units.omega.powi(2);
        let spring = [[stiffness / unit, 0.0], [0.0, 0.0]];
        let ends: Vec<_> = place
            .equations
            .into_iter()
            .zip(place.shape)
            .map(|(equation, weight)| (equation, 0, weight))
            .collect();
        self.add_joint(&spring, &ends);
        Ok(self)
    }

    /// Where on which element a position (m) lies.
    pub(crate) fn place(&self, position: f64) -> Result<Place, StructureError> {
        let off = StructureError::OffBeam {
            position,
            length: self.units.length,
        };
        let along = position / self.units.length;
        // A sensor at the very end may have been rounded beyond it.
        if !(0.0..=1.0 + 1e-9).contains(&along) {
            return Err(off);
        }
        let piece = self.pieces.iter().rev().find(|piece| piece.start <= along);
        let piece = piece.copied().ok_or(off)?;
        let within = (along - piece.start) / piece.element.length;
        let index = (within.max(0.0) as usize).min(piece.elements - 1);
        Ok(Place {
            equations: self.element_equations(&piece, index),
            shape: piece.element.displacement(within - index as f64),
        })
    }
}

fn check_not_negative(quantity: &'static str, value: f64) -> Result<(), StructureError> {
    if value >= 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(StructureError::NotPositive { quantity, value })
    }
}
