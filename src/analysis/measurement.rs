//! The measurement of one recording: taps, noise before them, averaged spectra, free decays, readings.

use super::explained::{FittedCurves, UnlistedPeak, unlisted_peaks};
use super::fits::{FreeDecays, Stabilisation};
use super::quiet::PreTriggerNoise;
use super::warnings::{Warning, of_recording};
use num_complex::Complex64;
use std::f64::consts::TAU;
use tapjoint_description::WindowKind;
use tapjoint_numerics::stats::{median, root_mean_square};
use tapjoint_signal::modal::amplitude::Decay;
use tapjoint_signal::modal::fit::TapForce;
use tapjoint_signal::modal::{
    CompositeLevel, GRIDS, GridFrequency, MainsSettings, ModeReading, PeakLabel, PeakSettings,
    ReadBy, find_peaks, label_combinations, label_steady_lines, read_peaks, set_strengths,
};
use tapjoint_signal::recording::{Recording, RecordingError, ResponseForm};
use tapjoint_signal::spectral::{
    AveragedSpectra, DISPLAY_RATIO, DecayCheck, LEAST_BLOCK, Lines, MOST_BLOCK, RUNG_DOWN,
    SpectralAverager, SpectralError, Transformer, Window, apply_force_window, band_limited,
    choose_window, exponential_to, largest_smooth_block, measure_decay,
};
use tapjoint_signal::taps::{Tap, TapSettings, TapSource, Taps, find_taps};

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
    /// Form of each response, for modal constants; `None` where it is not known, or no motion in
    /// SI units over a force in N.
    pub kinds: Vec<Option<ResponseForm>>,
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
            kinds: Vec::new(),
            taps: TapSettings::default(),
            peaks: PeakSettings::default(),
            mains: MainsSettings::default(),
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
}

