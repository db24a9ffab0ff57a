//! From modes to joint: estimate, prediction, perturbation, and doubts about them.

use super::analysis::{Estimate, Identification, ModeResult};
use super::consistent::{self, StructureDetails};
use super::doubts;
use super::model::TestedStructure;
use super::perturbation::perturbations;
use super::shapes::predicted_specimen;
use super::warning::Warning;
use crate::identify::consistent::{ConsistentEstimate, ConsistentEstimator, goodness};
use crate::identify::{
    Doubt, IdentifyError, MeasuredMode, PredictedMode, estimate_joint, estimate_modulus, predict,
};
use crate::structure::specimen::Specimen;
use crate::structure::{Beam, JointStiffness};

/// Which estimate is the main one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum EstimateMethod {
    /// Least squares on the frequencies themselves, the closed form beside it.
    #[default]
    Consistent,
    /// The closed form alone: the pair regression, or of a free beam its modulus.
    Pairs,
}

/// How the joint is identified.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifySettings {
    /// Which estimate is the main one: the consistent one, because it satisfies its own frequency
    /// equation.
    pub method: EstimateMethod,
    /// What the consistent estimate knows beyond beam and joint; nothing.
    pub details: StructureDetails,
    /// The first so many modes enter; `None` = all.
    pub fit_modes: Option<usize>,
    /// Methods whose estimate is perturbed: both, so that they can be compared.
    pub perturbed: Vec<EstimateMethod>,
    /// Changes of all frequencies for the perturbation (%).
    pub percents: Vec<f64>,
    /// Repetitions of the Monte Carlo and its seed; `None` = not wanted.
    pub monte_carlo: Option<(usize, u64)>,
}

impl Default for IdentifySettings {
    fn default() -> Self {
        IdentifySettings {
            method: EstimateMethod::Consistent,
            details: StructureDetails::default(),
            fit_modes: None,
            perturbed: vec![EstimateMethod::Pairs, EstimateMethod::Consistent],
            percents: crate::identify::perturbation::PAPER_PERCENTS.to_vec(),
            monte_carlo: None,
        }
    }
}

/// A misfit is worth a warning beyond this error (%): what a beam's stated dimensions usually leave
/// open in its frequencies.
const NOTABLE_MISFIT: f64 = 100.0 * goodness::NOTABLE_MISFIT;

/// Estimates the joint from numbered modes, predicts with it and perturbs it.
pub fn identify(
    structure: &TestedStructure,
    modes: &[ModeResult],
    settings: &IdentifySettings,
) -> (Identification, Vec<Warning>) {
    let measured = measured_modes(modes);
    let used: Vec<MeasuredMode> = measured
        .iter()
        .copied()
        .take(settings.fit_modes.unwrap_or(usize::MAX))
        .collect();
    let mut warnings = Vec::new();
    let (consistent, refused) = match settings.method {
        EstimateMethod::Pairs => (None, None),
        EstimateMethod::Consistent => split(consistently(structure, &settings.details, &used)),
    };
    let (estimator, consistent) = consistent.unzip();
    let consistent = consistent.map(Box::new);
    let (estimate, missing) = split(estimate(structure, &used));
    if let Some(reason) = refused.as_ref().filter(|_| estimate.is_some()) {
        warnings.push(doubts::of_fallback(structure, reason));
    }
    if let Some(found) = &consistent {
        warnings.extend(doubts::of_consistent(found));
    }
    if let Some(Estimate::Joint(joint)) = &estimate {
        let told = |doubt: &&Doubt| {
            consistent.is_none() || !matches!(doubt, Doubt::CouplingNotEstablished)
        };
        warnings.extend(joint.doubts.iter().filter(told).map(of_doubt));
    }
    // An estimate that no joint can have has its warning already; it predicts nothing.
    let found = (consistent.as_deref(), estimate.as_ref());
    let (prediction, predicted, failed) =
        predict_with(structure, found, (&measured, &used), settings);
    warnings.extend(failed);
    warnings.extend(misfit(&prediction, &measured));
    let perturbations = perturbations(structure, estimator.as_ref(), (modes, &used), settings);
    (
        Identification {
            reason: match (&consistent, &estimate) {
                (Some(_), _) => None,
                (None, Some(_)) => refused,
                (None, None) => refused.or(missing),
            },
            consistent,
            estimate,
            prediction,
            predicted,
            perturbations,
        },
        warnings,
    )
}

/// The modes with a number, ascending.
fn measured_modes(modes: &[ModeResult]) -> Vec<MeasuredMode> {
    modes
        .iter()
        .filter_map(|mode| {
            Some(MeasuredMode {
                mode: mode.mode?,
                frequency: mode.frequency,
                std: mode.std,
            })
        })
        .collect()
}

fn consistently(
    structure: &TestedStructure,
    details: &StructureDetails,
    used: &[MeasuredMode],
) -> Result<(ConsistentEstimator, ConsistentEstimate), IdentifyError> {
    let estimator = consistent::estimator(structure, details, used)?;
    let estimate = estimator.estimate()?;
    Ok((estimator, estimate))
}

