//! Parameters of a hypothesis and their priors: joint, effects, and nuisance parameters.
//!
//! The prior of an effect's size is Cauchy's distribution (Gelman 2006, "Prior distributions for variance parameters",
//! section 3), cut off at the bounds of the size. It is one-sided where only one sign is possible. It has one number,
//! `scale`: about half of the sizes are smaller. Four fifths lie between 0.16 and 6.3 times the scale, which is 1.6 decades. It reaches zero, so that
//! a little of an effect is never excluded by definition, and its tail leaves room for gross errors. The scales come
//! from what such things weigh and yield, not from any study of the diagnosis; each stands with its reason in
//! [`candidates`](crate::candidates).
//!
//! Sizes that belong to the structure are fractions of its own: masses of the beam's mass, compliances of L/(E I),
//! axial forces of E I/L^2. Those of sensors, cables, rules and clocks are absolute.

use crate::foreign::ForeignCause;
use crate::structure::Nominal;
use statrs::function::erf::erfc;
use std::f64::consts::{SQRT_2, TAU};
use tapjoint_beam::effects::{Effect, EffectId, Group};
use tapjoint_beam::specimen::Specimen;
use tapjoint_identify::consistent::Parameter;

/// Nuisance parameter: small, unknown, and shared by all hypotheses.
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
    /// Factor on all frequencies (logarithm).
    CommonFactor,
}

impl NuisanceParameter {
    /// Returns whether it enters the solution itself; all others add to the predictions in proportion to their size.
    pub fn is_solved(self) -> bool {
        use NuisanceParameter::{
            Amplitude, Damping, DampingTilt, FastenedMass, FastenedPosition, Property, SensorMass,
            SensorPosition, TapPosition,
        };
        matches!(
            self,
            Amplitude
                | Damping
                | DampingTilt
                | Property { .. }
                | SensorMass { .. }
                | SensorPosition { .. }
                | TapPosition { .. }
                | FastenedMass { .. }
                | FastenedPosition { .. }
        )
    }

    /// Returns whether it can move what is observed of a mode in one configuration of a set-up.
    pub fn can_move(self, mode: usize, configuration: usize, setup: usize) -> bool {
        use NuisanceParameter::{Discrepancy, Drift, Gain, Scatter, TapPosition, Temperature};
        match self {
            Drift { setup: own, .. }
            | Temperature { setup: own }
            | TapPosition { setup: own }
            | Gain { setup: own, .. } => own == setup,
            Scatter { configuration: own } => own == configuration,
            Discrepancy { mode: own } => own == mode,
            _ => true,
        }
    }

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

/// Part of the set-up on which an effect acts. Indices are those of the dataset's inventory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// The structure, or all sensors or all taps alike.
    All,
    /// A sensor wherever it is, by the index of its name.
    Sensor { name: usize },
    /// A sensor at one of its stated positions, by the index of the position.
    Place { position: usize },
    /// Two sensors, by the indices of their names.
    Pair { names: [usize; 2] },
    /// Taps at one of their stated positions, by its index.
    Taps { tap: usize },
}

/// What a hypothesis adds to the described structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// An effect of the catalogue.
    Effect(EffectId),
    /// A cause outside the catalogue: a part of the hypothesis `unknown`.
    Foreign(ForeignCause),
}

/// Effect with the priors of its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidateEffect {
    /// The effect, or a cause outside the catalogue.
    pub cause: Cause,
    /// What it acts on.
    pub target: Target,
    /// Parameter that is zero when there is no such effect.
    pub size: Size,
    /// Second parameter, for its location or its law, if it has one.
    pub location: Option<LocationRange>,
    /// Number of targets that are as probable as this one, itself included.
    pub variants: usize,
}

/// Prior of an effect's size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Name of the effect's parameter.
    pub name: &'static str,
    /// Size that half of all effects of the kind do not reach (SI).
    pub scale: f64,
    /// Value without the effect: 0 for all effects of the catalogue.
    pub neutral: f64,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
    /// Distribution of the distance from `neutral`, in the unit of the size: it replaces Cauchy's. `None` for the catalogue's prior.
    pub known: Option<LogNormal>,
}

/// Distribution of a magnitude whose logarithm is normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogNormal {
    /// Median of the size's magnitude (SI).
    pub median: f64,
    /// Standard deviation of the natural logarithm.
    pub spread: f64,
}

impl LogNormal {
    /// Returns the logarithm of the density at a magnitude above 0 (1 over its unit).
    fn log_density(&self, value: f64) -> f64 {
        let away = (value / self.median).ln() / self.spread;
        -0.5 * away * away - (value * self.spread * TAU.sqrt()).ln()
    }

    /// Returns the probability of a magnitude up to a bound (1).
    fn share_below(&self, bound: f64) -> f64 {
        if bound <= 0.0 {
            return 0.0;
        }
        let away = (bound / self.median).ln() / self.spread;
        0.5 * erfc(-away / SQRT_2)
    }
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
    /// Translational compliance of a joint that is described as rigid (1), uniform in its logarithm.
    Translation,
}

