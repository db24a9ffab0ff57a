//! Predictions of all observables under a hypothesis, with their slopes.

use crate::dataset::{Dataset, Observable, ObservableKind};
use crate::description::{free_slope, mass_slope, property_of};
use crate::joint_motion::{LEAST_STIFFNESS, StiffnessChanges};
use crate::modal_model::ModalModel;
use crate::mode_in_place::ModeInPlace;
use crate::optimum::Model;
use crate::parameters::{CandidateEffect, Layout, LocationKind, NuisanceParameter, Prior};
use crate::set_up::SetUp;
use crate::structure::{Arrangement, COUPLING, with_joint};
use nalgebra::DMatrix;
use std::sync::Arc;
use tapjoint_beam::effects::{Circumstances, EffectId, JointLaw, apply};
use tapjoint_beam::specimen::{BeamModes, Mesh, Specimen};
use tapjoint_identify::consistent::Parameter;
use tapjoint_identify::observation::effective_share;

/// Model of a dataset under one hypothesis.
pub struct Forward<'a> {
    /// The data.
    pub dataset: &'a Dataset,
    /// Order of the parameters.
    pub layout: Layout,
    /// Observables that are predicted: those of the fit, or held-out or planned ones.
    pub observables: &'a [Observable],
}

/// Intermediate results of a prediction, for its slopes.
pub struct Solution {
    models: Vec<ModalModel>,
    /// Predictions without the nuisance parameters.
    base: Vec<f64>,
    /// Slopes with respect to the nuisance parameters.
    slopes: DMatrix<f64>,
}

/// Modes of a structure, and its frequencies (Hz) if the modes are those of a structure next to it.
type SolvedModes = (Arc<BeamModes>, Option<Vec<f64>>);

impl Model for Forward<'_> {
    type Solution = Solution;

    fn predict(&self, parameters: &[f64], near: Option<&Solution>) -> Option<(Vec<f64>, Solution)> {
        let models = self.solve_by(parameters, |configuration, specimen| {
            let there = near.map(|near| &near.models[configuration].own);
            Some((self.modes_of(configuration, specimen, there)?, None))
        });
        self.predict_with(models?, parameters)
    }

    fn slopes(
        &self,
        parameters: &[f64],
        priors: &[Prior],
        solution: &Solution,
    ) -> Option<Arc<DMatrix<f64>>> {
        let Solution { models, base, .. } = solution;
        let mut slopes = solution.slopes.clone();
        let near = Some(&models[..]);
        self.set_joint_slopes(models, &mut slopes);
        if self.layout.has_set_up_error() {
            // Those of shapes at the nominal optimum are those of the described set-up.
            for column in 0..self.layout.joint.len() {
                let change = self.difference(parameters, column, WIDE_STEP, near, base)?;
                for (row, observable) in self.observables.iter().enumerate() {
                    if observable.is_shape() {
                        slopes[(row, column)] = change[row];
                    }
                }
            }
        }
        for index in 0..self.layout.effects.len() {
            for (column, step) in self.steps(index, parameters) {
                if !priors[column].is_held() {
                    let change = self.difference(parameters, column, step, near, base)?;
                    slopes.set_column(column, &change.into());
                }
            }
        }
        let nuisance = self.dataset.nuisance_index(NuisanceParameter::Amplitude);
        if let Some(k) = nuisance.filter(|_| self.amplitude_effect(parameters).is_some()) {
            let column = self.layout.first_nuisance() + k;
            if let Some(change) = self.difference(parameters, column, WIDE_STEP, near, base) {
                slopes.set_column(column, &change.into());
            }
        }
        Some(Arc::new(slopes))
    }
}

/// Step of the differences with respect to logarithms of stiffnesses and amplitudes.
const WIDE_STEP: f64 = 1e-2;

