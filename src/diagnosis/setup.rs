//! One configuration of the test as the model needs it.

use super::decay_readings::beginning;
use super::joint_path::JointPath;
use super::nominal::Nominal;
use nalgebra::DMatrix;
use tapjoint_beam::effects::SensorPlace;
use tapjoint_beam::specimen::{PointMass, Specimen};
use tapjoint_identify::observation::{Configuration, ExtraPeak, ObservedMode, UNPAIRED};

/// One configuration as the model needs it.
#[derive(Debug, Clone)]
pub(super) struct Setup {
    /// File of the recording, or what else the readings are.
    pub(super) file: String,
    /// The structure with all masses that are known.
    pub(super) specimen: Specimen,
    /// Places and masses of the sensors, in the order of the observations. One without a place has no
    /// mass, and its shape is not compared.
    pub(super) sensors: Vec<SensorPlace>,
    /// Known masses that are fastened, each with its index among all distinct ones.
    pub(super) fastened: Vec<(usize, PointMass)>,
    /// Those that sit on the structure at a known place.
    pub(super) carried: Vec<SensorPlace>,
    /// Names of the sensors, as indices.
    pub(super) names: Vec<usize>,
    /// Distinct stated places of the sensors, as indices.
    pub(super) places: Vec<usize>,
    /// Where the hammer struck (m).
    pub(super) tap: Option<f64>,
    /// Amplitude over that of the hardest configuration (1).
    pub(super) level: f64,
    /// The same where a force was measured.
    pub(super) known_level: Option<f64>,
    /// Amplitude at the begin and end of the followed decay over that of its first instant, by mode.
    pub(super) spans: Vec<(usize, f64, f64)>,
    /// How the joint moves; `None` where no amplitude is known.
    pub(super) path: Option<JointPath>,
    /// Which visit to the structure.
    pub(super) visit: usize,
    /// Whether there is a recording that could be read once more.
    pub(super) is_recorded: bool,
    /// What the taps' scatter has in common: share of each mode's standard deviation, with its sign.
    pub(super) scatter: Vec<(usize, f64)>,
}

/// Index of a value in a list, which grows where it is new.
fn index_in<T: PartialEq>(list: &mut Vec<T>, value: T) -> usize {
    list.iter()
        .position(|one| *one == value)
        .unwrap_or_else(|| {
            list.push(value);
            list.len() - 1
        })
}

impl Setup {
    /// What it is called beside others: its file, and the level where the taps were softer than the hardest.
    pub(super) fn label(&self) -> String {
        match self.known_level {
            Some(level) if level < 0.999 => format!("{} (level {level:.2})", self.file),
            _ => self.file.clone(),
        }
    }
}

/// What all configurations have of sensors and masses, each once.
#[derive(Debug, Default)]
pub(super) struct Lists {
    /// Names of the sensors.
    pub(super) names: Vec<String>,
    /// Index of the name and stated place (m) of the sensors.
    pub(super) places: Vec<(usize, f64)>,
    /// Masses that are fastened.
    pub(super) fastened: Vec<PointMass>,
}

