//! Comparison of all hypotheses: the nominal model, single effects, drift, something unknown, and pairs of effects.

use crate::amplitude::set_joint_motions;
use crate::candidates::candidate_effects;
use crate::dataset::{Dataset, MORE_MODES};
use crate::effect_pairs::{add_pairs, stands};
use crate::evidence::{Fit, evaluate, log_mean, over_drifts};
use crate::fit::{Search, add_by_multi_start, fit_frequencies, fit_nominal, refit_nominal};
use crate::foreign_fits::{ForeignFit, fit_foreign};
use crate::forward::Forward;
use crate::parameters::{CandidateEffect, NuisanceParameter};
use crate::result::{Hypothesis, UnlocatedSensors};
use crate::settings::{GapError, GapSettings};
use crate::structure::Nominal;
use crate::unknown::fit_unknown;
use crate::validate::Residuals;
use crate::verdict::{Candidate, set_probabilities};
use rayon::prelude::*;
use tapjoint_beam::effects::EffectId;
use tapjoint_identify::observation::{Observations, ObservedSensor};

/// Fits of hypotheses.
#[derive(Clone)]
pub struct ModelComparison {
    /// The data.
    pub dataset: Dataset,
    /// Nominal model as described, only its joint refitted, which is the same in all set-ups: the gap is
    /// measured from it.
    pub described: Fit,
    /// Described model with a joint and a temperature that may differ between set-ups, as they may under every
    /// hypothesis: no effect is credited with what these explain of hold-out data.
    pub drifting: Fit,
    /// Drifting model with masses that may differ from the stated ones: causes along the beam are searched from it.
    pub baseline: Fit,
    /// Hypotheses, the most probable first.
    pub candidates: Vec<Candidate>,
    /// Number of positions of sensors over which the evidence is averaged; the fits are those of one of them.
    pub positions: usize,
}

/// Observations of a test, the described structure, and the settings.
#[derive(Clone, Copy)]
pub struct Test<'a> {
    /// The observations.
    pub observations: &'a Observations,
    /// The described structure.
    pub nominal: &'a Nominal,
    /// Settings of the diagnosis.
    pub settings: &'a GapSettings,
}

/// Fits the nominal model, single effects and something unknown. They have no probabilities yet.
///
/// # Errors
/// [`GapError::NoFit`] where the nominal model has no fit.
pub fn compare_without_pairs(test: Test<'_>) -> Result<ModelComparison, GapError> {
    let all = at_locations(test, compare_singles);
    // The evidence is averaged over the locations of sensors; fits and residuals are those of the location that
    // explains most.
    let mut averages: Vec<(Hypothesis, f64)> = Vec::new();
    for candidate in &all.first().ok_or(GapError::NoFit)?.candidates {
        let hypothesis = &candidate.hypothesis;
        let same = all.iter().filter_map(|one| {
            let mut candidates = one.candidates.iter();
            candidates.find(|one| one.hypothesis == *hypothesis)
        });
        let mut logs: Vec<f64> = same.map(|one| one.fit.log_evidence).collect();
        // A fit that failed has no evidence.
        logs.resize(all.len(), f64::NEG_INFINITY);
        averages.push((hypothesis.clone(), log_mean(&logs)));
    }
    let positions = all.len();
    let mut best: Option<(f64, ModelComparison)> = None;
    for one in all {
        let evidences = one.candidates.iter().map(|one| one.fit.log_evidence);
        let own = evidences.fold(f64::NEG_INFINITY, f64::max);
        if best.as_ref().is_none_or(|(most, _)| own > *most) {
            best = Some((own, one));
        }
    }
    let (_, mut comparison) = best.ok_or(GapError::NoFit)?;
    comparison.positions = positions;
    for candidate in &mut comparison.candidates {
        let average = averages.iter().find(|one| one.0 == candidate.hypothesis);
        if let Some((_, log)) = average {
            candidate.fit.log_evidence = *log;
        }
    }
    Ok(comparison)
}

impl ModelComparison {
    /// Sets the probabilities, and adds pairs of effects.
    pub fn add_pairs(&mut self) {
        let thresholds = &self.dataset.settings.thresholds;
        set_probabilities(&mut self.candidates, 0, thresholds);
        add_pairs(&self.dataset, &mut self.candidates, self.positions);
    }
}

