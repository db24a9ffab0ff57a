//! A specimen divided into elements: its matrices, and the energies of any motion.
//!
//! Lengths are in units of the specimen's, stiffness and mass in those of its first beam, so that
//! all numbers stay near 1. Rotations are dw/dx with x in units of the length.

use super::element::{Element, HingedElement, Section, Square, Weights, quadratic};
use super::{Body, Mesh, Specimen, SpecimenJoint};
use crate::banded::Band;
use crate::finite_elements::{Piece, Units};
use crate::{BeamTheory, StructureError};

/// Displacement and rotation of every node, and the rotation of the base.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Motion {
    pub(super) nodes: Vec<[f64; 2]>,
    /// `None` where the base does not move on its own.
    pub(super) base: Option<f64>,
}

/// Twice the strain energy, twice the kinetic energy over omega squared, and what omega^4 adds.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Energies {
    pub(super) strain: f64,
    pub(super) kinetic: f64,
    pub(super) second_order: f64,
}

impl Energies {
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self {
            strain: factor * self.strain,
            kinetic: factor * self.kinetic,
            second_order: factor * self.second_order,
        }
    }

    /// Modal mass at this omega^2: kinetic + 2 omega^2 second_order.
    pub(super) fn modal_mass(&self, square: f64) -> f64 {
        self.kinetic + 2.0 * square * self.second_order
    }

    /// Rayleigh's quotient omega^2: strain = omega^2 kinetic + omega^4 second_order.
    pub(super) fn quotient(&self) -> f64 {
        let root = self.kinetic.powi(2) + 4.0 * self.strain * self.second_order;
        2.0 * self.strain / (self.kinetic + root.sqrt())
    }
}

/// Of a beam: equal elements from node `first_node` on.
#[derive(Debug, Clone)]
pub(super) struct Run {
    pub(super) start: f64,
    pub(super) elements: usize,
    pub(super) first_node: usize,
    pub(super) section: Section,
}

/// The base: inertia and stiffness of its rotation.
#[derive(Debug, Clone, Copy)]
pub(super) struct RotatingBase {
    pub(super) inertia: f64,
    pub(super) stiffness: f64,
}

#[derive(Debug, Clone)]
pub(super) struct Model {
    pub(super) runs: Vec<Run>,
    pub(super) numbering: Numbering,
    pub(super) units: Units,
    /// Stiffness of the joint for (w, theta), infinite where rigid.
    pub(super) joint: [[f64; 2]; 2],
    pub(super) base: Option<RotatingBase>,
    pub(super) masses: Vec<Mass>,
    pub(super) springs: Vec<Spring>,
    hinged: Vec<HingedElement>,
}

impl Model {
    pub(super) fn new(specimen: &Specimen, mesh: Mesh) -> Result<Self, StructureError> {
        specimen.check()?;
        let beams = specimen.body.beams();
        let length = specimen.body.length();
        let units = Units::of(&beams[0], length);
        let mut runs: Vec<Run> = Vec::new();
        for beam in beams {
            let share = mesh.elements as f64 * beam.length / length;
            let elements = (share.round() as usize).max(1);
            let (start, node) = runs
                .last()
                .map_or((0.0, 0), |run| (beams[0].length / length, run.elements + 1));
            let theory = BeamTheory::Timoshenko;
            let piece = Piece::new(theory, beam, &units, elements, (start, node));
            let element = Element {
                rotary_inertia: specimen.shear_rotary * piece.element.rotary_inertia,
                shear: specimen.shear_rotary * piece.element.shear,
                ..piece.element
            };
            // The unit of force: that of bending stiffness over length squared.
            let force = units.stiffness() * length;
            let section = Section::new(element, specimen.axial_force / force);
            runs.push(Run {
                start,
                elements,
                first_node: node,
                section,
            });
        }
        let base = rotating_base(specimen, &units);
        let elements: Vec<usize> = runs.iter().map(|run| run.elements).collect();
        let mut model = Self {
            numbering: Numbering::new(specimen, &elements, base.map(|_| ())),
            runs,
            joint: joint_matrix(&specimen.joint, &units),
            base,
            masses: Vec::new(),
            springs: Vec::new(),
            hinged: Vec::new(),
            units,
        };
        model.attach(specimen)?;
        Ok(model)
    }

    /// Motions at zero frequency but for springs to the ground and the axial force.
    pub(super) fn rigid_motions(&self) -> usize {
        let loose = (0..2).filter(|&i| self.joint[i][i] == 0.0).count();
        2 * (self.runs.len() - 1) + loose
    }

