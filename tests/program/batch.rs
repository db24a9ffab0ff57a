//! Many tests in one call: the same tables however they come about, and a row for every test.

use super::{browser::unpacked, golden::assert_snapshot, program, tapjoint};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::thread;
use tapjoint::batch::{HAS_PARQUET, JOURNAL_HEAD, WITHOUT_PARQUET};
use tapjoint::cli::{Host, call};
use tapjoint::pipeline::{Stage, Watch};

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
    let own = report_of(place, "made", "000001-t02-").unwrap();
    for file in ["report.json", "report.html", "updated-model.toml"] {
        let [one, other] =
            [&own, &place.join("alone")].map(|folder| fs::read(folder.join(file)).ok());
        assert!(one == other, "{file}");
    }
    assert!(report_of(place, "made", "000002-missing-").is_none());
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

/// The folder of a report whose name begins so.
fn report_of(place: &Path, out: &str, begins: &str) -> Option<PathBuf> {
    let folders = fs::read_dir(place.join(out).join("reports")).unwrap();
    let mut folders = folders.map(|folder| folder.unwrap().path());
    folders.find(|folder| {
        folder
            .file_name()
            .unwrap()
            .to_string_lossy()
            .starts_with(begins)
    })
}

/// Runs a batch that ends with this code; its standard error.
fn refused(place: &Path, arguments: &[&str], code: i32) -> String {
    let run = Command::new(program())
        .current_dir(place)
        .arg("batch")
        .args(arguments)
        .output();
    let output = run.unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
    error
}

#[test]
fn regress_a_report_belongs_to_its_test_whatever_the_order() {
    let folder = tests();
    let place = folder.path();
    let [one, two] = ["tests/t00/test.toml", "tests/t01/test.toml"];
    let made = |files: &[&str]| {
        let options = ["--reports", "--no-diagnosis", "--out", "made"];
        batch(place, &[files, &options].concat())
    };
    made(&[one, two]);
    // Both folders of the first place stay; the page leads to that of the test.
    made(&[two, one]);
    for begins in ["000001-t00-", "000002-t01-", "000001-t01-", "000002-t00-"] {
        assert!(report_of(place, "made", begins).is_some(), "{begins}");
    }
    let page = fs::read_to_string(place.join("made/batch.html")).unwrap();
    let (_, data) = page.split_once("<script type=\"text/plain\">").unwrap();
    let (data, _) = data.split_once("</script>").unwrap();
    let links = unpacked(data).to_string();
    let leads_to = |begins: &str| links.contains(&format!("\"reports/{begins}"));
    assert!(
        leads_to("000001-t01-") && leads_to("000002-t00-"),
        "{links}"
    );
    assert!(
        !leads_to("000001-t00-") && !leads_to("000002-t01-"),
        "{links}"
    );
    // A folder that cannot be written ends the batch, and leaves no record of a failure.
    fs::create_dir(place.join("blocked")).unwrap();
    fs::write(place.join("blocked/reports"), "in the way").unwrap();
    let error = refused(place, &[one, "--reports", "--out", "blocked"], 2);
    assert!(
        error.contains("is a file, but a folder is needed"),
        "{error}"
    );
    let journal = fs::read_to_string(place.join("blocked/batch.jsonl")).unwrap();
    assert_eq!(journal, JOURNAL_HEAD);
    fs::remove_file(place.join("blocked/reports")).unwrap();
    batch(place, &[one, "--reports", "--out", "blocked"]);
}

