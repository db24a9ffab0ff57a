//! Parameters of a hypothesis and their priors: joint, effects, and nuisance parameters.
//!
//! The prior of an effect's size is a half-Cauchy distribution (Gelman 2006, "Prior distributions for variance parameters",
//! section 3), cut off where the size cannot be, and symmetric where the sign is open. It has one number, `scale`: half of
//! the sizes are smaller. Four fifths lie between 0.16 and 6.3 times the scale, which is 1.6 decades. It reaches zero, so that
//! a little of an effect is never excluded by definition, and its tail leaves room for gross errors. The scales come
//! from what such things weigh and yield, not from any study of the diagnosis; each stands with its reason in
//! [`candidate_effect`].
//!
//! Sizes that belong to the structure are fractions of its own: masses of the beam's mass, compliances of L/(E I),
//! axial forces of E I/L^2. Those of sensors, cables, rules and clocks are absolute.

use crate::dataset::Dataset;
use crate::fixture::unseen_frequencies;
use crate::result::LARGEST_STIFFNESS_CHANGE;
use crate::structure::{COUPLING, Nominal, ROTATION};
use tapjoint_beam::effects::{Effect, EffectId, Group};
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
    /// The structure, or all sensors alike.
    All,
    /// A sensor, by the index of its name.
    Sensor { name: usize },
    /// A sensor at one of its stated positions, by the index of the position.
    Place { position: usize },
    /// Two sensors, by the indices of their names.
    Pair { names: [usize; 2] },
    /// Taps at one of their stated positions, by its index.
    Taps { tap: usize },
}

/// Effect with the priors of its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidateEffect {
    /// The effect.
    pub effect: EffectId,
    /// What it acts on.
    pub target: Target,
    /// Parameter that is zero when there is no such effect.
    pub size: Size,
    /// Second parameter, for its location or its law, if it has one.
    pub location: Option<LocationRange>,
    /// Number of targets that are as probable as this one, itself included.
    pub variants: usize,
}

impl CandidateEffect {
    /// Returns an error of the set-up.
    fn of_set_up(effect: EffectId, target: Target, size: Size) -> Self {
        CandidateEffect {
            effect,
            target,
            size,
            location: None,
            variants: 1,
        }
    }
}

/// Prior of an effect's size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Name of the effect's parameter.
    pub name: &'static str,
    /// Size that half of all effects of the kind do not reach (SI).
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
    /// Translational compliance of a joint that is described as rigid (1), uniform in its logarithm.
    Translation,
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

    fn positive(name: &'static str, scale: f64, high: f64) -> Self {
        Size {
            low: 0.0,
            ..Size::signed(name, scale, high)
        }
    }

    /// Returns the size of an effect that is there or not.
    fn fixed(name: &'static str) -> Self {
        Size {
            low: 1.0,
            ..Size::signed(name, 1.0, 1.0)
        }
    }

    /// Returns the distance (m) of a place from where it is stated, both on a beam of this length (m): half of all that are
    /// misread are within 5 mm.
    fn offset(stated: f64, length: f64) -> Self {
        Size {
            low: -stated,
            high: (length - stated).max(0.0),
            ..Size::signed("offset", 0.005, length)
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
        // Tables of one kind of alloy differ by so much; the direction of rolling adds as much.
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
        effect,
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
    all.retain(|variants| !variants.is_empty());
    all
}

/// Returns an error of the set-up for everything that it may act on. Only shapes and modal constants show it.
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
                    Size::offset(*stated, length),
                ));
            }
        }
        EffectId::TapPosition if has_constants => {
            for (tap, stated) in inventory.taps.iter().enumerate() {
                all.push(CandidateEffect::of_set_up(
                    effect,
                    Target::Taps { tap },
                    Size::offset(*stated, length),
                ));
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

    /// Returns whether one of its effects is an error of the set-up.
    pub fn has_set_up_error(&self) -> bool {
        let mut effects = self.effects.iter();
        effects.any(|one| one.effect.group() == Group::SetUp)
    }

    /// Returns the effects with the values that the parameters give them.
    pub fn effects_at(&self, parameters: &[f64]) -> Option<Vec<Effect>> {
        (0..self.effects.len())
            .map(|index| {
                let candidate = &self.effects[index];
                let size = parameters[self.size(index)];
                if candidate.size.is_fixed() {
                    return Effect::from_pairs(candidate.effect, &[]).ok();
                }
                let mut pairs = vec![(candidate.size.name, size)];
                // A joint that is rigid in translation alone does not turn the more.
                if candidate.effect == EffectId::JointCompliance
                    && candidate.size.name != "rotation"
                {
                    pairs.push(("rotation", 0.0));
                }
                if let (Some(range), Some(location)) = (candidate.location, self.location(index)) {
                    let value = range.value_at(parameters[location]);
                    pairs.push((range.name(), range.own_value(value, size)));
                }
                Effect::from_pairs(candidate.effect, &pairs).ok()
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over all sizes the density integrates to 1, and half of it lies below the scale where there is no bound.
    #[test]
    fn val_the_prior_of_a_size_is_normalised_and_has_its_scale_in_the_middle() {
        for size in [
            Size::positive("mass", 0.01, 0.25),
            Size::signed("relative", 0.02, 0.3),
            Size::offset(0.338, 0.423),
        ] {
            const STEPS: usize = 400_000;
            let step = (size.high - size.low) / STEPS as f64;
            let (mut all, mut below) = (0.0, 0.0);
            for k in 0..STEPS {
                let at = size.low + step * (k as f64 + 0.5);
                let share = step * size.log_density(at).exp();
                all += share;
                if at.abs() < size.scale {
                    below += share;
                }
            }
            // The midpoint rule over a peak as wide as a thousandth of the range.
            assert!((all - 1.0).abs() < 1e-6, "{}: {all}", size.name);
            // Bounds at 5 to 25 scales and more cut off up to a twelfth of the tail.
            assert!((0.5..0.56).contains(&below), "{}: {below}", size.name);
        }
    }

    #[test]
    fn limit_an_effect_that_is_there_or_not_has_no_density() {
        let size = Size::fixed("flipped");
        assert!(size.is_fixed());
        assert_eq!(size.log_density(1.0), 0.0);
        assert_eq!(size.small(), 1.0);
    }
}
