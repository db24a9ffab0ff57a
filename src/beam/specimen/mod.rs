//! The tested structure with everything that is fastened to it, as plain data, and its modes.
//!
//! ```text
//! Specimen -> modes -> SpecimenModes   frequencies, shapes, motion of the joint, derivatives
//! ```
//!
//! Finite elements on a banded matrix. What lies between two nodes is not moved to the nearest one:
//! masses and springs act through the element's shape, a hinge changes the element's own static
//! shape, and what the static shapes miss is added to second order (`element.rs`). So frequencies
//! are smooth in every position and good on a coarse mesh.

mod clamp;
mod element;
pub(crate) mod model;
pub(crate) mod modes;
pub(crate) mod numbering;

pub use crate::joint::Joint;
use crate::{Assembly, Beam, BeamTheory, STIFFNESS_RULE, StructureError, WidthStiffening, require};
pub use modes::{BeamModes, PlaceMotion, SpecimenModes};
use schemars::JsonSchema;
use serde::Serialize;

/// The beam, or the two beams that a joint joins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Body {
    /// One beam: held by the joint at its left end, or free.
    One(Beam),
    /// Left and right half of a lap joint, each with its own length.
    Joined([Beam; 2]),
}

impl Body {
    /// Returns the beam, cut at the joint where that is a lap joint.
    pub fn of(beam: &Beam, assembly: Assembly, lap: &LapLayout) -> Self {
        if assembly != Assembly::Lap {
            return Self::One(*beam);
        }
        let position = lap.position.unwrap_or(0.5 * beam.length);
        let left = Beam {
            length: position,
            ..*beam
        };
        let right = Beam {
            length: beam.length - position,
            ..lap.right.unwrap_or(*beam)
        };
        Self::Joined([left, right])
    }

    /// Returns the beams from left to right.
    pub fn beams(&self) -> &[Beam] {
        match self {
            Self::One(beam) => std::slice::from_ref(beam),
            Self::Joined(beams) => beams,
        }
    }

    /// Returns the beams from left to right, to be changed.
    pub fn beams_mut(&mut self) -> &mut [Beam] {
        match self {
            Self::One(beam) => std::slice::from_mut(beam),
            Self::Joined(beams) => beams,
        }
    }

    /// Returns the length of all beams together (m).
    pub fn length(&self) -> f64 {
        self.beams().iter().map(|beam| beam.length).sum()
    }
}

/// A mass with its rotary inertia.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PointInertia {
    /// Mass (kg).
    pub mass: f64,
    /// Moment of inertia about the neutral axis (kg m2).
    pub inertia: f64,
}

/// The overlapping piece of a lap joint. It adds mass, spread uniformly about the joint; what it
/// adds in stiffness belongs to the joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LapOverlap {
    /// Length (m), half on either side of the joint.
    pub length: f64,
    /// The mass it adds, bolts included (kg).
    pub mass: f64,
}

/// A fixture that rocks: a rotating body on a spring of its own, with the joint fastened to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Base {
    /// Natural frequency of the base alone on its spring (Hz).
    pub frequency: f64,
    /// Rotational stiffness of the joint over that of the base (1).
    pub ratio: f64,
}

/// A mass on the beam.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct PointMass {
    /// Distance from the left end (m).
    pub position: f64,
    /// Mass (kg).
    pub mass: f64,
    /// Moment of inertia about the neutral axis (kg m2).
    #[serde(skip)]
    pub inertia: f64,
}

impl PointMass {
    /// Returns a mass (kg) without rotary inertia at a distance (m) from the left end.
    pub fn new(position: f64, mass: f64) -> Self {
        Self {
            position,
            mass,
            inertia: 0.0,
        }
    }
}

/// A spring between beam and ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointSpring {
    /// Distance from the left end (m).
    pub position: f64,
    /// Stiffness (N/m).
    pub stiffness: f64,
}

/// A crack: a hinge with a rotational spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// Distance from the left end (m).
    pub position: f64,
    /// Compliance (rad/(N m)).
    pub compliance: f64,
}