    /// Stiffness and mass matrix.
    pub(super) fn matrices(&self) -> (Band, Band) {
        let size = self.numbering.size;
        let (mut stiffness, mut mass) = (Band::zeros(size), Band::zeros(size));
        for (run_index, run) in self.runs.iter().enumerate() {
            for index in 0..run.elements {
                let nodes = self.equations(run.first_node + index);
                let hinged = self.hinged_at(run_index, index);
                let own = hinged.map_or((&run.section.stiffness, &run.section.mass), |h| {
                    (&h.stiffness, &h.mass)
                });
                scatter(&mut stiffness, &nodes, own.0);
                scatter(&mut mass, &nodes, own.1);
            }
        }
        for item in &self.masses {
            scatter(
                &mut mass,
                &self.place_equations(&item.place),
                &item.matrix(),
            );
        }
        for item in &self.springs {
            scatter(
                &mut stiffness,
                &self.place_equations(&item.place),
                &item.matrix(),
            );
        }
        self.scatter_joint(&mut stiffness);
        if let (Some(base), Some(row)) = (&self.base, self.numbering.base) {
            stiffness.add(row, row, base.stiffness);
            mass.add(row, row, base.inertia);
        }
        (stiffness, mass)
    }

    fn equations(&self, node: usize) -> [usize; 4] {
        let (near, far) = (self.numbering.nodes[node], self.numbering.nodes[node + 1]);
        [near[0], near[1], far[0], far[1]]
    }

    fn place_equations(&self, place: &Place) -> [usize; 4] {
        self.equations(place.node)
    }

    fn hinged_at(&self, run: usize, index: usize) -> Option<&HingedElement> {
        self.hinged
            .iter()
            .find(|h| h.run == run && h.index == index)
    }

    fn scatter_joint(&self, stiffness: &mut Band) {
        let ends = self.joint_ends();
        for &(row, i, row_sign) in &ends {
            for &(column, j, column_sign) in &ends {
                let entry = self.joint[i][j];
                if row != HELD && column != HELD && entry.is_finite() {
                    stiffness.add(row, column, row_sign * column_sign * entry);
                }
            }
        }
    }

    /// Equations whose motion deforms the joint, its component, and the sign.
    pub(super) fn joint_ends(&self) -> Vec<(usize, usize, f64)> {
        let nodes = &self.numbering.nodes;
        if let [left, right] = self.runs.as_slice() {
            let (before, after) = (nodes[left.elements], nodes[right.first_node]);
            return vec![
                (before[0], 0, -1.0),
                (before[1], 1, -1.0),
                (after[0], 0, 1.0),
                (after[1], 1, 1.0),
            ];
        }
        let mut ends = vec![(nodes[0][0], 0, 1.0), (nodes[0][1], 1, 1.0)];
        if let Some(base) = self.numbering.base {
            ends.push((base, 1, -1.0));
        }
        ends
    }

    /// Deformation of the joint's springs: displacement and rotation.
    pub(super) fn joint_motion(&self, motion: &Motion) -> [f64; 2] {
        if let [left, right] = self.runs.as_slice() {
            let (before, after) = (motion.nodes[left.elements], motion.nodes[right.first_node]);
            return [after[0] - before[0], after[1] - before[1]];
        }
        let [w, theta] = motion.nodes[0];
        [w, theta - motion.base.unwrap_or(0.0)]
    }

    /// Twice the strain energy of the joint's springs. A rigid one is strained by nothing.
    pub(super) fn joint_energy(&self, motion: &Motion) -> f64 {
        let u = self.joint_motion(motion);
        let mut sum = 0.0;
        for (row, a) in self.joint.iter().zip(u) {
            for (entry, b) in row.iter().zip(u) {
                sum += if entry.is_finite() {
                    entry * a * b
                } else {
                    0.0
                };
            }
        }
        sum
    }

    pub(super) fn energies(&self, motion: &Motion) -> Energies {
        let mut sum = Energies::default();
        for (run_index, run) in self.runs.iter().enumerate() {
            for index in 0..run.elements {
                let ends = motion.ends(run.first_node + index);
                sum.second_order += quadratic(&run.section.second_order, &ends);
                if let Some(hinged) = self.hinged_at(run_index, index) {
                    sum.strain += hinged.strain_energy(&run.section, &ends);
                    sum.kinetic += quadratic(&hinged.mass, &ends);
                } else {
                    sum.strain += run.section.strain_energy(&ends);
                    sum.kinetic += quadratic(&run.section.mass, &ends);
                }
            }
        }
        for item in &self.masses {
            let ends = motion.ends(item.place.node);
            sum.kinetic += item.energy(&ends);
            sum.second_order += item.second_order(&ends);
        }
        for item in &self.springs {
            sum.strain += item.energy(&motion.ends(item.place.node));
        }
        sum.strain += self.joint_energy(motion);
        if let (Some(base), Some(turn)) = (&self.base, motion.base) {
            sum.strain += base.stiffness * turn * turn;
            sum.kinetic += base.inertia * turn * turn;
        }
        sum
    }

