//! Tests of what is said about bad input: the file, the line, the key, what is allowed, what to do.

use crate::golden::assert_snapshot;
use crate::shared::strip_table;
use std::fs;
use std::path::Path;

use proptest::prelude::*;
use tapjoint::description::*;
use tapjoint::pipeline::{IdentifySettings, run_recording, run_test};
use tapjoint::quantity::{Dimension, QuantityError, STANDARD_GRAVITY, parse_quantity};
use tapjoint::recording::{Channel, Recording};
use tapjoint::report::{document_of, render_json};
use tapjoint::simulate::{SimulatedMode, TapTestSettings, simulate_tap_test};

/// A valid description. Every case changes one piece of it.
const VALID: &str = r#"name = "Clamp"
[beam]
length = "423 mm"
width = 0.05
thickness = 0.005
modulus = "207 GPa"
density = 7850
poisson = 0.29
tolerance = { length = 0.001, modulus = "2 %" }
[joint]
kind = "cantilever"
model = "3p"
kt = "1.4 MN/m"
kr = 320
ktr = 1e5
beam = "euler"
[hammer]
channel = 1
scale = 500.0
[[sensor]]
name = "tip"
channel = 2
sensitivity = "100 mV/g"
position = 0.338
mass = "24 g"
[[sensor]]
name = "mic"
channel = "level"
kind = "sound"
[[recording]]
file = "low.wav"
tap = "40 mm"
band = [0, 200]
block = 2048
at = { tip = 0.20 }
torque = 12
[[recording]]
file = "frf.txt"
form = "mobility"
sensor = "tip"
[analysis]
window = "exponential"
fit_modes = 4
sensor_mass = false
fit = ["modulus"]
"#;

/// The same beam and joint with frequencies instead of recordings.
const MEASURED: &str = r#"[beam]
length = 0.423
width = 0.05
thickness = 0.005
modulus = 207e9
density = 7850
[joint]
kind = "cantilever"
[measured]
frequencies = [17, 118, 335.5]
modes = [1, 2, 4]
half_line = [0.1, 0.1, 0.5]
scatter = "0.3 %"
"#;

/// Makes one change at a time to a valid text, and compares all messages with the snapshot of this name.
fn check(name: &str, base: &str, changes: &[(&str, &str)]) {
    assert!(
        TestDescription::parse(base, "t.toml").is_ok(),
        "the unchanged text must be valid"
    );
    let mut messages = String::new();
    for (from, to) in changes {
        assert_eq!(
            base.matches(from).count(),
            1,
            "{from:?} must stand once in the text"
        );
        let Err(error) = TestDescription::parse(&base.replace(from, to), "t.toml") else {
            panic!("{to:?} was accepted");
        };
        let place = if error.key.is_empty() {
            format!("t.toml:{}: ", error.line)
        } else {
            format!("t.toml:{}: `{}`: ", error.line, error.key)
        };
        let shown = error.to_string();
        assert!(shown.starts_with(&place), "{to:?}: {shown}");
        messages.push_str(&format!("{from:?} -> {to:?}\n    {shown}\n"));
    }
    assert_snapshot(&format!("errors_{name}"), &messages);
}

#[test]
fn regress_unknown_keys_suggest_the_nearest_known_one() {
    check(
        "unknown_keys_suggest_the_nearest_known_one",
        VALID,
        &[
            ("length = \"423", "lenght = \"423"),
            ("width = 0.05", "Width = 0.05"),
            ("density = 7850", "rho = 7850"),
            ("modulus = \"2 %\"", "moduls = \"2 %\""),
            ("width = 0.05", "width = 0.05\nkt = 3"),
            ("scale = 500.0", "position = 0.1"),
            ("torque = 12", "temprature = 12"),
            ("torque = 12", "fit_mode = 12"),
            ("[analysis]", "[analysys]"),
            ("[analysis]", "[zzz]"),
            ("name = \"Clamp\"", "kind = \"lap\""),
        ],
    );
}

