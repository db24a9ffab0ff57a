//! A run into a folder that holds an earlier report.

use super::{program, samples, tapjoint};
use std::collections::BTreeSet;
use std::path::Path;
use tapjoint::report::{MODEL_FILE, earlier_files};

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let name = |entry: std::io::Result<std::fs::DirEntry>| entry.unwrap().file_name();
    entries
        .map(|entry| name(entry).to_string_lossy().into_owned())
        .collect()
}

#[test]
fn regress_a_run_leaves_nothing_of_an_earlier_one() {
    let folder = samples();
    let test = folder.path().join("recordings/cantilever/test.toml");
    let run = |out: &str| {
        tapjoint(
            folder.path(),
            &["run", &test.to_string_lossy(), "--out", out],
            0,
        )
    };
    run("report");
    let report = folder.path().join("report");
    let first = names(&report);
    for name in ["updated-model.toml", "gap.svg", "spectrum-high.png"] {
        assert!(first.contains(name), "{name} in {first:?}");
    }
    let foreign = ["notes.txt", "spectrum-mine.png", "taps-high-old.svg"];
    for name in foreign {
        std::fs::write(report.join(name), "mine").unwrap();
    }
    // Without the second recording there are fewer pictures, and of three modes no diagnosis names a cause.
    let text = std::fs::read_to_string(&test).unwrap();
    let (before, after) = text.rsplit_once("[[recording]]").unwrap();
    assert!(after.contains("high.wav"), "{after}");
    std::fs::write(&test, before).unwrap();
    run("report");
    run("fresh");
    let mut expected = names(&folder.path().join("fresh"));
    assert!(
        !expected.contains("spectrum-high.png") && !expected.contains("updated-model.toml"),
        "{expected:?}"
    );
    expected.extend(foreign.map(str::to_owned));
    assert_eq!(names(&report), expected);
    for name in foreign {
        assert_eq!(
            std::fs::read_to_string(report.join(name)).unwrap(),
            "mine",
            "{name}"
        );
    }
}

#[test]
fn regress_tests_of_one_name_have_reports_of_their_own() {
    let folder = samples();
    let test = folder.path().join("recordings/cantilever");
    for other in ["a.toml", "b.toml"] {
        std::fs::copy(test.join("test.toml"), test.join(other)).unwrap();
    }
    let run = |file: &str, more: &[&str]| {
        let file = format!("recordings/cantilever/{file}");
        let done = std::process::Command::new(program())
            .current_dir(folder.path())
            .args(["run", &file, "--json", "-"])
            .args(more)
            .output();
        let done = done.unwrap();
        let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
        let written = report["test"]["file"].as_str().unwrap().to_owned();
        (written, String::from_utf8(done.stderr).unwrap())
    };
    let report = |name: &str| std::fs::read_to_string(test.join(name).join("report.json")).unwrap();
    let quiet = ("test.toml".to_owned(), String::new());
    assert_eq!(run("test.toml", &[]), quiet);
    let first = report("Cantilever-report");
    for (file, number) in [("a.toml", 2), ("b.toml", 3), ("a.toml", 2)] {
        let (written, error) = run(file, &[]);
        let own = format!("Cantilever-{number}-report");
        assert_eq!(written, file);
        assert!(error.contains(&format!("this report goes to recordings/cantilever/{own}")));
        assert_eq!(error.lines().count(), 1, "{error}");
        assert!(report(&own).contains(&format!("\"file\": \"{file}\"")));
    }
    assert_eq!(report("Cantilever-report"), first);
    assert!(!test.join("Cantilever-4-report").exists());
    // The folder that was asked for is the folder.
    let (written, error) = run(
        "a.toml",
        &["--out", "recordings/cantilever/Cantilever-report"],
    );
    assert_eq!((written.as_str(), error.as_str()), ("a.toml", ""));
    // A report of an earlier version names no file.
    let old = report("Cantilever-report").replace("\"file\": \"a.toml\",", "");
    std::fs::write(test.join("Cantilever-report/report.json"), old).unwrap();
    assert_eq!(run("test.toml", &["--force"]), quiet);
    assert_eq!(report("Cantilever-report"), first);
}

