//! What a test description gives the study.

use super::StudiedTest;
use tapjoint_analysis::{TestedStructure, structure_details};
use tapjoint_beam::{Assembly, JointStiffness};
use tapjoint_description::TestDescription;

/// Modes studied where the description says nothing: those of Ingole & Chatterjee.
const USUAL_MODES: usize = 5;

impl StudiedTest {
    /// The described test about this joint (1), in `bands` (Hz) or, where there are none, in those of its
    /// recordings. Tap and sensors are those of the first recording; where nobody said, both are at the
    /// free right end, where no mode has a node.
    pub fn of_description(
        test: &TestDescription,
        structure: &TestedStructure,
        joint: JointStiffness,
        bands: &[(f64, f64)],
    ) -> Self {
        let first = test.recordings.first();
        let end = structure.beam.length;
        let sensors: Vec<f64> = test
            .sensors
            .iter()
            .filter_map(|sensor| test.place_of(sensor))
            .collect();
        let described = test
            .recordings
            .iter()
            .filter_map(|recording| recording.band);
        let measured = test.measured.as_ref();
        StudiedTest {
            structure: *structure,
            details: structure_details(test, &structure.beam),
            joint: match structure.assembly {
                Assembly::Free => JointStiffness::FREE,
                Assembly::Cantilever | Assembly::Lap => joint,
            },
            tap: first.and_then(|recording| recording.tap).unwrap_or(end),
            sensors: if sensors.is_empty() {
                vec![end]
            } else {
                sensors
            },
            bands: if bands.is_empty() {
                described.collect()
            } else {
                bands.to_vec()
            },
            modes: measured
                .and_then(|measured| measured.modes.iter().copied().max())
                .or(test.analysis.fit_modes)
                .unwrap_or(USUAL_MODES),
            fit_modes: test.analysis.fit_modes,
        }
    }
}
