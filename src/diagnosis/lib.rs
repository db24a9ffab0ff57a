//! The gap between model and measurement: where it lies, which effect causes it, how far it closes.
//!
//! ```text
//! Observations, Nominal -> frame       readings and small unknowns in order
//!                          forward     what a hypothesis predicts (structure, effects)
//!                          evidence    how probable the readings are under it
//!                          fixture_peak  peaks of no mode, and the fixture whose mode they may be
//!                          posterior   probabilities, places, what cannot be told apart
//!                          quality     misfit overall, by block, with each mode left out
//!                          withheld    what it predicts of readings that took no part
//!                          left_out    what it predicts of each recording from the others
//!                          trial       what all of this says of one explanation
//!                          verdict     an answer, or the reason why there is none
//!                          unplaced    the model without sensors that sat nobody knows where
//!                          decay_law   the joint's law that explains changes along the decays
//!                          decay_finding  what the decays say by themselves
//!                          advisor     which test would tell more
//! ```
//!
//! Every hypothesis is the nominal model, one effect of the catalogue added to it, or "something else";
//! under each, the joint's stiffnesses and all small unknowns (geometry's common scale, the joint's
//! drift and the warmth between visits, masses, inertias and places of sensors, calibration) are fitted and integrated over. The
//! uncertainty of the readings comes from the measurement, never from a residual. This module cannot
//! reach the simulator, so that its answers to virtual tests are answers.

mod advisor;
mod afar;
mod along_decay;
mod assemble;
mod branches;
mod catalogue;
mod catch_all;
mod checks;
mod common_modes;
mod decay_finding;
mod decay_law;
mod decay_readings;
mod doubt;
mod error;
mod evidence;
#[cfg(test)]
mod example;
mod fastened;
mod fixture_peak;
mod forward;
mod frame;
mod hypothesis;
mod joint_energy;
mod joint_path;
mod knowledge;
mod least_squares;
mod left_out;
mod lone_peaks;
mod noise;
mod nominal;
mod pairs;
mod place_map;
mod posterior;
mod profile;
mod quality;
mod result;
mod search;
mod settings;
mod setup;
mod shear;
mod small_slopes;
mod small_unknowns;
mod solved;
mod synthetic;
mod trial;
mod unplaced;
mod verdict;
mod withheld;

pub use advisor::{NextTest, Step};
pub use decay_finding::{DecayChange, DecayFinding};
pub use error::GapError;
pub use nominal::{Nominal, NominalSensor};
pub use result::{
    Block, Closure, DecidedBy, Diagnosis, Hypothesis, HypothesisResult, JointShift,
    LeftOutRecording, LeftOutRecordings, Misfit, ParameterValue, PlaceMap, PlaceProbabilities,
    Pull, Verdict,
};
pub use settings::GapSettings;
pub use synthetic::{PlannedConfiguration, TestPlan, observe};
pub use trial::MISFIT;
pub use unplaced::Unplaced;
pub use verdict::SEEN;

use tapjoint_identify::observation::Observations;

/// By how much chi square (priors included) the nominal model with its joint refitted misses what a test
/// observed: what any effect could gain at most.
///
/// # Errors
/// As [`diagnose`].
pub fn nominal_chi_square(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Result<f64, GapError> {
    settings.check()?;
    checks::check(observations, nominal)?;
    search::nominal_chi_square(observations, nominal, settings).ok_or(GapError::NoFit)
}

/// Diagnoses what a test observed against what it was described to be.
///
/// # Errors
/// [`GapError`] where there is nothing to diagnose: too few modes, no uncertainties, recordings of
/// different structures, sensors that see nothing.
pub fn diagnose(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Result<Diagnosis, GapError> {
    settings.check()?;
    checks::check(observations, nominal)?;
    let mut competition = search::compete(observations, nominal, settings)?;
    doubt::doubt(&mut competition);
    let unplaced = unplaced::unplaced(observations, nominal, settings);
    Ok(assemble::diagnosis(&competition, unplaced, settings))
}
