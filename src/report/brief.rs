//! The answer for a terminal, in 25 lines at most.

use crate::document::Document;
use crate::screen::Screen;
use crate::tables::{Table, answered_joint};
use crate::words::answer::{Answer, MOST_MODES};

/// Most lines of an answer on 80 columns or more, with the line of the report's path.
pub const MOST_LINES: usize = 25;
/// Lines that the modes have at least: an empty line on either side, a heading, three of them, and the count of the others.
const LEAST_OF_MODES: usize = 7;

/// Returns the answer: how far it can be relied on, the modes, the joint, what is missing, and what to do.
/// `report` is the path of the report, where one was written. Findings and modes for which `most` lines have no room are
/// counted.
pub fn render_answer(
    document: &Document,
    report: Option<&str>,
    most: usize,
    screen: Screen,
) -> String {
    let answer = Answer::of(document);
    let mut title = answer.name.clone();
    if let Some(state) = answer.state {
        title.push_str(&format!(": {}", state.name()));
        if !answer.reason.is_empty() {
            title.push_str(&format!(", {}", answer.reason));
        }
    }
    let mut head = screen.wrapped(&title, 2);
    if !answer.measured.is_empty() {
        head.push_str(&screen.wrapped(&answer.measured.join("; "), 2));
    }
    let joint = answered_joint(&answer.values, answer.model.as_deref());
    let joint = joint.map_or(String::new(), |table| screen.table(&table) + "\n");
    let mut tail = String::new();
    if let Some(action) = &answer.action {
        tail.push_str(&screen.wrapped(&format!("> {action}"), 2));
    }
    tail.push_str(&doubts(&answer, screen));
    if let Some(report) = report {
        tail.push_str(&format!("Report  {report}\n"));
    }
    let used = [&head, &joint, &tail].map(|part| part.lines().count());
    let room = most.saturating_sub(used.iter().sum());
    let findings = findings(&answer, room.saturating_sub(LEAST_OF_MODES), screen);
    let room = room.saturating_sub(findings.lines().count());
    let modes = modes(document, &answer, room, screen);
    // What changed comes before the frequencies that show it.
    match answer.state {
        Some(_) => format!("{head}\n{modes}{joint}{findings}{tail}"),
        None => format!("{head}\n{findings}\n{modes}{joint}{tail}"),
    }
}

/// Returns the answer so far, in a few sentences: it is renewed while somebody taps.
pub fn render_progress(document: &Document) -> Vec<String> {
    let answer = Answer::of(document);
    let mut lines = Vec::new();
    if let Some(state) = answer.state {
        let reason = match answer.reason.as_str() {
            "" => String::new(),
            reason => format!(", {reason}"),
        };
        lines.push(format!("so far {}{reason}", state.name()));
    }
    lines.extend(answer.measured.first().cloned());
    // The second column is the frequency.
    let strong = answer.strong_rows();
    let frequencies: Vec<&str> = strong.iter().map(|row| row[1].as_str()).collect();
    if !frequencies.is_empty() {
        let lowest = lowest_coherence(document);
        let coherence = lowest.map_or(String::new(), |(mode, coherence)| {
            format!("; lowest coherence {coherence:.3} (mode {mode})")
        });
        lines.push(format!("modes {} Hz{coherence}", frequencies.join("; ")));
    }
    let mut values = Vec::new();
    for value in &answer.values {
        values.push(format!(
            "{} {}\u{a0}{}",
            value.symbol,
            value.first(),
            value.unit
        ));
    }
    if !values.is_empty() {
        let model = answer.model.as_deref();
        let model = model.map_or(String::new(), |model| format!(", {model}"));
        lines.push(values.join("; ") + &model);
    }
    lines.extend(answer.findings);
    lines.extend(answer.action.map(|action| format!("> {action}")));
    lines
}

/// The numbered mode with the lowest coherence (1) on its line; `None` below two averages.
fn lowest_coherence(document: &Document) -> Option<(usize, f64)> {
    let modes = document.modes.iter().flatten();
    let known = modes.filter_map(|mode| mode.mode.zip(mode.coherence));
    known.min_by(|one, other| one.1.total_cmp(&other.1))
}

/// The findings in so many lines: the first ones where there is no room for all.
fn findings(answer: &Answer, lines: usize, screen: Screen) -> String {
    let mut text = String::new();
    for (place, finding) in answer.findings.iter().enumerate() {
        let own = screen.wrapped(finding, 2);
        let others = answer.findings.len() - place;
        // The first always stands, and the line that counts the others needs room.
        let needed = text.lines().count() + own.lines().count() + usize::from(others > 1);
        if place > 0 && needed > lines {
            text.push_str(&format!("and {others} more (--full)\n"));
            break;
        }
        text.push_str(&own);
    }
    text
}

/// The modes in so many lines: the strongest where there is no room for all.
fn modes(document: &Document, answer: &Answer, lines: usize, screen: Screen) -> String {
    let Some(all) = &answer.modes else {
        return String::new();
    };
    // A heading, a line that counts the others, and an empty line on either side.
    let room = lines.saturating_sub(4).clamp(1, MOST_MODES);
    let rows = answer.strongest_rows(room).into_iter();
    let shown = Table {
        rows: rows.cloned().collect(),
        ..all.clone()
    };
    let mut text = screen.table(&shown);
    let others = all.rows.len() - shown.rows.len();
    let described = document.kind().is_some();
    let word = if described { "mode" } else { "resonance" };
    match others {
        0 => {}
        1 => text.push_str(&format!("and 1 weaker {word} (--full)\n")),
        others => text.push_str(&format!("and {others} weaker {word}s (--full)\n")),
    }
    text + "\n"
}

/// The worst doubt, and how many others there are; empty without any.
fn doubts(answer: &Answer, screen: Screen) -> String {
    let Some((worst, others)) = answer.doubts.split_first() else {
        return String::new();
    };
    let others = match others.len() {
        0 => "--full".to_owned(),
        1 => "1 more doubt: --full".to_owned(),
        count => format!("{count} more doubts: --full"),
    };
    screen.wrapped(&format!("! {worst} ({others})"), 2)
}
