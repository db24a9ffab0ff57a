//! Tables and findings for a terminal of 80 columns, without colours.

use super::brief::brief;
use super::document::{Document, ModeSection, ReadBy};
use super::format::signed_percent;
use super::tables::{self, Table};
use super::text_table::cut;
pub use super::text_table::render_table;

/// Width of the terminal (characters).
pub const WIDTH: usize = 80;
/// Most taps listed one by one.
const MOST_TAPS: usize = 10;

/// Everything the document holds.
pub fn render_text(document: &Document) -> String {
    let sections = [
        table_or_nothing(tables::datasets(document)),
        recordings(document),
        taps(document),
        modes(document),
        frfs(document),
        estimate(document),
        prediction(document),
        super::gap_text::gap(document),
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
        table_or_nothing(tables::taps(document))
    }
}

/// The modes; empty without any, and where their frequency response functions are listed.
pub fn modes(document: &Document) -> String {
    let listed = document.frfs.as_ref().is_some_and(|frfs| !frfs.is_empty());
    let Some(table) = tables::modes(document).filter(|_| !listed) else {
        return String::new();
    };
    let modes = document.modes.as_deref().unwrap_or_default();
    let fitted = modes.iter().any(|mode| mode.method == ReadBy::Fit);
    let note = if fitted {
        let note = format!(
            "Frequency: fit of {}, \u{b1} half the 95 % interval{}; line: the highest spectral line \
             \u{b1} half line; damping \u{b1} one standard deviation.",
            tables::fitted_to(document),
            not_fitted(modes)
        );
        wrapped(&note, 0)
    } else {
        String::new()
    };
    let from = tables::modes_from(document).map_or(String::new(), |from| wrapped(&from, 0));
    render_table(&table) + &note + &from
}

/// " (mode 3: interpolated; mode 4: line)": the numbered modes without a fit; empty where all have one.
fn not_fitted(modes: &[ModeSection]) -> String {
    let others: Vec<String> = modes
        .iter()
        .filter(|mode| mode.method != ReadBy::Fit)
        .filter_map(|mode| Some(format!("mode {}: {}", mode.mode?, mode.method.name())))
        .collect();
    match others.is_empty() {
        true => String::new(),
        false => format!(" ({})", others.join("; ")),
    }
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
            let reason = document.estimate_reason.as_deref();
            let reason = reason.unwrap_or("no reason was recorded");
            wrapped(&format!("No estimate: {reason}."), 0)
        }
        Some(Some(found)) => {
            let mut text = table_or_nothing(tables::parameters(document));
            if let Some(methods) = tables::methods(document) {
                text.push('\n');
                text.push_str(&render_table(&methods));
            }
            let closure = found.pairs.as_ref().and_then(|pairs| pairs.closure);
            if let Some(closure) = closure {
                let percent = signed_percent(Some(100.0 * closure));
                let words = format!(
                    "From modes {}. The pair regression closes to {percent} % (0: no contradiction).",
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
    table_or_nothing(tables::prediction(document))
}

/// What changed frequencies do to the estimate; empty where it was not computed.
pub fn perturbation(document: &Document) -> String {
    let texts = [
        table_or_nothing(tables::perturbation(document)),
        table_or_nothing(tables::averages(document)),
        noted(tables::spans(document)),
        noted(tables::sensitivity(document)),
        noted(tables::monte_carlo(document)),
    ];
    let texts: Vec<String> = texts.into_iter().filter(|text| !text.is_empty()).collect();
    texts.join("\n")
}

/// The checks of good practice that leave a doubt; empty without any. The ending counts them all.
pub fn quality(document: &Document) -> String {
    table_or_nothing(tables::quality_doubts(document))
}

/// The warnings that concern the result; empty without any. Those of the pair regression stand with it.
pub fn warnings(document: &Document) -> String {
    document
        .main_warnings()
        .map(|warning| wrapped(&format!("warning ({}): {}", warning.code, warning.text), 2))
        .collect()
}

/// What was found, in five lines at most (longer where a reason has to be told).
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
pub(super) fn noted(table: Option<Table>) -> String {
    table.map_or(String::new(), |table| {
        render_table(&table) + &wrapped(&table.note, 0)
    })
}

fn table_or_nothing(table: Option<Table>) -> String {
    table.as_ref().map(render_table).unwrap_or_default()
}

fn joined(tables: &[Option<Table>]) -> String {
    let texts: Vec<String> = tables.iter().flatten().map(render_table).collect();
    texts.join("\n")
}

/// Whether a line may be broken here.
fn is_gap(c: char) -> bool {
    c.is_whitespace() && c != '\u{a0}'
}

/// A text broken into lines of at most 80 characters; lines after the first are indented.
pub fn wrapped(text: &str, indent: usize) -> String {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split(is_gap).filter(|word| !word.is_empty()) {
        let word = cut(word, WIDTH - indent);
        let length = |line: &str| line.chars().count();
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(&word),
            Some(line) if length(line) + 1 + length(&word) <= WIDTH => {
                line.push(' ');
                line.push_str(&word);
            }
            _ => lines.push(" ".repeat(indent) + &word),
        }
    }
    // No-break spaces have kept words together; a terminal, and who searches it, wants plain ones.
    lines.join("\n").replace('\u{a0}', " ") + "\n"
}
