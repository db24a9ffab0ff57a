//! A joint estimate with its uncertainty and in SI units.

use super::pairs::{ModeLambda, PairsEstimate, PairsModel, estimate_pairs};
use super::perturbation::Stiffnesses;
use super::{Doubt, IdentifyError, SingleModeStiffness, single_mode_stiffness};
use tapjoint_beam::Beam;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_numerics::stats::NORMAL_95;

/// Relative standard uncertainty of any frequency that no repetition within a recording shows (1): 0.005 %, a steel beam's change
/// over a third of a kelvin.
pub const FREQUENCY_FLOOR: f64 = 5e-5;

/// A measured natural frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredMode {
    /// The mode's number in the model, from 1; rigid-body modes do not count.
    pub mode: usize,
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Its standard uncertainty (Hz), where known.
    pub std: Option<f64>,
}

/// A value with its uncertainty, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uncertain {
    /// Best value.
    pub value: f64,
    /// Standard uncertainty.
    pub std: Option<f64>,
    /// Lower end of the 95 % interval; `None` = unknown or unbounded.
    pub low: Option<f64>,
    /// Upper end of the 95 % interval; `None` = unknown or unbounded.
    pub high: Option<f64>,
}

impl Uncertain {
    /// A value with a symmetric 95 % interval, value +- 1.96 std.
    pub fn symmetric(value: f64, std: Option<f64>) -> Self {
        Self {
            value,
            std,
            low: std.map(|std| value - NORMAL_95 * std),
            high: std.map(|std| value + NORMAL_95 * std),
        }
    }

    /// In another unit, `factor` (positive) times the number.
    pub fn scaled(&self, factor: f64) -> Self {
        let scale = |part: Option<f64>| part.map(|part| factor * part);
        Self {
            value: factor * self.value,
            std: scale(self.std),
            low: scale(self.low),
            high: scale(self.high),
        }
    }
}

/// Joint stiffness with uncertainty, non-dimensional and in SI units. What does not exist is
/// `None`.
#[derive(Debug, Clone, PartialEq)]
pub struct JointEstimate {
    /// Numbers of the modes used.
    pub modes_used: Vec<usize>,
    /// Kx (1).
    pub kx: Option<Uncertain>,
    /// Ky (1).
    pub ky: Option<Uncertain>,
    /// Kz (1); without interval where the coupling's contains 0.
    pub kz: Option<Uncertain>,
    /// Coupling sqrt(Kx Ky)/Kz (1).
    pub coupling: Option<Uncertain>,
    /// Kt (N/m).
    pub kt: Option<Uncertain>,
    /// Kr (N m/rad).
    pub kr: Option<Uncertain>,
    /// Ktr (N/rad).
    pub ktr: Option<Uncertain>,
    /// The regression behind it.
    pub pairs: PairsEstimate,
    /// For a lap joint: what each mode says alone; else empty.
    pub single_modes: Vec<SingleModeStiffness>,
    /// What speaks against it.
    pub doubts: Vec<Doubt>,
}

/// Estimates a joint by the pair regression and carries the frequencies' standard uncertainties
/// through it, to first order and as independent. All modes given are used. Without the standard
/// uncertainty of every mode the estimate has none.
///
/// # Errors
/// As [`estimate_pairs`], and [`IdentifyError::Structure`] where the beam cannot exist.
pub fn estimate_joint(
    model: PairsModel,
    beam: &Beam,
    modes: &[MeasuredMode],
) -> Result<JointEstimate, IdentifyError> {
    beam.check()?;
    let regression = Regression::new(model, beam, modes)?;
    let pairs = regression.estimate(&regression.frequencies)?;
    let uncertain = |pick: fn(&PairsEstimate) -> Option<f64>| {
        pick(&pairs).map(|value| Uncertain::symmetric(value, regression.std_of(pick)))
    };
    let kz = uncertain(|pairs| pairs.kz).map(|kz| {
        let compliance = regression.std_of(|pairs| pairs.kz.map(f64::recip));
        through_reciprocal(&kz, compliance)
    });
    let (kx, ky) = (uncertain(|pairs| pairs.kx), uncertain(|pairs| pairs.ky));
    let mut doubts = pairs.doubts.clone();
    if kz.is_some_and(|kz| kz.std.is_some() && kz.low.is_none()) {
        doubts.push(Doubt::CouplingNotEstablished);
    }
    let units = StiffnessUnits::of(beam);
    let single_modes = match model {
        PairsModel::Lap => single_mode_stiffness(&regression.lambdas(&regression.frequencies))?,
        PairsModel::TwoParameter | PairsModel::ThreeParameter => Vec::new(),
    };
    Ok(JointEstimate {
        modes_used: pairs.modes.clone(),
        kt: kx.map(|kx| kx.scaled(units.kt)),
        kr: ky.map(|ky| ky.scaled(units.kr)),
        ktr: kz.map(|kz| kz.scaled(units.ktr)),
        kx,
        ky,
        kz,
        coupling: uncertain(|pairs| pairs.coupling),
        pairs,
        single_modes,
        doubts,
    })
}

