//! Every argument that takes a number, at its extreme values: an answer, or an error that names the argument.
//!
//! A test in `src/cli/mod.rs` holds the table against the arguments; `scripts/budgets.py` measures time and memory.

use super::{program, samples};
use rayon::prelude::*;
use std::process::Command;

const TABLE: &str = include_str!("budgets.tsv");

/// The value that a word of the table stands for.
fn expanded(value: &str) -> String {
    let value = value.replace("@digits", &"9".repeat(309));
    let (count, most) = match value.split_once(':') {
        Some(("@ascending", count)) => (count, 1.0),
        Some(("@fractions", count)) => (count, count.parse().unwrap()),
        _ => return value,
    };
    let numbers = 1..=count.parse::<u32>().unwrap();
    let numbers = numbers.map(|number| (f64::from(number) / most).to_string());
    numbers.collect::<Vec<_>>().join(",")
}

/// What is wrong with a run; `None` where it keeps to the table.
fn fault(command: &str, argument: &str, rest: &str, value: &str, accepted: bool) -> Option<String> {
    let folder = samples();
    // Samples without a header.
    let low = std::fs::read(folder.path().join("recordings/cantilever/low.wav")).unwrap();
    std::fs::write(folder.path().join("low.raw"), &low[100..]).unwrap();
    let mut words: Vec<&str> = rest.split_whitespace().collect();
    if command != "*" {
        words.insert(0, command);
    }
    let run = Command::new(program())
        .current_dir(folder.path())
        .args(words)
        .arg(format!("{argument}={}", expanded(value)))
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&run.stderr);
    let is_good = match (accepted, run.status.code()) {
        (true, Some(0 | 1)) => true,
        (false, Some(2)) => error.contains(argument),
        _ => false,
    };
    let error: String = error.chars().take(400).collect();
    (!is_good).then(|| {
        format!(
            "{command} {argument}={value}: {:?} {error}",
            run.status.code()
        )
    })
}

#[test]
fn limit_every_numeric_argument_is_bounded() {
    let mut runs = Vec::new();
    for line in TABLE.lines().filter(|line| !line.starts_with('#')) {
        let columns: Vec<&str> = line.split('\t').collect();
        let [command, argument, rest, accepted, refused] = columns.try_into().unwrap();
        for (values, is_accepted) in [(accepted, true), (refused, false)] {
            // Values with a tilde take seconds: scripts/budgets.py tries them.
            let values = values.split(' ').filter(|value| !value.starts_with('~'));
            runs.extend(values.map(|value| (command, argument, rest, value, is_accepted)));
        }
    }
    let faults: Vec<String> = runs
        .into_par_iter()
        .filter_map(|(command, argument, rest, value, accepted)| {
            fault(command, argument, rest, value, accepted)
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn limit_the_environment_asks_for_a_bounded_number_of_threads() {
    for (threads, code) in [("2", 0), ("0", 0), ("100000", 2)] {
        let run = Command::new(program())
            .args(["predict", "--joint", "free"])
            .env("RAYON_NUM_THREADS", threads)
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(code), "{threads}: {error}");
        assert_eq!(
            error.contains("RAYON_NUM_THREADS=100000"),
            code == 2,
            "{error}"
        );
    }
}
