//! The updated beam with its identified joint as input of a finite-element program.
//!
//! The beam lies along x and bends in the x-y plane: w is the translation along y, theta = dw/dx the
//! rotation about z, so that every spring acts on the degrees of freedom that the theory knows, with
//! its signs.

mod abaqus;
mod nastran;

use crate::description::TestDescription;
use crate::pipeline::{Analysis, structure_details, tested_structure};
use crate::structure::joint::StiffnessUnits;
use crate::structure::{Assembly, Beam, BeamTheory, JointStiffness};

pub use abaqus::render_abaqus;
pub use nastran::render_nastran;

/// Elements along the beam: with cubic elements and consistent mass ten modes are then right to 1e-5.
const ELEMENTS: usize = 120;
/// Nodes nearer than this share of the length are one node.
const SAME: f64 = 1e-9;

/// A beam with its joint, ready to be written.
#[derive(Debug, Clone, PartialEq)]
pub struct Deck {
    /// Name of the test.
    pub name: String,
    /// Where the numbers of the joint come from.
    pub origin: String,
    /// Theory of bending.
    pub theory: BeamTheory,
    /// Runs of nodes with their beam: one, or of a lap joint two.
    pub pieces: Vec<DeckPiece>,
    /// Nodes' places (m) along the beam; of a lap joint two nodes lie at the joint.
    pub nodes: Vec<f64>,
    /// Masses (kg) on nodes, by the node's index.
    pub masses: Vec<(usize, f64)>,
    /// The joint; `None` for a free beam.
    pub joint: Option<DeckJoint>,
    /// Frequencies (Hz) that the report predicts.
    pub frequencies: Vec<f64>,
}

/// Nodes `first` to `last` of one beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeckPiece {
    /// First node's index.
    pub first: usize,
    /// Last node's index.
    pub last: usize,
    /// Section and material.
    pub beam: Beam,
}

/// Springs between two nodes, or a node and the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeckJoint {
    /// The joint's side that moves with the (right) beam.
    pub node: usize,
    /// Its other side; `None` = the ground.
    pub other: Option<usize>,
    /// Spring on w (N/m); infinite = rigid, 0 = none.
    pub translation: f64,
    /// Spring on theta (N m/rad), likewise.
    pub rotation: f64,
    /// Spring between w and theta (N, in metres and radians); 0 without coupling.
    pub cross: f64,
}

/// Why there is no deck.
#[derive(Debug, thiserror::Error)]
pub enum DeckError {
    /// Nothing was estimated and nothing is known.
    #[error("there is no joint to write: {reason}")]
    NoJoint {
        /// Why.
        reason: String,
    },
    /// A coupled joint that is rigid in one direction.
    #[error(
        "a joint with cross coupling that is rigid in one direction is no spring; give finite kt and kr"
    )]
    RigidAndCoupled,
}

/// The deck of an analysed test; `joint` (non-dimensional by the described beam) takes the place of
/// the analysis's.
///
/// # Errors
/// [`DeckError`] where no joint is known.
pub fn deck_of(
    test: &TestDescription,
    analysis: &Analysis,
    joint: Option<(JointStiffness, String)>,
) -> Result<Deck, DeckError> {
    let structure = tested_structure(test);
    let found = analysis.identification.as_ref();
    let consistent = found.and_then(|found| found.consistent.as_deref());
    let (beam, joint, origin) = match (joint, consistent) {
        (Some((joint, origin)), _) => (structure.beam, joint, origin),
        (None, Some(estimate)) => (
            estimate.beam,
            estimate.joint,
            "least squares on the frequencies".to_owned(),
        ),
        (None, None) => {
            let known = structure.known.over(None);
            let reason = found.and_then(|found| found.reason.clone());
            let joint = known.ok_or_else(|| DeckError::NoJoint {
                reason: reason.unwrap_or_else(|| "nothing was estimated".to_owned()),
            })?;
            (
                structure.beam,
                joint,
                "stated in the description".to_owned(),
            )
        }
    };
    let details = structure_details(test, &structure.beam);
    let prediction = found.map_or(&[][..], |found| &found.prediction);
    let masses = details.masses.iter().map(|mass| (mass.position, mass.size));
    let mut deck = Deck {
        name: analysis.name.clone(),
        origin,
        theory: structure.theory,
        pieces: Vec::new(),
        nodes: Vec::new(),
        masses: Vec::new(),
        joint: None,
        frequencies: prediction.iter().map(|mode| mode.predicted).collect(),
    };
    let mut masses: Vec<(f64, f64)> = masses.collect();
    let beams = match structure.assembly {
        Assembly::Lap => {
            let place = details.lap.position.unwrap_or(0.5 * beam.length);
            masses.extend(overlap_masses(place, details.lap.overlap));
            let right = details.lap.right.unwrap_or(beam);
            vec![(0.0, place, beam), (place, beam.length, right)]
        }
        _ => vec![(0.0, beam.length, beam)],
    };
    deck.mesh(&beams, &masses);
    deck.joint = match structure.assembly {
        Assembly::Free => None,
        Assembly::Cantilever => Some(springs(&beam, &joint, (0, None))?),
        Assembly::Lap => {
            let first = deck.pieces.last().map_or(0, |piece| piece.first);
            Some(springs(&beam, &joint, (first, first.checked_sub(1)))?)
        }
    };
    Ok(deck)
}

