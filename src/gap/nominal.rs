//! What is held to be true before the gap is looked for.

use crate::identify::observation::ObservedSensor;
use crate::structure::specimen::{PointMass, Specimen, SpecimenJoint};

/// The tested structure as it was described.
#[derive(Debug, Clone, PartialEq)]
pub struct Nominal {
    /// Beam, joint and what is fastened to them for good, without sensors. The joint's stiffnesses are
    /// where the search for them begins; those that are 0 or infinite stay so.
    pub specimen: Specimen,
    /// The sensors by name.
    pub sensors: Vec<NominalSensor>,
    /// Standard uncertainty of the one factor that beam length, thickness, modulus and density put on
    /// all frequencies (1); `None` where the description states no tolerance.
    pub scale_std: Option<f64>,
    /// Largest bias that reading frequencies on lines could have (Hz); `None` for fitted ones, which
    /// have none.
    pub reading_bias: Option<f64>,
}

/// A sensor as described.
#[derive(Debug, Clone, PartialEq)]
pub struct NominalSensor {
    /// Its name.
    pub name: String,
    /// Its mass (kg); `None` where nobody said.
    pub mass: Option<f64>,
}

impl Nominal {
    /// Mass of a sensor (kg), 0 where it is unknown.
    pub(super) fn mass_of(&self, name: &str) -> f64 {
        self.sensors
            .iter()
            .find(|sensor| sensor.name == name)
            .and_then(|sensor| sensor.mass)
            .unwrap_or(0.0)
    }

    /// The structure with point masses (position m, mass kg) of sensors.
    pub(super) fn with_masses(&self, masses: &[(f64, f64)]) -> Specimen {
        let mut specimen = self.specimen.clone();
        for &(position, mass) in masses.iter().filter(|(_, mass)| *mass > 0.0) {
            specimen.masses.push(PointMass {
                position,
                mass,
                inertia: 0.0,
            });
        }
        specimen
    }

    /// The joint's stiffnesses that are to be found: index (0 translation, 1 rotation) and start.
    pub(super) fn sought(&self) -> Vec<(usize, f64)> {
        match self.specimen.joint {
            SpecimenJoint::Free => Vec::new(),
            SpecimenJoint::Springs { .. } => self
                .specimen
                .joint
                .stiffnesses()
                .into_iter()
                .enumerate()
                .filter(|(_, stiffness)| *stiffness > 0.0 && stiffness.is_finite())
                .collect(),
        }
    }
}

impl NominalSensor {
    /// The sensor as a configuration sees it when nobody said where it sat.
    pub(super) fn unplaced(&self) -> ObservedSensor {
        ObservedSensor {
            name: self.name.clone(),
            position: None,
        }
    }
}
