//! Modes fitted to the free decays or the response functions of one recording, beside its peak readings.
//!
//! Starts come from the peaks and from a polyreference fit over the band. That fit also sees modes without a peak of
//! their own; such a mode is kept only if the data call for it. The fit itself is the maximum-likelihood one of
//! [`fit_modes`].

use super::decays::CollectedDecays;
use num_complex::Complex64;
use tapjoint_signal::modal::amplitude::{Decay, KnownMode, follow_amplitude};
use tapjoint_signal::modal::fit::{
    Accepted, Column, ExtraMode, FitError, FitSettings, FreeDecayCollector, ModalData, ModeFit,
    PoleStart, SteadyLine, TapForce, UncertaintySource, Unfit, fit_modes, modal_constants,
};
use tapjoint_signal::modal::polyreference::{
    BandPeaks, BandSearch, MOST_DAMPING, PoleStability, PolyreferenceMode, PolyreferenceSettings,
    ResponseMatrix, StabilisationPole, all_modes, find_modes,
};
use tapjoint_signal::modal::{FittedReading, ModeReading, PeakLabel, ReadBy};
use tapjoint_signal::recording::ResponseForm;
use tapjoint_signal::spectral::Lines;

/// Most modes that only the polyreference fit proposes and that are tested. 40: each costs a fit of its neighbours. Real
/// recordings have proposed up to a dozen.
const MOST_EXTRA: usize = 40;
/// Most fits beside which a second pole is looked for, those with the largest misfit first. 8: each costs some ten fits.
const MOST_MISFITS: usize = 8;
/// Two modes whose distance is beyond this multiple of their half-power widths are distinct by their frequencies alone.
pub(super) const APART: f64 = 3.0;
/// Nearer than that, their shapes must differ: a modal assurance criterion below this. A single mode
/// whose frequency changes while it rings is fitted by two poles of one shape.
pub(super) const UNLIKE: f64 = 0.9;
/// Distance from the ends of the band within which a mode without a peak is none: lines, and a share of the frequency,
/// whichever is more.
const NEAR_ENDS: (f64, f64) = (5.0, 0.005);
/// Share of a chosen frequency by which its digits may differ from a pole's: the page writes seven.
const THE_SAME: f64 = 1e-6;
/// Share of a chosen frequency within which a stable pole is the one meant. 1 %: a light sensor at another place shifts a
/// mode by less.
const CHOSEN_REACH: f64 = 0.01;
/// A mode seen by the fit alone stands out of its noise by so many standard deviations of its amplitude.
pub(super) const CLEAR_AMPLITUDE: f64 = 5.0;

/// Result of the polyreference fit over the band.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stabilisation {
    /// The whole band, then the bands about groups of peaks; empty where nothing could be fitted.
    pub searches: Vec<BandSearch>,
    /// Frequencies in the band (Hz) that were chosen by hand, and at which no mode was fitted.
    pub without_mode: Vec<f64>,
}

/// The polyreference fit of `columns` on equally spaced lines, in narrow bands about `peaks` as well; nothing where the
/// lines are too few.
pub(super) fn stabilisation(
    first: f64,
    spacing: f64,
    columns: &[&[Complex64]],
    peaks: BandPeaks,
) -> Stabilisation {
    let rows: Vec<Vec<&[Complex64]>> = columns.iter().map(|&column| vec![column]).collect();
    let found = ResponseMatrix::new(first, spacing, &rows).and_then(|matrix| {
        let default = PolyreferenceSettings::default();
        let settings = PolyreferenceSettings {
            // The order that so many lines bear: a fifth of them, as in a band of its own.
            order: (matrix.points() / 5).clamp(2, default.order),
            peaks,
            ..default
        };
        find_modes(&matrix, &settings)
    });
    Stabilisation {
        searches: found.unwrap_or_default(),
        without_mode: Vec::new(),
    }
}

