//! The model: natural frequencies of a jointed structure and their exact derivatives.
//!
//! Every stiffness and inertia enters as its logarithm. A frequency is homogeneous of degree 1/2 in
//! all stiffnesses and of degree -1/2 in all masses together, so that its derivative with the
//! beam's modulus follows from those with the springs: 1/2 less their sum.

use schemars::JsonSchema;
use serde::Serialize;
use std::f64::consts::PI;
use tapjoint_beam::interface::{InterfaceModes, PointAttachment};
use tapjoint_beam::interface::{
    JoinedHalf, JointCompliance, JointedBody, LAST_STEP, interface_root,
};
use tapjoint_beam::specimen::LapLayout;
use tapjoint_beam::{
    Assembly, Beam, BeamTheory, JointStiffness, Slenderness, StructureError, natural_lambdas,
    natural_modes,
};

/// What an estimate can be about.
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
    /// Length (m), all positions in proportion; its part in shear and rotary inertia is left out.
    Length,
    /// Width (m).
    Width,
    /// Thickness (m); its part in shear and rotary inertia is left out.
    Thickness,
}

impl Parameter {
    /// All, in the order of [`Point`].
    pub const ALL: [Self; PARAMETERS] = [
        Self::Kt,
        Self::Kr,
        Self::Coupling,
        Self::Modulus,
        Self::Density,
        Self::Length,
        Self::Width,
        Self::Thickness,
    ];

    pub(super) fn index(self) -> usize {
        self as usize
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
        ][self.index()]
    }
}

/// How many parameters there are.
pub const PARAMETERS: usize = 8;

/// A place in parameter space: logarithms of the SI values, atanh of the coupling. An infinite
/// logarithm of a stiffness is a rigid joint.
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
    /// Of a free beam: lambda of each mode.
    free: Option<Vec<f64>>,
    /// ln of modulus, density, length, width, thickness for which the body was built.
    built_at: Point,
}

impl FrequencyModel {
    /// For modes up to `highest`.
    ///
    /// # Errors
    /// [`StructureError`] where beam, lap joint or attachments cannot exist.
    pub fn new(structure: &JointedStructure, highest: usize) -> Result<Self, StructureError> {
        let pieces = structure.pieces()?;
        let masses = structure.all_masses();
        let closed = structure.route == Route::Automatic
            && masses.is_empty()
            && structure.springs.is_empty();
        let body = match (&pieces[..], closed) {
            ([beam], true) => JointedBody::Rooted(beam.slenderness(structure.theory)),
            ([left, right], true) => {
                let unit = (left, structure.beam.length);
                JointedBody::Joined(
                    [left, right].map(|half| JoinedHalf::new(structure.theory, half, unit)),
                )
            }
            _ => {
                let elements = match structure.route {
                    Route::FiniteElements(elements) => elements,
                    Route::Automatic => elements_for(structure.theory, highest, &pieces),
                };
                let attached = (&masses[..], &structure.springs[..]);
                JointedBody::Elements(Box::new(InterfaceModes::new(
                    structure.theory,
                    &pieces,
                    attached,
                    elements,
                )?))
            }
        };
        let free = match structure.assembly {
            Assembly::Free => Some(free_lambdas(&body, highest)?),
            _ => None,
        };
        Ok(Self {
            structure: structure.clone(),
            body,
            free,
            built_at: nominal_point(&structure.beam),
        })
    }

    /// The structure behind it.
    pub fn structure(&self) -> &JointedStructure {
        &self.structure
    }

    /// Beam and joint as described, the joint of stiffness 1 in every direction.
    pub fn nominal(&self) -> Point {
        nominal_point(&self.structure.beam)
    }

    /// The mode's frequency at a point, its root looked for from `guess` (lambda) on.
    pub fn response(&self, point: &Point, mode: usize, guess: f64) -> ModeResponse {
        self.at(point, LAST_STEP).response(mode, guess)
    }

