//! The picture of a recording over time with its taps.

use super::super::figures::{RecordingFigure, TapMark, TimeOverview};
use super::axis::{Axis, extent, padded};
use super::drawing::{Align, Drawing, Stroke, Text};
use super::font::fitted;
use super::palette::{BLUE, DATA, SOFT, VERMILION};
use super::panel::{Panel, Sample, TICK_SIZE, draw_legend, draw_title};
use super::spectrum::{LEFT, RIGHT, WIDTH};

/// Most reasons written under the picture; the table of taps has them all.
const MOST_REASONS: usize = 6;
/// Height of a line of reasons (pixels).
const LINE: f64 = 20.0;

/// The recording over time; `None` for a recording without samples.
pub fn draw_taps(figure: &RecordingFigure) -> Option<Drawing> {
    let overview = figure.overview.as_ref()?;
    if overview.low.is_empty() || overview.high.is_empty() {
        return None;
    }
    let reasons = reasons(&overview.taps);
    let height = 420.0 + reasons.len() as f64 * LINE + if reasons.is_empty() { 0.0 } else { 14.0 };
    let description = format!("{} over time with its taps", figure.file);
    let mut drawing = Drawing::new(description, WIDTH, height as u32);
    let title = format!("Taps, {}", figure.file);
    draw_title(&mut drawing, &title, &counts(overview));
    let panel = draw_signal(&mut drawing, overview);
    draw_tap_marks(&mut drawing, &panel, &overview.taps);
    draw_legend(&mut drawing, (LEFT, 76.0), RIGHT, &legend(overview));
    for (index, reason) in reasons.iter().enumerate() {
        let at = (LEFT, 428.0 + index as f64 * LINE);
        let words = fitted(reason, TICK_SIZE, RIGHT - LEFT);
        drawing.text(Text::new(words, at, TICK_SIZE).colored(VERMILION));
    }
    Some(drawing)
}

fn counts(overview: &TimeOverview) -> String {
    let rejected = overview.taps.iter().filter(|tap| tap.rejected.is_some());
    let rejected = rejected.count();
    let used = overview.taps.len() - rejected;
    let found = overview.taps.len();
    let taps = if found == 1 { "tap" } else { "taps" };
    format!("{found} {taps} found \u{b7} {used} used \u{b7} {rejected} rejected")
}

/// "tap 3 at 6.21 s: double hit", and how many more there are.
fn reasons(taps: &[TapMark]) -> Vec<String> {
    let all: Vec<String> = taps
        .iter()
        .enumerate()
        .filter_map(|(index, tap)| {
            let reason = tap.rejected.as_ref()?;
            Some(format!("tap {} at {:.2} s: {reason}", index + 1, tap.time))
        })
        .collect();
    let more = all.len().saturating_sub(MOST_REASONS);
    let mut shown: Vec<String> = all.into_iter().take(MOST_REASONS).collect();
    if more > 0 {
        shown.push(format!("and {more} more, see the table of taps"));
    }
    shown
}

fn draw_signal(drawing: &mut Drawing, overview: &TimeOverview) -> Panel {
    let pieces = overview.low.len().min(overview.high.len());
    let seconds = overview.step * pieces as f64;
    let marks = overview.taps.iter().map(|tap| tap.peak);
    let values = overview.low.iter().chain(&overview.high).copied();
    let range = extent(values.chain(marks)).unwrap_or((-1.0, 1.0));
    let panel = Panel {
        // Room at the start: a recording may begin with a tap, whose mark would lie on the frame.
        x: Axis::linear((-0.015 * seconds, seconds), (LEFT, RIGHT)),
        // Room above the tallest tap for its number.
        y: Axis::linear(padded(range, 0.14), (360.0, 98.0)),
    };
    panel.draw_axes(drawing);
    // Through the extremes of every piece in turn: where pieces are narrower than a pixel this is
    // the envelope, filled.
    let curve = (0..pieces).flat_map(|piece| {
        let time = (piece as f64 + 0.5) * overview.step;
        let value = |side: &[f64]| side.get(piece).copied().unwrap_or(f64::NAN);
        [(time, value(&overview.low)), (time, value(&overview.high))]
    });
    panel.draw_curve(drawing, curve, Stroke::new(DATA, 1.0));
    panel.draw_x_title(drawing, "time (s)");
    panel.draw_y_title(drawing, &overview.label);
    panel
}

/// Accepted taps as dots, rejected ones as crosses with their number.
fn draw_tap_marks(drawing: &mut Drawing, panel: &Panel, taps: &[TapMark]) {
    let mut free_from = f64::NEG_INFINITY;
    for (index, tap) in taps.iter().enumerate() {
        let at = panel.place(tap.time, tap.peak);
        let number = (index + 1).to_string();
        let color = match &tap.rejected {
            None => {
                drawing.dot(at, 5.0, BLUE);
                BLUE
            }
            Some(_) => {
                drawing.cross(at, 6.0, Stroke::new(VERMILION, 2.5));
                VERMILION
            }
        };
        let offset = if tap.peak < 0.0 { 15.0 } else { -15.0 };
        let text = Text::new(number, (at.0, at.1 + offset), 12.0)
            .colored(color)
            .aligned(Align::Middle);
        // Numbers that would touch the one before are left out; the marks stay.
        let half = 0.5 * text.width() + 2.0;
        if at.0 - half >= free_from {
            free_from = at.0 + half;
            drawing.text(text);
        }
    }
}

fn legend(overview: &TimeOverview) -> Vec<(Sample, String)> {
    let mut entries = vec![(Sample::Line(DATA), overview.label.clone())];
    if overview.taps.iter().any(|tap| tap.rejected.is_none()) {
        entries.push((Sample::Dot(BLUE), "tap used".to_owned()));
    }
    if overview.taps.iter().any(|tap| tap.rejected.is_some()) {
        entries.push((Sample::Cross(VERMILION), "tap rejected".to_owned()));
    }
    if overview.taps.is_empty() {
        entries.push((Sample::Line(SOFT), "no taps found".to_owned()));
    }
    entries
}
