//! The fixture's own resonance as a datum: a peak that belongs to no mode of the beam.
//!
//! A fixture is a hypothesis only where its own resonance is seen, or lies above all searched frequencies. Otherwise
//! it would explain much, and predict a peak that is missing.
//!
//! Peaks of other causes (torsion, bending the other way, something on the structure) may stand anywhere
//! between the lowest and the highest mode. Under every hypothesis each has the same density 1/B over
//! the logarithm of the frequency, B being the logarithm of the band. A fixture adds a mode of its own,
//! at x_b, which is read with a probability v that follows from how strongly sensors and hammer meet it,
//! and which may be any of the n peaks. The peaks x_1 .. x_n then count for it with
//!
//! ```text
//! p(peaks | fixture)      v
//! --------------------  = - sum_i B delta(x_i - x_b)
//! p(peaks | any other)    n
//! ```
//!
//! Each peak gives one fit, and the peak states its frequency. Let s = d x_b/d ln(frequency of the fixture alone). The
//! prior of that logarithm has the density 1/R. Integration over it gives the factor v B/(n R s). A fixture above all
//! searched frequencies has the remaining share of R. A peak whose strength does not suit the fixture refutes the fit.

use crate::dataset::{Dataset, chi_square_tail};
use crate::evidence::{Fit, LocalOptimum, evaluate, linear_fit, log_sum};
use crate::forward::Forward;
use crate::modal_model::fixture_strength;
use crate::observations::{DECIBEL, FIXTURE_FREQUENCY_STD, UnpairedPeak};
use crate::parameters::{LocationKind, Prior};
use std::f64::consts::TAU;
use tapjoint_numerics::stats::median;

/// Standard deviation (dB) of the level at which a fixture's peak is read: damping of the fixture and noise, within a
/// factor of two or three.
const LEVEL_STD: f64 = 8.0;
/// Standard deviation of the logarithm of the modal constant of a fixture's own mode about the model's, a factor
/// of 1.6: the model's fixture only rocks about the joint.
const STRENGTH_STD: f64 = 0.5;
/// Range of the logarithm of the modal constant of peaks of other causes: 60 dB.
const STRENGTH_RANGE: f64 = 6.9;

/// Returns the probability that a peak is not read which is this much (dB) over the level at which half are.
fn missed(over: f64) -> f64 {
    let away = over / LEVEL_STD;
    let tail = two_sided(away) / 2.0;
    if away > 0.0 { tail } else { 1.0 - tail }
}

/// Returns the probability of a normal deviate as large, of either sign.
fn two_sided(deviate: f64) -> f64 {
    chi_square_tail(deviate * deviate, 1.0).unwrap_or(1.0)
}

/// The fixture's own mode at some parameters, in the mean of all configurations.
struct FixtureMode {
    /// Logarithm of its measured frequency.
    log: f64,
    /// Share of the fixture in its kinetic energy: d x_b/d ln(frequency of the fixture alone), since
    /// Rayleigh's quotient is stationary.
    share: f64,
    /// Level (dB) of its peak over that at which half are read; `None` where it is not determined.
    over: Option<f64>,
    /// Logarithm of its modal constant (1/kg) in each configuration.
    constants: Vec<Option<f64>>,
}

impl FixtureMode {
    fn new(forward: &Forward<'_>, parameters: &[f64]) -> Option<Self> {
        let models = forward.solve(parameters)?;
        let (dataset, peaks) = (forward.dataset, &forward.dataset.peaks);
        let thresholds = &dataset.settings.thresholds;
        let mut own = FixtureMode {
            log: 0.0,
            share: 0.0,
            over: None,
            constants: Vec::new(),
        };
        let mut over = Vec::new();
        let count = models.len() as f64;
        for (index, (one, arrangement)) in models.iter().zip(&dataset.arrangements).enumerate() {
            let (fixture, frequency) = one.fixture_frequency()?;
            own.log += frequency.ln() / count;
            own.share += one.modes().base_participation(fixture) / count;
            let sensors: Vec<f64> = arrangement.sensors.iter().map(|s| s.position).collect();
            let numbers = (1..=dataset.fitted_modes).filter_map(|mode| one.index(mode));
            let (numbers, tap) = (numbers.collect::<Vec<_>>(), arrangement.tap);
            let strength = fixture_strength(one.modes(), fixture, &numbers, &sensors, tap);
            own.constants.push(strength.map(|strength| strength.own));
            if let (Some(strength), Some(read)) = (strength, peaks.searched.get(&index)) {
                let half = strength.median + thresholds.fixture_level / DECIBEL;
                let least = read.map_or(half, |least| half.min(least));
                over.push(DECIBEL * (strength.own - least));
            }
        }
        let is_determined =
            peaks.contains(own.log) && !peaks.is_doubtful(own.log, thresholds.near_fixture);
        // No mode of the beam is so near that both are read as one.
        let is_apart = models.iter().all(|one| {
            let mut frequencies = (1..).map_while(|mode| one.frequency(mode));
            frequencies.all(|frequency| (frequency.ln() - own.log).abs() >= thresholds.split_pole)
        });
        if !over.is_empty() && is_determined && is_apart {
            own.over = Some(median(&mut over));
        }
        Some(own)
    }

