//! What else lies in a mode's band, and whether poles that do not change explain the whole decay.
//!
//! Models of the whole decay are compared by Schwarz's criterion 2N ln(R/2N) + k ln(2N) (N complex
//! values, R sum of squared residuals, k real parameters): the mode with a pole that does not change
//! or with one that drifts, each with the listed neighbours and, one by one, with the strongest line
//! in what is left.
//!
//! Sums of complex exponentials, the first with a drifting pole: values and derivatives.
//!
//! Least squares of complex exponentials by Levenberg and Marquardt.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rustfft::FftPlanner;

use super::band::{Band, noise_variance};
use super::{AmplitudeVerdict, Companion, Origin};

/// Numbers of exponents tried for the mode: one is a pole that does not change.
const DEGREES: [usize; 5] = [1, 2, 3, 5, 7];
/// Rate of the drift's terms (decays of the mode): its powers hold those of the square root of the
/// amplitude.
const RATE: f64 = 0.5;
/// Most lines looked for beyond the listed ones.
const MOST_FOUND: usize = 2;
/// A line counts when it improves the criterion by more than this: odds of 150 to one.
const WORTH: f64 = 10.0;
/// Least distance of a line that nobody listed from the mode (decays of the mode): a drift alone makes
/// terms e^{(p - n sigma) t} at the mode's own frequency, which must not pass for neighbours.
const NEAREST: f64 = 1.2;
/// Up to this distance (decays of the mode) a line that nobody listed may beat with a mode whose pole
/// does not change, but is not looked for beside one that drifts: what the drift's model misses lies
/// there as well. Hum, which does not decay, is exempt.
const NEAR: f64 = 20.0;
/// Lines farther away than this (decays of the mode) are left alone: over a segment they average out.
const FAR: f64 = 100.0;
/// A line that decays less than this (decays of the mode) is hum.
const HUM: f64 = 0.1;
/// A listed mode nearer than this (decays of the mode) cannot be told from a drift by one decay:
/// the beat does not complete a cycle while the amplitude falls to 4 %.
const UNRESOLVED: f64 = 2.0;
/// Values over which power is averaged to see whether anything is above the noise.
const STRETCH: usize = 16;
/// Values that are kept at least.
const LEAST_VALUES: usize = 64;
/// A mode does not bend by more (rad) within half a segment while it can be followed at all.
const LARGEST_BEND: f64 = 0.3;
/// Companions below this share of the mode at the start are not reported.
const LEAST_SHARE: f64 = 1e-4;

/// What lies in the band beside the mode.
pub(super) struct Context {
    /// The best model of the whole decay; times count from the band's first value.
    pub model: Exponentials,
    /// Noise variance of the values.
    pub noise: f64,
    listed: usize,
}

struct Candidate {
    fit: Fit,
    criterion: f64,
}

/// The best model of a decay.
pub(super) fn explain(series: &[Complex64], band: &Band) -> Context {
    let noise = noise_variance(series, band);
    let series = &series[..audible(series, noise)];
    let whole = Whole {
        times: (0..series.len()).map(|n| n as f64 * band.step).collect(),
        series,
        band,
        noise,
    };
    let start = whole.start();
    let listed = start.others.len();
    let mut tracks = two_kinds(whole.listed_alone(&start));
    for _ in 0..MOST_FOUND {
        let best = lowest(&tracks);
        let grown: Vec<Candidate> = tracks
            .iter()
            .filter_map(|t| whole.grow(t, listed))
            .collect();
        if lowest(&grown) > best - WORTH {
            break;
        }
        tracks = two_kinds(tracks.into_iter().chain(grown).collect());
    }
    let best = tracks
        .into_iter()
        .min_by(|a, b| a.criterion.total_cmp(&b.criterion));
    match best {
        Some(best) => Context {
            // What a model of the whole decay misses is no noise.
            noise: whole.noise.min(best.fit.squares / series.len() as f64),
            model: best.fit.model,
            listed,
        },
        None => Context {
            model: start,
            noise: whole.noise,
            listed,
        },
    }
}

