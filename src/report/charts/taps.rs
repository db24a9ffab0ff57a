//! A recording over time with its taps.

use tapjoint_analysis::{CloseUp, RecordingResult};
use tapjoint_signal::taps::Tap;

use super::super::chart::axis::{Axis, extent, padded};
use super::super::chart::{Block, Chart, Color, Event, Mark, Panel, Places, Series};
use super::super::format::significant;
use super::unit_of;

/// Most reasons written under the picture; the table of taps has them all.
const MOST_REASONS: usize = 6;

/// Returns the recording over time; `None` for a recording without samples.
pub fn taps(recording: &RecordingResult, name: &str) -> Option<Chart> {
    let overview = recording.overview.as_ref()?;
    let count = overview.low.len().min(overview.high.len());
    if count == 0 {
        return None;
    }
    let (low, high) = (&overview.low[..count], &overview.high[..count]);
    let taps = &recording.measurement.taps.taps;
    let peaks = taps.iter().map(|tap| tap.peak);
    let range = extent(low.iter().chain(high).copied().chain(peaks)).unwrap_or((-1.0, 1.0));
    let (label, unit) = match recording.responses.first() {
        _ if recording.has_hammer => ("force".to_owned(), unit_of(&recording.tap_unit)),
        Some(first) => (format!("response {}", first.name), unit_of(&first.unit)),
        None => ("response".to_owned(), String::new()),
    };
    let seconds = overview.step * count as f64;
    // Room at the start: a recording may begin with a tap, whose mark would lie on the frame.
    let x = Axis::linear(-0.015 * seconds, seconds).of("time", "s");
    // Room above the tallest tap for its number.
    let y = padded(range, 0.14).of(label, &unit);
    let signal = Series {
        x: Places::even(0.5 * overview.step, overview.step, count),
        low: low.to_vec(),
        high: high.to_vec(),
        ..Series::new(&y.title(), Color::Data, Mark::Band)
    };
    let mut panel = Panel::new(262.0, x, y).with([signal]);
    for (index, tap) in taps.iter().enumerate() {
        let close_up = overview.close_ups.get(index);
        panel.events.push(event(tap, &unit, recording, close_up));
    }
    let found = match taps.len() {
        1 => "1 tap".to_owned(),
        count => format!("{count} taps"),
    };
    let used = taps.iter().filter(|tap| tap.accepted()).count();
    let rejected = taps.len() - used;
    Some(Chart {
        kind: "taps",
        title: format!("Taps, {name}"),
        subtitle: format!("{found} found \u{b7} {used} used \u{b7} {rejected} rejected"),
        caption: format!("{name} over time; numbers count the taps."),
        blocks: vec![Block::new(1, vec![panel])],
        footnotes: reasons(taps),
        ..Chart::default()
    })
}

fn event(tap: &Tap, unit: &str, recording: &RecordingResult, found: Option<&CloseUp>) -> Event {
    let mut close_up = Vec::new();
    if let Some(found) = found {
        let force = found.force.as_ref();
        let force = force.map(|values| ("force".to_owned(), &recording.tap_unit, values));
        let response = recording.responses.first().zip(found.response.as_ref());
        let response =
            response.map(|(one, values)| (format!("response {}", one.name), &one.unit, values));
        for (label, unit, values) in force.into_iter().chain(response) {
            let (start, step) = (1e3 * found.start, 1e3 * found.step);
            let series = Series::even(&label, Color::Soft, start, step, values.clone());
            let x = Axis::linear(0.0, 1.0).of("time from the trigger", "ms");
            let y = Axis::linear(0.0, 1.0).of(label, unit_of(unit));
            close_up.push(Panel::new(190.0, x, y).with([series]));
        }
    }
    let place = format!("{:.3} s, {} {unit}", tap.time, significant(tap.peak, 3));
    Event {
        at: tap.time,
        peak: tap.peak,
        words: match &tap.rejection {
            None => format!("used, {place}"),
            Some(reason) => format!("rejected, {place}: {reason}"),
        },
        used: tap.accepted(),
        close_up,
    }
}

/// Returns "tap 3 at 6.21 s: double hit" of every rejected tap, and how many more there are.
fn reasons(taps: &[Tap]) -> Vec<String> {
    let mut reasons = Vec::new();
    for (index, tap) in taps.iter().enumerate() {
        if let Some(reason) = &tap.rejection {
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
