//! The measurement of one recording: taps, noise before them, averaged spectra, free decays, readings.

use super::averages::{Averages, TapSums, WindowChange};
use super::decays::{CollectedDecays, DecayCollector};
use super::explained::{FittedCurves, UnlistedPeak, unlisted_peaks};
use super::fits::{FreeDecays, Stabilisation, keep_chosen};
use super::pulse_window::PulseWindow;
use super::quiet::PreTriggerNoise;
use super::selection::{Choice, LEAST_TAPS, choose};
use super::stages::{Stage, Work};
use super::tap_responses::{Octave, TapResponse, TapSamples};
use super::warnings::{Warning, of_recording};
use num_complex::Complex64;
use std::ops::Range;
use tapjoint_description::{TapSelection, WindowKind};
use tapjoint_numerics::stats::root_mean_square;
use tapjoint_signal::modal::{
    CompositeLevel, GRIDS, GridFrequency, MainsSettings, ModeReading, PeakLabel, PeakSettings,
    ReadBy, find_peaks, label_combinations, label_steady_lines, read_peaks, set_strengths,
};
use tapjoint_signal::recording::{Recording, RecordingError, ResponseForm};
use tapjoint_signal::spectral::{
    AveragedSpectra, BandLimiter, DISPLAY_RATIO, DecayCheck, LEAST_BLOCK, Lines, MOST_BLOCK,
    RUNG_DOWN, SpectralError, Window, choose_window, exponential_to, largest_smooth_block,
    measure_decay,
};
use tapjoint_signal::taps::{Rejection, Tap, TapSettings, TapSource, Taps, find_taps};

/// Settings of the measurement of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasureSettings {
    /// Channels in which taps are searched; the responses among them are analysed.
    pub source: TapSource,
    /// Zoom band (Hz); `None` = 0 to rate/2.56.
    pub band: Option<(f64, f64)>,
    /// Block size (samples); `None` = the longest that transforms fast and fits the shortest tap.
    pub block: Option<usize>,
    /// Window; `None` = by the decay in the record.
    pub window: Option<WindowKind>,
    /// Way in which natural frequencies are read.
    pub reading: ReadBy,
    /// Choice among the taps that count.
    pub select: TapSelection,
    /// Form of each response, for modal constants; `None` where it is not known, or no motion in
    /// SI units over a force in N.
    pub kinds: Vec<Option<ResponseForm>>,
    /// Frequencies (Hz) of the modes that were chosen by hand; empty where the program chooses.
    pub poles: Vec<f64>,
    /// Limits for taps.
    pub taps: TapSettings,
    /// Limits for resonances.
    pub peaks: PeakSettings,
    /// Limits for mains lines.
    pub mains: MainsSettings,
}

impl MeasureSettings {
    /// Everything at its default.
    pub fn new(source: TapSource) -> Self {
        MeasureSettings {
            source,
            band: None,
            block: None,
            window: None,
            reading: ReadBy::default(),
            select: TapSelection::default(),
            kinds: Vec::new(),
            poles: Vec::new(),
            taps: TapSettings::default(),
            peaks: PeakSettings::default(),
            mains: MainsSettings::default(),
        }
    }
}

impl MeasureSettings {
    /// Returns the limits for taps, with the length of the wanted block.
    pub(super) fn tap_settings(&self, lines: &Lines) -> TapSettings {
        let length = lines.block as f64 / (DISPLAY_RATIO * (lines.high - lines.low));
        TapSettings {
            wanted: self.block.map(|_| length),
            ..self.taps.clone()
        }
    }
}

/// Taps and spectra of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// The taps, accepted and rejected.
    pub taps: Taps,
    /// Averages over the accepted taps and what was read from them; `None` without an accepted tap.
    pub spectra: Option<MeasuredSpectra>,
    /// Everything that a reader of the results has to know.
    pub warnings: Vec<Warning>,
}

