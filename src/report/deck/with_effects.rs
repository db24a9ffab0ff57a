//! The deck of a described model with the effects that it describes, as far as they are masses, springs, hinges,
//! dimensions and material.

use super::{Deck, DeckError, DeckJoint, scalar_springs};
use tapjoint_beam::specimen::{Body, Hinge, Specimen, SpecimenJoint};
use tapjoint_beam::{Beam, BeamTheory};

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
        deck.masses
            .extend(sides.iter().map(|&node| super::DeckMass {
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
    let SpecimenJoint::Springs { kt, kr, coupling } = specimen.joint else {
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
        let distance = |piece: &&super::DeckPiece| (self.nodes[piece.first] - place).abs();
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
