//! Decks of models with effects: a finite-element model put together from the deck's own numbers has the
//! frequencies that stand at its head.

use nalgebra::{DMatrix, SymmetricEigen};
use std::f64::consts::PI;
use tapjoint::description::TestDescription;
use tapjoint::report::deck::{
    Deck, DeckError, DeckJoint, deck_with_effects, render_abaqus, render_nastran,
};
use tapjoint::study::updated_model::described_structure;

const BEAM: &str = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9
    density = 7850\n";
const HELD: &str = "[joint]\nkind = \"cantilever\"\nbeam = \"euler\"\nkt = 1.9e6\nkr = 1200\n
    [[sensor]]\nname = \"A\"\nposition = 0.34\n";
const LAP: &str = "[beam.right]\nthickness = 0.006\n[joint]\nkind = \"lap\"\nbeam = \"euler\"\nkt = 4e6\nkr = 900\n
    position = 0.2\n";

fn effect(id: &str, values: &str) -> String {
    format!("[[effect]]\nid = \"{id}\"\n{values}\n")
}

fn deck(joint: &str, effects: &[String]) -> Result<Deck, DeckError> {
    let text = format!("{BEAM}{joint}{}", effects.concat());
    let test = TestDescription::parse(&text, "model.toml").unwrap();
    let (seen, frequencies) = described_structure(&test, 6).unwrap();
    deck_with_effects("model", "described", &seen.specimen, &frequencies)
}

/// Stiffness and mass matrix of w and theta at every node, by Hermite's elements.
struct Matrices {
    stiffness: DMatrix<f64>,
    mass: DMatrix<f64>,
}

impl Matrices {
    fn of(deck: &Deck) -> Self {
        let size = 2 * deck.nodes.len();
        let mut own = Matrices {
            stiffness: DMatrix::zeros(size, size),
            mass: DMatrix::zeros(size, size),
        };
        for piece in &deck.pieces {
            let beam = &piece.beam;
            let bending = beam.modulus * beam.width * beam.thickness.powi(3) / 12.0;
            let per_length = beam.density * beam.width * beam.thickness;
            for node in piece.first..piece.last {
                let h = deck.nodes[node + 1] - deck.nodes[node];
                own.add_element(2 * node, h, (bending, per_length));
            }
        }
        for mass in &deck.masses {
            own.mass[(2 * mass.node, 2 * mass.node)] += mass.mass;
            own.mass[(2 * mass.node + 1, 2 * mass.node + 1)] += mass.inertia;
        }
        for &(node, stiffness) in &deck.springs {
            own.stiffness[(2 * node, 2 * node)] += stiffness;
        }
        for joint in deck.joint.iter().chain(&deck.hinges) {
            own.add_springs(joint);
        }
        own
    }

    fn add_element(&mut self, at: usize, h: f64, (bending, per_length): (f64, f64)) {
        let k = [
            [12.0, 6.0 * h, -12.0, 6.0 * h],
            [6.0 * h, 4.0 * h * h, -6.0 * h, 2.0 * h * h],
            [-12.0, -6.0 * h, 12.0, -6.0 * h],
            [6.0 * h, 2.0 * h * h, -6.0 * h, 4.0 * h * h],
        ];
        let m = [
            [156.0, 22.0 * h, 54.0, -13.0 * h],
            [22.0 * h, 4.0 * h * h, 13.0 * h, -3.0 * h * h],
            [54.0, 13.0 * h, 156.0, -22.0 * h],
            [-13.0 * h, -3.0 * h * h, -22.0 * h, 4.0 * h * h],
        ];
        for i in 0..4 {
            for j in 0..4 {
                self.stiffness[(at + i, at + j)] += bending / h.powi(3) * k[i][j];
                self.mass[(at + i, at + j)] += per_length * h / 420.0 * m[i][j];
            }
        }
    }

    /// A scalar spring between two degrees of freedom, or one and the ground.
    fn add_spring(&mut self, stiffness: f64, a: usize, b: Option<usize>) {
        self.stiffness[(a, a)] += stiffness;
        if let Some(b) = b {
            self.stiffness[(b, b)] += stiffness;
            self.stiffness[(a, b)] -= stiffness;
            self.stiffness[(b, a)] -= stiffness;
        }
    }

    fn add_springs(&mut self, joint: &DeckJoint) {
        // A tied point is held by a spring a thousand times as stiff as an element.
        const TIED: f64 = 1e13;
        let other = |k: usize| joint.other.map(|other| 2 * other + k);
        for (k, stiffness) in [joint.translation, joint.rotation].into_iter().enumerate() {
            self.add_spring(stiffness.min(TIED), 2 * joint.node + k, other(k));
        }
        self.add_spring(joint.cross, 2 * joint.node, Some(2 * joint.node + 1));
    }

    /// The lowest natural frequencies (Hz) above 1 Hz.
    fn frequencies(self, count: usize) -> Vec<f64> {
        let factor = self.mass.cholesky().unwrap().l();
        let half = factor.solve_lower_triangular(&self.stiffness).unwrap();
        let whole = factor.solve_lower_triangular(&half.transpose()).unwrap();
        let eigen = SymmetricEigen::new(0.5 * (&whole + whole.transpose()));
        let values = eigen
            .eigenvalues
            .iter()
            .map(|value| value.max(0.0).sqrt() / (2.0 * PI));
        let mut all: Vec<f64> = values.filter(|hz| *hz > 1.0).collect();
        all.sort_by(f64::total_cmp);
        all.truncate(count);
        all
    }
}

