//! No command replaces a file that it reads, a file twice, or a file that somebody else made.

use super::{commands, program, samples, tapjoint};
use assert_cmd::Command;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// A command with what it reads and writes; every command also writes `--json FILE`.
struct Row {
    /// The command and its arguments, outputs left out.
    arguments: &'static [&'static str],
    /// Files that it reads: those among the arguments, and those that a description or a folder names.
    inputs: &'static [&'static str],
    /// Options that name a file to be written.
    files: &'static [&'static str],
    /// Options that name a folder to be filled.
    folders: &'static [Folder],
}

/// An option that names a folder to be filled.
struct Folder {
    option: &'static str,
    /// A file that will be written there.
    name: &'static str,
    /// The argument that can be a file of this name.
    input: Option<&'static str>,
}

const fn row(
    arguments: &'static [&'static str],
    inputs: &'static [&'static str],
    files: &'static [&'static str],
    folders: &'static [Folder],
) -> Row {
    Row {
        arguments,
        inputs,
        files,
        folders,
    }
}

const fn folder(option: &'static str, name: &'static str, input: Option<&'static str>) -> Folder {
    Folder {
        option,
        name,
        input,
    }
}

/// All commands. Options that name inputs are `--report`, `--folder` and `--truth`.
const TABLE: &[Row] = &[
    row(
        &["run", "test.toml"],
        &["test.toml", "taps.wav"],
        &[],
        &[folder("--out", "updated-model.toml", Some("test.toml"))],
    ),
    row(
        &["run", "taps.wav", "--hammer", "1"],
        &["taps.wav"],
        &[],
        &[folder("--out", "report.html", None)],
    ),
    row(
        &["run", "test.toml", "--export"],
        &["test.toml", "taps.wav"],
        &[],
        &[folder("--out", "modes.uff", None)],
    ),
    row(
        &[
            "listen",
            "test.toml",
            "--replay",
            "taps.wav",
            "--speed",
            "max",
        ],
        &["test.toml", "taps.wav"],
        &[],
        &[folder("--out", "updated-model.toml", Some("test.toml"))],
    ),
    row(
        &["watch", "test.toml", "--runs", "1", "--interval", "0.1"],
        &["test.toml", "taps.wav"],
        &[],
        &[folder("--out", "updated-model.toml", Some("test.toml"))],
    ),
    row(
        &["identify", "modes.toml"],
        &["modes.toml", "modes.unv"],
        &[],
        &[],
    ),
    row(&["init", "taps.wav"], &["taps.wav"], &[], &[]),
    row(
        &["inspect", "truth.csv", "taps.wav"],
        &["truth.csv", "taps.wav"],
        &[],
        &[],
    ),
    row(
        &["spectrum", "taps.wav", "--hammer", "1"],
        &["taps.wav"],
        &["--png", "--csv"],
        &[],
    ),
    row(
        &["frf", "test.toml"],
        &["test.toml", "taps.wav"],
        &["--png", "--csv", "--uff58", "--uff58b"],
        &[],
    ),
    row(
        &["frf", "taps.wav", "--hammer", "1"],
        &["taps.wav"],
        &["--png", "--csv", "--uff58", "--uff58b"],
        &[],
    ),
    row(
        &["identify", "test.toml"],
        &["test.toml", "taps.wav"],
        &[],
        &[],
    ),
    row(
        &["predict", "test.toml", "--kx", "824", "--ky", "15"],
        &["test.toml", "taps.wav"],
        &[],
        &[],
    ),
    row(
        &["perturb", "test.toml", "--samples", "10"],
        &["test.toml", "taps.wav"],
        &["--png", "--csv"],
        &[],
    ),
    row(
        &["plan", "planned.toml", "--draws", "1", "--modes", "3"],
        &["planned.toml"],
        &["--png"],
        &[],
    ),
    row(
        &["diagnose", "cantilever/test.toml"],
        &[
            "cantilever/test.toml",
            "cantilever/low.wav",
            "cantilever/high.wav",
        ],
        &["--model"],
        &[],
    ),
    row(
        &["compare", "cantilever/test.toml", "cantilever/test.toml"],
        &[
            "cantilever/test.toml",
            "cantilever/low.wav",
            "cantilever/high.wav",
        ],
        &["--png"],
        &[folder("--out", "compare-spectra.svg", None)],
    ),
    row(
        &[
            "compare",
            "--before",
            "cantilever/test.toml",
            "--after",
            "cantilever/test.toml",
        ],
        &[
            "cantilever/test.toml",
            "cantilever/low.wav",
            "cantilever/high.wav",
        ],
        &[],
        &[],
    ),
    row(
        &[
            "compare",
            "--pair",
            "cantilever/test.toml",
            "cantilever/test.toml",
        ],
        &[
            "cantilever/test.toml",
            "cantilever/low.wav",
            "cantilever/high.wav",
        ],
        &[],
        &[],
    ),
    row(
        &[
            "compare",
            "--series",
            "cantilever/test.toml",
            "cantilever/test.toml",
            "cantilever/test.toml",
        ],
        &[
            "cantilever/test.toml",
            "cantilever/low.wav",
            "cantilever/high.wav",
        ],
        &["--png", "--csv"],
        &[folder("--out", "series.csv", None)],
    ),
    row(
        &["batch", "--from", "list.txt", "--no-diagnosis"],
        &["list.txt", "cantilever/test.toml", "cantilever/low.wav"],
        &[],
        &[],
    ),
    row(
        &["batch", "--table", "rows.csv", "--no-diagnosis"],
        &["rows.csv", "cantilever/test.toml", "cantilever/low.wav"],
        &[],
        &[],
    ),
    row(
        &["batch", "cantilever", "--no-diagnosis"],
        &[
            "cantilever/test.toml",
            "cantilever/low.wav",
            "cantilever/high.wav",
        ],
        &[],
        &[folder("--out", "tests.csv", None)],
    ),
    row(
        &["blind-check", "--folder", "tests", "--truth", "truths.json"],
        &["truths.json", "tests/a/test.toml", "tests/a/taps.wav"],
        &[],
        &[folder("--out", "truth.json", Some("truths.json"))],
    ),
    row(
        &["blind-check", "--cases", "1", "--one-recording"],
        &[],
        &[],
        &[
            folder("--out", "score.json", None),
            folder("--keep", "truth.json", None),
        ],
    ),
    row(
        &[
            "blind-check",
            "--compare",
            "--folder",
            "pairs",
            "--truth",
            "pairs.json",
        ],
        &[
            "pairs.json",
            "pairs/a/before/test.toml",
            "pairs/a/before/taps.wav",
            "pairs/a/after/test.toml",
            "pairs/a/after/taps.wav",
        ],
        &[],
        &[folder("--out", "truth.json", Some("pairs.json"))],
    ),
    row(
        &["blind-check", "--compare", "--cases", "1"],
        &[],
        &[],
        &[
            folder("--out", "cases.csv", None),
            folder("--keep", "truth.json", None),
        ],
    ),
    row(
        &[
            "resolution",
            "test.toml",
            "--blocks",
            "1024",
            "--draws",
            "2",
            "--fit-draws",
            "2",
        ],
        &["test.toml", "taps.wav"],
        &["--png", "--csv"],
        &[],
    ),
    row(&["reproduce"], &[], &[], &[]),
    row(
        &["export", "test.toml", "--report", "report.json"],
        &["test.toml", "taps.wav", "report.json"],
        &["--out"],
        &[],
    ),
    row(&["completions", "bash"], &[], &[], &[]),
    row(
        &["man"],
        &[],
        &[],
        &[folder("--out", "tapjoint-run.1", None)],
    ),
    row(
        &[
            "simulate",
            "source.toml",
            "--kx",
            "824",
            "--ky",
            "15",
            "--seconds",
            "3",
            "--taps",
            "1",
        ],
        &["source.toml"],
        &[],
        &[folder("--out", "test.toml", Some("source.toml"))],
    ),
    row(
        &[
            "simulate",
            "source.toml",
            "--kx",
            "824",
            "--ky",
            "15",
            "--seconds",
            "3",
            "--taps",
            "1",
            "--change",
            "joint-change:kr=-5%",
        ],
        &["source.toml"],
        &[],
        &[folder("--out", "after/test.toml", Some("source.toml"))],
    ),
];

