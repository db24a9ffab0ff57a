//! The tested structure with everything fastened to it, against independent solutions.

use super::shared::{MESH, assert_close, frequencies, strip};
use proptest::prelude::*;
use std::f64::consts::PI;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::specimen::{
    Base, Body, Hinge, Joint, LapLayout, LapOverlap, Mesh, PointInertia, PointMass, PointSpring,
    Specimen, SpecimenModes,
};
use tapjoint_beam::{
    Assembly, Beam, BeamTheory, JointStiffness, StructureError, mode_shapes, natural_frequencies,
    natural_modes,
};

fn springs(kx: f64, ky: f64, coupling: f64) -> Option<Joint> {
    let units = StiffnessUnits::of(&strip());
    Some(Joint {
        kt: kx * units.kt,
        kr: ky * units.kr,
        coupling,
    })
}

fn cantilever(kx: f64, ky: f64, coupling: f64) -> Specimen {
    Specimen::new(Body::One(strip()), springs(kx, ky, coupling))
}

fn lap(kx: f64, ky: f64) -> Specimen {
    let beam = strip();
    let half = Beam {
        length: 0.5 * beam.length,
        ..beam
    };
    Specimen::new(Body::Joined([half; 2]), springs(kx, ky, 0.0))
}

fn free() -> Specimen {
    Specimen::new(Body::One(strip()), None)
}

// ---------------------------------------------------------------------------------------------
// Against the closed form of beam and joint

/// Against the closed form of either theory. 60 elements leave 5e-8 in the seventh mode of the
/// Timoshenko beam, 1e-9 in that of Euler's.
fn agrees_with_closed_form(specimen: &Specimen, assembly: Assembly, joint: &JointStiffness) {
    for (theory, shear_rotary) in [(BeamTheory::Euler, 0.0), (BeamTheory::Timoshenko, 1.0)] {
        let specimen = Specimen {
            shear_rotary,
            ..specimen.clone()
        };
        // Neither has the stiffening by the width.
        let beam = strip();
        let exact = natural_modes(assembly, joint, &beam.slenderness(theory), 7).unwrap();
        let exact: Vec<f64> = exact
            .iter()
            .map(|mode| beam.frequency_of(mode.lambda))
            .collect();
        let found = frequencies(&specimen, 7, Mesh::DIAGNOSIS);
        let case = format!("{theory:?} {assembly:?} {joint:?}");
        assert_close(&found, &exact, 1e-7, &case);
    }
}

#[test]
fn limit_cantilever_is_the_closed_form() {
    let infinite = f64::INFINITY;
    for (kx, ky) in [
        (1400.0, 1.2),
        (infinite, infinite),
        (50.0, infinite),
        (infinite, 3.0),
        (0.0, 1.0),
        (10.0, 0.0),
    ] {
        let joint = JointStiffness::two_parameter(kx, ky);
        agrees_with_closed_form(&cantilever(kx, ky, 0.0), Assembly::Cantilever, &joint);
    }
}

#[test]
fn limit_coupled_joint_is_the_closed_form() {
    for coupling in [-0.5, -0.1, 0.3, 0.9] {
        let (kx, ky): (f64, f64) = (1400.0, 1.2);
        let joint = JointStiffness::three_parameter(kx, ky, (kx * ky).sqrt() / coupling);
        agrees_with_closed_form(&cantilever(kx, ky, coupling), Assembly::Cantilever, &joint);
    }
}

#[test]
fn limit_free_beam_is_the_closed_form() {
    agrees_with_closed_form(&free(), Assembly::Free, &JointStiffness::FREE);
}

#[test]
fn limit_lap_joint_is_the_closed_form() {
    let infinite = f64::INFINITY;
    for (kx, ky) in [
        (1400.0, 1.2),
        (infinite, 3.0),
        (30.0, infinite),
        (infinite, infinite),
        (0.0, 1.0),
        (3.0, 0.0),
        // Both halves on their own, nearly: every frequency is nearly double.
        (1e-4, 1e-4),
    ] {
        let joint = JointStiffness::two_parameter(kx, ky);
        agrees_with_closed_form(&lap(kx, ky), Assembly::Lap, &joint);
    }
}

#[test]
fn limit_two_separate_halves_have_every_frequency_twice() {
    let half = Beam {
        length: 0.5 * strip().length,
        ..strip()
    };
    let free = JointStiffness::FREE;
    let single = natural_frequencies(BeamTheory::Euler, &half, Assembly::Free, &free, 3).unwrap();
    let twice: Vec<f64> = single.iter().flat_map(|f| [*f, *f]).collect();
    assert_close(
        &frequencies(&lap(0.0, 0.0), 6, Mesh::DIAGNOSIS),
        &twice,
        1e-7,
        "no joint",
    );
}

