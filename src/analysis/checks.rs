//! Checks of good practice: the evidence of each recording and the verdicts.

use super::frf::form_of;
use super::measurement::MeasuredSpectra;
use super::recording_result::RecordingResult;
use super::warnings::{Warning, of_quality};
use std::f64::consts::TAU;
use tapjoint_numerics::stats::median;
use tapjoint_signal::modal::ModeReading;
use tapjoint_signal::quality::{
    DampingSource, ForceEvidence, QualityVerdict, RecordingEvidence, ResonanceEvidence,
    SensorEvidence, TapEvidence, judge_test,
};
use tapjoint_signal::recording::Format;

/// The verdicts on all recordings of a test, and the warnings that follow from them.
pub(super) fn judge(recordings: &[RecordingResult]) -> (Vec<QualityVerdict>, Vec<Warning>) {
    let evidence: Vec<RecordingEvidence> = recordings.iter().filter_map(evidence).collect();
    let verdicts = judge_test(&evidence);
    let warnings = of_quality(&verdicts);
    (verdicts, warnings)
}

/// `None` for a recording without spectra: what is wrong with it its taps say; and for functions from
/// a file, of whose taps nothing is known.
fn evidence(recording: &RecordingResult) -> Option<RecordingEvidence> {
    let spectra = recording.measurement.spectra.as_ref()?;
    if recording.format == Format::FrequencyResponses {
        return None;
    }
    let averages = &spectra.averages;
    let force = averages.force.as_ref().map(|spectrum| ForceEvidence {
        spectrum: spectrum.clone(),
        noise: spectra.force_noise.clone(),
    });
    let resonances = spectra
        .readings
        .iter()
        .enumerate()
        .filter(|(_, reading)| reading.label.is_none())
        .map(|(index, reading)| resonance(reading, spectra, is_mode(recording, index)))
        .collect();
    let masses = recording.conditions.masses.iter();
    let fastened = masses.map(|mass| (mass.position, mass.mass));
    Some(RecordingEvidence {
        file: recording.file.clone(),
        tap_position: recording.conditions.tap,
        free_length: recording.conditions.free_length,
        fastened: fastened.collect(),
        taps: recording
            .measurement
            .taps
            .taps
            .iter()
            .map(TapEvidence::from)
            .collect(),
        lines: averages.lines,
        force,
        sensors: sensors(recording, spectra),
        resonances,
        decay: spectra.decay,
        window: spectra.window,
    })
}

/// Returns true if a reading is a mode: it has a number, or no reading has one.
fn is_mode(recording: &RecordingResult, index: usize) -> bool {
    let numbers = &recording.mode_numbers;
    let own = numbers.get(index).copied().flatten();
    own.is_some() || numbers.iter().all(Option::is_none)
}

fn sensors(recording: &RecordingResult, spectra: &MeasuredSpectra) -> Vec<SensorEvidence> {
    let averages = &spectra.averages;
    let positions = &recording.conditions.sensor_positions;
    let functions = averages.h1.as_deref().unwrap_or_default();
    let mut sensors = Vec::with_capacity(recording.responses.len());
    for (index, response) in recording.responses.iter().enumerate() {
        let coherence = averages.coherence(index);
        sensors.push(SensorEvidence {
            name: response.name.clone(),
            position: positions.get(&response.name).copied(),
            form: form_of(response, recording.tap_unit.as_deref()),
            frf: functions.get(index).cloned(),
            coherence: coherence.map(|lines| lines.iter().map(|c| c.unwrap_or(0.0)).collect()),
        });
    }
    sensors
}

/// The window widens every resonance of the spectra, also where the damping was fitted without it.
fn resonance(reading: &ModeReading, spectra: &MeasuredSpectra, is_mode: bool) -> ResonanceEvidence {
    let added = spectra.window.added_decay() / (TAU * reading.frequency);
    let taps = reading
        .fit
        .as_deref()
        .map_or(&[][..], |fit| fit.mode.taps.as_slice());
    let mut stds: Vec<f64> = taps.iter().map(|tap| tap.frequency_std).collect();
    ResonanceEvidence {
        frequency: reading.frequency,
        is_mode,
        std: reading.std,
        apparent_damping_ratio: reading.damping_ratio.map(|own| own + added),
        damping_from: match reading.fit {
            Some(_) => DampingSource::Decays,
            None => DampingSource::Spectra,
        },
        tap_frequencies: taps.iter().map(|tap| tap.frequency).collect(),
        tap_std: (!stds.is_empty()).then(|| median(&mut stds)),
    }
}
