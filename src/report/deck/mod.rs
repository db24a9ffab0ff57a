//! The updated beam with its identified joint as input of a finite-element program.
//!
//! The beam lies along x and bends in the x-y plane. w is the translation along y, and theta = dw/dx the
//! rotation about z. So every spring acts on the degrees of freedom of the theory, with its signs.

mod formats;
mod reported;

use crate::screen::lines_of;
use tapjoint_analysis::{Analysis, jointed_structure, structure_details, tested_structure};
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::specimen::{Body, Hinge, Joint, Mesh, Specimen};
use tapjoint_beam::{Assembly, Beam, BeamTheory, JointStiffness, StructureError, WidthStiffening};
use tapjoint_description::TestDescription;
use tapjoint_identify::consistent::JointedStructure;

pub use formats::{render_abaqus, render_nastran};
pub use reported::{LONGEST_REPORT, ReportError, USUAL_FREQUENCIES, doubts_of, source_in_report};

/// Elements along the beam: with cubic elements and consistent mass ten modes are then right to 1e-5.
const ELEMENTS: usize = 120;
/// Most predicted frequencies at the head of a deck: a mode needs three elements.
pub const MOST_FREQUENCIES: usize = ELEMENTS / 3;
/// Longest remark that old input formats take (characters).
const LONGEST: usize = 72;
/// Nodes nearer than this share of the length are one node.
const SAME: f64 = 1e-9;

/// A beam with its joint, ready to be written.
#[derive(Debug, Clone, PartialEq)]
pub struct Deck {
    /// Name of the test.
    pub name: String,
    /// Source of the joint's numbers.
    pub origin: String,
    /// Doubts about the joint's numbers: the model's misfit, and their limits.
    pub doubts: Vec<String>,
    /// Theory of bending.
    pub theory: BeamTheory,
    /// Runs of nodes with their beam: one, of a lap joint two, and one more for every crack.
    pub pieces: Vec<DeckPiece>,
    /// Nodes' places (m) along the beam; two nodes lie at the joint of a lap joint, and at every crack.
    pub nodes: Vec<f64>,
    /// Masses on nodes.
    pub masses: Vec<DeckMass>,
    /// The joint; `None` for a free beam.
    pub joint: Option<DeckJoint>,
    /// Cracks: hinges between two nodes.
    pub hinges: Vec<DeckJoint>,
    /// Springs on w between a node, by its index, and the ground (N/m).
    pub springs: Vec<(usize, f64)>,
    /// Frequencies (Hz) that are predicted with what the deck says.
    pub frequencies: Vec<f64>,
    /// By how much (1) the width would raise each of them: beam elements know nothing of it. Empty where it does not.
    pub stiffening: Vec<f64>,
}

/// Nodes `first` to `last` of one beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeckPiece {
    /// First node's index.
    pub first: usize,
    /// Last node's index.
    pub last: usize,
    /// Its length, section and material.
    pub beam: Beam,
}

/// A mass on a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeckMass {
    /// The node's index.
    pub node: usize,
    /// Mass (kg).
    pub mass: f64,
    /// Moment of inertia about z (kg m2).
    pub inertia: f64,
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

/// Reasons for which there is no deck.
#[derive(Debug, thiserror::Error)]
pub enum DeckError {
    /// Nothing was estimated and nothing is known.
    #[error("there is no joint to write: {reason}")]
    NoJoint {
        /// The reason.
        reason: String,
    },
    /// A coupled joint that is rigid in one direction.
    #[error(
        "a joint with cross coupling that is rigid in one direction is no spring; give finite kt and kr"
    )]
    RigidAndCoupled,
    /// An effect without elements of its own.
    #[error(
        "a deck has no elements for {what}; take that [[effect]] out, or predict with the description itself"
    )]
    NoElement {
        /// The property that it changes.
        what: &'static str,
    },
    /// A beam or a lap joint that cannot exist.
    #[error(transparent)]
    Structure(#[from] StructureError),
}

/// Input of a deck.
#[derive(Debug, Clone, PartialEq)]
pub struct DeckSource {
    /// The structure without its joint, of the beam that belongs to the joint.
    pub structure: JointedStructure,
    /// The joint, non-dimensional by that beam.
    pub joint: JointStiffness,
    /// Its source.
    pub origin: String,
    /// Doubts about its numbers.
    pub doubts: Vec<String>,
    /// Frequencies (Hz) that both together predict.
    pub frequencies: Vec<f64>,
}

