//! From readings to stiffnesses, by both estimators, and how far they are from the draw's truth.

use super::plan::{BlockPlan, Layout};
use super::result::StudiedStiffness;
use super::virtual_test::{Read, Truth, Truths, index_of};
use super::{ResolutionError, StudiedTest};
use tapjoint_analysis::EstimateMethod;
use tapjoint_beam::{Assembly, JointStiffness};
use tapjoint_description::ReadBy;
use tapjoint_identify::consistent::{
    ConsistentEstimator, ConsistentSettings, JointedStructure, Neighbourhood, Parameter,
};
use tapjoint_identify::{
    IdentifyError, MeasuredMode, PairsModel, estimate_modulus, pairs_estimator,
};

/// Errors (1) of the stiffnesses in one draw, in the order of [`Estimators::parameters`]; `None` where
/// there is no estimate.
pub(super) type ParameterErrors = Vec<Option<f64>>;

/// A stiffness that is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stiffness {
    Kx,
    Ky,
    Kz,
    Modulus,
}

impl Stiffness {
    pub fn name(self) -> &'static str {
        match self {
            Stiffness::Kx => "kx",
            Stiffness::Ky => "ky",
            Stiffness::Kz => "kz",
            Stiffness::Modulus => "modulus",
        }
    }
}

/// The tested structure as the estimator takes it.
pub(super) fn jointed(test: &StudiedTest) -> JointedStructure {
    let described = &test.structure;
    let mut jointed = JointedStructure::new(described.theory, described.beam, described.assembly);
    if described.assembly == Assembly::Lap {
        jointed.lap = test.details.lap;
    }
    jointed.masses = test.details.masses.clone();
    jointed
}

/// Both estimators, for the modes of the study.
#[derive(Debug)]
pub(super) struct Estimators {
    /// What is estimated.
    pub parameters: Vec<Stiffness>,
    /// Numbers of all modes of the study.
    pub numbers: Vec<usize>,
    /// Sample rate of the recordings (Hz).
    pub sample_rate: f64,
    structure: JointedStructure,
    settings: ConsistentSettings,
    regression: Option<PairsModel>,
    /// Indices of the modes that enter.
    used: Vec<usize>,
    nominal: Truth,
}

impl Estimators {
    pub fn new(test: &StudiedTest, layout: &Layout) -> Result<Self, ResolutionError> {
        let parameters = parameters_of(test);
        let used: Vec<usize> = layout.used().map(|(index, _)| index).collect();
        if parameters.is_empty() {
            return Err(IdentifyError::NothingToEstimate.into());
        }
        if used.len() < parameters.len() {
            return Err(IdentifyError::TooFewFrequencies {
                unknowns: parameters.len(),
                found: used.len(),
            }
            .into());
        }
        Ok(Estimators {
            settings: settings_of(test, &parameters),
            parameters,
            numbers: layout.modes.iter().map(|mode| mode.number).collect(),
            sample_rate: layout.sample_rate,
            structure: jointed(test),
            regression: test.structure.regression,
            used,
            nominal: Truths::new(test)?.nominal(test),
        })
    }

    /// Errors of the stiffnesses from what one way of reading says of the modes, consistent estimate
    /// first.
    pub fn errors(
        &self,
        truth: &Truth,
        (plan, bands): (&BlockPlan, &[Vec<[Option<Read>; 3]>]),
        reading: ReadBy,
    ) -> [ParameterErrors; 2] {
        let modes: Option<Vec<MeasuredMode>> = self
            .used
            .iter()
            .map(|&mode| {
                let read = read_of(plan, bands, mode)?[index_of(reading)]?;
                Some(MeasuredMode {
                    mode: self.numbers[mode],
                    // The draw's beam is the nominal one but for a factor on its modulus, which is
                    // known: without that factor one model serves all draws.
                    frequency: read.frequency / truth.scale,
                    std: Some(read.std / truth.scale),
                })
            })
            .collect();
        EstimateMethod::ALL.map(|method| match &modes {
            None => vec![None; self.parameters.len()],
            Some(modes) => self.relative_errors(method, modes, truth),
        })
    }

