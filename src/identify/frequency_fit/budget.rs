//! The budget of an estimate: what each input contributes, and what further measurements would bring.
//!
//! About the best point the estimate is a linear function of everything that is known: readings, stated properties,
//! attached masses, and the discrepancy. The variance of a quantity is the sum of their shares (JCGM 100:2008, 5.1).

use super::Quantity;
use super::estimate::Finished;
use super::model::{PARAMETERS, Parameter, Point};
use super::problem::{Covariance, along, value_along, whitened};
use super::uncertainty::{BudgetInput, LEAST_DISCREPANCY, whitening};
use nalgebra::DVector;
use schemars::JsonSchema;
use serde::Serialize;

/// Contribution of an input.
#[derive(Debug, Clone, PartialEq)]
pub struct BudgetEntry {
    /// The input.
    pub input: BudgetInput,
    /// Its part in the standard deviation of each quantity's logarithm (1); the squares of all inputs add up.
    pub stds: Vec<(Quantity, f64)>,
}

/// A measurement that makes the description more certain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// The bare beam on a balance, to 0.1 %.
    WeighBeam,
    /// Five frequencies of the same beam, free at both ends.
    FreeTest,
    /// Thickness to 0.01 mm, width to 0.02 mm and length to 0.2 mm.
    Caliper,
    /// What is attached on a balance, to 0.1 g.
    WeighMasses,
}

/// What a further measurement would make of the estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Remedy {
    /// The measurement.
    pub measure: Measure,
    /// Standard deviation of each quantity's logarithm (1) with it.
    pub stds: Vec<(Quantity, f64)>,
}

/// Relative standard uncertainty of a beam's mass by a balance.
const BALANCE: f64 = 1e-3;
/// Standard uncertainty (kg) of a small mass by a balance.
const SMALL_BALANCE: f64 = 1e-4;
/// Modes of a free test.
const FREE_MODES: f64 = 5.0;
/// Standard uncertainties (m) of thickness, width and length by a caliper and a rule.
const CALIPER: [(Parameter, f64); 3] = [
    (Parameter::Thickness, 1e-5),
    (Parameter::Width, 2e-5),
    (Parameter::Length, 2e-4),
];

