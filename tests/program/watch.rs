//! A watched test: it runs again when one of its files changes, and its page reloads itself.

use super::{browser, program, samples, tapjoint};
use serde_json::Value;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Longest wait for a run; a run takes seconds.
const PATIENCE: Duration = Duration::from_secs(300);

/// The program at work in a folder. It is killed when the test ends early.
struct Watching(Child);

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Watching {
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        let messages = fs::File::create(folder.join("messages.txt")).unwrap();
        // In the background of a shell some signals are turned off, and would stay so.
        let mut command = Command::new("env");
        command.arg("--default-signal=INT,TERM").arg(program());
        command
            .current_dir(folder)
            .args(["watch", "--interval", "0.1"]);
        command
            .args(arguments)
            .stdout(Stdio::null())
            .stderr(messages);
        Self(command.spawn().unwrap())
    }

    /// Waits until something is so.
    fn until(&mut self, what: &str, is_so: impl Fn() -> bool) {
        let start = Instant::now();
        while !is_so() {
            assert!(self.0.try_wait().unwrap().is_none(), "{what}: it has ended");
            assert!(start.elapsed() < PATIENCE, "{what}: it takes too long");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Ends it by a signal and returns the exit code.
    fn end(mut self, signal: &str) -> Option<i32> {
        let sent = Command::new("kill")
            .args(["-s", signal, &self.0.id().to_string()])
            .status();
        assert!(sent.unwrap().success());
        self.0.wait().unwrap().code()
    }
}

fn text(path: &Path) -> String {
    let mut text = String::new();
    if let Ok(mut file) = fs::File::open(path) {
        file.read_to_string(&mut text).unwrap();
    }
    text
}

/// The lines that say why there was a run, and the errors.
fn messages(folder: &Path) -> Vec<String> {
    let text = text(&folder.join("messages.txt"));
    let lines = text.lines().filter(|line| !line.starts_with("warning: "));
    lines.map(str::to_owned).collect()
}

/// Replaces a file at once, as many editors do.
fn replace(path: &Path, text: &str) {
    let aside = path.with_extension("aside");
    fs::write(&aside, text).unwrap();
    fs::rename(aside, path).unwrap();
}

fn is_clean(folder: &Path) -> bool {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    let mut names = entries.map(|entry| entry.file_name());
    names.all(|name| !name.to_string_lossy().starts_with(".tapjoint-"))
}

#[test]
fn recover_a_changed_description_is_run_again() {
    let folder = samples();
    let test = folder.path().join("recordings/cantilever/test.toml");
    let report = folder.path().join("report");
    let name = || -> Option<String> {
        let report: Value = serde_json::from_str(&text(&report.join("report.json"))).ok()?;
        Some(report["test"]["name"].as_str()?.to_owned())
    };
    let given = ["recordings/cantilever/test.toml", "--out", "report"];
    let mut watching = Watching::start(folder.path(), &given);
    watching.until("the first run", || name().is_some());
    let version = text(&report.join("report-version.js"));
    let page = text(&report.join("report.html"));
    let own = version.split('"').nth(1).unwrap();
    assert!(page.contains(&format!("var own = \"{own}\";")), "{version}");
    let described = text(&test);
    let renamed = described.replace("name = \"Cantilever\"", "name = \"Renamed\"");
    replace(&test, &renamed);
    watching.until("the second run", || name().as_deref() == Some("Renamed"));
    assert_ne!(text(&report.join("report-version.js")), version);
    // An error is told, and the report stays until the description is right again.
    replace(&test, &described.replace("[beam]", "[beem]"));
    watching.until("the error", || messages(folder.path()).len() >= 4);
    assert_eq!(name().as_deref(), Some("Renamed"));
    replace(&test, &described);
    watching.until("the last run", || name().as_deref() == Some("Cantilever"));
    let messages = messages(folder.path());
    let begins = [
        "run 1: 3 files are watched; Ctrl-C ends",
        "run 2: recordings/cantilever/test.toml has changed",
        "run 3: recordings/cantilever/test.toml has changed",
        "error: recordings/cantilever/test.toml:",
        "run 4: recordings/cantilever/test.toml has changed",
    ];
    assert_eq!(messages.len(), begins.len(), "{messages:?}");
    for (message, begin) in messages.iter().zip(begins) {
        assert!(message.starts_with(begin), "{messages:?}");
    }
    assert_eq!(watching.end("INT"), Some(130));
    assert!(is_clean(folder.path()) && is_clean(&report));
    // An ordinary run leaves nothing of it: its files are those of a run into a new folder.
    for out in ["report", "fresh"] {
        tapjoint(folder.path(), &["run", given[0], "--out", out], 0);
    }
    assert!(!report.join("report-version.js").exists());
    let fresh = folder.path().join("fresh/report.html");
    assert!(
        text(&report.join("report.html")) == text(&fresh),
        "the pages differ"
    );
}

#[test]
fn recover_a_new_recording_in_a_watched_folder_is_run() {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings/cantilever");
    let own = folder.path().join("taps");
    fs::create_dir(&own).unwrap();
    let mut watching = Watching::start(folder.path(), &["taps", "--hammer", "1"]);
    watching.until("the error", || messages(folder.path()).len() >= 2);
    // A recorder writes the file in pieces; it is read when it is complete.
    let bytes = fs::read(root.join("low.wav")).unwrap();
    fs::write(own.join("low.wav"), &bytes[..1000]).unwrap();
    fs::write(own.join("low.wav"), &bytes).unwrap();
    let alone = own.join("low-report/report.json");
    watching.until("the first report", || alone.is_file());
    fs::copy(root.join("high.wav"), own.join("high.wav")).unwrap();
    let both = own.join("taps-report/report.json");
    watching.until("the second report", || both.is_file());
    let report: Value = serde_json::from_str(&text(&both)).unwrap();
    assert_eq!(report["recordings"].as_array().map(Vec::len), Some(2));
    fs::remove_file(own.join("high.wav")).unwrap();
    let gone = "taps/high.wav is gone";
    watching.until("the last run", || {
        messages(folder.path())
            .iter()
            .any(|one| one.ends_with(gone))
    });
    assert_eq!(watching.end("TERM"), Some(143));
    assert!(is_clean(&own));
}

#[test]
fn limit_what_does_not_exist_is_not_watched() {
    let folder = tempfile::tempdir().unwrap();
    let run = Command::new(program())
        .current_dir(folder.path())
        .args(["watch", "missing.toml"])
        .output()
        .unwrap();
    let error = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(2), "{error}");
    assert!(
        error.starts_with("error: missing.toml: cannot be read"),
        "{error}"
    );
}

