//! Natural frequencies of a known or estimated joint beside the measured ones.

use super::{IdentifyError, MeasuredMode, Uncertain};
use tapjoint_beam::{
    Assembly, Beam, BeamTheory, JointStiffness, NaturalMode, Slenderness, natural_frequencies,
    natural_modes,
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
    /// True where the measured frequency entered the estimate of the joint.
    pub used: bool,
}

/// Returns the first `count` modes, and all measured ones beyond, of a beam on this joint by this theory.
/// `used` holds the numbers of the modes that entered the estimate.
///
/// # Errors
/// [`IdentifyError::Structure`] where beam or joint cannot exist.
pub fn predict(
    theory: BeamTheory,
    beam: &Beam,
    assembly: Assembly,
    joint: &JointStiffness,
    measured: &[MeasuredMode],
    used: &[usize],
    count: usize,
) -> Result<Vec<PredictedMode>, IdentifyError> {
    let highest = measured.iter().map(|mode| mode.mode).max().unwrap_or(0);
    let frequencies = natural_frequencies(theory, beam, assembly, joint, count.max(highest))?;
    Ok(compare(beam, &frequencies, measured, used))
}

/// Sets predicted frequencies (Hz) of modes 1, 2, ... beside the measured modes. Those with numbers in `used` entered
/// the estimate.
pub fn compare(
    beam: &Beam,
    predicted: &[f64],
    measured: &[MeasuredMode],
    used: &[usize],
) -> Vec<PredictedMode> {
    let modes = (1..).zip(predicted).map(|(mode, &predicted)| {
        let found = measured.iter().find(|measured| measured.mode == mode);
        let measured = found.map(|found| found.frequency);
        PredictedMode {
            mode,
            measured,
            predicted,
            lambda: beam.lambda_of(predicted),
            error_percent: measured.map(|measured| 100.0 * (predicted - measured) / measured),
            used: used.contains(&mode),
        }
    });
    modes.collect()
}

/// Returns the first `count` lambda (1) of an Euler beam, where no beam is described.
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

// A free beam has no joint: its natural frequencies check modulus and density.

/// Material of a free beam by its natural frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeBeamEstimate {
    /// Numbers of the modes used.
    pub modes_used: Vec<usize>,
    /// Modulus (Pa) from each mode alone, with the mode's number, at the stated density.
    pub per_mode: Vec<(usize, f64)>,
    /// Modulus (Pa) by least squares of the relative frequency errors, at the stated density.
    pub modulus: Uncertain,
    /// Density (kg/m3) that explains the same frequencies at the stated modulus instead: only
    /// the ratio of both follows from frequencies.
    pub density: Uncertain,
}

/// Modulus of a free beam. Each frequency is proportional to the root of the modulus, with shear
/// too, for the ratio of shear modulus to modulus is Poisson's; hence no iteration.
///
/// # Errors
/// [`IdentifyError::TooFewModes`] without any mode, [`IdentifyError::Frequency`], and
/// [`IdentifyError::Structure`] where the beam cannot exist.
pub fn estimate_modulus(
    theory: BeamTheory,
    beam: &Beam,
    modes: &[MeasuredMode],
) -> Result<FreeBeamEstimate, IdentifyError> {
    beam.check()?;
    let highest = modes.iter().map(|mode| mode.mode).max();
    let highest = highest.ok_or(IdentifyError::TooFewModes {
        model: "free beam",
        unknowns: 1,
        needed: 1,
        found: 0,
        simpler: "",
    })?;
    let exact = natural_frequencies(theory, beam, Assembly::Free, &JointStiffness::FREE, highest)?;
    // Measured over nominal frequency, for each mode.
    let mut ratios = Vec::with_capacity(modes.len());
    for mode in modes {
        let usable = mode.frequency > 0.0 && mode.frequency.is_finite();
        let nominal = exact
            .get(mode.mode.wrapping_sub(1))
            .filter(|_| usable)
            .ok_or(IdentifyError::Frequency {
                mode: mode.mode,
                value: mode.frequency,
            })?;
        ratios.push(mode.frequency / nominal);
    }
    // min sum (1 - x/r)^2 over x = sqrt(E/E0): x = sum(1/r) / sum(1/r^2).
    let first: f64 = ratios.iter().map(|ratio| 1.0 / ratio).sum();
    let second: f64 = ratios.iter().map(|ratio| ratio.powi(-2)).sum();
    let root = first / second;
    // dx/dr = (2 x/r - 1)/(r^2 sum(1/r^2)).
    let variances = modes.iter().zip(&ratios).map(|(mode, ratio)| {
        let spread = ratio * mode.std? / mode.frequency;
        let slope = (2.0 * root / ratio - 1.0) / (ratio * ratio * second);
        Some((slope * spread).powi(2))
    });
    let variance: Option<f64> = variances.sum();
    let relative = variance.map(|variance| variance.sqrt() / root);
    let modulus = beam.modulus * root * root;
    let density = beam.density / (root * root);
    Ok(FreeBeamEstimate {
        modes_used: modes.iter().map(|mode| mode.mode).collect(),
        per_mode: modes
            .iter()
            .zip(&ratios)
            .map(|(mode, ratio)| (mode.mode, beam.modulus * ratio * ratio))
            .collect(),
        modulus: Uncertain::symmetric(modulus, relative.map(|relative| 2.0 * relative * modulus)),
        density: Uncertain::symmetric(density, relative.map(|relative| 2.0 * relative * density)),
    })
}

