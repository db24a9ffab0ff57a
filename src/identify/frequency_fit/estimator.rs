//! The estimator: what is free, what is known, and the fit as plain data.

use super::model::{FrequencyModel, JointedStructure, PARAMETERS, Parameter, Point};
use super::problem::{
    Covariance, Datum, Evaluation, FOLLOWED, FULL, MISFIT, Minimum, Prior, Problem, REPEATED,
    ROUGH, along, everywhere, promising, value_along, within_bounds,
};
use super::uncertainty::{
    AttachmentTolerance, BudgetInput, DescriptionPull, LEAST_DISCREPANCY, UncertainInput,
    attachment_inputs, discrepancy, joint_near, whitening, width_inputs,
};
use super::{ConsistentSettings, Goodness, Limit, Quantity, ResidualWeights, joint_at, limit_of};
use crate::pairs::{ModeLambda, PairsModel, estimate_pairs};
use crate::{IdentifyError, MeasuredMode, Stiffnesses};
use nalgebra::DVector;
use tapjoint_beam::interface::LAST_STEP;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{Assembly, Beam, JointStiffness};
use tapjoint_numerics::least_squares::{Settings, StopReason};

/// A joint to be estimated from the frequencies of these modes, as often as wanted.
#[derive(Debug, Clone)]
pub struct ConsistentEstimator {
    /// The structure as described, then those whose clamp was moved.
    pub(super) models: Vec<FrequencyModel>,
    pub(super) settings: ConsistentSettings,
    pub(super) modes: Vec<MeasuredMode>,
    /// Index of the model of each mode.
    pub(super) structures: Vec<usize>,
    /// Uncertainties of the masses of each model.
    attachments: Vec<Vec<AttachmentTolerance>>,
    pub(super) base: Point,
    /// Parameters estimated along with the joint, with their prior.
    pub(super) nuisances: Vec<(Parameter, f64)>,
    /// Uncertain inputs that the fit does not move; found by [`Self::settled`].
    pub(super) inputs: Vec<UncertainInput>,
    /// What the model itself may miss (1, relative); found by [`Self::settled`].
    pub(super) discrepancy: f64,
    /// The test of the model with the least discrepancy; found by [`Self::settled`].
    pub(super) goodness: Option<Goodness>,
    /// Where that fit moved the description; found by [`Self::settled`].
    pub(super) pulls: Vec<DescriptionPull>,
}

/// A fit without its intervals.
#[derive(Debug, Clone, PartialEq)]
pub struct PointFit {
    /// Point of least misfit.
    pub point: Point,
    /// Sum of the squared residuals there; infinite where no start leads to a minimum.
    pub misfit: f64,
    /// Covariance of the estimated coordinates (1, logarithms and atanh), in the order of the fit; infinite where nothing is
    /// known.
    pub covariance: Vec<Vec<f64>>,
    /// Reason for which the search ended.
    pub stop: StopReason,
}

/// The beam where its clamp was moved, or without its joint, with the frequencies that were read there.
#[derive(Debug, Clone, PartialEq)]
pub struct MovedClamp {
    /// The structure: of the same beam, of another length. It has the same joint, or as a free beam none.
    pub structure: JointedStructure,
    /// Its modes.
    pub modes: Vec<MeasuredMode>,
    /// Uncertainties of its masses, in their order. One with the name of another length's is the same mass and error of place.
    pub attachments: Vec<AttachmentTolerance>,
}

/// Start of repetitions of an estimate: the minima of a first one, and the body as it belongs to the
/// deepest of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbourhood {
    pub(super) models: Option<Vec<FrequencyModel>>,
    pub(super) starts: Vec<Point>,
    /// Norm of the standardised residuals at each start, the smallest first; all zero where it is not known.
    norms: Vec<f64>,
}

impl Neighbourhood {
    /// Returns these points, with the body of the beam as described.
    pub fn at(starts: &[Point]) -> Self {
        Self {
            models: None,
            starts: starts.to_vec(),
            norms: vec![0.0; starts.len()],
        }
    }

