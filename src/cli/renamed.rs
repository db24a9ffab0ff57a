//! A test whose recordings have other names: what a diagnosis must not depend on.

use super::blind_check::{AGAIN, case_of};
use super::terminal::Terminal;
use anyhow::{Context, bail};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use tapjoint::description::TestDescription;
use tapjoint::study::blind_check::Case;

/// The first of the tests made elsewhere again, with their recordings under other names, as far as these can be
/// exchanged. Returns how many there were.
pub(super) fn check_names_elsewhere(
    folder: &Path,
    cases: &[Case],
    terminal: &Terminal,
) -> anyhow::Result<usize> {
    let mut again = 0;
    for (truth, answer) in cases {
        if again == AGAIN {
            break;
        }
        let place = folder.join(&truth.name);
        let copy = renamed(&place).unwrap_or_else(|error| {
            terminal.warn(&format!("{}: not renamed: {error:#}", place.display()));
            None
        });
        let Some(copy) = copy else {
            continue;
        };
        let text = fs::read_to_string(copy.path().join("test.toml"))?;
        let test = TestDescription::parse(&text, "test.toml")?;
        if case_of(&test, copy.path(), truth).1 != *answer {
            bail!(
                "the answer to {} depends on the names of its files",
                truth.name
            );
        }
        again += 1;
    }
    Ok(again)
}

/// A copy of a test with its recordings under other names; `None` where it has no recordings, one lies in another
/// folder, or the description names one in a way that cannot be exchanged.
fn renamed(folder: &Path) -> anyhow::Result<Option<tempfile::TempDir>> {
    let Ok(text) = fs::read_to_string(folder.join("test.toml")) else {
        return Ok(None);
    };
    let Ok(test) = TestDescription::parse(&text, "test.toml") else {
        return Ok(None);
    };
    let Some(names) = new_names(&test, folder) else {
        return Ok(None);
    };
    let Some(text) = exchanged(&text, &test, &names) else {
        return Ok(None);
    };
    let copy = tempfile::tempdir().context("no temporary folder can be made")?;
    for (file, name) in &names {
        fs::copy(folder.join(file), copy.path().join(name))?;
    }
    fs::write(copy.path().join("test.toml"), text)?;
    Ok(Some(copy))
}

/// A new name for each file, in another order than theirs; `None` without files, or where one is not in this folder.
fn new_names(test: &TestDescription, folder: &Path) -> Option<BTreeMap<String, String>> {
    let mut names = BTreeMap::new();
    for (number, recording) in test.recordings.iter().rev().enumerate() {
        let place = folder.join(&recording.file);
        if !place.is_file() || recording.file.components().count() > 1 {
            return None;
        }
        let file = recording.file.to_str()?.to_owned();
        let ending = place.extension().unwrap_or_default().to_str()?;
        names.insert(file, format!("renamed-{number:04}.{ending}"));
    }
    (!names.is_empty()).then_some(names)
}

/// The description with the new names in double or single quotation marks; `None` where it then names another file
/// still, which it wrote in another way.
fn exchanged(
    text: &str,
    test: &TestDescription,
    names: &BTreeMap<String, String>,
) -> Option<String> {
    let mut text = text.to_owned();
    for (file, name) in names {
        for mark in ['"', '\''] {
            text = text.replace(
                &format!("{mark}{file}{mark}"),
                &format!("{mark}{name}{mark}"),
            );
        }
    }
    let after = TestDescription::parse(&text, "test.toml").ok()?;
    let pairs = test.recordings.iter().zip(&after.recordings);
    let all = pairs.into_iter().all(|(before, after)| {
        let name = before.file.to_str().and_then(|file| names.get(file));
        name.is_some_and(|name| after.file == Path::new(name))
    });
    all.then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with a description that ends so, and with these recordings.
    fn folder(ending: &str, files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let beam = "[beam]\nlength = \"423 mm\"\nwidth = \"40 mm\"\nthickness = \"4 mm\"\n\
                    modulus = \"200 GPa\"\ndensity = 7850\n[joint]\nkind = \"cantilever\"\n";
        fs::write(folder.path().join("test.toml"), format!("{beam}{ending}")).unwrap();
        for file in files {
            fs::write(folder.path().join(file), file).unwrap();
        }
        folder
    }

    #[test]
    fn regress_files_are_renamed_however_they_are_quoted_and_however_many() {
        let names: Vec<String> = (0..102).map(|k| format!("r{k}.wav")).collect();
        let quoted = |(k, name): (usize, &String)| {
            let mark = ["\"", "'"][k % 2];
            format!("[[recording]]\nfile = {mark}{name}{mark}\n")
        };
        let text: String = names.iter().enumerate().map(quoted).collect();
        let files: Vec<&str> = names.iter().map(String::as_str).collect();
        let copy = renamed(folder(&text, &files).path()).unwrap().unwrap();
        let text = fs::read_to_string(copy.path().join("test.toml")).unwrap();
        let test = TestDescription::parse(&text, "test.toml").unwrap();
        assert_eq!(test.recordings.len(), 102);
        for (recording, file) in test.recordings.iter().zip(files) {
            let content = fs::read_to_string(copy.path().join(&recording.file));
            assert_eq!(content.unwrap(), file);
            assert!(recording.file.to_str().unwrap().starts_with("renamed-"));
        }
    }

    #[test]
    fn regress_a_test_without_recordings_and_one_that_is_no_text_are_not_renamed() {
        let measured = folder("[measured]\nfrequencies = [17, 118]\n", &[]);
        assert!(renamed(measured.path()).unwrap().is_none());
        // A name that TOML spells with an escape.
        let escaped = folder("[[recording]]\nfile = \"\\u0061.wav\"\n", &["a.wav"]);
        assert!(renamed(escaped.path()).unwrap().is_none());
        fs::write(measured.path().join("test.toml"), [0xff, 0xfe]).unwrap();
        assert!(renamed(measured.path()).unwrap().is_none());
    }
}