impl CandidateEffect {
    /// Returns the effect of the catalogue; `None` for a cause outside of it.
    pub fn effect(&self) -> Option<EffectId> {
        match self.cause {
            Cause::Effect(effect) => Some(effect),
            Cause::Foreign(_) => None,
        }
    }

    /// Returns whether it is this effect.
    pub fn is(&self, effect: EffectId) -> bool {
        self.cause == Cause::Effect(effect)
    }

    /// Returns whether it is an error of the set-up.
    pub fn is_of_set_up(&self) -> bool {
        self.effect()
            .is_some_and(|effect| effect.group() == Group::SetUp)
    }
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
            LocationKind::Translation => "translation",
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
            LocationKind::FixtureFrequency | LocationKind::Gyration | LocationKind::Translation
        )
    }
}

impl Size {
    /// Returns the logarithm of the prior density (1 over the unit of the size); 0 for a size that is fixed.
    pub fn log_density(&self, value: f64) -> f64 {
        if self.is_fixed() {
            return 0.0;
        }
        if value < self.low || value > self.high {
            return f64::NEG_INFINITY;
        }
        if let Some(known) = self.known {
            let away = (value - self.neutral).abs();
            // Both signs are equally probable, as far as the bounds allow.
            let sides = [self.neutral - self.low, self.high - self.neutral];
            let within: f64 = sides.iter().map(|bound| known.share_below(*bound)).sum();
            return match away > 0.0 && within > 0.0 {
                true => known.log_density(away) - within.ln(),
                false => f64::NEG_INFINITY,
            };
        }
        // Cauchy's distribution between the bounds.
        let [low, high, away] =
            [self.low, self.high, value].map(|x| (x - self.neutral) / self.scale);
        let within = high.atan() - low.atan();
        -(within * self.scale * (1.0 + away * away)).ln()
    }

    /// Returns whether there is but one size: an effect that is there or not.
    pub fn is_fixed(&self) -> bool {
        self.low >= self.high
    }

    /// Returns a size next to nothing, at which slopes with respect to a location do not vanish yet.
    pub fn small(&self) -> f64 {
        if self.is_fixed() {
            return self.low;
        }
        self.neutral + 0.05 * self.scale
    }

    pub fn positive(name: &'static str, scale: f64, high: f64) -> Self {
        Size {
            low: 0.0,
            ..Size::signed(name, scale, high)
        }
    }

    /// Returns the size of an effect that is there or not.
    pub fn fixed(name: &'static str) -> Self {
        Size {
            low: 1.0,
            ..Size::signed(name, 1.0, 1.0)
        }
    }

    /// Returns the prior of an offset (m) from the stated places, on a beam of this length (m). Half of the offsets are
    /// below 5 mm.
    pub fn offset(stated: &[f64], length: f64) -> Self {
        let room = stated.iter().map(|place| (length - place).max(0.0));
        Size {
            low: -stated.iter().copied().fold(length, f64::min),
            high: room.fold(length, f64::min),
            ..Size::signed("offset", 0.005, length)
        }
    }

    pub fn signed(name: &'static str, scale: f64, reach: f64) -> Self {
        Size {
            name,
            scale,
            neutral: 0.0,
            low: -reach,
            high: reach,
            known: None,
        }
    }
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

    /// Returns the sum of the sizes of all effects of a kind; 0 without any.
    pub fn size_of(&self, wanted: EffectId, parameters: &[f64]) -> f64 {
        let effects = self.effects.iter().enumerate();
        let own = effects.filter(|(_, one)| one.is(wanted));
        own.map(|(k, _)| parameters[self.size(k)]).sum()
    }

    /// Returns whether one of its effects is an error of the set-up.
    pub fn has_set_up_error(&self) -> bool {
        self.effects.iter().any(CandidateEffect::is_of_set_up)
    }

    /// Adds the causes outside the catalogue to a specimen, with the sizes and places that the parameters give them.
    pub fn add_foreign(&self, parameters: &[f64], specimen: &mut Specimen) {
        for (index, candidate) in self.effects.iter().enumerate() {
            if let Cause::Foreign(cause) = candidate.cause {
                let place = self.location(index).map_or(0.0, |at| parameters[at]);
                cause.add(parameters[self.size(index)], place, specimen);
            }
        }
    }

    /// Returns the effects of the catalogue with the values that the parameters give them.
    pub fn effects_at(&self, parameters: &[f64]) -> Option<Vec<Effect>> {
        let all = self.effects.iter().enumerate();
        all.filter_map(|(index, candidate)| Some((index, candidate, candidate.effect()?)))
            .map(|(index, candidate, effect)| {
                let size = parameters[self.size(index)];
                if candidate.size.is_fixed() {
                    return Effect::from_pairs(effect, &[]).ok();
                }
                let mut pairs = vec![(candidate.size.name, size)];
                // A joint that is rigid in translation alone does not turn the more.
                if effect == EffectId::JointCompliance && candidate.size.name != "rotation" {
                    pairs.push(("rotation", 0.0));
                }
                if let (Some(range), Some(location)) = (candidate.location, self.location(index)) {
                    let value = range.value_at(parameters[location]);
                    pairs.push((range.name(), range.own_value(value, size)));
                }
                Effect::from_pairs(effect, &pairs).ok()
            })
            .collect()
    }
}