impl<'a> Forward<'a> {
    /// Returns the predictions with errors of the set-up, by modes that are already solved. Masses of the sensors stay
    /// at their old places. `None` where a mode is missing.
    pub fn predict_set_up(&self, parameters: &[f64], solved: &[ModalModel]) -> Option<Vec<f64>> {
        let arrangements = self.dataset.arrangements.iter();
        let models = solved.iter().zip(arrangements);
        let models = models.map(|(model, arrangement)| {
            let ModalModel {
                seen,
                own,
                frequencies,
                stiffness_changes,
                ..
            } = model.clone();
            let nuisances = &self.dataset.nuisances;
            let set_up = SetUp::new(arrangement, &self.layout, nuisances, parameters);
            ModalModel::new(seen, set_up, own, frequencies, stiffness_changes)
        });
        Some(self.predict_with(models.collect(), parameters)?.0)
    }

    /// Returns the predictions by the modal models of all configurations.
    fn predict_with(
        &self,
        models: Vec<ModalModel>,
        parameters: &[f64],
    ) -> Option<(Vec<f64>, Solution)> {
        let base = self.predictions_of(&models, parameters)?;
        let mut predicted = base.clone();
        let mut slopes = DMatrix::zeros(base.len(), parameters.len());
        let first = self.layout.first_nuisance();
        for (row, observable) in self.observables.iter().enumerate() {
            let (mode, configuration) = (observable.mode, observable.configuration);
            let setup = self.dataset.arrangements[configuration].setup;
            let place = ModeInPlace::new(self.dataset, &self.layout, observable, &models);
            for (column, nuisance) in (first..).zip(&self.dataset.nuisances) {
                let nuisance = nuisance.parameter;
                if !nuisance.can_move(mode, configuration, setup) {
                    continue;
                }
                let slope =
                    self.nuisance_slope(row, nuisance, &models, &place, base[row], parameters);
                slopes[(row, column)] = slope;
                // Some enter the solution itself.
                if !nuisance.is_solved() || observable.is_of_bar() {
                    predicted[row] += parameters[column] * slope;
                }
            }
        }
        let solution = Solution {
            models,
            base,
            slopes,
        };
        Some((predicted, solution))
    }

    /// Returns the model of the fitted observables with these effects.
    pub fn new(dataset: &'a Dataset, effects: &[CandidateEffect]) -> Self {
        Forward {
            dataset,
            layout: dataset.layout(effects),
            observables: &dataset.observables,
        }
    }

    /// Priors of all parameters, with the middle spread of the drift.
    pub fn priors(&self) -> Vec<Prior> {
        self.dataset.priors(&self.layout)
    }

    /// Returns the columns of one effect and the steps of their finite differences, away from the bounds. They are
    /// small against what data of 0.005 % leave open of a large effect (0.1 % of its size, 0.03 % of the length).
    fn steps(&self, index: usize, parameters: &[f64]) -> Vec<(usize, f64)> {
        let candidate = &self.layout.effects[index];
        let size = self.layout.size(index);
        let step = 1e-4 * candidate.size.scale.max(parameters[size].abs());
        let mut steps = vec![(size, step, candidate.size.high)];
        if let (Some(range), Some(location)) = (candidate.location, self.layout.location(index)) {
            let (low, high) = range.searched_bounds();
            steps.push((location, 5e-5 * (high - low), high));
        }
        let inward = steps.into_iter().map(|(column, step, high)| {
            let is_outside = parameters[column] + step > high;
            (column, if is_outside { -step } else { step })
        });
        inward.collect()
    }

    /// Returns the slopes of all predictions with respect to one parameter by a finite difference. Next to solved
    /// modal models the solution is that of a changed structure.
    fn difference(
        &self,
        parameters: &[f64],
        column: usize,
        step: f64,
        near: Option<&[ModalModel]>,
        base: &[f64],
    ) -> Option<Vec<f64>> {
        let mut moved = parameters.to_vec();
        moved[column] += step;
        let models = match near {
            Some(there) => self.solve_near(&moved, there)?,
            None => self.solve(&moved)?,
        };
        let new = self.predictions_of(&models, &moved)?;
        let pairs = new.iter().zip(base);
        Some(pairs.map(|(new, old)| (new - old) / step).collect())
    }

