//! A specimen divided into elements: its equations, its matrices, and the energies of any motion.
//!
//! Lengths are in units of the specimen's, stiffness and mass in those of its first beam, so that
//! all numbers stay near 1. Rotations are dw/dx with x in units of the length.

use super::element::{
    Across, ElementHinge, HingedElement, Section, Square, Units, Weights, dot, quadratic,
};
use super::numbering::{ACROSS, HELD, Motion, Numbering};
use super::{BeamSection, Body, Joint, Specimen};
use crate::eigen::{BEAM_ROW, BandedMatrix, RESONATOR_ROW, SLENDER_ROW};
use crate::width::Curling;
use crate::{Beam, StructureError, WidthStiffening};
use std::f64::consts::PI;

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

/// The equal elements of one beam.
#[derive(Debug, Clone)]
pub(super) struct Run {
    /// Displacement of the middle line against the mean over the width, for a unit of curvature across it.
    middle: f64,
    /// Where it begins, in the model's units.
    pub(super) start: f64,
    pub(super) elements: usize,
    pub(super) first_node: usize,
    /// Every element, where no section differs.
    pub(super) section: Section,
    /// Each element for itself, where sections differ; else empty.
    own: Vec<Section>,
}

impl Run {
    /// The element behind a node.
    fn section_at(&self, node: usize) -> &Section {
        self.own
            .get(node - self.first_node)
            .unwrap_or(&self.section)
    }
}

/// A sprung mass.
#[derive(Debug, Clone, Copy)]
pub(super) struct AttachedResonator {
    pub(super) place: Place,
    pub(super) mass: f64,
    stiffness: f64,
}

/// The base: inertia and stiffness of its rotation.
#[derive(Debug, Clone, Copy)]
pub(super) struct RotatingBase {
    pub(super) inertia: f64,
    pub(super) stiffness: f64,
}

/// A place on the beam: an element's near node, and the element's motion there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    pub(crate) node: usize,
    /// From 0 to 1.
    within: f64,
    weights: Weights,
    /// Displacement over omega^2 that the element's inertia adds; none in an element with a hinge.
    pub(super) inner: [f64; 4],
}

impl Place {
    pub(crate) fn displacement(&self, ends: &[f64; 4]) -> f64 {
        dot(&self.weights.displacement, ends)
    }

    pub(super) fn rotation(&self, ends: &[f64; 4]) -> f64 {
        dot(&self.weights.rotation, ends)
    }
}

/// A mass with its inertia.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AttachedMass {
    pub(crate) place: Place,
    pub(crate) mass: f64,
    inertia: f64,
    /// Compliance of the element, held at both ends, at this place.
    compliance: f64,
}

/// A spring to the ground.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AttachedSpring {
    pub(crate) place: Place,
    pub(crate) stiffness: f64,
}

/// A specimen divided into elements.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(super) runs: Vec<Run>,
    pub(crate) numbering: Numbering,
    pub(super) units: Units,
    /// Stiffness of the joint for (w, theta), infinite where rigid.
    pub(super) joint: [[f64; 2]; 2],
    /// Stiffness of the joint against curvature across the width, infinite where rigid.
    joint_across: f64,
    /// That over the joint's translational stiffness where springs are spread over the width.
    pub(crate) across_ratio: f64,
    pub(super) base: Option<RotatingBase>,
    pub(crate) masses: Vec<AttachedMass>,
    pub(crate) springs: Vec<AttachedSpring>,
    pub(super) resonators: Vec<AttachedResonator>,
    hinged: Vec<HingedElement>,
}

