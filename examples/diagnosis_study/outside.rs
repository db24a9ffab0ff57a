//! Faults that no effect of the catalogue describes.

use super::draws::{log_normal, normal};
use super::structures::Structure;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use tapjoint::identify::observation::Observations;
use tapjoint::structure::specimen::{PointMass, PointSpring, Specimen};

/// Kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutsideKind {
    /// The beam lies on something soft, all over or over a part of it.
    Foundation,
    /// The beam touches something at one place.
    SecondSupport,
    /// Something that turns more than it weighs.
    RotaryLump,
    TwoMasses,
    /// Another temperature in each recording.
    Temperature,
}

/// Springs into which a foundation is divided.
const PIECES: usize = 24;

impl OutsideKind {
    pub const ALL: [Self; 5] = [
        Self::Foundation,
        Self::SecondSupport,
        Self::RotaryLump,
        Self::TwoMasses,
        Self::Temperature,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Foundation => "foundation",
            Self::SecondSupport => "second-support",
            Self::RotaryLump => "rotary-lump",
            Self::TwoMasses => "two-masses",
            Self::Temperature => "temperature",
        }
    }

    /// Adds the fault to a specimen. Returns its size: over the beam's mass, over E I/L^3, or relative (1).
    pub fn plant(
        self,
        random: &mut ChaCha8Rng,
        structure: &Structure,
        specimen: &mut Specimen,
    ) -> f64 {
        let (length, mass) = (specimen.body.length(), structure.mass());
        let unit = specimen.body.beams()[0].bending_stiffness() / length.powi(3);
        match self {
            Self::Foundation => {
                let size = log_normal(random, 0.6, 1.2);
                let stretch = draw_stretch(random, length, 0.3);
                let step = (stretch.1 - stretch.0) / PIECES as f64;
                for piece in 0..PIECES {
                    specimen.springs.push(PointSpring {
                        position: stretch.0 + (piece as f64 + 0.5) * step,
                        stiffness: size * unit / PIECES as f64,
                    });
                }
                size
            }
            Self::SecondSupport => {
                let size = log_normal(random, 0.7, 1.2);
                specimen.springs.push(PointSpring {
                    position: length * (0.2 + 0.75 * random.random::<f64>()),
                    stiffness: size * unit,
                });
                size
            }
            Self::RotaryLump => {
                let size = log_normal(random, 1.5e-4, 1.2).min(0.02);
                specimen.masses.push(PointMass {
                    position: length * (0.15 + 0.84 * random.random::<f64>()),
                    mass: 0.0,
                    inertia: size * mass * length * length,
                });
                size
            }
            Self::TwoMasses => {
                let first = 0.1 + 0.5 * random.random::<f64>();
                let second = first + (0.98 - first) * (0.3 + 0.7 * random.random::<f64>());
                let sizes = [0, 1].map(|_| log_normal(random, 0.012, 0.9).min(0.2));
                for (place, size) in [first, second].into_iter().zip(sizes) {
                    let mass = PointMass::new(place * length, size * mass);
                    specimen.masses.push(mass);
                }
                sizes[0] + sizes[1]
            }
            // One to ten kelvins, by 0.02 % each.
            Self::Temperature => log_normal(random, 6e-4, 0.9),
        }
    }

    /// Changes the observations where the fault is none of the structure's.
    pub fn change(self, random: &mut ChaCha8Rng, size: f64, observed: &mut Observations) {
        if self != Self::Temperature {
            return;
        }
        for configuration in &mut observed.configurations {
            let factor = 1.0 + size * normal(random);
            for mode in &mut configuration.modes {
                mode.frequency *= factor;
            }
        }
    }
}

/// Draws a part of the beam (m): all of it with this probability.
fn draw_stretch(random: &mut ChaCha8Rng, length: f64, whole: f64) -> (f64, f64) {
    if random.random_bool(whole) {
        return (0.0, length);
    }
    let part = length * (0.12 + 0.4 * random.random::<f64>());
    let start = (length - part) * random.random::<f64>();
    (start, start + part)
}
