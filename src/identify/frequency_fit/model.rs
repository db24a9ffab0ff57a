//! The tested structure without its joint, its natural frequencies on any joint, and their exact
//! derivatives.
//!
//! Every stiffness and inertia enters as its logarithm. A frequency is homogeneous of degree 1/2 in
//! all stiffnesses and of degree -1/2 in all masses together, so that its derivative with the
//! beam's modulus follows from those with the springs: 1/2 less their sum.

use schemars::JsonSchema;
use serde::Serialize;
use std::f64::consts::PI;
use tapjoint_beam::effects::EffectId;
use tapjoint_beam::interface::{InterfaceModes, JoinedHalf, JointedBody, LAST_STEP};
use tapjoint_beam::specimen::{Body, LapLayout, PointMass, PointSpring, Specimen};
use tapjoint_beam::{
    Assembly, Beam, BeamTheory, Joint, JointStiffness, StructureError, natural_modes,
};

/// Most elements of a beam. More of them would spoil the lowest modes: rounding grows with their fourth power, and
/// is 1e-7 of the lowest frequency here.
const MOST_ELEMENTS: usize = 500;

/// Route by which frequencies are computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Route {
    /// In closed form where that exists, else by finite elements.
    #[default]
    Automatic,
    /// By finite elements, so many to each beam.
    FiniteElements(usize),
}

/// The tested structure without its joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointedStructure {
    /// The beam; of a lap joint the left half's properties and the total length.
    pub beam: Beam,
    /// Theory of bending.
    pub theory: BeamTheory,
    /// Kind of structure.
    pub assembly: Assembly,
    /// Layout of a lap joint.
    pub lap: LapLayout,
    /// Masses on the beam: sensors, and what is fastened.
    pub masses: Vec<PointMass>,
    /// Springs between beam and ground: suspension, cables.
    pub springs: Vec<PointSpring>,
    /// Route by which its frequencies are computed.
    pub route: Route,
}

impl JointedStructure {
    /// Returns a beam with nothing on it; a lap joint is in its middle.
    pub fn new(theory: BeamTheory, beam: Beam, assembly: Assembly) -> Self {
        Self {
            beam,
            theory,
            assembly,
            lap: LapLayout::default(),
            masses: Vec::new(),
            springs: Vec::new(),
            route: Route::Automatic,
        }
    }

    /// Returns false for a lap joint that is not in the middle, or whose halves differ.
    pub fn has_equal_halves(&self) -> bool {
        self.lap.position.is_none() && self.lap.right.is_none()
    }

    /// Returns the structure on a joint, or free of it.
    pub fn specimen(&self, joint: Option<Joint>) -> Specimen {
        Specimen {
            masses: self.masses.clone(),
            springs: self.springs.clone(),
            ..Specimen::jointed(self.theory, &self.beam, self.assembly, &self.lap, joint)
        }
    }

    /// Returns the same structure of another beam: places and the overlap in proportion to its length,
    /// the right half's section and material by the same factors.
    #[must_use]
    pub fn with_beam(&self, beam: &Beam) -> Self {
        let longer = beam.length / self.beam.length;
        let mut there = self.clone();
        if let Some(right) = &mut there.lap.right {
            right.length = beam.length;
            right.width *= beam.width / self.beam.width;
            right.thickness *= beam.thickness / self.beam.thickness;
            right.modulus *= beam.modulus / self.beam.modulus;
            right.density *= beam.density / self.beam.density;
        }
        if let Some(position) = &mut there.lap.position {
            *position *= longer;
        }
        if let Some(overlap) = &mut there.lap.overlap {
            overlap.length *= longer;
        }
        let masses = there.masses.iter_mut().map(|mass| &mut mass.position);
        let springs = there.springs.iter_mut().map(|spring| &mut spring.position);
        for position in masses.chain(springs) {
            // A point at the end stays on the beam, even if the product is rounded up.
            *position = (*position * longer).min(beam.length);
        }
        there.beam = *beam;
        there
    }

