//! Modes fitted to frequency response functions.
//!
//! The noise of a function is estimated from its lines. All poles that the polyreference fit finds stable are fitted
//! together. Poles that do not lower the residual beyond chance are then dropped.

use super::fits::{APART, CLEAR_AMPLITUDE, Candidates, UNLIKE, is_clear, start_of};
use num_complex::Complex64;
use tapjoint_signal::modal::fit::{Accepted, ExtraMode, FitSettings, ModeFit, PoleStart, Unfit};
use tapjoint_signal::modal::polyreference::{PolyreferenceMode, all_modes};
use tapjoint_signal::modal::{
    CompositeLevel, ModeReading, PeakLabel, PeakSettings, ReadBy, find_peaks, noise_of_function,
    read_peaks,
};
use tapjoint_signal::spectral::{DISPLAY_RATIO, Lines, Window};

/// A single response shows no shapes. There two modes are distinct beyond this multiple of their half-power widths, not
/// beyond [`APART`]: each then has a maximum of its own, or a shoulder. The poles that mend the line of one mode lie within its half-power width.
const APART_ALONE: f64 = 1.0;
/// Least decay over the record (sigma T) of a peak that may be noise.
const LEAST_DECAY: f64 = 2.0;
/// A fit may lie off its start by half of the start's half-power width times this. 2: the linear estimator and readings
/// between the lines are wrong by a half-power width only where another mode is as near.
const WIDER: f64 = 2.0;
/// Most proposals that are tested one by one, the clearest first: each is a fit of all modes near it, and noise over
/// thousands of lines proposes hundreds.
const MOST_TESTED: usize = 40;
/// Numbers of lines whose means are searched as well, the finest first.
const COARSER: [usize; 3] = [4, 16, 64];
/// Least number of coarser lines. 32: fewer are too short for a peak and its surroundings.
const LEAST_COARSE: usize = 32;

/// Level of response functions over the noise of their own lines.
pub(super) fn level_of_functions(lines: Lines, columns: &[&[Complex64]]) -> CompositeLevel {
    let powers: Vec<Vec<f64>> = columns
        .iter()
        .map(|h| h.iter().map(Complex64::norm_sqr).collect())
        .collect();
    let noise: Vec<Vec<f64>> = columns.iter().map(|h| noise_of_function(h)).collect();
    CompositeLevel::new(lines, &powers, Some(&noise))
}

/// A start of the fit.
#[derive(Clone)]
struct Proposal {
    start: PoleStart,
    /// Height over the noise (dB).
    above_noise_db: f64,
    /// Index of the reading of its peak; `None` where it makes none.
    peak: Option<usize>,
    /// Bound (Hz) of a resonance that coarser lines show.
    bound: Option<f64>,
    /// True for a peak that was read as a resonance, or that has a stable pole beside it: its fit is kept.
    sure: bool,
}

/// Fit of all modes of response functions.
pub(super) struct FunctionModes<'a>(pub Candidates<'a>);

