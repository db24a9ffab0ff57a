//! Stiffening of a beam by its width: how the section curls across the width, and what that costs.
//!
//! A bent beam curls across its width by -nu times its curvature. Along short waves the section cannot follow, and the
//! beam is stiffer. Of Kirchhoff's plate with the displacement
//!
//! ```text
//! w(x, y) = W(x) + a(x) (y^2/2 - b^2/24)
//! ```
//!
//! remains twice the strain energy (kappa = W'' is the curvature by bending)
//!
//! ```text
//! E I integral( kappa^2 + follow (a + nu kappa)^2 + twist a'^2 ) dx,
//! follow = mu/(1 - nu^2),   twist = b^2/(6 (1 + nu)),   mu = 5 (1 - nu)/(6 - 5 nu).
//! ```
//!
//! The first term is the beam's own. Of the plate's energy mu would be 1. But higher powers of y let the section give
//! way: mu makes waves along a strip right to the fourth power of wave number times width (docs/theory.md). The inertia
//! and the second derivative of the curling are of that order too. Both are in mu, so `a` has neither.
//!
//! At an end nothing holds `a`, and a' = 0 follows by itself. At a joint the springs decide.

use super::Beam;

/// What a model knows of the width, and how the joint holds it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WidthStiffening {
    /// Nothing: every section follows at once, as in Euler's beam.
    Ignored,
    /// The joint holds the mean over the width alone. The end curls freely.
    FreeAtJoint,
    /// The joint's springs are spread evenly over the width. The translational one resists curling too.
    SprungAtJoint,
    /// The end cannot curl.
    HeldAtJoint,
}

/// The coefficients of the module's text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Curling {
    pub(crate) poisson: f64,
    /// Stiffness against a + nu kappa, over E I (1).
    pub(crate) follow: f64,
    /// Stiffness against a', over E I (m2).
    pub(crate) twist: f64,
    /// Mean square over the width of the displacement for a = 1 (m4).
    pub(crate) mean_square: f64,
}

impl Curling {
    pub(crate) fn of(beam: &Beam) -> Self {
        let (nu, width) = (beam.poisson, beam.width);
        Self {
            poisson: nu,
            follow: 5.0 / ((1.0 + nu) * (6.0 - 5.0 * nu)),
            twist: width * width / (6.0 * (1.0 + nu)),
            mean_square: width.powi(4) / 720.0,
        }
    }
}
