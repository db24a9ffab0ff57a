//! Scales that cannot be right: the modal constants of a response beside those of the described beam.

use super::recording_result::RecordingResult;
use super::results::Identification;
use super::warnings::Warning;
use std::collections::BTreeMap;
use tapjoint_beam::specimen::Mesh;
use tapjoint_description::TestDescription;
use tapjoint_numerics::stats::median;

/// Factor (1) between measured and predicted modal constants from which a scale is doubted. The least mistake that is
/// usual is g taken for m/s2, a factor of 9.81; its root lies as far from that as from 1.
const DOUBTED: f64 = 3.13;
/// Fewest modal constants of a sensor that decide.
const LEAST_CONSTANTS: usize = 3;
/// A product of shapes below this share of the mode's largest square is near a node: it says little.
const NEAR_NODE: f64 = 0.2;
/// Points at which a shape's largest value is looked for.
const POINTS: usize = 50;

/// Doubts about the scales of sensors whose modal constants are all too large or too small by about one factor.
///
/// A mode's constant is the product of its mass-normalised shapes at sensor and tap (1/kg), which mass and shape of the
/// beam give whatever its stiffness. Only scales that were stated are doubted.
pub(super) fn scale_doubts(
    test: &TestDescription,
    recordings: &[RecordingResult],
    identification: &Identification,
) -> Vec<Warning> {
    let stated = test
        .hammer
        .as_ref()
        .is_some_and(|hammer| hammer.scale.is_some());
    let count = identification.prediction.len();
    let modes = identification.predicted.as_ref().filter(|_| stated);
    let modes = modes.and_then(|specimen| {
        let length = specimen.body.length();
        Some((specimen.modes(count, Mesh::DIAGNOSIS).ok()?, length))
    });
    let Some((modes, length)) = modes else {
        return Vec::new();
    };
    let mut ratios: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for recording in recordings {
        let Some(tap) = recording.conditions.tap else {
            continue;
        };
        for (reading, number) in recording.readings().iter().zip(&recording.mode_numbers) {
            let known = number.filter(|number| (1..=modes.frequencies().len()).contains(number));
            let (Some(number), Some(fit)) = (known, reading.fit.as_deref()) else {
                continue;
            };
            let shape = |x: f64| modes.displacement(number - 1, x.clamp(0.0, length));
            let points = (0..=POINTS).map(|point| shape(point as f64 / POINTS as f64 * length));
            let largest = points.fold(0.0, |most: f64, value| most.max(value.abs()));
            for constant in &fit.constants {
                let response = recording.responses.get(constant.sensor);
                let sensor = test
                    .sensors
                    .iter()
                    .find(|one| Some(&one.name) == response.map(|response| &response.name));
                let Some(sensor) = sensor.filter(|sensor| sensor.scale.is_some()) else {
                    continue;
                };
                let Some(&place) = recording.conditions.sensor_positions.get(&sensor.name) else {
                    continue;
                };
                let predicted = (shape(place) * shape(tap)).abs();
                if predicted > NEAR_NODE * largest * largest && constant.value != 0.0 {
                    let ratio = constant.value.abs() / predicted;
                    ratios.entry(&sensor.name).or_default().push(ratio.ln());
                }
            }
        }
    }
    let mut warnings = Vec::new();
    for (sensor, mut logarithms) in ratios {
        let middle = median(&mut logarithms);
        // All on one side of the limit: a wrong place or mode would scatter.
        let agree = logarithms
            .iter()
            .all(|ratio| ratio * middle.signum() > 0.5 * DOUBTED.ln());
        if logarithms.len() >= LEAST_CONSTANTS && middle.abs() > DOUBTED.ln() && agree {
            warnings.push(Warning::scale(sensor, middle.exp()));
        }
    }
    warnings
}