#[test]
fn prop_shapes_are_those_of_the_closed_form_and_of_unit_modal_mass() {
    let joint = JointStiffness::two_parameter(1400.0, 1.2);
    let beam = strip();
    let exact = mode_shapes(&beam, Assembly::Cantilever, &joint, 5).unwrap();
    let modes = cantilever(1400.0, 1.2, 0.0)
        .modes(5, Mesh::DIAGNOSIS)
        .unwrap();
    for (mode, shape) in exact.iter().enumerate() {
        let sign =
            (shape.displacement(beam.length) * modes.displacement(mode, beam.length)).signum();
        // A place that is a node of the mesh, two that are not, and the end.
        for x in [
            0.0,
            0.1 * beam.length,
            0.311,
            0.8351 * beam.length,
            beam.length,
        ] {
            let found = sign * modes.displacement(mode, x);
            let expected = shape.displacement(x);
            // A tenth of what (k h)^4/1440 of the fifth mode would be, of a crest of 2/sqrt(m).
            assert!(
                (found - expected).abs() < 3e-6,
                "mode {mode} at {x}: {found}, {expected}"
            );
        }
    }
}

// ---------------------------------------------------------------------------------------------
// Against transfer matrices of Euler's beam, in units of E I, rho A and L

/// What stands at a place: a mass, a spring to the ground, an inertia, or a hinge.
#[derive(Clone, Copy)]
struct Station {
    place: f64,
    mass: f64,
    spring: f64,
    inertia: f64,
    hinge: f64,
}

const NOTHING: Station = Station {
    place: 0.5,
    mass: 0.0,
    spring: 0.0,
    inertia: 0.0,
    hinge: 0.0,
};

/// (w, w', w'', w''') carried over a length without load: Krylov's functions.
fn carried(state: [f64; 4], lambda: f64, length: f64) -> [f64; 4] {
    let z = lambda * length;
    let s = [
        0.5 * (z.cosh() + z.cos()),
        0.5 * (z.sinh() + z.sin()) / lambda,
        0.5 * (z.cosh() - z.cos()) / lambda.powi(2),
        0.5 * (z.sinh() - z.sin()) / lambda.powi(3),
    ];
    std::array::from_fn(|row| {
        (0..4)
            .map(|column| {
                let turn = column + 4 - row;
                let fold = if column < row { lambda.powi(4) } else { 1.0 };
                fold * s[turn % 4] * state[column]
            })
            .sum()
    })
}

/// Determinant that vanishes at a natural frequency of a beam on springs (kx, ky) whose other end
/// is free, with stations in ascending order.
fn determinant(lambda: f64, (kx, ky): (f64, f64), stations: &[Station]) -> f64 {
    let end = |mut state: [f64; 4]| {
        let mut at = 0.0;
        for station in stations {
            state = carried(state, lambda, station.place - at);
            at = station.place;
            // Equilibrium of a slice: w''' falls by (k - omega^2 m) w, w'' by omega^2 j w'.
            state[3] -= (station.spring - lambda.powi(4) * station.mass) * state[0];
            state[1] += station.hinge * state[2];
            state[2] -= lambda.powi(4) * station.inertia * state[1];
        }
        carried(state, lambda, 1.0 - at)
    };
    let moved = end([1.0, 0.0, 0.0, -kx]);
    let turned = end([0.0, 1.0, ky, 0.0]);
    (moved[2] * turned[3] - moved[3] * turned[2]) * (-2.0 * lambda).exp()
}

/// The first `count` roots by bisection, as frequencies (Hz) of the strip.
fn transfer_frequencies(joint: (f64, f64), stations: &[Station], count: usize) -> Vec<f64> {
    let function = |lambda: f64| determinant(lambda, joint, stations);
    let mut roots = Vec::new();
    let mut low = 0.05;
    while roots.len() < count {
        let high = low + 0.01;
        if function(low) * function(high) < 0.0 {
            let (mut a, mut b) = (low, high);
            for _ in 0..60 {
                let middle = 0.5 * (a + b);
                if function(a) * function(middle) <= 0.0 {
                    b = middle
                } else {
                    a = middle
                }
            }
            roots.push(strip().frequency_of(0.5 * (a + b)));
        }
        low = high;
    }
    roots
}

const JOINT: (f64, f64) = (1400.0, 1.2);

/// The specimen with the stations' parts.
fn equipped(stations: &[Station]) -> Specimen {
    let beam = strip();
    let units = StiffnessUnits::of(&beam);
    let mut specimen = cantilever(JOINT.0, JOINT.1, 0.0);
    for station in stations {
        let position = station.place * beam.length;
        specimen.masses.push(PointMass {
            position,
            mass: station.mass * beam.mass(),
            inertia: station.inertia * beam.mass() * beam.length.powi(2),
        });
        specimen.springs.push(PointSpring {
            position,
            stiffness: station.spring * units.kt,
        });
        specimen.hinges.push(Hinge {
            position,
            compliance: station.hinge / units.kr,
        });
    }
    specimen
}

