//! Theory of beams and joints: limits, properties, and agreement of independent routes.

use std::f64::consts::PI;
use tapjoint::structure::frequency_equation::RootedBeam;
use tapjoint::structure::receptance::EndFunctions;
use tapjoint::structure::{
    Assembly, Beam, BeamTheory, JointStiffness, ModeShape, Slenderness, StructureError, Symmetry,
    mode_shapes, natural_frequencies, natural_lambdas, natural_lambdas_of_any_joint, natural_modes,
};

/// The cantilever of Ingole & Chatterjee, table 2.
fn steel_strip() -> Beam {
    Beam {
        length: 0.423,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    }
}

fn joint(kx: f64, ky: f64) -> JointStiffness {
    JointStiffness::two_parameter(kx, ky)
}

fn lambdas(assembly: Assembly, joint: &JointStiffness, count: usize) -> Vec<f64> {
    natural_lambdas(assembly, joint, count).unwrap()
}

/// Composite Gauss quadrature, 8 panels of 8 points per unit of count.
fn integrate(function: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    const NODES: [(f64, f64); 4] = [
        (0.183_434_642_495_649_8, 0.362_683_783_378_362),
        (0.525_532_409_916_329, 0.313_706_645_877_887_3),
        (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
        (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
    ];
    const PANELS: usize = 64;
    let half = 0.5 * (to - from) / PANELS as f64;
    (0..PANELS)
        .map(|panel| {
            let centre = from + (2 * panel + 1) as f64 * half;
            let pair = |(node, weight): (f64, f64)| {
                weight * (function(centre - node * half) + function(centre + node * half))
            };
            half * NODES.into_iter().map(pair).sum::<f64>()
        })
        .sum()
}

#[test]
fn limit_classical_supports_are_reached() {
    let rigid = f64::INFINITY;
    // Young & Felgar / Blevins: roots of cos cosh = -1, tan = tanh, cos cosh = 1, tan = -tanh.
    let cases = [
        (
            "clamped",
            joint(rigid, rigid),
            [
                1.875_104_068_711_961,
                4.694_091_132_974_174,
                7.854_757_438_237_613,
            ],
        ),
        (
            "pinned",
            joint(rigid, 0.0),
            [
                3.926_602_312_047_919,
                7.068_582_745_628_732,
                10.210_176_122_813_03,
            ],
        ),
        (
            "free",
            joint(0.0, 0.0),
            [
                4.730_040_744_862_704,
                7.853_204_624_095_838,
                10.995_607_838_001_67,
            ],
        ),
        (
            "guided",
            joint(0.0, rigid),
            [
                2.365_020_372_431_352,
                5.497_803_919_000_836,
                8.639_379_828_699_742,
            ],
        ),
    ];
    for (name, joint, expected) in cases {
        let found = lambdas(Assembly::Cantilever, &joint, 3);
        for (found, expected) in found.iter().zip(expected) {
            // The published digits carry sixteen figures.
            assert!(
                (found - expected).abs() < 1e-13,
                "{name}: {found} against {expected}"
            );
        }
    }
}

#[test]
fn prop_shapes_are_orthonormal_and_satisfy_the_modal_mass() {
    let beam = steel_strip();
    let cases = [
        (Assembly::Cantilever, joint(500.0, 100.0)),
        (Assembly::Cantilever, joint(1e-6, 1e-6)),
        (Assembly::Cantilever, joint(1e9, 1e-3)),
        (Assembly::Cantilever, JointStiffness::RIGID),
        (
            Assembly::Cantilever,
            JointStiffness::three_parameter(1000.0, 500.0, 1e3),
        ),
        (
            Assembly::Cantilever,
            JointStiffness::three_parameter(1000.0, 5.0, -80.0),
        ),
        (Assembly::Lap, joint(500.0, 50.0)),
        (Assembly::Lap, joint(3.0, 0.2)),
        (Assembly::Lap, JointStiffness::RIGID),
        (Assembly::Free, JointStiffness::FREE),
    ];
    for (assembly, joint) in cases {
        let shapes = mode_shapes(&beam, assembly, &joint, 12).unwrap();
        for (i, first) in shapes.iter().enumerate() {
            for (j, second) in shapes.iter().enumerate().skip(i) {
                let mass = modal_mass(&beam, first, second);
                let expected = if i == j { 1.0 } else { 0.0 };
                // Quadrature of 64 panels is exact to 1e-12 for six waves along the beam; the
                // shapes of the weakest springs lose four digits to lambda = 0.03.
                assert!(
                    (mass - expected).abs() < 1e-9,
                    "{assembly:?} {joint:?}: modes {i} and {j} have the mass {mass}"
                );
            }
        }
    }
}

fn modal_mass(beam: &Beam, first: &ModeShape, second: &ModeShape) -> f64 {
    let product = |x: f64| first.displacement(x) * second.displacement(x);
    let middle = 0.5 * beam.length;
    let left = integrate(product, 0.0, middle);
    beam.mass_per_length() * (left + integrate(product, middle, beam.length))
}
