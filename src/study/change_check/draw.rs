//! Draws a structure, its description, and a change that comes between two tests.
//!
//! The description is wrong by its tolerances and, in four of five pairs, by one effect that both tests share. Sizes are drawn from small to
//! large.

use super::truth::{OUTSIDE, PlantedChange};
use crate::blind_check::{log_uniform, normal};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, LogNormal};
use tapjoint_beam::effects::{Circumstances, Effect, EffectId, apply};
use tapjoint_beam::specimen::{
    BeamSection, Body, Joint, LapLayout, LapOverlap, Mesh, PointMass, PointSpring, Specimen,
};
use tapjoint_beam::{Assembly, Beam, BeamTheory};
use tapjoint_compare::{CauseKind, Item, ItemKind};

/// Class of drawn changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChangeClass {
    /// Nothing.
    Nothing,
    /// The joint, translation, rotation or both.
    Joint,
    /// A named item is gone.
    Lost,
    /// A mass was added.
    Added,
    /// A crack.
    Crack,
    /// The free length.
    Length,
    /// The modulus.
    Modulus,
    /// A sensor was moved.
    Moved,
    /// The axial load.
    Axial,
    /// Two of them.
    Two,
    /// A change that the comparison does not know.
    Outside,
}

impl ChangeClass {
    /// All classes.
    pub const ALL: [Self; 11] = [
        Self::Nothing,
        Self::Joint,
        Self::Lost,
        Self::Added,
        Self::Crack,
        Self::Length,
        Self::Modulus,
        Self::Moved,
        Self::Axial,
        Self::Two,
        Self::Outside,
    ];

    /// Returns its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Two => "two",
            Self::Outside => "outside",
            _ => self.cause().map_or("", CauseKind::name),
        }
    }

    /// Returns the cause that the comparison should name; `None` for nothing, for two causes and for one outside.
    pub fn cause(self) -> Option<CauseKind> {
        Some(match self {
            Self::Joint => CauseKind::JointChange,
            Self::Lost => CauseKind::LostMass,
            Self::Added => CauseKind::AddedMass,
            Self::Crack => CauseKind::LocalCrack,
            Self::Length => CauseKind::Length,
            Self::Modulus => CauseKind::Modulus,
            Self::Moved => CauseKind::SensorPosition,
            Self::Axial => CauseKind::AxialLoad,
            Self::Nothing | Self::Two | Self::Outside => return None,
        })
    }
}

/// Chi square of a visible change: one in a hundred false alarms and one in ten misses, for an observer who knows what to
/// look for.
pub const VISIBLE: f64 = 14.9;

/// Elements of the true structure.
const MESH: Mesh = Mesh { elements: 80 };
/// Single changes of two at once.
const SINGLE: [ChangeClass; 5] = [
    ChangeClass::Joint,
    ChangeClass::Added,
    ChangeClass::Crack,
    ChangeClass::Modulus,
    ChangeClass::Axial,
];
/// Limits of the drawn repeatability (1).
const REPEATABILITY: [f64; 2] = [1e-4, 4e-3];

fn sign(draw: &mut ChaCha8Rng) -> f64 {
    if draw.random::<bool>() { 1.0 } else { -1.0 }
}

/// A structure before and after a change, and what the descriptions of both tests say of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangedStructure {
    /// The structure as both descriptions have it, all items on it.
    pub described: Specimen,
    /// The items, sensors first, in the order of the masses of all three structures.
    pub items: Vec<Item>,
    /// The structure as it was.
    pub before: Specimen,
    /// The structure as it is after the change.
    pub after: Specimen,
    /// What changed; empty for nothing.
    pub changes: Vec<PlantedChange>,
}

impl ChangedStructure {
    /// Draws a structure with a change; `None` where the drawn one cannot be.
    pub fn draw(class: ChangeClass, draw: &mut ChaCha8Rng) -> Option<Self> {
        let (described, items) = structure(draw, class)?;
        let before = actual(draw, &described);
        let mut after = before.clone();
        let mut classes = vec![class];
        if class == ChangeClass::Two {
            let first = draw.random_range(0..SINGLE.len());
            let second = (first + draw.random_range(1..SINGLE.len())) % SINGLE.len();
            classes = vec![SINGLE[first], SINGLE[second]];
        }
        let mut changes = Vec::new();
        for class in classes {
            let mut planted = PlantedChange::of(class.cause());
            after = changed(draw, &after, &items, class, &mut planted)?;
            if class != ChangeClass::Nothing {
                changes.push(planted);
            }
        }
        Some(Self {
            described,
            items,
            before,
            after,
            changes,
        })
    }

    /// Returns the lowest natural frequencies (Hz) before and after; `None` where the structure cannot be.
    pub fn frequencies(&self, count: usize) -> Option<[Vec<f64>; 2]> {
        let modes = |specimen: &Specimen| -> Option<Vec<f64>> {
            let solved = specimen.modes(count, MESH).ok()?;
            Some(solved.frequencies().to_vec())
        };
        Some([modes(&self.before)?, modes(&self.after)?])
    }
}

