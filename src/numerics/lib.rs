//! Numbers: quantities read with their units, statistics and the least-squares solver that several stages share.

pub mod least_squares;
pub mod quantity;
pub mod stats;
