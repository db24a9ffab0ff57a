//! The joint: two or three springs, from none at all to rigid, in SI units ([`Joint`]) and as the beam feels
//! them ([`JointStiffness`]).

use super::{Beam, STIFFNESS_RULE, StructureError, require};
use schemars::JsonSchema;
use serde::Serialize;

/// Kind of jointed structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Assembly {
    /// A beam held at one end by the joint.
    Cantilever,
    /// Two halves of one beam joined in the middle by relative springs, free otherwise.
    Lap,
    /// A free beam; the joint is ignored.
    Free,
}

/// Springs of a joint, with the compliance matrix `[[1/Kt, -1/Ktr], [-1/Ktr, 1/Kr]]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// Translational stiffness Kt (N/m); infinite = rigid.
    pub kt: f64,
    /// Rotational stiffness Kr (N m/rad); infinite = rigid.
    pub kr: f64,
    /// sqrt(Kt Kr)/Ktr (1), between -1 and 1; 0 = no coupling. Lap joints have none.
    pub coupling: f64,
}

impl Joint {
    /// A joint without give: the beam is clamped.
    pub const RIGID: Self = Self {
        kt: f64::INFINITY,
        kr: f64::INFINITY,
        coupling: 0.0,
    };
}

/// Stiffness of a joint, non-dimensional by the beam it holds (Ingole & Chatterjee):
/// Kx = Kt L^3/(E I), Ky = Kr L/(E I), Kz = Ktr L^2/(E I); of a lap joint L is the total length.
///
/// The joint's compliance matrix for (force, moment) -> (w, theta), theta = dw/dx with x from the
/// joint along the beam, is `[[1/Kx, -1/Kz], [-1/Kz, 1/Ky]]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointStiffness {
    /// Translation, Kx (1), from 0 (free) to infinity (rigid).
    pub kx: f64,
    /// Rotation, Ky (1), from 0 (free) to infinity (rigid).
    pub ky: f64,
    /// Cross compliance 1/Kz (1); 0 without coupling. Negative where the support is elastic.
    pub cross_compliance: f64,
}

impl JointStiffness {
    /// No joint: the beam is free.
    pub const FREE: Self = Self::two_parameter(0.0, 0.0);

    /// Held without give: the beam is clamped.
    pub const RIGID: Self = Self::two_parameter(f64::INFINITY, f64::INFINITY);

    /// Returns a joint without cross coupling, from Kx and Ky (1).
    pub const fn two_parameter(kx: f64, ky: f64) -> Self {
        Self {
            kx,
            ky,
            cross_compliance: 0.0,
        }
    }

    /// Returns a joint with cross coupling, from Kx, Ky and Kz (1); Kz = infinity means no coupling.
    pub fn three_parameter(kx: f64, ky: f64, kz: f64) -> Self {
        Self {
            kx,
            ky,
            cross_compliance: 1.0 / kz,
        }
    }

    /// Returns the joint's springs where it holds this beam. A rigid spring has no coupling.
    pub fn in_si(&self, beam: &Beam) -> Joint {
        let units = StiffnessUnits::of(beam);
        let coupling = self.coupling();
        Joint {
            kt: self.kx * units.kt,
            kr: self.ky * units.kr,
            coupling: if coupling.is_finite() { coupling } else { 0.0 },
        }
    }

    /// Returns the cross-coupling stiffness Kz (1); `None` without coupling.
    pub fn kz(&self) -> Option<f64> {
        (self.cross_compliance != 0.0).then(|| 1.0 / self.cross_compliance)
    }

    /// Returns the coupling sqrt(Kx Ky)/Kz (1), between -1 and 1 for a physical joint.
    pub fn coupling(&self) -> f64 {
        match self.cross_compliance == 0.0 {
            true => 0.0,
            false => self.kx.sqrt() * self.ky.sqrt() * self.cross_compliance,
        }
    }

    /// Checks that the joint can exist: stiffnesses at least zero, and a compliance matrix that
    /// is positive definite, Kz^2 > Kx Ky.
    ///
    /// # Errors
    /// [`StructureError::Unphysical`] or [`StructureError::NotPhysical`].
    pub fn check(&self) -> Result<(), StructureError> {
        for (quantity, value) in [("kx", self.kx), ("ky", self.ky)] {
            require(value >= 0.0, quantity, value, STIFFNESS_RULE)?;
        }
        let kz = 1.0 / self.cross_compliance.abs();
        let limit = self.kx.sqrt() * self.ky.sqrt();
        match self.cross_compliance == 0.0 || kz > limit {
            true => Ok(()),
            false => Err(StructureError::NotPhysical { kz, limit }),
        }
    }
}

/// Units of the non-dimensional stiffnesses for a given beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StiffnessUnits {
    /// Kt per Kx: E I/L^3 (N/m).
    pub kt: f64,
    /// Kr per Ky: E I/L (N m/rad).
    pub kr: f64,
    /// Ktr per Kz: E I/L^2 (N/rad).
    pub ktr: f64,
}

impl StiffnessUnits {
    /// Returns the units for this beam.
    pub fn of(beam: &Beam) -> Self {
        let (stiffness, length) = (beam.bending_stiffness(), beam.length);
        Self {
            kt: stiffness / length.powi(3),
            kr: stiffness / length,
            ktr: stiffness / (length * length),
        }
    }
}
