//! Sizes of measured modal constants against those of the model: whether the scales of hammer and sensors can be right.

use super::MeasuredPeak;
use std::collections::BTreeMap;
use tapjoint_beam::ModeShape;
use tapjoint_numerics::stats::median;

/// Least number of modes that say how large a sensor's values are.
const LEAST_MODES: usize = 3;
/// A place near a node says nothing of the size: the model's value must be this part of the largest of all. 5 %: errors of
/// places may change such a value by half, and the median holds that.
const AWAY_FROM_NODES: f64 = 0.05;

/// How large a sensor's modal constants are beside those of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeAt {
    /// Place of the sensor (m).
    pub sensor: f64,
    /// Measured over predicted modal constant (1): the median over the modes.
    pub ratio: f64,
    /// Half of the modes are within this factor of it (1, at least 1).
    pub spread: f64,
}

/// Returns the sizes at all sensors whose values are modal constants. `pairs` are peaks with the numbers of their modes,
/// `shapes` the model's, normalised to unit mass.
pub(super) fn sizes_at(
    peaks: &[MeasuredPeak],
    shapes: &[ModeShape],
    pairs: &[(usize, usize)],
) -> Vec<SizeAt> {
    let mut seen: Vec<Seen> = Vec::new();
    for &(peak, mode) in pairs {
        let Some(shape) = shapes.get(mode - 1) else {
            continue;
        };
        for at in &peaks[peak].shape {
            if let Some(tap) = at.tap.filter(|_| at.value.abs() > 3.0 * at.std) {
                let predicted = (shape.displacement(at.sensor) * shape.displacement(tap)).abs();
                seen.push(Seen {
                    sensor: at.sensor,
                    mode,
                    predicted,
                    log: (at.value.abs() / predicted).ln(),
                });
            }
        }
    }
    let largest = seen.iter().map(|one| one.predicted).fold(0.0, f64::max);
    seen.retain(|one| one.predicted > AWAY_FROM_NODES * largest);
    let mut sensors: Vec<f64> = seen.iter().map(|one| one.sensor).collect();
    sensors.sort_by(f64::total_cmp);
    sensors.dedup();
    let mut sizes = Vec::with_capacity(sensors.len());
    for sensor in sensors {
        // One value for each mode, whatever the number of taps that saw it.
        let mut of_modes: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for one in seen.iter().filter(|one| one.sensor == sensor) {
            of_modes.entry(one.mode).or_default().push(one.log);
        }
        let mut logs: Vec<f64> = of_modes.values_mut().map(|own| median(own)).collect();
        if logs.len() >= LEAST_MODES {
            let middle = median(&mut logs);
            let mut apart: Vec<f64> = logs.iter().map(|log| (log - middle).abs()).collect();
            sizes.push(SizeAt {
                sensor,
                ratio: middle.exp(),
                spread: median(&mut apart).exp(),
            });
        }
    }
    sizes
}

/// A modal constant beside that of the model.
struct Seen {
    /// Place of the sensor (m).
    sensor: f64,
    /// Number of the mode.
    mode: usize,
    /// Size of the model's (1/kg).
    predicted: f64,
    /// Logarithm of measured over predicted size.
    log: f64,
}
