//! The whole estimate: the fit, its uncertainty, its test, and what it cannot tell.

use super::estimator::ConsistentEstimator;
use super::least_squares::Covariance;
use super::least_squares::{Accuracy, LOG_STIFFNESS, Minimum, NOTHING_KNOWN, descend};
use super::least_squares::{Evaluation, Problem, along};
use super::model::JointedStructure;
use super::model::{Parameter, Point, beam_at, log_nondimensional};
use super::result::{
    ConsistentEstimate, Correlation, EstimatedQuantity, ExtraMode, FittedMode, FlatDirection,
    Goodness, Identifiability, Limit, NeededAccuracy, OtherMinimum, Quantity, joint_at, limit_of,
};
use super::{ConsistentSettings, Intervals, ResidualWeights};
use crate::{IdentifyError, MeasuredMode};
use nalgebra::{DMatrix, SVD};
use tapjoint_numerics::stats::{NORMAL_95, median, root_mean_square, student};

/// Estimates a joint from the frequencies of these modes.
///
/// # Errors
/// As [`ConsistentEstimator::new`].
pub fn estimate_consistently(
    structure: &JointedStructure,
    modes: &[MeasuredMode],
    settings: &ConsistentSettings,
) -> Result<ConsistentEstimate, IdentifyError> {
    ConsistentEstimator::new(structure, modes, settings)?.estimate()
}

/// A finished fit with what its report needs.
pub(super) struct Finished<'a> {
    pub(super) estimator: &'a ConsistentEstimator,
    pub(super) problem: &'a Problem<'a>,
    pub(super) best: &'a Minimum,
    pub(super) directions: &'a [Point],
    pub(super) covariance: &'a Covariance,
    pub(super) goodness: Goodness,
}

impl ConsistentEstimator {
    /// The estimate with all that is known of it.
    ///
    /// # Errors
    /// [`IdentifyError::NothingToEstimate`] where no start has finite frequencies.
    pub fn estimate(&self) -> Result<ConsistentEstimate, IdentifyError> {
        let frequencies = self.frequencies();
        let (renewed, minima) = self.solve(&frequencies);
        let model = renewed.as_ref().unwrap_or(&self.model);
        let mut problem = self.problem(model, &frequencies);
        let (best, others) = minima
            .split_first()
            .ok_or(IdentifyError::NothingToEstimate)?;
        // A robust loss without stated uncertainties was fitted in units of the usual misfit.
        self.rescale(&mut problem, &[best.at.point]);
        let directions = self.directions();
        let covariance = Covariance::of(&best.at, &directions);
        let finished = Finished {
            estimator: self,
            problem: &problem,
            best,
            directions: &directions,
            covariance: &covariance,
            goodness: self.goodness(&problem, best, directions.len()),
        };
        Ok(ConsistentEstimate {
            modes_used: self.modes.iter().map(|mode| mode.mode).collect(),
            fit: self.settings.fit.clone(),
            quantities: finished.quantities(),
            covariance: finished.covariance_matrix(),
            stiffness_covariance: finished.stiffness_covariance(),
            correlations: finished.correlations(),
            goodness: finished.goodness,
            modes: finished.modes(),
            other_minima: others.iter().map(|other| finished.other(other)).collect(),
            stop: best.stop,
            identifiability: identifiability(&finished),
            joint: joint_at(&best.at.point),
            beam: beam_at(&self.model.structure().beam, &best.at.point),
        })
    }

    fn goodness(&self, problem: &Problem<'_>, best: &Minimum, free: usize) -> Goodness {
        let pairs = problem.data.iter().zip(&best.at.frequencies);
        let misfits: Vec<f64> = pairs
            .clone()
            .map(|(datum, found)| (found - datum.frequency) / datum.frequency)
            .collect();
        // The plain sum of squares, whatever the loss: only its distribution is known.
        let modes: f64 = pairs
            .map(|(datum, found)| ((found - datum.frequency) / datum.std).powi(2))
            .sum();
        let priors: f64 = best.at.residuals[problem.data.len()..]
            .iter()
            .map(|residual| residual * residual)
            .sum();
        let measured = self.settings.weights == ResidualWeights::Measured;
        let known = problem.data.len() + problem.priors.len();
        Goodness::new(
            &misfits,
            measured.then_some(modes + priors),
            known.saturating_sub(free),
        )
    }
}

