//! The beam: geometry, material, and the two stiffnesses and two inertias that follow from them.

use super::{StructureError, require};
use schemars::JsonSchema;
use serde::Serialize;
use std::f64::consts::PI;

/// Shear coefficient of a rectangular cross-section, 5/6 (Timoshenko's beam with a parabolic
/// distribution of shear stress).
pub const SHEAR_COEFFICIENT: f64 = 5.0 / 6.0;

/// Poisson's ratio assumed where none is stated: the usual value of metals.
pub const DEFAULT_POISSON: f64 = 0.3;

/// Which deformations and inertias the beam's equation of motion knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BeamTheory {
    /// Bending and translational inertia only, as in Ingole & Chatterjee.
    Euler,
    /// Shear deformation ([`SHEAR_COEFFICIENT`]), rotary inertia and stiffening by the width ([`crate::width`]) as well.
    Timoshenko,
}

/// A uniform beam of rectangular cross-section, bending in the direction of its thickness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Beam {
    /// Length (m); of a lap joint: both halves together.
    pub length: f64,
    /// Width (m).
    pub width: f64,
    /// Thickness (m), in the direction of vibration.
    pub thickness: f64,
    /// Young's modulus (Pa).
    pub modulus: f64,
    /// Density (kg/m3).
    pub density: f64,
    /// Poisson's ratio; [`DEFAULT_POISSON`] where unknown. Only the Timoshenko theory uses it.
    #[serde(skip)]
    pub poisson: f64,
}

impl Beam {
    /// Checks that every property can belong to a beam.
    ///
    /// # Errors
    /// [`StructureError::Unphysical`], naming the property.
    pub fn check(&self) -> Result<(), StructureError> {
        let positive = [
            ("length", self.length),
            ("width", self.width),
            ("thickness", self.thickness),
            ("modulus", self.modulus),
            ("density", self.density),
        ];
        for (quantity, value) in positive {
            let is_possible = value > 0.0 && value.is_finite();
            let rule = ", but must be positive and finite";
            require(is_possible, quantity, value, rule)?;
        }
        let (ratio, rule) = (self.poisson, ", but must lie above -1 and at most at 0.5");
        require(ratio > -1.0 && ratio <= 0.5, "poisson's ratio", ratio, rule)
    }

    /// Cross-sectional area A = width thickness (m2).
    pub fn area(&self) -> f64 {
        self.width * self.thickness
    }

    /// Second moment of area I = width thickness^3 / 12 (m4).
    pub fn second_moment(&self) -> f64 {
        self.width * self.thickness.powi(3) / 12.0
    }

    /// Bending stiffness E I (N m2).
    pub fn bending_stiffness(&self) -> f64 {
        self.modulus * self.second_moment()
    }

    /// Mass per length rho A (kg/m).
    pub fn mass_per_length(&self) -> f64 {
        self.density * self.area()
    }

    /// Mass rho A L (kg).
    pub fn mass(&self) -> f64 {
        self.mass_per_length() * self.length
    }

    /// Shear modulus G = E / (2 (1 + nu)) (Pa).
    pub fn shear_modulus(&self) -> f64 {
        self.modulus / (2.0 * (1.0 + self.poisson))
    }

    /// Shear stiffness (5/6) G A (N).
    pub fn shear_stiffness(&self) -> f64 {
        SHEAR_COEFFICIENT * self.shear_modulus() * self.area()
    }

    /// Rotary inertia per length rho I (kg m).
    pub fn rotary_inertia_per_length(&self) -> f64 {
        self.density * self.second_moment()
    }

    /// Frequency (Hz) at lambda = 1: f = lambda^2 / (2 pi L^2) sqrt(E I / (rho A)).
    pub fn unit_frequency(&self) -> f64 {
        (self.bending_stiffness() / self.mass_per_length()).sqrt()
            / (2.0 * PI * self.length * self.length)
    }

    /// Non-dimensional frequency lambda (1) of a frequency (Hz):
    /// lambda^4 = omega^2 rho A L^4 / (E I).
    pub fn lambda_of(&self, frequency: f64) -> f64 {
        (frequency / self.unit_frequency()).sqrt()
    }

    /// Frequency (Hz) of a non-dimensional frequency lambda (1).
    pub fn frequency_of(&self, lambda: f64) -> f64 {
        lambda * lambda * self.unit_frequency()
    }

    /// Returns true where the section curls across the width as the beam bends: with any Poisson's ratio but 0.
    pub fn curls(&self) -> bool {
        self.poisson != 0.0
    }

    /// Returns true where the theory lets the width stiffen the beam.
    pub fn is_stiffened(&self, theory: BeamTheory) -> bool {
        theory == BeamTheory::Timoshenko && self.curls()
    }

    /// Returns how slender the beam is for the given theory.
    pub fn slenderness(&self, theory: BeamTheory) -> Slenderness {
        match theory {
            BeamTheory::Euler => Slenderness::EULER,
            BeamTheory::Timoshenko => {
                let rotary = self.second_moment() / (self.area() * self.length * self.length);
                let shear =
                    self.bending_stiffness() / (self.shear_stiffness() * self.length.powi(2));
                Slenderness { rotary, shear }
            }
        }
    }
}

/// Shares of rotary inertia and shear: the two numbers in which a Timoshenko beam differs
/// from an Euler beam. Both are zero for the latter, and neither depends on the modulus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slenderness {
    /// r^2 = I / (A L^2) (1).
    pub rotary: f64,
    /// s^2 = E I / (k G A L^2) (1), k the shear coefficient.
    pub shear: f64,
}

impl Slenderness {
    /// The Euler beam: infinitely slender.
    pub const EULER: Self = Self {
        rotary: 0.0,
        shear: 0.0,
    };

    /// Returns the slenderness of a piece of the same beam, `fraction` (1) of its length long.
    pub fn of_piece(&self, fraction: f64) -> Self {
        let scale = fraction.powi(-2);
        Self {
            rotary: self.rotary * scale,
            shear: self.shear * scale,
        }
    }

    /// Returns true where the plain Euler functions apply.
    pub fn is_euler(&self) -> bool {
        self.rotary == 0.0 && self.shear == 0.0
    }
}
