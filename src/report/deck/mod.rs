//! The updated beam with its identified joint as input of a finite-element program.
//!
//! The beam lies along x and bends in the x-y plane: w is the translation along y, theta = dw/dx the
//! rotation about z, so that every spring acts on the degrees of freedom that the theory knows, with
//! its signs.

mod abaqus;
mod nastran;

use tapjoint_analysis::{Analysis, jointed_structure, structure_details, tested_structure};
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::specimen::{Body, Hinge, Joint, Specimen};
use tapjoint_beam::{Assembly, Beam, BeamTheory, JointStiffness, StructureError};
use tapjoint_description::TestDescription;
use tapjoint_identify::consistent::JointedStructure;

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
    /// What has to be known of the joint's numbers: how far the model misses, and their limits.
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

impl DeckJoint {
    /// Whether the ground holds a direction without give.
    fn is_held(&self) -> bool {
        let rigid = self.translation.is_infinite() || self.rotation.is_infinite();
        self.other.is_none() && rigid
    }
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
    /// An effect without elements of its own.
    #[error(
        "a deck has no elements for {what}; take that [[effect]] out, or predict with the description itself"
    )]
    NoElement {
        /// What it changes.
        what: &'static str,
    },
    /// A beam or a lap joint that cannot exist.
    #[error(transparent)]
    Structure(#[from] StructureError),
}

/// What a deck is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct DeckSource {
    /// The structure without its joint, of the beam that belongs to the joint.
    pub structure: JointedStructure,
    /// The joint, non-dimensional by that beam.
    pub joint: JointStiffness,
    /// Where it is from.
    pub origin: String,
    /// What has to be known of its numbers.
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
    let missing = || DeckError::NoJoint {
        reason: found
            .and_then(|found| found.reason.clone())
            .unwrap_or_else(|| "nothing was estimated".to_owned()),
    };
    let found = found.ok_or_else(missing)?;
    let (beam, joint) = found.beam_and_joint(&structure).ok_or_else(missing)?;
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
    let mut deck = Deck {
        name: name.to_owned(),
        origin: source.origin.clone(),
        doubts: source.doubts.clone(),
        theory: structure.theory,
        pieces: Vec::new(),
        nodes: Vec::new(),
        masses: Vec::new(),
        joint: None,
        hinges: Vec::new(),
        springs: Vec::new(),
        frequencies: source.frequencies.clone(),
    };
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
    let (beam, joint) = (&structure.beam, &source.joint);
    deck.joint = match structure.assembly {
        Assembly::Free => None,
        Assembly::Cantilever => Some(springs(beam, joint, (0, None))?),
        Assembly::Lap => {
            let first = deck.pieces.last().map_or(0, |piece| piece.first);
            Some(springs(beam, joint, (first, first.checked_sub(1)))?)
        }
    };
    Ok(deck)
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
    let stiffnesses = (joint.kx * units.kt, joint.ky * units.kr);
    scalar_springs(
        stiffnesses,
        joint.cross_compliance / units.ktr,
        (node, other),
    )
}

/// The same from Kt (N/m), Kr (N m/rad) and 1/Ktr (rad/N).
fn scalar_springs(
    (kt, kr): (f64, f64),
    cross: f64,
    (node, other): (usize, Option<usize>),
) -> Result<DeckJoint, DeckError> {
    let plain = DeckJoint {
        node,
        other,
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
            let between = |pair: &[f64]| {
                // A little more than whole, by rounding, is whole.
                let count = ((pair[1] - pair[0]) / longest - 1e-6).ceil().max(1.0) as usize;
                let step = (pair[1] - pair[0]) / count as f64;
                let start = pair[0];
                (0..count).map(move |index| start + step * index as f64)
            };
            let places = ends.windows(2).flat_map(between);
            let places: Vec<f64> = places.chain(ends.last().copied()).collect();
            let first = self.nodes.len();
            self.nodes.extend(places);
            self.pieces.push(DeckPiece {
                first,
                last: self.nodes.len() - 1,
                beam: *beam,
            });
            from = to;
        }
    }

    /// The node at a place (m).
    fn node_at(&self, place: f64) -> Option<usize> {
        let distance = |node: &(usize, &f64)| (node.1 - place).abs();
        let nodes = self.nodes.iter().enumerate();
        let nearest = nodes.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map(|(node, _)| node)
    }

    fn add_mass(&mut self, place: f64, mass: f64, inertia: f64) {
        let node = self.node_at(place);
        let mass = |node| DeckMass {
            node,
            mass,
            inertia,
        };
        self.masses.extend(node.map(mass));
    }

    /// What both formats say at their head.
    fn remarks(&self) -> Vec<String> {
        let mut lines = vec![
            format!(
                "{}: beam with its joint, written by tapjoint",
                plain(&self.name)
            ),
            format!("joint: {}", self.origin),
        ];
        lines.extend(self.doubts.iter().flat_map(|doubt| short_lines(doubt)));
        lines.push(
            "units: m, kg, s, N, rad; the beam lies along x, w is along y, theta about z"
                .to_owned(),
        );
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

/// A remark in lines that old input formats take.
fn short_lines(text: &str) -> Vec<String> {
    const LONGEST: usize = 72;
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) if line.len() + 1 + word.len() <= LONGEST => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines.iter().map(|line| ascii(line)).collect()
}

