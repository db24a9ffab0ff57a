//! What hangs and what its joint gives, against closed forms and static solutions.

use crate::shared::steel_strip;
use crate::simulate_test::ClosedForm;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;
use tapjoint::simulate::{ObservedStructure, SpecimenSettings};
use tapjoint::structure::Beam;
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::specimen::{Body, Joint, PointSpring, Specimen};

/// Modes up to this frequency (Hz) move; what is compared lies below a tenth of it.
const HIGHEST: f64 = 6000.0;

fn hung(suspension: Option<[f64; 2]>) -> SpecimenSettings {
    SpecimenSettings {
        suspension,
        ..SpecimenSettings::default()
    }
}

fn springs(ky: f64) -> (Option<Joint>, f64, f64) {
    let units = StiffnessUnits::of(&steel_strip());
    let (kt, kr) = (1400.0 * units.kt, ky * units.kr);
    let coupling = 0.0;
    (Some(Joint { kt, kr, coupling }), kt, kr)
}

fn halves() -> Body {
    let beam = steel_strip();
    let half = Beam {
        length: 0.5 * beam.length,
        ..beam
    };
    Body::Joined([half; 2])
}

// ---------------------------------------------------------------- the joint's static compliance

/// Rotation of the joint's spring per moment on its ends: of the modes that move, and of the rest.
fn joint_compliance(specimen: &Specimen, suspension: Option<[f64; 2]>) -> f64 {
    let seen = ObservedStructure::new(specimen, &hung(suspension), &[], 0.0, HIGHEST).unwrap();
    let reduced = seen.reduced();
    let modes = reduced.modes.iter();
    let moving: f64 = modes
        .map(|mode| (mode.at_joint / (TAU * mode.frequency)).powi(2))
        .sum();
    // No finite number of modes gives all that a moment gives.
    assert!(reduced.joint_compliance > 0.0);
    moving + reduced.joint_compliance
}

fn assert_compliance(specimen: &Specimen, suspension: Option<[f64; 2]>, expected: f64, case: &str) {
    let found = joint_compliance(specimen, suspension);
    // The stiffness matrix of 200 elements reaches to 32 x 200^4 = 5e10 of its lowest eigenvalues,
    // by which the static solution magnifies rounding of 1e-17: 3e-7 at most was found.
    assert!(
        (found / expected - 1.0).abs() < 1e-6,
        "{case}: {found} for {expected} rad/(N m)"
    );
}

#[test]
fn limit_joint_compliance_of_a_beam_that_nothing_else_holds_is_its_springs() {
    for ky in [0.3, 5.0, 80.0] {
        let (joint, kt, kr) = springs(ky);
        let mut specimen = Specimen::new(Body::One(steel_strip()), joint);
        assert_compliance(&specimen, None, 1.0 / kr, "cantilever");
        // The compliance matrix has 1/Kr on its diagonal, coupled or not.
        let coupling = -0.4;
        specimen.joint = Some(Joint { kt, kr, coupling });
        assert_compliance(&specimen, None, 1.0 / kr, "coupled");
        let lap = Specimen::new(halves(), joint);
        assert_compliance(&lap, None, 1.0 / kr, "lap");
        // A moment and its opposite do not move what hangs.
        assert_compliance(&lap, Some([1.5, 2.0]), 1.0 / kr, "hanging lap");
    }
}

#[test]
fn val_joint_compliance_of_a_beam_on_a_spring_to_the_ground() {
    let beam = steel_strip();
    let bending = beam.bending_stiffness();
    let (joint, kt, kr) = springs(2.0);
    for (place, stiffness) in [(0.2, 500.0), (0.338, 5e4)] {
        let mut specimen = Specimen::new(Body::One(beam), joint);
        specimen.springs = vec![PointSpring {
            position: place,
            stiffness,
        }];
        // Force method: the moment turns the beam by M/Kr, which lifts the place by a M/Kr; the
        // spring presses it back through f = 1/Kt + a^2/Kr + a^3/(3 E I).
        let give = 1.0 / kt + place * place / kr + place.powi(3) / (3.0 * bending);
        let back = stiffness * place * place / kr / (1.0 + stiffness * give);
        assert_compliance(&specimen, None, (1.0 - back) / kr, "spring to the ground");
    }
}