    /// Returns the slopes of all predictions with respect to the joint's parameters by finite differences.
    pub fn joint_differences(&self, parameters: &[f64]) -> Option<DMatrix<f64>> {
        let base = self.predictions_of(&self.solve(parameters)?, parameters)?;
        let mut slopes = DMatrix::zeros(self.observables.len(), self.layout.joint.len());
        for column in 0..self.layout.joint.len() {
            let change = self.difference(parameters, column, WIDE_STEP, None, &base)?;
            slopes.set_column(column, &change.into());
        }
        Some(slopes)
    }

    /// Returns the modal model of each configuration; equal structures are solved once.
    pub fn solve(&self, parameters: &[f64]) -> Option<Vec<ModalModel>> {
        self.solve_by(parameters, |configuration, specimen| {
            Some((self.modes_of(configuration, specimen, None)?, None))
        })
    }

    /// Returns the modal models next to a point that is solved. If only frequencies are predicted, Rayleigh's
    /// quotient gives their change.
    fn solve_near(&self, parameters: &[f64], there: &[ModalModel]) -> Option<Vec<ModalModel>> {
        // The beam alone has no part in the shapes.
        let mut vibrating = self.observables.iter().filter(|one| !one.is_of_bar());
        let frequencies_alone = vibrating.all(Observable::is_frequency);
        self.solve_by(parameters, |configuration, specimen| {
            let known = &there[configuration];
            if known.seen.specimen == *specimen {
                return Some((known.own.clone(), None));
            }
            // A kink that moves takes the shape with it.
            let kinks = specimen.hinges.iter().map(|hinge| hinge.position);
            let before = known.seen.specimen.hinges.iter();
            let shape_holds = kinks.eq(before.map(|hinge| hinge.position));
            if frequencies_alone
                && shape_holds
                && let Ok(all) = known.modes().rayleigh_frequencies(specimen)
            {
                return Some((known.own.clone(), Some(all)));
            }
            let near = known.own.perturbed(specimen).ok()?.map(Arc::new);
            let solved = near.or_else(|| self.modes_of(configuration, specimen, Some(&known.own)));
            Some((solved?, None))
        })
    }

    fn solve_by(
        &self,
        parameters: &[f64],
        modes_of: impl Fn(usize, &Specimen) -> Option<SolvedModes>,
    ) -> Option<Vec<ModalModel>> {
        let effects = self.layout.effects_at(parameters)?;
        let law = self.law(parameters);
        let mut all: Vec<ModalModel> = Vec::with_capacity(self.dataset.arrangements.len());
        for (configuration, arrangement) in self.dataset.arrangements.iter().enumerate() {
            let set_up = SetUp::new(
                arrangement,
                &self.layout,
                &self.dataset.nuisances,
                parameters,
            );
            let carried = set_up.carried(arrangement);
            let specimen = set_up.loaded(arrangement);
            let mut nominal = with_joint(&specimen, &self.layout.joint, parameters);
            self.set_properties(&mut nominal, parameters);
            let motion = arrangement.joint_motion.as_ref().zip(law.as_ref());
            let stiffness_changes = motion.map(|(motion, law)| motion.stiffness_changes(law));
            let circumstances = Circumstances {
                sensors: &carried,
                level: self.level(arrangement, stiffness_changes.as_ref(), parameters),
                ..Circumstances::default()
            };
            let mut seen = apply(&effects, &nominal, &circumstances);
            self.layout.add_foreign(parameters, &mut seen.specimen);
            keep_on_beam(&mut seen.specimen);
            let mut solved = all.iter();
            let (own, frequencies) = match solved.find(|one| one.seen.specimen == seen.specimen) {
                Some(other) => (other.own.clone(), other.frequencies.clone()),
                None => modes_of(configuration, &seen.specimen)?,
            };
            all.push(ModalModel::new(
                seen,
                set_up,
                own,
                frequencies,
                stiffness_changes,
            ));
        }
        Some(all)
    }