impl Finished<'_> {
    /// Parameters at the end of their range.
    pub(super) fn limits(&self) -> Vec<(Parameter, Limit)> {
        let point = &self.best.at.point;
        let fit = self.estimator.settings.fit.iter();
        fit.filter_map(|&parameter| {
            let quantity = Quantity::of(parameter).first()?;
            Some((parameter, limit_of(*quantity, point)?))
        })
        .collect()
    }

    pub(super) fn measured(&self) -> bool {
        self.estimator.settings.weights == ResidualWeights::Measured
    }

    /// Factor from the covariance's unit to standard uncertainties scaled by the misfit.
    pub(super) fn scale(&self) -> Option<f64> {
        if self.measured() {
            self.goodness.uncertainty_factor()
        } else {
            // The covariance is in units of the weights' relative deviation, 1 unless a loss rescaled it.
            let unit = self.problem.data.first().map(|d| d.std / d.frequency)?;
            self.goodness.misfit_per_freedom.map(|misfit| misfit / unit)
        }
    }

    fn quantities(&self) -> Vec<EstimatedQuantity> {
        let settings = &self.estimator.settings;
        let nuisances = self
            .estimator
            .nuisances
            .iter()
            .map(|(parameter, _)| *parameter);
        let parameters = settings.fit.iter().copied().chain(nuisances);
        parameters
            .flat_map(|parameter| Quantity::of(parameter).iter())
            .map(|quantity| match quantity {
                Quantity::Kz | Quantity::Ktr => self.cross_stiffness(*quantity),
                _ => self.quantity(*quantity),
            })
            .collect()
    }

    /// A quantity that is the exponential, or the coupling that is the tanh, of its coordinate.
    fn quantity(&self, quantity: Quantity) -> EstimatedQuantity {
        let point = &self.best.at.point;
        let value = quantity.value(point);
        // d value per d coordinate.
        let slope = match (quantity, value) {
            (Quantity::Coupling, Some(coupling)) => Some(1.0 - coupling * coupling),
            (_, value) => value,
        };
        let gradient = quantity.gradient();
        let unit = self.covariance.std(&gradient);
        let std = unit.zip(slope).map(|(std, slope)| std * slope);
        let mut result = EstimatedQuantity {
            quantity,
            value,
            std: std.filter(|_| self.measured()),
            std_scaled: std.zip(self.scale()).map(|(std, scale)| std * scale),
            low: None,
            high: None,
            scaled: unit.and_then(|unit| self.scaled_interval(quantity, &gradient, unit)),
            at_least: None,
            at_most: None,
            limit: limit_of(quantity, point),
        };
        if self.measured() {
            self.add_interval(&mut result, &gradient, unit);
        }
        result
    }

    /// The 95 % interval with the misfit for uncertainty: of the coordinate to first order, by
    /// Student's distribution, because so few frequencies know the misfit only roughly.
    fn scaled_interval(
        &self,
        quantity: Quantity,
        gradient: &Point,
        unit: f64,
    ) -> Option<(f64, f64)> {
        let freedom = self.goodness.degrees_of_freedom;
        let half = student::quantile(0.05, freedom as f64) * unit * self.scale()?;
        let now = self.coordinate(gradient);
        let [low, high] = [now - half, now + half]
            .map(|coordinate| self.quantity_at(quantity, gradient, coordinate));
        Some((low, high))
    }

    /// The quantity's value where its coordinate has this value.
    fn quantity_at(&self, quantity: Quantity, gradient: &Point, coordinate: f64) -> f64 {
        match quantity {
            Quantity::Coupling => coordinate.tanh(),
            _ => {
                let now = self.coordinate(gradient);
                let value = quantity.value(&self.best.at.point).unwrap_or(f64::INFINITY);
                value * (coordinate - now).exp()
            }
        }
    }

    fn add_interval(&self, result: &mut EstimatedQuantity, gradient: &Point, unit: Option<f64>) {
        let quantity = result.quantity;
        let ends = match self.estimator.settings.intervals {
            Intervals::Linear => {
                let now = self.coordinate(gradient);
                [-NORMAL_95, NORMAL_95].map(|factor| unit.map(|std| now + factor * std))
            }
            Intervals::Profile => {
                let profile = Profile {
                    problem: self.problem,
                    best: self.best,
                    directions: self.directions,
                    covariance: self.covariance,
                };
                [-1.0, 1.0].map(|sign| profile.end(quantity, sign, RISE_95))
            }
        };
        [result.low, result.high] =
            ends.map(|end| end.map(|coordinate| self.quantity_at(quantity, gradient, coordinate)));
        if self.estimator.settings.intervals == Intervals::Profile {
            // Where one end is missing the other is all that is known.
            result.at_least = result.low.filter(|_| result.high.is_none());
            result.at_most = result.high.filter(|_| result.low.is_none());
        }
    }

    fn coordinate(&self, gradient: &Point) -> f64 {
        coordinate(gradient, &self.best.at.point)
    }

    /// Kz and Ktr, whose sign is that of the coupling: with an interval, of the logarithm to first
    /// order, only where the coupling's own has one sign.
    fn cross_stiffness(&self, quantity: Quantity) -> EstimatedQuantity {
        let point = &self.best.at.point;
        let coupling = self.quantity(Quantity::Coupling);
        let value = quantity.value(point);
        let mut gradient = quantity.gradient();
        // d ln tanh z/dz = (1 - c^2)/c.
        let c = coupling.value.unwrap_or(0.0);
        gradient[Parameter::Coupling.index()] = -(1.0 - c * c) / c;
        let unit = if c == 0.0 {
            None
        } else {
            self.covariance.std(&gradient)
        };
        let one_sign = coupling
            .low
            .zip(coupling.high)
            .is_some_and(|(low, high)| low * high > 0.0);
        let [low, high] = [-1.0, 1.0].map(|sign: f64| {
            let (value, unit) = value.zip(unit).filter(|_| one_sign)?;
            Some(value * (sign * value.signum() * NORMAL_95 * unit).exp())
        });
        let std = value.zip(unit).map(|(value, unit)| value.abs() * unit);
        EstimatedQuantity {
            quantity,
            value,
            std: std.filter(|_| self.measured()),
            std_scaled: std.zip(self.scale()).map(|(std, scale)| std * scale),
            low,
            high,
            scaled: None,
            at_least: None,
            at_most: None,
            limit: coupling.limit,
        }
    }

    fn modes(&self) -> Vec<FittedMode> {
        let leverages = self.covariance.leverages(&self.best.at.jacobian);
        let rows = self.problem.data.iter().zip(&self.best.at.frequencies);
        rows.zip(leverages)
            .map(|((datum, &predicted), leverage)| FittedMode {
                mode: datum.mode,
                measured: datum.frequency,
                predicted,
                error_percent: 100.0 * (predicted - datum.frequency) / datum.frequency,
                standardised: self
                    .measured()
                    .then_some((predicted - datum.frequency) / datum.std),
                leverage,
            })
            .collect()
    }

    fn other(&self, other: &Minimum) -> OtherMinimum {
        let fit = self.estimator.settings.fit.iter();
        let quantities = fit.flat_map(|parameter| Quantity::of(*parameter).iter());
        let errors: Vec<f64> = self
            .problem
            .data
            .iter()
            .zip(&other.at.frequencies)
            .map(|(datum, found)| 100.0 * (found - datum.frequency) / datum.frequency)
            .collect();
        OtherMinimum {
            values: quantities
                .filter_map(|quantity| Some((*quantity, quantity.value(&other.at.point)?)))
                .collect(),
            misfit: other.at.cost,
            rms_percent: root_mean_square(&errors),
        }
    }
}

