//! What is temporary: results before they are in their place.
//!
//! A living process holds a lock on each of its temporary files and folders. The lock ends with the process,
//! however it ends. What has no lock was left by a dead process and is swept. This process lists its own in
//! a ledger, so that a signal removes them. Who moves results into their place holds the ledger meanwhile:
//! a signal waits until all are moved, or all are back.

use super::place::{node_of, owner_of};
use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;
use tempfile::{Builder, NamedTempFile};

/// Beginning of the names of everything temporary.
pub(super) const PREFIX: &str = ".tapjoint-";

/// Parts of a staging folder: the new files, the earlier files, and what has to be moved.
pub(super) const NEW: &str = "new";
pub(super) const OLD: &str = "old";
pub(super) const JOURNAL: &str = "journal";
const LOCK: &str = "lock";

/// Trials to take a staging folder that another process may be sweeping, and the pause between them.
const TRIALS: usize = 20;
const PAUSE: Duration = Duration::from_millis(50);

/// Results that are noted. A message lists fewer.
const MOST_NOTED: usize = 100;

/// What this process has written, and what it has to remove before it ends.
#[derive(Debug)]
pub(super) struct Ledger {
    temporary: BTreeSet<PathBuf>,
    /// Results that are in their place; of many the first.
    pub(super) written: Vec<PathBuf>,
    /// What the first signal sets, instead of ending the process.
    pub(super) stop: Option<Arc<AtomicBool>>,
    /// Gives the terminal back before the process ends.
    pub(super) restore: Option<fn()>,
}

impl Ledger {
    /// Notes a result that is in its place. More than a message lists are not kept.
    pub(super) fn note(&mut self, path: PathBuf) {
        if self.written.len() < MOST_NOTED {
            self.written.push(path);
        }
    }
}

static LEDGER: Mutex<Ledger> = Mutex::new(Ledger {
    temporary: BTreeSet::new(),
    written: Vec::new(),
    stop: None,
    restore: None,
});

/// Returns the ledger. A signal ends the process only when nobody holds it.
pub(super) fn ledger() -> MutexGuard<'static, Ledger> {
    LEDGER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Lets SIGINT, SIGTERM and SIGHUP remove what is temporary, and end the process with 128 + signal.
///
/// # Errors
/// The system refuses the handlers.
#[cfg(unix)]
pub(super) fn watch_signals() -> io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    // A signal that `nohup` or the shell has turned off stays so.
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or_default();
    let wanted = [SIGHUP, SIGINT, SIGTERM].into_iter();
    let wanted = wanted.filter(|signal| (ignored >> (signal - 1)) & 1 == 0);
    let mut signals = signal_hook::iterator::Signals::new(wanted)?;
    thread::spawn(move || {
        for signal in signals.forever() {
            let mut ledger = ledger();
            if let Some(stop) = ledger.stop.take() {
                stop.store(true, Ordering::Relaxed);
                continue;
            }
            let temporary = ledger.temporary.iter();
            // A journal here is a dead process's, and still to be carried out.
            let own = temporary.filter(|path| !path.join(JOURNAL).exists());
            own.for_each(|path| remove(path));
            if let Some(restore) = ledger.restore {
                restore();
            }
            std::process::exit(128 + signal);
        }
    });
    Ok(())
}

#[cfg(not(unix))]
pub(super) fn watch_signals() -> io::Result<()> {
    Ok(())
}

/// Removes something temporary. What stays after all is swept by the next run.
fn remove(path: &Path) {
    if !path.is_dir() {
        let _ = fs::remove_file(path);
        return;
    }
    // Without its journal a publication counts as ended, or as never begun. The lock goes last: who finds the
    // folder without it may take it.
    let _ = fs::remove_file(path.join(JOURNAL));
    for part in [NEW, OLD] {
        // Threads that are still writing may add files meanwhile.
        let _ = (0..TRIALS).find(|_| {
            let _ = fs::remove_dir_all(path.join(part));
            !path.join(part).exists()
        });
    }
    let _ = fs::remove_file(path.join(LOCK));
    let _ = fs::remove_dir(path);
}

/// An entry of the ledger.
#[derive(Debug)]
struct Entry(PathBuf);

impl Drop for Entry {
    fn drop(&mut self) {
        ledger().temporary.remove(&self.0);
    }
}

/// A file that will be renamed.
#[derive(Debug)]
pub(super) struct TemporaryFile {
    file: NamedTempFile,
    _entry: Entry,
}

