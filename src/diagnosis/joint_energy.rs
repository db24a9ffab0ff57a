//! How much of a mode's energy sits in the joint's springs, and what that does to its frequency.

use super::nominal::COUPLING;
use super::solved::Solved;
use tapjoint_beam::specimen::SpecimenJoint;

/// Share of each spring of the joint in the strain energy of a mode, q_t F_t/omega^2 for a shape of
/// unit modal mass that deforms the joint by q against the forces F = K q. With coupled springs the
/// shares belong to the stiffnesses at a fixed coupling: dK/d ln k_t = (E_t K + K E_t)/2.
pub(super) fn joint_shares(one: &Solved, index: usize) -> [f64; 2] {
    let SpecimenJoint::Springs { kt, kr, coupling } = one.seen.specimen.joint else {
        return [0.0; 2];
    };
    let q = one.modes().joint_motion(index);
    let omega = std::f64::consts::TAU * one.modes().frequencies()[index];
    let square = 1.0 - coupling * coupling;
    // A rigid spring holds no energy; its deformation is 0 and its stiffness infinite.
    let part = |own: f64, other: f64, own_k: f64, other_k: f64| {
        if !own_k.is_finite() {
            return 0.0;
        }
        let cross = if coupling == 0.0 {
            0.0
        } else {
            coupling * (own_k * other_k).sqrt() * other
        };
        own * (own_k * own + cross) / square / (omega * omega)
    };
    [part(q[0], q[1], kt, kr), part(q[1], q[0], kr, kt)]
}

/// d ln f/d ln k of all modes for a spring of the joint, or d ln f/d coupling: half the strain energy of that
/// spring, as the mode has it, over that of the structure (Rayleigh's quotient is stationary in the shape).
pub(super) fn joint_slopes(one: &Solved, direction: usize) -> Vec<f64> {
    let based = one.seen.specimen.base.is_some_and(|base| base.ratio > 0.0);
    if based || direction == COUPLING {
        // The base's spring is tied to the joint's by their ratio: both move.
        return stiffened_slopes(one, direction);
    }
    let share = |index: usize| 0.5 * joint_shares(one, index)[direction];
    (0..one.modes().len()).map(share).collect()
}

/// The same by Rayleigh's quotient of the changed structure.
fn stiffened_slopes(one: &Solved, direction: usize) -> Vec<f64> {
    const STEP: f64 = 1e-4;
    let mut other = one.seen.specimen.clone();
    if let SpecimenJoint::Springs { kt, kr, coupling } = &mut other.joint {
        match direction {
            0 => *kt *= STEP.exp(),
            COUPLING => *coupling += STEP,
            _ => *kr *= STEP.exp(),
        }
    }
    let own = one.modes().frequencies();
    match one.modes().rayleigh_frequencies(&other) {
        Ok(moved) => (moved.iter().zip(own))
            .map(|(moved, own)| (moved / own).ln() / STEP)
            .collect(),
        Err(_) => vec![0.0; own.len()],
    }
}
