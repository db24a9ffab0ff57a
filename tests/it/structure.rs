//! Theory of beams and joints: limits, properties, and agreement of independent routes.

// A test that unwraps fails as it should; the lint spares only the test functions themselves.
#![allow(clippy::unwrap_used)]

use crate::shared::steel_strip;
use tapjoint::structure::interface::{JointWeights, JointedBody};
use tapjoint::structure::receptance::EndFunctions;
use tapjoint::structure::{
    Assembly, Beam, BeamTheory, JointStiffness, ModeShape, Slenderness, StructureError, Symmetry,
    mode_shapes, natural_frequencies, natural_lambdas, natural_lambdas_of_any_joint, natural_modes,
};

/// Receptances of the free beam at its end.
trait Receptances {
    /// Displacement per force at one end of the free beam, in units of L^3/(E I):
    /// eta11 = -F5 / (lambda^3 F3).
    fn eta11(&self) -> f64;

    /// Rotation per force, or displacement per moment, in units of L^2/(E I):
    /// eta12 = F1 / (lambda^2 F3). Its sign belongs to rotation = -dw/dx, x along the beam.
    fn eta12(&self) -> f64;

    /// Rotation per moment, in units of L/(E I): eta22 = F6 / (lambda F3).
    fn eta22(&self) -> f64;
}

impl Receptances for EndFunctions {
    fn eta11(&self) -> f64 {
        -self.f5 / (self.lambda.powi(4) * self.f3)
    }

    fn eta12(&self) -> f64 {
        self.f1 / (self.lambda.powi(4) * self.f3)
    }

