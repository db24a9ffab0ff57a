//! One decay: what lies in the mode's band.
//!
//! Models of the whole decay are compared by Schwarz's criterion 2N ln(R/2N) + k ln(2N) (N complex
//! values, R sum of squared residuals, k real parameters): the mode with a pole that does not change
//! or with one that drifts, each with the listed neighbours and, one by one, with the strongest line
//! in what is left.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;
use rustfft::FftPlanner;

use super::band::{Band, DISTINCT, noise_variance};
use super::exponentials::{Exponentials, Fit, Prior, Times, fit_exponentials};
use super::{AmplitudeVerdict, Companion};
use crate::modal::Subspace;

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
/// Most growth of a mode from the band's first value back to the beginning of its decay (log amplitude). 1: the filter is at
/// most a third of a decay, and the damping is known within a factor of three.
const MOST_GROWTH: f64 = 1.0;
/// Most amplitude of a mode over the largest value of its band. 2: two lines of opposite sign that beat.
const MOST_EXCESS: f64 = 2.0;
/// Least decay beyond the last value above the noise (decays of the mode).
const LEAST_FALL: f64 = 0.3;
/// The exponent of a mode that can be followed bends by no more (rad) within half a segment.
const LARGEST_BEND: f64 = 0.3;
/// Companions below this share of the mode at the start are not reported.
const LEAST_SHARE: f64 = 1e-4;

