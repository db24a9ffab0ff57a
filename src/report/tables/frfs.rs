//! The table of resonances on frequency response functions.

use super::super::document::{Document, FrfResonanceSection, FrfSection};
use super::super::format::{MISSING, optional, trimmed, unit_words};
use super::{Table, coherence, mode_name, number, words};

/// One row for each resonance on each function; `None` where no functions were asked for or none
/// exist.
pub fn frfs(document: &Document) -> Option<Table> {
    let frfs = document.frfs.as_deref()?;
    let first = frfs.first()?;
    let one_unit = frfs.iter().all(|frf| frf.unit == first.unit);
    let magnitude = if one_unit {
        format!("|{}| ({})", first.estimator, unit_words(&first.unit))
    } else {
        format!("|{}|", first.estimator)
    };
    let rows = frfs
        .iter()
        .flat_map(|frf| {
            let unit = if one_unit {
                String::new()
            } else {
                unit_words(&frf.unit)
            };
            let named = (recording_name(document, frf), unit);
            frf.resonances
                .iter()
                .map(move |found| row(frf, found, named.clone()))
        })
        .collect();
    let taps = frfs.iter().map(|frf| frf.averages);
    let (least, most) = (taps.clone().min().unwrap_or(0), taps.max().unwrap_or(0));
    let table = Table {
        caption: format!(
            "Frequency response functions at the resonances, {}",
            made_by(&first.estimator, least, most)
        ),
        columns: vec![
            words("Recording"),
            words("Response"),
            words("Mode"),
            number("Frequency (Hz)"),
            number(&magnitude),
            words("Unit"),
            number("Phase (\u{b0})"),
            number("Coherence"),
            number("Error (%)"),
        ],
        rows,
        note: note(frfs, least),
    };
    Some(table.without_empty_columns())
}

/// Estimator and taps; of what an analyser has made nobody says either.
fn made_by(estimator: &str, least: usize, most: usize) -> String {
    match (least, most) {
        (0, 0) => "as the file holds them".to_owned(),
        (1, 1) => format!("{estimator}, 1 tap"),
        _ if least == most => format!("{estimator}, {least} taps averaged"),
        _ => format!("{estimator}, {least} to {most} taps averaged"),
    }
}

fn note(frfs: &[FrfSection], least: usize) -> String {
    let mut text = "On the line nearest to each resonance.".to_owned();
    if least >= 2 {
        text.push_str(" Error: random error of the magnitude (standard deviation).");
    } else {
        text.push_str(
            " One average: no coherence; it would be 1 whatever the noise, and mean nothing.",
        );
    }
    if frfs.iter().any(|frf| frf.unit.contains("unit of the file")) {
        text.push_str(
            " The file states no unit for a channel: magnitudes are per unit of the file; give the \
             scales (SI units per unit of the file) to have them in SI units.",
        );
    }
    if let Some(decay) = frfs.iter().find_map(|frf| frf.window_decay) {
        text.push_str(&format!(
            " The exponential window adds a decay of {} 1/s to every pole, so peaks are lower than without.",
            trimmed(decay, 3)
        ));
    }
    text
}

/// The recording's name where there are several.
fn recording_name(document: &Document, frf: &FrfSection) -> String {
    let several = document.recordings.as_ref().is_some_and(|r| r.len() > 1);
    if several {
        frf.recording.clone()
    } else {
        String::new()
    }
}

fn row(
    frf: &FrfSection,
    found: &FrfResonanceSection,
    (recording, unit): (String, String),
) -> Vec<String> {
    let name = mode_name(found.mode, found.label.as_deref());
    let phase = |value: f64| format!("{value:.1}").replace('-', "\u{2212}");
    vec![
        recording,
        frf.response.clone(),
        name,
        trimmed(found.frequency, 6),
        optional(found.magnitude, 4),
        unit,
        found.phase.map_or(MISSING.to_owned(), phase),
        coherence(found.coherence),
        optional(found.random_error.map(|error| 100.0 * error), 2),
    ]
}
