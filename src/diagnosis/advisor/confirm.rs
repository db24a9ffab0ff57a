//! What shows directly whether a cause that was named is there.

use super::step::Step;
use tapjoint_beam::effects::EffectId;

/// In one sentence, without its full stop.
pub(super) fn confirming(effect: EffectId) -> String {
    let sentence = match effect {
        // These tests tell causes apart as well.
        EffectId::SensorMass => return Step::WeighSensor.sentence(),
        EffectId::Modulus | EffectId::Length => return Step::Calipers.sentence(),
        EffectId::Timebase => return Step::ReferenceTone.sentence(),
        EffectId::SensorCable => {
            "lead the sensor's cable another way or take its support off, the joint untouched, and tap again"
        }
        EffectId::CrossCoupling => {
            "describe the joint with model = \"3p\", and see whether it predicts a mode that was left out"
        }
        EffectId::JointMass => {
            "weigh what moves with the joint (bolts, washers, overlap), or change it by a known mass, and tap again"
        }
        EffectId::JointNonlinearity => {
            "tap much softer and much harder with the joint untouched: the frequencies have to follow the level"
        }
        EffectId::JointDamping => {
            "tighten the joint or put a foil into it, and tap again: the damping has to follow"
        }
        EffectId::JointDrift => {
            "repeat the first recording twice, the joint untouched and then tightened again"
        }
        EffectId::Fixture => {
            "put a sensor on the base and tap the base: it has to show a mode at that frequency"
        }
        EffectId::AddedMass => {
            "look at the place that was found, take off what is fastened there, and tap again"
        }
        EffectId::LocalCrack => {
            "look at the place that was found (magnifier, dye), or tap a sound beam in the same joint"
        }
        EffectId::AxialLoad => {
            "free the beam of what pulls or presses it along its axis, or turn the set-up over, and tap again"
        }
        EffectId::ShearRotary => {
            "describe the beam with shear and rotary inertia (beam = \"timoshenko\" in [joint]), and diagnose again"
        }
        EffectId::Resolution => "read the frequencies by a curve fit, or on closer lines",
    };
    sentence.into()
}
