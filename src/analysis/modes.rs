//! One list of numbered modes from several recordings, or from frequencies read elsewhere.

use super::analysis::{BetweenRecordings, ModeResult, RecordingResult};
use super::between_recordings::between;
use super::identification::measured_modes;
use super::observed_mode::shape_of;
use super::structure::{
    NO_SPRING, StructureDetails, TestedStructure, estimator, fitted, frequencies_of, jointed,
    masses_in,
};
use super::warning::Warning;
use std::f64::consts::TAU;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{Assembly, JointStiffness, natural_frequencies};
use tapjoint_description::{
    FitParameter, MeasuredFrequencies, RecordingDescription, TestDescription,
};
use tapjoint_identify::consistent::{FrequencyModel, Parameter};
use tapjoint_identify::observation::UNPAIRED;
use tapjoint_identify::pairing::{
    MeasuredPeak, MissingCause, MissingMode, Numbering, Pairing, PairingSettings, PeakStrength,
    ShapeAt, is_plain,
};
use tapjoint_identify::{FREQUENCY_FLOOR, WeightedPeak, pair_by_ratio, pair_modes};
use tapjoint_numerics::stats::times;
use tapjoint_signal::modal::{BandReadings, ModeReading, merge_modes};

/// Recordings count as tapped at the same level when their median peak forces differ by less than
/// this factor.
const SAME_LEVEL: f64 = 2.0;

/// A free beam's frequencies may all differ from the nominal ones by this common factor: a modulus
/// wrong by 40 % is still recognised.
const FREE_BEAM_RANGE: f64 = 0.2;

/// Beside that factor a mode may be off by this much: what the lack of shear does to the fourth mode
/// of a usual bar.
const FREE_BEAM_TOLERANCE: f64 = 0.04;

/// What another sensor position or tap level moves a frequency at most, relative: 24 g at the end of a
/// usual bar are 3 %, a joint that softens by 15 % at the hardest tap 4 %. Bending modes are farther
/// apart.
const OTHER_CONFIGURATION: f64 = 0.05;

/// So many modes of a free beam are looked for.
const FREE_BEAM_MODES: usize = 30;

/// Indices of the recordings of the reference configuration: the first, and all others with its
/// sensor positions, fastened masses and tap level.
pub(super) fn reference_configuration(aside: &[Option<String>]) -> Vec<usize> {
    (0..aside.len())
        .filter(|&index| aside[index].is_none())
        .collect()
}

/// Of each recording how it differs from the first, so that it is left out of the list of modes; `None` where it does
/// not.
pub(super) fn set_aside(
    test: &TestDescription,
    recordings: &[RecordingResult],
) -> Vec<Option<String>> {
    let Some(first) = recordings.first() else {
        return Vec::new();
    };
    let described = test.recordings.first();
    let differs = |(index, own): (usize, &RecordingResult)| {
        let both = described.zip(test.recordings.get(index));
        let level = median_force(own)
            .zip(median_force(first))
            .map(|(own, first)| own / first)
            .filter(|ratio| ratio.max(1.0 / ratio) >= SAME_LEVEL);
        let words = [
            level.map(|ratio| format!("{} times its tap level", times(ratio))),
            both.filter(|(a, b)| a.at != b.at)
                .map(|_| "sensors elsewhere".to_owned()),
            both.filter(|(a, b)| a.masses != b.masses)
                .map(|_| "other masses fastened".to_owned()),
        ];
        let words: Vec<String> = words.into_iter().flatten().collect();
        (!words.is_empty()).then(|| words.join(", "))
    };
    recordings.iter().enumerate().map(differs).collect()
}

/// Median peak force of the accepted taps; `None` without a hammer or tap.
fn median_force(recording: &RecordingResult) -> Option<f64> {
    if !recording.has_hammer {
        return None;
    }
    let mut peaks: Vec<f64> = recording
        .measurement
        .taps
        .accepted()
        .map(|tap| tap.peak)
        .collect();
    peaks.sort_by(f64::total_cmp);
    peaks.get(peaks.len() / 2).copied()
}

/// Merges the readings of the `reference` recordings and numbers them; every recording's own
/// readings get the number of the mode they belong to.
pub fn modes_of_recordings(
    recordings: &mut [RecordingResult],
    reference: &[usize],
    (structure, details): (&TestedStructure, &StructureDetails),
) -> (Vec<ModeResult>, Vec<Warning>) {
    let merged = merge_modes(&readings_of(recordings, reference));
    let mut modes: Vec<ModeResult> = merged
        .into_iter()
        .map(|mode| {
            let file = reference
                .get(mode.recording)
                .map(|&index| recordings[index].file.clone());
            let lambda = Some(structure.beam.lambda_of(mode.reading.frequency));
            ModeResult {
                lambda,
                ..from_reading(mode.reading, file)
            }
        })
        .collect();
    let warnings = match structure.assembly {
        Assembly::Free => number_free(&mut modes, structure),
        Assembly::Cantilever | Assembly::Lap => {
            let seen: Vec<&RecordingResult> =
                reference.iter().map(|&index| &recordings[index]).collect();
            number_jointed(&mut modes, (structure, details), &seen)
        }
    };
    for recording in recordings.iter_mut() {
        recording.mode_numbers = own_numbers(&modes, &own_readings(recording));
    }
    for mode in &mut modes {
        mode.between = between_recordings(mode, recordings, reference);
    }
    (modes, warnings)
}

