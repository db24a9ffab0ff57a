//! Structures: what is described, and what is true.

use super::draws::{ErrorShape, log_normal, log_uniform, weighted};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use tapjoint::gap::DescriptionUncertainty;
use tapjoint::identify::consistent::{BeamTolerances, Parameter};
use tapjoint::structure::specimen::{Joint, LapLayout, LapOverlap, Specimen};
use tapjoint::structure::{Assembly, Beam, BeamTheory};

/// How the beam is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    Cantilever,
    /// A cantilever in a joint that is described as rigid in translation, in rotation or in both.
    RigidCantilever,
    Lap,
    Free,
}

impl Support {
    pub const ALL: [Self; 4] = [
        Self::Cantilever,
        Self::RigidCantilever,
        Self::Lap,
        Self::Free,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Cantilever => "cantilever",
            Self::RigidCantilever => "rigid-cantilever",
            Self::Lap => "lap",
            Self::Free => "free",
        }
    }

    /// Share of the tests: 70 % cantilevers, of which 15 % are rigid.
    pub fn share(self) -> f64 {
        match self {
            Self::Cantilever => 0.7 * 0.85,
            Self::RigidCantilever => 0.7 * 0.15,
            Self::Lap | Self::Free => 0.15,
        }
    }

    /// Returns one of these by their shares.
    pub fn draw(random: &mut ChaCha8Rng, allowed: &[Self]) -> Self {
        let shares: Vec<f64> = allowed.iter().map(|one| one.share()).collect();
        allowed[weighted(random, &shares)]
    }
}

/// Modulus (Pa), density (kg/m3) and Poisson's ratio of steel, aluminium, brass, titanium, wood and a polymer.
const MATERIALS: [(f64, f64, f64); 6] = [
    (207e9, 7850.0, 0.30),
    (70e9, 2700.0, 0.33),
    (105e9, 8500.0, 0.35),
    (114e9, 4430.0, 0.34),
    (11e9, 520.0, 0.36),
    (3.1e9, 1190.0, 0.38),
];

/// How well the structure is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tolerances {
    /// All is as described.
    Exact,
    /// Measured with care.
    Tight,
    /// As the program assumes where nothing is stated.
    Default,
    /// Taken from a table.
    Loose,
}

impl Tolerances {
    pub const ALL: [Self; 4] = [Self::Exact, Self::Tight, Self::Default, Self::Loose];

    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Tight => "tight",
            Self::Default => "default",
            Self::Loose => "loose",
        }
    }

    fn of(self, beam: &Beam) -> DescriptionUncertainty {
        let relative = |share: f64, least: f64, value: f64| Some(share.max(least / value));
        let (beam, masses, positions) = match self {
            Self::Exact => (BeamTolerances::default(), 0.0, 0.0),
            Self::Tight => {
                let tolerances = BeamTolerances {
                    length: Some(1e-3),
                    width: Some(1e-3),
                    thickness: Some(1e-3),
                    modulus: Some(2e-3),
                    density: Some(1e-3),
                    poisson: Some(0.01),
                };
                (tolerances, 0.02, 5e-4)
            }
            // Those of `tolerance` of a description.
            Self::Default => {
                let tolerances = BeamTolerances {
                    length: relative(1e-3, 0.5e-3, beam.length),
                    width: relative(2e-3, 0.05e-3, beam.width),
                    thickness: relative(5e-3, 0.02e-3, beam.thickness),
                    modulus: Some(0.01),
                    density: Some(0.005),
                    poisson: Some(0.02),
                };
                (tolerances, 0.02, 1e-3)
            }
            Self::Loose => {
                let tolerances = BeamTolerances {
                    length: relative(3e-3, 1e-3, beam.length),
                    width: Some(0.01),
                    thickness: relative(0.01, 0.05e-3, beam.thickness),
                    modulus: Some(0.03),
                    density: Some(0.02),
                    poisson: Some(0.03),
                };
                (tolerances, 0.02, 3e-3)
            }
        };
        DescriptionUncertainty {
            beam,
            masses,
            positions,
            ..DescriptionUncertainty::default()
        }
    }
}

/// A structure and its description.
#[derive(Debug, Clone)]
pub struct Structure {
    pub support: Support,
    pub tolerances: Tolerances,
    pub errors: ErrorShape,
    /// As described. The search for the joint begins at its stiffnesses.
    pub described: Specimen,
    /// As it is, without planted effects.
    pub truth: Specimen,
    pub uncertainty: DescriptionUncertainty,
}

/// What a class of plants needs.
#[derive(Debug, Clone)]
pub struct Needs {
    pub supports: Vec<Support>,
    /// Theory of the beam; `None` for either.
    pub theory: Option<BeamTheory>,
    /// Least thickness over length (1).
    pub least_thickness: f64,
}