/// Values up to where their mean power over [`STRETCH`] sinks below twice the noise for the last time:
/// what comes after says nothing.
fn audible(series: &[Complex64], noise: f64) -> usize {
    let loud = |stretch: &[Complex64]| {
        let power: f64 = stretch.iter().map(Complex64::norm_sqr).sum();
        power > 2.0 * noise * stretch.len() as f64
    };
    let last = series.chunks(STRETCH).rposition(loud).unwrap_or(0);
    ((last + 1) * STRETCH).max(LEAST_VALUES).min(series.len())
}

fn lowest(candidates: &[Candidate]) -> f64 {
    let criteria = candidates.iter().map(|c| c.criterion);
    criteria.fold(f64::INFINITY, f64::min)
}

/// The best model with a pole that does not change, and the best with one that drifts.
fn two_kinds(mut all: Vec<Candidate>) -> Vec<Candidate> {
    all.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
    let (steady, drifting): (Vec<Candidate>, Vec<Candidate>) = all
        .into_iter()
        .partition(|candidate| candidate.fit.model.exponents.len() == 1);
    let first = |kind: Vec<Candidate>| kind.into_iter().next();
    [first(steady), first(drifting)]
        .into_iter()
        .flatten()
        .collect()
}

struct Whole<'a> {
    times: Vec<f64>,
    series: &'a [Complex64],
    band: &'a Band,
    noise: f64,
}

impl Whole<'_> {
    /// The mode and its listed neighbours as given.
    fn start(&self) -> Exponentials {
        let neighbours = self.band.neighbours.iter();
        Exponentials {
            amplitude: self.series.first().copied().unwrap_or(Complex64::ONE),
            exponents: vec![Complex64::from(self.band.decay)],
            rate: -RATE * self.band.decay,
            others: neighbours.map(|pole| (Complex64::ZERO, *pole)).collect(),
        }
    }

    fn listed_alone(&self, start: &Exponentials) -> Vec<Candidate> {
        let mut tracks: Vec<Candidate> = Vec::new();
        for degree in DEGREES {
            let mut model = match tracks.last() {
                Some(lower) => lower.fit.model.clone(),
                None => start.clone(),
            };
            model.exponents.resize(degree, Complex64::ZERO);
            tracks.extend(self.fit(model));
            // Twice worse in a row: more exponents only follow the noise.
            let criteria: Vec<f64> = tracks.iter().map(|track| track.criterion).collect();
            if matches!(criteria[..], [.., a, b, c] if a < b && b < c) {
                break;
            }
        }
        tracks
    }

    fn fit(&self, model: Exponentials) -> Option<Candidate> {
        let degree = model.exponents.len();
        let count = self.series.len();
        if count < 2 * model.parameters() {
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
        let unknowns = 2.0 * model.parameters() as f64;
        let fit = fit_exponentials(&self.times, self.series, model, &priors)?;
        let values = 2.0 * count as f64;
        let squares = fit.squares.max(f64::MIN_POSITIVE);
        let criterion = values * (squares / values).ln() + unknowns * values.ln();
        criterion
            .is_finite()
            .then_some(Candidate { fit, criterion })
    }

    /// The same model with the strongest line of what it leaves: one that decays like the mode, or one
    /// that stays, whichever takes more out.
    fn grow(&self, track: &Candidate, listed: usize) -> Option<Candidate> {
        let offset = self.strongest_line(&track.fit)?;
        let (amplitude, pole, _) = [self.band.decay, 0.0]
            .into_iter()
            .map(|decay| {
                let pole = Complex64::new(decay, offset);
                let (product, energy) = self.projected(&track.fit, pole);
                (product / energy, pole, product.norm_sqr() / energy)
            })
            .max_by(|a, b| a.2.total_cmp(&b.2))?;
        let mut model = track.fit.model.clone();
        model.others.push((amplitude, pole));
        self.fit(model)
            .filter(|grown| self.plausible(&grown.fit.model, listed))
    }

    /// Angular frequency (rad/s, relative to the band's middle) of the largest line in the residuals,
    /// outside what a drift makes.
    fn strongest_line(&self, fit: &Fit) -> Option<f64> {
        let size = (4 * fit.residuals.len()).next_power_of_two();
        let mut lines = fit.residuals.clone();
        lines.resize(size, Complex64::ZERO);
        FftPlanner::new().plan_fft_forward(size).process(&mut lines);
        let spacing = TAU / (size as f64 * self.band.step);
        let mode = fit.model.pole(self.band.scale).im;
        let offset = |k: usize| {
            let signed = if k < size / 2 {
                k as f64
            } else {
                k as f64 - size as f64
            };
            signed * spacing
        };
        let sigma = -self.band.decay;
        (0..size)
            .filter(|k| {
                let distance = (offset(*k) - mode).abs();
                (NEAREST * sigma..FAR * sigma).contains(&distance)
            })
            .max_by(|a, b| lines[*a].norm_sqr().total_cmp(&lines[*b].norm_sqr()))
            .map(offset)
    }

    /// A pole in the residuals: sum conj(e) r and sum |e|^2, whose quotient is its amplitude.
    fn projected(&self, fit: &Fit, pole: Complex64) -> (Complex64, f64) {
        let (mut product, mut energy) = (Complex64::ZERO, f64::MIN_POSITIVE);
        for (t, residual) in self.times.iter().zip(&fit.residuals) {
            let value = (pole * t).exp();
            product += value.conj() * residual;
            energy += value.norm_sqr();
        }
        (product, energy)
    }

    /// Lines nobody listed neither grow nor lie where a drift makes terms of its own.
    fn plausible(&self, model: &Exponentials, listed: usize) -> bool {
        let sigma = -self.band.decay;
        let mode = model.pole(self.band.scale);
        let drifts = model.exponents.len() > 1;
        let mut near = 0;
        for (_, pole) in model.others.iter().skip(listed) {
            let distance = (pole.im - mode.im).abs() / sigma;
            let hum = pole.re.abs() < HUM * sigma;
            near += usize::from(distance < NEAR && !hum);
            if distance < NEAREST || pole.re > HUM * sigma {
                return false;
            }
        }
        // A pair beats; several lines about a mode are what a drift looks like.
        near == 0 || (near == 1 && !drifts)
    }
}

