//! What is planted: nothing, one effect, or two.
//!
//! Sizes follow from how each fault comes about, not from what the method assumes, and reach well below what can be
//! seen. Sizes that add up from many small causes are log-normal. Those between a usual and a largest one are triangular in
//! the logarithm. Those that are most often next to nothing follow a gamma distribution.

use super::draws::{gamma, log_normal, log_triangular, log_uniform, sign};
use super::outside::OutsideKind;
use super::plans::{PlanNeeds, PlannedTest, draw_sensor_mass};
use super::structures::{Needs, Structure, Support};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use tapjoint::effects::{Effect, EffectId, Group};
use tapjoint::identify::consistent::Parameter;
use tapjoint::structure::BeamTheory;
use tapjoint::study::blind_check::GROUPS as PLANTED;

/// Place of the joint's compliance among the groups: with the other effects of the joint.
const COMPLIANCE: usize = 6;

/// Groups of effects that are planted, each with its members: those of the blind check, and the compliance of a joint that is
/// described as rigid.
pub const GROUPS: [&[EffectId]; PLANTED.len() + 1] = {
    let mut groups: [&[EffectId]; PLANTED.len() + 1] =
        [&[EffectId::JointCompliance]; PLANTED.len() + 1];
    let mut index = 0;
    while index < PLANTED.len() {
        groups[if index < COMPLIANCE { index } else { index + 1 }] = PLANTED[index];
        index += 1;
    }
    groups
};

/// A class of tests: a cell of the study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    Nothing,
    /// One effect of a group, by its index.
    Single(usize),
    /// Two effects of different groups.
    Pair,
    Outside(OutsideKind),
}

impl Class {
    pub fn all() -> Vec<Self> {
        let mut all = vec![Self::Nothing];
        all.extend((0..GROUPS.len()).map(Self::Single));
        all.push(Self::Pair);
        all.extend(OutsideKind::ALL.map(Self::Outside));
        all
    }

    pub fn name(self) -> String {
        match self {
            Self::Nothing => "nothing".to_owned(),
            Self::Single(index) => match GROUPS[index] {
                [alone] => alone.name().to_owned(),
                members => members[0].group().name().to_owned(),
            },
            Self::Pair => "pair".to_owned(),
            Self::Outside(kind) => format!("outside-{}", kind.name()),
        }
    }

    /// Returns how many times `--tests` tests the class has: nulls and pairs are compared with all others.
    pub fn multiple(self) -> usize {
        match self {
            Self::Nothing => 4,
            Self::Pair => 2,
            Self::Single(_) | Self::Outside(_) => 1,
        }
    }

    /// Draws which effects are planted.
    pub fn draw_ids(self, random: &mut ChaCha8Rng) -> Vec<EffectId> {
        match self {
            Self::Nothing | Self::Outside(_) => Vec::new(),
            Self::Single(group) => vec![draw_member(random, group)],
            Self::Pair => loop {
                let first = random.random_range(0..GROUPS.len());
                let second = random.random_range(0..GROUPS.len());
                if first != second && are_compatible(first, second) {
                    break vec![draw_member(random, first), draw_member(random, second)];
                }
            },
        }
    }
}

fn draw_member(random: &mut ChaCha8Rng, group: usize) -> EffectId {
    GROUPS[group][random.random_range(0..GROUPS[group].len())]
}

/// Returns whether one structure can have effects of both groups: a rigid joint has no effect that needs its spring.
fn are_compatible(first: usize, second: usize) -> bool {
    let rigid = |group: usize| GROUPS[group] == [EffectId::JointCompliance];
    let sprung = |group: usize| {
        [
            EffectId::CrossCoupling,
            EffectId::JointNonlinearity,
            EffectId::JointDamping,
            EffectId::Fixture,
        ]
        .contains(&GROUPS[group][0])
    };
    !(rigid(first) && sprung(second) || rigid(second) && sprung(first))
}

