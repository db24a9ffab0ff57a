//! Tables of resonances: as read, on frequency response functions, and beside their predictions.

use super::{
    Cell, Place, Table, bound_of, coherence, mode_name, mode_of, number, page_number, page_words,
    words,
};
use crate::document::{Document, ModeSection, PredictionSection, ReadBy, is_strong, method_name};
use crate::format::{
    MISSING, Rounded, bound_percent, frequency_reading, last_place, line_reading, optional,
    or_missing, rounded_digits, rounded_to, signed_percent, significant, trimmed, unit_words,
    with_decimals_of,
};
use tapjoint_numerics::stats::NORMAL_95;
use tapjoint_signal::modal::fit::UncertaintySource;

/// Most significant digits of lambda.
const LAMBDA_DIGITS: i32 = 6;
/// Most significant digits of a damping ratio.
const DAMPING_DIGITS: i32 = 4;

/// Returns true for what tables show: resonances, and strong peaks that are none.
fn is_shown(mode: &&ModeSection) -> bool {
    !mode.is_weak && (!mode.is_unclear || is_strong(mode.above_noise_db))
}

/// "2 peaks without a clear resonance are left out; the JSON has them."; `None` where all are shown.
pub fn left_out(document: &Document) -> Option<String> {
    let modes = document.modes.as_deref().unwrap_or_default();
    let weak = modes.iter().filter(|mode| mode.is_weak).count();
    let unclear = modes.iter().filter(|mode| !is_shown(mode)).count() - weak;
    let mut parts = Vec::new();
    let kinds = [
        (unclear, "without a clear resonance"),
        (weak, "too weak for a mode"),
    ];
    for (count, kind) in kinds {
        match count {
            0 => {}
            1 => parts.push(format!("1 peak {kind}")),
            count => parts.push(format!("{count} peaks {kind}")),
        }
    }
    let (are, them) = match weak + unclear {
        0 => return None,
        1 => ("is", "it"),
        _ => ("are", "them"),
    };
    Some(format!(
        "{} {are} left out; the JSON has {them}.",
        parts.join(" and ")
    ))
}

/// One row for each resonance of the merged list, and for each strong peak that is none; `None` without any.
pub fn modes(document: &Document) -> Option<Table> {
    let modes: Vec<&ModeSection> = document.modes.as_deref()?.iter().filter(is_shown).collect();
    if modes.is_empty() {
        return None;
    }
    let given = modes.iter().all(|mode| mode.method.is_none());
    let described = document.test.iter().any(|test| test.kind.is_some());
    let caption = match (given, described) {
        (true, _) => "Modes, frequencies given",
        (false, true) => "Modes",
        (false, false) => "Resonances",
    };
    let mut note = match given {
        true => "Frequency: as it was given, with its bound.".to_owned(),
        false => note(document, &modes, described),
    };
    if let Some(others) = left_out(document) {
        note = format!("{note} {others}");
    }
    if let Some(from) = modes_from(document) {
        note = format!("{from} {note}");
    }
    Some(table(caption, modes.into_iter(), &note).without_columns(&DETAILS))
}

/// "From soft.wav; hard.wav (8.8 times its tap level) enters the diagnosis alone."; `None` where every recording
/// gives the list.
pub fn modes_from(document: &Document) -> Option<String> {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let lengths = document.lengths.as_deref().unwrap_or_default();
    let (mut from, mut aside) = (Vec::new(), Vec::new());
    let (mut moved, mut unused) = (Vec::new(), Vec::new());
    for recording in recordings {
        let file = &recording.file;
        let others = match (&recording.aside, recording.conditions.free_length) {
            (None, _) => {
                from.push(file.clone());
                continue;
            }
            (Some(_), None) => &mut aside,
            (Some(_), _) if lengths.iter().any(|one| one.recordings.contains(file)) => &mut moved,
            (Some(_), _) => &mut unused,
        };
        let how = recording.aside.as_deref().unwrap_or_default();
        others.push(format!("{file} ({how})"));
    }
    // A file may be read in several bands.
    from.dedup();
    let mut parts = vec![format!("From {}", from.join(", "))];
    for (mut others, one, several) in [
        (
            aside,
            "enters the diagnosis alone",
            "enter the diagnosis alone",
        ),
        (
            moved,
            "enters the estimate by modes of its own",
            "enter the estimate by modes of their own",
        ),
        (unused, "is not used", "are not used"),
    ] {
        others.dedup();
        let what = if others.len() == 1 { one } else { several };
        if !others.is_empty() {
            parts.push(format!("{} {what}", others.join(", ")));
        }
    }
    (parts.len() > 1).then(|| parts.join("; ") + ".")
}

