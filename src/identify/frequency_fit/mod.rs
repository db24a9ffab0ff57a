//! The frequency fit, which reports call the consistent estimate: the joint (and beam) whose natural
//! frequencies are nearest to the measured ones.
//!
//! ```text
//! JointedStructure -> FrequencyModel   frequencies and exact derivatives at any point
//! + modes, settings -> ConsistentEstimator
//!      fit          the least misfit over all joints, from many starts
//!      estimate     the same with intervals, test of the model, identifiability
//!      monte_carlo  repeated with random errors
//! ```
//!
//! Stiffnesses enter by their logarithms and the coupling by its inverse hyperbolic tangent, so
//! that every point is a joint that can exist. Unlike the pair regression an estimate satisfies its
//! own frequency equation, and takes masses, springs and unequal halves into account.

mod budget;
mod estimate;
mod estimator;
mod model;
mod monte_carlo;
mod outlier;
mod problem;
mod set_ups;
mod uncertainty;

pub use budget::{BudgetEntry, Measure, Remedy};
pub use estimator::{ConsistentEstimator, MovedClamp, Neighbourhood, PointFit};
pub use model::{
    FrequencyModel, JointedStructure, ModeResponse, PARAMETERS, Parameter, Point, Route,
};
pub use outlier::{LeftOutAnswer, OutlyingMode};
pub use tapjoint_beam::specimen::LapLayout;
pub use tapjoint_numerics::least_squares::StopReason;
pub use uncertainty::{
    AttachmentTolerance, BudgetInput, DescriptionPull, LEAST_DISCREPANCY, MOST_DISCREPANCY,
    WIDTH_HOLD_STD,
};

use model::log_nondimensional;
use problem::{LOG_STIFFNESS, along};
use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_beam::{Beam, Joint, JointStiffness};
use tapjoint_numerics::stats::chi_square_tail;

// Settings of an estimate.

/// Divisor of the residuals.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ResidualWeights {
    /// Each frequency's standard uncertainty.
    #[default]
    Measured,
    /// The frequency itself: equal relative weights, and no intervals.
    Relative,
}

/// Standard uncertainties of the beam's properties, all relative (1) but Poisson's ratio; `None` = taken as exact.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BeamTolerances {
    /// Standard uncertainty of the length.
    pub length: Option<f64>,
    /// Standard uncertainty of the width.
    pub width: Option<f64>,
    /// Standard uncertainty of the thickness.
    pub thickness: Option<f64>,
    /// Standard uncertainty of the modulus.
    pub modulus: Option<f64>,
    /// Standard uncertainty of the density.
    pub density: Option<f64>,
    /// Standard uncertainty of Poisson's ratio, absolute. With it the hold of the joint across the width is uncertain too.
    pub poisson: Option<f64>,
}

impl BeamTolerances {
    /// Returns the standard uncertainty of a property; `None` for an exact one, and for what is no property.
    pub fn of(&self, parameter: Parameter) -> Option<f64> {
        match parameter {
            Parameter::Length => self.length,
            Parameter::Width => self.width,
            Parameter::Thickness => self.thickness,
            Parameter::Modulus => self.modulus,
            Parameter::Density => self.density,
            _ => None,
        }
    }
}

/// The bare bar on a balance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeighedBeam {
    /// Mass (kg).
    pub mass: f64,
    /// Standard uncertainty (kg).
    pub std: f64,
    /// Length (m) of the bar; a clamped part makes it longer than the beam.
    pub length: f64,
}

/// Settings of an estimate from frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct ConsistentSettings {
    /// Estimated parameters.
    pub fit: Vec<Parameter>,
    /// The joint of which everything is held that is not estimated: rigid and without coupling unless
    /// known otherwise.
    pub held: Joint,
    /// Weights of the residuals.
    pub weights: ResidualWeights,
    /// Uncertain properties of the beam: with measured weights they are estimated along with the
    /// joint, each held near its stated value. A property in `fit` has no such hold.
    pub tolerances: BeamTolerances,
    /// Uncertainties of the described structure's masses, in their order; with measured weights only.
    pub attachments: Vec<AttachmentTolerance>,
    /// Mass of the beam by a balance; with measured weights only.
    pub weighed: Option<WeighedBeam>,
    /// True where the model itself may miss every frequency by [`LEAST_DISCREPANCY`], or by more where the residuals ask
    /// for it; with measured weights only.
    pub discrepancy: bool,
}

