//! The structure in motion: states of its modes, stepped exactly; pulses that strike it; what the
//! sensors feel.

use num_complex::Complex64;

use super::joint_moment::JointMoment;
use super::joint_motion::JointMotion;
use super::pulse::Pulse;
use super::reduced::{Oscillator, ReducedStructure, Sensed, StruckPlace, seen};

/// So often (steps) states are looked at that may have died down.
const FORGET_EVERY: u64 = 256;
/// Square of a state (m2 kg/s2) that is nothing beside any that was struck.
const NOTHING: f64 = 1e-200;

/// A pulse and where it strikes.
#[derive(Debug, Clone, PartialEq)]
pub struct Strike {
    /// The pulse.
    pub pulse: Pulse,
    /// The place, as the structure feels it.
    pub place: StruckPlace,
}

/// A structure moving in equal steps of time.
#[derive(Debug, Clone)]
pub struct Motion {
    pub(super) structure: ReducedStructure,
    pub(super) oscillators: Vec<Oscillator>,
    /// State of each mode.
    pub(super) states: Vec<Complex64>,
    step: f64,
    start: f64,
    steps: u64,
    advance: Vec<Complex64>,
    sensors: Vec<SensorRow>,
    /// Strikes not over, in the order of time.
    strikes: Vec<Strike>,
    joint: Option<Box<JointMotion>>,
}

/// What one sensor feels.
#[derive(Debug, Clone)]
struct SensorRow {
    derivative: usize,
    /// Factors of real and imaginary part of each state.
    of_states: Vec<[f64; 2]>,
}

impl Motion {
    /// At rest at time `start` (s), to be moved in steps of `step` (s); `sensed` says what each
    /// sensor senses.
    pub fn new(
        structure: ReducedStructure,
        sensed: &[Sensed],
        (start, step): (f64, f64),
        joint: Option<JointMoment>,
    ) -> Self {
        let oscillators: Vec<_> = structure.modes.iter().map(Oscillator::new).collect();
        let sensors = sensed.iter().enumerate();
        let joint =
            joint.map(|law| Box::new(JointMotion::new(law, &structure, &oscillators, step)));
        Self {
            sensors: sensors
                .map(|(index, sensed)| SensorRow::new(index, *sensed, &structure, &oscillators))
                .collect(),
            states: vec![Complex64::ZERO; oscillators.len()],
            advance: oscillators
                .iter()
                .map(|oscillator| (oscillator.pole * step).exp())
                .collect(),
            structure,
            oscillators,
            step,
            start,
            steps: 0,
            strikes: Vec::new(),
            joint,
        }
    }

    /// Lets a pulse strike; it must not have begun yet.
    pub fn strike(&mut self, strike: Strike) {
        self.strikes.push(strike);
    }

    /// The time reached (s).
    pub fn time(&self) -> f64 {
        self.start + self.steps as f64 * self.step
    }

    /// Length of a step (s).
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Moves on by one step.
    pub fn advance(&mut self) {
        let (from, to) = (
            self.time(),
            self.start + (self.steps + 1) as f64 * self.step,
        );
        self.strikes.retain(|strike| strike.pulse.end() > from);
        match &mut self.joint {
            Some(joint) => {
                joint.advance((&self.oscillators, &mut self.states), &self.strikes, from)
            }
            None => {
                for (state, advance) in self.states.iter_mut().zip(&self.advance) {
                    *state *= advance;
                }
                let under_way = self.strikes.iter().filter(|strike| strike.pulse.start < to);
                for strike in under_way {
                    drive(&self.oscillators, strike, (from, to), &mut self.states);
                }
            }
        }
        self.steps += 1;
        if self.steps.is_multiple_of(FORGET_EVERY) {
            self.forget_what_has_died_down();
        }
    }

    /// Sets states to zero that have decayed beyond all meaning. Left alone they would end as the
    /// smallest numbers there are, which rounding keeps from vanishing and processors handle slowly.
    fn forget_what_has_died_down(&mut self) {
        let gone = self
            .states
            .iter_mut()
            .filter(|state| state.norm_sqr() < NOTHING);
        gone.for_each(|state| *state = Complex64::ZERO);
    }

    /// Force of the hammer now (N).
    pub fn force(&self) -> f64 {
        let time = self.time();
        let pulses = self
            .strikes
            .iter()
            .map(|strike| strike.pulse.force(time)[0]);
        pulses.sum()
    }

