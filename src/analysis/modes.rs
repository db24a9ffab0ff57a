//! One list of numbered modes from several recordings, or from frequencies read elsewhere.

use super::mode_file::ModesOfFile;
use super::observed_mode::shape_of;
use super::recording_result::RecordingResult;
use super::results::{ModeResult, between, measured_modes, scatter_of};
use super::structure::{
    NO_SPRING, StructureDetails, TestedStructure, estimator, fitted, frequencies_of, jointed,
    masses_in,
};
use super::warnings::Warning;
use std::collections::{BTreeMap, BTreeSet};
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{Assembly, JointStiffness, natural_frequencies};
use tapjoint_description::{
    FitParameter, MeasuredFrequencies, RecordingDescription, TestDescription,
};
use tapjoint_identify::consistent::{FrequencyModel, Parameter};
use tapjoint_identify::pairing::{MeasuredPeak, PairingSettings, ShapeAt, SizeAt};
use tapjoint_identify::{FREQUENCY_FLOOR, WeightedPeak, pair_by_ratio, pair_modes};
use tapjoint_numerics::stats::{median, times};
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

/// Largest relative change of a frequency by another sensor position or tap level: 24 g at the end of a usual bar
/// change it by 3 %. A joint that softens by 15 % at the hardest tap changes it by 4 %. Bending modes are farther
/// apart.
const OTHER_CONFIGURATION: f64 = 0.05;

/// Number of modes of a free beam among which peaks are numbered.
const FREE_BEAM_MODES: usize = 30;

/// Returns how each recording differs from the first, so that it is left out of the list of modes; `None` where it
/// belongs to the reference configuration: the first recording, and all others with its sensor positions, fastened
/// masses and tap level. `described` are the recordings of the description; none of bare recordings.
pub(super) fn set_aside(
    described: &[RecordingDescription],
    recordings: &[RecordingResult],
) -> Vec<Option<String>> {
    let Some(first) = recordings.first() else {
        return Vec::new();
    };
    let mut aside = Vec::with_capacity(recordings.len());
    for (index, own) in recordings.iter().enumerate() {
        let mut words = Vec::new();
        if let Some((own, first)) = median_force(own).zip(median_force(first)) {
            let ratio: f64 = own / first;
            if ratio.max(1.0 / ratio) >= SAME_LEVEL {
                words.push(format!("{} times its tap level", times(ratio)));
            }
        }
        if let (Some(first), Some(own)) = (described.first(), described.get(index)) {
            if first.at != own.at {
                words.push("sensors elsewhere".to_owned());
            }
            if first.masses != own.masses {
                words.push("other masses fastened".to_owned());
            }
        }
        aside.push((!words.is_empty()).then(|| words.join(", ")));
    }
    aside
}

/// Median peak force of the accepted taps; `None` without a tap, or where forces are not known.
fn median_force(recording: &RecordingResult) -> Option<f64> {
    let mut peaks = recording.tap_peaks();
    (recording.has_tap_forces() && !peaks.is_empty()).then(|| median(&mut peaks))
}

/// Merges and numbers the readings of the recordings that are not set `aside`, and numbers the readings of all others.
pub(super) fn modes_of_test(
    test: &TestDescription,
    recordings: &mut [RecordingResult],
    aside: &[Option<String>],
    structure: &TestedStructure,
    details: &StructureDetails,
) -> (Vec<ModeResult>, Vec<Warning>) {
    let mut reference: Vec<usize> = (0..recordings.len()).collect();
    reference.retain(|&index| aside[index].is_none());
    let (modes, mut warnings) = modes_of_recordings(recordings, &reference, structure, details);
    let doubts = pair_mass_loaded(recordings, &modes, test, structure, details);
    warnings.extend(doubts);
    (modes, warnings)
}

