//! What an error of the description does to the frequencies.
//!
//! Each uncertain property is a nuisance parameter with its standard uncertainty as the prior, as in the estimate of the
//! joint. The joint's stiffnesses stay in SI while the beam under them changes. With the shares t and r of the joint's
//! springs in the strain energy of a mode, and the shape phi of unit modal mass, Rayleigh's quotient gives
//!
//! ```text
//! d ln f/d ln E = (1 - t - r)/2                      d ln f/d ln rho = -(1 - sum m phi^2)/2
//! d ln f/d ln L = -2 + 3 t/2 + r/2 + sum (m phi^2/2 + m x phi phi')
//! ```
//!
//! since f L^2 (rho A/E I)^1/2 depends on K_t L^3/E I, K_r L/E I, m/(rho A L), x/L and (h/L)^2 alone. Thickness and width follow
//! from E I and rho A. Rotary inertias and other springs enter in the same way.

use crate::modal_model::ModalModel;
use crate::structure::ROTATION;
use std::f64::consts::TAU;
use tapjoint_beam::specimen::{Body, Mesh, PlaceMotion, PointInertia, PointMass, Specimen};
use tapjoint_beam::{Beam, WidthStiffening};
use tapjoint_identify::consistent::Parameter;

/// Properties of the beam that are nuisance parameters.
pub const PROPERTIES: [Parameter; 5] = [
    Parameter::Modulus,
    Parameter::Density,
    Parameter::Thickness,
    Parameter::Width,
    Parameter::Length,
];

/// Returns a property of a beam; `None` for a parameter that is none.
pub fn property_of(beam: &mut Beam, property: Parameter) -> Option<&mut f64> {
    match property {
        Parameter::Modulus => Some(&mut beam.modulus),
        Parameter::Density => Some(&mut beam.density),
        Parameter::Thickness => Some(&mut beam.thickness),
        Parameter::Width => Some(&mut beam.width),
        Parameter::Length => Some(&mut beam.length),
        _ => None,
    }
}

/// Returns the derivative of the logarithm of the beam's mass with respect to that of a property.
pub fn mass_slope(property: Parameter) -> f64 {
    match property {
        Parameter::Modulus => 0.0,
        _ => 1.0,
    }
}

/// Returns the derivative of the logarithm of a free beam's frequencies with respect to that of a property. The length of
/// the bar is another one; its uncertainty belongs to the datum.
pub fn free_slope(property: Parameter) -> f64 {
    match property {
        Parameter::Modulus => 0.5,
        Parameter::Density => -0.5,
        Parameter::Thickness => 1.0,
        _ => 0.0,
    }
}

/// Derivatives of the frequencies' logarithms, by mode, with respect to what changes along the section. They are taken at
/// the nominal optimum of the first configuration: what is fastened to the beam changes them little. They include the modes that
/// a next test may add.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SectionSlopes {
    /// By the relative size of shear and rotary inertia (1); empty for Euler's beam.
    pub shear: Vec<f64>,
    /// By Poisson's ratio (1); empty where the width does not count.
    pub poisson: Vec<f64>,
    /// By the hold of the width: 0 for springs spread over the width, 1 for a clamp that keeps the slope across it.
    pub hold: Vec<f64>,
}

impl SectionSlopes {
    /// Returns the slope of a mode by its number; 0 before it is known.
    pub fn of(slopes: &[f64], mode: usize) -> f64 {
        slopes.get(mode - 1).copied().unwrap_or(0.0)
    }
}

/// What an axial force and a base add to the energies of a mode.
#[derive(Default)]
struct Held {
    /// Share of the strain energy (1).
    strain: f64,
    /// Share of the kinetic energy (1).
    kinetic: f64,
    /// Part of the derivative by the logarithm of the length (1).
    by_length: f64,
}

/// Derivatives of the logarithm of a frequency, but for shear and rotary inertia.
pub struct BeamShares {
    /// By the logarithm of the bending stiffness (1).
    stiffness: f64,
    /// By the logarithm of the mass per length (1).
    inertia: f64,
    /// By the logarithm of the length (1).
    by_length: f64,
}

impl BeamShares {
    /// Returns d ln f/d ln p (1) for a property p of the beam. `shear_slope` is the derivative by the relative size of shear and
    /// rotary inertia, which is proportional to (h/L)^2.
    pub fn property_slope(&self, property: Parameter, shear_slope: f64) -> f64 {
        let (stiffness, inertia) = (self.stiffness, self.inertia);
        match property {
            Parameter::Modulus => stiffness,
            Parameter::Density => inertia,
            Parameter::Thickness => 3.0 * stiffness + inertia + 2.0 * shear_slope,
            Parameter::Width => stiffness + inertia,
            Parameter::Length => self.by_length - 2.0 * shear_slope,
            _ => 0.0,
        }
    }
}

/// Distance from a joint that is surely on one of its beams, over the length (1).
const HAIR: f64 = 1e-9;
/// Step of the differences along the section (1).
const STEP: f64 = 1e-3;

