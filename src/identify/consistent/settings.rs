//! What is to be estimated, and how.

use super::least_squares::Accuracy;
use super::model::Parameter;
use super::problem::Loss;

/// What the residuals are divided by.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ResidualWeights {
    /// Each frequency's standard uncertainty.
    #[default]
    Measured,
    /// The frequency itself: equal relative weights, and no intervals.
    Relative,
}

/// A stiffness or coupling that is held instead of estimated.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HeldJoint {
    /// Kt (N/m); infinite = rigid.
    pub kt: Option<f64>,
    /// Kr (N m/rad); infinite = rigid.
    pub kr: Option<f64>,
    /// sqrt(Kt Kr)/Ktr (1).
    pub coupling: Option<f64>,
}

/// Standard uncertainties of the beam's properties, all relative (1); `None` = taken as exact.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BeamTolerances {
    /// Of the length.
    pub length: Option<f64>,
    /// Of the width.
    pub width: Option<f64>,
    /// Of the thickness.
    pub thickness: Option<f64>,
    /// Of the modulus.
    pub modulus: Option<f64>,
    /// Of the density.
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

/// Whether intervals are found by following the misfit or from the covariance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Intervals {
    /// Profile likelihood: all values with chi-squared within 3.84 of the smallest, everything
    /// else refitted. Right also where a stiffness has no upper limit.
    #[default]
    Profile,
    /// 1.96 standard deviations of the logarithm: for speed.
    Linear,
}

/// How a joint is estimated from frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct ConsistentSettings {
    /// What is estimated.
    pub fit: Vec<Parameter>,
    /// Stiffnesses held at known values. What is neither estimated nor held is rigid (Kt, Kr) or
    /// absent (coupling).
    pub held: HeldJoint,
    /// Weights of the residuals.
    pub weights: ResidualWeights,
    /// How large misfits count.
    pub loss: Loss,
    /// Uncertain properties of the beam: with measured weights they are estimated along with the
    /// joint, each held near its stated value. A property in `fit` has no such hold.
    pub tolerances: BeamTolerances,
    /// The beam weighed, of a lap joint both halves together without what the overlap adds: its mass
    /// and the standard uncertainty of that (kg). With it modulus and density can be told apart.
    pub weighed_mass: Option<(f64, f64)>,
    /// How intervals are found.
    pub intervals: Intervals,
}

impl ConsistentSettings {
    /// These parameters with measured weights, plain squares and nothing held.
    pub fn fitting(fit: &[Parameter]) -> Self {
        Self {
            fit: fit.to_vec(),
            held: HeldJoint::default(),
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

    /// The same with equal relative weights.
    pub fn with_relative_weights(mut self) -> Self {
        self.weights = ResidualWeights::Relative;
        self
    }

    pub(super) const ACCURACY: Accuracy = Accuracy::FULL;
}
