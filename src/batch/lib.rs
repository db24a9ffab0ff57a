//! Many tests in one call: one test in, one record out, and tables of all records.
//!
//! ```text
//! BatchTest, BatchSettings -> answer -> BatchRecord -> line of a journal -> tables, summary
//! ```
//!
//! [`answer`] is a pure function of the test's files, its description and the settings. It may run in any thread, process or
//! machine. [`journal`] writes a record as one line of JSON and reads it back without loss. [`tables`] writes the records of
//! all tests as CSV. With the feature `parquet`, `parquet_table` writes them as Parquet. [`summary`] gathers what all tests
//! together show. Nothing here prints, and nothing but recordings is read from files.

mod answer;
pub mod input_table;
pub mod journal;
pub mod page;
#[cfg(feature = "parquet")]
pub mod parquet_table;
pub mod record;
pub mod settings;
pub mod summary;
pub mod table_file;
pub mod tables;
pub mod words;

pub use answer::{Analysed, BatchError, analyse, answer, answer_watched, failed, record_of};
pub use input_table::{InputTable, TableError};
pub use journal::{JOURNAL_HEAD, Journal, JournalEntry, Key};
pub use record::{
    BatchRecord, Estimated, HypothesisRow, ModeRow, Parameters, TestOutcome, TestRow,
};
pub use settings::{BatchSettings, BatchTest, DescribedTest, InputFile, Subject};
pub use summary::{Collector, Distribution, Outlier, Quantity, Summary};
pub use table_file::{HAS_PARQUET, TableFile, WITHOUT_PARQUET};
pub use tables::{TABLES, TableKind, TableWriter};

/// Most tests of one batch. Their names and places stay in memory.
pub const MOST_TESTS: usize = 10_000_000;
