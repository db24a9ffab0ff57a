//! What an estimate says, as plain data.

use super::goodness::Goodness;
use super::identifiability::Identifiability;
use super::least_squares::StopReason;
use super::model::Parameter;
use super::quantities::Quantity;
use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_beam::{Beam, JointStiffness};

/// A parameter at the end of its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// The best fit is rigid: the value is a number so large that no frequency feels it.
    Rigid,
    /// The best fit has no such spring.
    Absent,
    /// The coupling is as large as any joint can have it.
    FullCoupling,
}

/// One estimated number with all that is known of its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatedQuantity {
    /// Which.
    pub quantity: Quantity,
    /// Best value, in the quantity's unit; `None` where it is infinite.
    pub value: Option<f64>,
    /// Standard uncertainty to first order; `None` without stated uncertainties or where nothing
    /// is known.
    pub std: Option<f64>,
    /// The same scaled by the misfit: where the misfit is larger than the stated uncertainties
    /// allow, and wherever none are stated.
    pub std_scaled: Option<f64>,
    /// Lower end of the 95 % interval; `None` = unknown or unbounded.
    pub low: Option<f64>,
    /// Upper end of the 95 % interval; `None` = unknown or unbounded.
    pub high: Option<f64>,
    /// The 95 % interval with the misfit for uncertainty, where `std_scaled` exists; not of Kz and Ktr,
    /// which have it by way of the coupling.
    pub scaled: Option<(f64, f64)>,
    /// Where the interval has no upper end: "at least", which is its lower end.
    pub at_least: Option<f64>,
    /// Where the interval has no lower end: "at most", likewise.
    pub at_most: Option<f64>,
    /// Where the best value is at the end of the range.
    pub limit: Option<Limit>,
}

/// Correlation of two estimated parameters (their logarithms; of the coupling its atanh).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Correlation {
    /// One.
    pub first: Parameter,
    /// The other.
    pub second: Parameter,
    /// Between -1 and 1.
    pub value: f64,
}

/// One mode after the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedMode {
    /// The mode's number.
    pub mode: usize,
    /// Measured frequency (Hz).
    pub measured: f64,
    /// Predicted frequency (Hz).
    pub predicted: f64,
    /// 100 (predicted - measured)/measured (%).
    pub error_percent: f64,
    /// (predicted - measured)/standard uncertainty (1), where that is stated.
    pub standardised: Option<f64>,
    /// How much of this mode's freedom the fit takes (1), between 0 and 1: near 1 the estimate
    /// follows this mode wherever it goes.
    pub leverage: f64,
}

/// A valley that is not the deepest.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherMinimum {
    /// Its values.
    pub values: Vec<(Quantity, f64)>,
    /// How much larger the misfit (chi-squared, or the sum of squared relative errors) is.
    pub misfit: f64,
    /// Root-mean-square error of its frequencies (%).
    pub rms_percent: f64,
}

/// A joint estimated from the frequencies themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct ConsistentEstimate {
    /// Numbers of the modes used.
    pub modes_used: Vec<usize>,
    /// What was estimated.
    pub fit: Vec<Parameter>,
    /// The numbers asked for, and after them the beam's uncertain properties.
    pub quantities: Vec<EstimatedQuantity>,
    /// Covariance of the estimated coordinates (1), in the order of `fit`: logarithms, and atanh
    /// of the coupling. With relative weights scaled by the misfit; `None` where that is not known.
    pub covariance: Option<Vec<Vec<f64>>>,
    /// Covariance of ln Kx and ln Ky (1), the beam's uncertainty included; scaled as above. `None`
    /// unless both are estimated and neither is at its limit.
    pub stiffness_covariance: Option<[[f64; 2]; 2]>,
    /// Correlations of every two estimated parameters.
    pub correlations: Vec<Correlation>,
    /// The misfit and what it says of the model.
    pub goodness: Goodness,
    /// Each mode.
    pub modes: Vec<FittedMode>,
    /// Other valleys, the deepest first.
    pub other_minima: Vec<OtherMinimum>,
    /// Why the search ended.
    pub stop: StopReason,
    /// What these frequencies can and cannot tell.
    pub identifiability: Identifiability,
    /// The joint, non-dimensional.
    pub joint: JointStiffness,
    /// The beam that belongs to it, with what was estimated of it.
    pub beam: Beam,
}

impl ConsistentEstimate {
    /// One of the numbers.
    pub fn quantity(&self, quantity: Quantity) -> Option<&EstimatedQuantity> {
        self.quantities
            .iter()
            .find(|estimated| estimated.quantity == quantity)
    }

    /// Correlation of two estimated parameters, in either order.
    pub fn correlation(&self, first: Parameter, second: Parameter) -> Option<f64> {
        let found = self.correlations.iter().find(|correlation| {
            let pair = (correlation.first, correlation.second);
            pair == (first, second) || pair == (second, first)
        });
        found.map(|correlation| correlation.value)
    }
}
