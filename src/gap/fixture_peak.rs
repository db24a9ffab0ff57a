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
use super::forward::{Forward, Solved};
use super::frame::Frame;
use super::hypothesis::{Fit, Search};
use super::least_squares::Knowledge;
use super::noise::chi_square_tail;
use super::setup::TWIN;
use crate::identify::observation::{Configuration, Observations};
use crate::structure::specimen::SpecimenModes;

/// The peaks of a test that belong to no mode, and where such peaks can be told.
#[derive(Debug, Clone, Default)]
pub(super) struct Peaks {
    /// Those that at least half of the recordings show.
    pub(super) all: Vec<Peak>,
    /// Logarithms of the lowest and the highest frequency of a mode; `None` where nobody looked for peaks.
    band: Option<(f64, f64)>,
}

/// A peak that several recordings show.
#[derive(Debug, Clone, Copy)]
pub(super) struct Peak {
    /// Logarithm of its frequency, the mean of the recordings.
    pub(super) log: f64,
    /// Standard uncertainty of that for what it states of the fixture (1).
    std: f64,
}

/// Relative distance within which two recordings show the same peak: sensors that move load a fixture's
/// mode and a joint that drifts turns it by less.
const SAME: f64 = 0.005;
/// Least relative uncertainty with which a peak states a fixture's frequency: a rocking fixture has more
/// than one way to move, and what the size leaves open comes to as much.
const STATED: f64 = 0.001;

impl Peaks {
    pub(super) fn new(observations: &Observations) -> Self {
        // Of several levels of one recording the first stands for it.
        let mut looked: Vec<&Configuration> = Vec::new();
        for one in &observations.configurations {
            let known = |other: &&Configuration| other.recording == one.recording;
            if one.recording.is_some() && !looked.iter().any(known) {
                looked.push(one);
            }
        }
        let modes = looked.iter().flat_map(|one| &one.modes);
        let logs = modes.map(|mode| mode.frequency.ln());
        let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), log| {
            (low.min(log), high.max(log))
        });
        Peaks {
            all: common(&looked),
            band: (low < high).then_some((low, high)),
        }
    }

    fn contains(&self, log: f64) -> bool {
        self.band
            .is_some_and(|(low, high)| log > low && log < high)
    }
}

