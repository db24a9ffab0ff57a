//! What a test could tell apart, as a table for a terminal.

use std::collections::BTreeMap;

use super::super::charts::blind_check::classes;
use tapjoint_diagnosis::Verdict;
use tapjoint_study::blind_check::{Case, Class, Row, Scores, Target, render_rows, rows, score};

/// What the columns say.
const EXPLAINED: &str = "first: the diagnosis puts its kind first; named: the verdict gives it as the\n\
                         answer (of none: \"no-gap\"); else first: what came first instead, how often.\n";

/// For each kind of effect: how often it came first, how often it was named, and what came first
/// instead; then the figures of what was drawn. What a blind check of whole tests aims at is no target here.
pub fn tell_apart(cases: &[Case]) -> String {
    let mut text = format!(
        "{:<20}{:>7}{:>8}  {}\n",
        "planted", "first", "named", "else first"
    );
    for class in classes() {
        let own: Vec<&Case> = cases
            .iter()
            .filter(|(truth, _)| truth.class() == Some(class))
            .collect();
        if own.is_empty() {
            continue;
        }
        let first = own
            .iter()
            .filter(|(_, answer)| answer.first().is_some_and(|found| found.0 == class))
            .count();
        let named = own
            .iter()
            .filter(|(_, answer)| match answer.verdict {
                Some(Verdict::Named(_)) => answer
                    .named_groups()
                    .iter()
                    .any(|g| Class::Group(*g) == class),
                Some(Verdict::NoGap) => class == Class::None,
                _ => false,
            })
            .count();
        let line = format!(
            "{:<20}{:>7}{:>8}  {}",
            class.name(),
            format!("{first}/{}", own.len()),
            format!("{named}/{}", own.len()),
            others(&own, class)
        );
        text.push_str(line.trim_end());
        text.push('\n');
    }
    format!(
        "{text}{EXPLAINED}\n{}",
        render_rows(&drawn_rows(&score(cases)))
    )
}

/// The figures that there are cases for, without targets.
fn drawn_rows(scores: &Scores) -> Vec<Row> {
    let drawn = rows(scores, None)
        .into_iter()
        .filter(|row| row.value.is_some());
    drawn
        .map(|row| Row {
            target: Target::None,
            ..row
        })
        .collect()
}

/// "cross-coupling 2, none 1".
fn others(cases: &[&Case], own: Class) -> String {
    let mut counts: BTreeMap<Class, usize> = BTreeMap::new();
    for (_, answer) in cases {
        match answer.first() {
            Some((class, _)) if class != own => *counts.entry(class).or_insert(0) += 1,
            _ => {}
        }
    }
    let words: Vec<String> = counts
        .iter()
        .map(|(class, count)| format!("{} {count}", class.name()))
        .collect();
    words.join(", ")
}