/// A section of the beam that is stiffer, softer, heavier or lighter than the rest: a strip glued to it, a patch, a step of
/// a taper.
///
/// It is as if modulus and density had these factors there: shear stiffness, rotary inertia and the width's stiffening
/// follow in proportion. Sections that overlap multiply their factors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamSection {
    /// Where it begins (m from the left end).
    pub start: f64,
    /// Where it ends (m from the left end).
    pub end: f64,
    /// Factor on the bending stiffness (1).
    pub stiffness: f64,
    /// Factor on the mass per length (1).
    pub mass: f64,
}

impl BeamSection {
    /// Returns steps of a thickness that changes linearly from `near` to `far` times the beam's (1) over a length (m).
    pub fn taper(length: f64, near: f64, far: f64, steps: usize) -> Vec<Self> {
        let step = length / steps as f64;
        let sections = (0..steps).map(|index| {
            let middle = (index as f64 + 0.5) / steps as f64;
            let factor = near + (far - near) * middle;
            Self {
                start: step * index as f64,
                end: step * (index + 1) as f64,
                stiffness: factor.powi(3),
                mass: factor,
            }
        });
        sections.collect()
    }
}

/// A mass on a spring that stands on the beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonator {
    /// Distance from the left end (m).
    pub position: f64,
    /// Mass (kg).
    pub mass: f64,
    /// Natural frequency of the mass on its spring alone (Hz).
    pub frequency: f64,
}

/// Division of the beams into finite elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mesh {
    /// Elements over the whole length; shared among two beams by their lengths.
    pub elements: usize,
}

impl Mesh {
    /// For repeated solutions: with 60 elements seven frequencies are right to 1e-6, of a beam that its width stiffens
    /// to 4e-6. A mass of a tenth of the beam, between nodes of a stocky beam (thickness 0.08 of the length), leaves 5e-5 in the
    /// seventh mode, of half the beam 3e-4. Nodes stay where they are, so that frequencies are smooth in the place of a mass.
    pub const DIAGNOSIS: Self = Self { elements: 60 };
    /// For a reference: with 200 elements the first seven frequencies are right to 1e-8, beyond
    /// which rounding takes over; of a beam that its width stiffens to 2e-7.
    pub const SIMULATION: Self = Self { elements: 200 };

    /// Number of elements of each beam.
    pub(crate) fn divide(self, body: &Body) -> Vec<usize> {
        let beams = body.beams().iter();
        let shares = beams.map(|beam| self.elements as f64 * beam.length / body.length());
        shares
            .map(|share| (share.round() as usize).max(1))
            .collect()
    }
}

/// Differences of a lap joint's halves from two equal pieces of one beam.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LapLayout {
    /// The joint's place (m) from the left end; `None` = the middle.
    pub position: Option<f64>,
    /// The right half, where it differs; its `length` is not used.
    pub right: Option<Beam>,
    /// The overlap.
    pub overlap: Option<LapOverlap>,
}

/// The tested structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Specimen {
    /// The beam or beams.
    pub body: Body,
    /// Share of shear flexibility and rotary inertia (1): 0 = Euler's beam, 1 = Timoshenko's.
    pub shear_rotary: f64,
    /// Stiffening by the width. Timoshenko's beam has it, Euler's has not.
    pub width_stiffening: WidthStiffening,
    /// The joint: it holds the beam's left end, or the two halves of a lap joint together. `None` where
    /// nothing does.
    pub joint: Option<Joint>,
    /// Mass and inertia that move with the beam's end at the joint; of a lap joint half of it with
    /// either end.
    pub joint_mass: PointInertia,
    /// Overlapping piece of a lap joint.
    pub overlap: Option<LapOverlap>,
    /// The fixture under the joint where it gives.
    pub base: Option<Base>,
    /// Axial force (N), tension positive.
    pub axial_force: f64,
    /// Masses on the beam.
    pub masses: Vec<PointMass>,
    /// Springs to the ground.
    pub springs: Vec<PointSpring>,
    /// Cracks.
    pub hinges: Vec<Hinge>,
    /// Sections that differ from the rest.
    pub sections: Vec<BeamSection>,
    /// Sprung masses.
    pub resonators: Vec<Resonator>,
}

