//! Tables of the recordings: their channels and taps, the datasets of universal files, and how good the test was.

use std::cmp::Reverse;

use super::{Cell, Place, Table, number, page_number, page_words, words};
use crate::document::{Document, RecordingSection, TapSection};
use crate::format::{
    MISSING, optional, or_missing, significant, trimmed, unit_words, with_minus_signs,
};
use tapjoint_signal::quality::{Check, Outcome, QualityVerdict};
use tapjoint_signal::taps::Pulse;

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
    let rows = recordings.iter().map(|one| {
        let used = one.taps.iter().filter(|tap| tap.accepted).count();
        let taps = match (one.sample_rate, one.taps.len()) {
            // Functions from a file: of their taps nothing is known.
            (None, 0) => MISSING.to_owned(),
            (_, all) => format!("{used} of {all}"),
        };
        let band = one
            .band
            .map(|[low, high]| format!("{} to {}", trimmed(low, 6), trimmed(high, 6)));
        let left = one.remaining_at_end.map(|level| 100.0 * level);
        [
            words("Recording", &one.file),
            words("Format", &one.format).on_page_if(transformed),
            number(
                "Rate (Hz)",
                or_missing(one.sample_rate.map(|rate| trimmed(rate, 8))),
            ),
            number("Length (s)", exact(one.seconds)),
            number("Channels", one.channels.to_string()).on_page_if(transformed),
            number("Taps used", taps),
            page_number("Block (samples)", or_missing(one.block)),
            page_number("Lines", or_missing(one.lines)),
            page_number("Band (Hz)", or_missing(band)),
            number("Spacing (Hz)", exact(one.line_spacing)),
            number("1/T (Hz)", exact(one.resolution)),
            page_number("Half line (Hz)", exact(one.half_line)),
            words("Window", or_missing(one.window.as_ref())),
            page_number("Window's decay (1/s)", optional(one.window_decay, 3)),
            page_number("Left at end (%)", optional(left, 2)),
        ]
    });
    Some(Table::of(caption, rows, note).without_empty_columns())
}

/// Places of taps and sensors in each recording, and its conditions: beside the spectra's columns these would
/// need a page wider than a screen. `None` where nothing of it is stated.
pub fn conditions(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().filter(|r| !r.is_empty())?;
    let rows = recordings.iter().map(|one| {
        let known = &one.conditions;
        let sensors = known.sensor_positions.iter();
        let sensors = sensors.map(|(name, position)| format!("{name} {}", trimmed(*position, 4)));
        let masses = known.masses.iter();
        let masses = masses.map(|one| {
            let grams = significant(1e3 * one.mass, 4);
            format!("{grams} g at {} m", trimmed(one.position, 4))
        });
        [
            words("Recording", &one.file),
            page_number("Free length (m)", exact(known.free_length)),
            page_number("Tap at (m)", exact(known.tap)),
            page_words("Sensors at (m)", listed(sensors.collect())),
            page_words("Fastened", listed(masses.collect())),
            page_number("Torque (N m)", exact(known.torque)),
            page_number("Temperature (°C)", exact(known.temperature)),
            page_words("Date", or_missing(known.date.as_ref())),
        ]
    });
    let table = Table::of("Where and how each was recorded", rows, "").without_empty_columns();
    Some(table).filter(|table| table.columns.len() > 1)
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
            let (info, health) = (&channel.info, &channel.info.health);
            let unit = info.unit.as_deref().unwrap_or("not given");
            rows.push([
                of_several(recording, recordings),
                number("Channel", channel.channel.to_string()),
                words("Name", info.name.clone().unwrap_or_default()),
                words("Unit", unit_words(unit)),
                number("DC", significant(health.mean, 3)),
                number("RMS", significant(health.rms, 3)),
                number("Peak", significant(health.peak, 3)),
                number("Full scale", health.full_scale_samples.to_string()),
                number("Flat tops", health.flat_top_count.to_string()),
                number("Dropped samples", health.dropped_samples.to_string()),
            ]);
        }
    }
    let note = "DC: mean. RMS: about the mean. Peak: largest magnitude. Full scale: samples at the \
                end of the number range. Flat tops: crests that are cut off. Dropped samples: in \
                runs that repeat one value.";
    some(Table::of("Channels", rows, note))
}

