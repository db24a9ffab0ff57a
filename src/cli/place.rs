//! Where a path leads: through links, `..` and hard links, also where nothing is there yet.

use crate::report::earlier_files;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Links that are followed one after the other.
const LINKS: usize = 40;

/// Returns the file or folder that a path leads to. The last name need not exist, also behind a link.
///
/// # Errors
/// Its folder does not exist, or links lead in a circle.
pub(super) fn resolved(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..LINKS {
        if let Ok(found) = fs::canonicalize(&path) {
            return Ok(found);
        }
        // A pipe behind /dev/stdout is there, without a path of its own.
        if path.exists() {
            return Ok(path);
        }
        let folder = folder_of(&path);
        path = match fs::read_link(&path) {
            Ok(next) => folder.join(next),
            Err(_) => {
                let name = path.file_name().ok_or(io::ErrorKind::NotFound)?;
                return Ok(fs::canonicalize(folder)?.join(name));
            }
        };
    }
    Err(io::Error::other("its links lead in a circle"))
}

/// Returns the folder of a path, `.` for a bare name.
pub(super) fn folder_of(path: &Path) -> &Path {
    or_here(path.parent().unwrap_or(Path::new("")))
}

/// Returns the path, and `.` for an empty path.
pub(super) fn or_here(path: &Path) -> &Path {
    if path.as_os_str().is_empty() {
        Path::new(".")
    } else {
        path
    }
}

/// A file's place, the same for all its names: through links, `..`, and hard links.
#[derive(Debug, Clone)]
pub(super) struct Place {
    /// The path without links.
    path: PathBuf,
    /// Device and number of the file, if the file exists and the system gives them.
    node: Option<(u64, u64)>,
}

impl Place {
    /// Returns the place of a file, or the place where it would appear; `None` for a device, a pipe or a folder.
    pub(super) fn of(path: &Path) -> Option<Self> {
        let found = fs::metadata(path).ok();
        if found.as_ref().is_some_and(|found| !found.is_file()) {
            return None;
        }
        let whole = resolved(path).or_else(|_| std::path::absolute(path));
        Some(Self {
            path: whole.unwrap_or_else(|_| path.to_owned()),
            node: found.as_ref().and_then(node_of),
        })
    }

    /// Returns true for two names of one file.
    pub(super) fn is(&self, other: &Self) -> bool {
        let same_node = self.node.is_some() && self.node == other.node;
        if same_node || self.path == other.path {
            return true;
        }
        // Names that differ in their case only are one file if the file system ignores case: then the folder
        // also exists in capital letters.
        let [one, two] = [self, other].map(|place| place.path.to_string_lossy().to_lowercase());
        let Some(folder) = self.path.parent().filter(|_| one == two) else {
            return false;
        };
        let capitals = PathBuf::from(folder.to_string_lossy().to_uppercase());
        capitals != folder && fs::canonicalize(capitals).is_ok_and(|found| found == folder)
    }
}

/// Returns device and number of a file; `None` where the system does not give them.
#[cfg(unix)]
pub(super) fn node_of(found: &fs::Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((found.dev(), found.ino()))
}

#[cfg(not(unix))]
pub(super) fn node_of(_found: &fs::Metadata) -> Option<(u64, u64)> {
    None
}

/// Returns the number of a file's owner; `None` where the system does not give it.
#[cfg(unix)]
pub(super) fn owner_of(found: &fs::Metadata) -> Option<u32> {
    use std::os::unix::fs::MetadataExt;
    Some(found.uid())
}

#[cfg(not(unix))]
pub(super) fn owner_of(_found: &fs::Metadata) -> Option<u32> {
    None
}

/// Returns true for a test description, by the name: a recording may be any text.
pub(super) fn is_description(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// Endings of the names of recordings in a folder. Text files of other endings may be notes.
pub(super) const RECORDINGS: [&str; 8] = ["wav", "flac", "csv", "uff", "unv", "58", "lvm", "mat"];

/// Files of a folder that a test may consist of, each list in order.
#[derive(Debug, Default)]
pub(super) struct FolderContents {
    /// Test descriptions.
    pub(super) descriptions: Vec<PathBuf>,
    /// Recordings and files of functions.
    pub(super) recordings: Vec<PathBuf>,
}

impl FolderContents {
    /// Looks into a folder. Hidden files, and files of a report that was written into it, are left out.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub(super) fn of(folder: &Path) -> io::Result<Self> {
        let report = report_in(folder).map_or_else(Vec::new, |report| earlier_files(&report));
        let mut files = Vec::new();
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if !name.starts_with('.') && !report.contains(&name.into_owned()) && path.is_file() {
                files.push(path);
            }
        }
        files.sort();
        let (descriptions, mut recordings): (Vec<_>, Vec<_>) =
            files.into_iter().partition(|file| is_description(file));
        recordings.retain(|file| {
            let ending = file.extension().unwrap_or_default().to_string_lossy();
            RECORDINGS.contains(&&*ending.to_lowercase())
        });
        Ok(Self {
            descriptions,
            recordings,
        })
    }
}

/// Returns the text of the report.json of a report in a folder; `None` without a report.
pub(super) fn report_in(folder: &Path) -> Option<String> {
    // Other commands write a report.json alone.
    let is_report = folder.join("report.html").is_file();
    fs::read_to_string(folder.join("report.json"))
        .ok()
        .filter(|_| is_report)
}
