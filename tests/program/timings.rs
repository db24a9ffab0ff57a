//! `--timings`: what each stage took, on standard error and in the JSON. No test depends on how long anything takes.

use super::{program, samples};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

const TEST: &str = "recordings/cantilever/test.toml";
const WAV: &str = "recordings/cantilever/low.wav";

fn put_out(folder: &Path, arguments: &[&str], code: i32) -> Output {
    let run = Command::new(program())
        .current_dir(folder)
        .args(arguments)
        .output();
    let output = run.unwrap();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
    output
}

/// Checks the figures of one row, and that no others are there.
fn check_row(row: &Value, more: &[&str]) {
    let keys: Vec<&str> = row
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect();
    let expected = ["wall_seconds", "processor_seconds", "peak_bytes"];
    assert_eq!(keys, [more, &expected].concat());
    assert!(row["wall_seconds"].as_f64().unwrap() >= 0.0, "{row}");
    for key in &expected[1..] {
        let figure = &row[key];
        assert!(figure.is_null() || figure.as_f64().unwrap() >= 0.0, "{row}");
    }
    // Other systems do not tell it.
    if cfg!(target_os = "linux") {
        assert!(row["processor_seconds"].is_number(), "{row}");
    }
}

/// Checks `timings` of a document, and returns the names of the stages.
fn stages(document: &Value) -> Vec<String> {
    let timings = &document["timings"];
    check_row(&timings["other"], &[]);
    check_row(&timings["total"], &[]);
    let stages = timings["stages"].as_array().unwrap();
    for stage in stages {
        check_row(stage, &["stage"]);
    }
    let sum: f64 = stages
        .iter()
        .chain([&timings["other"]])
        .map(|row| row["wall_seconds"].as_f64().unwrap())
        .sum();
    let total = timings["total"]["wall_seconds"].as_f64().unwrap();
    assert!((sum - total).abs() < 1e-6 * (1.0 + total), "{timings}");
    let names = stages.iter().map(|stage| stage["stage"].as_str().unwrap());
    names.map(str::to_owned).collect()
}

#[test]
fn prop_every_command_that_takes_timings_has_its_stages() {
    let folder = samples();
    let folder = folder.path();
    let chain = ["taps", "spectra", "fits", "numbers", "joint"];
    let measured = &chain[..3];
    let with = |more: &[&'static str]| [&chain[..], more].concat();
    let commands: Vec<(Vec<&str>, Vec<&str>)> = vec![
        (vec!["inspect", WAV], vec!["taps"]),
        (vec!["spectrum", WAV, "--hammer", "1"], measured.to_vec()),
        (
            vec!["spectrum", WAV, "--hammer", "1", "--png", "a.png"],
            [measured, &["pictures", "files"]].concat(),
        ),
        (
            vec!["frf", WAV, "--hammer", "1"],
            [measured, &["pictures", "files"]].concat(),
        ),
        (vec!["identify", TEST], chain.to_vec()),
        (
            vec!["perturb", TEST, "--samples", "20"],
            with(&["perturbation", "pictures", "files"]),
        ),
        (vec!["diagnose", TEST], with(&["diagnosis", "files"])),
        (
            vec!["compare", TEST, TEST],
            with(&["comparison", "pictures", "files"]),
        ),
        (
            vec!["plan", "examples/five_recordings.toml", "--draws", "1"],
            vec!["study"],
        ),
        (vec!["export", TEST], chain.to_vec()),
        (
            vec![
                "resolution",
                TEST,
                "--draws",
                "2",
                "--fit-draws",
                "2",
                "--blocks",
                "1024",
            ],
            with(&["study", "pictures", "files"]),
        ),
        (vec!["blind-check", "--cases", "1"], vec!["study", "files"]),
        (
            vec!["blind-check", "--compare", "--cases", "1"],
            vec!["study", "files"],
        ),
        (
            vec![
                "simulate",
                "examples/five_recordings.toml",
                "--out",
                "virtual",
            ],
            vec![],
        ),
    ];
    for (mut command, expected) in commands {
        command.extend(["--timings", "--json", "-"]);
        let output = put_out(folder, &command, 0);
        let document = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(stages(&document), expected, "{command:?}");
        let table = String::from_utf8(output.stderr).unwrap();
        let (_, table) = table.split_once("Timings\n").unwrap();
        let last = table.lines().last().unwrap();
        assert!(last.starts_with("total "), "{command:?}: {table}");
        // A head, a line, the stages, all else and the total.
        let rows = table.lines().filter(|line| line.contains('.')).count();
        let all_else = usize::from(!expected.is_empty());
        assert_eq!(rows, expected.len() + all_else + 1, "{command:?}: {table}");
    }
}

#[test]
fn prop_reports_with_timings_differ_in_nothing_else() {
    let folder = samples();
    let folder = folder.path();
    let read = |file: &str| std::fs::read_to_string(folder.join(file)).unwrap();
    // The name of the folder stands in the answer.
    let plain = put_out(
        folder,
        &["run", TEST, "--out", "report", "--json", "plain.json"],
        0,
    );
    let before = read("report/report.json");
    let page = read("report/report.html");
    assert_eq!(before, read("plain.json"));
    assert!(!before.contains("\"timings\"") && !before.contains("wall_seconds"));
    let timed = [
        "run",
        TEST,
        "--out",
        "report",
        "--json",
        "timed.json",
        "--timings",
    ];
    let timed = put_out(folder, &timed, 0);
    assert_eq!(plain.stdout, timed.stdout);
    assert_eq!(page, read("report/report.html"));
    let chain = [
        "taps",
        "spectra",
        "fits",
        "numbers",
        "joint",
        "perturbation",
        "diagnosis",
    ];
    for file in ["report/report.json", "timed.json"] {
        let mut document: Value = serde_json::from_str(&read(file)).unwrap();
        let expected = [&chain[..], &["pictures", "files"]].concat();
        assert_eq!(stages(&document), expected, "{file}");
        document.as_object_mut().unwrap().shift_remove("timings");
        let text = serde_json::to_string_pretty(&document).unwrap() + "\n";
        assert_eq!(text, before, "{file}");
    }
}

#[test]
fn limit_quiet_commands_print_no_timings_and_write_them() {
    let folder = samples();
    let command = ["inspect", WAV, "--timings", "--quiet", "--json", "-"];
    let output = put_out(folder.path(), &command, 0);
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "");
    let document = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(stages(&document), ["taps"]);
}

#[test]
fn limit_commands_that_compute_nothing_from_data_refuse_timings() {
    let folder = tempfile::tempdir().unwrap();
    let commands: [&[&str]; 5] = [
        &["init"],
        &["predict", "--joint", "free"],
        &["reproduce"],
        &["completions", "bash"],
        &["man"],
    ];
    for command in commands {
        let output = put_out(folder.path(), &[command, &["--timings"]].concat(), 2);
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(error.contains("'--timings'"), "{command:?}: {error}");
    }
}
