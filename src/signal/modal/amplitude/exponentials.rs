//! A mode whose pole drifts, and lines beside it: a sum of exponentials, and its fit by least squares.

use std::cmp::Ordering;
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

    /// Returns q1 t + q2 v + q3 v^2 + ...
    pub fn exponent(&self, t: f64) -> Complex64 {
        let v = 1.0 - (-self.rate * t).exp();
        self.exponents.first().copied().unwrap_or_default() * t + self.drift(v)
    }

    /// Returns q2 v + q3 v^2 + ..., by Horner's scheme.
    fn drift(&self, v: f64) -> Complex64 {
        let drift = self.exponents.iter().skip(1).rev();
        drift.fold(Complex64::ZERO, |sum, q| (sum + q) * v)
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
        let excess = |t: f64| self.log_amplitude(t, band) - amplitude.ln();
        let time = |part: usize| first + (last - first) * part as f64 / PARTS as f64;
        let part = (0..=PARTS).find(|part| {
            let order = excess(time(*part)).partial_cmp(&0.0);
            order != Some(Ordering::Greater)
        })?;
        let (mut early, mut late) = (time(part.checked_sub(1)?), time(part));
        let mut t = late;
        for _ in 0..50 {
            let excess = excess(t);
            match excess > 0.0 {
                true => early = t,
                false => late = t,
            }
            // The filter's gain hardly changes: Newton's step with the decay alone, and the middle where it leads astray.
            let newton = t - excess / self.pole(t).re;
            let is_within = early < newton && newton < late;
            let next = if is_within {
                newton
            } else {
                0.5 * (early + late)
            };
            if (next - t).abs() <= f64::EPSILON * (last - first) {
                break;
            }
            t = next;
        }
        Some(t)
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

/// Times from one exponential anew to the next: in between their rounding grows to sixteen times its own.
const ANEW: usize = 16;

/// Equally spaced times.
#[derive(Debug, Clone, Copy)]
pub(super) struct Times {
    /// The first (s).
    pub first: f64,
    /// Distance of two (s).
    pub step: f64,
    /// Number of times.
    pub count: usize,
}

impl Times {
    fn at(&self, n: usize) -> f64 {
        self.first + n as f64 * self.step
    }

    /// Returns e^{pole t} at every time, as a geometric sequence.
    pub fn exponentials(&self, pole: Complex64) -> Vec<Complex64> {
        let step = (pole * self.step).exp();
        let mut all = Vec::with_capacity(self.count);
        let mut value = Complex64::ONE;
        for n in 0..self.count {
            value = match n % ANEW {
                0 => (pole * self.at(n)).exp(),
                _ => value * step,
            };
            all.push(value);
        }
        all
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
    times: Times,
    values: &[Complex64],
    start: Exponentials,
    priors: &[Prior],
) -> Option<Fit> {
    let parameters: Vec<f64> = start
        .parameters()
        .iter()
        .flat_map(|x| [x.re, x.im])
        .collect();
    let falls = times.exponentials(Complex64::from(-start.rate));
    let problem = ExponentialFit {
        times,
        values,
        drifts: falls.into_iter().map(|fall| 1.0 - fall.re).collect(),
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
    Some(minimise(&problem, &parameters, &settings)?.state.fit)
}

/// Least squares of a sum of exponentials. Its parameters are the real and imaginary parts of the model's.
struct ExponentialFit<'a> {
    times: Times,
    values: &'a [Complex64],
    /// v at every time.
    drifts: Vec<f64>,
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

/// A fit, and what its slopes need besides.
struct Evaluation {
    fit: Fit,
    /// e to the exponent of the mode, then of everything else, at every time.
    growths: Vec<Vec<Complex64>>,
}

impl ExponentialFit<'_> {
    /// Returns e to the exponent of the mode, then of everything else, at every time.
    fn growths(&self, model: &Exponentials) -> Vec<Vec<Complex64>> {
        let pole = model.exponents.first().copied().unwrap_or_default();
        let mut growth = self.times.exponentials(pole);
        if model.exponents.len() > 1 {
            for (growth, v) in growth.iter_mut().zip(&self.drifts) {
                *growth *= model.drift(*v).exp();
            }
        }
        let others = model.others.iter();
        let others = others.map(|(_, pole)| self.times.exponentials(*pole));
        std::iter::once(growth).chain(others).collect()
    }

    /// Returns the derivatives of the model to its parameters at all times, one parameter after the other: the real
    /// parts, then the imaginary parts.
    fn derivatives(&self, model: &Exponentials, growths: &[Vec<Complex64>]) -> Vec<f64> {
        let size = 1 + model.exponents.len() + 2 * model.others.len();
        let mut all = Vec::with_capacity(2 * self.times.count * size);
        let mut put = |column: &[Complex64]| {
            all.extend(column.iter().map(|x| x.re));
            all.extend(column.iter().map(|x| x.im));
        };
        let others = model.others.iter().map(|(amplitude, _)| *amplitude);
        let amplitudes = std::iter::once(model.amplitude).chain(others);
        for (place, (amplitude, growth)) in amplitudes.zip(growths).enumerate() {
            put(growth);
            let mut term: Vec<Complex64> = growth.iter().map(|growth| amplitude * growth).collect();
            let timed = term.iter().enumerate();
            let timed: Vec<Complex64> = timed.map(|(n, x)| x * self.times.at(n)).collect();
            put(&timed);
            // The mode alone drifts.
            for _ in 1..if place == 0 { model.exponents.len() } else { 1 } {
                for (term, v) in term.iter_mut().zip(&self.drifts) {
                    *term *= v;
                }
                put(&term);
            }
        }
        all
    }
}

/// Returns the sum of the products of two slices, in eight sums at once.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (wide, narrow) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest = wide.remainder().iter().zip(narrow.remainder());
    let rest: f64 = rest.map(|(x, y)| x * y).sum();
    for (x, y) in wide.zip(narrow) {
        for lane in 0..8 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}

impl Problem for ExponentialFit<'_> {
    type State = Evaluation;

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
        let growths = self.growths(&model);
        let mut residuals = self.values.to_vec();
        let others = model.others.iter().map(|(amplitude, _)| *amplitude);
        for (amplitude, growth) in std::iter::once(model.amplitude).chain(others).zip(&growths) {
            for (residual, growth) in residuals.iter_mut().zip(growth) {
                *residual -= amplitude * growth;
            }
        }
        let squares: f64 = residuals.iter().map(Complex64::norm_sqr).sum();
        let away = self.priors.iter().map(|prior| {
            let away = prior.value - all[prior.parameter];
            away.norm_sqr() * prior.weight
        });
        let prior_squares: f64 = away.sum();
        (squares + prior_squares < LARGEST).then(|| Evaluation {
            fit: Fit {
                model,
                normal: DMatrix::zeros(all.len(), all.len()),
                right: DVector::zeros(all.len()),
                residuals,
                squares,
                prior_squares,
            },
            growths,
        })
    }

    fn cost(&self, state: &Self::State) -> f64 {
        0.5 * (state.fit.squares + state.fit.prior_squares)
    }

    /// With a step x + j y, J (x + j y) has the real parts Re J x - Im J y and the imaginary parts
    /// Im J x + Re J y. The curvature of the real problem is therefore J^H J with each entry a + j b as
    /// the block (a, -b; b, a).
    fn linearise(&self, _: &[f64], state: &mut Self::State) -> Option<Linearised> {
        let count = self.times.count;
        let derivatives = self.derivatives(&state.fit.model, &state.growths);
        let columns: Vec<&[f64]> = derivatives.chunks_exact((2 * count).max(1)).collect();
        // sum conj(a) b of two columns.
        let product = |a: &[f64], b: &[f64]| {
            let imaginary = dot(&a[..count], &b[count..]) - dot(&a[count..], &b[..count]);
            Complex64::new(dot(a, b), imaginary)
        };
        let fit = &mut state.fit;
        let parts = [|x: &Complex64| x.re, |x: &Complex64| x.im];
        let residuals = parts.map(|part| fit.residuals.iter().map(part)).into_iter();
        let residuals: Vec<f64> = residuals.flatten().collect();
        for (i, a) in columns.iter().enumerate() {
            fit.right[i] = product(a, &residuals);
            for (k, b) in columns[..=i].iter().enumerate() {
                fit.normal[(i, k)] = product(a, b);
                fit.normal[(k, i)] = fit.normal[(i, k)].conj();
            }
        }
        let current = fit.model.parameters();
        for prior in self.priors {
            let k = prior.parameter;
            fit.normal[(k, k)] += prior.weight;
            fit.right[k] += (prior.value - current[k]) * prior.weight;
        }
        let size = 2 * fit.right.len();
        Some(Linearised::Normal {
            curvature: DMatrix::from_fn(size, size, |i, k| {
                let entry = fit.normal[(i / 2, k / 2)];
                match (i % 2, k % 2) {
                    (0, 1) => -entry.im,
                    (1, 0) => entry.im,
                    _ => entry.re,
                }
            }),
            gradient: DVector::from_fn(size, |i, _| {
                let entry = fit.right[i / 2];
                -if i % 2 == 0 { entry.re } else { entry.im }
            }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mode that drifts, and a line beside it.
    fn model() -> Exponentials {
        Exponentials {
            amplitude: Complex64::new(0.8, -0.3),
            exponents: vec![Complex64::new(-3.0, 2.0), Complex64::new(0.1, 0.4)],
            rate: 1.5,
            others: vec![(Complex64::new(0.1, 0.2), Complex64::new(-2.0, 40.0))],
        }
    }

    const TIMES: Times = Times {
        first: -0.05,
        step: 0.01,
        count: 100,
    };

    fn values(model: &Exponentials) -> Vec<Complex64> {
        let times = (0..TIMES.count).map(|n| TIMES.at(n));
        times
            .map(|t| {
                let others = model.others.iter().map(|(c, p)| c * (p * t).exp());
                model.amplitude * model.exponent(t).exp() + others.sum::<Complex64>()
            })
            .collect()
    }

    #[test]
    fn prop_exponentials_are_those_of_every_time() {
        let pole = Complex64::new(-3.0, 250.0);
        for (n, value) in TIMES.exponentials(pole).iter().enumerate() {
            let exact = (pole * TIMES.at(n)).exp();
            // Sixteen roundings, and that of an exponent of 250.
            assert!((value / exact - 1.0).norm() < 1e-13, "{n}");
        }
    }

    #[test]
    fn prop_the_gradient_is_the_difference_of_the_cost() {
        let exact = values(&model());
        let mut start = model();
        start.amplitude *= 1.1;
        start.others[0].1 += Complex64::new(0.5, 1.0);
        let problem = ExponentialFit {
            times: TIMES,
            values: &exact,
            drifts: (0..TIMES.count)
                .map(|n| 1.0 - (-1.5 * TIMES.at(n)).exp())
                .collect(),
            terms: start.clone(),
            priors: &[Prior {
                parameter: 4,
                value: Complex64::new(-2.0, 41.0),
                weight: 0.1,
            }],
        };
        let parameters = start.parameters();
        let parameters: Vec<f64> = parameters.iter().flat_map(|x| [x.re, x.im]).collect();
        let mut state = problem.evaluate(&parameters, None).unwrap();
        let Some(Linearised::Normal { gradient, .. }) = problem.linearise(&parameters, &mut state)
        else {
            panic!("normal equations");
        };
        let step = 1e-6;
        for k in 0..parameters.len() {
            let [above, below] = [step, -step].map(|by| {
                let mut moved = parameters.clone();
                moved[k] += by;
                problem.cost(&problem.evaluate(&moved, None).unwrap())
            });
            // Rounding of the costs over the step.
            let slope = (above - below) / (2.0 * step);
            assert!(
                (slope - gradient[k]).abs() < 1e-7,
                "{k}: {slope}, {}",
                gradient[k]
            );
        }
    }

    #[test]
    fn recover_a_mode_that_drifts_beside_a_line() {
        let mut start = model();
        start.exponents[0] += Complex64::new(0.3, -0.2);
        start.exponents[1] = Complex64::ZERO;
        let fit = fit_exponentials(TIMES, &values(&model()), start, &[]).unwrap();
        let found = fit.model.parameters();
        for (found, exact) in found.iter().zip(model().parameters()) {
            assert!((found - exact).norm() < 1e-6, "{found} {exact}");
        }
    }
}
