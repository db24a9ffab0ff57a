//! Sums of complex exponentials, the first with a drifting pole: values and derivatives.

use num_complex::Complex64;

/// x(t) = c e^{q1 t + q2 t^2 + ...} + sum over k of c_k e^{p_k t}.
///
/// The parameters enter analytically, so least squares may treat them as complex numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Exponentials {
    /// Amplitude of the mode.
    pub amplitude: Complex64,
    /// Its exponents q1, q2, ... (1/s, 1/s^2, ...); one alone is a pole that does not change.
    pub exponents: Vec<Complex64>,
    /// Amplitude and pole (rad/s) of everything else.
    pub others: Vec<(Complex64, Complex64)>,
}

impl Exponentials {
    /// Number of complex parameters.
    pub fn parameters(&self) -> usize {
        1 + self.exponents.len() + 2 * self.others.len()
    }

    /// The mode alone.
    pub fn mode(&self, t: f64) -> Complex64 {
        self.amplitude * self.growth(t)
    }

    fn growth(&self, t: f64) -> Complex64 {
        // Horner's scheme for t (q1 + t (q2 + ...)).
        let exponent = self
            .exponents
            .iter()
            .rev()
            .fold(Complex64::ZERO, |sum, q| (sum + q) * t);
        exponent.exp()
    }

    /// The value at a time, and its derivatives: amplitude, exponents, then amplitude and pole of
    /// every other.
    pub fn value(&self, t: f64, derivatives: &mut Vec<Complex64>) -> Complex64 {
        derivatives.clear();
        let growth = self.growth(t);
        let mut sum = self.amplitude * growth;
        derivatives.push(growth);
        let mut power = self.amplitude * growth;
        for _ in &self.exponents {
            power *= t;
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
            others: self
                .others
                .iter()
                .map(|(c, p)| (c + next(), p + next()))
                .collect(),
        }
    }
}
