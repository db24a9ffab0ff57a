//! The data that are compared with predictions, their uncertainties, and the nuisance parameters that every
//! hypothesis shares.
//!
//! A standard deviation from five taps is itself known to a third. The data of one kind share their common
//! value (Smyth 2004, "Linear models and empirical Bayes methods", section 6.2): their
//! variances are taken as draws from a scaled inverse chi-square distribution whose own two parameters
//! are estimated from all of them, and each is moved towards the common value as far as its repeats allow.
//! The remaining uncertainty makes the likelihood a Student t one, never a Gaussian.

use crate::description::{PROPERTIES, SectionSlopes};
use crate::observations::{
    UnpairedPeaks, average_std, constant_model_std, highest_mode, split_pole, up_to,
};
use crate::parameters::{CandidateEffect, Layout, Nuisance, NuisanceParameter, Prior};
use crate::settings::GapSettings;
use crate::structure::{Arrangement, COUPLING, ELEMENTS, Inventory, Nominal};
use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use statrs::function::gamma::{digamma, ln_gamma};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use tapjoint_beam::WidthStiffening;
use tapjoint_beam::specimen::BeamModes;
use tapjoint_identify::consistent::WIDTH_HOLD_STD;
use tapjoint_identify::observation::{
    Configuration, DecayVerdict, Observations, Observed, ObservedMode,
};
use tapjoint_numerics::stats::{self, root_mean_square};

/// Quantity that is observed and predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Observable {
    /// Kind of quantity.
    pub kind: ObservableKind,
    /// Index of its configuration; 0 for a damping ratio, which belongs to all configurations together.
    pub configuration: usize,
    /// Number of its mode.
    pub mode: usize,
}

/// Kind of an observable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ObservableKind {
    /// Logarithm of a natural frequency.
    Frequency,
    /// Modal constant at a sensor and the tap (1/kg).
    Constant { sensor: usize },
    /// Shape at a sensor over that at the reference sensor (1).
    Ratio { sensor: usize, reference: usize },
    /// Logarithm of a damping ratio.
    Damping,
    /// Change of the logarithm of a frequency per e-fold of the amplitude along the decay (1).
    Slope,
    /// Logarithm of the beam's mass by a balance over the described one.
    BeamMass,
    /// Logarithm of the free beam's frequencies over the described ones.
    FreeScale,
}

impl Observable {
    /// Returns a natural frequency.
    pub fn frequency(configuration: usize, mode: usize) -> Self {
        Observable {
            kind: ObservableKind::Frequency,
            configuration,
            mode,
        }
    }

    /// Returns whether it is a natural frequency.
    pub fn is_frequency(&self) -> bool {
        self.kind == ObservableKind::Frequency
    }

    /// Returns whether it is a change along the decay.
    pub fn is_slope(&self) -> bool {
        self.kind == ObservableKind::Slope
    }

    /// Returns whether it is a damping ratio.
    pub fn is_damping(&self) -> bool {
        self.kind == ObservableKind::Damping
    }

    /// Returns whether it is measured of the bar alone.
    pub fn is_of_bar(&self) -> bool {
        matches!(
            self.kind,
            ObservableKind::BeamMass | ObservableKind::FreeScale
        )
    }

    /// Returns whether it is a modal constant or a ratio of a shape.
    pub fn is_shape(&self) -> bool {
        matches!(
            self.kind,
            ObservableKind::Constant { .. } | ObservableKind::Ratio { .. }
        )
    }
}

/// Measured value with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Datum {
    /// Value.
    pub value: f64,
    /// Standard uncertainty (unit of the value).
    pub std: f64,
    /// Degrees of freedom of that uncertainty: taps less one, infinite where it is stated and not
    /// estimated.
    pub freedom: f64,
}

/// Degrees of freedom beyond which Student's t is taken as the normal distribution: their tails
/// differ by less than 1 % at five standard deviations.
const NORMAL_FREEDOM: f64 = 2000.0;

impl Datum {
    /// Returns the datum of an observed value.
    fn new(value: f64, std: f64, freedom: Option<f64>) -> Self {
        Datum {
            value,
            std,
            freedom: freedom.unwrap_or(f64::INFINITY),
        }
    }

    /// Returns (value - predicted)/std.
    pub fn residual(&self, predicted: f64) -> f64 {
        (self.value - predicted) / self.std
    }