    /// A vector of the equations as motions of the nodes.
    pub(super) fn motion(&self, vector: &[f64]) -> Motion {
        let at = |row: usize| if row == HELD { 0.0 } else { vector[row] };
        Motion {
            nodes: self
                .numbering
                .nodes
                .iter()
                .map(|node| node.map(at))
                .collect(),
            base: self.numbering.base.map(at),
        }
    }
}

impl Model {
    /// The equations' vector of a motion.
    pub(super) fn vector(&self, motion: &Motion) -> Vec<f64> {
        let mut vector = vec![0.0; self.numbering.size];
        let nodes = self.numbering.nodes.iter().zip(&motion.nodes);
        let moved = nodes.flat_map(|(rows, values)| rows.iter().copied().zip(*values));
        let base = self.numbering.base.zip(motion.base);
        for (row, value) in moved.chain(base) {
            if let Some(entry) = vector.get_mut(row) {
                *entry = value;
            }
        }
        vector
    }
}

impl Motion {
    /// self + factor other.
    pub(super) fn plus(&self, factor: f64, other: &Self) -> Self {
        let nodes = self.nodes.iter().zip(&other.nodes);
        Self {
            nodes: nodes
                .map(|(a, b)| [a[0] + factor * b[0], a[1] + factor * b[1]])
                .collect(),
            base: self
                .base
                .map(|turn| turn + factor * other.base.unwrap_or(0.0)),
        }
    }

    pub(super) fn scaled(mut self, factor: f64) -> Self {
        self.nodes
            .as_flattened_mut()
            .iter_mut()
            .for_each(|value| *value *= factor);
        self.base = self.base.map(|turn| factor * turn);
        self
    }

    pub(super) fn ends(&self, node: usize) -> [f64; 4] {
        let ([w0, t0], [w1, t1]) = (self.nodes[node], self.nodes[node + 1]);
        [w0, t0, w1, t1]
    }
}

fn scatter(target: &mut Band, equations: &[usize; 4], matrix: &Square) {
    for (&row, values) in equations.iter().zip(matrix) {
        for (&column, value) in equations.iter().zip(values) {
            if row != HELD && column != HELD {
                target.add(row, column, *value);
            }
        }
    }
}

/// Stiffness of the joint for (w, theta): the inverse of `[[1/Kt, -1/Ktr], [-1/Ktr, 1/Kr]]`, in the
/// model's units. A spring that is missing or rigid has no coupling.
fn joint_matrix(joint: &SpecimenJoint, units: &Units) -> [[f64; 2]; 2] {
    let SpecimenJoint::Springs { kt, kr, coupling } = *joint else {
        return [[0.0; 2]; 2];
    };
    let kx = kt / units.stiffness();
    let ky = kr / (units.stiffness() * units.length.powi(2));
    let coupled = |k: f64| k > 0.0 && k.is_finite();
    if coupling == 0.0 || !coupled(kx) || !coupled(ky) {
        return [[kx, 0.0], [0.0, ky]];
    }
    // With r = sqrt(Kx Ky)/Kz: [[Kx, r sqrt(Kx Ky)], [r sqrt(Kx Ky), Ky]]/(1 - r^2).
    let rest = 1.0 - coupling * coupling;
    let cross = coupling * (kx * ky).sqrt() / rest;
    [[kx / rest, cross], [cross, ky / rest]]
}

/// The base where it gives: k = Kr/ratio, and the inertia that has its frequency on that spring.
fn rotating_base(specimen: &Specimen, units: &Units) -> Option<RotatingBase> {
    let base = specimen.base.filter(|base| base.ratio > 0.0)?;
    if matches!(specimen.body, Body::Joined(_)) {
        return None;
    }
    let [_, kr] = specimen.joint.stiffnesses();
    let stiffness = kr / (units.stiffness() * units.length.powi(2)) / base.ratio;
    let omega = 2.0 * std::f64::consts::PI * base.frequency / units.omega;
    Some(RotatingBase {
        stiffness,
        inertia: stiffness / (omega * omega),
    })
}

// What is fastened to the beam, anywhere on an element.

