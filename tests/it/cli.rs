//! Tests of the command line: exit codes, messages, and what is written where.

use assert_cmd::Command;
use predicates::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use tapjoint::description::{Assembly, TestDescription};
use tapjoint::recording::{WavFormat, write_wav};
use tempfile::TempDir;

const TEST: &str = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n[joint]\nkind = \"cantilever\"\n";

fn tapjoint(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("tapjoint").expect("cargo builds the program for tests");
    command.current_dir(folder);
    command
}

/// Runs the program in a folder that holds `test.toml`, expects exit code 2, the message, nothing
/// on standard output and no new file.
fn refused(description: &str, arguments: &[&str], says: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("test.toml"), description).expect("writable");
    let mut result = tapjoint(folder.path())
        .args(arguments)
        .assert()
        .code(2)
        .stdout("");
    for part in says {
        result = result.stderr(predicate::str::contains(*part));
    }
    result.stderr(predicate::str::starts_with("error: "));
    let names: Vec<_> = fs::read_dir(folder.path())
        .expect("readable")
        .map(|entry| entry.expect("readable").file_name())
        .collect();
    assert_eq!(names, ["test.toml"], "{arguments:?} left something behind");
}

#[test]
fn regress_init_prints_a_description_of_each_kind() {
    let folder = tempfile::tempdir().unwrap();
    let kinds = [
        ("cantilever", Assembly::Cantilever),
        ("lap", Assembly::Lap),
        ("free", Assembly::Free),
    ];
    for (name, kind) in kinds {
        let output = tapjoint(folder.path())
            .args(["init", "--kind", name])
            .assert()
            .code(0);
        let text = String::from_utf8(output.get_output().stdout.clone()).unwrap();
        let test = TestDescription::parse(&text, "test.toml").unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(test.joint.kind, kind, "{name}");
    }
    tapjoint(folder.path())
        .arg("init")
        .assert()
        .code(0)
        .stdout(predicate::str::contains("kind = \"cantilever\""))
        .stderr("");
}

#[test]
fn regress_json_on_standard_output_stands_there_alone() {
    let folder = tempfile::tempdir().unwrap();
    let output = tapjoint(folder.path())
        .args(["init", "--json", "-"])
        .assert()
        .code(0);
    let document: serde_json::Value = serde_json::from_slice(&output.get_output().stdout).unwrap();
    assert_eq!(document["version"], 1);
    assert!(document["template"].as_str().unwrap().contains("[beam]"));
    let output = tapjoint(folder.path())
        .args(["init", "-q", "--json", "a.json"])
        .assert()
        .code(0);
    output.stdout("");
    let written = fs::read(folder.path().join("a.json")).unwrap();
    assert_eq!(
        serde_json::from_slice::<serde_json::Value>(&written).unwrap(),
        document
    );
}

#[test]
fn regress_help_of_every_command_names_an_example() {
    let folder = tempfile::tempdir().unwrap();
    for command in [
        "run",
        "init",
        "inspect",
        "spectrum",
        "frf",
        "identify",
        "predict",
        "perturb",
        "resolution",
        "reproduce",
        "export",
        "diagnose",
        "plan",
        "blind-check",
        "completions",
        "man",
        "simulate",
    ] {
        tapjoint(folder.path())
            .args([command, "--help"])
            .assert()
            .code(0)
            .stdout(predicate::str::contains(format!("\n  tapjoint {command}")));
    }
}

#[test]
fn regress_bad_usage_is_explained() {
    let cases: &[(&[&str], &[&str])] = &[
        (
            &["identify", "test.toml", "--frequencies", "17,x"],
            &["\"x\" is not a number", "17,118,335.6"],
        ),
        (
            &["identify", "test.toml", "--frequencies", "118,17"],
            &["17 does not exceed 118", "ascending"],
        ),
        (
            &["identify", "test.toml", "--frequencies", "0,17"],
            &["0 is not a positive number"],
        ),
        (
            &["identify", "test.toml", "--frequencies", "inf"],
            &["inf is not a positive number"],
        ),
        (
            &[
                "identify",
                "test.toml",
                "--frequencies",
                "1,2",
                "--half-line",
                "1,2,3",
            ],
            &["3 values for 2 frequencies"],
        ),
        (
            &["identify", "test.toml", "--half-line", "1"],
            &["--half-line needs frequencies"],
        ),
        (
            &["identify", "test.toml", "--half-line", "-1"],
            &["half of the line spacing in Hz such as 0.125"],
        ),
        (&["identify", "test.toml", "--method", "guess"], &["pairs"]),
        (
            &["identify", "test.toml"],
            &["test.toml:1: nothing to analyse"],
        ),
        (
            &["perturb", "test.toml", "--percent", "0.05,-1"],
            &["-1 is not a positive number"],
        ),
        (
            &["perturb", "test.toml", "--percent", "50"],
            &["50 % is too large"],
        ),
        (
            &["spectrum", "a.wav", "--zoom", "200:0"],
            &["ascending", "0:200"],
        ),
        (
            &["spectrum", "a.wav", "--zoom", "200"],
            &["there is no colon"],
        ),
        (&["spectrum", "a.wav", "--block", "8"], &["16..=1048576"]),
        (
            &["spectrum", "a.wav", "--sample-rate", "1e9"],
            &["1 to 1e8 samples per second"],
        ),
        (
            &["frf", "a.wav", "--scale-hammer=1e-300"],
            &["a size from 1e-15 to 1e15"],
        ),
        (&["spectrum", "a.wav"], &["a.wav: cannot be read"]),
        // `run *` where files are.
        (
            &["run", "test.toml", "test.toml"],
            &["unexpected argument 'test.toml'", "tip: give one file"],
        ),
        (&["inspect", "a.wav", "--hammer", "0"], &["count from 1"]),
        (&["predict"], &["required"]),
        (
            &["predict", "--joint", "cantilever"],
            &["give --kx and --ky"],
        ),
        (
            &["predict", "--joint", "cantilever", "--kx", "1"],
            &["--ky"],
        ),
        (
            &[
                "predict",
                "--joint",
                "cantilever",
                "--kx",
                "1",
                "--ky",
                "-1",
            ],
            &["-1 is no stiffness"],
        ),
        (
            &[
                "predict",
                "--joint",
                "cantilever",
                "--kx",
                "500",
                "--ky",
                "100",
                "--kz",
                "-100",
            ],
            &["sqrt(kx ky) = 223.6"],
        ),
        (
            &[
                "predict",
                "--joint",
                "cantilever",
                "--kx",
                "inf",
                "--ky",
                "0",
                "--kz",
                "5",
            ],
            &["source of energy"],
        ),
        (
            &[
                "predict", "--joint", "lap", "--kx", "1", "--ky", "1", "--kz", "5",
            ],
            &["lap joint has no coupling"],
        ),
        (
            &["predict", "--joint", "free", "--kx", "1", "--ky", "1"],
            &["free beam has no joint"],
        ),
        (&["run"], &["FILE"]),
        (&["run", "test.toml"], &["test.toml:1: nothing to analyse"]),
        (
            &["run", "missing.toml"],
            &["missing.toml: cannot be read", "tapjoint init"],
        ),
        (&["run", "missing.wav"], &["missing.wav: cannot be read"]),
        (
            &["run", "test.toml", "--hammer", "1"],
            &["for bare recordings"],
        ),
        (
            &["reproduce", "--json", "no/such/folder.json"],
            &["cannot be written"],
        ),
        (&["reproduce", "--threads", "0"], &["1..=1024"]),
        (&["frobnicate"], &["frobnicate"]),
    ];
    for (arguments, says) in cases {
        refused(TEST, arguments, says);
    }
}

