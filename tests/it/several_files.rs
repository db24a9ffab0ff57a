//! One set-up in several files, a tap each: the same modes as from one file, and errors by name.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tapjoint::description::TestDescription;
use tapjoint::pipeline::{Analysis, IdentifySettings, run_test};
use tapjoint::recording::{ReadSettings, Recording, WavFormat, write_wav};
use tapjoint::report::{document_of, render_json};
use tapjoint::{TapSettings, TapSource, find_taps};

const FOLDER: &str = "recordings/cantilever";

/// Cuts a recording in front of each tap but the first, writes the parts as files, and returns their names.
fn cut(folder: &Path, name: &str) -> Vec<String> {
    let path = Path::new(FOLDER).join(format!("{name}.wav"));
    let whole = Recording::open(&path, &ReadSettings::default()).unwrap();
    let source = TapSource::Hammer {
        channel: 0,
        responses: vec![1, 2],
    };
    let taps = find_taps(&whole, &source, &TapSettings::default()).unwrap();
    let starts = taps.taps.iter().skip(1).map(|tap| tap.record.start);
    let ends: Vec<u64> = starts.chain([whole.frames()]).collect();
    let mut names = Vec::new();
    let mut start = 0;
    for (number, end) in (1..).zip(ends) {
        let samples = whole.read_channels(&[0, 1, 2], start..end).unwrap();
        let file = format!("{name}{number}.wav");
        let rate = whole.sample_rate() as u32;
        write_wav(&folder.join(&file), rate, &samples, WavFormat::Pcm24).unwrap();
        names.push(file);
        start = end;
    }
    names
}

/// Copies the other recording of the described test.
fn copy_high(folder: &Path) {
    fs::copy(Path::new(FOLDER).join("high.wav"), folder.join("high.wav")).unwrap();
}

/// The description of the recordings with `files` for one of its files.
fn described(lists: &[(&str, Vec<String>)]) -> String {
    let mut text = fs::read_to_string(Path::new(FOLDER).join("test.toml")).unwrap();
    for (name, files) in lists {
        text = text.replace(
            &format!("file = \"{name}.wav\""),
            &format!("files = {files:?}"),
        );
    }
    text
}

fn analyse(text: &str, folder: &Path) -> Result<Analysis, String> {
    let test = TestDescription::parse(text, "test.toml").map_err(|error| error.to_string())?;
    run_test(
        &test,
        (folder, "test.toml"),
        &IdentifySettings::unperturbed(),
    )
    .map_err(|error| error.to_string())
}

fn program(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tapjoint"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

#[test]
fn recover_the_same_modes_from_a_file_for_each_tap() {
    let folder = tempfile::tempdir().unwrap();
    let (low, high) = (cut(folder.path(), "low"), cut(folder.path(), "high"));
    assert!(low.len() > 2, "{low:?}");
    let text = described(&[("low", low.clone()), ("high", high)]);
    let whole = fs::read_to_string(Path::new(FOLDER).join("test.toml")).unwrap();
    let whole = analyse(&whole, Path::new(FOLDER)).unwrap();
    let parts = analyse(&text, folder.path()).unwrap();
    assert_eq!(whole.modes.len(), parts.modes.len());
    for (one, other) in whole.modes.iter().zip(&parts.modes) {
        let (one, other) = (one.reading.as_ref(), other.reading.as_ref());
        let (one, other) = (one.unwrap(), other.unwrap());
        let (low, high) = other.interval;
        assert!(
            (low..=high).contains(&one.frequency),
            "{} outside of {low} to {high}",
            one.frequency
        );
        let lengths = [one, other].map(|reading| reading.interval.1 - reading.interval.0);
        let ratio = lengths[1] / lengths[0];
        assert!((0.5..2.0).contains(&ratio), "{lengths:?}");
    }
    let [one, other] = [&whole, &parts].map(|found| &found.recordings[0]);
    assert_eq!(other.file, format!("{} + {} more", low[0], low.len() - 1));
    let counts = [one, other].map(|found| found.measurement.taps.accepted().count());
    assert_eq!(counts[0], counts[1]);
    let spectra = other.measurement.spectra.as_ref().unwrap();
    assert_eq!(spectra.averages.taps, counts[1]);
    assert!(spectra.averages.coherence(0).is_some());
    // Every tap names its file.
    let named: Vec<_> = other
        .measurement
        .taps
        .taps
        .iter()
        .map(|tap| tap.file.clone().unwrap())
        .collect();
    assert_eq!(named, low);
    let json = render_json(&document_of(&parts)).unwrap();
    assert!(
        json.contains(&format!("\"file\": \"{}\"", low[1])),
        "{json}"
    );
}

#[test]
fn prop_a_tap_rejected_by_hand_is_as_one_not_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let mut low = cut(folder.path(), "low");
    copy_high(folder.path());
    let text = described(&[("low", low.clone())]);
    let whole = analyse(&text, folder.path()).unwrap();
    let time = whole.recordings[0].measurement.taps.taps[1].time;
    let rejected = text.replacen("files =", &format!("reject_taps = [{time}]\nfiles ="), 1);
    let rejected = analyse(&rejected, folder.path()).unwrap();
    low.remove(1);
    let missing = analyse(&described(&[("low", low)]), folder.path()).unwrap();
    for (one, other) in rejected.modes.iter().zip(&missing.modes) {
        // The same numbers in another place of the recording.
        assert!((one.frequency / other.frequency - 1.0).abs() < 1e-12);
    }
    assert_ne!(rejected.modes[0].frequency, whole.modes[0].frequency);
    assert_eq!(rejected.modes.len(), missing.modes.len());
}

