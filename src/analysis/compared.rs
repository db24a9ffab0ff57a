//! A finished analysis as one side of a comparison.

use super::Analysis;
use super::observations::nominal_with;
use tapjoint_beam::specimen::PointMass;
use tapjoint_compare::{Item, ItemKind, MeasuredMode, Test};
use tapjoint_description::{SensorKind, TestDescription};

/// Least standard uncertainty that a described beam leaves to all frequencies in common (1): its own error cancels between two
/// tests, and only the joint's stiffness follows it.
const LEAST_COMMON: f64 = 0.01;

/// Returns what a comparison needs of a test: the described structure in the reference configuration, what sits on it,
/// and its modes. `None` for a bare recording, which has no structure.
pub fn compared_test(test: &TestDescription, analysis: &Analysis) -> Option<Test> {
    analysis.structure.as_ref()?;
    let found = analysis.identification.as_ref();
    let estimate = found.and_then(|found| found.consistent.as_ref());
    // Properties of the beam stay as described: an estimate of them would take in what changed.
    let nominal = nominal_with(test, estimate.map(|estimate| estimate.joint));
    let recording = test.reference_recording();
    let mut items = Vec::new();
    for sensor in &test.sensors {
        let position = recording.map_or(sensor.position, |one| one.place_of(sensor));
        let mass = sensor.mass.filter(|_| test.analysis.sensor_mass);
        if let (Some(position), Some(mass)) = (position, mass)
            && sensor.kind != SensorKind::Sound
            && mass > 0.0
        {
            items.push(Item {
                name: sensor.name.clone(),
                point: PointMass::new(position, mass),
                kind: ItemKind::Sensor,
            });
        }
    }
    if let Some(recording) = recording {
        for (index, point) in recording.masses.iter().enumerate() {
            let name = recording.mass_names.get(index).cloned().flatten();
            items.push(Item {
                name: name.unwrap_or_else(|| format!("fastened mass {}", index + 1)),
                point: *point,
                kind: ItemKind::Mass,
            });
        }
    }
    let mut structure = nominal.specimen;
    structure.masses.extend(items.iter().map(|item| item.point));
    let tolerances = nominal.uncertainty.beam;
    let modulus = tolerances.modulus.unwrap_or(0.0);
    let density = tolerances.density.unwrap_or(0.0);
    let length = tolerances.length.unwrap_or(0.0);
    let thickness = tolerances.thickness.unwrap_or(0.0);
    // f is in proportion to h sqrt(E/rho)/L^2.
    let common = (0.5 * modulus.hypot(density)).hypot(thickness);
    let modes = analysis.modes.iter().filter_map(|mode| {
        let half_line = mode.half_line.unwrap_or(0.0);
        Some(MeasuredMode {
            mode: mode.mode?,
            frequency: mode.frequency,
            // A reading on a line is uniform within half a line.
            std: mode.std.unwrap_or(half_line / 3.0_f64.sqrt()),
        })
    });
    let modes: Vec<MeasuredMode> = modes
        .filter(|one| {
            test.analysis
                .fit_modes
                .is_none_or(|highest| one.mode <= highest)
        })
        .collect();
    let unnumbered = analysis.modes.iter().filter(|mode| mode.is_unpaired());
    Some(Test {
        unnumbered: unnumbered.map(|mode| mode.frequency).collect(),
        structure,
        items,
        knows_joint: [test.joint.kt.is_some(), test.joint.kr.is_some()],
        common_std: common.hypot(2.0 * length).max(LEAST_COMMON),
        modes,
    })
}
