//! What is fastened to the beam, anywhere on an element.

use super::{HingedElement, Model, Section, Square, Weights};
use crate::StructureError;
use crate::specimen::{Body, Specimen};

/// A place on the beam: an element's near node, and the element's motion there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::specimen) struct Place {
    pub(in crate::specimen) node: usize,
    /// From 0 to 1.
    pub(in crate::specimen) within: f64,
    pub(in crate::specimen) weights: Weights,
    /// Displacement over omega^2 that the element's inertia adds; none in an element with a hinge.
    pub(in crate::specimen) inner: [f64; 4],
}

/// A mass with its inertia.
#[derive(Debug, Clone, Copy)]
pub(in crate::specimen) struct Mass {
    pub(super) place: Place,
    mass: f64,
    inertia: f64,
    /// Compliance of the element, held at both ends, at this place.
    compliance: f64,
}

/// A spring to the ground.
#[derive(Debug, Clone, Copy)]
pub(in crate::specimen) struct Spring {
    pub(super) place: Place,
    stiffness: f64,
}

impl Place {
    pub(in crate::specimen) fn displacement(&self, ends: &[f64; 4]) -> f64 {
        dot(&self.weights.displacement, ends)
    }

    pub(in crate::specimen) fn rotation(&self, ends: &[f64; 4]) -> f64 {
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

    pub(in crate::specimen) fn place(&self, position: f64) -> Place {
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
    pub(in crate::specimen) fn section_at(&self, node: usize) -> &Section {
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