#[test]
fn regress_impossible_beams() {
    check(
        "impossible_beams",
        VALID,
        &[
            ("length = \"423 mm\"", "length = -0.423"),
            ("length = \"423 mm\"", "length = 0"),
            ("length = \"423 mm\"", "length = 1e5"),
            ("length = \"423 mm\"", "length = nan"),
            ("length = \"423 mm\"", "length = 99999999999999999999"),
            ("length = \"423 mm\"\n", ""),
            ("length = \"423 mm\"", "length = [1]"),
            ("modulus = \"207 GPa\"", "modulus = -207e9"),
            ("density = 7850", "density = 0"),
            ("length = \"423 mm\"", "length = 1e-300"),
            ("width = 0.05", "width = 1e-300"),
            ("thickness = 0.005", "thickness = 1e-300"),
            ("modulus = \"207 GPa\"", "modulus = 192"),
            ("density = 7850", "density = 7.861"),
            ("modulus = \"207 GPa\"", "modulus = 1e-300"),
            ("density = 7850", "density = 1e-300"),
            ("poisson = 0.29", "poisson = 0.6"),
            ("poisson = 0.29", "poisson = -1"),
            ("modulus = \"2 %\"", "modulus = \"200 %\""),
            ("length = 0.001", "length = -0.001"),
            ("density = 7850", "density = 7850\nright = { width = 1 }"),
        ],
    );
}

#[test]
fn regress_units_that_do_not_fit() {
    check(
        "units_that_do_not_fit",
        VALID,
        &[
            ("\"423 mm\"", "\"423 kg\""),
            ("\"423 mm\"", "\"423 furlong\""),
            ("\"423 mm\"", "\"0,423 m\""),
            ("\"423 mm\"", "\"long\""),
            ("\"423 mm\"", "423 mm"),
            ("\"1.4 MN/m\"", "\"1.4 MN\""),
            ("\"100 mV/g\"", "\"100 mV/N\""),
            ("torque = 12", "torque = \"12 N\""),
        ],
    );
}

#[test]
fn regress_joints_that_cannot_be() {
    check(
        "joints_that_cannot_be",
        VALID,
        &[
            ("\"cantilever\"", "\"cantelever\""),
            ("\"cantilever\"", "\"lap\""),
            ("\"cantilever\"", "\"free\""),
            ("model = \"3p\"", "model = \"2p\""),
            ("model = \"3p\"", "model = \"none\""),
            ("kr = 320", "kr = -320"),
            ("ktr = 1e5", "ktr = 100"),
            ("ktr = 1e5", "ktr = 0"),
            ("kr = 320", "kr = \"rigid\""),
            ("beam = \"euler\"", "position = 0.2"),
            ("kind = \"cantilever\"\n", ""),
        ],
    );
}

#[test]
fn regress_sensors_and_hammers_that_cannot_be() {
    check(
        "sensors_and_hammers_that_cannot_be",
        VALID,
        &[
            ("position = 0.338", "position = 0.5"),
            ("position = 0.338", "position = -0.1"),
            ("mass = \"24 g\"", "mass = -1"),
            ("mass = \"24 g\"", "mass = 24"),
            ("kind = \"sound\"", "kind = \"sound\"\nposition = 1e300"),
            ("\"100 mV/g\"", "1e-300"),
            ("scale = 500.0", "scale = -1e16"),
            ("channel = 2", "channel = 1"),
            ("channel = 2", "channel = 0"),
            ("channel = 2", "channel = 2.5"),
            ("name = \"mic\"", "name = \"tip\""),
            ("name = \"mic\"", "name = \"\""),
            ("\"100 mV/g\"", "0"),
            ("mass = \"24 g\"", "scale = 3"),
            ("channel = 1\n", ""),
            ("kind = \"sound\"", "kind = \"speed\""),
        ],
    );
}

