//! The gap between model and measurement, in sentences: the verdict, where, how far, what to do next.

use std::collections::BTreeMap;

use super::sizes::{left, percent, sizes, stiffness_with_limits};
use crate::document::{Document, GapSection};
use crate::format::{capital, probability, rounded, signed_percent, significant, trimmed};
use tapjoint_beam::effects::{EffectId, Group, Place};
use tapjoint_diagnosis::{
    Closure, CommonFactor, Hypothesis, HypothesisResult, NextTest, Proposal, Residual, Thresholds,
    UnlocatedSensors, Verdict,
};
use tapjoint_numerics::stats::{NORMAL_95, times};

/// The diagnosis as a story of three parts: where, which, how far. Empty without one.
pub fn gap_story(document: &Document) -> Vec<String> {
    let Some(gap) = &document.gap else {
        return Vec::new();
    };
    let mut story = vec![verdict(gap, document.has_joint())];
    story.extend(place(document, gap));
    story.extend(how_far(gap, document.has_joint()));
    story.extend(price(gap));
    story.extend(along_decays(gap));
    story.extend(next_test(gap));
    story
}

/// Returns the likely places of a gap and the worst misfit, unless there is none; the probabilities take for granted that something is missing.
fn place(document: &Document, gap: &GapSection) -> Option<String> {
    if matches!(gap.verdict, Verdict::NoGap | Verdict::NotEnoughData(_)) {
        return None;
    }
    let place = gap.place.as_ref()?;
    let places = place.probability.ranked().into_iter().take(3);
    let listed: Vec<String> = places
        .filter(|(_, p)| *p >= 0.01)
        .map(|(place, p)| match place {
            Some(Place::Sensor) => {
                format!("sensor{} {}", sensors_at(document, gap), probability(p))
            }
            Some(place) => format!("{} {}", place.name(), probability(p)),
            None => format!("unknown {}", probability(p)),
        })
        .collect();
    let worst = place
        .modes
        .iter()
        .max_by(|a, b| a.z.abs().total_cmp(&b.z.abs()))?;
    let places = match place.probability.unknown > 0.95 {
        true => "The place of the cause is not known.".to_owned(),
        false => format!("Where, if something is missing: {}.", listed.join(", ")),
    };
    Some(format!(
        "{places} Exactly as described, the model misses mode {} in {} most, relative to the uncertainty: {} % ({} standard deviations).",
        worst.mode,
        place_of(worst),
        change(worst.error_percent, 3),
        times(worst.z)
    ))
}

/// " (A at 338 mm)" behind the place "sensor", without the position of one that moves; nothing where too many sensors
/// may be meant. An unknown mass is that of sensors whose mass is not stated.
fn sensors_at(document: &Document, gap: &GapSection) -> String {
    const MOST: usize = 3;
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let mut effects = gap
        .hypotheses
        .iter()
        .filter_map(|found| match &found.hypothesis {
            Hypothesis::Effects(effects) => Some(effects),
            _ => None,
        });
    // The first of them whose first effect sits at a sensor.
    let at_sensor = effects.find(|effects| {
        let first = effects.first();
        first.is_some_and(|effect| effect.place() == Place::Sensor)
    });
    let by_mass = at_sensor.is_some_and(|effects| effects.as_slice() == [EffectId::SensorMass]);
    let mut sensors: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for one in recordings {
        for (name, position) in &one.conditions.sensor_positions {
            let weighed = one
                .conditions
                .sensor_masses
                .get(name)
                .is_some_and(|mass| *mass > 0.0);
            if !(by_mass && weighed) {
                sensors.entry(name).or_default().push(*position);
            }
        }
    }
    if sensors.is_empty() || sensors.len() > MOST {
        return String::new();
    }
    let mut named = Vec::new();
    for (name, places) in sensors {
        let moved = places.iter().any(|place| *place != places[0]);
        named.push(match moved {
            true => format!("{name}, which was moved"),
            false => format!("{name} at {} mm", trimmed(1e3 * places[0], 4)),
        });
    }
    format!(" ({})", named.join("; "))
}

/// "high.wav", or "high.wav (level 0.73)" where its taps were softer than the hardest.
pub fn place_of(pull: &Residual) -> String {
    match pull.level {
        Some(level) if level < 0.999 => format!("{} (level {level:.2})", pull.recording),
        _ => pull.recording.clone(),
    }
}

