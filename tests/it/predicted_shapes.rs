//! Shapes of the structure that a prediction is of.

use std::path::Path;
use tapjoint::description::TestDescription;
use tapjoint::pipeline::{SampledShape, run_test, sampled_shapes};
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::{Assembly, Beam, JointStiffness, mode_shapes};

const BEAM: Beam = Beam {
    length: 0.6,
    width: 0.05,
    thickness: 0.005,
    modulus: 207e9,
    density: 7850.0,
    poisson: 0.3,
};

/// A test of a known joint with frequencies that count the modes and nothing else.
fn described(joint: &str, more: &str) -> (Vec<SampledShape>, Vec<f64>) {
    let text = format!(
        "[beam]\nlength = 0.6\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n{more}\n\
         [joint]\nkt = 2e6\nkr = 1200.0\n{joint}\n\
         [measured]\nfrequencies = [10, 60, 170, 330, 540]\n"
    );
    let test = TestDescription::parse(&text, "test.toml").unwrap();
    let analysis = run_test(&test, (Path::new("."), "test.toml"), &Default::default()).unwrap();
    let found = analysis.identification.as_ref().unwrap();
    let predicted = found.prediction.iter().map(|mode| mode.predicted).collect();
    (sampled_shapes(&analysis), predicted)
}

#[test]
fn limit_a_plain_beam_has_the_shapes_of_the_closed_form() {
    let (shapes, _) = described("kind = \"cantilever\"\nbeam = \"euler\"", "");
    let units = StiffnessUnits::of(&BEAM);
    let joint = JointStiffness::two_parameter(2e6 / units.kt, 1200.0 / units.kr);
    let exact = mode_shapes(&BEAM, Assembly::Cantilever, &joint, shapes.len()).unwrap();
    assert_eq!(shapes.len(), 6);
    for (shape, exact) in shapes.iter().zip(&exact) {
        let raw: Vec<f64> = shape
            .positions
            .iter()
            .map(|x| exact.displacement(*x))
            .collect();
        let largest = raw.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        let sign = (raw[60] * shape.displacements[60]).signum();
        for (found, wanted) in shape.displacements.iter().zip(&raw) {
            // Sixty finite elements: shapes are right to 1e-5 up to the sixth mode.
            let wanted = sign * wanted / largest;
            assert!(
                (found - wanted).abs() < 1e-5,
                "mode {}: {found} {wanted}",
                shape.mode
            );
        }
    }
}

#[test]
fn val_shapes_belong_to_the_predicted_frequencies() {
    let sensors = "[[sensor]]\nname = \"A\"\nposition = 0.58\nmass = 0.024\n";
    let lap = "kind = \"lap\"\nbeam = \"timoshenko\"\nposition = 0.22\noverlap = { length = 0.04, mass = 0.05 }";
    let right = "[beam.right]\nthickness = 0.008\n";
    let cases = [
        ("kind = \"cantilever\"\nbeam = \"timoshenko\"", sensors),
        (lap, &format!("{right}{sensors}")),
    ];
    for (joint, more) in cases {
        let (shapes, predicted) = described(joint, more);
        assert_eq!(shapes.len(), predicted.len());
        for (shape, predicted) in shapes.iter().zip(&predicted) {
            // Two finite-element models of one structure: 60 elements are right to 1e-5 at mode 6, and
            // an overlap's mass at two points in either half instead of spread adds as much.
            let off = (shape.frequency / predicted - 1.0).abs();
            assert!(off < 5e-5, "mode {}: {off}", shape.mode);
        }
    }
}

#[test]
fn prop_a_lap_joints_halves_end_apart() {
    let joint = "kind = \"lap\"\nbeam = \"euler\"\nposition = 0.22";
    let (shapes, _) = described(joint, "");
    let twice = |shape: &SampledShape| {
        let mut pairs = shape.positions.windows(2);
        pairs.position(|pair| pair[0] == pair[1])
    };
    for shape in &shapes {
        let at = twice(shape).expect("the joint's place stands twice");
        assert!((shape.positions[at] - 0.22).abs() < 1e-12);
    }
    let jump = |shape: &SampledShape| {
        let at = twice(shape).unwrap();
        (shape.displacements[at + 1] - shape.displacements[at]).abs()
    };
    // A spring of 2 MN/m gives by a good part of the motion in some mode of five.
    assert!(
        shapes.iter().map(jump).fold(0.0, f64::max) > 0.05,
        "no joint opens"
    );
}
