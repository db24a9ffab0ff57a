//! Studies that need both simulator and chain: the published paper's tables beside ours, the blind check, and the
//! effects that a planned test could tell apart. Also the error that a virtual test's spectral resolution causes in
//! the stiffness, and a described model updated by a diagnosis. And the check of comparisons, on pairs of virtual tests.

pub mod blind_check;
pub mod change_check;
pub mod plan;
pub mod publication;
pub mod resolution;
pub mod updated_model;
