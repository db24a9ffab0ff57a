//! Reading test descriptions from files.

use super::terminal::Terminal;
use crate::description::{FreeTestFile, TestDescription};
use crate::pipeline::{
    Analysis, FreeTest, IdentifySettings, Watch, measure_free_test, run_test_watched,
};
use crate::study::updated_model::DescribedEffectError;
use anyhow::{Context, anyhow, bail};
use std::path::{Path, PathBuf};
use std::{fs, io};

/// No description of a free bar is larger (bytes).
const LARGEST_DESCRIPTION: u64 = 16 << 20;

/// A test description and where it was found.
#[derive(Debug)]
pub(super) struct TestFile {
    /// The description.
    pub(super) test: TestDescription,
    /// The file, as the user named it.
    pub(super) name: String,
    /// The folder of its recordings.
    pub(super) folder: PathBuf,
}

/// Reads a test description without effects, and passes its warnings on.
///
/// # Errors
/// Those of [`read_model`], and a described effect.
pub(super) fn read_test(path: &Path, terminal: &Terminal) -> anyhow::Result<TestFile> {
    let file = read_model(path, terminal)?;
    file.check_has_no_effect()?;
    Ok(file)
}

/// Reads a test description that may have effects, and passes its warnings on.
///
/// # Errors
/// The file cannot be read, is no UTF-8 text, or is no valid description.
pub(super) fn read_model(path: &Path, terminal: &Terminal) -> anyhow::Result<TestFile> {
    let file = TestFile::of(path, read_text(path, terminal)?)?;
    for warning in &file.test.warnings {
        terminal.warn(&warning.to_string());
    }
    Ok(file)
}

/// Reads the bytes of a test description.
///
/// # Errors
/// The file cannot be read.
pub(super) fn read_bytes(path: &Path) -> anyhow::Result<Vec<u8>> {
    let remedy = "give the path of a test description; `tapjoint init` prints one";
    fs::read(path).map_err(|cause| anyhow!("{}: cannot be read: {cause}; {remedy}", path.display()))
}

/// Returns the text of a description: that of a file, or one that the calling program holds.
///
/// # Errors
/// The file cannot be read, or is no UTF-8 text.
pub(super) fn read_text(path: &Path, terminal: &Terminal) -> anyhow::Result<String> {
    let session = terminal.session();
    if let Some(text) = session.and_then(|session| session.text_of(path)) {
        return Ok(text.to_owned());
    }
    text_of(read_bytes(path)?, &path.display().to_string())
}

/// Returns the text in the bytes of a description of this name.
///
/// # Errors
/// They are no UTF-8 text.
pub(super) fn text_of(bytes: Vec<u8>, name: &str) -> anyhow::Result<String> {
    String::from_utf8(bytes).map_err(|error| {
        let good = error
            .as_bytes()
            .get(..error.utf8_error().valid_up_to())
            .unwrap_or_default();
        let line = 1 + good.iter().filter(|byte| **byte == b'\n').count();
        anyhow!(
            "{name}:{line}: not UTF-8 text; a test description is a text file; give the path of one; `tapjoint init` prints one"
        )
    })
}

/// Returns the error of a described effect with its file and line.
pub(super) fn effect_at(file: &str, error: &DescribedEffectError) -> anyhow::Error {
    match error.line {
        Some(line) => anyhow!("{file}:{line}: {}", error.cause),
        None => anyhow!("{file}: {}", error.cause),
    }
}

impl TestFile {
    /// Returns the description in the text of a file.
    ///
    /// # Errors
    /// It is no valid description.
    pub(super) fn of(path: &Path, text: String) -> anyhow::Result<Self> {
        let name = path.display().to_string();
        let test = TestDescription::parse(&text, &name)?;
        let folder = path.parent().map(Path::to_owned).unwrap_or_default();
        Ok(Self { test, name, folder })
    }

    /// Refuses a description with effects.
    ///
    /// # Errors
    /// It has an effect.
    pub(super) fn check_has_no_effect(&self) -> anyhow::Result<()> {
        let Some(effect) = self.test.effects.first() else {
            return Ok(());
        };
        bail!(
            "{}:{}: this command does not take a description with [[effect]]; remove it, or use `tapjoint predict` \
             or `tapjoint simulate`",
            self.name,
            effect.line
        );
    }

    /// Runs the described test, and before it that of the free bar where the description names one. The stages are announced
    /// to `watch`.
    ///
    /// # Errors
    /// Those of [`measure_free_test`] and [`run_test_watched`].
    pub(super) fn analyse(
        &self,
        settings: &IdentifySettings,
        watch: &dyn Watch,
    ) -> anyhow::Result<Analysis> {
        let settings = IdentifySettings {
            free_test: self.measured_free_test(watch)?,
            ..settings.clone()
        };
        let place = (self.folder.as_path(), self.name.as_str());
        Ok(run_test_watched(&self.test, place, &settings, watch)?)
    }

