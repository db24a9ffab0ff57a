//! Tables and findings for a terminal of 80 columns, without colours.

use super::document::{Document, ReadBy, RecordingSection, method_name};
use super::format::{capital, signed_percent, significant, trimmed};
use super::tables::{self, Table};
pub use super::text_table::{render_table, wrapped};
use super::words::findings::{brief, no_estimate};
use super::words::gap::gap_story;

/// Most taps listed one by one.
const MOST_TAPS: usize = 10;

/// Everything the document holds.
pub fn render_text(document: &Document) -> String {
    let sections = [
        joined(&[tables::datasets(document)]),
        recordings(document),
        taps(document),
        modes(document),
        frfs(document),
        estimate(document),
        prediction(document),
        gap(document),
        perturbation(document),
        quality(document),
        warnings(document),
        ending(document),
    ];
    let mut text = String::new();
    for section in sections.iter().filter(|section| !section.is_empty()) {
        if !text.is_empty() {
            text.push('\n');
        }
        text.push_str(section);
    }
    text
}

/// The recordings, and of recordings that were only looked at their channels; empty without any.
pub fn recordings(document: &Document) -> String {
    let inspected = document.modes.is_none();
    let channels = tables::channels(document).filter(|_| inspected);
    joined(&[tables::recordings(document), channels])
}

/// The taps; empty without any. Of many taps the rejected ones, and how many were used.
pub fn taps(document: &Document) -> String {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let count: usize = recordings
        .iter()
        .map(|recording| recording.taps.len())
        .sum();
    if count > MOST_TAPS {
        joined(&[tables::taps_used(document), tables::rejected_taps(document)])
    } else {
        joined(&[tables::taps(document)])
    }
}

/// The modes; empty without any, and where their frequency response functions are listed.
pub fn modes(document: &Document) -> String {
    let listed = document.frfs.as_ref().is_some_and(|frfs| !frfs.is_empty());
    let Some(table) = tables::modes(document).filter(|_| !listed) else {
        return String::new();
    };
    let modes = document.modes.as_deref().unwrap_or_default();
    let fitted = modes.iter().any(|mode| mode.method == Some(ReadBy::Fit));
    let note = if fitted {
        // The numbered modes without a fit: " (mode 3: interpolated; mode 4: line)".
        let others = modes.iter().filter(|mode| mode.method != Some(ReadBy::Fit));
        let others = others
            .filter_map(|mode| Some(format!("mode {}: {}", mode.mode?, method_name(mode.method))));
        let others: Vec<String> = others.collect();
        let others = match others.is_empty() {
            true => String::new(),
            false => format!(" ({})", others.join("; ")),
        };
        let note = format!(
            "Frequency: fit of {}, \u{b1} half the 95 % interval{others}; line: the highest spectral line \
             \u{b1} half line; damping \u{b1} one standard deviation.",
            tables::fitted_to(document),
        );
        wrapped(&note, 0)
    } else {
        String::new()
    };
    let from = tables::modes_from(document).map_or(String::new(), |from| wrapped(&from, 0));
    render_table(&table) + &note + &from
}

/// The resonances on the frequency response functions; empty where those were not asked for.
pub fn frfs(document: &Document) -> String {
    noted(tables::frfs(document))
}

/// The estimate and how far its regression closes, or why there is none; empty where it was not
/// asked for.
pub fn estimate(document: &Document) -> String {
    match &document.estimate {
        None => String::new(),
        Some(None) => {
            let words = no_estimate(document).unwrap_or_default();
            wrapped(&format!("{}.", capital(&words)), 0)
        }
        Some(Some(found)) => {
            let mut text = joined(&[tables::parameters(document)]);
            if let Some(methods) = tables::methods(document) {
                text.push('\n');
                text.push_str(&render_table(&methods));
            }
            let closure = found.pairs.as_ref().and_then(|pairs| pairs.closure);
            if let Some(closure) = closure {
                let percent = signed_percent(Some(100.0 * closure));
                let words = format!(
                    "From modes {}. The pair regression contradicts itself by {percent} % (0: not at all).",
                    listed(&found.modes_used)
                );
                text.push_str(&wrapped(&words, 0));
            }
            for warning in document.warnings_beside() {
                let note = format!("note ({}): {}", warning.code, warning.text);
                text.push_str(&wrapped(&note, 2));
            }
            text
        }
    }
}

fn listed(modes: &[usize]) -> String {
    let modes: Vec<String> = modes.iter().map(usize::to_string).collect();
    modes.join(", ")
}

/// Measured beside predicted frequencies; empty without a prediction.
pub fn prediction(document: &Document) -> String {
    joined(&[tables::prediction(document)])
}

