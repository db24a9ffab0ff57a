//! A series of tests: a control chart for every mode and for the joint.

use crate::document::{Document, SeriesSection};
use crate::format::signed_percent;
use crate::picture::{Axis, Block, Chart, Color, Mark, Panel, Places, Series, extent, padded};
use crate::words::series::quantity;
use tapjoint_compare::ControlChart;

/// Height of a panel (pixels).
const HEIGHT: f64 = 190.0;
/// The axis spans at least this (%).
const LEAST_SPAN: f64 = 0.05;

/// The control charts; `None` without a series.
pub fn control_charts(document: &Document) -> Option<Chart> {
    let section = document.series.as_ref()?;
    let charts = section.series.charts.iter();
    let panels = charts.map(|chart| panel(chart, section)).collect();
    Some(Chart {
        kind: "series",
        title: "Tests in the order of time".to_owned(),
        subtitle: "change since the first test; a single test outside the band differs from those before it".to_owned(),
        caption: "Control charts of the frequencies and of the joint.".to_owned(),
        blocks: vec![Block::new(2, panels)],
        ..Chart::default()
    })
}

fn panel(chart: &ControlChart, section: &SeriesSection) -> Panel {
    let count = chart.points.len();
    let since = chart.departure.map_or(count, |one| one.since);
    let mut band = Series::new("limits of one test", Color::Data, Mark::Band);
    let mut places = Vec::new();
    let mut agreeing = Series::new("agrees", Color::Blue, Mark::Dot(3.5));
    let mut departed = Series::new("differs", Color::Vermilion, Mark::Ring(4.5));
    let mut ends = Vec::new();
    for (test, point) in chart.points.iter().enumerate() {
        let at = (test + 1) as f64;
        ends.push(point.percent);
        let own = match test < since {
            true => &mut agreeing,
            false => &mut departed,
        };
        own.push(at, point.percent);
        own.words
            .push(format!("test {}: {}", test + 1, section.tests[test]));
        own.said.push(signed_percent(Some(point.percent)) + " %");
    }
    // The tests decide what is shown: limits after few tests may be many times as wide.
    let (low, high) = extent(ends).unwrap_or((-LEAST_SPAN, LEAST_SPAN));
    let (low, high) = (low.min(-LEAST_SPAN), high.max(LEAST_SPAN));
    let span = high - low;
    let last = chart
        .points
        .last()
        .and_then(|one| one.single_limits_percent);
    let [below, above] = last.unwrap_or([low, high]);
    let low = below.clamp(low - span, low);
    let high = above.clamp(high, high + span);
    let margin = 0.1 * (high - low);
    for (test, point) in chart.points.iter().enumerate() {
        if let Some(limits) = point.single_limits_percent {
            let [below, above] = limits.map(|one| one.clamp(low - margin, high + margin));
            places.push((test + 1) as f64);
            band.low.push(below);
            band.high.push(above);
        }
    }
    band.x = Places::Each(places);
    let x = Axis::linear(0.5, count as f64 + 0.5).of("test", "");
    let y = padded((low, high), 0.1);
    let y = y.of(format!("change of {}", quantity(chart.quantity)), "%");
    let mut shown = vec![band, agreeing, departed];
    shown.retain(|series| !series.low.is_empty() || !series.y.is_empty());
    Panel::new(HEIGHT, x, y)
        .titled(quantity(chart.quantity))
        .with_zero()
        .with(shown)
}
