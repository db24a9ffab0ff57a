//! The observations of a finished analysis, and the diagnosis of them. There is one configuration for each recording and
//! tap level.
//!
//! ```text
//! readings, numbered -> taps of one level -> frequency, damping, shape, amplitude, change along the decay
//!                                         -> covariance of the frequencies
//! ```

use super::Analysis;
use super::observed_mode::{ModeSeen, SeenTaps, independent, judge_scatter, of_taps, shape_of};
use super::recording_result::RecordingResult;
use super::structure::structure_details;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::specimen::{Joint, Mesh};
use tapjoint_beam::{Beam, JointStiffness};
use tapjoint_description::{Assembly, JointModel, SensorKind, TestDescription};
use tapjoint_description::{coupling, described_beam, described_specimen};
use tapjoint_diagnosis::{
    DescriptionUncertainty, Diagnosis, GapError, GapSettings, Nominal, NominalSensor, Proposal,
    diagnose,
};
use tapjoint_identify::consistent::{
    BeamTolerances, ConsistentEstimate, LEAST_DISCREPANCY, MovedClamp, Parameter,
};
use tapjoint_identify::observation::{
    Configuration, ExtraPeak, Observations, Observed, ObservedMode, ObservedSensor, UNPAIRED,
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

/// Returns the observations of a test; none for a bare recording, whose peaks have no numbers of a model.
pub fn observations(analysis: &Analysis) -> Observations {
    let mut configurations = Vec::new();
    // What does not belong to the other modes explains nothing that they share.
    let found = analysis.identification.as_ref();
    let left_out = found.and_then(|found| Some(found.left_out.as_ref()?.found.mode));
    if analysis.structure.is_some() && analysis.recordings.is_empty() {
        let modes = analysis.modes.iter();
        let modes = modes.filter(|mode| mode.mode != left_out);
        let modes = modes.filter_map(|mode| {
            Some(ObservedMode::read_elsewhere(
                mode.mode?,
                mode.frequency,
                mode.std,
            ))
        });
        configurations.push(read_elsewhere(modes.collect()));
    } else if analysis.structure.is_some() {
        // The model of the diagnosis is the beam of one length.
        let recordings = analysis.recordings.iter().enumerate();
        let described = recordings.filter(|(_, one)| one.conditions.free_length.is_none());
        for (index, recording) in described {
            configurations.extend(of_recording(index, recording, left_out));
        }
    }
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

/// The configuration of frequencies read elsewhere: independent of each other, with the uncertainty that was stated.
pub fn read_elsewhere(mut modes: Vec<ObservedMode>) -> Configuration {
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
        covariance: independent(&modes),
        modes,
        // A stated uncertainty includes the common part.
        common: 0.0,
        extra_peaks: Vec::new(),
    }
}

/// The configurations of one recording, one for each tap level, the hardest first.
fn of_recording(
    index: usize,
    recording: &RecordingResult,
    left_out: Option<usize>,
) -> Vec<Configuration> {
    let Some(spectra) = &recording.measurement.spectra else {
        return Vec::new();
    };
    let peaks = recording.tap_peaks();
    let has_forces = recording.has_tap_forces();
    let levels = levels(&peaks, has_forces);
    let numbered = spectra.readings.iter().zip(&recording.mode_numbers);
    let mut numbered: Vec<(usize, &ModeReading)> = numbered
        .filter(|(_, number)| **number != left_out)
        .filter_map(|(reading, number)| Some(((*number)?, reading)))
        .collect();
    numbered.sort_by_key(|(number, _)| *number);
    let of_file = recording.format == Format::FrequencyResponses;
    let mut configurations = Vec::with_capacity(levels.len());
    for (place, taps) in levels.iter().enumerate() {
        let seen_taps = SeenTaps {
            recording,
            taps,
            all: levels.len() == 1,
        };
        let mut seen: Vec<ModeSeen> = numbered
            .iter()
            .map(|&(number, reading)| ModeSeen::new(number, reading, seen_taps))
            .collect();
        // A reading that was not fitted tap by tap is the same at every level.
        seen.retain(|seen| place == 0 || seen.is_of_taps());
        judge_scatter(&mut seen);
        let forces = taps.iter().filter_map(|&tap| peaks.get(tap).copied());
        let mut forces: Vec<f64> = forces.filter(|_| has_forces).collect();
        configurations.push(Configuration {
            file: Some(recording.file.clone()),
            recording: Some(index),
            sensors: sensors(recording),
            masses: recording.conditions.masses.clone(),
            tap: recording.conditions.tap,
            peak_force: (!forces.is_empty()).then(|| median(&mut forces)),
            level: None,
            taps: if of_file { 0 } else { taps.len() },
            decay_seconds: (!of_file).then_some(spectra.averages.lines.duration),
            band: recording.looked_at(),
            covariance: of_taps(&seen),
            // Changes along the decays belong to all taps; they stand with the hardest.
            modes: seen.iter().map(|seen| seen.observed(place == 0)).collect(),
            common: COMMON,
            extra_peaks: extra_peaks(recording),
        });
    }
    configurations
}

/// Places of the taps of each level, the hardest level first; where forces are not known all are one.
fn levels(peaks: &[f64], has_forces: bool) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..peaks.len()).collect();
    if !has_forces || order.is_empty() {
        return vec![order];
    }
    order.sort_by(|&a, &b| peaks[b].total_cmp(&peaks[a]));
    let mut levels: Vec<Vec<usize>> = Vec::new();
    for tap in order {
        let level = levels.last_mut().filter(|level| {
            let last = level.last();
            last.is_some_and(|&last| peaks[last] < LEVEL_GAP * peaks[tap])
        });
        match level {
            Some(level) => level.push(tap),
            None => levels.push(vec![tap]),
        }
    }
    levels
}

