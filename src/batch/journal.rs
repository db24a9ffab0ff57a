//! The journal of a batch: a line of JSON for each finished test.
//!
//! Lines are only appended. A process that is killed leaves at most one torn line, which is dropped. A line holds the key of
//! a test, so the journal says which tests need not be analysed again. Of several lines with one key the newest counts. A line of a
//! finished test comes before any of an unfinished one.

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
#[derive(Debug, Clone, PartialEq)]
pub struct JournalEntry {
    /// Key of the test.
    pub key: Key,
    /// Its record.
    pub record: BatchRecord,
    /// True of a test that was not analysed to its end: the next run tries it again.
    pub again: bool,
}

/// A line of the journal as it is written.
#[derive(Serialize)]
struct Line<'a> {
    key: String,
    record: &'a BatchRecord,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    again: bool,
}

/// A line of the journal that is read.
#[derive(Deserialize)]
struct OwnedLine {
    key: String,
    record: BatchRecord,
    #[serde(default)]
    again: bool,
}

impl JournalEntry {
    /// Returns the line, its end included.
    ///
    /// # Errors
    /// The record is no JSON.
    pub fn line(&self) -> Result<String, serde_json::Error> {
        let mut line = serde_json::to_string(&Line {
            key: self.key.to_string(),
            record: &self.record,
            again: self.again,
        })?;
        line.push('\n');
        Ok(line)
    }

    /// Reads a line; `None` of a torn line, and of the first.
    pub fn read(line: &[u8]) -> Option<Self> {
        let found: OwnedLine = serde_json::from_slice(line.strip_suffix(b"\n")?).ok()?;
        Some(Self {
            key: Key::read(&found.key)?,
            record: found.record,
            again: found.again,
        })
    }
}

/// Place of a record in a journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct KeyPlace {
    key: u128,
    /// True if the test was analysed to its end.
    is_final: bool,
    /// Distance from the beginning (bytes).
    offset: u64,
    /// True once the batch has a record of this test.
    is_replaced: bool,
}

/// Places of the records of a journal: 32 bytes a record.
#[derive(Debug, Clone, Default)]
pub struct Journal {
    /// The newest place of each key, ascending in the key.
    places: Vec<KeyPlace>,
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
                break;
            }
            if let Some(found) = JournalEntry::read(&line) {
                journal.places.push(KeyPlace {
                    key: found.key.short(),
                    is_final: !found.again,
                    offset: journal.length,
                    is_replaced: false,
                });
            }
            journal.length += count;
        }
        // The last of a key is the newest, and one of a test that was analysed to its end comes after the others.
        journal.places.sort_unstable();
        journal.places.reverse();
        journal.places.dedup_by_key(|place| place.key);
        journal.places.reverse();
        Ok(journal)
    }

    /// Returns the place of the record of a test (bytes from the beginning). `None` of a test that is not in the journal, or
    /// was not analysed to its end.
    pub fn place(&self, key: Key) -> Option<u64> {
        let place = self.places.get(self.index(key)?)?;
        place.is_final.then_some(place.offset)
    }

    /// Notes that the batch has a record of this test: [`others`](Self::others) leaves out the one that is here.
    pub fn replace(&mut self, key: Key) {
        if let Some(place) = self.index(key).and_then(|index| self.places.get_mut(index)) {
            place.is_replaced = true;
        }
    }

    /// Returns the place of the record of a test, also of one that was not analysed to its end.
    pub fn any_place(&self, key: Key) -> Option<u64> {
        let place = self.places.get(self.index(key)?)?;
        Some(place.offset)
    }

    fn index(&self, key: Key) -> Option<usize> {
        let key = key.short();
        self.places
            .binary_search_by_key(&key, |place| place.key)
            .ok()
    }

    /// Returns the places of the records that were not replaced, ascending. Those of tests that were not analysed to their
    /// end are left out.
    pub fn others(&self) -> Vec<u64> {
        let others = self.places.iter();
        let others = others.filter(|place| place.is_final && !place.is_replaced);
        let mut others: Vec<u64> = others.map(|place| place.offset).collect();
        others.sort_unstable();
        others
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

    fn line(number: u8, record: BatchRecord) -> String {
        let entry = JournalEntry {
            key: key(number),
            record,
            again: false,
        };
        entry.line().unwrap()
    }

    proptest! {
        #[test]
        fn prop_a_record_goes_through_its_line_without_loss(
            file in ".*",
            bits in any::<u64>(),
        ) {
            let frequency = Some(f64::from_bits(bits)).filter(|value| value.is_finite());
            let own = record(&file, frequency);
            let line = line(7, own.clone());
            prop_assert_eq!(line.matches('\n').count(), 1);
            let found = JournalEntry::read(line.as_bytes()).unwrap();
            prop_assert_eq!((found.key, found.again), (key(7), false));
            let [before, after] = [&own, &found.record].map(|one| one.modes[0].frequency.map(f64::to_bits));
            prop_assert_eq!(before, after);
            prop_assert_eq!(own, found.record);
        }
    }

    #[test]
    fn recover_a_journal_that_ends_anywhere_keeps_its_whole_lines() {
        let mut text = JOURNAL_HEAD.to_owned();
        let mut ends = vec![text.len()];
        for number in 0..3 {
            text += &line(number, record("a", Some(0.1 + f64::from(number))));
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
        let good = line(1, record("a", None));
        let text = format!("{JOURNAL_HEAD}\u{0}\u{0}\n{{\"key\":1}}\n{good}");
        let found = Journal::read(text.as_bytes()).unwrap();
        assert_eq!((found.len(), found.length), (1, text.len() as u64));
        let place = found.place(key(1)).unwrap() as usize;
        assert_eq!(&text[place..], good);
        assert_eq!(found.place(key(2)), None);
    }

    #[test]
    fn regress_the_newest_record_of_a_key_counts_and_others_are_kept() {
        let begun = |number| {
            let entry = JournalEntry {
                key: key(number),
                record: record("begun", None),
                again: true,
            };
            entry.line().unwrap()
        };
        let lines = [
            line(2, record("old", None)),
            line(1, record("other", None)),
            begun(3),
            line(2, record("new", None)),
            begun(2),
        ];
        let mut found = Journal::read(lines.concat().as_bytes()).unwrap();
        let start = |line: usize| lines[..line].concat().len() as u64;
        assert_eq!(found.place(key(2)), Some(start(3)));
        // A test that was not analysed to its end is tried again, and has a row where nothing better is there.
        assert_eq!(found.place(key(3)), None);
        assert_eq!(found.any_place(key(3)), Some(start(2)));
        // A record is kept until the batch has another one.
        assert_eq!(found.others(), [start(1), start(3)]);
        found.replace(key(2));
        assert_eq!(found.others(), [start(1)]);
    }
}