impl TemporaryFile {
    /// Makes a file, and removes what dead processes left in the folder.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub(super) fn make_in(folder: &Path) -> io::Result<Self> {
        sweep_files(folder);
        let mut ledger = ledger();
        loop {
            let file = builder().tempfile_in(folder)?;
            let path = file.path().to_owned();
            let locked = file.as_file().try_lock();
            let taken = matches!(locked, Err(TryLockError::WouldBlock));
            // Between making and locking another process may have swept it.
            if !taken && is_at(file.as_file(), &path) {
                ledger.temporary.insert(path.clone());
                let _entry = Entry(path);
                return Ok(Self { file, _entry });
            }
        }
    }

    /// Writes the whole file and renames it.
    ///
    /// # Errors
    /// Writing or renaming fails; the file is then gone.
    pub(super) fn write(mut self, bytes: &[u8], path: &Path) -> io::Result<()> {
        // Not by the named file: its errors name it, which tells the user nothing.
        self.file.as_file_mut().write_all(bytes)?;
        let renamed = self.file.persist(path);
        renamed.map(drop).map_err(|error| error.error)
    }
}

/// Removes the temporary files of dead processes.
pub(super) fn sweep_files(folder: &Path) {
    for path in leftovers(folder) {
        let is_file = fs::symlink_metadata(&path).is_ok_and(|found| found.is_file());
        let file = File::open(&path).ok().filter(|_| is_file);
        if file.is_some_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(path);
        }
    }
}

/// Returns everything temporary in a folder, of living and of dead processes.
pub(super) fn leftovers(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(PREFIX))
        .map(|entry| entry.path())
        .collect()
}

/// A folder where results wait until they are complete. Removed at the end.
#[derive(Debug)]
pub(super) struct Staging {
    entry: Entry,
    is_kept: bool,
    _lock: File,
}

impl Staging {
    /// Makes the folder, or takes that of a dead process; `None` while a living process has it.
    ///
    /// # Errors
    /// The folder cannot be made, or belongs to another user.
    pub(super) fn make(path: &Path) -> io::Result<Option<Self>> {
        let mut last = Ok(None);
        for _ in 0..TRIALS {
            last = Self::try_make(path);
            match &last {
                // Another process has it, or has just swept it.
                Ok(None) => thread::sleep(PAUSE),
                Err(cause) if cause.kind() == io::ErrorKind::NotFound && folder_is_there(path) => {}
                _ => break,
            }
        }
        last
    }

    fn try_make(path: &Path) -> io::Result<Option<Self>> {
        // From here to the entry no signal may come between.
        let mut ledger = ledger();
        match fs::create_dir(path) {
            Err(cause) if cause.kind() != io::ErrorKind::AlreadyExists => Err(cause),
            _ => Self::lock(path, true, &mut ledger),
        }
    }

    /// Takes the folder of a dead process; `None` while a living process has it.
    ///
    /// # Errors
    /// It cannot be locked, or belongs to another user.
    pub(super) fn take(path: &Path) -> io::Result<Option<Self>> {
        Self::lock(path, false, &mut ledger())
    }

    /// Locks the folder. One that is to be filled is taken without a lock where the file system has none.
    fn lock(path: &Path, is_to_fill: bool, ledger: &mut Ledger) -> io::Result<Option<Self>> {
        // Whose it is: somebody else's could hold a journal that moves files of this user.
        let found = fs::symlink_metadata(path)?;
        let own = tempfile::tempfile_in(path)?.metadata()?;
        if !found.is_dir() || owner_of(&found) != owner_of(&own) {
            let words = format!("{} belongs to somebody else", path.display());
            return Err(io::Error::other(words));
        }
        let place = path.join(LOCK);
        let mut options = File::options();
        let lock = options
            .create(true)
            .write(true)
            .truncate(false)
            .open(&place)?;
        match lock.try_lock() {
            Ok(()) if is_at(&lock, &place) => {}
            Ok(()) | Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(_)) if is_to_fill => {}
            Err(TryLockError::Error(cause)) => return Err(cause),
        }
        ledger.temporary.insert(path.to_owned());
        Ok(Some(Self {
            entry: Entry(path.to_owned()),
            is_kept: false,
            _lock: lock,
        }))
    }

    pub(super) fn path(&self) -> &Path {
        &self.entry.0
    }

    /// Returns true if the next run has to end what this folder holds.
    pub(super) fn is_kept(&self) -> bool {
        self.is_kept
    }

    /// Leaves the folder with its journal to the next run.
    pub(super) fn keep(&mut self, ledger: &mut Ledger) {
        self.is_kept = true;
        ledger.temporary.remove(self.path());
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        let _ledger = ledger();
        if !self.is_kept {
            remove(self.path());
        }
    }
}

fn folder_is_there(path: &Path) -> bool {
    path.parent().is_some_and(Path::is_dir)
}

/// Returns true if the path still leads to the open file.
fn is_at(file: &File, path: &Path) -> bool {
    let [open, named] = [file.metadata(), fs::symlink_metadata(path)].map(|found| found.ok());
    open.zip(named)
        .is_some_and(|(open, named)| node_of(&open) == node_of(&named))
}

/// Temporary files are private by default; results have the mode that the user's umask leaves.
fn builder() -> Builder<'static, 'static> {
    let mut builder = Builder::new();
    builder.prefix(PREFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder
}
