//! The joint, or the free beam's material, in the document; and predicted beside measured frequencies.

use schemars::JsonSchema;
use serde::Serialize;

use super::super::format::significant;
use tapjoint_analysis::{Estimate, EstimateMethod, Identification};
use tapjoint_beam::Beam;
use tapjoint_identify::consistent::{
    ConsistentEstimate, Correlation, EstimatedQuantity, Limit, Quantity,
};
use tapjoint_identify::{FreeBeamEstimate, JointEstimate, PredictedMode, Uncertain};
use tapjoint_numerics::stats::times;

/// The joint, or the free beam's material.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct EstimateSection {
    /// "consistent", "pairs", or "free-beam".
    pub method: Method,
    /// Modes that entered.
    pub modes_used: Vec<usize>,
    /// Why the estimate is doubtful, if it is.
    pub reason: Option<String>,
    /// Kx, non-dimensional.
    pub kx: Option<ValueSection>,
    /// Ky, non-dimensional.
    pub ky: Option<ValueSection>,
    /// Kz, non-dimensional.
    pub kz: Option<ValueSection>,
    /// sqrt(Kx Ky)/Kz.
    pub coupling: Option<ValueSection>,
    /// Kt (N/m).
    pub kt: Option<ValueSection>,
    /// Kr (N m/rad).
    pub kr: Option<ValueSection>,
    /// Ktr (N/rad).
    pub ktr: Option<ValueSection>,
    /// Young's modulus (Pa).
    pub modulus: Option<ValueSection>,
    /// Density (kg/m3).
    pub density: Option<ValueSection>,
    /// The beam that belongs to the joint: as described but for what was estimated of it; null of a closed
    /// form.
    pub beam: Option<Beam>,
    /// Covariance of ln Kx and ln Ky, of a consistent estimate with both; scaled by the misfit where no
    /// uncertainty is stated.
    pub log_covariance: Option<[[f64; 2]; 2]>,
    /// Correlations between the parameters.
    pub correlations: Vec<Correlation>,
    /// Probability of a larger misfit if the model is right; null where nothing is left to test with.
    pub goodness_of_fit: Option<f64>,
    /// The misfit behind it; null of a closed form.
    pub misfit: Option<MisfitSection>,
    /// What the frequencies can tell; null of a closed form.
    pub identifiability: Option<IdentifiabilitySection>,
    /// The pair regression.
    pub pairs: Option<PairsSection>,
    /// A free beam in closed form.
    pub free_beam: Option<FreeBeamSection>,
    /// What each mode says alone: of a lap joint its Kx if antisymmetric or Ky if symmetric, of a free
    /// beam its modulus; else empty.
    pub single_modes: Vec<SingleModeSection>,
}

/// How a joint or a beam was estimated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Least squares on the frequencies themselves.
    #[default]
    Consistent,
    /// The regression over pairs of modes.
    Pairs,
    /// A free beam's closed form.
    FreeBeam,
}

impl Method {
    /// Its name in outputs.
    pub fn name(self) -> &'static str {
        match self {
            Method::Consistent => "consistent",
            Method::Pairs => "pairs",
            Method::FreeBeam => "free-beam",
        }
    }
}

impl From<EstimateMethod> for Method {
    fn from(method: EstimateMethod) -> Self {
        match method {
            EstimateMethod::Consistent => Method::Consistent,
            EstimateMethod::Pairs => Method::Pairs,
        }
    }
}

/// A value with its uncertainty.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct ValueSection {
    /// The value; null where it is infinite: rigid.
    #[schemars(with = "Option<f64>")]
    pub value: f64,
    /// Standard deviation.
    pub std: Option<f64>,
    /// Lower 95 % limit.
    pub low: Option<f64>,
    /// Upper 95 % limit.
    pub high: Option<f64>,
    /// Standard deviation scaled by the misfit: where the model misses the frequencies by more than
    /// their uncertainties, and where none are stated.
    pub std_scaled: Option<f64>,
    /// Lower 95 % limit by the scaled standard deviation and Student's distribution.
    pub low_scaled: Option<f64>,
    /// Upper 95 % limit likewise.
    pub high_scaled: Option<f64>,
    /// Where there is no upper limit: at least this much, with 95 % confidence.
    pub at_least: Option<f64>,
    /// Where there is no lower limit: at most this much, likewise.
    pub at_most: Option<f64>,
}

/// What one mode says alone; a value that it cannot give is null.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct SingleModeSection {
    /// Mode number.
    pub mode: usize,
    /// Kx, if the mode is antisymmetric.
    pub kx: Option<f64>,
    /// Ky, if the mode is symmetric.
    pub ky: Option<f64>,
    /// Young's modulus (Pa).
    pub modulus: Option<f64>,
}

