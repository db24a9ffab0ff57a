//! The tested structure: what is described of it, and how a configuration loads it.
//!
//! This chapter and [`forward`](crate::forward) alone know that the structure is a beam on a joint.

use crate::joint_motion::{JointMotion, initial_amplitude, log_stiffness};
use crate::thresholds::Thresholds;
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use tapjoint_beam::StructureError;
use tapjoint_beam::effects::JointLaw;
use tapjoint_beam::specimen::{
    Body, Joint, Mesh, PointInertia, PointMass, Specimen, SpecimenModes,
};
use tapjoint_identify::consistent::BeamTolerances;
use tapjoint_identify::observation::{Configuration, Observed, ObservedMode, effective_share};

/// Number of elements of a structure.
pub const ELEMENTS: usize = Mesh::DIAGNOSIS.elements;
/// Index of the coupling among the parameters of a joint, after translation and rotation.
pub const COUPLING: usize = 2;
/// Index of the rotation among the parameters of a joint.
pub const ROTATION: usize = 1;

/// Tested structure as it was described.
#[derive(Debug, Clone, PartialEq)]
pub struct Nominal {
    /// Beam, joint and permanent masses, without sensors. The search for the joint's stiffnesses begins at those
    /// given here, stated ones too; those that are 0 or infinite stay so. A coupling other than 0 is
    /// fitted with them.
    pub specimen: Specimen,
    /// The sensors by name.
    pub sensors: Vec<NominalSensor>,
    /// The joint's stiffnesses (N/m, N m/rad) as estimated from the same frequencies without any effect,
    /// to state how far an effect moves them; `None` to take those of the nominal model's own fit.
    pub joint_before: Option<[f64; 2]>,
    /// How well all this is known.
    pub uncertainty: DescriptionUncertainty,
    /// Largest bias of frequencies that are read on lines (Hz); `None` for fitted ones, which
    /// have none.
    pub reading_bias: Option<f64>,
}

/// Standard uncertainties of a description. 0, or `None` in `beam`, is exact.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DescriptionUncertainty {
    /// Properties of the beam (1, relative; Poisson's ratio absolute).
    pub beam: BeamTolerances,
    /// Masses of sensors and of what is fastened (1, relative).
    pub masses: f64,
    /// Positions of sensors, fastened masses and taps (m).
    pub positions: f64,
    /// Logarithm of the bar's mass by a balance over that of the nominal bar; `None` where it was not weighed.
    pub weighed: Option<Observed>,
    /// Logarithm of the free bar's frequencies over those of the nominal bar, on average; `None` without a free test.
    pub free_scale: Option<Observed>,
    /// True where the bar is longer than the beam: its length is then another one, and belongs to both data.
    pub is_longer: bool,
    /// True where the free test was read by the clock of this one.
    pub has_same_clock: bool,
}

/// Sensor as described.
#[derive(Debug, Clone, PartialEq)]
pub struct NominalSensor {
    /// Name.
    pub name: String,
    /// Mass (kg); `None` where it is not stated, 0 for a sensor that does not touch the structure.
    pub mass: Option<f64>,
    /// Position in the reference configuration (m); `None` where it is not stated.
    pub position: Option<f64>,
}

impl Nominal {
    /// Returns the stated mass of a sensor (kg): 0 for one that does not touch the structure, `None` where no
    /// mass is stated or no sensor has this name.
    fn stated_mass(&self, name: &str) -> Option<f64> {
        self.sensors.iter().find(|one| one.name == name)?.mass
    }

    /// Returns the mass of a sensor (kg), 0 where it is unknown.
    pub(crate) fn mass_of(&self, name: &str) -> f64 {
        self.stated_mass(name).unwrap_or(0.0)
    }

    /// Returns the structure with sensors and added masses.
    pub(crate) fn loaded(&self, sensors: &[PointMass], masses: &[PointMass]) -> Specimen {
        let mut specimen = self.specimen.clone();
        let heavy = sensors.iter().filter(|sensor| sensor.mass > 0.0);
        specimen.masses.extend(heavy);
        specimen.masses.extend_from_slice(masses);
        specimen
    }