#[test]
fn regress_bad_descriptions_name_file_line_and_key() {
    let bad = TEST.replace("modulus", "moduls");
    let says = ["error: test.toml:5: `beam.moduls`: unknown key; did you mean `modulus`?"];
    refused(&bad, &["run", "test.toml"], &says);
    refused(
        &bad,
        &["identify", "test.toml", "--frequencies", "17"],
        &says,
    );
    let missing = format!("{TEST}[[recording]]\n\nfile = \"gone.wav\"\n");
    let says = ["error: test.toml:11: `recording.file`: gone.wav cannot be read"];
    refused(&missing, &["run", "test.toml"], &says);
}

#[test]
fn regress_a_description_that_is_no_text_names_the_line() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("test.toml"), b"name = 1\n\xff\xfe").unwrap();
    tapjoint(folder.path())
        .args(["run", "test.toml"])
        .assert()
        .code(2)
        .stderr(predicate::str::starts_with(
            "error: test.toml:2: not UTF-8 text",
        ));
}

#[test]
fn regress_an_output_folder_that_cannot_be_made_is_found_out_first() {
    let with_data = format!("{TEST}[measured]\nfrequencies = [17, 118]\n");
    let arguments = ["run", "test.toml", "--out", "test.toml/report"];
    refused(
        &with_data,
        &arguments,
        &["test.toml: is a file, but a folder is needed"],
    );
}