#[test]
fn regress_a_comparison_leaves_nothing_of_an_earlier_report() {
    let folder = samples();
    let test = "recordings/cantilever/test.toml";
    let report = folder.path().join("report");
    let series = ["compare", "--series", test, test, test];
    let stated = ["--repeatability", "0.1 %"];
    let pair = ["compare", test, test];
    let run = |words: &[&str], out: &str| {
        tapjoint(
            folder.path(),
            &[words, &stated, &["--out", out]].concat(),
            0,
        );
    };
    tapjoint(folder.path(), &["run", test, "--out", "report"], 0);
    // Files of those names that somebody else has made.
    let foreign = ["spectrum-mine.png", "series.txt"];
    for name in foreign {
        std::fs::write(report.join(name), "mine").unwrap();
    }
    for (words, out) in [(&series[..], "series"), (&pair[..], "pair")] {
        run(words, "report");
        run(words, out);
        let mut expected = names(&folder.path().join(out));
        assert!(expected.contains("report.html"), "{expected:?}");
        expected.extend(foreign.map(str::to_owned));
        // The list that the run has begun, because taps.csv has no mark, goes on.
        expected.insert("made-by-tapjoint.sha256".to_owned());
        assert_eq!(names(&report), expected, "{out}");
    }
    // A run takes the place of a comparison, too.
    tapjoint(folder.path(), &["run", test, "--out", "report"], 0);
    assert!(!names(&report).contains("compare.png"));
    let listed = names(&folder.path().join("pair"));
    let ours = r#"{"version": 1, "warnings": [], "compare": {}}"#;
    let ours: BTreeSet<String> = earlier_files(ours).into_iter().collect();
    assert_eq!(listed, ours);
}

#[test]
fn regress_files_of_other_reports_are_somebody_elses() {
    let of =
        |sections: &str| earlier_files(&format!("{{\"version\": 1, \"warnings\": []{sections}}}"));
    let [run, pair] = [of(""), of(r#", "compare": {}"#)];
    let series = of(r#", "series": {}"#);
    for name in ["changes.csv", "compare-spectra.svg"] {
        assert!(pair.contains(&name.to_owned()), "{name}");
        assert!(
            ![&run, &series]
                .iter()
                .any(|names| names.contains(&name.to_owned()))
        );
    }
    for name in ["series.csv", "series.png"] {
        assert!(series.contains(&name.to_owned()), "{name}");
        assert!(
            ![&run, &pair]
                .iter()
                .any(|names| names.contains(&name.to_owned()))
        );
    }
    assert!(!pair.contains(&"modes.csv".to_owned()));
}

#[test]
fn regress_a_folder_without_a_report_is_left_as_it_is() {
    let folder = samples();
    let report = folder.path().join("pictures");
    std::fs::create_dir(&report).unwrap();
    // The name of a picture of ours, in a folder that holds no report: somebody else's.
    std::fs::write(report.join("amplitude-old.png"), "mine").unwrap();
    // What another command writes with `--json report.json` comes without a page.
    let other = r#"{"version": 1, "warnings": [], "recordings": [{"file": "old.wav"}]}"#;
    std::fs::write(report.join("report.json"), other).unwrap();
    assert!(earlier_files(other).contains(&"amplitude-old.png".to_owned()));
    let test = "recordings/cantilever/test.toml";
    tapjoint(folder.path(), &["run", test, "--out", "pictures"], 0);
    let kept = std::fs::read_to_string(report.join("amplitude-old.png")).unwrap();
    assert_eq!(kept, "mine");
}

#[test]
fn regress_a_model_is_an_earlier_runs_only_where_its_report_says_so() {
    let has_model = |gap: &str| {
        let report = format!("{{\"version\": 1, \"warnings\": [], \"gap\": {gap}}}");
        earlier_files(&report).contains(&MODEL_FILE.to_owned())
    };
    assert!(has_model(
        r#"{"updated_model": {"file": "updated-model.toml"}}"#
    ));
    for gap in [
        "null",
        r#"{"updated_model": null}"#,
        r#"{"updated_model": {"file": "model.toml"}}"#,
    ] {
        assert!(!has_model(gap), "{gap}");
    }
}