impl Model {
    /// A specimen whose beams, from left to right, have so many elements each.
    ///
    /// # Errors
    /// As [`Specimen::check`].
    pub(crate) fn new(specimen: &Specimen, elements: &[usize]) -> Result<Self, StructureError> {
        specimen.check()?;
        let beams = specimen.body.beams();
        let units = Units::of(&beams[0], specimen.body.length());
        let stiffened = specimen.is_stiffened();
        let mut runs: Vec<Run> = Vec::new();
        for (beam, &elements) in beams.iter().zip(elements) {
            let last = runs.last();
            let start = last.map_or(0.0, |_| beams[0].length);
            let first_node = last.map_or(0, |run| run.elements + 1);
            let (shear_rotary, axial_force) = (specimen.shear_rotary, specimen.axial_force);
            let section =
                Section::new(beam, elements, shear_rotary, axial_force, stiffened, &units);
            let changes = changes_along(&specimen.sections, beam, start, elements);
            let own = changes.into_iter();
            runs.push(Run {
                middle: (beam.width / units.length).powi(2) / 24.0,
                start: start / units.length,
                elements,
                first_node,
                own: own
                    .map(|[stiffness, mass]| section.changed(stiffness, mass))
                    .collect(),
                section,
            });
        }
        // The base where it gives: k = Kr/ratio, and the inertia that has its frequency on that spring.
        let base = specimen
            .base
            .filter(|base| base.ratio > 0.0 && beams.len() == 1);
        let base = base.map(|base| {
            let [_, kr] = specimen.joint_stiffnesses();
            let stiffness = kr / units.rotational_stiffness() / base.ratio;
            let omega = 2.0 * PI * base.frequency / units.omega;
            let inertia = stiffness / (omega * omega);
            RotatingBase { inertia, stiffness }
        });
        let joint = joint_matrix(specimen.joint, &units);
        let mean_square = Curling::of(&beams[0]).mean_square / units.length.powi(4);
        let sprung = stiffened && specimen.width_stiffening == WidthStiffening::SprungAtJoint;
        let across_ratio = if sprung { mean_square } else { 0.0 };
        let [kt, _] = specimen.joint_stiffnesses();
        let joint_across = match across_ratio > 0.0 {
            true => across_ratio * kt / units.stiffness(),
            false => 0.0,
        };
        let mut model = Self {
            joint_across,
            across_ratio,
            numbering: Numbering::new(specimen, elements, base.is_some(), &[]),
            runs,
            joint,
            base,
            masses: Vec::new(),
            springs: Vec::new(),
            resonators: Vec::new(),
            hinged: Vec::new(),
            units,
        };
        model.attach(specimen)?;
        if !specimen.resonators.is_empty() {
            model.attach_resonators(specimen, elements)?;
        }
        Ok(model)
    }

    /// Adds the resonators and their equations.
    fn attach_resonators(
        &mut self,
        specimen: &Specimen,
        elements: &[usize],
    ) -> Result<(), StructureError> {
        let mut nodes: Vec<usize> = Vec::new();
        for item in &specimen.resonators {
            let place = self.place(item.position);
            if nodes.contains(&place.node) {
                return Err(StructureError::FiniteElements {
                    reason: "two resonators stand on one element; divide finer, or set them apart"
                        .to_owned(),
                });
            }
            nodes.push(place.node);
            let mass = item.mass / self.units.mass;
            let omega = 2.0 * PI * item.frequency / self.units.omega;
            self.resonators.push(AttachedResonator {
                place,
                mass,
                stiffness: mass * omega * omega,
            });
        }
        self.numbering = Numbering::new(specimen, elements, self.base.is_some(), &nodes);
        Ok(())
    }

    /// Adds what is fastened to the beams: hinges first, which change the shape by which the others
    /// move.
    fn attach(&mut self, specimen: &Specimen) -> Result<(), StructureError> {
        for hinge in specimen.hinges.iter().filter(|one| one.compliance > 0.0) {
            let compliance = hinge.compliance * self.units.rotational_stiffness();
            let (run, index, within) = self.locate(hinge.position);
            let node = self.runs[run].first_node + index;
            let known = self.hinged.iter().position(|hinged| hinged.node == node);
            let mut hinges = known.map_or_else(Vec::new, |known| self.hinged.remove(known).hinges);
            hinges.push(ElementHinge { within, compliance });
            let section = self.runs[run].section_at(node);
            self.hinged.push(HingedElement::new(section, node, hinges)?);
        }
        for item in &specimen.masses {
            self.add_mass(self.place(item.position), item.mass, item.inertia);
        }
        let (mass, inertia) = (specimen.joint_mass.mass, specimen.joint_mass.inertia);
        match specimen.body {
            Body::One(_) => self.add_mass(self.place_in(0, 0, 0.0), mass, inertia),
            Body::Joined(_) => {
                let last = self.runs[0].elements - 1;
                for place in [self.place_in(0, last, 1.0), self.place_in(1, 0, 0.0)] {
                    self.add_mass(place, 0.5 * mass, 0.5 * inertia);
                }
            }
        }
        for item in specimen.overlap_masses() {
            self.add_mass(self.place(item.position), item.mass, item.inertia);
        }
        for item in specimen.springs.iter().filter(|item| item.stiffness > 0.0) {
            self.springs.push(AttachedSpring {
                place: self.place(item.position),
                stiffness: item.stiffness / self.units.stiffness(),
            });
        }
        Ok(())
    }

