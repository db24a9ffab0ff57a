//! The program as its users see it.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod batch;
mod browser;
mod budgets;
mod diagnose;
mod documents;
mod exchange;
mod export;
mod faults;
mod first_steps;
mod frozen;
#[path = "../golden/mod.rs"]
mod golden;
mod leftovers;
mod listen;
mod outputs;
mod schema;
mod sheet;
mod timings;
mod trace;
mod updated_model;
mod watch;

use std::path::{Path, PathBuf};

/// A copy of the folder of sample recordings in a new folder.
fn samples() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let example = Path::new("examples").join("five_recordings.toml");
    std::fs::create_dir_all(folder.path().join("examples")).unwrap();
    std::fs::copy(root.join(&example), folder.path().join(&example)).unwrap();
    for test in ["cantilever", "lap-joint"] {
        let (from, to) = (
            root.join("recordings").join(test),
            folder.path().join("recordings").join(test),
        );
        std::fs::create_dir_all(&to).unwrap();
        for entry in std::fs::read_dir(&from).unwrap() {
            let entry = entry.unwrap();
            // Folders are reports that somebody has made.
            if entry.file_type().unwrap().is_file() {
                std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
            }
        }
    }
    folder
}

/// The program that cargo built for these tests.
fn program() -> PathBuf {
    assert_cmd::cargo::cargo_bin("tapjoint")
}

/// Runs the program in a folder; its standard output where it ends with this code.
fn tapjoint(folder: &Path, arguments: &[&str], code: i32) -> String {
    let run = std::process::Command::new(program())
        .current_dir(folder)
        .args(arguments)
        .output();
    let output = run.unwrap();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
    String::from_utf8(output.stdout).unwrap()
}

/// Names of all commands, in the order of the help.
fn commands(folder: &Path) -> Vec<String> {
    let help = tapjoint(folder, &["help"], 0);
    let list = help
        .lines()
        .filter_map(|line| line.strip_prefix("  ")?.split_once("  "));
    let names = list.map(|(name, _)| name);
    let names = names.filter(|name| !name.is_empty() && !name.starts_with([' ', '-']));
    let names = names.filter(|name| *name != "help");
    names.map(str::to_owned).collect()
}