/// The recording's name where there are several: the table of recordings has that of a single one.
fn of_several(recording: &RecordingSection, all: &[RecordingSection]) -> Cell {
    let name = Some(recording.file.as_str()).filter(|_| all.len() != 1);
    words("Recording", name.unwrap_or_default())
}

/// Returns the table without empty columns; `None` without rows.
fn some(table: Table) -> Option<Table> {
    (!table.rows.is_empty()).then(|| table.without_empty_columns())
}

/// Returns the unit of the taps' peaks, also where none was stated.
fn peak_unit(recording: &RecordingSection) -> String {
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
        let numbered = recording.taps.iter().enumerate();
        for (index, tap) in numbered.filter(|(_, tap)| wanted(tap)) {
            rows.push([
                of_several(recording, recordings),
                words("File", tap.file.clone().unwrap_or_default()),
                number("Tap", (index + 1).to_string()),
                number("Time (s)", format!("{:.3}", tap.time)),
                number("Peak", optional(peak(tap), 3)),
                words("Unit", peak_unit(recording)),
                page_number(
                    "Pulse (ms)",
                    optional(tap.pulse.map(|pulse| 1e3 * pulse.width), 3),
                ),
                page_number("−10 dB (Hz)", fall(tap.pulse, |pulse| pulse.fall_10_db)),
                page_number("−20 dB (Hz)", fall(tap.pulse, |pulse| pulse.fall_20_db)),
                page_number(
                    "Usable to (Hz)",
                    optional(tap.pulse.map(|pulse| pulse.usable_to), 3),
                ),
                words("Used", if tap.accepted { "yes" } else { "no" }),
                words("Reason", tap.reason.clone().unwrap_or_default()),
            ]);
        }
    }
    some(Table::of(caption, rows, peaks_note(recordings)))
}

/// Frequency at which the spectrum of a pulse has fallen; a dash where it has not fallen so far at half the sample rate.
fn fall(pulse: Option<Pulse>, read: fn(&Pulse) -> Option<f64>) -> String {
    optional(pulse.as_ref().and_then(read), 3)
}

fn peak(tap: &TapSection) -> Option<f64> {
    tap.peak_force.or(tap.peak_response)
}

fn peaks_note(recordings: &[RecordingSection]) -> &'static str {
    let with = recordings.iter().any(|recording| recording.has_hammer);
    let without = recordings.iter().any(|recording| !recording.has_hammer);
    match (with, without) {
        (true, false) => "Peak: of the force.",
        (false, true) => "Peak: of the response on which the tap stands out most.",
        _ => {
            "Peak: of the force, or without a hammer of the response on which the tap stands out most."
        }
    }
}

/// One row for each recording: how many taps were used, when, and how hard they were; `None`
/// without any tap.
pub fn taps_used(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let tapped = recordings.iter().filter(|one| !one.taps.is_empty());
    let rows = tapped.map(|one| {
        let used: Vec<&TapSection> = one.taps.iter().filter(|tap| tap.accepted).collect();
        let ends = [used.first(), used.last()];
        let [first, last] = ends.map(|tap| or_missing(tap.map(|tap| format!("{:.3}", tap.time))));
        let peaks = used.iter().filter_map(|tap| peak(tap));
        let ends = [
            peaks.clone().min_by(f64::total_cmp),
            peaks.max_by(f64::total_cmp),
        ];
        let [softest, hardest] = ends.map(|peak| optional(peak, 3));
        [
            of_several(one, recordings),
            number("Used", format!("{} of {}", used.len(), one.taps.len())),
            number("First (s)", first),
            number("Last (s)", last),
            number("Smallest peak", softest),
            number("Largest peak", hardest),
            words("Unit", peak_unit(one)),
        ]
    });
    some(Table::of("Taps used", rows, peaks_note(recordings)))
}

