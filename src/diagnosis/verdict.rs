//! The verdict: from probabilities to an answer, or to none.

use crate::goodness_of_fit::GoodnessOfFit;
use crate::posterior::{
    Candidate, CandidateGroup, by_group, delta_chi_square, none_of, odds_by_p_value,
};
use crate::result::{Hypothesis, Verdict};
use crate::thresholds::{
    DETECTED, LISTED_SHARE, LONGEST_SET, NAMED_PROBABILITY, SEPARATE, SET_PROBABILITY,
};
use tapjoint_beam::effects::EffectId;

/// Returns the verdict on a ranking, with the tests of its best explanation and of the nominal model.
pub fn verdict(
    candidates: &[Candidate],
    tested: Option<&GoodnessOfFit>,
    none: Option<&GoodnessOfFit>,
) -> Verdict {
    // Many weak hypotheses share out the probability; together they are no effect either.
    // Neither is a misfit that speaks less against the nominal model than an effect has to speak for itself.
    let p_value = none.and_then(GoodnessOfFit::refuting_p_value);
    let is_refuted = p_value.map_or(1.0, odds_by_p_value) >= DETECTED.exp();
    let over_none = candidates.iter();
    let over_none = over_none.map(|one| evidence_over_none(candidates, one));
    if !is_refuted && over_none.fold(f64::NEG_INFINITY, f64::max) < DETECTED {
        return Verdict::NoGap;
    }
    let groups = by_group(candidates);
    let first = &candidates[groups[0].members[0]];
    if first.is_unknown() || tested.is_some_and(GoodnessOfFit::is_refuted) {
        return Verdict::Unknown;
    }
    // An effect too small to matter always competes with its absence; if no effect explains the
    // data better than the nominal model, there is no gap.
    if first.hypothesis == Hypothesis::None {
        return Verdict::NoGap;
    }
    // A refuted nominal model makes no effect probable that explains the data less well; if
    // it stands, the effects that alone would have been detected are refuted themselves.
    if evidence_over_none(candidates, first) < DETECTED {
        return if is_refuted {
            Verdict::Unknown
        } else {
            Verdict::NoGap
        };
    }
    // With as many parameters as data everything fits.
    let Some(tested) = tested.filter(|tested| tested.overall.is_some()) else {
        return Verdict::NotEnoughData(
            "as many unknowns as readings: no explanation can be tested; observe more modes, or in \
             another configuration"
                .to_owned(),
        );
    };
    if let Some(freedom) = tested.freedom.filter(|freedom| freedom.are_too_few()) {
        return Verdict::NotEnoughData(format!(
            "{} has with the joint {} parameters for {} readings of different kind, which other causes would \
             explain as well; observe more modes, or move a sensor",
            first.hypothesis.name(),
            freedom.parameters,
            freedom.data
        ));
    }
    let holds = tested.passes_holdout() && (first.effects().len() < 2 || tested.improves_holdout());
    if groups[0].probability >= NAMED_PROBABILITY && holds {
        return name_of(candidates, &groups[0].members);
    }
    let aliases = aliases_of_first(candidates);
    let together: f64 = aliases.iter().map(|&k| candidates[k].probability).sum();
    if aliases.len() > 1 && together >= NAMED_PROBABILITY && holds {
        return Verdict::Group(effects_of(candidates, &aliases));
    }
    set_of(candidates, &groups)
}

/// Returns the logarithm of the Bayes factor of one hypothesis against the nominal model.
fn evidence_over_none(candidates: &[Candidate], candidate: &Candidate) -> f64 {
    none_of(candidates).map_or(f64::INFINITY, |none| {
        candidate.fit.log_evidence - none.fit.log_evidence
    })
}

fn effects_of(candidates: &[Candidate], members: &[usize]) -> Vec<EffectId> {
    let members = members.iter();
    members
        .flat_map(|&k| candidates[k].effects().to_vec())
        .collect()
}

/// Returns the members with a share of the probability of all.
fn likely(candidates: &[Candidate], members: &[usize], all: f64) -> Vec<usize> {
    let members = members.iter().copied();
    members
        .filter(|&k| candidates[k].probability > LISTED_SHARE * all)
        .collect()
}

/// Names one effect; a group whose members the data do not separate as a group.
fn name_of(candidates: &[Candidate], members: &[usize]) -> Verdict {
    let total: f64 = members.iter().map(|&k| candidates[k].probability).sum();
    let first = &candidates[members[0]];
    if first.probability >= NAMED_PROBABILITY * total || members.len() == 1 {
        return Verdict::Named(first.effects().to_vec());
    }
    Verdict::Group(effects_of(candidates, &likely(candidates, members, total)))
}

/// Returns the first single effect and those after it that fit as well.
fn aliases_of_first(candidates: &[Candidate]) -> Vec<usize> {
    let singles = (0..candidates.len()).filter(|&k| candidates[k].effects().len() == 1);
    let singles: Vec<usize> = singles.collect();
    let Some(&first) = singles.first() else {
        return Vec::new();
    };
    let mut aliases = likely(candidates, &singles, 1.0);
    aliases
        .retain(|&k| delta_chi_square(&candidates[first].fit, &candidates[k].fit).abs() < SEPARATE);
    aliases
}

/// Returns the shortest list of groups that holds 90 %, each with its likely members.
fn set_of(candidates: &[Candidate], groups: &[CandidateGroup]) -> Verdict {
    let mut held = 0.0;
    let mut set = Vec::new();
    let mut counted = 0;
    for group in groups {
        // A group is one of its members, and the data need not decide which one.
        let members = likely(candidates, &group.members, group.probability);
        set.extend(members.iter().map(|&k| candidates[k].hypothesis.clone()));
        held += group.probability;
        counted += 1;
        if held >= SET_PROBABILITY {
            break;
        }
    }
    if counted <= LONGEST_SET {
        Verdict::Set(set)
    } else {
        Verdict::NotEnoughData(format!(
            "{counted} explanations are needed to hold {:.0} % of the probability; more readings of another kind \
             would separate them",
            100.0 * SET_PROBABILITY
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fitted;

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
            verdict(&candidates, Some(&stands), Some(&refuted))
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
}
