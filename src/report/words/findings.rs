//! The findings in a few plain sentences, for the page.

use super::diagnosis::{gap_in_short, gap_story, listed};
use super::sizes::{limits, stiffness_with_limits};
use super::{comparison, series};
use crate::document::{
    Document, EstimateSection, HeadlineSection, HeadlineValue, PredictionSection, ReadBy,
};
use crate::format::{MISSING, bound_percent, capital, signed_or_below, significant, trimmed};
use crate::picture::extent;
use crate::tables::{Parameter, estimated, quality_count, reading_bound};
use tapjoint_identify::observation::UNPAIRED;

/// Returns "12 of 14 taps used, in 2 recordings".
pub(super) fn taps(document: &Document) -> Option<String> {
    let recordings = document.recordings.as_deref().filter(|r| !r.is_empty())?;
    let files = match recordings.len() {
        1 => "1 recording".to_owned(),
        count => format!("{count} recordings"),
    };
    if recordings.iter().all(|one| one.sample_rate.is_none()) {
        return Some(format!(
            "no taps to judge: {files} of frequency response functions"
        ));
    }
    let taps = recordings.iter().flat_map(|recording| &recording.taps);
    let total = taps.clone().count();
    let used = taps.filter(|tap| tap.accepted).count();
    // Recordings that were only looked at have not been used yet.
    let could = match document.modes {
        Some(_) => "used",
        None => "can be used",
    };
    Some(match total {
        0 => format!("no taps found in {files}"),
        1 => format!("{used} of 1 tap {could}, in {files}"),
        _ => format!("{used} of {total} taps {could}, in {files}"),
    })
}

/// Returns "5 modes from 17.00 to 994.2 Hz"; of a bare recording resonances.
fn modes_in_short(document: &Document) -> Option<String> {
    let modes = document.modes.as_deref()?.iter();
    let numbered = modes.filter(|mode| mode.mode.is_some());
    let frequencies: Vec<f64> = numbered.map(|mode| mode.frequency).collect();
    let described = document.test.iter().any(|test| test.kind.is_some());
    let word = if described { "mode" } else { "resonance" };
    let Some((low, high)) = extent(frequencies.iter().copied()) else {
        return Some(format!("no {word}s found"));
    };
    let (low, high) = (significant(low, 4), significant(high, 4));
    Some(match frequencies.len() {
        1 => format!("1 {word} at {low} Hz"),
        count => format!("{count} {word}s from {low} to {high} Hz"),
    })
}

/// Returns "no estimate: 3 modes are needed"; `None` where there is one or none was asked for.
pub fn no_estimate(document: &Document) -> Option<String> {
    let missing = matches!(document.estimate, Some(None));
    missing.then(|| format!("no estimate: {}", document.no_estimate()))
}

/// "Kt = 168.2 kN/m (95 %: 167 to 169), Kr = 205.4 N m/rad": the joint that is found together with the cause, or with each of
/// several; `None` where the headline is the described model's.
fn joint_with(headline: &HeadlineSection) -> Option<String> {
    let value = |found: &HeadlineValue, unit| {
        let interval = found.low.zip(found.high).map(|(low, high)| [low, high]);
        stiffness_with_limits(found.value.unwrap_or(f64::INFINITY), interval, unit)
    };
    if headline.is_described() {
        return None;
    }
    let (kt, kr) = (headline.kt.as_ref()?, headline.kr.as_ref()?);
    Some(format!(
        "Kt\u{a0}=\u{a0}{}, Kr\u{a0}=\u{a0}{}",
        value(kt, "N/m"),
        value(kr, "N\u{a0}m/rad")
    ))
}

