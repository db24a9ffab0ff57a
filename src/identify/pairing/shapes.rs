//! Measured shapes against those of a joint, and where a mode cannot be seen.

use super::joint::{JointFit, JointSearch};
use super::scale::{SizeAt, sizes_at};
use super::{MeasuredPeak, MissingCause, MissingMode, ShapeAt};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use tapjoint_beam::ModeShape;

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
    /// Returns the shapes of the fitted joint; none for unequal halves, or where no peak has a shape.
    pub fn new(search: &JointSearch<'_>, fit: &JointFit) -> Self {
        let mut places = Vec::new();
        for at in search.peaks.iter().flat_map(|peak| &peak.shape) {
            if !places.contains(&(at.sensor, at.tap)) {
                places.push((at.sensor, at.tap));
            }
        }
        let shapes = match places.is_empty() {
            true => Vec::new(),
            false => search.shapes(fit.place),
        };
        View { shapes, places }
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
        let polarities = self.polarities(search, pairs);
        let least = least_cost(&polarities);
        let sum: f64 = polarities.iter().map(|one| (least - one.cost).exp()).sum();
        least - sum.ln()
    }

    /// Returns the places (m) of the sensors that are inverted against the others, where the shapes leave no doubt. Where
    /// half of the sensors are inverted against the other half, all places are returned.
    pub fn inverted(&self, search: &JointSearch<'_>, pairs: &[(usize, usize)]) -> Vec<f64> {
        let polarities = self.polarities(search, pairs);
        let least = least_cost(&polarities);
        let mut near = polarities
            .iter()
            .filter(|one| one.cost < least + BEYOND_DOUBT);
        let (Some(only), None) = (near.next(), near.next()) else {
            return Vec::new();
        };
        let places = Polarity::places(search.peaks);
        match 2 * only.inverted.len() == places.len() {
            true => places,
            false => only.inverted.clone(),
        }
    }

    /// Returns how large the sensors' modal constants are beside those of the model.
    pub fn sizes(&self, search: &JointSearch<'_>, pairs: &[(usize, usize)]) -> Vec<SizeAt> {
        sizes_at(search.peaks, &self.shapes, pairs)
    }

    /// Returns what the shapes of all groups say of the polarities of the sensors.
    fn polarities(&self, search: &JointSearch<'_>, pairs: &[(usize, usize)]) -> Vec<Polarity> {
        let seen = search.peaks.iter().flat_map(|peak| &peak.shape);
        let groups: BTreeSet<usize> = seen.map(|at| at.group).collect();
        let mut polarities = Polarity::all(search.peaks);
        for polarity in &mut polarities {
            for &group in &groups {
                polarity.cost += self.group_cost(search, pairs, group, polarity);
            }
        }
        polarities
    }

    /// Returns the part of one group, whose sensors have this polarity.
    fn group_cost(
        &self,
        search: &JointSearch<'_>,
        pairs: &[(usize, usize)],
        group: usize,
        polarity: &Polarity,
    ) -> f64 {
        let (mut cost, mut signs) = (0.0, [0usize; 2]);
        for &(peak, mode) in pairs {
            let Some(shape) = self.shapes.get(mode - 1) else {
                continue;
            };
            let seen = search.peaks[peak].shape.iter();
            let seen: Vec<&ShapeAt> = seen.filter(|at| at.group == group).collect();
            let products = Products::new(&seen, shape, polarity);
            cost -= products.likeness();
            // The size that the modes usually show at these places.
            let squares = self.shapes.iter().flat_map(|shape| {
                let sizes = seen.iter().map(|at| Self::at(shape, at.sensor, at.tap));
                sizes.map(|size| size.powi(2))
            });
            let count = (self.shapes.len() * seen.len()).max(1) as f64;
            let usual = (squares.sum::<f64>() / count).sqrt();
            let is_tapped = seen.iter().all(|at| at.tap.is_some());
            if let Some(positive) = products.sign(usual).filter(|_| is_tapped) {
                signs[usize::from(positive)] += 1;
            }
        }
        // Signs agree in all modes or, all sensors mounted against the hammer, in none. One is as likely as the other.
        let (right, wrong) = ((2.0 * (1.0 - WRONG_SIGN)).ln(), (2.0 * WRONG_SIGN).ln());
        let [no, yes] = signs.map(|count| count as f64);
        let (a, b) = (yes * right + no * wrong, no * right + yes * wrong);
        let most = a.max(b);
        cost - (most + (0.5 * ((a - most).exp() + (b - most).exp())).ln())
    }
}

/// Prior probability that a sensor is mounted against the direction of the others, or its channel is inverted.
const INVERTED: f64 = 0.1;
/// A polarity less probable than the best by e to this power is out: one in a thousand.
const BEYOND_DOUBT: f64 = 7.0;
/// Up to so many sensors all of their polarities are tried (32), beyond it those of one inverted sensor at most.
const FEW_SENSORS: usize = 6;

