//! Studies that need both sides: the published paper's tables beside ours, and the blind check.

pub mod blind_check;
pub mod paper;