/// Data of the fit of all modes of one recording.
pub(super) struct Candidates<'a> {
    /// The axis of the peak readings.
    pub lines: &'a Lines,
    /// The spectra that are fitted.
    pub data: &'a ModalData,
    /// Result of the polyreference fit.
    pub stabilisation: &'a Stabilisation,
    /// Mains hum.
    pub hum: Vec<SteadyLine>,
    /// Frequencies (Hz) of the modes that were chosen by hand; empty where the program chooses.
    pub chosen: &'a [f64],
}

impl Candidates<'_> {
    /// Puts the fits into the readings of the peaks, and adds the modes that make no peak. Returns the chosen frequencies
    /// without a mode (Hz).
    pub fn fit(&self, readings: &mut Vec<ModeReading>) -> Vec<f64> {
        if !self.chosen.is_empty() {
            return self.fit_chosen(readings);
        }
        let settings = FitSettings {
            steady_lines: self.hum.clone(),
            ..FitSettings::default()
        };
        let proposed = all_modes(&self.stabilisation.searches);
        let (mut starts, peaks, extras) = self.starts(readings, &proposed);
        let (mut accepted, mut fits) = Accepted::new(self.data, &starts, &settings);
        let mut added = Vec::new();
        // Pairs of poles for which the data ask where one mode is listed.
        let mut pairs = Vec::new();
        for extra in extras.into_iter().take(MOST_EXTRA) {
            let start = start_of(extra);
            let (test, together) = accepted.test(&start);
            if self.is_mode(&test, &starts) {
                starts.push(start);
                added.push(extra);
                accepted = together;
            } else if test.likeness.is_none_or(|likeness| likeness >= UNLIKE) {
                pairs.extend(self.pair(test));
            }
        }
        let peaks_alone = starts.len() - added.len();
        if !added.is_empty() {
            (accepted, fits) = self.settled(&mut starts, &mut added, &settings);
        }
        let fitted = fits.iter().enumerate();
        let fitted = fitted.filter_map(|(index, fit)| Some((index, fit.as_ref().ok()?)));
        let mut misfits: Vec<(usize, &ModeFit)> = fitted.collect();
        // Taps that scatter leave more than noise as well, and their interval rests on that already.
        misfits.retain(|(_, fit)| {
            let steady = fit.frequency.source == UncertaintySource::Residual;
            fit.inflation > 1.0 || (steady && fit.residual_correlation > 0.0)
        });
        misfits.sort_by(|(_, a), (_, b)| {
            let inflations = b.inflation.total_cmp(&a.inflation);
            inflations.then(b.residual_correlation.total_cmp(&a.residual_correlation))
        });
        for (index, fit) in misfits.into_iter().take(MOST_MISFITS) {
            // One pole may leave more than noise, and no search proposed a second: it is looked for half a width away.
            // Whatever its shape, the interval holds it too.
            let (frequency, ratio) = (fit.frequency.value, fit.damping_ratio.value);
            let near = |pole: &ModeFit| {
                (pole.frequency.value - frequency).abs() < APART * ratio * frequency
            };
            if pairs.iter().flatten().any(near) || !accepted.has_room_beside(index, fit) {
                continue;
            }
            for side in [-0.5, 0.5] {
                let (test, _) = accepted.test(&PoleStart {
                    frequency: frequency * (1.0 + side * ratio),
                    damping_ratio: Some(ratio),
                });
                let pair = self.pair(test);
                if pair.is_some() {
                    pairs.extend(pair);
                    break;
                }
            }
        }
        for [extra, neighbour] in &pairs {
            // The listed mode is the pole beside which the other was tested, or has taken a place between the two.
            let distance = |fit: &ModeFit| (fit.frequency.value - neighbour.frequency.value).abs();
            let reach = APART * half_widths([extra, neighbour]);
            let nearest = fits.iter_mut().flatten();
            let nearest = nearest.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            if let Some(fit) = nearest.filter(|fit| distance(fit) < reach) {
                fit.widen_to([extra, neighbour]);
            }
        }
        let (of_peaks, of_added) = fits.split_at(peaks_alone);
        for (index, fit) in peaks.into_iter().zip(of_peaks) {
            if let Ok(fit) = fit {
                self.adopt(&mut readings[index], fit);
            }
        }
        // Modes that make no peak.
        for (proposal, fit) in added.into_iter().zip(of_added) {
            let Ok(fit) = fit else { continue };
            readings.push(self.without_peak(fit, proposal.above_noise_db));
        }
        readings.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
        Vec::new()
    }

    /// Fits the modes that were chosen by hand and no others: each starts at the pole of any order nearest to its
    /// frequency. Of the peaks only those of chosen modes stay. Returns the chosen frequencies in the band without a mode (Hz).
    pub fn fit_chosen(&self, readings: &mut Vec<ModeReading>) -> Vec<f64> {
        let settings = FitSettings {
            steady_lines: self.hum.clone(),
            ..FitSettings::default()
        };
        let (mut starts, mut wanted) = (Vec::new(), Vec::new());
        for &frequency in &self.chosen_in_band() {
            let start = match self.chosen_pole(frequency) {
                Some(pole) => PoleStart {
                    frequency: pole.frequency,
                    damping_ratio: Some(pole.damping_ratio),
                },
                None => PoleStart {
                    frequency,
                    damping_ratio: None,
                },
            };
            // Two frequencies of one pole are one mode.
            if !starts.contains(&start) {
                starts.push(start);
                wanted.push(frequency);
            }
        }
        let (_, fits) = Accepted::new(self.data, &starts, &settings);
        let mut peaks = std::mem::take(readings);
        let mut without = Vec::new();
        for (index, (start, fit)) in starts.iter().zip(fits).enumerate() {
            let width = start.damping_ratio.unwrap_or(0.0) * start.frequency;
            let reach = 2.0 * self.lines.half_line() + width;
            // A fit that has left its start is another mode, or none.
            let is_here = |fit: &ModeFit| (fit.frequency.value - start.frequency).abs() <= reach;
            let Some(fit) = fit.ok().filter(is_here) else {
                without.push(wanted[index]);
                continue;
            };
            let distance = |peak: &ModeReading| (peak.frequency - start.frequency).abs();
            let places = (0..peaks.len()).filter(|&place| distance(&peaks[place]) <= reach);
            let place = places.min_by(|&a, &b| distance(&peaks[a]).total_cmp(&distance(&peaks[b])));
            match place {
                Some(place) => {
                    let mut reading = peaks.remove(place);
                    // The choice counts, also where the program would not have taken the peak for a mode.
                    reading.label = None;
                    self.adopt(&mut reading, &fit);
                    readings.push(reading);
                }
                None => readings.push(self.without_peak(&fit, 0.0)),
            }
        }
        readings.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
        without
    }

    /// Returns the chosen frequencies that the lines of the fit hold (Hz).
    fn chosen_in_band(&self) -> Vec<f64> {
        let lines = self.data.frequencies();
        let (Some(first), Some(last)) = (lines.first(), lines.last()) else {
            return Vec::new();
        };
        let chosen = self.chosen.iter().copied();
        chosen
            .filter(|one| (*first..=*last).contains(one))
            .collect()
    }

    /// Returns the pole that a chosen frequency (Hz) means: the very one, whatever its order. Else it was chosen in another
    /// recording, or by eye: the nearest stable one within [`CHOSEN_REACH`], or the nearest within a line.
    fn chosen_pole(&self, frequency: f64) -> Option<&StabilisationPole> {
        let distance = |pole: &&StabilisationPole| (pole.frequency - frequency).abs();
        let searches = self.stabilisation.searches.iter();
        let poles = searches.flat_map(|search| &search.diagram);
        let nearest = poles.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        if distance(&nearest) <= THE_SAME * frequency {
            return Some(nearest);
        }
        let searches = self.stabilisation.searches.iter();
        let stable = searches.flat_map(|search| &search.diagram).filter(|pole| {
            pole.stability == PoleStability::All && distance(pole) <= CHOSEN_REACH * frequency
        });
        let line = 2.0 * self.lines.half_line();
        stable
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .or_else(|| Some(nearest).filter(|pole| distance(pole) <= line))
    }

    /// The fit of all together. Beside the others an added mode may leave the band that it kept to when it
    /// was tested: then it goes, and the rest is fitted again without it.
    fn settled(
        &self,
        starts: &mut Vec<PoleStart>,
        added: &mut Vec<&PolyreferenceMode>,
        settings: &FitSettings,
    ) -> (Accepted<'_>, Vec<Result<ModeFit, Unfit>>) {
        let peaks = starts.len() - added.len();
        loop {
            let (accepted, fits) = Accepted::new(self.data, starts, settings);
            let mut of_added = fits.iter().skip(peaks);
            let stray =
                of_added.position(|fit| fit.as_ref().is_ok_and(|fit| !self.may_be_added(fit)));
            let Some(stray) = stray else {
                return (accepted, fits);
            };
            starts.remove(peaks + stray);
            added.remove(stray);
        }
    }

    /// Starts of the fits: peaks first, each at its own reading or at the mode of the polyreference fit
    /// beside it; the modes without a peak apart, the clearest first.
    fn starts<'m>(
        &self,
        readings: &[ModeReading],
        proposed: &'m [PolyreferenceMode],
    ) -> (Vec<PoleStart>, Vec<usize>, Vec<&'m PolyreferenceMode>) {
        let mut free: Vec<Option<&PolyreferenceMode>> = proposed.iter().map(Some).collect();
        let (mut starts, mut peaks) = (Vec::new(), Vec::new());
        for (index, reading) in readings.iter().enumerate() {
            let own = match reading.label {
                Some(PeakLabel::Mains(_)) => self.take_steady(&mut free, reading),
                _ => self.take_nearest(&mut free, reading),
            };
            match (reading.label, own) {
                (None, None) => starts.push(PoleStart {
                    frequency: reading.frequency,
                    damping_ratio: reading.damping_ratio,
                }),
                (None | Some(PeakLabel::NoResonance), Some(own)) => starts.push(start_of(own)),
                _ => continue,
            }
            peaks.push(index);
        }
        let mut extras: Vec<&PolyreferenceMode> = free.into_iter().flatten().collect();
        extras.sort_by(|a, b| b.above_noise_db.total_cmp(&a.above_noise_db));
        (starts, peaks, extras)
    }

    /// Takes the mode of the polyreference fit that belongs to a peak out of those that are `free`: the nearest within a
    /// line and half of its half-power width.
    pub fn take_nearest<'m>(
        &self,
        free: &mut [Option<&'m PolyreferenceMode>],
        reading: &ModeReading,
    ) -> Option<&'m PolyreferenceMode> {
        let near = free.iter().enumerate().filter_map(|(place, mode)| {
            let mode = (*mode)?;
            let distance = (mode.frequency - reading.frequency).abs();
            let width = mode.damping_ratio * mode.frequency;
            (distance <= 2.0 * self.lines.half_line() + width).then_some((place, distance))
        });
        let (place, _) = near.min_by(|a, b| a.1.total_cmp(&b.1))?;
        free[place].take()
    }

    /// Takes the pole of the polyreference fit that stands for a mains line: one that does not decay. Hum may lie on top
    /// of a mode, whose pole stays free.
    fn take_steady<'m>(
        &self,
        free: &mut [Option<&'m PolyreferenceMode>],
        reading: &ModeReading,
    ) -> Option<&'m PolyreferenceMode> {
        let line = 2.0 * self.lines.half_line();
        let narrow = free.iter_mut().filter(|mode| {
            mode.is_some_and(|mode| {
                let width = mode.damping_ratio * mode.frequency;
                width < STEADY_WIDTH * line && (mode.frequency - reading.frequency).abs() <= line
            })
        });
        let nearest = narrow.min_by(|a, b| {
            let distances = [a, b].map(|mode| {
                mode.map_or(f64::INFINITY, |mode| {
                    (mode.frequency - reading.frequency).abs()
                })
            });
            distances[0].total_cmp(&distances[1])
        });
        nearest?.take()
    }

    /// Returns the reading of a fitted mode that makes no peak.
    pub fn without_peak(&self, fit: &ModeFit, above_noise_db: f64) -> ModeReading {
        let line = self.lines.nearest(fit.frequency.value);
        let mut reading = ModeReading::on_line(self.lines.frequency(line), self.lines.half_line());
        reading.above_noise_db = Some(above_noise_db);
        reading.fit = Some(Box::new(FittedReading::new(fit.clone())));
        reading.select_estimate(ReadBy::Fit);
        reading
    }

    /// Returns true if a fit without a peak may be a mode at all: well within the band, and no more damped than the
    /// search for modes lets pass. At the ends of a band poles stand for what lies beyond it.
    pub fn may_be_added(&self, fit: &ModeFit) -> bool {
        let lines = self.data.frequencies();
        let Some((first, last)) = lines.first().zip(lines.last()) else {
            return false;
        };
        let margin = NEAR_ENDS.0 * self.data.spacing();
        let low = first + margin.max(NEAR_ENDS.1 * first);
        let high = last - margin.max(NEAR_ENDS.1 * last);
        (low..high).contains(&fit.frequency.value) && fit.damping_ratio.value < MOST_DAMPING
    }

    /// Returns a tested pole with its neighbour, where the data ask for both, near each other.
    fn pair(&self, test: ExtraMode) -> Option<[ModeFit; 2]> {
        let (true, Ok(extra), Some(neighbour)) = (test.needed, test.fit, test.neighbour) else {
            return None;
        };
        let distance = (extra.frequency.value - neighbour.frequency.value).abs();
        let near = distance < APART * half_widths([&extra, &neighbour]);
        (near && self.may_be_added(&extra)).then_some([extra, neighbour])
    }

    /// Returns true if the data ask for a proposed mode, and it does not merely mend a neighbour's line.
    fn is_mode(&self, test: &ExtraMode, accepted: &[PoleStart]) -> bool {
        let (true, Ok(fit)) = (test.needed, &test.fit) else {
            return false;
        };
        let own = fit.frequency.value * fit.damping_ratio.value;
        let crowded = accepted.iter().any(|other| {
            let theirs = other.frequency * other.damping_ratio.unwrap_or(0.0);
            (fit.frequency.value - other.frequency).abs() < APART * (own + theirs)
        });
        let unlike = test.likeness.is_some_and(|likeness| likeness < UNLIKE);
        is_clear(fit) && self.may_be_added(fit) && (!crowded || unlike)
    }

    /// Takes the fit of a peak, if it belongs to it; a peak that was no clear resonance becomes one where its fit is
    /// clear.
    pub fn adopt(&self, reading: &mut ModeReading, fit: &ModeFit) {
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

/// Keeps the peaks at the frequencies that were chosen by hand (Hz), where nothing can be fitted; all without a choice.
/// Returns the chosen frequencies in the band without a peak (Hz).
pub(super) fn keep_chosen(
    readings: &mut Vec<ModeReading>,
    chosen: &[f64],
    lines: &Lines,
) -> Vec<f64> {
    if chosen.is_empty() {
        return Vec::new();
    }
    let is_at = |reading: &ModeReading, frequency: f64| {
        let width = reading.damping_ratio.unwrap_or(0.0) * reading.frequency;
        (reading.frequency - frequency).abs() <= 2.0 * lines.half_line() + width
    };
    let chosen = chosen.iter().copied();
    let chosen = chosen.filter(|one| (lines.low..=lines.high).contains(one));
    readings.retain(|reading| chosen.clone().any(|one| is_at(reading, one)));
    for reading in readings.iter_mut() {
        reading.label = None;
    }
    let without = chosen.filter(|one| !readings.iter().any(|reading| is_at(reading, *one)));
    without.collect()
}

/// Half the half-power width below which a pole does not decay (lines): 27 % over the length of the signal.
const STEADY_WIDTH: f64 = 0.05;

/// Half the half-power widths of two modes together (Hz).
fn half_widths(fits: [&ModeFit; 2]) -> f64 {
    let widths = fits.map(|fit| fit.frequency.value * fit.damping_ratio.value);
    widths.iter().sum()
}

pub(super) fn start_of(mode: &PolyreferenceMode) -> PoleStart {
    PoleStart {
        frequency: mode.frequency,
        damping_ratio: Some(mode.damping_ratio),
    }
}

/// Returns true if the amplitudes stand out of their standard deviations, and the decay too.
pub(super) fn is_clear(fit: &ModeFit) -> bool {
    let strongest = fit
        .amplitudes
        .iter()
        .map(|amplitude| amplitude.value.norm() / amplitude.std)
        .fold(0.0, f64::max);
    strongest > CLEAR_AMPLITUDE && fit.damping_ratio.value > 2.0 * fit.damping_ratio.std
}

/// Decays of all taps, and what of them is fitted.
pub(super) struct FreeDecays {
    /// Transforms of every tap and sensor on the lines of the band.
    data: ModalData,
    /// Force of each tap that was not overloaded; empty without a hammer.
    forces: Vec<TapForce>,
    /// Samples of each tap.
    decays: Vec<Decay>,
    /// Transforms of the forces, one for each decay, time zero at its first sample; zero where the force is not known,
    /// empty without a hammer.
    force_columns: Vec<Column>,
}

impl FreeDecays {
    /// Transforms the decays and the forces before them onto the lines of their band.
    ///
    /// # Errors
    /// [`FitError`]: too few lines.
    pub(super) fn new(collected: CollectedDecays) -> Result<Self, FitError> {
        let CollectedDecays {
            taps_together: _,
            samples,
            band,
            decays,
            forces,
        } = collected;
        let rate = decays.first().map_or(0.0, |decay| decay.sample_rate);
        let mut responses = FreeDecayCollector::new(rate, samples, &[band])?;
        for decay in &decays {
            responses.add_tap(&decay.responses)?;
        }
        let mut pulses = FreeDecayCollector::new(rate, samples, &[band])?;
        let mut next = forces.iter().peekable();
        for tap in 0..decays.len() {
            let force = next.next_if(|force| force.tap == tap);
            let force = force.map_or(&[][..], |force| &force.samples);
            // The force before time zero stands at the end of the block: on multiples of rate/block a transform
            // cannot tell a time from one a block later.
            let kept = force.len().min(samples);
            let mut block = vec![0.0; samples - kept];
            block.extend_from_slice(&force[force.len() - kept..]);
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
    /// frequency and damping against amplitude, beside the lines of `hum`. Modes at the frequencies of `chosen` (Hz) are
    /// fitted and no others, where it is not empty.
    pub(super) fn fit(
        &self,
        readings: &mut Vec<ModeReading>,
        lines: &Lines,
        kinds: &[Option<ResponseForm>],
        hum: Vec<SteadyLine>,
        chosen: &[f64],
    ) -> Stabilisation {
        let functions = self.functions();
        let columns: Vec<&[Complex64]> = functions.iter().map(Vec::as_slice).collect();
        let first = self.data.frequencies().first().copied().unwrap_or(0.0);
        let spacing = self.data.spacing();
        let mut stabilisation = stabilisation(first, spacing, &columns, BandPeaks::Together);
        let steady: Vec<f64> = hum.iter().map(|line| line.frequency).collect();
        let candidates = Candidates {
            lines,
            data: &self.data,
            stabilisation: &stabilisation,
            hum,
            chosen,
        };
        let without_mode = candidates.fit(readings);
        let settings = FitSettings {
            steady_lines: candidates.hum,
            ..FitSettings::default()
        };
        stabilisation.without_mode = without_mode;
        let unfitted: Vec<KnownMode> = readings
            .iter()
            .filter(|reading| reading.fit.is_none() && reading.label.is_none())
            .map(|reading| KnownMode {
                frequency: reading.frequency,
                damping_ratio: (reading.damping_ratio)
                    .unwrap_or(reading.half_line / reading.frequency),
                amplitude_part: None,
            })
            .collect();
        let fitted: Vec<&mut FittedReading> = readings
            .iter_mut()
            .filter_map(|reading| reading.fit.as_deref_mut())
            .collect();
        let mut known: Vec<KnownMode> = fitted
            .iter()
            .map(|fit| KnownMode {
                frequency: fit.mode.frequency.value,
                damping_ratio: fit.mode.damping_ratio.value,
                amplitude_part: fit.mode.amplitude_part,
            })
            .collect();
        // Peaks that no pole fits may be modes that drift, and disturb the others.
        known.extend(unfitted);
        let followed = follow_amplitude(&self.decays, &known, &steady);
        for (fit, curve) in fitted.into_iter().zip(followed.curves) {
            fit.amplitude = Some(curve);
        }
        if let Some(rest) = followed.rest {
            self.fit_again(readings, rest, &followed.subtracted, &settings);
        }
        for reading in readings {
            if let Some(fit) = reading.fit.as_deref_mut() {
                fit.constants = modal_constants(&fit.mode, &self.forces, kinds);
            }
        }
        stabilisation
    }

    /// Fits the modes again in decays from which those have been subtracted whose frequency changes.
    ///
    /// Their lines are no resonance curves, and disturb the modes beside them.
    fn fit_again(
        &self,
        readings: &mut [ModeReading],
        rest: Vec<Decay>,
        subtracted: &[usize],
        settings: &FitSettings,
    ) {
        let Ok(data) = self.transforms_of(&rest) else {
            return;
        };
        // The fits need only the transforms, and many taps take much memory.
        drop(rest);
        let fitted = readings.iter_mut();
        let fitted = fitted.filter_map(|reading| reading.fit.as_deref_mut());
        let steady: Vec<&mut FittedReading> = (fitted.enumerate())
            .filter(|(index, _)| !subtracted.contains(index))
            .map(|(_, fit)| fit)
            .collect();
        let starts: Vec<PoleStart> = steady
            .iter()
            .map(|fit| PoleStart {
                frequency: fit.mode.frequency.value,
                damping_ratio: Some(fit.mode.damping_ratio.value),
            })
            .collect();
        for (fit, again) in steady.into_iter().zip(fit_modes(&data, &starts, settings)) {
            let is_single = fit.mode.frequency.source != UncertaintySource::TwoPoles;
            let Some(again) = again.ok().filter(|_| is_single) else {
                continue;
            };
            if let Some(curve) = &mut fit.amplitude
                && curve.drift.is_none()
                && let [Some(part), Some(now)] = [&fit.mode, &again].map(|mode| mode.amplitude_part)
            {
                curve.reference = curve.reference.map(|amplitude| amplitude * now / part);
            }
            fit.mode = again;
        }
    }

    /// Transforms decays onto the lines of the fit.
    fn transforms_of(&self, decays: &[Decay]) -> Result<ModalData, FitError> {
        let lines = self.data.frequencies();
        let band = (lines[0], lines[lines.len() - 1]);
        let rate = decays.first().map_or(0.0, |decay| decay.sample_rate);
        let samples = (rate / self.data.spacing()).round() as usize;
        let mut collector = FreeDecayCollector::new(rate, samples, &[band])?;
        for decay in decays {
            collector.add_tap(&decay.responses)?;
        }
        collector.finish()
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
