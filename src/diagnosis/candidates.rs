//! The effects that are hypotheses for a test, with the priors of their sizes and places.
//!
//! The scale of each prior stands with its reason: what such things weigh, yield or are known to.

use crate::dataset::Dataset;
use crate::fixture::unseen_frequencies;
use crate::parameters::{CandidateEffect, Cause, LocationKind, LocationRange, Size, Target};
use crate::result::LARGEST_STIFFNESS_CHANGE;
use crate::structure::{COUPLING, Nominal, ROTATION};
use tapjoint_beam::effects::{EffectId, Group};

impl CandidateEffect {
    /// Returns an error of the set-up.
    fn of_set_up(effect: EffectId, target: Target, size: Size) -> Self {
        CandidateEffect {
            cause: Cause::Effect(effect),
            target,
            size,
            location: None,
            variants: 1,
        }
    }
}

/// Returns an effect of the structure or of the clock with its priors; `None` for an effect that is no hypothesis of this
/// kind: joint drift changes the spread of a nuisance parameter and not a prediction, and an error of the set-up has a
/// target. `end` is the highest frequency (Hz) that was looked at.
pub fn candidate_effect(effect: EffectId, nominal: &Nominal, end: f64) -> Option<CandidateEffect> {
    let (length, mass) = (nominal.length(), nominal.beam_mass());
    let spring = nominal.bending_stiffness() / length.powi(3);
    let force = nominal.bending_stiffness() / length.powi(2);
    let size = match effect {
        // Accelerometers weigh 0.5 g (miniature) to 50 g (seismic).
        EffectId::SensorMass => Size::positive("mass", 0.005, 0.3 * mass),
        // A coaxial cable, E I of 1e-3 to 1e-2 N m2 over 0.1 to 0.3 m, to a rubber band.
        EffectId::SensorCable => Size::positive("stiffness", 30.0, 3.0 * spring),
        // 0 for symmetric bolts; sqrt(3)/2 for a bed of springs that begins at the beam's root.
        EffectId::CrossCoupling => Size::signed("coupling", 0.1, 0.95),
        // Bolt, nut and washers beside a beam that they hold.
        EffectId::JointMass => Size::positive("mass", 0.03 * mass, 0.6 * mass),
        // Bolted joints soften by 0.2 to 20 % from a tap to a hard tap.
        EffectId::JointNonlinearity => Size::signed("ratio", 0.03, LARGEST_STIFFNESS_CHANGE),
        // Loss factors of bolted joints: 0.002 to 0.1.
        EffectId::JointDamping => Size::positive("loss_factor", 0.01, 0.5),
        // A vice is a hundred times stiffer than the joint on it, a table ten times.
        EffectId::Fixture => Size::positive("ratio", 0.02, 0.5),
        // Table values of one alloy differ by 2 %. The direction of rolling adds as much.
        EffectId::Modulus | EffectId::Density => Size::signed("relative", 0.02, 0.3),
        // Rolled strip: ISO 9445 and EN 10029 allow 1 to 8 %.
        EffectId::Thickness => Size::signed("relative", 0.01, 0.2),
        // Where a clamp begins to hold is known to some millimetres.
        EffectId::Length => Size::signed("relative", 0.005, 0.1),
        // Crystals are good to 5e-5; a rate typed from memory is not.
        EffectId::Timebase => Size::signed("relative", 0.0005, 0.2),
        // Glue, tape, a nut or a magnet.
        EffectId::AddedMass => Size::positive("mass", 0.01 * mass, 0.3 * mass),
        // A crack a third of the thickness deep, h/L = 0.012 (Tada, Paris & Irwin: c E I/L = 6 pi h/L F).
        EffectId::LocalCrack => Size::positive("compliance", 0.01, 0.5),
        EffectId::AxialLoad => Size {
            // A beam on springs buckles at P L^2/(E I) = -pi^2/4 or above.
            low: -1.5 * force,
            // A beam's own weight makes 0.01, a clamp that was tightened askew 0.1.
            ..Size::signed("force", 0.05 * force, 5.0 * force)
        },
        // What Timoshenko's beam says is 1; layers and holes make it more.
        EffectId::ShearRotary => Size::positive("factor", 1.0, 10.0),
        EffectId::Resolution => Size::signed("offset", 0.125, 2.0),
        // Clamps described as rigid: E I/L over their stiffness is 0.005 to 0.1, and E I/L^3 a thirtieth of it.
        EffectId::JointCompliance => match nominal.rigid_directions() {
            [_, true] => Size::positive("rotation", 0.02, 5.0),
            [true, false] => Size::positive("translation", 0.0007, 0.5),
            [false, false] => return None,
        },
        EffectId::JointDrift
        | EffectId::SensorPosition
        | EffectId::SensorPolarity
        | EffectId::SensorSwap
        | EffectId::SensorScale
        | EffectId::TapPosition => return None,
    };
    let range = match effect {
        EffectId::JointMass => Some((LocationKind::Gyration, 0.003, 0.03, 2)),
        EffectId::JointNonlinearity => Some((LocationKind::Exponent, 0.5, 2.0, 3)),
        EffectId::Fixture => {
            let [from, to] = unseen_frequencies(end);
            Some((LocationKind::FixtureFrequency, from, to, 6))
        }
        EffectId::AddedMass => Some((LocationKind::Position, 0.01 * length, length, 12)),
        EffectId::LocalCrack => Some((LocationKind::Position, 0.01 * length, length, 18)),
        EffectId::JointCompliance if nominal.rigid_directions() == [true; 2] => {
            Some((LocationKind::Translation, 1e-6, 0.1, 4))
        }
        _ => None,
    };
    Some(CandidateEffect {
        cause: Cause::Effect(effect),
        target: Target::All,
        size,
        location: range.map(|(kind, low, high, nodes)| LocationRange {
            kind,
            low,
            high,
            nodes,
        }),
        variants: 1,
    })
}

