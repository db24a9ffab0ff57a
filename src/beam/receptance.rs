//! End functions of the uniform beam and the receptances made of them (Bishop & Johnson 1960).
//!
//! With sin, cos, sinh, cosh of lambda: F1 = sin sinh, F3 = cos cosh - 1, F4 = cos cosh + 1,
//! F5 = cos sinh - sin cosh, F6 = cos sinh + sin cosh. Here they are divided by the power of
//! lambda with which they start, so that none cancels or vanishes at low frequency, and by
//! e^lambda, so that none overflows at high frequency. Their ratios are what the theory needs.

use super::Slenderness;
use super::timoshenko;
use std::f64::consts::PI;

/// Below this lambda (1) power series replace products of circular and hyperbolic functions,
/// which cancel there: cos cosh - 1 = -lambda^4/6 has lost one digit at 1 and all at 1e-4.
pub(super) const SERIES_BELOW: f64 = 1.0;

/// The end functions of a beam at one frequency, all multiplied by the same positive number.
///
/// Shear and rotary inertia, where the beam has them, are included: each function belongs to a
/// beam with one free end and vanishes at the natural frequencies named.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndFunctions {
    /// Non-dimensional frequency lambda (1).
    pub lambda: f64,
    /// F1 / lambda^2 (1): no supports of its own; couples translation and rotation.
    pub f1: f64,
    /// F3 / lambda^4 (1): free at the other end too.
    pub f3: f64,
    /// F4 (1): clamped at the other end.
    pub f4: f64,
    /// F5 / lambda^3 (1): pinned at the other end.
    pub f5: f64,
    /// F6 / lambda (1): guided (no rotation) at the other end.
    pub f6: f64,
    /// How many natural frequencies of the beam pinned at both ends lie below lambda.
    pub pinned_pinned_count: usize,
}

impl EndFunctions {
    /// The end functions at `lambda` (1), positive and finite, of a beam of this slenderness.
    pub fn new(lambda: f64, slenderness: &Slenderness) -> Self {
        match (slenderness.is_euler(), lambda < SERIES_BELOW) {
            (true, true) => euler_series(lambda),
            (true, false) => euler_closed_form(lambda),
            (false, true) => timoshenko::series(lambda, slenderness),
            (false, false) => timoshenko::closed_form(lambda, slenderness),
        }
    }

    /// Of an Euler beam.
    pub fn euler(lambda: f64) -> Self {
        Self::new(lambda, &Slenderness::EULER)
    }

    /// Displacement per force at one end of the free beam, in units of L^3/(E I):
    /// eta11 = -F5 / (lambda^3 F3).
    pub fn eta11(&self) -> f64 {
        -self.f5 / (self.lambda.powi(4) * self.f3)
    }

    /// Rotation per force, or displacement per moment, in units of L^2/(E I):
    /// eta12 = F1 / (lambda^2 F3). Its sign belongs to rotation = -dw/dx, x along the beam.
    pub fn eta12(&self) -> f64 {
        self.f1 / (self.lambda.powi(4) * self.f3)
    }

    /// Rotation per moment, in units of L/(E I): eta22 = F6 / (lambda F3).
    pub fn eta22(&self) -> f64 {
        self.f6 / (self.lambda.powi(4) * self.f3)
    }

    /// Number of natural frequencies below lambda of the beam clamped at the near end and free at
    /// the far end.
    ///
    /// Counted from the pinned-pinned beam, whose frequencies are known in closed form, by
    /// changing one support at a time: releasing the far end's translation adds one where its
    /// dynamic stiffness (sign of F5 over that of the pinned-pinned function) is negative;
    /// clamping the near end's rotation removes one where its dynamic stiffness lambda F5/F4 is.
    /// This is the count of Wittrick & Williams 1971 for one degree of freedom at a time.
    pub fn clamped_free_count(&self) -> usize {
        let pinned_pinned_negative = self.pinned_pinned_count % 2 == 1;
        let released = usize::from((self.f5 < 0.0) != pinned_pinned_negative);
        let pinned_free = self.pinned_pinned_count + released;
        let clamped = usize::from((self.f5 < 0.0) != (self.f4 < 0.0));
        pinned_free.saturating_sub(clamped)
    }
}

/// Closed form for an Euler beam: products of functions scaled by e^-lambda.
fn euler_closed_form(lambda: f64) -> EndFunctions {
    let (sine, cosine) = lambda.sin_cos();
    let decay = (-lambda).exp();
    let cosh = 0.5 * (1.0 + decay * decay);
    let sinh = 0.5 * (1.0 - decay * decay);
    let square = lambda * lambda;
    EndFunctions {
        lambda,
        f1: sine * sinh / square,
        f3: (cosine * cosh - decay) / (square * square),
        f4: cosine * cosh + decay,
        f5: (cosine * sinh - sine * cosh) / (square * lambda),
        f6: (cosine * sinh + sine * cosh) / lambda,
        pinned_pinned_count: (lambda / PI) as usize,
    }
}

/// Power series for an Euler beam at low frequency, with q = -4 lambda^4:
/// cos cosh = sum q^k/(4k)!, sin sinh = 2 lambda^2 sum q^k/(4k+2)!,
/// cos sinh + sin cosh = 2 lambda sum q^k/(4k+1)!,
/// cos sinh - sin cosh = -4 lambda^3 sum q^k/(4k+3)!.
fn euler_series(lambda: f64) -> EndFunctions {
    let q = -4.0 * lambda.powi(4);
    let decay = (-lambda).exp();
    // cos cosh - 1 = q (1/4! + q/8! + ...), hence the sum that starts at 4!.
    EndFunctions {
        lambda,
        f1: 2.0 * decay * sparse_series(q, 2),
        f3: -4.0 * decay * sparse_series(q, 4),
        f4: decay * (2.0 + q * sparse_series(q, 4)),
        f5: -4.0 * decay * sparse_series(q, 3),
        f6: 2.0 * decay * sparse_series(q, 1),
        pinned_pinned_count: 0,
    }
}

/// sum over k of q^k / (4k + first)!, for |q| <= 4, to the last digit.
fn sparse_series(q: f64, first: u32) -> f64 {
    // At |q| = 4 the fifth term is below 1e-17 of the first.
    const TERMS: u32 = 5;
    let mut term = 1.0 / f64::from((1..=first).product::<u32>());
    let mut sum = term;
    for k in 1..TERMS {
        let start = 4 * (k - 1) + first;
        let factors: f64 = (1..=4).map(|i| f64::from(start + i)).product();
        term *= q / factors;
        sum += term;
    }
    sum
}
