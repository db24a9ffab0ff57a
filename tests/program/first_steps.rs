//! The first minutes with the program: help, slips of the pen, templates, completions, manual pages.

use assert_cmd::Command;
use std::path::Path;

fn tapjoint(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("tapjoint").unwrap();
    command.current_dir(folder);
    command
}

/// Standard output and standard error of a command that ends with this code.
fn told(folder: &Path, arguments: &[&str], code: i32) -> (String, String) {
    let done = tapjoint(folder).args(arguments).assert().code(code);
    let output = done.get_output();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (text(&output.stdout), text(&output.stderr))
}

/// Names of all commands, from the completion script of fish: one line names each.
fn commands(folder: &Path) -> Vec<String> {
    let (script, _) = told(folder, &["completions", "fish"], 0);
    let mut names: Vec<String> = script
        .lines()
        .filter(|line| line.contains("__fish_tapjoint_needs_command"))
        .filter_map(|line| line.split_once("-a \"")?.1.split_once('"'))
        .map(|(name, _)| name.to_owned())
        .collect();
    names.sort();
    names.dedup();
    names
}

#[test]
fn prop_help_lists_every_command_once_under_a_task() {
    let folder = tempfile::tempdir().unwrap();
    let (help, _) = told(folder.path(), &["help"], 0);
    let names = commands(folder.path());
    assert!(names.len() >= 12, "{names:?}");
    for name in names {
        let lines = help.lines().filter(|line| {
            line.starts_with("  ") && line.split_whitespace().next() == Some(name.as_str())
        });
        assert_eq!(lines.count(), 1, "{name} in:\n{help}");
    }
    let tasks = [
        "A test from recordings to report:",
        "Spectra:",
        "The joint:",
    ];
    for task in tasks {
        assert!(help.contains(task), "{task} is missing");
    }
    // A command without a task would stand among those that only serve the program.
    let (_, program) = help.split_once("The program itself:\n").unwrap();
    let names = program.lines().take_while(|line| !line.is_empty());
    let names = names.filter_map(|line| line.split_whitespace().next());
    assert_eq!(names.collect::<Vec<_>>(), ["completions", "man", "help"]);
    let list = help.split("Options:").next().unwrap_or_default();
    let longest = list.lines().skip_while(|line| !line.ends_with("report:"));
    assert!(longest.clone().count() > 10, "the list was found");
    for line in longest {
        assert!(line.chars().count() <= 80, "wider than 80 columns: {line}");
        assert!(!line.ends_with("..."), "cut off: {line}");
    }
}

#[test]
fn regress_mistyped_commands_are_suggested() {
    let folder = tempfile::tempdir().unwrap();
    for (slip, meant) in [
        ("rnu", "run"),
        ("specturm", "spectrum"),
        ("idntify", "identify"),
        ("rfr", "frf"),
    ] {
        let (_, error) = told(folder.path(), &[slip], 2);
        assert!(error.contains(&format!("'{meant}'")), "{slip}: {error}");
    }
    let (_, error) = told(folder.path(), &["xyzzyxyzzy"], 2);
    assert!(!error.contains("tip:"), "nothing is near: {error}");
}

#[test]
fn regress_the_printed_template_runs_as_it_is() {
    for kind in ["cantilever", "lap", "free"] {
        let folder = tempfile::tempdir().unwrap();
        let (template, _) = told(folder.path(), &["init", "--kind", kind], 0);
        std::fs::write(folder.path().join("test.toml"), template).unwrap();
        let (text, error) = told(folder.path(), &["run", "test.toml"], 0);
        assert_eq!(error, "", "{kind}");
        assert!(text.contains("report.html"), "{kind}: {text}");
        assert!(!text.contains("warning (misfit)"), "{kind}: {text}");
    }
}

