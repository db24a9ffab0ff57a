//! The consistent estimate: the joint (and beam) whose natural frequencies are nearest to the
//! measured ones.
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
pub mod goodness;
pub mod identifiability;
pub mod intervals;
pub mod layout;
pub mod least_squares;
pub mod model;
pub mod monte_carlo;
pub mod problem;
pub mod quantities;
pub mod result;
pub mod settings;

mod correlations;
mod covariance;
mod starts;
mod valleys;

pub use estimate::estimate_consistently;
pub use estimator::{ConsistentEstimator, Neighbourhood, PointFit};
pub use goodness::{Goodness, Verdict, exceedance};
pub use identifiability::{ExtraMode, FlatDirection, Identifiability, NeededAccuracy};
pub use layout::{JointedStructure, Route};
pub use least_squares::StopReason;
pub use model::{FrequencyModel, ModeResponse, PARAMETERS, Parameter, Point};
pub use monte_carlo::{ConsistentMonteCarlo, QuantitySpread};
pub use problem::Loss;
pub use quantities::Quantity;
pub use result::{
    ConsistentEstimate, Correlation, EstimatedQuantity, FittedMode, Limit, OtherMinimum,
};
pub use settings::{BeamTolerances, ConsistentSettings, HeldJoint, Intervals, ResidualWeights};
pub use tapjoint_beam::specimen::LapLayout;