/// The pair regression's values.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct PairsSection {
    /// Kx.
    pub kx: Option<f64>,
    /// Ky.
    pub ky: Option<f64>,
    /// Kz.
    pub kz: Option<f64>,
    /// Kt (N/m).
    pub kt: Option<f64>,
    /// Kr (N m/rad).
    pub kr: Option<f64>,
    /// Ktr (N/rad).
    pub ktr: Option<f64>,
    /// Product implied by the regression over the product of its own estimates, minus 1.
    pub closure: Option<f64>,
    /// Largest over smallest singular value of the regression, its columns scaled to 1.
    pub condition: Option<f64>,
}

/// How well the model explains the frequencies.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct MisfitSection {
    /// Sum of squared residuals over their standard deviations; null without uncertainties.
    pub chi_squared: Option<f64>,
    /// Frequencies and priors less parameters.
    pub degrees_of_freedom: usize,
    /// Root-mean-square relative misfit of the frequencies (%).
    pub rms_percent: f64,
    /// The verdict in a sentence.
    pub verdict: String,
}

/// What the frequencies can and cannot tell.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct IdentifiabilitySection {
    /// Singular values of the Jacobian, descending: the inverse of each is the relative uncertainty of
    /// one combination of the parameters.
    pub singular_values: Vec<f64>,
    /// Largest over smallest.
    pub condition: Option<f64>,
    /// Flat directions, dead parameters, parameters at the end of their range, in sentences.
    pub statements: Vec<String>,
}

/// A free beam's material in closed form: either value alone, with the other as described.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct FreeBeamSection {
    /// Young's modulus (Pa) at the described density.
    pub modulus: f64,
    /// Density (kg/m3) at the described modulus instead.
    pub density: f64,
}

/// One measured mode beside its prediction. error_percent = 100 (predicted - measured)/measured.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct PredictionSection {
    /// Mode number.
    pub mode: usize,
    /// Measured (Hz).
    pub measured: Option<f64>,
    /// Predicted (Hz).
    pub predicted: Option<f64>,
    /// Predicted, non-dimensional.
    pub lambda: Option<f64>,
    /// Error (%).
    pub error_percent: Option<f64>,
    /// Whether the mode entered the estimate.
    pub used: bool,
}

pub(super) fn estimate_section(found: &Identification) -> Option<EstimateSection> {
    let closed = found.estimate.as_ref().map(|estimate| match estimate {
        Estimate::Joint(joint) => joint_section(joint),
        Estimate::FreeBeam(free) => free_section(free),
    });
    let Some(consistent) = &found.consistent else {
        return closed;
    };
    let closed = closed.unwrap_or_default();
    Some(EstimateSection {
        pairs: closed.pairs,
        free_beam: closed.free_beam,
        single_modes: closed.single_modes,
        ..consistent_section(consistent)
    })
}

fn joint_section(joint: &JointEstimate) -> EstimateSection {
    let doubts: Vec<String> = joint.doubts.iter().map(ToString::to_string).collect();
    EstimateSection {
        method: Method::Pairs,
        modes_used: joint.modes_used.clone(),
        reason: (!doubts.is_empty()).then(|| doubts.join("; ")),
        kx: joint.kx.map(ValueSection::from),
        ky: joint.ky.map(ValueSection::from),
        kz: joint.kz.map(ValueSection::from),
        coupling: joint.coupling.map(ValueSection::from),
        kt: joint.kt.map(ValueSection::from),
        kr: joint.kr.map(ValueSection::from),
        ktr: joint.ktr.map(ValueSection::from),
        pairs: Some(PairsSection {
            kx: joint.pairs.kx,
            ky: joint.pairs.ky,
            kz: joint.pairs.kz,
            kt: joint.kt.map(|kt| kt.value),
            kr: joint.kr.map(|kr| kr.value),
            ktr: joint.ktr.map(|ktr| ktr.value),
            closure: joint.pairs.closure,
            condition: Some(joint.pairs.condition),
        }),
        single_modes: joint
            .single_modes
            .iter()
            .map(|single| SingleModeSection {
                mode: single.mode,
                kx: single.kx,
                ky: single.ky,
                modulus: None,
            })
            .collect(),
        ..Default::default()
    }
}

fn free_section(free: &FreeBeamEstimate) -> EstimateSection {
    EstimateSection {
        method: Method::FreeBeam,
        modes_used: free.modes_used.clone(),
        modulus: Some(free.modulus.into()),
        density: Some(free.density.into()),
        free_beam: Some(FreeBeamSection {
            modulus: free.modulus.value,
            density: free.density.value,
        }),
        single_modes: free
            .per_mode
            .iter()
            .map(|&(mode, modulus)| SingleModeSection {
                mode,
                modulus: Some(modulus),
                ..Default::default()
            })
            .collect(),
        ..Default::default()
    }
}

impl From<Uncertain> for ValueSection {
    fn from(found: Uncertain) -> Self {
        ValueSection {
            value: found.value,
            std: found.std,
            low: found.low,
            high: found.high,
            ..ValueSection::default()
        }
    }
}

