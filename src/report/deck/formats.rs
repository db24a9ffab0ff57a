//! Decks in the formats of two programs.
//!
//! Abaqus: B23 or B21 elements, SPRING1 and SPRING2, a frequency step. Nastran: CBAR elements, CELAS2 springs, SOL 103.

use std::fmt::Write as _;

use super::{Deck, DeckJoint, DeckMass};
use tapjoint_beam::BeamTheory;

/// Degrees of freedom that a plane beam has not: along it, out of its plane, twist.
const HELD: &str = "1345";
/// w and theta of a plane beam.
const W: usize = 2;
const THETA: usize = 6;

/// Numbers of elements that a joint or a hinge may take.
const SPRINGS: usize = 3;

/// The deck as an Abaqus input file.
pub fn render_abaqus(deck: &Deck) -> String {
    let mut text = deck.remarks("** ");
    text.push_str("*HEADING\nbeam on its joint\n*NODE, NSET=ALL\n");
    for (index, place) in deck.nodes.iter().enumerate() {
        let _ = writeln!(text, "{}, {place:.10e}, 0.", index + 1);
    }
    let kind = match deck.theory {
        BeamTheory::Euler => "B23",
        BeamTheory::Timoshenko => "B21",
    };
    let mut element = 0;
    for (index, piece) in deck.pieces.iter().enumerate() {
        let (set, beam) = (index + 1, &piece.beam);
        let _ = writeln!(text, "*ELEMENT, TYPE={kind}, ELSET=BEAM{set}");
        for node in piece.first..piece.last {
            element += 1;
            let _ = writeln!(text, "{element}, {}, {}", node + 1, node + 2);
        }
        let _ = writeln!(
            text,
            "*BEAM SECTION, SECTION=RECT, ELSET=BEAM{set}, MATERIAL=M{set}\n\
             {:.10e}, {:.10e}\n0., 0., -1.",
            beam.width, beam.thickness
        );
        if deck.theory == BeamTheory::Timoshenko {
            let stiffness = beam.shear_stiffness();
            let _ = writeln!(text, "*TRANSVERSE SHEAR STIFFNESS\n{stiffness:.10e}");
        }
        let _ = writeln!(
            text,
            "*MATERIAL, NAME=M{set}\n*ELASTIC\n{:.10e}, {:.6}\n*DENSITY\n{:.10e}",
            beam.modulus, beam.poisson, beam.density
        );
    }
    for (index, own) in deck.masses.iter().enumerate() {
        let (number, node) = (index + 1, own.node + 1);
        // Only the inertia about z acts in a plane model.
        let of_mass = ("MASS", "MASS", "MASS", "", own.mass);
        let of_inertia = (
            "ROTARYI",
            "ROTARY INERTIA",
            "INERTIA",
            "0., 0., ",
            own.inertia,
        );
        for (kind, keyword, set, before, value) in [of_mass, of_inertia] {
            if value != 0.0 {
                element += 1;
                let _ = writeln!(
                    text,
                    "*ELEMENT, TYPE={kind}, ELSET={set}{number}\n{element}, {node}\n\
                     *{keyword}, ELSET={set}{number}\n{before}{value:.10e}"
                );
            }
        }
    }
    // A plane beam still stretches: it is held along x.
    text.push_str("*BOUNDARY\nALL, 1, 1\n");
    for (index, joint) in deck.joint.iter().chain(&deck.hinges).enumerate() {
        let set = match index == 0 && deck.joint.is_some() {
            true => "SPRING".to_owned(),
            false => format!("HINGE{}", index + 1),
        };
        abaqus_springs(&mut text, joint, element, &set);
        element += SPRINGS;
    }
    for (index, (node, stiffness)) in deck.springs.iter().enumerate() {
        let set = format!("GROUND{}", index + 1);
        abaqus_spring(
            &mut text,
            &set,
            element + index + 1,
            None,
            node + 1,
            W,
            *stiffness,
        );
    }
    let modes = deck.frequencies.len().max(5);
    let from = deck.least_frequency();
    let _ = writeln!(text, "*STEP\n*FREQUENCY\n{modes}, {from}\n*END STEP");
    text
}

