//! Modes fitted to the free decays or the response functions of one recording, beside its peak readings.
//!
//! Starts come from the peaks and from a polyreference fit over the band. That fit also sees modes without a peak of
//! their own; such a mode is kept only if the data call for it. The fit itself is the maximum-likelihood one of
//! [`fit_modes`].

use num_complex::Complex64;
use tapjoint_signal::modal::amplitude::{AmplitudeVerdict, Decay, KnownMode, follow_amplitude};
use tapjoint_signal::modal::fit::{
    Accepted, Column, ExtraMode, FitError, FitSettings, FreeDecayCollector, ModalData, ModeFit,
    PoleStart, TapForce, Unfit, modal_constants,
};
use tapjoint_signal::modal::polyreference::{
    BandSearch, MOST_DAMPING, PolyreferenceMode, PolyreferenceSettings, ResponseMatrix, all_modes,
    find_modes,
};
use tapjoint_signal::modal::{FittedReading, ModeReading, PeakLabel, ReadBy};
use tapjoint_signal::recording::ResponseForm;
use tapjoint_signal::spectral::Lines;

/// Most modes that only the polyreference fit proposes and that are tested.
const MOST_EXTRA: usize = 20;
/// Two modes whose distance is beyond this multiple of their half-power widths are distinct by their frequencies alone.
const APART: f64 = 3.0;
/// A single response shows no shapes. There two modes are distinct beyond this multiple: each then has a maximum of
/// its own, or a shoulder. The poles that mend the line of one mode lie within its half-power width.
const APART_ALONE: f64 = 1.0;
/// Nearer than that, their shapes must differ: a modal assurance criterion below this. A single mode
/// whose frequency changes while it rings is fitted by two poles of one shape.
const UNLIKE: f64 = 0.9;
/// Distance from the ends of the band within which a mode without a peak is none: lines, and a share of the frequency,
/// whichever is more.
const NEAR_ENDS: (f64, f64) = (5.0, 0.005);
/// A mode seen by the fit alone stands out of its noise by so many standard deviations of its amplitude.
const CLEAR_AMPLITUDE: f64 = 5.0;

/// Least decay over the record (sigma T) of a peak that may be noise.
const LEAST_DECAY: f64 = 2.0;

/// Result of the polyreference fit over the band.
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
            // The order that so many lines bear: a fifth of them, as in a band of its own.
            order: (matrix.points() / 5).clamp(2, default.order),
            ..default
        };
        find_modes(&matrix, &settings)
    });
    Stabilisation {
        searches: found.unwrap_or_default(),
    }
}

/// A mode that is kept only if the data ask for it.
struct Proposal {
    start: PoleStart,
    /// Height over the noise (dB).
    above_noise_db: f64,
    /// Index of the reading of its peak; `None` where it makes none.
    peak: Option<usize>,
}

/// Data of the fit of all modes of one recording.
pub(super) struct Candidates<'a> {
    /// The axis of the peak readings.
    pub lines: &'a Lines,
    /// The spectra that are fitted.
    pub data: &'a ModalData,
    /// Result of the polyreference fit.
    pub stabilisation: &'a Stabilisation,
    /// Frequencies (Hz) of hum that was there before the taps.
    pub steady_lines: &'a [f64],
}