    /// Returns the fitted parameters of the joint: direction (0 translation, 1 rotation, 2 the coupling of a joint that
    /// has one) and start value.
    pub(crate) fn joint_parameters(&self) -> Vec<(usize, f64)> {
        let Some(Joint { coupling, .. }) = self.specimen.joint else {
            return Vec::new();
        };
        let stiffnesses = self.specimen.joint_stiffnesses().into_iter().enumerate();
        let mut parameters: Vec<(usize, f64)> = stiffnesses
            .filter(|(_, stiffness)| *stiffness > 0.0 && stiffness.is_finite())
            .collect();
        if coupling != 0.0 {
            parameters.push((COUPLING, coupling));
        }
        parameters
    }

    /// Returns the directions of the fitted stiffnesses.
    pub(crate) fn fitted_springs(&self) -> Vec<usize> {
        let directions = self.joint_parameters().into_iter().map(|one| one.0);
        directions.filter(|one| *one != COUPLING).collect()
    }

    /// Returns whether the joint is described as rigid: in translation, and in rotation.
    pub(crate) fn rigid_directions(&self) -> [bool; 2] {
        self.specimen.joint_stiffnesses().map(f64::is_infinite)
    }

    /// Returns whether a parameter of the joint is fitted.
    pub(crate) fn fits(&self, direction: usize) -> bool {
        self.joint_parameters().iter().any(|one| one.0 == direction)
    }

    /// Returns whether the structure has a joint.
    pub(crate) fn has_joint(&self) -> bool {
        self.specimen.joint.is_some()
    }

    /// Returns whether the structure is one beam, not two.
    pub(crate) fn is_one_beam(&self) -> bool {
        matches!(self.specimen.body, Body::One(_))
    }

    /// Length of the structure (m).
    pub(crate) fn length(&self) -> f64 {
        self.specimen.body.length()
    }

    /// Modes of the described structure up to this number.
    pub(crate) fn modes(&self, count: usize) -> Result<SpecimenModes, StructureError> {
        self.specimen.modes(count, Mesh::DIAGNOSIS)
    }

    /// Mass of the beam or beams (kg).
    pub(crate) fn beam_mass(&self) -> f64 {
        let beams = self.specimen.body.beams();
        beams.iter().map(tapjoint_beam::Beam::mass).sum()
    }

    /// Bending stiffness of the first beam (N m2).
    pub(crate) fn bending_stiffness(&self) -> f64 {
        self.specimen.body.beams()[0].bending_stiffness()
    }

    /// Returns the beam without its joint.
    pub(crate) fn bare(&self) -> Nominal {
        let mut bare = self.clone();
        bare.specimen.joint = None;
        bare.specimen.joint_mass = PointInertia::default();
        bare.specimen.overlap = None;
        bare
    }
}

/// One configuration of the test as the model needs it: sensors, masses and hammer on the structure.
#[derive(Debug, Clone)]
pub struct Arrangement {
    /// File of the recording, or the name of the given data.
    pub file: String,
    /// The structure with all known masses.
    pub specimen: Specimen,
    /// Positions and masses of the sensors, in the order of the observations. A sensor of unknown position has no
    /// mass, and its shape is not compared.
    pub sensors: Vec<PointMass>,
    /// Known added masses, each with its index among all distinct ones.
    pub fastened: Vec<(usize, PointMass)>,
    /// Sensors that sit on the structure at a known position.
    pub carried: Vec<PointMass>,
    /// Indices of the sensors' names.
    pub names: Vec<usize>,
    /// Indices of the sensors' stated positions.
    pub positions: Vec<usize>,
    /// Position of the taps (m).
    pub tap: Option<f64>,
    /// Index of that position among all stated ones.
    pub tap_index: Option<usize>,
    /// Amplitude over that of the hardest configuration (1).
    pub level: f64,
    /// Tap force over that of the hardest configuration (1), where it was measured.
    pub known_level: Option<f64>,
    /// By mode: amplitude at the begin and end of its followed decay over that of its first instant.
    pub spans: BTreeMap<usize, [f64; 2]>,
    /// Motion of the joint; `None` where no amplitude is known.
    pub joint_motion: Option<JointMotion>,
    /// Number of the set-up: configurations of one recording share it.
    pub setup: usize,
    /// There is a recording that could be read again.
    pub is_recorded: bool,
    /// Common scatter of the taps: share of the standard deviation of each mode, with its sign.
    pub scatter: BTreeMap<usize, f64>,
}

