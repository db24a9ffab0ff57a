//! What else lies in a mode's band, and whether poles that do not change explain the whole decay.
//!
//! Models of the whole decay are compared by Schwarz's criterion 2N ln(R/2N) + k ln(2N) (N complex
//! values, R sum of squared residuals, k real parameters): the mode with a pole that does not change
//! or with one that drifts, each with the listed neighbours and, one by one, with the strongest line
//! in what is left.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rustfft::FftPlanner;

use super::band::Band;
use super::exponentials::Exponentials;
use super::fit::{Fit, Prior, fit_exponentials};
use super::sensors::noise_variance;
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
