//! Measured shapes against those of a joint, and where a mode cannot be seen.

use std::f64::consts::PI;

use super::joint::{JointFit, JointSearch};
use super::{MeasuredPeak, MissingCause, MissingMode, ShapeAt};
use tapjoint_beam::{ModeShape, mode_shapes};

/// Standard deviation of the angle between a measured shape and its model (rad): positions, axes and
/// calibrations of sensors, and the closed form without masses.
const ANGLE: f64 = 0.25;
/// A share of the shapes is nothing like their model: another direction of motion, a loose sensor.
const UNLIKE: f64 = 0.1;
/// A sign contradicts its model in this share of the cases.
const WRONG_SIGN: f64 = 0.05;
/// A mode is at its node where it moves less than this share of what the modes usually do there.
const AT_NODE: f64 = 0.12;
/// Values that together are no more than this many of their standard deviations have neither sign nor
/// direction.
const CLEAR: f64 = 3.0;

/// Predicted shapes of one joint, where they can be had.
pub(super) struct View {
    shapes: Vec<ModeShape>,
    /// Places of sensors and taps at which any peak was seen.
    places: Vec<(f64, Option<f64>)>,
}

impl View {
    pub fn new(search: &JointSearch<'_>, fit: &JointFit) -> Self {
        let seen = search.peaks.iter().flat_map(|peak| &peak.shape);
        let mut places: Vec<(f64, Option<f64>)> = Vec::new();
        for at in seen {
            if !places.contains(&(at.sensor, at.tap)) {
                places.push((at.sensor, at.tap));
            }
        }
        let structure = search.model().structure();
        // The closed form has equal halves only.
        let known = structure.lap.position.is_none() && structure.lap.right.is_none();
        let count = search.peaks.len() + super::MOST_MISSING;
        let joint = search.joint(fit.place);
        let shapes = match known && !places.is_empty() {
            true => mode_shapes(&structure.beam, structure.assembly, &joint, count),
            false => Ok(Vec::new()),
        };
        View {
            shapes: shapes.unwrap_or_default(),
            places,
        }
    }

    /// Returns the product of a mode's shapes at sensor and tap (1/kg), or the shape at the sensor
    /// (kg^-1/2).
    fn at(shape: &ModeShape, sensor: f64, tap: Option<f64>) -> f64 {
        shape.displacement(sensor) * tap.map_or(1.0, |tap| shape.displacement(tap))
    }

    /// Returns a mode without a peak, and why.
    pub fn missing(&self, search: &JointSearch<'_>, fit: &JointFit, mode: usize) -> MissingMode {
        let frequency = search.predict(fit.place)[mode - 1].exp();
        let own = self.shapes.get(mode - 1);
        let at_node = own.filter(|_| !self.places.is_empty()).is_some_and(|own| {
            self.places.iter().all(|&(sensor, tap)| {
                let all = self.shapes.iter();
                let squares: f64 = all.map(|shape| Self::at(shape, sensor, tap).powi(2)).sum();
                let usual = (squares / self.shapes.len() as f64).sqrt();
                Self::at(own, sensor, tap).abs() < AT_NODE * usual
            })
        });
        let cause = if !search.in_band(frequency) {
            MissingCause::OutsideBand
        } else if at_node {
            MissingCause::AtNode
        } else {
            MissingCause::Unknown
        };
        MissingMode {
            mode,
            frequency,
            cause,
        }
    }

    /// Returns the negative logarithm of the shapes' probability over that of shapes in any direction.
    pub fn cost(&self, search: &JointSearch<'_>, pairs: &[(usize, usize)]) -> f64 {
        let mut groups: Vec<usize> = search
            .peaks
            .iter()
            .flat_map(|peak| peak.shape.iter().map(|at| at.group))
            .collect();
        groups.sort_unstable();
        groups.dedup();
        groups
            .into_iter()
            .map(|group| self.cost_of_group(search.peaks, pairs, group))
            .sum()
    }