impl Candidates<'_> {
    /// Puts the fits into the readings of the peaks, and adds the modes that make no peak.
    pub fn fit(&self, readings: &mut Vec<ModeReading>) {
        let labels = readings.iter().filter_map(|reading| reading.label);
        let mains = labels.filter_map(|label| match label {
            PeakLabel::Mains(harmonic) => Some(harmonic),
            _ => None,
        });
        let mut steady_lines: Vec<f64> = mains.chain(self.steady_lines.iter().copied()).collect();
        steady_lines.sort_by(f64::total_cmp);
        steady_lines.dedup();
        let settings = FitSettings {
            steady_lines,
            ..FitSettings::default()
        };
        let proposed = all_modes(&self.stabilisation.searches);
        let (mut starts, peaks, mut proposals) = self.starts(readings, &proposed);
        let peaks_alone = starts.len();
        proposals.truncate(MOST_EXTRA);
        // Modes that lie apart from all others are fitted at once: without them the lines of the others are not true.
        let (mut together, mut others) = (Vec::new(), Vec::new());
        for proposal in proposals {
            if proposal.peak.is_some() || self.is_crowded(&proposal.start, &starts) {
                others.push(proposal);
            } else {
                starts.push(proposal.start);
                together.push(proposal);
            }
        }
        let (mut accepted, mut fits) = self.settled(&mut starts, &mut together, &settings, &[]);
        let fitted: Vec<bool> = fits.iter().map(Result::is_ok).collect();
        // The rest is tested one by one beside them.
        for proposal in others {
            let (test, beside) = accepted.test(&proposal.start);
            if self.is_mode(&test, &proposal, &starts) {
                starts.push(proposal.start);
                together.push(proposal);
                accepted = beside;
            }
        }
        if starts.len() > fitted.len() {
            fits = self
                .settled(&mut starts, &mut together, &settings, &fitted)
                .1;
        }
        let (of_peaks, of_added) = fits.split_at(peaks_alone);
        for (index, fit) in peaks.into_iter().zip(of_peaks) {
            if let Ok(fit) = fit {
                self.adopt(&mut readings[index], fit);
            }
        }
        for (proposal, fit) in together.into_iter().zip(of_added) {
            let Ok(fit) = fit else { continue };
            if let Some(peak) = proposal.peak {
                self.adopt(&mut readings[peak], fit);
                continue;
            }
            // A mode that makes no peak.
            let line = self.lines.nearest(fit.frequency.value);
            let mut reading =
                ModeReading::on_line(self.lines.frequency(line), self.lines.half_line());
            reading.above_noise_db = Some(proposal.above_noise_db);
            reading.fit = Some(Box::new(FittedReading::new(fit.clone())));
            reading.select_estimate(ReadBy::Fit);
            readings.push(reading);
        }
        readings.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    }

    /// The fit of all together. An added mode goes, and the rest is fitted again without it, where it leaves its place
    /// beside the others, or where the data do not ask for it. The last one goes where a start that was `fitted` before
    /// has no fit any more.
    fn settled(
        &self,
        starts: &mut Vec<PoleStart>,
        added: &mut Vec<Proposal>,
        settings: &FitSettings,
        fitted: &[bool],
    ) -> (Accepted<'_>, Vec<Result<ModeFit, Unfit>>) {
        let peaks = starts.len() - added.len();
        loop {
            let (accepted, fits) = Accepted::new(self.data, starts, settings);
            let stray = (peaks..starts.len()).rfind(|&index| match &fits[index] {
                Ok(fit) => !(self.is_own(fit, &added[index - peaks]) && accepted.needs(index, fit)),
                Err(_) => true,
            });
            let costly = starts.len() > fitted.len() && {
                let mut pairs = fitted.iter().zip(&fits);
                pairs.any(|(before, now)| *before && now.is_err())
            };
            let Some(stray) = stray.or(costly.then_some(starts.len() - 1)) else {
                return (accepted, fits);
            };
            starts.remove(stray);
            added.remove(stray - peaks);
        }
    }

    /// Starts of the fits: peaks first, each at its own reading or at the mode of the polyreference fit
    /// beside it. Modes without a peak and peaks that may be noise are proposals, the clearest first.
    fn starts(
        &self,
        readings: &[ModeReading],
        proposed: &[PolyreferenceMode],
    ) -> (Vec<PoleStart>, Vec<usize>, Vec<Proposal>) {
        let mut free: Vec<Option<&PolyreferenceMode>> = proposed.iter().map(Some).collect();
        let (mut starts, mut peaks, mut proposals) = (Vec::new(), Vec::new(), Vec::new());
        for (index, reading) in readings.iter().enumerate() {
            // The mode that belongs to a peak: the nearest within a line and its half-power width.
            let near = free.iter().enumerate().filter_map(|(place, mode)| {
                let mode = (*mode)?;
                let distance = (mode.frequency - reading.frequency).abs();
                let width = mode.damping_ratio * mode.frequency;
                (distance <= 2.0 * self.lines.half_line() + width).then_some((place, distance))
            });
            let nearest = near.min_by(|a, b| a.1.total_cmp(&b.1));
            let own = nearest.and_then(|(place, _)| free[place].take());
            let alone = PoleStart {
                frequency: reading.frequency,
                damping_ratio: reading.damping_ratio,
            };
            match (reading.label, own) {
                (None, None) => starts.push(alone),
                (None | Some(PeakLabel::NoResonance), Some(own)) => starts.push(start_of(own)),
                (Some(PeakLabel::NoResonance), None) => {
                    proposals.extend(reading.above_noise_db.map(|above_noise_db| Proposal {
                        start: alone,
                        above_noise_db,
                        peak: Some(index),
                    }));
                    continue;
                }
                _ => continue,
            }
            peaks.push(index);
        }
        proposals.extend(free.into_iter().flatten().map(|mode| Proposal {
            start: start_of(mode),
            above_noise_db: mode.above_noise_db,
            peak: None,
        }));
        proposals.sort_by(|a, b| b.above_noise_db.total_cmp(&a.above_noise_db));
        (starts, peaks, proposals)
    }

    /// Returns true if a fit without a peak may be a mode at all: well within the band, and no more damped than the
    /// search for modes lets pass. At the ends of a band poles stand for what lies beyond it.
    fn may_be_added(&self, fit: &ModeFit) -> bool {
        let lines = self.data.frequencies();
        let Some((first, last)) = lines.first().zip(lines.last()) else {
            return false;
        };
        let margin = NEAR_ENDS.0 * self.data.spacing();
        let low = first + margin.max(NEAR_ENDS.1 * first);
        let high = last - margin.max(NEAR_ENDS.1 * last);
        (low..high).contains(&fit.frequency.value) && fit.damping_ratio.value < MOST_DAMPING
    }

    /// Returns true if a fit is a clear mode where it was proposed: within its half-power width.
    fn is_own(&self, fit: &ModeFit, proposal: &Proposal) -> bool {
        let found = fit.frequency.value;
        let width = found
            * proposal
                .start
                .damping_ratio
                .unwrap_or(0.0)
                .max(fit.damping_ratio.value);
        let near = (found - proposal.start.frequency).abs() <= 2.0 * self.lines.half_line() + width;
        // A peak of noise is as narrow as the record allows.
        let decay = -fit.pole.re * self.lines.duration;
        let rings_down = proposal.peak.is_none() || decay >= LEAST_DECAY;
        near && rings_down && self.may_be_added(fit) && is_clear(fit)
    }

    /// Returns true if the data ask for a proposed mode, and it does not merely mend a neighbour's line.
    fn is_mode(&self, test: &ExtraMode, proposal: &Proposal, accepted: &[PoleStart]) -> bool {
        let (true, Ok(fit)) = (test.needed, &test.fit) else {
            return false;
        };
        let found = PoleStart {
            frequency: fit.frequency.value,
            damping_ratio: Some(fit.damping_ratio.value),
        };
        let unlike = test.likeness.is_some_and(|likeness| likeness < UNLIKE);
        self.is_own(fit, proposal) && (unlike || !self.is_crowded(&found, accepted))
    }

    /// Returns true where a mode is too near to another for their frequencies alone to tell them apart.
    fn is_crowded(&self, mode: &PoleStart, others: &[PoleStart]) -> bool {
        let least = match self.data.columns() {
            [_] => APART_ALONE,
            _ => APART,
        };
        others.iter().any(|other| {
            let widths = [mode, other].map(|one| one.frequency * one.damping_ratio.unwrap_or(0.0));
            (mode.frequency - other.frequency).abs() < least * (widths[0] + widths[1])
        })
    }

    /// Takes the fit of a peak, if it belongs to it; a peak that was no clear resonance becomes one where its fit is
    /// clear.
    fn adopt(&self, reading: &mut ModeReading, fit: &ModeFit) {
        // The natural frequency of a pole with high damping may lie outside of the lines that were fitted:
        // f = |lambda|/2 pi, while the lines hold Im(lambda)/2 pi alone to the band.
        let lines = self.data.frequencies();
        let Some((first, last)) = lines.first().zip(lines.last()) else {
            return;
        };
        // A damped mode among others peaks beside its frequency, by its half-power width at most. A fit farther off
        // belongs to another mode, or to none.
        let frequency = fit.frequency.value;
        let width = 2.0 * fit.damping_ratio.value * frequency;
        let reach = 2.0 * self.lines.half_line() + width;
        let near = (frequency - reading.line_frequency).abs() <= reach;
        if !near || !(*first..=*last).contains(&frequency) {
            return;
        }
        if reading.label == Some(PeakLabel::NoResonance) {
            if !is_clear(fit) {
                return;
            }
            reading.label = None;
        }
        reading.fit = Some(Box::new(FittedReading::new(fit.clone())));
    }
}

