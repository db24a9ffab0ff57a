//! One mode that does not belong to the others: a wrong peak, a wrong number, a reading spoiled.
//!
//! Each mode is left out in turn. The fall of chi-squared is the square of its deviation t from what the others predict, in
//! standard deviations of that prediction (Cook & Weisberg 1982, 2.2). Let an outlying mode lie off by any size at equal
//! odds for each factor of two. To first order the data are then exp(t^2/2)/t times as probable where this mode is off as
//! where none is. The candidates are the modes for which that is at least a tenth of the largest. Often one alone
//! remains; of few modes several may explain the misfit equally well.
//!
//! They are candidates only where all of this holds:
//! 1. with all modes the model fails, with the least discrepancy: probability below [`FAILS`];
//! 2. without the most probable one it explains the rest: probability above [`EXPLAINS`];
//! 3. that mode deviates by [`DEVIATION`] standard deviations or more;
//! 4. there are five modes or more, and the rest has one more than parameters to be tested by: of fewer, any model that
//!    misses a little looks like an outlying mode;
//! 5. some mode is none of the candidates.
//!
//! What a model misses in all modes is no outlier: then the rest is not explained either.

use super::estimator::ConsistentEstimator;
use super::model::{Parameter, Point};
use super::problem::FULL;
use super::uncertainty::{BudgetInput, LEAST_DISCREPANCY};
use super::{BudgetEntry, ConsistentEstimate, Quantity, ResidualWeights};
use tapjoint_numerics::stats::chi_square_tail;

const FAILS: f64 = 1e-3;
const EXPLAINS: f64 = 0.02;
const DEVIATION: f64 = 4.0;
/// Fewest modes of which one can be outlying.
const FEWEST_MODES: usize = 5;
/// Least probability of a candidate, that of the first being 1.
const SECOND: f64 = 0.1;
/// Errors beyond this share (1) are less usual: such a peak would have another number.
const USUAL: f64 = 0.1;

/// A mode that may not belong to the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlyingMode {
    /// Its number.
    pub mode: usize,
    /// Measured less predicted by the other modes, in percent of the prediction.
    pub percent: f64,
    /// The same in standard deviations of that prediction, its own reading included.
    pub deviations: f64,
    /// Probability of a larger misfit of the other modes.
    pub goodness_without: f64,
    /// Probability that it is this mode, if one of those that are named is off.
    pub probability: f64,
}

/// The estimate without one of the modes that may not belong to the others.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOutAnswer {
    /// The mode.
    pub mode: OutlyingMode,
    /// The estimate without it.
    pub estimate: ConsistentEstimate,
}

impl ConsistentEstimator {
    /// Returns the modes of the described structure one of which does not belong to the others, the most probable first.
    /// Empty where there is none, or no rule finds it. The estimator has to be [`Self::settled`].
    pub fn outlying_modes(&self) -> Vec<OutlyingMode> {
        let described = self.structures.iter().filter(|index| **index == 0).count();
        let is_tested = self.settings.weights == ResidualWeights::Measured
            && self.settings.discrepancy
            && described >= FEWEST_MODES.max(self.settings.fit.len() + 2);
        let goodness = self.goodness.and_then(|goodness| goodness.probability);
        if !is_tested || goodness.is_none_or(|goodness| goodness >= FAILS) {
            return Vec::new();
        }
        let mut found = self.deviations();
        let Some(first) = found.first().copied() else {
            return found;
        };
        let least = SECOND * first.probability;
        found.retain(|mode| mode.probability >= least);
        let is_outlying = first.goodness_without > EXPLAINS
            && first.deviations.abs() >= DEVIATION
            && found.len() < described;
        if !is_outlying {
            return Vec::new();
        }
        let sum: f64 = found.iter().map(|mode| mode.probability).sum();
        for mode in &mut found {
            mode.probability /= sum;
        }
        found
    }

    /// Returns how every mode of the described structure deviates from what the others predict, the most probable outlier
    /// first. Their probabilities are those of one mode being off, whichever. The estimator has to be [`Self::settled`].
    pub fn deviations(&self) -> Vec<OutlyingMode> {
        let mut floor = self.clone();
        if self.settings.discrepancy {
            floor.discrepancy = LEAST_DISCREPANCY;
        }
        let frequencies = floor.frequencies();
        let (renewed, minima) = floor.solve(&frequencies);
        let models = renewed.unwrap_or_else(|| floor.models.clone());
        let Some(all) = minima.first().map(|best| best.state.cost) else {
            return Vec::new();
        };
        let starts: Vec<Point> = minima.iter().map(|minimum| minimum.state.point).collect();
        let known = floor.modes.len() + floor.priors().len();
        let freedom = (known - 1).saturating_sub(floor.directions().len()) as f64;
        let mut found = Vec::new();
        let mut logs = Vec::new();
        for (index, mode) in floor.modes.iter().enumerate() {
            if floor.structures[index] != 0 {
                continue;
            }
            let rest = floor.without(mode.mode);
            let own = rest.frequencies();
            let minima = rest.minima(&rest.problem(&models, &own), &starts, &FULL);
            let Some(best) = minima.first() else {
                continue;
            };
            let point = &best.state.point;
            let guess = models[0].beam_at(point).lambda_of(mode.frequency);
            let predicted = models[0].response(point, mode.mode, guess).frequency;
            let percent = 100.0 * (mode.frequency / predicted - 1.0);
            let fall = (all - best.state.cost).max(0.0);
            found.push(OutlyingMode {
                mode: mode.mode,
                percent,
                deviations: fall.sqrt().copysign(percent),
                goodness_without: chi_square_tail(best.state.cost, freedom),
                probability: 0.0,
            });
            // Below one standard deviation the size of an error is not known.
            let unusual = (0.01 * percent.abs() / USUAL).max(1.0).ln();
            logs.push(0.5 * fall - fall.sqrt().max(1.0).ln() - unusual);
        }
        let largest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = logs.iter().map(|log| (log - largest).exp()).collect();
        let sum: f64 = weights.iter().sum();
        for (mode, weight) in found.iter_mut().zip(weights) {
            mode.probability = weight / sum;
        }
        found.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        found
    }