    /// Adds a mass (kg) and its inertia (kg m2).
    fn add_mass(&mut self, place: Place, mass: f64, inertia: f64) {
        if mass == 0.0 && inertia == 0.0 {
            return;
        }
        let section = self.run_of(place.node).section_at(place.node);
        self.masses.push(AttachedMass {
            compliance: section.inner_compliance(place.within, place.within),
            place,
            mass: mass / self.units.mass,
            inertia: inertia / (self.units.mass * self.units.length.powi(2)),
        });
    }

    /// Run, element and place within it (0 to 1) of a position (m). A lap joint's own place belongs
    /// to the right half.
    fn locate(&self, position: f64) -> (usize, usize, f64) {
        let along = position / self.units.length;
        let right = self.runs.iter().rposition(|run| run.start <= along);
        let run_index = right.unwrap_or(0);
        let run = &self.runs[run_index];
        let within = ((along - run.start) / run.section.element.length).max(0.0);
        let index = (within as usize).min(run.elements - 1);
        (run_index, index, (within - index as f64).min(1.0))
    }

    /// The place at a position (m).
    pub(super) fn place(&self, position: f64) -> Place {
        let (run, index, within) = self.locate(position);
        self.place_in(run, index, within)
    }

    fn place_in(&self, run: usize, index: usize, within: f64) -> Place {
        let node = self.runs[run].first_node + index;
        let section = self.runs[run].section_at(node);
        let mut weights = section.weights(within);
        let mut inner = [0.0; 4];
        match self.hinged_at(node) {
            Some(hinged) => hinged.add_weights(section, within, &mut weights),
            None => inner = section.inner_displacement(within),
        }
        Place {
            node,
            within,
            weights,
            inner,
        }
    }

    /// Returns a b^2/24 (model's units) at a place, of the curvature a across the width b; 0 where that is not followed.
    pub(super) fn curvature_across(&self, motion: &Motion, place: &Place) -> f64 {
        if !self.numbering.stiffened {
            return 0.0;
        }
        let [.., a0, a1] = motion.all_ends(place.node);
        self.run_of(place.node).middle * (a0 + place.within * (a1 - a0))
    }

    /// The beam of the element behind a node.
    fn run_of(&self, node: usize) -> &Run {
        let right = self.runs.iter().rposition(|run| run.first_node <= node);
        &self.runs[right.unwrap_or(0)]
    }

    /// Returns whether the hinges sit in the same elements. Where one moves across a node, the slope there changes by its kink.
    pub(super) fn has_hinges_in_same_elements(&self, other: &Self) -> bool {
        let [own, others] = [self, other].map(|model| model.hinged.iter().map(|one| one.node));
        own.eq(others)
    }

    fn hinged_at(&self, node: usize) -> Option<&HingedElement> {
        self.hinged.iter().find(|hinged| hinged.node == node)
    }

    /// Number of motions at zero frequency but for springs to the ground and the axial force.
    pub(crate) fn rigid_motions(&self) -> usize {
        let loose = (0..2).filter(|&i| self.joint[i][i] == 0.0).count();
        2 * (self.runs.len() - 1) + loose
    }

