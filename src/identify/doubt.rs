//! What speaks against an estimate that exists: warnings that travel with it.

use std::fmt;

/// What speaks against an estimate that exists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Doubt {
    /// A stiffness came out negative: no spring does that.
    Negative {
        /// Which one ("kx" or "ky").
        parameter: &'static str,
        /// Its value (1).
        value: f64,
    },
    /// A stiffness came out infinite or not a number.
    NotFinite {
        /// Which one.
        parameter: &'static str,
    },
    /// The three stiffnesses belong to no joint: Kz^2 <= Kx Ky.
    NotPhysical {
        /// Kz (1).
        kz: f64,
        /// sqrt(Kx Ky) (1), which |Kz| must exceed.
        limit: f64,
    },
    /// The estimate does not satisfy its own frequency equation.
    Closure {
        /// Product implied by the regression / product of its own estimates - 1.
        closure: f64,
    },
    /// The interval of the coupling contains zero: Kz may be infinite, of either sign.
    CouplingNotEstablished,
}

impl Doubt {
    /// Short name, for reports.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Negative { .. } => "negative-stiffness",
            Self::NotFinite { .. } => "no-finite-stiffness",
            Self::NotPhysical { .. } => "not-physical",
            Self::Closure { .. } => "closure",
            Self::CouplingNotEstablished => "coupling-not-established",
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Negative { parameter, value } => write!(
                f,
                "{parameter} came out negative ({value:.4}): no spring does that, so the frequencies \
                 or the model are wrong"
            ),
            Self::NotFinite { parameter } => write!(
                f,
                "{parameter} has no finite value: the frequencies do not feel that spring"
            ),
            Self::NotPhysical { kz, limit } => write!(
                f,
                "no joint has these three stiffnesses: |kz| = {:.4} should exceed \
                 sqrt(kx ky) = {limit:.4}",
                kz.abs()
            ),
            Self::Closure { closure } => write!(
                f,
                "the pair regression does not satisfy its own frequency equation: the product it \
                 implies differs by {:.1} % from that of its estimates",
                100.0 * closure
            ),
            Self::CouplingNotEstablished => write!(
                f,
                "the interval of the coupling contains zero: kz may be infinite, of either sign"
            ),
        }
    }
}
