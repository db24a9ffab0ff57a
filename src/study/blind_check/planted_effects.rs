//! Effects that are planted in virtual tests: those of the catalogue, from small to large as a test engineer
//! meets them, and faults that the catalogue does not have.

use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint_beam::Beam;
use tapjoint_beam::effects::{DescribedSetUp, Effect, EffectError, EffectId, Group};
use tapjoint_beam::specimen::{Hinge, PointMass, PointSpring, Specimen};

/// The groups that single effects are dealt from; `resolution` is a reading bias that recordings
/// cannot hold, `joint-drift` a nuisance that every test has, and `joint-compliance` needs a joint that is described as
/// rigid.
pub const GROUPS: [&[EffectId]; 13] = [
    &[EffectId::SensorMass],
    &[EffectId::SensorCable],
    &[EffectId::CrossCoupling],
    &[EffectId::JointMass],
    &[EffectId::JointNonlinearity],
    &[EffectId::JointDamping],
    &[EffectId::Fixture],
    &[
        EffectId::Modulus,
        EffectId::Length,
        EffectId::Density,
        EffectId::Thickness,
        EffectId::Timebase,
    ],
    &[EffectId::AddedMass],
    &[EffectId::LocalCrack],
    &[EffectId::AxialLoad],
    &[EffectId::ShearRotary],
    &[
        EffectId::SensorPosition,
        EffectId::SensorPolarity,
        EffectId::SensorSwap,
        EffectId::SensorScale,
        EffectId::TapPosition,
    ],
];

/// One effect of a group, its size log-uniform between small and large, its sign and place at random. `set_ups` are those
/// of the recordings; without any there is no error of the set-up.
///
/// # Errors
/// [`EffectError`] where a beam so unlike a test specimen takes a size out of its range.
pub fn draw_effect(
    beam: &Beam,
    set_ups: &[DescribedSetUp],
    group: &[EffectId],
    random: &mut ChaCha8Rng,
) -> Result<Effect, EffectError> {
    let sensors = set_ups.first().map_or(0, |first| first.sensors.len());
    let mut possible = group.to_vec();
    possible.retain(|id| *id != EffectId::SensorSwap || sensors > 1);
    let id = *possible.choose(random).unwrap_or(&group[0]);
    if id.group() == Group::SetUp {
        return Effect::from_pairs(id, &set_up_error(id, set_ups, random));
    }
    let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
    let mut pairs = size(beam, id, sign, random);
    let places = match id {
        EffectId::AddedMass => Some(0.15..1.0),
        EffectId::LocalCrack => Some(0.08..0.75),
        _ => None,
    };
    if let Some(places) = places {
        pairs.push(("position", beam.length * random.random_range(places)));
    }
    Effect::from_pairs(id, &pairs)
}

/// A random size whose logarithm is uniform.
pub fn log_uniform(low: f64, high: f64, random: &mut ChaCha8Rng) -> f64 {
    random.random_range(low.ln()..high.ln()).exp()
}

/// A random number with mean 0 and standard deviation 1.
pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// Sizes of an error in the position of a sensor (m): from a careless reading of the tape to a number that is mistyped.
const SENSOR_OFFSETS: [f64; 2] = [2e-3, 30e-3];
/// Sizes of an error in the position of the taps (m).
const TAP_OFFSETS: [f64; 2] = [5e-3, 40e-3];
/// Factors by which a calibration is off, either way.
const SCALE_FACTORS: [f64; 2] = [1.05, 2.0];