fn sensors(recording: &RecordingResult) -> Vec<ObservedSensor> {
    let positions = &recording.conditions.sensor_positions;
    let mut sensors = Vec::with_capacity(recording.responses.len());
    for response in &recording.responses {
        let position = positions.get(&response.name).copied();
        sensors.push(ObservedSensor {
            name: response.name.clone(),
            position: position.filter(|_| response.kind != Some(SensorKind::Sound)),
        });
    }
    sensors
}

/// Resonances without a number, and mains lines. Peaks that are no resonance are left out.
fn extra_peaks(recording: &RecordingResult) -> Vec<ExtraPeak> {
    let mut peaks = Vec::new();
    let numbered = recording.readings().iter().zip(&recording.mode_numbers);
    for (reading, _) in numbered.filter(|(_, number)| number.is_none()) {
        let label = match reading.label {
            Some(
                PeakLabel::NoResonance
                | PeakLabel::Weak
                | PeakLabel::ForceGap
                | PeakLabel::Combination(_),
            ) => continue,
            Some(label) => label.to_string(),
            None => UNPAIRED.to_owned(),
        };
        peaks.push(ExtraPeak {
            frequency: reading.frequency,
            std: reading.std,
            level_db: reading.above_noise_db.or(reading.prominence_db),
            constant: shape_of(reading, recording).1.map(|one| one.value),
            label,
        });
    }
    peaks
}

/// Start of the search for the joint if the frequencies gave no estimate: Kx and Ky (1) of the
/// bolted cantilever of Ingole & Chatterjee.
const USUAL_JOINT: [f64; 2] = [1400.0, 4.8];
/// Stiffnesses beyond this (1) hold a beam like a wall; a search that begins further out does not move.
const STIFFEST_START: f64 = 1e5;
/// Start of the coupling (1) where a usual stiffness with the described Ktr would make it stronger than a joint can
/// have: the end of the range that the diagnosis searches.
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
    let mut found = diagnose(&observations(analysis), &nominal(test, analysis), settings)?;
    // What has been done is no next test.
    if test.beam.free.is_some() || test.beam.free_test.is_some() {
        let next = &mut found.next_tests;
        next.retain(|next| next.proposal != Proposal::BareBeam);
    }
    Ok(found)
}

/// The structure as described, with the joint as estimated: where the diagnosis begins.
pub fn nominal(test: &TestDescription, analysis: &Analysis) -> Nominal {
    let found = analysis.identification.as_ref();
    let estimate = found.and_then(|found| found.consistent.as_ref());
    // The estimate's stiffnesses are in units of the beam that was estimated with them.
    let joint_before = estimate.map(|estimate| {
        let joint = estimate.joint.in_si(&estimate.beam);
        [joint.kt, joint.kr]
    });
    let mut nominal = Nominal {
        joint_before: joint_before.filter(|joint| joint.iter().all(|k| *k > 0.0 && k.is_finite())),
        ..nominal_with(test, estimate.map(|estimate| estimate.joint))
    };
    if let Some(free) = &analysis.free_test {
        let known = &mut nominal.uncertainty;
        known.free_scale = free_scale(&free.bar, &known.beam);
    }
    if let Some(estimate) = estimate {
        take_estimated_properties(&mut nominal, estimate);
    }
    nominal
}