impl ConsistentSettings {
    /// Returns settings for these parameters with measured weights and nothing held.
    pub fn fitting(fit: &[Parameter]) -> Self {
        Self {
            fit: fit.to_vec(),
            held: Joint::RIGID,
            weights: ResidualWeights::Measured,
            tolerances: BeamTolerances::default(),
            attachments: Vec::new(),
            weighed: None,
            discrepancy: false,
        }
    }

    /// Both springs of a joint.
    pub fn two_parameter() -> Self {
        Self::fitting(&[Parameter::Kt, Parameter::Kr])
    }

    /// Both springs and their coupling.
    pub fn three_parameter() -> Self {
        Self::fitting(&[Parameter::Kt, Parameter::Kr, Parameter::Coupling])
    }
}

// The result, as plain data.

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
    /// The quantity.
    pub quantity: Quantity,
    /// Best value, in the quantity's unit; `None` where it is infinite.
    pub value: Option<f64>,
    /// Standard uncertainty to first order; `None` without stated uncertainties or where nothing
    /// is known.
    pub std: Option<f64>,
    /// Standard uncertainty scaled by the misfit: where the misfit is larger than the stated uncertainties
    /// allow, and wherever none are stated.
    pub std_scaled: Option<f64>,
    /// Lower end of the 95 % interval; `None` = unknown or unbounded.
    pub low: Option<f64>,
    /// Upper end of the 95 % interval; `None` = unknown or unbounded.
    pub high: Option<f64>,
    /// The 95 % interval with the misfit for uncertainty, where `std_scaled` exists; not of Kz and Ktr,
    /// which have it by way of the coupling.
    pub scaled: Option<(f64, f64)>,
    /// Lower end of an interval without upper end: "at least".
    pub at_least: Option<f64>,
    /// Upper end of an interval without lower end: "at most".
    pub at_most: Option<f64>,
    /// The 95 % interval for a further set-up, where set-ups differ, in the unit of the value; `None` otherwise, and for Kz and Ktr.
    pub further: Option<(f64, f64)>,
    /// End of the range that the best value has reached.
    pub limit: Option<Limit>,
}

/// Correlation of two estimated parameters (their logarithms; of the coupling its atanh).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Correlation {
    /// First parameter.
    pub first: Parameter,
    /// Second parameter.
    pub second: Parameter,
    /// Between -1 and 1.
    pub value: f64,
}

/// One mode after the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedMode {
    /// Index of its structure: 0 as described, from 1 on where the clamp was moved.
    pub structure: usize,
    /// The mode's number.
    pub mode: usize,
    /// Measured frequency (Hz).
    pub measured: f64,
    /// Predicted frequency (Hz).
    pub predicted: f64,
    /// 100 (predicted - measured)/measured (%).
    pub error_percent: f64,
}

/// A minimum that is not the deepest.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherMinimum {
    /// Values of the quantities.
    pub values: Vec<(Quantity, f64)>,
    /// Misfit: chi-squared, or the sum of squared relative errors.
    pub misfit: f64,
    /// Root-mean-square error of its frequencies (%).
    pub rms_percent: f64,
}

/// A joint estimated from the frequencies themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct ConsistentEstimate {
    /// Numbers of the modes used of the structure as described.
    pub modes_used: Vec<usize>,
    /// Estimated parameters.
    pub fit: Vec<Parameter>,
    /// The numbers asked for, and after them the beam's uncertain properties.
    pub quantities: Vec<EstimatedQuantity>,
    /// Covariance of ln Kx and ln Ky (1), the beam's uncertainty included; with relative weights scaled by
    /// the misfit. `None` unless both are estimated and neither is at its limit.
    pub stiffness_covariance: Option<[[f64; 2]; 2]>,
    /// Correlations of every two estimated parameters.
    pub correlations: Vec<Correlation>,
    /// The misfit and what it says of the model.
    pub goodness: Goodness,
    /// Each mode.
    pub modes: Vec<FittedMode>,
    /// Other minima, the deepest first.
    pub other_minima: Vec<OtherMinimum>,
    /// What the model itself may miss (1, relative, one standard deviation of each frequency).
    pub discrepancy: f64,
    /// What each input contributes to the standard deviation of each quantity.
    pub budget: Vec<BudgetEntry>,
    /// Where the fit with the least discrepancy moved the uncertain properties of the description. A larger discrepancy would
    /// hide a wrong one.
    pub description: Vec<DescriptionPull>,
    /// What further measurements would make of the standard deviations, where the description is uncertain.
    pub remedies: Vec<Remedy>,
    /// Number of set-ups that differ beyond noise. Standard deviations and intervals are for their mean. 0 without.
    pub set_ups: usize,
    /// Reason for which the search ended.
    pub stop: StopReason,
    /// Report on what these frequencies determine.
    pub identifiability: Identifiability,
    /// The joint, non-dimensional.
    pub joint: JointStiffness,
    /// The beam that belongs to it, with what was estimated of it.
    pub beam: Beam,
}

