//! Files and folders that appear whole or not at all.
//!
//! A file is written under a temporary name in its own folder and renamed at the end. A report
//! folder is filled in a temporary folder. If the report folder is new, the temporary folder is renamed
//! to it in one step. If it exists, the temporary folder lies inside it. Its files, also those in folders
//! below it, are then renamed one by one, and each replaces its predecessor whole. Files of other names
//! stay, except leftovers that the caller names. The temporary file or folder is made before any work,
//! which shows that writing will be possible. When the work fails, it is removed.

use super::overwrite::{CHECKSUMS, Files, carries_mark, checksum_list, signed};
use anyhow::{anyhow, bail};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use tapjoint::report::picture::PictureFormat;
use tempfile::{Builder, NamedTempFile, TempDir};

/// Beginning of the names of everything temporary.
const PREFIX: &str = ".tapjoint-";

/// Returns the error of an output for which nothing may be created in its folder.
fn not_writable(path: &Path, folder: &Path, cause: &io::Error) -> anyhow::Error {
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

/// A file to be written in one piece.
#[derive(Debug)]
pub(super) struct OutputFile {
    path: PathBuf,
    target: Target,
}

#[derive(Debug)]
enum Target {
    /// A temporary file beside the real one.
    Aside(NamedTempFile),
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
        // A link stays a link: what it points to is replaced.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let (folder, shown) = (folder_of(&path), path.display());
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
            _ => {
                let file = builder(READABLE_FILE).tempfile_in(folder);
                file.map(Target::Aside)
            }
        };
        let target = target.map_err(|cause| not_writable(&path, folder, &cause))?;
        Ok(Self { path, target })
    }

    /// Returns the format of a picture in this file, by its name.
    pub(super) fn picture_format(&self) -> PictureFormat {
        PictureFormat::of(&self.path)
    }

    /// Writes the whole file and puts it in its place.
    ///
    /// # Errors
    /// Writing fails; the earlier file is then still there.
    pub(super) fn write(self, bytes: &[u8]) -> anyhow::Result<()> {
        let path = self.path;
        let bytes: &[u8] = &signed(bytes);
        let written = match self.target {
            Target::Direct(mut file) => file.write_all(bytes).and_then(|()| file.flush()),
            Target::Aside(mut file) => file
                .write_all(bytes)
                .and_then(|()| file.flush())
                .and_then(|()| file.persist(&path).map(drop).map_err(|error| error.error)),
        };
        written.map_err(|cause| failed(&path, &cause))
    }
}

/// A folder of results that is filled aside and published at the end.
#[derive(Debug)]
pub(super) struct OutputFolder {
    path: PathBuf,
    staging: TempDir,
}

impl OutputFolder {
    /// Checks that the folder can be made or written to.
    ///
    /// # Errors
    /// The folder cannot be made or written to.
    pub(super) fn prepare(path: &Path) -> anyhow::Result<Self> {
        // The nearest folder that exists: the output folder itself, or the one it will grow in.
        let mut ancestors = path.ancestors().map(or_here);
        let existing = ancestors.find(|ancestor| ancestor.exists());
        let existing = existing.unwrap_or(Path::new("."));
        if !existing.is_dir() {
            let shown = existing.display();
            bail!("{shown}: is a file, but a folder is needed; choose another name");
        }
        let staging = builder(READABLE_FOLDER).tempdir_in(existing);
        Ok(Self {
            path: path.to_owned(),
            staging: staging.map_err(|cause| not_writable(path, existing, &cause))?,
        })
    }