/// A change with its sign, and a minus sign for a hyphen.
fn change(value: f64, decimals: usize) -> String {
    format!("{value:+.decimals$}").replace('-', "\u{2212}")
}

/// Tells how far the errors shrink, where an effect is probably the cause.
fn how_far(gap: &GapSection, has_joint: bool) -> Option<String> {
    if !matches!(
        gap.verdict,
        Verdict::Named(_) | Verdict::Group(_) | Verdict::Set(_)
    ) {
        return None;
    }
    let mut all = gap.hypotheses.iter();
    let first = all.find(|found| matches!(found.hypothesis, Hypothesis::Effects(_)));
    let found = gap.named().or(first)?;
    let shrink = match (found.gap_before, found.gap_after) {
        (Some(before), Some(after)) if after >= before => "go",
        _ => "shrink",
    };
    let mut text = format!(
        "How far: with {} the errors {shrink} from {} (exactly as described) to {} % (rms over fitted frequencies)",
        together(&found.hypothesis),
        percent(found.gap_before),
        left(found.gap_after, gap.noise_floor),
    );
    // The errors that are left where nothing is added. They are stated if the tolerances, and a joint's drift between
    // recordings, explain half of the errors.
    let none = gap.result(&Hypothesis::None);
    let remains = none.and_then(|none| none.gap_after).filter(|remains| {
        found
            .gap_before
            .is_some_and(|before| *remains < 0.5 * before)
    });
    let without = remains.map_or_else(String::new, |remains| {
        format!(
            " Without it, {}the tolerances of the description leave {} %.",
            if has_joint {
                "a drift of the joint and "
            } else {
                ""
            },
            left(Some(remains), gap.noise_floor)
        )
    });
    if let Some((before, after)) = found.holdout_before.zip(found.holdout_after) {
        text.push_str(&format!(
            "; on withheld frequencies from {} to {} %",
            percent(Some(before)),
            left(Some(after), gap.noise_floor)
        ));
    }
    if let Some(closure) = &found.withheld_closure {
        text.push_str(&share(closure));
    }
    if let Some((before, after)) = found.spare_before.zip(found.spare_after) {
        text.push_str(&format!(
            "; on frequencies that took no part in this choice from {} to {} %",
            percent(Some(before)),
            left(Some(after), gap.noise_floor)
        ));
    }
    if let Some(closure) = &found.closure {
        text.push_str(&share(closure));
    }
    if let Some(left_out) = &found.cross_validation {
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
    let outside = gap
        .noise_floor
        .filter(|floor| found.gap_before.is_some_and(|before| before < *floor));
    Some(match outside {
        Some(_) => format!(
            "{text}.{without} The frequencies are uncertain by {floor} %: the cause shows elsewhere, not in the mean \
             frequencies."
        ),
        None => format!("{text}.{without} The frequencies are uncertain by {floor} %."),
    })
}

/// ", 97 % of the gap (95 %: 93 to 99)".
fn share(closure: &Closure) -> String {
    format!(
        ", {:.0} % of the gap (95 %: {:.0} to {:.0})",
        100.0 * closure.value,
        100.0 * closure.low,
        100.0 * closure.high
    )
}

/// Tells what the decays show by themselves, where the verdict does not already say it.
fn along_decays(gap: &GapSection) -> Option<String> {
    let found = gap.along_decays.as_ref()?;
    let largest = found.changes.iter().max_by(|a, b| {
        (a.percent_per_fold / a.std)
            .abs()
            .total_cmp(&(b.percent_per_fold / b.std).abs())
    })?;
    let seen = format!(
        "Along the decays frequencies change with amplitude, most certainly mode {} in {}: by {} % when the amplitude grows by \
         a factor of e (2.7)",
        largest.mode,
        largest.recording,
        change(largest.percent_per_fold, 3)
    );
    let Some(effect) = found.effect else {
        return Some(match found.enough {
            true => format!(
                "{seen}. A joint whose stiffness depends on the amplitude would change them in another way."
            ),
            false => {
                format!("{seen}. One frequency alone cannot tell whether the joint causes that.")
            }
        });
    };
    let own = Hypothesis::Effects(vec![effect]);
    let said = match &gap.verdict {
        Verdict::Named(effects) => effects.contains(&effect),
        other => other.hypotheses().contains(&own),
    };
    if said {
        return None;
    }
    let size = if found.lawful && found.at_bound {
        format!(
            "its rotational stiffness changes by {:.0} % or more at the largest amplitude",
            100.0 * found.ratio.abs()
        )
    } else if found.lawful {
        format!(
            "its rotational stiffness changes by {} \u{b1} {:.1} % at the largest amplitude",
            change(100.0 * found.ratio, 1),
            100.0 * NORMAL_95 * found.ratio_std
        )
    } else {
        "modes that hardly rotate the joint change too, so the size stays open".to_owned()
    };
    Some(format!(
        "{seen}. The joint {} as the amplitude grows ({}); {size}. This follows from the decays alone and explains \
         no misfit of the frequencies.",
        found.direction(),
        effect.name()
    ))
}

/// Tells how far the joint moves with the effect; `None` where none is named.
fn price(gap: &GapSection) -> Option<String> {
    let found = cause(gap)?;
    let shift = &found.joint_shift;
    let mut parts = Vec::new();
    for (name, percent) in [("Kx", shift.kx_percent), ("Ky", shift.ky_percent)] {
        if percent.is_some() {
            parts.push(format!("{name} by {} %", signed_percent(percent)));
        }
    }
    if parts.is_empty() {
        return None;
    }
    let moves = parts.join(", ");
    Some(match joint(found) {
        Some(joint) => {
            format!("With it the joint is {joint}. Against the joint without it: {moves}.")
        }
        None => format!("Adding it moves the joint: {moves}."),
    })
}

/// The effects that the verdict names.
fn cause(gap: &GapSection) -> Option<&HypothesisResult> {
    gap.named()
        .filter(|found| found.hypothesis != Hypothesis::None)
}

/// Returns the effect of a named cause, in one sentence, and the test to make next; empty where nothing is missing.
pub fn gap_in_short(document: &Document) -> Vec<String> {
    let Some(gap) = &document.gap else {
        return Vec::new();
    };
    let is_there = match gap.verdict {
        Verdict::NoGap => false,
        Verdict::NotEnoughData(_) => shows_gap(gap),
        _ => true,
    };
    if !is_there {
        return Vec::new();
    }
    let found = cause(gap).filter(|found| found.gap_after < found.gap_before);
    let shrink = found.map(|found| {
        format!(
            "With {} the errors of the frequencies shrink from {} to {} % (rms).",
            together(&found.hypothesis),
            percent(found.gap_before),
            left(found.gap_after, gap.noise_floor)
        )
    });
    shrink.into_iter().chain(next_test(gap)).collect()
}

/// The verdict in two sentences at most, in the words of an engineer.
pub(crate) fn brief_verdict(gap: &GapSection, has_joint: bool) -> String {
    let Some(found) = cause(gap) else {
        return match &gap.verdict {
            Verdict::NoGap => {
                "Nothing is missing: the described model explains the frequencies.".to_owned()
            }
            Verdict::NotEnoughData(reason) => match shows_gap(gap) {
                true => format!("These data cannot say what causes it: {reason}."),
                false => format!("No answer: {reason}."),
            },
            Verdict::Unknown => format!(
                "Do not use {} before the cause is found: check the description and the mode numbers first.",
                if has_joint {
                    "the joint's stiffness"
                } else {
                    "what is estimated"
                }
            ),
            _ => verdict(gap, has_joint),
        };
    };
    let effects = match &found.hypothesis {
        Hypothesis::Effects(effects) => effects.as_slice(),
        _ => &[],
    };
    let meanings: Vec<&str> = effects.iter().map(|effect| effect.meaning()).collect();
    let size = sizes(found);
    let size = if size.is_empty() {
        size
    } else {
        format!(": {size}")
    };
    format!(
        "{} ({}, {}){size}. With it the model misses the frequencies by {} % (rms).",
        capital(&meanings.join(", and ")),
        names(effects),
        probability(found.probability),
        left(found.gap_after, gap.noise_floor)
    )
}

/// The joint with its 95 % intervals.
fn joint(found: &HypothesisResult) -> Option<String> {
    let [kt, kr] = found.joint?;
    let [of_kt, of_kr] = found.joint_intervals;
    let kr = stiffness_with_limits(kr, of_kr, "N\u{a0}m/rad");
    let kt = stiffness_with_limits(kt, of_kt, "N/m");
    // A value stays on the line of its name and unit.
    Some(format!("Kt\u{a0}=\u{a0}{kt}, Kr\u{a0}=\u{a0}{kr}"))
}

fn verdict(gap: &GapSection, has_joint: bool) -> String {
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
            "The cause is one of {}{odds}; these data cannot tell them apart.{}",
            names(effects),
            scale_of(effects, gap)
        ),
        Verdict::Set(list) => {
            let words = list.iter().map(|one| match one {
                Hypothesis::None => "nothing".to_owned(),
                Hypothesis::Unknown => "something unknown".to_owned(),
                _ => one.name(),
            });
            let effects: Vec<String> = words.collect();
            format!(
                "The cause is most likely one of {}; these data do not decide.",
                listed(&effects, "or")
            )
        }
        Verdict::Unknown => unknown(gap, has_joint),
        Verdict::NotEnoughData(reason) => undecided(gap, reason, has_joint),
    }
}

