//! The tests of a blind check as files: written, listed by a truth file, and copied under other names.

use super::output::failed;
use super::terminal::Terminal;
use crate::description::TestDescription;
use crate::recording::{WavFormat, encode_wav};
use crate::study::blind_check::RecordedTest;
use anyhow::{Context, bail};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Number of tests that are diagnosed again under other names.
pub(super) const AGAIN: usize = 3;

/// Writes a test into a folder; `shown` is its name in messages.
pub(super) fn write_test(
    recorded: &RecordedTest,
    folder: &Path,
    shown: &Path,
) -> anyhow::Result<()> {
    fs::create_dir_all(folder).map_err(|cause| failed(shown, &cause))?;
    write_file(folder, shown, "test.toml", recorded.description.as_bytes())?;
    for recording in &recorded.recordings {
        let mut bytes = Vec::new();
        encode_wav(
            &recording.file,
            Cursor::new(&mut bytes),
            recording.sample_rate,
            &recording.channels,
            WavFormat::Pcm24,
        )?;
        write_file(folder, shown, &recording.file, &bytes)?;
    }
    Ok(())
}

/// Writes a file of a test; `shown` is its folder in messages.
fn write_file(folder: &Path, shown: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    fs::write(folder.join(name), bytes).map_err(|cause| failed(&shown.join(name), &cause))
}

/// Gives a test and its recordings other names; `name` is that of the test.
pub(super) fn rename_recordings(recorded: &mut RecordedTest, seed: u64, name: &str) {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    let mut numbers: Vec<usize> = (10..10 + recorded.recordings.len()).collect();
    numbers.shuffle(&mut random);
    for (recording, number) in recorded.recordings.iter_mut().zip(numbers) {
        let name = format!("{:08x}{number}.wav", random.next_u32());
        recorded.description = recorded.description.replace(&recording.file, &name);
        recording.file = name;
    }
    recorded.description = recorded.description.replace(name, "another");
}

/// Existing tests that a truth file names.
pub(super) struct Listed<'a> {
    /// The truth file.
    pub(super) truth: &'a Path,
    /// What each folder holds: "test" or "pair".
    pub(super) what: &'static str,
    /// Names of the folders.
    pub(super) names: &'a [&'a str],
    /// Descriptions that each folder has.
    pub(super) descriptions: &'a [&'static str],
}

impl Listed<'_> {
    /// Warns of folders that the truth file does not name.
    ///
    /// # Errors
    /// A folder lacks a description.
    pub(super) fn check(&self, folder: &Path, terminal: &Terminal) -> anyhow::Result<()> {
        let (truth, what) = (self.truth.display(), self.what);
        for name in self.names {
            for description in self.descriptions {
                let path = folder.join(name).join(description);
                if !path.is_file() {
                    bail!(
                        "{}: is missing, but {truth} names the {what} \"{name}\"; each {what} is a folder of that \
                         name with {}",
                        path.display(),
                        self.descriptions.join(" and ")
                    );
                }
            }
        }
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let mut unlisted: Vec<String> = entries
            .filter(|entry| entry.path().join(self.descriptions[0]).is_file())
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .filter(|name| !self.names.contains(&name.as_str()))
            .collect();
        unlisted.sort();
        for name in unlisted {
            terminal.warn(&format!(
                "{}: {truth} does not name this {what}, so it is left out",
                folder.join(name).display()
            ));
        }
        Ok(())
    }
}

/// Returns a copy of a test with its recordings under other names.
///
/// `None` if it has no recordings, one lies in another folder, or the description names one in a form that
/// cannot be exchanged.
pub(super) fn renamed(folder: &Path) -> anyhow::Result<Option<tempfile::TempDir>> {
    let Ok(text) = fs::read_to_string(folder.join("test.toml")) else {
        return Ok(None);
    };
    let Ok(test) = TestDescription::parse(&text, "test.toml") else {
        return Ok(None);
    };
    // The new names are in another order than the files.
    let mut names = BTreeMap::new();
    let mut files: Vec<&PathBuf> = Vec::new();
    for recording in &test.recordings {
        files.extend(recording.files());
    }
    for (number, path) in files.into_iter().rev().enumerate() {
        let ending = path.extension().unwrap_or_default();
        let (Some(file), Some(ending)) = (path.to_str(), ending.to_str()) else {
            return Ok(None);
        };
        if !folder.join(file).is_file() || path.components().count() > 1 {
            return Ok(None);
        }
        names.insert(file.to_owned(), format!("renamed-{number:04}.{ending}"));
    }
    let Some(text) = exchanged(&text, &test, &names).filter(|_| !names.is_empty()) else {
        return Ok(None);
    };
    let copy = tempfile::tempdir().context("no temporary folder can be made")?;
    for (file, name) in &names {
        fs::copy(folder.join(file), copy.path().join(name))?;
    }
    fs::write(copy.path().join("test.toml"), text)?;
    Ok(Some(copy))
}

/// Returns the description with the new names, in double or single quotation marks. `None` if it still names an
/// old file, which it spells in another way.
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
    let [before, after] =
        [test, &after].map(|test| test.recordings.iter().flat_map(|one| one.files()));
    let all = before.zip(after).all(|(before, after)| {
        let name = before.to_str().and_then(|file| names.get(file));
        name.is_some_and(|name| after == Path::new(name))
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
