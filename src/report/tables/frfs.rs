//! The table of resonances on frequency response functions.

use super::super::document::{Document, FrfResonanceSection, FrfSection};
use super::super::format::{MISSING, optional, trimmed, unit_words};
use super::{Table, number, words};

/// One row for each resonance on each function; `None` where no functions were asked for or none
/// exist.
pub fn frfs(document: &Document) -> Option<Table> {
    let frfs = document.frfs.as_deref()?;
    let first = frfs.first()?;
    let rows = frfs
        .iter()
        .flat_map(|frf| frf.resonances.iter().map(|found| row(document, frf, found)))
        .collect();
    let taps = frfs.iter().map(|frf| frf.averages);
    let (least, most) = (taps.clone().min().unwrap_or(0), taps.max().unwrap_or(0));
    let table = Table {
        caption: format!(
            "Frequency response functions at the resonances, {}, {}",
            first.estimator,
            averages(least, most)
        ),
        columns: vec![
            words("Recording"),
            words("Response"),
            words("Mode"),
            number("Frequency (Hz)"),
            number(&format!("|{}|", first.estimator)),
            words("Unit"),
            number("Phase (\u{b0})"),
            number("Coherence"),
            number("Random error (%)"),
        ],
        rows,
        note: note(frfs, least),
    };
    Some(table.without_empty_columns())
}

fn averages(least: usize, most: usize) -> String {
    match (least, most) {
        (1, 1) => "1 tap".to_owned(),
        _ if least == most => format!("{least} taps averaged"),
        _ => format!("{least} to {most} taps averaged"),
    }
}

fn note(frfs: &[FrfSection], least: usize) -> String {
    let mut text =
        "Magnitude, phase and coherence stand on the line nearest to each resonance.".to_owned();
    if least < 2 {
        text.push_str(
            " Of one average there is no coherence: it would be 1 whatever the noise, and mean nothing.",
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

fn row(document: &Document, frf: &FrfSection, found: &FrfResonanceSection) -> Vec<String> {
    let several = document.recordings.as_ref().is_some_and(|r| r.len() > 1);
    let name = match (found.mode, &found.label) {
        (Some(mode), _) => mode.to_string(),
        (None, Some(label)) => label.clone(),
        (None, None) => "unpaired".to_owned(),
    };
    let fixed = |value: Option<f64>, digits: usize| {
        value.map_or(MISSING.to_owned(), |value| format!("{value:.digits$}"))
    };
    vec![
        if several {
            frf.recording.clone()
        } else {
            String::new()
        },
        frf.response.clone(),
        name,
        trimmed(found.frequency, 6),
        optional(found.magnitude, 4),
        unit_words(&frf.unit),
        fixed(found.phase, 1),
        fixed(found.coherence, 4),
        optional(found.random_error.map(|error| 100.0 * error), 2),
    ]
}