/// Returns the effects that can be hypotheses for a test: those whose object it has. An effect that may act on several
/// things has a variant for each.
pub fn candidate_effects(dataset: &Dataset) -> Vec<Vec<CandidateEffect>> {
    let (nominal, arrangements) = (&dataset.nominal, &dataset.arrangements);
    let has_joint = nominal.has_joint();
    let has_clamp = has_joint && nominal.is_one_beam();
    let gives = !nominal.fitted_springs().is_empty();
    let possible = EffectId::ALL.into_iter().filter(|effect| {
        let mut sensors = arrangements.iter().flat_map(|one| &one.carried);
        match effect {
            EffectId::SensorMass => sensors.any(|sensor| sensor.mass == 0.0),
            EffectId::SensorCable => sensors.next().is_some(),
            EffectId::CrossCoupling => {
                has_clamp && !nominal.fits(COUPLING) && nominal.fitted_springs().len() == 2
            }
            // No force pulls on a free end, nor on beams that overlap.
            EffectId::AxialLoad => has_clamp,
            EffectId::Fixture => has_clamp && nominal.fits(ROTATION),
            // What is held rigidly neither moves nor dissipates.
            EffectId::JointMass | EffectId::JointDamping => has_joint && gives,
            EffectId::JointNonlinearity => nominal.fits(ROTATION),
            EffectId::JointCompliance => has_joint,
            EffectId::Resolution => nominal.reading_bias.is_some(),
            _ => true,
        }
    });
    let mut all: Vec<Vec<CandidateEffect>> = Vec::new();
    for effect in possible {
        if effect.group() == Group::SetUp {
            all.push(set_up_errors(effect, dataset));
        } else if let Some(mut candidate) = candidate_effect(effect, nominal, dataset.peaks.end) {
            if let (EffectId::Resolution, Some(bias)) = (effect, nominal.reading_bias) {
                candidate.size.scale = bias;
            }
            all.push(vec![candidate]);
        }
    }
    let settings = &dataset.settings;
    for candidate in all.iter_mut().flatten() {
        candidate.size.scale *= settings.thresholds.prior_scale;
        let mut known = settings.known_sizes.iter();
        let known = known.find(|(effect, _)| candidate.is(*effect));
        candidate.size.known = known.map(|(_, sizes)| *sizes);
    }
    all.retain(|variants| !variants.is_empty());
    all
}

/// Returns whether places can be off by a usual offset to one side at least. Places at both ends of a beam cannot.
fn has_room(offset: &Size) -> bool {
    offset.high.max(-offset.low) >= offset.scale
}