/// The estimates under changed frequencies; empty where it was not computed.
pub fn perturbation(document: &Document) -> String {
    let texts = [
        joined(&[tables::perturbation(document)]),
        joined(&[tables::averages(document)]),
        noted(tables::spans(document)),
        noted(tables::sensitivity(document)),
        noted(tables::monte_carlo(document)),
    ];
    let texts: Vec<String> = texts.into_iter().filter(|text| !text.is_empty()).collect();
    texts.join("\n")
}

/// The checks of good practice that leave a doubt; empty without any. The ending counts them all.
pub fn quality(document: &Document) -> String {
    joined(&[tables::quality_doubts(document)])
}

/// The warnings that concern the result; empty without any. Those of the pair regression stand with it.
pub fn warnings(document: &Document) -> String {
    document
        .main_warnings()
        .map(|warning| wrapped(&format!("warning ({}): {}", warning.code, warning.text), 2))
        .collect()
}

/// The findings, in five lines at most (longer where a reason is given).
pub fn ending(document: &Document) -> String {
    let lines = brief(document);
    if lines.is_empty() {
        return String::new();
    }
    let lines = lines
        .iter()
        .map(|(about, words)| wrapped(&format!("{:\u{a0}<8}{words}", about), 8));
    format!("What was found\n{}", lines.collect::<String>())
}

/// A table with what its columns mean.
fn noted(table: Option<Table>) -> String {
    table.map_or(String::new(), |table| {
        render_table(&table) + &wrapped(&table.note, 0)
    })
}

fn joined(tables: &[Option<Table>]) -> String {
    let texts: Vec<String> = tables.iter().flatten().map(render_table).collect();
    texts.join("\n")
}

/// The errors of the nominal model, the story of the gap, and the hypotheses.
pub fn render_gap_text(document: &Document) -> String {
    let sections = [prediction(document), gap(document), warnings(document)];
    let said: Vec<String> = sections.into_iter().filter(|s| !s.is_empty()).collect();
    said.join("\n")
}

/// The story of the gap and the hypotheses; empty without a diagnosis.
fn gap(document: &Document) -> String {
    let story: String = gap_story(document)
        .iter()
        .map(|sentence| wrapped(sentence, 2) + "\n")
        .collect();
    let tables = [tables::hypotheses(document), tables::next_tests(document)];
    let tables: Vec<String> = tables
        .into_iter()
        .map(noted)
        .filter(|table| !table.is_empty())
        .collect();
    let tables = tables.join("\n");
    if story.is_empty() || tables.is_empty() {
        return story + &tables;
    }
    format!("{story}\n{tables}")
}

/// Returns a line for each recording, the peaks and the estimate; empty where nothing was computed.
pub fn render_stages(document: &Document) -> String {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let mut lines: Vec<String> = recordings.iter().map(recording_stage).collect();
    if let Some(modes) = &document.modes {
        let numbered = modes.iter().filter(|mode| mode.mode.is_some()).count();
        let peaks = modes.len();
        lines.push(format!("modes: {peaks} peaks, {numbered} with a number"));
    }
    if let Some(found) = document.estimate.as_ref().and_then(Option::as_ref) {
        let mut head = format!(
            "estimate: {} from modes {}",
            found.method.name(),
            listed(&found.modes_used)
        );
        if let Some(misfit) = &found.misfit {
            head.push_str(&format!("; {}", misfit.verdict));
        }
        lines.push(head);
        let statements = found.identifiability.iter().flat_map(|can| &can.statements);
        lines.extend(statements.map(|words| format!("estimate: {words}")));
    }
    lines.iter().map(|line| format!("{line}\n")).collect()
}

fn recording_stage(found: &RecordingSection) -> String {
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

/// Returns every tap and every peak of every recording; empty without recordings.
pub fn render_readings(document: &Document) -> String {
    let mut text = String::new();
    for recording in document.recordings.iter().flatten() {
        let file = &recording.file;
        for tap in &recording.taps {
            let fate = match (&tap.reason, tap.accepted) {
                (Some(reason), _) => reason.as_str(),
                (None, true) => "accepted",
                (None, false) => "rejected",
            };
            text.push_str(&format!("{file}: tap at {:.3} s, {fate}\n", tap.time));
        }
        for mode in &recording.modes {
            let name = match (mode.mode, &mode.label) {
                (Some(number), _) => format!("mode {number}"),
                (None, Some(label)) => label.clone(),
                (None, None) => "no number".to_owned(),
            };
            let (frequency, method) = (significant(mode.frequency, 7), method_name(mode.method));
            text.push_str(&format!(
                "{file}: peak at {frequency} Hz ({method}), {name}\n"
            ));
        }
    }
    text
}
