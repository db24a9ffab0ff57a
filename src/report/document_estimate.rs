//! What the consistent estimate adds to the document.

use schemars::JsonSchema;
use serde::Serialize;

/// Correlation of two estimated parameters (their logarithms; of the coupling its atanh).
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct CorrelationSection {
    /// One parameter.
    pub first: String,
    /// The other.
    pub second: String,
    /// Between -1 and 1.
    pub value: f64,
}

/// How well the model explains the frequencies.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct MisfitSection {
    /// Sum of squared residuals over their standard deviations; null without uncertainties.
    pub chi_squared: Option<f64>,
    /// Frequencies and priors less parameters.
    pub degrees_of_freedom: usize,
    /// Root-mean-square relative misfit of the frequencies (%).
    pub rms_percent: f64,
    /// The verdict in a sentence.
    pub verdict: String,
}

/// What the frequencies can and cannot tell.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct IdentifiabilitySection {
    /// Singular values of the Jacobian, descending: the inverse of each is the relative uncertainty of
    /// one combination of the parameters.
    pub singular_values: Vec<f64>,
    /// Largest over smallest.
    pub condition: Option<f64>,
    /// Flat directions, dead parameters, parameters at the end of their range, in sentences.
    pub statements: Vec<String>,
}

/// A free beam's material in closed form: either value alone, with the other as described.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct FreeBeamSection {
    /// Young's modulus (Pa) at the described density.
    pub modulus: f64,
    /// Density (kg/m3) at the described modulus instead.
    pub density: f64,
}

/// The beam that belongs to a joint.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct BeamSection {
    /// Length (m); of a lap joint both halves together.
    pub length: f64,
    /// Width (m).
    pub width: f64,
    /// Thickness (m).
    pub thickness: f64,
    /// Young's modulus (Pa).
    pub modulus: f64,
    /// Density (kg/m3).
    pub density: f64,
}