    /// Returns the beams between which the joint sits, or the one beam.
    ///
    /// # Errors
    /// [`StructureError`] of a beam that cannot exist, or a joint off the beam.
    pub fn body(&self) -> Result<Body, StructureError> {
        self.beam.check()?;
        let position = self.lap.position.unwrap_or(0.5 * self.beam.length);
        if self.assembly == Assembly::Lap && !(position > 0.0 && position < self.beam.length) {
            return Err(StructureError::OffBeam {
                position,
                length: self.beam.length,
            });
        }
        let body = Body::of(&self.beam, self.assembly, &self.lap);
        body.beams().iter().try_for_each(Beam::check)?;
        Ok(body)
    }

    /// Returns the number of elements of each beam by which frequencies up to this mode are right to about
    /// 1e-6; `None` where they are known in closed form.
    ///
    /// By Euler's theory the relative error is (k h)^4/1440 for the wave number k and the element length
    /// h before the second order of the elements' inertia, which leaves 1e-8. What curls across the width leaves as much
    /// as 1e-7 of the seventh mode. Above mode 20 [`MOST_ELEMENTS`] limits it.
    fn elements(&self, highest: usize, body: &Body) -> Option<usize> {
        if let Route::FiniteElements(elements) = self.route {
            return Some(elements);
        }
        let overlap = self.lap.overlap.filter(|_| self.assembly == Assembly::Lap);
        let masses = self.masses.iter().map(|mass| mass.mass);
        let mut masses = masses.chain(overlap.map(|overlap| overlap.mass));
        let is_bare = self.springs.is_empty() && masses.all(|mass| mass == 0.0);
        let mut beams = body.beams().iter();
        if is_bare && !beams.any(|beam| beam.is_stiffened(self.theory)) {
            return None;
        }
        let size = match self.theory {
            BeamTheory::Euler => 0.18,
            BeamTheory::Timoshenko => 0.15,
        };
        let lengths = body.beams().iter().map(|beam| beam.length);
        let longest = lengths.fold(0.0, f64::max);
        let wave = (highest as f64 + 0.5) * PI * longest / body.length();
        Some(((wave / size).ceil() as usize).clamp(8, MOST_ELEMENTS))
    }
}

/// A quantity that can be estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Parameter {
    /// Translational stiffness Kt (N/m), through its logarithm.
    Kt,
    /// Rotational stiffness Kr (N m/rad), through its logarithm.
    Kr,
    /// Coupling sqrt(Kt Kr)/Ktr (1), through its inverse hyperbolic tangent: |coupling| < 1 holds
    /// by construction, and no coupling is a point like any other.
    Coupling,
    /// Young's modulus (Pa), of both halves of a lap joint by the same factor.
    Modulus,
    /// Density (kg/m3), likewise.
    Density,
    /// Length (m), all positions in proportion; its part in shear, rotary inertia and stiffening by the width is left
    /// out.
    Length,
    /// Width (m); its part in stiffening by the width is left out.
    Width,
    /// Thickness (m); its part in shear and rotary inertia is left out.
    Thickness,
    /// Length (m) of the beam where its clamp was moved, as [`Self::Length`] is where it was not.
    SecondLength,
    /// Length (m) of the beam where its clamp was moved again.
    ThirdLength,
    /// Length (m) of the beam where its clamp was moved again.
    FourthLength,
    /// Length (m) of the beam where its clamp was moved again.
    FifthLength,
    /// Length (m) of the beam where its clamp was moved again, or of the free bar beside five lengths.
    SixthLength,
}

impl Parameter {
    /// The parameters of the joint, in the order of [`Point`].
    pub const JOINT: [Self; 3] = [Self::Kt, Self::Kr, Self::Coupling];

    /// All parameters, in the order of [`Point`].
    pub const ALL: [Self; PARAMETERS] = [
        Self::Kt,
        Self::Kr,
        Self::Coupling,
        Self::Modulus,
        Self::Density,
        Self::Length,
        Self::Width,
        Self::Thickness,
        Self::SecondLength,
        Self::ThirdLength,
        Self::FourthLength,
        Self::FifthLength,
        Self::SixthLength,
    ];

    /// Lengths of the beam in one fit: as described first, then where its clamp was moved, and that of the free bar.
    pub const LENGTHS: [Self; 6] = [
        Self::Length,
        Self::SecondLength,
        Self::ThirdLength,
        Self::FourthLength,
        Self::FifthLength,
        Self::SixthLength,
    ];

