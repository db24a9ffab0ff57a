//! Drawn pairs of tests: structure, description, change, scatter.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, LogNormal, StandardNormal, StudentT};
use tapjoint::compare::{
    CauseKind, Comparison, Item, ItemKind, MeasuredMode, Pair, Settings, Test,
};
use tapjoint::effects::{Circumstances, Effect, EffectId, apply};
use tapjoint::structure::specimen::{
    BeamSection, Body, Joint, LapLayout, LapOverlap, Mesh, PointMass, PointSpring, Specimen,
};
use tapjoint::structure::{Assembly, Beam, BeamTheory};

/// Class of changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cell {
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
    /// A change that the program does not know.
    Outside,
}

impl Cell {
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

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Joint => "joint-change",
            Self::Lost => "lost-mass",
            Self::Added => "added-mass",
            Self::Crack => "local-crack",
            Self::Length => "length",
            Self::Modulus => "modulus",
            Self::Moved => "sensor-position",
            Self::Axial => "axial-load",
            Self::Two => "two",
            Self::Outside => "outside",
        }
    }

    fn cause(self) -> Option<CauseKind> {
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

/// A drawn pair.
pub struct Drawn {
    /// What the program sees.
    pub pairs: Vec<Pair>,
    /// What it is told.
    pub settings: Settings,
    /// True causes; empty for nothing, and for one that the program does not know.
    pub causes: Vec<CauseKind>,
    /// Their sizes by name.
    pub sizes: Vec<(&'static str, f64)>,
    /// Chi square of the change alone.
    pub chi_square: f64,
    /// True standard deviation of the difference of two tests (1).
    pub repeatability: f64,
}

/// Elements of the true structure.
const MESH: Mesh = Mesh { elements: 80 };
/// Single changes of two at once.
const SINGLE: [Cell; 5] = [
    Cell::Joint,
    Cell::Added,
    Cell::Crack,
    Cell::Modulus,
    Cell::Axial,
];

pub fn log_uniform(draw: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(draw.random::<f64>())
}

pub fn normal(draw: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(draw)
}

fn sign(draw: &mut ChaCha8Rng) -> f64 {
    if draw.random::<bool>() { 1.0 } else { -1.0 }
}

impl Drawn {
    /// Draws a pair; `None` where the drawn structure cannot be.
    pub fn new(cell: Cell, seed: u64, number: u64, attempt: u64) -> Option<Self> {
        let mut draw = ChaCha8Rng::seed_from_u64(seed);
        draw.set_stream(((cell as u64) << 40) + (number << 8) + attempt);
        let draw = &mut draw;
        let (described, items) = structure(draw, cell)?;
        let truth = actual(draw, &described);
        let mut causes = Vec::new();
        let mut sizes = Vec::new();
        let mut after = truth.clone();
        let mut changes = vec![cell];
        if cell == Cell::Two {
            let first = draw.random_range(0..SINGLE.len());
            let second = (first + draw.random_range(1..SINGLE.len())) % SINGLE.len();
            changes = vec![SINGLE[first], SINGLE[second]];
        }
        for change in changes {
            after = changed(draw, &after, &items, change, &mut sizes)?;
            causes.extend(change.cause());
        }
        let count = draw.random_range(4..=8);
        let modes = |specimen: &Specimen| -> Option<Vec<f64>> {
            let solved = specimen.modes(count, MESH).ok()?;
            Some(solved.frequencies().to_vec())
        };
        let (before, after) = (modes(&truth)?, modes(&after)?);
        let repeatability = log_uniform(draw, 1e-4, 4e-3);
        let squares = before.iter().zip(&after);
        let chi_square = squares
            .map(|(a, b)| ((b / a).ln() / repeatability).powi(2))
            .sum::<f64>();
        let knows = draw.random_range(0..4);
        let repeats = if knows == 2 { 3 } else { 1 };
        let share = 0.5 * draw.random::<f64>();
        let mut tests = |frequencies: &[f64]| -> Vec<Test> {
            (0..repeats)
                .map(|_| {
                    let common = share.sqrt() * normal(draw);
                    let mut modes = Vec::new();
                    for (index, frequency) in frequencies.iter().enumerate() {
                        let tail: f64 = StudentT::new(4.0).map_or(0.0, |t| t.sample(draw));
                        // Student's with four degrees of freedom has the variance 2.
                        let own = (1.0 - share).sqrt() * tail / 2.0_f64.sqrt();
                        let off = repeatability / 2.0_f64.sqrt() * (common + own);
                        modes.push(MeasuredMode::of_frequency(
                            index + 1,
                            frequency * off.exp(),
                            0.05 * repeatability * frequency,
                        ));
                    }
                    Test {
                        structure: described.clone(),
                        items: items.clone(),
                        knows_joint: [false; 2],
                        common_std: 0.01,
                        modes,
                        unnumbered: Vec::new(),
                    }
                })
                .collect()
        };
        let pair = Pair {
            before: tests(&before),
            after: tests(&after),
        };
        Some(Self {
            pairs: vec![pair],
            settings: Settings {
                repeatability: (knows < 2).then_some(repeatability),
            },
            causes,
            sizes,
            chi_square,
            repeatability,
        })
    }

    /// Counts whether the intervals of a true single cause hold its sizes: Kt, Kr, mass, position.
    pub fn count_intervals(&self, found: &Comparison, mut count: impl FnMut(usize, bool)) {
        let [kind] = self.causes[..] else {
            return;
        };
        let Some(own) = found.hypotheses.iter().find(|one| one.effect == kind) else {
            return;
        };
        for (index, name) in ["kt", "kr", "mass", "position"].into_iter().enumerate() {
            let truth = self.sizes.iter().find(|one| one.0 == name);
            // A mass is told only where it is seen at all.
            let is_told = index < 2 || (kind == CauseKind::AddedMass && self.chi_square > 30.0);
            if let (Some((_, truth)), Some(value), true) =
                (truth, own.parameters.get(name), is_told)
            {
                count(index, (value.low..=value.high).contains(truth));
            }
        }
    }
}

/// Draws a described structure and its items.
pub fn structure(draw: &mut ChaCha8Rng, cell: Cell) -> Option<(Specimen, Vec<Item>)> {
    let kind = match draw.random_range(0..10) {
        0..6 => Assembly::Cantilever,
        6..8 => Assembly::Lap,
        _ if matches!(cell, Cell::Joint | Cell::Two) => Assembly::Cantilever,
        _ => Assembly::Free,
    };
    let length = log_uniform(draw, 0.2, 0.8);
    let materials = [(205e9, 7850.0), (70e9, 2700.0), (110e9, 8500.0)];
    let (modulus, density) = materials[draw.random_range(0..3)];
    let beam = Beam {
        length,
        width: length * log_uniform(draw, 0.04, 0.12),
        thickness: length * log_uniform(draw, 0.008, 0.03),
        modulus,
        density,
        poisson: 0.3,
    };
    let stiffness = beam.bending_stiffness();
    let joint = Joint {
        kt: log_uniform(draw, 50.0, 2e4) * stiffness / length.powi(3),
        kr: log_uniform(draw, 1.0, 80.0) * stiffness / length,
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
        let mass = beam.mass() * log_uniform(draw, 0.005, 0.05);
        items.push(Item {
            name: format!("S{number}"),
            point: PointMass::new(length * (0.15 + 0.8 * draw.random::<f64>()), mass),
            kind: ItemKind::Sensor,
        });
    }
    let masses = if cell == Cell::Lost { 1 } else { 0 };
    for number in 0..draw.random_range(masses..=4) {
        let mass = beam.mass() * log_uniform(draw, 0.005, 0.06);
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

/// Draws the structure as it is: off by tolerances, and by one effect that the description lacks. The order of its masses is
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
                beam_mass * log_uniform(draw, 0.005, 0.05),
            ));
        }
        2 => truth.joint_mass.mass += beam_mass * log_uniform(draw, 0.01, 0.1),
        3 => {
            let euler = truth.body.beams()[0].bending_stiffness() * 9.87 / (length * length);
            truth.axial_force += 0.03 * euler * normal(draw);
        }
        _ => {}
    }
    truth
}

