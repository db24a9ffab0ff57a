//! Joint stiffness from natural frequencies: recovery, limits, uncertainty, perturbation.

// A test that unwraps fails as it should; the lint spares only the test functions themselves.
#![allow(clippy::unwrap_used)]

use crate::shared::steel_strip;
use tapjoint::identify::perturbation::{
    PAPER_PERCENTS, average_errors, mode_sensitivities, perturb_uniformly, sign_pattern_estimates,
    sign_pattern_spans,
};
use tapjoint::identify::{
    Doubt, IdentifyError, MeasuredMode, ModeLambda, PairsModel, Stiffnesses, estimate_joint,
    estimate_modulus, estimate_pairs, pairs_estimator, predict, single_mode_stiffness,
};
use tapjoint::structure::receptance::EndFunctions;
use tapjoint::structure::{
    Assembly, Beam, BeamTheory, JointStiffness, Slenderness, Symmetry, natural_frequencies,
    natural_lambdas, natural_modes,
};

fn exact(assembly: Assembly, joint: &JointStiffness, modes: &[usize]) -> Vec<ModeLambda> {
    let lambdas = natural_lambdas(assembly, joint, 8).unwrap();
    modes
        .iter()
        .map(|&mode| ModeLambda {
            mode,
            lambda: lambdas[mode - 1],
        })
        .collect()
}

fn measured(joint: &JointStiffness, assembly: Assembly, std: Option<f64>) -> Vec<MeasuredMode> {
    natural_frequencies(BeamTheory::Euler, &steel_strip(), assembly, joint, 5)
        .unwrap()
        .into_iter()
        .enumerate()
        .map(|(index, frequency)| MeasuredMode {
            mode: index + 1,
            frequency,
            std,
        })
        .collect()
}

fn close(found: Option<f64>, expected: f64, relative: f64, what: &str) {
    let found = found.unwrap_or_else(|| panic!("{what} does not exist"));
    assert!(
        (found / expected - 1.0).abs() < relative,
        "{what}: {found} against {expected}"
    );
}

#[test]
fn recover_two_stiffnesses_from_any_modes() {
    let subsets: [&[usize]; 4] = [&[1, 2, 3], &[1, 2, 3, 4], &[2, 3, 5], &[1, 3, 4, 5, 7, 8]];
    for (kx, ky) in [
        (100.0, 50.0),
        (1000.0, 500.0),
        (3.0, 0.2),
        (1e5, 2.0),
        (20.0, 1e4),
    ] {
        for modes in subsets {
            let joint = JointStiffness::two_parameter(kx, ky);
            let found = estimate_pairs(
                PairsModel::TwoParameter,
                &exact(Assembly::Cantilever, &joint, modes),
            )
            .unwrap();
            let case = format!("{kx} {ky} from modes {modes:?}");
            // Rounding of lambda (1e-16), amplified by how little the modes feel a stiff spring.
            close(found.kx, kx, 1e-7, &case);
            close(found.ky, ky, 1e-7, &case);
            assert!(
                found.closure.unwrap().abs() < 1e-7,
                "{case}: {:?}",
                found.closure
            );
            assert!(found.doubts.is_empty() && found.kz.is_none(), "{case}");
            assert_eq!(found.modes, modes, "{case}");
        }
    }
}

#[test]
fn recover_three_stiffnesses_from_any_modes() {
    let subsets: [&[usize]; 3] = [&[1, 2, 3, 4], &[1, 2, 4, 5], &[1, 2, 3, 4, 5, 6]];
    for (kx, ky, kz) in [
        (1000.0, 500.0, 1e4),
        (500.0, 100.0, -400.0),
        (50.0, 2.0, 20.0),
    ] {
        for modes in subsets {
            let joint = JointStiffness::three_parameter(kx, ky, kz);
            let modes = exact(Assembly::Cantilever, &joint, modes);
            let found = estimate_pairs(PairsModel::ThreeParameter, &modes).unwrap();
            let case = format!("{kx} {ky} {kz} from {modes:?}");
            close(found.kx, kx, 1e-7, &case);
            close(found.ky, ky, 1e-7, &case);
            close(found.kz, kz, 1e-6, &case);
            close(found.coupling, (kx * ky).sqrt() / kz, 1e-6, &case);
            assert!(
                found.closure.unwrap().abs() < 1e-6,
                "{case}: {:?}",
                found.closure
            );
        }
    }
}

