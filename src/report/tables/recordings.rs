//! Tables of what was recorded: recordings, their channels and taps; datasets of universal files.

use super::super::document::{Document, RecordingSection, TapSection};
use super::super::format::{MISSING, optional, or_missing, significant, trimmed, unit_words};
use super::{Table, number, words};

/// One row for each recording, with its spectra; `None` without recordings.
pub fn recordings(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().filter(|r| !r.is_empty())?;
    let transformed = recordings.iter().any(|r| r.line_spacing.is_some());
    let (caption, note) = match transformed {
        true => (
            "Recordings and their spectra",
            "Spacing: distance of the spectral lines. 1/T: resolution, T the length of signal \
             used. Block: samples at the rate of the zoomed band. Left at end: level at the \
             record's end relative to its start.",
        ),
        false => ("Recordings", ""),
    };
    let mut rows = Vec::new();
    for recording in recordings {
        let used = recording.taps.iter().filter(|tap| tap.accepted).count();
        rows.push(vec![
            recording.file.clone(),
            recording.format.clone(),
            or_missing(recording.sample_rate.map(|rate| trimmed(rate, 8))),
            exact(recording.seconds),
            recording.channels.to_string(),
            match (recording.sample_rate, recording.taps.len()) {
                // Functions from a file: of their taps nothing is known.
                (None, 0) => MISSING.to_owned(),
                (_, all) => format!("{used} of {all}"),
            },
            or_missing(recording.block),
            or_missing(recording.lines),
            or_missing(
                recording
                    .band
                    .map(|[low, high]| format!("{} to {}", trimmed(low, 6), trimmed(high, 6))),
            ),
            exact(recording.line_spacing),
            exact(recording.resolution),
            exact(recording.half_line),
            or_missing(recording.window.clone()),
            optional(recording.window_decay, 3),
            optional(recording.remaining_at_end.map(|level| 100.0 * level), 2),
        ]);
    }
    let table = Table {
        caption: caption.to_owned(),
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
        ],
        rows,
        note: note.to_owned(),
    };
    Some(table.without_empty_columns())
}

/// Places of taps and sensors in each recording, and its conditions: beside the spectra's columns these would
/// need a page wider than a screen. `None` where nothing of it is stated.
pub fn conditions(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().filter(|r| !r.is_empty())?;
    let mut rows = Vec::new();
    for recording in recordings {
        let sensors = recording.conditions.sensor_positions.iter();
        let sensors = sensors.map(|(name, position)| format!("{name} {}", trimmed(*position, 4)));
        let masses = recording.conditions.masses.iter();
        let masses = masses.map(|one| {
            let grams = significant(1e3 * one.mass, 4);
            format!("{grams} g at {} m", trimmed(one.position, 4))
        });
        rows.push(vec![
            recording.file.clone(),
            exact(recording.conditions.tap),
            listed(sensors.collect()),
            listed(masses.collect()),
            exact(recording.conditions.torque),
            exact(recording.conditions.temperature),
            or_missing(recording.conditions.date.clone()),
        ]);
    }
    let table = Table {
        caption: "Where and how each was recorded".to_owned(),
        columns: vec![
            words("Recording"),
            number("Tap at (m)").on_page(),
            words("Sensors at (m)").on_page(),
            words("Fastened").on_page(),
            number("Torque (N m)").on_page(),
            number("Temperature (°C)").on_page(),
            words("Date").on_page(),
        ],
        rows,
        note: String::new(),
    };
    Some(table.without_empty_columns()).filter(|table| table.columns.len() > 1)
}

/// "A 0.338, B 0.205".
fn listed(parts: Vec<String>) -> String {
    or_missing((!parts.is_empty()).then(|| parts.join(", ")))
}

/// A setting.
fn exact(value: Option<f64>) -> String {
    or_missing(value.map(|value| trimmed(value, 4)))
}