    /// Gives the beams the properties of the parameters. All places stay where they are.
    fn set_properties(&self, specimen: &mut Specimen, parameters: &[f64]) {
        let values = &parameters[self.layout.first_nuisance()..];
        for (nuisance, value) in self.dataset.nuisances.iter().zip(values) {
            if let NuisanceParameter::Property { property } = nuisance.parameter {
                for beam in specimen.body.beams_mut() {
                    if let Some(own) = property_of(beam, property) {
                        *own *= value.exp();
                    }
                }
            }
        }
    }

    /// Returns the modes of a configuration's structure, from those of a structure next to it.
    fn modes_of(
        &self,
        configuration: usize,
        specimen: &Specimen,
        near: Option<&Arc<BeamModes>>,
    ) -> Option<Arc<BeamModes>> {
        let Dataset {
            elements, modes, ..
        } = *self.dataset;
        let mesh = Mesh { elements };
        let found = match near.or_else(|| self.dataset.nominal_modes.get(configuration)) {
            Some(near) => specimen.beam_modes_from(near, modes, mesh),
            None => specimen.beam_modes(modes, mesh),
        };
        Some(Arc::new(found.ok()?))
    }

    /// Returns all predictions without the nuisance parameters.
    fn predictions_of(&self, models: &[ModalModel], parameters: &[f64]) -> Option<Vec<f64>> {
        let predictions = self.observables.iter().map(|observable| {
            let one = &models[observable.configuration];
            if observable.is_damping() {
                let damping = self.damping(observable.mode, models, parameters)?;
                return Some(damping.total.ln());
            }
            let place = ModeInPlace::new(self.dataset, &self.layout, observable, models)?;
            match observable.kind {
                ObservableKind::Frequency => {
                    let frequency = one.frequency(observable.mode)?;
                    let own = one.own_change(observable.mode);
                    (frequency > 0.0).then(|| frequency.ln() + own)
                }
                ObservableKind::Constant { sensor } => {
                    Some(place.at_sensor(sensor) * place.on_line(one.set_up.tap?))
                }
                ObservableKind::Ratio { sensor, reference } => {
                    Some(place.at_sensor(sensor) / place.at_sensor(reference))
                }
                // The bare beam knows of no effect but those of its material and section.
                ObservableKind::BeamMass | ObservableKind::FreeScale => {
                    Some(self.of_bar(observable.kind, one.seen.frequency_scale, parameters))
                }
                ObservableKind::Slope | ObservableKind::Damping => {
                    let law = self.law(parameters);
                    Some(law.map_or(0.0, |law| {
                        slope_along_decay(self.dataset, observable, models, &law)
                    }))
                }
            }
        });
        predictions.collect()
    }

    /// Sets the slopes with respect to the joint: see [`ModalModel::joint_slopes`]; those of shapes are taken
    /// at the nominal optimum.
    fn set_joint_slopes(&self, models: &[ModalModel], slopes: &mut DMatrix<f64>) {
        let mut all: Vec<Vec<Vec<f64>>> = Vec::with_capacity(models.len());
        for one in models {
            let mut before = models[..all.len()].iter();
            let known = before.position(|other| Arc::ptr_eq(&other.own, &one.own));
            let directions = self.layout.joint.iter();
            all.push(match known {
                Some(other) => all[other].clone(),
                None => directions.map(|k| one.joint_slopes(*k)).collect(),
            });
        }
        for (row, observable) in self.observables.iter().enumerate() {
            if observable.is_frequency() {
                let one = &models[observable.configuration];
                if let Some(index) = one.index(observable.mode) {
                    for (column, own) in all[observable.configuration].iter().enumerate() {
                        slopes[(row, column)] = own[index] * one.offset_factor(index);
                    }
                }
            } else if let Some(known) = &self.dataset.shape_slopes {
                for column in 0..self.layout.joint.len() {
                    slopes[(row, column)] = known[(row, column)];
                }
            }
        }
    }

