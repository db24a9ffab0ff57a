//! Modes fitted to what one recording measured, beside its peak readings.
//!
//! Starts come from the peaks and from a polyreference fit over the band, which also sees modes that
//! make no peak of their own. The fit itself is the maximum-likelihood one of [`fit_modes`]; a mode that
//! only the polyreference fit proposes must be asked for by the data.

use num_complex::Complex64;

use tapjoint_signal::modal::fit::{
    Accepted, ExtraMode, ExtraVerdict, FitSettings, ModalData, ModeFit, PoleStart, Unfit, fit_modes,
};
use tapjoint_signal::modal::polyreference::{
    BandSearch, PolyreferenceMode, PolyreferenceSettings, ResponseMatrix, SubBandSettings,
    all_modes, find_modes,
};
use tapjoint_signal::modal::{FittedReading, ModeReading, PeakLabel, ReadBy};
use tapjoint_signal::spectral::Lines;

/// Most modes that only the polyreference fit proposes and that are tested.
const MOST_EXTRA: usize = 12;
/// Two modes whose half-power widths are apart by this factor are told by their frequencies alone.
const APART: f64 = 3.0;
/// Nearer than that, their shapes must differ: a modal assurance criterion below this. A single mode
/// whose frequency changes while it rings is fitted by two poles of one shape.
const UNLIKE: f64 = 0.9;
/// Distance from the ends of the band within which a mode without a peak is none: lines, and a share of the frequency,
/// whichever is more.
const NEAR_ENDS: (f64, f64) = (5.0, 0.005);
/// A mode seen by the fit alone stands out of its noise by so many standard deviations of its amplitude.
const CLEAR_AMPLITUDE: f64 = 5.0;

/// What the polyreference fit over the band found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stabilisation {
    /// The whole band, then the bands about groups of peaks; empty where nothing could be fitted.
    pub searches: Vec<BandSearch>,
}

/// The polyreference fit of `columns` on equally spaced lines; nothing where they are too few.
pub(super) fn stabilisation(first: f64, spacing: f64, columns: &[&[Complex64]]) -> Stabilisation {
    let rows: Vec<Vec<&[Complex64]>> = columns.iter().map(|&column| vec![column]).collect();
    let found = ResponseMatrix::new(first, spacing, &rows).and_then(|matrix| {
        let default = PolyreferenceSettings::default();
        let settings = PolyreferenceSettings {
            order: order_for(matrix.points(), default.order),
            ..default
        };
        find_modes(&matrix, &settings, &SubBandSettings::default())
    });
    Stabilisation {
        searches: found.unwrap_or_default(),
    }
}

/// The order that so many lines bear: a fifth of them, as in a band of its own.
fn order_for(points: usize, most: usize) -> usize {
    (points / 5).clamp(2, most)
}

/// What a reading needs beside its fit.
pub(super) struct Candidates<'a> {
    /// The axis of the peak readings.
    pub lines: &'a Lines,
    /// What is fitted.
    pub data: &'a ModalData,
    /// What the polyreference fit found.
    pub stabilisation: &'a Stabilisation,
}