/// On the simulator's mesh, where what an inertia or spring inside an element bends is far below.
fn agrees_with_transfer_matrices(stations: &[Station], case: &str) {
    let exact = transfer_frequencies(JOINT, stations, 7);
    let specimen = equipped(stations);
    assert_close(&frequencies(&specimen, 7, MESH), &exact, 2e-7, case);
    assert_close(
        &frequencies(&specimen, 7, Mesh::DIAGNOSIS),
        &exact,
        5e-6,
        case,
    );
}

#[test]
fn limit_mass_agrees_with_the_frequency_equation() {
    for (place, mass) in [
        (1.0, 0.03),
        (1.0, 1.0),
        (0.8, 0.029),
        (0.4567, 0.1),
        (0.013, 0.5),
    ] {
        let station = Station {
            place,
            mass,
            ..NOTHING
        };
        agrees_with_transfer_matrices(&[station], &format!("mass {mass} at {place}"));
    }
}

#[test]
fn val_clamped_beam_with_a_mass_at_its_end() {
    // 1 + cos cosh = mu lambda (sin cosh - cos sinh) for a clamped beam.
    let beam = strip();
    let mut specimen = cantilever(f64::INFINITY, f64::INFINITY, 0.0);
    for mu in [0.05, 1.0, 10.0] {
        specimen.masses = vec![PointMass {
            position: beam.length,
            mass: mu * beam.mass(),
            inertia: 0.0,
        }];
        for frequency in frequencies(&specimen, 5, MESH) {
            let x = beam.lambda_of(frequency);
            let left = 1.0 / x.cosh() + x.cos();
            let right = mu * x * (x.sin() - x.cos() * x.tanh());
            // The residual per relative error of x is about x (1 + mu x).
            let error = (left - right).abs() / (x * (1.0 + mu * x));
            assert!(error < 1e-7, "mu = {mu}, lambda = {x}: {error:e}");
        }
    }
}

#[test]
fn limit_crack_agrees_with_transfer_matrices() {
    for (place, hinge) in [
        (0.3, 0.05),
        (0.7123, 1.0),
        (0.0001, 0.2),
        (0.5, 10.0),
        (0.99, 0.5),
    ] {
        let station = Station {
            place,
            hinge,
            ..NOTHING
        };
        agrees_with_transfer_matrices(&[station], &format!("hinge {hinge} at {place}"));
    }
}

#[test]
fn limit_two_cracks_in_one_element_agree_with_transfer_matrices() {
    let hinge = |place, hinge| Station {
        place,
        hinge,
        ..NOTHING
    };
    let stations = [hinge(0.3011, 0.2), hinge(0.3036, 0.3)];
    agrees_with_transfer_matrices(&stations, "two hinges");
}

#[test]
fn limit_spring_and_inertia_agree_with_transfer_matrices() {
    let spring = Station {
        place: 0.63,
        spring: 40.0,
        ..NOTHING
    };
    agrees_with_transfer_matrices(&[spring], "spring");
    let inertia = Station {
        place: 0.5,
        inertia: 1e-3,
        mass: 0.05,
        ..NOTHING
    };
    agrees_with_transfer_matrices(&[inertia], "inertia");
}

#[test]
fn limit_a_crack_at_the_root_softens_the_joint() {
    let (kx, ky) = (1400.0, 3.0);
    let mut cracked = cantilever(kx, ky, 0.0);
    let units = StiffnessUnits::of(&strip());
    cracked.hinges.push(Hinge {
        position: 0.0,
        compliance: 0.5 / units.kr,
    });
    let softer = cantilever(kx, 1.0 / (1.0 / ky + 0.5), 0.0);
    // Two ways to the same structure, but in an element with a hinge the second-order term is that
    // of one without.
    assert_close(
        &frequencies(&cracked, 7, Mesh::DIAGNOSIS),
        &frequencies(&softer, 7, Mesh::DIAGNOSIS),
        1e-6,
        "root",
    );
}

