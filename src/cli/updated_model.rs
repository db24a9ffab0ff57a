//! The model with the diagnosed effects, for report.json and as a file.

use super::input::TestFile;
use anyhow::anyhow;
use tapjoint::description::TestDescription;
use tapjoint::gap::Diagnosis;
use tapjoint::pipeline::Analysis;
use tapjoint::report::MODEL_FILE;
use tapjoint::report::document::{GapSection, UpdatedModelSection};
use tapjoint::study::updated_model::{DescribedEffectError, described_frequencies, updated_model};

/// Returns the error of a described effect with its file and line.
pub(super) fn effect_at(file: &str, error: &DescribedEffectError) -> anyhow::Error {
    match error.line {
        Some(line) => anyhow!("{file}:{line}: {}", error.cause),
        None => anyhow!("{file}: {}", error.cause),
    }
}

/// Adds the model with the diagnosed effects to a section of report.json, and returns its text; `None` without
/// such a model. `name` is the name of the file that will hold the text.
pub(super) fn add_model(
    gap: &mut GapSection,
    file: &TestFile,
    name: Option<String>,
    analysis: &Analysis,
    diagnosis: Option<&Diagnosis>,
) -> Option<String> {
    let model = updated_model(&file.test, diagnosis?)?;
    let highest = analysis.modes.iter().filter_map(|mode| mode.mode).max()?;
    // The text is read back, so that report.json holds the frequencies of the file.
    let written = TestDescription::parse(&model.text, MODEL_FILE).ok()?;
    let frequencies = described_frequencies(&written, highest).ok()?;
    gap.updated_model = Some(UpdatedModelSection {
        effect: model.hypothesis,
        file: name,
        frequencies,
    });
    Some(model.text)
}
