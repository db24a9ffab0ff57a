//! Tests of the change of dampings.

use super::{USUAL, dampings};
use crate::fixture::{self, BEAM, cantilever, frequencies, joint, pair};
use crate::model::PairModel;
use crate::result::DampingVerdict;
use crate::test::{Pair, Reading, Test};
use nalgebra::Complex;
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
    let levers = soft.joint_levers().unwrap();
    assert!((levers[0] - 0.5).abs() < 1e-3, "{levers:?}");
    // Its higher modes bend a beam that a soft spring hardly holds.
    assert!(levers[1..].iter().all(|lever| *lever < 1e-3), "{levers:?}");
    let rigid = model(&test(Joint::RIGID));
    assert!(rigid.joint_levers().is_none());
}

/// Returns what vanishes at a mode of a beam with one free end and springs at the other: translation kt (E I/L^3) and rotation
/// kr (E I/L). Its natural frequency is in proportion to root^2.
///
/// From the free end on w = a (cosh + cos) + b (sinh + sin). At the springs w'' = -kr w' and w''' = kt w.
fn frequency_equation(root: Complex<f64>, [kt, kr]: [Complex<f64>; 2]) -> Complex<f64> {
    let (ch, c, sh, s) = (root.cosh(), root.cos(), root.sinh(), root.sin());
    let moment = [
        root * (ch - c) + kr * (sh - s),
        root * (sh - s) + kr * (ch + c),
    ];
    let cubed = root.powu(3);
    let force = [
        cubed * (sh + s) - kt * (ch + c),
        cubed * (ch - c) - kt * (sh + s),
    ];
    moment[0] * force[1] - moment[1] * force[0]
}

#[test]
fn val_levers_are_those_of_a_complex_stiffness() {
    let springs = [800.0, 6.0];
    let own = test(joint(springs[0], springs[1]));
    let levers = model(&own).joint_levers().unwrap();
    let loss = 1e-3;
    let complex = springs.map(|stiffness| stiffness * Complex::new(1.0, loss));
    let unit = (BEAM.mass() * BEAM.length.powi(3) / BEAM.bending_stiffness()).sqrt();
    for (mode, lever) in own.modes.iter().zip(levers) {
        let omega = 2.0 * std::f64::consts::PI * mode.frequency * unit;
        let mut root = Complex::from(omega.sqrt());
        for _ in 0..20 {
            let step = Complex::from(1e-5);
            let [above, below] =
                [root + step, root - step].map(|near| frequency_equation(near, complex));
            root -= frequency_equation(root, complex) * (step + step) / (above - below);
        }
        let squared = root * root;
        assert!((squared.re / omega - 1.0).abs() < 1e-5, "{mode:?}");
        // zeta is the imaginary part of ln omega.
        let damping = squared.arg();
        assert!(
            (damping / (loss * lever) - 1.0).abs() < 1e-5,
            "{mode:?}: {damping} {lever}"
        );
    }
}

