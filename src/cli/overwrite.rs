//! Files that a command may replace: none of its inputs, none twice, and without `--force` none that tapjoint
//! did not make.
//!
//! All files that a command reads and writes are collected from its arguments and from the test description,
//! and checked before any work. Every path among the arguments is an input, unless its option stands in
//! [`OUTPUTS`]. A new option therefore counts as an input until it is added there.

use super::arguments::JsonDestination;
use super::signature::is_made_here;
use clap::ArgMatches;
use std::fs;
use std::path::{Path, PathBuf};
use tapjoint::description::TestDescription;

/// Options that name an output; all other paths are inputs.
const OUTPUTS: [&str; 8] = [
    "json", "out", "png", "csv", "uff58", "uff58b", "model", "keep",
];

/// An output that a command must not write.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum OverwriteError {
    /// The command reads this file.
    #[error("{}: is an input of this command and cannot be its output ({option}); give another name", path.display())]
    Input {
        /// The output as it was named.
        path: PathBuf,
        /// Option of this output.
        option: String,
    },
    /// Two outputs are one file.
    #[error("{}: is the output of both {first} and {second}; give each a name of its own", path.display())]
    Twice {
        /// The second output as it was named.
        path: PathBuf,
        /// Option of the first.
        first: String,
        /// Option of the second.
        second: String,
    },
    /// There is a file that the program did not make.
    #[error("{}: is there already and was not made by tapjoint, or was changed since; give another name ({option}), or replace it with --force", path.display())]
    Foreign {
        /// The output as it was named.
        path: PathBuf,
        /// Option of this output.
        option: String,
    },
}

/// An option with all files that it writes.
pub(super) type Expanded = (&'static str, Vec<PathBuf>);

/// Files that a command reads, and files that it writes.
#[derive(Debug, Clone, Default)]
pub(super) struct Files {
    inputs: Vec<Place>,
    /// Options with their files.
    outputs: Vec<(String, PathBuf)>,
    /// Replace files that the program did not make, too.
    pub(super) force: bool,
}

impl Files {
    /// Collects the files of a command: the paths among its arguments, and the recordings that its test
    /// description names. `expanded` holds the options that write other files than the one they name.
    pub(super) fn of(
        matches: &ArgMatches,
        test: Option<(&Path, &TestDescription)>,
        expanded: Vec<Expanded>,
    ) -> Self {
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for id in matches.ids().map(clap::Id::as_str) {
            let paths = paths(matches, id);
            if !OUTPUTS.contains(&id) {
                inputs.extend(paths);
            } else if expanded.iter().all(|(option, _)| *option != id) {
                outputs.extend(paths.into_iter().map(|path| (id, path)));
            }
        }
        for (id, paths) in expanded {
            outputs.extend(paths.into_iter().map(|path| (id, path)));
        }
        let below = inputs.iter().filter(|path| path.is_dir());
        let below: Vec<PathBuf> = below.flat_map(|folder| tests_in(folder)).collect();
        inputs.extend(below);
        if let Some((path, test)) = test {
            inputs.extend(recordings_of(path, test));
        }
        Self {
            inputs: inputs.iter().filter_map(|path| Place::of(path)).collect(),
            outputs: outputs
                .into_iter()
                .map(|(id, path)| (format!("--{id}"), path))
                .collect(),
            force: matches.get_flag("force"),
        }
    }

    /// Checks all inputs against all outputs.
    ///
    /// # Errors
    /// An output is an input, two outputs are one file, or an existing file was not made by the program.
    pub(super) fn check(&self) -> Result<(), OverwriteError> {
        let mut before: Vec<(Place, &str)> = Vec::new();
        for (option, path) in &self.outputs {
            let Some(place) = Place::of(path) else {
                continue;
            };
            self.check_output(path, option)?;
            if let Some((_, first)) = before.iter().find(|(other, _)| other.is(&place)) {
                return Err(OverwriteError::Twice {
                    path: path.clone(),
                    first: (*first).to_owned(),
                    second: option.clone(),
                });
            }
            before.push((place, option));
        }
        Ok(())
    }

    /// Checks that one output is no input, and no existing file that the program did not make.
    ///
    /// # Errors
    /// [`OverwriteError::Input`], [`OverwriteError::Foreign`].
    fn check_output(&self, path: &Path, option: &str) -> Result<(), OverwriteError> {
        let (path, option) = (path.to_owned(), option.to_owned());
        if self.reads(&path) {
            Err(OverwriteError::Input { path, option })
        } else if !self.force && !is_free(&path) {
            Err(OverwriteError::Foreign { path, option })
        } else {
            Ok(())
        }
    }

    /// Checks an output again just before it is replaced, for files that were not known before the work.
    ///
    /// # Errors
    /// Those of [`check_output`](Self::check_output).
    pub(super) fn check_again(&self, path: &Path) -> Result<(), OverwriteError> {
        let known = self.outputs.iter().find(|(_, output)| output == path);
        self.check_output(path, known.map_or("--out", |(option, _)| option))
    }

    /// Returns true for a file of an earlier run that is no input, and may be removed.
    pub(super) fn may_remove(&self, path: &Path) -> bool {
        !self.reads(path) && is_free(path)
    }

    fn reads(&self, path: &Path) -> bool {
        Place::of(path).is_some_and(|place| self.inputs.iter().any(|input| input.is(&place)))
    }
}

/// Returns true if there is no file, an empty one, or one that the program made.
fn is_free(path: &Path) -> bool {
    match fs::metadata(path) {
        Ok(found) => !found.is_file() || found.len() == 0 || is_made_here(path),
        Err(_) => true,
    }
}

/// Returns the paths of an argument; empty for an argument of another type. `init` takes names of recordings.
fn paths(matches: &ArgMatches, id: &str) -> Vec<PathBuf> {
    if let Ok(Some(found)) = matches.try_get_many::<PathBuf>(id) {
        return found.cloned().collect();
    }
    if let Ok(Some(JsonDestination::File(path))) = matches.try_get_one(id) {
        return vec![path.clone()];
    }
    match matches.try_get_many::<String>(id) {
        Ok(Some(names)) if id == "recordings" => names.map(PathBuf::from).collect(),
        _ => Vec::new(),
    }
}

/// Returns descriptions and recordings of all tests in a folder of tests.
fn tests_in(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path().join("test.toml");
        if path.is_file() {
            if let Some(test) = described(&path) {
                files.extend(recordings_of(&path, &test));
            }
            files.push(path);
        }
    }
    files
}

