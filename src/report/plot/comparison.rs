//! The picture of predicted beside measured frequencies.

use super::super::document::{Document, PredictionSection};
use super::super::format::{bound_percent, signed_percent, significant};
use super::super::tables::reading_bound;
use super::axis::{Axis, extent, padded};
use super::drawing::{Align, Drawing, Stroke, Text};
use super::palette::{BLUE, INK, SOFT, VERMILION};
use super::panel::{Panel, Sample, TICK_SIZE, crisp, draw_legend, draw_title};
use super::spectrum::{LEFT, RIGHT, WIDTH};

/// Most modes whose frequencies fit under the picture side by side.
const MOST_WITH_NUMBERS: usize = 10;
/// Most modes whose errors fit beside each other.
const MOST_WITH_WORDS: usize = 14;

/// The axis reaches at least this far to either side of zero (%).
const LEAST_SPAN: f64 = 0.02;
/// Left edge of the panel (pixels): tick labels such as "\u{2212}0.02" need room beside the title.
const INNER_LEFT: f64 = LEFT + 8.0;

/// One mode's error and the bound of its reading (%).
pub struct Error<'a> {
    /// What was predicted and measured.
    pub prediction: &'a PredictionSection,
    /// The error (%).
    pub percent: f64,
    /// Bound of the reading (%).
    pub bound: Option<f64>,
}

/// Errors of the predicted frequencies; `None` where nothing was predicted for a measured mode.
pub fn draw_frequencies(document: &Document) -> Option<Drawing> {
    let errors = errors(document);
    if errors.is_empty() {
        return None;
    }
    let height = if errors.len() > MOST_WITH_NUMBERS {
        430
    } else {
        480
    };
    let mut drawing = Drawing::new("Errors of predicted frequencies", WIDTH, height);
    let title = "Predicted against measured frequencies";
    let below = "error = 100 (predicted \u{2212} measured) / measured; bar: bound of the reading";
    draw_title(&mut drawing, title, below);
    let panel = panel(&errors);
    panel.draw_y_ticks(&mut drawing, &panel.y.ticks(36.0));
    let zero = Stroke::new(INK, 1.0);
    let y = crisp(panel.y.place(0.0));
    drawing.line(vec![(INNER_LEFT, y), (RIGHT, y)], zero);
    panel.draw_frame(&mut drawing);
    for (index, error) in errors.iter().enumerate() {
        draw_error(&mut drawing, &panel, index, error, errors.len());
    }
    panel.draw_y_title(&mut drawing, "error (%)");
    draw_legend(&mut drawing, (LEFT, 76.0), RIGHT, &legend(&errors));
    Some(drawing)
}

/// The errors of all predicted modes that were measured.
pub fn errors(document: &Document) -> Vec<Error<'_>> {
    let prediction = document.prediction.as_deref().unwrap_or_default();
    prediction
        .iter()
        .filter_map(|prediction| {
            let percent = prediction.error_percent.filter(|e| e.is_finite())?;
            let bound = prediction
                .measured
                .zip(reading_bound(document, prediction.mode))
                .map(|(measured, bound)| 100.0 * bound / measured);
            Some(Error {
                prediction,
                percent,
                bound,
            })
        })
        .collect()
}

