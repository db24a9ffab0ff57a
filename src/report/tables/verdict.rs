//! The verdict of the diagnosis in a sentence or two: which effect, none, or that nobody can say.

use super::super::document::{GapSection, HypothesisSection, UnplacedSection};
use super::super::format::{probability, trimmed};
use super::hypotheses::{LEAST_PROBABILITY, left, percent, sizes};
use tapjoint_diagnosis::{DETECTED, MISFIT};

pub(super) fn verdict(gap: &GapSection, has_joint: bool) -> String {
    let odds = odds(gap).map_or_else(String::new, |odds| format!(" ({})", probability(odds)));
    let effects = gap.verdict.effects.join(", ");
    match gap.verdict.kind.as_str() {
        "no-gap" => no_gap(gap),
        "named" => {
            let size = named(gap).map_or_else(String::new, |found| format!(": {}", sizes(found)));
            let causes = match gap.verdict.effects.as_slice() {
                [first, second] => format!("two causes, {first} and {second}"),
                _ => format!("one cause, {effects}"),
            };
            format!("The data are consistent with {causes}{odds}{size}.")
        }
        "group" => {
            format!("The cause is one of {effects}{odds}; these data cannot tell them apart.")
        }
        "set" if gap.verdict.effects.len() == 1 => format!(
            "{effects} explains the readings best, but does not predict those that were kept from it any better: it \
             is not held for the cause."
        ),
        "set" => format!("The cause is most likely one of {effects}; these data do not decide."),
        "unknown" => unknown(gap, has_joint),
        _ => undecided(gap, has_joint),
    }
}

/// That the cause has no name, and what it looks like where two local changes would explain it.
fn unknown(gap: &GapSection, has_joint: bool) -> String {
    let likeness = |found: &&HypothesisSection| {
        matches!(
            found.effect.as_str(),
            "added-mass+local-crack" | "local-crack+added-mass"
        ) && found.goodness_of_fit.is_some_and(|p| p >= MISFIT)
            && found.probability >= LEAST_PROBABILITY
    };
    let likeness = gap
        .hypotheses
        .iter()
        .find(likeness)
        .map_or_else(String::new, |found| {
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
    let open = match first.filter(|first| first.effect != "none") {
        Some(_) => format!(
            " No effect is established: {:.0} to 1 against none is asked for.",
            DETECTED.exp()
        ),
        None => String::new(),
    };
    let of_none = gap.hypotheses.iter().find(|found| found.effect == "none");
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
fn by_moving(none: &HypothesisSection, floor: Option<f64>) -> String {
    let all = none.gap_before.zip(none.gap_after).zip(floor);
    match all.filter(|((before, after), floor)| *before > 2.0 * after.max(*floor)) {
        Some(((before, after), floor)) => format!(
            ", once joint, geometry and masses may differ from what is described by their tolerances and from recording \
             to recording (errors {} %; exactly as described {} %)",
            left(Some(after), Some(floor)),
            percent(Some(before))
        ),
        None => String::new(),
    }
}

/// Probability of `none` below which a gap counts as there.
const GAP: f64 = 0.1;

/// Whether the readings show a gap, be its cause known or not.
pub fn shows_gap(gap: &GapSection) -> bool {
    let mut all = gap.hypotheses.iter();
    let none = all.find(|found| found.effect == "none");
    misfit_unplaced(gap).is_some() || none.is_some_and(|none| none.probability < GAP)
}

/// What the model misses without masses that sat nobody knows where, if it does.
fn misfit_unplaced(gap: &GapSection) -> Option<&UnplacedSection> {
    let unplaced = gap.unplaced.as_ref();
    unplaced.filter(|one| one.goodness_of_fit < MISFIT)
}

/// That there is no answer, and what is known all the same.
fn undecided(gap: &GapSection, has_joint: bool) -> String {
    let reason = gap.verdict.reason.as_deref().unwrap_or("too few data");
    let of = |name: &str| gap.hypotheses.iter().find(|found| found.effect == name);
    let Some(none) = of("none") else {
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
            percent(none.gap_before),
            percent(gap.noise_floor),
        )
    } else {
        format!("These data do not decide whether there is a gap, nor what causes it: {reason}.")
    };
    if let Some(coupling) = of("cross-coupling").filter(|_| has_joint) {
        text.push_str(&format!(
            " A cross-coupling of the joint is not established ({}).",
            probability(coupling.probability)
        ));
    }
    text
}

/// How probable the verdict is: of a group its members together, be they single effects or pairs.
fn odds(gap: &GapSection) -> Option<f64> {
    if gap.verdict.kind != "group" {
        return named(gap).map(|found| found.probability);
    }
    let effects = &gap.verdict.effects;
    let total = |is_member: &dyn Fn(&str) -> bool| {
        let members = gap.hypotheses.iter().filter(|one| is_member(&one.effect));
        members.map(|one| one.probability).reduce(|a, b| a + b)
    };
    let is_in = |part: &str| effects.iter().any(|effect| effect == part);
    total(&is_in).or_else(|| total(&|pair| pair.split('+').all(is_in)))
}

/// The hypothesis that the verdict names.
pub(super) fn named(gap: &GapSection) -> Option<&HypothesisSection> {
    let name = match gap.verdict.kind.as_str() {
        "no-gap" => "none".to_owned(),
        _ => gap.verdict.joined(),
    };
    gap.hypotheses.iter().find(|found| found.effect == name)
}
