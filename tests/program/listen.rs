//! A stream is recorded, and its hits are judged while it is recorded.

use super::{golden::assert_snapshot, program, samples, tapjoint};
use serde_json::Value;
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::io::{BufRead, BufReader, Lines, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::time::Duration;

const LOW: &str = "recordings/cantilever/low.wav";

/// Starts `listen` in a folder, its standard input in the hands of the test.
fn start(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(program())
        .current_dir(folder)
        .arg("listen")
        .args(arguments)
        .env("COLUMNS", "100")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Feeds bytes to `listen` and returns what it prints. It may end before it has taken all of them.
fn fed(folder: &Path, arguments: &[&str], bytes: &[u8]) -> Output {
    let mut listening = start(folder, arguments);
    let _ = listening.stdin.take().unwrap().write_all(bytes);
    listening.wait_with_output().unwrap()
}

fn refused(folder: &Path, arguments: &[&str], bytes: &[u8]) -> String {
    let ended = fed(folder, arguments, bytes);
    assert_eq!(ended.status.code(), Some(2), "{arguments:?}");
    String::from_utf8(ended.stderr).unwrap()
}

/// Length of the head of a WAV file.
fn head_of(file: &[u8]) -> usize {
    file.windows(4).position(|four| four == b"data").unwrap() + 8
}

fn log(path: &Path) -> Vec<Value> {
    let text = fs::read_to_string(path).unwrap();
    let lines = text.lines().map(serde_json::from_str);
    lines.collect::<Result<_, _>>().unwrap()
}

#[test]
fn regress_words_while_a_recording_is_played() {
    let folder = samples();
    let given = [
        "listen",
        "recordings/cantilever/test.toml",
        "--replay",
        LOW,
        "--speed",
        "max",
        "--out",
        "report",
    ];
    let names = || -> BTreeSet<OsString> {
        let entries = fs::read_dir(folder.path().join("recordings/cantilever")).unwrap();
        entries.map(|entry| entry.unwrap().file_name()).collect()
    };
    let before = names();
    let printed = tapjoint(folder.path(), &given, 0);
    // The answer of `run` follows after an empty line.
    let (heard, answer) = printed.split_once("\n\n").unwrap();
    assert_snapshot("listen_low", heard);
    let run = ["run", "recordings/cantilever/test.toml", "--out", "report"];
    assert_eq!(answer, tapjoint(folder.path(), &run, 0));
    // It was played, and nothing was written beside it.
    assert_eq!(names(), before);
}

#[test]
fn recover_the_stream_and_the_answer_of_run() {
    let folder = samples();
    let place = folder.path();
    let low = fs::read(place.join(LOW)).unwrap();
    // As WAV, its head included, and as samples without a head.
    let given = [
        "new.wav", "--hammer", "1", "--out", "one", "--json", "one.json",
    ];
    assert_eq!(fed(place, &given, &low).status.code(), Some(0));
    assert!(fs::read(place.join("new.wav")).unwrap() == low);
    let head = head_of(&low);
    let raw = [
        "raw.wav",
        "--hammer",
        "1",
        "--out",
        "two",
        "--json",
        "two.json",
        "--rate",
        "2560",
        "--channels",
        "3",
        "--format",
        "s24le",
    ];
    assert_eq!(fed(place, &raw, &low[head..]).status.code(), Some(0));
    let own = fs::read(place.join("raw.wav")).unwrap();
    assert!(own[own.len() - (low.len() - head)..] == low[head..]);
    tapjoint(
        place,
        &[
            "run", LOW, "--hammer", "1", "--out", "run", "--json", "run.json",
        ],
        0,
    );
    let read = |name: &str| -> Value {
        serde_json::from_slice(&fs::read(place.join(name)).unwrap()).unwrap()
    };
    let wanted = read("run.json");
    for (name, log_name) in [("one.json", "new"), ("two.json", "raw")] {
        let found = read(name);
        for key in ["taps", "sample_rate", "seconds"] {
            assert_eq!(
                found["recordings"][0][key], wanted["recordings"][0][key],
                "{name}: {key}"
            );
        }
        let modes = |report: &Value| -> Vec<Value> {
            let modes = report["modes"].as_array().unwrap().iter();
            modes.map(|mode| mode["frequency"].clone()).collect()
        };
        assert_eq!(modes(&found), modes(&wanted), "{name}");
        let told = log(&place.join(log_name).with_extension("listen.jsonl"));
        let taps = wanted["recordings"][0]["taps"].as_array().unwrap();
        assert_eq!(told.len(), taps.len());
        for (line, tap) in told.iter().zip(taps) {
            assert_eq!(line["news"], "tap");
            for key in ["time", "accepted", "reason"] {
                assert_eq!(line[key], tap[key], "{key}");
            }
            // Before the end, and not before the record of the hit has ended.
            let [heard, time] = ["heard", "time"].map(|key| line[key].as_f64().unwrap());
            assert!(
                (2.0..2.2).contains(&(heard - time)),
                "{heard} s for {time} s"
            );
        }
    }
}

#[cfg(unix)]
#[test]
fn regress_a_signal_ends_the_recording_and_the_test_is_run() {
    let folder = samples();
    let place = folder.path();
    let low = fs::read(place.join(LOW)).unwrap();
    let interrupt = |listening: &Child| {
        let sent = Command::new("kill")
            .args(["-s", "INT", &listening.id().to_string()])
            .status();
        assert!(sent.unwrap().success());
    };
    // Before the first sample nothing is there to be run, and the name stays free.
    let given = [
        "taps.wav", "--hammer", "1", "--out", "report", "--json", "run.json",
    ];
    let mut early = Command::new("env");
    early
        .current_dir(place)
        .arg("--default-signal=INT,TERM")
        .arg(program())
        .arg("listen")
        .args(given)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut listening = early.spawn().unwrap();
    let _open = listening.stdin.take();
    let mut lines = BufReader::new(listening.stdout.take().unwrap()).lines();
    assert!(
        lines
            .next()
            .unwrap()
            .unwrap()
            .starts_with("recording taps.wav")
    );
    interrupt(&listening);
    let ended = listening.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(2));
    assert_eq!(
        String::from_utf8(ended.stderr).unwrap(),
        "error: taps.wav: nothing was recorded\n"
    );
    assert!(!place.join("taps.wav").exists());
    // In the middle, while the stream stays open.
    let mut listening = early.spawn().unwrap();
    let mut input = listening.stdin.take().unwrap();
    input.write_all(&low[..low.len() / 2]).unwrap();
    let mut lines = BufReader::new(listening.stdout.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().starts_with("tap at 5.5")));
    interrupt(&listening);
    let rest: Vec<String> = lines.map(Result::unwrap).collect();
    assert_eq!(listening.wait().unwrap().code(), Some(0), "{rest:?}");
    drop(input);
    let run: Value = serde_json::from_slice(&fs::read(place.join("run.json")).unwrap()).unwrap();
    let heard = format!(
        "taps.wav: {:.1} s, ",
        run["recordings"][0]["seconds"].as_f64().unwrap()
    );
    assert!(
        rest.iter().any(|line| line.starts_with(&heard)),
        "{heard} {rest:?}"
    );
}

