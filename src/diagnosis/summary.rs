//! The result: from the comparison of the hypotheses to every stated number.

use crate::amplitude::amplitude_dependence;
use crate::compare::ModelComparison;
use crate::dataset::Dataset;
use crate::description::property_of;
use crate::evidence::{Fit, log_likelihood};
use crate::forward::Forward;
use crate::next_test::next_tests;
use crate::optimum::{LinearModel, Optimum, maximise};
use crate::parameters::{LocationKind, NuisanceParameter, Prior};
use crate::result::{
    CrossValidation, DecidedBy, Diagnosis, Hypothesis, HypothesisResult, JointShift, LocationMap,
    ParameterValue, UnlocatedSensors, Verdict,
};
use crate::settings::{
    CROSS_VALIDATED, DECISIVE_RATIO, DETECTABLE, LEAST_MAP_DATA, MISFIT, SEPARATE,
};
use crate::structure::{COUPLING, ModalModel};
use crate::validate::{
    HoldoutErrors, LeftOutErrors, Residuals, closure, frequency_residuals, noise_floor,
};
use crate::verdict::{
    Candidate, DegreesOfFreedom, GoodnessOfFit, best_known, confounded, delta_chi_square,
    location_probabilities, none_of, verdict,
};
use nalgebra::DMatrix;
use tapjoint_beam::Beam;
use tapjoint_beam::effects::EffectId;
use tapjoint_beam::specimen::Body;
use tapjoint_numerics::stats::NORMAL_95;

/// Returns the result of a comparison.
pub fn diagnosis(comparison: &ModelComparison, unlocated: Option<UnlocatedSensors>) -> Diagnosis {
    let (dataset, candidates) = (&comparison.dataset, &comparison.candidates);
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
        tested.closure = hypotheses[best].closure;
        let errors = HoldoutErrors::new(dataset, fit).zip(reference.holdout_before.as_ref());
        tested.is_decisive = errors.is_some_and(|(after, before)| after.are_decisive(before));
    }
    let none = none_of(candidates).and_then(|none| GoodnessOfFit::new(dataset, &none.fit));
    let mut verdict = verdict(candidates, tested.as_ref(), none.as_ref());
    // Masses at locations of their choice explain much that has other causes.
    let misses = (unlocated.as_ref()).is_some_and(|without| without.goodness_of_fit < MISFIT);
    if verdict == Verdict::NoGap && misses {
        verdict = Verdict::NotEnoughData(
            "sensors of unknown position explain them, and so would other causes; state their positions"
                .to_owned(),
        );
    }
    let residuals = reference.before.as_ref().zip(after.as_ref());
    Diagnosis {
        next_tests: next_tests(comparison, &verdict),
        locations: location_probabilities(candidates),
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
        unlocated,
    }
}