    /// Adds a standard uncertainty that is known, not estimated: the degrees of freedom grow with its share
    /// (Welch & Satterthwaite).
    pub fn inflate_std(&mut self, known: f64) {
        let wider = self.std.hypot(known);
        if wider > self.std {
            self.freedom *= (wider / self.std).powi(4);
            self.std = wider;
        }
    }

    /// Returns the logarithm of Student's t density of a residual (in standard deviations) over its value at 0.
    pub fn log_density_drop(&self, residual: f64) -> f64 {
        if self.freedom >= NORMAL_FREEDOM {
            return -0.5 * residual * residual;
        }
        -0.5 * stats::student::loss(residual, self.freedom)
    }

    /// Returns the logarithm of the density at residual 0.
    pub fn log_density_peak(&self) -> f64 {
        let shape = if self.freedom >= NORMAL_FREEDOM {
            -0.5 * (2.0 * std::f64::consts::PI).ln()
        } else {
            ln_gamma(0.5 * (self.freedom + 1.0))
                - ln_gamma(0.5 * self.freedom)
                - 0.5 * (self.freedom * std::f64::consts::PI).ln()
        };
        shape - self.std.ln()
    }

    /// Returns the weight of a residual in iteratively reweighted least squares, (n + 1)/(n + r^2).
    pub fn weight(&self, residual: f64) -> f64 {
        if self.freedom >= NORMAL_FREEDOM {
            return 1.0;
        }
        stats::student::weight(residual, self.freedom)
    }

    /// Returns the square of the normal deviate that is as improbable as this residual under Student's t.
    pub fn gaussian_square(&self, residual: f64) -> f64 {
        if self.freedom >= NORMAL_FREEDOM {
            return residual * residual;
        }
        let student = StudentsT::new(0.0, 1.0, self.freedom);
        let (Ok(student), Ok(normal)) = (student, Normal::new(0.0, 1.0)) else {
            return residual * residual;
        };
        // Beyond 1e-14 the tail is no longer resolved: it is 7.7 standard deviations.
        let tail = student.cdf(-residual.abs()).clamp(1e-14, 0.5);
        normal.inverse_cdf(tail).powi(2)
    }
}

/// Moves the standard deviations of data of one kind towards their common value; those
/// without degrees of freedom of their own (stated ones) stay.
///
/// `std` and `freedom` of each datum are replaced; `std` must be relative to a scale on which the
/// data can be compared.
fn moderate(data: &mut [Datum]) {
    let estimated: Vec<Datum> = (data.iter().copied())
        .filter(|datum| datum.freedom < NORMAL_FREEDOM && datum.std > 0.0)
        .collect();
    // Two variances do not show how variances scatter.
    if estimated.len() < 3 {
        return;
    }
    // E ln(chi2_n / n) = psi(n/2) - ln(n/2): the rest of ln s^2 is ln sigma^2 and its scatter.
    let logs: Vec<f64> = estimated
        .iter()
        .map(|r| (r.std * r.std).ln() - digamma(0.5 * r.freedom) + (0.5 * r.freedom).ln())
        .collect();
    let count = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / count;
    let scatter = logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let by_chance = estimated.iter().map(|r| trigamma(0.5 * r.freedom));
    let chance = by_chance.sum::<f64>() / count;
    let common_freedom = if scatter > chance {
        // The x > 0 with psi'(x) = scatter - chance, by bisection in ln x: psi' falls from infinity to 0.
        let (mut low, mut high) = (1e-4_f64.ln(), 1e4_f64.ln());
        for _ in 0..80 {
            let middle: f64 = 0.5 * (low + high);
            if trigamma(middle.exp()) > scatter - chance {
                low = middle;
            } else {
                high = middle;
            }
        }
        2.0 * (0.5 * (low + high)).exp()
    } else {
        // No more scatter than chance: one variance for all, known as well as all together know it.
        estimated.iter().map(|r| r.freedom).sum::<f64>()
    };
    let common = (mean + digamma(0.5 * common_freedom) - (0.5 * common_freedom).ln()).exp();
    for datum in data {
        if datum.freedom < NORMAL_FREEDOM {
            let total = common_freedom + datum.freedom;
            let own = datum.freedom * datum.std * datum.std;
            datum.std = ((common_freedom * common + own) / total).sqrt();
            datum.freedom = total;
        }
    }
}