    /// Returns the starts that can lead to the deepest minimum once the data have moved by this norm (standard
    /// deviations).
    ///
    /// The norm of the residuals changes nowhere by more than the data move. Where the norms of two minima differ by
    /// more than twice that, the deeper one stays the deeper. A flat valley has any number of minima.
    /// The deepest [`FOLLOWED`] stand for them.
    pub(super) fn starts_after(&self, moved: f64) -> Vec<Point> {
        let least = self.norms.first().copied().unwrap_or(0.0);
        let starts = self.starts.iter().zip(&self.norms);
        let near = starts.filter(|(_, norm)| **norm <= least + 2.0 * moved);
        near.map(|(point, _)| *point).take(FOLLOWED).collect()
    }
}

impl PointFit {
    /// Returns the non-dimensional joint; a direction that is held rigid is infinite.
    pub fn joint(&self) -> JointStiffness {
        joint_at(&self.point)
    }

    /// Returns the standard deviations of the estimated coordinates; `None` where nothing is known.
    pub fn stds(&self) -> Vec<Option<f64>> {
        let rows = self.covariance.iter().enumerate();
        let stds = rows.map(|(index, row)| row[index].sqrt());
        stds.map(|std| Some(std).filter(|std| std.is_finite()))
            .collect()
    }
}

impl ConsistentEstimator {
    /// Returns the estimator for these modes of a structure.
    ///
    /// # Errors
    /// [`IdentifyError::Frequency`], [`IdentifyError::TooFewFrequencies`],
    /// [`IdentifyError::NoUncertainty`] where measured weights are asked for and a mode has none,
    /// [`IdentifyError::NothingToEstimate`] and [`IdentifyError::Structure`].
    pub fn new(
        structure: &JointedStructure,
        modes: &[MeasuredMode],
        settings: &ConsistentSettings,
    ) -> Result<Self, IdentifyError> {
        Self::of_lengths(structure, modes, &[], settings)
    }

    /// Returns the estimator of one joint for the modes of a structure and for those of the same beam where its
    /// clamp was moved. Each length is known apart from the others, all to the same tolerance (m).
    ///
    /// # Errors
    /// As [`Self::new`], and [`IdentifyError::TooManyLengths`].
    pub fn of_lengths(
        structure: &JointedStructure,
        modes: &[MeasuredMode],
        moved: &[MovedClamp],
        settings: &ConsistentSettings,
    ) -> Result<Self, IdentifyError> {
        if moved.len() >= Parameter::LENGTHS.len() {
            return Err(IdentifyError::TooManyLengths {
                found: moved.len() + 1,
                most: Parameter::LENGTHS.len(),
            });
        }
        let mut all = modes.to_vec();
        all.extend(moved.iter().flat_map(|moved| &moved.modes));
        check(structure, &all, settings)?;
        let mut models = vec![FrequencyModel::new(structure, model_modes(modes))?];
        let mut structures = vec![0; modes.len()];
        let mut attachments = vec![settings.attachments.clone()];
        let mut base = models[0].nominal();
        for (moved, length) in moved.iter().zip(&Parameter::LENGTHS[1..]) {
            let model = FrequencyModel::new(&moved.structure, model_modes(&moved.modes))?;
            base[length.index()] = moved.structure.beam.length.ln();
            structures.extend(vec![models.len(); moved.modes.len()]);
            models.push(model.of_length(*length));
            attachments.push(moved.attachments.clone());
        }
        if structure.assembly != Assembly::Free {
            let held = settings.held;
            base[Parameter::Kt.index()] = held.kt.ln();
            base[Parameter::Kr.index()] = held.kr.ln();
            base[Parameter::Coupling.index()] = held.coupling.atanh();
        }
        let units = StiffnessUnits::of(&structure.beam);
        for (parameter, unit) in [(Parameter::Kt, units.kt), (Parameter::Kr, units.kr)] {
            if settings.fit.contains(&parameter) {
                base[parameter.index()] = unit.ln();
            }
        }
        // Only where the frequencies' uncertainties are known can they be weighed against those of the beam.
        let mut nuisances = Vec::new();
        if settings.weights == ResidualWeights::Measured {
            let unfitted = Parameter::ALL
                .into_iter()
                .filter(|p| !settings.fit.contains(p));
            let known = unfitted.filter_map(|p| Some((p, settings.tolerances.of(p)?)));
            nuisances.extend(known.filter(|(_, std)| *std > 0.0));
            // The tolerance of the described length in m is that of every other.
            let tolerance = settings.tolerances.length.filter(|std| *std > 0.0);
            for (model, length) in models.iter().zip(Parameter::LENGTHS).skip(1) {
                let ratio = structure.beam.length / model.structure().beam.length;
                nuisances.extend(tolerance.map(|std| (length, std * ratio)));
            }
        }
        Ok(Self {
            nuisances,
            models,
            settings: settings.clone(),
            modes: all,
            structures,
            attachments,
            base,
            inputs: Vec::new(),
            discrepancy: 0.0,
            goodness: None,
            pulls: Vec::new(),
        })
    }

