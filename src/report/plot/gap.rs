//! The picture of the gap: errors before and after the best hypothesis, and the odds.

use super::super::document::{Document, GapSection, PullSection};
use super::axis::{Axis, extent, padded};
use super::drawing::{Align, Drawing, Stroke, Text};
use super::palette::{BLUE, GRID, INK, SKY, SOFT, VERMILION};
use super::panel::{LABEL_SIZE, Panel, Sample, TICK_SIZE, crisp, draw_legend, draw_title};
use super::spectrum::{LEFT, WIDTH};

const HEIGHT: u32 = 520;
/// Right edge of the errors, left and right edge of the odds (pixels).
const ERRORS_RIGHT: f64 = 700.0;
const ODDS: (f64, f64) = (930.0, 1120.0);
const TOP: f64 = 112.0;
const BOTTOM: f64 = 450.0;
/// Hypotheses shown.
const MOST_BARS: usize = 9;
/// The axis reaches at least this far to either side of zero (%).
const LEAST_SPAN: f64 = 0.02;

/// Errors and odds; `None` without a diagnosis.
pub fn draw_gap(document: &Document) -> Option<Drawing> {
    let gap = document.gap.as_ref()?;
    let pulls = &gap.place.as_ref()?.modes;
    if pulls.is_empty() {
        return None;
    }
    let mut drawing = Drawing::new(
        "The gap before and after the best hypothesis",
        WIDTH,
        HEIGHT,
    );
    let best = gap
        .hypotheses
        .iter()
        .find(|found| !matches!(found.effect.as_str(), "none" | "unknown"))
        .map_or("the best hypothesis", |found| found.effect.as_str());
    draw_title(
        &mut drawing,
        "Gap between model and measurement",
        &format!(
            "left: every frequency of every recording, without and with {best}; right: what may be missing"
        ),
    );
    draw_errors(&mut drawing, gap, pulls);
    draw_odds(&mut drawing, gap);
    Some(drawing)
}

fn draw_errors(drawing: &mut Drawing, gap: &GapSection, pulls: &[PullSection]) {
    let last = pulls.iter().map(|pull| pull.mode).max().unwrap_or(1);
    let ends = pulls
        .iter()
        .flat_map(|pull| [pull.error_percent, pull.error_percent_after, 0.0]);
    let (low, high) = extent(ends).unwrap_or((-1.0, 1.0));
    let panel = Panel {
        x: Axis::linear((0.4, last as f64 + 0.6), (LEFT + 8.0, ERRORS_RIGHT)),
        y: Axis::linear(
            padded((low.min(-LEAST_SPAN), high.max(LEAST_SPAN)), 0.1),
            (BOTTOM, TOP),
        ),
    };
    panel.draw_y_ticks(drawing, &panel.y.ticks(36.0));
    let y = crisp(panel.y.place(0.0));
    drawing.line(
        vec![(LEFT + 8.0, y), (ERRORS_RIGHT, y)],
        Stroke::new(INK, 1.0),
    );
    panel.draw_frame(drawing);
    for pull in pulls {
        // The recordings that saw a mode stand beside each other over half its width.
        let seen = recordings(pulls.iter().filter(|other| other.mode == pull.mode));
        let place = seen.iter().position(|name| *name == pull.recording);
        let share = (place.unwrap_or(0) as f64 + 0.5) / seen.len().max(1) as f64;
        let x = pull.mode as f64 + 0.5 * (share - 0.5);
        drawing.ring(panel.place(x, pull.error_percent), 4.5, VERMILION);
        drawing.dot(panel.place(x, pull.error_percent_after), 4.0, BLUE);
    }
    for mode in 1..=last {
        let at = (panel.x.place(mode as f64), BOTTOM + 18.0);
        drawing.text(Text::new(format!("mode {mode}"), at, TICK_SIZE).aligned(Align::Middle));
    }
    panel.draw_y_title(drawing, "error of the frequency (%)");
    let withheld = gap
        .fitted_modes
        .filter(|fitted| *fitted < last)
        .map_or_else(String::new, |fitted| {
            format!("; modes above {fitted} took no part")
        });
    let legend = [
        (
            Sample::Ring(VERMILION),
            "described model, joint fitted".to_owned(),
        ),
        (Sample::Dot(BLUE), format!("with the effect{withheld}")),
    ];
    draw_legend(drawing, (LEFT, 88.0), ERRORS_RIGHT, &legend);
}

/// Recordings in the order of their first error.
fn recordings<'a>(pulls: impl Iterator<Item = &'a PullSection>) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for pull in pulls {
        if !names.contains(&pull.recording.as_str()) {
            names.push(&pull.recording);
        }
    }
    names
}

fn draw_odds(drawing: &mut Drawing, gap: &GapSection) {
    let title = Text::new("probability (%)", (ODDS.0, TOP - 18.0), LABEL_SIZE);
    drawing.text(title.bold());
    let step = (BOTTOM - TOP) / MOST_BARS as f64;
    for (row, found) in gap.hypotheses.iter().take(MOST_BARS).enumerate() {
        let top = TOP + step * row as f64 + 4.0;
        let bottom = top + step - 12.0;
        drawing.rectangle((ODDS.0, top), (ODDS.1, bottom), GRID, 0.6);
        let end = ODDS.0 + found.probability * (ODDS.1 - ODDS.0);
        let named = gap.verdict.effects.contains(&found.effect);
        drawing.rectangle(
            (ODDS.0, top),
            (end, bottom),
            if named { BLUE } else { SKY },
            1.0,
        );
        let middle = 0.5 * (top + bottom);
        let name = Text::new(&found.effect, (ODDS.0 - 10.0, middle), TICK_SIZE);
        drawing.text(name.aligned(Align::End));
        let value = format!("{:.1}", 100.0 * found.probability);
        drawing.text(Text::new(value, (ODDS.1 + 8.0, middle), TICK_SIZE).colored(SOFT));
    }
}
