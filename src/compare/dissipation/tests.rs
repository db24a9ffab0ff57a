//! Tests of the change of dampings.

use super::{USUAL, dampings, joint_slopes};
use crate::fixture::{self, cantilever, frequencies, joint, pair};
use crate::model::PairModel;
use crate::result::DampingVerdict;
use crate::test::{Pair, Reading, Test};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use tapjoint_beam::specimen::Joint;

const MODES: [usize; 5] = [1, 2, 3, 4, 5];

/// A test whose description states the joint.
fn test(joint: Joint) -> Test {
    let structure = cantilever(joint);
    let frequencies = frequencies(&structure, MODES.len());
    Test {
        knows_joint: [true; 2],
        ..fixture::test(&structure, &[], &frequencies)
    }
}

fn model(test: &Test) -> PairModel {
    let pair = pair(test.clone(), test.clone());
    PairModel::new(&pair, &MODES).unwrap()
}

/// Returns the test with these damping ratios, each read to a percent.
fn damped(test: &Test, dampings: &[f64]) -> Test {
    let mut damped = test.clone();
    for (mode, value) in damped.modes.iter_mut().zip(dampings) {
        mode.damping = Some(Reading {
            value: *value,
            std: 0.01 * value,
        });
    }
    damped
}

#[test]
fn limit_a_beam_on_a_soft_hinge_has_all_its_energy_in_the_joint() {
    // The first mode is then a rigid body on a spring: zeta = eta/2, as of one degree of freedom.
    let soft = model(&test(joint(f64::INFINITY, 1e-3)));
    let slopes = joint_slopes(&[soft]).unwrap().swap_remove(0);
    assert!((slopes[0] - 0.5).abs() < 1e-3, "{slopes:?}");
    // Its higher modes bend a beam that a soft spring hardly holds.
    assert!(
        slopes[1..]
            .iter()
            .all(|slope_of_mode| *slope_of_mode < 1e-3),
        "{slopes:?}"
    );
    let rigid = model(&test(Joint::RIGID));
    assert!(joint_slopes(&[rigid]).is_none());
}

#[test]
fn prop_the_lever_is_half_of_the_share_of_the_energy() {
    // The frequencies of a stiffness that is complex, to first order: K (1 + i eta) moves ln f by i eta d ln f/d ln K, and
    // zeta is the imaginary part of ln omega.
    let own = joint(800.0, 6.0);
    let slopes = joint_slopes(&[model(&test(own))]).unwrap().swap_remove(0);
    let moved = |factor: f64| {
        test(Joint {
            kt: factor * own.kt,
            kr: factor * own.kr,
            ..own
        })
    };
    let [above, below] = [1.001, 0.999].map(moved);
    for ((slope_of_mode, above), below) in slopes.iter().zip(&above.modes).zip(&below.modes) {
        let slope = (above.frequency / below.frequency).ln() / (1.001_f64 / 0.999).ln();
        // The slopes are differences over 2 %, and have another mesh.
        assert!(
            (slope_of_mode - slope).abs() < 1e-3 * slope,
            "{slope_of_mode} {slope}"
        );
    }
}

#[test]
fn limit_equal_dampings_are_no_change_and_a_mode_without_one_is_left_out() {
    let own = test(joint(800.0, 6.0));
    let damped = damped(&own, &[0.003, 0.004, 0.002, 0.003]);
    let pair = Pair {
        before: vec![damped.clone()],
        after: vec![damped],
    };
    let found = dampings(&[pair], &[model(&own)]).unwrap();
    assert_eq!(found.verdict, DampingVerdict::NoChange);
    assert_eq!(found.modes.len(), 4);
    assert!((found.no_change_goodness - 1.0).abs() < 1e-9);
    let nothing = Pair {
        before: vec![own.clone()],
        after: vec![own.clone()],
    };
    assert!(dampings(&[nothing], &[model(&own)]).is_none());
}

