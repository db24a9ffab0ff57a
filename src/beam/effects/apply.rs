//! What effects make of a nominal specimen under the circumstances of one recording.

use super::{Effect, EffectId, JointLaw};
use crate::specimen::{Base, Hinge, PointMass, PointSpring, Specimen, SpecimenJoint};

/// A sensor on the beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorPlace {
    /// Distance from the left end (m).
    pub position: f64,
    /// Mass by its datasheet (kg), which the nominal specimen already carries; 0 = unknown.
    pub mass: f64,
}

/// Under what circumstances a specimen is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circumstances<'a> {
    /// Sensors on the beam.
    pub sensors: &'a [SensorPlace],
    /// Amplitude relative to the hardest tap's (1), from 0 to 1.
    pub level: f64,
    /// Draws for this visit's drift of Kt and Kr (1), in standard deviations.
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

/// What is seen of a specimen.
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
    /// How the joint's rotational stiffness depends on amplitude; the specimen's is the secant at
    /// the circumstances' level.
    pub joint_law: Option<JointLaw>,
}

impl Seen {
    /// A frequency of the specimen (Hz) as it is read (Hz).
    pub fn read(&self, frequency: f64) -> f64 {
        frequency * self.frequency_scale + self.frequency_offset
    }
}

/// What effects make of a nominal specimen.
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
    for effect in effects
        .iter()
        .filter(|effect| effect.id == EffectId::Length)
    {
        stretch(&mut seen.specimen, 1.0 + effect.pair().0);
    }
    seen
}

fn add(effect: &Effect, nominal: &Specimen, circumstances: &Circumstances<'_>, seen: &mut Seen) {
    let (first, second) = effect.pair();
    let specimen = &mut seen.specimen;
    match effect.id {
        EffectId::SensorMass | EffectId::SensorCable => {
            add_at_sensors(effect, circumstances.sensors, specimen);
        }
        EffectId::CrossCoupling
        | EffectId::JointMass
        | EffectId::JointNonlinearity
        | EffectId::JointDamping
        | EffectId::JointDrift => add_to_joint(effect, circumstances, seen),
        EffectId::Fixture => specimen.base = Some(base(effect, nominal, &specimen.joint)),
        EffectId::Modulus => {
            for beam in specimen.body.beams_mut() {
                beam.modulus *= 1.0 + first;
            }
        }
        // After all others, by `stretch`.
        EffectId::Length => {}
        EffectId::Timebase => seen.frequency_scale *= 1.0 + first,
        EffectId::AddedMass => specimen.masses.push(mass_at(second, first)),
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
    }
}

fn add_at_sensors(effect: &Effect, sensors: &[SensorPlace], specimen: &mut Specimen) {
    let (size, _) = effect.pair();
    if effect.id == EffectId::SensorMass {
        let unknown = sensors.iter().filter(|sensor| sensor.mass == 0.0);
        let masses = unknown.map(|sensor| mass_at(sensor.position, size));
        specimen.masses.extend(masses);
    } else {
        specimen
            .springs
            .extend(sensors.iter().map(|sensor| PointSpring {
                position: sensor.position,
                stiffness: size,
            }));
    }
}

fn add_to_joint(effect: &Effect, circumstances: &Circumstances<'_>, seen: &mut Seen) {
    let (first, second) = effect.pair();
    let specimen = &mut seen.specimen;
    match effect.id {
        EffectId::CrossCoupling => add_coupling(specimen, first),
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
        _ => scale_joint(
            specimen,
            circumstances.drift.map(|draw| (first * draw).exp()),
        ),
    }
}

/// The base's stiffness follows from the nominal joint's; the ratio is to the joint as it is now.
fn base(effect: &Effect, nominal: &Specimen, joint: &SpecimenJoint) -> Base {
    let (frequency, ratio) = effect.pair();
    let ([_, before], [_, now]) = (nominal.joint.stiffnesses(), joint.stiffnesses());
    let changed = if before > 0.0 && before.is_finite() {
        now / before
    } else {
        1.0
    };
    Base {
        frequency,
        ratio: ratio * changed,
    }
}

fn mass_at(position: f64, mass: f64) -> PointMass {
    PointMass {
        position,
        mass,
        inertia: 0.0,
    }
}

fn add_coupling(specimen: &mut Specimen, more: f64) {
    if let SpecimenJoint::Springs { coupling, .. } = &mut specimen.joint {
        *coupling += more;
    }
}

/// Multiplies the joint's stiffnesses; the base keeps its own.
fn scale_joint(specimen: &mut Specimen, [translation, rotation]: [f64; 2]) {
    if let SpecimenJoint::Springs { kt, kr, .. } = &mut specimen.joint {
        *kt *= translation;
        *kr *= rotation;
        if let Some(base) = &mut specimen.base {
            base.ratio *= rotation;
        }
    }
}

/// Another length, with all places in proportion.
fn stretch(specimen: &mut Specimen, factor: f64) {
    for beam in specimen.body.beams_mut() {
        beam.length *= factor;
    }
    let length = specimen.body.length();
    // A point at the end stays on the beam, whatever the last digit of the product.
    let moved = |position: f64| (position * factor).min(length);
    for mass in &mut specimen.masses {
        mass.position = moved(mass.position);
    }
    for spring in &mut specimen.springs {
        spring.position = moved(spring.position);
    }
    for hinge in &mut specimen.hinges {
        hinge.position = moved(hinge.position);
    }
    if let Some(overlap) = &mut specimen.overlap {
        overlap.length *= factor;
    }
}