    fn relative_errors(
        &self,
        method: EstimateMethod,
        modes: &[MeasuredMode],
        truth: &Truth,
    ) -> ParameterErrors {
        // The regression's own error on exact frequencies is no reading's doing.
        let (found, exact) = match method {
            EstimateMethod::Consistent => (
                self.consistent(modes, truth),
                Some(self.true_values(&truth.joint)),
            ),
            EstimateMethod::Pairs => (self.pairs(modes), self.pairs(&self.exact(truth))),
        };
        let nothing = || vec![None; self.parameters.len()];
        let Some((found, exact)) = found.zip(exact) else {
            return nothing();
        };
        let error = |(found, exact): (&f64, &f64)| {
            let error = found / exact - 1.0;
            (error.is_finite() && *exact != 0.0).then_some(error)
        };
        found.iter().zip(&exact).map(error).collect()
    }

    /// The modes that enter, with their true frequencies (the factor on the modulus taken out).
    fn exact(&self, truth: &Truth) -> Vec<MeasuredMode> {
        let exact = |&mode: &usize| {
            let number = self.numbers[mode];
            MeasuredMode {
                mode: number,
                frequency: truth.frequencies[number - 1] / truth.scale,
                std: None,
            }
        };
        self.used.iter().map(exact).collect()
    }

    fn true_values(&self, joint: &JointStiffness) -> Vec<f64> {
        let modulus = self.structure.beam.modulus;
        let value = |parameter: &Stiffness| value_of(joint, modulus, *parameter);
        self.parameters.iter().map(value).collect()
    }

    fn consistent(&self, modes: &[MeasuredMode], truth: &Truth) -> Option<Vec<f64>> {
        let estimator = ConsistentEstimator::new(&self.structure, modes, &self.settings).ok()?;
        let fit = estimator.refit(&estimator.frequencies(), &Neighbourhood::at(&[truth.point]));
        fit.stop.converged().then(|| {
            let modulus = fit.point[Parameter::Modulus as usize].exp();
            let joint = fit.joint();
            let value = |parameter: &Stiffness| value_of(&joint, modulus, *parameter);
            self.parameters.iter().map(value).collect()
        })
    }

    fn pairs(&self, modes: &[MeasuredMode]) -> Option<Vec<f64>> {
        let structure = &self.structure;
        let Some(model) = self.regression else {
            let found = estimate_modulus(structure.theory, &structure.beam, modes).ok()?;
            return Some(vec![found.modulus.value]);
        };
        let numbers: Vec<usize> = modes.iter().map(|mode| mode.mode).collect();
        let frequencies: Vec<f64> = modes.iter().map(|mode| mode.frequency).collect();
        let found = pairs_estimator(model, &structure.beam, &numbers).ok()?(&frequencies)?;
        let value = |parameter: &Stiffness| match parameter {
            Stiffness::Kx => Some(found.kx),
            Stiffness::Ky => Some(found.ky),
            Stiffness::Kz => found.kz,
            Stiffness::Modulus => None,
        };
        self.parameters.iter().map(value).collect()
    }

    /// The stiffnesses of the study with their nominal values.
    pub fn described(&self, joint: &JointStiffness) -> Vec<StudiedStiffness> {
        let values = self.true_values(joint);
        let pairs = self.pairs(&self.exact(&self.nominal));
        let one = |(index, (parameter, value)): (usize, (&Stiffness, f64))| StudiedStiffness {
            parameter: parameter.name(),
            value,
            pairs_bias_percent: pairs
                .as_ref()
                .map(|found| 100.0 * (found[index] / value - 1.0)),
        };
        self.parameters
            .iter()
            .zip(values)
            .enumerate()
            .map(one)
            .collect()
    }

