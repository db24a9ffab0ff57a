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
//! specimen                 the structure with everything fastened to it, by finite elements -> modes
//! interface                either of both seen from the joint, with exact derivatives
//! width                    how the width stiffens a beam: three coefficients for the elements
//! ```
//!
//! This crate must not depend on anything about measurements.

pub mod beam;
pub mod effects;

pub mod interface;
pub mod joint;
pub mod natural_modes;
pub mod receptance;
pub mod specimen;
pub mod width;

mod eigen;
mod modal_interface;
mod rayleigh;

pub use beam::{Beam, BeamTheory, SHEAR_COEFFICIENT, Slenderness};
pub use joint::{Assembly, Joint, JointStiffness};
pub use width::WidthStiffening;

pub use natural_modes::{
    MEASURED_LIMIT, MODE_LIMIT, ModeShape, NaturalMode, Symmetry, mode_shapes, natural_frequencies,
    natural_lambdas, natural_lambdas_of_any_joint, natural_modes,
};

/// Rule for a stiffness of the joint.
const STIFFNESS_RULE: &str = ", but a joint stiffness must be at least 0 (infinite means rigid)";

/// Reason for which a question about a structure has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StructureError {
    /// A property that no structure can have.
    #[error("{quantity} is {value}{rule}")]
    Unphysical {
        /// Name of the property.
        quantity: &'static str,
        /// The value given (SI; non-dimensional for the joint of a beam).
        value: f64,
        /// Requirement that it breaks, in words that continue the sentence.
        rule: &'static str,
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
    /// More modes than a beam theory holds for.
    #[error("{count} modes were asked for; at most {MODE_LIMIT} are computed")]
    TooManyModes {
        /// Number asked for.
        count: usize,
    },
    /// A finite-element model that cannot be solved.
    #[error("the finite-element model cannot be solved: {reason}")]
    FiniteElements {
        /// Cause and advice.
        reason: String,
    },
}

/// Refuses a value that is not possible, with the rule that it breaks.
fn require(
    is_possible: bool,
    quantity: &'static str,
    value: f64,
    rule: &'static str,
) -> Result<(), StructureError> {
    match is_possible {
        true => Ok(()),
        false => Err(StructureError::Unphysical {
            quantity,
            value,
            rule,
        }),
    }
}
