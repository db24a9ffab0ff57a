//! The model with what a diagnosis found, for report.json and as a file.

use super::input::TestFile;
use anyhow::anyhow;
use tapjoint::description::TestDescription;
use tapjoint::gap::{Diagnosis, GapError};
use tapjoint::pipeline::Analysis;
use tapjoint::report::MODEL_FILE;
use tapjoint::report::document::{GapSection, UpdatedModelSection};
use tapjoint::study::updated_model::{DescribedEffectError, described_frequencies, updated_model};

/// "FILE:LINE: what is wrong with the effect that is described there", or with the structure of the file.
pub(super) fn effect_at(file: &str, error: &DescribedEffectError) -> anyhow::Error {
    match error.line {
        Some(line) => anyhow!("{file}:{line}: {}", error.cause),
        None => anyhow!("{file}: {}", error.cause),
    }
}

/// Adds the model that a diagnosis makes of the described one to the section of report.json, and returns its
/// text, which is written under `name` if that is given; `None` where there is no such model.
pub(super) fn add_model(
    gap: &mut GapSection,
    (file, name): (&TestFile, Option<String>),
    (analysis, diagnosis): (&Analysis, Result<&Diagnosis, &GapError>),
) -> Option<String> {
    let model = updated_model(&file.test, diagnosis.ok()?)?;
    let highest = analysis.modes.iter().filter_map(|mode| mode.mode).max()?;
    // Read back, so that report.json holds what the file gives.
    let written = TestDescription::parse(&model.text, MODEL_FILE).ok()?;
    let frequencies = described_frequencies(&written, highest).ok()?;
    gap.updated_model = Some(UpdatedModelSection {
        effect: model.hypothesis,
        file: name,
        frequencies,
    });
    Some(model.text)
}