/// Spectra and readings of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredSpectra {
    /// Averages over the accepted taps.
    pub averages: AveragedSpectra,
    /// The window.
    pub window: Window,
    /// The records' decay: the response that keeps most; `None` of functions from a file.
    pub decay: Option<DecayCheck>,
    /// Resonances and mains lines, ascending.
    pub readings: Vec<ModeReading>,
    /// Strong peaks that no reading explains, the strongest first.
    pub unlisted: Vec<UnlistedPeak>,
    /// Curves of the fitted modes over the functions; `None` without functions or fitted modes.
    pub fitted: Option<FittedCurves>,
    /// Noise of the force channel in its windowed transforms, line by line (N s); `None`
    /// without a hammer or a quiet stretch before the first tap.
    pub force_noise: Option<Vec<f64>>,
    /// The window about the force pulses; `None` without a hammer.
    pub force_window: Option<ForceWindow>,
    /// Result of the polyreference fit.
    pub stabilisation: Stabilisation,
    /// Consecutive taps for each fitted decay: with a hammer it is their mean, without one the strongest of them. `None`
    /// where each tap is fitted by itself.
    pub taps_together: Option<usize>,
}

/// The window that keeps noise and offset of the hammer before and after a pulse out of the functions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceWindow {
    /// Length (s), half of the taper included: mean of the accepted taps.
    pub length: f64,
    /// Largest relative change of H1 that the window causes at a resonance (1): sqrt(sum |H1w - H1|^2 / sum |H1|^2) over
    /// the responses, H1w with the window, H1 without it, both of the first 32 taps. `None` without a resonance.
    pub h1_change: Option<f64>,
}

/// Reasons for which a measurement stops.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The recording could not be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Band or block do not fit.
    #[error("{file}: {problem}")]
    Spectral {
        /// The recording.
        file: String,
        /// The problem.
        problem: SpectralError,
    },
}

impl MeasureError {
    fn of(recording: &Recording, problem: SpectralError) -> Self {
        Self::Spectral {
            file: recording.name().to_string(),
            problem,
        }
    }
}

/// Finds taps, averages spectra and reads resonances.
///
/// # Errors
/// Unreadable recordings; a band or block that does not fit. No taps are not an error: the answer
/// then has no spectra.
pub fn measure(
    recording: &Recording,
    settings: &MeasureSettings,
) -> Result<Measurement, MeasureError> {
    measure_watched(recording, settings, &mut Work::begin(&(), Stage::Taps))
}

/// Measures as [`measure`] does. `work` is in the stage of the taps, and goes through those of spectra and fits.
pub(super) fn measure_watched(
    recording: &Recording,
    settings: &MeasureSettings,
    work: &mut Work,
) -> Result<Measurement, MeasureError> {
    // The band is judged before anything is read: it is the user's typing, not the data.
    let trial = lines_for(settings, recording.sample_rate(), recording.duration());
    let trial = trial.map_err(|problem| MeasureError::of(recording, problem))?;
    let mut taps = find_taps(recording, &settings.source, &settings.tap_settings(&trial))?;
    let doubts = match settings.select {
        TapSelection::All => Vec::new(),
        TapSelection::Consistent => select_taps(recording, settings, &mut taps)?,
    };
    let mut warnings = of_recording(recording, &settings.source, &taps);
    warnings.extend(doubts);
    let mut spectra = None;
    if let Some(shortest) = taps.shortest() {
        let available = shortest as f64 / recording.sample_rate();
        match lines_for(settings, recording.sample_rate(), available) {
            Ok(lines) => {
                let found = Inputs::new(recording, settings, &taps, lines).spectra(work)?;
                let (file, window) = (recording.name(), found.window);
                if let Some(decay) = found.decay
                    && decay.remaining > RUNG_DOWN
                    && decay.remaining > decay.noise
                {
                    warnings.push(Warning::not_rung_down(file, decay.remaining, window));
                }
                if window == Window::Hann {
                    warnings.push(Warning::hann_on_taps(file));
                }
                for reading in &found.readings {
                    if let Some(label @ PeakLabel::Mains(_)) = reading.label {
                        warnings.push(Warning::mains(file, reading.line_frequency, label));
                    }
                }
                warnings.extend(Warning::combinations(file, &found.readings));
                spectra = Some(found);
            }
            Err(problem @ SpectralError::Padded { .. }) => {
                return Err(MeasureError::of(recording, problem));
            }
            // The file would do, but its taps come too soon: data, not typing.
            Err(problem) => {
                warnings.push(Warning::taps_too_short(recording.name(), &problem));
            }
        }
    }
    Ok(Measurement {
        taps,
        spectra,
        warnings,
    })
}

