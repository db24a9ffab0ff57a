//! Sentences about a series of tests.

use crate::document::SeriesSection;
use crate::format::{capital, signed_percent};
use crate::words::comparison::matched;
use tapjoint_compare::ChartedQuantity;
use tapjoint_numerics::stats::times;

/// Returns what a chart shows, in words.
pub fn quantity(charted: ChartedQuantity) -> String {
    match charted {
        ChartedQuantity::Mode(mode) => format!("mode {mode}"),
        ChartedQuantity::AllModes => "all modes".to_owned(),
        ChartedQuantity::Kt => "Kt".to_owned(),
        ChartedQuantity::Kr => "Kr".to_owned(),
    }
}

/// Returns which tests are compared with which; `None` where all tests agree.
pub fn compared(section: &SeriesSection) -> Option<String> {
    let (_, departure) = section.series.departure()?;
    // The numbers count from 1.
    let [before, after] = departure.compared().map(|tests| match tests.len() {
        1 => format!("test {}", tests.end),
        _ => format!("tests {} to {}", tests.start + 1, tests.end),
    });
    Some(format!("Before: {before}. After: {after}."))
}

/// Returns the answer in a few sentences, the shortest first.
pub fn answer(section: &SeriesSection) -> Vec<String> {
    let series = &section.series;
    let name = |test: usize| format!("test {} ({})", test + 1, section.tests[test]);
    let mut points = series.charts.iter().flat_map(|chart| &chart.points);
    let is_judged = points.any(|point| point.limit.is_some());
    let mut sentences = Vec::new();
    match series.departure() {
        None if is_judged => {
            sentences.push(format!(
                "No change: the {} tests agree.",
                section.tests.len()
            ));
        }
        None => sentences.push(
            "There are too few tests to judge. Give at least five, or three with --repeatability."
                .to_owned(),
        ),
        Some((chart, departure)) => {
            let seen = name(departure.test);
            let since = match departure.since == departure.test {
                true => "at this test".to_owned(),
                false => format!("at {}", name(departure.since)),
            };
            sentences.push(format!(
                "A change is seen at {seen}. It most probably began {since}."
            ));
            let size = match chart.scatter_percent {
                Some(scatter) => format!(
                    ", {} standard deviations of one test",
                    times(departure.percent / scatter)
                ),
                None => String::new(),
            };
            sentences.push(format!(
                "The chart of {} shows it most clearly: {} %{size}.",
                quantity(chart.quantity),
                signed_percent(Some(departure.percent)),
            ));
        }
    }
    sentences.push(match series.is_stated {
        true => "Repeatability: as stated.".to_owned(),
        false => "Repeatability: by the scatter of the tests themselves.".to_owned(),
    });
    for one in &series.left_out {
        sentences.push(format!(
            "Mode {} has no chart: {} lacks it.",
            one.mode,
            name(one.test)
        ));
    }
    sentences.extend(matched(&series.matched, |test| capital(&name(test))));
    sentences
}