#[test]
fn regress_recordings_and_settings_that_cannot_be() {
    check(
        "recordings_and_settings_that_cannot_be",
        VALID,
        &[
            ("tap = \"40 mm\"", "tap = 0.43"),
            ("band = [0, 200]", "band = [200, 100]"),
            ("band = [0, 200]", "band = [-1, 100]"),
            ("band = [0, 200]", "band = [1]"),
            ("block = 2048", "block = 15"),
            ("block = 2048", "block = -2048"),
            ("block = 2048", "block = 1048577"),
            ("block = 2048", "block = 2048.5"),
            ("block = 2048", "reject_taps = [4.9, 4.9]"),
            ("block = 2048", "reject_taps = [-1]"),
            ("block = 2048", "accept_taps = 4.9"),
            (
                "block = 2048",
                "accept_taps = [\"4.9 s\"]\nreject_taps = [4.82]",
            ),
            ("block = 2048", "accept_taps = [\"4.9 m\"]"),
            (
                "block = 2048",
                "form = \"mobility\"\nsensor = \"tip\"\naccept_taps = [4.9]",
            ),
            ("at = { tip = 0.20 }", "at = { tpi = 0.20 }"),
            ("at = { tip = 0.20 }", "at = { tip = 2 }"),
            ("file = \"low.wav\"\n", ""),
            ("form = \"mobility\"\n", ""),
            ("sensor = \"tip\"\n", ""),
            ("fit_modes = 4", "fit_modes = 0"),
            ("sensor_mass = false", "sensor_mass = 0"),
            ("[\"modulus\"]", "[\"kt\"]"),
            ("[\"modulus\"]", "[\"modulus\", \"modulus\"]"),
            ("[analysis]", "[measured]\nfrequencies = [17]\n[analysis]"),
        ],
    );
}

#[test]
fn regress_tables_without_end_are_refused_at_the_first_too_many() {
    for (key, most, table) in [
        ("sensor", 128, "[[sensor]]\nname = \"A\"\n"),
        ("recording", 1000, "[[recording]]\nfile = \"a.wav\"\n"),
        ("effect", 100, "[[effect]]\nid = \"added-mass\"\n"),
    ] {
        let described = VALID.matches(&format!("[[{key}]]")).count();
        let text = format!("{VALID}{}", table.repeat(100_000));
        let error = TestDescription::parse(&text, "t.toml").unwrap_err();
        assert_eq!(error.key, format!("{key}[{}]", most + 1));
        let line = VALID.lines().count() + 2 * (most - described) + 1;
        assert_eq!(error.line, line, "{error}");
        assert!(
            error.to_string().contains(&format!("up to {most}")),
            "{error}"
        );
    }
}

#[test]
fn regress_frequencies_that_cannot_be() {
    check(
        "frequencies_that_cannot_be",
        MEASURED,
        &[
            ("[17, 118, 335.5]", "[17, -118, 335.5]"),
            ("[17, 118, 335.5]", "[17, 118, 118]"),
            ("[17, 118, 335.5]", "[17,\n118,\n20]"),
            ("[17, 118, 335.5]", "[]"),
            ("[17, 118, 335.5]", "17"),
            ("[1, 2, 4]", "[1, 2]"),
            ("[1, 2, 4]", "[0, 2, 4]"),
            ("[1, 2, 4]", "[1, 4, 2]"),
            ("[0.1, 0.1, 0.5]", "[0.1]"),
            ("[0.1, 0.1, 0.5]", "0"),
            ("scatter", "std = 0.1\nscatter"),
            ("\"0.3 %\"", "\"300 %\""),
        ],
    );
}