impl ConsistentEstimate {
    /// One of the numbers.
    pub fn quantity(&self, quantity: Quantity) -> Option<&EstimatedQuantity> {
        let mut quantities = self.quantities.iter();
        quantities.find(|estimated| estimated.quantity == quantity)
    }
}

// From a point to stiffnesses in both units, the coupling, the beam.

/// A number that an estimate reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Kx (1).
    Kx,
    /// Ky (1).
    Ky,
    /// Kz (1).
    Kz,
    /// sqrt(Kx Ky)/Kz (1).
    Coupling,
    /// Kt (N/m).
    Kt,
    /// Kr (N m/rad).
    Kr,
    /// Ktr (N/rad).
    Ktr,
    /// Modulus (Pa).
    Modulus,
    /// Density (kg/m3).
    Density,
    /// Length (m).
    Length,
    /// Width (m).
    Width,
    /// Thickness (m).
    Thickness,
}

impl Quantity {
    /// Name as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kx => "kx",
            Self::Ky => "ky",
            Self::Kz => "kz",
            Self::Ktr => "ktr",
            other => other.lead().name(),
        }
    }

    /// Returns the numbers that follow from one estimated parameter.
    pub(super) fn of(parameter: Parameter) -> &'static [Self] {
        match parameter {
            Parameter::Kt => &[Self::Kx, Self::Kt],
            Parameter::Kr => &[Self::Ky, Self::Kr],
            Parameter::Coupling => &[Self::Coupling, Self::Kz, Self::Ktr],
            Parameter::Modulus => &[Self::Modulus],
            Parameter::Density => &[Self::Density],
            Parameter::Length => &[Self::Length],
            Parameter::Width => &[Self::Width],
            Parameter::Thickness => &[Self::Thickness],
            // The estimate is about the beam as described.
            Parameter::SecondLength
            | Parameter::ThirdLength
            | Parameter::FourthLength
            | Parameter::FifthLength
            | Parameter::SixthLength => &[],
        }
    }

    /// Returns the coordinate of a point that it is first of all about.
    pub fn lead(self) -> Parameter {
        match self {
            Self::Kx | Self::Kt => Parameter::Kt,
            Self::Ky | Self::Kr => Parameter::Kr,
            Self::Coupling | Self::Kz | Self::Ktr => Parameter::Coupling,
            Self::Modulus => Parameter::Modulus,
            Self::Density => Parameter::Density,
            Self::Length => Parameter::Length,
            Self::Width => Parameter::Width,
            Self::Thickness => Parameter::Thickness,
        }
    }

    /// Returns the gradient of its logarithm (of the coupling: of its atanh), which is constant; of Kz and
    /// Ktr without the part of the coupling.
    pub(super) fn gradient(self) -> Point {
        let [by_kt, by_kr] = match self {
            Self::Kx => [1.0, 0.0],
            Self::Ky => [0.0, 1.0],
            Self::Kz | Self::Ktr => [0.5, 0.5],
            other => return along(other.lead()),
        };
        let mut gradient = [0.0; PARAMETERS];
        gradient[Parameter::Kt.index()] = by_kt;
        gradient[Parameter::Kr.index()] = by_kr;
        if self != Self::Ktr {
            // Kx = 12 Kt L^3/(E b h^3) and Ky = 12 Kr L/(E b h^3); Kz of half of either.
            gradient[Parameter::Modulus.index()] = -1.0;
            gradient[Parameter::Width.index()] = -1.0;
            gradient[Parameter::Thickness.index()] = -3.0;
            gradient[Parameter::Length.index()] = 3.0 * by_kt + by_kr;
        }
        gradient
    }

    /// Returns its value at a point; `None` where it is infinite.
    pub(super) fn value(self, point: &Point) -> Option<f64> {
        let [log_kx, log_ky] = log_nondimensional(point);
        let [log_kt, log_kr, coupling, ..] = *point;
        let coupling = coupling.tanh();
        let value = match self {
            Self::Kx => log_kx.exp(),
            Self::Ky => log_ky.exp(),
            Self::Kz => (0.5 * (log_kx + log_ky)).exp() / coupling,
            Self::Ktr => (0.5 * (log_kt + log_kr)).exp() / coupling,
            Self::Coupling => coupling,
            other => point[other.lead().index()].exp(),
        };
        value.is_finite().then_some(value)
    }
}

