//! Decks for finite-element programs: the springs are the joint.

use super::{samples, tapjoint};
use serde_json::Value;
use std::path::Path;

/// A grid and its component.
type End = (usize, usize);

/// Stiffness, first and second (grid, component) of each CELAS2 of a deck; no second = ground.
fn celas(deck: &str) -> Vec<(f64, End, Option<End>)> {
    let lines: Vec<&str> = deck.lines().collect();
    let springs = lines
        .iter()
        .enumerate()
        .filter(|(_, line)| line.starts_with("CELAS2*"));
    springs
        .map(|(at, line)| {
            let first: Vec<&str> = line.split(',').collect();
            let second: Vec<&str> = lines[at + 1].split(',').collect();
            let whole = |field: &str| field.parse::<usize>().unwrap();
            let other = (second.len() > 2).then(|| (whole(second[1]), whole(second[2])));
            (
                first[2].parse().unwrap(),
                (whole(first[3]), whole(first[4])),
                other,
            )
        })
        .collect()
}

fn estimate(folder: &Path, test: &str) -> Value {
    let answer = tapjoint(folder, &["identify", test, "--json", "-"], 0);
    serde_json::from_str::<Value>(&answer).unwrap()["estimate"].clone()
}

fn of(estimate: &Value, key: &str) -> f64 {
    estimate[key]["value"].as_f64().unwrap()
}

/// The deck has ten digits.
const DIGITS: f64 = 1e-8;

#[test]
fn recover_two_springs_as_they_were_estimated() {
    let folder = samples();
    let test = "recordings/cantilever/test.toml";
    let found = estimate(folder.path(), test);
    let deck = tapjoint(folder.path(), &["export", test], 0);
    let springs = celas(&deck);
    let expected = [
        (of(&found, "kt"), (1, 2), None),
        (of(&found, "kr"), (1, 6), None),
    ];
    assert_eq!(springs.len(), expected.len(), "{springs:?}");
    for (spring, expected) in springs.iter().zip(expected) {
        assert!(
            (spring.0 / expected.0 - 1.0).abs() < DIGITS,
            "{spring:?} {expected:?}"
        );
        assert_eq!((spring.1, spring.2), (expected.1, expected.2));
    }
    assert!(
        deck.lines().all(|line| line.len() <= 100),
        "a line is too long"
    );
}

#[test]
fn regress_a_deck_of_a_model_that_misses_says_so() {
    let folder = samples();
    let exported = |test: &str, deck: &str| {
        let run = std::process::Command::new(super::program())
            .current_dir(folder.path())
            .args(["export", test, "--out", deck])
            .output()
            .unwrap();
        assert_eq!(run.status.code(), Some(0));
        (
            String::from_utf8(run.stdout).unwrap(),
            String::from_utf8(run.stderr).unwrap(),
        )
    };
    let (out, error) = exported("recordings/cantilever/test.toml", "joint.bdf");
    assert!(out.contains("joint.bdf"), "{out}");
    let deck = std::fs::read_to_string(folder.path().join("joint.bdf")).unwrap();
    let head: Vec<&str> = deck
        .lines()
        .take_while(|line| line.starts_with('$'))
        .collect();
    let head = head.join(" ").replace(" $ ", " ");
    for told in [&error, &head] {
        assert!(
            told.contains("the model misses the frequencies by 0.20 % rms"),
            "{told}"
        );
        assert!(told.contains("95 % limits: kt 1.5"), "{told}");
    }
    assert!(deck.is_ascii());
    // A model that holds is no reason for a warning.
    let (_, error) = exported("recordings/lap-joint/test.toml", "lap.bdf");
    assert!(!error.contains("warning"), "{error}");
    let deck = std::fs::read_to_string(folder.path().join("lap.bdf")).unwrap();
    assert!(!deck.contains("the model misses") && deck.contains("95 % limits: kt "));
}

#[test]
fn recover_three_springs_are_the_inverse_of_the_compliance() {
    let folder = tempfile::tempdir().unwrap();
    let text = tapjoint(folder.path(), &["init"], 0).replace("model = \"2p\"", "model = \"3p\"");
    let own = text
        .lines()
        .find(|line| line.starts_with("frequencies"))
        .unwrap();
    // Frequencies of the paper's table 4, which ask for a coupling.
    let text = text.replace(own, "frequencies = [17, 118, 335.625, 628.75, 994.5]");
    std::fs::write(folder.path().join("test.toml"), text).unwrap();
    let found = estimate(folder.path(), "test.toml");
    let deck = tapjoint(folder.path(), &["export", "test.toml"], 0);
    let springs = celas(&deck);
    assert_eq!(springs.len(), 3, "{springs:?}");
    let (ww, tt, wt) = (springs[0].0, springs[1].0, springs[2].0);
    assert_eq!((springs[2].1, springs[2].2), ((1, 2), Some((1, 6))));
    let stiffness = [[ww + wt, -wt], [-wt, tt + wt]];
    let cross = -1.0 / of(&found, "ktr");
    let compliance = [
        [1.0 / of(&found, "kt"), cross],
        [cross, 1.0 / of(&found, "kr")],
    ];
    let column = |j: usize| compliance.map(|row| row[j]);
    for (i, row) in stiffness.iter().enumerate() {
        for j in [0, 1] {
            let terms = || row.iter().zip(column(j)).map(|(k, c)| k * c);
            let (product, size) = (terms().sum::<f64>(), terms().map(f64::abs).sum::<f64>());
            let unit = if i == j { 1.0 } else { 0.0 };
            let off = (product - unit).abs();
            assert!(off < DIGITS * size, "[{i}][{j}] {product}");
        }
    }
}