#[test]
fn limit_masses_between_nodes_of_a_stocky_beam_are_right_to_one_in_ten_thousand() {
    let strip = strip();
    let stocky = Beam {
        thickness: 0.08 * strip.length,
        ..strip
    };
    let units = StiffnessUnits::of(&stocky);
    let joint = Joint {
        kt: 1400.0 * units.kt,
        kr: 5.0 * units.kr,
        coupling: 0.0,
    };
    for share in [0.03, 0.1] {
        // In the middle of an element, where the error is largest, and at the free end.
        for place in [6.5 / 60.0, 30.5 / 60.0, 48.5 / 60.0, 59.5 / 60.0, 1.0] {
            let (theory, layout) = (BeamTheory::Timoshenko, LapLayout::default());
            let mut loaded =
                Specimen::jointed(theory, &stocky, Assembly::Cantilever, &layout, Some(joint));
            loaded.masses = vec![PointMass::new(place * stocky.length, share * stocky.mass())];
            // Of so many elements this one has a node at each of these places.
            let exact = frequencies(&loaded, 7, Mesh { elements: 480 });
            let found = frequencies(&loaded, 7, Mesh::DIAGNOSIS);
            assert_close(&found, &exact, 1e-4, &format!("{share} at {place}"));
        }
    }
}

#[test]
fn prop_frequencies_are_smooth_where_a_part_crosses_a_node() {
    let step = 1e-4 * strip().length;
    let node = strip().length * 20.0 / 60.0;
    let units = StiffnessUnits::of(&strip());
    let at = |position: f64| {
        let mut specimen = cantilever(1400.0, 1.2, 0.0);
        specimen.hinges.push(Hinge {
            position,
            compliance: 0.1 / units.kr,
        });
        specimen.masses.push(PointMass {
            position,
            mass: 0.03,
            inertia: 0.0,
        });
        frequencies(&specimen, 7, Mesh::DIAGNOSIS)
    };
    let places = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|steps| at(node + steps * step));
    for mode in 0..7 {
        let [a, b, middle, d, e] = places.each_ref().map(|f| f[mode] / places[2][mode]);
        let (far, near) = (a - 2.0 * middle + e, b - 2.0 * middle + d);
        // Of a smooth function the second difference grows with the square of the step, and the
        // fourth derivative leaves 1e-9. A kink of f/L, as large as the slope itself, adds 2e-4 to
        // the difference; what the mesh leaves of 1e-6, not the same in either element,
        // up to 1e-7.
        let kink = far - 4.0 * near;
        assert!(kink.abs() < 1e-7, "mode {mode}: {kink:e} beside {near:e}");
    }
}

// ---------------------------------------------------------------------------------------------
// Thick beams

/// A beam with thickness over length of `ratio`.
fn thick(ratio: f64) -> Beam {
    Beam {
        length: 1.0,
        thickness: ratio,
        ..strip()
    }
}

fn lambdas(specimen: &Specimen, beam: &Beam, count: usize) -> Vec<f64> {
    let found = frequencies(specimen, count, MESH);
    found.iter().map(|f| beam.lambda_of(*f)).collect()
}

/// A Timoshenko beam whose far end is on a stiff spring, clamped by a large inertia besides.
fn held_at_both_ends(ratio: f64, clamped: bool) -> (Specimen, Beam) {
    let beam = thick(ratio);
    let units = StiffnessUnits::of(&beam);
    let mut specimen = Specimen::new(Body::One(beam), Some(Joint::RIGID));
    specimen.shear_rotary = 1.0;
    specimen.springs.push(PointSpring {
        position: 1.0,
        stiffness: 1e9 * units.kt,
    });
    if clamped {
        specimen.masses.push(PointMass {
            position: 1.0,
            mass: 0.0,
            inertia: 1e4 * beam.mass(),
        });
    } else {
        // A rotational spring that is far too soft to count, but makes no motion rigid.
        specimen.joint = Some(Joint {
            kt: f64::INFINITY,
            kr: 1e-7 * units.kr,
            coupling: 0.0,
        });
    }
    (specimen, beam)
}

#[test]
fn val_timoshenko_beams_of_lee_and_schultz() {
    // Lee & Schultz 2004, Journal of Sound and Vibration 269, 609-621, nu = 0.3, k = 5/6, h/L = 0.1.
    // The digits agree with the matrix exponential of the four first-order equations.
    let supported = [3.11568, 6.09066, 8.84052, 11.3431, 13.6132, 15.6790];
    let clamped = [4.57955, 7.33122, 9.85611, 12.1454, 14.2324, 16.1487];
    let (specimen, beam) = held_at_both_ends(0.1, false);
    // Half a unit of the last digit of the shortest number; the inertia gives by 2e-7.
    assert_close(&lambdas(&specimen, &beam, 6), &supported, 5e-6, "supported");
    let (specimen, beam) = held_at_both_ends(0.1, true);
    // The first is that of the inertia.
    let found = lambdas(&specimen, &beam, 7);
    assert_close(&found[1..], &clamped, 5e-6, "clamped");
}

