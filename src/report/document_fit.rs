//! The part of the document that fitted modes fill.

use schemars::JsonSchema;
use serde::Serialize;

/// The fit of one mode.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct FitSection {
    /// Lower end of the damping ratio's 95 % interval.
    pub damping_low: f64,
    /// Upper end of the damping ratio's 95 % interval.
    pub damping_high: f64,
    /// What the frequency's standard deviation rests on: "residual" (the noise that the fit leaves) or
    /// "taps" (their scatter, where it is more than that noise explains).
    pub uncertainty_from: String,
    /// Degrees of freedom of the frequency's standard deviation.
    pub freedom: f64,
    /// Probability that noise alone makes the taps scatter so; null with a single tap.
    pub scatter_probability: Option<f64>,
    /// Correlation of the residual between neighbouring lines: near 0 for a good fit.
    pub residual_correlation: f64,
    /// Band of the fit (Hz).
    pub band: [f64; 2],
    /// Every tap alone.
    pub taps: Vec<TapFitSection>,
    /// Modal constants of the sensors.
    pub constants: Vec<ConstantSection>,
    /// Frequency and damping against amplitude.
    pub amplitude: Option<AmplitudeSection>,
}

/// Frequency and damping of one accepted tap alone.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct TapFitSection {
    /// Number of the tap among the accepted ones, from 1.
    pub tap: usize,
    /// Frequency (Hz).
    pub frequency: f64,
    /// Its standard deviation (Hz).
    pub frequency_std: f64,
    /// Damping ratio.
    pub damping: f64,
    /// Its standard deviation.
    pub damping_std: f64,
}

/// Modal constant of one sensor for the recording's tap.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct ConstantSection {
    /// Number of the response, from 1, in the order of the recording's `responses`.
    pub sensor: usize,
    /// A (1/kg) in the receptance A/(omega_n^2 - omega^2 + 2 j zeta omega_n omega), with its sign.
    pub value: f64,
    /// Its standard deviation (1/kg).
    pub std: f64,
    /// Phase of A away from the real axis (degrees).
    pub phase_deviation: f64,
}

/// Frequency and damping of a mode along its decays.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct AmplitudeSection {
    /// "changes", "steady", "beating", "unresolved" or "too-few-points".
    pub verdict: String,
    /// Change of the frequency (Hz); null with too few points.
    pub frequency: Option<TrendSection>,
    /// Change of the damping ratio; null with too few points.
    pub damping: Option<TrendSection>,
    /// Response whose amplitude is given, from 1; null without points.
    pub sensor: Option<usize>,
    /// From the largest to the smallest amplitude; null where the change is within its uncertainty or too
    /// small to matter.
    pub ends: Option<AmplitudeEndsSection>,
    /// The points, by tap and time; left out in the merged list of modes, whose recording has them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<AmplitudePointSection>,
}

/// Values at the largest and at the smallest amplitude at which the curve is well known.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct AmplitudeEndsSection {
    /// Amplitude (`unit`).
    pub amplitude: [f64; 2],
    /// Unit of the amplitude; null where nobody said.
    pub unit: Option<String>,
    /// Frequency (Hz).
    pub frequency: [f64; 2],
    /// Its 95 % bounds (Hz).
    pub frequency_bound: [f64; 2],
    /// Damping ratio.
    pub damping: [f64; 2],
    /// Its 95 % bounds.
    pub damping_bound: [f64; 2],
}

/// A change from the largest to the smallest amplitude.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct TrendSection {
    /// The change.
    pub change: f64,
    /// Its 95 % bound.
    pub change_bound: f64,
    /// Probability of such a slope by noise alone.
    pub p_value: f64,
}

/// One segment of one decay.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct AmplitudePointSection {
    /// Number of the tap among the accepted ones, from 1.
    pub tap: usize,
    /// Time after the tap (s).
    pub time: f64,
    /// Peak amplitude at the strongest sensor (its unit).
    pub amplitude: f64,
    /// Frequency (Hz).
    pub frequency: f64,
    /// Its standard deviation (Hz).
    pub frequency_std: f64,
    /// Damping ratio.
    pub damping: f64,
    /// Its standard deviation.
    pub damping_std: f64,
}