#[test]
fn regress_a_file_without_a_tap_is_a_doubt_and_not_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let mut low = cut(folder.path(), "low");
    let quiet = vec![vec![0.0; 5120]; 3];
    let path = folder.path().join("quiet.wav");
    let first = Recording::open(&folder.path().join(&low[0]), &ReadSettings::default()).unwrap();
    write_wav(&path, first.sample_rate() as u32, &quiet, WavFormat::Pcm24).unwrap();
    low.insert(1, "quiet.wav".to_owned());
    cut(folder.path(), "high");
    copy_high(folder.path());
    let found = analyse(&described(&[("low", low)]), folder.path()).unwrap();
    let texts: Vec<String> = found.warnings.iter().map(ToString::to_string).collect();
    assert!(
        texts.iter().any(|text| text.contains("quiet.wav: no tap")),
        "{texts:?}"
    );
    assert!(!found.modes.is_empty());
}

#[test]
fn limit_wrong_lists_of_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let low = cut(folder.path(), "low");
    copy_high(folder.path());
    let samples = vec![vec![0.0, 0.5, 0.0]; 3];
    let other = folder.path().join("other.wav");
    write_wav(&other, 4321, &samples, WavFormat::Pcm24).unwrap();
    write_wav(
        &folder.path().join("two.wav"),
        5120,
        &samples[..2],
        WavFormat::Pcm24,
    )
    .unwrap();
    let list = |files: &[&str]| {
        let files = files.iter().map(|file| (*file).to_owned());
        described(&[("low", files.collect())])
    };
    let first = low[0].as_str();
    let both = list(&[first]).replace("files =", "file = \"high.wav\"\nfiles =");
    let many: Vec<String> = (0..201).map(|number| format!("{number}.wav")).collect();
    let cases: [(String, &[&str]); 7] = [
        (
            list(&[first, "other.wav"]),
            &["other.wav", first, "4321 Hz"],
        ),
        (list(&[first, "two.wav"]), &["two.wav", first, "2 channel"]),
        (list(&[first, "none.wav"]), &["none.wav"]),
        (
            list(&[first, first]),
            &["test.toml:", "listed twice", first],
        ),
        (list(&[]), &["test.toml:", "at least 1 file"]),
        (both, &["test.toml:", "`file` and `files`"]),
        (described(&[("low", many)]), &["test.toml:", "200"]),
    ];
    for (text, words) in cases {
        let error = analyse(&text, folder.path()).expect_err("an error");
        for word in words {
            assert!(error.contains(word), "{word} in {error}");
        }
    }
}

#[test]
fn regress_no_file_of_a_list_is_overwritten_and_init_proposes_the_list() {
    let folder = tempfile::tempdir().unwrap();
    let low = cut(folder.path(), "low");
    copy_high(folder.path());
    let text = described(&[("low", low.clone())]);
    fs::write(folder.path().join("test.toml"), text).unwrap();
    let before = fs::read(folder.path().join(&low[1])).unwrap();
    let ran = program(
        folder.path(),
        &["identify", "test.toml", "--json", &low[1], "--force"],
    );
    assert_eq!(ran.status.code(), Some(2), "{ran:?}");
    assert_eq!(fs::read(folder.path().join(&low[1])).unwrap(), before);
    let mut arguments = vec!["init"];
    arguments.extend(low.iter().map(String::as_str));
    let ran = program(folder.path(), &arguments);
    let text = String::from_utf8(ran.stdout).unwrap();
    let list: Vec<String> = low.iter().map(|file| format!("{file:?}")).collect();
    assert!(
        text.contains(&format!("# files = [{}]", list.join(", "))),
        "{text}"
    );
}
