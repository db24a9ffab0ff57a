//! A mode whose pole drifts, and lines beside it: a sum of exponentials, and its fit by least squares.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use tapjoint_numerics::least_squares::{Linearised, Problem, Settings, minimise};

use super::band::Band;

/// x(t) = c e^{q1 t + q2 v + q3 v^2 + ...} + sum over k of c_k e^{p_k t}, v(t) = 1 - e^{-rate t}.
///
/// A frequency that changes with a power of the amplitude changes exponentially in time, so powers of
/// v describe it with few terms where powers of t would not. The parameters enter analytically: least
/// squares may treat them as complex numbers.
#[derive(Debug, Clone)]
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
    /// Returns the parameters: amplitude, exponents, then amplitude and pole of every other.
    pub fn parameters(&self) -> Vec<Complex64> {
        let mut all = vec![self.amplitude];
        all.extend(&self.exponents);
        all.extend(self.others.iter().flat_map(|(c, p)| [*c, *p]));
        all
    }

    /// Returns the pole at a time: the derivative of the mode's exponent.
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

    /// Returns q1 t + q2 v + q3 v^2 + ..., the powers by Horner's scheme.
    pub fn exponent(&self, t: f64) -> Complex64 {
        let v = 1.0 - (-self.rate * t).exp();
        let drift = self.exponents.iter().skip(1).rev();
        let drift = drift.fold(Complex64::ZERO, |sum, q| (sum + q) * v);
        self.exponents.first().copied().unwrap_or_default() * t + drift
    }

    /// Returns the value at a time. `derivatives` are those to the parameters, in their order.
    fn value(&self, t: f64, derivatives: &mut Vec<Complex64>) -> Complex64 {
        derivatives.clear();
        let growth = self.exponent(t).exp();
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
}

impl Exponentials {
    /// Log of the mode's amplitude at a time, the filter's gain taken out.
    pub fn log_amplitude(&self, t: f64, band: &Band) -> f64 {
        let gain = band.gain(self.pole(t)).norm();
        self.amplitude.norm().ln() + self.exponent(t).re - gain.ln()
    }

    /// Returns the time at which the mode's amplitude falls to one; `None` where it does not within the filter's first
    /// half and `last`.
    pub fn time_at(&self, amplitude: f64, last: f64, band: &Band) -> Option<f64> {
        const PARTS: usize = 200;
        let first = -0.5 * band.filter;
        let above = |t: f64| self.log_amplitude(t, band) > amplitude.ln();
        let time = |part: usize| first + (last - first) * part as f64 / PARTS as f64;
        let part = (0..=PARTS).find(|part| !above(time(*part)))?;
        let (mut early, mut late) = (time(part.checked_sub(1)?), time(part));
        for _ in 0..50 {
            let middle = 0.5 * (early + late);
            match above(middle) {
                true => early = middle,
                false => late = middle,
            }
        }
        Some(late)
    }

    /// Derivative of the pole with time (1/s^2).
    fn turn(&self, t: f64) -> Complex64 {
        let step = 1e-3 / self.rate;
        (self.pole(t + step) - self.pole(t - step)) / (2.0 * step)
    }
}

impl Fit {
    /// Variance of the noise about the mode's frequency.
    ///
    /// Residuals that agree with their neighbours (correlation r) are what the model misses. They leave (1 - r)/(1 + r)
    /// of the values' information. By chance the standard deviation of r is 1/sqrt(2n) with n complex values.
    pub fn variance(&self, band: &Band) -> f64 {
        let count = self.residuals.len() as f64;
        let freedom = (count - self.right.len() as f64).max(1.0);
        let pairs = self.residuals.windows(2);
        let products: f64 = pairs.map(|r| (r[0].conj() * r[1]).re).sum();
        let agreement = products / self.squares.max(f64::MIN_POSITIVE);
        let agreement = (agreement - CHANCE / (2.0 * count).sqrt()).clamp(0.0, 0.9);
        self.squares / freedom * band.noise_ratio * (1.0 + agreement) / (1.0 - agreement)
    }