/// Rejects the accepted taps that do not agree with the others. Returns the doubts about that.
fn select_taps(
    recording: &Recording,
    settings: &MeasureSettings,
    taps: &mut Taps,
) -> Result<Vec<Warning>, MeasureError> {
    let file = recording.name();
    if !matches!(settings.source, TapSource::Hammer { .. }) {
        return Ok(vec![Warning::select_without_force(file)]);
    }
    let compared: Vec<usize> = (0..taps.taps.len())
        .filter(|place| taps.taps[*place].accepted() && taps.taps[*place].is_whole())
        .collect();
    if compared.len() < LEAST_TAPS {
        return Ok(vec![Warning::select_of_few(file, compared.len())]);
    }
    let shortest = taps.shortest().unwrap_or(0) as f64 / recording.sample_rate();
    let Ok(lines) = lines_for(settings, recording.sample_rate(), shortest) else {
        // The spectra fail for the same reason, and that is told there.
        return Ok(Vec::new());
    };
    // Of many taps, parts are compared by themselves. Each holds taps of the whole recording.
    let sensors = settings.source.channels().len().saturating_sub(1);
    let by_memory = (compared.len() * sensors).div_ceil(MOST_RESPONSES);
    let by_memory = by_memory.min(compared.len() / LEAST_COMPARED);
    let parts = compared.len().div_ceil(MOST_COMPARED).max(by_memory);
    let inputs = Inputs::new(recording, settings, taps, lines);
    let (mut doubts, mut rejections, mut has_whole) = (Vec::new(), Vec::new(), false);
    for part in 0..parts {
        let own = compared.iter().copied().skip(part).step_by(parts);
        let own: Vec<usize> = own.collect();
        let Some(choice) = inputs.choice(&own)? else {
            return Ok(vec![Warning::select_without_response(file)]);
        };
        // The parts are alike. One in which all taps are kept tells more.
        let is_kept_whole = choice.disagreement.is_some();
        if doubts.is_empty() || (is_kept_whole && !has_whole) {
            doubts = Warning::of_selection(file, &choice, own.len(), compared.len());
        }
        has_whole |= is_kept_whole;
        for one in choice.departing {
            rejections.push((
                own[one.tap],
                Rejection::Inconsistent {
                    departure: one.departure,
                    others: one.others,
                    limit: one.limit,
                },
            ));
        }
    }
    for (place, rejection) in rejections {
        let tap = &mut taps.taps[place];
        match settings.taps.by_hand.accepts(tap) {
            true => tap.overruled = tap.overruled.take().or(Some(rejection)),
            false => tap.rejection = Some(rejection),
        }
    }
    Ok(doubts)
}

/// The axis: block and band as wanted, or the longest block that fits `available` seconds.
pub(super) fn lines_for(
    settings: &MeasureSettings,
    rate: f64,
    available: f64,
) -> Result<Lines, SpectralError> {
    let band = settings.band.unwrap_or((0.0, rate / DISPLAY_RATIO));
    let zoomed_rate = DISPLAY_RATIO * (band.1 - band.0);
    // A hair more than exact, so that 2048 samples of 0.4 s are not 2047 by rounding.
    let fitting = (available * zoomed_rate * (1.0 + 1e-12)) as usize;
    let block = settings
        .block
        .or_else(|| largest_smooth_block(fitting.min(MOST_BLOCK)))
        .unwrap_or(fitting)
        .max(LEAST_BLOCK);
    Lines::zoom(band, rate, block, available)
}

