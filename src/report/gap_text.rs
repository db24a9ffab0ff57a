//! The diagnosis of the gap for a terminal.

use super::document::Document;
use super::tables;
use super::text::{noted, prediction, warnings, wrapped};

/// The errors of the nominal model, the story of the gap, and the hypotheses.
pub fn render_gap_text(document: &Document) -> String {
    let sections = [prediction(document), gap(document), warnings(document)];
    let said: Vec<String> = sections.into_iter().filter(|s| !s.is_empty()).collect();
    said.join("\n")
}

/// The story of the gap and the hypotheses; empty without a diagnosis.
pub(super) fn gap(document: &Document) -> String {
    let story: String = tables::gap_story(document)
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
