//! Tables of resonances.

use super::super::document::{Document, ModeSection};
use super::super::format::{
    MISSING, Rounded, frequency_reading, last_place, line_reading, optional, rounded_digits,
    rounded_to, significant,
};
use super::{Column, Table, bound_of, coherence, mode_name, number, words};

/// Most significant digits of lambda.
const LAMBDA_DIGITS: i32 = 6;
/// Most significant digits of a damping ratio.
const DAMPING_DIGITS: i32 = 4;

/// One row for each resonance of the merged list; `None` without any.
pub fn modes(document: &Document) -> Option<Table> {
    let modes = document.modes.as_deref().filter(|m| !m.is_empty())?;
    let given = modes.iter().all(|mode| mode.method == "given");
    let described = document.test.iter().any(|test| test.kind.is_some());
    let caption = match (given, described) {
        (true, _) => "Modes, frequencies given",
        (false, true) => "Modes",
        (false, false) => "Resonances",
    };
    let bare = MODES_NOTE.trim_end_matches(LAMBDA_NOTE);
    let note = match (given, described) {
        (true, _) => "Frequency: as it was given, with its bound.",
        (false, true) => MODES_NOTE,
        (false, false) => bare,
    };
    Some(table(caption, modes.iter().map(row).collect(), note))
}

const LAMBDA_NOTE: &str = " \u{3bb}: non-dimensional frequency of the Euler beam.";
const MODES_NOTE: &str = "Frequency: the best reading with its bound (about 95 %). Line: the \
                          highest spectral line \u{b1} half of the larger of line spacing and 1/T. \
                          \u{3bb}: non-dimensional frequency of the Euler beam.";

/// Each recording's own readings; `None` where there is at most one recording.
pub fn readings(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().filter(|r| r.len() > 1)?;
    let rows: Vec<Vec<String>> = recordings
        .iter()
        .flat_map(|recording| {
            recording.modes.iter().map(|mode| {
                let mut mode = mode.clone();
                mode.recording.get_or_insert_with(|| recording.file.clone());
                row(&mode)
            })
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    let note = "The list of modes takes each from the recording that resolves it best.";
    Some(table("Readings of each recording", rows, note))
}

/// The table; the recordings' column only where there are several.
fn table(caption: &str, mut rows: Vec<Vec<String>>, note: &str) -> Table {
    let name = |row: &Vec<String>| row.last().cloned();
    let first = rows.first().and_then(name);
    if rows.iter().all(|row| name(row) == first) {
        for cell in rows.iter_mut().filter_map(|row| row.last_mut()) {
            cell.clear();
        }
    }
    let table = Table {
        caption: caption.to_owned(),
        columns: columns(),
        rows,
        note: note.to_owned(),
    };
    table.without_empty_columns()
}

fn columns() -> Vec<Column> {
    vec![
        words("Mode"),
        number("Frequency (Hz)"),
        words("Method").on_page(),
        number("Line (Hz)"),
        number("Damping (%)"),
        number("\u{3bb} (1)"),
        number("Prominence (dB)").on_page(),
        number("Above noise (dB)").on_page(),
        number("Coherence").on_page(),
        number("Random error (%)").on_page(),
        words("Recording"),
    ]
}

fn row(mode: &ModeSection) -> Vec<String> {
    let line = mode.line_frequency.map(|line| match mode.half_line {
        Some(half) => line_reading(line, half).joined(),
        None => significant(line, 6),
    });
    vec![
        mode_name(mode),
        reading(mode).joined(),
        mode.method.clone(),
        line.unwrap_or_else(|| MISSING.into()),
        damping(mode),
        lambda(mode),
        optional(mode.prominence_db, 2),
        optional(mode.above_noise_db, 2),
        coherence(mode.coherence),
        optional(mode.random_error.map(|error| 100.0 * error), 2),
        mode.recording.clone().unwrap_or_else(|| MISSING.into()),
    ]
}

/// The damping ratio (%) with its standard deviation.
fn damping(mode: &ModeSection) -> String {
    let std = mode.damping_std.map(|std| 100.0 * std);
    mode.damping.map_or_else(
        || MISSING.to_owned(),
        |ratio| rounded_digits(100.0 * ratio, std, DAMPING_DIGITS).joined(),
    )
}

/// The best frequency with its bound.
pub fn reading(mode: &ModeSection) -> Rounded {
    match (mode.method.as_str(), mode.half_line, bound_of(mode)) {
        ("line" | "given", Some(half_line), _) => line_reading(mode.frequency, half_line),
        (_, half_line, Some(bound)) => frequency_reading(mode.frequency, bound, half_line),
        (_, _, None) => Rounded {
            value: significant(mode.frequency, 6),
            uncertainty: None,
        },
    }
}

/// Lambda with the digits that the frequency supports: it grows with the frequency's square root.
fn lambda(mode: &ModeSection) -> String {
    let Some(lambda) = mode.lambda else {
        return MISSING.to_owned();
    };
    match bound_of(mode) {
        Some(bound) if mode.frequency > 0.0 && lambda > 0.0 => {
            let uncertainty = Some(0.5 * lambda * bound / mode.frequency);
            rounded_to(lambda, uncertainty, last_place(lambda, LAMBDA_DIGITS)).value
        }
        _ => significant(lambda, 5),
    }
}
