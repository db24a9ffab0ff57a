//! Natural frequencies of a known or estimated joint beside the measured ones.

use super::{IdentifyError, MeasuredMode};
use crate::structure::{
    Assembly, Beam, BeamTheory, JointStiffness, NaturalMode, Slenderness, natural_modes,
};

/// One mode as predicted and, where it was measured, as measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedMode {
    /// The mode's number, from 1.
    pub mode: usize,
    /// Measured frequency (Hz).
    pub measured: Option<f64>,
    /// Predicted frequency (Hz).
    pub predicted: f64,
    /// Predicted non-dimensional frequency lambda (1).
    pub lambda: f64,
    /// 100 (predicted - measured)/measured (%).
    pub error_percent: Option<f64>,
    /// Whether the measured frequency entered the estimate of the joint.
    pub used: bool,
}

/// The first `count` modes, and all measured ones beyond, of a beam on this joint by this theory.
/// `used` holds the numbers of the modes that entered the estimate.
///
/// # Errors
/// [`IdentifyError::Structure`] where beam or joint cannot exist.
pub fn predict(
    theory: BeamTheory,
    beam: &Beam,
    (assembly, joint): (Assembly, &JointStiffness),
    measured: (&[MeasuredMode], &[usize]),
    count: usize,
) -> Result<Vec<PredictedMode>, IdentifyError> {
    beam.check()?;
    let (measured, used) = measured;
    let highest = measured.iter().map(|mode| mode.mode).max().unwrap_or(0);
    let slenderness = beam.slenderness(theory);
    let modes = natural_modes(assembly, joint, &slenderness, count.max(highest))?;
    let row = |(index, mode): (usize, &NaturalMode)| {
        let number = index + 1;
        let predicted = beam.frequency_of(mode.lambda);
        let found = measured.iter().find(|measured| measured.mode == number);
        let measured = found.map(|found| found.frequency);
        PredictedMode {
            mode: number,
            measured,
            predicted,
            lambda: mode.lambda,
            error_percent: measured.map(|measured| 100.0 * (predicted - measured) / measured),
            used: used.contains(&number),
        }
    };
    Ok(modes.iter().enumerate().map(row).collect())
}

/// The first `count` lambda (1) of an Euler beam, where no beam is described.
///
/// # Errors
/// [`IdentifyError::Structure`] where the joint cannot exist.
pub fn predict_lambdas(
    assembly: Assembly,
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<NaturalMode>, IdentifyError> {
    Ok(natural_modes(assembly, joint, &Slenderness::EULER, count)?)
}