fn recordings_of(path: &Path, test: &TestDescription) -> Vec<PathBuf> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let recordings = test.recordings.iter();
    recordings
        .map(|recording| folder.join(&recording.file))
        .collect()
}

/// Reads a test description for the names in it; `None` if it is not one. The command reads it again and
/// reports its errors. A pipe is not read, because it can be read only once.
pub(super) fn described(path: &Path) -> Option<TestDescription> {
    let is_file = fs::metadata(path).is_ok_and(|found| found.is_file());
    if !is_file || path.starts_with("/dev") {
        return None;
    }
    let text = fs::read_to_string(path).ok()?;
    TestDescription::parse(&text, &path.display().to_string()).ok()
}

/// A file's place, the same for all its names: through links, `..`, and hard links.
#[derive(Debug, Clone)]
struct Place {
    /// The path without links.
    path: PathBuf,
    /// Device and number of the file, if the file exists and the system gives them.
    node: Option<(u64, u64)>,
}

impl Place {
    /// Returns the place of a file, or the place where it would appear; `None` for a device, a pipe or a folder.
    fn of(path: &Path) -> Option<Self> {
        let found = fs::metadata(path).ok();
        if found.as_ref().is_some_and(|found| !found.is_file()) {
            return None;
        }
        let whole = fs::canonicalize(path).ok().or_else(|| {
            let name = path.file_name()?;
            let folder = path.parent().filter(|folder| *folder != Path::new(""));
            Some(
                fs::canonicalize(folder.unwrap_or(Path::new(".")))
                    .ok()?
                    .join(name),
            )
        });
        let whole = whole.or_else(|| std::path::absolute(path).ok());
        Some(Self {
            path: whole.unwrap_or_else(|| path.to_owned()),
            node: found.as_ref().and_then(node_of),
        })
    }

    fn is(&self, other: &Self) -> bool {
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

#[cfg(unix)]
fn node_of(found: &fs::Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((found.dev(), found.ino()))
}

#[cfg(not(unix))]
fn node_of(_found: &fs::Metadata) -> Option<(u64, u64)> {
    None
}
