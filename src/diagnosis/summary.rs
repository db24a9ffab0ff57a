//! The result: from the comparison of the hypotheses to every stated number.

use crate::amplitude::amplitude_dependence;
use crate::common_factor::common_factor;
use crate::compare::ModelComparison;
use crate::dataset::Dataset;
use crate::description::property_of;
use crate::evidence::{Fit, log_likelihood};
use crate::location_map::location_map;
use crate::next_test::next_tests;
use crate::parameters::{CandidateEffect, LocationKind, NuisanceParameter, Target};
use crate::result::{
    CrossValidation, DecidedBy, Diagnosis, Hypothesis, HypothesisResult, JointShift,
    ParameterValue, UnlocatedSensors, Verdict,
};
use crate::settings::DETECTABLE;
use crate::structure::COUPLING;
use crate::validate::{
    HoldoutErrors, LeftOutErrors, Residuals, closure, frequency_residuals, noise_floor,
};
use crate::verdict::{
    Candidate, DegreesOfFreedom, GoodnessOfFit, best_known, confounded, delta_chi_square,
    location_probabilities, none_of, verdict,
};
use tapjoint_beam::Beam;
use tapjoint_beam::effects::{Effect, EffectId};
use tapjoint_numerics::stats::NORMAL_95;

/// Returns the result of a comparison with its next tests.
pub fn diagnosis(comparison: &ModelComparison, unlocated: Option<UnlocatedSensors>) -> Diagnosis {
    let mut found = without_next_tests(comparison, unlocated);
    found.next_tests = next_tests(comparison, &found.verdict);
    found
}

/// Returns the result of a comparison without its next tests.
pub fn without_next_tests(
    comparison: &ModelComparison,
    unlocated: Option<UnlocatedSensors>,
) -> Diagnosis {
    let (dataset, candidates) = (&comparison.dataset, &comparison.candidates);
    let thresholds = &dataset.settings.thresholds;
    let reference = Reference::new(comparison);
    let hypotheses: Vec<HypothesisResult> = (0..candidates.len())
        .map(|k| reference.hypothesis_result(k))
        .collect();
    let best = best_known(candidates).unwrap_or(0);
    let fit = &candidates[best].fit;
    let after = Residuals::new(dataset, fit);
    let mut tested = GoodnessOfFit::new(dataset, fit);
    if let Some(tested) = &mut tested {
        tested.freedom = Some(DegreesOfFreedom::of(dataset, fit));
        tested.closure = hypotheses[best].withheld_closure;
        let errors = HoldoutErrors::new(dataset, fit).zip(reference.holdout_before.as_ref());
        tested.is_decisive = errors.is_some_and(|(after, before)| {
            after.are_decisive(before, thresholds.gap_over_prediction)
        });
    }
    let none = none_of(candidates).and_then(|none| GoodnessOfFit::new(dataset, &none.fit));
    let mut verdict = verdict(candidates, tested.as_ref(), none.as_ref(), thresholds);
    // Masses at locations of their choice explain much that has other causes.
    let misses =
        (unlocated.as_ref()).is_some_and(|without| without.goodness_of_fit < thresholds.misfit);
    if verdict == Verdict::NoGap && misses {
        verdict = Verdict::NotEnoughData(
            "sensors of unknown position explain them, and so would other causes; state their positions"
                .to_owned(),
        );
    }
    let residuals = reference.before.as_ref().zip(after.as_ref());
    Diagnosis {
        next_tests: Vec::new(),
        locations: location_probabilities(candidates, thresholds),
        residuals: residuals.map_or_else(Vec::new, |(before, after)| {
            frequency_residuals(dataset, before, after)
        }),
        goodness_of_fit: tested.as_ref().and_then(|tested| tested.overall),
        blocks: tested.map_or_else(Vec::new, |tested| tested.blocks),
        noise_floor: noise_floor(dataset),
        misfit: after.as_ref().map(Residuals::misfit),
        joint_shift: match verdict {
            Verdict::Named(_) | Verdict::Group(_) | Verdict::Set(_) => hypotheses[best].joint_shift,
            Verdict::NoGap | Verdict::Unknown | Verdict::NotEnoughData(_) => JointShift::default(),
        },
        verdict,
        hypotheses,
        location_map: location_map(dataset, &comparison.baseline),
        decided_by: decided_by(dataset, candidates),
        amplitude_dependence: amplitude_dependence(dataset, &comparison.baseline),
        fitted_modes: dataset.fitted_modes,
        common_factor: common_factor(dataset),
        spare_modes_from: dataset
            .spare
            .is_empty()
            .then_some(thresholds.spare_modes_from),
        unlocated,
    }
}

