//! The fixture's own resonance as a reading: a peak that belongs to no mode of the beam.
//!
//! Peaks that are nobody's (torsion, bending the other way, something on the structure) may stand anywhere
//! between the lowest and the highest mode; whatever the hypothesis, each has the same density 1/B over
//! the logarithm of the frequency, B being the logarithm of the band. A fixture adds a mode of its own,
//! at x_b, which is read with a probability v that follows from how strongly sensors and hammer meet it,
//! and which may be any of the n peaks. What the peaks x_1 .. x_n say for it is then
//!
//! ```text
//! p(peaks | fixture)/p(peaks | any other) = (1 - v) + v/n sum_i B delta(x_i - x_b)
//! ```
//!
//! Integrated with the likelihood of all other readings over the fixture's frequency, every peak gives a
//! fit whose frequency the peak states, worth v B/n of what it explains, and what is left is the fit
//! without a peak, worth 1 - v of it: nothing changes where the mode lies outside the band or is too
//! weak (v = 0), and a fixture of no size has no peak. A fit that should show a peak and has none is
//! refuted with the probability 1 - v; one whose frequency is stated, by how well it fits.

use super::catalogue::PlaceKind;
use super::evidence::{Branch, covariance, evaluate, log_sum};
use super::forward::Forward;
use super::frame::Frame;
use super::hypothesis::{Fit, Search};
use super::least_squares::Knowledge;
use super::lone_peaks::{DECIBEL, Peak, STATED};
use super::noise::chi_square_tail;
use super::setup::TWIN;
use super::solved::Solved;
use std::f64::consts::TAU;
use tapjoint_beam::specimen::SpecimenModes;

/// Logarithms of a mode's modal constant (1/kg) at the strongest sensor and of the median one of the beam's
/// modes; without a place of the hammer as if it struck there.
pub(super) fn strength(
    modes: &SpecimenModes,
    (base, numbers): (usize, &[usize]),
    (sensors, tap): (&[f64], Option<f64>),
) -> Option<(f64, f64)> {
    let constant = |mode: usize| {
        let at = |x: f64| modes.displacement(mode, x).abs();
        let most = sensors.iter().map(|x| at(*x)).fold(0.0, f64::max);
        (most * tap.map_or(most, at)).ln()
    };
    let mut all: Vec<f64> = numbers.iter().map(|mode| constant(*mode)).collect();
    if all.is_empty() || sensors.is_empty() {
        return None;
    }
    let strength = (constant(base), tapjoint_numerics::stats::median(&mut all));
    (strength.0.is_finite() && strength.1.is_finite()).then_some(strength)
}

/// Level (dB) over the median mode of the beam at which a peak is read half of the time. At resonance the
/// accelerance is the modal constant over twice the damping ratio; with 60 to 80 dB between the strongest
/// modes and the noise, 15 over it for a peak, and a fixture damped up to ten times as much as a beam, 40 to
/// 60 dB are left.
pub(super) const SEEN: f64 = -50.0;
/// Standard deviation (dB) of what is not known of it: a fixture's damping and the noise, within a factor
/// of two or three.
const UNKNOWN: f64 = 8.0;

/// Probability that a peak is not read which is this much (dB) over the level at which half are.
fn missed(over: f64) -> f64 {
    let away = over / UNKNOWN;
    let tail = two_sided(away) / 2.0;
    if away > 0.0 { tail } else { 1.0 - tail }
}

/// Probability of a normal deviate as large, of either sign.
fn two_sided(deviate: f64) -> f64 {
    chi_square_tail(deviate * deviate, 1.0).unwrap_or(1.0)
}

/// The fixture's own mode at some parameters, in the mean of all configurations.
struct Own {
    /// Logarithm of its frequency as it is read.
    log: f64,
    /// Share of the fixture in its kinetic energy: d x_b/d ln(frequency of the fixture alone), since
    /// Rayleigh's quotient is stationary.
    share: f64,
    /// Level (dB) of its peak over that at which half are read; `None` where it can not be told.
    over: Option<f64>,
    /// Logarithm of its modal constant (1/kg) in each configuration.
    constants: Vec<Option<f64>>,
}