    /// Returns the probability that its peak is not read.
    fn missed(&self) -> f64 {
        self.over.map_or(1.0, missed)
    }

    /// Returns by how many standard deviations a peak is stronger than this mode, and the standard deviation. The size
    /// is known to the relative one of `size_std`, and the constant of a weak mode grows with it.
    fn excess_of(&self, peak: &UnpairedPeak, size_std: f64) -> Option<(f64, f64)> {
        let pairs = peak.constants.iter();
        let mut all: Vec<f64> = pairs
            .filter_map(|(index, log)| Some(log - self.constants.get(*index).copied()??))
            .collect();
        let std = STRENGTH_STD.hypot(size_std);
        (!all.is_empty()).then(|| (median(&mut all) / std, std))
    }

    /// Returns the logarithm of the density of a peak's strength over that of a peak of another cause.
    fn log_strength(&self, peak: &UnpairedPeak, size_std: f64) -> f64 {
        self.excess_of(peak, size_std).map_or(0.0, |(away, std)| {
            STRENGTH_RANGE.ln() - 0.5 * away * away - (std * TAU.sqrt()).ln()
        })
    }
}

/// Returns the relative standard deviation of the size of the fixture whose frequency is the parameter `at`.
fn size_std(found: &LocalOptimum, at: usize) -> f64 {
    let size = found.optimum.parameters[at - 1].abs();
    found.std(at - 1).map_or(f64::INFINITY, |std| std / size)
}

/// Returns the probability of a strength as far from the predicted one, of the peak that states the frequency of a fit's
/// fixture. `None` for fits without a fixture, or with one above all that was looked at.
pub fn goodness(dataset: &Dataset, fit: &Fit) -> Option<f64> {
    let forward = Forward::new(dataset, &fit.effects);
    let at = forward
        .layout
        .location_of_kind(LocationKind::FixtureFrequency)?;
    if !fit.best.priors[at].std.is_finite() {
        return None;
    }
    let own = FixtureMode::new(&forward, fit.parameters())?;
    let peaks = dataset.peaks.all.iter();
    let distances = peaks.map(|peak| ((peak.log - own.log).abs(), peak));
    let (_, peak) = distances.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let (excess, _) = own.excess_of(peak, size_std(&fit.best, at))?;
    Some(two_sided(excess))
}

/// Lowest and highest frequency of a fixture (Hz), for a rig on a soft table and for a vice. The prior is uniform in
/// the logarithm. A band that reaches further widens it: to its end below, to four times its end above.
const FIXTURES: [f64; 2] = [30.0, 2000.0];

/// Returns the lowest and the highest frequency (Hz) of a fixture whose resonance was not looked for: above this `end` of
/// the band.
pub fn unseen_frequencies(end: f64) -> [f64; 2] {
    [end, FIXTURES[1].max(4.0 * end)]
}

/// Returns the fit with those in addition whose fixture has the frequency of a peak; any other as it is. `without` is
/// the fit without the last effect. `fit` has a fixture above all that was looked at.
pub fn with_peaks(forward: &Forward<'_>, fit: Fit, without: &Fit) -> Fit {
    let peaks = &forward.dataset.peaks;
    let Some(at) = forward
        .layout
        .location_of_kind(LocationKind::FixtureFrequency)
    else {
        return fit;
    };
    let [from, to] = unseen_frequencies(peaks.end);
    let range = (to / FIXTURES[0].min(from)).ln();
    let mut all = vec![(
        fit.log_evidence + ((to / from).ln() / range).ln(),
        fit.best.clone(),
    )];
    if let Some((low, high)) = peaks.band {
        let factor = ((high - low) / range / peaks.all.len().max(1) as f64).ln();
        for peak in &peaks.all {
            let search = PeakSearch { forward, at, peak };
            if let Some((found, own)) = search.best(&fit.best, without) {
                let strength = own.log_strength(peak, size_std(&found, at));
                let seen = (1.0 - own.missed()).ln() + strength;
                let log = found.log_evidence + factor + seen - own.share.ln();
                all.push((log, found));
            }
        }
    }
    let logs: Vec<f64> = all.iter().map(|one| one.0).collect();
    let best = all.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
    Fit {
        best: best.map_or(fit.best, |one| one.1),
        log_evidence: log_sum(&logs),
        ..fit
    }
}

