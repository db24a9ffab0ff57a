//! What errors in the frequencies do to the estimate, in the document.

use schemars::JsonSchema;
use serde::Serialize;

use super::document::ValueSection;

/// An estimate from frequencies changed by the same percentage.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct PerturbationSection {
    /// Change of all frequencies (%), signed.
    pub percent: f64,
    /// "pairs" or "consistent".
    pub method: String,
    /// Kx.
    pub kx: Option<f64>,
    /// Ky.
    pub ky: Option<f64>,
    /// Kz.
    pub kz: Option<f64>,
}

/// Average errors of +percent and -percent: the mean of their magnitudes, as in table 9 of Ingole &
/// Chatterjee, and the error of their mean, as in table 14.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct AverageSection {
    /// "pairs" or "consistent".
    pub method: String,
    /// Change of all frequencies (%), its size.
    pub percent: f64,
    /// Of Kx (%).
    pub kx_percent: Option<f64>,
    /// Of Ky (%).
    pub ky_percent: Option<f64>,
    /// Of Kz (%).
    pub kz_percent: Option<f64>,
    /// Magnitude of the error of the two estimates' mean (%), as in table 14: smaller, because
    /// opposite errors cancel. Of Kx.
    pub kx_of_mean_percent: Option<f64>,
    /// The same of Ky (%).
    pub ky_of_mean_percent: Option<f64>,
    /// The same of Kz (%).
    pub kz_of_mean_percent: Option<f64>,
}

/// Estimates under random errors of the frequencies: median and 95 % interval.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct MonteCarloSection {
    /// "pairs" or "consistent".
    pub method: String,
    /// Repetitions.
    pub samples: usize,
    /// How many of them had no estimate.
    pub failed: usize,
    /// Kx.
    pub kx: Option<ValueSection>,
    /// Ky.
    pub ky: Option<ValueSection>,
    /// Kz.
    pub kz: Option<ValueSection>,
    /// The first repetitions' estimates, for a picture: (Kx, Ky).
    #[serde(skip)]
    pub cloud: Vec<[f64; 2]>,
}

/// What the resolution of the readings does to the estimate.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct ResolutionSpanSection {
    /// "pairs" or "consistent".
    pub method: String,
    /// Number of sign patterns tried.
    pub patterns: usize,
    /// Patterns that left no estimate.
    pub failed: usize,
    /// Smallest and largest Kx.
    pub kx: Option<[f64; 2]>,
    /// Smallest and largest Ky.
    pub ky: Option<[f64; 2]>,
    /// Smallest and largest Kz.
    pub kz: Option<[f64; 2]>,
    /// All estimates over the patterns, for a picture: (Kx, Ky).
    #[serde(skip)]
    pub cloud: Vec<[f64; 2]>,
    /// Change of each parameter (%) when one mode moves by its own bound.
    pub sensitivity: Vec<SensitivitySection>,
}

/// What one mode's bound does.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct SensitivitySection {
    /// Mode number.
    pub mode: usize,
    /// The bound (Hz).
    pub half_line: f64,
    /// Change of Kx (%).
    pub kx_percent: Option<f64>,
    /// Change of Ky (%).
    pub ky_percent: Option<f64>,
    /// Change of Kz (%).
    pub kz_percent: Option<f64>,
    /// Change of Kx (%) per change of this frequency (%), for small changes.
    pub kx_percent_per_percent: Option<f64>,
    /// The same of Ky.
    pub ky_percent_per_percent: Option<f64>,
    /// The same of Kz.
    pub kz_percent_per_percent: Option<f64>,
}