impl Candidates<'_> {
    /// Puts the fits into the readings of the peaks, and adds the modes that make no peak.
    pub fn fit(&self, readings: &mut Vec<ModeReading>) {
        let settings = FitSettings {
            steady_lines: readings.iter().filter_map(mains_frequency).collect(),
            ..FitSettings::default()
        };
        let proposed = all_modes(&self.stabilisation.searches);
        let (mut starts, peaks, extras) = self.starts(readings, &proposed);
        let (mut accepted, mut fits) = Accepted::new(self.data, &starts, &settings);
        let mut added = Vec::new();
        for extra in extras.into_iter().take(MOST_EXTRA) {
            let start = start_of(extra);
            let (test, together) = accepted.test(&start);
            if self.is_mode(&test, &starts) {
                starts.push(start);
                added.push(extra);
                accepted = together;
            }
        }
        let peaks_alone = starts.len() - added.len();
        if !added.is_empty() {
            fits = self.settled(&mut starts, &mut added, &settings);
        }
        let (of_peaks, of_added) = fits.split_at(peaks_alone);
        for (index, fit) in peaks.into_iter().zip(of_peaks) {
            self.adopt(&mut readings[index], fit.as_ref().ok());
        }
        for (proposal, fit) in added.into_iter().zip(of_added) {
            if let Ok(fit) = fit {
                readings.push(self.reading_of(fit.clone(), proposal));
            }
        }
        readings.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    }

    /// The fit of all together. Beside the others an added mode may leave the band that it kept to when it
    /// was tested: then it goes, and the rest is fitted again without it.
    fn settled(
        &self,
        starts: &mut Vec<PoleStart>,
        added: &mut Vec<&PolyreferenceMode>,
        settings: &FitSettings,
    ) -> Vec<Result<ModeFit, Unfit>> {
        let peaks = starts.len() - added.len();
        loop {
            let fits = fit_modes(self.data, starts, settings);
            let strays = |fit: &Result<ModeFit, Unfit>| {
                fit.as_ref().is_ok_and(|fit| !self.may_be_added(fit))
            };
            let Some(stray) = fits.iter().skip(peaks).position(strays) else {
                return fits;
            };
            starts.remove(peaks + stray);
            added.remove(stray);
        }
    }

    /// Where fits begin: peaks first, each at its own reading or at the mode of the polyreference fit
    /// beside it; the modes without a peak apart, the clearest first.
    fn starts<'m>(
        &self,
        readings: &[ModeReading],
        proposed: &'m [PolyreferenceMode],
    ) -> (Vec<PoleStart>, Vec<usize>, Vec<&'m PolyreferenceMode>) {
        let mut free: Vec<Option<&PolyreferenceMode>> = proposed.iter().map(Some).collect();
        let (mut starts, mut peaks) = (Vec::new(), Vec::new());
        for (index, reading) in readings.iter().enumerate() {
            let own = self.take_nearest(reading, &mut free);
            match (reading.label, own) {
                (None, own) => starts.push(own.map_or(start_of_reading(reading), start_of)),
                (Some(PeakLabel::NoResonance), Some(own)) => starts.push(start_of(own)),
                _ => continue,
            }
            peaks.push(index);
        }
        let mut extras: Vec<&PolyreferenceMode> = free.into_iter().flatten().collect();
        extras.sort_by(|a, b| b.above_noise_db.total_cmp(&a.above_noise_db));
        (starts, peaks, extras)
    }

    /// The mode that belongs to a peak: the nearest within a line and its half-power width.
    fn take_nearest<'m>(
        &self,
        reading: &ModeReading,
        free: &mut [Option<&'m PolyreferenceMode>],
    ) -> Option<&'m PolyreferenceMode> {
        let distance = |mode: &PolyreferenceMode| (mode.frequency - reading.frequency).abs();
        let reach = |mode: &PolyreferenceMode| {
            2.0 * self.lines.half_line() + mode.damping_ratio * mode.frequency
        };
        free.iter_mut()
            .filter(|mode| mode.is_some_and(|mode| distance(mode) <= reach(mode)))
            .min_by(|a, b| {
                let of = |mode: &Option<&PolyreferenceMode>| mode.map_or(f64::INFINITY, distance);
                of(a).total_cmp(&of(b))
            })
            .and_then(Option::take)
    }

    /// Whether a natural frequency lies among the lines that were fitted. That of a pole with high damping
    /// need not: f = |lambda|/2 pi, while the lines hold Im(lambda)/2 pi alone to the band.
    fn is_within(&self, fit: &ModeFit) -> bool {
        let lines = self.data.frequencies();
        let ends = lines.first().zip(lines.last());
        ends.is_some_and(|(first, last)| (*first..=*last).contains(&fit.frequency.value))
    }

    /// Whether a fit belongs to the peak on this line (Hz): a damped mode among others peaks beside its frequency, by its
    /// half-power width at most. What lies farther off is another mode, or none.
    fn is_at(&self, fit: &ModeFit, line: f64) -> bool {
        let width = 2.0 * fit.damping_ratio.value * fit.frequency.value;
        let reach = 2.0 * self.lines.half_line() + width;
        (fit.frequency.value - line).abs() <= reach
    }

    /// Whether a fit without a peak may be a mode at all: well within the band, and no more damped than what
    /// proposes modes lets pass. At the ends of a band poles stand for what lies beyond it.
    fn may_be_added(&self, fit: &ModeFit) -> bool {
        let most_damping = PolyreferenceSettings::default().most_damping;
        let lines = self.data.frequencies();
        let margin = |end: f64| (NEAR_ENDS.0 * self.data.spacing()).max(NEAR_ENDS.1 * end);
        let ends = lines.first().zip(lines.last());
        let inside = ends.is_some_and(|(first, last)| {
            (first + margin(*first)..last - margin(*last)).contains(&fit.frequency.value)
        });
        inside && fit.damping_ratio.value < most_damping
    }

    /// Whether a proposed mode is one: asked for by the data, and no mending of a neighbour's line.
    fn is_mode(&self, test: &ExtraMode, accepted: &[PoleStart]) -> bool {
        let (ExtraVerdict::Needed, Ok(fit)) = (test.verdict, &test.fit) else {
            return false;
        };
        let width = |frequency: f64, damping: f64| frequency * damping;
        let own = width(fit.frequency.value, fit.damping_ratio.value);
        let crowded = accepted.iter().any(|other| {
            let theirs = width(other.frequency, other.damping_ratio.unwrap_or(0.0));
            (fit.frequency.value - other.frequency).abs() < APART * (own + theirs)
        });
        let unlike = test.likeness.is_some_and(|likeness| likeness < UNLIKE);
        is_clear(fit) && self.may_be_added(fit) && (!crowded || unlike)
    }

    /// The fit of a peak; one that was no clear resonance becomes one where its fit is clear.
    fn adopt(&self, reading: &mut ModeReading, fit: Option<&ModeFit>) {
        let of_peak =
            |fit: &&ModeFit| self.is_within(fit) && self.is_at(fit, reading.line_frequency);
        let Some(fit) = fit.filter(of_peak) else {
            return;
        };
        if reading.label == Some(PeakLabel::NoResonance) {
            if !is_clear(fit) {
                return;
            }
            reading.label = None;
        }
        reading.fit = Some(Box::new(FittedReading::new(fit.clone())));
    }

    /// The reading of a mode that makes no peak.
    fn reading_of(&self, fit: ModeFit, proposal: &PolyreferenceMode) -> ModeReading {
        let line = self.lines.nearest(fit.frequency.value);
        ModeReading {
            frequency: fit.frequency.value,
            source: ReadBy::Fit,
            interval: (fit.frequency.low, fit.frequency.high),
            std: Some(fit.frequency.std),
            above_noise_db: Some(proposal.above_noise_db),
            fit: Some(Box::new(FittedReading::new(fit))),
            ..ModeReading::on_line(self.lines.frequency(line), self.lines.half_line())
        }
    }
}

fn mains_frequency(reading: &ModeReading) -> Option<f64> {
    match reading.label {
        Some(PeakLabel::Mains(harmonic)) => Some(harmonic),
        _ => None,
    }
}

fn start_of(mode: &PolyreferenceMode) -> PoleStart {
    PoleStart {
        frequency: mode.frequency,
        damping_ratio: Some(mode.damping_ratio),
    }
}

fn start_of_reading(reading: &ModeReading) -> PoleStart {
    PoleStart {
        frequency: reading.frequency,
        damping_ratio: reading.damping_ratio,
    }
}

/// Whether the amplitudes stand out of their standard deviations, and the decay too.
fn is_clear(fit: &ModeFit) -> bool {
    let strongest = fit
        .amplitudes
        .iter()
        .map(|amplitude| amplitude.value.norm() / amplitude.std)
        .fold(0.0, f64::max);
    strongest > CLEAR_AMPLITUDE && fit.damping_ratio.value > 2.0 * fit.damping_ratio.std
}
