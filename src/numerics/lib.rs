//! Numbers: quantities read with their units, and the statistics that several stages share.

pub mod quantity;
pub mod stats;
