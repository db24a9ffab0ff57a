//! Observations that a planned test would make of a given structure: drawn from the structure's modes
//! on the finer mesh, not from the diagnosis's own predictions. Only whether a fixture's peak is read follows
//! the diagnosis's own rule: what that is worth is for the simulator, which makes signals, to say.

use super::error::GapError;
use super::fixture_peak::{SEEN, strength};
use super::joint_path::joint_amplitude;
use super::lone_peaks::DECIBEL;
use super::nominal::Nominal;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use tapjoint_beam::effects::{Circumstances, Effect, EffectId, Seen, SensorPlace, apply};
use tapjoint_beam::specimen::{BeamModes, Mesh, PointMass, Specimen, SpecimenJoint};
use tapjoint_identify::observation::{
    AlongDecay, Configuration, DecayEnd, DecayVerdict, ExtraPeak, Observations, Observed,
    ObservedMode, ObservedSensor, ShapeValue, UNPAIRED, effective_share,
};

/// What a test will look at, and how well.
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
    /// Damping ratio of the beam by itself (1).
    pub damping: f64,
    /// How far what is drawn scatters, in standard deviations (1): 1, or 0 for what the mean of endless
    /// repetition would show, drift and errors of the readings being none.
    pub scatter: f64,
}

/// One planned recording.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedConfiguration {
    /// Name and place (m) of each sensor.
    pub sensors: Vec<(String, f64)>,
    /// Known masses that are fastened.
    pub masses: Vec<PointMass>,
    /// Where the hammer strikes (m).
    pub tap: f64,
    /// Force over that of the hardest taps (1).
    pub level: f64,
}

/// Draws what the plan would observe of a structure with these effects.
///
/// # Errors
/// [`GapError::Structure`] where the structure has no such modes.
pub fn observe(
    plan: &TestPlan,
    truth: &Nominal,
    effects: &[Effect],
    seed: u64,
) -> Result<Observations, GapError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let solved = amplitudes(plan, truth)?;
    let mut scene = Scene {
        plan,
        truth,
        effects,
        random: &mut random,
    };
    let configurations = (0..plan.configurations.len())
        .map(|index| scene.configuration(index, solved[index]))
        .collect::<Result<Vec<Configuration>, GapError>>()?;
    Ok(Observations { configurations })
}

/// Amplitude of the joint's rotation in each recording over that of the largest.
fn amplitudes(plan: &TestPlan, truth: &Nominal) -> Result<Vec<f64>, GapError> {
    let modes = truth.specimen.modes(plan.modes, Mesh::SIMULATION)?;
    let all: Vec<f64> = plan
        .configurations
        .iter()
        .map(|one| joint_amplitude(&modes, (one.tap, one.level), 0..plan.modes))
        .collect();
    let most = all.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    Ok(all.into_iter().map(|amplitude| amplitude / most).collect())
}

struct Scene<'a> {
    plan: &'a TestPlan,
    truth: &'a Nominal,
    effects: &'a [Effect],
    random: &'a mut ChaCha8Rng,
}

