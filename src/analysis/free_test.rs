//! The same bar measured without its joint: its recordings are measured as those of any test, and its frequencies are data
//! of the joint's estimate.

use super::lengths::measured_modes_of;
use super::recording_result::RecordingResult;
use super::results::{ModeResult, measured_modes, scatter_of};
use super::stages::Watch;
use super::structure::{jointed, structure_details, tested_structure};
use super::warnings::Warning;
use super::wiring::PipelineError;
use std::path::Path;
use tapjoint_beam::{Assembly, Beam};
use tapjoint_description::{TestDescription, described_beam};
use tapjoint_identify::FREQUENCY_FLOOR;
use tapjoint_identify::consistent::{JointedStructure, MovedClamp};

/// A measured test of the free bar.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeTest {
    /// Its description, as the joint's test names it.
    pub file: String,
    /// Its recordings.
    pub recordings: Vec<RecordingResult>,
    /// Its resonances, ascending.
    pub modes: Vec<ModeResult>,
    /// The bar with the masses on it, and the modes that enter the estimate.
    pub bar: MovedClamp,
    /// Doubts about its description, its recordings and the numbers of its modes.
    pub warnings: Vec<Warning>,
}

/// Reasons for which a test of the free bar gives no data.
#[derive(Debug, thiserror::Error)]
pub enum FreeTestError {
    /// Its recordings could not be measured.
    #[error(transparent)]
    Measurement(#[from] PipelineError),
    /// No peak is a mode of the bar.
    #[error(
        "{file}: no mode of the free bar was found; look at it with `tapjoint run {file}`, or remove `free_test`"
    )]
    NoModes {
        /// Description of the free test.
        file: String,
    },
    /// No mode has an uncertainty, by which it could be weighed against others.
    #[error(
        "{file}: mode {mode} has no standard uncertainty; state `half_line`, `std` or `scatter` in [measured], or tap more often"
    )]
    NoUncertainty {
        /// Description of the free test.
        file: String,
        /// The first mode.
        mode: usize,
    },
}

/// Measures the free bar of a `test` by its own description, `free`. `place` is the folder of that description and its name,
/// for messages. The stages are announced to `watch`.
///
/// # Errors
/// [`FreeTestError`]: recordings that cannot be analysed, no modes, or modes without an uncertainty.
pub fn measure_free_test(
    test: &TestDescription,
    free: &TestDescription,
    place: (&Path, &str),
    watch: &dyn Watch,
) -> Result<FreeTest, FreeTestError> {
    let structure = tested_structure(free);
    let details = structure_details(free, &structure.beam);
    let measured = measured_modes_of(free, place, &structure, &details, watch)?;
    let modes = measured.numbered.modes;
    let file = place.1.to_owned();
    let mut used = measured_modes(&modes, scatter_of(modes.iter()), FREQUENCY_FLOOR);
    used.truncate(free.analysis.fit_modes.unwrap_or(usize::MAX));
    let Some(first) = used.first().map(|mode| mode.mode) else {
        return Err(FreeTestError::NoModes { file });
    };
    used.retain(|mode| mode.std.is_some_and(|std| std > 0.0));
    if used.is_empty() {
        return Err(FreeTestError::NoUncertainty { file, mode: first });
    }
    // The bar that both tests have in common, by the theory of the joint's test.
    let bar = Beam {
        length: structure.beam.length,
        ..described_beam(test)
    };
    let bar = JointedStructure::new(test.joint.beam, bar, Assembly::Free);
    let words = format!("free test {file}");
    let warnings = measured.warnings.into_iter();
    Ok(FreeTest {
        file,
        recordings: measured.recordings,
        modes,
        bar: MovedClamp {
            structure: JointedStructure {
                masses: jointed(&structure, &details).masses,
                ..bar
            },
            modes: used,
            attachments: details.attachments,
        },
        warnings: warnings.map(|warning| warning.of_part(&words)).collect(),
    })
}