/// Draws a change, and adds its sizes.
fn changed(
    draw: &mut ChaCha8Rng,
    before: &Specimen,
    items: &[Item],
    cell: Cell,
    sizes: &mut Vec<(&'static str, f64)>,
) -> Option<Specimen> {
    let mut after = before.clone();
    let length = before.body.length();
    let beam_mass: f64 = before.body.beams().iter().map(Beam::mass).sum();
    let place = length * (0.05 + 0.9 * draw.random::<f64>());
    let effect = match cell {
        Cell::Nothing => return Some(after),
        Cell::Joint => {
            let joint = after.joint.as_mut()?;
            let which = draw.random_range(0..3);
            let [mut kt, mut kr] = [0.0; 2];
            if which != 1 {
                kt = sign(draw) * log_uniform(draw, 0.01, 0.3);
            }
            if which != 0 {
                kr = sign(draw) * log_uniform(draw, 0.01, 0.3);
            }
            joint.kt *= 1.0 + kt;
            joint.kr *= 1.0 + kr;
            sizes.extend([("kt", kt), ("kr", kr)]);
            return Some(after);
        }
        Cell::Lost => {
            let index = draw.random_range(0..items.len());
            sizes.push(("mass", -after.masses[index].mass));
            after.masses[index].mass = 0.0;
            return Some(after);
        }
        Cell::Moved => {
            let index = draw.random_range(
                0..items
                    .iter()
                    .filter(|one| one.kind == ItemKind::Sensor)
                    .count(),
            );
            let moved =
                after.masses[index].position + sign(draw) * length * log_uniform(draw, 0.005, 0.1);
            if !(0.0..=length).contains(&moved) {
                return None;
            }
            sizes.push(("sensor_shift", moved - after.masses[index].position));
            after.masses[index].position = moved;
            return Some(after);
        }
        Cell::Added => {
            let mass = beam_mass * log_uniform(draw, 0.001, 0.1);
            sizes.extend([("mass", mass), ("position", place)]);
            (
                EffectId::AddedMass,
                vec![("mass", mass), ("position", place)],
            )
        }
        Cell::Crack => {
            let compliance = log_uniform(draw, 0.001, 0.1);
            sizes.extend([("compliance", compliance), ("position", place)]);
            (
                EffectId::LocalCrack,
                vec![("compliance", compliance), ("position", place)],
            )
        }
        Cell::Length => {
            let size = sign(draw) * log_uniform(draw, 0.0005, 0.01);
            sizes.push(("relative", size));
            (EffectId::Length, vec![("relative", size)])
        }
        Cell::Modulus => {
            let size = sign(draw) * log_uniform(draw, 0.0005, 0.02);
            sizes.push(("relative", size));
            (EffectId::Modulus, vec![("relative", size)])
        }
        Cell::Axial => {
            // Nothing else holds the load.
            if before.joint.is_none() || matches!(before.body, Body::Joined(_)) {
                return None;
            }
            let euler = before.body.beams()[0].bending_stiffness() * 9.87 / (length * length);
            let size = sign(draw) * euler * log_uniform(draw, 0.002, 0.05);
            sizes.push(("force", size));
            (EffectId::AxialLoad, vec![("force", size)])
        }
        Cell::Outside => {
            match draw.random_range(0..4) {
                0 => {
                    let unit = before.body.beams()[0].bending_stiffness() / length.powi(3);
                    after.springs.push(PointSpring {
                        position: place,
                        stiffness: unit * log_uniform(draw, 0.1, 10.0),
                    });
                }
                1 => {
                    let width = length * (0.1 + 0.2 * draw.random::<f64>());
                    let start = (length - width) * draw.random::<f64>();
                    after.sections.push(BeamSection {
                        start,
                        end: start + width,
                        stiffness: 1.0,
                        mass: 1.0 + log_uniform(draw, 0.01, 0.2),
                    });
                }
                2 => {
                    let width = length * (0.15 + 0.2 * draw.random::<f64>());
                    let start = (length - width) * draw.random::<f64>();
                    after.sections.push(BeamSection {
                        start,
                        end: start + width,
                        stiffness: 1.0 - log_uniform(draw, 0.01, 0.2),
                        mass: 1.0,
                    });
                }
                _ => {
                    for _ in 0..3 {
                        let place = length * (0.1 + 0.9 * draw.random::<f64>());
                        let mass = beam_mass * log_uniform(draw, 0.002, 0.03);
                        after.masses.push(PointMass::new(place, mass));
                    }
                }
            }
            return Some(after);
        }
        Cell::Two => return None,
    };
    let effect = Effect::from_pairs(effect.0, &effect.1).ok()?;
    Some(apply(&[effect], before, &Circumstances::default()).specimen)
}
