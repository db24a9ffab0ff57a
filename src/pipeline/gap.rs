//! The gap between a described test and what it observed: from description and analysis to a
//! diagnosis.

use super::{Analysis, observations};
use crate::described::{described_beam, described_specimen, stiffness_of};
use crate::description::{JointKind, JointModel, KnownStiffness, TestDescription};
use crate::gap::{Diagnosis, GapError, GapSettings, Nominal, NominalSensor, diagnose};
use crate::structure::JointStiffness;
use crate::structure::joint::StiffnessUnits;
use crate::structure::specimen::SpecimenJoint;

/// Where the search for the joint begins if the frequencies gave no estimate: Kx and Ky (1) of the
/// bolted cantilever of Ingole & Chatterjee.
const USUAL_JOINT: [f64; 2] = [1400.0, 4.8];
/// Stiffnesses beyond this (1) hold a beam like a wall; a search that begins further out does not move.
const STIFFEST_START: f64 = 1e5;

/// Diagnoses the gap of an analysed test.
///
/// # Errors
/// [`GapError`]: why these data say nothing about a gap.
pub fn diagnose_test(
    test: &TestDescription,
    analysis: &Analysis,
    settings: &GapSettings,
) -> Result<Diagnosis, GapError> {
    diagnose(&observations(analysis), &nominal(test, analysis), settings)
}

/// The structure as described, with the joint as estimated: where the diagnosis begins.
pub fn nominal(test: &TestDescription, analysis: &Analysis) -> Nominal {
    let found = analysis.identification.as_ref();
    let estimate = found.and_then(|found| found.consistent.as_ref());
    nominal_with(test, estimate.map(|estimate| estimate.joint))
}

/// The structure as described; what is not described of its joint is `found`, else usual.
pub fn nominal_with(test: &TestDescription, found: Option<JointStiffness>) -> Nominal {
    let sensors = test.sensors.iter().map(|sensor| NominalSensor {
        name: sensor.name.clone(),
        mass: sensor.mass.filter(|_| test.analysis.sensor_mass),
    });
    Nominal {
        specimen: described_specimen(test, joint(test, found)),
        sensors: sensors.collect(),
        scale_std: scale_std(test),
        reading_bias: reading_bias(test),
    }
}

/// Known stiffnesses, else those found, else usual ones. A coupling that the joint's model has is held as
/// found: what the diagnosis then calls `cross-coupling` comes on top of it.
fn joint(test: &TestDescription, found: Option<JointStiffness>) -> SpecimenJoint {
    if test.joint.kind == JointKind::Free {
        return SpecimenJoint::Free;
    }
    let units = StiffnessUnits::of(&described_beam(test));
    let start = |known: Option<KnownStiffness>, found: Option<f64>, (usual, unit): (f64, f64)| {
        let begin = found.filter(|k| *k > 0.0).unwrap_or(usual);
        known.map_or(unit * begin.min(STIFFEST_START), stiffness_of)
    };
    let [kx, ky] = USUAL_JOINT;
    let model = test.joint.model;
    SpecimenJoint::Springs {
        kt: start(test.joint.kt, found.map(|joint| joint.kx), (kx, units.kt)),
        kr: start(test.joint.kr, found.map(|joint| joint.ky), (ky, units.kr)),
        coupling: found
            .filter(|_| model == JointModel::ThreeParameter)
            .map_or(0.0, |joint| joint.coupling()),
    }
}

/// f is proportional to h/L^2 sqrt(E/rho): the relative uncertainties that the description states, with
/// these exponents. `None` where it states none of them.
fn scale_std(test: &TestDescription) -> Option<f64> {
    let (beam, tolerance) = (&test.beam, &test.beam.tolerance);
    let shares = [
        (tolerance.length, beam.length, 2.0),
        (tolerance.thickness, beam.thickness, 1.0),
        (tolerance.modulus, beam.modulus, 0.5),
        (tolerance.density, beam.density, 0.5),
    ];
    let squares: Vec<f64> = shares
        .iter()
        .filter_map(|(std, value, power)| Some((power * (*std)? / value).powi(2)))
        .collect();
    (!squares.is_empty()).then(|| squares.iter().sum::<f64>().sqrt())
}

/// Frequencies read elsewhere may be off by half a line, all in one direction.
fn reading_bias(test: &TestDescription) -> Option<f64> {
    let largest = |values: &Vec<f64>| values.iter().copied().fold(0.0, f64::max);
    let measured = test.measured.as_ref()?;
    measured.half_line.as_ref().map(largest)
}