fn start_of(mode: &PolyreferenceMode) -> PoleStart {
    PoleStart {
        frequency: mode.frequency,
        damping_ratio: Some(mode.damping_ratio),
    }
}

/// Returns true if the amplitudes stand out of their standard deviations, and the decay too.
fn is_clear(fit: &ModeFit) -> bool {
    let strongest = fit
        .amplitudes
        .iter()
        .map(|amplitude| amplitude.value.norm() / amplitude.std)
        .fold(0.0, f64::max);
    strongest > CLEAR_AMPLITUDE && fit.damping_ratio.value > 2.0 * fit.damping_ratio.std
}

/// Returns true for a reading that is a part of another mode's line.
fn is_part(reading: &ModeReading) -> bool {
    let curve = reading.fit.as_ref().and_then(|fit| fit.amplitude.as_ref());
    curve.is_some_and(|curve| matches!(curve.verdict, AmplitudeVerdict::PartOf { .. }))
}

/// Decays of all taps, and what of them is fitted.
pub(super) struct FreeDecays {
    /// Transforms of every tap and sensor on the lines of the band.
    data: ModalData,
    /// Force of each tap; empty without a hammer.
    forces: Vec<TapForce>,
    /// Samples of each tap.
    decays: Vec<Decay>,
    /// Transforms of the forces, time zero at the decays' first sample; empty without a hammer.
    force_columns: Vec<Column>,
}

