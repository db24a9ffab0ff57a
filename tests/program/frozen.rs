//! Snapshots of what the program puts out, to be reviewed as a whole when it changes.
//!
//! Each test is run as a user runs it, in a folder of its own. The snapshots hold the terminal text,
//! `parameters.csv`, `report.json` and the text of the page. Numbers of `report.json` have six significant digits.
//! Long lists are shortened to their length and their ends, lists of objects to the details of one. `INSTA_UPDATE=always cargo test --test program frozen` writes the snapshots anew.

use super::golden::assert_snapshot;
use super::{commands, program};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// Longest line of a list or an object that is written on one line.
const LINE: usize = 110;
/// Longest list that stands in a cell of a table.
const CELL: usize = 40;
/// Most numbers of a list that are written out.
const NUMBERS: usize = 6;
/// Most rows of a table that are written out.
const ROWS: usize = 8;

/// Copies the files of a folder of recordings; folders in it are reports that somebody has made.
fn copy_recordings(name: &str, to: &Path) {
    let from = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("recordings")
        .join(name);
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        if entry.file_type().unwrap().is_file() {
            fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
        }
    }
}

/// Runs the program and returns its standard output and standard error, without the folder's path.
///
/// The width of the terminal is fixed, and nothing of the environment decides about the output.
fn put_out(folder: &Path, arguments: &[&str]) -> String {
    put_out_at(100, folder, arguments)
}

/// The same on a terminal of so many columns.
fn put_out_at(columns: usize, folder: &Path, arguments: &[&str]) -> String {
    let output = Command::new(program())
        .current_dir(folder)
        .args(arguments)
        .env("COLUMNS", columns.to_string())
        .env("NO_COLOR", "1")
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let mut text = String::from_utf8(output.stdout).unwrap();
    if !output.stderr.is_empty() {
        text.push_str("--- standard error\n");
        text.push_str(&String::from_utf8(output.stderr).unwrap());
    }
    if output.status.code() != Some(0) {
        writeln!(text, "--- exit code {:?}", output.status.code()).unwrap();
    }
    text.replace(&folder.display().to_string(), "(folder)")
}

/// A number with six significant digits, for which the rounding of another mathematical library does not matter.
fn rounded(number: &serde_json::Number) -> String {
    if number.is_f64() {
        let value = number.as_f64().unwrap();
        let short: f64 = format!("{value:.5e}").parse().unwrap();
        if short != 0.0 && !(1e-4..1e7).contains(&short.abs()) {
            return format!("{short:e}");
        }
        return format!("{short}");
    }
    number.to_string()
}

