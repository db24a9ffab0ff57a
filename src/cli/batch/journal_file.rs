//! The journal of a batch on disk, and those of its parts.

use super::super::output::not_writable;
use crate::batch::{BatchRecord, JOURNAL_HEAD, Journal, Key, journal_line, record_in};
use anyhow::{Context, anyhow, bail};
use std::cell::RefCell;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Place of a record.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// Journal that holds it, from 0.
    journal: u32,
    /// Distance from its beginning (bytes).
    offset: u64,
}

/// A journal to which records are appended.
#[derive(Debug)]
pub(super) struct JournalFile {
    path: PathBuf,
    file: File,
    found: Journal,
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
        let mut options = File::options();
        let options = options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(&path).map_err(unwritable)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => bail!(
                "{}: another run of tapjoint is writing there; wait until it has ended, or choose another folder",
                path.display()
            ),
            Err(TryLockError::Error(cause)) => return Err(unwritable(cause)),
        }
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
            found,
            length,
        })
    }

    /// Returns the place of a test's record of an earlier run.
    pub(super) fn place(&self, key: Key) -> Option<Place> {
        let offset = self.found.place(key)?;
        Some(Place { journal: 0, offset })
    }

    /// Appends a record, and returns its place.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn append(&mut self, key: Key, record: &BatchRecord) -> anyhow::Result<Place> {
        let line = journal_line(key, record)?;
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

    /// Returns the line and the record at a place.
    ///
    /// # Errors
    /// It cannot be read, or was changed meanwhile.
    pub(super) fn line(&self, place: Place) -> anyhow::Result<(Vec<u8>, BatchRecord)> {
        read_line(BufReader::new(&self.file), place, &self.path)
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

fn read_line(
    mut reader: impl BufRead + Seek,
    place: Place,
    path: &Path,
) -> anyhow::Result<(Vec<u8>, BatchRecord)> {
    let mut line = Vec::new();
    reader.seek(SeekFrom::Start(place.offset))?;
    reader.read_until(b'\n', &mut line)?;
    let (_, record) = record_in(&line).ok_or_else(|| {
        let path = path.display();
        anyhow!("{path}: was changed while this command worked; run again")
    })?;
    Ok((line, record))
}

/// The journals of all parts.
#[derive(Debug)]
pub(super) struct ShardJournals {
    journals: Vec<(PathBuf, RefCell<BufReader<File>>, Journal)>,
}

impl ShardJournals {
    /// Opens the journals of all parts in a folder, of `tests` tests.
    ///
    /// # Errors
    /// There are none, one of them is missing or cannot be read, or they are of different numbers of parts.
    pub(super) fn open(folder: &Path, tests: usize) -> anyhow::Result<Self> {
        let shown = folder.display();
        let entries = fs::read_dir(folder).with_context(|| format!("{shown}: cannot be read"))?;
        let names = entries.flatten().map(|entry| entry.file_name());
        let mut counts: Vec<usize> = names
            .filter_map(|name| parts_of(&name.to_string_lossy()))
            .collect();
        counts.sort_unstable();
        counts.dedup();
        let parts = match counts[..] {
            [parts] => parts,
            [] => bail!(
                "{shown}: holds no journal of a part (batch-1-of-2.jsonl); analyse the parts first, with --shard I/N and this folder"
            ),
            [first, second, ..] => bail!(
                "{shown}: holds journals of {first} and of {second} parts; remove those that are not wanted"
            ),
        };
        let shards: Vec<super::Shard> = (1..=parts)
            .map(|part| super::Shard { part, parts })
            .collect();
        // A part without tests need not have been run.
        let needed = shards.into_iter().take(tests.max(1));
        let (mut journals, mut missing) = (Vec::new(), Vec::new());
        for shard in needed {
            let path = folder.join(shard.journal());
            match File::open(&path) {
                Ok(file) => {
                    let found = found_in(&file)?.ok_or_else(|| {
                        anyhow!(
                            "{}: is no journal of tapjoint; remove it, and analyse its part again",
                            path.display()
                        )
                    })?;
                    journals.push((path, RefCell::new(BufReader::new(file)), found));
                }
                Err(cause) if cause.kind() == io::ErrorKind::NotFound => {
                    missing.push(format!("{}/{parts}", shard.part));
                }
                Err(cause) => {
                    return Err(cause)
                        .with_context(|| format!("{}: cannot be read", path.display()));
                }
            }
        }
        if !missing.is_empty() {
            let missing = missing.join(", ");
            bail!(
                "{shown}: the journals of these parts are missing: {missing}; analyse them with --shard"
            );
        }
        Ok(Self { journals })
    }

    /// Returns the number of parts.
    pub(super) fn parts(&self) -> usize {
        self.journals.len()
    }

    /// Returns the place of a test's record.
    pub(super) fn place(&self, key: Key) -> Option<Place> {
        let mut journals = (0..).zip(&self.journals);
        journals.find_map(|(journal, (_, _, found))| {
            let offset = found.place(key)?;
            Some(Place { journal, offset })
        })
    }

    /// Returns the line and the record at a place.
    ///
    /// # Errors
    /// It cannot be read, or was changed meanwhile.
    pub(super) fn line(&self, place: Place) -> anyhow::Result<(Vec<u8>, BatchRecord)> {
        let (path, reader, _) = &self.journals[place.journal as usize];
        read_line(&mut *reader.borrow_mut(), place, path)
    }
}

/// Returns the number of parts in the name of a part's journal; `None` of another name.
fn parts_of(name: &str) -> Option<usize> {
    let name = name.strip_prefix("batch-")?.strip_suffix(".jsonl")?;
    let (part, parts) = name.split_once("-of-")?;
    let shard: super::Shard = format!("{part}/{parts}").parse().ok()?;
    Some(shard.parts)
}
