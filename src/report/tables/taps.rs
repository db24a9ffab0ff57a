//! Tables of taps.

use super::super::document::{Document, RecordingSection, TapSection};
use super::super::format::{MISSING, significant, unit_words};
use super::{Table, number, words};

/// Unit of the taps' peaks, in words where nobody said.
pub fn peak_unit(recording: &RecordingSection) -> String {
    unit_words(recording.tap_unit.as_deref().unwrap_or("unit of the file"))
}

/// One row for each tap; `None` where none was looked for or found.
pub fn taps(document: &Document) -> Option<Table> {
    chosen(document, "Taps", |_| true)
}

/// One row for each tap that was not used; `None` without any.
pub fn rejected_taps(document: &Document) -> Option<Table> {
    let mut table = chosen(document, "Rejected taps", |tap| !tap.accepted)?;
    // All say "no" there.
    for cell in table.rows.iter_mut().filter_map(|row| row.get_mut(USED)) {
        cell.clear();
    }
    Some(table.without_empty_columns())
}

/// Place of the column that says whether a tap was used.
const USED: usize = 5;

fn chosen(
    document: &Document,
    caption: &str,
    wanted: impl Fn(&TapSection) -> bool,
) -> Option<Table> {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let rows: Vec<Vec<String>> = recordings
        .iter()
        .flat_map(|recording| {
            let taps = recording.taps.iter().enumerate();
            taps.filter(|(_, tap)| wanted(tap))
                .map(|(index, tap)| row(recording, index + 1, tap))
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    let table = Table {
        caption: caption.to_owned(),
        columns: vec![
            words("Recording"),
            number("Tap"),
            number("Time (s)"),
            number("Peak"),
            words("Unit"),
            words("Used"),
            words("Reason"),
        ],
        rows,
        note: peaks_note(recordings),
    };
    Some(table)
}

fn row(recording: &RecordingSection, number: usize, tap: &TapSection) -> Vec<String> {
    vec![
        recording.file.clone(),
        number.to_string(),
        format!("{:.3}", tap.time),
        peak(tap).map_or(MISSING.to_owned(), |peak| significant(peak, 3)),
        peak_unit(recording),
        if tap.accepted { "yes" } else { "no" }.to_owned(),
        tap.reason.clone().unwrap_or_default(),
    ]
}

fn peak(tap: &TapSection) -> Option<f64> {
    tap.peak_force.or(tap.peak_response)
}

fn peaks_note(recordings: &[RecordingSection]) -> String {
    let with = recordings.iter().any(|recording| recording.has_hammer);
    let without = recordings.iter().any(|recording| !recording.has_hammer);
    match (with, without) {
        (true, false) => "Peak: of the force.",
        (false, true) => "Peak: of the response on which the tap stands out most.",
        _ => "Peak: of the force, or without a hammer of the response on which the tap stands out most.",
    }
    .to_owned()
}

/// One row for each recording: how many taps were used, when, and how hard they were; `None`
/// without any tap.
pub fn taps_used(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let rows: Vec<Vec<String>> = recordings
        .iter()
        .filter(|recording| !recording.taps.is_empty())
        .map(used_row)
        .collect();
    if rows.is_empty() {
        return None;
    }
    let table = Table {
        caption: "Taps used".to_owned(),
        columns: vec![
            words("Recording"),
            number("Used"),
            number("First (s)"),
            number("Last (s)"),
            number("Smallest peak"),
            number("Largest peak"),
            words("Unit"),
        ],
        rows,
        note: peaks_note(recordings),
    };
    Some(table.without_empty_columns())
}

fn used_row(recording: &RecordingSection) -> Vec<String> {
    let used: Vec<&TapSection> = recording.taps.iter().filter(|tap| tap.accepted).collect();
    let time = |tap: Option<&&TapSection>| {
        tap.map_or(MISSING.to_owned(), |tap| format!("{:.3}", tap.time))
    };
    let peaks = || used.iter().filter_map(|tap| peak(tap));
    let written = |peak: Option<f64>| peak.map_or(MISSING.to_owned(), |peak| significant(peak, 3));
    vec![
        recording.file.clone(),
        format!("{} of {}", used.len(), recording.taps.len()),
        time(used.first()),
        time(used.last()),
        written(peaks().min_by(f64::total_cmp)),
        written(peaks().max_by(f64::total_cmp)),
        peak_unit(recording),
    ]
}
