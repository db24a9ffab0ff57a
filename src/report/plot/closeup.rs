//! Close-ups of resonances: the single lines, the bound of the reading, and the frequency between
//! the lines.

use super::super::figures::{PeakMark, SpectraFigure};
use super::super::format::significant;
use super::axis::{Axis, Tick, extent};
use super::drawing::{Align, Drawing, Stroke, Text};
use super::palette::{BLUE, SOFT, curve};
use super::panel::{Panel, Sample, TICK_SIZE, draw_legend};
use super::spectrum::{INTERPOLATED, LEFT, RIGHT, over_lines};

/// Most close-ups in one row; more would be too narrow to read.
const MOST: usize = 6;
/// Widest close-up (pixels).
const WIDEST: f64 = 360.0;
/// Lines shown on each side of the peak.
const SIDE: f64 = 6.0;
/// Depth shown below the peak (dB).
const DEPTH: f64 = 30.0;

/// A row of close-ups whose upper end is `top` (pixels), 220 pixels high.
pub fn draw_closeups(drawing: &mut Drawing, spectra: &SpectraFigure, top: f64) {
    let modes: Vec<&PeakMark> = spectra
        .peaks
        .iter()
        .filter(|peak| peak.mode.is_some())
        .collect();
    let shown = modes.len().min(MOST);
    draw_heading(drawing, modes.len(), top);
    let width = ((RIGHT - LEFT) / shown.max(1) as f64).min(WIDEST);
    for (index, peak) in modes.into_iter().take(MOST).enumerate() {
        let left = LEFT + index as f64 * width;
        let right = left + width - 16.0;
        draw_closeup(drawing, spectra, peak, (left, right, top + 54.0));
    }
}

fn draw_heading(drawing: &mut Drawing, modes: usize, top: f64) {
    let heading = if modes > MOST {
        format!("Close-ups, the first {MOST} of {modes} modes")
    } else {
        "Close-ups".to_owned()
    };
    let text = Text::new(heading, (LEFT, top + 10.0), 14.0).bold();
    let after = LEFT + text.width() + 24.0;
    drawing.text(text);
    let entries = [
        (Sample::Dot(SOFT), "spectral line".to_owned()),
        (Sample::Band(BLUE), "reading \u{b1} half line".to_owned()),
        (
            Sample::Dashed(INTERPOLATED),
            "frequency between the lines".to_owned(),
        ),
    ];
    draw_legend(drawing, (after, top + 10.0), RIGHT, &entries);
}

fn draw_closeup(
    drawing: &mut Drawing,
    spectra: &SpectraFigure,
    peak: &PeakMark,
    (left, right, top): (f64, f64, f64),
) {
    let half_width = (SIDE * spectra.lines.spacing).max(2.0 * peak.half_line);
    let range = (
        peak.line_frequency - half_width,
        peak.line_frequency + half_width,
    );
    let panel = Panel {
        x: Axis::linear(range, (left, right)),
        y: Axis::linear((-DEPTH, 4.0), (top + 118.0, top)),
    };
    draw_scale(drawing, &panel, peak, left == LEFT);
    let bounds = (
        peak.line_frequency - peak.half_line,
        peak.line_frequency + peak.half_line,
    );
    panel.draw_band(drawing, bounds, BLUE);
    for (index, response) in spectra.responses.iter().enumerate() {
        draw_lines(drawing, &panel, (spectra, &response.values), index);
    }
    let x = panel.x.place(peak.frequency);
    let (from, to) = ((x, panel.y.to), (x, panel.y.from));
    drawing.dashed(from, to, (5.0, 3.0), Stroke::new(INTERPOLATED, 1.5));
    let name = peak
        .mode
        .map_or(String::new(), |mode| format!("mode {mode}"));
    let middle = (0.5 * (left + right), top - 13.0);
    drawing.text(
        Text::new(name, middle, TICK_SIZE)
            .bold()
            .aligned(Align::Middle),
    );
    panel.draw_frame(drawing);
}

/// Ticks: the line of the reading in the middle and the distance to the sides.
fn draw_scale(drawing: &mut Drawing, panel: &Panel, peak: &PeakMark, first: bool) {
    let center = peak.line_frequency;
    let decimals = if peak.half_line < 0.05 { 3 } else { 2 };
    let middle = Tick {
        value: center,
        label: Some(format!("{center:.decimals$} Hz")),
    };
    panel.draw_x_ticks(drawing, &[middle]);
    let side = significant(panel.x.high - center, 2);
    let below = panel.y.from + 15.0;
    let ends = [
        (panel.x.from, Align::Start, format!("\u{2212}{side}")),
        (panel.x.to, Align::End, format!("+{side}")),
    ];
    for (x, align, words) in ends {
        let text = Text::new(words, (x, below), 12.0).colored(SOFT);
        drawing.text(text.aligned(align));
    }
    let ticks = [-30.0, -20.0, -10.0, 0.0].map(|value| Tick {
        value,
        label: Some(if first {
            format!("{value:.0}").replace('-', "\u{2212}")
        } else {
            String::new()
        }),
    });
    panel.draw_y_ticks(drawing, &ticks);
    if first {
        panel.draw_y_title(drawing, "level (dB)");
    }
}

/// The lines of one response in dB below the largest of those shown.
fn draw_lines(
    drawing: &mut Drawing,
    panel: &Panel,
    (spectra, values): (&SpectraFigure, &[f64]),
    index: usize,
) {
    let near: Vec<(f64, f64)> = over_lines(spectra, values)
        .filter(|(frequency, value)| panel.x.holds(*frequency) && value.is_finite())
        .collect();
    let largest = extent(near.iter().map(|point| point.1)).map_or(1.0, |range| range.1);
    let level = |value: f64| 20.0 * (value / largest).max(1e-9).log10();
    let points = near
        .iter()
        .map(|(frequency, value)| (*frequency, level(*value)));
    panel.draw_curve(drawing, points.clone(), Stroke::new(curve(index), 1.0));
    for (frequency, decibels) in points {
        if panel.y.holds(decibels) {
            drawing.dot(panel.place(frequency, decibels), 2.6, curve(index));
        }
    }
}
