//! Many tests in one call: the same tables however they come about, and a row for every test.

use super::{golden::assert_snapshot, program, tapjoint};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use tapjoint::batch::JOURNAL_HEAD;

/// Files of a batch, except the page.
const FILES: [&str; 4] = ["tests.csv", "modes.csv", "hypotheses.csv", "batch.jsonl"];

/// Number of tests that can be analysed.
const TESTS: usize = 12;

/// A folder `tests` with small virtual tests, a recording that is none, and a description of a recording that is missing.
fn tests() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings/cantilever/source.toml");
    fs::copy(source, folder.path().join("source.toml")).unwrap();
    for number in 0..TESTS {
        let out = format!("tests/t{number:02}");
        let (ky, seed) = (4.0 + 0.02 * number as f64, number.to_string());
        let arguments = [
            "simulate",
            "source.toml",
            "--kx",
            "1400",
            "--ky",
            &ky.to_string(),
            "--seconds",
            "5",
            "--taps",
            "1",
            "--seed",
            &seed,
            "--out",
            &out,
            "-q",
        ];
        tapjoint(folder.path(), &arguments, 0);
    }
    let first = fs::read_to_string(folder.path().join("tests/t00/test.toml")).unwrap();
    for (name, recording) in [("corrupt", Some("no recording")), ("missing", None)] {
        let place = folder.path().join("tests").join(name);
        fs::create_dir_all(&place).unwrap();
        fs::write(place.join("test.toml"), &first).unwrap();
        for file in ["low.wav", "high.wav"] {
            if let Some(text) = recording {
                fs::write(place.join(file), text).unwrap();
            }
        }
    }
    folder
}

fn batch(folder: &Path, arguments: &[&str]) -> String {
    tapjoint(folder, &[&["batch"], arguments].concat(), 0)
}

/// All tables of a batch.
fn tables(folder: &Path) -> BTreeMap<&'static str, Vec<u8>> {
    let read = |name| (name, fs::read(folder.join(name)).unwrap());
    FILES.map(read).into()
}

/// Rows of a table by the heads of their columns.
fn rows(file: &Path) -> Vec<BTreeMap<String, String>> {
    let text = fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let heads: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows = lines.map(|line| {
        // Cells with commas are quoted; none of them is looked at here.
        let mut inside = false;
        let plain: String = line
            .chars()
            .map(|c| {
                inside ^= c == '"';
                if inside && c == ',' { ';' } else { c }
            })
            .collect();
        let cells: Vec<String> = plain.split(',').map(str::to_owned).collect();
        assert_eq!(cells.len(), heads.len(), "{line}");
        heads
            .iter()
            .map(|head| (*head).to_owned())
            .zip(cells)
            .collect()
    });
    rows.collect()
}