    /// Returns true where the joint hardly withstands rigid motions: the lowest eigenvalue is then so far below the others that
    /// rounding spoils them.
    pub(super) fn is_weakly_held(&self) -> bool {
        const WEAK: f64 = 1e-2;
        (0..2).any(|i| self.joint[i][i] < WEAK)
    }

    /// Returns true where something beside the joint withstands rigid motions.
    pub(super) fn is_supported(&self) -> bool {
        !self.springs.is_empty() || self.runs.iter().any(|run| run.section.axial_force != 0.0)
    }

    /// Magnitude of the highest omega^2: that of an element's end alone.
    pub(crate) fn highest_square(&self) -> f64 {
        let sections = self.runs.iter();
        let sections = sections.flat_map(|run| run.own.iter().chain([&run.section]));
        let ratios = sections.map(|section| section.stiffness[0][0] / section.mass[0][0]);
        let resonators = self.resonators.iter().map(|one| one.stiffness / one.mass);
        ratios.chain(resonators).fold(0.0, f64::max)
    }

    /// Frequency (Hz) of an omega^2 in the model's units.
    pub(super) fn frequency(&self, square: f64) -> f64 {
        square.max(0.0).sqrt() * self.units.omega / (2.0 * PI)
    }

    /// Least number of entries that a row of the matrices needs.
    pub(super) fn row(&self) -> usize {
        match (self.resonators.is_empty(), self.numbering.stiffened) {
            (false, _) => RESONATOR_ROW,
            (true, true) => BEAM_ROW,
            (true, false) => SLENDER_ROW,
        }
    }

    /// Stiffness and mass matrix. A row needs [`Model::row`] entries.
    pub(crate) fn matrices<const N: usize>(&self) -> (BandedMatrix<N>, BandedMatrix<N>) {
        let size = self.numbering.size;
        let (mut stiffness, mut mass) = (BandedMatrix::zeros(size), BandedMatrix::zeros(size));
        for run in &self.runs {
            for node in run.first_node..run.first_node + run.elements {
                let (of_stiffness, of_mass) = match self.hinged_at(node) {
                    Some(hinged) => (&hinged.stiffness, &hinged.mass),
                    None => {
                        let section = run.section_at(node);
                        (&section.stiffness, &section.mass)
                    }
                };
                self.scatter(&mut stiffness, node, of_stiffness);
                self.scatter(&mut mass, node, of_mass);
                if self.numbering.stiffened {
                    self.scatter_across(&mut stiffness, node, self.across_at(run, node));
                }
            }
        }
        for item in &self.masses {
            let (w, t) = (item.place.weights.displacement, item.place.weights.rotation);
            let matrix = std::array::from_fn(|i| {
                std::array::from_fn(|j| item.mass * w[i] * w[j] + item.inertia * t[i] * t[j])
            });
            self.scatter(&mut mass, item.place.node, &matrix);
        }
        for item in &self.springs {
            let w = item.place.weights.displacement;
            let matrix =
                std::array::from_fn(|i| std::array::from_fn(|j| item.stiffness * w[i] * w[j]));
            self.scatter(&mut stiffness, item.place.node, &matrix);
        }
        for (item, &own) in self.resonators.iter().zip(&self.numbering.resonators) {
            mass.add(own, own, item.mass);
            stiffness.add(own, own, item.stiffness);
            let w = item.place.weights.displacement;
            let on_beam =
                std::array::from_fn(|i| std::array::from_fn(|j| item.stiffness * w[i] * w[j]));
            self.scatter(&mut stiffness, item.place.node, &on_beam);
            for (row, weight) in self
                .numbering
                .equations_behind(item.place.node)
                .into_iter()
                .zip(w)
            {
                if row != HELD {
                    let (low, high) = (row.min(own), row.max(own));
                    stiffness.add(high, low, -item.stiffness * weight);
                }
            }
        }
        let ends = self.joint_ends();
        for &(row, i, row_sign) in &ends {
            for &(column, j, column_sign) in &ends {
                let entry = match (i, j) {
                    (ACROSS, ACROSS) => self.joint_across,
                    (ACROSS, _) | (_, ACROSS) => 0.0,
                    _ => self.joint[i][j],
                };
                if row != HELD && column != HELD && entry.is_finite() {
                    stiffness.add(row, column, row_sign * column_sign * entry);
                }
            }
        }
        if let (Some(base), Some(row)) = (&self.base, self.numbering.base) {
            stiffness.add(row, row, base.stiffness);
            mass.add(row, row, base.inertia);
        }
        (stiffness, mass)
    }

