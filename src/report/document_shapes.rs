//! Mode shapes in the document.

use schemars::JsonSchema;
use serde::Serialize;

/// Shape of one mode of the structure that the prediction is of: the described beam, or the two halves of
/// a lap joint, on the estimated joint with the sensors' masses.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct ModeShapeSection {
    /// The model's number.
    pub mode: usize,
    /// Frequency of this shape (Hz).
    pub frequency: f64,
    /// Positions (m) from the joint; of a lap joint or a free beam from the left end. The place of a lap
    /// joint stands twice, for either half's end.
    pub positions: Vec<f64>,
    /// Displacement relative to the largest (1).
    pub displacements: Vec<f64>,
}
