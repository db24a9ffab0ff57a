//! The structure in motion: the states of its modes, stepped exactly, the pulses that strike it, and the
//! signals at the sensors.
//!
//! The extra moment of a non-linear joint is solved for at the nodes of each step. Steps are halved until
//! the polynomial through the nodes follows the moment.

use super::hammer::Pulse;
use super::joint_moment::{
    Collocation, Extra, JointMoment, MIDDLE, NODES, PLACES, at_middle, derivatives_at_end, places,
};
use super::observed_structure::{Oscillator, ReducedStructure, Sensed, StruckPlace, seen};
use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

/// Number of steps between looks for states that have died down.
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
    structure: ReducedStructure,
    modes: MovingModes,
    step: f64,
    start: f64,
    steps: u64,
    advance: Vec<Complex64>,
    sensors: Vec<SensorRow>,
    /// Strikes not over, in the order of time.
    strikes: Vec<Strike>,
    joint: Option<Box<JointMotion>>,
}

/// The modes and their present states.
#[derive(Debug, Clone)]
struct MovingModes {
    oscillators: Vec<Oscillator>,
    /// State of each mode.
    states: Vec<Complex64>,
}

impl MovingModes {
    /// Adds to every state what a strike causes between two times (s).
    fn drive(&mut self, strike: &Strike, from: f64, to: f64) {
        let modes = self.oscillators.iter().zip(&strike.place.at_modes);
        for (state, (oscillator, at)) in self.states.iter_mut().zip(modes) {
            *state += *at * strike.pulse.drive(oscillator.pole, from, to);
        }
    }
}

/// Factors by which the signal of one sensor follows from the states.
#[derive(Debug, Clone)]
struct SensorRow {
    derivative: usize,
    /// Factors of real and imaginary part of each state.
    of_states: Vec<[f64; 2]>,
}

impl Motion {
    /// Returns the structure at rest at time `start` (s), to be moved in steps of `step` (s). `sensed` is
    /// the quantity of each sensor.
    pub fn new(
        structure: ReducedStructure,
        sensed: &[Sensed],
        start: f64,
        step: f64,
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
            advance: oscillators
                .iter()
                .map(|oscillator| (oscillator.pole * step).exp())
                .collect(),
            modes: MovingModes {
                states: vec![Complex64::ZERO; oscillators.len()],
                oscillators,
            },
            structure,
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
        let from = self.time();
        let to = self.start + (self.steps + 1) as f64 * self.step;
        self.strikes.retain(|strike| strike.pulse.end() > from);
        match &mut self.joint {
            Some(joint) => joint.advance(&mut self.modes, &self.strikes, from),
            None => {
                for (state, advance) in self.modes.states.iter_mut().zip(&self.advance) {
                    *state *= advance;
                }
                let under_way = self.strikes.iter().filter(|strike| strike.pulse.start < to);
                for strike in under_way {
                    self.modes.drive(strike, from, to);
                }
            }
        }
        self.steps += 1;
        if self.steps.is_multiple_of(FORGET_EVERY) {
            // States that have decayed would end as the smallest numbers there are: rounding keeps these
            // from vanishing, and processors handle them slowly.
            for state in &mut self.modes.states {
                if state.norm_sqr() < NOTHING {
                    *state = Complex64::ZERO;
                }
            }
        }
    }

    /// Force of the hammer now (N).
    pub fn force(&self) -> f64 {
        let (time, strikes) = (self.time(), self.strikes.iter());
        strikes.map(|strike| strike.pulse.force(time)[0]).sum()
    }

    /// Writes the signal of each sensor now, in SI units.
    pub fn responses(&self, out: &mut [f64]) {
        for (row, out) in self.sensors.iter().zip(out.iter_mut()) {
            *out = seen(&row.of_states, &self.modes.states);
        }
        let time = self.time();
        for strike in &self.strikes {
            let force = strike.pulse.force(time);
            if force[0] != 0.0 || force[2] != 0.0 {
                self.add_direct(&strike.place, force, out);
            }
        }
        if let Some(joint) = &self.joint {
            let moment = joint.moment();
            if moment != [0.0; 3] {
                self.add_direct(&joint.place, moment, out);
            }
        }
    }

