//! How often the diagnosis is right, on drawn observations (not recordings) of many kinds of tests.
//!
//! Structures, plans, tolerances and sizes are drawn wider than the method assumes, and from other distributions. Every
//! class of plants is a cell: nothing, one effect of each group of the catalogue, two effects, and faults that the
//! catalogue does not have. A scale error below two standard uncertainties of the frequencies' common factor counts as
//! nothing: the description states it. The answer `group` counts as a name of its group.
//!
//! Each rate has hits, cases and the 95 % interval of Clopper and Pearson. "Names that are right" is of all tests in
//! which something is named. "Set-up errors" are positions off by 5 mm or more, polarity, swapped channels, and scales
//! off by 10 % or more. "Visible" are the tests in which the model without the fault leaves a chi square of 14.9, without
//! noise, drift and errors of the description: one in a hundred false alarms and one in ten misses, for an observer who
//! knows what to look for. Two effects are drawn until each is visible alone.
//!
//! `cargo run --release --example diagnosis_study -- [--tests N] [--seed S] [--cell NAME] [--number K] [--set NAME=VALUE]
//! [--sweep] [--ideal] [--list] [--from FILE] [--json FILE]`
//!
//! `--tests`: tests of each cell (20); of `nothing` four times, of `pair` twice as many. `--cell`: one class; it may be given
//! several times. `--number`: one test of each cell. `--list`: one line for each test: what is true, the verdict, the first
//! hypotheses with their probabilities. The same seed gives the same answers, whatever the number of threads.
//! `--set`: another value of a threshold of the diagnosis; it may be given several times. `--sweep`: one row for each
//! threshold, with what half and twice of its value change. `--ideal`: beside each rate that of an observer who knows the
//! study's distributions of sizes and the shares of its classes; it takes twice the time. The column `beside` has the diagnosis on the tests that this observer
//! saw. `--from`: no test is run. The tests of a file that `--json` wrote are scored, or those of several files together.

mod draws;
mod ideal;
mod outside;
mod plans;
mod plants;
mod record;
mod score;
mod structures;
mod sweep;
mod table;
mod trial;

use draws::ErrorShape;
use plans::PlanKind;
use plants::Class;
use rayon::prelude::*;
use record::Record;
use score::Scores;
use serde_json::{Map, Value, json};
use structures::{Support, Tolerances};
use tapjoint::gap::{GapSettings, Thresholds};
use trial::{DrawnTest, Trial};

const USAGE: &str = "usage: diagnosis_study [--tests N] [--seed S] [--cell NAME] [--number K] [--set NAME=VALUE] \
                     [--sweep] [--ideal] [--list] [--from FILE] [--json FILE]";
/// Structures drawn for one test until one of them can be.
const ATTEMPTS: u64 = 100;

/// What the command line asks for.
struct Request {
    tests: usize,
    seed: u64,
    cells: Vec<String>,
    number: Option<usize>,
    settings: GapSettings,
    sweep: bool,
    ideal: bool,
    list: bool,
    from: Vec<String>,
    json: Option<String>,
}

/// One test to draw: its class, the class's index, and its number.
struct Task {
    class: Class,
    cell: usize,
    number: usize,
}

impl Request {
    fn read() -> Result<Self, String> {
        let mut request = Self {
            tests: 20,
            seed: 1,
            cells: Vec::new(),
            number: None,
            settings: GapSettings::default(),
            sweep: false,
            ideal: false,
            list: false,
            from: Vec::new(),
            json: None,
        };
        let mut given = std::env::args().skip(1);
        while let Some(name) = given.next() {
            match name.as_str() {
                "--list" => {
                    request.list = true;
                    continue;
                }
                "--sweep" => {
                    request.sweep = true;
                    continue;
                }
                "--ideal" => {
                    request.ideal = true;
                    continue;
                }
                _ => {}
            }
            let value = given.next().ok_or(USAGE)?;
            match name.as_str() {
                "--tests" => request.tests = value.parse().map_err(|_| USAGE)?,
                "--seed" => request.seed = value.parse().map_err(|_| USAGE)?,
                "--cell" => request.cells.push(value),
                "--from" => request.from.push(value),
                "--number" => request.number = Some(value.parse().map_err(|_| USAGE)?),
                "--json" => request.json = Some(value),
                "--set" => request.set(&value)?,
                _ => return Err(USAGE.to_owned()),
            }
        }
        Ok(request)
    }

    /// Sets a threshold from `NAME=VALUE`.
    fn set(&mut self, assignment: &str) -> Result<(), String> {
        let (name, value) = assignment.split_once('=').ok_or(USAGE)?;
        let value = value.parse().map_err(|_| USAGE)?;
        let set = self.settings.thresholds.set(name, value);
        set.map_err(|error| error.to_string())
    }

    /// Returns the thresholds that are changed, with their values.
    fn set_thresholds(&self) -> Map<String, Value> {
        let thresholds = &self.settings.thresholds;
        let names = Thresholds::names().into_iter();
        names
            .filter(|name| thresholds.value(name) != Thresholds::DEFAULT.value(name))
            .map(|name| (name.to_owned(), json!(thresholds.value(name))))
            .collect()
    }

