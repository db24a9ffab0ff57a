//! A run into a folder that holds an earlier report.

use super::{samples, tapjoint};
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
