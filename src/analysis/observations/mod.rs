//! What a finished analysis observed, for a diagnosis: one configuration for each recording and tap
//! level.
//!
//! ```text
//! readings, numbered -> taps of one level -> frequency, damping   (repeats)
//!                                         -> covariance of frequencies  (covariance)
//!                                         -> shape, amplitude, change along the decay  (mode)
//! ```

mod covariance;
mod force_noise;
mod mode;
mod repeats;

use super::analysis::{Analysis, ModeResult, RecordingResult};
use super::modes::looked_at;
use mode::ModeSeen;
use tapjoint_description::SensorKind;
use tapjoint_identify::observation::{
    Configuration, ExtraPeak, Observations, Observed, ObservedMode, ObservedSensor, ShapeValue,
    UNPAIRED,
};
use tapjoint_numerics::stats::median;
use tapjoint_signal::modal::{ModeReading, PeakLabel};
use tapjoint_signal::recording::Format;

/// Taps of one recording are of two levels where their peak forces, in order, leave a gap of more than
/// this factor: hands tap within 30 % of what they mean to.
const LEVEL_GAP: f64 = 2.0;

/// Relative uncertainty that the frequencies of a recording share and its repetitions cannot show: a
/// steel beam's fall by 1.5e-4 per kelvin, and a tenth of a kelvin goes unnoticed. Sample clocks (some
/// 5e-5) are the same in all recordings, and no part of it.
const COMMON: f64 = 1.5e-5;

/// A reading's shape at the sensors of its recording, over all taps, and its modal constant (1/kg) at the
/// strongest sensor.
pub(super) fn shape_of(
    reading: &ModeReading,
    recording: &RecordingResult,
) -> (Vec<ShapeValue>, Option<Observed>) {
    let taps: Vec<usize> = (0..recording.measurement.taps.accepted().count()).collect();
    ModeSeen::new(0, reading, (recording, &taps, true)).shape_and_constant()
}

/// What the test observed; empty for a bare recording, whose peaks have no numbers of a model.
pub fn observations(analysis: &Analysis) -> Observations {
    let mut configurations: Vec<Configuration> = if analysis.structure.is_none() {
        Vec::new()
    } else if analysis.recordings.is_empty() {
        vec![of_measured(&analysis.modes)]
    } else {
        let recordings = analysis.recordings.iter().enumerate();
        recordings.flat_map(|(i, r)| of_recording(i, r)).collect()
    };
    let forces = configurations.iter().filter_map(|c| c.peak_force);
    let hardest = forces.fold(0.0, f64::max);
    for configuration in &mut configurations {
        configuration.level = configuration
            .peak_force
            .filter(|_| hardest > 0.0)
            .map(|force| force / hardest);
    }
    Observations { configurations }
}

/// Frequencies read elsewhere: independent of each other, with the uncertainty that was stated.
fn of_measured(modes: &[ModeResult]) -> Configuration {
    let mode = |mode: &ModeResult| {
        Some(ObservedMode::read_elsewhere(
            mode.mode?,
            mode.frequency,
            mode.std,
        ))
    };
    let mut modes: Vec<ObservedMode> = modes.iter().filter_map(mode).collect();
    modes.sort_by_key(|mode| mode.mode);
    Configuration {
        file: None,
        recording: None,
        sensors: Vec::new(),
        masses: Vec::new(),
        tap: None,
        peak_force: None,
        level: None,
        taps: 0,
        decay_seconds: None,
        band: None,
        covariance: covariance::independent(&modes),
        modes,
        // What was stated is meant to be all.
        common: 0.0,
        extra_peaks: Vec::new(),
    }
}

