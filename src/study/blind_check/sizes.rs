//! Effects with sizes from what is small to what is large, as a test engineer meets them.

use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

use tapjoint_beam::Beam;
use tapjoint_beam::effects::{Effect, EffectError, EffectId};

/// The groups that single effects are dealt from; `resolution` is a reading bias that recordings
/// cannot hold, `joint-drift` a nuisance that every test has.
pub const GROUPS: [&[EffectId]; 12] = [
    &[EffectId::SensorMass],
    &[EffectId::SensorCable],
    &[EffectId::CrossCoupling],
    &[EffectId::JointMass],
    &[EffectId::JointNonlinearity],
    &[EffectId::JointDamping],
    &[EffectId::Fixture],
    &[EffectId::Modulus, EffectId::Length, EffectId::Timebase],
    &[EffectId::AddedMass],
    &[EffectId::LocalCrack],
    &[EffectId::AxialLoad],
    &[EffectId::ShearRotary],
];

/// One effect of a group, its size log-uniform between small and large, its sign and place at random.
///
/// # Errors
/// [`EffectError`] where a beam so unlike a test specimen takes a size out of its range.
pub fn draw_effect(
    beam: &Beam,
    group: &[EffectId],
    random: &mut ChaCha8Rng,
) -> Result<Effect, EffectError> {
    let id = *group.choose(random).unwrap_or(&group[0]);
    let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
    let share = |low: f64, high: f64, random: &mut ChaCha8Rng| random.random_range(low..high);
    let mut pairs = size(beam, id, sign, random);
    match id {
        EffectId::AddedMass => pairs.push(("position", beam.length * share(0.15, 1.0, random))),
        EffectId::LocalCrack => pairs.push(("position", beam.length * share(0.08, 0.75, random))),
        _ => {}
    }
    Effect::from_pairs(id, &pairs)
}

/// The parameters but for positions.
fn size(beam: &Beam, id: EffectId, sign: f64, random: &mut ChaCha8Rng) -> Vec<(&'static str, f64)> {
    // Masses as they would be on a beam of 0.83 kg.
    let gram = 1e-3 * beam.mass() / 0.83;
    let (stiffness, length) = (beam.bending_stiffness(), beam.length);
    let mut size = |low: f64, high: f64| random.random_range(low.ln()..high.ln()).exp();
    match id {
        EffectId::SensorMass | EffectId::AddedMass => vec![("mass", gram * size(2.0, 24.0))],
        EffectId::SensorCable => vec![("stiffness", size(0.01, 0.3) * stiffness / length.powi(3))],
        EffectId::CrossCoupling => vec![("coupling", sign * size(0.03, 0.35))],
        EffectId::JointMass => {
            let mass = gram * size(10.0, 100.0);
            // Bolts and washers: 15 mm radius of gyration.
            vec![("mass", mass), ("inertia", mass * 0.015f64.powi(2))]
        }
        EffectId::JointNonlinearity => {
            let slips = size(0.1, 10.0) < 1.0;
            let ratio = size(0.008, 0.08);
            // A joint that slips softens; one that opens or closes may do either.
            let (signed, exponent) = if slips {
                (-ratio, 1.0)
            } else {
                (sign * ratio, 2.0)
            };
            vec![("ratio", signed), ("exponent", exponent)]
        }
        EffectId::JointDamping => vec![("loss_factor", size(0.003, 0.05))],
        EffectId::Fixture => vec![
            ("frequency", size(65.0, 800.0)),
            ("ratio", size(0.005, 0.08)),
        ],
        EffectId::Modulus => vec![("relative", sign * size(0.003, 0.03))],
        EffectId::Length => vec![("relative", sign * size(0.0012, 0.007))],
        EffectId::Timebase => vec![("relative", sign * size(2e-5, 1e-3))],
        EffectId::LocalCrack => vec![("compliance", size(0.003, 0.04))],
        EffectId::AxialLoad => {
            vec![("force", sign * size(0.02, 0.5) * stiffness / length.powi(2))]
        }
        EffectId::ShearRotary => vec![("factor", size(0.5, 3.0))],
        EffectId::JointDrift | EffectId::Resolution => Vec::new(),
    }
}