/// One row for each recording with a hammer: its force pulses in the mean; `None` without any.
pub fn hammer(document: &Document) -> Option<Table> {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let rows = recordings.iter().filter_map(|one| {
        let hammer = one.hammer.as_ref()?;
        let pulse = hammer.pulse;
        Some([
            of_several(one, recordings),
            number("Pulse (ms)", significant(1e3 * pulse.width, 3)),
            number("−10 dB (Hz)", fall(Some(pulse), |pulse| pulse.fall_10_db)),
            number("−20 dB (Hz)", fall(Some(pulse), |pulse| pulse.fall_20_db)),
            number("Usable to (Hz)", significant(pulse.usable_to, 3)),
            number(
                "Force window (ms)",
                optional(hammer.force_window.map(|length| 1e3 * length), 3),
            ),
            number("H1 changes by (%)", optional(hammer.h1_change_percent, 2)),
        ])
    });
    let note = "Mean of the taps used. Pulse: width at half height. −10 and −20 dB: where the force spectrum has \
                fallen so far. Usable to: the lowest of the fall by 20 dB, the frequency where the spectrum comes \
                within 10 dB of the channel's noise, and sample rate/2.56. Outside the force window the force is set to \
                zero. H1 changes by: the largest relative change of H1 at a resonance that this causes.";
    some(Table::of("Hammer", rows, note))
}

/// One row for each dataset; `None` without any.
pub fn datasets(document: &Document) -> Option<Table> {
    let datasets = document.datasets.as_deref().filter(|d| !d.is_empty())?;
    let several = datasets.iter().any(|one| one.file != datasets[0].file);
    let rows = datasets.iter().map(|one| {
        let step = match (one.spacing, &one.spacing_unit) {
            (Some(step), Some(unit)) => format!("{} {unit}", trimmed(step, 6)),
            (Some(step), None) => trimmed(step, 6),
            (None, _) if one.points.is_some() => "uneven".to_owned(),
            (None, _) => MISSING.to_owned(),
        };
        let unit = match (&one.unit, &one.denominator_unit) {
            (Some(above), Some(below)) => format!("({above})/({below})"),
            (above, _) => or_missing(above.as_ref()),
        };
        // Where there is no room, names of files go before names of points.
        let mut reference = words("Reference", or_missing(one.reference.as_ref()));
        reference.column.place = Place::Spacious;
        [
            words("File", if several { one.file.as_str() } else { "" }),
            number("Number", one.dataset.to_string()),
            words(
                "Kind",
                one.kind.replace("frequency response function", "FRF"),
            ),
            number("Points", or_missing(one.points)),
            number("Step", step),
            words("Response", or_missing(one.response.as_ref())),
            reference,
            words("Unit", unit),
            page_words("Values", or_missing(one.values.as_ref())),
            page_words("Stored as", or_missing(one.coding.as_ref())),
            page_words("Description", or_missing(one.description.as_ref())),
        ]
    });
    some(Table::of(
        "Datasets",
        rows,
        "As the headers say; values were not read.",
    ))
}

fn verdicts(document: &Document) -> &[QualityVerdict] {
    document.quality.as_deref().unwrap_or_default()
}

/// "checks: 41 good, 2 doubtful, 1 bad"; `None` where no check applies.
pub fn quality_count(document: &Document) -> Option<String> {
    let counts: Vec<String> = [Outcome::Good, Outcome::Doubtful, Outcome::Bad]
        .into_iter()
        .filter_map(|outcome| {
            let all = verdicts(document).iter();
            let count = all.filter(|verdict| verdict.outcome == outcome).count();
            (count > 0).then(|| format!("{count} {}", outcome.name()))
        })
        .collect();
    (!counts.is_empty()).then(|| format!("checks: {}", counts.join(", ")))
}

