//! Causes of a change between two tests: what each does to the structure, and how large it may be.

use crate::test::{Item, ItemKind};
use schemars::JsonSchema;
use serde::Serialize;
use std::f64::consts::PI;
use tapjoint_beam::effects::{Circumstances, Effect, EffectId, apply};
use tapjoint_beam::specimen::{Body, PointMass, Specimen};

/// Kind of a cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CauseKind {
    /// Nothing changed beyond what repeating a test changes.
    NoChange,
    /// The joint's stiffness changed.
    JointChange,
    /// An item that the description names is gone.
    LostMass,
    /// A mass was added or taken away, anywhere.
    AddedMass,
    /// The beam bends more easily at one place, or no longer does.
    LocalCrack,
    /// The free length changed.
    Length,
    /// The modulus changed; temperature is the usual reason.
    Modulus,
    /// A sensor was moved.
    SensorPosition,
    /// The axial load changed.
    AxialLoad,
    /// A change that no other cause explains.
    Unknown,
}

impl CauseKind {
    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoChange => "no-change",
            Self::JointChange => "joint-change",
            Self::LostMass => "lost-mass",
            Self::AddedMass => "added-mass",
            Self::LocalCrack => "local-crack",
            Self::Length => "length",
            Self::Modulus => "modulus",
            Self::SensorPosition => "sensor-position",
            Self::AxialLoad => "axial-load",
            Self::Unknown => "unknown",
        }
    }

    /// Returns its prior probability before those that a structure cannot have are left out. Half of all comparisons find
    /// nothing; a joint that was taken apart is the most frequent change.
    pub(crate) fn prior(self) -> f64 {
        match self {
            Self::NoChange => 0.5,
            Self::JointChange => 0.15,
            Self::LostMass => 0.08,
            Self::AddedMass => 0.07,
            Self::LocalCrack | Self::Modulus | Self::Unknown => 0.05,
            Self::SensorPosition => 0.02,
            Self::Length | Self::AxialLoad => 0.015,
        }
    }

    /// Returns true for a cause that frequencies hardly separate from this one, and for itself: masses that came, went or
    /// moved are alike, and so are length and modulus.
    pub fn is_like(self, other: Self) -> bool {
        let groups = [
            &[Self::LostMass, Self::AddedMass, Self::SensorPosition][..],
            &[Self::Length, Self::Modulus],
        ];
        self == other
            || groups
                .iter()
                .any(|group| group.contains(&self) && group.contains(&other))
    }
}

/// Prior of a size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SizePrior {
    /// Around zero with long tails: Cauchy's density with this half width.
    Cauchy {
        /// Half width: half of all sizes are smaller.
        half_width: f64,
        /// Share of the sizes below zero.
        below: f64,
    },
    /// Around a stated size.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        std: f64,
    },
}

impl SizePrior {
    /// Returns the logarithm of its density.
    pub(crate) fn log_density(self, size: f64) -> f64 {
        match self {
            Self::Cauchy { half_width, below } => {
                let share = if size < 0.0 { below } else { 1.0 - below };
                (2.0 * share / (PI * half_width * (1.0 + (size / half_width).powi(2)))).ln()
            }
            Self::Normal { mean, std } => {
                -0.5 * ((size - mean) / std).powi(2) - (std * (2.0 * PI).sqrt()).ln()
            }
        }
    }

    /// Returns the logarithm of the probability of a range about zero.
    fn log_share(self, [low, high]: [f64; 2]) -> f64 {
        match self {
            Self::Cauchy { half_width, below } => {
                let share = |size: f64| 2.0 / PI * (size.abs() / half_width).atan();
                (below * share(low) + (1.0 - below) * share(high)).ln()
            }
            // Four standard deviations to either side.
            Self::Normal { .. } => 0.0,
        }
    }
}

/// A cause with one size, and a place where it needs one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cause {
    /// Its kind.
    pub(crate) kind: CauseKind,
    /// Name of the item that it is about.
    pub(crate) item: Option<String>,
    /// Prior of its size: kg, m, N, or relative; of an item that is gone in masses of the item.
    pub(crate) prior: SizePrior,
    /// Smallest and largest size.
    pub(crate) range: [f64; 2],
    /// True where its place is unknown.
    pub(crate) is_placed: bool,
}

/// Largest mass (1, masses of the beam), largest crack (1, E I/L times its compliance) and others that are searched.
const MOST_MASS: f64 = 0.3;
const MOST_CRACK: f64 = 0.5;
const MOST_STRETCH: f64 = 0.05;
const MOST_SOFTENING: f64 = 0.2;
/// Largest axial load, in Euler's load of the beam on two pins: a cantilever buckles at a quarter of it.
const MOST_LOAD: f64 = 0.2;
/// Share of the cracks that are there before and not after: repaired, or the tests are given the other way round.
const REPAIRED: f64 = 0.1;
/// Longest way of a sensor (1, lengths of the beam).
const MOST_WAY: f64 = 0.15;
/// Standard uncertainty of the mass of an item (1). Items are cut and weighed as a batch.
const ITEM_MASS: f64 = 0.15;