// How what is estimated hangs together: covariances and correlations of the estimate's numbers.

impl Finished<'_> {
    /// Factor from the covariance's unit to a variance: the misfit's where no uncertainty is stated.
    fn variance_unit(&self) -> Option<f64> {
        if self.measured() {
            Some(1.0)
        } else {
            Some(self.scale()?.powi(2))
        }
    }

    /// Of ln Kx and ln Ky, where both are estimated and neither is at its limit.
    pub(super) fn stiffness_covariance(&self) -> Option<[[f64; 2]; 2]> {
        let both = [Quantity::Kx, Quantity::Ky];
        let fit = &self.estimator.settings.fit;
        let point = &self.best.at.point;
        let is_open = both.iter().all(|quantity| {
            fit.contains(&quantity.lead())
                && limit_of(*quantity, point).is_none()
                && self.covariance.std(&quantity.gradient()).is_some()
        });
        let factor = self.variance_unit().filter(|_| is_open)?;
        let gradients = both.map(Quantity::gradient);
        Some(
            gradients.map(|first| {
                gradients.map(|second| factor * self.covariance.between(&first, &second))
            }),
        )
    }

    pub(super) fn covariance_matrix(&self) -> Option<Vec<Vec<f64>>> {
        let factor = self.variance_unit()?;
        let fit = &self.estimator.settings.fit;
        let mut rows = Vec::with_capacity(fit.len());
        for &first in fit {
            let between = |second| self.covariance.between(&along(first), &along(second));
            rows.push(fit.iter().map(|&second| factor * between(second)).collect());
        }
        Some(rows)
    }

    pub(super) fn correlations(&self) -> Vec<Correlation> {
        let fit = &self.estimator.settings.fit;
        let mut found = Vec::new();
        for (index, &first) in fit.iter().enumerate() {
            for &second in &fit[index + 1..] {
                let (a, b) = (along(first), along(second));
                let size = self.covariance.between(&a, &a) * self.covariance.between(&b, &b);
                found.push(Correlation {
                    first,
                    second,
                    value: (self.covariance.between(&a, &b) / size.sqrt()).clamp(-1.0, 1.0),
                });
            }
        }
        found
    }
}