/// Spread of a property that is estimated (1): it has no prior, and what the description says of it is a guess.
const ESTIMATED: f64 = 0.3;

/// Takes the modulus or the density from the estimate, where that estimates it.
fn take_estimated_properties(nominal: &mut Nominal, estimate: &ConsistentEstimate) {
    let described = nominal.specimen.body.beams()[0];
    for parameter in &estimate.fit {
        let tolerances = &mut nominal.uncertainty.beam;
        let beams = nominal.specimen.body.beams_mut().iter_mut();
        match parameter {
            Parameter::Modulus => {
                tolerances.modulus = Some(ESTIMATED);
                let factor = estimate.beam.modulus / described.modulus;
                beams.for_each(|beam| beam.modulus *= factor);
            }
            Parameter::Density => {
                tolerances.density = Some(ESTIMATED);
                let factor = estimate.beam.density / described.density;
                beams.for_each(|beam| beam.density *= factor);
            }
            _ => {}
        }
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
        uncertainty: uncertainty(test),
        reading_bias: reading_bias(test),
    }
}

/// Start of the search for the joint: known stiffnesses, else those found, else usual ones; and the
/// coupling, where the joint's model has one.
fn joint(test: &TestDescription, found: Option<JointStiffness>) -> Option<Joint> {
    if test.joint.kind == Assembly::Free {
        return None;
    }
    let units = StiffnessUnits::of(&described_beam(test));
    let [kx, ky] = USUAL_JOINT;
    let kx = found.map_or(kx, |joint| if joint.kx > 0.0 { joint.kx } else { kx });
    let ky = found.map_or(ky, |joint| if joint.ky > 0.0 { joint.ky } else { ky });
    let model = test.joint.model;
    let kt = test.joint.kt.unwrap_or(units.kt * kx.min(STIFFEST_START));
    let kr = test.joint.kr.unwrap_or(units.kr * ky.min(STIFFEST_START));
    let coupling = match (model, found, test.joint.ktr) {
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

/// How well the structure is described: as the estimate of the joint takes it.
fn uncertainty(test: &TestDescription) -> DescriptionUncertainty {
    let tolerance = &test.beam.tolerance;
    let beam = described_beam(test);
    let details = structure_details(test, &beam);
    let halves = described_specimen(test, None);
    let weighed = details.weighed.map(|weighed| {
        // That of both halves of a lap joint.
        let beams = halves.body.beams().iter();
        let described = beams.map(Beam::mass).sum::<f64>() * weighed.length / beam.length;
        Observed {
            value: (weighed.mass / described).ln(),
            std: weighed.std / weighed.mass,
            freedom: None,
        }
    });
    DescriptionUncertainty {
        beam: details.tolerances,
        masses: tolerance.masses.std,
        positions: tolerance.positions.std,
        weighed,
        free_scale: details
            .free
            .as_ref()
            .and_then(|free| free_scale(free, &details.tolerances)),
    }
}

/// Returns the mean of the free bar's frequencies over the described ones (logarithm); `None` where the bar has none.
fn free_scale(free: &MovedClamp, tolerances: &BeamTolerances) -> Option<Observed> {
    let count = free.modes.iter().map(|mode| mode.mode).max()?;
    let specimen = free.structure.specimen(None);
    let predicted = specimen.modes(count, Mesh::DIAGNOSIS).ok()?;
    let (mut weights, mut sum) = (0.0, 0.0);
    for mode in &free.modes {
        let predicted = predicted.frequencies()[mode.mode - 1];
        let reading = mode.std.unwrap_or(0.0) / mode.frequency;
        let weight = (reading * reading + LEAST_DISCREPANCY * LEAST_DISCREPANCY).recip();
        weights += weight;
        sum += weight * (mode.frequency / predicted).ln();
    }
    // f is proportional to L^-2, and the length of the bar is known as well as that of the beam.
    let of_length = 2.0 * tolerances.length.unwrap_or(0.0);
    Some(Observed {
        value: sum / weights,
        std: weights.sqrt().recip().hypot(of_length),
        freedom: None,
    })
}

/// Frequencies read elsewhere may be off by half a line, all in one direction.
fn reading_bias(test: &TestDescription) -> Option<f64> {
    let half_lines = test.measured.as_ref()?.half_line.as_ref()?;
    Some(half_lines.iter().copied().fold(0.0, f64::max))
}
