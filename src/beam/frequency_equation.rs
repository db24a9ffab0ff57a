//! The frequency equation of a beam with one free end and a joint at the other.
//!
//! Substructure synthesis (Ingole & Chatterjee, eq. 10) with the joint's compliance
//! delta = `[[a, c], [c, b]]`, a = 1/Kx, b = 1/Ky, c = 1/Kz, and the beam's receptances:
//!
//! ```text
//! (a + eta11)(b + eta22) - (c + eta12)^2 = 0, multiplied by F3:
//! (ab - c^2) F3 + a F6/lambda - b F5/lambda^3 - 2c F1/lambda^2 - F4/lambda^4 = 0.
//! ```
//!
//! Multiplied by Kx Ky/((1 + Kx)(1 + Ky)) every coefficient stays between -1 and 1, whatever the
//! stiffness, and both limits (no spring, rigid) are ordinary numbers.

use super::receptance::EndFunctions;
use super::{JointStiffness, Slenderness};

/// A beam with its far end free and its near end held by a joint; lengths in units of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RootedBeam {
    slenderness: Slenderness,
    /// Stiffness and compliance of the translation, K/(1 + |K|) and 1/(1 + |K|).
    x: Spring,
    /// The same of the rotation.
    y: Spring,
    /// Cross compliance 1/Kz.
    cross: f64,
    /// (ab - c^2), scaled: cx cy - c^2 sx sy.
    product: f64,
}

/// A spring as a pair (stiffness, compliance) of which at most one is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spring {
    stiffness: f64,
    compliance: f64,
}

impl Spring {
    fn new(stiffness: f64) -> Self {
        if stiffness.is_infinite() {
            return Self {
                stiffness: 1.0,
                compliance: 0.0,
            };
        }
        let compliance = 1.0 / (1.0 + stiffness.abs());
        Self {
            stiffness: stiffness * compliance,
            compliance,
        }
    }
}

/// The frequency equation at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluation {
    /// Scaled value of the frequency equation (1); zero at a natural frequency.
    pub value: f64,
    /// Number of natural frequencies below, rigid-body motions and any unstable ones included.
    pub count: usize,
}

impl RootedBeam {
    /// A beam of this slenderness on this joint, whose stiffnesses are in units of the beam's own
    /// length. Any real stiffness is taken, negative and unphysical ones included.
    pub fn new(joint: &JointStiffness, slenderness: Slenderness) -> Self {
        let (x, y) = (Spring::new(joint.kx), Spring::new(joint.ky));
        let cross = joint.cross_compliance;
        let coupled = cross * cross * x.stiffness * y.stiffness;
        Self {
            slenderness,
            x,
            y,
            cross,
            product: x.compliance * y.compliance - coupled,
        }
    }

    /// The scaled frequency equation at `lambda` (1), positive.
    pub fn frequency_equation(&self, lambda: f64) -> f64 {
        self.value(&EndFunctions::new(lambda, &self.slenderness))
    }

    /// The frequency equation and the number of natural frequencies below `lambda` (1), positive.
    pub fn evaluate(&self, lambda: f64) -> Evaluation {
        let ends = EndFunctions::new(lambda, &self.slenderness);
        let value = self.value(&ends);
        Evaluation {
            value,
            count: ends.clamped_free_count() + self.negative_pivots(&ends, value),
        }
    }

    fn value(&self, ends: &EndFunctions) -> f64 {
        let (x, y) = (self.x, self.y);
        let square = ends.lambda * ends.lambda;
        let both = (x.stiffness / square) * (y.stiffness / square);
        self.product * square * square * ends.f3 + x.compliance * y.stiffness * ends.f6
            - x.stiffness * y.compliance * ends.f5
            - 2.0 * self.cross * x.stiffness * y.stiffness * ends.f1
            - both * ends.f4
    }

    /// Negative eigenvalues of the dynamic stiffness at the joint, S + D (Wittrick & Williams
    /// 1971): S is the inverse of the joint's compliance and D that of the beam's receptance,
    /// D11 = -lambda^3 F6/F4, D22 = lambda F5/F4, det(S + D) = -value lambda^4/(product F4) > 0
    /// up to positive factors.
    fn negative_pivots(&self, ends: &EndFunctions, value: f64) -> usize {
        let sign = if self.product < 0.0 { -1.0 } else { 1.0 };
        if (sign * value > 0.0) == (ends.f4 >= 0.0) && value != 0.0 {
            return 1;
        }
        // The determinant is positive, so that both diagonal terms have the same sign.
        let inertia = self.product.abs() * ends.lambda.powi(4) / ends.f4;
        let translation = sign * self.x.stiffness * self.y.compliance - inertia * ends.f6;
        let rotation = sign * self.x.compliance * self.y.stiffness + inertia * ends.f5;
        if translation + rotation < 0.0 { 2 } else { 0 }
    }

    /// How many natural motions do not count: rigid-body motions at zero frequency (one for each
    /// spring of exactly zero stiffness) and the unstable ones of an unphysical joint.
    pub fn uncounted(&self) -> usize {
        let springs = [self.x.stiffness, self.y.stiffness];
        let zero = springs
            .iter()
            .filter(|&&stiffness| stiffness == 0.0)
            .count();
        let unstable = match zero {
            0 => self.unstable(),
            _ => springs.iter().filter(|&&stiffness| stiffness < 0.0).count(),
        };
        zero + unstable
    }

    /// Negative eigenvalues of the joint's stiffness matrix, where neither spring is missing.
    fn unstable(&self) -> usize {
        let sign = if self.product < 0.0 { -1.0 } else { 1.0 };
        if sign * self.x.stiffness * self.y.stiffness < 0.0 {
            1
        } else if sign * (self.x.stiffness + self.y.stiffness) < 0.0 {
            2
        } else {
            0
        }
    }
}
