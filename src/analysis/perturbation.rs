//! How errors in the frequencies move an estimate, by either method.

use super::analysis::{BoundPerturbation, ModeResult, Perturbation};
use super::identification::{EstimateMethod, IdentifySettings};
use super::model::TestedStructure;
use tapjoint_beam::Beam;
use tapjoint_identify::consistent::ConsistentEstimator;
use tapjoint_identify::perturbation::{
    average_errors, mode_sensitivities, perturb_uniformly, sign_pattern_estimates, spans_of,
};
use tapjoint_identify::{
    MeasuredMode, MonteCarlo, PairsModel, Stiffnesses, monte_carlo, pairs_estimator,
};

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