    /// Returns the derivative of a prediction with respect to a nuisance parameter.
    fn nuisance_slope(
        &self,
        row: usize,
        nuisance: NuisanceParameter,
        models: &[ModalModel],
        place: &Option<ModeInPlace<'_>>,
        predicted: f64,
        parameters: &[f64],
    ) -> f64 {
        let observable = &self.observables[row];
        if observable.is_damping() {
            let tilt = match nuisance {
                NuisanceParameter::Damping => 1.0,
                NuisanceParameter::DampingTilt => self.dataset.tilt(observable.mode),
                _ => return 0.0,
            };
            let damping = self.damping(observable.mode, models, parameters);
            return damping.map_or(1.0, |damping| damping.nominal / damping.total) * tilt;
        }
        match (observable.kind, nuisance) {
            (ObservableKind::BeamMass, NuisanceParameter::Property { property }) => {
                let is_longer = self.dataset.nominal.uncertainty.is_longer;
                return match property {
                    Parameter::Length if is_longer => 0.0,
                    _ => mass_slope(property),
                };
            }
            (ObservableKind::FreeScale, NuisanceParameter::Property { property }) => {
                return free_slope(property);
            }
            _ => {}
        }
        let Some(place) = place else {
            return 0.0;
        };
        if let NuisanceParameter::Property { property } = nuisance
            && observable.is_shape()
        {
            return place.shape_slope(property, predicted, self.shape_slopes_by_joint(row));
        }
        match observable.kind {
            ObservableKind::Frequency => place.frequency_slope(nuisance, parameters),
            ObservableKind::Constant { sensor } => {
                place.constant_slope(sensor, nuisance, predicted)
            }
            ObservableKind::Ratio { sensor, reference } => {
                let towards = place.relative_slope(sensor, nuisance);
                predicted * (towards - place.relative_slope(reference, nuisance))
            }
            ObservableKind::Slope
            | ObservableKind::Damping
            | ObservableKind::BeamMass
            | ObservableKind::FreeScale => 0.0,
        }
    }

    /// Returns the slopes of a shape with respect to the logarithms of the joint's stiffnesses, at the nominal optimum.
    fn shape_slopes_by_joint(&self, row: usize) -> [f64; 2] {
        let mut slopes = [0.0; 2];
        if let Some(known) = &self.dataset.shape_slopes
            && row < known.nrows()
        {
            for (column, direction) in self.layout.joint.iter().enumerate() {
                if *direction != COUPLING {
                    slopes[*direction] = known[(row, column)];
                }
            }
        }
        slopes
    }

    /// Returns the logarithm of the mass, or of the free frequencies, of the bar over the nominal ones.
    fn of_bar(&self, kind: ObservableKind, frequency_scale: f64, parameters: &[f64]) -> f64 {
        let known = &self.dataset.nominal.uncertainty;
        let slope = match kind {
            ObservableKind::BeamMass => mass_slope,
            _ => free_slope,
        };
        let mut log = 0.0;
        for (effect, property) in [
            (EffectId::Modulus, Parameter::Modulus),
            (EffectId::Density, Parameter::Density),
            (EffectId::Thickness, Parameter::Thickness),
            (EffectId::Length, Parameter::Length),
        ] {
            // A longer bar has a length of its own.
            if property != Parameter::Length || !known.is_longer {
                log += slope(property) * self.layout.size_of(effect, parameters).ln_1p();
            }
        }
        if kind == ObservableKind::FreeScale && known.has_same_clock {
            log += frequency_scale.ln();
        }
        log
    }