/// Sensors and masses of all configurations, each once.
#[derive(Debug, Clone, Default)]
pub struct Inventory {
    /// Names of the sensors.
    pub names: Vec<String>,
    /// Index of the name, and stated position (m), of the sensors.
    pub positions: Vec<(usize, f64)>,
    /// Known added masses.
    pub fastened: Vec<PointMass>,
    /// Stated positions of the taps (m).
    pub taps: Vec<f64>,
}

/// Returns the index of a value in a list, which grows where it is new.
fn index_in<T: PartialEq>(list: &mut Vec<T>, value: T) -> usize {
    list.iter()
        .position(|one| *one == value)
        .unwrap_or_else(|| {
            list.push(value);
            list.len() - 1
        })
}

impl Arrangement {
    /// Takes over a configuration, the `index`-th; grows the inventory.
    pub fn new(
        index: usize,
        configuration: &Configuration,
        nominal: &Nominal,
        inventory: &mut Inventory,
        thresholds: &Thresholds,
    ) -> Self {
        let mut sensors: Vec<PointMass> = Vec::new();
        let (mut carried, mut names, mut positions) = (Vec::new(), Vec::new(), Vec::new());
        for sensor in &configuration.sensors {
            let stated = nominal.stated_mass(&sensor.name);
            let mass = stated.filter(|_| sensor.position.is_some());
            let placed = PointMass::new(sensor.position.unwrap_or(0.0), mass.unwrap_or(0.0));
            sensors.push(placed);
            if sensor.position.is_some() && stated != Some(0.0) {
                carried.push(placed);
            }
            let name = index_in(&mut inventory.names, sensor.name.clone());
            names.push(name);
            positions.push(index_in(&mut inventory.positions, (name, placed.position)));
        }
        let masses = configuration.masses.iter();
        let spans = configuration.modes.iter();
        let spans = spans.filter_map(|mode| span(mode, thresholds.distinct_amplitudes));
        let file = configuration.file.clone();
        Arrangement {
            fastened: masses
                .map(|mass| (index_in(&mut inventory.fastened, *mass), *mass))
                .collect(),
            file: file.unwrap_or_else(|| "the given frequencies".to_owned()),
            specimen: nominal.loaded(&sensors, &configuration.masses),
            sensors,
            carried,
            names,
            positions,
            tap: configuration.tap,
            tap_index: configuration
                .tap
                .map(|tap| index_in(&mut inventory.taps, tap)),
            level: configuration.level.unwrap_or(1.0),
            known_level: configuration.level,
            spans: spans.collect(),
            joint_motion: None,
            setup: configuration.recording.unwrap_or(index),
            is_recorded: configuration.recording.is_some(),
            scatter: common_scatter(configuration, thresholds.common_scatter),
        }
    }

    /// Returns its file, and the level if the taps were softer than the hardest.
    pub fn label(&self) -> String {
        match self.known_level {
            Some(level) if level < 0.999 => format!("{} (level {level:.2})", self.file),
            _ => self.file.clone(),
        }
    }

    /// Logarithm of the ratio of the amplitudes between which a decay was followed; 1 where they are unknown.
    pub fn log_amplitude_span(&self, mode: usize) -> f64 {
        let span = self.spans.get(&mode);
        span.map_or(1.0, |[early, late]| (early / late).ln())
    }