/// Returns the probability that chi square exceeds a value; `None` without a degree of freedom.
pub fn chi_square_tail(value: f64, freedom: f64) -> Option<f64> {
    let is_known = freedom >= 0.5 && value.is_finite();
    is_known.then(|| stats::chi_square_tail(value.max(0.0), freedom))
}

/// Returns psi'(x) by recurrence to x > 6 and the asymptotic series (Abramowitz & Stegun 6.4.12).
fn trigamma(mut x: f64) -> f64 {
    let mut sum = 0.0;
    while x < 6.0 {
        sum += 1.0 / (x * x);
        x += 1.0;
    }
    let y = 1.0 / (x * x);
    sum + 0.5 * y + (1.0 + y * (1.0 / 6.0 - y * (1.0 / 30.0 - y / 42.0))) / x
}

/// Data of a test, with its arrangements and nuisance parameters.
#[derive(Debug, Clone)]
pub struct Dataset {
    /// The described structure.
    pub nominal: Nominal,
    /// One for each configuration.
    pub arrangements: Vec<Arrangement>,
    /// Their sensors, masses and places of the hammer, each once.
    pub inventory: Inventory,
    /// Observables that are fitted.
    pub observables: Vec<Observable>,
    /// Their data.
    pub data: Vec<Datum>,
    /// Nuisance parameters with their priors.
    pub nuisances: Vec<Nuisance>,
    /// Number of modes that are solved for.
    pub modes: usize,
    /// Number of elements of the structure.
    pub elements: usize,
    /// Settings of the diagnosis.
    pub settings: GapSettings,
    /// Modes above this one are held out.
    pub fitted_modes: usize,
    /// Frequencies that take no part in the fit, and test it.
    pub holdout: Vec<(Observable, Datum)>,
    /// Frequencies that take no part in anything but the closure.
    pub spare: Vec<(Observable, Datum)>,
    /// Change of a frequency's logarithm for one standard deviation of the taps' common scatter, by configuration and
    /// mode.
    pub scatter: BTreeMap<(usize, usize), f64>,
    /// Slopes with respect to what changes along the section.
    pub section: SectionSlopes,
    /// Slopes of all observables but frequencies with respect to the joint's stiffnesses, at the
    /// nominal optimum: shapes depend little on the joint.
    pub shape_slopes: Option<DMatrix<f64>>,
    /// Logarithm of the frequency of each mode with a damping ratio over their geometric mean.
    pub tilts: BTreeMap<usize, f64>,
    /// Modes of each configuration's structure at the nominal optimum: those of other structures are sought from them.
    pub nominal_modes: Vec<Arc<BeamModes>>,
    /// Peaks of no mode.
    pub peaks: UnpairedPeaks,
}

/// Least uncertainty of a modal constant or ratio over the root mean square of its kind (1): 1 %, the effect of
/// modes beyond the model and of real beams.
const SHAPE_FLOOR: f64 = 0.01;
/// Least uncertainty of a change along the decay, in relative frequency per e-fold: the bias of the fits.
const SLOPE_FLOOR: f64 = 5e-6;
/// Standard deviation of the logarithm of the joint's amplitude about the one that follows from the sensors' amplitudes
/// and the shapes: the largest rotation under the hammer is not measured, nor all modes that share in it.
const AMPLITUDE_STD: f64 = 0.25;

/// Number of modes that a next test may add.
pub const MORE_MODES: usize = 2;

/// Standard deviation of a size during the search, over its scale. It is wide: only 3 % of the size's own prior lie
/// beyond. The evidence takes that prior instead.
const SIZE_REACH: f64 = 20.0;

/// Spread of the coupling of a joint that has one: anything between -1 and 1 (2 standard deviations).
const COUPLING_STD: f64 = 0.5;

