//! Joints whose stiffness depends on the amplitude: what recordings of them are diagnosed as.

use crate::joint_law::LawInClosedForm;
use crate::shared::{calibrated_strip, data, record, recording_table};
use proptest::prelude::*;
use std::f64::consts::TAU;
use std::path::Path;
use tapjoint::description::TestDescription;
use tapjoint::effects::{Effect, EffectId, JointLaw, ModeMotion};
use tapjoint::gap::{
    AmplitudeDependence, Diagnosis, FrequencyChange, GapSettings, Hypothesis, Thresholds, Verdict,
};
use tapjoint::pipeline::{IdentifySettings, diagnose_test, run_test};
use tapjoint::recording::WavFormat;
use tapjoint::simulate::{Laboratory, TestPlan, nominal_description, plan_test};

const CANTILEVER: &str = calibrated_strip!(
    "mass = \"1.5 g\"\n",
    recording_table!("hard.wav", 0.385, 700),
    "level = 4\n",
    recording_table!("soft.wav", 0.385, 700)
);

fn diagnosed(text: &str, folder: &Path) -> Diagnosis {
    let test = TestDescription::parse(text, "test.toml").unwrap();
    let settings = IdentifySettings::default();
    let analysis = run_test(&test, (folder, "test.toml"), &settings).unwrap();
    diagnose_test(&test, &analysis, &GapSettings::default()).unwrap()
}

/// The cantilever with these effects, recorded, and diagnosed from what its user believes.
fn virtual_test(effects: &[Effect], seed: u64) -> Diagnosis {
    let folder = tempfile::tempdir().unwrap();
    let description = TestDescription::parse(CANTILEVER, "test.toml").unwrap();
    let laboratory = Laboratory::default();
    let plan = TestPlan {
        description: &description,
        effects,
        laboratory: &laboratory,
        changes: &[],
        repeatability: 0.0,
        joint: None,
        seed,
    };
    let test = plan_test(&plan).unwrap();
    record(&test, &laboratory, folder.path(), WavFormat::Pcm24);
    let text = nominal_description(CANTILEVER, &description, &test).unwrap();
    diagnosed(&text, folder.path())
}

/// Named, and its ratio within three standard uncertainties: one case in 400 misses.
fn assert_found(diagnosis: &Diagnosis, ratio: f64) {
    let blocks = &diagnosis.blocks;
    assert_eq!(
        diagnosis.verdict,
        Verdict::Named(vec![EffectId::JointNonlinearity]),
        "{blocks:?}"
    );
    let wanted = Hypothesis::Effects(vec![EffectId::JointNonlinearity]);
    let found = diagnosis.hypotheses.iter();
    let found = found.clone().find(|one| one.hypothesis == wanted).unwrap();
    let size = &found.parameters[0];
    assert!(
        (size.value - ratio).abs() < 3.0 * size.std.unwrap(),
        "{size:?}"
    );
}

#[test]
fn recover_the_joint_that_slips_among_the_samples() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings/nonlinear");
    let text = std::fs::read_to_string(folder.join("test.toml")).unwrap();
    // 5 % softer by the hardest tap, as its truth.json has it.
    assert_found(&diagnosed(&text, &folder), -0.05);
}