/// Returns what decided: data or priors. It follows from the likelihood ratio of the two best hypotheses at their
/// optima. `unknown` has no optimum of its own.
fn decided_by(dataset: &Dataset, candidates: &[Candidate]) -> DecidedBy {
    let mut known = candidates.iter().filter(|one| !one.is_unknown());
    let (Some(first), Some(rival)) = (known.next(), known.next()) else {
        return DecidedBy::Data;
    };
    let [first, rival] =
        [first, rival].map(|one| log_likelihood(&dataset.data, &one.fit.best.optimum));
    if first - rival < dataset.settings.thresholds.decisive_ratio.ln() {
        DecidedBy::Priors
    } else {
        DecidedBy::Data
    }
}

/// Errors of the nominal model, with which every hypothesis is compared.
struct Reference<'a> {
    comparison: &'a ModelComparison,
    before: Option<Residuals>,
    holdout_before: Option<HoldoutErrors>,
    spare_before: Option<HoldoutErrors>,
    left_out_before: Option<LeftOutErrors>,
}

impl<'a> Reference<'a> {
    fn new(comparison: &'a ModelComparison) -> Self {
        let dataset = &comparison.dataset;
        Reference {
            comparison,
            before: Residuals::new(dataset, &comparison.described),
            holdout_before: HoldoutErrors::new(dataset, &comparison.drifting),
            spare_before: HoldoutErrors::on(&dataset.spare, dataset, &comparison.drifting),
            left_out_before: LeftOutErrors::new(dataset, &comparison.drifting),
        }
    }

    fn hypothesis_result(&self, index: usize) -> HypothesisResult {
        let candidates = &self.comparison.candidates;
        let (dataset, candidate) = (&self.comparison.dataset, &candidates[index]);
        let fit = (!candidate.is_unknown()).then_some(&candidate.fit);
        let residuals = fit.and_then(|fit| Residuals::new(dataset, fit));
        let holdout = fit.and_then(|fit| HoldoutErrors::new(dataset, fit));
        let spare = fit.and_then(|fit| HoldoutErrors::on(&dataset.spare, dataset, fit));
        let none = none_of(candidates).map(|none| none.fit.log_evidence);
        let before = self.before.as_ref();
        let layout = dataset.layout(&candidate.fit.effects);
        let parameters = candidate.fit.parameters();
        let mut joint_parameters = dataset.nominal.joint_parameters().into_iter();
        let coupling = joint_parameters.position(|(direction, _)| direction == COUPLING);
        let mut result = HypothesisResult {
            hypothesis: candidate.hypothesis.clone(),
            groups: candidate.groups(),
            probability: candidate.probability,
            log_bayes_factor: none.map(|none| candidate.fit.log_evidence - none),
            confounded_with: confounded(dataset, candidates, index),
            parameters: self.parameter_values(candidate),
            gap_before: before.map(|r| r.frequency_rms(dataset)),
            gap_after: residuals.as_ref().map(|r| r.frequency_rms(dataset)),
            left_out_modes: residuals.as_ref().and_then(|r| r.left_out_rms(dataset)),
            holdout_before: self.holdout_before.as_ref().map(HoldoutErrors::rms),
            holdout_after: holdout.as_ref().map(HoldoutErrors::rms),
            holdout_floor: holdout.as_ref().map(HoldoutErrors::floor),
            withheld_closure: (self.holdout_before.as_ref().zip(holdout.as_ref()))
                .and_then(|(before, after)| closure(before, after, &dataset.settings)),
            spare_before: self.spare_before.as_ref().map(HoldoutErrors::rms),
            spare_after: spare.as_ref().map(HoldoutErrors::rms),
            closure: (self.spare_before.as_ref().zip(spare.as_ref()))
                .and_then(|(before, after)| closure(before, after, &dataset.settings)),
            cross_validation: self.cross_validation(candidate),
            goodness_of_fit: residuals.as_ref().and_then(Residuals::goodness),
            misfit: residuals.as_ref().map(Residuals::misfit),
            effects: effects_of(dataset, &candidate.fit),
            coupling: coupling.map_or(0.0, |k| parameters[k]),
            beam: Some(fitted_beam(dataset, &parameters[layout.first_nuisance()..])),
            ..HypothesisResult::default()
        };
        if !candidate.is_unknown() {
            self.add_joint(candidate, &mut result);
        }
        result
    }