/// Returns the non-dimensional joint at a point.
pub(super) fn joint_at(point: &Point) -> JointStiffness {
    let [kx, ky] = log_nondimensional(point).map(f64::exp);
    let coupling = point[Parameter::Coupling.index()].tanh();
    let cross = coupling / (kx.sqrt() * ky.sqrt());
    JointStiffness {
        kx,
        ky,
        cross_compliance: if cross.is_finite() { cross } else { 0.0 },
    }
}

// Goodness of fit: can the model explain the frequencies at all?

/// Below this probability the stated uncertainties and the model do not go together.
const DOUBTFUL: f64 = 0.01;

/// Chi-squared from which only its power of ten is of interest.
const MOST_IN_FULL: f64 = 1e4;

/// A smaller probability is written as "below" this: so far out a distribution's tail is no measurement, and the
/// smallest of all are written as 0.
const LEAST_PROBABILITY: f64 = 1e-12;

/// Below this one no usual slip in the uncertainties saves the model: with three degrees of
/// freedom it asks for misfits of more than three standard deviations in every direction.
const HOPELESS: f64 = 1e-6;
/// Root-mean-square misfit (1, relative, per degree of freedom) beyond which a model is in doubt
/// where no uncertainty is stated: a beam's dimensions usually leave 1 % open.
pub const NOTABLE_MISFIT: f64 = 0.01;
/// Misfit beyond which a model explains nothing: twice that, and ten times what tap tests repeat to.
const LARGE_MISFIT: f64 = 0.02;

/// Verdict of the misfit on the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FitVerdict {
    /// The misfit is no larger than the uncertainties allow.
    Explains,
    /// The misfit is larger than the uncertainties allow: they are too small, or the model lacks
    /// something.
    Doubtful,
    /// This model cannot explain these frequencies.
    CannotExplain,
    /// As many unknowns as frequencies: nothing is left to test with.
    Untestable,
}

/// The test of the model by its misfit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goodness {
    /// Sum of squared residuals over their standard deviations (1); without stated uncertainties
    /// `None`.
    pub chi_squared: Option<f64>,
    /// Frequencies and priors less parameters.
    pub degrees_of_freedom: usize,
    /// Probability of a larger chi-squared if the model is right.
    pub probability: Option<f64>,
    /// Root-mean-square relative misfit of the frequencies (1).
    pub relative_misfit: f64,
    /// Root-mean-square relative misfit per degree of freedom instead of per frequency; `None` without any.
    pub misfit_per_freedom: Option<f64>,
    /// Verdict that follows.
    pub verdict: FitVerdict,
}

impl Goodness {
    /// From the relative misfits of the frequencies (1), chi-squared where uncertainties are
    /// stated, and the degrees of freedom.
    pub(super) fn new(misfits: &[f64], chi_squared: Option<f64>, freedom: usize) -> Self {
        let squares: f64 = misfits.iter().map(|misfit| misfit * misfit).sum();
        let misfit_per_freedom = (freedom > 0).then(|| (squares / freedom as f64).sqrt());
        let probability = chi_squared
            .filter(|_| freedom > 0)
            .map(|chi_squared| chi_square_tail(chi_squared, freedom as f64));
        let verdict = match (probability, misfit_per_freedom) {
            (_, None) => FitVerdict::Untestable,
            (Some(p), _) if p < HOPELESS => FitVerdict::CannotExplain,
            (Some(p), _) if p < DOUBTFUL => FitVerdict::Doubtful,
            (None, Some(misfit)) if misfit > LARGE_MISFIT => FitVerdict::CannotExplain,
            (None, Some(misfit)) if misfit > NOTABLE_MISFIT => FitVerdict::Doubtful,
            _ => FitVerdict::Explains,
        };
        Self {
            chi_squared,
            degrees_of_freedom: freedom,
            probability,
            relative_misfit: (squares / misfits.len().max(1) as f64).sqrt(),
            misfit_per_freedom,
            verdict,
        }
    }

