//! From modes to joint: estimate, prediction, perturbation, and doubts about them.

use super::analysis::{BoundPerturbation, Estimate, Identification, ModeResult, Perturbation};
use super::model::TestedStructure;
use super::warning::Warning;
use crate::identify::perturbation::{
    SIGN_PATTERN_MODES, average_errors, mode_sensitivities, perturb_uniformly, sign_pattern_spans,
    sign_patterns,
};
use crate::identify::{
    Doubt, IdentifyError, MeasuredMode, PairsModel, PredictedMode, estimate_joint,
    estimate_modulus, monte_carlo, pairs_estimator, predict,
};
use crate::structure::{Beam, JointStiffness};

/// How the joint is identified.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifySettings {
    /// The first so many modes enter; `None` = all.
    pub fit_modes: Option<usize>,
    /// Changes of all frequencies for the perturbation (%).
    pub percents: Vec<f64>,
    /// Repetitions of the Monte Carlo and its seed; `None` = not wanted.
    pub monte_carlo: Option<(usize, u64)>,
}

impl Default for IdentifySettings {
    fn default() -> Self {
        IdentifySettings {
            fit_modes: None,
            percents: crate::identify::perturbation::PAPER_PERCENTS.to_vec(),
            monte_carlo: None,
        }
    }
}

/// A misfit is worth a warning beyond this error (%): what a beam's stated dimensions usually leave
/// open in its frequencies.
const NOTABLE_MISFIT: f64 = 1.0;

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
    let (estimate, reason) = match estimate(structure, &used) {
        Ok(estimate) => (Some(estimate), None),
        Err(error) => (None, Some(error.to_string())),
    };
    if let Some(Estimate::Joint(joint)) = &estimate {
        warnings.extend(joint.doubts.iter().map(of_doubt));
    }
    // An estimate that no joint can have has its warning already; it predicts nothing.
    let prediction = prediction(structure, estimate.as_ref(), &measured, &used).unwrap_or_default();
    warnings.extend(misfit(&prediction, &measured));
    let perturbation = structure
        .regression
        .and_then(|model| perturbation(model, &structure.beam, modes, (&used, settings)));
    (
        Identification {
            estimate,
            reason,
            prediction,
            perturbation,
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

fn estimate(structure: &TestedStructure, used: &[MeasuredMode]) -> Result<Estimate, IdentifyError> {
    match structure.regression {
        Some(model) => estimate_joint(model, &structure.beam, used)
            .map(|joint| Estimate::Joint(Box::new(joint))),
        None => estimate_modulus(structure.theory, &structure.beam, used).map(Estimate::FreeBeam),
    }
}

/// Frequencies of the estimated joint (known stiffnesses in their place) beside the measured ones;
/// of a free beam with the estimated modulus.
fn prediction(
    structure: &TestedStructure,
    estimate: Option<&Estimate>,
    measured: &[MeasuredMode],
    used: &[MeasuredMode],
) -> Result<Vec<PredictedMode>, IdentifyError> {
    let (beam, joint) = match estimate {
        Some(Estimate::FreeBeam(found)) => {
            let beam = Beam {
                modulus: found.modulus.value,
                ..structure.beam
            };
            (beam, Some(JointStiffness::FREE))
        }
        Some(Estimate::Joint(found)) => (structure.beam, structure.known.over(found.pairs.joint())),
        None => (structure.beam, structure.known.over(None)),
    };
    let Some(joint) = joint else {
        return Ok(Vec::new());
    };
    let numbers: Vec<usize> = match estimate {
        Some(_) => used.iter().map(|mode| mode.mode).collect(),
        None => Vec::new(),
    };
    let count = measured.iter().map(|mode| mode.mode).max().unwrap_or(0) + 1;
    predict(
        structure.theory,
        &beam,
        (structure.assembly, &joint),
        (measured, &numbers),
        count,
    )
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

fn perturbation(
    model: PairsModel,
    beam: &Beam,
    modes: &[ModeResult],
    (used, settings): (&[MeasuredMode], &IdentifySettings),
) -> Option<Perturbation> {
    let numbers: Vec<usize> = used.iter().map(|mode| mode.mode).collect();
    let frequencies: Vec<f64> = used.iter().map(|mode| mode.frequency).collect();
    let estimator = pairs_estimator(model, beam, &numbers).ok()?;
    let nominal = estimator(&frequencies)?;
    let uniform = perturb_uniformly(&frequencies, &settings.percents, &estimator);
    let bounds: Option<Vec<f64>> = numbers
        .iter()
        .map(|number| {
            modes
                .iter()
                .find(|mode| mode.mode == Some(*number))?
                .half_line
        })
        .collect();
    let bounds = bounds.map(|bounds| BoundPerturbation {
        spans: sign_pattern_spans(&frequencies, &bounds, &estimator).ok(),
        cloud: if numbers.len() <= SIGN_PATTERN_MODES {
            sign_patterns(&frequencies, &bounds)
                .filter_map(|f| estimator(&f))
                .collect()
        } else {
            Vec::new()
        },
        sensitivities: mode_sensitivities(&frequencies, &bounds, &estimator).unwrap_or_default(),
        modes: numbers.clone(),
        bounds,
    });
    let stds: Option<Vec<f64>> = used.iter().map(|mode| mode.std).collect();
    let random = settings
        .monte_carlo
        .zip(stds)
        .and_then(|(repetitions, stds)| {
            monte_carlo(&frequencies, &stds, repetitions, &estimator).ok()
        });
    Some(Perturbation {
        averages: average_errors(&nominal, &uniform),
        uniform,
        bounds,
        random,
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