#[test]
fn prop_jobs_parts_and_interruptions_change_no_byte() {
    let folder = tests();
    let place = folder.path();
    batch(place, &["tests", "--jobs", "1", "--out", "one"]);
    let expected = tables(&place.join("one"));
    batch(place, &["tests", "--jobs", "2", "--out", "two"]);
    assert_eq!(tables(&place.join("two")), expected);
    for shard in ["3/3", "1/3", "2/3"] {
        batch(place, &["tests", "--shard", shard, "--out", "parts"]);
    }
    batch(place, &["tests", "--merge", "--out", "parts"]);
    assert_eq!(tables(&place.join("parts")), expected);
    // As a process leaves it that is killed while it writes.
    let journal = &expected["batch.jsonl"];
    let cuts = [0, 1, JOURNAL_HEAD.len(), JOURNAL_HEAD.len() + 1];
    let spread = (1..8).map(|part| part * journal.len() / 8);
    for cut in cuts.into_iter().chain(spread).chain([journal.len() - 1]) {
        let out = place.join("cut");
        fs::create_dir_all(&out).unwrap();
        fs::write(out.join("batch.jsonl"), &journal[..cut]).unwrap();
        batch(place, &["tests", "--out", "cut"]);
        assert_eq!(tables(&out), expected, "{cut}");
        fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn val_numbers_are_those_of_run_and_a_failing_test_is_a_row() {
    let folder = tests();
    let place = folder.path();
    let said = batch(place, &["tests"]);
    assert!(said.lines().count() <= 25, "{said}");
    let all = rows(&place.join("batch-report/tests.csv"));
    assert_eq!(all.len(), TESTS + 2);
    for (name, words) in [("corrupt", "low.wav"), ("missing", "cannot be read")] {
        let file = format!("tests/{name}/test.toml");
        let row = all.iter().find(|row| row["test"] == file).unwrap();
        assert_eq!(row["outcome"], "failed");
        assert!(row["error"].contains(words), "{}", row["error"]);
    }
    let modes = rows(&place.join("batch-report/modes.csv"));
    let hypotheses = rows(&place.join("batch-report/hypotheses.csv"));
    for test in ["tests/t00/test.toml", "tests/t07/test.toml"] {
        let report = tapjoint(place, &["run", test, "--json", "-", "--out", "report"], 0);
        let report: Value = serde_json::from_str(&report).unwrap();
        let row = all.iter().find(|row| row["test"] == test).unwrap();
        assert_eq!(row["outcome"], "answered");
        let equal = |cell: &str, value: &Value| {
            let cell = (!cell.is_empty()).then(|| cell.parse::<f64>().unwrap().to_bits());
            assert_eq!(cell, value.as_f64().map(f64::to_bits), "{test}: {value}");
        };
        for (name, unit) in [("kt", "N_per_m"), ("kr", "N_m_per_rad")] {
            for part in ["value", "std", "low", "high"] {
                let head = match part {
                    "value" => format!("{name}_{unit}"),
                    part => format!("{name}_{part}_{unit}"),
                };
                equal(&row[&head], &report["estimate"][name][part]);
            }
        }
        assert_eq!(
            row["verdict"],
            report["gap"]["verdict"]["kind"].as_str().unwrap()
        );
        assert_eq!(
            row["warnings"],
            report["warnings"].as_array().unwrap().len().to_string()
        );
        let own = modes.iter().filter(|row| row["test"] == test);
        let expected = report["modes"].as_array().unwrap();
        assert_eq!(own.clone().count(), expected.len());
        for (row, mode) in own.zip(expected) {
            equal(&row["frequency_Hz"], &mode["frequency"]);
            equal(&row["std_Hz"], &mode["std"]);
            equal(&row["damping"], &mode["damping"]);
            equal(&row["mode"], &mode["mode"]);
        }
        let own = hypotheses.iter().filter(|row| row["test"] == test);
        let expected = report["gap"]["hypotheses"].as_array().unwrap();
        assert_eq!(own.clone().count(), expected.len());
        for (row, one) in own.zip(expected) {
            assert_eq!(row["hypothesis"], one["effect"].as_str().unwrap());
            equal(&row["probability"], &one["probability"]);
        }
    }
}

#[test]
fn val_a_list_on_standard_input_names_the_tests() {
    let folder = tests();
    let place = folder.path();
    let mut process = Command::new(program())
        .current_dir(place)
        .args(["batch", "--from", "-", "--no-diagnosis"])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut input = process.stdin.take().unwrap();
    input
        .write_all(b"tests/t03/test.toml\n\ntests/t01/test.toml\r\n")
        .unwrap();
    drop(input);
    assert!(process.wait().unwrap().success());
    let rows = rows(&place.join("batch-report/tests.csv"));
    let names: Vec<&str> = rows.iter().map(|row| row["test"].as_str()).collect();
    assert_eq!(names, ["tests/t03/test.toml", "tests/t01/test.toml"]);
    assert!(rows.iter().all(|row| row["verdict"].is_empty()));
}

#[test]
fn val_a_table_changes_the_description_of_its_recordings() {
    let folder = tests();
    let place = folder.path();
    let table =
        "file,length,serial\ntests/t00/high.wav,,A 1\ntests/t00/high.wav,400 mm,A 2\nno.wav,,A 3\n";
    fs::write(place.join("table.csv"), table).unwrap();
    let test = "tests/t00/test.toml";
    batch(place, &["--test", test, "--table", "table.csv"]);
    let rows = rows(&place.join("batch-report/tests.csv"));
    let serials: Vec<&str> = rows.iter().map(|row| row["serial"].as_str()).collect();
    assert_eq!(serials, ["A 1", "A 2", "A 3"]);
    let [kr, other] = [0, 1].map(|row| rows[row]["kr_N_m_per_rad"].parse::<f64>().unwrap());
    assert!((kr / other - 1.0).abs() > 0.01, "{kr} {other}");
    assert_eq!(rows[2]["outcome"], "failed");
}

#[test]
fn val_reports_are_those_of_run_and_the_page_leads_to_them() {
    let folder = tests();
    let place = folder.path();
    let test = "tests/t02/test.toml";
    batch(
        place,
        &[
            test,
            "tests/missing/test.toml",
            "--reports",
            "--out",
            "made",
        ],
    );
    tapjoint(place, &["run", test, "--out", "alone", "-q"], 0);
    let own = place.join("made/reports/000001-t02");
    for file in ["report.json", "report.html", "updated-model.toml"] {
        let [one, other] =
            [&own, &place.join("alone")].map(|folder| fs::read(folder.join(file)).ok());
        assert!(one == other, "{file}");
    }
    assert!(!place.join("made/reports/000002-missing").exists());
    // With and without reports the tables are the same, and so are those of a second call.
    let expected = tables(&place.join("made"));
    batch(
        place,
        &[
            test,
            "tests/missing/test.toml",
            "--reports",
            "--out",
            "made",
        ],
    );
    batch(place, &[test, "tests/missing/test.toml", "--out", "plain"]);
    assert_eq!(tables(&place.join("made")), expected);
    assert_eq!(tables(&place.join("plain")), expected);
}

#[test]
fn limit_a_bad_call_is_refused_before_any_work() {
    let folder = tests();
    let place = folder.path();
    fs::write(place.join("bad.csv"), "name\nx\n").unwrap();
    fs::create_dir(place.join("empty")).unwrap();
    let cases: [(&[&str], &str); 7] = [
        (&[], "there is no test"),
        (&["empty"], "holds no test description"),
        (&["tests", "--shard", "4/3"], "--shard"),
        (&["tests", "--merge"], "cannot be read"),
        (&["--table", "bad.csv"], "bad.csv:1: no column `file`"),
        (
            &["tests", "--test", "nothing.toml"],
            "nothing.toml: cannot be read",
        ),
        (
            &["tests", "--test", "tests/t00/test.toml", "--hammer", "1"],
            "--hammer",
        ),
    ];
    for (arguments, words) in cases {
        let output = Command::new(program())
            .current_dir(place)
            .arg("batch")
            .args(arguments)
            .output()
            .unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        assert!(error.contains(words), "{arguments:?}: {error}");
    }
    batch(place, &["tests", "--shard", "1/3", "--out", "parts"]);
    batch(place, &["tests", "--shard", "3/3", "--out", "parts"]);
    let output = Command::new(program())
        .current_dir(place)
        .args(["batch", "tests", "--merge", "--out", "parts"])
        .output()
        .unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("parts are missing: 2/3"), "{error}");
}

#[test]
fn frozen_batch() {
    let folder = tests();
    let place = folder.path();
    let said = batch(place, &["tests", "--jobs", "1"]);
    let page = fs::read_to_string(place.join("batch-report/batch.html")).unwrap();
    assert!(page.contains("<title>Batch of 14 tests – tapjoint report</title>"));
    // Nothing of the page lies elsewhere.
    assert!(!page.contains("src=\"http") && !page.contains("href=\"http"));
    assert_snapshot("batch", &said);
}