/// One row for each channel; `None` without recordings.
pub fn channels(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let mut rows = Vec::new();
    for recording in recordings {
        for channel in &recording.channel_details {
            let unit = channel.info.unit.as_deref().unwrap_or("not given");
            rows.push(vec![
                match recordings.len() {
                    1 => String::new(),
                    _ => recording.file.clone(),
                },
                channel.channel.to_string(),
                channel.info.name.clone().unwrap_or_default(),
                unit_words(unit),
                significant(channel.info.health.mean, 3),
                significant(channel.info.health.rms, 3),
                significant(channel.info.health.peak, 3),
                channel.info.health.full_scale_samples.to_string(),
                channel.info.health.flat_top_count.to_string(),
                channel.info.health.dropped_samples.to_string(),
            ]);
        }
    }
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

/// Returns the unit of the taps' peaks, also where none was stated.
pub fn peak_unit(recording: &RecordingSection) -> String {
    unit_words(recording.tap_unit.as_deref().unwrap_or("unit of the file"))
}

/// One row for each tap; `None` where none was looked for or found.
pub fn taps(document: &Document) -> Option<Table> {
    taps_of(document, "Taps", |_| true)
}

/// One row for each tap that was not used; `None` without any.
pub fn rejected_taps(document: &Document) -> Option<Table> {
    taps_of(document, "Rejected taps", |tap| !tap.accepted)
}

fn taps_of(
    document: &Document,
    caption: &str,
    wanted: impl Fn(&TapSection) -> bool,
) -> Option<Table> {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let mut rows = Vec::new();
    for recording in recordings {
        for (index, tap) in recording.taps.iter().enumerate() {
            if !wanted(tap) {
                continue;
            }
            rows.push(vec![
                recording.file.clone(),
                (index + 1).to_string(),
                format!("{:.3}", tap.time),
                or_missing(peak(tap).map(|peak| significant(peak, 3))),
                peak_unit(recording),
                if tap.accepted { "yes" } else { "no" }.to_owned(),
                tap.reason.clone().unwrap_or_default(),
            ]);
        }
    }
    if rows.is_empty() {
        return None;
    }
    let rows = without_single_name(rows, recordings);
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
    Some(table.without_empty_columns())
}

/// Rows without the recording's name where there is only one: the table of recordings has it.
fn without_single_name(
    mut rows: Vec<Vec<String>>,
    recordings: &[RecordingSection],
) -> Vec<Vec<String>> {
    if recordings.len() == 1 {
        for name in rows.iter_mut().filter_map(|row| row.first_mut()) {
            name.clear();
        }
    }
    rows
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
    let mut rows = Vec::new();
    for recording in recordings.iter().filter(|one| !one.taps.is_empty()) {
        let used: Vec<&TapSection> = recording.taps.iter().filter(|tap| tap.accepted).collect();
        let peaks = used.iter().filter_map(|tap| peak(tap));
        let softest = peaks.clone().min_by(f64::total_cmp);
        let hardest = peaks.max_by(f64::total_cmp);
        let mut row = vec![
            recording.file.clone(),
            format!("{} of {}", used.len(), recording.taps.len()),
        ];
        for tap in [used.first(), used.last()] {
            row.push(or_missing(tap.map(|tap| format!("{:.3}", tap.time))));
        }
        for peak in [softest, hardest] {
            row.push(or_missing(peak.map(|peak| significant(peak, 3))));
        }
        row.push(peak_unit(recording));
        rows.push(row);
    }
    if rows.is_empty() {
        return None;
    }
    let rows = without_single_name(rows, recordings);
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

/// One row for each dataset; `None` without any.
pub fn datasets(document: &Document) -> Option<Table> {
    let datasets = document.datasets.as_deref().filter(|d| !d.is_empty())?;
    let first = datasets.first().map(|dataset| &dataset.file);
    let several = datasets.iter().any(|dataset| Some(&dataset.file) != first);
    let mut rows = Vec::new();
    for dataset in datasets {
        let step = match (dataset.spacing, &dataset.spacing_unit) {
            (Some(step), Some(unit)) => format!("{} {unit}", trimmed(step, 6)),
            (Some(step), None) => trimmed(step, 6),
            (None, _) if dataset.points.is_some() => "uneven".to_owned(),
            (None, _) => MISSING.to_owned(),
        };
        let unit = match (&dataset.unit, &dataset.denominator_unit) {
            (Some(above), Some(below)) => format!("({above})/({below})"),
            (above, _) => or_missing(above.clone()),
        };
        rows.push(vec![
            match several {
                true => dataset.file.clone(),
                false => String::new(),
            },
            dataset.dataset.to_string(),
            dataset.kind.clone(),
            or_missing(dataset.points),
            step,
            or_missing(dataset.response.clone()),
            or_missing(dataset.reference.clone()),
            unit,
            or_missing(dataset.values.clone()),
            or_missing(dataset.coding.clone()),
            or_missing(dataset.description.clone()),
        ]);
    }
    let table = Table {
        caption: "Datasets".to_owned(),
        columns: vec![
            words("File"),
            number("Number"),
            words("Kind"),
            number("Points"),
            number("Step"),
            words("Response"),
            words("Reference"),
            words("Unit"),
            words("Values").on_page(),
            words("Stored as").on_page(),
            words("Description").on_page(),
        ],
        rows,
        note: "As the headers say; values were not read.".to_owned(),
    };
    Some(table.without_empty_columns())
}