#[cfg(target_os = "linux")]
#[test]
fn regress_a_reader_that_goes_away_is_no_error() {
    use std::process::{Command, Stdio};
    let program = assert_cmd::cargo::cargo_bin("tapjoint");
    let mut child = Command::new(program)
        .arg("init")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Closed before anything is read: the program finds nobody at the other end, or has put its
    // few kilobytes into the pipe already. Both are fine.
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(
        output.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

// ---------------------------------------------------------------- the main job on the samples

/// A copy of a sample in `recordings/`.
fn sample(name: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let origin = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("recordings")
        .join(name);
    for entry in fs::read_dir(&origin).unwrap() {
        let entry = entry.unwrap();
        if entry.file_type().unwrap().is_file() {
            fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
        }
    }
    folder
}

/// Every file below a folder, with its content.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(below) = folders.pop() {
        for entry in fs::read_dir(&below).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap();
                found.insert(name.display().to_string(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// Runs the program and reads the one JSON document on its standard output.
fn json(folder: &Path, arguments: &[&str], code: i32) -> Value {
    let run = tapjoint(folder)
        .args(arguments)
        .args(["--json", "-"])
        .assert()
        .code(code);
    let output = &run.get_output().stdout;
    // Anything before or after the document is an error of the parser.
    serde_json::from_slice(output)
        .unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(output)))
}

/// All of `keys` exist in `object`.
fn assert_keys(object: &Value, keys: &[&str], place: &str) {
    let found = object
        .as_object()
        .unwrap_or_else(|| panic!("{place} is {object}"));
    for key in keys {
        assert!(found.contains_key(*key), "{place} has no {key}: {object}");
    }
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn regress_run_writes_all_it_promises_and_touches_nothing_else() {
    for (name, report, recordings) in [
        ("cantilever", "Cantilever-report", &["low", "high"][..]),
        ("lap-joint", "Lap-joint-report", &["taps"][..]),
    ] {
        let folder = sample(name);
        let before = contents(folder.path());
        tapjoint(folder.path())
            .args(["run", "test.toml"])
            .assert()
            .code(0)
            .stdout(predicate::str::contains("report.html"));
        let mut after = contents(folder.path());
        for (file, bytes) in &before {
            assert!(after.remove(file).as_ref() == Some(bytes), "{file} changed");
        }
        let written = |file: &str| {
            let bytes = after.get(&format!("{report}/{file}"));
            bytes.unwrap_or_else(|| panic!("{name}: no {file} among {:?}", after.keys()))
        };
        let text = |file: &str| String::from_utf8(written(file).clone()).unwrap();
        for recording in recordings {
            for picture in ["spectrum", "frf"] {
                let file = format!("{picture}-{recording}.png");
                assert!(written(&file).starts_with(b"\x89PNG\r\n"), "{name}: {file}");
            }
        }
        let table = text("parameters.csv");
        assert!(
            table.starts_with("parameter,method,unit,value,std,low,high"),
            "{table}"
        );
        for parameter in ["kx,pairs", "ky,pairs", "kt,pairs", "kr,pairs"] {
            assert!(table.contains(&format!("\n{parameter},")), "{table}");
        }
        let page = text("report.html").to_lowercase();
        assert!(page.starts_with("<!doctype html"), "{}", &page[..80]);
        assert!(page.trim_end().ends_with("</html>"), "the page is cut off");
        let document: Value = serde_json::from_str(&text("report.json")).unwrap();
        assert_eq!(document["version"], 1);
        let stray: Vec<&String> = after
            .keys()
            .filter(|file| !file.starts_with(report))
            .collect();
        assert!(stray.is_empty(), "{name} left {stray:?}");
    }
}

#[test]
fn regress_a_run_has_the_keys_that_scripts_read() {
    let folder = sample("cantilever");
    let document = json(folder.path(), &["run", "test.toml"], 0);
    let report = fs::read(folder.path().join("Cantilever-report/report.json")).unwrap();
    let report: Value = serde_json::from_slice(&report).unwrap();
    assert_eq!(document, report, "--json and report.json differ");

    let top = [
        "version",
        "test",
        "recordings",
        "modes",
        "estimate",
        "prediction",
        "perturbation",
        "warnings",
    ];
    assert_keys(&document, &top, "document");
    assert_eq!(document["test"]["name"], "Cantilever");
    assert_eq!(document["test"]["kind"], "cantilever");
    assert_eq!(document["test"]["model"], "2p");
    let files: Vec<&Value> = document["recordings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|recording| &recording["file"])
        .collect();
    assert_eq!(files, ["low.wav", "high.wav"]);
    for recording in document["recordings"].as_array().unwrap() {
        let keys = [
            "file",
            "sample_rate",
            "channels",
            "seconds",
            "taps",
            "line_spacing",
            "band",
            "window",
            "window_decay",
            "modes",
        ];
        assert_keys(recording, &keys, "recording");
        assert_eq!(recording["channels"], 3);
        let taps = recording["taps"].as_array().unwrap();
        assert_eq!(taps.len(), 5, "{taps:?}");
        for tap in taps {
            assert_keys(tap, &["time", "peak_force", "accepted", "reason"], "tap");
            assert_eq!(tap["accepted"], true, "{tap}");
            assert_eq!(tap["reason"], Value::Null, "{tap}");
            // 20 N with 10 % scatter; the anti-alias filter rounds the short pulse off to two thirds.
            assert!((9.0..26.0).contains(&number(&tap["peak_force"])), "{tap}");
        }
        for mode in recording["modes"].as_array().unwrap() {
            assert_keys(
                mode,
                &["mode", "frequency", "std", "damping"],
                "recording mode",
            );
        }
    }
    // 2048 samples over 200 and 800 Hz.
    assert_eq!(document["recordings"][0]["line_spacing"], 0.25);
    assert_eq!(document["recordings"][1]["line_spacing"], 1.0);
    assert_eq!(
        document["recordings"][0]["band"],
        serde_json::json!([0.0, 200.0])
    );
    for mode in document["modes"].as_array().unwrap() {
        let keys = [
            "mode",
            "frequency",
            "method",
            "line_frequency",
            "half_line",
            "std",
            "damping",
            "damping_std",
            "lambda",
            "recording",
            "label",
        ];
        assert_keys(mode, &keys, "mode");
    }
    let estimate = &document["estimate"];
    let keys = [
        "method",
        "modes_used",
        "reason",
        "kx",
        "ky",
        "kz",
        "coupling",
        "kt",
        "kr",
        "ktr",
        "modulus",
        "density",
        "correlations",
        "pairs",
    ];
    assert_keys(estimate, &keys, "estimate");
    for key in ["kx", "ky", "kt", "kr"] {
        assert_keys(&estimate[key], &["value", "std", "low", "high"], key);
    }
    for key in ["kz", "coupling", "ktr", "modulus", "density"] {
        assert_eq!(estimate[key], Value::Null, "{key} of a two-parameter joint");
    }
    assert_keys(&estimate["pairs"], &["kx", "ky", "kz", "closure"], "pairs");
    for row in document["prediction"].as_array().unwrap() {
        let keys = [
            "mode",
            "measured",
            "predicted",
            "lambda",
            "error_percent",
            "used",
        ];
        assert_keys(row, &keys, "prediction");
        if row["measured"].is_null() {
            assert_eq!(row["error_percent"], Value::Null, "{row}");
            continue;
        }
        let (measured, predicted) = (number(&row["measured"]), number(&row["predicted"]));
        let percent = 100.0 * (predicted - measured) / measured;
        // The same expression on the same digits.
        assert!(
            (number(&row["error_percent"]) - percent).abs() < 1e-9,
            "{row}"
        );
    }
    let percents: Vec<f64> = document["perturbation"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| {
            assert_keys(
                row,
                &["percent", "method", "kx", "ky", "kz"],
                "perturbation",
            );
            number(&row["percent"])
        })
        .collect();
    for percent in [0.05, -0.05, 0.1, -0.1] {
        assert!(percents.contains(&percent), "{percent} among {percents:?}");
    }
}

#[test]
fn recover_the_joints_of_the_samples() {
    for name in ["cantilever-3p", "lap-joint"] {
        let folder = sample(name);
        let truth = fs::read(folder.path().join("truth.json")).unwrap();
        let truth: Value = serde_json::from_slice(&truth).unwrap();
        let document = json(folder.path(), &["run", "test.toml"], 0);
        let estimate = &document["estimate"];
        assert_eq!(estimate["method"], "consistent", "{name}");
        for key in ["kx", "ky"] {
            let (found, truth) = (
                number(&estimate[key]["value"]),
                number(&truth["joint"][key]),
            );
            // The recorder's clock is off by 5e-6, which moves the stiffness by about ten times that.
            assert!(
                (found / truth - 1.0).abs() < 2e-4,
                "{name}: {key} {found} for {truth}"
            );
        }
        for mode in document["modes"].as_array().unwrap() {
            assert_eq!(mode["label"], Value::Null, "{name}: {mode}");
        }
    }
}

#[test]
fn recover_the_forgotten_sensor_of_the_sample() {
    let folder = sample("cantilever");
    let document = json(folder.path(), &["diagnose", "test.toml"], 0);
    let gap = &document["gap"];
    let first = &gap["hypotheses"][0];
    assert_eq!(first["effect"], "sensor-mass", "{gap}");
    let mass = &first["parameters"]["mass"];
    // 24 g were planted; three standard deviations.
    assert!(
        (number(&mass["value"]) - 0.024).abs() < 3.0 * number(&mass["std"]),
        "{mass}"
    );
    // Without it the model misses by more than the readings allow, with it by less.
    assert!(
        number(&first["gap_after"]) < number(&gap["noise_floor"]),
        "{first}"
    );
    assert!(
        number(&first["gap_before"]) > 2.0 * number(&gap["noise_floor"]),
        "{first}"
    );
}

#[test]
fn regress_the_same_bytes_whatever_the_threads() {
    let folder = sample("cantilever");
    let runs: [(&str, &[&str]); 4] = [
        ("first", &[]),
        ("again", &[]),
        ("one", &["--threads", "1"]),
        ("two", &["--threads", "2"]),
    ];
    for (out, more) in runs {
        tapjoint(folder.path())
            .args(["run", "test.toml", "--out", out])
            .args(more)
            .assert()
            .code(0);
    }
    let first = contents(&folder.path().join("first"));
    assert!(first.len() > 5, "{:?}", first.keys());
    for (out, _) in &runs[1..] {
        let other = contents(&folder.path().join(out));
        let names: Vec<&String> = other.keys().collect();
        assert_eq!(names, first.keys().collect::<Vec<_>>(), "{out}");
        for (file, bytes) in &first {
            assert!(&other[file] == bytes, "{file} of {out} differs");
        }
    }
}

#[test]
fn regress_a_second_run_replaces_the_first() {
    let folder = sample("lap-joint");
    let report = folder.path().join("Lap-joint-report");
    fs::create_dir(&report).unwrap();
    fs::write(report.join("notes.txt"), "mine").unwrap();
    for _ in 0..2 {
        tapjoint(folder.path())
            .args(["run", "test.toml"])
            .assert()
            .code(0);
    }
    let found = contents(&report);
    assert_eq!(found["notes.txt"], b"mine");
    assert!(serde_json::from_slice::<Value>(&found["report.json"]).is_ok());
    let hidden: Vec<&String> = found
        .keys()
        .filter(|name| name.contains(".tapjoint"))
        .collect();
    assert!(hidden.is_empty(), "{hidden:?}");
}

#[test]
fn regress_quiet_is_quiet() {
    let folder = sample("cantilever");
    tapjoint(folder.path())
        .args(["run", "test.toml", "--quiet"])
        .assert()
        .code(0)
        .stdout("")
        .stderr("");
    assert!(folder.path().join("Cantilever-report/report.html").exists());
}

#[test]
fn regress_a_bare_recording_is_taken_as_far_as_it_goes() {
    let folder = sample("cantilever");
    let arguments = ["run", "high.wav", "--hammer", "1", "--out", "bare"];
    let document = json(folder.path(), &arguments, 0);
    assert_keys(&document, &["version", "recordings", "modes"], "document");
    assert!(document.get("estimate").is_none_or(Value::is_null));
    let found = contents(&folder.path().join("bare"));
    for file in [
        "report.html",
        "report.json",
        "spectrum-high.png",
        "frf-high.png",
    ] {
        assert!(found.contains_key(file), "{file} among {:?}", found.keys());
    }
}

#[test]
fn regress_a_truncated_recording_is_read_as_far_as_it_goes() {
    let folder = sample("cantilever");
    let path = folder.path().join("low.wav");
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() * 7 / 10]).unwrap();
    let document = json(folder.path(), &["run", "test.toml"], 0);
    let warning = document["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .find(|warning| warning["code"] == "truncated")
        .unwrap_or_else(|| panic!("no warning: {}", document["warnings"]));
    assert!(
        warning["text"].as_str().unwrap().contains("low.wav"),
        "{warning}"
    );
    // Of 25.5 s 17.85 s are left: taps at 0.5, 5.5, 10.5, 15.5 s, the last one cut short.
    let taps = document["recordings"][0]["taps"].as_array().unwrap();
    assert_eq!(taps.len(), 4, "{taps:?}");
    assert!(document["estimate"]["pairs"]["kx"].is_number());
    tapjoint(folder.path())
        .args(["inspect", "low.wav"])
        .assert()
        .code(0)
        .stdout(predicate::str::contains("truncated").or(predicate::str::contains("ends")));
}

#[test]
fn regress_no_taps_is_an_answer_that_is_written_down() {
    let folder = sample("cantilever");
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for (file, rate) in [("low.wav", 2560), ("high.wav", 5120)] {
        let noise = || -> Vec<f64> {
            let normal = StandardNormal;
            normal
                .sample_iter(&mut random)
                .take(4 * rate as usize)
                .map(|x: f64| 1e-3 * x)
                .collect()
        };
        let channels: Vec<Vec<f64>> = std::iter::repeat_with(noise).take(3).collect();
        write_wav(&folder.path().join(file), rate, &channels, WavFormat::Pcm24).unwrap();
    }
    let document = json(folder.path(), &["run", "test.toml"], 1);
    for recording in document["recordings"].as_array().unwrap() {
        assert_eq!(recording["taps"], serde_json::json!([]), "{recording}");
        assert_eq!(recording["modes"], serde_json::json!([]), "{recording}");
        assert_eq!(recording["line_spacing"], Value::Null, "{recording}");
    }
    assert_eq!(document["modes"], serde_json::json!([]));
    no_estimate(folder.path(), &document, "Cantilever-report");
    for command in ["spectrum", "run"] {
        tapjoint(folder.path())
            .args([command, "low.wav"])
            .assert()
            .code(1);
    }
}

/// The estimate is null with its reason, and the report in the folder says the same.
fn no_estimate(folder: &Path, document: &Value, report: &str) {
    assert_eq!(document.get("estimate"), Some(&Value::Null), "{document}");
    let reason = document["estimate_reason"].as_str().unwrap_or_default();
    assert!(reason.contains("mode"), "the reason is {reason:?}");
    let found = contents(&folder.join(report));
    for file in ["report.html", "report.json", "parameters.csv"] {
        assert!(found.contains_key(file), "{file} among {:?}", found.keys());
    }
    let written: Value = serde_json::from_slice(&found["report.json"]).unwrap();
    assert_eq!(&written, document);
}

#[test]
fn regress_too_few_modes_is_an_answer_that_is_written_down() {
    for (model, frequencies) in [("2p", "17"), ("3p", "17, 118")] {
        let folder = tempfile::tempdir().unwrap();
        let text = TEST.replace(
            "\"cantilever\"",
            &format!("\"cantilever\"\nmodel = \"{model}\""),
        );
        let text = format!("name = \"few\"\n{text}[measured]\nfrequencies = [{frequencies}]\n");
        fs::write(folder.path().join("test.toml"), text).unwrap();
        let document = json(folder.path(), &["run", "test.toml"], 1);
        no_estimate(folder.path(), &document, "few-report");
        let modes = document["modes"].as_array().unwrap();
        assert_eq!(modes.len(), frequencies.split(',').count(), "{model}");
        json(folder.path(), &["identify", "test.toml"], 1);
        json(folder.path(), &["perturb", "test.toml"], 1);
    }
}

#[test]
fn limit_as_many_modes_as_stiffnesses_leave_nothing_to_test_with() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("test.toml"), TEST).unwrap();
    let arguments = ["identify", "test.toml", "--frequencies", "17,118"];
    let document = json(folder.path(), &arguments, 0);
    assert!(codes(&document).contains(&"untestable"), "{document}");
    let estimate = &document["estimate"];
    assert_eq!(estimate["method"], "consistent");
    assert_eq!(estimate["goodness_of_fit"], Value::Null);
    assert_eq!(estimate["pairs"], Value::Null, "it needs a mode more");
}

#[test]
fn regress_nobody_at_the_other_end_of_the_pipe() {
    let folder = sample("lap-joint");
    for arguments in [
        &["run", "test.toml"][..],
        &["run", "test.toml", "--json", "-"],
        &["inspect", "taps.wav"],
        &["spectrum", "taps.wav", "--json", "-"],
        &["init"],
        &["reproduce"],
        &["predict", "test.toml", "--kx", "1", "--ky", "1"],
        &["--help"],
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = std::process::Command::new(assert_cmd::cargo::cargo_bin("tapjoint"))
            .current_dir(folder.path())
            .args(arguments)
            .stdout(writer)
            .stderr(std::process::Stdio::piped())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {said}");
        assert!(!said.contains("error"), "{arguments:?}: {said}");
    }
}

// ---------------------------------------------------------------- the other commands

#[test]
fn val_predict_gives_table_1a() {
    // Ingole & Chatterjee, table 1a, as printed: within one in the last digit.
    // Stiffnesses, lambdas, and the last printed digit of the fifth.
    let rows = [
        ("100", "50", [1.8066, 3.7678, 5.8097, 8.6564, 11.7153], 1e-4),
        ("500", "100", [1.8500, 4.4368, 6.8022, 9.0929, 11.915], 1e-3),
        (
            "1000",
            "500",
            [1.8679, 4.5755, 7.2837, 9.5658, 12.146],
            1e-3,
        ),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (kx, ky, lambdas, fifth) in rows {
        let arguments = [
            "predict",
            "--joint",
            "cantilever",
            "--kx",
            kx,
            "--ky",
            ky,
            "--modes",
            "5",
        ];
        let document = json(folder.path(), &arguments, 0);
        let found = document["prediction"].as_array().unwrap();
        assert_eq!(found.len(), 5, "{document}");
        for (index, (row, printed)) in found.iter().zip(lambdas).enumerate() {
            let digit = if index == 4 { fifth } else { 1e-4 };
            let lambda = number(&row["lambda"]);
            // Half a digit more for the rounding of what is printed.
            assert!(
                (lambda - printed).abs() < 1.5 * digit,
                "({kx}, {ky}) mode {}: {lambda}, printed {printed}",
                row["mode"]
            );
        }
    }
}

/// The cantilever of Ingole & Chatterjee, two parameters from the first four modes. The density is
/// the one at which lambda^2/f is 0.151888, the value behind their tables; at 7850 kg/m3 their beam
/// has 0.151681.
fn paper_cantilever() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let density = 7850.0 * (0.151888_f64 / 0.151681).powi(2);
    let beam = TEST.replace("7850", &density.to_string());
    let text = format!("{beam}beam = \"euler\"\n[analysis]\nfit_modes = 4\n");
    fs::write(folder.path().join("test.toml"), text).unwrap();
    folder
}

#[test]
fn val_identify_from_the_frequencies_of_table_4() {
    let folder = paper_cantilever();
    let arguments = [
        "identify",
        "test.toml",
        "--frequencies",
        "17,118,335.625,628.75,994.5",
    ];
    let document = json(folder.path(), &arguments, 0);
    assert_eq!(
        document["estimate"]["modes_used"],
        serde_json::json!([1, 2, 3, 4])
    );
    let pairs = &document["estimate"]["pairs"];
    let (kx, ky) = (number(&pairs["kx"]), number(&pairs["ky"]));
    // Worked out independently, to these digits; the paper rounds its lambdas and has 969.8, 1.272.
    assert!((kx - 970.5).abs() < 0.1, "Kx {kx}");
    assert!((ky - 1.251).abs() < 1e-3, "Ky {ky}");
    // No uncertainty of the frequencies was stated: the misfit is all that is known of it.
    let kx = &document["estimate"]["kx"];
    assert_eq!(kx["std"], kx["std_scaled"]);
    let kx = number(&pairs["kx"]);
    let used: Vec<bool> = document["prediction"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|row| row["measured"].is_number())
        .map(|row| row["used"] == true)
        .collect();
    assert_eq!(used, [true, true, true, true, false]);
    let bounded = [&arguments[..], &["--half-line", "0.125"]].concat();
    let document = json(folder.path(), &bounded, 0);
    assert_eq!(&document["estimate"]["pairs"], pairs, "bounds moved it");
    let alone = [&bounded[..], &["--method", "pairs"]].concat();
    let document = json(folder.path(), &alone, 0);
    assert_eq!(document["estimate"]["method"], "pairs");
    assert_eq!(&document["estimate"]["pairs"], pairs, "the method moved it");
    // Bounds of 0.1 to 0.7 % leave Kx open to some percent.
    let std = number(&document["estimate"]["kx"]["std"]) / kx;
    assert!((0.002..0.1).contains(&std), "{std}");
}

/// The description above with these lines at its end, and the frequencies of table 4.
fn identified(description: &str, more: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("test.toml"), description).unwrap();
    let table_4 = [
        "identify",
        "test.toml",
        "--frequencies",
        "17,118,335.625,628.75,994.5",
    ];
    json(folder.path(), &[&table_4[..], more].concat(), 0)
}

