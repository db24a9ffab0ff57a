//! Faults on the way to a result: it is there whole or not at all, and the message is true.
//!
//! `scripts/faults.py` tries many more, with random moments.

#![cfg(target_os = "linux")]

use super::{program, samples, tapjoint};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const RUN: [&str; 4] = ["run", "recordings/cantilever/test.toml", "--out", "report"];
const SPECTRUM: [&str; 4] = ["spectrum", "recordings/cantilever/low.wav", "--hammer", "1"];

/// All files of a folder with their bytes; a folder in it counts as an empty file.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    let read = |entry: fs::DirEntry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        (name, fs::read(entry.path()).unwrap_or_default())
    };
    entries.map(read).collect()
}

fn is_clean(folder: &Path) -> bool {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    let mut names = entries.map(|entry| entry.file_name());
    names.all(|name| !name.to_string_lossy().starts_with(".tapjoint-"))
}

fn with_output(folder: &Path, arguments: &[&str], output: Stdio) -> (Option<i32>, String) {
    let mut command = Command::new(program());
    command.current_dir(folder).args(arguments).stdout(output);
    let Output { status, stderr, .. } = command.output().unwrap();
    (status.code(), String::from_utf8(stderr).unwrap())
}

#[test]
fn regress_a_folder_in_the_way_leaves_the_earlier_report() {
    let folder = samples();
    let report = folder.path().join("report");
    tapjoint(folder.path(), &RUN, 0);
    fs::remove_file(report.join("spectrum-low.png")).unwrap();
    fs::create_dir(report.join("spectrum-low.png")).unwrap();
    let before = contents(&report);
    let other = [&RUN[..], &["--reading", "line"]].concat();
    let (code, told) = with_output(folder.path(), &other, Stdio::null());
    assert_eq!(code, Some(2), "{told}");
    assert!(told.contains("spectrum-low.png: is a folder"), "{told}");
    assert!(contents(&report) == before, "the report changed");
}

#[test]
fn regress_a_closed_or_full_output_keeps_the_results() {
    let folder = samples();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let json = [&RUN[..], &["--json", "run.json"]].concat();
    let (code, told) = with_output(folder.path(), &json, writer.into());
    assert_eq!((code, told.as_str()), (Some(0), ""));
    for name in ["report/report.html", "run.json"] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
    let full = fs::File::options().write(true).open("/dev/full").unwrap();
    let (code, told) = with_output(folder.path(), &RUN, full.into());
    assert_eq!(code, Some(2), "{told}");
    for words in ["standard output: ", "; written all the same: report"] {
        assert!(told.contains(words), "{told}");
    }
}

#[test]
fn limit_links_are_followed_and_stay() {
    use std::os::unix::fs::symlink;
    let folder = samples();
    let links = [
        ("link.png", "new.png", 0),
        ("nowhere.png", "no/such.png", 2),
        ("circle.png", "circle.png", 2),
    ];
    for (link, target, code) in links {
        let path = folder.path().join(link);
        symlink(target, &path).unwrap();
        let arguments = [&SPECTRUM[..], &["--png", link]].concat();
        tapjoint(folder.path(), &arguments, code);
        assert_eq!(fs::read_link(path).unwrap(), Path::new(target));
        assert_eq!(folder.path().join(target).is_file(), code == 0, "{target}");
    }
    symlink("new-report", folder.path().join("report")).unwrap();
    tapjoint(folder.path(), &RUN, 0);
    assert!(folder.path().join("new-report/report.html").is_file());
    assert!(
        fs::symlink_metadata(folder.path().join("report"))
            .unwrap()
            .is_symlink()
    );
    assert!(is_clean(folder.path()));
}

#[test]
fn recover_signals_leave_nothing_and_kills_are_swept() {
    let folder = samples();
    let made = Command::new("mkfifo")
        .arg(folder.path().join("pipe"))
        .status();
    assert!(made.unwrap().success());
    for (signal, code) in [("HUP", 129), ("INT", 130), ("TERM", 143), ("KILL", -1)] {
        // The picture's temporary file is made; then the program waits for a reader of the pipe.
        // Under `nohup` and in the background of a shell some signals are turned off, and would stay so. This option
        // of `env` is that of GNU coreutils from 8.31 on.
        let mut command = Command::new("env");
        command.arg("--default-signal=HUP,INT,TERM").arg(program());
        command.current_dir(folder.path()).stdout(Stdio::null());
        command.args(["frf", SPECTRUM[1], "--hammer", "1", "--png", "frf.png"]);
        let mut run = command.args(["--csv", "pipe"]).spawn().unwrap();
        while is_clean(folder.path()) {
            assert!(run.try_wait().unwrap().is_none(), "the program ended");
            std::thread::yield_now();
        }
        let sent = Command::new("kill")
            .args(["-s", signal, &run.id().to_string()])
            .status();
        assert!(sent.unwrap().success());
        let ended = run.wait().unwrap().code();
        assert_eq!(ended.unwrap_or(-1), code, "{signal}");
        assert_eq!(is_clean(folder.path()), signal != "KILL", "{signal}");
    }
    let arguments = [&SPECTRUM[..], &["--png", "spectrum.png"]].concat();
    tapjoint(folder.path(), &arguments, 0);
    assert!(is_clean(folder.path()), "the leftover of the killed run");
}
