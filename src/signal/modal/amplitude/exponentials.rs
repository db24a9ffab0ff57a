//! Sums of complex exponentials, the first with a drifting pole: values and derivatives.

use num_complex::Complex64;

/// x(t) = c e^{q1 t + q2 v + q3 v^2 + ...} + sum over k of c_k e^{p_k t}, v(t) = 1 - e^{-rate t}.
///
/// A frequency that changes with a power of the amplitude changes exponentially in time, so powers of
/// v describe it with few terms where powers of t would not. The parameters enter analytically: least
/// squares may treat them as complex numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Exponentials {
    /// Amplitude of the mode.
    pub amplitude: Complex64,
    /// Its exponents q1 (1/s), q2, q3, ... (1); the first alone is a pole that does not change.
    pub exponents: Vec<Complex64>,
    /// Rate of v (1/s).
    pub rate: f64,
    /// Amplitude and pole (rad/s) of everything else.
    pub others: Vec<(Complex64, Complex64)>,
}

impl Exponentials {
    /// Number of complex parameters.
    pub fn parameters(&self) -> usize {
        1 + self.exponents.len() + 2 * self.others.len()
    }

    /// The pole at a time: the derivative of the mode's exponent.
    pub fn pole(&self, t: f64) -> Complex64 {
        let fall = (-self.rate * t).exp();
        let v = 1.0 - fall;
        let mut power = self.rate * fall;
        let mut sum = self.exponents.first().copied().unwrap_or_default();
        for (k, q) in self.exponents.iter().skip(1).enumerate() {
            // d/dt of q v^(k+1).
            sum += q * power * (k + 1) as f64;
            power *= v;
        }
        sum
    }

    /// The mode's exponent at `t + s` without its value and slope at t, for a short s: what bends.
    pub fn bend(&self, t: f64, s: f64) -> Complex64 {
        self.exponent(t + s) - self.exponent(t) - self.pole(t) * s
    }

    fn growth(&self, t: f64) -> Complex64 {
        self.exponent(t).exp()
    }

    /// q1 t + q2 v + q3 v^2 + ..., the powers by Horner's scheme.
    fn exponent(&self, t: f64) -> Complex64 {
        let v = 1.0 - (-self.rate * t).exp();
        let drift = self.exponents.iter().skip(1).rev();
        let drift = drift.fold(Complex64::ZERO, |sum, q| (sum + q) * v);
        self.exponents.first().copied().unwrap_or_default() * t + drift
    }

    /// The value at a time, and its derivatives: amplitude, exponents, then amplitude and pole of
    /// every other.
    pub fn value(&self, t: f64, derivatives: &mut Vec<Complex64>) -> Complex64 {
        derivatives.clear();
        let growth = self.growth(t);
        let mut sum = self.amplitude * growth;
        derivatives.push(growth);
        derivatives.push(sum * t);
        let v = 1.0 - (-self.rate * t).exp();
        let mut power = sum;
        for _ in self.exponents.iter().skip(1) {
            power *= v;
            derivatives.push(power);
        }
        for (amplitude, pole) in &self.others {
            let growth = (pole * t).exp();
            sum += amplitude * growth;
            derivatives.push(growth);
            derivatives.push(amplitude * growth * t);
        }
        sum
    }

    /// All parameters changed by a step in the order of the derivatives.
    pub fn moved(&self, step: &[Complex64]) -> Exponentials {
        let mut step = step.iter().copied();
        let mut next = || step.next().unwrap_or(Complex64::ZERO);
        Exponentials {
            amplitude: self.amplitude + next(),
            exponents: self.exponents.iter().map(|q| q + next()).collect(),
            rate: self.rate,
            others: self
                .others
                .iter()
                .map(|(c, p)| (c + next(), p + next()))
                .collect(),
        }
    }
}