#[test]
fn regress_a_template_of_recordings_names_them() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["a.wav", "b \"c\".wav"];
    let (template, _) = told(folder.path(), &["init", files[0], files[1]], 0);
    let test = tapjoint::description::TestDescription::parse(&template, "test.toml")
        .unwrap_or_else(|error| panic!("{error}"));
    let named: Vec<_> = test.recordings.iter().map(|r| r.file.clone()).collect();
    assert_eq!(named, files.map(std::path::PathBuf::from));
    // Nothing but the table of the file itself has gone.
    let plain = tapjoint::description::template(tapjoint::description::Assembly::Cantilever);
    for line in plain.lines().filter(|line| !line.starts_with("file = ")) {
        assert!(template.contains(line), "lost: {line}");
    }
    std::fs::write(folder.path().join("test.toml"), &template).unwrap();
    let (_, error) = told(folder.path(), &["run", "test.toml"], 2);
    assert!(
        error.contains("test.toml:") && error.contains("a.wav"),
        "{error}"
    );
}

#[test]
fn regress_a_hammer_that_is_named_or_forgotten_is_suggested() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("time,ch1_force_V,ch2_acc_V\n");
    for index in 0..8000 {
        let after = f64::from(index % 4000 - 500);
        let force = (-(after / 3.0).powi(2)).exp();
        let rings = if after > 0.0 {
            (-after / 400.0).exp() * (0.3 * after).sin()
        } else {
            0.0
        };
        text.push_str(&format!(
            "{},{force:.5},{rings:.5}\n",
            f64::from(index) / 1e4
        ));
    }
    std::fs::write(folder.path().join("x.csv"), text).unwrap();
    let (_, error) = told(folder.path(), &["run", "x.csv", "--hammer", "force"], 2);
    assert!(error.contains("did you mean \"ch1_force_V\"?"), "{error}");
    let (text, _) = told(folder.path(), &["run", "x.csv"], 0);
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("say --hammer ch1_force_V"), "{text}");
    let (text, _) = told(folder.path(), &["spectrum", "x.csv", "--hammer", "1"], 0);
    assert!(!text.contains("may be the hammer"), "{text}");
    // A sensor that is taken for the hammer.
    let taps = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/cantilever/low.wav");
    std::fs::copy(taps, folder.path().join("low.wav")).unwrap();
    let (text, _) = told(folder.path(), &["run", "low.wav", "--hammer", "2"], 1);
    let wanted = "> low.wav: most taps are rejected. Channel 1 has the short pulses of a hammer.\n  If it is the hammer, say --hammer 1, or \
                  correct the hammer's `channel` in the\n  description.\n";
    assert!(text.contains(wanted), "{text}");
    // Nothing but noise.
    let mut noise = String::from("time,a\n");
    for index in 0..8000_u32 {
        let value = index.wrapping_mul(2_654_435_761) >> 16;
        noise.push_str(&format!("{},{value}\n", f64::from(index) / 1e4));
    }
    std::fs::write(folder.path().join("noise.csv"), noise).unwrap();
    let (text, _) = told(folder.path(), &["run", "noise.csv"], 1);
    let wanted = "> Check the cables, the gain and the numbers of the channels.\n";
    assert!(text.contains(wanted), "{text}");
}

#[test]
fn limit_a_folder_stands_for_its_only_description() {
    let folder = super::samples();
    let test = folder.path().join("recordings/cantilever");
    let (_, error) = told(folder.path(), &["run", "recordings/cantilever"], 2);
    let wanted = "2 descriptions: source.toml, test.toml; name one";
    assert!(error.contains(wanted), "{error}");
    std::fs::remove_file(test.join("source.toml")).unwrap();
    let (text, _) = told(folder.path(), &["run", "recordings/cantilever"], 0);
    let page = "recordings/cantilever/Cantilever-report/report.html";
    // The default folder of the report stands beside the description.
    assert!(text.contains(page), "{text}");
    let (_, error) = told(folder.path(), &["run", "examples/.."], 2);
    assert!(error.contains("a folder without a description"), "{error}");
}