/// The peaks that at least half of the recordings show.
fn common(looked: &[&Configuration]) -> Vec<Peak> {
    let mut all: Vec<(f64, f64)> = looked.iter().flat_map(|one| lone(one)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let groups = all.chunk_by(|a, b| b.0 - a.0 < SAME);
    groups
        .filter(|group| 2 * group.len() >= looked.len())
        .map(|group| {
            let count = group.len() as f64;
            let log = group.iter().map(|one| one.0).sum::<f64>() / count;
            let scatter = group.iter().map(|one| (one.0 - log).powi(2)).sum::<f64>() / count;
            let read = group.iter().map(|one| one.1).fold(0.0, f64::max);
            let std = scatter.sqrt().hypot(read).hypot(STATED);
            Peak { log, std }
        })
        .collect()
}

/// Logarithm of the frequency and relative uncertainty of the peaks of a recording that are nobody's and
/// no halves of a split decay.
fn lone(one: &Configuration) -> Vec<(f64, f64)> {
    let apart = |frequency: f64| {
        let mut modes = one.modes.iter();
        modes.all(|mode| (frequency / mode.frequency - 1.0).abs() > TWIN)
    };
    let peaks = one.extra_peaks.iter();
    peaks
        .filter(|peak| peak.label == "unpaired" && apart(peak.frequency))
        .map(|peak| {
            let std = peak.std.unwrap_or(0.0) / peak.frequency;
            (peak.frequency.ln(), std)
        })
        .collect()
}

/// Level (dB) of a mode's peak over the median one of the beam's modes: products of the mass-normalised
/// displacements at the hammer and at the strongest sensor, which is the accelerance at resonance where
/// damping ratios are alike.
pub(super) fn level(
    modes: &SpecimenModes,
    (base, numbers): (usize, &[usize]),
    (sensors, tap): (&[f64], Option<f64>),
) -> Option<f64> {
    let product = |mode: usize| {
        let at = |x: f64| modes.displacement(mode, x).abs();
        let most = sensors.iter().map(|x| at(*x)).fold(0.0, f64::max);
        most * tap.map_or(most, at)
    };
    let mut all: Vec<f64> = numbers.iter().map(|mode| product(*mode)).collect();
    if all.is_empty() || sensors.is_empty() {
        return None;
    }
    let median = crate::stats::median(&mut all);
    let level = 20.0 * (product(base) / median).log10();
    level.is_finite().then_some(level)
}

/// Level (dB) at which a peak is read half of the time.
const SEEN: f64 = -45.0;
/// Standard deviation (dB) of what is not known of it: a fixture's damping and the noise, within a factor
/// of two or three.
const UNKNOWN: f64 = 8.0;

/// Probability that a peak of this level is not read: that of a normal deviate.
pub(super) fn missed(level: f64) -> f64 {
    let away = (level - SEEN) / UNKNOWN;
    let tail = 0.5 * chi_square_tail(away * away, 1.0).unwrap_or(1.0);
    if away > 0.0 { tail } else { 1.0 - tail }
}

/// The fixture's own mode at some parameters, in the mean of all configurations.
struct Own {
    /// Logarithm of its frequency as it is read.
    log: f64,
    /// Share of the fixture in its kinetic energy: d x_b/d ln(frequency of the fixture alone), since
    /// Rayleigh's quotient is stationary.
    share: f64,
    /// Probability that its peak is not read.
    missed: f64,
}

impl Own {
    fn new(forward: &Forward<'_>, parameters: &[f64]) -> Option<Self> {
        let solved = forward.solve(parameters)?;
        let setups = &forward.frame.setups;
        let (mut log, mut share, mut levels) = (0.0, 0.0, Vec::new());
        for (one, setup) in solved.iter().zip(setups) {
            let base = one.base()?;
            log += one.seen.read(one.modes.frequencies()[base]).ln();
            share += one.modes.base_participation(base);
            let sensors: Vec<f64> = setup.sensors.iter().map(|s| s.position).collect();
            let numbers: Vec<usize> = (1..=forward.frame.fitted_modes)
                .filter_map(|mode| one.index(mode))
                .collect();
            let (modes, tap) = (&one.modes, setup.tap);
            levels.extend(level(modes, (base, &numbers), (&sensors, tap)));
        }
        let count = solved.len() as f64;
        let log = log / count;
        let told = forward.frame.peaks.contains(log) && apart(&solved, log);
        let level = (told && !levels.is_empty()).then(|| crate::stats::median(&mut levels));
        Some(Own {
            log,
            share: share / count,
            missed: level.map_or(1.0, missed),
        })
    }
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

/// Probability that the peak of a fixture is not read though the fit has one that no peak states; `None`
/// of fits without a fixture or with a peak.
pub(super) fn unseen(frame: &Frame, fit: &Fit) -> Option<f64> {
    let forward = Forward::new(frame, &fit.effects);
    let at = place(&forward)?;
    if fit.branch.knowledge[at].std.is_finite() {
        return None;
    }
    missed_at_least(&forward, at, &fit.branch)
}

/// The same with the least size that the fit leaves open: 1.6 standard deviations below the best one.
fn missed_at_least(forward: &Forward<'_>, at: usize, branch: &Branch) -> Option<f64> {
    let spread = covariance(&branch.knowledge, &branch.optimum)?;
    let mut parameters = branch.optimum.parameters.clone();
    parameters[at - 1] -= 1.6 * spread[(at - 1, at - 1)].max(0.0).sqrt();
    if parameters[at - 1] <= 0.0 {
        return Some(1.0);
    }
    Some(Own::new(forward, &parameters)?.missed)
}

impl Search<'_> {
    /// The fit with what the peaks say of its fixture; any other as it is.
    pub(super) fn with_peaks(&self, forward: &Forward<'_>, fit: Fit) -> Fit {
        let peaks = &self.frame.peaks;
        let (Some(at), Some((low, high))) = (place(forward), peaks.band) else {
            return fit;
        };
        let missed = missed_at_least(forward, at, &fit.branch).unwrap_or(1.0);
        let mut all = vec![(fit.log_evidence + missed.ln(), fit.branch.clone())];
        let worth = ((high - low) / peaks.all.len().max(1) as f64).ln();
        for peak in &peaks.all {
            if let Some((branch, own)) = self.at_peak(forward, (at, &fit.branch), peak) {
                let log = branch.log_evidence + worth + (1.0 - own.missed).ln() - own.share.ln();
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
