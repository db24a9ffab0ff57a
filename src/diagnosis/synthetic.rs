//! Observations that a planned test would make of a given structure.
//!
//! They are drawn from the structure's modes on the finer mesh, not from the diagnosis's own predictions. Only whether
//! a fixture's peak is read follows the diagnosis's own rule: the simulator, which makes signals, tests that rule.
//!
//! Where the set-up is not as described, the configurations state the described places, and the readings are those of the
//! true ones. Interchanged sensors count as equally sensitive, since a plan states no scales.

use crate::modal_model::{fixture_strength, joint_amplitude};
use crate::observations::DECIBEL;
use crate::settings::GapError;
use crate::structure::Nominal;
use crate::thresholds::Thresholds;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use tapjoint_beam::effects::{
    ActualSetUp, Circumstances, DescribedSetUp, Effect, EffectId, Seen, actual_set_ups, apply,
};
use tapjoint_beam::specimen::{BeamModes, Joint, Mesh, PointMass, Specimen};
use tapjoint_identify::observation::{
    AlongDecay, Configuration, DecayEnd, DecayVerdict, ExtraPeak, Observations, Observed,
    ObservedMode, ObservedSensor, ShapeValue, UNPAIRED, effective_share,
};

/// Plan of a test, with the uncertainties of its data.
#[derive(Debug, Clone, PartialEq)]
pub struct TestPlan {
    /// The recordings.
    pub configurations: Vec<PlannedConfiguration>,
    /// Modes observed, from the lowest.
    pub modes: usize,
    /// Taps of each recording.
    pub taps: usize,
    /// Relative standard deviation of a frequency, mean of all taps (1).
    pub frequency_std: f64,
    /// Standard deviation of a modal constant over the root mean square of all (1); `None` = not observed.
    pub shape_std: Option<f64>,
    /// Relative standard deviation of a damping ratio (1); `None` = not observed.
    pub damping_std: Option<f64>,
    /// Standard deviation of the relative change of a frequency per e-fold along the decay (1); `None` =
    /// not observed.
    pub slope_std: Option<f64>,
    /// Standard deviation of the joint's stiffnesses between recordings (1).
    pub drift: f64,
    /// Damping ratio of the beam alone (1).
    pub damping: f64,
    /// Factor on the scatter of the drawn data (1): 1, or 0 for the mean of endless
    /// repetition, without drift and errors.
    pub scatter: f64,
}

/// One planned recording.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedConfiguration {
    /// Name and position (m) of each sensor.
    pub sensors: Vec<(String, f64)>,
    /// Known added masses.
    pub masses: Vec<PointMass>,
    /// Position of the taps (m).
    pub tap: f64,
    /// Force over that of the hardest taps (1).
    pub level: f64,
}

impl TestPlan {
    /// Returns the described set-up of each configuration, on a beam of this length (m).
    pub fn set_ups(&self, length: f64) -> Vec<DescribedSetUp> {
        let planned = self.configurations.iter();
        planned
            .map(|one| DescribedSetUp {
                length,
                sensors: one.sensors.iter().map(|(_, position)| *position).collect(),
                tap: one.tap,
            })
            .collect()
    }
}

/// Draws the observations that the plan would make of a structure with these effects. Those of the set-up are left out
/// where the plan has no such sensor or recording.
///
/// # Errors
/// [`GapError::Structure`] where the structure has no such modes.
pub fn observe(
    plan: &TestPlan,
    truth: &Nominal,
    effects: &[Effect],
    seed: u64,
) -> Result<Observations, GapError> {
    let modes = truth.specimen.modes(plan.modes, Mesh::SIMULATION)?;
    let length = truth.specimen.body.length();
    let set_ups = actual_set_ups(effects, &plan.set_ups(length));
    let planned = plan.configurations.iter().zip(&set_ups);
    let amplitudes: Vec<f64> = planned
        .map(|(one, actual)| joint_amplitude(&modes, actual.tap, one.level, 0..plan.modes))
        .collect();
    let largest = amplitudes.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let mut test = VirtualTest {
        plan,
        truth,
        effects,
        set_ups: &set_ups,
        random: ChaCha8Rng::seed_from_u64(seed),
    };
    let mut configurations = Vec::new();
    for (index, amplitude) in amplitudes.iter().enumerate() {
        configurations.push(test.configuration(index, amplitude / largest)?);
    }
    Ok(Observations { configurations })
}

