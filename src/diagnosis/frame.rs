//! What was observed, in the order in which it is compared: readings (rows) and small unknowns
//! (columns) that every hypothesis shares.

use super::common_modes::{highest_mode, up_to};
use super::decay_readings::{average_std, bent_std, widen};
use super::lone_peaks::Peaks;
use super::noise::{self, Reading};
use super::nominal::Nominal;
use super::settings::GapSettings;
use super::setup::{Lists, Setup, setup, twin};
use super::small_unknowns::Small;
use nalgebra::DMatrix;
use tapjoint_beam::specimen::Mesh;
use tapjoint_identify::observation::Observations;

/// What a reading is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Row {
    /// Logarithm of a natural frequency.
    Frequency { configuration: usize, mode: usize },
    /// Modal constant at a sensor and the tap (1/kg).
    Constant {
        configuration: usize,
        mode: usize,
        sensor: usize,
    },
    /// Shape at a sensor over that at the reference sensor (1).
    Ratio {
        configuration: usize,
        mode: usize,
        sensor: usize,
        reference: usize,
    },
    /// Logarithm of a damping ratio, all configurations together.
    Damping { mode: usize },
    /// Change of the logarithm of a frequency per e-fold of the amplitude along the decay (1).
    Slope { configuration: usize, mode: usize },
}

/// Everything that is compared, and how.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    pub(super) nominal: Nominal,
    pub(super) setups: Vec<Setup>,
    pub(super) rows: Vec<Row>,
    pub(super) readings: Vec<Reading>,
    pub(super) smalls: Vec<Small>,
    /// Standard deviations of the small unknowns.
    pub(super) small_stds: Vec<f64>,
    /// Starting values of the small unknowns, which are the centres of their priors.
    pub(super) small_centres: Vec<f64>,
    /// Modes that are solved for.
    pub(super) modes: usize,
    /// How finely the structure is divided.
    pub(super) mesh: Mesh,
    /// Radius of gyration of a sensor (m).
    pub(super) sensor_radius: f64,
    /// Modes above this one are withheld.
    pub(super) fitted_modes: usize,
    /// Frequencies that take no part in the fit: row and reading.
    pub(super) withheld: Vec<(Row, Reading)>,
    /// What the frequency of a configuration and mode moves by for one standard deviation of the taps' common
    /// scatter (logarithm).
    pub(super) scatter: Vec<((usize, usize), f64)>,
    /// Derivatives of the frequencies' logarithms with respect to the relative size of shear and rotary inertia, mode
    /// by mode, taken once at the nominal optimum of the first configuration: what is fastened to the beam changes
    /// them little. With the modes that a next test may add.
    pub(super) shear_slopes: Vec<f64>,
    /// Slopes of all rows but frequencies with respect to the joint's stiffnesses, taken once at the
    /// nominal optimum: shapes depend on the joint little enough for that.
    pub(super) shape_slopes: Option<DMatrix<f64>>,
    /// Modes with a damping ratio, and the logarithm of the frequency of each over their geometric mean.
    pub(super) tilts: Vec<(usize, f64)>,
    /// Peaks that belong to no mode.
    pub(super) peaks: Peaks,
}

/// Least uncertainty of a modal constant or ratio over the root mean square of its kind (1): 1 %, what
/// modes beyond the model and real beams leave.
const SHAPE_FLOOR: f64 = 0.01;

impl Frame {
    /// From observations in which every sensor with a mass has a place.
    pub(super) fn new(
        observations: &Observations,
        nominal: &Nominal,
        settings: &GapSettings,
    ) -> Self {
        let highest = highest_mode(observations).min(settings.highest_mode);
        let observations = &up_to(highest, observations);
        let fitted_modes = if highest >= settings.withhold_from {
            highest.saturating_sub(settings.withheld_modes)
        } else {
            highest
        };
        let mut lists = Lists::default();
        let setups: Vec<Setup> = observations
            .configurations
            .iter()
            .enumerate()
            .map(|(index, c)| setup(index, c, nominal, &mut lists))
            .collect();
        let mut frame = Frame {
            nominal: nominal.clone(),
            setups,
            rows: Vec::new(),
            readings: Vec::new(),
            smalls: Vec::new(),
            small_stds: Vec::new(),
            small_centres: Vec::new(),
            modes: highest,
            mesh: Mesh::DIAGNOSIS,
            sensor_radius: settings.sensor_radius,
            fitted_modes,
            withheld: Vec::new(),
            scatter: Vec::new(),
            shear_slopes: Vec::new(),
            shape_slopes: None,
            tilts: Vec::new(),
            peaks: Peaks::new(observations),
        };
        frame.add_frequencies(observations, settings);
        frame.add_shapes(observations);
        frame.add_damping(observations, settings);
        frame.add_slopes(observations);
        frame.add_smalls(&lists, settings);
        frame.add_fastened(&lists.fastened, settings);
        frame
    }

    pub(super) fn push(&mut self, row: Row, reading: Reading) {
        self.rows.push(row);
        self.readings.push(reading);
    }

