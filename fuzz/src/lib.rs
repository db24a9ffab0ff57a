//! Functions that must end without a panic, whatever the bytes: one for each fuzz target.
//!
//! `scripts/fuzz.sh` runs them under libFuzzer, `tests/it/corpus.rs` on the seeds. Each also checks what the code that
//! it calls promises.

use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::{fs, process, thread};

use serde_json::Value;
use tapjoint::description::{ChannelRef, TestDescription};
use tapjoint::pipeline::{IdentifySettings, ModeResult, run_recording, run_test, tested_structure};
use tapjoint::recording::{
    Channel, ReadSettings, Recording, VariableRole, list_datasets, open_frequency_responses,
    read_function, read_mode_shapes,
};
use tapjoint::report::deck::{
    MOST_FREQUENCIES, deck_of, render_abaqus, render_nastran, source_in_report,
};
use tapjoint::report::document_of;
use tapjoint::study::blind_check::parse_truths;
use tapjoint::study::change_check::{pair_truths_json, parse_pair_truths};

/// What a target does with bytes.
type Feed = fn(&[u8]);

/// Every target with its name.
pub const TARGETS: [(&str, Feed); 11] = [
    ("wav", recording),
    ("flac", flac),
    ("csv", recording),
    ("universal", universal),
    ("matlab", matlab),
    ("responses", responses),
    ("description", description),
    ("truths", truths),
    ("reports", reports),
    ("identify", identify),
    ("chain", chain),
];

/// Feeds bytes to the target of this name.
pub fn run(target: &str, bytes: &[u8]) {
    let found = TARGETS.iter().find(|(name, _)| *name == target);
    let (_, feed) = found.expect("a target");
    feed(bytes);
}

/// A file that is removed at the end.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

thread_local! {
    /// The file that all executions of this thread write to. It lies in memory (`/dev/shm`) where the system has this
    /// folder.
    static FILE: Scratch = {
        let name = format!("tapjoint-fuzz-{}-{:?}", process::id(), thread::current().id());
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
        Scratch(folder.join(name))
    };
}

/// Puts bytes into a file and returns its path.
fn file_of(bytes: &[u8]) -> PathBuf {
    FILE.with(|file| {
        fs::write(&file.0, bytes).expect("a temporary file");
        file.0.clone()
    })
}

fn check_finite(values: &[f64]) {
    assert!(values.iter().all(|value| value.is_finite()));
}

/// Checks that nowhere in a result there is a number that is none.
fn check_numbers(result: &impl Debug) {
    let text = format!("{result:?}");
    assert!(!text.contains("NaN"), "{text}");
}

/// Most samples that a fuzzed FLAC file may have: silence of any length takes a few bytes.
const MOST_SAMPLES: u64 = 1 << 22;

/// Opens a recording and reads all of it. Whatever the header states, there are no more samples than bytes.
fn recording(bytes: &[u8]) {
    read_within(bytes, bytes.len() as u64);
}

/// Opens a FLAC file and reads all of it, unless it unpacks to more than fits.
fn flac(bytes: &[u8]) {
    if let Ok(recording) = Recording::open(&file_of(bytes), &ReadSettings::default())
        && recording.frames() * recording.channels().len() as u64 > MOST_SAMPLES
    {
        return;
    }
    read_within(bytes, MOST_SAMPLES);
}

/// Opens a recording and reads all of it. It has no more samples than `most`.
fn read_within(bytes: &[u8], most: u64) {
    let settings = ReadSettings {
        sample_rate: Some(1000.0),
        ..ReadSettings::default()
    };
    let Ok(recording) = Recording::open(&file_of(bytes), &settings) else {
        return;
    };
    let channels: Vec<usize> = (0..recording.channels().len()).collect();
    assert!(recording.frames() * channels.len() as u64 <= most);
    assert!(recording.sample_rate() > 0.0 && recording.duration().is_finite());
    let samples = recording
        .read_channels(&channels, 0..u64::MAX)
        .expect("an opened recording can be read");
    for (samples, channel) in samples.iter().zip(recording.channels()) {
        assert_eq!(samples.len() as u64, recording.frames());
        check_finite(samples);
        let health = &channel.health;
        check_finite(&[
            health.rms,
            health.mean,
            health.peak,
            health.minimum,
            health.maximum,
            channel.scale,
        ]);
    }
    // From the middle on, the last channel alone.
    let middle = recording.frames() / 2;
    let rest = recording
        .read(channels.len() - 1, middle..u64::MAX)
        .expect("an opened recording can be read");
    assert_eq!(
        Some(&rest[..]),
        samples.last().map(|all| &all[middle as usize..])
    );
    for warning in recording.warnings() {
        assert!(!warning.to_string().is_empty());
    }
}