fn codes(document: &Value) -> Vec<&str> {
    let warnings = document["warnings"].as_array().unwrap();
    warnings
        .iter()
        .map(|warning| warning["code"].as_str().unwrap())
        .collect()
}

#[test]
fn val_the_consistent_estimate_from_the_frequencies_of_table_4() {
    let description = format!("{TEST}beam = \"euler\"\n[analysis]\nweights = \"relative\"\n");
    let document = identified(&description, &[]);
    let estimate = &document["estimate"];
    assert_eq!(estimate["method"], "consistent");
    let (kx, ky) = (&estimate["kx"], &estimate["ky"]);
    // Computed by independent least squares with scipy: 1415.0 and 4.830.
    assert!((number(&kx["value"]) - 1415.0).abs() < 2.0, "Kx {kx}");
    assert!((number(&ky["value"]) - 4.830).abs() < 0.005, "Ky {ky}");
    // Student's t with three degrees of freedom on the logarithm.
    let half = (number(&kx["high"]) / number(&kx["low"])).ln() / 2.0;
    let std = number(&kx["std"]) / number(&kx["value"]);
    assert!((half / std - 3.1824).abs() < 1e-3, "{kx}");
    assert_eq!(kx["std"], kx["std_scaled"]);
    let values = estimate["identifiability"]["singular_values"].as_array();
    assert_eq!(values.unwrap().len(), 2);
    assert_eq!(estimate["correlations"].as_array().unwrap().len(), 1);
}

