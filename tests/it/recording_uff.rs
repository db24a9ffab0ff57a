//! What the command line shows of a universal file.

use assert_cmd::Command;
use serde_json::Value;

use written::{Made, file, file_of, response, series};

#[path = "../../src/signal/tests/it/written.rs"]
#[allow(dead_code, reason = "the listing needs a part of it")]
mod written;

/// Exit code, JSON and standard error of `inspect`.
fn inspect(path: &std::path::Path, more: &[&str]) -> (i32, Value, String) {
    let mut command = Command::cargo_bin("tapjoint").unwrap();
    let output = command
        .arg("inspect")
        .arg(path)
        .args(more)
        .args(["--json", "-"])
        .output()
        .unwrap();
    let json = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    let error = String::from_utf8(output.stderr).unwrap();
    (output.status.code().unwrap(), json, error)
}

#[test]
fn val_datasets_are_listed_beside_what_is_in_the_time_series() {
    let ring: Vec<f64> = (0..4000)
        .map(|n| {
            let t = f64::from(n - 500) * 1e-3;
            if t < 0.0 {
                0.0
            } else {
                (-5.0 * t).exp() * (300.0 * t).sin()
            }
        })
        .collect();
    let tested = file_of(&[series(ring), response(&[(1.0, 2.0); 7])]);
    let (code, json, error) = inspect(&tested.path, &[]);
    assert_eq!(code, 0, "{error}");
    assert_eq!(json["recordings"][0]["sample_rate"], 1000.0);
    assert_eq!(json["recordings"][0]["format"], "UFF 58, text");
    assert_eq!(
        json["recordings"][0]["taps"].as_array().map(Vec::len),
        Some(1)
    );
    let datasets = json["datasets"].as_array().expect("datasets");
    let kinds: Vec<_> = datasets
        .iter()
        .map(|d| d["kind"].as_str().unwrap())
        .collect();
    assert_eq!(kinds, ["time response", "frequency response function"]);
    assert_eq!(
        (&datasets[1]["points"], &datasets[1]["spacing"]),
        (&Value::from(7), &Value::from(0.5))
    );
    assert_eq!(
        (&datasets[1]["response"], &datasets[1]["reference"]),
        (&Value::from("3:+Z"), &Value::from("1:-Z"))
    );
    let (code, json, _) = inspect(&tested.path, &["--headers"]);
    assert_eq!(
        (code, json["recordings"].as_array().map(Vec::len)),
        (0, Some(0))
    );
    assert_eq!(json["datasets"].as_array().map(Vec::len), Some(2));
}

#[test]
fn val_responses_alone_are_listed_and_headers_want_a_universal_file() {
    let tested = file_of(&[
        response(&[(1.0, 2.0); 7]),
        Made {
            function_type: 6,
            data_type: 4,
            ..response(&[(0.5, 0.5)])
        },
    ]);
    let (code, json, error) = inspect(&tested.path, &[]);
    assert_eq!(code, 0, "{error}");
    assert_eq!(json["datasets"][1]["kind"], "coherence");
    let units = file("units.uff", "    -1\n   151\nmodel\n    -1\n");
    let (code, json, error) = inspect(&units.path, &[]);
    assert_eq!(
        (code, &json["datasets"][0]["kind"]),
        (0, &Value::from("header (dataset 151)"))
    );
    assert!(
        error.contains("holds no function (dataset 58), only 1 x header"),
        "{error}"
    );
    let text = file("taps.csv", "t,a\n0,1\n0.1,2\n0.2,1\n");
    let (code, _, error) = inspect(&text.path, &["--headers"]);
    assert_eq!(code, 2);
    assert!(error.contains("leave --headers out"), "{error}");
}
