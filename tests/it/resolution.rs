//! The study of resolution: the paper's percentages, the rms of line readings, limits, and its command.

use assert_cmd::Command;
use predicates::prelude::*;
use serde_json::Value;
use std::fs;
use std::path::Path;
use tapjoint::description::TestDescription;
use tapjoint::pipeline::tested_structure;
use tapjoint::structure::JointStiffness;
use tapjoint::study::resolution::{
    EstimateMethod, ReadBy, ResolutionSettings, ResolutionStudy, StudiedTest, WindowName,
    formula_percent, study_resolution,
};

const BEAM: &str =
    "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n";

/// The cantilever of Ingole & Chatterjee on a joint near theirs, in their two bands.
fn cantilever(joint: &str) -> StudiedTest {
    let text = format!("{BEAM}[joint]\nkind = \"cantilever\"\n{joint}[analysis]\nfit_modes = 4\n");
    let bands = [(0.0, 200.0), (0.0, 1000.0)];
    studied(
        &text,
        JointStiffness {
            kx: 1400.0,
            ky: 6.0,
            cross_compliance: 0.0,
        },
        &bands,
    )
}

fn studied(text: &str, joint: JointStiffness, bands: &[(f64, f64)]) -> StudiedTest {
    let test = TestDescription::parse(text, "test.toml").unwrap();
    StudiedTest::of_description(&test, &tested_structure(&test), joint, bands)
}

fn settings(blocks: &[usize], readings: &[ReadBy], draws: usize) -> ResolutionSettings {
    ResolutionSettings {
        blocks: blocks.to_vec(),
        readings: readings.to_vec(),
        draws,
        fit_draws: draws,
        ..ResolutionSettings::default()
    }
}

fn study(test: &StudiedTest, settings: &ResolutionSettings) -> ResolutionStudy {
    study_resolution(test, settings, &|_, _| {}).unwrap()
}

#[test]
fn val_half_lines_of_the_paper() {
    // Ingole & Chatterjee, section 3.3: 800 and 1600 lines of blocks of 2048 and 4096.
    assert_eq!(
        (formula_percent(800), formula_percent(1600)),
        (0.0625, 0.03125)
    );
    let found = study(
        &cantilever(""),
        &settings(&[2048, 4096], &[ReadBy::Line], 2),
    );
    let lines: Vec<_> = found
        .blocks
        .iter()
        .map(|b| (b.lines, b.half_line_percent_of_band))
        .collect();
    assert_eq!(lines, [(800, 0.0625), (1600, 0.03125)]);
    for band in found.blocks.iter().flat_map(|block| &block.bands) {
        // The band's half line is that share of it: 0.125 Hz of 200 Hz, 0.625 Hz of 1000 Hz.
        let share = 100.0 * band.half_line / (band.high - band.low);
        let formula = if band.seconds * (band.high - band.low) < 1000.0 {
            0.0625
        } else {
            0.03125
        };
        // Rounding of a few operations.
        assert!((share / formula - 1.0).abs() < 1e-12, "{band:?}");
    }
}

#[test]
fn val_line_readings_err_by_the_spacing_over_root_twelve() {
    // Truths uniform over a line leave errors uniform over it, of rms spacing/sqrt 12.
    let found = study(
        &cantilever(""),
        &settings(&[512, 1024], &[ReadBy::Line], 1000),
    );
    let rows: Vec<_> = found
        .frequency_errors
        .iter()
        .filter(|row| row.used)
        .collect();
    assert_eq!(rows.len(), 8);
    for row in rows {
        assert_eq!((row.found, row.draws), (1000, 1000), "{row:?}");
        let ratio = row.rms.unwrap() / (row.spacing / 12f64.sqrt());
        // The rms of 1000 uniform errors has a standard deviation of 1.4 %; 5 % is what is promised.
        assert!(
            (ratio - 1.0).abs() < 0.05,
            "block {}, mode {}: {ratio}",
            row.block,
            row.mode
        );
        // No error passes the bound but by noise: a peak between two lines falls to either.
        assert!(row.largest.unwrap() < 1.05 * row.half_line, "{row:?}");
    }
}

