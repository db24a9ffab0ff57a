//! The model with what the diagnosis found: written, read back, predicted with; and what a diagnosis of few
//! frequencies says.

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::Path;

const BEAM: &str =
    "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n";
/// A bar that is known to 0.2 % of its frequencies.
const WELL_KNOWN: &str = "tolerance = { length = \"0.05 %\", thickness = \"0.1 %\", modulus = \"0.2 %\", density = \"0.1 %\" }\n";
const SENSOR: &str = "[[sensor]]\nname = \"A\"\nposition = 0.338\nmass = \"4 g\"\n";

/// Standard output of a command that ends with this code, and standard error.
fn told(folder: &Path, arguments: &[&str], code: i32) -> (String, String) {
    let mut command = Command::cargo_bin("tapjoint").unwrap();
    let done = command
        .current_dir(folder)
        .args(arguments)
        .assert()
        .code(code);
    let output = done.get_output();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (text(&output.stdout), text(&output.stderr))
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let (out, _) = told(folder, &[arguments, &["--json", "-"]].concat(), 0);
    serde_json::from_str(&out).unwrap()
}

fn predicted(folder: &Path, file: &str, modes: usize) -> Vec<f64> {
    let document = json(folder, &["predict", file, "--modes", &modes.to_string()]);
    let rows = document["prediction"].as_array().unwrap();
    rows.iter()
        .map(|row| row["predicted"].as_f64().unwrap())
        .collect()
}

/// A structure with an effect, the frequencies that it has, and the diagnosis of these without the effect
/// and without the joint.
fn round_trip(kind: &str, joint: &str, sensor: &str, effect: &str) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let truth = format!("{BEAM}[joint]\nkind = \"{kind}\"\n{joint}{sensor}[[effect]]\n{effect}");
    fs::write(folder.join("truth.toml"), truth).unwrap();
    let frequencies = predicted(folder, "truth.toml", 6);
    let measured = format!(
        "{BEAM}[joint]\nkind = \"{kind}\"\n{sensor}[measured]\nfrequencies = {frequencies:?}\nstd = 0.05\n"
    );
    fs::write(folder.join("test.toml"), measured).unwrap();
    let gap = &json(folder, &["diagnose", "test.toml", "--model", "model.toml"])["gap"];
    let model = &gap["updated_model"];
    let reported: Vec<f64> = model["frequencies"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| f.as_f64().unwrap())
        .collect();
    let again = predicted(folder, "model.toml", reported.len());
    for (one, other) in reported.iter().zip(&again) {
        // The same calculation from the same digits.
        assert!((one / other - 1.0).abs() < 1e-12, "{kind} {one} {other}");
    }
    // What was written explains what was fitted: as well as the hypothesis itself, whose errors are
    // stated; a second place of the decimals is for the finer mesh.
    let hypotheses = gap["hypotheses"].as_array().unwrap();
    let own = hypotheses
        .iter()
        .find(|one| one["effect"] == model["effect"])
        .unwrap();
    let after = own["gap_after"].as_f64().unwrap();
    let fitted = gap["fitted_modes"].as_u64().unwrap() as usize;
    let squares = again.iter().zip(&frequencies).take(fitted);
    let sum: f64 = squares.map(|(a, b)| (100.0 * (a / b - 1.0)).powi(2)).sum();
    let rms = (sum / fitted as f64).sqrt();
    assert!((rms - after).abs() < 0.01, "{kind}: {rms} {after} {model}");
}

#[test]
fn prop_updated_cantilever_predicts_what_the_report_says() {
    let joint = "kt = 1.9e6\nkr = 320\n";
    round_trip(
        "cantilever",
        joint,
        SENSOR,
        "id = \"cross-coupling\"\ncoupling = 0.2\n",
    );
}

#[test]
fn prop_updated_lap_joint_predicts_what_the_report_says() {
    let joint = "kt = 5e6\nkr = 2000\n";
    round_trip(
        "lap",
        joint,
        "",
        "id = \"joint-mass\"\nmass = \"60 g\"\ninertia = 1.4e-5\n",
    );
}

#[test]
fn prop_updated_free_beam_predicts_what_the_report_says() {
    round_trip(
        "free",
        "",
        "",
        "id = \"added-mass\"\nmass = 0.03\nposition = 0.1\n",
    );
}