#[test]
fn val_thick_free_and_clamped_beams() {
    // Roots of the determinant of the matrix exponential of Timoshenko's four first-order equations
    // (scipy.linalg.expm, scipy.optimize.brentq), nu = 0.3, k = 5/6.
    let table = [
        (
            0.01,
            None,
            [
                4.729175446,
                7.849078875,
                10.984296144,
                14.113146343,
                17.234991492,
                20.348302407,
            ],
        ),
        (
            0.1,
            None,
            [
                4.648492810,
                7.497187729,
                10.125491831,
                12.507635400,
                14.668209234,
                16.635757744,
            ],
        ),
        (
            0.01,
            Some(Joint::RIGID),
            [
                1.875029274,
                4.692785985,
                7.849556143,
                10.982103503,
                14.109650167,
                17.229786498,
            ],
        ),
        (
            0.1,
            Some(Joint::RIGID),
            [
                1.867713830,
                4.572408057,
                7.415415007,
                9.987349881,
                12.322432540,
                14.445893272,
            ],
        ),
    ];
    for (ratio, joint, expected) in table {
        let beam = thick(ratio);
        let mut specimen = Specimen::new(Body::One(beam), joint);
        specimen.shear_rotary = 1.0;
        let case = format!("{joint:?}, h/L = {ratio}");
        // What 200 elements leave of the thick free beam's sixth mode.
        assert_close(&lambdas(&specimen, &beam, 6), &expected, 5e-8, &case);
    }
}

#[test]
fn limit_shear_and_rotary_inertia_scale_between_the_theories() {
    let mut specimen = cantilever(1400.0, 1.2, 0.0);
    let at = |specimen: &mut Specimen, share: f64| {
        specimen.shear_rotary = share;
        frequencies(specimen, 5, Mesh::DIAGNOSIS)
    };
    let [none, half, full] = [0.0, 0.5, 1.0].map(|share| at(&mut specimen, share));
    for mode in 0..5 {
        let (first, second) = (none[mode] - half[mode], half[mode] - full[mode]);
        // A correction of 0.2 % at most is linear in its share to as much.
        assert!(
            first > 0.0 && (first / second - 1.0).abs() < 0.01,
            "mode {mode}"
        );
    }
}

// ---------------------------------------------------------------------------------------------
// Axial force

#[test]
fn val_tension_of_a_supported_beam() {
    // omega_n^2 = (n pi/L)^4 E I/(rho A) (1 + P L^2/(E I n^2 pi^2)).
    let (mut specimen, beam) = held_at_both_ends(0.01, false);
    specimen.shear_rotary = 0.0;
    let euler = PI * PI * beam.bending_stiffness() / beam.length.powi(2);
    for share in [-0.9, -0.1, 0.2, 3.0] {
        specimen.axial_force = share * euler;
        let expected: Vec<f64> = (1..=5)
            .map(|n| {
                let n = f64::from(n);
                let lambda4 = (n * PI).powi(4) * (1.0 + share / (n * n));
                beam.frequency_of(lambda4.powf(0.25))
            })
            .collect();
        // The end's stiff springs leave 1e-7, near buckling ten times as much.
        let case = format!("{share} of Euler's force");
        assert_close(&frequencies(&specimen, 5, MESH), &expected, 2e-6, &case);
    }
}

#[test]
fn limit_beyond_eulers_force_the_beam_buckles() {
    let mut specimen = cantilever(f64::INFINITY, f64::INFINITY, 0.0);
    let beam = strip();
    let euler = 0.25 * PI * PI * beam.bending_stiffness() / beam.length.powi(2);
    specimen.axial_force = -0.9999 * euler;
    assert!(frequencies(&specimen, 1, Mesh::DIAGNOSIS)[0] < 0.4);
    specimen.axial_force = -1.0001 * euler;
    let error = specimen.modes(1, Mesh::DIAGNOSIS).unwrap_err().to_string();
    assert!(error.contains("buckles"), "{error}");
}

// ---------------------------------------------------------------------------------------------
// Joint mass, overlap, base, suspension

#[test]
fn limit_joint_mass_is_a_mass_at_the_root() {
    let mut with_joint_mass = cantilever(50.0, 1.2, 0.0);
    with_joint_mass.joint_mass = PointInertia {
        mass: 0.05,
        inertia: 1e-5,
    };
    let mut with_mass = cantilever(50.0, 1.2, 0.0);
    with_mass.masses.push(PointMass {
        position: 0.0,
        mass: 0.05,
        inertia: 1e-5,
    });
    let (a, b) = (
        frequencies(&with_joint_mass, 5, Mesh::DIAGNOSIS),
        frequencies(&with_mass, 5, Mesh::DIAGNOSIS),
    );
    assert_close(&a, &b, 1e-12, "joint mass");
    // Of a lap joint with rigid springs both halves are one mass in the middle.
    let mut joined = lap(f64::INFINITY, f64::INFINITY);
    joined.joint_mass.mass = 0.05;
    let mut whole = free();
    whole.masses.push(PointMass {
        position: 0.5 * strip().length,
        mass: 0.05,
        inertia: 0.0,
    });
    assert_close(
        &frequencies(&joined, 5, Mesh::DIAGNOSIS),
        &frequencies(&whole, 5, Mesh::DIAGNOSIS),
        1e-10,
        "lap",
    );
}

