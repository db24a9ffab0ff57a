//! Frequency response functions that an analyser has measured: from universal files (function type
//! 4) and from text with a frequency, a real and an imaginary column.
//!
//! Values are in SI units. Where a file says in which unit they are, they are converted; where it
//! does not, they are taken as they stand. Lines are evenly spaced; a file whose lines are not is an
//! error. A coherence (function type 6) of the same pair of points goes with its response.

use std::path::Path;

use num_complex::Complex64;

use super::RecordingError;
use super::sniff::{self, Kind};
use super::uff::Point;

mod error;
mod form;
mod text;
mod unit;
mod universal;

pub use error::{ResponseError, ResponseWarning};
pub use form::ResponseForm;

/// Frequency response functions on the same lines.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyResponses {
    /// The file as the caller named it.
    pub file: String,
    /// Frequency of the first line (Hz).
    pub first_frequency: f64,
    /// Distance of the lines (Hz).
    pub spacing: f64,
    /// Number of lines.
    pub lines: usize,
    /// The responses in the order of the file; one at least.
    pub responses: Vec<FrequencyResponse>,
    /// Doubts about them.
    pub warnings: Vec<ResponseWarning>,
}

impl FrequencyResponses {
    /// Frequency of a line, 0-based (Hz).
    pub fn frequency(&self, line: usize) -> f64 {
        self.first_frequency + line as f64 * self.spacing
    }
}

/// One frequency response function.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrequencyResponse {
    /// Response and reference point such as "3:+Z / 1:-Z", or what else the file calls it.
    pub name: String,
    /// Where the response was measured.
    pub response: Point,
    /// Where the force acted.
    pub reference: Point,
    /// The unit as written; `None` where the file has none.
    pub unit: Option<String>,
    /// Its form by the file: by the types of its axes, else by its unit; `None` where neither says.
    pub form: Option<ResponseForm>,
    /// One value for each line (SI units).
    pub values: Vec<Complex64>,
    /// Coherence at each line (1), where the file has it.
    pub coherence: Option<Vec<f64>>,
}

/// Reads the frequency response functions of a file, a universal file or text.
///
/// # Errors
/// Files that cannot be read or understood, that hold time series instead, or whose lines are not
/// evenly spaced; merely poor data are [`warnings`](FrequencyResponses::warnings).
pub fn open_frequency_responses(path: &Path) -> Result<FrequencyResponses, RecordingError> {
    let file = path.display().to_string();
    match sniff::recognise(path, &file)? {
        Kind::Universal => universal::open(path),
        Kind::Text => text::open(path, file),
        Kind::Wav => Err(ResponseError::TimeSeries {
            file,
            what: "a WAV file, a time series".to_owned(),
        }
        .into()),
    }
}