pub(super) fn prediction_section(mode: &PredictedMode) -> PredictionSection {
    PredictionSection {
        mode: mode.mode,
        measured: mode.measured,
        predicted: Some(mode.predicted),
        lambda: Some(mode.lambda),
        error_percent: mode.error_percent,
        used: mode.used,
    }
}

/// The main estimate; what stands beside it is added by the caller.
fn consistent_section(found: &ConsistentEstimate) -> EstimateSection {
    let value = |quantity: Quantity| found.quantity(quantity).and_then(value_section);
    // A property with a tolerance is fitted along, but nobody asked for it.
    let asked = |quantity: Quantity| value(quantity).filter(|_| is_asked(found, quantity));
    let goodness = &found.goodness;
    EstimateSection {
        method: Method::Consistent,
        modes_used: found.modes_used.clone(),
        reason: goodness.uncertainty_factor().map(|factor| {
            format!(
                "the model misses the frequencies by {} % rms; uncertainties that would allow \
                     that are {} times the stated ones",
                significant(100.0 * goodness.relative_misfit, 2),
                times(factor)
            )
        }),
        kx: value(Quantity::Kx),
        ky: value(Quantity::Ky),
        kz: value(Quantity::Kz),
        coupling: value(Quantity::Coupling),
        kt: value(Quantity::Kt),
        kr: value(Quantity::Kr),
        ktr: value(Quantity::Ktr),
        modulus: asked(Quantity::Modulus),
        density: asked(Quantity::Density),
        correlations: found.correlations.clone(),
        beam: Some(found.beam),
        log_covariance: found.stiffness_covariance,
        goodness_of_fit: goodness.probability,
        misfit: Some(MisfitSection {
            chi_squared: goodness.chi_squared,
            degrees_of_freedom: goodness.degrees_of_freedom,
            rms_percent: 100.0 * goodness.relative_misfit,
            verdict: goodness.words(),
        }),
        identifiability: Some(identifiability(found)),
        ..EstimateSection::default()
    }
}

/// A rigid joint is infinite in the tables and null in JSON; a value at the edge of its range has no
/// standard deviation.
fn value_section(quantity: &EstimatedQuantity) -> Option<ValueSection> {
    let rigid = quantity.limit == Some(Limit::Rigid) || quantity.value.is_none();
    let spring = !matches!(
        quantity.quantity,
        Quantity::Coupling | Quantity::Kz | Quantity::Ktr
    );
    if quantity.value.is_none() && !spring {
        return None;
    }
    let rigid = rigid && spring;
    let scaled = quantity.scaled.filter(|_| !rigid);
    Some(ValueSection {
        value: quantity.value.filter(|_| !rigid).unwrap_or(f64::INFINITY),
        std: quantity.std.filter(|_| !rigid),
        low: quantity.low,
        high: quantity.high,
        std_scaled: quantity.std_scaled.filter(|_| !rigid),
        low_scaled: scaled.map(|scaled| scaled.0),
        high_scaled: scaled.map(|scaled| scaled.1),
        at_least: quantity.at_least,
        at_most: quantity.at_most,
    })
}

fn is_asked(found: &ConsistentEstimate, quantity: Quantity) -> bool {
    found
        .fit
        .iter()
        .any(|parameter| parameter.name() == quantity.name())
}

/// Where the beam's uncertain properties went.
fn fitted_along(found: &ConsistentEstimate) -> Vec<String> {
    let beam = [
        (Quantity::Modulus, "Pa"),
        (Quantity::Density, "kg/m3"),
        (Quantity::Length, "m"),
        (Quantity::Width, "m"),
        (Quantity::Thickness, "m"),
    ];
    beam.iter()
        .filter(|(quantity, _)| !is_asked(found, *quantity))
        .filter_map(|(quantity, unit)| {
            let value = found.quantity(*quantity)?.value?;
            Some(format!(
                "{} has a tolerance and was fitted along, to {value:.6e} {unit}",
                quantity.name()
            ))
        })
        .collect()
}

fn identifiability(found: &ConsistentEstimate) -> IdentifiabilitySection {
    let report = &found.identifiability;
    let dead = report
        .dead
        .iter()
        .map(|parameter| format!("{} is felt by none of these frequencies", parameter.name()));
    let limits = report.at_limit.iter().map(|(parameter, limit)| {
        let end = match limit {
            Limit::Rigid => "rigid",
            Limit::Absent => "absent",
            Limit::FullCoupling => "as large as any joint can have it",
        };
        format!("{} is at the end of its range: {end}", parameter.name())
    });
    let flat = report.flat.iter().map(|flat| flat.words.clone());
    IdentifiabilitySection {
        singular_values: report.singular_values.clone(),
        condition: report.condition,
        statements: flat
            .chain(dead)
            .chain(limits)
            .chain(fitted_along(found))
            .collect(),
    }
}
