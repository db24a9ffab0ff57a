//! Profile-likelihood intervals: every value of a quantity under which the rest can still be fitted
//! nearly as well.
//!
//! A quantity's logarithm is a linear function g . u of the point. It is held by moving only along
//! directions that leave g . u alone; what is left is an estimate with one unknown less, warm from
//! the last one. The signed root of the rise in chi-squared is nearly straight in most cases, so
//! that a secant finds its end within a few such estimates.

use super::covariance::Covariance;
use super::least_squares::{Accuracy, LOG_STIFFNESS, Minimum, descend};
use super::model::{Parameter, Point, log_nondimensional};
use super::problem::{Evaluation, Problem};
use super::quantities::Quantity;

/// Rise in chi-squared at the ends of a 95 % interval: the 95 % point of chi-squared with one degree
/// of freedom. The same holds where one end is missing. A limit at the 90 % point, of one side alone,
/// would be right in 95 % only of those who had decided for it beforehand; here the data decide, and
/// who takes the interval where it has two ends and that limit where not is wrong more often
/// (Feldman & Cousins 1998).
pub const RISE_95: f64 = 3.841_459;

/// A minimum about which intervals are wanted.
pub(super) struct Profile<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) best: &'a Minimum,
    pub(super) directions: &'a [Point],
    pub(super) covariance: &'a Covariance,
}

/// One end of an interval: below or above.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    Low,
    High,
}

/// A place on a profile.
struct Place {
    offset: f64,
    at: Evaluation,
    /// Root of the rise in chi-squared less that wanted.
    excess: f64,
}

impl Profile<'_> {
    /// Where the quantity's logarithm (of the coupling: its atanh) has raised chi-squared by so
    /// much; `None` where it never does.
    pub(super) fn end(&self, quantity: Quantity, end: End, rise: f64) -> Option<f64> {
        let gradient = quantity.gradient();
        let lead = quantity.lead().index();
        let held = held_directions(self.directions, &gradient, lead);
        let sign = match end {
            End::Low => -1.0,
            End::High => 1.0,
        };
        let value: f64 = gradient
            .iter()
            .zip(&self.best.at.point)
            .filter(|(g, _)| **g != 0.0)
            .map(|(g, x)| g * x)
            .sum();
        let wanted = rise.sqrt();
        let furthest = self.furthest(quantity, sign)?;
        let std = self.covariance.std(&gradient).unwrap_or(1.0);
        let first = (wanted * std).clamp(1e-9, 1.0).min(furthest);
        let place = |offset: f64, from: &Evaluation| {
            let mut point = from.point;
            let now: f64 = gradient
                .iter()
                .zip(&point)
                .filter(|(g, _)| **g != 0.0)
                .map(|(g, x)| g * x)
                .sum();
            point[lead] += (value + sign * offset - now) / gradient[lead];
            let start = self.problem.evaluate(&point, &from.lambdas);
            let at = descend(self.problem, start, &held, Accuracy::MISFIT).at;
            let excess = (at.cost - self.best.at.cost).max(0.0).sqrt() - wanted;
            Place { offset, at, excess }
        };
        let bracket = expand(first, furthest, (&self.best.at, wanted), &place)?;
        Some(value + sign * close_in(bracket, &place))
    }

    /// How far the quantity's coordinate may go; `None` where it is there already.
    fn furthest(&self, quantity: Quantity, sign: f64) -> Option<f64> {
        // The coupling's limit and a factor of e^4 of the beam's properties, which no beam has.
        const COUPLING: f64 = 10.0;
        const BEAM: f64 = 4.0;
        let point = &self.best.at.point;
        let [log_kx, log_ky] = log_nondimensional(point);
        let (low, high) = LOG_STIFFNESS;
        let (now, low, high) = match quantity.lead() {
            Parameter::Kt => (log_kx, low, high),
            Parameter::Kr => (log_ky, low, high),
            Parameter::Coupling => (point[2], -COUPLING, COUPLING),
            _ => (0.0, -BEAM, BEAM),
        };
        let room = if sign < 0.0 { now - low } else { high - now };
        (room > 1e-6).then_some(room)
    }
}

/// Directions that leave the quantity alone: what each moves, the lead makes up for.
fn held_directions(directions: &[Point], gradient: &Point, lead: usize) -> Vec<Point> {
    let free = directions.iter().filter(|direction| direction[lead] == 0.0);
    free.map(|direction| {
        let mut held = *direction;
        let moved: f64 = gradient.iter().zip(direction).map(|(g, d)| g * d).sum();
        held[lead] -= moved / gradient[lead];
        held
    })
    .collect()
}

/// Two places, the nearer with too small a rise and the further with enough of it.
fn expand(
    first: f64,
    furthest: f64,
    (best, wanted): (&Evaluation, f64),
    place: &impl Fn(f64, &Evaluation) -> Place,
) -> Option<(Place, Place)> {
    let mut near = Place {
        offset: 0.0,
        at: best.clone(),
        excess: -wanted,
    };
    let mut offset = first;
    loop {
        let far = place(offset, &near.at);
        if far.excess >= 0.0 {
            return Some((near, far));
        }
        if offset >= furthest {
            return None;
        }
        // A straight profile is met at once; a flat one is walked in growing strides.
        let straight = offset * wanted / (wanted + far.excess).max(0.1 * wanted);
        offset = (1.05 * straight)
            .clamp(1.1 * offset, offset + 3.0)
            .min(furthest);
        near = far;
    }
}

/// Regula falsi with the Illinois rule between the two.
fn close_in(
    (mut near, mut far): (Place, Place),
    place: &impl Fn(f64, &Evaluation) -> Place,
) -> f64 {
    // A thousandth of a standard deviation in the root of the rise: no reader sees it.
    const ENOUGH: f64 = 1e-3;
    const STEPS: usize = 40;
    let (mut near_weight, mut far_weight) = (near.excess, far.excess);
    for _ in 0..STEPS {
        let share = near_weight / (near_weight - far_weight);
        let offset = near.offset + share * (far.offset - near.offset);
        let middle = place(offset, &near.at);
        if middle.excess.abs() < ENOUGH || far.offset - near.offset < 1e-9 {
            return offset;
        }
        if middle.excess < 0.0 {
            near_weight = middle.excess;
            far_weight *= 0.5;
            near = middle;
        } else {
            far_weight = middle.excess;
            near_weight *= 0.5;
            far = middle;
        }
    }
    0.5 * (near.offset + far.offset)
}
