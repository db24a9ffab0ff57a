//! What stops an analysis.

use super::measure::MeasureError;
use tapjoint_signal::recording::RecordingError;
use tapjoint_signal::spectral::SpectralError;

/// What stops an analysis.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// A recording could not be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A recording could not be measured.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// A band that does not fit a file of frequency response functions.
    #[error("{file}: {problem}")]
    Functions {
        /// The recording.
        file: String,
        /// What does not fit.
        problem: SpectralError,
    },
    /// A band or block of the description that does not fit its recording.
    #[error("{file}:{line}: {recording}: {problem}")]
    Setting {
        /// The description.
        file: String,
        /// Its line.
        line: usize,
        /// The recording.
        recording: String,
        /// What does not fit.
        problem: SpectralError,
    },
    /// A channel of the description that its recording does not have, or cannot be told from others, or
    /// cannot be scaled.
    #[error("{file}:{line}: `{key}`: {problem}")]
    Channel {
        /// The description.
        file: String,
        /// Its line.
        line: usize,
        /// The key: `sensor[2].channel`.
        key: String,
        /// What the recording has instead.
        problem: Box<RecordingError>,
    },
    /// A description without sensors.
    #[error(
        "{file}: the recordings need at least one [[sensor]] with its channel, or there is no response \
         to analyse"
    )]
    NoSensors {
        /// The description.
        file: String,
    },
}