/// Reads a universal file as a recording, every function in it, and its modes.
fn universal(bytes: &[u8]) {
    recording(bytes);
    modes(&file_of(bytes));
    let Ok(file) = list_datasets(&file_of(bytes)) else {
        return;
    };
    assert!(file.datasets.len() <= bytes.len() && !file.contents().is_empty());
    for (dataset, _) in file.functions() {
        if let Ok(values) = read_function(&file, dataset.number) {
            assert!(values.real.len() <= bytes.len());
            assert!(
                values
                    .imaginary
                    .is_none_or(|part| part.len() == values.real.len())
            );
            assert!(
                values
                    .abscissa
                    .is_none_or(|part| part.len() == values.real.len())
            );
        }
    }
}

/// Reads the modes of a universal file, and its nodes along their line.
fn modes(path: &Path) {
    let Ok(found) = read_mode_shapes(path) else {
        return;
    };
    assert!(!found.modes.is_empty());
    for mode in &found.modes {
        assert!(mode.frequency.is_finite() && mode.frequency > 0.0);
        assert!(mode.damping.is_none_or(|ratio| ratio.is_finite()));
        assert!(mode.shape.values().flatten().all(|value| value.is_finite()));
    }
    if let Ok(line) = found.along_line(None) {
        assert!(line.nodes.iter().all(|node| node.distance.is_finite()));
        assert_eq!(line.shapes.len(), found.modes.len());
        let mut values = line.shapes.iter().flatten();
        assert!(values.all(|at| at.value.abs() <= 1.0 && at.node < line.nodes.len()));
    }
}

/// Opens a MATLAB file as samples, functions and spectra. However it is compressed, it gives no more numbers than 32
/// for each byte, and some.
fn matlab(bytes: &[u8]) {
    let path = file_of(bytes);
    let most = (1 << 16) + 32 * bytes.len() as u64;
    for (role, name) in [
        (VariableRole::Samples, "data"),
        (VariableRole::Frf, "H"),
        (VariableRole::Spectrum, "data"),
    ] {
        let names = [(role, name), (VariableRole::Rate, "fs")];
        let variables = names.map(|(role, name)| (role, vec![name.to_owned()]));
        let settings = ReadSettings {
            variables: variables.into_iter().collect(),
            ..ReadSettings::default()
        };
        if let Ok(recording) = Recording::open(&path, &settings) {
            assert!(recording.frames() * recording.channels().len() as u64 <= most);
        }
        if let Ok(found) = open_frequency_responses(&path, &settings) {
            assert!(found.lines as u64 <= most && found.spacing > 0.0);
            for response in &found.responses {
                assert_eq!(response.values.len(), found.lines);
            }
        }
    }
    // Without names the error lists what there is.
    assert!(
        Recording::open(&path, &ReadSettings::default()).is_err()
            || !bytes.starts_with(b"MATLAB 5.0")
    );
}

/// Opens frequency response functions. All lines hold finite values.
fn responses(bytes: &[u8]) {
    let Ok(found) = open_frequency_responses(&file_of(bytes), &ReadSettings::default()) else {
        return;
    };
    assert!(!found.responses.is_empty() && found.spacing > 0.0 && found.lines <= bytes.len());
    check_finite(&[
        found.first_frequency,
        found.spacing,
        found.frequency(found.lines),
    ]);
    for response in &found.responses {
        assert_eq!(response.values.len(), found.lines);
        assert!(
            response
                .values
                .iter()
                .all(|value| value.re.is_finite() && value.im.is_finite())
        );
        for coherence in response.coherence.iter() {
            assert_eq!(coherence.len(), found.lines);
            assert!(
                coherence
                    .iter()
                    .all(|value| (-1e-3..=1.001).contains(value))
            );
        }
    }
    for warning in &found.warnings {
        assert!(!warning.to_string().is_empty());
    }
}

/// Reads a test description. An error is one line that begins with the file.
fn description(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    match TestDescription::parse(&text, "test.toml") {
        Ok(test) => {
            tested_structure(&test)
                .beam
                .check()
                .expect("a described beam can exist");
            let measured = test
                .measured
                .iter()
                .flat_map(|measured| &measured.frequencies);
            assert!(
                measured
                    .copied()
                    .all(|frequency| frequency.is_finite() && frequency > 0.0)
            );
            test.warnings.iter().for_each(check_line);
        }
        Err(error) => check_line(&error),
    }
}

/// Checks that a message is one line that begins with the file.
fn check_line(message: &impl ToString) {
    let message = message.to_string();
    assert!(message.starts_with("test.toml:"), "{message}");
    assert!(!message.chars().any(char::is_control), "{message:?}");
    assert!(message.len() < 4000, "{} bytes", message.len());
}

/// Reads the truths of a blind check, of tests and of pairs.
fn truths(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    if let Ok(file) = parse_pair_truths(&text) {
        let written = pair_truths_json(&file.truths).expect("finite numbers");
        let again = parse_pair_truths(&written).expect("what was read is written alike");
        assert_eq!(again.truths, file.truths);
        assert!(file.doubts.iter().all(|doubt| !doubt.is_empty()));
    }
    if let Ok(file) = parse_truths(&text) {
        assert!(file.truths.len() <= bytes.len());
        assert!(file.doubts.iter().all(|doubt| !doubt.is_empty()));
    }
}

