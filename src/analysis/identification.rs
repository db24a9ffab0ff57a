//! From modes to joint: estimate, prediction, perturbation, and doubts about them.

use super::analysis::{
    Analysis, BoundPerturbation, Estimate, EstimateMethod, Identification, ModeResult, Perturbation,
};
use super::between_recordings::scatter;
use super::doubts;
use super::structure::{StructureDetails, TestedStructure, estimator, predicted_specimen};
use super::warning::Warning;
use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_beam::Beam;
use tapjoint_beam::specimen::{Body, Mesh, Specimen};
use tapjoint_identify::consistent::{ConsistentEstimate, ConsistentEstimator};
use tapjoint_identify::perturbation::{
    average_errors, mode_sensitivities, perturb_uniformly, sign_pattern_estimates, spans_of,
};
use tapjoint_identify::{
    Doubt, FREQUENCY_FLOOR, IdentifyError, MeasuredMode, MonteCarlo, PairsModel, PredictedMode,
    Stiffnesses, estimate_joint, estimate_modulus, monte_carlo, pairs_estimator, predict,
};

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
    let estimator = estimator(structure, details, used)?;
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
        super::structure::predict(structure, details, held, beside, count)?
    } else {
        let (theory, assembly) = (structure.theory, structure.assembly);
        predict(theory, &beam, assembly, &joint, measured, &numbers, count)?
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

/// Points along the beam: enough for five half waves between two of them to look smooth.
const SHAPE_POINTS: usize = 121;

/// The shape of one mode.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SampledShape {
    /// The model's number.
    pub mode: usize,
    /// Frequency of this shape (Hz).
    pub frequency: f64,
    /// Positions (m) from the joint; of a lap joint or a free beam from the left end. The place of a lap
    /// joint stands twice, for either half's end.
    pub positions: Vec<f64>,
    /// Displacement relative to the largest (1), positive at the last position.
    pub displacements: Vec<f64>,
}

/// Shapes of the predicted modes: of the structure that the prediction is of, shear, masses of sensors
/// and a lap joint's two halves included. Empty where nothing could be predicted.
pub fn sampled_shapes(analysis: &Analysis) -> Vec<SampledShape> {
    let Some(found) = &analysis.identification else {
        return Vec::new();
    };
    let Some(specimen) = &found.predicted else {
        return Vec::new();
    };
    // A joint that no beam can stand on has no shapes; the warnings say so.
    let Ok(modes) = specimen.modes(found.prediction.len(), Mesh::DIAGNOSIS) else {
        return Vec::new();
    };
    let positions = positions(&specimen.body);
    let shape = |mode: usize| {
        let raw = positions.iter().map(|(_, x)| modes.displacement(mode, *x));
        let raw: Vec<f64> = raw.collect();
        // A free end is no node, so that its sign fixes that of the shape.
        let sign = raw.last().map_or(1.0, |tip| 1f64.copysign(*tip));
        let largest = raw.iter().fold(0.0f64, |most, value| most.max(value.abs())) * sign;
        SampledShape {
            mode: mode + 1,
            frequency: modes.frequencies()[mode],
            positions: positions.iter().map(|(x, _)| *x).collect(),
            displacements: raw.iter().map(|value| value / largest).collect(),
        }
    };
    (0..modes.len()).map(shape).collect()
}

/// Places along all beams (m), and where the model is asked for each: a hair inside the beam that is
/// meant, since two beams meet at a lap joint.
fn positions(body: &Body) -> Vec<(f64, f64)> {
    let beams = body.beams();
    let points = SHAPE_POINTS.div_ceil(beams.len());
    let hair = 1e-9 * body.length();
    let mut start = 0.0;
    let mut all = Vec::new();
    for beam in beams {
        let end = start + beam.length;
        let share = |point: usize| point as f64 / (points - 1) as f64;
        let places = (0..points).map(|point| start + share(point) * beam.length);
        all.extend(places.map(|x| (x, x.clamp(start + hair, end - hair))));
        start = end;
    }
    all
}

