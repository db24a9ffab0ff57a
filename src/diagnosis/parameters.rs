//! Parameters of a hypothesis and their priors: joint, effects, and nuisance parameters.
//!
//! Every prior of an effect's size reaches zero, so that a little of it is never excluded by definition. Sizes are
//! mixtures of two normal distributions, half of them where the sign is fixed. The wider has the
//! standard deviation `scale`, whose double is the catalogue's largest size, the other two fifths of it.
//! One width alone would make a third of the range implausibly small.
//!
//! Sizes that belong to the structure are fractions of its own: masses of the beam's mass, springs of
//! E I/L^3, axial forces of E I/L^2. Those of sensors and clocks are absolute.

use crate::result::LARGEST_STIFFNESS_CHANGE;
use crate::structure::{Arrangement, COUPLING, Nominal, ROTATION};
use tapjoint_beam::effects::{Effect, EffectId};
use tapjoint_identify::consistent::Parameter;

/// Nuisance parameter: small, unknown, and shared by all hypotheses. Its influence is linear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NuisanceParameter {
    /// Property of the beam over its described value (logarithm).
    Property { property: Parameter },
    /// Poisson's ratio less the described one (1).
    Poisson,
    /// How the joint holds the width: 0 for springs spread over it, 1 for a clamp that keeps the slope across it.
    WidthHold,
    /// Shear flexibility and rotary inertia of a Timoshenko beam over the nominal ones (1).
    Shear,
    /// Stiffness of the joint in one set-up (logarithm): direction 0 translation, 1 rotation.
    Drift { setup: usize, direction: usize },
    /// Common factor on all frequencies of one set-up (logarithm): it was warmer or colder than the others.
    Temperature { setup: usize },
    /// Mass of a sensor over its stated one (1).
    SensorMass { name: usize },
    /// Rotary inertia of a sensor over its mass times the square of [`GapSettings::sensor_radius`] (1).
    SensorInertia { name: usize },
    /// Rotary inertia of a mass that a hypothesis adds over that mass times the square of
    /// [`GapSettings::sensor_radius`] (1).
    AddedInertia,
    /// Position of a sensor (m), common to all configurations with the same stated one.
    SensorPosition { position: usize },
    /// Added mass over its stated one (1).
    FastenedMass { fastened: usize },
    /// Position of an added mass (m).
    FastenedPosition { fastened: usize },
    /// Position of the taps in one set-up (m).
    TapPosition { setup: usize },
    /// Calibration of a sensor as it was mounted for one set-up (1).
    Gain { setup: usize, name: usize },
    /// Common level of the nominal damping ratios (logarithm).
    Damping,
    /// Power of the frequency by which the nominal damping ratios rise.
    DampingTilt,
    /// Amplitude of the joint over the one that follows from the sensors' amplitudes and the shapes (logarithm).
    Amplitude,
    /// Common scatter of the taps of one configuration (standard deviations).
    Scatter { configuration: usize },
    /// What the model misses of one mode's frequency, in all configurations alike (logarithm).
    Discrepancy { mode: usize },
}

impl NuisanceParameter {
    /// Returns whether it is the joint's drift between set-ups.
    pub fn is_drift(self) -> bool {
        matches!(self, NuisanceParameter::Drift { .. })
    }
}

/// Nuisance parameter with its normal prior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nuisance {
    /// The parameter.
    pub parameter: NuisanceParameter,
    /// Centre of its prior, where the search begins.
    pub centre: f64,
    /// Standard deviation of its prior.
    pub std: f64,
}

/// Prior of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Centre of the normal distribution.
    pub centre: f64,
    /// Standard deviation of the normal distribution; infinite for none.
    pub std: f64,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
}

impl Prior {
    /// Returns a normal, unbounded prior.
    pub fn normal(centre: f64, std: f64) -> Self {
        Prior {
            centre,
            std,
            low: f64::NEG_INFINITY,
            high: f64::INFINITY,
        }
    }

    /// Returns the prior of a parameter that is held at a value: its density is left to the caller.
    pub fn held(value: f64) -> Self {
        Prior {
            centre: value,
            std: f64::INFINITY,
            low: value,
            high: value,
        }
    }

    /// Returns whether the parameter is held.
    pub fn is_held(&self) -> bool {
        self.low >= self.high
    }
}

/// Effect with the priors of its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidateEffect {
    /// The effect.
    pub effect: EffectId,
    /// Parameter that is zero when there is no such effect.
    pub size: Size,
    /// Second parameter, for its location or its law, if it has one.
    pub location: Option<LocationRange>,
}

/// Prior of an effect's size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Name of the effect's parameter.
    pub name: &'static str,
    /// Standard deviation of the widest part (SI).
    pub scale: f64,
    /// Value without the effect: 0, or that of the nominal model.
    pub neutral: f64,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
}

/// Prior of an effect's second parameter: uniform, or uniform in its logarithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocationRange {
    /// Meaning of the parameter.
    pub kind: LocationKind,
    /// Lowest value (SI).
    pub low: f64,
    /// Highest value (SI).
    pub high: f64,
    /// Points at which the search begins.
    pub nodes: usize,
}

