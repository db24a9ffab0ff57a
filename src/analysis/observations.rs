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
    DescriptionUncertainty, Diagnosis, GapError, GapSettings, Hypothesis, Nominal, NominalSensor,
    Proposal, Verdict, diagnose, reading_evidence,
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
    observations_without(analysis, None)
}

/// Returns the observations without one of the modes.
fn observations_without(analysis: &Analysis, left_out: Option<usize>) -> Observations {
    let mut configurations = Vec::new();
    if analysis.structure.is_some() && analysis.recordings.is_empty() {
        let modes = analysis.modes.iter();
        let modes = modes.filter(|mode| left_out.is_none() || mode.mode != left_out);
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
    let mut found = diagnose_modes(analysis, &nominal(test, analysis), settings)?;
    // What has been done is no next test.
    if test.beam.free.is_some() || test.beam.free_test.is_some() {
        let next = &mut found.next_tests;
        next.retain(|next| next.proposal != Proposal::BareBeam);
    }
    // The table of the uncertainty says what thickness and length alone would bring.
    if test.beam.weighed.is_some() {
        let next = &mut found.next_tests;
        next.retain(|next| next.proposal != Proposal::Calipers);
    }
    Ok(found)
}

/// Odds (logarithm) from which on one explanation excludes another: 20 to 1.
const EXCLUDED: f64 = 3.0;

/// Diagnoses all modes, or without the one that the estimate leaves out. What looks like the wrong reading of one mode may be an
/// effect that the model lacks, and the other way round: the evidence of both decides.
fn diagnose_modes(
    analysis: &Analysis,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Result<Diagnosis, GapError> {
    let all = observations(analysis);
    let found = analysis.identification.as_ref();
    let left_out = found.and_then(|found| Some(found.left_out.as_ref()?.found.mode));
    let Some(mode) = left_out else {
        return diagnose(&all, nominal, settings);
    };
    let without = || {
        let rest = observations_without(analysis, left_out);
        diagnose(&rest, nominal, settings)
    };
    let (Ok(mut all_modes), Some(reading)) = (
        diagnose(&all, nominal, settings),
        reading_evidence(&all, nominal, settings, mode)
            .ok()
            .flatten(),
    ) else {
        return without();
    };
    let explained = all_modes.hypotheses.iter();
    let explained = explained.filter(|one| one.hypothesis != Hypothesis::None);
    let Some(best) = explained.max_by(|a, b| a.probability.total_cmp(&b.probability)) else {
        return without();
    };
    let odds = best.log_bayes_factor.unwrap_or(f64::NEG_INFINITY) - reading;
    let is_named = !all_modes.verdict.hypotheses().is_empty();
    if odds > EXCLUDED {
        return Ok(all_modes);
    }
    if odds < -EXCLUDED || !is_named {
        return without();
    }
    // Either the effect, or nothing but the reading of this mode.
    let mut either = all_modes.verdict.hypotheses();
    if !either.contains(&Hypothesis::None) {
        either.push(Hypothesis::None);
    }
    all_modes.verdict = Verdict::Set(either);
    Ok(all_modes)
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
        known.free_scale = free_scale(&free.bar, &known.beam, test.beam.length);
        known.has_same_clock = !free.recordings.is_empty();
    }
    if let Some(estimate) = estimate {
        take_estimated_properties(&mut nominal, estimate);
    }
    nominal
}

/// Spread of a property that is estimated (1): it has no prior, and what the description says of it is a guess.
const ESTIMATED: f64 = 0.3;

/// Takes the modulus or the density from the estimate, where that estimates it. Weight and free test are then compared with
/// the new nominal beam.
fn take_estimated_properties(nominal: &mut Nominal, estimate: &ConsistentEstimate) {
    let described = nominal.specimen.body.beams()[0];
    let known = &mut nominal.uncertainty;
    let (mut modulus, mut density) = (1.0, 1.0);
    if estimate.fit.contains(&Parameter::Modulus) {
        known.beam.modulus = Some(ESTIMATED);
        modulus = estimate.beam.modulus / described.modulus;
    }
    if estimate.fit.contains(&Parameter::Density) {
        known.beam.density = Some(ESTIMATED);
        density = estimate.beam.density / described.density;
    }
    for beam in nominal.specimen.body.beams_mut() {
        beam.modulus *= modulus;
        beam.density *= density;
    }
    if let Some(weighed) = &mut known.weighed {
        weighed.value -= density.ln();
    }
    if let Some(free) = &mut known.free_scale {
        free.value -= 0.5 * (modulus / density).ln();
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
        let ratio = weighed.length / beam.length;
        // Of a lap joint both halves.
        let beams = halves.body.beams().iter();
        let described = beams.map(Beam::mass).sum::<f64>() * ratio;
        let of_length = match details.is_longer {
            true => details.tolerances.length.unwrap_or(0.0) / ratio,
            false => 0.0,
        };
        Observed {
            value: (weighed.mass / described).ln(),
            std: (weighed.std / weighed.mass).hypot(of_length),
            freedom: None,
        }
    });
    let free = details.free.as_ref();
    DescriptionUncertainty {
        beam: details.tolerances,
        masses: tolerance.masses.std,
        positions: tolerance.positions.std,
        weighed,
        free_scale: free.and_then(|free| free_scale(free, &details.tolerances, beam.length)),
        is_longer: details.is_longer,
        has_same_clock: false,
    }
}