/// Amplitudes between which a decay is followed, over the first one.
const DECAY_ENDS: [f64; 2] = [0.9, 0.22];

/// Structure and modes of one configuration.
struct VirtualModes {
    seen: Seen,
    own: BeamModes,
    /// Modes at both ends of the followed decay.
    ends: [BeamModes; 2],
}

/// Test of a structure by a plan.
struct VirtualTest<'a> {
    plan: &'a TestPlan,
    truth: &'a Nominal,
    effects: &'a [Effect],
    /// The true set-up of each configuration.
    set_ups: &'a [ActualSetUp],
    random: ChaCha8Rng,
}

impl VirtualTest<'_> {
    fn normal(&mut self) -> f64 {
        self.plan.scatter * self.random.sample::<f64, _>(StandardNormal)
    }

    /// Draws the mean of the taps and the standard deviation by their scatter.
    fn measured(&mut self, value: f64, std: f64) -> Observed {
        let value = value + std * self.normal();
        if self.plan.taps < 2 || self.plan.scatter == 0.0 {
            return Observed {
                value,
                std,
                freedom: None,
            };
        }
        let freedom = self.plan.taps as f64 - 1.0;
        let squares: f64 = (1..self.plan.taps).map(|_| self.normal().powi(2)).sum();
        Observed {
            value,
            std: std * (squares / freedom).sqrt().max(1e-3),
            freedom: Some(freedom),
        }
    }

    fn configuration(&mut self, index: usize, amplitude: f64) -> Result<Configuration, GapError> {
        let planned = &self.plan.configurations[index];
        let actual = &self.set_ups[index];
        let modes = self.solve(planned, actual, amplitude)?;
        let observed = (0..self.plan.modes)
            .map(|number| self.mode(actual, number, &modes))
            .collect();
        let sensors = planned
            .sensors
            .iter()
            .map(|(name, position)| ObservedSensor {
                name: name.clone(),
                position: Some(*position),
            });
        Ok(Configuration {
            file: Some(format!("recording {}", index + 1)),
            recording: Some(index),
            sensors: sensors.collect(),
            masses: planned.masses.clone(),
            tap: Some(planned.tap),
            peak_force: Some(planned.level),
            level: Some(planned.level),
            taps: self.plan.taps,
            decay_seconds: None,
            band: None,
            modes: observed,
            covariance: None,
            common: 0.0,
            extra_peaks: self.fixture_peak(actual, &modes).into_iter().collect(),
        })
    }

    /// Solves the structure of a recording: with its own joint, at the effective amplitude and at both ends of
    /// the followed decay.
    fn solve(
        &mut self,
        planned: &PlannedConfiguration,
        actual: &ActualSetUp,
        amplitude: f64,
    ) -> Result<VirtualModes, GapError> {
        let names = planned.sensors.iter().map(|(name, _)| name);
        let sensors: Vec<PointMass> = names
            .zip(&actual.sensors)
            .map(|(name, position)| PointMass::new(*position, self.truth.mass_of(name)))
            .collect();
        let mut nominal = self.truth.loaded(&sensors, &planned.masses);
        self.drift(&mut nominal);
        let mut effects = self.effects.iter();
        let power = effects
            .find(|effect| effect.id == EffectId::JointNonlinearity)
            .and_then(|effect| effect.value("exponent"));
        let shares = [
            effective_share(power.unwrap_or(1.0)),
            DECAY_ENDS[0],
            DECAY_ENDS[1],
        ];
        let [seen, early, late] = shares.map(|share| {
            let circumstances = Circumstances {
                sensors: &sensors,
                level: amplitude * share,
                ..Circumstances::default()
            };
            apply(self.effects, &nominal, &circumstances)
        });
        let modes = self.plan.modes;
        Ok(VirtualModes {
            own: seen.specimen.beam_modes(modes, Mesh::SIMULATION)?,
            ends: [
                early.specimen.beam_modes(modes, Mesh::SIMULATION)?,
                late.specimen.beam_modes(modes, Mesh::SIMULATION)?,
            ],
            seen,
        })
    }

    /// Draws the joint of one set-up.
    fn drift(&mut self, specimen: &mut Specimen) {
        let std = self.plan.drift;
        let factors = [(std * self.normal()).exp(), (std * self.normal()).exp()];
        if let Some(Joint { kt, kr, .. }) = &mut specimen.joint {
            *kt *= factors[0];
            *kr *= factors[1];
        }
    }

    /// Draws the fixture's own mode, where it is strong enough to be read.
    fn fixture_peak(&mut self, actual: &ActualSetUp, modes: &VirtualModes) -> Option<ExtraPeak> {
        let own = &modes.own;
        let fixture = own.fixture?;
        let (sensors, tap) = (&actual.sensors, Some(actual.tap));
        let strength = fixture_strength(&own.modes, fixture, &own.numbers, sensors, tap)?;
        if strength.own <= strength.median + Thresholds::DEFAULT.fixture_level / DECIBEL {
            return None;
        }
        let frequency = modes.seen.read(own.modes.frequencies()[fixture]);
        let read = self.measured(frequency, frequency * self.plan.frequency_std);
        Some(ExtraPeak {
            frequency: read.value,
            std: Some(read.std),
            level_db: None,
            constant: self.plan.shape_std.map(|_| strength.own.exp()),
            label: UNPAIRED.to_owned(),
        })
    }

    fn mode(&mut self, actual: &ActualSetUp, number: usize, modes: &VirtualModes) -> ObservedMode {
        let (own, seen) = (&modes.own.modes, &modes.seen);
        let mode = modes.own.numbers[number];
        let true_frequency = own.frequencies()[mode] * seen.frequency_scale + seen.frequency_offset;
        let frequency = self.measured(true_frequency, true_frequency * self.plan.frequency_std);
        let positions = actual.sensors.iter();
        let true_ones: Vec<f64> = positions
            .map(|x| own.middle_displacement(mode, *x))
            .collect();
        let channels = actual.channels.iter();
        let at_sensors: Vec<f64> = channels.map(|channel| channel.of(&true_ones)).collect();
        let strongest = (0..at_sensors.len())
            .max_by(|&a, &b| at_sensors[a].abs().total_cmp(&at_sensors[b].abs()));
        let reference = strongest.zip(self.plan.shape_std);
        // Shapes of unit modal mass are about 2/sqrt(mass) large.
        let size = 2.0 / self.truth.beam_mass();
        let constant = reference.map(|(sensor, std)| {
            let value = at_sensors[sensor] * own.middle_displacement(mode, actual.tap);
            self.measured(value, size * std)
        });
        let mut shape = Vec::new();
        if let Some((reference, std)) = reference {
            for (sensor, displacement) in at_sensors.iter().enumerate() {
                let std = if sensor == reference { 0.0 } else { std };
                shape.push(ShapeValue {
                    sensor,
                    value: displacement / at_sensors[reference] + std * self.normal(),
                    std,
                    freedom: None,
                });
            }
        }
        let lost = 0.5 * seen.joint_loss_factor * own.joint_energy_share(mode);
        let damping = self.plan.damping + lost;
        let damping_std = self.plan.damping_std;
        let damping = damping_std.map(|std| self.measured(damping, damping * std));
        let [early, late] = &modes.ends;
        let [early, late] = [early, late].map(|end| end.modes.frequencies()[end.numbers[number]]);
        let slope = (early / late).ln() / (DECAY_ENDS[0] / DECAY_ENDS[1]).ln() * true_frequency;
        let slope_std = self.plan.slope_std;
        let slope = slope_std.map(|std| self.measured(slope, std * true_frequency));
        ObservedMode {
            mode: number + 1,
            frequency: frequency.value,
            std: Some(frequency.std),
            freedom: frequency.freedom,
            repeats: self.plan.taps,
            damping,
            shape,
            reference: reference.map(|(sensor, _)| sensor),
            constant,
            amplitude: None,
            decay: slope.map(|slope| along_decay(slope, frequency)),
        }
    }
}

/// Returns the change along the decay; its ends are not observed apart.
fn along_decay(slope: Observed, frequency: Observed) -> AlongDecay {
    let unobserved = Observed {
        value: 0.0,
        std: f64::INFINITY,
        freedom: None,
    };
    let end = DecayEnd {
        amplitude: None,
        frequency,
        damping: unobserved,
    };
    AlongDecay {
        frequency_slope: slope,
        frequency_change: None,
        damping_slope: unobserved,
        early: end,
        late: end,
        verdict: DecayVerdict::Steady,
    }
}
