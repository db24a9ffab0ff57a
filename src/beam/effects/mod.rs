//! Effects that a model may be missing: their catalogue, and what each does to a specimen.
//!
//! Each effect's physics is defined here once; whoever simulates and whoever diagnoses use the same.
//!
//! ```text
//! EffectId, parameters -> Effect ; apply(effects, nominal specimen, circumstances) -> Seen
//!                                  actual_set_ups(effects, described places) -> places and signals
//! ```

mod catalogue;
mod set_up;

use crate::specimen::{Base, Hinge, PointMass, PointSpring, Specimen};
pub use catalogue::{EffectDimension, EffectId, Group, ParameterInfo, ParameterScale, Place};
pub use set_up::{
    ActualSetUp, DescribedSetUp, SensorSignal, SetUpError, actual_set_ups, check_set_up,
};
use statrs::function::gamma::gamma;
use std::f64::consts::PI;

/// Reason why an effect cannot be made from its name and values.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// No effect of that name.
    #[error("there is no effect `{name}`{}; effects are: {known}", did_you_mean(.nearest))]
    UnknownEffect {
        /// The name given.
        name: String,
        /// The name that comes nearest.
        nearest: Option<&'static str>,
        /// All names.
        known: String,
    },
    /// The effect has no parameter of that name.
    #[error("`{effect}` has no parameter `{name}`{}; it has: {known}", did_you_mean(.nearest))]
    UnknownParameter {
        /// The effect.
        effect: &'static str,
        /// The name given.
        name: String,
        /// The name that comes nearest.
        nearest: Option<&'static str>,
        /// The names there are.
        known: String,
    },
    /// A parameter given twice.
    #[error("`{effect}` is given `{name}` twice; give it once")]
    Twice {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        name: &'static str,
    },
    /// A parameter without a usual value is not given.
    #[error("`{effect}` needs `{name}`: {meaning}; it has no usual value")]
    Missing {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        name: &'static str,
        /// Description of the parameter.
        meaning: &'static str,
    },
    /// A value outside its range.
    #[error("`{effect}`: {name} is {value}, but must lie between {lowest} and {highest}{}{unit}", if .unit.is_empty() { "" } else { " " })]
    OutOfRange {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        name: &'static str,
        /// The value given (SI).
        value: f64,
        /// Lowest possible value.
        lowest: f64,
        /// Highest possible value.
        highest: f64,
        /// Its unit.
        unit: &'static str,
    },
}

fn did_you_mean(nearest: &Option<&'static str>) -> String {
    nearest.map_or_else(String::new, |name| format!(", did you mean `{name}`?"))
}

