//! Tables of verdicts on how well a test was made.

use super::super::format::{MISSING, significant};
use super::{Table, number, words};
use crate::quality::{Check, Outcome, Verdict};

/// One row for each check: its worst verdict, and how many of all are no doubt; `None` without any.
pub fn quality(verdicts: &[Verdict]) -> Option<Table> {
    let mut checks: Vec<Check> = verdicts.iter().map(|verdict| verdict.check).collect();
    checks.sort_unstable();
    checks.dedup();
    let rows: Vec<Vec<String>> = checks
        .into_iter()
        .filter_map(|check| summary_row(verdicts, check))
        .collect();
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

fn summary_row(verdicts: &[Verdict], check: Check) -> Option<Vec<String>> {
    let of_check = || {
        verdicts
            .iter()
            .filter(move |verdict| verdict.check == check)
    };
    let worst = of_check().rev().max_by_key(|verdict| verdict.outcome)?;
    let good = of_check().filter(|v| v.outcome == Outcome::Good).count();
    let apply = of_check().filter(|v| v.outcome != Outcome::NotApplicable);
    let count = match apply.count() {
        0 => MISSING.to_owned(),
        all => format!("{good} of {all}"),
    };
    Some(vec![
        check.code().to_owned(),
        worst.outcome.name().to_owned(),
        count,
        value(worst),
        significant(worst.limit, 3),
        unit(worst),
        worst.subject.to_string(),
        worst.happened.clone(),
    ])
}

/// One row for each doubt, the worst first: what happened, why it might be, what helps; `None` without
/// any.
pub fn quality_doubts(verdicts: &[Verdict]) -> Option<Table> {
    let mut doubts: Vec<&Verdict> = verdicts.iter().filter(|v| v.is_doubt()).collect();
    doubts.sort_by_key(|verdict| std::cmp::Reverse(verdict.outcome));
    let row = |verdict: &&Verdict| {
        vec![
            verdict.check.code().to_owned(),
            verdict.outcome.name().to_owned(),
            verdict.subject.to_string(),
            verdict.happened.clone(),
            verdict.check.cause().to_owned(),
            verdict.check.remedy().to_owned(),
        ]
    };
    (!doubts.is_empty()).then(|| Table {
        caption: "Doubts about the measurement".to_owned(),
        columns: vec![
            words("Check"),
            words("Outcome"),
            words("Where"),
            words("What happened"),
            words("Why it might be").on_page(),
            words("What helps").on_page(),
        ],
        rows: doubts.iter().map(row).collect(),
        note: String::new(),
    })
}

fn value(verdict: &Verdict) -> String {
    verdict
        .value
        .map_or(MISSING.to_owned(), |value| significant(value, 3))
}

/// The unit; nothing for a ratio.
fn unit(verdict: &Verdict) -> String {
    match verdict.unit {
        "1" => String::new(),
        unit => unit.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quality::Subject;

    fn verdict(check: Check, outcome: Outcome, value: f64) -> Verdict {
        Verdict {
            check,
            subject: Subject::Test,
            value: Some(value),
            limit: 0.1,
            unit: check.unit(),
            outcome,
            happened: format!("found {value}"),
        }
    }

    #[test]
    fn regress_the_worst_of_each_check_stands_in_its_row() {
        let verdicts = [
            verdict(Check::DoubleHit, Outcome::Good, 0.01),
            verdict(Check::DoubleHit, Outcome::Bad, 0.3),
            verdict(Check::DoubleHit, Outcome::Doubtful, 0.06),
            verdict(Check::ForceFall, Outcome::NotApplicable, 7.0),
        ];
        let table = quality(&verdicts).expect("two checks");
        assert_eq!(table.rows.len(), 2);
        assert_eq!(table.rows[0][..4], ["double-hit", "bad", "1 of 3", "0.300"]);
        assert_eq!(
            table.rows[1][..3],
            ["force-fall", "not applicable", MISSING]
        );
        assert!(
            table
                .rows
                .iter()
                .all(|row| row.len() == table.columns.len())
        );
        let doubts = quality_doubts(&verdicts).expect("two doubts");
        let found: Vec<&str> = doubts.rows.iter().map(|row| row[3].as_str()).collect();
        assert_eq!(found, ["found 0.3", "found 0.06"]);
        assert!(
            doubts
                .rows
                .iter()
                .all(|row| row.len() == doubts.columns.len())
        );
        assert_eq!(doubts.rows[0][5], Check::DoubleHit.remedy());
        assert_eq!(quality_doubts(&verdicts[..1]), None);
        assert_eq!(quality(&[]), None);
    }
}