/// An overlap's mass as the estimate takes it: spread over its length, by two Gauss points a side.
fn overlap_masses(joint: f64, overlap: Option<(f64, f64)>) -> Vec<(f64, f64)> {
    let gauss = 0.25 / 3f64.sqrt();
    let points = [-0.25 - gauss, -0.25 + gauss, 0.25 - gauss, 0.25 + gauss];
    let of = |(length, mass): (f64, f64)| points.map(|point| (joint + point * length, 0.25 * mass));
    overlap.map(of).into_iter().flatten().collect()
}

/// The joint's scalar springs: with the stiffness matrix K, the inverse of the compliance
/// `[[1/Kt, -1/Ktr], [-1/Ktr, 1/Kr]]`, they are w to ground K11 + K12, theta to ground K22 + K12, and
/// between w and theta -K12.
fn springs(
    beam: &Beam,
    joint: &JointStiffness,
    (node, other): (usize, Option<usize>),
) -> Result<DeckJoint, DeckError> {
    let units = StiffnessUnits::of(beam);
    let (kt, kr) = (joint.kx * units.kt, joint.ky * units.kr);
    let plain = DeckJoint {
        node,
        other,
        translation: kt,
        rotation: kr,
        cross: 0.0,
    };
    if joint.cross_compliance == 0.0 {
        return Ok(plain);
    }
    if !(kt.is_finite() && kr.is_finite()) {
        return Err(DeckError::RigidAndCoupled);
    }
    let cross = joint.cross_compliance / units.ktr;
    let determinant = 1.0 / (kt * kr) - cross * cross;
    let coupling = cross / determinant;
    Ok(DeckJoint {
        translation: 1.0 / kr / determinant + coupling,
        rotation: 1.0 / kt / determinant + coupling,
        cross: -coupling,
        ..plain
    })
}

impl Deck {
    /// Nodes at equal distances and at every mass; elements of each beam between its own nodes.
    fn mesh(&mut self, beams: &[(f64, f64, Beam)], masses: &[(f64, f64)]) {
        let length = beams.last().map_or(1.0, |beam| beam.1);
        for &(from, to, beam) in beams {
            let count = ((to - from) / length * ELEMENTS as f64).ceil().max(1.0) as usize;
            let mut places: Vec<f64> = (0..=count)
                .map(|index| from + (to - from) * index as f64 / count as f64)
                .collect();
            let inside = masses.iter().map(|mass| mass.0);
            places.extend(inside.filter(|place| (from..=to).contains(place)));
            places.sort_by(f64::total_cmp);
            places.dedup_by(|a, b| (*a - *b).abs() < SAME * length);
            let first = self.nodes.len();
            self.nodes.extend(places);
            self.pieces.push(DeckPiece {
                first,
                last: self.nodes.len() - 1,
                beam,
            });
        }
        for (place, mass) in masses {
            let distance = |node: &(usize, &f64)| (node.1 - place).abs();
            let nodes = self.nodes.iter().enumerate();
            let nearest = nodes.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            self.masses.extend(nearest.map(|(node, _)| (node, *mass)));
        }
    }

    /// What both formats say at their head.
    fn remarks(&self) -> Vec<String> {
        let mut lines = vec![
            format!(
                "{}: beam with its joint, written by tapjoint",
                plain(&self.name)
            ),
            format!("joint: {}", self.origin),
            "units: m, kg, s, N, rad; the beam lies along x, w is along y, theta about z"
                .to_owned(),
        ];
        if self.joint.is_some_and(|joint| joint.cross != 0.0) {
            lines.push(
                "the spring between w and theta couples metres and radians: in other units invert the"
                    .to_owned(),
            );
            lines.push(
                "compliance anew, a conversion of the three springs one by one is wrong".to_owned(),
            );
        }
        let list: Vec<String> = self
            .frequencies
            .iter()
            .map(|hz| format!("{hz:.6}"))
            .collect();
        for some in list.chunks(6) {
            lines.push(format!("predicted frequencies (Hz): {}", some.join(" ")));
        }
        lines
    }
}

/// Printable ASCII, as old input formats want it.
fn plain(text: &str) -> String {
    text.chars()
        .map(|letter| {
            if letter == ' ' || letter.is_ascii_graphic() {
                letter
            } else {
                '?'
            }
        })
        .take(40)
        .collect()
}