/// The parameters of an error of the set-up.
fn set_up_error(
    id: EffectId,
    set_ups: &[DescribedSetUp],
    random: &mut ChaCha8Rng,
) -> Vec<(&'static str, f64)> {
    let sensors = set_ups.first().map_or(1, |first| first.sensors.len());
    let sensor = random.random_range(0..sensors.max(1));
    let number = (sensor + 1) as f64;
    let signed = |size: f64, random: &mut ChaCha8Rng| match random.random_bool(0.5) {
        true => size,
        false => -size,
    };
    match id {
        EffectId::SensorPosition => {
            let places = set_ups.iter().filter_map(|one| one.sensors.get(sensor));
            let places: Vec<f64> = places.copied().collect();
            let size = log_uniform(SENSOR_OFFSETS[0], SENSOR_OFFSETS[1], random);
            let offset = signed(size, random);
            let mut pairs = offset_of(&places, set_ups, offset, random);
            pairs.push(("sensor", number));
            pairs
        }
        EffectId::SensorPolarity => vec![("sensor", number)],
        EffectId::SensorSwap => {
            let other = (sensor + random.random_range(1..sensors.max(2))) % sensors.max(2);
            vec![("sensor", number), ("other", (other + 1) as f64)]
        }
        EffectId::SensorScale => {
            // All sensors at once, as by the hammer's calibration, or one of them.
            let number = random.random_range(0..=sensors) as f64;
            let size = log_uniform(SCALE_FACTORS[0].ln(), SCALE_FACTORS[1].ln(), random);
            let relative = signed(size, random).exp_m1();
            vec![("relative", relative), ("sensor", number)]
        }
        _ => {
            let places: Vec<f64> = set_ups.iter().map(|one| one.tap).collect();
            let offset = signed(log_uniform(TAP_OFFSETS[0], TAP_OFFSETS[1], random), random);
            offset_of(&places, set_ups, offset, random)
        }
    }
}

/// An offset of one of the places that recordings share, of the other sign or smaller where it would leave the beam.
fn offset_of(
    places: &[f64],
    set_ups: &[DescribedSetUp],
    offset: f64,
    random: &mut ChaCha8Rng,
) -> Vec<(&'static str, f64)> {
    let chosen = random.random_range(0..places.len().max(1));
    let (Some(place), Some(set_up)) = (places.get(chosen), set_ups.get(chosen)) else {
        return vec![("offset", offset)];
    };
    let [left, right] = [*place, set_up.length - place];
    let room = if offset < 0.0 { left } else { right };
    let offset = match offset.abs() <= room {
        true => offset,
        false if left > right => -offset.abs().min(left),
        false => offset.abs().min(right),
    };
    // The first recording with this place stands for all of them; where there is but one place, 0 does.
    let first = places.iter().position(|one| one == place).unwrap_or(0);
    let is_only = places.iter().all(|one| one == place);
    let recording = if is_only { 0.0 } else { (first + 1) as f64 };
    vec![("offset", offset), ("recording", recording)]
}

/// The parameters but for positions.
fn size(beam: &Beam, id: EffectId, sign: f64, random: &mut ChaCha8Rng) -> Vec<(&'static str, f64)> {
    // Masses as they would be on a beam of 0.83 kg.
    let gram = 1e-3 * beam.mass() / 0.83;
    let (stiffness, length) = (beam.bending_stiffness(), beam.length);
    match id {
        EffectId::SensorMass | EffectId::AddedMass => {
            vec![("mass", gram * log_uniform(2.0, 24.0, random))]
        }
        EffectId::SensorCable => vec![(
            "stiffness",
            log_uniform(0.01, 0.3, random) * stiffness / length.powi(3),
        )],
        EffectId::CrossCoupling => vec![("coupling", sign * log_uniform(0.03, 0.35, random))],
        EffectId::JointMass => {
            let mass = gram * log_uniform(10.0, 100.0, random);
            // Bolts and washers: 15 mm radius of gyration.
            vec![("mass", mass), ("inertia", mass * 0.015f64.powi(2))]
        }
        EffectId::JointNonlinearity => {
            let slips = log_uniform(0.1, 10.0, random) < 1.0;
            let ratio = log_uniform(0.008, 0.08, random);
            // A joint that slips softens; one that opens or closes may do either.
            let (signed, exponent) = if slips {
                (-ratio, 1.0)
            } else {
                (sign * ratio, 2.0)
            };
            vec![("ratio", signed), ("exponent", exponent)]
        }
        EffectId::JointDamping => vec![("loss_factor", log_uniform(0.003, 0.05, random))],
        EffectId::Fixture => vec![
            ("frequency", log_uniform(65.0, 800.0, random)),
            ("ratio", log_uniform(0.005, 0.08, random)),
        ],
        EffectId::Modulus | EffectId::Density => {
            vec![("relative", sign * log_uniform(0.003, 0.03, random))]
        }
        EffectId::Length => vec![("relative", sign * log_uniform(0.0012, 0.007, random))],
        EffectId::Thickness => vec![("relative", sign * log_uniform(0.0015, 0.015, random))],
        EffectId::Timebase => vec![("relative", sign * log_uniform(2e-5, 1e-3, random))],
        EffectId::LocalCrack => vec![("compliance", log_uniform(0.003, 0.04, random))],
        EffectId::AxialLoad => {
            vec![(
                "force",
                sign * log_uniform(0.02, 0.5, random) * stiffness / length.powi(2),
            )]
        }
        EffectId::ShearRotary => vec![("factor", log_uniform(0.5, 3.0, random))],
        _ => Vec::new(),
    }
}