    /// Returns the frequency (Hz) where the mode's amplitude is the given one, and its standard uncertainty.
    ///
    /// With g the derivatives of the pole p to the parameters, h those of the logarithm of the mode and p' the pole's
    /// own in time, the frequency |p| changes by Re(conj(p) dp)/|p|, and the time of the amplitude by -Re(h)/Re(p).
    pub fn frequency_at(&self, amplitude: f64, band: &Band) -> Option<(f64, f64)> {
        let model = &self.model;
        let last = band.step * self.residuals.len() as f64;
        let t = model.time_at(amplitude, last, band)?;
        let own = model.pole(t);
        let pole = Complex64::new(own.re, own.im + band.omega);
        let modulus = pole.norm();
        let turning = (pole.conj() * model.turn(t)).re / modulus / own.re;
        let fall = (-model.rate * t).exp();
        let v = 1.0 - fall;
        let mut row = vec![Complex64::ZERO; self.right.len()];
        row[0] = -Complex64::i() * turning / model.amplitude;
        for place in 0..model.exponents.len() {
            let (of_pole, of_log) = match place {
                0 => (1.0, t),
                _ => (
                    place as f64 * v.powi(place as i32 - 1) * model.rate * fall,
                    v.powi(place as i32),
                ),
            };
            row[1 + place] = Complex64::i() * (pole.conj() / modulus * of_pole - turning * of_log);
        }
        let inverse = self.inverse()?;
        let mut variance = Complex64::ZERO;
        for (i, a) in row.iter().enumerate() {
            for (k, b) in row.iter().enumerate() {
                variance += a * inverse[(i, k)] * b.conj();
            }
        }
        let std = (0.5 * self.variance(band) * variance.re.max(0.0)).sqrt();
        Some((modulus / TAU, std / TAU))
    }
}

/// A parameter known beforehand: index, value, and 1/variance (of both parts together).
#[derive(Debug, Clone, Copy)]
pub(super) struct Prior {
    pub parameter: usize,
    pub value: Complex64,
    pub weight: f64,
}

/// Standard deviations by which a correlation of residuals counts as chance.
const CHANCE: f64 = 1.0;
/// Most steps of a fit.
const STEPS: usize = 25;
/// Share of the sum of squares at which another step gains nothing.
const SETTLED: f64 = 1e-7;
/// Values beyond this are no amplitude any more.
const LARGEST: f64 = 1e100;

/// Fits a model to values at times; `None` where the start has no finite value.
///
/// Priors take the noise variance as 1: scale their weights by it.
pub(super) fn fit_exponentials(
    times: &[f64],
    values: &[Complex64],
    start: Exponentials,
    priors: &[Prior],
) -> Option<Fit> {
    let parameters: Vec<f64> = start
        .parameters()
        .iter()
        .flat_map(|x| [x.re, x.im])
        .collect();
    let problem = ExponentialFit {
        times,
        values,
        terms: start,
        priors,
    };
    let settings = Settings {
        steps: STEPS,
        gain: 0.0,
        relative_gain: SETTLED,
        first_damping: 1e-3,
        damping: 1e6,
        ..Settings::default()
    };
    Some(minimise(&problem, &parameters, &settings)?.state)
}

/// Least squares of a sum of exponentials. Its parameters are the real and imaginary parts of the model's.
struct ExponentialFit<'a> {
    times: &'a [f64],
    values: &'a [Complex64],
    /// A model with the terms that are fitted.
    terms: Exponentials,
    priors: &'a [Prior],
}

/// A model, its residuals and the normal equations of the next step.
pub(super) struct Fit {
    pub model: Exponentials,
    /// J^H J + priors, J being the model's complex derivatives.
    normal: DMatrix<Complex64>,
    /// J^H r + priors.
    pub right: DVector<Complex64>,
    pub residuals: Vec<Complex64>,
    /// Sum of the squared residuals.
    pub squares: f64,
    /// Sum of squares of the deviations from the priors.
    prior_squares: f64,
}