#[test]
fn prop_a_report_gives_the_same_deck_as_its_test() {
    let folder = samples();
    let test = "recordings/lap-joint/test.toml";
    tapjoint(folder.path(), &["run", test, "--out", "report"], 0);
    for format in ["nastran", "abaqus"] {
        let fresh = tapjoint(folder.path(), &["export", test, "--format", format], 0);
        let arguments = [
            "export",
            test,
            "--format",
            format,
            "--report",
            "report/report.json",
        ];
        let reported = tapjoint(folder.path(), &arguments, 0);
        // The line that says where the joint is from differs, and rounding in the last digits.
        let numbers = |text: &str| -> Vec<f64> {
            let kept = text.lines().filter(|line| !line.contains("joint: "));
            let words = kept.flat_map(|line| line.split([',', ' ', '=']));
            words.filter_map(|word| word.trim().parse().ok()).collect()
        };
        let (fresh, reported) = (numbers(&fresh), numbers(&reported));
        assert_eq!(fresh.len(), reported.len(), "{format}");
        assert!(fresh.len() > 500, "{format}: {} numbers", fresh.len());
        for (a, b) in fresh.iter().zip(&reported) {
            assert!((a - b).abs() <= DIGITS * a.abs(), "{format}: {a} {b}");
        }
    }
}

#[test]
fn limit_a_rigid_direction_is_held_and_no_joint_is_no_answer() {
    let folder = tempfile::tempdir().unwrap();
    let text = tapjoint(folder.path(), &["init"], 0);
    let rigid = text.replace("# kt = 1.4e6 ", "kt = \"rigid\" ");
    std::fs::write(folder.path().join("rigid.toml"), &rigid).unwrap();
    let deck = tapjoint(folder.path(), &["export", "rigid.toml"], 0);
    assert!(deck.contains("SPC1,1,2,1\n"), "{deck}");
    assert_eq!(celas(&deck).len(), 1);
    let own = text
        .lines()
        .find(|line| line.starts_with("frequencies"))
        .unwrap();
    let few = text.replace(own, "frequencies = [17]");
    std::fs::write(folder.path().join("few.toml"), few).unwrap();
    assert_eq!(tapjoint(folder.path(), &["export", "few.toml"], 1), "");
}

#[test]
fn prop_a_report_gives_the_same_deck_where_the_beam_was_estimated_too() {
    let folder = tempfile::tempdir().unwrap();
    let text = "name = \"uneven\"\n[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9
        density = 7850\ntolerance = { length = \"1 mm\" }\n[beam.right]\nthickness = 0.007\n[joint]
        kind = \"lap\"\nposition = 0.17\noverlap = { length = 0.04, mass = 0.05 }\n[[sensor]]
        name = \"A\"\nchannel = 2\nposition = 0.4\nmass = \"24 g\"\n[measured]\nscatter = \"0.1 %\"
        frequencies = [124, 367, 838, 1354, 2400]\n[analysis]\nfit = [\"kt\", \"kr\", \"modulus\"]\n";
    std::fs::write(folder.path().join("test.toml"), text).unwrap();
    tapjoint(folder.path(), &["run", "test.toml", "--out", "report"], 0);
    let fresh = tapjoint(folder.path(), &["export", "test.toml"], 0);
    // With a report nothing is estimated: data are not even asked for.
    let bare = text.split("[measured]").next().unwrap();
    std::fs::write(folder.path().join("bare.toml"), bare).unwrap();
    let arguments = ["export", "bare.toml", "--report", "report/report.json"];
    let reported = tapjoint(folder.path(), &arguments, 0);
    let numbers = |text: &str| -> Vec<f64> {
        let kept = text.lines().filter(|line| !line.contains("joint: "));
        let words = kept.flat_map(|line| line.split([',', ' ', '=']));
        words.filter_map(|word| word.trim().parse().ok()).collect()
    };
    let (a, b) = (numbers(&fresh), numbers(&reported));
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() <= DIGITS * a.abs(), "{a} {b}");
    }
    let modulus = fresh
        .lines()
        .find_map(|line| line.strip_prefix("MAT1*,1,"))
        .and_then(|rest| rest.split(',').next()?.trim().parse::<f64>().ok());
    assert!(
        modulus.is_some_and(|e| (e / 207e9 - 1.0).abs() > 1e-3),
        "{modulus:?}"
    );
}