#[test]
fn recover_a_played_table_with_names_and_a_refused_description() {
    let folder = samples();
    let place = folder.path();
    let test = place.join("recordings/cantilever");
    // A channel that the stream lacks is found with the first samples, and the next call finds the same place.
    let text = fs::read_to_string(test.join("test.toml")).unwrap();
    let low = fs::read(place.join(LOW)).unwrap();
    fs::remove_file(test.join("low.wav")).unwrap();
    assert!(text.contains("channel = 1"), "{text}");
    fs::write(
        test.join("test.toml"),
        text.replacen("channel = 1", "channel = 7", 1),
    )
    .unwrap();
    let error = refused(place, &["recordings/cantilever/test.toml"], &low);
    assert!(error.contains("no channel 7"), "{error}");
    assert!(!test.join("low.wav").exists());
    fs::write(test.join("test.toml"), &text).unwrap();
    let ended = fed(
        place,
        &["recordings/cantilever/test.toml", "--out", "report"],
        &low,
    );
    assert_eq!(ended.status.code(), Some(0));
    // Text with names and units.
    let mut table = "time (s),force (N),tip (m/s2)\n".to_owned();
    for n in 0..20_000 {
        let time = f64::from(n) / 2000.0;
        let since = (time - 0.6) % 2.5;
        let force = if (0.0..2e-3).contains(&since) {
            20.0
        } else {
            0.0
        };
        let motion = (-3.0 * since.max(0.0)).exp() * (740.0 * since.max(0.0)).sin();
        table += &format!(
            "{time},{force},{}\n",
            4.0 * motion + 1e-3 * f64::from(n * 7919 % 101)
        );
    }
    fs::write(place.join("taps.csv"), table).unwrap();
    let described = "[beam]\nlength = 0.4\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n\
                     [joint]\nkind = \"cantilever\"\n[hammer]\nchannel = \"force\"\n[[sensor]]\nname = \"tip\"\n\
                     [[recording]]\nfile = \"taps.csv\"\n";
    fs::write(place.join("csv.toml"), described).unwrap();
    let given = [
        "listen", "csv.toml", "--replay", "taps.csv", "--speed", "50", "--out", "csv",
    ];
    let run = Command::new(program())
        .current_dir(place)
        .args(given)
        .output()
        .unwrap();
    let printed = String::from_utf8(run.stdout).unwrap();
    let error = String::from_utf8(run.stderr).unwrap();
    assert!(
        printed.contains("taps.csv: 10.0 s, taps that count: 3 of 4"),
        "{printed}{error}"
    );
    assert!(!error.contains("no result so far"), "{error}");
    // A copy has no names.
    let error = refused(
        place,
        &["copy.wav", "--replay", "taps.csv", "--hammer", "force"],
        b"",
    );
    assert!(error.contains("no channel named \"force\""), "{error}");
    assert!(!place.join("copy.wav").exists());
}