    fn eta22(&self) -> f64 {
        self.f6 / (self.lambda.powi(4) * self.f3)
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

/// Sign changes of the frequency equation on a fine grid: slow, but knows nothing of counting.
fn scan(joint: &JointStiffness, slenderness: Slenderness, below: f64, steps: usize) -> Vec<f64> {
    let (body, weights) = (JointedBody::Rooted(slenderness), JointWeights::from(joint));
    let value = |step: usize| {
        let lambda = below * step as f64 / steps as f64;
        body.functions(lambda).equation(&weights).0
    };
    (1..steps)
        .filter(|&step| value(step) * value(step + 1) < 0.0)
        .map(|step| below * (step as f64 + 0.5) / steps as f64)
        .collect()
}

#[test]
fn prop_no_root_is_missed_or_invented_from_soft_to_stiff() {
    let clamped = lambdas(Assembly::Cantilever, &JointStiffness::RIGID, 12);
    let free = lambdas(Assembly::Free, &JointStiffness::FREE, 12);
    let powers = || (-6..=9).map(|power| 10f64.powi(power));
    let stiffnesses = || [0.0].into_iter().chain(powers()).chain([f64::INFINITY]);
    for kx in stiffnesses() {
        for ky in stiffnesses() {
            let found = lambdas(Assembly::Cantilever, &joint(kx, ky), 12);
            assert_eq!(found.len(), 12, "kx {kx} ky {ky}");
            let zero = [kx, ky].iter().filter(|&&k| k == 0.0).count();
            // Cauchy: two springs raise a free beam's frequencies by two places at most, and never
            // beyond the clamped beam's. Spread by rounding only.
            for (n, lambda) in found.iter().enumerate() {
                if let Some(clamped) = clamped.get(n + zero) {
                    assert!(
                        *lambda <= clamped * (1.0 + 1e-14),
                        "kx {kx} ky {ky} mode {n}"
                    );
                }
                if n + zero >= 2 {
                    let free = free[n + zero - 2];
                    assert!(*lambda >= free * (1.0 - 1e-14), "kx {kx} ky {ky} mode {n}");
                }
            }
            assert!(
                found.windows(2).all(|pair| pair[0] < pair[1]),
                "kx {kx} ky {ky}"
            );
            // The scan sees what its step of 0.01 resolves: all roots but those of weak springs.
            let end = found[11] + 0.5;
            let seen = scan(&joint(kx, ky), Slenderness::EULER, end, 4000);
            let above: Vec<&f64> = found.iter().filter(|&&lambda| lambda > 0.02).collect();
            assert_eq!(
                seen.len(),
                above.len(),
                "kx {kx} ky {ky}: {found:?} against {seen:?}"
            );
            for (found, seen) in above.iter().zip(&seen) {
                assert!((*found - seen).abs() <= end / 4000.0, "kx {kx} ky {ky}");
            }
        }
    }
}

#[test]
fn prop_frequencies_rise_with_either_stiffness() {
    let cases = [(Assembly::Cantilever, 8), (Assembly::Lap, 8)];
    for (assembly, count) in cases {
        for fixed in [0.01, 3.0, 1e4] {
            let mut previous = [vec![0.0; count], vec![0.0; count]];
            for step in 0..40 {
                let varied = 10f64.powf(-6.0 + 15.0 * f64::from(step) / 39.0);
                let now = [joint(varied, fixed), joint(fixed, varied)]
                    .map(|joint| lambdas(assembly, &joint, count));
                for (now, previous) in now.iter().zip(&previous) {
                    for (now, previous) in now.iter().zip(previous) {
                        // Equal up to rounding where the other family does not feel the spring.
                        assert!(
                            *now >= previous * (1.0 - 4e-15),
                            "{assembly:?}: {previous} fell to {now} at {varied}"
                        );
                    }
                }
                previous = now;
            }
        }
    }
}

#[test]
fn limit_weak_springs_carry_a_rigid_beam() {
    // A rigid beam on springs: mass matrix [[1, 1/2], [1/2, 1/3]] for (w, theta) at the joint.
    for (kx, ky) in [(1e-6, 1e-6), (1e-6, 1e-9), (1e-12, 1e-10), (1e-30, 1e-30)] {
        let found = lambdas(Assembly::Cantilever, &joint(kx, ky), 2);
        // u^2/12 - u (kx/3 + ky) + kx ky = 0 in u = lambda^4.
        let half = (kx / 3.0 + ky) / 2.0;
        let root = (half * half - kx * ky / 12.0f64).sqrt();
        let high = 12.0 * (half + root);
        let low = 12.0 * kx * ky / high;
        for (found, expected) in found.iter().zip([low, high]) {
            let expected = expected.powf(0.25);
            // The bending left out is of the relative order of the stiffness, 1e-6.
            assert!(
                (found / expected - 1.0).abs() < 1e-6,
                "{kx} {ky}: {found} {expected}"
            );
        }
    }
}

#[test]
fn limit_bishop_series_meet_their_closed_form() {
    // Just below the switch to series, the closed form has lost one digit only.
    for lambda in [0.7_f64, 0.85, 0.999] {
        let ends = EndFunctions::euler(lambda);
        let (s, c) = lambda.sin_cos();
        let (sh, ch) = (lambda.sinh(), lambda.cosh());
        let scale = (-lambda).exp();
        let pairs = [
            ("F1", ends.f1, s * sh / lambda.powi(2)),
            ("F3", ends.f3, (c * ch - 1.0) / lambda.powi(4)),
            ("F4", ends.f4, c * ch + 1.0),
            ("F5", ends.f5, (c * sh - s * ch) / lambda.powi(3)),
            ("F6", ends.f6, (c * sh + s * ch) / lambda),
        ];
        for (name, series, closed) in pairs {
            let closed = closed * scale;
            assert!(
                (series / closed - 1.0).abs() < 1e-14,
                "{name}({lambda}): {series} {closed}"
            );
        }
    }
    // A free beam at rest in space: a force at its end moves it as a rigid body,
    // w = -4 F/(omega^2 m), theta (Bishop's sign) = -6 F/(omega^2 m L).
    let ends = EndFunctions::euler(1e-3);
    for (found, expected) in [
        (ends.eta11(), -4e12),
        (ends.eta12(), -6e12),
        (ends.eta22(), -12e12),
    ] {
        // Bending adds terms of the relative order lambda^4 = 1e-12.
        assert!(
            (found / expected - 1.0).abs() < 1e-11,
            "{found} against {expected}"
        );
    }
}

#[test]
fn limit_timoshenko_functions_become_bishops() {
    let slender = Slenderness {
        rotary: 1e-20,
        shear: 3e-20,
    };
    for lambda in [0.01, 0.5, 0.99, 1.01, 3.0, 7.3, 20.0, 36.5] {
        let euler = EndFunctions::euler(lambda);
        let timoshenko = EndFunctions::new(lambda, &slender);
        let pairs = [
            (euler.f1, timoshenko.f1),
            (euler.f3, timoshenko.f3),
            (euler.f4, timoshenko.f4),
            (euler.f5, timoshenko.f5),
            (euler.f6, timoshenko.f6),
        ];
        for (euler, timoshenko) in pairs {
            // lambda^4 s^2 < 1e-13 is left of shear, and rounding of wave numbers up to 36.
            assert!(
                (euler - timoshenko).abs() < 1e-12 * (euler.abs() + 1e-3),
                "{lambda}: {euler} against {timoshenko}"
            );
        }
        assert_eq!(euler.clamped_free_count(), timoshenko.clamped_free_count());
    }
}

#[test]
fn prop_timoshenko_free_beam_is_two_halves_pinned_or_guided() {
    // A beam pinned at one end and free at the other has every second frequency of the free beam
    // of twice the length, and a guided one the others: two evaluations of different functions.
    let beam = Beam {
        thickness: 0.08,
        ..steel_strip()
    };
    let half = beam.slenderness(BeamTheory::Timoshenko);
    let whole = half.of_piece(2.0);
    let free = natural_modes(Assembly::Free, &JointStiffness::FREE, &whole, 12).unwrap();
    let family = |kx: f64, ky: f64| {
        let found = natural_modes(Assembly::Cantilever, &joint(kx, ky), &half, 6).unwrap();
        found.into_iter().map(|mode| 2.0 * mode.lambda)
    };
    let mut halves: Vec<f64> = family(f64::INFINITY, 0.0)
        .chain(family(0.0, f64::INFINITY))
        .collect();
    halves.sort_by(f64::total_cmp);
    for (free, half) in free.iter().zip(&halves) {
        // Both are exact; rounding of wave numbers near 40.
        assert!(
            (free.lambda / half - 1.0).abs() < 1e-12,
            "{} against {half}",
            free.lambda
        );
    }
}

#[test]
fn prop_stocky_beams_miss_no_root_of_the_second_spectrum() {
    // Thickness a third of the length: the second spectrum starts near lambda = 7.5, amid the
    // first twelve modes.
    let stocky = Slenderness {
        rotary: 0.01,
        shear: 0.0312,
    };
    for kx in [0.0, 1e-3, 1.0, 300.0, 1e6, f64::INFINITY] {
        for ky in [0.0, 1e-3, 1.0, 300.0, 1e6, f64::INFINITY] {
            let joint = joint(kx, ky);
            let found = natural_modes(Assembly::Cantilever, &joint, &stocky, 12).unwrap();
            let end = found[11].lambda + 1e-3;
            assert!(end > 7.5, "{end}");
            let seen = scan(&joint, stocky, end, 20_000);
            let above = found.iter().filter(|mode| mode.lambda > end / 20_000.0);
            assert_eq!(
                above.count(),
                seen.len(),
                "{joint:?}: {found:?} against {seen:?}"
            );
        }
    }
}

#[test]
fn limit_coincident_roots_are_both_found() {
    // Lap joint: springs chosen so that both families have a root at lambda = 4 exactly.
    let half = EndFunctions::euler(2.0);
    let same = joint(-4.0 / half.eta11(), -1.0 / half.eta22());
    let found = natural_modes(Assembly::Lap, &same, &Slenderness::EULER, 4).unwrap();
    let at_four: Vec<_> = found
        .iter()
        .filter(|m| (m.lambda - 4.0).abs() < 1e-13)
        .collect();
    assert_eq!(at_four.len(), 2, "{found:?}");
    assert_ne!(at_four[0].symmetry, at_four[1].symmetry);

    // Cantilever: a joint whose compliance is minus the beam's receptance cancels it entirely,
    // which makes a double root; it is physical in a narrow window below 3 pi/2.
    let place = 4.71;
    let ends = EndFunctions::euler(place);
    let double = JointStiffness {
        kx: -1.0 / ends.eta11(),
        ky: -1.0 / ends.eta22(),
        cross_compliance: -ends.eta12(),
    };
    let found = match natural_lambdas(Assembly::Cantilever, &double, 5) {
        Ok(found) => found,
        Err(_) => natural_lambdas_of_any_joint(&double, 5).unwrap(),
    };
    // A double root is found to the square root of the last digit, amplified by stiffness.
    let close = found
        .iter()
        .filter(|&&lambda| (lambda - place).abs() < 1e-5)
        .count();
    assert_eq!(close, 2, "{found:?} for {double:?}");
}

#[test]
fn limit_joints_that_cannot_exist_are_refused_with_their_limit() {
    let beyond = JointStiffness::three_parameter(1000.0, 500.0, 700.0);
    let error = natural_lambdas(Assembly::Cantilever, &beyond, 3).unwrap_err();
    assert!(
        matches!(error, StructureError::NotPhysical { .. }),
        "{error}"
    );
    assert!(error.to_string().contains("700"), "{error}");
    for (joint, name) in [
        (joint(-1.0, 1.0), "kx"),
        (joint(1.0, f64::NAN), "ky"),
        (
            JointStiffness::three_parameter(f64::INFINITY, 1.0, 5.0),
            "physical",
        ),
        (
            JointStiffness::three_parameter(1.0, 1.0, f64::NAN),
            "physical",
        ),
    ] {
        let error = natural_lambdas(Assembly::Cantilever, &joint, 3).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
    }
    let error = natural_lambdas(Assembly::Free, &JointStiffness::FREE, 1001).unwrap_err();
    assert!(error.to_string().contains("1001"), "{error}");
    let coupled = JointStiffness::three_parameter(1.0, 1.0, 5.0);
    let error = natural_lambdas(Assembly::Lap, &coupled, 3).unwrap_err();
    assert!(
        matches!(error, StructureError::NoCoupling { .. }),
        "{error}"
    );
}

#[test]
fn prop_unphysical_joints_have_their_oscillations_counted_from_zero() {
    let cases = [
        JointStiffness::three_parameter(1000.0, 500.0, 700.0),
        JointStiffness::three_parameter(1000.0, 500.0, -70.0),
        joint(-20.0, 30.0),
        joint(20.0, -0.5),
        joint(-20.0, -30.0),
        JointStiffness::three_parameter(-100.0, 40.0, 50.0),
    ];
    for joint in cases {
        let found = natural_lambdas_of_any_joint(&joint, 8).unwrap();
        let seen = scan(&joint, Slenderness::EULER, found[7] + 0.3, 5000);
        assert_eq!(
            found.len(),
            seen.len(),
            "{joint:?}: {found:?} against {seen:?}"
        );
    }
}

mod finite_elements {
    use super::*;
    use tapjoint::structure::joint::StiffnessUnits;
    use tapjoint::structure::specimen::{Body, Joint, LapLayout, Mesh, PointMass, Specimen};

    fn assemblies() -> Vec<(Assembly, JointStiffness)> {
        vec![
            (Assembly::Cantilever, joint(500.0, 100.0)),
            (Assembly::Cantilever, joint(1.0, 0.3)),
            (Assembly::Cantilever, JointStiffness::RIGID),
            (Assembly::Cantilever, joint(f64::INFINITY, 0.0)),
            (
                Assembly::Cantilever,
                JointStiffness::three_parameter(1000.0, 500.0, 1e4),
            ),
            (
                Assembly::Cantilever,
                JointStiffness::three_parameter(1000.0, 500.0, -800.0),
            ),
            (
                Assembly::Cantilever,
                JointStiffness::three_parameter(1928.972, 4.6964, 876.731),
            ),
            (Assembly::Lap, joint(500.0, 50.0)),
            (Assembly::Lap, joint(f64::INFINITY, 5.0)),
            (Assembly::Lap, joint(500.0, f64::INFINITY)),
            (Assembly::Lap, joint(0.0, 7.0)),
            (Assembly::Free, JointStiffness::FREE),
        ]
    }

    fn model(
        beam: &Beam,
        theory: BeamTheory,
        case: &(Assembly, JointStiffness),
        n: usize,
    ) -> Vec<f64> {
        let specimen = specimen(beam, theory, case.0, &case.1);
        specimen
            .modes(5, Mesh { elements: n })
            .unwrap()
            .frequencies()
            .to_vec()
    }

    fn springs(beam: &Beam, joint: &JointStiffness) -> Option<Joint> {
        let units = StiffnessUnits::of(beam);
        Some(Joint {
            kt: joint.kx * units.kt,
            kr: joint.ky * units.kr,
            coupling: joint.coupling(),
        })
    }

    fn specimen(
        beam: &Beam,
        theory: BeamTheory,
        assembly: Assembly,
        joint: &JointStiffness,
    ) -> Specimen {
        let held = match assembly {
            Assembly::Free => None,
            Assembly::Cantilever | Assembly::Lap => springs(beam, joint),
        };
        Specimen::jointed(theory, beam, assembly, &LapLayout::default(), held)
    }

    #[test]
    fn val_closed_form_agrees_with_200_elements_to_one_in_a_million() {
        let beam = steel_strip();
        for case in assemblies() {
            let exact = natural_frequencies(BeamTheory::Euler, &beam, case.0, &case.1, 5).unwrap();
            let found = model(&beam, BeamTheory::Euler, &case, 200);
            for (exact, found) in exact.iter().zip(&found) {
                // The cubic element is (lambda h)^4/1440 = 2e-8 too stiff; rounding adds as much.
                assert!(
                    (found / exact - 1.0).abs() < 1e-6,
                    "{case:?}: {found} against {exact}"
                );
            }
        }
    }

    #[test]
    fn val_timoshenko_closed_form_agrees_with_extrapolated_elements() {
        for thickness in [0.005, 0.04] {
            // No section curls that has no Poisson's ratio: the closed form does without the width.
            let beam = Beam {
                thickness,
                poisson: 0.0,
                ..steel_strip()
            };
            for case in assemblies() {
                let theory = BeamTheory::Timoshenko;
                let exact = natural_frequencies(theory, &beam, case.0, &case.1, 5).unwrap();
                let [coarse, fine] = [100, 200].map(|n| model(&beam, theory, &case, n));
                for (exact, (coarse, fine)) in exact.iter().zip(coarse.iter().zip(&fine)) {
                    // Shear leaves an error in h^2, which two meshes remove (Richardson).
                    let found = (4.0 * fine - coarse) / 3.0;
                    assert!(
                        (found / exact - 1.0).abs() < 1e-6,
                        "{case:?}: {found} against {exact}"
                    );
                }
            }
        }
    }

    #[test]
    fn val_tip_mass_lowers_the_clamped_beam_as_in_the_textbook() {
        // 1 + cos cosh + mu lambda (cos sinh - sin cosh) = 0 with mu the mass ratio
        // (Bishop & Johnson 1960).
        let beam = steel_strip();
        let ratio = 0.03;
        let rigid = JointStiffness::RIGID;
        let mut tipped = specimen(&beam, BeamTheory::Euler, Assembly::Cantilever, &rigid);
        tipped.masses.push(PointMass {
            position: beam.length,
            mass: ratio * beam.mass(),
            inertia: 0.0,
        });
        for &frequency in tipped.modes(4, Mesh::SIMULATION).unwrap().frequencies() {
            let lambda = beam.lambda_of(frequency);
            let left = |lambda: f64| {
                let (s, c) = lambda.sin_cos();
                let sum = 1.0 + c * lambda.cosh();
                sum + ratio * lambda * (c * lambda.sinh() - s * lambda.cosh())
            };
            // A change of sign within one part in a million of lambda.
            assert!(
                left(lambda * (1.0 - 1e-6)) * left(lambda * (1.0 + 1e-6)) < 0.0,
                "{lambda}"
            );
        }
    }

    #[test]
    fn limit_masses_off_the_beam_or_negative_are_refused() {
        let beam = steel_strip();
        let rigid = JointStiffness::RIGID;
        let model = specimen(&beam, BeamTheory::Euler, Assembly::Cantilever, &rigid);
        for (position, mass) in [(0.5, 0.1), (-0.1, 0.1), (f64::NAN, 0.1), (0.1, -1.0)] {
            let mut loaded = model.clone();
            loaded.masses.push(PointMass {
                position,
                mass,
                inertia: 0.0,
            });
            let refused = loaded.modes(1, Mesh { elements: 10 });
            assert!(refused.is_err(), "{position} {mass}");
        }
        let error = model.modes(21, Mesh { elements: 10 }).unwrap_err();
        assert!(error.to_string().contains("finer"), "{error}");
    }

    #[test]
    fn prop_a_mass_counts_the_same_wherever_the_element_borders_lie() {
        let beam = steel_strip();
        let with_mass = |elements: usize| {
            let (theory, joint) = (BeamTheory::Euler, joint(500.0, 100.0));
            let mut loaded = specimen(&beam, theory, Assembly::Cantilever, &joint);
            loaded.masses.push(PointMass {
                position: 0.317,
                mass: 0.024,
                inertia: 0.0,
            });
            loaded
                .modes(4, Mesh { elements })
                .unwrap()
                .frequencies()
                .to_vec()
        };
        for (even, odd) in with_mass(120).iter().zip(&with_mass(127)) {
            // A mass inside an element kinks the shear force, which the cubic does not follow.
            assert!((even / odd - 1.0).abs() < 1e-5, "{even} against {odd}");
        }
    }

    #[test]
    fn limit_unequal_halves_become_equal_ones() {
        let beam = steel_strip();
        let half = Beam {
            length: 0.5 * beam.length,
            ..beam
        };
        let joint = joint(500.0, 50.0);
        let halves = Specimen::new(Body::Joined([half, half]), springs(&beam, &joint));
        let halves = halves.modes(6, Mesh { elements: 160 }).unwrap();
        let exact =
            natural_frequencies(BeamTheory::Euler, &beam, Assembly::Lap, &joint, 6).unwrap();
        for (found, exact) in halves.frequencies().iter().zip(&exact) {
            assert!(
                (found / exact - 1.0).abs() < 1e-6,
                "{found} against {exact}"
            );
        }
        // A rigid joint off the middle is no joint at all.
        let [short, long] = [0.3, 0.7].map(|part| Beam {
            length: part * beam.length,
            ..beam
        });
        let rigid = JointStiffness::RIGID;
        let split = Specimen::new(Body::Joined([short, long]), Some(Joint::RIGID));
        let split = split.modes(4, Mesh::SIMULATION).unwrap();
        let free =
            natural_frequencies(BeamTheory::Euler, &beam, Assembly::Free, &rigid, 4).unwrap();
        for (found, exact) in split.frequencies().iter().zip(&free) {
            assert!(
                (found / exact - 1.0).abs() < 1e-6,
                "{found} against {exact}"
            );
        }
    }
}

#[test]
fn prop_slopes_are_the_derivatives_of_displacements() {
    let beam = steel_strip();
    for (assembly, joint) in [
        (Assembly::Cantilever, joint(500.0, 100.0)),
        (Assembly::Lap, joint(500.0, 50.0)),
        (Assembly::Free, JointStiffness::FREE),
    ] {
        for shape in mode_shapes(&beam, assembly, &joint, 6).unwrap() {
            for x in [0.01, 0.1, 0.2, 0.3, 0.42] {
                let step = 1e-6;
                let rise = shape.displacement(x + step) - shape.displacement(x - step);
                let slope = rise / (2.0 * step);
                // Central differences: truncation (k step)^2/6 and rounding 1e-16/1e-6.
                let scale = shape.lambda / beam.length * shape.displacement(beam.length);
                assert!(
                    (slope - shape.slope(x)).abs() < 1e-7 * scale.abs(),
                    "{assembly:?} {x}: {slope} against {}",
                    shape.slope(x)
                );
            }
        }
    }
}

#[test]
fn val_symmetry_of_the_lap_joint_shows_in_shapes_and_springs() {
    let beam = steel_strip();
    let joint = joint(500.0, 50.0);
    for shape in mode_shapes(&beam, Assembly::Lap, &joint, 6).unwrap() {
        let [left, right] = [0.3, 0.7].map(|part| shape.displacement(part * beam.length));
        let sign = match shape.symmetry {
            Some(Symmetry::Symmetric) => 1.0,
            Some(Symmetry::Antisymmetric) => -1.0,
            None => panic!("a lap joint's mode has a symmetry"),
        };
        assert!(
            (left - sign * right).abs() < 1e-12 * right.abs(),
            "{shape:?}"
        );
        // Only the symmetric modes see the rotation spring, and only the others the translation.
        let half = EndFunctions::euler(0.5 * shape.lambda);
        let spring = match shape.symmetry {
            Some(Symmetry::Symmetric) => -1.0 / half.eta22() / joint.ky,
            _ => -4.0 / half.eta11() / joint.kx,
        };
        assert!((spring - 1.0).abs() < 1e-10, "{spring}");
    }
}

#[test]
fn val_beam_properties_and_units() {
    let beam = steel_strip();
    // By hand: A = 2.5e-4 m2, I = 0.05 0.005^3/12, E I, rho A.
    assert!((beam.area() - 2.5e-4).abs() < 1e-18);
    assert!((beam.second_moment() - 5.208_333_333_333_333e-10).abs() < 1e-24);
    assert!((beam.bending_stiffness() - 107.8125).abs() < 1e-10);
    assert!((beam.mass_per_length() - 1.9625).abs() < 1e-12);
    // The geometry of table 2: 2 pi 0.423^2 sqrt(1.9625/107.8125) s.
    assert!((1.0 / beam.unit_frequency() - 0.151_680_9).abs() < 5e-8);
    assert!((beam.frequency_of(beam.lambda_of(335.625)) - 335.625).abs() < 1e-10);
    let slenderness = beam.slenderness(BeamTheory::Timoshenko);
    assert!((slenderness.rotary - (0.005_f64 / 0.423).powi(2) / 12.0).abs() < 1e-15);
    // s^2/r^2 = E/(k G) = 2 (1 + nu) 6/5.
    assert!((slenderness.shear / slenderness.rotary - 3.12).abs() < 1e-12);
    assert!(
        Beam {
            length: 0.0,
            ..beam
        }
        .check()
        .is_err()
    );
    let error = Beam {
        modulus: f64::NAN,
        ..beam
    }
    .check()
    .unwrap_err();
    assert!(error.to_string().contains("modulus"), "{error}");
    let error = Beam {
        poisson: 0.7,
        ..beam
    }
    .check()
    .unwrap_err();
    assert!(error.to_string().contains("0.7"), "{error}");
}