impl Row {
    /// Every option that names a file to be written.
    fn all_files(&self) -> Vec<&'static str> {
        [self.files, &["--json"]].concat()
    }

    /// The arguments with one file exchanged.
    fn with(&self, input: &str, other: &str) -> Vec<String> {
        let arguments = self.arguments.iter();
        arguments
            .map(|argument| if *argument == input { other } else { argument }.to_owned())
            .collect()
    }

    fn own(&self) -> Vec<String> {
        self.with("", "")
    }
}

/// A test whose modes are those of a file.
const MODES: &str = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n\
                     [joint]\nkind = \"cantilever\"\n[measured]\nfile = \"modes.unv\"\n";
const BY_PYUFF: &str = include_str!("../../src/signal/tests/it/recording_uff/pyuff-normal.unv");

/// A folder with all inputs of the table: a virtual test of a lap joint, the cantilever, a folder of tests.
fn inputs() -> tempfile::TempDir {
    let (folder, samples) = (tempfile::tempdir().unwrap(), samples());
    let place = folder.path();
    let copy = |from: &Path, to: &str| fs::copy(from, place.join(to)).unwrap();
    copy(
        &samples.path().join("recordings/lap-joint/source.toml"),
        "source.toml",
    );
    copy(
        &samples.path().join("examples/five_recordings.toml"),
        "planned.toml",
    );
    let arguments = ["simulate", "source.toml", "--kx", "824", "--ky", "15.4"];
    let short = ["--seconds", "3", "--taps", "1", "--out", ".", "-q"];
    tapjoint(place, &[&arguments[..], &short].concat(), 0);
    let report = ["identify", "test.toml", "--json", "report.json", "-q"];
    tapjoint(place, &report, 0);
    for name in [
        "cantilever",
        "sub",
        "tests/a",
        "pairs/a/before",
        "pairs/a/after",
    ] {
        fs::create_dir_all(place.join(name)).unwrap();
    }
    for name in ["test.toml", "low.wav", "high.wav"] {
        let from = samples.path().join("recordings/cantilever").join(name);
        copy(&from, &format!("cantilever/{name}"));
    }
    for name in ["test.toml", "taps.wav"] {
        for test in ["tests/a", "pairs/a/before", "pairs/a/after"] {
            copy(&place.join(name), &format!("{test}/{name}"));
        }
    }
    fs::write(place.join("modes.toml"), MODES).unwrap();
    fs::write(place.join("modes.unv"), BY_PYUFF).unwrap();
    let truth = r#"[{"name": "a", "effects": [], "params": {}}]"#;
    fs::write(place.join("truths.json"), truth).unwrap();
    fs::write(place.join("list.txt"), "cantilever/test.toml\n").unwrap();
    fs::write(place.join("rows.csv"), "file\ncantilever/test.toml\n").unwrap();
    let truth = r#"[{"name": "a", "changes": []}]"#;
    fs::write(place.join("pairs.json"), truth).unwrap();
    let rows: Vec<String> = (0..2000)
        .map(|n| format!("{},{},{}\n", 1e-3 * f64::from(n), n % 7, n % 5))
        .collect();
    fs::write(
        place.join("truth.csv"),
        format!("time,force,a\n{}", rows.concat()),
    )
    .unwrap();
    folder
}

