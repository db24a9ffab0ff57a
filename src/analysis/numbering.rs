//! Numbers of the modes of a jointed structure: peaks and joint together.

use std::f64::consts::TAU;

use super::analysis::{ModeResult, RecordingResult};
use super::consistent::{self, NO_SPRING, StructureDetails};
use super::model::TestedStructure;
use super::modes::{apply_numbers, looked_at, number_in_order};
use super::observations::shape_of;
use super::warning::Warning;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_description::FitParameter;
use tapjoint_identify::consistent::Parameter;
use tapjoint_identify::pair_modes;
use tapjoint_identify::pairing::{
    MeasuredPeak, MissingCause, MissingMode, Numbering, Pairing, PairingSettings, PeakStrength,
    ShapeAt, is_plain,
};
use tapjoint_signal::modal::ModeReading;

/// A reading of another recording is of the same peak within its half lines and this: what merges
/// readings into one peak, and a little more.
const SAME_PEAK: f64 = 0.005;

/// Numbers the peaks of a jointed structure; in ascending order where nothing better can be had.
pub(super) fn number_jointed(
    modes: &mut [ModeResult],
    known: (&TestedStructure, &StructureDetails),
    recordings: &[&RecordingResult],
) -> Vec<Warning> {
    let free: Vec<usize> = (0..modes.len())
        .filter(|&index| modes[index].label.is_none())
        .collect();
    let peaks: Vec<MeasuredPeak> = free
        .iter()
        .map(|&index| peak(index, modes, recordings))
        .collect();
    if fits_the_beam(known.1) {
        // Beside an unknown beam the joint's bounds say nothing of a mode's number.
        number_in_order(modes);
        return Vec::new();
    }
    let jointed = consistent::jointed(known.0, known.1);
    let found = pair_modes(&jointed, &peaks, &settings(known, recordings));
    let Some(pairing) = found.ok().filter(|_| !peaks.is_empty()) else {
        number_in_order(modes);
        return Vec::new();
    };
    let numbers = &pairing.chosen.numbers;
    let text = "with them no joint explains the peaks as well; torsion, another direction of \
                bending, the fixture or the suspension are the usual causes"
        .to_string();
    let mut warnings = apply_numbers(modes, (&free, numbers), text);
    warnings.extend(missing(&pairing.chosen.missing));
    warnings.extend(ambiguous(&pairing, &peaks));
    warnings
}

fn fits_the_beam(details: &StructureDetails) -> bool {
    let beam = [FitParameter::Modulus, FitParameter::Density];
    let fit = details.fit.as_deref().unwrap_or(&[]);
    fit.iter().any(|parameter| beam.contains(parameter))
}

/// What is estimated and what is held, as the estimate has it.
fn settings(
    (structure, details): (&TestedStructure, &StructureDetails),
    recordings: &[&RecordingResult],
) -> PairingSettings {
    let units = StiffnessUnits::of(&structure.beam);
    let held = |known: Option<f64>, unit: f64| known.map(|value| value.max(NO_SPRING) * unit);
    let joint = [Parameter::Kt, Parameter::Kr, Parameter::Coupling];
    let mut fit = consistent::fitted(structure, details);
    fit.retain(|parameter| joint.contains(parameter));
    let band = |recording: &&RecordingResult| looked_at(recording);
    PairingSettings {
        fit,
        held: [
            held(structure.known.kx, units.kt),
            held(structure.known.ky, units.kr),
            structure.known.cross_compliance.map(|c| units.ktr / c),
        ],
        bands: recordings.iter().filter_map(band).collect(),
        ..PairingSettings::default()
    }
}

fn peak(index: usize, modes: &[ModeResult], recordings: &[&RecordingResult]) -> MeasuredPeak {
    let mode = &modes[index];
    MeasuredPeak {
        frequency: mode.frequency,
        std: mode.std,
        shape: recordings
            .iter()
            .enumerate()
            .flat_map(|(index, recording)| shape(mode, recording, index))
            .collect(),
        strengths: recordings
            .iter()
            .map(|recording| strength(index, modes, recording))
            .collect(),
    }
}

/// How strongly one recording saw a peak; `None` where its reading nearest to the peak is another peak's.
fn strength(
    index: usize,
    modes: &[ModeResult],
    recording: &RecordingResult,
) -> Option<PeakStrength> {
    let reading = reading_of(&modes[index], recording)?;
    let distance = |mode: &ModeResult| (mode.frequency - reading.frequency).abs();
    let own = distance(&modes[index]);
    if modes.iter().any(|other| distance(other) < own) {
        return None;
    }
    Some(PeakStrength {
        energy: energy(reading),
        level_db: reading.prominence_db.and(reading.above_noise_db),
    })
}

