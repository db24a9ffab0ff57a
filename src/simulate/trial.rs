//! One mean tap on the linear structure: how far channels and joint will be driven.

use super::chain::Signal;
use super::laboratory::Laboratory;
use super::motion::{Motion, Strike};
use super::pulse::Pulse;
use super::reduced::Sensed;
use super::seen::SeenStructure;
use super::take::TakePlan;

/// What a mean tap brings.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trial {
    /// Largest value of each channel (SI).
    pub(super) peaks: Vec<f64>,
    /// Largest rotation of the joint (rad).
    pub(super) joint_rotation: f64,
}

/// So long the tap is followed: some periods of the lowest mode of beams that are tapped by hand (s).
const FOLLOWED: f64 = 0.3;

pub(super) fn try_out(
    structure: &SeenStructure,
    plan: &TakePlan,
    laboratory: &Laboratory,
) -> Trial {
    let sensed: Vec<Sensed> = plan
        .channels
        .iter()
        .filter_map(|(signal, _)| match signal {
            Signal::Force => None,
            Signal::Response(sensed) => Some(*sensed),
        })
        .collect();
    let rate = plan.true_rate() * plan.steps_per_sample(laboratory) as f64;
    let step = 1.0 / rate;
    let mut motion = Motion::new(structure.reduced().clone(), &sensed, (0.0, step), None);
    let (length, shape) = plan.taps.pulse;
    motion.strike(Strike {
        pulse: Pulse {
            start: 0.5 * step,
            length,
            peak: plan.taps.peak_force,
            shape,
        },
        place: structure.struck(plan.taps.place.0),
    });
    let mut largest = vec![0.0; sensed.len()];
    let mut responses = largest.clone();
    let mut joint_rotation: f64 = 0.0;
    for _ in 0..(FOLLOWED * rate) as usize {
        motion.advance();
        motion.responses(&mut responses);
        for (largest, value) in largest.iter_mut().zip(&responses) {
            *largest = f64::max(*largest, value.abs());
        }
        joint_rotation = joint_rotation.max(motion.joint_rotation().abs());
    }
    let hammer = plan.channels.len() > sensed.len();
    let force = hammer.then_some(plan.taps.peak_force);
    Trial {
        peaks: force.into_iter().chain(largest).collect(),
        joint_rotation,
    }
}

/// The next of 1, 2, 5, 10, ... at or above.
pub(super) fn round_scale(value: f64) -> f64 {
    if value.is_nan() || value <= 0.0 {
        return 1.0;
    }
    let decade = 10f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    let found = steps.into_iter().find(|step| step * decade >= value);
    found.unwrap_or(10.0) * decade
}
