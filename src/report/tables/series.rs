//! Tables of a series of tests.

use super::{Table, number, words};
use crate::document::Document;
use crate::format::{capital, or_missing, signed_percent, significant};
use crate::words::series::quantity;

/// The control charts, a row each; `None` without a series.
pub fn control_charts(document: &Document) -> Option<Table> {
    let section = document.series.as_ref()?;
    let rows = section.series.charts.iter().map(|chart| {
        let last = chart.points.last();
        let departure = chart.departure;
        let limit = last.and_then(|last| last.limit);
        let score = last.filter(|_| limit.is_some()).map(|last| last.score);
        [
            words("Chart", capital(&quantity(chart.quantity))),
            number(
                "Scatter (%)",
                or_missing(chart.scatter_percent.map(|one| significant(one, 2))),
            ),
            number("Last (%)", signed_percent(last.map(|last| last.percent))),
            number(
                "Score",
                or_missing(score.map(|score| significant(score, 2))),
            ),
            number(
                "Limit",
                or_missing(limit.map(|limit| significant(limit, 2))),
            ),
            number("Since test", one_based(departure.map(|one| one.since))),
            number("Seen at test", one_based(departure.map(|one| one.test))),
            number("By (%)", signed_percent(departure.map(|one| one.percent))),
        ]
    });
    Some(Table::of(
        "Control charts",
        rows,
        "Last: change of the last test since the first. Score: how improbable the difference between the last tests and those \
         before is, as a standard normal variable. The limits allow one false alarm in about 250 tests of drawn scatter.",
    ))
}

fn one_based(index: Option<usize>) -> String {
    or_missing(index.map(|index| index + 1))
}

/// The tests with their numbers; `None` without a series.
pub fn tests_of_series(document: &Document) -> Option<Table> {
    let section = document.series.as_ref()?;
    let rows = section.tests.iter().enumerate();
    let rows = rows.map(|(index, file)| {
        [
            number("Test", (index + 1).to_string()),
            words("File", file.as_str()),
        ]
    });
    Some(Table::of("Tests", rows, ""))
}
