//! Plans of tests: which recordings are made, with what noise, and what is stated of them.

use super::draws::{ErrorShape, log_triangular, log_uniform, weighted};
use super::structures::{Structure, Support};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use tapjoint::gap::{Nominal, NominalSensor, PlannedConfiguration, TestPlan};
use tapjoint::identify::observation::Observations;
use tapjoint::structure::specimen::{Joint, Mesh, PointMass, Specimen};

/// Kind of a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanKind {
    /// One recording with one sensor.
    One,
    /// Taps in several places.
    TapPlaces,
    /// A sensor that moves between recordings.
    MovedSensor,
    /// Two tap levels.
    Levels,
    /// Two or three sensors at once.
    Sensors,
    /// A known mass is added.
    KnownMass,
    /// Frequency response functions from a file: no damping, no change along the decay, no scatter of taps.
    Functions,
    /// A moved sensor, two levels and several tap places.
    Mixed,
}

impl PlanKind {
    pub const ALL: [Self; 8] = [
        Self::One,
        Self::TapPlaces,
        Self::MovedSensor,
        Self::Levels,
        Self::Sensors,
        Self::KnownMass,
        Self::Functions,
        Self::Mixed,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::One => "one",
            Self::TapPlaces => "tap-places",
            Self::MovedSensor => "moved-sensor",
            Self::Levels => "levels",
            Self::Sensors => "sensors",
            Self::KnownMass => "known-mass",
            Self::Functions => "functions",
            Self::Mixed => "mixed",
        }
    }

    fn share(self) -> f64 {
        match self {
            Self::One | Self::Sensors => 0.15,
            Self::TapPlaces | Self::MovedSensor => 0.13,
            Self::Levels | Self::Mixed => 0.12,
            Self::KnownMass | Self::Functions => 0.1,
        }
    }
}

/// What a class of plants needs of the plan.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PlanNeeds {
    /// Mode shapes are observed.
    pub shapes: bool,
    /// Damping ratios are observed.
    pub damping: bool,
    /// Two tap levels, or changes along the decays.
    pub amplitudes: bool,
    /// At least two sensors at once.
    pub several_sensors: bool,
    /// At least two recordings.
    pub several_recordings: bool,
    /// The sensors' masses are not stated.
    pub unstated_masses: bool,
}

/// A plan as it is carried out, and as it is stated.
#[derive(Debug, Clone)]
pub struct PlannedTest {
    pub kind: PlanKind,
    /// With true positions and masses.
    pub plan: TestPlan,
    /// With stated positions and masses.
    pub stated: Vec<PlannedConfiguration>,
    pub sensors: Vec<PlannedSensor>,
    /// Standard deviation of the joint's drift (1) where it is heavy-tailed; the plan has then none.
    pub heavy_drift: Option<f64>,
}

/// A sensor with its stated and its true mass (kg).
#[derive(Debug, Clone)]
pub struct PlannedSensor {
    pub name: String,
    pub stated: Option<f64>,
    pub truth: Option<f64>,
}

impl PlannedTest {
    pub fn draw(random: &mut ChaCha8Rng, structure: &Structure, needs: &PlanNeeds) -> Self {
        let kind = draw_kind(random, needs);
        let stated = draw_configurations(random, kind, structure);
        let sensors = draw_sensors(random, structure, needs, &stated);
        let configurations = carried_out(random, structure, &stated);
        let functions = kind == PlanKind::Functions;
        let drift = 0.02 * random.random::<f64>();
        let heavy = random.random_bool(0.1) && configurations.len() > 1;
        let shapes = needs.shapes || functions || random.random_bool(0.75);
        let damping = needs.damping || !functions && random.random_bool(0.7);
        let has_levels = matches!(kind, PlanKind::Levels | PlanKind::Mixed);
        let slopes = !functions && random.random_bool(0.4) || needs.amplitudes && !has_levels;
        let plan = TestPlan {
            modes: random.random_range(4..=10),
            taps: match functions {
                true => 1,
                false => random.random_range(3..=12),
            },
            frequency_std: log_uniform(random, 3e-5, 1e-3),
            shape_std: shapes.then(|| log_uniform(random, 0.01, 0.05)),
            damping_std: damping.then(|| log_uniform(random, 0.02, 0.1)),
            slope_std: slopes.then(|| log_uniform(random, 3e-5, 5e-4)),
            drift: if heavy || configurations.len() == 1 {
                0.0
            } else {
                drift
            },
            damping: log_uniform(random, 5e-4, 0.015),
            scatter: 1.0,
            configurations,
        };
        Self {
            kind,
            plan,
            stated,
            sensors,
            heavy_drift: heavy.then_some(drift),
        }
    }

