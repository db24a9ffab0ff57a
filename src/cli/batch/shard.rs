//! One of several parts of the tests of a batch.

use std::str::FromStr;

/// Most parts.
const MOST_PARTS: usize = 10_000;

/// One of several parts of the tests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shard {
    /// Its number, from 1.
    pub(super) part: usize,
    /// Number of parts.
    pub(super) parts: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/');
        let numbers =
            numbers.and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
        match numbers {
            Some((part, parts)) if (1..=parts).contains(&part) && parts <= MOST_PARTS => {
                Ok(Self { part, parts })
            }
            _ => Err(format!(
                "give the number of the part and the number of parts, such as 1/4, up to {MOST_PARTS} parts"
            )),
        }
    }
}

impl Shard {
    /// All tests as one part.
    pub(super) const WHOLE: Self = Self { part: 1, parts: 1 };

    /// Returns the name of its journal.
    pub(super) fn journal(self) -> String {
        format!("batch-{}-of-{}.jsonl", self.part, self.parts)
    }

    /// Reads the name of a journal; `None` of another name.
    pub(super) fn of_journal(name: &str) -> Option<Self> {
        let name = name.strip_prefix("batch-")?.strip_suffix(".jsonl")?;
        let (part, parts) = name.split_once("-of-")?;
        format!("{part}/{parts}").parse().ok()
    }

    /// Returns the indices of its tests, of so many.
    pub(super) fn tests(self, count: usize) -> Vec<usize> {
        (self.part - 1..count).step_by(self.parts).collect()
    }
}