/// Runs the program; what it prints on standard error, and its exit code.
fn run(place: &Path, arguments: &[String]) -> (String, Option<i32>) {
    let mut command = Command::new(program());
    let output = command.current_dir(place).args(arguments).output().unwrap();
    (
        String::from_utf8_lossy(&output.stderr).into_owned(),
        output.status.code(),
    )
}

/// The program refuses, in these words; with `--force` too where that changes nothing.
fn refused(place: &Path, arguments: &[String], words: &[&str], even_by_force: bool) {
    let force = ["--force".to_owned()];
    let forced: &[&[String]] = if even_by_force {
        &[&[], &force]
    } else {
        &[&[]]
    };
    for more in forced {
        let arguments = [arguments, more].concat();
        let (told, code) = run(place, &arguments);
        assert_eq!(code, Some(2), "{arguments:?}: {told}");
        for words in words {
            assert!(told.contains(words), "{arguments:?}: {told}");
        }
    }
}

/// Other names of a file: its own, through a folder and back, a symbolic link, a hard link.
fn spellings(place: &Path, file: &str) -> Vec<String> {
    let (soft, hard) = ("soft-link", "hard-link");
    for link in [soft, hard] {
        let _ = fs::remove_file(place.join(link));
    }
    let mut names = vec![file.to_owned(), format!("sub/../{file}")];
    names.push(place.join(file).to_string_lossy().into_owned());
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(place.join(file), place.join(soft)).unwrap();
        fs::hard_link(place.join(file), place.join(hard)).unwrap();
        names.extend([soft, hard].map(str::to_owned));
    }
    names
}

