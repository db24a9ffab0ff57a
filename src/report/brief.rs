//! The answer for a terminal, in 25 lines at most.

use crate::document::Document;
use crate::screen::Screen;
use crate::tables::Table;
use crate::words::answer::{Answer, MOST_MODES};

/// Most lines of an answer, with the line of the report's path.
const MOST_LINES: usize = 25;
/// Returns the answer: how far it can be relied on, the modes, the joint, what is missing, and what to do.
/// `report` is the path of the report, where one was written.
pub fn render_answer(document: &Document, report: Option<&str>, screen: Screen) -> String {
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
    let mut findings = String::new();
    for finding in &answer.findings {
        findings.push_str(&screen.wrapped(finding, 2));
    }
    let mut tail = answer
        .joint
        .as_ref()
        .map_or(String::new(), |table| format!("{}\n", screen.table(table)));
    // What changed comes before the frequencies that show it.
    match answer.state {
        Some(_) => tail.push_str(&findings),
        None => head.push_str(&format!("\n{findings}")),
    }
    if let Some(action) = &answer.action {
        tail.push_str(&screen.wrapped(&format!("> {action}"), 2));
    }
    tail.push_str(&doubts(&answer, screen));
    if let Some(report) = report {
        tail.push_str(&format!("Report  {report}\n"));
    }
    let rest = head.lines().count() + tail.lines().count();
    let modes = modes(document, &answer, MOST_LINES.saturating_sub(rest), screen);
    format!("{head}\n{modes}{tail}")
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
        1 => text.push_str(&format!("and 1 more {word} (--full)\n")),
        others => text.push_str(&format!("and {others} more {word}s (--full)\n")),
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
