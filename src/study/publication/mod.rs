//! Every table of Ingole & Chatterjee beside our numbers.
//!
//! The printed digits are in `tests/validation/tables`. Each row carries a verdict. A row that does not reproduce
//! carries a remark with the reason, as far as it is known.

mod cantilever;
mod lap;
mod table;

pub use table::{Printed, PublicationError, Reproduction, Row, Table, Verdict};

/// Computes every table of the paper and sets it beside the printed one.
///
/// # Errors
/// [`PublicationError`]; none for the tables as they are.
pub fn reproduce() -> Result<Reproduction, PublicationError> {
    let mut tables = cantilever::tables()?;
    tables.extend(lap::tables()?);
    Ok(Reproduction { tables })
}
