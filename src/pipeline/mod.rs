//! The whole chain as one library call.
mod measure;
mod stage;
mod warning;

pub use measure::{MeasureError, MeasureSettings, MeasuredSpectra, Measurement, measure};
pub use warning::Warning;