    /// The model at a point: what all modes share. A relative step of lambda below `last_step` ends
    /// the search for a root.
    pub(super) fn at(&self, point: &Point, last_step: f64) -> ModelAt<'_> {
        let joint = self.compliance(point);
        let coupling = point[Parameter::Coupling.index()].tanh();
        ModelAt {
            model: self,
            unit_frequency: beam_at(&self.structure.beam, point).unit_frequency(),
            joint,
            last_step,
            by_coupling: (joint.a * joint.b).sqrt() * (1.0 - coupling * coupling),
            ratios: self.attachment_ratios(point),
        }
    }

    pub(super) fn compliance(&self, point: &Point) -> JointCompliance {
        let [kx, ky] = log_nondimensional(point).map(|log| (-log).exp());
        let coupling = point[Parameter::Coupling.index()].tanh();
        JointCompliance {
            a: kx,
            b: ky,
            c: coupling * (kx * ky).sqrt(),
        }
    }

    /// How far the ratios of attached masses to the beam's, and of support springs to the beam's
    /// stiffness, have moved from those of the body, as logarithms.
    fn attachment_ratios(&self, point: &Point) -> (f64, f64) {
        let moved = |parameter: Parameter| {
            let index = parameter.index();
            point[index] - self.built_at[index]
        };
        let (length, width, thickness) = (
            moved(Parameter::Length),
            moved(Parameter::Width),
            moved(Parameter::Thickness),
        );
        let mass = -(moved(Parameter::Density) + length + width + thickness);
        let support = 3.0 * length - moved(Parameter::Modulus) - width - 3.0 * thickness;
        (mass, support)
    }

    /// Whether the attachments' shares at this point differ from the body's so much that it has to
    /// be built anew: to first order they are followed exactly.
    pub(super) fn is_far(&self, point: &Point) -> bool {
        // The error left is the square of this, and half of it again.
        const FAR: f64 = 1e-4;
        let attached = !self.structure.masses.is_empty()
            || !self.structure.springs.is_empty()
            || self.structure.lap.overlap.is_some();
        let (mass, support) = self.attachment_ratios(point);
        attached && (mass.abs() > FAR || support.abs() > FAR)
    }

    /// The same model built for the beam at this point.
    pub(super) fn rebuilt(&self, point: &Point, highest: usize) -> Result<Self, StructureError> {
        let there = self
            .structure
            .with_beam(&beam_at(&self.structure.beam, point));
        let built = Self::new(&there, highest)?;
        Ok(Self {
            structure: self.structure.clone(),
            ..built
        })
    }
}

/// A model at one point.
pub(super) struct ModelAt<'a> {
    model: &'a FrequencyModel,
    /// Frequency (Hz) at lambda = 1.
    unit_frequency: f64,
    joint: JointCompliance,
    last_step: f64,
    /// Derivative of the cross compliance with the coupling's atanh.
    by_coupling: f64,
    /// Logarithms by which the shares of attached masses and springs have moved.
    ratios: (f64, f64),
}

