//! The model with what a diagnosis found, for the report and as a file.

use super::input::TestFile;
use tapjoint::description::TestDescription;
use tapjoint::gap::{Diagnosis, GapError};
use tapjoint::pipeline::Analysis;
use tapjoint::report::MODEL_FILE;
use tapjoint::report::document::{GapSection, UpdatedModelSection};
use tapjoint::study::updated_model::{described_effects, frequencies_with, updated_model};

/// Adds the model that a diagnosis makes of the described one to the report's section, and returns its
/// text, which is written under `name` if that is given; `None` where there is no such model.
pub(super) fn add_model(
    gap: &mut GapSection,
    (file, name): (&TestFile, Option<String>),
    (analysis, diagnosis): (&Analysis, Result<&Diagnosis, &GapError>),
) -> Option<String> {
    let model = updated_model(&file.test, diagnosis.ok()?)?;
    let highest = analysis.modes.iter().filter_map(|mode| mode.mode).max()?;
    // Read back, so that the report shows what the file gives.
    let written = TestDescription::parse(&model.text, MODEL_FILE).ok()?;
    let effects = described_effects(&written).ok()?;
    let frequencies = frequencies_with(&written, &effects, None, highest).ok()?;
    gap.updated_model = Some(UpdatedModelSection {
        effect: model.hypothesis,
        file: name,
        frequencies,
    });
    Some(model.text)
}
