//! A test whose recordings have other names: what a diagnosis must not depend on.

use anyhow::Context;
use std::fs;
use std::path::Path;
use tapjoint::description::TestDescription;

/// A copy of a test with its recordings under other names; `None` where a recording lies in another folder.
pub(super) fn renamed(folder: &Path) -> anyhow::Result<Option<tempfile::TempDir>> {
    let copy = tempfile::tempdir().context("no temporary folder can be made")?;
    let mut text = fs::read_to_string(folder.join("test.toml"))?;
    let Ok(test) = TestDescription::parse(&text, "test.toml") else {
        return Ok(None);
    };
    for (number, recording) in test.recordings.iter().enumerate() {
        let place = folder.join(&recording.file);
        if !place.is_file() || recording.file.components().count() > 1 {
            return Ok(None);
        }
        let file = recording.file.to_string_lossy();
        let ending = place.extension().unwrap_or_default().to_string_lossy();
        // Another order than theirs, too.
        let name = format!("renamed-{:02}.{ending}", 99 - number);
        fs::copy(&place, copy.path().join(&name))?;
        text = text.replace(&format!("\"{file}\""), &format!("\"{name}\""));
    }
    fs::write(copy.path().join("test.toml"), text)?;
    Ok(Some(copy))
}
