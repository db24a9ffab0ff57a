//! What the documents say: every command that they show runs as printed.

use super::{program, samples};
use std::path::{Path, PathBuf};
use std::process::Command;
use tapjoint::pipeline::WARNING_CODES;

/// The commands of a document's `console` blocks, with the code that they end with: lines that begin
/// with "$ ", and "# exits with 1" behind those that have no answer.
fn commands(text: &str) -> Vec<(String, i32)> {
    let blocks = text.split("```console\n").skip(1);
    let lines = blocks.flat_map(|block| block.split("```").next().unwrap_or_default().lines());
    lines
        .filter_map(|line| line.strip_prefix("$ "))
        .map(|line| match line.split_once("# exits with ") {
            Some((command, code)) => (command.trim().to_owned(), code.trim().parse().unwrap()),
            None => (line.to_owned(), 0),
        })
        .collect()
}

fn documents() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let guide = std::fs::read_dir(root.join("docs")).unwrap();
    let mut all: Vec<PathBuf> = guide
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "md"))
        .collect();
    all.push(root.join("README.md"));
    all.sort();
    all
}

#[test]
fn prop_every_command_in_the_documents_runs_as_printed() {
    let binary = program();
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", binary.parent().unwrap().display());
    let mut tried = 0;
    for document in documents() {
        let text = std::fs::read_to_string(&document).unwrap();
        // One after the other in one folder, as a reader types them.
        let folder = samples();
        for (command, code) in commands(&text) {
            let run = Command::new("sh")
                .args(["-c", &command])
                .current_dir(folder.path())
                .env("PATH", &path)
                .output()
                .unwrap();
            let error = String::from_utf8_lossy(&run.stderr).into_owned();
            let place = document.display();
            assert_eq!(run.status.code(), Some(code), "{place}: {command}\n{error}");
            tried += 1;
        }
    }
    assert!(tried >= 20, "only {tried} commands were found");
}

/// Scripts look for these codes: the guide's table and the program's list have the same rows.
#[test]
fn prop_the_guide_lists_every_code_of_a_warning() {
    let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide.md");
    let guide = std::fs::read_to_string(guide).unwrap();
    let rows = WARNING_CODES.map(|(code, when)| format!("| `{code}` | {when} |"));
    let (_, section) = guide.split_once("## Codes of the warnings").unwrap();
    let (section, _) = section.split_once("\n## ").unwrap();
    let listed: Vec<&str> = section
        .lines()
        .filter(|line| line.starts_with("| `"))
        .collect();
    assert_eq!(listed, rows);
}

/// The number behind the first of these words after another, such as "Kt = 1.790" MN/m.
fn figure(text: &str, after: &str, word: &str) -> f64 {
    let rest = text.split_once(after).unwrap().1;
    let rest = rest.split_once(word).unwrap().1.trim_start();
    let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.');
    rest[..end.unwrap_or(rest.len())]
        .trim_end_matches('.')
        .parse()
        .unwrap()
}

#[test]
fn val_the_first_figures_of_the_documents_are_those_of_the_run() {
    let folder = samples();
    let run = ["run", "recordings/cantilever/test.toml", "--json", "-"];
    let report: serde_json::Value =
        serde_json::from_str(&super::tapjoint(folder.path(), &run, 0)).unwrap();
    let found = |key: &str| report["estimate"][key]["value"].as_f64().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let printed = super::tapjoint(folder.path(), &[&run[..2], &["--force"]].concat(), 0);
    assert!(
        readme.contains(&format!("```text\n{printed}```")),
        "{printed}"
    );
    let truth = std::fs::read_to_string(root.join("recordings/cantilever/truth.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_str(&truth).unwrap();
    let true_kt = truth["joint"]["kt"].as_f64().unwrap();
    let text = std::fs::read_to_string(root.join("recordings/README.md")).unwrap();
    let percent = figure(&text, "on the first it finds", "one that is ");
    let soft = 100.0 * (1.0 - found("kt") / true_kt);
    assert!((percent - soft).abs() < 0.6, "{percent} % is {soft} %");
    let taps = report["recordings"].as_array().unwrap().iter();
    let taps = taps.flat_map(|one| one["taps"].as_array().unwrap());
    assert_eq!(taps.count(), 10);
    assert_eq!(report["modes"].as_array().unwrap().len(), 5);
}

#[test]
fn prop_links_between_documents_lead_somewhere() {
    for document in documents() {
        let text = std::fs::read_to_string(&document).unwrap();
        for link in text
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split(')').next())
        {
            let file = link.split('#').next().unwrap_or_default();
            if file.is_empty() || file.contains("://") {
                continue;
            }
            let target = document.parent().unwrap().join(file);
            assert!(
                target.exists(),
                "{}: {link} leads nowhere",
                document.display()
            );
        }
    }
}