/// Returns the observations with the described sensors where they name none: given frequencies were
/// read with all of them somewhere.
fn with_sensors(observations: &Observations, nominal: &Nominal) -> Observations {
    let mut filled = observations.clone();
    let sensors = nominal.sensors.iter().map(|sensor| ObservedSensor {
        name: sensor.name.clone(),
        position: sensor.position,
    });
    for configuration in &mut filled.configurations {
        if configuration.sensors.is_empty() && configuration.recording.is_none() {
            configuration.sensors = sensors.clone().collect();
        }
    }
    filled
}

/// Fits the observations with every unknown position of a sensor filled in: once each for a row of positions along the
/// structure.
fn at_locations<T>(test: Test<'_>, fit: impl Fn(Test<'_>) -> Option<T>) -> Vec<T> {
    let (nominal, mut count) = (test.nominal, test.settings.unknown_positions);
    let filled = with_sensors(test.observations, nominal);
    // A sensor without a position and without a mass has no effect.
    let mut sensors = filled.configurations.iter().flat_map(|c| &c.sensors);
    let is_open = sensors.any(|s| s.position.is_none() && nominal.mass_of(&s.name) > 0.0);
    if !is_open {
        count = 1;
    }
    let mut all = Vec::new();
    for k in 0..count {
        let position = nominal.length() * (k as f64 + 0.5) / count as f64;
        let mut located = filled.clone();
        let configurations = located.configurations.iter_mut().filter(|_| is_open);
        for sensor in configurations.flat_map(|one| &mut one.sensors) {
            sensor.position.get_or_insert(position);
        }
        all.extend(fit(Test {
            observations: &located,
            ..test
        }));
    }
    all
}

/// Returns the least chi square of the nominal model over the unknown positions of sensors.
pub fn least_nominal_chi_square(test: Test<'_>) -> Option<f64> {
    let fits = at_locations(test, |test| Some(prepared(test)?.1));
    fits.iter()
        .map(|none| 2.0 * none.best.optimum.objective)
        .min_by(f64::total_cmp)
}

/// Spread of the reading of a mode that is off (1): a neighbour's peak, or one of another direction.
const OFF: f64 = 0.02;

/// Returns the evidence that one mode's reading is off, over that of the nominal model (logarithm). `None` for a mode that takes no
/// part in the fit.
pub fn reading_evidence(test: Test<'_>, mode: usize) -> Option<f64> {
    let found = at_locations(test, |test| {
        let (dataset, none) = prepared(test)?;
        if mode > dataset.fitted_modes {
            return None;
        }
        let mut loose = dataset;
        loose.add_nuisance(NuisanceParameter::Discrepancy { mode }, 0.0, OFF);
        let forward = Forward::new(&loose, &[]);
        let priors = forward.priors();
        let mut start = none.parameters().to_vec();
        start.resize(priors.len(), 0.0);
        let off = evaluate(&forward, &priors, &start)?;
        Some(off.log_evidence - none.log_evidence)
    });
    found.into_iter().max_by(f64::total_cmp)
}

/// Returns the data, with amplitudes and slopes by the nominal model, and the fit of that model.
fn prepared(test: Test<'_>) -> Option<(Dataset, Fit)> {
    let mut dataset = Dataset::new(test.observations, test.nominal, test.settings);
    let first = fit_nominal(&dataset)?;
    let models = Forward::new(&dataset, &[]).solve(first.parameters())?;
    dataset.nominal_modes = models.into_iter().map(|one| one.own).collect();
    set_joint_motions(&mut dataset, test.observations, &first);
    set_section_slopes(&mut dataset, &first)?;
    dataset.shape_slopes = Some(Forward::new(&dataset, &[]).joint_differences(first.parameters())?);
    let none = fit_nominal(&dataset)?;
    Some((dataset, none))
}

