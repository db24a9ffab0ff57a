//! The journal of a batch on disk, and those of its parts.

use super::super::error_text::listed;
use super::super::output::not_writable;
use super::super::place::node_of;
use super::shard::Shard;
use crate::batch::{JOURNAL_HEAD, Journal, JournalEntry, Key};
use anyhow::{Context, anyhow, bail};
use std::fs::{self, File, TryLockError};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Place of a record.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// Journal that holds it, from 0.
    journal: u32,
    /// Distance from its beginning (bytes).
    offset: u64,
}

/// A line of a journal with what it says.
#[derive(Debug)]
pub(super) struct Line {
    /// The line, its end included.
    pub(super) bytes: Vec<u8>,
    /// What it says.
    pub(super) entry: JournalEntry,
}

/// What a journal held when it was opened, for several threads.
#[derive(Debug, Clone)]
pub(super) struct Known(Arc<Mutex<Journal>>);

impl Known {
    /// Returns the place of a test's record of an earlier run; `None` of a test that was not analysed to its end.
    pub(super) fn place(&self, key: Key) -> Option<Place> {
        let offset = self.journal().place(key)?;
        Some(Place { journal: 0, offset })
    }

    /// Notes that the batch has a record of this test.
    pub(super) fn replace(&self, key: Key) {
        self.journal().replace(key);
    }

    /// A panic elsewhere leaves the places as they are.
    fn journal(&self) -> MutexGuard<'_, Journal> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A journal to which records are appended.
#[derive(Debug)]
pub(super) struct JournalFile {
    path: PathBuf,
    file: File,
    known: Known,
    /// Length (bytes).
    length: u64,
}

impl JournalFile {
    /// Opens a journal in a folder, or makes both. A torn last line is cut off. `force` empties a file that is no journal.
    ///
    /// # Errors
    /// It cannot be written, another process is writing it, or it is no journal.
    pub(super) fn open(folder: &Path, name: &str, force: bool) -> anyhow::Result<Self> {
        let path = folder.join(name);
        let unwritable = |cause: io::Error| not_writable(&path, folder, &cause);
        fs::create_dir_all(folder).map_err(unwritable)?;
        let mut file = loop {
            let mut options = File::options();
            let options = options.read(true).write(true).create(true).truncate(false);
            let file = options.open(&path).map_err(unwritable)?;
            match file.try_lock() {
                // Any other error: this file system has no locks. The batch goes on without one.
                Ok(()) | Err(TryLockError::Error(_)) => {}
                Err(TryLockError::WouldBlock) => bail!(
                    "{}: another run of tapjoint is writing there; wait until it has ended, or choose another folder",
                    path.display()
                ),
            }
            // Before the lock another run may have put its own journal there.
            let [own, named] = [file.metadata(), fs::metadata(&path)];
            if node_of(&own.map_err(unwritable)?) == named.ok().and_then(|named| node_of(&named)) {
                break file;
            }
        };
        let found = found_in(&file).map_err(unwritable)?;
        let found = match found {
            Some(found) => found,
            None if force => Journal::default(),
            None => bail!(
                "{}: is there already and is no journal of tapjoint; choose another folder, or replace it with --force",
                path.display()
            ),
        };
        file.set_len(found.length).map_err(unwritable)?;
        let mut length = file.seek(SeekFrom::End(0)).map_err(unwritable)?;
        if length == 0 {
            file.write_all(JOURNAL_HEAD.as_bytes())
                .map_err(unwritable)?;
            length = JOURNAL_HEAD.len() as u64;
        }
        Ok(Self {
            path,
            file,
            known: Known(Arc::new(Mutex::new(found))),
            length,
        })
    }

    /// Opens a journal as [`open`](Self::open) does; `None` where there is none.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub(super) fn open_existing(
        folder: &Path,
        name: &str,
        force: bool,
    ) -> anyhow::Result<Option<Self>> {
        let is_there = folder.join(name).is_file();
        is_there
            .then(|| Self::open(folder, name, force))
            .transpose()
    }

    /// Returns what it held when it was opened.
    pub(super) fn known(&self) -> Known {
        self.known.clone()
    }

    /// Returns the places of the records that were not replaced: those of other batches.
    pub(super) fn others(&self) -> Vec<Place> {
        let others = self.known.journal().others().into_iter();
        others.map(|offset| Place { journal: 0, offset }).collect()
    }

    /// Appends a record, and returns its place.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn append(&mut self, entry: &JournalEntry) -> anyhow::Result<Place> {
        let line = entry.line()?;
        let offset = self.length;
        // One call for the whole line: what a killed process has begun is torn, and is cut off by the next run.
        self.file.write_all(line.as_bytes()).with_context(|| {
            format!(
                "{}: could not be written; the tests so far are kept, run again to go on",
                self.path.display()
            )
        })?;
        self.length += line.len() as u64;
        Ok(Place { journal: 0, offset })
    }

    /// Returns the line at a place.
    ///
    /// # Errors
    /// It cannot be read, or was changed meanwhile.
    pub(super) fn line(&self, place: Place) -> anyhow::Result<Line> {
        read_line(&self.file, place, &self.path)
    }
}

