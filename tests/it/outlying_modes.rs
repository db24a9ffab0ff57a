//! One mode that does not belong to the others: what the program says of it.

use crate::golden::assert_snapshot;
use crate::shared::steel_strip;
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::process::Command;
use tapjoint::identify::consistent::{FrequencyModel, JointedStructure, Parameter};
use tapjoint::structure::{Assembly, BeamTheory};

/// The first seven frequencies (Hz) of the strip on Kt = 1.4 MN/m and Kr = 900 N m/rad.
fn frequencies() -> Vec<f64> {
    let structure =
        JointedStructure::new(BeamTheory::Timoshenko, steel_strip(), Assembly::Cantilever);
    let model = FrequencyModel::new(&structure, 7).unwrap();
    let mut point = model.nominal();
    point[Parameter::Kt as usize] = 1.4e6f64.ln();
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
        ("mode 2 of 5 is off by 0.6 %", off(5, 2, 6e-3)),
        ("mode 5 of 5 has the frequency of mode 6", missed),
    ];
    let mut text = String::new();
    for (name, own) in cases {
        write!(text, "{name}\n{}\n", said(&own)).unwrap();
    }
    assert_snapshot("outlying_modes", &text);
}