/// Measured beside predicted frequencies of the beam at its other free lengths; `None` without any.
pub fn lengths(document: &Document) -> Option<Table> {
    let lengths = document.lengths.as_deref()?.iter();
    let rows = lengths.flat_map(|length| {
        let (modes, prediction) = (&length.modes, &length.prediction);
        beside_prediction("Free length (m)", length.length, modes, prediction)
    });
    let note = "The same joint holds the beam at each length, and all lengths enter one estimate. The diagnosis takes the \
                recordings of the beam's own length alone.";
    let rows: Vec<_> = rows.collect();
    (!rows.is_empty()).then(|| Table::of("Modes where the clamp was moved", rows, note))
}

/// Measured beside predicted frequencies of the same bar without its joint; `None` without its test.
pub fn free_test(document: &Document) -> Option<Table> {
    let free = document.free_test.as_ref()?;
    let rows = beside_prediction("Length (m)", free.length, &free.modes, &free.prediction);
    let used = match free.prediction.is_empty() {
        true => {
            "They are not used: without uncertainties of the frequencies the free bar tells nothing."
        }
        false => "They enter the estimate as data, and tell how stiff and heavy the bar is.",
    };
    let note = format!(
        "Frequencies of the same bar without its joint, by {}. {used}",
        free.file
    );
    (!rows.is_empty()).then(|| Table::of("Modes of the free bar", rows, &note))
}

/// Returns a row for each numbered mode, measured beside predicted, and the length (m) that all have.
fn beside_prediction(
    heading: &str,
    length: f64,
    modes: &[ModeSection],
    prediction: &[PredictionSection],
) -> Vec<[Cell; 6]> {
    let numbered = modes.iter().filter(|mode| mode.mode.is_some());
    let rows = numbered.map(|mode| {
        let mut fitted = prediction.iter();
        let fitted = fitted.find(|row| Some(row.mode) == mode.mode);
        let value = reading(mode).value;
        let predicted = fitted.and_then(|row| row.predicted);
        [
            number(heading, trimmed(length, 6)),
            number("Mode", or_missing(mode.mode)),
            number("Measured (Hz)", value.clone()),
            number(
                "Predicted (Hz)",
                or_missing(predicted.map(|hz| with_decimals_of(hz, &value))),
            ),
            number(
                "Error (%)",
                signed_percent(fitted.and_then(|row| row.error_percent)),
            ),
            words("Recording", or_missing(mode.recording.as_ref())),
        ]
    });
    rows.collect()
}

/// Details of the reading of each resonance of the merged list; `None` where nothing is known but the reading
/// itself.
pub fn mode_details(document: &Document) -> Option<Table> {
    let modes: Vec<&ModeSection> = document.modes.as_deref()?.iter().filter(is_shown).collect();
    if modes.is_empty() {
        return None;
    }
    let mut notes = Vec::new();
    if modes.iter().any(|mode| mode.method == Some(ReadBy::Fit)) {
        notes.push(INTERVAL_NOTE);
    }
    if modes.iter().any(|mode| tap_deviation(mode).is_some()) {
        notes.push(TAPS_NOTE);
    }
    if modes.iter().any(|mode| mode.random_error.is_some()) {
        notes.push(
            "Coherence and random error: of the sensor that knows the mode best, on its line.",
        );
    }
    details(table(
        "How each was read",
        modes.into_iter(),
        &notes.join(" "),
    ))
}

/// Details of the reading of each resonance in each recording; `None` where there is at most one recording.
pub fn reading_details(document: &Document) -> Option<Table> {
    let caption = "How each was read in each recording";
    details(table(caption, own_readings(document)?, ""))
}

/// Columns that say how a resonance was read: beside the others they would need a page wider than a
/// screen.
const DETAILS: [&str; 7] = [
    "Interval from",
    "Tap deviation (Hz)",
    "p",
    "Prominence (dB)",
    "Above noise (dB)",
    "Coherence",
    "Random error (%)",
];

