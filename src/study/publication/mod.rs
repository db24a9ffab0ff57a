//! Every table of Ingole & Chatterjee beside our numbers, and why some cannot be had again.
//!
//! The printed digits are in `tests/validation/tables`, as printed. Each row carries a verdict;
//! a row that does not reproduce carries a remark that says why, as far as it can be told.

mod cantilever;
mod lap;
mod table;

pub use table::{PaperError, Printed, Reproduction, Row, Table, Verdict, render};

/// Computes every table of the paper and sets it beside the printed one.
///
/// # Errors
/// [`PaperError`]; none for the tables as they are.
pub fn reproduce() -> Result<Reproduction, PaperError> {
    let mut tables = cantilever::tables()?;
    tables.extend(lap::tables()?);
    Ok(Reproduction { tables })
}