/// Returns the name nearest to `given`, if one is near at all.
fn nearest_name(given: &str, known: &[&'static str]) -> Option<&'static str> {
    // Below this two words have little in common.
    const LEAST_LIKENESS: f64 = 0.7;
    let names = known.iter();
    names
        .map(|name| (strsim::jaro_winkler(given, name), *name))
        .filter(|(likeness, _)| *likeness > LEAST_LIKENESS)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

// An effect with the values of its parameters.

/// An effect of a certain size.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// The effect.
    pub id: EffectId,
    /// In the order of [`EffectId::parameters`].
    values: Vec<f64>,
}

impl Effect {
    /// With named values (SI); the others are typical ones.
    ///
    /// # Errors
    /// [`EffectError`] for an unknown name, a value given twice or outside its range, or a missing value of a
    /// parameter without a typical one.
    pub fn from_pairs(id: EffectId, pairs: &[(&str, f64)]) -> Result<Self, EffectError> {
        let mut values = vec![None; id.parameters().len()];
        for (name, value) in pairs {
            let index = index_of(id, name)?;
            let info = &id.parameters()[index];
            if values[index].replace(in_range(id, info, *value)?).is_some() {
                return Err(EffectError::Twice {
                    effect: id.name(),
                    name: info.name,
                });
            }
        }
        let filled = id.parameters().iter().zip(values).map(|(info, value)| {
            value.or(info.typical).ok_or(EffectError::Missing {
                effect: id.name(),
                name: info.name,
                meaning: info.meaning,
            })
        });
        Ok(Self {
            id,
            values: filled.collect::<Result<_, _>>()?,
        })
    }

    /// Returns the effect with another value (SI) of one parameter.
    ///
    /// # Errors
    /// [`EffectError`] for an unknown name or a value outside its range.
    pub fn with(&self, name: &str, value: f64) -> Result<Self, EffectError> {
        let index = index_of(self.id, name)?;
        let mut changed = self.clone();
        changed.values[index] = in_range(self.id, &self.id.parameters()[index], value)?;
        Ok(changed)
    }

    /// Value (SI) of a parameter; `None` where the effect has none of that name.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.values()
            .find(|(info, _)| info.name == name)
            .map(|(_, value)| value)
    }

    /// Returns its parameters with their values (SI).
    pub fn values(&self) -> impl Iterator<Item = (&'static ParameterInfo, f64)> + '_ {
        self.id.parameters().iter().zip(self.values.iter().copied())
    }
}

impl EffectId {
    /// Returns its parameter of that name.
    ///
    /// # Errors
    /// [`EffectError::UnknownParameter`], with the name that comes nearest.
    pub fn parameter(self, name: &str) -> Result<&'static ParameterInfo, EffectError> {
        Ok(&self.parameters()[index_of(self, name)?])
    }
}

fn index_of(id: EffectId, name: &str) -> Result<usize, EffectError> {
    let known: Vec<&'static str> = id.parameters().iter().map(|info| info.name).collect();
    known
        .iter()
        .position(|known| *known == name)
        .ok_or_else(|| EffectError::UnknownParameter {
            effect: id.name(),
            name: name.to_owned(),
            nearest: nearest_name(name, &known),
            known: known.join(", "),
        })
}

fn in_range(id: EffectId, info: &ParameterInfo, value: f64) -> Result<f64, EffectError> {
    // A position may not be infinite either.
    if value.is_finite() && (info.lowest..=info.highest).contains(&value) {
        return Ok(value);
    }
    Err(EffectError::OutOfRange {
        effect: id.name(),
        name: info.name,
        value,
        lowest: info.lowest,
        highest: info.highest,
        unit: info.dimension.unit(),
    })
}

// What effects make of a nominal specimen under the circumstances of one recording.

/// Circumstances under which a specimen is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circumstances<'a> {
    /// Sensors on the beam, with their masses by datasheet, which the nominal specimen already carries; 0 =
    /// unknown.
    pub sensors: &'a [PointMass],
    /// Amplitude relative to the hardest tap's (1), from 0 to 1.
    pub level: f64,
    /// Random deviations of Kt and Kr on this visit (1), in standard deviations of the drift.
    pub drift: [f64; 2],
}

impl Default for Circumstances<'_> {
    /// No sensors, the hardest tap, the first visit, no drift.
    fn default() -> Self {
        Self {
            sensors: &[],
            level: 1.0,
            drift: [0.0; 2],
        }
    }
}

/// A specimen as it is seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// The specimen with all effects.
    pub specimen: Specimen,
    /// Factor on every frequency as it is read (1).
    pub frequency_scale: f64,
    /// Added to every frequency as it is read, after the factor (Hz).
    pub frequency_offset: f64,
    /// Loss factor of the joint beyond the nominal (1); half of it times the joint's share of a
    /// mode's strain energy is added to the mode's damping ratio.
    pub joint_loss_factor: f64,
    /// Dependence of the joint's rotational stiffness on amplitude; the specimen's is the secant at
    /// the circumstances' level.
    pub joint_law: Option<JointLaw>,
}

impl Seen {
    /// A frequency of the specimen (Hz) as it is read (Hz).
    pub fn read(&self, frequency: f64) -> f64 {
        frequency * self.frequency_scale + self.frequency_offset
    }
}

