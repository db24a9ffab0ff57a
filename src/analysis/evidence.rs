//! What the checks of good practice look at, from finished recordings, and what a reader is told of it.

use std::f64::consts::TAU;

use super::analysis::RecordingResult;
use super::frf::form_of;
use super::measure::MeasuredSpectra;
use super::warning::{Warning, of_quality};
use tapjoint_numerics::stats::median;
use tapjoint_signal::modal::ModeReading;
use tapjoint_signal::quality::{
    DampingSource, ForceEvidence, QualitySettings, RecordingEvidence, ResonanceEvidence,
    SensorEvidence, TapEvidence, Verdict, judge_test,
};
use tapjoint_signal::recording::Format;

/// The verdicts on all recordings of a test, and the warnings that follow from them.
pub(super) fn judge(recordings: &[RecordingResult]) -> (Vec<Verdict>, Vec<Warning>) {
    let evidence: Vec<RecordingEvidence> = recordings.iter().filter_map(evidence).collect();
    let verdicts = judge_test(&evidence, &QualitySettings::default());
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
        .map(|(index, reading)| ResonanceEvidence {
            is_mode: is_mode(recording, index),
            ..resonance(reading, spectra)
        })
        .collect();
    let masses = recording.conditions.masses.iter();
    let fastened = masses.map(|mass| (mass.position, mass.mass));
    Some(RecordingEvidence {
        file: recording.file.clone(),
        tap_position: recording.conditions.tap,
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

/// Whether a reading is a mode: it has a number, or none has.
fn is_mode(recording: &RecordingResult, index: usize) -> bool {
    let numbers = &recording.mode_numbers;
    let own = numbers.get(index).copied().flatten();
    own.is_some() || numbers.iter().all(Option::is_none)
}

fn sensors(recording: &RecordingResult, spectra: &MeasuredSpectra) -> Vec<SensorEvidence> {
    let averages = &spectra.averages;
    let force_unit = recording.tap_unit.as_deref();
    let sensor = |(index, response): (usize, &super::analysis::Response)| SensorEvidence {
        name: response.name.clone(),
        position: recording
            .conditions
            .sensor_positions
            .get(&response.name)
            .copied(),
        form: form_of(response, force_unit),
        frf: averages
            .h1
            .as_ref()
            .and_then(|functions| functions.get(index).cloned()),
        coherence: averages.coherence(index).map(|values| {
            let of = |value: Option<f64>| value.unwrap_or(0.0);
            values.into_iter().map(of).collect()
        }),
    };
    recording.responses.iter().enumerate().map(sensor).collect()
}

/// The window widens every resonance of the spectra, also where the damping was fitted without it.
fn resonance(reading: &ModeReading, spectra: &MeasuredSpectra) -> ResonanceEvidence {
    let added = spectra.window.added_decay() / (TAU * reading.frequency);
    let taps = reading
        .fit
        .as_deref()
        .map_or(&[][..], |fit| fit.mode.taps.as_slice());
    let mut stds: Vec<f64> = taps.iter().map(|tap| tap.frequency_std).collect();
    ResonanceEvidence {
        frequency: reading.frequency,
        is_mode: true,
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
