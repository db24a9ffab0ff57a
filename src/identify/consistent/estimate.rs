//! The whole estimate: the fit, its uncertainty, its test, and what it cannot tell.

use super::covariance::Covariance;
use super::estimator::ConsistentEstimator;
use super::goodness::Goodness;
use super::identifiability::identifiability;
use super::intervals::{End, Profile, RISE_95};
use super::layout::JointedStructure;
use super::least_squares::{LOG_STIFFNESS, Minimum};
use super::model::{Parameter, Point, beam_at, log_nondimensional};
use super::problem::Problem;
use super::quantities::{Quantity, joint_at};
use super::result::{ConsistentEstimate, EstimatedQuantity, FittedMode, Limit, OtherMinimum};
use super::settings::{ConsistentSettings, Intervals, ResidualWeights};
use crate::{IdentifyError, MeasuredMode};
use tapjoint_numerics::stats::NORMAL_95;
use tapjoint_numerics::stats::{root_mean_square, student};

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
        let limit = |&parameter: &Parameter| {
            let quantity = Quantity::of(parameter).first()?;
            Some((parameter, limit_of(*quantity, point)?))
        };
        self.estimator
            .settings
            .fit
            .iter()
            .filter_map(limit)
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
            self.add_interval(&mut result, (&gradient, unit));
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
        let back = |coordinate: f64| self.quantity_at(quantity, gradient, coordinate);
        Some((back(now - half), back(now + half)))
    }

    fn quantity_at(&self, quantity: Quantity, gradient: &Point, coordinate: f64) -> f64 {
        match quantity {
            Quantity::Coupling => coordinate.tanh(),
            _ => self.value_at(quantity, gradient, coordinate),
        }
    }

    fn add_interval(
        &self,
        result: &mut EstimatedQuantity,
        (gradient, unit): (&Point, Option<f64>),
    ) {
        let quantity = result.quantity;
        let back = |coordinate: f64| self.quantity_at(quantity, gradient, coordinate);
        match self.estimator.settings.intervals {
            Intervals::Linear => {
                let now = self.coordinate(gradient);
                result.low = unit.map(|std| back(now - NORMAL_95 * std));
                result.high = unit.map(|std| back(now + NORMAL_95 * std));
            }
            Intervals::Profile => {
                let profile = Profile {
                    problem: self.problem,
                    best: self.best,
                    directions: self.directions,
                    covariance: self.covariance,
                };
                let end = |end: End| profile.end(quantity, end, RISE_95).map(back);
                (result.low, result.high) = (end(End::Low), end(End::High));
                // Where one end is missing the other is all that is said.
                result.at_least = result.low.filter(|_| result.high.is_none());
                result.at_most = result.high.filter(|_| result.low.is_none());
            }
        }
    }

    fn coordinate(&self, gradient: &Point) -> f64 {
        let terms = gradient.iter().zip(&self.best.at.point);
        terms.filter(|(g, _)| **g != 0.0).map(|(g, x)| g * x).sum()
    }

    /// The quantity's value where its coordinate has this value.
    fn value_at(&self, quantity: Quantity, gradient: &Point, coordinate: f64) -> f64 {
        let now = self.coordinate(gradient);
        let value = quantity.value(&self.best.at.point).unwrap_or(f64::INFINITY);
        value * (coordinate - now).exp()
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
        let end = |sign: f64| {
            let (value, unit) = value.zip(unit).filter(|_| one_sign)?;
            Some(value * (sign * value.signum() * NORMAL_95 * unit).exp())
        };
        let std = value.zip(unit).map(|(value, unit)| value.abs() * unit);
        EstimatedQuantity {
            quantity,
            value,
            std: std.filter(|_| self.measured()),
            std_scaled: std.zip(self.scale()).map(|(std, scale)| std * scale),
            low: end(-1.0),
            high: end(1.0),
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

/// Where a coordinate is at the end of its range but for rounding.
pub(super) fn limit_of(quantity: Quantity, point: &Point) -> Option<Limit> {
    // Within a factor e^3 of the end no frequency differs from that at the end.
    const NEAR: f64 = 3.0;
    let [log_kx, log_ky] = log_nondimensional(point);
    let log = match quantity.lead() {
        Parameter::Kt => log_kx,
        Parameter::Kr => log_ky,
        Parameter::Coupling => {
            let full = 1.0 - point[2].tanh().abs() < 1e-6;
            return full.then_some(Limit::FullCoupling);
        }
        _ => return None,
    };
    let (low, high) = LOG_STIFFNESS;
    if log > high - NEAR {
        Some(Limit::Rigid)
    } else if log < low + NEAR {
        Some(Limit::Absent)
    } else {
        None
    }
}
