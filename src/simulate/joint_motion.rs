//! The joint's extra moment in time: solved for at the nodes of each step, with steps halved until
//! the polynomial between the nodes is the moment.

use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

use super::collocation::{
    Collocation, MIDDLE, NODES, PLACES, at_middle, derivatives_at_end, places,
};
use super::joint_moment::{Extra, JointMoment};
use super::motion::{Strike, drive};
use super::reduced::{Oscillator, ReducedStructure, seen};

/// Finest division of a step: into 2^6 parts.
const FINEST: usize = 6;
/// Largest difference between moment and polynomial in the middle of a step, relative to the moment
/// of the linear spring at the present amplitude, of an elastic joint. Energy is then kept to some 1e-9
/// in a thousand periods.
const ELASTIC_TOLERANCE: f64 = 1e-8;
/// The same where sliders make kinks, which no polynomial follows.
const SLIP_TOLERANCE: f64 = 1e-6;
/// Newton's steps; three or four are usual, and what needs more needs a shorter step.
const ITERATIONS: usize = 12;

/// The joint as it moves.
#[derive(Debug, Clone)]
pub(super) struct JointMotion {
    law: JointMoment,
    tolerance: f64,
    /// For each division of the step.
    collocations: Vec<Collocation>,
    /// Rotation by the imaginary part of each mode's state.
    rotation_of: Vec<f64>,
    division: usize,
    /// Where the sliders stand.
    memory: Vec<f64>,
    /// Where they stand at each place of the step under trial.
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
    pub(super) fn new(
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
            collocations: (0..=FINEST)
                .map(|division| {
                    let part = step / f64::from(1u32 << division);
                    Collocation::new(structure, oscillators, part)
                })
                .collect(),
            rotation_of: structure
                .modes
                .iter()
                .zip(oscillators)
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
    pub(super) fn advance(
        &mut self,
        (oscillators, states): (&[Oscillator], &mut [Complex64]),
        strikes: &[Strike],
        time: f64,
    ) {
        const WHOLE: usize = 1 << FINEST;
        let mut ticks = 0;
        while ticks < WHOLE {
            let step = self.collocations[self.division].step;
            let now = time + ticks as f64 * self.collocations[FINEST].step;
            let solved = self.solve((oscillators, states), strikes, now);
            let allowed = self.tolerance * self.law.stiffness() * self.amplitude(states);
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
            self.accept(solved, (oscillators, states), strikes, (now, now + step));
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
    fn free_rotations(
        &self,
        (oscillators, states): (&[Oscillator], &[Complex64]),
        strikes: &[Strike],
        time: f64,
    ) -> [f64; PLACES] {
        let collocation = &self.collocations[self.division];
        let mut rotations = [0.0; PLACES];
        for (place, rotation) in rotations.iter_mut().enumerate() {
            *rotation = seen(&collocation.rotation[place], states)
                + collocation.influence[place][0] * self.moments[NODES - 1];
        }
        let end = time + collocation.step;
        for strike in strikes.iter().filter(|strike| strike.pulse.start < end) {
            for (rotation, part) in rotations.iter_mut().zip(places()) {
                let at = time + part * collocation.step;
                *rotation += strike.place.to_joint * strike.pulse.force(at)[0];
                let modes = oscillators.iter().zip(&strike.place.at_modes);
                for ((oscillator, at_mode), of) in modes.zip(&self.rotation_of) {
                    let driven = strike.pulse.drive(oscillator.pole, (time, at));
                    *rotation += of * at_mode * driven.im;
                }
            }
        }
        rotations
    }

    /// Solves for the moments at the nodes by Newton's method; `None` where it does not settle.
    fn solve(
        &mut self,
        (oscillators, states): (&[Oscillator], &[Complex64]),
        strikes: &[Strike],
        time: f64,
    ) -> Option<Solved> {
        let free = self.free_rotations((oscillators, states), strikes, time);
        let influence = self.collocations[self.division].influence;
        let scale = self.amplitude(states).max(free[2].abs());
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
        (oscillators, states): (&[Oscillator], &mut [Complex64]),
        strikes: &[Strike],
        (from, to): (f64, f64),
    ) {
        let collocation = &self.collocations[self.division];
        // What did not settle on the finest step keeps its moment.
        let held = [self.moments[NODES - 1]; NODES];
        let moments = solved.as_ref().map_or(held, |solved| solved.moments);
        let modes = collocation.advance.iter().zip(&collocation.drive);
        for (state, (advance, drive)) in states.iter_mut().zip(modes) {
            *state *= advance;
            for (factor, moment) in drive.iter().zip(moments) {
                *state += factor * moment;
            }
        }
        for strike in strikes.iter().filter(|strike| strike.pulse.start < to) {
            drive(oscillators, strike, (from, to), states);
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
    pub(super) fn moment(&self) -> [f64; 3] {
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

    pub(super) fn stored(&self) -> f64 {
        self.law.stored(self.rotation, &self.memory)
    }

    pub(super) fn loss(&self) -> f64 {
        self.loss
    }

    pub(super) fn forced_steps(&self) -> u64 {
        self.forced
    }
}