/// Perturbs what is asked for and can be: first the pair regression, then the consistent estimate.
/// Neither a free beam nor a joint of which no spring is estimated has anything to perturb.
pub(super) fn perturbations(
    structure: &TestedStructure,
    consistent: Option<&ConsistentEstimator>,
    (modes, used): (&[ModeResult], &[MeasuredMode]),
    settings: &IdentifySettings,
) -> Vec<Perturbation> {
    let frequencies = Frequencies::new(modes, used);
    let asked = |method: EstimateMethod| settings.perturbed.contains(&method);
    let pairs = structure
        .regression
        .filter(|_| asked(EstimateMethod::Pairs))
        .and_then(|model| of_pairs(model, &structure.beam, &frequencies, settings));
    let consistent = consistent
        .filter(|_| asked(EstimateMethod::Consistent))
        .and_then(|estimator| of_consistent(estimator, &frequencies, settings));
    pairs.into_iter().chain(consistent).collect()
}

/// The frequencies that enter the estimate, with what is known of their errors.
struct Frequencies {
    numbers: Vec<usize>,
    values: Vec<f64>,
    /// Half lines (Hz), where every mode has one.
    bounds: Option<Vec<f64>>,
    /// Standard uncertainties (Hz), where every mode has one.
    stds: Option<Vec<f64>>,
}

impl Frequencies {
    fn new(modes: &[ModeResult], used: &[MeasuredMode]) -> Self {
        let half_line = |measured: &MeasuredMode| {
            let listed = modes.iter().find(|mode| mode.mode == Some(measured.mode));
            listed?.half_line
        };
        Self {
            numbers: used.iter().map(|mode| mode.mode).collect(),
            values: used.iter().map(|mode| mode.frequency).collect(),
            bounds: used.iter().map(half_line).collect(),
            stds: used.iter().map(|mode| mode.std).collect(),
        }
    }
}

fn of_pairs(
    model: PairsModel,
    beam: &Beam,
    frequencies: &Frequencies,
    settings: &IdentifySettings,
) -> Option<Perturbation> {
    let estimator = pairs_estimator(model, beam, &frequencies.numbers).ok()?;
    let random = settings.monte_carlo.zip(frequencies.stds.as_deref());
    let random = random.and_then(|(repetitions, stds)| {
        monte_carlo(
            &frequencies.values,
            stds,
            repetitions.0,
            repetitions.1,
            &estimator,
        )
        .ok()
    });
    perturbation(
        (EstimateMethod::Pairs, random),
        frequencies,
        settings,
        estimator,
    )
}

fn of_consistent(
    estimator: &ConsistentEstimator,
    frequencies: &Frequencies,
    settings: &IdentifySettings,
) -> Option<Perturbation> {
    if !estimator.estimates_a_spring() {
        return None;
    }
    let near = estimator.neighbourhood();
    // Without the uncertainties of all modes there is nothing to draw from.
    let random = settings.monte_carlo.and_then(|(samples, seed)| {
        let found = estimator.monte_carlo_near(&near, samples, seed).ok()?;
        Some(found.joint)
    });
    perturbation(
        (EstimateMethod::Consistent, random),
        frequencies,
        settings,
        estimator.stiffnesses_near(&near),
    )
}

fn perturbation(
    (method, random): (EstimateMethod, Option<MonteCarlo>),
    frequencies: &Frequencies,
    settings: &IdentifySettings,
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses> + Sync,
) -> Option<Perturbation> {
    let nominal = estimator(&frequencies.values)?;
    let uniform = perturb_uniformly(&frequencies.values, &settings.percents, &estimator);
    let bounds = frequencies.bounds.as_deref();
    Some(Perturbation {
        method,
        averages: average_errors(&nominal, &uniform),
        uniform,
        bounds: bounds.map(|bounds| of_bounds((nominal, bounds), frequencies, &estimator)),
        random,
    })
}

/// The estimate under each mode's own bound.
fn of_bounds(
    (nominal, bounds): (Stiffnesses, &[f64]),
    frequencies: &Frequencies,
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses> + Sync,
) -> BoundPerturbation {
    let patterns = sign_pattern_estimates(&frequencies.values, bounds, &estimator).ok();
    let sensitivities = mode_sensitivities(&frequencies.values, bounds, &estimator);
    BoundPerturbation {
        modes: frequencies.numbers.clone(),
        bounds: bounds.to_vec(),
        spans: patterns
            .as_ref()
            .map(|found| spans_of(Some(nominal), found)),
        cloud: patterns.into_iter().flatten().flatten().collect(),
        sensitivities: sensitivities.unwrap_or_default(),
    }
}