#[test]
fn limit_a_short_overlap_is_a_joint_mass() {
    let mut spread = lap(1400.0, 3.0);
    spread.overlap = Some(LapOverlap {
        length: 1e-6,
        mass: 0.05,
    });
    let mut point = lap(1400.0, 3.0);
    point.joint_mass.mass = 0.05;
    // The overlap's length is 2e-6 of the beam's.
    assert_close(
        &frequencies(&spread, 5, Mesh::DIAGNOSIS),
        &frequencies(&point, 5, Mesh::DIAGNOSIS),
        1e-5,
        "overlap",
    );
}

/// A rigid bar (nearly) on a rotational spring, on a rotating base.
#[test]
fn val_fixture_has_the_frequencies_of_two_inertias() {
    let beam = Beam {
        modulus: 207e15,
        ..strip()
    };
    let kr = 300.0;
    let mut specimen = Specimen::new(
        Body::One(beam),
        Some(Joint {
            kt: f64::INFINITY,
            kr,
            coupling: 0.0,
        }),
    );
    let bar = beam.mass() * beam.length.powi(2) / 3.0;
    for (frequency, ratio) in [(40.0, 0.3), (8.0, 0.05), (200.0, 1.0)] {
        specimen.base = Some(Base { frequency, ratio });
        let stiffness = kr / ratio;
        let base = stiffness / (2.0 * PI * frequency).powi(2);
        // det [[kr - s J, -kr], [-kr, kr + kb - s I]] = 0.
        let (a, b, c) = (
            bar * base,
            bar * (kr + stiffness) + base * kr,
            kr * stiffness,
        );
        let root = (b * b - 4.0 * a * c).sqrt();
        let expected = [(b - root) / (2.0 * a), (b + root) / (2.0 * a)];
        let expected = expected.map(|square| square.sqrt() / (2.0 * PI));
        // The bar bends 1e-6 of what the spring gives, and the matrix is as badly conditioned.
        let case = format!("base {frequency} Hz, ratio {ratio}");
        assert_close(
            &frequencies(&specimen, 2, Mesh { elements: 6 }),
            &expected,
            1e-5,
            &case,
        );
    }
}

#[test]
fn prop_base_adds_one_mode_that_is_its_own() {
    let plain = cantilever(1400.0, 1.2, 0.0);
    let mut based = plain.clone();
    based.base = Some(Base {
        frequency: 300.0,
        ratio: 1e-4,
    });
    let modes = based.modes(6, Mesh::DIAGNOSIS).unwrap();
    let own: Vec<usize> = (0..6)
        .filter(|&mode| modes.base_participation(mode) > 0.9)
        .collect();
    assert_eq!(own.len(), 1);
    let frequency = modes.frequencies()[own[0]];
    // The joint adds a ten-thousandth of the base's stiffness.
    assert!((frequency / 300.0 - 1.0).abs() < 1e-3, "{frequency}");
    let mut others = modes.frequencies().to_vec();
    others.remove(own[0]);
    assert_close(
        &others,
        &frequencies(&plain, 5, Mesh::DIAGNOSIS),
        1e-3,
        "the others",
    );
}

#[test]
fn prop_suspension_is_listed_apart() {
    let mut specimen = free();
    let (mass, length) = (strip().mass(), strip().length);
    for position in [0.25 * length, 0.75 * length] {
        specimen.springs.push(PointSpring {
            position,
            stiffness: 20.0,
        });
    }
    let modes = specimen.modes(5, Mesh::DIAGNOSIS).unwrap();
    // Rock on 2 k (L/4)^2 with the inertia m L^2/12; bounce on 2 k.
    let expected = [
        40.0 * length * length / 16.0 / (mass * length * length / 12.0),
        40.0 / mass,
    ];
    let expected = expected.map(|square| square.sqrt() / (2.0 * PI));
    // The springs are 1e-4 of the beam's stiffness.
    assert_close(
        modes.suspension_frequencies(),
        &expected,
        1e-3,
        "suspension",
    );
    assert_close(
        modes.frequencies(),
        &frequencies(&free(), 5, Mesh::DIAGNOSIS),
        1e-3,
        "bending",
    );
    assert!(
        free()
            .modes(5, Mesh::DIAGNOSIS)
            .unwrap()
            .suspension_frequencies()
            .is_empty()
    );
}