    /// Predicts each recording from the others, for probable hypotheses and for `none`.
    fn cross_validation(&self, candidate: &Candidate) -> Option<CrossValidation> {
        let dataset = &self.comparison.dataset;
        let is_probable = candidate.probability > dataset.settings.thresholds.cross_validated;
        if candidate.is_unknown() || !is_probable && candidate.hypothesis != Hypothesis::None {
            return None;
        }
        let after = LeftOutErrors::new(dataset, &candidate.fit)?;
        after.against(self.left_out_before.as_ref()?, &dataset.settings)
    }

    /// Adds what the fit of a candidate makes of the joint's stiffnesses, whose logarithms are fitted: their values
    /// (none without a joint), 95 % intervals and changes.
    fn add_joint(&self, candidate: &Candidate, result: &mut HypothesisResult) {
        let nominal = &self.comparison.dataset.nominal;
        let (values, stds) = (candidate.fit.parameters(), candidate.stds());
        let mut joint = nominal.specimen.joint_stiffnesses();
        for (k, direction) in nominal.fitted_springs().into_iter().enumerate() {
            joint[direction] = values[k].exp();
            let ends = [-1.0, 1.0].map(|sign| (values[k] + sign * NORMAL_95 * stds[k]).exp());
            let is_bounded = ends.iter().all(|end| end.is_finite());
            result.joint_intervals[direction] = is_bounded.then_some(ends);
            let before = match nominal.joint_before {
                Some(estimated) => f64::ln(estimated[direction]),
                None => self.comparison.described.parameters()[k],
            };
            let percent = Some(100.0 * ((values[k] - before).exp() - 1.0));
            match direction {
                0 => result.joint_shift.kx_percent = percent,
                _ => result.joint_shift.ky_percent = percent,
            }
        }
        result.joint = (joint != [0.0; 2]).then_some(joint);
    }

    fn parameter_values(&self, candidate: &Candidate) -> Vec<ParameterValue> {
        if let Some(drift) = candidate.drift {
            return vec![value_of(EffectId::JointDrift, "std", drift, None)];
        }
        let layout = self.comparison.dataset.layout(&candidate.fit.effects);
        let (values, stds) = (candidate.fit.parameters(), candidate.stds());
        let mut parameters = Vec::new();
        for (k, effect) in candidate.fit.effects.iter().enumerate() {
            let Some(id) = effect.effect() else { continue };
            let at = layout.size(k);
            let (size, size_std) = (values[at], stds[at]);
            let detectable = DETECTABLE.sqrt() * size_std;
            if !effect.size.is_fixed() {
                parameters.push(ParameterValue {
                    smallest_detectable: Some(detectable).filter(|size| size.is_finite()),
                    smallest_separable: self
                        .smallest_separable(candidate, size - effect.size.neutral),
                    ..value_of(id, effect.size.name, size, Some(size_std))
                });
            }
            for (name, number) in numbers_of(&self.comparison.dataset, effect) {
                parameters.push(value_of(id, name, number as f64, None));
            }
            if let (Some(range), Some(location)) = (effect.location, layout.location(k)) {
                let value = range.value_at(values[location]);
                let scale = if range.is_logarithmic() { value } else { 1.0 };
                let std = scale * stds[location];
                let is_known = std < 0.5 * (range.high - range.low);
                let own_std = match range.kind {
                    LocationKind::Gyration => 2.0 * size * value * std,
                    _ => std,
                };
                parameters.push(value_of(
                    id,
                    range.name(),
                    range.own_value(value, size),
                    is_known.then_some(own_std),
                ));
            }
        }
        parameters
    }

