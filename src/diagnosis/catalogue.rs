//! The hypotheses: which size each effect may have before anything is measured.
//!
//! Every prior reaches zero, so that "a little of it" is never excluded by definition. Sizes are
//! mixtures of two normal distributions, half of them where the sign is fixed: the wider has the
//! standard deviation `scale`, whose double is the catalogue's largest size, the other two fifths of it.
//! One width alone would call a third of the range implausibly small.
//!
//! Sizes that belong to the structure are fractions of its own: masses of the beam's mass, springs of
//! E I/L^3, axial forces of E I/L^2. Those of sensors and clocks are absolute.

use tapjoint_beam::effects::EffectId;
use tapjoint_beam::specimen::Specimen;

/// What is tested against what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    /// Which effect.
    pub(super) effect: EffectId,
    /// The parameter that is zero when there is no such effect.
    pub(super) size: Size,
    /// The parameter that says where or how, if it has one.
    pub(super) place: Option<PlaceRange>,
}

/// Prior of an effect's size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Size {
    /// Parameter of the effect.
    pub(super) name: &'static str,
    /// Standard deviation of the widest part (SI).
    pub(super) scale: f64,
    /// Value without the effect: 0, or what the nominal model has.
    pub(super) nothing: f64,
    /// Lowest value.
    pub(super) low: f64,
    /// Highest value.
    pub(super) high: f64,
}

/// Prior of an effect's second parameter: uniform, in its logarithm where `logarithmic`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlaceRange {
    /// What it is.
    pub(super) kind: PlaceKind,
    /// Lowest value (SI).
    pub(super) low: f64,
    /// Highest value (SI).
    pub(super) high: f64,
    /// Points at which the search begins.
    pub(super) nodes: usize,
}

/// What a second parameter is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PlaceKind {
    /// Position along the beam (m), uniform.
    Position,
    /// Frequency of the fixture alone (Hz), uniform in its logarithm.
    FixtureFrequency,
    /// Exponent of the amplitude, uniform.
    Exponent,
    /// Radius of gyration of a mass at the joint (m), uniform in its logarithm.
    Gyration,
}

impl PlaceRange {
    /// The parameter as it is searched for: its logarithm for scales, itself for places.
    pub(super) fn inward(&self, value: f64) -> f64 {
        if self.logarithmic() {
            value.ln()
        } else {
            value
        }
    }

    /// Back from [`inward`](Self::inward).
    pub(super) fn outward(&self, searched: f64) -> f64 {
        if self.logarithmic() {
            searched.exp()
        } else {
            searched
        }
    }

    fn logarithmic(&self) -> bool {
        matches!(self.kind, PlaceKind::FixtureFrequency | PlaceKind::Gyration)
    }
}

/// Parts of the prior of a size, as shares of its scale.
const WIDTHS: [f64; 2] = [1.0, 0.4];

impl Size {
    /// Logarithm of the prior density (1 over the unit of the size).
    pub(super) fn log_density(&self, value: f64) -> f64 {
        if value < self.low || value > self.high {
            return f64::NEG_INFINITY;
        }
        let density: f64 = WIDTHS
            .iter()
            .map(|width| {
                let std = width * self.scale;
                let away = (value - self.nothing) / std;
                (-0.5 * away * away).exp() / (std * (2.0 * std::f64::consts::PI).sqrt())
            })
            .sum::<f64>()
            / WIDTHS.len() as f64;
        let sides: f64 = if self.low >= self.nothing { 2.0 } else { 1.0 };
        (sides * density).ln()
    }

    fn positive(name: &'static str, scale: f64, high: f64) -> Self {
        Size {
            name,
            scale,
            nothing: 0.0,
            low: 0.0,
            high,
        }
    }

    fn signed(name: &'static str, scale: f64, reach: f64) -> Self {
        Size {
            name,
            scale,
            nothing: 0.0,
            low: -reach,
            high: reach,
        }
    }
}