#[test]
fn val_a_model_that_misses_the_frequencies_says_so() {
    let description = format!("{TEST}beam = \"euler\"\n");
    let document = identified(&description, &["--half-line", "0.125"]);
    assert!(codes(&document).contains(&"misfit"), "{document}");
    let estimate = &document["estimate"];
    assert!(number(&estimate["goodness_of_fit"]) < 0.01);
    for key in ["kx", "ky"] {
        // Frequencies that the model misses by many times their bounds widen the stiffness likewise.
        let (std, alone) = (
            &estimate[key]["std"],
            &estimate[key]["from_readings"]["std"],
        );
        assert!(number(std) > 3.0 * number(alone), "{}", estimate[key]);
    }
}

#[test]
fn limit_known_stiffnesses_are_held() {
    let held = format!("{TEST}beam = \"euler\"\nkt = \"rigid\"\n");
    let document = identified(&held, &[]);
    let estimate = &document["estimate"];
    assert_eq!(estimate["kt"], Value::Null, "nothing was fitted of it");
    assert!(number(&estimate["kr"]["value"]) > 0.0);
    let all = format!("{TEST}beam = \"euler\"\nkt = 2e6\nkr = 1230\n");
    let document = identified(&all, &[]);
    assert_eq!(document["estimate"]["method"], "pairs");
    assert!(codes(&document).contains(&"fallback"), "{document}");
}