impl Own {
    fn new(forward: &Forward<'_>, parameters: &[f64]) -> Option<Self> {
        let solved = forward.solve(parameters)?;
        let peaks = &forward.frame.peaks;
        let mut own = Own {
            log: 0.0,
            share: 0.0,
            over: None,
            constants: Vec::new(),
        };
        let mut over = Vec::new();
        let count = solved.len() as f64;
        for (index, (one, setup)) in solved.iter().zip(&forward.frame.setups).enumerate() {
            let base = one.base()?;
            own.log += one.seen.read(one.modes().frequencies()[base]).ln() / count;
            own.share += one.modes().base_participation(base) / count;
            let sensors: Vec<f64> = setup.sensors.iter().map(|s| s.position).collect();
            let numbers: Vec<usize> = (1..=forward.frame.fitted_modes)
                .filter_map(|mode| one.index(mode))
                .collect();
            let found = strength(one.modes(), (base, &numbers), (&sensors, setup.tap));
            own.constants.push(found.map(|found| found.0));
            let looked = peaks.looked.iter().find(|looked| looked.0 == index);
            over.extend(found.zip(looked).map(|((constant, median), looked)| {
                let half = median + SEEN / DECIBEL;
                DECIBEL * (constant - looked.1.map_or(half, |weak| half.min(weak)))
            }));
        }
        let is_told = peaks.contains(own.log) && !peaks.is_hinted(own.log);
        if !over.is_empty() && is_told && apart(&solved, own.log) {
            own.over = Some(tapjoint_numerics::stats::median(&mut over));
        }
        Some(own)
    }

    /// Probability that its peak is not read.
    fn missed(&self) -> f64 {
        self.over.map_or(1.0, missed)
    }

    /// The same over all sizes that a fit leaves open, normal about `size` and above nothing: the constant of a
    /// weak mode is proportional to the size.
    fn missed_by_size(&self, (size, std): (f64, f64)) -> f64 {
        const STEPS: usize = 400;
        let Some(over) = self.over else { return 1.0 };
        let first = (size - 5.0 * std).max(0.0);
        let step = (size + 5.0 * std - first) / STEPS as f64;
        let (mut all, mut unread) = (0.0, 0.0);
        for k in 0..STEPS {
            let own = first + step * (k as f64 + 0.5);
            let weight = (-0.5 * ((own - size) / std).powi(2)).exp();
            all += weight;
            unread += weight * missed(over + 20.0 * (own / size).log10());
        }
        unread / all
    }

    /// By how many standard deviations a peak is stronger than this mode, and the standard deviation; the size
    /// is known to the relative one of `size_std`, and the constant of a weak mode grows with it.
    fn short_of(&self, peak: &Peak, size_std: f64) -> Option<(f64, f64)> {
        let pairs = peak.constants.iter();
        let mut all: Vec<f64> = pairs
            .filter_map(|(index, log)| Some(log - self.constants.get(*index).copied()??))
            .collect();
        let std = STRENGTH.hypot(size_std);
        (!all.is_empty()).then(|| (tapjoint_numerics::stats::median(&mut all) / std, std))
    }

    /// Logarithm of the density of a peak's strength over that of a peak which is nobody's.
    fn log_strength(&self, peak: &Peak, size_std: f64) -> f64 {
        self.short_of(peak, size_std).map_or(0.0, |(away, std)| {
            ANY_STRENGTH.ln() - 0.5 * away * away - (std * TAU.sqrt()).ln()
        })
    }
}

/// Standard deviation of the logarithm of the modal constant of a fixture's own mode about the model's, a factor
/// of 1.6: the model's fixture rocks about the joint and does nothing else.
const STRENGTH: f64 = 0.5;
/// Range of the logarithm of the modal constant of peaks that are nobody's: 60 dB.
const ANY_STRENGTH: f64 = 6.9;

