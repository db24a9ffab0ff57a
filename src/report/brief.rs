//! What was found, in five lines for a terminal.

use super::document::Document;
use super::format::{signed_or_below, significant};
use super::summary::{channels, described, most_missed};
use super::tables::{
    Parameter, estimated, has_joint, joint_with, quality_count, shows_gap, together,
};
use tapjoint_beam::effects::EffectId;
use tapjoint_diagnosis::{Hypothesis, Verdict};

/// At most five lines, each with what it is about; what was not computed has none.
pub fn brief(document: &Document) -> Vec<(&'static str, String)> {
    let lines = [
        ("Taps", taps(document)),
        ("Modes", modes(document)),
        (
            if has_joint(document) { "Joint" } else { "Beam" },
            joint(document),
        ),
        ("Model", model(document)),
        ("Doubts", doubts(document)),
        ("Next", described(document)),
    ];
    lines
        .into_iter()
        .filter_map(|(about, words)| Some((about, words?)))
        .collect()
}

fn taps(document: &Document) -> Option<String> {
    let recordings = document.recordings.as_deref().filter(|r| !r.is_empty())?;
    let files = match recordings.len() {
        1 => "1 recording".to_owned(),
        count => format!("{count} recordings"),
    };
    // Functions from a file have no taps to judge.
    if recordings
        .iter()
        .all(|recording| recording.sample_rate.is_none())
    {
        return Some(format!("none: {files} of frequency response functions"));
    }
    let all = recordings.iter().flat_map(|recording| &recording.taps);
    let used = all.clone().filter(|tap| tap.accepted).count();
    let could = if document.modes.is_some() {
        "used"
    } else {
        "can be used"
    };
    // Without a hammer it matters on what taps were looked for.
    let channels = channels(document).map_or(String::new(), |words| format!(". {words}"));
    Some(format!(
        "{used} of {} taps {could}, in {files}{channels}",
        all.count()
    ))
}

fn modes(document: &Document) -> Option<String> {
    let modes = document.modes.as_deref()?;
    let numbered = modes.iter().filter(|mode| mode.mode.is_some());
    let frequencies: Vec<f64> = numbered.map(|mode| mode.frequency).collect();
    let low = frequencies.iter().copied().fold(f64::INFINITY, f64::min);
    let high = frequencies.iter().copied().fold(0.0, f64::max);
    Some(match frequencies.len() {
        0 => "none".to_owned(),
        1 => format!("1 mode at {} Hz", significant(low, 4)),
        count => format!(
            "{count} modes from {} to {} Hz",
            significant(low, 4),
            significant(high, 4)
        ),
    })
}

fn joint(document: &Document) -> Option<String> {
    let Some(estimate) = document.estimate.as_ref()? else {
        let reason = document.estimate_reason.as_deref();
        return Some(format!(
            "no estimate: {}",
            reason.unwrap_or("no reason was recorded")
        ));
    };
    let physical: Vec<String> = estimated(estimate)
        .iter()
        .filter(|parameter| parameter.unit != "1")
        .map(with_bounds)
        .collect();
    (!physical.is_empty()).then(|| physical.join(", "))
}

/// "Kt = 1.3820 ± 0.0090 MN/m"; the larger of the standard deviations where there are two. Where the misfit
/// gives limits these are said, which need not lie alike on both sides: "Kt = 1.790 MN/m (95 %: 1.59 to 1.99)".
fn with_bounds(parameter: &Parameter<'_>) -> String {
    let [value, _, _, _, unit] = parameter.written();
    let rounded = parameter.written_together();
    if let Some([low, high]) = parameter.written_scaled_limits() {
        let own = format!("{} = {} {unit}", parameter.symbol, rounded.value);
        let limits = format!("(95 %: {low} to {high})");
        return [own, limits]
            .map(|part| part.replace(' ', "\u{a0}"))
            .join(" ");
    }
    let shown = if rounded.uncertainty.is_some() {
        rounded.joined()
    } else {
        value
    };
    // A number stays on the line of its unit.
    format!("{} = {shown} {unit}", parameter.symbol).replace(' ', "\u{a0}")
}