/// The structure and joint that an analysed test predicts with.
///
/// # Errors
/// [`DeckError::NoJoint`] where no joint is known.
pub fn source_of(test: &TestDescription, analysis: &Analysis) -> Result<DeckSource, DeckError> {
    let structure = tested_structure(test);
    let found = analysis.identification.as_ref();
    let known = found.and_then(|found| Some((found, found.beam_and_joint(&structure)?)));
    let Some((found, (beam, joint))) = known else {
        let reason = found.and_then(|found| found.reason.clone());
        let reason = reason.unwrap_or_else(|| "nothing was estimated".to_owned());
        return Err(DeckError::NoJoint { reason });
    };
    let origin = match (&found.consistent, &found.estimate) {
        (Some(_), _) => "least squares on the frequencies",
        (None, _) if structure.known.over(None).is_some() => "stated in the description",
        (None, Some(_)) => "estimated in closed form",
        (None, None) => "stated in the description",
    };
    let details = structure_details(test, &structure.beam);
    Ok(DeckSource {
        structure: match found.predicts_with_details(&structure) {
            true => jointed_structure(&structure, &details).with_beam(&beam),
            false => JointedStructure::new(structure.theory, beam, structure.assembly),
        },
        joint,
        origin: origin.to_owned(),
        doubts: Vec::new(),
        frequencies: found.prediction.iter().map(|mode| mode.predicted).collect(),
    })
}

/// The deck of a test of this name.
///
/// # Errors
/// [`DeckError`] where structure or joint cannot be written.
pub fn deck_of(name: &str, source: &DeckSource) -> Result<Deck, DeckError> {
    let structure = &source.structure;
    let mut deck = Deck::new(name, &source.origin, structure.theory, &source.frequencies);
    deck.doubts.clone_from(&source.doubts);
    let body = structure.body()?;
    let specimen = structure.specimen(None);
    let mut masses = specimen.masses.clone();
    masses.extend(specimen.overlap_masses());
    masses.retain(|mass| mass.mass != 0.0);
    let places: Vec<f64> = masses.iter().map(|mass| mass.position).collect();
    deck.mesh(body.beams(), &places);
    for mass in masses {
        deck.add_mass(mass.position, mass.mass, 0.0);
    }
    let held = (structure.assembly != Assembly::Free).then(|| source.joint.in_si(&structure.beam));
    deck.without_width(&structure.specimen(held))?;
    let node = match structure.assembly {
        Assembly::Free => return Ok(deck),
        Assembly::Cantilever => 0,
        Assembly::Lap => deck.pieces.last().map_or(0, |piece| piece.first),
    };
    let units = StiffnessUnits::of(&structure.beam);
    let joint = &source.joint;
    let (kt, kr) = (joint.kx * units.kt, joint.ky * units.kr);
    let cross = joint.cross_compliance / units.ktr;
    deck.joint = Some(scalar_springs(kt, kr, cross, node)?);
    Ok(deck)
}

