//! From a test description to the specimen it describes.

use super::error::SimulateError;
use tapjoint_beam::effects::SensorPlace;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::specimen::{PointMass, Specimen, SpecimenJoint};
use tapjoint_description::described::{
    coupling, described_beam, described_specimen, fastened_masses, stiffness_of,
};
use tapjoint_description::{JointKind, RecordingDescription, SensorKind, TestDescription};

/// Non-dimensional stiffnesses of a joint, in place of the description's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GivenJoint {
    /// Kx (1).
    pub kx: f64,
    /// Ky (1).
    pub ky: f64,
    /// 1/Kz (1), 0 without coupling.
    pub cross_compliance: f64,
}

/// The described specimen as one recording finds it.
pub(super) fn nominal_specimen(
    test: &TestDescription,
    recording: &RecordingDescription,
    given: Option<GivenJoint>,
) -> Result<Specimen, SimulateError> {
    let mut specimen = described_specimen(test, joint(test, given)?);
    for place in sensor_places(test, recording)? {
        if place.mass > 0.0 {
            specimen.masses.push(PointMass {
                position: place.position,
                mass: place.mass,
                inertia: 0.0,
            });
        }
    }
    specimen.masses.extend(fastened_masses(recording));
    Ok(specimen)
}

fn joint(
    test: &TestDescription,
    given: Option<GivenJoint>,
) -> Result<SpecimenJoint, SimulateError> {
    if test.joint.kind == JointKind::Free {
        return Ok(SpecimenJoint::Free);
    }
    let units = StiffnessUnits::of(&described_beam(test));
    if let Some(given) = given {
        return Ok(SpecimenJoint::Springs {
            kt: given.kx * units.kt,
            kr: given.ky * units.kr,
            coupling: coupling(given.kx, given.ky, given.cross_compliance),
        });
    }
    let (missing, keys) = match (test.joint.kt, test.joint.kr) {
        (Some(kt), Some(kr)) => {
            let (kt, kr) = (stiffness_of(kt), stiffness_of(kr));
            let ktr = test.joint.ktr.map_or(f64::INFINITY, stiffness_of);
            return Ok(SpecimenJoint::Springs {
                kt,
                kr,
                coupling: coupling(kt, kr, 1.0 / ktr),
            });
        }
        (None, None) => (
            "kt and kr are",
            "`kt = 1.9e6` (N/m) and `kr = 1.2e3` (N m/rad)",
        ),
        (None, Some(_)) => ("kt is", "`kt = 1.9e6` (N/m)"),
        (Some(_), None) => ("kr is", "`kr = 1.2e3` (N m/rad)"),
    };
    Err(SimulateError::NoJoint { missing, keys })
}

/// Where the sensors sit in a recording, with their masses by the datasheet.
pub(super) fn sensor_places(
    test: &TestDescription,
    recording: &RecordingDescription,
) -> Result<Vec<SensorPlace>, SimulateError> {
    let places = test.sensors.iter().map(|sensor| {
        if sensor.kind == SensorKind::Sound {
            return Err(SimulateError::Sound {
                name: sensor.name.clone(),
            });
        }
        let position = recording.place_of(sensor);
        Ok(SensorPlace {
            position: position.ok_or_else(|| SimulateError::NoPosition {
                name: sensor.name.clone(),
            })?,
            mass: sensor.mass.unwrap_or(0.0),
        })
    });
    places.collect()
}
