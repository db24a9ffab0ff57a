//! What was found, in a few plain sentences.

use super::document::{Document, PredictionSection, RecordingSection};
use super::format::{signed_percent, significant, trimmed};
use super::tables::{estimated, reading_bound};

/// The findings, one sentence or two in each string; what was not computed is not mentioned.
pub fn sentences(document: &Document) -> Vec<String> {
    [
        taps(document),
        modes(document),
        estimate(document),
        misfit(document),
        resolution(document),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn taps(document: &Document) -> Option<String> {
    let recordings = document.recordings.as_deref()?;
    let all: Vec<_> = recordings.iter().flat_map(|r| &r.taps).collect();
    let used = all.iter().filter(|tap| tap.accepted).count();
    let files = match recordings.len() {
        1 => "1 recording".to_owned(),
        count => format!("{count} recordings"),
    };
    if all.is_empty() {
        return Some(format!("No taps were found in {files}."));
    }
    let rejected = match all.len() - used {
        0 => "none was rejected".to_owned(),
        1 => "1 was rejected".to_owned(),
        count => format!("{count} were rejected"),
    };
    Some(format!(
        "{used} of {} taps in {files} were used, {rejected}.",
        all.len()
    ))
}

fn modes(document: &Document) -> Option<String> {
    let modes = document.modes.as_deref()?;
    let numbered: Vec<f64> = modes
        .iter()
        .filter(|mode| mode.mode.is_some())
        .map(|mode| mode.frequency)
        .collect();
    let given = !modes.is_empty() && modes.iter().all(|mode| mode.method == "given");
    let found = if given { "given" } else { "found" };
    let low = numbered.iter().copied().fold(f64::INFINITY, f64::min);
    let high = numbered.iter().copied().fold(0.0, f64::max);
    let mut sentence = match numbered.len() {
        0 => format!("No modes were {found}"),
        1 => format!("1 mode was {found}, at {} Hz", significant(low, 4)),
        count => format!(
            "{count} modes were {found}, from {} to {} Hz",
            significant(low, 4),
            significant(high, 4)
        ),
    };
    let finest = finest(document.recordings.as_deref().unwrap_or_default());
    if let Some(half_line) = finest.filter(|_| !numbered.is_empty()) {
        let half_line = trimmed(half_line, 3);
        sentence.push_str(&format!(
            "; a spectral line holds to \u{b1}{half_line} Hz at best"
        ));
    }
    match modes.len() - numbered.len() {
        0 => {}
        1 => sentence.push_str("; 1 more peak is no mode (mains hum or unpaired)"),
        count => {
            let words = format!("; {count} more peaks are no modes (mains hum or unpaired)");
            sentence.push_str(&words);
        }
    }
    Some(sentence + ".")
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
        .map(|parameter| {
            let [value, _, low, high, unit] = parameter.written();
            let interval = match (parameter.value.low, parameter.value.high) {
                (Some(_), Some(_)) => format!(" (95 %: {low} to {high})"),
                (Some(_), None) => format!(" (95 %: above {low})"),
                (None, Some(_)) => format!(" (95 %: below {high})"),
                (None, None) => String::new(),
            };
            format!(
                "{} {} = {value} {unit}{interval}",
                parameter.meaning, parameter.symbol
            )
        })
        .collect();
    if physical.is_empty() {
        return None;
    }
    let doubt = estimate.reason.as_ref();
    let doubt = doubt.map_or(String::new(), |reason| format!(" Doubtful: {reason}."));
    Some(format!("{}.{doubt}", capital(&physical.join("; "))))
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// The largest misfit among the modes, with what the reading alone explains.
fn misfit(document: &Document) -> Option<String> {
    let prediction = document.prediction.as_deref()?;
    let size = |row: &&PredictionSection| row.error_percent.map_or(-1.0, f64::abs);
    let largest = prediction
        .iter()
        .filter(|row| row.error_percent.is_some_and(f64::is_finite))
        .max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let used = if largest.used { "used" } else { "not used" };
    let bound = reading_bound(document, largest.mode)
        .zip(largest.measured)
        .map(|(bound, hz)| 100.0 * bound / hz);
    let reading = bound.map_or(String::new(), |percent| {
        format!(
            "; the reading itself is good to \u{b1}{} %",
            significant(percent, 2)
        )
    });
    Some(format!(
        "The largest difference between predicted and measured frequency is {} % (mode {}, {used} in the estimate{reading}).",
        signed_percent(largest.error_percent),
        largest.mode
    ))
}

fn resolution(document: &Document) -> Option<String> {
    let span = document.resolution_span.as_ref()?;
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
        "With every frequency anywhere within its reading's bound, the non-dimensional stiffness is {}{failed}.",
        ranges.join(", ")
    ))
}