impl Dataset {
    /// Takes the data from observations in which every sensor with a mass has a position.
    pub fn new(observations: &Observations, nominal: &Nominal, settings: &GapSettings) -> Self {
        let highest = highest_mode(observations).min(settings.highest_mode);
        let observations = &up_to(highest, observations);
        let thresholds = &settings.thresholds;
        let spared = if highest >= thresholds.spare_modes_from {
            thresholds.spared_modes
        } else {
            0
        };
        let tested = highest.saturating_sub(spared);
        let held_out = if tested >= thresholds.withhold_from {
            thresholds.withheld_modes
        } else {
            0
        };
        let mut inventory = Inventory::default();
        let configurations = observations.configurations.iter().enumerate();
        let arrangements = configurations
            .map(|(index, one)| Arrangement::new(index, one, nominal, &mut inventory, thresholds))
            .collect();
        let mut dataset = Dataset {
            nominal: nominal.clone(),
            arrangements,
            inventory,
            observables: Vec::new(),
            data: Vec::new(),
            nuisances: Vec::new(),
            modes: highest,
            elements: ELEMENTS,
            settings: settings.clone(),
            fitted_modes: tested.saturating_sub(held_out),
            holdout: Vec::new(),
            spare: Vec::new(),
            scatter: BTreeMap::new(),
            section: SectionSlopes::default(),
            shape_slopes: None,
            nominal_modes: Vec::new(),
            tilts: BTreeMap::new(),
            peaks: UnpairedPeaks::new(observations, thresholds),
        };
        dataset.add_frequencies(observations, tested);
        dataset.add_shapes(observations);
        dataset.add_damping(observations);
        dataset.add_slopes(observations);
        dataset.add_checks();
        dataset.add_nuisances();
        dataset
    }

    fn push(&mut self, observable: Observable, datum: Datum) {
        self.observables.push(observable);
        self.data.push(datum);
    }

    fn add_frequencies(&mut self, observations: &Observations, tested: usize) {
        let mut observed: Vec<(usize, &ObservedMode)> = Vec::new();
        let mut data = Vec::new();
        for (configuration, one) in observations.configurations.iter().enumerate() {
            for mode in &one.modes {
                if let Some(std) = mode.std.filter(|std| *std > 0.0) {
                    observed.push((configuration, mode));
                    let std = std / mode.frequency;
                    data.push(Datum::new(mode.frequency.ln(), std, mode.freedom));
                }
            }
        }
        moderate(&mut data);
        for ((configuration, observed), mut datum) in observed.into_iter().zip(data) {
            let (one, mode) = (&observations.configurations[configuration], observed.mode);
            // Share of the scatter that the configuration has in common; none for held-out modes.
            let shares = &self.arrangements[configuration].scatter;
            let share = shares.get(&mode).filter(|_| mode <= self.fitted_modes);
            let share = share.filter(|share| **share != 0.0);
            if let Some(&share) = share {
                // The common part is a nuisance parameter of its own.
                let moved = share * datum.std;
                self.scatter.insert((configuration, mode), moved);
                datum.std *= (1.0 - share * share).max(0.0).sqrt();
            }
            // The common part of a recording is far below the floor: as good as independent.
            datum.inflate_std(self.settings.frequency_floor.hypot(one.common));
            // Anywhere between the poles of a decay that was split, on either side of this one.
            let split = split_pole(one, observed, &self.settings.thresholds);
            let split = split.unwrap_or(0.0) / 3.0_f64.sqrt();
            datum.inflate_std(split.hypot(average_std(observed)));
            let observable = Observable::frequency(configuration, mode);
            if mode > tested {
                self.spare.push((observable, datum));
            } else if mode > self.fitted_modes {
                self.holdout.push((observable, datum));
            } else {
                self.push(observable, datum);
            }
        }
    }

    fn add_shapes(&mut self, observations: &Observations) {
        let mut constants: Vec<(Observable, Datum)> = Vec::new();
        let mut ratios: Vec<(Observable, Datum)> = Vec::new();
        for (configuration, one) in observations.configurations.iter().enumerate() {
            let modes = one.modes.iter();
            for observed in modes.filter(|mode| mode.mode <= self.fitted_modes) {
                let own = Observable::frequency(configuration, observed.mode);
                let Some(reference) = observed.reference.filter(|&sensor| is_placed(one, sensor))
                else {
                    continue;
                };
                if split_pole(one, observed, &self.settings.thresholds).is_some() {
                    continue;
                }
                if let (Some(constant), Some(_)) = (observed.constant, one.tap) {
                    let mut datum = Datum::new(constant.value, constant.std, constant.freedom);
                    datum.inflate_std(constant.value * constant_model_std(observed));
                    let kind = ObservableKind::Constant { sensor: reference };
                    constants.push((Observable { kind, ..own }, datum));
                }
                for value in &observed.shape {
                    let sensor = value.sensor;
                    if sensor != reference && is_placed(one, sensor) && value.std > 0.0 {
                        let kind = ObservableKind::Ratio { sensor, reference };
                        let datum = Datum::new(value.value, value.std, observed.freedom);
                        ratios.push((Observable { kind, ..own }, datum));
                    }
                }
            }
        }
        for kind in [constants, ratios] {
            let values: Vec<f64> = kind.iter().map(|(_, datum)| datum.value).collect();
            let floor = SHAPE_FLOOR * root_mean_square(&values);
            for (observable, mut datum) in kind {
                datum.inflate_std(floor);
                self.push(observable, datum);
            }
        }
    }