/// Returns an error of the set-up for each thing that it may act on. It is tried only where shapes or modal constants
/// were measured.
fn set_up_errors(effect: EffectId, dataset: &Dataset) -> Vec<CandidateEffect> {
    let (inventory, length) = (&dataset.inventory, dataset.nominal.length());
    let [has_constants, has_ratios] = dataset.kinds_of_shapes();
    let names = 0..inventory.names.len();
    let several = names.len() > 1;
    let mut all = Vec::new();
    match effect {
        // A rule is misread by a centimetre, or the wrong end of the sensor is meant.
        EffectId::SensorPosition if has_constants || has_ratios => {
            for (position, (_, stated)) in inventory.positions.iter().enumerate() {
                all.push(CandidateEffect::of_set_up(
                    effect,
                    Target::Place { position },
                    Size::offset(&[*stated], length),
                ));
            }
            // The scale's zero is off: the sensor is as far off wherever it is put.
            for name in names {
                let own = inventory.positions.iter().filter(|one| one.0 == name);
                let stated: Vec<f64> = own.map(|one| one.1).collect();
                let size = Size::offset(&stated, length);
                if stated.len() > 1 && has_room(&size) {
                    all.push(CandidateEffect::of_set_up(
                        effect,
                        Target::Sensor { name },
                        size,
                    ));
                }
            }
        }
        EffectId::TapPosition if has_constants => {
            for (tap, stated) in inventory.taps.iter().enumerate() {
                all.push(CandidateEffect::of_set_up(
                    effect,
                    Target::Taps { tap },
                    Size::offset(&[*stated], length),
                ));
            }
            let size = Size::offset(&inventory.taps, length);
            if inventory.taps.len() > 1 && has_room(&size) {
                all.push(CandidateEffect::of_set_up(effect, Target::All, size));
            }
        }
        EffectId::SensorPolarity if has_constants || has_ratios => {
            for name in names {
                all.push(CandidateEffect::of_set_up(
                    effect,
                    Target::Sensor { name },
                    Size::fixed("flipped"),
                ));
            }
        }
        EffectId::SensorSwap if several && (has_constants || has_ratios) => {
            for first in names.clone() {
                for second in first + 1..names.end {
                    let names = [first, second];
                    all.push(CandidateEffect::of_set_up(
                        effect,
                        Target::Pair { names },
                        Size::fixed("swapped"),
                    ));
                }
            }
        }
        // A wrong sheet, 10 % from sensor to sensor; a wrong unit is a factor of 9.81 or 10.
        EffectId::SensorScale if has_constants || has_ratios => {
            let size = Size {
                low: -0.95,
                ..Size::signed("relative", 0.1, 20.0)
            };
            // That of the hammer is one of all sensors.
            if has_constants && several {
                all.push(CandidateEffect::of_set_up(effect, Target::All, size));
            }
            if has_constants || several {
                for name in names {
                    all.push(CandidateEffect::of_set_up(
                        effect,
                        Target::Sensor { name },
                        size,
                    ));
                }
            }
        }
        _ => {}
    }
    let variants = all.len();
    for one in &mut all {
        one.variants = variants;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::LogNormal;

    /// Returns the prior probabilities of all sizes of an effect, and of those smaller than `middle`.
    fn integrals(size: &Size, middle: f64) -> [f64; 2] {
        const STEPS: usize = 400_000;
        let step = (size.high - size.low) / STEPS as f64;
        let (mut all, mut below) = (0.0, 0.0);
        for k in 0..STEPS {
            let at = size.low + step * (k as f64 + 0.5);
            let share = step * size.log_density(at).exp();
            all += share;
            if at.abs() < middle {
                below += share;
            }
        }
        [all, below]
    }

    /// Over all sizes the density integrates to 1, and half of it lies below the scale where there is no bound.
    #[test]
    fn val_the_prior_of_a_size_is_normalised_and_has_its_scale_in_the_middle() {
        for size in [
            Size::positive("mass", 0.01, 0.25),
            Size::signed("relative", 0.02, 0.3),
            Size::offset(&[0.338], 0.423),
        ] {
            let [all, below] = integrals(&size, size.scale);
            // The midpoint rule over a peak as wide as a thousandth of the range.
            assert!((all - 1.0).abs() < 1e-6, "{}: {all}", size.name);
            // Bounds at 5 to 25 scales and more cut off up to a twelfth of the tail.
            assert!((0.5..0.56).contains(&below), "{}: {below}", size.name);
        }
    }

    /// A known distribution is shared by both signs, and has its median in the middle.
    #[test]
    fn val_a_known_distribution_of_sizes_is_normalised() {
        let size = Size {
            known: Some(LogNormal {
                median: 0.01,
                spread: 0.8,
            }),
            ..Size::signed("relative", 0.02, 0.5)
        };
        // A sensor at the tip can only be nearer, and one beside it hardly farther.
        for stated in [0.423, 0.419] {
            let beside = Size {
                known: size.known,
                ..Size::offset(&[stated], 0.423)
            };
            let [all, _] = integrals(&beside, 0.01);
            assert!((all - 1.0).abs() < 1e-5, "{stated}: {all}");
        }
        let [all, below] = integrals(&size, 0.01);
        // The bound cuts off what lies beyond 4.9 standard deviations: 5e-7. The rest is the midpoint rule's.
        assert!((all - 1.0).abs() < 1e-5, "{all}");
        // A step of 2.5e-6 at the median, where the density is 0.5/(0.01 x 0.8): 1e-4 at most.
        assert!((below - 0.5).abs() < 1e-3, "{below}");
    }

    /// A sensor at both ends in turn can be off alike in neither direction.
    #[test]
    fn limit_places_at_both_ends_cannot_be_off_alike() {
        assert!(!has_room(&Size::offset(&[0.0, 0.4], 0.4)));
        assert!(!has_room(&Size::offset(&[0.001, 0.398], 0.4)));
        assert!(has_room(&Size::offset(&[0.02, 0.4], 0.4)));
        assert!(has_room(&Size::offset(&[0.4], 0.4)));
    }

    #[test]
    fn limit_an_effect_that_is_there_or_not_has_no_density() {
        let size = Size::fixed("flipped");
        assert!(size.is_fixed());
        assert_eq!(size.log_density(1.0), 0.0);
        assert_eq!(size.small(), 1.0);
    }
}