/// Merges the readings of the `reference` recordings and numbers them; every recording's own
/// readings get the number of the mode they belong to.
pub fn modes_of_recordings(
    recordings: &mut [RecordingResult],
    reference: &[usize],
    structure: &TestedStructure,
    details: &StructureDetails,
) -> (Vec<ModeResult>, Vec<Warning>) {
    let seen: Vec<&RecordingResult> = reference.iter().map(|&index| &recordings[index]).collect();
    let mut modes = merged(&seen);
    for mode in &mut modes {
        mode.lambda = Some(structure.beam.lambda_of(mode.frequency));
    }
    let bands = seen.iter().filter_map(|recording| recording.looked_at());
    let placed = seen.iter();
    let placed = placed.flat_map(|recording| &recording.conditions.sensor_positions);
    let candidates = Candidates {
        which: unlabelled(&modes),
        shapes: Shapes::Recordings(&seen),
        bands: bands.collect(),
        sensors: placed.map(|(name, place)| (name.clone(), *place)).collect(),
    };
    let mut warnings = number(&mut modes, &candidates, structure, details);
    warnings.extend(add_repeats(&mut modes, recordings, reference));
    (modes, warnings)
}

/// Merges the readings of recordings into one list of modes, which have no numbers yet.
fn merged(recordings: &[&RecordingResult]) -> Vec<ModeResult> {
    let shown = recordings.iter().map(|recording| BandReadings {
        band: recording.looked_at().unwrap_or((0.0, f64::INFINITY)),
        tap: recording.conditions.tap,
        readings: recording.readings().to_vec(),
    });
    let merged = merge_modes(&shown.collect::<Vec<_>>()).into_iter();
    merged
        .map(|mode| ModeResult::of(mode.reading, &recordings[mode.recording].file))
        .collect()
}

/// Numbers every recording's own readings by the numbered `modes`, and gives these their frequencies in the `reference`
/// recordings. Warns of modes that moved between them.
fn add_repeats(
    modes: &mut [ModeResult],
    recordings: &mut [RecordingResult],
    reference: &[usize],
) -> Option<Warning> {
    for recording in recordings.iter_mut() {
        recording.mode_numbers = own_numbers(modes, recording.readings());
    }
    for mode in modes.iter_mut().filter(|mode| mode.mode.is_some()) {
        let mut frequencies = Vec::new();
        for &index in reference {
            let recording = &recordings[index];
            // Bands of one file are no repeats.
            let same = recordings.iter().position(|one| one.file == recording.file);
            let set_up = same.unwrap_or(index);
            if mode.repeats.contains_key(&set_up) {
                continue;
            }
            let numbered = recording.readings().iter().zip(&recording.mode_numbers);
            let mut own = numbered.filter(|(_, number)| **number == mode.mode);
            if let Some((reading, _)) = own.next()
                && let Some(std) = reading.std.filter(|std| *std > 0.0 && std.is_finite())
            {
                frequencies.push((reading.frequency, std));
                mode.repeats.insert(set_up, reading.frequency);
            }
        }
        mode.between = between(&frequencies);
    }
    Warning::moved_modes(modes)
}

/// The readings of bare recordings that are not set `aside`, merged and numbered as they come; the readings of all others
/// get the same numbers.
pub(super) fn modes_of_bare(
    recordings: &mut [RecordingResult],
    aside: &[Option<String>],
) -> (Vec<ModeResult>, Option<Warning>) {
    let mut reference: Vec<usize> = (0..recordings.len()).collect();
    reference.retain(|&index| aside[index].is_none());
    let seen: Vec<&RecordingResult> = reference.iter().map(|&index| &recordings[index]).collect();
    let mut modes = merged(&seen);
    let all = unlabelled(&modes);
    number_in_order(&mut modes, &all);
    let warnings = add_repeats(&mut modes, recordings, &reference);
    (modes, warnings)
}