/// Returns what decided: data or priors. It follows from the likelihood ratio of the two best hypotheses at their
/// optima, and from the refutation of a better one. `unknown` has its own noise model, so that its likelihood is not
/// comparable with the others.
fn decided_by(dataset: &Dataset, candidates: &[Candidate]) -> DecidedBy {
    let known: Vec<&Candidate> = candidates.iter().filter(|one| !one.is_unknown()).collect();
    let weights = known.iter().map(|one| one.log_weight());
    let most = weights.fold(f64::NEG_INFINITY, f64::max);
    let [first, rival, ..] = known[..] else {
        return DecidedBy::Data;
    };
    // A misfit of a better one has brought it to the top.
    if first.log_weight() < most {
        return DecidedBy::Data;
    }
    let [first, rival] =
        [first, rival].map(|one| log_likelihood(&dataset.data, &one.fit.best.optimum));
    if first - rival < DECISIVE_RATIO.ln() {
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
    left_out_before: Option<LeftOutErrors>,
}

impl<'a> Reference<'a> {
    fn new(comparison: &'a ModelComparison) -> Self {
        let dataset = &comparison.dataset;
        Reference {
            comparison,
            before: Residuals::new(dataset, &comparison.described),
            holdout_before: HoldoutErrors::new(dataset, &comparison.drifting),
            left_out_before: LeftOutErrors::new(dataset, &comparison.drifting),
        }
    }

    fn hypothesis_result(&self, index: usize) -> HypothesisResult {
        let candidates = &self.comparison.candidates;
        let (dataset, candidate) = (&self.comparison.dataset, &candidates[index]);
        let fit = (!candidate.is_unknown()).then_some(&candidate.fit);
        let residuals = fit.and_then(|fit| Residuals::new(dataset, fit));
        let holdout = fit.and_then(|fit| HoldoutErrors::new(dataset, fit));
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
            closure: (self.holdout_before.as_ref().zip(holdout.as_ref()))
                .and_then(|(before, after)| closure(before, after, dataset.settings.seed)),
            cross_validation: self.cross_validation(candidate),
            goodness_of_fit: residuals.as_ref().and_then(Residuals::goodness),
            misfit: residuals.as_ref().map(Residuals::misfit),
            effects: layout.effects_at(parameters).unwrap_or_default(),
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
        let is_probable = candidate.probability > CROSS_VALIDATED;
        if candidate.is_unknown() || !is_probable && candidate.hypothesis != Hypothesis::None {
            return None;
        }
        let dataset = &self.comparison.dataset;
        let after = LeftOutErrors::new(dataset, &candidate.fit)?;
        after.against(self.left_out_before.as_ref()?, dataset.settings.seed)
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
            let at = layout.size(k);
            let (size, size_std) = (values[at], stds[at]);
            let detectable = DETECTABLE.sqrt() * size_std;
            parameters.push(ParameterValue {
                smallest_detectable: Some(detectable).filter(|size| size.is_finite()),
                smallest_separable: self.smallest_separable(candidate, size - effect.size.neutral),
                ..value_of(effect.effect, effect.size.name, size, Some(size_std))
            });
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
                    effect.effect,
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
        (nearest > 0.0 && nearest.is_finite()).then(|| size.abs() * (SEPARATE / nearest).sqrt())
    }
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

// Map along the beam: stiffness or mass that the residual calls for, whatever the cause.
//
// The beam is cut into pieces. A relative change e_j of the bending stiffness of piece j moves ln f of
// a mode by half of that piece's share of its bending energy, a change of its mass by minus half of its
// share of the kinetic energy. The changes that explain the residual of the nominal model are found by
// regularised least squares, beside the joint and all nuisance parameters.

/// Pieces of the beam: twice as many as half waves of the sixth mode.
const PIECES: usize = 12;
/// Points in each piece for its share of the energies.
const PIECE_POINTS: usize = 8;
/// Standard deviation of a piece's change before the data, if all pieces change (1).
const CHANGE_STD: f64 = 0.1;
/// Standard deviation of the change of a single piece (1): wide, since its place counts and not its size.
const SINGLE_CHANGE_STD: f64 = 3.0;

/// Returns the map of the nominal fit's residual; `None` with fewer than four frequencies.
fn location_map(dataset: &Dataset, nominal: &Fit) -> Option<LocationMap> {
    if dataset.frequencies().count() < LEAST_MAP_DATA {
        return None;
    }
    let length = dataset.nominal.length();
    let models = Forward::new(dataset, &[]).solve(nominal.parameters())?;
    let mut slopes = [0, 1].map(|_| DMatrix::zeros(dataset.observables.len(), PIECES));
    for row in dataset.frequencies() {
        let observable = &dataset.observables[row];
        let model = &models[observable.configuration];
        if let Some(index) = model.index(observable.mode) {
            for piece in 0..PIECES {
                let own = local_slopes(model, index, piece, length);
                for (slopes, own) in slopes.iter_mut().zip(own) {
                    slopes[(row, piece)] = own;
                }
            }
        }
    }
    let (stiffness, stiffness_std) = changes(dataset, nominal, &slopes[0])?;
    let (mass, mass_std) = changes(dataset, nominal, &slopes[1])?;
    let piece = length / PIECES as f64;
    Some(LocationMap {
        positions: (0..PIECES).map(|j| piece * (j as f64 + 0.5)).collect(),
        stiffness,
        stiffness_std,
        mass,
        mass_std,
        stiffness_explains: explained(dataset, nominal, &slopes[0])?,
        mass_explains: explained(dataset, nominal, &slopes[1])?,
        // The energy of the highest mode resolves half its wave.
        resolution: length / dataset.fitted_modes as f64,
    })
}

/// Returns d ln f = (1/2) int EI w''^2 dx / omega^2 for the stiffness of a piece of the beam, and
/// -(1/2) int rho A w^2 dx for its mass, with w of unit modal mass, by the midpoint rule. `length` is that of the
/// structure (m).
fn local_slopes(model: &ModalModel, index: usize, piece: usize, length: f64) -> [f64; 2] {
    let (body, modes) = (&model.seen.specimen.body, model.modes());
    let (step, omega) = (length / (PIECES * PIECE_POINTS) as f64, model.omega(index));
    let (mut by_stiffness, mut by_mass) = (0.0, 0.0);
    for point in 0..PIECE_POINTS {
        let from = step * (piece * PIECE_POINTS + point) as f64;
        let x = from + 0.5 * step;
        let beam = match body {
            Body::One(beam) => beam,
            Body::Joined([left, _]) if x < left.length => left,
            Body::Joined([_, right]) => right,
        };
        let bend = (modes.slope(index, from + step) - modes.slope(index, from)) / step;
        by_stiffness += 0.5 * beam.bending_stiffness() * bend * bend * step / (omega * omega);
        by_mass += -0.5 * beam.mass_per_length() * modes.displacement(index, x).powi(2) * step;
    }
    [by_stiffness, by_mass]
}

/// Returns the changes of all pieces together and their standard uncertainties.
fn changes(
    dataset: &Dataset,
    nominal: &Fit,
    slopes: &DMatrix<f64>,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let first = nominal.parameters().len();
    let (priors, found) = with_pieces(dataset, nominal, slopes, CHANGE_STD)?;
    let variances = found.covariance(&priors)?.diagonal();
    let stds = variances.iter().skip(first).map(|v| v.max(0.0).sqrt());
    Some((found.parameters[first..].to_vec(), stds.collect()))
}

/// Returns the share of the misfit by which chi square falls if one piece alone changes, for each piece.
fn explained(dataset: &Dataset, nominal: &Fit, slopes: &DMatrix<f64>) -> Option<Vec<f64>> {
    // All that the described model leaves.
    let objective = nominal.best.optimum.objective;
    let misfit = 2.0 * objective;
    (0..PIECES)
        .map(|piece| {
            let own = slopes.columns(piece, 1).into_owned();
            let (_, found) = with_pieces(dataset, nominal, &own, SINGLE_CHANGE_STD)?;
            let decrease = 2.0 * (objective - found.objective).max(0.0);
            Some(if misfit > 0.0 { decrease / misfit } else { 0.0 })
        })
        .collect()
}

/// Returns the optimum of the nominal fit, linearised, with changes of pieces after its parameters; and the priors.
fn with_pieces(
    dataset: &Dataset,
    nominal: &Fit,
    slopes: &DMatrix<f64>,
    std: f64,
) -> Option<(Vec<Prior>, Optimum)> {
    let optimum = &nominal.best.optimum;
    let first = optimum.parameters.len();
    let count = first + slopes.ncols();
    let mut all = optimum.model.slopes.clone().resize_horizontally(count, 0.0);
    all.columns_mut(first, slopes.ncols()).copy_from(slopes);
    let mut start = optimum.parameters.clone();
    start.resize(count, 0.0);
    let mut priors = nominal.best.priors.clone();
    priors.resize(count, Prior::normal(0.0, std));
    let model = LinearModel {
        origin: &start,
        there: &optimum.model.predicted,
        slopes: &all,
    };
    let found = maximise(&dataset.data, &priors, &start, &model)?;
    Some((priors, found))
}