#[test]
fn regress_a_killed_program_leaves_what_it_heard_and_goes_on() {
    let folder = samples();
    let place = folder.path();
    let low = fs::read(place.join(LOW)).unwrap();
    let mut listening = start(place, &["taps.wav", "--hammer", "1"]);
    let mut input = listening.stdin.take().unwrap();
    let most = 2 * low.len() / 3;
    input.write_all(&low[..most]).unwrap();
    // The second hit of the file, at 5.5 s, is told once its record is there.
    let mut lines = BufReader::new(listening.stdout.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().starts_with("tap at 5.5")));
    listening.kill().unwrap();
    listening.wait().unwrap();
    let inspected = tapjoint(
        place,
        &["inspect", "taps.wav", "--hammer", "1", "--json", "-"],
        0,
    );
    let inspected: Value = serde_json::from_str(&inspected).unwrap();
    let recording = &inspected["recordings"][0];
    let frames = recording["seconds"].as_f64().unwrap() * 2560.0;
    let left = fs::read(place.join("taps.wav")).unwrap();
    let head = head_of(&low);
    assert!(left[head..] == low[head..left.len()]);
    // Of 9 bytes each; a frame may have been on its way.
    assert_eq!((left.len() - head) / 9, frames.round() as usize);
    assert!(!log(&place.join("taps.listen.jsonl")).is_empty());
    // Another file takes what follows, and the first one stays.
    let given = ["taps.wav", "--hammer", "1", "--resume"];
    let ended = fed(place, &given, &low);
    let printed = String::from_utf8(ended.stdout).unwrap();
    assert_eq!(ended.status.code(), Some(0), "{printed}");
    assert!(printed.starts_with("continuing taps.wav"), "{printed}");
    assert!(
        printed.ends_with(
            "one recording in 2 files, no report yet: write files = [\"taps.wav\", \"taps-2.wav\"] in a description (`tapjoint init` prints one), then run the test\n"
        ),
        "{printed}"
    );
    assert!(fs::read(place.join("taps.wav")).unwrap() == left);
    assert!(fs::read(place.join("taps-2.wav")).unwrap() == low);
    let error = refused(place, &["taps.wav"], &low);
    assert_snapshot("listen_existing", &error);
}