/// One row for each check: its worst verdict, and how many of all are no doubt; `None` without any.
pub fn quality(document: &Document) -> Option<Table> {
    let verdicts = verdicts(document);
    let mut checks: Vec<Check> = Vec::new();
    for verdict in verdicts {
        if !checks.contains(&verdict.check) {
            checks.push(verdict.check);
        }
    }
    let rows = checks.iter().filter_map(|check| {
        let of_check = verdicts.iter().filter(|verdict| verdict.check == *check);
        let worst = of_check.clone().min_by(|a, b| {
            let by_size = b.severity().total_cmp(&a.severity());
            b.outcome.cmp(&a.outcome).then(by_size)
        })?;
        let (mut good, mut apply) = (0, 0);
        for verdict in of_check {
            good += usize::from(verdict.outcome == Outcome::Good);
            apply += usize::from(verdict.outcome != Outcome::NotApplicable);
        }
        let share = match apply {
            0 => MISSING.to_owned(),
            _ => format!("{good} of {apply}"),
        };
        Some([
            words("Check", check.code()),
            words("Outcome", worst.outcome.name()),
            number("Good", share),
            number("Worst", value(worst)),
            number("Limit", limit(worst)),
            words("Unit", scale(worst).1),
            page_words("Where", worst.subject.to_string()),
            page_words("What happened", with_minus_signs(&worst.happened)),
        ])
    });
    let note = "Each check's worst verdict; Good: verdicts without doubt, of those that apply.";
    Some(Table::of("Good practice", rows, note)).filter(|table| !table.rows.is_empty())
}

/// One row for each doubt, the worst first: what happened, why it might be, what helps; `None` without
/// any.
pub fn quality_doubts(document: &Document) -> Option<Table> {
    let all = verdicts(document).iter();
    let mut doubts: Vec<&QualityVerdict> = all.filter(|verdict| verdict.is_doubt()).collect();
    doubts.sort_by_key(|verdict| Reverse(verdict.outcome));
    let rows = doubts.iter().map(|verdict| {
        let mut row = row(verdict);
        row.push(page_words(
            "Why it might be",
            verdict.cause.unwrap_or_default(),
        ));
        row.push(page_words("What helps", verdict.remedy.unwrap_or_default()));
        row
    });
    (!doubts.is_empty()).then(|| Table::of("Doubts about the measurement", rows, ""))
}

/// One row for each verdict, doubts first; `None` without any.
pub fn quality_all(document: &Document) -> Option<Table> {
    let mut all: Vec<&QualityVerdict> = verdicts(document).iter().collect();
    all.sort_by_key(|verdict| Reverse(verdict.outcome));
    let apart = all
        .iter()
        .filter(|v| v.outcome == Outcome::NotApplicable)
        .count();
    let note = match apart {
        0 => String::new(),
        count => format!(
            "{count} of {} do not apply, and count as no outcome.",
            all.len()
        ),
    };
    let rows = all.iter().map(|verdict| row(verdict));
    (!all.is_empty()).then(|| Table::of("All checks", rows, note))
}

fn row(verdict: &QualityVerdict) -> Vec<Cell> {
    vec![
        words("Check", verdict.check.code()),
        words("Outcome", verdict.outcome.name()),
        words("Where", verdict.subject.to_string()),
        number("Value", value(verdict)),
        number("Limit", limit(verdict)),
        words("Unit", scale(verdict).1),
        page_words("What happened", with_minus_signs(&verdict.happened)),
    ]
}

/// Returns the factor from a value to its written number, and the unit of that.
///
/// A share is written in percent and a multiple with a times sign, as in the sentences. Coherence and reciprocity,
/// which are best at 1, are known as they are.
fn scale(verdict: &QualityVerdict) -> (f64, &str) {
    match (verdict.unit, verdict.check) {
        ("1", Check::TapLevels | Check::WeakTap) => (1.0, "\u{d7}"),
        ("1", Check::Coherence | Check::Reciprocity) => (1.0, "1"),
        ("1", _) => (100.0, "%"),
        (unit, _) => (1.0, unit),
    }
}

fn value(verdict: &QualityVerdict) -> String {
    let (factor, unit) = scale(verdict);
    match verdict.value.map(|value| factor * value) {
        None => MISSING.to_owned(),
        Some(value) if unit == "%" && value != 0.0 && value.abs() < LEAST_PERCENT => {
            format!("<{LEAST_PERCENT}")
        }
        // A count has no digits behind the point.
        Some(value) if verdict.unit != "1" && value.fract() == 0.0 => trimmed(value, 3),
        Some(value) => significant(value, 3),
    }
}

/// Percentages below this (%) are written as "<0.001": no limit is near them.
const LEAST_PERCENT: f64 = 0.001;

