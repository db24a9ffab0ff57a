//! What of a structure's modes a test with its sensors sees.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::laboratory::SpecimenSettings;
use super::reduced::{ReducedMode, ReducedStructure, StruckPlace};
use crate::structure::StructureError;
use crate::structure::specimen::{Body, Mesh, Specimen, SpecimenJoint, SpecimenModes};

/// Modes beyond the highest that moves in time, whose compliances are added up: what is left out after
/// them has fallen with the cube of their number.
const COMPLIANT_MODES: usize = 24;
/// More modes say nothing about a beam of which 200 elements are made.
const MOST_MODES: usize = 100;
/// A mode that is damped more follows like a spring.
const MOST_DAMPING: f64 = 0.9;
/// Damping ratio of a beam on rubber bands.
const SUSPENSION_DAMPING: f64 = 0.03;

/// A structure and the test's view of it.
#[derive(Debug, Clone)]
pub struct SeenStructure {
    modes: Arc<SpecimenModes>,
    rigid: Vec<RigidMotion>,
    sensors: Vec<f64>,
    reduced: ReducedStructure,
    /// How many of the modes move in time.
    moving: usize,
}

/// Rigid motion a + b x of unit modal mass on its suspension.
#[derive(Debug, Clone, Copy, PartialEq)]
struct RigidMotion {
    frequency: f64,
    offset: f64,
    slope: f64,
}

impl RigidMotion {
    fn at(&self, position: f64) -> f64 {
        self.offset + self.slope * position
    }
}

impl SeenStructure {
    /// The structure with `sensors` at these places (m) and this `joint_loss` factor (1); modes up to
    /// `highest` (Hz) move in time.
    ///
    /// # Errors
    /// As [`Specimen::modes`].
    pub fn new(
        specimen: &Specimen,
        settings: &SpecimenSettings,
        sensors: &[f64],
        (joint_loss, highest): (f64, f64),
    ) -> Result<Self, StructureError> {
        let count = count_below(specimen, highest) + COMPLIANT_MODES;
        let modes = specimen.modes(count.min(MOST_MODES), Mesh::SIMULATION)?;
        let rigid = rigid_motions(specimen, settings, modes.suspension_frequencies());
        let damping = |mode: usize| {
            // The joint's loss acts on its share of the strain energy: zeta = eta/2 share.
            settings.damping.ratio(mode, modes.frequencies()[mode])
                + 0.5 * joint_loss * modes.joint_energy_share(mode)
        };
        let moving = (0..modes.len())
            .take_while(|&mode| {
                modes.frequencies()[mode] <= highest && damping(mode) < MOST_DAMPING
            })
            .count();
        let elastic = (0..moving).map(|mode| ReducedMode {
            frequency: modes.frequencies()[mode],
            damping_ratio: damping(mode),
            at_sensors: sensors
                .iter()
                .map(|&x| modes.displacement(mode, x))
                .collect(),
            at_joint: modes.joint_motion(mode)[1],
        });
        let suspended = rigid.iter().map(|motion| ReducedMode {
            frequency: motion.frequency,
            damping_ratio: SUSPENSION_DAMPING,
            at_sensors: sensors.iter().map(|&x| motion.at(x)).collect(),
            at_joint: 0.0,
        });
        let reduced = ReducedStructure {
            modes: suspended.chain(elastic).collect(),
            joint_compliance: joint_compliance(specimen, &modes, moving),
            joint_to_sensors: sensors
                .iter()
                .map(|&x| joint_to(&modes, moving, x))
                .collect(),
        };
        Ok(Self {
            modes: Arc::new(modes),
            rigid,
            sensors: sensors.to_vec(),
            reduced,
            moving,
        })
    }

    /// Its modes and what lies beyond them.
    pub fn reduced(&self) -> &ReducedStructure {
        &self.reduced
    }

    /// Natural frequencies (Hz) and damping ratios of the elastic modes that move in time.
    pub fn elastic_modes(&self) -> impl Iterator<Item = (f64, f64)> {
        let elastic = self.reduced.modes.iter().skip(self.rigid.len());
        elastic.map(|mode| (mode.frequency, mode.damping_ratio))
    }

    /// Natural frequencies (Hz) of a hanging structure on its suspension.
    pub fn suspension_frequencies(&self) -> impl Iterator<Item = f64> {
        self.rigid.iter().map(|motion| motion.frequency)
    }