/// Returns the scalar springs of a joint of Kt (N/m), Kr (N m/rad) and 1/Ktr (rad/N).
///
/// The stiffness matrix K is the inverse of the compliance `[[1/Kt, -1/Ktr], [-1/Ktr, 1/Kr]]`. The springs are w to
/// ground K11 + K12, theta to ground K22 + K12, and -K12 between w and theta.
fn scalar_springs(kt: f64, kr: f64, cross: f64, node: usize) -> Result<DeckJoint, DeckError> {
    let plain = DeckJoint {
        node,
        // The first node stands on the ground, any other beside the end of the piece before it.
        other: node.checked_sub(1),
        translation: kt,
        rotation: kr,
        cross: 0.0,
    };
    if cross == 0.0 {
        return Ok(plain);
    }
    if !(kt.is_finite() && kr.is_finite()) {
        return Err(DeckError::RigidAndCoupled);
    }
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
    /// A deck without nodes.
    fn new(name: &str, origin: &str, theory: BeamTheory, frequencies: &[f64]) -> Deck {
        Deck {
            name: name.to_owned(),
            origin: origin.to_owned(),
            doubts: Vec::new(),
            theory,
            pieces: Vec::new(),
            nodes: Vec::new(),
            masses: Vec::new(),
            joint: None,
            hinges: Vec::new(),
            springs: Vec::new(),
            frequencies: frequencies.to_vec(),
            stiffening: Vec::new(),
        }
    }

    /// Takes the stiffening by the width out of the predicted frequencies of a specimen.
    fn without_width(&mut self, specimen: &Specimen) -> Result<(), StructureError> {
        if !specimen.is_stiffened() {
            return Ok(());
        }
        let plain = Specimen {
            width_stiffening: WidthStiffening::Ignored,
            ..specimen.clone()
        };
        let count = self.frequencies.len();
        let stiff = specimen.modes(count, Mesh::SIMULATION)?;
        let plain = plain.modes(count, Mesh::SIMULATION)?;
        let ratios = stiff.frequencies().iter().zip(plain.frequencies());
        self.stiffening = ratios.map(|(stiff, plain)| stiff / plain - 1.0).collect();
        for (frequency, more) in self.frequencies.iter_mut().zip(&self.stiffening) {
            *frequency /= 1.0 + more;
        }
        Ok(())
    }

    /// Nodes at these places and at equal distances between them: a short element beside a node of a regular mesh
    /// would cost digits. Elements of each beam between its own nodes.
    fn mesh(&mut self, beams: &[Beam], at: &[f64]) {
        let length: f64 = beams.iter().map(|beam| beam.length).sum();
        let longest = length / ELEMENTS as f64;
        let mut from = 0.0;
        for beam in beams {
            let to = from + beam.length;
            let inside = at
                .iter()
                .filter(|place| (from..=to).contains(*place))
                .copied();
            let mut ends: Vec<f64> = inside.chain([from, to]).collect();
            ends.sort_by(f64::total_cmp);
            ends.dedup_by(|a, b| (*a - *b).abs() < SAME * length);
            let first = self.nodes.len();
            for pair in ends.windows(2) {
                // A little more than whole, by rounding, is whole.
                let count = ((pair[1] - pair[0]) / longest - 1e-6).ceil().max(1.0) as usize;
                let step = (pair[1] - pair[0]) / count as f64;
                let places = (0..count).map(|index| pair[0] + step * index as f64);
                self.nodes.extend(places);
            }
            self.nodes.extend(ends.last());
            self.pieces.push(DeckPiece {
                first,
                last: self.nodes.len() - 1,
                beam: *beam,
            });
            from = to;
        }
    }

    /// Returns the node nearest to a place (m).
    fn node_at(&self, place: f64) -> Option<usize> {
        nearest(place, self.nodes.iter().copied())
    }

    fn add_mass(&mut self, place: f64, mass: f64, inertia: f64) {
        if let Some(node) = self.node_at(place) {
            self.masses.push(DeckMass {
                node,
                mass,
                inertia,
            });
        }
    }

    /// Lower end (Hz) of the frequencies to compute, in both formats: a structure that is not held has rigid-body
    /// motions, which lie below 1 Hz.
    fn least_frequency(&self) -> &'static str {
        match self.joint {
            Some(DeckJoint { other: None, .. }) => "",
            _ => "1.",
        }
    }

    /// Returns the remarks at the head of both formats, each behind the sign of a comment.
    fn remarks(&self, sign: &str) -> String {
        let name: String = ascii(&self.name).chars().take(40).collect();
        let mut lines = vec![
            format!("{name}: beam with its joint, written by tapjoint"),
            format!("joint: {}", self.origin),
        ];
        let doubts = self.doubts.iter();
        let doubts = doubts.flat_map(|doubt| lines_of(&doubt.replace('\u{a0}', " "), LONGEST, 0));
        lines.extend(doubts.map(|line| ascii(&line)));
        let units = "units: m, kg, s, N, rad; the beam lies along x, w is along y, theta about z";
        lines.push(units.to_owned());
        if self.joint.is_some_and(|joint| joint.cross != 0.0) {
            let caution = [
                "the spring between w and theta couples metres and radians: in other units invert the",
                "compliance anew, a conversion of the three springs one by one is wrong",
            ];
            lines.extend(caution.map(str::to_owned));
        }
        for some in self.frequencies.chunks(6) {
            let some: Vec<String> = some.iter().map(|hz| format!("{hz:.6}")).collect();
            lines.push(format!("predicted frequencies (Hz): {}", some.join(" ")));
        }
        if !self.stiffening.is_empty() {
            lines.push(
                "beam elements are not stiffened by the width, as in tapjoint's model:".to_owned(),
            );
        }
        for some in self.stiffening.chunks(6) {
            let some: Vec<String> = some
                .iter()
                .map(|one| format!("{:.3}", 100.0 * one))
                .collect();
            lines.push(format!(
                "this would raise the frequencies by (%): {}",
                some.join(" ")
            ));
        }
        let lines = lines.iter().map(|line| format!("{sign}{line}\n"));
        lines.collect()
    }
}

/// Returns a text in printable ASCII.
fn ascii(text: &str) -> String {
    text.replace(
        |letter: char| letter != ' ' && !letter.is_ascii_graphic(),
        "?",
    )
}

/// Returns the index of the value nearest to a place.
fn nearest(place: f64, values: impl Iterator<Item = f64>) -> Option<usize> {
    let distances = values.map(|value| (value - place).abs()).enumerate();
    let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.map(|(index, _)| index)
}