#[test]
fn limit_the_decays_of_a_linear_joint_say_nothing() {
    let diagnosis = virtual_test(&[], 133);
    assert_eq!(diagnosis.verdict, Verdict::NoGap);
    assert_eq!(diagnosis.amplitude_dependence, None);
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_the_bolted_beam_softens_and_is_no_pair_of_springs() {
    let file = "brb_bolted_beam/DERIVED_HammerImpact_3acc_float32.wav";
    let path = data(file);
    let sensor = |name: &str, channel: usize, position: f64| {
        format!(
            "[[sensor]]\nname = \"{name}\"\nchannel = {channel}\nkind = \"acceleration\"\n\
             scale = 1.0\nposition = {position}\n"
        )
    };
    let text = format!(
        "name = \"Brake-Reuss beam\"\n[beam]\nlength = 0.72\nwidth = 0.0254\nthickness = 0.0127\n\
         modulus = 192e9\ndensity = 7861\n[joint]\nkind = \"lap\"\nbeam = \"euler\"\n{}{}{}\
         [[recording]]\nfile = '{}'\n[analysis]\nfit_modes = 4\n",
        sensor("left", 1, 0.0254),
        sensor("right", 2, 0.5549),
        sensor("end", 3, 0.6438),
        path.display()
    );
    let diagnosis = diagnosed(&text, Path::new("."));
    // The springs miss 297.7 and 580.7 Hz by 5 %, and nothing in the catalogue explains that.
    assert_eq!(diagnosis.verdict, Verdict::Unknown);
    // Other programs follow mode 1 from 80.29 Hz at 33 m/s2 to 80.54 Hz at 2.3 m/s2: -0.12 % per factor e.
    let found = diagnosis.amplitude_dependence.unwrap();
    assert!(
        found.ratio < 0.0 && found.direction() == "softens",
        "{found:?}"
    );
    assert!(found.effect.is_some(), "{found:?}");
    // So it does where the band holds four modes.
    let narrow = text.replace("[[recording]]", "[[recording]]\nband = [0, 900]");
    let narrow = diagnosed(&narrow, Path::new("."))
        .amplitude_dependence
        .unwrap();
    assert!(narrow.effect.is_some() && narrow.ratio < 0.0, "{narrow:?}");
    let first = found
        .changes
        .iter()
        .find(|change| change.mode == 1)
        .unwrap();
    assert!((-0.2..-0.06).contains(&first.percent_per_fold), "{first:?}");
}

/// The stiffness change that one of two motions feels of M = c theta^3 (k = 1): first harmonic over its
/// amplitude, averaged over both phases.
fn cubic_by_quadrature(own: f64, other: f64, ratio: f64) -> f64 {
    const STEPS: usize = 48;
    let c = ratio / 0.75;
    let mut sum = 0.0;
    for i in 0..STEPS {
        for k in 0..STEPS {
            let (a, b) = (TAU * i as f64 / STEPS as f64, TAU * k as f64 / STEPS as f64);
            let theta = own * a.cos() + other * b.cos();
            sum += 2.0 * c * theta.powi(3) * a.cos() / own;
        }
    }
    sum / (STEPS * STEPS) as f64
}

proptest! {
    #[test]
    fn prop_a_motion_by_itself_feels_the_secant(
        ratio in -0.3..0.3f64, exponent in 0.5..2.0f64, amplitude in 0.01..1.0f64,
    ) {
        let law = JointLaw { ratio, exponent };
        let own = ModeMotion { amplitude, omega: 100.0 };
        let change = law.change_among(own, std::iter::empty());
        prop_assert!((change - (law.secant(amplitude) - 1.0)).abs() < 1e-12);
    }

    #[test]
    fn prop_a_cubic_spring_feels_another_motion_twice(
        ratio in -0.3..0.3f64, own in 0.05..1.0f64, other in 0.0..1.0f64,
    ) {
        let law = JointLaw { ratio: ratio.abs(), exponent: 2.0 };
        let motion = |amplitude, omega| ModeMotion { amplitude, omega };
        let change = law.change_among(motion(own, 100.0), [motion(other, 617.0)].into_iter());
        let expected = cubic_by_quadrature(own, other, ratio.abs());
        // Trigonometric polynomials: the sums are exact.
        prop_assert!((change - expected).abs() < 1e-9, "{change} {expected}");
    }
}

/// What was found where these changes stand out, ten standard uncertainties each.
fn finding(percents: &[f64]) -> AmplitudeDependence {
    let change = |(index, percent): (usize, &f64)| FrequencyChange {
        mode: index + 1,
        recording: "tap.wav".to_owned(),
        level: None,
        percent_per_fold: *percent,
        std: 0.1 * percent.abs(),
        explained: 0.0,
    };
    judged(percents.iter().enumerate().map(change).collect())
}

fn judged(changes: Vec<FrequencyChange>) -> AmplitudeDependence {
    let law = JointLaw {
        ratio: -0.1,
        exponent: 1.0,
    };
    AmplitudeDependence::new(law, 0.01, 1e-9, None, changes, &Thresholds::DEFAULT)
}

#[test]
fn regress_one_frequency_that_changes_is_no_joint() {
    assert!(finding(&[]).effect.is_none());
    assert!(finding(&[-0.2]).effect.is_none());
    assert!(finding(&[-0.2, -0.1]).effect.is_some());
    assert!(finding(&[-0.2, 0.1]).effect.is_none());
    assert!(!finding(&[-0.2]).enough && finding(&[-0.2, 0.1]).enough);
    // A change within two standard uncertainties has no direction.
    let mut weak = finding(&[-0.2, 0.1, -0.1]);
    weak.changes[1].std = 0.06;
    assert!(judged(weak.changes.clone()).effect.is_some());
    weak.changes[2].std = 0.06;
    let weak = judged(weak.changes);
    assert!(weak.effect.is_none() && !weak.enough);
}

// ---------------------------------------------------------------------------------------------
// Sliders in parallel under several motions at once

/// Stiffness change and loss factor, over the change of stiffness of one motion of amplitude 1, that each of
/// several motions (amplitude, whole cycles in the common period) feels of sliders. Each slider follows the
/// motion until it slips; what it holds back is projected on the motions over one common period.
fn by_sliders(law: &JointLaw, motions: &[(f64, f64)]) -> Vec<(f64, f64)> {
    // 80 sliders and 48 steps in the fastest cycle leave 2 %.
    const SLIDERS: usize = 80;
    const STEPS: f64 = 48.0;
    let peak: f64 = motions.iter().map(|motion| motion.0).sum();
    let coefficient = law.coefficient(1.0);
    // Strengths peak u^2, denser where a density with a power below 0 is steep.
    let sliders: Vec<(f64, f64)> = (0..SLIDERS)
        .map(|k| (k as f64 + 0.5) / SLIDERS as f64)
        .map(|u| (peak * u * u, 2.0 * peak * u / SLIDERS as f64))
        .map(|(slip, width)| (slip, width * law.slider_density(slip, coefficient)))
        .collect();
    let fastest = motions.iter().map(|motion| motion.1).fold(0.0, f64::max);
    let steps = (STEPS * fastest) as usize;
    // Phases that meet nowhere in particular.
    let phase = |k: usize, step: usize| {
        TAU * motions[k].1 * step as f64 / steps as f64 + 0.7 * (k * k) as f64
    };
    let mut held = vec![0.0_f64; SLIDERS];
    let mut last = 0.0;
    let mut sums = vec![(0.0, 0.0); motions.len()];
    for step in 0..2 * steps {
        let at = |k: usize| motions[k].0 * phase(k, step).cos();
        let x: f64 = (0..motions.len()).map(at).sum();
        let mut lost = 0.0;
        for (z, (slip, stiffness)) in held.iter_mut().zip(&sliders) {
            *z = (*z + x - last).clamp(-slip, *slip);
            lost += stiffness * (x - *z);
        }
        last = x;
        // The first period is that of first loading.
        if step >= steps {
            for (k, sum) in sums.iter_mut().enumerate() {
                let share = 2.0 * lost / motions[k].0 / steps as f64;
                sum.0 -= share * phase(k, step).cos();
                sum.1 += share * phase(k, step).sin();
            }
        }
    }
    let over = |(change, loss): (f64, f64)| (change / law.ratio, loss / -change);
    sums.into_iter().map(over).collect()
}

/// What the law makes of the same, over that of one motion of amplitude 1.
fn by_law(law: &JointLaw, motions: &[(f64, f64)], own: usize) -> f64 {
    let motion = |&(amplitude, cycles): &(f64, f64)| ModeMotion {
        amplitude,
        omega: cycles,
    };
    let others = motions.iter().enumerate().filter(|(k, _)| *k != own);
    let others = others.map(|(_, one)| motion(one));
    law.change_among(motion(&motions[own]), others) / law.ratio
}

const SLIPPING: [f64; 3] = [0.5, 1.0, 1.5];

fn slipping(exponent: f64) -> JointLaw {
    JointLaw {
        ratio: -0.1,
        exponent,
    }
}

#[test]
fn limit_one_motion_alone_loses_what_its_law_says() {
    for exponent in SLIPPING {
        let law = slipping(exponent);
        let (change, loss) = by_sliders(&law, &[(1.0, 4.0)])[0];
        assert!((change - 1.0).abs() < 0.02, "{exponent}: {change}");
        // 1/4, 0.424 and 9/16: no constant for all powers.
        let expected = law.loss_over_change();
        assert!((loss / expected - 1.0).abs() < 0.02, "{exponent}: {loss}");
        // loss_factor is over the energy of the spring that has softened.
        let whole = expected * 0.1 / 0.9;
        assert!((law.loss_factor(1.0) / whole - 1.0).abs() < 1e-12);
    }
}

#[test]
fn val_sliders_feel_a_second_motion_as_the_law_says() {
    for exponent in SLIPPING {
        let law = slipping(exponent);
        for (own, other) in [
            (2.0, 45.0),
            (7.0, 44.0),
            (8.0, 21.0),
            (21.0, 8.0),
            (44.0, 7.0),
        ] {
            for amplitude in [0.1, 0.4, 1.0, 3.0, 10.0] {
                let motions = [(1.0, own), (amplitude, other)];
                let (change, _) = by_sliders(&law, &motions)[0];
                let ratio = by_law(&law, &motions, 0) / change;
                // The transition between the two limits is a fit that leaves 12 %.
                assert!(
                    (ratio - 1.0).abs() < 0.13,
                    "{exponent} {motions:?}: {ratio}"
                );
            }
        }
    }
}

#[test]
fn val_sliders_feel_several_motions() {
    let sets: [&[(f64, f64)]; 4] = [
        &[(1.0, 2.0), (0.6, 7.0), (0.5, 19.0)],
        &[(0.4, 2.0), (1.0, 9.0), (0.3, 31.0)],
        &[(1.0, 2.0), (0.5, 5.0), (0.4, 13.0), (0.2, 29.0)],
        &[(0.3, 2.0), (0.5, 7.0), (1.0, 17.0), (0.4, 37.0)],
    ];
    let (mut squares, mut count) = (0.0, 0.0);
    for exponent in SLIPPING {
        let law = slipping(exponent);
        for motions in sets {
            for (own, (change, _)) in by_sliders(&law, motions).into_iter().enumerate() {
                let ratio: f64 = by_law(&law, motions, own) / change;
                squares += ratio.ln().powi(2);
                count += 1.0;
                // A small motion among stronger ones strays by 22 % for the power 3/2.
                assert!(
                    (0.75..1.2).contains(&ratio),
                    "{exponent} {motions:?} {own}: {ratio}"
                );
            }
        }
    }
    let scatter = f64::sqrt(squares / count);
    // 0.10 of these.
    assert!(scatter < 0.13, "{scatter}");
}

#[test]
fn val_a_small_second_motion_leaves_the_loss() {
    for exponent in SLIPPING {
        let law = slipping(exponent);
        for other in [3.0, 8.0, 34.0, 55.0] {
            let (_, loss) = by_sliders(&law, &[(1.0, 21.0), (0.25, other)])[0];
            let ratio = loss / law.loss_over_change();
            // A faster motion adds up to a fifth.
            assert!((ratio - 1.0).abs() < 0.25, "{exponent} {other}: {ratio}");
        }
    }
}

#[test]
fn val_elastic_powers_feel_a_second_motion_within_six_percent() {
    const STEPS: usize = 200;
    for exponent in [0.5, 1.0, 1.5, 2.0] {
        let law = JointLaw {
            ratio: 0.1,
            exponent,
        };
        for other in [0.1, 0.4, 1.0, 2.5, 10.0] {
            let mut sum = 0.0;
            for step in 0..STEPS * STEPS {
                let at = |k: usize| (TAU * (k as f64 + 0.5) / STEPS as f64).cos();
                let own = at(step % STEPS);
                let theta = own + other * at(step / STEPS);
                let moment = law.first_loading(theta, law.coefficient(1.0)) - theta;
                sum += 2.0 * moment * own;
            }
            let change = sum / (STEPS * STEPS) as f64 / law.ratio;
            let ratio = by_law(&law, &[(1.0, 1.0), (other, 2.7)], 0) / change;
            assert!((ratio - 1.0).abs() < 0.06, "{exponent} {other}: {ratio}");
        }
    }
}
