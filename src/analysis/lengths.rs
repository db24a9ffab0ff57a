//! The recordings of each free length: where the clamp was moved the beam has other modes, on the same joint.
//!
//! Each length is numbered as a test of its own. The frequencies of all lengths enter one estimate.

use super::modes::{modes_of_test, set_aside};
use super::recording_result::RecordingResult;
use super::results::{ModeResult, MovedLength};
use super::structure::{
    StructureDetails, TestedStructure, jointed, structure_details, tested_structure,
};
use super::warnings::Warning;
use tapjoint_beam::specimen::PointMass;
use tapjoint_description::TestDescription;
use tapjoint_identify::consistent::AttachmentTolerance;

/// A free length (m) in words, to the micrometre.
fn length_words(length: f64) -> String {
    format!("free length {} m", (1e6 * length).round() / 1e6)
}

/// Returns the uncertainties of the masses of another free length. A mass under a name that is `known` is the same one; a
/// fastened mass that differs from it has a name of its own.
fn attachments_of(
    own: &StructureDetails,
    length: f64,
    known: &[(&AttachmentTolerance, &PointMass)],
) -> Vec<AttachmentTolerance> {
    let all = own.attachments.iter().zip(&own.masses);
    let named = all.map(|(tolerance, load)| {
        let mut known = known.iter();
        let is_other = known.any(|(other, there)| {
            other.name == tolerance.name && (there.mass / load.mass - 1.0).abs() > SAME_MASS
        });
        let mut tolerance = tolerance.clone();
        if is_other {
            tolerance.name = format!("{}, {}", tolerance.name, length_words(length));
        }
        tolerance
    });
    named.collect()
}

/// Masses of one name that differ by more than this share are two.
const SAME_MASS: f64 = 1e-6;

/// The numbered modes of a test.
pub(super) struct NumberedTest {
    /// Modes of the beam as described.
    pub(super) modes: Vec<ModeResult>,
    /// Modes of the other free lengths.
    pub(super) lengths: Vec<MovedLength>,
    /// Difference of each recording from the first.
    pub(super) aside: Vec<Option<String>>,
    /// Doubts about the numbers.
    pub(super) warnings: Vec<Warning>,
}

/// Merges and numbers the readings of the recordings, those of each free length apart from the others.
pub(super) fn numbered(
    test: &TestDescription,
    recordings: &mut Vec<RecordingResult>,
    structure: &TestedStructure,
    details: &StructureDetails,
) -> NumberedTest {
    let mut found = NumberedTest {
        modes: Vec::new(),
        lengths: Vec::new(),
        aside: vec![None; recordings.len()],
        warnings: Vec::new(),
    };
    let described = test.recordings.iter();
    let own_lengths: Vec<Option<f64>> = described.map(|recording| recording.length).collect();
    let mut all: Vec<Option<RecordingResult>> = recordings.drain(..).map(Some).collect();
    let moved = test.moved_lengths().into_iter().map(Some);
    for length in [None].into_iter().chain(moved) {
        let of_length = (0..all.len()).filter(|&index| own_lengths[index] == length);
        let places: Vec<usize> = of_length.collect();
        let taken = places.iter().filter_map(|&place| all[place].take());
        let mut own: Vec<RecordingResult> = taken.collect();
        let own_test = test.of_length(length);
        let aside = set_aside(&own_test, &own);
        if let Some(length) = length {
            let structure = tested_structure(&own_test);
            let details_of_length = structure_details(&own_test, &structure.beam);
            let (modes, doubts) =
                modes_of_test(&own_test, &mut own, &aside, &structure, &details_of_length);
            let doubts = doubts.into_iter();
            let doubts = doubts.map(|doubt| doubt.of_length(&length_words(length)));
            found.warnings.extend(doubts);
            let used = own.iter().zip(&aside).filter(|(_, aside)| aside.is_none());
            let described = details.attachments.iter().zip(&details.masses);
            let earlier = found.lengths.iter();
            let earlier = earlier.flat_map(|one| one.attachments.iter().zip(&one.structure.masses));
            let known: Vec<_> = described.chain(earlier).collect();
            let attachments = attachments_of(&details_of_length, length, &known);
            found.lengths.push(MovedLength {
                length,
                recordings: used.map(|(recording, _)| recording.file.clone()).collect(),
                attachments,
                structure: jointed(&structure, &details_of_length),
                modes,
            });
        } else {
            let (modes, doubts) = modes_of_test(&own_test, &mut own, &aside, structure, details);
            found.modes = modes;
            found.warnings.extend(doubts);
        }
        for ((place, own), aside) in places.into_iter().zip(own).zip(aside) {
            all[place] = Some(own);
            let words: Vec<String> = length.map(length_words).into_iter().chain(aside).collect();
            found.aside[place] = (!words.is_empty()).then(|| words.join(", "));
        }
    }
    recordings.extend(all.into_iter().flatten());
    found
}