impl Specimen {
    /// Returns beam and joint with nothing on them.
    pub fn new(body: Body, joint: Option<Joint>) -> Self {
        Self {
            body,
            shear_rotary: 0.0,
            width_stiffening: WidthStiffening::Ignored,
            joint,
            joint_mass: PointInertia::default(),
            overlap: None,
            base: None,
            axial_force: 0.0,
            masses: Vec::new(),
            springs: Vec::new(),
            hinges: Vec::new(),
            sections: Vec::new(),
            resonators: Vec::new(),
        }
    }

    /// Returns a beam on its joint, with nothing on it but a lap joint's overlap. For a lap joint `beam` has the
    /// left half's properties and the total length. For one beam `lap` has no meaning.
    pub fn jointed(
        theory: BeamTheory,
        beam: &Beam,
        assembly: Assembly,
        lap: &LapLayout,
        joint: Option<Joint>,
    ) -> Self {
        let mut specimen = Self::new(Body::of(beam, assembly, lap), joint);
        if theory == BeamTheory::Timoshenko {
            specimen.shear_rotary = 1.0;
            specimen.width_stiffening = WidthStiffening::SprungAtJoint;
        }
        specimen.overlap = lap.overlap.filter(|_| assembly == Assembly::Lap);
        specimen
    }

    /// Returns translational and rotational stiffness of the joint (N/m, N m/rad): 0 where there is none.
    pub fn joint_stiffnesses(&self) -> [f64; 2] {
        self.joint.map_or([0.0; 2], |joint| [joint.kt, joint.kr])
    }

    /// Returns true where the width stiffens a beam.
    pub fn is_stiffened(&self) -> bool {
        self.width_stiffening != WidthStiffening::Ignored
            && self.body.beams().iter().any(Beam::curls)
    }

    /// Returns the lowest `count` modes, ascending. Motions that are rigid but for the springs to the ground
    /// are left out and listed apart ([`SpecimenModes::suspension_frequencies`]).
    ///
    /// # Errors
    /// [`StructureError`] where a part cannot exist or lies off the beam, where the axial force
    /// buckles the beam, or the mesh is too coarse for so many modes.
    pub fn modes(&self, count: usize, mesh: Mesh) -> Result<SpecimenModes, StructureError> {
        SpecimenModes::new(self, count, mesh, None)
    }

    /// Returns the lowest `count` modes of the beam, on a fixture that may give and with resonators that move on their own.
    ///
    /// # Errors
    /// As [`Specimen::modes`].
    pub fn beam_modes(&self, count: usize, mesh: Mesh) -> Result<BeamModes, StructureError> {
        BeamModes::new(self, count, mesh, None)
    }

    /// Returns the modes that [`Specimen::beam_modes`] returns, for less time where those of a specimen next to this one
    /// are known.
    ///
    /// # Errors
    /// As [`Specimen::modes`].
    pub fn beam_modes_from(
        &self,
        near: &BeamModes,
        count: usize,
        mesh: Mesh,
    ) -> Result<BeamModes, StructureError> {
        BeamModes::new(self, count, mesh, Some(near))
    }

    /// Returns a lap joint's overlap as masses: two points in either half, where Gauss's rule puts them, carry
    /// the uniform mass as a cubic shape feels it.
    pub fn overlap_masses(&self) -> Vec<PointMass> {
        let (Some(overlap), Body::Joined([left, _])) = (&self.overlap, &self.body) else {
            return Vec::new();
        };
        // Half of the overlap reaches from 0 to 1/2: its points are 1/4 -+ 1/(4 sqrt 3).
        let gauss = 0.25 / 3f64.sqrt();
        let points = [-0.25 + gauss, -0.25 - gauss, 0.25 - gauss, 0.25 + gauss];
        let positions = points.map(|point| left.length + point * overlap.length);
        positions
            .map(|position| PointMass::new(position, 0.25 * overlap.mass))
            .to_vec()
    }

