//! Files as laboratories make them, through the program: variables of MATLAB files, spectra, and `init` on files.

use assert_cmd::Command;
use predicates::prelude::*;
use serde_json::Value;
use std::fs;
use std::path::Path;

use crate::shared::data;

fn tapjoint(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("tapjoint").unwrap();
    command.current_dir(folder);
    command
}

#[test]
fn val_variables_of_a_matlab_file_are_named_on_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/signal/tests/data/scipy.mat");
    fs::copy(file, folder.path().join("taps.mat")).unwrap();
    let names = [
        "--variable",
        "samples=data",
        "--variable",
        "time=t",
        "--json",
        "-",
    ];
    let done = tapjoint(folder.path())
        .args(["inspect", "taps.mat"])
        .args(names)
        .assert();
    let document: Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
    assert_eq!(document["recordings"][0]["sample_rate"], 1280.0);
    assert_eq!(document["recordings"][0]["channels"], 2);
    for (arguments, parts) in [
        (
            &[][..],
            &["data (64 x 2, single)", "samples = \"data\""][..],
        ),
        (
            &["--variable", "samples=dat"],
            &["no variable \"dat\"", "did you mean \"data\""],
        ),
        (
            &["--variable", "sample=data"],
            &["\"sample\" is no role", "samples, time"],
        ),
    ] {
        let done = tapjoint(folder.path())
            .args(["spectrum", "taps.mat"])
            .args(arguments)
            .assert()
            .code(2);
        let error = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        for part in parts {
            assert!(error.contains(part), "{error}");
        }
    }
}

/// A tap every second: a short pulse, and a response that rings.
fn taps() -> String {
    let mut text = String::from("time (ms);Hammer (N);Tip (g)\n");
    for index in 0..12_000 {
        let after = f64::from(index % 3000 - 300);
        let force = (-(after / 3.0).powi(2)).exp();
        let rings = if after > 0.0 {
            (-after / 300.0).exp() * (0.3 * after).sin()
        } else {
            0.0
        };
        text.push_str(&format!(
            "{:.2};{force:.5};{rings:.5}\n",
            f64::from(index) / 3.0
        ));
    }
    text
}

#[test]
fn regress_init_writes_what_the_files_hold() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("taps.csv"), taps()).unwrap();
    let rows: String = (1..200)
        .map(|line| format!("{line}\t{}\t{}\n", -60.0 - f64::from(line % 9), line % 170))
        .collect();
    fs::write(
        folder.path().join("frf.txt"),
        format!("Frequency\tMagnitude\tPhase\n{rows}"),
    )
    .unwrap();
    let done = tapjoint(folder.path())
        .args(["init", "taps.csv", "frf.txt", "missing.wav"])
        .assert()
        .code(0);
    let done = done.stderr(predicate::str::contains("missing.wav: cannot be read"));
    let text = String::from_utf8(done.get_output().stdout.clone()).unwrap();
    for part in [
        "# EXAMPLES: the files do not say what the beam is.",
        "[hammer]\nchannel = 1                    # Hammer, N, found by its name\n",
        "[[sensor]]\nname = \"Tip\"\nchannel = 2                    # Tip, m/s2\nkind = \"acceleration\"",
        "file = \"taps.csv\"\n# band = [0, 1172]             # Hz, zoom band; the file has 2 channels at 3000 Hz\n",
        "file = \"frf.txt\"\n",
        "form = \"accelerance\"           # the file does not say: or \"mobility\", \"receptance\"\n",
        "# not read: missing.wav: cannot be read",
    ] {
        assert!(text.contains(part), "{part:?} is missing in\n{text}");
    }
    let done = tapjoint(folder.path())
        .args(["init", "taps.csv"])
        .assert()
        .code(0);
    fs::write(folder.path().join("test.toml"), &done.get_output().stdout).unwrap();
    // One mode is too few for a joint; that is said.
    let done = tapjoint(folder.path())
        .args(["run", "test.toml", "--quiet"])
        .assert();
    let code = done.get_output().status.code();
    assert!(matches!(code, Some(0 | 1)), "{code:?}");
}

/// A description of the clamped steel beam whose spectrum LabVIEW wrote. The band leaves out 191.74 Hz, which belongs
/// to no bending mode.
fn clamped(joint: &str, fit: &str) -> String {
    let file = data("usc_cantilever/FFT_data.lvm");
    let file = file.display();
    let recording = |band: &str| {
        format!("[[recording]]\nfile = '{file}'\nform = \"spectrum\"\nband = {band}\n")
    };
    format!(
        "[beam]\nlength = \"759 mm\"\nwidth = \"50.66 mm\"\nthickness = \"5.14 mm\"\nmodulus = \"200 GPa\"\ndensity = 7850\ntolerance = \"exact\"\n\
         [joint]\nkind = \"cantilever\"\nbeam = \"euler\"\n{joint}\n{}{}[analysis]\nweights = \"relative\"\n{fit}\n",
        recording("[2, 180]"),
        recording("[200, 450]")
    )
}

/// The three fits that the publisher's figures allow: 2.4 kN m/rad; 167.5 GPa; 186.6 GPa with 4.1 kN m/rad.
#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_a_clamped_beam_from_a_spectrum_alone() {
    let cases = [
        ("kt = \"rigid\"", "", "kr", 2400.0),
        (
            "kt = \"rigid\"\nkr = \"rigid\"",
            "fit = [\"modulus\"]",
            "modulus",
            167.5e9,
        ),
        (
            "kt = \"rigid\"",
            "fit = [\"kr\", \"modulus\"]",
            "modulus",
            186.6e9,
        ),
        (
            "kt = \"rigid\"",
            "fit = [\"kr\", \"modulus\"]",
            "kr",
            4100.0,
        ),
    ];
    for (joint, fit, parameter, expected) in cases {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("test.toml"), clamped(joint, fit)).unwrap();
        let done = tapjoint(folder.path())
            .args(["run", "test.toml", "--json", "report.json", "--full"])
            .assert()
            .code(0);
        let text = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
        assert_eq!(
            text.contains("Correlation of Kr and E"),
            fit.contains("kr"),
            "{text}"
        );
        let report = fs::read(folder.path().join("report.json")).unwrap();
        let document: Value = serde_json::from_slice(&report).unwrap();
        let value = document["estimate"][parameter]["value"].as_f64().unwrap();
        // Two digits are published; the frequencies differ by some hundredths of a line.
        assert!(
            (value / expected - 1.0).abs() < 0.02,
            "{parameter}: {value} {expected}"
        );
    }
}