/// Returns the structures that can have these effects.
pub fn structure_needs(ids: &[EffectId]) -> Needs {
    use Support::{Cantilever, Free, Lap, RigidCantilever};
    let mut needs = Needs {
        supports: Support::ALL.to_vec(),
        theory: None,
        least_thickness: 0.004,
    };
    for id in ids {
        let own: &[Support] = match id {
            EffectId::CrossCoupling | EffectId::Fixture => &[Cantilever],
            EffectId::JointCompliance => &[RigidCantilever],
            EffectId::AxialLoad => &[Cantilever, RigidCantilever],
            EffectId::JointNonlinearity | EffectId::JointDamping => &[Cantilever, Lap],
            EffectId::JointMass => &[Cantilever, RigidCantilever, Lap],
            _ => &[Cantilever, RigidCantilever, Lap, Free],
        };
        needs.supports.retain(|support| own.contains(support));
        if *id == EffectId::ShearRotary {
            needs.theory = Some(BeamTheory::Euler);
            needs.least_thickness = 0.006;
        }
    }
    needs
}

/// Returns the plans that can show these effects at all.
pub fn plan_needs(ids: &[EffectId]) -> PlanNeeds {
    let mut needs = PlanNeeds::default();
    for id in ids {
        match id {
            EffectId::SensorMass => needs.unstated_masses = true,
            EffectId::JointNonlinearity => needs.amplitudes = true,
            EffectId::JointDamping => needs.damping = true,
            EffectId::SensorSwap => {
                needs.shapes = true;
                needs.several_sensors = true;
            }
            EffectId::SensorPosition
            | EffectId::SensorPolarity
            | EffectId::SensorScale
            | EffectId::TapPosition => needs.shapes = true,
            _ => {}
        }
    }
    needs
}

/// Draws effects. `None` where a size is out of its range.
///
/// Of two effects each is the larger of two draws, and an error of the scale exceeds the tolerances: few tests are then
/// drawn again because one of them cannot be seen.
pub fn draw_effects(
    random: &mut ChaCha8Rng,
    ids: &[EffectId],
    structure: &Structure,
    test: &PlannedTest,
) -> Option<Vec<Effect>> {
    let mut effects = Vec::new();
    for id in ids {
        let mut effect = draw_effect(random, *id, structure, test)?;
        if ids.len() > 1 {
            let other = draw_effect(random, *id, structure, test)?;
            if size_of(&other) > size_of(&effect) {
                effect = other;
            }
            if id.group() == Group::Scale && is_within_tolerance(&[effect.clone()], structure) {
                return None;
            }
        }
        effects.push(effect);
    }
    Some(effects)
}

/// Returns the magnitude of the first parameter that measures the size (SI).
pub fn size_of(effect: &Effect) -> f64 {
    let name = effect.id.size_parameters().first();
    name.and_then(|name| effect.value(name))
        .map_or(0.0, f64::abs)
}

/// Returns whether these effects move nothing but the common factor of all frequencies, and that by less than two
/// standard uncertainties. A wrong length shows in other ways too, so it must be below two standard uncertainties of the length.
pub fn is_within_tolerance(effects: &[Effect], structure: &Structure) -> bool {
    let mut effects_left = effects.iter();
    !effects.is_empty()
        && effects_left.all(|effect| {
            let length = structure.uncertainty.beam.length.unwrap_or(0.0);
            effect.id.group() == Group::Scale
                && (effect.id != EffectId::Length || size_of(effect) < 2.0 * length)
        })
        && common_factor(effects).abs() < 2.0 * structure.scale_std()
}

/// Draws an effect. `None` where a size is out of its range.
pub fn draw_effect(
    random: &mut ChaCha8Rng,
    id: EffectId,
    structure: &Structure,
    test: &PlannedTest,
) -> Option<Effect> {
    let pairs = match id {
        EffectId::SensorPosition
        | EffectId::SensorPolarity
        | EffectId::SensorSwap
        | EffectId::SensorScale
        | EffectId::TapPosition => draw_set_up(random, id, structure, test),
        _ => draw_size(random, id, structure),
    };
    Effect::from_pairs(id, &pairs).ok()
}