    /// Returns the estimator with what is uncertain beyond the readings: the attached masses' share, and the discrepancy that
    /// the residuals ask for. The same without such settings, and with relative weights.
    #[must_use]
    pub fn settled(mut self) -> Self {
        if self.settings.weights == ResidualWeights::Relative {
            return self;
        }
        let frequencies = self.frequencies();
        if self.settings.discrepancy {
            self.discrepancy = LEAST_DISCREPANCY;
        }
        let (renewed, mut minima) = self.solve(&frequencies);
        let models = renewed.unwrap_or_else(|| self.models.clone());
        let starts: Vec<Point> = minima.iter().map(|minimum| minimum.state.point).collect();
        let Some(best) = starts.first() else {
            return self;
        };
        self.inputs = self.inputs_at(best);
        if !self.inputs.is_empty() {
            minima = self.minima(&self.problem(&models, &frequencies), &starts, &FULL);
        }
        let Some(best) = minima.into_iter().next() else {
            return self;
        };
        let problem = self.problem(&models, &frequencies);
        let directions = self.directions();
        let goodness = self.goodness(&problem, &best, directions.len());
        let pulls = self.description(&problem, &best.state);
        if self.settings.discrepancy {
            let modes = self.modes.iter();
            let readings: Vec<f64> = modes
                .map(|mode| mode.std.unwrap_or(0.0) / mode.frequency)
                .collect();
            let inputs: Vec<&[f64]> = self.inputs.iter().map(|input| &input.changes[..]).collect();
            let state = &best.state;
            self.discrepancy = discrepancy(&problem, state, &directions, &readings, &inputs);
        }
        self.goodness = Some(goodness);
        self.pulls = pulls;
        self
    }

    /// Returns where the fit moved what the description states.
    pub(super) fn description(
        &self,
        problem: &Problem<'_>,
        state: &Evaluation,
    ) -> Vec<DescriptionPull> {
        let count = problem.data.len();
        let mut pulls = Vec::new();
        let nuisances = self.nuisances.iter();
        for ((parameter, _), pull) in nuisances.zip(&state.residuals[count..]) {
            pulls.push(DescriptionPull {
                input: BudgetInput::Property(*parameter),
                stated: self.base[parameter.index()].exp(),
                fitted: state.point[parameter.index()].exp(),
                pull: *pull,
            });
        }
        let inputs = self.standardised_inputs(&problem.data);
        let residuals = DVector::from_column_slice(&state.residuals[..count]);
        for (input, change) in self.inputs.iter().zip(inputs) {
            let Some(triangle) = &problem.whitening else {
                continue;
            };
            // A residual is predicted less measured: an input that raises the frequencies lowers it.
            let pull = -(triangle * change).dot(&residuals);
            pulls.push(DescriptionPull {
                input: input.input.clone(),
                stated: input.stated,
                fitted: input.stated + pull * input.std,
                pull,
            });
        }
        pulls
    }