#[test]
fn limit_small_errors_reach_the_stiffness_to_first_order() {
    let found = study(&cantilever(""), &settings(&[4096], &[ReadBy::Line], 400));
    assert_eq!(found.stiffness_errors.len(), 4);
    for row in &found.stiffness_errors {
        let ratio = row.rms_percent.unwrap() / row.line_rms_percent.unwrap();
        // 3.5 % of chance over 400 draws, the joint's variation and second order: to 20 %.
        assert!((ratio - 1.0).abs() < 0.2, "{row:?}");
        assert!(
            row.line_rms_percent < row.half_line_bound_percent,
            "{row:?}"
        );
    }
}

#[test]
fn limit_without_noise_fits_leave_nothing() {
    let quiet = ResolutionSettings {
        noise_db: 200.0,
        ..settings(&[2048], &[ReadBy::Fit, ReadBy::Line], 6)
    };
    let found = study(&cantilever(""), &quiet);
    let fits = || {
        found
            .frequency_errors
            .iter()
            .filter(|row| row.reading == ReadBy::Fit)
    };
    for row in fits() {
        assert_eq!(row.own, row.draws, "{row:?}");
        // Rounding and what the fit of neighbours leaves.
        assert!(row.rms.unwrap() < 1e-5 * row.spacing, "{row:?}");
    }
    let fitted = found
        .stiffness_errors
        .iter()
        .filter(|row| row.reading == ReadBy::Fit);
    for row in fitted {
        assert!(row.rms_percent.unwrap() < 1e-3, "{row:?}");
    }
}

#[test]
fn prop_the_same_study_on_any_number_of_threads() {
    let test = cantilever("");
    let settings = settings(&[512, 2048], &ReadBy::ALL, 12);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| study(&test, &settings))
    };
    assert_eq!(on(1), on(3));
    let other = ResolutionSettings {
        seed: 2,
        ..settings.clone()
    };
    assert_ne!(
        study(&test, &other).frequency_errors,
        on(1).frequency_errors
    );
}

#[test]
fn limit_every_kind_of_structure_and_window_has_a_study() {
    let kinds = [
        (
            "cantilever\"\nmodel = \"3p",
            (500.0, 20.0, 0.004),
            &["kx", "ky", "kz"][..],
        ),
        ("lap", (500.0, 20.0, 0.0), &["kx", "ky"]),
        ("free", (0.0, 0.0, 0.0), &["modulus"]),
        ("cantilever", (f64::INFINITY, 20.0, 0.0), &["ky"]),
    ];
    for (kind, (kx, ky, cross_compliance), parameters) in kinds {
        let text = format!("{BEAM}[joint]\nkind = \"{kind}\"\n");
        let test = studied(
            &text,
            JointStiffness {
                kx,
                ky,
                cross_compliance,
            },
            &[],
        );
        let settings = ResolutionSettings {
            windows: vec![
                WindowName::Rectangular,
                WindowName::Exponential,
                WindowName::Hann,
            ],
            ..settings(&[8192], &[ReadBy::Interpolated], 10)
        };
        let found = study(&test, &settings);
        let names: Vec<_> = found.stiffnesses.iter().map(|s| s.parameter).collect();
        assert_eq!(names, parameters, "{kind}");
        let consistent = found.stiffness_errors.iter().filter(|row| {
            row.method == EstimateMethod::Consistent && row.window != WindowName::Hann
        });
        for row in consistent {
            assert_eq!(row.found, 10, "{kind}: {row:?}");
            // Frequencies known to some millionths: kz, the most sensitive, to a percent.
            assert!(row.rms_percent.unwrap() < 1.0, "{kind}: {row:?}");
        }
    }
}

// ---------------------------------------------------------------- the command

fn tapjoint(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("tapjoint").expect("cargo builds the program for tests");
    command.current_dir(folder);
    command
}

fn described(more: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{BEAM}[joint]\nkind = \"cantilever\"\n{more}");
    fs::write(folder.path().join("test.toml"), text).unwrap();
    folder
}