    /// Returns the size at which every rival would be three standard deviations worse: chi square grows with the
    /// square of the size.
    fn smallest_separable(&self, own: &Candidate, size: f64) -> Option<f64> {
        let rivals = self.comparison.candidates.iter().filter(|rival| {
            rival.hypothesis == Hypothesis::None
                || rival.effects().len() == 1 && rival.groups() != own.groups()
        });
        let nearest = rivals
            .map(|rival| delta_chi_square(&own.fit, &rival.fit))
            .fold(f64::INFINITY, f64::min);
        let separate = self.comparison.dataset.settings.thresholds.separate;
        (nearest > 0.0 && nearest.is_finite()).then(|| size.abs() * (separate / nearest).sqrt())
    }
}

/// Returns the numbers of the sensors and recordings on which an effect acts, by the names of its parameters. They count
/// from 1; 0 means all.
fn numbers_of(dataset: &Dataset, candidate: &CandidateEffect) -> Vec<(&'static str, usize)> {
    let inventory = &dataset.inventory;
    let mut arrangements = dataset.arrangements.iter();
    match candidate.target {
        Target::All if candidate.is(EffectId::SensorScale) => vec![("sensor", 0)],
        Target::All if candidate.is(EffectId::TapPosition) => vec![("recording", 0)],
        Target::All => Vec::new(),
        Target::Sensor { name } if candidate.is(EffectId::SensorPosition) => {
            vec![("sensor", number_of(dataset, name)), ("recording", 0)]
        }
        Target::Sensor { name } => vec![("sensor", number_of(dataset, name))],
        Target::Pair { names } => vec![
            ("sensor", number_of(dataset, names[0])),
            ("other", number_of(dataset, names[1])),
        ],
        Target::Place { position } => {
            let name = inventory.positions[position].0;
            let same = inventory.positions.iter().filter(|one| one.0 == name);
            let first = arrangements.find(|one| one.positions.contains(&position));
            let recording = first.filter(|_| same.count() > 1);
            let recording = recording.map_or(0, |one| one.setup + 1);
            vec![
                ("sensor", number_of(dataset, name)),
                ("recording", recording),
            ]
        }
        Target::Taps { tap } => {
            let first = arrangements.find(|one| one.tap_index == Some(tap));
            let recording = first.filter(|_| inventory.taps.len() > 1);
            vec![("recording", recording.map_or(0, |one| one.setup + 1))]
        }
    }
}

/// Returns the number of a sensor in the description, by the index of its name.
fn number_of(dataset: &Dataset, name: usize) -> usize {
    let own = &dataset.inventory.names[name];
    let mut sensors = dataset.nominal.sensors.iter();
    sensors.position(|one| one.name == *own).unwrap_or(name) + 1
}

/// Returns the effects of a fit, with the numbers of what they act on.
fn effects_of(dataset: &Dataset, fit: &Fit) -> Vec<Effect> {
    let layout = dataset.layout(&fit.effects);
    let mut effects = layout.effects_at(fit.parameters()).unwrap_or_default();
    for (effect, candidate) in effects.iter_mut().zip(&fit.effects) {
        for (name, number) in numbers_of(dataset, candidate) {
            if let Ok(numbered) = effect.with(name, number as f64) {
                *effect = numbered;
            }
        }
    }
    effects
}

/// Returns the first beam with the properties that these values of the nuisance parameters give it.
fn fitted_beam(dataset: &Dataset, values: &[f64]) -> Beam {
    let mut beam = dataset.nominal.specimen.body.beams()[0];
    for (nuisance, change) in dataset.nuisances.iter().zip(values) {
        let property = match nuisance.parameter {
            NuisanceParameter::Property { property } => property,
            NuisanceParameter::Poisson => {
                beam.poisson += change;
                continue;
            }
            _ => continue,
        };
        if let Some(own) = property_of(&mut beam, property) {
            *own *= change.exp();
        }
    }
    beam
}

/// Returns a parameter with its value and standard uncertainty.
fn value_of(effect: EffectId, name: &'static str, value: f64, std: Option<f64>) -> ParameterValue {
    ParameterValue {
        effect,
        name,
        value,
        std: std.filter(|std| std.is_finite()),
        smallest_detectable: None,
        smallest_separable: None,
    }
}