    /// Returns true where frequencies of the beam without its joint are among the data.
    pub(super) fn has_free_test(&self) -> bool {
        let mut models = self.models.iter();
        models.any(|model| model.structure().assembly == Assembly::Free)
    }

    /// Returns the inputs that the attached masses are, with the joint and the beam at a point.
    fn inputs_at(&self, point: &Point) -> Vec<UncertainInput> {
        let mut all: Vec<UncertainInput> = Vec::new();
        for (index, model) in self.models.iter().enumerate() {
            let own = self.modes.iter().zip(&self.structures);
            let own = own.filter(|(_, structure)| **structure == index);
            let numbers: Vec<usize> = own.map(|(mode, _)| mode.mode).collect();
            let structure = model.structure();
            let joint = (structure.assembly != Assembly::Free).then(|| joint_near(point));
            let attachments = &self.attachments[index];
            let mut found = attachment_inputs(structure, joint, &numbers, attachments);
            // In the test of the free bar a mass sits at a place of its own, and may be another one of the same name.
            if index > 0 && structure.assembly == Assembly::Free {
                for input in &mut found {
                    let is_known = all.iter().any(|known| {
                        known.input == input.input
                            && known.stated == input.stated
                            && known.std == input.std
                    });
                    let is_same = input.is_mass && is_known;
                    if let (false, BudgetInput::Attachment(name)) = (is_same, &mut input.input) {
                        name.push_str(" in the free test");
                    }
                }
            }
            let poisson = self.settings.tolerances.poisson.unwrap_or(0.0);
            found.extend(width_inputs(structure, joint, &numbers, poisson));
            // The same mass loads every structure that it sits on.
            let before: usize = self
                .structures
                .iter()
                .filter(|other| **other < index)
                .count();
            let total = self.modes.len();
            for input in found {
                let known = all.iter_mut().find(|known| known.input == input.input);
                match known {
                    Some(known) => {
                        known.changes[before..before + numbers.len()]
                            .copy_from_slice(&input.changes);
                    }
                    None => {
                        let mut changes = vec![0.0; total];
                        changes[before..before + numbers.len()].copy_from_slice(&input.changes);
                        all.push(UncertainInput { changes, ..input });
                    }
                }
            }
        }
        all
    }

    /// Returns true where a stiffness of the joint is estimated.
    pub fn estimates_a_spring(&self) -> bool {
        let fit = &self.settings.fit;
        fit.contains(&Parameter::Kt) || fit.contains(&Parameter::Kr)
    }

    /// Returns the measured frequencies (Hz), those of the described structure first.
    pub fn frequencies(&self) -> Vec<f64> {
        self.modes.iter().map(|mode| mode.frequency).collect()
    }

