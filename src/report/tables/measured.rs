//! Tables of what was measured: recordings, taps, resonances.

use super::super::document::{Document, ModeSection, RecordingSection, TapSection};
use super::super::format::{MISSING, line_reading, optional, rounded, significant, trimmed};
use super::{Column, Table, bound_of, mode_name, number, words};

/// One row for each recording; `None` without recordings.
pub fn recordings(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().filter(|r| !r.is_empty())?;
    Some(Table {
        caption: "Recordings and their spectra".to_owned(),
        columns: vec![
            words("Recording"),
            number("Rate (Hz)"),
            number("Length (s)"),
            number("Channels").on_page(),
            number("Taps used"),
            number("Block (samples)").on_page(),
            number("Lines").on_page(),
            number("Band (Hz)").on_page(),
            number("Spacing (Hz)"),
            number("1/T (Hz)"),
            number("Half line (Hz)").on_page(),
            words("Window"),
            number("Window's decay (1/s)").on_page(),
            number("Left at end (%)").on_page(),
        ],
        rows: recordings.iter().map(recording_row).collect(),
        note: "Spacing: distance of the spectral lines. 1/T: resolution, T the length of signal \
               used. Block: samples at the rate of the zoomed band. Left at end: level at the \
               record's end relative to its start."
            .to_owned(),
    })
}

fn recording_row(recording: &RecordingSection) -> Vec<String> {
    let used = recording.taps.iter().filter(|tap| tap.accepted).count();
    let count = |value: Option<usize>| value.map_or(MISSING.to_owned(), |v| v.to_string());
    vec![
        recording.file.clone(),
        trimmed(recording.sample_rate, 8),
        trimmed(recording.seconds, 4),
        recording.channels.to_string(),
        format!("{used} of {}", recording.taps.len()),
        count(recording.block),
        count(recording.lines),
        band(recording.band),
        exact(recording.line_spacing),
        exact(recording.resolution),
        exact(recording.half_line),
        recording.window.clone().unwrap_or_else(|| MISSING.into()),
        optional(recording.window_decay, 3),
        optional(recording.remaining_at_end.map(|level| 100.0 * level), 2),
    ]
}

/// A setting in Hz.
fn exact(value: Option<f64>) -> String {
    value.map_or(MISSING.to_owned(), |value| trimmed(value, 4))
}

fn band(band: Option<[f64; 2]>) -> String {
    band.map_or(MISSING.to_owned(), |[low, high]| {
        format!("{} to {}", trimmed(low, 6), trimmed(high, 6))
    })
}

/// One row for each tap; `None` where none was looked for or found.
pub fn taps(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let rows: Vec<Vec<String>> = recordings
        .iter()
        .flat_map(|recording| {
            let taps = recording.taps.iter().enumerate();
            taps.map(|(index, tap)| tap_row(&recording.file, index + 1, tap))
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    Some(Table {
        caption: "Taps".to_owned(),
        columns: vec![
            words("Recording"),
            number("Tap"),
            number("Time (s)"),
            number("Peak"),
            words("Used"),
            words("Reason"),
        ],
        rows,
        note: "Peak: force (N), or the response's peak where no hammer was recorded (SI)."
            .to_owned(),
    })
}

fn tap_row(file: &str, number: usize, tap: &TapSection) -> Vec<String> {
    let peak = match (tap.peak_force, tap.peak_response) {
        (Some(force), _) => format!("{} N", significant(force, 3)),
        (None, response) => optional(response, 3),
    };
    vec![
        file.to_owned(),
        number.to_string(),
        format!("{:.3}", tap.time),
        peak,
        if tap.accepted { "yes" } else { "no" }.to_owned(),
        tap.reason.clone().unwrap_or_default(),
    ]
}

/// One row for each resonance of the merged list; `None` without any.
pub fn modes(document: &Document) -> Option<Table> {
    let modes = document.modes.as_deref().filter(|m| !m.is_empty())?;
    Some(Table {
        caption: "Modes".to_owned(),
        columns: mode_columns(),
        rows: modes.iter().map(mode_row).collect(),
        note:
            "Frequency: the best reading with its bound (about 95 %). Line: the highest spectral \
               line \u{b1} half of the larger of line spacing and 1/T. \u{3bb}: non-dimensional \
               frequency of the Euler beam."
                .to_owned(),
    })
}

/// Each recording's own readings; `None` where there is at most one recording.
pub fn readings(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().filter(|r| r.len() > 1)?;
    let rows: Vec<Vec<String>> = recordings
        .iter()
        .flat_map(|recording| {
            recording.modes.iter().map(|mode| {
                let mut mode = mode.clone();
                mode.recording.get_or_insert_with(|| recording.file.clone());
                mode_row(&mode)
            })
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    Some(Table {
        caption: "Readings of each recording".to_owned(),
        columns: mode_columns(),
        rows,
        note: "The list of modes takes each from the recording that resolves it best.".to_owned(),
    })
}

fn mode_columns() -> Vec<Column> {
    vec![
        words("Mode"),
        number("Frequency (Hz)"),
        words("Method").on_page(),
        number("Line (Hz)"),
        number("Between lines (Hz)").on_page(),
        number("Damping ratio (%)"),
        number("\u{3bb} (1)"),
        number("Prominence (dB)").on_page(),
        number("Above noise (dB)").on_page(),
        words("Recording"),
    ]
}

fn mode_row(mode: &ModeSection) -> Vec<String> {
    let line = mode.line_frequency.map(|line| match mode.half_line {
        Some(half) => line_reading(line, half).joined(),
        None => significant(line, 6),
    });
    let interpolated = mode
        .interpolated_frequency
        .map(|frequency| rounded(frequency, mode.interpolated_bound).joined());
    let damping = mode.damping.map(|damping| {
        let std = mode.damping_std.map(|std| 100.0 * std);
        match std {
            Some(_) => rounded(100.0 * damping, std).joined(),
            None => significant(100.0 * damping, 2),
        }
    });
    vec![
        mode_name(mode),
        best(mode),
        mode.method.clone(),
        line.unwrap_or_else(|| MISSING.into()),
        interpolated.unwrap_or_else(|| MISSING.into()),
        damping.unwrap_or_else(|| MISSING.into()),
        lambda(mode),
        optional(mode.prominence_db, 2),
        optional(mode.above_noise_db, 2),
        mode.recording.clone().unwrap_or_else(|| MISSING.into()),
    ]
}

/// The best frequency with its bound.
pub fn best(mode: &ModeSection) -> String {
    match (mode.method.as_str(), mode.half_line) {
        ("line" | "given", Some(half_line)) => line_reading(mode.frequency, half_line).joined(),
        _ => match bound_of(mode) {
            Some(bound) => rounded(mode.frequency, Some(bound)).joined(),
            None => significant(mode.frequency, 6),
        },
    }
}

/// Lambda with the digits that the frequency supports: it grows with the frequency's square root.
fn lambda(mode: &ModeSection) -> String {
    let Some(lambda) = mode.lambda else {
        return MISSING.to_owned();
    };
    match bound_of(mode) {
        Some(bound) if mode.frequency > 0.0 => {
            rounded(lambda, Some(0.5 * lambda * bound / mode.frequency)).value
        }
        _ => significant(lambda, 5),
    }
}