// ---------------------------------------------------------------------------------------------
// What the modes say

#[test]
fn prop_joint_energy_is_the_sensitivity_to_its_stiffness() {
    let modes = cantilever(1400.0, 1.2, 0.3)
        .modes(5, Mesh::DIAGNOSIS)
        .unwrap();
    let step = 1e-5;
    let stiffer = frequencies(
        &cantilever(1400.0 * (1.0 + step), 1.2 * (1.0 + step), 0.3),
        5,
        Mesh::DIAGNOSIS,
    );
    let softer = frequencies(
        &cantilever(1400.0 * (1.0 - step), 1.2 * (1.0 - step), 0.3),
        5,
        Mesh::DIAGNOSIS,
    );
    for mode in 0..5 {
        // d ln f/d ln k = half the share of the strain energy.
        let slope = (stiffer[mode] / softer[mode]).ln() / (2.0 * step);
        let share = 0.5 * modes.joint_energy_share(mode);
        // Truncation of the difference is 1e-10, its rounding 1e-9.
        assert!(
            (slope - share).abs() < 1e-7,
            "mode {mode}: {slope}, {share}"
        );
    }
}

#[test]
fn prop_joint_motion_carries_the_root() {
    let modes = cantilever(1400.0, 1.2, 0.0)
        .modes(3, Mesh::DIAGNOSIS)
        .unwrap();
    for mode in 0..3 {
        let [w, theta] = modes.joint_motion(mode);
        assert_eq!(w, modes.displacement(mode, 0.0));
        assert_eq!(theta, modes.slope(mode, 0.0));
    }
}

#[test]
fn limit_a_base_from_nothing_has_the_right_derivative() {
    // The shape of a specimen without base has none to move; its quotient finds it by itself.
    let plain = cantilever(1400.0, 1.2, 0.0);
    let modes = plain.modes(4, Mesh::DIAGNOSIS).unwrap();
    let mut based = plain.clone();
    based.base = Some(Base {
        frequency: 5000.0,
        ratio: 1e-5,
    });
    let exact = frequencies(&based, 4, Mesh::DIAGNOSIS);
    let found = modes.rayleigh_frequencies(&based).unwrap();
    for mode in 0..4 {
        let [a, b] = [exact[mode], found[mode]].map(|f| f / modes.frequencies()[mode] - 1.0);
        assert!(
            a < 0.0 && (a / b - 1.0).abs() < 1e-3,
            "mode {mode}: {a:e} {b:e}"
        );
    }
}