    fn add_frequencies(&mut self, observations: &Observations, settings: &GapSettings) {
        let mut rows = Vec::new();
        let mut readings = Vec::new();
        for (configuration, one) in observations.configurations.iter().enumerate() {
            for mode in &one.modes {
                let Some(std) = mode.std.filter(|std| *std > 0.0) else {
                    continue;
                };
                rows.push(Row::Frequency {
                    configuration,
                    mode: mode.mode,
                });
                let freedom = mode.freedom.unwrap_or(f64::INFINITY);
                readings.push(reading_of(
                    mode.frequency.ln(),
                    std / mode.frequency,
                    freedom,
                ));
            }
        }
        noise::moderate(&mut readings);
        for (row, mut reading) in rows.into_iter().zip(readings) {
            let Row::Frequency {
                configuration,
                mode,
            } = row
            else {
                continue;
            };
            let one = &observations.configurations[configuration];
            let share = self.scattered(configuration, mode);
            if share != 0.0 {
                // The common part is an unknown of its own.
                let moved = share * reading.std;
                self.scatter.push(((configuration, mode), moved));
                reading.std *= (1.0 - share * share).max(0.0).sqrt();
            }
            // What a recording has in common is far below the floor: as good as independent.
            widen(&mut reading, settings.frequency_floor.hypot(one.common));
            if let Some(observed) = one.mode(mode) {
                // Anywhere between the poles of a decay that was split, on either side of this one.
                let split = twin(one, observed).unwrap_or(0.0) / 3.0_f64.sqrt();
                widen(&mut reading, split.hypot(average_std(observed)));
            }
            if mode > self.fitted_modes {
                self.withheld.push((row, reading));
            } else {
                self.push(row, reading);
            }
        }
    }

    /// Share of a frequency's scatter that its configuration has in common; none of what is withheld.
    fn scattered(&self, configuration: usize, mode: usize) -> f64 {
        let shares = &self.setups[configuration].scatter;
        let own = shares.iter().find(|share| share.0 == mode);
        own.filter(|_| mode <= self.fitted_modes)
            .map_or(0.0, |share| share.1)
    }

    fn add_shapes(&mut self, observations: &Observations) {
        let mut constants: Vec<(Row, Reading)> = Vec::new();
        let mut ratios: Vec<(Row, Reading)> = Vec::new();
        for (configuration, one) in observations.configurations.iter().enumerate() {
            for mode in one.modes.iter().filter(|m| m.mode <= self.fitted_modes) {
                if twin(one, mode).is_some() {
                    continue;
                }
                let placed = |sensor: usize| {
                    one.sensors
                        .get(sensor)
                        .is_some_and(|s| s.position.is_some())
                };
                let Some(reference) = mode.reference.filter(|&sensor| placed(sensor)) else {
                    continue;
                };
                if let (Some(constant), Some(_)) = (mode.constant, one.tap) {
                    let row = Row::Constant {
                        configuration,
                        mode: mode.mode,
                        sensor: reference,
                    };
                    let freedom = constant.freedom.unwrap_or(f64::INFINITY);
                    let mut reading = reading_of(constant.value, constant.std, freedom);
                    widen(&mut reading, constant.value * bent_std(mode));
                    constants.push((row, reading));
                }
                let others = mode
                    .shape
                    .iter()
                    .filter(|value| value.sensor != reference && placed(value.sensor));
                for value in others.filter(|value| value.std > 0.0) {
                    let row = Row::Ratio {
                        configuration,
                        mode: mode.mode,
                        sensor: value.sensor,
                        reference,
                    };
                    let freedom = mode.freedom.unwrap_or(f64::INFINITY);
                    ratios.push((row, reading_of(value.value, value.std, freedom)));
                }
            }
        }
        for kind in [constants, ratios] {
            let floor = SHAPE_FLOOR * root_mean_square(&kind);
            for (row, mut reading) in kind {
                widen(&mut reading, floor);
                self.push(row, reading);
            }
        }
    }

    /// What the frequency of a mode owes to shear and rotary inertia; 0 before it is known.
    pub(super) fn shear_slope(&self, mode: usize) -> f64 {
        self.shear_slopes.get(mode - 1).copied().unwrap_or(0.0)
    }

    /// Logarithm of a mode's frequency over the geometric mean of all that have a damping ratio; 0 of others.
    pub(super) fn tilt(&self, mode: usize) -> f64 {
        let own = self.tilts.iter().find(|tilt| tilt.0 == mode);
        own.map_or(0.0, |tilt| tilt.1)
    }

    /// One damping ratio for each mode: the weighted mean of all configurations, since nothing but
    /// noise and level distinguishes them.
    fn add_damping(&mut self, observations: &Observations, settings: &GapSettings) {
        for mode in 1..=self.fitted_modes {
            let seen = observations
                .configurations
                .iter()
                .filter_map(|c| c.mode(mode));
            let (mut weights, mut sum) = (0.0, 0.0);
            let frequency = seen.clone().map(|mode| mode.frequency).next();
            for damping in seen.filter_map(|mode| mode.damping) {
                if damping.value > 0.0 && damping.std > 0.0 {
                    let weight = (damping.value / damping.std).powi(2);
                    weights += weight;
                    sum += weight * damping.value.ln();
                }
            }
            if weights > 0.0 {
                let std = weights.powf(-0.5).hypot(settings.damping_scatter);
                let reading = reading_of(sum / weights, std, f64::INFINITY);
                self.push(Row::Damping { mode }, reading);
                self.tilts.push((mode, frequency.map_or(0.0, f64::ln)));
            }
        }
        let mean = self.tilts.iter().map(|tilt| tilt.1).sum::<f64>() / self.tilts.len() as f64;
        self.tilts.iter_mut().for_each(|tilt| tilt.1 -= mean);
    }

    /// What one standard deviation of the taps' common scatter moves a frequency by (logarithm).
    pub(super) fn scatter_of(&self, configuration: usize, mode: usize) -> f64 {
        let mut all = self.scatter.iter();
        all.find(|one| one.0 == (configuration, mode))
            .map_or(0.0, |one| one.1)
    }
}

pub(super) fn reading_of(value: f64, std: f64, freedom: f64) -> Reading {
    Reading {
        value,
        std,
        freedom,
    }
}

fn root_mean_square(readings: &[(Row, Reading)]) -> f64 {
    let values: Vec<f64> = readings.iter().map(|(_, reading)| reading.value).collect();
    tapjoint_numerics::stats::root_mean_square(&values)
}