impl Finished<'_> {
    /// Quantities with a budget: those whose logarithm is a coordinate that the fit knows. None with relative weights, where
    /// the misfit is all that is known.
    fn budgeted(&self) -> Vec<(Quantity, Point)> {
        if !self.measured() {
            return Vec::new();
        }
        let fit = self.estimator.settings.fit.iter();
        let all = fit.flat_map(|parameter| Quantity::of(*parameter).iter());
        let all = all.filter(|quantity| quantity.lead() != Parameter::Coupling);
        let known = all.filter(|quantity| self.covariance.std(&quantity.gradient()).is_some());
        known
            .map(|quantity| (*quantity, quantity.gradient()))
            .collect()
    }

    /// Returns what each input contributes.
    pub(super) fn budget(&self) -> Vec<BudgetEntry> {
        let problem = &self.problem;
        let count = problem.data.len();
        let inputs = self.estimator.standardised_inputs(&problem.data);
        let mut entries: Vec<BudgetEntry> = Vec::new();
        let mut add = |input: BudgetInput, quantity: Quantity, std: f64| match entries
            .iter_mut()
            .find(|entry| entry.input == input)
        {
            Some(entry) => entry.stds.push((quantity, std)),
            None => entries.push(BudgetEntry {
                input,
                stds: vec![(quantity, std)],
            }),
        };
        for (quantity, gradient) in self.budgeted() {
            // Change of the quantity by each independent residual, and by each standardised reading.
            let rows = self.best.state.jacobian.iter();
            let moves: Vec<f64> = rows
                .map(|row| self.covariance.between(&gradient, row))
                .collect();
            let mut by_reading = DVector::from_column_slice(&moves[..count]);
            if let Some(triangle) = &problem.whitening {
                by_reading = triangle.transpose() * by_reading;
            }
            let (mut readings, mut discrepancy) = (0.0, 0.0);
            for (datum, by) in problem.data.iter().zip(by_reading.iter()) {
                let missed = self.estimator.discrepancy * datum.frequency / datum.std;
                discrepancy += (by * missed).powi(2);
                readings += by * by * (1.0 - missed * missed).max(0.0);
            }
            add(BudgetInput::Readings, quantity, readings.sqrt());
            if self.estimator.discrepancy > 0.0 {
                add(BudgetInput::Discrepancy, quantity, discrepancy.sqrt());
            }
            let nuisances = self.estimator.nuisances.iter();
            let properties = nuisances.map(|(parameter, _)| BudgetInput::Property(*parameter));
            let priors = properties.chain([BudgetInput::Weighing]);
            for (input, by) in priors.zip(&moves[count..]) {
                add(input, quantity, by.abs());
            }
            for (input, change) in self.estimator.inputs.iter().zip(&inputs) {
                let std = by_reading.dot(change).abs();
                add(input.input.clone(), quantity, std);
            }
            let scatter = self.set_ups.of_mean(&gradient, &gradient).sqrt();
            if scatter > 0.0 {
                add(BudgetInput::SetUps, quantity, scatter);
            }
        }
        entries
    }

    /// Returns what further measurements would make of the estimate; none where the description is exact.
    pub(super) fn remedies(&self) -> Vec<Remedy> {
        let settings = &self.estimator.settings;
        let is_uncertain = |parameter: Parameter| {
            self.estimator
                .nuisances
                .iter()
                .any(|(other, _)| *other == parameter)
        };
        let mut measures = Vec::new();
        let scale = [Parameter::Modulus, Parameter::Density, Parameter::Thickness];
        if settings.weighed.is_none() && is_uncertain(Parameter::Density) {
            measures.push(Measure::WeighBeam);
        }
        if !self.estimator.has_free_test() && scale.into_iter().any(is_uncertain) {
            measures.push(Measure::FreeTest);
        }
        if CALIPER
            .into_iter()
            .any(|(parameter, _)| is_uncertain(parameter))
        {
            measures.push(Measure::Caliper);
        }
        let mut inputs = self.estimator.inputs.iter();
        if inputs.any(|input| input.is_mass && input.std > SMALL_BALANCE) {
            measures.push(Measure::WeighMasses);
        }
        let remedies = measures.into_iter().map(|measure| Remedy {
            measure,
            stds: self.stds_with(measure),
        });
        remedies.filter(|remedy| !remedy.stds.is_empty()).collect()
    }

    /// Returns the standard deviations of the logarithms with one measurement more.
    fn stds_with(&self, measure: Measure) -> Vec<(Quantity, f64)> {
        let problem = &self.problem;
        let state = &self.best.state;
        let data = problem.data.iter().zip(&state.responses);
        let mut rows: Vec<Point> = data
            .map(|(datum, response)| {
                let scale = response.frequency / datum.std;
                response.sensitivity.map(|slope| scale * slope)
            })
            .collect();
        let mut inputs = self.estimator.standardised_inputs(&problem.data);
        if measure == Measure::WeighMasses {
            for (input, change) in self.estimator.inputs.iter().zip(&mut inputs) {
                if input.is_mass {
                    *change *= (SMALL_BALANCE / input.std).min(1.0);
                }
            }
        }
        if let Some(triangle) = whitening(&inputs, rows.len()) {
            rows = whitened(&triangle, &vec![0.0; rows.len()], &rows).1;
        }
        rows.extend_from_slice(&state.jacobian[problem.data.len()..]);
        let mut gradient = [0.0; PARAMETERS];
        match measure {
            Measure::WeighBeam => {
                for parameter in Parameter::OF_MASS {
                    gradient[parameter.index()] = 1.0 / BALANCE;
                }
                rows.push(gradient);
            }
            // f is proportional to h/L^2 sqrt(E/rho). The whole bar has a length of its own, as well known.
            Measure::FreeTest => {
                let length = self.estimator.settings.tolerances.length.unwrap_or(0.0);
                let std = (LEAST_DISCREPANCY / FREE_MODES.sqrt()).hypot(2.0 * length);
                let powers = [
                    (Parameter::Modulus, 0.5),
                    (Parameter::Density, -0.5),
                    (Parameter::Thickness, 1.0),
                ];
                for (parameter, power) in powers {
                    gradient[parameter.index()] = power / std;
                }
                rows.push(gradient);
            }
            Measure::Caliper => {
                for (parameter, std) in CALIPER {
                    let size = value_along(&along(parameter), &state.point).exp();
                    rows.push(along(parameter).map(|slope| slope * size / std));
                }
            }
            Measure::WeighMasses => {}
        }
        let covariance = Covariance::new(&rows, &self.directions);
        let stds = self
            .budgeted()
            .into_iter()
            .filter_map(|(quantity, gradient)| {
                let scatter = self.set_ups.of_mean(&gradient, &gradient).sqrt();
                Some((quantity, covariance.std(&gradient)?.hypot(scatter)))
            });
        stds.collect()
    }
}