/// Search for a fit whose fixture has its own mode at a peak; `at` is the parameter of the fixture's frequency.
struct PeakSearch<'a> {
    forward: &'a Forward<'a>,
    at: usize,
    peak: &'a UnpairedPeak,
}

impl PeakSearch<'_> {
    /// Returns the best fit: from a fit with another frequency, and from the optimum of the model linearised there.
    fn best(&self, other: &LocalOptimum, without: &Fit) -> Option<(LocalOptimum, FixtureMode)> {
        let forward = self.forward;
        let mut starts = vec![other.optimum.parameters.clone()];
        starts[0][self.at] = self.peak.log;
        if forward.layout.location(forward.layout.effects.len() - 1) == Some(self.at) {
            let mut held = forward.priors();
            held[self.at] = Prior::held(self.peak.log);
            let linear = linear_fit(forward, without, &held, Some(self.peak.log));
            starts.extend(linear.map(|optimum| optimum.parameters));
        }
        let priors = &other.priors;
        // From each start first with the frequency held, then as well known as the peak states it.
        let found = starts.into_iter().filter_map(|start| {
            let start = self.tuned(start)?;
            let (held, own) = self.with_frequency(&start, priors, Prior::held(start[self.at]))?;
            let start = self.tuned(held.optimum.parameters)?;
            let stated = Prior::normal(start[self.at], self.peak.std / own.share);
            self.with_frequency(&start, priors, stated)
        });
        found.max_by(|a, b| a.0.log_evidence.total_cmp(&b.0.log_evidence))
    }

    /// Returns the fit with this prior of the fixture's frequency.
    fn with_frequency(
        &self,
        start: &[f64],
        priors: &[Prior],
        frequency: Prior,
    ) -> Option<(LocalOptimum, FixtureMode)> {
        let mut priors = priors.to_vec();
        priors[self.at] = frequency;
        let found = evaluate(self.forward, &priors, start)?;
        let own = FixtureMode::new(self.forward, &found.optimum.parameters)?;
        Some((found, own))
    }

    /// Gives the fixture the frequency with which its own mode is at the peak (Newton's method).
    fn tuned(&self, mut parameters: Vec<f64>) -> Option<Vec<f64>> {
        const ROUNDS: usize = 12;
        for _ in 0..ROUNDS {
            let own = FixtureMode::new(self.forward, &parameters)?;
            let away = self.peak.log - own.log;
            if away.abs() < 0.1 * FIXTURE_FREQUENCY_STD {
                return Some(parameters);
            }
            // If the fixture shares its mode with the beam a full step leads past it.
            parameters[self.at] += (away / own.share).clamp(-0.2, 0.2);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn own(over: f64) -> FixtureMode {
        FixtureMode {
            log: 0.0,
            share: 1.0,
            over: Some(over),
            constants: vec![Some(0.0)],
        }
    }

    /// The normal distribution's 2.5 % at 1.959964 standard deviations.
    #[test]
    fn val_a_peak_is_missed_as_a_normal_deviate_says() {
        assert!((missed(0.0) - 0.5).abs() < 1e-12);
        assert!((missed(1.959_964 * LEVEL_STD) - 0.025).abs() < 1e-6);
        assert!((missed(-1.959_964 * LEVEL_STD) - 0.975).abs() < 1e-6);
    }

    /// Over all strengths the density integrates to that of a peak of another cause.
    #[test]
    fn val_the_density_of_a_strength_is_normalised() {
        let step = 0.01;
        let sum: f64 = (-2000..2000)
            .map(|k| {
                let peak = UnpairedPeak {
                    log: 0.0,
                    std: FIXTURE_FREQUENCY_STD,
                    constants: vec![(0, step * f64::from(k))],
                };
                step * own(0.0).log_strength(&peak, 0.1).exp() / STRENGTH_RANGE
            })
            .sum();
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    }
}
