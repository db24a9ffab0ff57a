//! Which test to make next, in a sentence and as a table.

use super::super::document::{Document, GapSection};
use super::super::format::MISSING;
use super::{Table, number, words};
use tapjoint_diagnosis::{NextTest, Proposal, Verdict};

/// The test that tells most for its effort; what it is for depends on the answer.
pub(super) fn next_test(gap: &GapSection) -> Option<String> {
    let test = gap.next_test.first()?;
    let (purpose, premise) = match gap.verdict {
        Verdict::NoGap | Verdict::Named(_) => ("To confirm it", String::new()),
        Verdict::Unknown => ("To decide", format!(", {EQUALLY_LIKELY}")),
        _ => ("To decide", String::new()),
    };
    if confirms(test) {
        return Some(format!("{purpose}: {}.", test.action));
    }
    Some(format!(
        "{purpose}: {} (about {:.2} bit{premise}; it tells {} apart{}).",
        test.action,
        test.expected_information,
        test.separates.join(", "),
        not_predicted(test, "; it could not be predicted for ")
    ))
}

/// Whether a test tells nothing new about which hypothesis holds.
fn confirms(test: &NextTest) -> bool {
    matches!(test.proposal, Proposal::Confirm { .. })
}

/// The hypotheses that nothing is said of, after `lead`; nothing where there are none.
fn not_predicted(test: &NextTest, lead: &str) -> String {
    match test.unpredicted.as_slice() {
        [] => String::new(),
        names => format!("{lead}{}", names.join(", ")),
    }
}

/// What the information of a test rests on where nothing explains the readings: the ranking then says little.
const EQUALLY_LIKELY: &str = "taking the catalogue's effects as equally likely";

/// Tests that would tell more; `None` where none would.
pub fn next_tests(document: &Document) -> Option<Table> {
    let gap = document.gap.as_ref()?;
    let tests = &gap.next_test;
    if tests.is_empty() {
        return None;
    }
    let premise = match gap.verdict {
        Verdict::Unknown => EQUALLY_LIKELY,
        _ => "by the hypotheses above",
    };
    let row = |test: &NextTest| {
        vec![
            test.action.clone() + &not_predicted(test, "; could not be predicted for "),
            match confirms(test) {
                true => MISSING.to_owned(),
                false => format!("{:.2}", test.expected_information),
            },
            format!("{:.0}", test.effort),
            test.separates.join(", "),
        ]
    };
    Some(Table {
        caption: "What to do next".to_owned(),
        columns: vec![
            words("Test"),
            number("Information (bit)"),
            number("Effort"),
            words("Tells apart").on_page(),
        ],
        rows: tests.iter().map(row).collect(),
        note: format!(
            "Information about the cause that the test is expected to bring at least, {premise}; effort in \
             multiples of reading again what is recorded. Ranked by one over the other."
        ),
    })
}