impl FreeDecays {
    /// Transforms the decays (`samples` of each) and the forces before them onto the lines of their band.
    ///
    /// # Errors
    /// [`FitError`]: too few lines.
    pub(super) fn new(
        samples: usize,
        lines: &Lines,
        decays: Vec<Decay>,
        forces: Vec<TapForce>,
    ) -> Result<Self, FitError> {
        let band = (lines.low, lines.high);
        let rate = decays.first().map_or(0.0, |decay| decay.sample_rate);
        let mut responses = FreeDecayCollector::new(rate, samples, &[band])?;
        for decay in &decays {
            responses.add_tap(&decay.responses)?;
        }
        let mut pulses = FreeDecayCollector::new(rate, samples, &[band])?;
        for force in &forces {
            // The force before time zero stands at the end of the block: on multiples of rate/block a transform
            // cannot tell a time from one a block later.
            let kept = force.samples.len().min(samples);
            let mut block = vec![0.0; samples - kept];
            block.extend_from_slice(&force.samples[force.samples.len() - kept..]);
            pulses.add_tap(&[block])?;
        }
        let force_columns = match forces[..] {
            [] => Vec::new(),
            _ => pulses.finish()?.columns().to_vec(),
        };
        Ok(FreeDecays {
            data: responses.finish()?,
            forces,
            decays,
            force_columns,
        })
    }

    /// Fits the decays, and puts into the readings the fits with what else the decays give: modal constants, and
    /// frequency and damping against amplitude.
    pub(super) fn fit(
        &self,
        readings: &mut Vec<ModeReading>,
        lines: &Lines,
        kinds: &[Option<ResponseForm>],
        steady_lines: &[f64],
    ) -> Stabilisation {
        let functions = self.functions();
        let columns: Vec<&[Complex64]> = functions.iter().map(Vec::as_slice).collect();
        let first = self.data.frequencies().first().copied().unwrap_or(0.0);
        let stabilisation = stabilisation(first, self.data.spacing(), &columns);
        let candidates = Candidates {
            lines,
            data: &self.data,
            stabilisation: &stabilisation,
            steady_lines,
        };
        candidates.fit(readings);
        let fitted: Vec<&mut FittedReading> = readings
            .iter_mut()
            .filter_map(|reading| reading.fit.as_deref_mut())
            .collect();
        let modes = fitted.iter().map(|fit| KnownMode {
            frequency: fit.mode.frequency.value,
            damping_ratio: fit.mode.damping_ratio.value,
        });
        // Hum is followed along with the modes, for it beats with those beside it.
        let hum = steady_lines.iter().copied().map(KnownMode::steady);
        let known: Vec<KnownMode> = modes.chain(hum).collect();
        let curves = follow_amplitude(&self.decays, &known);
        for (fit, curve) in fitted.into_iter().zip(curves) {
            fit.amplitude = Some(curve);
            fit.constants = modal_constants(&fit.mode, &self.forces, kinds);
        }
        // Peaks of a line that is swept while it rings are no modes; what made no peak goes.
        readings.retain(|reading| reading.prominence_db.is_some() || !is_part(reading));
        for reading in readings.iter_mut().filter(|reading| is_part(reading)) {
            reading.fit = None;
            reading.between = None;
            reading.label = Some(PeakLabel::NoResonance);
        }
        stabilisation
    }

    /// Columns of the polyreference fit, all on the same lines: with a hammer the response of
    /// every sensor to the force, H = sum conj(F) X/sum |F|^2 over the taps; without one every tap's
    /// transforms.
    fn functions(&self) -> Vec<Vec<Complex64>> {
        let columns = self.data.columns();
        if self.force_columns.is_empty() {
            return columns.iter().map(|column| column.values.clone()).collect();
        }
        let sensors = columns.iter().map(|column| column.sensor + 1).max();
        let lines = self.data.frequencies().len();
        let mut power = vec![0.0; lines];
        for force in &self.force_columns {
            let values = power.iter_mut().zip(&force.values);
            values.for_each(|(sum, f)| *sum += f.norm_sqr());
        }
        let mut sums = vec![vec![Complex64::ZERO; lines]; sensors.unwrap_or(0)];
        for column in columns {
            let Some(force) = self.force_columns.get(column.tap) else {
                continue;
            };
            let pairs = force.values.iter().zip(&column.values);
            let sum = &mut sums[column.sensor];
            sum.iter_mut()
                .zip(pairs)
                .for_each(|(sum, (f, x))| *sum += f.conj() * x);
        }
        for sum in &mut sums {
            for (value, &power) in sum.iter_mut().zip(&power) {
                *value /= power.max(f64::MIN_POSITIVE);
            }
        }
        sums
    }
}