/// How far a mode's frequency scatters between the `reference` recordings.
fn between_recordings(
    mode: &ModeResult,
    recordings: &[RecordingResult],
    reference: &[usize],
) -> Option<BetweenRecordings> {
    let number = mode.mode?;
    let readings: Vec<ModeReading> = reference
        .iter()
        .filter_map(|&index| {
            let of_mode = |own: &Option<usize>| *own == Some(number);
            let place = recordings[index].mode_numbers.iter().position(of_mode)?;
            own_readings(&recordings[index]).into_iter().nth(place)
        })
        .collect();
    between(&readings)
}

/// The readings of a bare recording, numbered as they come.
pub(super) fn modes_of_bare(recording: &mut RecordingResult) -> Vec<ModeResult> {
    let file = Some(recording.file.clone());
    let mut modes: Vec<ModeResult> = own_readings(recording)
        .into_iter()
        .map(|reading| from_reading(reading, file.clone()))
        .collect();
    number_in_order(&mut modes);
    recording.mode_numbers = modes.iter().map(|mode| mode.mode).collect();
    modes
}

/// The frequencies that the description gives.
pub fn modes_of_measured(
    measured: &MeasuredFrequencies,
    structure: &TestedStructure,
) -> Vec<ModeResult> {
    measured
        .frequencies
        .iter()
        .enumerate()
        .map(|(index, &frequency)| {
            let of =
                |values: &Option<Vec<f64>>| values.as_ref().and_then(|v| v.get(index)).copied();
            let half_line = of(&measured.half_line);
            ModeResult {
                mode: measured.modes.get(index).copied(),
                frequency,
                half_line,
                std: standard_uncertainty(
                    frequency,
                    half_line,
                    of(&measured.std),
                    measured.scatter,
                ),
                between: None,
                reading: None,
                recording: None,
                label: None,
                lambda: Some(structure.beam.lambda_of(frequency)),
            }
        })
        .collect()
}

/// std^2 = half_line^2/3 + (scatter f)^2, or the stated std with the scatter added; `None` when
/// nothing is stated. A uniform distribution of half width h has the variance h^2/3.
fn standard_uncertainty(
    frequency: f64,
    half_line: Option<f64>,
    std: Option<f64>,
    scatter: Option<f64>,
) -> Option<f64> {
    let reading = std
        .map(|std| std * std)
        .or(half_line.map(|half| half * half / 3.0));
    let repeat = scatter.map(|scatter| (scatter * frequency).powi(2));
    if reading.is_none() && repeat.is_none() {
        return None;
    }
    Some((reading.unwrap_or(0.0) + repeat.unwrap_or(0.0)).sqrt())
}

pub(super) fn own_readings(recording: &RecordingResult) -> Vec<ModeReading> {
    recording
        .measurement
        .spectra
        .as_ref()
        .map_or(Vec::new(), |spectra| spectra.readings.clone())
}

fn readings_of(recordings: &[RecordingResult], which: &[usize]) -> Vec<BandReadings> {
    let shown = |recording: &RecordingResult| BandReadings {
        band: looked_at(recording).unwrap_or((0.0, f64::INFINITY)),
        readings: own_readings(recording),
    };
    which
        .iter()
        .map(|&index| shown(&recordings[index]))
        .collect()
}

/// Frequencies at which a recording was looked for resonances (Hz); `None` without spectra.
pub(super) fn looked_at(recording: &RecordingResult) -> Option<(f64, f64)> {
    let lines = recording.measurement.spectra.as_ref()?.averages.lines;
    Some((lines.low, lines.high))
}

fn from_reading(reading: ModeReading, recording: Option<String>) -> ModeResult {
    ModeResult {
        mode: None,
        frequency: reading.frequency,
        half_line: Some(reading.half_line),
        std: reading.std,
        between: None,
        label: reading.label.map(|label| label.to_string()),
        recording,
        lambda: None,
        reading: Some(reading),
    }
}