#[test]
fn val_joint_compliance_of_a_beam_under_axial_force() {
    let beam = steel_strip();
    let (joint, _, kr) = springs(0.5);
    for force in [400.0, -120.0] {
        let mut specimen = Specimen::new(Body::One(beam), joint);
        specimen.axial_force = force;
        // Without a lateral load E I w''' = P w', and w'' = 0 at the tip: the beam withstands the
        // turn of its end by sqrt(P E I) tanh(sqrt(P/E I) L), under pressure by -sqrt tan.
        let root = (force.abs() * beam.bending_stiffness()).sqrt();
        let angle = (force.abs() / beam.bending_stiffness()).sqrt() * beam.length;
        let beam_side = if force > 0.0 {
            root * angle.tanh()
        } else {
            -root * angle.tan()
        };
        assert_compliance(&specimen, None, 1.0 / (kr + beam_side), "axial force");
    }
}

#[test]
fn val_joint_compliance_of_a_lap_joint_on_three_cables() {
    let beam = steel_strip();
    let (joint, kt, kr) = springs(3.0);
    let length = beam.length;
    let places = [0.1, 0.3, 0.9].map(|share| share * length);
    let stiffness = 3000.0;
    let mut specimen = Specimen::new(halves(), joint);
    specimen.springs = places
        .map(|position| PointSpring {
            position,
            stiffness,
        })
        .to_vec();
    // Force method: held by the outer cables, a unit force at the middle one bends the beam as a
    // triangle with moment m at the joint and shear v there.
    let (span, a) = (places[2] - places[0], places[1] - places[0]);
    let b = span - a;
    let (left, right) = (b / span, a / span);
    let (m, v) = (right * (places[2] - 0.5 * length), right);
    let bent = a * a * b * b / (3.0 * span * beam.bending_stiffness());
    let carried = (left * left + right * right) / stiffness;
    let give = bent + carried + m * m / kr + v * v / kt;
    let back = stiffness * m * m / kr / (1.0 + stiffness * give);
    // A suspension of a thousandth of a hertz is none beside these cables.
    let soft = Some([1e-3, 1e-3]);
    assert_compliance(&specimen, soft, (1.0 - back) / kr, "three cables");
}

#[test]
fn regress_a_pivot_has_a_finite_joint_compliance() {
    let (_, kt, _) = springs(1.0);
    let joint = Some(Joint {
        kt,
        kr: 0.0,
        coupling: 0.0,
    });
    let specimen = Specimen::new(Body::One(steel_strip()), joint);
    let seen = ObservedStructure::new(&specimen, &hung(None), &[], 0.0, HIGHEST).unwrap();
    let left = seen.reduced().joint_compliance;
    // Less than that of a beam hinged at both ends, L/(3 E I), and more than nothing.
    let hinged = steel_strip().length / (3.0 * steel_strip().bending_stiffness());
    assert!((1e-4 * hinged..hinged).contains(&left), "{left}");
}

// ---------------------------------------------------------------- hanging