#[test]
fn recover_a_free_beams_modulus() {
    // Euler: lambda 4.730041, 7.853205, 10.995608 of a free beam.
    let free = TEST.replace("cantilever", "free");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.toml");
    fs::write(&path, format!("{free}beam = \"euler\"\n")).unwrap();
    let predicted = |arguments: &[&str]| -> Vec<f64> {
        let document = json(folder.path(), arguments, 0);
        let rows = document["prediction"].as_array().unwrap().clone();
        rows.iter().map(|row| number(&row["predicted"])).collect()
    };
    let list = predicted(&["predict", "test.toml", "--modes", "4"]);
    let list: Vec<String> = list.iter().map(f64::to_string).collect();
    // A beam twice as heavy with the same frequencies is twice as stiff.
    let twice = free.replace("7850", "15700");
    fs::write(&path, format!("{twice}beam = \"euler\"\n")).unwrap();
    let frequencies = list.join(",");
    let arguments = ["identify", "test.toml", "--frequencies", &frequencies];
    let document = json(folder.path(), &arguments, 0);
    let estimate = &document["estimate"];
    assert_eq!(estimate["method"], "consistent");
    let modulus = number(&estimate["modulus"]["value"]);
    // Rounding alone.
    assert!((modulus / 414e9 - 1.0).abs() < 1e-8, "E {modulus}");
    assert_eq!(estimate["density"], Value::Null, "only the ratio is known");
    let closed = number(&estimate["free_beam"]["modulus"]);
    assert!(
        (modulus / closed - 1.0).abs() < 1e-8,
        "closed form {closed}"
    );
}

#[test]
fn regress_perturb_changes_by_what_was_asked() {
    let folder = paper_cantilever();
    let arguments = [
        "perturb",
        "test.toml",
        "--frequencies",
        "17,118,335.625,628.75,994.5",
        "--half-line",
        "0.125,0.125,0.5,0.5,0.5",
        "--percent",
        "0.2",
    ];
    let document = json(folder.path(), &arguments, 0);
    let percents: Vec<f64> = document["perturbation"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| number(&row["percent"]))
        .collect();
    // By both methods.
    assert_eq!(percents.len(), 4, "{percents:?}");
    assert!(
        percents.contains(&0.2) && percents.contains(&-0.2),
        "{percents:?}"
    );
    // All sign patterns of four modes.
    for (index, method) in ["pairs", "consistent"].into_iter().enumerate() {
        let span = &document["resolution_span"][index];
        assert_eq!(span["method"], method, "{document}");
        assert_eq!(span["patterns"], 16, "{document}");
    }
    assert_eq!(
        document,
        json(folder.path(), &arguments, 0),
        "another run, other numbers"
    );
}

