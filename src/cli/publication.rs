//! Folders of results that appear whole or not at all.
//!
//! New files wait in a staging folder. It lies in the output folder, or, if that is new, in the nearest folder
//! that exists. At the end a journal in the staging folder says what is to be moved, then everything is
//! moved. Earlier files are kept in the staging folder until all new ones are in place. When one cannot be
//! moved, all are moved back. When the process is killed meanwhile, the next run into the folder carries
//! the journal out. Files of other names stay, except leftovers that the caller names.

use super::output::{failed, not_writable};
use super::overwrite::{CHECKSUMS, Files, carries_mark, checksum_list, signed};
use super::place::{or_here, resolved};
use super::staging::{JOURNAL, Ledger, NEW, OLD, PREFIX, Staging, ledger, leftovers, sweep_files};
use crate::report::earlier_files;
use anyhow::{anyhow, bail};
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io;
use std::path::{Component, Path, PathBuf};

/// A folder of results that is filled aside and published at the end.
#[derive(Debug)]
pub(super) struct OutputFolder {
    /// As the user named it.
    path: PathBuf,
    target: Target,
    staging: Staging,
    files: Files,
}

/// Where an output folder lies, without links.
#[derive(Debug)]
struct Target {
    /// The folder itself, or the nearest one that exists.
    base: PathBuf,
    /// The way from there to the folder; empty if the folder exists.
    rest: PathBuf,
}

impl Target {
    fn of(path: &Path) -> anyhow::Result<Self> {
        let mut ancestors = path.ancestors().map(or_here);
        let existing = ancestors.find(|ancestor| fs::symlink_metadata(ancestor).is_ok());
        let existing = existing.unwrap_or(Path::new("."));
        let found = resolved(existing).map_err(|cause| not_writable(path, existing, &cause))?;
        let rest = path.strip_prefix(existing).unwrap_or(path);
        if rest.components().any(|part| part == Component::ParentDir) {
            bail!(
                "{}: leads through a folder that does not exist; give the name without `..`",
                path.display()
            );
        }
        if found.is_dir() {
            let rest = rest.to_owned();
            return Ok(Self { base: found, rest });
        }
        if found.exists() {
            let shown = existing.display();
            bail!("{shown}: is a file, but a folder is needed; choose another name");
        }
        // A link to a folder that does not exist yet.
        let base = found.parent().unwrap_or(Path::new("/"));
        let name = found.file_name().unwrap_or_default();
        Ok(Self {
            base: base.to_owned(),
            rest: Path::new(name).join(rest),
        })
    }

    /// Returns the staging folder of this target in the base or in a folder above it. Its name is always the same,
    /// so that two runs into one folder meet.
    fn staging_in(&self, folder: &Path) -> PathBuf {
        let whole = self.base.join(&self.rest);
        let way = whole.strip_prefix(folder).unwrap_or(&whole);
        // Without the slash at the end that joining an empty path adds.
        let way: PathBuf = way.components().collect();
        let sum = Sha256::digest(way.as_os_str().as_encoded_bytes());
        let sum: String = sum
            .iter()
            .take(8)
            .map(|byte| format!("{byte:02x}"))
            .collect();
        folder.join(format!("{PREFIX}{sum}"))
    }

    /// Takes the staging folder. First ends what dead processes have begun in the folder or above it.
    ///
    /// # Errors
    /// Another run is writing into the folder, or the folder cannot be written.
    fn stage(&self, path: &Path, files: &Files) -> anyhow::Result<Staging> {
        let own = self.staging_in(&self.base);
        let staging = Staging::make(&own);
        let staging = staging.map_err(|cause| not_writable(path, &self.base, &cause))?;
        let staging = recovered(staging.ok_or_else(|| busy(path))?, files)?;
        for folder in self.base.ancestors() {
            sweep_files(folder);
            let found = leftovers(folder).into_iter();
            for other in found.filter(|other| *other != own) {
                match Staging::take(&other) {
                    Ok(Some(dead)) => drop(recovered(dead, files)?),
                    Ok(None) if other == self.staging_in(folder) => return Err(busy(path)),
                    // Of another folder, or of somebody else.
                    Ok(None) | Err(_) => {}
                }
            }
        }
        // A signal that has removed the folder must not find it made again.
        let _ledger = ledger();
        for part in [NEW, OLD] {
            let made = fs::create_dir_all(staging.path().join(part));
            made.map_err(|cause| not_writable(path, &self.base, &cause))?;
        }
        Ok(staging)
    }
}

