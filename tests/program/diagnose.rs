//! Answers of the diagnosis to odd tests.

use super::tapjoint;
use serde_json::Value;
use std::fs;
use std::path::Path;

const BEAM: &str =
    "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n";
/// A bar that is known to 0.2 % of its frequencies.
const WELL_KNOWN: &str = "tolerance = { length = \"0.05 %\", thickness = \"0.1 %\", modulus = \"0.2 %\", density = \"0.1 %\" }\n";

/// Words of a text without its line breaks.
fn flowing(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn val_published_frequencies_with_a_sensor_that_sat_nobody_knows_where() {
    // Table 4 of Ingole & Chatterjee, read on lines of 0.25 Hz, with the sensor of 24 g that they used.
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "{BEAM}{WELL_KNOWN}[joint]\nkind = \"cantilever\"\n[[sensor]]\nname = \"A\"\nmass = \"24 g\"\n[measured]\n\
         frequencies = [17, 118, 335.625, 628.75, 994.5]\nhalf_line = 0.125\nscatter = \"0.3 %\"\n"
    );
    fs::write(folder.path().join("test.toml"), text).unwrap();
    let said = flowing(&tapjoint(
        folder.path(),
        &["diagnose", "test.toml", "--full"],
        0,
    ));
    for part in [
        "There is a gap: without A (24 g), whose position is not given",
        "cannot say what causes it",
        "A cross-coupling of the joint is not established",
        "To decide: ",
    ] {
        assert!(said.contains(part), "{part} is missing in:\n{said}");
    }
    let json = tapjoint(folder.path(), &["diagnose", "test.toml", "--json", "-"], 0);
    let gap = &serde_json::from_str::<Value>(&json).unwrap()["gap"];
    assert_eq!(gap["verdict"]["kind"], "not-enough-data");
    // Without a place it is no part of the described model: wherever it sat, it weighs.
    let bare = text_without_mass(folder.path());
    let none = |gap: &Value| {
        let all = gap["hypotheses"].as_array().unwrap();
        all.iter()
            .find(|one| one["effect"] == "none")
            .map(|one| one["gap_before"].as_f64().unwrap())
    };
    assert_ne!(none(gap), none(&bare), "the mass had no effect");
}

/// The diagnosis without the sensor's mass.
fn text_without_mass(folder: &Path) -> Value {
    let text = fs::read_to_string(folder.join("test.toml")).unwrap();
    fs::write(
        folder.join("bare.toml"),
        text.replace("mass = \"24 g\"\n", ""),
    )
    .unwrap();
    let json = tapjoint(folder, &["diagnose", "bare.toml", "--json", "-"], 0);
    serde_json::from_str::<Value>(&json).unwrap()["gap"].clone()
}

#[test]
fn regress_recordings_of_different_beams_are_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let recordings = ["r1.wav", "r2.wav", "r3.wav"]
        .map(|file| format!("[[recording]]\nfile = \"{file}\"\ntap = 0.385\n"));
    let rest = "[joint]\nkind = \"cantilever\"\n[hammer]\nchannel = 1\n[[sensor]]\nname = \"A\"\nchannel = 2\nposition = 0.338\nmass = \"1.5 g\"\n";
    // Of the same beam, half as long again, and with a thicker one.
    for (name, beam) in [
        ("one", BEAM.to_owned()),
        ("longer", BEAM.replace("0.423", "0.6345")),
        ("thicker", BEAM.replace("0.005", "0.0065")),
    ] {
        let text = format!("{beam}{rest}{}", recordings.concat());
        fs::write(folder.join(format!("{name}.toml")), text).unwrap();
        let file = format!("{name}.toml");
        let made = [
            "simulate", &file, "--out", name, "--kx", "1400", "--ky", "5",
        ];
        tapjoint(folder, &made, 0);
    }
    for other in ["longer", "thicker"] {
        fs::copy(
            folder.join(other).join("r3.wav"),
            folder.join("one").join("r3.wav"),
        )
        .unwrap();
        let said = flowing(&tapjoint(folder, &["diagnose", "one/test.toml"], 1));
        let wanted = "r1.wav and r3.wav do not show the same structure";
        assert!(said.contains(wanted), "{other}: {said}");
    }
}