/// Meaning of a second parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LocationKind {
    /// Position along the beam (m), uniform.
    Position,
    /// Frequency of the fixture alone (Hz), uniform in its logarithm.
    FixtureFrequency,
    /// Exponent of the amplitude, uniform.
    Exponent,
    /// Radius of gyration of a mass at the joint (m), uniform in its logarithm.
    Gyration,
}

impl LocationRange {
    /// Returns the parameter as it is searched: its logarithm for scales, itself for positions.
    pub fn to_searched(self, value: f64) -> f64 {
        if self.is_logarithmic() {
            value.ln()
        } else {
            value
        }
    }

    /// Returns the parameter from its searched form.
    pub fn value_at(self, searched: f64) -> f64 {
        if self.is_logarithmic() {
            searched.exp()
        } else {
            searched
        }
    }

    /// Returns the name of the effect's own parameter.
    pub fn name(self) -> &'static str {
        match self.kind {
            LocationKind::Position => "position",
            LocationKind::FixtureFrequency => "frequency",
            LocationKind::Exponent => "exponent",
            LocationKind::Gyration => "inertia",
        }
    }

    /// Returns the effect's own parameter: the value itself, or the inertia J = m r^2 of a mass.
    pub fn own_value(self, value: f64, size: f64) -> f64 {
        match self.kind {
            LocationKind::Gyration => size * value * value,
            _ => value,
        }
    }

    /// Returns the lowest and the highest value in the searched form.
    pub fn searched_bounds(self) -> (f64, f64) {
        (self.to_searched(self.low), self.to_searched(self.high))
    }

    /// Returns whether its logarithm is searched.
    pub fn is_logarithmic(self) -> bool {
        matches!(
            self.kind,
            LocationKind::FixtureFrequency | LocationKind::Gyration
        )
    }
}

/// Standard deviations of the parts of a size's prior, as shares of its scale.
const WIDTHS: [f64; 2] = [1.0, 0.4];

impl Size {
    /// Returns the logarithm of the prior density (1 over the unit of the size).
    pub fn log_density(&self, value: f64) -> f64 {
        if value < self.low || value > self.high {
            return f64::NEG_INFINITY;
        }
        let parts = WIDTHS.iter().map(|width| {
            let std = width * self.scale;
            let away = (value - self.neutral) / std;
            (-0.5 * away * away).exp() / (std * (2.0 * std::f64::consts::PI).sqrt())
        });
        let density: f64 = parts.sum::<f64>() / WIDTHS.len() as f64;
        let sides: f64 = if self.low >= self.neutral { 2.0 } else { 1.0 };
        (sides * density).ln()
    }

    /// Returns a size next to nothing, at which slopes with respect to a location do not vanish yet.
    pub fn small(&self) -> f64 {
        self.neutral + 0.05 * self.scale
    }

    fn positive(name: &'static str, scale: f64, high: f64) -> Self {
        Size {
            low: 0.0,
            ..Size::signed(name, scale, high)
        }
    }

    fn signed(name: &'static str, scale: f64, reach: f64) -> Self {
        Size {
            name,
            scale,
            neutral: 0.0,
            low: -reach,
            high: reach,
        }
    }
}

/// Returns an effect with its priors; `None` for an effect that is no hypothesis of this kind (joint drift changes the
/// spread of a nuisance parameter and not a prediction).
pub fn candidate_effect(effect: EffectId, nominal: &Nominal) -> Option<CandidateEffect> {
    let (length, mass) = (nominal.length(), nominal.beam_mass());
    let spring = nominal.bending_stiffness() / length.powi(3);
    let force = nominal.bending_stiffness() / length.powi(2);
    let size = match effect {
        EffectId::SensorMass => Size::positive("mass", 0.015, 0.3 * mass),
        EffectId::SensorCable => Size::positive("stiffness", 0.15 * spring, 3.0 * spring),
        EffectId::CrossCoupling => Size::signed("coupling", 0.2, 0.95),
        EffectId::JointMass => Size::positive("mass", 0.06 * mass, 0.6 * mass),
        EffectId::JointNonlinearity => Size::signed("ratio", 0.1, LARGEST_STIFFNESS_CHANGE),
        EffectId::JointDamping => Size::positive("loss_factor", 0.05, 0.5),
        EffectId::Fixture => Size::positive("ratio", 0.05, 0.5),
        EffectId::Modulus => Size::signed("relative", 0.03, 0.3),
        EffectId::Length => Size::signed("relative", 0.007, 0.1),
        EffectId::Density => Size::signed("relative", 0.03, 0.3),
        EffectId::Thickness => Size::signed("relative", 0.015, 0.2),
        EffectId::Timebase => Size::signed("relative", 0.001, 0.05),
        EffectId::AddedMass => Size::positive("mass", 0.02 * mass, 0.3 * mass),
        EffectId::LocalCrack => Size::positive("compliance", 0.025, 0.5),
        EffectId::AxialLoad => Size {
            // A beam on springs buckles at P L^2/(E I) = -pi^2/4 or above.
            low: -1.5 * force,
            ..Size::signed("force", 0.2 * force, 5.0 * force)
        },
        EffectId::ShearRotary => Size::positive("factor", 1.5, 10.0),
        EffectId::Resolution => Size::signed("offset", 0.125, 2.0),
        EffectId::JointDrift
        | EffectId::JointCompliance
        | EffectId::SensorPosition
        | EffectId::SensorPolarity
        | EffectId::SensorSwap
        | EffectId::SensorScale
        | EffectId::TapPosition => return None,
    };
    let range = match effect {
        EffectId::JointMass => Some((LocationKind::Gyration, 0.003, 0.03, 2)),
        EffectId::JointNonlinearity => Some((LocationKind::Exponent, 0.5, 2.0, 3)),
        EffectId::Fixture => Some((LocationKind::FixtureFrequency, 30.0, 2000.0, 14)),
        EffectId::AddedMass => Some((LocationKind::Position, 0.01 * length, length, 12)),
        EffectId::LocalCrack => Some((LocationKind::Position, 0.01 * length, length, 18)),
        _ => None,
    };
    Some(CandidateEffect {
        effect,
        size,
        location: range.map(|(kind, low, high, nodes)| LocationRange {
            kind,
            low,
            high,
            nodes,
        }),
    })
}

