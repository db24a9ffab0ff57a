//! Abaqus input: B23 or B21 elements, SPRING1 and SPRING2, a frequency step.

use std::fmt::Write as _;

use super::{Deck, DeckJoint, DeckMass};
use tapjoint_beam::BeamTheory;

/// w and theta of a plane beam.
const W: usize = 2;
const THETA: usize = 6;

/// Numbers of elements that a joint or a hinge may take.
const SPRINGS: usize = 3;

/// The deck as an Abaqus input file.
pub fn render_abaqus(deck: &Deck) -> String {
    let mut text = String::new();
    for remark in deck.remarks() {
        let _ = writeln!(text, "** {remark}");
    }
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
        let set = format!("BEAM{}", index + 1);
        let _ = writeln!(text, "*ELEMENT, TYPE={kind}, ELSET={set}");
        for node in piece.first..piece.last {
            element += 1;
            let _ = writeln!(text, "{element}, {}, {}", node + 1, node + 2);
        }
        section(&mut text, deck, index, &set);
    }
    for (index, own) in deck.masses.iter().enumerate() {
        mass(&mut text, &mut element, index + 1, own);
    }
    // A plane beam still stretches: it is held along x.
    text.push_str("*BOUNDARY\nALL, 1, 1\n");
    for (index, joint) in deck.joint.iter().chain(&deck.hinges).enumerate() {
        let is_joint = index == 0 && deck.joint.is_some();
        let hinge = format!("HINGE{}", index + 1);
        let set = if is_joint { "SPRING" } else { &hinge };
        springs(&mut text, joint, element, set);
        element += SPRINGS;
    }
    for (index, (node, stiffness)) in deck.springs.iter().enumerate() {
        let (id, set) = (element + index + 1, format!("GROUND{}", index + 1));
        let _ = writeln!(
            text,
            "*ELEMENT, TYPE=SPRING1, ELSET={set}\n{id}, {}",
            node + 1
        );
        let _ = writeln!(text, "*SPRING, ELSET={set}\n{W}\n{stiffness:.10e}");
    }
    let modes = deck.frequencies.len().max(5);
    let from = deck.least_frequency();
    let _ = writeln!(text, "*STEP\n*FREQUENCY\n{modes}, {from}\n*END STEP");
    text
}

fn section(text: &mut String, deck: &Deck, index: usize, set: &str) {
    let beam = &deck.pieces[index].beam;
    let material = format!("M{}", index + 1);
    let _ = writeln!(
        text,
        "*BEAM SECTION, SECTION=RECT, ELSET={set}, MATERIAL={material}"
    );
    let _ = writeln!(
        text,
        "{:.10e}, {:.10e}\n0., 0., -1.",
        beam.width, beam.thickness
    );
    if deck.theory == BeamTheory::Timoshenko {
        let _ = writeln!(
            text,
            "*TRANSVERSE SHEAR STIFFNESS\n{:.10e}",
            beam.shear_stiffness()
        );
    }
    let _ = writeln!(text, "*MATERIAL, NAME={material}\n*ELASTIC");
    let _ = writeln!(
        text,
        "{:.10e}, {:.6}\n*DENSITY\n{:.10e}",
        beam.modulus, beam.poisson, beam.density
    );
}

/// Writes a mass and its moment of inertia, and counts their elements.
fn mass(text: &mut String, element: &mut usize, number: usize, own: &DeckMass) {
    let node = own.node + 1;
    if own.mass != 0.0 {
        *element += 1;
        let set = format!("MASS{number}");
        let _ = writeln!(text, "*ELEMENT, TYPE=MASS, ELSET={set}\n{element}, {node}");
        let _ = writeln!(text, "*MASS, ELSET={set}\n{:.10e}", own.mass);
    }
    if own.inertia != 0.0 {
        *element += 1;
        let set = format!("INERTIA{number}");
        let _ = writeln!(
            text,
            "*ELEMENT, TYPE=ROTARYI, ELSET={set}\n{element}, {node}"
        );
        // Of a plane model only that about z counts.
        let _ = writeln!(
            text,
            "*ROTARY INERTIA, ELSET={set}\n0., 0., {:.10e}",
            own.inertia
        );
    }
}

fn springs(text: &mut String, joint: &DeckJoint, elements: usize, name: &str) {
    let node = joint.node + 1;
    let mut id = elements;
    for (stiffness, direction) in [(joint.translation, W), (joint.rotation, THETA)] {
        id += 1;
        match (stiffness, joint.other) {
            (k, None) if k.is_infinite() => {
                let _ = writeln!(text, "*BOUNDARY\n{node}, {direction}, {direction}");
            }
            (k, Some(other)) if k.is_infinite() => {
                let other = other + 1;
                let _ = writeln!(
                    text,
                    "*EQUATION\n2\n{node}, {direction}, 1., {other}, {direction}, -1."
                );
            }
            (0.0, _) => {}
            (k, other) => {
                let set = format!("{name}{direction}");
                match other.map(|other| other + 1) {
                    None => {
                        let _ = writeln!(text, "*ELEMENT, TYPE=SPRING1, ELSET={set}\n{id}, {node}");
                        let _ = writeln!(text, "*SPRING, ELSET={set}\n{direction}\n{k:.10e}");
                    }
                    Some(other) => {
                        let _ = writeln!(
                            text,
                            "*ELEMENT, TYPE=SPRING2, ELSET={set}\n{id}, {other}, {node}"
                        );
                        let _ = writeln!(
                            text,
                            "*SPRING, ELSET={set}\n{direction}, {direction}\n{k:.10e}"
                        );
                    }
                }
            }
        }
    }
    if joint.cross != 0.0 {
        let id = id + 1;
        let _ = writeln!(
            text,
            "*ELEMENT, TYPE=SPRING2, ELSET=CROSS\n{id}, {node}, {node}"
        );
        let _ = writeln!(
            text,
            "*SPRING, ELSET=CROSS\n{W}, {THETA}\n{:.10e}",
            joint.cross
        );
    }
}