/// Draws the parameters of an effect of structure or clock.
fn draw_size(
    random: &mut ChaCha8Rng,
    id: EffectId,
    structure: &Structure,
) -> Vec<(&'static str, f64)> {
    let (length, mass) = (structure.length(), structure.mass());
    let stiffness = structure.described.body.beams()[0].bending_stiffness();
    match id {
        EffectId::SensorMass => vec![("mass", draw_sensor_mass(random, structure))],
        // Cables are chosen to suit the beam: from a thin free one to a stiff one that is taped down.
        EffectId::SensorCable => {
            let share = log_normal(random, 0.04, 1.3).min(2.5);
            vec![("stiffness", share * stiffness / length.powi(3))]
        }
        // An eccentric joint: its line of action is off the beam's by a part of its height.
        EffectId::CrossCoupling => {
            let size = log_normal(random, 0.06, 1.1).min(0.8);
            vec![("coupling", sign(random, 0.5) * size)]
        }
        // Bolts, nuts, clamping plates: most often few of them.
        EffectId::JointMass => {
            let size = mass * gamma(random, 0.9, 0.06).clamp(1e-4, 0.5);
            let radius = log_normal(random, 8e-3, 0.5).clamp(2e-3, 0.035);
            vec![("mass", size), ("inertia", size * radius * radius)]
        }
        // Two joints of three slip; the others open or close.
        EffectId::JointNonlinearity => {
            let size = log_normal(random, 0.03, 1.1).min(0.6);
            match random.random_bool(2.0 / 3.0) {
                true => vec![
                    ("ratio", -size),
                    ("exponent", 0.4 + 1.1 * random.random::<f64>()),
                ],
                false => vec![
                    ("ratio", sign(random, 0.6) * size),
                    ("exponent", 1.0 + random.random::<f64>()),
                ],
            }
        }
        EffectId::JointDamping => vec![("loss_factor", gamma(random, 1.1, 0.025).clamp(1e-5, 0.4))],
        EffectId::JointCompliance => draw_compliance(random, structure),
        // Tables, vices and concrete blocks rock at some hundred hertz.
        EffectId::Fixture => vec![
            (
                "frequency",
                log_normal(random, 220.0, 0.8).clamp(25.0, 3000.0),
            ),
            ("ratio", log_normal(random, 0.015, 1.1).min(0.4)),
        ],
        // Alloys by 1 %, weighing and tables by 1 %, tape measures and where the clamp ends, sheets by their standard.
        EffectId::Modulus => vec![("relative", relative(random, 0.02, 1.0, 0.3))],
        EffectId::Density => vec![("relative", relative(random, 0.015, 1.0, 0.3))],
        EffectId::Length => vec![("relative", relative(random, 0.006, 1.0, 0.1))],
        EffectId::Thickness => vec![("relative", relative(random, 0.012, 1.0, 0.2))],
        // From crystals to a rate that was set wrongly.
        EffectId::Timebase => vec![("relative", relative(random, 0.002, 1.7, 0.1))],
        EffectId::AddedMass => vec![
            ("mass", mass * log_normal(random, 0.012, 1.1).min(0.25)),
            ("position", length * (0.05 + 0.94 * random.random::<f64>())),
        ],
        // The compliance of a crack grows with the square of its depth at first.
        EffectId::LocalCrack => vec![
            ("compliance", log_triangular(random, 3e-4, 0.01, 0.3)),
            ("position", length * (0.03 + 0.92 * random.random::<f64>())),
        ],
        // Gravity along an upright beam, warped clamps, preload. A cantilever buckles at -2.5 or above.
        EffectId::AxialLoad => {
            let side = sign(random, 0.6);
            let size = log_normal(random, 0.07, 1.2).min(if side > 0.0 { 3.0 } else { 0.5 });
            vec![("force", side * size * stiffness / length.powi(2))]
        }
        // What Euler's beam lacks.
        EffectId::ShearRotary => vec![("factor", 1.0)],
        _ => Vec::new(),
    }
}