/// The best model of a whole decay: the mode, and what lies in its band beside it.
pub(super) struct DecayModel {
    /// The model; times count from the band's first value.
    pub exponentials: Exponentials,
    /// Noise variance of the values.
    pub noise: f64,
    /// Time of the last value that is above the noise.
    last: f64,
    /// Largest modulus of the values.
    largest: f64,
    /// True where a model could be fitted.
    is_fitted: bool,
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
        let whole = WholeDecay::new(series, band);
        let noise = whole.noise;
        let largest = series.iter().fold(0.0, |most: f64, x| most.max(x.norm()));
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
                last: whole.last(),
                largest,
                noise: noise.min(best.fit.squares / whole.series.len() as f64),
                is_fitted: true,
                ways: Vec::new(),
                evidence: whole.evidence(&best.fit.model),
                exponentials: best.fit.model,
            },
            None => DecayModel {
                last: whole.last(),
                largest,
                exponentials: start,
                noise,
                is_fitted: false,
                ways: Vec::new(),
                evidence: Evidence::default(),
            },
        }
    }

    /// Fits the models from which [`frequency_at`](Self::frequency_at) takes its mean. `series` and `band` are those of
    /// the fit.
    pub fn add_ways(&mut self, series: &[Complex64], band: &Band) {
        if self.is_fitted {
            self.ways = WholeDecay::new(series, band).with_more_exponents(&self.exponentials);
        }
    }

    /// Returns how the mode's exponent bends about the time t, at t + s. It is 0 where the fit has lost
    /// the mode and its polynomial means nothing.
    pub fn bend(&self, t: f64, s: f64) -> Complex64 {
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

impl<'a> WholeDecay<'a> {
    fn new(series: &'a [Complex64], band: &'a Band) -> Self {
        let noise = noise_variance(series, band);
        // Beyond the last stretch with twice the power of noise the values say nothing.
        let last = series.chunks(STRETCH).rposition(|stretch| {
            let power: f64 = stretch.iter().map(Complex64::norm_sqr).sum();
            power > 2.0 * noise * stretch.len() as f64
        });
        let above_noise = (last.unwrap_or(0) + 1) * STRETCH;
        WholeDecay {
            series: &series[..above_noise.max(LEAST_VALUES).min(series.len())],
            band,
            noise,
        }
    }

    /// Times of the values.
    fn times(&self) -> Times {
        Times {
            first: 0.0,
            step: self.band.step,
            count: self.series.len(),
        }
    }

    /// Time of the last value.
    fn last(&self) -> f64 {
        (self.series.len() - 1) as f64 * self.band.step
    }

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
        let fit = fit_exponentials(self.times(), self.series, model, &priors)?;
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
    fn with_more_exponents(&self, best: &Exponentials) -> Vec<Candidate> {
        let own = best.exponents.len().max(LINEAR_DRIFT);
        let mut all: Vec<Candidate> = Vec::new();
        for degree in DEGREES.into_iter().filter(|degree| *degree >= own) {
            let mut model = all.last().map_or(best, |fewer| &fewer.fit.model).clone();
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
            for (value, residual) in self.times().exponentials(pole).iter().zip(residuals) {
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

impl DecayModel {
    /// Returns the amplitude at a time before or after the band's first value (unit of the sensor).
    pub fn amplitude(&self, t: f64, band: &Band) -> f64 {
        self.exponentials.log_amplitude(t, band).exp()
    }

    /// Returns true where the amplitude may be that of a mode: it does not grow too much towards the beginning of the decay,
    /// nor is it far above what the band holds because another line takes it away.
    pub fn is_sound(&self, band: &Band) -> bool {
        let [start, first] =
            [-0.5 * band.filter, 0.0].map(|t| self.exponentials.log_amplitude(t, band));
        start - first < MOST_GROWTH && first < (MOST_EXCESS * self.largest).ln()
    }

    /// Decay of the mode (1/s), positive: its mean until the amplitude has fallen to a tenth.
    pub fn mean_decay(&self, band: &Band) -> f64 {
        let first = self.exponentials.log_amplitude(0.0, band);
        let amplitude = (first + 0.1f64.ln()).exp();
        let until = self.exponentials.time_at(amplitude, self.last, band);
        let until = until.unwrap_or(self.last);
        (first - self.exponentials.log_amplitude(until, band)) / until
    }

    /// Lowest and highest frequency (Hz) of the mode while its amplitude falls to a tenth.
    pub fn frequencies(&self, band: &Band) -> (f64, f64) {
        const PARTS: usize = 50;
        let first = -0.5 * band.filter;
        let last = self.last.min(0.1f64.ln() / band.decay);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for part in 0..=PARTS {
            let t = first + (last - first) * part as f64 / PARTS as f64;
            let frequency = band.frequency(self.exponentials.pole(t));
            (low, high) = (low.min(frequency), high.max(frequency));
        }
        (low, high)
    }

    /// Returns the mode's share in every sensor: its complex amplitude over that of the series that was fitted.
    pub fn shares(&self, band: &Band) -> Vec<Complex64> {
        let model = &self.exponentials;
        let count = band.sensors.iter().map(Vec::len).min().unwrap_or(0);
        let rows = count.min((self.last / band.step) as usize + 1);
        let others = DMatrix::from_fn(rows, model.others.len(), |n, place| {
            (model.others[place].1 * (n as f64 * band.step)).exp()
        });
        let beside = Subspace::new(&others, DISTINCT);
        let mode = DMatrix::from_fn(rows, 1, |n, _| {
            model.amplitude * model.exponent(n as f64 * band.step).exp()
        });
        let mode = beside.complement(mode);
        let energy = mode.norm_squared().max(f64::MIN_POSITIVE);
        let shares = band.sensors.iter().map(|values| {
            let values = DMatrix::from_fn(rows, 1, |n, _| values[n]);
            mode.dotc(&values) / energy
        });
        shares.collect()
    }

    /// Returns the mode on the first samples of the decay, as an oscillation of which sensors show real parts of shares.
    /// After the last value above the noise the pole stays.
    pub fn ring(&self, band: &Band, samples: usize) -> Vec<Complex64> {
        let model = &self.exponentials;
        let middle = (band.taps.len() - 1) as f64 / 2.0;
        let mut end = model.pole(self.last);
        end.re = end.re.min(LEAST_FALL * band.decay);
        let stride = (band.step * band.sample_rate).round().max(1.0) as usize;
        let mut gain = Complex64::ONE;
        let values = (0..samples).map(|n| {
            let t = (n as f64 - middle) / band.sample_rate;
            let known = t.min(self.last);
            if n % stride == 0 && t <= self.last {
                gain = band.gain(model.pole(known));
            }
            let exponent = model.exponent(known) + end * (t - known);
            let turn = Complex64::new(0.0, band.omega * t);
            model.amplitude * (exponent + turn).exp() / gain
        });
        values.collect()
    }

    /// Returns the frequency (Hz) at an amplitude (unit of the sensor) and its standard uncertainty, as the mean over
    /// the models that were added; `None` where the decay does not reach that amplitude.
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