fn abaqus_springs(text: &mut String, joint: &DeckJoint, elements: usize, name: &str) {
    let (node, other) = (joint.node + 1, joint.other.map(|other| other + 1));
    for (id, stiffness, direction) in joint.springs(elements) {
        match (stiffness, other) {
            (k, None) if k.is_infinite() => {
                let _ = writeln!(text, "*BOUNDARY\n{node}, {direction}, {direction}");
            }
            (k, Some(other)) if k.is_infinite() => {
                let _ = writeln!(
                    text,
                    "*EQUATION\n2\n{node}, {direction}, 1., {other}, {direction}, -1."
                );
            }
            (0.0, _) => {}
            (k, other) => {
                let set = format!("{name}{direction}");
                abaqus_spring(text, &set, id, other, node, direction, k);
            }
        }
    }
    if joint.cross != 0.0 {
        let _ = writeln!(
            text,
            "*ELEMENT, TYPE=SPRING2, ELSET=CROSS\n{}, {node}, {node}\n\
             *SPRING, ELSET=CROSS\n{W}, {THETA}\n{:.10e}",
            elements + SPRINGS,
            joint.cross
        );
    }
}

/// Writes a spring between two nodes, or a node and the ground.
fn abaqus_spring(
    text: &mut String,
    set: &str,
    id: usize,
    other: Option<usize>,
    node: usize,
    direction: usize,
    stiffness: f64,
) {
    let (kind, nodes, directions) = match other {
        None => ("SPRING1", node.to_string(), direction.to_string()),
        Some(other) => {
            let directions = format!("{direction}, {direction}");
            ("SPRING2", format!("{other}, {node}"), directions)
        }
    };
    let _ = writeln!(
        text,
        "*ELEMENT, TYPE={kind}, ELSET={set}\n{id}, {nodes}\n*SPRING, ELSET={set}\n{directions}\n{stiffness:.10e}"
    );
}

/// The deck as a Nastran input file.
pub fn render_nastran(deck: &Deck) -> String {
    let mut text = deck.remarks("$ ");
    let modes = deck.frequencies.len().max(5);
    text.push_str("SOL 103\nCEND\nTITLE = BEAM ON ITS JOINT\nECHO = NONE\n");
    let rigid = deck.joint.is_some_and(|joint| {
        let rigid = joint.translation.is_infinite() || joint.rotation.is_infinite();
        joint.other.is_none() && rigid
    });
    if rigid {
        text.push_str("SPC = 1\n");
    }
    text.push_str("METHOD = 1\nDISPLACEMENT = ALL\nBEGIN BULK\nPARAM,COUPMASS,1\nPARAM,POST,-1\n");
    let from = deck.least_frequency();
    let _ = writeln!(text, "EIGRL,1,{from},,{modes}");
    for (index, place) in deck.nodes.iter().enumerate() {
        let (id, place) = (index + 1, number(*place));
        let _ = writeln!(text, "GRID*,{id},,{place},0.,\n*,0.,,{HELD}");
    }
    let mut element = 0;
    for (index, piece) in deck.pieces.iter().enumerate() {
        let (id, beam) = (index + 1, &piece.beam);
        let (modulus, poisson) = (number(beam.modulus), number(beam.poisson));
        let density = number(beam.density);
        let _ = writeln!(text, "MAT1*,{id},{modulus},,{poisson}\n*,{density}");
        let (area, bend) = (number(beam.area()), number(beam.second_moment()));
        // The other directions are held: any positive number will do.
        let _ = writeln!(text, "PBAR*,{id},{id},{area},{bend}\n*,{bend},{bend}");
        if deck.theory == BeamTheory::Timoshenko {
            // k = (k G A)/(G A); K1 and K2 are the fifth and sixth fields of the third line.
            let factor = number(beam.shear_stiffness() / (beam.shear_modulus() * beam.area()));
            let _ = writeln!(text, "*,,,,\n*,,,,\n*,{factor},{factor}");
        }
        for node in piece.first..piece.last {
            element += 1;
            let (near, far) = (node + 1, node + 2);
            let _ = writeln!(text, "CBAR,{element},{id},{near},{far},0.,1.,0.");
        }
    }
    // By Timoshenko's theory also the sections' rotary inertia, which a bar element lacks.
    let mut masses = deck.masses.clone();
    if deck.theory == BeamTheory::Timoshenko {
        masses.extend(rotary_inertia(deck));
    }
    for (id, own) in (element + 1..).zip(&masses) {
        let mass = match own.mass {
            0.0 => "0.".to_owned(),
            mass => number(mass),
        };
        let _ = write!(text, "CONM2*,{id},{},,{mass}\n*", own.node + 1);
        if own.inertia != 0.0 {
            // I33 is the second field of the fourth line.
            let _ = write!(text, ",,,,\n*,,,,\n*,,{}", number(own.inertia));
        }
        text.push('\n');
    }
    let mut first = element + deck.masses.len() + deck.nodes.len();
    for joint in deck.joint.iter().chain(&deck.hinges) {
        nastran_springs(&mut text, joint, first);
        first += SPRINGS;
    }
    for (index, (node, stiffness)) in deck.springs.iter().enumerate() {
        let (id, k, node) = (first + index + 1, number(*stiffness), node + 1);
        let _ = writeln!(text, "CELAS2*,{id},{k},{node},{W}\n*");
    }
    text.push_str("ENDDATA\n");
    text
}

