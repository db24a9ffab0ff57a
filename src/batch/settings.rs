//! One test of a batch, and the settings of all.

use crate::journal::Key;
use sha2::{Digest, Sha256};
use std::path::PathBuf;
use tapjoint_analysis::BareSettings;
use tapjoint_description::TestDescription;

/// One test: what is analysed, and its name in the tables.
#[derive(Debug, Clone)]
pub struct BatchTest {
    /// The description or the recording, as the user named it. It is the name of the test in all tables.
    pub file: String,
    /// What is analysed.
    pub subject: Subject,
    /// Cells of the input table that go into the row of the test as they are.
    pub carried: Vec<String>,
}

impl BatchTest {
    /// Returns the names of the files that it reads, as messages name them.
    pub fn file_names(&self) -> Vec<String> {
        match &self.subject {
            Subject::Described(described) => described.file_names(),
            Subject::Bare(path) => vec![path.display().to_string()],
        }
    }
}

/// What is analysed.
#[derive(Debug, Clone)]
pub enum Subject {
    /// A test that a description describes.
    Described(Box<DescribedTest>),
    /// A recording, or a file of functions.
    Bare(PathBuf),
}

/// A description with all that belongs to it.
#[derive(Debug, Clone)]
pub struct DescribedTest {
    /// The description.
    pub test: TestDescription,
    /// Its file, for messages.
    pub name: String,
    /// The folder in which its recordings are looked for.
    pub folder: PathBuf,
    /// The description of the free bar's test, where `free_test` names one.
    pub free: Option<Box<DescribedTest>>,
}

impl DescribedTest {
    fn file_names(&self) -> Vec<String> {
        let recordings = self.test.recordings.iter();
        let recordings = recordings.flat_map(|recording| recording.files());
        let mut names = vec![self.name.clone()];
        names.extend(recordings.map(|file| self.folder.join(file).display().to_string()));
        names.extend(self.free.iter().flat_map(|free| free.file_names()));
        names
    }
}

/// Settings of all tests of a batch.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchSettings {
    /// True to diagnose each described test.
    pub diagnosis: bool,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Settings for files without a description.
    pub bare: BareSettings,
}

impl Default for BatchSettings {
    fn default() -> Self {
        Self {
            diagnosis: true,
            seed: 1,
            bare: BareSettings::default(),
        }
    }
}

/// A file that a test reads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputFile {
    /// Its name, as the test names it.
    pub name: String,
    /// SHA-256 of its bytes; `None` of a file that cannot be read.
    pub sha256: Option<[u8; 32]>,
}

impl BatchSettings {
    /// Returns the key of a test: equal keys have equal records. It depends on the name of the test, on the bytes of all its
    /// files, on the carried cells, on these settings, and on the version of the program.
    pub fn key(&self, file: &str, carried: &[String], inputs: &[InputFile]) -> Key {
        let mut sum = Sha256::new();
        let mut add = |part: &[u8]| {
            // The length keeps neighbouring parts apart.
            sum.update((part.len() as u64).to_le_bytes());
            sum.update(part);
        };
        add(env!("CARGO_PKG_VERSION").as_bytes());
        add(format!("{self:?}").as_bytes());
        add(file.as_bytes());
        add(&(carried.len() as u64).to_le_bytes());
        for cell in carried {
            add(cell.as_bytes());
        }
        for input in inputs {
            add(input.name.as_bytes());
            add(input.sha256.as_ref().map_or(&[], |sha256| &sha256[..]));
        }
        Key(sum.finalize().into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_key_depends_on_everything_that_changes_the_record() {
        let settings = BatchSettings::default();
        let input = |name: &str, sum: Option<u8>| InputFile {
            name: name.to_owned(),
            sha256: sum.map(|byte| [byte; 32]),
        };
        let own = settings.key("a", &["x".to_owned()], &[input("a.wav", Some(1))]);
        let same = settings.key("a", &["x".to_owned()], &[input("a.wav", Some(1))]);
        assert_eq!(own, same);
        let without = BatchSettings {
            diagnosis: false,
            ..settings.clone()
        };
        let others = [
            settings.key("b", &["x".to_owned()], &[input("a.wav", Some(1))]),
            settings.key("a", &[], &[input("a.wav", Some(1))]),
            settings.key("a", &["x".to_owned()], &[input("a.wav", Some(2))]),
            settings.key("a", &["x".to_owned()], &[input("a.wav", None)]),
            settings.key("a", &["x".to_owned()], &[input("b.wav", Some(1))]),
            without.key("a", &["x".to_owned()], &[input("a.wav", Some(1))]),
        ];
        for other in others {
            assert_ne!(own, other);
        }
    }
}
