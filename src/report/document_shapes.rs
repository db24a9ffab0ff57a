//! Mode shapes in the document.

use schemars::JsonSchema;
use serde::Serialize;

/// Shape of one mode of the uniform Euler beam on the estimated joint.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct ModeShapeSection {
    /// The model's number.
    pub mode: usize,
    /// Frequency of this shape (Hz).
    pub frequency: f64,
    /// Positions (m) from the joint; of a lap joint or a free beam from the left end.
    pub positions: Vec<f64>,
    /// Displacement relative to the largest (1).
    pub displacements: Vec<f64>,
}