/// The frequencies that the description gives.
pub fn modes_of_measured(
    measured: &MeasuredFrequencies,
    structure: &TestedStructure,
) -> Vec<ModeResult> {
    let half_lines = measured.half_line.as_deref().unwrap_or_default();
    let stds = measured.std.as_deref().unwrap_or_default();
    let mut modes = Vec::with_capacity(measured.frequencies.len());
    for (index, &frequency) in measured.frequencies.iter().enumerate() {
        let half_line = half_lines.get(index).copied();
        // std^2 = half_line^2/3 + (scatter f)^2, or the stated std with the scatter added. A uniform distribution of
        // half width h has the variance h^2/3.
        let stated = stds.get(index).map(|std| std * std);
        let reading = stated.or(half_line.map(|half| half * half / 3.0));
        let repeat = measured
            .scatter
            .map(|scatter| (scatter * frequency).powi(2));
        let known = reading.is_some() || repeat.is_some();
        let variance = reading.unwrap_or(0.0) + repeat.unwrap_or(0.0);
        modes.push(ModeResult {
            mode: measured.modes.get(index).copied(),
            frequency,
            half_line,
            std: known.then(|| variance.sqrt()),
            between: None,
            repeats: BTreeMap::new(),
            damping: None,
            reading: None,
            recording: None,
            lambda: Some(structure.beam.lambda_of(frequency)),
        });
    }
    modes
}

/// The modes of a file, numbered as the description says, else by their frequencies and shapes.
pub(super) fn modes_of_file(
    file: &ModesOfFile,
    structure: &TestedStructure,
    details: &StructureDetails,
) -> (Vec<ModeResult>, Vec<Warning>) {
    let mut modes = modes_of_measured(&file.measured, structure);
    for (mode, damping) in modes.iter_mut().zip(&file.damping) {
        mode.damping = *damping;
    }
    if !file.measured.modes.is_empty() {
        return (modes, Vec::new());
    }
    let mut which = unlabelled(&modes);
    which.retain(|index| !file.other_direction.contains(index));
    let candidates = Candidates {
        which,
        shapes: Shapes::Elsewhere(&file.shapes),
        bands: Vec::new(),
        sensors: file.nodes.clone(),
    };
    let warnings = number(&mut modes, &candidates, structure, details);
    (modes, warnings)
}

/// Peaks that may be modes of the model, and what is known of them beside their frequencies.
struct Candidates<'a> {
    /// Indices of the peaks.
    which: Vec<usize>,
    shapes: Shapes<'a>,
    /// Bands (Hz) in which peaks were looked for; none: everywhere.
    bands: Vec<(f64, f64)>,
    /// Names and positions (m) of the sensors.
    sensors: Vec<(String, f64)>,
}

/// Where the shapes of the peaks come from.
enum Shapes<'a> {
    Recordings(&'a [&'a RecordingResult]),
    /// One list for each peak.
    Elsewhere(&'a [Vec<ShapeAt>]),
}

/// Indices of the peaks that may be modes.
fn unlabelled(modes: &[ModeResult]) -> Vec<usize> {
    let all = 0..modes.len();
    all.filter(|&index| modes[index].may_be_mode()).collect()
}

/// Numbers the peaks by the model of the structure.
fn number(
    modes: &mut [ModeResult],
    candidates: &Candidates<'_>,
    structure: &TestedStructure,
    details: &StructureDetails,
) -> Vec<Warning> {
    match structure.assembly {
        Assembly::Free => number_free(modes, &candidates.which, structure),
        Assembly::Cantilever | Assembly::Lap => {
            number_jointed(modes, candidates, structure, details)
        }
    }
}

/// Numbers a free beam's modes by their nominal frequencies, where any is near one; else in ascending
/// order.
fn number_free(
    modes: &mut [ModeResult],
    free: &[usize],
    structure: &TestedStructure,
) -> Vec<Warning> {
    let mut peaks = Vec::with_capacity(free.len());
    for mode in free.iter().map(|&index| &modes[index]) {
        // Height over the noise, or prominence.
        let weight = mode.reading.as_ref().map_or(1.0, |reading| {
            let height = reading.above_noise_db.or(reading.prominence_db);
            height.unwrap_or(0.0)
        });
        peaks.push(WeightedPeak {
            frequency: mode.frequency,
            weight,
        });
    }
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
        let unnumbered = apply_numbers(modes, free, &numbers);
        return Vec::from_iter(Warning::unpaired_of_free_beam(unnumbered));
    }
    number_in_order(modes, free);
    match free.is_empty() {
        true => Vec::new(),
        false => vec![Warning::numbered_in_order()],
    }
}

