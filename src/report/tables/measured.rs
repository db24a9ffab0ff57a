//! Tables of what was recorded: recordings and their channels.

use super::super::document::{ChannelSection, Document, RecordingSection};
use super::super::format::{MISSING, optional, significant, trimmed, unit_words};
use super::{Table, number, words};

/// Where taps and sensors were, and under what conditions: beside the spectra's columns these would
/// need a page wider than a screen.
const CONDITIONS: [&str; 6] = [
    "Tap at (m)",
    "Sensors at (m)",
    "Fastened",
    "Torque (N m)",
    "Temperature (°C)",
    "Date",
];

/// One row for each recording; `None` without recordings.
pub fn recordings(document: &Document) -> Option<Table> {
    Some(all_columns(document)?.without_columns(|name| CONDITIONS.contains(&name)))
}

/// Where taps and sensors were in each recording, and under what conditions; `None` where nothing of it
/// is stated.
pub fn conditions(document: &Document) -> Option<Table> {
    let kept = |name: &str| name == "Recording" || CONDITIONS.contains(&name);
    let table = all_columns(document)?.without_columns(|name| !kept(name));
    (table.columns.len() > 1).then(|| Table {
        caption: "Where and how each was recorded".to_owned(),
        note: String::new(),
        ..table
    })
}

fn all_columns(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().filter(|r| !r.is_empty())?;
    let transformed = recordings.iter().any(|r| r.line_spacing.is_some());
    let table = Table {
        caption: if transformed {
            "Recordings and their spectra"
        } else {
            "Recordings"
        }
        .to_owned(),
        columns: vec![
            words("Recording"),
            words("Format").on_page_if(transformed),
            number("Rate (Hz)"),
            number("Length (s)"),
            number("Channels").on_page_if(transformed),
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
            number("Tap at (m)").on_page(),
            words("Sensors at (m)").on_page(),
            words("Fastened").on_page(),
            number("Torque (N m)").on_page(),
            number("Temperature (°C)").on_page(),
            words("Date").on_page(),
        ],
        rows: recordings.iter().map(recording_row).collect(),
        note: if transformed {
            "Spacing: distance of the spectral lines. 1/T: resolution, T the length of signal \
             used. Block: samples at the rate of the zoomed band. Left at end: level at the \
             record's end relative to its start."
        } else {
            ""
        }
        .to_owned(),
    };
    Some(table.without_empty_columns())
}

fn recording_row(recording: &RecordingSection) -> Vec<String> {
    let used = recording.taps.iter().filter(|tap| tap.accepted).count();
    let count = |value: Option<usize>| value.map_or(MISSING.to_owned(), |v| v.to_string());
    vec![
        recording.file.clone(),
        recording.format.clone(),
        recording
            .sample_rate
            .map_or(MISSING.into(), |rate| trimmed(rate, 8)),
        recording
            .seconds
            .map_or(MISSING.into(), |seconds| trimmed(seconds, 4)),
        recording.channels.to_string(),
        match (recording.sample_rate, recording.taps.len()) {
            // Functions from a file: of their taps nothing is known.
            (None, 0) => MISSING.to_owned(),
            (_, all) => format!("{used} of {all}"),
        },
        count(recording.block),
        count(recording.lines),
        band(recording.band),
        exact(recording.line_spacing),
        exact(recording.resolution),
        exact(recording.half_line),
        recording.window.clone().unwrap_or_else(|| MISSING.into()),
        optional(recording.window_decay, 3),
        optional(recording.remaining_at_end.map(|level| 100.0 * level), 2),
        exact(recording.tap),
        places(recording),
        fastened(recording),
        exact(recording.torque),
        exact(recording.temperature),
        recording.date.clone().unwrap_or_else(|| MISSING.into()),
    ]
}

/// "A 0.338, B 0.205".
fn places(recording: &RecordingSection) -> String {
    let places: Vec<String> = recording
        .sensor_positions
        .iter()
        .map(|(name, position)| format!("{name} {}", trimmed(*position, 4)))
        .collect();
    if places.is_empty() {
        MISSING.to_owned()
    } else {
        places.join(", ")
    }
}

/// "15 g at 0.423 m".
fn fastened(recording: &RecordingSection) -> String {
    let masses = recording.masses.iter();
    let masses = masses.map(|one| {
        let grams = significant(1e3 * one.mass, 4);
        format!("{grams} g at {} m", trimmed(one.position, 4))
    });
    let masses: Vec<String> = masses.collect();
    if masses.is_empty() {
        MISSING.to_owned()
    } else {
        masses.join(", ")
    }
}

/// A setting.
fn exact(value: Option<f64>) -> String {
    value.map_or(MISSING.to_owned(), |value| trimmed(value, 4))
}

fn band(band: Option<[f64; 2]>) -> String {
    band.map_or(MISSING.to_owned(), |[low, high]| {
        format!("{} to {}", trimmed(low, 6), trimmed(high, 6))
    })
}

/// One row for each channel; `None` without recordings.
pub fn channels(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let several = recordings.len() > 1;
    let rows: Vec<Vec<String>> = recordings
        .iter()
        .flat_map(|recording| {
            let name = if several { recording.file.as_str() } else { "" };
            let details = recording.channel_details.iter();
            details.map(|channel| channel_row(name, channel))
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    let table = Table {
        caption: "Channels".to_owned(),
        columns: vec![
            words("Recording"),
            number("Channel"),
            words("Name"),
            words("Unit"),
            number("DC"),
            number("RMS"),
            number("Peak"),
            number("Full scale"),
            number("Flat tops"),
            number("Dropped samples"),
        ],
        rows,
        note: "DC: mean. RMS: about the mean. Peak: largest magnitude. Full scale: samples at the \
               end of the number range. Flat tops: crests that are cut off. Dropped samples: in \
               runs that repeat one value."
            .to_owned(),
    };
    Some(table.without_empty_columns())
}

fn channel_row(file: &str, channel: &ChannelSection) -> Vec<String> {
    let unit = channel.unit.as_deref().unwrap_or("not given");
    vec![
        file.to_owned(),
        channel.channel.to_string(),
        channel.name.clone().unwrap_or_default(),
        unit_words(unit),
        significant(channel.mean, 3),
        significant(channel.rms, 3),
        significant(channel.peak, 3),
        channel.full_scale_samples.to_string(),
        channel.flat_tops.to_string(),
        channel.dropped_samples.to_string(),
    ]
}
