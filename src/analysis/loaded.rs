//! Numbers of the modes in recordings that carry other masses than the reference configuration: a mass
//! moves frequencies further than a moved sensor, so that the reference's own say little of them.

use super::analysis::{ModeResult, RecordingResult};
use super::consistent::{StructureDetails, estimator, frequencies_of, jointed, masses_in};
use super::identification::measured_modes;
use super::model::TestedStructure;
use super::modes::{own_numbers, own_readings};
use super::warning::Warning;
use tapjoint_description::{RecordingDescription, TestDescription};
use tapjoint_identify::FREQUENCY_FLOOR;
use tapjoint_identify::consistent::FrequencyModel;

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
