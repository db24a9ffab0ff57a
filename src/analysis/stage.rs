//! The steps of one recording's measurement that read samples.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::decays::FreeDecays;
use super::fits::{Candidates, Stabilisation, complete, stabilisation};
use super::force::{PulseWindow, pulse_window, remove_offset};
use super::measure::{MeasureSettings, MeasuredSpectra};
use super::quiet::Quiet;
use tapjoint_description::WindowKind;
use tapjoint_numerics::stats::root_mean_square;
use tapjoint_signal::modal::{
    CompositeLevel, ModeReading, PeakLabel, ReadBy, find_peaks, read_peaks,
};
use tapjoint_signal::recording::{Recording, RecordingError};
use tapjoint_signal::spectral::{
    AveragedSpectra, DecayCheck, Lines, SpectralAverager, Transformer, Window, band_limited,
    choose_window, exponential_to, measure_decay,
};
use tapjoint_signal::taps::{Tap, TapSource, Taps};

/// What every step of one recording's measurement needs.
pub(super) struct Stage<'a> {
    pub(super) recording: &'a Recording,
    pub(super) settings: &'a MeasureSettings,
    pub(super) taps: &'a Taps,
    pub(super) lines: Lines,
    /// Force first, where there is one, then the responses.
    pub(super) channels: Vec<usize>,
    pub(super) has_force: bool,
    /// Frames of a block.
    pub(super) gate: u64,
}

impl<'a> Stage<'a> {
    pub(super) fn new(
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
    pub(super) fn read(
        &self,
        range: std::ops::Range<u64>,
    ) -> Result<Vec<Vec<f64>>, RecordingError> {
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
    fn quiet(&self) -> Result<Quiet, RecordingError> {
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
        Ok(Quiet {
            force: force.pop(),
            responses,
            sample_rate: self.recording.sample_rate(),
            block: self.gate as usize,
            force_window: energy / count,
        })
    }

    pub(super) fn spectra(&self) -> Result<MeasuredSpectra, RecordingError> {
        let quiet = self.quiet()?;
        let checks = self.decay_checks(&quiet)?;
        let decay = slowest_decay(&checks);
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
            reading.prefer(self.settings.reading);
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
    fn decay_checks(&self, quiet: &Quiet) -> Result<Vec<DecayCheck>, RecordingError> {
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
                let delay = tap.time - tap.record.start as f64 / rate;
                kept.extend(
                    responses
                        .into_iter()
                        .map(|x| self.timed_from_trigger(x, delay)),
                );
            }
        }
        // At least one tap was accepted, or there would be no axis.
        let averages = averager
            .finish()
            .unwrap_or_else(|| AveragedSpectra::empty(self.lines));
        Ok((averages, kept))
    }

    /// A transform with its time zero at the trigger, `delay` (s) into the record: the slope that the
    /// quiet before it puts on the phase is no background that a fit of few lines could follow.
    fn timed_from_trigger(&self, mut transform: Vec<Complex64>, delay: f64) -> Vec<Complex64> {
        for (line, value) in transform.iter_mut().enumerate() {
            let turn = TAU * self.lines.frequency(line) * delay;
            *value *= Complex64::from_polar(1.0, turn);
        }
        transform
    }

    /// Peaks of the composite level over all sensors, read and labelled.
    fn readings(
        &self,
        averages: &AveragedSpectra,
        transforms: &[Vec<Complex64>],
        quiet: &Quiet,
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
            let gap = |force: &Vec<f64>| is_force_gap(force, &level, peak.index);
            if averages.force.as_ref().is_some_and(gap) {
                reading.label = Some(PeakLabel::ForceGap);
            }
            if let Some(label) =
                quiet.mains_label(peak.index, averages, window, &self.settings.mains)
            {
                *reading = as_mains(reading, self.lines.frequency(peak.index), label);
            }
        }
        readings
    }
}

/// The slowest of the decays that stand above their noise; of none, the slowest of all.
fn slowest_decay(checks: &[DecayCheck]) -> DecayCheck {
    let above = |check: &DecayCheck| check.remaining > check.noise;
    checks
        .iter()
        .copied()
        .max_by(|a, b| {
            above(a)
                .cmp(&above(b))
                .then(a.remaining.total_cmp(&b.remaining))
        })
        .unwrap_or(DecayCheck::NOTHING)
}

/// Bound on what is kept of all taps for readings without a hammer and for fits (values of 8 or 16 bytes
/// each). Taps beyond it are left out of them.
pub(super) const MOST_KEPT: usize = 1 << 24;

/// Whether a peak stands over a gap of the force's spectrum: a hammer has none just where the structure
/// resonates, so the quotient's peak is the force's doing. The force on the peak is compared with that
/// on its flanks, where the level has fallen by 6 dB.
fn is_force_gap(force: &[f64], level: &CompositeLevel, peak: usize) -> bool {
    let foot = level.level_db[peak] - 6.0;
    let fallen = |line: &usize| level.level_db.get(*line).is_some_and(|&l| l < foot);
    let left = (0..peak)
        .rev()
        .find(fallen)
        .and_then(|line| force.get(line));
    let right = (peak..level.level_db.len())
        .find(fallen)
        .and_then(|line| force.get(line));
    // A gap is lower than either flank; a force that merely falls off is lower than one.
    match (left, right) {
        (Some(&left), Some(&right)) => force[peak] < 0.6 * left.min(right),
        _ => false,
    }
}

/// A mains line keeps its line reading and loses what only a resonance has.
fn as_mains(reading: &ModeReading, line_frequency: f64, label: PeakLabel) -> ModeReading {
    let mut reading = ModeReading {
        line_frequency,
        interpolated: None,
        bound: None,
        damping_ratio: None,
        damping_std: None,
        label: Some(label),
        ..reading.clone()
    };
    reading.prefer(ReadBy::Line);
    reading
}
