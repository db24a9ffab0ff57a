use super::*;
use crate::tests::fitted;

fn tested(holdout: f64, is_decisive: bool, [value, low]: [f64; 2]) -> GoodnessOfFit {
    let closure = Closure {
        value,
        low,
        high: 1.0,
    };
    GoodnessOfFit {
        overall: None,
        blocks: Vec::new(),
        holdout: Some(holdout),
        peak: None,
        freedom: None,
        closure: Some(closure),
        is_sized: true,
        is_decisive,
        thresholds: Thresholds::DEFAULT,
    }
}

/// Two effects at once must not predict worse than none; without hold-out data there is no test.
#[test]
fn limit_two_effects_have_to_improve_on_holdout_data() {
    for (closure, improves) in [(-7.0, false), (0.1, true)] {
        assert_eq!(
            tested(0.5, false, [closure, -9.0]).improves_holdout(),
            improves
        );
    }
    let unknown = GoodnessOfFit {
        closure: None,
        ..tested(0.5, false, [0.0; 2])
    };
    assert!(unknown.improves_holdout());
}

#[test]
fn limit_what_makes_holdout_data_worse_has_to_predict_them() {
    for (withheld, decides, closure, holds) in [
        (0.01, true, [0.9, 0.5], true),
        (0.01, true, [0.9, -0.5], false),
        (0.5, true, [0.9, -0.5], true),
        (0.5, true, [-0.9, -5.0], false),
        (0.5, true, [0.45, 0.3], false),
        // Too small a gap to decide by.
        (0.01, false, [0.9, -0.5], true),
        (0.5, false, [-0.9, -5.0], true),
        (0.01, false, [-6.0, -20.0], false),
        (0.5, false, [-30.0, -60.0], false),
    ] {
        let found = tested(withheld, decides, closure).passes_holdout();
        assert_eq!(found, holds, "{withheld} {decides} {closure:?}");
    }
}

/// At p = 1/e and above a misfit does not count; below, the odds grow and stay finite down to zero.
#[test]
fn limit_odds_from_a_misfit_are_even_at_best_and_finite_at_worst() {
    assert!((odds_by_p_value(1.0) - 1.0).abs() < 1e-15);
    assert!((odds_by_p_value((-1.0_f64).exp()) - 1.0).abs() < 1e-15);
    assert!(odds_by_p_value(0.0).is_finite());
    assert!(odds_by_p_value(0.0) > odds_by_p_value(1e-6));
}

/// Sellke, Bayarri & Berger (2001), table 1: at least 0.407 at p = 0.05 and 0.125 at p = 0.01, to the
/// digits printed there.
#[test]
fn val_odds_from_a_misfit_are_those_of_sellke() {
    for (p, bound) in [(0.05, 0.407), (0.01, 0.125)] {
        assert!((1.0 / odds_by_p_value(p) - bound).abs() < 5e-4, "{p}");
    }
}

/// A refuted nominal model, by one block perhaps, gives no name to an effect that explains less.
#[test]
fn regress_an_effect_without_evidence_is_not_named() {
    let (dataset, fit) = fitted();
    let candidate = |hypothesis, evidence: f64, probability| {
        let mut candidate = Candidate::new(hypothesis, fit.clone());
        candidate.fit.log_evidence = evidence;
        candidate.probability = probability;
        candidate
    };
    let fixture = Hypothesis::Effects(vec![EffectId::Fixture]);
    let mass = Hypothesis::Effects(vec![EffectId::AddedMass]);
    let answer_beside = |misfit: f64, evidence: f64, other: f64| {
        let candidates = [
            candidate(fixture.clone(), evidence, 0.98),
            candidate(mass.clone(), other, 0.01),
            candidate(Hypothesis::None, 0.0, 0.01),
        ];
        let stands = GoodnessOfFit::new(&dataset, &fit).unwrap();
        let mut refuted = stands.clone();
        refuted.overall = Some(misfit);
        verdict(
            &candidates,
            Some(&stands),
            Some(&refuted),
            &Thresholds::DEFAULT,
        )
    };
    let answer = |misfit, evidence| answer_beside(misfit, evidence, -5.0);
    assert_eq!(answer(1e-6, -3.6), Verdict::Unknown);
    // A detected effect that is refuted itself makes a model that stands no unknown one.
    assert_eq!(answer_beside(1e-6, 2.5, 6.0), Verdict::Unknown);
    assert_eq!(answer_beside(0.009, 2.5, 6.0), Verdict::NoGap);
    // One in 110: odds of 8 to 1 at most.
    assert_eq!(answer(0.009, -3.6), Verdict::NoGap);
    for misfit in [1e-6, 0.009] {
        let named = Verdict::Named(vec![EffectId::Fixture]);
        assert_eq!(answer(misfit, 20.0), named);
    }
}