// From measured frequencies to numbers of modes.

/// Numbers the measured frequencies (Hz, ascending) of a structure whose natural frequencies are
/// predicted (Hz, ascending): each mode gets the measured frequency nearest to it, within `tolerance`
/// (relative to the predicted one) and nearer to it than to any other mode; frequencies left over
/// have no number.
pub fn pair_by_frequency(
    measured: &[f64],
    predicted: &[f64],
    tolerance: f64,
) -> Vec<Option<usize>> {
    // For each mode the nearest of the frequencies that are nearest to it, and its distance.
    let mut best: Vec<Option<(usize, f64)>> = vec![None; predicted.len()];
    for (index, frequency) in measured.iter().enumerate() {
        let distances = predicted.iter().map(|f| ((frequency - f) / f).abs());
        let nearest = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((mode, distance)) = nearest
            && distance <= tolerance
            && best[mode].is_none_or(|(_, known)| distance < known)
        {
            best[mode] = Some((index, distance));
        }
    }
    let mut numbers = vec![None; measured.len()];
    for (mode, best) in best.into_iter().enumerate() {
        if let Some((index, _)) = best {
            numbers[index] = Some(mode + 1);
        }
    }
    numbers
}

/// A measured peak: where it is and how much it stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightedPeak {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Weight, such as its height over the noise (dB).
    pub weight: f64,
}

/// Numbers the peaks of a structure whose natural frequencies are known but for one common factor
/// near 1 (a free beam of uncertain modulus): the factor is the one under which the peaks that match
/// within `tolerance` weigh most, among factors that differ from 1 by at most `range`; of equals the
/// one nearest 1.
pub fn pair_by_ratio(
    peaks: &[WeightedPeak],
    predicted: &[f64],
    range: f64,
    tolerance: f64,
) -> Vec<Option<usize>> {
    let measured: Vec<f64> = peaks.iter().map(|peak| peak.frequency).collect();
    let mut best = (f64::NEG_INFINITY, f64::INFINITY, vec![None; peaks.len()]);
    for frequency in &measured {
        for nominal in predicted {
            let factor = frequency / nominal;
            let off = (factor - 1.0).abs();
            if off > range {
                continue;
            }
            let scaled: Vec<f64> = predicted.iter().map(|f| factor * f).collect();
            let numbers = pair_by_frequency(&measured, &scaled, tolerance);
            let numbered = peaks
                .iter()
                .zip(&numbers)
                .filter(|(_, number)| number.is_some());
            let weight: f64 = numbered.map(|(peak, _)| peak.weight).sum();
            if weight > best.0 || weight == best.0 && off <= best.1 {
                best = (weight, off, numbers);
            }
        }
    }
    best.2
}
