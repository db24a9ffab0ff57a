//! Measuring one recording: taps, averaged spectra, free decays, readings.

use super::fits::{Candidates, Stabilisation, stabilisation};
use super::noise::{PreTriggerNoise, PulseWindow, pulse_window, remove_offset};
use super::warning::Warning;
use num_complex::Complex64;
use std::f64::consts::TAU;
use tapjoint_description::WindowKind;
use tapjoint_numerics::stats::root_mean_square;
use tapjoint_signal::modal::amplitude::{Decay, KnownMode, follow_amplitude};
use tapjoint_signal::modal::fit::{
    Column, FitError, FreeDecayCollector, ModalData, TapForce, modal_constants,
};
use tapjoint_signal::modal::{
    CompositeLevel, FittedReading, MainsSettings, ModeReading, PeakLabel, PeakSettings, ReadBy,
    find_peaks, read_peaks,
};
use tapjoint_signal::recording::{Recording, RecordingError, ResponseForm};
use tapjoint_signal::spectral::{
    AveragedSpectra, DISPLAY_RATIO, DecayCheck, LEAST_BLOCK, Lines, MOST_BLOCK, RUNG_DOWN,
    SpectralAverager, SpectralError, Transformer, Window, band_limited, choose_window,
    exponential_to, largest_smooth_block, measure_decay,
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
    /// Noise of the force channel in its windowed transforms, line by line (N s); `None`
    /// without a hammer or a quiet stretch before the first tap.
    pub force_noise: Option<Vec<f64>>,
    /// Result of the polyreference fit.
    pub stabilisation: Stabilisation,
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
    let trial = trial.map_err(|problem| MeasureError::Spectral {
        file: recording.name().to_string(),
        problem,
    })?;
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
                warnings.extend(of_spectra(recording.name(), &found));
                spectra = Some(found);
            }
            // The file would do, but its taps come too soon: data, not typing.
            Err(problem) => warnings.push(Warning::taps_too_short(recording.name(), &problem)),
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

/// Doubts about a recording and its taps.
pub(super) fn of_recording(recording: &Recording, source: &TapSource, taps: &Taps) -> Vec<Warning> {
    let file = recording.name();
    let mut warnings = Vec::new();
    for warning in recording.warnings() {
        warnings.push(Warning::about(file, warning.code(), warning));
    }
    for remark in &taps.remarks {
        warnings.push(Warning::about(file, "taps", remark));
    }
    let accepted = taps.accepted().count();
    let rejected = taps.taps.len() - accepted;
    if rejected > 0 {
        warnings.push(Warning::rejected_taps(file, rejected, taps.taps.len()));
    }
    if accepted == 1 && matches!(source, TapSource::Hammer { .. }) {
        warnings.push(Warning::single_tap(file));
    }
    warnings
}

