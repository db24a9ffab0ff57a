//! A free beam has no joint: its natural frequencies check modulus and density.

use super::{IdentifyError, MeasuredMode, Uncertain};
use tapjoint_beam::{Assembly, Beam, BeamTheory, JointStiffness, natural_modes};

/// What the natural frequencies of a free beam say about its material.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeBeamEstimate {
    /// Numbers of the modes used.
    pub modes_used: Vec<usize>,
    /// Modulus (Pa) from each mode alone, with the mode's number, at the stated density.
    pub per_mode: Vec<(usize, f64)>,
    /// Modulus (Pa) by least squares of the relative frequency errors, at the stated density.
    pub modulus: Uncertain,
    /// Density (kg/m3) that explains the same frequencies at the stated modulus instead: only
    /// the ratio of both can be told from frequencies.
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
    let Some(highest) = highest else {
        return Err(IdentifyError::TooFewModes {
            model: "free beam",
            unknowns: 1,
            needed: 1,
            found: 0,
            simpler: "",
        });
    };
    let theory = beam.slenderness(theory);
    let exact = natural_modes(Assembly::Free, &JointStiffness::FREE, &theory, highest)?;
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
        ratios.push(mode.frequency / beam.frequency_of(nominal.lambda));
    }
    // min sum (1 - x/r)^2 over x = sqrt(E/E0): x = sum(1/r) / sum(1/r^2).
    let first: f64 = ratios.iter().map(|ratio| 1.0 / ratio).sum();
    let second: f64 = ratios.iter().map(|ratio| ratio.powi(-2)).sum();
    let root = first / second;
    let relative = relative_std(modes, &ratios, root);
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

/// Relative standard uncertainty of x = sum(1/r)/sum(1/r^2) from those of the frequencies:
/// dx/dr = (2 x/r - 1)/(r^2 sum(1/r^2)).
fn relative_std(modes: &[MeasuredMode], ratios: &[f64], root: f64) -> Option<f64> {
    let second: f64 = ratios.iter().map(|ratio| ratio.powi(-2)).sum();
    let mut variance = 0.0;
    for (mode, ratio) in modes.iter().zip(ratios) {
        let spread = ratio * mode.std? / mode.frequency;
        let slope = (2.0 * root / ratio - 1.0) / (ratio * ratio * second);
        variance += (slope * spread).powi(2);
    }
    Some(variance.sqrt() / root)
}