fn details(table: Table) -> Option<Table> {
    let table = table.without_columns(&["Method", "Line (Hz)", "Damping (%)", "\u{3bb} (1)"]);
    let mut names = table.columns.iter().map(|column| column.name.as_str());
    names.any(|name| DETAILS.contains(&name)).then_some(table)
}

/// Returns the data that frequencies were fitted to.
pub fn fitted_to(document: &Document) -> &'static str {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let functions = recordings.iter().filter(|one| one.sample_rate.is_none());
    let has_groups = recordings.iter().any(|one| one.taps_together.is_some());
    match functions.count() {
        0 if has_groups => "the free decays of groups of taps and all sensors",
        0 => "the free decays of all taps and sensors",
        count if count == recordings.len() => "the frequency response functions of all sensors",
        _ => {
            "the free decays of all taps and sensors, or the frequency response functions of files"
        }
    }
}

/// Explains the columns and the methods that occur.
fn note(document: &Document, modes: &[&ModeSection], described: bool) -> String {
    let (mut fitted, mut interpolated) = (false, false);
    for mode in modes {
        fitted |= mode.method == Some(ReadBy::Fit);
        interpolated |= mode.method == Some(ReadBy::Interpolated);
    }
    let fit = format!(
        "Fit: maximum likelihood of {}; its bound is half the 95 % interval.",
        fitted_to(document)
    );
    let mut parts = vec!["Frequency: the best reading with its bound (about 95 %)."];
    if fitted {
        parts.push(&fit);
    }
    if interpolated {
        parts.push("Interpolated: from the shape of the peak between the lines.");
    }
    parts.push(LINE_NOTE);
    if modes.iter().any(|mode| mode.damping_std.is_some()) {
        parts.push("Damping: \u{b1} half the 95 % interval.");
    }
    if described {
        parts.push("\u{3bb}: non-dimensional frequency of the Euler beam.");
    }
    parts.join(" ")
}

const INTERVAL_NOTE: &str = "Interval from: the noise that the fit leaves (residual), or the scatter of the taps \
                             where that is more than the noise explains (taps). Two poles: two poles \
                             of one shape explain the data better than one, and the interval holds \
                             both. They are two modes, or one mode whose frequency changes. \
                             Decays: the frequency changes along them, and the interval is that \
                             at the amplitude that `at_amplitude` states.";
const LINE_NOTE: &str = "Line: the highest spectral line \u{b1} half of the larger of line spacing \
                         and 1/T, as an analyser shows it; none where that line is of another peak.";
const TAPS_NOTE: &str = "Tap deviation: of the tap farthest from their mean, each fitted alone; p: \
                         how often noise alone makes taps scatter so.";

/// Each recording's own readings; `None` where there is at most one recording.
pub fn readings(document: &Document) -> Option<Table> {
    let note = "The list of modes takes each from the recording that resolves it best.";
    let table = table("Readings of each recording", own_readings(document)?, note);
    Some(table.without_columns(&DETAILS))
}

/// The resonances of each of several recordings, which name it; `None` without any.
fn own_readings(document: &Document) -> Option<impl Iterator<Item = &ModeSection>> {
    let recordings = document.recordings.as_deref().filter(|r| r.len() > 1)?;
    let mut modes = recordings
        .iter()
        .flat_map(|recording| &recording.modes)
        .filter(is_shown)
        .peekable();
    modes.peek().is_some().then_some(modes)
}

/// The table; the recordings' column only where there are several.
fn table<'a>(caption: &str, modes: impl Iterator<Item = &'a ModeSection>, note: &str) -> Table {
    let mut table = Table::of(caption, modes.map(row), note);
    let rows = &mut table.rows;
    let first = rows.first().and_then(|row| row.last().cloned());
    if rows.iter().all(|row| row.last() == first.as_ref()) {
        for cell in rows.iter_mut().filter_map(|row| row.last_mut()) {
            cell.clear();
        }
    }
    table.without_empty_columns()
}