    /// Properties whose product the mass of the beam is, but for a constant.
    pub(super) const OF_MASS: [Self; 4] =
        [Self::Density, Self::Length, Self::Width, Self::Thickness];

    pub(super) fn index(self) -> usize {
        self as usize
    }

    /// Returns the power with which a property of the beam enters its natural frequencies, h/L^2 sqrt(E/rho), where they are
    /// all multiplied by one factor (1); 0 for the joint. The width drops out of I/A.
    pub fn frequency_power(self) -> f64 {
        match self {
            Self::Modulus => 0.5,
            Self::Density => -0.5,
            Self::Thickness => 1.0,
            Self::Kt | Self::Kr | Self::Coupling | Self::Width => 0.0,
            Self::Length
            | Self::SecondLength
            | Self::ThirdLength
            | Self::FourthLength
            | Self::FifthLength
            | Self::SixthLength => -2.0,
        }
    }

    /// Returns the property of the beam that an effect changes; `None` where it changes none.
    pub fn of_effect(effect: EffectId) -> Option<Self> {
        match effect {
            EffectId::Modulus => Some(Self::Modulus),
            EffectId::Density => Some(Self::Density),
            EffectId::Length => Some(Self::Length),
            EffectId::Thickness => Some(Self::Thickness),
            _ => None,
        }
    }

    /// Name as in test descriptions and reports.
    pub fn name(self) -> &'static str {
        [
            "kt",
            "kr",
            "coupling",
            "modulus",
            "density",
            "length",
            "width",
            "thickness",
            "second-length",
            "third-length",
            "fourth-length",
            "fifth-length",
            "sixth-length",
        ][self.index()]
    }
}

/// Number of parameters.
pub const PARAMETERS: usize = 13;

/// A place in parameter space: logarithms of the SI values, atanh of the coupling. An infinite
/// logarithm of a stiffness is a rigid joint. Lengths that no structure of the fit has are of no effect.
pub type Point = [f64; PARAMETERS];

/// One natural frequency and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeResponse {
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// lambda (1) by the reference beam at this point.
    pub lambda: f64,
    /// Derivatives of ln frequency with each coordinate of [`Point`].
    pub sensitivity: Point,
}

/// A structure ready to be asked for frequencies at any point.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyModel {
    structure: JointedStructure,
    pub(super) body: JointedBody,
    /// lambda of each mode of a free beam.
    free: Option<Vec<f64>>,
    /// ln of modulus, density, length, width, thickness for which the body was built.
    built_at: Point,
    /// Coordinate of its length.
    pub(super) length: Parameter,
}

impl FrequencyModel {
    /// Returns the model of modes up to `highest`.
    ///
    /// # Errors
    /// [`StructureError`] where beam, lap joint or attachments cannot exist.
    pub fn new(structure: &JointedStructure, highest: usize) -> Result<Self, StructureError> {
        let beams = structure.body()?;
        let theory = structure.theory;
        let body = match (structure.elements(highest, &beams), &beams) {
            (Some(elements), _) => {
                let free = structure.specimen(None);
                JointedBody::Elements(Box::new(InterfaceModes::new(&free, elements, highest)?))
            }
            (None, Body::One(beam)) => JointedBody::Rooted(beam.slenderness(theory)),
            (None, Body::Joined([left, right])) => {
                let total = structure.beam.length;
                let halves = [left, right].map(|half| JoinedHalf::new(theory, half, left, total));
                JointedBody::Joined(halves)
            }
        };
        let free = match (structure.assembly, &body) {
            (Assembly::Cantilever | Assembly::Lap, _) => None,
            (Assembly::Free, JointedBody::Rooted(slenderness)) => {
                let joint = JointStiffness::FREE;
                let modes = natural_modes(Assembly::Free, &joint, slenderness, highest)?;
                Some(modes.iter().map(|mode| mode.lambda).collect())
            }
            (Assembly::Free, JointedBody::Elements(modes))
                if modes.free_squares().len() >= highest =>
            {
                let squares = modes.free_squares().iter().take(highest);
                Some(squares.map(|square| square.powf(0.25)).collect())
            }
            (Assembly::Free, _) => {
                return Err(StructureError::FiniteElements {
                    reason: "it has fewer modes than were measured; divide finer".to_owned(),
                });
            }
        };
        Ok(Self {
            structure: structure.clone(),
            body,
            free,
            built_at: nominal_point(&structure.beam),
            length: Parameter::Length,
        })
    }

