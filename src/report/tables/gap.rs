//! The gap between model and measurement, in sentences.

use std::collections::BTreeMap;

use super::super::document::{
    ClosureSection, Document, GapSection, HypothesisSection, PullSection,
};
use super::super::format::{RIGID, prefix, probability, signed_percent, significant, trimmed};
use super::has_joint;
use super::hypotheses::{LEAST_PROBABILITY, left, percent, sizes};
use super::next_tests::next_test;
use crate::gap::{MISFIT, SEEN};
use crate::stats::times;

/// The diagnosis as a story of three parts: where, which, how far. Empty without one.
pub fn gap_story(document: &Document) -> Vec<String> {
    let Some(gap) = &document.gap else {
        return Vec::new();
    };
    let mut story = vec![verdict(gap, has_joint(document))];
    story.extend(place(document, gap));
    story.extend(how_far(gap, has_joint(document)));
    story.extend(price(gap));
    story.extend(along_decays(gap));
    story.extend(next_test(gap));
    story
}

fn verdict(gap: &GapSection, has_joint: bool) -> String {
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
            SEEN.exp()
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
            "No gap: the described model explains the frequencies within their uncertainty.{open}"
        ),
    }
}

/// Probability of `none` below which a gap counts as there.
const GAP: f64 = 0.1;

