//! Functions that must end without a panic, whatever the bytes: one for each fuzz target.
//!
//! `scripts/fuzz.sh` builds and runs them. Most functions also check a promise of the code that they call.

use std::cell::RefCell;
use std::fs;
use std::path::{Path, PathBuf};

use tapjoint::description::{ChannelRef, TestDescription};
use tapjoint::pipeline::{IdentifySettings, run_recording, run_test};
use tapjoint::recording::{Channel, ReadSettings, Recording, open_frequency_responses};
use tapjoint::report::{document_of, render_json};
use tapjoint::study::blind_check::parse_truths;

thread_local! {
    /// The file that all executions of this process write to.
    static FILE: RefCell<Option<PathBuf>> = const { RefCell::new(None) };
}

/// Puts bytes into a file and returns its path. The file lies in memory (`/dev/shm`) where the system has this folder.
fn file_of(bytes: &[u8]) -> PathBuf {
    let path = FILE.with_borrow_mut(|file| {
        let name = format!("tapjoint-fuzz-{}", std::process::id());
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
        file.get_or_insert_with(|| folder.join(name)).clone()
    });
    fs::write(&path, bytes).expect("a temporary file");
    path
}

/// Opens a recording and reads all of it. Whatever the header states, there are no more samples than bytes.
pub fn recording(bytes: &[u8]) {
    let settings = ReadSettings {
        sample_rate: Some(1000.0),
    };
    let Ok(recording) = Recording::open(&file_of(bytes), &settings) else {
        return;
    };
    let channels: Vec<usize> = (0..recording.channels().len()).collect();
    assert!(recording.frames() * channels.len() as u64 <= bytes.len() as u64);
    let samples = recording.read_channels(&channels, 0..u64::MAX).expect("an opened recording can be read");
    for (samples, channel) in samples.iter().zip(recording.channels()) {
        assert_eq!(samples.len() as u64, recording.frames());
        assert!(samples.iter().all(|sample| sample.is_finite()));
        assert!(channel.health.rms.is_finite());
    }
    for warning in recording.warnings() {
        assert!(!warning.to_string().is_empty());
    }
}

/// Opens frequency response functions. All lines hold finite values.
pub fn responses(bytes: &[u8]) {
    let Ok(found) = open_frequency_responses(&file_of(bytes)) else {
        return;
    };
    assert!(!found.responses.is_empty() && found.spacing > 0.0);
    for response in &found.responses {
        assert_eq!(response.values.len(), found.lines);
        assert!(response.values.iter().all(|value| value.re.is_finite() && value.im.is_finite()));
    }
    for warning in &found.warnings {
        assert!(!warning.to_string().is_empty());
    }
}

/// Reads a test description. An error is one line that begins with the file.
pub fn description(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    if let Err(error) = TestDescription::parse(&text, "test.toml") {
        let message = error.to_string();
        assert!(message.starts_with("test.toml:"), "{message}");
        assert!(!message.chars().any(char::is_control), "{message:?}");
        assert!(message.len() < 4000, "{} bytes", message.len());
    }
}

/// Reads the truths of a blind check.
pub fn truths(bytes: &[u8]) {
    let _ = parse_truths(&String::from_utf8_lossy(bytes));
}

/// Numbers in a range, taken from bytes; zeros where the bytes end.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn next(&mut self) -> f64 {
        let (head, rest) = self.0.split_at(self.0.len().min(2));
        self.0 = rest;
        f64::from(head.iter().fold(0_u16, |value, byte| (value << 8) | u16::from(*byte))) / 65535.0
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.next() * (high - low)
    }

    /// A number whose logarithm is spread evenly.
    fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    fn is(&mut self) -> bool {
        self.next() > 0.5
    }

    fn choice<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[((self.next() * of.len() as f64) as usize).min(of.len() - 1)]
    }
}

/// Estimates a joint from stated frequencies, and writes the report.
pub fn identify(bytes: &[u8]) {
    let mut numbers = Numbers(bytes);
    let kind = numbers.choice(&["cantilever", "lap", "free"]);
    let length = numbers.log_between(0.01, 10.0);
    let mut text = format!(
        "[beam]\nlength = {length}\nwidth = {}\nthickness = {}\nmodulus = {:e}\ndensity = {}\n[joint]\nkind = \"{kind}\"\nbeam = \"{}\"\n",
        length * numbers.log_between(0.005, 0.5),
        length * numbers.log_between(0.001, 0.3),
        numbers.log_between(1e8, 1e12),
        numbers.log_between(500.0, 20_000.0),
        numbers.choice(&["euler", "timoshenko"]),
    );
    if kind == "cantilever" {
        text += &format!("model = \"{}\"\n", numbers.choice(&["2p", "3p"]));
    }
    if kind != "free" && numbers.is() {
        text += &format!("kt = {:e}\n", numbers.log_between(1.0, 1e13));
    }
    let count = numbers.between(1.0, 9.99) as usize;
    let mut frequency = numbers.log_between(0.1, 5000.0);
    let mut frequencies = Vec::with_capacity(count);
    for _ in 0..count {
        frequencies.push(frequency);
        frequency *= 1.0 + numbers.log_between(1e-6, 10.0);
    }
    text += &format!("[measured]\nfrequencies = {frequencies:?}\n");
    if numbers.is() {
        text += &format!("half_line = {:e}\n", numbers.log_between(1e-9, 10.0));
    }
    if numbers.is() {
        text += &format!("scatter = {:e}\n", numbers.log_between(1e-7, 0.5));
    }
    let Ok(test) = TestDescription::parse(&text, "test.toml") else {
        return;
    };
    let analysis = run_test(&test, (Path::new("."), "test.toml"), &IdentifySettings::unperturbed());
    let analysis = analysis.expect("stated frequencies need no file");
    render_json(&document_of(&analysis)).expect("a report");
}

/// Takes samples through the chain to modes. Every frequency is finite.
pub fn chain(bytes: &[u8]) {
    let (head, samples) = bytes.split_at(bytes.len().min(4));
    let mut numbers = Numbers(head);
    let rate = numbers.log_between(1.0, 1e6);
    let hammer = numbers.is().then_some(ChannelRef::Number(1));
    let samples: Vec<f64> = samples
        .chunks_exact(2)
        .map(|pair| f64::from(i16::from_le_bytes([pair[0], pair[1]])))
        .collect();
    if samples.len() < 2 {
        return;
    }
    let frames = samples.len() / 2;
    let channels = [0, 1].map(|channel| Channel {
        samples: samples[channel * frames..(channel + 1) * frames].to_vec(),
        ..Channel::default()
    });
    let recording = Recording::from_samples("samples", rate, channels.into()).expect("finite samples");
    if let Ok(analysis) = run_recording(recording, hammer.as_ref(), |_| {}) {
        assert!(analysis.modes.iter().all(|mode| mode.frequency.is_finite()));
        render_json(&document_of(&analysis)).expect("a report");
    }
}
