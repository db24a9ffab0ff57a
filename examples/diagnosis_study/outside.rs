//! Faults that no effect of the catalogue describes.

use super::draws::{log_normal, log_triangular, log_uniform, normal, sign};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use tapjoint::identify::observation::{ExtraPeak, Observations, UNPAIRED};
use tapjoint::structure::Beam;
use tapjoint::structure::specimen::{
    BeamSection, Mesh, PointMass, PointSpring, Resonator, Specimen,
};

/// Kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutsideKind {
    /// The thickness changes linearly along the beam.
    Taper,
    /// A strip is glued to a part of the beam: more stiffness and more mass.
    Doubler,
    /// Mass without stiffness over a part of the beam: tape, paint.
    SmearedMass,
    /// The beam lies on something soft, all over or over a part of it.
    Foundation,
    /// A mass on a spring: a cable clip, a loose part.
    Resonator,
    /// The beam touches something at one place.
    SecondSupport,
    /// Something that turns more than it weighs.
    RotaryLump,
    TwoMasses,
    /// A part of the beam is softer: a delamination.
    SoftPatch,
    /// Another temperature in each recording.
    Temperature,
}

/// Springs into which a foundation is divided.
const PIECES: usize = 24;
/// Steps of a taper: each as long as the elements of the observed structure.
const STEPS: usize = 200;

impl OutsideKind {
    pub const ALL: [Self; 10] = [
        Self::Taper,
        Self::Doubler,
        Self::SmearedMass,
        Self::Foundation,
        Self::Resonator,
        Self::SecondSupport,
        Self::RotaryLump,
        Self::TwoMasses,
        Self::SoftPatch,
        Self::Temperature,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Taper => "taper",
            Self::Doubler => "doubler",
            Self::SmearedMass => "smeared-mass",
            Self::Foundation => "foundation",
            Self::Resonator => "resonator",
            Self::SecondSupport => "second-support",
            Self::RotaryLump => "rotary-lump",
            Self::TwoMasses => "two-masses",
            Self::SoftPatch => "soft-patch",
            Self::Temperature => "temperature",
        }
    }

    /// Adds the fault to a specimen. Returns its size: over the beam's mass, over E I/L^3, or relative (1).
    pub fn plant(self, random: &mut ChaCha8Rng, specimen: &mut Specimen) -> f64 {
        let beams = specimen.body.beams();
        let (length, first) = (specimen.body.length(), beams[0]);
        let mass: f64 = beams.iter().map(Beam::mass).sum();
        let unit = first.bending_stiffness() / length.powi(3);
        let place = length * (0.15 + 0.84 * random.random::<f64>());
        match self {
            // Rolled strips by some parts in a thousand, ground and worn ones by more.
            Self::Taper => {
                let size = sign(random, 0.5) * log_triangular(random, 1e-3, 0.02, 0.3);
                let ends = [1.0 - 0.5 * size, 1.0 + 0.5 * size];
                specimen.sections = BeamSection::taper(length, ends[0], ends[1], STEPS);
                size
            }
            Self::Doubler => plant_doubler(random, specimen),
            Self::SmearedMass => {
                let size = log_normal(random, 0.012, 1.0).min(0.3);
                let (start, end) = draw_stretch(random, length);
                specimen.sections.push(BeamSection {
                    start,
                    end,
                    stiffness: 1.0,
                    mass: 1.0 + size * length / (end - start),
                });
                size
            }
            Self::SoftPatch => {
                let size = log_triangular(random, 2e-3, 0.05, 0.6);
                let (start, end) = draw_stretch(random, length);
                specimen.sections.push(BeamSection {
                    start,
                    end,
                    stiffness: 1.0 - size,
                    mass: 1.0,
                });
                size
            }
            Self::Foundation => {
                let size = log_normal(random, 0.6, 1.2);
                let (start, end) = match random.random_bool(0.3) {
                    true => (0.0, length),
                    false => draw_stretch(random, length),
                };
                let step = (end - start) / PIECES as f64;
                specimen
                    .springs
                    .extend((0..PIECES).map(|piece| PointSpring {
                        position: start + (piece as f64 + 0.5) * step,
                        stiffness: size * unit / PIECES as f64,
                    }));
                size
            }
            Self::Resonator => {
                let size = log_normal(random, 0.01, 0.9).min(0.15);
                // From below the first mode of a clamped beam (lambda 1.9) to its sixth (lambda 17).
                let own = log_uniform(random, 1.5, 18.0).powi(2);
                specimen.resonators.push(Resonator {
                    position: place,
                    mass: size * mass,
                    frequency: own * Beam { length, ..first }.unit_frequency(),
                });
                size
            }
            Self::SecondSupport => {
                let size = log_normal(random, 0.7, 1.2);
                specimen.springs.push(PointSpring {
                    position: place,
                    stiffness: size * unit,
                });
                size
            }
            Self::RotaryLump => {
                let size = log_normal(random, 1.5e-4, 1.2).min(0.02);
                specimen.masses.push(PointMass {
                    position: place,
                    mass: 0.0,
                    inertia: size * mass * length * length,
                });
                size
            }
            Self::TwoMasses => {
                let near = 0.1 + 0.5 * random.random::<f64>();
                let far = near + (0.98 - near) * (0.3 + 0.7 * random.random::<f64>());
                let mut sum = 0.0;
                for place in [near, far] {
                    let size = log_normal(random, 0.012, 0.9).min(0.2);
                    let mass = PointMass::new(place * length, size * mass);
                    specimen.masses.push(mass);
                    sum += size;
                }
                sum
            }
            // One to ten kelvins, by 0.02 % each.
            Self::Temperature => log_normal(random, 6e-4, 0.9),
        }
    }

    /// Changes the observations where the fault is none of the structure's, and adds what else it shows.
    pub fn change(
        self,
        random: &mut ChaCha8Rng,
        size: f64,
        truth: &Specimen,
        observed: &mut Observations,
    ) {
        match self {
            Self::Temperature => {
                for configuration in &mut observed.configurations {
                    let factor = 1.0 + size * normal(random);
                    for mode in &mut configuration.modes {
                        mode.frequency *= factor;
                    }
                }
            }
            // Two of three are so damped that no peak of their own is read.
            Self::Resonator if random.random_bool(1.0 / 3.0) => {
                add_resonator_peak(random, truth, observed);
            }
            _ => {}
        }
    }
}