#[test]
fn prop_a_journal_in_any_order_keeps_what_others_have_written() {
    let folder = tests();
    let place = folder.path();
    let names: Vec<String> = (0..5)
        .map(|test| format!("tests/t{test:02}/test.toml"))
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let run = |files: &[&str], out: &str| {
        batch(place, &[files, &["--no-diagnosis", "--out", out]].concat());
        tables(&place.join(out))
    };
    let expected = run(&names[..4], "one");
    let other = run(&names[4..], "other");
    let lines = |bytes: &[u8]| -> Vec<String> {
        let text = String::from_utf8(bytes.to_vec()).unwrap();
        text.lines()
            .skip(1)
            .map(|line| format!("{line}\n"))
            .collect()
    };
    let mut mixed = lines(&expected["batch.jsonl"]);
    mixed.reverse();
    let foreign = lines(&other["batch.jsonl"]);
    // An older record of a test, as an earlier version would have left it.
    let stale = mixed[0].replace("\"answered\"", "\"failed\"");
    mixed.splice(0..0, [stale, "no record\n".to_owned(), foreign[0].clone()]);
    let out = place.join("mixed");
    fs::create_dir(&out).unwrap();
    let journal = JOURNAL_HEAD.to_owned() + &mixed.concat();
    fs::write(out.join("batch.jsonl"), journal).unwrap();
    let found = run(&names[..4], "mixed");
    for file in ["tests.csv", "modes.csv"] {
        assert!(found[file] == expected[file], "{file}");
    }
    let kept = [&expected["batch.jsonl"][..], foreign[0].as_bytes()].concat();
    assert_eq!(
        String::from_utf8_lossy(&found["batch.jsonl"]),
        String::from_utf8_lossy(&kept)
    );
    // The parts of a batch join the journal as well.
    for shard in ["1/2", "2/2"] {
        let own = [
            &names[..4],
            &["--no-diagnosis", "--shard", shard, "--out", "mixed"],
        ];
        batch(place, &own.concat());
    }
    let own = [
        &names[..4],
        &["--no-diagnosis", "--merge", "--out", "mixed"],
    ];
    batch(place, &own.concat());
    assert_eq!(fs::read(out.join("batch.jsonl")).unwrap(), kept);
}

#[test]
fn val_a_list_of_the_tests_names_them_again() {
    let folder = tests();
    let place = folder.path();
    let listed = batch(place, &["tests", "--list"]);
    assert!(!place.join("batch-report").exists());
    assert_eq!(listed.lines().count(), TESTS + 2);
    batch(place, &["tests", "--no-diagnosis", "--out", "one"]);
    fs::write(place.join("list.txt"), &listed).unwrap();
    batch(
        place,
        &["--from", "list.txt", "--no-diagnosis", "--out", "two"],
    );
    assert_eq!(tables(&place.join("one")), tables(&place.join("two")));
    let names = rows(&place.join("one/tests.csv"));
    for (number, (row, line)) in (1..).zip(names.iter().zip(listed.lines())) {
        assert_eq!(
            (&*row["test"], &*row["number"]),
            (line, &*number.to_string())
        );
    }
    let part = batch(place, &["tests", "--list", "--shard", "2/2"]);
    let half: Vec<&str> = listed.lines().skip(1).step_by(2).collect();
    assert_eq!(part.lines().collect::<Vec<_>>(), half);
    fs::write(
        place.join("table.csv"),
        "file,length\ntests/t00/low.wav,1\n",
    )
    .unwrap();
    let rows = [
        "--test",
        "tests/t00/test.toml",
        "--table",
        "table.csv",
        "--list",
    ];
    assert_eq!(batch(place, &rows), "tests/t00/low.wav\n");
}

#[test]
#[cfg(unix)]
fn limit_a_test_that_hangs_is_given_up() {
    let folder = tests();
    let place = folder.path();
    let made = Command::new("mkfifo").arg(place.join("pipe.toml")).status();
    assert!(made.unwrap().success());
    let files = [
        "pipe.toml",
        "tests/t00/high.wav",
        "pipe.toml",
        "tests/t00/low.wav",
    ];
    let options = ["--hammer", "1", "--jobs", "1", "--out", "made"];
    // The others are analysed before: their time does not count then.
    batch(place, &[&[files[1], files[3]], &options[..]].concat());
    let all = [&files[..], &options].concat();
    batch(place, &[&all[..], &["--limit", "2"]].concat());
    let check = || {
        let rows = rows(&place.join("made/tests.csv"));
        let outcomes: Vec<&str> = rows.iter().map(|row| row["outcome"].as_str()).collect();
        assert_eq!(outcomes, ["failed", "answered", "failed", "answered"]);
        assert_eq!(rows[0]["error"], "not analysed within 2 s (--limit)");
    };
    check();
    // The next call tries such a test again.
    let journal = fs::read_to_string(place.join("made/batch.jsonl")).unwrap();
    assert_eq!(journal.matches("\"again\":true").count(), 2);
    // Parts with such a test can be joined.
    let part = [&all[..], &["--limit", "2", "--shard", "1/2"]].concat();
    refused(place, &part, 1);
    batch(place, &[&all[..], &["--shard", "2/2"]].concat());
    batch(place, &[&all[..], &["--merge"]].concat());
    check();
}

