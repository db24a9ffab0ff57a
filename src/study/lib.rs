//! Studies that need both sides: the published paper's tables beside ours, the blind check, what
//! a planned test could tell apart, and what the spectral resolution of a virtual test does to the
//! stiffness estimated from it.

pub mod blind_check;

pub mod plan;
pub mod publication;
pub mod resolution;
pub mod updated_model;