fn busy(path: &Path) -> anyhow::Error {
    let path = path.display();
    anyhow!(
        "{path}: another run of tapjoint is writing there; wait until it has ended, or choose another folder"
    )
}

/// Carries out what a dead process has begun to publish into this folder. Until then the list of checksums may be
/// older than the files beside it.
///
/// # Errors
/// Another run is publishing there, or what was begun can be neither finished nor undone.
pub(super) fn end_begun(path: &Path, files: &Files) -> anyhow::Result<()> {
    // A folder that cannot be an output is refused later, with better words.
    let Ok(target) = Target::of(path) else {
        return Ok(());
    };
    for folder in target.base.ancestors() {
        let own = target.staging_in(folder);
        if !own.join(JOURNAL).is_file() {
            continue;
        }
        match Staging::take(&own) {
            Ok(Some(dead)) => drop(recovered(dead, files)?),
            Ok(None) => return Err(busy(path)),
            // It belongs to another user.
            Err(_) => {}
        }
    }
    Ok(())
}

/// Carries out the journal of a dead process, if there is one, and empties the staging folder.
///
/// # Errors
/// What it has begun can be neither finished nor undone.
fn recovered(mut staging: Staging, files: &Files) -> anyhow::Result<Staging> {
    let own = staging.path().to_owned();
    // A journal that ends early was never begun: the first file is moved after it.
    let journal = fs::read(own.join(JOURNAL));
    let journal = journal
        .ok()
        .and_then(|bytes| serde_json::from_slice(&bytes).ok());
    if let Some((moves, stale)) = journal {
        let ended = Journal { moves, stale }.carry_out(&mut staging, files, &mut ledger());
        // Undone is as good as finished.
        if staging.is_kept() {
            ended?;
        }
    }
    for part in [NEW, OLD] {
        let _ = fs::remove_dir_all(own.join(part));
    }
    Ok(staging)
}

/// Returns the folder into which a staging folder publishes.
fn base_of(staging: &Path) -> &Path {
    staging.parent().unwrap_or(Path::new("/"))
}

impl OutputFolder {
    /// Checks that the folder can be made or written to.
    ///
    /// # Errors
    /// The folder cannot be made or written to, or another run is writing into it.
    pub(super) fn prepare(path: &Path, files: &Files) -> anyhow::Result<Self> {
        let target = Target::of(path)?;
        let staging = target.stage(path, files)?;
        let output = Self {
            path: path.to_owned(),
            target,
            staging,
            files: files.clone(),
        };
        let ledger = ledger();
        let made = fs::create_dir_all(output.filled());
        drop(ledger);
        made.map_err(|cause| not_writable(path, &output.target.base, &cause))?;
        Ok(output)
    }

    /// Prepares a folder that is new, empty, or was filled by the program; with `force` any folder.
    ///
    /// # Errors
    /// It cannot be written, or was not made by the program.
    pub(super) fn prepare_own(path: &Path, files: &Files) -> anyhow::Result<Self> {
        let entries = fs::read_dir(path);
        let is_empty = entries.is_ok_and(|entries| {
            let names = entries.flatten().map(|entry| entry.file_name());
            names
                .filter(|name| !name.to_string_lossy().starts_with(PREFIX))
                .count()
                == 0
        });
        if path.exists() && !is_empty && !files.force && !path.join(CHECKSUMS).is_file() {
            bail!(
                "{}: is there already and was not made by tapjoint; give the name of a new folder, or write into it with --force",
                path.display()
            );
        }
        Self::prepare(path, files)
    }