/// A name as old input formats want it.
fn plain(text: &str) -> String {
    ascii(text).chars().take(40).collect()
}

/// Printable ASCII.
fn ascii(text: &str) -> String {
    let printable = |letter: char| match letter == ' ' || letter.is_ascii_graphic() {
        true => letter,
        false => '?',
    };
    text.chars().map(printable).collect()
}

/// The deck of a structure, and the frequencies (Hz) that it is predicted to have.
///
/// # Errors
/// [`DeckError::NoElement`] of what no element of a plane beam shows: an axial force, a fixture that rocks, a beam
/// with part of its shear and rotary inertia; [`DeckError::RigidAndCoupled`] as for any joint.
pub fn deck_with_effects(
    (name, origin): (&str, &str),
    specimen: &Specimen,
    frequencies: &[f64],
) -> Result<Deck, DeckError> {
    let mut deck = Deck {
        name: name.to_owned(),
        origin: origin.to_owned(),
        doubts: Vec::new(),
        theory: theory_of(specimen)?,
        pieces: Vec::new(),
        nodes: Vec::new(),
        masses: Vec::new(),
        joint: None,
        hinges: Vec::new(),
        springs: Vec::new(),
        frequencies: frequencies.to_vec(),
    };
    let cracks = cracks_of(specimen);
    let masses = specimen.masses.iter().map(|mass| mass.position);
    let springs = specimen.springs.iter().map(|spring| spring.position);
    let places: Vec<f64> = masses.chain(springs).collect();
    deck.mesh(&cut(specimen.body.beams(), &cracks), &places);
    let joint = joint_of(&deck, specimen)?;
    deck.joint = joint;
    deck.hinges = deck.hinges_at(&cracks);
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
        let sides = joint.map_or_else(Vec::new, |joint| {
            [Some(joint.node), joint.other]
                .into_iter()
                .flatten()
                .collect()
        });
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
    let refuse = |what| Err(DeckError::NoElement { what });
    if specimen.axial_force != 0.0 {
        return refuse("an axial load");
    }
    if specimen.base.is_some() {
        return refuse("a fixture that rocks");
    }
    if specimen.overlap.is_some_and(|overlap| overlap.mass != 0.0) {
        return refuse("the spread mass of an overlap beside effects");
    }
    match specimen.shear_rotary {
        0.0 => Ok(BeamTheory::Euler),
        1.0 => Ok(BeamTheory::Timoshenko),
        _ => refuse("a part of the shear and of the rotary inertia"),
    }
}

/// Cracks that lie within a beam, from left to right.
fn cracks_of(specimen: &Specimen) -> Vec<Hinge> {
    let length: f64 = specimen.body.beams().iter().map(|beam| beam.length).sum();
    let inside = |hinge: &&Hinge| hinge.position > 0.0 && hinge.position < length;
    let mut cracks: Vec<Hinge> = specimen.hinges.iter().filter(inside).copied().collect();
    cracks.retain(|hinge| hinge.compliance > 0.0);
    cracks.sort_by(|a, b| a.position.total_cmp(&b.position));
    cracks
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

/// The specimen's joint: at the left end, or between the halves.
fn joint_of(deck: &Deck, specimen: &Specimen) -> Result<Option<DeckJoint>, DeckError> {
    let Some(Joint { kt, kr, coupling }) = specimen.joint else {
        return Ok(None);
    };
    let sides = match &specimen.body {
        Body::One(_) => (0, None),
        Body::Joined([left, _]) => {
            let first = deck.first_beyond(left.length);
            (first, first.checked_sub(1))
        }
    };
    let cross = match coupling {
        0.0 => 0.0,
        coupling => coupling / (kt * kr).sqrt(),
    };
    scalar_springs((kt, kr), cross, sides).map(Some)
}

impl Deck {
    /// The first node of the piece that begins at a place (m).
    fn first_beyond(&self, place: f64) -> usize {
        let distance = |piece: &&DeckPiece| (self.nodes[piece.first] - place).abs();
        let pieces = self.pieces.iter();
        let nearest = pieces.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map_or(0, |piece| piece.first)
    }

    /// A hinge between the two nodes at every crack.
    fn hinges_at(&self, cracks: &[Hinge]) -> Vec<DeckJoint> {
        let hinge = |crack: &Hinge| {
            let node = self.first_beyond(crack.position);
            DeckJoint {
                node,
                other: node.checked_sub(1),
                translation: f64::INFINITY,
                rotation: crack.compliance.recip(),
                cross: 0.0,
            }
        };
        cracks.iter().map(hinge).collect()
    }
}