#[test]
fn regress_a_description_names_the_next_recording() {
    let folder = samples();
    let place = folder.path();
    let test = place.join("recordings/cantilever");
    let both = ["low.wav", "high.wav"].map(|name| fs::read(test.join(name)).unwrap());
    for name in ["low.wav", "high.wav"] {
        fs::remove_file(test.join(name)).unwrap();
    }
    let given = ["recordings/cantilever/test.toml", "--out", "report"];
    let first = String::from_utf8(fed(place, &given, &both[0]).stdout).unwrap();
    assert!(
        first.starts_with("recording low.wav, tap at 0.385 m; 5 taps are wanted"),
        "{first}"
    );
    let last = first.lines().last().unwrap();
    assert_eq!(last, "next: high.wav, tap at 0.385 m; start listen again");
    assert!(!place.join("report").exists());
    let second = fed(place, &given, &both[1]);
    assert_eq!(second.status.code(), Some(0));
    assert!(place.join("report/report.html").is_file());
    let error = refused(place, &given, &both[0]);
    assert_snapshot("listen_all_there", &error);
}

#[test]
fn recover_a_resumed_recording_as_the_last_line_says() {
    let folder = samples();
    let place = folder.path();
    let test = place.join("recordings/cantilever");
    let high = fs::read(test.join("high.wav")).unwrap();
    let low = fs::read(place.join(LOW)).unwrap();
    fs::remove_file(test.join("high.wav")).unwrap();
    let given = ["recordings/cantilever/test.toml", "--out", "report"];
    let ended = fed(place, &[given[0], "--resume"], &low);
    let printed = String::from_utf8(ended.stdout).unwrap();
    assert!(
        printed.ends_with(
            "one recording in 2 files, no report yet: write files = [\"low.wav\", \"low-2.wav\"] in the description in place of its file, then run the test, or start listen again where recordings are missing\n"
        ),
        "{printed}"
    );
    let text = fs::read_to_string(test.join("test.toml")).unwrap();
    let files = "files = [\"low.wav\", \"low-2.wav\"]";
    assert!(text.contains("file = \"low.wav\""), "{text}");
    fs::write(
        test.join("test.toml"),
        text.replacen("file = \"low.wav\"", files, 1),
    )
    .unwrap();
    let ended = fed(place, &given, &high);
    assert_eq!(ended.status.code(), Some(0));
    assert!(place.join("report/report.html").is_file());
}