/// Returns chi square of a change alone, by frequencies before and after (Hz).
pub fn chi_square([before, after]: &[Vec<f64>; 2], repeatability: f64) -> f64 {
    let squares = before.iter().zip(after);
    squares
        .map(|(a, b)| ((b / a).ln() / repeatability).powi(2))
        .sum()
}

/// Draws a repeatability: standard deviation of the difference of two tests of one state (1, relative).
pub fn draw_repeatability(draw: &mut ChaCha8Rng) -> f64 {
    log_uniform(REPEATABILITY[0], REPEATABILITY[1], draw)
}

/// Draws a described structure and its items.
pub fn structure(draw: &mut ChaCha8Rng, class: ChangeClass) -> Option<(Specimen, Vec<Item>)> {
    let kind = match draw.random_range(0..10) {
        0..6 => Assembly::Cantilever,
        6..8 => Assembly::Lap,
        _ if matches!(class, ChangeClass::Joint | ChangeClass::Two) => Assembly::Cantilever,
        _ => Assembly::Free,
    };
    let length = log_uniform(0.2, 0.8, draw);
    let materials = [(205e9, 7850.0), (70e9, 2700.0), (110e9, 8500.0)];
    let (modulus, density) = materials[draw.random_range(0..3)];
    let beam = Beam {
        length,
        width: length * log_uniform(0.04, 0.12, draw),
        thickness: length * log_uniform(0.008, 0.03, draw),
        modulus,
        density,
        poisson: 0.3,
    };
    let stiffness = beam.bending_stiffness();
    let joint = Joint {
        kt: log_uniform(50.0, 2e4, draw) * stiffness / length.powi(3),
        kr: log_uniform(1.0, 80.0, draw) * stiffness / length,
        coupling: 0.0,
    };
    let theory = if draw.random::<bool>() {
        BeamTheory::Timoshenko
    } else {
        BeamTheory::Euler
    };
    let lap = LapLayout {
        overlap: (kind == Assembly::Lap).then_some(LapOverlap {
            length: 0.08 * length,
            mass: 0.05 * beam.mass(),
        }),
        ..Default::default()
    };
    let joint = (kind != Assembly::Free).then_some(joint);
    let mut specimen = Specimen::jointed(theory, &beam, kind, &lap, joint);
    let mut items = Vec::new();
    for number in 0..draw.random_range(1..=3) {
        let mass = beam.mass() * log_uniform(0.005, 0.05, draw);
        items.push(Item {
            name: format!("S{number}"),
            point: PointMass::new(length * (0.15 + 0.8 * draw.random::<f64>()), mass),
            kind: ItemKind::Sensor,
        });
    }
    let masses = if class == ChangeClass::Lost { 1 } else { 0 };
    for number in 0..draw.random_range(masses..=4) {
        let mass = beam.mass() * log_uniform(0.005, 0.06, draw);
        items.push(Item {
            name: format!("M{number}"),
            point: PointMass::new(length * (0.1 + 0.9 * draw.random::<f64>()), mass),
            kind: ItemKind::Mass,
        });
    }
    specimen.masses.extend(items.iter().map(|item| item.point));
    specimen.modes(8, MESH).ok()?;
    Some((specimen, items))
}

/// Draws the structure as it is: off by tolerances, and mostly by one effect that the description lacks. The order of its masses is
/// that of the items.
fn actual(draw: &mut ChaCha8Rng, described: &Specimen) -> Specimen {
    let mut truth = described.clone();
    let factors = [0.01, 0.005, 0.005].map(|std: f64| (std * normal(draw)).exp());
    for beam in truth.body.beams_mut() {
        beam.modulus *= factors[0];
        beam.density *= factors[1];
        beam.thickness *= factors[2];
    }
    let spread = LogNormal::new(0.0, 0.5);
    if let (Some(joint), Ok(spread)) = (&mut truth.joint, spread) {
        joint.kt *= spread.sample(draw);
        joint.kr *= spread.sample(draw);
    }
    let length = truth.body.length();
    for mass in &mut truth.masses {
        mass.position = (mass.position + 1e-3 * normal(draw)).clamp(0.0, length);
        mass.mass *= (0.05 * normal(draw)).exp();
    }
    let beam_mass: f64 = truth.body.beams().iter().map(Beam::mass).sum();
    match draw.random_range(0..5) {
        0 => {
            let end = 1.0 + 0.03 * normal(draw);
            truth.sections = BeamSection::taper(length, 2.0 - end, end, 12);
        }
        1 => {
            let place = length * draw.random::<f64>();
            truth.masses.push(PointMass::new(
                place,
                beam_mass * log_uniform(0.005, 0.05, draw),
            ));
        }
        2 => truth.joint_mass.mass += beam_mass * log_uniform(0.01, 0.1, draw),
        3 => {
            let euler = truth.body.beams()[0].bending_stiffness() * 9.87 / (length * length);
            truth.axial_force += 0.03 * euler * normal(draw);
        }
        _ => {}
    }
    truth
}