impl ModelAt<'_> {
    /// The mode's frequency, its root looked for from `guess` (lambda) on.
    pub(super) fn response(&self, mode: usize, guess: f64) -> ModeResponse {
        let (lambda, springs, attached) = match &self.model.free {
            Some(lambdas) => self.free_mode(lambdas, mode),
            None => self.jointed_mode(mode, guess),
        };
        let [by_kt, by_kr, by_coupling] = springs;
        let [by_masses, by_supports] = attached;
        // Degree 1/2 in all stiffnesses, -1/2 in all masses.
        let by_modulus = 0.5 - by_kt - by_kr - by_supports;
        let by_density = -0.5 - by_masses;
        let (mass, support) = self.ratios;
        let correction = (by_masses * mass + by_supports * support).exp();
        ModeResponse {
            frequency: lambda * lambda * self.unit_frequency * correction,
            lambda,
            sensitivity: [
                by_kt,
                by_kr,
                by_coupling,
                by_modulus,
                by_density,
                // f = L^-2 g(Kt L^3, Kr L, k L^3, m/L).
                -2.0 + 3.0 * (by_kt + by_supports) + by_kr - by_masses,
                by_modulus + by_density,
                3.0 * by_modulus + by_density,
            ],
        }
    }

    fn free_mode(&self, lambdas: &[f64], mode: usize) -> (f64, [f64; 3], [f64; 2]) {
        let attached = match &self.model.body {
            JointedBody::Elements(modes) => modes.free_attachment_sensitivity(mode - 1),
            _ => [0.0; 2],
        };
        (lambdas[mode - 1], [0.0; 3], attached)
    }

    /// d ln f = 2 d ln lambda, with a = 1/Kx, b = 1/Ky and c = coupling sqrt(ab).
    fn jointed_mode(&self, mode: usize, guess: f64) -> (f64, [f64; 3], [f64; 2]) {
        let (joint, body) = (&self.joint, &self.model.body);
        let root = interface_root(body, joint, mode, (guess, self.last_step));
        let [by_a, by_b, by_c] = root.by_compliance;
        let scale = 2.0 / root.lambda;
        let springs = [
            -scale * (by_a * joint.a + 0.5 * by_c * joint.c),
            -scale * (by_b * joint.b + 0.5 * by_c * joint.c),
            scale * by_c * self.by_coupling,
        ];
        let attached = match body {
            JointedBody::Elements(modes) => modes.attachment_sensitivity(root.lambda, root.load),
            _ => [0.0; 2],
        };
        (root.lambda, springs, attached)
    }
}

/// ln Kx and ln Ky at a point: Kx = Kt L^3/(E I), Ky = Kr L/(E I), I = b h^3/12.
pub(super) fn log_nondimensional(point: &Point) -> [f64; 2] {
    let at = |parameter: Parameter| point[parameter.index()];
    let length = at(Parameter::Length);
    let stiffness =
        at(Parameter::Modulus) + at(Parameter::Width) + 3.0 * at(Parameter::Thickness) - 12f64.ln();
    [
        at(Parameter::Kt) + 3.0 * length - stiffness,
        at(Parameter::Kr) + length - stiffness,
    ]
}

fn nominal_point(beam: &Beam) -> Point {
    let mut point = [0.0; PARAMETERS];
    let known = [
        (Parameter::Modulus, beam.modulus),
        (Parameter::Density, beam.density),
        (Parameter::Length, beam.length),
        (Parameter::Width, beam.width),
        (Parameter::Thickness, beam.thickness),
    ];
    for (parameter, value) in known {
        point[parameter.index()] = value.ln();
    }
    point
}

pub(super) fn beam_at(beam: &Beam, point: &Point) -> Beam {
    let at = |parameter: Parameter| point[parameter.index()].exp();
    Beam {
        modulus: at(Parameter::Modulus),
        density: at(Parameter::Density),
        length: at(Parameter::Length),
        width: at(Parameter::Width),
        thickness: at(Parameter::Thickness),
        poisson: beam.poisson,
    }
}

fn free_lambdas(body: &JointedBody, highest: usize) -> Result<Vec<f64>, StructureError> {
    match body {
        JointedBody::Rooted(slenderness) if *slenderness == Slenderness::EULER => {
            natural_lambdas(Assembly::Free, &JointStiffness::FREE, highest)
        }
        JointedBody::Rooted(slenderness) => {
            let modes = natural_modes(Assembly::Free, &JointStiffness::FREE, slenderness, highest)?;
            Ok(modes.iter().map(|mode| mode.lambda).collect())
        }
        JointedBody::Elements(modes) if modes.free_squares().len() >= highest => {
            let squares = modes.free_squares().iter().take(highest);
            Ok(squares.map(|square| square.powf(0.25)).collect())
        }
        _ => Err(StructureError::FiniteElements {
            reason: "it has fewer modes than were measured; divide finer".to_owned(),
        }),
    }
}