    /// Adds what a force, given with its first and second derivative, brings to the sensors at once: through
    /// the modes' acceleration, and through the modes left out, which follow it like springs.
    fn add_direct(&self, place: &StruckPlace, force: [f64; 3], out: &mut [f64]) {
        for (sensor, (row, out)) in self.sensors.iter().zip(out.iter_mut()).enumerate() {
            let compliance = place.to_sensors.get(sensor).copied().unwrap_or(0.0);
            *out += compliance * force[row.derivative];
            if row.derivative == 2 {
                let modes = self.structure.modes.iter().zip(&place.at_modes);
                let share: f64 = modes.map(|(mode, at)| mode.at_sensors[sensor] * at).sum();
                *out += share * force[0];
            }
        }
    }

    /// Rotation of the joint's spring now (rad), between strikes.
    pub fn joint_rotation(&self) -> f64 {
        let moving = self.modes.oscillators.iter().zip(&self.modes.states);
        let modes = self.structure.modes.iter().zip(moving);
        let of_modes: f64 = modes
            .map(|(mode, (oscillator, state))| mode.at_joint * oscillator.motion(*state, 0.0)[0])
            .sum();
        let moment = self.joint.as_ref().map_or(0.0, |joint| joint.moment()[0]);
        of_modes + self.structure.joint_compliance * moment
    }

    /// Energy of the structure (J), kinetic and elastic, between strikes: that of the modes, of the
    /// modes left out, and what the joint stores beyond its linear spring.
    pub fn energy(&self) -> f64 {
        let moving = self.modes.oscillators.iter().zip(&self.modes.states);
        let modes: f64 = moving
            .map(|(oscillator, state)| oscillator.energy(*state))
            .sum();
        let joint = self.joint.as_ref().map_or(0.0, |joint| {
            joint.law.stored(joint.rotation, &joint.memory)
                + 0.5 * self.structure.joint_compliance * joint.moment()[0].powi(2)
        });
        modes + joint
    }

    /// Energy lost in the joint's slip so far (J).
    pub fn joint_loss(&self) -> f64 {
        self.joint.as_ref().map_or(0.0, |joint| joint.loss)
    }

