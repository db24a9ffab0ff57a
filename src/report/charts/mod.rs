//! The pictures of a report, each built once from the results that it shows.

pub mod amplitude;
pub mod blind_check;
pub mod gap;
pub mod joint;
pub mod resolution;
pub mod shapes;
pub mod spectra;
pub mod stabilisation;
pub mod taps;

use super::format::unit_words;

/// Height of a panel that stands alone (pixels).
const HIGH: f64 = 340.0;

/// Returns a unit as print has it, also where none was stated.
fn unit_of(unit: &Option<String>) -> String {
    unit_words(unit.as_deref().unwrap_or("unit of the file"))
}