/// The example for job arrays, which runs its parts one after the other where there is no scheduler.
#[cfg(unix)]
#[test]
fn val_the_example_of_an_array_gives_the_tables_of_one_call() {
    let folder = tests();
    let place = folder.path();
    fs::create_dir(place.join("taps")).unwrap();
    for number in 0..3 {
        let tap = place.join(format!("tests/t{number:02}/high.wav"));
        fs::copy(tap, place.join(format!("taps/{number}.wav"))).unwrap();
    }
    let test = "tests/t00/test.toml";
    batch(place, &["taps", "--test", test, "--out", "one"]);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = program();
    let folders = [program.parent().unwrap().to_owned()].into_iter();
    let all = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(folders.chain(std::env::split_paths(&all))).unwrap();
    let run = Command::new(root.join("examples/many_machines/slurm_array.sh"))
        .args([test, "taps", "array"])
        .current_dir(place)
        .env("PATH", path)
        .env("PARTS", "2")
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(run.status.success(), "{error}");
    assert_eq!(tables(&place.join("array")), tables(&place.join("one")));
}

#[test]
fn val_parquet_is_written_or_refused_with_the_remedy() {
    let folder = tests();
    let place = folder.path();
    let arguments = ["tests/t00", "--no-diagnosis", "--parquet"];
    fs::write(place.join("rows.parquet"), "PAR1 and no table PAR1").unwrap();
    let table = ["--test", "tests/t00/test.toml", "--table", "rows.parquet"];
    let broken = refused(place, &table, 2);
    if !HAS_PARQUET {
        assert!(refused(place, &arguments, 2).contains(WITHOUT_PARQUET));
        assert!(!place.join("batch-report").exists());
        assert!(broken.contains(WITHOUT_PARQUET), "{broken}");
        return;
    }
    assert!(
        broken.contains("rows.parquet:1: cannot be read"),
        "{broken}"
    );
    // The second call replaces the tables of the first.
    for _ in 0..2 {
        batch(place, &arguments);
        for table in ["tests", "modes", "hypotheses"] {
            let file = place.join(format!("batch-report/{table}.parquet"));
            assert!(fs::read(file).unwrap().starts_with(b"PAR1"));
        }
    }
}

#[test]
fn regress_parts_with_a_folder_for_a_file_are_joined() {
    let folder = tests();
    let place = folder.path();
    let table = "file\ntests/t00/high.wav\ntests\nno.wav\n";
    fs::write(place.join("table.csv"), table).unwrap();
    let given = ["--test", "tests/t00/test.toml", "--table", "table.csv"];
    batch(place, &[&given[..], &["--out", "one"]].concat());
    // More parts than tests: the last two need not be run.
    let parts = [("1/5", 0), ("2/5", 1), ("3/5", 1)];
    for (part, code) in parts {
        let call = [&["batch"], &given[..], &["--out", "parts", "--shard", part]].concat();
        tapjoint(place, &call, code);
    }
    batch(
        place,
        &[&given[..], &["--out", "parts", "--merge"]].concat(),
    );
    assert_eq!(tables(&place.join("parts")), tables(&place.join("one")));
    // The remedy for a changed file names the parts that there are.
    fs::copy(
        place.join("tests/t01/high.wav"),
        place.join("tests/t00/high.wav"),
    )
    .unwrap();
    let error = refused(
        place,
        &[&given[..], &["--out", "parts", "--merge"]].concat(),
        2,
    );
    assert!(error.contains("--shard I/5"), "{error}");
}