    /// Measures the free bar; `None` where the description names no test of it.
    ///
    /// # Errors
    /// Those of [`measure_free_test`], and of a description that is none of the same bar.
    pub(super) fn measured_free_test(&self, watch: &dyn Watch) -> anyhow::Result<Option<FreeTest>> {
        let Some(named) = &self.test.beam.free_test else {
            return Ok(None);
        };
        let free = self.free_test(named)?;
        let place = (free.folder.as_path(), free.name.as_str());
        let measured = measure_free_test(&self.test, &free.test, place, watch);
        let measured = measured.map_err(|cause| named.error(&self.name, cause.to_string()))?;
        Ok(Some(measured))
    }

    /// Reads the description of the free bar's test.
    ///
    /// # Errors
    /// The file cannot be read, is no valid description, or describes another bar.
    pub(super) fn free_test(&self, named: &FreeTestFile) -> anyhow::Result<TestFile> {
        let path = self.path_of(&named.path);
        let unreadable = |cause: String| {
            let problem = format!(
                "{} cannot be read: {cause}; name a test description with `kind = \"free\"`, seen from the folder of this description",
                path.display()
            );
            named.error(&self.name, problem)
        };
        readable_file(&path).map_err(&unreadable)?;
        let found = fs::metadata(&path).map_err(|cause| unreadable(cause.to_string()))?;
        if !found.is_file() || found.len() > LARGEST_DESCRIPTION {
            return Err(unreadable("it is not a regular file of at most 16 MB".to_owned()).into());
        }
        let bytes = fs::read(&path).map_err(|cause| unreadable(cause.to_string()))?;
        let free = TestFile::of(&path, text_of(bytes, &path.display().to_string())?)?;
        named.check(&self.name, &self.test, &free.test)?;
        free.test.check_has_data(&free.name)?;
        Ok(free)
    }

    /// Returns the path of a recording that the description names.
    pub(super) fn path_of(&self, file: &Path) -> PathBuf {
        self.folder.join(file)
    }

    /// Makes sure that every recording and the file of modes can be opened, and those of the free bar's test, before any
    /// work.
    ///
    /// # Errors
    /// The first file that cannot be opened, with its line in the description.
    pub(super) fn check_recordings(&self) -> anyhow::Result<()> {
        for recording in &self.test.recordings {
            for file in recording.files() {
                let path = self.path_of(file);
                readable_file(&path)
                    .map_err(|cause| recording.file_error(&self.name, &path, &cause))?;
            }
        }
        let measured = self.test.measured.as_ref();
        if let Some(file) = measured.and_then(|measured| measured.file.as_ref()) {
            let path = self.path_of(&file.path);
            readable_file(&path).map_err(|cause| {
                let problem = format!(
                    "{} cannot be read: {cause}; name a file that exists, seen from the folder of this description",
                    path.display()
                );
                file.error(&self.name, "file", problem)
            })?;
        }
        match &self.test.beam.free_test {
            // A free bar has no free test of its own.
            Some(named) => self.free_test(named)?.check_recordings(),
            None => Ok(()),
        }
    }
}

/// Makes sure that a file named on the command line can be opened.
///
/// # Errors
/// The file cannot be opened; the message holds the system's reason.
pub(super) fn check_file(path: &Path) -> anyhow::Result<()> {
    let readable = readable_file(path).map_err(|cause| anyhow!(cause));
    readable.with_context(|| format!("{}: cannot be read", path.display()))
}

fn readable_file(path: &Path) -> Result<(), String> {
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => Err("it is a folder".to_owned()),
        // A pipe that is opened and closed would lose its writer.
        Ok(found) if !found.is_file() => Ok(()),
        Ok(_) => fs::File::open(path)
            .map(drop)
            .map_err(|error| error.to_string()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let like = like_in_folder(path).map(|name| format!("; did you mean {name}?"));
            Err(format!("there is no such file{}", like.unwrap_or_default()))
        }
        Err(error) => Err(error.to_string()),
    }
}

/// Returns the file beside the missing one whose name differs least, in at most two letters.
fn like_in_folder(path: &Path) -> Option<String> {
    const LETTERS: usize = 2;
    let wanted = path.file_name()?.to_string_lossy().into_owned();
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let entries = fs::read_dir(folder.unwrap_or(Path::new("."))).ok()?;
    let names = entries.flatten().map(|entry| entry.file_name());
    let mut near: Vec<(usize, String)> = names
        .map(|name| name.to_string_lossy().into_owned())
        .map(|name| (strsim::damerau_levenshtein(&wanted, &name), name))
        .filter(|(distance, _)| *distance <= LETTERS)
        .collect();
    near.sort();
    near.into_iter().next().map(|(_, name)| name)
}

/// Returns the file's name without its folder.
pub(super) fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// Returns the file's name without folder and ending.
pub(super) fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}
