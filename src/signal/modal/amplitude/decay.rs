//! One decay: what lies in the mode's band, and the mode's pole from segment to segment.
//!
//! Models of the whole decay are compared by Schwarz's criterion 2N ln(R/2N) + k ln(2N) (N complex
//! values, R sum of squared residuals, k real parameters): the mode with a pole that does not change
//! or with one that drifts, each with the listed neighbours and, one by one, with the strongest line
//! in what is left. The segments follow until the mode falls into the noise. In each the mode's pole is
//! fitted, with everything else held near what the whole decay says.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rustfft::FftPlanner;
use tapjoint_numerics::least_squares::{Linearised, Problem, Settings, minimise};

use super::band::{Band, noise_variance};
use super::{AIM, AmplitudePoint, AmplitudeVerdict, Companion, END, LONGEST, SHORTEST};

/// Numbers of exponents tried for the mode: one is a pole that does not change.
const DEGREES: [usize; 5] = [1, 2, 3, 5, 7];
/// Exponents of a mode whose frequency and damping change linearly with the amplitude.
const LINEAR_DRIFT: usize = 3;
/// Rate of the drift's terms (decays of the mode): its powers hold those of the square root of the
/// amplitude.
const RATE: f64 = 0.5;
/// Most lines looked for beyond the listed ones.
const MOST_FOUND: usize = 2;
/// A line counts when it improves the criterion by more than this: odds of 150 to one.
const LEAST_IMPROVEMENT: f64 = 10.0;
/// Least distance of an unlisted line from the mode (decays of the mode): a drift alone makes
/// terms e^{(p - n sigma) t} at the mode's own frequency, which must not pass for neighbours.
const NEAREST: f64 = 1.2;
/// Up to this distance (decays of the mode) an unlisted line may beat with a mode whose pole
/// does not change, but is not looked for beside one that drifts: what the drift's model misses lies
/// there as well. Hum, which does not decay, is exempt.
const NEAR: f64 = 20.0;
/// Lines farther away than this (decays of the mode) are left alone: over a segment they average out.
const FAR: f64 = 100.0;
/// A line that decays less than this (decays of the mode) is hum.
const HUM: f64 = 0.1;
/// A listed mode nearer than this (decays of the mode) cannot be distinguished from a drift by one decay:
/// the beat does not complete a cycle while the amplitude falls to 4 %.
const UNRESOLVED: f64 = 2.0;
/// Values over which power is averaged to see whether anything is above the noise.
const STRETCH: usize = 16;
/// Values of a decay that are kept at least.
const LEAST_VALUES: usize = 64;
/// The exponent of a mode that can be followed bends by no more (rad) within half a segment.
const LARGEST_BEND: f64 = 0.3;
/// Companions below this share of the mode at the start are not reported.
const LEAST_SHARE: f64 = 1e-4;

/// The best model of a whole decay: the mode, and what lies in its band beside it.
pub(super) struct DecayModel {
    /// The model; times count from the band's first value.
    exponentials: Exponentials,
    /// Noise variance of the values.
    noise: f64,
    /// The models with what the best one found beside the mode, for every number of exponents from its own on.
    ways: Vec<Candidate>,
    /// How much better a pole that drifts explains the decay than one that does not.
    pub evidence: Evidence,
}

/// Fall of the sum of squares between two models of a decay, in variances of its noise, and the unknowns that it took:
/// chi-squared where noise alone makes it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Evidence {
    pub fall: f64,
    pub unknowns: f64,
    /// Degrees of freedom that the better model leaves.
    pub freedom: f64,
}

struct Candidate {
    fit: Fit,
    criterion: f64,
}

impl Candidate {
    fn drifts(&self) -> bool {
        self.fit.model.exponents.len() > 1
    }
}