impl Fit {
    /// Returns (J^H J + priors)^-1, which times the noise variance is the parameters' covariance; `None`
    /// where the unknowns cannot be separated.
    pub fn inverse(&self) -> Option<DMatrix<Complex64>> {
        // Scaled to a unit diagonal: amplitudes and poles differ by orders of magnitude.
        let scale = (self.normal.diagonal()).map(|x| x.re.max(f64::MIN_POSITIVE).sqrt());
        let scales = &scale * scale.transpose();
        let inverse = self
            .normal
            .zip_map(&scales, |x, scale| x / scale)
            .try_inverse()?;
        Some(inverse.zip_map(&scales, |x, scale| x / scale))
    }
}

impl Problem for ExponentialFit<'_> {
    type State = Fit;

    fn evaluate(&self, parameters: &[f64], _: Option<&Self::State>) -> Option<Self::State> {
        let parts = parameters.chunks_exact(2);
        let all: Vec<Complex64> = parts.map(|part| Complex64::new(part[0], part[1])).collect();
        let (mode, others) = all.split_at(1 + self.terms.exponents.len());
        let model = Exponentials {
            amplitude: mode[0],
            exponents: mode[1..].to_vec(),
            rate: self.terms.rate,
            others: others.chunks_exact(2).map(|x| (x[0], x[1])).collect(),
        };
        let size = all.len();
        let mut products = vec![Complex64::ZERO; size * size];
        let mut right = DVector::zeros(size);
        let (mut squares, mut prior_squares) = (0.0, 0.0);
        let mut row = Vec::with_capacity(size);
        let mut residuals = Vec::with_capacity(self.times.len());
        for (t, value) in self.times.iter().zip(self.values) {
            let residual = value - model.value(*t, &mut row);
            squares += residual.norm_sqr();
            residuals.push(residual);
            for ((i, a), sums) in row.iter().enumerate().zip(products.chunks_mut(size)) {
                let a = a.conj();
                right[i] += a * residual;
                for (sum, b) in sums.iter_mut().zip(&row[..=i]) {
                    *sum += a * b;
                }
            }
        }
        // Only the lower triangle was summed; the matrix is Hermitian.
        let mut normal = DMatrix::from_fn(size, size, |i, k| {
            if k <= i {
                products[i * size + k]
            } else {
                products[k * size + i].conj()
            }
        });
        let current = model.parameters();
        for prior in self.priors {
            let k = prior.parameter;
            let away = prior.value - current[k];
            normal[(k, k)] += prior.weight;
            right[k] += away * prior.weight;
            prior_squares += away.norm_sqr() * prior.weight;
        }
        (squares + prior_squares < LARGEST).then_some(Fit {
            model,
            normal,
            right,
            residuals,
            squares,
            prior_squares,
        })
    }

    fn cost(&self, state: &Self::State) -> f64 {
        0.5 * (state.squares + state.prior_squares)
    }

    /// With a step x + j y, J (x + j y) has the real parts Re J x - Im J y and the imaginary parts
    /// Im J x + Re J y. The curvature of the real problem is therefore J^H J with each entry a + j b as
    /// the block (a, -b; b, a).
    fn linearise(&self, _: &[f64], state: &mut Self::State) -> Option<Linearised> {
        let size = 2 * state.right.len();
        Some(Linearised::Normal {
            curvature: DMatrix::from_fn(size, size, |i, k| {
                let entry = state.normal[(i / 2, k / 2)];
                match (i % 2, k % 2) {
                    (0, 1) => -entry.im,
                    (1, 0) => entry.im,
                    _ => entry.re,
                }
            }),
            gradient: DVector::from_fn(size, |i, _| {
                let entry = state.right[i / 2];
                -if i % 2 == 0 { entry.re } else { entry.im }
            }),
        })
    }
}
