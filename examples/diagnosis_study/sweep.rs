//! What half and twice of each threshold do to the main figures.
//!
//! Each test is drawn once. A threshold acts on one stage of the diagnosis ([`Stage`]). What comes before that stage is taken
//! from the diagnosis with all thresholds as they are.

use super::Task;
use super::record::Record;
use super::score::Scores;
use super::trial::{Answer, DrawnTest, answered, caught, compared, fitted};
use rayon::prelude::*;
use tapjoint::gap::{Comparison, GapSettings, SingleFits, Stage, Thresholds, check};

/// Figures that are compared, by their keys in the scores and by their names in the rows.
const FIGURES: [(&str, &str); 7] = [
    ("first_group_right", "group"),
    ("singles_named_right", "right"),
    ("singles_named_wrong", "wrong"),
    ("nulls_named", "nulls"),
    ("outside_named", "outside"),
    ("pairs_found_or_refused", "pairs"),
    ("list_holds", "list"),
];
/// Factors of the values.
const FACTORS: [f64; 2] = [0.5, 2.0];

/// Thresholds of which one is changed.
struct Variant {
    name: &'static str,
    stage: Stage,
    settings: GapSettings,
}

impl Variant {
    /// Returns the changed value.
    fn value(&self) -> f64 {
        let value = self.settings.thresholds.value(self.name);
        value.unwrap_or(f64::NAN)
    }
}

/// One test with all thresholds as they are, stage by stage.
struct Reference {
    number: usize,
    drawn: DrawnTest,
    fits: Result<SingleFits, String>,
    comparison: Result<Comparison, String>,
    answer: Result<Answer, String>,
}

impl Reference {
    fn new(number: usize, drawn: DrawnTest, settings: &GapSettings) -> Self {
        let fits = fitted(&drawn, settings);
        let comparison = compared(&fits, &settings.thresholds);
        let answer = answered(&comparison, &settings.thresholds);
        Self {
            number,
            drawn,
            fits,
            comparison,
            answer,
        }
    }

    /// Returns the record of the test with an answer.
    fn record(&self, answer: Result<Answer, String>) -> Record {
        // The seed only tells records of several runs apart.
        Record::new(0, &self.drawn.answered(self.number, answer, 0.0))
    }

    /// Returns the answer with one threshold changed.
    fn answer(&self, variant: &Variant) -> Result<Answer, String> {
        let (drawn, thresholds) = (&self.drawn, &variant.settings.thresholds);
        match variant.stage {
            // The requirements decide nothing but whether there is an answer.
            Stage::Requirements if self.fits.is_ok() => {
                caught(|| check(&drawn.observed, &drawn.described, &variant.settings))?;
                self.answer.clone()
            }
            Stage::Requirements | Stage::Fits => {
                let comparison = compared(&fitted(drawn, &variant.settings), thresholds);
                answered(&comparison, thresholds)
            }
            Stage::Pairs => answered(&compared(&self.fits, thresholds), thresholds),
            Stage::Verdict => answered(&self.comparison, thresholds),
            Stage::Beside => self.answer.clone(),
        }
    }
}

/// Prints the figures of these tests, and one row for each threshold: name, value, and what half and twice of it change.
/// The rows that need new fits take nearly all of the time and come last.
///
/// # Errors
/// The text for a threshold that cannot take such a value.
pub fn print(tasks: &[Task], seed: u64, thresholds: &Thresholds) -> Result<(), String> {
    let variants = variants(thresholds)?;
    let settings = GapSettings {
        thresholds: thresholds.clone(),
        ..GapSettings::default()
    };
    let tests: Vec<Reference> = tasks
        .par_iter()
        .filter_map(|task| Some(Reference::new(task.number, task.draw(seed)?, &settings)))
        .collect();
    let before: Vec<Record> = tests
        .iter()
        .map(|one| one.record(one.answer.clone()))
        .collect();
    let before: Vec<&Record> = before.iter().collect();
    println!("{} tests: {}", before.len(), figures(&before));
    println!(
        "{:22} {:>9}  {:44} twice",
        "threshold", "value", "half and its changes"
    );
    for pair in variants.chunks(FACTORS.len()) {
        let changed: Vec<Vec<Record>> = pair
            .par_iter()
            .map(|variant| {
                let tests = tests.par_iter();
                tests.map(|one| one.record(one.answer(variant))).collect()
            })
            .collect();
        let cells = pair.iter().zip(&changed).map(|(variant, after)| {
            let changed = changes(&before, &after.iter().collect::<Vec<_>>());
            format!("{}: {changed}", number(variant.value()))
        });
        let cells: Vec<String> = cells.collect();
        let name = pair[0].name;
        let value = number(thresholds.value(name).unwrap_or(f64::NAN));
        println!("{name:22} {value:>9}  {:44} {}", cells[0], cells[1]);
    }
    Ok(())
}

/// Returns half and twice of each threshold. Those that take the least time come first.
fn variants(thresholds: &Thresholds) -> Result<Vec<Variant>, String> {
    let mut all = Vec::new();
    for name in Thresholds::names() {
        let stage = Thresholds::stage(name).unwrap_or(Stage::Fits);
        for factor in FACTORS {
            let changed = thresholds.with_factor(name, factor);
            all.push(Variant {
                name,
                stage,
                settings: GapSettings {
                    thresholds: changed.map_err(|error| error.to_string())?,
                    ..GapSettings::default()
                },
            });
        }
    }
    all.sort_by_key(|one| std::cmp::Reverse(one.stage));
    Ok(all)
}

/// Returns all figures as hits of cases.
fn figures(records: &[&Record]) -> String {
    let scores = Scores::of(records);
    let figures = FIGURES.map(|(key, name)| {
        let rate = scores.rate(key);
        format!("{name} {}/{}", rate.hits, rate.of)
    });
    format!("{}, none {}", figures.join(", "), scores.failed)
}

/// Returns the figures that change, with their change, the number of other verdicts, and that of tests without a diagnosis.
fn changes(before: &[&Record], after: &[&Record]) -> String {
    let (old, new) = (Scores::of(before), Scores::of(after));
    let mut parts = Vec::new();
    for (key, name) in FIGURES {
        let change = new.rate(key).hits as i64 - old.rate(key).hits as i64;
        if change != 0 {
            parts.push(format!("{name} {change:+}"));
        }
    }
    let pairs = before.iter().zip(after);
    let others = pairs.filter(|(old, new)| verdict_of(old) != verdict_of(new));
    let others = others.count();
    if others > 0 {
        parts.push(format!("verdicts {others}"));
    }
    if new.failed != old.failed {
        let change = new.failed as i64 - old.failed as i64;
        parts.push(format!("none {change:+}"));
    }
    match parts.is_empty() {
        true => "0".to_owned(),
        false => parts.join(", "),
    }
}

/// Returns the verdict of a test; its words do not count.
fn verdict_of(record: &Record) -> Option<(&str, &[String])> {
    let outcome = record.answer.as_ref()?;
    Some((&outcome.verdict, &outcome.names))
}

/// Returns a number without the rounding of its last binary digits.
fn number(value: f64) -> String {
    let rounded = format!("{value:.6}");
    let short = rounded.trim_end_matches('0').trim_end_matches('.');
    short.to_owned()
}
