//! Studies that need both sides: the published paper's tables beside ours, and what the spectral
//! resolution of a virtual test does to the stiffness estimated from it.

pub mod paper;
pub mod resolution;