/// Things fastened to a specimen that neither its description nor an effect knows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Fastened {
    /// Masses.
    pub masses: Vec<PointMass>,
    /// Springs to the ground.
    pub springs: Vec<PointSpring>,
    /// Hinges.
    pub hinges: Vec<Hinge>,
}

impl Fastened {
    /// Returns true where there is nothing.
    pub fn is_empty(&self) -> bool {
        self.masses.is_empty() && self.springs.is_empty() && self.hinges.is_empty()
    }

    /// Fastens all of it.
    pub fn add_to(&self, specimen: &mut Specimen) {
        specimen.masses.extend_from_slice(&self.masses);
        specimen.springs.extend_from_slice(&self.springs);
        specimen.hinges.extend_from_slice(&self.hinges);
    }
}

/// Kinds of physics outside the catalogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutOfCatalogueKind {
    /// Something touches the beam somewhere: a spring to the ground that stays where it is.
    SecondSupport,
    /// Mass spread over a part of the beam, such as tape or paint.
    MassPatch,
    /// A part of the beam is softer, such as a delamination.
    SoftPatch,
    /// A wide and light thing that turns with the beam: rotary inertia without mass.
    RotaryLump,
    /// Two masses in two places.
    TwoMasses,
}

/// Pieces into which a patch is divided: the spacing is far below a quarter wave of the sixth mode.
const PIECES: usize = 12;

impl OutOfCatalogueKind {
    /// All kinds.
    pub const ALL: [Self; 5] = [
        Self::SecondSupport,
        Self::MassPatch,
        Self::SoftPatch,
        Self::RotaryLump,
        Self::TwoMasses,
    ];

    /// As results name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::SecondSupport => "second-support",
            Self::MassPatch => "mass-patch",
            Self::SoftPatch => "soft-patch",
            Self::RotaryLump => "rotary-lump",
            Self::TwoMasses => "two-masses",
        }
    }

    /// Draws a size and a place.
    pub fn draw(self, beam: &Beam, random: &mut ChaCha8Rng) -> Fastened {
        let (length, stiffness) = (beam.length, beam.bending_stiffness());
        let mut fastened = Fastened::default();
        match self {
            Self::SecondSupport => fastened.springs.push(PointSpring {
                position: length * random.random_range(0.55..0.95),
                stiffness: log_uniform(0.5, 8.0, random) * stiffness / length.powi(3),
            }),
            Self::MassPatch => {
                let total = beam.mass() * log_uniform(0.01, 0.06, random);
                for position in patch(length, random) {
                    fastened.masses.push(mass(position, total / PIECES as f64));
                }
            }
            Self::SoftPatch => {
                let total = log_uniform(0.01, 0.1, random) * length / stiffness;
                for position in patch(length, random) {
                    fastened.hinges.push(Hinge {
                        position,
                        compliance: total / PIECES as f64,
                    });
                }
            }
            Self::RotaryLump => fastened.masses.push(PointMass {
                position: length * random.random_range(0.3..1.0),
                mass: 0.0,
                inertia: log_uniform(2e-5, 1e-3, random) * beam.mass() * length * length,
            }),
            Self::TwoMasses => {
                let near = length * random.random_range(0.2..0.5);
                let far = near + length * random.random_range(0.2..0.45);
                for position in [near, far] {
                    let size = log_uniform(0.004, 0.03, random);
                    fastened.masses.push(mass(position, size * beam.mass()));
                }
            }
        }
        fastened
    }
}

fn mass(position: f64, mass: f64) -> PointMass {
    PointMass {
        position,
        mass,
        inertia: 0.0,
    }
}

/// Evenly spread positions (m) over a fifth to two fifths of the beam.
fn patch(length: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
    let width = length * random.random_range(0.2..0.4);
    let start = random.random_range(0.05 * length..0.95 * length - width);
    (0..PIECES)
        .map(|piece| start + (piece as f64 + 0.5) / PIECES as f64 * width)
        .collect()
}