    /// Returns what is free: first what is estimated, then the beam's uncertain properties.
    pub(super) fn free_parameters(&self) -> impl Iterator<Item = Parameter> + '_ {
        let nuisances = self.nuisances.iter().map(|(parameter, _)| *parameter);
        self.settings.fit.iter().copied().chain(nuisances)
    }

    /// Returns the unit vectors of [`Self::free_parameters`].
    pub(super) fn directions(&self) -> Vec<Point> {
        self.free_parameters().map(along).collect()
    }

    pub(super) fn problem<'a>(
        &'a self,
        models: &'a [FrequencyModel],
        frequencies: &[f64],
    ) -> Problem<'a> {
        let data = self.modes.iter().zip(&self.structures).zip(frequencies);
        let data = data.map(|((mode, &structure), &frequency)| Datum {
            structure,
            mode: mode.mode,
            frequency,
            std: match (self.settings.weights, mode.std) {
                (ResidualWeights::Measured, Some(std)) => std.hypot(self.discrepancy * frequency),
                _ => frequency,
            },
        });
        let data: Vec<Datum> = data.collect();
        Problem {
            models,
            whitening: whitening(&self.standardised_inputs(&data), data.len()),
            data,
            priors: self.priors(),
            last_step: LAST_STEP,
        }
    }

    /// Returns what is known of the beam beside the frequencies.
    pub(super) fn priors(&self) -> Vec<Prior> {
        // The beam of `base` is the described one, whose properties are never moved there.
        let priors = self.nuisances.iter().map(|&(parameter, std)| Prior {
            gradient: along(parameter),
            value: self.base[parameter.index()],
            std,
        });
        priors.chain(self.weighed()).collect()
    }

    /// Returns the change of each standardised residual by one standard uncertainty of each input.
    pub(super) fn standardised_inputs(&self, data: &[Datum]) -> Vec<DVector<f64>> {
        let inputs = self.inputs.iter().map(|input| {
            let changes = data.iter().zip(&input.changes);
            let changes = changes.map(|(datum, change)| change * datum.frequency / datum.std);
            DVector::from_iterator(data.len(), changes)
        });
        inputs.collect()
    }

    /// Returns the mass by a balance as knowledge of the beam: its logarithm grows with those of density and dimensions.
    fn weighed(&self) -> Option<Prior> {
        let weighed = self.settings.weighed?;
        if self.settings.weights == ResidualWeights::Relative {
            return None;
        }
        let structure = self.models[0].structure();
        let body = structure.body().ok()?;
        let mass: f64 = body.beams().iter().map(Beam::mass).sum();
        let ratio = weighed.length / structure.beam.length;
        let mut gradient = [0.0; PARAMETERS];
        for parameter in Parameter::OF_MASS {
            gradient[parameter.index()] = 1.0;
        }
        let mut std = weighed.std / weighed.mass;
        if ratio != 1.0 {
            // The bar goes on in the clamp: its length is another one than the free length, and as well known in m.
            gradient[Parameter::Length.index()] = 0.0;
            std = std.hypot(self.settings.tolerances.length.unwrap_or(0.0) / ratio);
        }
        Some(Prior {
            gradient,
            value: value_along(&gradient, &self.base) + (weighed.mass / (mass * ratio)).ln(),
            std,
        })
    }

    /// Returns the least misfit over all joints, from the pair regression's estimate and from wherever the
    /// frequency equation nearly holds.
    pub fn fit(&self) -> PointFit {
        self.fit_frequencies(&self.frequencies())
    }

    /// Fits other frequencies (Hz) of the same modes.
    pub fn fit_frequencies(&self, frequencies: &[f64]) -> PointFit {
        self.deepest(self.solve(frequencies).1)
    }

    /// Returns the points from which repetitions of the estimate start: the minima of this one.
    pub fn neighbourhood(&self) -> Neighbourhood {
        let (models, minima) = self.solve(&self.frequencies());
        Neighbourhood {
            models,
            starts: minima.iter().map(|minimum| minimum.state.point).collect(),
            norms: minima
                .iter()
                .map(|minimum| minimum.state.cost.sqrt())
                .collect(),
        }
    }

    /// Fits other frequencies (Hz) of the same modes downhill of known points. The body is that of the
    /// neighbourhood, renewed where the beam moves far from it.
    pub fn refit(&self, frequencies: &[f64], near: &Neighbourhood) -> PointFit {
        let models = near.models.as_ref().unwrap_or(&self.models);
        let moved = match self.settings.weights {
            ResidualWeights::Measured => {
                let read = self.modes.iter().zip(frequencies);
                let moves = read.filter_map(|(mode, f)| Some((f - mode.frequency) / mode.std?));
                moves.map(|moved| moved * moved).sum::<f64>().sqrt()
            }
            // The weights move with the data: no norm says how far the minima do.
            ResidualWeights::Relative => f64::INFINITY,
        };
        let starts = near.starts_after(moved);
        let minima = self.minima(&self.problem(models, frequencies), &starts, &REPEATED);
        self.deepest(self.renew(models, frequencies, minima).1)
    }

    /// Returns the non-dimensional stiffnesses as a function of the frequencies (Hz), for
    /// [`crate::perturbation`]; `None` where the search does not come to an end.
    pub fn stiffnesses_near<'a>(
        &'a self,
        near: &'a Neighbourhood,
    ) -> impl Fn(&[f64]) -> Option<Stiffnesses> + 'a {
        move |frequencies: &[f64]| {
            if !frequencies.iter().copied().all(is_positive) {
                return None;
            }
            let fit = self.refit(frequencies, near);
            let ended = fit.stop.converged() && fit.stop != StopReason::NothingFree;
            ended.then(|| self.stiffnesses_at(&fit.point))
        }
    }

    /// Returns Kx and Ky at a point, infinite where rigid, and Kz where the coupling is estimated.
    pub(super) fn stiffnesses_at(&self, point: &Point) -> Stiffnesses {
        let joint = joint_at(point);
        let rigid = [Quantity::Kx, Quantity::Ky]
            .map(|quantity| limit_of(quantity, point) == Some(Limit::Rigid));
        let coupled = self.settings.fit.contains(&Parameter::Coupling);
        Stiffnesses {
            kx: if rigid[0] { f64::INFINITY } else { joint.kx },
            ky: if rigid[1] { f64::INFINITY } else { joint.ky },
            kz: coupled.then(|| joint.cross_compliance.recip()),
        }
    }

    /// Returns the first of these minima; without a single one the nominal point.
    fn deepest(&self, minima: Vec<Minimum>) -> PointFit {
        let best = minima.into_iter().next().map(|best| {
            let directions = self.directions();
            let covariance = Covariance::new(&best.state.jacobian, &directions);
            let fitted = &directions[..self.settings.fit.len()];
            let rows = fitted.iter().map(|first| {
                let row = fitted.iter().map(|second| {
                    let is_known = [first, second].map(|one| covariance.std(one).is_some());
                    match is_known {
                        [true, true] => covariance.between(first, second),
                        _ => f64::INFINITY,
                    }
                });
                row.collect()
            });
            PointFit {
                point: best.state.point,
                misfit: best.state.cost,
                covariance: rows.collect(),
                stop: best.stop,
            }
        });
        best.unwrap_or(PointFit {
            point: self.base,
            misfit: f64::INFINITY,
            covariance: Vec::new(),
            stop: StopReason::NothingFree,
        })
    }
}

