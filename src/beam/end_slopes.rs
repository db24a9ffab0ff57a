//! How the end functions change with frequency, in closed form.

use super::Slenderness;
use super::receptance::EndFunctions;

/// Derivatives of the end functions with lambda, multiplied by the same positive number as the
/// functions themselves, whose own change with lambda is left out: it takes part in no ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndSlopes {
    /// Of F1/lambda^2 (1).
    pub f1: f64,
    /// Of F3/lambda^4 (1).
    pub f3: f64,
    /// Of F4 (1).
    pub f4: f64,
    /// Of F5/lambda^3 (1).
    pub f5: f64,
    /// Of F6/lambda (1).
    pub f6: f64,
}

impl EndSlopes {
    /// Of these end functions, which belong to a beam of this slenderness.
    pub fn of(ends: &EndFunctions, slenderness: &Slenderness) -> Self {
        if slenderness.is_euler() {
            euler(ends)
        } else {
            super::timoshenko::slopes(ends.lambda, slenderness)
        }
    }
}

/// Bishop's functions are each other's derivatives: F1' = F6, F3' = F4' = F5, F5' = -2 F1 and
/// F6' = F3 + F4; the powers of lambda follow by the quotient rule.
fn euler(ends: &EndFunctions) -> EndSlopes {
    let lambda = ends.lambda;
    let square = lambda * lambda;
    EndSlopes {
        f1: (ends.f6 - 2.0 * ends.f1) / lambda,
        f3: (ends.f5 - 4.0 * ends.f3) / lambda,
        f4: square * lambda * ends.f5,
        f5: (-2.0 * ends.f1 - 3.0 * ends.f5) / lambda,
        f6: (square * square * ends.f3 + ends.f4 - ends.f6) / lambda,
    }
}
