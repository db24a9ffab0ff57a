//! The JSON Schema that is shipped: it is the program's own, and real reports keep to it.

use super::{samples, tapjoint};
use boon::{Compiler, Schemas};
use serde_json::Value;
use std::path::Path;

fn shipped() -> Value {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/report.schema.json");
    let own = tapjoint::report::render_schema();
    if std::env::var_os("TAPJOINT_REFRESH").is_some() {
        std::fs::write(&file, &own).unwrap();
    }
    let text = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(
        text == own,
        "docs/report.schema.json is not the program's schema; TAPJOINT_REFRESH=1 cargo test --test program schema writes it"
    );
    serde_json::from_str(&text).unwrap()
}

/// Why a document breaks the schema; empty where it keeps it.
fn breaches(schema: &Value, document: &Value) -> String {
    let (mut schemas, mut compiler) = (Schemas::new(), Compiler::new());
    compiler
        .add_resource("memory:report.json", schema.clone())
        .unwrap();
    let index = compiler
        .compile("memory:report.json", &mut schemas)
        .unwrap();
    let checked = schemas.validate(document, index);
    checked.map_or_else(|error| format!("{error:#}"), |()| String::new())
}

#[test]
fn prop_reports_keep_to_the_shipped_schema() {
    let schema = shipped();
    let folder = samples();
    let cantilever = "recordings/cantilever/test.toml";
    let wav = "recordings/cantilever/low.wav";
    let virtual_test = "examples/five_recordings.toml";
    let commands: &[&[&str]] = &[
        &["run", cantilever],
        &["run", cantilever, "--export"],
        &["run", "recordings/lap-joint/test.toml"],
        &["identify", cantilever],
        &["perturb", cantilever, "--samples", "20"],
        &["predict", "--joint", "free"],
        &["inspect", wav],
        &["inspect", wav, "--timings"],
        &["spectrum", wav, "--hammer", "1"],
        &["frf", wav, "--hammer", "1"],
        &["diagnose", cantilever],
        &["compare", cantilever, cantilever],
        &["compare", "--series", cantilever, cantilever, cantilever],
        &["plan", virtual_test, "--draws", "1", "--timings"],
        &["export", cantilever],
        &[
            "resolution",
            virtual_test,
            "--draws",
            "2",
            "--fit-draws",
            "2",
            "--blocks",
            "1024",
        ],
        &["simulate", virtual_test, "--out", "virtual"],
        &[
            "simulate",
            virtual_test,
            "--out",
            "pair",
            "--change",
            "joint-change:kr=-5%",
        ],
        &["blind-check", "--cases", "2", "--seed", "4"],
        &["blind-check", "--compare", "--cases", "2", "--seed", "4"],
        &["reproduce"],
        &["init"],
        &["completions", "bash"],
        &["man", "run"],
    ];
    for command in commands {
        let mut arguments = command.to_vec();
        arguments.extend(["--json", "-"]);
        let document: Value =
            serde_json::from_str(&tapjoint(folder.path(), &arguments, 0)).unwrap();
        let why = breaches(&schema, &document);
        assert!(why.is_empty(), "{command:?}: {why}");
    }
}

#[test]
fn limit_rigid_joints_keep_to_the_schema() {
    let folder = tempfile::tempdir().unwrap();
    let text = tapjoint(folder.path(), &["init"], 0);
    let text = text.replace("# kt = 1.4e6 ", "kt = \"rigid\" ");
    std::fs::write(folder.path().join("test.toml"), text).unwrap();
    let answer = tapjoint(folder.path(), &["identify", "test.toml", "--json", "-"], 0);
    let document: Value = serde_json::from_str(&answer).unwrap();
    assert_eq!(breaches(&shipped(), &document), "");
}

#[test]
fn prop_the_schema_finds_what_is_wrong() {
    let schema = shipped();
    let wrong = [
        r#"{"version": 1}"#,
        r#"{"version": "1", "warnings": []}"#,
        r#"{"version": 1, "warnings": [{"code": "x"}]}"#,
        r#"{"version": 1, "warnings": [], "modes": [{"mode": "one"}]}"#,
    ];
    for text in wrong {
        let document = serde_json::from_str(text).unwrap();
        assert_ne!(breaches(&schema, &document), "", "{text} was let pass");
    }
}