    /// Checks that every part can exist and lies on the beam.
    ///
    /// # Errors
    /// [`StructureError`], naming what is wrong.
    pub fn check(&self) -> Result<(), StructureError> {
        for beam in self.body.beams() {
            beam.check()?;
        }
        not_negative("shear and rotary inertia", self.shear_rotary)?;
        not_negative("joint mass", self.joint_mass.mass)?;
        not_negative("joint inertia", self.joint_mass.inertia)?;
        let (force, rule) = (self.axial_force, ": give a finite force in N");
        require(force.is_finite(), "axial force", force, rule)?;
        self.check_attachments()?;
        self.check_joint_and_base()
    }

    fn check_attachments(&self) -> Result<(), StructureError> {
        for mass in &self.masses {
            self.on_beam(mass.position)?;
            not_negative("point mass", mass.mass)?;
            not_negative("inertia of a point mass", mass.inertia)?;
        }
        for spring in &self.springs {
            self.on_beam(spring.position)?;
            not_negative("spring to the ground", spring.stiffness)?;
        }
        for hinge in &self.hinges {
            self.on_beam(hinge.position)?;
            not_negative("compliance of a hinge", hinge.compliance)?;
        }
        self.check_sections_and_resonators()?;
        if let Some(overlap) = &self.overlap {
            not_negative("length of the overlap", overlap.length)?;
            not_negative("mass of the overlap", overlap.mass)?;
            let mut halves = self.body.beams().iter();
            let fits = halves.all(|beam| 0.5 * overlap.length <= beam.length);
            let rule = ": half of it must fit on either side of the joint";
            require(fits, "length of the overlap", overlap.length, rule)?;
        }
        Ok(())
    }

    fn check_sections_and_resonators(&self) -> Result<(), StructureError> {
        for section in &self.sections {
            self.on_beam(section.start)?;
            self.on_beam(section.end)?;
            let rule = ": it must lie behind the beginning";
            require(
                section.start < section.end,
                "end of a section",
                section.end,
                rule,
            )?;
            positive("stiffness of a section", section.stiffness)?;
            positive("mass of a section", section.mass)?;
        }
        for resonator in &self.resonators {
            self.on_beam(resonator.position)?;
            positive("mass of a resonator", resonator.mass)?;
            positive("frequency of a resonator", resonator.frequency)?;
        }
        Ok(())
    }

    fn on_beam(&self, position: f64) -> Result<(), StructureError> {
        let length = self.body.length();
        // A sensor at the very end may have been rounded beyond it.
        if (0.0..=length * (1.0 + 1e-9)).contains(&position) {
            Ok(())
        } else {
            Err(StructureError::OffBeam { position, length })
        }
    }

    fn check_joint_and_base(&self) -> Result<(), StructureError> {
        let is_lap = matches!(self.body, Body::Joined(_));
        let [kt, kr] = self.joint_stiffnesses();
        for (quantity, value) in [("kt", kt), ("kr", kr)] {
            let is_possible = value >= 0.0;
            require(is_possible, quantity, value, STIFFNESS_RULE)?;
        }
        let coupling = self.joint.map_or(0.0, |joint| joint.coupling);
        let rule = ": it must lie between -1 and 1, or the joint releases energy";
        require(
            coupling.abs() < 1.0,
            "coupling of the joint",
            coupling,
            rule,
        )?;
        if coupling != 0.0 && is_lap {
            return Err(StructureError::NoCoupling {
                assembly: "lap joint",
                cross_compliance: coupling,
            });
        }
        let Some(Base { frequency, ratio }) = self.base else {
            return Ok(());
        };
        positive("frequency of the base", frequency)?;
        let quantity = "stiffness ratio of the base";
        not_negative(quantity, ratio)?;
        let carries = ratio == 0.0 || !is_lap && kr > 0.0 && kr.is_finite();
        let rule = ": a flexible base needs a cantilever whose joint has a finite kr above 0";
        require(carries, quantity, ratio, rule)
    }
}

fn positive(quantity: &'static str, value: f64) -> Result<(), StructureError> {
    let is_possible = value > 0.0 && value.is_finite();
    let rule = ": it must be positive and finite";
    require(is_possible, quantity, value, rule)
}

fn not_negative(quantity: &'static str, value: f64) -> Result<(), StructureError> {
    let is_possible = value >= 0.0 && value.is_finite();
    let rule = ": it must be finite and at least 0";
    require(is_possible, quantity, value, rule)
}