/// A configuration with its sensors and masses on the structure; grows the lists.
pub(super) fn setup(
    index: usize,
    configuration: &Configuration,
    nominal: &Nominal,
    lists: &mut Lists,
) -> Setup {
    let sensors: Vec<SensorPlace> = configuration
        .sensors
        .iter()
        .map(|sensor| SensorPlace {
            position: sensor.position.unwrap_or(0.0),
            mass: sensor
                .position
                .map_or(0.0, |_| nominal.mass_of(&sensor.name)),
        })
        .collect();
    let carried = configuration
        .sensors
        .iter()
        .zip(&sensors)
        .filter(|(sensor, _)| sensor.position.is_some() && !nominal.is_apart(&sensor.name))
        .map(|(_, place)| *place)
        .collect();
    let masses_of_sensors: Vec<(f64, f64)> = sensors.iter().map(|s| (s.position, s.mass)).collect();
    let name_indices: Vec<usize> = configuration
        .sensors
        .iter()
        .map(|sensor| index_in(&mut lists.names, sensor.name.clone()))
        .collect();
    let place_indices = name_indices
        .iter()
        .zip(&sensors)
        .map(|(&name, sensor)| index_in(&mut lists.places, (name, sensor.position)))
        .collect();
    let masses = configuration.masses.iter();
    let fastened = masses.map(|mass| (index_in(&mut lists.fastened, *mass), *mass));
    let mut specimen = nominal.with_masses(&masses_of_sensors);
    specimen.masses.extend_from_slice(&configuration.masses);
    Setup {
        fastened: fastened.collect(),
        file: file_of(configuration),
        specimen,
        sensors,
        carried,
        names: name_indices,
        places: place_indices,
        tap: configuration.tap,
        level: configuration.level.unwrap_or(1.0),
        known_level: configuration.level,
        spans: configuration.modes.iter().filter_map(span).collect(),
        path: None,
        visit: configuration.recording.unwrap_or(index),
        is_recorded: configuration.recording.is_some(),
        scatter: common_scatter(configuration),
    }
}

/// Largest eigenvalue of a correlation matrix above which the modes have something in common: unrelated
/// ones are shrunk towards 1.
const RELATED: f64 = 1.3;

/// The one factor that explains most of the correlation of the taps' scatter: with the largest eigenvalue l
/// of the correlation matrix and its vector v, the shares sqrt(l - 1) v leave the diagonal as it is and
/// most of the rest explained (exactly all of it where all correlations are equal and many).
fn common_scatter(configuration: &Configuration) -> Vec<(usize, f64)> {
    let Some(covariance) = &configuration.covariance else {
        return Vec::new();
    };
    let size = configuration.modes.len();
    let correlation = DMatrix::from_fn(size, size, |i, j| {
        covariance[i][j] / (covariance[i][i] * covariance[j][j]).sqrt()
    });
    if size < 2 || correlation.iter().any(|value| !value.is_finite()) {
        return Vec::new();
    }
    let eigen = correlation.symmetric_eigen();
    let (at, largest) = eigen.eigenvalues.argmax();
    if largest < RELATED {
        return Vec::new();
    }
    let vector = eigen.eigenvectors.column(at);
    let shares = vector.iter().map(|v| (largest - 1.0).sqrt() * v);
    let modes = configuration.modes.iter().map(|mode| mode.mode);
    modes.zip(shares).collect()
}

/// Two poles nearer than this, relative, share one decay: 1 %.
pub(super) const TWIN: f64 = 0.01;

/// Relative distance of the farthest peak that belongs to no mode and is so near that the fit has split
/// one decay between the two: what is then read of the mode alone is unreliable. A joint whose
/// stiffness changes with amplitude makes such pairs.
pub(super) fn twin(configuration: &Configuration, mode: &ObservedMode) -> Option<f64> {
    let distance = |peak: &ExtraPeak| (peak.frequency / mode.frequency - 1.0).abs();
    let peaks = configuration.extra_peaks.iter();
    peaks
        .filter(|peak| peak.label == UNPAIRED)
        .map(distance)
        .filter(|distance| *distance < TWIN)
        .max_by(f64::total_cmp)
}

fn span(mode: &ObservedMode) -> Option<(usize, f64, f64)> {
    let decay = mode.decay?;
    let first = beginning(mode)?.0;
    let share = |amplitude: Option<f64>| Some(amplitude? / first);
    let (early, late) = (share(decay.early.amplitude)?, share(decay.late.amplitude)?);
    (late > 0.0 && early > 1.05 * late).then_some((mode.mode, early, late))
}

/// The file, or what was given without one.
fn file_of(configuration: &Configuration) -> String {
    let given = || "the given frequencies".to_owned();
    configuration.file.clone().unwrap_or_else(given)
}