/// Most taps from which the decay in the records is taken, evenly spread: more would hardly find a slower one.
const MOST_LOOKED_AT: usize = 32;

/// Most taps that are compared with each other. 200: the time grows with the square of their number.
const MOST_COMPARED: usize = 200;
/// Most responses of taps, over all sensors, that are compared with each other, where there are many sensors: a bound on
/// memory. 800: 200 taps of four sensors.
const MOST_RESPONSES: usize = 800;
/// Fewest taps in a part, whatever the sensors. 20: `TIMES_OF_FEW` then adds little to the limit.
const LEAST_COMPARED: usize = 20;

/// Data that every step of one recording's measurement needs.
struct Inputs<'a> {
    recording: &'a Recording,
    settings: &'a MeasureSettings,
    taps: &'a Taps,
    lines: Lines,
    /// Force first, where there is one, then the responses.
    channels: Vec<usize>,
    has_force: bool,
    /// Frames of a block.
    gate: u64,
}

impl<'a> Inputs<'a> {
    fn new(
        recording: &'a Recording,
        settings: &'a MeasureSettings,
        taps: &'a Taps,
        lines: Lines,
    ) -> Self {
        let mut channels = settings.source.channels();
        let mut has_force = false;
        if let TapSource::Hammer { responses, .. } = &settings.source {
            has_force = taps.accepted().any(Tap::is_whole);
            // Where every pulse or response was cut off, only the decays are left, as without a hammer.
            if !has_force {
                channels.clone_from(responses);
            }
        }
        Inputs {
            recording,
            settings,
            taps,
            lines,
            channels,
            has_force,
            gate: (lines.duration * recording.sample_rate()).round() as u64,
        }
    }

    /// Samples of all channels in a range of frames of one file, each channel's mean in the file taken out.
    fn read(&self, range: Range<u64>, into: &mut [Vec<f64>]) -> Result<(), RecordingError> {
        let start = range.start;
        self.recording.read_into(&self.channels, range, into)?;
        for (samples, &channel) in into.iter_mut().zip(&self.channels) {
            let mean = self.recording.mean_at(channel, start);
            samples.iter_mut().for_each(|x| *x -= mean);
        }
        Ok(())
    }

    /// Reads a tap's record from its start to the end of a block.
    fn read_record(&self, tap: &Tap, into: &mut [Vec<f64>]) -> Result<(), RecordingError> {
        self.read(tap.record.start..tap.usable_from() + self.gate, into)
    }

    /// Compares the taps at these places, and chooses among them. `None` where a tap has no pulse, or nothing answers it.
    fn choice(&self, places: &[usize]) -> Result<Option<Choice>, RecordingError> {
        let rate = self.recording.sample_rate();
        let band = (self.lines.low, self.lines.high);
        let octaves = Octave::all(band, rate, self.gate as usize);
        let mut responses = Vec::with_capacity(places.len());
        let mut record = vec![Vec::new(); self.channels.len()];
        let mut before = vec![Vec::new(); self.channels.len()];
        for &place in places {
            let tap = &self.taps.taps[place];
            self.read_record(tap, &mut record)?;
            self.read(self.stretch_before(place), &mut before)?;
            let samples = TapSamples {
                responses: record.split_off(1),
                force: record.pop().unwrap_or_default(),
                before: before.split_off(1),
            };
            responses.extend(TapResponse::of(tap, &octaves, samples, rate));
            record.resize_with(self.channels.len(), Vec::new);
            before.resize_with(self.channels.len(), Vec::new);
        }
        if responses.len() < places.len() || self.responses() == 0 {
            return Ok(None);
        }
        let taps = places.iter().map(|place| &self.taps.taps[*place]);
        let by_hand = &self.settings.taps.by_hand;
        let protected: Vec<bool> = taps.clone().map(|tap| by_hand.accepts(tap)).collect();
        let peaks: Vec<f64> = taps.map(|tap| tap.peak).collect();
        Ok(Some(choose(&octaves, &responses, &protected, &peaks)))
    }