/// A misfit of one in 200 does not refute the nominal model where nothing is more probable.
#[test]
fn limit_the_nominal_model_is_given_up_from_twenty_to_one() {
    let (dataset, fit) = fitted();
    let stands = GoodnessOfFit::new(&dataset, &fit).unwrap();
    let mass = Hypothesis::Effects(vec![EffectId::AddedMass]);
    let candidate = |hypothesis, evidence: f64, probability| {
        let mut candidate = Candidate::new(hypothesis, fit.clone());
        candidate.fit.log_evidence = evidence;
        candidate.probability = probability;
        candidate
    };
    let candidates = [
        candidate(Hypothesis::None, 0.0, 0.9),
        candidate(mass, 5.2, 0.1),
    ];
    for (misfit, expected) in [(5e-3, Verdict::NoGap), (1e-6, Verdict::Unknown)] {
        let mut tested = stands.clone();
        tested.overall = Some(misfit);
        let answer = verdict(
            &candidates,
            Some(&tested),
            Some(&tested),
            &Thresholds::DEFAULT,
        );
        assert_eq!(answer, expected, "{misfit}");
    }
}

/// However certain an effect is, a second cause beside it may not show.
#[test]
fn val_a_second_cause_that_does_not_show_has_its_share() {
    let (_, fit) = fitted();
    let candidate = |hypothesis, evidence: f64| {
        let mut candidate = Candidate::new(hypothesis, fit.clone());
        candidate.fit.log_evidence = evidence;
        candidate
    };
    let mass = Hypothesis::Effects(vec![EffectId::AddedMass]);
    let mut candidates = [
        candidate(Hypothesis::Unknown, 0.0),
        candidate(mass, 100.0),
        candidate(Hypothesis::None, 0.0),
    ];
    set_probabilities(&mut candidates, 0, &Thresholds::DEFAULT);
    let [mass, unknown, none] = [0, 1, 2].map(|k| candidates[k].probability);
    // 1 : 0.06, beside e^-100.
    assert!((mass - 1.0 / 1.06).abs() < 1e-12, "{mass}");
    assert!((unknown - 0.06 / 1.06).abs() < 1e-12, "{unknown}");
    assert!(none < 1e-40);
}

/// An effect of 76 % is there with 80.6 %, the second cause beside it included.
#[test]
fn limit_a_second_cause_leaves_an_effect_its_name() {
    let (dataset, fit) = fitted();
    let mut tested = GoodnessOfFit::new(&dataset, &fit).unwrap();
    tested.is_sized = true;
    let answer = |probability: f64| {
        let candidate = |hypothesis, evidence, probability| {
            let mut candidate = Candidate::new(hypothesis, fit.clone());
            candidate.fit.log_evidence = evidence;
            candidate.probability = probability;
            candidate
        };
        let mass = Hypothesis::Effects(vec![EffectId::AddedMass]);
        let candidates = [
            candidate(mass, 20.0, probability),
            candidate(Hypothesis::Unknown, 19.0, 1.0 - probability),
            candidate(Hypothesis::None, 0.0, 0.0),
        ];
        verdict(&candidates, Some(&tested), None, &Thresholds::DEFAULT)
    };
    assert_eq!(answer(0.76), Verdict::Named(vec![EffectId::AddedMass]));
    assert!(matches!(answer(0.75), Verdict::Set(_)));
}

/// Something unknown is an answer only where it is as probable as a name has to be.
#[test]
fn limit_something_unknown_that_is_not_established_is_listed() {
    let (dataset, fit) = fitted();
    let tested = GoodnessOfFit::new(&dataset, &fit).unwrap();
    let answer = |unknown: f64| {
        let candidate = |hypothesis, probability| {
            let mut candidate = Candidate::new(hypothesis, fit.clone());
            candidate.fit.log_evidence = 20.0;
            candidate.probability = probability;
            candidate
        };
        let mass = Hypothesis::Effects(vec![EffectId::AddedMass]);
        let mut candidates = [
            candidate(Hypothesis::Unknown, unknown),
            candidate(mass, 1.0 - unknown),
            candidate(Hypothesis::None, 0.0),
        ];
        candidates[2].fit.log_evidence = 0.0;
        verdict(&candidates, Some(&tested), None, &Thresholds::DEFAULT)
    };
    assert_eq!(answer(0.9), Verdict::Unknown);
    let mass = Hypothesis::Effects(vec![EffectId::AddedMass]);
    assert_eq!(answer(0.6), Verdict::Set(vec![Hypothesis::Unknown, mass]));
}