    /// Prepares a folder that is new, empty, or was filled by the program; with `force` any folder.
    ///
    /// # Errors
    /// It cannot be written, or was not made by the program.
    pub(super) fn prepare_own(path: &Path, force: bool) -> anyhow::Result<Self> {
        let is_empty = fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none());
        if path.exists() && !is_empty && !force && !path.join(CHECKSUMS).is_file() {
            bail!(
                "{}: is there already and was not made by tapjoint; give the name of a new folder, or write into it with --force",
                path.display()
            );
        }
        Self::prepare(path)
    }

    /// Adds a file to the folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn add(&self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let written = fs::write(self.staging.path().join(name), signed(bytes));
        written.map_err(|cause| failed(&self.path.join(name), &cause))
    }

    /// Returns the path for a file that is too long to be added in one piece.
    pub(super) fn place_of(&self, name: &str) -> PathBuf {
        self.staging.path().join(name)
    }

    /// Moves everything into its place and returns the folder. Files in the folder are replaced only if
    /// `files` allows it.
    ///
    /// # Errors
    /// A file must not be replaced, and nothing was changed; or writing fails, and every file is either the old or
    /// the new one, whole.
    pub(super) fn publish(self, files: &Files) -> anyhow::Result<PathBuf> {
        let names = self.add_checksums();
        for name in names.map_err(|cause| failed(&self.path, &cause))? {
            files.check_again(&self.path.join(name))?;
        }
        let moved = match self.path.exists() {
            true => self.move_files(),
            false => fs::create_dir_all(folder_of(&self.path))
                .and_then(|()| fs::rename(self.staging.path(), &self.path)),
        };
        moved.map_err(|cause| failed(&self.path, &cause))?;
        Ok(self.path)
    }

    /// Returns the text of a file that the folder already has; `None` without such a file.
    pub(super) fn earlier(&self, name: &str) -> Option<String> {
        fs::read_to_string(self.path.join(name)).ok()
    }

    /// Moves everything into its place, then removes those of the `stale` files that were not made again.
    ///
    /// Only files are removed, never folders. Returns the folder, and an error for the files that could not
    /// be removed. The results are written all the same, so the caller reports this error last.
    ///
    /// # Errors
    /// Those of [`publish`](Self::publish).
    pub(super) fn publish_without(
        self,
        stale: &[String],
        files: &Files,
    ) -> anyhow::Result<(PathBuf, Option<anyhow::Error>)> {
        let stale: Vec<&String> = stale
            .iter()
            .filter(|name| !self.staging.path().join(name).exists())
            .collect();
        let folder = self.publish(files)?;
        let (mut names, mut causes) = (Vec::new(), Vec::new());
        for name in stale {
            let path = folder.join(name);
            let is_file = fs::symlink_metadata(&path).is_ok_and(|found| !found.is_dir());
            if !is_file || !files.may_remove(&path) {
                continue;
            }
            if let Err(cause) = fs::remove_file(&path) {
                names.push(path.display().to_string());
                causes.push(cause);
            }
        }
        let left = causes.first().map(|cause| {
            let names = names.join(", ");
            anyhow!(
                "{names}: left by an earlier run, and cannot be removed: {cause}; the new files are written, so remove the old ones by hand"
            )
        });
        Ok((folder, left))
    }

    fn move_files(&self) -> io::Result<()> {
        for name in files_below(self.staging.path())? {
            let path = self.path.join(&name);
            fs::create_dir_all(folder_of(&path))?;
            fs::rename(self.staging.path().join(&name), path)?;
        }
        Ok(())
    }

    /// Adds a list of checksums if a file has no mark of the program. Returns the names of all files.
    fn add_checksums(&self) -> io::Result<Vec<PathBuf>> {
        let staging = self.staging.path();
        let mut names = files_below(staging)?;
        let marked = names.iter().map(|name| carries_mark(&staging.join(name)));
        if marked.collect::<io::Result<Vec<_>>>()?.contains(&false) {
            let new: Vec<_> = names
                .iter()
                .map(|name| (name.clone(), staging.join(name)))
                .collect();
            let list = checksum_list(&self.earlier(CHECKSUMS).unwrap_or_default(), &new)?;
            fs::write(staging.join(CHECKSUMS), list)?;
            names.push(CHECKSUMS.into());
        }
        Ok(names)
    }
}

/// Returns all files of a folder that the program filled; empty for any other folder.
pub(super) fn files_made_in(folder: &Path) -> Vec<PathBuf> {
    let names = match folder.join(CHECKSUMS).is_file() {
        true => files_below(folder).unwrap_or_default(),
        false => Vec::new(),
    };
    names.iter().map(|name| folder.join(name)).collect()
}

/// Returns the names of all files in a folder and below it, relative to the folder, in order.
///
/// # Errors
/// A folder cannot be read.
fn files_below(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut entries = fs::read_dir(folder)?.collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    let mut files = Vec::new();
    for entry in entries {
        let name = PathBuf::from(entry.file_name());
        if entry.file_type()?.is_dir() {
            let below = files_below(&entry.path())?;
            files.extend(below.iter().map(|file| name.join(file)));
        } else {
            files.push(name);
        }
    }
    Ok(files)
}