#[test]
fn recover_lap_joint_from_any_modes_of_both_symmetries() {
    let subsets: [&[usize]; 4] = [&[1, 2, 3], &[1, 2, 3, 4, 5], &[2, 3, 4], &[1, 4, 5, 6]];
    for (kx, ky) in [(1000.0, 100.0), (50.0, 20.0), (4.0, 700.0)] {
        for modes in subsets {
            let joint = JointStiffness::two_parameter(kx, ky);
            let modes = exact(Assembly::Lap, &joint, modes);
            let found = estimate_pairs(PairsModel::Lap, &modes).unwrap();
            let case = format!("{kx} {ky} from {modes:?}");
            close(found.kx, kx, 1e-8, &case);
            close(found.ky, ky, 1e-8, &case);
            // Every mode alone gives the one spring it feels.
            for single in single_mode_stiffness(&modes).unwrap() {
                let felt = |found: Option<f64>, spring: f64| {
                    found.is_some_and(|found| (found / spring - 1.0).abs() < 1e-8)
                };
                assert!(
                    felt(single.kx, kx) != felt(single.ky, ky),
                    "{case}: {single:?}"
                );
            }
        }
    }
}

/// The paper's own way: all pair differences, normal equations.
fn by_literal_pairs(lambdas: &[f64]) -> [f64; 2] {
    let equation = |lambda: f64| {
        let ends = EndFunctions::euler(lambda);
        let power = lambda.powi(4);
        let [x, y, right] = [ends.f5, -ends.f6, power * ends.f3].map(|f| power * f / ends.f4);
        [x, y, right]
    };
    let rows: Vec<[f64; 3]> = lambdas.iter().map(|&lambda| equation(lambda)).collect();
    let [mut xx, mut xy, mut yy, mut xr, mut yr] = [0.0; 5];
    for (j, first) in rows.iter().enumerate() {
        for second in &rows[..j] {
            let [x, y, r] = [0, 1, 2].map(|i| first[i] - second[i]);
            xx += x * x;
            xy += x * y;
            yy += y * y;
            xr += x * r;
            yr += y * r;
        }
    }
    let determinant = xx * yy - xy * xy;
    [
        (yy * xr - xy * yr) / determinant,
        (xx * yr - xy * xr) / determinant,
    ]
}

#[test]
fn val_free_intercept_is_the_regression_over_all_pairs() {
    // Lambdas that no joint fits, so that the least-squares solution matters.
    for lambdas in [
        vec![1.61, 4.23, 7.14, 9.77],
        vec![1.8, 4.4, 6.9, 9.2, 12.1],
        vec![1.2, 3.3, 5.9],
    ] {
        let found =
            estimate_pairs(PairsModel::TwoParameter, &ModeLambda::numbered(&lambdas)).unwrap();
        let [kx, ky] = by_literal_pairs(&lambdas);
        // Normal equations square the condition number, about 1e2 here.
        close(found.kx, kx, 1e-9, "kx");
        close(found.ky, ky, 1e-9, "ky");
    }
}

#[test]
fn limit_too_few_modes_name_what_is_needed() {
    let joint = JointStiffness::three_parameter(1000.0, 500.0, 1e4);
    let modes = exact(Assembly::Cantilever, &joint, &[1, 2, 3]);
    for (model, needed) in [
        (PairsModel::TwoParameter, 3),
        (PairsModel::ThreeParameter, 4),
        (PairsModel::Lap, 3),
    ] {
        let error = estimate_pairs(model, &modes[..needed - 1]).unwrap_err();
        let told = matches!(error, IdentifyError::TooFewModes { needed: n, .. } if n == needed);
        assert!(told, "{model:?}: {error}");
        assert!(error.to_string().contains(&needed.to_string()), "{error}");
    }
    let error = estimate_pairs(PairsModel::TwoParameter, &[]).unwrap_err();
    assert!(error.to_string().contains("0 mode"), "{error}");
}