/// Relative standard deviation of the size of the fixture whose frequency is the parameter `at`.
fn size_std(branch: &Branch, at: usize) -> f64 {
    let size = branch.optimum.parameters[at - 1].abs();
    let spread = covariance(&branch.knowledge, &branch.optimum);
    spread.map_or(f64::INFINITY, |c| {
        c[(at - 1, at - 1)].max(0.0).sqrt() / size
    })
}

/// Whether no mode of the beam is so near that both are read as one.
fn apart(solved: &[Solved], log: f64) -> bool {
    let near = |one: &Solved| {
        let mut modes = (1..).map_while(|mode| one.frequency(mode));
        modes.any(|frequency| (frequency.ln() - log).abs() < TWIN)
    };
    !solved.iter().any(near)
}

/// Place of the fixture's frequency among the parameters, where there is one.
fn place(forward: &Forward<'_>) -> Option<usize> {
    let layout = &forward.layout;
    let is_fixture = |effect: &usize| {
        let range = layout.effects[*effect].place;
        range.is_some_and(|range| range.kind == PlaceKind::FixtureFrequency)
    };
    layout.place((0..layout.effects.len()).find(is_fixture)?)
}

/// How probable the peak, or its absence, is under a fit with a fixture: where a peak states its frequency, that
/// of a strength as far from the predicted one; elsewhere, that of its own peak not being read. `None` of
/// fits without a fixture.
pub(super) fn goodness(frame: &Frame, fit: &Fit) -> Option<f64> {
    let forward = Forward::new(frame, &fit.effects);
    let at = place(&forward)?;
    if !fit.branch.knowledge[at].std.is_finite() {
        return unread(&forward, at, &fit.branch);
    }
    let own = Own::new(&forward, &fit.branch.optimum.parameters)?;
    let away = |peak: &&Peak| (peak.log - own.log).abs();
    let mut peaks = frame.peaks.all.iter();
    let peak = peaks.by_ref().min_by(|a, b| away(a).total_cmp(&away(b)))?;
    let (short, _) = own.short_of(peak, size_std(&fit.branch, at))?;
    Some(two_sided(short))
}

/// Probability that the peak is not read, over the sizes that the fit leaves open.
fn unread(forward: &Forward<'_>, at: usize, branch: &Branch) -> Option<f64> {
    let parameters = &branch.optimum.parameters;
    let size = parameters[at - 1];
    let std = size * size_std(branch, at);
    let own = Own::new(forward, parameters)?;
    (size > 0.0 && std > 0.0 && std.is_finite()).then(|| own.missed_by_size((size, std)))
}