/// The pair regression as a function of the frequencies (Hz) of these modes, for
/// [`super::perturbation`]; `None` where it has no finite answer.
///
/// # Errors
/// [`IdentifyError::Structure`] where the beam cannot exist.
pub fn pairs_estimator<'a>(
    model: PairsModel,
    beam: &'a Beam,
    mode_numbers: &'a [usize],
) -> Result<impl Fn(&[f64]) -> Option<Stiffnesses> + 'a, IdentifyError> {
    beam.check()?;
    Ok(move |frequencies: &[f64]| {
        let lambdas = lambdas_of(beam, mode_numbers.iter().copied(), frequencies);
        estimate_pairs(model, &lambdas).ok()?.stiffnesses()
    })
}

fn lambdas_of(
    beam: &Beam,
    numbers: impl Iterator<Item = usize>,
    frequencies: &[f64],
) -> Vec<ModeLambda> {
    let lambda = |(mode, &frequency): (usize, &f64)| ModeLambda {
        mode,
        lambda: beam.lambda_of(frequency),
    };
    numbers.zip(frequencies).map(lambda).collect()
}

/// The regression as a function of the frequencies.
struct Regression<'a> {
    model: PairsModel,
    beam: &'a Beam,
    modes: &'a [MeasuredMode],
    frequencies: Vec<f64>,
    stds: Option<Vec<f64>>,
}

impl<'a> Regression<'a> {
    fn new(
        model: PairsModel,
        beam: &'a Beam,
        modes: &'a [MeasuredMode],
    ) -> Result<Self, IdentifyError> {
        let unusable = |mode: &&MeasuredMode| {
            let frequency = mode.frequency;
            !(frequency > 0.0 && frequency.is_finite())
        };
        if let Some(mode) = modes.iter().find(unusable) {
            return Err(IdentifyError::Frequency {
                mode: mode.mode,
                value: mode.frequency,
            });
        }
        Ok(Self {
            model,
            beam,
            modes,
            frequencies: modes.iter().map(|mode| mode.frequency).collect(),
            stds: modes.iter().map(|mode| mode.std).collect(),
        })
    }

    fn lambdas(&self, frequencies: &[f64]) -> Vec<ModeLambda> {
        lambdas_of(
            self.beam,
            self.modes.iter().map(|mode| mode.mode),
            frequencies,
        )
    }

    fn estimate(&self, frequencies: &[f64]) -> Result<PairsEstimate, IdentifyError> {
        estimate_pairs(self.model, &self.lambdas(frequencies))
    }

    /// Standard uncertainty of one number of the estimate.
    fn std_of(&self, pick: impl Fn(&PairsEstimate) -> Option<f64>) -> Option<f64> {
        propagate(&self.frequencies, self.stds.as_deref()?, |shifted| {
            self.estimate(shifted).ok().as_ref().and_then(&pick)
        })
    }
}

/// Kz has its interval by way of 1/Kz, which is what the frequencies determine: where that
/// interval contains zero, Kz is unbounded on both sides.
fn through_reciprocal(kz: &Uncertain, compliance_std: Option<f64>) -> Uncertain {
    let ends = Uncertain::symmetric(1.0 / kz.value, compliance_std);
    match (ends.low, ends.high) {
        (Some(low), Some(high)) if low * high > 0.0 => Uncertain {
            low: Some(1.0 / high),
            high: Some(1.0 / low),
            ..*kz
        },
        _ => Uncertain {
            low: None,
            high: None,
            ..*kz
        },
    }
}

/// Standard deviation of a function of frequencies (Hz) with independent standard uncertainties
/// (Hz): the root of the sum of (derivative times std)^2, derivatives by central differences.
/// `None` where the function has no value nearby.
pub fn propagate(
    frequencies: &[f64],
    stds: &[f64],
    function: impl Fn(&[f64]) -> Option<f64>,
) -> Option<f64> {
    // Relative step: truncation of the order 1e-12, rounding of the order 1e-10.
    const STEP: f64 = 1e-6;
    let mut shifted = frequencies.to_vec();
    let mut variance = 0.0;
    for (index, (&frequency, &std)) in frequencies.iter().zip(stds).enumerate() {
        let step = STEP * frequency;
        shifted[index] = frequency + step;
        let above = function(&shifted)?;
        shifted[index] = frequency - step;
        let below = function(&shifted)?;
        shifted[index] = frequency;
        variance += ((above - below) / (2.0 * step) * std).powi(2);
    }
    variance.is_finite().then(|| variance.sqrt())
}
