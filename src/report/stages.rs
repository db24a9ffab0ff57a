//! What each stage used, line by line, for who asks to be told more.

use super::document::{Document, EstimateSection, ModeSection, RecordingSection, TapSection};
use super::format::{significant, trimmed};

/// A line for each recording, the peaks and the estimate; empty where nothing was computed.
pub fn render_stages(document: &Document) -> String {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let mut lines: Vec<String> = recordings.iter().map(recording).collect();
    lines.extend(document.modes.as_deref().map(modes));
    lines.extend(document.estimate.iter().flatten().flat_map(estimate));
    ended(&lines)
}

/// Every tap and every peak of every recording; empty without recordings.
pub fn render_readings(document: &Document) -> String {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let lines = recordings.iter().flat_map(|recording| {
        let file = &recording.file;
        let taps = recording.taps.iter().map(tap);
        let peaks = recording.modes.iter().map(peak);
        taps.chain(peaks)
            .map(move |words| format!("{file}: {words}"))
            .collect::<Vec<String>>()
    });
    ended(&lines.collect::<Vec<String>>())
}

fn ended(lines: &[String]) -> String {
    lines.iter().map(|line| format!("{line}\n")).collect()
}

fn recording(found: &RecordingSection) -> String {
    let accepted = found.taps.iter().filter(|tap| tap.accepted).count();
    let mut parts = vec![format!("{} channels", found.channels)];
    if let Some((rate, seconds)) = found.sample_rate.zip(found.seconds) {
        parts.push(format!("{} Hz, {seconds:.2} s", trimmed(rate, 6)));
        parts.push(format!("{accepted} of {} taps accepted", found.taps.len()));
    }
    if let Some([low, high]) = found.band {
        parts.push(format!("{} to {} Hz", trimmed(low, 6), trimmed(high, 6)));
    }
    if let Some((block, spacing)) = found.block.zip(found.line_spacing) {
        let spacing = significant(spacing, 4);
        parts.push(format!(
            "blocks of {block} samples, lines {spacing} Hz apart"
        ));
    }
    if let Some(window) = &found.window {
        parts.push(format!("{window} window"));
    }
    format!("{}: {}", found.file, parts.join("; "))
}

fn modes(modes: &[ModeSection]) -> String {
    let numbered = modes.iter().filter(|mode| mode.mode.is_some()).count();
    format!("modes: {} peaks, {numbered} with a number", modes.len())
}

fn estimate(found: &EstimateSection) -> Vec<String> {
    let modes: Vec<String> = found.modes_used.iter().map(usize::to_string).collect();
    let misfit = found.misfit.as_ref();
    let verdict = misfit.map_or(String::new(), |misfit| format!("; {}", misfit.verdict));
    let head = format!(
        "{} from modes {}{verdict}",
        found.method.name(),
        modes.join(", ")
    );
    let more = found.identifiability.iter().flat_map(|can| &can.statements);
    std::iter::once(&head)
        .chain(more)
        .map(|words| format!("estimate: {words}"))
        .collect()
}

fn tap(tap: &TapSection) -> String {
    let fate = match (&tap.reason, tap.accepted) {
        (Some(reason), _) => reason.as_str(),
        (None, true) => "accepted",
        (None, false) => "rejected",
    };
    format!("tap at {:.3} s, {fate}", tap.time)
}

fn peak(mode: &ModeSection) -> String {
    let what = match (mode.mode, &mode.label) {
        (Some(number), _) => format!("mode {number}"),
        (None, Some(label)) => label.clone(),
        (None, None) => "no number".to_owned(),
    };
    let frequency = significant(mode.frequency, 7);
    format!("peak at {frequency} Hz ({}), {what}", mode.method.name())
}