/// What the sizes of the candidates hang on.
pub(super) struct Scales {
    /// Length of the structure (m).
    length: f64,
    /// Mass of the beam or beams (kg).
    mass: f64,
    /// Bending stiffness of the first beam (N m2).
    bending: f64,
}

impl Scales {
    pub(super) fn of(specimen: &Specimen) -> Self {
        let beams = specimen.body.beams();
        Scales {
            length: specimen.body.length(),
            mass: beams.iter().map(tapjoint_beam::Beam::mass).sum(),
            bending: beams[0].bending_stiffness(),
        }
    }
}

/// Prior of an effect; `None` for one that is no hypothesis of this kind (joint drift changes the
/// spread of a nuisance and not a prediction).
pub(super) fn candidate(effect: EffectId, scales: &Scales) -> Option<Candidate> {
    let (size, place) = of_joint(effect, scales).or_else(|| of_body(effect, scales))?;
    Some(Candidate {
        effect,
        size,
        place,
    })
}

/// Size and place of effects at sensors, joint and fixture.
fn of_joint(effect: EffectId, scales: &Scales) -> Option<(Size, Option<PlaceRange>)> {
    Some(match effect {
        EffectId::SensorMass => (Size::positive("mass", 0.015, 0.3 * scales.mass), None),
        EffectId::SensorCable => {
            let unit = scales.bending / scales.length.powi(3);
            (Size::positive("stiffness", 0.15 * unit, 3.0 * unit), None)
        }
        EffectId::CrossCoupling => (Size::signed("coupling", 0.2, 0.95), None),
        EffectId::JointMass => (
            Size::positive("mass", 0.06 * scales.mass, 0.6 * scales.mass),
            Some(PlaceRange {
                kind: PlaceKind::Gyration,
                low: 0.003,
                high: 0.03,
                nodes: 2,
            }),
        ),
        EffectId::JointNonlinearity => (
            Size::signed("ratio", 0.1, 0.7),
            Some(PlaceRange {
                kind: PlaceKind::Exponent,
                low: 0.5,
                high: 2.0,
                nodes: 3,
            }),
        ),
        EffectId::JointDamping => (Size::positive("loss_factor", 0.05, 0.5), None),
        EffectId::Fixture => (
            Size::positive("ratio", 0.05, 0.5),
            Some(PlaceRange {
                kind: PlaceKind::FixtureFrequency,
                low: 30.0,
                high: 2000.0,
                nodes: 14,
            }),
        ),
        _ => return None,
    })
}

/// Size and place of effects in the beam and in the acquisition.
fn of_body(effect: EffectId, scales: &Scales) -> Option<(Size, Option<PlaceRange>)> {
    Some(match effect {
        EffectId::Modulus => (Size::signed("relative", 0.03, 0.3), None),
        EffectId::Length => (Size::signed("relative", 0.007, 0.1), None),
        EffectId::Timebase => (Size::signed("relative", 0.001, 0.05), None),
        EffectId::AddedMass => (
            Size::positive("mass", 0.02 * scales.mass, 0.3 * scales.mass),
            Some(along(scales, 12)),
        ),
        EffectId::LocalCrack => (
            Size::positive("compliance", 0.025, 0.5),
            Some(along(scales, 18)),
        ),
        EffectId::AxialLoad => {
            // A beam on springs buckles at P L^2/(E I) = -pi^2/4 or above.
            let unit = scales.bending / scales.length.powi(2);
            (
                Size {
                    low: -1.5 * unit,
                    ..Size::signed("force", 0.2 * unit, 5.0 * unit)
                },
                None,
            )
        }
        EffectId::ShearRotary => (Size::positive("factor", 1.5, 10.0), None),
        EffectId::Resolution => (Size::signed("offset", 0.125, 2.0), None),
        _ => return None,
    })
}

/// Anywhere on the structure.
fn along(scales: &Scales, nodes: usize) -> PlaceRange {
    PlaceRange {
        kind: PlaceKind::Position,
        low: 0.01 * scales.length,
        high: scales.length,
        nodes,
    }
}