/// A number of 16 characters at most, with a point, as large fields want it.
fn number(value: f64) -> String {
    let text = format!("{value:.9e}");
    match text.split_once('e') {
        Some((mantissa, "0")) => mantissa.to_owned(),
        Some((mantissa, exponent)) => format!("{mantissa}E{exponent}"),
        None => text,
    }
}

/// Each node's share of the sections' inertia (kg m2): half of the elements beside it.
fn rotary_inertia(deck: &Deck) -> impl Iterator<Item = DeckMass> {
    let mut inertia = vec![0.0; deck.nodes.len()];
    for piece in &deck.pieces {
        let per_length = piece.beam.rotary_inertia_per_length();
        for node in piece.first..piece.last {
            let half = 0.5 * per_length * (deck.nodes[node + 1] - deck.nodes[node]);
            inertia[node] += half;
            inertia[node + 1] += half;
        }
    }
    let shares = inertia.into_iter().enumerate();
    shares.map(|(node, inertia)| DeckMass {
        node,
        mass: 0.0,
        inertia,
    })
}

fn nastran_springs(text: &mut String, joint: &DeckJoint, first: usize) {
    let (node, other) = (joint.node + 1, joint.other.map(|other| other + 1));
    for (id, stiffness, direction) in joint.springs(first) {
        let _ = match (stiffness, other) {
            (k, None) if k.is_infinite() => writeln!(text, "SPC1,1,{direction},{node}"),
            (k, Some(other)) if k.is_infinite() => {
                writeln!(text, "RBE2,{id},{other},{direction},{node}")
            }
            (0.0, _) => Ok(()),
            (k, None) => writeln!(text, "CELAS2*,{id},{},{node},{direction}\n*", number(k)),
            (k, Some(other)) => writeln!(
                text,
                "CELAS2*,{id},{},{node},{direction}\n*,{other},{direction}",
                number(k)
            ),
        };
    }
    if joint.cross != 0.0 {
        let (id, k) = (first + SPRINGS, number(joint.cross));
        let _ = writeln!(text, "CELAS2*,{id},{k},{node},{W}\n*,{node},{THETA}");
    }
}

impl DeckJoint {
    /// Returns its springs on w and theta: the number of each element, stiffness and direction.
    fn springs(&self, elements: usize) -> [(usize, f64, usize); 2] {
        [
            (elements + 1, self.translation, W),
            (elements + 2, self.rotation, THETA),
        ]
    }
}