    /// Adds a file to the folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn add(&self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let written = fs::write(self.place_of(name), signed(bytes));
        written.map_err(|cause| failed(&self.path.join(name), &cause))
    }

    /// Returns the path for a file that is too long to be added in one piece.
    pub(super) fn place_of(&self, name: &str) -> PathBuf {
        self.filled().join(name)
    }

    /// Returns the folder that is being filled.
    fn filled(&self) -> PathBuf {
        self.staging.path().join(NEW).join(&self.target.rest)
    }

    /// Returns the text of a file that the folder already has; `None` without such a file.
    pub(super) fn earlier(&self, name: &str) -> Option<String> {
        fs::read_to_string(self.path.join(name)).ok()
    }

    /// Moves everything into its place and returns the folder.
    ///
    /// # Errors
    /// A file must not or cannot be replaced. Then nothing was changed, or the message says what was.
    pub(super) fn publish(self) -> anyhow::Result<PathBuf> {
        let (folder, _) = self.publish_without(Vec::new())?;
        Ok(folder)
    }

    /// Moves a report into its place, and removes what only an earlier report in the folder had.
    ///
    /// Returns the folder, and an error for files that could not be removed.
    ///
    /// # Errors
    /// Those of [`publish`](Self::publish).
    pub(super) fn publish_report(self) -> anyhow::Result<(PathBuf, Option<anyhow::Error>)> {
        // Only a folder with a page holds an earlier report: other commands write a report.json alone.
        let page = self.earlier("report.html");
        let earlier = page.and(self.earlier("report.json"));
        let stale = earlier.map_or_else(Vec::new, |report| earlier_files(&report));
        self.publish_without(stale)
    }

    /// Moves everything into its place, then removes those of the `stale` files that were not made again.
    ///
    /// Only files are removed, never folders. Returns the folder, and an error for the files that could not
    /// be removed. The results are written all the same, so the caller reports this error last.
    ///
    /// # Errors
    /// Those of [`publish`](Self::publish).
    pub(super) fn publish_without(
        mut self,
        stale: Vec<String>,
    ) -> anyhow::Result<(PathBuf, Option<anyhow::Error>)> {
        let names = self.add_checksums();
        for name in names.map_err(|cause| failed(&self.path, &cause))? {
            check_target(&self.path.join(name), &self.files)?;
        }
        let journal = self.journal(stale);
        let journal = journal.map_err(|cause| failed(&self.path, &cause))?;
        // No signal comes between the journal and what it says.
        let mut ledger = ledger();
        let written = journal.write(self.staging.path());
        written.map_err(|cause| failed(&self.path, &cause))?;
        let left = journal.carry_out(&mut self.staging, &self.files, &mut ledger)?;
        ledger.note(self.path.clone());
        drop(ledger);
        Ok((self.path, left))
    }

    /// Returns what is to be done, once all that it speaks of would outlive a loss of power.
    fn journal(&self, stale: Vec<String>) -> io::Result<Journal> {
        let stale = stale.into_iter().map(PathBuf::from);
        let stale = stale.filter(|name| !self.filled().join(name).exists());
        let new = self.staging.path().join(NEW);
        for name in files_below(&new)? {
            File::open(new.join(name))?.sync_all()?;
        }
        let mut moves = moves(&new, &self.target.base)?;
        // The old list of checksums stays until the last, since it says which old files may be replaced.
        moves.sort_by_key(|name| name.ends_with(CHECKSUMS));
        Ok(Journal {
            stale: stale.map(|name| self.target.rest.join(name)).collect(),
            moves,
        })
    }

    /// Adds a list of checksums if a file has no mark of the program, or the folder has a list already. Returns the names of all
    /// files.
    fn add_checksums(&self) -> io::Result<Vec<PathBuf>> {
        let filled = self.filled();
        let mut names = files_below(&filled)?;
        let marked = names.iter().map(|name| carries_mark(&filled.join(name)));
        let is_listed = self.path.join(CHECKSUMS).is_file();
        if is_listed || marked.collect::<io::Result<Vec<_>>>()?.contains(&false) {
            let new: Vec<_> = names
                .iter()
                .map(|name| (name.clone(), filled.join(name)))
                .collect();
            let list = checksum_list(&self.earlier(CHECKSUMS).unwrap_or_default(), &new)?;
            fs::write(filled.join(CHECKSUMS), list)?;
            names.push(CHECKSUMS.into());
        }
        Ok(names)
    }
}

