//! What the resolution of readings does to the estimate, in the document.

use schemars::JsonSchema;
use serde::Serialize;

/// What the resolution of the readings does to the estimate.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct ResolutionSpanSection {
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