impl ModalModel {
    /// Returns what properties of the beam do to the frequency of the mode with this index.
    pub fn beam_shares(&self, index: usize) -> BeamShares {
        let specimen = &self.seen.specimen;
        let omega_square = self.omega(index).powi(2);
        let [translation, rotation] = self.joint_shares(index);
        // Shares of what does not belong to the beam: of the strain energy, and of the kinetic energy.
        let (mut springs, mut masses) = (translation + rotation, 0.0);
        // Change with the length, all in proportion to it but the positions.
        let mut by_length = -2.0 + 1.5 * translation + 0.5 * rotation;
        for spring in &specimen.springs {
            let PlaceMotion {
                displacement: phi,
                slope,
                ..
            } = self.motion(index, spring.position);
            let share = spring.stiffness * phi * phi / omega_square;
            springs += share;
            by_length +=
                1.5 * share - spring.stiffness * spring.position * phi * slope / omega_square;
        }
        let Held {
            strain,
            kinetic,
            by_length: held,
        } = self.share_of_others(index);
        springs += strain;
        masses += kinetic;
        by_length += held;
        // What sits at the joint moves with it; all else stays where it is.
        let mut at_joint = specimen.overlap_masses();
        let PointInertia { mass, inertia } = specimen.joint_mass;
        let positions = match &specimen.body {
            Body::One(_) => vec![0.0],
            // Half of it on either beam, a hair inside.
            Body::Joined([left, _]) => [1.0 - HAIR, 1.0 + HAIR].map(|x| x * left.length).to_vec(),
        };
        let share = 1.0 / positions.len() as f64;
        at_joint.extend(positions.into_iter().map(|position| PointMass {
            position,
            mass: share * mass,
            inertia: share * inertia,
        }));
        for mass in specimen.masses.iter().chain(&at_joint) {
            let PlaceMotion {
                displacement: phi,
                slope,
                ..
            } = self.motion(index, mass.position);
            let (own, turning) = (mass.mass * phi * phi, mass.inertia * slope * slope);
            masses += own + turning;
            by_length += 0.5 * own + 1.5 * turning;
        }
        for mass in &specimen.masses {
            let there = self.motion(index, mass.position);
            by_length += mass.mass * mass.position * there.displacement * there.slope;
        }
        BeamShares {
            stiffness: 0.5 * (1.0 - springs),
            inertia: -0.5 * (1.0 - masses),
            by_length,
        }
    }

    /// Returns the shares of an axial force and of a base that rocks in the energies of a mode.
    fn share_of_others(&self, index: usize) -> Held {
        const POINTS: usize = 48;
        let specimen = &self.seen.specimen;
        let omega_square = self.omega(index).powi(2);
        let mut held = Held::default();
        if specimen.axial_force != 0.0 {
            // The work of the force P is P int phi'^2 dx, by the midpoint rule.
            let step = specimen.body.length() / POINTS as f64;
            let squares = (0..POINTS).map(|point| {
                let slope = self.motion(index, (point as f64 + 0.5) * step).slope;
                slope * slope * step
            });
            let share = specimen.axial_force * squares.sum::<f64>() / omega_square;
            held.strain += share;
            held.by_length += share;
        }
        if let (Some(base), Some(joint)) = (specimen.base, specimen.joint)
            && base.ratio > 0.0
            && joint.kr.is_finite()
        {
            // The joint's moment turns the base: M = (k - omega^2 J) theta.
            let moment = joint.kr * self.modes().joint_motion(index)[ROTATION];
            let stiffness = joint.kr / base.ratio;
            let natural_square = (TAU * base.frequency).powi(2);
            let theta = moment / (stiffness * (1.0 - omega_square / natural_square));
            let strain = stiffness * theta * theta / omega_square;
            let kinetic = stiffness * theta * theta / natural_square;
            held.strain += strain;
            held.kinetic += kinetic;
            held.by_length += 0.5 * strain + 1.5 * kinetic;
        }
        held
    }

    /// Returns the slopes of the first modes along the section; `None` where a beam next to this one has no solution.
    pub fn section_slopes(&self, modes: usize) -> Option<SectionSlopes> {
        let specimen = &self.seen.specimen;
        let mut slopes = SectionSlopes::default();
        if specimen.shear_rotary > 0.0 {
            let mut less = specimen.clone();
            less.shear_rotary -= STEP * specimen.shear_rotary;
            slopes.shear = self.slopes_towards(&less, -STEP, modes)?;
        }
        if specimen.width_stiffening != WidthStiffening::Ignored {
            let mut other = specimen.clone();
            // No isotropic solid reaches 0.5.
            let step = if specimen.body.beams()[0].poisson < 0.49 {
                STEP
            } else {
                -STEP
            };
            for beam in other.body.beams_mut() {
                beam.poisson += step;
            }
            slopes.poisson = self.slopes_towards(&other, step, modes)?;
            slopes.hold = specimen.clamp_differences(modes, Mesh::DIAGNOSIS).ok()?;
        }
        Some(slopes)
    }

    /// Returns the derivatives of the first modes' frequencies (logarithms) by Rayleigh's quotient of a specimen that lies a step
    /// away.
    fn slopes_towards(&self, other: &Specimen, step: f64, modes: usize) -> Option<Vec<f64>> {
        let moved = self.modes().rayleigh_frequencies(other).ok()?;
        let own = self.modes().frequencies();
        let numbers = (1..=modes).map_while(|mode| self.index(mode));
        let slopes = numbers.map(|index| (moved[index] / own[index]).ln() / step);
        Some(slopes.collect())
    }
}