#[test]
fn regress_a_resumed_recording_takes_its_own_next_file() {
    let folder = samples();
    let place = folder.path();
    let test = place.join("recordings/cantilever");
    let low = fs::read(place.join(LOW)).unwrap();
    let text = fs::read_to_string(test.join("test.toml")).unwrap();
    let text = text.replacen(
        "file = \"high.wav\"",
        "files = [\"high.wav\", \"more.wav\"]",
        1,
    );
    assert!(text.contains("more.wav"), "{text}");
    fs::write(test.join("test.toml"), text).unwrap();
    let high = fs::read(test.join("high.wav")).unwrap();
    // Another rate does not follow, and leaves no file.
    let given = [
        "recordings/cantilever/test.toml",
        "--resume",
        "--out",
        "report",
    ];
    let mut other = low;
    other[24..28].copy_from_slice(&5120_u32.to_le_bytes());
    let error = refused(place, &given, &other);
    assert!(
        error.contains("5120 Hz, and high.wav has 2560 Hz"),
        "{error}"
    );
    assert!(!test.join("more.wav").exists());
    let ended = fed(place, &given, &high);
    let printed = String::from_utf8(ended.stdout).unwrap();
    assert_eq!(ended.status.code(), Some(0), "{printed}");
    // What is still missing is said before the first new tap.
    let begun = "continuing more.wav, tap at 0.385 m; 5 taps are wanted; Ctrl-C ends\n\
        5 taps count; enough; end the recording\n\
        tap at 26.04 s accepted";
    assert!(printed.starts_with(begun), "{printed}");
    assert!(fs::read(test.join("more.wav")).unwrap() == high);
    assert!(place.join("report/report.html").is_file());
    // Taps of the earlier file are not reported again.
    let reported = log(&test.join("more.listen.jsonl"));
    let first = reported.iter().find(|line| line["news"] == "tap").unwrap();
    // high.wav takes 25.5 s.
    assert!(first["time"].as_f64().unwrap() > 25.0, "{first}");
}

#[test]
fn regress_broken_streams_are_named_and_nothing_is_lost() {
    let folder = samples();
    let place = folder.path();
    let low = fs::read(place.join(LOW)).unwrap();
    let form = ["--rate", "1000", "--channels", "2", "--format", "f32le"];
    let with = |name: &'static str| [&[name][..], &form].concat();
    let mut errors = vec![
        refused(place, &["a.wav"], b"time,force\n0,0\n"),
        refused(place, &["a.wav"], b""),
        refused(place, &["a.wav"], &low[..20]),
        refused(place, &["a.wav"], &low[..44]),
        refused(place, &with("a.wav"), b""),
        // Raw samples are expected, and WAV comes.
        refused(place, &with("a.wav"), &low),
    ];
    assert!(!place.join("a.wav").exists());
    errors.push(refused(place, &["a.csv"], &low));
    errors.push(refused(place, &["a.wav", "--hammer", "4"], &low));
    // Ten seconds, then a sample that is no number.
    let mut samples: Vec<u8> = (0..20_000_u32)
        .flat_map(|n| ((n % 97) as f32 / 97.0).to_le_bytes())
        .collect();
    samples.extend(f32::NAN.to_le_bytes());
    samples.extend([0; 4004]);
    errors.push(refused(place, &with("nan.wav"), &samples));
    assert!(fs::read(place.join("nan.wav")).unwrap()[44..] == samples);
    assert_snapshot("listen_broken_streams", &errors.concat());
    // A stream that ends within a frame.
    let cut = fed(
        place,
        &["cut.wav", "--hammer", "1", "--out", "cut"],
        &low[..low.len() - 4],
    );
    let warning = String::from_utf8(cut.stderr).unwrap();
    assert!(
        warning.starts_with(
            "warning: the stream ended within a frame; its last 5 bytes are left out\n"
        ),
        "{warning}"
    );
}

/// The page of `listen`, asked by plain requests.
struct Page {
    port: String,
    token: String,
}

impl Page {
    /// Reads its address from the line that names it.
    fn of(line: &str) -> Self {
        let address = line.strip_prefix("page: http://127.0.0.1:").unwrap();
        let (port, token) = address.trim_end_matches('/').split_once('/').unwrap();
        Self {
            port: port.to_owned(),
            token: token.to_owned(),
        }
    }

    fn own_host(&self) -> String {
        format!("Host: 127.0.0.1:{}", self.port)
    }

