//! The numbered modes of a test: its recordings of each free length, or its frequencies read elsewhere. Where the clamp was
//! moved the beam has other modes, on the same joint.
//!
//! Each length is numbered as a test of its own. The frequencies of all lengths enter one estimate.

use super::mode_file::read_modes;
use super::modes::{modes_of_file, modes_of_measured, modes_of_test, set_aside};
use super::recording_result::RecordingResult;
use super::results::{ModeResult, MovedLength};
use super::stages::{Stage, Watch, Work};
use super::structure::{
    StructureDetails, TestedStructure, jointed, structure_details, tested_structure,
};
use super::warnings::Warning;
use super::wiring::{PipelineError, measure_test};
use std::path::Path;
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

/// Everything that is measured of a test: its recordings, or the frequencies that it or its file of modes gives.
pub(super) struct MeasuredTest {
    /// Recordings, in the order of the description.
    pub(super) recordings: Vec<RecordingResult>,
    /// The numbered modes.
    pub(super) numbered: NumberedTest,
    /// Doubts about description, recordings and numbers.
    pub(super) warnings: Vec<Warning>,
}

/// Measures the recordings of a described test, or reads its frequencies, and numbers the modes. `place` is the folder in
/// which files are looked for and the description's own name, for messages.
pub(super) fn measured_modes_of(
    test: &TestDescription,
    place: (&Path, &str),
    structure: &TestedStructure,
    details: &StructureDetails,
    watch: &dyn Watch,
) -> Result<MeasuredTest, PipelineError> {
    let mut recordings = measure_test(test, place.0, place.1, watch)?;
    let _work = Work::begin(watch, Stage::Numbers);
    let doubts = test.warnings.iter();
    let mut warnings: Vec<Warning> = doubts.map(Warning::of_description).collect();
    for recording in &recordings {
        warnings.extend_from_slice(&recording.measurement.warnings);
    }
    let mut found = numbered(test, &mut recordings, structure, details);
    if let Some(measured) = &test.measured {
        match &measured.file {
            Some(file) => {
                let read = read_modes(test, measured, file, place.0, place.1)?;
                (found.modes, found.warnings) = modes_of_file(&read, structure, details);
                warnings.extend(read.warnings);
            }
            None => found.modes = modes_of_measured(measured, structure),
        }
    }
    warnings.append(&mut found.warnings);
    Ok(MeasuredTest {
        recordings,
        numbered: found,
        warnings,
    })
}

/// Merges and numbers the readings of the recordings, those of each free length apart from the others.
fn numbered(
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
        let aside = set_aside(&own_test.recordings, &own);
        if let Some(length) = length {
            let structure = tested_structure(&own_test);
            let details_of_length = structure_details(&own_test, &structure.beam);
            let (modes, doubts) =
                modes_of_test(&own_test, &mut own, &aside, &structure, &details_of_length);
            let doubts = doubts.into_iter();
            let doubts = doubts.map(|doubt| doubt.of_part(&length_words(length)));
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