/// Applies effects to a nominal specimen.
///
/// Effects add up: the order matters only where one refers to what another changes. Factors on
/// the joint's stiffness leave the base under it as it is, since its spring is another one.
/// A change of length keeps all places in proportion.
pub fn apply(effects: &[Effect], nominal: &Specimen, circumstances: &Circumstances<'_>) -> Seen {
    let mut seen = Seen {
        specimen: nominal.clone(),
        frequency_scale: 1.0,
        frequency_offset: 0.0,
        joint_loss_factor: 0.0,
        joint_law: None,
    };
    for effect in effects {
        add(effect, nominal, circumstances, &mut seen);
    }
    // Last, since places of other effects are given on the nominal beam.
    let lengths = effects.iter().filter(|one| one.id == EffectId::Length);
    lengths.for_each(|effect| stretch(&mut seen.specimen, 1.0 + effect.values[0]));
    seen
}

/// Adds one effect.
fn add(effect: &Effect, nominal: &Specimen, circumstances: &Circumstances<'_>, seen: &mut Seen) {
    let first = effect.values[0];
    let second = effect.values.get(1).copied().unwrap_or(0.0);
    let specimen = &mut seen.specimen;
    match effect.id {
        EffectId::SensorMass => {
            let sensors = circumstances.sensors.iter();
            let unknown = sensors.filter(|sensor| sensor.mass == 0.0);
            let masses = unknown.map(|sensor| PointMass::new(sensor.position, first));
            specimen.masses.extend(masses);
        }
        EffectId::SensorCable => {
            let cables = circumstances.sensors.iter().map(|sensor| PointSpring {
                position: sensor.position,
                stiffness: first,
            });
            specimen.springs.extend(cables);
        }
        EffectId::CrossCoupling => {
            if let Some(joint) = &mut specimen.joint {
                joint.coupling += first;
            }
        }
        // In series with the joint, by the nominal (left) beam.
        EffectId::JointCompliance => {
            let beam = nominal.body.beams()[0];
            let length = nominal.body.length();
            let rotation = first * length / beam.bending_stiffness();
            let translation = second * length.powi(3) / beam.bending_stiffness();
            if let Some(joint) = &mut specimen.joint {
                joint.kr = (joint.kr.recip() + rotation).recip();
                joint.kt = (joint.kt.recip() + translation).recip();
            }
        }
        EffectId::JointMass => {
            specimen.joint_mass.mass += first;
            specimen.joint_mass.inertia += second;
        }
        EffectId::JointNonlinearity => {
            let law = JointLaw {
                ratio: first,
                exponent: second,
            };
            scale_joint(specimen, [1.0, law.secant(circumstances.level)]);
            seen.joint_law = (first != 0.0).then_some(law);
        }
        EffectId::JointDamping => seen.joint_loss_factor += first,
        // An exponential, so that no draw makes a stiffness negative.
        EffectId::JointDrift => {
            let factors = circumstances.drift.map(|draw| (first * draw).exp());
            scale_joint(specimen, factors);
        }
        EffectId::Fixture => {
            // The base's stiffness follows from the nominal joint's; the ratio is to the joint as it is now.
            let [[_, before], [_, now]] = [nominal, &*specimen].map(Specimen::joint_stiffnesses);
            let is_spring = before > 0.0 && before.is_finite();
            specimen.base = Some(Base {
                frequency: first,
                ratio: second * if is_spring { now / before } else { 1.0 },
            });
        }
        EffectId::Modulus => {
            for beam in specimen.body.beams_mut() {
                beam.modulus *= 1.0 + first;
            }
        }
        EffectId::Density => {
            for beam in specimen.body.beams_mut() {
                beam.density *= 1.0 + first;
            }
        }
        EffectId::Thickness => {
            for beam in specimen.body.beams_mut() {
                beam.thickness *= 1.0 + first;
            }
        }
        // After all others, by `stretch`.
        EffectId::Length => {}
        EffectId::Timebase => seen.frequency_scale *= 1.0 + first,
        EffectId::AddedMass => specimen.masses.push(PointMass::new(second, first)),
        EffectId::LocalCrack => {
            // c = compliance L/(E I) of the nominal (left) beam, over the whole length.
            let beam = nominal.body.beams()[0];
            specimen.hinges.push(Hinge {
                position: second,
                compliance: first * nominal.body.length() / beam.bending_stiffness(),
            });
        }
        EffectId::AxialLoad => specimen.axial_force += first,
        EffectId::ShearRotary => specimen.shear_rotary += first,
        EffectId::Resolution => seen.frequency_offset += first,
        // The structure is as described: see `actual_set_ups`.
        EffectId::SensorPosition
        | EffectId::SensorPolarity
        | EffectId::SensorSwap
        | EffectId::SensorScale
        | EffectId::TapPosition => {}
    }
}