#[test]
fn regress_reproduce_sets_every_table_beside_ours() {
    let folder = tempfile::tempdir().unwrap();
    let output = tapjoint(folder.path()).arg("reproduce").assert().code(0);
    let text = String::from_utf8_lossy(&output.get_output().stdout).to_lowercase();
    for table in [
        "table 1a", "table 1b", "table 2", "table 3", "table 4", "table 9", "table 10",
    ] {
        assert!(text.contains(table), "{table} is missing");
    }
    assert!(text.contains("misprint"), "no misprint is named");
    let document = json(folder.path(), &["reproduce"], 0);
    assert_eq!(document["version"], 1);
    assert!(contents(folder.path()).is_empty(), "reproduce wrote files");
}

#[test]
fn regress_spectrum_and_inspect_look_at_one_file() {
    let folder = sample("cantilever");
    let arguments = [
        "spectrum", "low.wav", "--hammer", "1", "--zoom", "0:200", "--block", "2048", "--png",
        "low.png",
    ];
    let document = json(folder.path(), &arguments, 0);
    let recording = &document["recordings"][0];
    assert_eq!(recording["line_spacing"], 0.25, "{recording}");
    let modes = document["modes"].as_array().unwrap();
    // The paper's cantilever on this joint: the first two modes lie below 200 Hz.
    assert_eq!(modes.len(), 2, "{modes:?}");
    let picture = fs::read(folder.path().join("low.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG\r\n"));
    let document = json(folder.path(), &["inspect", "low.wav", "high.wav"], 0);
    let recordings = document["recordings"].as_array().unwrap();
    assert_eq!(recordings.len(), 2);
    for recording in recordings {
        assert_eq!(
            recording["taps"].as_array().unwrap().len(),
            5,
            "{recording}"
        );
    }
}

#[test]
fn regress_known_stiffnesses_without_a_measured_mode_are_no_answer() {
    let folder = tempfile::tempdir().unwrap();
    let quiet: Vec<Vec<f64>> = vec![
        vec![0.0; 8000],
        (0..8000).map(|n| 1e-6 * (n % 7) as f64).collect(),
    ];
    tapjoint::recording::write_wav(
        &folder.path().join("quiet.wav"),
        2000,
        &quiet,
        tapjoint::recording::WavFormat::Float32,
    )
    .unwrap();
    let text = "
        [beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850
        [joint]\nkind = \"cantilever\"\nkt = 1.4e6\nkr = 320
        [hammer]\nchannel = 1
        [[sensor]]\nname = \"A\"\nchannel = 2\nposition = 0.3
        [[recording]]\nfile = \"quiet.wav\"\ntorque = \"12 N m\"\ndate = \"2020-05-17\"";
    std::fs::write(folder.path().join("test.toml"), text).unwrap();
    let output = tapjoint(folder.path())
        .args(["run", "test.toml", "--json", "-"])
        .assert()
        .code(1)
        .get_output()
        .stdout
        .clone();
    let document: Value = serde_json::from_slice(&output).unwrap();
    // What the description says of a recording is carried along.
    assert_eq!(document["recordings"][0]["torque"], 12.0);
    assert_eq!(document["recordings"][0]["date"], "2020-05-17");
}

#[test]
fn regress_a_band_that_does_not_fit_names_the_line_of_its_recording() {
    let folder = tempfile::tempdir().unwrap();
    let noise: Vec<Vec<f64>> = vec![(0..4000).map(|n| 1e-3 * (n % 5) as f64).collect(); 2];
    tapjoint::recording::write_wav(
        &folder.path().join("a.wav"),
        1000,
        &noise,
        tapjoint::recording::WavFormat::Float32,
    )
    .unwrap();
    let text = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\n\
                density = 7850\n[joint]\nkind = \"cantilever\"\n[hammer]\nchannel = 1\n[[sensor]]\n\
                name = \"A\"\nchannel = 2\nposition = 0.3\n[[recording]]\nfile = \"a.wav\"\n\
                band = [0, 2000]\n";
    std::fs::write(folder.path().join("test.toml"), text).unwrap();
    tapjoint(folder.path())
        .args(["run", "test.toml"])
        .assert()
        .code(2)
        .stderr(predicate::str::contains(
            "error: test.toml:16: a.wav: the band 0 to 2000 Hz",
        ));
    assert!(!folder.path().join("test-report").exists());
}

/// Answers of two commands on one description.
fn document(description: &str, arguments: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("test.toml"), description).unwrap();
    let output = tapjoint(folder.path()).args(arguments).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{arguments:?}: {error}"))
}

#[test]
fn regress_predict_and_identify_agree_on_a_known_joint_with_everything_fastened_to_it() {
    let lap = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9
        density = 7850\n[beam.right]\nthickness = 0.007\n[joint]\nkind = \"lap\"\nposition = 0.17
        kt = 5e5\nkr = 900\noverlap = { length = 0.04, mass = 0.05 }\n[[sensor]]\nname = \"A\"
        channel = 2\nposition = 0.4\nmass = \"24 g\"\n[measured]\nfrequencies = [100, 200, 400]\n";
    let predicted = document(
        lap,
        &["predict", "test.toml", "--modes", "3", "--json", "-"],
    );
    let compared = document(lap, &["identify", "test.toml", "--json", "-"]);
    for mode in 0..3 {
        let of = |document: &Value| document["prediction"][mode]["predicted"].as_f64().unwrap();
        let (a, b) = (of(&predicted), of(&compared));
        // As fine elements for one mode more or less: 1e-6.
        assert!(
            (a / b - 1.0).abs() < 1e-5,
            "mode {}: {a} and {b} Hz",
            mode + 1
        );
    }
}

#[test]
fn regress_run_diagnoses_with_the_seed_that_diagnose_takes() {
    // Six modes of the strip on a joint of 2e6 N/m and 1230 N m/rad, 1 % high: the last is withheld.
    let text = format!(
        "{TEST}[measured]\nfrequencies = [24.0, 149.5, 417.1, 812.0, 1330.0, 1965.0]\nstd = 0.05\n"
    );
    let closures = |command: &[&str]| {
        let gap = &document(&text, command)["gap"];
        let all = gap["hypotheses"].as_array().unwrap().iter();
        let low = |one: &Value| one["withheld_closure"]["low"].as_f64();
        all.filter_map(low).collect::<Vec<f64>>()
    };
    let run = closures(&["run", "test.toml", "--seed", "7", "--json", "-"]);
    let seven = closures(&["diagnose", "test.toml", "--seed", "7", "--json", "-"]);
    let one = closures(&["diagnose", "test.toml", "--json", "-"]);
    assert_eq!(run, seven);
    assert_ne!(seven, one, "the seed must matter, or nothing is tested");
}