    fn cost_of_group(&self, peaks: &[MeasuredPeak], pairs: &[(usize, usize)], group: usize) -> f64 {
        let (mut cost, mut signs) = (0.0, [0usize; 2]);
        for &(peak, mode) in pairs {
            let Some(shape) = self.shapes.get(mode - 1) else {
                continue;
            };
            let seen: Vec<&ShapeAt> = peaks[peak]
                .shape
                .iter()
                .filter(|at| at.group == group)
                .collect();
            let predicted: Vec<f64> = seen
                .iter()
                .map(|at| Self::at(shape, at.sensor, at.tap))
                .collect();
            cost -= likeness(&seen, &predicted);
            if let Some(positive) = sign(&seen, &predicted, self.usual(&seen)) {
                signs[usize::from(positive)] += 1;
            }
        }
        cost - sign_gain(signs)
    }

    /// Returns the size that the modes usually show at these places.
    fn usual(&self, seen: &[&ShapeAt]) -> f64 {
        let squares = self.shapes.iter().flat_map(|shape| {
            seen.iter()
                .map(|at| Self::at(shape, at.sensor, at.tap).powi(2))
        });
        let count = (self.shapes.len() * seen.len()).max(1) as f64;
        (squares.sum::<f64>() / count).sqrt()
    }
}

/// Returns true where any group of sensors shows a direction.
pub(super) fn is_clear(shape: &[ShapeAt]) -> bool {
    shape.iter().any(|one| {
        let group = shape.iter().filter(|at| at.group == one.group);
        let (measured, noise) = group.fold((0.0, 0.0), |(measured, noise), at| {
            (measured + at.value.powi(2), noise + at.std.powi(2))
        });
        measured > CLEAR.powi(2) * noise
    })
}

/// Returns ln of the density of the angle between two shapes over that of any direction: a normal one of width
/// s has pi/(s sqrt(2 pi)) of it in a plane, 1/s^2 in space (half a circle, half a sphere); more
/// dimensions count as three.
fn likeness(seen: &[&ShapeAt], predicted: &[f64]) -> f64 {
    if seen.len() < 2 {
        return 0.0;
    }
    let product: f64 = seen.iter().zip(predicted).map(|(at, p)| at.value * p).sum();
    let measured: f64 = seen.iter().map(|at| at.value.powi(2)).sum();
    let model: f64 = predicted.iter().map(|p| p * p).sum();
    let noise: f64 = seen.iter().map(|at| at.std.powi(2)).sum();
    if !(measured > CLEAR.powi(2) * noise && model > 0.0) {
        return 0.0;
    }
    let width = ANGLE.hypot((noise / measured).sqrt());
    let angle = (product.abs() / (measured * model).sqrt()).min(1.0).acos();
    let peak = match seen.len() {
        2 => PI / (width * (2.0 * PI).sqrt()),
        _ => width.powi(-2),
    };
    let normal = peak * (-0.5 * (angle / width).powi(2)).exp();
    ((1.0 - UNLIKE) * normal + UNLIKE).ln()
}

/// Returns true where measured and predicted signs agree; `None` where either has none, or where there is no tap,
/// so that the sign is free.
fn sign(seen: &[&ShapeAt], predicted: &[f64], usual: f64) -> Option<bool> {
    if seen.is_empty() || seen.iter().any(|at| at.tap.is_none()) {
        return None;
    }
    let product: f64 = seen.iter().zip(predicted).map(|(at, p)| at.value * p).sum();
    let measured: f64 = seen.iter().map(|at| at.value.powi(2)).sum::<f64>().sqrt();
    let model: f64 = predicted.iter().map(|p| p * p).sum::<f64>().sqrt();
    let noise: f64 = seen.iter().map(|at| at.std.powi(2)).sum::<f64>().sqrt();
    // Near a node, or across it, the model's own sign is not certain.
    let clear = measured > CLEAR * noise && model > AT_NODE * usual * (seen.len() as f64).sqrt();
    (clear && product.abs() > 0.5 * measured * model).then_some(product > 0.0)
}

/// Signs agree in all modes or, the sensor mounted the other way, in none.
fn sign_gain(signs: [usize; 2]) -> f64 {
    // Either polarity is as likely as the other.
    let [a, b] = [[signs[1], signs[0]], signs].map(|[right, wrong]| {
        right as f64 * (2.0 * (1.0 - WRONG_SIGN)).ln() + wrong as f64 * (2.0 * WRONG_SIGN).ln()
    });
    let most = a.max(b);
    most + (0.5 * ((a - most).exp() + (b - most).exp())).ln()
}
