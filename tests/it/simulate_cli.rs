//! The command `simulate`: recordings that the rest of the program reads, and what it refuses.

use assert_cmd::Command;
use predicates::prelude::*;
use serde_json::Value;
use std::fs;
use std::path::Path;
use tapjoint::effects::EffectId;
use tempfile::TempDir;

use crate::shared::tapped_strip;

const TEST: &str = tapped_strip!(
    r#"[[sensor]]
name = "B"
position = 0.205
[[recording]]
file = "taps.csv"
tap = 0.385
level = 0.9
accept_taps = [1.0]
reject_taps = [3.5]
band = [0, 1000]
"#
);

fn folder(text: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("source.toml"), text).unwrap();
    folder
}

fn tapjoint(folder: &Path) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("tapjoint"));
    command.current_dir(folder);
    command
}

fn simulate(folder: &Path, arguments: &[&str]) {
    tapjoint(folder)
        .args(["simulate", "source.toml", "--out", "out", "--quiet"])
        .args(arguments)
        .assert()
        .code(0)
        .stdout("")
        .stderr("");
}

fn read(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn recover_frequencies_and_damping_of_the_model_from_its_recordings() {
    let folder = folder(TEST);
    let quiet = [
        "--ideal",
        "--damping",
        "0.4%,0.3%,0.25%",
        "--taps",
        "3",
        "--seconds",
        "12",
        "--bits",
        "32",
    ];
    simulate(folder.path(), &quiet);
    tapjoint(folder.path())
        .args(["run", "out/test.toml", "--out", "report", "--quiet"])
        .assert()
        .code(0);
    let truth = read(&folder.path().join("out/truth.json"));
    let report = read(&folder.path().join("report/report.json"));
    let modes = report["modes"].as_array().unwrap();
    let expected = truth["recordings"][0]["modes"].as_array().unwrap();
    let read: Vec<&Value> = modes
        .iter()
        .filter(|mode| mode["method"] == "fit")
        .collect();
    assert_eq!(read.len(), 5, "{modes:?}");
    for (mode, truth) in read.iter().zip(expected) {
        let [found, wanted] = [*mode, truth].map(|mode| number(&mode["frequency"]));
        assert!(
            (found / wanted - 1.0).abs() < 1e-5,
            "{found} for {wanted} Hz"
        );
        let [found, wanted] = [*mode, truth].map(|mode| number(&mode["damping"]));
        assert!(
            (found / wanted - 1.0).abs() < 1e-3,
            "damping {found} for {wanted}"
        );
    }
    for stiffness in ["kt", "kr"] {
        let [found, wanted] = [
            &report["estimate"][stiffness]["value"],
            &truth["joint"][stiffness],
        ]
        .map(number);
        // 2e-5 of a frequency is some 1e-4 of a stiffness.
        assert!(
            (found / wanted - 1.0).abs() < 1e-3,
            "{stiffness}: {found} for {wanted}"
        );
    }
}

#[test]
fn regress_the_folder_holds_what_a_user_believes_and_the_truth_beside_it() {
    let folder = folder(TEST);
    let short = ["--taps", "1", "--seconds", "0.8"];
    let with = ["--with", "sensor-mass:mass=24g", "--seed", "5"];
    simulate(folder.path(), &[&short[..], &with].concat());
    let out = folder.path().join("out");
    let text = fs::read_to_string(out.join("test.toml")).unwrap();
    assert!(text.contains("file = \"taps.wav\""), "{text}");
    for told in ["kt", "kr =", "mass", "0.024", "level"] {
        assert!(!text.contains(told), "{told} in\n{text}");
    }
    let truth = read(&out.join("truth.json"));
    assert_eq!(truth["seed"], 5);
    assert_eq!(truth["effects"][0]["effect"], "sensor-mass");
    assert_eq!(truth["effects"][0]["parameters"]["mass"], 0.024);
    assert!((number(&truth["joint"]["kx"]) - 1399.836).abs() < 1e-3);
    let bytes = fs::read(out.join("taps.wav")).unwrap();
    fs::remove_dir_all(&out).unwrap();
    simulate(
        folder.path(),
        &[&short[..], &with, &["--no-truth"]].concat(),
    );
    assert!(!out.join("truth.json").exists());
    assert!(
        fs::read(out.join("taps.wav")).unwrap() == bytes,
        "same seed, other bytes"
    );
}

#[test]
fn regress_every_effect_is_listed_in_help_and_reference() {
    let help = tapjoint(Path::new("."))
        .args(["simulate", "--help"])
        .output()
        .unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference.md");
    let reference = fs::read_to_string(reference).unwrap();
    for id in EffectId::ALL {
        let name = id.name();
        // A bias of reading is in no recording.
        let is_listed = help.contains(&format!("\n  {name}: "));
        assert_eq!(is_listed, id != EffectId::Resolution, "{name}");
        let mut rows = reference.lines().filter(|line| line.starts_with("| `"));
        let row = rows.find(|row| row.contains(&format!("`{name}`")));
        let row = row.unwrap_or_else(|| panic!("{name} is not in the reference"));
        for info in id.parameters() {
            let parameter = format!("`{}`", info.name);
            assert!(row.contains(&parameter), "{name}: {parameter}");
        }
    }
}

#[test]
fn regress_the_laboratory_is_printed_and_json_is_the_truth() {
    let folder = folder(TEST);
    tapjoint(folder.path())
        .args([
            "simulate",
            "source.toml",
            "--out",
            "out",
            "--seconds",
            "0.8",
            "--taps",
            "1",
        ])
        .args(["--without", "hum,mounting", "--json", "truth-again.json"])
        .assert()
        .code(0)
        .stdout(
            predicate::str::contains("mains hum          off")
                .and(predicate::str::contains("mounting           off"))
                .and(predicate::str::contains("AC coupling        0.5 Hz"))
                .and(predicate::str::contains("taps.wav")),
        );
    let [json, truth] =
        ["truth-again.json", "out/truth.json"].map(|file| read(&folder.path().join(file)));
    assert_eq!(json["truth"], truth);
}

#[test]
fn regress_a_hanging_beam_is_described_above_its_suspension() {
    let lap = TEST
        .replace("cantilever", "lap")
        .replace("band = [0, 1000]", "");
    let folder = folder(&lap);
    simulate(folder.path(), &["--taps", "1", "--seconds", "0.8"]);
    let text = fs::read_to_string(folder.path().join("out/test.toml")).unwrap();
    assert!(text.contains("band = [10.0, 2000.0]"), "{text}");
    simulate(
        folder.path(),
        &["--taps", "1", "--seconds", "0.8", "--without", "suspension"],
    );
    let text = fs::read_to_string(folder.path().join("out/test.toml")).unwrap();
    assert!(!text.contains("band"), "{text}");
}

#[test]
fn regress_the_believed_band_does_not_give_a_cable_away() {
    let lap = TEST
        .replace("cantilever", "lap")
        .replace("band = [0, 1000]", "");
    let folder = folder(&lap);
    let short = ["--taps", "1", "--seconds", "0.8"];
    simulate(folder.path(), &short);
    let path = folder.path().join("out/test.toml");
    let bare = fs::read_to_string(&path).unwrap();
    let cable = ["--with", "sensor-cable:stiffness=2000"];
    simulate(folder.path(), &[&short[..], &cable].concat());
    assert_eq!(fs::read_to_string(&path).unwrap(), bare);
}

#[test]
fn regress_bad_orders_are_refused_and_nothing_is_written() {
    let no_joint = TEST.replace("kt = 1.994e6", "");
    let measured = TEST.split("[[recording]]").next().unwrap().to_owned()
        + "[measured]\nfrequencies = [17.0, 118.0]\n";
    let cases: [(&str, &[&str], &str); 12] = [
        (&no_joint, &[], "kt is missing"),
        (&measured, &[], "no recording to simulate"),
        (
            TEST,
            &["--with", "sensor-mas:mass=1"],
            "did you mean `sensor-mass`",
        ),
        (
            TEST,
            &["--with", "sensor-mass:weight=1"],
            "no parameter `weight`",
        ),
        (
            TEST,
            &["--with", "sensor-mass:mas=24g"],
            "no parameter `mas`, did you mean `mass`?",
        ),
        (TEST, &["--with", "sensor-mass:mass"], "has no value"),
        (
            TEST,
            &["--with", "resolution:offset=0.1"],
            "bias of reading",
        ),
        (
            TEST,
            &["--with", "sensor-position:offset=90mm,sensor=1"],
            "give an offset from -0.338 to 0.085 m",
        ),
        (
            TEST,
            &["--with", "sensor-swap:other=3"],
            "other is 3, but the test has 2 sensors",
        ),
        (TEST, &["--rate", "1000"], "band ends at 1000 Hz"),
        (TEST, &["--seconds", "0.6"], "fewer --taps"),
        (TEST, &["--noise=-1"], "'--noise <X>': give a number from 0"),
    ];
    for (text, arguments, words) in cases {
        let folder = folder(text);
        tapjoint(folder.path())
            .args(["simulate", "source.toml", "--out", "out"])
            .args(arguments)
            .assert()
            .code(2)
            .stdout("")
            .stderr(predicate::str::contains(words));
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
        assert_eq!(left.len(), 1, "{arguments:?} left {left:?}");
    }
    let folder = folder(TEST);
    fs::rename(
        folder.path().join("source.toml"),
        folder.path().join("test.toml"),
    )
    .unwrap();
    tapjoint(folder.path())
        .args(["simulate", "test.toml", "--out", "."])
        .assert()
        .code(2)
        .stderr(predicate::str::contains("is an input of this command"));
    assert_eq!(
        fs::read_to_string(folder.path().join("test.toml")).unwrap(),
        TEST
    );
}

#[test]
fn prop_a_described_effect_is_planted_and_not_given_away() {
    let planted = format!("{TEST}\n[[effect]]\nid = \"sensor-mass\"\nmass = 0.02\n");
    let (with, without) = (folder(&planted), folder(TEST));
    let short = ["--seconds", "3", "--taps", "1", "--seed", "5"];
    for one in [&with, &without] {
        simulate(one.path(), &short);
    }
    let text = |folder: &TempDir| fs::read_to_string(folder.path().join("out/test.toml")).unwrap();
    assert_eq!(text(&with), text(&without));
    assert!(!text(&with).contains("effect"));
    let samples = |folder: &TempDir| fs::read(folder.path().join("out/taps.wav")).unwrap();
    assert_ne!(samples(&with), samples(&without));
    // It can be analysed, as a description with effects cannot.
    tapjoint(with.path())
        .args(["inspect", "out/taps.wav", "--quiet"])
        .assert()
        .code(0);
    tapjoint(with.path())
        .args(["run", "source.toml", "--quiet"])
        .assert()
        .code(2);
}

#[test]
fn regress_settings_without_end_are_refused_before_any_work() {
    let folder = folder(TEST);
    for (argument, said) in [
        ("--mounting=1e300", "from 0 to 100000"),
        ("--mains=1e300", "from 0 to 100000"),
        ("--noise=1e300", "from 0 to 1000000000"),
        ("--level=1e-300", "from 0.000001 to 1000000"),
        ("--damping=1e308", "from 0 to 1"),
        ("--rayleigh=1e300,0", "from 0 to 1000000"),
        ("--rate=1000000", "100 to 204800"),
        ("--taps=100000", "do not fit into a WAV file"),
    ] {
        tapjoint(folder.path())
            .args(["simulate", "source.toml", "--out", "out", argument])
            .assert()
            .code(2)
            .stderr(predicate::str::contains(said));
        assert!(!folder.path().join("out").exists(), "{argument}");
    }
}

#[test]
fn regress_a_beam_without_frequencies_in_the_band_is_simulated() {
    // Some million modes lie below the sample rate; only the lowest are computed.
    let soft = TEST.replace("modulus = 207e9", "modulus = 1e5");
    assert_ne!(soft, TEST);
    let folder = folder(&soft);
    tapjoint(folder.path())
        .args(["simulate", "source.toml", "--out", "out"])
        .args(["--taps", "1", "--seconds", "0.6", "--rate", "5120"])
        .assert()
        .code(0);
}