    /// Sends a request with these lines as its head, and returns the connection.
    fn send(&self, first: &str, lines: &[&str], body: &str) -> TcpStream {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port.parse().unwrap())).unwrap();
        let lines = lines.join("\r\n");
        let length = body.len();
        let head = format!(
            "{first} HTTP/1.1\r\n{lines}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
        );
        stream.write_all(head.as_bytes()).unwrap();
        let _ = stream.write_all(body.as_bytes());
        stream
    }

    /// Status and text of the answer to a request.
    fn asked(&self, first: &str, lines: &[&str], body: &str) -> (u16, String) {
        let mut stream = self.send(first, lines, body);
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let status = answer.split(' ').nth(1).unwrap().parse().unwrap();
        (status, answer)
    }

    /// Asks for an action, as the page does.
    fn act(&self, body: &str) -> u16 {
        let (host, origin) = (
            self.own_host(),
            format!("Origin: http://127.0.0.1:{}", self.port),
        );
        let lines = [&host, "Content-Type: application/json", &origin];
        let first = format!("POST /{}/act", self.token);
        self.asked(&first, &lines, body).0
    }

    /// The states of the bench as the page gets them.
    fn benches(&self) -> impl Iterator<Item = Value> + use<> {
        let first = format!("GET /{}/events", self.token);
        let stream = self.send(&first, &[&self.own_host()], "");
        // What never comes fails the test, and does not hold it up.
        let patience = Some(Duration::from_secs(120));
        stream.set_read_timeout(patience).unwrap();
        let lines = BufReader::new(stream).lines();
        let told = lines.filter_map(|line| {
            let line = line.unwrap();
            let told = line.strip_prefix("data: ")?;
            Some(serde_json::from_str(told).unwrap())
        });
        told.filter(|told: &Value| told.get("taps").is_some())
    }
}

/// Starts `listen` with a page. Returns the lines that it prints, without those of the head.
fn start_with_page(
    folder: &Path,
    arguments: &[&str],
) -> (Child, Page, Lines<BufReader<ChildStdout>>) {
    let mut listening = start(folder, &[arguments, &["--serve", "0"]].concat());
    let mut lines = BufReader::new(listening.stdout.take().unwrap()).lines();
    let page = Page::of(&lines.next().unwrap().unwrap());
    (listening, page, lines)
}

#[test]
fn prop_the_page_answers_its_own_requests_alone() {
    let folder = samples();
    let place = folder.path();
    let (mut listening, page, _lines) = start_with_page(place, &["taps.wav", "--hammer", "1"]);
    let input = listening.stdin.take().unwrap();
    let (own, token) = (page.own_host(), page.token.clone());
    let get = |path: &str, lines: &[&str]| page.asked(&format!("GET {path}"), lines, "").0;
    for file in ["", "page.css", "page.js", "report"] {
        let (status, answer) = page.asked(&format!("GET /{token}/{file}"), &[&own], "");
        assert_eq!(status, 200, "{file}");
        for header in [
            "Referrer-Policy: no-referrer",
            "Content-Security-Policy: default-src 'none'",
        ] {
            assert!(answer.contains(header), "{file}: {answer}");
        }
    }
    let localhost = own.replace("127.0.0.1", "localhost");
    assert_eq!(get(&format!("/{token}/"), &[&localhost]), 200);
    // Without the token, or with another one.
    let last = if token.ends_with('0') { "1" } else { "0" };
    let other = token[..31].to_owned() + last;
    for path in [
        "/",
        "/page.js",
        "/events",
        &format!("/{other}/"),
        &format!("/{}/", &token[1..]),
    ] {
        assert_eq!(get(path, &[&own]), 403, "{path}");
    }
    // From a page of another host, and by a name that leads here.
    let root = format!("/{token}/");
    assert_eq!(get(&root, &[&own, "Origin: http://example.com"]), 403);
    assert_eq!(get(&root, &[&own, "Origin: null"]), 403);
    assert_eq!(get(&root, &["Host: example.com"]), 403);
    assert_eq!(
        get(&root, &[&format!("Host: example.com:{}", page.port)]),
        403
    );
    assert_eq!(get(&root, &[]), 403);
    // Nothing but its own files.
    let paths = [
        "../taps.wav",
        "taps.wav",
        "..%2f..%2fetc/passwd",
        "page/page.js",
        "//etc/passwd",
    ];
    for path in paths {
        assert_eq!(get(&format!("/{token}/{path}"), &[&own]), 404, "{path}");
    }
    // Actions: as JSON alone, and no others.
    let post =
        |lines: &[&str], body: &str| page.asked(&format!("POST /{token}/act"), lines, body).0;
    let stop = "{\"action\": \"stop\"}";
    assert_eq!(post(&[&own], stop), 403);
    assert_eq!(post(&[&own, "Content-Type: text/plain"], stop), 403);
    assert_eq!(
        page.asked("POST /act", &[&own, "Content-Type: application/json"], stop)
            .0,
        403
    );
    assert_eq!(
        page.asked(&format!("PUT /{token}/act"), &[&own], stop).0,
        405
    );
    for body in [
        "",
        "{",
        "[]",
        "{\"action\": \"run\"}",
        "{\"action\": \"accept\", \"time\": \"1\"}",
    ] {
        assert_eq!(page.act(body), 400, "{body}");
    }
    let long = format!(
        "{{\"action\": \"stop\", \"more\": \"{}\"}}",
        "x".repeat(2000)
    );
    assert_eq!(page.act(&long), 400);
    // It still listens.
    assert!(listening.try_wait().unwrap().is_none());
    assert_eq!(page.act(stop), 204);
    let ended = listening.wait_with_output().unwrap();
    drop(input);
    assert_eq!(ended.status.code(), Some(2));
    let error = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(error, "error: taps.wav: nothing was recorded\n");
    // A port that is taken.
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let error = refused(place, &["taps.wav", "--hammer", "1", "--serve", &port], b"");
    assert!(
        error.starts_with(&format!("error: --serve {port}: this port cannot be used")),
        "{error}"
    );
    assert!(!place.join("taps.wav").exists());
}