/// Modes before the user's umask; temporary files are private by default, results are not.
const READABLE_FILE: u32 = 0o666;
const READABLE_FOLDER: u32 = 0o777;

fn builder(mode: u32) -> Builder<'static, 'static> {
    let mut builder = Builder::new();
    builder.prefix(PREFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = mode;
    builder
}

fn folder_of(path: &Path) -> &Path {
    or_here(path.parent().unwrap_or(Path::new("")))
}

/// Returns the path, and `.` for an empty path.
fn or_here(path: &Path) -> &Path {
    if path.as_os_str().is_empty() {
        Path::new(".")
    } else {
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Documents as the program writes them.
    const OLD: &str = r#"{"version": 1, "warnings": []}"#;
    const NEW: &str = r#"{"version": 2, "warnings": []}"#;

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
    fn regress_a_new_folder_is_published_with_its_parents() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/report");
        drop(OutputFolder::prepare(&path).unwrap());
        assert_eq!(
            names(folder.path()),
            [""; 0],
            "preparing left something behind"
        );
        let output = OutputFolder::prepare(&path).unwrap();
        output.add("report.json", NEW.as_bytes()).unwrap();
        output.publish(&Files::default()).unwrap();
        assert_eq!(names(&path), ["report.json"]);
        assert_eq!(names(folder.path()), ["deep"]);
    }

    #[test]
    fn regress_an_existing_folder_keeps_strangers_and_replaces_ours() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("notes.txt"), "mine").unwrap();
        fs::write(folder.path().join("report.json"), OLD).unwrap();
        let output = OutputFolder::prepare(folder.path()).unwrap();
        output.add("report.json", NEW.as_bytes()).unwrap();
        output.publish(&Files::default()).unwrap();
        assert_eq!(names(folder.path()), ["notes.txt", "report.json"]);
        assert_eq!(
            fs::read_to_string(folder.path().join("report.json")).unwrap(),
            NEW
        );
    }

    #[test]
    fn regress_leftovers_go_and_strangers_stay() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["notes.txt", "old.png", "report.json"] {
            fs::write(folder.path().join(name), OLD).unwrap();
        }
        fs::create_dir(folder.path().join("folder")).unwrap();
        let output = OutputFolder::prepare(folder.path()).unwrap();
        assert_eq!(output.earlier("report.json").as_deref(), Some(OLD));
        output.add("report.json", NEW.as_bytes()).unwrap();
        let stale = ["old.png", "report.json", "gone.png", "folder"].map(str::to_owned);
        let (_, left) = output.publish_without(&stale, &Files::default()).unwrap();
        assert!(left.is_none(), "{left:?}");
        assert_eq!(
            names(folder.path()),
            ["folder", "notes.txt", "report.json"],
            "leftovers"
        );
        let kept = fs::read_to_string(folder.path().join("report.json")).unwrap();
        assert_eq!(kept, NEW);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn regress_what_cannot_be_removed_is_told_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["old.png", "older.png"] {
            fs::write(folder.path().join(name), OLD).unwrap();
        }
        let output = OutputFolder::prepare(folder.path()).unwrap();
        output.add("report.json", NEW.as_bytes()).unwrap();
        // Files of the kernel cannot be removed, not even by the system's owner.
        std::os::unix::fs::symlink("/proc", folder.path().join("kernel")).unwrap();
        let stale = ["old.png", "kernel/version", "kernel/uptime", "older.png"];
        let stale = stale.map(str::to_owned);
        let (_, left) = output.publish_without(&stale, &Files::default()).unwrap();
        assert_eq!(names(folder.path()), ["kernel", "report.json"], "leftovers");
        let told = left.expect("two files stay").to_string();
        for part in ["kernel/version, ", "kernel/uptime: left by an earlier run"] {
            assert!(told.contains(part), "{told}");
        }
    }

    #[test]
    fn regress_files_in_the_way_and_devices() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "x").unwrap();
        for path in [file.clone(), file.join("below")] {
            let error = OutputFolder::prepare(&path).expect_err("a file is in the way");
            assert!(
                error.to_string().contains(": is a file, but a folder"),
                "{path:?}: {error}"
            );
        }
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