/// What a publication does, in names relative to the folder of the staging folder.
struct Journal {
    /// Files to be moved into their place, and folders that are wholly new.
    moves: Vec<PathBuf>,
    /// Files of an earlier run that are removed.
    stale: Vec<PathBuf>,
}

impl Journal {
    /// Writes the journal so that it outlives a loss of power.
    fn write(&self, staging: &Path) -> io::Result<()> {
        let path = staging.join(JOURNAL);
        fs::write(&path, serde_json::to_vec(&(&self.moves, &self.stale))?)?;
        File::open(&path)?.sync_all()
    }

    /// Moves everything that is still to be moved and removes what is stale; or moves everything back. Whoever holds
    /// the ledger keeps signals away meanwhile. Returns an error for stale files that stay.
    ///
    /// # Errors
    /// A file must not or cannot be replaced. If the others cannot be moved back either, the staging folder is kept.
    fn carry_out(
        &self,
        staging: &mut Staging,
        files: &Files,
        ledger: &mut Ledger,
    ) -> anyhow::Result<Option<anyhow::Error>> {
        let path = staging.path().to_owned();
        let mut names = self.moves.iter();
        let Err(error) = names.try_for_each(|name| move_one(&path, name, files)) else {
            let left = self.remove_stale(base_of(&path), files);
            // From here on there is nothing to undo. A journal that stays would only be carried out again.
            let _ = fs::remove_file(path.join(JOURNAL));
            return Ok(left);
        };
        let Err(cause) = self.undo(&path) else {
            let _ = fs::remove_file(path.join(JOURNAL));
            return Err(anyhow!("{error}; nothing was changed"));
        };
        staging.keep(ledger);
        let (folder, kept) = (base_of(&path).display(), path.display());
        Err(anyhow!(
            "{error}; {folder} is half old and half new, since moving back failed: {cause}; the other halves are in {kept}; run again when the cause is gone, which ends it"
        ))
    }

    /// Moves everything back.
    fn undo(&self, staging: &Path) -> io::Result<()> {
        for name in self.moves.iter().rev() {
            let [new, old] = [NEW, OLD].map(|part| staging.join(part).join(name));
            let target = base_of(staging).join(name);
            if !is_there(&new) && is_there(&target) {
                fs::rename(&target, &new)?;
            }
            if is_there(&old) {
                fs::rename(&old, &target)?;
            }
        }
        Ok(())
    }

    /// Removes the stale files. Returns an error for those that stay.
    fn remove_stale(&self, base: &Path, files: &Files) -> Option<anyhow::Error> {
        let (mut names, mut causes) = (Vec::new(), Vec::new());
        for name in &self.stale {
            let path = base.join(name);
            let is_file = fs::symlink_metadata(&path).is_ok_and(|found| !found.is_dir());
            if !is_file || !files.may_remove(&path) {
                continue;
            }
            if let Err(cause) = fs::remove_file(&path) {
                names.push(path.display().to_string());
                causes.push(cause);
            }
        }
        let cause = causes.first()?;
        let names = names.join(", ");
        Some(anyhow!(
            "{names}: left by an earlier run, and cannot be removed: {cause}; the new files are written, so remove the old ones by hand"
        ))
    }
}

