//! The gap between a described test and what it observed: from description and analysis to a
//! diagnosis.

use super::{Analysis, observations};
use tapjoint_beam::JointStiffness;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::specimen::SpecimenJoint;
use tapjoint_description::described::{coupling, described_beam, described_specimen, stiffness_of};
use tapjoint_description::{JointKind, JointModel, KnownStiffness, SensorKind, TestDescription};
use tapjoint_diagnosis::{Diagnosis, GapError, GapSettings, Nominal, NominalSensor, diagnose};

/// What each of length, thickness, modulus and density adds to the uncertainty of all frequencies where
/// its own is not stated (1): all four together 0.2 %, as [`GapSettings::scale_std`].
const USUAL_SHARE: f64 = 0.001;

/// Where the search for the joint begins if the frequencies gave no estimate: Kx and Ky (1) of the
/// bolted cantilever of Ingole & Chatterjee.
const USUAL_JOINT: [f64; 2] = [1400.0, 4.8];
/// Stiffnesses beyond this (1) hold a beam like a wall; a search that begins further out does not move.
const STIFFEST_START: f64 = 1e5;
/// Where a usual stiffness would make the coupling with the described Ktr stronger than a joint can have, the
/// search begins here (1): the end of what the diagnosis searches.
const STRONGEST_START: f64 = 0.95;

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
    // The estimate's stiffnesses are in units of the beam that was estimated with them.
    let joint_before = estimate.map(|estimate| {
        let units = StiffnessUnits::of(&estimate.beam);
        [estimate.joint.kx * units.kt, estimate.joint.ky * units.kr]
    });
    Nominal {
        joint_before: joint_before.filter(|joint| joint.iter().all(|k| *k > 0.0 && k.is_finite())),
        ..nominal_with(test, estimate.map(|estimate| estimate.joint))
    }
}

/// The structure as described; what is not described of its joint is `found`, else usual.
pub fn nominal_with(test: &TestDescription, found: Option<JointStiffness>) -> Nominal {
    // A microphone is not on the beam: what it weighs is no matter.
    let sensors = test.sensors.iter().map(|sensor| match sensor.kind {
        SensorKind::Sound => NominalSensor {
            name: sensor.name.clone(),
            mass: Some(0.0),
            position: None,
        },
        _ => NominalSensor {
            name: sensor.name.clone(),
            mass: sensor.mass.filter(|_| test.analysis.sensor_mass),
            position: sensor.position,
        },
    });
    Nominal {
        specimen: described_specimen(test, joint(test, found)),
        sensors: sensors.collect(),
        joint_before: None,
        scale_std: scale_std(test),
        reading_bias: reading_bias(test),
    }
}

/// Where the search for the joint begins: known stiffnesses, else those found, else usual ones; and the
/// coupling, where the joint's model has one.
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
    let kt = start(test.joint.kt, found.map(|joint| joint.kx), (kx, units.kt));
    let kr = start(test.joint.kr, found.map(|joint| joint.ky), (ky, units.kr));
    let described = test.joint.ktr.map(stiffness_of);
    let coupling = match (model, found, described) {
        (JointModel::ThreeParameter, Some(joint), _) => joint.coupling(),
        (JointModel::ThreeParameter, None, Some(ktr)) => {
            let begin = coupling(kt, kr, 1.0 / ktr);
            match (test.joint.kt, test.joint.kr) {
                (Some(_), Some(_)) => begin,
                _ => begin.clamp(-STRONGEST_START, STRONGEST_START),
            }
        }
        _ => 0.0,
    };
    SpecimenJoint::Springs { kt, kr, coupling }
}

/// f is proportional to h/L^2 sqrt(E/rho): the relative uncertainties that the description states, with
/// these exponents, and a usual one of what it does not state. `None` where it states none of them.
fn scale_std(test: &TestDescription) -> Option<f64> {
    let (beam, tolerance) = (&test.beam, &test.beam.tolerance);
    let shares = [
        (tolerance.length, beam.length, 2.0),
        (tolerance.thickness, beam.thickness, 1.0),
        (tolerance.modulus, beam.modulus, 0.5),
        (tolerance.density, beam.density, 0.5),
    ];
    let square = |(std, value, power): &(Option<f64>, f64, f64)| {
        std.map_or(USUAL_SHARE, |std| power * std / value).powi(2)
    };
    let stated = shares.iter().any(|(std, ..)| std.is_some());
    stated.then(|| shares.iter().map(square).sum::<f64>().sqrt())
}

/// Frequencies read elsewhere may be off by half a line, all in one direction.
fn reading_bias(test: &TestDescription) -> Option<f64> {
    let largest = |values: &Vec<f64>| values.iter().copied().fold(0.0, f64::max);
    let measured = test.measured.as_ref()?;
    measured.half_line.as_ref().map(largest)
}