#[test]
fn recover_decisions_by_hand_and_the_answer_of_run() {
    let folder = samples();
    let place = folder.path();
    let low = fs::read(place.join(LOW)).unwrap();
    let given = [
        "taps.wav", "--hammer", "1", "--out", "one", "--json", "one.json",
    ];
    let (mut listening, page, lines) = start_with_page(place, &given);
    let mut input = listening.stdin.take().unwrap();
    // The stream stays open for a last frame.
    input.write_all(&low[..low.len() - 9]).unwrap();
    let mut benches = page.benches();
    let taps = |bench: &Value| bench["taps"].as_array().unwrap().clone();
    let first = benches.find(|bench| taps(bench).len() == 5).unwrap();
    let tap = taps(&first)[1].clone();
    assert_eq!(tap["accepted"], true, "{tap}");
    let time = tap["time"].as_f64().unwrap();
    let last = &taps(&first)[4]["time"];
    // Two taps, and the second decision back again.
    for (action, place, accepted) in [
        (
            format!("{{\"action\": \"reject\", \"time\": {time}}}"),
            1,
            false,
        ),
        (
            format!("{{\"action\": \"reject\", \"time\": {last}}}"),
            4,
            false,
        ),
        ("{\"action\": \"undo\"}".to_owned(), 4, true),
    ] {
        assert_eq!(page.act(&action), 204);
        let done = benches.find(|bench| taps(bench)[place]["accepted"] == accepted);
        assert!(done.is_some(), "{action}");
    }
    assert_eq!(page.act("{\"action\": \"stop\"}"), 204);
    let ended = benches.filter(|bench| !bench["ended"].is_null()).last();
    let words = "The recording has ended. The report is written; the terminal names its folder.";
    assert_eq!(ended.unwrap()["ended"], words);
    let printed = lines.map(Result::unwrap).collect::<Vec<_>>();
    drop(input);
    assert_eq!(listening.wait().unwrap().code(), Some(0), "{printed:?}");
    let rounded = (time * 1e4).round() / 1e4;
    let told =
        format!("decided by hand: give --reject-taps {rounded} to `run` for the same answer");
    assert!(printed.contains(&told), "{printed:?}");
    // The same file through `run`, with the same decisions.
    let again = [
        "run",
        "taps.wav",
        "--hammer",
        "1",
        "--reject-taps",
        &rounded.to_string(),
        "--out",
        "two",
        "--json",
        "two.json",
    ];
    tapjoint(place, &again, 0);
    let read = |name: &str| fs::read_to_string(place.join(name)).unwrap();
    assert_eq!(read("one.json"), read("two.json"));
    let found: Value = serde_json::from_str(&read("one.json")).unwrap();
    assert_eq!(
        found["recordings"][0]["taps"][1]["reason"],
        "rejected by hand"
    );
    let decisions: Vec<Value> = log(&place.join("taps.listen.jsonl"))
        .into_iter()
        .filter(|line| line["news"] == "by-hand")
        .map(|line| line["decision"].clone())
        .collect();
    assert_eq!(decisions, ["reject", "reject", "undo"]);
}