    /// Returns the estimator without this mode of the described structure; the same where there is none. It is to be
    /// [`Self::settled`] anew.
    #[must_use]
    pub fn without(&self, mode: usize) -> Self {
        let mut rest = self.clone();
        let mut all = self.modes.iter().zip(&self.structures);
        let index = all.position(|(own, structure)| *structure == 0 && own.mode == mode);
        if let Some(index) = index {
            rest.goodness = None;
            rest.modes.remove(index);
            rest.structures.remove(index);
            for input in &mut rest.inputs {
                input.changes.remove(index);
            }
        }
        rest
    }
}

impl LeftOutAnswer {
    /// Returns the estimate where any of these modes may be the outlying one; `None` without any.
    ///
    /// Its limits hold those of all answers. Its values are those of the first, most probable one: they belong to one joint,
    /// whose frequencies and shapes can be predicted. The middle of the limits is no joint of any fit. How far the answers are
    /// apart, by their probability, is a further input of the budget.
    pub fn joined(answers: &[Self]) -> Option<ConsistentEstimate> {
        let (first, others) = answers.split_first()?;
        let mut joined = first.estimate.clone();
        if others.is_empty() {
            return Some(joined);
        }
        for quantity in &mut joined.quantities {
            for other in others {
                let other = other.estimate.quantity(quantity.quantity);
                let ends = other.map(|other| (other.low, other.high));
                let (low, high) = ends.unwrap_or_default();
                quantity.low = quantity.low.zip(low).map(|(own, other)| own.min(other));
                quantity.high = quantity.high.zip(high).map(|(own, other)| own.max(other));
            }
            quantity.further = further_of(quantity.quantity, answers);
            quantity.at_least = quantity.low.filter(|_| quantity.high.is_none());
            quantity.at_most = quantity.high.filter(|_| quantity.low.is_none());
            let spread = spread(quantity.quantity, answers);
            quantity.std =
                quantity
                    .std
                    .zip(spread)
                    .zip(quantity.value)
                    .map(|((std, spread), value)| match is_log(quantity.quantity) {
                        true => std.hypot(spread * value),
                        false => std.hypot(spread),
                    });
        }
        if let Some(covariance) = &mut joined.stiffness_covariance {
            let both = [Quantity::Kx, Quantity::Ky];
            for (row, first) in covariance.iter_mut().zip(both) {
                for (entry, second) in row.iter_mut().zip(both) {
                    *entry += product_of_spreads(first, second, answers).unwrap_or(f64::INFINITY);
                }
            }
        }
        joined.stiffness_covariance = joined
            .stiffness_covariance
            .filter(|rows| rows.iter().flatten().all(|entry| entry.is_finite()));
        let budgeted = joined.budget.first().map_or(&[][..], |entry| &entry.stds);
        let stds = budgeted.iter().filter_map(|(quantity, _)| {
            let spread = spread(*quantity, answers)?;
            Some((*quantity, spread))
        });
        let stds: Vec<(Quantity, f64)> = stds.collect();
        for remedy in &mut joined.remedies {
            for (quantity, std) in &mut remedy.stds {
                *std = std.hypot(spread(*quantity, answers).unwrap_or(0.0));
            }
        }
        joined.budget.push(BudgetEntry {
            input: BudgetInput::OutlyingMode,
            stds,
        });
        Some(joined)
    }
}

/// Returns the limits for a further set-up that hold those of all answers.
fn further_of(quantity: Quantity, answers: &[LeftOutAnswer]) -> Option<(f64, f64)> {
    let mut ends = (f64::INFINITY, f64::NEG_INFINITY);
    for answer in answers {
        let (low, high) = answer.estimate.quantity(quantity)?.further?;
        ends = (ends.0.min(low), ends.1.max(high));
    }
    Some(ends)
}

/// Returns true for a quantity whose logarithm is estimated.
fn is_log(quantity: Quantity) -> bool {
    quantity.lead() != Parameter::Coupling
}

/// Returns the standard deviation of the answers about the first one, of the logarithm where that is estimated; `None` where
/// one has no value.
fn spread(quantity: Quantity, answers: &[LeftOutAnswer]) -> Option<f64> {
    product_of_spreads(quantity, quantity, answers).map(f64::sqrt)
}

/// Returns the mean product of two quantities' distances from the first answer.
fn product_of_spreads(first: Quantity, second: Quantity, answers: &[LeftOutAnswer]) -> Option<f64> {
    let centre = answers.first()?;
    let mut sum = 0.0;
    for answer in answers {
        let mut product = answer.mode.probability;
        for quantity in [first, second] {
            let values = [answer, centre].map(|one| one.estimate.quantity(quantity)?.value);
            let [Some(own), Some(centre)] = values else {
                return None;
            };
            product *= match is_log(quantity) {
                true => (own / centre).ln(),
                false => own - centre,
            };
        }
        sum += product;
    }
    Some(sum)
}
