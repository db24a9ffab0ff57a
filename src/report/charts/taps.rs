//! A recording over time with its taps.

use super::super::chart::axis::{Axis, extent, padded};
use super::super::chart::{Block, Chart, Color, Event, Panel, Places, Series};
use super::super::figures::{RecordingFigure, TapMark, TimeOverview};
use super::super::format::significant;

/// Most reasons written under the picture; the table of taps has them all.
const MOST_REASONS: usize = 6;

/// The recording over time; `None` for a recording without samples.
pub fn taps(figure: &RecordingFigure) -> Option<Chart> {
    let overview = figure.overview.as_ref()?;
    let count = overview.low.len().min(overview.high.len());
    if count == 0 {
        return None;
    }
    let (low, high) = (&overview.low[..count], &overview.high[..count]);
    let peaks = overview.taps.iter().map(|tap| tap.peak);
    let range = extent(low.iter().chain(high).copied().chain(peaks)).unwrap_or((-1.0, 1.0));
    let (label, unit) = split_unit(&overview.label);
    let seconds = overview.step * count as f64;
    // Room at the start: a recording may begin with a tap, whose mark would lie on the frame.
    let x = Axis::linear(-0.015 * seconds, seconds).of("time", "s");
    // Room above the tallest tap for its number.
    let y = padded(range, 0.14).of(label, unit);
    let places = Places::Even(0.5 * overview.step, overview.step);
    let signal = Series::band(
        &overview.label,
        Color::Data,
        places,
        low.to_vec(),
        high.to_vec(),
    );
    let mut panel = Panel::new(262.0, x, y).with([signal]);
    let marks = overview.taps.iter();
    panel.events = marks.map(|tap| event(tap, unit)).collect();
    Some(Chart {
        kind: "taps",
        title: format!("Taps, {}", figure.file),
        subtitle: counts(overview),
        caption: format!("{} over time; numbers count the taps.", figure.file),
        blocks: vec![Block::new(1, vec![panel])],
        footnotes: reasons(&overview.taps),
        ..Chart::default()
    })
}

/// "force (N)" as "force" and "N".
pub(super) fn split_unit(label: &str) -> (&str, &str) {
    let inner = label.strip_suffix(')');
    let parts = inner.and_then(|label| label.rsplit_once(" ("));
    parts.unwrap_or((label, ""))
}

fn event(tap: &TapMark, unit: &str) -> Event {
    let place = format!("{:.3} s, {} {unit}", tap.time, significant(tap.peak, 3));
    let close_up = tap.close_up.iter().flat_map(|close_up| {
        close_up.curves.iter().map(|curve| {
            let (start, step) = (1e3 * close_up.start, 1e3 * close_up.step);
            let series = Series::even(&curve.label, Color::Soft, start, step, curve.values.clone());
            let y = Axis::linear(0.0, 1.0).of(curve.label.as_str(), curve.unit.as_str());
            let x = Axis::linear(0.0, 1.0).of("time from the trigger", "ms");
            Panel::new(190.0, x, y).with([series])
        })
    });
    Event {
        at: tap.time,
        peak: tap.peak,
        words: match &tap.rejected {
            None => format!("used, {place}"),
            Some(reason) => format!("rejected, {place}: {reason}"),
        },
        used: tap.rejected.is_none(),
        close_up: close_up.collect(),
    }
}

fn counts(overview: &TimeOverview) -> String {
    let found = overview.taps.len();
    let rejected = overview.taps.iter().filter(|tap| tap.rejected.is_some());
    let rejected = rejected.count();
    let used = found - rejected;
    let taps = if found == 1 { "tap" } else { "taps" };
    format!("{found} {taps} found \u{b7} {used} used \u{b7} {rejected} rejected")
}

/// "tap 3 at 6.21 s: double hit", and how many more there are.
fn reasons(taps: &[TapMark]) -> Vec<String> {
    let mut reasons = Vec::new();
    for (index, tap) in taps.iter().enumerate() {
        if let Some(reason) = &tap.rejected {
            reasons.push(format!("tap {} at {:.2} s: {reason}", index + 1, tap.time));
        }
    }
    let more = reasons.len().saturating_sub(MOST_REASONS);
    reasons.truncate(MOST_REASONS);
    if more > 0 {
        reasons.push(format!("and {more} more, see the table of taps"));
    }
    reasons
}