impl Cause {
    /// Returns the logarithm of the prior density of a size within its range.
    pub(crate) fn log_prior(&self, size: f64) -> f64 {
        self.prior.log_density(size) - self.prior.log_share(self.range)
    }

    /// Returns all causes of one size that may have changed a structure with these items.
    pub(crate) fn all(structure: &Specimen, items: &[Item]) -> Vec<Self> {
        let beams = structure.body.beams();
        let beam_mass: f64 = beams.iter().map(tapjoint_beam::Beam::mass).sum();
        let length = structure.body.length();
        let euler = PI * PI * beams[0].bending_stiffness() / (length * length);
        let mut all = vec![
            Self::placed(
                CauseKind::AddedMass,
                0.02 * beam_mass,
                MOST_MASS * beam_mass,
            ),
            Self {
                prior: SizePrior::Cauchy {
                    half_width: 0.02,
                    below: REPAIRED,
                },
                ..Self::placed(CauseKind::LocalCrack, 0.02, MOST_CRACK)
            },
            Self::signed(CauseKind::Length, 0.002, MOST_STRETCH),
            Self::signed(CauseKind::Modulus, 0.004, MOST_SOFTENING),
        ];
        // Nothing holds the load of a free beam, nor of the halves of a lap joint.
        if structure.joint.is_some() && matches!(structure.body, Body::One(_)) {
            all.push(Self::signed(
                CauseKind::AxialLoad,
                0.01 * euler,
                MOST_LOAD * euler,
            ));
        }
        for item in items.iter().filter(|item| item.point.mass > 0.0) {
            // In masses of the item, which may differ from pair to pair.
            all.push(Self {
                kind: CauseKind::LostMass,
                item: Some(item.name.clone()),
                prior: SizePrior::Normal {
                    mean: -1.0,
                    std: ITEM_MASS,
                },
                range: [-1.0 - 4.0 * ITEM_MASS, -1.0 + 4.0 * ITEM_MASS],
                is_placed: false,
            });
            if item.kind == ItemKind::Sensor {
                let [back, ahead] = [item.point.position, length - item.point.position];
                let most = MOST_WAY * length;
                all.push(Self {
                    item: Some(item.name.clone()),
                    // Not beyond the ends of the beam.
                    range: [-back.min(most), ahead.min(most)],
                    ..Self::signed(CauseKind::SensorPosition, 0.02 * length, MOST_WAY * length)
                });
            }
        }
        all
    }

    fn signed(kind: CauseKind, half_width: f64, most: f64) -> Self {
        Self {
            kind,
            item: None,
            prior: SizePrior::Cauchy {
                half_width,
                below: 0.5,
            },
            range: [-most, most],
            is_placed: false,
        }
    }

    fn placed(kind: CauseKind, half_width: f64, most: f64) -> Self {
        Self {
            is_placed: true,
            ..Self::signed(kind, half_width, most)
        }
    }

    /// Returns true where a negative size is a change from after to before: masses and cracks have no negative size.
    pub(crate) fn is_mirrored(&self) -> bool {
        self.is_placed
    }

    /// Returns the structure with this cause; `None` where there is no such structure. Of a lost mass it is the structure
    /// that still has it: size 0 is the loss.
    pub(crate) fn applied(
        &self,
        structure: &Specimen,
        item: Option<&PointMass>,
        size: f64,
        place: f64,
    ) -> Option<Specimen> {
        let effect = match self.kind {
            CauseKind::AddedMass => (
                EffectId::AddedMass,
                vec![("mass", size), ("position", place)],
            ),
            CauseKind::LocalCrack => (
                EffectId::LocalCrack,
                vec![("compliance", size), ("position", place)],
            ),
            CauseKind::Length => (EffectId::Length, vec![("relative", size)]),
            CauseKind::Modulus => (EffectId::Modulus, vec![("relative", size)]),
            CauseKind::AxialLoad => (EffectId::AxialLoad, vec![("force", size)]),
            CauseKind::LostMass | CauseKind::SensorPosition => {
                let item = item?;
                let mut changed = structure.clone();
                let mut masses = changed.masses.iter_mut();
                let found = masses.find(|one| *one == item)?;
                if self.kind == CauseKind::LostMass {
                    // The structure before the loss: what the item weighs may be off.
                    found.mass = -size * item.mass;
                } else {
                    found.position += size;
                    if !(0.0..=structure.body.length()).contains(&found.position) {
                        return None;
                    }
                }
                return Some(changed);
            }
            CauseKind::NoChange | CauseKind::JointChange | CauseKind::Unknown => return None,
        };
        let effect = Effect::from_pairs(effect.0, &effect.1).ok()?;
        Some(apply(&[effect], structure, &Circumstances::default()).specimen)
    }
}
