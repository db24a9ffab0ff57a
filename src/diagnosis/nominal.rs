//! What is held to be true before the gap is looked for.

use tapjoint_beam::specimen::{PointMass, Specimen, SpecimenJoint};
use tapjoint_identify::observation::ObservedSensor;

/// Index of the coupling among what is sought of a joint, after translation and rotation.
pub(super) const COUPLING: usize = 2;

/// The tested structure as it was described.
#[derive(Debug, Clone, PartialEq)]
pub struct Nominal {
    /// Beam, joint and what is fastened to them for good, without sensors. The joint's stiffnesses are
    /// where the search for them begins, stated ones too; those that are 0 or infinite stay so. A coupling
    /// other than 0 is sought with them.
    pub specimen: Specimen,
    /// The sensors by name.
    pub sensors: Vec<NominalSensor>,
    /// The joint's stiffnesses (N/m, N m/rad) that were estimated of the same frequencies without any effect,
    /// to say how far one moves them; `None` where nothing was: the nominal model's own fit is taken then.
    pub joint_before: Option<[f64; 2]>,
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
    /// Its mass (kg); `None` where nobody said, 0 of one that does not touch the structure.
    pub mass: Option<f64>,
    /// Where it sits in the reference configuration (m); `None` where nobody said.
    pub position: Option<f64>,
}

impl Nominal {
    /// Whether a sensor is known not to touch the structure.
    pub(super) fn is_apart(&self, name: &str) -> bool {
        let touches_nothing = |sensor: &NominalSensor| sensor.mass == Some(0.0);
        self.sensors
            .iter()
            .any(|sensor| sensor.name == name && touches_nothing(sensor))
    }

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

    /// What is to be found of the joint: index (0 translation, 1 rotation, 2 the coupling of a joint that
    /// has one) and start.
    pub(super) fn sought(&self) -> Vec<(usize, f64)> {
        let SpecimenJoint::Springs { coupling, .. } = self.specimen.joint else {
            return Vec::new();
        };
        let stiffnesses = self.specimen.joint.stiffnesses().into_iter().enumerate();
        let mut sought: Vec<(usize, f64)> = stiffnesses
            .filter(|(_, stiffness)| *stiffness > 0.0 && stiffness.is_finite())
            .collect();
        if coupling != 0.0 {
            sought.push((COUPLING, coupling));
        }
        sought
    }
}

impl NominalSensor {
    /// The sensor as a configuration sees it that was read elsewhere.
    pub(super) fn observed(&self) -> ObservedSensor {
        ObservedSensor {
            name: self.name.clone(),
            position: self.position,
        }
    }
}