/// Moves one new file or folder into its place, and keeps the file that was there.
fn move_one(staging: &Path, name: &Path, files: &Files) -> anyhow::Result<()> {
    let [new, old] = [NEW, OLD].map(|part| staging.join(part).join(name));
    let target = base_of(staging).join(name);
    if !is_there(&new) {
        return Ok(());
    }
    if !new.is_dir() {
        check_target(&target, files)?;
    }
    let moved = keep_aside(&target, &old).and_then(|()| fs::rename(new, &target));
    moved.map_err(|cause| anyhow!("{}: could not be written: {cause}", target.display()))
}

/// Checks that the way is free for a file.
fn check_target(path: &Path, files: &Files) -> anyhow::Result<()> {
    files.check_again(path)?;
    let shown = path.display();
    match fs::metadata(path) {
        Ok(found) if found.permissions().readonly() => {
            bail!("{shown}: is read-only; allow writing to it, or choose another folder")
        }
        Err(_) if is_there(path) => {
            bail!("{shown}: is a link to nothing; remove it, or choose another folder")
        }
        _ => Ok(()),
    }
}

/// Gives a file a second name, or, where the file system has no second names, another name.
fn keep_aside(target: &Path, old: &Path) -> io::Result<()> {
    if !is_there(target) || target.is_dir() {
        return Ok(());
    }
    if let Some(folder) = old.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::hard_link(target, old).or_else(|_| fs::rename(target, old))
}