#[test]
fn regress_files_of_modes_that_cannot_be() {
    let base = MEASURED
        .replace("frequencies = [17, 118, 335.5]", "file = \"modes.unv\"")
        .replace(
            "scatter",
            "first_node = { number = 3, position = \"30 mm\" }\nscatter",
        );
    check(
        "files_of_modes_that_cannot_be",
        &base,
        &[
            ("file =", "frequencies = [17]\nfile ="),
            ("file = \"modes.unv\"", "frequencies = [17, 118, 335.5]"),
            ("file = \"modes.unv\"", ""),
            ("\"modes.unv\"", "\" \""),
            ("\"modes.unv\"", "55"),
            ("[1, 2, 4]", "[1, 4, 2]"),
            ("[0.1, 0.1, 0.5]", "[]"),
            ("{ number = 3, position = \"30 mm\" }", "3"),
            ("number = 3, ", ""),
            (", position = \"30 mm\"", ""),
            ("number = 3", "number = -3"),
            ("number = 3", "node = 3"),
            ("30 mm", "300 cm"),
        ],
    );
}

#[test]
fn regress_text_that_is_no_toml_names_its_line() {
    for (text, line) in [
        ("[beam", 1),
        ("name = \"a\"\n[beam]\nlength = \n", 3),
        ("name = \"a\"\nname = \"b\"\n", 2),
        ("name = \"a\n\n\n", 1),
        ("x = [1,\n2\n\n\n", 2),
        ("\u{0}", 1),
    ] {
        let error = TestDescription::parse(text, "t.toml").expect_err("no TOML");
        assert_eq!(error.line, line, "{text:?}: {error}");
        assert!(
            error.problem.starts_with("not valid TOML"),
            "{text:?}: {error}"
        );
    }
}

#[test]
fn regress_missing_tables_and_missing_data() {
    let error = TestDescription::parse("", "t.toml").expect_err("nothing there");
    assert_eq!((error.line, error.key.as_str()), (1, "beam"));
    let (bare, _) = MEASURED.split_once("[measured]").unwrap();
    let test = TestDescription::parse(bare, "t.toml").expect("enough for a prediction");
    let error = test
        .check_has_data("t.toml")
        .expect_err("nothing to analyse");
    let shown = error.to_string();
    assert!(shown.starts_with("t.toml:1: nothing to analyse"), "{shown}");
    assert!(
        shown.contains("[[recording]]") && shown.contains("[measured]"),
        "{shown}"
    );
}

#[test]
fn regress_a_message_is_one_readable_line_whatever_it_quotes() {
    let text = VALID.replace("\"cantilever\"", "\"\"\"a\nb\\u001b[31m\"\"\"");
    let shown = TestDescription::parse(&text, "t.toml")
        .expect_err("no kind")
        .to_string();
    assert!(!shown.chars().any(char::is_control), "{shown:?}");
    let text = VALID.replace("\"cantilever\"", &format!("\"{}\"", "x".repeat(100_000)));
    let shown = TestDescription::parse(&text, "t.toml")
        .expect_err("no kind")
        .to_string();
    assert!(shown.len() < 1100, "{} characters", shown.len());
}

#[test]
fn regress_one_message_in_full() {
    let text = VALID.replace("position = 0.338", "position = \"500 mm\"");
    let shown = TestDescription::parse(&text, "dir/test.toml")
        .expect_err("outside")
        .to_string();
    assert_eq!(
        shown,
        "dir/test.toml:24: `sensor[1].position`: 0.5 m is impossible; allowed: 0 to 0.423 m; this is outside the beam: positions run along it from the joint (lap joint, free beam: from the left end)"
    );
}

