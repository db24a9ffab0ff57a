//! What a finished analysis observed, and the diagnosis of it. There is one configuration for each recording and tap
//! level.
//! level.
//!
//! ```text
//! readings, numbered -> taps of one level -> frequency, damping   (repeats)
//!                                         -> covariance of frequencies  (covariance)
//!                                         -> shape, amplitude, change along the decay  (mode)
//! ```
//!
//! diagnosis.

use super::analysis::{Analysis, ModeResult, RecordingResult};
use super::modes::looked_at;
use super::observed_mode::{ModeSeen, shape_of};
use tapjoint_beam::JointStiffness;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::specimen::Joint;
use tapjoint_description::described::{coupling, described_beam, described_specimen, stiffness_of};
use tapjoint_description::{JointKind, JointModel, KnownStiffness, SensorKind, TestDescription};
use tapjoint_diagnosis::{Diagnosis, GapError, GapSettings, Nominal, NominalSensor, diagnose};
use tapjoint_identify::observation::{
    Configuration, ExtraPeak, Observations, ObservedMode, ObservedSensor, UNPAIRED,
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
        covariance: super::observed_mode::independent(&modes),
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
        super::observed_mode::judge_scatter(&mut seen);
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
            covariance: super::observed_mode::of_taps(&seen),
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

/// What each of length, thickness, modulus and density adds to the uncertainty of all frequencies where
/// its own is not stated (1): all four together 0.2 %, as [`GapSettings::scale_std`].
const USUAL_SHARE: f64 = 0.001;

/// Where the search for the joint begins if the frequencies gave no estimate: Kx and Ky (1) of the
/// bolted cantilever of Ingole & Chatterjee.
const USUAL_JOINT: [f64; 2] = [1400.0, 4.8];
/// Stiffnesses beyond this (1) hold a beam like a wall; a search that begins further out does not move.
const STIFFEST_START: f64 = 1e5;
/// Where a usual stiffness would make the coupling with the described Ktr stronger than a joint can have, the
/// search begins here (1): the end of what the diagnosis searches.
const STRONGEST_START: f64 = 0.95;

/// Diagnoses the gap of an analysed test.
///
/// # Errors
/// [`GapError`]: why these data say nothing about a gap.
pub fn diagnose_test(
    test: &TestDescription,
    analysis: &Analysis,
    settings: &GapSettings,
) -> Result<Diagnosis, GapError> {
    diagnose(&observations(analysis), &nominal(test, analysis), settings)
}

/// The structure as described, with the joint as estimated: where the diagnosis begins.
pub fn nominal(test: &TestDescription, analysis: &Analysis) -> Nominal {
    let found = analysis.identification.as_ref();
    let estimate = found.and_then(|found| found.consistent.as_ref());
    // The estimate's stiffnesses are in units of the beam that was estimated with them.
    let joint_before = estimate.map(|estimate| {
        let units = StiffnessUnits::of(&estimate.beam);
        [estimate.joint.kx * units.kt, estimate.joint.ky * units.kr]
    });
    Nominal {
        joint_before: joint_before.filter(|joint| joint.iter().all(|k| *k > 0.0 && k.is_finite())),
        ..nominal_with(test, estimate.map(|estimate| estimate.joint))
    }
}

/// The structure as described; what is not described of its joint is `found`, else usual.
pub fn nominal_with(test: &TestDescription, found: Option<JointStiffness>) -> Nominal {
    // A microphone is not on the beam: what it weighs is no matter.
    let sensors = test.sensors.iter().map(|sensor| match sensor.kind {
        SensorKind::Sound => NominalSensor {
            name: sensor.name.clone(),
            mass: Some(0.0),
            position: None,
        },
        _ => NominalSensor {
            name: sensor.name.clone(),
            mass: sensor.mass.filter(|_| test.analysis.sensor_mass),
            position: sensor.position,
        },
    });
    Nominal {
        specimen: described_specimen(test, joint(test, found)),
        sensors: sensors.collect(),
        joint_before: None,
        scale_std: scale_std(test),
        reading_bias: reading_bias(test),
    }
}

/// Where the search for the joint begins: known stiffnesses, else those found, else usual ones; and the
/// coupling, where the joint's model has one.
fn joint(test: &TestDescription, found: Option<JointStiffness>) -> Option<Joint> {
    if test.joint.kind == JointKind::Free {
        return None;
    }
    let units = StiffnessUnits::of(&described_beam(test));
    let start = |known: Option<KnownStiffness>, found: Option<f64>, (usual, unit): (f64, f64)| {
        let begin = found.filter(|k| *k > 0.0).unwrap_or(usual);
        known.map_or(unit * begin.min(STIFFEST_START), stiffness_of)
    };
    let [kx, ky] = USUAL_JOINT;
    let model = test.joint.model;
    let kt = start(test.joint.kt, found.map(|joint| joint.kx), (kx, units.kt));
    let kr = start(test.joint.kr, found.map(|joint| joint.ky), (ky, units.kr));
    let described = test.joint.ktr.map(stiffness_of);
    let coupling = match (model, found, described) {
        (JointModel::ThreeParameter, Some(joint), _) => joint.coupling(),
        (JointModel::ThreeParameter, None, Some(ktr)) => {
            let begin = coupling(kt, kr, 1.0 / ktr);
            match (test.joint.kt, test.joint.kr) {
                (Some(_), Some(_)) => begin,
                _ => begin.clamp(-STRONGEST_START, STRONGEST_START),
            }
        }
        _ => 0.0,
    };
    Some(Joint { kt, kr, coupling })
}

/// f is proportional to h/L^2 sqrt(E/rho): the relative uncertainties that the description states, with
/// these exponents, and a usual one of what it does not state. `None` where it states none of them.
fn scale_std(test: &TestDescription) -> Option<f64> {
    let (beam, tolerance) = (&test.beam, &test.beam.tolerance);
    let shares = [
        (tolerance.length, beam.length, 2.0),
        (tolerance.thickness, beam.thickness, 1.0),
        (tolerance.modulus, beam.modulus, 0.5),
        (tolerance.density, beam.density, 0.5),
    ];
    let square = |(std, value, power): &(Option<f64>, f64, f64)| {
        std.map_or(USUAL_SHARE, |std| power * std / value).powi(2)
    };
    let stated = shares.iter().any(|(std, ..)| std.is_some());
    stated.then(|| shares.iter().map(square).sum::<f64>().sqrt())
}

/// Frequencies read elsewhere may be off by half a line, all in one direction.
fn reading_bias(test: &TestDescription) -> Option<f64> {
    let largest = |values: &Vec<f64>| values.iter().copied().fold(0.0, f64::max);
    let measured = test.measured.as_ref()?;
    measured.half_line.as_ref().map(largest)
}
