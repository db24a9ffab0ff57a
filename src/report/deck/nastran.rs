//! Nastran bulk data: CBAR elements, CELAS2 springs, SOL 103.

use std::fmt::Write as _;

use super::{Deck, DeckJoint, DeckMass, DeckPiece};
use tapjoint_beam::BeamTheory;

/// Degrees of freedom that a plane beam has not: along it, out of its plane, twist.
const HELD: &str = "1345";
/// w and theta.
const W: usize = 2;
const THETA: usize = 6;

/// Numbers of elements that a joint or a hinge may take.
const SPRINGS: usize = 3;

/// The deck as a Nastran input file.
pub fn render_nastran(deck: &Deck) -> String {
    let mut text = String::new();
    for remark in deck.remarks() {
        let _ = writeln!(text, "$ {remark}");
    }
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
        let _ = writeln!(
            text,
            "GRID*,{},,{},0.,\n*,0.,,{HELD}",
            index + 1,
            number(*place)
        );
    }
    let mut element = 0;
    for (index, piece) in deck.pieces.iter().enumerate() {
        properties(&mut text, deck.theory, piece, index + 1);
        for node in piece.first..piece.last {
            element += 1;
            let (property, near, far) = (index + 1, node + 1, node + 2);
            let _ = writeln!(text, "CBAR,{element},{property},{near},{far},0.,1.,0.");
        }
    }
    masses(&mut text, deck, element);
    let mut first = element + deck.masses.len() + deck.nodes.len();
    for joint in deck.joint.iter().chain(&deck.hinges) {
        springs(&mut text, joint, first);
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

fn properties(text: &mut String, theory: BeamTheory, piece: &DeckPiece, id: usize) {
    let beam = &piece.beam;
    let (modulus, poisson) = (number(beam.modulus), number(beam.poisson));
    let _ = writeln!(
        text,
        "MAT1*,{id},{modulus},,{poisson}\n*,{}",
        number(beam.density)
    );
    let (area, bend) = (number(beam.area()), number(beam.second_moment()));
    // Of the other directions, which are held, any positive number will do.
    let _ = writeln!(text, "PBAR*,{id},{id},{area},{bend}\n*,{bend},{bend}");
    if theory == BeamTheory::Timoshenko {
        // k = (k G A)/(G A); K1 and K2 are the fifth and sixth fields of the third line.
        let factor = number(beam.shear_stiffness() / (beam.shear_modulus() * beam.area()));
        text.push_str("*,,,,\n*,,,,\n");
        let _ = writeln!(text, "*,{factor},{factor}");
    }
}

/// Point masses, and by Timoshenko's theory the sections' rotary inertia, which a bar element lacks.
fn masses(text: &mut String, deck: &Deck, elements: usize) {
    for (index, own) in deck.masses.iter().enumerate() {
        mass(text, elements + 1 + index, own);
    }
    if deck.theory == BeamTheory::Euler {
        return;
    }
    let first = elements + 1 + deck.masses.len();
    for (node, inertia) in rotary_inertia(deck).into_iter().enumerate() {
        let own = DeckMass {
            node,
            mass: 0.0,
            inertia,
        };
        mass(text, first + node, &own);
    }
}

fn mass(text: &mut String, id: usize, own: &DeckMass) {
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

/// Each node's share of the sections' inertia (kg m2): half of the elements beside it.
pub(super) fn rotary_inertia(deck: &Deck) -> Vec<f64> {
    let mut inertia = vec![0.0; deck.nodes.len()];
    for piece in &deck.pieces {
        let per_length = piece.beam.rotary_inertia_per_length();
        for node in piece.first..piece.last {
            let half = 0.5 * per_length * (deck.nodes[node + 1] - deck.nodes[node]);
            inertia[node] += half;
            inertia[node + 1] += half;
        }
    }
    inertia
}

fn springs(text: &mut String, joint: &DeckJoint, first: usize) {
    let node = joint.node + 1;
    let mut id = first;
    for (stiffness, direction) in [(joint.translation, W), (joint.rotation, THETA)] {
        id += 1;
        match (stiffness, joint.other) {
            (k, None) if k.is_infinite() => {
                let _ = writeln!(text, "SPC1,1,{direction},{node}");
            }
            (k, Some(other)) if k.is_infinite() => {
                let _ = writeln!(text, "RBE2,{id},{},{direction},{node}", other + 1);
            }
            (0.0, _) => {}
            (k, None) => {
                let _ = writeln!(text, "CELAS2*,{id},{},{node},{direction}\n*", number(k));
            }
            (k, Some(other)) => {
                let (k, other) = (number(k), other + 1);
                let _ = writeln!(
                    text,
                    "CELAS2*,{id},{k},{node},{direction}\n*,{other},{direction}"
                );
            }
        }
    }
    if joint.cross != 0.0 {
        let k = number(joint.cross);
        let _ = writeln!(text, "CELAS2*,{},{k},{node},{W}\n*,{node},{THETA}", id + 1);
    }
}