const IS_INPUT: &str = "is an input of this command and cannot be its output";

#[test]
fn prop_no_output_is_an_input() {
    let folder = inputs();
    let place = folder.path();
    for row in TABLE {
        for input in row.inputs {
            let before = fs::read(place.join(input)).unwrap();
            for name in spellings(place, input) {
                for option in row.all_files() {
                    let mut arguments = row.own();
                    arguments.extend([option.to_owned(), name.clone()]);
                    // Some commands demand their folder.
                    for Folder { option, .. } in row.folders {
                        arguments.extend([(*option).to_owned(), format!("new{option}")]);
                    }
                    refused(place, &arguments, &[IS_INPUT, option, &name], true);
                    assert!(fs::read(place.join(input)).unwrap() == before, "{name}");
                }
            }
        }
    }
}

#[test]
fn prop_no_folder_is_filled_over_an_input() {
    let folder = inputs();
    let place = folder.path();
    let rows = TABLE
        .iter()
        .flat_map(|row| row.folders.iter().map(move |folder| (row, folder)));
    for (
        row,
        Folder {
            option,
            name,
            input,
        },
    ) in rows
    {
        let Some(input) = input else {
            continue;
        };
        for kind in ["itself", "soft", "hard"] {
            let filled = place.join("filled");
            let _ = fs::remove_dir_all(&filled);
            let target = filled.join(name);
            fs::create_dir_all(target.parent().unwrap()).unwrap();
            let given = match kind {
                "itself" => {
                    fs::copy(place.join(input), &target).unwrap();
                    format!("filled/{name}")
                }
                #[cfg(unix)]
                "soft" => {
                    std::os::unix::fs::symlink(place.join(input), &target).unwrap();
                    (*input).to_owned()
                }
                _ => {
                    fs::hard_link(place.join(input), &target).unwrap();
                    (*input).to_owned()
                }
            };
            let before = fs::read(&target).unwrap();
            for out in ["filled", "sub/../filled"] {
                let output = [(*option).to_owned(), out.to_owned()];
                let arguments = [row.with(input, &given), output.to_vec()].concat();
                refused(place, &arguments, &[IS_INPUT, option, name], true);
                assert!(fs::read(&target).unwrap() == before, "{arguments:?}");
            }
        }
    }
}

#[test]
fn prop_no_two_outputs_are_one_file() {
    let folder = inputs();
    let place = folder.path();
    let text = str::to_owned;
    for row in TABLE {
        let files = row.all_files();
        for (number, first) in files.iter().enumerate() {
            for second in files.iter().skip(number + 1) {
                let outputs = [*first, "same", *second, "sub/../same"].map(text);
                let arguments = [row.own(), outputs.to_vec()].concat();
                refused(
                    place,
                    &arguments,
                    &["the output of both", first, second],
                    true,
                );
            }
        }
        for Folder { option, name, .. } in row.folders {
            let json = format!("new/{name}");
            let outputs = [*option, "new", "--json", &json].map(text);
            let arguments = [row.own(), outputs.to_vec()].concat();
            refused(
                place,
                &arguments,
                &["the output of both", option, "--json"],
                true,
            );
        }
    }
    let keep = ["blind-check", "--out", "new", "--keep", "new"].map(text);
    refused(place, &keep, &["the output of both"], true);
    let left = ["same", "new"].map(|name| place.join(name).exists());
    assert_eq!(left, [false, false]);
}

#[test]
fn prop_foreign_files_are_replaced_by_force_alone_and_own_files_freely() {
    let folder = inputs();
    let place = folder.path();
    const MINE: &str = "measured by hand";
    for (number, row) in TABLE.iter().enumerate() {
        let out = place.join(format!("out-{number}"));
        let mut outputs = Vec::new();
        let mut written = Vec::new();
        for option in row.all_files() {
            let file = out.join(format!("file{option}"));
            outputs.extend([option.to_owned(), file.to_string_lossy().into_owned()]);
            written.push((option, file));
        }
        for Folder { option, name, .. } in row.folders {
            let filled = out.join(format!("folder{option}"));
            outputs.extend([(*option).to_owned(), filled.to_string_lossy().into_owned()]);
            // The name in the table may be of a file that is not always made.
            let name = if *name == "updated-model.toml" {
                "modes.csv"
            } else {
                name
            };
            written.push((option, filled.join(name)));
        }
        let arguments = [row.own(), outputs].concat();
        for (option, file) in &written {
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, MINE).unwrap();
            let words: &[&str] = match *option {
                // A folder of kept tests is filled as a whole.
                "--keep" => &["--keep", "--force"],
                _ => &["was not made by tapjoint", option, "--force"],
            };
            refused(place, &arguments, words, false);
            assert_eq!(fs::read_to_string(file).unwrap(), MINE);
            fs::remove_file(file).unwrap();
        }
        for (_, file) in &written {
            fs::write(file, MINE).unwrap();
        }
        let forced = [arguments.clone(), vec!["--force".to_owned()]].concat();
        for arguments in [&forced, &arguments] {
            let (told, code) = run(place, arguments);
            assert!(code.is_some_and(|code| code < 2), "{arguments:?}: {told}");
            for (_, file) in &written {
                let bytes = fs::read(file).unwrap();
                assert!(
                    bytes != MINE.as_bytes(),
                    "{arguments:?} left {file:?}: {told}"
                );
            }
        }
    }
}

