//! Hammer pulses in closed form, so that whatever they drive can be integrated exactly.

use std::f64::consts::PI;

use num_complex::Complex64;

/// Form of a pulse of length w that begins at 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PulseShape {
    /// peak sin^2(pi t/w): between a half sine and what a force sensor shows of a hard tip. Its spectrum
    /// has fallen by 6 dB at 1/w and vanishes first at 2/w.
    SineSquared,
    /// peak sin^4(pi t/w): the bell of a soft tip. Its spectrum has fallen by 6 dB at 1.44/w and
    /// vanishes first at 3/w.
    SineFourth,
}

impl PulseShape {
    /// The shape as a sum of a cos(2 pi n t/w): the factors a for n = 0, 1, 2.
    /// sin^2 x = 1/2 - cos(2x)/2, sin^4 x = 3/8 - cos(2x)/2 + cos(4x)/8.
    fn cosines(self) -> [f64; 3] {
        match self {
            Self::SineSquared => [0.5, -0.5, 0.0],
            Self::SineFourth => [0.375, -0.5, 0.125],
        }
    }

    /// Frequency (Hz) up to which a pulse of this `length` (s) excites, where its spectrum has fallen
    /// by 6 dB.
    pub fn half_amplitude_frequency(self, length: f64) -> f64 {
        match self {
            Self::SineSquared => 1.0 / length,
            Self::SineFourth => 1.44 / length,
        }
    }
}

/// One pulse of force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    /// When it begins (s).
    pub start: f64,
    /// How long it lasts (s).
    pub length: f64,
    /// Its peak (N).
    pub peak: f64,
    /// Its form.
    pub shape: PulseShape,
}

impl Pulse {
    /// When it ends (s).
    pub fn end(&self) -> f64 {
        self.start + self.length
    }

    fn covers(&self, time: f64) -> bool {
        self.start < time && time < self.end()
    }

    /// Force (N) and its first and second derivative (N/s, N/s2) at a time (s).
    pub fn force(&self, time: f64) -> [f64; 3] {
        if !self.covers(time) {
            return [0.0; 3];
        }
        let mut sum = [0.0; 3];
        for (n, factor) in self.shape.cosines().into_iter().enumerate() {
            let omega = self.omega(n);
            let (sine, cosine) = (omega * (time - self.start)).sin_cos();
            let amplitude = self.peak * factor;
            sum[0] += amplitude * cosine;
            sum[1] -= amplitude * omega * sine;
            sum[2] -= amplitude * omega * omega * cosine;
        }
        sum
    }

    /// Angular frequency (rad/s) of the n-th cosine.
    fn omega(&self, n: usize) -> f64 {
        2.0 * PI * n as f64 / self.length
    }

    /// What the pulse leaves in z' = pole z + F at the end of a step: the integral of
    /// e^{pole (to - s)} F(s) ds over `from`..`to` (s).
    pub(super) fn drive(&self, pole: Complex64, (from, to): (f64, f64)) -> Complex64 {
        let (begin, end) = (from.max(self.start), to.min(self.end()));
        if begin >= end {
            return Complex64::ZERO;
        }
        let (phase, span) = (begin - self.start, end - begin);
        let mut sum = Complex64::ZERO;
        for (n, factor) in self.shape.cosines().into_iter().enumerate() {
            let omega = self.omega(n);
            for exponent in [Complex64::I * omega, -Complex64::I * omega] {
                // cos = (e^{j omega t} + e^{-j omega t})/2; over the span the integral of
                // e^{pole (span - s)} e^{exponent s} ds = e^{pole span} span (e^x - 1)/x,
                // x = (exponent - pole) span.
                let x = (exponent - pole) * span;
                sum += 0.5 * factor * (exponent * phase).exp() * growth(x);
            }
        }
        // After the pulse's end the state moves on freely.
        self.peak * span * (pole * (to - end + span)).exp() * sum
    }
}

/// (e^x - 1)/x, also where x is small.
fn growth(x: Complex64) -> Complex64 {
    if x.norm_sqr() > 0.01 {
        return (x.exp() - 1.0) / x;
    }
    // The series' ninth term is below 1e-15 at |x| = 0.1.
    let mut term = Complex64::ONE;
    let mut sum = term;
    for n in 2..10 {
        term *= x / f64::from(n);
        sum += term;
    }
    sum
}