const MEASURED: &str = "[measured]\nfrequencies = [17, 118, 335.625, 628.75, 994.5]\nhalf_line = 0.125\n[analysis]\nfit_modes = 4\n";

#[test]
fn regress_the_command_answers_with_table_csv_json_and_picture() {
    let folder = described(MEASURED);
    let place = |name: &str| folder.path().join(name);
    tapjoint(folder.path())
        .args([
            "resolution",
            "test.toml",
            "--band",
            "0:200",
            "--band",
            "0:1000",
        ])
        .args([
            "--blocks",
            "2048,512",
            "--draws",
            "20",
            "--fit-draws",
            "2",
            "--accuracy",
            "5 %",
        ])
        .args(["--png", "r.png", "--csv", "r.csv", "--json", "r.json"])
        .assert()
        .code(0)
        .stdout(predicate::str::contains("0.06250"))
        .stdout(predicate::str::contains("For 5 % (rms) in every stiffness"))
        .stderr(predicate::str::contains("mode 5 is not studied"));
    let json: Value = serde_json::from_str(&fs::read_to_string(place("r.json")).unwrap()).unwrap();
    let found = &json["resolution"];
    assert_eq!(found["blocks"][1]["half_line_percent_of_band"], 0.0625);
    // Four modes, two of them in both bands; two blocks, three readings.
    assert_eq!(
        found["frequency_errors"].as_array().unwrap().len(),
        6 * 2 * 3
    );
    assert_eq!(
        found["stiffness_errors"].as_array().unwrap().len(),
        4 * 2 * 3
    );
    assert_eq!(json["warnings"][0]["code"], "mode-not-studied");
    assert_eq!(json["test"]["kind"], "cantilever");
    let csv = fs::read_to_string(place("r.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 10 * 2 * 3);
    assert!(csv.starts_with("quantity,name,method,unit,block"), "{csv}");
    assert!(fs::read(place("r.png")).unwrap().starts_with(b"\x89PNG"));
    let text = tapjoint(folder.path())
        .args([
            "resolution",
            "test.toml",
            "--blocks",
            "512",
            "--draws",
            "2",
            "--kx",
            "970",
            "--ky",
            "1.25",
        ])
        .output()
        .unwrap();
    let text = String::from_utf8(text.stdout).unwrap();
    let longest = text.lines().map(|line| line.chars().count()).max();
    assert!(longest.unwrap() <= 80, "{text}");
    assert!(text.contains("Kx = 970.0"), "{text}");
}

#[test]
fn regress_what_cannot_be_studied_is_refused() {
    let cases: &[(&str, &[&str], &str)] = &[
        (
            "",
            &[],
            "the joint's stiffness is not known; give --kx and --ky",
        ),
        (
            MEASURED,
            &["--accuracy", "5"],
            "500 % is outside 0 to 100 %",
        ),
        (MEASURED, &["--blocks", "3"], "16"),
        (MEASURED, &["--draws", "1"], "2..="),
        (MEASURED, &["--readings", "guess"], "interpolated"),
        (MEASURED, &["--band", "200:100"], "ascending"),
        (
            MEASURED,
            &["--band", "20:50"],
            "no natural frequency lies in the bands",
        ),
        (
            MEASURED,
            &["--band", "0:50"],
            "1 frequency cannot determine 2 unknowns",
        ),
        (
            MEASURED,
            &["--band", "0:0.01", "--band", "0:1000", "--blocks", "512"],
            "samples are the limit",
        ),
        (MEASURED, &["--png", "none/r.png"], "none"),
    ];
    for (more, arguments, says) in cases {
        let folder = described(more);
        tapjoint(folder.path())
            .args(
                ["resolution", "test.toml", "--draws", "2"]
                    .iter()
                    .filter(|a| {
                        !arguments.contains(&"--draws") || (**a != "--draws" && **a != "2")
                    }),
            )
            .args(*arguments)
            .assert()
            .code(2)
            .stdout("")
            .stderr(predicate::str::contains(*says));
        assert_eq!(
            fs::read_dir(folder.path()).unwrap().count(),
            1,
            "{arguments:?}"
        );
    }
}
