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
const DEGREES: [usize; 4] = [1, 2, 4, 6];
/// Most lines looked for beyond the listed ones.
const MOST_FOUND: usize = 3;
/// A line counts when it improves the criterion by more than this: odds of 150 to one.
const WORTH: f64 = 10.0;
/// Least distance of a line that nobody listed from the mode (decays of the mode): a drift alone makes
/// terms e^{(p - n sigma) t} at the mode's own frequency, which must not pass for neighbours.
const NEAREST: f64 = 2.0;
/// A listed mode nearer than this (decays of the mode) cannot be told from a drift by one decay:
/// the beat does not complete a cycle while the amplitude falls to 4 %.
const UNRESOLVED: f64 = 2.0;
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
    let times: Vec<f64> = (0..series.len()).map(|n| n as f64 * band.step).collect();
    let whole = Whole {
        times,
        series,
        band,
        noise: noise_variance(series, band),
    };
    let start = whole.start();
    let listed = start.others.len();
    let mut tracks = whole.listed_alone(&start);
    for _ in 0..MOST_FOUND {
        let best = lowest(&tracks);
        let grown: Vec<Candidate> = tracks
            .iter()
            .filter_map(|t| whole.grow(t, listed))
            .collect();
        if lowest(&grown) > best - WORTH {
            break;
        }
        tracks = keep_better(tracks, grown);
    }
    let best = tracks
        .into_iter()
        .min_by(|a, b| a.criterion.total_cmp(&b.criterion));
    match best {
        Some(best) => Context {
            noise: best.fit.squares / series.len() as f64,
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

fn lowest(candidates: &[Candidate]) -> f64 {
    let criteria = candidates.iter().map(|c| c.criterion);
    criteria.fold(f64::INFINITY, f64::min)
}

/// Of each degree the better one: with the line or without.
fn keep_better(tracks: Vec<Candidate>, grown: Vec<Candidate>) -> Vec<Candidate> {
    let mut all: Vec<Candidate> = tracks.into_iter().chain(grown).collect();
    all.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in all {
        let degree = candidate.fit.model.exponents.len();
        if !kept.iter().any(|k| k.fit.model.exponents.len() == degree) {
            kept.push(candidate);
        }
    }
    kept
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
        let criterion = values * (fit.squares / values).ln() + unknowns * values.ln();
        criterion
            .is_finite()
            .then_some(Candidate { fit, criterion })
    }

    /// The same model with the strongest line of what it leaves: one that decays like the mode, or one
    /// that stays, whichever fits.
    fn grow(&self, track: &Candidate, listed: usize) -> Option<Candidate> {
        let offset = self.strongest_line(&track.fit)?;
        [self.band.decay, 0.0]
            .into_iter()
            .filter_map(|decay| {
                let mut model = track.fit.model.clone();
                let pole = Complex64::new(decay, offset);
                model.others.push((self.projected(&track.fit, pole), pole));
                self.fit(model)
            })
            .filter(|grown| self.plausible(&grown.fit.model, listed))
            .min_by(|a, b| a.criterion.total_cmp(&b.criterion))
    }

    /// Angular frequency (rad/s, relative to the band's middle) of the largest line in the residuals,
    /// outside what a drift makes.
    fn strongest_line(&self, fit: &Fit) -> Option<f64> {
        let size = (4 * fit.residuals.len()).next_power_of_two();
        let mut lines = fit.residuals.clone();
        lines.resize(size, Complex64::ZERO);
        FftPlanner::new().plan_fft_forward(size).process(&mut lines);
        let spacing = TAU / (size as f64 * self.band.step);
        let mode = fit.model.exponents.first()?.im;
        let offset = |k: usize| {
            let signed = if k < size / 2 {
                k as f64
            } else {
                k as f64 - size as f64
            };
            signed * spacing
        };
        (0..size)
            .filter(|k| (offset(*k) - mode).abs() > -NEAREST * self.band.decay)
            .max_by(|a, b| lines[*a].norm_sqr().total_cmp(&lines[*b].norm_sqr()))
            .map(offset)
    }

    /// Amplitude of a pole in the residuals: sum conj(e) r / sum |e|^2.
    fn projected(&self, fit: &Fit, pole: Complex64) -> Complex64 {
        let (mut product, mut energy) = (Complex64::ZERO, f64::MIN_POSITIVE);
        for (t, residual) in self.times.iter().zip(&fit.residuals) {
            let value = (pole * t).exp();
            product += value.conj() * residual;
            energy += value.norm_sqr();
        }
        product / energy
    }

    /// Lines nobody listed neither grow nor lie where a drift makes terms of its own.
    fn plausible(&self, model: &Exponentials, listed: usize) -> bool {
        let Some(mode) = model.exponents.first() else {
            return false;
        };
        let sigma = -self.band.decay;
        model.others.iter().skip(listed).all(|(_, pole)| {
            let distance = (pole.im - mode.im).abs();
            distance > NEAREST * sigma && pole.re < 0.2 * sigma
        })
    }
}

impl Context {
    /// Whether a pole that does not change is the best model.
    fn unchanging(&self) -> bool {
        self.model.exponents.len() == 1
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
        let strongest = self
            .companions(band)
            .into_iter()
            .max_by(|a, b| a.share.total_cmp(&b.share))?;
        let frequency = strongest.frequency;
        self.unchanging()
            .then_some(AmplitudeVerdict::Beating { frequency })
    }
}