/// Numbers a free beam's modes by their nominal frequencies, where any is near one; else in ascending
/// order.
fn number_free(modes: &mut [ModeResult], structure: &TestedStructure) -> Vec<Warning> {
    let free: Vec<usize> = (0..modes.len())
        .filter(|&i| modes[i].label.is_none())
        .collect();
    let peaks: Vec<WeightedPeak> = free.iter().map(|&i| weighted(&modes[i])).collect();
    let nominal = natural_frequencies(
        structure.theory,
        &structure.beam,
        Assembly::Free,
        &JointStiffness::FREE,
        FREE_BEAM_MODES,
    )
    .unwrap_or_default();
    let numbers = pair_by_ratio(&peaks, &nominal, FREE_BEAM_RANGE, FREE_BEAM_TOLERANCE);
    if numbers.iter().any(Option::is_some) {
        let text = "none of the free beam's natural frequencies lies near them; another direction \
                    of bending, torsion, the supports or the room are the usual causes";
        return apply_numbers(modes, (&free, &numbers), text.to_string());
    }
    number_in_order(modes);
    if free.is_empty() {
        Vec::new()
    } else {
        vec![Warning::NumberedInOrder]
    }
}

/// A mode with its height over the noise, or its prominence, as weight.
fn weighted(mode: &ModeResult) -> WeightedPeak {
    let weight = mode.reading.as_ref().map_or(1.0, |reading| {
        reading
            .above_noise_db
            .or(reading.prominence_db)
            .unwrap_or(0.0)
    });
    WeightedPeak {
        frequency: mode.frequency,
        weight,
    }
}

/// Gives the peaks their numbers; those without one are labelled, and `text` says why.
pub(super) fn apply_numbers(
    modes: &mut [ModeResult],
    (which, numbers): (&[usize], &[Option<usize>]),
    text: String,
) -> Vec<Warning> {
    let mut unpaired = 0;
    for (&index, &number) in which.iter().zip(numbers) {
        modes[index].mode = number;
        if number.is_none() {
            modes[index].label = Some(UNPAIRED.to_string());
            unpaired += 1;
        }
    }
    if unpaired > 0 {
        vec![Warning::Unpaired {
            count: unpaired,
            text,
        }]
    } else {
        Vec::new()
    }
}

pub(super) fn number_in_order(modes: &mut [ModeResult]) {
    for (index, mode) in modes
        .iter_mut()
        .filter(|mode| mode.label.is_none())
        .enumerate()
    {
        mode.mode = Some(index + 1);
    }
}

/// The numbers of the modes that a recording's readings belong to. Each mode takes the reading nearest
/// to it, within their half lines together and [`OTHER_CONFIGURATION`], and no reading serves two
/// modes. A reading that lies nearer to a peak without a number is that peak's, if none is nearer to the peak: a torsion
/// mode stays one where the sensor sits on a node of the bending mode beside it, and a bending mode that moved towards
/// it stays that one.
pub(super) fn own_numbers(modes: &[ModeResult], readings: &[ModeReading]) -> Vec<Option<usize>> {
    let mut numbers = vec![None; readings.len()];
    for mode in modes.iter().filter(|mode| mode.mode.is_some()) {
        let distance = |index: &usize| (mode.frequency - readings[*index].frequency).abs();
        let nearest = (0..readings.len())
            .filter(|&index| readings[index].label.is_none() && numbers[index].is_none())
            .filter(|&index| !is_of_another(modes, mode, (readings, index)))
            .filter(|index| {
                let half_lines = mode.half_line.unwrap_or(0.0) + readings[*index].half_line;
                distance(index) <= half_lines + OTHER_CONFIGURATION * mode.frequency
            })
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(nearest) = nearest {
            numbers[nearest] = mode.mode;
        }
    }
    numbers
}

/// Peaks without a number that lie nearer than this to a mode may be a part of its line (1, relative).
const OF_ITS_LINE: f64 = 0.01;

/// Whether a reading lies nearer to a peak without a number, one apart from this mode, than to the mode, and is the one
/// that shows the peak: the nearest to it of all readings.
fn is_of_another(
    modes: &[ModeResult],
    mode: &ModeResult,
    (readings, index): (&[ModeReading], usize),
) -> bool {
    let frequency = readings[index].frequency;
    let apart =
        |peak: &&ModeResult| (peak.frequency - mode.frequency).abs() > OF_ITS_LINE * mode.frequency;
    let unpaired =
        |peak: &&ModeResult| peak.mode.is_none() && peak.label.as_deref() == Some(UNPAIRED);
    let own = (frequency - mode.frequency).abs();
    let shows = |peak: &ModeResult| {
        let distance = (frequency - peak.frequency).abs();
        let mut others = readings.iter().filter(|other| other.label.is_none());
        let nearer = others.any(|other| (other.frequency - peak.frequency).abs() < distance);
        distance < own && !nearer
    };
    let mut peaks = modes.iter().filter(unpaired).filter(apart);
    peaks.any(shows)
}

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
    let jointed = jointed(known.0, known.1);
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
    let mut fit = fitted(structure, details);
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