#[test]
fn limit_shapes_do_not_serve_other_structures() {
    let modes = cantilever(1400.0, 1.2, 0.0)
        .modes(2, Mesh::DIAGNOSIS)
        .unwrap();
    for other in [lap(1400.0, 1.2), cantilever(f64::INFINITY, 1.2, 0.0)] {
        assert!(modes.rayleigh_frequencies(&other).is_err());
        assert!(modes.perturbed(&other).unwrap().is_none());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever is changed by one part in 100 000. A tip behind a deep crack turns its modes by some hundred times
    /// that; what one step leaves of a shape is the cube of it, of a frequency the sixth power.
    #[test]
    fn prop_modes_found_near_others_are_the_modes(
        (kx, ky, coupling) in (10.0..3000.0, 0.1..5.0, -0.5..0.5),
        (place, share, compliance) in (0.05..0.95, 0.0..0.3, 0.0..0.03),
        base in 30.0..900.0,
    ) {
        let length = strip().length;
        let specimen = |more: f64| {
            let mut one = cantilever(kx * more, ky / more, coupling);
            one.base = Some(Base { frequency: base * more, ratio: 0.02 });
            one.masses.push(PointMass {
                position: place * length,
                mass: more * share * strip().mass(),
                inertia: 0.0,
            });
            one.hinges.push(Hinge { position: (1.0 - place) * length * more, compliance });
            one
        };
        let here = specimen(1.0).modes(7, Mesh::DIAGNOSIS).unwrap();
        let other = specimen(1.00001);
        let exact = other.modes(7, Mesh::DIAGNOSIS).unwrap();
        // A hinge that moves to another element asks for new modes.
        let near = here.perturbed(&other).unwrap();
        prop_assume!(near.is_some());
        let near = near.unwrap();
        // Two modes so close that they exchange their shapes change by more.
        let f = exact.frequencies();
        prop_assume!(f.windows(2).all(|two| two[1] / two[0] > 1.05));
        assert_close(near.frequencies(), f, 1e-10, "near");
        for mode in 0..7 {
            let at = |modes: &SpecimenModes, x: f64| modes.displacement(mode, x * length);
            let sign = (at(&exact, 1.0) * at(&near, 1.0)).signum();
            for x in [0.1, 0.37, 0.8, 1.0] {
                let (a, b) = (sign * at(&exact, x), at(&near, x));
                prop_assert!((a - b).abs() < 1e-6 * at(&exact, 1.0).abs(), "{mode} {x}: {a} {b}");
            }
        }
    }
}

/// A hinge that moves across a node changes the slope there by its kink: one step left a frequency off by 2e-4.
#[test]
fn regress_modes_near_others_end_where_a_hinge_changes_its_element() {
    let length = strip().length;
    let hinged = |position: f64| {
        let mut one = cantilever(10.0, 0.1, 0.0);
        one.hinges.push(Hinge {
            position,
            compliance: 0.024,
        });
        one
    };
    let node = length / Mesh::DIAGNOSIS.elements as f64;
    let before = hinged((10.0 - 1e-5) * node);
    let modes = before.modes(3, Mesh::DIAGNOSIS).unwrap();
    assert!(
        modes
            .perturbed(&hinged((10.0 - 2e-5) * node))
            .unwrap()
            .is_some()
    );
    assert!(
        modes
            .perturbed(&hinged((10.0 + 1e-5) * node))
            .unwrap()
            .is_none()
    );
}

// ---------------------------------------------------------------------------------------------
// What cannot exist

#[test]
fn limit_what_cannot_exist_is_named() {
    let text = |change: fn(&mut Specimen)| {
        let mut specimen = cantilever(1400.0, 1.2, 0.0);
        change(&mut specimen);
        specimen.modes(1, Mesh::DIAGNOSIS).unwrap_err().to_string()
    };
    let beyond = text(|s| {
        s.masses.push(PointMass {
            position: 0.5,
            mass: 0.1,
            inertia: 0.0,
        })
    });
    assert!(
        beyond.contains("0.5 m") && beyond.contains("0.423"),
        "{beyond}"
    );
    let negative = text(|s| s.joint_mass.mass = -1.0);
    assert!(negative.contains("joint mass is -1"), "{negative}");
    let coupling = text(|s| s.joint = springs(1400.0, 1.2, 1.0));
    assert!(coupling.contains("between -1 and 1"), "{coupling}");
    let base = text(|s| {
        s.joint = Some(Joint::RIGID);
        s.base = Some(Base {
            frequency: 100.0,
            ratio: 0.1,
        });
    });
    assert!(base.contains("finite kr"), "{base}");
    let mut coupled = lap(1400.0, 1.2);
    coupled.joint = springs(1400.0, 1.2, 0.1);
    let error = coupled.modes(1, Mesh::DIAGNOSIS).unwrap_err();
    assert!(matches!(error, StructureError::NoCoupling { .. }));
    let coarse = cantilever(1.0, 1.0, 0.0)
        .modes(9, Mesh { elements: 3 })
        .unwrap_err();
    assert!(coarse.to_string().contains("divide finer"));
}

#[test]
fn prop_modes_from_those_next_to_it_are_those_of_a_new_solution() {
    let mut here = cantilever(1400.0, 1.25, 0.0);
    here.masses = vec![PointMass::new(0.2, 0.01)];
    let count = 6;
    let near = here.beam_modes(count, Mesh::DIAGNOSIS).unwrap();
    let mut others = Vec::new();
    // From next to nothing to changes that exchange the order of whole modes.
    for change in [1e-6, 0.01, 0.3, 3.0] {
        let mut heavier = here.clone();
        heavier.masses[0].mass *= 1.0 + 10.0 * change;
        let mut softer = here.clone();
        softer.joint.as_mut().unwrap().kr /= 1.0 + change;
        let mut cracked = here.clone();
        cracked.hinges.push(Hinge {
            position: 0.15,
            compliance: 0.01 * change,
        });
        let mut supported = here.clone();
        supported.springs.push(PointSpring {
            position: 0.4,
            stiffness: 1e4 * change,
        });
        others.extend([heavier, softer, cracked, supported]);
    }
    for other in others {
        let found = other
            .beam_modes_from(&near, count, Mesh::DIAGNOSIS)
            .unwrap();
        let solved = other.beam_modes(count, Mesh::DIAGNOSIS).unwrap();
        let pairs = found
            .modes
            .frequencies()
            .iter()
            .zip(solved.modes.frequencies());
        for (mode, (found_at, solved_at)) in pairs.enumerate() {
            let error = found_at / solved_at - 1.0;
            assert!(error.abs() < 1e-11, "mode {mode}: {error:e}");
            let [a, b] = [&found, &solved].map(|one| one.modes.displacement(mode, 0.3).abs());
            assert!((a - b).abs() < 1e-6 * b.max(1.0), "mode {mode}: {a} {b}");
        }
    }
}
