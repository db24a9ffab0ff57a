//! What is kept of a test: enough for all scores, so that studies run apart can be scored together.

use super::plants::Class;
use super::score::{MEASURES, Measure};
use super::trial::{Answer, Trial};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::HashSet;

/// A test and what two observers made of it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Record {
    pub seed: u64,
    pub number: usize,
    /// Cell of the study.
    pub class: String,
    pub support: String,
    pub tolerances: String,
    pub errors: String,
    pub plan: String,
    pub recordings: usize,
    /// What is to be found: `none`, `unknown`, or groups of effects.
    pub truth: String,
    /// `None` without a diagnosis.
    pub answer: Option<Outcome>,
    /// That of the ideal observer, where it was asked for.
    pub ideal: Option<Outcome>,
    /// Time of the diagnosis (s).
    pub seconds: f64,
}

/// An answer, scored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Kind of the verdict.
    pub verdict: String,
    /// Hypotheses that the verdict names.
    pub names: Vec<String>,
    /// Probability of each class, the most probable first.
    pub classes: Vec<(String, f64)>,
    /// Keys of the rates that this test is a case of, and whether it is a hit.
    pub hits: Vec<(String, bool)>,
    /// One effect is planted, and something is named.
    pub is_named_single: bool,
    /// Closure on spared data by the first hypothesis of effects; `None` where none is stated.
    pub closure: Option<f64>,
}

impl Outcome {
    fn new(trial: &Trial, answer: &Answer) -> Self {
        let is_scored = |measure: &Measure| {
            let hit = (measure.hit)(trial, answer)?;
            Some((measure.key.to_owned(), hit))
        };
        let classes = answer.classes.iter();
        let names = answer.verdict.hypotheses();
        Self {
            verdict: answer.verdict.kind().to_owned(),
            names: names.iter().map(|one| one.name()).collect(),
            classes: classes.map(|(class, p)| (class.name(), *p)).collect(),
            hits: MEASURES.iter().filter_map(is_scored).collect(),
            is_named_single: trial.truth.is_single() && answer.named().is_some(),
            closure: answer.closure,
        }
    }

    /// Returns whether this test is a hit of a rate; `None` where it is none of its cases.
    pub fn hit(&self, key: &str) -> Option<bool> {
        let mut hits = self.hits.iter();
        hits.find(|one| one.0 == key).map(|one| one.1)
    }

    /// Returns the stated probability of a class.
    pub fn probability_of(&self, class: &str) -> f64 {
        let mut classes = self.classes.iter();
        classes.find(|one| one.0 == class).map_or(0.0, |one| one.1)
    }
}

impl Record {
    /// Returns whether two effects are planted.
    pub fn is_pair(&self) -> bool {
        self.class == Class::Pair.name()
    }

    pub fn new(seed: u64, trial: &Trial) -> Self {
        Self {
            seed,
            number: trial.number,
            class: trial.truth.class.name(),
            support: trial.support.name().to_owned(),
            tolerances: trial.tolerances.name().to_owned(),
            errors: trial.errors.name().to_owned(),
            plan: trial.plan.name().to_owned(),
            recordings: trial.recordings,
            truth: trial.truth.explained().name(),
            answer: trial
                .answer
                .as_ref()
                .ok()
                .map(|answer| Outcome::new(trial, answer)),
            ideal: trial
                .ideal
                .as_ref()
                .map(|answer| Outcome::new(trial, answer)),
            seconds: trial.seconds,
        }
    }
}

/// What is read of the document that `--json` wrote.
#[derive(Deserialize)]
struct Document {
    /// Thresholds that were changed.
    set: Map<String, Value>,
    records: Vec<Record>,
}

/// Reads the tests of earlier studies from the files that `--json` wrote, all with these thresholds changed.
///
/// # Errors
/// The text for a file that is none, that has other thresholds, or a test of an earlier file.
pub fn read(files: &[String], set: &Map<String, Value>) -> Result<Vec<Record>, String> {
    let mut all: Vec<Record> = Vec::new();
    let mut known = HashSet::new();
    for file in files {
        let text = std::fs::read_to_string(file).map_err(|error| format!("{file}: {error}"))?;
        let document: Document = serde_json::from_str(&text)
            .map_err(|error| format!("{file}: no file of `--json`: {error}"))?;
        if document.set != *set {
            return Err(format!(
                "{file}: its thresholds are not these; give the same `--set` as then"
            ));
        }
        for record in document.records {
            let Record {
                seed,
                number,
                class,
                ..
            } = &record;
            if !known.insert((*seed, *number, class.clone())) {
                return Err(format!(
                    "{file}: test {number} of {class}, seed {seed}, is read twice"
                ));
            }
            all.push(record);
        }
    }
    Ok(all)
}