/// The axes: the modes side by side, and their errors (%).
pub fn panel(errors: &[Error<'_>]) -> Panel {
    let ends = errors.iter().flat_map(|error| {
        let bound = error.bound.unwrap_or(0.0);
        [error.percent - bound, error.percent + bound, 0.0]
    });
    let (low, high) = extent(ends).unwrap_or((-1.0, 1.0));
    // Differences of thousandths of a percent mean nothing in practice; magnified they would mislead.
    let low = low.min(-LEAST_SPAN);
    let high = high.max(LEAST_SPAN);
    Panel {
        x: Axis::linear((-0.5, errors.len() as f64 - 0.5), (INNER_LEFT, RIGHT)),
        y: Axis::linear(padded((low, high), 0.14), (396.0, 98.0)),
    }
}

fn draw_error(drawing: &mut Drawing, panel: &Panel, index: usize, error: &Error<'_>, count: usize) {
    let used = error.prediction.used;
    let color = if used { BLUE } else { VERMILION };
    let (x, y) = panel.place(index as f64, error.percent);
    if let Some(bound) = error.bound {
        let ends = [error.percent - bound, error.percent + bound].map(|end| panel.y.place(end));
        let stroke = Stroke::new(color, 1.5);
        drawing.line(vec![(x, ends[0]), (x, ends[1])], stroke);
        for end in ends {
            drawing.line(vec![(x - 7.0, end), (x + 7.0, end)], stroke);
        }
    }
    if used {
        drawing.dot((x, y), 6.0, color);
    } else {
        drawing.ring((x, y), 6.0, color);
    }
    let words = format!("{} %", signed_percent(Some(error.percent)));
    // With more modes the words would touch; the table has the numbers.
    if count <= MOST_WITH_WORDS {
        let top = panel.y.place(error.percent + error.bound.unwrap_or(0.0));
        let text = Text::new(words, (x, top.min(y - 4.0) - 13.0), TICK_SIZE);
        drawing.text_on_paper(text.colored(color));
    }
    draw_mode_label(drawing, panel, x, error, count);
    let (half, sides) = (0.5 * (RIGHT - INNER_LEFT) / count as f64, panel.y);
    let words = format!("{}: error {}", frequencies_words(error), error_words(error));
    drawing.note((x - half, sides.to), (x + half, sides.from), words);
}

/// "mode 1, measured 16.5524 Hz, predicted 16.7220 Hz".
pub fn frequencies_words(error: &Error<'_>) -> String {
    let mut words = format!("mode {}", error.prediction.mode);
    let both = [
        ("measured", error.prediction.measured),
        ("predicted", error.prediction.predicted),
    ];
    for (word, value) in both {
        if let Some(value) = value {
            words.push_str(&format!(", {word} {} Hz", significant(value, 6)));
        }
    }
    words
}

/// "+1.0 %, the reading ±0.001 %".
fn error_words(error: &Error<'_>) -> String {
    let percent = format!("{} %", signed_percent(Some(error.percent)));
    let bound = error.bound.map(bound_percent);
    bound.map_or(percent.clone(), |bound| {
        format!("{percent}, the reading {bound} %")
    })
}

fn draw_mode_label(drawing: &mut Drawing, panel: &Panel, x: f64, error: &Error<'_>, count: usize) {
    let below = panel.y.from;
    let mode = error.prediction.mode;
    let name = if count <= MOST_WITH_WORDS {
        format!("mode {mode}")
    } else {
        mode.to_string()
    };
    let name = Text::new(name, (x, below + 17.0), TICK_SIZE).bold();
    drawing.text(name.aligned(Align::Middle));
    if count > MOST_WITH_NUMBERS {
        return;
    }
    let rows = [
        ("measured", error.prediction.measured),
        ("predicted", error.prediction.predicted),
    ];
    for (row, (word, value)) in rows.into_iter().enumerate() {
        let at = (x, below + 37.0 + 18.0 * row as f64);
        let value = value.map_or(String::new(), |value| significant(value, 5));
        let words = if count <= 6 {
            format!("{word} {value} Hz")
        } else {
            format!("{value} Hz")
        };
        let text = Text::new(words, at, 12.0).colored(SOFT);
        drawing.text(text.aligned(Align::Middle));
    }
}

fn legend(errors: &[Error<'_>]) -> Vec<(Sample, String)> {
    let used = (Sample::Dot(BLUE), "mode used in the estimate".to_owned());
    let unused = (
        Sample::Ring(VERMILION),
        "mode not used: a true prediction".to_owned(),
    );
    let mut entries = Vec::new();
    if errors.iter().any(|error| error.prediction.used) {
        entries.push(used);
    }
    if errors.iter().any(|error| !error.prediction.used) {
        entries.push(unused);
    }
    entries
}
