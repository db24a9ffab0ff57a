//! Frequency response functions and spectra that an analyser has measured.
//!
//! Values are in SI units. Where a file says in which unit they are, they are converted; where it
//! does not, they are taken as they stand. Lines are evenly spaced; a file whose lines are not is an
//! error. `response_files` opens the files.

use num_complex::Complex64;

use super::error::{RecordingError, RecordingWarning};
use super::uff::Point;
use super::units::ResponseForm;

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
    /// True where the values have a phase. Without one they are magnitudes alone: a spectrum, which gives frequencies
    /// and half-power damping.
    pub has_phase: bool,
    /// The responses in the order of the file; one at least.
    pub responses: Vec<FrequencyResponse>,
    /// Doubts about them.
    pub warnings: Vec<RecordingWarning>,
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
    /// Point of the response.
    pub response: Point,
    /// Point of the force.
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

/// Columns of a function's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ValueColumns {
    /// Real and imaginary part.
    Complex,
    /// Magnitude and phase, or the magnitude alone.
    MagnitudePhase,
    /// Level (dB, 20 lg of the magnitude) and phase (degrees), or the level alone.
    DecibelDegrees,
}

impl ValueColumns {
    /// Words of descriptions and options, each with what it means.
    pub const WORDS: [(&'static str, ValueColumns); 3] = [
        ("complex", ValueColumns::Complex),
        ("magnitude-phase", ValueColumns::MagnitudePhase),
        ("dB-degrees", ValueColumns::DecibelDegrees),
    ];
}

/// Returns the error of a recording where responses were expected.
pub(super) fn time_series(file: &str, what: &str) -> RecordingError {
    let problem = format!(
        "is {what}; frequency response functions were expected because `form` is given; remove `form` (and `sensor`) from its [[recording]], or give the file with the responses"
    );
    RecordingError::new(file, problem)
}

/// Returns the error of a value that is no number of physical size.
///
/// `dataset` is 1-based (when writing: the response), `point` 0-based.
pub(super) fn not_finite(file: &str, dataset: usize, point: usize, value: f64) -> RecordingError {
    let problem = format!(
        "dataset {dataset}, point {} is {value}; allowed: finite numbers of magnitude up to 1e100; export the file again",
        point + 1
    );
    RecordingError::new(file, problem)
}
