//! From modes to joint: estimate, prediction, perturbation, and doubts about them.

use super::Analysis;
use super::free_test::FreeTest;
use super::results::{
    AverageSection, CommonScaleSection, Estimate, EstimateMethod, Identification, LeftOutMode,
    ModeResult, MonteCarloSection, MovedLength, PerturbationSection, Perturbations,
    ResolutionSpanSection, SensitivitySection, measured_modes, scatter_of, set_ups,
};
use super::stages::{Stage, Watch, Work};
use super::structure::{
    StructureDetails, TestedStructure, estimator_of_lengths, fitted, frequencies_of, jointed,
    predicted_specimen,
};
use super::warnings::{Warning, of_estimate, of_prediction};
use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_beam::specimen::{Body, Mesh, Specimen};
use tapjoint_identify::consistent::{
    ConsistentEstimate, ConsistentEstimator, LeftOutAnswer, MovedClamp, PointFit,
};
use tapjoint_identify::perturbation::{
    ReadingError, SIGN_PATTERN_MODES, average_errors, common_sensitivity, mode_sensitivities,
    perturb_uniformly, sign_pattern_estimates, spans_of,
};
use tapjoint_identify::{
    FREQUENCY_FLOOR, IdentifyError, MeasuredMode, MonteCarlo, PredictedMode, Spread, Stiffnesses,
    Uncertain, compare, estimate_joint, estimate_modulus, monte_carlo, pairs_estimator, predict,
};

/// Settings of the identification.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifySettings {
    /// Method of the main estimate: the consistent one, because it satisfies its own frequency
    /// equation.
    pub method: EstimateMethod,
    /// Details of the structure beyond beam and joint; none.
    pub details: StructureDetails,
    /// The beam at its other free lengths: its modes enter the main estimate; none.
    pub lengths: Vec<MovedLength>,
    /// The test of the same bar without its joint: its modes enter the main estimate; none.
    pub free_test: Option<FreeTest>,
    /// The first so many modes of each length enter; `None` = all.
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
            lengths: Vec::new(),
            free_test: None,
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

/// Estimates the joint from numbered modes, predicts with it and perturbs it.
pub fn identify(
    structure: &TestedStructure,
    modes: &[ModeResult],
    settings: &IdentifySettings,
) -> (Identification, Vec<Warning>) {
    identify_watched(structure, modes, settings, &())
}