#[test]
fn val_units_have_their_defined_values() {
    // Exact by definition: inch 25.4 mm, pound 0.45359237 kg, standard gravity 9.80665 m/s2
    // (BIPM SI brochure, 9th edition; international yard and pound agreement of 1959).
    let cases = [
        ("423 mm", Dimension::Length, 0.423),
        ("0.5 in", Dimension::Length, 0.0127),
        ("207 GPa", Dimension::Pressure, 207e9),
        ("210000 N/mm2", Dimension::Pressure, 210e9),
        ("1 psi", Dimension::Pressure, 6_894.757_293_168),
        ("24 g", Dimension::Mass, 0.024),
        ("2 g", Dimension::Acceleration, 2.0 * STANDARD_GRAVITY),
        ("2 %", Dimension::Ratio, 0.02),
        ("7.85 g/cm³", Dimension::Density, 7850.0),
        ("0.1 lb/in3", Dimension::Density, 2_767.990_471_02),
        ("5 kN", Dimension::Force, 5e3),
        ("1.4e3 kN/m", Dimension::TranslationalStiffness, 1.4e6),
        ("320 N·m/rad", Dimension::RotationalStiffness, 320.0),
        (
            "1 N m/deg",
            Dimension::RotationalStiffness,
            57.295_779_513_082,
        ),
        ("-2E1kN / rad", Dimension::CouplingStiffness, -2e4),
        ("10 mV/(m/s²)", Dimension::AccelerationSensitivity, 0.01),
        (
            "100 mV/g",
            Dimension::AccelerationSensitivity,
            0.1 / 9.80665,
        ),
        ("50 mV/Pa", Dimension::PressureSensitivity, 0.05),
        ("293.15 K", Dimension::Temperature, 20.0),
        ("68 °F", Dimension::Temperature, 20.0),
        ("51.2 kHz", Dimension::Rate, 51_200.0),
        ("9 lbf ft", Dimension::Torque, 12.202_361_534_983),
        ("17", Dimension::Frequency, 17.0),
        (" 1_000 µm ", Dimension::Length, 1e-3),
        ("\u{2212}3 mm", Dimension::Length, -3e-3),
        (".5 m", Dimension::Length, 0.5),
    ];
    for (text, dimension, expected) in cases {
        let found = parse_quantity(text, dimension).unwrap_or_else(|error| panic!("{error}"));
        // The expected numbers are written with twelve digits at least.
        assert!(
            (found - expected).abs() <= 1e-11 * expected.abs(),
            "{text}: found {found}, expected {expected}"
        );
    }
}

#[test]
fn regress_texts_that_are_no_quantities() {
    type Kind = fn(&QuantityError) -> bool;
    let no_number: Kind = |error| matches!(error, QuantityError::NoNumber { .. });
    let unknown: Kind = |error| matches!(error, QuantityError::UnknownUnit { .. });
    let cases: [(&str, Kind); 12] = [
        ("", no_number),
        ("mm", no_number),
        ("inf", no_number),
        ("nan m", no_number),
        ("-", no_number),
        (".", no_number),
        ("1 e3 m", unknown),
        ("1 2 m", unknown),
        ("1 MM", unknown),
        ("1,5 m", |error| {
            matches!(error, QuantityError::DecimalComma { .. })
        }),
        ("1e999 m", |error| {
            matches!(error, QuantityError::TooLarge { .. })
        }),
        ("5 GPa", |error| {
            matches!(
                error,
                QuantityError::WrongDimension {
                    found: Dimension::Pressure,
                    ..
                }
            )
        }),
    ];
    for (text, is_expected) in cases {
        match parse_quantity(text, Dimension::Length) {
            Ok(value) => panic!("{text:?} was read as {value} m"),
            Err(error) => assert!(is_expected(&error), "{text:?}: {error:?}"),
        }
    }
}

// ---------------------------------------------------------------- recordings, through the program

/// A test of the kind whose recording the cases below spoil.
const SPOILED: &str = concat!(
    "name = \"spoiled\"\n",
    strip_table!(),
    r#"[joint]
kind = "cantilever"
[hammer]
channel = "force"
[[sensor]]
name = "A"
channel = "tip"
position = 0.338
[[recording]]
file = "taps.csv"
"#
);

/// A CSV recording of three taps, with a header and a time column; row n stands in line n + 2.
fn good_csv() -> Vec<String> {
    let modes = [(17.0, 0.03), (118.0, 0.01), (335.6, 0.005)].map(|(frequency, damping_ratio)| {
        SimulatedMode {
            frequency,
            damping_ratio,
            shape_at_tap: 1.0,
            shape_at_sensors: vec![1.0],
        }
    });
    let settings = TapTestSettings {
        sample_rate: 1280.0,
        taps: 3,
        interval: 2.0,
        pulse: 3e-3,
        ..TapTestSettings::default()
    };
    let test = simulate_tap_test(&modes, &settings, 4);
    let rows = test.force.iter().zip(&test.responses[0]).enumerate();
    std::iter::once("time (s),force (N),tip (m/s2)".to_string())
        .chain(rows.map(|(n, (force, tip))| {
            format!("{:.9},{force:.6},{tip:.6}", n as f64 / test.sample_rate)
        }))
        .collect()
}