/// Doubts about a recording's spectra.
fn of_spectra(file: &str, spectra: &MeasuredSpectra) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if let Some(decay) = spectra.decay
        && decay.remaining > RUNG_DOWN
        && decay.remaining > decay.noise
    {
        warnings.push(Warning::NotRungDown {
            file: file.to_string(),
            remaining: decay.remaining,
            window: spectra.window,
            others: Vec::new(),
        });
    }
    if spectra.window == Window::Hann {
        warnings.push(Warning::hann_on_taps(file));
    }
    for reading in &spectra.readings {
        if let Some(label @ PeakLabel::Mains(_)) = reading.label {
            warnings.push(Warning::Mains {
                file: file.to_string(),
                frequency: reading.line_frequency,
                label,
                others: Vec::new(),
            });
        }
    }
    warnings
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
        Stage {
            recording,
            settings,
            taps,
            lines,
            channels: settings.source.channels(),
            has_force: matches!(settings.source, TapSource::Hammer { .. }),
            gate: (lines.duration * recording.sample_rate()).round() as u64,
        }
    }

    /// Samples of all channels in a range of frames, each channel's mean taken out.
    fn read(&self, range: std::ops::Range<u64>) -> Result<Vec<Vec<f64>>, RecordingError> {
        let mut channels = self.recording.read_channels(&self.channels, range)?;
        for (samples, &channel) in channels.iter_mut().zip(&self.channels) {
            let mean = self.recording.mean(channel);
            samples.iter_mut().for_each(|x| *x -= mean);
        }
        Ok(channels)
    }

    fn record(&self, tap: &Tap) -> Result<Vec<Vec<f64>>, RecordingError> {
        self.read(tap.record.start..tap.record.start + self.gate)
    }

    /// The quiet stretch before the first tap, at most a block.
    fn quiet(&self) -> Result<PreTriggerNoise, RecordingError> {
        let quiet = self.taps.quiet();
        let start = quiet.start.max(quiet.end.saturating_sub(self.gate));
        let mut force = self.read(start..quiet.end)?;
        let responses = force.split_off(usize::from(self.has_force));
        let rate = self.recording.sample_rate();
        let windows = self
            .taps
            .accepted()
            .filter_map(|tap| pulse_window(tap, rate));
        let energy: f64 = windows.map(PulseWindow::energy).sum();
        let count = self.taps.accepted().count().max(1) as f64;
        Ok(PreTriggerNoise {
            force: force.pop(),
            responses,
            sample_rate: self.recording.sample_rate(),
            block: self.gate as usize,
            force_window: energy / count,
        })
    }

    fn spectra(&self) -> Result<MeasuredSpectra, RecordingError> {
        let quiet = self.quiet()?;
        let checks = self.decay_checks(&quiet)?;
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
        let (averages, transforms) = self.averages(window)?;
        let mut readings = self.readings(&averages, &transforms, &quiet, window);
        let stabilisation = self.fit(&mut readings)?;
        for reading in &mut readings {
            reading.select_estimate(self.settings.reading);
        }
        readings.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
        Ok(MeasuredSpectra {
            averages,
            window,
            decay: Some(decay),
            readings,
            force_noise: quiet.force_noise(&self.lines),
            stabilisation,
        })
    }

    /// Fits the free decays, and puts what that gives into the readings.
    fn fit(&self, readings: &mut Vec<ModeReading>) -> Result<Stabilisation, RecordingError> {
        let Some(decays) = FreeDecays::read(self)? else {
            return Ok(Stabilisation::default());
        };
        let functions = decays.functions();
        let columns: Vec<&[Complex64]> = functions.iter().map(Vec::as_slice).collect();
        let first = decays.data.frequencies().first().copied().unwrap_or(0.0);
        let stabilisation = stabilisation(first, decays.data.spacing(), &columns);
        let candidates = Candidates {
            lines: &self.lines,
            data: &decays.data,
            stabilisation: &stabilisation,
        };
        candidates.fit(readings);
        complete(readings, &decays, &self.settings.kinds);
        Ok(stabilisation)
    }

    /// The decay of each response inside the band, the largest over the accepted taps.
    fn decay_checks(&self, quiet: &PreTriggerNoise) -> Result<Vec<DecayCheck>, RecordingError> {
        let rate = self.recording.sample_rate();
        let band = (self.lines.low, self.lines.high);
        let noise: Vec<f64> = quiet
            .responses
            .iter()
            .map(|x| root_mean_square(&band_limited(x, rate, band)))
            .collect();
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
        Ok(checks)
    }

    /// Averages, and without a hammer also every tap's own transforms (their phases differ, so they
    /// cannot be averaged), up to a bound on memory.
    fn averages(
        &self,
        window: Window,
    ) -> Result<(AveragedSpectra, Vec<Vec<Complex64>>), RecordingError> {
        let rate = self.recording.sample_rate();
        let responses = self.channels.len() - usize::from(self.has_force);
        let mut averager = SpectralAverager::new(self.lines, responses);
        let transformer = Transformer::new(rate, self.lines, self.gate as usize);
        let mut kept: Vec<Vec<Complex64>> = Vec::new();
        for tap in self.taps.accepted() {
            let mut samples = self.record(tap)?;
            if let (Some(window), Some(force)) = (pulse_window(tap, rate), samples.first_mut()) {
                remove_offset(force, rate);
                window.apply(force);
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
            if !self.has_force && kept.len() * self.lines.points() < MOST_KEPT {
                // Time zero is moved to the trigger: the slope that the quiet before it puts on the phase is no
                // background that a fit of few lines could follow.
                let delay = tap.time - tap.record.start as f64 / rate;
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
        Ok((averages, kept))
    }

    /// Peaks of the composite level over all sensors, read and labelled.
    fn readings(
        &self,
        averages: &AveragedSpectra,
        transforms: &[Vec<Complex64>],
        quiet: &PreTriggerNoise,
        window: Window,
    ) -> Vec<ModeReading> {
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
        let level = CompositeLevel::new(self.lines, &powers, noise.as_deref());
        let peaks = find_peaks(&level, &self.settings.peaks);
        let spectra: Vec<&[Complex64]> = averages
            .h1
            .as_deref()
            .unwrap_or(transforms)
            .iter()
            .map(Vec::as_slice)
            .collect();
        let mut readings = read_peaks(&level, &spectra, &peaks, window);
        for (reading, peak) in readings.iter_mut().zip(&peaks) {
            let force = averages.force.as_deref();
            if force.is_some_and(|force| is_force_gap(force, &level.level_db, peak.index)) {
                reading.label = Some(PeakLabel::ForceGap);
            }
            let mains = &self.settings.mains;
            if let Some(label) = quiet.mains_label(peak.index, averages, window, mains) {
                // A mains line keeps its line reading and loses what only a resonance has.
                reading.line_frequency = self.lines.frequency(peak.index);
                reading.between = None;
                reading.damping_ratio = None;
                reading.damping_std = None;
                reading.label = Some(label);
                reading.select_estimate(ReadBy::Line);
            }
        }
        readings
    }
}

/// Bound on what is kept of all taps for readings without a hammer and for fits (values of 8 or 16 bytes
/// each). Taps beyond it are left out of them.
const MOST_KEPT: usize = 1 << 24;

/// Returns true if a peak stands over a gap of the force's spectrum: a hammer has none just where the structure
/// resonates, so the quotient's peak is the force's doing. The force on the peak is compared with that
/// on its flanks, where the level (dB) has fallen by 6 dB.
fn is_force_gap(force: &[f64], level: &[f64], peak: usize) -> bool {
    let foot = level[peak] - 6.0;
    let left = level[..peak].iter().rposition(|&level| level < foot);
    let right = level[peak..].iter().position(|&level| level < foot);
    let (Some(left), Some(right)) = (left, right) else {
        return false;
    };
    // A gap is lower than either flank; a force that merely falls off is lower than one.
    match (force.get(left), force.get(peak + right)) {
        (Some(&left), Some(&right)) => force[peak] < 0.6 * left.min(right),
        _ => false,
    }
}

/// Without a hammer a decay begins this long after its trigger (s): hammer pulses are shorter.
const AFTER_TRIGGER: f64 = 5e-3;
/// Fewest samples of a decay that is fitted: some 16 lines for a mode and its surroundings.
const LEAST_SAMPLES: u64 = 64;

/// Decays of all taps, and what of them is fitted.
struct FreeDecays {
    /// Transforms of every tap and sensor on the lines of the band.
    pub data: ModalData,
    /// Force of each tap; empty without a hammer.
    pub forces: Vec<TapForce>,
    /// Samples of each tap.
    pub decays: Vec<Decay>,
    /// Transforms of the forces, time zero at the decays' first sample; empty without a hammer.
    force_columns: Vec<Column>,
}

impl FreeDecays {
    /// Reads the decays; `None` where they are too short for a fit.
    pub fn read(stage: &Stage<'_>) -> Result<Option<Self>, RecordingError> {
        let taps: Vec<&Tap> = stage.taps.accepted().collect();
        let lengths = taps
            .iter()
            .map(|tap| (tap.record.start + stage.gate).saturating_sub(stage.begin(tap)));
        let shortest = lengths.min().unwrap_or(0);
        let samples = match largest_smooth_block(shortest as usize) {
            Some(samples) if samples as u64 >= LEAST_SAMPLES => samples,
            _ => return Ok(None),
        };
        let most = MOST_KEPT / (samples * stage.responses()).max(1);
        let mut decays = Vec::new();
        let mut forces = Vec::new();
        for (number, tap) in taps.into_iter().take(most.max(1)).enumerate() {
            let (decay, force) = stage.decay(tap, samples)?;
            forces.extend(force.map(|samples| TapForce {
                tap: number,
                start: -(samples.len() as f64) / decay.sample_rate,
                samples,
                sample_rate: decay.sample_rate,
            }));
            decays.push(decay);
        }
        Ok(transformed(stage, samples, decays, forces).ok())
    }

    /// Columns of the polyreference fit, all on the same lines: with a hammer the response of
    /// every sensor to the force, H = sum conj(F) X/sum |F|^2 over the taps; without one every tap's
    /// transforms.
    pub fn functions(&self) -> Vec<Vec<Complex64>> {
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

fn transformed(
    stage: &Stage<'_>,
    samples: usize,
    decays: Vec<Decay>,
    forces: Vec<TapForce>,
) -> Result<FreeDecays, FitError> {
    let rate = stage.recording.sample_rate();
    let band = [(stage.lines.low, stage.lines.high)];
    let mut responses = FreeDecayCollector::new(rate, samples, &band)?;
    for decay in &decays {
        responses.add_tap(&decay.responses)?;
    }
    let mut pulses = FreeDecayCollector::new(rate, samples, &band)?;
    for force in &forces {
        // The force before time zero stands at the end of the block: on multiples of rate/block a transform
        // cannot tell a time from one a block later.
        let kept = force.samples.len().min(samples);
        let mut block = vec![0.0; samples - kept];
        block.extend_from_slice(&force.samples[force.samples.len() - kept..]);
        pulses.add_tap(&[block])?;
    }
    let force_columns = if forces.is_empty() {
        Vec::new()
    } else {
        pulses.finish()?.columns().to_vec()
    };
    Ok(FreeDecays {
        data: responses.finish()?,
        forces,
        decays,
        force_columns,
    })
}

impl Stage<'_> {
    /// First frame of the decay after a tap.
    fn begin(&self, tap: &Tap) -> u64 {
        let after = (AFTER_TRIGGER * self.recording.sample_rate()).ceil();
        let trigger = (tap.time * self.recording.sample_rate()).round();
        tap.pulse_end.unwrap_or((trigger + after) as u64)
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
        let force = channels.pop().map(|mut force| {
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

/// Adds to the fits what needs the decays themselves: modal constants, and frequency and damping against
/// amplitude.
fn complete(readings: &mut [ModeReading], decays: &FreeDecays, kinds: &[Option<ResponseForm>]) {
    let fitted: Vec<&mut FittedReading> = readings
        .iter_mut()
        .filter_map(|reading| reading.fit.as_deref_mut())
        .collect();
    let known: Vec<KnownMode> = fitted
        .iter()
        .map(|fit| KnownMode {
            frequency: fit.mode.frequency.value,
            damping_ratio: fit.mode.damping_ratio.value,
        })
        .collect();
    let curves = follow_amplitude(&decays.decays, &known);
    for (fit, curve) in fitted.into_iter().zip(curves) {
        fit.amplitude = Some(curve);
        fit.constants = modal_constants(&fit.mode, &decays.forces, kinds);
    }
}
