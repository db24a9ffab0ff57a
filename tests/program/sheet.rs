//! The sheet of a test: what is filed and signed.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;
use sha2::{Digest, Sha256};

use super::browser::chromium;

/// A sample with a sheet that is full of signs.
fn described(folder: &Path) {
    let path = folder.join("recordings/cantilever/test.toml");
    let text = fs::read_to_string(&path).unwrap();
    let text = text.replace(
        "channel = 1\n",
        "channel = 1\ninstrument = \"Hammer <5>\"\n",
    );
    let sheet = "\n[sheet]\nnumber = \"17\"\ndate = 2024-05-17\noperator = \"A. Tester\"\n\
                 specimen = '</style><b>\"no. 12\" \\5'\nremarks = \"12 N m\"\n";
    fs::write(path, text + sheet).unwrap();
}

fn run(folder: &Path) -> (String, String, Value) {
    let test = "recordings/cantilever/test.toml";
    super::tapjoint(folder, &["run", test, "--out", "r", "--sheet"], 0);
    let read = |name: &str| fs::read_to_string(folder.join("r").join(name)).unwrap();
    let report = serde_json::from_str(&read("report.json")).unwrap();
    (read("sheet.html"), read("report.html"), report)
}

#[test]
fn prop_the_sheet_names_the_files_by_their_content() {
    let folder = super::samples();
    described(folder.path());
    let (sheet, page, report) = run(folder.path());
    let files = report["sheet"]["files"].as_array().unwrap();
    let names: Vec<&str> = files
        .iter()
        .map(|one| one["file"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["test.toml", "low.wav", "high.wav"]);
    for file in files {
        let name = file["file"].as_str().unwrap();
        let bytes = fs::read(folder.path().join("recordings/cantilever").join(name)).unwrap();
        let sum: String = Sha256::digest(&bytes)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        assert_eq!(file["sha256"], sum.as_str(), "{name}");
        assert_eq!(file["bytes"], bytes.len());
        assert!(sheet.contains(&sum) && page.contains(&sum), "{name}");
    }
    // Texts are texts: they end neither the style nor a tag.
    for html in [&sheet, &page] {
        assert!(
            !html.contains("</style><b>"),
            "a text of the description became markup"
        );
        assert!(
            html.contains("&#60;/style&#62;&#60;b&#62;"),
            "the specimen is missing"
        );
        assert!(html.contains("Hammer &#60;5&#62;") && html.contains("2024-05-17"));
        assert!(html.contains("counter(page)"), "pages have no numbers");
    }
    // Without the option there are no checksums, and an earlier sheet goes.
    let test = "recordings/cantilever/test.toml";
    super::tapjoint(folder.path(), &["run", test, "--out", "r"], 0);
    assert!(!folder.path().join("r/sheet.html").exists());
}

#[test]
fn limit_the_fullest_sheet_is_one_page() {
    let Some(chromium) = chromium() else { return };
    let folder = super::samples();
    described(folder.path());
    let path = folder.path().join("recordings/cantilever/test.toml");
    let mut text = fs::read_to_string(&path).unwrap();
    text = text.replace(
        "remarks = \"12 N m\"",
        &format!("remarks = \"{}\"", "long ".repeat(59)),
    );
    text = text.replace("A. Tester", &"W".repeat(60));
    text = text.replace(
        "name = \"Cantilever\"",
        &format!("name = \"{}\"", "W".repeat(150)),
    );
    text = text.replace(
        "specimen = '</style><b>\"no. 12\" \\5'",
        &format!("specimen = '{}'", "W".repeat(60)),
    );
    text = text.replace("Hammer <5>", &"W".repeat(60));
    // The same recording in other bands, each a file of its own for the list.
    for copy in 0..9 {
        let file = format!("{}-{copy}.wav", "W".repeat(120));
        fs::copy(path.with_file_name("low.wav"), path.with_file_name(&file)).unwrap();
        let table = format!(
            "[[recording]]\nfile = \"{file}\"\ntap = \"385 mm\"\nband = [0, 200]\n\n[sheet]"
        );
        text = text.replacen("[sheet]", &table, 1);
    }
    fs::write(&path, text).unwrap();
    run(folder.path());
    let profile = tempfile::tempdir().unwrap();
    let pdf = folder.path().join("sheet.pdf");
    let printed = Command::new(chromium)
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--no-pdf-header-footer",
        ])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("--print-to-pdf={}", pdf.display()))
        .arg(format!(
            "file://{}",
            folder.path().join("r/sheet.html").display()
        ))
        .output();
    printed.unwrap();
    let pdf = fs::read(pdf).unwrap();
    let text = String::from_utf8_lossy(&pdf);
    let pages = text.matches("/Type /Page\n").count();
    assert_eq!(pages, 1, "pages of the sheet");
}