fn row(mode: &ModeSection) -> [Cell; 14] {
    // The highest line near a pole may be of another peak, and its bound says nothing of the pole then. A fit is taken
    // as off by three times its interval.
    let bounds = mode.half_line.zip(bound_of(mode));
    let reach = bounds.map_or(f64::INFINITY, |(half, bound)| half + 3.0 * bound);
    let line = mode.line_frequency;
    let line = line.filter(|line| {
        mode.method != Some(ReadBy::Fit) || (line - mode.frequency).abs() <= reach || reach.is_nan()
    });
    let line = line.map(|line| match mode.half_line {
        Some(half) => line_reading(line, half).joined(),
        None => significant(line, 6),
    });
    let fit = mode.fit.as_ref();
    let interval = fit.map_or(MISSING, |fit| match fit.uncertainty_from {
        UncertaintySource::Residual => "residual",
        UncertaintySource::TapScatter => "taps",
        UncertaintySource::TwoPoles => "two poles",
        UncertaintySource::Decays => "decays",
    });
    // Lambda with the digits that the frequency supports: it grows with the frequency's square root.
    let lambda = mode.lambda.map(|lambda| match bound_of(mode) {
        Some(bound) if mode.frequency > 0.0 && lambda > 0.0 => {
            let uncertainty = Some(0.5 * lambda * bound / mode.frequency);
            rounded_to(lambda, uncertainty, last_place(lambda, LAMBDA_DIGITS)).value
        }
        _ => significant(lambda, 5),
    });
    let mut lambda = number("\u{3bb} (1)", or_missing(lambda));
    lambda.column.place = Place::Spacious;
    let scatter = fit.and_then(|fit| fit.scatter_probability);
    let random_error = mode.random_error.map(|error| 100.0 * error);
    // A peak that is no resonance has a line, and no natural frequency.
    let frequency = match mode.is_unclear {
        true => MISSING.to_owned(),
        false => reading(mode).joined(),
    };
    [
        words("Mode", mode_name(mode.mode, mode.label.as_deref())),
        number("Frequency (Hz)", frequency),
        page_words("Method", method_name(mode.method)),
        page_words("Interval from", interval),
        number("Line (Hz)", or_missing(line)),
        number("Damping (%)", or_missing(damping(mode))),
        page_number("Tap deviation (Hz)", optional(tap_deviation(mode), 2)),
        page_number("p", optional(scatter, 2)),
        lambda,
        page_number("Prominence (dB)", optional(mode.prominence_db, 2)),
        page_number("Above noise (dB)", optional(mode.above_noise_db, 2)),
        page_number("Coherence", coherence(mode.coherence)),
        page_number("Random error (%)", optional(random_error, 2)),
        words("Recording", or_missing(mode.recording.as_ref())),
    ]
}

/// "1.200 \u{b1} 0.002": the damping ratio (%) with half its 95 % interval.
pub(super) fn damping(mode: &ModeSection) -> Option<String> {
    let ratio = mode.damping?;
    let own = mode.fit.as_ref();
    let half = own.map(|fit| 50.0 * (fit.damping_high - fit.damping_low));
    let half = half.or(mode.damping_std.map(|std| 100.0 * NORMAL_95 * std));
    Some(rounded_digits(100.0 * ratio, half, DAMPING_DIGITS).joined())
}

/// Distance (Hz) of the tap farthest from the mean of all taps; `None` with fewer than two.
fn tap_deviation(mode: &ModeSection) -> Option<f64> {
    let taps = &mode.fit.as_ref()?.taps;
    if taps.len() < 2 {
        return None;
    }
    let mean = taps.iter().map(|tap| tap.frequency).sum::<f64>() / taps.len() as f64;
    let deviations = taps.iter().map(|tap| (tap.frequency - mean).abs());
    deviations.max_by(f64::total_cmp)
}

