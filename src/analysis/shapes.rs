//! Shapes of the estimated structure's modes, for who wants to see where sensors and taps sit on them.

use super::analysis::Analysis;
use super::consistent::{StructureDetails, jointed};
use super::model::TestedStructure;
use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::specimen::{Body, Mesh, PointMass, Specimen, SpecimenJoint};
use tapjoint_beam::{Assembly, Beam, JointStiffness};

/// Points along the beam: enough for five half waves between two of them to look smooth.
const POINTS: usize = 121;

/// The shape of one mode.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SampledShape {
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

/// Shapes of the predicted modes: of the structure that the prediction is of, shear, masses of sensors
/// and a lap joint's two halves included. Empty where nothing could be predicted.
pub fn sampled_shapes(analysis: &Analysis) -> Vec<SampledShape> {
    let Some(found) = &analysis.identification else {
        return Vec::new();
    };
    let Some(specimen) = &found.predicted else {
        return Vec::new();
    };
    // A joint that no beam can stand on has no shapes; the warnings say so.
    let Ok(modes) = specimen.modes(found.prediction.len(), Mesh::DIAGNOSIS) else {
        return Vec::new();
    };
    let positions = positions(&specimen.body);
    let shape = |mode: usize| {
        let raw = positions.iter().map(|(_, x)| modes.displacement(mode, *x));
        let raw: Vec<f64> = raw.collect();
        let largest = raw.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        SampledShape {
            mode: mode + 1,
            frequency: modes.frequencies()[mode],
            positions: positions.iter().map(|(x, _)| *x).collect(),
            displacements: raw.iter().map(|value| value / largest).collect(),
        }
    };
    (0..modes.len()).map(shape).collect()
}

/// Places along all beams (m), and where the model is asked for each: a hair inside the beam that is
/// meant, since two beams meet at a lap joint.
fn positions(body: &Body) -> Vec<(f64, f64)> {
    let beams = body.beams();
    let points = POINTS.div_ceil(beams.len());
    let hair = 1e-9 * body.length();
    let mut start = 0.0;
    let mut all = Vec::new();
    for beam in beams {
        let end = start + beam.length;
        let share = |point: usize| point as f64 / (points - 1) as f64;
        let places = (0..points).map(|point| start + share(point) * beam.length);
        all.extend(places.map(|x| (x, x.clamp(start + hair, end - hair))));
        start = end;
    }
    all
}

/// The structure of a prediction with this beam on this joint; `details` as for the prediction.
pub(super) fn predicted_specimen(
    structure: &TestedStructure,
    details: &StructureDetails,
    (beam, joint): (&Beam, &JointStiffness),
) -> Specimen {
    let there = jointed(structure, details).with_beam(beam);
    let units = StiffnessUnits::of(beam);
    let held = match structure.assembly {
        Assembly::Free => SpecimenJoint::Free,
        Assembly::Cantilever | Assembly::Lap => SpecimenJoint::Springs {
            kt: joint.kx * units.kt,
            kr: joint.ky * units.kr,
            coupling: joint.coupling(),
        },
    };
    let mut specimen = Specimen::jointed(
        there.theory,
        (&there.beam, there.assembly),
        &there.lap,
        held,
    );
    specimen.masses = there
        .masses
        .iter()
        .map(|mass| PointMass {
            position: mass.position,
            mass: mass.size,
            inertia: 0.0,
        })
        .collect();
    specimen
}