impl DecayModel {
    /// Fits models to a whole decay, and takes the best of them.
    pub fn fit(series: &[Complex64], band: &Band) -> Self {
        let noise = noise_variance(series, band);
        // Beyond the last stretch with twice the power of noise the values say nothing.
        let last = series.chunks(STRETCH).rposition(|stretch| {
            let power: f64 = stretch.iter().map(Complex64::norm_sqr).sum();
            power > 2.0 * noise * stretch.len() as f64
        });
        let above_noise = (last.unwrap_or(0) + 1) * STRETCH;
        let whole = WholeDecay {
            series: &series[..above_noise.max(LEAST_VALUES).min(series.len())],
            band,
            noise,
        };
        let start = Exponentials {
            amplitude: series.first().copied().unwrap_or(Complex64::ONE),
            exponents: vec![Complex64::from(band.decay)],
            rate: -RATE * band.decay,
            others: (band.neighbours.iter())
                .map(|p| (Complex64::ZERO, *p))
                .collect(),
        };
        // The mode and its listed neighbours, with more and more exponents.
        let mut models: Vec<Candidate> = Vec::new();
        for degree in DEGREES {
            let mut model = models
                .last()
                .map_or(&start, |lower| &lower.fit.model)
                .clone();
            model.exponents.resize(degree, Complex64::ZERO);
            models.extend(whole.fit(model));
            // Twice worse in a row: more exponents only follow the noise.
            let criteria: Vec<f64> = models.iter().map(|model| model.criterion).collect();
            if matches!(criteria[..], [.., a, b, c] if a < b && b < c) {
                break;
            }
        }
        models = best_of_each_kind(models);
        for _ in 0..MOST_FOUND {
            let with_line: Vec<Candidate> = models
                .iter()
                .filter_map(|model| whole.with_strongest_line(model))
                .collect();
            if least_criterion(&with_line) > least_criterion(&models) - LEAST_IMPROVEMENT {
                break;
            }
            models.extend(with_line);
            models = best_of_each_kind(models);
        }
        match models.into_iter().min_by(by_criterion) {
            // What a model of the whole decay misses is no noise.
            Some(best) => DecayModel {
                noise: noise.min(best.fit.squares / whole.series.len() as f64),
                ways: whole.with_more_exponents(&best),
                evidence: whole.evidence(&best.fit.model),
                exponentials: best.fit.model,
            },
            None => DecayModel {
                exponentials: start,
                noise,
                ways: Vec::new(),
                evidence: Evidence::default(),
            },
        }
    }

    /// Returns how the mode's exponent bends about the time t, at t + s. It is 0 where the fit has lost
    /// the mode and its polynomial means nothing.
    fn bend(&self, t: f64, s: f64) -> Complex64 {
        let model = &self.exponentials;
        let bend = model.exponent(t + s) - model.exponent(t) - model.pole(t) * s;
        match bend.norm() < LARGEST_BEND {
            true => bend,
            false => Complex64::ZERO,
        }
    }

    /// Returns the lines fitted along with the mode that matter.
    pub fn companions(&self, band: &Band) -> Vec<Companion> {
        let mode = self.exponentials.amplitude.norm();
        let others = self.exponentials.others.iter();
        others
            .map(|(amplitude, pole)| Companion {
                frequency: band.frequency(*pole),
                share: amplitude.norm() / mode,
            })
            .filter(|companion| companion.share > LEAST_SHARE)
            .collect()
    }

    /// Returns why a change seen in this decay need not be one; `None` where it must.
    pub fn doubt(&self, band: &Band) -> Option<AmplitudeVerdict> {
        let mut neighbours = band.neighbours.iter();
        if let Some(pole) = neighbours.find(|pole| pole.im.abs() < -UNRESOLVED * band.decay) {
            let frequency = band.frequency(*pole);
            return Some(AmplitudeVerdict::Unresolved { frequency });
        }
        if self.exponentials.exponents.len() > 1 {
            return None;
        }
        let mode = band.frequency(self.exponentials.pole(0.0));
        let mut near = self.companions(band);
        near.retain(|companion| TAU * (companion.frequency - mode).abs() < -NEAR * band.decay);
        let strongest = near.iter().max_by(|a, b| a.share.total_cmp(&b.share))?;
        Some(AmplitudeVerdict::Beating {
            frequency: strongest.frequency,
        })
    }
}

