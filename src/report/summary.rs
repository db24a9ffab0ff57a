//! What was found, in a few plain sentences.

use super::document::{
    Document, EstimateSection, ModeSection, PredictionSection, ReadBy, RecordingSection,
};
use super::format::{bound_percent, signed_or_below, significant, trimmed};
use super::tables::{Parameter, estimated, gap_in_short, gap_story, quality_count, reading_bound};
use tapjoint_identify::observation::UNPAIRED;

/// The findings, one sentence or two in each string; what was not computed is not mentioned.
pub fn sentences(document: &Document) -> Vec<String> {
    let first = [taps(document), channels(document), modes(document)];
    let rest = [
        quality_count(document).map(|count| capital(&count) + "."),
        estimate(document),
        misfit(document),
        gap_story(document).into_iter().next(),
    ];
    let last = [resolution(document), described(document)];
    let first = first.into_iter().flatten();
    first
        .chain(amplitudes(document))
        .chain(rest.into_iter().flatten())
        .chain(gap_in_short(document))
        .chain(last.into_iter().flatten())
        .collect()
}

/// What a description would add to a bare recording; `None` where there is one, and of what was not analysed.
pub(super) fn described(document: &Document) -> Option<String> {
    let bare = document
        .test
        .as_ref()
        .is_some_and(|test| test.kind.is_none());
    let modes = document.modes.as_deref().unwrap_or_default();
    let analysed = document.recordings.is_some() && !modes.is_empty();
    (bare && analysed && document.frfs.is_none()).then(|| {
        "A description of the beam (tapjoint\u{a0}init\u{a0}>\u{a0}test.toml) would add mode numbers, measured \
         beside predicted frequencies, the joint's stiffness and the diagnosis of the gap."
            .to_owned()
    })
}

/// One sentence for each mode that changes with the amplitude.
fn amplitudes(document: &Document) -> Vec<String> {
    let modes = document.modes.as_deref().unwrap_or_default();
    let sentence = |mode: &ModeSection| {
        let change = mode.fit.as_ref()?.amplitude.as_ref()?.ends.as_ref()?;
        let change = change.to_string();
        // A number stays on the line of its unit.
        let change = change.replace(" Hz", "\u{a0}Hz").replace(" %", "\u{a0}%");
        Some(format!("Caution: mode {} {change}.", mode.mode?))
    };
    modes.iter().filter_map(sentence).collect()
}

fn taps(document: &Document) -> Option<String> {
    let recordings = document.recordings.as_deref().filter(|r| !r.is_empty())?;
    let all: Vec<_> = recordings.iter().flat_map(|r| &r.taps).collect();
    let used = all.iter().filter(|tap| tap.accepted).count();
    let files = counted(recordings.len(), "recording");
    // Functions from a file have no samples in time.
    let functions = recordings
        .iter()
        .all(|recording| recording.sample_rate.is_none());
    let total = all.len();
    let found = match total {
        1 => format!("1 tap was found in {files}"),
        count => format!("{count} taps were found in {files}"),
    };
    // Of recordings that were only looked at, nothing was used yet.
    let were_used = if document.modes.is_none() {
        ["can be used"; 2]
    } else {
        ["was used", "were used"]
    };
    let [was_used, were_used] = were_used;
    Some(match (total, used) {
        (0, _) if functions => {
            format!("{files} of frequency response functions: there are no taps to judge.")
        }
        (0, _) => format!("No taps were found in {files}."),
        (1, 1) => format!("{found}, and it {was_used}."),
        (1, _) => format!("{found}, and it was rejected."),
        (_, 0) => format!("{found}, and all were rejected."),
        _ if used == total => format!("{found}, and all {were_used}."),
        _ => {
            let rejected = total - used;
            let were = if rejected == 1 { "was" } else { "were" };
            format!("{used} of {total} taps in {files} {were_used}, {rejected} {were} rejected.")
        }
    })
}

/// "1 recording", "3 recordings".
fn counted(count: usize, word: &str) -> String {
    let ending = if count == 1 { "" } else { "s" };
    format!("{count} {word}{ending}")
}

