//! What of a structure's modes a test with its sensors sees.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::laboratory::SpecimenSettings;
use super::reduced::{ReducedMode, ReducedStructure, StruckPlace};
use tapjoint_beam::StructureError;
use tapjoint_beam::specimen::{Body, Mesh, Specimen, SpecimenJoint, SpecimenModes};

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
    /// Motions on the suspension first, then the elastic modes.
    modes: Arc<SpecimenModes>,
    /// How many of them are motions on the suspension.
    suspended: usize,
    sensors: Vec<f64>,
    reduced: ReducedStructure,
    /// How many of the modes move in time.
    moving: usize,
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
        let elastic = specimen.modes(count.min(MOST_MODES), Mesh::SIMULATION)?;
        let unseen = joint_compliance(specimen, &elastic);
        let (modes, suspended) = hang(specimen, settings, elastic)?;
        let damping = |mode: usize| {
            let Some(elastic) = mode.checked_sub(suspended) else {
                return SUSPENSION_DAMPING;
            };
            // The joint's loss acts on its share of the strain energy: zeta = eta/2 share.
            settings.damping.ratio(elastic, modes.frequencies()[mode])
                + 0.5 * joint_loss * modes.joint_energy_share(mode)
        };
        let moving = (0..modes.len())
            .take_while(|&mode| {
                modes.frequencies()[mode] <= highest && damping(mode) < MOST_DAMPING
            })
            .count();
        let reduced = ReducedStructure {
            modes: (0..moving)
                .map(|mode| ReducedMode {
                    frequency: modes.frequencies()[mode],
                    damping_ratio: damping(mode),
                    at_sensors: sensors
                        .iter()
                        .map(|&x| modes.displacement(mode, x))
                        .collect(),
                    at_joint: modes.joint_motion(mode)[1],
                })
                .collect(),
            joint_compliance: unseen
                + beyond(&modes, moving, |mode| modes.joint_motion(mode)[1].powi(2)),
            joint_to_sensors: sensors
                .iter()
                .map(|&x| joint_to(&modes, moving, x))
                .collect(),
        };
        Ok(Self {
            modes: Arc::new(modes),
            suspended,
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
        let elastic = self.reduced.modes.iter().skip(self.suspended);
        elastic.map(|mode| (mode.frequency, mode.damping_ratio))
    }

    /// Natural frequencies (Hz) of a hanging structure on its suspension, with what else holds it to
    /// the ground.
    pub fn suspension_frequencies(&self) -> impl Iterator<Item = f64> {
        let modes = self.reduced.modes.iter().take(self.suspended);
        modes.map(|mode| mode.frequency)
    }

    /// How it feels a strike at a position (m).
    pub fn struck(&self, position: f64) -> StruckPlace {
        StruckPlace {
            at_modes: (0..self.moving)
                .map(|mode| self.modes.displacement(mode, position))
                .collect(),
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

/// Whether a specimen hangs, since nothing holds it.
pub(super) fn hangs(specimen: &Specimen) -> bool {
    matches!(specimen.body, Body::Joined(_)) || specimen.joint.stiffnesses() == [0.0; 2]
}

/// The modes with the motions on the suspension before them, and the number of those.
fn hang(
    specimen: &Specimen,
    settings: &SpecimenSettings,
    elastic: SpecimenModes,
) -> Result<(SpecimenModes, usize), StructureError> {
    match settings.suspension {
        // No rigid-body motion at all.
        None if hangs(specimen) => Ok((elastic, 0)),
        Some(frequencies) if hangs(specimen) => elastic.hung(Some(frequencies)),
        // What turns about a pivot may be held by cables.
        _ => elastic.hung(None),
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

/// What the modes that are not even computed leave of the joint's compliance.
fn joint_compliance(specimen: &Specimen, modes: &SpecimenModes) -> f64 {
    match specimen.joint {
        SpecimenJoint::Free => 0.0,
        SpecimenJoint::Springs { .. } => modes.joint_compliance_beyond(),
    }
}

/// About how many modes lie below a frequency (Hz): lambda grows by pi from mode to mode.
fn count_below(specimen: &Specimen, frequency: f64) -> usize {
    let beams = specimen.body.beams().iter();
    let lambda: f64 = beams.map(|beam| beam.lambda_of(frequency)).sum();
    (lambda / std::f64::consts::PI) as usize + 2
}
