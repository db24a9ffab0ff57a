//! One decay: what lies in the mode's band, and the mode's pole from segment to segment.
//!
//! Models of the whole decay are compared by Schwarz's criterion 2N ln(R/2N) + k ln(2N) (N complex
//! values, R sum of squared residuals, k real parameters): the mode with a pole that does not change
//! or with one that drifts (its search starts at the logarithm of the values, whose phase follows any drift), each with the listed neighbours and, one by one, with the strongest line
//! in what is left. The segments follow until the mode falls into the noise. In each the mode's pole is
//! fitted, with everything else held near what the whole decay says.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rustfft::FftPlanner;
use tapjoint_numerics::least_squares::{Linearised, Problem, Settings, minimise};

use super::band::{Band, noise_variance};
use super::{AIM, AmplitudePoint, AmplitudeVerdict, Companion, END, LONGEST, SHORTEST};

/// Kinds of drift tried for the mode: the rate of the drift's terms (decays of the mode) and the number of exponents.
/// One exponent is a pole that does not change. With two the drift goes with the amplitude to the power of the rate:
/// slip in a joint takes 1/2 to 1, a cubic spring 2, and 0.1 is nearly its logarithm. More exponents mix powers.
const KINDS: [(f64, usize); 9] = [
    (0.5, 1),
    (1.0, 2),
    (0.5, 2),
    (2.0, 2),
    (0.1, 2),
    (0.5, 3),
    (1.0, 3),
    (0.5, 5),
    (0.5, 7),
];
/// Kinds beyond this number are tried only where a drift is clear.
const SIMPLE: usize = 5;
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
/// The exponent of a mode that can be followed bends by no more (rad) within half a segment: at 6 % of drift over a
/// decay with a damping ratio of 0.5 %.
const LARGEST_BEND: f64 = 2.0;
/// The logarithm of the values is followed as far as their power is above this multiple of the noise: an unwrapped phase
/// that is off by less than half a turn beyond four standard deviations.
const CLEAR_POWER: f64 = 16.0;
/// Companions below this share of the mode at the start are not reported.
const LEAST_SHARE: f64 = 1e-4;

/// The best model of a whole decay: the mode, and what lies in its band beside it.
pub(super) struct DecayModel {
    /// The model; times count from the band's first value.
    exponentials: Exponentials,
    /// Noise variance of the values.
    noise: f64,
    /// Criterion of the model; infinite where nothing could be fitted.
    pub criterion: f64,
    /// The best fit of each kind of drift.
    kinds: Vec<DriftKind>,
    /// Time of the last value above the noise (s after the band's first).
    last: f64,
}

/// The best fit of one kind of drift to a decay.
struct DriftKind {
    /// Its place in [`KINDS`].
    kind: usize,
    criterion: f64,
    model: Exponentials,
    /// Covariance E(d d^H) of the mode's amplitude and exponents.
    covariance: DMatrix<Complex64>,
}