fn by_criterion(a: &Candidate, b: &Candidate) -> std::cmp::Ordering {
    a.criterion.total_cmp(&b.criterion)
}

fn least_criterion(candidates: &[Candidate]) -> f64 {
    let criteria = candidates.iter().map(|c| c.criterion);
    criteria.fold(f64::INFINITY, f64::min)
}

/// Returns the best model with a pole that does not change, and the best with one that drifts.
fn best_of_each_kind(mut all: Vec<Candidate>) -> Vec<Candidate> {
    all.sort_by(by_criterion);
    let (drifting, steady): (Vec<_>, Vec<_>) = all.into_iter().partition(Candidate::drifts);
    let best = [steady, drifting].map(|kind| kind.into_iter().next());
    best.into_iter().flatten().collect()
}

/// The values of a whole decay that are above the noise.
struct WholeDecay<'a> {
    series: &'a [Complex64],
    band: &'a Band,
    noise: f64,
}

impl WholeDecay<'_> {
    fn fit(&self, model: Exponentials) -> Option<Candidate> {
        let degree = model.exponents.len();
        let count = self.series.len();
        if count < 2 * model.parameters().len() {
            return None;
        }
        // Listed poles are known to about their own half-power width.
        let listed = self.band.neighbours.iter().enumerate();
        let priors: Vec<Prior> = listed
            .map(|(k, pole)| Prior {
                parameter: 2 + degree + 2 * k,
                value: *pole,
                weight: self.noise / (2.0 * pole.re * pole.re).max(f64::MIN_POSITIVE),
            })
            .collect();
        let unknowns = 2.0 * model.parameters().len() as f64;
        let times: Vec<f64> = (0..count).map(|n| n as f64 * self.band.step).collect();
        let fit = fit_exponentials(&times, self.series, model, &priors)?;
        fit.inverse()?;
        let values = 2.0 * count as f64;
        let squares = fit.squares.max(f64::MIN_POSITIVE);
        let criterion = values * (squares / values).ln() + unknowns * values.ln();
        criterion
            .is_finite()
            .then_some(Candidate { fit, criterion })
    }

    /// Fits the model again with its own number of exponents and with every larger one, from three on. The criterion may
    /// not see a change linear in the amplitude that the interval must hold.
    fn with_more_exponents(&self, best: &Candidate) -> Vec<Candidate> {
        let own = best.fit.model.exponents.len().max(LINEAR_DRIFT);
        let mut all: Vec<Candidate> = Vec::new();
        for degree in DEGREES.into_iter().filter(|degree| *degree >= own) {
            let start = all.last().unwrap_or(best);
            let mut model = start.fit.model.clone();
            model.exponents.resize(degree, Complex64::ZERO);
            all.extend(self.fit(model));
        }
        all
    }

    /// Compares a pole that drifts linearly with the amplitude with one that does not, with the same lines beside it.
    fn evidence(&self, best: &Exponentials) -> Evidence {
        let mut model = best.clone();
        model.exponents = vec![best.pole(self.band.scale)];
        let Some(steady) = self.fit(model) else {
            return Evidence::default();
        };
        let mut model = steady.fit.model.clone();
        model.exponents.resize(LINEAR_DRIFT, Complex64::ZERO);
        let Some(drifting) = self.fit(model) else {
            return Evidence::default();
        };
        // Of complex noise each part has half the variance.
        let noise = 0.5 * drifting.fit.variance(self.band);
        Evidence {
            fall: (steady.fit.squares - drifting.fit.squares) / noise,
            unknowns: 2.0 * (LINEAR_DRIFT - 1) as f64,
            freedom: 2.0 * self.series.len() as f64 - 2.0 * drifting.fit.right.len() as f64,
        }
    }

    /// Fits the model with the strongest line of its residual beside it: one that decays like the mode, or
    /// one that stays, whichever takes more out.
    fn with_strongest_line(&self, candidate: &Candidate) -> Option<Candidate> {
        let residuals = &candidate.fit.residuals;
        let mut model = candidate.fit.model.clone();
        let size = (4 * residuals.len()).next_power_of_two();
        let mut lines = residuals.clone();
        lines.resize(size, Complex64::ZERO);
        FftPlanner::new().plan_fft_forward(size).process(&mut lines);
        let spacing = TAU / (size as f64 * self.band.step);
        let mode = model.pole(self.band.scale).im;
        let sigma = -self.band.decay;
        let offsets = lines.iter().enumerate().map(|(k, value)| {
            // The upper half of the lines are those of negative frequencies.
            let turn = if k < size / 2 { 0.0 } else { size as f64 };
            ((k as f64 - turn) * spacing, value.norm_sqr())
        });
        // Outside what a drift makes.
        let (offset, _) = offsets
            .filter(|(offset, _)| (NEAREST * sigma..FAR * sigma).contains(&(offset - mode).abs()))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let (mut line, mut most) = (None, f64::NEG_INFINITY);
        for decay in [self.band.decay, 0.0] {
            let pole = Complex64::new(decay, offset);
            // sum conj(e) r and sum |e|^2, whose quotient is the amplitude.
            let (mut product, mut energy) = (Complex64::ZERO, f64::MIN_POSITIVE);
            for (n, residual) in residuals.iter().enumerate() {
                let value = (pole * (n as f64 * self.band.step)).exp();
                product += value.conj() * residual;
                energy += value.norm_sqr();
            }
            let explained = product.norm_sqr() / energy;
            if explained >= most {
                (line, most) = (Some((product / energy, pole)), explained);
            }
        }
        model.others.push(line?);
        let grown = self.fit(model)?;
        // Unlisted lines may neither grow nor lie where a drift makes terms of its own.
        let mode = grown.fit.model.pole(self.band.scale);
        let mut near = 0;
        for (_, pole) in grown
            .fit
            .model
            .others
            .iter()
            .skip(self.band.neighbours.len())
        {
            let distance = (pole.im - mode.im).abs() / sigma;
            let hum = pole.re.abs() < HUM * sigma;
            near += usize::from(distance < NEAR && !hum);
            if distance < NEAREST || pole.re > HUM * sigma {
                return None;
            }
        }
        // A pair beats. Several lines about a mode are what a drift looks like.
        (near == 0 || (near == 1 && !grown.drifts())).then_some(grown)
    }
}