#[test]
fn limit_one_symmetry_alone_does_not_determine_a_lap_joint() {
    let joint = JointStiffness::two_parameter(500.0, 50.0);
    let all = natural_modes(Assembly::Lap, &joint, &Slenderness::EULER, 8).unwrap();
    for symmetry in [Symmetry::Symmetric, Symmetry::Antisymmetric] {
        let numbered = all.iter().enumerate();
        let alike: Vec<usize> = numbered
            .filter(|(_, mode)| mode.symmetry == Some(symmetry))
            .map(|(index, _)| index + 1)
            .collect();
        assert!(alike.len() >= 3, "{all:?}");
        let error =
            estimate_pairs(PairsModel::Lap, &exact(Assembly::Lap, &joint, &alike)).unwrap_err();
        assert!(
            matches!(error, IdentifyError::Undetermined { rank: 1, .. }),
            "{error}"
        );
        assert!(error.to_string().contains("antisymmetric"), "{error}");
    }
}

#[test]
fn limit_impossible_frequencies_and_estimates() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let modes = ModeLambda::numbered(&[1.8, bad, 7.0, 9.0]);
        let error = estimate_pairs(PairsModel::TwoParameter, &modes).unwrap_err();
        assert!(
            matches!(error, IdentifyError::Frequency { mode: 2, .. }),
            "{error}"
        );
        assert!(single_mode_stiffness(&modes).is_err());
    }
    // Three times the same frequency says one thing three times.
    let same = ModeLambda::numbered(&[1.8, 1.8, 1.8]);
    let error = estimate_pairs(PairsModel::TwoParameter, &same).unwrap_err();
    assert!(
        matches!(error, IdentifyError::Undetermined { .. }),
        "{error}"
    );
    // A beam above its clamped frequencies: some stiffness must be negative, and is said to be.
    let impossible = ModeLambda::numbered(&[1.95, 4.9, 8.2, 11.4]);
    let found = estimate_pairs(PairsModel::TwoParameter, &impossible).unwrap();
    let negative = |doubt: &Doubt| matches!(doubt, Doubt::Negative { .. });
    assert!(found.doubts.iter().any(negative), "{found:?}");
}

#[test]
fn prop_nothing_panics_for_any_frequencies() {
    use proptest::prelude::*;
    proptest!(|(lambdas in prop::collection::vec(
        prop_oneof![1e-3..60.0f64, Just(1.875_104_068_711_961), Just(4.730_040_744_862_704), Just(1e300)],
        0..9,
    ))| {
        let modes = ModeLambda::numbered(&lambdas);
        for model in [PairsModel::TwoParameter, PairsModel::ThreeParameter, PairsModel::Lap] {
            if let Ok(found) = estimate_pairs(model, &modes) {
                let values = [found.kx, found.ky, found.kz, found.closure];
                prop_assert!(values.iter().flatten().all(|value| value.is_finite()));
            }
        }
    });
}

#[test]
fn recover_dimensional_stiffness_with_first_order_uncertainty() {
    let beam = steel_strip();
    let joint = JointStiffness::two_parameter(500.0, 100.0);
    let modes = measured(&joint, Assembly::Cantilever, Some(0.01));
    let found = estimate_joint(PairsModel::TwoParameter, &beam, &modes[..4]).unwrap();
    let stiffness = beam.bending_stiffness();
    close(
        found.kt.map(|k| k.value),
        500.0 * stiffness / beam.length.powi(3),
        1e-9,
        "kt",
    );
    close(
        found.kr.map(|k| k.value),
        100.0 * stiffness / beam.length,
        1e-9,
        "kr",
    );
    assert!(found.ktr.is_none() && found.coupling.is_none());
    assert_eq!(found.modes_used, [1, 2, 3, 4]);
    // The propagated uncertainty against one-sided differences made by hand.
    let mut variance = 0.0;
    for index in 0..4 {
        let mut shifted = modes[..4].to_vec();
        shifted[index].frequency += 1e-4;
        let moved = estimate_joint(PairsModel::TwoParameter, &beam, &shifted).unwrap();
        variance += ((moved.kx.unwrap().value - 500.0) / 1e-4 * 0.01).powi(2);
    }
    let kx = found.kx.unwrap();
    // One-sided differences have their own curvature, below a part in a thousand.
    close(kx.std, variance.sqrt(), 1e-2, "std of kx");
    close(
        kx.high,
        kx.value + 1.959_964 * kx.std.unwrap(),
        1e-12,
        "high of kx",
    );
    // Without the uncertainty of every mode there is none.
    let mut unknown = modes;
    unknown[2].std = None;
    let found = estimate_joint(PairsModel::TwoParameter, &beam, &unknown).unwrap();
    let kx = found.kx.unwrap();
    assert!(kx.std.is_none() && kx.low.is_none() && kx.high.is_none());
}