/// Tells what all frequencies ask for where the effects are those of one common factor.
fn scale_of(effects: &[EffectId], gap: &GapSection) -> String {
    let factor = gap.common_factor.as_ref();
    match factor.filter(|_| effects.iter().all(|one| one.group() == Group::Scale)) {
        Some(factor) if factor.tolerance_percent == 0.0 => format!(
            " All frequencies ask for {} %; the description says that it is exact.",
            asked(factor)
        ),
        Some(factor) => format!(
            " All frequencies ask for {} %; the description leaves \u{b1}{} % open.",
            asked(factor),
            significant(factor.tolerance_percent, 2)
        ),
        None => String::new(),
    }
}

/// "+1.02 \u{b1} 0.20": a common factor and half its 95 % interval.
fn asked(factor: &CommonFactor) -> String {
    let text = rounded(factor.percent, Some(NORMAL_95 * factor.std_percent)).joined();
    match text.starts_with('-') || text.starts_with('\u{2212}') {
        true => text,
        false => format!("+{text}"),
    }
}

/// Standard uncertainties from which on a common factor is stated.
const ASKED: f64 = 2.0;

/// Tells that the frequencies ask for a common factor that the tolerances allow; nothing where they ask for none.
fn within_tolerances(gap: &GapSection) -> String {
    let factor = gap.common_factor.as_ref();
    let factor = factor
        .filter(|one| one.percent.abs() > ASKED * one.std_percent && one.deviation.abs() <= ASKED);
    factor.map_or_else(String::new, |factor| {
        format!(
            " The frequencies ask for {} %, within the tolerances of the description (\u{b1}{} %).",
            asked(factor),
            significant(factor.tolerance_percent, 2)
        )
    })
}