    /// What errors of the readings do to a stiffness to first order, relative to it: rms for errors
    /// uniform over a line (of rms spacing/sqrt 12), and at most for errors of half a line each.
    pub fn by_half_lines(
        &self,
        plan: &BlockPlan,
        layout: &Layout,
        (method, parameter): (EstimateMethod, usize),
    ) -> Option<(f64, f64)> {
        let modes = self.exact(&self.nominal);
        let frequencies: Vec<f64> = modes.iter().map(|mode| mode.frequency).collect();
        let half_lines: Vec<f64> = layout
            .used()
            .map(|(_, mode)| plan.bands[mode.band].lines.half_line())
            .collect();
        let value = |shifted: &[f64]| {
            let modes: Vec<MeasuredMode> = modes
                .iter()
                .zip(shifted.iter().zip(&half_lines))
                .map(|(mode, (&frequency, half))| MeasuredMode {
                    frequency,
                    std: Some(half / 3f64.sqrt()),
                    ..*mode
                })
                .collect();
            let found = match method {
                EstimateMethod::Consistent => self.consistent(&modes, &self.nominal)?,
                EstimateMethod::Pairs => self.pairs(&modes)?,
            };
            found.get(parameter).copied()
        };
        let exact = value(&frequencies)?.abs();
        // One mode's error at a time, by central differences: the rms of independent errors is the root
        // of their squares' sum, the bound the sum. Truncation is of the order 1e-10, rounding of 1e-8.
        const STEP: f64 = 1e-5;
        let mut shifted = frequencies.clone();
        let (mut squares, mut sum) = (0.0f64, 0.0f64);
        for (index, (frequency, half)) in frequencies.iter().zip(&half_lines).enumerate() {
            let step = STEP * frequency;
            shifted[index] = frequency + step;
            let above = value(&shifted)?;
            shifted[index] = frequency - step;
            let below = value(&shifted)?;
            shifted[index] = *frequency;
            let moved = (half * (above - below) / (2.0 * step)).abs();
            squares += moved * moved / 3.0;
            sum += moved;
        }
        Some((squares.sqrt() / exact, sum / exact))
    }
}

/// What the readings of the band that estimates take say of a mode.
fn read_of<'a>(
    plan: &BlockPlan,
    bands: &'a [Vec<[Option<Read>; 3]>],
    mode: usize,
) -> Option<&'a [Option<Read>; 3]> {
    // Bands are ordered by width: the first that holds a mode is the narrowest.
    let (band, place) = plan.bands.iter().enumerate().find_map(|(index, band)| {
        let place = band.modes.iter().position(|&other| other == mode)?;
        Some((index, place))
    })?;
    bands.get(band)?.get(place)
}

fn value_of(joint: &JointStiffness, modulus: f64, parameter: Stiffness) -> f64 {
    match parameter {
        Stiffness::Kx => joint.kx,
        Stiffness::Ky => joint.ky,
        Stiffness::Kz => joint.kz().unwrap_or(f64::INFINITY),
        Stiffness::Modulus => modulus,
    }
}

/// Finite stiffnesses are estimated, rigid and absent ones are held.
fn parameters_of(test: &StudiedTest) -> Vec<Stiffness> {
    if test.structure.assembly == Assembly::Free {
        return vec![Stiffness::Modulus];
    }
    let finite = |value: f64| value > 0.0 && value.is_finite();
    let mut parameters = Vec::new();
    if finite(test.joint.kx) {
        parameters.push(Stiffness::Kx);
    }
    if finite(test.joint.ky) {
        parameters.push(Stiffness::Ky);
    }
    let three = test.structure.regression == Some(PairsModel::ThreeParameter);
    if three && test.joint.kz().is_some() {
        parameters.push(Stiffness::Kz);
    }
    parameters
}

fn settings_of(test: &StudiedTest, parameters: &[Stiffness]) -> ConsistentSettings {
    let parameter = |stiffness: &Stiffness| match stiffness {
        Stiffness::Kx => Parameter::Kt,
        Stiffness::Ky => Parameter::Kr,
        Stiffness::Kz => Parameter::Coupling,
        Stiffness::Modulus => Parameter::Modulus,
    };
    let fit: Vec<Parameter> = parameters.iter().map(parameter).collect();
    ConsistentSettings {
        held: test.joint.in_si(&test.structure.beam),
        ..ConsistentSettings::fitting(&fit)
    }
}