fn model(document: &Document) -> Option<String> {
    let worst = most_missed(document)?;
    let gap = document.gap.as_ref().map_or_else(String::new, |gap| {
        let with = joint_with(gap).filter(|_| matches!(gap.verdict, Verdict::Named(_)));
        let with = with.map_or_else(String::new, |joint| format!("; with it {joint}"));
        format!("; {}{with}", missing(&gap.verdict, shows_gap(gap)))
    });
    Some(format!(
        "largest frequency error of the model {} % (mode {}){gap}",
        signed_or_below(worst.error_percent?),
        worst.mode
    ))
}

/// What the diagnosis answers, in a few words; `there` where the readings show a gap, be its cause known or not.
fn missing(verdict: &Verdict, there: bool) -> String {
    let single = |effects: &[EffectId]| {
        let one = |effect: &EffectId| Hypothesis::Effects(vec![*effect]);
        effects.iter().map(one).collect()
    };
    let hypotheses = match verdict {
        Verdict::Named(effects) => single(effects),
        other => other.hypotheses(),
    };
    let mut names: Vec<String> = Vec::new();
    for hypothesis in hypotheses {
        let name = match hypothesis {
            Hypothesis::None => "nothing".to_owned(),
            Hypothesis::Unknown => "something unknown".to_owned(),
            effects => together(&effects),
        };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let listed = |last: &str| match names.split_last() {
        Some((one, others)) if !others.is_empty() => {
            format!("{} {last} {one}", others.join(", "))
        }
        _ => names.join(""),
    };
    match verdict {
        Verdict::NoGap => "no gap is established".to_owned(),
        Verdict::Named(_) => format!("missing in it: {}", listed("and")),
        Verdict::Group(_) => format!("missing in it: one of {}", listed("or")),
        Verdict::Set(_) if names.len() == 1 => format!("perhaps missing in it: {}", names[0]),
        Verdict::Set(_) => format!("not decided is what is missing in it: {}", listed("or")),
        Verdict::Unknown => "missing in it: something unknown".to_owned(),
        _ if there => "something is missing in it, and these data cannot say what".to_owned(),
        _ => "not enough data to tell whether something is missing in it".to_owned(),
    }
}

fn doubts(document: &Document) -> Option<String> {
    let warnings = match document.main_warnings().count() {
        0 => "no warnings".to_owned(),
        1 => "1 warning, see above".to_owned(),
        count => format!("{count} warnings, see above"),
    };
    let checks = quality_count(document).map_or(String::new(), |count| format!("; {count}"));
    // Where nothing was computed there is nothing to doubt.
    let computed = document.modes.is_some() || document.recordings.is_some();
    computed.then_some(warnings + &checks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_every_verdict_has_its_words() {
        use EffectId::{Length, LocalCrack, Modulus, SensorMass};
        let words = |verdict: Verdict| [false, true].map(|there| missing(&verdict, there));
        let [pair, _] = words(Verdict::Named(vec![LocalCrack, SensorMass]));
        assert_eq!(pair, "missing in it: local-crack and sensor-mass");
        // A group of pairs repeats what they share.
        let [group, _] = words(Verdict::Group(vec![Modulus, Length, Modulus]));
        assert_eq!(group, "missing in it: one of modulus or length");
        let modulus = Hypothesis::Effects(vec![Modulus]);
        let [set, _] = words(Verdict::Set(vec![
            modulus.clone(),
            Hypothesis::None,
            Hypothesis::Unknown,
        ]));
        let said = "not decided is what is missing in it: modulus, nothing or something unknown";
        assert_eq!(set, said);
        let [alone, _] = words(Verdict::Set(vec![modulus]));
        assert_eq!(alone, "perhaps missing in it: modulus");
        // That there is a gap and what causes it are two questions.
        let [open, there] = words(Verdict::NotEnoughData(String::new()));
        assert!(
            open.starts_with("not enough data to tell whether"),
            "{open}"
        );
        assert!(
            there.starts_with("something is missing in it, and"),
            "{there}"
        );
    }
}
