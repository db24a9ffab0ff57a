//! From probabilities to an answer, or to none.

use super::doubt::most_against;
use super::posterior::{APART, Entry, by_group, lead};
use super::result::{Hypothesis, Verdict};
use super::trial::Trial;
use tapjoint_beam::effects::EffectId;

/// Probability from which a name is given.
const NAMED: f64 = 0.8;
/// Probability that a set has to hold, and the longest one that is still short.
const SET: (f64, usize) = (0.9, 4);

/// Logarithm of the Bayes factor against the nominal model from which an effect counts as seen: 20 to 1
/// (Kass & Raftery 1995, "strong").
pub const SEEN: f64 = 3.0;

/// The verdict on a ranking.
pub(super) fn verdict(entries: &[Entry], trial: Option<&Trial>, none: Option<&Trial>) -> Verdict {
    // Many weak hypotheses share out the probability; together they are no effect either.
    // Nor does a misfit that says less against the nominal model than an effect has to say for itself.
    let against = none.and_then(Trial::refuting).map_or(1.0, most_against);
    let refuted = against >= SEEN.exp();
    if !refuted && most_over_none(entries) < SEEN {
        return Verdict::NoGap;
    }
    let groups = by_group(entries);
    let first = &entries[groups[0].0[0]];
    if first.hypothesis == Hypothesis::Unknown || trial.is_some_and(Trial::refuted) {
        return Verdict::Unknown;
    }
    // An effect too small to matter always competes with its absence; where nothing explains the
    // readings better than the nominal model, there is no gap.
    if first.hypothesis == Hypothesis::None {
        return Verdict::NoGap;
    }
    // What refutes the nominal model makes no effect probable that explains the readings less well; where
    // it stands, what alone would have shown has been refuted itself.
    if evidence_over_none(entries, first) < SEEN {
        return if refuted {
            Verdict::Unknown
        } else {
            Verdict::NoGap
        };
    }
    // With as many unknowns as readings everything fits.
    let Some(trial) = trial.filter(|trial| trial.goodness.is_some()) else {
        return Verdict::NotEnoughData(
            "as many unknowns as readings: no explanation can be tested; observe more modes, or in \
             another configuration"
                .to_owned(),
        );
    };
    if let Some(room) = trial.room.filter(|room| room.is_crowded()) {
        return Verdict::NotEnoughData(format!(
            "{} has with the joint {} parameters for {} readings of different kind, which other causes would \
             explain as well; observe more modes, or move a sensor",
            first.hypothesis.name(),
            room.parameters,
            room.readings
        ));
    }
    let holds = trial.holds() && (first.effects().len() < 2 || trial.improves());
    if groups[0].1 >= NAMED && holds {
        return name_of(entries, &groups[0].0);
    }
    let aliases = alias_group(entries);
    if aliases.len() > 1
        && aliases.iter().map(|&k| entries[k].probability).sum::<f64>() >= NAMED
        && holds
    {
        return Verdict::Group(
            aliases
                .iter()
                .flat_map(|&k| entries[k].effects().to_vec())
                .collect(),
        );
    }
    set_of(entries, &groups)
}

/// Logarithm of the largest Bayes factor against the nominal model.
fn most_over_none(entries: &[Entry]) -> f64 {
    let over = entries
        .iter()
        .map(|entry| evidence_over_none(entries, entry));
    over.fold(f64::NEG_INFINITY, f64::max)
}

/// Logarithm of the Bayes factor of one hypothesis against the nominal model.
fn evidence_over_none(entries: &[Entry], entry: &Entry) -> f64 {
    let is_none = |entry: &&Entry| entry.hypothesis == Hypothesis::None;
    let none = entries.iter().find(is_none);
    none.map_or(f64::INFINITY, |none| {
        entry.fit.log_evidence - none.fit.log_evidence
    })
}

/// One effect by name; a group whose members the readings do not separate as a group.
fn name_of(entries: &[Entry], members: &[usize]) -> Verdict {
    let total: f64 = members.iter().map(|&k| entries[k].probability).sum();
    let first = &entries[members[0]];
    if first.probability >= NAMED * total || members.len() == 1 {
        return Verdict::Named(first.effects().to_vec());
    }
    let likely = members
        .iter()
        .filter(|&&k| entries[k].probability > 0.02 * total);
    Verdict::Group(
        likely
            .flat_map(|&k| entries[k].effects().to_vec())
            .collect::<Vec<EffectId>>(),
    )
}

/// The first entry and the single effects after it that fit as well.
fn alias_group(entries: &[Entry]) -> Vec<usize> {
    let Some(first) = entries.iter().position(|entry| entry.effects().len() == 1) else {
        return Vec::new();
    };
    (0..entries.len())
        .filter(|&k| {
            entries[k].effects().len() == 1
                && entries[k].probability > 0.02
                && lead(&entries[first].fit, &entries[k].fit).abs() < APART
        })
        .collect()
}

/// The shortest list of groups that holds 90 %, each with its likely members.
fn set_of(entries: &[Entry], groups: &[(Vec<usize>, f64)]) -> Verdict {
    let mut held = 0.0;
    let mut set = Vec::new();
    let mut counted = 0;
    for (members, probability) in groups {
        // A group is one of its members, and which one the readings need not know.
        let likely = members
            .iter()
            .filter(|&&k| entries[k].probability > 0.02 * probability);
        set.extend(likely.map(|&k| entries[k].hypothesis.clone()));
        held += probability;
        counted += 1;
        if held >= SET.0 {
            break;
        }
    }
    if counted <= SET.1 {
        Verdict::Set(set)
    } else {
        Verdict::NotEnoughData(format!(
            "{counted} explanations are needed to hold {:.0} % of the probability; more readings of another kind \
             would separate them",
            100.0 * SET.0
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::super::example::fitted;
    use super::*;

    /// What refutes the nominal model, one block perhaps, gives no name to an effect that explains less.
    #[test]
    fn regress_an_effect_without_evidence_is_not_named() {
        let (frame, fit) = fitted();
        let entry = |hypothesis, evidence: f64, probability| {
            let mut entry = Entry::new(hypothesis, fit.clone());
            entry.fit.log_evidence = evidence;
            entry.probability = probability;
            entry
        };
        let fixture = Hypothesis::Effects(vec![EffectId::Fixture]);
        let mass = Hypothesis::Effects(vec![EffectId::AddedMass]);
        let answer_beside = |misfit: f64, evidence: f64, other: f64| {
            let entries = [
                entry(fixture.clone(), evidence, 0.98),
                entry(mass.clone(), other, 0.01),
                entry(Hypothesis::None, 0.0, 0.01),
            ];
            let stands = Trial::new(&frame, &fit).unwrap();
            let mut refuted = stands.clone();
            refuted.goodness = Some(misfit);
            verdict(&entries, Some(&stands), Some(&refuted))
        };
        let answer = |misfit, evidence| answer_beside(misfit, evidence, -5.0);
        assert_eq!(answer(1e-6, -3.6), Verdict::Unknown);
        // What shows, were it not refuted itself, makes a model that stands no unknown one.
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
