//! Sentences about a series of tests.

use crate::document::SeriesSection;
use crate::format::signed_percent;
use tapjoint_compare::Charted;
use tapjoint_numerics::stats::times;

/// Returns what a chart shows, in words.
pub fn quantity(charted: Charted) -> String {
    match charted {
        Charted::Mode(mode) => format!("mode {mode}"),
        Charted::AllModes => "all modes".to_owned(),
        Charted::Kt => "Kt".to_owned(),
        Charted::Kr => "Kr".to_owned(),
    }
}

/// Returns the answer in a few sentences, the shortest first.
pub fn answer(section: &SeriesSection) -> Vec<String> {
    let series = &section.series;
    let count = section.tests.len();
    let mut sentences = Vec::new();
    match series.departure() {
        None => sentences.push(format!("No change: the {count} tests agree.")),
        Some((chart, departure)) => {
            let of_chart = quantity(chart.quantity);
            sentences.push(format!(
                "Test {} differs from those before it: {}.",
                departure.test + 1,
                section.tests[departure.test]
            ));
            sentences.push(format!(
                "The chart of {of_chart} shows it first: {} % from test {} on, {} standard deviations of one test.",
                signed_percent(Some(departure.percent)),
                departure.since + 1,
                times(departure.percent / chart.scatter_percent)
            ));
        }
    }
    sentences.push(match series.is_stated {
        true => "Repeatability: as stated.".to_owned(),
        false => "Repeatability: by the scatter of the tests themselves.".to_owned(),
    });
    let known = series.charts.iter().flat_map(|chart| &chart.points);
    if known.clone().all(|point| point.limit.is_none()) {
        sentences
            .push("Too few tests to judge: without --repeatability five are needed.".to_owned());
    }
    sentences
}
