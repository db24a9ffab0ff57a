//! The verdict of the diagnosis in a sentence or two: which effect, none, or that nobody can say.

use super::super::document::GapSection;
use super::super::format::{probability, trimmed};
use super::hypotheses::{LEAST_PROBABILITY, left, names, percent, sizes};
use tapjoint_beam::effects::EffectId;
use tapjoint_diagnosis::{
    DETECTED, Hypothesis, HypothesisResult, MISFIT, UnlocatedSensors, Verdict,
};

pub(super) fn verdict(gap: &GapSection, has_joint: bool) -> String {
    let odds = odds(gap).map_or_else(String::new, |odds| format!(" ({})", probability(odds)));
    match &gap.verdict {
        Verdict::NoGap => no_gap(gap),
        Verdict::Named(effects) => {
            let size = gap.named().map(sizes);
            let size = size.map_or_else(String::new, |size| format!(": {size}"));
            let causes = match effects.as_slice() {
                [first, second] => format!("two causes, {} and {}", first.name(), second.name()),
                _ => format!("one cause, {}", names(effects)),
            };
            format!("The data are consistent with {causes}{odds}{size}.")
        }
        Verdict::Group(effects) => format!(
            "The cause is one of {}{odds}; these data cannot tell them apart.",
            names(effects)
        ),
        Verdict::Set(list) => {
            let effects: Vec<String> = list.iter().map(Hypothesis::name).collect();
            match effects.as_slice() {
                [effect] => format!(
                    "{effect} explains the readings best, but does not predict those that were kept from it any \
                     better: it is not held for the cause."
                ),
                _ => format!(
                    "The cause is most likely one of {}; these data do not decide.",
                    effects.join(", ")
                ),
            }
        }
        Verdict::Unknown => unknown(gap, has_joint),
        Verdict::NotEnoughData(reason) => undecided(gap, reason, has_joint),
    }
}

/// That the cause has no name, and what it looks like where two local changes would explain it.
fn unknown(gap: &GapSection, has_joint: bool) -> String {
    let is_likeness = |found: &&HypothesisResult| {
        use EffectId::{AddedMass, LocalCrack};
        let Hypothesis::Effects(effects) = &found.hypothesis else {
            return false;
        };
        matches!(
            effects.as_slice(),
            [AddedMass, LocalCrack] | [LocalCrack, AddedMass]
        ) && found.goodness_of_fit.is_some_and(|p| p >= MISFIT)
            && found.probability >= LEAST_PROBABILITY
    };
    let found = gap.hypotheses.iter().find(is_likeness);
    let likeness = found.map_or_else(String::new, |found| {
        format!(
            " A crack and a mass would explain it ({}), and so would any change that is spread over a part of \
             the beam: look there first.",
            sizes(found)
        )
    });
    let estimated = if has_joint {
        "the joint's stiffness"
    } else {
        "what is estimated"
    };
    format!(
        "Something is missing in the model, and nothing in the catalogue explains it alone: do not trust \
         {estimated} beyond the misfit.{likeness}"
    )
}

/// That nothing is missing, and why so even where an effect leads the table.
fn no_gap(gap: &GapSection) -> String {
    let first = gap.hypotheses.first();
    let open = match first.filter(|first| first.hypothesis != Hypothesis::None) {
        Some(_) => format!(
            " No effect is established: {:.0} to 1 against none is asked for.",
            DETECTED.exp()
        ),
        None => String::new(),
    };
    let of_none = gap.result(&Hypothesis::None);
    let misfit = of_none.and_then(|none| none.goodness_of_fit.filter(|p| *p < MISFIT));
    match misfit {
        Some(p) => format!(
            "No gap is established: the described model misses the frequencies by more than their uncertainty, as \
             chance would in {} of tests, but nothing else explains them better.{open}",
            probability(p)
        ),
        None => format!(
            "No gap: the described model explains the frequencies within their uncertainty{}.{open}",
            of_none.map_or_else(String::new, |none| by_moving(none, gap.noise_floor))
        ),
    }
}

/// What the described model itself leaves, where that is much more than the readings' uncertainty and than what is
/// left with a joint that may differ between recordings.
fn by_moving(none: &HypothesisResult, floor: Option<f64>) -> String {
    let left_over = none.gap_after.zip(floor);
    match left_over.filter(|(after, floor)| none.gap_before > 2.0 * after.max(*floor)) {
        Some((after, floor)) => format!(
            ", once joint, geometry and masses may differ from what is described by their tolerances and from recording \
             to recording (errors {} %; exactly as described {} %)",
            left(Some(after), Some(floor)),
            percent(Some(none.gap_before))
        ),
        None => String::new(),
    }
}

/// Probability of `none` below which a gap counts as there.
const GAP: f64 = 0.1;

/// Whether the readings show a gap, be its cause known or not.
pub fn shows_gap(gap: &GapSection) -> bool {
    let none = gap.result(&Hypothesis::None);
    misfit_unplaced(gap).is_some() || none.is_some_and(|none| none.probability < GAP)
}

/// What the model misses without masses that sat nobody knows where, if it does.
fn misfit_unplaced(gap: &GapSection) -> Option<&UnlocatedSensors> {
    let unplaced = gap.unplaced.as_ref();
    unplaced.filter(|one| one.goodness_of_fit < MISFIT)
}

/// That there is no answer, and what is known all the same.
fn undecided(gap: &GapSection, reason: &str, has_joint: bool) -> String {
    let Some(none) = gap.result(&Hypothesis::None) else {
        return format!("No diagnosis: {reason}.");
    };
    let mut text = if let Some(without) = misfit_unplaced(gap) {
        format!(
            "There is a gap: without the {} g of {}, which sat nobody knows where, the described model misses the \
             frequencies by {} % (rms), as chance would in {} of tests. These data cannot say what causes it: {reason}.",
            trimmed(1e3 * without.mass, 3),
            without.sensors.join(" and "),
            percent(Some(without.gap)),
            probability(without.goodness_of_fit),
        )
    } else if none.probability < GAP {
        format!(
            "There is a gap ({}): the described model{} misses the frequencies by {} % (rms), where their \
             uncertainty is {} %. These data cannot say what causes it: {reason}.",
            probability(1.0 - none.probability),
            if has_joint {
                " with its joint refitted"
            } else {
                ""
            },
            percent(Some(none.gap_before)),
            percent(gap.noise_floor),
        )
    } else {
        format!("These data do not decide whether there is a gap, nor what causes it: {reason}.")
    };
    let coupling = gap.result(&Hypothesis::Effects(vec![EffectId::CrossCoupling]));
    if let Some(coupling) = coupling.filter(|_| has_joint) {
        text.push_str(&format!(
            " A cross-coupling of the joint is not established ({}).",
            probability(coupling.probability)
        ));
    }
    text
}

/// How probable the verdict is: of a group its members together, be they single effects or pairs.
fn odds(gap: &GapSection) -> Option<f64> {
    let Verdict::Group(group) = &gap.verdict else {
        return gap.named().map(|found| found.probability);
    };
    let total = |single: bool| {
        let members = gap
            .hypotheses
            .iter()
            .filter(|found| match &found.hypothesis {
                Hypothesis::Effects(effects) => {
                    (!single || effects.len() == 1) && effects.iter().all(|one| group.contains(one))
                }
                _ => false,
            });
        members.map(|one| one.probability).reduce(|a, b| a + b)
    };
    total(true).or_else(|| total(false))
}