    /// Returns every test.
    fn tasks(&self) -> Result<Vec<Task>, String> {
        let all = Class::all();
        let names: Vec<String> = all.iter().map(|class| class.name()).collect();
        if let Some(cell) = self.cells.iter().find(|cell| !names.contains(cell)) {
            return Err(format!(
                "there is no cell `{cell}`; cells are: {}",
                names.join(", ")
            ));
        }
        let mut tasks = Vec::new();
        for (cell, class) in all.into_iter().enumerate() {
            let wanted = self.cells.is_empty() || self.cells.contains(&names[cell]);
            let numbers = 0..self.tests * class.multiple();
            let numbers = numbers.filter(|number| self.number.is_none_or(|one| one == *number));
            if wanted {
                tasks.extend(numbers.map(|number| Task {
                    class,
                    cell,
                    number,
                }));
            }
        }
        Ok(tasks)
    }
}

fn main() -> Result<(), String> {
    let request = Request::read()?;
    let tasks = request.tasks()?;
    let (seed, settings) = (request.seed, &request.settings);
    if !request.from.is_empty() && (request.sweep || request.ideal || request.list) {
        return Err("--from runs no test: it has no --sweep, --ideal or --list".to_owned());
    }
    if request.sweep {
        if request.ideal || request.list || request.json.is_some() {
            return Err("--sweep has no --ideal, --list or --json".to_owned());
        }
        sweep::print(&tasks, seed, &settings.thresholds)?;
        return Ok(());
    }
    let mut records = record::read(&request.from, &request.set_thresholds())?;
    if request.from.is_empty() {
        let trials: Vec<Trial> = tasks
            .par_iter()
            .filter_map(|task| {
                let drawn = task.draw(seed)?;
                Some(Trial::run(&drawn, task.number, settings, request.ideal))
            })
            .collect();
        if request.list {
            for trial in &trials {
                println!("{}", trial.line());
            }
            println!();
        }
        records.extend(trials.iter().map(|trial| Record::new(seed, trial)));
    }
    let total = Scores::of(&records.iter().collect::<Vec<_>>());
    let classes = Class::all().into_iter().map(|class| class.name());
    let classes = parts_of(&records, classes, |record| record.class.clone());
    let parts = parts(&records);
    table::print_total(&total);
    table::print_classes(&classes);
    table::print_verdicts(&classes, &records);
    table::print_parts(&parts);
    if let Some(file) = &request.json {
        let document = document(&request, &total, [&classes, &parts], &records);
        let text = serde_json::to_string_pretty(&document).map_err(|error| error.to_string())?;
        std::fs::write(file, text + "\n").map_err(|error| format!("{file}: {error}"))?;
    }
    Ok(())
}

impl Task {
    /// Draws the test; structures that cannot be are drawn again.
    fn draw(&self, seed: u64) -> Option<DrawnTest> {
        (0..ATTEMPTS).find_map(|attempt| {
            let place = (self.cell as u64) << 48 | attempt << 32 | self.number as u64;
            DrawnTest::draw(self.class, mixed(seed ^ mixed(place)))
        })
    }
}

/// Spreads the bits of a number (splitmix64), so that neighbours have unrelated seeds.
fn mixed(number: u64) -> u64 {
    let mut mixed = number.wrapping_add(0x9E37_79B9_7F4A_7C15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    mixed ^ (mixed >> 31)
}

/// Returns the scores of parts of the tests: by plan, support, tolerances and distribution of their errors.
fn parts(records: &[Record]) -> Vec<(String, Scores)> {
    let plans = PlanKind::ALL.map(|kind| format!("plan {}", kind.name()));
    let supports = Support::ALL.map(|support| format!("support {}", support.name()));
    let tolerances = Tolerances::ALL.map(|one| format!("tolerances {}", one.name()));
    let recordings = ["one", "two or three", "four to six"].map(|one| format!("recordings {one}"));
    let errors = ErrorShape::ALL.map(|errors| format!("errors {}", errors.name()));
    let mut parts = parts_of(records, plans, |one| format!("plan {}", one.plan));
    parts.extend(parts_of(records, supports, |one| {
        format!("support {}", one.support)
    }));
    parts.extend(parts_of(records, tolerances, |one| {
        format!("tolerances {}", one.tolerances)
    }));
    parts.extend(parts_of(records, recordings, |one| {
        let number = match one.recordings {
            1 => "one",
            2 | 3 => "two or three",
            _ => "four to six",
        };
        format!("recordings {number}")
    }));
    parts.extend(parts_of(records, errors, |one| {
        format!("errors {}", one.errors)
    }));
    parts
}

/// Returns the scores of the tests of each name; names without a test are left out.
fn parts_of(
    records: &[Record],
    names: impl IntoIterator<Item = String>,
    name_of: impl Fn(&Record) -> String,
) -> Vec<(String, Scores)> {
    let mut parts = Vec::new();
    for name in names {
        let own: Vec<&Record> = records.iter().filter(|one| name_of(one) == name).collect();
        if !own.is_empty() {
            parts.push((name, Scores::of(&own)));
        }
    }
    parts
}

fn document(
    request: &Request,
    total: &Scores,
    [classes, parts]: [&[(String, Scores)]; 2],
    records: &[Record],
) -> Value {
    let [cells, parts] = [classes, parts].map(|rows| {
        let rows = rows.iter();
        rows.map(|(name, scores)| (name.clone(), scores.json()))
            .collect::<Map<String, Value>>()
    });
    let is_run = request.from.is_empty();
    json!({
        "seed": is_run.then_some(request.seed),
        "set": request.set_thresholds(),
        "tests_per_cell": is_run.then_some(request.tests),
        "total": total.json(),
        "cells": cells,
        "parts": parts,
        "records": records,
    })
}
