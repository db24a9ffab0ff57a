//! The gap between a described test and what it observed: from description and analysis to a
//! diagnosis.

use super::{Analysis, observations};
use crate::description::{BeamTheory, JointKind, KnownStiffness, TestDescription};
use crate::gap::{Diagnosis, GapError, GapSettings, Nominal, NominalSensor, diagnose};
use crate::structure::Beam;
use crate::structure::joint::StiffnessUnits;
use crate::structure::specimen::{Body, LapOverlap, Specimen, SpecimenJoint};

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
    let found = analysis.identification.as_ref().and_then(|found| {
        let estimate = found.consistent.as_ref()?;
        Some([estimate.joint.kx, estimate.joint.ky])
    });
    nominal_with(test, found)
}

/// The structure as described; a joint whose stiffnesses are not described has these Kx and Ky (1).
pub fn nominal_with(test: &TestDescription, found: Option<[f64; 2]>) -> Nominal {
    let beam = described_beam(test);
    let mut specimen = Specimen::new(body(test, beam), joint(test, found, &beam));
    specimen.shear_rotary = match test.joint.beam {
        BeamTheory::Euler => 0.0,
        BeamTheory::Timoshenko => 1.0,
    };
    specimen.overlap = test.joint.overlap.map(|overlap| LapOverlap {
        length: overlap.length,
        mass: overlap.mass,
    });
    let sensors = test.sensors.iter().map(|sensor| NominalSensor {
        name: sensor.name.clone(),
        mass: sensor.mass.filter(|_| test.analysis.sensor_mass),
    });
    Nominal {
        specimen,
        sensors: sensors.collect(),
        scale_std: scale_std(test),
        reading_bias: reading_bias(test),
    }
}

fn described_beam(test: &TestDescription) -> Beam {
    super::tested_structure(test).beam
}

fn body(test: &TestDescription, whole: Beam) -> Body {
    if test.joint.kind != JointKind::Lap {
        return Body::One(whole);
    }
    let left = test.joint.position.unwrap_or(0.5 * whole.length);
    let other = test.joint.right.clone().unwrap_or_default();
    let right = Beam {
        length: whole.length - left,
        width: other.width.unwrap_or(whole.width),
        thickness: other.thickness.unwrap_or(whole.thickness),
        modulus: other.modulus.unwrap_or(whole.modulus),
        density: other.density.unwrap_or(whole.density),
        poisson: other.poisson.unwrap_or(whole.poisson),
    };
    let left = Beam {
        length: left,
        ..whole
    };
    Body::Joined([left, right])
}

/// Known stiffnesses, else the estimate's, else usual ones.
fn joint(test: &TestDescription, found: Option<[f64; 2]>, beam: &Beam) -> SpecimenJoint {
    if test.joint.kind == JointKind::Free {
        return SpecimenJoint::Free;
    }
    let units = StiffnessUnits::of(beam);
    let start = |known: Option<KnownStiffness>, index: usize, unit: f64| match known {
        Some(KnownStiffness::Rigid) => f64::INFINITY,
        Some(KnownStiffness::Value(value)) => value,
        None => {
            let found = found.map(|joint| joint[index]).filter(|k| *k > 0.0);
            unit * found.unwrap_or(USUAL_JOINT[index]).min(STIFFEST_START)
        }
    };
    SpecimenJoint::Springs {
        kt: start(test.joint.kt, 0, units.kt),
        kr: start(test.joint.kr, 1, units.kr),
        coupling: 0.0,
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
