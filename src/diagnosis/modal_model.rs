//! Modes of one configuration's structure under a hypothesis, and what follows from them: shares of the joint, the motion of
//! the joint, and how strong a fixture's mode is.

use crate::joint_motion::{
    JointMotion, ModeAmplitude, StiffnessChanges, initial_amplitude, log_stiffness,
};
use crate::set_up::SetUp;
use crate::structure::{Arrangement, COUPLING, ROTATION};
use std::f64::consts::TAU;
use std::sync::Arc;
use tapjoint_beam::effects::Seen;
use tapjoint_beam::specimen::{BeamModes, Joint, PlaceMotion, SpecimenModes};
use tapjoint_identify::observation::Configuration;
use tapjoint_numerics::stats::median;

/// Structure of a configuration under a hypothesis, and its modes.
#[derive(Clone)]
pub struct ModalModel {
    /// The structure with its effects.
    pub seen: Seen,
    /// Where sensors and hammer are.
    pub set_up: SetUp,
    /// Its modes, or those of a structure next to it.
    pub own: Arc<BeamModes>,
    /// Its frequencies (Hz), where the modes are those of a structure next to it.
    pub frequencies: Option<Vec<f64>>,
    /// Stiffnesses that its modes feel of a joint whose stiffness depends on the amplitude.
    pub stiffness_changes: Option<StiffnessChanges>,
    /// Positions (m) of sensors, masses and taps, each with the motion of every mode.
    places: Vec<(f64, Vec<PlaceMotion>)>,
}

impl ModalModel {
    /// Returns the model with these modes.
    pub fn new(
        seen: Seen,
        set_up: SetUp,
        own: Arc<BeamModes>,
        frequencies: Option<Vec<f64>>,
        stiffness_changes: Option<StiffnessChanges>,
    ) -> Self {
        let masses = set_up.sensors.iter().chain(&set_up.fastened);
        let positions = masses.map(|one| one.position).chain(set_up.tap);
        let places = positions.map(|position| (position, own.modes.motions_at(position)));
        Self {
            places: places.collect(),
            seen,
            set_up,
            own,
            frequencies,
            stiffness_changes,
        }
    }

    /// Returns the motion of the mode with this index at a position (m).
    pub fn motion(&self, index: usize, position: f64) -> PlaceMotion {
        let known = self.places.iter().find(|one| one.0 == position);
        known.map_or_else(
            || self.modes().motion_at(index, position),
            |(_, all)| all[index],
        )
    }

    /// All modes, that of a fixture among them.
    pub fn modes(&self) -> &SpecimenModes {
        &self.own.modes
    }

    /// Index of the mode with this number (1 = lowest); the mode of a fixture has no number.
    pub fn index(&self, mode: usize) -> Option<usize> {
        self.own.numbers.get(mode - 1).copied()
    }

    /// Angular frequency of a mode by its index (rad/s).
    pub fn omega(&self, index: usize) -> f64 {
        TAU * self.modes().frequencies()[index]
    }

    /// Returns the frequency as it is measured (Hz).
    pub fn frequency(&self, mode: usize) -> Option<f64> {
        let index = self.index(mode)?;
        let all = self.frequencies.as_deref();
        Some(
            self.seen
                .read(all.unwrap_or(self.modes().frequencies())[index]),
        )
    }

    /// Returns the frequency of the fixture's own mode as it is measured (Hz), and its index.
    pub fn fixture_frequency(&self) -> Option<(usize, f64)> {
        let index = self.own.fixture?;
        Some((index, self.seen.read(self.modes().frequencies()[index])))
    }

    /// Returns the share of each spring of the joint in the strain energy of a mode, q_t F_t/omega^2 for a shape of
    /// unit modal mass that deforms the joint by q against the forces F = K q. With coupled springs the
    /// shares belong to the stiffnesses at a fixed coupling: dK/d ln k_t = (E_t K + K E_t)/2.
    pub fn joint_shares(&self, index: usize) -> [f64; 2] {
        let Some(Joint { kt, kr, coupling }) = self.seen.specimen.joint else {
            return [0.0; 2];
        };
        let q = self.modes().joint_motion(index);
        let omega = self.omega(index);
        let square = 1.0 - coupling * coupling;
        let mut shares = [0.0; 2];
        for (own, [stiffness, other]) in [[kt, kr], [kr, kt]].into_iter().enumerate() {
            // A rigid spring holds no energy; its deformation is 0 and its stiffness infinite.
            if stiffness.is_finite() {
                let cross = if coupling == 0.0 {
                    0.0
                } else {
                    coupling * (stiffness * other).sqrt() * q[1 - own]
                };
                shares[own] = q[own] * (stiffness * q[own] + cross) / square / (omega * omega);
            }
        }
        shares
    }

    /// Returns d ln f/d ln kr of a mode.
    pub fn rotation_sensitivity(&self, index: usize) -> f64 {
        0.5 * self.joint_shares(index)[ROTATION]
    }