#[test]
fn regress_measured_recordings_survive_simulate() {
    let folder = inputs();
    let place = folder.path();
    let simulate = [
        "simulate",
        "source.toml",
        "--kx",
        "824",
        "--ky",
        "15.4",
        "--seconds",
        "3",
    ];
    let simulate = [&simulate[..], &["--taps", "1", "--out", "measured", "-q"]].concat();
    fs::create_dir(place.join("measured")).unwrap();
    for name in ["taps.wav", "test.toml", "truth.json"] {
        let mine = place.join("measured").join(name);
        fs::write(&mine, "mine").unwrap();
        tapjoint(place, &simulate, 2);
        assert_eq!(fs::read_to_string(&mine).unwrap(), "mine");
        fs::remove_file(mine).unwrap();
    }
    tapjoint(place, &simulate, 0);
    tapjoint(place, &simulate, 0);
    // A recording, or a description, that was changed since is its user's.
    for name in ["taps.wav", "test.toml"] {
        let file = place.join("measured").join(name);
        let made = fs::read(&file).unwrap();
        fs::write(&file, [&made[..], b"\n"].concat()).unwrap();
        tapjoint(place, &simulate, 2);
        fs::write(&file, made).unwrap();
    }
    tapjoint(place, &simulate, 0);
}

#[test]
fn limit_empty_files_devices_and_pipes_are_written_to() {
    let folder = inputs();
    let place = folder.path();
    fs::write(place.join("empty"), "").unwrap();
    tapjoint(place, &["init", "--json", "empty"], 0);
    assert!(
        fs::read_to_string(place.join("empty"))
            .unwrap()
            .contains("template")
    );
    let json = tapjoint(place, &["init", "--json", "-"], 0);
    assert!(json.starts_with('{'), "{json}");
    if cfg!(unix) {
        let both = [
            "frf",
            "test.toml",
            "--csv",
            "/dev/null",
            "--json",
            "/dev/null",
        ];
        tapjoint(place, &both, 0);
        let printed = tapjoint(place, &["init", "-q", "--json", "/dev/stdout"], 0);
        assert!(printed.starts_with('{'), "{printed}");
    }
}

/// Names of options with a file or a folder, of all commands.
fn options(place: &Path) -> BTreeSet<(String, String)> {
    let mut found = BTreeSet::new();
    for command in commands(place) {
        let help = tapjoint(place, &[&command, "--help"], 0);
        for line in help.lines().map(str::trim) {
            let named = line.split_once(" <FILE>").or(line.split_once(" <DIR>"));
            let option = named.and_then(|(option, _)| option.split_whitespace().next_back());
            for option in option.into_iter().filter(|option| option.starts_with("--")) {
                found.insert((command.clone(), option.to_owned()));
            }
        }
    }
    found
}

#[test]
fn prop_the_table_has_every_option_with_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut listed = BTreeSet::new();
    for row in TABLE {
        let command = row.arguments[0];
        let given = row.arguments.iter().filter(|argument| {
            [
                "--report", "--folder", "--truth", "--before", "--after", "--pair", "--series",
                "--from", "--table", "--replay",
            ]
            .contains(argument)
        });
        let folders = row.folders.iter().map(|folder| folder.option);
        let options = row
            .all_files()
            .into_iter()
            .chain(given.copied())
            .chain(folders);
        listed.extend(options.map(|option| (command.to_owned(), option.to_owned())));
    }
    assert_eq!(listed, options(folder.path()));
}