struct Candidate {
    /// Its place in [`KINDS`].
    kind: usize,
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
            rate: -KINDS[0].0 * band.decay,
            others: (band.neighbours.iter())
                .map(|p| (Complex64::ZERO, *p))
                .collect(),
        };
        // The magnitude falls at the mode's own rate, however its frequency drifts.
        let mut fall = start.clone();
        let sigma = match whole.take_logarithm(&mut fall) {
            true => (-fall.exponents[0].re).max(-LEAST_OF_DECAY * band.decay),
            false => -band.decay,
        };
        // The mode and its listed neighbours, with each kind of drift.
        let mut all: Vec<Candidate> = Vec::new();
        for (kind, (rate, exponents)) in KINDS.into_iter().enumerate() {
            if kind == SIMPLE && !is_clear_drift(&all) {
                break;
            }
            let steady = all.first().map_or(&start, |steady| &steady.fit.model);
            let mut model = steady.clone();
            model.rate = rate * sigma;
            model.exponents.resize(exponents, Complex64::ZERO);
            all.extend(whole.fit(kind, whole.nearer_start(model)));
        }
        for _ in 0..MOST_FOUND {
            let best = best_of_each_kind(&all);
            let with_line: Vec<Candidate> = best
                .iter()
                .filter_map(|&model| whole.with_strongest_line(&all[model]))
                .collect();
            if least_criterion(&with_line) > least_criterion(&all) - LEAST_IMPROVEMENT {
                break;
            }
            all.extend(with_line);
        }
        let last = (whole.series.len() - 1) as f64 * band.step;
        let mut kinds: Vec<DriftKind> = Vec::new();
        for candidate in &all {
            let kept = kinds.iter().position(|one| one.kind == candidate.kind);
            if kept.is_some_and(|kept| kinds[kept].criterion <= candidate.criterion) {
                continue;
            }
            if let Some(covariance) = candidate.fit.covariance_of_mode(band) {
                kinds.retain(|one| one.kind != candidate.kind);
                kinds.push(DriftKind {
                    kind: candidate.kind,
                    criterion: candidate.criterion,
                    model: candidate.fit.model.clone(),
                    covariance,
                });
            }
        }
        let best = all.into_iter().min_by(by_criterion);
        let values = whole.series.len() as f64;
        DecayModel {
            // What a model of the whole decay misses is no noise.
            noise: noise.min(
                best.as_ref()
                    .map_or(noise, |best| best.fit.squares / values),
            ),
            criterion: best.as_ref().map_or(f64::INFINITY, |best| best.criterion),
            exponentials: best.map_or(start, |best| best.fit.model),
            kinds,
            last,
        }
    }

    /// Places in the list of kinds and criteria of those that could be fitted.
    pub fn criteria(&self) -> impl Iterator<Item = (usize, f64)> {
        self.kinds.iter().map(|one| (one.kind, one.criterion))
    }

    /// Returns the amplitude (unit of the sensor) of the mode when the decay begins, and the rate at which it falls there
    /// (1/s).
    pub fn beginning(&self, band: &Band, start: f64) -> (f64, f64) {
        let pole = self.exponentials.pole(0.0);
        let amplitude = self.exponentials.amplitude.norm() / band.gain(pole).norm();
        let decay = (-pole.re).max(-LEAST_OF_DECAY * band.decay);
        (amplitude * (decay * (band.first - start)).exp(), decay)
    }

    /// Returns the mode's pole by one kind of drift, where its amplitude has fallen to a value (unit of the sensor); `None`
    /// where the decay does not pass it, or that kind could not be fitted.
    ///
    /// With the parameters p = (c, q1, q2, ...), the gradients h of ln x(t) and g of the pole s(t) = d/dt ln x, the
    /// amplitude is reached at t + Re(h dp)/sigma. The errors of pole and time together are therefore
    /// g dp + (ds/dt)/sigma Re(h dp), with circular errors dp.
    pub fn at_amplitude(
        &self,
        kind: usize,
        amplitude: f64,
        band: &Band,
    ) -> Option<PoleAtAmplitude> {
        let found = self.kinds.iter().find(|one| one.kind == kind)?;
        let (model, covariance) = (&found.model, &found.covariance);
        let level = |t: f64| {
            let reached = model.amplitude.norm().ln() + model.exponent(t).re;
            reached - band.gain(model.pole(t)).norm().ln() - amplitude.ln()
        };
        let (mut early, mut late) = (0.0, self.last);
        if !(level(early) > 0.0 && level(late) < 0.0) {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (early + late);
            match level(middle) > 0.0 {
                true => early = middle,
                false => late = middle,
            }
        }
        let t = early;
        let pole = model.pole(t);
        let step = 1e-3 * band.scale;
        let slope = (model.pole(t + step) - model.pole(t - step)) / (2.0 * step * -pole.re);
        let count = 1 + model.exponents.len();
        let (mut of_log, mut of_pole) = (vec![1.0 / model.amplitude], vec![Complex64::ZERO]);
        let v = 1.0 - (-model.rate * t).exp();
        for k in 0..count - 1 {
            let power = v.powi(k as i32);
            of_log.push(Complex64::from(if k == 0 { t } else { power }));
            let of_power = k as f64 * v.powi(k as i32 - 1) * model.rate * (1.0 - v);
            of_pole.push(Complex64::from(if k == 0 { 1.0 } else { of_power }));
        }
        let product = |a: &[Complex64], b: &[Complex64]| {
            let mut sum = Complex64::ZERO;
            for (i, a) in a.iter().enumerate() {
                for (k, b) in b.iter().enumerate() {
                    sum += a * covariance[(i, k)] * b.conj();
                }
            }
            sum
        };
        let own = 0.5 * product(&of_pole, &of_pole).re;
        let of_time = 0.5 * product(&of_log, &of_log).re;
        let both = 0.5 * product(&of_pole, &of_log);
        // Variances of the imaginary and of the real part.
        let turn = own + slope.im * slope.im * of_time + 2.0 * slope.im * both.im;
        let fall = own + slope.re * slope.re * of_time + 2.0 * slope.re * both.re;
        let whole = Complex64::new(pole.re, pole.im + band.omega);
        let found = PoleAtAmplitude {
            frequency: whole.norm() / TAU,
            frequency_std: turn.max(0.0).sqrt() / TAU,
            damping_ratio: -pole.re / whole.norm(),
            damping_std: fall.max(0.0).sqrt() / whole.norm(),
        };
        (pole.re < 0.0 && found.frequency_std > 0.0 && found.damping_std > 0.0).then_some(found)
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

/// Halvings of the time in which an amplitude is looked for.
const HALVINGS: usize = 60;
/// Least decay of a mode (decays of the band): a slower start of a decay is a misfit.
const LEAST_OF_DECAY: f64 = 0.1;

/// Frequency and damping of a mode in one decay, where its amplitude has fallen to a given value.
pub(super) struct PoleAtAmplitude {
    /// Natural frequency (Hz) and its standard uncertainty.
    pub frequency: f64,
    pub frequency_std: f64,
    /// Damping ratio (1) and its standard uncertainty.
    pub damping_ratio: f64,
    pub damping_std: f64,
}

fn by_criterion(a: &Candidate, b: &Candidate) -> std::cmp::Ordering {
    a.criterion.total_cmp(&b.criterion)
}

fn least_criterion(candidates: &[Candidate]) -> f64 {
    let criteria = candidates.iter().map(|c| c.criterion);
    criteria.fold(f64::INFINITY, f64::min)
}

/// Returns true if some drift explains a decay clearly better than a pole that does not change.
fn is_clear_drift(all: &[Candidate]) -> bool {
    let best = best_of_each_kind(all);
    match best[..] {
        [steady, drifting] => all[drifting].criterion < all[steady].criterion - LEAST_IMPROVEMENT,
        _ => false,
    }
}

/// Returns the places of the best model with a pole that does not change and of the best with one that drifts.
fn best_of_each_kind(all: &[Candidate]) -> Vec<usize> {
    let best = [false, true].map(|drifts| {
        let own = all.iter().enumerate();
        let own = own.filter(|(_, one)| one.drifts() == drifts);
        own.min_by(|a, b| by_criterion(a.1, b.1))
    });
    best.into_iter().flatten().map(|(place, _)| place).collect()
}

/// The values of a whole decay that are above the noise.
struct WholeDecay<'a> {
    series: &'a [Complex64],
    band: &'a Band,
    noise: f64,
}