#[test]
fn recover_a_test_in_one_stream_by_next() {
    let folder = samples();
    let place = folder.path();
    let test = place.join("recordings/cantilever");
    let [low, high] = ["low.wav", "high.wav"].map(|name| fs::read(test.join(name)).unwrap());
    for name in ["low.wav", "high.wav"] {
        fs::remove_file(test.join(name)).unwrap();
    }
    let rate_of = |file: &[u8]| u32::from_le_bytes(file[24..28].try_into().unwrap());
    let (rate, head) = (rate_of(&low).to_string(), head_of(&low));
    let given = [
        "recordings/cantilever/test.toml",
        "--rate",
        &rate,
        "--channels",
        "3",
        "--format",
        "s24le",
        "--out",
        "report",
    ];
    let (mut listening, page, lines) = start_with_page(place, &given);
    let mut input = listening.stdin.take().unwrap();
    let mut benches = page.benches();
    input.write_all(&low[head..]).unwrap();
    let taps = |bench: &Value| bench["taps"].as_array().unwrap().len();
    let first = benches.find(|bench| taps(bench) == 5).unwrap();
    assert_eq!(first["next"], "high.wav, tap at 0.385\u{a0}m");
    let last = &first["taps"][4]["time"];
    let reject = format!("{{\"action\": \"reject\", \"time\": {last}}}");
    assert_eq!(page.act(&reject), 204);
    assert_eq!(page.act("{\"action\": \"next\"}"), 204);
    // The stream turns with its next samples, whichever they are.
    let quiet = vec![0; 9000];
    let mut sent = low[head..].to_vec();
    for _ in 0..500 {
        if test.join("high.wav").exists() {
            break;
        }
        input.write_all(&quiet).unwrap();
        sent.extend_from_slice(&quiet);
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(test.join("high.wav").exists());
    let samples = &high[head_of(&high)..];
    input.write_all(samples).unwrap();
    sent.extend_from_slice(samples);
    let title = "recording high.wav, tap at 0.385 m";
    let second = benches.find(|bench| bench["title"] == title).unwrap();
    assert_eq!(second["next"], Value::Null);
    drop(input);
    let printed = lines.map(Result::unwrap).collect::<Vec<_>>().join("\n");
    assert!(
        listening
            .wait()
            .unwrap()
            .code()
            .is_some_and(|code| code < 2),
        "{printed}"
    );
    assert!(printed.contains(title), "{printed}");
    // No sample is lost between the two.
    let [one, two] = ["low.wav", "high.wav"].map(|name| fs::read(test.join(name)).unwrap());
    let own = |file: &[u8]| file[head_of(file)..].to_vec();
    assert!([own(&one), own(&two)].concat() == sent);
    let text = fs::read_to_string(test.join("test.toml")).unwrap();
    assert_eq!(text.matches("reject_taps = [").count(), 1, "{text}");
    let described = text.split("[[recording]]").nth(1).unwrap();
    assert!(described.contains("reject_taps = ["), "{text}");
    assert!(place.join("report/report.html").is_file());
}