/// Limits are round numbers, whose zeros say nothing; a computed one has three digits.
fn limit(verdict: &QualityVerdict) -> String {
    trimmed(scale(verdict).0 * verdict.limit, 3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tapjoint_signal::quality::Subject;

    fn verdict(check: Check, outcome: Outcome, value: f64) -> QualityVerdict {
        let is_doubt = matches!(outcome, Outcome::Doubtful | Outcome::Bad);
        QualityVerdict {
            check,
            subject: Subject::Test,
            value: Some(value),
            limit: 0.1,
            unit: check.unit(),
            outcome,
            happened: format!("found {value}"),
            cause: is_doubt.then(|| check.cause()),
            remedy: is_doubt.then(|| check.remedy()),
        }
    }

    fn document(verdicts: &[QualityVerdict]) -> Document {
        Document {
            quality: Some(verdicts.to_vec()),
            ..Document::default()
        }
    }

    #[test]
    fn regress_the_worst_of_each_check_stands_in_its_row() {
        let verdicts = [
            verdict(Check::DoubleHit, Outcome::Good, 0.01),
            verdict(Check::DoubleHit, Outcome::Doubtful, 0.06),
            verdict(Check::DoubleHit, Outcome::Bad, 0.3),
            verdict(Check::ForceFall, Outcome::NotApplicable, 7.0),
        ];
        let whole = document(&verdicts);
        let table = quality(&whole).expect("two checks");
        assert_eq!(table.rows.len(), 2);
        assert_eq!(table.rows[0][..4], ["double-hit", "bad", "1 of 3", "30.0"]);
        assert_eq!(
            table.rows[1][..3],
            ["force-fall", "not applicable", MISSING]
        );
        let doubts = quality_doubts(&whole).expect("two doubts");
        let found: Vec<&str> = doubts.rows.iter().map(|row| row[6].as_str()).collect();
        assert_eq!(found, ["found 0.3", "found 0.06"]);
        assert_eq!(doubts.rows[0][8], Check::DoubleHit.remedy());
        let all = quality_all(&whole).expect("four verdicts");
        assert!(all.note.starts_with("1 of 4 do not apply"), "{}", all.note);
        let outcomes: Vec<&str> = all.rows.iter().map(|row| row[1].as_str()).collect();
        assert_eq!(outcomes, ["bad", "doubtful", "good", "not applicable"]);
        for table in [&table, &doubts, &all] {
            assert!(
                table
                    .rows
                    .iter()
                    .all(|row| row.len() == table.columns.len()),
                "{}",
                table.caption
            );
        }
        let count = quality_count(&whole);
        assert_eq!(count.as_deref(), Some("checks: 1 good, 1 doubtful, 1 bad"));
        assert_eq!(quality_doubts(&document(&verdicts[..1])), None);
        assert_eq!(quality(&document(&[])), None);
        assert_eq!(quality_count(&document(&verdicts[3..])), None);
    }

    #[test]
    fn regress_ratios_are_said_as_their_sentences_say_them() {
        let cases = [
            (Check::DoubleHit, 0.3, ["30.0", "10", "%"]),
            (Check::FrequencyScatter, 7.74e-5, ["0.00774", "10", "%"]),
            (Check::FrequencyScatter, 3.5e-7, ["<0.001", "10", "%"]),
            (Check::TapLevels, 1.116, ["1.12", "0.1", "\u{d7}"]),
            (Check::Coherence, 0.98, ["0.980", "0.1", "1"]),
            (
                Check::Linearity,
                -22.8,
                ["\u{2212}22.8", "0.1", "standard deviations"],
            ),
            (Check::ForceFall, 3.63, ["3.63", "0.1", "dB"]),
            (Check::Averages, 5.0, ["5", "0.1", "taps"]),
        ];
        for (check, value, expected) in cases {
            let mut section = verdict(check, Outcome::Bad, value);
            section.happened = "It moves by -0.299 % (of -1 to 3-5) in run-2.wav.".to_owned();
            let whole = document(&[section]);
            let table = quality_all(&whole).expect("one verdict");
            assert_eq!(table.rows[0][3..6], expected);
            let said = "It moves by \u{2212}0.299 % (of \u{2212}1 to 3-5) in run-2.wav.";
            assert_eq!(table.rows[0][6], said);
        }
    }
}
