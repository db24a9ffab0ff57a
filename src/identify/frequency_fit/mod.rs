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

pub mod estimate;
pub mod estimator;
pub mod model;
pub mod result;

mod initial_guesses;
mod problem;

pub use estimate::estimate_consistently;
pub use estimator::{
    ConsistentEstimator, ConsistentMonteCarlo, Neighbourhood, PointFit, QuantitySpread,
};
pub use model::{
    FrequencyModel, JointedStructure, ModeResponse, PARAMETERS, Parameter, Point, Route,
};
pub use result::{
    ConsistentEstimate, Correlation, EstimatedQuantity, ExtraMode, FittedMode, FlatDirection,
    Goodness, Identifiability, Limit, NOTABLE_MISFIT, NeededAccuracy, OtherMinimum, Quantity,
    Verdict,
};
pub use tapjoint_beam::specimen::LapLayout;
pub use tapjoint_numerics::least_squares::{Loss, StopReason};

use tapjoint_beam::Joint;

// What is to be estimated, and how.

/// Divisor of the residuals.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ResidualWeights {
    /// Each frequency's standard uncertainty.
    #[default]
    Measured,
    /// The frequency itself: equal relative weights, and no intervals.
    Relative,
}

/// Standard uncertainties of the beam's properties, all relative (1); `None` = taken as exact.
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
}

impl BeamTolerances {
    pub(super) fn of(&self, parameter: Parameter) -> Option<f64> {
        match parameter {
            Parameter::Length => self.length,
            Parameter::Width => self.width,
            Parameter::Thickness => self.thickness,
            Parameter::Modulus => self.modulus,
            Parameter::Density => self.density,
            Parameter::Kt | Parameter::Kr | Parameter::Coupling => None,
        }
    }
}

/// The way to a 95 % interval.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Intervals {
    /// Profile likelihood: all values with chi-squared within 3.84 of the smallest, everything
    /// else refitted. Right also where a stiffness has no upper limit.
    #[default]
    Profile,
    /// 1.96 standard deviations of the logarithm: for speed.
    Linear,
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
    /// Weight of large misfits.
    pub loss: Loss,
    /// Uncertain properties of the beam: with measured weights they are estimated along with the
    /// joint, each held near its stated value. A property in `fit` has no such hold.
    pub tolerances: BeamTolerances,
    /// The beam weighed, of a lap joint both halves together without what the overlap adds: its mass
    /// and the standard uncertainty of that (kg). With it modulus and density can be told apart.
    pub weighed_mass: Option<(f64, f64)>,
    /// Way to the 95 % intervals.
    pub intervals: Intervals,
}

impl ConsistentSettings {
    /// Returns settings for these parameters with measured weights, plain squares and nothing held.
    pub fn fitting(fit: &[Parameter]) -> Self {
        Self {
            fit: fit.to_vec(),
            held: Joint::RIGID,
            weights: ResidualWeights::Measured,
            loss: Loss::Squares,
            tolerances: BeamTolerances::default(),
            weighed_mass: None,
            intervals: Intervals::Profile,
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

    /// Returns the same settings with equal relative weights.
    pub fn with_relative_weights(mut self) -> Self {
        self.weights = ResidualWeights::Relative;
        self
    }
}
