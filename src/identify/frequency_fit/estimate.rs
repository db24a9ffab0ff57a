//! The whole estimate: the fit, its uncertainty, its test, and what it cannot tell.

use super::estimator::{ConsistentEstimator, PointFit};
use super::model::{Parameter, Point, beam_at, log_nondimensional};
use super::problem::{
    Covariance, Evaluation, LOG_STIFFNESS, MISFIT, Minimum, NOTHING_KNOWN, Problem, along, dot,
    value_along,
};
use super::set_ups::SetUps;
use super::{
    ConsistentEstimate, Correlation, EstimatedQuantity, FittedMode, FlatDirection, Goodness,
    Identifiability, OtherMinimum, Quantity, ResidualWeights, joint_at, limit_of,
};
use crate::IdentifyError;
use nalgebra::{DMatrix, SVD};
use tapjoint_numerics::stats::{NORMAL_95, root_mean_square, student};

/// Half of a 95 % interval (1, of a logarithm) beyond which a quantity is not determined: a factor of 1000. Near a rigid
/// joint the set-ups' stiffnesses may be decades apart, and a wide tolerance leaves a stiffness open.
const NOT_KNOWN: f64 = 6.9;

/// A finished fit with what its report needs.
pub(super) struct Finished<'a> {
    pub(super) estimator: &'a ConsistentEstimator,
    pub(super) problem: Problem<'a>,
    pub(super) best: Minimum,
    pub(super) directions: Vec<Point>,
    pub(super) covariance: Covariance,
    goodness: Goodness,
    /// Fits of each set-up alone.
    pub(super) set_ups: SetUps<'a>,
}

impl ConsistentEstimator {
    /// Returns the estimate with all that is known of it.
    ///
    /// # Errors
    /// [`IdentifyError::NothingToEstimate`] where no start has finite frequencies.
    pub fn estimate(&self) -> Result<ConsistentEstimate, IdentifyError> {
        self.estimate_with_set_ups(&[])
    }

    /// Returns the estimate where the joint differed from set-up to set-up. `set_ups` are their separate fits, with the
    /// same parameters, the same modes and an exact description. The modes of this estimator have the mean frequencies.
    /// Intervals hold the mean joint, by Student's t; that of a further set-up stands beside them.
    ///
    /// # Errors
    /// [`IdentifyError::NothingToEstimate`] where no start has finite frequencies.
    pub fn estimate_with_set_ups(
        &self,
        set_ups: &[PointFit],
    ) -> Result<ConsistentEstimate, IdentifyError> {
        let frequencies = self.frequencies();
        let (renewed, minima) = self.solve(&frequencies);
        let problem = self.problem(renewed.as_ref().unwrap_or(&self.models), &frequencies);
        let mut minima = minima.into_iter();
        let best = minima.next().ok_or(IdentifyError::NothingToEstimate)?;
        let directions = self.directions();
        let is_measured = self.settings.weights == ResidualWeights::Measured;
        let fit = &self.settings.fit;
        let finished = Finished {
            estimator: self,
            covariance: Covariance::new(&best.state.jacobian, &directions),
            goodness: self.tested(&problem, &best, directions.len()),
            set_ups: SetUps::new(set_ups, fit, is_measured, &best.state.point),
            problem,
            best,
            directions,
        };
        let best = &finished.best;
        let data = finished.problem.data.iter();
        let described = data.filter(|datum| datum.structure == 0);
        Ok(ConsistentEstimate {
            modes_used: described.map(|datum| datum.mode).collect(),
            fit: self.settings.fit.clone(),
            quantities: finished.quantities(),
            stiffness_covariance: finished.stiffness_covariance(),
            correlations: finished.correlations(),
            goodness: finished.goodness,
            modes: finished.modes(),
            other_minima: minima.map(|other| finished.other(&other)).collect(),
            discrepancy: self.discrepancy,
            budget: finished.budget(),
            description: match self.goodness {
                Some(_) => self.pulls.clone(),
                None => self.description(&finished.problem, &best.state),
            },
            remedies: finished.remedies(),
            set_ups: set_ups.len(),
            stop: best.stop,
            identifiability: finished.identifiability(),
            joint: joint_at(&best.state.point),
            beam: beam_at(&self.models[0].structure().beam, &best.state.point),
        })
    }

