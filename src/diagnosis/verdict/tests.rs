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
        is_of_set_up: false,
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

/// An error of the set-up hardly moves frequencies: these may be predicted worse than before, but within the
/// uncertainty of the prediction.
#[test]
fn limit_frequencies_cannot_refute_an_error_of_the_set_up_that_does_not_move_them() {
    for (withheld, is_of_set_up, holds) in [
        (0.5, false, false),
        (0.5, true, true),
        // Below the least probability of a prediction.
        (0.01, true, false),
    ] {
        let found = GoodnessOfFit {
            is_of_set_up,
            ..tested(withheld, false, [-17.0, -17.0])
        };
        assert_eq!(found.passes_holdout(), holds, "{withheld} {is_of_set_up}");
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

/// Returns these hypotheses with the logarithms of their evidence, all of one fit.
fn candidates_of(fit: &Fit, all: &[(Hypothesis, f64)]) -> Vec<Candidate> {
    let all = all.iter().map(|(hypothesis, log_evidence)| {
        let mut candidate = Candidate::new(hypothesis.clone(), fit.clone());
        candidate.fit.log_evidence = *log_evidence;
        candidate
    });
    all.collect()
}

fn probability_of(candidates: &[Candidate], hypothesis: &Hypothesis) -> f64 {
    let mut all = candidates.iter();
    let found = all.find(|one| one.hypothesis == *hypothesis);
    found.map_or(0.0, |one| one.probability)
}

/// However certain an effect is, a second cause beside it may not show. Without `unknown` there is no place for it, and with a
/// weight of 0 or less there is none.
#[test]
fn val_a_second_cause_that_does_not_show_has_its_share() {
    let (_, fit) = fitted();
    let mass = Hypothesis::Effects(vec![EffectId::AddedMass]);
    let all = [
        (mass.clone(), 100.0),
        (Hypothesis::None, 0.0),
        (Hypothesis::Unknown, 0.0),
    ];
    for (count, weight, expected) in [
        (3, 0.06, 1.0 / 1.06),
        (2, 0.06, 1.0),
        (3, 0.0, 1.0),
        (3, -1.0, 1.0),
    ] {
        let thresholds = Thresholds {
            hidden_second: weight,
            ..Thresholds::DEFAULT
        };
        let mut candidates = candidates_of(&fit, &all[..count]);
        set_probabilities(&mut candidates, 0, &thresholds);
        let found = probability_of(&candidates, &mass);
        // Beside e^-100: rounding.
        assert!(
            (found - expected).abs() < 1e-12,
            "{count} {weight}: {found}"
        );
        // The place of the mass is that of the effect, and for half of the second cause.
        let places = location_probabilities(&candidates, &thresholds);
        let half = 0.5 * (1.0 - expected);
        assert!(
            (places.body - expected - half).abs() < 1e-12,
            "{count} {weight}: {places:?}"
        );
        assert!(
            (places.unknown - half).abs() < 1e-12,
            "{count} {weight}: {places:?}"
        );
    }
}

/// The name's limit of 80 % includes a second cause. Where that has no place, the effect itself needs 80 %.
#[test]
fn limit_a_second_cause_leaves_an_effect_its_name() {
    let (dataset, fit) = fitted();
    let mut tested = GoodnessOfFit::new(&dataset, &fit).unwrap();
    tested.is_sized = true;
    let mass = Hypothesis::Effects(vec![EffectId::AddedMass]);
    let crack = Hypothesis::Effects(vec![EffectId::LocalCrack]);
    // The crack takes what the mass lacks; both have the prior of one group.
    for (share, with_unknown, is_named) in [
        (0.81, true, true),
        (0.79, true, false),
        (0.81, false, true),
        (0.79, false, false),
    ] {
        let evidence = 20.0 + f64::ln((1.0 - share) / share);
        let all = [
            (mass.clone(), 20.0),
            (crack.clone(), evidence),
            (Hypothesis::None, 0.0),
            (Hypothesis::Unknown, 0.0),
        ];
        let count = if with_unknown { 4 } else { 3 };
        let mut candidates = candidates_of(&fit, &all[..count]);
        set_probabilities(&mut candidates, 0, &Thresholds::DEFAULT);
        let answer = verdict(&candidates, Some(&tested), None, &Thresholds::DEFAULT);
        let expected = Verdict::Named(vec![EffectId::AddedMass]);
        assert_eq!(
            answer == expected,
            is_named,
            "{share} {with_unknown}: {answer:?}"
        );
    }
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