/// A value of a report on one line; long lists by their length and their ends.
fn on_one_line(value: &Value) -> String {
    match value {
        Value::Number(number) => rounded(number),
        Value::Array(items) => {
            let numeric = items.iter().all(|item| item.is_number() || item.is_null());
            if numeric && items.len() > NUMBERS {
                let (first, last) = (on_one_line(&items[0]), on_one_line(&items[items.len() - 1]));
                return format!("[{first}, .. {} .., {last}]", items.len());
            }
            let items: Vec<String> = items.iter().map(on_one_line).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Object(fields) => {
            let fields: Vec<String> = fields
                .iter()
                .map(|(key, field)| format!("{key}: {}", on_one_line(field)))
                .collect();
            format!("{{{}}}", fields.join(", "))
        }
        other => other.to_string(),
    }
}

/// A value that fits in a cell of a table.
fn is_cell(value: &Value) -> bool {
    match value {
        Value::Object(_) => false,
        Value::Array(_) => on_one_line(value).len() <= CELL,
        _ => true,
    }
}

/// Keys of a list's items, in the order in which they appear, by whether all their values fit in cells.
fn columns(items: &[Value]) -> (Vec<&str>, Vec<&str>) {
    let mut keys: Vec<&str> = Vec::new();
    for fields in items.iter().filter_map(Value::as_object) {
        for key in fields.keys() {
            if !keys.contains(&key.as_str()) {
                keys.push(key);
            }
        }
    }
    keys.into_iter()
        .partition(|key| items.iter().all(|item| item.get(key).is_none_or(is_cell)))
}

/// Writes a list of objects as a table; what fits in no cell is written below it for the first item that has it.
fn write_table(text: &mut String, indent: usize, items: &[Value]) {
    let space = " ".repeat(indent);
    let (cells, nested) = columns(items);
    writeln!(text, "{space}{}", cells.join(" | ")).unwrap();
    for (index, item) in items.iter().enumerate() {
        if items.len() > ROWS && (ROWS - 2..items.len() - 2).contains(&index) {
            if index == ROWS - 2 {
                writeln!(text, "{space}.. {} more ..", items.len() - ROWS).unwrap();
            }
            continue;
        }
        let row: Vec<String> = cells
            .iter()
            .map(|key| item.get(key).map_or("-".to_owned(), on_one_line))
            .collect();
        writeln!(text, "{space}{}", row.join(" | ")).unwrap();
    }
    for key in nested {
        let holds = |item: &Value| item.get(key).is_some_and(|field| !field.is_null());
        let first = items.iter().position(holds).expect("a value of it is none");
        write_value(
            text,
            indent + 2,
            &format!("[{first}].{key}"),
            &items[first][key],
        );
    }
}

/// Writes a value below its key: on one line where it fits, else a line for each field.
fn write_value(text: &mut String, indent: usize, key: &str, value: &Value) {
    let space = " ".repeat(indent);
    let line = format!("{space}{key}: {}", on_one_line(value));
    match value {
        Value::Object(fields) if line.len() > LINE => {
            writeln!(text, "{space}{key}:").unwrap();
            for (key, field) in fields {
                write_value(text, indent + 2, key, field);
            }
        }
        Value::Array(items) if line.len() > LINE && items.iter().all(Value::is_object) => {
            writeln!(text, "{space}{key}: {} items", items.len()).unwrap();
            write_table(text, indent + 2, items);
        }
        Value::Array(items) if line.len() > LINE => {
            writeln!(text, "{space}{key}: {} items", items.len()).unwrap();
            for item in items.iter().take(ROWS) {
                writeln!(text, "{space}  {}", on_one_line(item)).unwrap();
            }
        }
        _ => writeln!(text, "{line}").unwrap(),
    }
}

/// A report as text.
fn readable(report: &str) -> String {
    let report: Value = serde_json::from_str(report).unwrap();
    let mut text = String::new();
    for (key, value) in report.as_object().unwrap() {
        write_value(&mut text, 0, key, value);
    }
    text
}

/// Leaves out an element with all that it holds.
fn without_element(page: &str, name: &str) -> String {
    let (open, close) = (format!("<{name}"), format!("</{name}>"));
    let mut kept = String::new();
    let mut rest = page;
    while let Some(start) = rest.find(&open) {
        kept.push_str(&rest[..start]);
        let end = rest[start..].find(&close).expect("closed") + start;
        rest = &rest[end + close.len()..];
    }
    kept + rest
}

/// The text that a page shows without scripts: a line for each block, cells of a table separated by bars.
fn visible_text(page: &str) -> String {
    let mut page = page.to_owned();
    for name in ["script", "style", "svg"] {
        page = without_element(&page, name);
    }
    let mut text = String::new();
    let mut rest = page.as_str();
    while let Some(start) = rest.find('<') {
        text.push_str(&rest[..start].replace('\n', " "));
        let end = rest[start..].find('>').expect("a closed tag") + start;
        let tag = rest[start + 1..end].trim_start_matches('/');
        let name: String = tag
            .chars()
            .take_while(char::is_ascii_alphanumeric)
            .collect();
        let closes = rest.as_bytes()[start + 1] == b'/';
        match name.as_str() {
            "td" | "th" if closes => text.push_str(" | "),
            "a" | "b" | "i" | "em" | "strong" | "code" | "sub" | "sup" | "span" | "td" | "th"
            | "small" => {}
            _ => text.push('\n'),
        }
        rest = &rest[end + 1..];
    }
    text.push_str(rest);
    for (entity, letter) in [
        ("&lt;", "<"),
        ("&gt;", ">"),
        ("&quot;", "\""),
        ("&#34;", "\""),
        ("&#38;", "&"),
        ("&#39;", "'"),
        ("&#60;", "<"),
        ("&#62;", ">"),
        ("&nbsp;", " "),
        ("&amp;", "&"),
    ] {
        text = text.replace(entity, letter);
    }
    let lines = text
        .lines()
        .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
    let lines: Vec<String> = lines
        .filter(|line| !line.is_empty() && line != "|")
        .collect();
    without_inner_rows(&lines)
}

/// Joins lines; of a long table, whose lines end in bars, the rows in the middle are left out.
fn without_inner_rows(lines: &[String]) -> String {
    let mut text = String::new();
    let is_row = |line: &String| line.ends_with('|');
    for block in lines.chunk_by(|one, next| is_row(one) && is_row(next)) {
        for (index, line) in block.iter().enumerate() {
            let is_inner = block.len() > ROWS + 4 && (ROWS..block.len() - 2).contains(&index);
            if !is_inner {
                writeln!(text, "{line}").unwrap();
            } else if index == ROWS {
                writeln!(text, ".. {} rows more ..", block.len() - ROWS - 2).unwrap();
            }
        }
    }
    text
}

/// Most lines of a default output.
const MOST_LINES: usize = 25;

/// Returns the default output on terminals of several widths; checks that it is short, and fits.
fn answers(folder: &Path, arguments: &[&str]) -> String {
    let mut text = String::new();
    for columns in [80, 120, 200] {
        let answer = put_out_at(columns, folder, arguments);
        let shown = answer.split("--- standard error").next().unwrap();
        assert!(shown.lines().count() <= MOST_LINES, "{columns}:\n{answer}");
        let widest = shown.lines().map(|line| line.chars().count()).max();
        assert!(widest <= Some(columns), "{columns}:\n{answer}");
        writeln!(text, "=== {columns} columns\n{answer}").unwrap();
    }
    text
}

/// Runs a test and compares everything with its snapshots; each that differs is shown.
fn assert_frozen(name: &str, folder: &Path, test: &str) {
    let mut terminal = answers(folder, &["run", test, "--out", "report", "--force"]);
    for command in ["identify", "diagnose"] {
        writeln!(
            terminal,
            "##### {command}\n{}",
            answers(folder, &[command, test])
        )
        .unwrap();
    }
    writeln!(
        terminal,
        "##### full\n{}",
        put_out(
            folder,
            &["run", test, "--out", "report", "--force", "--full"]
        )
    )
    .unwrap();
    let read = |file: &str| fs::read_to_string(folder.join("report").join(file)).unwrap();
    let parts = [
        ("terminal", terminal),
        ("parameters", csv_rounded(&read("parameters.csv"))),
        ("report", readable(&read("report.json"))),
        ("page", visible_text(&read("report.html"))),
    ];
    let differs: Vec<&str> = parts
        .iter()
        .filter(|(part, text)| {
            let compare = || assert_snapshot(&format!("{name}_{part}"), text);
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(compare)).is_err()
        })
        .map(|(part, _)| *part)
        .collect();
    assert!(differs.is_empty(), "{name}: {differs:?} differ");
}

