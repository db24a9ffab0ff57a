//! The beam of the tests: structures, tests and pairs.

use crate::test::{Item, MeasuredMode, Pair, Test};
use tapjoint_beam::specimen::{Joint, Mesh, Specimen};
use tapjoint_beam::{Assembly, Beam, BeamTheory};

pub(crate) const BEAM: Beam = Beam {
    length: 0.4,
    width: 0.02,
    thickness: 0.005,
    modulus: 205e9,
    density: 7850.0,
    poisson: 0.3,
};

/// A joint with these stiffnesses over E I/L^3 and E I/L.
pub(crate) fn joint(translation: f64, rotation: f64) -> Joint {
    let stiffness = BEAM.bending_stiffness();
    Joint {
        kt: translation * stiffness / BEAM.length.powi(3),
        kr: rotation * stiffness / BEAM.length,
        coupling: 0.0,
    }
}

pub(crate) fn springs() -> Joint {
    joint(1500.0, 10.0)
}

pub(crate) fn cantilever(joint: Joint) -> Specimen {
    let lap = Default::default();
    Specimen::jointed(
        BeamTheory::Euler,
        &BEAM,
        Assembly::Cantilever,
        &lap,
        Some(joint),
    )
}

/// The lowest natural frequencies (Hz).
pub(crate) fn frequencies(structure: &Specimen, count: usize) -> Vec<f64> {
    let mesh = Mesh { elements: 100 };
    structure.modes(count, mesh).unwrap().frequencies()[..count].to_vec()
}

/// A test that measured the lowest modes at these frequencies (Hz).
pub(crate) fn test(structure: &Specimen, items: &[Item], frequencies: &[f64]) -> Test {
    let modes = frequencies.iter().enumerate();
    Test {
        structure: structure.clone(),
        items: items.to_vec(),
        knows_joint: [false; 2],
        common_std: 0.01,
        modes: modes
            .map(|(index, frequency)| MeasuredMode::of_frequency(index + 1, *frequency, 0.0))
            .collect(),
        unnumbered: Vec::new(),
    }
}

pub(crate) fn pair(before: Test, after: Test) -> Pair {
    Pair {
        before: vec![before],
        after: vec![after],
    }
}