#[test]
fn regress_a_report_that_takes_too_long_leaves_the_record() {
    let folder = tests();
    let place = folder.path();
    batch(place, &["tests/t00"]);
    let journal = place.join("batch-report/batch.jsonl");
    let record = fs::read_to_string(&journal)
        .unwrap()
        .lines()
        .nth(1)
        .unwrap()
        .to_owned();
    refused(place, &["tests/t00", "--reports", "--limit", "1e-6"], 1);
    assert!(fs::read_to_string(&journal).unwrap().contains(&record));
    batch(place, &["tests/t00"]);
    assert!(fs::read_to_string(&journal).unwrap().contains(&record));
}

#[test]
fn regress_a_merge_of_unfinished_records_keeps_finished_ones() {
    let folder = tests();
    let place = folder.path();
    batch(place, &["tests/t00"]);
    let journal = place.join("batch-report/batch.jsonl");
    let whole = fs::read_to_string(&journal).unwrap();
    let record = whole.lines().nth(1).unwrap();
    // No test takes as little as a microsecond.
    refused(
        place,
        &["tests/t00", "--shard", "1/1", "--limit", "1e-6"],
        1,
    );
    refused(place, &["tests/t00", "--merge"], 1);
    assert!(fs::read_to_string(&journal).unwrap().contains(record));
}

#[test]
fn limit_a_refused_call_writes_nothing() {
    let folder = tests();
    let place = folder.path();
    fs::write(place.join("sub.csv"), "file,recording.file\na.wav,b.wav\n").unwrap();
    let test = "tests/t00/test.toml";
    let calls: [&[&str]; 4] = [
        &["--test", test, "--table", "sub.csv"],
        &["tests", "--limit", "0"],
        &["tests", "--merge", "--list"],
        &["nothing", "--shard", "1/0"],
    ];
    for arguments in calls {
        refused(place, arguments, 2);
        assert!(!place.join("batch-report").exists(), "{arguments:?}");
    }
    // A file that a cell names is an input.
    fs::create_dir(place.join("out")).unwrap();
    let outputs = "file,recording.1.file\ntests/t00/test.toml,../../out/modes.csv\n";
    fs::write(place.join("cells.csv"), outputs).unwrap();
    let error = refused(place, &["--table", "cells.csv", "--out", "out"], 2);
    assert!(error.contains("modes.csv"), "{error}");
    assert_eq!(fs::read_dir(place.join("out")).unwrap().count(), 0);
}

/// What ends a call.
struct End;

/// Ends a call at the first stage of a recording.
struct Ending;

impl Watch for Ending {
    fn pass(&self, _: Option<Stage>, to: Option<Stage>) {
        if matches!(to, Some(Stage::Taps)) && !thread::panicking() {
            resume_unwind(Box::new(End));
        }
    }
}

#[test]
fn limit_another_program_ends_a_batch_without_a_trace() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let recordings = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings/cantilever");
    let called = |watch: Arc<dyn Watch + Send + Sync>| {
        let files = ["low.wav", "high.wav"].map(|name| recordings.join(name).into_os_string());
        let words = ["--hammer", "1", "--out"].map(OsString::from);
        let first = [OsString::from("batch")].into_iter();
        let arguments = first
            .chain(files)
            .chain(words)
            .chain([out.clone().into_os_string()]);
        let host = Host {
            descriptions: Vec::new(),
            watch,
        };
        catch_unwind(AssertUnwindSafe(|| call(arguments, host)))
    };
    let ended = called(Arc::new(Ending)).expect_err("the call was ended");
    assert!(ended.is::<End>());
    let journal = fs::read_to_string(out.join("batch.jsonl")).unwrap();
    assert_eq!(journal, JOURNAL_HEAD);
    assert!(called(Arc::new(())).unwrap().unwrap().is_answered);
}

#[test]
fn limit_a_part_without_an_answer_says_so() {
    let folder = tests();
    let place = folder.path();
    let part = [
        "tests/missing/test.toml",
        "tests/t00/test.toml",
        "--no-diagnosis",
        "--out",
        "made",
    ];
    refused(place, &[&part[..], &["--shard", "1/2"]].concat(), 1);
    batch(place, &[&part[..], &["--shard", "2/2"]].concat());
    batch(place, &[&part[..], &["--merge"]].concat());
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
