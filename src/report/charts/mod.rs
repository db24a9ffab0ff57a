//! The pictures of a report, each built once from the data that it shows.

pub mod amplitude;
pub mod blind_check;
pub mod gap;
pub mod joint;
pub mod resolution;
pub mod shapes;
pub mod spectra;
pub mod stabilisation;
pub mod taps;

/// Height of a panel that stands alone (pixels).
const HIGH: f64 = 340.0;