/// Returns the mean of the free bar's frequencies over the described ones (logarithm); `None` where the bar has none. `length`
/// (m) is that of the beam, for which the tolerances are given.
fn free_scale(free: &MovedClamp, tolerances: &BeamTolerances, length: f64) -> Option<Observed> {
    let count = free.modes.iter().map(|mode| mode.mode).max()?;
    let specimen = free.structure.specimen(None);
    let predicted = specimen.modes(count, Mesh::DIAGNOSIS).ok()?;
    let (mut weights, mut sum) = (0.0, 0.0);
    // Change of the mean by mass and place of everything that sits on the bar.
    let mut of_masses = vec![[0.0; 2]; specimen.masses.len()];
    for mode in &free.modes {
        let index = mode.mode - 1;
        let reading = mode.std.unwrap_or(0.0) / mode.frequency;
        let weight = (reading * reading + LEAST_DISCREPANCY * LEAST_DISCREPANCY).recip();
        weights += weight;
        sum += weight * (mode.frequency / predicted.frequencies()[index]).ln();
        for (load, changes) in specimen.masses.iter().zip(&mut of_masses) {
            // d ln f/d m = -phi^2/2, d ln f/d x = -m phi phi', of a shape of unit modal mass.
            let phi = predicted.displacement(index, load.position);
            changes[0] -= weight * 0.5 * phi * phi;
            changes[1] -= weight * load.mass * phi * predicted.slope(index, load.position);
        }
    }
    let attached = free.attachments.iter().zip(&of_masses);
    let attached = attached.map(|(tolerance, changes)| {
        let [by_mass, by_place] = changes.map(|change| change / weights);
        (by_mass * tolerance.mass).powi(2) + (by_place * tolerance.position).powi(2)
    });
    // f is proportional to L^-2. The length of the bar is known as well as that of the beam, in m.
    let of_length = 2.0 * tolerances.length.unwrap_or(0.0) * length / free.structure.beam.length;
    Some(Observed {
        value: sum / weights,
        std: (weights.recip() + of_length * of_length + attached.sum::<f64>()).sqrt(),
        freedom: None,
    })
}

/// Frequencies read elsewhere may be off by half a line, all in one direction.
fn reading_bias(test: &TestDescription) -> Option<f64> {
    let half_lines = test.measured.as_ref()?.half_line.as_ref()?;
    Some(half_lines.iter().copied().fold(0.0, f64::max))
}