impl WholeDecay<'_> {
    /// Returns the start with its mode taken from the logarithm of the values, where that is nearer to them: a search
    /// from a pole that does not change loses a phase that drifts by more than a turn.
    fn nearer_start(&self, start: Exponentials) -> Exponentials {
        let mut other = start.clone();
        if start.exponents.len() < 2 || !self.take_logarithm(&mut other) {
            return start;
        }
        let mut row = Vec::new();
        let mut distance = |model: &Exponentials| {
            let numbered = self.series.iter().enumerate();
            let squares = numbered.map(|(n, value)| {
                (value - model.value(n as f64 * self.band.step, &mut row)).norm_sqr()
            });
            squares.sum::<f64>()
        };
        match distance(&other) < distance(&start) {
            true => other,
            false => start,
        }
    }

    /// Fits amplitude and exponents of a model to ln y = ln c + q1 t + q2 v + ..., the phase unwrapped, with the weights
    /// |y|^2 (the noise of a logarithm is that of its value over it). Returns false where the values do not determine
    /// them.
    fn take_logarithm(&self, model: &mut Exponentials) -> bool {
        let clear = |value: &&Complex64| value.norm_sqr() > CLEAR_POWER * self.noise;
        let values: Vec<Complex64> = self.series.iter().take_while(clear).copied().collect();
        let count = 1 + model.exponents.len();
        if values.len() < 2 * count {
            return false;
        }
        let mut phase = values[0].arg();
        let mut rows = DMatrix::zeros(values.len(), count);
        let mut right = DMatrix::zeros(values.len(), 2);
        for (n, value) in values.iter().enumerate() {
            if n > 0 {
                phase += (value / values[n - 1]).arg();
            }
            let (t, weight) = (n as f64 * self.band.step, value.norm());
            let v = 1.0 - (-model.rate * t).exp();
            for k in 0..count {
                let term = match k {
                    0 => 1.0,
                    1 => t,
                    _ => v.powi(k as i32 - 1),
                };
                rows[(n, k)] = weight * term;
            }
            right[(n, 0)] = weight * weight.ln();
            right[(n, 1)] = weight * phase;
        }
        let qr = rows.qr();
        let Some(found) = qr.r().solve_upper_triangular(&(qr.q().transpose() * right)) else {
            return false;
        };
        let complex = |k: usize| Complex64::new(found[(k, 0)], found[(k, 1)]);
        model.amplitude = complex(0).exp();
        for (k, q) in model.exponents.iter_mut().enumerate() {
            *q = complex(k + 1);
        }
        model.amplitude.is_finite() && model.exponents.iter().all(|q| q.is_finite())
    }

    fn fit(&self, kind: usize, model: Exponentials) -> Option<Candidate> {
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
        criterion.is_finite().then_some(Candidate {
            kind,
            fit,
            criterion,
        })
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
        let grown = self.fit(candidate.kind, model)?;
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

/// A parameter known beforehand: index, value, and 1/variance (of both parts together).
#[derive(Debug, Clone, Copy)]
struct Prior {
    parameter: usize,
    value: Complex64,
    weight: f64,
}

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

impl Fit {
    /// Covariance of the mode's amplitude and exponents, from the residuals: neighbours that agree count for less.
    fn covariance_of_mode(&self, band: &Band) -> Option<DMatrix<Complex64>> {
        let unknowns = self.normal.nrows() as f64;
        let freedom = (self.residuals.len() as f64 - unknowns).max(1.0);
        let pairs = self.residuals.windows(2);
        let products: f64 = pairs.map(|r| (r[0].conj() * r[1]).re).sum();
        let noise = residual_variance(self.squares, products, freedom);
        let count = 1 + self.model.exponents.len();
        let inverse = self.inverse()?;
        let own = inverse.view((0, 0), (count, count)).into_owned();
        Some(own * Complex64::from(noise * band.noise_ratio))
    }
}

/// Variance of residuals from the sums of their squares and of their lag-one products.
///
/// Residuals that agree with their neighbours (correlation r) are what the model misses. They leave
/// (1 - r)/(1 + r) of the values' information. One standard deviation of a correlation by chance is
/// 1/sqrt(2n) with n complex values.
fn residual_variance(squares: f64, products: f64, freedom: f64) -> f64 {
    let agreement = products / f64::max(squares, f64::MIN_POSITIVE);
    let agreement = (agreement - 1.0 / f64::sqrt(2.0 * freedom)).clamp(0.0, 0.9);
    squares / freedom * (1.0 + agreement) / (1.0 - agreement)
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
        let noise = residual_variance(squares, products, freedom);
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

/// Returns the time after the start of a decay (s) at which a pole that does not change, fitted to all of it, is that of
/// a mode whose frequency changes with the amplitude: the power of slip in a joint, 1/2 to 1, makes it 0.81 to 0.89
/// decay times of a long record; 1 is taken.
///
/// The fit weights the phase with the squared amplitude, w = e^{-2 sigma t}. A change d e^{-sigma t} of omega gives the
/// phase d (1 - e^{-sigma t})/sigma, through which the fit lays the slope cov(t, phase)/var(t).
pub(super) fn holding_time(decay: f64, seconds: f64) -> f64 {
    let length = seconds.min(FOLLOWED / decay);
    let (mut total, mut mean, mut mean_phase) = (0.0, 0.0, 0.0);
    let points: Vec<(f64, f64, f64)> = (0..GRID)
        .map(|n| length * (n as f64 + 0.5) / GRID as f64)
        .map(|t| {
            (
                t,
                (-2.0 * decay * t).exp(),
                (1.0 - (-decay * t).exp()) / decay,
            )
        })
        .collect();
    for (t, weight, phase) in &points {
        total += weight;
        mean += weight * t;
        mean_phase += weight * phase;
    }
    (mean, mean_phase) = (mean / total, mean_phase / total);
    let (mut both, mut square) = (0.0, 0.0);
    for (t, weight, phase) in &points {
        both += weight * (t - mean) * (phase - mean_phase);
        square += weight * (t - mean).powi(2);
    }
    -(both / square).ln() / decay
}

/// Points of the grid of [`holding_time`]: its error is below 1e-4.
const GRID: usize = 400;
/// Decay times beyond which nothing of a record counts.
const FOLLOWED: f64 = 8.0;

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