impl Context {
    /// Whether a pole that does not change is the best model.
    fn unchanging(&self) -> bool {
        self.model.exponents.len() == 1
    }

    /// How the mode's exponent bends about the time t, at t + s; nothing where the fit has lost sight
    /// of the mode and its polynomial means nothing.
    pub fn bend(&self, t: f64, s: f64) -> Complex64 {
        let bend = self.model.bend(t, s);
        if bend.norm() < LARGEST_BEND {
            bend
        } else {
            Complex64::ZERO
        }
    }

    /// The lines fitted along, those that matter.
    pub fn companions(&self, band: &Band) -> Vec<Companion> {
        let mode = self.model.amplitude.norm();
        let others = self.model.others.iter().enumerate();
        others
            .map(|(k, (amplitude, pole))| Companion {
                tap: band.tap,
                frequency: band.frequency(*pole),
                share: amplitude.norm() / mode,
                origin: if k < self.listed {
                    Origin::Listed
                } else {
                    Origin::Found
                },
            })
            .filter(|companion| companion.share > LEAST_SHARE)
            .collect()
    }

    /// Why a change seen in this decay need not be one.
    pub fn doubt(&self, band: &Band) -> Option<AmplitudeVerdict> {
        let near = band
            .neighbours
            .iter()
            .find(|pole| pole.im.abs() < -UNRESOLVED * band.decay);
        if let Some(pole) = near {
            let frequency = band.frequency(*pole);
            return Some(AmplitudeVerdict::Unresolved { frequency });
        }
        let mode = band.frequency(self.model.pole(0.0));
        let strongest = self
            .companions(band)
            .into_iter()
            .filter(|companion| TAU * (companion.frequency - mode).abs() < -NEAR * band.decay)
            .max_by(|a, b| a.share.total_cmp(&b.share))?;
        let frequency = strongest.frequency;
        self.unchanging()
            .then_some(AmplitudeVerdict::Beating { frequency })
    }
}

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

/// A parameter known beforehand: index, value, and 1/variance (of both parts together).
#[derive(Debug, Clone, Copy)]
pub(super) struct Prior {
    pub parameter: usize,
    pub value: Complex64,
    pub weight: f64,
}

