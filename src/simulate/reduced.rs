//! The structure as hammer, sensors and joint see it: modes, and what the modes left out would add.

use num_complex::Complex64;
use std::f64::consts::TAU;

/// One mode of unit modal mass.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedMode {
    /// Natural frequency (Hz), undamped.
    pub frequency: f64,
    /// Damping ratio, at least 0 and below 1.
    pub damping_ratio: f64,
    /// Shape at each sensor (kg^-1/2).
    pub at_sensors: Vec<f64>,
    /// Rotation of the joint's spring (rad kg^-1/2 m^-1).
    pub at_joint: f64,
}

/// What a structure answers with: its modes up to some frequency, those beyond as springs.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedStructure {
    /// The modes that move in time.
    pub modes: Vec<ReducedMode>,
    /// Rotation of the joint's spring per moment on it (rad/(N m)), of all modes left out.
    pub joint_compliance: f64,
    /// Displacement of each sensor per moment on the joint's spring (1/N), of all modes left out.
    pub joint_to_sensors: Vec<f64>,
}

/// How one place is struck: the shapes there, and the compliance of the modes left out.
#[derive(Debug, Clone, PartialEq)]
pub struct StruckPlace {
    /// Shape of each mode (kg^-1/2).
    pub at_modes: Vec<f64>,
    /// Displacement of each sensor per force (m/N), of all modes left out.
    pub to_sensors: Vec<f64>,
    /// Rotation of the joint's spring per force (rad/N), of all modes left out.
    pub to_joint: f64,
}

/// What a sensor senses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensed {
    /// Acceleration (m/s2).
    Acceleration,
    /// Velocity (m/s).
    Velocity,
    /// Displacement (m).
    Displacement,
}

/// A mode's constants of motion, q'' + 2 zeta omega q' + omega^2 q = force.
///
/// With the pole p = -zeta omega + j omega_d the state z = q' - conj(p) q obeys z' = p z + force,
/// so that q = Im z/omega_d and q' = Re z + Re(p) q.
#[derive(Debug, Clone, Copy)]
pub(super) struct Oscillator {
    pub(super) pole: Complex64,
    omega: f64,
}

impl Oscillator {
    pub(super) fn new(mode: &ReducedMode) -> Self {
        let omega = TAU * mode.frequency;
        let damped = omega * (1.0 - mode.damping_ratio.powi(2)).sqrt();
        Self {
            pole: Complex64::new(-mode.damping_ratio * omega, damped),
            omega,
        }
    }

    /// Displacement, velocity and acceleration of the modal coordinate with the state z under a
    /// modal force.
    pub(super) fn motion(&self, z: Complex64, force: f64) -> [f64; 3] {
        let q = z.im / self.pole.im;
        let velocity = z.re + self.pole.re * q;
        let acceleration = force + 2.0 * self.pole.re * velocity - self.omega * self.omega * q;
        [q, velocity, acceleration]
    }

    /// Energy of the modal coordinate (J), (q'^2 + omega^2 q^2)/2.
    pub(super) fn energy(&self, z: Complex64) -> f64 {
        let [q, velocity, _] = self.motion(z, 0.0);
        0.5 * (velocity * velocity + (self.omega * q).powi(2))
    }
}

/// Sum over the modes of factors of their states' real and imaginary parts.
pub(super) fn seen(factors: &[[f64; 2]], states: &[Complex64]) -> f64 {
    // Sums of their own for each lane keep the processor's units busy.
    let mut sums = [[0.0; 2]; 4];
    let (fours, rest) = factors.as_chunks::<4>();
    let (state_fours, others) = states.as_chunks::<4>();
    for (factors, states) in fours.iter().zip(state_fours) {
        for ((sum, factor), state) in sums.iter_mut().zip(factors).zip(states) {
            sum[0] += factor[0] * state.re;
            sum[1] += factor[1] * state.im;
        }
    }
    let tail = rest.iter().zip(others);
    let tail: f64 = tail
        .map(|([real, imaginary], z)| real * z.re + imaginary * z.im)
        .sum();
    sums.as_flattened().iter().sum::<f64>() + tail
}

impl Sensed {
    /// Which of displacement, velocity, acceleration it is.
    pub(super) fn derivative(self) -> usize {
        match self {
            Self::Displacement => 0,
            Self::Velocity => 1,
            Self::Acceleration => 2,
        }
    }
}