/// Gives the peaks with these indices their numbers. Returns how many have none.
fn apply_numbers(modes: &mut [ModeResult], which: &[usize], numbers: &[Option<usize>]) -> usize {
    for (&index, &number) in which.iter().zip(numbers) {
        modes[index].mode = number;
    }
    numbers.iter().filter(|number| number.is_none()).count()
}

/// Numbers the peaks with these indices in ascending order.
fn number_in_order(modes: &mut [ModeResult], which: &[usize]) {
    for (number, &index) in (1..).zip(which) {
        modes[index].mode = Some(number);
    }
}

/// Returns the numbers of the modes that a recording's readings belong to. Each mode takes the reading nearest to it,
/// within their half lines together and [`OTHER_CONFIGURATION`]. No reading serves two modes. A reading that lies
/// nearer to a peak without a number belongs to that peak, if none is nearer to the peak. So a torsion peak keeps its
/// reading where the sensor sits on a node of the bending mode beside it. A bending mode that moved towards a torsion
/// peak keeps its own reading too.
fn own_numbers(modes: &[ModeResult], readings: &[ModeReading]) -> Vec<Option<usize>> {
    let mut numbers = vec![None; readings.len()];
    for mode in modes.iter().filter(|mode| mode.mode.is_some()) {
        let near = readings.iter().enumerate().filter(|(index, reading)| {
            reading.label.is_none()
                && numbers[*index].is_none()
                && is_within(reading, mode, OTHER_CONFIGURATION)
                && !is_of_another(reading, mode, modes, readings)
        });
        let nearest = near.min_by(|a, b| distance(a.1, mode).total_cmp(&distance(b.1, mode)));
        if let Some((nearest, _)) = nearest {
            numbers[nearest] = mode.mode;
        }
    }
    numbers
}

fn distance(reading: &ModeReading, mode: &ModeResult) -> f64 {
    (reading.frequency - mode.frequency).abs()
}

/// Returns true if a reading lies within the half lines of both and this share of the mode's frequency (1).
fn is_within(reading: &ModeReading, mode: &ModeResult, share: f64) -> bool {
    let half_lines = mode.half_line.unwrap_or(0.0) + reading.half_line;
    distance(reading, mode) <= half_lines + share * mode.frequency
}

/// Peaks without a number that lie nearer than this to a mode may be a part of its line (1, relative).
const OF_ITS_LINE: f64 = 0.01;

/// Returns true if a reading lies nearer to a peak without a number than to the mode, and is of all readings the
/// nearest to that peak. The peak must be apart from this mode.
fn is_of_another(
    reading: &ModeReading,
    mode: &ModeResult,
    modes: &[ModeResult],
    readings: &[ModeReading],
) -> bool {
    modes.iter().filter(|peak| peak.is_unpaired()).any(|peak| {
        let apart = (peak.frequency - mode.frequency).abs() > OF_ITS_LINE * mode.frequency;
        let own = distance(reading, peak);
        let mut others = readings.iter().filter(|other| other.label.is_none());
        apart && own < distance(reading, mode) && !others.any(|other| distance(other, peak) < own)
    })
}

/// A reading of another recording is of the same peak within its half lines and this: what merges
/// readings into one peak, and a little more.
const SAME_PEAK: f64 = 0.005;

