//! What a verdict is about: a recording, a tap, a mode, a sensor, or the test.

use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;

/// What a verdict is about.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(into = "WrittenSubject")]
pub enum Subject {
    /// A recording.
    Recording {
        /// Its name.
        file: String,
    },
    /// A tap.
    Tap {
        /// The recording.
        file: String,
        /// Its number, from 1.
        tap: usize,
    },
    /// A mode, or a peak that has no number.
    Mode {
        /// The recording.
        file: String,
        /// Its frequency (Hz).
        frequency: f64,
        /// Whether it is a mode.
        is_mode: bool,
    },
    /// A sensor.
    Sensor {
        /// The recording.
        file: String,
        /// Its name.
        sensor: String,
    },
    /// The test as a whole.
    Test,
}

impl Subject {
    /// The recording it belongs to; `None` of the test as a whole.
    pub fn file(&self) -> Option<&str> {
        match self {
            Subject::Recording { file }
            | Subject::Tap { file, .. }
            | Subject::Mode { file, .. }
            | Subject::Sensor { file, .. } => Some(file),
            Subject::Test => None,
        }
    }
}

/// A subject as `report.json` has it.
#[derive(Serialize, JsonSchema)]
struct WrittenSubject {
    /// On what, in words: "full.wav, tap 2".
    subject: String,
    /// File of the recording; null of the test as a whole.
    recording: Option<String>,
    /// Number of the tap, from 1; null of anything else.
    tap: Option<usize>,
    /// Frequency of the mode (Hz); null of anything else.
    frequency: Option<f64>,
    /// Name of the sensor; null of anything else.
    sensor: Option<String>,
}

impl From<Subject> for WrittenSubject {
    fn from(about: Subject) -> Self {
        let mut written = WrittenSubject {
            subject: about.to_string(),
            recording: about.file().map(str::to_owned),
            tap: None,
            frequency: None,
            sensor: None,
        };
        match about {
            Subject::Tap { tap, .. } => written.tap = Some(tap),
            Subject::Mode { frequency, .. } => written.frequency = Some(frequency),
            Subject::Sensor { sensor, .. } => written.sensor = Some(sensor),
            Subject::Recording { .. } | Subject::Test => {}
        }
        written
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Subject::Recording { file } => f.write_str(file),
            Subject::Tap { file, tap } => write!(f, "{file}, tap {tap}"),
            Subject::Mode {
                file,
                frequency,
                is_mode,
            } => {
                let what = if *is_mode {
                    ""
                } else {
                    " (a peak that is no mode)"
                };
                write!(f, "{file}, {frequency:.2} Hz{what}")
            }
            Subject::Sensor { file, sensor } => write!(f, "{file}, sensor {sensor}"),
            Subject::Test => f.write_str("test"),
        }
    }
}