/// Sets the slopes with respect to what changes along the section, at an optimum of the nominal model.
///
/// `None` where the model has no solution.
pub fn set_section_slopes(dataset: &mut Dataset, nominal: &Fit) -> Option<()> {
    let mut planned = dataset.clone();
    planned.modes += MORE_MODES;
    let models = Forward::new(&planned, &[]).solve(nominal.parameters())?;
    dataset.section = models.first()?.section_slopes(planned.modes)?;
    Some(())
}

/// Number of single effects from whose fits the nominal model is fitted again.
const REFITTED: usize = 2;

/// Fits all hypotheses but pairs of effects.
fn compare_singles(test: Test<'_>) -> Option<ModelComparison> {
    let (dataset, mut none) = prepared(test)?;
    let effects = candidate_effects(&dataset);
    let by_frequencies = fit_frequencies(&dataset);
    let search = Search {
        dataset: &dataset,
        without: &none,
        by_frequencies: by_frequencies.as_ref(),
    };
    let fits: Vec<Option<Fit>> = effects.par_iter().map(|one| search.add_any(one)).collect();
    let mut candidates: Vec<Candidate> = Vec::new();
    for (variants, fit) in effects.iter().zip(fits) {
        let effect = variants[0].effect();
        candidates.extend(effect.zip(fit).map(|(effect, fit)| single(effect, fit)));
    }
    let one_stands = candidates.iter().any(|one| stands(&dataset, &one.fit));
    if !one_stands && !stands(&dataset, &none) {
        add_large_effects(&search, &effects, &mut candidates);
    }
    // A better fit with an effect may lead to a better one without it.
    let mut better: Vec<&Fit> = candidates.iter().map(|one| &one.fit).collect();
    better.retain(|fit| fit.best.optimum.objective < none.best.optimum.objective);
    better.sort_by(|a, b| {
        a.best
            .optimum
            .objective
            .total_cmp(&b.best.optimum.objective)
    });
    for fit in better.into_iter().take(REFITTED) {
        if let Some(again) = refit_nominal(&dataset, fit)
            && again.log_evidence > none.log_evidence
        {
            none = again;
        }
    }
    if dataset.first_drift().is_some() {
        // A joint that differs from set-up to set-up.
        let (layout, best) = (dataset.layout(&[]), &none.best);
        let found = LARGE_DRIFTS
            .map(|drift| over_drifts(&dataset, &layout, &best.priors, &best.optimum, &[drift]));
        let fit = Fit::of_variants(found.into())?;
        let drift = fit.best.drifts.first().map(|drift| drift.0);
        let mut candidate = single(EffectId::JointDrift, fit);
        candidate.drift = drift;
        candidates.push(candidate);
    }
    let most = candidates
        .iter()
        .map(|one| one.fit.log_evidence)
        .fold(f64::NEG_INFINITY, f64::max);
    let mut foreign: Vec<ForeignFit> = Vec::new();
    // They only keep wrong names away. Without a detection there is no name.
    if most - none.log_evidence >= dataset.settings.thresholds.detected || !stands(&dataset, &none)
    {
        let mut singles = candidates.iter();
        let one_mass = singles.find(|one| one.effects() == [EffectId::AddedMass]);
        foreign = fit_foreign(&dataset, &none, one_mass.map(|one| &one.fit));
    }
    if let Some(fit) = fit_unknown(&dataset, &none, &foreign) {
        candidates.push(Candidate::new(Hypothesis::Unknown, fit));
    }
    let baseline = fit_exact(&dataset, is_geometry).unwrap_or_else(|| none.clone());
    let drifting = fit_exact(&dataset, is_described).unwrap_or_else(|| baseline.clone());
    // A joint and a temperature that are the same in all set-ups.
    let mut alike = dataset.clone();
    alike.settings.drift_stds = vec![EXACT];
    let described = fit_exact(&alike, |nuisance| {
        is_described(nuisance) || matches!(nuisance, NuisanceParameter::Temperature { .. })
    });
    let described = described.unwrap_or_else(|| drifting.clone());
    candidates.push(Candidate::new(Hypothesis::None, none));
    Some(ModelComparison {
        dataset,
        described,
        drifting,
        baseline,
        candidates,
        positions: 1,
    })
}

fn single(effect: EffectId, fit: Fit) -> Candidate {
    Candidate::new(Hypothesis::Effects(vec![effect]), fit)
}

