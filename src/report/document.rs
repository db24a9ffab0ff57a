//! The report as data: what `report.json` holds.
//!
//! Units are SI, frequencies Hz. A value that does not exist is `null`, never 0. `low` and `high`
//! are 95 % limits, `null` where unbounded or unknown.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

pub use super::document_contents::{ChannelSection, DatasetSection};
pub use super::document_estimate::{
    BeamSection, CorrelationSection, FreeBeamSection, IdentifiabilitySection, MisfitSection,
};
pub use super::document_fit::{
    AmplitudeEndsSection, AmplitudePointSection, AmplitudeSection, ConstantSection, FitSection,
    TapFitSection, TrendSection,
};
pub use super::document_frf::{FrfResonanceSection, FrfSection};
pub use super::document_gap::{
    Baseline, BaselineSection, GapPlaceSection, GapSection, UpdatedModelSection,
};
pub use super::document_perturbation::{
    AverageSection, MonteCarloSection, PerturbationSection, ResolutionSpanSection,
    SensitivitySection,
};
pub use super::document_quality::VerdictSection;
pub use super::document_shapes::ModeShapeSection;

/// Version of the document's layout.
pub const VERSION: u32 = 1;

/// The whole document. Sections that a command did not compute are left out.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct Document {
    /// Version of the layout.
    pub version: u32,
    /// What was tested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test: Option<TestSection>,
    /// Each recording: taps, spectra, its own readings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recordings: Option<Vec<RecordingSection>>,
    /// Datasets of universal files, by their headers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub datasets: Option<Vec<DatasetSection>>,
    /// Resonances merged over the recordings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modes: Option<Vec<ModeSection>>,
    /// Frequency response functions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frfs: Option<Vec<FrfSection>>,
    /// The joint; `Some(None)` = asked for, but without an answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<Option<EstimateSection>>,
    /// Why there is no estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate_reason: Option<String>,
    /// Measured beside predicted frequencies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prediction: Option<Vec<PredictionSection>>,
    /// Shapes of the predicted modes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode_shapes: Option<Vec<ModeShapeSection>>,
    /// Estimates under changed frequencies, by every method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub perturbation: Option<Vec<PerturbationSection>>,
    /// Average errors of the estimates under changed frequencies, as Ingole & Chatterjee state them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub perturbation_averages: Option<Vec<AverageSection>>,
    /// Estimates under random errors of the frequencies, one entry for each method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub monte_carlo: Option<Vec<MonteCarloSection>>,
    /// Spans of the estimates over all sign patterns of the half-line bounds, and what each mode
    /// contributes, one entry for each method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolution_span: Option<Vec<ResolutionSpanSection>>,
    /// The gap between model and measurement: where, which effect, how far it closes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap: Option<GapSection>,
    /// How well the test was made: every check of good practice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quality: Option<Vec<VerdictSection>>,
    /// What a reader has to know.
    pub warnings: Vec<WarningSection>,
}

/// What was tested.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct TestSection {
    /// Name of the test.
    pub name: String,
    /// "cantilever", "lap" or "free"; null for a bare recording.
    pub kind: Option<String>,
    /// "2p" or "3p"; null where there is no joint.
    pub model: Option<String>,
    /// "timoshenko" or "euler": the beam theory of the prediction.
    pub beam_theory: Option<String>,
    /// Length (m).
    pub length: Option<f64>,
    /// Bending stiffness E I (N m2).
    pub bending_stiffness: Option<f64>,
    /// Mass per length (kg/m).
    pub mass_per_length: Option<f64>,
}

/// A known mass on the beam.
#[derive(Debug, Clone, Copy, Default, Serialize, JsonSchema)]
pub struct FastenedMassSection {
    /// Where it sits (m).
    pub position: f64,
    /// What it weighs (kg).
    pub mass: f64,
}