/// Adds the peak of the resonator's own mode to every recording, where it lies among the observed modes.
fn add_resonator_peak(random: &mut ChaCha8Rng, truth: &Specimen, observed: &mut Observations) {
    let modes = observed.configurations.iter().map(|one| one.modes.len());
    let modes = truth.beam_modes(modes.max().unwrap_or(1), Mesh::DIAGNOSIS);
    let Ok(modes) = modes else { return };
    let Some(own) = modes.resonators.first() else {
        return;
    };
    for configuration in &mut observed.configurations {
        let sensors = configuration.sensors.iter();
        let sensors = sensors.filter_map(|sensor| sensor.position);
        let at_sensors = sensors.map(|place| modes.modes.displacement(*own, place).abs());
        let tap = configuration.tap.unwrap_or(0.0);
        let constant = at_sensors.fold(0.0, f64::max) * modes.modes.displacement(*own, tap).abs();
        let frequency = modes.modes.frequencies()[*own];
        let std = 1e-3 * frequency;
        configuration.extra_peaks.push(ExtraPeak {
            frequency: frequency + std * normal(random),
            std: Some(std),
            level_db: None,
            constant: Some(constant),
            label: UNPAIRED.to_owned(),
        });
    }
}

/// Glues a strip of the beam's width to a part of it. Returns its thickness over the beam's (1).
///
/// With thickness t and modulus n over the beam's, both strips bend about one neutral axis:
/// E I grows by n t^3 + 3 n t (1 + t)^2/(1 + n t).
fn plant_doubler(random: &mut ChaCha8Rng, specimen: &mut Specimen) -> f64 {
    let thickness = log_normal(random, 0.02, 1.0).min(0.4);
    // From tape to the beam's own metal.
    let share = random.random::<f64>();
    let modulus = (0.03f64.ln() * (1.0 - share)).exp();
    let density = 0.15 + 0.85 * share;
    let own = modulus * thickness;
    let shifted = 3.0 * own * (1.0 + thickness).powi(2) / (1.0 + own);
    let (start, end) = draw_stretch(random, specimen.body.length());
    specimen.sections.push(BeamSection {
        start,
        end,
        stiffness: 1.0 + own * thickness * thickness + shifted,
        mass: 1.0 + density * thickness,
    });
    thickness
}

/// Draws a part of the beam (m): an eighth to a half of it.
fn draw_stretch(random: &mut ChaCha8Rng, length: f64) -> (f64, f64) {
    let part = length * (0.12 + 0.4 * random.random::<f64>());
    let start = (length - part) * random.random::<f64>();
    (start, start + part)
}