    /// Returns the model whose length is this coordinate of a point.
    pub(super) fn of_length(self, length: Parameter) -> Self {
        Self { length, ..self }
    }

    /// Returns the structure behind it.
    pub fn structure(&self) -> &JointedStructure {
        &self.structure
    }

    /// Returns the point of the beam as described, with a joint of stiffness 1 in every direction.
    pub fn nominal(&self) -> Point {
        nominal_point(&self.structure.beam)
    }

    /// Returns the mode's frequency at a point. Its root is looked for from `guess` (lambda) on.
    pub fn response(&self, point: &Point, mode: usize, guess: f64) -> ModeResponse {
        self.at(point, LAST_STEP).response(mode, guess)
    }

    /// Returns what all modes share at a point. A relative step of lambda below `last_step` ends the
    /// search for a root.
    pub(super) fn at(&self, point: &Point, last_step: f64) -> ModelAt<'_> {
        let compliances = self.compliances(point);
        let coupling = point[Parameter::Coupling.index()].tanh();
        ModelAt {
            model: self,
            unit_frequency: self.beam_at(point).unit_frequency(),
            compliances,
            last_step,
            by_coupling: (compliances[0] * compliances[1]).sqrt() * (1.0 - coupling * coupling),
            ratios: self.attachment_ratios(point),
        }
    }

    /// Returns a point with the length of this structure for that of the beam.
    fn own(&self, point: &Point) -> Point {
        let mut own = *point;
        own[Parameter::Length.index()] = point[self.length.index()];
        own
    }

    /// Returns the beam of this structure at a point.
    pub(super) fn beam_at(&self, point: &Point) -> Beam {
        beam_at(&self.structure.beam, &self.own(point))
    }

    /// Returns 1/Kx, 1/Ky and 1/Kz at a point.
    pub(super) fn compliances(&self, point: &Point) -> [f64; 3] {
        let [a, b] = log_nondimensional(&self.own(point)).map(|log| (-log).exp());
        let coupling = point[Parameter::Coupling.index()].tanh();
        [a, b, coupling * (a * b).sqrt()]
    }

    /// Returns two differences from the body, as logarithms: of the ratio of attached masses to the beam's, and of
    /// support springs to the beam's stiffness.
    fn attachment_ratios(&self, point: &Point) -> (f64, f64) {
        let own = self.own(point);
        let moved: Point = std::array::from_fn(|i| own[i] - self.built_at[i]);
        let [_, _, _, modulus, density, length, width, thickness, ..] = moved;
        let mass = -(density + length + width + thickness);
        (mass, 3.0 * length - modulus - width - 3.0 * thickness)
    }

    /// Returns true where the attachments' shares at this point differ too much from the body's: it has to be built
    /// anew. To first order they are followed exactly.
    pub(super) fn is_far(&self, point: &Point) -> bool {
        // The error left is the square of this, and half of it again.
        const FAR: f64 = 1e-4;
        let attached = !self.structure.masses.is_empty()
            || !self.structure.springs.is_empty()
            || self.structure.lap.overlap.is_some();
        let (mass, support) = self.attachment_ratios(point);
        attached && (mass.abs() > FAR || support.abs() > FAR)
    }

    /// Returns the model built for the beam at this point.
    pub(super) fn rebuilt(&self, point: &Point, highest: usize) -> Result<Self, StructureError> {
        let there = self.structure.with_beam(&self.beam_at(point));
        let built = Self::new(&there, highest)?;
        Ok(Self {
            structure: self.structure.clone(),
            length: self.length,
            ..built
        })
    }
}