    /// Returns the structure with its sensors, as it is or as it is described.
    pub fn nominal(&self, structure: &Structure, as_described: bool) -> Nominal {
        let sensors = self.sensors.iter().map(|sensor| NominalSensor {
            name: sensor.name.clone(),
            mass: match as_described {
                true => sensor.stated,
                false => sensor.truth,
            },
            position: None,
        });
        Nominal {
            specimen: match as_described {
                true => structure.described.clone(),
                false => structure.truth.clone(),
            },
            sensors: sensors.collect(),
            joint_before: None,
            uncertainty: structure.uncertainty,
            reading_bias: None,
        }
    }

    /// Replaces true positions and masses in the observations by the stated ones.
    ///
    /// An effect of the set-up has changed the data by then, and not the positions.
    pub fn state(&self, observed: &mut Observations) {
        for (configuration, stated) in observed.configurations.iter_mut().zip(&self.stated) {
            for (sensor, (_, position)) in configuration.sensors.iter_mut().zip(&stated.sensors) {
                sensor.position = Some(*position);
            }
            configuration.tap = Some(stated.tap);
            configuration.masses.clone_from(&stated.masses);
        }
    }

    /// Moves the frequencies by a heavy-tailed drift of the joint in every recording.
    ///
    /// `observe` draws normal drifts only. The change of each frequency is that of the structure without effects.
    pub fn drift_heavily(
        &self,
        random: &mut ChaCha8Rng,
        truth: &Specimen,
        observed: &mut Observations,
    ) {
        let Some(std) = self.heavy_drift else {
            return;
        };
        let Ok(own) = truth.beam_modes(self.plan.modes, Mesh::DIAGNOSIS) else {
            return;
        };
        for configuration in &mut observed.configurations {
            let factors = [0, 1].map(|_| (std * ErrorShape::HeavyTailed.draw(random)).exp());
            let mut drifted = truth.clone();
            if let Some(Joint { kt, kr, .. }) = &mut drifted.joint {
                *kt *= factors[0];
                *kr *= factors[1];
            }
            let Ok(moved) = drifted.beam_modes(self.plan.modes, Mesh::DIAGNOSIS) else {
                continue;
            };
            for mode in &mut configuration.modes {
                let [moved, own] = [&moved, &own]
                    .map(|modes| modes.modes.frequencies()[modes.numbers[mode.mode - 1]]);
                mode.frequency *= moved / own;
            }
        }
    }
}

fn draw_kind(random: &mut ChaCha8Rng, needs: &PlanNeeds) -> PlanKind {
    let allowed = PlanKind::ALL.into_iter().filter(|kind| match kind {
        PlanKind::One => !needs.several_recordings && !needs.several_sensors,
        PlanKind::Functions => !needs.damping && !needs.several_recordings && !needs.amplitudes,
        PlanKind::Sensors => !needs.several_recordings,
        _ => true,
    });
    let mut allowed: Vec<PlanKind> = allowed.collect();
    if needs.several_sensors {
        allowed.retain(|kind| matches!(kind, PlanKind::Sensors));
    }
    let shares: Vec<f64> = allowed.iter().map(|kind| kind.share()).collect();
    allowed[weighted(random, &shares)]
}

/// Draws a position on the beam (m): of a cantilever off its root.
fn place(random: &mut ChaCha8Rng, structure: &Structure) -> f64 {
    let lowest = match structure.support {
        Support::Cantilever | Support::RigidCantilever => 0.15,
        Support::Lap | Support::Free => 0.02,
    };
    structure.length() * (lowest + (0.99 - lowest) * random.random::<f64>())
}

/// Draws positions at least a twelfth of the beam apart (m).
fn places(random: &mut ChaCha8Rng, structure: &Structure, count: usize) -> Vec<f64> {
    let mut places: Vec<f64> = Vec::with_capacity(count);
    while places.len() < count {
        let new = place(random, structure);
        let apart = structure.length() / 12.0;
        if places.iter().all(|one| (one - new).abs() > apart) {
            places.push(new);
        }
    }
    places
}

const NAMES: [&str; 3] = ["A", "B", "C"];

fn recording(sensors: &[f64], tap: f64, level: f64) -> PlannedConfiguration {
    let sensors = NAMES.iter().zip(sensors);
    PlannedConfiguration {
        sensors: sensors
            .map(|(name, position)| ((*name).to_owned(), *position))
            .collect(),
        masses: Vec::new(),
        tap,
        level,
    }
}

