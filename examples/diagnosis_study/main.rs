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
//! [--sweep] [--ideal] [--list] [--json FILE]`
//!
//! `--tests`: tests of each cell (20); of `nothing` four times, of `pair` twice as many. `--cell`: one class.
//! `--number`: one test of each cell. `--list`: one line for each test: what is true, the verdict, the first
//! hypotheses with their probabilities. The same seed gives the same answers, whatever the number of threads.
//! `--set`: another value of a threshold of the diagnosis; it may be given several times. `--sweep`: one row for each
//! threshold, with what half and twice of its value change. `--ideal`: beside each rate that of an observer who knows the
//! study's distributions of sizes; it takes twice the time.

mod draws;
mod ideal;
mod outside;
mod plans;
mod plants;
mod score;
mod structures;
mod sweep;
mod table;
mod trial;

use draws::ErrorShape;
use plans::PlanKind;
use plants::Class;
use rayon::prelude::*;
use score::Scores;
use serde_json::{Map, Value, json};
use structures::{Support, Tolerances};
use tapjoint::gap::{GapSettings, Thresholds};
use trial::{DrawnTest, Trial};

const USAGE: &str = "usage: diagnosis_study [--tests N] [--seed S] [--cell NAME] [--number K] [--set NAME=VALUE] \
                     [--sweep] [--ideal] [--list] [--json FILE]";
/// Structures drawn for one test until one of them can be.
const ATTEMPTS: u64 = 100;

/// What the command line asks for.
struct Request {
    tests: usize,
    seed: u64,
    cell: Option<String>,
    number: Option<usize>,
    settings: GapSettings,
    sweep: bool,
    ideal: bool,
    list: bool,
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
            cell: None,
            number: None,
            settings: GapSettings::default(),
            sweep: false,
            ideal: false,
            list: false,
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
                "--cell" => request.cell = Some(value),
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

    /// Returns every test.
    fn tasks(&self) -> Result<Vec<Task>, String> {
        let all = Class::all();
        let names: Vec<String> = all.iter().map(|class| class.name()).collect();
        if let Some(cell) = &self.cell
            && !names.contains(cell)
        {
            return Err(format!(
                "there is no cell `{cell}`; cells are: {}",
                names.join(", ")
            ));
        }
        let mut tasks = Vec::new();
        for (cell, class) in all.into_iter().enumerate() {
            let wanted = self.cell.as_ref().is_none_or(|name| names[cell] == *name);
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
    if request.sweep {
        if request.ideal || request.list || request.json.is_some() {
            return Err("--sweep has no --ideal, --list or --json".to_owned());
        }
        sweep::print(&tasks, seed, &settings.thresholds)?;
        return Ok(());
    }
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
    let total = Scores::of(&trials.iter().collect::<Vec<_>>());
    let mut classes = Vec::new();
    for class in Class::all() {
        let own = trials.iter().filter(|trial| trial.truth.class == class);
        let own: Vec<&Trial> = own.collect();
        if !own.is_empty() {
            classes.push((class, Scores::of(&own)));
        }
    }
    let parts = parts(&trials);
    table::print_total(&total);
    table::print_classes(&classes);
    table::print_verdicts(&classes, &trials);
    table::print_parts(&parts);
    if let Some(file) = &request.json {
        let document = document(&request, &total, &classes, &parts);
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
fn parts(trials: &[Trial]) -> Vec<(String, Scores)> {
    let mut parts = Vec::new();
    for kind in PlanKind::ALL {
        let own = trials.iter().filter(|trial| trial.plan == kind);
        parts.push((format!("plan {}", kind.name()), own.collect::<Vec<_>>()));
    }
    for support in Support::ALL {
        let own = trials.iter().filter(|trial| trial.support == support);
        parts.push((format!("support {}", support.name()), own.collect()));
    }
    for tolerances in Tolerances::ALL {
        let own = trials.iter().filter(|trial| trial.tolerances == tolerances);
        parts.push((format!("tolerances {}", tolerances.name()), own.collect()));
    }
    for (name, counts) in [
        ("one", 1..=1),
        ("two or three", 2..=3),
        ("four to six", 4..=6),
    ] {
        let own = trials.iter();
        let own = own.filter(|trial| counts.contains(&trial.recordings));
        parts.push((format!("recordings {name}"), own.collect()));
    }
    for errors in ErrorShape::ALL {
        let own = trials.iter().filter(|trial| trial.errors == errors);
        parts.push((format!("errors {}", errors.name()), own.collect()));
    }
    let parts = parts.into_iter();
    parts.map(|(name, own)| (name, Scores::of(&own))).collect()
}

fn document(
    request: &Request,
    total: &Scores,
    classes: &[(Class, Scores)],
    parts: &[(String, Scores)],
) -> Value {
    let cells = classes.iter();
    let cells: Map<String, Value> = cells
        .map(|(class, scores)| (class.name(), scores.json()))
        .collect();
    let parts = parts.iter().filter(|part| part.1.tests > 0);
    let parts: Map<String, Value> = parts
        .map(|(name, scores)| (name.clone(), scores.json()))
        .collect();
    let thresholds = &request.settings.thresholds;
    let names = Thresholds::names().into_iter();
    let set = names.filter(|name| thresholds.value(name) != Thresholds::DEFAULT.value(name));
    let set: Map<String, Value> = set
        .map(|name| (name.to_owned(), json!(thresholds.value(name))))
        .collect();
    json!({
        "seed": request.seed,
        "set": set,
        "tests_per_cell": request.tests,
        "total": total.json(),
        "cells": cells,
        "parts": parts,
    })
}