/// Multiplies the joint's stiffnesses, translational and rotational; the base keeps its own.
pub fn scale_joint(specimen: &mut Specimen, factors: [f64; 2]) {
    if let Some(joint) = &mut specimen.joint {
        joint.kt *= factors[0];
        joint.kr *= factors[1];
        if let Some(base) = &mut specimen.base {
            base.ratio *= factors[1];
        }
    }
}

/// Changes the length, with all places in proportion.
fn stretch(specimen: &mut Specimen, factor: f64) {
    for beam in specimen.body.beams_mut() {
        beam.length *= factor;
    }
    let length = specimen.body.length();
    let masses = specimen.masses.iter_mut().map(|mass| &mut mass.position);
    let springs = specimen
        .springs
        .iter_mut()
        .map(|spring| &mut spring.position);
    let hinges = specimen.hinges.iter_mut().map(|hinge| &mut hinge.position);
    let sections = specimen.sections.iter_mut();
    let borders = sections.flat_map(|section| [&mut section.start, &mut section.end]);
    let resonators = specimen.resonators.iter_mut();
    let resonators = resonators.map(|resonator| &mut resonator.position);
    let places = masses.chain(springs).chain(hinges);
    for position in places.chain(borders).chain(resonators) {
        // A point at the end stays on the beam, whatever the last digit of the product.
        *position = (*position * factor).min(length);
    }
    if let Some(overlap) = &mut specimen.overlap {
        overlap.length *= factor;
    }
}

/// Dependence of a joint's rotational stiffness on the amplitude of its rotation.
///
/// The secant stiffness at amplitude a is k0 (1 + ratio (a/a0)^p), a0 being the amplitude of the
/// hardest tap. Two laws have such a secant:
///
/// - elastic: M = k0 theta (1 + c |theta|^p), no dissipation; for p = 2 Duffing's cubic spring;
/// - micro-slip: sliders of many strengths side by side (Iwan 1966), which soften and dissipate.
///   By Masing's rules the branches between turning points are the first loading curve, doubled in
///   size.
///
/// The secant is that of the first harmonic (describing function), the one that shifts a frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLaw {
    /// Relative change of the secant stiffness at the hardest tap's amplitude (1).
    pub ratio: f64,
    /// Power of the amplitude (1).
    pub exponent: f64,
}

/// The physics behind a [`JointLaw`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointLawKind {
    /// A conservative spring.
    Elastic,
    /// Sliders in parallel: softens and dissipates.
    MicroSlip,
}

/// One of several motions of the joint at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeMotion {
    /// Amplitude of the rotation over that of the hardest tap (1).
    pub amplitude: f64,
    /// Angular frequency (rad/s).
    pub omega: f64,
}

impl JointLaw {
    /// Highest exponent that friction is credited with: measured micro-slip lies below.
    const SLIP_EXPONENT: f64 = 1.5;

    /// Micro-slip where the stiffness falls with a power up to 1.5, else a conservative spring.
    pub fn kind(&self) -> JointLawKind {
        if self.ratio < 0.0 && self.exponent <= Self::SLIP_EXPONENT {
            JointLawKind::MicroSlip
        } else {
            JointLawKind::Elastic
        }
    }

    /// Secant stiffness over that of small amplitudes (1), at an amplitude relative to the hardest
    /// tap's.
    pub fn secant(&self, relative_amplitude: f64) -> f64 {
        1.0 + self.ratio * relative_amplitude.powf(self.exponent)
    }

