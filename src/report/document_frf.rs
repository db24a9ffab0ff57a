//! Frequency response functions in the document.

use schemars::JsonSchema;
use serde::Serialize;

/// The frequency response function of one sensor in one recording, one value for each line; null
/// where a value does not exist.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct FrfSection {
    /// File of the recording.
    pub recording: String,
    /// Name of the sensor or channel.
    pub response: String,
    /// "accelerance", "mobility" or "receptance"; null for sound and for unknown units.
    pub form: Option<String>,
    /// "(m/s2)/N" and the like; "per unit of the file" where nobody stated units.
    pub unit: String,
    /// "H1", "H2" or "Hv": the estimator of `real` and `imaginary`.
    pub estimator: String,
    /// Taps averaged.
    pub averages: usize,
    /// "rectangular", "hann" or "exponential".
    pub window: String,
    /// Decay the window adds to every pole (1/s); null for windows that add none.
    pub window_decay: Option<f64>,
    /// The recording's resonances on this function.
    pub resonances: Vec<FrfResonanceSection>,
    /// Frequencies (Hz).
    pub frequency: Vec<f64>,
    /// Real part (unit above), in the convention e^{+j omega t}.
    pub real: Vec<Option<f64>>,
    /// Imaginary part (unit above).
    pub imaginary: Vec<Option<f64>>,
    /// Coherence; null below two averages.
    pub coherence: Option<Vec<Option<f64>>>,
    /// Relative random error (standard deviation) of the magnitude; null below two averages.
    pub random_error: Option<Vec<Option<f64>>>,
}

/// A resonance on a frequency response function.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct FrfResonanceSection {
    /// Number of the mode; null for a peak that belongs to none.
    pub mode: Option<usize>,
    /// What a peak that is no mode is.
    pub label: Option<String>,
    /// Best reading of its frequency (Hz).
    pub frequency: f64,
    /// The nearest line (Hz), on which the following stand.
    pub line_frequency: f64,
    /// Magnitude (unit of the function).
    pub magnitude: Option<f64>,
    /// Phase (degrees).
    pub phase: Option<f64>,
    /// Coherence.
    pub coherence: Option<f64>,
    /// Relative random error (standard deviation) of the magnitude.
    pub random_error: Option<f64>,
}