/// One recording.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct RecordingSection {
    /// File as the description names it.
    pub file: String,
    /// How it differs from the first recording, so that modes and estimate leave it out: "8.8 times its tap level";
    /// null where they do not.
    pub aside: Option<String>,
    /// Format in words: "WAV, 24-bit integer".
    pub format: String,
    /// Sample rate (Hz); null of frequency response functions from a file.
    pub sample_rate: Option<f64>,
    /// Number of channels.
    pub channels: usize,
    /// Every channel.
    pub channel_details: Vec<ChannelSection>,
    /// Length (s); null of frequency response functions from a file.
    pub seconds: Option<f64>,
    /// Whether there is a hammer channel.
    pub has_hammer: bool,
    /// Names of the responses: sensors, or channels.
    pub responses: Vec<String>,
    /// Unit of the taps' peaks; null where nobody said.
    pub tap_unit: Option<String>,
    /// Taps in order of time.
    pub taps: Vec<TapSection>,
    /// Distance of the spectral lines (Hz).
    pub line_spacing: Option<f64>,
    /// Resolution 1/T (Hz), T the length of signal used.
    pub resolution: Option<f64>,
    /// Bound of a line reading (Hz).
    pub half_line: Option<f64>,
    /// Block size (samples at the zoomed rate).
    pub block: Option<usize>,
    /// Displayed lines.
    pub lines: Option<usize>,
    /// Taps averaged.
    pub averages: usize,
    /// Where the hammer strikes (m), where the description says.
    pub tap: Option<f64>,
    /// Where each sensor sits (m), moved ones at their place in this recording.
    pub sensor_positions: BTreeMap<String, f64>,
    /// What each sensor weighs (kg), of those whose mass is stated.
    pub sensor_masses: BTreeMap<String, f64>,
    /// Known masses fastened to the beam for this recording, as described.
    pub masses: Vec<FastenedMassSection>,
    /// Tightening torque (N m), as described.
    pub torque: Option<f64>,
    /// Temperature (degrees Celsius), as described.
    pub temperature: Option<f64>,
    /// Date, as described.
    pub date: Option<String>,
    /// Band (Hz).
    pub band: Option<[f64; 2]>,
    /// "rectangular", "hann" or "exponential".
    pub window: Option<String>,
    /// Decay the window adds (1/s).
    pub window_decay: Option<f64>,
    /// Level at the record's end relative to its start, the largest of the responses.
    pub remaining_at_end: Option<f64>,
    /// This recording's own readings.
    pub modes: Vec<ModeSection>,
}

/// One tap.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct TapSection {
    /// When it begins (s from the start of the recording).
    pub time: f64,
    /// Peak force (`tap_unit`: N in a described test); null without a hammer.
    pub peak_force: Option<f64>,
    /// Peak of the response on which it stands out most (`tap_unit`); null with a hammer.
    pub peak_response: Option<f64>,
    /// Whether it enters the averages.
    pub accepted: bool,
    /// Why not.
    pub reason: Option<String>,
}

/// One resonance.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct ModeSection {
    /// The model's number; null for a peak that belongs to no mode.
    pub mode: Option<usize>,
    /// Best frequency (Hz).
    pub frequency: f64,
    /// "fit", "interpolated" or "line" ("given" when read elsewhere).
    pub method: String,
    /// Frequency on the line (Hz).
    pub line_frequency: Option<f64>,
    /// Bound of the line reading (Hz).
    pub half_line: Option<f64>,
    /// Frequency between the lines (Hz).
    pub interpolated_frequency: Option<f64>,
    /// Its bound (Hz), about 95 %.
    pub interpolated_bound: Option<f64>,
    /// Standard deviation of the best frequency (Hz).
    pub std: Option<f64>,
    /// Lower end of its interval (Hz): 95 % of a fit, else the bound of the reading.
    pub low: Option<f64>,
    /// Upper end of its interval (Hz).
    pub high: Option<f64>,
    /// Damping ratio.
    pub damping: Option<f64>,
    /// Its standard deviation.
    pub damping_std: Option<f64>,
    /// The fit; null where the mode was not fitted.
    pub fit: Option<FitSection>,
    /// Coherence on the mode's line, of the sensor that knows it best; null below two averages.
    pub coherence: Option<f64>,
    /// Relative random error (standard deviation) of that sensor's frequency response there.
    pub random_error: Option<f64>,
    /// Non-dimensional frequency (Euler).
    pub lambda: Option<f64>,
    /// Prominence of the peak (dB).
    pub prominence_db: Option<f64>,
    /// Height above the noise (dB).
    pub above_noise_db: Option<f64>,
    /// The recording it was read from.
    pub recording: Option<String>,
    /// What a peak that is no mode is: "mains 50 Hz".
    pub label: Option<String>,
}

/// A value with its uncertainty.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct ValueSection {
    /// The value; null where it is infinite: rigid.
    #[schemars(with = "Option<f64>")]
    pub value: f64,
    /// Standard deviation.
    pub std: Option<f64>,
    /// Lower 95 % limit.
    pub low: Option<f64>,
    /// Upper 95 % limit.
    pub high: Option<f64>,
    /// Standard deviation scaled by the misfit: where the model misses the frequencies by more than
    /// their uncertainties, and where none are stated.
    pub std_scaled: Option<f64>,
    /// Lower 95 % limit by the scaled standard deviation and Student's distribution.
    pub low_scaled: Option<f64>,
    /// Upper 95 % limit likewise.
    pub high_scaled: Option<f64>,
    /// Where there is no upper limit: at least this much, with 95 % confidence.
    pub at_least: Option<f64>,
    /// Where there is no lower limit: at most this much, likewise.
    pub at_most: Option<f64>,
}