    /// How it feels a strike at a position (m).
    pub fn struck(&self, position: f64) -> StruckPlace {
        let rigid = self.rigid.iter().map(|motion| motion.at(position));
        let elastic = (0..self.moving).map(|mode| self.modes.displacement(mode, position));
        StruckPlace {
            at_modes: rigid.chain(elastic).collect(),
            to_sensors: self
                .sensors
                .iter()
                .map(|&x| {
                    beyond(&self.modes, self.moving, |mode| {
                        self.modes.displacement(mode, x) * self.modes.displacement(mode, position)
                    })
                })
                .collect(),
            to_joint: joint_to(&self.modes, self.moving, position),
        }
    }
}

/// Sum over the modes that do not move in time of a product of shapes, over omega^2.
fn beyond(modes: &SpecimenModes, moving: usize, product: impl Fn(usize) -> f64) -> f64 {
    (moving..modes.len())
        .map(|mode| product(mode) / (TAU * modes.frequencies()[mode]).powi(2))
        .sum()
}

fn joint_to(modes: &SpecimenModes, moving: usize, position: f64) -> f64 {
    beyond(modes, moving, |mode| {
        modes.joint_motion(mode)[1] * modes.displacement(mode, position)
    })
}

/// What is left of 1/Kr, the rotation of the joint's spring per moment on both its ends, which nothing
/// but the spring withstands.
fn joint_compliance(specimen: &Specimen, modes: &SpecimenModes, moving: usize) -> f64 {
    let SpecimenJoint::Springs { kr, .. } = specimen.joint else {
        return 0.0;
    };
    let moving: f64 = (0..moving)
        .map(|mode| {
            let omega = TAU * modes.frequencies()[mode];
            (modes.joint_motion(mode)[1] / omega).powi(2)
        })
        .sum();
    (1.0 / kr - moving).max(0.0)
}

/// About how many modes lie below a frequency (Hz): lambda grows by pi from mode to mode.
fn count_below(specimen: &Specimen, frequency: f64) -> usize {
    let beams = specimen.body.beams().iter();
    let lambda: f64 = beams.map(|beam| beam.lambda_of(frequency)).sum();
    (lambda / std::f64::consts::PI) as usize + 2
}

/// Up and down and rocking, of a structure that nothing holds.
fn rigid_motions(
    specimen: &Specimen,
    settings: &SpecimenSettings,
    on_springs: &[f64],
) -> Vec<RigidMotion> {
    let held = matches!(
        (&specimen.body, &specimen.joint),
        (Body::One(_), SpecimenJoint::Springs { .. })
    );
    let Some(frequencies) = settings.suspension.filter(|_| !held) else {
        return Vec::new();
    };
    let [mass, first, second] = moments_of_mass(specimen);
    let centre = first / mass;
    let inertia = second - mass * centre * centre;
    // Springs to the ground, cables, add to the suspension.
    let stiffened = |index: usize| {
        let other = on_springs.get(index).copied().unwrap_or(0.0);
        frequencies[index].hypot(other)
    };
    vec![
        RigidMotion {
            frequency: stiffened(0),
            offset: mass.powf(-0.5),
            slope: 0.0,
        },
        RigidMotion {
            frequency: stiffened(1),
            offset: -centre * inertia.powf(-0.5),
            slope: inertia.powf(-0.5),
        },
    ]
}

/// Mass (kg), its first (kg m) and second moment (kg m2) about the left end.
fn moments_of_mass(specimen: &Specimen) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut add = |mass: f64, position: f64, inertia: f64| {
        sum[0] += mass;
        sum[1] += mass * position;
        sum[2] += mass * position * position + inertia;
    };
    let mut left = 0.0;
    let mut joint = 0.0;
    for (index, beam) in specimen.body.beams().iter().enumerate() {
        let length = beam.length;
        let rotary = specimen.shear_rotary * beam.rotary_inertia_per_length() * length;
        add(
            beam.mass(),
            left + 0.5 * length,
            beam.mass() * length * length / 12.0 + rotary,
        );
        left += length;
        if index == 0 && matches!(specimen.body, Body::Joined(_)) {
            joint = left;
        }
    }
    for mass in &specimen.masses {
        add(mass.mass, mass.position, mass.inertia);
    }
    add(specimen.joint_mass.mass, joint, specimen.joint_mass.inertia);
    if let Some(overlap) = specimen.overlap {
        let spread = overlap.mass * overlap.length * overlap.length / 12.0;
        add(overlap.mass, joint, spread);
    }
    sum
}