#[test]
fn limit_modes_that_hardly_feel_the_joint_tell_no_loss_factor() {
    let [stiff, clamped] = [1e6, 1e300].map(|factor| test(joint(800.0 * factor, 6.0 * factor)));
    for own in [stiff, clamped] {
        let [before, after] = [0.002, 0.02].map(|ratio| vec![damped(&own, &[ratio; 5])]);
        let found = dampings(&[Pair { before, after }], &[model(&own)]).unwrap();
        assert!(found.loss_factor.is_none(), "{found:?}");
        assert_ne!(found.verdict, DampingVerdict::NoChange, "{found:?}");
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
fn prop_modes_without_a_damping_tell_nothing_of_the_scatter() {
    let own = test(joint(800.0, 6.0));
    let side = |factors: [f64; 3]| {
        factors
            .map(|factor| damped(&own, &[0.003 * factor; 3]))
            .to_vec()
    };
    let pair = Pair {
        before: side([0.9, 1.0, 1.1]),
        after: side([1.0, 1.1, 1.2]),
    };
    let [all, three] = [&MODES[..], &MODES[..3]].map(|modes| {
        let model = PairModel::new(&pair, modes).unwrap();
        dampings(std::slice::from_ref(&pair), &[model]).unwrap()
    });
    assert_eq!(all.modes, three.modes);
    assert_eq!(all.scatter_percent, three.scatter_percent);
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
    // A joint that is rigid damps nothing, so that it is neither the cause nor refuted.
    let rigid = damped(&test(Joint::RIGID), &[0.003; 5]);
    let pair = Pair {
        before: vec![rigid.clone()],
        after: vec![damped(&rigid, &[0.03; 5])],
    };
    let found = dampings(&[pair], &[model(&rigid)]).unwrap();
    assert_eq!(found.verdict, DampingVerdict::Undecided, "{found:?}");
}

/// How dampings scatter between tests.
#[derive(Debug, Clone, Copy)]
enum Scatter {
    /// Standard deviation of the difference of two tests (1).
    Of(f64),
    /// Drawn for each seed between half and twice the usual one.
    Usual,
}

/// Scatter of one seed.
struct Drawn {
    /// Standard deviation of the difference of two tests (1).
    std: f64,
    /// Share of the variance that all modes have in common (1).
    share: f64,
}

impl Drawn {
    fn new(scatter: Scatter, draw: &mut ChaCha8Rng) -> Self {
        Self {
            std: match scatter {
                Scatter::Of(std) => std,
                Scatter::Usual => USUAL.share * 2.0_f64.powf(draw.random_range(-1.0..1.0)),
            },
            share: draw.random_range(0.0..0.5),
        }
    }

    /// Returns repeats of a test with these damping ratios.
    fn tests(
        &self,
        own: &Test,
        ratios: &[f64],
        repeats: usize,
        draw: &mut ChaCha8Rng,
    ) -> Vec<Test> {
        // The difference of two tests has the variance of both.
        let normal = Normal::new(0.0, self.std / 2.0_f64.sqrt()).unwrap();
        let mut tests = Vec::new();
        for _ in 0..repeats {
            let common = self.share.sqrt() * normal.sample(draw);
            let scattered = ratios.iter().map(|ratio| {
                let off = common + (1.0 - self.share).sqrt() * normal.sample(draw);
                ratio * (1.0 + off)
            });
            let scattered: Vec<f64> = scattered.collect();
            tests.push(damped(own, &scattered));
        }
        tests
    }
}

/// Returns three shares of the seeds: the interval holds the change of the loss factor; without a change the answer is no change;
/// with one it is the joint's damping.
fn shares(scatter: Scatter, repeats: usize, loss: f64) -> [f64; 3] {
    let own = test(joint(800.0, 6.0));
    let models = [model(&own)];
    let levers = models[0].joint_levers().unwrap();
    let with = |loss: f64| -> Vec<f64> { levers.iter().map(|one| 0.002 + one * loss).collect() };
    let (low, high) = (with(0.005), with(0.005 + loss));
    let seeds = 4000;
    let mut counts = [0.0; 3];
    for seed in 0..seeds {
        let mut draw = ChaCha8Rng::seed_from_u64(seed);
        let drawn = Drawn::new(scatter, &mut draw);
        let [before, after, again] =
            [&low, &high, &low].map(|ratios| drawn.tests(&own, ratios, repeats, &mut draw));
        let [changed, same] = [after, again].map(|after| {
            let before = before.clone();
            dampings(&[Pair { before, after }], &models).unwrap()
        });
        let found = changed.loss_factor.unwrap();
        counts[0] += f64::from(u8::from((found.low..=found.high).contains(&loss)));
        counts[1] += f64::from(u8::from(same.verdict == DampingVerdict::NoChange));
        counts[2] += f64::from(u8::from(changed.verdict == DampingVerdict::JointDamping));
    }
    counts.map(|count| count / seeds as f64)
}

#[test]
fn recover_a_damping_that_rises_in_all_modes() {
    // Least and largest share of the seeds in which a change is seen, by number of tests on either side and by factor.
    let cases = [
        (1, 1.0, [0.0, 0.01]),
        (1, 2.0, [0.1, 0.3]),
        (1, 3.0, [0.95, 1.0]),
        (3, 1.0, [0.0, 0.02]),
        (3, 1.5, [0.9, 1.0]),
    ];
    let own = test(joint(800.0, 6.0));
    let models = [model(&own)];
    for (repeats, factor, [least, most]) in cases {
        let seeds = 1000;
        let mut seen = 0;
        for seed in 0..seeds {
            let mut draw = ChaCha8Rng::seed_from_u64(seed);
            let drawn = Drawn::new(Scatter::Of(USUAL.share), &mut draw);
            let [before, after] = [1.0, factor]
                .map(|factor| drawn.tests(&own, &[0.003 * factor; 5], repeats, &mut draw));
            let found = dampings(&[Pair { before, after }], &models).unwrap();
            seen += usize::from(found.verdict != DampingVerdict::NoChange);
        }
        let share = seen as f64 / seeds as f64;
        assert!(
            share >= least && share <= most,
            "{repeats} tests, factor {factor}: {share}"
        );
    }
}

#[test]
fn recover_a_change_of_the_loss_factor() {
    let cases = [
        // One pair sees a large change alone: 0.02 doubles the dampings, 0.04 multiplies them by three to four.
        (Scatter::Usual, 1, 0.02, [0.92, 0.97], 0.35),
        (Scatter::Usual, 1, 0.04, [0.9, 0.97], 0.95),
        (Scatter::Of(0.2), 6, 0.02, [0.92, 0.98], 0.9),
        (Scatter::Of(0.3), 10, 0.02, [0.92, 0.97], 0.9),
        // The usual scatter keeps its weight beside repeats that scatter less: the interval is wider than it need be.
        (Scatter::Of(0.05), 10, 0.02, [0.97, 1.0], 0.9),
    ];
    for (scatter, repeats, loss, [least, most], power) in cases {
        let [holds, quiet, found] = shares(scatter, repeats, loss);
        let case = format!("{scatter:?}, {repeats} repeats, {loss}: {holds} {quiet} {found}");
        // 93 to 97 %, to within 1 % (three standard deviations of 4000 seeds).
        assert!(holds >= least && holds <= most, "{case}");
        assert!(quiet > 0.98, "{case}");
        assert!(found > power, "{case}");
    }
}