    /// Returns the relative change of the stiffness that one mode feels while others move the joint too.
    ///
    /// Elastic: (A^2 + 2 sum B^2)^{p/2}, exact for the cubic spring, where another motion counts twice
    /// (R = (p + 2)/2 of a small motion beside a large one); within 6 % for powers from 1/2 on.
    /// Micro-slip: (A + (sum (w B)^{3/2})^{2/3})^p. Several others seldom reach their crests together, and
    /// none reaches less than the root of the squares; the power 3/2 lies between. Against sliders in
    /// parallel the change comes out within 13 % for two motions, and with a scatter of 13 % for three and four.
    pub fn change_among(&self, own: ModeMotion, others: impl Iterator<Item = ModeMotion>) -> f64 {
        let p = self.exponent;
        let size = match self.kind() {
            JointLawKind::Elastic => {
                let squares = others.map(|other| other.amplitude.powi(2)).sum::<f64>();
                (own.amplitude.powi(2) + 2.0 * squares).sqrt()
            }
            JointLawKind::MicroSlip => {
                // The weights of a slower and a faster motion that is much larger than the own one. With D the
                // describing function, one motion alone changes the stiffness by c D A^p. A faster one of
                // amplitude B lets every slider slip that is weaker than B, and the slow motion finds c (p + 1) B^p.
                // On a slower one the own motion rides along the loop's branches, whose slope lacks
                // c (p + 1) (x/2)^p at a distance x from the turning point; its mean over the cycle is
                // c (p + 1) B^p times that of sin^{2p}.
                let alone = self.describing_function();
                let [slower, faster] = [gamma_ratio(p) / PI.sqrt(), 1.0]
                    .map(|share| ((p + 1.0) * share / alone).powf(p.recip()));
                // Between 0 and that limit the weight depends on which of the two velocities turns about. Steepness
                // and place of the transition follow sliders in parallel under two motions (velocities 0.01 to 100
                // to one).
                let parts = others.map(|other| {
                    let velocity = (other.amplitude * other.omega).max(1e-300);
                    let velocities = own.amplitude * own.omega / velocity;
                    other.amplitude
                        * if other.omega > own.omega {
                            faster / (1.0 + 1.9 * velocities)
                        } else {
                            slower / (1.0 + 0.3 * velocities.powf(1.5))
                        }
                });
                let sum: f64 = parts.map(|part| part.powf(1.5)).sum();
                own.amplitude + sum.powf(2.0 / 3.0)
            }
        };
        self.ratio * size.powf(p)
    }

    /// Returns the loss factor over the change of the stiffness (1): 4 p/(pi (p + 2) D) with the describing
    /// function D.
    ///
    /// It is 0 for a conservative spring. For small changes it is exact where one mode moves alone; other modes
    /// share in the sliders' slip.
    pub fn loss_over_change(&self) -> f64 {
        let p = self.exponent;
        match self.kind() {
            JointLawKind::Elastic => 0.0,
            JointLawKind::MicroSlip => 4.0 * p / (PI * (p + 2.0) * self.describing_function()),
        }
    }

    /// c (rad^-p) of the law `M = k0 theta (1 + c |theta|^p)` on first loading, for a hardest tap's
    /// amplitude (rad): the secant's change divided by the describing function of `|theta|^p theta`.
    pub fn coefficient(&self, hardest_amplitude: f64) -> f64 {
        self.ratio / self.describing_function() / hardest_amplitude.powf(self.exponent)
    }

    /// First harmonic of the restoring moment's non-linear part over c k0 a^(p+1) (1).
    fn describing_function(&self) -> f64 {
        let p = self.exponent;
        match self.kind() {
            // (2/pi) integral of sin^(p+2) from 0 to pi; 3/4 for the cubic spring.
            JointLawKind::Elastic => {
                2.0 / PI.sqrt() * gamma(0.5 * (p + 3.0)) / gamma(0.5 * p + 2.0)
            }
            // With s = sin^2(t/2): (4/pi) integral of s^(p+1) (2 s - 1) from 0 to pi.
            JointLawKind::MicroSlip => {
                4.0 / PI.sqrt() * (2.0 * gamma_ratio(p + 2.0) - gamma_ratio(p + 1.0))
            }
        }
    }
}

/// Returns Gamma(q + 1/2)/Gamma(q + 1): sqrt(pi) times the mean of sin^{2q} over a cycle.
fn gamma_ratio(q: f64) -> f64 {
    gamma(q + 0.5) / gamma(q + 1.0)
}
