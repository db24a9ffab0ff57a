//! The table of measured and predicted frequencies.

use super::super::document::{Document, PredictionSection};
use super::super::format::{MISSING, bound_percent, optional, signed_percent, with_decimals_of};
use super::modes::reading;
use super::{Table, bound_of, mode_of, number, words};

/// Measured beside predicted frequencies; `None` where nothing was predicted.
pub fn prediction(document: &Document) -> Option<Table> {
    let rows = document.prediction.as_deref().filter(|p| !p.is_empty())?;
    let compared = rows.iter().any(|row| row.measured.is_some());
    let used = |used: bool| if used { "yes" } else { "no" }.to_owned();
    let cells = rows
        .iter()
        .map(|row| {
            let [measured, predicted, reading] = compared_frequencies(document, row);
            vec![
                row.mode.to_string(),
                measured,
                predicted,
                signed_percent(row.error_percent),
                reading,
                optional(row.lambda, 6),
                if compared {
                    used(row.used)
                } else {
                    String::new()
                },
            ]
        })
        .collect();
    let (caption, note) = if compared {
        (
            "Measured and predicted frequencies",
            "Error = 100 (predicted \u{2212} measured)/measured. Reading: bound of the measured \
             frequency. Used: the mode entered the estimate; the others are true predictions.",
        )
    } else {
        (
            "Predicted frequencies",
            "\u{3bb}: non-dimensional frequency, \u{3bb}\u{2074} = (2\u{3c0}f)\u{b2} \u{3c1}A \
             L\u{2074}/(EI).",
        )
    };
    let table = Table {
        caption: caption.to_owned(),
        columns: vec![
            number("Mode"),
            number("Measured (Hz)"),
            number("Predicted (Hz)"),
            number("Error (%)"),
            number("Reading (%)"),
            number("\u{3bb} (1)"),
            words("Used"),
        ],
        rows: cells,
        note: note.to_owned(),
    };
    Some(table.without_empty_columns())
}

/// Measured and predicted frequency to the same digit, and the bound of the reading in percent.
fn compared_frequencies(document: &Document, row: &PredictionSection) -> [String; 3] {
    let mode = mode_of(document, row.mode);
    let bound = mode.and_then(bound_of);
    // The digits of the list of modes, so that the same frequency reads the same.
    let listed = mode
        .filter(|_| bound.is_some())
        .map(|mode| reading(mode).value);
    let hertz = |value: Option<f64>| match (value, &listed) {
        (Some(value), Some(listed)) => with_decimals_of(value, listed),
        _ => optional(value, 6),
    };
    let percent = bound
        .zip(row.measured)
        .map(|(bound, hz)| 100.0 * bound / hz);
    [
        hertz(row.measured),
        hertz(row.predicted),
        percent.map_or(MISSING.into(), bound_percent),
    ]
}
