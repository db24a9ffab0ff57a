//! Readings of one virtual recording: each mode on the line, between the lines and by a fit.

use super::plan::{BandPlan, Layout};
use super::virtual_test::{Truth, VirtualRecord};
use num_complex::Complex64;
use tapjoint_signal::modal::fit::{FitSettings, FreeDecayCollector, PoleStart, fit_modes};
use tapjoint_signal::modal::{
    CompositeLevel, FittedReading, ModeReading, PeakSettings, ReadBy, find_peaks, read_peaks,
};
use tapjoint_signal::spectral::{
    AveragedSpectra, Lines, SpectralAverager, Window, largest_smooth_block,
};

/// Fewest samples of a decay that is worth a fit.
const LEAST_SAMPLES: usize = 64;

/// One frequency as read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Read {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Its stated standard uncertainty (Hz).
    pub std: f64,
    /// How it was read: as wanted, or the next best way.
    pub source: ReadBy,
}

/// Readings of every mode of the study, in the order of [`ReadBy::ALL`]; none where a mode is not in the band.
pub(super) type BandReadings = Vec<[Option<Read>; 3]>;

/// Index of a way of reading in [`ReadBy::ALL`].
pub(super) fn index_of(reading: ReadBy) -> usize {
    match reading {
        ReadBy::Line => 0,
        ReadBy::Interpolated => 1,
        ReadBy::Fit => 2,
    }
}

/// Reads every mode of a band in every wanted way.
pub(super) fn read_band(
    band: &BandPlan,
    window: Window,
    record: &VirtualRecord,
    layout: &Layout,
    truth: &Truth,
    wanted: &[ReadBy],
) -> BandReadings {
    let mut readings = peak_readings(band, window, record);
    let mut places = vec![None; layout.modes.len()];
    for &mode in &band.modes {
        let frequency = truth.frequencies[layout.modes[mode].number - 1];
        places[mode] = place_of(frequency, &readings, &band.lines);
    }
    if wanted.contains(&ReadBy::Fit) {
        fit(band, record, &mut readings, &places);
    }
    places
        .into_iter()
        .map(|place| {
            ReadBy::ALL.map(|name| {
                let reading = readings.get(place?).filter(|_| wanted.contains(&name))?;
                let mut reading = reading.clone();
                reading.select_estimate(name);
                Some(Read {
                    frequency: reading.frequency,
                    std: reading.std.unwrap_or(reading.half_line),
                    source: reading.source,
                })
            })
        })
        .collect()
}

/// Peaks of H1 over all sensors, read on their lines and between them.
fn peak_readings(band: &BandPlan, window: Window, record: &VirtualRecord) -> Vec<ModeReading> {
    let averages = averages(band, window, record);
    let Some(h1) = &averages.h1 else {
        return Vec::new();
    };
    let powers: Vec<Vec<f64>> = h1
        .iter()
        .map(|h| h.iter().map(Complex64::norm_sqr).collect())
        .collect();
    let noise = noise_powers(&averages, window, band.gate, record);
    let level = CompositeLevel::new(band.lines, &powers, Some(&noise));
    let peaks = find_peaks(&level, &PeakSettings::default());
    let spectra: Vec<&[Complex64]> = h1.iter().map(Vec::as_slice).collect();
    read_peaks(&level, &spectra, &peaks, window)
}

fn averages(band: &BandPlan, window: Window, record: &VirtualRecord) -> AveragedSpectra {
    let rate = record.sample_rate;
    let force = transformed(band, window, rate, &record.force, record.pulse_end);
    let responses: Vec<Vec<Complex64>> = record
        .responses
        .iter()
        .map(|x| transformed(band, window, rate, x, band.gate))
        .collect();
    let mut averager = SpectralAverager::new(band.lines, responses.len());
    averager.add(Some(&force), &responses);
    averager
        .finish()
        .unwrap_or_else(|| AveragedSpectra::empty(band.lines))
}

/// The spectrum of the samples up to `end` under the window.
fn transformed(
    band: &BandPlan,
    window: Window,
    sample_rate: f64,
    samples: &[f64],
    end: usize,
) -> Vec<Complex64> {
    let mut windowed = samples[..end.min(samples.len())].to_vec();
    // A Hann window is over the whole block, however much of it is zero.
    if window == Window::Hann {
        windowed.resize(band.gate, 0.0);
    }
    window.apply(&mut windowed, sample_rate);
    band.transformer.transform(&windowed)
}

/// The part of H1 that noise alone would leave. White noise of rms s has E|X|^2 = s^2 sum w^2/rate^2 under
/// a window w, which a quiet stretch before the tap would show.
fn noise_powers(
    averages: &AveragedSpectra,
    window: Window,
    gate: usize,
    record: &VirtualRecord,
) -> Vec<Vec<f64>> {
    let mut weights = vec![1.0; gate];
    window.apply(&mut weights, record.sample_rate);
    let energy: f64 = weights.iter().map(|w| w * w).sum();
    let force = averages.force_power.as_deref().unwrap_or_default();
    record
        .noise
        .iter()
        .map(|level| {
            let power = (level / record.sample_rate).powi(2) * energy;
            force
                .iter()
                .map(|f| power / f.max(f64::MIN_POSITIVE))
                .collect()
        })
        .collect()
}

/// Place of the reading of a mode: the nearest one within its line, a line more, or its half-power width.
fn place_of(frequency: f64, readings: &[ModeReading], lines: &Lines) -> Option<usize> {
    let mut nearest: Option<(usize, f64)> = None;
    for (place, reading) in readings.iter().enumerate() {
        let distance = (reading.line_frequency - frequency).abs();
        let width = reading.damping_ratio.unwrap_or(0.0) * frequency;
        let is_near = distance <= 3.0 * lines.half_line() + width;
        if is_near && nearest.is_none_or(|(_, least)| distance < least) {
            nearest = Some((place, distance));
        }
    }
    nearest.map(|(place, _)| place)
}

/// Fits the free decay from every resonance, and from whatever was read near a mode.
fn fit(
    band: &BandPlan,
    record: &VirtualRecord,
    readings: &mut [ModeReading],
    places: &[Option<usize>],
) {
    let chosen: Vec<usize> = (0..readings.len())
        .filter(|place| readings[*place].label.is_none() || places.contains(&Some(*place)))
        .collect();
    let starts: Vec<PoleStart> = chosen
        .iter()
        .map(|&place| PoleStart {
            frequency: readings[place].frequency,
            damping_ratio: readings[place].damping_ratio,
        })
        .collect();
    let Some(samples) = band
        .gate
        .checked_sub(record.pulse_end)
        .and_then(largest_smooth_block)
        .filter(|&samples| samples >= LEAST_SAMPLES)
    else {
        return;
    };
    let range = [(band.lines.low, band.lines.high)];
    let decays: Vec<Vec<f64>> = record
        .responses
        .iter()
        .map(|response| response[record.pulse_end..].to_vec())
        .collect();
    let decay = FreeDecayCollector::new(record.sample_rate, samples, &range).and_then(|mut all| {
        all.add_tap(&decays)?;
        all.finish()
    });
    let Ok(decay) = decay else {
        return;
    };
    let fits = fit_modes(&decay, &starts, &FitSettings::default());
    for (place, fit) in chosen.into_iter().zip(fits) {
        readings[place].fit = fit.ok().map(|mode| Box::new(FittedReading::new(mode)));
    }
}