/// x(t) = c e^{q1 t + q2 v + q3 v^2 + ...} + sum over k of c_k e^{p_k t}, v(t) = 1 - e^{-rate t}.
///
/// A frequency that changes with a power of the amplitude changes exponentially in time, so powers of
/// v describe it with few terms where powers of t would not. The parameters enter analytically: least
/// squares may treat them as complex numbers.
#[derive(Debug, Clone)]
struct Exponentials {
    /// Amplitude of the mode.
    amplitude: Complex64,
    /// Its exponents q1 (1/s), q2, q3, ... (1); the first alone is a pole that does not change.
    exponents: Vec<Complex64>,
    /// Rate of v (1/s).
    rate: f64,
    /// Amplitude and pole (rad/s) of everything else.
    others: Vec<(Complex64, Complex64)>,
}

impl Exponentials {
    /// Returns the parameters: amplitude, exponents, then amplitude and pole of every other.
    fn parameters(&self) -> Vec<Complex64> {
        let mut all = vec![self.amplitude];
        all.extend(&self.exponents);
        all.extend(self.others.iter().flat_map(|(c, p)| [*c, *p]));
        all
    }

    /// Returns the pole at a time: the derivative of the mode's exponent.
    fn pole(&self, t: f64) -> Complex64 {
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
    fn exponent(&self, t: f64) -> Complex64 {
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

impl DecayModel {
    /// Returns the amplitude at a time before or after the band's first value (unit of the sensor).
    pub fn amplitude(&self, t: f64, band: &Band) -> f64 {
        self.exponentials.log_amplitude(t, band).exp()
    }

    /// Returns the frequency (Hz) at an amplitude (unit of the sensor) and its standard uncertainty, as the mean over
    /// the models; `None` where the decay does not reach that amplitude.
    pub fn frequency_at(&self, amplitude: f64, band: &Band) -> Option<(f64, f64)> {
        let akaike = |way: &Candidate| {
            let values = 2.0 * way.fit.residuals.len() as f64;
            let unknowns = 2.0 * way.fit.model.parameters().len() as f64;
            way.criterion - unknowns * (values.ln() - 2.0)
        };
        let least = self.ways.iter().map(akaike).fold(f64::INFINITY, f64::min);
        let mut readings = Vec::with_capacity(self.ways.len());
        for way in &self.ways {
            let weight = (-0.5 * (akaike(way) - least)).exp();
            if weight > 0.01 {
                let (frequency, std) = way.fit.frequency_at(amplitude, band)?;
                readings.push((weight, frequency, std));
            }
        }
        let total: f64 = readings.iter().map(|(weight, _, _)| weight).sum();
        let mean = readings.iter().map(|(w, value, _)| w * value).sum::<f64>() / total;
        let variances = readings
            .iter()
            .map(|(w, value, std)| w * (std * std + (value - mean).powi(2)));
        let variance = variances.sum::<f64>() / total;
        (mean.is_finite() && variance > 0.0).then(|| (mean, variance.sqrt()))
    }
}

impl Exponentials {
    /// Log of the mode's amplitude at a time, the filter's gain taken out.
    fn log_amplitude(&self, t: f64, band: &Band) -> f64 {
        let gain = band.gain(self.pole(t)).norm();
        self.amplitude.norm().ln() + self.exponent(t).re - gain.ln()
    }

    /// Returns the time at which the mode's amplitude falls to one; `None` where it does not within the filter's first
    /// half and `last`.
    fn time_at(&self, amplitude: f64, last: f64, band: &Band) -> Option<f64> {
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
    fn variance(&self, band: &Band) -> f64 {
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
    fn frequency_at(&self, amplitude: f64, band: &Band) -> Option<(f64, f64)> {
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
struct Prior {
    parameter: usize,
    value: Complex64,
    weight: f64,
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
fn fit_exponentials(
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
struct Fit {
    model: Exponentials,
    /// J^H J + priors, J being the model's complex derivatives.
    normal: DMatrix<Complex64>,
    /// J^H r + priors.
    right: DVector<Complex64>,
    residuals: Vec<Complex64>,
    /// Sum of the squared residuals.
    squares: f64,
    /// Sum of squares of the deviations from the priors.
    prior_squares: f64,
}

impl Fit {
    /// Returns (J^H J + priors)^-1, which times the noise variance is the parameters' covariance; `None`
    /// where the unknowns cannot be separated.
    fn inverse(&self) -> Option<DMatrix<Complex64>> {
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

/// Fewest values of a segment: 24 real numbers against four unknowns.
const LEAST_IN_SEGMENT: usize = 12;
/// A pole this many decays away from that of the segment before is another's.
const LARGEST_JUMP: f64 = 3.0;
/// Freedom of a companion's amplitude about that of the whole decay, relative.
const AMPLITUDE_FREEDOM: f64 = 0.2;
/// Freedom of its pole (shares of the mode's decay).
const POLE_FREEDOM: f64 = 0.3;

/// A part of a decay and the mode's pole in it.
#[derive(Debug, Clone, Copy)]
struct Segment {
    /// Time at which a linear drift has the value found (s after the band's first value).
    time: f64,
    /// Amplitude there, as the band has it.
    amplitude: f64,
    /// Pole relative to the band's middle (rad/s).
    pole: Complex64,
    /// Diagonal element of the inverse normal matrix for the pole.
    inverse: f64,
    /// Sum of squared residuals.
    squares: f64,
    /// Sum of the residuals' lag-one products.
    products: f64,
    /// Complex degrees of freedom.
    freedom: f64,
}

/// Returns the mode's pole along one decay, until it falls into the noise.
pub(super) fn follow_decay(
    series: &[Complex64],
    band: &Band,
    model: &DecayModel,
) -> Vec<AmplitudePoint> {
    let mut segments: Vec<Segment> = Vec::new();
    let mut pole = model.exponentials.pole(0.0);
    pole.re = pole.re.min(0.3 * band.decay);
    let mut amplitude = model.exponentials.amplitude.norm();
    let mut from = 0;
    while let Some(length) = segment_length(amplitude, pole.re, model.noise, band) {
        let Some(values) = series.get(from..from + length) else {
            break;
        };
        let indices = from..from + length;
        let times: Vec<f64> = indices.map(|n| n as f64 * band.step).collect();
        let Some(segment) = fit_segment(&times, values, pole, model) else {
            break;
        };
        if (segment.pole - pole).norm() > LARGEST_JUMP / band.scale {
            break;
        }
        from += length;
        pole = Complex64::new(segment.pole.re.min(0.3 * band.decay), segment.pole.im);
        let ahead = from as f64 * band.step - segment.time;
        amplitude = segment.amplitude * (pole.re * ahead).exp();
        segments.push(segment);
    }
    let mut points = Vec::with_capacity(segments.len());
    for (index, segment) in segments.iter().enumerate() {
        // The noise variance comes from the residuals of neighbouring segments: one alone has too few values.
        let (mut squares, mut products, mut freedom) = (0.0, 0.0, 0.0);
        for near in &segments[index.saturating_sub(1)..(index + 2).min(segments.len())] {
            squares += near.squares;
            products += near.products;
            freedom += near.freedom;
        }
        // Residuals that agree with their neighbours (correlation r) are what the model misses. They leave
        // (1 - r)/(1 + r) of the values' information. One standard deviation of a correlation by chance is
        // 1/sqrt(2n) with n complex values.
        let agreement = products / f64::max(squares, f64::MIN_POSITIVE);
        let agreement = (agreement - 1.0 / f64::sqrt(2.0 * freedom)).clamp(0.0, 0.9);
        let noise = squares / freedom * (1.0 + agreement) / (1.0 - agreement);
        let std = (0.5 * noise * band.noise_ratio * segment.inverse).sqrt();
        let pole = Complex64::new(segment.pole.re, segment.pole.im + band.omega);
        points.push(AmplitudePoint {
            tap: band.tap,
            time: band.first + segment.time,
            amplitude: segment.amplitude / band.gain(segment.pole).norm(),
            frequency: pole.norm() / TAU,
            frequency_std: std / TAU,
            damping_ratio: -pole.re / pole.norm(),
            damping_std: std / pole.norm(),
        });
    }
    points
}

/// Returns the number of values of the next segment: as few as give the damping with the wanted
/// uncertainty. `None` where even the longest segment leaves it too uncertain.
///
/// Bound of Cramer and Rao for one exponential of amplitude A in noise of variance v:
/// var(sigma) = 6 v/(A^2 N^3 step^2) with A that of the segment's middle.
fn segment_length(amplitude: f64, decay: f64, noise: f64, band: &Band) -> Option<usize> {
    let [least, most] = [SHORTEST, LONGEST]
        .map(|share| ((share * band.scale / band.step) as usize).max(LEAST_IN_SEGMENT));
    let mut length = least.min(most);
    loop {
        let n = length as f64;
        let middle = amplitude * (0.5 * decay * n * band.step).exp();
        let uncertainty = (6.0 * noise / n.powi(3)).sqrt() / (middle * band.step) / decay.abs();
        if uncertainty <= AIM || length >= most {
            return (uncertainty <= END).then_some(length);
        }
        length += 1;
    }
}

/// Fits the mode to values at `times` (s after the band's first value), starting at `pole`.
fn fit_segment(
    times: &[f64],
    values: &[Complex64],
    pole: Complex64,
    model: &DecayModel,
) -> Option<Segment> {
    let reference = effective_time(times, pole.re);
    let local: Vec<f64> = times.iter().map(|t| t - reference).collect();
    // How the drift bends within the segment is taken from the whole decay, so that the pole is that of
    // the reference time.
    let straight: Vec<Complex64> = local
        .iter()
        .zip(values)
        .map(|(s, value)| value * (-model.bend(reference, *s)).exp())
        .collect();
    let others: Vec<(Complex64, Complex64)> = (model.exponentials.others.iter())
        .map(|(c, p)| (c * (p * reference).exp(), *p))
        .collect();
    let mut priors = Vec::with_capacity(2 * others.len());
    for (k, (amplitude, other)) in others.iter().enumerate() {
        let [vague_amplitude, vague_pole] =
            [AMPLITUDE_FREEDOM * amplitude.norm(), POLE_FREEDOM * pole.re]
                .map(|std| (2.0 * std * std).max(f64::MIN_POSITIVE));
        priors.push(Prior {
            parameter: 2 + 2 * k,
            value: *amplitude,
            weight: model.noise / (vague_amplitude + model.noise * 1e-9),
        });
        priors.push(Prior {
            parameter: 3 + 2 * k,
            value: *other,
            weight: model.noise / vague_pole,
        });
    }
    // Least-squares amplitude of the mode with everything else as the whole decay has it.
    let (mut product, mut energy) = (Complex64::ZERO, f64::MIN_POSITIVE);
    for (t, value) in local.iter().zip(&straight) {
        let rest: Complex64 = others.iter().map(|(c, p)| c * (p * t).exp()).sum();
        let growth = (pole * t).exp();
        product += growth.conj() * (value - rest);
        energy += growth.norm_sqr();
    }
    let start = Exponentials {
        amplitude: product / energy,
        exponents: vec![pole],
        rate: model.exponentials.rate,
        others,
    };
    let fit = fit_exponentials(&local, &straight, start, &priors)?;
    let pairs = fit.residuals.windows(2);
    Some(Segment {
        time: reference,
        amplitude: fit.model.amplitude.norm(),
        pole: *fit.model.exponents.first()?,
        inverse: fit.inverse()?[(1, 1)].re,
        squares: fit.squares,
        products: pairs.map(|r| (r[0].conj() * r[1]).re).sum(),
        freedom: values.len() as f64 - 2.0,
    })
}

/// Returns the time at which a parabola has the slope of the straight line fitted to it with weights w:
/// mean + mu3/(2 mu2). Log amplitude and phase are weighted with the amplitude squared,
/// w = e^{2 decay t}, so that an estimate from a drifting pole is that of this time.
fn effective_time(times: &[f64], decay: f64) -> f64 {
    let first = times.first().copied().unwrap_or(0.0);
    let weights: Vec<f64> = times
        .iter()
        .map(|t| (2.0 * decay * (t - first)).exp())
        .collect();
    let total: f64 = weights.iter().sum();
    let mean = times.iter().zip(&weights).map(|(t, w)| w * t).sum::<f64>() / total;
    let (mut second, mut third) = (0.0, 0.0);
    for (t, w) in times.iter().zip(&weights) {
        second += w * (t - mean).powi(2);
        third += w * (t - mean).powi(3);
    }
    mean + 0.5 * third / second
}
