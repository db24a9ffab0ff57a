//! Tests in which a search that ends at the wrong optimum leads to a wrong answer with full confidence.

use crate::result::{Hypothesis, Verdict};
use crate::settings::GapSettings;
use crate::structure::Nominal;
use crate::synthetic::{TestPlan, observe};
use crate::tests::{plan, strip};
use crate::{Diagnosis, diagnose};
use tapjoint_beam::effects::{Effect, EffectId};
use tapjoint_beam::specimen::{Body, Joint};

/// Three recordings with shapes known to 3 %, all taps at one place (m).
fn plan_with_shapes(tap: f64) -> TestPlan {
    let mut plan = TestPlan {
        shape_std: Some(0.03),
        drift: 0.005,
        ..plan(&[0.3, 0.55, 0.7])
    };
    plan.configurations.iter_mut().for_each(|one| one.tap = tap);
    plan
}

/// Two strips in a line with a soft joint between them. Places of sensors and taps are known to 3 mm.
fn lap() -> Nominal {
    let mut nominal = strip(0.004);
    let Body::One(beam) = nominal.specimen.body else {
        unreachable!("the strip is one beam")
    };
    nominal.specimen.body = Body::Joined([beam, beam]);
    nominal.specimen.joint = Some(Joint {
        kt: 2e5,
        kr: 300.0,
        coupling: 0.0,
    });
    nominal.uncertainty.positions = 3e-3;
    nominal
}

fn probability(answer: &Diagnosis, hypothesis: &Hypothesis) -> f64 {
    let mut all = answer.hypotheses.iter();
    let found = all.find(|one| one.hypothesis == *hypothesis);
    found.map_or(0.0, |one| one.probability)
}

/// The taps hit the right beam, and the description states a place on the left one.
#[test]
fn regress_taps_beside_the_end_of_a_beam_are_no_gap() {
    let nominal = lap();
    let end = nominal.specimen.body.beams()[0].length;
    for seed in 0..2 {
        let planned = plan_with_shapes(end + 0.002);
        let mut observed = observe(&planned, &nominal, &[], seed).unwrap();
        for configuration in &mut observed.configurations {
            configuration.tap = Some(end - 0.002);
        }
        let answer = diagnose(&observed, &nominal, &GapSettings::default()).unwrap();
        let none = answer
            .hypotheses
            .iter()
            .find(|one| one.hypothesis == Hypothesis::None);
        // With the right places the model fits; by chance one test in a thousand is below this.
        let fits = none.and_then(|one| one.goodness_of_fit).unwrap();
        assert!(fits > 1e-3, "seed {seed}: {fits:e}");
        assert_eq!(answer.verdict, Verdict::NoGap, "seed {seed}");
    }
}

/// The size of this effect is its rotation. Here that is zero, and only the translation shows.
#[test]
fn regress_a_joint_that_gives_in_translation_alone_is_found() {
    let mut nominal = strip(0.004);
    nominal.specimen.joint = Some(Joint {
        kt: f64::INFINITY,
        kr: f64::INFINITY,
        coupling: 0.0,
    });
    let pairs = [("rotation", 0.0), ("translation", 2e-3)];
    let effect = Effect::from_pairs(EffectId::JointCompliance, &pairs).unwrap();
    for seed in 0..2 {
        let effects = std::slice::from_ref(&effect);
        let observed = observe(&plan(&[0.34, 0.19]), &nominal, effects, seed).unwrap();
        let answer = diagnose(&observed, &nominal, &GapSettings::default()).unwrap();
        let own = Hypothesis::Effects(vec![EffectId::JointCompliance]);
        let stated = probability(&answer, &own);
        assert!(stated > 0.9, "seed {seed}: {stated}, {:?}", answer.verdict);
    }
}

/// A stiff spring at one place imitates a strong coupling, with a size far beyond the scale of its prior. Its evidence was
/// extrapolated to sizes that no data support.
#[test]
fn regress_a_strong_coupling_is_not_something_unknown() {
    let mut nominal = strip(0.004);
    nominal.specimen.joint = Some(Joint {
        kt: 2.2e5,
        kr: 2200.0,
        coupling: 0.0,
    });
    let effect = Effect::from_pairs(EffectId::CrossCoupling, &[("coupling", 0.55)]).unwrap();
    for seed in 0..2 {
        let effects = std::slice::from_ref(&effect);
        let observed = observe(&plan(&[0.34, 0.19, 0.25]), &nominal, effects, seed).unwrap();
        let answer = diagnose(&observed, &nominal, &GapSettings::default()).unwrap();
        let own = Hypothesis::Effects(vec![EffectId::CrossCoupling]);
        let stated = probability(&answer, &own);
        assert!(stated > 0.5, "seed {seed}: {stated}, {:?}", answer.verdict);
    }
}