    /// Factor on every standard uncertainty under which the misfit would be as expected:
    /// sqrt(chi^2/degrees of freedom); `None` where there is no reason for one.
    pub fn uncertainty_factor(&self) -> Option<f64> {
        let too_large = self.probability.is_some_and(|p| p < DOUBTFUL);
        let chi_squared = self.chi_squared.filter(|_| too_large)?;
        Some((chi_squared / self.degrees_of_freedom as f64).sqrt())
    }

    /// The verdict in a sentence.
    pub fn words(&self) -> String {
        let misfit = 100.0 * self.relative_misfit;
        let test = match (self.chi_squared, self.probability) {
            (Some(chi_squared), Some(p)) => format!(
                "chi-squared {} with {} of freedom, probability {}, rms misfit {misfit:.2} %",
                if chi_squared < MOST_IN_FULL {
                    format!("{chi_squared:.1}")
                } else {
                    format!("{chi_squared:.1e}")
                },
                match self.degrees_of_freedom {
                    1 => "1 degree".to_owned(),
                    more => format!("{more} degrees"),
                },
                if p < LEAST_PROBABILITY {
                    format!("below {LEAST_PROBABILITY:e}")
                } else {
                    format!("{p:.1e}")
                }
            ),
            _ => format!("rms misfit {misfit:.2} %"),
        };
        match self.verdict {
            FitVerdict::Explains => format!("this model explains the frequencies ({test})"),
            FitVerdict::Doubtful if self.chi_squared.is_none() => {
                format!("the misfit is larger than a beam's dimensions usually leave open ({test})")
            }
            FitVerdict::Doubtful => format!(
                "the misfit is larger than the stated uncertainties allow: they are too small, or \
                 the model lacks something ({test})"
            ),
            FitVerdict::CannotExplain => {
                format!("this model cannot explain the frequencies ({test})")
            }
            FitVerdict::Untestable => format!(
                "as many unknowns as frequencies: the model cannot be tested ({test}); \
                 measure one more mode"
            ),
        }
    }
}

/// Returns the end of its range that a coordinate has reached but for rounding.
pub(super) fn limit_of(quantity: Quantity, point: &Point) -> Option<Limit> {
    // Within a factor e^3 of the end no frequency differs from that at the end.
    const NEAR: f64 = 3.0;
    let [log_kx, log_ky] = log_nondimensional(point);
    let log = match quantity.lead() {
        Parameter::Kt => log_kx,
        Parameter::Kr => log_ky,
        Parameter::Coupling => {
            let full = 1.0 - point[2].tanh().abs() < 1e-6;
            return full.then_some(Limit::FullCoupling);
        }
        _ => return None,
    };
    let (low, high) = LOG_STIFFNESS;
    if log > high - NEAR {
        Some(Limit::Rigid)
    } else if log < low + NEAR {
        Some(Limit::Absent)
    } else {
        None
    }
}

/// A combination of parameters that the frequencies hardly feel.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatDirection {
    /// The combination: a change of each parameter's logarithm (of the coupling: of its atanh).
    pub direction: Vec<(Parameter, f64)>,
    /// Standard uncertainty along it (1); `None` where nothing is known.
    pub std: Option<f64>,
    /// In a sentence.
    pub words: String,
}

/// The report.
#[derive(Debug, Clone, PartialEq)]
pub struct Identifiability {
    /// Singular values of the Jacobian (residuals in standard deviations, parameters as
    /// logarithms), descending: the inverse of each is the uncertainty of one combination.
    pub singular_values: Vec<f64>,
    /// Largest over smallest.
    pub condition: Option<f64>,
    /// Parameters that no frequency feels, whatever the others are.
    pub dead: Vec<Parameter>,
    /// Combinations that they hardly feel.
    pub flat: Vec<FlatDirection>,
    /// Parameters at the end of their range.
    pub at_limit: Vec<(Parameter, Limit)>,
}
