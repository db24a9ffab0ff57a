//! Sentences about what changed between two tests.

use crate::document::Document;
use crate::format::{capital, probability, rounded, significant, with_decimals_of};
use tapjoint_compare::{
    CauseKind, CauseResult, Comparison, DampingResult, DampingVerdict, Interval, LevelResult,
    MatchedMode, RepeatabilityOrigin, VerdictKind,
};

/// Returns what a cause is, in words: "L3 is gone".
pub fn cause(kind: CauseKind, item: Option<&str>) -> String {
    let item = item.unwrap_or("an item");
    match kind {
        CauseKind::NoChange => "no change".to_owned(),
        CauseKind::JointChange => "the joint changed".to_owned(),
        CauseKind::LostMass => format!("{item} is gone"),
        CauseKind::AddedMass => "a mass came or went".to_owned(),
        CauseKind::LocalCrack => "a crack opened or closed".to_owned(),
        CauseKind::Length => "the free length changed".to_owned(),
        CauseKind::Modulus => "the modulus changed (temperature?)".to_owned(),
        CauseKind::SensorPosition => format!("sensor {item} was moved"),
        CauseKind::AxialLoad => "the axial load changed".to_owned(),
        CauseKind::Unknown => "something else changed".to_owned(),
    }
}

/// Returns the sizes of a cause with their 95 % intervals.
pub fn size(found: &CauseResult) -> String {
    let parts = found.parameters.iter().map(|(name, value)| match *name {
        "mass" => format!("mass {}", in_unit(value, 1e3, "g")),
        "position" => format!("at {}", in_unit(value, 1e3, "mm")),
        "sensor_shift" => format!("by {}", in_unit(value, 1e3, "mm")),
        "force" => format!("force {}", in_unit(value, 1.0, "N")),
        "kt" => format!("Kt {}", in_unit(value, 100.0, "%")),
        "kr" => format!("Kr {}", in_unit(value, 100.0, "%")),
        "relative" => in_unit(value, 100.0, "%"),
        name => format!("{} {}", name.replace('_', " "), in_unit(value, 1.0, "")),
    });
    parts.collect::<Vec<_>>().join(", ")
}

/// Returns a value with its interval, all to the second digit of the standard deviation.
fn in_unit(found: &Interval, factor: f64, unit: &str) -> String {
    let std = (found.low < found.high).then_some(factor * found.std);
    let written = rounded(factor * found.value, std).value;
    let value = format!("{written} {unit}");
    let value = value.trim_end();
    // What a description states has no interval.
    if std.is_none() {
        return value.to_owned();
    }
    let [low, high] = [found.low, found.high].map(|one| with_decimals_of(factor * one, &written));
    format!("{value} ({low} to {high})")
}

/// Returns the answer in a few sentences, the shortest first.
pub fn answer(document: &Document) -> Vec<String> {
    let Some(section) = &document.compare else {
        return Vec::new();
    };
    let found = &section.found;
    let verdict = &found.verdict;
    let sure = probability(verdict.probability);
    let causes = verdict.effects.iter().zip(&verdict.items);
    let causes: Vec<String> = causes
        .map(|(kind, item)| cause(*kind, item.as_deref()))
        .collect();
    let list = causes.join(", or ");
    let mut sentences = vec![match verdict.kind {
        VerdictKind::NoChange => {
            format!("No change: repeating the test changes the frequencies as much ({sure}).")
        }
        VerdictKind::Named => format!("Changed: {list} ({sure})."),
        VerdictKind::Group => {
            format!("Changed: {list} ({sure} together). These data do not tell them apart.")
        }
        VerdictKind::Set => format!("Not decided: {list} ({sure} together)."),
        VerdictKind::Unknown => "Something changed that no cause here explains.".to_owned(),
    }];
    let first = verdict.effects.iter().zip(&verdict.items).next();
    let own = first.and_then(|(kind, item)| {
        let mut all = found.hypotheses.iter();
        all.find(|one| one.effect == *kind && one.item == *item)
    });
    if let Some(own) = own.filter(|own| !own.parameters.is_empty()) {
        let subject = cause(own.effect, own.item.as_deref());
        sentences.push(format!("If {subject}: {}.", size(own)));
    }
    sentences.extend(seen_from(found));
    sentences.extend(found.damping.as_ref().map(|own| damping(own, found)));
    sentences.extend(found.level.as_ref().and_then(level));
    sentences.push(repeatability(found));
    sentences.extend(matched(&found.matched, |_| "Another test".to_owned()));
    sentences
}