/// The parameters that have a unit, in words.
fn physical(estimate: &EstimateSection, words: fn(&Parameter<'_>) -> String) -> Vec<String> {
    let all = estimated(estimate);
    let physical = all.iter().filter(|parameter| parameter.unit != "1");
    physical.map(words).collect()
}

/// The unit behind a parameter's value; none behind "\u{221e} (rigid)".
fn behind(parameter: &Parameter<'_>, unit: &str) -> String {
    match parameter.value.value.is_infinite() {
        true => String::new(),
        false => format!("\u{a0}{unit}"),
    }
}

/// The findings, one sentence or two in each string; what was not computed is not mentioned.
pub fn sentences(document: &Document) -> Vec<String> {
    if let Some(section) = &document.series {
        // More on what changed stands in its section.
        let change = comparison::answer(document).into_iter().take(1);
        return series::answer(section).into_iter().chain(change).collect();
    }
    if document.compare.is_some() {
        return comparison::answer(document);
    }
    let taps = taps(document).map(|taps| capital(&taps) + ".");
    let first = [taps, channels(document), modes(document)];
    // One sentence for each mode that changes with the amplitude.
    let amplitudes = document.modes.iter().flatten().filter_map(|mode| {
        let change = mode.fit.as_ref()?.amplitude.as_ref()?.ends.as_ref()?;
        let (number, change) = (mode.mode?, change.to_string());
        // A number stays on the line of its unit.
        let change = change.replace(" Hz", "\u{a0}Hz").replace(" %", "\u{a0}%");
        Some(format!("Caution: mode {number} {change}."))
    });
    let rest = [
        quality_count(document).map(|count| capital(&count) + "."),
        joint_if_confirmed(document),
        estimate(document),
        misfit(document),
        gap_story(document).into_iter().next(),
    ];
    let last = [resolution(document), described(document)];
    let first = first.into_iter().flatten();
    first
        .chain(amplitudes)
        .chain(rest.into_iter().flatten())
        .chain(gap_in_short(document))
        .chain(last.into_iter().flatten())
        .collect()
}

/// Tells what a description would add to a bare recording; `None` where there is one, and without an analysis.
pub(super) fn described(document: &Document) -> Option<String> {
    let bare = document
        .test
        .as_ref()
        .is_some_and(|test| test.kind.is_none());
    let modes = document.modes.as_deref().unwrap_or_default();
    let analysed = document.recordings.is_some() && !modes.is_empty();
    (bare && analysed && document.frfs.is_none()).then(|| {
        "Describe the beam (tapjoint\u{a0}init\u{a0}>\u{a0}test.toml): this adds mode numbers, the joint and what the \
         model misses."
            .to_owned()
    })
}

/// "channel 1 and channel 2", on which taps were looked for where there is no hammer.
pub(super) fn tapped_channels(document: &Document) -> Option<String> {
    let recordings = document.recordings.as_deref()?;
    let mut names: Vec<&str> = Vec::new();
    // A spectrum from a file has no taps.
    let in_time = recordings
        .iter()
        .filter(|recording| recording.sample_rate.is_some());
    for recording in in_time.filter(|recording| !recording.has_hammer) {
        for name in &recording.responses {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
    }
    if names.is_empty() {
        return None;
    }
    let names: Vec<String> = names.into_iter().map(str::to_owned).collect();
    Some(listed(&names, "and"))
}

/// On what taps were looked for where there is no hammer.
fn channels(document: &Document) -> Option<String> {
    let names = tapped_channels(document)?;
    Some(format!(
        "There is no hammer channel: taps were looked for on {names}, and without the force there is \
         no frequency response function."
    ))
}

/// Returns the number of modes and where they are, how well lines could be read, and the peaks that are not counted.
fn modes(document: &Document) -> Option<String> {
    let modes = document.modes.as_deref()?;
    let mut sentence = capital(&modes_in_short(document)?);
    if !modes.is_empty() && modes.iter().all(|mode| mode.method.is_none()) {
        sentence.push_str(" (given)");
    }
    let recordings = document.recordings.iter().flatten();
    let finest = recordings.filter_map(|recording| recording.half_line);
    let finest = finest.min_by(f64::total_cmp);
    let found = modes.iter().any(|mode| mode.mode.is_some());
    if let Some(half_line) = finest.filter(|_| found) {
        let half_line = trimmed(half_line, 3);
        sentence.push_str(&format!(
            "; a reading on a spectral line is good to \u{b1}{half_line} Hz at best"
        ));
    }
    // The peaks that are not counted, by kind: "; 3 more peaks are not counted (2 no clear resonance, 1 mains 50 Hz)".
    let mut kinds: Vec<(&str, usize)> = Vec::new();
    for mode in modes.iter().filter(|mode| mode.mode.is_none()) {
        let name = match mode.is_combination {
            true => "combination",
            false => mode.label.as_deref().unwrap_or(UNPAIRED),
        };
        match kinds.iter_mut().find(|(known, _)| *known == name) {
            Some((_, count)) => *count += 1,
            None => kinds.push((name, 1)),
        }
    }
    let total: usize = kinds.iter().map(|(_, count)| count).sum();
    let list = kinds.iter().map(|(name, count)| match kinds.len() {
        1 => (*name).to_owned(),
        _ => format!("{count} {name}"),
    });
    let list = list.collect::<Vec<_>>().join(", ");
    Some(match total {
        0 => sentence + ".",
        1 => format!("{sentence}; 1 more peak is not counted ({list})."),
        count => format!("{sentence}; {count} more peaks are not counted ({list})."),
    })
}

fn estimate(document: &Document) -> Option<String> {
    let Some(estimate) = document.estimate.as_ref()? else {
        return no_estimate(document).map(|words| capital(&words) + ".");
    };
    let physical = physical(estimate, stiffness);
    if physical.is_empty() {
        return None;
    }
    let doubt = estimate.reason.as_ref();
    let doubt = doubt.map_or(String::new(), |reason| format!(" Doubtful: {reason}."));
    let physical = match joint_if_confirmed(document) {
        Some(_) => format!("As described: {}", physical.join("; ")),
        None => capital(&physical.join("; ")),
    };
    Some(format!("{physical}.{doubt}"))
}

/// The joint with the cause, or with each of several; `None` where the headline is the described model's.
fn joint_if_confirmed(document: &Document) -> Option<String> {
    let headline = document.headline.as_ref()?;
    let joint = joint_with(headline)?;
    Some(format!(
        "The joint {}, if confirmed: {joint}.",
        headline.model
    ))
}

/// "translational stiffness Kt = 1.79 MN/m (95 %: 1.60 to 2.01; from the readings alone 1.7890 to 1.7908)".
fn stiffness(parameter: &Parameter<'_>) -> String {
    let [value, _, low, high, unit] = parameter.written();
    let unit = behind(parameter, &unit.replace(' ', "\u{a0}"));
    let [low, high] = [&low, &high].map(|end| Some(end.as_str()).filter(|end| *end != MISSING));
    let interval = match (parameter.value.low, parameter.value.high) {
        // More digits of a stiffness than that say nothing; how narrow the interval is does.
        (Some(from), Some(to)) if low == high && to > from && parameter.value.value != 0.0 => {
            let half = 50.0 * (to - from) / parameter.value.value.abs();
            Some(format!("\u{b1}{} %", significant(half, 2)))
        }
        _ => limits(low, high),
    };
    let interval = interval.map_or_else(String::new, |limits| format!(" (95 %: {limits})"));
    format!(
        "{} {}\u{a0}=\u{a0}{value}{unit}{interval}",
        parameter.meaning, parameter.symbol
    )
}

/// The mode that the model misses most.
fn most_missed(document: &Document) -> Option<&PredictionSection> {
    let rows = document.prediction.as_deref()?.iter();
    let compared = rows.filter_map(|row| Some((row.error_percent?.abs(), row)));
    let compared = compared.filter(|(size, _)| size.is_finite());
    let worst = compared.max_by(|a, b| a.0.total_cmp(&b.0));
    worst.map(|(_, row)| row)
}

/// The largest misfit among the modes, with what the reading alone explains.
fn misfit(document: &Document) -> Option<String> {
    let largest = most_missed(document)?;
    let used = if largest.used { "used" } else { "not used" };
    let bound = reading_bound(document, largest.mode)
        .zip(largest.measured)
        .map(|(bound, hz)| 100.0 * bound / hz);
    let reading = bound.map_or(String::new(), |percent| {
        format!(
            "; the reading itself is good to {} %",
            bound_percent(percent)
        )
    });
    Some(format!(
        "The largest difference between predicted and measured frequency is {} % (mode {}, {used} in the estimate{reading}).",
        signed_or_below(largest.error_percent?),
        largest.mode
    ))
}

/// Returns the spans of the stiffness if frequencies were read on lines only. `None` where the model misses the
/// frequencies by more: the spans would look like the uncertainty of the joint.
fn resolution(document: &Document) -> Option<String> {
    let estimate = document.estimate.as_ref().and_then(Option::as_ref);
    if estimate.is_some_and(|estimate| estimate.reason.is_some()) {
        return None;
    }
    let main = estimate.map(|estimate| estimate.method);
    let spans = document.resolution_span.as_deref()?;
    // The span of the estimate's own method; else the only one.
    let span = spans.iter().find(|span| Some(span.method) == main);
    let span = span.or(spans.first())?;
    let ranges = [("Kx", span.kx), ("Ky", span.ky), ("Kz", span.kz)];
    let ranges = ranges.into_iter().filter_map(|(name, range)| {
        let [low, high] = range?.map(|end| significant(end, 4));
        Some(format!("{name} from {low} to {high}"))
    });
    let ranges: Vec<String> = ranges.collect();
    if ranges.is_empty() {
        return None;
    }
    let failed = match span.failed {
        0 => String::new(),
        failed => format!(", and {failed} of {} leave no estimate", span.patterns),
    };
    // The bound that the spans were computed from: beside a frequency read between the lines, "bound" alone would
    // be taken for that one's.
    let mut modes = document.modes.iter().flatten();
    let bound =
        match modes.any(|mode| matches!(mode.method, Some(ReadBy::Fit | ReadBy::Interpolated))) {
            true => "half line (as if it had been read on a line only)",
            false => "bound",
        };
    Some(format!(
        "With every frequency anywhere within its {bound}, the non-dimensional stiffness is {}{failed}.",
        ranges.join(", ")
    ))
}
