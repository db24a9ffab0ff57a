//! From modes to joint: estimate, prediction, perturbation, and doubts about them.

use super::analysis::{Estimate, Identification, ModeResult};
use super::between::scatter;
use super::consistent::{self, StructureDetails};
use super::doubts;
use super::model::TestedStructure;
use super::perturbation::perturbations;
use super::shapes::predicted_specimen;
use super::warning::Warning;
use serde::Serialize;
use tapjoint_beam::specimen::Specimen;
use tapjoint_identify::consistent::{ConsistentEstimate, ConsistentEstimator};
use tapjoint_identify::{
    Doubt, FREQUENCY_FLOOR, IdentifyError, MeasuredMode, PredictedMode, estimate_joint,
    estimate_modulus, predict,
};

/// Which estimate is the main one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EstimateMethod {
    /// Least squares on the frequencies themselves, the closed form beside it.
    #[default]
    Consistent,
    /// The closed form alone: the pair regression, or of a free beam its modulus.
    Pairs,
}

impl EstimateMethod {
    /// Both methods.
    pub const ALL: [Self; 2] = [Self::Consistent, Self::Pairs];

    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Consistent => "consistent",
            Self::Pairs => "pairs",
        }
    }
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
    /// Relative standard uncertainty that a frequency read from recordings has beside that of its reading (1):
    /// [`FREQUENCY_FLOOR`]. Frequencies that a description states have the uncertainty that it states.
    pub frequency_floor: f64,
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
            frequency_floor: FREQUENCY_FLOOR,
            perturbed: vec![EstimateMethod::Pairs, EstimateMethod::Consistent],
            percents: tapjoint_identify::perturbation::PAPER_PERCENTS.to_vec(),
            monte_carlo: None,
        }
    }
}

impl IdentifySettings {
    /// The defaults, but nothing is perturbed: where the estimate alone is wanted.
    pub fn unperturbed() -> Self {
        IdentifySettings {
            perturbed: Vec::new(),
            ..Self::default()
        }
    }
}

/// A misfit is worth a warning beyond this error (%): what a beam's stated dimensions usually leave
/// open in its frequencies.
const NOTABLE_MISFIT: f64 = 100.0 * tapjoint_identify::consistent::NOTABLE_MISFIT;

/// Estimates the joint from numbered modes, predicts with it and perturbs it.
pub fn identify(
    structure: &TestedStructure,
    modes: &[ModeResult],
    settings: &IdentifySettings,
) -> (Identification, Vec<Warning>) {
    let measured = measured_modes(modes, settings.frequency_floor);
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
        warnings.extend(doubts::of_consistent(found, modes));
    }
    if let Some(Estimate::Joint(joint)) = &estimate {
        let told = |doubt: &&Doubt| {
            consistent.is_none() || !matches!(doubt, Doubt::CouplingNotEstablished)
        };
        warnings.extend(joint.doubts.iter().filter(told).map(of_doubt));
    }
    let reason = match (&consistent, &estimate) {
        (Some(_), _) => None,
        (None, Some(_)) => refused,
        (None, None) => refused.or(missing),
    };
    let mut found = Identification {
        consistent,
        estimate,
        reason,
        prediction: Vec::new(),
        predicted: None,
        perturbations: perturbations(structure, estimator.as_ref(), (modes, &used), settings),
    };
    // An estimate that no joint can have has its warning already; it predicts nothing.
    match prediction(structure, &found, (&measured, &used), settings) {
        Ok((prediction, predicted)) => {
            found.prediction = prediction;
            found.predicted = predicted;
        }
        Err(error) => {
            warnings.extend(found.consistent.as_ref().map(|_| Warning::Estimate {
                code: "no-prediction",
                text: format!("the estimated joint cannot be predicted with: {error}"),
            }));
        }
    }
    warnings.extend(misfit(&found.prediction, &measured));
    (found, warnings)
}

/// The modes with a number, ascending. Modes of one list may come from recordings between which the joint
/// drifted, or the room's temperature or the mounting: no joint has them all, and how far they are apart is part
/// of each one's uncertainty. All get the same share of their frequency: weighed by its own scatter, a mode that
/// feels the joint most would count least. What no repetition shows, `floor` (1), is added to
/// every one that was read here.
pub(super) fn measured_modes(modes: &[ModeResult], floor: f64) -> Vec<MeasuredMode> {
    let scatter = scatter(modes);
    let share = |mode: &ModeResult| match mode.reading {
        Some(_) => scatter.hypot(floor),
        None => scatter,
    };
    modes
        .iter()
        .filter_map(|mode| {
            Some(MeasuredMode {
                mode: mode.mode?,
                frequency: mode.frequency,
                std: mode.std.map(|std| std.hypot(share(mode) * mode.frequency)),
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

/// Frequencies of the estimated beam and joint beside the measured ones, and the structure that has them;
/// nothing where no joint is known.
fn prediction(
    structure: &TestedStructure,
    found: &Identification,
    (measured, used): (&[MeasuredMode], &[MeasuredMode]),
    settings: &IdentifySettings,
) -> Result<(Vec<PredictedMode>, Option<Specimen>), IdentifyError> {
    let Some((beam, joint)) = found.beam_and_joint(structure) else {
        return Ok((Vec::new(), None));
    };
    let used = if found.is_answered() { used } else { &[] };
    let numbers: Vec<usize> = used.iter().map(|mode| mode.mode).collect();
    let count = measured.iter().map(|mode| mode.mode).max().unwrap_or(0) + 1;
    let beside = (measured, &numbers[..]);
    let detailed =
        settings.method == EstimateMethod::Consistent && found.predicts_with_details(structure);
    let plain = StructureDetails::default();
    let details = if detailed { &settings.details } else { &plain };
    let held = (&beam, &joint);
    let rows = if detailed {
        consistent::predict(structure, details, held, beside, count)?
    } else {
        let held = (structure.assembly, &joint);
        predict(structure.theory, &beam, held, beside, count)?
    };
    Ok((rows, Some(predicted_specimen(structure, details, held))))
}

/// The largest notable misfit of those beyond three standard deviations of their reading. A coarse
/// reading may miss by more than a sharp one and mean less.
fn misfit(prediction: &[PredictedMode], measured: &[MeasuredMode]) -> Option<Warning> {
    let notable = prediction.iter().filter_map(|mode| {
        let error_percent = mode.error_percent.filter(|e| e.abs() > NOTABLE_MISFIT)?;
        let reading = measured.iter().find(|reading| reading.mode == mode.mode)?;
        let deviations = reading
            .std
            .map(|std| (mode.predicted - reading.frequency) / std);
        let beyond = deviations.is_none_or(|deviations| deviations.abs() > 3.0);
        beyond.then_some((mode.mode, error_percent, deviations))
    });
    let worst = notable.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    worst.map(|(mode, error_percent, deviations)| Warning::Misfit {
        mode,
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
