//! One mode that does not belong to the others: what the program says of it.

use crate::golden::assert_snapshot;
use crate::shared::steel_strip;
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::process::Command;
use tapjoint::identify::consistent::{FrequencyModel, JointedStructure, Parameter};
use tapjoint::structure::specimen::PointMass;
use tapjoint::structure::{Assembly, BeamTheory};

/// The first seven frequencies (Hz) of the strip on Kt = 1.4 MN/m and Kr = 900 N m/rad.
fn frequencies() -> Vec<f64> {
    frequencies_with(1.4e6, Vec::new())
}

/// The same on this Kt (N/m), with these masses on it.
fn frequencies_with(kt: f64, masses: Vec<PointMass>) -> Vec<f64> {
    let mut structure =
        JointedStructure::new(BeamTheory::Timoshenko, steel_strip(), Assembly::Cantilever);
    structure.masses = masses;
    let model = FrequencyModel::new(&structure, 7).unwrap();
    let mut point = model.nominal();
    point[Parameter::Kt as usize] = kt.ln();
    point[Parameter::Kr as usize] = 900f64.ln();
    let modes = 1..=7;
    modes
        .map(|mode| model.response(&point, mode, 3.1 * mode as f64).frequency)
        .collect()
}

/// What `run` says of these frequencies, as a document.
fn report(frequencies: &[f64]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let list: Vec<String> = frequencies.iter().map(|f| format!("{f:.3}")).collect();
    let beam = steel_strip();
    let test = format!(
        "[beam]\nlength = \"{} mm\"\nwidth = \"{} mm\"\nthickness = \"{} mm\"\n\
         modulus = \"{} GPa\"\ndensity = {}\npoisson = {}\n\n[joint]\nkind = \"cantilever\"\n\n\
         [measured]\nfrequencies = [{}]\nstd = 0.02\n",
        1e3 * beam.length,
        1e3 * beam.width,
        1e3 * beam.thickness,
        1e-9 * beam.modulus,
        beam.density,
        beam.poisson,
        list.join(", ")
    );
    fs::write(folder.path().join("test.toml"), test).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tapjoint"));
    let arguments = ["run", "test.toml", "--quiet", "--json", "-"];
    let done = command
        .current_dir(folder.path())
        .args(arguments)
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{error}");
    serde_json::from_slice(&done.stdout).unwrap()
}

/// The warnings about outlying modes and numbers, and the modes that are named.
fn said(frequencies: &[f64]) -> String {
    let report = report(frequencies);
    let mut text = String::new();
    for warning in report["warnings"].as_array().unwrap() {
        let code = warning["code"].as_str().unwrap();
        if ["outlying-mode", "other-numbers"].contains(&code) {
            writeln!(text, "{code}: {}", warning["text"].as_str().unwrap()).unwrap();
        }
    }
    for candidate in report["estimate"]["left_out"]["candidates"]
        .as_array()
        .into_iter()
        .flatten()
    {
        let (mode, probability) = (
            &candidate["mode"],
            candidate["probability"].as_f64().unwrap(),
        );
        writeln!(text, "  mode {mode}, probability {probability:.2}").unwrap();
    }
    text
}

#[test]
fn regress_words_of_outlying_modes() {
    let exact = frequencies();
    let off = |count: usize, mode: usize, share: f64| {
        let mut own = exact[..count].to_vec();
        own[mode - 1] *= 1.0 + share;
        own
    };
    // The fifth mode was missed, and the sixth took its number.
    let missed = [&exact[..4], &exact[5..6]].concat();
    let cases = [
        ("all belong together", exact.clone()),
        ("mode 4 of 7 is off by 2 %", off(7, 4, 0.02)),
        ("mode 4 of 4 is off by 2 %", off(4, 4, 0.02)),
        ("mode 2 of 5 is off by 0.5 %", off(5, 2, 0.005)),
        ("mode 4 of 5 is off by 0.5 %", off(5, 4, 0.005)),
        ("mode 5 of 5 has the frequency of mode 6", missed),
    ];
    let mut text = String::new();
    for (name, own) in cases {
        write!(text, "{name}\n{}\n", said(&own)).unwrap();
    }
    assert_snapshot("outlying_modes", &text);
}

/// A mass that nothing describes may look like the wrong reading of one mode. The diagnosis takes both into account.
#[test]
fn regress_a_missing_mass_does_not_hide_behind_an_outlying_mode() {
    let mut loaded = frequencies_with(1.9e6, vec![PointMass::new(0.33, 0.03)]);
    loaded.truncate(6);
    let found = report(&loaded);
    let left_out = &found["estimate"]["left_out"]["mode"];
    assert!(left_out.is_u64(), "no mode is left out: {left_out}");
    let verdict = found["gap"]["verdict"]["kind"].as_str().unwrap();
    assert!(["named", "group", "set"].contains(&verdict), "{verdict}");
    assert_ne!(found["headline"]["model"], "described");
}

#[test]
fn recover_a_wrong_reading_as_no_gap() {
    let mut off = frequencies();
    off[3] *= 1.02;
    let found = report(&off);
    assert_eq!(found["estimate"]["left_out"]["mode"], 4);
    assert_eq!(found["gap"]["verdict"]["kind"], "no-gap");
    assert_eq!(found["headline"]["model"], "described");
}

/// The updated model is of another hypothesis the second time, and its file goes or comes.
#[test]
fn regress_a_report_is_replaced_by_one_with_another_answer() {
    let folder = tempfile::tempdir().unwrap();
    for second in [113.18, 113.9, 114.5, 113.18] {
        let text = format!(
            "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n\
             [joint]\nkind = \"cantilever\"\n[measured]\n\
             frequencies = [15.497, {second}, 317.169, 593.89, 948.421, 1428.441]\nstd = 0.02\n"
        );
        fs::write(folder.path().join("test.toml"), text).unwrap();
        let done = Command::new(env!("CARGO_BIN_EXE_tapjoint"))
            .current_dir(folder.path())
            .args(["run", "test.toml", "--quiet", "--out", "report"])
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success(), "{second}: {error}");
    }
}