/// Identifies as [`identify`] does, and announces the stages.
pub(super) fn identify_watched(
    structure: &TestedStructure,
    modes: &[ModeResult],
    settings: &IdentifySettings,
    watch: &dyn Watch,
) -> (Identification, Vec<Warning>) {
    let mut work = Work::begin(watch, Stage::Joint);
    // One scatter for all lengths: the least repeated one must not weigh most.
    let of_lengths = settings.lengths.iter().flat_map(|length| &length.modes);
    let scatter = scatter_of(modes.iter().chain(of_lengths));
    let floor = settings.frequency_floor;
    let mut measured = measured_modes(modes, scatter, floor);
    let fit_modes = settings.fit_modes.unwrap_or(usize::MAX);
    let is_consistent = settings.method == EstimateMethod::Consistent;
    let set_ups = match is_consistent {
        true => fitted_set_ups(structure, modes, settings, None),
        false => Vec::new(),
    };
    if !set_ups.is_empty() {
        // The joint between the set-ups: each mode's best reading may be of another one.
        let numbered = modes.iter().filter(|mode| mode.mode.is_some());
        for (own, mode) in measured.iter_mut().zip(numbered) {
            own.frequency = mode.mean_of_repeats().unwrap_or(own.frequency);
        }
    }
    let mut used: Vec<MeasuredMode> = measured.iter().copied().take(fit_modes).collect();
    let mut moved = Vec::with_capacity(settings.lengths.len());
    for length in &settings.lengths {
        let mut own = measured_modes(&length.modes, scatter, floor);
        own.truncate(fit_modes);
        moved.push(MovedClamp {
            structure: length.structure.clone(),
            modes: own,
            attachments: length.attachments.clone(),
        });
    }
    let (mut estimator, mut consistent, mut refused) = (None, None, None);
    let (mut from_readings, mut without, mut better_numbers) = (None, None, None);
    if is_consistent {
        let details = &settings.details;
        match settled(structure, details, &used, &moved, &set_ups) {
            Ok((all, estimate)) => {
                better_numbers = better_numbering(structure, details, &used, &moved, &estimate);
                let answers = left_out_answers(structure, modes, settings, &all);
                (without, consistent) = joined(answers, estimate);
                estimator = Some(all);
            }
            Err(error) => refused = Some(error.to_string()),
        }
        if let Some(LeftOutMode { found, .. }) = &without {
            used.retain(|mode| mode.mode != found.mode);
            estimator = estimator.map(|all| all.without(found.mode).settled());
        }
        let exact = estimator_of_lengths(structure, &details.exact(), &used, &moved);
        let exact = exact.and_then(|exact| exact.estimate());
        // Its errors are those of the estimate itself.
        let exact = exact
            .ok()
            .filter(|exact| exact.goodness.chi_squared.is_some());
        from_readings = exact.map(Box::new);
    }
    let closed = match structure.regression {
        Some(model) => estimate_joint(model, &structure.beam, &used)
            .map(|joint| Estimate::Joint(Box::new(joint))),
        None => estimate_modulus(structure.theory, &structure.beam, &used)
            .map(|found| Estimate::FreeBeam(Box::new(found))),
    };
    let (estimate, missing) = match closed {
        Ok(found) => (Some(found), None),
        Err(error) => (None, Some(error.to_string())),
    };
    let reason = match (&consistent, &estimate) {
        (Some(_), _) => None,
        (None, Some(_)) => refused,
        (None, None) => refused.or(missing),
    };
    let is_alone = without.as_ref().is_some_and(|one| one.answers.len() == 1);
    let (left_out, one_of_several) = match is_alone {
        true => (without, None),
        false => (None, without),
    };
    if !settings.perturbed.is_empty() {
        work.go_on(Stage::Perturbation);
    }
    let perturbations = perturbations(structure, estimator.as_ref(), modes, &used, settings);
    work.go_on(Stage::Joint);
    let mut found = Identification {
        assumed: assumed(consistent.as_deref(), &settings.details),
        consistent,
        left_out,
        one_of_several,
        better_numbers,
        from_readings,
        estimate,
        reason,
        prediction: Vec::new(),
        predicted: None,
        perturbations,
    };
    let mut warnings = of_estimate(structure, &found, modes);
    // An estimate that no joint can have has its warning already; it predicts nothing.
    match prediction(structure, &found, &measured, &used, settings) {
        Ok(Some((prediction, predicted))) => {
            found.prediction = prediction;
            found.predicted = Some(predicted);
        }
        Ok(None) => {}
        Err(error) if found.consistent.is_some() => warnings.push(Warning::no_prediction(&error)),
        Err(_) => {}
    }
    warnings.extend(of_prediction(&found.prediction, &measured));
    (found, warnings)
}

/// Returns the standard uncertainties that the description does not state and the estimate has used, in words.
fn assumed(estimate: Option<&ConsistentEstimate>, details: &StructureDetails) -> String {
    let moved = estimate.map_or(&[][..], |estimate| &estimate.description);
    let is_used = |name: &str| {
        moved.iter().any(|pull| {
            let input = pull.input.name();
            match name {
                "masses" => input.starts_with("mass of "),
                "positions" => input.starts_with("position of "),
                _ => input == name,
            }
        })
    };
    let used = details.assumed.iter().filter(|(name, _)| is_used(name));
    let words: Vec<String> = used.map(|(name, std)| format!("{name} {std}")).collect();
    words.join(", ")
}