impl Search<'_> {
    /// Logarithms of the frequencies at which a fixture is tried beyond the nodes of its range.
    pub(super) fn peak_places(&self, kind: PlaceKind) -> Vec<f64> {
        let peaks = self.frame.peaks.all.iter().map(|peak| peak.log);
        peaks
            .filter(|_| kind == PlaceKind::FixtureFrequency)
            .collect()
    }

    /// The fit with what the peaks say of its fixture; any other as it is.
    pub(super) fn with_peaks(&self, forward: &Forward<'_>, fit: Fit) -> Fit {
        let peaks = &self.frame.peaks;
        let (Some(at), Some((low, high))) = (place(forward), peaks.band) else {
            return fit;
        };
        let missed = unread(forward, at, &fit.branch).unwrap_or(1.0);
        let mut all = vec![(fit.log_evidence + missed.ln(), fit.branch.clone())];
        let worth = ((high - low) / peaks.all.len().max(1) as f64).ln();
        for peak in &peaks.all {
            if let Some((branch, own)) = self.at_peak(forward, (at, &fit.branch), peak) {
                let strength = own.log_strength(peak, size_std(&branch, at));
                let seen = (1.0 - own.missed()).ln() + strength;
                let log = branch.log_evidence + worth + seen - own.share.ln();
                all.push((log, branch));
            }
        }
        let logs: Vec<f64> = all.iter().map(|one| one.0).collect();
        let best = all.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        Fit {
            branch: best.map_or(fit.branch, |one| one.1),
            log_evidence: log_sum(&logs),
            ..fit
        }
    }

    /// The best fit whose fixture has its own mode at a peak: from a fit with another frequency, and from
    /// what the model linearised there promises.
    fn at_peak(
        &self,
        forward: &Forward<'_>,
        (at, branch): (usize, &Branch),
        peak: &Peak,
    ) -> Option<(Branch, Own)> {
        let mut starts = vec![branch.optimum.parameters.clone()];
        starts[0][at] = peak.log;
        let last = forward.layout.effects.len() - 1;
        if forward.layout.place(last) == Some(at) {
            let mut held = self.known(forward);
            held[at] = Knowledge::held(peak.log);
            let linear = self.linear_fit(forward, &held, Some(peak.log));
            starts.extend(linear.map(|optimum| optimum.parameters));
        }
        let found = starts.into_iter().filter_map(|start| {
            let mut known = branch.knowledge.clone();
            let held = self.stated(forward, (at, peak), (&mut known, start), Knowledge::held)?;
            let (bounds, share) = (branch.knowledge[at], held.1.share);
            let normal = |place| Knowledge {
                low: bounds.low,
                high: bounds.high,
                ..Knowledge::normal(place, peak.std / share)
            };
            let start = held.0.optimum.parameters;
            self.stated(forward, (at, peak), (&mut known, start), normal)
        });
        found.max_by(|a, b| a.0.log_evidence.total_cmp(&b.0.log_evidence))
    }

    /// The optimum where the peak states the fixture's frequency, by what is then known of it.
    fn stated(
        &self,
        forward: &Forward<'_>,
        (at, peak): (usize, &Peak),
        (known, mut start): (&mut [Knowledge], Vec<f64>),
        knowledge: impl Fn(f64) -> Knowledge,
    ) -> Option<(Branch, Own)> {
        tune(forward, &mut start, (at, peak.log))?;
        known[at] = knowledge(start[at]);
        let branch = evaluate(forward, known, &start, &self.settings.drift_stds)?;
        let own = Own::new(forward, &branch.optimum.parameters)?;
        Some((branch, own))
    }
}

/// Gives the fixture the frequency with which its own mode is at a peak (Newton's method).
fn tune(forward: &Forward<'_>, parameters: &mut [f64], (at, log): (usize, f64)) -> Option<()> {
    const ROUNDS: usize = 12;
    for _ in 0..ROUNDS {
        let own = Own::new(forward, parameters)?;
        let short = log - own.log;
        if short.abs() < 0.1 * STATED {
            return Some(());
        }
        // Where the fixture shares its mode with the beam a full step leads past it.
        parameters[at] += (short / own.share).clamp(-0.2, 0.2);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn own(over: f64) -> Own {
        Own {
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
        assert!((missed(1.959_964 * UNKNOWN) - 0.025).abs() < 1e-6);
        assert!((missed(-1.959_964 * UNKNOWN) - 0.975).abs() < 1e-6);
    }

    /// A size that is known is one level; one that may be nothing may have no peak, however strong the peak
    /// of the best size is.
    #[test]
    fn limit_a_size_that_may_be_nothing_may_have_no_peak() {
        let strong = own(40.0);
        assert!((strong.missed_by_size((0.02, 1e-9)) / strong.missed() - 1.0).abs() < 0.01);
        let doubtful = strong.missed_by_size((0.02, 0.02));
        assert!(
            doubtful > 1e3 * strong.missed() && doubtful < 0.1,
            "{doubtful}"
        );
        let nowhere = Own {
            over: None,
            ..own(0.0)
        };
        assert_eq!(nowhere.missed_by_size((0.02, 0.02)), 1.0);
    }

    /// Over all strengths within the range of what is nobody's, the densities are one and the same probability.
    #[test]
    fn val_the_density_of_a_strength_is_normalised() {
        let step = 0.01;
        let sum: f64 = (-2000..2000)
            .map(|k| {
                let peak = Peak {
                    log: 0.0,
                    std: STATED,
                    constants: vec![(0, step * f64::from(k))],
                };
                step * own(0.0).log_strength(&peak, 0.1).exp() / ANY_STRENGTH
            })
            .sum();
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    }
}
