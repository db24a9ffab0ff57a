//! What changed between two tests: the change of every frequency, and odds of the causes.

use super::spectra::HIGH;
use crate::document::Document;
use crate::format::{probability, signed_percent};
use crate::picture::{Axis, Block, Chart, Color, Mark, Panel, Series, extent, padded};
use crate::words::comparison::cause;
use tapjoint_compare::{CauseResult, Comparison};
use tapjoint_numerics::stats::NORMAL_95;

/// Causes shown.
const MOST_BARS: usize = 8;
/// The axis reaches at least this far to either side of zero (%).
const LEAST_SPAN: f64 = 0.1;

/// Changes of all frequencies with what repeating a test changes, and how probable each cause is; `None` without a
/// comparison.
pub fn changes(document: &Document) -> Option<Chart> {
    let found = &document.compare.as_ref()?.found;
    let first = found
        .hypotheses
        .iter()
        .find(|one| !one.explains_percent.is_empty());
    let shown = first.map_or(String::new(), |first| {
        format!(
            ", and what it would be if {}",
            cause(first.effect, first.item.as_deref())
        )
    });
    let panels = vec![changes_panel(found, first), odds_panel(found)];
    Some(Chart {
        kind: "compare",
        title: "What changed between the tests".to_owned(),
        subtitle: format!(
            "left: change of every frequency beyond the described one{shown}; error bars: what repeating a test changes, 95 %"
        ),
        caption: "The change of every frequency, and how probable each cause is.".to_owned(),
        blocks: vec![Block::new(2, panels)],
        ..Chart::default()
    })
}

/// Returns a change (%) from its logarithm (1/100).
fn percent_of(logarithm: f64) -> f64 {
    100.0 * (0.01 * logarithm).exp_m1()
}

fn changes_panel(found: &Comparison, first: Option<&CauseResult>) -> Panel {
    let last = found.modes.iter().map(|one| one.mode).max().unwrap_or(1);
    let pairs = 1 + found.modes.iter().map(|one| one.pair).max().unwrap_or(0);
    let names = (1..=last).map(|mode| (mode as f64, mode.to_string()));
    let x = Axis::linear(0.4, last as f64 + 0.6)
        .of("mode", "")
        .named(names);
    let mut measured = Series::new("measured", Color::Vermilion, Mark::Ring(4.5));
    let mut predicted = first.map(|first| {
        let name = format!("if {}", cause(first.effect, first.item.as_deref()));
        Series::new(&name, Color::Blue, Mark::Dot(4.0))
    });
    for (index, mode) in found.modes.iter().enumerate() {
        // Pairs stand beside each other.
        let share = (mode.pair as f64 + 0.5) / pairs as f64;
        let at = mode.mode as f64 + 0.5 * (share - 0.5);
        let logarithm = mode.z * mode.std_percent;
        let change = percent_of(logarithm);
        measured.push(at, change);
        let reach = NORMAL_95 * mode.std_percent;
        measured.low.push(percent_of(logarithm - reach));
        measured.high.push(percent_of(logarithm + reach));
        measured.words.push(format!(
            "mode {}, {:.5} to {:.5} Hz",
            mode.mode, mode.before, mode.after
        ));
        measured.said.push(signed_percent(Some(change)) + " %");
        let value = first.and_then(|first| first.explains_percent.get(index));
        if let (Some(predicted), Some(value)) = (&mut predicted, value) {
            predicted.push(at, *value);
            predicted.words.push(format!("mode {}", mode.mode));
            predicted.said.push(signed_percent(Some(*value)) + " %");
        }
    }
    let mut series = vec![measured];
    series.extend(predicted);
    let ends = series[0].low.iter().chain(&series[0].high);
    let ends = ends.chain(series.iter().flat_map(|one| &one.y)).copied();
    let (low, high) = extent(ends).unwrap_or((-1.0, 1.0));
    let y = padded((low.min(-LEAST_SPAN), high.max(LEAST_SPAN)), 0.1);
    let y = y.of("change of the frequency", "%");
    Panel::new(HIGH, x, y)
        .titled("changes of the frequencies")
        .with_zero()
        .with(series)
}

fn odds_panel(found: &Comparison) -> Panel {
    let rows = found.hypotheses.iter().take(MOST_BARS).enumerate();
    let rows = rows.map(|(row, one)| (-(row as f64), one));
    let names = rows.clone().map(|(row, one)| {
        let name = match &one.item {
            Some(item) => format!("{} {item}", one.effect.name()),
            None => one.effect.name().to_owned(),
        };
        (row, name)
    });
    let lowest = 0.4 - found.hypotheses.len().min(MOST_BARS) as f64;
    let y = Axis::linear(lowest, 0.6).named(names);
    let x = Axis::linear(0.0, 100.0).of("probability", "%");
    let mut bars = Series::new("causes", Color::Blue, Mark::Bar(9.0));
    for (row, one) in rows {
        bars.push(100.0 * one.probability, row);
        bars.words.push(cause(one.effect, one.item.as_deref()));
        bars.labels.push(probability(one.probability));
    }
    Panel::new(HIGH, x, y)
        .titled("what may have changed")
        .with([bars])
}