#[test]
fn limit_coupling_that_may_be_zero_has_no_interval() {
    let beam = steel_strip();
    let weak = JointStiffness::three_parameter(500.0, 100.0, 1e5);
    let strong = JointStiffness::three_parameter(500.0, 100.0, 300.0);
    for (joint, established) in [(weak, false), (strong, true)] {
        let modes = measured(&joint, Assembly::Cantilever, Some(0.05));
        let found = estimate_joint(PairsModel::ThreeParameter, &beam, &modes).unwrap();
        let kz = found.kz.unwrap();
        let doubted = found.doubts.contains(&Doubt::CouplingNotEstablished);
        assert_eq!(kz.low.is_some() && kz.high.is_some(), established, "{kz:?}");
        assert_eq!(doubted, !established, "{:?}", found.doubts);
        let coupling = found.coupling.unwrap();
        assert!(
            coupling.low.is_some() && coupling.high.is_some(),
            "{coupling:?}"
        );
    }
}

#[test]
fn recover_modulus_of_a_free_beam() {
    let truth = Beam {
        modulus: 70e9,
        thickness: 0.02,
        ..steel_strip()
    };
    let nominal = Beam {
        modulus: 207e9,
        ..truth
    };
    for theory in [BeamTheory::Euler, BeamTheory::Timoshenko] {
        let free = JointStiffness::FREE;
        let frequencies = natural_frequencies(theory, &truth, Assembly::Free, &free, 5).unwrap();
        let modes: Vec<MeasuredMode> = [1, 2, 4]
            .map(|mode| MeasuredMode {
                mode,
                frequency: frequencies[mode - 1],
                std: Some(0.001 * frequencies[mode - 1]),
            })
            .to_vec();
        let found = estimate_modulus(theory, &nominal, &modes).unwrap();
        assert!(
            (found.modulus.value / 70e9 - 1.0).abs() < 1e-12,
            "{theory:?}: {found:?}"
        );
        assert!(
            found
                .per_mode
                .iter()
                .all(|(_, e)| (e / 70e9 - 1.0).abs() < 1e-12),
            "{found:?}"
        );
        // Three frequencies of 0.1 % each: 2 x 0.1 % / sqrt(3) of the modulus.
        close(found.modulus.std, 70e9 * 0.002 / 3f64.sqrt(), 1e-9, "std");
        let expected = truth.density * 207.0 / 70.0;
        assert!(
            (found.density.value / expected - 1.0).abs() < 1e-12,
            "{found:?}"
        );
    }
    let error = estimate_modulus(BeamTheory::Euler, &truth, &[]).unwrap_err();
    assert!(error.to_string().contains("free beam"), "{error}");
    let zeroth = MeasuredMode {
        mode: 0,
        frequency: 100.0,
        std: None,
    };
    assert!(estimate_modulus(BeamTheory::Euler, &truth, &[zeroth]).is_err());
}