fn agrees(deck: &Deck) {
    let own = Matrices::of(deck).frequencies(deck.frequencies.len());
    assert_eq!(own.len(), deck.frequencies.len());
    for (own, head) in own.iter().zip(&deck.frequencies) {
        // 120 elements: 1e-6 of a sixth mode; rounding of a dense solution with tied nodes: as much.
        assert!((own / head - 1.0).abs() < 2e-5, "{own} for {head}");
    }
}

#[test]
fn val_masses_springs_and_cracks_stand_in_the_deck() {
    let plain = deck(HELD, &[]).unwrap();
    agrees(&plain);
    let all = [
        effect("added-mass", "mass = 0.02\nposition = 0.2"),
        effect("local-crack", "compliance = 0.05\nposition = 0.1"),
        effect("joint-mass", "mass = 0.05\ninertia = 2e-6"),
        effect("sensor-mass", "mass = 0.03"),
        effect("sensor-cable", "stiffness = 800"),
        effect("cross-coupling", "coupling = 0.3"),
        effect("modulus", "relative = 0.02"),
        effect("length", "relative = 0.004"),
    ];
    for one in &all {
        let with = deck(HELD, std::slice::from_ref(one)).unwrap();
        agrees(&with);
        let moved = with.frequencies.iter().zip(&plain.frequencies);
        let most = moved.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        assert!(most > 1e-3, "nothing to see: {one}");
    }
    let together = deck(HELD, &all).unwrap();
    agrees(&together);
    assert_eq!((together.hinges.len(), together.springs.len()), (1, 1));
}

#[test]
fn val_a_crack_in_either_half_of_a_lap_joint_stands_in_the_deck() {
    for position in ["0.1", "0.31"] {
        let crack = effect(
            "local-crack",
            &format!("compliance = 0.05\nposition = {position}"),
        );
        let mass = effect("joint-mass", "mass = 0.05\ninertia = 2e-6");
        agrees(&deck(LAP, &[crack, mass]).unwrap());
    }
}

#[test]
fn limit_what_has_no_element_is_refused_by_name() {
    for (id, values, named) in [
        ("axial-load", "force = 100", "an axial load"),
        ("fixture", "frequency = 200\nratio = 0.1", "a fixture"),
        ("shear-rotary", "factor = 0.7", "shear"),
    ] {
        let error = deck(HELD, &[effect(id, values)]).unwrap_err();
        assert!(error.to_string().contains(named), "{error}");
    }
}

/// Stiffness goes with the cube of an element's length, and a deck has ten digits: beside a node of an even mesh an
/// element could be a thousandth of its neighbours, and the lowest frequency be off by 1e-5.
#[test]
fn prop_no_element_is_much_shorter_than_the_others() {
    for position in [0.1, 0.2, 0.201, 0.2013, 0.29999, 0.31] {
        let mass = effect("added-mass", &format!("mass = 0.02\nposition = {position}"));
        let deck = deck(HELD, &[mass]).unwrap();
        assert!(
            deck.nodes
                .iter()
                .any(|node| (node - position).abs() < 1e-12)
        );
        let lengths: Vec<f64> = deck.nodes.windows(2).map(|two| two[1] - two[0]).collect();
        let shortest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        // Each stretch is divided evenly, into elements of at most a given length: of two or more none is below the
        // half of it.
        assert!(
            shortest >= 0.5 * longest,
            "{position}: {shortest} {longest}"
        );
    }
}

#[test]
fn prop_no_two_elements_of_a_deck_have_one_number() {
    let all = [
        effect("added-mass", "mass = 0.02\nposition = 0.2"),
        effect("local-crack", "compliance = 0.05\nposition = 0.1"),
        effect("joint-mass", "mass = 0.05\ninertia = 2e-6"),
        effect("sensor-cable", "stiffness = 800"),
        effect("cross-coupling", "coupling = 0.3"),
    ];
    let deck = deck(HELD, &all).unwrap();
    let text = render_nastran(&deck);
    let number = |line: &str| line.split(',').nth(1).map(str::to_owned);
    let is_element = |line: &&str| {
        let kinds = ["CBAR", "CONM2", "CELAS2", "RBE2"];
        kinds.iter().any(|kind| line.starts_with(kind))
    };
    let numbers: Vec<String> = text.lines().filter(is_element).filter_map(number).collect();
    let mut distinct = numbers.clone();
    distinct.sort();
    distinct.dedup();
    assert_eq!(distinct.len(), numbers.len());
    let text = render_abaqus(&deck);
    let mut sets: Vec<&str> = text
        .lines()
        .filter(|line| line.starts_with("*ELEMENT"))
        .filter_map(|line| line.split("ELSET=").nth(1))
        .collect();
    let count = sets.len();
    sets.sort_unstable();
    sets.dedup();
    assert_eq!(sets.len(), count, "{sets:?}");
}