impl FunctionModes<'_> {
    /// Puts the fits into the readings of the peaks, and adds the modes that make no peak. Returns the chosen frequencies
    /// without a mode (Hz).
    pub fn fit(&self, readings: &mut Vec<ModeReading>) -> Vec<f64> {
        if !self.0.chosen.is_empty() {
            return self.0.fit_chosen(readings);
        }
        let proposals = self.starts(readings);
        let (mut starts, others): (Vec<Proposal>, Vec<Proposal>) =
            proposals.iter().cloned().partition(|one| one.sure);
        // Proposals that lie apart from all others are fitted at once: without them the lines of the others are not
        // true. The rest is tested one by one beside them.
        let mut later: Vec<Proposal> = Vec::new();
        for proposal in others {
            if proposal.peak.is_some()
                || self.is_crowded(&proposal.start, starts.iter().map(|one| one.start))
            {
                later.push(proposal);
            } else {
                starts.push(proposal);
            }
        }
        let first: Vec<PoleStart> = starts.iter().map(|one| one.start).collect();
        let (mut accepted, mut fits) = Accepted::new(self.0.data, &first, &FitSettings::default());
        self.settle(&starts, &mut accepted, &mut fits);
        // A start that failed in the crowd has another chance.
        let failed = starts.iter().zip(&fits).filter(|(_, fit)| fit.is_err());
        later.splice(
            0..0,
            failed.map(|(start, _)| start.clone()).collect::<Vec<_>>(),
        );
        for proposal in later.into_iter().take(MOST_TESTED) {
            let (test, beside) = accepted.test(&proposal.start);
            let fitted = starts.iter().zip(&fits).filter(|(_, fit)| fit.is_ok());
            let fitted = fitted.map(|(start, _)| start.start);
            if self.is_mode(&test, &proposal, fitted) {
                starts.push(proposal);
                fits.push(test.fit);
                accepted = beside;
            }
        }
        fits = accepted.refit();
        self.settle(&starts, &mut accepted, &mut fits);
        for (start, fit) in starts.iter().zip(&fits) {
            let Ok(fit) = fit else { continue };
            if let Some(peak) = start.peak.filter(|&peak| readings[peak].fit.is_none()) {
                if self.is_near(fit, start) {
                    self.0.adopt(&mut readings[peak], fit);
                }
                continue;
            }
            // A mode that makes no peak.
            readings.push(self.0.without_peak(fit, start.above_noise_db));
        }
        self.read_coarse(readings, &proposals);
        readings.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
        Vec::new()
    }

    /// Turns a peak that was no clear resonance into one where its fit failed but coarser lines show a decaying
    /// oscillation. The bound of that reading becomes the bound of its line.
    fn read_coarse(&self, readings: &mut [ModeReading], coarse: &[Proposal]) {
        for one in coarse {
            let (Some(bound), Some(peak)) = (one.bound, one.peak) else {
                continue;
            };
            let reading = &mut readings[peak];
            if reading.label == Some(PeakLabel::NoResonance) && reading.fit.is_none() {
                reading.label = None;
                let distance = (reading.line_frequency - one.start.frequency).abs();
                reading.line_bound = reading.line_bound.max(distance + bound);
                reading.select_estimate(ReadBy::Line);
            }
        }
    }

    /// Drops modes that moved away from their start, and modes that the data do not need. From each group of close
    /// modes it drops the least clear one, fits again, and repeats this until all modes stay.
    fn settle(
        &self,
        starts: &[Proposal],
        accepted: &mut Accepted,
        fits: &mut Vec<Result<ModeFit, Unfit>>,
    ) {
        loop {
            let mut strays: Vec<usize> = Vec::new();
            let mut groups: Vec<&[usize]> = Vec::new();
            for (index, proposal) in starts.iter().enumerate().rev() {
                let Ok(fit) = &fits[index] else { continue };
                let is_known = proposal.sure || groups.contains(&fit.joint_with.as_slice());
                let stays = is_known || self.is_own(fit, proposal) && accepted.needs(index, fit);
                if !stays {
                    groups.push(&fit.joint_with);
                    strays.push(index);
                }
            }
            if strays.is_empty() {
                return;
            }
            for index in strays {
                accepted.remove(index);
            }
            *fits = accepted.refit();
        }
    }

    /// Proposes the peaks that only coarser lines show.
    ///
    /// The mean of n lines is the function of an impulse response n times shorter: a resonance that decays within it
    /// stays, and noise falls by the root of n. Over a resonance much wider than a line noise has many maxima.
    fn coarse_peaks(&self, readings: &[ModeReading], starts: &[Proposal]) -> Vec<Proposal> {
        let mut found: Vec<Proposal> = Vec::new();
        let columns: Vec<&[Complex64]> = (self.0.data.columns().iter())
            .map(|column| column.values.as_slice())
            .collect();
        for step in COARSER {
            let coarse: Vec<Vec<Complex64>> = columns
                .iter()
                .map(|values| {
                    let means = values.chunks_exact(step);
                    means
                        .map(|part| part.iter().sum::<Complex64>() / step as f64)
                        .collect()
                })
                .collect();
            let count = coarse.first().map_or(0, Vec::len);
            if count < LEAST_COARSE {
                break;
            }
            let first = self.0.data.frequencies()[0];
            let spacing = step as f64 * self.0.lines.spacing;
            let low = first + 0.5 * (spacing - self.0.lines.spacing);
            let lines = Lines {
                low,
                high: low + (count - 1) as f64 * spacing,
                spacing,
                block: (DISPLAY_RATIO * (count - 1) as f64).ceil() as usize,
                duration: 1.0 / spacing,
            };
            let coarse: Vec<&[Complex64]> = coarse.iter().map(Vec::as_slice).collect();
            let level = level_of_functions(lines, &coarse);
            let peaks = find_peaks(&level, &PeakSettings::default());
            for reading in read_peaks(&level, &coarse, &peaks, Window::Rectangular) {
                // Noise may hide the decay of a resonance as narrow as a coarse line: the fit on all lines decides.
                let unread = 0.5 * spacing / reading.frequency;
                let damping_ratio = reading.damping_ratio.unwrap_or(unread);
                let width = damping_ratio * reading.frequency;
                let near = |other: f64| (other - reading.frequency).abs() <= width + spacing;
                // What finer lines show without a decay of its own may be noise over a wider resonance.
                let decided = starts.iter().filter(|one| one.sure || one.peak.is_none());
                let mut known = decided.chain(found.iter().filter(|one| one.bound.is_some()));
                if known.any(|known| near(known.start.frequency)) {
                    continue;
                }
                // The highest of the peaks that noise has over it stands for it.
                let own = readings.iter().enumerate().filter(|(_, own)| {
                    near(own.line_frequency) && own.label == Some(PeakLabel::NoResonance)
                });
                let own = own.max_by(|a, b| {
                    a.1.prominence_db
                        .unwrap_or(0.0)
                        .total_cmp(&b.1.prominence_db.unwrap_or(0.0))
                });
                found.push(Proposal {
                    start: PoleStart {
                        frequency: reading.frequency,
                        damping_ratio: Some(damping_ratio),
                    },
                    above_noise_db: reading.above_noise_db.unwrap_or(0.0),
                    peak: own.map(|(index, _)| index),
                    bound: (reading.label.is_none())
                        .then_some(reading.between)
                        .flatten()
                        .map(|between| between.bound),
                    sure: false,
                });
            }
        }
        found
    }

    /// Starts of the fits, the clearest first: peaks, each at its own reading or at the mode of the polyreference fit
    /// beside it, modes without a peak, and peaks of coarser lines.
    fn starts(&self, readings: &[ModeReading]) -> Vec<Proposal> {
        let proposed = all_modes(&self.0.stabilisation.searches);
        let mut free: Vec<Option<&PolyreferenceMode>> = proposed.iter().map(Some).collect();
        let mut starts: Vec<Proposal> = Vec::new();
        for (index, reading) in readings.iter().enumerate() {
            let own = self.0.take_nearest(&mut free, reading);
            let resonance = reading.label != Some(PeakLabel::NoResonance);
            starts.push(Proposal {
                start: own.map_or(
                    PoleStart {
                        frequency: reading.frequency,
                        damping_ratio: reading.damping_ratio,
                    },
                    start_of,
                ),
                above_noise_db: reading.above_noise_db.unwrap_or(0.0),
                peak: Some(index),
                bound: None,
                sure: resonance || own.is_some(),
            });
        }
        starts.extend(free.into_iter().flatten().map(|mode| Proposal {
            start: start_of(mode),
            above_noise_db: mode.above_noise_db,
            peak: None,
            bound: None,
            sure: false,
        }));
        starts.extend(self.coarse_peaks(readings, &starts));
        starts.sort_by(|a, b| b.above_noise_db.total_cmp(&a.above_noise_db));
        starts
    }

    /// Returns true if a fit lies where it was proposed: within a line and half of its half-power width. This rejects a
    /// fit that moved to another mode, and one that became wide to explain what the other modes do not.
    fn is_near(&self, fit: &ModeFit, proposal: &Proposal) -> bool {
        let found = fit.frequency.value;
        let start = proposal.start.damping_ratio.unwrap_or(0.0);
        let wide = fit.damping_ratio.value;
        let width = found
            * if start > 0.0 {
                wide.min(WIDER * start)
            } else {
                wide
            };
        (found - proposal.start.frequency).abs() <= 2.0 * self.0.lines.half_line() + width
    }

    /// Returns true if a fit is a clear mode, lies where it was proposed, and decays within the record.
    fn is_own(&self, fit: &ModeFit, proposal: &Proposal) -> bool {
        // A peak of noise is as narrow as the record allows.
        let decay = -fit.pole.re * self.0.lines.duration;
        let rings_down = proposal.peak.is_none() || decay >= LEAST_DECAY;
        self.is_near(fit, proposal)
            && rings_down
            && self.0.may_be_added(fit)
            && is_clear(fit)
            && stands_out(fit)
    }

    /// Returns true if the data ask for a proposed mode, and it does not merely mend a neighbour's line.
    fn is_mode(
        &self,
        test: &ExtraMode,
        proposal: &Proposal,
        fitted: impl Iterator<Item = PoleStart>,
    ) -> bool {
        let (true, Ok(fit)) = (test.needed, &test.fit) else {
            return false;
        };
        let found = PoleStart {
            frequency: fit.frequency.value,
            damping_ratio: Some(fit.damping_ratio.value),
        };
        let unlike = test.likeness.is_some_and(|likeness| likeness < UNLIKE);
        self.is_own(fit, proposal) && (unlike || !self.is_crowded(&found, fitted))
    }

    /// Returns true where a mode is too near to another for their frequencies alone to tell them apart.
    fn is_crowded(&self, mode: &PoleStart, mut others: impl Iterator<Item = PoleStart>) -> bool {
        let least = match self.0.data.columns() {
            [_] => APART_ALONE,
            _ => APART,
        };
        others.any(|other| {
            let widths = [mode, &other].map(|one| one.frequency * one.damping_ratio.unwrap_or(0.0));
            (mode.frequency - other.frequency).abs() < least * (widths[0] + widths[1])
        })
    }
}

/// Returns true if the strongest amplitude stands out of what the fit leaves, which is more than white noise where
/// neighbouring lines agree: a misfit of a strong mode invents weak ones beside it.
fn stands_out(fit: &ModeFit) -> bool {
    let ratios = fit.amplitudes.iter().map(|one| one.value.norm() / one.std);
    ratios.fold(0.0, f64::max) > CLEAR_AMPLITUDE * fit.inflation
}