/// On what taps were looked for where there is no hammer.
pub(super) fn channels(document: &Document) -> Option<String> {
    let recordings = document.recordings.as_deref()?;
    let mut names: Vec<&str> = Vec::new();
    for recording in recordings.iter().filter(|recording| !recording.has_hammer) {
        for name in &recording.responses {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
    }
    let names = match names.as_slice() {
        [] => return None,
        [one] => (*one).to_owned(),
        [all @ .., last] => format!("{} and {last}", all.join(", ")),
    };
    Some(format!(
        "There is no hammer channel: taps were looked for on {names}, and without the force there is \
         no frequency response function."
    ))
}

fn modes(document: &Document) -> Option<String> {
    let modes = document.modes.as_deref()?;
    let numbered: Vec<f64> = modes
        .iter()
        .filter(|mode| mode.mode.is_some())
        .map(|mode| mode.frequency)
        .collect();
    let given = !modes.is_empty() && modes.iter().all(|mode| mode.method == ReadBy::Given);
    let found = if given { "given" } else { "found" };
    let described = document.test.iter().any(|test| test.kind.is_some());
    let word = if described { "mode" } else { "resonance" };
    let low = numbered.iter().copied().fold(f64::INFINITY, f64::min);
    let high = numbered.iter().copied().fold(0.0, f64::max);
    let mut sentence = match numbered.len() {
        0 => format!("No {word}s were {found}"),
        1 => format!("1 {word} was {found}, at {} Hz", significant(low, 4)),
        count => format!(
            "{count} {word}s were {found}, from {} to {} Hz",
            significant(low, 4),
            significant(high, 4)
        ),
    };
    let finest = finest(document.recordings.as_deref().unwrap_or_default());
    if let Some(half_line) = finest.filter(|_| !numbered.is_empty()) {
        let half_line = trimmed(half_line, 3);
        sentence.push_str(&format!(
            "; a reading on a spectral line is good to \u{b1}{half_line} Hz at best"
        ));
    }
    sentence.push_str(&others(modes));
    Some(sentence + ".")
}

/// How many peaks were left out, and as what: "; 3 more peaks are not counted (2 no clear
/// resonance, 1 mains 50 Hz)".
fn others(modes: &[ModeSection]) -> String {
    let mut kinds: Vec<(&str, usize)> = Vec::new();
    for mode in modes.iter().filter(|mode| mode.mode.is_none()) {
        let name = mode.label.as_deref().unwrap_or(UNPAIRED);
        match kinds.iter_mut().find(|(known, _)| *known == name) {
            Some((_, count)) => *count += 1,
            None => kinds.push((name, 1)),
        }
    }
    let total: usize = kinds.iter().map(|(_, count)| count).sum();
    let list: Vec<String> = kinds
        .iter()
        .map(|(name, count)| match kinds.len() {
            1 => (*name).to_owned(),
            _ => format!("{count} {name}"),
        })
        .collect();
    match total {
        0 => String::new(),
        1 => format!("; 1 more peak is not counted ({})", list.join(", ")),
        count => format!("; {count} more peaks are not counted ({})", list.join(", ")),
    }
}

/// The smallest half-line bound of all recordings (Hz).
fn finest(recordings: &[RecordingSection]) -> Option<f64> {
    let bounds = recordings
        .iter()
        .filter_map(|recording| recording.half_line);
    bounds.min_by(f64::total_cmp)
}

fn estimate(document: &Document) -> Option<String> {
    let Some(estimate) = document.estimate.as_ref()? else {
        let reason = document.estimate_reason.as_deref();
        let reason = reason.unwrap_or("no reason was recorded");
        return Some(format!("No stiffness was estimated: {reason}."));
    };
    let physical: Vec<String> = estimated(estimate)
        .iter()
        .filter(|parameter| parameter.unit != "1")
        .map(stiffness)
        .collect();
    if physical.is_empty() {
        return None;
    }
    let doubt = estimate.reason.as_ref();
    let doubt = doubt.map_or(String::new(), |reason| format!(" Doubtful: {reason}."));
    Some(format!("{}.{doubt}", capital(&physical.join("; "))))
}

/// "translational stiffness Kt = 1.79 MN/m (95 %: 1.60 to 2.01, scaled by the misfit; from the frequencies' uncertainty
/// alone 1.7890 to 1.7908)": what may be trusted first.
fn stiffness(parameter: &Parameter<'_>) -> String {
    let [exact, _, low, high, unit] = parameter.written();
    let unit = unit.replace(' ', "\u{a0}");
    let own = match (parameter.value.low, parameter.value.high) {
        // More digits of a stiffness than that say nothing; how narrow the interval is does.
        (Some(from), Some(to)) if low == high && to > from && parameter.value.value != 0.0 => {
            format!(
                "\u{b1}{} %",
                significant(50.0 * (to - from) / parameter.value.value.abs(), 2)
            )
        }
        (Some(_), Some(_)) => format!("{low} to {high}"),
        (Some(_), None) => format!("above {low}"),
        (None, Some(_)) => format!("below {high}"),
        (None, None) => String::new(),
    };
    let alone = match own.is_empty() {
        true => String::new(),
        false => format!("; from the frequencies' uncertainty alone {own}"),
    };
    let (value, interval) = match (
        parameter.value.std_scaled,
        parameter.written_scaled_limits(),
    ) {
        (Some(_), Some([low, high])) => (
            parameter.written_together().value,
            format!(" (95 %: {low} to {high}, scaled by the misfit{alone})"),
        ),
        (Some(_), None) => (
            parameter.written_together().value,
            format!(
                " (standard deviation scaled by the misfit {}\u{a0}{unit}{alone})",
                parameter.written_scaled()
            ),
        ),
        (None, _) if own.is_empty() => (exact, String::new()),
        (None, _) => (exact, format!(" (95 %: {own})")),
    };
    format!(
        "{} {}\u{a0}=\u{a0}{value}\u{a0}{unit}{interval}",
        parameter.meaning, parameter.symbol
    )
}

pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// The mode that the model misses most.
pub(super) fn most_missed(document: &Document) -> Option<&PredictionSection> {
    let size = |row: &&PredictionSection| row.error_percent.map_or(-1.0, f64::abs);
    let rows = document.prediction.as_deref()?.iter();
    rows.filter(|row| row.error_percent.is_some_and(f64::is_finite))
        .max_by(|a, b| size(a).total_cmp(&size(b)))
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

/// What reading on lines alone would leave open; nothing beside a misfit that is larger than what the readings leave
/// open, for the spans would look like what is known of the joint.
fn resolution(document: &Document) -> Option<String> {
    let estimate = document.estimate.as_ref().and_then(Option::as_ref);
    let misses = |estimate: &EstimateSection| {
        let all = estimated(estimate);
        all.iter().any(|one| one.value.std_scaled.is_some())
    };
    if estimate.is_some_and(misses) {
        return None;
    }
    let main = estimate.map(|estimate| estimate.method);
    let spans = document.resolution_span.as_deref()?;
    // Of the method that the estimate is by; else of the one that there is.
    let span = spans.iter().find(|span| Some(span.method) == main);
    let span = span.or(spans.first())?;
    let ranges: Vec<String> = [("Kx", span.kx), ("Ky", span.ky), ("Kz", span.kz)]
        .into_iter()
        .filter_map(|(name, range)| {
            let [low, high] = range?;
            Some(format!(
                "{name} from {} to {}",
                significant(low, 4),
                significant(high, 4)
            ))
        })
        .collect();
    let failed = match span.failed {
        0 => String::new(),
        failed => format!(", and {failed} of {} leave no estimate", span.patterns),
    };
    if ranges.is_empty() {
        return None;
    }
    Some(format!(
        "With every frequency anywhere within its {}, the non-dimensional stiffness is {}{failed}.",
        bound_name(document),
        ranges.join(", ")
    ))
}

/// What the spans were computed from: beside a frequency read between the lines, "bound" alone would
/// be taken for that one's.
fn bound_name(document: &Document) -> &'static str {
    let modes = document.modes.as_deref().unwrap_or_default();
    let between = modes
        .iter()
        .any(|mode| matches!(mode.method, ReadBy::Fit | ReadBy::Interpolated));
    if between {
        "half line (as if it had been read on a line only)"
    } else {
        "bound"
    }
}
