//! What the documents say: every command that they show runs as printed, and answers as printed.

use super::{program, samples};
use std::path::{Path, PathBuf};
use std::process::Command;
use tapjoint::pipeline::WARNING_CODES;

/// A command of a document's `console` blocks.
struct Shown {
    /// As typed: the line behind "$ ".
    command: String,
    /// The code that it ends with: that of "# exits with 1" behind it, else 0.
    code: i32,
    /// Lines of its answer that the document shows, in order.
    answer: Vec<String>,
}

/// The commands of a document's `console` blocks. In an answer "..." stands for lines that are left out.
fn commands(text: &str) -> Vec<Shown> {
    let mut all: Vec<Shown> = Vec::new();
    let blocks = text.split("```console\n").skip(1);
    for line in blocks.flat_map(|block| block.split("```").next().unwrap_or_default().lines()) {
        if let Some(typed) = line.strip_prefix("$ ") {
            let (command, code) = match typed.split_once("# exits with ") {
                Some((command, code)) => (command.trim(), code.trim().parse().unwrap()),
                None => (typed, 0),
            };
            all.push(Shown {
                command: command.to_owned(),
                code,
                answer: Vec::new(),
            });
        } else if !line.is_empty() && line != "..." {
            all.last_mut().unwrap().answer.push(line.to_owned());
        }
    }
    all
}

/// Test descriptions of a document: `toml` blocks whose first line is a comment with the name of a file.
fn descriptions(text: &str) -> Vec<(&str, &str)> {
    let blocks = text.split("```toml\n").skip(1);
    let blocks = blocks.filter_map(|block| block.split("```").next());
    blocks
        .filter_map(|block| Some((block.lines().next()?.strip_prefix("# ")?, block)))
        .filter(|(name, _)| name.ends_with(".toml"))
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
        for (name, description) in descriptions(&text) {
            std::fs::write(folder.path().join(name), description).unwrap();
        }
        for shown in commands(&text) {
            let (command, code) = (&shown.command, shown.code);
            let run = Command::new("sh")
                .args(["-c", command])
                .current_dir(folder.path())
                .env("PATH", &path)
                .output()
                .unwrap();
            let error = String::from_utf8_lossy(&run.stderr).into_owned();
            let place = document.display();
            assert_eq!(run.status.code(), Some(code), "{place}: {command}\n{error}");
            let answer = String::from_utf8_lossy(&run.stdout).into_owned() + &error;
            let mut lines = answer.lines();
            for line in &shown.answer {
                let is_printed = lines.any(|one| one.trim_end() == line.trim_end());
                assert!(is_printed, "{place}: {command}: no {line:?} in\n{answer}");
            }
            tried += 1;
        }
    }
    assert!(tried >= 20, "only {tried} commands were found");
}

/// Scripts look for these codes: the reference's table and the program's list have the same rows.
#[test]
fn prop_the_reference_lists_every_code_of_a_warning() {
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference.md");
    let reference = std::fs::read_to_string(reference).unwrap();
    let rows = WARNING_CODES.map(|(code, when)| format!("| `{code}` | {when} |"));
    let (_, section) = reference
        .split_once("\n## Codes of the warnings\n")
        .unwrap();
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