fn is_there(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// Returns what has to be moved: files, and folders that do not exist yet.
fn moves(new: &Path, base: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for name in entries(new)? {
        if new.join(&name).is_dir() && base.join(&name).is_dir() {
            let below = moves(&new.join(&name), &base.join(&name))?;
            found.extend(below.iter().map(|file| name.join(file)));
        } else {
            found.push(name);
        }
    }
    Ok(found)
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
    let mut files = Vec::new();
    for name in entries(folder)? {
        if fs::symlink_metadata(folder.join(&name))?.is_dir() {
            let below = files_below(&folder.join(&name))?;
            files.extend(below.iter().map(|file| name.join(file)));
        } else {
            files.push(name);
        }
    }
    Ok(files)
}

/// Returns the names in a folder in order, temporary ones left out.
fn entries(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder)?;
    let names = entries.map(|entry| entry.map(|entry| PathBuf::from(entry.file_name())));
    let mut names = names.collect::<io::Result<Vec<_>>>()?;
    names.retain(|name| !name.to_string_lossy().starts_with(PREFIX));
    names.sort();
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Documents as the program writes them.
    const OLD_TEXT: &str = r#"{"version": 1, "warnings": []}"#;
    const NEW_TEXT: &str = r#"{"version": 2, "warnings": []}"#;

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
    fn regress_a_new_folder_is_published_with_its_parents() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/report");
        drop(OutputFolder::prepare(&path, &Files::default()).unwrap());
        assert_eq!(
            names(folder.path()),
            [""; 0],
            "preparing left something behind"
        );
        let output = OutputFolder::prepare(&path, &Files::default()).unwrap();
        output.add("report.json", NEW_TEXT.as_bytes()).unwrap();
        output.publish().unwrap();
        assert_eq!(names(&path), ["report.json"]);
        assert_eq!(names(folder.path()), ["deep"]);
    }

    #[test]
    fn regress_an_existing_folder_keeps_strangers_and_replaces_ours() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("notes.txt"), "mine").unwrap();
        fs::write(folder.path().join("report.json"), OLD_TEXT).unwrap();
        let output = OutputFolder::prepare(folder.path(), &Files::default()).unwrap();
        output.add("report.json", NEW_TEXT.as_bytes()).unwrap();
        output.publish().unwrap();
        assert_eq!(names(folder.path()), ["notes.txt", "report.json"]);
        assert_eq!(
            fs::read_to_string(folder.path().join("report.json")).unwrap(),
            NEW_TEXT
        );
    }

    #[test]
    fn regress_leftovers_go_and_strangers_stay() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["notes.txt", "old.png", "report.json"] {
            fs::write(folder.path().join(name), OLD_TEXT).unwrap();
        }
        fs::create_dir(folder.path().join("folder")).unwrap();
        let output = OutputFolder::prepare(folder.path(), &Files::default()).unwrap();
        assert_eq!(output.earlier("report.json").as_deref(), Some(OLD_TEXT));
        output.add("report.json", NEW_TEXT.as_bytes()).unwrap();
        let stale = ["old.png", "report.json", "gone.png", "folder"].map(str::to_owned);
        let (_, left) = output.publish_without(stale.into()).unwrap();
        assert!(left.is_none(), "{left:?}");
        assert_eq!(
            names(folder.path()),
            ["folder", "notes.txt", "report.json"],
            "leftovers"
        );
        let kept = fs::read_to_string(folder.path().join("report.json")).unwrap();
        assert_eq!(kept, NEW_TEXT);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn regress_what_cannot_be_removed_is_told_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["old.png", "older.png"] {
            fs::write(folder.path().join(name), OLD_TEXT).unwrap();
        }
        let output = OutputFolder::prepare(folder.path(), &Files::default()).unwrap();
        output.add("report.json", NEW_TEXT.as_bytes()).unwrap();
        // Files of the kernel cannot be removed, not even by the system's owner.
        std::os::unix::fs::symlink("/proc", folder.path().join("kernel")).unwrap();
        let stale = ["old.png", "kernel/version", "kernel/uptime", "older.png"];
        let stale = stale.map(str::to_owned);
        let (_, left) = output.publish_without(stale.into()).unwrap();
        assert_eq!(names(folder.path()), ["kernel", "report.json"], "leftovers");
        let told = left.expect("two files stay").to_string();
        for part in ["kernel/version, ", "kernel/uptime: left by an earlier run"] {
            assert!(told.contains(part), "{told}");
        }
    }

    #[test]
    fn regress_files_in_the_way_of_a_folder() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "x").unwrap();
        for path in [file.clone(), file.join("below")] {
            let error =
                OutputFolder::prepare(&path, &Files::default()).expect_err("a file is in the way");
            assert!(
                error.to_string().contains(": is a file, but a folder"),
                "{path:?}: {error}"
            );
        }
    }

    /// A staging folder of a dead process that was to publish a.json and z.json, and had moved `moved`.
    fn begun(folder: &Path, moved: &[&str]) -> PathBuf {
        let staging = Target::of(folder)
            .unwrap()
            .staging_in(&folder.canonicalize().unwrap());
        for part in [NEW, OLD] {
            fs::create_dir_all(staging.join(part)).unwrap();
        }
        for name in ["a.json", "z.json"] {
            fs::write(folder.join(name), OLD_TEXT).unwrap();
            fs::write(staging.join(NEW).join(name), NEW_TEXT).unwrap();
            if moved.contains(&name) {
                move_one(&staging, Path::new(name), &Files::default()).unwrap();
            }
        }
        let journal = Journal {
            moves: ["a.json", "z.json"].map(PathBuf::from).to_vec(),
            stale: Vec::new(),
        };
        journal.write(&staging).unwrap();
        staging
    }

    #[test]
    fn regress_a_begun_publication_is_ended_before_its_files_are_judged() {
        use super::super::overwrite::is_made_here;
        let folder = tempfile::tempdir().unwrap();
        let staging = Target::of(folder.path())
            .unwrap()
            .staging_in(&folder.path().canonicalize().unwrap());
        let recording = folder.path().join("a.wav");
        for (place, text) in [
            (folder.path().to_owned(), OLD_TEXT),
            (staging.join(NEW), NEW_TEXT),
        ] {
            fs::create_dir_all(&place).unwrap();
            let name = PathBuf::from("a.wav");
            fs::write(place.join(&name), text).unwrap();
            let list = checksum_list("", &[(name.clone(), place.join(&name))]).unwrap();
            fs::write(place.join(CHECKSUMS), list).unwrap();
        }
        fs::create_dir_all(staging.join(OLD)).unwrap();
        let journal = Journal {
            moves: ["a.wav", CHECKSUMS].map(PathBuf::from).to_vec(),
            stale: Vec::new(),
        };
        journal.write(&staging).unwrap();
        // The kill comes between the recording and the list.
        move_one(&staging, Path::new("a.wav"), &Files::default()).unwrap();
        assert!(!is_made_here(&recording));
        end_begun(folder.path(), &Files::default()).unwrap();
        assert!(is_made_here(&recording) && !staging.exists());
    }

    #[test]
    fn recover_what_a_dead_process_began_is_finished_or_undone() {
        for moved in [&[][..], &["a.json"], &["a.json", "z.json"]] {
            for blocked in [false, true] {
                let folder = tempfile::tempdir().unwrap();
                begun(folder.path(), moved);
                let last = folder.path().join("z.json");
                // A file that somebody has written since must stay, and the other is moved back.
                let is_blocked = blocked && !moved.contains(&"z.json");
                if is_blocked {
                    fs::write(&last, "mine").unwrap();
                }
                drop(OutputFolder::prepare(folder.path(), &Files::default()).unwrap());
                let read = |name| fs::read_to_string(folder.path().join(name)).unwrap();
                let expected = match is_blocked {
                    true => [OLD_TEXT, "mine"],
                    false => [NEW_TEXT, NEW_TEXT],
                };
                assert_eq!(["a.json", "z.json"].map(read), expected, "{moved:?}");
                assert_eq!(names(folder.path()), ["a.json", "z.json"], "{moved:?}");
            }
        }
    }

    #[test]
    fn recover_a_journal_that_ends_early_was_never_begun() {
        let folder = tempfile::tempdir().unwrap();
        let journal = begun(folder.path(), &[]).join(JOURNAL);
        let text = fs::read_to_string(&journal).unwrap();
        fs::write(&journal, &text[..text.len() - 1]).unwrap();
        drop(OutputFolder::prepare(folder.path(), &Files::default()).unwrap());
        let kept = fs::read_to_string(folder.path().join("a.json")).unwrap();
        assert_eq!(kept, OLD_TEXT);
        assert_eq!(names(folder.path()), ["a.json", "z.json"]);
    }

    #[test]
    fn regress_a_folder_in_the_way_changes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.json"), OLD_TEXT).unwrap();
        let output = OutputFolder::prepare(folder.path(), &Files::default()).unwrap();
        for name in ["a.json", "below.json", "z.json"] {
            output.add(name, NEW_TEXT.as_bytes()).unwrap();
        }
        fs::create_dir(folder.path().join("z.json")).unwrap();
        let error = output.publish().expect_err("a folder is in the way");
        assert!(error.to_string().contains("z.json: is a folder"), "{error}");
        let kept = fs::read_to_string(folder.path().join("a.json")).unwrap();
        assert_eq!(kept, OLD_TEXT);
        assert_eq!(names(folder.path()), ["a.json", "z.json"]);
    }

    #[test]
    fn limit_one_run_at_a_time_fills_a_folder() {
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path().join("new"), folder.path().to_owned()] {
            let first = OutputFolder::prepare(&path, &Files::default()).unwrap();
            let error = OutputFolder::prepare(&path, &Files::default()).expect_err("two");
            assert!(error.to_string().contains("another run"), "{error}");
            // Another folder is free meanwhile.
            let other = folder.path().join("other");
            drop(OutputFolder::prepare(&other, &Files::default()).unwrap());
            drop(first);
            assert_eq!(names(folder.path()), [""; 0]);
        }
    }
}