/// A fit.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub model: Exponentials,
    /// Sum of the squared residuals.
    pub squares: f64,
    /// (J^H J + priors)^-1; times the noise variance, the parameters' covariance.
    pub inverse: DMatrix<Complex64>,
    pub residuals: Vec<Complex64>,
}

const ITERATIONS: usize = 25;
/// Change of the sum of squares at which a fit has settled, relative.
const SETTLED: f64 = 1e-7;
/// Values beyond this are no amplitude any more.
const LARGEST: f64 = 1e100;

/// Fits a model to values at times; `None` when the unknowns cannot be told apart at all.
///
/// Priors take the noise variance as 1: scale their weights by it.
pub(super) fn fit_exponentials(
    times: &[f64],
    values: &[Complex64],
    start: Exponentials,
    priors: &[Prior],
) -> Option<Fit> {
    let mut model = start;
    let mut state = normal_equations(times, values, &model, priors)?;
    let mut damping = 1e-3;
    for _ in 0..ITERATIONS {
        let mut left = state.left.clone();
        for index in 0..left.nrows() {
            left[(index, index)] += damping * state.left[(index, index)].re + f64::MIN_POSITIVE;
        }
        let step = left.lu().solve(&state.right)?;
        let trial = model.moved(step.as_slice());
        let next = normal_equations(times, values, &trial, priors);
        match next.filter(|next| next.cost <= state.cost) {
            Some(next) => {
                let settled = state.cost - next.cost <= SETTLED * state.cost;
                model = trial;
                state = next;
                damping = (damping * 0.1).max(1e-12);
                if settled {
                    break;
                }
            }
            None if damping > 1e6 => break,
            None => damping *= 10.0,
        }
    }
    finish(model, state)
}

fn finish(model: Exponentials, state: State) -> Option<Fit> {
    // Scaled to a unit diagonal: amplitudes and poles differ by orders of magnitude.
    let size = state.left.nrows();
    let scale: Vec<f64> = (0..size)
        .map(|k| state.left[(k, k)].re.max(f64::MIN_POSITIVE).sqrt())
        .collect();
    let scaled = DMatrix::from_fn(size, size, |i, k| {
        state.left[(i, k)] / (scale[i] * scale[k])
    });
    let inverse = scaled.try_inverse()?;
    let inverse = DMatrix::from_fn(size, size, |i, k| inverse[(i, k)] / (scale[i] * scale[k]));
    Some(Fit {
        model,
        squares: state.residuals.iter().map(Complex64::norm_sqr).sum(),
        inverse,
        residuals: state.residuals,
    })
}

struct State {
    left: DMatrix<Complex64>,
    right: DVector<Complex64>,
    cost: f64,
    residuals: Vec<Complex64>,
}

fn normal_equations(
    times: &[f64],
    values: &[Complex64],
    model: &Exponentials,
    priors: &[Prior],
) -> Option<State> {
    let size = model.parameters();
    let mut products = vec![Complex64::ZERO; size * size];
    let mut right = DVector::zeros(size);
    let mut cost = 0.0;
    let mut row = Vec::with_capacity(size);
    let mut residuals = Vec::with_capacity(times.len());
    for (t, value) in times.iter().zip(values) {
        let residual = value - model.value(*t, &mut row);
        cost += residual.norm_sqr();
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
    let mut left = DMatrix::from_fn(size, size, |i, k| {
        if k <= i {
            products[i * size + k]
        } else {
            products[k * size + i].conj()
        }
    });
    let current = flat(model);
    for prior in priors {
        let away = prior.value - current[prior.parameter];
        left[(prior.parameter, prior.parameter)] += prior.weight;
        right[prior.parameter] += away * prior.weight;
        cost += away.norm_sqr() * prior.weight;
    }
    (cost < LARGEST).then_some(State {
        left,
        right,
        cost,
        residuals,
    })
}

fn flat(model: &Exponentials) -> Vec<Complex64> {
    let mut all = vec![model.amplitude];
    all.extend(&model.exponents);
    all.extend(model.others.iter().flat_map(|(c, p)| [*c, *p]));
    all
}