/// Returns what the dampings say.
fn damping(own: &DampingResult, found: &Comparison) -> String {
    let percent = |ratio: f64| significant(100.0 * ratio, 3);
    let most = own.modes.iter().max_by(|a, b| {
        let [a, b] = [a, b].map(|one| (one.after - one.before).abs() / one.std);
        a.total_cmp(&b)
    });
    let most = most.map_or(String::new(), |most| {
        let [before, after] = [most.before, most.after].map(percent);
        format!(
            " Mode {} changed most, from {before} to {after} %.",
            most.mode
        )
    });
    match (own.verdict, &own.loss_factor) {
        (DampingVerdict::NoChange, _) => format!(
            "Damping: no change beyond a scatter of about {} % between tests.",
            significant(own.scatter_percent, 2)
        ),
        // The stiffness changes the shares of the energy, too.
        (DampingVerdict::JointDamping, Some(loss))
            if found.verdict.kind == VerdictKind::NoChange =>
        {
            format!(
                "The joint's loss factor changed by {}.",
                in_unit(loss, 1.0, "")
            )
        }
        (DampingVerdict::JointDamping, _) => {
            format!("The damping changed as the joint changes it.{most}")
        }
        (DampingVerdict::Other, _) => {
            format!("The damping changed, but not as the joint changes it.{most}")
        }
        (DampingVerdict::Undecided, _) => format!("The damping changed.{most}"),
    }
}

/// Returns where the frequencies depend on the level otherwise than before; nothing without a change.
fn level(found: &LevelResult) -> Option<String> {
    let most = found.modes.iter().max_by(|a, b| {
        let [a, b] =
            [a, b].map(|one| (one.after_percent - one.before_percent).abs() / one.std_percent);
        a.total_cmp(&b)
    });
    let most = most.filter(|_| found.has_changed)?;
    let [before, after] = [most.before_percent, most.after_percent].map(|one| significant(one, 2));
    let cause = match most.after_percent < most.before_percent.min(0.0) {
        true => " A joint that slips more does this.",
        false => "",
    };
    Some(format!(
        "Frequencies depend on the level in another way. A factor of ten in amplitude changes mode {} by {after} %, before by {before} %.{cause}",
        most.mode
    ))
}

/// Returns a sentence for each mode whose number differed between tests. `name` begins a sentence about a test, by its index.
pub fn matched(all: &[MatchedMode], name: impl Fn(usize) -> String) -> Vec<String> {
    let mut sentences = Vec::new();
    for one in all {
        let [first, other] = [one.first, one.other].map(|frequency| significant(frequency, 5));
        sentences.push(match one.taken {
            Some(taken) => format!(
                "Mode {} is {first} Hz in the first test. {} numbers the peak at {other} Hz; that at {} Hz is taken.",
                one.mode,
                name(one.test),
                significant(taken, 5)
            ),
            None => format!(
                "Mode {} is left out. It is {first} Hz in the first test. {} numbers the peak at {other} Hz.",
                one.mode,
                name(one.test)
            ),
        });
    }
    sentences
}

/// Returns the smallest change of the joint that would have been seen.
fn seen_from(found: &Comparison) -> Vec<String> {
    let Some(joint) = &found.joint else {
        return Vec::new();
    };
    if found.verdict.kind != VerdictKind::NoChange {
        return Vec::new();
    }
    let (mut parts, mut unseen) = (Vec::new(), Vec::new());
    for (name, change) in [("Kt", &joint.kt), ("Kr", &joint.kr)] {
        let Some(change) = change else {
            continue;
        };
        parts.push(match change.seen_from_percent {
            [Some(rise), Some(fall)] => format!(
                "a rise of {name} by more than {} % or a fall by more than {} %",
                significant(rise, 2),
                significant(-fall, 2)
            ),
            [Some(rise), None] => {
                format!("a rise of {name} by more than {} %", significant(rise, 2))
            }
            [None, Some(fall)] => {
                format!("a fall of {name} by more than {} %", significant(-fall, 2))
            }
            [None, None] => {
                unseen.push(name);
                continue;
            }
        });
    }
    let mut sentences = Vec::new();
    if !parts.is_empty() {
        let all = capital(&parts.join(", or "));
        sentences.push(format!("{all} would have been seen, nine times of ten."));
    }
    if !unseen.is_empty() {
        let names = unseen.join(" and ");
        sentences.push(format!(
            "These data do not tell {names}: not even a factor of 20 would have been seen."
        ));
    }
    sentences
}

fn repeatability(found: &Comparison) -> String {
    let percent = significant(found.repeatability.percent, 2);
    match found.repeatability.origin {
        RepeatabilityOrigin::Stated => format!("Repeatability: {percent} %, as stated."),
        RepeatabilityOrigin::Repeats => format!("Repeatability: {percent} %, from the repeats."),
        RepeatabilityOrigin::Assumed => format!(
            "Repeatability: about {percent} %, assumed. Give repeats (--before, --after) or --repeatability: they decide \
             what counts as a change."
        ),
    }
}