/// Tells that the cause has no name, and that it is spread where two local changes would explain it.
fn unknown(gap: &GapSection, has_joint: bool) -> String {
    let found = gap.hypotheses.iter().find(|found| {
        use EffectId::{AddedMass, LocalCrack};
        let is_pair = [[AddedMass, LocalCrack], [LocalCrack, AddedMass]]
            .iter()
            .any(|pair| found.hypothesis == Hypothesis::Effects(pair.to_vec()));
        is_pair
            && found
                .goodness_of_fit
                .is_some_and(|p| p >= Thresholds::DEFAULT.misfit)
            && found.probability >= LEAST_PROBABILITY
    });
    let likeness = found.map_or_else(String::new, |found| {
        format!(
            " A crack and a mass would explain it ({}). So would any change that is spread over a part of the beam.",
            sizes(found)
        )
    });
    let estimated = if has_joint {
        "the joint's stiffness"
    } else {
        "what is estimated"
    };
    format!(
        "Something is missing in the model, and nothing in the catalogue explains it alone. Do not use {estimated} \
         before the cause is found: check the description and the mode numbers first.{likeness}"
    )
}

/// Tells that nothing is missing, and why so even where an effect leads the table.
fn no_gap(gap: &GapSection) -> String {
    let first = gap.hypotheses.first();
    let open = match first.filter(|first| first.hypothesis != Hypothesis::None) {
        Some(_) => format!(
            " No effect is established: that needs odds of at least {:.0} to 1 against none, and a size that is not zero.",
            Thresholds::DEFAULT.detected.exp()
        ),
        None => String::new(),
    };
    let of_none = gap.result(&Hypothesis::None);
    let misfit = of_none.and_then(|none| {
        none.goodness_of_fit
            .filter(|p| *p < Thresholds::DEFAULT.misfit)
    });
    match misfit {
        Some(p) => format!(
            "No gap is established. The described model misses the frequencies by more than their uncertainty, as \
             chance would in {} of tests, but nothing else explains them better.{open}",
            probability(p)
        ),
        None => {
            // Stated where the described model leaves errors more than twice as large as two others: the readings'
            // uncertainty, and the errors with a joint that may differ between recordings.
            let floor = gap.noise_floor;
            let left_over =
                of_none.and_then(|none| Some((none.gap_before?, none.gap_after?, floor?)));
            let moved =
                left_over.filter(|(before, after, floor)| *before > 2.0 * after.max(*floor));
            let moved = moved.map_or_else(String::new, |(before, after, _)| format!(
                " if joint, geometry and masses may differ from the description within their tolerances, and between \
                 recordings (errors {} %; exactly as described {} %)",
                left(Some(after), floor),
                percent(Some(before))
            ));
            format!(
                "No gap: the described model explains the frequencies within their uncertainty{moved}.{}{open}",
                within_tolerances(gap)
            )
        }
    }
}

