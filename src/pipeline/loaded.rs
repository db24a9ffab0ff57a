//! Numbers of the modes in recordings that carry other masses than the reference configuration: a mass
//! moves frequencies further than a moved sensor, so that the reference's own say little of them.

use super::analysis::{ModeResult, RecordingResult};
use super::consistent::{StructureDetails, estimator, jointed, masses_in};
use super::identification::measured_modes;
use super::model::TestedStructure;
use super::modes::{own_numbers, own_readings};
use crate::description::{RecordingDescription, TestDescription};
use crate::identify::consistent::FrequencyModel;

/// Numbers the readings of all recordings with other fastened masses than the first, by the frequencies to
/// which these masses take the reference configuration's modes.
pub(super) fn number_loaded(
    recordings: &mut [RecordingResult],
    modes: &[ModeResult],
    test: &TestDescription,
    known: (&TestedStructure, &StructureDetails),
) {
    let first = test.recordings.first().map(|recording| &recording.masses);
    for (recording, described) in recordings.iter_mut().zip(&test.recordings) {
        if Some(&described.masses) == first {
            continue;
        }
        let Some(moved) = moved(modes, (test, described), known) else {
            continue;
        };
        recording.mode_numbers = own_numbers(&moved, &own_readings(recording));
    }
}

/// The modes at the frequencies of another recording: the joint as the reference's frequencies have it,
/// and the ratio that the masses on the beam make. `None` where they tell of no joint.
fn moved(
    modes: &[ModeResult],
    (test, recording): (&TestDescription, &RecordingDescription),
    (structure, details): (&TestedStructure, &StructureDetails),
) -> Option<Vec<ModeResult>> {
    let measured = measured_modes(modes);
    let count = measured.last()?.mode;
    let found = estimator(structure, details, &measured).ok()?.fit();
    let other = StructureDetails {
        masses: masses_in(test, Some(recording)),
        ..details.clone()
    };
    let model = |details| FrequencyModel::new(&jointed(structure, details), count).ok();
    let (before, after) = (model(details)?, model(&other)?);
    let frequency = |model: &FrequencyModel, mode: usize| {
        model.response(&found.point, mode, mode as f64).frequency
    };
    let moved = |one: &ModeResult| {
        let ratio = one.mode.map_or(1.0, |mode| {
            frequency(&after, mode) / frequency(&before, mode)
        });
        ModeResult {
            frequency: ratio * one.frequency,
            ..one.clone()
        }
    };
    Some(modes.iter().map(moved).collect())
}