/// Number of modes of a model: one above the highest is asked about in the report on identifiability.
fn model_modes(modes: &[MeasuredMode]) -> usize {
    modes.iter().map(|mode| mode.mode).max().unwrap_or(0) + 1
}

fn is_positive(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}

fn check(
    structure: &JointedStructure,
    modes: &[MeasuredMode],
    settings: &ConsistentSettings,
) -> Result<(), IdentifyError> {
    if let Some(mode) = modes
        .iter()
        .find(|mode| !is_positive(mode.frequency) || mode.mode == 0)
    {
        return Err(IdentifyError::Frequency {
            mode: mode.mode,
            value: mode.frequency,
        });
    }
    let no_joint = structure.assembly == Assembly::Free;
    let fit = &settings.fit;
    if fit.is_empty() || no_joint && fit.iter().any(|fitted| Parameter::JOINT.contains(fitted)) {
        return Err(IdentifyError::NothingToEstimate);
    }
    if modes.len() < fit.len() {
        return Err(IdentifyError::TooFewFrequencies {
            unknowns: fit.len(),
            found: modes.len(),
        });
    }
    let measured = settings.weights == ResidualWeights::Measured;
    let mut unknown = modes
        .iter()
        .filter(|mode| !mode.std.is_some_and(is_positive));
    if let Some(mode) = unknown.next().filter(|_| measured) {
        return Err(IdentifyError::NoUncertainty { mode: mode.mode });
    }
    Ok(())
}

// From frequencies to the point of least misfit, and to every other minimum there is.

/// Two minima nearer than this in every estimated coordinate (1, logarithms) are one.
const SAME_MINIMUM: f64 = 0.05;
/// The attached masses' share is followed to first order; this many renewals make it exact.
const RENEWALS: usize = 6;