    /// Adds one damping ratio for each mode: the weighted mean of all configurations, since only
    /// noise and level distinguish them.
    fn add_damping(&mut self, observations: &Observations) {
        for mode in 1..=self.fitted_modes {
            let configurations = observations.configurations.iter();
            let observed: Vec<&ObservedMode> =
                configurations.filter_map(|one| one.mode(mode)).collect();
            let (mut weights, mut sum) = (0.0, 0.0);
            for damping in observed.iter().filter_map(|mode| mode.damping) {
                if damping.value > 0.0 && damping.std > 0.0 {
                    let weight = (damping.value / damping.std).powi(2);
                    weights += weight;
                    sum += weight * damping.value.ln();
                }
            }
            if weights > 0.0 {
                let std = weights.powf(-0.5).hypot(self.settings.damping_scatter);
                let datum = Datum::new(sum / weights, std, None);
                let kind = ObservableKind::Damping;
                let own = Observable::frequency(0, mode);
                self.push(Observable { kind, ..own }, datum);
                self.tilts.insert(mode, observed[0].frequency.ln());
            }
        }
        let mean = self.tilts.values().sum::<f64>() / self.tilts.len() as f64;
        for tilt in self.tilts.values_mut() {
            *tilt -= mean;
        }
    }

    /// Adds the changes of the frequencies along the decays.
    fn add_slopes(&mut self, observations: &Observations) {
        for (configuration, one) in observations.configurations.iter().enumerate() {
            for mode in &one.modes {
                let decay = mode.decay.filter(|_| mode.mode <= self.fitted_modes);
                let decay = decay.filter(|decay| decay.verdict != DecayVerdict::Doubtful);
                let Some(decay) = decay else { continue };
                // Between the ends of the followed decay, where their amplitudes are known.
                let ends = decay.early.amplitude.zip(decay.late.amplitude);
                let ratio = self.settings.thresholds.distinct_amplitudes;
                let ends = ends.filter(|(early, late)| *early > ratio * late && *late > 0.0);
                let followed = decay.frequency_change.zip(ends);
                let (seen, folds) = followed
                    .map_or((decay.frequency_slope, 1.0), |(change, (early, late))| {
                        (change, (early / late).ln())
                    });
                let [value, std] = [seen.value, seen.std].map(|part| part / mode.frequency / folds);
                if std.is_finite() && std > 0.0 {
                    let mut datum = Datum::new(value, std, seen.freedom);
                    datum.freedom = datum.freedom.max(3.0);
                    datum.inflate_std(SLOPE_FLOOR);
                    let kind = ObservableKind::Slope;
                    let own = Observable::frequency(configuration, mode.mode);
                    self.push(Observable { kind, ..own }, datum);
                }
            }
        }
    }

    /// Adds what a balance and a free test say of the beam.
    fn add_checks(&mut self) {
        let known = &self.nominal.uncertainty;
        let checks = [
            (ObservableKind::BeamMass, known.weighed),
            (ObservableKind::FreeScale, known.free_scale),
        ];
        for (kind, check) in checks {
            if let Some(Observed {
                value,
                std,
                freedom,
            }) = check
            {
                let observable = Observable {
                    kind,
                    ..Observable::frequency(0, 1)
                };
                self.push(observable, Datum::new(value, std, freedom));
            }
        }
    }

    /// Adds a nuisance parameter, unless it is known exactly.
    pub fn add_nuisance(&mut self, parameter: NuisanceParameter, centre: f64, std: f64) {
        if std > 0.0 {
            self.nuisances.push(Nuisance {
                parameter,
                centre,
                std,
            });
        }
    }