fn relative(random: &mut ChaCha8Rng, median: f64, spread: f64, most: f64) -> f64 {
    sign(random, 0.5) * log_normal(random, median, spread).min(most)
}

/// Draws how a joint gives in the directions in which it is described as rigid.
fn draw_compliance(random: &mut ChaCha8Rng, structure: &Structure) -> Vec<(&'static str, f64)> {
    let rigid = structure
        .described
        .joint_stiffnesses()
        .map(f64::is_infinite);
    let mut rotation = log_triangular(random, 0.004, 0.03, 0.2);
    let mut translation = log_triangular(random, 1e-4, 8e-4, 0.01);
    match rigid {
        [true, true] => {
            // A clamp that turns hardly moves, and the other way round in one case of five.
            match random.random_range(0..5) {
                0 => rotation = 0.0,
                1 | 2 => translation = 0.0,
                _ => {}
            }
        }
        [kt, kr] => {
            rotation *= f64::from(u8::from(kr));
            translation *= f64::from(u8::from(kt));
        }
    }
    vec![("rotation", rotation), ("translation", translation)]
}

/// Draws an error of the set-up.
fn draw_set_up(
    random: &mut ChaCha8Rng,
    id: EffectId,
    structure: &Structure,
    test: &PlannedTest,
) -> Vec<(&'static str, f64)> {
    let length = structure.length();
    let sensor = random.random_range(0..test.sensors.len());
    let number = (sensor + 1) as f64;
    let recordings = test.stated.len();
    // Every second error stays through the test.
    let recording = match random.random_bool(0.5) {
        true => 0,
        false => random.random_range(1..=recordings),
    };
    let is_off = |k: usize| recording == 0 || k + 1 == recording;
    let off = (0..recordings)
        .filter(|k| is_off(*k))
        .map(|k| &test.stated[k]);
    // A slip of the tape, a place mixed up: some millimetres to a tenth of the beam, in the direction that has room.
    let mut offset = |places: Vec<f64>| {
        let size = log_triangular(random, 5e-4, 8e-3, 0.08).min(0.15 * length);
        let side = sign(random, 0.5);
        let mut room = [side, -side].map(|side| {
            let own = places.iter().map(|place| match side > 0.0 {
                true => length - place,
                false => place - 0.01 * length,
            });
            own.fold(f64::INFINITY, f64::min)
        });
        room.iter_mut().for_each(|room| *room = room.max(0.0));
        match room[0] >= size || room[0] >= room[1] {
            true => side * size.min(room[0]),
            false => -side * size.min(room[1]),
        }
    };
    match id {
        EffectId::SensorPosition => {
            vec![
                (
                    "offset",
                    offset(off.map(|one| one.sensors[sensor].1).collect()),
                ),
                ("sensor", number),
                ("recording", recording as f64),
            ]
        }
        EffectId::TapPosition => {
            let offset = offset(off.map(|one| one.tap).collect());
            vec![("offset", offset), ("recording", recording as f64)]
        }
        EffectId::SensorPolarity => vec![("sensor", number)],
        EffectId::SensorSwap => {
            let other = (sensor + 1) % test.sensors.len() + 1;
            vec![("sensor", number), ("other", other as f64)]
        }
        _ => {
            let factor = match random.random_bool(0.15) {
                // A range switch: by 10.
                true => log_uniform(random, 9.0, 11.0).powf(sign(random, 0.5)),
                false => (sign(random, 0.5) * log_normal(random, 0.09, 0.9).min(2.0)).exp(),
            };
            let number = if random.random_bool(0.3) { 0.0 } else { number };
            vec![("relative", factor - 1.0), ("sensor", number)]
        }
    }
}

/// Returns by how much effects of the scale group move all frequencies alike (1).
fn common_factor(effects: &[Effect]) -> f64 {
    let shifts = effects.iter().map(|effect| {
        let relative = effect.value("relative").unwrap_or(0.0);
        let power = match effect.id {
            EffectId::Timebase => 1.0,
            id => Parameter::of_effect(id).map_or(0.0, Parameter::frequency_power),
        };
        power * relative
    });
    shifts.sum()
}