    /// Frames before the record of a tap that show how the structure rested: at most a block, and half of the time since
    /// the last tap.
    fn stretch_before(&self, place: usize) -> Range<u64> {
        let tap = &self.taps.taps[place];
        let mut first = 0;
        for (start, part) in self.recording.parts() {
            if (start..start + part.frames()).contains(&tap.record.start) {
                first = start;
            }
        }
        if let Some(last) = place.checked_sub(1).map(|last| &self.taps.taps[last]) {
            first = first.max(u64::midpoint(last.record.start, tap.record.start));
        }
        let first = first.max(tap.record.start.saturating_sub(self.gate));
        first.min(tap.record.start)..tap.record.start
    }

    /// The taps whose records are averaged: with a force those that are whole.
    fn averaged(&self) -> impl Iterator<Item = &'a Tap> {
        let has_force = self.has_force;
        self.taps
            .accepted()
            .filter(move |tap| !has_force || tap.is_whole())
    }

    /// The quiet stretch before the first tap, at most a block.
    fn quiet(&self) -> Result<PreTriggerNoise, RecordingError> {
        let quiet = self.taps.quiet.clone();
        let start = quiet.start.max(quiet.end.saturating_sub(self.gate));
        let mut force = vec![Vec::new(); self.channels.len()];
        self.read(start..quiet.end, &mut force)?;
        let responses = force.split_off(usize::from(self.has_force));
        let rate = self.recording.sample_rate();
        let windows = self.averaged().filter_map(|tap| PulseWindow::of(tap, rate));
        let energy: f64 = windows.map(PulseWindow::energy).sum();
        let count = self.averaged().count().max(1) as f64;
        let mains = &self.settings.mains;
        Ok(PreTriggerNoise {
            grids: GRIDS.map(|nominal| GridFrequency::read(nominal, &responses, rate, mains)),
            force: force.pop(),
            responses,
            sample_rate: rate,
            block: self.gate as usize,
            force_window: energy / count,
        })
    }

    fn spectra(&self, work: &mut Work) -> Result<MeasuredSpectra, RecordingError> {
        work.go_on(Stage::Spectra);
        let quiet = self.quiet()?;
        let rate = self.recording.sample_rate();
        let band = (self.lines.low, self.lines.high);
        let limiter = BandLimiter::new(rate, band, self.gate as usize);
        let noise: Vec<f64> = quiet
            .responses
            .iter()
            .map(|x| root_mean_square(&limiter.magnitude(x)))
            .collect();
        // The decay of each response inside the band, the largest over the accepted taps.
        let mut checks = vec![DecayCheck::NOTHING; noise.len()];
        let taps: Vec<&Tap> = self.taps.accepted().collect();
        let mut record = vec![Vec::new(); self.channels.len()];
        for number in 0..taps.len().min(MOST_LOOKED_AT) {
            let tap = taps[number * taps.len() / taps.len().min(MOST_LOOKED_AT)];
            self.read(
                tap.usable_from()..tap.usable_from() + self.gate,
                &mut record,
            )?;
            let responses = &record[usize::from(self.has_force)..];
            for ((samples, &noise), check) in responses.iter().zip(&noise).zip(&mut checks) {
                let found = measure_decay(&limiter.magnitude(samples), noise);
                if found.remaining >= check.remaining {
                    *check = found;
                }
            }
        }
        // The slowest of the decays that stand above their noise; of none, the slowest of all.
        let slowest = checks.iter().copied().max_by(|a, b| {
            let above = (a.remaining > a.noise).cmp(&(b.remaining > b.noise));
            above.then(a.remaining.total_cmp(&b.remaining))
        });
        let decay = slowest.unwrap_or(DecayCheck::NOTHING);
        let window = match self.settings.window {
            None => choose_window(&checks, self.lines.duration),
            Some(WindowKind::Rectangular) => Window::Rectangular,
            Some(WindowKind::Hann) => Window::Hann,
            Some(WindowKind::Exponential) => exponential_to(decay.remaining, self.lines.duration),
        };
        drop((limiter, record));
        let (sums, decays) = self.sums(window, &quiet)?;
        let Averages {
            averages,
            transforms,
            window_change,
        } = sums;
        let level = self.level(&averages, &quiet, window);
        let mut readings = self.readings(&level, &averages, &transforms, &quiet, window);
        drop(transforms);
        work.go_on(Stage::Fits);
        let taps_together = decays.as_ref().and_then(|decays| decays.taps_together);
        let decays = decays.and_then(|decays| FreeDecays::new(decays).ok());
        let stabilisation = match decays {
            Some(decays) => {
                let hum = quiet.hum_beside(&readings, &self.lines, &self.settings.mains);
                let settings = &self.settings;
                decays.fit(
                    &mut readings,
                    &self.lines,
                    &settings.kinds,
                    hum,
                    &settings.poles,
                )
            }
            None => Stabilisation {
                without_mode: keep_chosen(&mut readings, &self.settings.poles, &self.lines),
                ..Stabilisation::default()
            },
        };
        for reading in &mut readings {
            reading.select_estimate(self.settings.reading);
        }
        let mains = &self.settings.mains;
        label_steady_lines(&mut readings, &quiet.grids, self.lines.duration, mains);
        readings.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
        label_combinations(&mut readings);
        set_strengths(&mut readings, &self.settings.kinds, true);
        Ok(MeasuredSpectra {
            force_window: self.force_window(&readings, window_change),
            averages,
            window,
            decay: Some(decay),
            unlisted: unlisted_peaks(&level, &self.settings.peaks, &readings),
            fitted: None,
            readings,
            force_noise: quiet.force_noise(&self.lines),
            stabilisation,
            taps_together,
        })
    }

    /// Reads every accepted tap once: averages of the spectra, and the decays for the fits.
    fn sums(
        &self,
        window: Window,
        quiet: &PreTriggerNoise,
    ) -> Result<(Averages, Option<CollectedDecays>), RecordingError> {
        let rate = self.recording.sample_rate();
        let taps: Vec<&Tap> = self.taps.accepted().collect();
        let mut sums = TapSums::new(
            self.lines,
            rate,
            self.gate,
            window,
            self.has_force,
            self.responses(),
            taps.len(),
        );
        let mut decays =
            DecayCollector::new(&taps, rate, self.gate, self.has_force, self.responses());
        let mut record = vec![Vec::new(); self.channels.len()];
        for tap in taps {
            self.read_record(tap, &mut record)?;
            if let Some(decays) = &mut decays {
                decays.add(tap, &record);
            }
            if !self.has_force || tap.is_whole() {
                let skipped = (tap.usable_from() - tap.record.start) as usize;
                for samples in &mut record {
                    samples.drain(..skipped.min(samples.len()));
                }
                sums.add(tap, &mut record);
            }
            if let Some(decays) = decays.as_mut().filter(|decays| decays.needs_highest_peak()) {
                // The level needs about the room that a long record takes.
                record.fill_with(Vec::new);
                let averages = sums.responses_so_far();
                let level = self.level(&averages, quiet, window);
                let peaks = find_peaks(&level, &self.settings.peaks);
                let places = peaks.iter().map(|peak| self.lines.frequency(peak.index));
                let highest = places.max_by(f64::total_cmp);
                decays.settle(highest.unwrap_or(self.lines.high));
            }
        }
        let decays = decays.and_then(|decays| decays.finish(&self.lines));
        Ok((sums.finish(), decays))
    }

    /// Length of the force window, and the change that it makes to H1 at the resonances.
    fn force_window(
        &self,
        readings: &[ModeReading],
        change: Option<WindowChange>,
    ) -> Option<ForceWindow> {
        let change = change?;
        let mut largest: Option<f64> = None;
        for reading in readings.iter().filter(|reading| reading.label.is_none()) {
            let line = self.lines.nearest(reading.frequency);
            let (changed, whole) = (change.changed[line], change.whole[line]);
            if whole > 0.0 {
                largest = Some(f64::max(largest.unwrap_or(0.0), (changed / whole).sqrt()));
            }
        }
        let rate = self.recording.sample_rate();
        let windows = self.averaged().filter_map(|tap| PulseWindow::of(tap, rate));
        let lengths: Vec<f64> = windows.map(PulseWindow::length).collect();
        Some(ForceWindow {
            length: lengths.iter().sum::<f64>() / lengths.len().max(1) as f64 / rate,
            h1_change: largest,
        })
    }

    /// The composite level over all sensors: of H1 with a hammer, of the responses without one.
    fn level(
        &self,
        averages: &AveragedSpectra,
        quiet: &PreTriggerNoise,
        window: Window,
    ) -> CompositeLevel {
        let powers: Vec<Vec<f64>> = match &averages.h1 {
            Some(h1) => h1
                .iter()
                .map(|h| h.iter().map(Complex64::norm_sqr).collect())
                .collect(),
            None => averages
                .responses
                .iter()
                .map(|x| x.iter().map(|x| x * x).collect())
                .collect(),
        };
        let noise = quiet.noise_powers(averages, window);
        CompositeLevel::new(self.lines, &powers, noise.as_deref())
    }

    /// Peaks of the composite level, read and labelled.
    fn readings(
        &self,
        level: &CompositeLevel,
        averages: &AveragedSpectra,
        transforms: &[Vec<Complex64>],
        quiet: &PreTriggerNoise,
        window: Window,
    ) -> Vec<ModeReading> {
        let peaks = find_peaks(level, &self.settings.peaks);
        let spectra: Vec<&[Complex64]> = averages
            .h1
            .as_deref()
            .unwrap_or(transforms)
            .iter()
            .map(Vec::as_slice)
            .collect();
        let mut readings = read_peaks(level, &spectra, &peaks, window);
        for (reading, peak) in readings.iter_mut().zip(&peaks) {
            // A peak over a gap of the force's spectrum: a hammer has none just where the structure resonates, so the
            // quotient's peak is the force's doing. The force on the peak is compared with that on its flanks, where
            // the level has fallen by 6 dB. A gap is lower than either flank; a force that merely falls off is lower
            // than one.
            let (level, force) = (&level.level_db, averages.force.as_deref());
            let foot = level[peak.index] - 6.0;
            let mut before = level[..peak.index].iter();
            let left = before.rposition(|&level| level < foot);
            let mut after = level[peak.index..].iter();
            let right = after.position(|&level| level < foot);
            if let (Some(force), Some(left), Some(right)) = (force, left, right)
                && let (Some(&left), Some(&right)) =
                    (force.get(left), force.get(peak.index + right))
                && force[peak.index] < 0.6 * left.min(right)
            {
                reading.label = Some(PeakLabel::ForceGap);
            }
            let mains = &self.settings.mains;
            if let Some(harmonic) = quiet.mains_harmonic(peak.index, averages, window, mains) {
                reading.line_frequency = self.lines.frequency(peak.index);
                reading.make_mains(harmonic);
            }
        }
        readings
    }

    fn responses(&self) -> usize {
        self.channels.len() - usize::from(self.has_force)
    }
}