// The tested structure without its joint: beams, what is fastened to them, and by which route its
// frequencies are computed.

/// By which route frequencies are computed.
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
    /// How it is held.
    pub assembly: Assembly,
    /// Of a lap joint.
    pub lap: LapLayout,
    /// Masses (kg) on the beam: sensors, and what is fastened.
    pub masses: Vec<PointAttachment>,
    /// Springs (N/m) between beam and ground: suspension, cables.
    pub springs: Vec<PointAttachment>,
    /// How frequencies are computed.
    pub route: Route,
}

impl JointedStructure {
    /// A beam with nothing on it; a lap joint in its middle.
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

    /// The same structure of another beam: places and the overlap in proportion to its length, the right
    /// half's section and material by the same factors.
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
        there.lap.position = there.lap.position.map(|position| position * longer);
        there.lap.overlap = there
            .lap
            .overlap
            .map(|(length, mass)| (length * longer, mass));
        for attached in there.masses.iter_mut().chain(&mut there.springs) {
            // A point at the end stays on the beam, whatever the last digit of the product.
            attached.position = (attached.position * longer).min(beam.length);
        }
        there.beam = *beam;
        there
    }

    /// The beams between which the joint sits, or the one beam.
    ///
    /// # Errors
    /// [`StructureError`] of a beam that cannot exist, or a joint off the beam.
    pub fn pieces(&self) -> Result<Vec<Beam>, StructureError> {
        self.beam.check()?;
        if self.assembly != Assembly::Lap {
            return Ok(vec![self.beam]);
        }
        let position = self.lap.position.unwrap_or(0.5 * self.beam.length);
        if !(position > 0.0 && position < self.beam.length) {
            return Err(StructureError::OffBeam {
                position,
                length: self.beam.length,
            });
        }
        let left = Beam {
            length: position,
            ..self.beam
        };
        let right = Beam {
            length: self.beam.length - position,
            ..self.lap.right.unwrap_or(self.beam)
        };
        right.check()?;
        Ok(vec![left, right])
    }

    /// Masses on the beam, the overlap's included: two points in either half, where Gauss's rule
    /// puts them, carry a uniform mass as a cubic shape feels it.
    pub fn all_masses(&self) -> Vec<PointAttachment> {
        let mut masses = self.masses.clone();
        if let Some((length, mass)) = self.lap.overlap.filter(|_| self.assembly == Assembly::Lap) {
            let joint = self.lap.position.unwrap_or(0.5 * self.beam.length);
            // Half of the overlap reaches from 0 to 1/2: its points are 1/4 -+ 1/(4 sqrt 3).
            let gauss = 0.25 / 3f64.sqrt();
            for side in [-1.0, 1.0] {
                for point in [0.25 - gauss, 0.25 + gauss] {
                    masses.push(PointAttachment {
                        position: joint + side * point * length,
                        size: 0.25 * mass,
                    });
                }
            }
        }
        masses.retain(|mass| mass.size != 0.0);
        masses
    }
}

/// Elements of each piece for this highest mode, so that its frequency is right to about 1e-6. By
/// Euler's theory the relative error is (k h)^4/1440 for the wave number k and the element length
/// h; with shear and rotary inertia it falls as h^2 only.
pub(super) fn elements_for(theory: BeamTheory, highest: usize, pieces: &[Beam]) -> usize {
    let size = match theory {
        BeamTheory::Euler => 0.18,
        BeamTheory::Timoshenko => 0.09,
    };
    let total: f64 = pieces.iter().map(|piece| piece.length).sum();
    let longest = pieces.iter().map(|piece| piece.length).fold(0.0, f64::max);
    let wave = (highest as f64 + 0.5) * PI * longest / total;
    ((wave / size).ceil() as usize).max(8)
}