fn estimate(structure: &TestedStructure, used: &[MeasuredMode]) -> Result<Estimate, IdentifyError> {
    match structure.regression {
        Some(model) => estimate_joint(model, &structure.beam, used)
            .map(|joint| Estimate::Joint(Box::new(joint))),
        None => estimate_modulus(structure.theory, &structure.beam, used).map(Estimate::FreeBeam),
    }
}

/// A result, or the reason why there is none.
fn split<T>(result: Result<T, IdentifyError>) -> (Option<T>, Option<String>) {
    match result {
        Ok(found) => (Some(found), None),
        Err(error) => (None, Some(error.to_string())),
    }
}

/// Beam and joint of the main estimate, or of the closed form with known stiffnesses in their place; of
/// a free beam with the estimated modulus.
fn estimated(
    structure: &TestedStructure,
    (consistent, estimate): (Option<&ConsistentEstimate>, Option<&Estimate>),
) -> Option<(Beam, JointStiffness)> {
    let with = |beam: Beam| move |joint: JointStiffness| (beam, joint);
    match (consistent, estimate) {
        (Some(found), _) => Some((found.beam, found.joint)),
        (None, Some(Estimate::FreeBeam(found))) => {
            let beam = Beam {
                modulus: found.modulus.value,
                ..structure.beam
            };
            Some((beam, JointStiffness::FREE))
        }
        (None, Some(Estimate::Joint(found))) => {
            let joint = structure.known.over(found.pairs.joint());
            joint.map(with(structure.beam))
        }
        (None, None) => structure.known.over(None).map(with(structure.beam)),
    }
}

/// The prediction, the structure it is of, and why there is none although there is an estimate.
fn predict_with(
    structure: &TestedStructure,
    found: (Option<&ConsistentEstimate>, Option<&Estimate>),
    (measured, used): (&[MeasuredMode], &[MeasuredMode]),
    settings: &IdentifySettings,
) -> (Vec<PredictedMode>, Option<Specimen>, Option<Warning>) {
    let Some((beam, joint)) = estimated(structure, found) else {
        return (Vec::new(), None, None);
    };
    let any = found.0.is_some() || found.1.is_some();
    let used = if any { used } else { &[] };
    let details = predicting(structure, found.0, settings);
    match prediction(structure, details, (&beam, &joint), (measured, used)) {
        Ok(prediction) => {
            let plain = StructureDetails::default();
            let details = details.unwrap_or(&plain);
            let predicted = predicted_specimen(structure, details, (&beam, &joint));
            (prediction, Some(predicted), None)
        }
        Err(error) => {
            let warning = found.0.map(|_| Warning::Estimate {
                code: "no-prediction",
                text: format!("the estimated joint cannot be predicted with: {error}"),
            });
            (Vec::new(), None, warning)
        }
    }
}

/// What the prediction knows beyond beam and joint; `None` = a plain beam. A fallback estimated without
/// sensors' masses predicts without them: it has taken them in.
fn predicting<'a>(
    structure: &TestedStructure,
    consistent: Option<&ConsistentEstimate>,
    settings: &'a IdentifySettings,
) -> Option<&'a StructureDetails> {
    let attached = consistent.is_some() || structure.known.over(None).is_some();
    (settings.method == EstimateMethod::Consistent && attached).then_some(&settings.details)
}

/// Frequencies of the estimated beam and joint beside the measured ones.
fn prediction(
    structure: &TestedStructure,
    details: Option<&StructureDetails>,
    (beam, joint): (&Beam, &JointStiffness),
    (measured, used): (&[MeasuredMode], &[MeasuredMode]),
) -> Result<Vec<PredictedMode>, IdentifyError> {
    let numbers: Vec<usize> = used.iter().map(|mode| mode.mode).collect();
    let count = measured.iter().map(|mode| mode.mode).max().unwrap_or(0) + 1;
    let beside = (measured, &numbers[..]);
    match details {
        Some(details) => consistent::predict(structure, details, (beam, joint), beside, count),
        None => {
            let held = (structure.assembly, joint);
            predict(structure.theory, beam, held, beside, count)
        }
    }
}

/// The worst misfit, if it is notable and beyond three standard deviations of its reading.
fn misfit(prediction: &[PredictedMode], measured: &[MeasuredMode]) -> Option<Warning> {
    let error = |mode: &PredictedMode| mode.error_percent.map_or(0.0, f64::abs);
    let worst = prediction
        .iter()
        .max_by(|a, b| error(a).total_cmp(&error(b)))?;
    let error_percent = worst
        .error_percent
        .filter(|error| error.abs() > NOTABLE_MISFIT)?;
    let reading = measured.iter().find(|mode| mode.mode == worst.mode)?;
    let deviations = reading
        .std
        .map(|std| (worst.predicted - reading.frequency) / std);
    deviations
        .is_none_or(|deviations| deviations.abs() > 3.0)
        .then_some(Warning::Misfit {
            mode: worst.mode,
            error_percent,
            deviations,
        })
}

fn of_doubt(doubt: &Doubt) -> Warning {
    match doubt {
        Doubt::Closure { closure } => Warning::Closure { closure: *closure },
        Doubt::CouplingNotEstablished => Warning::CouplingNotEstablished,
        other => Warning::UnphysicalEstimate {
            what: other.to_string(),
        },
    }
}
