//! What several modules begin with: a beam, its frequencies, and how two lists of them are compared.

use tapjoint_beam::Beam;
use tapjoint_beam::specimen::{Mesh, Specimen};

/// Elements of every specimen.
pub const MESH: Mesh = Mesh::SIMULATION;

/// The cantilever of Ingole & Chatterjee, table 2.
pub fn strip() -> Beam {
    Beam {
        length: 0.423,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    }
}

/// The lowest natural frequencies (Hz).
pub fn frequencies(specimen: &Specimen, count: usize, mesh: Mesh) -> Vec<f64> {
    let modes = specimen.modes(count, mesh).unwrap();
    modes.frequencies().to_vec()
}

/// Fails where a relative difference is not below the tolerance.
pub fn assert_close(found: &[f64], expected: &[f64], tolerance: f64, case: &str) {
    assert_eq!(found.len(), expected.len(), "{case}");
    for (mode, (a, b)) in found.iter().zip(expected).enumerate() {
        let error = (a / b - 1.0).abs();
        assert!(
            error < tolerance,
            "{case}, mode {}: {a} for {b}, off by {error:e}",
            mode + 1
        );
    }
}
