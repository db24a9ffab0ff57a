//! Files that appear whole or not at all.
//!
//! A file is written under a temporary name in its own folder and renamed at the end. The temporary file is made
//! before any work, which shows that writing will be possible. When the work fails, it is removed.

use super::overwrite::{is_free, signed};
use super::place::{folder_of, resolved};
use super::staging::{TemporaryFile, ledger};
use crate::report::picture::PictureFormat;
use anyhow::{anyhow, bail};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Returns the error of an output for which nothing may be created in its folder.
pub(super) fn not_writable(path: &Path, folder: &Path, cause: &io::Error) -> anyhow::Error {
    // `tempfile` adds the name of the temporary file, which tells the user nothing.
    let text = cause.to_string();
    let cause = text
        .split_once(" at path ")
        .map_or(&*text, |(cause, _)| cause);
    let (path, folder) = (path.display(), folder.display());
    anyhow!(
        "{path}: cannot be written: {cause}; choose another place, or make {folder} a folder that you may write to"
    )
}

/// Returns the error of an output whose writing failed on the way; nothing half-written is left.
pub(super) fn failed(path: &Path, cause: &io::Error) -> anyhow::Error {
    let path = path.display();
    anyhow!("{path}: could not be written: {cause}; nothing was changed there")
}

/// Forgives a reader who has closed the output, as `head` does: the work goes on.
pub(super) fn unless_closed(written: io::Result<()>) -> io::Result<()> {
    match written {
        Err(cause) if cause.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// Length and time of an existing file: when they change, somebody else has written it.
pub(super) type State = (u64, Option<SystemTime>);

/// Returns length and time of a file; `None` without one.
pub(super) fn state_of(path: &Path) -> Option<State> {
    let found = fs::metadata(path).ok()?;
    Some((found.len(), found.modified().ok()))
}

/// A file to be written in one piece.
#[derive(Debug)]
pub(super) struct OutputFile {
    path: PathBuf,
    target: Target,
}

#[derive(Debug)]
enum Target {
    /// A temporary file beside the real one, and what was there before.
    Aside(TemporaryFile, Option<State>),
    /// A device or pipe, which a renamed file would replace.
    Direct(File),
}

impl OutputFile {
    /// Checks that the file of an option can be written, if the option is given.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn prepare_optional(path: Option<&Path>) -> anyhow::Result<Option<Self>> {
        path.map(Self::prepare).transpose()
    }

    /// Checks that `path` can be written, without touching it.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn prepare(path: &Path) -> anyhow::Result<Self> {
        // A link stays a link: what it points to is replaced, or made.
        let given = path;
        let path =
            resolved(given).map_err(|cause| not_writable(given, folder_of(given), &cause))?;
        // A message speaks of the name as it was given; of a link, of what it leads to.
        let named = if given.is_symlink() { &path } else { given };
        let (folder, shown) = (folder_of(&path), named.display());
        let target = match fs::metadata(&path) {
            Ok(found) if found.is_dir() => {
                bail!("{shown}: is a folder, but a file is needed; choose another name")
            }
            Ok(found) if !found.is_file() => {
                let device = File::options().write(true).open(&path);
                device.map(Target::Direct)
            }
            Ok(found) if found.permissions().readonly() => {
                bail!("{shown}: is read-only; choose another name, or allow writing to it")
            }
            Err(cause) if cause.kind() != io::ErrorKind::NotFound => Err(cause),
            _ => TemporaryFile::make_in(folder).map(|file| Target::Aside(file, state_of(&path))),
        };
        let target = target.map_err(|cause| not_writable(named, folder_of(named), &cause))?;
        Ok(Self { path, target })
    }

    /// Returns the format of a picture in this file, by its name.
    pub(super) fn picture_format(&self) -> PictureFormat {
        PictureFormat::of(&self.path)
    }

    /// Writes the whole file and puts it in its place.
    ///
    /// # Errors
    /// Writing fails, or somebody else has written the file meanwhile; it is then as it was.
    pub(super) fn write(self, bytes: &[u8]) -> anyhow::Result<()> {
        let path = self.path;
        let bytes: &[u8] = &signed(bytes);
        match self.target {
            Target::Direct(mut file) => {
                let written = file.write_all(bytes).and_then(|()| file.flush());
                let shown = path.display();
                unless_closed(written).map_err(|cause| {
                    anyhow!("{shown}: could not be written: {cause}; a part may have been written")
                })?;
            }
            Target::Aside(_, before) if state_of(&path) != before && !is_free(&path) => {
                bail!(
                    "{}: was changed while this command worked; nothing was changed there; give another name, or run again",
                    path.display()
                );
            }
            Target::Aside(file, _) => file
                .write(bytes, &path)
                .map_err(|cause| failed(&path, &cause))?,
        }
        ledger().note(path);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("the folder exists");
        let mut names: Vec<_> = entries
            .map(|entry| {
                entry
                    .expect("readable")
                    .file_name()
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        names.sort();
        names
    }

    #[test]
    fn regress_a_file_appears_whole_and_a_dropped_one_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        fs::write(&path, "old").unwrap();
        drop(OutputFile::prepare(&path).unwrap());
        assert_eq!(
            fs::read_to_string(&path).unwrap(),
            "old",
            "preparing changed the file"
        );
        OutputFile::prepare(&path).unwrap().write(b"new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(
            names(folder.path()),
            ["a.json"],
            "something temporary was left"
        );
    }

    #[test]
    fn regress_files_in_the_way_and_devices() {
        let folder = tempfile::tempdir().unwrap();
        let error = OutputFile::prepare(folder.path()).expect_err("a folder is in the way");
        let said = error.to_string();
        assert!(said.contains(": is a folder, but a file"), "{said}");
        let error = OutputFile::prepare(&folder.path().join("no/such")).expect_err("no folder");
        let said = error.to_string();
        assert!(said.contains(": cannot be written: "), "{said}");
        #[cfg(unix)]
        {
            OutputFile::prepare(Path::new("/dev/null"))
                .unwrap()
                .write(b"gone")
                .unwrap();
            assert!(
                !fs::metadata("/dev/null").unwrap().is_file(),
                "the device was replaced"
            );
        }
    }
}
