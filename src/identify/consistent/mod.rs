//! Consistent estimator
pub mod estimator;
pub mod goodness;
pub mod least_squares;
pub mod model;
pub mod problem;
pub mod quantities;
pub mod settings;

mod covariance;
mod starts;

pub use estimator::{ConsistentEstimator, PointFit};
pub use goodness::{Goodness, Verdict, exceedance};
pub use least_squares::StopReason;
pub use model::{
    FrequencyModel, JointedStructure, LapLayout, ModeResponse, PARAMETERS, Parameter, Point, Route,
};
pub use problem::Loss;
pub use quantities::Quantity;
pub use settings::{BeamTolerances, ConsistentSettings, HeldJoint, Intervals, ResidualWeights};
