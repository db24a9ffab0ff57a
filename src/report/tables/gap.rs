//! The gap between model and measurement, in sentences.

use std::collections::BTreeMap;

use super::super::document::{Document, GapSection};
use super::super::format::{
    RIGID, prefix, probability, rounded, signed_percent, significant, trimmed,
};
use super::has_joint;
use super::hypotheses::{left, percent, together};
use super::next_tests::next_test;
use super::verdict::{shows_gap, verdict};
use tapjoint_beam::effects::{EffectId, Place};
use tapjoint_diagnosis::{Closure, Hypothesis, HypothesisResult, Residual, Verdict};
use tapjoint_numerics::stats::times;

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

/// Where, unless there is no gap; the probabilities take for granted that something is missing.
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
    Some(format!(
        "Where, if something is missing: {}. Largest misfit for its uncertainty: mode {} in {}, {} % ({} standard deviations).",
        listed.join(", "),
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
    let by_mass = gap
        .hypotheses
        .iter()
        .find_map(|found| match &found.hypothesis {
            Hypothesis::Effects(effects) if is_at_sensor(effects) => {
                Some(effects.as_slice() == [EffectId::SensorMass])
            }
            _ => None,
        });
    let mut sensors: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for one in recordings {
        for (name, position) in &one.sensor_positions {
            let weighed = one.sensor_masses.get(name).is_some_and(|mass| *mass > 0.0);
            if !(by_mass == Some(true) && weighed) {
                sensors.entry(name).or_default().push(*position);
            }
        }
    }
    if sensors.is_empty() || sensors.len() > MOST {
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

/// Whether the first effect sits at a sensor.
fn is_at_sensor(effects: &[EffectId]) -> bool {
    let first = effects.first();
    first.is_some_and(|effect| effect.place() == Place::Sensor)
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

/// How far the errors shrink, where an effect is held for the cause.
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
    let shrink = match found.gap_after {
        Some(after) if after >= found.gap_before => "go",
        _ => "shrink",
    };
    let mut text = format!(
        "How far: with {} the errors {shrink} from {} to {} % (rms over fitted frequencies)",
        together(&found.hypothesis),
        percent(Some(found.gap_before)),
        left(found.gap_after, gap.noise_floor),
    );
    text.push_str(&by_drift(gap, found, has_joint));
    if let Some((before, after)) = found.holdout_before.zip(found.holdout_after) {
        text.push_str(&format!(
            "; on frequencies that took no part from {} to {} %",
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
    let outside = gap.noise_floor.filter(|floor| found.gap_before < *floor);
    Some(match outside {
        Some(_) => format!(
            "{text}. Their uncertainty is {floor} %: the cause shows elsewhere, not in the mean frequencies."
        ),
        None => format!("{text}; their own uncertainty is {floor} %."),
    })
}

/// What is left where nothing is added, if the tolerances, and a joint's drift between recordings, explain half of the
/// errors.
fn by_drift(gap: &GapSection, found: &HypothesisResult, has_joint: bool) -> String {
    let none = gap.result(&Hypothesis::None);
    match none.and_then(|none| none.gap_after) {
        Some(remains) if remains < 0.5 * found.gap_before => format!(
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
fn share(closure: &Closure) -> String {
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
    let Some(effect) = found.effect else {
        return Some(match found.enough {
            true => format!(
                "{seen}, but not as a joint whose stiffness depends on the amplitude would make them."
            ),
            false => format!(
                "{seen}; of one frequency alone nobody can tell whether the joint does that."
            ),
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
            100.0 * found.ratio_std
        )
    } else {
        "modes that hardly turn it change too, so that its rotation alone does not say by how much"
            .to_owned()
    };
    Some(format!(
        "{seen}: the joint {} ({}); {size}. That is said by the decays alone and explains \
         no misfit of the frequencies.",
        found.direction(),
        effect.name()
    ))
}

/// What ignoring the effect costs; `None` where none is named.
fn price(gap: &GapSection) -> Option<String> {
    let found = cause(gap)?;
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
    Some(match joint(found, true) {
        Some(joint) => {
            format!("With it the joint is {joint}: {moves} against the joint without it.")
        }
        None => format!("Adding it moves the joint: {moves}."),
    })
}

/// "Kt = 168.2 kN/m, Kr = 205.4 N m/rad": the joint that is found together with what the verdict names; `None` where it
/// names nothing.
pub(crate) fn joint_with(gap: &GapSection) -> Option<String> {
    joint(cause(gap)?, false)
}

/// The effects that the verdict names.
fn cause(gap: &GapSection) -> Option<&HypothesisResult> {
    gap.named()
        .filter(|found| found.hypothesis != Hypothesis::None)
}

/// What a named effect does, in one sentence, and the test to make next; empty where nothing is missing.
pub fn gap_in_short(document: &Document) -> Vec<String> {
    let is_there = |gap: &&GapSection| match gap.verdict {
        Verdict::NoGap => false,
        Verdict::NotEnoughData(_) => shows_gap(gap),
        _ => true,
    };
    let Some(gap) = document.gap.as_ref().filter(is_there) else {
        return Vec::new();
    };
    let found = cause(gap).filter(|found| found.gap_after < Some(found.gap_before));
    let shrink = found.map(|found| {
        let joint =
            joint(found, true).map_or(String::new(), |joint| format!(", and the joint is {joint}"));
        format!(
            "With {} the errors of the frequencies shrink from {} to {} % (rms){joint}.",
            together(&found.hypothesis),
            percent(Some(found.gap_before)),
            left(found.gap_after, gap.noise_floor)
        )
    });
    shrink.into_iter().chain(next_test(gap)).collect()
}

/// With 95 % intervals if these are wanted.
fn joint(found: &HypothesisResult, intervals: bool) -> Option<String> {
    let [kt, kr] = found.joint?;
    let [of_kt, of_kr] = found
        .joint_intervals
        .map(|interval| interval.filter(|_| intervals));
    let kr = stiffness((kr, of_kr), "N\u{a0}m/rad");
    // A value stays on the line of its name and unit.
    Some(format!(
        "Kt\u{a0}=\u{a0}{}, Kr\u{a0}=\u{a0}{kr}",
        stiffness((kt, of_kt), "N/m")
    ))
}

/// "1.995 MN/m (95 %: 1.991 to 1.999)", the value on one line with its unit.
fn stiffness((value, interval): (f64, Option<[f64; 2]>), unit: &str) -> String {
    if value.is_infinite() {
        return RIGID.to_owned();
    }
    let (factor, letter) = prefix(value);
    let known = interval.filter(|ends| ends.iter().all(|end| end.is_finite()));
    let Some([low, high]) = known.map(|ends| ends.map(|end| factor * end)) else {
        return format!("{}\u{a0}{letter}{unit}", significant(factor * value, 4));
    };
    // All with the digits that the interval supports.
    let shown = rounded(factor * value, Some(0.5 * (high - low))).value;
    let decimals = shown.split_once('.').map_or(0, |(_, behind)| behind.len());
    format!("{shown}\u{a0}{letter}{unit} (95 %: {low:.decimals$} to {high:.decimals$})")
}