#[test]
fn val_modulus_of_a_spruce_bar() {
    // A spruce brace measured by the guitar_tap project (github.com/dwsdolce/guitar_tap):
    // 556 x 20.4 x 29.4 mm, 383.8 kg/m3, first mode 512.69 Hz, E = 10.541 +- 0.05 GPa as an Euler
    // beam.
    let bar = Beam {
        length: 0.556,
        width: 0.0204,
        thickness: 0.0294,
        modulus: 10e9,
        density: 383.8,
        poisson: 0.3,
    };
    let mode = MeasuredMode {
        mode: 1,
        frequency: 512.69,
        std: None,
    };
    let found = estimate_modulus(BeamTheory::Euler, &bar, &[mode]).unwrap();
    assert!((found.modulus.value - 10.541e9).abs() < 0.05e9, "{found:?}");
    // Shear makes a beam softer, so that the same frequency needs a higher modulus.
    let shear = estimate_modulus(BeamTheory::Timoshenko, &bar, &[mode]).unwrap();
    assert!(
        shear.modulus.value > 1.02 * found.modulus.value,
        "{shear:?}"
    );
}

#[test]
fn recover_prediction_of_withheld_modes() {
    let beam = steel_strip();
    let joint = JointStiffness::two_parameter(500.0, 100.0);
    let modes = measured(&joint, Assembly::Cantilever, None);
    let estimate = estimate_joint(PairsModel::TwoParameter, &beam, &modes[..4]).unwrap();
    let found = estimate.pairs.joint().unwrap();
    let rows = predict(
        BeamTheory::Euler,
        &beam,
        Assembly::Cantilever,
        &found,
        &modes,
        &estimate.modes_used,
        7,
    )
    .unwrap();
    assert_eq!(rows.len(), 7);
    for row in &rows {
        assert_eq!(row.used, row.mode <= 4, "{row:?}");
        assert_eq!(row.error_percent.is_some(), row.mode <= 5, "{row:?}");
        assert!(row.error_percent.unwrap_or(0.0).abs() < 1e-7, "{row:?}");
    }
    // Positive where the prediction is too high.
    let mut low = modes[..1].to_vec();
    low[0].frequency *= 0.99;
    let (theory, assembly) = (BeamTheory::Euler, Assembly::Cantilever);
    let rows = predict(theory, &beam, assembly, &found, &low, &[], 0).unwrap();
    assert!(
        (rows[0].error_percent.unwrap() - 100.0 / 99.0).abs() < 1e-6,
        "{rows:?}"
    );
}

mod perturbed {
    use super::*;

    const NUMBERS: [usize; 4] = [1, 2, 3, 4];
    const FREQUENCIES: [f64; 4] = [17.0, 118.0, 335.625, 628.75];
    const HALF_LINES: [f64; 4] = [0.125, 0.125, 0.625, 0.625];

    #[test]
    fn prop_spans_hold_every_single_perturbation() {
        let beam = steel_strip();
        for model in [PairsModel::TwoParameter, PairsModel::ThreeParameter] {
            let estimator = pairs_estimator(model, &beam, &NUMBERS).unwrap();
            let spans = sign_pattern_spans(&FREQUENCIES, &HALF_LINES, 1, &estimator).unwrap();
            assert_eq!((spans.patterns, spans.failed), (16, 0));
            let (kx, ky) = (spans.kx.unwrap(), spans.ky.unwrap());
            let nominal = estimator(&FREQUENCIES).unwrap();
            assert!(
                kx.low < nominal.kx && nominal.kx < kx.high,
                "{kx:?} {nominal:?}"
            );
            assert!(
                ky.low < nominal.ky && nominal.ky < ky.high,
                "{ky:?} {nominal:?}"
            );
            let corner = [17.125, 117.875, 335.0, 629.375];
            let corner = estimator(&corner).unwrap();
            assert!(
                kx.low <= corner.kx && corner.kx <= kx.high,
                "{kx:?} {corner:?}"
            );
        }
    }