    /// What omega^4 adds: the matrix of [`Energies::second_order`].
    pub(crate) fn second_order_matrix(&self) -> BandedMatrix {
        let mut matrix = BandedMatrix::zeros(self.numbering.size);
        for run in &self.runs {
            for node in run.first_node..run.first_node + run.elements {
                self.scatter(&mut matrix, node, &run.section_at(node).second_order);
            }
        }
        for item in &self.masses {
            let (w, inner) = (item.place.weights.displacement, item.place.inner);
            let of_mass = std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    item.mass * item.mass * item.compliance * w[i] * w[j]
                        + item.mass * (w[i] * inner[j] + inner[i] * w[j])
                })
            });
            self.scatter(&mut matrix, item.place.node, &of_mass);
        }
        matrix
    }

    /// What the width adds to the element behind a node.
    fn across_at<'a>(&'a self, run: &'a Run, node: usize) -> &'a Across {
        match self.hinged_at(node) {
            Some(hinged) => &hinged.across,
            None => &run.section_at(node).across,
        }
    }

    fn scatter_across<const N: usize>(
        &self,
        target: &mut BandedMatrix<N>,
        node: usize,
        across: &Across,
    ) {
        let [near, far] = [self.numbering.nodes[node], self.numbering.nodes[node + 1]];
        let equations = [near[0], near[1], far[0], far[1], near[2], far[2]];
        for (&row, values) in equations.iter().zip(&across.matrix()) {
            for (&column, value) in equations.iter().zip(values) {
                if row != HELD && column != HELD {
                    target.add(row, column, *value);
                }
            }
        }
    }

    /// Adds the matrix of the element behind a node.
    fn scatter<const N: usize>(&self, target: &mut BandedMatrix<N>, node: usize, matrix: &Square) {
        let equations = self.numbering.equations_behind(node);
        for (&row, values) in equations.iter().zip(matrix) {
            for (&column, value) in equations.iter().zip(values) {
                if row != HELD && column != HELD {
                    target.add(row, column, *value);
                }
            }
        }
    }

    /// Equations whose motion deforms the joint, its component, and the sign.
    fn joint_ends(&self) -> Vec<(usize, usize, f64)> {
        let nodes = &self.numbering.nodes;
        if let [left, right] = self.runs.as_slice() {
            let (before, after) = (nodes[left.elements], nodes[right.first_node]);
            let ends = [(before, -1.0), (after, 1.0)].into_iter();
            return ends
                .flat_map(|(rows, sign)| (0..3).map(move |i| (rows[i], i, sign)))
                .collect();
        }
        let mut ends: Vec<_> = (0..3).map(|i| (nodes[0][i], i, 1.0)).collect();
        if let Some(base) = self.numbering.base {
            ends.push((base, 1, -1.0));
        }
        ends
    }

    /// The load of a unit force (component 0), moment (1) or load on the curvature across the width ([`ACROSS`]) on the
    /// beam's end, and its opposite on what the joint fastens it to.
    pub(crate) fn joint_load(&self, of: usize) -> Vec<f64> {
        let mut load = vec![0.0; self.numbering.size];
        for (row, component, sign) in self.joint_ends() {
            if component == of && row != HELD {
                load[row] += sign;
            }
        }
        load
    }

    /// Deformation of the joint's springs: displacement and rotation.
    pub(crate) fn joint_motion(&self, motion: &Motion) -> [f64; 2] {
        if let [left, right] = self.runs.as_slice() {
            let (before, after) = (motion.nodes[left.elements], motion.nodes[right.first_node]);
            return [after[0] - before[0], after[1] - before[1]];
        }
        let [w, theta, _] = motion.nodes[0];
        [w, theta - motion.base.unwrap_or(0.0)]
    }

    /// Curvature across the width that the joint's springs feel; of a lap joint right minus left.
    pub(crate) fn joint_curling(&self, motion: &Motion) -> f64 {
        match self.runs.as_slice() {
            [left, right] => {
                motion.nodes[right.first_node][ACROSS] - motion.nodes[left.elements][ACROSS]
            }
            _ => motion.nodes[0][ACROSS],
        }
    }

    /// Twice the strain energy of the joint's springs. A rigid one is strained by nothing.
    pub(super) fn joint_energy(&self, motion: &Motion) -> f64 {
        let u = self.joint_motion(motion);
        let mut sum = 0.0;
        for (row, a) in self.joint.iter().zip(u) {
            for (entry, b) in row.iter().zip(u) {
                if entry.is_finite() {
                    sum += entry * a * b;
                }
            }
        }
        if self.joint_across > 0.0 && self.joint_across.is_finite() {
            sum += self.joint_across * self.joint_curling(motion).powi(2);
        }
        sum
    }

    /// Energies of a motion.
    pub(super) fn energies(&self, motion: &Motion) -> Energies {
        let mut sum = Energies::default();
        for run in &self.runs {
            for node in run.first_node..run.first_node + run.elements {
                let (ends, section) = (motion.ends(node), run.section_at(node));
                sum.second_order += quadratic(&section.second_order, &ends);
                if let Some(hinged) = self.hinged_at(node) {
                    sum.strain += hinged.strain_energy(section, &ends);
                    sum.kinetic += quadratic(&hinged.mass, &ends);
                } else {
                    sum.strain += section.strain_energy(&ends);
                    sum.kinetic += quadratic(&section.mass, &ends);
                }
                if self.numbering.stiffened {
                    let across = self.across_at(run, node);
                    sum.strain += across.strain_energy(&motion.all_ends(node));
                }
            }
        }
        for item in &self.masses {
            let ends = motion.ends(item.place.node);
            let (w, t) = (item.place.displacement(&ends), item.place.rotation(&ends));
            sum.kinetic += item.mass * w * w + item.inertia * t * t;
            // Its load inside the element: its own motion m^2 w^2 times the compliance, and the work
            // on what the element's inertia moves.
            let load = item.mass * w;
            sum.second_order +=
                load * (load * item.compliance + 2.0 * dot(&item.place.inner, &ends));
        }
        for item in &self.springs {
            let w = item.place.displacement(&motion.ends(item.place.node));
            sum.strain += item.stiffness * w.powi(2);
        }
        for (item, own) in self.resonators.iter().zip(&motion.resonators) {
            let stretch = own - item.place.displacement(&motion.ends(item.place.node));
            sum.strain += item.stiffness * stretch * stretch;
            sum.kinetic += item.mass * own * own;
        }
        sum.strain += self.joint_energy(motion);
        if let (Some(base), Some(turn)) = (&self.base, motion.base) {
            sum.strain += base.stiffness * turn * turn;
            sum.kinetic += base.inertia * turn * turn;
        }
        sum
    }

    /// Twice the strain and the kinetic energy that two motions have in common.
    pub(super) fn products(&self, a: &Motion, b: &Motion) -> [f64; 2] {
        let [with, without] = [1.0, -1.0].map(|sign| self.energies(&a.plus(sign, b)));
        [
            0.25 * (with.strain - without.strain),
            0.25 * (with.kinetic - without.kinetic),
        ]
    }

    /// Rigid motions that nothing withstands: their eigenvalues are equal.
    pub(crate) fn locked_motions(&self) -> Vec<Vec<f64>> {
        match self.rigid_motions() > 0 && !self.is_supported() {
            true => self.rigid_vectors(),
            false => Vec::new(),
        }
    }

    /// Unit motions without strain energy where only the joint could withstand them.
    fn rigid_vectors(&self) -> Vec<Vec<f64>> {
        let mut motions = Vec::new();
        for kind in 0..2 {
            if self.runs.len() > 1 {
                motions.push(self.rigid_vector(kind, 0));
            }
            if self.joint[kind][kind] == 0.0 {
                motions.push(self.rigid_vector(kind, self.runs.len() - 1));
            }
        }
        motions
    }

    /// Up and down, and rocking about the centre of mass, both of unit modal mass.
    pub(super) fn rigid_pair(&self) -> [Motion; 2] {
        let [up, turn] = [0, 1].map(|kind| self.numbering.motion(&self.rigid_vector(kind, 0)));
        let [_, first] = self.products(&up, &turn);
        let centre = first / self.energies(&up).kinetic;
        let rock = turn.plus(-centre, &up);
        [up, rock].map(|motion| {
            let size = self.energies(&motion).kinetic.sqrt();
            motion.scaled(size.recip())
        })
    }

    /// Translation (0) or rotation (1) of the runs from `first` on, about the first one's left end.
    fn rigid_vector(&self, kind: usize, first: usize) -> Vec<f64> {
        let mut motion = Motion {
            nodes: vec![[0.0; 3]; self.numbering.nodes.len()],
            base: None,
            resonators: Vec::new(),
        };
        for run in &self.runs[first..] {
            for index in 0..=run.elements {
                let x = run.start + index as f64 * run.section.element.length;
                motion.nodes[run.first_node + index] = if kind == 0 {
                    [1.0, 0.0, 0.0]
                } else {
                    [x - self.runs[first].start, 1.0, 0.0]
                };
            }
        }
        let resonators = self.resonators.iter();
        let carried = resonators.map(|one| one.place.displacement(&motion.ends(one.place.node)));
        motion.resonators = carried.collect();
        self.numbering.vector(&motion)
    }
}