    /// Returns the damping ratio of a mode: the nominal one, a level times a power of the frequency, and eta/2 times the
    /// joint's share of the strain energy.
    fn damping(&self, mode: usize, all: &[ModalModel], parameters: &[f64]) -> Option<DampingRatio> {
        let first = self.layout.first_nuisance();
        let level = self.dataset.nuisance_index(NuisanceParameter::Damping)?;
        let tilt = self
            .dataset
            .nuisance_index(NuisanceParameter::DampingTilt)?;
        let rise = parameters[first + tilt] * self.dataset.tilt(mode);
        let nominal = (parameters[first + level] + rise).exp();
        let one = all.first()?;
        let shares = one.joint_shares(one.index(mode)?);
        // The loss factor of a joint that slips, as the mode feels it on average over the configurations: in the
        // share of the strain energy of the spring that has softened, 1 + change.
        let law = self.law(parameters);
        let share = law.map_or(0.0, |law| law.loss_over_change());
        let changes = all.iter().map(|one| one.stiffness_changes.as_ref());
        let changes = changes.filter_map(|changes| changes?.of(mode));
        let (sum, count) = changes.fold((0.0, 0), |(sum, n), one| (sum + one, n + 1));
        let change = sum / f64::from(count.max(1));
        let slip = -share * change / (1.0 + change).max(LEAST_STIFFNESS) * shares[1];
        let lost = one.seen.joint_loss_factor * (shares[0] + shares[1]) + slip;
        Some(DampingRatio {
            total: nominal + 0.5 * lost.max(0.0),
            nominal,
        })
    }

    /// Returns the joint's law at the amplitudes that the parameters give it, where that is a hypothesis.
    fn law(&self, parameters: &[f64]) -> Option<JointLaw> {
        let JointLaw { ratio, exponent } = self.amplitude_effect(parameters)?;
        // The amplitude is known but for a factor, which all recordings share.
        let ratio = ratio * self.amplitude_factor(parameters).powf(exponent);
        Some(JointLaw { ratio, exponent })
    }

    /// Returns the relative amplitude at which the structure of a configuration is solved: the joint then has the mean
    /// stiffness that its modes feel.
    fn level(
        &self,
        arrangement: &Arrangement,
        changes: Option<&StiffnessChanges>,
        parameters: &[f64],
    ) -> f64 {
        let Some(JointLaw { ratio, exponent }) = self.amplitude_effect(parameters) else {
            return 1.0;
        };
        match changes {
            // ratio level^p = mean change, of the same sign.
            Some(changes) if ratio != 0.0 => (changes.mean / ratio).powf(exponent.recip()),
            Some(_) => 0.0,
            None => {
                let factor = self.amplitude_factor(parameters);
                factor * arrangement.level * effective_share(exponent)
            }
        }
    }

    fn amplitude_factor(&self, parameters: &[f64]) -> f64 {
        let index = self.dataset.nuisance_index(NuisanceParameter::Amplitude);
        index.map_or(1.0, |k| parameters[self.layout.first_nuisance() + k].exp())
    }

    /// Returns the joint's law by the size and exponent of the effect, where that is a hypothesis.
    fn amplitude_effect(&self, parameters: &[f64]) -> Option<JointLaw> {
        let location = self.layout.location_of_kind(LocationKind::Exponent)?;
        Some(JointLaw {
            ratio: parameters[location - 1],
            exponent: parameters[location],
        })
    }
}

/// Keeps what sits at the end of a beam on it, where the beam is shorter than described.
fn keep_on_beam(specimen: &mut Specimen) {
    let length = specimen.body.length();
    let masses = specimen.masses.iter_mut().map(|one| &mut one.position);
    let springs = specimen.springs.iter_mut().map(|one| &mut one.position);
    let hinges = specimen.hinges.iter_mut().map(|one| &mut one.position);
    for position in masses.chain(springs).chain(hinges) {
        *position = position.min(length);
    }
}

/// Damping ratio of a mode.
struct DampingRatio {
    /// With the losses in the joint.
    total: f64,
    /// Without the losses in the joint.
    nominal: f64,
}

/// Returns d ln f/d ln a = S_i d ln kr/d ln a of an observable's mode, with its sensitivity S_i = d ln f_i/d ln kr,
/// averaged over the followed part of the decay.
pub fn slope_along_decay(
    dataset: &Dataset,
    observable: &Observable,
    models: &[ModalModel],
    law: &JointLaw,
) -> f64 {
    let arrangement = &dataset.arrangements[observable.configuration];
    let model = &models[observable.configuration];
    model.index(observable.mode).map_or(0.0, |index| {
        model.rotation_sensitivity(index) * arrangement.stiffness_slope(observable.mode, law)
    })
}