/// That there is no answer, and what is known all the same.
fn undecided(gap: &GapSection, has_joint: bool) -> String {
    let reason = gap.verdict.reason.as_deref().unwrap_or("too few data");
    let of = |name: &str| gap.hypotheses.iter().find(|found| found.effect == name);
    let Some(none) = of("none") else {
        return format!("No diagnosis: {reason}.");
    };
    let without = gap
        .unplaced
        .as_ref()
        .filter(|one| one.goodness_of_fit < MISFIT);
    let mut text = if let Some(without) = without {
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
fn named(gap: &GapSection) -> Option<&HypothesisSection> {
    let name = match gap.verdict.kind.as_str() {
        "no-gap" => "none".to_owned(),
        _ => gap.verdict.effects.join("+"),
    };
    gap.hypotheses.iter().find(|found| found.effect == name)
}

/// Where, unless there is no gap; the probabilities take for granted that something is missing.
fn place(document: &Document, gap: &GapSection) -> Option<String> {
    if matches!(gap.verdict.kind.as_str(), "no-gap" | "not-enough-data") {
        return None;
    }
    let place = gap.place.as_ref()?;
    let mut places: Vec<(&String, &f64)> = place.probability.iter().collect();
    places.sort_by(|a, b| b.1.total_cmp(a.1));
    let listed: Vec<String> = places
        .iter()
        .take(3)
        .filter(|(_, p)| **p >= 0.01)
        .map(|(name, p)| format!("{name}{} {}", sensors_at(document, name), probability(**p)))
        .collect();
    let worst = place
        .modes
        .iter()
        .max_by(|a, b| a.z.abs().total_cmp(&b.z.abs()))?;
    Some(format!(
        "Where, if something is missing: {}. Largest misfit for its uncertainty: mode {} in {}, {} % ({} standard deviations).",
        listed.join(", "),
        worst.mode,
        place_of(worst),
        change(worst.error_percent, 3),
        times(worst.z)
    ))
}

/// " (A at 338 mm)" behind the place "sensor", without the position of one that moves; nothing behind other
/// places, and where too many sensors may be meant.
fn sensors_at(document: &Document, place: &str) -> String {
    const MOST: usize = 3;
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let mut sensors: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (name, position) in recordings.iter().flat_map(|one| &one.sensor_positions) {
        sensors.entry(name).or_default().push(*position);
    }
    if place != "sensor" || sensors.is_empty() || sensors.len() > MOST {
        return String::new();
    }
    let named = sensors.iter().map(|(name, places)| {
        let first = places[0];
        match places.iter().all(|place| *place == first) {
            true => format!("{name} at {} mm", trimmed(1e3 * first, 4)),
            false => format!("{name}, which was moved"),
        }
    });
    format!(" ({})", named.collect::<Vec<_>>().join("; "))
}

/// "high.wav", or "high.wav (level 0.73)" where its taps were softer than the hardest.
pub fn place_of(pull: &PullSection) -> String {
    match pull.level {
        Some(level) if level < 0.999 => format!("{} (level {level:.2})", pull.recording),
        _ => pull.recording.clone(),
    }
}

/// A change with its sign, and a minus sign for a hyphen.
fn change(value: f64, decimals: usize) -> String {
    format!("{value:+.decimals$}").replace('-', "\u{2212}")
}

/// How far the errors shrink, where an effect is held for the cause.
fn how_far(gap: &GapSection, has_joint: bool) -> Option<String> {
    let kind = gap.verdict.kind.as_str();
    if matches!(kind, "no-gap" | "unknown" | "not-enough-data") {
        return None;
    }
    let found = named(gap).or_else(|| {
        gap.hypotheses
            .iter()
            .find(|found| !matches!(found.effect.as_str(), "none" | "unknown"))
    })?;
    let shrink = match found.gap_before.zip(found.gap_after) {
        Some((before, after)) if after >= before => "go",
        _ => "shrink",
    };
    let mut text = format!(
        "How far: with {} the errors {shrink} from {} to {} % (rms over fitted frequencies)",
        found.effect,
        percent(found.gap_before),
        left(found.gap_after, gap.noise_floor),
    );
    text.push_str(&by_drift(gap, found, has_joint));
    if let Some((before, after)) = found.withheld_before.zip(found.withheld_after) {
        text.push_str(&format!(
            "; on frequencies that took no part from {} to {} %",
            percent(Some(before)),
            left(Some(after), gap.noise_floor)
        ));
    }
    if let Some(closure) = &found.closure {
        text.push_str(&share(closure));
    }
    if let Some(left_out) = &found.left_out_recordings {
        text.push_str(&format!(
            "; on recordings predicted from the others from {} to {} %",
            percent(Some(left_out.before)),
            left(Some(left_out.after), gap.noise_floor)
        ));
        if let Some(closure) = &left_out.closure {
            text.push_str(&share(closure));
        }
    }
    let floor = percent(gap.noise_floor);
    let outside = found.gap_before.zip(gap.noise_floor);
    Some(match outside.filter(|(before, floor)| before < floor) {
        Some(_) => format!(
            "{text}. Their uncertainty is {floor} %: the cause shows elsewhere, not in the mean frequencies."
        ),
        None => format!("{text}; noise would leave {floor} %."),
    })
}

/// What is left where nothing is added, if the tolerances, and a joint's drift between recordings, explain half of the
/// errors.
fn by_drift(gap: &GapSection, found: &HypothesisSection, has_joint: bool) -> String {
    let none = gap.hypotheses.iter().find(|one| one.effect == "none");
    let remains = none.and_then(|none| none.gap_after);
    match remains.zip(found.gap_before) {
        Some((remains, before)) if remains < 0.5 * before => format!(
            ", where {}the tolerances leave {} %",
            if has_joint {
                "a joint that drifts and "
            } else {
                ""
            },
            left(Some(remains), gap.noise_floor)
        ),
        _ => String::new(),
    }
}

/// ", 97 % of the gap (95 %: 93 to 99)".
fn share(closure: &ClosureSection) -> String {
    format!(
        ", {:.0} % of the gap (95 %: {:.0} to {:.0})",
        100.0 * closure.value,
        100.0 * closure.low,
        100.0 * closure.high
    )
}

/// What the decays say by themselves, where the verdict does not already say it.
fn along_decays(gap: &GapSection) -> Option<String> {
    let found = gap.along_decays.as_ref()?;
    let largest = found.changes.iter().max_by(|a, b| {
        (a.percent_per_fold / a.std)
            .abs()
            .total_cmp(&(b.percent_per_fold / b.std).abs())
    })?;
    let seen = format!(
        "Along the decays frequencies change with amplitude (mode {} in {} by {} % per factor e)",
        largest.mode,
        largest.recording,
        change(largest.percent_per_fold, 3)
    );
    let Some(effect) = &found.effect else {
        return Some(format!(
            "{seen}, but not as a joint whose stiffness depends on the amplitude would make them."
        ));
    };
    if gap.verdict.effects.contains(effect) {
        return None;
    }
    let direction = if found.ratio < 0.0 {
        "softens"
    } else {
        "stiffens"
    };
    let size = if found.lawful && found.at_bound {
        format!(
            "its rotational stiffness changes by {:.0} % or more at the largest amplitude",
            100.0 * found.ratio.abs()
        )
    } else if found.lawful {
        format!(
            "its rotational stiffness changes by {} \u{b1} {:.1} % at the largest amplitude",
            change(100.0 * found.ratio, 1),
            100.0 * found.ratio_std
        )
    } else {
        "modes that hardly turn it change too, so that its rotation alone does not say by how much"
            .to_owned()
    };
    Some(format!(
        "{seen}: the joint {direction} ({effect}); {size}. That is said by the decays alone and explains \
         no misfit of the frequencies."
    ))
}

/// What ignoring the effect costs; `None` where none is named.
fn price(gap: &GapSection) -> Option<String> {
    let found = named(gap).filter(|found| found.effect != "none")?;
    let part = |name: &str, shift: Option<f64>| {
        Some(format!("{name} by {} %", signed_percent(Some(shift?))))
    };
    let parts: Vec<String> = [
        part("Kx", found.joint_shift.kx_percent),
        part("Ky", found.joint_shift.ky_percent),
    ]
    .into_iter()
    .flatten()
    .collect();
    if parts.is_empty() {
        return None;
    }
    let moves = parts.join(", ");
    Some(match found.joint {
        Some([kt, kr]) => format!(
            "With it the joint is Kt = {}, Kr = {} ({moves} against the joint without it).",
            stiffness(kt, "N/m"),
            stiffness(kr, "N\u{a0}m/rad")
        ),
        None => format!("Adding it moves the joint: {moves}."),
    })
}

/// "1.995 MN/m", on one line.
fn stiffness(value: f64, unit: &str) -> String {
    if value.is_infinite() {
        return RIGID.to_owned();
    }
    let (factor, letter) = prefix(value);
    format!("{}\u{a0}{letter}{unit}", significant(factor * value, 4))
}