    /// Returns d ln f/d ln k of all modes for a spring of the joint, or d ln f/d coupling: half the strain energy of that
    /// spring in the mode over that of the structure (Rayleigh's quotient is stationary in the shape).
    pub fn joint_slopes(&self, direction: usize) -> Vec<f64> {
        const STEP: f64 = 1e-4;
        let based = self.seen.specimen.base.is_some_and(|base| base.ratio > 0.0);
        if !based && direction != COUPLING {
            return (0..self.modes().len())
                .map(|index| 0.5 * self.joint_shares(index)[direction])
                .collect();
        }
        // By Rayleigh's quotient of a changed structure. The base's spring is tied to the joint's by their ratio: both
        // move.
        let mut other = self.seen.specimen.clone();
        if let Some(Joint { kt, kr, coupling }) = &mut other.joint {
            match direction {
                0 => *kt *= STEP.exp(),
                COUPLING => *coupling += STEP,
                _ => *kr *= STEP.exp(),
            }
        }
        let own = self.modes().frequencies();
        match self.modes().rayleigh_frequencies(&other) {
            Ok(moved) => (moved.iter().zip(own))
                .map(|(moved, own)| (moved / own).ln() / STEP)
                .collect(),
            Err(_) => vec![0.0; own.len()],
        }
    }

    /// Returns d ln(s f + b)/d ln f = s f/(s f + b): a constant bias b does not move with the structure.
    pub fn offset_factor(&self, index: usize) -> f64 {
        let own = self.modes().frequencies()[index] * self.seen.frequency_scale;
        own / (own + self.seen.frequency_offset)
    }

    /// Returns the difference of a mode's frequency to that of the structure as it was solved (logarithm): the mode
    /// feels another stiffness than the mean of all modes.
    pub fn own_change(&self, mode: usize) -> f64 {
        let Some(changes) = &self.stiffness_changes else {
            return 0.0;
        };
        let (Some(own), Some(index)) = (changes.of(mode), self.index(mode)) else {
            return 0.0;
        };
        self.rotation_sensitivity(index) * (log_stiffness(own) - log_stiffness(changes.mean))
    }

    /// Returns the motion of the joint from the amplitudes that were observed at the sensors; `None`
    /// where no amplitude is known. Taps without a position count as if they were at the sensor: the sign of a mode shape
    /// by itself means nothing.
    pub fn joint_motion(
        &self,
        configuration: &Configuration,
        arrangement: &Arrangement,
    ) -> Option<JointMotion> {
        let mut modes = Vec::new();
        for mode in &configuration.modes {
            let (Some((amplitude, damping)), Some(reference), Some(index)) = (
                initial_amplitude(mode),
                mode.reference,
                self.index(mode.mode),
            ) else {
                continue;
            };
            let rotation = self.modes().joint_motion(index)[ROTATION];
            let sensor = configuration.sensors.get(reference)?.position?;
            let at_sensor = self.modes().middle_displacement(index, sensor);
            let tap = arrangement.tap;
            let at_tap = tap.map_or(at_sensor, |tap| {
                self.modes().middle_displacement(index, tap)
            });
            let omega = TAU * mode.frequency;
            let size = (amplitude * rotation / at_sensor).abs();
            if size.is_finite() {
                modes.push(ModeAmplitude {
                    mode: mode.mode,
                    amplitude: size.copysign(rotation * at_tap),
                    omega,
                    rate: damping * omega,
                });
            }
        }
        let seconds = configuration.decay_seconds.unwrap_or(f64::INFINITY);
        (!modes.is_empty()).then_some(JointMotion { modes, seconds })
    }
}

/// Returns the amplitude of the joint's rotation after a tap at a position (m) at a level (1), in units of the tap's
/// force: sqrt(sum (phi_i(tap) theta_i/omega_i)^2) over these modes.
pub fn joint_amplitude(
    modes: &SpecimenModes,
    tap: f64,
    level: f64,
    which: impl Iterator<Item = usize>,
) -> f64 {
    let squares = which.map(|mode| {
        let omega = TAU * modes.frequencies()[mode];
        (modes.middle_displacement(mode, tap) * modes.joint_motion(mode)[ROTATION] / omega).powi(2)
    });
    level * squares.sum::<f64>().sqrt()
}

/// Logarithms of the modal constants (1/kg) at the strongest sensor that decide whether a fixture's mode is read.
#[derive(Debug, Clone, Copy)]
pub struct FixtureStrength {
    /// That of the fixture's own mode.
    pub own: f64,
    /// Median of the beam's modes.
    pub median: f64,
}

/// Returns the strength of the fixture's mode `fixture` beside the beam's modes `numbers`; without a position of the
/// taps as if they were at the strongest sensor.
pub fn fixture_strength(
    modes: &SpecimenModes,
    fixture: usize,
    numbers: &[usize],
    sensors: &[f64],
    tap: Option<f64>,
) -> Option<FixtureStrength> {
    let mut all: Vec<f64> = Vec::new();
    for mode in numbers.iter().chain([&fixture]) {
        let at_sensors = sensors
            .iter()
            .map(|x| modes.middle_displacement(*mode, *x).abs());
        let most = at_sensors.fold(0.0, f64::max);
        let at_tap = tap.map_or(most, |tap| modes.middle_displacement(*mode, tap).abs());
        all.push((most * at_tap).ln());
    }
    let own = all.pop()?;
    if all.is_empty() || sensors.is_empty() {
        return None;
    }
    let median = median(&mut all);
    (own.is_finite() && median.is_finite()).then_some(FixtureStrength { own, median })
}
