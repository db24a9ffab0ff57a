//! The test of the same bar without its joint: a description of its own, named by `free_test`.

use super::reader::{DescriptionError, Source, Table, with_unit};
use super::{Assembly, TestDescription, described_beam};
use std::path::PathBuf;

/// The description of a test of the same bar without its joint.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FreeTestFile {
    /// File as written in the description, relative to it.
    pub path: PathBuf,
    /// Line of the description that names the file.
    pub line: usize,
}

impl FreeTestFile {
    /// Returns the error of a free test that cannot be used. It points to the line that names the file.
    pub fn error(&self, description: &str, problem: impl Into<String>) -> DescriptionError {
        Source::new(description, "").error(self.line, "beam.free_test", problem)
    }

    /// Checks that `free` describes the bar of `test`, free at both ends. Messages call the file of `test` `description`.
    ///
    /// # Errors
    /// A bar with a joint, or with other properties.
    pub fn check(
        &self,
        description: &str,
        test: &TestDescription,
        free: &TestDescription,
    ) -> Result<(), DescriptionError> {
        let file = self.path.display();
        if free.joint.kind != Assembly::Free {
            return Err(self.error(
                description,
                format!(
                    "{file} describes a bar with a joint; a free test is a description with `kind = \"free\"` in [joint]"
                ),
            ));
        }
        let differences = differences(test, free);
        if differences.is_empty() {
            return Ok(());
        }
        Err(self.error(
            description,
            format!(
                "{file} describes another bar: {}; state the same bar in both, or remove `free_test`",
                differences.join("; ")
            ),
        ))
    }
}

/// Returns what two descriptions of one bar state differently, in words.
fn differences(test: &TestDescription, free: &TestDescription) -> Vec<String> {
    // Two ways of writing one number: "5 mm" and 0.005.
    const ROUNDING: f64 = 1e-9;
    let (here, there) = (described_beam(test), described_beam(free));
    let mut compared = vec![
        ("width", here.width, there.width, "m"),
        ("thickness", here.thickness, there.thickness, "m"),
        ("modulus", here.modulus, there.modulus, "Pa"),
        ("poisson", here.poisson, there.poisson, ""),
    ];
    // A density that follows from the weight is no statement of its own.
    if test.beam.density_stated && free.beam.density_stated {
        compared.push(("density", here.density, there.density, "kg/m3"));
    }
    // The bar may reach into its clamp, so it is at least as long as its free part. A weighed bar has the stated length.
    let whole = test.beam.bar_length;
    let (key, length) = match (whole, test.beam.weighed) {
        (Some(whole), _) => ("bar_length", whole),
        (None, Some(_)) => ("length of the weighed bar", here.length),
        (None, None) => ("length", here.length.max(there.length)),
    };
    compared.push((key, length, there.length, "m"));
    let different = compared
        .into_iter()
        .filter(|(_, here, there, _)| (here - there).abs() > ROUNDING * here.abs());
    let words = different.map(|(key, here, there, unit)| {
        let [here, there] = [here, there].map(|value| with_unit(value, unit));
        format!("{key} {here} here, {there} there")
    });
    words.collect()
}

/// Reads the name of the free bar's own description.
pub(super) fn read_free_test(table: &Table<'_>) -> Result<Option<FreeTestFile>, DescriptionError> {
    let Some(entry) = table.get("free_test") else {
        return Ok(None);
    };
    for key in ["free_frequencies", "free_std"] {
        if let Some(other) = table.get(key) {
            return Err(entry.error(format!(
                "the free bar's frequencies come from its own test or from `{key}` (line {}), not from both; remove one of \
                 them",
                other.line
            )));
        }
    }
    Ok(Some(FreeTestFile {
        path: PathBuf::from(entry.text("the name of a test description such as \"free.toml\"")?),
        line: entry.line,
    }))
}