/// Returns the effects that can be hypotheses for a test: those whose object it has.
pub fn candidate_effects(nominal: &Nominal, arrangements: &[Arrangement]) -> Vec<CandidateEffect> {
    let has_joint = nominal.has_joint();
    let has_clamp = has_joint && nominal.is_one_beam();
    let possible = EffectId::ALL.into_iter().filter(|effect| {
        let mut sensors = arrangements.iter().flat_map(|one| &one.carried);
        match effect {
            EffectId::SensorMass => sensors.any(|sensor| sensor.mass == 0.0),
            EffectId::SensorCable => sensors.next().is_some(),
            EffectId::CrossCoupling => has_clamp && !nominal.fits(COUPLING),
            // No force pulls on a free end, nor on beams that overlap.
            EffectId::Fixture | EffectId::AxialLoad => has_clamp,
            EffectId::JointMass | EffectId::JointDamping => has_joint,
            EffectId::JointNonlinearity => nominal.fits(ROTATION),
            EffectId::Resolution => nominal.reading_bias.is_some(),
            _ => true,
        }
    });
    let candidates = possible.filter_map(|effect| {
        let mut candidate = candidate_effect(effect, nominal)?;
        if let (EffectId::Resolution, Some(bias)) = (effect, nominal.reading_bias) {
            candidate.size.scale = bias;
        }
        Some(candidate)
    });
    candidates.collect()
}

/// Order of the parameters of a hypothesis: joint, effects (size and location of each), nuisance parameters.
#[derive(Debug, Clone)]
pub struct Layout {
    /// Fitted parameters of the joint: 0 translation, 1 rotation, 2 coupling.
    pub joint: Vec<usize>,
    /// The effects.
    pub effects: Vec<CandidateEffect>,
}

impl Layout {
    /// Returns the order for these effects.
    pub fn new(nominal: &Nominal, effects: &[CandidateEffect]) -> Self {
        let joint = nominal.joint_parameters().into_iter();
        Layout {
            joint: joint.map(|(direction, _)| direction).collect(),
            effects: effects.to_vec(),
        }
    }

    /// Index of the size of an effect.
    pub fn size(&self, effect: usize) -> usize {
        let before = self.effects[..effect].iter();
        let counts = before.map(|one| 1 + usize::from(one.location.is_some()));
        self.joint.len() + counts.sum::<usize>()
    }

    /// Index of the location of an effect, if it has one.
    pub fn location(&self, effect: usize) -> Option<usize> {
        self.effects[effect].location.map(|_| self.size(effect) + 1)
    }

    /// Index of the size of the last effect.
    pub fn last_size(&self) -> usize {
        self.size(self.effects.len() - 1)
    }

    /// Index of the first nuisance parameter.
    pub fn first_nuisance(&self) -> usize {
        self.size(self.effects.len())
    }

    /// Index of the first location of this kind, if any effect has one.
    pub fn location_of_kind(&self, kind: LocationKind) -> Option<usize> {
        let mut ranges = self.effects.iter().map(|effect| effect.location);
        let effect = ranges.position(|range| range.is_some_and(|range| range.kind == kind))?;
        self.location(effect)
    }

    /// Returns the effects with the values that the parameters give them.
    pub fn effects_at(&self, parameters: &[f64]) -> Option<Vec<Effect>> {
        (0..self.effects.len())
            .map(|index| {
                let candidate = &self.effects[index];
                let size = parameters[self.size(index)];
                let mut pairs = vec![(candidate.size.name, size)];
                if let (Some(range), Some(location)) = (candidate.location, self.location(index)) {
                    let value = range.value_at(parameters[location]);
                    pairs.push((range.name(), range.own_value(value, size)));
                }
                Effect::from_pairs(candidate.effect, &pairs).ok()
            })
            .collect()
    }
}