/// Draws the recordings as they are stated.
fn draw_configurations(
    random: &mut ChaCha8Rng,
    kind: PlanKind,
    structure: &Structure,
) -> Vec<PlannedConfiguration> {
    let sensor_count = match kind {
        PlanKind::Sensors => random.random_range(2..=3),
        PlanKind::Functions => random.random_range(1..=3),
        _ => 1,
    };
    let sensors = places(random, structure, sensor_count);
    let taps = places(random, structure, 6);
    let first = recording(&sensors, taps[0], 1.0);
    let at_tap = |tap: &f64| recording(&sensors, *tap, 1.0);
    let softer = 1.0 / log_uniform(random, 2.0, 6.0);
    match kind {
        PlanKind::One => vec![first],
        PlanKind::TapPlaces => {
            let count = random.random_range(2..=6);
            taps[..count].iter().map(at_tap).collect()
        }
        PlanKind::Sensors | PlanKind::Functions => {
            let count = random.random_range(1..=3);
            taps[..count].iter().map(at_tap).collect()
        }
        PlanKind::MovedSensor => {
            let count = random.random_range(2..=5);
            let sensors = places(random, structure, count);
            let sensors = sensors.into_iter();
            sensors
                .map(|sensor| recording(&[sensor], taps[0], 1.0))
                .collect()
        }
        PlanKind::Levels => {
            let count = random.random_range(1..=3);
            let taps = taps[..count].iter();
            taps.flat_map(|tap| [1.0, softer].map(|level| recording(&sensors, *tap, level)))
                .collect()
        }
        PlanKind::KnownMass => {
            let mass = structure.mass() * log_uniform(random, 0.01, 0.08);
            let count = random.random_range(1..=2);
            let mut all = vec![first.clone()];
            for position in places(random, structure, count) {
                let mut loaded = first.clone();
                loaded.masses.push(PointMass::new(position, mass));
                all.push(loaded);
            }
            all
        }
        PlanKind::Mixed => {
            let other = places(random, structure, 1);
            let mut all = vec![
                first,
                recording(&sensors, taps[0], softer),
                recording(&sensors, taps[1], 1.0),
                recording(&other, taps[0], 1.0),
                recording(&other, taps[2], 1.0),
            ];
            all.truncate(random.random_range(4..=5));
            all
        }
    }
}

/// Draws the sensors: from 0.3 to 30 g, most often some grams, and at most 5 % of the beam.
fn draw_sensors(
    random: &mut ChaCha8Rng,
    structure: &Structure,
    needs: &PlanNeeds,
    stated: &[PlannedConfiguration],
) -> Vec<PlannedSensor> {
    let count = stated.iter().map(|one| one.sensors.len()).max();
    let names = NAMES[..count.unwrap_or(1)].iter();
    let sensors = names.map(|name| {
        let mass = draw_sensor_mass(random, structure);
        let error = structure.uncertainty.masses * structure.errors.draw(random);
        PlannedSensor {
            name: (*name).to_owned(),
            stated: (!needs.unstated_masses).then_some(mass),
            truth: (!needs.unstated_masses).then_some(mass * (1.0 + error).max(0.0)),
        }
    });
    sensors.collect()
}

/// Draws the mass of a sensor (kg).
pub fn draw_sensor_mass(random: &mut ChaCha8Rng, structure: &Structure) -> f64 {
    log_triangular(random, 3e-4, 4e-3, 0.03).min(0.05 * structure.mass())
}

/// Returns the recordings as they are carried out: sensors, taps and masses are off by their tolerances. A sensor that
/// stays in place has one error for all recordings.
fn carried_out(
    random: &mut ChaCha8Rng,
    structure: &Structure,
    stated: &[PlannedConfiguration],
) -> Vec<PlannedConfiguration> {
    let (positions, masses) = (
        structure.uncertainty.positions,
        structure.uncertainty.masses,
    );
    let length = structure.truth.body.length().min(structure.length());
    let off = |place: f64, error: f64| (place + positions * error).clamp(1e-3 * length, length);
    let mut known: Vec<((String, f64), f64)> = Vec::new();
    let mut taps: Vec<(f64, f64)> = Vec::new();
    let mass_error = structure.errors.draw(random);
    let mut carried_out = stated.to_vec();
    for configuration in &mut carried_out {
        for sensor in &mut configuration.sensors {
            let found = known.iter().find(|one| one.0 == *sensor);
            let truth = found.map(|one| one.1).unwrap_or_else(|| {
                let truth = off(sensor.1, structure.errors.draw(random));
                known.push((sensor.clone(), truth));
                truth
            });
            sensor.1 = truth;
        }
        for mass in &mut configuration.masses {
            mass.mass *= (1.0 + masses * mass_error).max(0.0);
            mass.position = off(mass.position, structure.errors.draw(random));
        }
        // So has a mark at which the hammer is aimed.
        let found = taps.iter().find(|one| one.0 == configuration.tap);
        let truth = found.map(|one| one.1).unwrap_or_else(|| {
            let truth = off(configuration.tap, structure.errors.draw(random));
            taps.push((configuration.tap, truth));
            truth
        });
        configuration.tap = truth;
    }
    carried_out
}