/// Probability of `none` below which a gap counts as there.
const GAP: f64 = 0.1;

/// True where the readings show a gap, be its cause known or not.
pub(crate) fn shows_gap(gap: &GapSection) -> bool {
    let none = gap.result(&Hypothesis::None);
    misfit_unplaced(gap).is_some() || none.is_some_and(|none| none.probability < GAP)
}

/// Returns the misfit without sensors of unknown position, where the model misses the frequencies without them.
fn misfit_unplaced(gap: &GapSection) -> Option<&UnlocatedSensors> {
    let unplaced = gap.unplaced.as_ref();
    unplaced.filter(|one| one.goodness_of_fit < Thresholds::DEFAULT.misfit)
}

/// Tells that there is no answer, and what is known all the same.
fn undecided(gap: &GapSection, reason: &str, has_joint: bool) -> String {
    let Some(none) = gap.result(&Hypothesis::None) else {
        return format!("No diagnosis: {reason}.");
    };
    let mut text = if let Some(without) = misfit_unplaced(gap) {
        format!(
            "There is a gap: without {} ({} g), whose position is not given, the described model misses the \
             frequencies by {} % (rms), as chance would in {} of tests. These data cannot say what causes it: {reason}.",
            without.sensors.join(" and "),
            trimmed(1e3 * without.mass, 3),
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
    let coupling = gap.result(&Hypothesis::Effects(vec![EffectId::CrossCoupling]));
    if let Some(coupling) = coupling.filter(|_| has_joint) {
        text.push_str(&format!(
            " A cross-coupling of the joint is not established ({}).",
            probability(coupling.probability)
        ));
    }
    text
}

/// Returns the probability of the verdict: that of a group is the sum over its members, be they single effects or
/// pairs.
fn odds(gap: &GapSection) -> Option<f64> {
    let Verdict::Group(group) = &gap.verdict else {
        return gap.named().map(|found| found.probability);
    };
    let (mut singles, mut all) = (None, None);
    for found in &gap.hypotheses {
        let Hypothesis::Effects(effects) = &found.hypothesis else {
            continue;
        };
        if effects.iter().all(|one| group.contains(one)) {
            *all.get_or_insert(0.0) += found.probability;
            if effects.len() == 1 {
                *singles.get_or_insert(0.0) += found.probability;
            }
        }
    }
    singles.or(all)
}

/// Returns "modulus, length or timebase".
pub(super) fn listed(names: &[String], conjunction: &str) -> String {
    match names.split_last() {
        Some((last, others)) if !others.is_empty() => {
            format!("{} {conjunction} {last}", others.join(", "))
        }
        _ => names.concat(),
    }
}

/// Returns the effect that is probably the cause: the most probable one of those that the verdict names. `Err` says why
/// there is none.
pub(crate) fn found_best(gap: &GapSection) -> Result<String, &'static str> {
    match gap.verdict {
        Verdict::Named(_) | Verdict::Group(_) | Verdict::Set(_) => {
            // The diagnosis gives the errors of the most probable hypothesis that predicts anything.
            let mut hypotheses = gap.hypotheses.iter().map(|found| &found.hypothesis);
            match hypotheses.find(|one| **one != Hypothesis::Unknown) {
                Some(effects @ Hypothesis::Effects(_)) => Ok(effects.name()),
                _ => Err("no effect is more probable than none"),
            }
        }
        Verdict::NoGap => Err("nothing is missing"),
        Verdict::Unknown => Err("nothing in the catalogue explains the rest"),
        Verdict::NotEnoughData(_) => Err("these data do not decide what is missing"),
    }
}

/// The test that tells most for its effort; what it is for depends on the answer.
fn next_test(gap: &GapSection) -> Option<String> {
    let test = gap.next_test.first()?;
    let (purpose, premise) = match gap.verdict {
        Verdict::NoGap | Verdict::Named(_) => ("To confirm it", String::new()),
        Verdict::Unknown => (
            "If the description is right, to decide",
            format!(", {EQUALLY_LIKELY}"),
        ),
        _ => ("To decide", String::new()),
    };
    if confirms(test) {
        return Some(format!("{purpose}: {} ({}).", test.action, minutes(test)));
    }
    Some(format!(
        "{purpose}: {} ({}). This tells {} about {}{premise}{}.",
        test.action,
        minutes(test),
        gain(test),
        listed(&test.separates, "and"),
        not_predicted(test, "; it could not be predicted for ")
    ))
}

/// The test to make next, with its time and what it tells; `None` where the best one tells next to nothing.
pub(crate) fn next_in_short(gap: &GapSection) -> Option<String> {
    let test = gap.next_test.first()?;
    if confirms(test) {
        return Some(format!("{} ({}).", capital(&test.action), minutes(test)));
    }
    (test.expected_information >= LITTLE).then(|| {
        format!(
            "{} ({}). This tells {} about {}.",
            capital(&test.action),
            minutes(test),
            gain(test),
            listed(&test.separates, "and")
        )
    })
}

/// "about 10 min": the time of a test.
pub(crate) fn minutes(test: &NextTest) -> String {
    format!("about {:.0} min", test.minutes())
}

/// Information (bit) below which a test tells next to nothing: odds of 50 to 50 would become 60 to 40.
const LITTLE: f64 = 0.03;

/// How much a test tells about the causes that it separates, by its information. One bit decides between two equally probable
/// causes; with a tenth odds of 50 to 50 become 70 to 30.
pub(crate) fn gain(test: &NextTest) -> &'static str {
    match test.expected_information {
        bits if bits >= 0.7 => "nearly all",
        bits if bits >= 0.3 => "much",
        bits if bits >= 0.1 => "something",
        _ => "little",
    }
}

/// True for a test that tells nothing new about which hypothesis holds.
pub(crate) fn confirms(test: &NextTest) -> bool {
    matches!(test.proposal, Proposal::Confirm { .. })
}

/// The hypotheses for which a test could not be predicted, after `lead`; nothing where there are none.
pub(crate) fn not_predicted(test: &NextTest, lead: &str) -> String {
    match test.unpredicted.as_slice() {
        [] => String::new(),
        names => format!("{lead}{}", names.join(", ")),
    }
}

/// Premise of the information of a test where nothing explains the readings: the ranking then says little.
pub(crate) const EQUALLY_LIKELY: &str = "if all effects of the catalogue are equally probable";

/// Hypotheses less probable than this are not listed.
pub(crate) const LEAST_PROBABILITY: f64 = 0.005;

/// "local-crack + joint-nonlinearity": both names of two effects, which a line may be broken between.
pub(crate) fn together(hypothesis: &Hypothesis) -> String {
    hypothesis.name().replace('+', " + ")
}

/// "timebase, modulus".
pub(crate) fn names(effects: &[EffectId]) -> String {
    let names: Vec<&str> = effects.iter().map(|effect| effect.name()).collect();
    names.join(", ")
}