/// The best frequency with its bound.
pub fn reading(mode: &ModeSection) -> Rounded {
    match (mode.method, mode.half_line, bound_of(mode)) {
        (Some(ReadBy::Line) | None, Some(half_line), bound) => line_reading(
            mode.frequency,
            bound.map_or(half_line, |bound| bound.max(half_line)),
        ),
        (_, half_line, Some(bound)) => frequency_reading(mode.frequency, bound, half_line),
        (_, _, None) => Rounded {
            value: significant(mode.frequency, 6),
            uncertainty: None,
        },
    }
}

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
    let several = document.recordings.as_ref().is_some_and(|r| r.len() > 1);
    let mut rows = Vec::new();
    for frf in frfs {
        for found in &frf.resonances {
            let phase = found.phase;
            let phase = phase.map(|value| format!("{value:.1}").replace('-', "\u{2212}"));
            let error = found.quality.random_error.map(|error| 100.0 * error);
            let unit = match one_unit {
                true => String::new(),
                false => unit_words(&frf.unit),
            };
            rows.push([
                words(
                    "Recording",
                    if several { frf.recording.as_str() } else { "" },
                ),
                words("Response", &frf.response),
                words("Mode", mode_name(found.mode, found.label.as_deref())),
                number("Frequency (Hz)", trimmed(found.frequency, 6)),
                number(&magnitude, optional(found.magnitude, 4)),
                words("Unit", unit),
                number("Phase (\u{b0})", or_missing(phase)),
                number("Coherence", coherence(found.quality.coherence)),
                number("Error (%)", optional(error, 2)),
            ]);
        }
    }
    let taps = frfs.iter().map(|frf| frf.averages);
    let (least, most) = (taps.clone().min().unwrap_or(0), taps.max().unwrap_or(0));
    let estimator = &first.estimator;
    // An analyser tells neither estimator nor taps.
    let made_by = match (least, most) {
        (0, 0) => "as the file holds them".to_owned(),
        (1, 1) => format!("{estimator}, 1 tap"),
        _ if least == most => format!("{estimator}, {least} taps averaged"),
        _ => format!("{estimator}, {least} to {most} taps averaged"),
    };
    let mut note = "On the line nearest to each resonance.".to_owned();
    note.push_str(match least >= 2 {
        true => " Error: random error of the magnitude (standard deviation).",
        false => " One average: no coherence; it would be 1 whatever the noise, and mean nothing.",
    });
    if frfs.iter().any(|frf| frf.unit.contains("unit of the file")) {
        note.push_str(
            " The file states no unit for a channel: magnitudes are per unit of the file; give the \
             scales (SI units per unit of the file) to have them in SI units.",
        );
    }
    if let Some(decay) = frfs.iter().find_map(|frf| frf.window_decay) {
        note.push_str(&format!(
            " The exponential window adds a decay of {} 1/s to every pole, so peaks are lower than without.",
            trimmed(decay, 3)
        ));
    }
    let caption = format!("Frequency response functions at the resonances, {made_by}");
    Some(Table::of(caption, rows, note).without_empty_columns())
}

/// Measured beside predicted frequencies; `None` where nothing was predicted.
pub fn prediction(document: &Document) -> Option<Table> {
    let predicted = document.prediction.as_deref().filter(|p| !p.is_empty())?;
    let compared = predicted.iter().any(|row| row.measured.is_some());
    let rows = predicted.iter().map(|row| {
        let mode = mode_of(document, row.mode);
        let bound = mode.and_then(bound_of);
        // The digits of the list of modes, so that the same frequency reads the same.
        let listed = mode
            .filter(|_| bound.is_some())
            .map(|mode| reading(mode).value);
        let frequencies = [row.measured, row.predicted];
        let [measured, predicted] = frequencies.map(|value| match (value, &listed) {
            (Some(value), Some(listed)) => with_decimals_of(value, listed),
            _ => optional(value, 6),
        });
        let percent = bound
            .zip(row.measured)
            .map(|(bound, hz)| 100.0 * bound / hz);
        let used = match (compared, row.used) {
            (false, _) => "",
            (true, true) => "yes",
            (true, false) => "no",
        };
        [
            number("Mode", row.mode.to_string()),
            number("Measured (Hz)", measured),
            number("Predicted (Hz)", predicted),
            number("Error (%)", signed_percent(row.error_percent)),
            number("Reading (%)", or_missing(percent.map(bound_percent))),
            number("\u{3bb} (1)", optional(row.lambda, 6)),
            words("Used", used),
        ]
    });
    let (caption, note) = match compared {
        true => (
            "Measured and predicted frequencies",
            "Error = 100 (predicted \u{2212} measured)/measured. Reading: bound of the measured \
             frequency. Used: the mode entered the estimate; the others are true predictions. The estimate may move the \
             beam's properties within their uncertainty: with the beam exactly as described errors are larger.",
        ),
        false => (
            "Predicted frequencies",
            "\u{3bb}: non-dimensional frequency, \u{3bb}\u{2074} = (2\u{3c0}f)\u{b2} \u{3c1}A \
             L\u{2074}/(EI).",
        ),
    };
    Some(Table::of(caption, rows, note).without_empty_columns())
}