/// Energy of a fitted oscillation in all taps and sensors of its recording: the integral of
/// (a e^{-zeta omega t})^2/2 is a^2/(4 zeta omega).
fn energy(reading: &ModeReading) -> Option<f64> {
    let mode = &reading.fit.as_deref()?.mode;
    let squares: f64 = mode.amplitudes.iter().map(|a| a.value.norm_sqr()).sum();
    let decay = TAU * mode.frequency.value * mode.damping_ratio.value;
    (decay > 0.0 && squares > 0.0).then(|| squares / (4.0 * decay))
}

/// The peak's shape in one recording. Modal constants of all recordings share the hammer's unit; a
/// shape without them has one of its own.
fn shape(mode: &ModeResult, recording: &RecordingResult, index: usize) -> Vec<ShapeAt> {
    let Some(reading) = reading_of(mode, recording) else {
        return Vec::new();
    };
    let (shape, constant) = shape_of(reading, recording);
    let tap = recording.conditions.tap.filter(|_| constant.is_some());
    let unit = constant.filter(|_| tap.is_some()).map_or(1.0, |c| c.value);
    let at = |value: &tapjoint_identify::observation::ShapeValue| {
        let name = &recording.responses.get(value.sensor)?.name;
        Some(ShapeAt {
            sensor: *recording.conditions.sensor_positions.get(name)?,
            tap,
            value: value.value * unit,
            // The reference's own noise is in the constant.
            std: value
                .std
                .max(constant.map_or(0.0, |c| c.std / c.value.abs()))
                * unit.abs(),
            group: if tap.is_some() { 0 } else { index + 1 },
        })
    };
    shape.iter().filter_map(at).collect()
}

/// The recording's own reading of a peak.
fn reading_of<'a>(mode: &ModeResult, recording: &'a RecordingResult) -> Option<&'a ModeReading> {
    let readings = &recording.measurement.spectra.as_ref()?.readings;
    let distance = |reading: &&ModeReading| (reading.frequency - mode.frequency).abs();
    let near = |reading: &&ModeReading| {
        let half_lines = mode.half_line.unwrap_or(0.0) + reading.half_line;
        reading.label.is_none() && distance(reading) <= half_lines + SAME_PEAK * mode.frequency
    };
    readings
        .iter()
        .filter(near)
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

fn missing(modes: &[MissingMode]) -> Option<Warning> {
    if modes.is_empty() {
        return None;
    }
    let one = |missing: &MissingMode| {
        let why = match missing.cause {
            MissingCause::OutsideBand => "outside the measured band",
            MissingCause::AtNode => "near a node of its shape at every sensor or tap",
            MissingCause::Unknown => "within the band",
        };
        format!(
            "mode {} (about {:.1} Hz, {why})",
            missing.mode, missing.frequency
        )
    };
    let list: Vec<String> = modes.iter().map(one).collect();
    Some(Warning::Estimate {
        code: "missing-mode",
        text: format!(
            "no peak was taken for {}; the peaks above keep the numbers that the beam gives them; tap \
             and measure elsewhere, or from a lower frequency on, to see it",
            list.join(", ")
        ),
    })
}

/// Other numberings that explain the peaks comparably.
fn ambiguous(pairing: &Pairing, peaks: &[MeasuredPeak]) -> Option<Warning> {
    let other = pairing.others.first()?;
    let chosen = &pairing.chosen;
    let kept = if is_plain(&chosen.numbers) {
        "kept in ascending order"
    } else {
        "taken as the most probable"
    };
    Some(Warning::Estimate {
        code: "ambiguous-pairing",
        text: format!(
            "which peak is which mode is not certain: {} is {kept}, but {} explains the peaks comparably \
             ({}); another sensor or tap position, or more modes, would decide",
            words(chosen, peaks),
            words(other, peaks),
            compared(chosen.odds / other.odds),
        ),
    })
}

/// How probable the other is beside the chosen, from the ratio of the two.
fn compared(times: f64) -> String {
    if (0.95..1.05).contains(&times) {
        "as probable".to_owned()
    } else if times >= 1.0 {
        format!("{times:.1} times as probable")
    } else {
        format!("{:.1} times less probable", 1.0 / times)
    }
}

/// "1: 17.00 Hz, 3: 335.6 Hz, none: 50.00 Hz".
fn words(numbering: &Numbering, peaks: &[MeasuredPeak]) -> String {
    let one = |(number, peak): (&Option<usize>, &MeasuredPeak)| {
        let number = number.map_or("none".to_string(), |number| number.to_string());
        format!("{number}: {:.2} Hz", peak.frequency)
    };
    let list: Vec<String> = numbering.numbers.iter().zip(peaks).map(one).collect();
    format!("({})", list.join(", "))
}