/// Descriptions that a report may be of. Masses make finite elements of the last two, which take long.
static DESCRIBED: LazyLock<[TestDescription; 5]> = LazyLock::new(|| {
    let beam = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n";
    let cantilever = "[joint]\nkind = \"cantilever\"\nmodel = \"3p\"\n";
    let right = "[beam.right]\nthickness = 0.007\n";
    [
        cantilever.to_owned(),
        format!("{right}[joint]\nkind = \"lap\"\nkt = 1e6\n"),
        "[joint]\nkind = \"free\"\nbeam = \"euler\"\n".to_owned(),
        format!("{cantilever}beam = \"euler\"\n[[sensor]]\nname = \"A\"\nchannel = 2\nposition = 0.4\nmass = 0.02\n"),
        format!("{right}[joint]\nkind = \"lap\"\nbeam = \"euler\"\noverlap = {{ length = 0.04, mass = 0.05 }}\n"),
    ]
    .map(|rest| {
        TestDescription::parse(&format!("{beam}{rest}"), "test.toml").expect("a description")
    })
});

/// Makes decks of the joint in a report. The first byte chooses the structure, and seldom one with masses.
fn reports(bytes: &[u8]) {
    let Some((first, text)) = bytes.split_first() else {
        return;
    };
    let structure = match first {
        250.. => usize::from(first % 2) + 3,
        _ => usize::from(first % 3),
    };
    let test = &DESCRIBED[structure];
    let Ok(source) = source_in_report(&String::from_utf8_lossy(text), "report.json", test) else {
        return;
    };
    assert!(source.frequencies.len() <= MOST_FREQUENCIES);
    assert!(
        source
            .frequencies
            .iter()
            .all(|frequency| frequency.is_finite() && *frequency > 0.0)
    );
    let Ok(deck) = deck_of(&test.name, &source) else {
        return;
    };
    for (deck, remark) in [(render_nastran(&deck), "$"), (render_abaqus(&deck), "**")] {
        for line in deck.lines().filter(|line| !line.starts_with(remark)) {
            assert!(!line.contains("NaN") && !line.contains("inf"), "{line}");
        }
    }
}

/// Numbers in a range, taken from bytes; zeros where the bytes end.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn next(&mut self) -> f64 {
        let (head, rest) = self.0.split_at(self.0.len().min(2));
        self.0 = rest;
        f64::from(
            head.iter()
                .fold(0_u16, |value, byte| (value << 8) | u16::from(*byte)),
        ) / 65535.0
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
fn identify(bytes: &[u8]) {
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
    let count = numbers.between(1.0, 5.99) as usize;
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
    let analysis = run_test(
        &test,
        (Path::new("."), "test.toml"),
        &IdentifySettings::unperturbed(),
    );
    let analysis = analysis.expect("stated frequencies need no file");
    check_numbers(&analysis.identification);
    check_modes(&analysis.modes, f64::INFINITY);
    let document = serde_json::to_value(document_of(&analysis)).expect("a report");
    check_intervals(&document["estimate"]);
}

/// Checks that every interval holds its value.
fn check_intervals(section: &Value) {
    let members = section.as_object().into_iter().flatten();
    members.for_each(|(_, member)| check_intervals(member));
    let Some(value) = section.get("value").and_then(Value::as_f64) else {
        return;
    };
    // Limits and value are rounded on their own.
    let slack = 1e-9 * value.abs();
    for (low, high) in [("low", "high"), ("low_scaled", "high_scaled")] {
        assert!(
            section[low].as_f64().is_none_or(|low| low <= value + slack),
            "{section}"
        );
        assert!(
            section[high]
                .as_f64()
                .is_none_or(|high| high >= value - slack),
            "{section}"
        );
    }
    assert!(
        section["std"].as_f64().is_none_or(|std| std >= 0.0),
        "{section}"
    );
}

/// Checks that modes are numbers, within the band that was measured.
fn check_modes(modes: &[ModeResult], highest: f64) {
    check_numbers(&modes);
    for mode in modes {
        assert!(
            mode.frequency > 0.0 && mode.frequency <= highest,
            "{mode:?}"
        );
        assert!(
            mode.std.is_none_or(|std| std > 0.0 && std.is_finite()),
            "{mode:?}"
        );
    }
}

/// Takes samples through the chain to modes.
fn chain(bytes: &[u8]) {
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
    let recording =
        Recording::from_samples("samples", rate, channels.into()).expect("finite samples");
    if let Ok(analysis) = run_recording(recording, hammer.as_ref(), |_| {}) {
        check_modes(&analysis.modes, rate / 2.0);
        serde_json::to_value(document_of(&analysis)).expect("a report");
    }
}