#[test]
fn regress_effects_are_checked_where_they_are_described() {
    let folder = tempfile::tempdir().unwrap();
    let describe = |effect: &str| {
        let text = format!(
            "{BEAM}[joint]\nkind = \"cantilever\"\nkt = 1e6\nkr = 300\n[[effect]]\n{effect}"
        );
        fs::write(folder.path().join("test.toml"), text).unwrap();
    };
    describe("id = \"sensor-mas\"\n");
    let (_, error) = told(folder.path(), &["predict", "test.toml"], 2);
    assert!(
        error.contains("test.toml:11: ") && error.contains("sensor-mass"),
        "{error}"
    );
    describe("id = \"modulus\"\nrelative = -2\n");
    let (_, error) = told(folder.path(), &["predict", "test.toml"], 2);
    assert!(
        error.contains("test.toml:11: ") && !error.contains(" \n"),
        "{error}"
    );
    // One effect that the beam can have, and one beside it that it cannot.
    let outside = "id = \"modulus\"\n[[effect]]\nid = \"added-mass\"\nmass = 0.01\nposition = 2\n";
    describe(outside);
    let (_, error) = told(folder.path(), &["predict", "test.toml"], 2);
    assert!(
        error.contains("test.toml:13: position 2 m is not on the structure"),
        "{error}"
    );
    describe("id = \"modulus\"\nrelativ = 0.1\n");
    let (_, error) = told(folder.path(), &["predict", "test.toml"], 2);
    assert!(
        error.contains(":13:") && error.contains("relative"),
        "{error}"
    );
    describe("id = \"modulus\"\nrelative = 0.1\n");
    let (_, error) = told(
        folder.path(),
        &["identify", "test.toml", "--frequencies", "17,118,335"],
        2,
    );
    assert!(
        error.contains(":11: this command does not take a description with [[effect]]"),
        "{error}"
    );
    let (_, error) = told(
        folder.path(),
        &["predict", "test.toml", "--kx", "1", "--ky", "1"],
        2,
    );
    assert!(error.contains("leave out --kx"), "{error}");
}

#[test]
fn val_five_published_frequencies_show_a_gap_that_they_cannot_assign() {
    // Table 4 of Ingole & Chatterjee, read on lines of 0.25 Hz; nothing is known of the sensor.
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "{BEAM}{WELL_KNOWN}[joint]\nkind = \"cantilever\"\n[measured]\nfrequencies = [17, 118, 335.625, 628.75, 994.5]\nhalf_line = 0.125\nscatter = \"0.3 %\"\n"
    );
    fs::write(folder.path().join("test.toml"), text).unwrap();
    let (out, _) = told(folder.path(), &["diagnose", "test.toml", "--full"], 0);
    let said = out.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in [
        "There is a gap",
        "cannot say what causes it",
        "A cross-coupling of the joint is not established",
        "To decide: ",
        "What to do next",
    ] {
        assert!(said.contains(part), "{part} is missing in:\n{out}");
    }
    let gap = &json(folder.path(), &["diagnose", "test.toml"])["gap"];
    assert_eq!(gap["verdict"]["kind"], "not-enough-data");
    let tests = gap["next_test"].as_array().unwrap();
    let worth = |test: &Value| test["bits"].as_f64().unwrap() / test["effort"].as_f64().unwrap();
    assert!(
        tests
            .windows(2)
            .all(|pair| worth(&pair[0]) >= worth(&pair[1]))
    );
    // The beam by itself settles its scale, which is the most probable cause: it tells most, if at most cost.
    let bits = |test: &&Value| test["bits"].as_f64().unwrap();
    let most = tests
        .iter()
        .max_by(|a, b| bits(a).total_cmp(&bits(b)))
        .unwrap();
    assert_eq!(most["id"], "bare-beam");
}

#[test]
fn regress_what_the_diagnosis_refuses_is_no_model() {
    // No beam has such frequencies, nor would any effect give it them.
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "{BEAM}[joint]\nkind = \"cantilever\"\n{SENSOR}[measured]\nfrequencies = [17, 118, 290, 700, 940]\nstd = 0.01\n"
    );
    fs::write(folder.path().join("test.toml"), text).unwrap();
    let arguments = ["diagnose", "test.toml", "--model", "model.toml"];
    let full = [&arguments[..], &["--full"]].concat();
    let (out, error) = told(folder.path(), &full, 0);
    assert!(out.contains("nothing in the catalogue explains"), "{out}");
    assert!(!out.contains("How far:"), "{out}");
    assert!(
        error.contains("no model to write: nothing in the catalogue explains"),
        "{error}"
    );
    assert!(!error.contains("as it was"), "{error}");
    let model = folder.path().join("model.toml");
    assert!(!model.exists());
    let earlier =
        "# The model with what the diagnosis found (verdict: named; hypothesis: length, 99.6 %).\n";
    fs::write(&model, earlier).unwrap();
    let (_, error) = told(folder.path(), &arguments, 0);
    assert!(error.contains("; model.toml is left as it was"), "{error}");
    assert_eq!(fs::read_to_string(&model).unwrap(), earlier);
    let gap = &json(folder.path(), &["diagnose", "test.toml"])["gap"];
    assert_eq!(gap["verdict"]["kind"], "unknown");
    assert!(gap["updated_model"].is_null());
    let recording = &gap["where"]["modes"][0]["recording"];
    assert_eq!(recording, "the given frequencies");
}
