//! The journal of a batch: a line of JSON for each finished test.
//!
//! Lines are only appended. A process that is killed leaves at most one torn line, which is dropped. A line holds the key of
//! a test, so the journal says which tests need not be analysed again.

use crate::record::BatchRecord;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::io::{self, BufRead};

/// First line of a journal.
pub const JOURNAL_HEAD: &str = "{\"journal\":\"tapjoint batch\",\"version\":1}\n";

/// Key of a test: the SHA-256 of all that its record depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key(pub [u8; 32]);

impl fmt::Display for Key {
    /// Writes 64 hexadecimal digits.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(out, "{byte:02x}"))
    }
}

impl Key {
    /// Reads 64 hexadecimal digits; `None` of another text.
    fn read(text: &str) -> Option<Self> {
        let mut bytes = [0; 32];
        if text.len() != 64 || !text.is_ascii() {
            return None;
        }
        for (index, byte) in bytes.iter_mut().enumerate() {
            *byte = u8::from_str_radix(&text[2 * index..2 * index + 2], 16).ok()?;
        }
        Some(Self(bytes))
    }

    /// Returns the first half of the bits, which tells the tests of a batch apart.
    fn short(self) -> u128 {
        let mut half = [0; 16];
        half.copy_from_slice(&self.0[..16]);
        u128::from_be_bytes(half)
    }
}

/// A line of the journal.
#[derive(Serialize)]
struct Line<'a> {
    key: String,
    record: &'a BatchRecord,
}

/// A line of the journal that is read.
#[derive(Deserialize)]
struct OwnedLine {
    key: String,
    record: BatchRecord,
}

/// Returns the line of a record, its end included.
///
/// # Errors
/// The record is no JSON.
pub fn journal_line(key: Key, record: &BatchRecord) -> Result<String, serde_json::Error> {
    let key = key.to_string();
    let mut line = serde_json::to_string(&Line { key, record })?;
    line.push('\n');
    Ok(line)
}

/// Returns the key and the record of a line; `None` of a torn line, and of the first.
pub fn record_in(line: &[u8]) -> Option<(Key, BatchRecord)> {
    let line = line.strip_suffix(b"\n")?;
    let found: OwnedLine = serde_json::from_slice(line).ok()?;
    Some((Key::read(&found.key)?, found.record))
}

/// Places of the records of a journal: 32 bytes a record.
#[derive(Debug, Clone, Default)]
pub struct Journal {
    /// Keys and places (bytes from the beginning of the file), ascending in the key.
    places: Vec<(u128, u64)>,
    /// Length of the whole lines (bytes). What follows was torn.
    pub length: u64,
}

impl Journal {
    /// Looks through a journal. Lines that hold no record are passed over; a last line without its end is torn.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn read(mut from: impl BufRead) -> io::Result<Self> {
        let mut journal = Self::default();
        let mut line = Vec::new();
        loop {
            line.clear();
            let count = from.read_until(b'\n', &mut line)? as u64;
            if !line.ends_with(b"\n") {
                journal.places.sort_unstable();
                return Ok(journal);
            }
            if let Some((key, _)) = record_in(&line) {
                journal.places.push((key.short(), journal.length));
            }
            journal.length += count;
        }
    }

    /// Returns the place of the record of a test (bytes from the beginning); `None` of a test that is not in the journal.
    pub fn place(&self, key: Key) -> Option<u64> {
        let first = self.places.partition_point(|(own, _)| *own < key.short());
        let (own, place) = self.places.get(first)?;
        (*own == key.short()).then_some(*place)
    }

    /// Returns the number of records.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Returns true if there are no records.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{ModeRow, TestOutcome, TestRow};
    use proptest::prelude::*;

    fn record(file: &str, frequency: Option<f64>) -> BatchRecord {
        BatchRecord {
            test: TestRow {
                file: file.to_owned(),
                outcome: TestOutcome::Answered,
                ..TestRow::default()
            },
            modes: vec![ModeRow {
                frequency,
                ..ModeRow::default()
            }],
            ..BatchRecord::default()
        }
    }

    fn key(number: u8) -> Key {
        Key([number; 32])
    }

    proptest! {
        #[test]
        fn prop_a_record_goes_through_its_line_without_loss(
            file in ".*",
            bits in any::<u64>(),
        ) {
            let frequency = Some(f64::from_bits(bits)).filter(|value| value.is_finite());
            let own = record(&file, frequency);
            let line = journal_line(key(7), &own).unwrap();
            prop_assert_eq!(line.matches('\n').count(), 1);
            let (found, again) = record_in(line.as_bytes()).unwrap();
            prop_assert_eq!(found, key(7));
            let [before, after] = [&own, &again].map(|one| one.modes[0].frequency.map(f64::to_bits));
            prop_assert_eq!(before, after);
            prop_assert_eq!(own, again);
        }
    }

    #[test]
    fn recover_a_journal_that_ends_anywhere_keeps_its_whole_lines() {
        let mut text = JOURNAL_HEAD.to_owned();
        let mut ends = vec![text.len()];
        for number in 0..3 {
            text +=
                &journal_line(key(number), &record("a", Some(0.1 + f64::from(number)))).unwrap();
            ends.push(text.len());
        }
        for cut in 0..=text.len() {
            let found = Journal::read(&text.as_bytes()[..cut]).unwrap();
            let whole = ends.iter().filter(|end| **end <= cut).count();
            assert_eq!(found.len(), whole.saturating_sub(1), "{cut}");
            let length = ends[..whole].last().copied().unwrap_or(0);
            assert_eq!(found.length, length as u64, "{cut}");
            for number in 0..3 {
                let place = found.place(key(number));
                let expected = ends[usize::from(number)];
                let is_kept = usize::from(number) + 1 < whole;
                assert_eq!(place, is_kept.then_some(expected as u64), "{cut}");
            }
        }
    }

    #[test]
    fn limit_lines_of_other_content_are_passed_over() {
        let good = journal_line(key(1), &record("a", None)).unwrap();
        let text = format!("{JOURNAL_HEAD}\u{0}\u{0}\n{{\"key\":1}}\n{good}");
        let found = Journal::read(text.as_bytes()).unwrap();
        assert_eq!((found.len(), found.length), (1, text.len() as u64));
        let place = found.place(key(1)).unwrap() as usize;
        assert_eq!(&text[place..], good);
        assert_eq!(found.place(key(2)), None);
    }
}