/// Searches every effect again by multi-start, if no single one suffices: it may be larger than a search from zero
/// can reach.
fn add_large_effects(
    search: &Search<'_>,
    effects: &[Vec<CandidateEffect>],
    candidates: &mut Vec<Candidate>,
) {
    // Errors of the set-up hardly move the frequencies, which are all that such a search looks at.
    let effects = effects.iter().flatten();
    let effects: Vec<CandidateEffect> =
        effects.filter(|one| !one.is_of_set_up()).copied().collect();
    let found: Vec<Option<Fit>> = effects
        .par_iter()
        .map(|effect| {
            let known = candidates
                .iter()
                .find(|one| effect.effect().is_some_and(|id| one.effects() == [id]));
            add_by_multi_start(search, *effect, known.map(|one| &one.fit))
        })
        .collect();
    for (effect, fit) in effects.iter().zip(found) {
        let Some((fit, id)) = fit.zip(effect.effect()) else {
            continue;
        };
        let mut known = candidates.iter_mut();
        match known.find(|one| one.effects() == [id]) {
            Some(one) if fit.log_evidence > one.fit.log_evidence => one.fit = fit,
            Some(_) => {}
            None => candidates.push(single(id, fit)),
        }
    }
}

/// Standard deviation (1) of a parameter that is taken as exact: far below the resolution of any datum.
const EXACT: f64 = 1e-8;

/// Fits the nominal model with the nuisance parameters that `is_exact` selects held at their described values. `None`
/// if the fit fails.
pub fn fit_exact(dataset: &Dataset, is_exact: impl Fn(NuisanceParameter) -> bool) -> Option<Fit> {
    let mut exact = dataset.clone();
    for nuisance in &mut exact.nuisances {
        if is_exact(nuisance.parameter) {
            nuisance.std = EXACT;
        }
    }
    fit_nominal(&exact)
}

/// Returns whether a description states a nuisance parameter.
fn is_described(nuisance: NuisanceParameter) -> bool {
    use NuisanceParameter::{FastenedMass, SensorInertia, SensorMass};
    let is_mass = matches!(
        nuisance,
        SensorMass { .. } | SensorInertia { .. } | FastenedMass { .. }
    );
    is_mass || is_geometry(nuisance)
}

/// Returns whether a nuisance parameter belongs to the beam and its model.
pub fn is_geometry(nuisance: NuisanceParameter) -> bool {
    use NuisanceParameter::{Discrepancy, Poisson, Property, Shear, WidthHold};
    matches!(
        nuisance,
        Property { .. } | Poisson | WidthHold | Shear | Discrepancy { .. }
    )
}

/// Spreads of the joint between set-ups that are no longer a nuisance (1).
const LARGE_DRIFTS: [f64; 3] = [0.04, 0.07, 0.12];

/// Fits the nominal model without the masses that have no position in any recording; `None` where there are none.
pub fn without_unlocated(test: Test<'_>) -> Option<UnlocatedSensors> {
    let observations = with_sensors(test.observations, test.nominal);
    let mut without = test.nominal.clone();
    let (mut sensors, mut mass) = (Vec::new(), 0.0);
    for sensor in &mut without.sensors {
        let observed = observations.configurations.iter().flat_map(|c| &c.sensors);
        let mut positions = observed
            .filter(|observed| observed.name == sensor.name)
            .map(|observed| observed.position)
            .peekable();
        let is_observed = positions.peek().is_some();
        let own = sensor.mass.unwrap_or(0.0);
        if own > 0.0 && is_observed && positions.all(|position| position.is_none()) {
            sensors.push(sensor.name.clone());
            mass += own;
            sensor.mass = Some(0.0);
        }
    }
    if sensors.is_empty() {
        return None;
    }
    let (dataset, fit) = prepared(Test {
        observations: &observations,
        nominal: &without,
        ..test
    })?;
    let residuals = Residuals::new(&dataset, &fit)?;
    Some(UnlocatedSensors {
        sensors,
        mass,
        gap: residuals.frequency_rms(&dataset),
        goodness_of_fit: residuals.goodness()?,
    })
}