#[test]
fn recover_a_watched_page_reloads_itself_in_a_browser() {
    let Some(chromium) = browser::chromium() else {
        return;
    };
    let folder = samples();
    let file = "recordings/cantilever/low.wav";
    let once = ["--interval", "0.1", "--runs", "1"];
    let given = ["watch", file, "--hammer", "1", "--out", "report"];
    tapjoint(folder.path(), &[&given[..], &once].concat(), 0);
    let report = folder.path().join("report");
    let page = report.join("report.html");
    let html = text(&page);
    // It writes down how it was opened.
    let visitor = "<script>addEventListener(\"load\", function () { document.title = \
        \"opened by \" + performance.getEntriesByType(\"navigation\")[0].type; });\
        addEventListener(\"securitypolicyviolation\", function () { document.title = \"refused\"; });</script>";
    let (head, tail) = html.rsplit_once("</body>").unwrap();
    fs::write(&page, format!("{head}{visitor}</body>{tail}")).unwrap();
    let version = text(&report.join("report-version.js"));
    let own = version.split('"').nth(1).unwrap();
    for (version, opened) in [
        (version.clone(), "navigate"),
        (version.replace(own, "0123456789abcdef"), "reload"),
    ] {
        fs::write(report.join("report-version.js"), version).unwrap();
        let profile = tempfile::tempdir().unwrap();
        let output = Command::new(&chromium)
            .args(["--headless=new", "--no-sandbox", "--disable-gpu"])
            .args(["--virtual-time-budget=5000", "--dump-dom"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg(format!("file://{}", page.display()))
            .output()
            .unwrap();
        let dom = String::from_utf8_lossy(&output.stdout).into_owned();
        let title = dom
            .split("<title>")
            .nth(1)
            .and_then(|rest| rest.split('<').next());
        assert_eq!(title, Some(&*format!("opened by {opened}")));
    }
}
