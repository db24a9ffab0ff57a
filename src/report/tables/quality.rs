//! Tables of verdicts on how well a test was made.

use std::cmp::Reverse;

use super::super::document::Document;
use super::super::format::{MISSING, significant, trimmed, with_minus_signs};
use super::{Column, Table, number, words};
use tapjoint_signal::quality::{Check, Outcome, Verdict};

fn verdicts(document: &Document) -> &[Verdict] {
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
    let mut rows = Vec::new();
    for check in checks {
        let of_check = verdicts.iter().filter(|verdict| verdict.check == check);
        let worst = of_check.clone().min_by(|a, b| {
            let by_size = b.severity().total_cmp(&a.severity());
            b.outcome.cmp(&a.outcome).then(by_size)
        });
        let Some(worst) = worst else { continue };
        let (mut good, mut apply) = (0, 0);
        for verdict in of_check {
            good += usize::from(verdict.outcome == Outcome::Good);
            apply += usize::from(verdict.outcome != Outcome::NotApplicable);
        }
        rows.push(vec![
            check.code().to_owned(),
            worst.outcome.name().to_owned(),
            match apply {
                0 => MISSING.to_owned(),
                _ => format!("{good} of {apply}"),
            },
            value(worst),
            limit(worst),
            unit(worst),
            worst.subject.to_string(),
            with_minus_signs(&worst.happened),
        ]);
    }
    (!rows.is_empty()).then(|| Table {
        caption: "Good practice".to_owned(),
        columns: vec![
            words("Check"),
            words("Outcome"),
            number("Good"),
            number("Worst"),
            number("Limit"),
            words("Unit"),
            words("Where").on_page(),
            words("What happened").on_page(),
        ],
        rows,
        note: "Each check's worst verdict; Good: verdicts without doubt, of those that apply."
            .to_owned(),
    })
}

/// One row for each doubt, the worst first: what happened, why it might be, what helps; `None` without
/// any.
pub fn quality_doubts(document: &Document) -> Option<Table> {
    let mut doubts: Vec<&Verdict> = verdicts(document)
        .iter()
        .filter(|verdict| verdict.is_doubt())
        .collect();
    doubts.sort_by_key(|verdict| Reverse(verdict.outcome));
    let mut rows = Vec::new();
    for verdict in &doubts {
        let mut row = row(verdict);
        row.push(verdict.cause.unwrap_or_default().to_owned());
        row.push(verdict.remedy.unwrap_or_default().to_owned());
        rows.push(row);
    }
    (!rows.is_empty()).then(|| Table {
        caption: "Doubts about the measurement".to_owned(),
        columns: columns()
            .into_iter()
            .chain(["Why it might be", "What helps"].map(|title| words(title).on_page()))
            .collect(),
        rows,
        note: String::new(),
    })
}

/// One row for each verdict, doubts first; `None` without any.
pub fn quality_all(document: &Document) -> Option<Table> {
    let mut all: Vec<&Verdict> = verdicts(document).iter().collect();
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
    (!all.is_empty()).then(|| Table {
        caption: "All checks".to_owned(),
        columns: columns(),
        rows: all.iter().map(|verdict| row(verdict)).collect(),
        note,
    })
}

fn columns() -> Vec<Column> {
    vec![
        words("Check"),
        words("Outcome"),
        words("Where"),
        number("Value"),
        number("Limit"),
        words("Unit"),
        words("What happened").on_page(),
    ]
}

fn row(verdict: &Verdict) -> Vec<String> {
    vec![
        verdict.check.code().to_owned(),
        verdict.outcome.name().to_owned(),
        verdict.subject.to_string(),
        value(verdict),
        limit(verdict),
        unit(verdict),
        with_minus_signs(&verdict.happened),
    ]
}

/// Returns the factor from a value to its written number, and the unit of that.
///
/// A share is written in percent and a multiple with a times sign, as in the sentences. Coherence and reciprocity,
/// which are best at 1, are known as they are.
fn scale(verdict: &Verdict) -> (f64, &str) {
    match (verdict.unit, verdict.check) {
        ("1", Check::TapLevels | Check::WeakTap) => (1.0, "\u{d7}"),
        ("1", Check::Coherence | Check::Reciprocity) => (1.0, "1"),
        ("1", _) => (100.0, "%"),
        (unit, _) => (1.0, unit),
    }
}

fn value(verdict: &Verdict) -> String {
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
fn limit(verdict: &Verdict) -> String {
    trimmed(scale(verdict).0 * verdict.limit, 3)
}

fn unit(verdict: &Verdict) -> String {
    scale(verdict).1.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tapjoint_signal::quality::Subject;

    fn verdict(check: Check, outcome: Outcome, value: f64) -> Verdict {
        let is_doubt = matches!(outcome, Outcome::Doubtful | Outcome::Bad);
        Verdict {
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

    fn document(verdicts: &[Verdict]) -> Document {
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
