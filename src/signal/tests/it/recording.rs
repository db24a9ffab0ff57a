//! Tests of recording: each format from bytes the tests write themselves.

mod arbitrary;
mod csv;
mod flac;
mod health;
mod laboratory;
mod mat;
mod real;
mod wav;

use crate::written::{TestFile, file};
use std::path::Path;
use tapjoint_signal::recording::{ReadSettings, Recording, RecordingError};

/// Opens bytes as a recording.
pub fn open(bytes: impl AsRef<[u8]>) -> (TestFile, Result<Recording, RecordingError>) {
    let file = file("tested.dat", bytes);
    let recording = Recording::open(&file.path, &ReadSettings::default());
    (file, recording)
}

/// Opens bytes and reads all channels.
pub fn read_all(bytes: impl AsRef<[u8]>, what: &str) -> Vec<Vec<f64>> {
    let (_file, recording) = open(bytes);
    let recording = recording.unwrap_or_else(|error| panic!("{what}: {error}"));
    let channels: Vec<usize> = (0..recording.channels().len()).collect();
    recording
        .read_channels(&channels, 0..u64::MAX)
        .unwrap_or_else(|error| panic!("{what}: {error}"))
}

/// The message that opening bytes gives, without the folder in front of the file's name.
pub fn open_error(bytes: impl AsRef<[u8]>) -> String {
    let (_file, recording) = open(bytes);
    match recording {
        Ok(recording) => panic!(
            "opened as {:?} with {} samples, but should be refused",
            recording.format(),
            recording.frames()
        ),
        Err(error) => {
            let message = error.to_string();
            let at = message.find("tested.dat").expect("the file's name");
            message[at..].to_owned()
        }
    }
}

/// Asserts that a message begins as it should and holds all of `parts`.
pub fn assert_message(message: &str, start: &str, parts: &[&str]) {
    assert!(
        message.starts_with(start),
        "{message:?} should start {start:?}"
    );
    for part in parts {
        assert!(message.contains(part), "{message:?} should hold {part:?}");
    }
}

#[cfg(unix)]
#[test]
fn limit_pipes_and_devices_are_no_recordings() {
    let opened = Recording::open(Path::new("/dev/null"), &ReadSettings::default());
    assert_eq!(
        opened.unwrap_err().to_string(),
        "/dev/null: is a pipe or a device; save its contents to a file and give that file"
    );
}