impl ConsistentEstimator {
    /// Returns the least misfit that the search finds from where the frequency equation nearly holds, by the body as
    /// described: the sum of the squared residuals (1) for readings with the least discrepancy. Infinite where no start
    /// leads to a minimum. A tenth of the work of [`Self::settled`]: it tells numberings that cannot fit.
    pub fn quick_misfit(&self) -> f64 {
        let mut quick = self.clone();
        if quick.settings.discrepancy {
            quick.discrepancy = LEAST_DISCREPANCY;
        }
        let minima = quick.promising_minima(&quick.problem(&quick.models, &quick.frequencies()));
        minima.first().map_or(f64::INFINITY, |best| best.state.cost)
    }

    /// Returns the minima that lie downhill of where the frequency equation nearly holds, the deepest first.
    fn promising_minima(&self, problem: &Problem<'_>) -> Vec<Minimum> {
        let mut starts = promising(problem, &self.base, &self.settings.fit);
        starts.extend(self.pairs_guess(problem));
        self.minima(problem, &starts, &FULL)
    }

    /// Returns all minima, the deepest first, and the models renewed where the beam has moved far.
    pub(super) fn solve(&self, frequencies: &[f64]) -> (Option<Vec<FrequencyModel>>, Vec<Minimum>) {
        let problem = self.problem(&self.models, frequencies);
        let mut minima = self.promising_minima(&problem);
        // A fit this good leaves no room for another minimum: below three times the expected misfit or, without
        // stated uncertainties, below the error of any reading.
        const READING: f64 = 1e-4;
        let allowed = match self.settings.weights {
            ResidualWeights::Measured => 9.0,
            ResidualWeights::Relative => READING * READING,
        };
        let enough = allowed * problem.data.len() as f64;
        if minima.first().is_none_or(|best| best.state.cost >= enough) {
            let mut all = everywhere(&self.base, &self.settings.fit);
            all.extend(minima.iter().map(|minimum| minimum.state.point));
            minima = self.minima(&problem, &all, &FULL);
        }
        self.renew(&self.models, frequencies, minima)
    }

    /// Follows the beam where the deepest minimum has moved it far from the one that the models were built
    /// for. Returns the models built anew, if they were, and the minima by them.
    fn renew(
        &self,
        models: &[FrequencyModel],
        frequencies: &[f64],
        mut minima: Vec<Minimum>,
    ) -> (Option<Vec<FrequencyModel>>, Vec<Minimum>) {
        let mut renewed: Option<Vec<FrequencyModel>> = None;
        for _ in 0..RENEWALS {
            let Some(best) = minima.first().map(|best| best.state.point) else {
                break;
            };
            let known = renewed.as_deref().unwrap_or(models);
            if !known.iter().any(|model| model.is_far(&best)) {
                break;
            }
            let all = self.models.iter().enumerate();
            let built = all.map(|(index, model)| {
                let own = self.modes.iter().zip(&self.structures);
                let own = own.filter(|(_, structure)| **structure == index);
                let own: Vec<MeasuredMode> = own.map(|(mode, _)| *mode).collect();
                model.rebuilt(&best, model_modes(&own))
            });
            let Ok(built) = built.collect::<Result<Vec<_>, _>>() else {
                break;
            };
            let starts: Vec<Point> = minima.iter().map(|minimum| minimum.state.point).collect();
            minima = self.minima(&self.problem(&built, frequencies), &starts, &FULL);
            renewed = Some(built);
        }
        (renewed, minima)
    }

