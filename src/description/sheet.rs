//! `[sheet]`: what is filed with a test beside its results.

use super::reader::{DescriptionError, Entry, Table};
use schemars::JsonSchema;
use serde::Serialize;

/// Longest text of a sheet (characters), so that the sheet stays one page; remarks may be [`LONGEST_REMARKS`].
const LONGEST: usize = 60;
const LONGEST_REMARKS: usize = 300;

/// Who tested what, and when. All of it is carried to the outputs as it is written.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SheetDescription {
    /// Number of the test.
    pub number: Option<String>,
    /// Day of the test.
    pub date: Option<String>,
    /// Who tested.
    pub operator: Option<String>,
    /// What was tested, with its serial number.
    pub specimen: Option<String>,
    /// Where it was tested.
    pub laboratory: Option<String>,
    /// Anything else.
    pub remarks: Option<String>,
}

impl SheetDescription {
    pub(super) fn read(table: &Table<'_>) -> Result<Self, DescriptionError> {
        let text = |key, wanted| table.optional(key, |entry| short_text(entry, wanted, LONGEST));
        Ok(SheetDescription {
            number: text("number", "a number such as \"2024-017\"")?,
            date: table.optional("date", Entry::date)?,
            operator: text("operator", "the name of who tests")?,
            specimen: text("specimen", "what is tested, with its serial number")?,
            laboratory: text("laboratory", "the name of the laboratory")?,
            remarks: table.optional("remarks", |entry| {
                short_text(entry, "remarks in one text", LONGEST_REMARKS)
            })?,
        })
    }
}

/// Reads make, type and serial number of an instrument.
pub(super) fn instrument(table: &Table<'_>) -> Result<Option<String>, DescriptionError> {
    table.optional("instrument", |entry| {
        let wanted = "make, type and serial number, such as \"PCB 352C33, 12345\"";
        short_text(entry, wanted, LONGEST)
    })
}

/// Returns a text of so many characters at most.
fn short_text(entry: &Entry<'_>, wanted: &str, longest: usize) -> Result<String, DescriptionError> {
    let text = entry.text(wanted)?;
    match text.chars().count() {
        count if count > longest => Err(entry.error(format!(
            "{count} characters; the sheet has room for {longest}: shorten the text"
        ))),
        _ => Ok(text),
    }
}