/// Which sensors are inverted against the others, in all recordings.
#[derive(Debug, Clone)]
struct Polarity {
    /// Places of the inverted sensors (m).
    inverted: Vec<f64>,
    /// Negative logarithm of its probability.
    cost: f64,
}

fn least_cost(polarities: &[Polarity]) -> f64 {
    let costs = polarities.iter().map(|one| one.cost);
    costs.fold(f64::INFINITY, f64::min)
}

impl Polarity {
    /// Returns the places (m) at which sensors were, each once.
    fn places(peaks: &[MeasuredPeak]) -> Vec<f64> {
        let mut places: Vec<f64> = Vec::new();
        for at in peaks.iter().flat_map(|peak| &peak.shape) {
            if !places.contains(&at.sensor) {
                places.push(at.sensor);
            }
        }
        places
    }

    /// Returns all polarities with their prior. The common sign of all sensors is treated in [`View::group_cost`].
    fn all(peaks: &[MeasuredPeak]) -> Vec<Self> {
        let places = Self::places(peaks);
        let mut sets = vec![Vec::new()];
        if places.len() > FEW_SENSORS {
            sets.extend(places.iter().map(|&place| vec![place]));
        } else {
            for mask in 1u32..1 << places.len() {
                let bits = (0..).zip(&places).filter(|(bit, _)| mask >> bit & 1 == 1);
                let inverted: Vec<f64> = bits.map(|(_, &place)| place).collect();
                // Inverting a set is inverting the others: the smaller set stands for both.
                let others = places.len() - inverted.len();
                let first_stays = mask & 1 == 0;
                if inverted.len() < others || (inverted.len() == others && first_stays) {
                    sets.push(inverted);
                }
            }
        }
        let price = ((1.0 - INVERTED) / INVERTED).ln();
        let mut all = Vec::with_capacity(sets.len());
        for inverted in sets {
            let cost = price * inverted.len() as f64;
            all.push(Polarity { inverted, cost });
        }
        let sum: f64 = all.iter().map(|one: &Polarity| (-one.cost).exp()).sum();
        for one in &mut all {
            one.cost += sum.ln();
        }
        all
    }

    fn sign(&self, sensor: f64) -> f64 {
        if self.inverted.contains(&sensor) {
            -1.0
        } else {
            1.0
        }
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

/// A measured shape and that of a model: their product, and the squares of them and of the uncertainties.
struct Products {
    count: usize,
    product: f64,
    measured: f64,
    model: f64,
    noise: f64,
}

impl Products {
    fn new(seen: &[&ShapeAt], shape: &ModeShape, polarity: &Polarity) -> Self {
        let predicted = seen.iter().map(|at| View::at(shape, at.sensor, at.tap));
        let pairs = seen.iter().zip(predicted.clone());
        Products {
            count: seen.len(),
            product: pairs
                .map(|(at, p)| polarity.sign(at.sensor) * at.value * p)
                .sum(),
            measured: seen.iter().map(|at| at.value.powi(2)).sum(),
            model: predicted.map(|p| p * p).sum(),
            noise: seen.iter().map(|at| at.std.powi(2)).sum(),
        }
    }

    /// Returns ln of the density of the angle between the shapes over that of any direction: a normal one of width
    /// s has pi/(s sqrt(2 pi)) of it in a plane, 1/s^2 in space (half a circle, half a sphere); more
    /// dimensions count as three.
    fn likeness(&self) -> f64 {
        let (measured, model) = (self.measured, self.model);
        if self.count < 2 || !(measured > CLEAR.powi(2) * self.noise && model > 0.0) {
            return 0.0;
        }
        let width = ANGLE.hypot((self.noise / measured).sqrt());
        let cosine = self.product.abs() / (measured * model).sqrt();
        let peak = match self.count {
            2 => PI / (width * (2.0 * PI).sqrt()),
            _ => width.powi(-2),
        };
        let normal = peak * (-0.5 * (cosine.min(1.0).acos() / width).powi(2)).exp();
        ((1.0 - UNLIKE) * normal + UNLIKE).ln()
    }

    /// Returns true where measured and predicted signs agree; `None` where either has none.
    fn sign(&self, usual: f64) -> Option<bool> {
        let [measured, model, noise] = [self.measured, self.model, self.noise].map(f64::sqrt);
        // Near a node, or across it, the model's own sign is not certain.
        let clear =
            measured > CLEAR * noise && model > AT_NODE * usual * (self.count as f64).sqrt();
        (clear && self.product.abs() > 0.5 * measured * model).then_some(self.product > 0.0)
    }
}