/// Returns the names of a report's files, the words of its page, and the changes.
fn report_text(folder: &Path) -> String {
    let entries = fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
    let page = visible_text(&read("report.html"));
    let changes = csv_rounded(&read("changes.csv"));
    format!("{}\n\n{page}\n{changes}\n", names.join("\n"))
}

/// A table with numbers of six significant digits.
fn csv_rounded(table: &str) -> String {
    let cell = |cell: &str| match serde_json::from_str(cell) {
        Ok(Value::Number(number)) => rounded(&number),
        _ => cell.to_owned(),
    };
    let lines = table
        .lines()
        .map(|line| line.split(',').map(cell).collect::<Vec<_>>().join(","));
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn frozen_cantilever() {
    let folder = tempfile::tempdir().unwrap();
    copy_recordings("cantilever", folder.path());
    assert_frozen("cantilever", folder.path(), "test.toml");
}

#[test]
fn frozen_cantilever_with_cross_coupling() {
    let folder = tempfile::tempdir().unwrap();
    copy_recordings("cantilever-3p", folder.path());
    assert_frozen("cantilever_3p", folder.path(), "test.toml");
}

#[test]
fn frozen_lap_joint() {
    let folder = tempfile::tempdir().unwrap();
    copy_recordings("lap-joint", folder.path());
    assert_frozen("lap_joint", folder.path(), "test.toml");
}

#[test]
fn frozen_nonlinear() {
    let folder = tempfile::tempdir().unwrap();
    copy_recordings("nonlinear", folder.path());
    assert_frozen("nonlinear", folder.path(), "test.toml");
}

#[test]
fn frozen_five_simulated_recordings() {
    let folder = tempfile::tempdir().unwrap();
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/five_recordings.toml");
    fs::copy(example, folder.path().join("five.toml")).unwrap();
    let simulate = [
        "simulate",
        "five.toml",
        "--out",
        "v",
        "--seed",
        "8",
        "--with",
        "added-mass:mass=5g,position=200mm",
        "-q",
    ];
    assert_eq!(put_out(folder.path(), &simulate), "");
    assert_frozen("five_recordings", folder.path(), "v/test.toml");
    let page = fs::metadata(folder.path().join("report/report.html")).unwrap();
    assert!(page.len() < 2_000_000, "{} bytes", page.len());
}

/// A joint that is retightened: 8 % less rotational stiffness, as another person would record it.
#[test]
fn frozen_compare() {
    let folder = tempfile::tempdir().unwrap();
    copy_recordings("cantilever", folder.path());
    for (name, ky, seed) in [("before", "13", "1"), ("after", "12", "2")] {
        let simulate = [
            "simulate",
            "test.toml",
            "--kx",
            "1500",
            "--ky",
            ky,
            "--seed",
            seed,
            "--out",
            name,
            "-q",
        ];
        assert_eq!(put_out(folder.path(), &simulate), "");
    }
    let tests = ["before/test.toml", "after/test.toml"];
    let mut text = String::new();
    for after in [tests[1], tests[0]] {
        let compare = ["compare", tests[0], after, "--repeatability", "0.1 %"];
        text.push_str(&answers(folder.path(), &compare));
        text.push_str(&put_out(
            folder.path(),
            &[&compare[..], &["--full"]].concat(),
        ));
        text.push('\n');
    }
    let json = [
        "compare",
        tests[0],
        tests[1],
        "--repeatability",
        "0.1 %",
        "--json",
        "-",
    ];
    text.push_str(&readable(&put_out(folder.path(), &json)));
    assert_snapshot("compare", &text);
    let series = [
        "compare",
        "--series",
        tests[0],
        tests[0],
        tests[0],
        tests[1],
        tests[1],
        "--repeatability",
        "0.1 %",
    ];
    let mut text = answers(folder.path(), &series);
    text.push_str(&put_out(
        folder.path(),
        &[&series[..], &["--full"]].concat(),
    ));
    text.push('\n');
    let agreeing = [&series[..5], &series[7..]].concat();
    text.push_str(&answers(folder.path(), &agreeing));
    assert_snapshot("compare_series", &text);
    for (arguments, page) in [
        (&json[..5], "compare_page"),
        (&series[..], "compare_series_page"),
    ] {
        let text = put_out(folder.path(), &[arguments, &["--out", page, "-q"]].concat());
        assert_eq!(text, "");
        assert_snapshot(page, &report_text(&folder.path().join(page)));
    }
}

#[test]
fn frozen_spectrum() {
    let folder = tempfile::tempdir().unwrap();
    copy_recordings("cantilever", folder.path());
    let mut text = String::new();
    for arguments in [
        &["spectrum", "low.wav", "--hammer", "1"][..],
        &["spectrum", "high.wav"],
    ] {
        text.push_str(&answers(folder.path(), arguments));
    }
    assert_snapshot("spectrum", &text);
}

#[test]
fn frozen_change_check() {
    let folder = tempfile::tempdir().unwrap();
    let check = ["blind-check", "--compare", "--cases", "4", "--seed", "2"];
    // The digest depends on the last digit of every number.
    let printed = put_out(folder.path(), &check);
    let lines = printed.lines().filter(|line| !line.contains("SHA-256"));
    let mut text = lines.fold(String::new(), |text, line| text + line + "\n");
    let cases = folder.path().join("blind-check/cases.csv");
    text.push_str("=== cases.csv\n");
    text.push_str(&std::fs::read_to_string(cases).unwrap());
    assert_snapshot("change_check", &text);
}

#[test]
fn frozen_help() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::new();
    let names = commands(folder.path());
    let of_commands = names.iter().map(|name| vec![name.as_str(), "--help"]);
    for arguments in std::iter::once(vec!["--help"]).chain(of_commands) {
        writeln!(text, "=== tapjoint {}", arguments.join(" ")).unwrap();
        text.push_str(&put_out(folder.path(), &arguments));
        text.push('\n');
    }
    assert_snapshot("help", &text);
}