    /// What each sensor feels now, in SI units.
    pub fn responses(&self, out: &mut [f64]) {
        for (row, out) in self.sensors.iter().zip(out.iter_mut()) {
            *out = seen(&row.of_states, &self.states);
        }
        let time = self.time();
        for strike in &self.strikes {
            let force = strike.pulse.force(time);
            if force[0] != 0.0 || force[2] != 0.0 {
                self.add_direct(
                    &strike.place.to_sensors,
                    (&strike.place.at_modes, force),
                    out,
                );
            }
        }
        if let Some(joint) = &self.joint {
            self.add_joint(joint, out);
        }
    }

    /// What a force brings to the sensors at once: through the modes' acceleration, and through the
    /// modes left out, which follow it like springs.
    fn add_direct(
        &self,
        compliance: &[f64],
        (at_modes, force): (&[f64], [f64; 3]),
        out: &mut [f64],
    ) {
        for (sensor, (row, out)) in self.sensors.iter().zip(out.iter_mut()).enumerate() {
            *out += compliance.get(sensor).copied().unwrap_or(0.0) * force[row.derivative];
            if row.derivative == 2 {
                let modes = self.structure.modes.iter().zip(at_modes);
                let share: f64 = modes.map(|(mode, at)| mode.at_sensors[sensor] * at).sum();
                *out += share * force[0];
            }
        }
    }

    fn add_joint(&self, joint: &JointMotion, out: &mut [f64]) {
        let moment = joint.moment();
        if moment == [0.0; 3] {
            return;
        }
        for (sensor, (row, out)) in self.sensors.iter().zip(out.iter_mut()).enumerate() {
            let compliance = self.structure.joint_to_sensors.get(sensor);
            *out += compliance.copied().unwrap_or(0.0) * moment[row.derivative];
            if row.derivative == 2 {
                let modes = self.structure.modes.iter();
                let share: f64 = modes
                    .map(|mode| mode.at_sensors[sensor] * mode.at_joint)
                    .sum();
                *out += share * moment[0];
            }
        }
    }

    /// Rotation of the joint's spring now (rad), between strikes.
    pub fn joint_rotation(&self) -> f64 {
        let of_modes: f64 = self
            .structure
            .modes
            .iter()
            .zip(self.oscillators.iter().zip(&self.states))
            .map(|(mode, (oscillator, state))| mode.at_joint * oscillator.motion(*state, 0.0)[0])
            .sum();
        let moment = self.joint.as_ref().map_or(0.0, |joint| joint.moment()[0]);
        of_modes + self.structure.joint_compliance * moment
    }

    /// Energy of the structure (J), kinetic and elastic, between strikes: that of the modes, of the
    /// modes left out, and what the joint stores beyond its linear spring.
    pub fn energy(&self) -> f64 {
        let modes: f64 = self
            .oscillators
            .iter()
            .zip(&self.states)
            .map(|(oscillator, state)| oscillator.energy(*state))
            .sum();
        let joint = self.joint.as_ref().map_or(0.0, |joint| {
            joint.stored() + 0.5 * self.structure.joint_compliance * joint.moment()[0].powi(2)
        });
        modes + joint
    }

    /// Energy lost in the joint's slip so far (J).
    pub fn joint_loss(&self) -> f64 {
        self.joint.as_ref().map_or(0.0, |joint| joint.loss())
    }

    /// Steps that met the finest division before they met their tolerance: kinks of the sliders.
    pub fn forced_steps(&self) -> u64 {
        self.joint.as_ref().map_or(0, |joint| joint.forced_steps())
    }
}

/// Adds to every state what a strike does over a span of time (s).
pub(super) fn drive(
    oscillators: &[Oscillator],
    strike: &Strike,
    span: (f64, f64),
    states: &mut [Complex64],
) {
    let modes = oscillators.iter().zip(&strike.place.at_modes);
    for (state, (oscillator, at)) in states.iter_mut().zip(modes) {
        *state += *at * strike.pulse.drive(oscillator.pole, span);
    }
}

impl SensorRow {
    fn new(
        sensor: usize,
        sensed: Sensed,
        structure: &ReducedStructure,
        oscillators: &[Oscillator],
    ) -> Self {
        let derivative = sensed.derivative();
        let modes = structure.modes.iter().zip(oscillators);
        let of_states = modes
            .map(|(mode, oscillator)| {
                let shape = mode.at_sensors.get(sensor).copied().unwrap_or(0.0);
                [Complex64::ONE, Complex64::I]
                    .map(|unit| shape * oscillator.motion(unit, 0.0)[derivative])
            })
            .collect();
        Self {
            derivative,
            of_states,
        }
    }
}