impl Scene<'_> {
    fn normal(&mut self) -> f64 {
        self.plan.scatter * self.random.sample::<f64, _>(StandardNormal)
    }

    /// The mean of the taps and the standard deviation that their scatter suggests.
    fn measured(&mut self, value: f64, std: f64) -> Observed {
        let value = value + std * self.normal();
        if self.plan.taps < 2 || self.plan.scatter == 0.0 {
            let freedom = None;
            return Observed {
                value,
                std,
                freedom,
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
        let sensors: Vec<SensorPlace> = planned
            .sensors
            .iter()
            .map(|(name, position)| SensorPlace {
                position: *position,
                mass: self.truth.mass_of(name),
            })
            .collect();
        let masses: Vec<(f64, f64)> = sensors.iter().map(|s| (s.position, s.mass)).collect();
        let mut nominal = self.truth.with_masses(&masses);
        nominal.masses.extend_from_slice(&planned.masses);
        self.drift(&mut nominal);
        let power = self.power();
        let circumstances = |level: f64| Circumstances {
            sensors: &sensors,
            level,
            ..Circumstances::default()
        };
        let seen = apply(
            self.effects,
            &nominal,
            &circumstances(amplitude * effective_share(power)),
        );
        let modes = self.solve(&seen.specimen)?;
        // Along the decay: the frequency at the two amplitudes between which it is followed.
        let ends = ENDS
            .map(|share| apply(self.effects, &nominal, &circumstances(amplitude * share)).specimen);
        let ends = [self.solve(&ends[0])?, self.solve(&ends[1])?];
        let scale = (
            seen.frequency_scale,
            seen.frequency_offset,
            seen.joint_loss_factor,
        );
        let seen_modes = (0..self.plan.modes)
            .map(|mode| self.mode((index, mode), &modes, (scale, &ends)))
            .collect();
        let planned = &self.plan.configurations[index];
        Ok(Configuration {
            file: Some(format!("recording {}", index + 1)),
            recording: Some(index),
            sensors: planned
                .sensors
                .iter()
                .map(|(name, position)| ObservedSensor {
                    name: name.clone(),
                    position: Some(*position),
                })
                .collect(),
            masses: planned.masses.clone(),
            tap: Some(planned.tap),
            peak_force: Some(planned.level),
            level: Some(planned.level),
            taps: self.plan.taps,
            decay_seconds: None,
            band: None,
            modes: seen_modes,
            covariance: None,
            common: 0.0,
            extra_peaks: self.fixture_peak(index, (&modes, &seen)),
        })
    }

    /// The fixture's own mode, where it is strong enough to be read.
    fn fixture_peak(&mut self, index: usize, (own, seen): (&BeamModes, &Seen)) -> Vec<ExtraPeak> {
        let planned = &self.plan.configurations[index];
        let sensors: Vec<f64> = planned.sensors.iter().map(|sensor| sensor.1).collect();
        let read = own.fixture.and_then(|base| {
            let place = (&sensors[..], Some(planned.tap));
            let strength = strength(&own.modes, (base, &own.numbers), place)?;
            (strength.0 > strength.1 + SEEN / DECIBEL).then_some((base, strength.0.exp()))
        });
        let Some((base, constant)) = read else {
            return Vec::new();
        };
        let frequency = seen.read(own.modes.frequencies()[base]);
        let read = self.measured(frequency, frequency * self.plan.frequency_std);
        vec![ExtraPeak {
            frequency: read.value,
            std: Some(read.std),
            level_db: None,
            constant: self.plan.shape_std.map(|_| constant),
            label: UNPAIRED.to_owned(),
        }]
    }

    fn power(&self) -> f64 {
        self.effects
            .iter()
            .find(|effect| effect.id == EffectId::JointNonlinearity)
            .and_then(|effect| effect.value("exponent"))
            .unwrap_or(1.0)
    }

    /// The joint as this visit finds it.
    fn drift(&mut self, specimen: &mut Specimen) {
        let std = self.plan.drift;
        let factors = [(std * self.normal()).exp(), (std * self.normal()).exp()];
        if let SpecimenJoint::Springs { kt, kr, .. } = &mut specimen.joint {
            *kt *= factors[0];
            *kr *= factors[1];
        }
    }

    fn solve(&self, specimen: &Specimen) -> Result<BeamModes, GapError> {
        Ok(specimen.beam_modes(self.plan.modes, Mesh::SIMULATION)?)
    }

    fn mode(
        &mut self,
        (index, number): (usize, usize),
        BeamModes { modes, numbers, .. }: &BeamModes,
        ((scale, offset, loss), ends): ((f64, f64, f64), &[BeamModes; 2]),
    ) -> ObservedMode {
        let mode = numbers[number];
        let true_frequency = modes.frequencies()[mode] * scale + offset;
        let frequency = self.measured(true_frequency, true_frequency * self.plan.frequency_std);
        let planned = self.plan.configurations[index].clone();
        let at = |x: f64| modes.displacement(mode, x);
        let strongest = (0..planned.sensors.len()).max_by(|&a, &b| {
            let size = |sensor: usize| at(planned.sensors[sensor].1).abs();
            size(a).total_cmp(&size(b))
        });
        let shape_std = self.plan.shape_std;
        let reference = strongest.filter(|_| shape_std.is_some());
        // Shapes of unit modal mass are about 2/sqrt(mass) large.
        let beams = self.truth.specimen.body.beams();
        let size = 2.0 / beams.iter().map(tapjoint_beam::Beam::mass).sum::<f64>();
        let constant = reference.zip(shape_std).map(|(sensor, std)| {
            let value = at(planned.sensors[sensor].1) * at(planned.tap);
            self.measured(value, size * std)
        });
        let mut shape = Vec::new();
        for sensor in 0..planned.sensors.len() {
            let (Some(reference), Some(std)) = (reference, shape_std) else {
                continue;
            };
            let std = if sensor == reference { 0.0 } else { std };
            let value = at(planned.sensors[sensor].1) / at(planned.sensors[reference].1);
            shape.push(ShapeValue {
                sensor,
                value: value + std * self.normal(),
                std,
            });
        }
        let damping = self.plan.damping + 0.5 * loss * modes.joint_energy_share(mode);
        let damping_std = self.plan.damping_std;
        let damping = damping_std.map(|std| self.measured(damping, damping * std));
        let end = |k: usize| ends[k].modes.frequencies()[ends[k].numbers[number]];
        let slope = (end(0) / end(1)).ln() / (ENDS[0] / ENDS[1]).ln() * true_frequency;
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
            reference,
            constant,
            amplitude: None,
            decay: slope.map(|slope| along(slope, frequency)),
        }
    }
}

/// Amplitudes between which a decay is followed, over the first one.
const ENDS: [f64; 2] = [0.9, 0.22];

/// The change along the decay; its ends are not observed apart.
fn along(slope: Observed, frequency: Observed) -> AlongDecay {
    let nothing = Observed {
        value: 0.0,
        std: f64::INFINITY,
        freedom: None,
    };
    let end = DecayEnd {
        amplitude: None,
        frequency,
        damping: nothing,
    };
    AlongDecay {
        frequency_slope: slope,
        frequency_change: None,
        damping_slope: nothing,
        early: end,
        late: end,
        verdict: DecayVerdict::Steady,
    }
}
