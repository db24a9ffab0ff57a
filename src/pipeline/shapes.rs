//! Shapes of the estimated structure's modes, for who wants to see where sensors and taps sit on them.

use super::analysis::{Analysis, Estimate, Identification};
use super::model::TestedStructure;
use crate::structure::{JointStiffness, mode_shapes};

/// Points along the beam: enough for five half waves between two of them to look smooth.
const POINTS: usize = 121;

/// The shape of one mode.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledShape {
    /// The model's number.
    pub mode: usize,
    /// Frequency of this shape (Hz), of the uniform Euler beam.
    pub frequency: f64,
    /// Positions (m) from the joint; of a lap joint or a free beam from the left end.
    pub positions: Vec<f64>,
    /// Displacement relative to the largest (1).
    pub displacements: Vec<f64>,
}

/// Shapes of the predicted modes: of the uniform Euler beam on the estimated joint. Shear, the masses
/// of sensors and unequal halves move frequencies, and hardly the shapes. Empty where there is no
/// joint to compute them with.
pub fn sampled_shapes(analysis: &Analysis) -> Vec<SampledShape> {
    let joint = |structure: &TestedStructure| {
        let found = analysis.identification.as_ref()?;
        Some((
            *structure,
            joint_of(structure, found)?,
            found.prediction.len(),
        ))
    };
    let Some((structure, joint, count)) = analysis.structure.as_ref().and_then(joint) else {
        return Vec::new();
    };
    // A joint that no beam can stand on has no shapes; the warnings say so.
    let shapes = mode_shapes(&structure.beam, structure.assembly, &joint, count);
    shapes
        .unwrap_or_default()
        .iter()
        .enumerate()
        .map(|(index, shape)| {
            let step = structure.beam.length / (POINTS - 1) as f64;
            let positions: Vec<f64> = (0..POINTS).map(|point| step * point as f64).collect();
            let raw: Vec<f64> = positions.iter().map(|x| shape.displacement(*x)).collect();
            let largest = raw.iter().fold(0.0f64, |most, value| most.max(value.abs()));
            SampledShape {
                mode: index + 1,
                frequency: shape.frequency,
                positions,
                displacements: raw.iter().map(|value| value / largest).collect(),
            }
        })
        .collect()
}

/// The joint that predictions are made with.
fn joint_of(structure: &TestedStructure, found: &Identification) -> Option<JointStiffness> {
    match (&found.consistent, &found.estimate) {
        (Some(consistent), _) => Some(consistent.joint),
        (None, Some(Estimate::FreeBeam(_))) => Some(JointStiffness::FREE),
        (None, Some(Estimate::Joint(joint))) => structure.known.over(joint.pairs.joint()),
        (None, None) => structure.known.over(None),
    }
}