/// The window that keeps noise and offset of the hammer before and after a pulse out of the functions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceWindow {
    /// Length (s), half of the taper included: mean of the accepted taps.
    pub length: f64,
    /// Largest relative change of H1 that the window causes at a resonance (1): sqrt(sum |H1w - H1|^2 / sum |H1|^2) over
    /// the responses, H1w with the window, H1 without it. `None` without a resonance.
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
    // The band is judged before anything is read: it is the user's typing, not the data.
    let trial = lines_for(settings, recording.sample_rate(), recording.duration());
    let trial = trial.map_err(|problem| MeasureError::of(recording, problem))?;
    let mut tap_settings = settings.taps;
    tap_settings.wanted = settings
        .block
        .map(|_| trial.block as f64 / (DISPLAY_RATIO * (trial.high - trial.low)));
    let taps = find_taps(recording, &settings.source, &tap_settings)?;
    let mut warnings = of_recording(recording, &settings.source, &taps);
    let mut spectra = None;
    if let Some(shortest) = taps.shortest() {
        let available = shortest as f64 / recording.sample_rate();
        match lines_for(settings, recording.sample_rate(), available) {
            Ok(lines) => {
                let found = Stage::new(recording, settings, &taps, lines).spectra()?;
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

/// The axis: block and band as wanted, or the longest block that fits `available` seconds.
fn lines_for(
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

/// Bound on what is kept of all taps for readings without a hammer and for fits (values of 8 or 16 bytes
/// each). Taps beyond it are left out of them.
const MOST_KEPT: usize = 1 << 24;

/// Without a hammer a decay begins this long after its trigger (s): hammer pulses are shorter.
const AFTER_TRIGGER: f64 = 5e-3;
/// Fewest samples of a decay that is fitted: some 16 lines for a mode and its surroundings.
const LEAST_SAMPLES: u64 = 64;

/// Averages over the accepted taps, and what is read from the transforms besides.
struct Averages {
    averages: AveragedSpectra,
    /// Every tap's own transforms without a hammer, up to a bound on memory: their phases differ, so that they cannot be
    /// averaged.
    transforms: Vec<Vec<Complex64>>,
    /// H1 of every response by the force without its window; `None` without a hammer.
    ungated: Option<Vec<Vec<Complex64>>>,
}

/// Data that every step of one recording's measurement needs.
struct Stage<'a> {
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

impl<'a> Stage<'a> {
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
        Stage {
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
    fn read(&self, range: std::ops::Range<u64>) -> Result<Vec<Vec<f64>>, RecordingError> {
        let start = range.start;
        let mut channels = self.recording.read_channels(&self.channels, range)?;
        for (samples, &channel) in channels.iter_mut().zip(&self.channels) {
            let mean = self.recording.mean_at(channel, start);
            samples.iter_mut().for_each(|x| *x -= mean);
        }
        Ok(channels)
    }

    /// The taps whose records are averaged: with a force those that are whole.
    fn averaged(&self) -> impl Iterator<Item = &'a Tap> {
        let has_force = self.has_force;
        self.taps
            .accepted()
            .filter(move |tap| !has_force || tap.is_whole())
    }

    fn record(&self, tap: &Tap) -> Result<Vec<Vec<f64>>, RecordingError> {
        self.read(tap.usable_from()..tap.usable_from() + self.gate)
    }

    /// The quiet stretch before the first tap, at most a block.
    fn quiet(&self) -> Result<PreTriggerNoise, RecordingError> {
        let quiet = self.taps.quiet.clone();
        let start = quiet.start.max(quiet.end.saturating_sub(self.gate));
        let mut force = self.read(start..quiet.end)?;
        let responses = force.split_off(usize::from(self.has_force));
        let rate = self.recording.sample_rate();
        let windows = self.averaged().filter_map(|tap| pulse_window(tap, rate));
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

    fn spectra(&self) -> Result<MeasuredSpectra, RecordingError> {
        let quiet = self.quiet()?;
        let rate = self.recording.sample_rate();
        let band = (self.lines.low, self.lines.high);
        let noise: Vec<f64> = quiet
            .responses
            .iter()
            .map(|x| root_mean_square(&band_limited(x, rate, band)))
            .collect();
        // The decay of each response inside the band, the largest over the accepted taps.
        let mut checks = vec![DecayCheck::NOTHING; noise.len()];
        for tap in self.taps.accepted() {
            let responses = self.record(tap)?.split_off(usize::from(self.has_force));
            for ((samples, &noise), check) in responses.iter().zip(&noise).zip(&mut checks) {
                let found = measure_decay(&band_limited(samples, rate, band), noise);
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
        let Averages {
            averages,
            transforms,
            ungated,
        } = self.averages(window)?;
        let level = self.level(&averages, &quiet, window);
        let mut readings = self.readings(&level, &averages, &transforms, &quiet, window);
        let stabilisation = match self.free_decays()? {
            Some(decays) => {
                let hum = quiet.hum_beside(&readings, &self.lines, &self.settings.mains);
                decays.fit(&mut readings, &self.lines, &self.settings.kinds, hum)
            }
            None => Stabilisation::default(),
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
            force_window: self.force_window(&readings, &averages, ungated.as_deref()),
            averages,
            window,
            decay: Some(decay),
            unlisted: unlisted_peaks(&level, &self.settings.peaks, &readings),
            fitted: None,
            readings,
            force_noise: quiet.force_noise(&self.lines),
            stabilisation,
        })
    }

    fn averages(&self, window: Window) -> Result<Averages, RecordingError> {
        let rate = self.recording.sample_rate();
        let mut averager = SpectralAverager::new(self.lines, self.responses());
        let mut whole = SpectralAverager::new(self.lines, self.responses());
        let transformer = Transformer::new(rate, self.lines, self.gate as usize);
        let mut kept: Vec<Vec<Complex64>> = Vec::new();
        for tap in self.averaged() {
            let mut samples = self.record(tap)?;
            let mut ungated = None;
            let gate = pulse_window(tap, rate).filter(|_| self.has_force);
            if let (Some(gate), Some(force)) = (gate, samples.first_mut()) {
                remove_offset(force, rate);
                let mut copy = force.clone();
                window.apply(&mut copy, rate);
                ungated = Some(transformer.transform(&copy));
                gate.apply(force);
            }
            let mut transforms: Vec<Vec<Complex64>> = samples
                .iter_mut()
                .map(|samples| {
                    window.apply(samples, rate);
                    transformer.transform(samples)
                })
                .collect();
            let responses = transforms.split_off(usize::from(self.has_force));
            averager.add(transforms.first().map(Vec::as_slice), &responses);
            if let Some(force) = ungated {
                whole.add(Some(&force), &responses);
            }
            if !self.has_force && kept.len() * self.lines.points() < MOST_KEPT {
                // Time zero is moved to the trigger. The quiet stretch before it tilts the phase, and a fit of few
                // lines could not follow that tilt as a background.
                let delay = tap.time - tap.usable_from() as f64 / rate;
                for mut transform in responses {
                    for (line, value) in transform.iter_mut().enumerate() {
                        let turn = TAU * self.lines.frequency(line) * delay;
                        *value *= Complex64::from_polar(1.0, turn);
                    }
                    kept.push(transform);
                }
            }
        }
        // At least one tap was accepted, or there would be no axis.
        let averages = averager
            .finish()
            .unwrap_or_else(|| AveragedSpectra::empty(self.lines));
        Ok(Averages {
            averages,
            transforms: kept,
            ungated: whole.finish().and_then(|whole| whole.h1),
        })
    }

    /// Length of the force window, and the change that it makes to H1 at the resonances.
    fn force_window(
        &self,
        readings: &[ModeReading],
        averages: &AveragedSpectra,
        ungated: Option<&[Vec<Complex64>]>,
    ) -> Option<ForceWindow> {
        let (gated, ungated) = (averages.h1.as_deref()?, ungated?);
        let mut largest: Option<f64> = None;
        for reading in readings.iter().filter(|reading| reading.label.is_none()) {
            let line = averages.lines.nearest(reading.frequency);
            let (mut change, mut all) = (0.0, 0.0);
            for (with, without) in gated.iter().zip(ungated) {
                change += (with[line] - without[line]).norm_sqr();
                all += without[line].norm_sqr();
            }
            if all > 0.0 {
                largest = Some(f64::max(largest.unwrap_or(0.0), (change / all).sqrt()));
            }
        }
        let rate = self.recording.sample_rate();
        let windows = self.averaged().filter_map(|tap| pulse_window(tap, rate));
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

    /// First frame of the decay after a tap.
    fn begin(&self, tap: &Tap) -> u64 {
        let after = (AFTER_TRIGGER * self.recording.sample_rate()).ceil();
        let trigger = (tap.time * self.recording.sample_rate()).round();
        let begin = tap.pulse_end.unwrap_or((trigger + after) as u64);
        // Samples that were cut off are no decay.
        begin.max(tap.usable_from())
    }

    /// Reads the decays; `None` where they are too short for a fit.
    fn free_decays(&self) -> Result<Option<FreeDecays>, RecordingError> {
        let taps: Vec<&Tap> = self.taps.accepted().collect();
        let lengths = taps
            .iter()
            .map(|tap| (tap.usable_from() + self.gate).saturating_sub(self.begin(tap)));
        let shortest = lengths.min().unwrap_or(0);
        let samples = match largest_smooth_block(shortest as usize) {
            Some(samples) if samples as u64 >= LEAST_SAMPLES => samples,
            _ => return Ok(None),
        };
        let most = MOST_KEPT / (samples * self.responses()).max(1);
        let (mut decays, mut forces) = (Vec::new(), Vec::new());
        for (number, tap) in taps.into_iter().take(most.max(1)).enumerate() {
            let (decay, force) = self.decay(tap, samples)?;
            forces.extend(force.map(|samples| TapForce {
                tap: number,
                start: -(samples.len() as f64) / decay.sample_rate,
                samples,
                sample_rate: decay.sample_rate,
            }));
            decays.push(decay);
        }
        Ok(FreeDecays::new(samples, &self.lines, decays, forces).ok())
    }

    fn responses(&self) -> usize {
        self.channels.len() - usize::from(self.has_force)
    }

    /// The decay after a tap, and the force before it.
    fn decay(
        &self,
        tap: &Tap,
        samples: usize,
    ) -> Result<(Decay, Option<Vec<f64>>), RecordingError> {
        let rate = self.recording.sample_rate();
        let begin = self.begin(tap);
        let mut channels = self.read(tap.record.start..begin + samples as u64)?;
        let before = (begin - tap.record.start) as usize;
        let responses = channels.split_off(usize::from(self.has_force));
        let force = channels.pop().filter(|_| tap.is_whole());
        let force = force.map(|mut force| {
            remove_offset(&mut force, rate);
            if let Some(window) = pulse_window(tap, rate) {
                window.apply(&mut force);
            }
            force.truncate(before);
            force
        });
        let decay = Decay {
            start: begin as f64 / rate - tap.time,
            sample_rate: rate,
            responses: responses
                .into_iter()
                .map(|x| x[before.min(x.len())..].to_vec())
                .collect(),
        };
        Ok((decay, force))
    }
}

/// Window about the pulse of a tap in its record (samples): zero before `start`, unity for `length`
/// from there, a taper of the pulse's own length after it.
#[derive(Clone, Copy)]
struct PulseWindow {
    start: usize,
    length: usize,
    taper: usize,
}

/// The ringing of a filter ahead of a pulse lasts no longer than this (s), or eight samples.
const AHEAD_OF_PULSE: f64 = 2e-3;

/// The force window of a tap, from just before the trigger to the end of the pulse. It goes on for as long again,
/// since the search for that end may stop early. Noise and offset of the hammer before and after would ripple through
/// every quotient. `None` without a hammer.
fn pulse_window(tap: &Tap, sample_rate: f64) -> Option<PulseWindow> {
    let trigger = (tap.time * sample_rate).round() as u64;
    let pulse = tap.pulse_end?.saturating_sub(trigger).max(1) as usize;
    let into = trigger.saturating_sub(tap.record.start) as usize;
    let ahead = ((AHEAD_OF_PULSE * sample_rate) as usize).max(8).min(into);
    Some(PulseWindow {
        start: into - ahead,
        length: ahead + 2 * pulse,
        taper: pulse,
    })
}

impl PulseWindow {
    fn apply(self, force: &mut [f64]) {
        let start = self.start.min(force.len());
        force[..start].fill(0.0);
        apply_force_window(&mut force[start..], self.length, self.taper);
    }

    /// Length of the window (samples), half of its taper included.
    fn length(self) -> f64 {
        self.length as f64 + 0.5 * self.taper as f64
    }

    /// Energy of the window (samples): a half-cosine taper has 3/8 of its length.
    fn energy(self) -> f64 {
        self.length as f64 + 0.375 * self.taper as f64
    }
}

/// Stretch of the force in which its offset is looked for (s): long beside the pulse, so that the
/// median is the level at rest, and short beside the drift of its amplifier.
const OFFSET_STRETCH: f64 = 0.2;

/// Takes out the level at which the force rests about its pulse. The mean of the recording is not
/// that level: the pulses are in it, and over the force window the difference amounts to a percent
/// of a pulse's momentum.
fn remove_offset(force: &mut [f64], sample_rate: f64) {
    let stretch = ((OFFSET_STRETCH * sample_rate) as usize).clamp(1, force.len().max(1));
    let mut about: Vec<f64> = force.iter().copied().take(stretch).collect();
    let rest = median(&mut about);
    force.iter_mut().for_each(|x| *x -= rest);
}
