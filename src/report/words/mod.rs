//! Every sentence about a result, once.

pub mod findings;
pub mod gap;