#[test]
fn prop_a_damping_that_rises_in_one_mode_alone_is_not_the_joints() {
    let own = test(joint(800.0, 6.0));
    let side = |fourth: f64| {
        let ratios = [0.95, 1.0, 1.05]
            .map(|factor| [0.003, 0.003, 0.003, fourth, 0.003].map(|one| factor * one));
        ratios.map(|ratios| damped(&own, &ratios)).to_vec()
    };
    let pair = Pair {
        before: side(0.003),
        after: side(0.009),
    };
    let found = dampings(&[pair], &[model(&own)]).unwrap();
    assert_eq!(found.verdict, DampingVerdict::Other, "{found:?}");
}

/// How dampings scatter between tests.
#[derive(Debug, Clone, Copy)]
enum Scatter {
    /// Standard deviation of the difference of two tests (1).
    Of(f64),
    /// Drawn for each seed between half and twice the usual one.
    Usual,
}

/// Returns three shares of the seeds: the interval holds the loss factor; without a change the answer is no change; with one it
/// is the joint's damping.
fn shares(scatter: Scatter, repeats: usize) -> [f64; 3] {
    let own = test(joint(800.0, 6.0));
    let model = model(&own);
    let slopes = joint_slopes(std::slice::from_ref(&model))
        .unwrap()
        .swap_remove(0);
    let loss = 0.02;
    let seeds = 4000;
    let mut counts = [0.0; 3];
    for seed in 0..seeds {
        let mut draw = ChaCha8Rng::seed_from_u64(seed);
        let scatter = match scatter {
            Scatter::Of(scatter) => scatter,
            Scatter::Usual => USUAL.share * 2.0_f64.powf(draw.random_range(-1.0..1.0)),
        };
        // The difference of two tests has the variance of both.
        let one_test = scatter / 2.0_f64.sqrt();
        // All modes have a part of it in common.
        let share: f64 = draw.random_range(0.0..0.5);
        let normal = Normal::new(0.0, one_test).unwrap();
        let mut side = |loss: f64| -> Vec<Test> {
            let tests = 0..repeats;
            tests
                .map(|_| {
                    let common = share.sqrt() * normal.sample(&mut draw);
                    let mut ratios = Vec::new();
                    for slope in &slopes {
                        let off = common + (1.0 - share).sqrt() * normal.sample(&mut draw);
                        ratios.push((0.002 + slope * loss) * (1.0 + off));
                    }
                    damped(&own, &ratios)
                })
                .collect()
        };
        let (before, after, again) = (side(0.005), side(0.005 + loss), side(0.005));
        let changed = Pair {
            before: before.clone(),
            after,
        };
        let same = Pair {
            before,
            after: again,
        };
        let [changed, same] =
            [changed, same].map(|pair| dampings(&[pair], std::slice::from_ref(&model)).unwrap());
        let found = changed.loss_factor.unwrap();
        counts[0] += f64::from(u8::from((found.low..=found.high).contains(&loss)));
        counts[1] += f64::from(u8::from(same.verdict == DampingVerdict::NoChange));
        counts[2] += f64::from(u8::from(changed.verdict == DampingVerdict::JointDamping));
    }
    counts.map(|count| count / seeds as f64)
}

#[test]
fn recover_a_change_of_the_loss_factor() {
    let cases = [
        (Scatter::Usual, 1, [0.92, 0.97]),
        (Scatter::Of(0.2), 6, [0.92, 0.98]),
        (Scatter::Of(0.3), 10, [0.92, 0.97]),
        // The usual scatter keeps its weight beside repeats that scatter less: the interval is wider than it need be.
        (Scatter::Of(0.05), 10, [0.97, 1.0]),
    ];
    for (scatter, repeats, [least, most]) in cases {
        let [holds, quiet, found] = shares(scatter, repeats);
        // 93 to 97 %, to within 1 % (three standard deviations of 4000 seeds).
        assert!(
            holds >= least && holds <= most,
            "{scatter:?} {repeats}: {holds}"
        );
        assert!(quiet > 0.98, "{scatter:?} {repeats}: {quiet}");
        // One pair knows little of its scatter.
        assert!(
            repeats == 1 || found > 0.9,
            "{scatter:?} {repeats}: {found}"
        );
    }
}