    /// Returns d ln kr/d ln a that a mode feels, averaged over the followed part of its decay.
    pub fn stiffness_slope(&self, mode: usize, law: &JointLaw) -> f64 {
        if let (Some(&[early, late]), Some(motion)) = (self.spans.get(&mode), &self.joint_motion)
            && let Some([first, last]) = motion.changes_at_shares(mode, [early, late], law)
        {
            return (log_stiffness(first) - log_stiffness(last)) / (early / late).ln();
        }
        // Without amplitudes: the derivative at the effective one, 1 % to either side.
        let a = self.level * effective_share(law.exponent);
        let [above, below] = [a * 1.01, a / 1.01].map(|a| log_stiffness(law.secant(a) - 1.0));
        (above - below) / (2.0 * 1.01_f64.ln())
    }

    /// Moves its first carried sensor to another position (m), which has this index.
    pub fn move_sensor(&mut self, position: f64, index: usize) {
        let before = self.carried[0];
        self.carried[0].position = position;
        if let Some(k) = self.sensors.iter().position(|sensor| *sensor == before) {
            self.sensors[k].position = position;
            self.positions[k] = index;
        }
        let mut masses = self.specimen.masses.iter_mut();
        if let Some(mass) =
            masses.find(|mass| mass.position == before.position && mass.mass == before.mass)
        {
            mass.position = position;
        }
    }

    /// Fastens a mass (kg) at a position (m), which has this index.
    pub fn fasten(&mut self, mass: f64, position: f64, index: usize) {
        let mass = PointMass::new(position, mass);
        self.specimen.masses.push(mass);
        self.fastened.push((index, mass));
    }

    /// Returns the bare beam in the place of the structure, without sensors and masses.
    pub fn bare(&self, beam: &Nominal) -> Arrangement {
        Arrangement {
            specimen: beam.specimen.clone(),
            sensors: Vec::new(),
            carried: Vec::new(),
            fastened: Vec::new(),
            joint_motion: None,
            names: Vec::new(),
            positions: Vec::new(),
            ..self.clone()
        }
    }
}

/// Returns the mode and its amplitudes at both ends of the followed decay, over the first one; `None` below this
/// `ratio` of the two.
fn span(mode: &ObservedMode, ratio: f64) -> Option<(usize, [f64; 2])> {
    let decay = mode.decay?;
    let first = initial_amplitude(mode)?.0;
    let early = decay.early.amplitude? / first;
    let late = decay.late.amplitude? / first;
    (late > 0.0 && early > ratio * late).then_some((mode.mode, [early, late]))
}

/// Returns the one factor that explains most of the correlation of the taps' scatter. With the largest eigenvalue l
/// of the correlation matrix and its vector v, the shares sqrt(l - 1) v leave the diagonal as it is and
/// explain most of the rest (all of it where all correlations are equal and many). Below `least` there is none.
fn common_scatter(configuration: &Configuration, least: f64) -> BTreeMap<usize, f64> {
    let Some(covariance) = &configuration.covariance else {
        return BTreeMap::new();
    };
    let size = configuration.modes.len();
    let correlation = DMatrix::from_fn(size, size, |i, j| {
        covariance[i][j] / (covariance[i][i] * covariance[j][j]).sqrt()
    });
    if size < 2 || correlation.iter().any(|value| !value.is_finite()) {
        return BTreeMap::new();
    }
    let eigen = correlation.symmetric_eigen();
    let (at, largest) = eigen.eigenvalues.argmax();
    if largest < least {
        return BTreeMap::new();
    }
    let vector = eigen.eigenvectors.column(at);
    let shares = vector.iter().map(|v| (largest - 1.0).sqrt() * v);
    let modes = configuration.modes.iter().map(|mode| mode.mode);
    modes.zip(shares).collect()
}

/// Returns a structure with the joint that the parameters of these directions give it: logarithms of the stiffnesses,
/// and the coupling.
pub fn with_joint(specimen: &Specimen, directions: &[usize], parameters: &[f64]) -> Specimen {
    let mut specimen = specimen.clone();
    if let Some(Joint { kt, kr, coupling }) = &mut specimen.joint {
        for (direction, value) in directions.iter().zip(parameters) {
            match *direction {
                0 => *kt = value.exp(),
                COUPLING => *coupling = *value,
                _ => *kr = value.exp(),
            }
        }
    }
    specimen
}
