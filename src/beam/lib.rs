//! Theory: beams, joints and their natural frequencies. Pure functions of geometry; sees no data.
//!
//! Every assembly is made of one building block, a uniform beam whose far end is free and whose
//! near end is held by a translational and a rotational spring ([`interface`]):
//!
//! - a cantilever is that block with the joint's springs,
//! - a free beam is the block with springs of zero stiffness,
//! - a lap joint in the middle splits by symmetry into two such blocks of half the length.
//!
//! ```text
//! Beam, JointStiffness -> natural_lambdas / natural_frequencies -> mode_shapes
//!                          (closed form, counted so that no root is missed)
//! finite_elements          the same structures by an independent route
//! specimen                 the structure with everything fastened to it -> modes
//! interface                either of both seen from the joint, with exact derivatives
//! ```
//!
//! This module must not import anything about measurements.

pub mod beam;
pub mod effects;

pub mod interface;
pub mod joint;
pub mod mode_shape;
pub mod natural_modes;
pub mod receptance;
pub mod specimen;

mod banded;
mod eigen;

pub use beam::{Beam, BeamTheory, SHEAR_COEFFICIENT, Slenderness};
pub use joint::{Assembly, Joint, JointStiffness};
pub use mode_shape::{ModeShape, mode_shapes};
pub use natural_modes::{
    NaturalMode, Symmetry, natural_frequencies, natural_lambdas, natural_lambdas_of_any_joint,
    natural_modes,
};

/// Reason for which a question about a structure has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StructureError {
    /// A property that must be positive and finite is not.
    #[error("{quantity} is {value}, but must be positive and finite")]
    NotPositive {
        /// Name of the property.
        quantity: &'static str,
        /// Its value (SI).
        value: f64,
    },
    /// Poisson's ratio outside its physical range.
    #[error("poisson's ratio is {value}, but must lie above -1 and at most at 0.5")]
    PoissonRatio {
        /// The value given.
        value: f64,
    },
    /// A joint stiffness that is negative or not a number.
    #[error(
        "{quantity} is {value}, but a joint stiffness must be at least 0 (infinite means rigid)"
    )]
    Stiffness {
        /// Name of the stiffness.
        quantity: &'static str,
        /// The value given (non-dimensional).
        value: f64,
    },
    /// A joint whose compliance matrix is not positive definite: it would release energy.
    #[error(
        "the joint is not physical: |kz| = {kz} must exceed sqrt(kx ky) = {limit}; \
         take a larger |kz|, or drop the coupling"
    )]
    NotPhysical {
        /// The magnitude of the cross-coupling stiffness Kz (non-dimensional).
        kz: f64,
        /// Value that it has to exceed.
        limit: f64,
    },
    /// Cross coupling asked of an assembly that has none in this model.
    #[error("a {assembly} has no cross coupling in this model, but 1/kz is {cross_compliance}")]
    NoCoupling {
        /// The assembly.
        assembly: &'static str,
        /// The cross compliance given (non-dimensional).
        cross_compliance: f64,
    },
    /// A place that is not on the beam.
    #[error("position {position} m is not on the structure, which reaches from 0 to {length} m")]
    OffBeam {
        /// The position given (m).
        position: f64,
        /// End of the structure (m).
        length: f64,
    },
    /// More modes than a beam theory says anything about.
    #[error("{count} modes were asked for; at most {limit} are computed")]
    TooManyModes {
        /// Number asked for.
        count: usize,
        /// Number allowed.
        limit: usize,
    },
    /// A part of a specimen that cannot exist.
    #[error("{quantity} is {value}: {remedy}")]
    Unphysical {
        /// Name of the quantity.
        quantity: &'static str,
        /// The value given (SI).
        value: f64,
        /// Condition that it has to meet.
        remedy: &'static str,
    },
    /// A finite-element model that cannot be solved.
    #[error("the finite-element model cannot be solved: {reason}")]
    FiniteElements {
        /// Cause and advice.
        reason: String,
    },
}