/// Numbers the peaks of a jointed structure; in ascending order where nothing better can be had.
fn number_jointed(
    modes: &mut [ModeResult],
    candidates: &Candidates<'_>,
    structure: &TestedStructure,
    details: &StructureDetails,
) -> Vec<Warning> {
    let free = &candidates.which;
    let mut peaks = Vec::with_capacity(free.len());
    for &index in free {
        peaks.push(match candidates.shapes {
            Shapes::Recordings(recordings) => measured_peak(index, modes, recordings),
            Shapes::Elsewhere(shapes) => MeasuredPeak {
                frequency: modes[index].frequency,
                std: modes[index].std,
                shape: shapes.get(index).cloned().unwrap_or_default(),
                strength: None,
            },
        });
    }
    let fit = details.fit.as_deref().unwrap_or_default();
    let common_factor =
        fit.contains(&FitParameter::Modulus) || fit.contains(&FitParameter::Density);
    // The joint is estimated and held as the estimate has it.
    let units = StiffnessUnits::of(&structure.beam);
    let known = &structure.known;
    let joint = [Parameter::Kt, Parameter::Kr, Parameter::Coupling];
    let mut fit = fitted(structure, details);
    fit.retain(|parameter| joint.contains(parameter));
    let settings = PairingSettings {
        fit,
        held: [
            known.kx.map(|kx| kx.max(NO_SPRING) * units.kt),
            known.ky.map(|ky| ky.max(NO_SPRING) * units.kr),
            known.cross_compliance.map(|c| units.ktr / c),
        ],
        common_factor,
        bands: candidates.bands.clone(),
        ..PairingSettings::default()
    };
    let found = pair_modes(&jointed(structure, details), &peaks, &settings);
    let Some(pairing) = found.ok().filter(|_| !peaks.is_empty()) else {
        number_in_order(modes, free);
        return Vec::new();
    };
    let unnumbered = apply_numbers(modes, free, &pairing.chosen.numbers);
    let placed = candidates.sensors.iter();
    let names: BTreeSet<&String> = placed.clone().map(|(name, _)| name).collect();
    let inverted: BTreeSet<String> = placed
        .filter(|(_, place)| pairing.chosen.inverted.contains(place))
        .map(|(name, _)| name.clone())
        .collect();
    // The shapes of the model are those without masses.
    let fastened: f64 = details.masses.iter().map(|mass| mass.mass).sum();
    let sizes = match fastened > LIGHT * structure.beam.mass() {
        true => BTreeMap::new(),
        false => sizes_of_sensors(&pairing.chosen.sizes, &candidates.sensors),
    };
    [
        Warning::unpaired(unnumbered),
        Warning::missing_modes(&pairing.chosen.missing),
        Warning::ambiguous_pairing(&pairing, &peaks),
        Warning::inverted_sensors(&Vec::from_iter(inverted), names.len()),
        Warning::doubtful_scales(&sizes),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Masses below this share of the beam's (1) leave the sizes of modal constants about as they are. 20 %: at the end of a
/// cantilever, where it changes them most, such a mass halves those of the first mode.
const LIGHT: f64 = 0.2;

/// The sizes at the places of each sensor, by its name.
fn sizes_of_sensors(sizes: &[SizeAt], sensors: &[(String, f64)]) -> BTreeMap<String, Vec<SizeAt>> {
    let mut of_sensors: BTreeMap<String, Vec<SizeAt>> = BTreeMap::new();
    for size in sizes {
        let here = sensors.iter().filter(|(_, place)| *place == size.sensor);
        let at_place: BTreeSet<&String> = here.map(|(name, _)| name).collect();
        // Of two sensors at one place neither is known to have this size.
        if let (Some(name), 1) = (at_place.first(), at_place.len()) {
            of_sensors.entry((*name).clone()).or_default().push(*size);
        }
    }
    of_sensors
}

/// A peak with its shape and strength.
fn measured_peak(
    index: usize,
    modes: &[ModeResult],
    recordings: &[&RecordingResult],
) -> MeasuredPeak {
    let mode = &modes[index];
    let (mut shape, mut strength) = (Vec::new(), None::<f64>);
    for (group, recording) in (1..).zip(recordings) {
        // The recording's own reading of the peak.
        let readings = recording.readings().iter();
        let near = readings.filter(|one| one.label.is_none() && is_within(one, mode, SAME_PEAK));
        let nearest = near.min_by(|a, b| distance(a, mode).total_cmp(&distance(b, mode)));
        let Some(reading) = nearest else { continue };
        shape.extend(shape_in(recording, reading, group));
        // Where the reading is nearer to another peak, it is the other peak's.
        let own = distance(reading, mode);
        if !modes.iter().any(|other| distance(reading, other) < own) {
            // The recording that shows the peak best.
            let both = strength.iter().chain(&reading.strength).copied();
            strength = both.reduce(f64::max);
        }
    }
    MeasuredPeak {
        frequency: mode.frequency,
        std: mode.std,
        shape,
        strength,
    }
}

/// Shape of a reading's peak in its recording. Modal constants of all recordings share the hammer's unit; a
/// shape without them has one of its own, that of its `group`.
fn shape_in(recording: &RecordingResult, reading: &ModeReading, group: usize) -> Vec<ShapeAt> {
    let (shape, constant) = shape_of(reading, recording);
    let tap = recording.conditions.tap.filter(|_| constant.is_some());
    let unit = constant.filter(|_| tap.is_some()).map_or(1.0, |c| c.value);
    // The reference's own noise is in the constant.
    let least_std = constant.map_or(0.0, |c| c.std / c.value.abs());
    let mut values = Vec::with_capacity(shape.len());
    for value in shape {
        let response = recording.responses.get(value.sensor);
        let positions = &recording.conditions.sensor_positions;
        let Some(&sensor) = response.and_then(|response| positions.get(&response.name)) else {
            continue;
        };
        values.push(ShapeAt {
            sensor,
            tap,
            value: value.value * unit,
            std: value.std.max(least_std) * unit.abs(),
            group: if tap.is_some() { 0 } else { group },
        });
    }
    values
}

/// Numbers the readings of all recordings whose fastened masses differ from those of the first. The numbers follow
/// from the frequencies to which these masses take the reference configuration's modes. Where those are not known,
/// the readings lose the numbers of the nearest reference modes: a heavy mass takes a mode to another's place.
fn pair_mass_loaded(
    recordings: &mut [RecordingResult],
    modes: &[ModeResult],
    test: &TestDescription,
    structure: &TestedStructure,
    details: &StructureDetails,
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let first = test.recordings.first().map(|recording| &recording.masses);
    for (recording, described) in recordings.iter_mut().zip(&test.recordings) {
        if Some(&described.masses) == first {
            continue;
        }
        let loaded = StructureDetails {
            masses: masses_in(test, Some(described)),
            ..details.clone()
        };
        if let Some([before, after]) = frequencies(modes, structure, [details, &loaded]) {
            let mut moved = modes.to_vec();
            for mode in &mut moved {
                let place = mode.mode.and_then(|number| number.checked_sub(1));
                let ratio = place.and_then(|place| Some(after.get(place)? / before.get(place)?));
                mode.frequency *= ratio.unwrap_or(1.0);
            }
            recording.mode_numbers = own_numbers(&moved, recording.readings());
        } else {
            recording.mode_numbers.fill(None);
            warnings.push(Warning::unnumbered(&recording.file));
        }
    }
    warnings
}

/// Frequencies (Hz) of the structure without and with the other masses. The joint is the one estimated from the
/// reference's frequencies, else the described one; `None` where neither is known.
fn frequencies(
    modes: &[ModeResult],
    structure: &TestedStructure,
    both: [&StructureDetails; 2],
) -> Option<[Vec<f64>; 2]> {
    // Only the weights depend on the floor, and of these the numbering does not.
    let measured = measured_modes(modes, scatter_of(modes.iter()), FREQUENCY_FLOOR);
    let count = measured.last()?.mode;
    let there = both.map(|details| jointed(structure, details));
    let [before, after] = match estimator(structure, both[0], &measured) {
        Ok(estimator) => {
            let found = estimator.fit();
            there.map(|there| {
                let model = FrequencyModel::new(&there, count)?;
                let modes = (1..=count).map(|mode| model.response(&found.point, mode, mode as f64));
                Ok(modes.map(|mode| mode.frequency).collect())
            })
        }
        // A known joint leaves nothing to estimate.
        Err(_) => {
            let joint = structure.known.over(None)?;
            there.map(|there| frequencies_of(&there, &joint, count))
        }
    };
    Some([before.ok()?, after.ok()?])
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
            ..ModeResult::of(reading(frequency), "a.wav")
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
