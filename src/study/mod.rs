//! Studies that need both sides: the published paper's tables beside ours.

pub mod paper;