/// Returns stiffness and mass of each of a beam's equal elements over those of the beam; empty where no section differs.
/// `start` is the beam's left end (m).
///
/// An element that the border of a section cuts takes the mean mass and the mean compliance, so that frequencies are
/// continuous in the place of the border.
fn changes_along(
    sections: &[BeamSection],
    beam: &Beam,
    start: f64,
    elements: usize,
) -> Vec<[f64; 2]> {
    if sections.is_empty() {
        return Vec::new();
    }
    let length = beam.length / elements as f64;
    let changed = (0..elements).map(|index| {
        let [from, to] = [index, index + 1].map(|end| start + end as f64 * length);
        let borders = sections.iter().flat_map(|one| [one.start, one.end]);
        let inside = borders.filter(|border| from < *border && *border < to);
        let mut cuts: Vec<f64> = inside.chain([from, to]).collect();
        cuts.sort_by(f64::total_cmp);
        let (mut mass, mut compliance) = (0.0, 0.0);
        for piece in cuts.windows(2) {
            let (middle, share) = (0.5 * (piece[0] + piece[1]), (piece[1] - piece[0]) / length);
            let here = sections.iter();
            let here = here.filter(|one| one.start < middle && middle < one.end);
            let factors = here.fold((1.0, 1.0), |(mass, stiffness), one| {
                (mass * one.mass, stiffness * one.stiffness)
            });
            mass += share * factors.0;
            compliance += share / factors.1;
        }
        [compliance.recip(), mass]
    });
    changed.collect()
}

/// Stiffness of the joint for (w, theta): the inverse of `[[1/Kt, -1/Ktr], [-1/Ktr, 1/Kr]]`, in the
/// model's units. A spring that is missing or rigid has no coupling.
fn joint_matrix(joint: Option<Joint>, units: &Units) -> [[f64; 2]; 2] {
    let Some(Joint { kt, kr, coupling }) = joint else {
        return [[0.0; 2]; 2];
    };
    let kx = kt / units.stiffness();
    let ky = kr / units.rotational_stiffness();
    let coupled = [kx, ky].iter().all(|&k| k > 0.0 && k.is_finite());
    if coupling == 0.0 || !coupled {
        return [[kx, 0.0], [0.0, ky]];
    }
    // With r = sqrt(Kx Ky)/Kz: [[Kx, r sqrt(Kx Ky)], [r sqrt(Kx Ky), Ky]]/(1 - r^2).
    let rest = 1.0 - coupling * coupling;
    let cross = coupling * (kx * ky).sqrt() / rest;
    [[kx / rest, cross], [cross, ky / rest]]
}