/// Returns the estimator that knows what is uncertain beside the readings, and its estimate.
fn settled(
    structure: &TestedStructure,
    details: &StructureDetails,
    used: &[MeasuredMode],
    moved: &[MovedClamp],
    set_ups: &[PointFit],
) -> Result<(ConsistentEstimator, ConsistentEstimate), IdentifyError> {
    let estimator = estimator_of_lengths(structure, details, used, moved)?.settled();
    let estimate = estimator.estimate_with_set_ups(set_ups)?;
    Ok((estimator, estimate))
}

/// Returns the estimates without each of the modes that may not belong to the others, the most probable first; none where all
/// belong together. `all` is the estimator of all modes.
fn left_out_answers(
    structure: &TestedStructure,
    modes: &[ModeResult],
    settings: &IdentifySettings,
    all: &ConsistentEstimator,
) -> Vec<LeftOutAnswer> {
    let outlying = all.outlying_modes().into_iter();
    let answers = outlying.map(|mode| {
        let set_ups = fitted_set_ups(structure, modes, settings, Some(mode.mode));
        let rest = all.without(mode.mode).settled();
        Some(LeftOutAnswer {
            mode,
            estimate: rest.estimate_with_set_ups(&set_ups).ok()?,
        })
    });
    // Without the answer of one candidate no limits hold all.
    answers.collect::<Option<_>>().unwrap_or_default()
}

/// Returns the main estimate, and what is left out of it. `with_all` is the estimate from all modes.
fn joined(
    answers: Vec<LeftOutAnswer>,
    with_all: ConsistentEstimate,
) -> (Option<LeftOutMode>, Option<Box<ConsistentEstimate>>) {
    let (Some(estimate), Some(first)) = (LeftOutAnswer::joined(&answers), answers.first()) else {
        return (None, Some(Box::new(with_all)));
    };
    let left_out = LeftOutMode {
        found: first.mode,
        answers,
        with_all: Box::new(with_all),
    };
    (Some(left_out), Some(Box::new(estimate)))
}