/// A model at one point.
pub(super) struct ModelAt<'a> {
    model: &'a FrequencyModel,
    /// Frequency (Hz) at lambda = 1.
    unit_frequency: f64,
    /// 1/Kx, 1/Ky and 1/Kz (1).
    compliances: [f64; 3],
    last_step: f64,
    /// Derivative of the cross compliance with the coupling's atanh.
    by_coupling: f64,
    /// Logarithms by which the shares of attached masses and springs have moved.
    ratios: (f64, f64),
}

impl ModelAt<'_> {
    /// Returns the mode's frequency. Its root is looked for from `guess` (lambda) on.
    pub(super) fn response(&self, mode: usize, guess: f64) -> ModeResponse {
        let (mut by_joint, mut attached) = ([0.0; 3], [0.0; 2]);
        let lambda;
        if let Some(lambdas) = &self.model.free {
            lambda = lambdas[mode - 1];
            if let JointedBody::Elements(modes) = &self.model.body {
                attached = modes.free_attachment_sensitivity(mode - 1);
            }
        } else {
            let root = (self.model.body).root(self.compliances, mode, guess, self.last_step);
            lambda = root.lambda;
            // d ln f = 2 d ln lambda, with a = 1/Kx, b = 1/Ky and c = coupling sqrt(ab).
            let ([a, b, c], [by_a, by_b, by_c]) = (self.compliances, root.by_compliance);
            let scale = 2.0 / lambda;
            by_joint = [
                -scale * (by_a * a + 0.5 * by_c * c),
                -scale * (by_b * b + 0.5 * by_c * c),
                scale * by_c * self.by_coupling,
            ];
            if let JointedBody::Elements(modes) = &self.model.body {
                attached = modes.attachment_sensitivity(lambda, root.load, self.compliances[0]);
            }
        }
        let [by_kt, by_kr, by_coupling] = by_joint;
        let [by_masses, by_supports] = attached;
        // Degree 1/2 in all stiffnesses, -1/2 in all masses.
        let by_modulus = 0.5 - by_kt - by_kr - by_supports;
        let by_density = -0.5 - by_masses;
        let (mass, support) = self.ratios;
        let correction = (by_masses * mass + by_supports * support).exp();
        let mut sensitivity = [0.0; PARAMETERS];
        let slopes = [
            (Parameter::Kt, by_kt),
            (Parameter::Kr, by_kr),
            (Parameter::Coupling, by_coupling),
            (Parameter::Modulus, by_modulus),
            (Parameter::Density, by_density),
            // f = L^-2 g(Kt L^3, Kr L, k L^3, m/L).
            (
                self.model.length,
                -2.0 + 3.0 * (by_kt + by_supports) + by_kr - by_masses,
            ),
            (Parameter::Width, by_modulus + by_density),
            (Parameter::Thickness, 3.0 * by_modulus + by_density),
        ];
        for (parameter, slope) in slopes {
            sensitivity[parameter.index()] = slope;
        }
        ModeResponse {
            frequency: lambda * lambda * self.unit_frequency * correction,
            lambda,
            sensitivity,
        }
    }
}

/// Returns ln Kx and ln Ky at a point: Kx = Kt L^3/(E I), Ky = Kr L/(E I), I = b h^3/12.
pub(super) fn log_nondimensional(point: &Point) -> [f64; 2] {
    let [kt, kr, _, modulus, _, length, width, thickness, ..] = *point;
    let stiffness = modulus + width + 3.0 * thickness - 12f64.ln();
    [kt + 3.0 * length - stiffness, kr + length - stiffness]
}

fn nominal_point(beam: &Beam) -> Point {
    let mut point = [0.0; PARAMETERS];
    point[Parameter::Modulus.index()] = beam.modulus.ln();
    point[Parameter::Density.index()] = beam.density.ln();
    point[Parameter::Length.index()] = beam.length.ln();
    point[Parameter::Width.index()] = beam.width.ln();
    point[Parameter::Thickness.index()] = beam.thickness.ln();
    point
}

pub(super) fn beam_at(beam: &Beam, point: &Point) -> Beam {
    let [_, _, _, modulus, density, length, width, thickness, ..] = point.map(f64::exp);
    Beam {
        modulus,
        density,
        length,
        width,
        thickness,
        poisson: beam.poisson,
    }
}