/// Puts `text` in the place of column `column` (0-based) of line `line` (1-based).
fn with_cell(line: usize, column: usize, text: &str) -> String {
    let mut lines = good_csv();
    let mut cells: Vec<&str> = lines[line - 1].split(',').collect();
    cells[column] = text;
    lines[line - 1] = cells.join(",");
    lines.join("\n")
}

fn tapjoint_in(folder: &Path) -> assert_cmd::Command {
    let mut command = assert_cmd::Command::cargo_bin("tapjoint").expect("built for tests");
    command.current_dir(folder);
    command
}

/// Names of everything in a folder.
fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Runs each command on a described test and its recording. Each must end with exit code 2, one line on standard
/// error, nothing on standard output and no file more or less. Returns the lines that differ, below their title.
fn refused(title: &str, description: &str, csv: &[u8], commands: &[&[&str]]) -> String {
    let mut lines = vec![title.to_owned()];
    for arguments in commands {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("test.toml"), description).unwrap();
        fs::write(folder.path().join("taps.csv"), csv).unwrap();
        let run = tapjoint_in(folder.path())
            .args(*arguments)
            .assert()
            .code(2)
            .stdout("");
        let said = String::from_utf8(run.get_output().stderr.clone()).unwrap();
        assert_eq!(said.trim_end().lines().count(), 1, "{said:?}");
        assert_eq!(names_in(folder.path()), ["taps.csv", "test.toml"], "{said}");
        assert_eq!(fs::read(folder.path().join("taps.csv")).unwrap(), csv);
        let line = format!("    {}", said.trim_end());
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    lines.join("\n") + "\n"
}

#[test]
fn regress_the_recording_that_is_spoiled_below_is_good() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("test.toml"), SPOILED).unwrap();
    fs::write(folder.path().join("taps.csv"), good_csv().join("\n")).unwrap();
    tapjoint_in(folder.path())
        .args(["run", "test.toml"])
        .assert()
        .code(0);
    assert_eq!(
        names_in(folder.path()),
        ["spoiled-report", "taps.csv", "test.toml"]
    );
}