#[test]
fn recover_recordings_in_a_folder_are_one_test() {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings");
    let own = folder.path().join("taps.2026");
    std::fs::create_dir(&own).unwrap();
    let copy = |from: &str, to: &str| std::fs::copy(root.join(from), own.join(to)).unwrap();
    copy("cantilever/low.wav", "low.wav");
    // One recording is itself, and its report stands beside it.
    let (text, _) = told(folder.path(), &["run", "taps.2026", "--hammer", "1"], 0);
    assert!(text.contains("taps.2026/low-report/report.html"), "{text}");
    let report = |path: &str| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(own.join(path)).unwrap()).unwrap()
    };
    let alone = report("low-report/report.json");
    // Another of the same structure, and one of another rate and number of channels.
    copy("cantilever/high.wav", "high.wav");
    copy("nonlinear/soft.wav", "soft.WAV");
    std::fs::write(own.join("notes.txt"), "no recording").unwrap();
    std::fs::write(own.join("._low.wav"), "no recording").unwrap();
    let run = ["run", "taps.2026", "--hammer", "1"];
    let (text, error) = told(folder.path(), &run, 0);
    let page = "taps.2026/taps.2026-report/report.html";
    assert!(
        text.contains(page) && text.contains("3 recordings"),
        "{text}"
    );
    assert_eq!(error, "");
    let whole = report("taps.2026-report/report.json");
    assert_eq!(whole["test"]["name"], "taps.2026");
    let recordings = whole["recordings"].as_array().unwrap();
    let files: Vec<_> = recordings
        .iter()
        .map(|one| one["file"].as_str().unwrap())
        .collect();
    assert_eq!(files, ["high.wav", "low.wav", "soft.WAV"]);
    // Each is measured as it would be alone.
    let fitted = |recording: &serde_json::Value| -> Vec<f64> {
        let modes = recording["modes"].as_array().unwrap().iter();
        modes
            .map(|mode| mode["frequency"].as_f64().unwrap())
            .collect()
    };
    assert_eq!(fitted(&recordings[1]), fitted(&alone["recordings"][0]));
    assert!(!fitted(&recordings[1]).is_empty());
    // The report in the folder is none of its recordings.
    let again = told(folder.path(), &run, 0);
    assert_eq!(again, (text, error));
    let inside = [&run[..], &["--out", "taps.2026"]].concat();
    for _ in 0..2 {
        told(folder.path(), &inside, 0);
    }
    let inside = report("report.json");
    assert_eq!(inside["recordings"], whole["recordings"]);
    // Recordings are inputs.
    let json = ["run", "taps.2026", "--json", "taps.2026/high.wav"];
    let (_, error) = told(folder.path(), &json, 2);
    assert!(
        error.contains("high.wav: is an input of this command"),
        "{error}"
    );
}

#[test]
fn limit_a_folder_of_too_many_files_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for number in 0..=200 {
        std::fs::write(folder.path().join(format!("{number}.wav")), "").unwrap();
    }
    let (_, error) = told(folder.path(), &["run", "."], 2);
    assert!(
        error.contains("201 recordings; allowed: up to 200"),
        "{error}"
    );
    for number in 0..12 {
        std::fs::write(folder.path().join(format!("{number:02}.toml")), "").unwrap();
    }
    let (_, error) = told(folder.path(), &["run", "."], 2);
    let wanted = "12 descriptions: 00.toml, 01.toml, 02.toml, 03.toml, 04.toml, 05.toml, 06.toml, 07.toml, 08.toml, 09.toml, ...; name one";
    assert!(error.contains(wanted), "{error}");
}

#[test]
fn prop_completions_of_every_shell_name_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let names = commands(folder.path());
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let (script, _) = told(folder.path(), &["completions", shell], 0);
        for name in &names {
            assert!(script.contains(name.as_str()), "{shell} lacks {name}");
        }
    }
}

#[test]
fn prop_every_command_has_a_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    told(folder.path(), &["man", "--out", "man1"], 0);
    for name in commands(folder.path())
        .iter()
        .filter(|name| *name != "help")
    {
        let file = folder.path().join(format!("man1/tapjoint-{name}.1"));
        let page = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{name}: {e}"));
        let (printed, _) = told(folder.path(), &["man", name], 0);
        assert_eq!(page.trim_end(), printed.trim_end(), "{name}");
        assert!(page.contains(".SH OPTIONS") || page.contains(".SH \"COMMON OPTIONS\""));
    }
    let (own, _) = told(folder.path(), &["man"], 0);
    assert!(own.contains("tapjoint\\-run"), "{own}");
    let (_, error) = told(folder.path(), &["man", "rnu"], 2);
    assert!(error.contains("no command rnu"), "{error}");
}