/// A place on the beam: an element's near node, and the element's motion there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) node: usize,
    /// From 0 to 1.
    pub(super) within: f64,
    pub(super) weights: Weights,
    /// Displacement over omega^2 that the element's inertia adds; none in an element with a hinge.
    pub(super) inner: [f64; 4],
}

/// A mass with its inertia.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mass {
    pub(super) place: Place,
    mass: f64,
    inertia: f64,
    /// Compliance of the element, held at both ends, at this place.
    compliance: f64,
}

/// A spring to the ground.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spring {
    pub(super) place: Place,
    stiffness: f64,
}

impl Place {
    pub(super) fn displacement(&self, ends: &[f64; 4]) -> f64 {
        dot(&self.weights.displacement, ends)
    }

    pub(super) fn rotation(&self, ends: &[f64; 4]) -> f64 {
        dot(&self.weights.rotation, ends)
    }
}

impl Mass {
    pub(super) fn matrix(&self) -> Square {
        let Weights {
            displacement: w,
            rotation: t,
        } = self.place.weights;
        std::array::from_fn(|i| {
            std::array::from_fn(|j| self.mass * w[i] * w[j] + self.inertia * t[i] * t[j])
        })
    }

    pub(super) fn energy(&self, ends: &[f64; 4]) -> f64 {
        let (w, t) = (self.place.displacement(ends), self.place.rotation(ends));
        self.mass * w * w + self.inertia * t * t
    }

    /// What its load inside the element adds to the term with omega^4: its own motion
    /// m^2 w^2 times the compliance, and the work on what the element's inertia moves.
    pub(super) fn second_order(&self, ends: &[f64; 4]) -> f64 {
        let load = self.mass * self.place.displacement(ends);
        load * (load * self.compliance + 2.0 * dot(&self.place.inner, ends))
    }
}

impl Spring {
    pub(super) fn matrix(&self) -> Square {
        let w = self.place.weights.displacement;
        std::array::from_fn(|i| std::array::from_fn(|j| self.stiffness * w[i] * w[j]))
    }

    pub(super) fn energy(&self, ends: &[f64; 4]) -> f64 {
        self.stiffness * self.place.displacement(ends).powi(2)
    }
}

fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

impl Model {
    /// Adds hinges first: they change the shape by which the others move.
    pub(super) fn attach(&mut self, specimen: &Specimen) -> Result<(), StructureError> {
        for hinge in specimen
            .hinges
            .iter()
            .filter(|hinge| hinge.compliance > 0.0)
        {
            let (run, index, within) = self.locate(hinge.position);
            // The unit of rotational compliance.
            let unit = self.units.stiffness() * self.units.length.powi(2);
            let compliance = hinge.compliance * unit;
            self.add_hinge((run, index), (within, compliance))?;
        }
        for item in &specimen.masses {
            self.add_mass(self.place(item.position), (item.mass, item.inertia));
        }
        self.add_joint_mass(specimen);
        self.add_overlap(specimen);
        for item in specimen.springs.iter().filter(|item| item.stiffness > 0.0) {
            let spring = Spring {
                place: self.place(item.position),
                stiffness: item.stiffness / self.units.stiffness(),
            };
            self.springs.push(spring);
        }
        Ok(())
    }

    /// Run, element and place within it (0 to 1) of a position (m). Of a lap joint, the joint's own
    /// place belongs to the right half.
    fn locate(&self, position: f64) -> (usize, usize, f64) {
        let along = position / self.units.length;
        let right = self.runs.iter().rposition(|run| run.start <= along);
        let run_index = right.unwrap_or(0);
        let run = &self.runs[run_index];
        let within = ((along - run.start) / run.section.element.length).max(0.0);
        let index = (within as usize).min(run.elements - 1);
        (run_index, index, (within - index as f64).min(1.0))
    }

    pub(super) fn place(&self, position: f64) -> Place {
        let (run, index, within) = self.locate(position);
        self.place_in((run, index), within)
    }

    fn place_in(&self, (run_index, index): (usize, usize), within: f64) -> Place {
        let run = &self.runs[run_index];
        let mut weights = run.section.weights(within);
        let hinged = self.hinged_at(run_index, index);
        let inner = match hinged {
            Some(hinged) => {
                hinged.add_weights(&run.section, within, &mut weights);
                [0.0; 4]
            }
            None => run.section.inner_displacement(within),
        };
        Place {
            node: run.first_node + index,
            within,
            weights,
            inner,
        }
    }

    /// Section of the element that begins at a node.
    pub(super) fn section_at(&self, node: usize) -> &Section {
        let right = self.runs.iter().rev().find(|run| run.first_node <= node);
        &right.unwrap_or(&self.runs[0]).section
    }

