//! Natural frequencies of a known or estimated joint beside the measured ones.

use super::{IdentifyError, MeasuredMode};
use tapjoint_beam::{
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
    let highest = measured.0.iter().map(|mode| mode.mode).max().unwrap_or(0);
    let slenderness = beam.slenderness(theory);
    let modes = natural_modes(assembly, joint, &slenderness, count.max(highest))?;
    let frequencies: Vec<f64> = modes
        .iter()
        .map(|mode| beam.frequency_of(mode.lambda))
        .collect();
    Ok(compare(beam, &frequencies, measured))
}

/// Sets predicted frequencies (Hz) of modes 1, 2, ..., wherever they come from, beside the measured
/// modes, of which those with numbers in the second list entered the estimate.
pub fn compare(
    beam: &Beam,
    predicted: &[f64],
    (measured, used): (&[MeasuredMode], &[usize]),
) -> Vec<PredictedMode> {
    let row = |(index, &predicted): (usize, &f64)| {
        let number = index + 1;
        let found = measured.iter().find(|measured| measured.mode == number);
        let measured = found.map(|found| found.frequency);
        PredictedMode {
            mode: number,
            measured,
            predicted,
            lambda: beam.lambda_of(predicted),
            error_percent: measured.map(|measured| 100.0 * (predicted - measured) / measured),
            used: used.contains(&number),
        }
    };
    predicted.iter().enumerate().map(row).collect()
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
