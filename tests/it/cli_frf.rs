//! Tests of `tapjoint frf`: what it prints, writes and refuses.

use assert_cmd::Command;
use predicates::prelude::*;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fs;
use std::path::Path;
use tapjoint::recording::{WavFormat, write_wav};
use tapjoint::simulate::{SimulatedMode, TapTestSettings, simulate_tap_test};
use tempfile::TempDir;

fn frf(folder: &Path, arguments: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("tapjoint").expect("cargo builds the program for tests");
    command
        .current_dir(folder)
        .arg("frf")
        .args(arguments)
        .assert()
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let mut all = arguments.to_vec();
    all.extend(["--json", "-"]);
    let run = frf(folder, &all).code(0);
    serde_json::from_slice(&run.get_output().stdout).unwrap()
}

fn text(folder: &Path, arguments: &[&str]) -> String {
    let run = frf(folder, arguments).code(0);
    let output = String::from_utf8(run.get_output().stdout.clone()).unwrap();
    // Lines are broken anywhere between words.
    output.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn numbers(value: &Value) -> Vec<Option<f64>> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(Value::as_f64)
        .collect()
}

/// The committed virtual test.
fn sample() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let origin = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings/cantilever");
    for name in ["test.toml", "low.wav", "high.wav"] {
        fs::copy(origin.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

/// `taps.wav`: hammer (100 N at full scale) and a sensor (500 m/s2) on one mode, so many taps.
fn bare(taps: usize) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mode = SimulatedMode {
        frequency: 60.0,
        damping_ratio: 0.01,
        shape_at_tap: 1.0,
        shape_at_sensors: vec![1.5],
    };
    let settings = TapTestSettings {
        sample_rate: 2048.0,
        taps,
        interval: 3.0,
        ..TapTestSettings::default()
    };
    let test = simulate_tap_test(&[mode], &settings, 3);
    let scaled = |samples: &[f64], full: f64| samples.iter().map(|x| x / full).collect();
    let channels: Vec<Vec<f64>> = vec![
        scaled(&test.force, 100.0),
        scaled(&test.responses[0], 500.0),
    ];
    write_wav(
        &folder.path().join("taps.wav"),
        2048,
        &channels,
        WavFormat::Float32,
    )
    .unwrap();
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn regress_every_mode_lies_within_the_band() {
    // With these scales a pole without a peak was damped so much that its natural frequency lay at 14.5 kHz,
    // in a recording of 2560 samples in a second.
    let folder = sample();
    let scales = ["--hammer", "1", "--scale-hammer", "100", "--scale-sensor"];
    for scale in ["500", "1"] {
        let document = json(
            folder.path(),
            &[&["low.wav"][..], &scales[..], &[scale]].concat(),
        );
        let modes = document["modes"].as_array().unwrap();
        assert!(modes.len() >= 4, "{modes:?}");
        for mode in modes {
            let frequency = mode["frequency"].as_f64().unwrap();
            assert!(frequency > 0.0 && frequency <= 1000.0, "{mode}");
            let damping = mode["damping"].as_f64().unwrap();
            assert!(damping < 0.2, "{mode}");
        }
    }
}

#[test]
fn regress_a_described_test_gives_every_function_with_its_form() {
    let folder = sample();
    let document = json(
        folder.path(),
        &["test.toml", "--png", "f.png", "--csv", "f.csv"],
    );
    assert_eq!(
        names(folder.path()),
        [
            "f-high.png",
            "f-low.png",
            "f.csv",
            "high.wav",
            "low.wav",
            "test.toml"
        ]
    );
    let frfs = document["frfs"].as_array().unwrap();
    assert_eq!(frfs.len(), 4, "two recordings of two sensors");
    for frf in frfs {
        assert_eq!(frf["form"], "accelerance");
        assert_eq!(frf["unit"], "(m/s2)/N");
        assert_eq!(frf["estimator"], "H1");
        assert_eq!(frf["averages"], 5);
        assert_eq!(numbers(&frf["coherence"]).len(), 801);
        for found in frf["resonances"].as_array().unwrap() {
            let coherence = found["coherence"].as_f64().unwrap();
            let error = found["random_error"].as_f64().unwrap();
            // Noise leaves next to nothing on a resonance, but near a node of a sensor.
            assert!(coherence > 0.5 && coherence <= 1.0, "{found}");
            let expected = ((1.0 - coherence) / (10.0 * coherence)).sqrt();
            assert!((error - expected).abs() < 1e-6, "{found}");
        }
    }
    let modes = document["recordings"][0]["modes"].as_array().unwrap();
    assert!(
        modes
            .iter()
            .all(|mode| mode["coherence"].as_f64() > Some(0.99))
    );
    assert!(document.get("estimate").is_none(), "no model was asked for");
    let table = fs::read_to_string(folder.path().join("f.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + 4 * 801);
    assert!(table.starts_with("recording,response,form,unit,frequency_Hz,h1_real"));
    for picture in ["f-low.png", "f-high.png"] {
        let bytes = fs::read(folder.path().join(picture)).unwrap();
        assert!(bytes.starts_with(b"\x89PNG\r\n"), "{picture}");
    }
}

#[test]
fn prop_forms_differ_by_powers_of_omega() {
    let folder = sample();
    let of = |form| json(folder.path(), &["test.toml", "--form", form])["frfs"][0].clone();
    let [measured, wanted] = ["accelerance", "receptance"].map(of);
    assert_eq!(wanted["unit"], "m/N");
    let frequency = numbers(&measured["frequency"]);
    let (real, of_real) = (numbers(&measured["real"]), numbers(&wanted["real"]));
    assert_eq!(of_real[0], None, "0 Hz has nothing to integrate from");
    for line in 1..frequency.len() {
        let omega = TAU * frequency[line].unwrap();
        let expected = -real[line].unwrap() / (omega * omega);
        let error = (of_real[line].unwrap() - expected).abs();
        assert!(error <= 1e-12 * expected.abs(), "line {line}");
    }
}

#[test]
fn regress_units_are_stated_and_never_invented() {
    let folder = bare(3);
    let plain = ["taps.wav", "--hammer", "1"];
    let document = json(folder.path(), &plain);
    assert_eq!(document["frfs"][0]["unit"], "per unit of the file");
    assert_eq!(document["frfs"][0]["form"], Value::Null);
    let words = text(folder.path(), &plain);
    assert!(words.contains("The file states no unit"), "{words}");
    let scaled = [
        &plain[..],
        &["--scale-hammer", "100", "--scale-sensor", "-500"],
    ]
    .concat();
    let found = json(folder.path(), &scaled)["frfs"][0].clone();
    assert_eq!(found["unit"], "(m/s2)/N");
    let ratio = |name: &str| {
        let first = &document["frfs"][0][name];
        numbers(&found[name])[300].unwrap() / numbers(first)[300].unwrap()
    };
    // -500 m/s2 and 100 N for one unit each, whatever the sensor's direction.
    for name in ["real", "imaginary"] {
        assert!((ratio(name) + 5.0).abs() < 1e-9, "{name}: {}", ratio(name));
    }
    let sound = [&scaled[..], &["--sensor-kind", "sound"]].concat();
    let found = json(folder.path(), &sound);
    assert_eq!(found["frfs"][0]["unit"], "Pa/N");
    assert_eq!(found["frfs"][0]["form"], Value::Null);
    let mobility = [
        &scaled[..],
        &["--sensor-kind", "displacement", "--form", "mobility"],
    ]
    .concat();
    assert_eq!(json(folder.path(), &mobility)["frfs"][0]["unit"], "(m/s)/N");
}

#[test]
fn recover_the_accelerance_of_a_known_mode() {
    let folder = bare(3);
    let document = json(
        folder.path(),
        &[
            "taps.wav",
            "--hammer",
            "1",
            "--scale-hammer",
            "100",
            "--scale-sensor",
            "500",
        ],
    );
    let found = &document["frfs"][0];
    let resonance = &found["resonances"][0];
    // Accelerance at resonance: -omega^2 phi_tap phi_sensor/(2 j zeta omega^2) = 75 j (m/s2)/N.
    let magnitude = resonance["magnitude"].as_f64().unwrap();
    let line = resonance["line_frequency"].as_f64().unwrap() / 60.0;
    let expected = 1.5 * line * line / (1.0 - line * line).hypot(0.02 * line);
    // The pulse between samples is a straight line (0.3 % at 60 Hz), the record is cut where 1 % is left
    // at most.
    assert!(
        (magnitude / expected - 1.0).abs() < 0.015,
        "{magnitude} for {expected}"
    );
    for estimator in ["h2", "hv"] {
        let arguments = ["taps.wav", "--hammer", "1", "--estimator", estimator];
        let named = json(folder.path(), &arguments)["frfs"][0]["estimator"].clone();
        assert_eq!(named.as_str().unwrap().to_lowercase(), estimator);
    }
}

#[test]
fn regress_one_average_has_no_coherence() {
    let folder = bare(1);
    let arguments = ["taps.wav", "--hammer", "1", "--csv", "f.csv"];
    let document = json(folder.path(), &arguments);
    assert_eq!(document["frfs"][0]["coherence"], Value::Null);
    assert_eq!(document["frfs"][0]["random_error"], Value::Null);
    let mode = &document["recordings"][0]["modes"][0];
    assert_eq!(mode["coherence"], Value::Null);
    assert_eq!(mode["random_error"], Value::Null);
    assert_eq!(document["recordings"][0]["averages"], 1);
    let table = fs::read_to_string(folder.path().join("f.csv")).unwrap();
    assert!(
        table.lines().skip(1).all(|line| line.ends_with(",,")),
        "not empty"
    );
    let words = text(folder.path(), &arguments);
    assert!(words.contains("One average: no coherence"), "{words}");
}

#[test]
fn limit_without_taps_there_is_no_function() {
    let folder = tempfile::tempdir().unwrap();
    let quiet: Vec<Vec<f64>> = vec![vec![0.0; 8000], vec![1e-6; 8000]];
    write_wav(
        &folder.path().join("q.wav"),
        2000,
        &quiet,
        WavFormat::Float32,
    )
    .unwrap();
    let arguments = ["q.wav", "--hammer", "1", "--png", "q.png", "--csv", "q.csv"];
    frf(folder.path(), &arguments)
        .code(1)
        .stderr(predicate::str::contains("no tap was accepted"));
    assert_eq!(names(folder.path()), ["q.wav"]);
}

/// A file that `frf` wrote is read again, and a report of it shows its curves: the picture of a file's functions is
/// that of the functions themselves.
#[test]
fn regress_a_file_of_functions_has_its_curves() {
    let folder = bare(3);
    let first = ["taps.wav", "--hammer", "1", "--uff58b", "frf.uff"];
    let written = json(folder.path(), &first);
    let read = json(folder.path(), &["frf.uff", "--png", "again.svg"]);
    let values = |document: &Value| numbers(&document["frfs"][0]["imaginary"]);
    assert_eq!(values(&written), values(&read));
    // The longest line of a picture, in characters.
    let longest = |name: &str| {
        let svg = fs::read_to_string(folder.path().join(name)).unwrap();
        let drawn = svg.split_once("</defs>").unwrap().1;
        let lines = drawn.split(" d=\"").skip(1);
        let lengths = lines.map(|rest| rest.split('"').next().map_or(0, str::len));
        lengths.max().unwrap_or(0)
    };
    Command::cargo_bin("tapjoint")
        .unwrap()
        .current_dir(folder.path())
        .args(["run", "frf.uff", "--out", "report", "-q"])
        .assert()
        .success();
    // Some 800 points of a curve; axes and marks have a few characters.
    for name in ["again.svg", "report/frf-frf.svg"] {
        assert!(longest(name) > 800, "{name}: {}", longest(name));
    }
    // There is no spectrum of what was never recorded.
    assert!(!folder.path().join("report/spectrum-frf.png").exists());
    frf(folder.path(), &["frf.uff", "--sensor", "2"])
        .code(2)
        .stderr(predicate::str::contains("--sensor is for samples in time"));
}

#[test]
fn regress_bad_usage_is_refused_and_nothing_written() {
    let folder = sample();
    let bare = [
        "low.wav", "--hammer", "1", "--png", "x.png", "--csv", "x.csv",
    ];
    let with = |more: &[&'static str]| [&bare[..], more].concat();
    let cases: Vec<(Vec<&str>, &str)> = vec![
        (vec!["low.wav", "--png", "x.png"], "--hammer CH"),
        (vec!["low.wav", "--hammer", "7"], "7"),
        (with(&["--sensor", "1"]), "named twice"),
        (with(&["--sensor", "2", "--sensor", "2"]), "named twice"),
        (
            with(&["--scale-sensor", "1,2,3"]),
            "3 numbers for 2 sensors",
        ),
        (with(&["--scale-sensor", "0"]), "0 is no scale"),
        (with(&["--sensor-kind", "velocity"]), "--scale-sensor"),
        (with(&["--form", "mobility"]), "cannot be given as mobility"),
        (with(&["--zoom", "0:9000"]), "half the sample rate"),
        (
            vec!["test.toml", "--hammer", "1"],
            "--hammer is for bare recordings",
        ),
        (
            vec!["test.toml", "--zoom", "0:100"],
            "--zoom is for bare recordings",
        ),
        (
            vec!["low.wav", "--hammer", "1", "--csv", "no/such/f.csv"],
            "cannot be written",
        ),
    ];
    for (arguments, says) in cases {
        frf(folder.path(), &arguments)
            .code(2)
            .stdout("")
            .stderr(predicate::str::contains(says));
        assert_eq!(
            names(folder.path()),
            ["high.wav", "low.wav", "test.toml"],
            "{arguments:?} left something behind"
        );
    }
}

#[test]
fn prop_the_same_bytes_whatever_the_number_of_threads() {
    let folder = sample();
    for threads in ["1", "3"] {
        let file = format!("{threads}.csv");
        frf(
            folder.path(),
            &["test.toml", "--csv", &file, "--threads", threads],
        )
        .code(0);
    }
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("1.csv") == read("3.csv"), "threads change a number");
}