impl Structure {
    pub fn draw(random: &mut ChaCha8Rng, needs: &Needs) -> Self {
        let support = Support::draw(random, &needs.supports);
        let tolerances = Tolerances::ALL[weighted(random, &[0.1, 0.25, 0.4, 0.25])];
        let errors = ErrorShape::ALL[weighted(random, &[0.4, 0.3, 0.3])];
        let timoshenko = random.random_bool(0.6);
        let theory = needs.theory.unwrap_or(match timoshenko {
            true => BeamTheory::Timoshenko,
            false => BeamTheory::Euler,
        });
        let length = log_uniform(random, 0.15, 1.2);
        let (modulus, density, poisson) = MATERIALS[random.random_range(0..MATERIALS.len())];
        let beam = Beam {
            length,
            width: length * log_uniform(random, 0.02, 0.15),
            thickness: length * log_uniform(random, needs.least_thickness, 0.03),
            modulus,
            density,
            poisson,
        };
        let uncertainty = tolerances.of(&beam);
        let known = &uncertainty.beam;
        let mut wrong = |value: f64, std: Option<f64>| {
            value * (1.0 + std.unwrap_or(0.0) * errors.draw(random)).max(0.5)
        };
        let true_beam = Beam {
            length: wrong(beam.length, known.length),
            width: wrong(beam.width, known.width),
            thickness: wrong(beam.thickness, known.thickness),
            modulus: wrong(beam.modulus, known.modulus),
            density: wrong(beam.density, known.density),
            poisson: wrong(beam.poisson, known.poisson.map(|std| std / beam.poisson)).min(0.49),
        };
        let joint = draw_joint(random, support, &true_beam);
        let lap = draw_lap(random, &beam);
        let stretch = true_beam.length / beam.length;
        let true_lap = LapLayout {
            position: lap.position.map(|position| position * stretch),
            ..lap
        };
        let assembly = match support {
            Support::Cantilever | Support::RigidCantilever => Assembly::Cantilever,
            Support::Lap => Assembly::Lap,
            Support::Free => Assembly::Free,
        };
        // The search begins off the truth, as an estimate without the effect would.
        let estimate = joint.map(|joint| Joint {
            kt: log_normal(random, joint.kt, 0.2),
            kr: log_normal(random, joint.kr, 0.2),
            ..joint
        });
        Self {
            support,
            tolerances,
            errors,
            described: Specimen::jointed(theory, &beam, assembly, &lap, estimate),
            truth: Specimen::jointed(theory, &true_beam, assembly, &true_lap, joint),
            uncertainty,
        }
    }

    /// Returns the length as described (m).
    pub fn length(&self) -> f64 {
        self.described.body.length()
    }

    /// Returns the mass as described (kg).
    pub fn mass(&self) -> f64 {
        self.described.body.beams().iter().map(Beam::mass).sum()
    }

    /// Returns the standard uncertainty of the frequencies' common factor by the tolerances (1):
    /// f is proportional to h/L^2 (E/rho)^1/2.
    pub fn scale_std(&self) -> f64 {
        let known = &self.uncertainty.beam;
        let properties = [
            Parameter::Thickness,
            Parameter::Length,
            Parameter::Modulus,
            Parameter::Density,
        ];
        let squares = properties.iter().map(|property| {
            (property.frequency_power() * known.of(*property).unwrap_or(0.0)).powi(2)
        });
        squares.sum::<f64>().sqrt()
    }
}

fn draw_joint(random: &mut ChaCha8Rng, support: Support, beam: &Beam) -> Option<Joint> {
    if support == Support::Free {
        return None;
    }
    let unit = beam.bending_stiffness() / beam.length;
    let mut kt = log_uniform(random, 30.0, 6000.0) * unit / beam.length.powi(2);
    let mut kr = log_uniform(random, 1.0, 160.0) * unit;
    if support == Support::RigidCantilever {
        let rigid = random.random_range(0..3);
        if rigid != 1 {
            kt = f64::INFINITY;
        }
        if rigid != 0 {
            kr = f64::INFINITY;
        }
    }
    Some(Joint {
        kt,
        kr,
        coupling: 0.0,
    })
}

/// Draws the place of a lap joint, and in two of five cases an overlap.
fn draw_lap(random: &mut ChaCha8Rng, beam: &Beam) -> LapLayout {
    let position = beam.length * (0.35 + 0.3 * random.random::<f64>());
    let length = beam.length * (0.04 + 0.08 * random.random::<f64>());
    let overlap = LapOverlap {
        length,
        mass: beam.mass_per_length() * length * (1.0 + 0.5 * random.random::<f64>()),
    };
    LapLayout {
        position: random.random_bool(0.5).then_some(position),
        right: None,
        overlap: random.random_bool(0.4).then_some(overlap),
    }
}