    fn add_mass(&mut self, place: Place, (mass, inertia): (f64, f64)) {
        if mass == 0.0 && inertia == 0.0 {
            return;
        }
        let section = self.section_at(place.node);
        self.masses.push(Mass {
            compliance: section.inner_compliance(place.within, place.within),
            place,
            mass: mass / self.units.mass,
            inertia: inertia / (self.units.mass * self.units.length.powi(2)),
        });
    }

    fn add_joint_mass(&mut self, specimen: &Specimen) {
        let (mass, inertia) = (specimen.joint_mass.mass, specimen.joint_mass.inertia);
        match specimen.body {
            Body::One(_) => self.add_mass(self.place_in((0, 0), 0.0), (mass, inertia)),
            Body::Joined(_) => {
                let last = self.runs[0].elements - 1;
                let half = (0.5 * mass, 0.5 * inertia);
                self.add_mass(self.place_in((0, last), 1.0), half);
                self.add_mass(self.place_in((1, 0), 0.0), half);
            }
        }
    }

    /// Two points in either half, where Gauss's rule puts them, carry the overlap's uniform mass as
    /// a cubic shape feels it.
    fn add_overlap(&mut self, specimen: &Specimen) {
        let (Some(overlap), Body::Joined([left, _])) = (&specimen.overlap, &specimen.body) else {
            return;
        };
        let gauss = 0.25 / 3f64.sqrt();
        for side in [-1.0, 1.0] {
            for point in [0.25 - gauss, 0.25 + gauss] {
                let place = self.place(left.length + side * point * overlap.length);
                self.add_mass(place, (0.25 * overlap.mass, 0.0));
            }
        }
    }

    fn add_hinge(
        &mut self,
        (run, index): (usize, usize),
        hinge: (f64, f64),
    ) -> Result<(), StructureError> {
        let section = self.runs[run].section;
        let known = self
            .hinged
            .iter()
            .position(|h| h.run == run && h.index == index);
        let mut hinges = known.map_or_else(Vec::new, |known| self.hinged.remove(known).hinges);
        hinges.push(hinge);
        self.hinged
            .push(HingedElement::new(&section, (run, index), hinges)?);
        Ok(())
    }
}

// Which equation each motion of each node has.
//
// About a lap joint the order is chosen so that merged motions stay within the half-bandwidth of an
// element: left end's own, shared, right end's own.

/// Equation of a motion that does not exist.
pub(super) const HELD: usize = usize::MAX;

/// Equations of a specimen's motions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Numbering {
    /// For each node displacement and rotation.
    pub(super) nodes: Vec<[usize; 2]>,
    /// Rotation of the base.
    pub(super) base: Option<usize>,
    /// Number of equations.
    pub(super) size: usize,
}

impl Numbering {
    /// `elements` of each beam; `base` whether the fixture has a motion of its own.
    pub(super) fn new(specimen: &Specimen, elements: &[usize], base: Option<()>) -> Self {
        let rigid = specimen.joint.stiffnesses().map(f64::is_infinite);
        let mut numbering = Self {
            nodes: Vec::new(),
            base: None,
            size: 0,
        };
        numbering.base = base.map(|()| numbering.next());
        match specimen.body {
            Body::One(_) => {
                let first = [0, 1].map(|motion| {
                    if rigid[motion] {
                        HELD
                    } else {
                        numbering.next()
                    }
                });
                numbering.nodes.push(first);
                numbering.run(elements[0]);
            }
            Body::Joined(_) => {
                numbering.run(elements[0]);
                let (left, right) = numbering.joined(rigid);
                numbering.nodes.extend([left, right]);
                numbering.run(elements[1]);
            }
        }
        numbering
    }

    fn next(&mut self) -> usize {
        self.size += 1;
        self.size - 1
    }

    fn run(&mut self, nodes: usize) {
        for _ in 0..nodes {
            let node = [self.next(), self.next()];
            self.nodes.push(node);
        }
    }

    /// The two nodes of a lap joint.
    fn joined(&mut self, rigid: [bool; 2]) -> ([usize; 2], [usize; 2]) {
        let mut left = [HELD; 2];
        for motion in [0, 1].into_iter().filter(|&motion| !rigid[motion]) {
            left[motion] = self.next();
        }
        for motion in [0, 1].into_iter().filter(|&motion| rigid[motion]) {
            left[motion] = self.next();
        }
        let mut right = left;
        for motion in [0, 1].into_iter().filter(|&motion| !rigid[motion]) {
            right[motion] = self.next();
        }
        (left, right)
    }
}
