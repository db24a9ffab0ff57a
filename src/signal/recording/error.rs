//! Errors and doubts of this stage: each names its place; what was found, what is allowed, what to do.

use std::fmt::Display;
use std::io;

/// More channels than this are taken for a damaged header; the largest front ends have hundreds.
pub const MAX_CHANNELS: usize = 4096;

/// Error of opening, reading or writing a recording: the file, and the line where there is one;
/// what was found, what is allowed, what to do. Poor data are [`RecordingWarning`]s instead.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The operating system refused.
    #[error("{file}: cannot be read: {source}; check the path and the permissions")]
    Unreadable {
        /// The file.
        file: String,
        /// The system's reason.
        source: io::Error,
    },
    /// The operating system refused to write.
    #[error("{file}: cannot be written: {source}; check the folder, its permissions and its space")]
    Unwritable {
        /// The file.
        file: String,
        /// The system's reason.
        source: io::Error,
    },
    /// Text whose first column is a frequency, where a time series was expected.
    #[error(
        "{place}: the first column is a frequency (\"{column}\"): this is a frequency response function and no time series; in a test description give its [[recording]] form = \"accelerance\" (or \"mobility\", \"receptance\", \"spectrum\"); without one `tapjoint run FILE` and `tapjoint spectrum FILE` read it"
    )]
    FrequencyColumn {
        /// The file, and the line of the first row (1-based).
        place: String,
        /// The column's heading.
        column: String,
    },
    /// Text by LabVIEW, a MATLAB file or text without headings that holds functions, where a time series was expected.
    #[error(
        "{place}: {found}: these are functions of frequency and no time series; in a test description give its [[recording]] form = \"accelerance\" (or \"mobility\", \"receptance\", \"spectrum\"); without one `tapjoint run FILE` and `tapjoint spectrum FILE` read it"
    )]
    Functions {
        /// The file, and the line of the first row (1-based) where there is one.
        place: String,
        /// What shows it.
        found: String,
    },
    /// A universal file with functions, none of them a time series.
    #[error("{file}: holds no time series (function type 1), only {found}; {remedy}")]
    NoTimeSeries {
        /// The file.
        file: String,
        /// Contents of the file.
        found: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// Contents or a request that make no sense.
    #[error("{place}: {problem}")]
    Unusable {
        /// The file, and the line (1-based) where there is one.
        place: String,
        /// The finding, allowed values, and the remedy.
        problem: String,
    },
}

impl RecordingError {
    /// An error of a file as a whole.
    pub(super) fn new(file: &str, problem: impl Into<String>) -> Self {
        Self::Unusable {
            place: file.to_owned(),
            problem: problem.into(),
        }
    }

    /// An error in a line (1-based).
    pub(super) fn at_line(file: &str, line: u64, problem: impl Into<String>) -> Self {
        Self::new(&format!("{file}:{line}"), problem)
    }

    /// The error of a valid frame without samples.
    pub(super) fn no_samples(file: &str) -> Self {
        Self::new(file, "holds no samples; record or export it again")
    }

    /// The error of a file that became shorter after it was opened: sample `frame` (0-based) is no longer there.
    pub(super) fn changed(file: &str, frame: u64) -> Self {
        Self::new(
            file,
            format!(
                "ended before sample {frame}, though it was longer when opened; is it still being written?"
            ),
        )
    }
}

/// Returns the error of a file that the operating system does not give.
pub(super) fn unreadable(file: &str, source: io::Error) -> RecordingError {
    RecordingError::Unreadable {
        file: file.to_owned(),
        source,
    }
}

/// Checks that a file has no more channels than any recorder.
pub(super) fn check_channel_count(file: &str, channels: usize) -> Result<(), RecordingError> {
    match channels <= MAX_CHANNELS {
        true => Ok(()),
        false => Err(RecordingError::new(
            file,
            format!("{channels} channels; at most {MAX_CHANNELS} are read; is the header damaged?"),
        )),
    }
}

/// A number with the digits that mean something: nine, so that roundings do not show.
pub(super) fn short(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap_or(value)
}

/// A doubt about a recording or about frequency responses that does not keep them from being used: what
/// happened, why it might be, what helps.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct RecordingWarning {
    code: &'static str,
    /// The channel concerned (1-based).
    pub(super) channel: Option<usize>,
    message: String,
}

impl RecordingWarning {
    /// The channel concerned (1-based); `None` of a doubt about the file as a whole.
    pub fn channel(&self) -> Option<usize> {
        self.channel
    }

    /// A doubt about a file as a whole.
    pub(super) fn new(code: &'static str, message: String) -> Self {
        Self {
            code,
            channel: None,
            message,
        }
    }

    /// A doubt about a channel (1-based).
    pub(super) fn of_channel(
        code: &'static str,
        number: usize,
        name: Option<&str>,
        problem: impl Display,
    ) -> Self {
        Self {
            code,
            channel: Some(number),
            message: format!("{}: {problem}", channel_label(number, name)),
        }
    }

    /// The doubt about a channel (1-based) whose unit in the header is not known.
    pub(super) fn unknown_unit(number: usize, name: Option<&str>, unit: &str) -> Self {
        let problem = format!(
            "the unit \"{unit}\" of the header is not known; the numbers are taken as they stand; give a scale"
        );
        Self::of_channel("unknown-unit", number, name, problem)
    }

    /// The doubt about a file that has fewer samples per channel than its header promises.
    pub(super) fn truncated(present: u64, promised: u64) -> Option<Self> {
        let message = format!(
            "the file is truncated: {present} of the promised {promised} samples per channel are there; the recorder or a copy was probably interrupted; what is there is used"
        );
        (present < promised).then(|| Self::new("truncated", message))
    }

    /// A file of unknown length ends within a frame.
    pub(super) fn ends_within_frame(present: u64) -> Self {
        let message = format!(
            "the file is truncated: it ends within a frame, after {present} samples per channel; the recorder or a copy was probably interrupted; what is there is used"
        );
        Self::new("truncated", message)
    }

    /// A file holds more samples than its header states.
    pub(super) fn more_than_promised(present: u64, promised: u64) -> Self {
        let message = format!(
            "the header promises {promised} samples per channel, and {present} are there; all of them are used; the recorder was probably interrupted"
        );
        Self::new("header-length", message)
    }

    /// Short and stable name of the kind of doubt, for reports.
    pub fn code(&self) -> &'static str {
        self.code
    }
}

/// A channel (1-based) as messages name it.
pub(super) fn channel_label(number: usize, name: Option<&str>) -> String {
    match name {
        Some(name) => format!("channel {number} (\"{name}\")"),
        None => format!("channel {number}"),
    }
}