#[test]
fn regress_bad_recordings_each_have_their_own_message() {
    let without = |line: usize| {
        let mut lines = good_csv();
        lines.remove(line - 1);
        lines.join("\n")
    };
    let cases = [
        ("empty", String::new()),
        ("a word", with_cell(102, 1, "abc")),
        ("NaN", with_cell(300, 2, "NaN")),
        ("infinite", with_cell(301, 1, "-inf")),
        ("beyond single precision", with_cell(302, 1, "1e200")),
        // The line after the one lost is where the step is twice as long.
        ("a lost row", without(700)),
        (
            "0.3 ms late at a step of 0.78 ms",
            with_cell(602, 0, "0.469050000"),
        ),
        ("a cell too many", with_cell(400, 2, "0.1,0.2")),
        ("a missing cell", with_cell(500, 2, "")),
    ];
    let mut messages = String::new();
    for (title, csv) in &cases {
        let commands = [
            &["run", "test.toml"][..],
            &["run", "test.toml", "--out", "deep/report"],
            &["identify", "test.toml", "--json", "result.json"],
            &["inspect", "taps.csv", "--json", "-"],
            &["spectrum", "taps.csv", "--png", "spectrum.png"],
        ];
        messages += &refused(title, SPOILED, csv.as_bytes(), &commands);
    }
    for (title, bytes) in [
        ("header only", &b"time (s),force (N),tip (m/s2)\n"[..]),
        ("WAV without a body", b"RIFF\x24\0\0\0WAVE"),
        ("picture", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x01\0"),
    ] {
        messages += &refused(title, SPOILED, bytes, &[&["run", "test.toml"]]);
    }
    assert_snapshot("errors_bad_recordings", &messages);
}

#[test]
fn regress_a_float_recording_with_nan_names_channel_and_sample() {
    // RIFF header of a float file of two channels, then frames of which one holds a NaN.
    let mut samples: Vec<f32> = (0..4000).map(|n| (n as f32 * 0.1).sin()).collect();
    samples[2 * 1234 + 1] = f32::NAN;
    let data: Vec<u8> = samples.iter().flat_map(|x| x.to_le_bytes()).collect();
    let mut file = b"RIFF".to_vec();
    file.extend((36 + data.len() as u32).to_le_bytes());
    file.extend(b"WAVEfmt ");
    for (value, bytes) in [
        (16, 4),
        (3, 2),
        (2, 2),
        (5120, 4),
        (5120 * 8, 4),
        (8, 2),
        (32, 2),
    ] {
        file.extend(&u32::to_le_bytes(value)[..bytes]);
    }
    file.extend(b"data");
    file.extend((data.len() as u32).to_le_bytes());
    file.extend(data);
    let numbered = SPOILED.replace("\"force\"", "1").replace("\"tip\"", "2");
    let said = refused("NaN", &numbered, &file, &[&["run", "test.toml"]]);
    assert_snapshot("errors_float_recording_with_nan", &said);
}

#[test]
fn regress_channels_and_places_that_do_not_exist() {
    let csv = good_csv().join("\n");
    let changes = [
        ("channel = \"tip\"\n", ""),
        ("\"tip\"", "\"tpi\""),
        ("\"force\"", "7"),
        ("0.338", "0.5"),
        ("0.338", "-1e-3"),
        ("taps.csv\"", "taps.csv\"\nband = [0, 900]"),
    ];
    let mut messages = String::new();
    for (from, to) in changes {
        let commands = [
            &["run", "test.toml"][..],
            &["run", "test.toml", "--out", "report"],
            &["identify", "test.toml"],
        ];
        let title = format!("{from:?} -> {to:?}");
        let description = SPOILED.replace(from, to);
        messages += &refused(&title, &description, csv.as_bytes(), &commands);
    }
    let command = ["spectrum", "taps.csv", "--hammer", "hammer"];
    messages += &refused("--hammer hammer", SPOILED, csv.as_bytes(), &[&command]);
    assert_snapshot("errors_channels_and_places", &messages);
}

#[test]
fn regress_outputs_that_cannot_be_written_are_found_out_before_any_work() {
    let csv = good_csv().join("\n");
    let mut messages = String::new();
    for arguments in [
        &["run", "test.toml", "--out", "taps.csv"][..],
        &["run", "test.toml", "--out", "taps.csv/report"],
        &["run", "test.toml", "--json", "no/where.json"],
        &["run", "test.toml", "--json", "taps.csv/x.json"],
        &["identify", "test.toml", "--json", "no/where.json"],
        &["spectrum", "taps.csv", "--png", "no/where.png"],
    ] {
        let title = arguments.join(" ");
        messages += &refused(&title, SPOILED, csv.as_bytes(), &[arguments]);
    }
    // The system's own words differ from system to system. In /proc even its owner may make nothing.
    if cfg!(target_os = "linux") {
        assert_snapshot("errors_outputs", &messages);
        let arguments = ["run", "test.toml", "--out", "/proc/tapjoint-report"];
        let said = refused("/proc", SPOILED, csv.as_bytes(), &[&arguments]);
        assert_snapshot("errors_outputs_without_permission", &said);
    }
    // A file that has the report folder's name keeps its content.
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("test.toml"), SPOILED).unwrap();
    fs::write(folder.path().join("taps.csv"), &csv).unwrap();
    fs::write(folder.path().join("spoiled-report"), "mine").unwrap();
    let run = tapjoint_in(folder.path())
        .args(["run", "test.toml"])
        .assert()
        .code(2)
        .stdout("");
    let said = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
    assert!(said.contains("spoiled-report: is a file"), "{said}");
    let kept = fs::read_to_string(folder.path().join("spoiled-report")).unwrap();
    assert_eq!(kept, "mine");
    assert_eq!(
        names_in(folder.path()),
        ["spoiled-report", "taps.csv", "test.toml"]
    );
}