// Profile-likelihood intervals: every value of a quantity under which the rest can still be fitted
// nearly as well.
//
// A quantity's logarithm is a linear function g . u of the point. It is held by moving only along
// directions that leave g . u alone; what is left is an estimate with one unknown less, warm from
// the last one. The signed root of the rise in chi-squared is nearly straight in most cases, so
// that a secant finds its end within a few such estimates.

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

/// The quantity's coordinate, a linear function of the point. A rigid joint has no part in others.
fn coordinate(gradient: &Point, point: &Point) -> f64 {
    let terms = gradient.iter().zip(point);
    terms.filter(|(g, _)| **g != 0.0).map(|(g, x)| g * x).sum()
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
    fn end(&self, quantity: Quantity, sign: f64, rise: f64) -> Option<f64> {
        let gradient = quantity.gradient();
        let lead = quantity.lead().index();
        let held = held_directions(self.directions, &gradient, lead);
        let value = coordinate(&gradient, &self.best.at.point);
        let wanted = rise.sqrt();
        let furthest = self.furthest(quantity, sign)?;
        let std = self.covariance.std(&gradient).unwrap_or(1.0);
        let first = (wanted * std).clamp(1e-9, 1.0).min(furthest);
        let place = |offset: f64, from: &Evaluation| {
            let mut point = from.point;
            let now = coordinate(&gradient, &point);
            point[lead] += (value + sign * offset - now) / gradient[lead];
            let start = self.problem.evaluate(&point, &from.lambdas);
            let at = descend(self.problem, start, &held, Accuracy::MISFIT).at;
            let excess = (at.cost - self.best.at.cost).max(0.0).sqrt() - wanted;
            Place { offset, at, excess }
        };
        let (near, far) = expand(first, furthest, &self.best.at, wanted, &place)?;
        Some(value + sign * close_in(near, far, &place))
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
    best: &Evaluation,
    wanted: f64,
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
fn close_in(mut near: Place, mut far: Place, place: &impl Fn(f64, &Evaluation) -> Place) -> f64 {
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

// What these frequencies can tell and what they cannot.

/// A combination of parameters known no better than this (1, relative) is called flat: a factor of
/// two either way is within its 95 % interval.
const FLAT: f64 = 0.35;
/// A parameter that even alone, all others known, is known no better than this is called dead.
const DEAD: f64 = 1.0;
/// Relative accuracy of the usual reading where none is stated: half a line of 800 in a band whose
/// middle the mode is in.
const USUAL_ACCURACY: f64 = 1e-3;
/// A stiffness counts as measurable when its standard uncertainty is this part of it.
const MEASURABLE: f64 = 0.1;
/// Shares below this part of the largest are left out of a sentence.
const NEGLIGIBLE: f64 = 0.05;

pub(super) fn identifiability(finished: &Finished<'_>) -> Identifiability {
    let fit = &finished.estimator.settings.fit;
    // Without stated uncertainties misfits stand in units of the frequency: taken for usual ones.
    let unit = match finished.estimator.settings.weights {
        ResidualWeights::Measured => 1.0,
        ResidualWeights::Relative => 1.0 / USUAL_ACCURACY,
    };
    let jacobian: Vec<Point> = finished
        .best
        .at
        .jacobian
        .iter()
        .map(|row| row.map(|slope| unit * slope))
        .collect();
    let (singular_values, directions) = decompose(&jacobian, fit);
    let (largest, smallest) = (singular_values.first(), singular_values.last());
    Identifiability {
        condition: largest
            .zip(smallest)
            .map(|(largest, smallest)| largest / smallest)
            .filter(|condition| condition.is_finite()),
        dead: dead(&jacobian, fit),
        flat: flat(&singular_values, &directions, fit),
        at_limit: finished.limits(),
        extra_modes: extra_modes(finished, &jacobian, unit),
        needed: needed(finished),
        singular_values,
    }
}

/// Singular values, descending, and their directions in parameter space.
fn decompose(jacobian: &[Point], fit: &[Parameter]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let rows = jacobian.len().max(fit.len());
    let matrix = DMatrix::from_fn(rows, fit.len(), |row, column| {
        jacobian
            .get(row)
            .map_or(0.0, |slopes| slopes[fit[column].index()])
    });
    let Some(svd) = SVD::try_new(matrix, false, true, f64::EPSILON, 1000) else {
        return (Vec::new(), Vec::new());
    };
    let Some(vectors) = svd.v_t else {
        return (Vec::new(), Vec::new());
    };
    let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
    order.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
    let directions = order
        .iter()
        .map(|&row| vectors.row(row).iter().copied().collect())
        .collect();
    let values = order.iter().map(|&i| svd.singular_values[i]).collect();
    (values, directions)
}

fn dead(jacobian: &[Point], fit: &[Parameter]) -> Vec<Parameter> {
    let dead = fit.iter().filter(|parameter| {
        let column = parameter.index();
        let squares: f64 = jacobian.iter().map(|row| row[column].powi(2)).sum();
        squares.sqrt() * DEAD < 1.0
    });
    dead.copied().collect()
}

fn flat(values: &[f64], directions: &[Vec<f64>], fit: &[Parameter]) -> Vec<FlatDirection> {
    let mut found = Vec::new();
    for (index, (value, direction)) in values.iter().zip(directions).enumerate() {
        if value * FLAT >= 1.0 {
            continue;
        }
        let words = match (fit.len(), index) {
            // With two parameters the other direction says it more plainly.
            (2, 1) => determined_words(&directions[0], fit, value.recip()),
            _ => flat_words(direction, fit, value.recip()),
        };
        found.push(FlatDirection {
            direction: fit.iter().copied().zip(direction.iter().copied()).collect(),
            std: Some(value.recip()).filter(|std| *std < NOTHING_KNOWN),
            words,
        });
    }
    found
}

/// "only kt * kr^0.30 is determined".
fn determined_words(direction: &[f64], fit: &[Parameter], std: f64) -> String {
    let largest = largest_part(direction);
    let mut product = String::new();
    for (parameter, part) in fit.iter().zip(direction) {
        let exponent = part / largest;
        if exponent.abs() > NEGLIGIBLE {
            let sign = match (product.is_empty(), exponent > 0.0) {
                (true, true) => "",
                (true, false) => "1 / ",
                (false, true) => " * ",
                (false, false) => " / ",
            };
            product += sign;
            product += &power(*parameter, exponent.abs());
        }
    }
    format!(
        "only {product} is determined; across it the estimate is open by {}",
        factor_words(std)
    )
}

/// "kt +10 % with kr -3 % together change hardly any frequency".
fn flat_words(direction: &[f64], fit: &[Parameter], std: f64) -> String {
    let largest = largest_part(direction);
    let changes: Vec<String> = fit
        .iter()
        .zip(direction)
        .map(|(parameter, part)| (parameter, part / largest))
        .filter(|(_, share)| share.abs() > NEGLIGIBLE)
        .map(|(parameter, share)| change(*parameter, share))
        .collect();
    format!(
        "{} together change hardly any frequency; along this the estimate is open by {}",
        changes.join(" with "),
        factor_words(std)
    )
}

/// The part of largest size, with its sign; of nearly equal ones the first.
fn largest_part(direction: &[f64]) -> f64 {
    let size = direction.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    let first = direction.iter().find(|part| part.abs() >= 0.999 * size);
    first.copied().unwrap_or(1.0)
}

fn power(parameter: Parameter, exponent: f64) -> String {
    let name = match parameter {
        Parameter::Coupling => "exp(atanh coupling)",
        other => other.name(),
    };
    if (exponent - 1.0).abs() < 0.005 {
        name.to_owned()
    } else {
        format!("{name}^{exponent:.2}")
    }
}

fn change(parameter: Parameter, share: f64) -> String {
    match parameter {
        Parameter::Coupling => format!("coupling {:+.2}", 0.1 * share),
        other => format!("{} {:+.0} %", other.name(), 10.0 * share),
    }
}

fn factor_words(std: f64) -> String {
    let factor = (1.96 * std).exp();
    if factor < 1e3 {
        format!("a factor of {factor:.1} either way")
    } else {
        "orders of magnitude".to_owned()
    }
}

fn extra_modes(finished: &Finished<'_>, jacobian: &[Point], unit: f64) -> Vec<ExtraMode> {
    let data = &finished.problem.data;
    let highest = data.iter().map(|datum| datum.mode).max().unwrap_or(0);
    let mut relative: Vec<f64> = data
        .iter()
        .map(|datum| datum.std / datum.frequency / unit)
        .collect();
    let relative_std = median(&mut relative);
    let covariance = Covariance::new(jacobian, finished.directions);
    (1..=highest + 1)
        .filter(|mode| data.iter().all(|datum| datum.mode != *mode))
        .map(|mode| {
            let point = &finished.best.at.point;
            let guess = mode as f64 * std::f64::consts::PI;
            let response = finished.problem.model.response(point, mode, guess);
            let slopes = response.sensitivity.map(|slope| slope / relative_std);
            let fit = finished.estimator.settings.fit.iter();
            let stds = fit.map(|parameter| {
                let variance = covariance.variance_with(&along(*parameter), &slopes);
                Some(variance.max(0.0).sqrt()).filter(|std| *std < NOTHING_KNOWN)
            });
            ExtraMode {
                mode,
                frequency: response.frequency,
                relative_std,
                stds: stds.collect(),
            }
        })
        .collect()
}

/// With all frequencies known equally well, a parameter's uncertainty is proportional to theirs.
fn needed(finished: &Finished<'_>) -> Vec<NeededAccuracy> {
    let at = &finished.best.at;
    let relative: Vec<Point> = finished
        .problem
        .data
        .iter()
        .zip(at.jacobian.iter().zip(&at.frequencies))
        .map(|(datum, (row, frequency))| row.map(|slope| slope * datum.std / frequency))
        .collect();
    let fit = &finished.estimator.settings.fit;
    let directions: Vec<Point> = fit.iter().map(|parameter| along(*parameter)).collect();
    let covariance = Covariance::new(&relative, &directions);
    let point = &at.point;
    fit.iter()
        .zip(&directions)
        .map(|(&parameter, direction)| {
            let slope = match parameter {
                Parameter::Coupling => 1.0 - point[parameter.index()].tanh().powi(2),
                _ => 1.0,
            };
            let std = slope * covariance.std_or_infinite(direction);
            NeededAccuracy {
                parameter,
                // An accuracy that no clock has is none.
                relative_std: Some(MEASURABLE / std).filter(|needed| *needed > 1e-9),
            }
        })
        .collect()
}