    #[test]
    fn prop_linear_estimators_have_linear_perturbations() {
        // kx = f1 + 2 f2 and ky = 3 f2: every answer is known by hand.
        let linear = |f: &[f64]| {
            Some(Stiffnesses {
                kx: f[0] + 2.0 * f[1],
                ky: 3.0 * f[1],
                kz: None,
            })
        };
        let frequencies = [10.0, 20.0];
        let rows = perturb_uniformly(&frequencies, &PAPER_PERCENTS, linear);
        assert_eq!(rows.len(), 4);
        let nominal = linear(&frequencies).unwrap();
        for row in average_errors(&nominal, &rows) {
            assert!(
                (row.mean_magnitude.kx - row.percent).abs() < 1e-10,
                "{row:?}"
            );
            assert!(row.of_mean.kx.abs() < 1e-10, "{row:?}");
        }
        let spans = sign_pattern_spans(&frequencies, &[1.0, 0.5], 1, linear).unwrap();
        let kx = spans.kx.unwrap();
        assert!(
            (kx.low - 48.0).abs() < 1e-12 && (kx.high - 52.0).abs() < 1e-12,
            "{kx:?}"
        );
        let modes = mode_sensitivities(&frequencies, &[1.0, 0.5], linear).unwrap();
        let first = modes[0].percent_per_bound.unwrap();
        assert!(
            (first.kx - 2.0).abs() < 1e-10 && first.ky.abs() < 1e-12,
            "{first:?}"
        );
        // 1 % of the second frequency is 0.2 Hz, 0.4 of 50 in kx, and 1 % of ky.
        let second = modes[1].percent_per_percent.unwrap();
        assert!(
            (second.kx - 0.8).abs() < 1e-9 && (second.ky - 1.0).abs() < 1e-9,
            "{second:?}"
        );
    }

    #[test]
    fn prop_patterns_of_many_modes_are_drawn_by_the_seed() {
        let sum = |f: &[f64]| {
            Some(Stiffnesses {
                kx: f.iter().sum(),
                ky: f[12],
                kz: None,
            })
        };
        let (many, bounds) = ([10.0; 13], [1.0; 13]);
        let [first, again, other] =
            [1, 1, 2].map(|seed| sign_pattern_estimates(&many, &bounds, seed, sum).unwrap());
        assert_eq!(first.len(), 256);
        assert_eq!(first, again);
        assert_ne!(first, other);
        let ky = sign_pattern_spans(&many, &bounds, 1, sum)
            .unwrap()
            .ky
            .unwrap();
        assert_eq!((ky.low, ky.high), (9.0, 11.0));
    }

    #[test]
    fn limit_wrong_bounds_are_refused() {
        let never = |_: &[f64]| None;
        let many = [1.0; 13];
        let error = mode_sensitivities(&many, &[1.0], never).unwrap_err();
        assert!(
            matches!(error, IdentifyError::Bounds { bounds: 1, .. }),
            "{error}"
        );
        let spans = sign_pattern_spans(&[1.0, 2.0], &[0.1, 0.1], 1, never).unwrap();
        assert!(spans.kx.is_none() && spans.failed == 4, "{spans:?}");
        // Kz that changes its sign passes through infinity.
        let swinging = |f: &[f64]| {
            Some(Stiffnesses {
                kx: 1.0,
                ky: 1.0,
                kz: Some(f[0] - 1.0),
            })
        };
        let spans = sign_pattern_spans(&[1.05], &[0.1], 1, swinging).unwrap();
        assert!(spans.kz.is_none() && spans.kx.is_some(), "{spans:?}");
    }
}

#[test]
fn prop_a_common_factor_and_strangers_do_not_confuse_the_numbers() {
    use tapjoint::identify::{WeightedPeak, pair_by_ratio};
    let nominal = [100.0, 275.7, 540.4, 893.3];
    for factor in [0.85, 0.97, 1.0, 1.1, 1.18] {
        let peak = |frequency: f64, weight| WeightedPeak { frequency, weight };
        let peaks = [
            peak(50.0 * factor, 40.0),
            peak(100.0 * factor, 50.0),
            peak(275.0 * factor, 45.0),
            peak(420.0 * factor, 60.0),
            peak(545.0 * factor, 40.0),
        ];
        let numbers = pair_by_ratio(&peaks, &nominal, 0.2, 0.04);
        assert_eq!(
            numbers,
            [None, Some(1), Some(2), None, Some(3)],
            "factor {factor}"
        );
    }
}