/// Name, suspension (Hz), and cables of (place, stiffness).
type Case = (&'static str, [f64; 2], Vec<(f64, f64)>);

/// The strip, hanging at these frequencies (Hz), with cables of (place, stiffness).
struct Hanging {
    suspension: [f64; 2],
    cables: Vec<(f64, f64)>,
    /// Stiffness of a pivot at the left end (N/m); 0 = it hangs.
    pivot: f64,
}

impl Hanging {
    /// Receptance without cables: that of the closed form, its rigid motions on the suspension.
    fn bare(&self, x: f64, force: f64, omega: f64) -> f64 {
        let beam = steel_strip();
        let closed = ClosedForm {
            stiffness: beam.bending_stiffness(),
            mass: beam.mass_per_length(),
            length: beam.length,
            springs: (self.pivot, 0.0),
            damping: (0.0, 0.0),
            places: (force, x),
        };
        let receptance = closed.receptance(omega).re;
        if self.pivot > 0.0 {
            return receptance;
        }
        let (mass, centre) = (beam.mass(), 0.5 * beam.length);
        let inertia = mass * beam.length.powi(2) / 12.0;
        let motions = [1.0 / mass, (x - centre) * (force - centre) / inertia];
        let hung = motions.iter().zip(self.suspension).map(|(motion, f)| {
            let natural = (TAU * f).powi(2);
            motion * (1.0 / (natural - omega * omega) + 1.0 / (omega * omega))
        });
        receptance + hung.sum::<f64>()
    }

    /// With the cables: the forces R that they bear obey w + R/k = 0.
    fn receptance(&self, x: f64, force: f64, omega: f64) -> f64 {
        let count = self.cables.len();
        if count == 0 {
            return self.bare(x, force, omega);
        }
        let matrix = DMatrix::from_fn(count, count, |i, j| {
            let own = if i == j { 1.0 / self.cables[i].1 } else { 0.0 };
            own + self.bare(self.cables[i].0, self.cables[j].0, omega)
        });
        let column =
            |place: f64| DVector::from_fn(count, |i, _| self.bare(self.cables[i].0, place, omega));
        let borne = matrix.lu().solve(&column(force)).unwrap();
        self.bare(x, force, omega) - column(x).dot(&borne)
    }

    fn seen(&self, sensors: &[f64]) -> ObservedStructure {
        let joint = if self.pivot > 0.0 {
            Some(Joint {
                kt: self.pivot,
                kr: 0.0,
                coupling: 0.0,
            })
        } else {
            None
        };
        let mut specimen = Specimen::new(Body::One(steel_strip()), joint);
        specimen.springs = self
            .cables
            .iter()
            .map(|&(position, stiffness)| PointSpring {
                position,
                stiffness,
            })
            .collect();
        let settings = hung(Some(self.suspension));
        ObservedStructure::new(&specimen, &settings, sensors, 0.0, HIGHEST).unwrap()
    }

    fn agrees(&self, case: &str) {
        let length = steel_strip().length;
        let sensors = [0.0, 0.37 * length, length];
        let seen = self.seen(&sensors);
        let place = 0.8 * length;
        let struck = seen.struck(place);
        // From far below the suspension to beyond the first elastic modes, off all of them.
        for frequency in [0.2, 0.7, 4.1, 11.3, 37.0, 71.0, 263.0, 590.0] {
            let omega = TAU * frequency;
            for (sensor, &x) in sensors.iter().enumerate() {
                let terms: Vec<f64> = seen
                    .reduced()
                    .modes
                    .iter()
                    .zip(&struck.at_modes)
                    .map(|(mode, at)| {
                        let natural = TAU * mode.frequency;
                        mode.at_sensors[sensor] * at / (natural * natural - omega * omega)
                    })
                    .collect();
                let found = terms.iter().sum::<f64>() + struck.to_sensors[sensor];
                let expected = self.receptance(x, place, omega);
                let size: f64 = terms.iter().map(|term| term.abs()).sum();
                // What follows like a spring, a hundredth of the whole, does so to (f/6 kHz)^2; what
                // is left out beyond 36 modes is an alternating sum of 4/lambda^4 L^3/(E I), 2.4e-8.
                // Squares of the suspension's frequencies are 1e-9 of the highest mode's, and keep
                // seven digits beside it; near a resonance one less.
                let beam = steel_strip();
                let left_out = 3e-8 * length.powi(3) / beam.bending_stiffness();
                let tolerance =
                    1e-2 * (frequency / HIGHEST).powi(2) * size + left_out + 1e-6 * size;
                assert!(
                    (found - expected).abs() < tolerance,
                    "{case}, {frequency} Hz, {x} m: {found} for {expected} m/N"
                );
            }
        }
    }
}

#[test]
fn limit_a_soft_suspension_leaves_the_free_beam() {
    let hanging = Hanging {
        suspension: [1e-4, 1e-4],
        cables: Vec::new(),
        pivot: 0.0,
    };
    hanging.agrees("hardly hung");
    // -1/(m omega^2) at the centre of mass, to the elastic modes' omega^2/omega_1^2.
    let beam = steel_strip();
    let omega = TAU * 0.05;
    let centre = 0.5 * beam.length;
    let seen = hanging.seen(&[centre]);
    let struck = seen.struck(centre);
    let modes = seen.reduced().modes.iter().zip(&struck.at_modes);
    let found: f64 = modes
        .map(|(mode, at)| {
            mode.at_sensors[0] * at / ((TAU * mode.frequency).powi(2) - omega * omega)
        })
        .sum();
    let expected = -1.0 / (beam.mass() * omega * omega);
    // (1e-4/0.05)^2 = 4e-6 of the suspension.
    assert!(
        (found / expected - 1.0).abs() < 1e-5,
        "{found} for {expected}"
    );
}

#[test]
fn val_a_beam_hung_on_cables_has_the_receptance_of_its_parts() {
    let length = steel_strip().length;
    let cases: [Case; 6] = [
        ("hung alone", [1.5, 2.0], vec![]),
        ("one cable", [1.5, 2.0], vec![(0.8 * length, 300.0)]),
        // They hold up and down more than rocking, which then comes first.
        (
            "two cables",
            [1.5, 2.0],
            vec![(0.25 * length, 200.0), (0.75 * length, 200.0)],
        ),
        ("a stiff cable", [1.5, 2.0], vec![(length, 3e4)]),
        (
            "three cables, a stiff suspension",
            [9.0, 14.0],
            vec![
                (0.1 * length, 5e3),
                (0.5 * length, 800.0),
                (0.9 * length, 100.0),
            ],
        ),
        ("rocking first", [2.0, 1.5], vec![(0.3 * length, 50.0)]),
    ];
    for (case, suspension, cables) in cases {
        let hanging = Hanging {
            suspension,
            cables,
            pivot: 0.0,
        };
        hanging.agrees(case);
        assert_eq!(hanging.seen(&[]).suspension_frequencies().count(), 2);
    }
}

#[test]
fn val_a_beam_on_a_pivot_turns_against_its_cable() {
    let length = steel_strip().length;
    let hanging = Hanging {
        suspension: [1.5, 2.0],
        cables: vec![(0.6 * length, 200.0)],
        pivot: 2e6,
    };
    hanging.agrees("pivot");
    assert_eq!(hanging.seen(&[]).suspension_frequencies().count(), 1);
}

#[test]
fn val_tension_adds_to_rocking_and_not_to_up_and_down() {
    let beam = steel_strip();
    let mut specimen = Specimen::new(Body::One(beam), None);
    specimen.axial_force = 0.5;
    let seen = ObservedStructure::new(&specimen, &hung(Some([1.5, 2.0])), &[], 0.0, HIGHEST);
    let found: Vec<f64> = seen.unwrap().suspension_frequencies().collect();
    // P L theta^2/2 with the inertia m L^2/12.
    let tension = 12.0 * specimen.axial_force / (beam.mass() * beam.length);
    let expected = [1.5, (4.0 + tension / (TAU * TAU)).sqrt()];
    for (found, expected) in found.iter().zip(expected) {
        // The beam bends by P L^2/(E I)/100 = 1e-5 of the turn.
        assert!(
            (found / expected - 1.0).abs() < 1e-4,
            "{found} for {expected} Hz"
        );
    }
}
