//! `run --export`: mode shapes and functions for other programs.

use super::{program, samples, tapjoint};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;
use tapjoint::recording::{FunctionType, list_datasets, read_function, read_mode_shapes};
use tapjoint::report::EXCHANGED;

const TEST: &str = "recordings/cantilever/test.toml";

fn report(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("report.json")).unwrap()).unwrap()
}

/// Runs a test with `--export`, and returns its standard error.
fn exported(folder: &Path, arguments: &[&str], code: i32) -> String {
    let run = Command::new(program())
        .current_dir(folder)
        .args(["run", "--export", "--out", "report"])
        .args(arguments)
        .output()
        .unwrap();
    let error = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(code), "{error}");
    error
}

/// Places and displacements of a mode in `shapes.csv`.
fn measured(out: &Path, mode: u64) -> Vec<(f64, f64)> {
    let table = fs::read_to_string(out.join("shapes.csv")).unwrap();
    let rows = table
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let own = rows.filter(|row| row[0] == mode.to_string());
    own.map(|row| (row[5].parse().unwrap(), row[8].parse().unwrap()))
        .collect()
}

/// Modal assurance criteria between measured and predicted shapes.
fn likenesses(out: &Path) -> Vec<f64> {
    let document = report(out);
    let mut all = Vec::new();
    for curve in document["mode_shapes"].as_array().unwrap() {
        let [x, y] = ["positions", "displacements"].map(|key| -> Vec<f64> {
            let values = curve[key].as_array().unwrap().iter();
            values.map(|value| value.as_f64().unwrap()).collect()
        });
        let (mut both, mut own, mut other) = (0.0, 0.0, 0.0);
        for (place, value) in measured(out, curve["mode"].as_u64().unwrap()) {
            let after = x.partition_point(|at| *at < place).clamp(1, x.len() - 1);
            let part = (place - x[after - 1]) / (x[after] - x[after - 1]);
            let model = y[after - 1] + part * (y[after] - y[after - 1]);
            both += value * model;
            own += value * value;
            other += model * model;
        }
        all.push(both * both / (own * other));
    }
    all.retain(|likeness| likeness.is_finite());
    all
}

#[test]
fn recover_a_moved_sensor_adds_its_places_to_the_shapes() {
    let folder = samples();
    let source = "examples/five_recordings.toml";
    tapjoint(folder.path(), &["simulate", source, "--out", "virtual"], 0);
    assert_eq!(exported(folder.path(), &["virtual/test.toml"], 0), "");
    let out = folder.path().join("report");
    // B stood at two places. The bands that reach to each mode decide where it was seen.
    let places = measured(&out, 3).into_iter().map(|one| one.0);
    assert_eq!(places.collect::<Vec<_>>(), [0.09, 0.14, 0.338]);
    let all = likenesses(&out);
    assert!(
        all.len() >= 5 && all.iter().all(|one| *one > 0.999),
        "{all:?}"
    );
}