    /// Adds the uncertain properties of the beam, and what the model misses of each mode.
    fn add_description(&mut self) {
        use NuisanceParameter::{Discrepancy, Poisson, Property, Shear, WidthHold};
        let tolerances = self.nominal.uncertainty.beam;
        for property in PROPERTIES {
            let std = tolerances.of(property).unwrap_or(0.0);
            self.add_nuisance(Property { property }, 0.0, std);
        }
        let specimen = &self.nominal.specimen;
        let is_stiffened = specimen.width_stiffening != WidthStiffening::Ignored;
        if specimen.shear_rotary > 0.0 {
            self.add_nuisance(Shear, 0.0, self.settings.shear_std);
        }
        if let Some(poisson) = tolerances.poisson.filter(|_| is_stiffened) {
            self.add_nuisance(Poisson, 0.0, poisson);
            if self.nominal.has_joint() {
                self.add_nuisance(WidthHold, 0.0, WIDTH_HOLD_STD);
            }
        }
        for mode in 1..=self.modes + MORE_MODES {
            self.add_nuisance(Discrepancy { mode }, 0.0, self.settings.discrepancy);
        }
    }

    fn add_nuisances(&mut self) {
        use NuisanceParameter::{
            AddedInertia, Amplitude, Damping, DampingTilt, Drift, Gain, Scatter, SensorInertia,
            SensorMass, SensorPosition, TapPosition, Temperature,
        };
        let inventory = self.inventory.clone();
        let setups = self.setups();
        let position_std = self.nominal.uncertainty.positions;
        self.add_description();
        // The joint's stiffness and the temperature differ between set-ups.
        for &setup in setups.iter().filter(|_| setups.len() > 1) {
            for direction in self.nominal.fitted_springs() {
                let drift = self.settings.drift_stds[0];
                self.add_nuisance(Drift { setup, direction }, 0.0, drift);
            }
            self.add_nuisance(Temperature { setup }, 0.0, self.settings.temperature_std);
        }
        for configuration in 0..self.arrangements.len() {
            if !self.arrangements[configuration].scatter.is_empty() {
                self.add_nuisance(Scatter { configuration }, 0.0, 1.0);
            }
        }
        for (name, text) in inventory.names.iter().enumerate() {
            if self.nominal.mass_of(text) > 0.0 {
                self.add_nuisance(SensorMass { name }, 0.0, self.nominal.uncertainty.masses);
            }
            self.add_nuisance(SensorInertia { name }, 0.0, 1.0);
        }
        self.add_nuisance(AddedInertia, 0.0, 1.0);
        // Shapes and modal constants depend on positions of sensors and of the taps, and on calibrations.
        for position in 0..inventory.positions.len() {
            self.add_nuisance(SensorPosition { position }, 0.0, position_std);
        }
        let mut shapes = self.observables.iter().filter(|one| one.is_shape());
        let has_shapes = shapes.clone().next().is_some();
        if shapes.any(|one| matches!(one.kind, ObservableKind::Constant { .. })) {
            for &setup in &setups {
                self.add_nuisance(TapPosition { setup }, 0.0, position_std);
            }
        }
        for &setup in setups.iter().filter(|_| has_shapes) {
            for name in 0..inventory.names.len() {
                self.add_nuisance(Gain { setup, name }, 0.0, self.settings.gain_std);
            }
        }
        // Level and tilt of the nominal damping ratios, where any was observed.
        let data = self.observables.iter().zip(&self.data);
        let data = data.filter(|(observable, _)| observable.is_damping());
        let logs: Vec<f64> = data.map(|(_, datum)| datum.value).collect();
        if !logs.is_empty() {
            // Wide: the damping of a beam is not known beforehand.
            let mean = logs.iter().sum::<f64>() / logs.len() as f64;
            self.add_nuisance(Damping, mean, 2.0);
            self.add_nuisance(DampingTilt, 0.0, self.settings.damping_tilt);
        }
        self.add_nuisance(Amplitude, 0.0, AMPLITUDE_STD);
        for fastened in 0..inventory.fastened.len() {
            self.add_fastened(fastened);
        }
    }

    /// Adds the mass and the position of a known added mass.
    pub fn add_fastened(&mut self, fastened: usize) {
        let known = self.nominal.uncertainty;
        self.add_nuisance(
            NuisanceParameter::FastenedMass { fastened },
            0.0,
            known.masses,
        );
        let parameter = NuisanceParameter::FastenedPosition { fastened };
        self.add_nuisance(parameter, 0.0, known.positions);
    }