    /// Returns the test of the model by the least discrepancy, where that was found, with the misfit of this fit.
    fn tested(&self, problem: &Problem<'_>, best: &Minimum, free: usize) -> Goodness {
        let own = self.goodness(problem, best, free);
        let tested = self.goodness.unwrap_or(own);
        Goodness {
            relative_misfit: own.relative_misfit,
            misfit_per_freedom: own.misfit_per_freedom,
            ..tested
        }
    }

    pub(super) fn goodness(&self, problem: &Problem<'_>, best: &Minimum, free: usize) -> Goodness {
        let pairs = problem.data.iter().zip(&best.state.responses);
        let misfits: Vec<f64> = pairs
            .map(|(datum, found)| (found.frequency - datum.frequency) / datum.frequency)
            .collect();
        let measured = self.settings.weights == ResidualWeights::Measured;
        let known = problem.data.len() + problem.priors.len();
        Goodness::new(
            &misfits,
            measured.then_some(best.state.cost),
            known.saturating_sub(free),
        )
    }
}

impl Finished<'_> {
    pub(super) fn measured(&self) -> bool {
        self.estimator.settings.weights == ResidualWeights::Measured
    }

    /// Factor from the covariance's unit to standard uncertainties scaled by the misfit.
    fn scale(&self) -> Option<f64> {
        match self.estimator.settings.weights {
            // The misfit is in the discrepancy already.
            ResidualWeights::Measured if self.estimator.settings.discrepancy => None,
            ResidualWeights::Measured => self.goodness.uncertainty_factor(),
            ResidualWeights::Relative => self.goodness.misfit_per_freedom,
        }
    }

    /// Half of a 95 % interval in standard deviations that the misfit gives.
    fn student_95(&self) -> f64 {
        student::quantile(0.05, self.goodness.degrees_of_freedom as f64)
    }

    fn quantities(&self) -> Vec<EstimatedQuantity> {
        let parameters = self.estimator.free_parameters();
        let quantities = parameters.flat_map(|parameter| Quantity::of(parameter).iter());
        quantities
            .map(|quantity| match quantity {
                Quantity::Kz | Quantity::Ktr => self.cross_stiffness(*quantity),
                _ => self.quantity(*quantity),
            })
            .collect()
    }

    /// Returns a quantity that is the exponential, or the coupling that is the tanh, of its coordinate.
    fn quantity(&self, quantity: Quantity) -> EstimatedQuantity {
        let point = &self.best.state.point;
        let value = quantity.value(point);
        // d value per d coordinate.
        let slope = match (quantity, value) {
            (Quantity::Coupling, Some(coupling)) => Some(1.0 - coupling * coupling),
            (_, value) => value,
        };
        let gradient = quantity.gradient();
        let now = value_along(&gradient, point);
        let scatter = self.set_ups.of_mean(&gradient, &gradient).sqrt();
        let by_set_ups = self.set_ups.half_of_mean(&gradient);
        let is_known = by_set_ups < NOT_KNOWN;
        let unit = self.covariance.std(&gradient).filter(|_| is_known);
        let scale = self.scale();
        // The interval with the misfit for uncertainty is that of the coordinate to first order. Student's
        // distribution accounts for the few frequencies, which give the misfit only roughly.
        let by_misfit = unit
            .zip(scale)
            .map(|(unit, scale)| self.student_95() * unit * scale);
        let scaled = by_misfit.map(|half| half.hypot(by_set_ups));
        let own = match self.measured() {
            true => [-1.0, 1.0].map(|sign| {
                let profile = is_known.then(|| Profile::new(self, quantity, sign))?;
                Some((profile.end()? - now).abs())
            }),
            // Without stated uncertainties the scatter of the residuals is all that is known.
            false => [by_misfit, by_misfit],
        };
        let reaches = own.map(|own| Some(own?.hypot(by_set_ups)));
        // Ends that are decades apart determine nothing.
        let is_determined = reaches[0]
            .zip(reaches[1])
            .is_none_or(|(below, above)| below + above < 2.0 * NOT_KNOWN);
        let unit = unit.filter(|_| is_determined);
        let [below, above] = reaches.map(|reach| reach.filter(|_| is_determined));
        let by_further = self.set_ups.half_of_further(&gradient);
        let further = match (own, is_determined && by_further > 0.0) {
            ([Some(below), Some(above)], true) => Some((
                self.quantity_at(quantity, now - below.hypot(by_further)),
                self.quantity_at(quantity, now + above.hypot(by_further)),
            )),
            _ => None,
        };
        let low = below.map(|reach| self.quantity_at(quantity, now - reach));
        let high = above.map(|reach| self.quantity_at(quantity, now + reach));
        let scaled = scaled.filter(|half| *half < NOT_KNOWN).map(|half| {
            let ends = [now - half, now + half];
            ends.map(|coordinate| self.quantity_at(quantity, coordinate))
                .into()
        });
        let both = unit.zip(slope);
        let std_scaled = both
            .zip(scale)
            .map(|((unit, slope), scale)| (unit * scale).hypot(scatter) * slope);
        // Where one end of a profile is missing the other is all that is known.
        EstimatedQuantity {
            quantity,
            value,
            std: match self.measured() {
                true => both.map(|(unit, slope)| unit.hypot(scatter) * slope),
                false => std_scaled,
            },
            std_scaled,
            low,
            high,
            scaled,
            at_least: low.filter(|_| high.is_none()),
            at_most: high.filter(|_| low.is_none()),
            further,
            limit: limit_of(quantity, point),
        }
    }

    /// Returns the quantity's value where its coordinate has this value.
    fn quantity_at(&self, quantity: Quantity, coordinate: f64) -> f64 {
        let point = &self.best.state.point;
        match quantity {
            Quantity::Coupling => coordinate.tanh(),
            _ => {
                let now = value_along(&quantity.gradient(), point);
                quantity.value(point).unwrap_or(f64::INFINITY) * (coordinate - now).exp()
            }
        }
    }

    /// Returns Kz or Ktr, whose sign is that of the coupling. They have an interval, of the logarithm to
    /// first order, only where the coupling's own has one sign.
    fn cross_stiffness(&self, quantity: Quantity) -> EstimatedQuantity {
        let point = &self.best.state.point;
        let coupling = self.quantity(Quantity::Coupling);
        let value = quantity.value(point);
        let mut gradient = quantity.gradient();
        // d ln tanh z/dz = (1 - c^2)/c.
        let c = coupling.value.unwrap_or(0.0);
        gradient[Parameter::Coupling.index()] = -(1.0 - c * c) / c;
        let own = self.covariance.std(&gradient).filter(|_| c != 0.0);
        let scatter = self.set_ups.of_mean(&gradient, &gradient).sqrt();
        let scaled = own
            .zip(self.scale())
            .map(|(own, scale)| (own * scale).hypot(scatter));
        let unit = match self.measured() {
            true => own.map(|own| own.hypot(scatter)),
            false => scaled,
        };
        let by_set_ups = self.set_ups.half_of_mean(&gradient);
        let half = match self.measured() {
            true => own.map(|own| NORMAL_95 * own),
            false => own
                .zip(self.scale())
                .map(|(own, scale)| self.student_95() * own * scale),
        };
        let half = half.map(|half| half.hypot(by_set_ups));
        let one_sign = coupling
            .low
            .zip(coupling.high)
            .is_some_and(|(low, high)| low * high > 0.0);
        let [low, high] = [-1.0, 1.0].map(|sign: f64| {
            let (value, half) = value.zip(half).filter(|_| one_sign)?;
            Some(value * (sign * value.signum() * half).exp())
        });
        let std = value.zip(unit).map(|(value, unit)| value.abs() * unit);
        EstimatedQuantity {
            quantity,
            value,
            std,
            std_scaled: value
                .zip(scaled)
                .map(|(value, scaled)| value.abs() * scaled),
            low,
            high,
            scaled: None,
            at_least: None,
            at_most: None,
            further: None,
            limit: coupling.limit,
        }
    }

    fn modes(&self) -> Vec<FittedMode> {
        let rows = self.problem.data.iter().zip(&self.best.state.responses);
        rows.map(|(datum, found)| FittedMode {
            structure: datum.structure,
            mode: datum.mode,
            measured: datum.frequency,
            predicted: found.frequency,
            error_percent: 100.0 * (found.frequency - datum.frequency) / datum.frequency,
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
            .zip(&other.state.responses)
            .map(|(datum, found)| 100.0 * (found.frequency - datum.frequency) / datum.frequency)
            .collect();
        OtherMinimum {
            values: quantities
                .filter_map(|quantity| Some((*quantity, quantity.value(&other.state.point)?)))
                .collect(),
            misfit: other.state.cost,
            rms_percent: root_mean_square(&errors),
        }
    }
}

// Covariances and correlations of the estimate's numbers.

impl Finished<'_> {
    /// Returns the covariance of ln Kx and ln Ky, where both are estimated and neither is at its limit.
    fn stiffness_covariance(&self) -> Option<[[f64; 2]; 2]> {
        let both = [Quantity::Kx, Quantity::Ky];
        let fit = &self.estimator.settings.fit;
        let point = &self.best.state.point;
        let is_open = both.iter().all(|quantity| {
            fit.contains(&quantity.lead())
                && limit_of(*quantity, point).is_none()
                && self.covariance.std(&quantity.gradient()).is_some()
        });
        // From the covariance's unit to a variance: the misfit's where no uncertainty is stated.
        let factor = if self.measured() {
            1.0
        } else {
            self.scale()?.powi(2)
        };
        let gradients = both.map(Quantity::gradient);
        is_open.then(|| {
            gradients.map(|first| {
                gradients.map(|second| {
                    let own = factor * self.covariance.between(&first, &second);
                    own + self.set_ups.of_mean(&first, &second)
                })
            })
        })
    }

    fn correlations(&self) -> Vec<Correlation> {
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

/// Rise in chi-squared at the ends of a 95 % interval: the 95 % point of chi-squared with one degree of freedom. It
/// also serves where one end is missing. A one-sided limit at the 90 % point covers 95 % only if it is chosen before
/// the data are seen. Here the data decide between interval and limit, so that such a limit would cover less (Feldman
/// & Cousins 1998).
const RISE_95: f64 = 3.841_459;

/// One end of a quantity's interval, looked for from the best point on.
struct Profile<'a> {
    fit: &'a Finished<'a>,
    quantity: Quantity,
    /// Gradient of the quantity's coordinate.
    gradient: Point,
    /// Coordinate that makes up for what the directions move of the quantity's.
    lead: usize,
    /// Directions that leave the quantity alone.
    held: Vec<Point>,
    /// Direction in which the end is looked for: -1 or 1.
    sign: f64,
}

/// A place on a profile.
struct Place {
    /// Distance from the best point.
    offset: f64,
    at: Evaluation,
    /// Root of the rise in chi-squared less that wanted.
    excess: f64,
}

impl<'a> Profile<'a> {
    fn new(fit: &'a Finished<'a>, quantity: Quantity, sign: f64) -> Self {
        let gradient = quantity.gradient();
        let lead = quantity.lead().index();
        let free = fit
            .directions
            .iter()
            .filter(|direction| direction[lead] == 0.0);
        let mut held: Vec<Point> = free.copied().collect();
        for direction in &mut held {
            direction[lead] -= dot(&gradient, direction) / gradient[lead];
        }
        Self {
            fit,
            quantity,
            gradient,
            lead,
            held,
            sign,
        }
    }

    /// Returns where the quantity's logarithm (of the coupling: its atanh) has raised chi-squared by
    /// [`RISE_95`]; `None` where it never does.
    fn end(&self) -> Option<f64> {
        let wanted = RISE_95.sqrt();
        let furthest = self.furthest()?;
        let std = self.fit.covariance.std(&self.gradient).unwrap_or(1.0);
        let mut offset = (wanted * std).clamp(1e-9, 1.0).min(furthest);
        let best = &self.fit.best.state;
        let mut near = Place {
            offset: 0.0,
            at: best.clone(),
            excess: -wanted,
        };
        let far = loop {
            let far = self.place(offset, &near.at)?;
            if far.excess >= 0.0 {
                break far;
            }
            if offset >= furthest {
                return None;
            }
            // A straight profile is met at once; a flat one is walked in growing strides.
            let straight = offset * wanted / (wanted + far.excess).max(0.1 * wanted);
            // Beyond an offset of 30 a tenth more is the longer stride.
            offset = (1.05 * straight)
                .min(offset + 3.0)
                .max(1.1 * offset)
                .min(furthest);
            near = far;
        };
        let end = self.close_in(near, far)?;
        Some(value_along(&self.gradient, &best.point) + self.sign * end)
    }

    /// Returns how far the quantity's coordinate may go; `None` where it is there already.
    fn furthest(&self) -> Option<f64> {
        // The coupling's limit and a factor of e^4 of the beam's properties, which no beam has.
        const COUPLING: f64 = 10.0;
        const BEAM: f64 = 4.0;
        let point = &self.fit.best.state.point;
        let [log_kx, log_ky] = log_nondimensional(point);
        let (low, high) = LOG_STIFFNESS;
        let (now, low, high) = match self.quantity.lead() {
            Parameter::Kt => (log_kx, low, high),
            Parameter::Kr => (log_ky, low, high),
            Parameter::Coupling => (point[2], -COUPLING, COUPLING),
            _ => (0.0, -BEAM, BEAM),
        };
        let room = if self.sign < 0.0 {
            now - low
        } else {
            high - now
        };
        (room > 1e-6).then_some(room)
    }

    /// Returns the least misfit at a distance from the best point, looked for from another place on; `None`
    /// where it is no number.
    fn place(&self, offset: f64, from: &Evaluation) -> Option<Place> {
        let best = &self.fit.best.state;
        let mut point = from.point;
        let wanted = value_along(&self.gradient, &best.point) + self.sign * offset;
        point[self.lead] +=
            (wanted - value_along(&self.gradient, &point)) / self.gradient[self.lead];
        let problem = &self.fit.problem;
        let guesses = from.guesses_at(&point);
        let at = problem
            .minimise(&point, &guesses, &self.held, &MISFIT)?
            .state;
        let excess = (at.cost - best.cost).max(0.0).sqrt() - RISE_95.sqrt();
        Some(Place { offset, at, excess })
    }

    /// Regula falsi with the Illinois rule between two places, the nearer with too small a rise.
    fn close_in(&self, mut near: Place, mut far: Place) -> Option<f64> {
        // A thousandth of a standard deviation in the root of the rise: no reader sees it.
        const ENOUGH: f64 = 1e-3;
        const STEPS: usize = 40;
        let (mut near_weight, mut far_weight) = (near.excess, far.excess);
        for _ in 0..STEPS {
            let share = near_weight / (near_weight - far_weight);
            let offset = near.offset + share * (far.offset - near.offset);
            let middle = self.place(offset, &near.at)?;
            if middle.excess.abs() < ENOUGH || far.offset - near.offset < 1e-9 {
                return Some(offset);
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
        Some(0.5 * (near.offset + far.offset))
    }
}

// Identifiability: the parameters that these frequencies determine.

/// A combination of parameters known no better than this (1, relative) is called flat: a factor of
/// two either way is within its 95 % interval.
const FLAT: f64 = 0.35;
/// A parameter that even alone, all others known, is known no better than this is called dead.
const DEAD: f64 = 1.0;
/// Relative accuracy of the usual reading where none is stated: half a line of 800 in a band whose
/// middle the mode is in.
const USUAL_ACCURACY: f64 = 1e-3;
/// Shares below this part of the largest are left out of a sentence.
const NEGLIGIBLE: f64 = 0.05;

impl Finished<'_> {
    fn identifiability(&self) -> Identifiability {
        let fit = &self.estimator.settings.fit;
        // Without stated uncertainties misfits stand in units of the frequency: taken for usual ones.
        let unit = match self.estimator.settings.weights {
            ResidualWeights::Measured => 1.0,
            ResidualWeights::Relative => 1.0 / USUAL_ACCURACY,
        };
        let rows = self.best.state.jacobian.iter();
        let jacobian: Vec<Point> = rows.map(|row| row.map(|slope| unit * slope)).collect();
        // Singular values, descending, and their directions in parameter space.
        let count = jacobian.len().max(fit.len());
        let matrix = DMatrix::from_fn(count, fit.len(), |row, column| {
            let slopes = jacobian.get(row);
            slopes.map_or(0.0, |slopes| slopes[fit[column].index()])
        });
        let found = SVD::try_new(matrix, false, true, f64::EPSILON, 1000);
        let found = found.and_then(|svd| Some((svd.singular_values, svd.v_t?)));
        let (singular_values, directions) =
            found.map_or_else(Default::default, |(values, rows)| {
                let rows = rows.row_iter().map(|row| row.iter().copied().collect());
                (values.as_slice().to_vec(), rows.collect::<Vec<Vec<f64>>>())
            });
        let (largest, smallest) = (singular_values.first(), singular_values.last());
        let dead = fit.iter().filter(|parameter| {
            let column = parameter.index();
            let squares: f64 = jacobian.iter().map(|row| row[column].powi(2)).sum();
            squares.sqrt() * DEAD < 1.0
        });
        let at_limit = fit.iter().filter_map(|&parameter| {
            let quantity = Quantity::of(parameter).first()?;
            Some((parameter, limit_of(*quantity, &self.best.state.point)?))
        });
        Identifiability {
            condition: largest
                .zip(smallest)
                .map(|(largest, smallest)| largest / smallest)
                .filter(|condition| condition.is_finite()),
            dead: dead.copied().collect(),
            flat: flat(&singular_values, &directions, fit),
            at_limit: at_limit.collect(),
            singular_values,
        }
    }
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

/// Writes "only kt * kr^0.30 is determined".
fn determined_words(direction: &[f64], fit: &[Parameter], std: f64) -> String {
    let largest = largest_part(direction);
    let mut product = String::new();
    for (parameter, part) in fit.iter().zip(direction) {
        let exponent = part / largest;
        if exponent.abs() <= NEGLIGIBLE {
            continue;
        }
        product += match (product.is_empty(), exponent > 0.0) {
            (true, true) => "",
            (true, false) => "1 / ",
            (false, true) => " * ",
            (false, false) => " / ",
        };
        product += match parameter {
            Parameter::Coupling => "exp(atanh coupling)",
            other => other.name(),
        };
        if (exponent.abs() - 1.0).abs() >= 0.005 {
            product += &format!("^{:.2}", exponent.abs());
        }
    }
    format!(
        "only {product} is determined; across it the estimate is open by {}",
        factor_words(std)
    )
}

/// Writes "kt +10 % with kr -3 % together change hardly any frequency".
fn flat_words(direction: &[f64], fit: &[Parameter], std: f64) -> String {
    let largest = largest_part(direction);
    let mut changes = Vec::new();
    for (parameter, part) in fit.iter().zip(direction) {
        let share = part / largest;
        if share.abs() > NEGLIGIBLE {
            changes.push(match parameter {
                Parameter::Coupling => format!("coupling {:+.2}", 0.1 * share),
                other => format!("{} {:+.0} %", other.name(), 10.0 * share),
            });
        }
    }
    format!(
        "{} together change hardly any frequency; along this the estimate is open by {}",
        changes.join(" with "),
        factor_words(std)
    )
}

/// Returns the part of largest size, with its sign; of nearly equal ones the first.
fn largest_part(direction: &[f64]) -> f64 {
    let size = direction.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    let first = direction.iter().find(|part| part.abs() >= 0.999 * size);
    first.copied().unwrap_or(1.0)
}

fn factor_words(std: f64) -> String {
    let factor = (1.96 * std).exp();
    if factor < 1e3 {
        format!("a factor of {factor:.1} either way")
    } else {
        "orders of magnitude".to_owned()
    }
}