/// Numbers the readings of all recordings with other fastened masses than the first, by the frequencies to
/// which these masses take the reference configuration's modes. Where that is not known they lose the numbers
/// that their neighbours of the reference gave them: a heavy mass takes a mode to another's place.
pub(super) fn number_loaded(
    recordings: &mut [RecordingResult],
    modes: &[ModeResult],
    test: &TestDescription,
    known: (&TestedStructure, &StructureDetails),
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let first = test.recordings.first().map(|recording| &recording.masses);
    for (recording, described) in recordings.iter_mut().zip(&test.recordings) {
        if Some(&described.masses) == first {
            continue;
        }
        match moved(modes, (test, described), known) {
            Some(moved) => recording.mode_numbers = own_numbers(&moved, &own_readings(recording)),
            None => {
                recording.mode_numbers.fill(None);
                warnings.push(unnumbered(&recording.file));
            }
        }
    }
    warnings
}

fn unnumbered(file: &str) -> Warning {
    Warning::Recording {
        code: "unnumbered",
        file: file.to_owned(),
        text: "its peaks have no mode numbers: the first recording gives no estimate of the joint, so that it is \
               not known where the masses fastened here take the modes; read more modes in the first recording, \
               or state kt and kr in [joint]"
            .to_owned(),
    }
}

/// The modes at the frequencies of another recording: the ratio that the masses on the beam make. `None` where
/// nothing tells of the joint.
fn moved(
    modes: &[ModeResult],
    (test, recording): (&TestDescription, &RecordingDescription),
    (structure, details): (&TestedStructure, &StructureDetails),
) -> Option<Vec<ModeResult>> {
    let other = StructureDetails {
        masses: masses_in(test, Some(recording)),
        ..details.clone()
    };
    let [before, after] = frequencies(modes, structure, [details, &other])?;
    let moved = |one: &ModeResult| {
        let place = one.mode.and_then(|mode| mode.checked_sub(1));
        let both = place.and_then(|place| before.get(place).zip(after.get(place)));
        ModeResult {
            frequency: both.map_or(1.0, |(before, after)| after / before) * one.frequency,
            ..one.clone()
        }
    };
    Some(modes.iter().map(moved).collect())
}

/// Frequencies (Hz) of the structure without and with the other masses, on the joint that the reference's
/// frequencies have, else on the described one.
fn frequencies(
    modes: &[ModeResult],
    structure: &TestedStructure,
    both: [&StructureDetails; 2],
) -> Option<[Vec<f64>; 2]> {
    // Only the weights depend on the floor, and of these the numbering does not.
    let measured = measured_modes(modes, FREQUENCY_FLOOR);
    let count = measured.last()?.mode;
    let found = estimator(structure, both[0], &measured).map(|estimator| estimator.fit());
    let of = |details: &StructureDetails| {
        let there = jointed(structure, details);
        let Ok(found) = &found else {
            // Of a joint that is known nothing is left to estimate.
            let joint = structure.known.over(None)?;
            return frequencies_of(&there, &joint, count).ok();
        };
        let model = FrequencyModel::new(&there, count).ok()?;
        let frequency = |mode| model.response(&found.point, mode, mode as f64).frequency;
        Some((1..=count).map(frequency).collect())
    };
    let [before, after] = both.map(of);
    Some([before?, after?])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(frequency: f64) -> ModeReading {
        ModeReading::on_line(frequency, 0.1)
    }

    fn mode(number: Option<usize>, frequency: f64) -> ModeResult {
        ModeResult {
            mode: number,
            label: number.is_none().then(|| UNPAIRED.to_owned()),
            ..from_reading(reading(frequency), None)
        }
    }

    /// A torsion mode at 1055 Hz beside a bending mode at 1090 Hz on whose node the sensor sits.
    #[test]
    fn regress_a_reading_near_a_peak_without_a_number_is_no_mode() {
        let modes = [
            mode(Some(4), 700.0),
            mode(None, 1055.1),
            mode(Some(5), 1090.0),
        ];
        let numbers = |all: &[f64]| {
            let readings: Vec<ModeReading> = all.iter().map(|f| reading(*f)).collect();
            own_numbers(&modes, &readings)
        };
        assert_eq!(numbers(&[701.0, 1055.2]), [Some(4), None]);
        assert_eq!(numbers(&[1055.2, 1085.0]), [None, Some(5)]);
        // A moved mode, nearer to the peak than to where it was: the peak has a reading of its own.
        assert_eq!(numbers(&[1055.2, 1070.0]), [None, Some(5)]);
        // A second pole of the mode's own line takes nothing from it.
        let split = [mode(None, 1089.0), mode(Some(5), 1090.0)];
        assert_eq!(own_numbers(&split, &[reading(1089.1)]), [Some(5)]);
    }
}
