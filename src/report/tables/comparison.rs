//! Tables of a comparison of tests.

use super::{Table, number, page_words, words};
use crate::document::Document;
use crate::format::{or_missing, probability, signed_percent, significant, with_decimals_of};
use crate::words::comparison::{cause, size};

/// Causes below this probability are left out.
const LEAST_PROBABILITY: f64 = 0.005;
/// Change by another level of the taps that is shown (%).
const LEAST_LEVEL: f64 = 1e-3;
/// Most causes that are listed.
const MOST_LISTED: usize = 5;

/// The compared modes; `None` without a comparison.
pub fn changed_modes(document: &Document) -> Option<Table> {
    let found = &document.compare.as_ref()?.found;
    let several = found.modes.iter().any(|mode| mode.pair > 0);
    let is_described = found
        .modes
        .iter()
        .any(|mode| mode.described_percent.abs() > 1e-9);
    let is_moved = found
        .modes
        .iter()
        .any(|mode| mode.level_percent.abs() > LEAST_LEVEL);
    let mut rows = Vec::new();
    for mode in &found.modes {
        let mut row = Vec::new();
        if several {
            row.push(number("Pair", (mode.pair + 1).to_string()));
        }
        row.push(number("Mode", mode.mode.to_string()));
        row.push(number("Before (Hz)", significant(mode.before, 6)));
        row.push(number("After (Hz)", significant(mode.after, 6)));
        row.push(number("Change (%)", signed(mode.change_percent)));
        if is_described {
            row.push(number("Described (%)", signed(mode.described_percent)));
        }
        if is_moved {
            row.push(number("Level (%)", signed(mode.level_percent)));
        }
        row.push(number("Scatter (%)", significant(mode.std_percent, 2)));
        row.push(number("Change/scatter", with_decimals_of(mode.z, "0.0")));
        rows.push(row);
    }
    let mut note = "Scatter: standard deviation of the change if nothing changed.".to_owned();
    if is_described {
        note += " Described: what the two descriptions explain.";
    }
    if is_moved {
        note +=
            " Level: what other levels of the taps explain; it is taken out of the frequencies.";
    }
    Some(Table::of("Frequencies", rows, &note))
}

/// The dampings; `None` where the tests have none in common.
pub fn changed_dampings(document: &Document) -> Option<Table> {
    let found = document.compare.as_ref()?.found.damping.as_ref()?;
    let several = found.modes.iter().any(|mode| mode.pair > 0);
    let mut rows = Vec::new();
    for mode in &found.modes {
        let mut row = Vec::new();
        if several {
            row.push(number("Pair", (mode.pair + 1).to_string()));
        }
        let change = mode.after - mode.before;
        row.push(number("Mode", mode.mode.to_string()));
        row.push(number("Before (%)", significant(100.0 * mode.before, 3)));
        row.push(number("After (%)", significant(100.0 * mode.after, 3)));
        row.push(number("Scatter (%)", significant(100.0 * mode.std, 2)));
        row.push(number(
            "Change/scatter",
            with_decimals_of(change / mode.std, "0.0"),
        ));
        rows.push(row);
    }
    let note = "Damping ratios. Scatter: standard deviation of the difference if nothing changed.";
    Some(Table::of("Damping", rows, note))
}

fn signed(percent: f64) -> String {
    signed_percent(Some(percent))
}

/// The causes, the most probable first; `None` without a comparison.
pub fn changes(document: &Document) -> Option<Table> {
    let found = &document.compare.as_ref()?.found;
    let listed = found
        .hypotheses
        .iter()
        .filter(|one| one.probability >= LEAST_PROBABILITY);
    let rows = listed.take(MOST_LISTED).map(|one| {
        [
            words("Cause", cause(one.effect, one.item.as_deref())),
            number("Probability", probability(one.probability)),
            page_words(
                "Fit (p)",
                or_missing(one.goodness_of_fit.map(|p| significant(p, 2))),
            ),
            words("Size", size(one)),
        ]
    });
    Some(Table::of("What may have changed", rows, ""))
}

/// The joint before and after, if only the joint changed; `None` without a comparison, and where there is no elastic joint.
pub fn changed_joint(document: &Document) -> Option<Table> {
    let joint = document.compare.as_ref()?.found.joint.as_ref()?;
    let rows = [
        ("Kt", "N/m", joint.kt.as_ref()),
        ("Kr", "N\u{a0}m/rad", joint.kr.as_ref()),
    ];
    let rows = rows.into_iter().filter_map(|(name, unit, change)| {
        let change = change?;
        Some([
            words("Stiffness", name),
            words("Unit", unit),
            number("Before", significant(change.before, 4)),
            number("Std (%)", significant(change.before_std_percent, 2)),
            number("After", significant(change.after, 4)),
            number("Change (%)", signed(change.change_percent)),
            number("Low (%)", signed(change.low)),
            number("High (%)", signed(change.high)),
        ])
    });
    let table = Table::of(
        "The joint, if only the joint changed",
        rows,
        "Before: as described, or fitted to the frequencies before, with its standard uncertainty. Low and high: 95 % limits of the \
         change.",
    );
    (!table.rows.is_empty()).then_some(table)
}

/// The compared tests; `None` without a comparison, and for one test before and one after.
pub fn compared_tests(document: &Document) -> Option<Table> {
    let pairs = &document.compare.as_ref()?.tests;
    let mut rows = Vec::new();
    for (index, pair) in pairs.iter().enumerate() {
        for repeat in 0..pair.before.len().max(pair.after.len()) {
            let [before, after] = [&pair.before, &pair.after].map(|files| files.get(repeat));
            rows.push([
                number("Pair", (index + 1).to_string()),
                words("Before", or_missing(before)),
                words("After", or_missing(after)),
            ]);
        }
    }
    (rows.len() > 1).then(|| Table::of("Tests", rows, ""))
}