/// Returns other numbers of the modes under which the model explains them, where it fails as they are numbered: one mode was
/// missed, or one peak is none. `None` where no such numbering explains them, or several do.
fn better_numbering(
    structure: &TestedStructure,
    details: &StructureDetails,
    used: &[MeasuredMode],
    moved: &[MovedClamp],
    estimate: &ConsistentEstimate,
) -> Option<Vec<usize>> {
    // A model that fails, one that explains, and how much less probable the next numbering has to be.
    const FAILS: f64 = 1e-3;
    const EXPLAINS: f64 = 0.05;
    const SECOND: f64 = 0.01;
    let fitted = estimate.fit.len();
    let is_tested = estimate.goodness.probability? < FAILS && used.len() >= fitted + 2;
    let mut found: Vec<(f64, Vec<usize>)> = Vec::new();
    let own: Vec<usize> = used.iter().map(|mode| mode.mode).collect();
    let quick_misfit = |modes: &[MeasuredMode]| {
        let estimator = estimator_of_lengths(structure, details, modes, moved);
        estimator.map_or(f64::INFINITY, |estimator| estimator.quick_misfit())
    };
    let own_misfit = if is_tested { quick_misfit(used) } else { 0.0 };
    for from in (0..own.len()).filter(|_| is_tested) {
        for up in [true, false] {
            let mut numbers = own.clone();
            for number in &mut numbers[from..] {
                *number = if up { *number + 1 } else { *number - 1 };
            }
            let lowest = if from > 0 { numbers[from - 1] + 1 } else { 1 };
            if numbers[from] < lowest {
                continue;
            }
            let modes = used.iter().zip(&numbers);
            let modes: Vec<MeasuredMode> = modes
                .map(|(mode, &number)| MeasuredMode {
                    mode: number,
                    ..*mode
                })
                .collect();
            // A numbering whose quick fit is no better is left out. The full fit takes ten times as long.
            if quick_misfit(&modes) >= own_misfit {
                continue;
            }
            let other = settled(structure, details, &modes, moved, &[]);
            let probability = other.ok().and_then(|(_, other)| other.goodness.probability);
            found.extend(probability.map(|probability| (probability, numbers)));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (best, numbers) = found.first()?;
    let second = found.get(1).map_or(0.0, |(probability, _)| *probability);
    (*best > EXPLAINS && second < SECOND * best).then(|| numbers.clone())
}

/// Fits each set-up alone, by the modes of the described length that all set-ups have. `left_out` is the mode to omit.
/// The description counts as exact: what is wrong in all set-ups moves their joints alike. Empty where fewer than two
/// differing set-ups can be fitted.
fn fitted_set_ups(
    structure: &TestedStructure,
    modes: &[ModeResult],
    settings: &IdentifySettings,
    left_out: Option<usize>,
) -> Vec<PointFit> {
    let numbers = modes.iter().filter_map(|mode| mode.mode);
    let mut numbers: Vec<usize> = numbers
        .take(settings.fit_modes.unwrap_or(usize::MAX))
        .collect();
    numbers.retain(|number| Some(*number) != left_out);
    let unknowns = fitted(structure, &settings.details).len();
    let mut all = set_ups(modes, settings.frequency_floor);
    // Errors that all set-ups share cancel only where all are fitted to the same modes.
    let is_in_all = |number: &usize| {
        let mut all = all.iter();
        all.all(|own| own.iter().any(|mode| mode.mode == *number))
    };
    let shared: Vec<usize> = numbers.iter().copied().filter(is_in_all).collect();
    if shared.len() >= unknowns {
        numbers = shared;
    }
    for own in &mut all {
        own.retain(|mode| numbers.contains(&mode.mode));
    }
    all.retain(|own| own.len() >= unknowns);
    let exact = settings.details.exact();
    let estimators = all
        .iter()
        .filter_map(|own| estimator_of_lengths(structure, &exact, own, &[]).ok());
    let fits = estimators.map(|estimator| estimator.fit());
    let fits: Vec<PointFit> = fits.filter(|fit| fit.misfit.is_finite()).collect();
    if fits.len() < 2 { Vec::new() } else { fits }
}

/// Frequencies of the estimated beam and joint beside the measured ones, and the structure that has them;
/// `None` where no joint is known.
fn prediction(
    structure: &TestedStructure,
    found: &Identification,
    measured: &[MeasuredMode],
    used: &[MeasuredMode],
    settings: &IdentifySettings,
) -> Result<Option<(Vec<PredictedMode>, Specimen)>, IdentifyError> {
    let Some((beam, joint)) = found.beam_and_joint(structure) else {
        return Ok(None);
    };
    let used = if found.is_answered() { used } else { &[] };
    let numbers: Vec<usize> = used.iter().map(|mode| mode.mode).collect();
    let count = measured.iter().map(|mode| mode.mode).max().unwrap_or(0) + 1;
    let detailed = found.method(structure, settings.method) == EstimateMethod::Consistent;
    let plain = StructureDetails::default();
    let details = if detailed { &settings.details } else { &plain };
    let rows = if detailed {
        let there = jointed(structure, details).with_beam(&beam);
        let frequencies = frequencies_of(&there, &joint, count)?;
        compare(&beam, &frequencies, measured, &numbers)
    } else {
        let (theory, assembly) = (structure.theory, structure.assembly);
        predict(theory, &beam, assembly, &joint, measured, &numbers, count)?
    };
    let specimen = predicted_specimen(structure, details, &beam, &joint);
    Ok(Some((rows, specimen)))
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

impl SampledShape {
    /// Displacement at a place (m), between the points next to it; beyond the ends that of the end.
    pub fn at(&self, place: f64) -> f64 {
        let after = self.positions.partition_point(|x| *x < place);
        let points = self.positions.iter().zip(&self.displacements);
        let mut near = points.skip(after.saturating_sub(1));
        match (near.next(), near.next()) {
            (Some((x0, y0)), Some((x1, y1))) if after > 0 && x1 > x0 => {
                y0 + (y1 - y0) * (place - x0) / (x1 - x0)
            }
            (Some(_), Some((_, y))) if after > 0 => *y,
            (Some((_, y)), _) => *y,
            (None, _) => 0.0,
        }
    }
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
    let mut shapes = Vec::with_capacity(modes.len());
    for (mode, &frequency) in modes.frequencies().iter().enumerate() {
        let raw = positions
            .iter()
            .map(|(_, x)| modes.middle_displacement(mode, *x));
        let raw: Vec<f64> = raw.collect();
        // A free end is no node, so that its sign fixes that of the shape.
        let sign = raw.last().map_or(1.0, |tip| 1f64.copysign(*tip));
        let largest = raw.iter().fold(0.0f64, |most, value| most.max(value.abs())) * sign;
        shapes.push(SampledShape {
            mode: mode + 1,
            frequency,
            positions: positions.iter().map(|(x, _)| *x).collect(),
            displacements: raw.iter().map(|value| value / largest).collect(),
        });
    }
    shapes
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
        for point in 0..points {
            let x = start + point as f64 / (points - 1) as f64 * beam.length;
            all.push((x, x.clamp(start + hair, end - hair)));
        }
        start = end;
    }
    all
}

/// Perturbs what is asked for and can be. Neither a free beam nor a joint of which no spring is estimated has
/// anything to perturb.
pub(super) fn perturbations(
    structure: &TestedStructure,
    consistent: Option<&ConsistentEstimator>,
    modes: &[ModeResult],
    used: &[MeasuredMode],
    settings: &IdentifySettings,
) -> Perturbations {
    // Without a Monte Carlo nobody has given a seed.
    let seed = settings.monte_carlo.map_or(1, |(_, seed)| seed);
    let frequencies = Frequencies::new(modes, used, seed);
    let percents = &settings.percents;
    let mut found = Perturbations::default();
    if let Some(model) = structure.regression
        && settings.perturbed.contains(&EstimateMethod::Pairs)
        && let Ok(estimator) = pairs_estimator(model, &structure.beam, &frequencies.numbers)
    {
        let random = settings.monte_carlo.zip(frequencies.errors.as_deref());
        let random = random.and_then(|((samples, seed), errors)| {
            monte_carlo(&frequencies.values, errors, samples, seed, &estimator).ok()
        });
        add(
            &mut found,
            EstimateMethod::Pairs,
            random,
            &frequencies,
            percents,
            &estimator,
        );
        let of_scale = common_scale(&frequencies.values, settings, &estimator);
        set_common_scale(&mut found, EstimateMethod::Pairs, of_scale);
    }
    if let Some(estimator) = consistent
        && settings.perturbed.contains(&EstimateMethod::Consistent)
        && estimator.estimates_a_spring()
    {
        let near = estimator.neighbourhood();
        // Without the uncertainties of all modes there is nothing to draw from.
        let half_widths = half_widths(&frequencies.half_widths, settings);
        let random = settings.monte_carlo.and_then(|(samples, seed)| {
            let repeated = estimator.monte_carlo(&near, &half_widths, samples, seed);
            repeated.ok()
        });
        // The frequencies of other free lengths stay as they are.
        let all = estimator.frequencies();
        let of_lengths = all.get(used.len()..).unwrap_or_default();
        let stiffnesses = estimator.stiffnesses_near(&near);
        add(
            &mut found,
            EstimateMethod::Consistent,
            random,
            &frequencies,
            percents,
            |frequencies: &[f64]| stiffnesses(&[frequencies, of_lengths].concat()),
        );
        // The bar is the same at all lengths, and without its joint.
        let of_scale = common_scale(&all, settings, &stiffnesses);
        set_common_scale(&mut found, EstimateMethod::Consistent, of_scale);
    }
    found
}

/// Returns the effect of the description's uncertain frequency scale on an estimate; `None` of an exact description.
fn common_scale(
    frequencies: &[f64],
    settings: &IdentifySettings,
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses>,
) -> Option<CommonScaleSection> {
    let scale_percent = 100.0 * settings.details.scale_std()?;
    let found = common_sensitivity(frequencies, scale_percent, estimator);
    let (change, slope) = (found.percent_per_bound, found.percent_per_percent);
    Some(CommonScaleSection {
        scale_percent,
        kx_percent: change.and_then(|change| finite(change.kx)),
        ky_percent: change.and_then(|change| finite(change.ky)),
        kz_percent: change.and_then(|change| finite(change.kz?)),
        kx_percent_per_percent: slope.and_then(|slope| finite(slope.kx)),
        ky_percent_per_percent: slope.and_then(|slope| finite(slope.ky)),
        kz_percent_per_percent: slope.and_then(|slope| finite(slope.kz?)),
    })
}

/// Puts the effect of the frequency scale beside those of the modes, where there are any.
fn set_common_scale(
    found: &mut Perturbations,
    method: EstimateMethod,
    of_scale: Option<CommonScaleSection>,
) {
    let mut spans = found.spans.iter_mut();
    if let Some(span) = spans.find(|span| span.method == method) {
        span.common_scale = of_scale;
    }
}

/// Returns the half widths (Hz) of the uniform errors of all frequencies of the estimate: those of the described length, then
/// those of other lengths, then those of the free bar.
fn half_widths(of_described: &[f64], settings: &IdentifySettings) -> Vec<f64> {
    let mut all = of_described.to_vec();
    for length in &settings.lengths {
        let numbered = length.modes.iter().filter(|mode| mode.mode.is_some());
        let numbered = numbered.take(settings.fit_modes.unwrap_or(usize::MAX));
        all.extend(numbered.map(ModeResult::half_width));
    }
    if let Some(free) = &settings.free_test {
        let used = free.bar.modes.iter().map(|used| {
            let mut modes = free.modes.iter();
            let found = modes.find(|mode| mode.mode == Some(used.mode));
            found.map_or(0.0, ModeResult::half_width)
        });
        all.extend(used);
    }
    all
}

/// Adds the perturbations of one method, if it has an estimate.
fn add(
    found: &mut Perturbations,
    method: EstimateMethod,
    random: Option<MonteCarlo>,
    frequencies: &Frequencies,
    percents: &[f64],
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses> + Sync,
) {
    let Some(nominal) = estimator(&frequencies.values) else {
        return;
    };
    let uniform = perturb_uniformly(&frequencies.values, percents, &estimator);
    let averages = average_errors(&nominal, &uniform).into_iter();
    found.averages.extend(averages.map(|row| AverageSection {
        method,
        percent: row.percent,
        kx_percent: finite(row.mean_magnitude.kx),
        ky_percent: finite(row.mean_magnitude.ky),
        kz_percent: row.mean_magnitude.kz.and_then(finite),
        kx_of_mean_percent: finite(row.of_mean.kx),
        ky_of_mean_percent: finite(row.of_mean.ky),
        kz_of_mean_percent: row.of_mean.kz.and_then(finite),
    }));
    found
        .uniform
        .extend(uniform.into_iter().map(|row| PerturbationSection {
            percent: row.percent,
            method,
            kx: row.estimate.map(|estimate| estimate.kx),
            ky: row.estimate.map(|estimate| estimate.ky),
            kz: row.estimate.and_then(|estimate| estimate.kz),
        }));
    found.random.extend(random.map(|random| MonteCarloSection {
        method,
        samples: random.samples,
        failed: random.failed,
        kx: random.kx.map(interval),
        ky: random.ky.map(interval),
        kz: random.kz.map(interval),
        cloud: cloud(&random.cloud),
    }));
    if let Some(bounds) = &frequencies.bounds {
        let section = under_bounds(method, nominal, frequencies, bounds, estimator);
        found.spans.push(section);
    }
}

/// The frequencies that enter the estimate, with what is known of their errors.
struct Frequencies {
    numbers: Vec<usize>,
    values: Vec<f64>,
    /// Half lines (Hz), where every mode has one.
    bounds: Option<Vec<f64>>,
    /// Half widths (Hz) of the uniform parts of their errors.
    half_widths: Vec<f64>,
    /// Random errors, where every mode has a standard uncertainty.
    errors: Option<Vec<ReadingError>>,
    /// Seed of the sign patterns, where these are drawn.
    seed: u64,
}

impl Frequencies {
    fn new(modes: &[ModeResult], used: &[MeasuredMode], seed: u64) -> Self {
        let listed: Vec<Option<&ModeResult>> = used
            .iter()
            .map(|measured| {
                let mut modes = modes.iter();
                modes.find(|mode| mode.mode == Some(measured.mode))
            })
            .collect();
        let half_widths = listed.iter();
        let half_widths = half_widths.map(|mode| mode.map_or(0.0, ModeResult::half_width));
        let half_widths: Vec<f64> = half_widths.collect();
        let errors = used.iter().zip(&half_widths);
        let errors = errors.map(|(mode, width)| Some(ReadingError::new(mode.std?, *width)));
        Self {
            numbers: used.iter().map(|mode| mode.mode).collect(),
            values: used.iter().map(|mode| mode.frequency).collect(),
            bounds: listed.iter().map(|mode| (*mode)?.half_line).collect(),
            errors: errors.collect(),
            half_widths,
            seed,
        }
    }
}

/// The estimate under each mode's own bound (Hz).
fn under_bounds(
    method: EstimateMethod,
    nominal: Stiffnesses,
    frequencies: &Frequencies,
    bounds: &[f64],
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses> + Sync,
) -> ResolutionSpanSection {
    let sensitivities = mode_sensitivities(&frequencies.values, bounds, &estimator);
    let sensitivities = sensitivities.unwrap_or_default().into_iter();
    let sensitivities = sensitivities.map(|row| {
        let (change, slope) = (row.percent_per_bound, row.percent_per_percent);
        SensitivitySection {
            mode: frequencies.numbers[row.index],
            half_line: bounds[row.index],
            kx_percent: change.map(|change| change.kx),
            ky_percent: change.map(|change| change.ky),
            kz_percent: change.and_then(|change| change.kz),
            kx_percent_per_percent: slope.map(|slope| slope.kx),
            ky_percent_per_percent: slope.map(|slope| slope.ky),
            kz_percent_per_percent: slope.and_then(|slope| slope.kz),
        }
    });
    let section = ResolutionSpanSection {
        method,
        sensitivity: sensitivities.collect(),
        ..ResolutionSpanSection::default()
    };
    let patterns =
        sign_pattern_estimates(&frequencies.values, bounds, frequencies.seed, &estimator);
    let Ok(patterns) = patterns else {
        return section;
    };
    let spans = spans_of(Some(nominal), &patterns);
    let found: Vec<Stiffnesses> = patterns.into_iter().flatten().collect();
    ResolutionSpanSection {
        patterns: spans.patterns,
        sampled: frequencies.values.len() > SIGN_PATTERN_MODES,
        failed: spans.failed,
        kx: spans.kx.map(|span| [span.low, span.high]),
        ky: spans.ky.map(|span| [span.low, span.high]),
        kz: spans.kz.map(|span| [span.low, span.high]),
        cloud: cloud(&found),
        ..section
    }
}

/// A stiffness that is rigid or held has no relative change.
fn finite(percent: f64) -> Option<f64> {
    Some(percent).filter(|percent| percent.is_finite())
}

fn interval(spread: Spread) -> Uncertain {
    Uncertain {
        value: spread.median,
        low: finite(spread.low),
        high: finite(spread.high),
        ..Uncertain::default()
    }
}

fn cloud(estimates: &[Stiffnesses]) -> Vec<[f64; 2]> {
    let estimates = estimates.iter();
    estimates
        .map(|estimate| [estimate.kx, estimate.ky])
        .collect()
}