    /// Returns the pair regression's estimate, where it applies and is a joint.
    fn pairs_guess(&self, problem: &Problem<'_>) -> Option<Point> {
        let structure = self.models[0].structure();
        let halves = structure.has_equal_halves();
        let model = match (structure.assembly, &self.settings.fit[..]) {
            (Assembly::Lap, [Parameter::Kt, Parameter::Kr]) if halves => PairsModel::Lap,
            (Assembly::Cantilever, [Parameter::Kt, Parameter::Kr]) => PairsModel::TwoParameter,
            (Assembly::Cantilever, [Parameter::Kt, Parameter::Kr, Parameter::Coupling]) => {
                PairsModel::ThreeParameter
            }
            _ => return None,
        };
        let lambdas = problem.measured_lambdas(&self.base);
        let data = problem.data.iter().zip(lambdas);
        let described = data.filter(|(datum, _)| datum.structure == 0);
        let modes: Vec<ModeLambda> = described
            .map(|(datum, lambda)| ModeLambda {
                mode: datum.mode,
                lambda,
            })
            .collect();
        let joint = estimate_pairs(model, &modes).ok()?.joint()?;
        joint.check().ok()?;
        let joint = joint.in_si(&structure.beam);
        let mut guess = self.base;
        guess[Parameter::Kt.index()] = joint.kt.ln();
        guess[Parameter::Kr.index()] = joint.kr.ln();
        guess[Parameter::Coupling.index()] = joint.coupling.atanh();
        let usable = guess[..3].iter().all(|coordinate| coordinate.is_finite());
        usable.then(|| within_bounds(guess))
    }

    /// Follows every start down roughly, keeps different minima, and finishes each by these settings.
    pub(super) fn minima(
        &self,
        problem: &Problem<'_>,
        starts: &[Point],
        settings: &Settings,
    ) -> Vec<Minimum> {
        let directions = self.directions();
        // A last step of 1e-4 leaves 1e-8: enough to tell minima apart, and half the work.
        let rough = Problem {
            last_step: 1e-4,
            ..problem.clone()
        };
        let mut found: Vec<Evaluation> = Vec::new();
        for start in starts {
            let guesses = problem.measured_lambdas(start);
            let end = rough.minimise(&within_bounds(*start), &guesses, &directions, &ROUGH);
            let new = end.filter(|end| !found.iter().any(|known| self.is_same(known, &end.state)));
            found.extend(new.map(|end| end.state));
        }
        let mut minima: Vec<Minimum> = Vec::new();
        for rough in found {
            let guesses = rough.guesses_at(&rough.point);
            let end = problem.minimise(&rough.point, &guesses, &directions, settings);
            let Some(end) = end else { continue };
            let known = (minima.iter_mut()).find(|known| self.is_same(&known.state, &end.state));
            match known {
                Some(known) if end.state.cost < known.state.cost => *known = end,
                Some(_) => {}
                None => minima.push(end),
            }
        }
        for minimum in &mut minima {
            self.follow_to_the_limit(problem, minimum);
        }
        minima.sort_by(|a, b| a.state.cost.total_cmp(&b.state.cost));
        minima
    }

    /// Returns true for two points that no free coordinate tells apart.
    fn is_same(&self, first: &Evaluation, second: &Evaluation) -> bool {
        self.free_parameters().all(|parameter| {
            let index = parameter.index();
            (first.point[index] - second.point[index]).abs() < SAME_MINIMUM
        })
    }

    /// Moves a stiffness that no frequency feels to its limit, unless the misfit there is larger than where the
    /// search ended.
    fn follow_to_the_limit(&self, problem: &Problem<'_>, minimum: &mut Minimum) {
        // Relative change of every frequency per relative change of the stiffness.
        const UNFELT: f64 = 1e-4;
        for parameter in [Parameter::Kt, Parameter::Kr] {
            let index = parameter.index();
            let responses = minimum.state.responses.iter();
            let felt = responses
                .map(|response| response.sensitivity[index].abs())
                .fold(0.0, f64::max);
            if felt > UNFELT || !self.settings.fit.contains(&parameter) {
                continue;
            }
            let free = self.directions();
            let others: Vec<Point> = free.into_iter().filter(|d| d[index] == 0.0).collect();
            for end in [-1e3, 1e3] {
                let mut point = minimum.state.point;
                point[index] += end;
                let point = within_bounds(point);
                let guesses = minimum.state.guesses_at(&point);
                let there = problem.minimise(&point, &guesses, &others, &MISFIT);
                if let Some(there) = there.filter(|there| there.state.cost <= minimum.state.cost) {
                    *minimum = there;
                }
            }
        }
    }
}
