//! Diagnosis of the gap between model and measurement: where it lies, which effect causes it, how far the effect
//! closes it.
//!
//! ```text
//! Observations, Nominal -> observations   common modes, unpaired peaks, checks
//!                          dataset        data with their uncertainties, nuisance parameters
//!                          structure      the described structure, and how well it is known
//!                          description    what an error of the description does to the frequencies
//!                          set_up         sensors and hammer as a hypothesis has them
//!                          parameters     priors, nuisance parameters, order of the parameters
//!                          modal_model    modes of a structure under a hypothesis
//!                          candidates     effects that are hypotheses
//!                          mode_in_place  modes where sensors and masses sit
//!                          forward        predictions of a hypothesis and their slopes
//!                          evidence       evidence of a hypothesis (with optimum)
//!                          common_factor  what all frequencies have in common
//!                          amplitude      joints whose stiffness depends on the amplitude (with joint_motion)
//!                          fixture        the fixture's own resonance
//!                          fit            local optima of one hypothesis
//!                          foreign        causes outside the catalogue (with foreign_fits)
//!                          unknown        evidence of something outside the catalogue
//!                          validate       residuals, hold-out data, leave-one-recording-out
//!                          verdict        tests of one explanation, probabilities of all, an answer
//!                          effect_pairs   two effects at once
//!                          compare        all hypotheses
//!                          next_test      the most informative next test
//!                          location_map   changes along the beam
//!                          summary        the result
//! ```
//! `settings` has what a caller may choose, and `thresholds` the limits of its decisions.
//!
//! Every hypothesis is the nominal model, one or two effects of the catalogue added to it, or something unknown.
//! Under each, the joint's stiffnesses and all nuisance parameters are fitted and integrated over. Nuisance
//! parameters are the beam's properties, what the model misses of each mode, and drift of the joint and temperature
//! between set-ups. So are masses and places of sensors and added masses, places of the taps, and calibration. The uncertainty of the data comes from the measurement, never
//! from a residual. This crate cannot reach the simulator, so that its answers to virtual tests are independent of
//! it.

mod amplitude;
mod candidates;
mod common_factor;
mod compare;
mod dataset;
mod description;
mod effect_pairs;
mod evidence;
mod fit;
mod fixture;
mod foreign;
mod foreign_fits;
mod forward;
mod joint_motion;
mod location_map;
mod modal_model;
mod mode_in_place;
mod next_test;
mod observations;
mod optimum;
mod parameters;
mod result;
#[cfg(test)]
mod search_tests;
mod set_up;
#[cfg(test)]
mod set_up_tests;
mod settings;
mod structure;
mod summary;
mod synthetic;
#[cfg(test)]
mod tests;
mod thresholds;
mod unknown;
mod validate;
mod verdict;

pub use parameters::LogNormal;
pub use result::{
    AmplitudeDependence, Block, Closure, CommonFactor, CrossValidation, DecidedBy, Diagnosis,
    FrequencyChange, Hypothesis, HypothesisResult, JointShift, LeftOutRecording, LocationMap,
    LocationProbabilities, Misfit, NextTest, ParameterValue, Proposal, Residual, UnlocatedSensors,
    Verdict,
};
pub use settings::{DETECTABLE, GapError, GapSettings};
pub use structure::{DescriptionUncertainty, Nominal, NominalSensor};
pub use synthetic::{PlannedConfiguration, TestPlan, observe};
pub use thresholds::{Scale, Stage, ThresholdError, Thresholds};

use tapjoint_identify::observation::Observations;

/// Returns the chi square (priors included) that the nominal model with its joint refitted leaves of a test:
/// the most that any effect could gain.
///
/// # Errors
/// As [`diagnose`].
pub fn nominal_chi_square(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Result<f64, GapError> {
    let test = checked(observations, nominal, settings)?;
    compare::least_nominal_chi_square(test).ok_or(GapError::NoFit)
}

/// Diagnoses the observations of a test against the described structure.
///
/// # Errors
/// [`GapError`] where no diagnosis is possible: too few modes, no uncertainties, recordings of
/// different structures, sensors at nodes.
pub fn diagnose(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Result<Diagnosis, GapError> {
    let fits = SingleFits::new(observations, nominal, settings)?;
    let Comparison { fits, unlocated } = fits.with_pairs(&settings.thresholds);
    Ok(summary::diagnosis(&fits, unlocated))
}

/// Refuses observations that cannot be diagnosed.
///
/// # Errors
/// As [`diagnose`].
pub fn check(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Result<(), GapError> {
    checked(observations, nominal, settings).map(|_| ())
}

/// Fits of the nominal model, of single effects and of something unknown. Thresholds of [`Stage::Pairs`] act on what
/// follows from them.
#[derive(Clone)]
pub struct SingleFits {
    fits: compare::ModelComparison,
    unlocated: Option<UnlocatedSensors>,
}

impl SingleFits {
    /// Fits the observations of a test.
    ///
    /// # Errors
    /// As [`diagnose`].
    pub fn new(
        observations: &Observations,
        nominal: &Nominal,
        settings: &GapSettings,
    ) -> Result<Self, GapError> {
        let test = checked(observations, nominal, settings)?;
        Ok(SingleFits {
            fits: compare::compare_without_pairs(test)?,
            unlocated: compare::without_unlocated(test),
        })
    }

    /// Adds pairs of effects and all probabilities.
    pub fn with_pairs(mut self, thresholds: &Thresholds) -> Comparison {
        self.fits.dataset.settings.thresholds = thresholds.clone();
        self.fits.add_pairs();
        Comparison {
            fits: self.fits,
            unlocated: self.unlocated,
        }
    }
}

/// Fits of all hypotheses with their probabilities. Thresholds of [`Stage::Verdict`] act on what follows from them.
#[derive(Clone)]
pub struct Comparison {
    fits: compare::ModelComparison,
    unlocated: Option<UnlocatedSensors>,
}

impl Comparison {
    /// Returns the diagnosis without its next tests.
    pub fn without_next_tests(mut self, thresholds: &Thresholds) -> Diagnosis {
        self.fits.dataset.settings.thresholds = thresholds.clone();
        summary::without_next_tests(&self.fits, self.unlocated)
    }
}

/// Returns the evidence that the reading of one mode is off and nothing else is missing, over that of the nominal model
/// (logarithm). `None` for a mode that takes no part in the fit.
///
/// # Errors
/// As [`diagnose`].
pub fn reading_evidence(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
    mode: usize,
) -> Result<Option<f64>, GapError> {
    let test = checked(observations, nominal, settings)?;
    Ok(compare::reading_evidence(test, mode))
}

/// Returns the test if it can be diagnosed.
fn checked<'a>(
    observations: &'a Observations,
    nominal: &'a Nominal,
    settings: &'a GapSettings,
) -> Result<compare::Test<'a>, GapError> {
    settings.check()?;
    observations::check(observations, nominal, &settings.thresholds)?;
    Ok(compare::Test {
        observations,
        nominal,
        settings,
    })
}