/// Looks through a journal; `None` of a file that is none.
fn found_in(file: &File) -> io::Result<Option<Journal>> {
    let mut reader = BufReader::new(file);
    let head = reader.fill_buf()?;
    let expected = JOURNAL_HEAD.as_bytes();
    if head.starts_with(expected) {
        return Journal::read(reader).map(Some);
    }
    // A killed process may have written a part of the head.
    Ok(expected.starts_with(head).then(Journal::default))
}

fn read_line(file: impl Read + Seek, place: Place, path: &Path) -> anyhow::Result<Line> {
    let mut bytes = Vec::new();
    let mut reader = BufReader::new(file);
    let read = reader.seek(SeekFrom::Start(place.offset));
    let read = read.and_then(|_| reader.read_until(b'\n', &mut bytes));
    read.with_context(|| format!("{}: cannot be read", path.display()))?;
    let entry = JournalEntry::read(&bytes).ok_or_else(|| {
        let path = path.display();
        anyhow!("{path}: was changed while this command worked; run again")
    })?;
    Ok(Line { bytes, entry })
}

/// The journals of all parts.
#[derive(Debug)]
pub(super) struct ShardJournals {
    parts: usize,
    /// A part without tests need not have one.
    journals: Vec<PartJournal>,
}

/// The journal of a part. It is opened for each line: there may be more parts than files that a process may open.
#[derive(Debug)]
struct PartJournal {
    path: PathBuf,
    found: Journal,
}

impl ShardJournals {
    /// Looks through the journals of all parts in a folder, of `tests` tests.
    ///
    /// # Errors
    /// There are none, one of them is missing or cannot be read, or they are of different numbers of parts.
    pub(super) fn open(folder: &Path, tests: usize) -> anyhow::Result<Self> {
        let parts = parts_in(folder)?;
        // A part without tests need not have been run.
        let needed = (1..=parts).take(tests.max(1));
        let (mut journals, mut missing) = (Vec::new(), Vec::new());
        for part in needed {
            let path = folder.join(Shard { part, parts }.journal());
            let shown = path.display();
            match File::open(&path).and_then(|file| found_in(&file)) {
                Ok(Some(found)) => journals.push(PartJournal { path, found }),
                Ok(None) => bail!(
                    "{shown}: is no journal of tapjoint; remove it, and analyse its part again"
                ),
                Err(cause) if cause.kind() == io::ErrorKind::NotFound => {
                    missing.push(format!("{part}/{parts}"));
                }
                Err(cause) => return Err(cause).context(format!("{shown}: cannot be read")),
            }
        }
        if !missing.is_empty() {
            bail!(
                "{}: the journals of these parts are missing: {}; analyse them with --shard",
                folder.display(),
                listed(&missing)
            );
        }
        Ok(Self { parts, journals })
    }

    /// Returns the number of parts.
    pub(super) fn parts(&self) -> usize {
        self.parts
    }

    /// Returns the place of a test's record. The journal of its own part comes first.
    pub(super) fn place(&self, test: usize, key: Key) -> Option<Place> {
        let own = test % self.parts();
        let others = (0..self.journals.len()).filter(|journal| *journal != own);
        [own].into_iter().chain(others).find_map(|journal| {
            let offset = self.journals[journal].found.any_place(key)?;
            let journal = u32::try_from(journal).ok()?;
            Some(Place { journal, offset })
        })
    }

    /// Returns the line at a place.
    ///
    /// # Errors
    /// It cannot be read, or was changed meanwhile.
    pub(super) fn line(&self, place: Place) -> anyhow::Result<Line> {
        let path = &self.journals[place.journal as usize].path;
        let file = File::open(path);
        let file = file.with_context(|| format!("{}: cannot be read", path.display()))?;
        read_line(file, place, path)
    }
}

/// Returns the number of parts of which a folder holds journals.
fn parts_in(folder: &Path) -> anyhow::Result<usize> {
    let shown = folder.display();
    let entries = fs::read_dir(folder).with_context(|| format!("{shown}: cannot be read"))?;
    let names = entries.flatten().map(|entry| entry.file_name());
    let mut counts: Vec<usize> = names
        .filter_map(|name| Shard::of_journal(&name.to_string_lossy()))
        .map(|shard| shard.parts)
        .collect();
    counts.sort_unstable();
    counts.dedup();
    match counts[..] {
        [parts] => Ok(parts),
        [] => bail!(
            "{shown}: holds no journal of a part (batch-1-of-2.jsonl); analyse the parts first, with --shard I/N and this folder"
        ),
        [first, second, ..] => bail!(
            "{shown}: holds journals of {first} and of {second} parts; remove those that are not wanted"
        ),
    }
}