#[test]
fn regress_sample_rates_beyond_reason_end_in_words() {
    // A time column may have any step; at every rate the program answers or refuses.
    for step in ["1e-300", "1e-25", "1e-9", "1e3", "1e12", "1e200"] {
        let folder = tempfile::tempdir().unwrap();
        let rows: Vec<String> = (0..600)
            .map(|n| format!("{n}{},{}", step.replacen('1', "", 1), (n * n) % 17))
            .collect();
        let csv = format!("time,x\n{}\n", rows.join("\n"));
        fs::write(folder.path().join("odd.csv"), csv).unwrap();
        for command in ["inspect", "spectrum", "run"] {
            let run = tapjoint_in(folder.path())
                .args([command, "odd.csv"])
                .timeout(std::time::Duration::from_secs(120))
                .assert();
            let output = run.get_output();
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(
                matches!(output.status.code(), Some(0..=2)) && !said.contains("panicked"),
                "{command}, step {step} s: {:?} {said}",
                output.status
            );
        }
    }
}

/// Samples of any size, ties and silence more often.
fn any_sample() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -1.0..1.0,
        3 => Just(0.0),
        1 => Just(1.0),
        1 => -1e100..1e100,
        1 => -1e-300..1e-300,
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(20242),
        ..ProptestConfig::with_cases(300)
    })]

    #[test]
    fn prop_no_samples_make_the_chain_panic(
        samples in proptest::collection::vec((any_sample(), any_sample()), 1..500),
        rate in 0.0..6.0f64,
        hammer in proptest::option::of(1usize..3),
    ) {
        let (first, second): (Vec<f64>, Vec<f64>) = samples.into_iter().unzip();
        let channels = [first, second]
            .map(|samples| Channel { samples, ..Channel::default() })
            .to_vec();
        let recording = Recording::from_samples("any", 10f64.powf(rate), channels).unwrap();
        let hammer = hammer.map(ChannelRef::Number);
        if let Ok(analysis) = run_recording(recording, hammer.as_ref(), |_| {}) {
            for mode in &analysis.modes {
                prop_assert!(mode.frequency.is_finite(), "{mode:?}");
            }
            render_json(&document_of(&analysis)).unwrap();
        }
    }
}

#[test]
fn regress_a_limit_far_from_the_estimate_ends_without_a_panic() {
    // Frequencies nearly equal, which no joint gives, with a scatter that allows everything.
    let text = "[beam]\nlength = 0.417\nwidth = 0.0821\nthickness = 0.000459\nmodulus = 7.954e8\n\
                density = 18978\n[joint]\nkind = \"cantilever\"\nbeam = \"timoshenko\"\n[measured]\n\
                frequencies = [94.1049, 95.5388, 95.5698, 95.5699, 95.57]\nscatter = 0.126\n";
    let test = TestDescription::parse(text, "test.toml").unwrap();
    let settings = IdentifySettings::unperturbed();
    let analysis = run_test(&test, (Path::new("."), "test.toml"), &settings).unwrap();
    render_json(&document_of(&analysis)).unwrap();
}

#[test]
fn regress_an_effect_is_named_by_its_id() {
    let text = format!("{VALID}[[effect]]\neffect = \"modulus\"\nrelative = 0.01\n");
    let error = TestDescription::parse(&text, "test.toml").expect_err("no id");
    let message = error.to_string();
    assert!(message.contains("did you mean `id`?"), "{message}");
}