    /// Returns whether there are modal constants, and whether there are ratios of shapes.
    pub fn kinds_of_shapes(&self) -> [bool; 2] {
        let kinds = self.observables.iter().map(|one| one.kind);
        [
            kinds
                .clone()
                .any(|kind| matches!(kind, ObservableKind::Constant { .. })),
            kinds
                .clone()
                .any(|kind| matches!(kind, ObservableKind::Ratio { .. })),
        ]
    }

    /// Numbers of the set-ups, ascending.
    pub fn setups(&self) -> Vec<usize> {
        let setups = self.arrangements.iter().map(|one| one.setup);
        setups.collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// Returns the logarithm of a mode's frequency over the geometric mean of all that have a damping ratio; 0 for others.
    pub fn tilt(&self, mode: usize) -> f64 {
        self.tilts.get(&mode).copied().unwrap_or(0.0)
    }

    /// Returns the change of a frequency for one standard deviation of the taps' common scatter (logarithm).
    pub fn scatter_of(&self, configuration: usize, mode: usize) -> f64 {
        let own = self.scatter.get(&(configuration, mode));
        own.copied().unwrap_or(0.0)
    }

    /// Index of a nuisance parameter, if the data have it.
    pub fn nuisance_index(&self, parameter: NuisanceParameter) -> Option<usize> {
        let mut all = self.nuisances.iter();
        all.position(|one| one.parameter == parameter)
    }

    /// Index of the first drift of the joint, if there are several set-ups.
    pub fn first_drift(&self) -> Option<usize> {
        self.nuisances
            .iter()
            .position(|one| one.parameter.is_drift())
    }

    /// Indices of the natural frequencies among the observables.
    pub fn frequencies(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.observables.len()).filter(|&row| self.observables[row].is_frequency())
    }

    /// Indices of the changes along the decays among the observables.
    pub fn slopes(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.observables.len()).filter(|&row| self.observables[row].is_slope())
    }

    /// Order of the parameters of a hypothesis with these effects.
    pub fn layout(&self, effects: &[CandidateEffect]) -> Layout {
        Layout::new(&self.nominal, effects)
    }

    /// Returns the priors of all parameters, with the middle spread of the drift, with which a search begins.
    pub fn priors(&self, layout: &Layout) -> Vec<Prior> {
        let mut all = Vec::new();
        let std = self.settings.joint_std;
        for (direction, start) in self.nominal.joint_parameters() {
            all.push(match direction {
                COUPLING => Prior {
                    low: -0.95,
                    high: 0.95,
                    ..Prior::normal(0.0, COUPLING_STD)
                },
                // Beyond these bounds a beam's frequencies no longer feel the joint.
                _ => Prior {
                    low: start.ln() - 8.0 * std,
                    high: start.ln() + 8.0 * std,
                    ..Prior::normal(start.ln(), std)
                },
            });
        }
        for effect in &layout.effects {
            all.push(Prior {
                low: effect.size.low,
                high: effect.size.high,
                ..Prior::normal(effect.size.neutral, SIZE_REACH * effect.size.scale)
            });
            if let Some(range) = effect.location {
                let (low, high) = range.searched_bounds();
                all.push(Prior {
                    centre: 0.0,
                    std: f64::INFINITY,
                    low,
                    high,
                });
            }
        }
        let nuisances = self.nuisances.iter();
        all.extend(nuisances.map(|one| Prior::normal(one.centre, one.std)));
        let drifts = &self.settings.drift_stds;
        self.with_drift(layout, &all, drifts[drifts.len() / 2])
    }

    /// Returns priors with this spread of the drift.
    pub fn with_drift(&self, layout: &Layout, priors: &[Prior], drift: f64) -> Vec<Prior> {
        let mut priors = priors.to_vec();
        let own = &mut priors[layout.first_nuisance()..];
        for (prior, nuisance) in own.iter_mut().zip(&self.nuisances) {
            if nuisance.parameter.is_drift() {
                prior.std = drift;
            }
        }
        priors
    }
}

/// Returns whether the position of a sensor is known.
fn is_placed(configuration: &Configuration, sensor: usize) -> bool {
    let sensor = configuration.sensors.get(sensor);
    sensor.is_some_and(|sensor| sensor.position.is_some())
}