#[test]
fn recover_exported_shapes_are_those_of_the_beam() {
    let folder = samples();
    assert_eq!(exported(folder.path(), &[TEST], 0), "");
    let out = folder.path().join("report");
    let document = report(&out);
    assert_eq!(document["exported"], serde_json::json!(EXCHANGED));
    let read = read_mode_shapes(&out.join("modes.uff")).unwrap();
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);
    // The sensors B and A, and the hammer beyond them.
    let places: Vec<f64> = read.nodes.values().map(|node| node.place[0]).collect();
    assert_eq!(places, [0.205, 0.338, 0.385]);
    let line = read.along_line(Some(1)).unwrap();
    assert_eq!(line.direction, "Z");
    let modes = document["modes"].as_array().unwrap().iter();
    let modes: Vec<&Value> = modes.filter(|mode| mode["mode"].is_u64()).collect();
    assert_eq!(read.modes.len(), modes.len());
    assert!(modes.len() >= 4, "{modes:?}");
    for (mode, (own, shape)) in modes.iter().zip(read.modes.iter().zip(&line.shapes)) {
        let [frequency, damping] = ["frequency", "damping"].map(|key| mode[key].as_f64().unwrap());
        assert!((own.frequency / frequency - 1.0).abs() < 1e-5, "{mode}");
        assert!(
            (own.damping.unwrap() / damping - 1.0).abs() < 1e-5,
            "{mode}"
        );
        let [b, a] = [0, 1].map(|node| shape[node].value);
        let table = measured(&out, mode["mode"].as_u64().unwrap());
        assert!(
            (table[0].1 - b).abs() < 1e-5 && (table[1].1 - a).abs() < 1e-5,
            "{table:?}"
        );
    }
    // The fitted model has nearly the same shapes.
    assert!(
        likenesses(&out).iter().all(|one| *one > 0.97),
        "{:?}",
        likenesses(&out)
    );
    // The same numbers as a table.
    let table = fs::read_to_string(out.join("shapes.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + 2 * modes.len());
    assert!(
        table.lines().nth(1).unwrap().contains(",0.205,B,"),
        "{table}"
    );
}

#[test]
fn val_exported_functions_are_those_of_frf_with_nodes_and_directions() {
    let folder = samples();
    exported(folder.path(), &[TEST], 0);
    let frf = ["frf", TEST, "--uff58", "plain.uff", "--csv", "frfs.csv"];
    tapjoint(folder.path(), &frf, 0);
    let out = folder.path().join("report");
    let [plain, own] = [folder.path().join("plain.uff"), out.join("frfs.uff")]
        .map(|file| list_datasets(&file).unwrap());
    let functions = |file| -> Vec<_> {
        let listed: &tapjoint::recording::UniversalFile = file;
        let numbers: Vec<usize> = listed
            .functions()
            .map(|(dataset, _)| dataset.number)
            .collect();
        numbers
            .iter()
            .map(|&number| read_function(listed, number).unwrap())
            .collect()
    };
    let (plain, own) = (functions(&plain), functions(&own));
    assert_eq!(
        own.len(),
        8,
        "functions and coherences of two sensors in two recordings"
    );
    for (own, plain) in own.iter().zip(&plain) {
        assert_eq!((&own.real, &own.imaginary), (&plain.real, &plain.imaginary));
    }
    let listed = list_datasets(&out.join("frfs.uff")).unwrap();
    let (mut nodes, mut texts) = (Vec::new(), Vec::new());
    for (_, function) in listed.functions() {
        if function.function_type == FunctionType::FREQUENCY_RESPONSE {
            let [response, reference] = [&function.response, &function.reference];
            nodes.push((response.to_string(), reference.to_string()));
            texts.extend(function.id_lines[0].clone());
        }
    }
    let hammer = "hammer 3:+Z".to_owned();
    let one = [
        ("A 2:+Z".to_owned(), hammer.clone()),
        ("B 1:+Z".to_owned(), hammer),
    ];
    assert_eq!(nodes, [one.clone(), one].concat());
    assert_eq!(
        texts,
        ["A, low.wav", "B, low.wav", "A, high.wav", "B, high.wav"]
    );
    let tables = [out.join("frfs.csv"), folder.path().join("frfs.csv")];
    let [own, plain] = tables.map(|file| fs::read_to_string(file).unwrap());
    assert!(own == plain, "the tables differ");
}

#[test]
fn limit_what_is_not_exported_is_said() {
    let folder = samples();
    let described = fs::read_to_string(folder.path().join(TEST)).unwrap();
    let without = |keys: &[&str]| {
        let lines = described.lines();
        let kept = lines.filter(|line| keys.iter().all(|key| !line.starts_with(key)));
        kept.collect::<Vec<_>>().join("\n")
    };
    // Without a hammer.
    let text = without(&["[hammer]", "channel = 1", "scale = 100", "tap"]);
    let other = "recordings/cantilever/other.toml";
    fs::write(folder.path().join(other), text).unwrap();
    let error = exported(folder.path(), &[other], 0);
    assert!(
        error.contains("without a hammer there is no function"),
        "{error}"
    );
    let out = folder.path().join("report");
    let exists = |name: &str| out.join(name).is_file();
    assert_eq!(EXCHANGED.map(exists), [true, true, false, false]);
    // Without places of the sensors.
    fs::write(folder.path().join(other), without(&["position", "mass"])).unwrap();
    let error = exported(folder.path(), &[other], 0);
    assert!(
        error.contains("their sensors have no `position`"),
        "{error}"
    );
    let read = read_mode_shapes(&out.join("modes.uff")).unwrap();
    assert_eq!((read.nodes.len(), read.modes[0].shape.len()), (1, 2));
    // Frequencies alone have no shapes.
    let measured = "[measured]\nfrequencies = [17, 118, 335.6, 628.7]\nhalf_line = 0.1\n";
    let (beam, _) = described.split_once("[hammer]").unwrap();
    fs::write(folder.path().join(other), format!("{beam}{measured}")).unwrap();
    let error = exported(folder.path(), &[other], 0);
    assert!(
        error.contains("modes.uff and shapes.csv are not written"),
        "{error}"
    );
    assert_eq!(report(&out)["exported"], serde_json::json!([]));
    assert_eq!(
        EXCHANGED.map(exists),
        [false; 4],
        "files of the earlier report"
    );
}

#[test]
fn regress_exported_files_replace_and_remove_no_foreign_ones() {
    let folder = samples();
    let out = folder.path().join("report");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("shapes.csv"), "mine").unwrap();
    let error = exported(folder.path(), &[TEST], 2);
    assert!(error.contains("shapes.csv: is there already"), "{error}");
    // Without the option the file is in nobody's way.
    let run = ["run", TEST, "--out", "report"];
    tapjoint(folder.path(), &run, 0);
    assert_eq!(fs::read_to_string(out.join("shapes.csv")).unwrap(), "mine");
    exported(folder.path(), &[TEST, "--force"], 0);
    for name in EXCHANGED {
        assert!(out.join(name).is_file(), "{name}");
    }
    tapjoint(folder.path(), &run, 0);
    for name in EXCHANGED {
        assert!(!out.join(name).exists(), "{name} is of an earlier report");
    }
}
