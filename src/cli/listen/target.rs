//! The recording that is written next.

use super::super::input::{TestFile, file_name};
use super::super::place::Place;
use super::recorder::part;
use crate::recording::MOST_FILES;
use anyhow::bail;
use std::path::{Path, PathBuf};

/// The recording that is written.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Target {
    /// Place of its table among the `[[recording]]` of the description; `None` without one.
    pub(super) table: Option<usize>,
    /// The file to be written. Where it is full, others follow.
    pub(super) file: PathBuf,
    /// Files of the same recording that are there already.
    pub(super) earlier: Vec<PathBuf>,
    /// True where the file is there and is played: it is not written.
    pub(super) is_played: bool,
    /// Files of other recordings, which are not to be written.
    pub(super) reserved: Vec<PathBuf>,
}

/// Returns the recording that a description asks for next: the first whose file is missing, or the one that is played.
/// The one at `without` (0-based) is passed over.
///
/// # Errors
/// None is missing; its name is not that of a WAV file, or its folder does not exist; the file played is none of it.
pub(super) fn described_target(
    file: &TestFile,
    replayed: Option<&Path>,
    is_resumed: bool,
    without: Option<usize>,
) -> anyhow::Result<Target> {
    let played = replayed.and_then(Place::of);
    let recordings = file.test.recordings.iter().enumerate();
    let recordings =
        recordings.filter(|(table, recording)| recording.form.is_none() && Some(*table) != without);
    let mut last = None;
    for (table, recording) in recordings {
        let others = file.test.recordings.iter().enumerate();
        let others = others.filter(|(other, _)| *other != table);
        let reserved: Vec<PathBuf> = others
            .flat_map(|(_, other)| other.files().map(|name| file.path_of(name)))
            .collect();
        let (mut earlier, mut missing) = (Vec::new(), None);
        for name in recording.files() {
            let path = file.path_of(name);
            let own = Place::of(&path);
            let is_played = own
                .zip(played.as_ref())
                .is_some_and(|(own, played)| own.is(played));
            let is_missing = !path.exists();
            if is_missing && is_resumed && (last.is_some() || !earlier.is_empty()) {
                // Of the last recording that is there the next file; others are not begun.
                missing.get_or_insert(path);
                continue;
            }
            if is_played || is_missing {
                if !is_played {
                    check_file(&path, Some(recording.line), &file.name)?;
                }
                return Ok(Target {
                    table: Some(table),
                    file: path,
                    earlier: if is_played { Vec::new() } else { earlier },
                    is_played,
                    reserved,
                });
            }
            earlier.push(path);
        }
        if !earlier.is_empty() {
            last = Some((table, earlier, reserved, missing));
        }
    }
    match last {
        Some((table, earlier, reserved, Some(file))) if is_resumed => Ok(Target {
            table: Some(table),
            file,
            earlier,
            is_played: false,
            reserved,
        }),
        Some((table, earlier, reserved, None)) if is_resumed => {
            resumed(Some(table), earlier, reserved)
        }
        None => bail!(
            "{}: describes no recording of taps; add a [[recording]] with the file to be written",
            file.name
        ),
        Some(_) => bail!(
            "{}: all recordings are there; add a [[recording]] with a new file, or go on with the last one by --resume",
            file.name
        ),
    }
}

/// Returns the recording without a description.
///
/// # Errors
/// The file is there already; its name is not that of a WAV file, or its folder does not exist.
pub(super) fn bare_target(
    path: &Path,
    replayed: Option<&Path>,
    is_resumed: bool,
) -> anyhow::Result<Target> {
    let shown = path.display();
    let [own, played] = [Some(path), replayed].map(|path| path.and_then(Place::of));
    let is_played = own.zip(played).is_some_and(|(own, played)| own.is(&played));
    if !is_played {
        check_file(path, None, "")?;
    }
    match (path.exists(), is_resumed) {
        (true, true) if !is_played => resumed(None, vec![path.to_owned()], Vec::new()),
        (true, false) if !is_played => {
            bail!(
                "{shown}: is there already, and no recording is replaced, not even with --force; give another name, or go on with it by --resume"
            )
        }
        _ => Ok(Target {
            table: None,
            file: path.to_owned(),
            earlier: Vec::new(),
            is_played,
            reserved: Vec::new(),
        }),
    }
}

/// The next file of a recording of which some are there.
fn resumed(
    table: Option<usize>,
    mut earlier: Vec<PathBuf>,
    reserved: Vec<PathBuf>,
) -> anyhow::Result<Target> {
    let first = earlier[0].clone();
    for number in 2..=MOST_FILES {
        let path = part(&first, number);
        if reserved.contains(&path) {
            continue;
        }
        if !path.exists() {
            return Ok(Target {
                table,
                file: first,
                earlier,
                is_played: false,
                reserved,
            });
        }
        if !earlier.contains(&path) {
            earlier.push(path);
        }
    }
    bail!(
        "{}: has {MOST_FILES} files already; record into another file",
        first.display()
    )
}

/// "low.wav, tap at 0.04 m".
pub(super) fn asked_for(file: &TestFile, target: &Target) -> String {
    let name = file_name(&target.file);
    let recording = target.table.map(|table| &file.test.recordings[table]);
    let Some(recording) = recording else {
        return name;
    };
    let mut words = vec![name];
    if let Some(tap) = recording.tap {
        words.push(format!("tap at {tap} m"));
    }
    if let Some(level) = recording.level.filter(|level| *level != 1.0) {
        words.push(format!("{level} times as hard as level 1"));
    }
    for (sensor, place) in &recording.at {
        words.push(format!("sensor {sensor} at {place} m"));
    }
    if let Some(length) = recording.length {
        words.push(format!("free length {length} m"));
    }
    if !recording.masses.is_empty() {
        words.push(format!("with {} known masses", recording.masses.len()));
    }
    words.join(", ")
}

/// Checks that a file can be written there as WAV.
fn check_file(path: &Path, line: Option<usize>, test: &str) -> anyhow::Result<()> {
    let shown = match line {
        Some(line) => format!("{test}:{line}: {}", path.display()),
        None => path.display().to_string(),
    };
    let ending = path.extension();
    if !ending.is_some_and(|ending| ending.eq_ignore_ascii_case("wav")) {
        bail!("{shown}: the recording is written as WAV; end its name with .wav");
    }
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        bail!(
            "{shown}: there is no folder {}; make it first",
            folder.display()
        );
    }
    Ok(())
}