#[test]
fn prop_verbose_tells_more_on_standard_error_alone() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{TEST}beam = \"euler\"\n[measured]\nfrequencies = [17, 118, 335.6]\n");
    fs::write(folder.path().join("test.toml"), text).unwrap();
    let run = |more: &[&str]| {
        let mut command = tapjoint(folder.path());
        let output = command.args(["identify", "test.toml"]).args(more).output();
        let output = output.unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (text(output.stdout), text(output.stderr))
    };
    let (plain, silent) = run(&[]);
    let (told, said) = run(&["-v"]);
    assert_eq!((silent.as_str(), plain), ("", told));
    for part in [
        "modes: 3 peaks, 3 with a number\n",
        "estimate: consistent from modes 1, 2, 3",
        "time: ",
    ] {
        assert!(said.contains(part), "{part:?} in {said:?}");
    }
    assert_eq!(run(&["-v", "-q"]), (String::new(), String::new()));
    // Every tap and peak, of a recording.
    let peaks: Vec<Vec<f64>> = vec![
        (0..8000)
            .map(|n| {
                let t = f64::from(n % 4000) / 2000.0;
                (-4.0 * t).exp() * (std::f64::consts::TAU * 100.0 * t).sin() * 0.5
            })
            .collect(),
    ];
    write_wav(
        &folder.path().join("a.wav"),
        2000,
        &peaks,
        WavFormat::Float32,
    )
    .unwrap();
    let inspected = |more: &str| {
        let output = tapjoint(folder.path())
            .args(["inspect", "a.wav", more])
            .output();
        String::from_utf8(output.unwrap().stderr).unwrap()
    };
    assert!(!inspected("-v").contains("a.wav: tap at"));
    assert!(
        inspected("-vv").contains("a.wav: tap at"),
        "{}",
        inspected("-vv")
    );
}

#[test]
fn regress_a_blind_check_has_cases() {
    let folder = tempfile::tempdir().unwrap();
    tapjoint(folder.path())
        .args(["blind-check", "--cases", "0"])
        .assert()
        .code(2)
        .stderr(predicate::str::contains("0 is not in 1.."));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn regress_a_plan_is_told_without_the_targets_of_whole_tests() {
    let folder = tempfile::tempdir().unwrap();
    let recording = "[hammer]\nchannel = 1\n[[sensor]]\nname = \"A\"\nchannel = 2\nposition = 0.338\n[[recording]]\nfile = \"a.wav\"\ntap = 0.385\n";
    let joint = TEST.replace("[joint]\n", "[joint]\nkt = 1.4e6\nkr = 400\n");
    let text = format!("{joint}{recording}");
    fs::write(folder.path().join("test.toml"), &text).unwrap();
    let done = tapjoint(folder.path())
        .args(["plan", "test.toml", "--draws", "1", "--modes", "3"])
        .assert()
        .code(0);
    let said = String::from_utf8(done.get_output().stdout.clone()).unwrap();
    for unwanted in ["MISSED", "target", "0/0", "outside: named", "two: both"] {
        assert!(!said.contains(unwanted), "{unwanted} in:\n{said}");
    }
    assert!(said.contains("first: the diagnosis puts"), "{said}");
}

#[test]
fn regress_plan_checks_its_joint_as_every_command_does() {
    let plan = |text: &str, more: &[&str], says: &str| {
        let arguments = [&["plan", "test.toml"], more].concat();
        refused(text, &arguments, &[says]);
    };
    let free = TEST.replace("cantilever", "free");
    plan(
        &free,
        &["--kx", "5", "--ky", "1"],
        "a free beam has no joint",
    );
    plan(
        TEST,
        &["--kx", "0", "--ky", "1"],
        "--kx 0.0: give a number from 1e-6 on, and finite",
    );
    plan(
        TEST,
        &["--kx", "inf", "--ky", "1"],
        "--kx inf: give a number from 1e-6 on, and finite",
    );
    plan(TEST, &["--std", "1e9"], "give percent above 0, at most 10");
    let coupled = ["--kx", "5", "--ky", "1", "--kz", "9"];
    plan(TEST, &coupled, "write model = \"3p\"");
    plan(
        TEST,
        &["--kx", "500", "--ky", "1", "--kz", "9"],
        "a source of energy",
    );
}

#[test]
fn regress_one_unreadable_test_does_not_end_a_blind_check() {
    let folder = tempfile::tempdir().unwrap();
    let add = |name: &str| {
        let own = folder.path().join("tests").join(name);
        fs::create_dir_all(&own).unwrap();
        let text = "[beam]\nlength = \"423 mm\"\nwidth = \"40 mm\"\nthickness = \"5 mm\"\n\
                    modulus = \"207 GPa\"\ndensity = 7850\n[joint]\nkind = \"cantilever\"\n\
                    [hammer]\nchannel = 1\n[[recording]]\nfile = \"lost.wav\"\n";
        fs::write(own.join("test.toml"), text).unwrap();
    };
    add("bad");
    add("unlisted");
    let truth = r#"[{"name": "bad", "effects": ["joint_mass"], "params": {}}]"#;
    fs::write(folder.path().join("truth.json"), truth).unwrap();
    let arguments = [
        "blind-check",
        "--folder",
        "tests",
        "--truth",
        "truth.json",
        "--out",
        "out",
    ];
    let output = tapjoint(folder.path()).args(arguments).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).replace('\n', " ");
    assert!(output.status.success(), "{told}");
    for part in [
        "the test \"bad\" could not be diagnosed",
        "lost.wav",
        "unlisted",
        "did you mean `joint-mass`?",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
    assert!(folder.path().join("out").is_dir());
}