/// The deck of a structure, and the frequencies (Hz) that it is predicted to have.
///
/// # Errors
/// [`DeckError::NoElement`] of what no element of a plane beam shows (an axial force, a fixture that rocks, a beam
/// with part of its shear and rotary inertia), and of sections and resonators, which no effect has; [`DeckError::RigidAndCoupled`] as for any joint.
pub fn deck_with_effects(
    name: &str,
    origin: &str,
    specimen: &Specimen,
    frequencies: &[f64],
) -> Result<Deck, DeckError> {
    let mut deck = Deck::new(name, origin, theory_of(specimen)?, frequencies);
    deck.without_width(specimen)?;
    // Cracks that lie within a beam, from left to right.
    let beams = specimen.body.beams();
    let length: f64 = beams.iter().map(|beam| beam.length).sum();
    let mut cracks = specimen.hinges.clone();
    cracks
        .retain(|crack| crack.position > 0.0 && crack.position < length && crack.compliance > 0.0);
    cracks.sort_by(|a, b| a.position.total_cmp(&b.position));
    let masses = specimen.masses.iter().map(|mass| mass.position);
    let springs = specimen.springs.iter().map(|spring| spring.position);
    let places: Vec<f64> = masses.chain(springs).collect();
    deck.mesh(&cut(beams, &cracks), &places);
    if let Some(Joint { kt, kr, coupling }) = specimen.joint {
        // At the left end, or between the halves.
        let node = match &specimen.body {
            Body::One(_) => 0,
            Body::Joined([left, _]) => deck.first_beyond(left.length),
        };
        let cross = match coupling {
            0.0 => 0.0,
            coupling => coupling / (kt * kr).sqrt(),
        };
        deck.joint = Some(scalar_springs(kt, kr, cross, node)?);
    }
    for crack in &cracks {
        let node = deck.first_beyond(crack.position);
        deck.hinges.push(DeckJoint {
            node,
            other: node.checked_sub(1),
            translation: f64::INFINITY,
            rotation: crack.compliance.recip(),
            cross: 0.0,
        });
    }
    for mass in &specimen.masses {
        deck.add_mass(mass.position, mass.mass, mass.inertia);
    }
    for spring in &specimen.springs {
        let node = deck.node_at(spring.position);
        deck.springs
            .extend(node.map(|node| (node, spring.stiffness)));
    }
    let moving = &specimen.joint_mass;
    if moving.mass != 0.0 || moving.inertia != 0.0 {
        let joint = deck.joint.iter();
        let sides = joint.flat_map(|joint| [Some(joint.node), joint.other]);
        let sides: Vec<usize> = sides.flatten().collect();
        let share = 1.0 / sides.len().max(1) as f64;
        deck.masses.extend(sides.iter().map(|&node| DeckMass {
            node,
            mass: share * moving.mass,
            inertia: share * moving.inertia,
        }));
    }
    Ok(deck)
}

/// By which theory the specimen bends, where nothing is in it that has no element.
fn theory_of(specimen: &Specimen) -> Result<BeamTheory, DeckError> {
    let what = if specimen.axial_force != 0.0 {
        "an axial load"
    } else if specimen.base.is_some() {
        "a fixture that rocks"
    } else if specimen.overlap.is_some_and(|overlap| overlap.mass != 0.0) {
        "the spread mass of an overlap beside effects"
    } else if !specimen.sections.is_empty() {
        "a section that differs from the rest of the beam"
    } else if !specimen.resonators.is_empty() {
        "a sprung mass"
    } else if specimen.shear_rotary == 0.0 {
        return Ok(BeamTheory::Euler);
    } else if specimen.shear_rotary == 1.0 {
        return Ok(BeamTheory::Timoshenko);
    } else {
        "a part of the shear and of the rotary inertia"
    };
    Err(DeckError::NoElement { what })
}

/// The beams, cut at the cracks.
fn cut(beams: &[Beam], cracks: &[Hinge]) -> Vec<Beam> {
    let mut pieces = Vec::new();
    let mut from = 0.0;
    for beam in beams {
        let to = from + beam.length;
        let mut start = from;
        let inside = cracks.iter().map(|crack| crack.position);
        for end in inside.filter(|at| *at > from && *at < to).chain([to]) {
            pieces.push(Beam {
                length: end - start,
                ..*beam
            });
            start = end;
        }
        from = to;
    }
    pieces
}

impl Deck {
    /// Returns the first node of the piece that begins at a place (m).
    fn first_beyond(&self, place: f64) -> usize {
        let begins = self.pieces.iter().map(|piece| self.nodes[piece.first]);
        nearest(place, begins).map_or(0, |index| self.pieces[index].first)
    }
}