    /// Steps that met the finest division before they met their tolerance: kinks of the sliders.
    pub fn forced_steps(&self) -> u64 {
        self.joint.as_ref().map_or(0, |joint| joint.forced)
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

/// Finest division of a step: into 2^6 parts.
const FINEST: usize = 6;
/// Largest difference between moment and polynomial in the middle of a step, relative to the moment
/// of the linear spring at the present amplitude, of an elastic joint. Energy is then kept to some 1e-9
/// in a thousand periods.
const ELASTIC_TOLERANCE: f64 = 1e-8;
/// Largest difference where sliders make kinks, which no polynomial follows.
const SLIP_TOLERANCE: f64 = 1e-6;
/// Newton's steps; three or four are usual, and what needs more needs a shorter step.
const ITERATIONS: usize = 12;

/// The joint as it moves.
#[derive(Debug, Clone)]
struct JointMotion {
    law: JointMoment,
    /// The joint as a place on which its moment acts.
    place: StruckPlace,
    tolerance: f64,
    /// For each division of the step.
    collocations: Vec<Collocation>,
    /// Rotation by the imaginary part of each mode's state.
    rotation_of: Vec<f64>,
    division: usize,
    /// Rotations at which the sliders stand (rad).
    memory: Vec<f64>,
    /// Their rotations at each place of the step under trial.
    trial: [Vec<f64>; PLACES],
    rotation: f64,
    /// Moment on the structure, -(M - k theta), at the nodes of the last step.
    moments: [f64; NODES],
    last_step: f64,
    loss: f64,
    forced: u64,
}

/// One step that was solved.
struct Solved {
    moments: [f64; NODES],
    rotation: f64,
    loss: f64,
    /// Difference of moment and polynomial in the middle (N m).
    defect: f64,
}

impl JointMotion {
    fn new(
        law: JointMoment,
        structure: &ReducedStructure,
        oscillators: &[Oscillator],
        step: f64,
    ) -> Self {
        let slots = law.memory();
        Self {
            tolerance: match law {
                JointMoment::Elastic { .. } => ELASTIC_TOLERANCE,
                JointMoment::MicroSlip { .. } => SLIP_TOLERANCE,
            },
            place: StruckPlace {
                at_modes: structure.modes.iter().map(|mode| mode.at_joint).collect(),
                to_sensors: structure.joint_to_sensors.clone(),
                to_joint: structure.joint_compliance,
            },
            collocations: (0..=FINEST)
                .map(|division| {
                    let part = step / f64::from(1u32 << division);
                    Collocation::new(structure, oscillators, part)
                })
                .collect(),
            rotation_of: (structure.modes.iter().zip(oscillators))
                .map(|(mode, oscillator)| mode.at_joint / oscillator.pole.im)
                .collect(),
            division: 0,
            memory: vec![0.0; slots],
            trial: std::array::from_fn(|_| vec![0.0; slots]),
            rotation: 0.0,
            moments: [0.0; NODES],
            last_step: step,
            loss: 0.0,
            forced: 0,
            law,
        }
    }

    /// Moves modes and joint on by the whole step that begins at `time` (s).
    fn advance(&mut self, modes: &mut MovingModes, strikes: &[Strike], time: f64) {
        const WHOLE: usize = 1 << FINEST;
        let mut ticks = 0;
        while ticks < WHOLE {
            let step = self.collocations[self.division].step;
            let now = time + ticks as f64 * self.collocations[FINEST].step;
            let solved = self.solve(modes, strikes, now);
            let allowed = self.tolerance * self.law.stiffness() * self.amplitude(&modes.states);
            let fine = solved.as_ref().is_some_and(|solved| {
                // Where nothing moves there is nothing to be accurate about.
                solved.defect <= allowed.max(f64::MIN_POSITIVE)
            });
            if !fine && self.division < FINEST {
                self.division += 1;
                continue;
            }
            let defect = solved
                .as_ref()
                .map_or(f64::INFINITY, |solved| solved.defect);
            self.forced += u64::from(!fine);
            self.accept(solved, modes, strikes, now, now + step);
            ticks += WHOLE >> self.division;
            // Halving the step divides the defect by 16; a coarser one must begin at its own tick.
            let coarser = WHOLE >> self.division.saturating_sub(1);
            if defect < allowed / 64.0 && self.division > 0 && ticks.is_multiple_of(coarser) {
                self.division -= 1;
            }
        }
    }

    /// No rotation is larger than this (rad), whatever the phases.
    fn amplitude(&self, states: &[Complex64]) -> f64 {
        let modes = self.rotation_of.iter().zip(states);
        modes.map(|(of, state)| of.abs() * state.norm()).sum()
    }

    /// Rotation at each place without the joint's extra moment of this step, but that at its start.
    fn free_rotations(&self, modes: &MovingModes, strikes: &[Strike], time: f64) -> [f64; PLACES] {
        let collocation = &self.collocations[self.division];
        let mut rotations = [0.0; PLACES];
        for (place, rotation) in rotations.iter_mut().enumerate() {
            *rotation = seen(&collocation.rotation[place], &modes.states)
                + collocation.influence[place][0] * self.moments[NODES - 1];
        }
        let end = time + collocation.step;
        for strike in strikes.iter().filter(|strike| strike.pulse.start < end) {
            for (rotation, part) in rotations.iter_mut().zip(places()) {
                let at = time + part * collocation.step;
                *rotation += strike.place.to_joint * strike.pulse.force(at)[0];
                let struck = modes.oscillators.iter().zip(&strike.place.at_modes);
                for ((oscillator, at_mode), of) in struck.zip(&self.rotation_of) {
                    let driven = strike.pulse.drive(oscillator.pole, time, at);
                    *rotation += of * at_mode * driven.im;
                }
            }
        }
        rotations
    }

    /// Solves for the moments at the nodes by Newton's method; `None` where it does not settle.
    fn solve(&mut self, modes: &MovingModes, strikes: &[Strike], time: f64) -> Option<Solved> {
        let free = self.free_rotations(modes, strikes, time);
        let influence = self.collocations[self.division].influence;
        let scale = self.amplitude(&modes.states).max(free[2].abs());
        let mut rotations = Vector3::new(free[0], free[1], free[2]);
        let mut settled = false;
        let mut extras = [Extra::default(); 3];
        for _ in 0..ITERATIONS {
            extras = self.follow(&rotations);
            let mut error = Vector3::zeros();
            let mut slope = Matrix3::identity();
            for (row, influence) in influence.iter().take(3).enumerate() {
                error[row] = rotations[row] - free[row];
                for (column, extra) in extras.iter().enumerate() {
                    // rotation = free + influence (-extra moment).
                    error[row] += influence[column + 1] * extra.moment;
                    slope[(row, column)] += influence[column + 1] * extra.slope;
                }
            }
            let change = slope.lu().solve(&error)?;
            rotations -= change;
            settled = change.amax() <= 1e-13 * scale;
            if settled {
                break;
            }
        }
        settled.then(|| self.solved(&rotations, extras, &free))
    }

    /// The moment along the nodes, from where the sliders stand.
    fn follow(&mut self, rotations: &Vector3<f64>) -> [Extra; 3] {
        let [first, second, third, _] = &mut self.trial;
        [
            self.law.follow(rotations[0], &self.memory, first),
            self.law.follow(rotations[1], first, second),
            self.law.follow(rotations[2], second, third),
        ]
    }

    fn solved(
        &mut self,
        rotations: &Vector3<f64>,
        extras: [Extra; 3],
        free: &[f64; PLACES],
    ) -> Solved {
        let [first, second, end] = extras.map(|extra| -extra.moment);
        let moments = [self.moments[NODES - 1], first, second, end];
        let influence = self.collocations[self.division].influence[MIDDLE];
        let middle =
            free[MIDDLE] + influence[1] * first + influence[2] * second + influence[3] * end;
        let [before, _, _, scratch] = &mut self.trial;
        let wanted = -self.law.follow(middle, before, scratch).moment;
        let polynomial: f64 = at_middle().iter().zip(moments).map(|(w, u)| w * u).sum();
        Solved {
            moments,
            rotation: rotations[2],
            loss: extras.iter().map(|extra| extra.loss).sum(),
            defect: (wanted - polynomial).abs(),
        }
    }

    fn accept(
        &mut self,
        solved: Option<Solved>,
        modes: &mut MovingModes,
        strikes: &[Strike],
        from: f64,
        to: f64,
    ) {
        let collocation = &self.collocations[self.division];
        // What did not settle on the finest step keeps its moment.
        let held = [self.moments[NODES - 1]; NODES];
        let moments = solved.as_ref().map_or(held, |solved| solved.moments);
        let factors = collocation.advance.iter().zip(&collocation.drive);
        for (state, (advance, drive)) in modes.states.iter_mut().zip(factors) {
            *state *= advance;
            for (factor, moment) in drive.iter().zip(moments) {
                *state += factor * moment;
            }
        }
        for strike in strikes.iter().filter(|strike| strike.pulse.start < to) {
            modes.drive(strike, from, to);
        }
        self.moments = moments;
        self.last_step = collocation.step;
        if let Some(solved) = solved {
            self.rotation = solved.rotation;
            self.loss += solved.loss;
            self.memory.clone_from(&self.trial[2]);
        }
    }

    /// The moment on the structure now (N m) with its first and second derivative in time.
    fn moment(&self) -> [f64; 3] {
        let [first, second] = derivatives_at_end().map(|factors| {
            let terms = factors.iter().zip(self.moments);
            terms.map(|(factor, moment)| factor * moment).sum::<f64>()
        });
        let step = self.last_step;
        [
            self.moments[NODES - 1],
            first / step,
            second / (step * step),
        ]
    }
}