/// The configurations of one recording, one for each tap level, the hardest first.
fn of_recording(index: usize, recording: &RecordingResult) -> Vec<Configuration> {
    let Some(spectra) = &recording.measurement.spectra else {
        return Vec::new();
    };
    let peaks: Vec<f64> = recording
        .measurement
        .taps
        .accepted()
        .map(|tap| tap.peak)
        .collect();
    let levels = levels(&peaks, recording.has_hammer);
    let numbered = spectra.readings.iter().zip(&recording.mode_numbers);
    let mut numbered: Vec<(usize, &ModeReading)> = numbered
        .filter_map(|(reading, number)| Some(((*number)?, reading)))
        .collect();
    numbered.sort_by_key(|(number, _)| *number);
    let only = levels.len() == 1;
    let configuration = |(place, taps): (usize, &Vec<usize>)| {
        let mut seen: Vec<ModeSeen> = numbered
            .iter()
            .map(|&(number, reading)| ModeSeen::new(number, reading, (recording, taps, only)))
            .collect();
        // What was not fitted tap by tap says the same at every level.
        seen.retain(|seen| place == 0 || seen.is_of_taps());
        repeats::judge_scatter(&mut seen);
        Configuration {
            file: Some(recording.file.clone()),
            recording: Some(index),
            sensors: sensors(recording),
            masses: recording.conditions.masses.clone(),
            tap: recording.conditions.tap,
            peak_force: peak_force(recording, &peaks, taps),
            level: None,
            taps: match recording.format {
                Format::FrequencyResponses => 0,
                _ => taps.len(),
            },
            decay_seconds: Some(spectra.averages.lines.duration)
                .filter(|_| recording.format != Format::FrequencyResponses),
            band: looked_at(recording),
            covariance: covariance::of_taps(&seen),
            // Changes along the decays belong to all taps; they stand with the hardest.
            modes: seen.iter().map(|seen| seen.observed(place == 0)).collect(),
            common: COMMON,
            extra_peaks: extra_peaks(recording, &spectra.readings),
        }
    };
    levels.iter().enumerate().map(configuration).collect()
}

/// Places of the taps of each level, the hardest level first; without a hammer all are one.
fn levels(peaks: &[f64], has_hammer: bool) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..peaks.len()).collect();
    if !has_hammer || order.is_empty() {
        return vec![order];
    }
    order.sort_by(|&a, &b| peaks[b].total_cmp(&peaks[a]));
    let mut levels: Vec<Vec<usize>> = Vec::new();
    for tap in order {
        match levels.last_mut() {
            Some(level)
                if level
                    .last()
                    .is_some_and(|&last| peaks[last] < LEVEL_GAP * peaks[tap]) =>
            {
                level.push(tap);
            }
            _ => levels.push(vec![tap]),
        }
    }
    levels
}

fn peak_force(recording: &RecordingResult, peaks: &[f64], taps: &[usize]) -> Option<f64> {
    let mut forces: Vec<f64> = taps
        .iter()
        .filter_map(|&tap| peaks.get(tap).copied())
        .collect();
    (recording.has_hammer && !forces.is_empty()).then(|| median(&mut forces))
}

fn sensors(recording: &RecordingResult) -> Vec<ObservedSensor> {
    let positions = &recording.conditions.sensor_positions;
    let sensor = |response: &super::analysis::Response| ObservedSensor {
        name: response.name.clone(),
        position: positions
            .get(&response.name)
            .copied()
            .filter(|_| response.kind != Some(SensorKind::Sound)),
    };
    recording.responses.iter().map(sensor).collect()
}

/// Resonances without a number, and mains lines. What is no resonance at all is left out.
fn extra_peaks(recording: &RecordingResult, readings: &[ModeReading]) -> Vec<ExtraPeak> {
    let peak = |(reading, number): (&ModeReading, &Option<usize>)| {
        let label = match (number, reading.label) {
            (Some(_), _) | (_, Some(PeakLabel::NoResonance | PeakLabel::ForceGap)) => return None,
            (None, Some(label)) => label.to_string(),
            (None, None) => UNPAIRED.to_owned(),
        };
        Some(ExtraPeak {
            frequency: reading.frequency,
            std: reading.std,
            level_db: reading.above_noise_db.or(reading.prominence_db),
            constant: shape_of(reading, recording).1.map(|one| one.value),
            label,
        })
    };
    readings
        .iter()
        .zip(&recording.mode_numbers)
        .filter_map(peak)
        .collect()
}
