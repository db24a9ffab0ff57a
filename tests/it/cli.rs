//! Tests of the command line: exit codes, messages, and what is written where.

use assert_cmd::Command;
use predicates::prelude::*;
use std::fs;
use std::path::Path;
use tapjoint::description::{JointKind, TestDescription};

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
        ("cantilever", JointKind::Cantilever),
        ("lap", JointKind::Lap),
        ("free", JointKind::Free),
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
        "identify",
        "predict",
        "perturb",
        "reproduce",
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
            &["no small change"],
        ),
        (
            &["spectrum", "a.wav", "--zoom", "200:0"],
            &["ascending", "0:200"],
        ),
        (
            &["spectrum", "a.wav", "--zoom", "200"],
            &["there is no colon"],
        ),
        (&["spectrum", "a.wav", "--block", "8"], &["16..=10000000"]),
        (&["spectrum", "a.wav"], &["a.wav: cannot be read"]),
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
        &["test.toml: is a file, a folder is wanted"],
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