/// The joint, or the free beam's material.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct EstimateSection {
    /// "consistent", "pairs", or "free-beam".
    pub method: String,
    /// Modes that entered.
    pub modes_used: Vec<usize>,
    /// Why the estimate is doubtful, if it is.
    pub reason: Option<String>,
    /// Kx, non-dimensional.
    pub kx: Option<ValueSection>,
    /// Ky, non-dimensional.
    pub ky: Option<ValueSection>,
    /// Kz, non-dimensional.
    pub kz: Option<ValueSection>,
    /// sqrt(Kx Ky)/Kz.
    pub coupling: Option<ValueSection>,
    /// Kt (N/m).
    pub kt: Option<ValueSection>,
    /// Kr (N m/rad).
    pub kr: Option<ValueSection>,
    /// Ktr (N/rad).
    pub ktr: Option<ValueSection>,
    /// Young's modulus (Pa).
    pub modulus: Option<ValueSection>,
    /// Density (kg/m3).
    pub density: Option<ValueSection>,
    /// The beam that belongs to the joint: as described but for what was estimated of it; null of a closed
    /// form.
    pub beam: Option<BeamSection>,
    /// Covariance of ln Kx and ln Ky, of a consistent estimate with both; scaled by the misfit where no
    /// uncertainty is stated.
    pub log_covariance: Option<[[f64; 2]; 2]>,
    /// Correlations between the parameters.
    pub correlations: Vec<CorrelationSection>,
    /// Probability of a larger misfit if the model is right; null where nothing is left to test with.
    pub goodness_of_fit: Option<f64>,
    /// The misfit behind it; null of a closed form.
    pub misfit: Option<MisfitSection>,
    /// What the frequencies can tell; null of a closed form.
    pub identifiability: Option<IdentifiabilitySection>,
    /// The pair regression.
    pub pairs: Option<PairsSection>,
    /// A free beam in closed form.
    pub free_beam: Option<FreeBeamSection>,
    /// What each mode says alone: of a lap joint its Kx if antisymmetric or Ky if symmetric, of a free
    /// beam its modulus; else empty.
    pub single_modes: Vec<SingleModeSection>,
}

/// What one mode says alone; a value that it cannot give is null.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct SingleModeSection {
    /// Mode number.
    pub mode: usize,
    /// Kx, if the mode is antisymmetric.
    pub kx: Option<f64>,
    /// Ky, if the mode is symmetric.
    pub ky: Option<f64>,
    /// Young's modulus (Pa).
    pub modulus: Option<f64>,
}

/// The pair regression's values.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct PairsSection {
    /// Kx.
    pub kx: Option<f64>,
    /// Ky.
    pub ky: Option<f64>,
    /// Kz.
    pub kz: Option<f64>,
    /// Kt (N/m).
    pub kt: Option<f64>,
    /// Kr (N m/rad).
    pub kr: Option<f64>,
    /// Ktr (N/rad).
    pub ktr: Option<f64>,
    /// Product implied by the regression over the product of its own estimates, minus 1.
    pub closure: Option<f64>,
    /// Largest over smallest singular value of the regression, its columns scaled to 1.
    pub condition: Option<f64>,
}

/// One measured mode beside its prediction. error_percent = 100 (predicted - measured)/measured.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct PredictionSection {
    /// Mode number.
    pub mode: usize,
    /// Measured (Hz).
    pub measured: Option<f64>,
    /// Predicted (Hz).
    pub predicted: Option<f64>,
    /// Predicted, non-dimensional.
    pub lambda: Option<f64>,
    /// Error (%).
    pub error_percent: Option<f64>,
    /// Whether the mode entered the estimate.
    pub used: bool,
}

/// A warning.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct WarningSection {
    /// Short code that scripts may look for.
    pub code: String,
    /// What happened, why it might be, what helps.
    pub text: String,
    /// Whether it concerns only the pair regression that stands beside the estimate, and not the estimate.
    pub beside: bool,
}

/// Those of some warnings that concern the result itself.
pub fn of_the_result(warnings: &[WarningSection]) -> Vec<&WarningSection> {
    warnings.iter().filter(|warning| !warning.beside).collect()
}

impl Document {
    /// The warnings that concern the result itself.
    pub fn main_warnings(&self) -> impl Iterator<Item = &WarningSection> {
        of_the_result(&self.warnings).into_iter()
    }

    /// Those that concern only the pair regression beside it.
    pub fn warnings_beside(&self) -> impl Iterator<Item = &WarningSection> {
        self.warnings.iter().filter(|warning| warning.beside)
    }
}