/// Draws a change with its sizes and its item.
fn changed(
    draw: &mut ChaCha8Rng,
    before: &Specimen,
    items: &[Item],
    class: ChangeClass,
    planted: &mut PlantedChange,
) -> Option<Specimen> {
    let mut after = before.clone();
    let length = before.body.length();
    let beam_mass: f64 = before.body.beams().iter().map(Beam::mass).sum();
    let place = length * (0.05 + 0.9 * draw.random::<f64>());
    let effect = match class {
        ChangeClass::Nothing => return Some(after),
        ChangeClass::Joint => {
            let joint = after.joint.as_mut()?;
            let which = draw.random_range(0..3);
            let [mut kt, mut kr] = [0.0; 2];
            if which != 1 {
                kt = sign(draw) * log_uniform(0.01, 0.3, draw);
            }
            if which != 0 {
                kr = sign(draw) * log_uniform(0.01, 0.3, draw);
            }
            joint.kt *= 1.0 + kt;
            joint.kr *= 1.0 + kr;
            planted.set(&[("kt", kt), ("kr", kr)]);
            return Some(after);
        }
        ChangeClass::Lost => {
            let index = draw.random_range(0..items.len());
            planted.item = Some(items[index].name.clone());
            planted.set(&[("mass", -after.masses[index].mass)]);
            after.masses[index].mass = 0.0;
            return Some(after);
        }
        ChangeClass::Moved => {
            let index = draw.random_range(
                0..items
                    .iter()
                    .filter(|one| one.kind == ItemKind::Sensor)
                    .count(),
            );
            let moved =
                after.masses[index].position + sign(draw) * length * log_uniform(0.005, 0.1, draw);
            if !(0.0..=length).contains(&moved) {
                return None;
            }
            planted.item = Some(items[index].name.clone());
            planted.set(&[("sensor_shift", moved - after.masses[index].position)]);
            after.masses[index].position = moved;
            return Some(after);
        }
        ChangeClass::Added => {
            let mass = beam_mass * log_uniform(0.001, 0.1, draw);
            (
                EffectId::AddedMass,
                vec![("mass", mass), ("position", place)],
            )
        }
        ChangeClass::Crack => {
            let compliance = log_uniform(0.001, 0.1, draw);
            (
                EffectId::LocalCrack,
                vec![("compliance", compliance), ("position", place)],
            )
        }
        ChangeClass::Length => {
            let size = sign(draw) * log_uniform(0.0005, 0.01, draw);
            (EffectId::Length, vec![("relative", size)])
        }
        ChangeClass::Modulus => {
            let size = sign(draw) * log_uniform(0.0005, 0.02, draw);
            (EffectId::Modulus, vec![("relative", size)])
        }
        ChangeClass::Axial => {
            // Nothing else holds the load.
            if before.joint.is_none() || matches!(before.body, Body::Joined(_)) {
                return None;
            }
            let euler = before.body.beams()[0].bending_stiffness() * 9.87 / (length * length);
            let size = sign(draw) * euler * log_uniform(0.002, 0.05, draw);
            (EffectId::AxialLoad, vec![("force", size)])
        }
        ChangeClass::Outside => {
            let kind = draw.random_range(0..OUTSIDE.len());
            planted.cause = OUTSIDE[kind].to_owned();
            match kind {
                0 => {
                    let unit = before.body.beams()[0].bending_stiffness() / length.powi(3);
                    after.springs.push(PointSpring {
                        position: place,
                        stiffness: unit * log_uniform(0.1, 10.0, draw),
                    });
                }
                1 => {
                    let width = length * (0.1 + 0.2 * draw.random::<f64>());
                    let start = (length - width) * draw.random::<f64>();
                    after.sections.push(BeamSection {
                        start,
                        end: start + width,
                        stiffness: 1.0,
                        mass: 1.0 + log_uniform(0.01, 0.2, draw),
                    });
                }
                2 => {
                    let width = length * (0.15 + 0.2 * draw.random::<f64>());
                    let start = (length - width) * draw.random::<f64>();
                    after.sections.push(BeamSection {
                        start,
                        end: start + width,
                        stiffness: 1.0 - log_uniform(0.01, 0.2, draw),
                        mass: 1.0,
                    });
                }
                _ => {
                    for _ in 0..3 {
                        let place = length * (0.1 + 0.9 * draw.random::<f64>());
                        let mass = beam_mass * log_uniform(0.002, 0.03, draw);
                        after.masses.push(PointMass::new(place, mass));
                    }
                }
            }
            return Some(after);
        }
        ChangeClass::Two => return None,
    };
    let (id, sizes) = effect;
    planted.set(&sizes);
    let effect = Effect::from_pairs(id, &sizes).ok()?;
    Some(apply(&[effect], before, &Circumstances::default()).specimen)
}
